/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_FLAT_FILL_CGAL_H
#define QMAT_NODES_MESH_FLAT_FILL_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Fills what closed polygons enclose in the plane, and keeps their sides: `points` (2 * count doubles, 3 to 2^30
 * points, finite), `sides` (2 * side_count ids of points: each a directed side of a polygon, any order; at most one of
 * two points, and as many sides enter a point as leave it). What has a winding number other than 0 is filled, holes
 * stay. `triangles` (room for 6 * count ids) receives `*made` triangles, which run along the sides as these are
 * directed, in rising order; their corners are points, on a polygon or inside. `*made` is 0 where no such triangles
 * exist: sides cross, a point lies on a side, two points are one, or a winding number is neither 0 nor one other
 * number, 1 or -1. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with CGAL's message. One thread. Cost: about
 * n log n. Source: constrained Delaunay triangulation (Chew 1989). */
qmat_status qmat_fill_flat_polygons(qmat_context *context, const double *points, size_t count, const uint32_t *sides,
                                    size_t side_count, uint32_t *triangles, size_t *made);

#ifdef __cplusplus
}
#endif

#endif
