/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_REGULAR_CGAL_H
#define QMAT_NODES_INITIAL_REGULAR_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The finite edges and triangles of a 3D regular triangulation: the dual of the power diagram of spheres. */
typedef struct qmat_regular_simplices {
  size_t edge_count, triangle_count;
  uint32_t *edges;     /* 2 * edge_count: ids ascend within an edge, edges are sorted */
  uint32_t *triangles; /* 3 * triangle_count: the same */
  uint8_t *hidden;     /* per sphere: 1 if its power cell is empty, so that it belongs to no simplex */
} qmat_regular_simplices;

/* The regular triangulation of `count` spheres (4 doubles each: centre, radius), by CGAL with exact predicates.
 * Symbolic perturbation resolves degenerate positions. Of equal spheres the first stays. The arrays live in the
 * context's arena. Spheres whose centres are coplanar have simplices too. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with
 * CGAL's message, QMAT_CANCELLED. One thread. Cost: O(n log n) for medial spheres, about 10 microseconds per sphere. */
qmat_status qmat_regular_simplices_find(qmat_context *context, const double *spheres, size_t count,
                                        qmat_regular_simplices *simplices);

#ifdef __cplusplus
}
#endif

#endif
