/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/placement.h"

#include <math.h>
#include <string.h>

#include "core/geometry/eigen.h"

/* Rows of a plain transform are perpendicular up to this cosine: single-precision matrices are not exact. */
#define PERPENDICULAR 1e-6

/* The scalar products of the rows of the linear part. */
static void row_products(const double m[16], double products[3][3]) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      products[i][j] = m[4 * i] * m[4 * j] + m[4 * i + 1] * m[4 * j + 1] + m[4 * i + 2] * m[4 * j + 2];
}

double qmat_placement_stretch(const double m[16]) {
  double products[3][3], v[3][3];
  row_products(m, products);
  qmat_symmetric_eigen(products, v);
  return sqrt(fmax(fmax(products[0][0], products[1][1]), fmax(products[2][2], 0)));
}

bool qmat_placement_is_plain(const double m[16]) {
  double g[3][3];
  row_products(m, g);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < i; j++)
      if (fabs(g[i][j]) > PERPENDICULAR * sqrt(g[i][i]) * sqrt(g[j][j])) return false;
  return true;
}

void qmat_placement_split(const double m[16], double inner[16], double outer[16]) {
  /* A = V (V^T A): the rows of V^T A are perpendicular where the columns of V are eigenvectors of A A^T. */
  double products[3][3], v[3][3];
  row_products(m, products);
  qmat_symmetric_eigen(products, v);
  static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  memcpy(inner, identity, sizeof identity);
  memcpy(outer, m, sizeof identity);
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      inner[4 * i + j] = v[i][j];
      outer[4 * i + j] = v[0][i] * m[j] + v[1][i] * m[4 + j] + v[2][i] * m[8 + j];
    }
  }
}

void qmat_placement_quaternion(double a[3][3], double q[4]) {
  const double trace = a[0][0] + a[1][1] + a[2][2];
  int largest = 3;
  for (int k = 0; k < 3; k++)
    if (a[k][k] > (largest == 3 ? trace : a[largest][largest])) largest = k;
  if (largest == 3) {
    for (int i = 0; i < 3; i++) q[i] = a[(i + 1) % 3][(i + 2) % 3] - a[(i + 2) % 3][(i + 1) % 3];
    q[3] = 1 + trace;
  } else {
    const int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    q[i] = 1 + a[i][i] - a[j][j] - a[k][k];
    q[j] = a[i][j] + a[j][i];
    q[k] = a[i][k] + a[k][i];
    q[3] = a[j][k] - a[k][j];
  }
  const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int k = 0; k < 4; k++) q[k] /= length;
}

void qmat_placement_turn(const double q[4], double axes[3][3]) {
  const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const bool turns = length > 0;
  const double x = turns ? q[0] / length : 0, y = turns ? q[1] / length : 0, z = turns ? q[2] / length : 0;
  const double w = turns ? q[3] / length : 1;
  const double made[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
                             {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
                             {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}};
  memcpy(axes, made, sizeof made);
}
