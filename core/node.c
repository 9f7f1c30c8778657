/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/node.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

size_t qmat_param_count(const qmat_node *node) {
  size_t count = 0;
  while (node->params && node->params[count].name) count++;
  return count;
}

static size_t port_count(const qmat_port *ports) {
  size_t count = 0;
  while (ports && ports[count].name) count++;
  return count;
}

size_t qmat_input_count(const qmat_node *node) {
  return port_count(node->inputs);
}

size_t qmat_output_count(const qmat_node *node) {
  return port_count(node->outputs);
}

const qmat_param *qmat_param_find(const qmat_node *node, const char *name) {
  for (size_t i = 0; i < qmat_param_count(node); i++) {
    if (strcmp(node->params[i].name, name) == 0) return &node->params[i];
  }
  return NULL;
}

static size_t port_find(const qmat_port *ports, const char *name) {
  for (size_t i = 0; i < port_count(ports); i++) {
    if (strcmp(ports[i].name, name) == 0) return i;
  }
  return SIZE_MAX;
}

size_t qmat_input_find(const qmat_node *node, const char *name) {
  return port_find(node->inputs, name);
}

size_t qmat_output_find(const qmat_node *node, const char *name) {
  return port_find(node->outputs, name);
}

static void *slot(const qmat_param *param, void *params) {
  return (char *)params + param->offset;
}

static const void *const_slot(const qmat_param *param, const void *params) {
  return (const char *)params + param->offset;
}

void qmat_params_default(const qmat_node *node, void *params) {
  if (node->params_size > 0) memset(params, 0, node->params_size);
  for (size_t i = 0; i < qmat_param_count(node); i++) {
    const qmat_param *param = &node->params[i];
    void *place = slot(param, params);
    switch (param->type) {
      case QMAT_PARAM_BOOL:
        *(bool *)place = param->default_number != 0;
        break;
      case QMAT_PARAM_INT:
        *(int64_t *)place = (int64_t)param->default_number;
        break;
      case QMAT_PARAM_FLOAT:
        *(double *)place = param->default_number;
        break;
      case QMAT_PARAM_ENUM:
        *(int *)place = (int)param->default_number;
        break;
      case QMAT_PARAM_STRING:
      case QMAT_PARAM_PATH:
        *(const char **)place = (param->flags & QMAT_PARAM_REQUIRED) ? NULL : param->default_text;
        break;
    }
  }
}

/* The unit in parentheses after a range, or nothing for plain numbers. */
static void format_unit(const qmat_param *param, char *text, size_t size) {
  text[0] = '\0';
  if (param->unit && param->unit[0] != '\0' && strcmp(param->unit, "1") != 0)
    snprintf(text, size, " (%s)", param->unit);
}

static qmat_status fail_range(qmat_context *context, const qmat_param *param, const char *text) {
  char min[40], max[40], unit[80];
  qmat_format_number(param->min, min, sizeof min);
  qmat_format_number(param->max, max, sizeof max);
  format_unit(param, unit, sizeof unit);
  const double huge = param->type == QMAT_PARAM_INT ? 0x1p53 : 1e300; /* such bounds mean "none" */
  if (param->max >= huge && param->min <= -huge) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s is out of range: %s", param->name, text);
  } else if (param->max >= huge) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s must be at least %s%s, not %s", param->name, min, unit, text);
  } else if (param->min <= -huge) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s must be at most %s%s, not %s", param->name, max, unit, text);
  } else {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s must be between %s and %s%s, not %s", param->name, min, max, unit, text);
  }
  return qmat_fail_field(context, param->name);
}

static bool int_in_range(const qmat_param *param, int64_t value) {
  const double low = ceil(param->min), high = floor(param->max);
  const bool above = low < -0x1p63 || (low < 0x1p63 && value >= (int64_t)low);
  const bool below = high >= 0x1p63 || (high >= -0x1p63 && value <= (int64_t)high);
  return above && below;
}

static bool float_in_range(const qmat_param *param, double value) {
  return isfinite(value) && value >= param->min && value <= param->max;
}

bool qmat_param_in_meters(const qmat_param *param, double value) {
  return (param->flags & QMAT_PARAM_RELATIVE) && value < 0 && isfinite(value);
}

static bool has_meters(const qmat_node *node, const void *params) {
  for (size_t i = 0; i < qmat_param_count(node); i++) {
    const qmat_param *param = &node->params[i];
    if (param->type == QMAT_PARAM_FLOAT && qmat_param_in_meters(param, *(const double *)const_slot(param, params)))
      return true;
  }
  return false;
}

