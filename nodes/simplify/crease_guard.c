/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/crease_guard.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"

static const double *point_at(const qmat_crease_guard *g, size_t place) {
  return &g->points[3 * (size_t)g->creases.points[place]];
}

/* Numbers the spheres of radius zero, and finds the edges between them. */
static qmat_status find_features(qmat_context *context, const qmat_complex *complex, size_t first,
                                 qmat_crease_guard *guard, qmat_crease_edges *edges) {
  qmat_arena *arena = &context->arena;
  guard->features = qmat_arena_alloc(arena, complex->vertex_count, sizeof *guard->features);
  if (!guard->features) return qmat_fail_memory(context, "sharp features");
  for (size_t v = 0; v < complex->vertex_count; v++)
    guard->features[v] = v >= first && complex->spheres[4 * v + 3] == 0 ? (uint32_t)guard->feature_count++ : QMAT_NONE;
  guard->left = guard->feature_count;
  if (guard->feature_count == 0) {
    guard->features = NULL;
    return QMAT_OK;
  }
  double *points = qmat_arena_alloc(arena, guard->feature_count, 3 * sizeof *points);
  guard->vertices = qmat_arena_alloc(arena, guard->feature_count, sizeof *guard->vertices);
  edges->ends = qmat_arena_alloc(arena, complex->edge_count, 2 * sizeof *edges->ends);
  if (!points || !guard->vertices || !edges->ends) return qmat_fail_memory(context, "sharp features");
  guard->points = points;
  for (size_t v = 0; v < complex->vertex_count; v++) {
    if (guard->features[v] == QMAT_NONE) continue;
    memcpy(&points[3 * (size_t)guard->features[v]], &complex->spheres[4 * v], 3 * sizeof *points);
    guard->vertices[guard->features[v]] = (uint32_t)v;
  }
  for (size_t e = 0; e < complex->edge_count; e++) {
    const uint32_t a = guard->features[complex->edges[2 * e]], b = guard->features[complex->edges[2 * e + 1]];
    if (a == QMAT_NONE || b == QMAT_NONE) continue;
    edges->ends[2 * edges->count] = a;
    edges->ends[2 * edges->count++ + 1] = b;
  }
  return QMAT_OK;
}

static void *copy_of(qmat_context *context, const void *array, size_t count, size_t size) {
  void *copy = qmat_arena_alloc(&context->arena, count, size);
  if (copy && count) memcpy(copy, array, count * size);
  return copy;
}

qmat_status qmat_crease_guard_init(qmat_context *context, const qmat_complex *complex, size_t first,
                                   qmat_crease_guard *guard) {
  qmat_arena *arena = &context->arena;
  qmat_crease_edges edges = {.count = 0};
  *guard = (qmat_crease_guard){.feature_count = 0};
  qmat_status status = find_features(context, complex, first, guard, &edges);
  if (status != QMAT_OK || guard->feature_count == 0) return status;
  status = qmat_creases_chain(context, &edges, guard->points, 3, guard->feature_count, &guard->creases);
  if (status != QMAT_OK) return status;
  const qmat_creases *creases = &guard->creases;
  const size_t count = creases->starts[creases->count];
  uint32_t *places = qmat_arena_alloc(arena, guard->feature_count, sizeof *places);
  guard->next = qmat_arena_alloc(arena, count, sizeof *guard->next);
  guard->previous = qmat_arena_alloc(arena, count, sizeof *guard->previous);
  if (!places || !guard->next || !guard->previous) return qmat_fail_memory(context, "sharp features");
  guard->places = places;
  for (size_t f = 0; f < guard->feature_count; f++) places[f] = QMAT_NONE;
  for (size_t c = 0; c < creases->count; c++) {
    const size_t first = creases->starts[c], last = creases->starts[c + 1] - 1;
    for (size_t i = first; i <= last; i++) {
      guard->next[i] = i < last ? (uint32_t)i + 1 : QMAT_NONE;
      guard->previous[i] = i > first ? (uint32_t)i - 1 : QMAT_NONE;
      if (!creases->is_corner[creases->points[i]]) places[creases->points[i]] = (uint32_t)i;
    }
    if (creases->is_corner[creases->points[first]]) continue;
    /* A loop repeats its first point at the end; that place is not used. */
    places[creases->points[first]] = (uint32_t)first;
    guard->previous[first] = (uint32_t)last - 1;
    guard->next[last - 1] = (uint32_t)first;
  }
  guard->initial_next = copy_of(context, guard->next, count, sizeof *guard->next);
  return guard->initial_next ? QMAT_OK : qmat_fail_memory(context, "sharp features");
}

