/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MEDIAL_COMPLEX_H
#define QMAT_CORE_GEOMETRY_MEDIAL_COMPLEX_H

#include "core/geometry/medial_build.h"

/* Lists of ids, one per row, that grow within one pool. */
typedef struct qmat_rows {
  uint32_t *items;
  size_t used, capacity;
  size_t *starts;           /* per row */
  uint32_t *counts, *rooms; /* per row: its items, and the items that fit in place */
} qmat_rows;

/* A medial mesh that edge collapses can change: a simplicial complex of vertices, edges and triangles, in general not a
 * manifold. Ids never change; removed simplices are marked as dead. The caller chooses the frame of the spheres. */
typedef struct qmat_complex {
  size_t vertex_count, edge_count, triangle_count; /* all ids, of live and dead simplices */
  size_t live_vertices, live_edges, live_triangles;
  double *spheres;          /* 4 per vertex */
  uint32_t *edges;          /* 2 per edge */
  uint32_t *edge_triangles; /* per edge: the number of its live triangles */
  uint32_t *triangles;      /* 3 per triangle */
  uint32_t *triangle_edges; /* 3 per triangle: the edge opposite corner k */
  uint8_t *vertex_alive, *edge_alive, *triangle_alive;
  qmat_rows vertex_edges, vertex_triangles; /* the live edges and triangles at each vertex */
  /* Scratch of qmat_complex_preview. */
  uint32_t *mark_of_vertex, *edge_to_vertex; /* per vertex */
  uint32_t *mark_of_edge, *triangle_at_edge; /* per edge */
  uint32_t stamp;
  /* Scratch of qmat_collapse_keeps_homotopy, per vertex. */
  uint32_t *part_of_vertex;
  uint8_t *part_has_apex;
} qmat_complex;

/* The star of the merged vertex after the collapse of an edge: vertex `kept` stays, `removed` goes. For a vertex that
 * only moves, it is the present star, and `edge` and `removed` are QMAT_NONE. */
typedef struct qmat_collapse {
  uint32_t edge, kept, removed;
  size_t neighbour_count, neighbour_capacity;
  uint32_t *neighbours;    /* the vertices of the link */
  uint32_t *kept_edges;    /* per neighbour: its edge to `kept`, or QMAT_NONE */
  uint32_t *removed_edges; /* per neighbour: its edge to `removed`, or QMAT_NONE */
  size_t triangle_count, triangle_capacity;
  uint32_t *triangle_pairs;    /* 2 per new triangle: its corners other than the merged vertex */
  uint32_t *kept_triangles;    /* per new triangle: the present triangle at `kept`, or QMAT_NONE */
  uint32_t *removed_triangles; /* per new triangle: the present triangle at `removed`, or QMAT_NONE */
  size_t vanishing_count, vanishing_capacity;
  uint32_t *vanishing; /* triangles on the collapsed edge, which become edges */
} qmat_collapse;

/* Makes a complex from a medial mesh. `spheres` (4 * sphere_count doubles) replaces the mesh's spheres; NULL keeps
 * them. Free with qmat_complex_uninit, also after a failure. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_complex_init(qmat_context *context, qmat_complex *complex, const qmat_medial *medial,
                              const double *spheres);
void qmat_complex_uninit(qmat_complex *complex);

/* Computes the result of collapsing a live edge without changing the complex. The arrays of `collapse` grow as needed
 * and are reused: zero it before the first use and free it with qmat_collapse_uninit. QMAT_ERROR_MEMORY. Cost: linear
 * in both stars. */
qmat_status qmat_complex_preview(qmat_context *context, qmat_complex *complex, uint32_t edge, qmat_collapse *collapse);
void qmat_collapse_uninit(qmat_collapse *collapse);

/* The same for moving a vertex, which changes no simplex: its present star. */
qmat_status qmat_complex_preview_move(qmat_context *context, qmat_complex *complex, uint32_t vertex,
                                      qmat_collapse *collapse);

/* Whether the newest preview of an edge keeps the homotopy type of the complex. Contracting the edge identifies what
 * the links of both ends share. That is the same as adding what the edge spans with it, and contracting the edge under
 * the link condition (Dey et al. 1999). The addition keeps the homotopy type if every connected part of what is shared
 * is a tree with one vertex of the edge's own link. Cost: linear in the star. */
bool qmat_collapse_keeps_homotopy(qmat_complex *complex, const qmat_collapse *collapse);

/* Performs the newest preview; `sphere` (4 doubles) is the merged sphere. Where both vertices had an edge to the same
 * neighbour, the edge of `kept` survives. */
qmat_status qmat_complex_collapse(qmat_context *context, qmat_complex *complex, const qmat_collapse *collapse,
                                  const double sphere[4]);

/* The edge between two live vertices, or QMAT_NONE. Cost: linear in the smaller star. */
uint32_t qmat_complex_find_edge(const qmat_complex *complex, uint32_t a, uint32_t b);

/* The triangle of three live vertices, or QMAT_NONE. Cost: linear in the star of `a`. */
uint32_t qmat_complex_find_triangle(const qmat_complex *complex, uint32_t a, uint32_t b, uint32_t c);

/* The live edges, or triangles, at a vertex, and their number. */
static inline const uint32_t *qmat_complex_edges_at(const qmat_complex *complex, uint32_t vertex, size_t *count) {
  *count = complex->vertex_edges.counts[vertex];
  return complex->vertex_edges.items + complex->vertex_edges.starts[vertex];
}
static inline const uint32_t *qmat_complex_triangles_at(const qmat_complex *complex, uint32_t vertex, size_t *count) {
  *count = complex->vertex_triangles.counts[vertex];
  return complex->vertex_triangles.items + complex->vertex_triangles.starts[vertex];
}

/* The other end of an edge. */
static inline uint32_t qmat_complex_other_end(const qmat_complex *complex, uint32_t edge, uint32_t vertex) {
  const uint32_t *ends = &complex->edges[2 * (size_t)edge];
  return ends[0] == vertex ? ends[1] : ends[0];
}

#endif
