#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs qmat and builds examples/game on top, with Ninja and with Make: game_test.sh SOURCE_FOLDER BUILD_FOLDER
source=$1
built=$2
. "$(dirname "$0")/lib.sh"
QMAT_CACHE=$work/cache
export QMAT_CACHE

cmake --install "$built" --prefix "$work/installed" >out.txt 2>&1 || die "the installation"
# It must not matter where the installation is.
mv installed moved

# make_assets: builds; the assets that were made anew, in $made.
make_assets() {
  touch before
  sleep 1.1
  cmake --build build >out.txt 2>&1 || die "the build"
  made=$(find build/assets -name '*.ma' -newer before | sort | sed 's/.*\///' | tr '\n' ' ')
}

for generator in Ninja "Unix Makefiles"; do
  rm -rf game build
  cp -r "$source/examples/game" game
  echo 'qmat_add_asset(TARGET game GRAPH colliders INPUT models/crate.off OUTPUT assets/crate.urdf SET epsilon=5%)' \
    >>game/CMakeLists.txt
  cmake -G "$generator" -S game -B build -DCMAKE_PREFIX_PATH="$work/moved" >out.txt 2>&1 || die "$generator: configuring"
  # Two assets of one file name; a graph by default, and one without an ending; side files.
  cp game/spheres.yaml game/spheres
  cat >>game/CMakeLists.txt <<'END'
qmat_add_asset(TARGET more INPUT models/crate.off OUTPUT one/same.ply SET epsilon=10%)
qmat_add_asset(TARGET more INPUT models/roof.gltf GRAPH spheres OUTPUT two/same.ply SET epsilon=10%)
qmat_add_asset(TARGET more INPUT models/crate.off OUTPUT one-same.ply SET epsilon=10%)
qmat_add_asset(TARGET more INPUT models/roof.gltf OUTPUT sides/roof.gltf SIDE_OUTPUTS roof.bin SET epsilon=10%)
qmat_add_asset(TARGET more INPUT models/crate.off GRAPH told.yaml OUTPUT_NAME asset OUTPUT told/crate.ma
  OPTIONS --output=report=told/crate.json SIDE_OUTPUTS crate.json)
qmat_add_asset(TARGET more INPUT models/roof.gltf GRAPH told.yaml OUTPUT_NAME asset OUTPUT told/roof.ma)
END
  # A graph that saves a report by itself: each asset would write the same one.
  sed '/^outputs:/,$d' game/spheres.yaml >game/told.yaml
  echo 'outputs: { asset: asset.file, report: { from: simple.report, path: told.json } }' >>game/told.yaml
  cmake build >out.txt 2>&1 || die "$generator: more assets"
  make_assets
  [ "$made" = "crate.ma roof.ma " ] || die "$generator: the first build made '$made'"
  for file in one/same.ply two/same.ply one-same.ply sides/roof.gltf sides/roof.bin; do
    [ -s build/$file ] || die "$generator: $file is missing"
  done
  [ -s build/told/crate.json ] || die "$generator: the report of one asset"
  [ ! -e game/told.json ] || die "$generator: the sources have a new file"
  if [ "$generator" = Ninja ]; then
    rm build/sides/roof.bin
    make_assets
    [ -s build/sides/roof.bin ] || die "$generator: a side file is not made again"
  fi
  grep -q '<robot' build/assets/crate.urdf || die "$generator: the asset of a built-in graph"
  build/game >out.txt || die "$generator: the game"
  grep -q '^crate: [1-9]' out.txt || die "$generator: the game has no colliders"
  make_assets
  [ -z "$made" ] || die "$generator: the second build made '$made'"
  [ -z "$(find build/told -newer before)" ] || die "$generator: the second build made assets of the other graph"
  sed 's/^2 1 1$/2 1 1.1/' game/models/crate.off >edited.off
  cp edited.off game/models/crate.off
  make_assets
  [ "$made" = "crate.ma " ] || die "$generator: an edited model made '$made'"
  # x of the second vertex: 4 becomes 3.
  printf '\000\000\100\100' | dd of=game/models/roof.bin bs=1 seek=12 conv=notrunc status=none
  make_assets
  [ "$made" = "roof.ma " ] || die "$generator: an edited side file made '$made'"
  echo "# edited" >>game/spheres.yaml
  make_assets
  [ "$made" = "crate.ma roof.ma " ] || die "$generator: an edited graph made '$made'"
  make_assets
  [ -z "$made" ] || die "$generator: the last build made '$made'"
done
