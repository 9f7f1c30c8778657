#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Prints one JSON object: the time of `qmat mat` per node, its memory, and the time of its initial medial mesh relative
# to CGAL's Delaunay triangulation of the same samples.
#   scale.sh [MODEL...]      the first model is measured again in a million triangles; default: a generated octopus
# QMAT_BUILD is the build folder, by default build/release.
set -eu
options=
. "$(dirname "$0")/functions.sh"
cmake --build "$build" --target qmat qmat_scale >&2
"$build/qmat_scale" "$build/qmat" "$work" "$@"
