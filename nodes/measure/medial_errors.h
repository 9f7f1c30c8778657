/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_MEDIAL_ERRORS_H
#define QMAT_NODES_MEASURE_MEDIAL_ERRORS_H

#include "nodes/measure/hausdorff_bound.h"

/* The two errors between a solid and the envelope of a medial mesh: upper bounds in the unit frame. */
typedef struct qmat_medial_errors {
  double surface_to_envelope; /* F over the surface (eq. 9) */
  double envelope_to_surface; /* how far spheres, cones and slabs leave the solid */
  qmat_hausdorff_bound bound; /* the surface where F exceeds the threshold */
  double boundary_to_surface; /* the distance from its boundary to the surface, on either side; 0: not measured */
  size_t uncovered_count, undecided_count;
  double *uncovered; /* 3 each: boundary points deeper than epsilon in the solid */
  double *undecided; /* 3 each: points in the solid that may be so deep, though none was found */
} qmat_medial_errors;

/* In the functions below, `unit` is a medial mesh in the unit frame, sealed or not. Each measures by branch and bound
 * on all threads; the answer does not depend on their number. QMAT_ERROR_MEMORY, QMAT_CANCELLED. */

/* Bounds the distance from the surface to the envelope, to within `tolerance` (> 0) where it is above `enough`. Below,
 * `enough` is the answer: the maximum over a plateau of small errors takes too many queries. F at the `point_count`
 * points (3 doubles each, on the surface) is the first lower bound, as far as it is at most `threshold`. The bound is
 * exact enough to compare it with `threshold`, and the points of `errors->bound`, one a facet, have an F above it less
 * the tolerance. */
qmat_status qmat_medial_surface_bound_measure(qmat_context *context, const qmat_surface *surface,
                                              const qmat_medial *unit, const double *points, size_t point_count,
                                              double tolerance, double enough, double threshold,
                                              qmat_medial_errors *errors);

/* Bounds how far spheres, cones and slabs leave the solid, likewise. */
qmat_status qmat_medial_envelope_bound_measure(qmat_context *context, const qmat_surface *surface,
                                               const qmat_medial *unit, double tolerance, double enough,
                                               qmat_medial_errors *errors);

/* Bounds the distance from the envelope's boundary to the surface on either side, closely enough to compare it with
 * `epsilon`. Where it may be more, some of the points deep in the solid are returned. With `only_places` these are
 * wanted, not a bound, which is INFINITY then. */
qmat_status qmat_medial_boundary_measure(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                                         double epsilon, bool only_places, qmat_medial_errors *errors);

/* Frees the points, and sets all to 0: nothing is measured. */
void qmat_medial_errors_uninit(qmat_medial_errors *errors);

#endif
