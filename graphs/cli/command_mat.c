/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "graphs/built_in.h"
#include "graphs/cli/command.h"
#include "graphs/graph_params.h"
#include "graphs/node_json.h"
#include "io/model.h"

/* The first input of the built-in graph is the argument; each other input is an option of that name. */
static qmat_status add_options(qmat_context *context, qmat_invocation *invocation) {
  qmat_status status = qmat_graph_read_built_in(context, &invocation->registry, &invocation->graph);
  if (status != QMAT_OK) return status;
  const qmat_graph *graph = &invocation->graph;
  for (size_t i = 1; i < graph->input_count && status == QMAT_OK; i++) {
    const qmat_graph_input *input = &graph->inputs[i];
    const qmat_graph_node *node = &graph->nodes[input->params[0].node];
    const qmat_param *param = &node->type->params[input->params[0].param];
    char *doc = invocation->docs[invocation->option_count];
    int length = snprintf(doc, QMAT_OPTION_DOC_SIZE, "%s: ", param->doc);
    if (length > 0 && length < QMAT_OPTION_DOC_SIZE)
      qmat_param_describe(node->type, param, node->params, doc + length, (size_t)(QMAT_OPTION_DOC_SIZE - length));
    status = qmat_invocation_add_option(context, invocation, (qmat_option){input->name, 0, "VALUE", doc});
  }
  if (status != QMAT_OK) return status;
  char *doc = invocation->docs[invocation->option_count];
  size_t used =
      (size_t)snprintf(doc, QMAT_OPTION_DOC_SIZE, "Save the result; may be repeated. The ending chooses the format:");
  const char *comma = "";
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_param *format = qmat_output_format_param(graph->nodes[graph->outputs[i].node].type);
    for (int k = 0; format && format->choices[k] && used < QMAT_OPTION_DOC_SIZE; k++, comma = ",")
      used += (size_t)snprintf(doc + used, QMAT_OPTION_DOC_SIZE - used, "%s .%s", comma, format->choices[k]);
  }
  return qmat_invocation_add_option(context, invocation, (qmat_option){"output", 'o', "[NAME=]PATH", doc});
}

static bool has_ending(const char *path, const char *ending) {
  const size_t length = strlen(path), size = strlen(ending);
  return length > size && strcasecmp(path + length - size, ending) == 0;
}

/* Whether the outputs can hold a medial mesh for each mesh of a scene: glTF, or for a scene of USD a layer over it.
 * Pages and pictures show what the others hold, and alone each mesh. */
static bool saves_scene(const qmat_invocation *invocation) {
  const qmat_format given = qmat_format_of_name(invocation->arguments[0]);
  bool only_views = given == QMAT_FORMAT_GLB || given == QMAT_FORMAT_GLTF || given == QMAT_FORMAT_USD;
  for (size_t i = 0; i < invocation->given_count; i++) {
    if (strcmp(invocation->given[i].name, "output") != 0) continue;
    const char *path = invocation->given[i].value;
    const qmat_format format = qmat_format_of_name(path);
    if (format == QMAT_FORMAT_GLB || format == QMAT_FORMAT_GLTF) return true;
    if (format == QMAT_FORMAT_USD && given == QMAT_FORMAT_USD) return true;
    only_views = only_views && (has_ending(path, ".html") || has_ending(path, ".png") || has_ending(path, ".svg"));
  }
  return only_views;
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
  for (size_t i = 1; i < graph->input_count && status == QMAT_OK; i++) {
    const char *value = qmat_invocation_value(invocation, graph->inputs[i].name);
    if (value) status = qmat_graph_set_named(context, graph, graph->inputs[i].name, value);
  }
  return status;
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  if (!qmat_invocation_value(invocation, "output")) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the output path is missing");
    return qmat_fail_hint(context, "-o PATH");
  }
  return qmat_execute(context, invocation, set_inputs, NULL, NULL);
}

const qmat_command qmat_command_mat = {
    .name = "mat",
    .arguments = "INPUT -o OUTPUT",
    .summary = "Describe a model by medial spheres, cones and slabs",
    .doc =
        "Runs the built-in graph, graphs/qmat_plus.yaml, on one model. --vertices without --epsilon sets epsilon to 0: "
        "no bound on the distance.\n"
        "A glTF scene saved as glTF keeps its contents, and each of its meshes gets a medial mesh. So does a USD scene "
        "saved as USD, by a layer over it, and as glTF. For other formats the meshes are merged (model.mesh=merged).\n"
        "--set reaches every other parameter; 'qmat nodes' lists the nodes, 'qmat node NAME' their parameters.",
    .common = qmat_common_options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = 1,
    .add_options = add_options,
    .run = run,
};
