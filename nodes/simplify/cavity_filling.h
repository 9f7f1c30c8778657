/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_CAVITY_FILLING_H
#define QMAT_NODES_SIMPLIFY_CAVITY_FILLING_H

#include "core/geometry/surface.h"

/* Adds medial spheres to an unsealed medial mesh in the unit frame so that places inside the solid that its envelope
 * leaves out lie in the envelope: one at each place that no added sphere holds yet, the deepest places first, about as
 * large as `epsilon` beyond the surface allows, joined to the nearest sphere by a medial cone that keeps within
 * epsilon. Components and loops stay as they are. The new spheres come behind the others and answer for no samples.
 * `places`: 3 * count, unit frame, inside the solid; those that no such sphere fits are left. `*added`: how many
 * spheres, 0 after a failure. QMAT_ERROR_MEMORY, which leaves the medial mesh as it was. One thread. Cost: places by
 * spheres, and for each place up to 32 bounds of how far a cone protrudes. */
qmat_status qmat_cavities_fill(qmat_context *context, const qmat_surface *surface, const double *places, size_t count,
                               double epsilon, qmat_medial *medial, size_t *added);

#endif
