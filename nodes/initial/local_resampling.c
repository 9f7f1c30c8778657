/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/local_resampling.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "core/hash.h"
#include "nodes/initial/sample_spacing.h"

enum { MOST_ADDED = 1 << 20 };

/* The reach of samples near far points, as a share of the spacing. It is less than the displacement of points in
 * neighbouring rows, so the new samples do not represent each other. */
static const double reach_share = 0.5;

typedef struct {
  size_t count, facet_capacity, weight_capacity;
  uint32_t *facets;
  double *barycentrics; /* 3 each */
} added_samples;

static void interpolate(const qmat_mesh *mesh, const double *positions, size_t facet, const double *weights,
                        double point[3]) {
  const uint32_t *ids = &mesh->triangles[3 * facet];
  for (size_t k = 0; k < 3; k++)
    point[k] = weights[0] * positions[3 * (size_t)ids[0] + k] + weights[1] * positions[3 * (size_t)ids[1] + k] +
               weights[2] * positions[3 * (size_t)ids[2] + k];
}

/* Adds the evenly spaced points of one facet that are near far points. `scratch` has room for all of them. */
static qmat_status add_in_facet(qmat_context *context, const qmat_resampling *w, size_t facet, const uint32_t *on_sides,
                                uint64_t in_rows, double *scratch, added_samples *added) {
  const uint32_t *ids = &w->mesh->triangles[3 * facet];
  const double *a = &w->positions[3 * (size_t)ids[0]], *b = &w->positions[3 * (size_t)ids[1]],
               *c = &w->positions[3 * (size_t)ids[2]];
  size_t count = 0;
  for (int side = 0; side < 3; side++) {
    qmat_side_points_fill(side, on_sides[side], &scratch[3 * count]);
    count += on_sides[side];
  }
  if (in_rows) qmat_row_points_fill(a, b, c, w->spacing, qmat_hash3(0, facet, 0), in_rows, &scratch[3 * count]);
  count += in_rows;
  if (qmat_grow((void **)&added->facets, &added->facet_capacity, added->count + count, sizeof *added->facets) ||
      qmat_grow((void **)&added->barycentrics, &added->weight_capacity, 3 * (added->count + count),
                sizeof *added->barycentrics))
    return qmat_fail_memory(context, "further samples");
  for (size_t i = 0; i < count; i++) {
    double point[3];
    interpolate(w->mesh, w->positions, facet, &scratch[3 * i], point);
    if (!qmat_point_grid_has_within(w->far, point, w->around)) continue;
    added->facets[added->count] = (uint32_t)facet;
    memcpy(&added->barycentrics[3 * added->count++], &scratch[3 * i], 3 * sizeof *scratch);
  }
  return QMAT_OK;
}

/* Whether a far point may be near any point of a facet. */
static bool is_facet_near(const qmat_resampling *w, size_t facet) {
  static const double middle[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
  double centre[3], radius = 0;
  interpolate(w->mesh, w->positions, facet, middle, centre);
  for (size_t k = 0; k < 3; k++)
    radius =
        qmat_larger(radius, qmat_point_distance(&w->positions[3 * (size_t)w->mesh->triangles[3 * facet + k]], centre));
  return qmat_point_grid_has_within(w->far, centre, radius + w->around);
}

/* Finds the new samples; `*fit` becomes false if there are too many. */
static qmat_status find_samples(qmat_context *context, const qmat_resampling *w, added_samples *added, bool *fit) {
  const qmat_mesh *mesh = w->mesh;
  uint32_t *on_sides = qmat_arena_alloc(&context->arena, 3 * mesh->triangle_count, sizeof *on_sides);
  uint64_t *in_rows = qmat_arena_calloc(&context->arena, mesh->triangle_count, sizeof *in_rows);
  uint8_t *is_near = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *is_near);
  double *spacings = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *spacings);
  if (!on_sides || !in_rows || !is_near || !spacings) return qmat_fail_memory(context, "further samples");
  for (size_t t = 0; t < mesh->triangle_count; t++) spacings[t] = w->spacing;
  qmat_status status = qmat_side_points_count(context, mesh, w->positions, spacings, on_sides);
  const int threads = qmat_threads(context);
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *ids = &mesh->triangles[3 * t];
    is_near[t] = is_facet_near(w, t);
    if (is_near[t])
      in_rows[t] = qmat_row_points_count(&w->positions[3 * (size_t)ids[0]], &w->positions[3 * (size_t)ids[1]],
                                         &w->positions[3 * (size_t)ids[2]], w->spacing);
  }
  uint64_t most = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    if (!is_near[t]) continue;
    const uint64_t count = in_rows[t] + on_sides[3 * t] + on_sides[3 * t + 1] + on_sides[3 * t + 2];
    most = count > most ? count : most;
  }
  *fit = most <= MOST_ADDED;
  if (!*fit) return status;
  double *scratch = qmat_arena_alloc(&context->arena, most, 3 * sizeof *scratch);
  if (!scratch) return qmat_fail_memory(context, "further samples");
  for (size_t t = 0; t < mesh->triangle_count && status == QMAT_OK && *fit; t++) {
    if (t % 1024 == 0) status = qmat_progress(context, t, mesh->triangle_count, "facets");
    if (status == QMAT_OK && is_near[t])
      status = add_in_facet(context, w, t, &on_sides[3 * t], in_rows[t], scratch, added);
    *fit = added->count <= MOST_ADDED;
  }
  return status;
}

