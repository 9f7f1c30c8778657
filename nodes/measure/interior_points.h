/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_INTERIOR_POINTS_H
#define QMAT_NODES_MEASURE_INTERIOR_POINTS_H

#include "core/geometry/medial_complex.h"

/* Places deep inside a solid that the envelope has to contain, lest it cover the surface and be cavity: centres of
 * medial spheres, and nodes of a cubic lattice between. All arrays live in the context's arena. */
typedef struct qmat_interior_points {
  size_t count;
  double *points;    /* 3 per point, in the frame of the spheres */
  uint32_t *spheres; /* per point: the vertex of the sphere that it is deepest in */
  double *distances; /* per point: the signed distance to that sphere, at most -depth */
  double *limits;    /* per point: what the distance to the envelope may be at most; 0 or less */
} qmat_interior_points;

/* Finds such places for a medial complex that fills its solid, at least `depth` (> 0) deep. Of spheres larger than
 * `depth` whose centres share a cube of half of it the largest stands for all. The lattice's spacing is twice the
 * depth, or a 127th of the spheres' extent where that is more. QMAT_ERROR_MEMORY. One thread. */
qmat_status qmat_interior_points_find(qmat_context *context, const qmat_complex *complex, double depth,
                                      qmat_interior_points *inner);

#endif
