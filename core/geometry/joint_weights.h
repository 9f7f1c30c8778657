/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_JOINT_WEIGHTS_H
#define QMAT_CORE_GEOMETRY_JOINT_WEIGHTS_H

#include <stddef.h>
#include <stdint.h>

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

struct qmat_mesh;
struct qmat_medial;
struct qmat_surface;

/* Joints and weights of skinned meshes and of the spheres that describe them. */

/* The four strongest of `count` influences as a mesh or a medial mesh stores them: weights descend and sum to 1, and a
 * joint is there once. Weights that are not above zero or not finite do not count; joints beyond 16 bits neither. Where
 * none is left, joint 0 has the whole weight. `joints` and `weights` have `count` items, the results 4. Quadratic. */
void qmat_strongest_joints(const uint32_t *joints, const double *weights, size_t count, uint32_t strongest[4],
                           double strengths[4]);

/* Gives each sphere of an unsealed medial mesh, in the units of `mesh`, the mean joints and weights of the surface that
 * it answers for: the points that are nearer to it than to the other spheres of the primitive nearest to them. A sphere
 * that answers for no point takes those of the vertex nearest to it. Nothing is done for a mesh without a skin.
 * Triangles are divided, so that points are a fiftieth of the diagonal apart, but at most 16 on a side.
 * QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY for a medial mesh with ids out of range, QMAT_CANCELLED. Threads are the
 * context's; the result does not depend on them. Cost: a query of the envelope for each point. */
qmat_status qmat_joints_of_spheres(qmat_context *context, const struct qmat_mesh *mesh, struct qmat_medial *medial);

/* Gives each vertex of an envelope's mesh the joints and weights of the spheres nearest to it: `joints` and `weights`
 * get 4 for each. The spheres of the primitive nearest to a vertex count by their weights at its foot, which vary
 * evenly along cones and slabs. QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY, QMAT_CANCELLED. Threads are the context's; the
 * result does not depend on them. Cost: a query of the envelope for each vertex. */
qmat_status qmat_joints_of_envelope(qmat_context *context, const struct qmat_medial *medial,
                                    const struct qmat_mesh *mesh, uint32_t *joints, double *weights);

/* Gives a point (3 doubles, in the units of the mesh) the joints and weights of the nearest point of a surface, whose
 * mesh has joints: those of the corners of its triangle, blended. `joints` and `weights` get 4, as above. Any number of
 * threads may call it at once. Cost: a query of the surface. */
void qmat_joints_at(const struct qmat_surface *surface, const double point[3], uint32_t joints[4], double weights[4]);

/* Gives each vertex of an unsealed mesh, in the units of `given`, those at its place. The mesh owns its new arrays,
 * also on failure. Nothing is done where `given`, which is sealed, has no skin. QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY
 * for a `given` without a diagonal, QMAT_CANCELLED. Threads are the context's; the result does not depend on them. */
qmat_status qmat_joints_of_surface(qmat_context *context, const struct qmat_mesh *given, struct qmat_mesh *mesh);

#ifdef __cplusplus
}
#endif

#endif
