/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_PROGRESS_H
#define QMAT_GRAPHS_CLI_PROGRESS_H

#include "graphs/run/run_step.h"

/* How the command line shows the progress of a run. */
typedef enum qmat_progress_mode {
  QMAT_PROGRESS_OFF,
  QMAT_PROGRESS_TTY, /* one line on stderr, redrawn while the run lasts and erased at its end */
  QMAT_PROGRESS_JSON /* a JSON object a line on stderr: {"event": "start" | "progress" | "done", ...} */
} qmat_progress_mode;

/* How far a run is: a share of its work that never falls. */
typedef struct qmat_progress_share {
  double shown;           /* 0 to 1 */
  double done, step_work; /* work of the finished steps, and of the running one; cached results are no work */
  double phases;          /* the share of the running step that its finished phases had */
  char unit[32];          /* of the running phase */
  uint64_t units;         /* that are done of it */
} qmat_progress_share;

typedef struct qmat_progress_view {
  qmat_progress_mode mode;
  bool unicode, colour;
  char name[72];           /* of the model */
  size_t step, step_count; /* the running step, from 0 */
  const char *id, *type;   /* of its node */
  const qmat_run *run;
  qmat_progress_share share;
  double started, run_started; /* seconds, monotonic */
  bool line_open;              /* the terminal's line is not erased */
} qmat_progress_view;

/* A new step: adds the work of the one before, unless it came from the cache. */
void qmat_progress_share_start(qmat_progress_share *share, const qmat_run *run, size_t step);

/* The share of the whole run that is done when `done` of `total` units of a phase of the running step are. A step has
 * any number of phases. One in another unit takes a third of what is left of the step, one that starts again an eighth.
 */
double qmat_progress_share_at(qmat_progress_share *share, const qmat_run *run, uint64_t done, uint64_t total,
                              const char *unit);

/* "about 12 s left" for a share that took `seconds`; "" when it is too early to say. `text` holds 32 bytes. */
void qmat_progress_left(double share, double seconds, char *text);

/* Whether stderr is a terminal whose lines can be drawn again. */
bool qmat_can_redraw(void);

/* Reads a mode: "tty", "json" or "off"; NULL: tty on a terminal, else off. QMAT_ERROR_USAGE suggests the nearest. */
qmat_status qmat_progress_view_init(qmat_context *context, const char *mode, qmat_progress_view *view);

/* Sets the context's progress function and the run's observer. The view must outlive both. */
void qmat_progress_view_connect(qmat_progress_view *view, qmat_context *context, qmat_run_observer *observer);

/* Erases the line. */
void qmat_progress_view_end(qmat_progress_view *view);

/* The last event of a run, where events are printed: its status ("ok", or that of the error), and the paths of the
 * files that it saved. `run` may be empty. */
void qmat_progress_view_finish(const qmat_progress_view *view, const qmat_run *run, qmat_status status);

/* Holds SIGHUP, SIGINT, SIGQUIT and SIGTERM back until qmat_catch_interrupts, also in the program that this one
 * becomes. */
void qmat_hold_interrupts(void);

/* Makes these signals cancel the run, also those that were held back. A second signal ends the program at once. A
 * signal that is ignored stays ignored, as nohup and the shell want it. */
void qmat_catch_interrupts(void);

/* Whether a signal has come. */
bool qmat_interrupted(void);

#endif
