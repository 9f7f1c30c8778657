/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/hausdorff_bound.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"

/* The bound is raised by it: more than the rounding of F. */
static const double rounding = 1e-9;

/* Pieces up to this share of the tolerance are not split. */
static const double least_reach = 1.0 / 32;

/* The largest F found on a facet, and where. */
typedef struct facet_worst {
  double f, point[3];
} facet_worst;

typedef struct facet_search {
  const qmat_envelope *envelope;
  double tolerance, decisive;
  double found, bound; /* the largest F found, and the largest bound of a finished piece */
  facet_worst worst;
} facet_search;

static void search_piece(facet_search *search, double corners[3][3]) {
  double centre[3], reach = 0;
  for (int k = 0; k < 3; k++) centre[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
  for (int i = 0; i < 3; i++) reach = fmax(reach, qmat_point_distance(corners[i], centre));
  double bound;
  const double f = qmat_envelope_bound(search->envelope, centre, (const double(*)[3])corners, 3, -INFINITY, &bound);
  if (f > search->worst.f) {
    search->worst.f = f;
    memcpy(search->worst.point, centre, sizeof centre);
  }
  search->found = fmax(search->found, f);
  bound = fmin(bound, f + reach);
  const double aim = search->found < search->decisive ? fmin(search->found + search->tolerance, search->decisive)
                                                      : search->found + search->tolerance;
  if (bound <= aim || reach <= least_reach * search->tolerance) {
    search->bound = fmax(search->bound, bound);
    return;
  }
  double low[3][3], high[3][3];
  qmat_triangle_halve(corners[0], low[0], high[0]);
  search_piece(search, low);
  search_piece(search, high);
}

/* Searches all facets; `worst` gets one entry for each. */
static qmat_status search_facets(qmat_context *context, const qmat_surface *surface, const qmat_envelope *envelope,
                                 double known, double tolerance, double decisive, facet_worst *worst, double *largest) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  const size_t count = mesh->triangle_count, slice = 1 << 12;
  const int threads = qmat_threads(context);
  double bound = known;
  for (size_t first = 0; first < count; first += slice) {
    const qmat_status status = qmat_progress(context, first, count, "facets measured");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64) reduction(max : bound)
    for (size_t t = first; t < last; t++) {
      facet_search search = {.envelope = envelope,
                             .tolerance = fmax(tolerance, QMAT_LEAST_ENVELOPE_TOLERANCE),
                             .decisive = decisive - rounding,
                             .found = known,
                             .bound = -INFINITY,
                             .worst = {.f = -INFINITY}};
      double corners[3][3];
      for (int i = 0; i < 3; i++)
        memcpy(corners[i], &positions[3 * (size_t)mesh->triangles[3 * t + (size_t)i]], sizeof corners[i]);
      search_piece(&search, corners);
      bound = fmax(bound, search.bound);
      worst[t] = search.worst;
    }
  }
  *largest = bound;
  return QMAT_OK;
}

/* Keeps the worst points of the facets beyond the threshold. */
static qmat_status keep_points(qmat_context *context, const facet_worst *worst, size_t count, double threshold,
                               qmat_hausdorff_bound *result) {
  size_t beyond = 0;
  for (size_t t = 0; t < count; t++) {
    result->found = fmax(result->found, worst[t].f);
    beyond += worst[t].f > threshold;
  }
  result->points = qmat_arena_alloc(&context->arena, beyond, 3 * sizeof *result->points);
  if (!result->points) return qmat_fail_memory(context, "the Hausdorff bound");
  for (size_t t = 0; t < count; t++)
    if (worst[t].f > threshold) memcpy(&result->points[3 * result->count++], worst[t].point, sizeof worst[t].point);
  return QMAT_OK;
}

qmat_status qmat_hausdorff_bound_measure(qmat_context *context, const qmat_surface *surface,
                                         const qmat_envelope *envelope, double known, double tolerance,
                                         double threshold, double decisive, qmat_hausdorff_bound *result) {
  const size_t count = qmat_surface_mesh(surface)->triangle_count;
  *result = (qmat_hausdorff_bound){.found = known, .bound = known};
  facet_worst *worst = qmat_alloc(count, sizeof *worst); /* not of the arena: one result has many measurements */
  if (!worst) return qmat_fail_memory(context, "the Hausdorff bound");
  double largest = known;
  qmat_status status = search_facets(context, surface, envelope, known, tolerance, decisive, worst, &largest);
  if (status == QMAT_OK) status = keep_points(context, worst, count, threshold, result);
  qmat_free(worst);
  result->bound = largest + rounding;
  return status;
}
