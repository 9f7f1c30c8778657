/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/graph_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

enum { LANGUAGE_VERSION = 1, MAX_TEXT = 4096 };

const qmat_node *qmat_registry_find(const qmat_registry *registry, const char *name) {
  for (size_t i = 0; i < registry->count; i++)
    if (strcmp(registry->nodes[i]->name, name) == 0) return registry->nodes[i];
  return NULL;
}

/* ---- names and suggestions ---- */

/* Names that a mistaken one is compared with. A zeroed list is empty. */
typedef struct name_list {
  const char **names;
  size_t count, capacity;
} name_list;

/* A name that does not fit is left out: it is only a suggestion. */
static void add_name(name_list *list, const char *name) {
  if (qmat_grow((void **)&list->names, &list->capacity, list->count + 1, sizeof *list->names) == 0)
    list->names[list->count++] = name;
}

/* Adds to the newest error the name that is nearest to `text`, or all names when they are few. Frees the list. */
static qmat_status suggest(qmat_context *context, const char *text, const char *kind, name_list *list) {
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
  *list = (name_list){0};
  return context->error.status;
}

static void add_params(name_list *list, const qmat_node *type) {
  for (size_t i = 0; i < qmat_param_count(type); i++) add_name(list, type->params[i].name);
}

static void add_ports(name_list *list, const qmat_port *ports, size_t count) {
  for (size_t i = 0; i < count; i++) add_name(list, ports[i].name);
}

static void add_nodes(name_list *list, const qmat_graph *graph) {
  for (size_t i = 0; i < graph->node_count; i++) add_name(list, graph->nodes[i].id);
}

static bool is_name(const char *text) {
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

/* ---- looking up ---- */

qmat_status qmat_graph_find_node(qmat_context *context, const qmat_graph *graph, const char *id, size_t *node) {
  *node = find_node(graph, id);
  if (*node != SIZE_MAX) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "there is no node '%s'", qmat_show(id).text);
  name_list names = {0};
  add_nodes(&names, graph);
  return suggest(context, id, "nodes", &names);
}

/* Splits "node.rest" and finds the node; `kind` is what the rest should be ("port", "parameter"). */
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
  if (length >= sizeof id) length = sizeof id - 1;
  memcpy(id, text, length);
  id[length] = 0;
  *rest = dot + 1;
  return qmat_graph_find_node(context, graph, id, node);
}

qmat_status qmat_graph_find_port(qmat_context *context, const qmat_graph *graph, const char *name, size_t *node,
                                 size_t *port) {
  const char *rest;
  qmat_status status = split_reference(context, graph, name, "port", node, &rest);
  if (status != QMAT_OK) return status;
  const qmat_graph_node *from = &graph->nodes[*node];
  *port = qmat_output_find(from->type, rest);
  if (*port != SIZE_MAX) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "node '%s' (%s) has no output '%s'", from->id, from->type->name,
            qmat_show(rest).text);
  name_list names = {0};
  add_ports(&names, from->type->outputs, qmat_output_count(from->type));
  return suggest(context, rest, "outputs", &names);
}

static qmat_status find_node_param(qmat_context *context, const qmat_graph *graph, const char *name, size_t *node,
                                   size_t *param) {
  const char *rest;
  qmat_status status = split_reference(context, graph, name, "parameter", node, &rest);
  if (status != QMAT_OK) return status;
  const qmat_graph_node *owner = &graph->nodes[*node];
  const qmat_param *found = qmat_param_find(owner->type, rest);
  if (found) {
    *param = (size_t)(found - owner->type->params);
    return QMAT_OK;
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "node '%s' (%s) has no parameter '%s'", owner->id, owner->type->name,
            qmat_show(rest).text);
  name_list names = {0};
  add_params(&names, owner->type);
  return suggest(context, rest, "parameters", &names);
}

/* The parameters that "node.param" or the name of an input stands for: `*params` is the input's own array, or `single`.
 */
static qmat_status find_params(qmat_context *context, const qmat_graph *graph, const char *name,
                               qmat_graph_param *single, const qmat_graph_param **params, size_t *count) {
  const bool dotted = strchr(name, '.') != NULL;
  for (size_t i = 0; i < graph->input_count && !dotted; i++)
    if (strcmp(graph->inputs[i].name, name) == 0) {
      *params = graph->inputs[i].params;
      *count = graph->inputs[i].param_count;
      return QMAT_OK;
    }
  if (dotted || find_node(graph, name) != SIZE_MAX) {
    *params = single;
    *count = 1;
    return find_node_param(context, graph, name, &single->node, &single->param);
  }
  qmat_fail(context, QMAT_ERROR_USAGE, "the graph has no input '%s'", qmat_show(name).text);
  name_list names = {0};
  for (size_t i = 0; i < graph->input_count; i++) add_name(&names, graph->inputs[i].name);
  return suggest(context, name, "inputs", &names);
}

