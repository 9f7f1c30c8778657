/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_HULL_SPLIT_H
#define QMAT_NODES_COLLIDERS_HULL_SPLIT_H

#include "nodes/colliders/hull_columns.h"
#include "nodes/colliders/part_pieces.h"

/* Finds for each axis the plane between cells whose two hulls have the least volume beyond `other_count` other hulls.
 * Hulls are those of the points that are the farthest along 64 directions. A gain of 0: no plane gains any. `others`
 * has room for another one. QMAT_ERROR_MEMORY. Cost: two hulls of 64 points a plane. */
qmat_status qmat_hull_split_find(const qmat_solid_part *parts, const qmat_hull_pieces *hull,
                                 const qmat_hull_columns **others, size_t other_count, qmat_cell_plane planes[3]);

#endif
