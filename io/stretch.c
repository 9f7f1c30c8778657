/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/stretch.h"

#include <math.h>

#include "core/geometry/vector.h"

double qmat_largest_stretch(const double *m) {
  double a[3][3], spread = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      a[i][j] = m[4 * i] * m[4 * j] + m[4 * i + 1] * m[4 * j + 1] + m[4 * i + 2] * m[4 * j + 2];
  const double mean = (a[0][0] + a[1][1] + a[2][2]) / 3;
  for (int i = 0; i < 3; i++) {
    a[i][i] -= mean;
    for (int j = 0; j < 3; j++) spread += a[i][j] * a[i][j];
  }
  spread = sqrt(spread / 6);
  if (!(spread > 1e-12 * mean)) return sqrt(mean); /* it scales evenly */
  const double half = fmax(-1, fmin(1, qmat_determinant(a) / (spread * spread * spread) / 2));
  return sqrt(fmax(mean + 2 * spread * cos(acos(half) / 3), 0));
}

double qmat_rounded_stretch(double stretch) {
  if (!(stretch > 1e-100 && stretch < 1e100)) return stretch;
  /* Powers of ten up to 1e22 are exact, so that what has six digits stays. */
  const double places = 5 - floor(log10(stretch)), power = pow(10, fabs(places));
  return places > 0 ? round(stretch * power) / power : round(stretch / power) * power;
}
