#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Measures both errors against the number of medial vertices for four methods: Q-MAT+ as implemented here, the paper's
# rules (one bounded error; the first collapse that exceeds it ends the run), PMAT, and the public Q-MAT. Each is one
# chain of collapses of the same initial medial mesh. Writes an SVG, and the same as a Markdown table to stdout.
#   curve.sh [-o FILE.svg] [MODEL...]      default: curve.svg; ant, plane and spot of ../shared/data/surfaces, else
#                                          generated models
# QMAT_BUILD is the build folder, by default build/release. An error is the lower bound of medial.evaluate.
set -eu
out=curve.svg
options="-o"
default_models="ant plane spot"
. "$(dirname "$0")/functions.sh"

# measure MODEL VERTICES SETTING...: "VERTICES OUT IN", both errors of that level of the chain with these settings.
measure() {
  model=$1
  vertices=$2
  shift 2
  for setting in "$@"; do set -- "$@" --set "chain.$setting" && shift; done
  "$build/qmat" run "$top/tests/bench/curve.yaml" --set "model=$model" --set "vertices=$vertices" "$@" \
    -o "report=$work/errors.json" --cache "$work/cache" --quiet --progress off
  echo "$(number spheres "$work/errors.json")" "$(number surface_to_envelope_at_least "$work/errors.json")" \
    "$(number envelope_to_surface_at_least "$work/errors.json")"
}

echo "| model | vertices | Q-MAT+: surface to envelope | envelope to surface | paper's rules | | PMAT | | public Q-MAT | |"
echo "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
for model in "$@"; do
  name=$(basename "${model%.*}")
  for vertices in 20 30 50 80 120 200 500 1000; do
    line="| $name | $vertices |"
    for method in "Q-MAT+" "paper's rules" "PMAT" "public Q-MAT"; do
      case $method in
        Q-MAT+) found=$(measure "$model" $vertices on_exceed=raise) ;;
        "paper's rules") found=$(measure "$model" $vertices on_exceed=stop error=one_sided) ;;
        PMAT) found=$(measure "$model" $vertices on_exceed=stop cost=pmat) ;;
        *) found=$(measure "$model" $vertices compat=qmat) ;;
      esac
      echo "$found" | tr ' ' '\t' | sed "s/^/$name	$method	/" >>"$work/points"
      line="$line $(percent 2 "$(echo "$found" | cut -d ' ' -f 2)") | $(percent 2 "${found##* }") |"
    done
    echo "$line"
  done
done
awk -f "$top/tests/bench/curve.awk" "$work/points" >"$out.part"
mv "$out.part" "$out"