static qmat_status parse_bool(qmat_context *context, const qmat_param *param, const char *text, bool *value) {
  static const char *const words[] = {"false", "true", "no", "yes", "off", "on"};
  for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
    if (strcmp(text, words[i]) == 0) {
      *value = i % 2 == 1;
      return QMAT_OK;
    }
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "%s must be true or false, not '%s'", param->name, text);
  return qmat_fail_field(context, param->name);
}

static qmat_status parse_int(qmat_context *context, const qmat_param *param, const char *text, int64_t *value) {
  const char *digits = text + (*text == '-' || *text == '+');
  if (*digits == '\0' || digits[strspn(digits, "0123456789")] != '\0') {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s must be a whole number, not '%s'", param->name, text);
    return qmat_fail_field(context, param->name);
  }
  errno = 0;
  const long long number = strtoll(text, NULL, 10);
  if (errno == ERANGE || !int_in_range(param, number)) return fail_range(context, param, text);
  *value = number;
  return QMAT_OK;
}

static qmat_status parse_float(qmat_context *context, const qmat_param *param, const char *text, double *value) {
  double number;
  const bool is_length = param->flags & QMAT_PARAM_RELATIVE;
  if (is_length && qmat_parse_length(text, &number)) {
    if (!(number >= 0) || !isfinite(number)) return fail_range(context, param, text);
    *value = 0 - number;
    return QMAT_OK;
  }
  if (!qmat_parse_number(text, &number)) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s must be a number%s, not '%s'", param->name,
              is_length ? ", a percentage, or a length in mm, cm, m, in or ft" : "", text);
    return qmat_fail_field(context, param->name);
  }
  if (!is_length && strchr(text, '%') != NULL) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s must be a plain number, not the percentage %s", param->name, text);
    return qmat_fail_field(context, param->name);
  }
  if (!float_in_range(param, number)) return fail_range(context, param, text);
  *value = number + 0.0; /* -0 becomes 0, the canonical zero */
  return QMAT_OK;
}

static size_t choice_count(const qmat_param *param) {
  size_t count = 0;
  while (param->choices && param->choices[count]) count++;
  return count;
}

static qmat_status parse_enum(qmat_context *context, const qmat_param *param, const char *text, int *value) {
  const size_t count = choice_count(param);
  char list[400];
  size_t used = 0;
  list[0] = '\0';
  for (size_t i = 0; i < count; i++) {
    if (strcmp(text, param->choices[i]) == 0) {
      *value = (int)i;
      return QMAT_OK;
    }
    const char *joint = i == 0 ? "" : i + 1 == count ? " or " : ", ";
    if (used < sizeof list) used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", joint, param->choices[i]);
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "%s must be %s, not '%s'", param->name, list, text);
  const char *nearest = qmat_nearest_name(text, param->choices, count);
  if (nearest) qmat_fail_hint(context, "did you mean '%s'?", nearest);
  return qmat_fail_field(context, param->name);
}

static qmat_status parse_text(qmat_context *context, const qmat_param *param, const char *text, const char **value) {
  if (text[0] == '\0' && (param->type == QMAT_PARAM_PATH || (param->flags & QMAT_PARAM_REQUIRED))) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s must not be empty", param->name);
    return qmat_fail_field(context, param->name);
  }
  *value = text;
  return QMAT_OK;
}

qmat_status qmat_param_parse(qmat_context *context, const qmat_param *param, const char *text, void *params) {
  void *place = slot(param, params);
  switch (param->type) {
    case QMAT_PARAM_BOOL:
      return parse_bool(context, param, text, place);
    case QMAT_PARAM_INT:
      return parse_int(context, param, text, place);
    case QMAT_PARAM_FLOAT:
      return parse_float(context, param, text, place);
    case QMAT_PARAM_ENUM:
      return parse_enum(context, param, text, place);
    case QMAT_PARAM_STRING:
    case QMAT_PARAM_PATH:
      return parse_text(context, param, text, place);
  }
  return qmat_fail(context, QMAT_ERROR_INTERNAL, "parameter %s has an unknown type", param->name);
}

