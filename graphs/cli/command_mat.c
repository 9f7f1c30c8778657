/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "graphs/built_in.h"
#include "graphs/cli/command.h"
#include "graphs/graph_params.h"
#include "graphs/node_json.h"
#include "io/model.h"

/* The graph of a call: qmat_plus, or colliders with --colliders. */
static const qmat_built_in_graph *graph_of(const qmat_invocation *invocation) {
  return qmat_built_in_graph_find(qmat_invocation_value(invocation, "colliders") ? "colliders" : "qmat_plus");
}

static bool has_option(const qmat_invocation *invocation, const char *name) {
  for (size_t i = 0; i < invocation->option_count; i++)
    if (strcmp(invocation->options[i].name, name) == 0) return true;
  return false;
}

/* The description of the parameter that an input of a graph sets. */
static void describe(const qmat_graph *graph, const qmat_graph_input *input, char *text, size_t size) {
  const qmat_graph_node *node = &graph->nodes[input->params[0].node];
  qmat_param_describe(node->type, &node->type->params[input->params[0].param], node->params, text, size);
}

/* The value that an input has in its graph. */
static void format_value(const qmat_graph *graph, const qmat_graph_input *input, char *text, size_t size) {
  const qmat_graph_node *node = &graph->nodes[input->params[0].node];
  qmat_param_format(&node->type->params[input->params[0].param], node->params, text, size);
}

/* The first input of a graph is the argument; each other input is an option of that name. `other` is the other of the
 * two graphs, which may lack the option. */
static qmat_status add_inputs(qmat_context *context, qmat_invocation *invocation, const qmat_graph *graph,
                              const qmat_graph *other, const char *only) {
  qmat_status status = QMAT_OK;
  for (size_t i = 1; i < graph->input_count && status == QMAT_OK; i++) {
    const qmat_graph_input *input = &graph->inputs[i];
    if (has_option(invocation, input->name)) continue;
    const qmat_graph_node *node = &graph->nodes[input->params[0].node];
    const qmat_param *param = &node->type->params[input->params[0].param];
    char *doc = invocation->docs[invocation->option_count], *name = doc + QMAT_OPTION_DOC_SIZE - QMAT_GRAPH_NAME_SIZE;
    const int room = QMAT_OPTION_DOC_SIZE - QMAT_GRAPH_NAME_SIZE;
    /* The graph is freed before the options are. */
    snprintf(name, QMAT_GRAPH_NAME_SIZE, "%s", input->name);
    const qmat_graph_input *shared = qmat_graph_input_called(other, input->name);
    const int start = snprintf(doc, (size_t)room, "%s%s: ", shared ? "" : only, param->doc);
    if (start > 0 && start < room) describe(graph, input, doc + start, (size_t)(room - start));
    char own[64], others[64];
    format_value(graph, input, own, sizeof own);
    if (shared) format_value(other, shared, others, sizeof others);
    const size_t length = strlen(doc);
    if (shared && strcmp(own, others) != 0)
      snprintf(doc + length, (size_t)room - length, " (with --colliders %s)", others);
    status = qmat_invocation_add_option(context, invocation, (qmat_option){name, 0, "VALUE", doc});
  }
  return status;
}

static bool has_output(const qmat_graph *graph, const char *name) {
  for (size_t i = 0; i < graph->output_count; i++)
    if (strcmp(graph->outputs[i].name, name) == 0) return true;
  return false;
}

static qmat_status add_output(qmat_context *context, qmat_invocation *invocation, const qmat_graph *graph,
                              const qmat_graph *colliders) {
  char *doc = invocation->docs[invocation->option_count];
  size_t used = (size_t)snprintf(doc, QMAT_OPTION_DOC_SIZE,
                                 "Save the result; may be repeated. A folder for several models, - for the standard "
                                 "output. The ending chooses the format:");
  const char *comma = "";
  bool in_both = true; /* the outputs of both graphs come first */
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_param *format = qmat_output_format_param(graph->nodes[graph->outputs[i].node].type);
    if (in_both && !has_output(colliders, graph->outputs[i].name)) {
      comma = "; without --colliders also";
      in_both = false;
    }
    for (int k = 0; format && format->choices[k] && used < QMAT_OPTION_DOC_SIZE; k++, comma = ",")
      used += (size_t)snprintf(doc + used, QMAT_OPTION_DOC_SIZE - used, "%s .%s", comma, format->choices[k]);
  }
  return qmat_invocation_add_option(context, invocation, (qmat_option){"output", 'o', "[NAME=]PATH", doc});
}

