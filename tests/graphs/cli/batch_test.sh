#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# qmat batch as a user meets it: batch_test.sh PROGRAM
qmat=$1
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=$work/cache
TMPDIR=$work
export QMAT_CACHE TMPDIR

# child_of PROCESS: its first child, waited for, in $child.
child_of() {
  child=
  tries=0
  while [ -z "$child" ] && [ $tries -lt 1200 ]; do
    child=$(cut -d ' ' -f 1 "/proc/$1/task/$1/children" 2>/dev/null)
    tries=$((tries + 1))
    [ -n "$child" ] || sleep 0.05
  done
  [ -n "$child" ] || child=none
}

write_graph graph.yaml 20%
mkdir models
for width in 1 2 3 4 5 6 7 8 9; do
  write_box models/box$width.off $width
done
echo "OFF 1 2" >"models/bad one.off"

# batch OPTION...
batch() {
  timeout 100 "$qmat" batch graph.yaml "$@" >out.txt 2>err.txt
  code=$?
}

batch --inputs 'models/*.off' --out results --jobs 3
holds "a failing asset makes exit code 1, not $code" test $code -eq 1
holds "the others are made" test "$(ls results/*.glb | wc -l)" -eq 9
holds "they are counted" grep -q '^9 done, 1 failed, 0 not run' out.txt
holds "the failure is told with its place" grep -q '^models/bad one.off:1' out.txt
for width in 1 5 9; do
  "$qmat" run graph.yaml --set model=models/box$width.off -o alone.glb --no-cache --quiet
  holds "the same bytes as alone" cmp alone.glb results/box$width.glb
done
batch --inputs 'models/b*.off' --out results --quiet
holds "--quiet names what failed, and nothing else" sh -c '
  [ ! -s out.txt ] && [ "$(wc -l <err.txt)" -eq 2 ] && grep -q "^models/bad one.off:1" err.txt'
batch --inputs 'models/b*.off' --out results --verbose
holds "--verbose has a table" grep -q '^box1  *from cache  *[0-9.]*$' out.txt
rm -r results "models/bad one.off"
batch --inputs 'models/*.off' --out results --format ma --json
holds "exit code 0, not $code" test $code -eq 0
holds "a line of JSON each" test "$(grep -c '"result":"ok"' out.txt)" -eq 9
holds "what was done before comes from the cache" test "$(grep -c '"hits":4' out.txt)" -eq 9
holds "the other format" test -s results/box1.ma

# Endings with a dot or in capitals; values that are empty.
batch --inputs 'models/*1.off' --out dotted -f .ma -f PLY
holds "endings are those of the graph" test "$(cd dotted && echo *)" = "box1.ma box1.ply"
batch --inputs 'models/*1.off' --out dotted -f .doc
holds "an unknown ending is refused" sh -c "[ $code -eq 2 ] && grep -q 'format' err.txt"
batch --inputs 'models/*1.off' --out dotted -f tar.ma
holds "so is one with two dots" sh -c "[ $code -eq 2 ] && grep -q \"'tar.ma' is not an ending\" err.txt"
batch --inputs 'models/*1.off' --out dotted --remote-cache ''
holds "an empty value stays a value" test -s dotted/box1.glb
batch --inputs 'models/*1.off' --out dotted --cache ''
holds "an empty folder of the cache is an error" sh -c "[ $code -ne 0 ] && grep -q 'cache is empty' out.txt err.txt"
rm -r dotted

batch --inputs 'models/*.off' --out models
holds "models are not looked for in the folder of the results" sh -c "[ $code -eq 2 ] && grep -q 'is the folder of the results' err.txt"

# Paths that go down and up again: results stay in their folder.
mkdir -p models/sub below
cp models/box2.off over.off
printf 'models/box1.off\nmodels/sub/../../over.off\nmodels/sub/.././box3.off\n' >list.txt
batch --inputs list.txt --out below/results
holds "all are made, not $code" test $code -eq 0
holds "results are below the folder" test "$(cd below && find . -name '*.glb' | sort | tr '\n' ' ')" = \
  "./results/box1.glb ./results/box3.glb ./results/over.glb "
rm -r below models/sub over.off list.txt

