/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "graphs/cli/command.h"
#include "graphs/graph_format.h"
#include "io/save.h"

/* What is done with each file. */
typedef struct fmt_call {
  qmat_context *context;
  qmat_streams *streams;
  bool check, quiet;
} fmt_call;

/* The number of the first line that differs. */
static int first_difference(const qmat_bytes *old, const qmat_writer *made) {
  int line = 1;
  for (size_t i = 0; i < old->size && i < made->size && old->data[i] == made->bytes[i]; i++)
    line += old->data[i] == '\n';
  return line;
}

/* Reads a graph file; as for other commands, that it cannot be read is a bad graph, and an empty one has a place. */
static qmat_status read_file(qmat_context *context, const char *path, qmat_bytes *bytes) {
  struct stat about;
  if (qmat_bytes_read_file(context, path, bytes) == QMAT_OK) return QMAT_OK;
  if (context->error.status == QMAT_ERROR_MEMORY) return QMAT_ERROR_MEMORY;
  if (stat(path, &about) != 0 || !S_ISREG(about.st_mode) || about.st_size > 0)
    return context->error.status = QMAT_ERROR_USAGE;
  qmat_fail(context, QMAT_ERROR_USAGE, "the graph file is empty; it starts with 'qmat: 1'");
  return qmat_fail_at(context, path, 1, 1);
}

static qmat_status format_file(const fmt_call *call, const char *name) {
  qmat_context *context = call->context;
  const bool is_stream = strcmp(name, "-") == 0;
  const char *path = name;
  qmat_bytes old = {0};
  qmat_writer made = {0};
  qmat_status status = is_stream ? qmat_streams_read(context, call->streams, &path) : QMAT_OK;
  if (status == QMAT_OK) status = read_file(context, path, &old);
  if (status == QMAT_OK) status = qmat_graph_format(context, path, (const char *)old.data, old.size, &made);
  const bool same = status == QMAT_OK && made.size == old.size && memcmp(made.bytes, old.data, old.size) == 0;
  if (status == QMAT_OK && call->check && !same) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "the layout differs from here");
    status = qmat_fail_at(context, path, first_difference(&old, &made), 0);
    if (!is_stream) qmat_fail_hint(context, "'qmat fmt %s' mends it", qmat_show(name).text);
  } else if (status == QMAT_OK && is_stream && !call->check) {
    fwrite(made.bytes, 1, made.size, stdout);
  } else if (status == QMAT_OK && !same) {
    qmat_file *file;
    char *real = realpath(path, NULL); /* a link stays, and what it names is written */
    status = qmat_writer_to_file(context, &made, "yaml", &file);
    if (status == QMAT_OK) {
      status = qmat_file_save(context, file, real ? real : path);
      qmat_value_release(&file->base);
    }
    free(real);
    if (status == QMAT_OK && !call->quiet) printf("%s: laid out\n", qmat_show(name).text);
  }
  qmat_writer_uninit(&made);
  qmat_bytes_uninit(&old);
  return status;
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const fmt_call call = {context, &invocation->streams, qmat_invocation_value(invocation, "check"),
                         qmat_invocation_value(invocation, "quiet")};
  const size_t count = invocation->argument_count;
  size_t failures = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status != QMAT_CANCELLED; i++) {
    const qmat_status of_one = format_file(&call, invocation->arguments[i]);
    if (of_one == QMAT_OK) continue;
    if (failures++ == 0 || of_one == QMAT_ERROR_USAGE) status = of_one;
    qmat_streams_name(&invocation->streams, &context->error);
    if (of_one == QMAT_CANCELLED) status = of_one;
    if (count > 1 && of_one != QMAT_CANCELLED) qmat_print_error(&context->error);
  }
  if (count > 1 && failures > 0 && status != QMAT_CANCELLED)
    qmat_fail(context, status, "%zu of %zu files %s", failures, count,
              call.check ? "have another layout or mistakes" : "have failed");
  return status;
}

static const qmat_option options[] = {
    {"check", 0, NULL, "Write nothing; the exit code is 1 where the layout of a file differs"},
    {"quiet", 'q', NULL, "Print nothing but errors"},
    {0},
};

const qmat_command qmat_command_fmt = {
    .name = "fmt",
    .arguments = "FILE...",
    .summary = "Format graph files in the standard layout",
    .doc =
        "Writes graph files again ('-': from the standard input to the standard output): indented by two blanks, "
        "mappings in braces on one line where they were and fit in 120 columns, else one entry a line; comments behind "
        "entries in one column. Order, values and comments stay as they are, and a file that has this layout is not "
        "touched.",
    .options = options,
    .least = 1,
    .most = SIZE_MAX,
    .run = run,
};
