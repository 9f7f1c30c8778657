/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/free_pairs.h"

#include <string.h>

#include "core/geometry/medial_build.h"
#include "nodes/initial/item_queue.h"

static const size_t steps_per_report = 65536;

/* The simplices around a sphere or an edge: how many there are, and the exclusive or of their ids, which is the id of
 * the last one. */
typedef struct {
  uint32_t count, ids;
} incident;

/* An item is a triangle, or an edge with the number triangle_count + its id. */
typedef struct thinning {
  qmat_context *context;
  const qmat_medial *medial;
  const double *edge_measures, *triangle_measures;
  double threshold;
  uint32_t *sides;         /* 3 per triangle: the edge opposite each corner */
  incident *around_edge;   /* triangles */
  incident *around_sphere; /* edges */
  uint8_t *is_queued;      /* per item */
  uint8_t *edge_gone, *triangle_gone, *sphere_gone;
  qmat_item_queue queue;
  bool is_short; /* memory was */
} thinning;

/* --- the queue --------------------------------------------------------------------------------------------------- */

static void push(thinning *t, size_t item, double measure) {
  if (t->is_queued[item] || !(measure < t->threshold)) return;
  t->is_queued[item] = 1;
  t->is_short = qmat_queue_push(&t->queue, measure, item) || t->is_short;
}

/* Queues the edge if it has no triangle and is the last one at an end, the triangle that is the last one at the edge.
 */
static void queue_at_edge(thinning *t, uint32_t edge) {
  const incident *triangles = &t->around_edge[edge];
  if (triangles->count == 1) push(t, triangles->ids, t->triangle_measures[triangles->ids]);
  if (triangles->count > 0) return;
  const uint32_t *ends = &t->medial->edges[2 * (size_t)edge];
  if (t->around_sphere[ends[0]].count == 1 || t->around_sphere[ends[1]].count == 1)
    push(t, t->medial->triangle_count + edge, t->edge_measures[edge]);
}

/* --- removal ----------------------------------------------------------------------------------------------------- */

static void remove_edge(thinning *t, uint32_t edge) {
  t->edge_gone[edge] = 1;
  for (size_t k = 0; k < 2; k++) {
    incident *edges = &t->around_sphere[t->medial->edges[2 * (size_t)edge + k]];
    edges->count--;
    edges->ids ^= edge;
  }
  for (size_t k = 0; k < 2; k++) {
    const incident *edges = &t->around_sphere[t->medial->edges[2 * (size_t)edge + k]];
    if (edges->count == 1) queue_at_edge(t, edges->ids);
  }
}

static void remove_triangle(thinning *t, uint32_t triangle) {
  const uint32_t *sides = &t->sides[3 * (size_t)triangle];
  size_t free_side = 3; /* of equal ones the side of the lowest ids */
  for (size_t k = 0; k < 3; k++)
    if (t->around_edge[sides[k]].count == 1 &&
        (free_side == 3 || t->edge_measures[sides[k]] <= t->edge_measures[sides[free_side]]))
      free_side = k;
  t->triangle_gone[triangle] = 1;
  for (size_t k = 0; k < 3; k++) {
    t->around_edge[sides[k]].count--;
    t->around_edge[sides[k]].ids ^= triangle;
  }
  remove_edge(t, sides[free_side]);
  for (size_t k = 0; k < 3; k++)
    if (k != free_side) queue_at_edge(t, sides[k]);
}

static void remove_item(thinning *t, size_t item) {
  if (item < t->medial->triangle_count) {
    remove_triangle(t, (uint32_t)item);
    return;
  }
  const uint32_t edge = (uint32_t)(item - t->medial->triangle_count);
  const uint32_t *ends = &t->medial->edges[2 * (size_t)edge];
  t->sphere_gone[ends[t->around_sphere[ends[1]].count == 1]] = 1;
  remove_edge(t, edge);
}

/* --- the whole --------------------------------------------------------------------------------------------------- */

static qmat_status find_incidences(thinning *t) {
  const qmat_medial *m = t->medial;
  for (size_t e = 0; e < m->edge_count; e++) {
    for (size_t k = 0; k < 2; k++) {
      incident *edges = &t->around_sphere[m->edges[2 * e + k]];
      edges->count++;
      edges->ids ^= (uint32_t)e;
    }
  }
  const qmat_status status = qmat_medial_sides(t->context, m, t->sides);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < 3 * m->triangle_count; i++) {
    t->around_edge[t->sides[i]].count++;
    t->around_edge[t->sides[i]].ids ^= (uint32_t)(i / 3);
  }
  return QMAT_OK;
}

