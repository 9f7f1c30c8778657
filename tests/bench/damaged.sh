#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Describes damaged models and counts what happens to them; exit 1 where one crashes, hangs, needs too much memory, fails
# with more than one line, or leaves a file behind when it fails. A result that is written is certified, or says that it
# is not: "beyond epsilon" where an error is above 1.25 epsilon.
#   damaged.sh [--models N] [--first SEED] [--epsilon E] [--resolution N] [--timeout SECONDS]
# default: 300 models at 2 %, of resolution 16, from seed 0, a minute and 4 GB each. qmat_damage (tests/bench/damage.c)
# makes them of the generated models: facets removed, flipped, repeated, split and collapsed, vertices moved, corners
# apart, parts doubled, coordinates at a million. QMAT_BUILD is the build folder, by default build/release; it needs the
# target qmat_damage.
set -eu
models=300
first=0
epsilon=2%
resolution=16
timeout=60
options="--models --first --epsilon --resolution --timeout"
. "$(dirname "$0")/functions.sh"
[ $# -eq 0 ] || refuse "$1 is no option"
need_built qmat_damage
QMAT_CACHE=off
export QMAT_CACHE

seed=$first
: >"$work/outcomes"
while [ "$seed" -lt $((first + models)) ]; do
  what=$("$build/qmat_damage" "$seed" "$resolution" "$work/damaged.off")
  rm -f "$work/report.json" "$work/out.ma"
  status=0
  # The limit is of memory in use, as far as the shell can: of the data segment. A sanitizer reserves more than any limit.
  (if [ -z "${QMAT_SANITIZED:-}" ]; then ulimit -d 4194304 2>/dev/null || true; fi
   exec timeout "$timeout" "$build/qmat" mat "$work/damaged.off" -o "$work/out.ma" --epsilon "$epsilon" \
     --report "$work/report.json" --quiet --progress off) 2>"$work/complaint" || status=$?
  lines=$(grep -cv 'warning: ' "$work/complaint" || true)
  case $status in
    0)
      outcome=certified
      if ! sed -n '/"summary"/,$p' "$work/report.json" | grep -q '"certified": true'; then
        outcome=$(awk -v a="$(number surface_to_envelope "$work/report.json")" \
          -v b="$(number envelope_to_surface "$work/report.json")" -v e="$epsilon" 'BEGIN {
          e = e ~ /%/ ? e / 100 : e
          print ((a > b ? a : b) > 1.25 * e ? "beyond epsilon" : "not certified")
        }')
      fi
      if [ ! -s "$work/out.ma" ]; then outcome='no file'; fi
      ;;
    1 | 2)
      outcome=refused
      if [ "$lines" -ne 1 ] || [ -e "$work/out.ma" ]; then outcome='badly refused'; fi
      ;;
    124) outcome='out of time' ;;
    *) outcome=crash ;;
  esac
  echo "$outcome" >>"$work/outcomes"
  if [ "$outcome" != certified ]; then
    echo "seed $seed: $what: $outcome ($status): $(grep -v 'warning: ' "$work/complaint" | head -n 1 | cut -c 1-200)"
  fi
  seed=$((seed + 1))
done
sort "$work/outcomes" | uniq -c | awk '{ n = $1; $1 = ""; printf "%s%d%s", (NR > 1 ? ", " : ""), n, $0 } END { print "" }'
if grep -qv '^certified$\|^not certified$\|^beyond epsilon$\|^refused$' "$work/outcomes"; then exit 1; fi
