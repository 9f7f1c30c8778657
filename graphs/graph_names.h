/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_GRAPH_NAMES_H
#define QMAT_GRAPHS_GRAPH_NAMES_H

#include "graphs/graph.h"

/* Finding the things of a graph by name. A name that is not found is QMAT_ERROR_USAGE, with the nearest valid name as
 * the hint. */

/* Names to suggest. A zeroed list is empty. */
typedef struct qmat_name_list {
  const char **names;
  size_t count, capacity;
} qmat_name_list;

/* Adds a name; the text must outlive the list. When memory is short the name is left out. */
void qmat_name_list_add(qmat_name_list *list, const char *name);

/* Adds a hint to the newest error: the name nearest to `text`, or all names of this `kind` ("outputs") when they are
 * few. Frees the list. Returns the error's status. */
qmat_status qmat_suggest_name(qmat_context *context, const char *text, const char *kind, qmat_name_list *list);

/* Adds a hint to the newest error: the nearest of `count` names, or `otherwise` where none is near. Returns the error's
 * status. */
qmat_status qmat_suggest_nearest(qmat_context *context, const char *text, const char *const *names, size_t count,
                                 const char *otherwise);

/* Whether `text` may name a node, an input or an output. */
bool qmat_is_graph_name(const char *text);

/* The node type of that name. */
qmat_status qmat_registry_get(qmat_context *context, const qmat_registry *registry, const char *name,
                              const qmat_node **type);

/* The node of that id. */
qmat_status qmat_graph_find_node(qmat_context *context, const qmat_graph *graph, const char *id, size_t *node);

/* The output port that "node.port" names. */
qmat_status qmat_graph_find_port(qmat_context *context, const qmat_graph *graph, const char *name, size_t *node,
                                 size_t *port);

/* An input port and a parameter of a node. */
qmat_status qmat_graph_node_input(qmat_context *context, const qmat_graph_node *node, const char *name, size_t *port);
qmat_status qmat_graph_node_param(qmat_context *context, const qmat_graph_node *node, const char *name, size_t *param);

/* The parameter that "node.parameter" names. */
qmat_status qmat_graph_find_param(qmat_context *context, const qmat_graph *graph, const char *name,
                                  qmat_graph_param *param);

/* The parameters that "node.parameter" or an input's name sets. `*params` is the input's own array, or `single`. */
qmat_status qmat_graph_find_params(qmat_context *context, const qmat_graph *graph, const char *name,
                                   qmat_graph_param *single, const qmat_graph_param **params, size_t *count);

/* The output of that name. */
qmat_status qmat_graph_find_output(qmat_context *context, const qmat_graph *graph, const char *name, size_t *output);

#endif
