#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Files, folders, patterns, streams and built-in graphs, as people type them: typing_test.sh PROGRAM SOURCE_FOLDER
qmat=$1
source=$2
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=$work/cache
TMPDIR=$work/temporary
export QMAT_CACHE TMPDIR
mkdir temporary
coarse="--epsilon 10% --set samples.spacing=10%"

write_box box.off
expect 0 "" "$qmat" mat box.off -o right.glb -o right.ma $coarse

# The standard input and output.
"$qmat" mat - -o - $coarse <box.off >out.glb 2>err.txt
holds "what is printed about a file on the standard output is elsewhere" grep -q "^stdin: [0-9]* spheres" err.txt
holds "glTF on the standard output" test "$(head -c 4 out.glb)" = glTF
"$qmat" mat - -o -.ma $coarse --quiet <box.off >out.ma 2>err.txt
holds "a format on the standard output" cmp right.ma out.ma
"$qmat" mat box.off -o - --format ma $coarse --quiet >out.ma 2>err.txt
holds "--format on the standard output" cmp right.ma out.ma
"$qmat" run - --set model=box.off --set epsilon=10% --set samples.spacing=10% -o -.ma -q \
  <"$source/graphs/qmat_plus.yaml" >out.ma 2>err.txt
holds "a graph from the standard input" cmp right.ma out.ma
expect 2 "only one file can go to" "$qmat" mat box.off -o - -o -.ma $coarse
echo "OFF 1 2" | expect 1 "qmat: standard input:1:6: " "$qmat" mat - -o out.ma
printf 'qmat: 1\nnodes:\n  a: { type: mesh.sfd }\n' | expect 2 "standard input:3:14: " "$qmat" check -
cat >piped.yaml <<'END'
qmat: 1
nodes:
  model: { type: scene.read, params: { path: box.off } }
  solid: { type: mesh.solid, in: { mesh: model.mesh } }
outputs:
  report: { from: solid.report, path: made/solid.json }
END
expect 0 "made/solid.json" "$qmat" run - <piped.yaml
holds "paths of a graph from the standard input are relative to the working folder" test -s made/solid.json
expect 0 "standard input: 2 nodes" "$qmat" check - <piped.yaml
printf 'qmat: 1\nnodes:\n  a: { type: mesh.sfd }\n  b: { type: mesh.sfd }\n' | expect 2 "standard input:3:14: " "$qmat" check -
holds "each mistake names the standard input" test "$(grep -c '^qmat: standard input:' err.txt)" -eq 2
rm -r made
holds "nothing is left in the temporary folder" test -z "$(ls temporary)"
"$qmat" info - <box.off >out.txt 2>err.txt
holds "the standard input by its name" grep -qx "standard input: a surface" out.txt
echo "OFF 1 2" | expect 1 "qmat: standard input:1:6: " "$qmat" info - nothere.off
echo "OFF 1 2" >broken.off
"$qmat" info - --json <broken.off >out.txt 2>err.txt
holds "no path that nobody knows" sh -c '! grep -q temporary out.txt err.txt'
holds "the standard input in JSON" grep -q '"file": "standard input"' out.txt
for signal in HUP INT QUIT TERM; do
  mkfifo pipe
  sh -c 'trap - HUP INT QUIT TERM; exec env --default-signal "$0" mat - -o waiting.ma <pipe' "$qmat" >out.txt 2>err.txt &
  waiting=$!
  exec 9>pipe
  tries=0
  while [ -z "$(ls temporary)" ] && [ $tries -lt 100 ]; do
    sleep 0.1
    tries=$((tries + 1))
  done
  kill -$signal $waiting
  wait $waiting
  code=$?
  exec 9>&-
  rm pipe
  holds "SIG$signal ends a read that waits: exit $code" test $code -eq 3
  holds "SIG$signal leaves nothing behind" test -z "$(ls temporary)" -a ! -e waiting.ma
done

"$qmat" mat - -o out.ma --report failed.json <broken.off >out.txt 2>err.txt
"$qmat" mat - -o out.ma --report run.json $coarse -q <box.off >out.txt 2>err.txt
holds "reports of a failure and of a run name the standard input" \
  sh -c 'grep -q "\"file\": \"standard input\"" failed.json && grep -q "\"-\"" run.json && ! grep -q "temporary/" failed.json run.json'

# Names cannot move the cursor.
cp box.off "$(printf 'b\033[2Jx.off')"
"$qmat" info "$(printf 'b\033[2Jx.off')" >out.txt 2>err.txt
holds "no escape sequence of a file's name" sh -c '! grep -q "$(printf "\\033")" out.txt'

