/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_BALL_UNION_AXIS_H
#define QMAT_NODES_INITIAL_BALL_UNION_AXIS_H

#include "core/value.h"

typedef struct qmat_ball_union_counts {
  size_t corners, singular_edges, singular_triangles;
} qmat_ball_union_counts;

/* The medial axis of a union of balls (N. Amenta, R. K. Kolluri: The medial axis of a union of balls, 2001): the
 * singular simplices of its dual shape, and the Voronoi diagram of its corners in the rest of that shape. Centres of
 * Voronoi vertices that are at most `merge` apart become one. `balls` holds 4 doubles per ball in the unit frame. Sets
 * spheres, edges and triangles of the unsealed `medial`, in the unit frame, and empty responsible regions.
 * QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. One thread. Cost: O(n log n), about 50 microseconds per
 * ball. */
qmat_status qmat_ball_union_axis(qmat_context *context, const double *balls, size_t count, double merge,
                                 qmat_medial *medial, qmat_ball_union_counts *counts);

#endif
