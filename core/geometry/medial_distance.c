/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/medial_distance.h"

#include <math.h>
#include <stddef.h>

#include "core/geometry/vector.h"

/* A triangle flatter than this (height over longest side) is treated as the union of its cones. Every point between
 * them is within twice the height of one of them, which is below the resolution of double precision. */
#define FLAT 1e-13

/* A bound that exceeds a distance by this does so in spite of rounding. */
#define SURE 1e-12

static double clamp(double x, double high) {
  x = x > 0 ? x : 0;
  return x < high ? x : high;
}

/* sqrt(1 - x^2) without cancellation. */
static double cosine(double x) {
  return sqrt((1 - x) * (1 + x));
}

void qmat_cone_prepare(qmat_cone *cone, const double a[4], const double b[4]) {
  double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  double length = sqrt(qmat_dot(d, d)), growth = b[3] - a[3];
  if (!(length > fabs(growth)) || !(fabs(growth / length) < 1)) {
    const double *larger = growth > 0 ? b : a;
    *cone = (qmat_cone){.origin = {larger[0], larger[1], larger[2]}, .radius = larger[3], .only = growth > 0 ? 2 : 1};
    return;
  }
  double slope = growth / length;
  *cone = (qmat_cone){.origin = {a[0], a[1], a[2]},
                      .axis = {d[0] / length, d[1] / length, d[2] / length},
                      .length = length,
                      .radius = a[3],
                      .slope = slope,
                      .lean = slope / cosine(slope),
                      .inverse = 1 / length};
}

/* The distance, and the position of the nearest sphere along the axis. */
static inline double cone_at(const qmat_cone *cone, const double point[3], double *along) {
  double w[3] = {point[0] - cone->origin[0], point[1] - cone->origin[1], point[2] - cone->origin[2]};
  double axial = qmat_dot(w, cone->axis);
  /* The radial part is computed as a vector: |w|^2 - axial^2 would lose half the digits near the axis. */
  for (int k = 0; k < 3; k++) w[k] -= axial * cone->axis[k];
  double radial2 = qmat_dot(w, w);
  double t = clamp(axial + sqrt(radial2) * cone->lean, cone->length);
  *along = t;
  return sqrt((axial - t) * (axial - t) + radial2) - cone->radius - cone->slope * t;
}

double qmat_cone_prepared_distance(const qmat_cone *cone, const double point[3]) {
  double along;
  return cone_at(cone, point, &along);
}

double qmat_cone_foot(const qmat_cone *cone, const double point[3], double weights[2]) {
  double along, distance = cone_at(cone, point, &along);
  double second = cone->only ? cone->only == 2 : fmin(along * cone->inverse, 1);
  weights[0] = 1 - second;
  weights[1] = second;
  return distance;
}

static void edge_prepare(qmat_slab_edge *edge, const double a[2], double ra, const double b[2], double rb) {
  double d[2] = {b[0] - a[0], b[1] - a[1]}, length = sqrt(d[0] * d[0] + d[1] * d[1]), growth = rb - ra;
  if (!(length > fabs(growth)) || !(fabs(growth / length) < 1)) {
    bool second = growth > 0;
    *edge = (qmat_slab_edge){.origin = {second ? b[0] : a[0], second ? b[1] : a[1]},
                             .axis = {1, 0},
                             .radius = second ? rb : ra,
                             .only = second ? 2 : 1};
    return;
  }
  double slope = growth / length;
  *edge = (qmat_slab_edge){.origin = {a[0], a[1]},
                           .axis = {d[0] / length, d[1] / length},
                           .length = length,
                           .radius = ra,
                           .slope = slope,
                           .lean = slope / cosine(slope)};
}

/* A unit vector perpendicular to the unit vector u. */
static void any_perpendicular(const double u[3], double v[3]) {
  int k = fabs(u[0]) <= fabs(u[1]) ? (fabs(u[0]) <= fabs(u[2]) ? 0 : 2) : (fabs(u[1]) <= fabs(u[2]) ? 1 : 2);
  for (int i = 0; i < 3; i++) v[i] = (i == k) - u[k] * u[i];
  qmat_normalize(v);
}

