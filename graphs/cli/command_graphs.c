/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "graphs/built_in.h"
#include "graphs/cli/command.h"
#include "graphs/graph_names.h"

/* Prints the first line of a graph's text, which says what it is for. */
static void print_row(const qmat_built_in_graph *graph) {
  char line[512];
  const char *start = graph->text + strspn(graph->text, "# ");
  snprintf(line, sizeof line, "%.*s", (int)strcspn(start, "\n"), start);
  const int column = printf("%-12s", graph->name);
  qmat_print_wrapped(line, column, 12);
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const char *names[8];
  for (size_t i = 0; i < qmat_built_in_graph_count && i < 8; i++) names[i] = qmat_built_in_graphs[i].name;
  if (invocation->argument_count == 0) {
    for (size_t i = 0; i < qmat_built_in_graph_count; i++) print_row(&qmat_built_in_graphs[i]);
    return QMAT_OK;
  }
  const char *name = invocation->arguments[0];
  const qmat_built_in_graph *graph = qmat_built_in_graph_find(name);
  if (!graph) {
    qmat_fail(context, QMAT_ERROR_USAGE, "there is no built-in graph '%s'", qmat_show(name).text);
    return qmat_suggest_nearest(context, name, names, qmat_built_in_graph_count, "'qmat graphs' lists them");
  }
  fwrite(graph->text, 1, *graph->size, stdout);
  return QMAT_OK;
}

const qmat_command qmat_command_graphs = {
    .name = "graphs",
    .arguments = "[NAME]",
    .summary = "List the built-in graphs, or print one",
    .doc =
        "Lists the graphs that are part of the program, or prints the text of one, to be changed: 'qmat graphs lod "
        ">mine.yaml'. Wherever a command takes a graph file it also takes such a name.",
    .most = 1,
    .run = run,
};
