/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_SURFACE_H
#define QMAT_CORE_GEOMETRY_SURFACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/geometry/frame.h"

/* A mesh prepared for queries with Embree: inside or outside, distance, ray casts. All points and distances are in the
 * mesh's unit frame. It is immutable after qmat_surface_new, so any number of threads may query it at once.
 *
 * The sheets of the mesh count as what lies within half the sheet thickness of them. They bound no solid, and rays pass
 * through them. */
typedef struct qmat_surface qmat_surface;

/* Builds the search structure; free it with qmat_surface_free. On failure (also QMAT_CANCELLED) `*surface` is NULL. A
 * sealed mesh keeps it, and later calls give the same one at no cost. The mesh must outlive the surface. Degenerate
 * triangles are allowed. Cost: O(n log n) on all threads, about 150 bytes per triangle. */
qmat_status qmat_surface_new(qmat_context *context, const qmat_mesh *mesh, qmat_surface **surface);
/* The same without the sheets, in the unit frame of the whole mesh; qmat_surface_mesh is then without them too. */
qmat_status qmat_surface_new_of_solids(qmat_context *context, const qmat_mesh *mesh, qmat_surface **surface);
/* NULL is allowed. */
void qmat_surface_free(qmat_surface *surface);

/* The unit frame of all points. */
const qmat_frame *qmat_surface_frame(const qmat_surface *surface);
/* The mesh's vertices in the unit frame: 3 * vertex_count doubles, owned by the surface. */
const double *qmat_surface_positions(const qmat_surface *surface);
/* The mesh that the surface was built from, which the caller owns; of one without sheets, a mesh that borrows its
 * arrays. */
const qmat_mesh *qmat_surface_mesh(const qmat_surface *surface);
/* Half the thickness of the sheets; 0 without sheets. */
double qmat_surface_half_thickness(const qmat_surface *surface);

/* Whether a point lies inside the solid, sheets aside, by the winding number of the surface around it. A closed and
 * oriented surface is tested with fixed rays, two to seven until they agree; each ray adds up the orientations of the
 * triangles that it crosses. Any other surface is tested with the generalised winding number (Jacobson et al. 2013;
 * Barill et al. 2018), inside above one half. Overlapping components count as their union. Points outside the bounding
 * box are outside. Within 1e-7 of the surface either result is possible. */
bool qmat_surface_inside(const qmat_surface *surface, const double point[3]);

/* The same for `count` points (3 doubles each) on `threads` OpenMP threads: inside[i] becomes 1 or 0. */
void qmat_surface_inside_many(const qmat_surface *surface, const double *points, size_t count, uint8_t *inside,
                              int threads);

/* The distance to the surface in double precision: to the triangles that bound solids, and to where sheets end, half
 * their thickness away from their triangles. `closest` (3 doubles) receives the closest point of a triangle and
 * `triangle` that triangle, the smallest of equally close ones; both may be NULL. A point farther than `limit`
 * (INFINITY: no limit) gives INFINITY and leaves both unset. Beyond 10,000 diagonals every triangle is tested. */
double qmat_surface_distance(const qmat_surface *surface, const double point[3], double limit, double *closest,
                             uint32_t *triangle);

/* An upper bound of the distance by one triangle of the surface: the distance to it; for a sheet less half the
 * thickness, but at least that. It is a convex function of the point, unlike the distance to all. */
double qmat_surface_distance_to_triangle(const qmat_surface *surface, const double point[3], uint32_t triangle);

/* The same distance without limit, negative inside the solid (see qmat_surface_inside). With sheets it is the smaller
 * of that for the solids and the distance to a sheet less half the thickness. Between two points it changes by at most
 * their distance, if the surface is closed (qmat_surface_is_closed). */
double qmat_surface_signed_distance(const qmat_surface *surface, const double point[3]);

/* The same where its size is at most `limit` (>= 0); else it may be infinite, of either sign, which takes less time. */
double qmat_surface_signed_distance_within(const qmat_surface *surface, const double point[3], double limit);

/* Whether the surface is closed and oriented, sheets aside. Around any other surface, the side that a point is on
 * changes also where there is no triangle. */
bool qmat_surface_is_closed(const qmat_surface *surface);

/* The same, faster where it is known that the signed distance (of a surface that is not closed: its size) differs from
 * `near` by at most `gap`. */
double qmat_surface_signed_distance_near(const qmat_surface *surface, const double point[3], double near, double gap);

/* The depth of a point whose signed distance is known to be negative; INFINITY where it exceeds `limit`. */
double qmat_surface_depth_up_to(const qmat_surface *surface, const double point[3], double limit);

/* Whether the surface is closed and oriented, apart from sheets without a thickness, which have no inside. The depth
 * inside is then the distance to a set of points, and a path at a positive distance does not change its side. */
bool qmat_surface_is_watertight(const qmat_surface *surface);

/* An upper bound of the radius less the depth over a simplex of `count` (1 to 3) spheres (4 doubles each), whose centre
 * is known to be inside the solid or a thick sheet: at least `lowest`, and exact up to that beside flat or convex
 * surface and in a thick sheet at one of its triangles. INFINITY where it is above `limit` or hard to find and,
 * outside thick sheets, where it is not below every radius. `*failed` is a hint: set it to UINT32_MAX first and pass it
 * to the calls for simplices near by. It changes the time, not the answer. */
double qmat_surface_excess_bound(const qmat_surface *surface, const double *const spheres[], int count, double lowest,
                                 double limit, uint32_t *failed);

/* The first hit beyond `start` (>= 0) and up to `end` (INFINITY: anywhere) of a ray from `origin` along the unit vector
 * `direction`: its distance in double precision, its triangle (the smallest of equally distant ones), and the
 * triangle's unit normal (3 doubles, zero for a degenerate triangle). Each may be NULL. False when nothing is hit. */
bool qmat_surface_cast(const qmat_surface *surface, const double origin[3], const double direction[3], double start,
                       double end, double *distance, uint32_t *triangle, double *normal);

#endif
