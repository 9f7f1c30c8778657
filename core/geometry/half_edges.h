/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_HALF_EDGES_H
#define QMAT_CORE_GEOMETRY_HALF_EDGES_H

#include "core/context.h"

/* The half-edges of a triangle mesh sorted by edge. Half-edge 3 * t + k goes from corner k to the next of triangle t.
 */
typedef struct qmat_half_edges {
  const uint32_t *triangles;
  size_t count;    /* 3 per triangle, below 2^32 */
  uint32_t *order; /* count: by lower end, higher end, number */
  uint32_t *spare; /* count: what sorting has left, for any use */
} qmat_half_edges;

/* The next one around its triangle. */
static inline uint32_t qmat_half_edge_next(uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}

static inline uint32_t qmat_half_edge_start(const qmat_half_edges *e, uint32_t h) {
  return e->triangles[h];
}

static inline uint32_t qmat_half_edge_end(const qmat_half_edges *e, uint32_t h) {
  return e->triangles[qmat_half_edge_next(h)];
}

/* The corner of its triangle across from it. */
static inline uint32_t qmat_half_edge_across(const qmat_half_edges *e, uint32_t h) {
  return e->triangles[h % 3 == 0 ? h + 2 : h - 1];
}

/* Whether it leads from the lower to the higher end. */
static inline bool qmat_half_edge_rises(const qmat_half_edges *e, uint32_t h) {
  return qmat_half_edge_start(e, h) < qmat_half_edge_end(e, h);
}

static inline uint32_t qmat_half_edge_low(const qmat_half_edges *e, uint32_t h) {
  return qmat_half_edge_rises(e, h) ? qmat_half_edge_start(e, h) : qmat_half_edge_end(e, h);
}

static inline uint32_t qmat_half_edge_high(const qmat_half_edges *e, uint32_t h) {
  return qmat_half_edge_rises(e, h) ? qmat_half_edge_end(e, h) : qmat_half_edge_start(e, h);
}

/* The half-edges of one edge are order[first] to order[the result - 1]. */
static inline size_t qmat_edge_last(const qmat_half_edges *e, size_t first) {
  const uint32_t low = qmat_half_edge_low(e, e->order[first]), high = qmat_half_edge_high(e, e->order[first]);
  size_t last = first + 1;
  while (last < e->count && qmat_half_edge_low(e, e->order[last]) == low &&
         qmat_half_edge_high(e, e->order[last]) == high)
    last++;
  return last;
}

/* Sorts them in the context's arena. `triangles` (3 * triangle_count) must stay. QMAT_ERROR_MEMORY. Cost: linear. */
static inline qmat_status qmat_half_edges_sort(qmat_context *context, size_t vertex_count, size_t triangle_count,
                                               const uint32_t *triangles, qmat_half_edges *e) {
  qmat_arena *arena = &context->arena;
  *e = (qmat_half_edges){triangles, 3 * triangle_count, NULL, NULL};
  uint32_t *order = (uint32_t *)qmat_arena_alloc(arena, e->count, sizeof *order),
           *swap = (uint32_t *)qmat_arena_alloc(arena, e->count, sizeof *swap);
  size_t *starts = (size_t *)qmat_arena_alloc(arena, vertex_count + 1, sizeof *starts);
  if (!order || !swap || !starts) return qmat_fail_memory(context, "the edges of the mesh");
  for (int pass = 0; pass < 2; pass++) {
    for (size_t i = 0; i <= vertex_count; i++) starts[i] = 0;
    for (uint32_t h = 0; h < e->count; h++) starts[(pass ? qmat_half_edge_low(e, h) : qmat_half_edge_high(e, h)) + 1]++;
    for (size_t i = 0; i < vertex_count; i++) starts[i + 1] += starts[i];
    for (uint32_t i = 0; i < e->count; i++) {
      if (pass == 0)
        swap[starts[qmat_half_edge_high(e, i)]++] = i;
      else
        order[starts[qmat_half_edge_low(e, swap[i])]++] = swap[i];
    }
  }
  e->order = order;
  e->spare = swap;
  return QMAT_OK;
}

#endif
