/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_SURFACE_H
#define QMAT_CORE_GEOMETRY_SURFACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/geometry/frame.h"

/* A mesh made ready for questions (Embree): inside or outside, how far, what a ray meets. All points and distances
 * are in the mesh's unit frame. After qmat_surface_new it is only read: any number of threads may ask at once. */
typedef struct qmat_surface qmat_surface;

/* Builds the search structure. `*surface` is freed with qmat_surface_free; on failure, also QMAT_CANCELLED, it is NULL.
 * The mesh must stay alive as long. Degenerate triangles are allowed. Cost: O(n log n) time on all threads, about 150
 * bytes a triangle. */
qmat_status qmat_surface_new(qmat_context *context, const qmat_mesh *mesh, qmat_surface **surface);
void qmat_surface_free(qmat_surface *surface);

/* The unit frame that points are in. */
const qmat_frame *qmat_surface_frame(const qmat_surface *surface);
/* The mesh's vertices in the unit frame: 3 * vertex_count doubles; the surface owns them. */
const double *qmat_surface_positions(const qmat_surface *surface);
const qmat_mesh *qmat_surface_mesh(const qmat_surface *surface);

/* Whether a point lies inside the solid: whether the surface winds around it. Closed and oriented surfaces: fixed rays,
 * each of which adds up the sides of all triangles it crosses, two to seven of them until they agree; others: the
 * generalised winding number (Jacobson et al. 2013; Barill et al. 2018) above one half. Overlapping parts count as
 * their union. Points outside the bounding box are outside. Within 1e-7 of the surface either answer may come. */
bool qmat_surface_inside(const qmat_surface *surface, const double point[3]);

/* The same for `count` points (3 doubles each) on `threads` OpenMP threads: inside[i] becomes 1 or 0. */
void qmat_surface_inside_many(const qmat_surface *surface, const double *points, size_t count, uint8_t *inside,
                              int threads);

/* The distance to the surface, in double precision against the double positions. `closest` (3 doubles) and `triangle`
 * (of equally close ones the smallest) may be NULL. Points that are farther than `limit` (INFINITY: none) give INFINITY
 * and leave both unset. Beyond 10,000 diagonals every triangle is looked at. */
double qmat_surface_distance(const qmat_surface *surface, const double point[3], double limit, double *closest,
                             uint32_t *triangle);

/* The distance, negative inside the solid as qmat_surface_inside has it. */
double qmat_surface_signed_distance(const qmat_surface *surface, const double point[3]);

/* What a ray from `origin` along the unit vector `direction` meets first beyond `start` (>= 0): the distance in double
 * precision, the triangle (of equally far ones the smallest), and the triangle's unit normal (3 doubles, zero for a
 * degenerate triangle); any may be NULL. False when nothing. */
bool qmat_surface_cast(const qmat_surface *surface, const double origin[3], const double direction[3], double start,
                       double *distance, uint32_t *triangle, double *normal);

#endif
