#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The command line as a user meets it: cli_test.sh PROGRAM SOURCE_FOLDER
qmat=$1
source=$2
. "$(dirname "$0")/../../lib.sh"
# Results of earlier builds must not stand for those of this one; tests/graphs/cache/cache_test.sh tests the cache.
QMAT_CACHE=off
export QMAT_CACHE

write_box box.off
# So few samples, and spheres, that a run takes no second, with sanitizers neither.
coarse="--set samples.spacing=10%"

# Commands and options.
expect 2 "no command is given" "$qmat"
expect 0 "qmat COMMAND" "$qmat" help
expect 0 "qmat COMMAND" "$qmat" --help
expect 2 "did you mean 'run'?" "$qmat" rnu
expect 2 "did you mean 'check'?" "$qmat" help chekc
for command in mat run batch watch why cache check info extract dot graphs nodes node version help; do
  expect 0 "Options:" "$qmat" help $command
  expect 0 "qmat $command" "$qmat" $command --help
done
expect 0 "--epsilon" "$qmat" help mat
expect 0 "0.01" "$qmat" mat --help
"$qmat" mat --help | tr -s '\n ' ' ' >options.txt
holds "mat has the default of the graph, not that of medial.features" grep -q "none, sharp or auto, default auto" options.txt
holds "mat tells all of an option of the colliders" grep -q "both, contain or inside, default contain" options.txt
holds "mat tells all of the longest option" grep -q "any, capsules, spheres or hulls, default any" options.txt
expect 2 "did you mean '--threads'?" "$qmat" run g.yaml --thread 2
expect 2 "did you mean '--epsilon'?" "$qmat" mat box.off -o x.glb --epsilom 1%
expect 2 "needs a value" "$qmat" run g.yaml --set
expect 2 "takes no value" "$qmat" nodes --json=yes
expect 2 "one argument too many" "$qmat" check a b
expect 2 "needs more arguments" "$qmat" run
expect 2 "no option '-x'" "$qmat" run -x
expect 2 "0 to 1024" "$qmat" mat box.off -o x.glb --threads many
expect 2 "did you mean 'json'?" "$qmat" mat box.off -o x.glb --progress jsn
expect 0 "qmat " "$qmat" version
expect 0 "libyaml" "$qmat" version -v
expect 0 "medial.simplify" "$qmat" nodes
expect 0 '"name": "medial.simplify"' "$qmat" nodes --json
expect 0 "epsilon" "$qmat" node medial.simplify
expect 0 '"epsilon"' "$qmat" node medial.simplify --json
expect 2 "did you mean 'medial.simplify'?" "$qmat" node medial.simplfy

# Graph files.
expect 0 "no mistakes" "$qmat" check "$source/graphs/qmat_plus.yaml"
expect 0 "digraph" "$qmat" dot "$source/graphs/qmat_plus.yaml"
expect 0 "no mistakes" "$qmat" check "$source/graphs/lod.yaml"
for graph in "$source"/graphs/paper/*.yaml; do expect 0 "no mistakes" "$qmat" check "$graph"; done
expect 2 "cannot open the graph file" "$qmat" check missing.yaml
printf 'qmat: 1\nnodes:\n  a: { type: mesh.sfd }\n' >bad.yaml
expect 2 "bad.yaml:3:14: there is no node type 'mesh.sfd' (did you mean 'mesh.sdf'?)" "$qmat" check bad.yaml
expect 2 "bad.yaml:3:14" "$qmat" run bad.yaml --report failed.json
holds "a report of the failure" grep -q '"line": 3' failed.json
expect 2 "bad.yaml:3:14" "$qmat" run bad.yaml --report bad.yaml
holds "the graph file is never overwritten" grep -q 'mesh.sfd' bad.yaml
cat >mistakes.yaml <<'END'
qmat: 1
nods: {}
nodes:
  m: { type: scene.raed }
  t: { type: mesh.sdf, in: { mesh: m.mesh }, params: { rayz: 3, cone: wide, neighbours: 2 } }
  s: { type: mesh.sample, in: { thickness: t.thicknes } }
outputs: { a: t.thickness, b: s.nothing, c: m.mesh }
inputs: { model: m.path, n: t.nix }
END
expect 2 "did you mean 'scene.read'?" "$qmat" check mistakes.yaml
sed 's/^qmat: mistakes.yaml:\([0-9]*:[0-9]*\): .*/\1/' err.txt | tr '\n' ' ' >places.txt
holds "all mistakes, and nothing that follows from them: $(cat places.txt)" grep -qx \
  '2:1 4:14 5:56 5:65 5:77 6:44 6:3 8:29 7:31 ' places.txt
