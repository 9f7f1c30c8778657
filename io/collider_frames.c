/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/collider_frames.h"

#include <math.h>

#include "core/geometry/vector.h"

int qmat_collider_width(const uint32_t shape[3]) {
  return shape[1] == shape[0] ? 1 : shape[2] == shape[1] ? 2 : 3;
}

static void normalise(double q[4]) {
  const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int k = 0; k < 4; k++) q[k] /= length;
}

void qmat_capsule_frame(const double first[4], const double second[4], double middle[3], double *length,
                        double rotation[4]) {
  double axis[3];
  for (int k = 0; k < 3; k++) middle[k] = 0.5 * (first[k] + second[k]);
  qmat_subtract(second, first, axis);
  *length = sqrt(qmat_dot(axis, axis));
  for (int k = 0; k < 3; k++) axis[k] = *length > 0 ? axis[k] / *length : k == 1;
  if (axis[1] < -1 + 1e-12) { /* half a turn about x */
    rotation[0] = 1;
    rotation[1] = rotation[2] = rotation[3] = 0;
    return;
  }
  rotation[0] = axis[2]; /* y cross axis, and 1 + y . axis */
  rotation[1] = 0;
  rotation[2] = -axis[0];
  rotation[3] = 1 + axis[1];
  normalise(rotation);
}

/* The quaternion of a rotation matrix, by its largest component. */
static void quaternion_of(double m[3][3], double q[4]) {
  const double trace = m[0][0] + m[1][1] + m[2][2];
  int largest = 3;
  for (int k = 0; k < 3; k++)
    if (m[k][k] > (largest == 3 ? trace : m[largest][largest])) largest = k;
  if (largest == 3) {
    q[0] = m[2][1] - m[1][2];
    q[1] = m[0][2] - m[2][0];
    q[2] = m[1][0] - m[0][1];
    q[3] = 1 + trace;
  } else {
    const int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    q[i] = 1 + m[i][i] - m[j][j] - m[k][k];
    q[j] = m[j][i] + m[i][j];
    q[k] = m[k][i] + m[i][k];
    q[3] = m[k][j] - m[j][k];
  }
  normalise(q);
}

void qmat_principal_inertia(const double body[10], double moments[3], double rotation[4]) {
  double a[3][3] = {{body[4], body[7], body[8]}, {body[7], body[5], body[9]}, {body[8], body[9], body[6]}};
  double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; /* columns */
  for (int sweep = 0; sweep < 32; sweep++)
    for (int p = 0; p < 2; p++)
      for (int q = p + 1; q < 3; q++) {
        if (fabs(a[p][q]) <= 1e-16 * (fabs(a[p][p]) + fabs(a[q][q]))) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
        const double c = 1 / sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; k++) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq;
          a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; k++) {
          const double pk = a[p][k], qk = a[q][k], ap = axes[k][p], aq = axes[k][q];
          a[p][k] = c * pk - s * qk;
          a[q][k] = s * pk + c * qk;
          axes[k][p] = c * ap - s * aq;
          axes[k][q] = s * ap + c * aq;
        }
      }
  for (int k = 0; k < 3; k++) moments[k] = a[k][k];
  quaternion_of(axes, rotation); /* Jacobi rotations keep the determinant 1 */
}