qmat_status qmat_graph_find_output(qmat_context *context, const qmat_graph *graph, const char *name, size_t *output) {
  for (size_t i = 0; i < graph->output_count; i++)
    if (strcmp(graph->outputs[i].name, name) == 0) {
      *output = i;
      return QMAT_OK;
    }
  qmat_fail(context, QMAT_ERROR_USAGE, "the graph has no output '%s'", qmat_show(name).text);
  name_list names = {0};
  for (size_t i = 0; i < graph->output_count; i++) add_name(&names, graph->outputs[i].name);
  return suggest(context, name, "outputs", &names);
}

/* ---- output formats ---- */

const qmat_param *qmat_output_format_param(const qmat_node *type) {
  for (size_t i = 0; i < qmat_param_count(type); i++)
    if (type->params[i].type == QMAT_PARAM_ENUM && (type->params[i].flags & QMAT_PARAM_OUTPUT_FORMAT))
      return &type->params[i];
  return NULL;
}

/* What follows the last point of the file's name; "" when there is none. */
static const char *path_ending(const char *path) {
  const char *name = strrchr(path, '/');
  name = name ? name + 1 : path;
  const char *dot = strrchr(name, '.');
  return dot && dot != name ? dot + 1 : "";
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
    qmat_fail(context, QMAT_ERROR_USAGE, "output '%s' is a %s; only files and reports can be saved", output->name,
              qmat_value_type_name(made));
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
    qmat_fail(context, QMAT_ERROR_USAGE, "the ending of '%s' does not say how to write output '%s'",
              qmat_show(path).text, output->name);
  return qmat_fail_hint(context, "known endings: %s", known);
}

/* ---- parameters ---- */

/* A copy of `path`, put into `folder` when it is relative. The caller frees it. */
static char *resolve_path(const char *folder, const char *path) {
  if (path[0] == '/' || path[0] == 0) folder = "";
  size_t length = strlen(folder), rest = strlen(path);
  char *resolved = qmat_alloc(length + rest + 1, 1);
  if (!resolved) return NULL;
  memcpy(resolved, folder, length);
  memcpy(resolved + length, path, rest + 1);
  return resolved;
}

static qmat_status set_param(qmat_context *context, qmat_graph *graph, size_t index, size_t row, const char *text,
                             const char *folder) {
  qmat_graph_node *node = &graph->nodes[index];
  const qmat_param *param = &node->type->params[row];
  const char *outer_id = context->node_id, *outer_type = context->node_type;
  context->node_id = node->id;
  context->node_type = node->type->name;
  char *copy = NULL;
  qmat_status status = QMAT_OK;
  if (strlen(text) > MAX_TEXT) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s has more than %d bytes", param->name, MAX_TEXT);
    status = qmat_fail_field(context, param->name);
  } else {
    copy = param->type == QMAT_PARAM_PATH ? resolve_path(folder, text) : qmat_strdup(text);
    if (!copy) status = qmat_fail_memory(context, "graph");
  }
  if (status == QMAT_OK) status = qmat_param_parse(context, node->type, param, copy, node->params);
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

qmat_status qmat_graph_set(qmat_context *context, qmat_graph *graph, size_t node, size_t param, const char *text) {
  return set_param(context, graph, node, param, text, "");
}

/* Whether the parameter may be set to `text`; it is not. */
static qmat_status try_param(qmat_context *context, const qmat_graph *graph, qmat_graph_param at, const char *text) {
  const qmat_graph_node *node = &graph->nodes[at.node];
  const char *outer_id = context->node_id, *outer_type = context->node_type;
  void *params = qmat_calloc(1, node->type->params_size);
  if (!params) return qmat_fail_memory(context, "graph");
  context->node_id = node->id;
  context->node_type = node->type->name;
  const qmat_status status = qmat_param_parse(context, node->type, &node->type->params[at.param], text, params);
  context->node_id = outer_id;
  context->node_type = outer_type;
  qmat_free(params);
  return status;
}

