/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "graphs/cli/command.h"
#include "graphs/node_json.h"

static void print_ports(const qmat_port *ports, size_t count) {
  for (size_t i = 0; i < count; i++) printf("%s%s%s", i ? ", " : "", ports[i].name, ports[i].optional ? "?" : "");
  if (count == 0) printf("nothing");
}

static int widest_name(const qmat_registry *registry) {
  size_t width = 0, length;
  for (size_t i = 0; i < registry->count; i++)
    if ((length = strlen(registry->nodes[i]->name)) > width) width = length;
  return (int)width;
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const qmat_registry *registry = &invocation->registry;
  if (qmat_invocation_value(invocation, "json")) return qmat_print_json(context, qmat_registry_json(registry));
  const int width = widest_name(registry);
  for (size_t i = 0; i < registry->count; i++) {
    const qmat_node *type = registry->nodes[i];
    printf("%-*s  %s\n%*s", width, type->name, type->summary, width + 2, "");
    print_ports(type->inputs, qmat_input_count(type));
    printf(" -> ");
    print_ports(type->outputs, qmat_output_count(type));
    putchar('\n');
  }
  return QMAT_OK;
}

static const qmat_option options[] = {
    {"json", 0, NULL, "Print the full descriptions of the nodes as JSON"},
    {0},
};

const qmat_command qmat_command_nodes = {
    .name = "nodes",
    .arguments = "",
    .summary = "List the nodes that a graph may use",
    .doc = "Lists the node types with their inputs and outputs. A '?' marks an optional input.",
    .options = options,
    .run = run,
};
