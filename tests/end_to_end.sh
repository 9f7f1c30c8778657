#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Tests the whole program from the command line: end_to_end.sh BUILD_FOLDER [COUNTS_FILE]
#
# `qmat mat` runs on every generated model, and on the real ones in ../shared/data where that folder is present.
# tests/judge.c, which shares no code with the library, measures the results, and tests/quality/gate.sh compares them
# with the committed table. COUNTS_FILE gets "passed failed skipped".
set -u
source=$(cd "$(dirname "$0")/.." && pwd) || exit 1
build=$(cd "$1" && pwd) || exit 1
counts=${2:-/dev/null}
data=$source/../shared/data
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
cd "$work" || exit 1
QMAT_CACHE=off # this build has to compute its own results
LC_ALL=C.UTF-8 # awk writes decimal points
export QMAT_CACHE LC_ALL
passed=0
failed=0
skipped=0

pass() {
  passed=$((passed + 1))
  printf 'ok      %s\n' "$*"
}

fail() {
  failed=$((failed + 1))
  printf 'FAILED  %s\n' "$*"
}

skip() {
  skipped=$((skipped + 1))
  printf 'skipped: %s\n' "$*"
}

# holds WHAT COMMAND...: the command succeeds. Its output is shown when it does not.
holds() {
  what=$1
  shift
  if "$@" >said.txt 2>&1; then
    pass "$what"
  else
    fail "$what"
    sed 's/^/        /' said.txt | head -n 12
  fi
}

qmat() {
  timeout 300 "$build/qmat" "$@"
}

# judge WHAT SURFACE FILE.ma CHECK...: the judge's checks hold. Its figures are part of the line.
judge() {
  what=$1
  shift
  if timeout 300 "$build/qmat_judge" "$@" >figures.txt 2>complaints.txt; then
    pass "$what: $(awk '{ printf "%s%s %s", NR == 1 ? "" : ", ", $1, $2 }' figures.txt)"
  else
    fail "$what: $(awk '{ printf "%s%s %s", NR == 1 ? "" : ", ", $1, $2 }' figures.txt)"
    sed 's/^/        /' complaints.txt
  fi
}

# ---- Generated models ----

