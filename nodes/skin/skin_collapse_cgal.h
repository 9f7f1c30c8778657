/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_SKIN_COLLAPSE_CGAL_H
#define QMAT_NODES_SKIN_SKIN_COLLAPSE_CGAL_H

#include <stdbool.h>

#include "core/status.h"
#include "nodes/skin/skin_triangles.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The triangles around an edge, and those that are left of them when the edge is a vertex. */
typedef struct qmat_skin_star {
  size_t removed_count, kept_count;
  const uint32_t *faces; /* removed_count + kept_count ids: those that vanish, then the others */
  const double *before;  /* 9 * kept_count: corners of the others */
  const double *after;   /* 9 * kept_count: the same with the new vertex, which is corner 0 */
} qmat_skin_star;

/* Who decides on collapses. */
typedef struct qmat_skin_judge {
  void *user;
  /* Whether an edge may collapse; if so, it does at once. */
  bool (*accepts)(void *user, const qmat_skin_star *star);
  /* After each collapse: the new ids of the faces that were kept, in the order of the star. */
  void (*collapsed)(void *user, const uint32_t *faces);
  /* Asked before each edge; false ends all with QMAT_CANCELLED. */
  bool (*goes_on)(void *user);
} qmat_skin_judge;

/* Flips the longest sides of slivers (QMAT_SKIN_SLIVER) of a closed, oriented 2-manifold, which stays one, of the same
 * topology. A sliver stays where a face would turn over or be as flat as before. The surface is replaced by the
 * result. QMAT_ERROR_MEMORY, QMAT_ERROR_GEOMETRY for a surface that is no such manifold; the surface is then unchanged.
 * Deterministic, one thread. */
qmat_status qmat_skin_flip_slivers(qmat_skin_triangles *surface);

/* Collapses edges of a closed, oriented 2-manifold, cheapest first by the cost of Lindstrom and Turk, while more than
 * `most` triangles are left and the judge accepts; it stays one of the same topology. Face ids of the judge are rows of
 * `surface` at first. The surface is replaced by the result. QMAT_ERROR_MEMORY, QMAT_CANCELLED, QMAT_ERROR_GEOMETRY for
 * a surface that is no such manifold; the surface is then unchanged. Deterministic, one thread. */
qmat_status qmat_skin_collapse(qmat_skin_triangles *surface, size_t most, const qmat_skin_judge *judge);

#ifdef __cplusplus
}
#endif

#endif
