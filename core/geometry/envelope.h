/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_ENVELOPE_H
#define QMAT_CORE_GEOMETRY_ENVELOPE_H

#include <stddef.h>
#include <stdint.h>

#include "core/value.h"

/* The enveloping volume of a medial mesh, made ready for distance questions: its slabs, the cones that are a side of no
 * slab, and the spheres that are an end of no cone or slab. F(p) is the minimum over all of them of the signed distance
 * (core/geometry/medial_distance.h; eq. 9 with a signed minimum): outside exactly the distance to the volume, inside
 * negative and no deeper than the true depth. F is 1-Lipschitz. After qmat_envelope_new it is only read: any number of
 * threads may ask at once, and the answer to a question does not depend on what was asked before. */
typedef struct qmat_envelope qmat_envelope;

/* Builds the search structure. `spheres` holds 4 * sphere_count doubles (x y z radius; radius >= 0), `edges`
 * 2 * edge_count ids, `triangles` 3 * triangle_count ids, in any order; an array of count 0 may be NULL. Edges that are
 * a side of a triangle may be given or left out. Nothing is kept of the arguments. `*envelope` is freed with
 * qmat_envelope_free; on failure it is NULL: QMAT_ERROR_MEMORY, or QMAT_ERROR_GEOMETRY for an id out of range. No
 * primitive at all is allowed. Cost: O(n log n), one thread; about 450 bytes a triangle. */
qmat_status qmat_envelope_new(qmat_context *context, const double *spheres, size_t sphere_count, const uint32_t *edges,
                              size_t edge_count, const uint32_t *triangles, size_t triangle_count,
                              qmat_envelope **envelope);

/* The same for the arrays of a medial mesh, in its own units. */
qmat_status qmat_envelope_of_medial(qmat_context *context, const qmat_medial *medial, qmat_envelope **envelope);

/* NULL is allowed. */
void qmat_envelope_free(qmat_envelope *envelope);

/* The number of primitives. First come the triangles in the order given, then the edges on no triangle in theirs, then
 * the spheres on neither. */
size_t qmat_envelope_primitive_count(const qmat_envelope *envelope);

/* Writes the sphere ids of a primitive into ids[0..2] and returns how many there are: 3 slab, 2 cone, 1 sphere. */
int qmat_envelope_primitive(const qmat_envelope *envelope, size_t primitive, uint32_t ids[3]);

/* F(point), `point` 3 doubles; INFINITY when there is no primitive. `primitive` (may be NULL) gets the primitive that
 * attains it. Cost: O(log n) for a point near the surface of a mesh without much overlap. */
double qmat_envelope_distance(const qmat_envelope *envelope, const double point[3], size_t *primitive);

/* F(point), and the medial sphere (4 doubles: centre, radius) that attains it; the gradient of F is the unit vector
 * from its centre to the point. `primitive` as above. With no primitive the sphere is left alone. */
double qmat_envelope_nearest(const qmat_envelope *envelope, const double point[3], size_t *primitive, double sphere[4]);

/* F(point) when it is at most `limit`, else INFINITY: cheaper where only near points matter. */
double qmat_envelope_distance_within(const qmat_envelope *envelope, const double point[3], double limit);

/* Whether F(point) < -depth: the first primitive that holds the point so deep ends the search. */
bool qmat_envelope_holds(const qmat_envelope *envelope, const double point[3], double depth);

#endif