mkdir -p reports/generated reports/surfaces
holds "generated models: made" "$build/qmat_models" all models
for surface in models/*.off; do
  name=$(basename "$surface" .off)
  holds "$name: mat" qmat mat "$surface" -o "$name.ma" -o "$name.glb" --epsilon 1% \
    --report "reports/generated/$name@1%.json"
  if [ ! -s "$name.ma" ]; then continue; fi
  # Each solid has one component; only the torus has a loop.
  euler=1
  if [ "$name" = torus ]; then euler=0; fi
  judge "$name: two-sided error, one component, Euler characteristic" "$surface" "$name.ma" --within 1% --components 1 \
    --euler $euler
  holds "$name: the .glb starts as binary glTF" test "$(head -c 4 "$name.glb")" = glTF
  holds "$name: the report has both errors" grep -q '"envelope_to_surface"' "reports/generated/$name@1%.json"
done

# Where the true medial axis is known, the spheres have its centres and radii.
for name in sphere capsule tapered-capsule torus sheet box; do
  if [ ! -s "$name.ma" ]; then continue; fi
  holds "$name: its known medial mesh is made" "$build/qmat_models" "$name" --medial "$name-known.ma"
  # The sheet is 1 % thick, so its spheres are checked to a quarter of that.
  near=1%
  if [ "$name" = sheet ]; then near=0.25%; fi
  judge "$name: the true medial axis" "models/$name.off" "$name.ma" --known "$name-known.ma" --near $near --samples 1000
done

# The number of threads and the command do not change a byte.
for name in octopus torus l-bracket curved-sheet; do
  for threads in 1 2 8; do
    holds "$name: mat with $threads threads" qmat mat "models/$name.off" -o "$name-$threads.ma" -o "$name-$threads.glb" \
      --epsilon 1% --threads $threads
    holds "$name: the same .ma with $threads threads" cmp "$name.ma" "$name-$threads.ma"
    holds "$name: the same .glb with $threads threads" cmp "$name.glb" "$name-$threads.glb"
  done
  holds "$name: run of the shipped graph" qmat run "$source/graphs/qmat_plus.yaml" --set "model.path=models/$name.off" \
    --set simple.epsilon=1% -o "$name-run.ma"
  holds "$name: the same .ma from run" cmp "$name.ma" "$name-run.ma"
done

# The unit of the model does not matter.
awk 'NR == 2 { vertices = $1 }
  NR > 2 && NR <= vertices + 2 { printf "%.17g %.17g %.17g\n", 1024 * $1, 1024 * $2, 1024 * $3; next } { print }' \
  models/l-bracket.off >large.off
holds "l-bracket, 1024 times as large: mat" qmat mat large.off -o large.ma --epsilon 1%
judge "l-bracket, 1024 times as large" large.off large.ma --within 1% --components 1 --euler 1

# A larger epsilon needs fewer spheres, and --vertices limits their number.
spheres() {
  head -n 1 "$1" | cut -d ' ' -f 1
}
holds "octopus: mat at 3 %" qmat mat models/octopus.off -o loose.ma --epsilon 3%
if [ -s loose.ma ] && [ -s octopus.ma ]; then
  holds "octopus: 3 % needs fewer spheres than 1 %" test "$(spheres loose.ma)" -lt "$(spheres octopus.ma)"
fi
holds "octopus: mat to 150 spheres" qmat mat models/octopus.off -o few.ma --vertices 150
if [ -s few.ma ]; then holds "octopus: 150 spheres at most" test "$(spheres few.ma)" -le 150; fi

# Overlapping components are one solid: two boxes, one through a side of the other.
awk 'BEGIN {
  print "OFF\n16 24 0"
  box("0 2 0 1 0 1"); box("1 3 0.25 0.75 0.5 2")
  for (i = 0; i < 2; i++)
    for (k = split("0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5", c); k > 0; k -= 3)
      print 3, c[k - 2] + 8 * i, c[k - 1] + 8 * i, c[k] + 8 * i
}
function box(text, e, j) {
  split(text, e)
  for (j = 0; j < 8; j++) print e[1 + j % 2], e[3 + int(j / 2) % 2], e[5 + int(j / 4)]
}' >parts.off
holds "parts: mat" qmat mat parts.off -o parts.ma -o parts.glb --epsilon 2% --report parts.json
judge "parts: two-sided error, one component, Euler characteristic" parts.off parts.ma --within 2% --components 1 \
  --euler 1
holds "parts: both were united" grep -q '"parts_united": 2' parts.json
holds "parts: the stated errors hold" qmat info parts.glb --against parts.off
qmat info parts.ma --against parts.off >from.txt
holds "parts: a file without epsilon is certified from some epsilon on" \
  test "$(grep -c 'certified from an epsilon of 0\.' from.txt)$(grep -c 'certified for' from.txt)" = 10
qmat info parts.ma --against parts.off --json >from.json
holds "parts: and in JSON" grep -q '"certified_from": 0\.' from.json

# ---- Bad input ----

# refused WHAT FILE [OPTION...]: exit code 1, no output, and one line on stderr, warnings aside, that names the file or the
# node.
refused() {
  what=$1
  file=$2
  shift 2
  rm -f out.ma out.glb
  qmat mat "$file" -o out.ma -o out.glb "$@" >said.txt 2>all_complaints.txt
  code=$?
  grep -v '^qmat: warning: ' all_complaints.txt >complaints.txt
  if [ $code -eq 1 ] && [ "$(wc -l <complaints.txt)" -eq 1 ] && grep -qF -e "$(basename "$file")" -e "node '" complaints.txt &&
    [ -z "$(find . -maxdepth 1 -name '*out.*')" ]; then
    pass "refused: $what: $(cut -c 1-150 complaints.txt)"
  else
    fail "refused: $what: exit code $code"
    sed 's/^/        /' complaints.txt | head -n 5
    ls -a | grep out | sed 's/^/        left: /'
  fi
}

# Without a facet it is a solid with one hole; without its closing, nothing is proved.
awk 'NR == 2 { $3 = 0; $2 = 23 } NR < 42' parts.off >hole.off
qmat info hole.off >hole.txt
holds "holes: info names the cap" grep -q "solid with holes, 1 closed: 3 sides, length" hole.txt
holds "holes: closed, they are certified" qmat mat hole.off -o hole.ma --epsilon 2% --require certified
refused "what is not certified, where that is required" hole.off --epsilon 2% --require certified \
  --set solid.solid=as_is

model=models/l-bracket.off
last=$(($(wc -l <$model) - 1))
vertices=$(sed -n 2p $model | cut -d ' ' -f 1)
refused "a file that does not exist" nowhere.off
: >empty.off
refused "an empty file" empty.off
head -n 300 $model >cut.off
refused "a file that ends among its vertices" cut.off
head -n "$last" $model >cut-facets.off
refused "a file that ends among its facets" cut-facets.off
printf 'OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n' >no-facets.off
refused "no facets" no-facets.off
sed '10s/.*/nan 0 0/' $model >nan.off
refused "a coordinate that is not a number" nan.off
sed '10s/.*/1e999 0 0/' $model >infinite.off
refused "a coordinate that is not finite" infinite.off
sed "\$s/.*/3 0 1 $vertices/" $model >range.off
refused "an index out of range" range.off
sed '$s/.*/3 0 1 -1/' $model >negative.off
refused "a negative index" negative.off
sed '2s/.*/4000000000 5 0/' $model >counts.off
refused "a count of vertices that the file cannot hold" counts.off
sed '2s/.*/99999999999999999999999 5 0/' $model >overflow.off
refused "a count that overflows" overflow.off
sed '$s/.*/3 0 0 1/' $model >degenerate.off
refused "a facet that names a vertex twice" degenerate.off --set model.defects=refuse
sed "\$s/.*/$(sed -n "$((vertices + 5))p" $model)/" $model >duplicate.off
refused "a repeated facet" duplicate.off --set model.defects=refuse
cp $model wrong.stl
refused "an ending that disagrees with the content" wrong.stl
cp $model model.xyz
printf 'not a model\n' >model.xyz
refused "an unknown ending" model.xyz
mkdir folder.off
if ! qmat mat folder.off -o results/ 2>complaints.txt && grep -qx 'qmat: folder.off: there are no models in this folder' complaints.txt &&
  [ ! -e results ]; then
  pass "refused: a folder without models"
