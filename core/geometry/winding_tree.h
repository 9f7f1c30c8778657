/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_WINDING_TREE_H
#define QMAT_CORE_GEOMETRY_WINDING_TREE_H

#include "core/context.h"

/* Generalised winding numbers of triangles in the time of a tree's depth: groups of triangles that are far away count
 * as dipoles. Read-only once made; any number of threads may ask it. Source: Barill et al. 2018, Fast winding numbers
 * for soups and clouds, section 3. */
typedef struct qmat_winding_tree qmat_winding_tree;

/* Makes the tree of `count` triangles, at least one. `triangles`: three numbers each, of points of `positions` (3
 * doubles each) in a unit frame. `chosen`: the numbers of these triangles in `triangles`, or NULL for the first
 * `count`; copied. `positions` and `triangles` must outlive the tree. The caller frees `*tree`, which is NULL on
 * failure. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Threads: the context's; their number does not change the tree. Cost:
 * n log n. */
qmat_status qmat_winding_tree_new(qmat_context *context, const double *positions, const uint32_t *triangles,
                                  const uint32_t *chosen, size_t count, qmat_winding_tree **tree);

/* NULL is allowed. */
void qmat_winding_tree_free(qmat_winding_tree *tree);

/* The winding number at a point (3 doubles), about 1 inside of a closed surface that faces outwards. It errs by a few
 * hundredths. From any thread. */
double qmat_winding_tree_number(const qmat_winding_tree *tree, const double point[3]);

#endif
