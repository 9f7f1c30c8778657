#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Compares the error of `qmat mat --vertices N` with the least epsilon of a grid whose result has at most N spheres: a
# Markdown table, a summary, and both curves as an SVG.
#   vertices.sh [-o FILE.svg] [--numbers "N..."] [MODEL...]
#                                 default: vertices.svg; 20 to 200; octopus, ant and bug of ../shared/data/surfaces
# The grid falls from 64 % in steps of 5 % until a result has more spheres than the largest N, or to 0.25 %, the least that
# `--vertices` tries. The error of a result is the larger upper bound of medial.evaluate. QMAT_BUILD is the build folder, by default build/release.
set -eu
out=vertices.svg
finest=0.25
numbers="20 30 40 60 80 120 160 200"
options="-o --numbers"
default_models="octopus ant bug"
. "$(dirname "$0")/functions.sh"

# measure MODEL OPTION VALUE: "SPHERES OUT IN" of `qmat mat`.
measure() {
  "$build/qmat" mat "$1" -o "$work/out.ma" "$2" "$3" --report "$work/report.json" --cache "$work/cache" --quiet \
    --progress off
  echo "$(head -n 1 "$work/out.ma" | cut -d ' ' -f 1)" "$(number surface_to_envelope "$work/report.json")" \
    "$(number envelope_to_surface "$work/report.json")"
}

largest=${numbers##* }
echo "| model | N | spheres | error | least epsilon with at most N | ratio |"
echo "| --- | ---: | ---: | ---: | ---: | ---: |"
for model in "$@"; do
  name=$(basename "${model%.*}")
  : >"$work/grid"
  epsilon=64
  while :; do
    found=$(measure "$model" --epsilon "$epsilon%")
    echo "$epsilon $found" >>"$work/grid"
    echo "$found" | tr ' ' '\t' | sed "s/^/$name	--epsilon	/" >>"$work/points"
    [ "${found%% *}" -le "$largest" ] && [ "$epsilon" != "$finest" ] || break
    epsilon=$(awk -v e="$epsilon" -v finest="$finest" 'BEGIN { e /= 1.05; print (e > finest ? e : finest) }')
  done
  for n in $numbers; do
    found=$(measure "$model" --vertices "$n")
    echo "$found" | tr ' ' '\t' | sed "s/^/$name	--vertices	/" >>"$work/points"
    awk -v name="$name" -v n="$n" -v found="$found" '
      $2 <= n { least = $1 / 100 }
      END {
        split(found, f, " ")
        error = f[2] > f[3] ? f[2] : f[3]
        printf "| %s | %d | %d | %.2f %% | %.2f %% | %.2f |\n", name, n, f[1], 100 * error, 100 * least, error / least
      }' "$work/grid"
  done
done | tee "$work/table"
# A failure ends only the loop, which is not in this shell.
rows=$(($# * $(echo "$numbers" | wc -w)))
if [ "$(wc -l <"$work/table")" -ne $rows ]; then
  echo "vertices.sh: $(wc -l <"$work/table") of $rows rows were measured" >&2
  exit 1
fi
awk -F '|' '{ n++; worst = $7 > worst ? $7 : worst; good += $7 <= 1.1; few += $4 <= $3 }
  END { printf "\n%d of %d within 1.1, the worst %.2f; %d with at most N spheres\n", good, n, worst, few }' "$work/table"
awk -f "$top/tests/bench/curve.awk" "$work/points" >"$out.part"
mv "$out.part" "$out"
