/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/node_json.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/json_text.h"

static const char *type_name(qmat_param_type type) {
  static const char *const names[] = {
      [QMAT_PARAM_BOOL] = "bool", [QMAT_PARAM_INT] = "int",       [QMAT_PARAM_FLOAT] = "float",
      [QMAT_PARAM_ENUM] = "enum", [QMAT_PARAM_STRING] = "string", [QMAT_PARAM_PATH] = "path"};
  return names[type];
}

/* Whether a bound is not the value that stands for "none". */
static bool is_bound(const qmat_param *param, double number) {
  return fabs(number) < (param->type == QMAT_PARAM_INT ? 0x1p53 : 1e300);
}

json_t *qmat_param_json(const qmat_param *param, const void *params) {
  const char *place = (const char *)params + param->offset;
  char text[512];
  switch (param->type) {
    case QMAT_PARAM_BOOL:
      return json_boolean(*(const bool *)place);
    case QMAT_PARAM_INT:
      return json_integer((json_int_t) * (const int64_t *)place);
    case QMAT_PARAM_FLOAT:
      if (!qmat_param_in_meters(param, *(const double *)place)) return json_real(*(const double *)place);
      qmat_param_format(param, params, text, sizeof text);
      return json_string(text);
    case QMAT_PARAM_ENUM:
      qmat_param_format(param, params, text, sizeof text);
      return json_string(text);
    case QMAT_PARAM_STRING:
    case QMAT_PARAM_PATH: {
      const char *value = *(const char *const *)place;
      if (!value) return json_null();
      json_t *string = json_string(value); /* NULL for a path that is not UTF-8 */
      return string ? string : json_string("(not UTF-8)");
    }
  }
  return NULL;
}

static json_t *param_row(const qmat_param *param, const void *defaults) {
  json_t *row = json_pack("{s:s, s:s, s:s?, s:s?, s:o}", "name", param->name, "type", type_name(param->type), "unit",
                          param->unit, "doc", param->doc, "default", qmat_param_json(param, defaults));
  if (!row) return NULL;
  if (param->type == QMAT_PARAM_INT || param->type == QMAT_PARAM_FLOAT) {
    bool whole = param->type == QMAT_PARAM_INT;
    if (is_bound(param, param->min))
      json_object_set_new(row, "min", whole ? json_integer((json_int_t)param->min) : json_real(param->min));
    if (is_bound(param, param->max))
      json_object_set_new(row, "max", whole ? json_integer((json_int_t)param->max) : json_real(param->max));
  }
  if (param->type == QMAT_PARAM_ENUM) {
    json_t *choices = json_array();
    for (int i = 0; param->choices[i]; i++) json_array_append_new(choices, json_string(param->choices[i]));
    json_object_set_new(row, "choices", choices);
  }
  static const struct {
    unsigned flag;
    const char *name;
  } flags[] = {{QMAT_PARAM_REQUIRED, "required"},
               {QMAT_PARAM_RELATIVE, "relative_to_diagonal"},
               {QMAT_PARAM_OUTPUT_FORMAT, "set_by_output_ending"},
               {QMAT_PARAM_INPUT_FILE, "input_file"}};
  for (size_t i = 0; i < sizeof flags / sizeof *flags; i++)
    if (param->flags & flags[i].flag) json_object_set_new(row, flags[i].name, json_true());
  return row;
}

static json_t *port_rows(const qmat_port *ports, size_t count, bool are_inputs) {
  json_t *rows = json_array();
  for (size_t i = 0; rows && i < count; i++) {
    json_t *row = json_pack("{s:s, s:s, s:s?}", "name", ports[i].name, "type", qmat_value_type_name(ports[i].type),
                            "doc", ports[i].doc);
    if (row && are_inputs) json_object_set_new(row, "optional", json_boolean(ports[i].optional));
    if (row && ports[i].on_request) json_object_set_new(row, "on_request", json_true());
    if (!row || json_array_append_new(rows, row) != 0) {
      json_decref(rows);
      return NULL;
    }
  }
  return rows;
}

json_t *qmat_node_json(const qmat_node *type) {
  void *defaults = qmat_calloc(1, type->params_size);
  json_t *params = json_array();
  if (defaults) qmat_params_default(type, defaults);
  for (size_t i = 0; defaults && params && i < qmat_param_count(type); i++)
    if (json_array_append_new(params, param_row(&type->params[i], defaults)) != 0) {
      json_decref(params);
      params = NULL;
    }
  json_t *node = NULL;
  if (defaults && params)
    node = json_pack("{s:s, s:I, s:s?, s:s?, s:s?, s:O, s:o, s:o}", "name", type->name, "version",
                     (json_int_t)type->version, "summary", type->summary, "doc", type->doc, "citation", type->citation,
                     "params", params, "inputs", port_rows(type->inputs, qmat_input_count(type), true), "outputs",
                     port_rows(type->outputs, qmat_output_count(type), false));
  json_decref(params);
  qmat_free(defaults);
  return node;
}

