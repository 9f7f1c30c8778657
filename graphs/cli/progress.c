/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/progress.h"

#include <langinfo.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/json_text.h"
#include "graphs/cache/cache_key.h"
#include "graphs/cli/terminal.h"
#include "graphs/graph_names.h"
#include "io/model.h"

/* The program's one global variable: a signal handler has no other place. */
static volatile sig_atomic_t interrupted;

static void on_interrupt(int number) {
  (void)number;
  interrupted = 1;
}

static const int interrupts[] = {SIGHUP, SIGINT, SIGQUIT, SIGTERM};
enum { INTERRUPT_COUNT = sizeof interrupts / sizeof *interrupts };

static sigset_t interrupt_set(void) {
  sigset_t set;
  sigemptyset(&set);
  for (int i = 0; i < INTERRUPT_COUNT; i++) sigaddset(&set, interrupts[i]);
  return set;
}

void qmat_hold_interrupts(void) {
  const sigset_t set = interrupt_set();
  sigprocmask(SIG_BLOCK, &set, NULL);
}

void qmat_catch_interrupts(void) {
  struct sigaction action = {.sa_handler = on_interrupt, .sa_flags = (int)(SA_RESETHAND | SA_RESTART)}, before;
  sigemptyset(&action.sa_mask);
  for (int i = 0; i < INTERRUPT_COUNT; i++)
    if (sigaction(interrupts[i], NULL, &before) == 0 && before.sa_handler != SIG_IGN)
      sigaction(interrupts[i], &action, NULL);
  const sigset_t set = interrupt_set();
  sigprocmask(SIG_UNBLOCK, &set, NULL);
}

bool qmat_interrupted(void) {
  return interrupted != 0;
}

bool qmat_can_redraw(void) {
  const char *term = getenv("TERM");
  return isatty(STDERR_FILENO) && term && *term && strcmp(term, "dumb") != 0;
}

qmat_status qmat_progress_view_init(qmat_context *context, const char *mode, qmat_progress_view *view) {
  static const char *const modes[] = {"off", "tty", "json"};
  *view = (qmat_progress_view){0};
  const char *no_colour = getenv("NO_COLOR");
  const bool can_redraw = qmat_can_redraw();
  view->mode = can_redraw ? QMAT_PROGRESS_TTY : QMAT_PROGRESS_OFF;
  view->unicode = strcmp(nl_langinfo(CODESET), "UTF-8") == 0;
  view->colour = can_redraw && !(no_colour && *no_colour);
  if (!mode) return QMAT_OK;
  for (int i = 0; i < 3; i++)
    if (strcmp(mode, modes[i]) == 0) {
      view->mode = (qmat_progress_mode)i;
      return QMAT_OK;
    }
  qmat_fail(context, QMAT_ERROR_USAGE, "there is no progress mode '%s'", qmat_show(mode).text);
  return qmat_suggest_nearest(context, mode, modes, 3, "tty, json or off");
}

/* ---- a line of JSON ---- */

/* Prints an object as one line, and releases it. */
static void print_line(json_t *line) {
  char *text = qmat_json_text(line, JSON_COMPACT | JSON_REAL_PRECISION(9), NULL);
  /* One write, so that lines stay whole when other processes write to the same terminal. */
  if (text) fprintf(stderr, "%s\n", text);
  qmat_free(text);
  json_decref(line);
}

static void print_event(const qmat_progress_view *view, const char *event, json_t *more) {
  json_t *line = json_pack("{s:s, s:s, s:s, s:I, s:I}", "event", event, "node", view->id, "type", view->type, "step",
                           (json_int_t)view->step + 1, "steps", (json_int_t)view->step_count);
  if (more) json_object_update(line, more);
  json_decref(more);
  print_line(line);
}

/* ---- a line on a terminal ---- */

/* A line that stays short of the last column, so that the terminal does not wrap it. */
typedef struct line_writer {
  char bytes[1024];
  size_t size;
  int column, width;
} line_writer;

