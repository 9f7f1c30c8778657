/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/graph_names.h"

#include <stdio.h>
#include <string.h>

void qmat_name_list_add(qmat_name_list *list, const char *name) {
  if (qmat_grow((void **)&list->names, &list->capacity, list->count + 1, sizeof *list->names) == 0)
    list->names[list->count++] = name;
}

qmat_status qmat_suggest_name(qmat_context *context, const char *text, const char *kind, qmat_name_list *list) {
  const char *nearest = qmat_nearest_name(text, list->names, list->count);
  if (nearest) {
    qmat_fail_hint(context, "did you mean '%s'?", nearest);
  } else if (list->count == 0) {
    qmat_fail_hint(context, "there are no %s", kind);
  } else if (list->count <= 16) {
    char all[240];
    size_t used = 0;
    for (size_t i = 0; i < list->count && used < sizeof all; i++)
      used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", i ? ", " : "", list->names[i]);
    qmat_fail_hint(context, "%s: %s", kind, all);
  }
  qmat_free(list->names);
  *list = (qmat_name_list){0};
  return context->error.status;
}

static qmat_status suggest_port(qmat_context *context, const char *text, const char *kind, const qmat_port *ports,
                                size_t count) {
  qmat_name_list names = {0};
  for (size_t i = 0; i < count; i++) qmat_name_list_add(&names, ports[i].name);
  return qmat_suggest_name(context, text, kind, &names);
}

/* Suggests one of `count` names, `stride` bytes apart: the ids or names of nodes, inputs or outputs. */
static qmat_status suggest_member(qmat_context *context, const char *text, const char *kind, const char *first,
                                  size_t stride, size_t count) {
  qmat_name_list names = {0};
  for (size_t i = 0; i < count; i++) qmat_name_list_add(&names, first + i * stride);
  return qmat_suggest_name(context, text, kind, &names);
}

qmat_status qmat_suggest_nearest(qmat_context *context, const char *text, const char *const *names, size_t count,
                                 const char *otherwise) {
  const char *nearest = qmat_nearest_name(text, names, count);
  return nearest ? qmat_fail_hint(context, "did you mean '%s'?", nearest) : qmat_fail_hint(context, "%s", otherwise);
}

bool qmat_is_graph_name(const char *text) {
  size_t length = 0;
  for (; text[length]; length++) {
    char c = text[length];
    bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    if (!letter && (length == 0 || !((c >= '0' && c <= '9') || c == '-'))) return false;
  }
  return length > 0 && length < QMAT_GRAPH_NAME_SIZE;
}

static size_t find_node(const qmat_graph *graph, const char *id) {
  for (size_t i = 0; i < graph->node_count; i++)
    if (strcmp(graph->nodes[i].id, id) == 0) return i;
  return SIZE_MAX;
}

qmat_status qmat_registry_get(qmat_context *context, const qmat_registry *registry, const char *name,
                              const qmat_node **type) {
  *type = qmat_registry_find(registry, name);
  if (*type) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "there is no node type '%s'", qmat_show(name).text);
  qmat_name_list names = {0};
  for (size_t i = 0; i < registry->count; i++) qmat_name_list_add(&names, registry->nodes[i]->name);
  qmat_suggest_name(context, name, "node types", &names);
  return *context->error.hint ? QMAT_ERROR_USAGE : qmat_fail_hint(context, "'qmat nodes' lists them");
}

qmat_status qmat_graph_find_node(qmat_context *context, const qmat_graph *graph, const char *id, size_t *node) {
  *node = find_node(graph, id);
  if (*node != SIZE_MAX) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "there is no node '%s'", qmat_show(id).text);
  return suggest_member(context, id, "nodes", (const char *)graph->nodes, sizeof *graph->nodes, graph->node_count);
}

