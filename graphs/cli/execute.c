/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "graphs/built_in.h"
#include "graphs/cli/command.h"
#include "graphs/cli/print_run.h"
#include "graphs/cli/progress.h"
#include "graphs/cli/terminal.h"
#include "graphs/graph_file.h"
#include "graphs/graph_names.h"
#include "graphs/graph_params.h"
#include "graphs/run/graph_run.h"
#include "graphs/run/run_outputs.h"
#include "graphs/run/run_paths.h"
#include "graphs/run/run_report.h"

const qmat_option qmat_common_options[] = {
    {"set", 0, "NAME=VALUE", "Set a parameter, as node.parameter=value or input=value; may be repeated"},
    {"threads", 0, "N", "Number of threads; 0, the default: one per processor"},
    {"progress", 0, "HOW",
     "Progress on stderr: tty, json (one object a line) or off; default tty on a terminal, else off"},
    {"report", 0, "FILE", "Write a report of the run, or of its error, as JSON"},
    {"force", 0, "[=NODE]", "Ignore cached results of all nodes, or of one; may be repeated"},
    {"dry-run", 0, NULL, "Print which nodes would run and which results are cached; run nothing"},
    {"depfile", 0, "FILE",
     "Write the dependencies of what -o names, else of what the graph saves, as a rule for Make and Ninja"},
    {"quiet", 'q', NULL, "Print nothing but what failed"},
    {"verbose", 'v', NULL, "Also print a table of the nodes: state, time and results"},
    {0},
};

const qmat_option qmat_output_options[] = {
    {"output", 'o', "[NAME=]PATH", "Save an output; the ending chooses the format; may be repeated"},
    {"format", 'f', "ENDING", "Format of an output that goes to the standard output, as in -o -"},
    {"jobs", 'j', "N", "Another name for --threads"},
    {"no-paths", 0, NULL, "Save only what -o names, nothing at the paths that the graph gives"},
    {"to", 0, "NODE", "Run only this node and the nodes that it needs"},
    {0},
};

/* Reads "NAME=PATH", or "PATH" if one output alone has the ending, or if exactly one is a file. */
static qmat_status read_save(qmat_context *context, const qmat_graph *graph, const char *text, qmat_run_save *save) {
  const char *equals = strchr(text, '=');
  char name[QMAT_GRAPH_NAME_SIZE];
  if (equals && (size_t)(equals - text) < sizeof name && !memchr(text, '/', (size_t)(equals - text)) &&
      !memchr(text, '.', (size_t)(equals - text))) {
    memcpy(name, text, (size_t)(equals - text));
    name[equals - text] = 0;
    save->path = equals + 1;
    return qmat_graph_find_output(context, graph, name, &save->output);
  }
  save->path = text;
  if (qmat_graph_output_of_ending(graph, text, &save->output)) return QMAT_OK;
  const size_t files = qmat_graph_file_count(graph, &save->output);
  if (files == 1) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "'%s' needs the name of an output: the graph makes %zu files",
            qmat_show(text).text, files);
  if (files > 0)
    qmat_fail_hint(context, "-o %s=%s", graph->outputs[save->output].name, qmat_show(text).text);
  else if (graph->output_count > 0)
    qmat_fail_hint(context, "-o %s=PATH saves output '%s'", graph->outputs[0].name, graph->outputs[0].name);
  return context->error.status;
}

/* Makes the folder of a path that is written, or puts the standard output in its place. */
static qmat_status prepare_save(qmat_context *context, qmat_invocation *invocation, qmat_run_save *save) {
  const qmat_graph *graph = &invocation->graph;
  const char *format = qmat_invocation_value(invocation, "format");
  if (!qmat_is_stream(save->path)) {
    int choice;
    const qmat_status status = qmat_graph_output_format(context, graph, save->output, save->path, &choice);
    return status == QMAT_OK ? qmat_make_folders(context, save->path) : status;
  }
  char ending[32] = "json";
  const qmat_graph_node *node = &graph->nodes[graph->outputs[save->output].node];
  const qmat_param *param = qmat_output_format_param(node->type);
  if (param) qmat_param_format(param, node->params, ending, sizeof ending);
  if (format) snprintf(ending, sizeof ending, "%s", format);
  if (save->path[1]) snprintf(ending, sizeof ending, "%s", save->path + 2);
  char name[40];
  snprintf(name, sizeof name, "x.%s", ending);
  qmat_graph_output_of_ending(graph, name, &save->output);
  return qmat_streams_write(context, &invocation->streams, ending, &save->path);
}

