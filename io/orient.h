/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_ORIENT_H
#define QMAT_IO_ORIENT_H

#include "core/value.h"

/* The connectivity of a triangle mesh. */
typedef struct qmat_connectivity {
  size_t border_edges;          /* with one triangle */
  size_t nonmanifold_edges;     /* with three or more */
  size_t components;            /* connected by vertices */
  size_t inward_components;     /* closed ones that enclose a negative volume, as cavities do */
  int64_t euler_characteristic; /* vertices - edges + triangles */
  size_t flipped;               /* number of flipped triangles */
  bool closed, oriented;        /* as in qmat_mesh */
} qmat_connectivity;

/* Orients the triangles in place and reports their connectivity. Triangles connected by edges with two triangles form a
 * piece. An orientable piece with inconsistent triangles is made consistent and encloses a positive volume (a cone over
 * its border closes an open piece). Other pieces keep their orientation, so cavities stay cavities. Only if the closed
 * consistent pieces together enclose a negative volume, all of these are flipped.
 * Requires that every vertex is used, positions are finite, 3 * triangle_count < 2^32, and triangles have three
 * corners. QMAT_ERROR_MEMORY. Deterministic, one thread. Cost: linear; about 60 bytes of scratch memory per triangle.
 */
qmat_status qmat_orient_triangles(qmat_context *context, const double *positions, size_t vertex_count,
                                  uint32_t *triangles, size_t triangle_count, qmat_connectivity *connectivity);

#endif
