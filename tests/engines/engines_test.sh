#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Colliders in Rapier, Jolt and Bullet: engines_test.sh SOURCE_FOLDER BUILD_FOLDER. Where npm cannot install the engines, the test
# counts as skipped.
. "$1/tests/lib.sh"
if ! command -v node >/dev/null 2>&1; then
  echo "skipped: there is no node (Debian: apt install nodejs)"
  exit 77
fi
packages=$2/engine_packages
mkdir -p "$packages"
if ! cmp -s "$1/tests/engines/package.json" "$packages/package.json" || [ ! -e "$packages/node_modules/.complete" ]; then
  cp "$1/tests/engines/package.json" "$packages/package.json"
  if ! (cd "$packages" && npm install --no-audit --no-fund --no-package-lock >install.log 2>&1 && touch node_modules/.complete); then
    echo "skipped: npm could not install the engines; $packages/install.log says why"
    exit 77
  fi
fi
cp "$1/tests/engines/drop.mjs" "$1/tests/engines/surface.mjs" "$packages"

set -- "$1" "$2"
for model in l-bracket capsule; do
  "$2/qmat_models" $model -o $model.off || die "no model $model"
  "$2/qmat" run "$1/graphs/colliders.yaml" --set model=$model.off --set epsilon=0.5% --quiet -o $model.glb ||
    die "no colliders of $model"
  set -- "$@" $model.glb $model.off
done
source=$1
shift 2
node "$packages/drop.mjs" "$source/examples/readers" "$@" || die "a body does not come to rest as it should"

# A glTF file has the same triangles as the OFF file that it is made of.
cat >"$packages/gltf.mjs" <<'END'
import { writeFileSync } from 'node:fs';
import { surfaceOf } from './surface.mjs';
const { points, rows } = surfaceOf('capsule.off');
const data = Buffer.concat([Buffer.from(new Float32Array(points.flat()).buffer), Buffer.from(new Uint16Array(rows.flat()).buffer)]);
const json = { asset: { version: '2.0' }, buffers: [{ byteLength: data.length, uri: `data:;base64,${data.toString('base64')}` }],
  bufferViews: [{ buffer: 0, byteLength: 12 * points.length }, { buffer: 0, byteOffset: 12 * points.length, byteLength: 6 * rows.length }],
  accessors: [{ bufferView: 0, componentType: 5126, count: points.length, type: 'VEC3' },
    { bufferView: 1, componentType: 5123, count: 3 * rows.length, type: 'SCALAR' }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }], nodes: [{ mesh: 0 }] };
writeFileSync('capsule.gltf', JSON.stringify(json));
const read = surfaceOf('capsule.gltf'), off = Math.max(...read.points.flat().map((v, i) => Math.abs(v - points.flat()[i])));
process.exit(JSON.stringify(read.rows) === JSON.stringify(rows) && read.points.length === points.length && off < 1e-6 ? 0 : 1);
END
node "$packages/gltf.mjs" || die "a surface differs as glTF"

# Colliders that do not fit the surface are found: those of the capsule under the bracket.
if node "$packages/drop.mjs" "$source/examples/readers" capsule.glb l-bracket.off >out.txt; then
  die "colliders of another model pass"
fi
