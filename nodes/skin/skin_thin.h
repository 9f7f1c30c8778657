/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_THIN_H
#define QMAT_NODES_SKIN_SKIN_THIN_H

#include "core/context.h"
#include "nodes/skin/skin_triangles.h"

/* Removes vertices of a closed, oriented 2-manifold (meshoptimizer) while its quadric error stays below `error` (above
 * 0, in the unit of the positions), which is an estimate and no bound, and while more than `most` triangles are left.
 * It stays such a manifold, of the same topology: meshoptimizer does not promise that. Where it fails, triangles are
 * left as they were, or their component is thinned out for less; after some rounds all is left as it was. `surface`
 * keeps the vertices that are left, in their order. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread; deterministic. Cost:
 * some 1 microsecond a triangle. */
qmat_status qmat_skin_thin(qmat_context *context, double error, size_t most, qmat_skin_triangles *surface);

#endif