void qmat_slab_prepare(qmat_slab *slab, const double a[4], const double b[4], const double c[4]) {
  const double *given[3] = {a, b, c};
  double longest = -1;
  int first = 0;
  for (int i = 0; i < 3; i++) {
    const double *p = given[i], *q = given[(i + 1) % 3];
    double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, length2 = qmat_dot(d, d);
    if (length2 > longest) {
      longest = length2;
      first = i;
    }
  }
  const double *s[3] = {given[first], given[(first + 1) % 3], given[(first + 2) % 3]};
  *slab =
      (qmat_slab){.origin = {s[0][0], s[0][1], s[0][2]},
                  .radius = s[0][3],
                  .order = {(unsigned char)first, (unsigned char)((first + 1) % 3), (unsigned char)((first + 2) % 3)}};
  double side = sqrt(longest), w[3], *u = slab->u, *v = slab->v, *n = slab->normal;
  for (int k = 0; k < 3; k++) u[k] = side > 0 ? (s[1][k] - s[0][k]) / side : k == 0;
  for (int k = 0; k < 3; k++) w[k] = s[2][k] - s[0][k];
  slab->third = qmat_dot(w, u);
  for (int k = 0; k < 3; k++) v[k] = w[k] - slab->third * u[k];
  double height = sqrt(qmat_dot(v, v));
  if (height > FLAT * side) {
    /* For a sliver, rounding leaves a component of u in v: orthogonalise again. */
    for (int k = 0; k < 3; k++) v[k] /= height;
    double rest = qmat_dot(v, u);
    for (int k = 0; k < 3; k++) v[k] -= rest * u[k];
    qmat_normalize(v);
  } else {
    any_perpendicular(u, v);
    height = 0;
  }
  qmat_cross(u, v, n);

  const double at[3][2] = {{0, 0}, {side, 0}, {slab->third, height}};
  for (int i = 0; i < 3; i++) {
    int p = (i + 1) % 3, q = (i + 2) % 3;
    edge_prepare(&slab->edges[i], at[p], s[p][3], at[q], s[q][3]);
  }
  if (height > 0) {
    double *g = slab->gradient;
    g[0] = (s[1][3] - s[0][3]) / side;
    g[1] = (s[2][3] - s[0][3] - g[0] * slab->third) / height;
    double steepness = sqrt(g[0] * g[0] + g[1] * g[1]);
    if (steepness < 1) {
      slab->solid = true;
      slab->rise = cosine(steepness);
      for (int k = 0; k < 2; k++) slab->lean[k] = g[k] / slab->rise;
      slab->inverse_side = 1 / side;
      slab->inverse_height = 1 / height;
    }
  }
}

static inline double edge_at(const qmat_slab_edge *edge, double u, double v, double z2, double *along) {
  double du = u - edge->origin[0], dv = v - edge->origin[1];
  double axial = du * edge->axis[0] + dv * edge->axis[1], across = dv * edge->axis[0] - du * edge->axis[1];
  double radial2 = across * across + z2;
  double t = clamp(axial + sqrt(radial2) * edge->lean, edge->length);
  *along = t;
  return sqrt((axial - t) * (axial - t) + radial2) - edge->radius - edge->slope * t;
}

/* The distance. `part` is the edge that attains it, and at[0] the position along that edge; or 3 for the tangent
 * planes, and `at` the weights of own corners 1 and 2. f is convex: when its unconstrained minimum is outside the
 * triangle, the constrained one is on an edge that faces it, so at most two edges are tested. None is where the
 * unconstrained one is surely above `enough` already: that is returned. */
static inline double slab_at(const qmat_slab *slab, const double point[3], double enough, int *part, double at[2]) {
  double w[3] = {point[0] - slab->origin[0], point[1] - slab->origin[1], point[2] - slab->origin[2]};
  double u = qmat_dot(w, slab->u), v = qmat_dot(w, slab->v), z = fabs(qmat_dot(w, slab->normal));
  unsigned faces = 7;
  if (slab->solid) {
    double b2 = (v + slab->lean[1] * z) * slab->inverse_height;
    double b1 = (u + slab->lean[0] * z - b2 * slab->third) * slab->inverse_side;
    faces = (unsigned)(b1 + b2 > 1) | (unsigned)(b1 < 0) << 1 | (unsigned)(b2 < 0) << 2;
    const double least = z * slab->rise - slab->radius - slab->gradient[0] * u - slab->gradient[1] * v;
    if (!faces || least > enough + SURE) {
      *part = 3;
      at[0] = b1;
      at[1] = b2;
      return least;
    }
  }
  double best = INFINITY;
  for (int i = 0; i < 3; i++) {
    if (!(faces >> i & 1)) continue;
    double along, d = edge_at(&slab->edges[i], u, v, z * z, &along);
    if (d < best) {
      best = d;
      *part = i;
      at[0] = along;
    }
  }
  return best;
}

double qmat_slab_prepared_distance(const qmat_slab *slab, const double point[3]) {
  int part;
  double at[2];
  return slab_at(slab, point, INFINITY, &part, at);
}

double qmat_slab_foot_below(const qmat_slab *slab, const double point[3], double best, double weights[3]) {
  int part = 3;
  double at[2] = {0, 0}, own[3] = {0, 0, 0}, distance = slab_at(slab, point, best, &part, at);
  if (distance > best) return distance;
  if (part == 3) {
    own[1] = at[0];
    own[2] = at[1];
    own[0] = fmax(1 - at[0] - at[1], 0);
  } else {
    const qmat_slab_edge *edge = &slab->edges[part];
    int first = (part + 1) % 3, second = (part + 2) % 3;
    if (edge->length > 0) {
      own[second] = fmin(at[0] / edge->length, 1);
      own[first] = 1 - own[second];
    } else {
      own[edge->only == 2 ? second : first] = 1;
    }
  }
  for (int i = 0; i < 3; i++) weights[slab->order[i]] = own[i];
  return distance;
}

double qmat_slab_foot(const qmat_slab *slab, const double point[3], double weights[3]) {
  return qmat_slab_foot_below(slab, point, INFINITY, weights);
}