static qmat_status add_options(qmat_context *context, qmat_invocation *invocation) {
  static const char *const only[] = {"Not with --colliders: ", "With --colliders: "};
  qmat_graph graphs[2] = {{.nodes = NULL}, {.nodes = NULL}};
  qmat_status status = QMAT_OK;
  for (int i = 0; i < 2 && status == QMAT_OK; i++)
    status = qmat_graph_read_built_in(context, &invocation->registry, &qmat_built_in_graphs[i], &graphs[i]);
  if (status == QMAT_OK) status = add_output(context, invocation, &graphs[0], &graphs[1]);
  for (int i = 0; i < 2 && status == QMAT_OK; i++)
    status = add_inputs(context, invocation, &graphs[i], &graphs[1 - i], only[i]);
  for (int i = 0; i < 2; i++) qmat_graph_uninit(&graphs[i]);
  return status;
}

static bool has_ending(const char *path, const char *ending) {
  const size_t length = strlen(path), size = strlen(ending);
  return length > size && strcasecmp(path + length - size, ending) == 0;
}

static bool is_view(const char *path) {
  return has_ending(path, ".html") || has_ending(path, ".htm") || has_ending(path, ".png") || has_ending(path, ".svg");
}

/* Whether the outputs can hold a medial mesh for each mesh of a scene: glTF, or for a scene of USD a layer over it.
 * Pages and pictures show what the others hold, and alone each mesh. */
static bool saves_scene(const qmat_invocation *invocation) {
  const char *chosen = qmat_invocation_value(invocation, "format");
  char stream[32];
  snprintf(stream, sizeof stream, "-.%s", chosen ? chosen : "glb");
  const qmat_format given = qmat_format_of_name(invocation->arguments[0]);
  bool only_views = given == QMAT_FORMAT_GLB || given == QMAT_FORMAT_GLTF || given == QMAT_FORMAT_USD;
  for (size_t i = 0; i < invocation->given_count; i++) {
    const char *path = invocation->given[i].value;
    if (strcmp(invocation->given[i].name, "output") != 0) continue;
    const qmat_format format = qmat_format_of_name(strcmp(path, "-") == 0 ? stream : path);
    if (format == QMAT_FORMAT_GLB || format == QMAT_FORMAT_GLTF) return true;
    if (format == QMAT_FORMAT_USD && given == QMAT_FORMAT_USD) return true;
    only_views = only_views && is_view(path);
  }
  return only_views;
}

/* The graph of colliders makes no pages and pictures. */
static qmat_status check_views(qmat_context *context, const qmat_invocation *invocation) {
  for (size_t i = 0; qmat_invocation_value(invocation, "colliders") && i < invocation->given_count; i++) {
    const char *path = invocation->given[i].value;
    if (strcmp(invocation->given[i].name, "output") != 0 || !is_view(path)) continue;
    qmat_fail(context, QMAT_ERROR_USAGE, "--colliders makes no pages and pictures, such as '%s'", qmat_show(path).text);
    return qmat_fail_hint(context, "save it in a run without --colliders");
  }
  return QMAT_OK;
}

/* Reads the graph; refuses options of the other one. */
static qmat_status read_graph(qmat_context *context, qmat_invocation *invocation) {
  qmat_graph *graph = &invocation->graph;
  const qmat_built_in_graph *built_in = graph_of(invocation);
  qmat_graph_uninit(graph);
  qmat_status status = qmat_graph_read_built_in(context, &invocation->registry, built_in, graph);
  for (size_t i = 0; i < invocation->given_count && status == QMAT_OK; i++) {
    const bool known = qmat_graph_input_called(graph, invocation->given[i].name) != NULL;
    bool made = false;
    for (size_t k = 0; k < invocation->option_count; k++)
      made |= invocation->options[k].doc == invocation->docs[k] && invocation->options[k].letter != 'o' &&
              !strcmp(invocation->options[k].name, invocation->given[i].name);
    if (!made || known) continue;
    const bool colliders = qmat_invocation_value(invocation, "colliders") != NULL;
    status = qmat_fail(context, QMAT_ERROR_USAGE, "option '--%s' is %s --colliders", invocation->given[i].name,
                       colliders ? "not for" : "for");
  }
  invocation->inputs_are_options = true;
  return status;
}

