/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_PARALLEL_ITEMS_H
#define QMAT_GRAPHS_RUN_PARALLEL_ITEMS_H

#include "core/side_by_side.h"

/* Calls `run` for each of `count` items from several threads, the largest items first. The items share
 * qmat_threads(context) threads: a running item has at least one, and more if items are few or it is much larger than
 * the others, and its context has that share. `sizes` has an estimate of each item's cost. Results must not depend on
 * an item's number of threads. The context's progress function is called from the calling thread, with the number of
 * finished items and their name `unit` ("meshes").
 *
 * Returns QMAT_OK, or the status of the first item in order that failed, with its error in `context` and its index in
 * `*failed`: the same for any number of threads. Items after a failed one are stopped or not started. For
 * QMAT_CANCELLED (by the context's progress function) `*failed` is SIZE_MAX, and for QMAT_ERROR_MEMORY where no item
 * was started. */
qmat_status qmat_run_items(qmat_context *context, size_t count, const size_t *sizes, const char *unit,
                           qmat_item_fn *run, void *user, size_t *failed);

#endif
