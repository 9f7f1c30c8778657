/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_FREE_PAIRS_H
#define QMAT_NODES_INITIAL_FREE_PAIRS_H

#include "core/value.h"

/* Thinning of a medial mesh that keeps its topology. A free pair is a triangle and a side of it that no other triangle
 * has, or an edge without triangles and an end of it that no other edge has. Its removal is an elementary collapse: the
 * rest is homotopy equivalent. */

/* Removes free pairs whose triangle or edge has a measure below `threshold`, the smallest measure first, a smaller id
 * first where measures are equal, until none is left. Of several free sides the one with the smallest measure goes.
 * `edge_measures` and `triangle_measures` have one number per edge and triangle of the unsealed `medial`, INFINITY for
 * one that stays. Spheres, edges and triangles that were removed leave the medial mesh, and with spheres their
 * responsible regions and skin; the rest keeps its order. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: O(n log
 * n). */
qmat_status qmat_free_pairs_remove(qmat_context *context, qmat_medial *medial, const double *edge_measures,
                                   const double *triangle_measures, double threshold);

#endif