# Output folders are made, but not by a mistake.
expect 0 "deep/down/box.glb (" "$qmat" mat box.off -o deep/down/box.glb --report deep/reports/box.json $coarse
holds "the same file" cmp right.glb deep/down/box.glb
holds "a report in a new folder" test -s deep/reports/box.json
expect 2 "known endings" "$qmat" mat box.off -o typo/box.xyz
holds "a mistake makes no folder" test ! -e typo

# Several models, folders and patterns: results have the models' sub-folders.
mkdir -p models/a models/b/c models/.hidden
for name in a/spot b/spot b/c/spot .hidden/spot; do cp box.off models/$name.off; done
echo "a text" >models/a/notes.txt
ln -s .. models/b/back
mirrored="a/spot.glb b/c/spot.glb b/spot.glb"
# made FOLDER: the files in it.
made() { (cd "$1" && find . -type f | sed 's/..//' | LC_ALL=C sort | tr '\n' ' ' | sed 's/ $//'); }
expect 0 "" "$qmat" mat models/a/spot.off -o alone.glb $coarse
expect 0 "3 done, 0 failed, 0 not run: " "$qmat" mat models -o folder $coarse
holds "a folder" test "$(made folder)" = "$mirrored"
holds "the same bytes as alone" cmp alone.glb folder/b/c/spot.glb
expect 0 "3 done" "$qmat" batch models --out batched --set epsilon=10% --set samples.spacing=10%
holds "batch without a graph" test "$(made batched)" = "$mirrored"
holds "batch without a graph is as mat" cmp alone.glb batched/a/spot.glb
expect 0 "3 done" "$qmat" batch qmat_plus 'models/**/spot.off' --out stars -j 2 --set epsilon=10% --set samples.spacing=10%
holds "two stars are any folders" test "$(made stars)" = "$mirrored"
expect 0 "2 done" "$qmat" mat models/a/spot.off ./models/b/spot.off -o two -f ma -f ply $coarse
holds "two files, two formats" test "$(made two)" = "a/spot.ma a/spot.ply b/spot.ma b/spot.ply"
expect 0 "2 done" "$qmat" mat models/a models/b/spot.off models/a/spot.off -o twice $coarse
holds "a model that is named twice is taken once" test "$(made twice)" = "a/spot.glb b/spot.glb"
expect 0 "1 done" "$qmat" mat models/a models/a 'models/a/*.off' -o thrice $coarse
for option in --dry-run "--report all.json" "--depfile all.d" "--progress json"; do
  expect 2 "is for one model" "$qmat" mat models -o unmade $option $coarse
  expect 2 "is for one model" "$qmat" mat box.off -o unmade/ $option $coarse
done
expect 2 "needs the path of a file, not '-'" "$qmat" mat box.off -o unmade.glb --report - $coarse
expect 2 "needs the path of a file, not '-'" "$qmat" mat box.off -o unmade.glb --depfile - $coarse
expect 2 "needs the path of a file, not '-.ma'" "$qmat" extract right.glb -o -.ma
expect 2 "need a folder, not 'unmade.html'" "$qmat" mat box.off models/a/spot.off -o unmade.html $coarse
expect 2 "option '--format' is for results in a folder" "$qmat" mat box.off -o unmade.glb -f ma $coarse
holds "a refused option makes nothing" test ! -e unmade -a ! -e unmade.glb -a ! -e unmade.html -a ! -e -
expect 0 "1 done" "$qmat" mat box.off -o into/ $coarse
holds "one model into a folder" cmp right.glb into/box.glb
cp -r models within
expect 0 "3 done" "$qmat" mat within -o within/results $coarse -f ply
expect 0 "3 done" "$qmat" mat within -o within/results $coarse -f ply
holds "results are no models" test ! -e within/results/results
expect 1 "nothere.off: " "$qmat" mat models/a nothere.off -o some $coarse
expect 2 "-o results/" "$qmat" mat models -o x.glb
expect 2 "there are no models in this folder" "$qmat" mat temporary -o none
expect 2 "no file matches" "$qmat" mat 'models/**/*.obj' -o none
expect 2 "qmat batch models --out results" "$qmat" batch models
expect 2 "'--set epsilon=...'" "$qmat" batch models --out none --epsilon 1%
expect 2 "qmat batch models --out results" "$qmat" batch qmat_plus --out results

# Options: short ones, and the later of two.
expect 0 "qmat 0" "$qmat" -V
expect 0 "" "$qmat" mat box.off -o later.ma -j 1 --set epsilon=30% $coarse --quiet
holds "--epsilon after --set" cmp right.ma later.ma
expect 0 "" "$qmat" mat box.off -o later.ma --epsilon 30% $coarse --set epsilon=10% --quiet
holds "--set after --epsilon" cmp right.ma later.ma
expect 0 "" "$qmat" run qmat_plus -j 1 --set model=box.off --set epsilon=10% --set samples.spacing=10% -o later.ma
holds "a built-in graph by name" cmp right.ma later.ma

