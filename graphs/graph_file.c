/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/graph_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "graphs/graph_names.h"
#include "graphs/graph_order.h"
#include "graphs/graph_params.h"

enum { LANGUAGE_VERSION = 1 };

typedef struct graph_reader {
  qmat_context *context;
  qmat_graph *graph;
  const qmat_tree *root;
  qmat_mistake_fn *mistake; /* NULL: the first mistake ends the reading */
  size_t mistakes;
  qmat_error pending; /* the newest mistake */
} graph_reader;

enum { MOST_MISTAKES = 50 };

/* Goes on after a mistake where all are wanted. Any other failure, and too many mistakes, end the reading. */
static qmat_status note(graph_reader *reader, qmat_status status) {
  if (status != QMAT_ERROR_USAGE || !reader->mistake || reader->mistakes == MOST_MISTAKES) return status;
  if (reader->mistakes++ > 0) reader->mistake(&reader->pending);
  reader->pending = reader->context->error;
  return QMAT_OK;
}

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
    qmat_name_list names = {0};
    for (size_t i = 0; i < count; i++) qmat_name_list_add(&names, keys[i]);
    qmat_suggest_name(reader->context, entry->key, "keys", &names);
    const qmat_status status = note(reader, at_mark(reader, entry->mark));
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status expect_mapping(graph_reader *reader, const qmat_tree *value, const char *what, const char *form) {
  if (value->is_mapping) return QMAT_OK;
  if (value->empty)
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s is empty", what);
  else
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s has to be a mapping, not '%s'", what, qmat_show(value->text).text);
  qmat_fail_hint(reader->context, "%s", form);
  return at_mark(reader, value->mark);
}

static qmat_status expect_text(graph_reader *reader, const qmat_tree *value, const char *what) {
  if (!value->is_mapping && !value->empty) return QMAT_OK;
  if (value->is_mapping)
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s has to be a single value, not a mapping", what);
  else
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s has no value", what);
  return at_mark(reader, value->mark);
}

static qmat_status expect_name(graph_reader *reader, const qmat_tree_entry *entry, const char *what) {
  if (qmat_is_graph_name(entry->key)) return QMAT_OK;
  qmat_fail(reader->context, QMAT_ERROR_USAGE,
            "'%s' cannot name %s: use at most %d letters, digits, '_' and '-', with a letter first",
            qmat_show(entry->key).text, what, QMAT_GRAPH_NAME_SIZE - 1);
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
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the version of the graph language has to be a number, not '%s'",
              qmat_show(version->text).text);
  else if (number != LANGUAGE_VERSION)
    qmat_fail(reader->context, QMAT_ERROR_USAGE,
              "version %s of the graph language is unknown; this program reads version %d",
              qmat_show(version->text).text, LANGUAGE_VERSION);
  else
    return QMAT_OK;
  return at_mark(reader, version->mark);
}

static qmat_status read_param(graph_reader *reader, size_t index, const qmat_tree_entry *entry) {
  qmat_graph_node *node = &reader->graph->nodes[index];
  size_t row;
  qmat_status status = qmat_graph_node_param(reader->context, node, entry->key, &row);
  if (status != QMAT_OK) return at_mark(reader, entry->mark);
  status = expect_text(reader, entry->value, entry->key);
  if (status != QMAT_OK) return status;
  status = qmat_graph_set(reader->context, reader->graph, index, row, entry->value->text, reader->graph->folder);
  if (status != QMAT_OK) return at_mark(reader, entry->value->mark);
  node->marks[row] = entry->value->mark;
  return QMAT_OK;
}

