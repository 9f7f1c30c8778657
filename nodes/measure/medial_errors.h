/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_MEDIAL_ERRORS_H
#define QMAT_NODES_MEASURE_MEDIAL_ERRORS_H

#include "nodes/measure/hausdorff_bound.h"

/* How far a solid and the envelope of a medial mesh are apart, in the unit frame. Both are upper bounds. */
typedef struct qmat_medial_errors {
  double surface_to_envelope; /* of F over the surface (eq. 9) */
  double envelope_to_surface; /* of what spheres, cones and slabs leave the solid by */
  qmat_hausdorff_bound bound; /* where the surface is farther than the threshold */
  double boundary_to_surface; /* of the distance of the envelope's boundary, on either side; 0: not measured */
  size_t uncovered_count, undecided_count;
  double *uncovered; /* 3 each: places of the envelope's boundary, deep in the solid: notches and voids */
  double *undecided; /* 3 each: places in the solid that may be as deep, though none was found that is */
} qmat_medial_errors;

/* `unit` is a medial mesh in the unit frame, sealed or not. Each measures by branch and bound on all threads, and its
 * answer does not depend on their number. QMAT_ERROR_MEMORY, QMAT_CANCELLED. */

/* The surface's distance to the envelope, to within `tolerance` (> 0) of the truth where that is above `enough`; below,
 * `enough` is the answer: a plateau of small errors would take looks without number to tell from its highest place. A
 * first look is taken at the `point_count` points (3 doubles each, on the surface); `threshold` as in
 * qmat_hausdorff_bound_measure. */
qmat_status qmat_medial_surface_bound_measure(qmat_context *context, const qmat_surface *surface,
                                              const qmat_medial *unit, const double *points, size_t point_count,
                                              double tolerance, double enough, double threshold,
                                              qmat_medial_errors *errors);

/* What spheres, cones and slabs leave the solid by, likewise. */
qmat_status qmat_medial_envelope_bound_measure(qmat_context *context, const qmat_surface *surface,
                                               const qmat_medial *unit, double tolerance, double enough,
                                               qmat_medial_errors *errors);

/* How far the envelope's boundary is from the surface on either side, closely enough to tell whether that is more than
 * `epsilon`; and where it may be, some of the places of it that lie so deep in the solid. */
qmat_status qmat_medial_boundary_measure(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                                         double epsilon, qmat_medial_errors *errors);

/* Frees the places. */
void qmat_medial_errors_uninit(qmat_medial_errors *errors);

#endif
