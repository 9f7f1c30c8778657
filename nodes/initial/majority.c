/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/majority.h"

#include <stdlib.h>

static int compare_votes(const void *left, const void *right) {
  const qmat_vote *p = left, *q = right;
  if (p->group != q->group) return p->group < q->group ? -1 : 1;
  return p->choice < q->choice ? -1 : p->choice > q->choice;
}

uint32_t *qmat_majorities(qmat_context *context, qmat_vote *votes, size_t count, size_t group_count) {
  uint32_t *choices = qmat_arena_alloc(&context->arena, group_count, sizeof *choices);
  size_t *most = qmat_arena_calloc(&context->arena, group_count, sizeof *most);
  if (!choices || !most) return NULL;
  qsort(votes, count, sizeof *votes, compare_votes);
  for (size_t first = 0, last; first < count; first = last) {
    for (last = first; last < count && compare_votes(&votes[first], &votes[last]) == 0;) last++;
    const uint32_t group = votes[first].group;
    if (last - first <= most[group]) continue;
    most[group] = last - first;
    choices[group] = votes[first].choice;
  }
  return choices;
}
