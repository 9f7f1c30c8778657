/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_TOPOLOGY_H
#define QMAT_NODES_MEASURE_TOPOLOGY_H

#include <stdbool.h>

#include "core/geometry/surface.h"

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
 * has done so far. Linear but for the rank. QMAT_ERROR_MEMORY. */
qmat_status qmat_topology_of_medial(qmat_context *context, const qmat_medial *medial, qmat_topology *topology);

/* Finds the triangles that remain when triangles at free edges are removed, again and again: the walls of voids, and
 * sheets that join one void to another. `*walls`: `*count` triangles in rising order, in the context's arena.
 * QMAT_ERROR_MEMORY. Linear but for finding edges. */
qmat_status qmat_topology_find_walls(qmat_context *context, const qmat_medial *medial, uint32_t **walls, size_t *count);

/* Finds the triples of spheres that have three edges but no triangle, in rising order: the shortest loops, and among
 * them loops that other triangles fill. `*corners`: 3 ids for each of `*count`, in the context's arena.
 * QMAT_ERROR_MEMORY. Cost: edges times edges at a sphere. */
qmat_status qmat_topology_find_empty_triangles(qmat_context *context, const qmat_medial *medial, uint32_t **corners,
                                               size_t *count);

/* Finds the edges that no triangle has and that are on a loop: the components stay when one of them is removed.
 * `*edges`: `*count` numbers of edges, the shortest first, in the context's arena. QMAT_ERROR_MEMORY. Linear but for a
 * sort and for finding the edges of triangles. */
qmat_status qmat_topology_find_loop_edges(qmat_context *context, const qmat_medial *medial, uint32_t **edges,
                                          size_t *count);

/* Computes the topology of the solid within a closed and oriented surface. Outward shells bound its components, inward
 * shells its voids, and the genus of either counts its loops. Shells that do not separate inside from outside
 * (contained in another, or without volume) are left out; shells that cross count separately. Not known for an open
 * surface, or with an edge of more than two triangles. Sheets count as simplicial complexes of their own, whatever they
 * touch; where all sheets are closed, those without volume count as the thin solids that they bound, which have no
 * void. Linear but for a sort of each vertex's edges. QMAT_ERROR_MEMORY. */
qmat_status qmat_topology_of_solid(qmat_context *context, const qmat_surface *surface, qmat_topology *topology);

#endif