/* Lowers the reaches of known samples near far points. `*changed`: whether one is lower or a sample is added. */
static qmat_status fill_reaches(qmat_context *context, const qmat_resampling *w, const qmat_samples *before,
                                const double *reaches, size_t added, double *reaches_after, bool *changed) {
  const double reach = reach_share * w->spacing;
  double *points = qmat_arena_alloc(&context->arena, before->count, 3 * sizeof *points);
  if (!points) return qmat_fail_memory(context, "further samples");
  qmat_frame_to_unit(w->frame, before->positions, before->count, points);
  *changed = added > 0;
  for (size_t i = 0; i < before->count; i++) {
    reaches_after[i] = reaches ? reaches[i] : INFINITY;
    if (reaches_after[i] <= reach || !qmat_point_grid_has_within(w->far, &points[3 * i], w->around)) continue;
    reaches_after[i] = reach;
    *changed = true;
  }
  for (size_t i = 0; i < added; i++) reaches_after[before->count + i] = reach;
  return QMAT_OK;
}

static qmat_status join_samples(qmat_context *context, const qmat_mesh *mesh, const qmat_samples *before,
                                const added_samples *added, qmat_samples *samples) {
  const size_t known = before->count, count = known + added->count;
  samples->vertex_count = before->vertex_count;
  samples->count = count;
  samples->positions = qmat_alloc(count, 3 * sizeof *samples->positions);
  samples->facets = qmat_alloc(count, sizeof *samples->facets);
  samples->barycentrics = qmat_alloc(count, 3 * sizeof *samples->barycentrics);
  if (!samples->positions || !samples->facets || !samples->barycentrics)
    return qmat_fail_memory(context, "further samples");
  memcpy(samples->positions, before->positions, 3 * known * sizeof *samples->positions);
  memcpy(samples->facets, before->facets, known * sizeof *samples->facets);
  memcpy(samples->barycentrics, before->barycentrics, 3 * known * sizeof *samples->barycentrics);
  for (size_t i = 0; i < added->count; i++) {
    const double *weights = &added->barycentrics[3 * i];
    samples->facets[known + i] = added->facets[i];
    memcpy(&samples->barycentrics[3 * (known + i)], weights, 3 * sizeof *weights);
    interpolate(mesh, mesh->positions, added->facets[i], weights, &samples->positions[3 * (known + i)]);
  }
  return QMAT_OK;
}

qmat_status qmat_samples_densify(qmat_context *context, const qmat_resampling *where, const qmat_samples *before,
                                 const double *reaches, qmat_samples **samples, double **reaches_after) {
  added_samples added = {.count = 0};
  bool fit = false, changed = false;
  *samples = NULL;
  *reaches_after = NULL;
  qmat_status status = find_samples(context, where, &added, &fit);
  if (status == QMAT_OK && fit) {
    *samples = qmat_samples_new();
    *reaches_after = qmat_alloc(before->count + added.count, sizeof **reaches_after);
    if (!*samples || !*reaches_after) status = qmat_fail_memory(context, "further samples");
    if (status == QMAT_OK)
      status = fill_reaches(context, where, before, reaches, added.count, *reaches_after, &changed);
    if (status == QMAT_OK && changed) status = join_samples(context, where->mesh, before, &added, *samples);
  }
  if (!changed || status != QMAT_OK) {
    qmat_value_release(*samples ? &(*samples)->base : NULL);
    qmat_free(*reaches_after);
    *samples = NULL;
    *reaches_after = NULL;
  }
  qmat_free(added.facets);
  qmat_free(added.barycentrics);
  return status;
}