/* Splits "node.rest" and finds the node; `kind` says what `rest` names ("port", "parameter"). */
static qmat_status split_reference(qmat_context *context, const qmat_graph *graph, const char *text, const char *kind,
                                   size_t *node, const char **rest) {
  const char *dot = strchr(text, '.');
  if (!dot) {
    qmat_fail(context, QMAT_ERROR_USAGE, "'%s' is not of the form node.%s", qmat_show(text).text, kind);
    size_t same = find_node(graph, text);
    if (same != SIZE_MAX) {
      const qmat_node *type = graph->nodes[same].type;
      bool is_port = strcmp(kind, "port") == 0;
      if (is_port && qmat_output_count(type) > 0)
        qmat_fail_hint(context, "did you mean '%s.%s'?", text, type->outputs[0].name);
      if (!is_port && qmat_param_count(type) > 0)
        qmat_fail_hint(context, "did you mean '%s.%s'?", text, type->params[0].name);
    }
    return context->error.status;
  }
  char id[QMAT_GRAPH_NAME_SIZE];
  size_t length = (size_t)(dot - text);
  if (length >= sizeof id) {
    return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' names no node: an id has at most %d letters",
                     qmat_show(text).text, QMAT_GRAPH_NAME_SIZE - 1);
  }
  memcpy(id, text, length);
  id[length] = 0;
  *rest = dot + 1;
  return qmat_graph_find_node(context, graph, id, node);
}

qmat_status qmat_graph_find_port(qmat_context *context, const qmat_graph *graph, const char *name, size_t *node,
                                 size_t *port) {
  const char *rest = "";
  qmat_status status = split_reference(context, graph, name, "port", node, &rest);
  if (status != QMAT_OK) return status;
  const qmat_graph_node *from = &graph->nodes[*node];
  *port = qmat_output_find(from->type, rest);
  if (*port != SIZE_MAX) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "node '%s' (%s) has no output '%s'", from->id, from->type->name,
            qmat_show(rest).text);
  return suggest_port(context, rest, "outputs", from->type->outputs, qmat_output_count(from->type));
}

qmat_status qmat_graph_node_input(qmat_context *context, const qmat_graph_node *node, const char *name, size_t *port) {
  *port = qmat_input_find(node->type, name);
  if (*port != SIZE_MAX) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "node '%s' (%s) has no input '%s'", node->id, node->type->name,
            qmat_show(name).text);
  return suggest_port(context, name, "inputs", node->type->inputs, qmat_input_count(node->type));
}

qmat_status qmat_graph_node_param(qmat_context *context, const qmat_graph_node *node, const char *name, size_t *param) {
  const qmat_param *found = qmat_param_find(node->type, name);
  if (found) {
    *param = (size_t)(found - node->type->params);
    return QMAT_OK;
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "node '%s' (%s) has no parameter '%s'", node->id, node->type->name,
            qmat_show(name).text);
  qmat_name_list names = {0};
  for (size_t i = 0; i < qmat_param_count(node->type); i++) qmat_name_list_add(&names, node->type->params[i].name);
  return qmat_suggest_name(context, name, "parameters", &names);
}

qmat_status qmat_graph_find_param(qmat_context *context, const qmat_graph *graph, const char *name,
                                  qmat_graph_param *param) {
  const char *rest = "";
  qmat_status status = split_reference(context, graph, name, "parameter", &param->node, &rest);
  return status == QMAT_OK ? qmat_graph_node_param(context, &graph->nodes[param->node], rest, &param->param) : status;
}

qmat_status qmat_graph_find_params(qmat_context *context, const qmat_graph *graph, const char *name,
                                   qmat_graph_param *single, const qmat_graph_param **params, size_t *count) {
  const bool dotted = strchr(name, '.') != NULL;
  const qmat_graph_input *input = dotted ? NULL : qmat_graph_input_called(graph, name);
  if (input) {
    *params = input->params;
    *count = input->param_count;
    return QMAT_OK;
  }
  if (dotted || find_node(graph, name) != SIZE_MAX) {
    *params = single;
    *count = 1;
    return qmat_graph_find_param(context, graph, name, single);
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "the graph has no input '%s'", qmat_show(name).text);
  return suggest_member(context, name, "inputs", (const char *)graph->inputs, sizeof *graph->inputs,
                        graph->input_count);
}

qmat_status qmat_graph_find_output(qmat_context *context, const qmat_graph *graph, const char *name, size_t *output) {
  for (size_t i = 0; i < graph->output_count; i++)
    if (strcmp(graph->outputs[i].name, name) == 0) {
      *output = i;
      return QMAT_OK;
    }
  qmat_fail(context, QMAT_ERROR_USAGE, "the graph has no output '%s'", qmat_show(name).text);
  return suggest_member(context, name, "outputs", (const char *)graph->outputs, sizeof *graph->outputs,
                        graph->output_count);
}
