/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/command.h"

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  return qmat_execute(context, invocation, qmat_read_graph_argument, NULL, NULL);
}

const qmat_command qmat_command_run = {
    .name = "run",
    .arguments = "GRAPH",
    .summary = "Run a graph file",
    .doc =
        "Runs a graph file, one from the standard input (-), or a built-in one ('qmat graphs'). Files are written only "
        "after every node has succeeded. Paths in the graph are relative to "
        "the graph file; paths given here, and those in a graph from the standard input, are relative to the working "
        "folder.",
    .options = qmat_output_options,
    .common = qmat_common_options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = 1,
    .run = run,
};