static qmat_status set_inputs(qmat_context *context, qmat_invocation *invocation) {
  qmat_graph *graph = &invocation->graph;
  qmat_status status = qmat_graph_set_named(context, graph, graph->inputs[0].name, invocation->arguments[0]);
  /* The other formats hold one medial mesh, so the meshes of a scene are merged. */
  if (status == QMAT_OK && !saves_scene(invocation)) status = qmat_graph_assign(context, graph, "model.mesh=merged");
  /* --vertices alone means that number of spheres at any distance. */
  if (status == QMAT_OK && qmat_invocation_value(invocation, "vertices") &&
      !qmat_invocation_value(invocation, "epsilon"))
    status = qmat_graph_set_named(context, graph, "epsilon", "0");
  return status;
}

static bool is_folder(const char *path) {
  struct stat about;
  return (stat(path, &about) == 0 && S_ISDIR(about.st_mode)) || (*path && path[strlen(path) - 1] == '/');
}

static bool is_missing(const char *path) {
  struct stat about;
  return stat(path, &about) != 0;
}

/* Several models, or one whose results go to a folder. */
static qmat_status run_many(qmat_context *context, qmat_invocation *invocation) {
  static const char *const of_one_model[] = {"report", "dry-run", "depfile", "progress"};
  for (size_t i = 0; i < sizeof of_one_model / sizeof *of_one_model; i++)
    if (qmat_invocation_value(invocation, of_one_model[i])) {
      qmat_fail(context, QMAT_ERROR_USAGE, "option '--%s' is for one model whose result is a file", of_one_model[i]);
      return qmat_fail_hint(context, "-o FILE, and one model");
    }
  const char *results = qmat_invocation_value(invocation, "output");
  size_t outputs = 0, unused;
  for (size_t i = 0; i < invocation->given_count; i++) outputs += !strcmp(invocation->given[i].name, "output");
  if (outputs > 1 || qmat_is_stream(results) ||
      (!is_folder(results) && (qmat_format_of_name(results) != QMAT_FORMAT_UNKNOWN ||
                               qmat_graph_output_of_ending(&invocation->graph, results, &unused)))) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the results of several models need a folder, not '%s'",
              qmat_show(results).text);
    return qmat_fail_hint(context, "-o results/ --format glb");
  }
  return qmat_run_batch(context, invocation, NULL, invocation->arguments, invocation->argument_count, results);
}

/* One model, whose results are files or the standard output. */
static qmat_status run_one(qmat_context *context, qmat_invocation *invocation) {
  bool streams = false;
  for (size_t i = 0; i < invocation->given_count; i++)
    streams = streams || (!strcmp(invocation->given[i].name, "output") && qmat_is_stream(invocation->given[i].value));
  if (qmat_invocation_value(invocation, "format") && !streams) {
    qmat_fail(context, QMAT_ERROR_USAGE, "option '--format' is for results in a folder or on the standard output");
    return qmat_fail_hint(context, "the ending of the output's path chooses its format");
  }
  return qmat_execute(context, invocation, set_inputs, NULL, NULL);
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const char *first = invocation->arguments[0], *output = qmat_invocation_value(invocation, "output");
  if (!output) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the output path is missing");
    return qmat_fail_hint(context, "-o PATH");
  }
  qmat_status status = read_graph(context, invocation);
  if (status == QMAT_OK) status = check_views(context, invocation);
  if (status != QMAT_OK) return status;
  const bool pattern = strpbrk(first, "*?[") && is_missing(first);
  if (invocation->argument_count > 1 || is_folder(first) || is_folder(output) || pattern)
    return run_many(context, invocation);
  return run_one(context, invocation);
}

static const qmat_option options[] = {
    {"colliders", 0, NULL, "Make colliders too, by the built-in graph 'colliders'"},
    {"format", 'f', "ENDING",
     "Format of the results in a folder or on the standard output; default glb; may be repeated"},
    {"jobs", 'j', "N", "How many models at a time; default one per processor. With one model, its threads"},
    {0},
};

const qmat_command qmat_command_mat = {
    .name = "mat",
    .arguments = "INPUT... -o OUTPUT",
    .summary = "Describe a model by medial spheres, cones and slabs",
    .doc =
        "Runs the built-in graph qmat_plus on a model ('-': the standard input), or on several models, folders and "
        "patterns as 'qmat batch' does. An option that is given twice counts as given last. --vertices without "
        "--epsilon sets epsilon to 0: "
        "no bound on the distance.\n"
        "A glTF scene saved as glTF keeps its contents, and each of its meshes gets a medial mesh. So does a USD scene "
        "saved as USD, by a layer over it, and as glTF. For other formats the meshes are merged (model.mesh=merged).\n"
        "--set reaches every other parameter; 'qmat nodes' lists the nodes, 'qmat node NAME' their parameters.",
    .options = options,
    .common = qmat_common_options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = SIZE_MAX,
    .add_options = add_options,
    .run = run,
};
