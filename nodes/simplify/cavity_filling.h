/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_CAVITY_FILLING_H
#define QMAT_NODES_SIMPLIFY_CAVITY_FILLING_H

#include "core/geometry/surface.h"

/* Adds medial spheres to an unsealed medial mesh (unit frame) so that its envelope covers uncovered points inside the
 * solid. Each point that no added sphere covers yet gets a sphere, the deepest first. The sphere is about as large as
 * `epsilon` allows and is joined to the nearest sphere by a medial cone within epsilon. Components and loops do not
 * change. The new spheres come last and have no samples. `places`: 3 * count, unit frame, inside the solid; points that
 * no such sphere fits are skipped. `*added`: the number of spheres, 0 after a failure. QMAT_ERROR_MEMORY and
 * QMAT_CANCELLED leave the medial mesh unchanged. One thread. Cost: points times spheres, and up to 32 bounds of a cone
 * for each point. */
qmat_status qmat_cavities_fill(qmat_context *context, const qmat_surface *surface, const double *places, size_t count,
                               double epsilon, qmat_medial *medial, size_t *added);

#endif
