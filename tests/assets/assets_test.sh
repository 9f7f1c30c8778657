#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Assets as people have them: what each is taken for, what is done to it, and that the result is certified.
#   assets_test.sh PROGRAM
qmat=$1
tests=$(cd "$(dirname "$0")" && pwd)
. "$tests/../lib.sh"
QMAT_CACHE=off
export QMAT_CACHE

# number KEY: the first number of that name in the report.
number() {
  awk -v key="\"$1\":" '$1 == key { gsub(/,/, "", $2); print $2; exit }' report.json
}

epsilon=2%

# asset NAME SPHERES KEY=VALUE...: at $epsilon, at most so many spheres, and these facts in the report.
asset() {
  name=$1
  most=$2
  shift 2
  rm -f report.json
  if [ -e "$tests/$name.off" ]; then
    cp "$tests/$name.off" "$name.off"
  else
    awk -v name="$name" -f "$tests/assets.awk" >"$name.off"
  fi
  expect 0 '' "$qmat" mat --quiet --progress off "$name.off" -o "$name.ma" --epsilon "$epsilon" \
    --require certified --report report.json
  spheres=$(awk 'NR == 1 { print $1 }' "$name.ma")
  if [ -z "$spheres" ] || [ "$spheres" -gt "$most" ]; then fail "$name: $spheres spheres, more than $most"; fi
  for fact in "$@"; do
    found=$(number "${fact%=*}")
    if [ "$found" != "${fact#*=}" ]; then fail "$name: ${fact%=*} is $found, not ${fact#*=}"; fi
  done
}

asset head 5 solids=1 solids_with_holes=1 sheets=0 caps=1 cap_sides=32
asset holes 1 solids=1 solids_with_holes=1 sheets=0 caps=10 cap_sides=30
asset soup 1 solids=1 solids_with_holes=0 sheets=0 caps=0
asset overlap 3 solids=2 sheets=0 caps=0 parts_united=2
asset crossing 12 solids=1 sheets=0 caps=0 parts_united=1
asset plane 4 solids=0 sheets=1 sheet_triangles=128
asset banner 8 solids=0 sheets=1 sheet_triangles=576
asset shell 30 solids=0 sheets=1 sheet_triangles=576
asset leaves 34 solids=0 sheets=7 sheet_triangles=448
# Where sheets cross, the nearest one changes between two constraint points, and the distance may be largest there.
asset arcs 16 solids=0 sheets=2 sheet_triangles=160
asset deep_arcs 19 solids=0 sheets=2 sheet_triangles=160
# Damaged models (tests/bench/damaged.sh), sheets that cross in many places. More points alone only move the places beyond
# epsilon in the first, and a place beyond epsilon hides others in the second. The models are files: after the smallest
# change of its numbers such a model ends another way.
asset torn_capsule 176 solids=0 sheets=33
asset creased_capsule 136 solids=0 sheets=8
# Flat tetrahedra whose corners lie on a circle, up to rounding: a computed circumcentre was in the other lobe of the
# letter, and its links went through air.
asset letter_b 30 solids=1 sheets=0
asset pierced_letter_b 30 solids=1 sheets=0
# Walls thinner than the distance between samples: tubes keep their handle, a box its void, a shelf its openings.
asset thin_tube 9 solids=1 sheets=0 loops=1
asset thin_box 9 solids=2 sheets=0 loops=0 voids=1
asset shelf 22 solids=1 sheets=0 loops=4
asset card 4 solids=0 sheets=1 sheet_triangles=120

# The cap is the disc that cut the neck: of 32 sides, in a circle of the radius sin(3/16 pi).
awk -v name=head -f "$tests/assets.awk" >head.off
expect 0 '' "$qmat" mat --quiet --progress off head.off -o head.ma --epsilon 2% --report report.json
holds 'the area of the cap' awk -v area="$(number cap_area)" 'BEGIN {
  r = sin(3 * atan2(0, -1) / 16)
  exact = 16 * r * r * sin(atan2(0, -1) / 16)
  exit !(area > 0.9 * exact / 12 && area < 1.1 * exact)
}'
finish