static size_t keep_simplices(uint32_t *rows, size_t count, size_t width, const uint8_t *gone, const uint32_t *numbers) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    if (gone[i]) continue;
    for (size_t k = 0; k < width; k++) rows[width * kept + k] = numbers[rows[width * i + k]];
    kept++;
  }
  return kept;
}

/* Takes what is gone out of the medial mesh. `numbers` has room for an id per sphere. */
static void leave_out(const thinning *t, qmat_medial *m, uint32_t *numbers) {
  size_t kept = 0, sheets = 0;
  uint32_t samples = 0;
  for (size_t i = 0; i < m->sphere_count; i++) {
    if (t->sphere_gone[i]) continue;
    numbers[i] = (uint32_t)kept;
    memmove(&m->spheres[4 * kept], &m->spheres[4 * i], 4 * sizeof *m->spheres);
    if (m->skinned_count > 0) {
      memmove(&m->joints[4 * kept], &m->joints[4 * i], 4 * sizeof *m->joints);
      memmove(&m->weights[4 * kept], &m->weights[4 * i], 4 * sizeof *m->weights);
    }
    if (m->region_offset_count > 0) {
      const uint32_t first = m->region_offsets[i], count = m->region_offsets[i + 1] - first;
      memmove(&m->region_samples[samples], &m->region_samples[first], count * sizeof *m->region_samples);
      m->region_offsets[kept] = samples; /* at most i: its own offset has been read */
      samples += count;
    }
    sheets += i < m->sheet_sphere_count;
    kept++;
  }
  if (m->region_offset_count > 0) {
    m->region_offsets[kept] = samples;
    m->region_offset_count = kept + 1;
    m->region_sample_count = samples;
  }
  if (m->skinned_count > 0) m->skinned_count = kept;
  m->sphere_count = kept;
  m->sheet_sphere_count = sheets;
  m->edge_count = keep_simplices(m->edges, m->edge_count, 2, t->edge_gone, numbers);
  m->triangle_count = keep_simplices(m->triangles, m->triangle_count, 3, t->triangle_gone, numbers);
}

qmat_status qmat_free_pairs_remove(qmat_context *context, qmat_medial *medial, const double *edge_measures,
                                   const double *triangle_measures, double threshold) {
  qmat_arena *arena = &context->arena;
  const size_t edges = medial->edge_count, triangles = medial->triangle_count, spheres = medial->sphere_count;
  thinning t = {context, medial, edge_measures, triangle_measures, threshold, .is_short = false};
  t.sides = qmat_arena_alloc(arena, triangles, 3 * sizeof *t.sides);
  t.around_edge = qmat_arena_calloc(arena, edges, sizeof *t.around_edge);
  t.around_sphere = qmat_arena_calloc(arena, spheres, sizeof *t.around_sphere);
  t.is_queued = qmat_arena_calloc(arena, edges + triangles, 1);
  t.edge_gone = qmat_arena_calloc(arena, edges, 1);
  t.triangle_gone = qmat_arena_calloc(arena, triangles, 1);
  t.sphere_gone = qmat_arena_calloc(arena, spheres, 1);
  uint32_t *numbers = qmat_arena_alloc(arena, spheres, sizeof *numbers);
  if (!t.sides || !t.around_edge || !t.around_sphere || !t.is_queued || !t.edge_gone || !t.triangle_gone ||
      !t.sphere_gone || !numbers)
    return qmat_fail_memory(context, "the thinning of the medial mesh");
  qmat_status status = find_incidences(&t);
  if (status != QMAT_OK) return status;
  for (size_t e = 0; e < edges; e++) queue_at_edge(&t, (uint32_t)e);
  for (size_t steps = 0; status == QMAT_OK && t.queue.count > 0; steps++) {
    if (steps % steps_per_report == 0) status = qmat_progress(context, 0, 0, "pairs");
    remove_item(&t, qmat_queue_pop(&t.queue).item);
  }
  qmat_free(t.queue.items);
  if (status == QMAT_OK && t.is_short) status = qmat_fail_memory(context, "the thinning of the medial mesh");
  if (status == QMAT_OK) leave_out(&t, medial, numbers);
  return status;
}
