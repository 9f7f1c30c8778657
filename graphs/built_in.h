/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_BUILT_IN_H
#define QMAT_GRAPHS_BUILT_IN_H

#include "graphs/graph.h"

/* The shipped graphs, whose texts CMake embeds. */

typedef struct qmat_built_in_graph {
  const char *name; /* of its file, without ".yaml" */
  const char *text;
  const size_t *size; /* without the terminating zero */
} qmat_built_in_graph;

/* The first is qmat_plus. */
extern const qmat_built_in_graph qmat_built_in_graphs[];
extern const size_t qmat_built_in_graph_count;

/* The built-in graph of that name, with or without ".yaml"; NULL: none. */
const qmat_built_in_graph *qmat_built_in_graph_find(const char *name);

/* The built-in graph that the argument `name` of a command means. NULL: none, or a file of this name exists, or a pipe.
 * A folder of this name does not matter: it cannot be a graph. */
const qmat_built_in_graph *qmat_built_in_graph_named(const char *name);

/* Reads one. Errors call it "qmat_plus.yaml (built in)". */
qmat_status qmat_graph_read_built_in(qmat_context *context, const qmat_registry *registry,
                                     const qmat_built_in_graph *built_in, qmat_graph *graph);

#endif