qmat_status qmat_crease_guard_renumber(qmat_context *context, const qmat_crease_guard *from, const uint32_t *ids,
                                       size_t vertex_count, qmat_crease_guard *guard) {
  *guard = *from;
  if (!from->features) return QMAT_OK;
  const size_t places = from->creases.starts[from->creases.count];
  guard->features = qmat_arena_alloc(&context->arena, vertex_count, sizeof *guard->features);
  guard->vertices = qmat_arena_alloc(&context->arena, from->feature_count, sizeof *guard->vertices);
  guard->next = copy_of(context, from->next, places, sizeof *guard->next);
  guard->previous = copy_of(context, from->previous, places, sizeof *guard->previous);
  if (!guard->features || !guard->vertices || !guard->next || !guard->previous)
    return qmat_fail_memory(context, "sharp features");
  for (size_t v = 0; v < vertex_count; v++) guard->features[v] = QMAT_NONE;
  for (size_t f = 0; f < from->feature_count; f++) {
    const uint32_t vertex = from->vertices[f];
    guard->vertices[f] = vertex == QMAT_NONE ? QMAT_NONE : ids[vertex];
    if (vertex != QMAT_NONE) guard->features[ids[vertex]] = (uint32_t)f;
  }
  return QMAT_OK;
}

static double distance_to_segment(const double *p, const double *a, const double *b) {
  double foot[3];
  const double t = qmat_closest_on_segment(p, a, b);
  for (int k = 0; k < 3; k++) foot[k] = a[k] + t * (b[k] - a[k]);
  return qmat_point_distance(p, foot);
}

/* The largest distance of the initial crease points between two places from the segment that joins the places. */
static double deviation(const qmat_crease_guard *g, uint32_t from, uint32_t to) {
  const double *a = point_at(g, from), *b = point_at(g, to);
  double most = 0;
  for (uint32_t i = g->initial_next[from]; i != to; i = g->initial_next[i])
    most = fmax(most, distance_to_segment(point_at(g, i), a, b));
  return most;
}

static uint32_t feature_at(const qmat_crease_guard *g, uint32_t place) {
  return place == QMAT_NONE ? QMAT_NONE : g->creases.points[place];
}

/* The distance of a crease from its remaining points when `feature` merges into `into`. INFINITY if it may not:
 * it is a corner, the two are not neighbours on the crease, or the crease would degenerate. */
static double error_without(const qmat_crease_guard *g, uint32_t feature, uint32_t into) {
  const uint32_t place = g->places[feature];
  if (place == QMAT_NONE) return INFINITY;
  const uint32_t next = g->next[place], previous = g->previous[place];
  const uint32_t after = feature_at(g, next), before = feature_at(g, previous);
  if ((into != after && into != before) || after == before || feature_at(g, g->next[next]) == before) return INFINITY;
  return deviation(g, previous, next);
}

bool qmat_crease_guard_restrict(const qmat_crease_guard *guard, const qmat_complex *complex,
                                const qmat_quadric *quadrics, uint32_t edge, double tolerance,
                                qmat_candidates *candidates, double *needed) {
  const uint32_t *ends = &complex->edges[2 * (size_t)edge];
  const bool is_feature[2] = {qmat_crease_guard_is_feature(guard, ends[0]),
                              qmat_crease_guard_is_feature(guard, ends[1])};
  *needed = INFINITY;
  if (!is_feature[0] && !is_feature[1]) return false;
  const bool is_last_inner = complex->live_vertices <= guard->left + 1;
  const qmat_quadric quadric = qmat_merged_quadric(complex, quadrics, edge);
  candidates->count = 0;
  for (int k = 0; k < 2; k++) {
    if (!is_feature[k]) continue;
    double error = is_last_inner ? INFINITY : 0;
    if (is_feature[1 - k]) error = error_without(guard, guard->features[ends[1 - k]], guard->features[ends[k]]);
    if (error <= tolerance && error < INFINITY)
      qmat_candidates_add(candidates, &quadric, &complex->spheres[4 * (size_t)ends[k]]);
    else
      *needed = fmin(*needed, error);
  }
  return true;
}

static void drop(qmat_crease_guard *g, uint32_t feature) {
  const uint32_t place = g->places[feature];
  g->next[g->previous[place]] = g->next[place];
  g->previous[g->next[place]] = g->previous[place];
  g->vertices[feature] = QMAT_NONE;
  g->left--;
}

void qmat_crease_guard_commit(qmat_crease_guard *g, const qmat_complex *complex, const qmat_collapse *collapse,
                              const double sphere[4]) {
  const uint32_t kept = collapse->kept, removed = collapse->removed;
  if (!g->features || removed == QMAT_NONE) return;
  uint32_t stays = g->features[kept], goes = g->features[removed];
  if (goes == QMAT_NONE) return;
  if (stays != QMAT_NONE) {
    const bool first =
        g->places[goes] != QMAT_NONE &&
        (g->places[stays] == QMAT_NONE || memcmp(&complex->spheres[4 * (size_t)kept], sphere, 4 * sizeof *sphere) == 0);
    if (!first) {
      const uint32_t swap = stays;
      stays = goes;
      goes = swap;
    }
    drop(g, goes);
  } else {
    stays = goes;
  }
  g->features[removed] = QMAT_NONE;
  g->features[kept] = stays;
  g->vertices[stays] = kept;
}

double qmat_crease_guard_error(const qmat_crease_guard *guard) {
  double most = 0;
  for (size_t c = 0; c < guard->creases.count; c++)
    for (size_t i = guard->creases.starts[c]; i < guard->creases.starts[c + 1]; i++)
      if (guard->next[i] != QMAT_NONE && guard->vertices[guard->creases.points[i]] != QMAT_NONE)
        most = fmax(most, deviation(guard, (uint32_t)i, guard->next[i]));
  return most;
}