static void put_code(line_writer *line, const char *code) {
  size_t length = strlen(code);
  if (line->size + length >= sizeof line->bytes) return;
  memcpy(line->bytes + line->size, code, length);
  line->size += length;
}

/* Puts text, one column a character, cut at the width. */
static void put_text(line_writer *line, const char *text) {
  for (; *text && line->column < line->width && line->size + 1 < sizeof line->bytes; text++) {
    line->bytes[line->size++] = *text;
    if (((unsigned char)*text & 0xc0) != 0x80) line->column++;
  }
}

static void put_bar(line_writer *line, const qmat_progress_view *view, double fraction, int cells) {
  static const char *const eighths[] = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  if (line->column + cells > line->width || line->size + (size_t)cells * 3 + 32 >= sizeof line->bytes) return;
  int filled = (int)(fraction * cells * 8);
  if (view->colour) put_code(line, "\x1b[36m");
  int whole = filled / 8, part = filled % 8;
  for (int i = 0; i < cells; i++) {
    if (!view->unicode)
      put_code(line, i < whole ? "#" : ".");
    else if (i < whole)
      put_code(line, "█");
    else
      put_code(line, i == whole && part > 0 ? eighths[part] : view->colour ? " " : "░");
  }
  if (view->colour) put_code(line, "\x1b[0m");
  line->column += cells;
}

/* One line: model, step, bar, share, time left. A narrow terminal has a shorter bar, then none. */
static void draw(qmat_progress_view *view, double share) {
  line_writer line = {.width = qmat_terminal_width(stderr) - 1};
  const double seconds = qmat_clock_seconds() - view->run_started;
  char text[160], left[32];
  qmat_progress_left(share, seconds, left);
  put_code(&line, "\r");
  snprintf(text, sizeof text, "%.24s [%zu/%zu] %-10s ", view->name, view->step + 1, view->step_count, view->id);
  put_text(&line, text);
  const int cells = line.width - line.column - 24;
  if (cells >= 6) put_bar(&line, view, share, cells > 30 ? 30 : cells);
  snprintf(text, sizeof text, " %3d %%  %s", (int)(share * 100), left);
  put_text(&line, text);
  put_code(&line, "\x1b[K");
  view->line_open = true;
  fwrite(line.bytes, 1, line.size, stderr);
  fflush(stderr);
}

/* ---- how far it is ---- */

static double work_of(const qmat_run *run, size_t step) {
  return 0.2 + run->graph->nodes[run->steps[step].node].type->effort;
}

void qmat_progress_share_start(qmat_progress_share *share, const qmat_run *run, size_t step) {
  if (step > 0 && run->steps[step - 1].done && run->steps[step - 1].state != QMAT_STEP_HIT)
    share->done += work_of(run, step - 1);
  share->step_work = work_of(run, step);
  share->phases = 0;
  share->unit[0] = 0;
  share->units = 0;
}

double qmat_progress_share_at(qmat_progress_share *share, const qmat_run *run, uint64_t done, uint64_t total,
                              const char *unit) {
  double work = 0;
  for (size_t i = 0; i < run->step_count; i++)
    if (!run->steps[i].done || run->steps[i].state != QMAT_STEP_HIT) work += work_of(run, i);
  const bool same = strncmp(unit, share->unit, sizeof share->unit - 1) == 0;
  if (share->unit[0] && (!same || done < share->units)) share->phases += (1 - share->phases) / (same ? 8 : 3);
  snprintf(share->unit, sizeof share->unit, "%s", unit);
  share->units = done;
  const double of_phase = total > 0 && done <= total ? (double)done / (double)total : 0;
  const double of_step = share->phases + (1 - share->phases) / 3 * of_phase;
  const double now = work > 0 ? (share->done + share->step_work * of_step) / work : 0;
  share->shown = fmin(1, fmax(share->shown, now));
  return share->shown;
}

