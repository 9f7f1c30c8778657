/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SOLID_PARTS_H
#define QMAT_NODES_COLLIDERS_SOLID_PARTS_H

#include "core/geometry/surface.h"
#include "nodes/colliders/shape_set.h"

/* Points whose convex hull contains a part of a solid. */
typedef struct qmat_solid_part {
  size_t count;
  double *points; /* 3 each, in the unit frame; owned; NULL for none */
} qmat_solid_part;

/* Divides a solid among shapes: each point belongs to the shape that is nearest to the centre of a cube around the
 * point. The hulls of all parts together contain the solid. Cubes are small, down to 1/256, only where shapes meet. The
 * solid's part in a cube is within the hull of the corners of the cube that are inside the solid and of the surface in
 * the cube: these are the points of a part, as far as they are vertices of its hull, to 1e-9 (extreme_points.h).
 *
 * `*parts` receives one part per shape, in the context's arena; free it with qmat_solid_parts_free. `surface` is
 * watertight. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. Cost: linear
 * in the triangles, and in the area between the parts. */
qmat_status qmat_solid_parts_find(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                  qmat_solid_part **parts);

/* Frees the points of `count` parts. NULL is allowed. */
void qmat_solid_parts_free(qmat_solid_part *parts, size_t count);

#endif
