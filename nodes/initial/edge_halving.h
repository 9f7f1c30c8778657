/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_EDGE_HALVING_H
#define QMAT_NODES_INITIAL_EDGE_HALVING_H

#include "core/geometry/surface.h"

/* Halves medial edges whose midpoint spheres leave the solid, and the slabs at these edges, until none does or after
 * eight rounds. Sparse samples give long medial edges, whose interpolated spheres pass through concave regions of the
 * surface. A midpoint sphere leaves the solid by its radius less the depth of its centre: by more than `tolerance`
 * where the centre is inside, or by more than `most` where it is outside, across a concave edge or a narrow gap. Both
 * are > 0 and in the unit frame. The new sphere is inscribed; for a midpoint outside it is the nearest point of the
 * surface. `medial` is in the unit frame and not yet sealed; its new spheres come last. `*added` is their number.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. */
qmat_status qmat_edges_halve(qmat_context *context, const qmat_surface *surface, qmat_medial *medial, double tolerance,
                             double most, size_t *added);

#endif
