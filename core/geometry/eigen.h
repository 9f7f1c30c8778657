/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_EIGEN_H
#define QMAT_CORE_GEOMETRY_EIGEN_H

#include <math.h>

/* Finds the eigenvalues of a symmetric matrix, which replace its diagonal, and orthonormal eigenvectors: the columns of
 * v, which are a right-handed frame. They are in no order. By Jacobi rotations. */
static inline void qmat_symmetric_eigen(double m[3][3], double v[3][3]) {
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) v[i][j] = i == j;
  }
  for (int sweep = 0; sweep < 12; sweep++) {
    double off = fabs(m[0][1]) + fabs(m[0][2]) + fabs(m[1][2]);
    if (off <= 1e-15 * (fabs(m[0][0]) + fabs(m[1][1]) + fabs(m[2][2]))) break;
    for (int p = 0; p < 2; p++) {
      for (int q = p + 1; q < 3; q++) {
        if (m[p][q] == 0) continue;
        double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), cs = 1 / sqrt(t * t + 1),
               sn = t * cs;
        for (int k = 0; k < 3; k++) {
          double a = m[k][p], b = m[k][q];
          m[k][p] = cs * a - sn * b;
          m[k][q] = sn * a + cs * b;
        }
        for (int k = 0; k < 3; k++) {
          double a = m[p][k], b = m[q][k];
          m[p][k] = cs * a - sn * b;
          m[q][k] = sn * a + cs * b;
          a = v[k][p], b = v[k][q];
          v[k][p] = cs * a - sn * b;
          v[k][q] = sn * a + cs * b;
        }
      }
    }
  }
}

#endif
