/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/json_text.h"
#include "graphs/built_in.h"
#include "graphs/cli/batch.h"
#include "graphs/cli/batch_page.h"
#include "graphs/cli/command.h"
#include "graphs/cli/print_run.h"
#include "graphs/cli/progress.h"
#include "graphs/cli/terminal.h"
#include "graphs/graph_params.h"
#include "graphs/run/run_paths.h"
#include "graphs/run/run_summary.h"

/* One call of `qmat batch`. */
typedef struct batch_call {
  qmat_context *context;
  qmat_invocation *invocation;
  const char *graph;          /* the argument of `qmat run`; NULL: `qmat mat` */
  const char *folder, *input; /* of the results, and the graph's input that takes the model */
  char program[4096], reports[4096];
  int jobs, threads;
  bool json, quiet, verbose, slurm, has_told_of_cache;
  bool pages;   /* outputs on request are saved too, and a page of all assets */
  bool redraws; /* stderr is a terminal: its last line says how far the batch is */
  size_t ended;
  double started; /* seconds, monotonic */
} batch_call;

static bool is_input_file(const qmat_graph *graph, const qmat_graph_input *input) {
  const qmat_param *param = &graph->nodes[input->params[0].node].type->params[input->params[0].param];
  return param->type == QMAT_PARAM_PATH && (param->flags & QMAT_PARAM_INPUT_FILE);
}

/* Finds the graph's input that takes the model: --input, else the only input that is a file. */
static qmat_status find_input(batch_call *call) {
  qmat_graph *graph = &call->invocation->graph;
  size_t found = 0;
  call->input = qmat_invocation_value(call->invocation, "input");
  if (call->input) {
    qmat_status status = qmat_graph_set_named(call->context, graph, call->input, "model");
    return status == QMAT_OK ? status : qmat_fail_field(call->context, "--input");
  }
  for (size_t i = 0; i < graph->input_count; i++) {
    if (!is_input_file(graph, &graph->inputs[i])) continue;
    call->input = graph->inputs[i].name;
    found++;
  }
  if (found == 1) return QMAT_OK;
  qmat_fail(call->context, QMAT_ERROR_USAGE, "%zu inputs of the graph are files; choose the one that takes the model",
            found);
  return qmat_fail_hint(call->context, "--input NAME");
}

/* ---- the command of one asset ---- */

typedef struct word_list {
  char **words;
  size_t count, capacity;
  bool failed;
} word_list;

__attribute__((format(printf, 2, 3))) static void add_word(word_list *list, const char *format, ...) {
  va_list arguments;
  char *word = NULL;
  va_start(arguments, format);
  int length = vasprintf(&word, format, arguments);
  va_end(arguments);
  char *copy = length >= 0 ? qmat_strdup(word) : NULL;
  if (length >= 0) free(word);
  if (!copy || qmat_grow((void **)&list->words, &list->capacity, list->count + 2, sizeof *list->words) != 0) {
    qmat_free(copy);
    list->failed = true;
    return;
  }
  list->words[list->count++] = copy;
  list->words[list->count] = NULL;
}

/* Whether every asset gets this option: the cache, parameters, --force. */
static bool is_shared(const batch_call *call, const char *name) {
  const qmat_graph *graph = &call->invocation->graph;
  bool shared = strcmp(name, "set") == 0 || strcmp(name, "force") == 0 || strcmp(name, "colliders") == 0;
  for (const qmat_option *option = qmat_cache_option_rows; option->name; option++)
    shared = shared || strcmp(option->name, name) == 0;
  return shared || (call->invocation->inputs_are_options && qmat_graph_input_called(graph, name));
}

/* The format of an output that an ending means, with or without its dot; NULL: none. */
static const char *output_format(const qmat_graph *graph, size_t output, const char *ending) {
  const qmat_param *format = qmat_output_format_param(graph->nodes[graph->outputs[output].node].type);
  if (qmat_graph_output_type(graph, output) != QMAT_FILE) return NULL;
  for (int k = 0; format && format->choices[k]; k++)
    if (strcasecmp(format->choices[k], ending + (*ending == '.')) == 0) return format->choices[k];
  return NULL;
}