else
  fail "refused: a folder without models: $(cat complaints.txt)"
fi
head -c 65536 /dev/zero >zeros.glb
refused "zeros" zeros.glb
head -c 65536 "$build/qmat" >program.ply
refused "a program" program.ply
printf 'OFF\n4 4 0\n0 0 0\n1 0 0\n2 0 0\n3 0 0\n3 0 1 2\n3 0 2 3\n3 1 2 3\n3 0 1 3\n' >flat.off
holds "all vertices on a line: mat" qmat mat flat.off -o flat.ma
holds "all vertices on a line: two spheres of radius zero" grep -qx 'v 3 0 0 0' flat.ma
printf 'OFF\n4 4 0\n5 5 5\n5 5 5\n5 5 5\n5 5 5\n3 0 1 2\n3 0 2 3\n3 1 2 3\n3 0 1 3\n' >point.off
refused "all vertices in one point" point.off
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' >range.obj
refused "an OBJ index out of range" range.obj
printf 'ply\nformat binary_little_endian 1.0\nelement vertex 900000000\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\nabc' >counts.ply
refused "a PLY header that counts more than the file holds" counts.ply
head -c 80 /dev/zero >counts.stl
printf '\377\377\377\177' >>counts.stl
refused "an STL header that counts more than the file holds" counts.stl

# Our own files, damaged: ids that are out of range must not reach the Draco decoder.
if qmat mat $model -o good.glb --epsilon 2% --set asset.draco=true >said.txt 2>&1; then
  holds "a compressed glTF file can be read" qmat mat good.glb -o good.ma --epsilon 5%
  for id in POSITION NORMAL; do
    LC_ALL=C sed "s/\"$id\":[0-9]/\"$id\":9/g" good.glb >hostile.glb
    if cmp -s good.glb hostile.glb; then continue; fi
    refused "an id of $id that is out of range" hostile.glb
  done
  LC_ALL=C sed 's/"bufferView":[0-9]/"bufferView":9/g' good.glb >hostile.glb
  refused "a buffer view that does not exist" hostile.glb
  LC_ALL=C sed 's/"buffer":[0-9]/"buffer":9/g' good.glb >hostile.glb
  refused "a buffer that does not exist" hostile.glb
  size=$(wc -c <good.glb)
  head -c $((size / 2)) good.glb >half.glb
  refused "half a glTF file" half.glb
else
  fail "a compressed glTF file is made"
  sed 's/^/        /' said.txt
fi

# Without it they are left out.
holds "a repeated facet is dropped by default" qmat mat duplicate.off -o dropped.ma

