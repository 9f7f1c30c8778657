/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_EDGE_HALVING_H
#define QMAT_NODES_INITIAL_EDGE_HALVING_H

#include "core/geometry/surface.h"

/* Halves medial edges that leave the solid, and the slabs at these edges, until none does or after eight rounds. Sparse
 * samples give long medial edges, whose cones pass through concave regions of the surface. An edge whose midpoint is
 * inside leaves the solid where its midpoint sphere does so by more than `tolerance`; its new sphere is inscribed. An
 * edge whose midpoint is outside leaves it where its cone does so by more than `most`, beyond which no result is within
 * epsilon; its new sphere is the point of the surface nearest to the midpoint. Both are in the unit frame and > 0.
 * `medial` is in the unit frame and not yet sealed; its new spheres come last. `*added` is their number.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. */
qmat_status qmat_edges_halve(qmat_context *context, const qmat_surface *surface, qmat_medial *medial, double tolerance,
                             double most, size_t *added);

#endif