static qmat_status read_params(graph_reader *reader, size_t index, const qmat_tree *params) {
  qmat_status status = expect_mapping(reader, params, "params", "params: { name: value }");
  for (const qmat_tree_entry *entry = params->entries; entry && status == QMAT_OK; entry = entry->next)
    status = note(reader, read_param(reader, index, entry));
  return status;
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
  const qmat_node *found;
  status = qmat_registry_get(reader->context, &graph->registry, type->text, &found);
  if (status != QMAT_OK) return at_mark(reader, type->mark);
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

/* Adds the hint "'model.mesh' is a mesh": the first output in the graph of the wanted type. */
static void suggest_type(graph_reader *reader, qmat_value_type wanted, size_t but_not) {
  const qmat_graph *graph = reader->graph;
  for (size_t i = 0; i < graph->node_count; i++) {
    const qmat_node *type = graph->nodes[i].type;
    for (size_t port = 0; i != but_not && port < qmat_output_count(type); port++)
      if (type->outputs[port].type == wanted) {
        qmat_fail_hint(reader->context, "'%s.%s' is %s", graph->nodes[i].id, type->outputs[port].name,
                       qmat_value_type_phrase(wanted));
        return;
      }
  }
}

/* Whether a name leads to a node that the file has and that could not be read. Its mistake has been told. */
static bool is_broken(const graph_reader *reader, const char *name) {
  const qmat_tree *nodes = find_key(reader->root, "nodes");
  const size_t length = strcspn(name, ".");
  for (size_t i = 0; i < reader->graph->node_count; i++)
    if (strlen(reader->graph->nodes[i].id) == length && memcmp(reader->graph->nodes[i].id, name, length) == 0)
      return false;
  for (const qmat_tree_entry *entry = nodes && nodes->is_mapping ? nodes->entries : NULL; entry; entry = entry->next)
    if (strlen(entry->key) == length && memcmp(entry->key, name, length) == 0) return true;
  return false;
}

static qmat_status read_link(graph_reader *reader, size_t index, const qmat_tree_entry *entry) {
  qmat_graph *graph = reader->graph;
  qmat_graph_node *node = &graph->nodes[index];
  size_t port;
  qmat_status status = qmat_graph_node_input(reader->context, node, entry->key, &port);
  if (status != QMAT_OK) return at_mark(reader, entry->mark);
  qmat_graph_link *link = &node->links[port];
  qmat_graph_link found = {.mark = entry->value->mark};
  link->mark = entry->value->mark; /* so that it is not reported as missing, too */
  status = expect_text(reader, entry->value, entry->key);
  if (status != QMAT_OK || is_broken(reader, entry->value->text)) return status;
  status = qmat_graph_find_port(reader->context, graph, entry->value->text, &found.node, &found.port);
  if (status != QMAT_OK) return at_mark(reader, entry->value->mark);
  qmat_value_type wanted = node->type->inputs[port].type;
  qmat_value_type given = graph->nodes[found.node].type->outputs[found.port].type;
  if (given != wanted) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "input '%s' of node '%s' takes %s, but '%s' is %s", entry->key,
              node->id, qmat_value_type_phrase(wanted), qmat_show(entry->value->text).text,
              qmat_value_type_phrase(given));
    suggest_type(reader, wanted, index);
    return at_mark(reader, entry->value->mark);
  }
  *link = found;
  return QMAT_OK;
}

static qmat_status read_links(graph_reader *reader, size_t index, const qmat_tree *wiring) {
  qmat_status status = note(reader, expect_mapping(reader, wiring, "in", "in: { port: node.port }"));
  for (const qmat_tree_entry *entry = wiring->entries; entry && status == QMAT_OK; entry = entry->next)
    status = note(reader, read_link(reader, index, entry));
  return status;
}

static qmat_status check_connected(graph_reader *reader, size_t index) {
  const qmat_graph_node *node = &reader->graph->nodes[index];
  for (size_t port = 0; port < qmat_input_count(node->type); port++) {
    const qmat_graph_link *link = &node->links[port];
    if (link->node != SIZE_MAX || link->mark.line > 0 || node->type->inputs[port].optional) continue;
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "input '%s' of node '%s' (%s) is not connected",
              node->type->inputs[port].name, node->id, node->type->name);
    suggest_type(reader, node->type->inputs[port].type, index);
    const qmat_status status = note(reader, at_mark(reader, node->mark));
    if (status != QMAT_OK) return status;
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
    status = note(reader, read_node(reader, entry));
    if (status != QMAT_OK) return status;
  }
  /* A node may take its input from a node later in the file. */
  size_t index = 0;
  for (const qmat_tree_entry *entry = nodes->entries; entry; entry = entry->next) {
    if (index == graph->node_count || strcmp(graph->nodes[index].id, entry->key) != 0) continue; /* a broken one */
    const qmat_tree *wiring = find_key(entry->value, "in");
    if (wiring) status = read_links(reader, index, wiring);
    if (status == QMAT_OK) status = check_connected(reader, index);
    if (status != QMAT_OK) return status;
    index++;
  }
  return QMAT_OK;
}

