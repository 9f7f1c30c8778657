/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_RISING_THRESHOLD_H
#define QMAT_NODES_SIMPLIFY_RISING_THRESHOLD_H

#include "nodes/simplify/decimation_state.h"

/* The threshold of collapses in order (QMAT_EXCEED_STOP, QMAT_EXCEED_RAISE): it starts at the finest and rises by
 * levels, whatever the limit is. */

/* Sets the first threshold, and starts the log with the owners of the samples. QMAT_ERROR_MEMORY. */
qmat_status qmat_rising_threshold_start(qmat_decimation *decimation);

/* Raises the threshold by a level. False if it would exceed the limit, or if there is no threshold. */
bool qmat_rising_threshold_raise(qmat_decimation *decimation);

/* Queues the edges that the raised threshold may allow. */
void qmat_rising_threshold_queue(qmat_decimation *decimation);

#endif
