/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_HULL_OUTSIDE_H
#define QMAT_NODES_COLLIDERS_HULL_OUTSIDE_H

#include "core/context.h"
#include "core/geometry/surface.h"
#include "core/value_types.h"

/* How far the facets between two hulls leave a solid. `triangles` (3 ids of points each) are those of the hull of both.
 * The points below `first` are of the one hull, the others of the other; a facet between the hulls has points of both.
 * `points` (3 doubles each) are in the unit frame. A triangle is halved `halvings` times at most. The result is a
 * distance that is found. The largest one is below half of `limit`, or at most that half above the result, unless the
 * halvings do not suffice. The search ends where a distance exceeds the limit. Cost: distances to the surface, at most
 * some per square of half the limit. Safe from any thread. */
double qmat_joint_protrusion(const qmat_surface *solid, const double *points, size_t first, const uint32_t *triangles,
                             size_t triangle_count, double limit, int halvings);

/* The bound of qmat_hulls_protrusion is so much above a distance that is found, at most. */
static const double qmat_protrusion_slack = 1e-4;

/* Bounds how far the farthest point of any hull is outside of the solid, in the unit frame. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. All threads; the result does not depend on their number. Cost: distances to the surface, about ten
 * per facet, and more where facets are as far outside as the farthest point. */
qmat_status qmat_hulls_protrusion(qmat_context *context, const qmat_surface *solid, const qmat_colliders *colliders,
                                  double *bound);

#endif
