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

/* The 3D Delaunay triangulation of `count` points (3 doubles each, finite), by CGAL with exact predicates. Symbolic
 * perturbation resolves cospherical points, so the result does not depend on the order of insertion. Tetrahedra are
 * sorted by their corner ids. Equal points are represented by the smallest id. The arrays live in the context's arena.
 * QMAT_ERROR_GEOMETRY if all points are coplanar, QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with CGAL's message,
 * QMAT_CANCELLED. One thread. Cost: O(n log n) for points on surfaces, about 5 microseconds per point. */
qmat_status qmat_delaunay_tetrahedra(qmat_context *context, const double *points, size_t count,
                                     qmat_tetrahedra *tetrahedra);

/* The same for integer points (3 per point, 0 to QMAT_LATTICE_MOST), most of them cospherical: 64-bit integers decide
 * exactly where the other would fall back on slow exact numbers. About 10 microseconds per point. */
#define QMAT_LATTICE_MOST 512
qmat_status qmat_delaunay_lattice(qmat_context *context, const int32_t *points, size_t count,
                                  qmat_tetrahedra *tetrahedra);

#ifdef __cplusplus
}
#endif

#endif
