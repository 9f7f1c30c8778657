/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/quadric.h"

#include <math.h>
#include <stddef.h>

void qmat_quadric_add(qmat_quadric *quadric, const qmat_quadric *other) {
  for (int i = 0; i < 10; i++) quadric->a[i] += other->a[i];
  for (int i = 0; i < 4; i++) quadric->b[i] += other->b[i];
  quadric->c += other->c;
}

void qmat_quadric_add_plane(qmat_quadric *quadric, const double n[3], const double m[4], double weight) {
  const double row[4] = {n[0], n[1], n[2], 1};
  const double offset = n[0] * m[0] + n[1] * m[1] + n[2] * m[2] + m[3];
  size_t k = 0;
  for (int i = 0; i < 4; i++)
    for (int j = i; j < 4; j++) quadric->a[k++] += weight * row[i] * row[j];
  for (int i = 0; i < 4; i++) quadric->b[i] -= 2 * weight * offset * row[i];
  quadric->c += weight * offset * offset;
}

bool qmat_tangent_normals(const double a[4], const double b[4], const double c[4], double normals[2][3]) {
  double e1[3], e2[3], normal[3], g[3];
  for (int k = 0; k < 3; k++) {
    e1[k] = b[k] - a[k];
    e2[k] = c[k] - a[k];
  }
  for (int k = 0; k < 3; k++) normal[k] = e1[(k + 1) % 3] * e2[(k + 2) % 3] - e1[(k + 2) % 3] * e2[(k + 1) % 3];
  double g11 = 0, g12 = 0, g22 = 0, length = 0;
  for (int k = 0; k < 3; k++) {
    g11 += e1[k] * e1[k];
    g12 += e1[k] * e2[k];
    g22 += e2[k] * e2[k];
    length += normal[k] * normal[k];
  }
  const double determinant = g11 * g22 - g12 * g12;
  if (!(determinant > 1e-14 * g11 * g22)) return false;
  /* The in-plane gradient g of the radius; the normal of a common tangent plane has the in-plane part -g. */
  const double d1 = b[3] - a[3], d2 = c[3] - a[3];
  const double s = (g22 * d1 - g12 * d2) / determinant, t = (g11 * d2 - g12 * d1) / determinant;
  double slope = 0;
  for (int k = 0; k < 3; k++) {
    g[k] = s * e1[k] + t * e2[k];
    slope += g[k] * g[k];
  }
  if (!(slope < 1)) return false;
  const double rise = sqrt((1 - slope) / length);
  for (int side = 0; side < 2; side++)
    for (int k = 0; k < 3; k++) normals[side][k] = (side ? rise : -rise) * normal[k] - g[k];
  return true;
}

bool qmat_quadric_add_slab(qmat_quadric *quadric, const double a[4], const double b[4], const double c[4],
                           double weight) {
  double normals[2][3];
  if (!qmat_tangent_normals(a, b, c, normals)) return false;
  for (int side = 0; side < 2; side++) qmat_quadric_add_plane(quadric, normals[side], a, weight);
  return true;
}

bool qmat_quadric_add_cone(qmat_quadric *quadric, const double a[4], const double b[4], double weight) {
  double axis[3], length = 0;
  for (int k = 0; k < 3; k++) {
    axis[k] = b[k] - a[k];
    length += axis[k] * axis[k];
  }
  length = sqrt(length);
  const double change = b[3] - a[3];
  if (!(fabs(change) < length)) return false;
  for (int k = 0; k < 3; k++) axis[k] /= length;
  /* A tangent normal n is cos * axis + sin * (a unit vector perpendicular to the axis). Over the rotation, the mean of
   * n is cos * axis, and the mean of n n' is cos^2 axis axis' + sin^2 / 2 (I - axis axis'). */
  const double cosine = -change / length, across = 0.5 * (1 - cosine * cosine);
  const double along = cosine * cosine - across;
  double matrix[4][4], row[4];
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) matrix[i][j] = along * axis[i] * axis[j] + (i == j ? across : 0);
    matrix[i][3] = matrix[3][i] = cosine * axis[i];
  }
  matrix[3][3] = 1;
  double constant = 0;
  for (int i = 0; i < 4; i++) {
    row[i] = 0;
    for (int j = 0; j < 4; j++) row[i] += matrix[i][j] * a[j];
    constant += row[i] * a[i];
  }
  size_t k = 0;
  for (int i = 0; i < 4; i++)
    for (int j = i; j < 4; j++) quadric->a[k++] += weight * matrix[i][j];
  for (int i = 0; i < 4; i++) quadric->b[i] -= 2 * weight * row[i];
  quadric->c += weight * constant;
  return true;
}

