/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/standard_streams.h"

#include <dirent.h>
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graphs/cli/progress.h"

/* Milliseconds between two looks for an interrupt, while nothing comes. */
enum { LONGEST_WAIT = 100 };

bool qmat_is_stream(const char *path) {
  return path[0] == '-' && (!path[1] || (path[1] == '.' && !strchr(path, '/')));
}

static qmat_status make_folder(qmat_context *context, qmat_streams *streams) {
  const char *temporary = getenv("TMPDIR");
  if (streams->folder[0]) return QMAT_OK;
  if (!temporary || !*temporary) temporary = "/tmp";
  const int length = snprintf(streams->folder, sizeof streams->folder, "%s/qmat-XXXXXX", temporary);
  if (length < (int)sizeof streams->folder && mkdtemp(streams->folder)) {
    signal(SIGPIPE, SIG_IGN); /* where nobody reads on, the folder is removed all the same */
    return QMAT_OK;
  }
  streams->folder[0] = 0;
  qmat_fail(context, QMAT_ERROR_IO, "cannot make a folder for the standard streams in it");
  return qmat_fail_at(context, temporary, 0, 0);
}

/* Copies to the end. False: an error of either. */
static bool copy(FILE *from, FILE *to) {
  char bytes[65536];
  for (size_t size; (size = fread(bytes, 1, sizeof bytes, from)) > 0;)
    if (fwrite(bytes, 1, size, to) != size) return false;
  return !ferror(from);
}

/* Copies the standard input. An interrupt ends it, whether anything comes or not. False: an error, or an interrupt. */
static bool copy_input(FILE *to) {
  char bytes[65536];
  for (;;) {
    struct pollfd input = {.fd = STDIN_FILENO, .events = POLLIN};
    const int ready = poll(&input, 1, LONGEST_WAIT);
    if (qmat_interrupted()) return false;
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    const ssize_t size = ready < 0 ? -1 : read(STDIN_FILENO, bytes, sizeof bytes);
    if (size < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (size <= 0) return size == 0;
    if (fwrite(bytes, 1, (size_t)size, to) != (size_t)size) return false;
  }
}

qmat_status qmat_streams_read(qmat_context *context, qmat_streams *streams, const char **path) {
  *path = streams->input;
  if (streams->input[0]) return QMAT_OK;
  const qmat_status status = make_folder(context, streams);
  if (status != QMAT_OK) return status;
  snprintf(streams->input, sizeof streams->input, "%s/stdin", streams->folder);
  FILE *file = fopen(streams->input, "wbe");
  bool done = file && copy_input(file);
  if (file && fclose(file) != 0) done = false;
  if (!done && qmat_interrupted()) return qmat_fail(context, QMAT_CANCELLED, "cancelled");
  return done ? QMAT_OK : qmat_fail(context, QMAT_ERROR_IO, "cannot read the standard input");
}

qmat_status qmat_streams_write(qmat_context *context, qmat_streams *streams, const char *ending, const char **path) {
  if (streams->output[0]) return qmat_fail(context, QMAT_ERROR_USAGE, "only one file can go to the standard output");
  const qmat_status status = make_folder(context, streams);
  if (status != QMAT_OK) return status;
  snprintf(streams->output, sizeof streams->output, "%s/stdout.%.32s", streams->folder, ending);
  *path = streams->output;
  return QMAT_OK;
}

qmat_status qmat_streams_flush(qmat_context *context, const qmat_streams *streams) {
  if (!streams->output[0]) return QMAT_OK;
  FILE *file = fopen(streams->output, "rbe");
  const bool done = file && copy(file, stdout) && fflush(stdout) == 0;
  if (file) fclose(file);
  return done ? QMAT_OK : qmat_fail(context, QMAT_ERROR_IO, "cannot write to the standard output");
}

void qmat_streams_name(const qmat_streams *streams, qmat_error *error) {
  if (streams->input[0] && strcmp(error->file, streams->input) == 0)
    snprintf(error->file, sizeof error->file, QMAT_STREAM_NAME);
}

void qmat_streams_name_in(const qmat_streams *streams, json_t *report) {
  const char *key, *text = json_string_value(report);
  json_t *value;
  size_t i;
  if (text && streams->input[0] && strcmp(text, streams->input) == 0) json_string_set(report, "-");
  json_array_foreach(report, i, value) qmat_streams_name_in(streams, value);
  json_object_foreach(report, key, value) qmat_streams_name_in(streams, value);
}

void qmat_streams_close(qmat_context *context, qmat_streams *streams) {
  if (!streams->folder[0]) return;
  qmat_streams_name(streams, &context->error);
  DIR *folder = opendir(streams->folder);
  for (const struct dirent *entry; folder && (entry = readdir(folder));) unlinkat(dirfd(folder), entry->d_name, 0);
  if (folder) closedir(folder);
  rmdir(streams->folder);
  streams->folder[0] = 0;
}
