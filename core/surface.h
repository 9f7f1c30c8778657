/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_SURFACE_H
#define QMAT_CORE_SURFACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/frame.h"

/* A mesh made ready for questions (Embree): inside or outside, how far, what a ray meets. All points and distances
 * are in the mesh's unit frame. After qmat_surface_new it is only read: any number of threads may ask at once. */
typedef struct qmat_surface qmat_surface;

/* Builds the search structure. `*surface` is freed with qmat_surface_free; on failure it is NULL. The mesh must stay
 * alive as long. Degenerate triangles are allowed. Cost: O(n log n) time on all threads, about 150 bytes a triangle. */
qmat_status qmat_surface_new(qmat_context *context, const qmat_mesh *mesh, qmat_surface **surface);
void qmat_surface_free(qmat_surface *surface);

/* The unit frame that points are in. */
const qmat_frame *qmat_surface_frame(const qmat_surface *surface);
/* The mesh's vertices in the unit frame: 3 * vertex_count doubles; the surface owns them. */
const double *qmat_surface_positions(const qmat_surface *surface);
const qmat_mesh *qmat_surface_mesh(const qmat_surface *surface);

/* Whether a point lies inside the solid. Closed surfaces: the majority of fixed rays, each of which looks at the side
 * of the first triangle it meets; open ones: the generalised winding number (Jacobson et al. 2013; Barill et al. 2018)
 * above one half. */
bool qmat_surface_inside(const qmat_surface *surface, const double point[3]);

/* The distance to the surface, exact in double precision for the triangle found. `closest` (3 doubles) and `triangle`
 * may be NULL. Points that are farther than `limit` (INFINITY: none) give INFINITY and leave both unset. */
double qmat_surface_distance(const qmat_surface *surface, const double point[3], double limit, double *closest,
                             uint32_t *triangle);

/* The distance, negative inside the solid. */
double qmat_surface_signed_distance(const qmat_surface *surface, const double point[3]);

/* What a ray from `origin` along the unit vector `direction` meets first beyond `start`: the distance, the triangle,
 * and the triangle's unit normal (3 doubles); any may be NULL. False when nothing. */
bool qmat_surface_cast(const qmat_surface *surface, const double origin[3], const double direction[3], double start,
                       double *distance, uint32_t *triangle, double *normal);

#endif
