/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_SPHERE_FIT_H
#define QMAT_NODES_SIMPLIFY_SPHERE_FIT_H

#include "nodes/measure/surface_to_envelope.h"

/* Fits the sphere of one medial vertex to the surface: minimises the largest |F| at the constraint points of the
 * vertex, on either side. Quadrics only know the tangent planes of the initial medial mesh; a fit uses the surface
 * itself. */
typedef struct qmat_sphere_fit {
  uint32_t *points;  /* the constraint points of the newest fit */
  uint32_t *nearest; /* per point: the primitive that was nearest last */
  size_t count, capacity, nearest_capacity;
  bool keeps_radius; /* spheres are moved only, as those of sheets */
} qmat_sphere_fit;

void qmat_sphere_fit_uninit(qmat_sphere_fit *fit);

/* Chooses the constraint points of a collapse or move: those of its vertices among the first `surface_count`, at most
 * `most` (> 0), evenly spread over the lists. QMAT_ERROR_MEMORY. */
qmat_status qmat_sphere_fit_gather(qmat_context *context, qmat_sphere_fit *fit, qmat_surface_to_envelope *tracker,
                                   const qmat_collapse *collapse, size_t surface_count, size_t most);

/* The largest |F| at the chosen points, F being the distance to the star of `collapse` with `sphere`; above `enough`
 * any value above. */
qmat_status qmat_sphere_fit_error(qmat_context *context, qmat_sphere_fit *fit, qmat_surface_to_envelope *tracker,
                                  const qmat_complex *complex, const qmat_collapse *collapse, const double sphere[4],
                                  double enough, double *error);

/* Moves and resizes `sphere` so that the largest |F| at the chosen points becomes small: least squares with weights
 * that rise with the error from step to step (Gauss-Newton on norms of rising order). Ends early where the error stays
 * well above `give_up_error`. `*before` is the largest |F| of the given sphere and `*error` that of the returned one,
 * which is no more; both are INFINITY where the given one is hopeless. QMAT_ERROR_MEMORY. Cost: at most five queries at
 * each point. */
qmat_status qmat_sphere_fit_run(qmat_context *context, qmat_sphere_fit *fit, qmat_surface_to_envelope *tracker,
                                const qmat_complex *complex, const qmat_collapse *collapse, double give_up_error,
                                double sphere[4], double *before, double *error);

#endif