# misused WHAT TEXT ARGUMENT...: exit code 2, and the text on stderr.
misused() {
  what=$1
  text=$2
  shift 2
  qmat "$@" >said.txt 2>complaints.txt
  code=$?
  if [ $code -eq 2 ] && grep -qF -e "$text" complaints.txt; then
    pass "misused: $what"
  else
    fail "misused: $what: exit code $code"
    sed 's/^/        /' complaints.txt
  fi
}
misused "an unknown option" "did you mean '--epsilon'?" mat $model -o out.ma --epsilonn 1%
misused "an unknown command" "did you mean 'mat'?" mta $model -o out.ma
misused "an unknown parameter" "did you mean 'epsilon'?" mat $model -o out.ma --set simple.epsilom=1%

# A glTF scene keeps all of its content. Each mesh gets its own medial mesh, on all of its nodes.
mkdir scene scene/out
cat >scene/in.gltf <<END
{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,2]}],"extensionsUsed":["ACME_glow"],
"nodes":[{"mesh":0,"name":"left","translation":[-5,0,0],"extras":{"kept":[1,2.5,"three"]}},{"mesh":0,"name":"right"},
{"mesh":1,"name":"long","extensions":{"ACME_glow":{"much":0.25}}}],"images":[{"uri":"picture.png"}],
"meshes":[{"name":"cube","primitives":[{"attributes":{"POSITION":0},"indices":1}]},
{"name":"bar","primitives":[{"attributes":{"POSITION":2},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"},
{"bufferView":2,"componentType":5126,"count":8,"type":"VEC3","min":[0,0,0],"max":[3,1,1]}],
"bufferViews":[{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":72},
{"buffer":0,"byteOffset":168,"byteLength":96}],"buffers":[{"byteLength":264,"uri":"data:application/octet-stream;base64,\
AAAAAAAAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAAAAAAAAAAAAgD8AAIA/AACAPwAAAAAAAAAAAACAPwAAAAAAAIA/AACAPwAAgD8AAA\
AAAACAPwAAgD8AAIA/AAABAAMAAAADAAIABAAGAAcABAAHAAUAAAAEAAUAAAAFAAEAAgADAAcAAgAHAAYAAAACAAYAAAAGAAQAAQAFAAcAAQAH\
AAMAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAAAAAAAAAAAAgD8AAIA/AABAQAAAAAAAAAAAAABAQAAAAAAAAIA/AABAQAAAgD\
8AAAAAAABAQAAAgD8AAIA/\
"}]}
END
echo "a picture" >scene/picture.png
holds "a scene: mat" qmat mat scene/in.gltf -o scene/out/scene.gltf --epsilon 10% --threads 1
holds "a scene: its side files are copied" cmp scene/picture.png scene/out/scene_picture.png
holds "a scene: unknown extensions are kept" grep -q '"much": 0.25' scene/out/scene.gltf
holds "a scene: a medial mesh on each node" test "$(grep -c '"qmat_data"' scene/out/scene.gltf)" -eq 3
holds "a scene: extract a node by name" qmat extract scene/out/scene.gltf --node long -o long.ma
holds "a scene: extract an instance" qmat extract scene/out/scene.gltf --node left -o left.ma
holds "a scene: extract another instance" qmat extract scene/out/scene.gltf --node right -o right.ma
holds "a scene: both instances have the same medial mesh" cmp left.ma right.ma
holds "a scene: the stated errors hold" qmat info scene/out/scene.gltf --against scene/in.gltf
mkdir scene/again
for threads in 2 8; do
  holds "a scene: mat with $threads threads" qmat mat scene/in.gltf -o scene/again/scene.gltf --epsilon 10% \
    --threads $threads
  holds "a scene: the same bytes with $threads threads" cmp scene/out/scene.gltf scene/again/scene.gltf
done
holds "a scene: one of its meshes" qmat mat scene/in.gltf -o bar.ma --epsilon 10% --set model.mesh=bar
if qmat mat scene/in.gltf -o all.ma --epsilon 10% --set model.mesh=all >said.txt 2>complaints.txt; then
  fail "a scene: a .ma file cannot hold two medial meshes"
else
  holds "a scene: a .ma file cannot hold two medial meshes" grep -q 'holds one medial mesh, not 2' complaints.txt
  qmat mat scene/in.gltf -o all.ma --set model.mesh=all --progress json >events.txt 2>&1
  holds "a scene: the run fails before it computes anything" test "$(grep -c '"start"' events.txt)" -eq 1
fi

# A mesh that encloses nothing is a sheet. With solid=as_is it is left as it is, with a warning; the run fails where no
# other mesh exists.
sed -e 's/"POSITION":2},"indices":1/"POSITION":2},"indices":3/' \
  -e 's/"max":\[3,1,1\]}/&,{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}/' scene/in.gltf >scene/flat.gltf
holds "a flat mesh in a scene: mat" qmat mat scene/flat.gltf -o scene/out/sheet.gltf --epsilon 10%
holds "a flat mesh in a scene: a medial mesh on each node" test "$(grep -c '"qmat_data"' scene/out/sheet.gltf)" -eq 3
holds "a flat mesh in a scene: certified" qmat info scene/out/sheet.gltf --against scene/flat.gltf
qmat mat scene/flat.gltf -o scene/out/flat.gltf --epsilon 10% --set solid.solid=as_is >flat.txt 2>flat_warnings.txt
holds "a flat mesh as it is: the run succeeds" test $? -eq 0
holds "a flat mesh as it is: one warning names it" \
  test "$(grep -c "mesh 'bar' cannot be described: " flat_warnings.txt)$(grep -c . flat_warnings.txt)" = 11
holds "a flat mesh as it is: it is counted" grep -q 'describe 1 of the 2 meshes' flat.txt
holds "a flat mesh as it is: the other has a medial mesh on each node" \
  test "$(grep -c '"qmat_data"' scene/out/flat.gltf)" -eq 2
sed -e 's/"indices":1/"indices":3/' scene/flat.gltf >scene/flat2.gltf
qmat mat scene/flat2.gltf -o scene/out/flat2.gltf --epsilon 10% --set solid.solid=as_is >flat.txt 2>flat_warnings.txt
holds "a scene of flat meshes: exit code 1" test $? -eq 1
holds "a scene of flat meshes: one error names the first" \
  test "$(grep -c 'cube: ' flat_warnings.txt)$(grep -c . flat_warnings.txt)" = 11
holds "a scene of flat meshes: no file" test ! -e scene/out/flat2.gltf

# ---- Real models ----

if [ -d "$data/surfaces" ]; then
  for surface in "$data"/surfaces/*; do
    name=$(basename "$surface")
    holds "$name: mat" qmat mat "$surface" -o real.ma -o real.glb --epsilon 1% \
      --report "reports/surfaces/${name%.*}@1%.json"
    if [ -s real.ma ]; then judge "$name: two-sided error" "$surface" real.ma --within 1% --samples 3000; fi
    rm -f real.ma real.glb
  done
  # With these samples a joint refit hovers beyond epsilon without a place to constrain, and has to leave more room.
  holds "spot.off, other samples: mat" qmat mat "$data/surfaces/spot.off" -o real.ma --epsilon 1% --set samples.seed=1
  holds "spot.off, other samples: at most 32 spheres" test "$(head -n 1 real.ma | cut -d ' ' -f 1)" -le 32
  rm -f real.ma
  # Open surfaces have no inside: qmat gives a result or one line of error, and does not crash.
  for surface in "$data"/dirty/*; do
    name=$(basename "$surface")
    qmat mat "$surface" -o real.ma --epsilon 2% >said.txt 2>complaints.txt
    code=$?
    if { [ $code -eq 0 ] && [ -s real.ma ]; } || { [ $code -eq 1 ] && [ "$(wc -l <complaints.txt)" -eq 1 ]; }; then
      pass "$name: open: exit code $code $(cut -c 1-150 complaints.txt)"
    else
      fail "$name: open: exit code $code"
      sed 's/^/        /' complaints.txt | head -n 5
    fi
    rm -f real.ma
  done
  for asset in "$data"/gltf/*.glb; do
    name=$(basename "$asset")
    holds "$name: mat" qmat mat "$asset" -o real.glb --epsilon 2%
  done
else
  skip "the real models: the folder ../shared/data/surfaces is not present"
fi

# ---- Quality: no row of tests/quality/expected.txt gets worse ----

sh "$source/tests/quality/gate.sh" --reports reports "$build" >quality.txt 2>&1
code=$?
cat quality.txt
passed=$((passed + $(grep -c '^ok ' quality.txt)))
bad=$(grep -c '^FAILED ' quality.txt)
if [ "$code" -ne 0 ] && [ "$bad" -eq 0 ]; then bad=1; fi
failed=$((failed + bad))
skipped=$((skipped + $(grep -c '^skipped: ' quality.txt)))

echo "$passed $failed $skipped" >"$counts"
printf 'end to end: %d passed, %d failed, %d skipped\n' "$passed" "$failed" "$skipped"
[ "$failed" -eq 0 ]
