/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MEDIAL_PRIMITIVE_H
#define QMAT_CORE_GEOMETRY_MEDIAL_PRIMITIVE_H

#include <stdbool.h>

#include "core/geometry/medial_distance.h"
#include "core/geometry/vector.h"

/* A medial cone or slab, prepared for distances. */
typedef struct qmat_primitive {
  union {
    qmat_slab slab;
    qmat_cone cone;
  };
  bool is_slab;
} qmat_primitive;

/* A ball that contains a primitive. */
typedef struct qmat_primitive_ball {
  double centre[3], radius;
} qmat_primitive_ball;

/* Prepares the cone of two spheres, or the slab of three (4 doubles each), and its ball. */
static inline void qmat_primitive_prepare(const double *const spheres[], int count, qmat_primitive *primitive,
                                          qmat_primitive_ball *ball) {
  for (int k = 0; k < 3; k++) {
    ball->centre[k] = 0;
    for (int c = 0; c < count; c++) ball->centre[k] += spheres[c][k] / count;
  }
  ball->radius = 0;
  for (int c = 0; c < count; c++)
    ball->radius = qmat_larger(ball->radius, qmat_point_distance(ball->centre, spheres[c]) + spheres[c][3]);
  primitive->is_slab = count == 3;
  if (primitive->is_slab)
    qmat_slab_prepare(&primitive->slab, spheres[0], spheres[1], spheres[2]);
  else
    qmat_cone_prepare(&primitive->cone, spheres[0], spheres[1]);
}

/* Whether the whole ball is farther than `best` from `point` (3 doubles). */
static inline bool qmat_primitive_is_farther(const qmat_primitive_ball *ball, const double *point, double best) {
  double square = 0;
  for (int k = 0; k < 3; k++) square += (point[k] - ball->centre[k]) * (point[k] - ball->centre[k]);
  const double reach = best + ball->radius;
  return reach < 0 || square > reach * reach;
}

/* The signed distance from `point` to a primitive, and the weights (3 doubles) of its spheres at the foot; the third is
 * 0 for a cone. */
static inline double qmat_primitive_foot(const qmat_primitive *primitive, const double *point, double weights[3]) {
  if (primitive->is_slab) return qmat_slab_foot(&primitive->slab, point, weights);
  weights[2] = 0;
  return qmat_cone_foot(&primitive->cone, point, weights);
}

/* The same where the distance is at most `best`; else some distance that is more, which takes less time. */
static inline double qmat_primitive_foot_below(const qmat_primitive *primitive, const double *point, double best,
                                               double weights[3]) {
  if (primitive->is_slab) return qmat_slab_foot_below(&primitive->slab, point, best, weights);
  weights[2] = 0;
  return qmat_cone_foot(&primitive->cone, point, weights);
}

#endif
