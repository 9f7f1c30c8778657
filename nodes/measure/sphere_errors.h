/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_SPHERE_ERRORS_H
#define QMAT_NODES_MEASURE_SPHERE_ERRORS_H

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"

/* Bounds for each sphere the distance to the envelope of the part of the surface that the sphere answers for. The
 * surface is divided into pieces of facets. The sphere that answers for a piece is, of the primitive that is nearest to
 * the piece's centre, the one nearest to the medial point there. `errors` has an element for each of the `sphere_count`
 * `spheres` that `envelope` was made of: a bound of max(0, F) over its pieces, 0 where it has none; unit frame. `most`
 * is a bound of F over the whole surface, or INFINITY. Each is at most that and at most the largest F of its pieces
 * plus `tolerance` (1e-6 at least), so that the largest is a bound of F over the whole surface. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. All threads; the same numbers for any number of them. Memory: 16 bytes a sphere. */
qmat_status qmat_sphere_errors_measure(qmat_context *context, const qmat_surface *surface,
                                       const qmat_envelope *envelope, const double *spheres, size_t sphere_count,
                                       double most, double tolerance, double *errors);

#endif
