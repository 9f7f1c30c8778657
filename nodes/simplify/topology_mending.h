/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_TOPOLOGY_MENDING_H
#define QMAT_NODES_SIMPLIFY_TOPOLOGY_MENDING_H

#include "nodes/simplify/simplification_state.h"

/* Opens voids of a result within epsilon until it has no more than the solid, whose topology is known, a void at a
 * time: removes the first wall without which both errors stay within epsilon. Where no wall can be spared, part of one
 * is: a new sphere divides it, unless it is part of a sheet. Without a slab the envelope leaves the solid by no more,
 * but the surface may be farther from it. `vertices` spheres are not exceeded. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost:
 * measures both errors up to 60 times a void. */
qmat_status qmat_simplification_open_voids(const qmat_simplification *simplification, qmat_simplified *result);

/* Closes loops of a result within epsilon while it has more than the solid, whose topology is known: fills the first
 * three edges without a slab that form such a loop, of QMAT_MOST_WALLS whose slab leaves the solid by at most epsilon.
 * A further slab brings the surface no farther from the envelope; one that closes no loop would make a void, and is
 * left out. Else an edge without a slab that is part of a loop is removed, or part of it, as with walls.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: measures both errors up to 120 times a loop. */
qmat_status qmat_simplification_close_loops(const qmat_simplification *simplification, qmat_simplified *result);

#endif
