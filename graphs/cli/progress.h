/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_PROGRESS_H
#define QMAT_GRAPHS_CLI_PROGRESS_H

#include "graphs/run/run_step.h"

/* How the command line shows the progress of a run. */
typedef enum qmat_progress_mode {
  QMAT_PROGRESS_OFF,
  QMAT_PROGRESS_TTY, /* a line per node on stderr, redrawn while it runs */
  QMAT_PROGRESS_JSON /* a JSON object a line on stderr: {"event": "start" | "progress" | "done", ...} */
} qmat_progress_mode;

typedef struct qmat_progress_view {
  qmat_progress_mode mode;
  bool unicode, colour;
  size_t step, step_count; /* the running step, from 0 */
  const char *id, *type;   /* of its node */
  double started;          /* seconds, monotonic */
  bool line_open;          /* the terminal's line is not finished */
} qmat_progress_view;

/* Reads a mode: "tty", "json" or "off"; NULL: tty on a terminal, else off. QMAT_ERROR_USAGE suggests the nearest. */
qmat_status qmat_progress_view_init(qmat_context *context, const char *mode, qmat_progress_view *view);

/* Sets the context's progress function and the run's observer. The view must outlive both. */
void qmat_progress_view_connect(qmat_progress_view *view, qmat_context *context, qmat_run_observer *observer);

/* Ends the line of a node that failed. */
void qmat_progress_view_end(qmat_progress_view *view);

/* Makes SIGINT and SIGTERM cancel the run. A second signal ends the program at once. */
void qmat_catch_interrupts(void);
/* Whether a signal has come. */
bool qmat_interrupted(void);

#endif
