/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_OPPOSITE_PAIRS_H
#define QMAT_NODES_MESH_OPPOSITE_PAIRS_H

#include "core/context.h"

/* Finds pairs of triangles with the same corners and opposite sides: a card of two sides, or a wall between two solids
 * that touch. They cancel in every winding number. `triangles`: 3 * count; `classes` (count, zeroed) becomes 1 for the
 * first of a pair and 2 for the second. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: n log n. */
qmat_status qmat_find_opposite_pairs(qmat_context *context, size_t vertex_count, size_t count,
                                     const uint32_t *triangles, uint8_t *classes);

/* Counts the sets of triangles that are connected at vertices. `triangles`: 3 * count ids below `vertex_count`; NULL if
 * there are none. QMAT_ERROR_MEMORY. One thread. Cost: nearly linear. */
qmat_status qmat_count_connected(qmat_context *context, size_t vertex_count, size_t count, const uint32_t *triangles,
                                 size_t *sets);

#endif
