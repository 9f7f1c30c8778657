/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_WHY_H
#define QMAT_GRAPHS_RUN_WHY_H

#include "graphs/run/run.h"

/* Why a step of a run is found in the cache or has to run: its key against that of the nearest earlier record. */

/* All records of results in the cache, an array of objects; NULL when memory is short. The caller calls json_decref. */
json_t *qmat_cache_records(qmat_cache *cache);

/* What is told of a step of a run that was foreseen, as an object: node, type, state, key, made (milliseconds since
 * 1970, where it is a hit), `text` in one line, and `causes`, a list of objects: tag, name, now, before (null where
 * there is none), text; for an input also `from`, the node that makes it. A hit is compared with what was there before
 * it was made, anything else with all records. The nearest record is the one of the same node type with the fewest
 * other items, the newest of those. NULL when memory is short; the caller calls json_decref. */
json_t *qmat_why(const qmat_run *run, const json_t *records, size_t step);

#endif
