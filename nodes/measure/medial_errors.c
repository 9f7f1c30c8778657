/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/medial_errors.h"

#include <math.h>
#include <string.h>

#include "nodes/measure/boundary_distance.h"
#include "nodes/measure/envelope_to_surface.h"

/* Queries between two calls of the progress function. */
enum { POINTS_SLICE = 1 << 14 };

/* The largest r - depth at the spheres and at the middles of the primitives: a lower bound, after which most primitives
 * need a single query. */
static qmat_status sampled_to_surface(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                                      const qmat_envelope *envelope, double *result) {
  const int threads = qmat_threads(context);
  const size_t all = unit->sphere_count + qmat_envelope_primitive_count(envelope);
  double least = 0;
  for (size_t first = 0; first < all; first += POINTS_SLICE) {
    const qmat_status status = qmat_progress(context, first, all, "primitives sampled");
    if (status != QMAT_OK) return status;
    const size_t last = all - first < POINTS_SLICE ? all : first + POINTS_SLICE;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64) reduction(max : least)
    for (size_t i = first; i < last; i++) {
      double middle[4] = {0, 0, 0, 0};
      uint32_t ids[3] = {(uint32_t)i};
      const int count = i < unit->sphere_count ? 1 : qmat_envelope_primitive(envelope, i - unit->sphere_count, ids);
      for (int c = 0; c < count; c++)
        for (size_t k = 0; k < 4; k++) middle[k] += unit->spheres[4 * (size_t)ids[c] + k] / count;
      least = fmax(least, qmat_envelope_to_surface_of_sphere(surface, middle));
    }
  }
  *result = least;
  return QMAT_OK;
}

static qmat_status largest_to_surface(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                                      const qmat_envelope *envelope, double tolerance, double enough, double *result) {
  const int threads = qmat_threads(context);
  const size_t primitives = qmat_envelope_primitive_count(envelope), slice = 256;
  double largest = 0, sampled;
  const qmat_status of_samples = sampled_to_surface(context, surface, unit, envelope, &sampled);
  if (of_samples != QMAT_OK) return of_samples;
  enough = fmax(enough, sampled + tolerance);
  for (size_t first = 0; first < primitives; first += slice) {
    const qmat_status status = qmat_progress(context, first, primitives, "primitives measured");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < primitives ? first + slice : primitives;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 4) reduction(max : largest)
    for (size_t i = first; i < last; i++) {
      uint32_t ids[3];
      const int count = qmat_envelope_primitive(envelope, i, ids);
      const double *spheres[3];
      for (int k = 0; k < count; k++) spheres[k] = &unit->spheres[4 * (size_t)ids[k]];
      largest = fmax(largest, qmat_envelope_to_surface_bound(surface, spheres, count, enough, tolerance));
    }
  }
  *result = largest;
  return QMAT_OK;
}

/* The first lower bound takes one point in so many: more take longer than they save the search. */
enum { POINT_STRIDE = 8 };

qmat_status qmat_medial_surface_bound_measure(qmat_context *context, const qmat_surface *surface,
                                              const qmat_medial *unit, const double *points, size_t point_count,
                                              double tolerance, double enough, double threshold,
                                              qmat_medial_errors *errors) {
  qmat_envelope *envelope;
  qmat_status status = qmat_envelope_of_medial(context, unit, &envelope);
  if (status != QMAT_OK) return status;
  const int threads = qmat_threads(context);
  double farthest = enough;
  const size_t queries = (point_count + POINT_STRIDE - 1) / POINT_STRIDE;
  for (size_t first = 0; first < queries && status == QMAT_OK; first += POINTS_SLICE) {
    const size_t last = queries - first < POINTS_SLICE ? queries : first + POINTS_SLICE;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 32) reduction(max : farthest)
    for (size_t i = first; i < last; i++)
      farthest = fmax(farthest, qmat_envelope_distance(envelope, &points[3 * POINT_STRIDE * i], NULL));
    status = qmat_progress(context, last, queries, "points measured");
  }
  /* Where a point exceeds the threshold, the facets beyond it are still to show their worst points. */
  farthest = fmin(farthest, fmax(threshold, enough));
  if (status == QMAT_OK)
    status = qmat_hausdorff_bound_measure(context, surface, envelope, farthest, tolerance, threshold - tolerance,
                                          threshold, &errors->bound);
  errors->surface_to_envelope = errors->bound.bound;
  qmat_envelope_free(envelope);
  return status;
}

qmat_status qmat_medial_envelope_bound_measure(qmat_context *context, const qmat_surface *surface,
                                               const qmat_medial *unit, double tolerance, double enough,
                                               qmat_medial_errors *errors) {
  qmat_envelope *envelope;
  qmat_status status = qmat_envelope_of_medial(context, unit, &envelope);
  if (status != QMAT_OK) return status;
  status = largest_to_surface(context, surface, unit, envelope, tolerance, enough, &errors->envelope_to_surface);
  qmat_envelope_free(envelope);
  return status;
}

/* Keeps the points that lie in the solid; returns their number. */
static size_t keep_inside(const qmat_surface *surface, double *points, size_t count) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++)
    if (qmat_surface_inside(surface, &points[3 * i])) memmove(&points[3 * kept++], &points[3 * i], 3 * sizeof *points);
  return kept;
}

/* The tolerance of the bound on the boundary, as a share of epsilon. */
static const double boundary_tolerance = 0.2;

qmat_status qmat_medial_boundary_measure(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                                         double epsilon, bool only_places, qmat_medial_errors *errors) {
  qmat_envelope *envelope;
  qmat_status status = qmat_envelope_of_medial(context, unit, &envelope);
  if (status != QMAT_OK) return status;
  qmat_boundary_distance boundary;
  status = qmat_boundary_distance_measure(
      context, surface, envelope, unit,
      &(qmat_boundary_request){.epsilon = epsilon, .tolerance = boundary_tolerance, .only_places = only_places},
      &boundary);
  qmat_envelope_free(envelope);
  errors->boundary_to_surface = boundary.either_side.hi;
  errors->uncovered = boundary.far_points;
  errors->uncovered_count = keep_inside(surface, errors->uncovered, boundary.far_count);
  errors->undecided = boundary.undecided_points;
  errors->undecided_count = keep_inside(surface, errors->undecided, boundary.undecided_count);
  return status;
}

void qmat_medial_errors_uninit(qmat_medial_errors *errors) {
  qmat_free(errors->uncovered);
  qmat_free(errors->undecided);
  *errors = (qmat_medial_errors){0};
}
