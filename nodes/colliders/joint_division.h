/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_JOINT_DIVISION_H
#define QMAT_NODES_COLLIDERS_JOINT_DIVISION_H

#include "nodes/colliders/joint_points.h"

/* Divides the cones and slabs of a medial mesh, whose spheres are in the unit frame, among joints. Each joint gets the
 * part of a cone or slab where the feet of its points are: spheres between, which the medial mesh has there, too. Parts
 * of neighbouring joints may overlap; on a cone there is no gap between them. A cone or slab without such a foot goes
 * to the joint of the point that is nearest to its middle. No sphere of `divided` has two joints. `*joints` receives
 * those of its spheres. Both are in the context's arena; of `divided` only spheres, edges and triangles are set.
 * QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY for ids out of range. All threads; the result does not depend on their number.
 * Cost: a query of the envelope for each point. */
qmat_status qmat_joint_points_divide(qmat_context *context, const qmat_joint_points *points, const qmat_medial *unit,
                                     qmat_medial *divided, uint32_t **joints);

#endif
