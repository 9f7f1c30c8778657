/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_REPORT_H
#define QMAT_GRAPHS_RUN_RUN_REPORT_H

#include "graphs/run/run.h"
#include "graphs/run/run_summary.h"

/* The results of a run, as JSON for programs. */

/* A run that was executed and written, as a JSON object: qmat, graph, input, seconds, threads, cache, nodes, outputs,
 * summary, warnings. NULL when memory is short; the caller calls json_decref. */
json_t *qmat_run_report(const qmat_context *context, const qmat_run *run);

/* The warnings in the steps' reports, such as what a reader left out ("node 'model': ..."), and the meshes that failed
 * ("mesh 'roof' cannot be described: ..."), or these alone. A list of texts; NULL when memory is short; the caller
 * calls json_decref. */
json_t *qmat_run_warnings(const qmat_run *run, bool only_failures);

/* Writes a rule for Make and Ninja: the saved files of a finished run depend on the graph file and on every file that
 * the run read, looked for and did not find, or that a cached result was made from. Where the caller names saved files,
 * those that the graph saves by itself are left out. Each of these has an empty rule, so
 * that Make does not stop where it is missing. Files in the folder `temporary` (NULL or "": none) are left out: they
 * stand for the standard streams. Through a temporary. */
qmat_status qmat_run_write_depfile(qmat_context *context, const qmat_run *run, const char *path, const char *temporary);

/* Checks the names of those files: before the run, of those that are known then. QMAT_ERROR_USAGE: neither Make nor
 * Ninja can read one. `warning` says which name one of the two cannot read; "": both read all. It is cut when `size` is
 * short. */
qmat_status qmat_run_check_depfile(qmat_context *context, const qmat_run *run, const char *temporary, char *warning,
                                   size_t size);

/* How many files a planned run saves, beside those in the folder `temporary`. */
size_t qmat_run_count_saved(const qmat_run *run, const char *temporary);

/* {"error": {...}} with the fields of the error and "text", the printed line. NULL when memory is short. */
json_t *qmat_error_report(const qmat_error *error);

/* Writes JSON as a file, through a temporary. */
qmat_status qmat_save_json(qmat_context *context, const json_t *json, const char *path);

#endif
