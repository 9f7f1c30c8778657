/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_RANDOM_COLLAPSE_H
#define QMAT_TESTS_RANDOM_COLLAPSE_H

/* Random collapses of a medial mesh, as the passes of medial.simplify try them. */

#include <math.h>

#include "core/geometry/medial_complex.h"
#include "tests/random.h"

/* The complex must have a live edge. */
static inline uint32_t random_live_edge(random_numbers *random, const qmat_complex *complex) {
  for (;;) {
    const size_t e = random_index(random, complex->edge_count);
    if (complex->edge_alive[e]) return (uint32_t)e;
  }
}

/* A live edge, and the sphere that it may collapse to: an end, or one between them, one of whose numbers is off by up
 * to `most_off` one time in four. */
static inline uint32_t random_collapse(random_numbers *random, const qmat_complex *complex, double most_off,
                                       double sphere[4]) {
  const uint32_t edge = random_live_edge(random, complex);
  const uint32_t *ends = &complex->edges[2 * (size_t)edge];
  const double *a = &complex->spheres[4 * (size_t)ends[0]], *b = &complex->spheres[4 * (size_t)ends[1]];
  const double t = random_index(random, 3) == 0 ? random_between(random, 0, 1) : (double)random_index(random, 2);
  for (int k = 0; k < 4; k++) sphere[k] = (1 - t) * a[k] + t * b[k];
  if (random_index(random, 4) == 0) sphere[random_index(random, 4)] += random_between(random, -most_off, most_off);
  sphere[3] = fmax(sphere[3], 0);
  return edge;
}

#endif
