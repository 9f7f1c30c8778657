/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_SAMPLE_SITES_H
#define QMAT_NODES_INITIAL_SAMPLE_SITES_H

#include "core/value.h"

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

#endif
