/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_DISTANCE_H
#define QMAT_NODES_SKIN_SKIN_DISTANCE_H

#include "core/context.h"
#include "core/value_types.h"
#include "nodes/skin/skin_triangles.h"

/* How far a surface and the envelope that it stands for are apart, in the unit of the positions. */
typedef struct qmat_skin_distance {
  double to_envelope;   /* an upper bound of F over the surface */
  double from_envelope; /* an upper bound of the distance from the envelope's boundary to the surface */
  size_t far_count, far_capacity;
  double *far_points; /* 3 each: places where a distance exceeds the threshold, or may do so */
} qmat_skin_distance;

/* Measures both by branch and bound, as medial.evaluate does. `medial` has the spheres of the envelope in the frame of
 * the surface, which is closed and oriented; spheres of radius 0 without an edge do not count. The bounds exceed the
 * distances by about a tenth of `threshold` (above 0), or of the distances where those are larger. Free `distance` with
 * qmat_skin_distance_uninit, also after a failure. QMAT_ERROR_MEMORY, QMAT_CANCELLED, QMAT_ERROR_GEOMETRY for a surface
 * without extent. All threads; the same answer for any number of them. Cost: some 10 microseconds a triangle. */
qmat_status qmat_skin_distance_measure(qmat_context *context, const qmat_medial *medial,
                                       const qmat_skin_triangles *surface, double threshold,
                                       qmat_skin_distance *distance);
void qmat_skin_distance_uninit(qmat_skin_distance *distance);

#endif
