/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>

#include "graphs/cli/command.h"
#include "graphs/graph_params.h"
#include "graphs/run/run_paths.h"

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  qmat_graph *graph = &invocation->graph;
  qmat_status status = qmat_read_graph_argument(context, invocation);
  if (status == QMAT_OK) status = qmat_graph_check_params(context, graph);
  if (status == QMAT_OK) status = qmat_graph_check_paths(context, graph);
  if (status != QMAT_OK || qmat_invocation_value(invocation, "quiet")) return status;
  printf("%s: %zu node%s, %zu input%s, %zu output%s, no mistakes\n", graph->file, graph->node_count,
         graph->node_count == 1 ? "" : "s", graph->input_count, graph->input_count == 1 ? "" : "s", graph->output_count,
         graph->output_count == 1 ? "" : "s");
  return QMAT_OK;
}

static const qmat_option options[] = {
    {"quiet", 'q', NULL, "Print nothing but errors"},
    {0},
};

const qmat_command qmat_command_check = {
    .name = "check",
    .arguments = "GRAPH",
    .summary = "Check a graph file without running it",
    .doc =
        "Checks the names, connections, parameters and paths of a graph file. Each mistake is printed with its file, "
        "line and "
        "column, and the exit code is 2. A required parameter may be missing if it is an input of the graph.",
    .options = options,
    .least = 1,
    .most = 1,
    .run = run,
};
