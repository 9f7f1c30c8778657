/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_CONVEX_HULL_CGAL_H
#define QMAT_NODES_COLLIDERS_CONVEX_HULL_CGAL_H

#include <stddef.h>
#include <stdint.h>

#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The convex hull of `count` points (3 doubles each; at least 4, not in one plane), with exact predicates. `triangles`
 * has room for 6 * count ids and receives 3 ids of points per triangle, counter-clockwise from outside, each with its
 * lowest id first, in rising order; points within a facet or an edge are vertices too. `*triangle_count` becomes their
 * number. QMAT_ERROR_MEMORY, or QMAT_ERROR_GEOMETRY for points in a plane, up to rounding. Safe from any thread.
 * Expected cost: O(n log n). */
qmat_status qmat_convex_hull(const double *points, size_t count, uint32_t *triangles, size_t *triangle_count);

/* The same for points that come in several steps: all 0 at first, freed by qmat_growing_hull_uninit, also after an
 * error. One thread at a time. */
typedef struct qmat_growing_hull {
  struct qmat_hull_points *inserted;
  size_t count; /* of them */
} qmat_growing_hull;

/* The hull of the first `count` points, of which the first hull->count are those of earlier calls. */
qmat_status qmat_growing_hull_of(qmat_growing_hull *hull, const double *points, size_t count, uint32_t *triangles,
                                 size_t *triangle_count);
void qmat_growing_hull_uninit(qmat_growing_hull *hull);

#ifdef __cplusplus
}
#endif

#endif
