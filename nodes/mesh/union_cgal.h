/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_UNION_CGAL_H
#define QMAT_NODES_MESH_UNION_CGAL_H

#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

#define QMAT_NO_SHELL UINT32_MAX

/* The triangles of a mesh, told apart: edges join them to shells, and edges of two triangles to the sheets of a shell.
 */
typedef struct qmat_shells {
  size_t vertex_count, triangle_count;
  const double *positions;   /* 3 * vertex_count, finite */
  const uint32_t *triangles; /* 3 * triangle_count */
  /* triangle_count: one triangle of its shell, the same for all of that, or QMAT_NO_SHELL: it stays as it is and bounds
   * nothing. At each edge of a shell as many triangles run one way as the other. */
  const uint32_t *shells;
  const uint32_t *sheets; /* triangle_count: the same for its sheet */
  const uint8_t *reaches; /* triangle_count: 0 where no triangle of another sheet comes near */
} qmat_shells;

/* What became of them. */
typedef struct qmat_united {
  bool changed;        /* else nothing else is set but `why_not` */
  const char *why_not; /* a literal: why they could not be united; NULL: they could, or nothing was to be done */
  size_t vertex_count, triangle_count;
  double *positions;    /* 3 * vertex_count: those of the mesh that are left, in their order, then those on cuts */
  uint32_t *triangles;  /* 3 * triangle_count: in the order of the triangles that they are or are cut from */
  size_t shells_united; /* that were cut or left out */
  size_t cut_triangles; /* of the mesh, that others meet */
} qmat_united;

/* The boundary of what the shells wind around (a winding number above 0), exactly: triangles are cut where they meet,
 * and those parts of them kept that have the inside behind and the outside before them. Shells that lose nothing of
 * their surface to others stay as they are, those without shell do in any case. Points on cuts are rounded to doubles
 * at the end; triangles that lose a corner by that are left out, and edges still have as many triangles one way as the
 * other. The arrays are made by qmat_alloc; the caller frees them. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY with CGAL's
 * text, QMAT_CANCELLED. One thread. Cost: 5 to 20 microseconds a triangle of shells that meet or vanish, 200 a pair of
 * triangles that meet, and for each piece of surface between cuts a look at every 64th triangle.
 * Source: Zhou, Grinspun, Zorin, Jacobson 2016, Mesh arrangements for solid geometry. */
qmat_status qmat_unite_shells(qmat_context *context, const qmat_shells *shells, qmat_united *united);

#ifdef __cplusplus
}
#endif

#endif
