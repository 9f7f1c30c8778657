/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/built_in.h"
#include "graphs/graph_file.h"

qmat_status qmat_graph_read_built_in(qmat_context *context, const qmat_registry *registry, qmat_graph *graph) {
  return qmat_graph_read_text(context, registry, "qmat_plus.yaml (built in)", qmat_plus_graph, qmat_plus_graph_size,
                              graph);
}
