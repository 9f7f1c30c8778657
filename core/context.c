/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/context.h"

#include <omp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "core/text.h"

static const int64_t PROGRESS_INTERVAL = 50000000; /* nanoseconds */

void qmat_context_uninit(qmat_context *context) {
  if (context) qmat_arena_uninit(&context->arena);
}

int qmat_threads(const qmat_context *context) {
  if (context->threads > 0) return context->threads;
  const int processors = omp_get_num_procs();
  return processors > 0 ? processors : 1;
}

void qmat_note_file_read(const qmat_context *context, const char *path, const uint8_t *bytes, size_t size) {
  if (context->file_read) context->file_read(context->file_read_user, path, bytes, size);
}

/* Copies as much as fits, without splitting a UTF-8 sequence. NULL becomes "". */
static void copy_text(char *to, size_t size, const char *from) {
  if (!from) from = "";
  size_t length = strnlen(from, size);
  if (length >= size) {
    length = size - 1;
    while (length > 0 && ((unsigned char)from[length] & 0xC0) == 0x80) --length;
  }
  memmove(to, from, length);
  to[length] = '\0';
}

/* Formats into a copy first: the arguments may point into the error itself. */
static void format_text(char *to, size_t size, const char *format, va_list arguments)
    __attribute__((format(printf, 3, 0)));
static void format_text(char *to, size_t size, const char *format, va_list arguments) {
  char text[1024];
  if (vsnprintf(text, sizeof text, format, arguments) < 0) copy_text(text, sizeof text, format);
  copy_text(to, size, text);
}

qmat_status qmat_fail(qmat_context *context, qmat_status status, const char *format, ...) {
  qmat_error *error = &context->error;
  va_list arguments;
  va_start(arguments, format);
  format_text(error->message, sizeof error->message, format, arguments);
  va_end(arguments);

  error->status = status;
  copy_text(error->node_id, sizeof error->node_id, context->node_id);
  copy_text(error->node_type, sizeof error->node_type, context->node_type);
  error->field[0] = error->element_kind[0] = error->file[0] = error->hint[0] = '\0';
  error->element = -1;
  error->line = error->column = 0;
  return status;
}

qmat_status qmat_fail_field(qmat_context *context, const char *field) {
  copy_text(context->error.field, sizeof context->error.field, field);
  return context->error.status;
}

qmat_status qmat_fail_element(qmat_context *context, const char *kind, int64_t element) {
  copy_text(context->error.element_kind, sizeof context->error.element_kind, kind);
  context->error.element = element;
  return context->error.status;
}

qmat_status qmat_fail_at(qmat_context *context, const char *file, int line, int column) {
  copy_text(context->error.file, sizeof context->error.file, file);
  context->error.line = line;
  context->error.column = column;
  return context->error.status;
}

qmat_status qmat_fail_hint(qmat_context *context, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  format_text(context->error.hint, sizeof context->error.hint, format, arguments);
  va_end(arguments);
  return context->error.status;
}

qmat_status qmat_fail_within(qmat_context *context, const char *what) {
  char name[201], text[sizeof context->error.message + 256];
  copy_text(name, sizeof name, what);
  snprintf(text, sizeof text, "%s: %s", name, context->error.message);
  copy_text(context->error.message, sizeof context->error.message, text);
  return context->error.status;
}

qmat_status qmat_fail_memory(qmat_context *context, const char *what) {
  return qmat_fail(context, QMAT_ERROR_MEMORY, "not enough memory for %s", what);
}

qmat_status qmat_progress(qmat_context *context, uint64_t done, uint64_t total, const char *unit) {
  if (!context->progress) return QMAT_OK;
  struct timespec time = {0};
  clock_gettime(CLOCK_MONOTONIC, &time);
  const int64_t now = (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
  const bool due = context->progress_time == 0 || now - context->progress_time >= PROGRESS_INTERVAL;
  if (!due && done != 0 && done != total) return QMAT_OK;
  context->progress_time = now;
  const bool go_on =
      context->progress(context->progress_user, context->node_id != NULL ? context->node_id : "",
                        context->node_type != NULL ? context->node_type : "", done, total, unit != NULL ? unit : "");
  return go_on ? QMAT_OK : qmat_fail(context, QMAT_CANCELLED, "cancelled");
}

/* Whether the message already names the field as its first word. */
static bool starts_with_word(const char *message, const char *word) {
  const size_t length = strlen(word);
  return strncmp(message, word, length) == 0 && message[length] == ' ';
}

void qmat_error_format(const qmat_error *error, char *text, size_t size) {
  if (size == 0) return;
  char line[2048]; /* large enough for the longest parts */
  size_t used = 0;
#define APPEND(...) used += (size_t)snprintf(line + used, sizeof line - used, __VA_ARGS__)
  line[0] = '\0';
  if (error->file[0] != '\0') {
    APPEND("%s", error->file);
    if (error->line > 0) APPEND(":%d", error->line);
    if (error->line > 0 && error->column > 0) APPEND(":%d", error->column);
    APPEND(": ");
  }
  if (error->node_id[0] != '\0') {
    APPEND("node '%s'", error->node_id);
    if (error->node_type[0] != '\0') APPEND(" (%s)", error->node_type);
    APPEND(": ");
  } else if (error->node_type[0] != '\0') {
    APPEND("%s: ", error->node_type);
  }
  if (error->field[0] != '\0' && !starts_with_word(error->message, error->field)) APPEND("%s: ", error->field);
  if (error->element >= 0 && error->element_kind[0] != '\0')
    APPEND("%s %lld: ", error->element_kind, (long long)error->element);
  APPEND("%s", error->message[0] != '\0' ? error->message : qmat_status_name(error->status));
  if (error->hint[0] != '\0') APPEND(" (%s)", error->hint);
#undef APPEND
  /* Names and texts from libraries may contain line breaks and terminal controls. */
  for (size_t i = 0; i < used; i++) {
    const size_t length = qmat_control_length(&line[i]);
    if (length > 0) memset(&line[i], ' ', length);
  }
  copy_text(text, size, line);
}