qmat_status qmat_graph_set_named(qmat_context *context, qmat_graph *graph, const char *name, const char *text) {
  qmat_graph_param single;
  const qmat_graph_param *params = NULL;
  size_t count = 0;
  qmat_status status = find_params(context, graph, name, &single, &params, &count);
  for (size_t i = 1; i < count && status == QMAT_OK; i++) status = try_param(context, graph, params[i], text);
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    status = qmat_graph_set(context, graph, params[i].node, params[i].param, text);
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

/* Moves the newest error to where the file sets the parameter that it names, if it does. */
static qmat_status place_at_param(qmat_context *context, const qmat_graph *graph, const qmat_graph_node *node) {
  const qmat_param *param = qmat_param_find(node->type, context->error.field);
  qmat_mark mark = node->mark;
  if (param) {
    size_t row = (size_t)(param - node->type->params);
    if (node->marks[row].line > 0) mark = node->marks[row];
    /* Set on the command line: no place in the file is at fault. */
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
    const qmat_param *param = qmat_param_find(node->type, context->error.field);
    bool missing = param && (param->flags & QMAT_PARAM_REQUIRED) && !node->texts[param - node->type->params];
    if (missing && !context->error.hint[0]) qmat_fail_hint(context, "--set %s.%s=...", node->id, param->name);
    status = place_at_param(context, graph, node);
  }
  context->node_id = outer_id;
  context->node_type = outer_type;
  return status;
}

static bool is_graph_input(const qmat_graph *graph, size_t node, size_t param) {
  for (size_t i = 0; i < graph->input_count; i++)
    for (size_t k = 0; k < graph->inputs[i].param_count; k++)
      if (graph->inputs[i].params[k].node == node && graph->inputs[i].params[k].param == param) return true;
  return false;
}

qmat_status qmat_graph_check_params(qmat_context *context, const qmat_graph *graph) {
  for (size_t i = 0; i < graph->node_count; i++) {
    const qmat_graph_node *node = &graph->nodes[i];
    bool waits = false;
    for (size_t row = 0; row < qmat_param_count(node->type); row++)
      if ((node->type->params[row].flags & QMAT_PARAM_REQUIRED) && !node->texts[row] && is_graph_input(graph, i, row))
        waits = true;
    if (waits) continue;
    qmat_status status = qmat_graph_check_node(context, graph, i, node->params);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* ---- from the tree to the graph ---- */

typedef struct graph_reader {
  qmat_context *context;
  qmat_graph *graph;
  const qmat_tree *root;
} graph_reader;

static qmat_status at_mark(graph_reader *reader, qmat_mark mark) {
  return qmat_fail_at(reader->context, reader->graph->file, mark.line, mark.column);
}

static const qmat_tree *find_key(const qmat_tree *mapping, const char *key) {
  for (const qmat_tree_entry *entry = mapping->entries; entry; entry = entry->next)
    if (strcmp(entry->key, key) == 0) return entry->value;
  return NULL;
}

static size_t entry_count(const qmat_tree *mapping) {
  size_t count = 0;
  if (mapping)
    for (const qmat_tree_entry *entry = mapping->entries; entry; entry = entry->next) count++;
  return count;
}

static qmat_status check_keys(graph_reader *reader, const qmat_tree *mapping, const char *what, const char *const *keys,
                              size_t count) {
  for (const qmat_tree_entry *entry = mapping->entries; entry; entry = entry->next) {
    bool known = false;
    for (size_t i = 0; i < count; i++)
      if (strcmp(entry->key, keys[i]) == 0) known = true;
    if (known) continue;
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s has no key '%s'", what, qmat_show(entry->key).text);
    name_list names = {0};
    for (size_t i = 0; i < count; i++) add_name(&names, keys[i]);
    suggest(reader->context, entry->key, "keys", &names);
    return at_mark(reader, entry->mark);
  }
  return QMAT_OK;
}

static qmat_status expect_mapping(graph_reader *reader, const qmat_tree *value, const char *what, const char *form) {
  if (value->is_mapping) return QMAT_OK;
  if (value->empty)
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s: nothing is given", what);
  else
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s: a mapping belongs here, not '%s'", what,
              qmat_show(value->text).text);
  qmat_fail_hint(reader->context, "%s", form);
  return at_mark(reader, value->mark);
}

static qmat_status expect_text(graph_reader *reader, const qmat_tree *value, const char *what) {
  if (!value->is_mapping && !value->empty) return QMAT_OK;
  if (value->is_mapping)
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s: a single value belongs here, not a mapping", what);
  else
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s: the value is missing", what);
  return at_mark(reader, value->mark);
}

static qmat_status expect_name(graph_reader *reader, const qmat_tree_entry *entry, const char *what) {
  if (is_name(entry->key)) return QMAT_OK;
  qmat_fail(reader->context, QMAT_ERROR_USAGE,
            "'%s' cannot name %s: letters, digits, '_' and '-', a letter first, at most %d", qmat_show(entry->key).text,
            what, QMAT_GRAPH_NAME_SIZE - 1);
  return at_mark(reader, entry->mark);
}

static qmat_status read_version(graph_reader *reader) {
  const qmat_tree *version = find_key(reader->root, "qmat");
  if (!version) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the version of the graph language is missing");
    qmat_fail_hint(reader->context, "start the file with 'qmat: %d'", LANGUAGE_VERSION);
    return at_mark(reader, reader->root->mark);
  }
  qmat_status status = expect_text(reader, version, "qmat");
  if (status != QMAT_OK) return status;
  double number;
  if (!qmat_parse_number(version->text, &number) || strchr(version->text, '%'))
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the version of the graph language is a number, not '%s'",
              qmat_show(version->text).text);
  else if (number != LANGUAGE_VERSION)
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "version %s of the graph language is not known; this program reads %d",
              qmat_show(version->text).text, LANGUAGE_VERSION);
  else
    return QMAT_OK;
  return at_mark(reader, version->mark);
}

