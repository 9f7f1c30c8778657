/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/medial_topology.h"

#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/medial_build.h"

/* The limit of the entries that the reduction of the matrix visits. */
static const size_t most_entries = 100000000;

/* Progress is reported each time after so many entries, edges or triangles. */
enum { ITEMS_A_REPORT = 1 << 16 };

/* The triangles at each edge, in compressed rows, and the number of those not removed. */
typedef struct sides {
  size_t triangle_count, edge_count;
  uint32_t *edges_of; /* 3 a triangle */
  size_t *offsets;
  uint32_t *triangles_at, *degrees;
  uint8_t *removed; /* per triangle */
} sides;

static qmat_status find_sides(qmat_context *context, const qmat_medial *medial, sides *s) {
  qmat_arena *arena = &context->arena;
  const size_t triangles = medial->triangle_count, edges = medial->edge_count;
  *s = (sides){.triangle_count = triangles, .edge_count = edges};
  s->edges_of = qmat_arena_alloc(arena, triangles, 3 * sizeof *s->edges_of);
  s->offsets = qmat_arena_calloc(arena, edges + 2, sizeof *s->offsets);
  s->triangles_at = qmat_arena_alloc(arena, triangles, 3 * sizeof *s->triangles_at);
  s->degrees = qmat_arena_calloc(arena, edges, sizeof *s->degrees);
  s->removed = qmat_arena_calloc(arena, triangles, sizeof *s->removed);
  if (!s->edges_of || !s->offsets || !s->triangles_at || !s->degrees || !s->removed)
    return qmat_fail_memory(context, "the topology");
  const qmat_status status = qmat_medial_sides(context, medial, s->edges_of);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < 3 * triangles; i++) {
    s->offsets[s->edges_of[i] + 2]++;
    s->degrees[s->edges_of[i]]++;
  }
  for (size_t e = 0; e < edges; e++) s->offsets[e + 2] += s->offsets[e + 1];
  for (size_t i = 0; i < 3 * triangles; i++) s->triangles_at[s->offsets[s->edges_of[i] + 1]++] = (uint32_t)(i / 3);
  return QMAT_OK;
}

/* Removes triangles at edges of one triangle until there is none: no cycle contains such a triangle. */
static qmat_status remove_free(qmat_context *context, sides *s, size_t *left) {
  uint32_t *stack = qmat_arena_alloc(&context->arena, 3 * s->triangle_count + s->edge_count, sizeof *stack);
  if (!stack) return qmat_fail_memory(context, "the topology");
  size_t height = 0;
  for (size_t e = 0; e < s->edge_count; e++)
    if (s->degrees[e] == 1) stack[height++] = (uint32_t)e;
  *left = s->triangle_count;
  while (height > 0) {
    const uint32_t edge = stack[--height];
    if (s->degrees[edge] != 1) continue;
    if (*left % ITEMS_A_REPORT == 0) {
      const qmat_status status = qmat_progress(context, s->triangle_count - *left + 1, 0, "triangles at free edges");
      if (status != QMAT_OK) return status;
    }
    size_t at = s->offsets[edge];
    while (s->removed[s->triangles_at[at]]) at++;
    const uint32_t triangle = s->triangles_at[at];
    s->removed[triangle] = 1;
    --*left;
    for (size_t k = 0; k < 3; k++) {
      const uint32_t side = s->edges_of[3 * (size_t)triangle + k];
      if (--s->degrees[side] == 1) stack[height++] = side;
    }
  }
  return QMAT_OK;
}

static int compare_ids(const void *left, const void *right) {
  const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
  return (a > b) - (a < b);
}

/* Sorts ids and keeps those that occur an odd number of times. */
static size_t keep_odd(uint32_t *ids, size_t count) {
  qsort(ids, count, sizeof *ids, compare_ids);
  size_t kept = 0;
  for (size_t i = 0, end; i < count; i = end) {
    for (end = i; end < count && ids[end] == ids[i];) end++;
    if ((end - i) % 2) ids[kept++] = ids[i];
  }
  return kept;
}

/* The symmetric difference of two rising lists. */
static size_t add_rows(const uint32_t *a, size_t a_count, const uint32_t *b, size_t b_count, uint32_t *sum) {
  size_t count = 0, i = 0, j = 0;
  while (i < a_count || j < b_count) {
    if (j == b_count || (i < a_count && a[i] < b[j]))
      sum[count++] = a[i++];
    else if (i == a_count || b[j] < a[i])
      sum[count++] = b[j++];
    else
      i++, j++;
  }
  return count;
}

typedef struct sparse_row {
  uint32_t *ids;
  size_t count;
} sparse_row;

/* The rank of the matrix whose rows are the edges of three or more triangles, and whose columns are sheets: triangles
 * joined by edges of two. `*known` becomes false when it takes too long. */
