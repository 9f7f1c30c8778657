/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_EDGE_HALVING_H
#define QMAT_NODES_INITIAL_EDGE_HALVING_H

#include "core/geometry/surface.h"

/* Halves the medial edges whose cones leave the solid by more than `tolerance` (unit frame, > 0) at their middles, and
 * the slabs at them, until none does: where samples are far apart, so are the medial vertices, and the spheres that
 * interpolate them pass through concave places of the surface. A middle gets the radius that its depth allows; one that
 * lies outside is left alone. `medial` is in the unit frame and not yet sealed, its new spheres come last. `*added` is
 * their number. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the answer does not depend on their number. */
qmat_status qmat_edges_halve(qmat_context *context, const qmat_surface *surface, qmat_medial *medial, double tolerance,
                             size_t *added);

#endif
