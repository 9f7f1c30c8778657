/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_VECTOR_H
#define QMAT_CORE_VECTOR_H

#include <math.h>

/* The distance of two points (3 doubles each; of spheres, their centres). */
static inline double qmat_point_distance(const double *a, const double *b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return sqrt(x * x + y * y + z * z);
}

/* A maximum and minimum that compile to one instruction; the second operand where the first is not a number. */
static inline double qmat_larger(double a, double b) {
  return a > b ? a : b;
}
static inline double qmat_smaller(double a, double b) {
  return a < b ? a : b;
}

#endif
