/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/json_text.h"
#include "graphs/cli/batch.h"
#include "graphs/cli/command.h"
#include "graphs/cli/progress.h"
#include "graphs/graph_params.h"
#include "graphs/run/run_report.h"

/* One call of `qmat batch`. */
typedef struct batch_call {
  qmat_context *context;
  qmat_invocation *invocation;
  const char *folder, *format, *input; /* --out, --format, and the graph's input that takes the model */
  char program[4096], reports[4096];
  int jobs, threads;
  bool json, quiet, slurm;
  size_t ended;
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

/* Adds the options that every asset gets: the cache, parameters, --force. */
static void add_shared_words(word_list *list, const qmat_invocation *invocation) {
  for (size_t i = 0; i < invocation->given_count; i++) {
    const qmat_given_option *given = &invocation->given[i];
    bool shared = strcmp(given->name, "set") == 0 || strcmp(given->name, "force") == 0;
    for (const qmat_option *option = qmat_cache_option_rows; option->name; option++)
      shared = shared || strcmp(option->name, given->name) == 0;
    if (shared) add_word(list, *given->value ? "--%s=%s" : "--%s", given->name, given->value);
  }
}

static qmat_status make_command(const batch_call *call, size_t index, qmat_asset *asset) {
  const qmat_graph *graph = &call->invocation->graph;
  word_list list = {0};
  size_t last;
  const size_t files = qmat_graph_file_count(graph, &last);
  add_word(&list, "%s", call->program);
  add_word(&list, "run");
  add_word(&list, "--quiet");
  add_word(&list, "--threads=%d", call->threads);
  add_word(&list, "--report=%s/%zu.json", call->reports, index);
  add_shared_words(&list, call->invocation);
  add_word(&list, "--set=%s=%s", call->input, asset->input);
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_graph_output *output = &graph->outputs[i];
    const qmat_node *type = graph->nodes[output->node].type;
    const qmat_param *format = qmat_output_format_param(type);
    if (qmat_graph_output_type(graph, i) != QMAT_FILE || !format) continue;
    char ending[64];
    qmat_param_format(format, graph->nodes[output->node].params, ending, sizeof ending);
    /* Several outputs differ by their names. */
    add_word(&list, "--output=%s=%s/%s%s%s.%s", output->name, call->folder, asset->stem, files > 1 ? "-" : "",
             files > 1 ? output->name : "", call->format ? call->format : ending);
  }
  add_word(&list, "--");
  add_word(&list, "%s", call->invocation->arguments[0]);
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

static void on_asset(void *user, const qmat_batch *batch, const qmat_asset *asset) {
  batch_call *call = user;
  call->ended++;
  if (call->json) print_json_line(asset);
  if (!call->json && !call->quiet)
    fprintf(stderr, "[%zu/%zu] %s: %s, %.1f s\n", call->ended, batch->count, asset->input,
            asset->state == QMAT_ASSET_DONE ? "ok" : "failed", asset->seconds);
}

/* The width of a name, one column a character. */
static int columns_of(const char *name) {
  int columns = 0;
  for (; *name; name++) columns += ((unsigned char)*name & 0xc0) != 0x80;
  return columns;
}

/* The entries that the assets' summaries are expected to have: those of the graph's last node with a summary. */
static const qmat_summary_entry *summary_entries(const qmat_graph *graph) {
  static const qmat_summary_entry none[] = {{0}};
  for (size_t i = graph->node_count; i-- > 0;)
    if (graph->nodes[i].type->report_summary) return graph->nodes[i].type->report_summary->entries;
  return none;
}

/* The width of an entry's column. */
static int column_width(const qmat_summary_entry *entry) {
  return columns_of(entry->title) > 7 ? columns_of(entry->title) : 7;
}

static void print_summary(const qmat_summary_entry *entries, const json_t *summary) {
  for (size_t i = 0; entries[i].key; i++) {
    const json_t *value = json_object_get(summary, entries[i].key);
    char text[48];
    if (!entries[i].title) continue;
    if (json_is_integer(value))
      qmat_format_count((uint64_t)json_integer_value(value), text);
    else
      qmat_format_bound(json_real_value(value), text);
    printf("  %*s", column_width(&entries[i]), text);
  }
}

static void print_table(const qmat_batch *batch, const qmat_graph *graph) {
  const qmat_summary_entry *entries = summary_entries(graph);
  int width = 5;
  size_t counts[4] = {0};
  for (size_t i = 0; i < batch->count; i++)
    if (columns_of(batch->assets[i].stem) > width) width = columns_of(batch->assets[i].stem);
  printf("%-*s  result   seconds  hits ", width, "asset");
  for (size_t i = 0; entries[i].key; i++)
    if (entries[i].title) printf("  %*s", column_width(&entries[i]), entries[i].title);
  putchar('\n');
  for (size_t i = 0; i < batch->count; i++) {
    const qmat_asset *asset = &batch->assets[i];
    const json_t *summary = json_object_get(asset->result, "summary"), *nodes = json_object_get(asset->result, "nodes");
    static const char *const results[] = {"not run", "running", "ok", "failed"};
    counts[asset->state]++;
    printf("%s%*s  %-7s %8.2f s", asset->stem, width - columns_of(asset->stem), "", results[asset->state],
           asset->seconds);
    if (asset->state == QMAT_ASSET_DONE)
      printf("  %2lld/%-2zu", json_integer_value(json_object_get(json_object_get(asset->result, "cache"), "hits")),
             json_array_size(nodes));
    if (json_is_object(summary)) print_summary(entries, summary);
    putchar('\n');
  }
  printf("%zu done, %zu failed, %zu not run\n", counts[QMAT_ASSET_DONE], counts[QMAT_ASSET_FAILED],
         counts[QMAT_ASSET_WAITING]);
  for (size_t i = 0; i < batch->count; i++) {
    char error[2048];
    if (batch->assets[i].state != QMAT_ASSET_FAILED) continue;
    qmat_asset_error(&batch->assets[i], error, sizeof error);
    printf("%s: %s\n", batch->assets[i].input, error);
  }
}

/* ---- the call ---- */

/* Refuses a format that an output of the graph does not have. */
static qmat_status check_format(const batch_call *call) {
  const qmat_graph *graph = &call->invocation->graph;
  for (size_t i = 0; call->format && i < graph->output_count; i++) {
    char path[64];
    int format;
    snprintf(path, sizeof path, "asset.%.48s", call->format);
    if (qmat_graph_output_type(graph, i) != QMAT_FILE) continue;
    if (qmat_graph_output_format(call->context, graph, i, path, &format) != QMAT_OK)
      return qmat_fail_field(call->context, "--format");
  }
  return QMAT_OK;
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
  call->folder = qmat_invocation_value(invocation, "out");
  call->format = qmat_invocation_value(invocation, "format");
  if (!qmat_invocation_value(invocation, "inputs") || !call->folder) {
    qmat_fail(context, QMAT_ERROR_USAGE, "--inputs and --out are required");
    return qmat_fail_hint(context, "--inputs 'models/*.off' --out results");
  }
  if (mkdir(call->folder, 0777) != 0 && (stat(call->folder, &about) != 0 || !S_ISDIR(about.st_mode))) {
    qmat_fail(context, QMAT_ERROR_IO, "cannot make the folder of the results");
    return qmat_fail_at(context, call->folder, 0, 0);
  }
  const char *engine = qmat_invocation_value(invocation, "engine");
  call->slurm = engine && strcmp(engine, "slurm") == 0;
  if (engine && !call->slurm && strcmp(engine, "local") != 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the engine has to be local or slurm, not '%s'", qmat_show(engine).text);
    return qmat_fail_field(context, "--engine");
  }
  /* The cluster decides how many tasks run at a time. */
  call->jobs = call->slurm ? 0 : qmat_threads(context);
  qmat_status status = qmat_invocation_number(context, invocation, "jobs", 1, 1024, &call->jobs);
  call->threads = call->slurm || call->jobs > qmat_threads(context) ? 1 : qmat_threads(context) / call->jobs;
  if (status == QMAT_OK) status = qmat_invocation_number(context, invocation, "threads", 1, 1024, &call->threads);
  if (status == QMAT_OK) status = check_format(call);
  if (status == QMAT_OK) status = find_input(call);
  if (status != QMAT_OK) return status;
  ssize_t length = readlink("/proc/self/exe", call->program, sizeof call->program - 1);
  if (length <= 0) return qmat_fail(context, QMAT_ERROR_IO, "cannot find the path of this program");
  call->program[length] = 0;
  return make_report_folder(call);
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  batch_call call = {.context = context,
                     .invocation = invocation,
                     .json = qmat_invocation_value(invocation, "json") != NULL,
                     .quiet = qmat_invocation_value(invocation, "quiet") != NULL};
  qmat_batch batch = {0};
  qmat_status status = qmat_read_graph_argument(context, invocation);
  for (size_t i = 0; i < invocation->given_count && status == QMAT_OK; i++)
    if (strcmp(invocation->given[i].name, "set") == 0)
      status = qmat_graph_assign(context, &invocation->graph, invocation->given[i].value);
  if (status == QMAT_OK) status = prepare(&call);
  if (status == QMAT_OK) status = qmat_batch_find(context, qmat_invocation_value(invocation, "inputs"), &batch);
  for (size_t i = 0; i < batch.count && status == QMAT_OK; i++) status = make_command(&call, i, &batch.assets[i]);
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
  if (started && !call.json && !call.quiet) print_table(&batch, &call.invocation->graph);
  if (status == QMAT_OK && failed > 0)
    status = qmat_fail(context, QMAT_ERROR_IO, "%zu of %zu assets failed", failed, batch.count);
  if (*call.reports) rmdir(call.reports);
  qmat_batch_uninit(&batch);
  return status;
}

static const qmat_option options[] = {
    {"inputs", 0, "GLOB|LIST", "The models: a quoted pattern with *, ? or [, or a file with one path a line"},
    {"out", 0, "DIR", "Folder of the results, which get the models' names; made if it is missing"},
    {"format", 0, "ENDING", "Format of the results; default the graph's"},
    {"input", 0, "NAME", "The graph's input that takes the model; default the only one that is a file"},
    {"jobs", 0, "N", "How many models at a time; default one per processor"},
    {"threads", 0, "N", "Threads of each model; default an equal share of the processors"},
    {"engine", 0, "local|slurm", "Run here, or as a job array on a Slurm cluster that shares folders and cache"},
    {"set", 0, "NAME=VALUE", "Set a parameter for all models; may be repeated"},
    {"force", 0, "[=NODE]", "Ignore cached results of all nodes, or of one; may be repeated"},
    {"json", 0, NULL, "Print a line of JSON as each model ends, instead of the table"},
    {"quiet", 'q', NULL, "Print nothing but errors"},
    {0},
};

const qmat_command qmat_command_batch = {
    .name = "batch",
    .arguments = "GRAPH",
    .summary = "Run a graph on many models",
    .doc =
        "Runs a graph file on many models, each in a process of its own. A failure does not stop the others; failures "
        "are listed at the end, and the exit code is then 1. Finished work is in the cache, so an interrupted batch "
        "continues when it is started again.",
    .options = options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = 1,
    .run = run,
};
