/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_TRIANGLE_H
#define QMAT_CORE_GEOMETRY_TRIANGLE_H

#include <math.h>
#include <stdbool.h>

#include "core/geometry/vector.h"

/* A triangle whose area is below this share of its longest edge squared is degenerate: its normal is rounding noise. */
#define QMAT_DEGENERATE_AREA 1e-12

/* Twice the area vector of the triangle abc (3 doubles each), right-handed. */
static inline void qmat_triangle_normal(const double a[3], const double b[3], const double c[3], double normal[3]) {
  double ab[3], ac[3];
  qmat_subtract(b, a, ab);
  qmat_subtract(c, a, ac);
  qmat_cross(ab, ac, normal);
}

/* The area of the triangle abc (3 doubles each) and its unit normal (3 doubles, right-handed; not NULL). A degenerate
 * triangle gives 0 and a zero normal. Points should be in a unit frame, since lengths are squared. */
static inline double qmat_triangle_area(const double a[3], const double b[3], const double c[3], double normal[3]) {
  double ab[3], ac[3], bc[3];
  qmat_subtract(b, a, ab);
  qmat_subtract(c, a, ac);
  qmat_subtract(c, b, bc);
  qmat_cross(ab, ac, normal);
  const double length = sqrt(qmat_dot(normal, normal));
  const double longest = fmax(fmax(qmat_dot(ab, ab), qmat_dot(ac, ac)), qmat_dot(bc, bc));
  const bool degenerate = !(length > 2 * QMAT_DEGENERATE_AREA * longest);
  for (int k = 0; k < 3; k++) normal[k] = degenerate ? 0 : normal[k] / length;
  return degenerate ? 0 : 0.5 * length;
}

#endif
