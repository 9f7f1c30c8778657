/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_TOPOLOGY_H
#define QMAT_NODES_MEASURE_TOPOLOGY_H

#include <stdbool.h>

#include "core/geometry/surface.h"

/* The Betti numbers over Z/2, and what they give: euler = components - loops + voids. */
typedef struct qmat_topology {
  bool known; /* else only those members hold that the function names */
  size_t components, loops, voids;
  int64_t euler;
} qmat_topology;

/* Of a sealed medial mesh as a simplicial complex: vertices, edges and triangles. Components and euler always hold.
 * Triangles at free edges are removed first, those at an edge of two are taken together, and what is left is reduced as
 * a sparse matrix; not known when that takes too long, which no medial mesh of a solid has been seen to do. Linear but
 * for that. QMAT_ERROR_MEMORY. */
qmat_status qmat_topology_of_medial(qmat_context *context, const qmat_medial *medial, qmat_topology *topology);

/* The triangles that are left when those at free edges are removed, again and again: the walls of voids, and what only
 * leads from one to another. `*walls`: `*count` triangles in their order, in the context's arena. QMAT_ERROR_MEMORY.
 * Linear but for finding edges. */
qmat_status qmat_topology_find_walls(qmat_context *context, const qmat_medial *medial, uint32_t **walls, size_t *count);

/* The triples of spheres whose three edges are there and their triangle is not, in rising order: the shortest loops,
 * those among them that other triangles fill included. `*corners`: 3 ids for each of `*count`, in the context's arena.
 * QMAT_ERROR_MEMORY. Cost: edges times edges at a sphere. */
qmat_status qmat_topology_find_empty_triangles(qmat_context *context, const qmat_medial *medial, uint32_t **corners,
                                               size_t *count);

/* Of the solid within a closed and oriented surface: outward shells bound its components, inward ones its voids, and
 * the genus of either counts its loops. Shells that do not separate inside from outside (swallowed by another, or
 * without volume) are left out; shells that cross count as apart. Nothing is known of an open surface, nor of one with
 * an edge of more than two triangles. Linear but for a sort of each vertex's edges. QMAT_ERROR_MEMORY. */
qmat_status qmat_topology_of_solid(qmat_context *context, const qmat_surface *surface, qmat_topology *topology);

#endif
