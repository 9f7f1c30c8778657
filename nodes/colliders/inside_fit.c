/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/inside_fit.h"

#include <math.h>
#include <string.h>

#include "nodes/measure/envelope_to_surface.h"

enum { STEPS_OF_CONE = 16, STEPS_OF_SLAB = 8, SWEEPS = 40, SLICE = 256, PATIENCE = 16384 };

static const double tolerance = 1e-5;

/* A medial point of a shape: its radius, interpolated by `shares`, must be at most `depth`. */
typedef struct limit {
  uint32_t ids[3];
  double shares[3], depth;
} limit;

/* The medial points of a shape; their number. `limits` may be NULL. */
static size_t add_limits(const uint32_t ids[3], limit *limits) {
  const int width = qmat_shape_width(ids), steps = width == 1 ? 0 : width == 2 ? STEPS_OF_CONE : STEPS_OF_SLAB;
  size_t count = 0;
  for (int i = 0; i <= steps; i++)
    for (int j = 0; j <= (width == 3 ? steps - i : 0); j++, count++) {
      if (!limits) continue;
      const double second = steps > 0 ? (double)i / steps : 0, third = steps > 0 ? (double)j / steps : 0;
      limits[count] = (limit){.ids = {ids[0], ids[1], ids[2]}, .shares = {1 - second - third, second, third}};
    }
  return count;
}

static double radius_at(const qmat_shape_set *set, const limit *l) {
  double radius = 0;
  for (int k = 0; k < 3; k++) radius += l->shares[k] * set->spheres[4 * (size_t)l->ids[k] + 3];
  return radius;
}

static qmat_status measure_depths(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                  limit *limits, size_t count) {
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count; first += SLICE) {
    const qmat_status status = qmat_progress(context, first, count, "depths");
    if (status != QMAT_OK) return status;
    const size_t last = first + SLICE < count ? first + SLICE : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
    for (size_t i = first; i < last; i++) {
      double point[3] = {0, 0, 0};
      for (int s = 0; s < 3; s++)
        for (int k = 0; k < 3; k++)
          point[k] += limits[i].shares[s] * set->spheres[4 * (size_t)limits[i].ids[s] + (size_t)k];
      limits[i].depth = -qmat_surface_signed_distance(surface, point);
    }
  }
  return QMAT_OK;
}

/* Lowers radii until every limit holds, to rounding. */
static void lower(qmat_shape_set *set, const limit *limits, size_t count) {
  for (int sweep = 0; sweep < SWEEPS; sweep++) {
    bool done = true;
    for (size_t i = 0; i < count; i++) {
      const limit *l = &limits[i];
      const double excess = radius_at(set, l) - l->depth;
      if (!(excess > 1e-9)) continue;
      double squares = 0;
      done = false;
      for (int k = 0; k < 3; k++) squares += l->shares[k] * l->shares[k];
      for (int k = 0; k < 3; k++) set->spheres[4 * (size_t)l->ids[k] + 3] -= excess * l->shares[k] / squares;
    }
    if (done) break;
  }
}

/* Raises each radius, in order, as far as its limits allow. */
static void raise(qmat_shape_set *set, const limit *limits, size_t count, double *room) {
  for (size_t i = 0; i < set->sphere_count; i++) room[i] = INFINITY;
  /* A limit leaves each of its spheres a third of what it has left, so that all may rise at once. */
  for (size_t i = 0; i < count; i++) {
    const limit *l = &limits[i];
    const double left = l->depth - radius_at(set, l);
    for (int k = 0; k < 3; k++)
      if (l->shares[k] > 0) room[l->ids[k]] = fmin(room[l->ids[k]], fmax(left, 0) / (3 * l->shares[k]));
  }
  for (size_t i = 0; i < set->sphere_count; i++)
    if (isfinite(room[i])) set->spheres[4 * i + 3] += room[i];
}

/* Takes spheres below the least radius out of their shapes, and shapes without spheres out of the set. */
static void drop_small(qmat_shape_set *set, double least_radius) {
  size_t kept = 0;
  for (size_t i = 0; i < set->shape_count; i++) {
    uint32_t ids[3];
    int count = 0;
    const int width = qmat_shape_width(&set->shapes[3 * i]);
    for (int k = 0; k < width; k++)
      if (set->spheres[4 * (size_t)set->shapes[3 * i + (size_t)k] + 3] >= least_radius)
        ids[count++] = set->shapes[3 * i + (size_t)k];
    if (count == 0) continue;
    for (int k = count; k < 3; k++) ids[k] = ids[count - 1];
    memcpy(&set->shapes[3 * kept++], ids, sizeof ids);
  }
  set->shape_count = kept;
}

/* Proves that every shape is inside; lowers its radii where it is not. */
static qmat_status prove(qmat_context *context, const qmat_surface *surface, qmat_shape_set *set, double *bounds) {
  const int threads = qmat_threads(context);
  const size_t slice = 4; /* a shape may take a second */
  for (size_t first = 0; first < set->shape_count; first += slice) {
    const qmat_status status = qmat_progress(context, first, set->shape_count, "shapes proved");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < set->shape_count ? first + slice : set->shape_count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t i = first; i < last; i++) {
      const uint32_t *ids = &set->shapes[3 * i];
      const double *const spheres[3] = {&set->spheres[4 * (size_t)ids[0]], &set->spheres[4 * (size_t)ids[1]],
                                        &set->spheres[4 * (size_t)ids[2]]};
      bounds[i] = qmat_envelope_to_surface_bound_soon(surface, spheres, qmat_shape_width(ids), 0, tolerance, PATIENCE);
    }
  }
  for (size_t i = 0; i < set->shape_count; i++) {
    const int width = qmat_shape_width(&set->shapes[3 * i]);
    for (int k = 0; k < width && bounds[i] > 0; k++)
      set->spheres[4 * (size_t)set->shapes[3 * i + (size_t)k] + 3] -= bounds[i] + 1e-9;
  }
  return QMAT_OK;
}

qmat_status qmat_inside_fit(qmat_context *context, const qmat_surface *surface, qmat_shape_set *set,
                            double least_radius, bool *proved) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  size_t count = 0;
  *proved = mesh->closed && mesh->oriented;
  for (size_t i = 0; i < set->shape_count; i++) count += add_limits(&set->shapes[3 * i], NULL);
  limit *limits = qmat_arena_alloc(&context->arena, count, sizeof *limits);
  double *scratch = qmat_arena_alloc(&context->arena, set->sphere_count + set->shape_count, sizeof *scratch);
  if (!limits || !scratch) return qmat_fail_memory(context, "the fitted colliders");
  count = 0;
  for (size_t i = 0; i < set->shape_count; i++) count += add_limits(&set->shapes[3 * i], limits + count);
  qmat_status status = measure_depths(context, surface, set, limits, count);
  for (size_t i = 0; i < count; i++) /* a corner of a shape */
    for (int k = 0; k < 3; k++)
      if (limits[i].shares[k] == 1) set->spheres[4 * (size_t)limits[i].ids[k] + 3] = limits[i].depth;
  if (status == QMAT_OK) lower(set, limits, count);
  for (int round = 0; round < 8 && status == QMAT_OK; round++) raise(set, limits, count, scratch);
  drop_small(set, least_radius);
  if (status == QMAT_OK) status = prove(context, surface, set, scratch);
  drop_small(set, least_radius);
  return status == QMAT_OK ? qmat_shape_set_reduce(context, set) : status;
}
