#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Compares what `qmat mat` makes of models with the committed table tests/quality/expected.txt:
#   gate.sh [--renew] [--table FILE] [--reports FOLDER] [BUILD_FOLDER] [MODEL...]
# A row fails when it has more spheres, a larger error, no certificate or a Betti number farther from the solid's than
# the table says. A better row passes and asks for a renewal. --renew writes what was measured into the table.
# --reports names a folder of reports, FAMILY/MODEL@EPSILON.json: those that are there are taken, the others are added.
# BUILD_FOLDER is build/release by default. MODELs name the models to measure; default: all generated ones at 1 % and
# 2 %, and those of ../shared/data/surfaces, where that folder is present, at 1 %.
set -u
quality=$(cd "$(dirname "$0")" && pwd) || exit 2
top=$quality/../..
renew=
table=$quality/expected.txt
reports=
while [ $# -gt 0 ]; do
  case $1 in
    --renew) renew=yes ;;
    --table) table=$2 && shift ;;
    --reports) reports=$(cd "$2" && pwd) && shift || exit 2 ;;
    *) break ;;
  esac
  shift
done
build=$(cd "${1:-$top/build/release}" && pwd) || exit 2
[ $# -eq 0 ] || shift
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
reports=${reports:-$work/reports}
mkdir -p "$reports/generated" "$reports/surfaces" || exit 2
QMAT_CACHE=off # the figures are those of this build
LC_ALL=C # awk writes decimal points
export QMAT_CACHE LC_ALL

"$build/qmat_models" all "$work/models" >"$work/made.txt" || exit 2

# measure FAMILY FILE EPSILON: adds the row FAMILY/MODEL EPSILON to $work/figures.
measure() {
  row=$1/$(basename "${2%.*}")
  report=$reports/$row@$3.json
  if [ ! -s "$report" ]; then
    timeout 300 "$build/qmat" mat "$2" -o "$work/out.ma" -o "$work/out.glb" --epsilon "$3" --report "$report" --quiet \
      --progress off >"$work/said.txt" 2>&1
  fi
  if [ -s "$report" ] && awk -v model="$row" -v epsilon="$3" -f "$quality/figures.awk" "$report" >"$work/row"; then
    cat "$work/row" >>"$work/figures"
  else
    echo "$row $3 failed: $(head -n 1 "$work/said.txt")" >>"$work/figures"
  fi
}

# wanted FILE [MODEL...]: whether the file is one of these models; without any, every file is.
wanted() {
  file=$(basename "${1%.*}")
  shift
  [ $# -gt 0 ] || return 0
  for model in "$@"; do
    [ "$model" != "$file" ] || return 0
  done
  return 1
}

: >"$work/figures"
: >"$work/said.txt"
surfaces=0
for path in "$work"/models/*.off; do
  wanted "$path" "$@" || continue
  measure generated "$path" 1%
  measure generated "$path" 2%
done
for path in "$top"/../shared/data/surfaces/*; do
  [ -e "$path" ] || continue
  surfaces=1
  if wanted "$path" "$@"; then measure surfaces "$path" 1%; fi
done

if [ -z "$renew" ]; then
  awk -v surfaces=$surfaces -v partial=$(($# > 0)) -f "$quality/compare.awk" "$table" "$work/figures"
  exit
fi
if awk 'NF != 12 { print; bad = 1 } END { exit !bad }' "$work/figures" >&2; then exit 1; fi
# Rows of models that were not measured stay.
{
  sed -n '/^#/p' "$table"
  awk '/^#/ || NF == 0 { next } { rows[$1 " " $2] = $0 } END { for (row in rows) print rows[row] }' "$table" \
    "$work/figures" | LC_ALL=C sort | awk '{
      printf "%-26s %-4s %7d %8s %8s  %-9s %9d %5s %5s %9s %5s %5s\n", $1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12
    }'
} >"$work/renewed"
cat "$work/renewed" >"$table" && echo "renewed: $(wc -l <"$work/figures") rows of $table"
