#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The quality gate itself: gate_test.sh BUILD_FOLDER. It fails on each way in which a row can be worse than the table,
# passes on equal and on better rows, and skips only surfaces that are not present.
set -u
quality=$(cd "$(dirname "$0")" && pwd) || exit 1
build=$(cd "$1" && pwd) || exit 1
. "$quality/../lib.sh"

# compare TABLE_ROW ROW [OPTION...]: a measured row against a table of one row.
compare() {
  echo "$1" >table
  echo "$2" >figures
  shift 2
  awk "$@" -f "$quality/compare.awk" table figures
}

table="generated/torus 1% 11 0.766 0.844 yes 1 1 0 1 1 0"
expect 0 "ok " compare "$table" "$table"
# Worse: more spheres, either error, no certificate, each Betti number, the solid's Betti numbers.
expect 1 "12 spheres" compare "$table" "generated/torus 1% 12 0.766 0.844 yes 1 1 0 1 1 0"
expect 1 "0.767 % from surface" compare "$table" "generated/torus 1% 11 0.767 0.844 yes 1 1 0 1 1 0"
expect 1 "0.845 % from envelope" compare "$table" "generated/torus 1% 11 0.766 0.845 yes 1 1 0 1 1 0"
expect 1 "not certified" compare "$table" "generated/torus 1% 11 0.766 0.844 no 1 1 0 1 1 0"
expect 1 "2 components" compare "$table" "generated/torus 1% 11 0.766 0.844 yes 2 1 0 1 1 0"
expect 1 "0 loops" compare "$table" "generated/torus 1% 11 0.766 0.844 yes 1 0 0 1 1 0"
expect 1 "1 voids" compare "$table" "generated/torus 1% 11 0.766 0.844 yes 1 1 1 1 1 0"
expect 1 "- loops" compare "$table" "generated/torus 1% 11 0.766 0.844 yes 1 - - 1 1 0"
expect 1 "the solid has 2 loops" compare "$table" "generated/torus 1% 11 0.766 0.844 yes 1 1 0 1 2 0"
# A row that was not measured, that has no report, or that the table lacks.
expect 1 "no figures" compare "$table" "generated/torus 1% failed: out of memory"
expect 1 "no such row" compare "$table" "generated/cube 1% 11 0.766 0.844 yes 1 1 0 1 1 0"
expect 1 "was not measured" compare "$table" ""
# Better rows pass and ask for a renewal.
expect 0 "renew the table" compare "$table" "generated/torus 1% 10 0.766 0.844 yes 1 1 0 1 1 0"
expect 0 "renew the table" compare "$table" "generated/torus 1% 11 0.766 0.8 yes 1 1 0 1 1 0"
table="surfaces/ant 1% 39 0.921 0.989 yes 1 1 1 1 0 0"
expect 0 "renew the table" compare "$table" "surfaces/ant 1% 39 0.921 0.989 yes 1 0 0 1 0 0"
# Surfaces are skipped with a reason when their folder is absent, and only then.
expect 0 "skipped: quality of surfaces/ant 1%: the folder" compare "$table" ""
expect 1 "was not measured" compare "$table" "" -v surfaces=1

# The whole gate on one model: renewed, compared, and compared with a count that is one lower.
: >table
mkdir reports
gate() {
  sh "$quality/gate.sh" --table "$work/table" --reports reports "$@"
}
expect 0 "renewed: 2 rows" gate --renew "$build" sphere
expect 0 "ok      quality: generated/sphere at 2%" gate "$build" sphere
awk '$2 == "2%" { $3-- } { print }' table >doctored
mv doctored table
expect 1 "FAILED  quality: generated/sphere at 2%" gate "$build" sphere
finish
