#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Prints the SHA-256 of every file that `qmat mat` writes, in every format. The lines before and after a change are the
# same when it does not alter results.
#   digests.sh [--epsilon E] [MODEL...]      default: the generated models and ../shared/data/surfaces at 2 %
# QMAT_BUILD is the build folder, by default build/release.
set -eu
epsilon=2%
options="--epsilon"
. "$(dirname "$0")/functions.sh"
if [ $# -eq 0 ]; then
  "$build/qmat_models" all "$work" >"$work/models.log"
  for model in "$work"/*.off "$top"/../shared/data/surfaces/*; do
    if [ -e "$model" ]; then set -- "$@" "$model"; fi
  done
fi
QMAT_CACHE=off # this build has to compute its own results
export QMAT_CACHE
for model in "$@"; do
  mkdir "$work/written"
  "$build/qmat" mat "$model" --epsilon "$epsilon" --quiet --progress off -o "$work/written/mat.ma" \
    -o "$work/written/mat.ply" -o "$work/written/mat.glb" -o "$work/written/mat.gltf" -o "$work/written/mat.usda" \
    -o "$work/written/mat.usdz"
  for file in "$work"/written/*; do
    printf '%s  %s %s\n' "$(sha256sum <"$file" | cut -d ' ' -f 1)" "$(basename "$model")" "$(basename "$file")"
  done
  rm -r "$work/written"
done
