/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_GRAPH_PARAMS_H
#define QMAT_GRAPHS_GRAPH_PARAMS_H

#include "graphs/graph.h"

/* Setting and checking the parameters of a graph's nodes. */

enum { QMAT_GRAPH_MAX_TEXT = 4096 }; /* bytes of a parameter's value or of a path */

/* A copy of `path`, inside `folder` if it is relative. NULL when memory is short; free with qmat_free. */
char *qmat_resolve_path(const char *folder, const char *path);

/* Sets parameter `param` of node `node` to a copy of `text`. A relative path is relative to `folder`, "" for the
 * working folder. QMAT_ERROR_USAGE leaves the old value. */
qmat_status qmat_graph_set(qmat_context *context, qmat_graph *graph, size_t node, size_t param, const char *text,
                           const char *folder);

/* Sets every parameter that "node.parameter" or an input's name stands for; paths are relative to the working folder.
 * QMAT_ERROR_USAGE leaves all of them unchanged. */
qmat_status qmat_graph_set_named(qmat_context *context, qmat_graph *graph, const char *name, const char *text);

/* The same for "node.parameter=value" or "input=value". */
qmat_status qmat_graph_assign(qmat_context *context, qmat_graph *graph, const char *assignment);

/* Checks the ending of an output's path: reports are saved as .json, files in a format that their node can write.
 * `*choice` becomes the value of the node's format parameter (QMAT_PARAM_OUTPUT_FORMAT), or -1 if it has none.
 * QMAT_ERROR_USAGE lists the known endings. */
qmat_status qmat_graph_output_format(qmat_context *context, const qmat_graph *graph, size_t output, const char *path,
                                     int *choice);

/* The only output that is a file and can be written with the ending of `path`: true, and its index in `*output`. */
bool qmat_graph_output_of_ending(const qmat_graph *graph, const char *path, size_t *output);

/* Checks the parameters of every node against the node's rules. A required parameter may be missing if an input of the
 * graph sets it. */
qmat_status qmat_graph_check_params(qmat_context *context, const qmat_graph *graph);

/* Refuses an input that can never be set, because it sets two parameters that take no value in common, as a number and
 * a choice. QMAT_ERROR_USAGE names both. */
qmat_status qmat_graph_check_input(qmat_context *context, const qmat_graph *graph, const qmat_graph_input *input);

/* The same as qmat_graph_check_params for one node with these parameters; no required one may be missing. */
qmat_status qmat_graph_check_node(qmat_context *context, const qmat_graph *graph, size_t node, const void *params);

#endif
