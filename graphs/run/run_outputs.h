/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_OUTPUTS_H
#define QMAT_GRAPHS_RUN_RUN_OUTPUTS_H

#include "graphs/run/run.h"

/* Writes the files of a finished run. The files of one folder are written together, through temporaries: all of them or
 * none. */
qmat_status qmat_run_write(qmat_context *context, qmat_run *run);

#endif
