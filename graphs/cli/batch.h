/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_BATCH_H
#define QMAT_GRAPHS_CLI_BATCH_H

#include "core/context.h"

#include <jansson.h>
#include <sys/types.h>

/* One graph on many assets, each in a process of its own, so that what fails or crashes is one asset. */

typedef enum qmat_asset_state {
  QMAT_ASSET_WAITING,
  QMAT_ASSET_RUNNING,
  QMAT_ASSET_DONE,
  QMAT_ASSET_FAILED
} qmat_asset_state;

typedef struct qmat_asset {
  char *input;  /* the model's path */
  char *stem;   /* its file name without the ending: the name of what is made of it */
  char **words; /* the command that makes it, ended by NULL */
  char *report; /* the file that this command reports to */
  qmat_asset_state state;
  pid_t process; /* while it runs */
  double started, seconds;
  int exit_code; /* -1: ended by `signal` */
  int signal;
  json_t *result; /* what the command reported; NULL: nothing */
} qmat_asset;

typedef struct qmat_batch {
  size_t count, capacity;
  qmat_asset *assets;
} qmat_batch;

/* Adds the models that `inputs` names: the matches of a pattern with *, ? or [, or else the lines of a file, whose
 * relative paths are relative to its folder; empty lines and those that start with # are left out. QMAT_ERROR_USAGE: a
 * pattern without a match, an empty list, two models whose results would have one name. QMAT_ERROR_IO,
 * QMAT_ERROR_MEMORY. Free with qmat_batch_uninit, also after a failure. */
qmat_status qmat_batch_find(qmat_context *context, const char *inputs, qmat_batch *batch);
void qmat_batch_uninit(qmat_batch *batch);

/* Hears of an asset that has just ended. */
typedef void qmat_batch_observer(void *user, const qmat_batch *batch, const qmat_asset *asset);

/* Runs the commands of all assets, at most `jobs` at a time, in their order. A failing asset does not end the others.
 * QMAT_CANCELLED when `stop` says so: no more are started, and those that run are interrupted and waited for. */
qmat_status qmat_batch_run(qmat_context *context, qmat_batch *batch, int jobs, bool (*stop)(void),
                           qmat_batch_observer *observer, void *user);

/* The same on a Slurm cluster: submits one job array, waits for it and collects what its tasks leave in `folder`, which
 * all machines share, as they do the program, models, results and cache. `jobs` tasks at a time (0: as many as there is
 * room for) of `threads` processors each. A task whose machine dies is started again by Slurm. Which partition, account
 * or limit is taken is told to sbatch by its own environment (SBATCH_PARTITION, ...). QMAT_ERROR_DEPENDENCY: sbatch
 * fails. QMAT_CANCELLED: `stop` said so, and the job is cancelled. */
qmat_status qmat_batch_run_slurm(qmat_context *context, qmat_batch *batch, int jobs, int threads, const char *folder,
                                 bool (*stop)(void), qmat_batch_observer *observer, void *user);

/* An asset as a JSON object: input, result ("ok", "failed", "not run"), exit_code, seconds, nodes, hits, outputs,
 * summary, error. NULL when memory is short; the caller calls json_decref. */
json_t *qmat_asset_json(const qmat_asset *asset);

/* What went wrong with it, in one line; "" for one that is done. `text` holds `size` bytes. */
void qmat_asset_error(const qmat_asset *asset, char *text, size_t size);

#endif
