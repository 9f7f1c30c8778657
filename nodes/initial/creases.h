/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_CREASES_H
#define QMAT_NODES_INITIAL_CREASES_H

#include "core/node.h"

/* Sharp convex edges of a surface (section 5, future work). The medial axis reaches a convex crease with radius zero
 * and does not touch a concave one. All arrays live in the context's arena. */

/* Convex sharp edges: sorted pairs of vertices, the smaller id first. */
typedef struct qmat_crease_edges {
  size_t count;
  uint32_t *ends;     /* 2 * count */
  double sharp_share; /* of the surface's bending, the angle times the length of edges, what all sharp edges have */
} qmat_crease_edges;

/* Finds the convex edges of an oriented mesh at which the normals of both triangles differ by more than `angle`
 * (degrees): sharp edges may be concave, too. Connected edges with a total length below `shortest` are left out as
 * noise. `positions` are the mesh's vertices (3 doubles each) in the unit frame, and `shortest` is a length in that
 * frame. Edges at degenerate triangles do not count. QMAT_ERROR_MEMORY. Cost: a sort of the edges. */
qmat_status qmat_crease_edges_find(qmat_context *context, const qmat_mesh *mesh, const double *positions, double angle,
                                   double shortest, qmat_crease_edges *edges);

/* Creases: chains of edges from corner to corner. Creases meet, end, or bend by more than qmat_corner_bend at a corner.
 * Chain i runs through the vertices points[starts[i]] ... points[starts[i + 1] - 1]. A crease without a corner is a
 * loop and repeats its first point at the end. */
typedef struct qmat_creases {
  size_t count;
  size_t *starts; /* count + 1 */
  uint32_t *points;
  uint8_t *is_corner; /* per vertex */
} qmat_creases;

/* In degrees. */
extern const double qmat_corner_bend;

/* Chains distinct edges. `positions` holds `stride` doubles per vertex, `vertex_count` vertices; the first three
 * doubles are the point. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_creases_chain(qmat_context *context, const qmat_crease_edges *edges, const double *positions,
                               size_t stride, size_t vertex_count, qmat_creases *creases);

#endif