# Built-in graphs.
expect 0 "lod " "$qmat" graphs
"$qmat" graphs lod >out.txt
holds "the text of a graph" cmp out.txt "$source/graphs/lod.yaml"
expect 2 "did you mean 'colliders'?" "$qmat" graphs collider
expect 2 "'qmat graphs' lists the built-in ones" "$qmat" run qmat_plsu
cp "$source/graphs/lod.yaml" qmat_plus
expect 0 "qmat_plus: 34 nodes, 11 inputs, 3 outputs, no mistakes" "$qmat" check qmat_plus # the built-in graph has 15
holds "a file comes before a built-in graph" sh -c '"$0" dot qmat_plus | grep -q far_refined' "$qmat"
rm qmat_plus

# The layout of graph files.
for graph in "$source"/graphs/*.yaml "$source"/graphs/paper/*.yaml "$source"/examples/game/*.yaml; do
  expect 0 "" "$qmat" fmt --check "$graph"
done
printf 'qmat: 1 # one\nnodes:\n    a: {type: scene.read}\n' >loose.yaml
printf 'qmat: 1  # one\nnodes:\n  a: { type: scene.read }\n' >laid_out.yaml
cp loose.yaml before.yaml
expect 1 "loose.yaml:1: the layout differs from here ('qmat fmt loose.yaml' mends it)" "$qmat" fmt --check loose.yaml
holds "--check writes nothing" cmp loose.yaml before.yaml
"$qmat" fmt - <loose.yaml >out.txt 2>err.txt
holds "the standard input to the standard output" cmp out.txt laid_out.yaml
expect 2 "2 of 3 files" "$qmat" fmt nothere.yaml --check laid_out.yaml loose.yaml
expect 0 "loose.yaml: laid out" "$qmat" fmt loose.yaml laid_out.yaml
holds "a file is laid out" cmp loose.yaml laid_out.yaml
# What cannot be read has the exit code of other commands.
: >empty.yaml
for command in check fmt; do
  expect 2 "empty.yaml:1:1: the graph file is empty" "$qmat" $command empty.yaml
  expect 2 "No such file or directory" "$qmat" $command nothere.yaml
  expect 2 "this is a folder" "$qmat" $command .
done
printf 'qmat: 1\nnodes: [a]\n' >loose.yaml
expect 2 "loose.yaml:2:8: lists are not" "$qmat" fmt loose.yaml
expect 2 "this is not a graph file" "$qmat" fmt box.off
ln -s before.yaml link.yaml
expect 0 "" "$qmat" fmt -q link.yaml
holds "a link stays a link" test -L link.yaml
holds "what a link names is laid out" cmp before.yaml laid_out.yaml

# Colliders.
expect 0 "box.xml (" "$qmat" mat box.off -o box.xml --colliders --kind spheres --epsilon 10% --set samples.spacing=10%
holds "MuJoCo's colliders" grep -q '<geom .*type="sphere"' box.xml
expect 1 "require: not certified" "$qmat" mat box.off -o bad.glb --colliders --kind spheres --require certified \
  --epsilon 10% --set samples.spacing=10% --set errors.epsilon=0.0001%
holds "what is not certified is not written" test ! -e bad.glb
expect 0 "" "$qmat" run colliders --set model=box.off --set kind=spheres --set epsilon=10% --set samples.spacing=10% \
  -o run.xml
holds "as the graph makes them" cmp run.xml box.xml
awk 'NR == 2 { n = $1 }
  NR > 2 && NR <= n + 2 { for (i = 0; i < 5; i++) corner[i, NR - 2] = sprintf("v %s %s %s", $1 + 9 * i, $2, $3) }
  NR > n + 2 { for (k = 2; k <= $1 + 1; k++) side[NR] = side[NR] " " $k + 1 }
  END {
    for (i = 0; i < 5; i++) for (k = 1; k <= n; k++) print corner[i, k]
    for (i = 0; i < 5; i++) for (s in side) {
      m = split(side[s], ids, " ")
      printf "f"
      for (k = 1; k <= m; k++) printf " %d", ids[k] + n * i
      print ""
    }
  }' box.off >boxes.obj
expect 0 "with 5 files beside it (" "$qmat" mat boxes.obj -o boxes.urdf --colliders --kind hulls \
  --epsilon 10% --set samples.spacing=10%
expect 2 "'--kind' is for --colliders" "$qmat" mat box.off -o box.xml --kind spheres
expect 2 "'--vertices' is not for --colliders" "$qmat" mat box.off -o box.xml --colliders --vertices 9

finish
