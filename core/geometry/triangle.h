/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_TRIANGLE_H
#define QMAT_CORE_GEOMETRY_TRIANGLE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "core/geometry/vector.h"

/* A triangle whose area is below this share of its longest edge squared is degenerate: its normal is rounding noise. */
#define QMAT_DEGENERATE_AREA 1e-12

/* Twice the area vector of the triangle abc (3 doubles each), right-handed. */
static inline void qmat_triangle_normal(const double a[3], const double b[3], const double c[3], double normal[3]) {
  double ab[3], ac[3];
  qmat_subtract(b, a, ab);
  qmat_subtract(c, a, ac);
  qmat_cross(ab, ac, normal);
}

/* The area of the triangle abc (3 doubles each) and its unit normal (3 doubles, right-handed; not NULL). A degenerate
 * triangle gives 0 and a zero normal. Points should be in a unit frame, since lengths are squared. */
static inline double qmat_triangle_area(const double a[3], const double b[3], const double c[3], double normal[3]) {
  double ab[3], ac[3], bc[3];
  qmat_subtract(b, a, ab);
  qmat_subtract(c, a, ac);
  qmat_subtract(c, b, bc);
  qmat_cross(ab, ac, normal);
  const double length = sqrt(qmat_dot(normal, normal));
  const double longest = fmax(fmax(qmat_dot(ab, ab), qmat_dot(ac, ac)), qmat_dot(bc, bc));
  const bool degenerate = !(length > 2 * QMAT_DEGENERATE_AREA * longest);
  for (int k = 0; k < 3; k++) normal[k] = degenerate ? 0 : normal[k] / length;
  return degenerate ? 0 : 0.5 * length;
}

/* How far along a segment the place that is closest to a point is: from 0 at `a` to 1 at `b`; 0 without length. */
static inline double qmat_closest_on_segment(const double point[3], const double a[3], const double b[3]) {
  double ab[3], ap[3];
  qmat_subtract(b, a, ab);
  qmat_subtract(point, a, ap);
  const double square = qmat_dot(ab, ab);
  return square > 0 ? qmat_smaller(qmat_larger(qmat_dot(ap, ab) / square, 0), 1) : 0;
}

/* Six times the volume of the tetrahedron between a triangle abc and a point `from` (3 doubles each): above 0 where the
 * triangle runs counter-clockwise, seen from the other side. */
static inline double qmat_triangle_six_volumes(const double a[3], const double b[3], const double c[3],
                                               const double from[3]) {
  double p[3], q[3], r[3], product[3];
  qmat_subtract(a, from, p);
  qmat_subtract(b, from, q);
  qmat_subtract(c, from, r);
  qmat_cross(q, r, product);
  return qmat_dot(p, product);
}

/* Whether a closed surface encloses more than rounding, by its volume and area. */
static inline bool qmat_encloses(double volume, double area) {
  return fabs(volume) > 1e-5 * area * sqrt(area);
}

/* atan2(*y, *x) is half the solid angle of a triangle abc as seen from a point `from` (3 doubles each): above 0 from
 * the triangle's back, below 0 from its front. `*y` is 0 in its plane. Source: van Oosterom, Strackee 1983. */
static inline void qmat_triangle_half_angle(const double a[3], const double b[3], const double c[3],
                                            const double from[3], double *y, double *x) {
  double p[3], q[3], r[3], product[3];
  qmat_subtract(a, from, p);
  qmat_subtract(b, from, q);
  qmat_subtract(c, from, r);
  qmat_cross(q, r, product);
  const double lp = sqrt(qmat_dot(p, p)), lq = sqrt(qmat_dot(q, q)), lr = sqrt(qmat_dot(r, r));
  *y = qmat_dot(p, product);
  *x = lp * lq * lr + qmat_dot(p, q) * lr + qmat_dot(q, r) * lp + qmat_dot(r, p) * lq;
}

/* The longest side of a triangle, from corner `base` to the next, and the height over it. */
typedef struct qmat_longest_side {
  int base;
  double length, height;
} qmat_longest_side;

/* The longest side of the triangle abc (3 doubles each); the first of equal ones. */
static inline qmat_longest_side qmat_triangle_longest_side(const double a[3], const double b[3], const double c[3]) {
  const double *corners[3] = {a, b, c};
  qmat_longest_side side = {0, 0, 0};
  for (int k = 0; k < 3; k++) {
    const double length = qmat_point_distance(corners[k], corners[(k + 1) % 3]);
    if (!(length > side.length)) continue;
    side.base = k;
    side.length = length;
  }
  if (!(side.length > 0)) return side;
  const double *p = corners[side.base], *q = corners[(side.base + 1) % 3], *top = corners[(side.base + 2) % 3];
  double along = 0, square = 0;
  for (int k = 0; k < 3; k++) {
    along += (q[k] - p[k]) * (top[k] - p[k]) / side.length;
    square += (top[k] - p[k]) * (top[k] - p[k]);
  }
  side.height = sqrt(fmax(square - along * along, 0));
  return side;
}

/* Halves a triangle at the middle of its longest side, the first of equal ones. `corners`, `low` and `high` are 3
 * points of 3 doubles, one after the other: the middle takes the place of the side's second end in `low`, and of its
 * first end in `high`. */
static inline void qmat_triangle_halve(const double *corners, double *low, double *high) {
  int a = 0;
  double longest = -1;
  for (int i = 0; i < 3; i++) {
    const double length = qmat_point_distance(&corners[3 * i], &corners[3 * ((i + 1) % 3)]);
    if (!(length > longest)) continue;
    longest = length;
    a = i;
  }
  const int b = (a + 1) % 3;
  memcpy(low, corners, 9 * sizeof *low);
  memcpy(high, corners, 9 * sizeof *high);
  for (int k = 0; k < 3; k++) low[3 * b + k] = high[3 * a + k] = 0.5 * (corners[3 * a + k] + corners[3 * b + k]);
}

/* The spacing of points inside a triangle of this height: a share of the height, but at least `spacing` and at most
 * 2.5 times that. Large plane facets need fewer points than others. */
static inline double qmat_triangle_spacing(double height, double share, double spacing) {
  return qmat_smaller(qmat_larger(share * height, spacing), 2.5 * spacing);
}

/* Divides a triangle at the middles of its sides. `corners`: 3 vertices; `middles`: the vertex between corners k and
 * k + 1, or UINT32_MAX where that side stays whole; `pieces` (12 numbers) gets 3 vertices a piece, oriented as the
 * triangle. Returns the number of pieces: one more than sides are halved. */
static inline size_t qmat_triangle_divide(const uint32_t corners[3], const uint32_t middles[3], uint32_t pieces[12]) {
  int halved = 0;
  for (int k = 0; k < 3; k++) halved += middles[k] != UINT32_MAX;
  /* Rotates the corners so that the halved sides come first. */
  size_t s = 0;
  if (halved == 1)
    while (middles[s] == UINT32_MAX) s++;
  if (halved == 2)
    while (middles[(s + 2) % 3] != UINT32_MAX) s++;
  const uint32_t a = corners[s], b = corners[(s + 1) % 3], c = corners[(s + 2) % 3];
  const uint32_t ab = middles[s], bc = middles[(s + 1) % 3], ca = middles[(s + 2) % 3];
  const uint32_t by_count[4][12] = {
      {a, b, c}, {a, ab, c, ab, b, c}, {ab, b, bc, a, ab, bc, a, bc, c}, {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca}};
  memcpy(pieces, by_count[halved], sizeof by_count[halved]);
  return (size_t)halved + 1;
}

#endif
