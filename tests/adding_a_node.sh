#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What CONTRIBUTING.md says about adding a node is true: adding_a_node.sh SOURCE_FOLDER SCRATCH_FOLDER
# Its code blocks are the files in examples/adding_a_node, and the three edits, done to a copy of the sources, give a
# node that is built, listed and tested. The scratch folder is kept, so that the next time is quick.
set -eu
source=$1
scratch=$2
example=$source/examples/adding_a_node
copy=$scratch/source
mkdir -p "$copy"

# block N LANGUAGE: the Nth fenced block of that language.
block() {
  awk -v wanted="$1" -v fence="\`\`\`$2" '
    !inside && $0 == fence { inside = ++count == wanted; skipping = !inside; next }
    /^```$/ { if (inside) exit; skipping = 0; next }
    inside' "$source/CONTRIBUTING.md"
}
same() {
  if ! diff -u "$2" "$scratch/block"; then
    echo "CONTRIBUTING.md: $1 is not what is tested"
    exit 1
  fi
}
block 1 c >"$scratch/block"
same "the node's file" "$example/mesh_scale.c"
block 2 c >"$scratch/block"
same "the node's test" "$example/mesh_scale_test.c"
edit=$(block 1 cmake)

# The sources, with their times, so that only what changed is built again.
cd "$source"
for folder in cmake core io nodes graphs tests examples; do
  mkdir -p "$copy/$folder"
  cp -Rp "$folder/." "$copy/$folder/"
done
cp -p CMakeLists.txt "$copy/"

# The three edits.
cp -p "$example/mesh_scale.c" "$copy/nodes/"
cp -p "$example/mesh_scale_test.c" "$copy/tests/nodes/"
awk -v edit="$edit" '{ print } $0 == "set(QMAT_NODES" { print edit }' nodes/CMakeLists.txt >"$copy/nodes/CMakeLists.txt"
if ! cmp -s "$copy/nodes/CMakeLists.txt" "$scratch/edited"; then cp "$copy/nodes/CMakeLists.txt" "$scratch/edited"; fi
cp -p "$scratch/edited" "$copy/nodes/CMakeLists.txt"

# The edits touch no adapter in C++, and these take minutes to compile: they are those of the build that runs this test.
launcher=$scratch/take_built
cat >"$launcher" <<'EOF'
#!/bin/sh
# take_built FOLDER COMPILER OPTION...: takes the object from FOLDER; compiles where it is not there.
folder=$1
shift
object= dependencies= previous=
for word in "$@"; do
  case $previous in
    -o) object=$word ;;
    -MF) dependencies=$word ;;
  esac
  previous=$word
done
if [ -f "$folder/$object" ]; then
  cp "$folder/$object" "$object"
  printf '%s: %s\n' "$object" "$folder/$object" >"$dependencies"
else
  exec "$@"
fi
EOF
chmod +x "$launcher"

cmake -S "$copy" -B "$scratch/build" -G Ninja -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_COMPILER_LAUNCHER=$launcher;$(dirname "$scratch")" -DCMAKE_C_FLAGS_DEBUG=-O0 -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DQMAT_WERROR=ON >"$scratch/log" 2>&1 &&
  cmake --build "$scratch/build" --target nodes_mesh_scale_test --target qmat -j "$(nproc)" >>"$scratch/log" 2>&1 || {
  tail -n 40 "$scratch/log"
  exit 1
}
cd "$scratch/build"
ctest -R '^nodes\.mesh_scale$' --no-tests=error --output-on-failure
./qmat nodes | grep -q '^mesh.scale '
./qmat node mesh.scale | grep -q 'millimetres'
