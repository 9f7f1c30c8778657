#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The paper's table 2: time and vertices of HEM (cost: hausdorff) and of Q-MAT+ (cost: slab), as a Markdown table. Each
# model has a row as in the paper, one-sided and ended by the first collapse that exceeds epsilon, and a two-sided row
# in which all edges are tried. Both methods have the same constraint points. Times are processor seconds of the whole
# command, which reads the initial medial mesh from the cache.
#   hem.sh [--epsilon E] [MODEL...]      default: ant, chair and plane of ../shared/data/surfaces at 1 %, else generated
#                                        models
# QMAT_BUILD is the build folder, by default build/release.
set -eu
epsilon=1%
options="--epsilon"
default_models="ant chair plane"
. "$(dirname "$0")/functions.sh"

# simplify MODEL COST ERROR RULE: sets initial, spheres and seconds.
simplify() {
  timed "$build/qmat" run "$top/graphs/qmat_plus.yaml" --to simple --set "model=$1" --set "epsilon=$epsilon" \
    --set "simple.cost=$2" --set "simple.error=$3" --set "simple.on_exceed=$4" --set "simple.finest=$epsilon" \
    --cache "$work/cache" --force=simple --report "$work/run.json" --quiet --progress off
  initial=$(number initial_spheres "$work/run.json")
  spheres=$(number spheres "$work/run.json")
}

echo "| model (initial vertices) | bounded errors | on_exceed | HEM | Q-MAT+ | ratio of time |"
echo "| --- | --- | --- | ---: | ---: | ---: |"
for model in "$@"; do
  "$build/qmat" run "$top/graphs/qmat_plus.yaml" --to initial --set "model=$model" --cache "$work/cache" --quiet \
    --progress off
  for held in "one_sided stop" "two_sided raise"; do
    simplify "$model" hausdorff "${held% *}" "${held#* }"
    hem_spheres=$spheres hem_seconds=$seconds
    simplify "$model" slab "${held% *}" "${held#* }"
    awk -v name="$(basename "${model%.*}")" -v initial="$initial" -v error="${held% *}" -v rule="${held#* }" \
      -v t="$hem_seconds" -v n="$hem_spheres" -v s="$seconds" -v m="$spheres" 'BEGIN {
        printf "| %s (%d) | %s | %s | %.1f s / %d | %.2f s / %d | %.0f |\n", name, initial, error, rule, t, n, s, m, t / s
      }'
  done
done
