/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_BATCH_H
#define QMAT_GRAPHS_CLI_BATCH_H

#include "core/context.h"

#include <jansson.h>
#include <sys/types.h>

/* One graph on many models, each in a process of its own, so that a crash affects one model only. */

typedef enum qmat_asset_state {
  QMAT_ASSET_WAITING,
  QMAT_ASSET_RUNNING,
  QMAT_ASSET_DONE,
  QMAT_ASSET_FAILED
} qmat_asset_state;

typedef struct qmat_asset {
  char *input;  /* the model's path */
  char *stem;   /* its path below the folder that all models share, without the ending: the name of its results */
  char **words; /* the command that processes it, ended by NULL; NULL: it is a folder that cannot be read */
  char *report; /* the report file of this command */
  qmat_asset_state state;
  pid_t process; /* while it runs */
  double started, seconds;
  int exit_code; /* -1: see `signal` */
  int signal;
  json_t *result; /* the report; NULL: none */
} qmat_asset;

typedef struct qmat_batch {
  size_t count, capacity;
  qmat_asset *assets;
} qmat_batch;

/* Finds the models that `count` arguments name: files, folders with all models in and below them, and patterns with *,
 * ?, [ or ** for any folders. Each of `lists` is another folder or pattern, or a file with one path a line, relative to
 * its folder; empty lines and lines that start with # are skipped. A model that is named twice is taken once. Nothing
 * is looked for in the folder `results` (may be NULL). A folder below another that cannot be read is an asset that has
 * failed. QMAT_ERROR_USAGE: a pattern without a match, a folder without a model, an empty list, two models whose
 * results would have the same name. QMAT_ERROR_IO, QMAT_ERROR_MEMORY. Free with qmat_batch_uninit, also after a
 * failure. */
qmat_status qmat_batch_find(qmat_context *context, const char *const *arguments, size_t count, const char *const *lists,
                            size_t list_count, const char *results, qmat_batch *batch);
void qmat_batch_uninit(qmat_batch *batch);

/* Called when an asset has ended. */
typedef void qmat_batch_observer(void *user, const qmat_batch *batch, const qmat_asset *asset);

/* Runs the commands of all assets in order, at most `jobs` at a time. A failure does not stop the others.
 * QMAT_CANCELLED when `stop` returns true: no more are started, and the running ones are interrupted and waited for. */
qmat_status qmat_batch_run(qmat_context *context, qmat_batch *batch, int jobs, bool (*stop)(void),
                           qmat_batch_observer *observer, void *user);

/* The same on a Slurm cluster: submits one job array, waits for it and collects its results from `folder`. All machines
 * share this folder, the program, models, results and cache. `jobs` tasks run at a time (0: no limit), each on
 * `threads` processors. Slurm restarts a task whose machine dies. The environment of sbatch (SBATCH_PARTITION, ...)
 * chooses partition, account and limits. QMAT_ERROR_DEPENDENCY: sbatch fails. QMAT_CANCELLED: `stop` returned true, and
 * the job is cancelled. */
qmat_status qmat_batch_run_slurm(qmat_context *context, qmat_batch *batch, int jobs, int threads, const char *folder,
                                 bool (*stop)(void), qmat_batch_observer *observer, void *user);

/* An asset as a JSON object: input, result ("ok", "failed", "not run"), exit_code, seconds, nodes, hits, outputs,
 * summary, warnings, error. NULL when memory is short; the caller calls json_decref. */
json_t *qmat_asset_json(const qmat_asset *asset);

/* Writes why an asset failed, in one line; "" for one that succeeded. `text` holds `size` bytes. */
void qmat_asset_error(const qmat_asset *asset, char *text, size_t size);

#endif
