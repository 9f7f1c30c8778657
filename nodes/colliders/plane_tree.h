/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_PLANE_TREE_H
#define QMAT_NODES_COLLIDERS_PLANE_TREE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The planes of the facets of a hull as a tree over the facets: the farthest plane below a point near the hull is found
 * among those of a few facets around. All 0 at first; one thread at a time. */
typedef struct qmat_plane_tree {
  const double *planes;
  size_t count, leaf_count, room;
  double slack;                  /* more than rounding adds to a height */
  struct qmat_plane_node *nodes; /* a tree over `order` (qmat_curve_node_items) */
  struct qmat_curve_item *order; /* the planes along a curve */
} qmat_plane_tree;

/* Makes the tree of `count` planes (4 doubles each: unit normal, offset), below 2^32. `places`: a point of each facet.
 * `planes` has to outlive the tree. A tree may be made again. False: no memory is left. Cost: n log n. */
bool qmat_plane_tree_make(qmat_plane_tree *tree, const double *planes, const double (*places)[3], size_t count);

/* The number of the plane that a point (3 doubles) is the farthest outside of, if by more than `*height`, which becomes
 * that distance; the first of equal ones, as among all planes. SIZE_MAX: there is none. `visited` counts planes looked
 * at; it may be NULL. */
size_t qmat_plane_tree_farthest(const qmat_plane_tree *tree, const double *point, double *height, size_t *visited);

/* Frees the arrays. */
void qmat_plane_tree_uninit(qmat_plane_tree *tree);

#endif
