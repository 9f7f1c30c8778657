/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_TURNED_PARTS_H
#define QMAT_NODES_MESH_TURNED_PARTS_H

#include "nodes/mesh/parts.h"

/* What a part that faces inwards is. */
typedef enum qmat_facing {
  QMAT_FACING_OUT,    /* it does not */
  QMAT_FACING_TURNED, /* it was given inside out */
  QMAT_FACING_CAVITY  /* the wall of a cavity */
} qmat_facing;

/* Sets facing[i] (zeroed, part_count) to a qmat_facing. A solid part of a volume below 0 faces inwards. It is a cavity
 * where the other solid parts are wound around most of its surface: at points just outside of it, so that what touches
 * it from inside makes no difference. The order of the triangles makes none either. `parts->positions` are in a unit
 * frame. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. Threads: the context's. Cost: n log n, and for each
 * part that faces inwards and each part whose box holds points of it 15 queries of a winding number tree; where these
 * leave a point undecided, the solid angles of all triangles of the other part. */
qmat_status qmat_find_turned_parts(qmat_context *context, const qmat_parts *parts, uint8_t *facing);

#endif
