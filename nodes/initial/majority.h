/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_MAJORITY_H
#define QMAT_NODES_INITIAL_MAJORITY_H

#include "core/context.h"

typedef struct qmat_vote {
  uint32_t group, choice;
} qmat_vote;

/* Per group of `group_count`, the choice of most of its votes, the smallest of several; undefined for a group without a
 * vote. Sorts the `count` votes. The result, in the context's arena, is NULL when memory is short. */
uint32_t *qmat_majorities(qmat_context *context, qmat_vote *votes, size_t count, size_t group_count);

#endif
