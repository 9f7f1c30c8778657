/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_EDGE_HALVING_H
#define QMAT_NODES_INITIAL_EDGE_HALVING_H

#include "core/geometry/surface.h"

/* Halves medial edges whose midpoint spheres leave the solid by more than `tolerance` (unit frame, > 0), and the slabs
 * at these edges, until none does or after eight rounds. Sparse samples give long medial edges, whose interpolated
 * spheres pass through concave regions of the surface. A new sphere is inscribed; midpoints outside the solid are
 * skipped. `medial` is in the unit frame and not yet sealed; its new spheres come last. `*added` is their number.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. */
qmat_status qmat_edges_halve(qmat_context *context, const qmat_surface *surface, qmat_medial *medial, double tolerance,
                             size_t *added);

#endif