static qmat_status read_params(graph_reader *reader, size_t index, const qmat_tree *params) {
  qmat_graph_node *node = &reader->graph->nodes[index];
  qmat_status status = expect_mapping(reader, params, "params", "params: { name: value }");
  if (status != QMAT_OK) return status;
  for (const qmat_tree_entry *entry = params->entries; entry; entry = entry->next) {
    const qmat_param *param = qmat_param_find(node->type, entry->key);
    if (!param) {
      qmat_fail(reader->context, QMAT_ERROR_USAGE, "node '%s' (%s) has no parameter '%s'", node->id, node->type->name,
                qmat_show(entry->key).text);
      name_list names = {0};
      add_params(&names, node->type);
      suggest(reader->context, entry->key, "parameters", &names);
      return at_mark(reader, entry->mark);
    }
    status = expect_text(reader, entry->value, param->name);
    if (status != QMAT_OK) return status;
    size_t row = (size_t)(param - node->type->params);
    status = set_param(reader->context, reader->graph, index, row, entry->value->text, reader->graph->folder);
    if (status != QMAT_OK) return at_mark(reader, entry->value->mark);
    node->marks[row] = entry->value->mark;
  }
  return QMAT_OK;
}

static qmat_status read_node(graph_reader *reader, const qmat_tree_entry *entry) {
  static const char *const keys[] = {"type", "in", "params"};
  qmat_graph *graph = reader->graph;
  qmat_status status = expect_name(reader, entry, "a node");
  if (status == QMAT_OK)
    status = expect_mapping(reader, entry->value, entry->key, "{ type: ..., in: ..., params: ... }");
  if (status == QMAT_OK) status = check_keys(reader, entry->value, "a node", keys, 3);
  if (status != QMAT_OK) return status;
  const qmat_tree *type = find_key(entry->value, "type");
  if (!type) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "node '%s' has no type", entry->key);
    return at_mark(reader, entry->mark);
  }
  status = expect_text(reader, type, "type");
  if (status != QMAT_OK) return status;
  const qmat_node *found = qmat_registry_find(&graph->registry, type->text);
  if (!found) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "there is no node type '%s'", qmat_show(type->text).text);
    name_list names = {0};
    for (size_t i = 0; i < graph->registry.count; i++) add_name(&names, graph->registry.nodes[i]->name);
    suggest(reader->context, type->text, "node types", &names);
    return at_mark(reader, type->mark);
  }
  size_t index = graph->node_count++;
  qmat_graph_node *node = &graph->nodes[index];
  snprintf(node->id, sizeof node->id, "%s", entry->key);
  node->type = found;
  node->mark = entry->mark;
  size_t params = qmat_param_count(found), inputs = qmat_input_count(found);
  node->params = qmat_calloc(1, found->params_size);
  node->texts = qmat_calloc(params, sizeof *node->texts);
  node->marks = qmat_calloc(params, sizeof *node->marks);
  node->links = qmat_calloc(inputs, sizeof *node->links);
  if (!node->params || !node->texts || !node->marks || !node->links) return qmat_fail_memory(reader->context, "graph");
  for (size_t i = 0; i < inputs; i++) node->links[i].node = node->links[i].port = SIZE_MAX;
  qmat_params_default(found, node->params);
  const qmat_tree *values = find_key(entry->value, "params");
  return values ? read_params(reader, index, values) : QMAT_OK;
}

