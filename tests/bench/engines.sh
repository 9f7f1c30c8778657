#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Drops the colliders of models (OFF, OBJ, STL, and glTF of one mesh) on a plane and down a staircase, in Rapier, Jolt and
# Bullet, for ten seconds:
#   engines.sh [--epsilon E] [--kind K] [MODEL...]      default: all of ../shared/data/surfaces at 0.5 %, hulls
# A line a model: how far its surface ends from what it lies on, in percent of the diagonal, or what went wrong. Needs
# node and npm, which fetches the engines.
set -eu
epsilon=0.5%
kind=hulls
options="--epsilon --kind"
. "$(dirname "$0")/functions.sh"
need node nodejs
need npm npm
if [ $# -eq 0 ]; then set -- "$top"/../shared/data/surfaces/*; fi
if [ ! -e "$1" ]; then
  echo "no models: name some, or put them into ../shared/data/surfaces" >&2
  exit 2
fi
cp "$top/tests/engines/package.json" "$top/tests/engines/drop.mjs" "$top/tests/engines/surface.mjs" "$work"
(cd "$work" && npm install --no-audit --no-fund --no-package-lock >install.log 2>&1) || {
  cat "$work/install.log" >&2
  exit 1
}
bad=0
for model in "$@"; do
  if "$build/qmat" run "$top/graphs/colliders.yaml" --set model="$model" --set epsilon="$epsilon" --set kind="$kind" --quiet -o "$work/out.glb"; then
    node "$work/drop.mjs" "$top/examples/readers" "$work/out.glb" "$model" >"$work/line" || bad=1
    sed "s|^[^:]*|$(basename "$model")|" "$work/line"
  else
    bad=1
  fi
done
exit $bad
