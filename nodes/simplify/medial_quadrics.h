/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_MEDIAL_QUADRICS_H
#define QMAT_NODES_SIMPLIFY_MEDIAL_QUADRICS_H

#include "core/geometry/medial_complex.h"
#include "core/geometry/quadric.h"

/* The stability ratio of a medial edge between two spheres (4 doubles each): 0 for a pure spike, 1 for equal radii
 * (section 3.1.2, eq. 5). */
double qmat_stability_ratio(const double a[4], const double b[4]);

/* Adds to the quadric of each vertex (`quadrics`, one per vertex of the complex) its medial slabs (eq. 2), the cones of
 * its edges without slabs, and its boundary: planes that keep rims and tips in place, each added once, with a small
 * part of a slab's weight (section 3.1.2, boundary preservation). Cost: linear. */
void qmat_medial_quadrics_add(const qmat_complex *complex, qmat_quadric *quadrics);

/* The same for compat=qmat, as in the public Q-MAT code: the same slabs, and its fourth method of boundary
 * preservation. The plane of a rim is at right angles to its triangle, with a normal as long as the edge. An edge
 * without slabs gets two tangent planes of a slab with a third sphere at the sum of both centres, which depends on the
 * origin, and two planes across them. The normal of a tip is as long as its edge. */
void qmat_medial_quadrics_add_published(const qmat_complex *complex, qmat_quadric *quadrics);

#endif