qmat_status qmat_params_check(qmat_context *context, const qmat_node *node, const void *params) {
  for (size_t i = 0; i < qmat_param_count(node); i++) {
    const qmat_param *param = &node->params[i];
    const void *place = const_slot(param, params);
    char text[40];
    bool in_range = true;
    if (param->type == QMAT_PARAM_INT) in_range = int_in_range(param, *(const int64_t *)place);
    if (param->type == QMAT_PARAM_FLOAT)
      in_range = qmat_param_in_meters(param, *(const double *)place) || float_in_range(param, *(const double *)place);
    if (!in_range) {
      qmat_param_format(param, params, text, sizeof text);
      return fail_range(context, param, text);
    }
    if (param->type == QMAT_PARAM_ENUM) {
      const int choice = *(const int *)place;
      if (choice < 0 || (size_t)choice >= choice_count(param)) {
        qmat_fail(context, QMAT_ERROR_USAGE, "%s has no choice number %d", param->name, choice);
        return qmat_fail_field(context, param->name);
      }
    }
    const bool is_text = param->type == QMAT_PARAM_STRING || param->type == QMAT_PARAM_PATH;
    if (is_text && (param->flags & QMAT_PARAM_REQUIRED) && *(const char *const *)place == NULL) {
      qmat_fail(context, QMAT_ERROR_USAGE, "%s must be given", param->name);
      return qmat_fail_field(context, param->name);
    }
  }
  return node->check != NULL && !has_meters(node, params) ? node->check(context, params) : QMAT_OK;
}

/* The diagonal of the first input that is a mesh or a chain, in metres; 0: not known. */
static double find_diagonal(const qmat_node *node, const qmat_value *const inputs[]) {
  for (size_t i = 0; i < qmat_input_count(node); i++) {
    if (inputs[i] && inputs[i]->type == QMAT_CHAIN) return ((const qmat_chain *)inputs[i])->meters_per_diagonal;
    if (!inputs[i] || inputs[i]->type != QMAT_MESH) continue;
    const qmat_mesh *mesh = (const qmat_mesh *)inputs[i];
    return mesh->meters_per_unit > 0 ? qmat_mesh_diagonal(mesh) * mesh->meters_per_unit : 0;
  }
  return 0;
}

/* Writes a length as people type it: "5mm", "0.5m". */
static void format_meters(double meters, char *text, size_t size) {
  const bool is_small = meters < 0.1;
  snprintf(text, size, "%.9g%s", is_small ? 1000 * meters : meters, is_small ? "mm" : "m");
}

static qmat_status fail_unit(qmat_context *context, const qmat_param *param, const char *text) {
  qmat_fail(context, QMAT_ERROR_USAGE, "%s is %s, but the model has no unit of length", param->name, text);
  qmat_fail_hint(context, "type a share of the diagonal, such as 1%%" QMAT_UNIT_ADVICE);
  return qmat_fail_field(context, param->name);
}

/* Makes the lengths in metres of `params`, a copy, shares of the diagonal. */
static qmat_status resolve_lengths(qmat_context *context, const qmat_node *node, const qmat_value *const inputs[],
                                   void *params) {
  const double diagonal = find_diagonal(node, inputs);
  for (size_t i = 0; i < qmat_param_count(node); i++) {
    const qmat_param *param = &node->params[i];
    double *value = slot(param, params);
    if (param->type != QMAT_PARAM_FLOAT || !qmat_param_in_meters(param, *value)) continue;
    char text[48];
    format_meters(-*value, text, sizeof text);
    if (!(diagonal > 0 && isfinite(diagonal))) return fail_unit(context, param, text);
    *value = -*value / diagonal;
    if (float_in_range(param, *value)) continue;
    char length[48], given[160];
    qmat_format_length(diagonal, diagonal, length);
    snprintf(given, sizeof given, "%s of a diagonal of %s", text, length);
    return fail_range(context, param, given);
  }
  return node->check ? node->check(context, params) : QMAT_OK;
}

static bool fits(const qmat_port *port, const qmat_value *value) {
  return value->type == port->type || (port->list && qmat_value_item_type(value) == port->type);
}

static qmat_status check_inputs(qmat_context *context, const qmat_node *node, const qmat_value *const inputs[]) {
  for (size_t i = 0; i < qmat_input_count(node); i++) {
    const qmat_port *port = &node->inputs[i];
    const qmat_value *value = inputs[i];
    if (!value && port->optional) continue;
    if (value && value->sealed && fits(port, value)) continue;
    if (!value) {
      qmat_fail(context, QMAT_ERROR_USAGE, "%s must be given", qmat_value_type_phrase(port->type));
    } else if (value->sealed && !fits(port, value)) {
      qmat_fail(context, QMAT_ERROR_USAGE, "%s is given, not %s", qmat_value_type_phrase(value->type),
                qmat_value_type_phrase(port->type));
    } else {
      qmat_fail(context, QMAT_ERROR_USAGE, "the %s is not sealed", qmat_value_type_name(port->type));
    }
    return qmat_fail_field(context, port->name);
  }
  return QMAT_OK;
}

