/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_CIRCUMSPHERE_H
#define QMAT_NODES_INITIAL_CIRCUMSPHERE_H

#include <stdbool.h>

#include "core/geometry/vector.h"

/* The circumsphere of a tetrahedron with the corners p (centre, radius); false if it is degenerate, or its centre has a
 * coordinate beyond `limit`. `sphere` (4 doubles) is then undefined. */
static inline bool qmat_circumsphere(const double *const p[4], double limit, double *sphere) {
  double e[3][3], square[3], normal[3][3];
  for (int k = 0; k < 3; k++) {
    qmat_subtract(p[k + 1], p[0], e[k]);
    square[k] = qmat_dot(e[k], e[k]);
  }
  for (int k = 0; k < 3; k++) qmat_cross(e[(k + 1) % 3], e[(k + 2) % 3], normal[k]);
  const double determinant = qmat_dot(e[0], normal[0]);
  if (determinant == 0) return false;
  double offset[3];
  for (int i = 0; i < 3; i++) {
    offset[i] = (square[0] * normal[0][i] + square[1] * normal[1][i] + square[2] * normal[2][i]) / (2 * determinant);
    sphere[i] = p[0][i] + offset[i];
    if (!(fabs(sphere[i]) <= limit)) return false; /* or not finite */
  }
  sphere[3] = sqrt(qmat_dot(offset, offset));
  return true;
}

#endif
