/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_INTERIOR_POINTS_H
#define QMAT_NODES_MEASURE_INTERIOR_POINTS_H

#include "core/geometry/medial_complex.h"

/* Points deep inside a solid that the envelope has to contain; otherwise it could surround the surface and be empty
 * within. They are centres of medial spheres and the nodes of a cubic lattice between them. All arrays live in the
 * context's arena. */
typedef struct qmat_interior_points {
  size_t count;
  double *points;    /* 3 per point, in the frame of the spheres */
  uint32_t *spheres; /* per point: the vertex whose sphere contains it deepest */
  double *distances; /* per point: the signed distance to that sphere, at most -depth */
  double *limits;    /* per point: the largest allowed distance to the envelope; 0 or less */
} qmat_interior_points;

/* Finds such points, at least `depth` (> 0) deep, for a medial complex that fills its solid. Of the spheres larger than
 * `depth` whose centres share a cube of half that side, only the largest counts. The lattice's spacing is twice the
 * depth, or a 127th of the extent of the spheres where that is more. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads;
 * the result does not depend on their number. Cost: a search among the spheres for each node. */
qmat_status qmat_interior_points_find(qmat_context *context, const qmat_complex *complex, double depth,
                                      qmat_interior_points *inner);

#endif