printf 'qmat: 1\nnode:\n  m: { type: scene.read }\noutput: { a: m.mesh }\n' >nodes.yaml
expect 2 "nodes.yaml:2:1: a graph has no key 'node' (did you mean 'nodes'?)" "$qmat" check nodes.yaml
holds "the key before the last" grep -q "nodes.yaml:4:1: a graph has no key 'output' (did you mean 'outputs'?)" err.txt
holds "what ends the reading" grep -q "the graph has no nodes" err.txt
awk 'BEGIN { print "qmat: 1\nnodes:"; for (i = 0; i < 60; i++) print "  n" i ": { type: foo }" }' >many.yaml
expect 2 "there is no node type 'foo'" "$qmat" check many.yaml
holds "at the limit no mistake is left out" test "$(sed 's/^qmat: many.yaml:\([0-9]*\):.*/\1/' err.txt | tr '\n' ' ')" = \
  "$(seq 3 53 | tr '\n' ' ')"
expect 2 "did you mean '--set'?" "$qmat" run "$source/graphs/qmat_plus.yaml" --sat model=box.off
expect 2 "did you mean '--set features=...'?" "$qmat" run "$source/graphs/qmat_plus.yaml" --features auto
expect 2 "did you mean 'epsilon'?" "$qmat" run "$source/graphs/qmat_plus.yaml" --set simple.epsilom=1
expect 2 "path must be given (--set model=FILE)" "$qmat" run "$source/graphs/qmat_plus.yaml" -o a.glb
# Without a model the plan is known all the same.
for cached in --no-cache --cache=planned; do
  expect 0 "model: not given (--set model=FILE)" "$qmat" run "$source/graphs/qmat_plus.yaml" --dry-run $cached
  expect 0 "model: not given" "$qmat" dot "$source/graphs/qmat_plus.yaml" --status $cached
done
expect 0 "model (scene.read): cannot run: model: not given (--set model=FILE)" \
  "$qmat" why "$source/graphs/qmat_plus.yaml" simple --cache planned
"$qmat" mat box.off -o a.glb --dry-run --cache planned >out.txt
holds "no blanks at the ends of a plan" sh -c 'grep -q "to run$" out.txt && ! grep -q " $" out.txt'
expect 2 "--colliders makes no pages and pictures, such as 'a.html'" "$qmat" mat box.off --colliders -o a.html
"$qmat" help mat >out.txt
holds "what colliders are not saved as" sh -c 'tr -s " \n" " " <out.txt | grep -q ".yaml; without --colliders also .html"'
printf 'qmat: 1\nnodes: { m: { type: scene.read } }\noutputs: { mesh: m.mesh }\n' >no_input.yaml
expect 0 "path: not given (--set m.path=FILE)" "$qmat" run no_input.yaml --dry-run
expect 2 "path must be given (--set m.path=FILE)" "$qmat" check no_input.yaml

# Runs.
expect 2 "-o PATH" "$qmat" mat box.off
expect 2 "known endings" "$qmat" mat box.off -o box.xyz
expect 2 "between 0 and 1" "$qmat" mat box.off -o box.glb --epsilon 200%
expect 2 "two outputs" "$qmat" mat box.off -o box.glb -o ./box.glb
expect 2 "did you mean 'asset'?" "$qmat" mat box.off -o aset=box.glb
expect 1 "output folder" "$qmat" mat box.off -o box.off/box.glb
# No file can be made there, also by root, whom access() allows all; known before the run, so no time is lost.
expect 1 "cannot write to the output folder" "$qmat" mat box.off -o /proc/box.glb
expect 1 "nothere.off" "$qmat" mat nothere.off -o box.glb --report failed.json
holds "the failure in the report" grep -q '"node": "model"' failed.json
holds "no file after a failure" test ! -e box.glb
cp box.off box.ma
expect 2 "would overwrite" "$qmat" mat box.ma -o box.ma
expect 2 "would overwrite" "$qmat" mat box.off -o box.glb --report box.off
holds "the model is untouched" cmp -s box.off box.ma
rm box.ma

