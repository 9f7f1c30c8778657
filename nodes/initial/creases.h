/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_CREASES_H
#define QMAT_NODES_INITIAL_CREASES_H

#include "core/node.h"

/* Sharp features of a surface (the future work of section 5). The medial sheet of a convex crease reaches it with
 * radius zero; that of a concave one stays away from the surface. All arrays live in the context's arena. */

/* Edges that bend outward: pairs of vertices, the lower one first, sorted. */
typedef struct qmat_crease_edges {
  size_t count;
  uint32_t *ends; /* 2 * count */
} qmat_crease_edges;

/* Finds the edges of an oriented mesh whose two triangles turn away from each other by more than `angle` (degrees), and
 * lie on the convex side. Edges that hang together over less than `shortest` in all are left out: noise. `positions`
 * are the mesh's vertices (3 doubles each) in the unit frame, `shortest` is a length there. Degenerate triangles bend
 * nowhere. QMAT_ERROR_MEMORY. Cost: a sort of the edges. */
qmat_status qmat_crease_edges_find(qmat_context *context, const qmat_mesh *mesh, const double *positions, double angle,
                                   double shortest, qmat_crease_edges *edges);

/* Creases: edges in chains from corner to corner. A corner is where creases meet, end, or bend by more than
 * qmat_corner_bend. Chain i goes along points[starts[i]] ... points[starts[i + 1] - 1], each an index of a vertex; a
 * crease without a corner is a loop whose first point comes again at its end. */
typedef struct qmat_creases {
  size_t count;
  size_t *starts; /* count + 1 */
  uint32_t *points;
  uint8_t *is_corner; /* per vertex */
} qmat_creases;

/* In degrees. */
extern const double qmat_corner_bend;

/* Chains the edges, none of which comes twice. `positions` holds `stride` doubles for each of `vertex_count` vertices,
 * of which the first three are its place. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_creases_chain(qmat_context *context, const qmat_crease_edges *edges, const double *positions,
                               size_t stride, size_t vertex_count, qmat_creases *creases);

#endif
