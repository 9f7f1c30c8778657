#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A page in headless Chromium: page_test.sh QMAT QMAT_MODELS SOURCE_FOLDER
# The script is well-formed and small; the page says nothing on the console; its view is that of report.picture; its
# levels are those of medial.lod; nothing overlaps from 360 to 1600 pixels; and it can be read without WebGL.
set -eu
qmat=$1
models=$2
source=$3
if ! command -v node >/dev/null 2>&1; then
  echo "skipped: there is no node (Debian: apt install nodejs)"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
cat "$source/examples/readers/qmat_reader.mjs" "$source/io/page/page.js" >"$work/script.mjs"
node --check "$work/script.mjs"
size=$(gzip -9c "$work/script.mjs" | wc -c)
if [ "$size" -gt 200000 ]; then
  echo "FAILED: the script has $size bytes when compressed"
  exit 1
fi
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$chromium" ]; then
  echo "skipped in part: there is no Chromium (Debian: apt install chromium)"
  exit 77
fi
QMAT_CACHE=$work/cache
export QMAT_CACHE
"$models" l-bracket -o "$work/bracket.off"
cat >"$work/page.yaml" <<'END'
qmat: 1
inputs:
  model: model.path
nodes:
  model: { type: scene.read }
  thickness: { type: mesh.sdf, in: { mesh: model.mesh } }
  samples: { type: mesh.sample, in: { mesh: model.mesh, thickness: thickness.thickness } }
  initial: { type: medial.delaunay, in: { mesh: model.mesh, thickness: thickness.thickness, samples: samples.samples } }
  chain:
    type: medial.chain
    in: { mesh: model.mesh, thickness: thickness.thickness, samples: samples.samples, medial: initial.medial }
    params: { finest: 2%, bounds: 70 }
  simple: { type: medial.lod, in: { chain: chain.chain }, params: { epsilon: 0, vertices: 12 } }
  middle: { type: medial.lod, in: { chain: chain.chain }, params: { epsilon: 0, vertices: 30 } }
  errors: { type: medial.evaluate, in: { mesh: model.mesh, medial: simple.medial }, params: { epsilon: 5% } }
  page:
    type: report.page
    in: { scene: model.scene, mesh: model.mesh, medial: simple.medial, report: errors.report, chain: chain.chain }
    params: { levels: 300, up: z }
  both:
    type: report.picture
    in: { scene: model.scene, mesh: model.mesh, medial: simple.medial, report: errors.report }
    params: { up: z, width: 640, height: 320 }
  overlay:
    type: report.picture
    in: { scene: model.scene, mesh: model.mesh, medial: simple.medial, report: errors.report }
    params: { up: z, width: 320, height: 320, view: overlay }
  asset: { type: scene.write, in: { medial: middle.medial }, params: { format: ma } }
outputs:
  page: page.file
  both: both.file
  overlay: overlay.file
  asset: asset.file
  report: middle.report
END
"$qmat" run "$work/page.yaml" --set "model=$work/bracket.off" -q -o "$work/page.html" -o "both=$work/both.png" \
  -o "overlay=$work/overlay.png" -o "asset=$work/middle.ma" -o "report=$work/middle.json"
node "$source/tests/page/page_test.mjs" "$chromium" "$work"
