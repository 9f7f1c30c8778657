/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_CACHE_H
#define QMAT_GRAPHS_RUN_RUN_CACHE_H

#include "graphs/run/run.h"

/* Looking up and storing the results of single steps. */

/* The files that a step read while it ran. A zeroed one is empty. */
typedef struct qmat_step_reads {
  qmat_run_file_digest *files;
  size_t count, capacity;
  bool incomplete; /* memory was short, or a file changed between two readings */
} qmat_step_reads;

/* A qmat_file_read_fn; `user` is a qmat_step_reads. */
void qmat_step_note_read(void *user, const char *path, const uint8_t *bytes, size_t size);
void qmat_step_reads_uninit(qmat_step_reads *reads);

/* Makes the key of a step whose inputs' digests are known, and looks for its record. True: it is a hit, and the step's
 * results are filled in. A forced step only gets its key. Cost: hashes every input file that the run has not hashed. */
bool qmat_run_look_up(qmat_run *run, size_t step);

/* Adds the files that a step read to the run's list. */
void qmat_run_note_reads(qmat_run *run, const qmat_step_reads *reads);

/* Stores a step's results under the bytes that it read. Its state becomes QMAT_STEP_SAME when the cache had all of them
 * already. */
void qmat_run_store(qmat_run *run, size_t step, const qmat_step_reads *reads);

/* The value of an output from the cache; NULL: the cache does not have it. */
qmat_value *qmat_run_load(qmat_run *run, size_t step, size_t port);

#endif
