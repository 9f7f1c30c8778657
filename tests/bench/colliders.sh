#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Colliders that contain the solid, against those of VHACD at about the same number of shapes:
#   colliders.sh [--epsilon E] [--kind K] [--json FILE] [MODEL...]
# The default: the eleven of ../shared/data/surfaces, epsilon 0.5 %, hulls (the other kind is any).
# E is that of the medial mesh; the colliders may be twice as far from the surface. A Markdown table: shapes, random points
# of the solid that no shape contains, volume and intersection over union with the solid, bytes. Models are closed
# surfaces. Needs node and npm, which fetches Rapier.
set -eu
epsilon=0.5%
kind=hulls
json=
options="--epsilon --kind --json"
. "$(dirname "$0")/functions.sh"
need node nodejs
need npm npm
if [ -n "$json" ]; then : >"$json"; fi
if [ $# -eq 0 ]; then set -- "$top"/../shared/data/surfaces/*; fi
if [ ! -e "$1" ]; then
  echo "no models: name some, or put them into ../shared/data/surfaces" >&2
  exit 2
fi
cp "$top/tests/engines/package.json" "$top/tests/engines/surface.mjs" "$top/tests/bench/colliders.mjs" "$work"
(cd "$work" && npm install --no-audit --no-fund --no-package-lock >install.log 2>&1) || {
  cat "$work/install.log" >&2
  exit 1
}
echo "| model | shapes | outside | volume | IoU | bytes | VHACD: hulls | outside | volume | IoU | bytes |"
echo "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
for model in "$@"; do
  "$build/qmat" run "$top/graphs/colliders.yaml" --set model="$model" --set epsilon="$epsilon" --set kind="$kind" \
    --quiet -o "$work/out.glb"
  line=$(node "$work/colliders.mjs" "$top/examples/readers" "$work/out.glb" "$model")
  name=$(basename "$model")
  node -e '
    const [name, line] = process.argv.slice(1), { qmat, vhacd, points } = JSON.parse(line);
    const cells = (s) => [s.shapes, `${(100 * s.outside / points).toFixed(3)} %`, s.volume.toFixed(3), s.iou.toFixed(3), s.bytes];
    console.log(`| ${[name.replace(/[.].*/, ""), ...cells(qmat), ...cells(vhacd)].join(" | ")} |`);
  ' "$name" "$line"
  if [ -n "$json" ]; then echo "{\"model\": \"$name\", \"measured\": $line}" >>"$json"; fi
done
