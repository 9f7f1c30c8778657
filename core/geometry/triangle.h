/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_TRIANGLE_H
#define QMAT_CORE_GEOMETRY_TRIANGLE_H

#include <math.h>
#include <stdbool.h>

/* A triangle's area below this share of its longest edge's square is rounding, and it has no normal to speak of. */
#define QMAT_DEGENERATE_AREA 1e-12

/* The area of the triangle abc (3 doubles each), and its unit normal (3 doubles, right-handed; not NULL). A degenerate
 * triangle gives 0 and a zero normal. Points should be in a unit frame: squares of lengths are taken. */
static inline double qmat_triangle_area(const double a[3], const double b[3], const double c[3], double normal[3]) {
  double ab[3], ac[3], bc[3];
  for (int k = 0; k < 3; k++) ab[k] = b[k] - a[k], ac[k] = c[k] - a[k], bc[k] = c[k] - b[k];
  normal[0] = ab[1] * ac[2] - ab[2] * ac[1];
  normal[1] = ab[2] * ac[0] - ab[0] * ac[2];
  normal[2] = ab[0] * ac[1] - ab[1] * ac[0];
  const double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
  const double longest =
      fmax(fmax(ab[0] * ab[0] + ab[1] * ab[1] + ab[2] * ab[2], ac[0] * ac[0] + ac[1] * ac[1] + ac[2] * ac[2]),
           bc[0] * bc[0] + bc[1] * bc[1] + bc[2] * bc[2]);
  const bool degenerate = !(length > 2 * QMAT_DEGENERATE_AREA * longest);
  for (int k = 0; k < 3; k++) normal[k] = degenerate ? 0 : normal[k] / length;
  return degenerate ? 0 : 0.5 * length;
}

#endif
