/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_GRAPH_ORDER_H
#define QMAT_GRAPHS_GRAPH_ORDER_H

#include "graphs/graph.h"

/* Makes graph->order. QMAT_ERROR_USAGE: the nodes depend on each other in a cycle. Cost: quadratic in the nodes. */
qmat_status qmat_graph_order_nodes(qmat_context *context, qmat_graph *graph);

/* Whether every node leads to an output of the graph or to a node without outputs; needs graph->order.
 * QMAT_ERROR_USAGE names a node that does not. */
qmat_status qmat_graph_check_reached(qmat_context *context, const qmat_graph *graph);

#endif
