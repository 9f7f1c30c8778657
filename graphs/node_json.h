/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_NODE_JSON_H
#define QMAT_GRAPHS_NODE_JSON_H

#include <jansson.h>

#include "graphs/graph.h"

/* Descriptors and parameters as JSON. NULL when memory is short; the caller calls json_decref. */

/* Everything that a node type's descriptor says. */
json_t *qmat_node_json(const qmat_node *type);

/* An array of all node types of the registry, sorted as they are. */
json_t *qmat_registry_json(const qmat_registry *registry);

/* A parameter's value: a boolean, a number or a text; null where a text is not set. */
json_t *qmat_param_json(const qmat_param *param, const void *params);

/* What a parameter takes, as text for people: "number from 0 to 1 (diagonal), default 0.01". `params` (the type's
 * params_size bytes) holds what it is where nothing is given; NULL: the type's own default. */
void qmat_param_describe(const qmat_node *type, const qmat_param *param, const void *params, char *text, size_t size);

/* "bool", "int", "float", "enum", "string", "path". */
const char *qmat_param_type_name(qmat_param_type type);

#endif
