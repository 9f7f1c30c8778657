/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_NEIGHBOURHOOD_FIT_H
#define QMAT_NODES_SIMPLIFY_NEIGHBOURHOOD_FIT_H

#include "nodes/measure/surface_to_envelope.h"

enum { QMAT_NEIGHBOURHOOD_SPHERES = 12 };

/* What is asked of a target: that it lies close to the envelope, that it lies inside it, or that the envelope does not
 * go far beyond it. */
typedef enum { QMAT_TARGET_SURFACE, QMAT_TARGET_INSIDE, QMAT_TARGET_BORDER } qmat_target_kind;

/* Fits several spheres at once: that of a collapse and some around it. What a sphere's own fit cannot do because its
 * neighbours stay where they are, they may do together. */
typedef struct qmat_neighbourhood_fit {
  uint32_t vertices[QMAT_NEIGHBOURHOOD_SPHERES]; /* the kept one of the collapse first */
  double spheres[QMAT_NEIGHBOURHOOD_SPHERES][4]; /* of these; the collapse has not changed the complex */
  int count;
  double threshold; /* what |F| may be at the surface */
  double worst;     /* the error of the step before; 0: there was none */
  struct qmat_fit_primitive *primitives;
  size_t primitive_count, primitive_capacity;
  struct qmat_fit_target *targets;
  size_t target_count, target_capacity;
} qmat_neighbourhood_fit;

void qmat_neighbourhood_fit_uninit(qmat_neighbourhood_fit *fit);

/* Starts a fit for `collapse` to `sphere` and for as many of the `count` other `vertices` as there is room for. Of the
 * first `surface_count` constraint points that these answer for, a few hundred are looked at, evenly spread over the
 * lists. QMAT_ERROR_MEMORY. */
qmat_status qmat_neighbourhood_fit_start(qmat_context *context, qmat_neighbourhood_fit *fit,
                                         const qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                                         const qmat_collapse *collapse, const double sphere[4],
                                         const uint32_t *vertices, size_t count, size_t surface_count,
                                         double threshold);

/* One target more (3 doubles). `limit` is how large F may be there; of QMAT_TARGET_BORDER, how far below 0, which may
 * not be more than `threshold`. QMAT_ERROR_MEMORY. */
qmat_status qmat_neighbourhood_fit_add(qmat_context *context, qmat_neighbourhood_fit *fit, const double *point,
                                       qmat_target_kind kind, double limit);

/* Moves and resizes the spheres so that the largest error over the targets becomes small, by least squares with weights
 * that rise with the error from step to step; `again` starts with high ones, as the last run has ended. `*error` is
 * what is left, no more than what came in, and above `threshold` where some target has not what is asked of it;
 * INFINITY where the collapse leaves a sphere alone. Gives up early where it is hopeless. One thread. Cost: nine looks
 * at each target at the primitives near it, and as many linear systems in all coordinates. */
void qmat_neighbourhood_fit_run(qmat_neighbourhood_fit *fit, const qmat_complex *complex, bool again, double *error);

#endif
