/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_HULL_EXCHANGE_H
#define QMAT_NODES_COLLIDERS_HULL_EXCHANGE_H

#include "core/geometry/surface.h"
#include "nodes/colliders/part_pieces.h"

/* Lowers the volume of a union of `count` hulls, each around its pieces of `parts`; their number stays. A step divides
 * the hull that gains most, by a plane, and joins the two whose joint hull adds least, of those where the facets
 * between both leave the solid by at most twice `limit` (in the unit frame; see qmat_joint_protrusion). It is taken
 * back where the union does not get smaller. Volumes are those of coarse hulls: some points of each cell, and 65,536
 * lines through them.
 *
 * The pieces are replaced; the new ones are owned as those before. There are at most `count` steps.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED: the pieces are then as they were. All threads; the result does not depend on their
 * number. */
qmat_status qmat_hulls_exchange(qmat_context *context, const qmat_surface *solid, double limit,
                                const qmat_solid_part *parts, qmat_hull_pieces *hulls, size_t count);

#endif
