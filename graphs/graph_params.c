/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/graph_params.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "graphs/graph_names.h"

/* The ending of a file's name, without the dot; "": it has none. */
static const char *path_ending(const char *path) {
  const char *name = strrchr(path, '/');
  name = name ? name + 1 : path;
  const char *dot = strrchr(name, '.');
  return dot && dot != name ? dot + 1 : "";
}

bool qmat_graph_output_of_ending(const qmat_graph *graph, const char *path, size_t *output) {
  const char *ending = path_ending(path);
  size_t found = 0;
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_param *format = qmat_output_format_param(graph->nodes[graph->outputs[i].node].type);
    if (qmat_graph_output_type(graph, i) != QMAT_FILE || !format) continue;
    bool fits = false;
    for (int k = 0; format->choices[k] && !fits; k++) fits = strcasecmp(format->choices[k], ending) == 0;
    if (fits) *output = i;
    found += fits;
  }
  return found == 1;
}

qmat_status qmat_graph_output_format(qmat_context *context, const qmat_graph *graph, size_t index, const char *path,
                                     int *choice) {
  static const char *const report_endings[] = {"json", NULL};
  const qmat_graph_output *output = &graph->outputs[index];
  const qmat_node *type = graph->nodes[output->node].type;
  const qmat_value_type made = type->outputs[output->port].type;
  *choice = -1;
  const char *const *endings = NULL;
  const qmat_param *format = NULL;
  if (made == QMAT_REPORT) {
    endings = report_endings;
  } else if (made == QMAT_FILE) {
    format = qmat_output_format_param(type);
    if (!format) return QMAT_OK;
    endings = format->choices;
  } else {
    qmat_fail(context, QMAT_ERROR_USAGE, "output '%s' is %s, but only files and reports can be saved", output->name,
              qmat_value_type_phrase(made));
    return qmat_fail_hint(context, "scene.write makes files");
  }
  const char *ending = path_ending(path);
  char known[200];
  size_t used = 0;
  for (int i = 0; endings[i]; i++) {
    if (strcasecmp(endings[i], ending) == 0) {
      if (format) *choice = i;
      return QMAT_OK;
    }
    if (used < sizeof known)
      used += (size_t)snprintf(known + used, sizeof known - used, "%s.%s", i ? ", " : "", endings[i]);
  }
  if (*ending)
    qmat_fail(context, QMAT_ERROR_USAGE, "output '%s' cannot be written as '.%s'", output->name,
              qmat_show(ending).text);
  else
    qmat_fail(context, QMAT_ERROR_USAGE, "'%s' has no ending that says how to write output '%s'", qmat_show(path).text,
              output->name);
  return qmat_fail_hint(context, "known endings: %s", known);
}

char *qmat_resolve_path(const char *folder, const char *path) {
  if (path[0] == '/' || path[0] == 0) folder = "";
  size_t length = strlen(folder), rest = strlen(path);
  char *resolved = qmat_alloc(length + rest + 1, 1);
  if (!resolved) return NULL;
  memcpy(resolved, folder, length);
  memcpy(resolved + length, path, rest + 1);
  return resolved;
}

qmat_status qmat_graph_set(qmat_context *context, qmat_graph *graph, size_t index, size_t row, const char *text,
                           const char *folder) {
  qmat_graph_node *node = &graph->nodes[index];
  const qmat_param *param = &node->type->params[row];
  const char *outer_id = context->node_id, *outer_type = context->node_type;
  context->node_id = node->id;
  context->node_type = node->type->name;
  char *copy = NULL;
  qmat_status status = QMAT_OK;
  if (strlen(text) > QMAT_GRAPH_MAX_TEXT) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s has more than %d bytes", param->name, QMAT_GRAPH_MAX_TEXT);
    status = qmat_fail_field(context, param->name);
  } else {
    copy = param->type == QMAT_PARAM_PATH ? qmat_resolve_path(folder, text) : qmat_strdup(text);
    if (!copy) status = qmat_fail_memory(context, "graph");
  }
  if (status == QMAT_OK) status = qmat_param_parse(context, param, copy, node->params);
  if (status == QMAT_OK) {
    qmat_free(node->texts[row]);
    node->texts[row] = copy;
    node->marks[row] = (qmat_mark){0, 0};
  } else {
    qmat_free(copy);
  }
  context->node_id = outer_id;
  context->node_type = outer_type;
  return status;
}

/* Checks that a parameter may be set to `text`, without setting it. */
static qmat_status try_param(qmat_context *context, const qmat_graph *graph, qmat_graph_param at, const char *text) {
  const qmat_graph_node *node = &graph->nodes[at.node];
  const char *outer_id = context->node_id, *outer_type = context->node_type;
  void *params = qmat_calloc(1, node->type->params_size);
  if (!params) return qmat_fail_memory(context, "graph");
  context->node_id = node->id;
  context->node_type = node->type->name;
  const qmat_status status = qmat_param_parse(context, &node->type->params[at.param], text, params);
  context->node_id = outer_id;
  context->node_type = outer_type;
  qmat_free(params);
  return status;
}

static bool takes(const qmat_graph *graph, qmat_graph_param at, const char *text) {
  qmat_context nobody = {0}; /* a text that does not fit is no error here */
  const bool fits = try_param(&nobody, graph, at, text) == QMAT_OK;
  qmat_context_uninit(&nobody);
  return fits;
}