json_t *qmat_graph_json(const qmat_graph *graph) {
  json_t *inputs = json_array(), *nodes = json_array(), *outputs = json_array();
  for (size_t i = 0; i < graph->input_count; i++) json_array_append_new(inputs, json_string(graph->inputs[i].name));
  for (size_t i = 0; i < graph->node_count; i++) {
    const qmat_node *type = graph->nodes[i].type;
    json_t *ports = json_object();
    for (size_t k = 0; k < qmat_output_count(type); k++)
      json_object_set_new(ports, type->outputs[k].name, json_string(qmat_value_type_name(type->outputs[k].type)));
    json_array_append_new(nodes,
                          json_pack("{s:s, s:s, s:o}", "id", graph->nodes[i].id, "type", type->name, "outputs", ports));
  }
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_graph_output *output = &graph->outputs[i];
    const qmat_graph_node *node = &graph->nodes[output->node];
    json_array_append_new(outputs, json_pack("{s:s, s:s++, s:s, s:b, s:o}", "name", output->name, "port", node->id, ".",
                                             node->type->outputs[output->port].name, "type",
                                             qmat_value_type_name(qmat_graph_output_type(graph, i)), "on_request",
                                             qmat_graph_on_request(graph, i), "path",
                                             output->path ? qmat_json_string(output->path) : json_null()));
  }
  return json_pack("{s:o, s:o, s:o}", "inputs", inputs, "nodes", nodes, "outputs", outputs);
}

json_t *qmat_registry_json(const qmat_registry *registry) {
  json_t *nodes = json_array();
  for (size_t i = 0; nodes && i < registry->count; i++)
    if (json_array_append_new(nodes, qmat_node_json(registry->nodes[i])) != 0) {
      json_decref(nodes);
      return NULL;
    }
  return nodes;
}

/* Text built from pieces; cut at its size. */
typedef struct piece_writer {
  char *text;
  size_t size, used;
} piece_writer;

__attribute__((format(printf, 2, 3))) static void put(piece_writer *writer, const char *format, ...) {
  if (writer->used >= writer->size) return;
  va_list arguments;
  va_start(arguments, format);
  int length = vsnprintf(writer->text + writer->used, writer->size - writer->used, format, arguments);
  va_end(arguments);
  if (length > 0) writer->used += (size_t)length;
}

void qmat_param_describe(const qmat_node *type, const qmat_param *param, const void *params, char *text, size_t size) {
  static const char *const words[] = {"true or false", "whole number", "number", "", "text", "path"};
  piece_writer writer = {.text = text, .size = size};
  if (size) text[0] = 0;
  put(&writer, "%s", words[param->type]);
  if (param->type == QMAT_PARAM_ENUM)
    for (int i = 0; param->choices[i]; i++)
      put(&writer, "%s%s", i == 0 ? "" : param->choices[i + 1] ? ", " : " or ", param->choices[i]);
  char min[40], max[40];
  qmat_format_number(param->min, min, sizeof min);
  qmat_format_number(param->max, max, sizeof max);
  if (param->type == QMAT_PARAM_INT || param->type == QMAT_PARAM_FLOAT) {
    if (is_bound(param, param->min)) put(&writer, is_bound(param, param->max) ? " from %s" : " of at least %s", min);
    if (is_bound(param, param->max)) put(&writer, is_bound(param, param->min) ? " to %s" : " of at most %s", max);
  }
  if (param->unit && *param->unit && strcmp(param->unit, "1") != 0) put(&writer, " (%s)", param->unit);
  if (param->flags & QMAT_PARAM_RELATIVE) put(&writer, ", \"1%%\" is 0.01; or a length, \"5mm\"");
  if (param->flags & QMAT_PARAM_REQUIRED) {
    put(&writer, ", required");
    return;
  }
  void *defaults = params ? NULL : qmat_calloc(1, type->params_size);
  if (!params && !defaults) return;
  if (defaults) qmat_params_default(type, defaults);
  char value[256];
  qmat_param_format(param, params ? params : defaults, value, sizeof value);
  bool is_text = param->type == QMAT_PARAM_STRING || param->type == QMAT_PARAM_PATH;
  if (*value || !is_text) put(&writer, ", default %s", value);
  qmat_free(defaults);
}
