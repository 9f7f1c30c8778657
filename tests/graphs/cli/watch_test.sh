#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# qmat watch: what a saved file makes it do: watch_test.sh PROGRAM
qmat=$1
. "$(dirname "$0")/../../lib.sh"
watching=
clean_up() { if [ -n "$watching" ]; then kill -KILL $watching 2>/dev/null; fi; }
QMAT_CACHE=$work/cache
export QMAT_CACHE

cat >graph.yaml <<'END'
qmat: 1
nodes:
  model:     { type: scene.read, params: { path: models/box.off } }
  thickness: { type: mesh.sdf, in: { mesh: model.mesh } }
  samples:   { type: mesh.sample, params: { spacing: 20% }, in: { mesh: model.mesh, thickness: thickness.thickness } }
outputs: { samples: samples.samples }
END
mkdir models
write_box models/box.off

# runs N WHAT: the N-th run ends within a minute, which is long also on a busy machine.
runs() {
  wait_left=600
  while [ "$(grep -c '^qmat: watching' err.txt)" -lt "$1" ]; do
    wait_left=$((wait_left - 1))
    [ $wait_left -gt 0 ] || die "$2: no run"
    sleep 0.1
  done
  [ "$(grep -c '^qmat: watching' err.txt)" -eq "$1" ] || die "$2: too many runs"
}

# was NODE STATE WHAT: of the last run.
was() {
  [ "$(sed 's/from cache/hit/; s/ ran / run /' out.txt | awk -v node="$1" '$1 == node { state = $3 } END { print state }')" = "$2" ] || die "$3: $1 is not $2"
}

: >err.txt # it is looked into before the program has opened it
"$qmat" watch graph.yaml --verbose >out.txt 2>err.txt &
watching=$!
runs 1 "the first"
grep -q 'watching 2 files' err.txt || die "graph and model are watched"
was samples run "the first"
sed 's/20%/25%/' graph.yaml >new.yaml
mv new.yaml graph.yaml
runs 2 "a graph that was replaced"
was thickness hit "a graph that was replaced"
was samples run "a graph that was replaced"
sed -i 's/^2 1 1$/2 1 1.1/' models/box.off
runs 3 "a model that was saved"
was model run "a model that was saved"
touch models/box.off graph.yaml
echo "not ours" >models/other.off
sleep 1
runs 3 "nothing that counts"
cp graph.yaml right.yaml
echo "nodes: twice" >>graph.yaml
runs 4 "a mistake"
grep -q 'graph.yaml:[0-9]*:[0-9]*:' err.txt || die "a mistake is told with its place"
cp right.yaml graph.yaml
runs 5 "the mistake mended"
was samples hit "the mistake mended"
rm models/box.off
runs 6 "a model that is gone"
mkdir elsewhere
write_box elsewhere/box.off
ln -s ../elsewhere/box.off models/box.off
runs 7 "a link to a model"
sed 's/^2 1 1$/2 1 1.2/' elsewhere/box.off >new.off
mv new.off elsewhere/box.off
runs 8 "a model in another folder, behind the link"
write_box new.off 3
mv new.off models/box.off
runs 9 "a file in place of the link"
mv models before
runs 10 "a folder that is gone"
mkdir next
write_box next/box.off 4
mv next models
runs 11 "another folder in its place"
sed 's/^4 1 1$/4 1 1.1/' models/box.off >new.off
mv new.off models/box.off
runs 12 "a model in the new folder"
mv models after
runs 13 "this folder is gone, too"
ln -s before models
runs 14 "a link in place of the folder"
ln -s after next
mv -T next models
runs 15 "a link that leads elsewhere"
kill -TERM $watching
wait $watching
code=$?
watching=
[ $code -eq 0 ] || die "exit code 0, not $code"