# A scene of which one mesh has no area: the others are made, and it is told.
mkdir scenes
cat >scenes/two.usda <<'END'
#usda 1.0
def Cube "good" {}
def Mesh "bad" {
  point3f[] points = [(0, 0, 0), (1, 0, 0)]
  int[] faceVertexCounts = [3]
  int[] faceVertexIndices = [0, 0, 1]
}
END
"$qmat" mat scenes -o told --epsilon 20% --set samples.spacing=20% --quiet >out.txt 2>err.txt
holds "the scene is made, not $?" test -s told/two.glb
holds "a mesh that cannot be described is told" grep -q "two.usda: mesh .*bad.* cannot be described" err.txt

# The warnings of a run are told with its model.
printf '#usda 1.0\n(\n  subLayers = [@gone.usda@]\n)\ndef Cube "good" {}\n' >scenes/two.usda
coarse='--set epsilon=20% --set samples.spacing=20%'
expect 0 "qmat: warning: scenes/two.usda: node 'model': /: the sublayer @gone.usda@ is skipped" "$qmat" batch scenes --out told $coarse
"$qmat" mat scenes/two.usda -o told/alone.glb $coarse 2>alone.txt >out.txt
holds "they are those of 'qmat mat'" test "$(sed 's,scenes/two.usda: ,,' err.txt | grep warning:)" = "$(grep warning: alone.txt)"
expect 0 "" "$qmat" batch scenes --out told $coarse --quiet
holds "a quiet batch does not tell them" test ! -s err.txt
expect 0 '"warnings":["node' "$qmat" batch scenes --out told $coarse --json
expect 0 "" "$qmat" batch scenes --out told $coarse --pages
holds "the page has them" grep -q "<br>node .*gone.usda" told/index.html
expect 1 "qmat: warning: scenes/two.usda: node 'model': /: the sublayer @gone.usda@ is skipped" "$qmat" batch scenes --out told --set epsilon=0 \
  --set vertices=1 --set require=certified --set samples.spacing=20%
rm -r scenes told

cp models/box1.off Index.off
batch --inputs 'Inde*.off' --out paged --pages
holds "a model cannot take the name of the page of all" sh -c "[ $code -eq 2 ] && grep -q 'page of all models' err.txt"
rm Index.off

# Pages: one of each model, and one of all, with failures first. Names may need escapes.
cat >pages.yaml <<'END'
qmat: 1
inputs:
  model: model.path
nodes:
  model: { type: scene.read }
  ball: { type: medial.read, params: { path: ball.ma } }
  picture: { type: report.picture, in: { mesh: model.mesh, medial: ball.medial }, params: { width: 32, height: 16 } }
  page: { type: report.page, in: { scene: model.scene, mesh: model.mesh, medial: ball.medial } }
  asset: { type: scene.write, in: { medial: ball.medial } }
outputs:
  asset: asset.file
  picture: picture.file
  page: page.file
END
printf '1 0 0\nv 0 0 0 1\n' >ball.ma
mkdir several
cp models/box1.off 'several/a #1.off'
cp models/box2.off several/b.off
echo OFF >'several/z & bad.off'
timeout 100 "$qmat" batch pages.yaml --inputs 'several/*.off' --out shown --pages --quiet 2>err.txt
holds "a page and a picture of each" test -s 'shown/a #1.html' -a -s 'shown/a #1.png' -a -s shown/b.html -a -s shown/b.glb
holds "rows with escaped names, failures first" sh -c '
  grep "^<tr>" shown/index.html | cut -c 1-400 >rows.txt
  [ "$(wc -l <rows.txt)" -eq 3 ] && sed -n 1p rows.txt | grep -q "z &amp; bad</th><td class=\"result bad\" data-value=\"0\">several/z &amp; bad.off" &&
  sed -n 2p rows.txt | grep -q "src=\"a%20%231.png\".*href=\"a%20%231.html\">a #1</a>"'
timeout 100 "$qmat" batch pages.yaml --inputs 'several/b*.off' --out plain --quiet
holds "without --pages there are none" test "$(ls plain)" = b.glb
timeout 100 "$qmat" run pages.yaml --set model=models/box1.off -o alone.png --no-cache --report alone.json --quiet
holds "a picture alone makes nothing else" sh -c 'grep -q report.picture alone.json && ! grep -q "scene.write\|report.page" alone.json'

# Outputs with paths of their own: each model has its own files, as `qmat run` would write them.
sed '/page/d; s,: asset.file,: { from: asset.file\, path: own/asset.MA },; s,: picture.file,: { from: picture.file\, path: own/picture.svg },' \
  pages.yaml >paths.yaml
