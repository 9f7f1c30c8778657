/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_HAUSDORFF_BOUND_H
#define QMAT_NODES_MEASURE_HAUSDORFF_BOUND_H

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"

/* The distance from a surface to an envelope: the one-sided Hausdorff distance of the first to the second. */
typedef struct qmat_hausdorff_bound {
  double found;   /* the largest F found at a point of the surface, or `known` */
  double bound;   /* an upper bound of F over the surface, raised by 1e-9 for rounding; unit frame */
  size_t count;   /* facets with a point where F exceeds the threshold */
  double *points; /* 3 per such facet, in the order of their numbers: its worst point; in the context's arena */
} qmat_hausdorff_bound;

/* Bounds F over the whole surface by branch and bound (eq. 9 over all of S, not only its samples). F is 1-Lipschitz,
 * and the distance to one primitive is convex, so that its maximum over a piece of a facet is at a corner. `known` is
 * an F attained somewhere, or 0. The bound exceeds the largest F found, `known` included, by at most `tolerance` (1e-6
 * at least), and less where that proves F to be at most `decisive`. A facet is searched until its worst point is known
 * to the tolerance or is below `known`. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the answer does not depend on
 * their number. */
qmat_status qmat_hausdorff_bound_measure(qmat_context *context, const qmat_surface *surface,
                                         const qmat_envelope *envelope, double known, double tolerance,
                                         double threshold, double decisive, qmat_hausdorff_bound *bound);

#endif
