#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Records what terminals of 80 and 60 columns show at the end of `qmat mat`, `qmat batch` and runs that fail:
#   terminal.sh [MODEL]
# default: ../shared/data/surfaces/spot.off. Lines that progress drew over are left out, but their width counts. Exit 1
# where a line is wider than the terminal.
set -eu
options=
. "$(dirname "$0")/functions.sh"
need script bsdutils
model=$(realpath "${1:-$top/../shared/data/surfaces/spot.off}")
qmat=$(realpath "$build/qmat")
TERM=xterm
export TERM
unset COLUMNS
cd "$work"
mkdir bin models
ln -s "$qmat" bin/qmat
PATH=$work/bin:$PATH
cp "$model" models/model.off
echo "OFF 1 2" >models/broken.off
bad=0

# on COLUMNS COMMAND: the command and the lines that stay on a terminal of that width.
on() {
  script -qec "stty cols $1 rows 30; $2" /dev/null </dev/null >raw.txt 2>&1 || true
  printf '\n$ %s\n' "$2"
  sed 's/\x1b\[[0-9;]*m//g; s/\r$//; s/.*\r//; s/\x1b\[K//g' raw.txt | sed '/^$/d'
  sed 's/\x1b\[[0-9;]*[mK]//g' raw.txt | tr '\r' '\n' | LC_ALL=C awk -v most="$1" '
    { gsub(/[\200-\277]/, ""); if (length($0) > most) { print "too wide: " $0; bad = 1 } } END { exit bad }' >&2 || bad=1
}

for columns in 80 60; do
  QMAT_CACHE=$work/cache$columns
  export QMAT_CACHE
  printf '%s columns\n' "$columns"
  on $columns "qmat mat models/model.off -o model.glb --epsilon 5%"
  on $columns "qmat batch models --out results$columns --set epsilon=5%"
  on $columns "qmat mat models/broken.off -o broken.glb"
  on $columns "qmat mat missing.off -o missing.glb"
  on $columns "qmat mat models/model.off --epsilom 3%"
  echo
done
exit $bad
