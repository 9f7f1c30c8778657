/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_DISJOINT_SETS_H
#define QMAT_CORE_DISJOINT_SETS_H

#include "core/context.h"

/* Disjoint sets of the items 0, 1, 2, ... (union-find). leaders[i] is an item of i's set, or i itself when i is the
 * set's leader. The smallest item leads, so results do not depend on the order of the joins. */

/* Makes `count` sets of one item each in the context's arena; NULL when memory is short. */
static inline uint32_t *qmat_sets_new(qmat_context *context, size_t count) {
  uint32_t *leaders = (uint32_t *)qmat_arena_alloc(&context->arena, count, sizeof *leaders);
  for (size_t i = 0; leaders && i < count; i++) leaders[i] = (uint32_t)i;
  return leaders;
}

/* The leader of an item's set. Shortens the path to it. Cost: nearly constant. */
static inline uint32_t qmat_set_leader(uint32_t *leaders, uint32_t item) {
  while (leaders[item] != item) {
    leaders[item] = leaders[leaders[item]];
    item = leaders[item];
  }
  return item;
}

/* Joins two sets; false when they are one set already. */
static inline bool qmat_sets_join(uint32_t *leaders, uint32_t a, uint32_t b) {
  a = qmat_set_leader(leaders, a);
  b = qmat_set_leader(leaders, b);
  if (a < b) leaders[b] = a;
  if (b < a) leaders[a] = b;
  return a != b;
}

/* Counts the connected components of a graph of `count` items and `edge_count` edges, two items each. Scratch memory is
 * the context's arena. QMAT_ERROR_MEMORY. Cost: nearly linear. */
static inline qmat_status qmat_sets_count(qmat_context *context, size_t count, const uint32_t *edges, size_t edge_count,
                                          size_t *components) {
  *components = count;
  uint32_t *leaders = qmat_sets_new(context, count);
  if (!leaders) return qmat_fail_memory(context, "components");
  for (size_t e = 0; e < edge_count; e++) *components -= qmat_sets_join(leaders, edges[2 * e], edges[2 * e + 1]);
  return QMAT_OK;
}

#endif