static bool gives_format(const qmat_invocation *invocation, size_t output, const char *wanted) {
  for (size_t i = 0; i < invocation->given_count; i++) {
    if (strcmp(invocation->given[i].name, "format") != 0) continue;
    const char *format = output_format(&invocation->graph, output, invocation->given[i].value);
    if (format && strcmp(format, wanted) == 0) return true;
  }
  return false;
}

/* How many outputs of the graph are reports that every run saves. */
static size_t report_count(const qmat_graph *graph) {
  size_t count = 0;
  for (size_t i = 0; i < graph->output_count; i++)
    count += graph->outputs[i].path && qmat_graph_output_type(graph, i) == QMAT_REPORT;
  return count;
}

static void add_output(const batch_call *call, word_list *list, const qmat_asset *asset, size_t output,
                       const char *ending) {
  const qmat_graph *graph = &call->invocation->graph;
  const char *name = graph->outputs[output].name;
  size_t last;
  const bool is_report = qmat_graph_output_type(graph, output) == QMAT_REPORT;
  /* Several differ by their names. */
  const bool several = (is_report ? report_count(graph) : qmat_graph_file_count(graph, &last)) > 1;
  add_word(list, "--output=%s=%s/%s%s%s.%s", name, call->folder, asset->stem, several ? "-" : "", several ? name : "",
           ending);
}

/* The ending of an output as `qmat run` saves it: that of its path, else of its node's format. */
static void find_ending(const batch_call *call, size_t output, const qmat_param *format, char ending[64]) {
  const qmat_graph *graph = &call->invocation->graph;
  const char *path = graph->outputs[output].path;
  int choice = -1;
  if (path) qmat_graph_output_format(call->context, graph, output, path, &choice); /* the reader has checked it */
  if (choice >= 0)
    snprintf(ending, 64, "%s", format->choices[choice]);
  else if (qmat_graph_output_type(graph, output) == QMAT_REPORT)
    snprintf(ending, 64, "json");
  else
    qmat_param_format(format, graph->nodes[graph->outputs[output].node].params, ending, 64);
}

/* Adds the paths of an asset's results: in each --format, or in the graph's. An output with a path is always saved, and
 * it takes the asset's name. */
static void add_outputs(const batch_call *call, word_list *list, const qmat_asset *asset) {
  const qmat_invocation *invocation = call->invocation;
  const qmat_graph *graph = &invocation->graph;
  const bool chosen = qmat_invocation_value(invocation, "format") != NULL;
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_param *param = qmat_output_format_param(graph->nodes[graph->outputs[i].node].type);
    const qmat_value_type type = qmat_graph_output_type(graph, i);
    const bool has_path = graph->outputs[i].path != NULL;
    if (type == QMAT_FILE ? !param : !has_path) continue;
    char ending[64];
    bool given = false;
    find_ending(call, i, param, ending);
    for (int k = 0; type == QMAT_FILE && param->choices[k]; k++) {
      if (!gives_format(invocation, i, param->choices[k])) continue;
      add_output(call, list, asset, i, param->choices[k]);
      given = true;
    }
    const bool wanted = qmat_graph_on_request(graph, i) ? call->pages && !gives_format(invocation, i, ending) : !chosen;
    if (wanted || (has_path && !given)) add_output(call, list, asset, i, ending);
  }
}

/* Adds an option as it was given: with its value, also an empty one, where it takes one. */
static void add_option(const qmat_invocation *invocation, word_list *list, const qmat_given_option *given) {
  const char *value = NULL;
  for (size_t i = 0; i < invocation->option_count && !value; i++)
    if (strcmp(invocation->options[i].name, given->name) == 0) value = invocation->options[i].value;
  const bool is_optional = value && *value == '[';
  add_word(list, value && !(is_optional && !*given->value) ? "--%s=%s" : "--%s", given->name, given->value);
}

