/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/print_run.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "graphs/cli/terminal.h"
#include "graphs/run/run_paths.h"
#include "graphs/run/run_summary.h"

/* ---- the table ---- */

/* The widths of the columns of a table. */
typedef struct step_table {
  int id, type, width; /* `type` is 0 where the terminal is too narrow for it; `width` is the terminal's */
} step_table;

static int widest(int width, const char *text) {
  const int length = (int)strlen(text);
  return length > width ? length : width;
}

static step_table lay_out(const qmat_run *run, FILE *out) {
  step_table table = {.width = qmat_terminal_width(out)};
  for (size_t i = 0; i < run->step_count; i++) {
    table.id = widest(table.id, run->graph->nodes[run->steps[i].node].id);
    table.type = widest(table.type, run->graph->nodes[run->steps[i].node].type->name);
  }
  if (table.width < table.id + table.type + 45) table.type = 0;
  return table;
}

/* Prints the columns that identify a step. Returns how many columns they take. `is_last`: nothing follows in the row.
 */
static int print_step(const step_table *table, const qmat_run *run, const qmat_run_step *step, bool ran, bool is_last,
                      FILE *out) {
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  int column = fprintf(out, "%-*s  ", table->id, node->id);
  if (table->type > 0) column += fprintf(out, "%-*s  ", table->type, node->type->name);
  if (run->cache) column += fprintf(out, "%-*s", is_last ? 0 : 10, qmat_step_state_words(step->state, ran));
  return column;
}

/* The place where the next result of a row goes. */
typedef struct row_end {
  int column, width;
  bool first, full;
} row_end;

/* Prints ", text" if it has room. What comes after something that has none is left out too. */
static void put_if_room(row_end *end, const char *text, FILE *out) {
  const int length = qmat_columns_of(text) + 2;
  if (!*text) return;
  end->full = end->full || end->column + length > end->width;
  if (end->full) return;
  fprintf(out, "%s%s", end->first ? "  " : ", ", text);
  end->column += length;
  end->first = false;
}

/* "26,021 samples", "3 spheres", "2 cones", "1.2 MB". */
static void print_made(const qmat_port *port, const qmat_run_made *made, row_end *end, FILE *out) {
  char number[32], text[96];
  if (port->type == QMAT_FILE) {
    qmat_format_bytes(made->bytes, number);
    put_if_room(end, number, out);
    return;
  }
  const qmat_value_count_row *rows = qmat_value_count_rows(port->type);
  for (size_t i = 0; rows[i].name; i++) {
    if (rows[i].detail) continue;
    qmat_format_count(made->counts[i], number);
    const int letters = (int)strlen(rows[i].name) - (made->counts[i] == 1 ? 1 : 0);
    snprintf(text, sizeof text, "%s %.*s", number, letters, rows[i].name);
    put_if_room(end, text, out);
  }
}

static void print_table(const qmat_run *run, FILE *out) {
  const step_table table = lay_out(run, out);
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_run_step *step = &run->steps[i];
    const qmat_node *type = run->graph->nodes[step->node].type;
    row_end end = {.width = table.width, .first = true};
    end.column = print_step(&table, run, step, true, false, out);
    end.column += fprintf(out, " %8.2f s", step->seconds);
    char text[96] = "";
    if (step->lifted_hits > 0) snprintf(text, sizeof text, "%zu of %zu from cache", step->lifted_hits, step->lifted);
    put_if_room(&end, text, out);
    const qmat_param *format = qmat_output_format_param(type);
    if (format) put_if_room(&end, format->choices[step->format], out);
    for (size_t port = 0; port < qmat_output_count(type); port++)
      print_made(&type->outputs[port], &step->made[port], &end, out);
    fputc('\n', out);
  }
}

void qmat_print_plan(const qmat_run *run, bool keys, FILE *out) {
  const step_table table = lay_out(run, out);
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_run_step *step = &run->steps[i];
    char missing[256], key[65];
    qmat_step_describe_missing(run->graph, step, missing, sizeof missing);
    const bool has_key = keys && step->keyed;
    int column = print_step(&table, run, step, false, !has_key && !*missing, out);
    if (has_key) {
      qmat_digest_hex(&step->key, key);
      column += fprintf(out, "  %.12s", key);
    }
    if (*missing) column += fprintf(out, "  ");
    qmat_put_wrapped(out, missing, column, 4, table.width, true);
  }
  if (!run->cache) fprintf(out, "There is no cache: every node would run.\n");
}

