/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COLLAPSE_COST_H
#define QMAT_NODES_SIMPLIFY_COLLAPSE_COST_H

#include "nodes/measure/surface_to_envelope.h"
#include "nodes/simplify/collapse_candidates.h"

/* The cost that orders collapses. */
typedef enum qmat_cost_kind {
  QMAT_COST_SLAB,      /* Q-MAT: slab quadratic error and stability ratio (eq. 6) */
  QMAT_COST_HAUSDORFF, /* HEM (Sun et al. 2016): the distance from the surface to the envelope */
  QMAT_COST_PMAT       /* PMAT (Faraj et al. 2013): length of the edge against the difference of radii */
} qmat_cost_kind;

/* Eq. 6 for an edge between spheres `a` and `b` (4 doubles each); `error` is the slab quadratic error of the merged
 * sphere. 0 for a pure spike, whatever the error is. */
double qmat_slab_cost(double error, double k, const double a[4], const double b[4]);

/* The distance of the centres over the difference of the radii: below 1 where one sphere contains the other, INFINITY
 * for equal radii, 0 for equal centres. */
double qmat_pmat_cost(const double a[4], const double b[4]);

/* The HEM candidate of the newest preview: the end of the edge with the smaller error after the collapse, and this
 * error. The error is the largest F at the points of both ends among the first `point_count` constraint points;
 * -INFINITY without points. Equal errors choose the larger sphere. QMAT_ERROR_MEMORY. Cost: points times both stars. */
qmat_status qmat_hausdorff_candidates(qmat_context *context, qmat_surface_to_envelope *tracker,
                                      const qmat_complex *complex, const qmat_collapse *collapse, size_t point_count,
                                      qmat_candidates *candidates);

#endif