static qmat_status plan(qmat_context *context, qmat_invocation *invocation, bool foresee, qmat_planned_run *planned) {
  qmat_run_options options = {.saves = planned->saves,
                              .no_paths = qmat_invocation_value(invocation, "no-paths") != NULL,
                              .foresee = foresee,
                              .to_node = qmat_invocation_value(invocation, "to"),
                              .cache = planned->cached ? &planned->cache : NULL,
                              .forced = planned->forced};
  for (size_t i = 0; i < invocation->given_count; i++) {
    const char *name = invocation->given[i].name, *value = invocation->given[i].value;
    qmat_status status = QMAT_OK;
    if (strcmp(name, "force") == 0 && !*value) options.force_all = true;
    if (strcmp(name, "force") == 0 && *value) {
      status = qmat_graph_find_node(context, &invocation->graph, value, &planned->forced[options.forced_count++]);
      if (status != QMAT_OK) return qmat_fail_field(context, "--force");
    }
    if (strcmp(name, "output") == 0) {
      qmat_run_save *save = &planned->saves[options.save_count++];
      status = read_save(context, &invocation->graph, value, save);
      if (status == QMAT_OK && (!foresee || qmat_is_stream(save->path)))
        status = prepare_save(context, invocation, save);
      if (status != QMAT_OK) return qmat_fail_field(context, "--output");
    }
  }
  return qmat_run_plan(context, &invocation->graph, &options, &planned->run);
}

/* Applies an option that sets parameters. The later of two wins. */
static qmat_status assign(qmat_context *context, qmat_invocation *invocation, size_t index) {
  qmat_graph *graph = &invocation->graph;
  const qmat_given_option *given = &invocation->given[index];
  if (strcmp(given->name, "set") == 0) {
    const qmat_status status = qmat_graph_assign(context, graph, given->value);
    return status == QMAT_OK || context->error.node_id[0] ? status : qmat_fail_field(context, "--set");
  }
  for (size_t i = 0; invocation->inputs_are_options && i < graph->input_count; i++)
    if (strcmp(graph->inputs[i].name, given->name) == 0)
      return qmat_graph_set_named(context, graph, given->name, given->value);
  return QMAT_OK;
}

/* Where an input file is "-", the run reads the standard input. */
static qmat_status read_standard_input(qmat_context *context, qmat_invocation *invocation) {
  qmat_graph *graph = &invocation->graph;
  for (size_t i = 0; i < graph->node_count; i++)
    for (size_t row = 0; row < qmat_param_count(graph->nodes[i].type); row++) {
      const qmat_param *param = &graph->nodes[i].type->params[row];
      const char *text = graph->nodes[i].texts[row], *path;
      const bool reads = param->type == QMAT_PARAM_PATH && (param->flags & QMAT_PARAM_INPUT_FILE);
      if (!reads || !text || strcmp(text, "-") != 0) continue;
      qmat_status status = qmat_streams_read(context, &invocation->streams, &path);
      if (status == QMAT_OK) status = qmat_graph_set(context, graph, i, row, path, "");
      if (status != QMAT_OK) return status;
    }
  return QMAT_OK;
}

qmat_status qmat_plan_invocation(qmat_context *context, qmat_invocation *invocation,
                                 qmat_status (*prepare)(qmat_context *context, qmat_invocation *invocation),
                                 bool foresee, qmat_planned_run *planned) {
  *planned = (qmat_planned_run){0};
  invocation->streams.output[0] = 0; /* of the run before, where files are watched */
  planned->saves = qmat_calloc(invocation->given_count, sizeof *planned->saves);
  planned->forced = qmat_calloc(invocation->given_count, sizeof *planned->forced);
  if (!planned->saves || !planned->forced) return qmat_fail_memory(context, "options");
  qmat_status status = prepare(context, invocation);
  for (size_t i = 0; i < invocation->given_count && status == QMAT_OK; i++) status = assign(context, invocation, i);
  if (status == QMAT_OK) status = read_standard_input(context, invocation);
  if (status == QMAT_OK) status = qmat_open_cache(context, invocation, &planned->cache, &planned->cached);
  return status == QMAT_OK ? plan(context, invocation, foresee, planned) : status;
}

void qmat_planned_run_uninit(qmat_planned_run *planned) {
  qmat_run_uninit(&planned->run);
  qmat_cache_close(&planned->cache);
  qmat_free(planned->saves);
  qmat_free(planned->forced);
  *planned = (qmat_planned_run){0};
}

