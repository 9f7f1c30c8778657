/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_TOPOLOGY_SEARCHES_H
#define QMAT_NODES_SIMPLIFY_TOPOLOGY_SEARCHES_H

#include "core/value.h"

/* Searches for loops in medial meshes whose simplices are in canonical order (qmat_medial_set_simplices). */

/* Finds the triples of spheres that have three edges but no triangle, in rising order: the shortest loops, and among
 * them loops that other triangles fill. `*corners`: 3 ids for each of `*count`, in the context's arena.
 * QMAT_ERROR_MEMORY. Cost: edges times edges at a sphere. */
qmat_status qmat_topology_find_empty_triangles(qmat_context *context, const qmat_medial *medial, uint32_t **corners,
                                               size_t *count);

/* Finds the edges that no triangle has and that are on a loop: the components stay when one of them is removed.
 * `*edges`: `*count` numbers of edges, the shortest first, in the context's arena. QMAT_ERROR_MEMORY, QMAT_CANCELLED.
 * Linear but for a sort and for finding the edges of triangles. */
qmat_status qmat_topology_find_loop_edges(qmat_context *context, const qmat_medial *medial, uint32_t **edges,
                                          size_t *count);

#endif
