/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_HIDDEN_PARTS_H
#define QMAT_NODES_MESH_HIDDEN_PARTS_H

#include "nodes/mesh/parts.h"

/* Parts inside others. */
typedef struct qmat_hidden_parts {
  size_t parts, triangles; /* solid parts that lie inside others, and how many triangles were given of them */
  size_t in_room;          /* of these parts: those in the bounding box of the largest part that was turned */
} qmat_hidden_parts;

/* Counts the solid parts of which a union leaves nothing. `facing`: per part, of qmat_find_turned_parts. `part_of` and
 * `fates` (a qmat_fate): per triangle of `count` that were united. QMAT_ERROR_MEMORY. One thread. Cost: linear. */
qmat_status qmat_count_hidden_parts(qmat_context *context, const qmat_parts *parts, const uint8_t *facing, size_t count,
                                    const uint32_t *part_of, const uint8_t *fates, qmat_hidden_parts *hidden);

#endif
