/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_REPORT_H
#define QMAT_GRAPHS_RUN_RUN_REPORT_H

#include <stdio.h>

#include "graphs/run/run.h"
#include "graphs/run/run_summary.h"

/* What a run came to: as JSON for programs, as a table for people. */

/* The whole run as a JSON object: qmat, graph, input, seconds, threads, nodes, outputs, summary. `run` has been
 * executed and written. NULL when memory is short; the caller calls json_decref. */
json_t *qmat_run_report(const qmat_context *context, const qmat_run *run);

/* Writes a rule for Make and Ninja: the files that a finished run has saved depend on the graph file and on every file
 * that was read, or whose bytes a result from the cache was made of. Through a temporary. */
qmat_status qmat_run_write_depfile(qmat_context *context, const qmat_run *run, const char *path);

/* {"error": {...}} with the fields of the record and "text", the line that is printed. NULL when memory is short. */
json_t *qmat_error_report(const qmat_error *error);

/* Writes JSON as a file, through a temporary. */
qmat_status qmat_save_json(qmat_context *context, const json_t *json, const char *path);

/* Prints a line per step (node, type, where its result comes from and the start of its key if there is a cache,
 * seconds, what it made), a line per file, and the summary if there is one. */
void qmat_run_print(const qmat_run *run, FILE *out);

/* Prints a line per step of a run that was foreseen: node, type, state, and the start of its key where it is known. */
void qmat_run_print_plan(const qmat_run *run, FILE *out);

#endif
