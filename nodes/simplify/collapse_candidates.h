/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COLLAPSE_CANDIDATES_H
#define QMAT_NODES_SIMPLIFY_COLLAPSE_CANDIDATES_H

#include "core/geometry/medial_complex.h"
#include "core/geometry/quadric.h"

enum { QMAT_MOST_CANDIDATES = 4 };

/* Spheres that an edge may collapse to, in the order of their errors. */
typedef struct qmat_candidates {
  double spheres[QMAT_MOST_CANDIDATES][4], errors[QMAT_MOST_CANDIDATES];
  int count;
} qmat_candidates;

/* The sum of the quadrics (one per vertex) of the ends of an edge. */
qmat_quadric qmat_merged_quadric(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge);

/* Inserts a sphere by its error; equal errors keep their order. There are at most QMAT_MOST_CANDIDATES. */
void qmat_candidates_insert(qmat_candidates *candidates, const double sphere[4], double error);
/* The same with its slab quadratic error. */
void qmat_candidates_add(qmat_candidates *candidates, const qmat_quadric *quadric, const double sphere[4]);

/* The candidates of an edge: both ends, the middle, and the sphere of least error (section 3.1.2). The last is left out
 * if it does not exist, its radius is not positive, or it lies too far from the edge, as in nearly flat directions. */
void qmat_candidates_find(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                          qmat_candidates *candidates);

/* The same for an edge of a sheet: all spheres keep the radius of its ends. */
void qmat_candidates_find_on_sheet(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                                   qmat_candidates *candidates);

/* The candidate of the public Q-MAT code: the sphere of least error, inside the model or not; the middle where its
 * radius is negative or it is more than a diagonal away. Without a sphere of least error: the best of both ends and the
 * middle, or the middle for an edge without slabs. */
void qmat_candidates_find_published(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                                    qmat_candidates *candidates);

/* The larger end alone (Faraj et al. 2013); the first of equals. */
void qmat_candidates_find_larger(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                                 qmat_candidates *candidates);

#endif
