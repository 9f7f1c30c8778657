/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_LOCAL_RESAMPLING_H
#define QMAT_NODES_INITIAL_LOCAL_RESAMPLING_H

#include "core/geometry/frame.h"
#include "core/geometry/point_grid.h"
#include "core/value.h"

/* Where a surface needs more samples, and how dense. Lengths are in the unit frame. */
typedef struct qmat_resampling {
  const qmat_mesh *mesh;
  const qmat_frame *frame;
  const double *positions;    /* 3 per mesh vertex, unit frame */
  const qmat_point_grid *far; /* the points around which samples are added */
  double around;              /* up to this distance from them */
  double spacing;             /* of the new samples */
} qmat_resampling;

/* Adds evenly spaced samples behind those of `before`. `reaches` (one per sample of `before`; NULL: unbounded) and
 * `*reaches_after` (one per new and old sample) bound the distance between a sample and its representative in
 * the triangulation; near the far points the bound is below the new spacing. `*samples` is not sealed. Both outputs
 * are NULL if nothing changes, or if there would be more than 2^20 new samples. The caller releases the samples and
 * frees the reaches (qmat_free). QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their
 * number. Cost: a point query per facet and per candidate sample. */
qmat_status qmat_samples_densify(qmat_context *context, const qmat_resampling *where, const qmat_samples *before,
                                 const double *reaches, qmat_samples **samples, double **reaches_after);

#endif
