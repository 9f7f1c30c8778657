#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# qmat batch on a real Slurm: a controller and two machines on the loopback, one of which dies in the middle of a batch.
# slurm_test.sh PROGRAM. It takes three minutes, since Slurm waits for two before it starts again what a dead machine ran.
# Where Slurm is not installed or cannot start, it says so and exits with 77: skipped.
qmat=$1
PATH=$PATH:/usr/sbin:/sbin
for program in slurmctld slurmd sbatch munged; do
  if ! command -v $program >/dev/null; then
    echo "skipped: there is no $program (Debian: apt install slurm-wlm munge)"
    exit 77
  fi
done
if [ "$(id -u)" -ne 0 ]; then
  echo "skipped: slurmd needs root"
  exit 77
fi
. "$(dirname "$0")/../../lib.sh"
pids=
clean_up() {
  if [ $failures -ne 0 ]; then tail -n 5 log/*; fi
  # shellcheck disable=SC2086
  if [ -n "$pids" ]; then kill -KILL $pids 2>/dev/null; fi
  kill_machine one
  kill_machine two
}
# kill_machine NAME: what runs there, by the environment that Slurm gives to it and to nobody else, and its keepers.
kill_machine() {
  for folder in /proc/[0-9]*; do
    cat "$folder/environ" 2>/dev/null | tr '\0' '\n' >"$work/environ"
    if grep -qx "SLURMD_NODENAME=$1" "$work/environ" && grep -q "$work" "$work/environ"; then
      keeper=$(awk '$1 == "PPid:" { print $2 }' "$folder/status" 2>/dev/null)
      if [ "${keeper:-1}" -gt 1 ] && grep -q slurmstepd "/proc/$keeper/cmdline" 2>/dev/null; then
        kill -KILL "$keeper" 2>/dev/null
      fi
      kill -KILL "${folder#/proc/}" 2>/dev/null
    fi
  done
}
mkdir state log models

skip() {
  echo "skipped: $*"
  tail -n 3 log/* 2>/dev/null
  exit 77
}

# ---- a cluster ----
host=$(hostname -s)
port=$((20000 + $$ % 3000 * 3)) # three, below those that systems give to clients; remote_cache_test.sh has others
tries=0
while is_taken $port || is_taken $((port + 1)) || is_taken $((port + 2)); do
  port=$((port + 3))
  tries=$((tries + 1))
  [ $tries -lt 100 ] || die "all ports up to $port are taken"
done
SLURM_CONF=$work/slurm.conf
export SLURM_CONF
cat >slurm.conf <<END
ClusterName=qmat
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CredType=cred/munge
SlurmctldPort=$port
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool-%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd-%n.pid
SlurmctldLogFile=$work/log/controller
SlurmdLogFile=$work/log/%n
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SchedulerParameters=batch_sched_delay=1,sched_interval=2
SelectType=select/cons_tres
MaxArraySize=8
SelectTypeParameters=CR_Core
SlurmdTimeout=5
KillWait=2
ReturnToService=2
NodeName=one NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=2 State=UNKNOWN
NodeName=two NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=2 State=UNKNOWN
PartitionName=all Nodes=one,two Default=YES MaxTime=INFINITE State=UP
END
head -c 128 /dev/urandom >key
chmod 600 key
munged --foreground --force --key-file="$work/key" --socket="$work/munge.socket" --pid-file="$work/munged.pid" \
  --log-file="$work/log/munge" --seed-file="$work/seed" >log/munged.out 2>&1 &
pids=$!
sleep 1
slurmctld -D >log/controller.out 2>&1 &
pids="$pids $!"
sleep 1
slurmd -D -N one >log/one.out 2>&1 &
pids="$pids $!"
slurmd -D -N two >log/two.out 2>&1 &
two=$!
pids="$pids $two"
tries=0
until [ "$(timeout 5 sinfo --noheader --format=%t --states=idle -N 2>/dev/null | wc -l)" -eq 2 ]; do
  tries=$((tries + 1))
  [ $tries -lt 60 ] || skip "the cluster does not start here: $(sed -n "s/^.*error: //p" log/one | head -n 1)"
  sleep 1
done

# ---- a batch of ten ----
cat >graph.yaml <<'END'
qmat: 1
nodes:
  model:     { type: scene.read }
  thickness: { type: mesh.sdf, params: { rays: 30 }, in: { mesh: model.mesh } }
  samples:   { type: mesh.sample, params: { spacing: 2% }, in: { mesh: model.mesh, thickness: thickness.thickness } }
  initial:   { type: medial.delaunay, in: { mesh: model.mesh, thickness: thickness.thickness, samples: samples.samples } }
  asset:     { type: scene.write, in: { scene: model.scene, medial: initial.medial } }
inputs: { model: model.path }
outputs: { asset: asset.file }
END
for k in 0 1 2 3 4 5 6 7 8 9; do
  awk -v k=$k 'BEGIN {
    n = 240; m = 120; pi = 3.14159265358979
    printf "OFF\n%d %d 0\n", n * m, n * m
    for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
      a = 2 * pi * i / n; b = 2 * pi * j / m; r = 1 + 0.02 * k
      printf "%.9f %.9f %.9f\n", (3 + r * cos(b)) * cos(a), (3 + r * cos(b)) * sin(a), r * sin(b)
    }
    for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
      p = (i + 1) % n; q = (j + 1) % m
      printf "4 %d %d %d %d\n", i * m + j, p * m + j, p * m + q, i * m + q
    }
  }' >models/torus$k.off
done
"$qmat" run graph.yaml --set model=models/torus3.off --no-cache --quiet -o right.glb || die "a run without Slurm"

QMAT_CACHE=$work/cache
export QMAT_CACHE
# Ten models in an array of eight: two tasks have two.
timeout 600 "$qmat" batch graph.yaml --inputs 'models/*.off' --out results --engine slurm >out.txt 2>err.txt &
batch=$!
tries=0
until timeout 5 squeue --noheader --states=running --nodelist=two 2>/dev/null | grep -q .; do
  tries=$((tries + 1))
  [ $tries -lt 600 ] || die "nothing runs on the second machine"
  sleep 0.1
done
kill -KILL $two
kill_machine two
wait $batch
code=$?
[ $code -eq 0 ] || die "exit code 0, not $code"
grep -q '^10 done, 0 failed, 0 not run' out.txt || die "ten are done"
[ "$(ls results | wc -l)" -eq 10 ] || die "ten results"
cmp right.glb results/torus3.glb || die "the same bytes as without Slurm"
[ -z "$(ls -d results/.qmat-batch-* 2>/dev/null)" ] || die "nothing is left over"

# The same again, on the machine that is left: all from the cache; and one that fails.
echo OFF >models/bad.off
timeout 300 "$qmat" batch graph.yaml --inputs 'models/*.off' --out again --engine slurm --json >out.txt 2>err.txt
code=$?
[ $code -eq 1 ] || die "exit code 1, not $code"
[ "$(grep -c '"hits":5' out.txt)" -eq 10 ] || die "the second batch comes from the cache"
grep '"result":"failed"' out.txt | grep -q 'bad.off' || die "the failure is told"

# Interrupted: the job array is cancelled, and nothing is left of it.
"$qmat" batch graph.yaml --inputs 'models/torus*.off' --out cancelled --engine slurm --force >out.txt 2>err.txt &
batch=$!
tries=0
until timeout 5 squeue --noheader --states=running 2>/dev/null | grep -q .; do
  tries=$((tries + 1))
  [ $tries -lt 600 ] || die "nothing runs that could be cancelled"
  sleep 0.1
done
[ -n "$(ls -d cancelled/.qmat-batch-*)" ] || die "what the machines tell is in the folder that they share"
kill -TERM $batch # the shell makes the background ignore SIGINT
wait $batch
code=$?
[ $code -eq 3 ] || die "exit code 3 after a signal, not $code"
tries=0
while timeout 5 squeue --noheader 2>/dev/null | grep -q .; do
  tries=$((tries + 1))
  [ $tries -lt 600 ] || die "the job array goes on after a signal"
  sleep 0.1
done
[ -z "$(ls -d cancelled/.qmat-batch-* 2>/dev/null)" ] || die "nothing is left over after a signal"
