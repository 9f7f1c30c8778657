#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What a run leaves on the disk: side files, and the errors that files state. written_files_test.sh PROGRAM
qmat=$1
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=$work/cache
export QMAT_CACHE

# write_scene FOLDER WIDTH: a box as glTF with a buffer in buf.bin, an image beside it and one outside. WIDTH is a
# number in single precision as printf takes it.
write_scene() {
  mkdir -p "$1" textures
  printf '\211PNG\r\n\032\nshared' >textures/t.png
  printf '\211PNG\r\n\032\n%s' "$1" >"$1/own t.png"
  zero='\000\000\000\000'
  one='\000\000\200\077'
  for x in "$zero" "$2"; do for y in "$zero" "$one"; do for z in "$zero" "$one"; do printf "$x$y$z"; done; done; done \
    >"$1/buf.bin"
  for corner in 0 1 3 0 3 2 4 6 7 4 7 5 0 4 5 0 5 1 2 3 7 2 7 6 0 2 6 0 6 4 1 5 7 1 7 3; do
    printf "\\00$corner\\000"
  done >>"$1/buf.bin"
  cat >"$1/scene.gltf" <<'END'
{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "box"}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
 "images": [{"uri": "../textures/t.png"}, {"uri": "own%20t.png"}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
  {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
 "buffers": [{"uri": "buf.bin", "byteLength": 168}]}
END
}

# save SCENE OUTPUT [OPTION...]: the initial medial mesh of a scene, which takes no time.
save() {
  scene=$1
  output=$2
  shift 2
  "$qmat" run graph.yaml --set model="$scene" -o "$output" "$@"
}
write_graph graph.yaml 20%
write_scene a '\000\000\200\077'
write_scene b '\000\000\000\100'
if cmp -s a/buf.bin b/buf.bin; then die "the two buffers differ"; fi

# Two runs into one folder: each output has its own files, all of them listed.
mkdir out
for name in a b; do
  expect 0 "out/$name.bin (" save $name/scene.gltf out/$name.gltf --report $name.json
  holds "$name: the image is listed" grep -q "out/${name}_own t.png" out.txt
  holds "$name: the report has the buffer" grep -q "\"name\": \"$name.bin\"" $name.json
done
for name in a b; do
  holds "$name: its buffer" cmp $name/buf.bin out/$name.bin
  holds "$name: its image" cmp "$name/own t.png" "out/${name}_own t.png"
  holds "$name: the image from outside of its folder" cmp textures/t.png out/${name}_t.png
  expect 0 "a medial mesh" "$qmat" info out/$name.gltf
done

# The same again, from the cache, after the files are gone.
rm out/a*
expect 0 "" save a/scene.gltf out/a.gltf
holds "from the cache: the buffer" cmp a/buf.bin out/a.bin
holds "from the cache: the image" cmp "a/own t.png" "out/a_own t.png"

# Another model may replace its own output's files, but nothing of something else, and then it writes nothing.
expect 0 "" save b/scene.gltf out/a.gltf
holds "an output replaces its own side files" cmp b/buf.bin out/a.bin
echo mine >out/c.bin
expect 1 "does not belong to" save a/scene.gltf out/c.gltf
holds "nothing is written" test ! -e out/c.gltf -a ! -e "out/c_t.png"
holds "the file is untouched" test "$(cat out/c.bin)" = mine

# A batch of two scenes of one name.
mkdir both
cp -r a b textures both/
mv both/a/scene.gltf both/a/first.gltf
mv both/b/scene.gltf both/b/second.gltf
expect 0 "2 done" "$qmat" batch graph.yaml --inputs 'both/*/*.gltf' --out batched --jobs 2 --format gltf
holds "batch: the first buffer" cmp a/buf.bin batched/a/first.bin
holds "batch: the second buffer" cmp b/buf.bin batched/b/second.bin

# A .glb needs no other file; side_files leaves them outside.
mkdir alone
expect 0 "" save a/scene.gltf alone/a.glb
holds "a .glb is alone" test "$(ls alone)" = a.glb
mkdir moved
mv alone/a.glb moved/
expect 0 "a medial mesh" "$qmat" info moved/a.glb
holds "its image is in it" grep -q "shared" moved/a.glb
expect 0 "" save a/scene.gltf alone/a.glb --set asset.side_files=true
holds "side files on request" cmp a/buf.bin alone/a.bin

# What leads out of the folder is no image: it is not read.
mkdir evil
echo secret >secret.txt
sed -e 's/..\/textures\/t.png/..\/secret.txt/' a/scene.gltf >evil/scene.gltf
cp a/buf.bin "a/own t.png" evil/
expect 0 "is not an image" save evil/scene.gltf evil/out.glb
holds "its content is nowhere" test "$(grep -lx secret -r evil | wc -l)" -eq 0

# Far from zero nothing is crushed: what a file states is certified in every format.
write_box box.off
awk 'NF == 3 && NR > 2 { $1 += 400000; $3 += 5000000; printf "%.17g %.17g %.17g\n", $1, $2, $3; next } { print }' \
  box.off >far.off
for format in glb gltf usda usdc usdz ply; do
  expect 0 "(certified)" "$qmat" mat far.off -o far.$format
  expect 0 "  certified" "$qmat" info far.$format --against far.off
  holds "$format: the file states that it is certified" grep -q "qmat_certified: yes" out.txt
done
finish
