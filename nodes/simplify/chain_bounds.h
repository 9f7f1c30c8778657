/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_CHAIN_BOUNDS_H
#define QMAT_NODES_SIMPLIFY_CHAIN_BOUNDS_H

#include "core/geometry/surface.h"
#include "core/value.h"

/* Sets bounded_count, bounded and bounds of a chain whose other fields are set: proved upper bounds of both errors at
 * its levels of at most `most` spheres, as medial.evaluate defines surface_to_envelope and envelope_to_surface. Up to
 * QMAT_BOUNDED_EACH spheres each level has them, above four in each doubling. The first level whose recorded error is
 * at most `finest` (> 0, in diagonals) is the finest with bounds: more spheres gain nothing that the chain records, and
 * their many primitives near the surface take the longest. `deviation` is added to each bound. The tolerance of both
 * searches (hausdorff_bound.h, boundary_distance.h) is a twentieth of the level's recorded error, or of `finest`.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the
 * result does not depend on their number. Cost: a level takes as long as medial.evaluate without its samples. */
enum { QMAT_BOUNDED_EACH = 32 };
qmat_status qmat_chain_set_bounds(qmat_context *context, const qmat_surface *surface, size_t most, double finest,
                                  double deviation, qmat_chain *chain);

#endif
