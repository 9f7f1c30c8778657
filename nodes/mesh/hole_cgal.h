/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_HOLE_CGAL_H
#define QMAT_NODES_MESH_HOLE_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Triangulates a closed polygon in space: `points` (3 * count doubles, 3 to 2^31 points, finite; no two neighbours
 * equal). `thirds` (as many) are the points opposite to the sides i, i + 1 in the triangles around. `triangles` (3 *
 * (count - 2)) receives indices of points; every side i, i + 1 of the polygon is a side of one triangle, in that
 * direction. A polygon that is flat up to 1 % of its size gets its constrained Delaunay triangulation, another one the
 * triangulation of the least dihedral angles and area; if neither exists, it is a fan. Above 200 sides, the angles are
 * the least among Delaunay triangles. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with
 * CGAL's message. One thread. Cost: n log n if nearly flat, else cubic up to 200 sides (0.1 s), and quadratic with
 * more. Source: Liepa 2003, Filling holes in meshes. */
qmat_status qmat_triangulate_hole(qmat_context *context, const double *points, const double *thirds, size_t count,
                                  uint32_t *triangles);

#ifdef __cplusplus
}
#endif

#endif
