#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The quality gate itself: gate_test.sh BUILD_FOLDER. It fails on each way in which a row can be worse than the table,
# passes on equal and on better rows, and skips only surfaces that are not present.
set -u
quality=$(cd "$(dirname "$0")" && pwd) || exit 1
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
failed=0

# expect CODE TEXT WHAT COMMAND...: the command's exit code, and a text in what it prints.
expect() {
  code=$1
  text=$2
  what=$3
  shift 3
  "$@" >"$work/said.txt" 2>&1
  if [ $? -eq "$code" ] && grep -qF -e "$text" "$work/said.txt"; then
    echo "ok      $what"
  else
    failed=1
    echo "FAILED  $what"
    sed 's/^/        /' "$work/said.txt"
  fi
}

# compare CODE TEXT WHAT ROW [OPTION...]: the row against a table of one row.
row="generated/torus 1% 11 0.766 0.844 yes 1 1 0 1 1 0"
echo "$row" >"$work/table"
compare() {
  echo "$4" >"$work/figures"
  expect "$1" "$2" "$3" awk -f "$quality/compare.awk" "$work/table" "$work/figures"
}
compare 0 "ok " "an equal row passes" "$row"
compare 1 "12 spheres" "one sphere more fails" "generated/torus 1% 12 0.766 0.844 yes 1 1 0 1 1 0"
compare 1 "0.767 % from surface" "a larger error of the surface fails" "generated/torus 1% 11 0.767 0.844 yes 1 1 0 1 1 0"
compare 1 "0.845 % from envelope" "a larger error of the envelope fails" \
  "generated/torus 1% 11 0.766 0.845 yes 1 1 0 1 1 0"
compare 1 "not certified" "a lost certificate fails" "generated/torus 1% 11 0.766 0.844 no 1 1 0 1 1 0"
compare 1 "2 components" "a second component fails" "generated/torus 1% 11 0.766 0.844 yes 2 1 0 1 1 0"
compare 1 "0 loops" "a closed loop fails" "generated/torus 1% 11 0.766 0.844 yes 1 0 0 1 1 0"
compare 1 "1 voids" "a void fails" "generated/torus 1% 11 0.766 0.844 yes 1 1 1 1 1 0"
compare 1 "- loops" "an unknown number of loops fails" "generated/torus 1% 11 0.766 0.844 yes 1 - - 1 1 0"
compare 1 "the solid has 2 loops" "another number of the solid fails" \
  "generated/torus 1% 11 0.766 0.844 yes 1 1 0 1 2 0"
compare 1 "no figures" "a run without a report fails" "generated/torus 1% failed: out of memory"
compare 1 "no such row" "a row that the table lacks fails" "generated/cube 1% 11 0.766 0.844 yes 1 1 0 1 1 0"
compare 1 "was not measured" "a row that is not measured fails" ""
compare 0 "renew the table" "fewer spheres pass with a note" "generated/torus 1% 10 0.766 0.844 yes 1 1 0 1 1 0"
compare 0 "renew the table" "a smaller error passes with a note" "generated/torus 1% 11 0.766 0.8 yes 1 1 0 1 1 0"
echo "surfaces/ant 1% 39 0.921 0.989 yes 1 0 0 1 0 0" >"$work/table"
compare 0 "skipped quality: surfaces/ant 1%: the folder" "an absent surface is skipped with its reason" ""
expect 1 "was not measured" "a present surface that is not measured fails" \
  awk -v surfaces=1 -f "$quality/compare.awk" "$work/table" "$work/figures"
echo "surfaces/ant 1% 39 0.921 0.989 yes 1 1 1 1 0 0" >"$work/table"
compare 0 "renew the table" "a Betti number nearer to the solid's passes with a note" \
  "surfaces/ant 1% 39 0.921 0.989 yes 1 0 0 1 0 0"

# The whole gate on one model: renewed, compared, and compared with a count that is one lower.
: >"$work/table"
mkdir "$work/reports"
gate="sh $quality/gate.sh --table $work/table --reports $work/reports"
expect 0 "renewed: 2 rows" "the table of a sphere is written" $gate --renew "$1" sphere
expect 0 "ok      quality: generated/sphere at 2%" "a sphere is as good as its table says" $gate "$1" sphere
awk '$2 == "2%" { $3-- } { print }' "$work/table" >"$work/doctored"
mv "$work/doctored" "$work/table"
expect 1 "FAILED  quality: generated/sphere at 2%" "a sphere fails where its table says one less" $gate "$1" sphere
exit $failed