void qmat_progress_left(double share, double seconds, char *text) {
  text[0] = 0;
  if (seconds < 1 || share < 0.05 || share >= 1) return;
  const double left = seconds * (1 - share) / share;
  if (left >= 5400)
    snprintf(text, 32, "about %.0f h left", left / 3600);
  else if (left >= 90)
    snprintf(text, 32, "about %.0f min left", left / 60);
  else
    snprintf(text, 32, "about %.0f s left", ceil(left / 5) * 5);
}

/* ---- callbacks ---- */

static bool on_progress(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                        const char *unit) {
  (void)node_id;
  (void)node_type;
  qmat_progress_view *view = user;
  /* Some calls only ask whether to cancel. */
  bool has_news = done > 0 || total > 0;
  if (view->mode == QMAT_PROGRESS_TTY && has_news)
    draw(view, qmat_progress_share_at(&view->share, view->run, done, total, unit));
  if (view->mode == QMAT_PROGRESS_JSON && has_news)
    print_event(view, "progress",
                json_pack("{s:I, s:I, s:s, s:f}", "done", (json_int_t)done, "total", (json_int_t)total, "unit", unit,
                          "seconds", qmat_clock_seconds() - view->started));
  return !interrupted;
}

/* Names the first model that the run reads. */
static void name_model(qmat_progress_view *view, const qmat_run *run) {
  for (size_t i = 0; i < run->step_count && !view->name[0]; i++) {
    const qmat_node *type = run->graph->nodes[run->steps[i].node].type;
    for (size_t row = 0; row < qmat_param_count(type) && !view->name[0]; row++) {
      const char *path = qmat_param_input_file(type, row, run->steps[i].params);
      char *name = path ? qmat_model_name(path) : NULL;
      if (name) snprintf(view->name, sizeof view->name, "%s", qmat_show(name).text);
      qmat_free(name);
    }
  }
}

static void on_started(void *user, const qmat_run *run, size_t step) {
  qmat_progress_view *view = user;
  const qmat_graph_node *node = &run->graph->nodes[run->steps[step].node];
  view->step = step;
  view->step_count = run->step_count;
  view->id = node->id;
  view->type = node->type->name;
  view->run = run;
  view->started = qmat_clock_seconds();
  if (view->run_started <= 0) view->run_started = view->started;
  name_model(view, run);
  qmat_progress_share_start(&view->share, run, step);
  if (view->mode == QMAT_PROGRESS_TTY) draw(view, qmat_progress_share_at(&view->share, run, 0, 0, ""));
  if (view->mode == QMAT_PROGRESS_JSON) print_event(view, "start", NULL);
}

static void on_done(void *user, const qmat_run *run, size_t step) {
  qmat_progress_view *view = user;
  if (view->mode == QMAT_PROGRESS_JSON)
    print_event(view, "done",
                json_pack("{s:s, s:f}", "cache", qmat_step_state_name(run->steps[step].state), "seconds",
                          run->steps[step].seconds));
}

void qmat_progress_view_connect(qmat_progress_view *view, qmat_context *context, qmat_run_observer *observer) {
  context->progress = on_progress;
  context->progress_user = view;
  *observer = (qmat_run_observer){.user = view, .started = on_started, .done = on_done};
}

void qmat_progress_view_end(qmat_progress_view *view) {
  if (view->line_open) fputs("\r\x1b[K", stderr);
  view->line_open = false;
}

void qmat_progress_view_finish(const qmat_progress_view *view, const qmat_run *run, qmat_status status) {
  if (view->mode != QMAT_PROGRESS_JSON) return;
  json_t *outputs = json_array();
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++)
    json_array_append_new(outputs, qmat_json_string(run->files[i].path));
  print_line(json_pack("{s:s, s:s, s:f, s:o}", "event", "end", "status", qmat_status_name(status), "seconds",
                       run->seconds, "outputs", outputs));
}
