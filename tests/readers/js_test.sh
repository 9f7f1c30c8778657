#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The ES module of examples/readers, and the schemas of what is written: js_test.sh SOURCE_FOLDER BUILD_FOLDER QMAT
# QMAT_MODELS. Without three.js, Babylon.js, glTF-Transform, ajv and the Khronos validator, which npm fetches once, only what
# needs none of them is tested, and the test counts as skipped.
set -eu
if ! command -v node >/dev/null 2>&1; then
  echo "skipped: there is no node (Debian: apt install nodejs)"
  exit 77
fi
work=$2/reader_packages
mkdir -p "$work"
node "$1/tests/readers/js_test.mjs" "$1/examples/readers"
node "$1/tests/readers/motion_test.mjs" "$1/examples/readers"
if ! cmp -s "$1/tests/readers/package.json" "$work/package.json" || [ ! -e "$work/node_modules/.complete" ]; then
  cp "$1/tests/readers/package.json" "$work/package.json"
  if ! (cd "$work" && npm install --no-audit --no-fund --no-package-lock >install.log 2>&1 && touch node_modules/.complete); then
    echo "skipped in part: npm could not install the loaders; $work/install.log says why"
    exit 77
  fi
fi
cp "$1/tests/readers/"*_test.mjs "$work"
node "$work/js_loaders_test.mjs" "$1/examples/readers"

# Colliders of all kinds, by both pairs of extensions.
"$4" capsule --resolution 6 -o "$work/capsule.off"
for model in "$work/capsule.off" "$1/examples/game/models/pear.off" "$1/examples/game/models/roof.gltf"; do
  for kind in any hulls spheres; do
    name=$(basename "$model")
    "$3" mat "$model" --colliders --kind "$kind" --epsilon 5% --set asset.khr_physics=true --set asset.omi_physics=true \
      -o "$work/physics_${name%.*}_$kind.gltf" -o "$work/physics_${name%.*}_$kind.glb" --no-cache --quiet
  done
done
node "$work/physics_test.mjs" "$1/tests/readers/physics.schema.json" "$work"/physics_*.gltf
node "$work/validator_test.mjs" "$work"/physics_*.glb
