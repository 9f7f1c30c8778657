/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/stored_medial.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

static double raise_error(double error, double by) {
  return nextafter(error + nextafter(by, INFINITY), INFINITY);
}

qmat_stated_errors qmat_errors_after_move(const qmat_stated_errors *errors, double moved) {
  qmat_stated_errors after = *errors;
  if (!(errors->diagonal > 0) || !(moved > 0)) return after;
  after.error_out = raise_error(errors->error_out, moved / errors->diagonal);
  after.error_in = raise_error(errors->error_in, moved / errors->diagonal);
  const bool holds = after.error_out <= after.epsilon && after.error_in <= after.epsilon;
  if (after.certified == QMAT_CERTIFICATE_YES && !holds) after.certified = QMAT_CERTIFICATE_NO;
  return after;
}

double qmat_medial_move(const qmat_medial *given, const qmat_medial *stored) {
  double most = 0;
  for (size_t i = 0; i < given->sphere_count && i < stored->sphere_count; i++) {
    const double *a = given->spheres + 4 * i, *b = stored->spheres + 4 * i;
    most = fmax(most, qmat_point_distance(a, b) + fabs(a[3] - b[3]));
  }
  return most;
}

void qmat_storage_origin(const qmat_medial *medial, const qmat_mesh *skin, double allowed, double origin[3]) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * medial->sphere_count; i++) {
    const double *sphere = &medial->spheres[4 * (i / 3)];
    low[i % 3] = fmin(low[i % 3], sphere[i % 3] - sphere[3]);
    high[i % 3] = fmax(high[i % 3], sphere[i % 3] + sphere[3]);
  }
  for (size_t i = 0; skin && i < 3 * skin->vertex_count; i++) {
    low[i % 3] = fmin(low[i % 3], skin->positions[i]);
    high[i % 3] = fmax(high[i % 3], skin->positions[i]);
  }
  double largest = 0, side = 0;
  for (int k = 0; k < 3; k++) {
    origin[k] = 0;
    largest = fmax(largest, fmax(fabs(low[k]), fabs(high[k])));
    side = fmax(side, high[k] - low[k]);
  }
  /* Three coordinates and a radius are each rounded by half a unit in the last of 24 bits. */
  const bool is_far = (sqrt(3) + 1) * ldexp(largest, -24) > allowed / 4;
  int exponent;
  if (!(allowed > 0) || !is_far || !(side > 0) || !isfinite(side)) return;
  frexp(side, &exponent);
  const double step = ldexp(1, exponent);
  for (int k = 0; k < 3; k++) origin[k] = step * round((low[k] / 2 + high[k] / 2) / step);
}