static qmat_status make_command(const batch_call *call, size_t index, qmat_asset *asset) {
  const qmat_invocation *invocation = call->invocation;
  word_list list = {0};
  add_word(&list, "%s", call->program);
  add_word(&list, "%s", call->graph ? "run" : "mat");
  add_word(&list, "--quiet");
  add_word(&list, "--threads=%d", call->threads);
  add_word(&list, "--report=%s/%zu.json", call->reports, index);
  for (size_t i = 0; i < invocation->given_count; i++) {
    const qmat_given_option *given = &invocation->given[i];
    if (is_shared(call, given->name)) add_option(invocation, &list, given);
  }
  if (call->graph) add_word(&list, "--set=%s=%s", call->input, asset->input);
  add_outputs(call, &list, asset);
  add_word(&list, "--");
  add_word(&list, "%s", call->graph ? call->graph : asset->input);
  asset->words = list.words;
  size_t size = strlen(call->reports) + 32;
  asset->report = qmat_alloc(size, 1);
  if (list.failed || !asset->report) return qmat_fail_memory(call->context, "commands");
  snprintf(asset->report, size, "%s/%zu.json", call->reports, index);
  return QMAT_OK;
}

/* ---- messages ---- */

static void print_json_line(const qmat_asset *asset) {
  json_t *json = qmat_asset_json(asset);
  char *text = json ? qmat_json_text(json, JSON_COMPACT | JSON_REAL_PRECISION(9), NULL) : NULL;
  if (text) printf("%s\n", text);
  fflush(stdout);
  qmat_free(text);
  json_decref(json);
}

/* What the graph's last node with a summary makes of its report; NULL: no node has one. */
static const qmat_report_summary *summary_type(const qmat_graph *graph) {
  for (size_t i = graph->node_count; i-- > 0;)
    if (graph->nodes[i].type->report_summary) return graph->nodes[i].type->report_summary;
  return NULL;
}

/* The entries that have a column. */
static const qmat_summary_entry *summary_entries(const qmat_graph *graph) {
  static const qmat_summary_entry none[] = {{0}};
  return summary_type(graph) ? summary_type(graph)->entries : none;
}

static void format_entry(const json_t *value, char *text) {
  text[0] = 0;
  if (json_is_integer(value))
    qmat_format_count((uint64_t)json_integer_value(value), text);
  else if (value)
    qmat_format_bound(json_real_value(value), text);
}

static bool is_from_cache(const qmat_asset *asset) {
  const json_int_t hits = json_integer_value(json_object_get(json_object_get(asset->result, "cache"), "hits"));
  return hits > 0 && (size_t)hits == json_array_size(json_object_get(asset->result, "nodes"));
}

static const char *result_of(const qmat_asset *asset) {
  static const char *const results[] = {"not run", "running", "ok", "failed"};
  return asset->state == QMAT_ASSET_DONE && is_from_cache(asset) ? "from cache" : results[asset->state];
}

/* A line as an asset ends: "[2/9] spot.off: ok, 2.1 s, 31 spheres, 0.93 % to envelope". What has no room is left out.
 */
static void print_asset_line(const batch_call *call, const qmat_batch *batch, const qmat_asset *asset) {
  char line[1024], text[48], part[96];
  const int width = qmat_terminal_width(stderr);
  const json_t *summary = json_object_get(asset->result, "summary");
  const qmat_summary_entry *entries = summary_entries(&call->invocation->graph);
  int used = snprintf(line, sizeof line, "[%zu/%zu] %.600s: %s, %.1f s", call->ended, batch->count, asset->input,
                      result_of(asset), asset->seconds);
  for (size_t i = 0; asset->state == QMAT_ASSET_DONE && entries[i].key; i++) {
    format_entry(entries[i].title ? json_object_get(summary, entries[i].key) : NULL, text);
    if (!*text) continue;
    const bool one = strcmp(text, "1") == 0; /* "1 sphere" */
    const int length =
        snprintf(part, sizeof part, ", %s %.*s", text, (int)strlen(entries[i].title) - one, entries[i].title);
    if (qmat_columns_of(line) + qmat_columns_of(part) > width || used + length >= (int)sizeof line) break;
    used += snprintf(line + used, sizeof line - (size_t)used, "%s", part);
  }
  qmat_put_wrapped(stderr, line, 0, 2, width, true);
}