# Only reading the model finds the layers that it refers to.
printf '#usda 1.0\ndef Cube "Cube"\n{\n}\n' >layer.usda
cp layer.usda kept.usda
printf '#usda 1.0\n(\n    subLayers = [@layer.usda@]\n)\n' >scene.usda
for cached in "" --no-cache; do
  expect 2 "would overwrite a file that the model refers to" "$qmat" mat scene.usda -o layer.usda --epsilon 5% $coarse \
    $cached
done
expect 1 "require: not certified" "$qmat" mat box.off -o box.png --vertices 1 --require certified $coarse
expect 1 "require: not certified" "$qmat" mat box.off -o box.html --vertices 1 --require certified $coarse
holds "no picture, no page" test ! -e box.png -a ! -e box.html
for option in report depfile; do
  expect 2 "would overwrite a file that the model refers to" "$qmat" mat scene.usda -o over.usda --epsilon 5% $coarse \
    --$option layer.usda
done
expect 2 "nothere" "$qmat" mat scene.usda -o over.usda --epsilon 5% $coarse --set model.mesh=nothere --report layer.usda
holds "the layer is untouched" cmp -s layer.usda kept.usda
holds "no output of a refused run" test ! -e over.usda
expect 2 "would overwrite a side file" "$qmat" mat scene.usda -o over.usda --epsilon 5% $coarse \
  --report over_original.usdz
expect 0 "spheres describe" "$qmat" mat scene.usda -o over.usda --colliders --epsilon 5% $coarse
holds "the prim is a body, its class is not" test "$(grep -c PhysicsRigidBodyAPI over.usda)" -eq 1
expect 0 "a medial mesh of" "$qmat" info over.usda --node medial_0
expect 1 "no prim of this name" "$qmat" info over.usda --node nosuch
# A stage that refers to what an earlier run made: its prims have other paths, and its medial meshes are replaced.
printf '#usda 1.0\ndef "shop"\n{\n    def "crate" (references = @over.usda@</Cube>)\n    {\n    }\n}\n' >shop.usda
expect 0 "composed_prim: /shop/crate" "$qmat" info shop.usda --against shop.usda
expect 0 "spheres" "$qmat" extract shop.usda --node shop/crate -o again.ma
expect 0 "describe" "$qmat" mat shop.usda -o again.usda --vertices 1 $coarse
expect 0 "a medial mesh of 1 spheres" "$qmat" info again.usda --against shop.usda
rm layer.usda kept.usda scene.usda over* shop.usda again*

# The report and the depfile: not in one file, and both in a folder that is made.
expect 2 "would overwrite the report" "$qmat" mat box.off -o over.ma --epsilon 5% $coarse \
  --report both/r.json --depfile both/../both/r.json
holds "neither is written" test ! -e both/r.json -a ! -e over.ma
expect 0 "" "$qmat" mat box.off -o over.ma --epsilon 5% $coarse --depfile made/for/d.d
holds "the folder of the depfile is made" grep -q '^over.ma:' made/for/d.d
rm -r both made over.ma