static const qmat_param *param_at(const qmat_graph *graph, qmat_graph_param at) {
  return &graph->nodes[at.node].type->params[at.param];
}

/* Whether one text fits both parameters, as far as their types and ranges tell. */
static bool fit_together(const qmat_graph *graph, qmat_graph_param first, qmat_graph_param second) {
  static const char *const truths[] = {"true", "false", "yes", "no", "on", "off", NULL};
  const qmat_param *a = param_at(graph, first), *b = param_at(graph, second);
  const bool a_chooses = a->type == QMAT_PARAM_ENUM || a->type == QMAT_PARAM_BOOL;
  const bool b_chooses = b->type == QMAT_PARAM_ENUM || b->type == QMAT_PARAM_BOOL;
  if (!a_chooses && b_chooses) return fit_together(graph, second, first);
  if (a_chooses) {
    const char *const *choices = a->type == QMAT_PARAM_ENUM ? a->choices : truths;
    for (int i = 0; choices[i]; i++)
      if (takes(graph, second, choices[i])) return true;
    return false;
  }
  const bool a_counts = a->type == QMAT_PARAM_INT || a->type == QMAT_PARAM_FLOAT;
  const bool b_counts = b->type == QMAT_PARAM_INT || b->type == QMAT_PARAM_FLOAT;
  return !a_counts || !b_counts || (a->min <= b->max && b->min <= a->max);
}

qmat_status qmat_graph_check_input(qmat_context *context, const qmat_graph *graph, const qmat_graph_input *input) {
  for (size_t i = 1; i < input->param_count; i++)
    for (size_t k = 0; k < i; k++) {
      const qmat_graph_param first = input->params[k], second = input->params[i];
      if (fit_together(graph, first, second)) continue;
      return qmat_fail(context, QMAT_ERROR_USAGE, "no value of input '%s' fits both '%s.%s' and '%s.%s'", input->name,
                       graph->nodes[first.node].id, param_at(graph, first)->name, graph->nodes[second.node].id,
                       param_at(graph, second)->name);
    }
  return QMAT_OK;
}

qmat_status qmat_graph_set_named(qmat_context *context, qmat_graph *graph, const char *name, const char *text) {
  qmat_graph_param single;
  const qmat_graph_param *params = NULL;
  size_t count = 0;
  qmat_status status = qmat_graph_find_params(context, graph, name, &single, &params, &count);
  for (size_t i = 1; i < count && status == QMAT_OK; i++) status = try_param(context, graph, params[i], text);
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    status = qmat_graph_set(context, graph, params[i].node, params[i].param, text, "");
  return status;
}

qmat_status qmat_graph_assign(qmat_context *context, qmat_graph *graph, const char *assignment) {
  const char *equals = strchr(assignment, '=');
  if (!equals) {
    return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' is not of the form node.parameter=value",
                     qmat_show(assignment).text);
  }
  size_t length = (size_t)(equals - assignment);
  char name[2 * QMAT_GRAPH_NAME_SIZE];
  if (length >= sizeof name) length = sizeof name - 1;
  memcpy(name, assignment, length);
  name[length] = 0;
  return qmat_graph_set_named(context, graph, name, equals + 1);
}

/* Gives the newest error the place where the file sets the parameter that it names. */
static qmat_status place_at_param(qmat_context *context, const qmat_graph *graph, const qmat_graph_node *node) {
  const qmat_param *param = qmat_param_find(node->type, context->error.field);
  qmat_mark mark = node->mark;
  if (param) {
    size_t row = (size_t)(param - node->type->params);
    if (node->marks[row].line > 0) mark = node->marks[row];
    /* Set on the command line: the file is not at fault. */
    else if (node->texts[row])
      return context->error.status;
  }
  return qmat_fail_at(context, graph->file, mark.line, mark.column);
}

qmat_status qmat_graph_check_node(qmat_context *context, const qmat_graph *graph, size_t index, const void *params) {
  const qmat_graph_node *node = &graph->nodes[index];
  const char *outer_id = context->node_id, *outer_type = context->node_type;
  context->node_id = node->id;
  context->node_type = node->type->name;
  qmat_status status = qmat_params_check(context, node->type, params);
  if (status == QMAT_ERROR_USAGE && !context->error.file[0]) {
    const qmat_param *missing = qmat_graph_missing_param(node);
    if (missing && strcmp(missing->name, context->error.field) == 0 && !context->error.hint[0]) {
      char option[2 * QMAT_GRAPH_NAME_SIZE + 16];
      qmat_graph_set_option(graph, index, missing, option, sizeof option);
      qmat_fail_hint(context, "%s", option);
    }
    status = place_at_param(context, graph, node);
  }
  context->node_id = outer_id;
  context->node_type = outer_type;
  return status;
}

qmat_status qmat_graph_check_params(qmat_context *context, const qmat_graph *graph) {
  for (size_t i = 0; i < graph->node_count; i++) {
    const qmat_param *missing = qmat_graph_missing_param(&graph->nodes[i]);
    if (missing && qmat_graph_input_name(graph, i, missing)) continue;
    qmat_status status = qmat_graph_check_node(context, graph, i, graph->nodes[i].params);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}
