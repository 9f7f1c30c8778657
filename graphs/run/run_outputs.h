/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_OUTPUTS_H
#define QMAT_GRAPHS_RUN_RUN_OUTPUTS_H

#include <jansson.h>

#include "graphs/run/run.h"

/* JSON text with a newline at its end, as a file; `flags` are jansson's. NULL `json`: QMAT_ERROR_MEMORY. The caller
 * releases `*file`. */
qmat_status qmat_json_to_file(qmat_context *context, const json_t *json, size_t flags, qmat_file **file);

/* Writes the files of a finished run. The files of one folder are written together, through temporaries: all of them or
 * none. */
qmat_status qmat_run_write(qmat_context *context, qmat_run *run);

#endif
