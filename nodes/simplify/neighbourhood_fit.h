/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_NEIGHBOURHOOD_FIT_H
#define QMAT_NODES_SIMPLIFY_NEIGHBOURHOOD_FIT_H

#include "nodes/measure/surface_to_envelope.h"
#include "nodes/simplify/thresholds.h"

/* The condition of a target: near the envelope, inside it, or not deeper in it than a limit. */
typedef enum { QMAT_TARGET_SURFACE, QMAT_TARGET_INSIDE, QMAT_TARGET_BORDER } qmat_target_kind;

/* Fits several spheres jointly: the sphere of a collapse and some around it. Together they may reach an error that no
 * single sphere can while its neighbours stay. */
typedef struct qmat_neighbourhood_fit {
  uint32_t vertices[QMAT_NEIGHBOURHOOD_SPHERES]; /* the kept one of the collapse first */
  double spheres[QMAT_NEIGHBOURHOOD_SPHERES][4]; /* of these; the complex is unchanged */
  int count;
  bool keeps_radii; /* spheres are moved only, as those of sheets */
  double threshold; /* the largest |F| at the surface */
  double worst;     /* the error of the previous step; 0: there was none */
  struct qmat_fit_primitive *primitives;
  size_t primitive_count, primitive_capacity;
  struct qmat_fit_target *targets;
  size_t target_count, target_capacity;
} qmat_neighbourhood_fit;

void qmat_neighbourhood_fit_uninit(qmat_neighbourhood_fit *fit);

/* How a fit starts; the arrays are the caller's. */
typedef struct qmat_fit_request {
  const double *sphere;     /* 4 doubles: that of the collapse */
  const uint32_t *vertices; /* `count` others; as many as fit in are fitted too */
  size_t count;
  size_t surface_count; /* constraint points below this number become targets */
  double threshold;     /* the largest |F| at the surface */
} qmat_fit_request;

/* Starts a fit for `collapse`. A few hundred of the constraint points of its spheres become targets, evenly spread over
 * the lists. QMAT_ERROR_MEMORY. */
qmat_status qmat_neighbourhood_fit_start(qmat_context *context, qmat_neighbourhood_fit *fit,
                                         qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                                         const qmat_collapse *collapse, const qmat_fit_request *request);

/* Adds a target (3 doubles). `limit` is the largest F there; for QMAT_TARGET_BORDER the largest depth, at most
 * `threshold`. QMAT_ERROR_MEMORY. */
qmat_status qmat_neighbourhood_fit_add(qmat_context *context, qmat_neighbourhood_fit *fit, const double *point,
                                       qmat_target_kind kind, double limit);

/* Moves and resizes the spheres so that the largest error over the targets becomes small: least squares with weights
 * that rise with the error from step to step. `again` starts with the high weights of the end of the last run. `*error`
 * is the largest error, no more than before; above `threshold` where a target's condition fails, INFINITY where the
 * collapse leaves a sphere alone. Ends early where the error stays large. One thread. Cost: at most QMAT_FIT_STEPS
 * linear systems in all coordinates, and one pass more over the targets and their primitives. */
void qmat_neighbourhood_fit_run(qmat_neighbourhood_fit *fit, const qmat_complex *complex, bool again, double *error);

#endif