echo '  read: { from: model.report, path: own/read.json }' >>paths.yaml
expect 0 "2 done" "$qmat" batch paths.yaml several/b.off models/box1.off --out pathed
holds "the names are the models'" test "$(cd pathed && find . -type f | sort | tr '\n' ' ')" = \
  "./models/box1.json ./models/box1.ma ./models/box1.svg ./several/b.json ./several/b.ma ./several/b.svg "
holds "nothing is beside the graph" test ! -e own
expect 0 "2 done" "$qmat" batch paths.yaml several/b.off models/box1.off --out pathed/ply --format ply
holds "another format is that of the outputs that have it" test "$(ls pathed/ply/several | tr '\n' ' ')" = "b.json b.ply b.svg "
holds "nothing is beside the graph, in another format" test ! -e own
sed 's/^  read:.*/&\n  size: { from: model.report, path: size.json }/' paths.yaml >reports.yaml
expect 0 "1 done" "$qmat" batch reports.yaml several/b.off --out pathed/reports
holds "two reports differ by their names" test "$(ls pathed/reports | tr '\n' ' ')" = "b-read.json b-size.json b.ma b.svg "
sed 's/^  read:.*/  front: { from: picture.file, path: front.svg }/' paths.yaml >pictures.yaml
expect 2 "outputs 'front' and 'picture' would have the same path 'pictured/b.svg'" \
  "$qmat" batch pictures.yaml several/b.off --out pictured
holds "nothing is run" test -z "$(ls pictured)"

# A list, relative to its folder.
printf '\357\273\277# two of them\nbox1.off\r\n\nbox2.off\n' >models/list.txt
batch --inputs models/list.txt --out listed --quiet
holds "a list" test "$code" -eq 0 -a "$(ls listed | wc -l)" -eq 2
holds "quiet" test ! -s out.txt -a ! -s err.txt
batch -i models/list.txt -i 'models/box[34].off' --out twice --quiet
holds "each --inputs counts" test "$(ls twice | tr '\n' ' ')" = "box1.glb box2.glb box3.glb box4.glb "

# A folder that cannot be read is one failure. For root it needs another user, who can run the program: that of LLVM's
# OpenMP aborts where it may not write to /dev/shm and /tmp.
user=
if [ "$(id -u)" -eq 0 ]; then user="setpriv --reuid 65534 --clear-groups"; fi
mkdir -p open/closed
cp models/box1.off open/
cp models/box1.off open/closed.off
chmod -R a+rX "$work"
chmod 0 open/closed
mkdir -m 777 theirs
if $user test -x "$qmat" -a ! -r open/closed 2>/dev/null &&
  $user env TMPDIR="$work/theirs" QMAT_CACHE=off "$qmat" mat open/box1.off -o theirs/probe.ma $coarse >out.txt 2>&1; then
  rm theirs/probe.ma
  expect 1 "2 done, 1 failed, 0 not run" $user env TMPDIR="$work/theirs" QMAT_CACHE=off "$qmat" batch graph.yaml open --out theirs
  holds "the folder is told" grep -q '^open/closed/: cannot read the folder: Permission denied' out.txt
  holds "the others are made" test "$(ls theirs | tr '\n' ' ')" = "box1.glb closed.glb "
  expect 1 "open/closed/: cannot read the folder" $user env TMPDIR="$work/theirs" "$qmat" batch graph.yaml open/closed --out theirs
else
  echo "skipped: a folder that cannot be read (another user who can run the program, and setpriv, are needed)"
fi
chmod 700 open/closed
rm -r open theirs