qmat_status qmat_read_graph_argument(qmat_context *context, qmat_invocation *invocation) {
  const char *name = invocation->arguments[0], *path = name;
  const qmat_built_in_graph *built_in = qmat_built_in_graph_named(name);
  if (built_in) return qmat_graph_read_built_in(context, &invocation->registry, built_in, &invocation->graph);
  const char *stream = strcmp(name, "-") == 0 ? QMAT_STREAM_NAME : NULL;
  qmat_status status = stream ? qmat_streams_read(context, &invocation->streams, &path) : QMAT_OK;
  if (status == QMAT_OK)
    status =
        qmat_graph_read_file_all(context, &invocation->registry, path, stream, qmat_print_error, &invocation->graph);
  if (status != QMAT_OK && access(path, F_OK) != 0) qmat_fail_hint(context, "'qmat graphs' lists the built-in ones");
  return status;
}

/* The report of a failure must not replace a file that the run would have read or written. */
static bool may_write_error(const qmat_invocation *invocation, const char *path) {
  for (size_t i = 0; i < invocation->argument_count; i++)
    if (qmat_same_file(path, invocation->arguments[i])) return false;
  for (size_t i = 0; i < invocation->given_count; i++) {
    const char *value = invocation->given[i].value, *equals = strchr(value, '=');
    const char *name = invocation->given[i].name;
    if (strcmp(name, "output") != 0 && strcmp(name, "set") != 0 && strcmp(name, "depfile") != 0) continue;
    if (qmat_same_file(path, value) || (equals && qmat_same_file(path, equals + 1))) return false;
  }
  const qmat_graph *graph = &invocation->graph;
  for (size_t i = 0; i < graph->node_count; i++)
    for (size_t row = 0; row < qmat_param_count(graph->nodes[i].type); row++) {
      const char *text = graph->nodes[i].texts[row];
      bool is_path = graph->nodes[i].type->params[row].type == QMAT_PARAM_PATH;
      if (is_path && text && qmat_same_file(path, text)) return false;
    }
  for (size_t i = 0; i < graph->output_count; i++)
    if (graph->outputs[i].path && qmat_same_file(path, graph->outputs[i].path)) return false;
  return true;
}

static void print_warnings(const qmat_run *run, bool quiet) {
  json_t *warnings = qmat_run_warnings(run, quiet);
  for (size_t i = 0; i < json_array_size(warnings); i++) {
    fputs("qmat: warning: ", stderr);
    qmat_put_shown(stderr, json_string_value(json_array_get(warnings, i)));
    fputc('\n', stderr);
  }
  json_decref(warnings);
}

/* Copies what goes to the standard output there, and gives it its name in reports. */
static qmat_status finish_stream(qmat_context *context, const qmat_invocation *invocation, qmat_run *run) {
  for (size_t i = 0; i < run->file_count; i++) {
    qmat_run_file *file = &run->files[i];
    if (strcmp(file->path, invocation->streams.output) != 0) continue;
    if (file->written && file->written->part_count > 1) {
      qmat_fail(context, QMAT_ERROR_USAGE, "a .%s has side files, which the standard output cannot hold",
                file->written->format);
      return qmat_fail_hint(context, "-o -.glb");
    }
    char *name = qmat_strdup("-");
    if (!name) return qmat_fail_memory(context, "output path");
    qmat_free(file->path);
    file->path = name;
  }
  return qmat_streams_flush(context, &invocation->streams);
}

/* Refuses the standard output where only a file can be written. */
static qmat_status check_files(qmat_context *context, const qmat_invocation *invocation) {
  static const char *const options[] = {"report", "depfile"};
  for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
    const char *path = qmat_invocation_value(invocation, options[i]);
    if (!path || !qmat_is_stream(path)) continue;
    qmat_fail(context, QMAT_ERROR_USAGE, "option '--%s' needs the path of a file, not '%s'", options[i],
              qmat_show(path).text);
    return qmat_fail_hint(context, "--%s FILE", options[i]);
  }
  return QMAT_OK;
}

/* Makes the folders of the report and the depfile, which are written after the run, and refuses what can be refused
 * before it. Either path may be NULL. */
static qmat_status prepare_later_files(qmat_context *context, const qmat_invocation *invocation, const qmat_run *run,
                                       const char *report, const char *depfile) {
  const bool make = !run->foreseen;
  qmat_status status = QMAT_OK;
  if (report && make) status = qmat_make_folders(context, report);
  if (status == QMAT_OK && report) status = qmat_run_check_path(context, run, "the report", report);
  if (status == QMAT_OK && depfile && make) status = qmat_make_folders(context, depfile);
  if (status == QMAT_OK && depfile) status = qmat_run_check_path(context, run, "the depfile", depfile);
  if (status == QMAT_OK && depfile && qmat_run_count_saved(run, invocation->streams.folder) == 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "option '--depfile' needs an output that is saved to a file");
    status = qmat_fail_hint(context, "-o FILE");
  }
  char names[512]; /* told after the run, with the names that only the run finds */
  if (status == QMAT_OK && depfile)
    status = qmat_run_check_depfile(context, run, invocation->streams.folder, names, sizeof names);
  if (status == QMAT_OK && report && depfile && qmat_same_file(depfile, report))
    status = qmat_fail(context, QMAT_ERROR_USAGE, "the depfile '%s' would overwrite the report", depfile);
  return status;
}