static qmat_status check_counts(qmat_context *context, const qmat_node *node, const void *params,
                                const qmat_value *const inputs[]) {
  if (!node->check_counts) return QMAT_OK;
  size_t *counts = qmat_alloc(qmat_input_count(node), sizeof *counts);
  if (!counts) return qmat_fail_memory(context, "the counts of values");
  for (size_t i = 0; i < qmat_input_count(node); i++) counts[i] = qmat_value_count(inputs[i]);
  const qmat_status status = node->check_counts(context, params, counts);
  qmat_free(counts);
  return status;
}

static qmat_status check_outputs(qmat_context *context, const qmat_node *node, qmat_value *const outputs[]) {
  for (size_t i = 0; i < qmat_output_count(node); i++) {
    if (outputs[i] && outputs[i]->sealed && fits(&node->outputs[i], outputs[i])) continue;
    qmat_fail(context, QMAT_ERROR_INTERNAL, "the node did not make its output '%s'", node->outputs[i].name);
    return qmat_fail_field(context, node->outputs[i].name);
  }
  return QMAT_OK;
}

/* Runs the node with shares for its lengths. */
static qmat_status run_resolved(qmat_context *context, const qmat_node *node, const void *params,
                                const qmat_value *const inputs[], qmat_value *outputs[]) {
  if (!has_meters(node, params)) return node->run(context, params, inputs, outputs);
  void *own = qmat_alloc(1, node->params_size);
  if (!own) return qmat_fail_memory(context, "parameters");
  memcpy(own, params, node->params_size);
  qmat_status status = resolve_lengths(context, node, inputs, own);
  if (status == QMAT_OK) status = node->run(context, own, inputs, outputs);
  qmat_free(own);
  return status;
}

qmat_status qmat_hand_over(qmat_context *context, qmat_status status, qmat_value *const values[], size_t count,
                           qmat_value *outputs[]) {
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    if (!values[i]->sealed) status = qmat_value_seal(context, values[i]);
  for (size_t i = 0; i < count; i++) {
    if (status == QMAT_OK)
      outputs[i] = values[i];
    else
      qmat_value_release(values[i]);
  }
  return status;
}

qmat_status qmat_node_run(qmat_context *context, const qmat_node *node, const void *params,
                          const qmat_value *const inputs[], qmat_value *outputs[]) {
  const char *outer = context->node_type;
  context->node_type = node->name;
  for (size_t i = 0; i < qmat_output_count(node); i++) outputs[i] = NULL;
  qmat_status status = check_inputs(context, node, inputs);
  if (status == QMAT_OK) status = check_counts(context, node, params, inputs);
  if (status == QMAT_OK) status = qmat_progress(context, 0, 0, "");
  if (status == QMAT_OK) {
    context->error.status = QMAT_OK;
    status = run_resolved(context, node, params, inputs, outputs);
    if (status == QMAT_OK) {
      status = check_outputs(context, node, outputs);
    } else if (context->error.status != status) {
      qmat_fail(context, status, "the node failed without recording an error");
    }
  }
  for (size_t i = 0; status != QMAT_OK && i < qmat_output_count(node); i++) {
    qmat_value_release(outputs[i]);
    outputs[i] = NULL;
  }
  qmat_arena_uninit(&context->arena);
  context->node_type = outer;
  return status;
}

void qmat_param_format(const qmat_param *param, const void *params, char *text, size_t size) {
  if (size == 0) return;
  const void *place = const_slot(param, params);
  text[0] = '\0';
  switch (param->type) {
    case QMAT_PARAM_BOOL:
      snprintf(text, size, "%s", *(const bool *)place ? "true" : "false");
      break;
    case QMAT_PARAM_INT:
      snprintf(text, size, "%lld", (long long)*(const int64_t *)place);
      break;
    case QMAT_PARAM_FLOAT: {
      const double value = *(const double *)place;
      qmat_format_number(qmat_param_in_meters(param, value) ? -value : value, text, size);
      if (qmat_param_in_meters(param, value)) snprintf(text + strlen(text), size - strlen(text), "m");
      break;
    }
    case QMAT_PARAM_ENUM: {
      const int choice = *(const int *)place;
      if (choice >= 0 && (size_t)choice < choice_count(param)) snprintf(text, size, "%s", param->choices[choice]);
      break;
    }
    case QMAT_PARAM_STRING:
    case QMAT_PARAM_PATH: {
      const char *value = *(const char *const *)place;
      snprintf(text, size, "%s", value != NULL ? value : "");
      break;
    }
  }
}