/* Adds "model.mesh is a mesh" for the first output of the graph that has the wanted type. */
static void suggest_type(graph_reader *reader, qmat_value_type wanted, size_t but_not) {
  const qmat_graph *graph = reader->graph;
  for (size_t i = 0; i < graph->node_count; i++) {
    const qmat_node *type = graph->nodes[i].type;
    for (size_t port = 0; i != but_not && port < qmat_output_count(type); port++)
      if (type->outputs[port].type == wanted) {
        qmat_fail_hint(reader->context, "'%s.%s' is a %s", graph->nodes[i].id, type->outputs[port].name,
                       qmat_value_type_name(wanted));
        return;
      }
  }
}

static qmat_status read_links(graph_reader *reader, size_t index, const qmat_tree *wiring) {
  qmat_graph *graph = reader->graph;
  qmat_graph_node *node = &graph->nodes[index];
  qmat_status status = expect_mapping(reader, wiring, "in", "in: { port: node.port }");
  if (status != QMAT_OK) return status;
  for (const qmat_tree_entry *entry = wiring->entries; entry; entry = entry->next) {
    size_t port = qmat_input_find(node->type, entry->key);
    if (port == SIZE_MAX) {
      qmat_fail(reader->context, QMAT_ERROR_USAGE, "node '%s' (%s) has no input '%s'", node->id, node->type->name,
                qmat_show(entry->key).text);
      name_list names = {0};
      add_ports(&names, node->type->inputs, qmat_input_count(node->type));
      suggest(reader->context, entry->key, "inputs", &names);
      return at_mark(reader, entry->mark);
    }
    status = expect_text(reader, entry->value, entry->key);
    if (status != QMAT_OK) return status;
    qmat_graph_link *link = &node->links[port];
    qmat_graph_link found = {.mark = entry->value->mark};
    status = qmat_graph_find_port(reader->context, graph, entry->value->text, &found.node, &found.port);
    if (status != QMAT_OK) return at_mark(reader, entry->value->mark);
    qmat_value_type wanted = node->type->inputs[port].type;
    qmat_value_type given = graph->nodes[found.node].type->outputs[found.port].type;
    if (given != wanted) {
      qmat_fail(reader->context, QMAT_ERROR_USAGE, "input '%s' of node '%s' takes a %s, but '%s' is a %s", entry->key,
                node->id, qmat_value_type_name(wanted), qmat_show(entry->value->text).text,
                qmat_value_type_name(given));
      suggest_type(reader, wanted, index);
      return at_mark(reader, entry->value->mark);
    }
    *link = found;
  }
  return QMAT_OK;
}

static qmat_status check_connected(graph_reader *reader, size_t index) {
  const qmat_graph_node *node = &reader->graph->nodes[index];
  for (size_t port = 0; port < qmat_input_count(node->type); port++) {
    if (node->links[port].node != SIZE_MAX || node->type->inputs[port].optional) continue;
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "input '%s' of node '%s' (%s) is not connected",
              node->type->inputs[port].name, node->id, node->type->name);
    suggest_type(reader, node->type->inputs[port].type, index);
    return at_mark(reader, node->mark);
  }
  return QMAT_OK;
}

