#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# One table (Markdown) of what `qmat mat` makes of models, and how long it takes:
#   surfaces.sh [--epsilon E] [MODEL...]      default: all of ../shared/data/surfaces at 1 %, with build/release
# With QMAT_JUDGE set to a program that takes SURFACE MEDIAL.ma and prints one JSON object, its eps_s2r_out, eps_r2s,
# components, euler and centres_outside stand beside our own figures.
set -eu
top=$(cd "$(dirname "$0")/../.." && pwd)
epsilon=1%
if [ "${1:-}" = --epsilon ]; then
  epsilon=$2
  shift 2
fi
if [ $# -eq 0 ]; then set -- "$top"/../shared/data/surfaces/*; fi
if [ ! -e "$1" ]; then
  echo "no models: name some, or put them into ../shared/data/surfaces" >&2
  exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
QMAT_CACHE=off # a time is that of a run
export QMAT_CACHE

# number NAME FILE: the last number of that name in a JSON file.
number() {
  tr ',{}' '\n\n\n' <"$2" | awk -F: -v name="\"$1\"" '{ gsub(/ /, "", $1) } $1 == name { x = $2 } END { print x + 0 }'
}

percent() {
  awk -v x="$1" 'BEGIN { printf "%.2f %%", 100 * x }'
}

judged=${QMAT_JUDGE:+ judge out | judge in | parts | V - E + F | outside |}
rule=${QMAT_JUDGE:+ ---: | ---: | ---: | ---: | ---: |}
echo "| model | triangles | initial spheres | spheres | surface to envelope | envelope to surface | rounds | simplify s | all s |$judged"
echo "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |$rule"
for model in "$@"; do
  name=$(basename "${model%.*}")
  if ! "$top/build/release/qmat" mat "$model" -o "$work/$name.ma" -o "$work/$name.glb" --epsilon "$epsilon" \
    --report "$work/report.json" --quiet --progress off 2>"$work/complaint"; then
    echo "| $name | $(cat "$work/complaint") |"
    continue
  fi
  simplify=$(awk '/"type": "medial.simplify"/ { inside = 1 } inside && /"seconds"/ { gsub(/[^0-9.e-]/, "", $2); print $2; exit }' \
    "$work/report.json")
  seconds=$(awk '/^  "seconds":/ { gsub(/,/, "", $2); print $2 }' "$work/report.json")
  triangles=$(awk '/"triangles":/ { gsub(/[^0-9]/, "", $2); print $2; exit }' "$work/report.json")
  line=$(printf '| %s | %d | %d | %d | %s | %s | %d | %.2f | %.2f |' "$name" "$triangles" \
    "$(number initial_spheres "$work/report.json")" "$(head -n 1 "$work/$name.ma" | cut -d ' ' -f 1)" \
    "$(percent "$(number surface_to_envelope "$work/report.json")")" \
    "$(percent "$(number envelope_to_surface "$work/report.json")")" "$(number rounds "$work/report.json")" \
    "$simplify" "$seconds")
  if [ -n "${QMAT_JUDGE:-}" ]; then
    "$QMAT_JUDGE" "$model" "$work/$name.ma" >"$work/judge.json"
    line="$line $(percent "$(number eps_s2r_out "$work/judge.json")") | $(percent "$(number eps_r2s "$work/judge.json")")"
    line="$line | $(number components "$work/judge.json") | $(number euler "$work/judge.json")"
    line="$line | $(number centres_outside "$work/judge.json") |"
  fi
  echo "$line"
done
