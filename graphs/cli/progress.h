/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_PROGRESS_H
#define QMAT_GRAPHS_CLI_PROGRESS_H

#include "graphs/run/run_step.h"

/* How a run is watched from the command line. */
typedef enum qmat_progress_mode {
  QMAT_PROGRESS_OFF,
  QMAT_PROGRESS_TTY, /* a line per node on stderr, redrawn as it goes on */
  QMAT_PROGRESS_JSON /* a JSON object a line on stderr: {"event": "start" | "progress" | "done", ...} */
} qmat_progress_mode;

typedef struct qmat_progress_view {
  qmat_progress_mode mode;
  bool unicode, colour;
  size_t step, step_count; /* which step is running, from 0 */
  const char *id, *type;   /* of its node */
  double started;          /* seconds, monotonic */
  bool line_open;          /* the terminal's line is not finished */
} qmat_progress_view;

/* Reads how progress is to be shown: "tty", "json", "off" or NULL (a terminal gets the first, anything else the last).
 * QMAT_ERROR_USAGE suggests the nearest. */
qmat_status qmat_progress_view_init(qmat_context *context, const char *mode, qmat_progress_view *view);

/* The context's progress function and the run's observer; the view must outlive both. */
void qmat_progress_view_connect(qmat_progress_view *view, qmat_context *context, qmat_run_observer *observer);

/* Ends the line that a failing node leaves open. */
void qmat_progress_view_end(qmat_progress_view *view);

/* Makes SIGINT and SIGTERM cancel the run; the second of them ends the program at once. */
void qmat_catch_interrupts(void);
/* Whether one of them has come. */
bool qmat_interrupted(void);

#endif
