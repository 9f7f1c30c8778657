/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_BORDER_SPLIT_H
#define QMAT_NODES_MESH_BORDER_SPLIT_H

#include "core/context.h"

/* A vertex on an edge between others, as in a T-junction. */
typedef struct qmat_edge_split {
  uint32_t half_edge; /* the edge's only one: 3 * triangle + number of its side */
  uint32_t vertex;
  double share;    /* its place along the half-edge: above 0, below 1 */
  double distance; /* from the edge */
} qmat_edge_split;

/* Finds the vertices of border edges (edges of one triangle) that lie on other border edges, at most `tolerance` away
 * and farther from the ends. `positions` (3 * vertex_count, finite), `triangles` (3 * triangle_count). `splits` is in
 * the context's arena, by half-edge, then share. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. One thread.
 * Cost: n log^2 n, and a test of each border vertex in the bounding box of a border edge. */
qmat_status qmat_find_edge_splits(qmat_context *context, size_t vertex_count, const double *positions,
                                  size_t triangle_count, const uint32_t *triangles, double tolerance,
                                  qmat_edge_split **splits, size_t *count);

/* Triangles that are split at vertices on their edges. */
typedef struct qmat_split_triangles {
  size_t count;
  uint32_t *triangles; /* 3 * count, in the order of those that they are made of; in the context's arena */
  size_t *first;       /* per given triangle: the first of its own; then `count` */
} qmat_split_triangles;

/* Splits triangles into ones that run along all vertices on their edges; no vertex moves. `splits` as of
 * qmat_find_edge_splits. QMAT_ERROR_MEMORY. One thread. Cost: linear. */
qmat_status qmat_split_edges(qmat_context *context, size_t triangle_count, const uint32_t *triangles,
                             const qmat_edge_split *splits, size_t count, qmat_split_triangles *made);

#endif
