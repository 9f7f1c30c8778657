/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_JOINT_POINTS_H
#define QMAT_NODES_COLLIDERS_JOINT_POINTS_H

#include "core/geometry/surface.h"

/* Points of a skinned surface and the joints that they belong to. A point belongs to the joint with the largest weight,
 * the one with the lowest number of equal ones, and to those with at least a quarter of that weight, so that what two
 * joints have overlaps. Joints without a vertex where they have the largest weight have no points. A point is there
 * once for each of its joints. All arrays are in the context's arena. */
typedef struct qmat_joint_points {
  size_t count, even_count; /* the first are spread evenly over the area, the others are vertices */
  double *points;           /* 4 each: a place in the unit frame, and how far the solid reaches around it */
  uint32_t *joints;         /* count */
  size_t joint_count;       /* of the joints with points; 0: the surface has no skin */
  uint32_t first_joint;     /* the one with the lowest number */
} qmat_joint_points;

/* Takes all vertices of triangles, and points between. QMAT_ERROR_MEMORY. One thread. Linear. */
qmat_status qmat_joint_points_take(qmat_context *context, const qmat_surface *surface, qmat_joint_points *taken);

#endif
