/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_WHY_H
#define QMAT_GRAPHS_RUN_WHY_H

#include "graphs/run/run.h"

/* Why a step is in the cache or has to run: its key is compared with the most similar record. */

/* An array of all records of results in the cache; NULL when memory is short. The caller calls json_decref. */
json_t *qmat_cache_records(qmat_cache *cache);

/* Explains a step of a foreseen run, as an object: node, type, state, key, made (milliseconds since 1970, for a hit),
 * `text` in one line, and the list `causes` of objects: tag, name, now, before (null if there is none), text, and for
 * an input `from`, the node that makes it. A hit is compared with the records that are older than it, any other step
 * with all records. The most similar record is the one of the same node type with the fewest different items, the
 * newest if there are several. NULL when memory is short; the caller calls json_decref. */
json_t *qmat_why(const qmat_run *run, const json_t *records, size_t step);

#endif