double qmat_quadric_error(const qmat_quadric *quadric, const double x[4]) {
  const double *a = quadric->a;
  const double r0 = a[0] * x[0] + 2 * (a[1] * x[1] + a[2] * x[2] + a[3] * x[3]);
  const double r1 = a[4] * x[1] + 2 * (a[5] * x[2] + a[6] * x[3]);
  const double r2 = a[7] * x[2] + 2 * a[8] * x[3];
  const double square = r0 * x[0] + r1 * x[1] + r2 * x[2] + a[9] * x[3] * x[3];
  const double linear = quadric->b[0] * x[0] + quadric->b[1] * x[1] + quadric->b[2] * x[2] + quadric->b[3] * x[3];
  const double error = square + linear + quadric->c;
  return error > 0 ? error : 0;
}

bool qmat_quadric_minimise_centre(const qmat_quadric *quadric, double x[4]) {
  const double *a = quadric->a;
  const double least = 1e-9 * (a[0] + a[4] + a[7] + a[9]);
  if (!(least > 0) || !(a[0] > least)) return false;
  const double l10 = a[1] / a[0], l20 = a[2] / a[0];
  const double d1 = a[4] - l10 * a[1];
  if (!(d1 > least)) return false;
  const double u12 = a[5] - l10 * a[2], l21 = u12 / d1;
  const double d2 = a[7] - l20 * a[2] - l21 * u12;
  if (!(d2 > least)) return false;
  const double y0 = -0.5 * quadric->b[0] - a[3] * x[3];
  const double y1 = -0.5 * quadric->b[1] - a[6] * x[3] - l10 * y0;
  const double y2 = -0.5 * quadric->b[2] - a[8] * x[3] - l20 * y0 - l21 * y1;
  x[2] = y2 / d2;
  x[1] = y1 / d1 - l21 * x[2];
  x[0] = y0 / a[0] - l10 * x[1] - l20 * x[2];
  return true;
}

bool qmat_quadric_minimise(const qmat_quadric *quadric, double x[4]) {
  const double *a = quadric->a;
  const double least = 1e-9 * (a[0] + a[4] + a[7] + a[9]);
  if (!(least > 0)) return false;
  const double d0 = a[0];
  if (!(d0 > least)) return false;
  const double l10 = a[1] / d0, l20 = a[2] / d0, l30 = a[3] / d0;
  const double d1 = a[4] - l10 * a[1];
  if (!(d1 > least)) return false;
  const double u12 = a[5] - l10 * a[2], u13 = a[6] - l10 * a[3];
  const double l21 = u12 / d1, l31 = u13 / d1;
  const double d2 = a[7] - l20 * a[2] - l21 * u12;
  if (!(d2 > least)) return false;
  const double u23 = a[8] - l20 * a[3] - l21 * u13;
  const double l32 = u23 / d2;
  const double d3 = a[9] - l30 * a[3] - l31 * u13 - l32 * u23;
  if (!(d3 > least)) return false;
  const double y0 = -0.5 * quadric->b[0];
  const double y1 = -0.5 * quadric->b[1] - l10 * y0;
  const double y2 = -0.5 * quadric->b[2] - l20 * y0 - l21 * y1;
  const double y3 = -0.5 * quadric->b[3] - l30 * y0 - l31 * y1 - l32 * y2;
  x[3] = y3 / d3;
  x[2] = y2 / d2 - l32 * x[3];
  x[1] = y1 / d1 - l21 * x[2] - l31 * x[3];
  x[0] = y0 / d0 - l10 * x[1] - l20 * x[2] - l30 * x[3];
  return true;
}
