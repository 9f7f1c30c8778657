/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_HAUSDORFF_BOUND_H
#define QMAT_NODES_MEASURE_HAUSDORFF_BOUND_H

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"

/* The farthest place of a surface from an envelope. */
typedef struct qmat_hausdorff_bound {
  double found;     /* the largest F found, at a point that was looked at or `known` */
  double bound;     /* no point of the surface has a larger F; unit frame */
  size_t count;     /* facets on which an F above the threshold was found */
  double *points;   /* 3 per such facet: the worst place found on it; in the context's arena */
  uint32_t *facets; /* their numbers, rising */
} qmat_hausdorff_bound;

/* Bounds F over the whole surface by branch and bound: F is 1-Lipschitz (eq. 9 over all of S, not only its samples),
 * and the distance to one primitive is convex, so that over a piece of a facet it is largest at a corner. `spheres` (4
 * per sphere, unit frame) are those that `envelope` was made of, `known` is an F that is attained somewhere (or 0). The
 * bound is at most `tolerance` (taken for 1e-6 at least) above the largest F found, `known` among these. Facets are
 * searched until their worst place is known to the tolerance or lies below `known`. QMAT_ERROR_MEMORY, QMAT_CANCELLED.
 * All threads; the answer does not depend on their number. */
qmat_status qmat_hausdorff_bound_measure(qmat_context *context, const qmat_surface *surface,
                                         const qmat_envelope *envelope, const double *spheres, double known,
                                         double tolerance, double threshold, qmat_hausdorff_bound *bound);

#endif
