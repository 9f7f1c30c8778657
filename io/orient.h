/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_ORIENT_H
#define QMAT_IO_ORIENT_H

#include "core/value.h"

/* What the edges of a triangle mesh say. */
typedef struct qmat_connectivity {
  size_t border_edges;          /* on one triangle */
  size_t nonmanifold_edges;     /* on three or more */
  size_t components;            /* joined by vertices */
  size_t inward_components;     /* the closed ones that enclose a negative volume, as cavities do */
  int64_t euler_characteristic; /* vertices - edges + triangles */
  size_t flipped;               /* triangles that were turned over */
  bool closed, oriented;        /* as in qmat_mesh */
} qmat_connectivity;

/* Gives the triangles one orientation and says how they are connected. Triangles that are joined by edges of two
 * triangles make a patch. A patch whose triangles disagree and can be made to agree is made to enclose a positive
 * volume (an open one is closed by a cone over its border for that). The other patches stay as they are, unless the
 * closed ones among them enclose a negative volume together: then those are turned over. Cavities thus survive.
 * Every vertex is used, positions are finite, 3 * triangle_count < 2^32, no triangle names a vertex twice.
 * QMAT_ERROR_MEMORY. Deterministic, one thread. Cost: linear; about 60 bytes of scratch a triangle. */
qmat_status qmat_orient_triangles(qmat_context *context, const double *positions, size_t vertex_count,
                                  uint32_t *triangles, size_t triangle_count, qmat_connectivity *connectivity);

#endif
