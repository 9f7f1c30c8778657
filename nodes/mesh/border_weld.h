/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_BORDER_WELD_H
#define QMAT_NODES_MESH_BORDER_WELD_H

#include "core/context.h"

/* A direction that no plane of a model is likely to be perpendicular to: borders are sorted along it. */
static const double qmat_border_direction[3] = {0.8017, 0.5233, 0.2887};

typedef struct qmat_border_weld {
  size_t merged;         /* vertices that are replaced by another; 0: nothing else is set */
  double moved;          /* the largest distance between a vertex and what replaces it */
  size_t triangle_count; /* those that keep three vertices */
  uint32_t *triangles;   /* 3 * triangle_count, in the given order; in the context's arena */
} qmat_border_weld;

/* Merges vertices of border edges (edges of one triangle) that are at most `tolerance` apart, into the one of the
 * lowest number: it closes the seams of meshes whose coordinates were rounded. `positions` (3 * vertex_count, finite),
 * `triangles` (3 * triangle_count). QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: n log n. */
qmat_status qmat_weld_borders(qmat_context *context, size_t vertex_count, const double *positions,
                              size_t triangle_count, const uint32_t *triangles, double tolerance,
                              qmat_border_weld *weld);

#endif
