/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_EXTREME_POINTS_H
#define QMAT_NODES_COLLIDERS_EXTREME_POINTS_H

#include <stdbool.h>

#include "core/context.h"

/* Points that come a few at a time, of which extreme ones are kept. All 0 at first; free the points with qmat_free. */
typedef struct qmat_point_heap {
  double *points; /* 3 each; NULL for none */
  size_t count, capacity;
  size_t limit; /* of the count, before points are dropped */
} qmat_point_heap;

/* The directions of qmat_extreme_points_keep. */
enum { QMAT_EXTREME_DIRECTIONS = 64 };

/* Keeps of `*count` points (3 doubles each) some whose convex hull has all others within `tolerance`, a length above 0,
 * and counts them. They come in another order. The hull grows by the points that are farthest outside of its facets
 * (Barber et al. 1996), and points inside are dropped on the way. So points in the middle of a flat side go, which a
 * hull by exact arithmetic keeps. All stay where they are nearer to a plane than the tolerance, or fewer than 65.
 * QMAT_OK or QMAT_ERROR_MEMORY. Cost: a hull of the points kept so far per round, and the points left times the depth
 * of a tree of its facets.
 */
qmat_status qmat_extreme_points_keep(double *points, size_t *count, double tolerance);

/* Moves the points that are the farthest along some of `directions` directions to the front, the first of equally far
 * ones. Returns their number. Cost: the directions times the points. */
size_t qmat_extreme_points_first(double *points, size_t count, size_t directions);

/* Adds points. Where there are 4096, or twice as many as the last time, those within `tolerance` of the hull of the
 * others are dropped. False: no memory is left. */
bool qmat_point_heap_add(qmat_point_heap *heap, const double *points, size_t count, double tolerance);

#endif