/* Tells the warnings of an asset's run, a quiet batch which meshes have failed, and once what is wrong with the cache.
 */
static void print_warnings(batch_call *call, const qmat_asset *asset) {
  const json_t *warnings = json_object_get(asset->result, "warnings");
  for (size_t i = 0; i < json_array_size(warnings); i++) {
    const char *text = json_string_value(json_array_get(warnings, i));
    if (!text || (call->quiet && strncmp(text, "mesh ", 5) != 0)) continue;
    fputs("qmat: warning: ", stderr);
    qmat_put_shown(stderr, asset->input);
    fputs(": ", stderr);
    qmat_put_shown(stderr, text);
    fputc('\n', stderr);
  }
  const char *of_cache = json_string_value(json_object_get(json_object_get(asset->result, "cache"), "warning"));
  if (!of_cache || call->quiet || call->has_told_of_cache) return;
  fprintf(stderr, "qmat: warning: %s\n", of_cache);
  call->has_told_of_cache = true;
}

static void on_asset(void *user, const qmat_batch *batch, const qmat_asset *asset) {
  batch_call *call = user;
  call->ended++;
  if (call->json) print_json_line(asset);
  if (call->redraws && !call->json && !call->quiet) fputs("\r\x1b[K", stderr);
  if (!call->json) print_warnings(call, asset);
  if (call->json || call->quiet) return;
  print_asset_line(call, batch, asset);
  if (!call->redraws || call->ended == batch->count) return;
  char left[32];
  const double share = (double)call->ended / (double)batch->count;
  qmat_progress_left(share, qmat_clock_seconds() - call->started, left);
  fprintf(stderr, "%zu of %zu  %3d %%  %s", call->ended, batch->count, (int)(100 * share), left);
  fflush(stderr);
}

/* The width of an entry's column. */
static int column_width(const qmat_summary_entry *entry) {
  return qmat_columns_of(entry->title) > 7 ? qmat_columns_of(entry->title) : 7;
}

static void print_table(const qmat_batch *batch, const qmat_graph *graph) {
  const qmat_summary_entry *entries = summary_entries(graph);
  int width = 5, rest = 22;
  for (size_t i = 0; entries[i].key; i++) rest += entries[i].title ? 2 + column_width(&entries[i]) : 0;
  for (size_t i = 0; i < batch->count; i++)
    if (qmat_columns_of(batch->assets[i].stem) > width) width = qmat_columns_of(batch->assets[i].stem);
  /* A longer name has a line of its own. */
  if (width > qmat_terminal_width(stdout) - rest) width = qmat_terminal_width(stdout) - rest;
  if (width < 5) width = 5;
  printf("%-*s  result      seconds", width, "asset");
  for (size_t i = 0; entries[i].key; i++)
    if (entries[i].title) printf("  %*s", column_width(&entries[i]), entries[i].title);
  putchar('\n');
  for (size_t i = 0; i < batch->count; i++) {
    const qmat_asset *asset = &batch->assets[i];
    const json_t *summary = json_object_get(asset->result, "summary");
    const int columns = qmat_columns_of(asset->stem);
    if (columns > width) qmat_put_wrapped(stdout, asset->stem, 0, 0, qmat_terminal_width(stdout), false);
    printf("%s%*s  %-10s %8.2f", columns > width ? "" : asset->stem, columns > width ? width : width - columns, "",
           result_of(asset), asset->seconds);
    for (size_t k = 0; json_is_object(summary) && entries[k].key; k++) {
      char text[48];
      format_entry(json_object_get(summary, entries[k].key), text);
      if (entries[k].title) printf("  %*s", column_width(&entries[k]), text);
    }
    putchar('\n');
  }
}

