/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_BUILT_IN_H
#define QMAT_GRAPHS_BUILT_IN_H

#include "graphs/graph.h"

/* The text of graphs/qmat_plus.yaml, embedded by CMake. */
extern const char qmat_plus_graph[];
extern const size_t qmat_plus_graph_size; /* without the terminating zero */

/* Reads that graph. Errors call it "qmat_plus.yaml (built in)". */
qmat_status qmat_graph_read_built_in(qmat_context *context, const qmat_registry *registry, qmat_graph *graph);

#endif
