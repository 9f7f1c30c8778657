/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_BATCH_PAGE_H
#define QMAT_GRAPHS_CLI_BATCH_PAGE_H

#include "core/node.h"
#include "graphs/cli/batch.h"

/* Saves FOLDER/index.html, a page with a row for each asset of a batch that has ended: its picture and its page where
 * the run saved them in `folder` (an output that ends in .png, and one in .html), the entries of its summary that have
 * a title, and why it failed. Failures come first; a click on a column's head sorts by it. `entries` are ended by one
 * without a key. QMAT_ERROR_IO names the file; QMAT_ERROR_MEMORY. */
qmat_status qmat_batch_page_save(qmat_context *context, const qmat_batch *batch, const qmat_summary_entry *entries,
                                 const char *folder);

#endif
