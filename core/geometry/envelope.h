/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_ENVELOPE_H
#define QMAT_CORE_GEOMETRY_ENVELOPE_H

#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* The enveloping volume of a medial mesh, prepared for distance queries. Its primitives are the slabs, the cones that
 * are no side of a slab, and the spheres that are no end of a cone or corner of a slab. F(p) is the minimum of their
 * signed distances (core/geometry/medial_distance.h; eq. 9 with a signed minimum). Outside, F is exactly the distance
 * to the volume; inside it is negative, and -F is a lower bound of the depth. F is 1-Lipschitz. An envelope is
 * immutable after qmat_envelope_new, so any number of threads may query it at once; results do not depend on earlier
 * queries. */
typedef struct qmat_envelope qmat_envelope;

/* Builds the search structure; free it with qmat_envelope_free. `spheres` has 4 * sphere_count doubles (x y z radius;
 * radius >= 0), `edges` 2 * edge_count ids and `triangles` 3 * triangle_count ids, in any order; an array of count 0
 * may be NULL. The sides of triangles may be among the edges or not. The arguments are copied. An envelope without
 * primitives is allowed. On failure `*envelope` is NULL: QMAT_ERROR_MEMORY, or QMAT_ERROR_GEOMETRY for an id out of
 * range. Cost: O(n log n) on one thread, about 550 bytes per triangle. */
qmat_status qmat_envelope_new(qmat_context *context, const double *spheres, size_t sphere_count, const uint32_t *edges,
                              size_t edge_count, const uint32_t *triangles, size_t triangle_count,
                              qmat_envelope **envelope);

/* The same for a medial mesh, in its own units. */
qmat_status qmat_envelope_of_medial(qmat_context *context, const qmat_medial *medial, qmat_envelope **envelope);

/* NULL is allowed. */
void qmat_envelope_free(qmat_envelope *envelope);

/* The number of primitives. Their order: the triangles as given, the edges on no triangle as given, then the isolated
 * spheres. */
size_t qmat_envelope_primitive_count(const qmat_envelope *envelope);

/* Writes the sphere ids of a primitive to ids[0..2] and returns their number: 3 for a slab, 2 for a cone, 1 for a
 * sphere. */
int qmat_envelope_primitive(const qmat_envelope *envelope, size_t primitive, uint32_t ids[3]);

/* What is measured by F more exactly than this is rounding. */
#define QMAT_LEAST_ENVELOPE_TOLERANCE 1e-6

/* F(point), where `point` is 3 doubles; INFINITY when there is no primitive. `primitive` (may be NULL) receives the
 * primitive that attains it. Cost: O(log n) for a point near the boundary when primitives overlap little. */
double qmat_envelope_distance(const qmat_envelope *envelope, const double point[3], size_t *primitive);

/* F of `count` points, 3 doubles each, on the context's threads; distances[i] is that of point i. QMAT_CANCELLED. */
qmat_status qmat_envelope_distances(qmat_context *context, const qmat_envelope *envelope, const double *points,
                                    size_t count, double *distances);

/* F(point), and in `*bound` an upper bound of F over the convex hull of `count` corners (3 doubles each): the largest
 * distance of a corner to the primitive that attains F(point), since the distance to one primitive is convex. The first
 * distance below `enough` may be taken for F. INFINITY for both when there is no primitive. */
double qmat_envelope_bound(const qmat_envelope *envelope, const double point[3], const double corners[][3], int count,
                           double enough, double *bound);

/* F(point) and the medial sphere (4 doubles: centre, radius) that attains it. The gradient of F is the unit vector from
 * that centre to the point. `primitive` as above. Without primitives `sphere` is unchanged. */
double qmat_envelope_nearest(const qmat_envelope *envelope, const double point[3], size_t *primitive, double sphere[4]);

/* F(point) when it is at most `limit`, else INFINITY. If it is finite, `primitive` (NULL: not wanted) receives that
 * which attains it, `ids` its spheres, UINT32_MAX after the last, and `weights` those of the medial sphere that attains
 * it, 0 after the last. */
double qmat_envelope_foot_within(const qmat_envelope *envelope, const double point[3], double limit, size_t *primitive,
                                 uint32_t ids[3], double weights[3]);

/* F(point) when it is at most `limit`, else INFINITY. Cheaper when only near points matter. */
double qmat_envelope_distance_within(const qmat_envelope *envelope, const double point[3], double limit);

/* Whether F(point) < -depth. The first primitive that contains the point at that depth ends the search. */
bool qmat_envelope_holds(const qmat_envelope *envelope, const double point[3], double depth);

#endif