# The extras of this node are no object, so that the medial mesh is on a child of it.
cat >list.gltf <<'END'
{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "n", "extras": [1], "scale": [2, 2, 2]}], "meshes": [{"name": "b", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}], "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}, {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}], "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}], "buffers": [{"byteLength": 168, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAACAPwAAgD8AAAAAAAAAAAAAAAAAAIA/AACAPwAAAAAAAIA/AAAAAAAAgD8AAIA/AACAPwAAgD8AAIA/AAACAAMAAAADAAEABAAFAAcABAAHAAYAAAABAAUAAAAFAAQAAgAGAAcAAgAHAAMAAAAEAAYAAAAGAAIAAQADAAcAAQAHAAUA"}]}
END
expect 0 "spheres" "$qmat" mat list.gltf -o list.glb --epsilon 5% $coarse
expect 0 "not refuted" "$qmat" info list.glb --against list.gltf
holds "both errors are in their bounds" sh -c '! grep -q REFUTED out.txt'

# Outputs of a graph that no run could save: one path twice, also below a folder that is missing, and a file that is read.
cat >twice.yaml <<'END'
qmat: 1
nodes:
  m: { type: medial.read, params: { path: ball.ma } }
  w: { type: scene.write, in: { medial: m.medial } }
outputs:
  a: { from: w.file, path: later/x.ma }
  b: { from: w.file, path: ./later/./y/../x.ma }
END
expect 2 "twice.yaml:7:28: two outputs have the path './later/./y/../x.ma'" "$qmat" check twice.yaml
expect 2 "twice.yaml:7:28: two outputs have the path" "$qmat" run twice.yaml
holds "the run makes no folder" test ! -e later
expect 2 "two outputs have the path" "$qmat" mat box.off -o later/x.ma -o later//x.ma --dry-run
sed 's,y/../x,z,' twice.yaml >once.yaml
expect 0 "no mistakes" "$qmat" check once.yaml
sed 's,./later/./y/../x,ball,' twice.yaml >read.yaml
expect 2 "read.yaml:7:28: output 'b': 'ball.ma' would overwrite the file that node 'm' reads" "$qmat" check read.yaml
rm twice.yaml once.yaml read.yaml

# The path of an output in a graph gets its folder, too.
printf 'qmat: 1\nnodes:\n  m: { type: medial.read, params: { path: ball.ma } }\n  w: { type: scene.write, in: { medial: m.medial } }
outputs: { o: { from: w.file, path: made/by/graph.ma } }\n' >paths.yaml
printf '1 0 0\nv 0 0 0 1\n' >ball.ma
expect 0 "made/by/graph.ma" "$qmat" run paths.yaml
holds "the file of the graph" test -s made/by/graph.ma
# A node that moves the mesh: other files of the run have the mesh's own coordinates, and say so.
sed 's/"extras": \[1\], "scale": \[2, 2, 2\]/"rotation": [0, 0, 1, 0]/' list.gltf >placed.gltf
expect 0 "the .ma file has the mesh where its own" "$qmat" mat placed.gltf -o list.ma -o list.glb --epsilon 5% $coarse
expect 0 "spheres" "$qmat" mat placed.gltf -o list.ma --epsilon 5% $coarse
holds "alone it has the scene's coordinates" sh -c '! grep -q warning err.txt'
sed 's/"extras": \[1\], "scale"/"scale"/' list.gltf >placed.gltf
expect 0 "the .ma file is in the mesh" "$qmat" mat placed.gltf -o list.ma -o list.glb --epsilon 5% $coarse
holds "a scale moves nothing" sh -c '! grep -q "where its own" err.txt'
rm placed.gltf

# Only the levels that are saved are made, and the summary is theirs.
count_of() { head -n 1 "$1" | cut -d ' ' -f 1; }
coarse_levels="--set near_samples.spacing=10% --set far_samples.spacing=10%"
expect 0 "" "$qmat" run lod --set model=box.off --set near=1% --set far=20% $coarse_levels -o near=near.ma -o far=far.ma
holds "two levels" test "$(count_of near.ma)" -ne "$(count_of far.ma)"
holds "a summary of each" test "$(grep -o '[0-9]* spheres* describe' out.txt | cut -d ' ' -f 1 | tr '\n' ' ')" = \
  "$(count_of near.ma) $(count_of far.ma) "
expect 0 "box: $(count_of near.ma) spheres describe" "$qmat" run lod --set model=box.off --set near=1% --set far=20% \
  $coarse_levels -o near=near.ma --report one_level.json
holds "only what that level needs" sh -c 'grep -q "\"near_errors\"" one_level.json && ! grep -q "\"far_errors\"" one_level.json'
rm near.ma far.ma one_level.json

rm -r list.* paths.yaml ball.ma made

# A full disk, and a reader that ends early: an error, and no temporary folder is left.
"$qmat" batch box.off --out full -f ma --json --set epsilon=5% $coarse >/dev/full 2>err.txt
holds "a list that cannot be written is an error" test $? -eq 1
rm -rf full
mkdir streams
(TMPDIR=$PWD/streams "$qmat" mat box.off -o -.html --quiet --epsilon 5% $coarse 2>/dev/null) | head -c 1 >/dev/null
holds "no temporary folder is left" test -z "$(ls streams)"
rmdir streams

expect 0 "spheres" "$qmat" mat box.off -o box.glb -o box.gltf -o box.ma --epsilon 5% $coarse --report report.json \
  --threads 1
holds "all files" test -s box.glb -a -s box.gltf -a -s box.ma
expect 0 "a medial mesh of" "$qmat" info box.glb
expect 0 "triangles: 12" "$qmat" info box.off
expect 0 "not refuted" "$qmat" info box.glb --against box.off
expect 0 "triangles: 12" "$qmat" info box.glb box.off
expect 1 "qmat: nothere.off: cannot open" "$qmat" info box.glb nothere.off box.off
holds "the others are described" grep -q '^box.off: a surface' out.txt
holds "the failures are counted" grep -q '^qmat: 1 of 3 files have failed' err.txt
expect 1 "" "$qmat" info box.glb nothere.off box.off --json
holds "a list of three as JSON" node -e '
  const all = JSON.parse(require("fs").readFileSync("out.txt"));
  process.exit(all.length === 3 && all[0].medial_meshes[0].spheres > 0 && all[1].error.file === "nothere.off" &&
    all[2].surface.triangles === 12 && all[2].solid.components.length === 1 ? 0 : 1)'
expect 0 "" "$qmat" mat box.off -o box.ply --epsilon 5% $coarse --quiet
expect 0 "box.ply: a medial mesh of" "$qmat" info box.ply
"$qmat" info - <box.off >out.txt 2>err.txt
holds "info of the standard input" test $? -eq 0
holds "what is on the standard input" grep -q '^standard input: a surface$' out.txt
sed 's/^{$/{"images": [{"uri": "\\u001b[2J.png"}],/' box.gltf >odd.gltf
expect 0 'the file "?[2J.png" cannot be read' "$qmat" info odd.gltf
expect 1 "OFF does not carry" "$qmat" info box.off --against box.off
expect 0 "spheres" "$qmat" extract box.glb -o back.ma
holds "as many spheres as before" test "$(head -n 1 back.ma)" = "$(head -n 1 box.ma)"
expect 2 "-o PATH" "$qmat" extract box.glb
expect 2 "known endings" "$qmat" extract box.glb -o back.off
expect 2 "would overwrite" "$qmat" extract box.ma -o ./box.ma
expect 1 "OFF does not carry" "$qmat" extract box.off -o back.ma
expect 1 "of this name" "$qmat" extract box.glb -o back.ma --node other
expect 0 "box.usdz" "$qmat" mat box.off -o box.usda -o box.usdc -o box.usdz --epsilon 5% $coarse
expect 0 "spheres" "$qmat" extract box.usdz -o back.ma
expect 0 "spheres" "$qmat" extract box.usdc -o back_of_crate.ma
holds "a crate has what a text has" cmp back.ma back_of_crate.ma
holds "a layer of USD" test "$(head -c 9 box.usda)" = "#usda 1.0"
cp "$source/examples/game/models/"roof.* .
expect 0 "certified" "$qmat" mat roof.gltf -o listed.gltf --epsilon 10% $coarse --report report_of_files.json
holds "a side file" test -s listed.bin
for file in listed.*; do
  holds "$file is listed" grep -qF -e "$file (" out.txt
  holds "$file is in the report" grep -qF "\"$file\"" report_of_files.json
done
holds "a scene with meshes of its own needs no skin" sh -c '! grep -q medial.skin report_of_files.json'
expect 0 "certified" "$qmat" mat roof.gltf -o beside.gltf --epsilon 10% $coarse --report beside.json --set asset.skin_beside=true
holds "the skin beside it is made" grep -q medial.skin beside.json
holds "the skin of a model is made" grep -q medial.skin report.json
holds "the report names all" test "$(grep -c '"sha256"' report.json)" -eq 3
holds "a valid glb" test "$(head -c 4 box.glb)" = glTF
expect 0 "surface to envelope" "$qmat" run "$source/graphs/qmat_plus.yaml" --set model.path=box.off \
  --set epsilon=5% $coarse -o again.glb --threads 2
expect 0 "" "$qmat" run "$source/graphs/qmat_plus.yaml" --set model=box.off --set epsilon=0.05 $coarse \
  -o asset=again.ma
holds "the same bytes from mat and run" cmp box.glb again.glb
holds "the same bytes from mat and run, .ma" cmp box.ma again.ma
expect 0 "" "$qmat" mat box.off -o quiet.ma --quiet --epsilon 5% $coarse
holds "nothing is printed with --quiet" test ! -s out.txt -a ! -s err.txt
expect 0 '"event":"done"' "$qmat" mat box.off -o json.ma --progress json --epsilon 5% $coarse
holds "JSON progress starts every node" test "$(grep -c '"event":"start"' err.txt)" -eq 11
holds "JSON progress says where results come from" test "$(grep -c '"event":"done".*"cache":"run"' err.txt)" -eq 11
holds "JSON progress ends with the files" sh -c "tail -n 1 err.txt | grep -q '^{\"event\":\"end\",\"status\":\"ok\",.*\"outputs\":\[\"json.ma\"\]}$'"
expect 2 '{"event":"end","status":"usage",' "$qmat" mat box.off -o json.ma --progress json --set asset.require=nothing
# Lengths in a report are as they are given.
expect 0 "" "$qmat" mat box.off -o length.ma --set model.unit=m --epsilon 5cm $coarse --report length.json --quiet
holds "a length in a report" grep -q '"epsilon": "0.05m"' length.json
# A folder of the name of a built-in graph does not hide it, and foreseeing a run makes no folder.
mkdir colliders
expect 0 "" "$qmat" run colliders --set model=box.off --dry-run -o not/yet/a.glb
expect 0 "" "$qmat" check qmat_plus
expect 0 "" "$qmat" mat box.off -o not/yet/a.glb --dry-run --report not/r.json --depfile not/a.d
expect 0 "" "$qmat" dot qmat_plus --set model=box.off --status --cache dotted
holds "no folder is made" test ! -e not
expect 1 "cannot use the output folder: Not a directory" "$qmat" mat box.off -o box.off/a.glb --dry-run
rmdir colliders
cat >cage.usda <<'END'
#usda 1.0
def Mesh "cage" {
  point3f[] points = [(-1, -1, -1), (1, -1, -1), (-1, 1, -1), (1, 1, -1), (-1, -1, 1), (1, -1, 1), (-1, 1, 1), (1, 1, 1)]
  int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
  int[] faceVertexIndices = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5]
}
END
expect 0 "(certified)" "$qmat" mat cage.usda -o cage.ma --epsilon 4% --report cage.json
holds "the cage is taken to its limit" grep -q '"deviation": 0.00' cage.json
expect 0 "" "$qmat" run "$source/graphs/qmat_plus.yaml" --set model=box.off --to thickness -v
holds "--to gets there" grep -q mesh.sdf out.txt
holds "--to stops there" sh -c '! grep -q medial.simplify out.txt'
# A number of spheres alone means no bound on the distance.
expect 0 "" "$qmat" mat box.off -o few.ma --vertices 5 --report few.json
holds "--vertices sets epsilon to 0" node -e '
  const simple = JSON.parse(require("fs").readFileSync("few.json")).nodes.find((node) => node.id === "simple");
  process.exit(simple.params.epsilon === 0 && simple.params.vertices === 5 ? 0 : 1)'

# Cancelled by a signal while a node runs: exit code 3 and no file. A wavy torus is enough work to be interrupted.
awk 'BEGIN {
  n = 240; m = 120; pi = 3.14159265358979
  printf "OFF\n%d %d 0\n", n * m, n * m
  for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
    a = 2 * pi * i / n; b = 2 * pi * j / m; r = 1 + 0.2 * cos(5 * a) * cos(3 * b)
    printf "%.9f %.9f %.9f\n", (3 + r * cos(b)) * cos(a), (3 + r * cos(b)) * sin(a), r * sin(b)
  }
  for (i = 0; i < n; i++) for (j = 0; j < m; j++) {
    k = (i + 1) % n; l = (j + 1) % m
    printf "4 %d %d %d %d\n", i * m + j, k * m + j, k * m + l, i * m + l
  }
}' >torus.off
"$qmat" mat torus.off -o torus.glb --epsilon 0.1% --progress json >out.txt 2>err.txt &
running=$!
tries=0
while ! grep -q '"event":"start"' err.txt && [ $tries -lt 600 ]; do
  sleep 0.1
  tries=$((tries + 1))