static qmat_status read_nodes(graph_reader *reader) {
  qmat_graph *graph = reader->graph;
  const qmat_tree *nodes = find_key(reader->root, "nodes");
  if (!nodes) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the graph has no nodes");
    qmat_fail_hint(reader->context, "nodes: { id: { type: ... } }");
    return at_mark(reader, reader->root->mark);
  }
  qmat_status status = expect_mapping(reader, nodes, "nodes", "nodes: { id: { type: ... } }");
  if (status != QMAT_OK) return status;
  if (!nodes->entries) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the graph has no nodes");
    return at_mark(reader, nodes->mark);
  }
  graph->nodes = qmat_calloc(entry_count(nodes), sizeof *graph->nodes);
  if (!graph->nodes) return qmat_fail_memory(reader->context, "graph");
  for (const qmat_tree_entry *entry = nodes->entries; entry; entry = entry->next) {
    status = read_node(reader, entry);
    if (status != QMAT_OK) return status;
  }
  /* Wiring may name nodes that come later in the file. */
  size_t index = 0;
  for (const qmat_tree_entry *entry = nodes->entries; entry; entry = entry->next, index++) {
    const qmat_tree *wiring = find_key(entry->value, "in");
    if (wiring) status = read_links(reader, index, wiring);
    if (status == QMAT_OK) status = check_connected(reader, index);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* One parameter, "node.parameter", or one each of several nodes, { node: parameter }. */
static qmat_status read_input(graph_reader *reader, const qmat_tree_entry *entry, qmat_graph_input *input) {
  const qmat_tree *value = entry->value;
  const qmat_tree_entry *member = value->is_mapping ? value->entries : NULL;
  qmat_status status = expect_name(reader, entry, "an input");
  if (status == QMAT_OK && !member) status = expect_text(reader, value, entry->key);
  if (status != QMAT_OK) return status;
  snprintf(input->name, sizeof input->name, "%s", entry->key);
  input->params = qmat_calloc(member ? entry_count(value) : 1, sizeof *input->params);
  if (!input->params) return qmat_fail_memory(reader->context, "graph");
  do {
    char joined[2 * QMAT_GRAPH_NAME_SIZE];
    if (member) {
      status = expect_text(reader, member->value, member->key);
      if (status != QMAT_OK) return status;
      snprintf(joined, sizeof joined, "%s.%s", member->key, member->value->text);
    }
    qmat_graph_param *param = &input->params[input->param_count];
    status =
        find_node_param(reader->context, reader->graph, member ? joined : value->text, &param->node, &param->param);
    if (status != QMAT_OK) return at_mark(reader, member ? member->mark : value->mark);
    input->param_count++;
    if (member) member = member->next;
  } while (member);
  return QMAT_OK;
}

static qmat_status read_inputs(graph_reader *reader) {
  qmat_graph *graph = reader->graph;
  const qmat_tree *inputs = find_key(reader->root, "inputs");
  if (!inputs) return QMAT_OK;
  qmat_status status = expect_mapping(reader, inputs, "inputs", "inputs: { name: node.parameter }");
  if (status != QMAT_OK) return status;
  graph->inputs = qmat_calloc(entry_count(inputs), sizeof *graph->inputs);
  if (!graph->inputs) return qmat_fail_memory(reader->context, "graph");
  for (const qmat_tree_entry *entry = inputs->entries; entry; entry = entry->next) {
    status = read_input(reader, entry, &graph->inputs[graph->input_count++]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status read_output(graph_reader *reader, const qmat_tree_entry *entry) {
  static const char *const keys[] = {"from", "path"};
  qmat_graph *graph = reader->graph;
  qmat_status status = expect_name(reader, entry, "an output");
  if (status != QMAT_OK) return status;
  const qmat_tree *from = entry->value, *path = NULL;
  if (from->is_mapping) {
    status = check_keys(reader, from, "an output", keys, 2);
    if (status != QMAT_OK) return status;
    path = find_key(from, "path");
    from = find_key(from, "from");
    if (!from) {
      qmat_fail(reader->context, QMAT_ERROR_USAGE, "output '%s' does not say what it is made from", entry->key);
      qmat_fail_hint(reader->context, "{ from: node.port, path: ... }");
      return at_mark(reader, entry->mark);
    }
  }
  status = expect_text(reader, from, entry->key);
  if (status == QMAT_OK && path) status = expect_text(reader, path, "path");
  if (status != QMAT_OK) return status;
  qmat_graph_output *output = &graph->outputs[graph->output_count++];
  snprintf(output->name, sizeof output->name, "%s", entry->key);
  output->mark = from->mark;
  status = qmat_graph_find_port(reader->context, graph, from->text, &output->node, &output->port);
  if (status != QMAT_OK) return at_mark(reader, from->mark);
  if (!path) return QMAT_OK;
  output->path_mark = path->mark;
  if (!*path->text || strlen(path->text) > MAX_TEXT) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the path of output '%s' has %s", entry->key,
              *path->text ? "too many bytes" : "no characters");
    return at_mark(reader, path->mark);
  }
  int choice;
  status = qmat_graph_output_format(reader->context, graph, graph->output_count - 1, path->text, &choice);
  if (status != QMAT_OK) return at_mark(reader, path->mark);
  output->path = resolve_path(graph->folder, path->text);
  return output->path ? QMAT_OK : qmat_fail_memory(reader->context, "graph");
}

static qmat_status read_outputs(graph_reader *reader) {
  qmat_graph *graph = reader->graph;
  const qmat_tree *outputs = find_key(reader->root, "outputs");
  if (!outputs) return QMAT_OK;
  qmat_status status = expect_mapping(reader, outputs, "outputs", "outputs: { name: node.port }");
  if (status != QMAT_OK) return status;
  graph->outputs = qmat_calloc(entry_count(outputs), sizeof *graph->outputs);
  if (!graph->outputs) return qmat_fail_memory(reader->context, "graph");
  for (const qmat_tree_entry *entry = outputs->entries; entry; entry = entry->next) {
    status = read_output(reader, entry);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* ---- order ---- */

/* Names the nodes of a cycle: every node that is not done waits for another one, so walking back must come round. */
static qmat_status fail_cycle(graph_reader *reader, const bool *done, size_t *visits) {
  const qmat_graph *graph = reader->graph;
  size_t at = 0;
  while (done[at]) at++;
  for (size_t i = 0; i < graph->node_count; i++) visits[i] = 0;
  /* The second time round, every node seen is on the cycle. */
  size_t first = SIZE_MAX;
  while (visits[at] < 2) {
    if (++visits[at] == 2 && at < first) first = at;
    const qmat_graph_node *node = &graph->nodes[at];
    size_t port = 0;
    while (node->links[port].node == SIZE_MAX || done[node->links[port].node]) port++;
    at = node->links[port].node;
  }
  /* From the node that comes first in the file backwards, so the text is put together from its end. */
  char path[400];
  size_t start = sizeof path - 1;
  path[start] = 0;
  at = first;
  qmat_mark mark = {0, 0};
  bool cut = false;
  do {
    const qmat_graph_node *node = &graph->nodes[at];
    size_t port = 0;
    while (node->links[port].node == SIZE_MAX || done[node->links[port].node]) port++;
    if (at == first) mark = node->links[port].mark;
    size_t length = strlen(node->id);
    if (start > length + 4 + QMAT_GRAPH_NAME_SIZE + 8) {
      start -= length;
      memcpy(path + start, node->id, length);
      start -= 4;
      memcpy(path + start, " -> ", 4);
    } else {
      cut = true;
    }
    at = node->links[port].node;
  } while (at != first);
  qmat_fail(reader->context, QMAT_ERROR_USAGE, "nodes depend on each other in a cycle: %s%s%s", graph->nodes[first].id,
            cut ? " -> ..." : "", path + start);
  return at_mark(reader, mark);
}

static qmat_status order_nodes(graph_reader *reader) {
  qmat_graph *graph = reader->graph;
  qmat_context *context = reader->context;
  graph->order = qmat_calloc(graph->node_count, sizeof *graph->order);
  bool *done = qmat_calloc(graph->node_count, sizeof *done);
  size_t *visits = qmat_calloc(graph->node_count, sizeof *visits);
  qmat_status status = QMAT_OK;
  if (!graph->order || !done || !visits) {
    status = qmat_fail_memory(context, "graph");
    goto cleanup;
  }
  /* Always the first node in the file that waits for nothing, so that the order follows from the file alone. */
  for (size_t count = 0; count < graph->node_count; count++) {
    size_t next = SIZE_MAX;
    for (size_t i = 0; i < graph->node_count && next == SIZE_MAX; i++) {
      if (done[i]) continue;
      bool ready = true;
      for (size_t port = 0; ready && port < qmat_input_count(graph->nodes[i].type); port++) {
        size_t from = graph->nodes[i].links[port].node;
        if (from != SIZE_MAX && !done[from]) ready = false;
      }
      if (ready) next = i;
    }
    if (next == SIZE_MAX) {
      status = fail_cycle(reader, done, visits);
      goto cleanup;
    }
    done[next] = true;
    graph->order[count] = next;
  }
cleanup:
  qmat_free(done);
  qmat_free(visits);
  return status;
}

/* Every node must lead to an output of the graph or to a node without outputs. */
static qmat_status check_reached(graph_reader *reader) {
  qmat_graph *graph = reader->graph;
  bool *needed = qmat_calloc(graph->node_count, sizeof *needed);
  if (!needed) return qmat_fail_memory(reader->context, "graph");
  for (size_t i = 0; i < graph->output_count; i++) needed[graph->outputs[i].node] = true;
  for (size_t i = 0; i < graph->node_count; i++)
    if (qmat_output_count(graph->nodes[i].type) == 0) needed[i] = true;
  for (size_t k = graph->node_count; k-- > 0;) {
    const qmat_graph_node *node = &graph->nodes[graph->order[k]];
    for (size_t port = 0; needed[graph->order[k]] && port < qmat_input_count(node->type); port++)
      if (node->links[port].node != SIZE_MAX) needed[node->links[port].node] = true;
  }
  size_t idle = 0;
  while (idle < graph->node_count && needed[idle]) idle++;
  qmat_free(needed);
  if (idle == graph->node_count) return QMAT_OK;
  const qmat_graph_node *node = &graph->nodes[idle];
  qmat_fail(reader->context, QMAT_ERROR_USAGE, "no output of the graph depends on node '%s' (%s)", node->id,
            node->type->name);
  qmat_fail_hint(reader->context, "outputs: { %s: %s.%s }, or remove it", node->type->outputs[0].name, node->id,
                 node->type->outputs[0].name);
  return at_mark(reader, node->mark);
}

static qmat_status read_graph(graph_reader *reader) {
  static const char *const keys[] = {"qmat", "inputs", "nodes", "outputs"};
  qmat_status status = expect_mapping(reader, reader->root, "graph", "qmat: 1, nodes: ..., outputs: ...");
  /* A file of another version may have other keys: its version is the better message. */
  if (status == QMAT_OK && find_key(reader->root, "qmat")) status = read_version(reader);
  if (status == QMAT_OK) status = check_keys(reader, reader->root, "a graph", keys, 4);
  if (status == QMAT_OK) status = read_version(reader);
  if (status == QMAT_OK) status = read_nodes(reader);
  if (status == QMAT_OK) status = read_inputs(reader);
  if (status == QMAT_OK) status = read_outputs(reader);
  if (status == QMAT_OK) status = order_nodes(reader);
  if (status == QMAT_OK) status = check_reached(reader);
  return status;
}

static qmat_status read_text(qmat_context *context, const qmat_registry *registry, const char *file, const char *folder,
                             size_t folder_length, const char *text, size_t size, qmat_graph *graph) {
  *graph = (qmat_graph){.registry = *registry};
  qmat_arena arena = {0};
  graph_reader reader = {.context = context, .graph = graph};
  graph->file = qmat_strdup(file);
  graph->folder = qmat_calloc(folder_length + 1, 1);
  qmat_status status = QMAT_OK;
  if (!graph->file || !graph->folder) {
    status = qmat_fail_memory(context, "graph");
  } else {
    memcpy(graph->folder, folder, folder_length);
    status = qmat_tree_read(context, &arena, file, text, size, &reader.root);
  }
  if (status == QMAT_OK) status = read_graph(&reader);
  qmat_arena_uninit(&arena);
  if (status != QMAT_OK) qmat_graph_uninit(graph);
  return status;
}

qmat_status qmat_graph_read_text(qmat_context *context, const qmat_registry *registry, const char *file,
                                 const char *text, size_t size, qmat_graph *graph) {
  return read_text(context, registry, file, "", 0, text, size, graph);
}

/* Reads at most the largest graph file and one byte more. Everything that goes wrong is a bad graph, not a failed run.
 */
static qmat_status read_bytes(qmat_context *context, const char *path, char **text, size_t *size) {
  *text = NULL;
  struct stat info;
  FILE *file = fopen(path, "rbe");
  if (!file || fstat(fileno(file), &info) != 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the graph file cannot be opened: %s", strerror(errno));
    if (file) fclose(file);
    return qmat_fail_at(context, path, 0, 0);
  }
  qmat_status status = QMAT_OK;
  if (S_ISDIR(info.st_mode)) {
    qmat_fail(context, QMAT_ERROR_USAGE, "this is a folder, not a graph file");
    status = qmat_fail_at(context, path, 0, 0);
  }
  if (status == QMAT_OK) {
    *text = qmat_alloc(QMAT_TREE_MAX_BYTES + 1, 1);
    if (!*text) status = qmat_fail_memory(context, "graph file");
  }
  if (status == QMAT_OK) {
    *size = fread(*text, 1, QMAT_TREE_MAX_BYTES + 1, file);
    if (ferror(file)) {
      qmat_fail(context, QMAT_ERROR_USAGE, "the graph file cannot be read: %s", strerror(errno));
      status = qmat_fail_at(context, path, 0, 0);
    }
  }
  fclose(file);
  if (status != QMAT_OK) {
    qmat_free(*text);
    *text = NULL;
  }
  return status;
}

qmat_status qmat_graph_read_file(qmat_context *context, const qmat_registry *registry, const char *path,
                                 qmat_graph *graph) {
  *graph = (qmat_graph){0};
  char *text;
  size_t size = 0;
  qmat_status status = read_bytes(context, path, &text, &size);
  if (status != QMAT_OK) return status;
  const char *slash = strrchr(path, '/');
  status = read_text(context, registry, path, path, slash ? (size_t)(slash - path) + 1 : 0, text, size, graph);
  qmat_free(text);
  return status;
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
