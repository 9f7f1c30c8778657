/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_LISTS_H
#define QMAT_GRAPHS_RUN_RUN_LISTS_H

#include <pthread.h>

#include "graphs/run/run.h"

/* Running a step over lists. A node whose input takes single values runs once per item of the list that it is given,
 * and its outputs are lists of the same names. */

/* The length of the lists that a step runs over; 0: it runs once. `*first` is the first such list. QMAT_ERROR_USAGE:
 * two lists differ in length. */
qmat_status qmat_count_lifted(qmat_context *context, const qmat_node *type, const qmat_value *const *inputs,
                              size_t *count, const qmat_list **first);

/* Runs `one`, the plan of a single step for a single item, and keeps its outputs in its first slots. `*hit`: the result
 * came from the cache. Called from several threads; `lock` guards the cache and whatever they share. */
typedef qmat_status qmat_make_item_fn(void *user, qmat_context *context, qmat_run *one, pthread_mutex_t *lock,
                                      bool *hit);

/* Runs step `index` for each item of its lists, several at a time, and once for items with equal inputs, and sets
 * `outputs` to sealed lists. `first` is the list that gives the names. An item that the node cannot process
 * (QMAT_ERROR_GEOMETRY) becomes a failure value in every output; an item that is a failure already is left out. Fails
 * when no item succeeds, with the first item's error. */
qmat_status qmat_run_lifted(qmat_context *context, qmat_run *run, size_t index, const qmat_value *const *inputs,
                            const qmat_list *first, qmat_make_item_fn *make, void *user, qmat_value **outputs);

#endif