static qmat_status rank_of_branches(qmat_context *context, const sides *s, uint32_t *sheets, size_t *rank,
                                    bool *known) {
  qmat_arena *arena = &context->arena;
  sparse_row *pivots = qmat_arena_calloc(arena, s->triangle_count, sizeof *pivots);
  uint32_t *buffers[2] = {NULL, NULL};
  size_t capacities[2] = {0, 0}, entries = 0, reported = 0;
  qmat_status status = pivots ? QMAT_OK : qmat_fail_memory(context, "the topology");
  *rank = 0;
  for (size_t e = 0; e < s->edge_count && status == QMAT_OK && *known; e++) {
    if (s->degrees[e] < 3) continue;
    size_t count = 0;
    int in = 0;
    if (qmat_grow((void **)&buffers[0], &capacities[0], s->degrees[e], sizeof **buffers)) {
      status = qmat_fail_memory(context, "the topology");
      break;
    }
    for (size_t at = s->offsets[e]; at < s->offsets[e + 1]; at++)
      if (!s->removed[s->triangles_at[at]]) buffers[0][count++] = qmat_set_leader(sheets, s->triangles_at[at]);
    count = keep_odd(buffers[0], count);
    while (count > 0) {
      sparse_row *pivot = &pivots[buffers[in][count - 1]];
      entries += count + pivot->count;
      if (entries > most_entries) {
        *known = false;
        break;
      }
      if (entries - reported >= ITEMS_A_REPORT) {
        reported = entries;
        status = qmat_progress(context, entries, 0, "entries of voids");
        if (status != QMAT_OK) break;
      }
      if (pivot->count == 0) {
        pivot->ids = qmat_arena_alloc(arena, count, sizeof *pivot->ids);
        if (!pivot->ids) {
          status = qmat_fail_memory(context, "the topology");
          break;
        }
        memcpy(pivot->ids, buffers[in], count * sizeof *pivot->ids);
        pivot->count = count;
        ++*rank;
        break;
      }
      if (qmat_grow((void **)&buffers[1 - in], &capacities[1 - in], count + pivot->count, sizeof **buffers)) {
        status = qmat_fail_memory(context, "the topology");
        break;
      }
      count = add_rows(buffers[in], count, pivot->ids, pivot->count, buffers[1 - in]);
      in = 1 - in;
    }
  }
  qmat_free(buffers[0]);
  qmat_free(buffers[1]);
  return status;
}

/* The dimension of the cycles of triangles. */
static qmat_status count_voids(qmat_context *context, const qmat_medial *medial, size_t *voids, bool *known) {
  sides s;
  size_t left = 0, rank = 0;
  qmat_status status = find_sides(context, medial, &s);
  if (status == QMAT_OK) status = remove_free(context, &s, &left);
  if (status != QMAT_OK) return status;
  uint32_t *sheets = qmat_sets_new(context, s.triangle_count);
  if (!sheets) return qmat_fail_memory(context, "the topology");
  size_t sheet_count = left;
  for (size_t e = 0; e < s.edge_count; e++) {
    if (s.degrees[e] != 2) continue;
    uint32_t pair[2];
    size_t found = 0;
    for (size_t at = s.offsets[e]; found < 2; at++)
      if (!s.removed[s.triangles_at[at]]) pair[found++] = s.triangles_at[at];
    sheet_count -= qmat_sets_join(sheets, pair[0], pair[1]);
  }
  status = rank_of_branches(context, &s, sheets, &rank, known);
  *voids = sheet_count - rank;
  return status;
}

qmat_status qmat_topology_find_walls(qmat_context *context, const qmat_medial *medial, uint32_t **walls,
                                     size_t *count) {
  sides s;
  size_t left;
  *count = 0;
  qmat_status status = find_sides(context, medial, &s);
  if (status == QMAT_OK) status = remove_free(context, &s, &left);
  if (status != QMAT_OK) return status;
  *walls = qmat_arena_alloc(&context->arena, left, sizeof **walls);
  if (!*walls) return qmat_fail_memory(context, "the topology");
  for (size_t t = 0; t < medial->triangle_count; t++)
    if (!s.removed[t]) (*walls)[(*count)++] = (uint32_t)t;
  return QMAT_OK;
}

qmat_status qmat_topology_of_medial(qmat_context *context, const qmat_medial *medial, qmat_topology *topology) {
  *topology = (qmat_topology){.known = true};
  topology->euler = (int64_t)medial->sphere_count - (int64_t)medial->edge_count + (int64_t)medial->triangle_count;
  qmat_status status =
      qmat_sets_count(context, medial->sphere_count, medial->edges, medial->edge_count, &topology->components);
  if (status == QMAT_OK) status = count_voids(context, medial, &topology->voids, &topology->known);
  topology->loops = (size_t)((int64_t)(topology->components + topology->voids) - topology->euler);
  return status;
}