done
kill -TERM $running
wait $running
code=$?
holds "exit code 3 after a signal, not $code" test $code -eq 3
holds "the cancelled node is named" grep -q 'cancelled' err.txt
holds "no file after a signal" test ! -e torus.glb

# So does qmat info, where a solid takes long to make: 300 boxes in one another's way.
awk 'BEGIN {
  n = 300
  printf "OFF\n%d %d 0\n", 8 * n, 6 * n
  for (i = 0; i < n; i++) for (k = 0; k < 8; k++) {
    a = i * 0.7; x = k % 2 - 0.5; y = int(k / 2) % 2 - 0.5; z = int(k / 4) - 0.5
    printf "%.9f %.9f %.9f\n", x * cos(a) - y * sin(a) + sin(i * 1.3), x * sin(a) + y * cos(a) + cos(i * 2.1), z + sin(i * 3.7)
  }
  split("0 2 3 1 4 5 7 6 0 1 5 4 2 6 7 3 0 4 6 2 1 3 7 5", f, " ")
  for (i = 0; i < n; i++) for (q = 0; q < 6; q++) {
    printf "4"
    for (k = 1; k <= 4; k++) printf " %d", 8 * i + f[4 * q + k]
    print ""
  }
}' >heap.off
"$qmat" info heap.off box.off >out.txt 2>err.txt &
running=$!
tries=0
while ! grep -q 'a surface' out.txt && kill -0 $running 2>/dev/null && [ $tries -lt 20 ]; do
  sleep 0.1
  tries=$((tries + 1))