qmat_status qmat_execute(qmat_context *context, qmat_invocation *invocation,
                         qmat_status (*prepare)(qmat_context *context, qmat_invocation *invocation),
                         void (*finished)(void *user, const qmat_graph *graph, const qmat_run *run), void *user) {
  const char *report_path = qmat_invocation_value(invocation, "report");
  const char *depfile = qmat_invocation_value(invocation, "depfile");
  bool quiet = qmat_invocation_chooses(invocation, "quiet", "verbose");
  bool verbose = qmat_invocation_chooses(invocation, "verbose", "quiet");
  bool dry = qmat_invocation_value(invocation, "dry-run") != NULL;
  const char *mode = qmat_invocation_value(invocation, "progress");
  qmat_progress_view view = {0};
  qmat_run_observer observer;
  qmat_planned_run planned = {0};
  qmat_run *run = &planned.run;
  qmat_status status = check_files(context, invocation);
  if (status != QMAT_OK) return status;
  status = qmat_progress_view_init(context, mode || !quiet ? mode : "off", &view);
  if (status == QMAT_OK) status = qmat_invocation_number(context, invocation, "jobs", 1, 1024, &context->threads);
  if (status == QMAT_OK) status = qmat_invocation_number(context, invocation, "threads", 0, 1024, &context->threads);
  if (status == QMAT_OK) status = qmat_plan_invocation(context, invocation, prepare, dry, &planned);
  if (status == QMAT_OK) status = prepare_later_files(context, invocation, run, report_path, depfile);
  bool ready = status == QMAT_OK, reported = false;
  char names[512] = ""; /* a warning about the names of files */
  if (ready && dry) {
    qmat_run_foresee(run);
    qmat_print_plan(run, verbose, stdout);
  }
  if (ready && !dry) {
    qmat_progress_view_connect(&view, context, &observer);
    status = qmat_run_execute(context, run, &observer);
    qmat_progress_view_end(&view);
    context->progress = NULL;
    if (status == QMAT_OK) status = qmat_run_make_files(context, run);
    if (status == QMAT_OK && report_path) {
      status = qmat_run_check_later_file(context, run, "the report", report_path);
      if (status != QMAT_OK) report_path = NULL; /* nor may the error be written there */
    }
    if (status == QMAT_OK && depfile) status = qmat_run_check_later_file(context, run, "the depfile", depfile);
    if (status == QMAT_OK && depfile)
      status = qmat_run_check_depfile(context, run, invocation->streams.folder, names, sizeof names);
    if (status == QMAT_OK) status = qmat_run_write(context, run);
    if (status == QMAT_OK) status = finish_stream(context, invocation, run);
  }
  if (status == QMAT_OK && depfile && !dry)
    status = qmat_run_write_depfile(context, run, depfile, invocation->streams.folder);
  if (planned.cached && !dry) qmat_cache_trim(&planned.cache); /* the report has its warning */
  if (status == QMAT_OK && report_path && !dry) {
    json_t *report = qmat_run_report(context, run);
    qmat_streams_name_in(&invocation->streams, report);
    status = qmat_save_json(context, report, report_path);
    json_decref(report);
    reported = true;
  }
  if (status == QMAT_OK && !quiet && !dry)
    qmat_print_run(run, verbose, invocation->streams.output[0] ? stderr : stdout);
  if (status != QMAT_OK && report_path && !reported &&
      (ready ? !qmat_run_has_read(run, report_path) : may_write_error(invocation, report_path))) {
    /* A failure to write the report must not replace this error. */
    qmat_streams_name(&invocation->streams, &context->error);
    const qmat_error error = context->error;
    json_t *report = qmat_error_report(&error);
    if (ready && !dry) json_object_set_new(report, "warnings", qmat_run_warnings(run, false));
    qmat_save_json(context, report, report_path);
    json_decref(report);
    context->error = error;
  }
  if (ready && !dry) print_warnings(run, quiet);
  if (*names && !quiet) fprintf(stderr, "qmat: warning: %s\n", names);
  const char *warning = planned.cached ? qmat_cache_warning(&planned.cache) : "";
  if (*warning && !quiet) fprintf(stderr, "qmat: warning: %s\n", warning);
  if (!dry) qmat_progress_view_finish(&view, run, status);
  if (finished) finished(user, &invocation->graph, run);
  qmat_planned_run_uninit(&planned);
  return status;
}
