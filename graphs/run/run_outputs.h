/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_OUTPUTS_H
#define QMAT_GRAPHS_RUN_RUN_OUTPUTS_H

#include <jansson.h>

#include "graphs/run/run.h"

/* JSON text with a newline at its end, as a file; `flags` are jansson's. NULL `json`: QMAT_ERROR_MEMORY. The caller
 * releases `*file`. */
qmat_status qmat_json_to_file(qmat_context *context, const json_t *json, size_t flags, qmat_file **file);

/* Whether a finished run has read the file at `path`: a parameter names it, or a file that was read refers to it. */
bool qmat_run_has_read(const qmat_run *run, const char *path);

/* Makes the files of a finished run, in memory. Refuses those that would overwrite a file that the run has read:
 * QMAT_ERROR_USAGE. */
qmat_status qmat_run_make_files(qmat_context *context, qmat_run *run);

/* Refuses a path, which the caller writes after the files that were made, where the run has read a file or writes a
 * side file; `what` names it in the error. QMAT_ERROR_USAGE. */
qmat_status qmat_run_check_later_file(qmat_context *context, const qmat_run *run, const char *what, const char *path);

/* Writes the files that were made. The files of one folder are written together, through temporaries: all of them or
 * none. */
qmat_status qmat_run_write(qmat_context *context, qmat_run *run);

#endif
