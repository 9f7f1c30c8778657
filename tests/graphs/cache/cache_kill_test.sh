#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Four processes on one cache, killed at random moments: cache_kill_test.sh PROGRAM [ROUNDS, default 100]
#
# After every round nothing in the cache may be broken, and nothing may be stuck. At the end a run on what is left is
# right, and a run that stores something leaves nothing but records and blobs.
qmat=$1
rounds=${2:-100}
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=$work/cache
export QMAT_CACHE

write_graph graph.yaml 4% box.off
write_box box.off

# run NAME SPACING OPTION...
run() {
  name=$1
  spacing=$2
  shift 2
  "$qmat" run graph.yaml --set spacing="$spacing" --threads 1 --quiet -o "$name" "$@"
}

round=0
for spacing in 4% 5% 6% 7%; do run "right-$spacing.glb" $spacing --no-cache || die "round $round: a run without a cache"; done

# next_delay: sets delay. Random numbers come from a counter, so that a failing seed can be run again. A subshell would lose
# the counter.
seed=${QMAT_TEST_SEED:-1}
next_delay() {
  seed=$(((seed * 1103515245 + 12345) % 2147483648))
  delay=0.0$((seed / 65536 % 90 + 10))
}

killed=0
while [ "$round" -lt "$rounds" ]; do
  round=$((round + 1))
  # Every fifth round starts anew, so that there is something to store.
  if [ $((round % 5)) -eq 1 ]; then rm -rf cache; fi
  pids=
  for process in 1 2 3 4; do
    spacing=$((process % 2 + 4 + round % 2 * 2))% # two of them make the same
    "$qmat" run graph.yaml --set spacing=$spacing --threads 1 --quiet -o "out-$process.glb" 2>/dev/null &
    pids="$pids $!"
  done
  for pid in $pids; do
    next_delay
    sleep $delay
    kill -KILL "$pid" 2>/dev/null
    wait "$pid" 2>/dev/null
    if [ $? -eq 137 ]; then killed=$((killed + 1)); fi
  done
  "$qmat" cache verify >said.txt 2>&1 || die "round $round: $(cat said.txt)"
done
for spacing in 4% 5% 6% 7%; do
  timeout 60 "$qmat" run graph.yaml --set spacing=$spacing --quiet -o "last-$spacing.glb" || die "round $round: a run afterwards"
  cmp "last-$spacing.glb" "right-$spacing.glb" || die "round $round: another result afterwards"
done
# A run that finds all in the cache writes nothing there and so deletes nothing there.
run stored.glb 8% || die "round $round: a run that stores"
"$qmat" cache verify >said.txt 2>&1 || die "round $round: $(cat said.txt)"
[ -z "$(ls cache/bad cache/tmp | grep -v ':$')" ] || die "round $round: something is left over: $(ls cache/bad cache/tmp)"
[ "$killed" -gt 0 ] || die "round $round: no process was killed"
echo "$rounds rounds, $killed processes killed"