/* Names what failed. On a terminal a long line is wrapped. */
static void print_failures(const qmat_batch *batch, FILE *out) {
  for (size_t i = 0; i < batch->count; i++) {
    char error[2048], line[2600];
    if (batch->assets[i].state != QMAT_ASSET_FAILED) continue;
    qmat_asset_error(&batch->assets[i], error, sizeof error);
    const char *input = batch->assets[i].input;
    const bool named = strncmp(error, input, strlen(input)) == 0;
    snprintf(line, sizeof line, "%.500s%s%s", named ? "" : input, named ? "" : ": ", error);
    qmat_put_wrapped(out, line, 0, 2, isatty(fileno(out)) ? qmat_terminal_width(out) : INT_MAX, true);
  }
}

/* Three lines: what was made, how good it is, where it is. */
static void print_totals(const batch_call *call, const qmat_batch *batch) {
  const qmat_report_summary *type = summary_type(&call->invocation->graph);
  json_t *total = json_object();
  size_t counts[4] = {0}, files = 0;
  json_int_t bytes = 0;
  for (size_t i = 0; i < batch->count; i++) {
    const json_t *result = batch->assets[i].result, *outputs = json_object_get(result, "outputs"), *file, *part;
    const json_t *summary = json_object_get(result, "summary");
    size_t at, side;
    counts[batch->assets[i].state]++;
    if (type && json_is_object(summary)) qmat_summary_add(type, summary, total);
    json_array_foreach(outputs, at, file) {
      files++;
      bytes += json_integer_value(json_object_get(file, "bytes"));
      json_array_foreach(json_object_get(file, "parts"), side, part) {
        files++;
        bytes += json_integer_value(json_object_get(part, "bytes"));
      }
    }
  }
  char name[128], text[640], size[32];
  snprintf(name, sizeof name, "%zu done, %zu failed, %zu not run", counts[QMAT_ASSET_DONE], counts[QMAT_ASSET_FAILED],
           counts[QMAT_ASSET_WAITING]);
  if (json_object_size(total) > 0)
    type->sentence(name, total, text, sizeof text);
  else
    snprintf(text, sizeof text, "%s", name);
  json_decref(total);
  qmat_print_summary(text, stdout);
  qmat_format_bytes((uint64_t)bytes, size);
  snprintf(text, sizeof text, "%zu file%s in %.500s (%s) in %.1f s", files, files == 1 ? "" : "s", call->folder, size,
           qmat_clock_seconds() - call->started);
  fputs("  ", stdout);
  qmat_put_wrapped(stdout, text, 2, 2, qmat_terminal_width(stdout), true);
}

/* ---- the call ---- */

/* Refuses a format that an output of the graph does not have. */
static qmat_status check_formats(const batch_call *call) {
  const qmat_graph *graph = &call->invocation->graph;
  for (size_t k = 0; k < call->invocation->given_count; k++) {
    const qmat_given_option *given = &call->invocation->given[k];
    bool known = strcmp(given->name, "format") != 0;
    for (size_t i = 0; !known && i < graph->output_count; i++) known = output_format(graph, i, given->value) != NULL;
    for (size_t i = 0; !known && i < graph->output_count; i++) {
      char path[64];
      int format;
      snprintf(path, sizeof path, "asset.%.48s", given->value + (*given->value == '.'));
      if (qmat_graph_output_type(graph, i) != QMAT_FILE || qmat_graph_on_request(graph, i)) continue;
      if (qmat_graph_output_format(call->context, graph, i, path, &format) == QMAT_OK) /* by the last of several dots */
        qmat_fail(call->context, QMAT_ERROR_USAGE, "'%s' is not an ending", qmat_show(given->value).text);
      return qmat_fail_field(call->context, "--format");
    }
  }
  return QMAT_OK;
}

