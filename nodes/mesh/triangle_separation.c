/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/triangle_separation.h"

#include <float.h>
#include <math.h>

#include "core/geometry/vector.h"

/* Two triangles, as offsets from the first corner of `a`. The corners from `first` on are not shared. */
typedef struct triangle_pair {
  double a[3][3], b[3][3];
  int first;
} triangle_pair;

/* Whether a plane at right angles to the direction separates the corners that are not shared, and has a shared corner
 * between them. A height is rounded four times: in the offset, in the product and in two sums. So it is off by at most
 * two epsilons of the sum of its products, or by a product that underflows. */
static bool plane_separates(const triangle_pair *p, const double direction[3]) {
  double above = INFINITY, below = -INFINITY; /* the lowest of a, the highest of b */
  for (int i = p->first; i < 3; i++) {
    double size_a = 0, size_b = 0;
    for (int k = 0; k < 3; k++) {
      size_a += fabs(direction[k] * p->a[i][k]);
      size_b += fabs(direction[k] * p->b[i][k]);
    }
    above = qmat_smaller(above, qmat_dot(direction, p->a[i]) - (4 * DBL_EPSILON * size_a + DBL_MIN));
    below = qmat_larger(below, qmat_dot(direction, p->b[i]) + (4 * DBL_EPSILON * size_b + DBL_MIN));
  }
  return p->first > 0 ? above > 0 && below < 0 : above > below;
}

static bool centre_separates(const triangle_pair *p) {
  double direction[3];
  for (int k = 0; k < 3; k++)
    direction[k] = p->a[0][k] + p->a[1][k] + p->a[2][k] - p->b[0][k] - p->b[1][k] - p->b[2][k];
  return plane_separates(p, direction);
}

/* Planes along an edge of `a` or of `b`, at right angles to that triangle. */
static bool edge_separates(const triangle_pair *p, bool is_edge_of_a) {
  double sides[3][3], normal[3];
  for (int i = 0; i < 3; i++) {
    if (is_edge_of_a) qmat_subtract(p->a[(i + 1) % 3], p->a[i], sides[i]);
    if (!is_edge_of_a) qmat_subtract(p->b[i], p->b[(i + 1) % 3], sides[i]);
  }
  qmat_cross(sides[0], sides[1], normal);
  for (int i = 0; i < 3; i++) {
    double direction[3];
    qmat_cross(normal, sides[i], direction);
    if (plane_separates(p, direction)) return true;
  }
  return false;
}

/* Planes between two edges at the shared corner that have the same angle to both. */
static bool bisector_separates(const triangle_pair *p) {
  double a[2][3], b[2][3];
  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 3; k++) {
      a[i][k] = p->a[i + 1][k] / sqrt(qmat_dot(p->a[i + 1], p->a[i + 1]));
      b[i][k] = p->b[i + 1][k] / sqrt(qmat_dot(p->b[i + 1], p->b[i + 1]));
    }
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++) {
      double direction[3];
      qmat_subtract(a[i], b[j], direction);
      if (plane_separates(p, direction)) return true;
    }
  return false;
}

/* Whether the triangles turn to different sides of their edge: their vector products from it have a negative scalar
 * product. It is a sum of six terms of four factors, each rounded a dozen times. */
static bool turn_apart(const triangle_pair *p) {
  const double *edge = p->a[1], *a = p->a[2], *b = p->b[2];
  const double squared = qmat_dot(edge, edge);
  const double product = squared * qmat_dot(a, b) - qmat_dot(edge, a) * qmat_dot(edge, b);
  return product < -32 * DBL_EPSILON * squared * sqrt(qmat_dot(a, a) * qmat_dot(b, b)) - DBL_MIN;
}

bool qmat_triangles_are_separate(const double *const a[3], const double *const b[3], int shared) {
  triangle_pair p = {.first = shared};
  for (int i = 0; i < 3; i++) {
    qmat_subtract(a[i], a[0], p.a[i]);
    qmat_subtract(b[i], a[0], p.b[i]);
  }
  if (shared == 2) return turn_apart(&p);
  if (shared == 1) return bisector_separates(&p);
  return centre_separates(&p) || edge_separates(&p, true) || edge_separates(&p, false);
}
