/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_DELAUNAY_CGAL_H
#define QMAT_NODES_INITIAL_DELAUNAY_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

#define QMAT_NO_TETRAHEDRON UINT32_MAX

/* The finite tetrahedra of a 3D Delaunay triangulation. */
typedef struct qmat_tetrahedra {
  size_t count;
  uint32_t *corners;    /* 4 * count: point ids, positively oriented */
  uint32_t *neighbours; /* 4 * count: the tetrahedron across the facet opposite corner k, or QMAT_NO_TETRAHEDRON */
} qmat_tetrahedra;

/* The 3D Delaunay triangulation of `count` points (3 doubles each, finite), by CGAL with exact predicates. Cospherical
 * points are broken by symbolic perturbation, so the result does not depend on the order of insertion; tetrahedra are
 * sorted by their corner ids. Of equal points the one with the smallest id stands for all.
 * The arrays live in context->arena. QMAT_ERROR_GEOMETRY when all points lie in one plane; QMAT_ERROR_DEPENDENCY with
 * CGAL's text; QMAT_CANCELLED. One thread. Cost: O(n log n) for points on surfaces, about 5 microseconds a point. */
qmat_status qmat_delaunay_tetrahedra(qmat_context *context, const double *points, size_t count,
                                     qmat_tetrahedra *tetrahedra);

#ifdef __cplusplus
}
#endif

#endif