/* Refuses a model whose page would have the name of the page of all. */
static qmat_status check_pages(const batch_call *call, const qmat_batch *batch) {
  for (size_t i = 0; i < batch->count; i++)
    if (strcasecmp(batch->assets[i].stem, "index") == 0)
      return qmat_fail(call->context, QMAT_ERROR_USAGE,
                       "the page of '%s' would have the name of the page of all models",
                       qmat_show(batch->assets[i].input).text);
  return QMAT_OK;
}

/* "NAME=PATH" of a word that is an --output; NULL: it is another. */
static const char *output_of(const char *word) {
  static const char option[] = "--output=";
  return strncmp(word, option, sizeof option - 1) == 0 ? word + sizeof option - 1 : NULL;
}

static const char *path_of(const char *output) {
  return strchr(output, '=') + 1;
}

static int by_path(const void *a, const void *b) {
  const char *first = *(const char *const *)a, *second = *(const char *const *)b;
  const int order = strcmp(path_of(first), path_of(second));
  return order != 0 ? order : strcmp(first, second);
}

/* Refuses two results of one path. */
static qmat_status check_outputs(const batch_call *call, const qmat_batch *batch) {
  size_t count = 0, most = 0;
  for (size_t i = 0; i < batch->count; i++)
    for (char **word = batch->assets[i].words; word && *word; word++) most += output_of(*word) != NULL;
  const char **sorted = qmat_alloc(most, sizeof *sorted);
  if (!sorted) return qmat_fail_memory(call->context, "outputs");
  for (size_t i = 0; i < batch->count; i++)
    for (char **word = batch->assets[i].words; word && *word; word++)
      if (output_of(*word)) sorted[count++] = output_of(*word);
  if (count > 1) qsort(sorted, count, sizeof *sorted, by_path);
  qmat_status status = QMAT_OK;
  for (size_t i = 1; i < count && status == QMAT_OK; i++)
    if (strcmp(path_of(sorted[i - 1]), path_of(sorted[i])) == 0)
      status = qmat_fail(call->context, QMAT_ERROR_USAGE, "outputs '%.*s' and '%.*s' would have the same path '%s'",
                         (int)strcspn(sorted[i - 1], "="), sorted[i - 1], (int)strcspn(sorted[i], "="), sorted[i],
                         path_of(sorted[i]));
  qmat_free(sorted);
  return status;
}

/* Makes a folder for the reports of the assets. On a cluster it is inside the results, the one folder that is shared.
 */
static qmat_status make_report_folder(batch_call *call) {
  const char *temporary = getenv("TMPDIR");
  if (!temporary || !*temporary) temporary = "/tmp";
  int length = snprintf(call->reports, sizeof call->reports, "%s/%sqmat-batch-XXXXXX",
                        call->slurm ? call->folder : temporary, call->slurm ? "." : "");
  if (length < (int)sizeof call->reports && mkdtemp(call->reports)) return QMAT_OK;
  call->reports[0] = 0;
  qmat_fail(call->context, QMAT_ERROR_IO, "cannot make a folder for reports in it");
  return qmat_fail_at(call->context, call->slurm ? call->folder : temporary, 0, 0);
}

static qmat_status prepare(batch_call *call) {
  qmat_context *context = call->context;
  const qmat_invocation *invocation = call->invocation;
  struct stat about;
  char inside[4096];
  snprintf(inside, sizeof inside, "%.4000s/", call->folder);
  qmat_status status = qmat_make_folders(context, inside);
  if (status == QMAT_OK && (stat(call->folder, &about) != 0 || !S_ISDIR(about.st_mode))) {
    qmat_fail(context, QMAT_ERROR_IO, "cannot make the folder of the results");
    status = qmat_fail_at(context, call->folder, 0, 0);
  }
  if (status != QMAT_OK) return status;
  const char *engine = qmat_invocation_value(invocation, "engine");
  call->slurm = engine && strcmp(engine, "slurm") == 0;
  if (engine && !call->slurm && strcmp(engine, "local") != 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the engine has to be local or slurm, not '%s'", qmat_show(engine).text);
    return qmat_fail_field(context, "--engine");
  }
  /* The cluster decides how many tasks run at a time. */
  call->jobs = call->slurm ? 0 : qmat_threads(context);
  status = qmat_invocation_number(context, invocation, "jobs", 1, 1024, &call->jobs);
  call->threads = call->slurm || call->jobs > qmat_threads(context) ? 1 : qmat_threads(context) / call->jobs;
  if (status == QMAT_OK) status = qmat_invocation_number(context, invocation, "threads", 1, 1024, &call->threads);
  if (status == QMAT_OK) status = check_formats(call);
  if (status == QMAT_OK && call->graph) status = find_input(call);
  if (status != QMAT_OK) return status;
  ssize_t length = readlink("/proc/self/exe", call->program, sizeof call->program - 1);
  if (length <= 0) return qmat_fail(context, QMAT_ERROR_IO, "cannot find the path of this program");
  call->program[length] = 0;
  return make_report_folder(call);
}

