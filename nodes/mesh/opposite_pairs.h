/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_OPPOSITE_PAIRS_H
#define QMAT_NODES_MESH_OPPOSITE_PAIRS_H

#include "core/context.h"

/* Finds pairs of triangles with the same corners and opposite sides: a card of two sides, or a wall between two solids
 * that touch. They cancel in every winding number. `triangles`: 3 * count; `classes` (count, zeroed) becomes 1 for the
 * first of a pair and 2 for the second. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: n log n. */
qmat_status qmat_find_opposite_pairs(qmat_context *context, size_t vertex_count, size_t count,
                                     const uint32_t *triangles, uint8_t *classes);

typedef struct qmat_pair_split {
  size_t merged;           /* pairs of opposite triangles */
  size_t two_sided_solids; /* closed surfaces of such pairs */
  size_t plain_count, pair_count;
} qmat_pair_split;

/* Sets apart the triangles that are given with both sides. `pairs` (3 * count) gets the first triangle of each pair,
 * `plain` (3 * count) the others in the given order, then closed surfaces of pairs: sets that are connected across
 * edges, each of which has two pairs. Such a set is a solid that was exported with both sides, if it encloses
 * something. Its triangles are turned to agree with their neighbours, as most of the set were given. It is no solid
 * where plain triangles are wound around it: there it is a wall between a solid and what fills its cavity.
 * `positions`: 3 * vertex_count; `triangles`: 3 * count. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: n log n,
 * and a box test of each plain triangle for each closed surface. */
qmat_status qmat_split_pairs(qmat_context *context, size_t vertex_count, const double *positions, size_t count,
                             const uint32_t *triangles, uint32_t *plain, uint32_t *pairs, qmat_pair_split *split);

#endif
