#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# qmat mat --depfile in a build of one's own, with Make and with Ninja: depfile_test.sh PROGRAM SOURCE_FOLDER
qmat=$1
source=$2
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=off
export QMAT_CACHE
write_box box.off 1

command="$qmat mat roof.gltf -o roof.ma --quiet --epsilon 10% --set samples.spacing=10% --depfile roof.ma.d"
printf 'roof.ma:\n\t%s\n-include roof.ma.d\n' "$command" >Makefile
printf 'rule mat\n  command = %s\n  depfile = roof.ma.d\nbuild roof.ma: mat\n' "$command" >build.ninja

# made yes|no WHAT: builds; whether the file was made anew.
made() {
  touch before
  sleep 1.1
  $tool >out.txt 2>err.txt || die "$tool, $2"
  new=no
  if [ roof.ma -nt before ]; then new=yes; fi
  [ $new = "$1" ] || fail "$tool, $2: made anew: $new"
}

for tool in make ninja; do
  rm -f roof.ma roof.ma.d
  cp "$source/examples/game/models/"roof.* .
  made yes "the first time"
  made no "the second time"
  sed 's/"version": *"2.0"/"version": "2.0", "generator": "edited"/' roof.gltf >edited
  cmp -s edited roof.gltf && die "the model was not edited"
  cp edited roof.gltf
  made yes "an edited model"
  made no "after an edited model"
  # x of the second vertex: 4 becomes 3.
  printf '\000\000\100\100' | dd of=roof.bin bs=1 seek=12 conv=notrunc status=none
  made yes "an edited side file"
  made no "after an edited side file"
done

# A model that has just been edited is not newer than what is made of it.
for tool in make ninja; do
  for byte in 200 210 220 230; do # 4, 4.25, 4.5, 4.75
    printf "\\000\\000\\$byte\\100" | dd of=roof.bin bs=1 seek=12 conv=notrunc status=none
    $tool >out.txt 2>err.txt || die "$tool: an edited side file"
    $tool >out.txt 2>err.txt || die "$tool: again"
    holds "$tool: nothing to do at once after an edit" grep -q 'up to date\|no work to do' out.txt
  done
done

# A model that is edited during the run is newer than what is made of it.
fine="echo \$\$\$\$ >pid.txt; exec $qmat mat long.off -o long.ma --quiet --progress json --epsilon 1% --set samples.spacing=0.3% --depfile long.d"
printf 'long.ma:\n\t%s 2>events.txt\n-include long.d\n' "$fine" >Makefile.long
printf 'rule mat\n  command = %s 2>events.txt\n  depfile = long.d\nbuild long.ma: mat\n' "$fine" >long.ninja
for tool in "make -f Makefile.long" "ninja -f long.ninja"; do
  rm -f long.ma long.d events.txt pid.txt
  write_box long.off 8
  $tool >out.txt 2>err.txt &
  building=$!
  tries=0
  until grep -q '"event":"start","node":"solid"' events.txt 2>/dev/null || [ $tries -ge 600 ]; do
    sleep 0.02
    tries=$((tries + 1))
  done
  kill -STOP "$(cat pid.txt)"
  sleep 0.1 # file systems have a clock of their own, which ticks
  holds "$tool: the model is edited before the end" test ! -e long.ma
  write_box long.off 9
  kill -CONT "$(cat pid.txt)"
  wait $building || die "$tool: a long run"
  holds "$tool: the output is older than the edited model" test long.off -nt long.ma
  $tool >out.txt 2>err.txt || die "$tool: after an edit during the run"
  holds "$tool: the edited model is made" test long.ma -nt long.off
  $tool >out.txt 2>err.txt || die "$tool: after that"
  holds "$tool: it is made once" grep -q 'up to date\|no work to do' out.txt
done