/* ---- the summary ---- */

/* A text that grows. When memory is short it ends early. */
typedef struct long_text {
  char *text;
  size_t size, capacity;
} long_text;

__attribute__((format(printf, 2, 3))) static void append(long_text *to, const char *format, ...) {
  char *piece = NULL;
  va_list arguments;
  va_start(arguments, format);
  const int length = vasprintf(&piece, format, arguments);
  va_end(arguments);
  if (length < 0) return;
  if (qmat_grow((void **)&to->text, &to->capacity, to->size + (size_t)length + 1, 1) == 0) {
    memcpy(to->text + to->size, piece, (size_t)length + 1);
    to->size += (size_t)length;
  }
  free(piece);
}

/* Side files beyond that number are counted. */
enum { MOST_NAMED = 4 };

static void describe_side_files(const qmat_run_file *file, long_text *text) {
  const size_t count = file->written && file->written->part_count > 0 ? file->written->part_count - 1 : 0;
  size_t bytes = 0;
  char size[32];
  for (size_t part = 1; part <= count; part++) {
    bytes += file->written->parts[part].size;
    qmat_format_bytes(file->written->parts[part].size, size);
    if (count <= MOST_NAMED)
      append(text, ", %.*s%s (%s)", (int)qmat_folder_length(file->path), file->path, file->written->parts[part].name,
             size);
  }
  qmat_format_bytes(bytes, size);
  if (count > MOST_NAMED) append(text, " with %zu files beside it (%s)", count, size);
}

/* "a.gltf (515 kB), a.bin (2 kB) in 4.2 s". */
static void describe_files(const qmat_run *run, long_text *text) {
  char size[32];
  size_t hits = 0;
  for (size_t i = 0; i < run->file_count; i++) {
    const qmat_run_file *file = &run->files[i];
    qmat_format_bytes(file->bytes, size);
    append(text, "%s%s (%s)", text->size ? ", " : "", file->path, size);
    describe_side_files(file, text);
  }
  for (size_t i = 0; i < run->step_count; i++) hits += run->steps[i].state == QMAT_STEP_HIT;
  append(text, "%s %.1f s", text->size ? " in" : "in", run->seconds);
  if (hits > 0 && hits == run->step_count)
    append(text, ", from cache");
  else if (hits > 0)
    append(text, ", %zu of %zu steps from cache", hits, run->step_count);
}

/* Where nothing was saved, which outputs could be. */
static void print_not_saved(const qmat_run *run, FILE *out) {
  const qmat_graph *graph = run->graph;
  for (size_t i = 0; i < graph->output_count && run->file_count == 0; i++) {
    const qmat_graph_output *output = &graph->outputs[i];
    const bool is_file = graph->nodes[output->node].type->outputs[output->port].type == QMAT_FILE;
    bool made = false;
    for (size_t k = 0; k < run->step_count; k++) made = made || run->steps[k].node == output->node;
    if (made && is_file) fprintf(out, "  %s was not saved (-o %s=PATH)\n", output->name, output->name);
  }
}

void qmat_print_summary(const char *text, FILE *out) {
  const int width = qmat_terminal_width(out);
  const char *second = strchr(text, '\n');
  char first[512];
  snprintf(first, sizeof first, "%.*s", (int)(second ? second - text : (ptrdiff_t)strlen(text)), text);
  qmat_put_wrapped(out, first, 0, 2, width, true);
  if (!second) return;
  fputs("  ", out);
  qmat_put_wrapped(out, second + 1, 2, 2, width, true);
}

void qmat_print_run(const qmat_run *run, bool table, FILE *out) {
  char text[512];
  long_text files = {0};
  if (table) print_table(run, out);
  char last[sizeof text] = "";
  for (size_t i = 0; i == 0 || i < run->file_count; i++) { /* files of the same medial mesh have one summary */
    json_t *summary = qmat_run_summarise(run, i, text, sizeof text);
    if (!summary)
      snprintf(text, sizeof text, "%.400s: %zu step%s", run->name, run->step_count, run->step_count == 1 ? "" : "s");
    if (strcmp(text, last) != 0) qmat_print_summary(text, out);
    memcpy(last, text, sizeof last);
    json_decref(summary);
  }
  describe_files(run, &files);
  fputs("  ", out);
  qmat_put_wrapped(out, files.text ? files.text : "", 2, 2, qmat_terminal_width(out), true);
  qmat_free(files.text);
  print_not_saved(run, out);
}
