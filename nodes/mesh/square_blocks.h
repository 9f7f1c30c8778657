/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_SQUARE_BLOCKS_H
#define QMAT_NODES_MESH_SQUARE_BLOCKS_H

#include "core/context.h"
#include "nodes/mesh/shells.h"

/* Coordinates this close are one, in diagonals: those of single precision that were moved or rotated. */
#define QMAT_SAME_PLANE 1e-6

/* Blocks that touch should share planes, but rounding leaves gaps and overlaps of a few units in the last place between
 * them, above all where they are rotated. This makes copies of the vertices in which facets that are perpendicular to
 * the axes of their blocks, and nearly in one plane, are in one. `groups` (per triangle; UINT32_MAX: left out) are sets
 * of shells that may meet, named by a triangle of theirs. Those are squared up whose facets are nearly all
 * perpendicular to three axes, which are perpendicular to each other. Sets `positions` of the shells to the copies,
 * `given` to the vertices, and `frames` to the way back; all in the context's arena. Nothing changes where all planes
 * agree already. `moved`: the largest distance between a vertex and its copy. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One
 * thread. Cost: n log n. */
qmat_status qmat_square_blocks(qmat_context *context, const uint32_t *groups, qmat_shells *shells, double *moved);

#endif