/* An input is "node.parameter", or { node: parameter, ... } for one parameter in each of several nodes. */
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
    if (is_broken(reader, member ? joined : value->text)) return QMAT_OK;
    qmat_graph_param *param = &input->params[input->param_count];
    status = qmat_graph_find_param(reader->context, reader->graph, member ? joined : value->text, param);
    if (status != QMAT_OK) return at_mark(reader, member ? member->mark : value->mark);
    input->param_count++;
    if (member) member = member->next;
  } while (member);
  status = qmat_graph_check_input(reader->context, reader->graph, input);
  return status == QMAT_OK ? status : at_mark(reader, entry->mark);
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
    status = note(reader, read_input(reader, entry, &graph->inputs[graph->input_count++]));
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
      qmat_fail(reader->context, QMAT_ERROR_USAGE, "output '%s' has no key 'from'", entry->key);
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
  if (is_broken(reader, from->text)) return QMAT_OK;
  status = qmat_graph_find_port(reader->context, graph, from->text, &output->node, &output->port);
  if (status != QMAT_OK) return at_mark(reader, from->mark);
  if (!path) return QMAT_OK;
  output->path_mark = path->mark;
  if (!*path->text || strlen(path->text) > QMAT_GRAPH_MAX_TEXT) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the path of output '%s' is %s", entry->key,
              *path->text ? "too long" : "empty");
    return at_mark(reader, path->mark);
  }
  int choice;
  status = qmat_graph_output_format(reader->context, graph, graph->output_count - 1, path->text, &choice);
  if (status != QMAT_OK) return at_mark(reader, path->mark);
  output->path = qmat_resolve_path(graph->folder, path->text);
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
    status = note(reader, read_output(reader, entry));
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status read_graph(graph_reader *reader) {
  static const char *const keys[] = {"qmat", "inputs", "nodes", "outputs"};
  qmat_status status = expect_mapping(reader, reader->root, "graph", "qmat: 1, nodes: ..., outputs: ...");
  /* Another version may have other keys, so a wrong version is reported before a wrong key. */
  if (status == QMAT_OK && find_key(reader->root, "qmat")) status = read_version(reader);
  if (status == QMAT_OK) status = check_keys(reader, reader->root, "a graph", keys, 4);
  if (status == QMAT_OK) status = read_version(reader);
  if (status == QMAT_OK) status = read_nodes(reader);
  if (status == QMAT_OK) status = note(reader, read_inputs(reader));
  if (status == QMAT_OK) status = note(reader, read_outputs(reader));
  if (status == QMAT_OK && reader->mistakes > 0) {
    reader->context->error = reader->pending;
    return QMAT_ERROR_USAGE;
  }
  /* Another failure is the error then, and the newest mistake has not been told. */
  if (status != QMAT_OK && reader->mistakes > 0) reader->mistake(&reader->pending);
  if (status == QMAT_OK) status = qmat_graph_order_nodes(reader->context, reader->graph);
  if (status == QMAT_OK) status = qmat_graph_check_reached(reader->context, reader->graph);
  return status;
}

static qmat_status read_text(qmat_context *context, const qmat_registry *registry, const char *file, const char *folder,
                             size_t folder_length, const char *text, size_t size, qmat_mistake_fn *mistake,
                             qmat_graph *graph) {
  *graph = (qmat_graph){.registry = *registry};
  qmat_arena arena = {0};
  graph_reader reader = {.context = context, .graph = graph, .mistake = mistake};
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
  return read_text(context, registry, file, "", 0, text, size, NULL, graph);
}

/* Reads at most one byte more than a graph file may have. Every failure is a bad graph (QMAT_ERROR_USAGE), not a failed
 * run. */
static qmat_status read_bytes(qmat_context *context, const char *path, char **text, size_t *size) {
  *text = NULL;
  struct stat info;
  FILE *file = fopen(path, "rbe");
  if (!file || fstat(fileno(file), &info) != 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "cannot open the graph file: %s", strerror(errno));
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
      qmat_fail(context, QMAT_ERROR_USAGE, "cannot read the graph file: %s", strerror(errno));
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
  return qmat_graph_read_file_all(context, registry, path, NULL, NULL, graph);
}

qmat_status qmat_graph_read_file_all(qmat_context *context, const qmat_registry *registry, const char *path,
                                     const char *stream, qmat_mistake_fn *mistake, qmat_graph *graph) {
  *graph = (qmat_graph){0};
  char *text;
  size_t size = 0;
  qmat_status status = read_bytes(context, path, &text, &size);
  if (status != QMAT_OK) return status;
  const char *slash = stream ? NULL : strrchr(path, '/');
  const size_t folder_length = slash ? (size_t)(slash - path) + 1 : 0;
  status = read_text(context, registry, stream ? stream : path, path, folder_length, text, size, mistake, graph);
  qmat_free(text);
  graph->is_file = status == QMAT_OK && !stream;
  return status;
}
