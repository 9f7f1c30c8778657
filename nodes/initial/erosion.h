/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_EROSION_H
#define QMAT_NODES_INITIAL_EROSION_H

#include "core/value.h"

/* When a medial mesh burns: fires start at its borders and at the ends of its curves, at the time of the radius there,
 * and burn with unit speed. Where sheets or curves meet, a fire waits until all others but one have arrived; then it
 * goes on into the last one. What encloses a void or a loop never burns: INFINITY. All arrays live in the context's
 * arena. */
typedef struct qmat_burn_times {
  double *spheres; /* per sphere: when all around it is burnt */
  double *corners; /* 3 per triangle: when the fire in its sheet reaches each corner */
  uint32_t *sides; /* 3 per triangle: the edge opposite each corner */
  double *ends;    /* 2 per edge without triangles: when the fire in it reaches each end; else unset */
} qmat_burn_times;

/* Burns a medial mesh (Y. Yan, K. Sykes, E. Chambers, D. Letscher, T. Ju: Erosion thickness on medial axes of 3D
 * shapes, 2016). A front is straight within a triangle where the
 * fires at two corners come along similar courses, so that times are exact for fires from straight borders; elsewhere
 * fire runs along edges. QMAT_ERROR_MEMORY, QMAT_CANCELLED. One thread. Cost: O(n log n). */
qmat_status qmat_burn(qmat_context *context, const qmat_medial *medial, qmat_burn_times *times);

#endif
