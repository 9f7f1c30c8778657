/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/collapse_candidates.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

qmat_quadric qmat_merged_quadric(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge) {
  const uint32_t *ends = &complex->edges[2 * (size_t)edge];
  qmat_quadric merged = quadrics[ends[0]];
  qmat_quadric_add(&merged, &quadrics[ends[1]]);
  return merged;
}

void qmat_candidates_insert(qmat_candidates *c, const double sphere[4], double error) {
  int place = c->count++;
  for (; place > 0 && error < c->errors[place - 1]; place--) {
    c->errors[place] = c->errors[place - 1];
    memcpy(c->spheres[place], c->spheres[place - 1], sizeof c->spheres[place]);
  }
  c->errors[place] = error;
  memcpy(c->spheres[place], sphere, sizeof c->spheres[place]);
}

void qmat_candidates_add(qmat_candidates *c, const qmat_quadric *quadric, const double sphere[4]) {
  qmat_candidates_insert(c, sphere, qmat_quadric_error(quadric, sphere));
}

static void find_candidates(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge, bool on_sheet,
                            qmat_candidates *c) {
  const qmat_quadric quadric = qmat_merged_quadric(complex, quadrics, edge);
  const uint32_t *ends = &complex->edges[2 * (size_t)edge];
  const double *a = &complex->spheres[4 * (size_t)ends[0]], *b = &complex->spheres[4 * (size_t)ends[1]];
  double sphere[4] = {0, 0, 0, a[3]};
  c->count = 0;
  const double reach = 2 * qmat_point_distance(a, b) + fabs(a[3] - b[3]);
  if (on_sheet) { /* where errors are equal, as in a plane, vertices stay where they are */
    qmat_candidates_add(c, &quadric, a);
    qmat_candidates_add(c, &quadric, b);
  }
  const bool found = on_sheet ? qmat_quadric_minimise_centre(&quadric, sphere)
                              : qmat_quadric_minimise(&quadric, sphere) && sphere[3] > 0;
  if (found && fmin(qmat_point_distance(sphere, a), qmat_point_distance(sphere, b)) <= reach)
    qmat_candidates_add(c, &quadric, sphere);
  if (!on_sheet) {
    qmat_candidates_add(c, &quadric, a);
    qmat_candidates_add(c, &quadric, b);
  }
  for (int k = 0; k < 4; k++) sphere[k] = 0.5 * (a[k] + b[k]);
  qmat_candidates_add(c, &quadric, sphere);
}

void qmat_candidates_find(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                          qmat_candidates *c) {
  find_candidates(complex, quadrics, edge, false, c);
}

void qmat_candidates_find_on_sheet(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                                   qmat_candidates *c) {
  find_candidates(complex, quadrics, edge, true, c);
}

void qmat_candidates_find_published(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                                    qmat_candidates *c) {
  const qmat_quadric quadric = qmat_merged_quadric(complex, quadrics, edge);
  const uint32_t *ends = &complex->edges[2 * (size_t)edge];
  const double *a = &complex->spheres[4 * (size_t)ends[0]], *b = &complex->spheres[4 * (size_t)ends[1]];
  double best[4], middle[4];
  for (int k = 0; k < 4; k++) middle[k] = 0.5 * (a[k] + b[k]);
  c->count = 0;
  if (qmat_quadric_minimise(&quadric, best)) {
    const bool usable = best[3] >= 0 && qmat_point_distance(best, middle) <= 1 && best[3] <= 1;
    qmat_candidates_add(c, &quadric, usable ? best : middle);
    return;
  }
  qmat_candidates_add(c, &quadric, middle);
  if (complex->edge_triangles[edge]) {
    qmat_candidates_add(c, &quadric, a);
    qmat_candidates_add(c, &quadric, b);
  }
  c->count = 1;
}

void qmat_candidates_find_larger(const qmat_complex *complex, const qmat_quadric *quadrics, uint32_t edge,
                                 qmat_candidates *c) {
  const qmat_quadric quadric = qmat_merged_quadric(complex, quadrics, edge);
  const uint32_t *ends = &complex->edges[2 * (size_t)edge];
  const double *a = &complex->spheres[4 * (size_t)ends[0]], *b = &complex->spheres[4 * (size_t)ends[1]];
  c->count = 0;
  qmat_candidates_add(c, &quadric, b[3] > a[3] ? b : a);
}
