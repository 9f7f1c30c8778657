/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_QUADRIC_H
#define QMAT_CORE_GEOMETRY_QUADRIC_H

#include <stdbool.h>

/* The slab quadratic error of a medial sphere x = (centre, radius): x'Ax + b'x + c, a weighted sum of squared distances
 * to tangent planes (eq. 1-3). A zeroed quadric is 0 everywhere. */
typedef struct qmat_quadric {
  double a[10]; /* the upper triangle of A by rows: 00 01 02 03 11 12 13 22 23 33 */
  double b[4];
  double c;
} qmat_quadric;

/* Adds weight * (n . (x - m) + x.r - m.r)^2. For a unit vector `n` this is the weighted squared distance of x to the
 * plane tangent to the medial sphere `m` (4 doubles) with the outward normal `n`. `n` may have any length. */
void qmat_quadric_add_plane(qmat_quadric *quadric, const double n[3], const double m[4], double weight);

/* The outward unit normals of the two planes tangent to three spheres (4 doubles each). False when there are no two
 * such planes: the centres are collinear, or one sphere lies inside the hull of the others. */
bool qmat_tangent_normals(const double a[4], const double b[4], const double c[4], double normals[2][3]);

/* Adds both tangent planes of the slab of three spheres (eq. 2), each with `weight`. Adds nothing and returns false
 * when the spheres have no two common tangent planes. */
bool qmat_quadric_add_slab(qmat_quadric *quadric, const double a[4], const double b[4], const double c[4],
                           double weight);

/* Adds weight times the squared distance to the tangent planes of a cone, averaged over the rotation about its axis, in
 * closed form. Adds nothing and returns false when one sphere contains the other. */
bool qmat_quadric_add_cone(qmat_quadric *quadric, const double a[4], const double b[4], double weight);

/* Adds another quadric: the error becomes the sum of both. */
void qmat_quadric_add(qmat_quadric *quadric, const qmat_quadric *other);

/* The error of sphere `x`, at least 0. */
double qmat_quadric_error(const qmat_quadric *quadric, const double x[4]);

/* The sphere of least error. False when A is singular: a pivot of its LDL' factorisation is below 1e-9 of its trace;
 * `x` is then unchanged. */
bool qmat_quadric_minimise(const qmat_quadric *quadric, double x[4]);

/* The same for the given radius x[3]: only the centre is found, and is unchanged where the result is false. */
bool qmat_quadric_minimise_centre(const qmat_quadric *quadric, double x[4]);

#endif
