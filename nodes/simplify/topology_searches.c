/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/topology_searches.h"

#include <stdlib.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/vector.h"
#include "core/value_check.h"

static int compare_rows(const uint32_t *a, const uint32_t *b, size_t length) {
  for (size_t k = 0; k < length; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

/* The first of `count` sorted rows of `length` ids that is not less than `row`. */
static size_t first_row(const uint32_t *rows, size_t count, size_t length, const uint32_t *row) {
  size_t first = 0, last = count;
  while (first < last) {
    const size_t middle = first + (last - first) / 2;
    if (compare_rows(&rows[length * middle], row, length) < 0)
      first = middle + 1;
    else
      last = middle;
  }
  return first;
}

qmat_status qmat_topology_find_empty_triangles(qmat_context *context, const qmat_medial *medial, uint32_t **corners,
                                               size_t *count) {
  const uint32_t *edges = medial->edges;
  for (int pass = 0;; pass++) {
    *count = 0;
    for (size_t e = 0; e < medial->edge_count; e++) {
      const uint32_t lowest[2] = {edges[2 * e + 1], 0};
      for (size_t next = first_row(edges, medial->edge_count, 2, lowest);
           next < medial->edge_count && edges[2 * next] == lowest[0]; next++) {
        const uint32_t triangle[3] = {edges[2 * e], lowest[0], edges[2 * next + 1]};
        const uint32_t third[2] = {triangle[0], triangle[2]};
        if (qmat_simplex_find(edges, medial->edge_count, 2, third) == SIZE_MAX ||
            qmat_simplex_find(medial->triangles, medial->triangle_count, 3, triangle) != SIZE_MAX)
          continue;
        if (pass == 1) memcpy(&(*corners)[3 * *count], triangle, sizeof triangle);
        ++*count;
      }
    }
    if (pass == 1) return QMAT_OK;
    *corners = qmat_arena_alloc(&context->arena, *count, 3 * sizeof **corners);
    if (!*corners) return qmat_fail_memory(context, "the topology");
  }
}

/* What a depth-first search knows of each sphere. */
typedef struct search {
  size_t *next, *ends;   /* its rest of `links`: of the edges at it */
  uint32_t *order, *low; /* when it was reached, from 1; the earliest that is reached from it without `via` */
  uint32_t *via, *stack; /* the edge by which it was reached; the way to the current sphere */
  uint32_t *links;
} search;

static qmat_status search_init(qmat_context *context, const qmat_medial *medial, search *s) {
  qmat_arena *arena = &context->arena;
  const size_t spheres = medial->sphere_count, ends = 2 * medial->edge_count;
  *s = (search){.next = qmat_arena_calloc(arena, spheres + 1, sizeof *s->next),
                .ends = qmat_arena_alloc(arena, spheres + 1, sizeof *s->ends),
                .order = qmat_arena_calloc(arena, spheres, sizeof *s->order),
                .low = qmat_arena_alloc(arena, spheres, sizeof *s->low),
                .via = qmat_arena_alloc(arena, spheres, sizeof *s->via),
                .stack = qmat_arena_alloc(arena, spheres, sizeof *s->stack),
                .links = qmat_arena_alloc(arena, ends, sizeof *s->links)};
  if (!s->next || !s->ends || !s->order || !s->low || !s->via || !s->stack || !s->links)
    return qmat_fail_memory(context, "the topology");
  for (size_t i = 0; i < ends; i++) s->next[medial->edges[i] + 1]++;
  for (size_t v = 0; v < spheres; v++) s->next[v + 1] += s->next[v];
  memcpy(s->ends, s->next, (spheres + 1) * sizeof *s->ends);
  for (size_t i = 0; i < ends; i++) s->links[s->ends[medial->edges[i]]++] = (uint32_t)(i / 2);
  return QMAT_OK;
}

/* Unmarks the edges without which their ends are not connected (bridges; Tarjan 1974) among those reached from `root`.
 */
static void unmark_bridges(const qmat_medial *medial, search *s, uint32_t root, uint32_t *time, bool *marks) {
  size_t depth = 1;
  s->stack[0] = root;
  s->order[root] = s->low[root] = ++*time;
  s->via[root] = UINT32_MAX;
  while (depth > 0) {
    const uint32_t v = s->stack[depth - 1];
    if (s->next[v] < s->ends[v]) {
      const uint32_t edge = s->links[s->next[v]++], *ends = &medial->edges[2 * (size_t)edge];
      const uint32_t other = ends[0] == v ? ends[1] : ends[0];
      if (edge == s->via[v]) continue;
      if (s->order[other] > 0) {
        if (s->order[other] < s->low[v]) s->low[v] = s->order[other];
        continue;
      }
      s->order[other] = s->low[other] = ++*time;
      s->via[other] = edge;
      s->stack[depth++] = other;
    } else if (--depth > 0) {
      const uint32_t before = s->stack[depth - 1];
      if (s->low[v] < s->low[before]) s->low[before] = s->low[v];
      if (s->low[v] > s->order[before]) marks[s->via[v]] = false;
    }
  }
}

typedef struct edge_length {
  double length;
  uint32_t edge;
} edge_length;

static int by_length(const void *left, const void *right) {
  const edge_length *a = left, *b = right;
  if (a->length != b->length) return a->length < b->length ? -1 : 1;
  return (a->edge > b->edge) - (a->edge < b->edge);
}

qmat_status qmat_topology_find_loop_edges(qmat_context *context, const qmat_medial *medial, uint32_t **edges,
                                          size_t *count) {
  qmat_arena *arena = &context->arena;
  search s;
  bool *marks = qmat_arena_alloc(arena, medial->edge_count, sizeof *marks);
  uint32_t *sides = qmat_arena_alloc(arena, medial->triangle_count, 3 * sizeof *sides);
  edge_length *found = qmat_arena_alloc(arena, medial->edge_count, sizeof *found);
  *edges = qmat_arena_alloc(arena, medial->edge_count, sizeof **edges);
  *count = 0;
  if (!marks || !sides || !found || !*edges) return qmat_fail_memory(context, "the topology");
  qmat_status status = search_init(context, medial, &s);
  if (status == QMAT_OK) status = qmat_medial_sides(context, medial, sides);
  if (status != QMAT_OK) return status;
  memset(marks, true, medial->edge_count * sizeof *marks);
  uint32_t time = 0;
  for (uint32_t v = 0; v < medial->sphere_count; v++)
    if (s.order[v] == 0) unmark_bridges(medial, &s, v, &time, marks);
  for (size_t i = 0; i < 3 * medial->triangle_count; i++) marks[sides[i]] = false;
  for (uint32_t e = 0; e < medial->edge_count; e++) {
    const uint32_t *ends = &medial->edges[2 * (size_t)e];
    const double length =
        qmat_point_distance(&medial->spheres[4 * (size_t)ends[0]], &medial->spheres[4 * (size_t)ends[1]]);
    if (marks[e]) found[(*count)++] = (edge_length){length, e};
  }
  qsort(found, *count, sizeof *found, by_length);
  for (size_t i = 0; i < *count; i++) (*edges)[i] = found[i].edge;
  return QMAT_OK;
}
