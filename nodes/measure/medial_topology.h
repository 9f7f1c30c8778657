/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_MEDIAL_TOPOLOGY_H
#define QMAT_NODES_MEASURE_MEDIAL_TOPOLOGY_H

#include "core/value.h"

/* The Betti numbers over Z/2; euler = components - loops + voids. */
typedef struct qmat_topology {
  bool known; /* else only the members that the function names are valid */
  size_t components, loops, voids;
  int64_t euler;
  const char *why_not; /* of a solid that is not known: why, a constant; else NULL */
} qmat_topology;

/* The medial meshes below need not be sealed. Their edges and triangles are those of qmat_medial_set_simplices: ids
 * rise in each row, the rows rise, and every side of a triangle is one of the edges. */

/* Computes the topology of a medial mesh as a simplicial complex. `components` and `euler` are always valid. For
 * `voids`, triangles at free edges are removed, triangles joined by edges of two are taken as one sheet, and the rank
 * of the remaining sparse matrix is found. `known` is false when that takes too long, which no medial mesh of a solid
 * has done so far. Linear but for the rank and for finding edges. QMAT_ERROR_MEMORY, QMAT_CANCELLED. */
qmat_status qmat_topology_of_medial(qmat_context *context, const qmat_medial *medial, qmat_topology *topology);

/* Finds the triangles that remain when triangles at free edges are removed, again and again: the walls of voids, and
 * sheets that join one void to another. `*walls`: `*count` triangles in rising order, in the context's arena.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. Linear but for finding edges. */
qmat_status qmat_topology_find_walls(qmat_context *context, const qmat_medial *medial, uint32_t **walls, size_t *count);

#endif
