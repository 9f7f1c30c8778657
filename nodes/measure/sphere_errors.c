/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/sphere_errors.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#include "core/geometry/triangle.h"

/* Facets between two questions whether to cancel. */
enum { SLICE = 1 << 12 };

typedef struct measurement {
  const qmat_envelope *envelope;
  const double *spheres;
  double most, tolerance;
  const double *found; /* per sphere: an F that its part of the surface has, or 0 */
  double *errors;      /* per sphere, of this thread */
} measurement;

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

static void measure_piece(measurement *m, double corners[3][3]) {
  double centre[3], reach = 0, bound;
  size_t sphere;
  for (int k = 0; k < 3; k++) centre[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
  for (int i = 0; i < 3; i++) reach = fmax(reach, qmat_point_distance(corners[i], centre));
  qmat_envelope_bound(m->envelope, centre, (const double(*)[3])corners, 3, -INFINITY, &bound);
  const double f = answering(m, centre, &sphere);
  if (sphere == SIZE_MAX) return;
  bound = fmin(fmin(bound, f + reach), m->most);
  if (bound <= fmax(f, m->found[sphere]) + m->tolerance || reach <= 0.5 * m->tolerance) {
    m->errors[sphere] = fmax(m->errors[sphere], bound);
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
static void measure_points(measurement *m, double corners[3][3]) {
  double points[4][3];
  memcpy(points, corners, 3 * sizeof *points);
  for (int k = 0; k < 3; k++) points[3][k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
  for (int i = 0; i < 4; i++) {
    size_t sphere;
    const double f = answering(m, points[i], &sphere);
    if (sphere != SIZE_MAX) m->errors[sphere] = fmax(m->errors[sphere], f);
  }
}

/* Calls `measure` for each facet, on all threads, each of which has its own row of `errors`. The first row gets the
 * maxima of all. */
static qmat_status measure_facets(qmat_context *context, const qmat_surface *surface, const measurement *all,
                                  void (*measure)(measurement *m, double corners[3][3]), size_t sphere_count,
                                  double *errors) {
  const size_t count = qmat_surface_mesh(surface)->triangle_count;
  const int threads = qmat_threads(context);
  memset(errors, 0, (size_t)threads * sphere_count * sizeof *errors);
  for (size_t first = 0; first < count; first += SLICE) {
    const qmat_status status = qmat_progress(context, first, count, "facets measured for spheres");
    if (status != QMAT_OK) return status;
    const size_t last = first + SLICE < count ? first + SLICE : count;
#pragma omp parallel num_threads(threads)
    {
      measurement own = *all;
      own.errors = errors + (size_t)omp_get_thread_num() * sphere_count;
#pragma omp for schedule(dynamic, 64)
      for (size_t t = first; t < last; t++) {
        double corners[3][3];
        corners_of(surface, t, corners);
        measure(&own, corners);
      }
    }
  }
  for (size_t i = sphere_count; i < (size_t)threads * sphere_count; i++)
    errors[i % sphere_count] = fmax(errors[i % sphere_count], errors[i]);
  return QMAT_OK;
}

qmat_status qmat_sphere_errors_measure(qmat_context *context, const qmat_surface *surface,
                                       const qmat_envelope *envelope, const double *spheres, size_t sphere_count,
                                       double most, double tolerance, double *errors) {
  const size_t rows = (size_t)qmat_threads(context);
  double *found = qmat_arena_alloc(&context->arena, rows * sphere_count, sizeof *found),
         *bounds = qmat_arena_alloc(&context->arena, rows * sphere_count, sizeof *bounds);
  if (!found || !bounds) return qmat_fail_memory(context, "the errors of spheres");
  measurement m = {.envelope = envelope,
                   .spheres = spheres,
                   .most = most,
                   .tolerance = fmax(tolerance, QMAT_LEAST_ENVELOPE_TOLERANCE),
                   .found = found};
  qmat_status status = measure_facets(context, surface, &m, measure_points, sphere_count, found);
  if (status == QMAT_OK) status = measure_facets(context, surface, &m, measure_piece, sphere_count, bounds);
  if (status == QMAT_OK) memcpy(errors, bounds, sphere_count * sizeof *errors);
  return status;
}
