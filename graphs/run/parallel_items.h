/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_PARALLEL_ITEMS_H
#define QMAT_GRAPHS_RUN_PARALLEL_ITEMS_H

#include "core/context.h"

/* What is done for one of several items that do not depend on each other. `context` is the item's own: its threads are
 * the item's share, and its progress function asks to stop when the result is not needed any more. */
typedef qmat_status qmat_item_fn(void *user, qmat_context *context, size_t item);

/* Calls `run` for each of `count` items, from threads of its own. At most qmat_threads(context) threads are shared out,
 * at least one to an item that runs and more where items are few or one is much larger than the others; the largest
 * items start first. `sizes` has a number for each item that its time may be expected to grow with. What the items make
 * must not depend on the number of their threads. The context's progress function is called from the calling thread,
 * with the items that are done, and `unit`, a name for them ("meshes").
 *
 * Returns QMAT_OK when every item does. Else the status of the first item, in their order, that failed, with its error
 * in `context` and its index in `*failed`: the same for any number of threads. Items after one that failed are stopped
 * or not started. QMAT_CANCELLED when the context's progress function asks to stop, QMAT_ERROR_MEMORY; `*failed` is
 * then SIZE_MAX. */
qmat_status qmat_run_items(qmat_context *context, size_t count, const size_t *sizes, const char *unit,
                           qmat_item_fn *run, void *user, size_t *failed);

#endif
