#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Prints one JSON object: what `qmat mat` takes for models and for a million triangles, stage by stage, its memory, and
# its initial medial mesh against CGAL's plain Delaunay triangulation of the same samples.
#   scale.sh [MODEL...]      the first model is also divided into a million triangles; default: a generated octopus
# QMAT_BUILD is the build folder, by default build/release.
set -eu
. "$(dirname "$0")/functions.sh"
cmake --build "$build" --target qmat qmat_scale >&2
"$build/qmat_scale" "$build/qmat" "$work" "$@"