# A missing image is looked for at each build, until it appears; then it may go again. So may the model, which is told.
# Make still makes a model by a pattern.
for tool in make ninja; do
  rm -f roof.ma roof.ma.d late.png
  sed '0,/{/s//{"images": [{"uri": "late.png"}],/' "$source/examples/game/models/roof.gltf" >roof.gltf
  holds "the model has an image" grep -q 'late.png' roof.gltf
  made yes "a missing image, the first time"
  holds "$tool: the missing image is listed" grep -q '^  late.png' roof.ma.d
  printf '\211PNG\r\n\032\n' >late.png
  made yes "an image that appears"
  made no "after an image that appears"
  rm late.png
  made yes "an image that is gone"
  cp roof.gltf kept.gltf
  rm roof.gltf
  if $tool >out.txt 2>err.txt; then fail "$tool: a model that is gone is told"; fi
  holds "$tool: qmat tells it" grep -q 'roof.gltf: .*cannot open the file' out.txt err.txt
  cp kept.gltf roof.gltf
done
printf '%%.gltf: %%.source\n\tcp $< $@\n' >>Makefile
mv roof.gltf roof.source
tool=make
made yes "a model that another rule makes"
holds "the other rule runs" test -s roof.gltf

# The tiles of a texture have gaps, which are no files that could appear.
cat >tiles.usda <<'END'
#usda 1.0
def Cube "box" {}
def Shader "image" {
  asset inputs:file = @tile.<UDIM>.png@
  asset info:mdl:sourceAsset = @OmniPBR.mdl@
}
END
printf '\211PNG\r\n\032\n' >tile.1002.png
expect 0 "" "$qmat" mat tiles.usda -o tiles.glb --depfile tiles.d --epsilon 20% --set samples.spacing=20%
holds "the tile that is there is listed, and no other" test "$(grep -c '^  ' tiles.d)" -eq 2
rm -f Makefile build.ninja

# Names with what Make and Ninja read as something else.
for tool in make ninja; do
  name='at 12:30 #2[b].off'
  sed 's/^8 6 0/8 6 0/' "$work/box.off" >"$name"
  printf 'all: odd.ma\nodd.ma:\n\t%s mat "at 12:30 #2[b].off" -o odd.ma --quiet --set samples.spacing=10%% --depfile odd.d\n-include odd.d\n' \
    "$qmat" >Makefile
  printf 'rule mat\n  command = %s mat "at 12:30 #2[b].off" -o odd.ma --quiet --set samples.spacing=10%% --depfile odd.d\n  depfile = odd.d\nbuild odd.ma: mat\n' \
    "$qmat" >build.ninja
  rm -f odd.ma odd.d
  touch before
  sleep 1.1
  $tool >out.txt 2>err.txt || die "$tool: a name with a colon"
  $tool >out.txt 2>err.txt || die "$tool: a name with a colon, again"
  touch again
  sleep 1.1
  holds "$tool: nothing to do" test ! odd.ma -nt again
  sed 's/^1 0 0/1.5 0 0/' "$work/box.off" >"$name"
  $tool >out.txt 2>err.txt || die "$tool: the model has changed"
  holds "$tool: a changed model is seen" test odd.ma -nt again
done

# A graph that saves a report by itself: the rule is for the file that -o names, and without -o for the report.
cat >own.yaml <<'END'
qmat: 1
nodes:
  model: { type: scene.read, params: { path: box.off } }
  solid: { type: mesh.solid, in: { mesh: model.mesh } }
  ball: { type: medial.read, params: { path: ball.ma } }
  asset: { type: scene.write, in: { medial: ball.medial } }
outputs: { asset: asset.file, report: { from: solid.report, path: own/report.json } }
END
printf '1 0 0\nv 0 0 0 1\n' >ball.ma
cp "$work/box.off" edited.off
for tool in make ninja; do
  printf 'roof.ma:\n\t%s run own.yaml -o asset=roof.ma --quiet --depfile own.d\n-include own.d\n' "$qmat" >Makefile
  printf 'rule own\n  command = %s run own.yaml -o asset=$out --quiet --depfile own.d\n  depfile = own.d\nbuild roof.ma: own\n' \
    "$qmat" >build.ninja
  rm -rf roof.ma own own.d
  made yes "a graph with a path of its own"
  made no "that graph, the second time"
  holds "$tool: the report is saved, too" test -s own/report.json
  cp edited.off box.off
  made yes "an edited model of that graph"
  made no "after it"