# A process that crashes, and a batch that is interrupted and goes on.
awk 'BEGIN {
  n = 300; m = 150; pi = 3.14159265358979
  printf "OFF\n%d %d 0\n", n * m, n * m
  for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
    a = 2 * pi * i / n; b = 2 * pi * j / m
    printf "%.9f %.9f %.9f\n", (3 + cos(b)) * cos(a), (3 + cos(b)) * sin(a), sin(b)
  }
  for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
    k = (i + 1) % n; l = (j + 1) % m
    printf "4 %d %d %d %d\n", i * m + j, k * m + j, k * m + l, i * m + l
  }
}' >models/aaa_torus.off
"$qmat" batch graph.yaml --inputs 'models/*.off' --out rest --jobs 1 --set samples.spacing=2% >out.txt 2>err.txt &
running=$!
child_of $running
kill -ABRT "$child" # the address sanitizer makes an exit code of SIGSEGV, but not of this
wait $running
code=$?
holds "a crash is one asset's failure" test $code -eq 1
holds "a crash is told" grep -q '^models/aaa_torus.off: ended by signal 6' out.txt
holds "the rest is made" grep -q '^9 done, 1 failed' out.txt
rm -r rest cache
"$qmat" batch graph.yaml --inputs 'models/*.off' --out rest --jobs 1 --set samples.spacing=2% >out.txt 2>err.txt &
running=$!
child_of $running # by then it listens to signals
kill -TERM $running
wait $running
code=$?
holds "exit code 3 after a signal, not $code" test $code -eq 3
holds "nothing goes on after a signal" test ! -e rest/box9.glb
"$qmat" batch graph.yaml --inputs 'models/*.off' --out hung --jobs 1 --set samples.spacing=2% --no-cache \
  >out.txt 2>err.txt &
running=$!
child_of $running
kill -INT $running # the shell makes the background ignore it
kill -HUP $running
wait $running
code=$?
holds "exit code 3 after the terminal is gone, not $code" test $code -eq 3
holds "nothing goes on without the terminal" test ! -e "/proc/$child" -a -z "$(ls -d qmat-batch-* hung/*.glb 2>/dev/null)"
(
  trap '' HUP # as nohup does
  exec "$qmat" batch graph.yaml --inputs 'models/box*.off' --out kept --jobs 1 --no-cache >out.txt 2>err.txt
) &
running=$!
child_of $running
kill -HUP $running
kill -INT $running
wait $running
code=$?
holds "ignored signals stay ignored: exit code 0, not $code" test $code -eq 0
cp models/aaa_torus.off several/c_torus.off
"$qmat" batch pages.yaml --inputs 'several/*.off' --out half --pages --jobs 1 --set picture.width=2000 \
  --set picture.height=1000 --no-cache >out.txt 2>err.txt &
running=$!
child_of $running
for i in $(seq 600); do
  grep -q '^.2/4.' err.txt && break
  sleep 0.1
done
kill -TERM $running
wait $running
code=$?
holds "an interrupted batch has a page of what it did" sh -c '
  [ "$1" -eq 3 ] && grep "^<tr>" half/index.html | grep "href=\"b.html\"" | grep -q ">done<" &&
  grep "^<tr>" half/index.html | grep ">c_torus<" | grep -q "data-value=\"1\">not run<"' sh $code
batch --inputs 'models/box*.off' --out rest --set samples.spacing=2%
holds "it goes on" test $code -eq 0
holds "no reports are left" test -z "$(ls -d qmat-batch-* 2>/dev/null)"

# A folder for temporary files whose path is long, and one that is not there.
mkdir -p "a folder for temporary files/with a rather long path to it/and ünïcode"
(
  TMPDIR="$work/a folder for temporary files/with a rather long path to it/and ünïcode"
  batch --inputs 'models/box*.off' --out rest
  exit $code
)
holds "a long path of temporary files" test $? -eq 0
(
  TMPDIR=$work/nowhere
  batch --inputs 'models/box*.off' --out rest
  exit $code
)
holds "no folder for temporary files" test $? -eq 1
holds "no folder for temporary files is told" grep -q "^qmat: $work/nowhere: " err.txt

# Mistakes.
cp models/box1.off models/box1.stl
batch --inputs 'models/box1.*' --out results
holds "two results of one name" test $code -eq 2
holds "two results of one name are told" grep -q "would have the same name" err.txt
rm models/box1.stl
batch --inputs 'nothing*' --out results
holds "a pattern without a match" test $code -eq 2
batch --inputs 'nowhere/*.off' --out results
holds "a pattern in no folder" test $code -eq 2
batch --inputs models/list.txt --out results --format txt
holds "no such format" test $code -eq 2
holds "no such format is told once" test "$(grep -c 'known endings' err.txt)" -eq 1
batch --inputs models/list.txt
holds "no folder" test $code -eq 2
batch --inputs models/list.txt --out graph.yaml
holds "a folder that is a file" test $code -eq 1
batch --inputs models/list.txt --out results --jobs 0
holds "no jobs" test $code -eq 2

finish
