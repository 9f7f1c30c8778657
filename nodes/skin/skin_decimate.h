/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_DECIMATE_H
#define QMAT_NODES_SKIN_SKIN_DECIMATE_H

#include "core/context.h"
#include "core/geometry/envelope.h"
#include "nodes/skin/skin_triangles.h"

/* How far a surface is from the envelope, and the surface that it was made of from it, in the unit of the positions. */
typedef struct qmat_skin_errors {
  double to_envelope; /* the largest |F| at 15 points of each triangle */
  /* An upper bound of the distance from a vertex of the original, thinned out, to the surface. What is thinned out
   * later, for a number of triangles, is not in it. */
  double from_original;
} qmat_skin_errors;

/* Replaces a closed, oriented 2-manifold by one of fewer triangles with the same topology. It is thinned out first
 * (qmat_skin_thin), then edges collapse (qmat_skin_collapse). An edge collapses only where |F| at samples of the new
 * triangles is at most 3/4 of `error` (above 0), or what it was there before; where each vertex that thinning left and
 * that was nearest stays as near to the new triangles; and where no triangle turns over or degenerates. With `most`
 * above 0, both go on for twice the error, and so on, until so many triangles are left or no more can go. `errors` gets
 * those of the result. QMAT_ERROR_MEMORY, QMAT_CANCELLED. The same triangles for any number of threads. Cost: some 10
 * microseconds a triangle of the surface. */
qmat_status qmat_skin_decimate(qmat_context *context, const qmat_envelope *envelope, double error, size_t most,
                               qmat_skin_triangles *surface, qmat_skin_errors *errors);

#endif
