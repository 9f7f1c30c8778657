/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/edge_heap.h"

static bool comes_first(const qmat_edge_heap *h, uint32_t a, uint32_t b) {
  if (h->costs[a] != h->costs[b]) return h->costs[a] < h->costs[b];
  if (h->errors[a] != h->errors[b]) return h->errors[a] < h->errors[b];
  const uint32_t *p = &h->complex->edges[2 * (size_t)a], *q = &h->complex->edges[2 * (size_t)b];
  const uint32_t low_p = p[0] < p[1] ? p[0] : p[1], low_q = q[0] < q[1] ? q[0] : q[1];
  if (low_p != low_q) return low_p < low_q;
  return (p[0] < p[1] ? p[1] : p[0]) < (q[0] < q[1] ? q[1] : q[0]);
}

static void put(qmat_edge_heap *h, size_t place, uint32_t edge) {
  h->edges[place] = edge;
  h->places[edge] = (uint32_t)place;
}

static void sift_up(qmat_edge_heap *h, size_t place) {
  const uint32_t edge = h->edges[place];
  for (; place > 0 && comes_first(h, edge, h->edges[(place - 1) / 2]); place = (place - 1) / 2)
    put(h, place, h->edges[(place - 1) / 2]);
  put(h, place, edge);
}

static void sift_down(qmat_edge_heap *h, size_t place) {
  const uint32_t edge = h->edges[place];
  for (;;) {
    size_t child = 2 * place + 1;
    if (child >= h->count) break;
    if (child + 1 < h->count && comes_first(h, h->edges[child + 1], h->edges[child])) child++;
    if (!comes_first(h, h->edges[child], edge)) break;
    put(h, place, h->edges[child]);
    place = child;
  }
  put(h, place, edge);
}

void qmat_edge_heap_remove(qmat_edge_heap *h, uint32_t edge) {
  const uint32_t place = h->places[edge];
  if (place == QMAT_NONE) return;
  h->places[edge] = QMAT_NONE;
  const uint32_t last = h->edges[--h->count];
  if (last == edge) return;
  put(h, place, last);
  sift_up(h, place);
  sift_down(h, h->places[last]);
}

void qmat_edge_heap_update(qmat_edge_heap *h, uint32_t edge) {
  if (h->places[edge] == QMAT_NONE) put(h, h->count++, edge);
  sift_up(h, h->places[edge]);
  sift_down(h, h->places[edge]);
}

qmat_status qmat_edge_heap_init(qmat_context *context, qmat_edge_heap *h, const qmat_complex *complex) {
  qmat_arena *arena = &context->arena;
  const size_t count = complex->edge_count;
  *h = (qmat_edge_heap){.complex = complex};
  h->costs = qmat_arena_alloc(arena, count, sizeof *h->costs);
  h->errors = qmat_arena_alloc(arena, count, sizeof *h->errors);
  h->edges = qmat_arena_alloc(arena, count, sizeof *h->edges);
  h->places = qmat_arena_alloc(arena, count, sizeof *h->places);
  if (!h->costs || !h->errors || !h->edges || !h->places) return qmat_fail_memory(context, "the heap of edges");
  for (size_t e = 0; e < count; e++) h->places[e] = QMAT_NONE;
  return QMAT_OK;
}

void qmat_edge_heap_fill(qmat_edge_heap *h) {
  h->count = h->complex->edge_count;
  for (size_t e = 0; e < h->count; e++) put(h, e, (uint32_t)e);
  for (size_t i = h->count / 2; i-- > 0;) sift_down(h, i);
}