done
holds "the file that is named is the target" grep -q '^roof.ma: ' own.d
expect 0 "" "$qmat" run own.yaml --quiet --depfile own.d
holds "without a name, the report is" grep -q '^own/report.json: ' own.d
expect 0 "" sh -c "$qmat run own.yaml -o asset=-.ma --quiet --depfile own.d >piped.ma"
holds "the standard output is no name" grep -q '^own/report.json: ' own.d
rm -r own own.d
expect 0 "" "$qmat" run own.yaml --no-paths -o asset=roof.ma --quiet --depfile own.d
holds "the report is left out" test ! -e own -a -s own.d
expect 2 "needs an output that is saved to a file" "$qmat" run own.yaml --no-paths --quiet --depfile own.d
rm Makefile build.ninja

# A target that Make takes for a pattern is told; Ninja reads it. A model of such a name is no pattern.
cp box.off 'a%b.off'
expect 0 "Make takes it for a pattern" "$qmat" run own.yaml -o 'asset=a%b.ma' --depfile told.d
expect 0 "" "$qmat" run own.yaml --set 'model.path=a%b.off' -o 'asset=told.ma' --depfile told.d
holds "a model is not told" sh -c '! grep -q pattern err.txt'
printf 'rule own\n  command = %s run own.yaml -o asset=$out --quiet --depfile own.d\n  depfile = own.d\nbuild a%%b.ma: own\n' \
  "$qmat" >build.ninja
expect 0 "" ninja
expect 0 "no work to do" ninja
rm build.ninja

# Names that one of the two cannot read are told; those that neither can are refused before the run.
cp box.off 'a=b.off'
cp box.off 'a;b.off'
expect 2 "neither Make nor Ninja can read the name 'a;b.off'" "$qmat" mat 'a;b.off' -o never.ma --depfile never.d \
  --progress json
holds "no node has started" sh -c '! grep -q start err.txt'
expect 2 "the name 'c;d.ma'" "$qmat" mat box.off -o 'c;d.ma' --depfile never.d --dry-run
expect 0 "" "$qmat" mat box.off -o 'c;d.ma' --epsilon 20% --set samples.spacing=20%
expect 0 "Make does not see when the file changes" "$qmat" mat 'a=b.off' -o told.ma --epsilon 10% --depfile told.d
expect 2 "neither Make nor Ninja can read the name 'a;b.off'" "$qmat" mat 'a;b.off' -o never.ma --depfile never.d
holds "nothing is written" test ! -e never.ma -a ! -e never.d

# What came from the standard input is no dependency, and what goes to the standard output is no target.
expect 0 "" sh -c "$qmat mat - -o piped.ma --quiet --epsilon 10% --depfile piped.d <box.off"
holds "the standard input is not in the rule" test "$(cat piped.d)" = "piped.ma:"
expect 2 "needs an output that is saved to a file" "$qmat" mat box.off -o - --format ma --depfile piped.d
expect 2 "needs an output that is saved to a file" "$qmat" run qmat_plus --set model=box.off --depfile piped.d

# Results with the same bytes as before are as new as the run: of two, both.
"$qmat" mat roof.gltf -o two.ma -o two.ply --quiet --epsilon 10% --set samples.spacing=10%
touch -d 2001-01-01 two.ma two.ply
"$qmat" mat roof.gltf -o two.ma -o two.ply --quiet --epsilon 10% --set samples.spacing=10%
holds "both results are new" test two.ma -nt roof.gltf -a two.ply -nt roof.gltf

# So are side files, which a rule may declare.
"$qmat" mat roof.gltf -o sides.gltf --quiet --epsilon 10% --set samples.spacing=10%
touch -d 2001-01-01 sides.gltf sides.bin
"$qmat" mat roof.gltf -o sides.gltf --quiet --epsilon 10% --set samples.spacing=10%
holds "a side file is new" test sides.bin -nt roof.gltf -a sides.gltf -nt roof.gltf

finish
