/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_CACHE_H
#define QMAT_GRAPHS_RUN_RUN_CACHE_H

#include "graphs/run/graph_run.h"

/* What the runner asks the cache about single steps. */

/* The digest that a file had when the run first asked for it; a file is hashed once. */
struct qmat_run_file_digest {
  char *path;
  bool readable;
  qmat_digest digest;
};

/* What a step has read while it ran. A zeroed one is empty. */
typedef struct qmat_step_reads {
  struct qmat_run_file_digest *files;
  size_t count, capacity;
  bool incomplete; /* memory was short, or a file changed between two reads */
} qmat_step_reads;

/* A qmat_file_read_fn whose `user` is a qmat_step_reads. */
void qmat_step_note_read(void *user, const char *path, const uint8_t *bytes, size_t size);
void qmat_step_reads_uninit(qmat_step_reads *reads);

/* Makes the key of a step whose inputs' digests are known, and looks for its record. True: it is a hit, and what the
 * step made is filled in. With `forced` steps only the key is made. Cost: one pass over every file that it reads and
 * that the run has not hashed yet. */
bool qmat_run_look_up(qmat_run *run, size_t step);

/* Adds what a step has read to the files that the run knows. */
void qmat_run_note_reads(qmat_run *run, const qmat_step_reads *reads);

/* Stores what a step has made, under the bytes that it has read; its state becomes QMAT_STEP_SAME when all of it was in
 * the cache before. */
void qmat_run_store(qmat_run *run, size_t step, const qmat_step_reads *reads);

/* The value of an output from the cache; NULL: it is not there. */
qmat_value *qmat_run_load(qmat_run *run, size_t step, size_t port);

#endif
