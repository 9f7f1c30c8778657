/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_DISPLAY_MESH_H
#define QMAT_NODES_PAGE_DISPLAY_MESH_H

#include "core/geometry/envelope.h"
#include "core/geometry/frame.h"

/* A surface as it is drawn, in the unit frame. A vertex on a crease appears once for each of its normals. All arrays
 * are in the context's arena. */
typedef struct qmat_display_mesh {
  size_t vertex_count, triangle_count;
  double *positions, *normals; /* 3 each; a normal is a unit vector, or zero where all triangles are degenerate */
  double *errors;              /* per vertex: F, the signed distance to the envelope; NULL without an envelope */
  uint32_t *triangles;         /* 3 each, in the mesh's order */
} qmat_display_mesh;

/* Makes the display mesh of a sealed mesh. `envelope` is in the same frame and may be NULL. Facets that meet at up to
 * 35 degrees share smooth normals, except at vertices of more than 256 facets. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All
 * threads; the result does not depend on their number. Cost: linear, and one query of the envelope a vertex. */
qmat_status qmat_display_mesh_make(qmat_context *context, const qmat_mesh *mesh, const qmat_frame *frame,
                                   const qmat_envelope *envelope, qmat_display_mesh *display);

#endif
