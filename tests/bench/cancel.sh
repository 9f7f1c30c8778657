#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Interrupts `qmat mat` at random times and prints a Markdown table of how long it takes to end, in seconds of wall time:
#   cancel.sh [--folder FOLDER] [--epsilon E] [--signals N] [--seed N] [FILE...]
# default: ten files of ../shared/data/assets at 2 %, three interrupts each, seed 1. Each file first runs to its end, for
# at most a minute; the interrupts come at times in that run. Exit 1 where one takes more than half a second, or the run
# ends with a status other than 3 or leaves a file. On a busy machine: chrt -r 20 sh tests/bench/cancel.sh; with -f the
# threads that compute would keep the one that asks from running.
set -eu
epsilon=2%
signals=3
seed=1
folder=
options="--folder --epsilon --signals --seed"
. "$(dirname "$0")/functions.sh"
need /usr/bin/time time
folder=${folder:-$top/../shared/data/assets}
if [ $# -eq 0 ]; then
  set -- Avocado/Avocado.gltf DamagedHelmet.glb GlassVaseFlowers.glb SciFiHelmet/SciFiHelmet.gltf Chair.obj VC.glb \
    market.obj pirate.obj robot.obj OpenChessSet/chess_set.usda
fi
for name in "$@"; do
  [ -f "$folder/$name" ] || refuse "there is no file $folder/$name: name files, and their folder with --folder"
done
QMAT_CACHE=off
export QMAT_CACHE

# describe LIMIT FILE: runs until the end or an interrupt; the seconds are in $work/seconds. `--foreground` keeps
# timeout from sending the signal twice.
describe() {
  status=0
  /usr/bin/time -q -f %e -o "$work/seconds" timeout --foreground --preserve-status -s INT "$1" "$build/qmat" mat \
    "$folder/$2" -o "$work/out.glb" --epsilon "$epsilon" --quiet --progress off >/dev/null 2>"$work/complaint" || status=$?
}

echo '| file | s to the end | interrupts | longest s from interrupt to end |'
echo '| --- | ---: | ---: | ---: |'
: >"$work/all"
for name in "$@"; do
  rm -f "$work"/out.*
  describe 60 "$name"
  whole=$(cat "$work/seconds")
  : >"$work/delays"
  i=0
  while [ $i -lt "$signals" ]; do
    i=$((i + 1))
    seed=$((seed + 1))
    at=$(awk -v seed="$seed" -v whole="$whole" 'BEGIN { srand(seed); rand(); printf "%.3f", 0.02 + rand() * whole }')
    rm -f "$work"/out.*
    describe "$at" "$name"
    case $status in
      3) awk -v at="$at" -v name="$name" '{ printf "%.2f %s at %s s\n", $1 - at, name, at }' "$work/seconds" >>"$work/delays" ;;
      0) continue ;; # it was quicker this time
      *) echo "9 $name at $at s: exit $status" >>"$work/delays" ;;
    esac
    if [ -e "$work/out.glb" ]; then echo "9 $name at $at s: a file is left" >>"$work/delays"; fi
  done
  echo "| $name | $whole | $(wc -l <"$work/delays") |" \
    "$(sort -n "$work/delays" | tail -n 1 | sed 's/ .*//') |"
  cat "$work/delays" >>"$work/all"
done
sort -n "$work/all" | tail -n 1 | sed 's/\([^ ]*\) /\nlongest: \1 s, /'
if [ ! -s "$work/all" ]; then echo 'no run was interrupted' >&2 && exit 1; fi
awk '$1 > 0.5 { bad = 1; print "slow: " $0 } END { exit bad }' "$work/all" >&2
