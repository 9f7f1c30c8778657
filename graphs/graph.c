/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/graph.h"

#include <stdio.h>
#include <string.h>

const qmat_node *qmat_registry_find(const qmat_registry *registry, const char *name) {
  for (size_t i = 0; i < registry->count; i++)
    if (strcmp(registry->nodes[i]->name, name) == 0) return registry->nodes[i];
  return NULL;
}

const qmat_param *qmat_output_format_param(const qmat_node *type) {
  for (size_t i = 0; i < qmat_param_count(type); i++)
    if (type->params[i].type == QMAT_PARAM_ENUM && (type->params[i].flags & QMAT_PARAM_OUTPUT_FORMAT))
      return &type->params[i];
  return NULL;
}

qmat_value_type qmat_graph_output_type(const qmat_graph *graph, size_t output) {
  const qmat_graph_output *made = &graph->outputs[output];
  return graph->nodes[made->node].type->outputs[made->port].type;
}

bool qmat_graph_on_request(const qmat_graph *graph, size_t output) {
  const qmat_graph_output *made = &graph->outputs[output];
  return graph->nodes[made->node].type->outputs[made->port].on_request;
}

size_t qmat_graph_file_count(const qmat_graph *graph, size_t *last) {
  size_t count = 0;
  for (size_t i = 0; i < graph->output_count; i++) {
    if (qmat_graph_output_type(graph, i) != QMAT_FILE || qmat_graph_on_request(graph, i)) continue;
    *last = i;
    count++;
  }
  return count;
}

const qmat_param *qmat_graph_missing_param(const qmat_graph_node *node) {
  for (size_t row = 0; row < qmat_param_count(node->type); row++)
    if ((node->type->params[row].flags & QMAT_PARAM_REQUIRED) && !node->texts[row]) return &node->type->params[row];
  return NULL;
}

const qmat_graph_input *qmat_graph_input_called(const qmat_graph *graph, const char *name) {
  for (size_t i = 0; i < graph->input_count; i++)
    if (strcmp(graph->inputs[i].name, name) == 0) return &graph->inputs[i];
  return NULL;
}

const char *qmat_graph_input_name(const qmat_graph *graph, size_t node, const qmat_param *param) {
  for (size_t i = 0; i < graph->input_count; i++)
    for (size_t k = 0; k < graph->inputs[i].param_count; k++) {
      const qmat_graph_param *at = &graph->inputs[i].params[k];
      if (at->node == node && &graph->nodes[node].type->params[at->param] == param) return graph->inputs[i].name;
    }
  return NULL;
}

void qmat_graph_set_option(const qmat_graph *graph, size_t node, const qmat_param *param, char *text, size_t size) {
  const char *input = qmat_graph_input_name(graph, node, param);
  snprintf(text, size, "--set %s%s%s=%s", input ? input : graph->nodes[node].id, input ? "" : ".",
           input ? "" : param->name, param->type == QMAT_PARAM_PATH ? "FILE" : "VALUE");
}

void qmat_graph_uninit(qmat_graph *graph) {
  for (size_t i = 0; i < graph->node_count; i++) {
    qmat_graph_node *node = &graph->nodes[i];
    for (size_t row = 0; node->texts && row < qmat_param_count(node->type); row++) qmat_free(node->texts[row]);
    qmat_free(node->texts);
    qmat_free(node->marks);
    qmat_free(node->links);
    qmat_free(node->params);
  }
  for (size_t i = 0; i < graph->output_count; i++) qmat_free(graph->outputs[i].path);
  for (size_t i = 0; i < graph->input_count; i++) qmat_free(graph->inputs[i].params);
  qmat_free(graph->nodes);
  qmat_free(graph->inputs);
  qmat_free(graph->outputs);
  qmat_free(graph->order);
  qmat_free(graph->file);
  qmat_free(graph->folder);
  *graph = (qmat_graph){0};
}
