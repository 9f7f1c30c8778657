/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_SIDE_BY_SIDE_H
#define QMAT_CORE_SIDE_BY_SIDE_H

#include <stdatomic.h>

#include "core/context.h"

/* Processes one of several independent items. `context` is the item's own; its progress function cancels the item when
 * its result is no longer needed. */
typedef qmat_status qmat_item_fn(void *user, qmat_context *context, size_t item);

/* Runs items 0 to count - 1 on all threads of `context`, each on one. An item's scratch memory is freed after it.
 * Progress is `*done` of `total` in `unit`; the items raise `*done`. Ends with QMAT_CANCELLED, or with the error of the
 * first of the items that fail, the same for any number of threads; items after it are stopped or left out. */
qmat_status qmat_run_side_by_side(qmat_context *context, size_t count, qmat_item_fn *run, void *user,
                                  const _Atomic size_t *done, size_t total, const char *unit);

#endif
