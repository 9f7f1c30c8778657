#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Describes random shapes whose medial mesh is known, and compares: a Markdown table and a summary.
#   planted.sh [--epsilon E] [--shapes N]      default: 200 shapes at 1 %
# Chains, trees, rings and slabs with fingers of 3 to 15 spheres take turns, each with 5 and 40 thousand triangles, as they
# are and with 0.1 % of noise on the vertices. QMAT_BUILD is the build folder, by default build/release; it needs the
# target qmat_planted.
set -eu
epsilon=1%
shapes=200
options="--epsilon --shapes"
. "$(dirname "$0")/functions.sh"
[ $# -eq 0 ] || refuse "$1 is no option"
need_built qmat_planted
QMAT_CACHE=off
export QMAT_CACHE

echo "| shape | spheres planted | triangles | noise | spheres found | certified | Betti numbers | seconds |"
echo "| --- | ---: | ---: | ---: | ---: | --- | --- | ---: |"
i=0
while [ "$i" -lt "$shapes" ]; do
  case $((i % 4)) in
    0) kind=chain least=3 ;;
    1) kind=tree least=4 ;;
    2) kind=ring least=5 ;;
    *) kind=slab least=3 ;;
  esac
  case $((i / 4 % 2)) in 0) triangles=5000 ;; *) triangles=40000 ;; esac
  case $((i / 8 % 2)) in 0) noise=0 ;; *) noise=0.001 ;; esac
  spheres=$((least + i * 7 % (16 - least)))
  "$build/qmat_planted" "$kind" "$spheres" "$i" "$triangles" "$noise" "$work/planted.off" "$work/planted.ma"
  if ! timeout 300 "$build/qmat" mat "$work/planted.off" -o "$work/found.ma" --epsilon "$epsilon" \
    --report "$work/report.json" --quiet --progress off 2>"$work/error"; then
    echo "| $kind $i | $spheres | $(sed -n 2p "$work/planted.off" | cut -d ' ' -f 2) | $noise | $(head -n 1 "$work/error") | no | | |"
  else
    betti=right
    for number in components loops voids; do
      if [ "$(number $number "$work/report.json")" != "$(number ${number}_of_solid "$work/report.json")" ]; then
        betti="$(number $number "$work/report.json") $number for $(number ${number}_of_solid "$work/report.json")"
      fi
    done
    certified=no
    if grep -q '"certified": true' "$work/report.json"; then certified=yes; fi
    printf '| %s %d | %d | %d | %s | %d | %s | %s | %.1f |\n' "$kind" "$i" "$spheres" \
      "$(sed -n 2p "$work/planted.off" | cut -d ' ' -f 2)" "$noise" "$(head -n 1 "$work/found.ma" | cut -d ' ' -f 1)" \
      "$certified" "$betti" "$(awk '/^  "seconds":/ { gsub(/,/, "", $2); print $2 }' "$work/report.json")"
  fi
  i=$((i + 1))
done | tee "$work/table"
# A failure ends only the loop, which is not in this shell.
if [ "$(wc -l <"$work/table")" -ne "$shapes" ]; then
  echo "planted.sh: $(wc -l <"$work/table") of $shapes shapes were described" >&2
  exit 1
fi
awk -F '|' '{ more = $6 - $3; n++; at_most += more <= 0; worst = more > worst ? more : worst; certified += $7 ~ /yes/
    right += $8 ~ /right/; if ($4 > 20000 && $9 > slowest) slowest = $9 }
  END { printf "\n%d shapes: at most the planted spheres on %.0f %%, at most %d more, %d certified, %d with the right Betti " \
    "numbers, at most %.1f s with 40 thousand triangles\n", n, 100 * at_most / n, worst, certified, right, slowest }' \
  "$work/table"
