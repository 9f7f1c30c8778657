/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_NODE_JSON_H
#define QMAT_GRAPHS_NODE_JSON_H

#include <jansson.h>

#include "graphs/graph.h"

/* Descriptors and parameters as JSON. NULL when memory is short; the caller calls json_decref. */

/* A node type's whole descriptor. */
json_t *qmat_node_json(const qmat_node *type);

/* An array of all node types, in the registry's order. */
json_t *qmat_registry_json(const qmat_registry *registry);

/* The inputs, nodes and outputs of a graph, without their values: see qmat_job_graph. */
json_t *qmat_graph_json(const qmat_graph *graph);

/* A parameter's value: a boolean, a number or a text; null for a text that is not set. */
json_t *qmat_param_json(const qmat_param *param, const void *params);

/* Describes a parameter's values: "number from 0 to 1 (diagonal), default 0.01". The default is taken from `params`
 * (the type's params_size bytes); NULL: the type's own default. */
void qmat_param_describe(const qmat_node *type, const qmat_param *param, const void *params, char *text, size_t size);

#endif
