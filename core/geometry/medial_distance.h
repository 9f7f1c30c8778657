/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_MEDIAL_DISTANCE_H
#define QMAT_CORE_GEOMETRY_MEDIAL_DISTANCE_H

#include <stdbool.h>

#include "core/geometry/vector.h"

/* Signed distances to medial primitives (paper section 3.1.1; eq. 9 takes their minimum). A primitive is the union of
 * the spheres (c(x), r(x)) that interpolate its corners linearly over a simplex, and
 *
 *   f(p) = min over x of |p - c(x)| - r(x)
 *
 * is positive outside, where it is exactly the distance to the primitive. Inside it is negative, and -f is a lower
 * bound of the depth. f is convex and 1-Lipschitz. A sphere is 4 doubles (centre, radius >= 0), a point 3 doubles, all
 * in one unit. Degenerate cases are exact up to rounding: coincident centres, spheres inside others, collinear centres,
 * radii that grow faster than the distance between centres. Nothing here allocates or keeps state. Safe from any
 * thread. */

/* A medial cone prepared for many points. When one end sphere contains the other, length is 0 and only the larger end
 * counts. */
typedef struct qmat_cone {
  double origin[3]; /* centre of the first end, or of the only end that counts */
  double axis[3];   /* unit vector to the second end; 0 when only one counts */
  double length;    /* between the centres */
  double radius;    /* at the origin */
  double slope;     /* growth of the radius per length; |slope| < 1 */
  double lean;      /* slope / sqrt(1 - slope^2): shift along the axis of the nearest sphere, per radial distance */
  double inverse;   /* 1 / length, 0 for length 0 */
  int only;         /* 0: both ends count; 1 or 2: only the first or the second */
} qmat_cone;

/* One edge of a slab in the coordinates of the slab's plane; members as in qmat_cone. */
typedef struct qmat_slab_edge {
  double origin[2], axis[2], length, radius, slope, lean;
  int only;
} qmat_slab_edge;

/* A medial slab prepared for many points. Edge i is opposite corner i. The slab has its own order of corners, which
 * starts with the longest side: own corner i is the caller's corner order[i]. */
typedef struct qmat_slab {
  double origin[3];             /* centre of own corner 0 */
  double u[3], v[3], normal[3]; /* orthonormal; u along the longest side, v towards own corner 2 */
  double gradient[2];           /* of the radius over the plane */
  double lean[2];               /* gradient / sqrt(1 - |gradient|^2) */
  double rise;                  /* sqrt(1 - |gradient|^2) */
  double radius;                /* of own corner 0 */
  double third;                 /* own corner 2 is (third, height) in the plane */
  double inverse_side, inverse_height;
  qmat_slab_edge edges[3];
  unsigned char order[3];
  bool solid; /* has tangent planes: not collinear, and the gradient is below 1. Otherwise only the edges count. */
} qmat_slab;

/* |p - c| - r. */
static inline double qmat_sphere_distance(const double sphere[4], const double point[3]) {
  const double d[3] = {point[0] - sphere[0], point[1] - sphere[1], point[2] - sphere[2]};
  return sqrt(qmat_dot(d, d)) - sphere[3];
}

/* Fills `cone` from its two end spheres. */
void qmat_cone_prepare(qmat_cone *cone, const double a[4], const double b[4]);
/* The signed distance of a point to the cone. The order of the ends does not matter, up to rounding. */
double qmat_cone_prepared_distance(const qmat_cone *cone, const double point[3]);
/* The same distance, and the weights of the two ends (sum 1) at the medial point that attains it. */
double qmat_cone_foot(const qmat_cone *cone, const double point[3], double weights[2]);

/* Fills `slab` from its three corner spheres. */
void qmat_slab_prepare(qmat_slab *slab, const double a[4], const double b[4], const double c[4]);
/* The signed distance of a point to the slab. The order of the corners does not matter, up to rounding. */
double qmat_slab_prepared_distance(const qmat_slab *slab, const double point[3]);
/* The same distance, and the weights of the corners a, b, c (sum 1) at the medial point that attains it. */
double qmat_slab_foot(const qmat_slab *slab, const double point[3], double weights[3]);
/* The same where the distance is at most `best`; else some distance that is more, and no weights. Points that are
 * far from the slab's tangent planes are decided by these. In the unit frame. */
double qmat_slab_foot_below(const qmat_slab *slab, const double point[3], double best, double weights[3]);

#endif
