/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_GRAPH_H
#define QMAT_GRAPHS_GRAPH_H

#include "core/node.h"
#include "graphs/yaml_tree.h"

/* A graph of nodes in memory. graph_file.h reads one from text. */

/* The node types that a graph may use. */
typedef struct qmat_registry {
  const qmat_node *const *nodes;
  size_t count;
} qmat_registry;

/* The node type of that name, or NULL. */
const qmat_node *qmat_registry_find(const qmat_registry *registry, const char *name);

enum { QMAT_GRAPH_NAME_SIZE = 64 }; /* of ids and names, with the terminating zero */

/* The output port that an input port takes its value from. */
typedef struct qmat_graph_link {
  size_t node, port; /* SIZE_MAX: not connected */
  qmat_mark mark;
} qmat_graph_link;

typedef struct qmat_graph_node {
  char id[QMAT_GRAPH_NAME_SIZE];
  const qmat_node *type;
  qmat_mark mark;         /* of the id */
  void *params;           /* type->params_size bytes; texts are in `texts` or in the descriptor */
  char **texts;           /* per parameter: its value as given, with the path resolved; NULL: the default */
  qmat_mark *marks;       /* per parameter: its place in the file; zeros: not set there, or set again later */
  qmat_graph_link *links; /* per input port */
} qmat_graph_node;

typedef struct qmat_graph_param {
  size_t node, param;
} qmat_graph_param;

/* A short name for one parameter, or for several that get the same value. */
typedef struct qmat_graph_input {
  char name[QMAT_GRAPH_NAME_SIZE];
  size_t param_count;
  qmat_graph_param *params; /* at least one, in the file's order */
} qmat_graph_input;

typedef struct qmat_graph_output {
  char name[QMAT_GRAPH_NAME_SIZE];
  size_t node, port;
  char *path; /* where the graph file saves it, resolved; NULL: nowhere */
  qmat_mark mark, path_mark;
} qmat_graph_output;

/* A zeroed graph is empty, and may be uninitialised. */
typedef struct qmat_graph {
  qmat_registry registry;
  char *file;   /* its name in errors */
  bool is_file; /* `file` is a path; else the graph was read from text */
  char *folder; /* "" (the working folder), or ends in '/' */
  size_t node_count, input_count, output_count;
  qmat_graph_node *nodes;     /* in the file's order */
  qmat_graph_input *inputs;   /* in the file's order */
  qmat_graph_output *outputs; /* in the file's order */
  size_t *order; /* node_count indices: a node comes after those that it depends on, else in the file's order */
} qmat_graph;
/* Frees what the graph holds. Works on a zeroed and on a failed graph. */
void qmat_graph_uninit(qmat_graph *graph);

/* The parameter of a node type that the ending of an output path sets, or NULL. */
const qmat_param *qmat_output_format_param(const qmat_node *type);

/* The type of value that output `output` of the graph is. */
qmat_value_type qmat_graph_output_type(const qmat_graph *graph, size_t output);

/* Whether output `output` is made only where a run saves it. */
bool qmat_graph_on_request(const qmat_graph *graph, size_t output);

/* How many outputs of the graph are files that every run makes; `*last` becomes the last of them. */
size_t qmat_graph_file_count(const qmat_graph *graph, size_t *last);

/* The first required parameter of a node that is not set, or NULL. */
const qmat_param *qmat_graph_missing_param(const qmat_graph_node *node);

/* The graph's input of this name, or NULL. */
const qmat_graph_input *qmat_graph_input_called(const qmat_graph *graph, const char *name);

/* The name of the graph's input that sets this parameter, or NULL. */
const char *qmat_graph_input_name(const qmat_graph *graph, size_t node, const qmat_param *param);

/* The option that sets a parameter: "--set model=FILE", or "--set node.parameter=VALUE" if no input sets it.
 * Terminated; cut when `size` is short. */
void qmat_graph_set_option(const qmat_graph *graph, size_t node, const qmat_param *param, char *text, size_t size);

#endif
