/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/shape_measures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/sheets.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "core/hash.h"
#include "nodes/measure/area_samples.h"

enum { VOLUME_FACTOR = 10, SLICE = 1 << 14 };

/* Triangles with their running areas, from which points are taken. */
typedef struct triangles {
  const double *positions;
  const uint32_t *rows;
  size_t count;
  double *areas;
} triangles;

typedef struct measuring {
  qmat_context *context;
  const qmat_surface *surface;
  const qmat_shape_set *set;
  const qmat_envelope *envelope;
  triangles area;            /* of the surface, or of the hulls */
  const uint32_t *hull_ends; /* of the hulls: the shape of a triangle */
  size_t samples;
  double *values; /* per sample; NAN: does not count */
} measuring;

static qmat_status sum_areas(qmat_context *context, triangles *t) {
  t->areas = qmat_arena_alloc(&context->arena, t->count, sizeof *t->areas);
  if (!t->areas) return qmat_fail_memory(context, "samples of colliders");
  qmat_running_areas(t->positions, t->rows, t->count, t->areas);
  return QMAT_OK;
}

/* Sample i of `samples`: a point, and its triangle. */
static size_t sample_point(const measuring *m, size_t i, uint64_t stream, double point[3]) {
  const triangles *t = &m->area;
  const double at = t->areas[t->count - 1] * ((double)i + 0.5) / (double)m->samples;
  const size_t triangle = qmat_area_element_at(t->areas, t->count, at);
  const uint32_t *row = &t->rows[3 * triangle];
  qmat_triangle_point(&t->positions[3 * (size_t)row[0]], &t->positions[3 * (size_t)row[1]],
                      &t->positions[3 * (size_t)row[2]], qmat_hash_unit(qmat_hash3(stream, i, 0)),
                      qmat_hash_unit(qmat_hash3(stream, i, 1)), point);
  return triangle;
}

/* Moves a point of a thick sheet's middle to one of its sides. */
static void move_to_side(const measuring *m, size_t triangle, bool is_front, double point[3]) {
  double normal[3];
  const uint32_t *row = &m->area.rows[3 * triangle];
  const double half = qmat_surface_half_thickness(m->surface);
  if (half == 0 || triangle < qmat_solid_triangle_count(qmat_surface_mesh(m->surface))) return;
  (void)qmat_triangle_area(&m->area.positions[3 * (size_t)row[0]], &m->area.positions[3 * (size_t)row[1]],
                           &m->area.positions[3 * (size_t)row[2]], normal);
  for (int k = 0; k < 3; k++) point[k] += (is_front ? half : -half) * normal[k];
}

static double gap_at(const measuring *m, size_t i) {
  double point[3];
  const size_t triangle = sample_point(m, i, 1, point);
  move_to_side(m, triangle, i % 2 == 0, point);
  return qmat_larger(qmat_envelope_distance(m->envelope, point, NULL), 0);
}

/* How far a point of the shapes' boundary is outside: a point of a hull, taken to the boundary of its shape. NAN inside
 * another shape. */
static double protrusion_at(const measuring *m, size_t i) {
  double point[3], medial[4];
  const size_t triangle = sample_point(m, i, 2, point);
  size_t low = 0, high = m->set->shape_count - 1;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    if (m->hull_ends[2 * middle + 1] > triangle)
      high = middle;
    else
      low = middle + 1;
  }
  const uint32_t *ids = &m->set->shapes[3 * low];
  qmat_prepared_shape shape;
  qmat_shape_prepare(&shape, m->set->spheres, ids);
  qmat_shape_medial(&shape, m->set->spheres, ids, point, medial);
  const double away = qmat_point_distance(point, medial);
  if (!(away > 0)) return NAN;
  for (int k = 0; k < 3; k++) point[k] = medial[k] + medial[3] / away * (point[k] - medial[k]);
  if (qmat_envelope_holds(m->envelope, point, 1e-9)) return NAN;
  return qmat_larger(qmat_surface_signed_distance(m->surface, point), 0);
}

static int compare_numbers(const void *left, const void *right) {
  const double a = *(const double *)left, b = *(const double *)right;
  return a < b ? -1 : a > b;
}

