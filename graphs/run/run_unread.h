/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_UNREAD_H
#define QMAT_GRAPHS_RUN_RUN_UNREAD_H

#include "graphs/run/run.h"

/* Removes the steps from `first` on that are not wanted and whose outputs no step reads, as far as the values that are
 * known say (`reads` of qmat_node). They are then no part of the run, also after qmat_run_reset. */
void qmat_run_drop_unread(qmat_run *run, size_t first);

#endif