done
kill -TERM $running
wait $running
code=$?
holds "qmat info has exit code 3 after a signal, not $code" test $code -eq 3
holds "the signal ends all files" sh -c '! grep -q "box.off: a surface" out.txt && grep -q "mesh.solid: cancelled" err.txt'

# What is wrong with a medial mesh is said, not that it is no surface.
printf '1 0 0\nv 0 0 0 -1\n' >negative.ma
expect 1 "negative.ma:2:9: sphere 0: the radius of a sphere is negative" "$qmat" info negative.ma
printf 'OFF\n4 4 0\n0 0 0\n1e308 0 0\n0 1e308 0\n0 0 1e308\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n' >huge.off
expect 1 "huge.off: node 'model' (scene.read): its bounding box is too large to be measured" "$qmat" mat huge.off -o huge.ma
expect 1 "huge.off: its bounding box is too large to be measured" "$qmat" info huge.off

# Layers of one stem share their original.
printf '#usda 1.0\ndef Cube "Cube"\n{\n}\n' >layer.usda
expect 0 "" "$qmat" mat layer.usda -o both/a.usda -o both/a.usdc --epsilon 10% $coarse
holds "three files" test "$(ls both | tr '\n' ' ')" = "a.usda a.usdc a_original.usda "

# A locale with a decimal comma changes nothing.
if mkdir locale && localedef -i de_DE -f UTF-8 locale/de_DE.UTF-8 2>/dev/null; then
  expect 0 "" env LOCPATH="$work/locale" LC_ALL=de_DE.UTF-8 "$qmat" mat box.off -o comma.glb --epsilon 0.05 $coarse \
    --report comma.json
  holds "the same bytes under de_DE" cmp box.glb comma.glb
else
  echo "skipped: the locale de_DE.UTF-8 (Debian: apt install locales)"
fi

finish
