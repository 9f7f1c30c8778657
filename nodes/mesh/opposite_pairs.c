/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/opposite_pairs.h"

#include <stdlib.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"

/* Half-edges between two polls for a cancel. */
enum { POLL = 65536 };

/* A triangle at the edge of its two lowest corners. */
typedef struct wing {
  uint32_t third, triangle;
  bool rises;
} wing;

static int compare_wings(const void *left, const void *right) {
  const wing *a = left, *b = right;
  if (a->third != b->third) return a->third < b->third ? -1 : 1;
  if (a->rises != b->rises) return a->rises ? -1 : 1;
  return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

/* Pairs wings of the same corners: the first that rises with the first that falls, and so on. */
static void pair_wings(wing *wings, size_t count, uint8_t *classes) {
  if (count < 2) return;
  qsort(wings, count, sizeof *wings, compare_wings);
  for (size_t first = 0, last; first < count; first = last) {
    size_t falls = first;
    while (falls < count && wings[falls].third == wings[first].third && wings[falls].rises) falls++;
    for (last = falls; last < count && wings[last].third == wings[first].third;) last++;
    for (size_t i = first, k = falls; i < falls && k < last; i++, k++) {
      const uint32_t a = wings[i].triangle, b = wings[k].triangle;
      classes[a < b ? a : b] = 1;
      classes[a < b ? b : a] = 2;
    }
  }
}

qmat_status qmat_find_opposite_pairs(qmat_context *context, size_t vertex_count, size_t count,
                                     const uint32_t *triangles, uint8_t *classes) {
  qmat_half_edges e;
  qmat_status status = qmat_half_edges_sort(context, vertex_count, count, triangles, &e);
  wing *wings = NULL;
  size_t capacity = 0;
  for (size_t first = 0, last, poll = 0; status == QMAT_OK && first < e.count; first = last) {
    last = qmat_edge_last(&e, first);
    const uint32_t high = qmat_half_edge_high(&e, e.order[first]);
    size_t found = 0;
    if (last - first > capacity && qmat_grow((void **)&wings, &capacity, last - first, sizeof *wings) != 0)
      status = qmat_fail_memory(context, "the opposite triangles");
    for (size_t i = first; status == QMAT_OK && i < last; i++) {
      const uint32_t h = e.order[i], third = qmat_half_edge_across(&e, h);
      if (third > high) wings[found++] = (wing){third, h / 3, qmat_half_edge_rises(&e, h)};
    }
    pair_wings(wings, found, classes);
    if (status == QMAT_OK && last >= poll) {
      status = qmat_progress(context, first, e.count, "edges");
      poll = last + POLL;
    }
  }
  qmat_free(wings);
  return status;
}

qmat_status qmat_count_connected(qmat_context *context, size_t vertex_count, size_t count, const uint32_t *triangles,
                                 size_t *sets) {
  *sets = 0;
  if (count == 0) return QMAT_OK;
  uint32_t *leaders = qmat_sets_new(context, vertex_count);
  uint8_t *is_counted = qmat_arena_calloc(&context->arena, vertex_count, 1);
  if (!leaders || !is_counted) return qmat_fail_memory(context, "the sheets");
  for (size_t i = 0; i < 3 * count; i++) qmat_sets_join(leaders, triangles[i], triangles[i - i % 3]);
  for (size_t i = 0; i < 3 * count; i += 3) {
    uint8_t *counted = &is_counted[qmat_set_leader(leaders, triangles[i])];
    *sets += !*counted;
    *counted = 1;
  }
  return QMAT_OK;
}
