/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_SAMPLE_SITES_H
#define QMAT_NODES_INITIAL_SAMPLE_SITES_H

#include "core/geometry/frame.h"

/* The samples of the solids of a mesh. Both arrays live in the context's arena. */
typedef struct qmat_sample_sites {
  size_t count;
  double *points;    /* 3 per site, in model units */
  uint32_t *samples; /* per site: its sample */
} qmat_sample_sites;

/* Lists the samples on triangles that bound solids, in their order. QMAT_ERROR_GEOMETRY names "samples" if they do not
 * belong to the mesh; QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_sample_sites_find(qmat_context *context, const qmat_mesh *mesh, const qmat_samples *samples,
                                   qmat_sample_sites *sites);

enum { QMAT_BOX_CORNERS = 8 };

/* Sets the corners (3 doubles each) of a box around the unit frame, five times as large as a box with the surface's
 * diagonal as its sides. */
void qmat_box_corners(double corners[3 * QMAT_BOX_CORNERS]);

/* The sites in the unit frame, and behind them the corners of that box: 3 doubles per point, in the context's arena.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_boxed_points(qmat_context *context, const qmat_frame *frame, const qmat_sample_sites *sites,
                              double **points);

#endif
