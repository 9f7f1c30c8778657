/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_MEDIAL_DISTANCES_H
#define QMAT_TESTS_MEDIAL_DISTANCES_H

/* Signed distances to single medial primitives, by which tests check those to many. */

#include "core/geometry/medial_distance.h"

/* The signed distance to the cone of two spheres; their order does not matter, up to rounding. */
static inline double cone_distance(const double a[4], const double b[4], const double point[3]) {
  qmat_cone cone;
  qmat_cone_prepare(&cone, a, b);
  return qmat_cone_prepared_distance(&cone, point);
}

/* The signed distance to the slab of three spheres; their order does not matter, up to rounding. */
static inline double slab_distance(const double a[4], const double b[4], const double c[4], const double point[3]) {
  qmat_slab slab;
  qmat_slab_prepare(&slab, a, b, c);
  return qmat_slab_prepared_distance(&slab, point);
}

#endif