static qmat_status find_models(const batch_call *call, const char *const *inputs, size_t count, qmat_batch *batch) {
  const qmat_invocation *invocation = call->invocation;
  const char **lists = qmat_alloc(invocation->given_count, sizeof *lists);
  size_t list_count = 0;
  if (!lists) return qmat_fail_memory(call->context, "lists of models");
  for (size_t i = 0; i < invocation->given_count; i++)
    if (strcmp(invocation->given[i].name, "inputs") == 0) lists[list_count++] = invocation->given[i].value;
  const qmat_status status = qmat_batch_find(call->context, inputs, count, lists, list_count, call->folder, batch);
  qmat_free(lists);
  return status;
}

qmat_status qmat_run_batch(qmat_context *context, qmat_invocation *invocation, const char *graph,
                           const char *const *inputs, size_t count, const char *results) {
  batch_call call = {.context = context,
                     .invocation = invocation,
                     .graph = graph,
                     .folder = results,
                     .json = qmat_invocation_value(invocation, "json") != NULL,
                     .quiet = qmat_invocation_chooses(invocation, "quiet", "verbose"),
                     .pages = qmat_invocation_value(invocation, "pages") != NULL,
                     .verbose = qmat_invocation_chooses(invocation, "verbose", "quiet"),
                     .redraws = qmat_can_redraw(),
                     .started = qmat_clock_seconds()};
  qmat_batch batch = {0};
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < invocation->given_count && status == QMAT_OK; i++)
    if (strcmp(invocation->given[i].name, "set") == 0)
      status = qmat_graph_assign(context, &invocation->graph, invocation->given[i].value);
  if (status == QMAT_OK) status = find_models(&call, inputs, count, &batch);
  if (status == QMAT_OK) status = prepare(&call);
  if (status == QMAT_OK && call.pages) status = check_pages(&call, &batch);
  for (size_t i = 0; i < batch.count && status == QMAT_OK; i++)
    if (batch.assets[i].state == QMAT_ASSET_WAITING) status = make_command(&call, i, &batch.assets[i]);
  if (status == QMAT_OK) status = check_outputs(&call, &batch);
  bool started = status == QMAT_OK;
  if (started && call.slurm)
    status =
        qmat_batch_run_slurm(context, &batch, call.jobs, call.threads, call.reports, qmat_interrupted, on_asset, &call);
  else if (started)
    status = qmat_batch_run(context, &batch, call.jobs, qmat_interrupted, on_asset, &call);
  size_t failed = 0;
  for (size_t i = 0; i < batch.count; i++) {
    failed += batch.assets[i].state == QMAT_ASSET_FAILED;
    if (batch.assets[i].report) unlink(batch.assets[i].report);
  }
  const bool prints = started && !call.json && !call.quiet;
  if (prints && call.redraws && call.ended < batch.count) fputs("\r\x1b[K", stderr);
  if (prints && call.verbose) print_table(&batch, &call.invocation->graph);
  if (prints) print_totals(&call, &batch);
  if (started && !call.json) print_failures(&batch, call.quiet ? stderr : stdout);
  /* An interrupted batch has a page of what it did, too, and stays interrupted. */
  if (started && call.pages && status == QMAT_CANCELLED) {
    qmat_context own = {0};
    qmat_batch_page_save(&own, &batch, summary_entries(&call.invocation->graph), call.folder);
    qmat_context_uninit(&own);
  }
  if (status == QMAT_OK && call.pages)
    status = qmat_batch_page_save(context, &batch, summary_entries(&call.invocation->graph), call.folder);
  if (status == QMAT_OK && failed > 0)
    status = qmat_fail(context, QMAT_ERROR_IO, "%zu of %zu assets failed", failed, batch.count);
  if (*call.reports) rmdir(call.reports);
  qmat_batch_uninit(&batch);
  return status;
}

