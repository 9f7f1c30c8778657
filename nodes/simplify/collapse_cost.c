/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/collapse_cost.h"

#include <math.h>

#include "core/geometry/vector.h"
#include "nodes/simplify/medial_quadrics.h"

double qmat_slab_cost(double error, double k, const double a[4], const double b[4]) {
  const double gamma = qmat_stability_ratio(a, b);
  return (error + k) * gamma * gamma;
}

double qmat_pmat_cost(const double a[4], const double b[4]) {
  const double length = qmat_point_distance(a, b);
  return length > 0 ? length / fabs(a[3] - b[3]) : 0;
}

qmat_status qmat_hausdorff_candidates(qmat_context *context, qmat_surface_to_envelope *tracker,
                                      const qmat_complex *complex, const qmat_collapse *collapse, size_t point_count,
                                      qmat_candidates *candidates) {
  const double *ends[2] = {&complex->spheres[4 * (size_t)collapse->kept],
                           &complex->spheres[4 * (size_t)collapse->removed]};
  const int larger = ends[1][3] > ends[0][3];
  candidates->count = 0;
  for (int i = 0; i < 2; i++) {
    const double *sphere = ends[i ? !larger : larger];
    double error;
    const qmat_status status =
        qmat_surface_to_envelope_of_collapse(context, tracker, complex, collapse, sphere, point_count, &error);
    if (status != QMAT_OK) return status;
    qmat_candidates_insert(candidates, sphere, error);
  }
  candidates->count = 1;
  return QMAT_OK;
}
