/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/sphere_errors.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "core/geometry/triangle.h"

/* Facets between two questions whether to cancel. */
enum { SLICE = 1 << 12 };

typedef struct measurement {
  const qmat_envelope *envelope;
  const double *spheres;
  double most, tolerance;
  const double *found;      /* per sphere: an F that its part of the surface has, or 0 */
  _Atomic uint64_t *errors; /* per sphere: the bits of the largest so far */
} measurement;

static double number_of(uint64_t bits) {
  double number;
  memcpy(&number, &bits, sizeof number);
  return number;
}

/* Raises an error to what is found, from any thread. Bits of numbers from 0 up are in their order. */
static void raise_error(const measurement *m, size_t sphere, double found) {
  uint64_t bits, so_far = atomic_load_explicit(&m->errors[sphere], memory_order_relaxed);
  if (!(found > 0)) return;
  memcpy(&bits, &found, sizeof bits);
  while (bits > so_far && !atomic_compare_exchange_weak_explicit(&m->errors[sphere], &so_far, bits,
                                                                 memory_order_relaxed, memory_order_relaxed))
    continue;
}

/* F at a point, and the sphere that answers for it. SIZE_MAX: there is no primitive. */
static double answering(const measurement *m, const double point[3], size_t *sphere) {
  double nearest[4], least = INFINITY;
  size_t primitive = SIZE_MAX;
  uint32_t ids[3];
  const double f = qmat_envelope_nearest(m->envelope, point, &primitive, nearest);
  *sphere = SIZE_MAX;
  if (!isfinite(f)) return f;
  const int count = qmat_envelope_primitive(m->envelope, primitive, ids);
  for (int i = 0; i < count; i++) {
    const double distance = qmat_point_distance(m->spheres + 4 * (size_t)ids[i], nearest);
    if (*sphere != SIZE_MAX && !(distance < least)) continue;
    least = distance;
    *sphere = ids[i];
  }
  return f;
}

static void measure_piece(const measurement *m, double corners[3][3]) {
  double centre[3], reach = 0, bound;
  size_t sphere;
  for (int k = 0; k < 3; k++) centre[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
  for (int i = 0; i < 3; i++) reach = fmax(reach, qmat_point_distance(corners[i], centre));
  qmat_envelope_bound(m->envelope, centre, (const double(*)[3])corners, 3, -INFINITY, &bound);
  const double f = answering(m, centre, &sphere);
  if (sphere == SIZE_MAX) return;
  bound = fmin(fmin(bound, f + reach), m->most);
  if (bound <= fmax(f, m->found[sphere]) + m->tolerance || reach <= 0.5 * m->tolerance) {
    raise_error(m, sphere, bound);
    return;
  }
  double low[3][3], high[3][3];
  qmat_triangle_halve(corners[0], low[0], high[0]);
  measure_piece(m, low);
  measure_piece(m, high);
}

static void corners_of(const qmat_surface *surface, size_t facet, double corners[3][3]) {
  const uint32_t *row = &qmat_surface_mesh(surface)->triangles[3 * facet];
  for (int i = 0; i < 3; i++) memcpy(corners[i], &qmat_surface_positions(surface)[3 * (size_t)row[i]], sizeof *corners);
}

/* Raises the errors of the spheres that answer for the corners and the centre of a facet to what F is there. */
static void measure_points(const measurement *m, double corners[3][3]) {
  double points[4][3];
  memcpy(points, corners, 3 * sizeof *points);
  for (int k = 0; k < 3; k++) points[3][k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
  for (int i = 0; i < 4; i++) {
    size_t sphere;
    const double f = answering(m, points[i], &sphere);
    if (sphere != SIZE_MAX) raise_error(m, sphere, f);
  }
}

/* Calls `measure` for each facet, on all threads. `errors` gets the maxima: they are the same in any order. */
static qmat_status measure_facets(qmat_context *context, const qmat_surface *surface, const measurement *m,
                                  void (*measure)(const measurement *m, double corners[3][3]), size_t sphere_count,
                                  double *errors) {
  const size_t count = qmat_surface_mesh(surface)->triangle_count;
  const int threads = qmat_threads(context);
  for (size_t i = 0; i < sphere_count; i++) atomic_init(&m->errors[i], 0);
  for (size_t first = 0; first < count; first += SLICE) {
    const qmat_status status = qmat_progress(context, first, count, "facets measured for spheres");
    if (status != QMAT_OK) return status;
    const size_t last = first + SLICE < count ? first + SLICE : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t t = first; t < last; t++) {
      double corners[3][3];
      corners_of(surface, t, corners);
      measure(m, corners);
    }
  }
  for (size_t i = 0; i < sphere_count; i++) errors[i] = number_of(atomic_load(&m->errors[i]));
  return QMAT_OK;
}

qmat_status qmat_sphere_errors_measure(qmat_context *context, const qmat_surface *surface,
                                       const qmat_envelope *envelope, const double *spheres, size_t sphere_count,
                                       double most, double tolerance, double *errors) {
  double *found = qmat_arena_alloc(&context->arena, sphere_count, sizeof *found);
  _Atomic uint64_t *largest = qmat_arena_alloc(&context->arena, sphere_count, sizeof *largest);
  if (!found || !largest) return qmat_fail_memory(context, "the errors of spheres");
  measurement m = {.envelope = envelope,
                   .spheres = spheres,
                   .most = most,
                   .tolerance = fmax(tolerance, QMAT_LEAST_ENVELOPE_TOLERANCE),
                   .found = found,
                   .errors = largest};
  qmat_status status = measure_facets(context, surface, &m, measure_points, sphere_count, found);
  if (status == QMAT_OK) status = measure_facets(context, surface, &m, measure_piece, sphere_count, errors);
  return status;
}
