/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_EXTREME_POINTS_H
#define QMAT_NODES_COLLIDERS_EXTREME_POINTS_H

#include "core/context.h"

/* Keeps of `*count` points (3 doubles each) some whose convex hull has all others within `tolerance`, a length above 0,
 * and counts them. They come in another order. The hull grows by the points that are farthest outside of its facets
 * (Barber et al. 1996), and points inside are dropped on the way. So points in the middle of a flat side go, which a
 * hull by exact arithmetic keeps. All stay where they are nearer to a plane than the tolerance, or fewer than 65.
 * QMAT_OK or QMAT_ERROR_MEMORY. Cost: a hull of the points kept so far per round, and the points left times its facets.
 */
qmat_status qmat_extreme_points_keep(double *points, size_t *count, double tolerance);

#endif
