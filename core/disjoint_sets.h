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

#endif
