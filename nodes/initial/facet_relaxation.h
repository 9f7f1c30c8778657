/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_FACET_RELAXATION_H
#define QMAT_NODES_INITIAL_FACET_RELAXATION_H

#include <stddef.h>
#include <stdint.h>

#define QMAT_MOST_FACET_SAMPLES 64

/* Both numbers select the random points that the relaxation starts from. */
typedef struct qmat_facet_relaxation_seed {
  uint64_t value;
  uint32_t facet;
} qmat_facet_relaxation_seed;

/* Spreads `count` (1 to QMAT_MOST_FACET_SAMPLES) samples over the triangle abc (3 doubles each, not degenerate), and
 * writes their barycentrics (3 each). One sample lies at the centroid. Several start at random, and each round of
 * Lloyd's relaxation moves them to the centroids of their cells in the bounded Voronoi diagram (section 3.2; Tournois
 * et al. 2010), in which the corners are fixed sites. Cost: rounds * count^2. */
void qmat_facet_relaxation(const double *a, const double *b, const double *c, qmat_facet_relaxation_seed seed,
                           int64_t rounds, size_t count, double *barycentrics);

#endif
