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
 * direction. The triangulation has small dihedral angles and a small area, or is the constrained Delaunay triangulation
 * of a polygon that is nearly flat; if neither exists, it is a fan. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with
 * CGAL's message. One thread. Cost: n log n if nearly flat, else up to cubic in the sides that see each other. Source:
 * Liepa 2003, Filling holes in meshes. */
qmat_status qmat_triangulate_hole(qmat_context *context, const double *points, const double *thirds, size_t count,
                                  uint32_t *triangles);

#ifdef __cplusplus
}
#endif

#endif
