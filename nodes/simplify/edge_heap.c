/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/edge_heap.h"

/* Whether edge `a` comes before edge `b` of the same cost. A collapse renames the ends of edges in the heap, but never
 * an edge. */
static bool decide_tie(const qmat_edge_heap *h, uint32_t a, uint32_t b) {
  return h->errors[a] != h->errors[b] ? h->errors[a] < h->errors[b] : a < b;
}

static inline bool comes_first(const qmat_edge_heap *h, const qmat_heap_entry *a, const qmat_heap_entry *b) {
  return a->cost != b->cost ? a->cost < b->cost : decide_tie(h, a->edge, b->edge);
}

static void put(qmat_edge_heap *h, size_t place, qmat_heap_entry entry) {
  h->entries[place] = entry;
  h->places[entry.edge] = (uint32_t)place;
}

enum { CHILDREN = 4 };

static void sift_up(qmat_edge_heap *h, size_t place) {
  const qmat_heap_entry entry = h->entries[place];
  for (size_t above; place > 0 && comes_first(h, &entry, &h->entries[above = (place - 1) / CHILDREN]); place = above)
    put(h, place, h->entries[above]);
  put(h, place, entry);
}

static void sift_down(qmat_edge_heap *h, size_t place) {
  const qmat_heap_entry entry = h->entries[place];
  for (;;) {
    const size_t first = CHILDREN * place + 1, end = first + CHILDREN < h->count ? first + CHILDREN : h->count;
    if (first >= h->count) break;
    size_t least = first;
    for (size_t i = first + 1; i < end; i++)
      if (comes_first(h, &h->entries[i], &h->entries[least])) least = i;
    if (!comes_first(h, &h->entries[least], &entry)) break;
    put(h, place, h->entries[least]);
    place = least;
  }
  put(h, place, entry);
}

void qmat_edge_heap_remove(qmat_edge_heap *h, uint32_t edge) {
  const uint32_t place = h->places[edge];
  if (place == QMAT_NONE) return;
  h->places[edge] = QMAT_NONE;
  const qmat_heap_entry last = h->entries[--h->count];
  if (last.edge == edge) return;
  put(h, place, last);
  sift_up(h, place);
  sift_down(h, h->places[last.edge]);
}

void qmat_edge_heap_update(qmat_edge_heap *h, uint32_t edge) {
  if (h->places[edge] == QMAT_NONE) h->places[edge] = (uint32_t)h->count++;
  put(h, h->places[edge], (qmat_heap_entry){h->costs[edge], edge});
  sift_up(h, h->places[edge]);
  sift_down(h, h->places[edge]);
}

qmat_status qmat_edge_heap_init(qmat_context *context, qmat_edge_heap *h, const qmat_complex *complex) {
  qmat_arena *arena = &context->arena;
  const size_t count = complex->edge_count;
  *h = (qmat_edge_heap){.complex = complex};
  h->costs = qmat_arena_alloc(arena, count, sizeof *h->costs);
  h->errors = qmat_arena_alloc(arena, count, sizeof *h->errors);
  h->entries = qmat_arena_alloc(arena, count, sizeof *h->entries);
  h->places = qmat_arena_alloc(arena, count, sizeof *h->places);
  if (!h->costs || !h->errors || !h->entries || !h->places) return qmat_fail_memory(context, "the heap of edges");
  for (size_t e = 0; e < count; e++) h->places[e] = QMAT_NONE;
  return QMAT_OK;
}

void qmat_edge_heap_fill(qmat_edge_heap *h, const uint8_t *locked) {
  h->count = 0;
  for (size_t e = 0; e < h->complex->edge_count; e++) {
    const uint32_t *ends = &h->complex->edges[2 * e];
    if (!locked || !(locked[ends[0]] || locked[ends[1]]))
      put(h, h->count++, (qmat_heap_entry){h->costs[e], (uint32_t)e});
  }
  for (size_t i = (h->count + CHILDREN - 2) / CHILDREN; i-- > 0;) sift_down(h, i);
}
