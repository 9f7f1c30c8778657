#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The paper's figure 4: vertices and error of the initial medial mesh against theta, as a Markdown table.
#   theta.sh [MODEL...]      default: octopus and plane of ../shared/data/surfaces, else generated models
# QMAT_BUILD is the build folder, by default build/release.
set -eu
options=
default_models="octopus plane"
. "$(dirname "$0")/functions.sh"
echo "| model | theta | samples | medial vertices | largest distance, at least | at most | mean distance |"
echo "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"
for model in "$@"; do
  for theta in 0 0.2 0.4 0.5 0.6 0.8 1; do
    "$build/qmat" run "$top/tests/bench/theta.yaml" --set "model=$model" --set "theta=$theta" \
      -o "report=$work/errors.json" --report "$work/run.json" --cache "$work/cache" --quiet --progress off
    printf '| %s | %s | %d | %d | %s | %s | %s |\n' "$(basename "${model%.*}")" "$theta" \
      "$(number samples_triangulated "$work/run.json")" "$(number spheres "$work/errors.json")" \
      "$(percent 3 "$(number surface_to_envelope_at_least "$work/errors.json")")" \
      "$(percent 3 "$(number surface_to_envelope "$work/errors.json")")" \
      "$(percent 4 "$(number surface_to_envelope_mean "$work/errors.json")")"
  done
done
