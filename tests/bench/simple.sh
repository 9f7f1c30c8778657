#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Simplifies simple solids with few spheres, and compares their numbers with the wanted ones: a Markdown table.
#   simple.sh [--epsilon E] [OPTION...]      default: 1 %; OPTIONs are those of `qmat mat`
# A spheroid has 5 and 20 thousand triangles. QMAT_BUILD is the build folder, by default build/release.
set -eu
epsilon=1%
. "$(dirname "$0")/functions.sh"
QMAT_CACHE=off
export QMAT_CACHE

# spheroid LENGTH N: half axes LENGTH, 1 and 1, of 2 N N triangles.
spheroid() {
  awk -v a="$1" -v n="$2" 'BEGIN {
    pi = atan2(0, -1)
    printf "OFF\n%d %d 0\n%.9f 0 0\n%.9f 0 0\n", 2 + n * n, 2 * n * n, -a, a
    for (i = 1; i <= n; i++)
      for (j = 0; j < n; j++) {
        u = pi * i / (n + 1); v = 2 * pi * j / n
        printf "%.9f %.9f %.9f\n", -a * cos(u), sin(u) * cos(v), sin(u) * sin(v)
      }
    for (j = 0; j < n; j++) {
      k = (j + 1) % n; last = 2 + (n - 1) * n
      printf "3 0 %d %d\n3 1 %d %d\n", 2 + k, 2 + j, last + j, last + k
      for (i = 0; i < n - 1; i++) {
        at = 2 + i * n
        printf "3 %d %d %d\n3 %d %d %d\n", at + j, at + k, at + n + k, at + j, at + n + k, at + n + j
      }
    }
  }'
}

# cylinder N: radius 1 and height 3, with N sides.
cylinder() {
  awk -v n="$1" 'BEGIN {
    pi = atan2(0, -1)
    printf "OFF\n%d %d 0\n0 0 0\n0 0 3\n", 2 + 2 * n, 4 * n
    for (j = 0; j < n; j++)
      printf "%.9f %.9f 0\n%.9f %.9f 3\n", cos(2 * pi * j / n), sin(2 * pi * j / n), cos(2 * pi * j / n), sin(2 * pi * j / n)
    for (j = 0; j < n; j++) {
      a = 2 + 2 * j; b = 2 + 2 * ((j + 1) % n)
      printf "3 0 %d %d\n3 1 %d %d\n3 %d %d %d\n3 %d %d %d\n", b, a, a + 1, b + 1, a, b, b + 1, a, b + 1, a + 1
    }
  }'
}

spheroid 2 50 >"$work/spheroid-2-5000.off"
spheroid 2 100 >"$work/spheroid-2-20000.off"
spheroid 4 50 >"$work/spheroid-4-5000.off"
spheroid 4 100 >"$work/spheroid-4-20000.off"
cylinder 64 >"$work/cylinder.off"
for name in torus box l-bracket curved-sheet; do "$build/qmat_models" $name -o "$work/$name.off"; done

echo "| solid | triangles | wanted | spheres | certified | processor seconds |"
echo "| --- | ---: | ---: | ---: | --- | ---: |"
short=0
while read -r name wanted; do
  rm -f "$work/out.ma"
  times >"$work/before"
  "$build/qmat" mat "$work/$name.off" -o "$work/out.ma" --epsilon "$epsilon" "$@" \
    --report "$work/report.json" --quiet --progress off
  times >"$work/after"
  spheres=$(head -n 1 "$work/out.ma" | cut -d ' ' -f 1)
  certified=no
  if grep -q '"certified": true' "$work/report.json"; then certified=yes; fi
  printf '| %s | %d | %d | %d | %s | %.1f |\n' "$name" "$(sed -n 2p "$work/$name.off" | cut -d ' ' -f 2)" "$wanted" \
    "$spheres" $certified "$(cat "$work/before" "$work/after" | awk '
      { split($1, m, /[ms]/) } NR == 2 { b = 60 * m[1] + m[2] } NR == 4 { print 60 * m[1] + m[2] - b }')"
  if [ "$spheres" -gt "$wanted" ] || [ $certified = no ]; then short=$((short + 1)); fi
done <<END
spheroid-2-5000 4
spheroid-2-20000 4
spheroid-4-5000 4
spheroid-4-20000 4
torus 10
cylinder 26
box 12
l-bracket 18
curved-sheet 16
END
printf '\n%d fall short\n' $short
