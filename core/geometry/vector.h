/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_VECTOR_H
#define QMAT_CORE_GEOMETRY_VECTOR_H

#include <math.h>
#include <stddef.h>

/* Vectors and points are 3 doubles. Every function evaluates in a fixed order, so results are the same everywhere. */

#define QMAT_PI 3.14159265358979323846
/* pi (3 - sqrt 5): turns of it spread evenly around a circle. */
#define QMAT_GOLDEN_ANGLE 2.39996322972865332

/* The distance between two points, or between the centres of two spheres. */
static inline double qmat_point_distance(const double *a, const double *b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return sqrt(x * x + y * y + z * z);
}

/* a - b, the scalar product and the vector product. */
static inline void qmat_subtract(const double a[3], const double b[3], double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}
static inline double qmat_dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline void qmat_cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
/* The product of two matrices, row by row; `product` may be one of them. */
static inline void qmat_multiply(double a[3][3], double b[3][3], double product[3][3]) {
  double made[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) made[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) product[i][j] = made[i][j];
}
static inline double qmat_determinant(double a[3][3]) {
  double cross[3];
  qmat_cross(a[1], a[2], cross);
  return qmat_dot(a[0], cross);
}
/* Scales a vector to length 1; its length must not be 0. */
static inline void qmat_normalize(double v[3]) {
  const double length = sqrt(qmat_dot(v, v));
  for (int k = 0; k < 3; k++) v[k] /= length;
}

/* Direction i of n that are spread evenly over the sphere, of length 1: a spiral with the golden angle between
 * successive directions (Vogel 1979). */
static inline void qmat_spread_direction(size_t i, size_t n, double out[3]) {
  const double z = 1 - (2 * (double)i + 1) / (double)n, r = sqrt(1 - z * z), turn = QMAT_GOLDEN_ANGLE * (double)i;
  out[0] = r * cos(turn);
  out[1] = r * sin(turn);
  out[2] = z;
}

/* A maximum and a minimum that compile to one instruction. They give the second operand when the first is NaN. */
static inline double qmat_larger(double a, double b) {
  return a > b ? a : b;
}
static inline double qmat_smaller(double a, double b) {
  return a < b ? a : b;
}

#endif