static bool names_graph(const char *argument) {
  const char *dot = strrchr(argument, '.');
  const bool ends = dot && (strcmp(dot, ".yaml") == 0 || strcmp(dot, ".yml") == 0 || strcmp(dot, ".json") == 0);
  return ends || qmat_built_in_graph_named(argument);
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const char *results = qmat_invocation_value(invocation, "out");
  const bool graph = invocation->argument_count > 0 && names_graph(invocation->arguments[0]);
  if (!results || (invocation->argument_count == graph && !qmat_invocation_value(invocation, "inputs"))) {
    qmat_fail(context, QMAT_ERROR_USAGE, results ? "the models are missing" : "the folder of the results is missing");
    return qmat_fail_hint(context, "qmat batch models --out results");
  }
  const qmat_status status =
      graph ? qmat_read_graph_argument(context, invocation)
            : qmat_graph_read_built_in(context, &invocation->registry, &qmat_built_in_graphs[0], &invocation->graph);
  return status == QMAT_OK ? qmat_run_batch(context, invocation, graph ? invocation->arguments[0] : NULL,
                                            invocation->arguments + graph, invocation->argument_count - graph, results)
                           : status;
}

static const qmat_option options[] = {
    {"inputs", 'i', "GLOB|LIST",
     "More models: a folder, a quoted pattern, or a file with one path a line (# starts a comment); may be repeated"},
    {"out", 'o', "DIR", "Folder of the results, which get the models' names; made if it is missing"},
    {"format", 'f', "ENDING", "Format of the results; default the graph's; may be repeated"},
    {"pages", 0, NULL, "Also save a page and a picture of each model, and DIR/index.html with all of them"},
    {"input", 0, "NAME", "The graph's input that takes the model; default the only one that is a file"},
    {"jobs", 'j', "N", "How many models at a time; default one per processor; with Slurm, as many as it starts"},
    {"threads", 0, "N", "Threads of each model; default an equal share of the processors; with Slurm, one"},
    {"engine", 0, "local|slurm", "Run here, or as a job array on a Slurm cluster that shares folders and cache"},
    {"set", 0, "NAME=VALUE", "Set a parameter for all models; may be repeated"},
    {"force", 0, "[=NODE]", "Ignore cached results of all nodes, or of one; may be repeated"},
    {"json", 0, NULL, "Print a line of JSON as each model ends, instead of the summary"},
    {"quiet", 'q', NULL, "Print nothing but what failed"},
    {"verbose", 'v', NULL, "Also print a table of the models"},
    {0},
};

const qmat_command qmat_command_batch = {
    .name = "batch",
    .arguments = "[GRAPH] MODEL... --out DIR",
    .summary = "Run a graph on many models",
    .doc =
        "Runs a graph on many models, each in a process of its own. A model is a file, a folder with all models in and "
        "below it, or a quoted pattern with *, ?, [ or ** for any folders. Results have the names of the models, in "
        "the "
        "same sub-folders. Without a graph, as 'qmat mat'. A failure does not stop the others; failures are listed at "
        "the end, and the exit code is then 1. Finished work is in the cache, so an interrupted batch continues when "
        "it "
        "is started again.",
    .options = options,
    .caching = qmat_cache_option_rows,
    .most = SIZE_MAX,
    .run = run,
};