/* The mean, the 95th percentile, the largest, and the share above 0, of what `at` gives. */
static qmat_status take(measuring *m, double (*at)(const measuring *, size_t), const char *what, double *mean,
                        double *p95, double *largest, double *above) {
  const int threads = qmat_threads(m->context);
  qmat_status status = sum_areas(m->context, &m->area);
  if (status != QMAT_OK) return status;
  *mean = *p95 = *largest = *above = 0;
  if (m->area.count == 0 || !(m->area.areas[m->area.count - 1] > 0)) return QMAT_OK;
  for (size_t first = 0; first < m->samples; first += SLICE) {
    status = qmat_progress(m->context, first, m->samples, what);
    if (status != QMAT_OK) return status;
    const size_t last = first + SLICE < m->samples ? first + SLICE : m->samples;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t i = first; i < last; i++) m->values[i] = at(m, i);
  }
  size_t count = 0;
  for (size_t i = 0; i < m->samples; i++)
    if (!isnan(m->values[i])) m->values[count++] = m->values[i];
  if (count == 0) return QMAT_OK;
  for (size_t i = 0; i < count; i++) {
    *mean += m->values[i] / (double)count;
    *above += m->values[i] > 1e-9 ? 1 / (double)count : 0;
  }
  qsort(m->values, count, sizeof *m->values, compare_numbers);
  *p95 = m->values[(count - 1) * 95 / 100];
  *largest = m->values[count - 1];
  return QMAT_OK;
}

/* Point i of a low-discrepancy sequence in the unit cube (Roberts 2018, R3). */
static void spread_point(size_t i, double point[3]) {
  static const double steps[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  for (int k = 0; k < 3; k++) {
    const double x = 0.5 + steps[k] * ((double)i + 1);
    point[k] = x - floor(x);
  }
}

static qmat_status measure_volumes(const measuring *m, double volume, qmat_shape_measures *measures) {
  const qmat_mesh *mesh = qmat_surface_mesh(m->surface);
  const double *positions = qmat_surface_positions(m->surface);
  const double half = qmat_surface_half_thickness(m->surface);
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
    for (int k = 0; k < 3; k++) {
      const double x = positions[3 * (size_t)mesh->triangles[i] + (size_t)k];
      low[k] = fmin(low[k], x - half);
      high[k] = fmax(high[k], x + half);
    }
  for (size_t i = 0; i < m->set->sphere_count; i++)
    for (int k = 0; k < 3; k++) {
      const double *s = &m->set->spheres[4 * i];
      low[k] = fmin(low[k], s[k] - s[3]);
      high[k] = fmax(high[k], s[k] + s[3]);
    }
  const size_t count = VOLUME_FACTOR * m->samples;
  const int threads = qmat_threads(m->context);
  size_t solid = 0, shapes = 0, both = 0;
  for (size_t first = 0; first < count; first += SLICE) {
    const qmat_status status = qmat_progress(m->context, first, count, "points of the volume");
    if (status != QMAT_OK) return status;
    const size_t last = first + SLICE < count ? first + SLICE : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256) reduction(+ : solid, shapes, both)
    for (size_t i = first; i < last; i++) {
      double point[3];
      spread_point(i, point);
      for (int k = 0; k < 3; k++) point[k] = low[k] + point[k] * (high[k] - low[k]);
      const bool in_solid = half > 0 ? qmat_surface_signed_distance(m->surface, point) <= 0
                                     : qmat_surface_inside(m->surface, point),
                 in_shape = qmat_envelope_holds(m->envelope, point, 0);
      solid += in_solid;
      shapes += in_shape;
      both += in_solid && in_shape;
    }
  }
  double box = 1;
  for (int k = 0; k < 3; k++) box *= high[k] - low[k];
  const double share = box / (double)count, of_solid = volume > 0 && half == 0 ? volume : (double)solid * share;
  measures->coverage = solid > 0 ? (double)both / (double)solid : 0;
  measures->volume_ratio = of_solid > 0 ? (double)shapes * share / of_solid : 0;
  measures->iou = solid + shapes > both ? (double)both / (double)(solid + shapes - both) : 0;
  return QMAT_OK;
}

qmat_status qmat_shape_measures_take(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                     const qmat_envelope *envelope, const qmat_colliders *colliders, double volume,
                                     size_t samples, qmat_shape_measures *measures) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  double *points = qmat_arena_alloc(&context->arena, colliders->point_count, 3 * sizeof *points), largest, above;
  measuring m = {.context = context,
                 .surface = surface,
                 .set = set,
                 .envelope = envelope,
                 .area = {qmat_surface_positions(surface), mesh->triangles, mesh->triangle_count, NULL},
                 .hull_ends = colliders->hull_ends,
                 .samples = samples,
                 .values = qmat_arena_alloc(&context->arena, samples, sizeof *m.values)};
  if (!points || !m.values) return qmat_fail_memory(context, "samples of colliders");
  qmat_status status = take(&m, gap_at, "points of the surface", &measures->gap_mean, &measures->gap_p95,
                            &measures->max_uncovered_gap, &above);
  qmat_frame_to_unit(qmat_surface_frame(surface), colliders->points, colliders->point_count, points);
  m.area = (triangles){points, colliders->triangles, colliders->triangle_count, NULL};
  if (status == QMAT_OK)
    status = take(&m, protrusion_at, "points of the shapes", &measures->protrusion_mean, &measures->protrusion_p95,
                  &largest, &measures->protrusion);
  return status == QMAT_OK ? measure_volumes(&m, volume, measures) : status;
}
