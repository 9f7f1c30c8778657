#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Prints a Markdown table of the results of `qmat mat` and its times:
#   surfaces.sh [--epsilon E] [MODEL...]      default: all of ../shared/data/surfaces at 1 %
# Both errors have their two bounds, and the gap between the bounds as a share of epsilon.
# QMAT_JUDGE may name a program that takes SURFACE MEDIAL.ma and the options in QMAT_JUDGE_OPTIONS, and prints a JSON
# object. The table then has its eps_s2r_out and eps_r2s beside the bounds, and its components, euler and
# centres_outside. Such a program samples, so its figures are smaller than the upper bounds: "ABOVE" marks a figure that
# is not. A figure below the lower bound means that the samples missed the worst place.
set -eu
epsilon=1%
options="--epsilon"
. "$(dirname "$0")/functions.sh"
if [ $# -eq 0 ]; then set -- "$top"/../shared/data/surfaces/*; fi
if [ ! -e "$1" ]; then
  echo "no models: name some, or put them into ../shared/data/surfaces" >&2
  exit 2
fi
QMAT_CACHE=off # the times of real runs
export QMAT_CACHE

# bounds NAME JUDGED: the cells of one error from report.json and, with a judge, from judge.json.
bounds() {
  low=$(number "$1_at_least" "$work/report.json")
  high=$(number "$1" "$work/report.json")
  printf ' %s | %s | %s |' "$(percent 2 "$low")" "$(percent 2 "$high")" \
    "$(awk -v low="$low" -v high="$high" -v epsilon="$epsilon" 'BEGIN {
      printf "%.1f %%", 100 * (high - low) / (epsilon ~ /%/ ? epsilon / 100 : epsilon) }')"
  if [ -z "${QMAT_JUDGE:-}" ]; then return; fi
  judged=$(number "$2" "$work/judge.json")
  printf ' %s%s |' "$(percent 2 "$judged")" \
    "$(awk -v judged="$judged" -v high="$high" 'BEGIN { if (judged > high + 1e-6) printf " ABOVE" }')"
}

judge=${QMAT_JUDGE:+ judge |}
tail=${QMAT_JUDGE:+ parts | V - E + F | outside |}
printf '| model | triangles | initial spheres | spheres | surface to envelope, at least | at most | apart |%s' "$judge"
echo " envelope to surface, at least | at most | apart |$judge rounds | simplify s | all s |$tail"
rule=${QMAT_JUDGE:+ ---: |}
echo "| --- | ---: | ---: | ---: | ---: | ---: | ---: |$rule ---: | ---: | ---: |$rule ---: | ---: | ---: |$rule$rule$rule"
failed=0
for model in "$@"; do
  name=$(basename "${model%.*}")
  if ! "$build/qmat" mat "$model" -o "$work/$name.ma" -o "$work/$name.glb" --epsilon "$epsilon" \
    --report "$work/report.json" --quiet --progress off 2>"$work/complaint"; then
    echo "| $name | $(cat "$work/complaint") |"
    failed=$((failed + 1))
    continue
  fi
  if [ -n "${QMAT_JUDGE:-}" ]; then
    # shellcheck disable=SC2086
    "$QMAT_JUDGE" "$model" "$work/$name.ma" ${QMAT_JUDGE_OPTIONS:-} >"$work/judge.json"
  fi
  simplify=$(awk '/"type": "medial.simplify"/ { inside = 1 } inside && /"seconds"/ { gsub(/[^0-9.e-]/, "", $2); print $2; exit }' \
    "$work/report.json")
  seconds=$(awk '/^  "seconds":/ { gsub(/,/, "", $2); print $2 }' "$work/report.json")
  triangles=$(awk '/"triangles":/ { gsub(/[^0-9]/, "", $2); print $2; exit }' "$work/report.json")
  printf '| %s | %d | %d | %d |%s%s %d | %.2f | %.2f |' "$name" "$triangles" \
    "$(number initial_spheres "$work/report.json")" "$(head -n 1 "$work/$name.ma" | cut -d ' ' -f 1)" \
    "$(bounds surface_to_envelope eps_s2r_out)" "$(bounds envelope_to_surface eps_r2s)" \
    "$(number rounds "$work/report.json")" "$simplify" "$seconds"
  if [ -n "${QMAT_JUDGE:-}" ]; then
    printf ' %d | %d | %d |' "$(number components "$work/judge.json")" "$(number euler "$work/judge.json")" \
      "$(number centres_outside "$work/judge.json")"
  fi
  echo
done
if [ "$failed" -gt 0 ]; then
  echo "surfaces.sh: $failed of $# models failed" >&2
  exit 1
fi
