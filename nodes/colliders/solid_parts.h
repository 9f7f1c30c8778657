/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SOLID_PARTS_H
#define QMAT_NODES_COLLIDERS_SOLID_PARTS_H

#include "core/geometry/surface.h"
#include "nodes/colliders/joint_points.h"
#include "nodes/colliders/shape_set.h"

/* Cells along an axis of the unit frame's box. */
enum { QMAT_SOLID_CELLS = 64 };

/* Points may be dropped so far outside of the hull of the others; in the unit frame. */
static const double qmat_solid_dropped = 1e-9;

/* A part's points in one cell. Their convex hull contains what the part has in the cell. */
typedef struct qmat_solid_cell {
  uint8_t at[3];         /* its place along each axis, below QMAT_SOLID_CELLS */
  uint32_t count, first; /* of points; first: of those that are the farthest along some direction, before the others */
} qmat_solid_cell;

/* Points whose convex hull contains a part of a solid. */
typedef struct qmat_solid_part {
  size_t count, cell_count;
  double *points;         /* 3 each, in the unit frame; owned; NULL for none */
  qmat_solid_cell *cells; /* owned; NULL for none */
  double *cell_points;    /* those of all cells, one cell after the other; owned; NULL for none */
  uint32_t joint;         /* that the part moves with; 0 where nothing is skinned */
} qmat_solid_part;

/* Divides a solid among shapes: each point belongs to the shape that is nearest to the centre of a cube around the
 * point. The hulls of all parts together contain the solid. Cubes are those of the cells, and smaller, down to 1/256,
 * only where shapes meet. The solid's part in a cube is within the hull of the corners of the cube that are inside the
 * solid and of the surface in the cube: these are the points of a cell. Those of the part are the vertices of its hull,
 * to 1e-9 (extreme_points.h).
 *
 * Sheets are divided likewise. An octahedron that reaches by `sheet_reach` (above 0, in the unit frame) stands for each
 * of their points, so that their parts have a volume.
 *
 * `*parts` receives one part per shape, in the context's arena; free it with qmat_solid_parts_free. The triangles of
 * `surface` that bound solids are closed and oriented, and its sheets have no thickness. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. All threads; the result does not depend on their number. Cost: linear in the triangles, in the cells,
 * and in the area between the parts. */
qmat_status qmat_solid_parts_find(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                  double sheet_reach, qmat_solid_part **parts);

/* Gives the parts of a skinned solid the joints of their shapes, and each point of a joint to the part of the joint's
 * nearest shape. The hulls of a joint's parts then contain all of its points. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One
 * thread. Cost: the points times the shapes. */
qmat_status qmat_solid_parts_add_joints(qmat_context *context, const qmat_shape_set *set,
                                        const qmat_joint_points *points, qmat_solid_part *parts);

/* Frees the points and cells of `count` parts. NULL is allowed. */
void qmat_solid_parts_free(qmat_solid_part *parts, size_t count);

#endif
