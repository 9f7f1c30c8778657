/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_UNION_CGAL_H
#define QMAT_NODES_MESH_UNION_CGAL_H

#include "core/context.h"
#include "nodes/mesh/shells.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What became of a triangle. */
typedef enum qmat_fate {
  QMAT_FATE_SHARED, /* others of its plane overlap it: what is left is not counted as its own */
  QMAT_FATE_HIDDEN, /* all of it lies inside the union */
  QMAT_FATE_SHOWN   /* a piece of it bounds the union */
} qmat_fate;

/* The result. */
typedef struct qmat_united {
  bool changed;        /* false: only `why_not` is set */
  const char *why_not; /* a literal: why they cannot be united; NULL: they are, or nothing changes */
  size_t vertex_count, triangle_count;
  double *positions;    /* 3 * vertex_count: the used vertices of the mesh in their order, then vertices on cuts */
  uint32_t *triangles;  /* 3 * triangle_count: in the order of the triangles that they are cut from */
  uint8_t *is_cut;      /* per triangle of the mesh: whether it is cut or left out */
  uint8_t *fates;       /* per triangle of the mesh: a qmat_fate */
  size_t shells_united; /* cut or left out */
  size_t cut_triangles; /* of the mesh */
  double moved;         /* how far blocks are moved to touch: the result may be as far from the mesh */
} qmat_united;

/* The boundary of the union: the points with a winding number above 0. Triangles are cut along their intersections in
 * exact arithmetic, and the pieces with the inside behind them and the outside in front are kept. Shells that lose no
 * surface to others, and no more than short folds to themselves, stay as they are. Points on cuts are rounded to
 * doubles at the end. Triangles that lose a corner by that are left out; every edge still has as many triangles one way
 * as the other. The caller frees the arrays (qmat_free). QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with CGAL's message,
 * QMAT_CANCELLED. One thread. Cost: 5 to 20 microseconds per triangle of shells that intersect or vanish, 200 per pair
 * of intersecting triangles, and a box test with every 64th triangle for each region of the surface between cuts.
 * Source: Zhou, Grinspun, Zorin, Jacobson 2016, Mesh arrangements for solid geometry. */
qmat_status qmat_unite_shells(qmat_context *context, const qmat_shells *shells, qmat_united *united);

#ifdef __cplusplus
}
#endif

#endif
