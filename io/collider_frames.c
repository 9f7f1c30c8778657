/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/collider_frames.h"

#include <math.h>

#include "core/geometry/vector.h"
#include "io/placement.h"

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

void qmat_principal_inertia(const double body[10], double moments[3], double rotation[4]) {
  double a[3][3] = {{body[4], body[7], body[8]}, {body[7], body[5], body[9]}, {body[8], body[9], body[6]}};
  double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
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
          const double pk = a[p][k], qk = a[q][k], ap = axes[p][k], aq = axes[q][k];
          a[p][k] = c * pk - s * qk;
          a[q][k] = s * pk + c * qk;
          axes[p][k] = c * ap - s * aq;
          axes[q][k] = s * ap + c * aq;
        }
      }
  for (int k = 0; k < 3; k++) moments[k] = a[k][k];
  qmat_placement_quaternion(axes, rotation); /* Jacobi rotations keep the determinant 1 */
}

/* Scales an axis to length 1; one of zeros becomes axis `k` of space. */
static void make_unit(double axis[3], int k) {
  if (qmat_dot(axis, axis) > 0) {
    qmat_normalize(axis);
  } else {
    for (int i = 0; i < 3; i++) axis[i] = i == k;
  }
}

void qmat_rotation_in(double linear[3][3], double rotation[3][3]) {
  double axes[3][3];
  const double sign = qmat_determinant(linear) < 0 ? -1 : 1;
  for (int k = 0; k < 3; k++) {
    axes[0][k] = sign * linear[k][0];
    axes[1][k] = linear[k][1];
  }
  make_unit(axes[0], 0);
  const double along = qmat_dot(axes[0], axes[1]);
  for (int k = 0; k < 3; k++) axes[1][k] -= along * axes[0][k];
  make_unit(axes[1], 1);
  qmat_cross(axes[0], axes[1], axes[2]);
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) rotation[r][c] = axes[c][r];
}

void qmat_placed_body(const double body[10], double linear[3][3], double rotation[3][3], double scale,
                      double made[10]) {
  static const int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  const double share = scale > 0 ? fabs(qmat_determinant(linear)) / (scale * scale * scale) : 1;
  const double half = 0.5 * (body[4] + body[5] + body[6]);
  double stretch[3][3], moments[3][3], turned[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) turned[i][j] = rotation[j][i];
  qmat_multiply(turned, linear, stretch);
  for (int m = 0; m < 6; m++) {
    const int i = pairs[m][0], j = pairs[m][1];
    moments[i][j] = moments[j][i] = share * ((m < 3 ? half : 0) - body[4 + m]);
  }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) turned[i][j] = stretch[j][i];
  qmat_multiply(stretch, moments, moments);
  qmat_multiply(moments, turned, moments);
  made[0] = share * body[0];
  for (int k = 1; k < 4; k++) made[k] = body[k];
  const double trace = moments[0][0] + moments[1][1] + moments[2][2];
  for (int m = 0; m < 6; m++) made[4 + m] = (m < 3 ? trace : 0) - moments[pairs[m][0]][pairs[m][1]];
}
