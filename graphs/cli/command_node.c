/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graphs/cli/command.h"
#include "graphs/graph_names.h"
#include "graphs/node_json.h"

static void print_row(const char *name, int width, const char *text) {
  int column = printf("  %-*s  ", width, name);
  qmat_print_wrapped(text, column, width + 4);
}

static int widest_name(const qmat_node *type) {
  size_t width = 0, length;
  for (size_t i = 0; i < qmat_param_count(type); i++)
    if ((length = strlen(type->params[i].name)) > width) width = length;
  for (size_t i = 0; i < qmat_input_count(type); i++)
    if ((length = strlen(type->inputs[i].name)) > width) width = length;
  for (size_t i = 0; i < qmat_output_count(type); i++)
    if ((length = strlen(type->outputs[i].name)) > width) width = length;
  return (int)width;
}

static void print_ports(const char *title, const qmat_port *ports, size_t count, int width) {
  if (count == 0) return;
  printf("\n%s:\n", title);
  for (size_t i = 0; i < count; i++) {
    char text[512];
    snprintf(text, sizeof text, "%s%s%s%s", qmat_value_type_name(ports[i].type), ports[i].optional ? ", optional" : "",
             ports[i].doc && *ports[i].doc ? ": " : "", ports[i].doc ? ports[i].doc : "");
    print_row(ports[i].name, width, text);
  }
}

static void print_page(const qmat_node *type) {
  int width = widest_name(type);
  printf("%s, version %u\n\n", type->name, (unsigned)type->version);
  qmat_print_wrapped(type->summary, 0, 0);
  if (type->doc && *type->doc) {
    putchar('\n');
    qmat_print_wrapped(type->doc, 0, 0);
  }
  if (type->citation && *type->citation) {
    putchar('\n');
    int column = printf("Source: ");
    qmat_print_wrapped(type->citation, column, column);
  }
  print_ports("Inputs", type->inputs, qmat_input_count(type), width);
  print_ports("Outputs", type->outputs, qmat_output_count(type), width);
  if (qmat_param_count(type) > 0) printf("\nParameters:\n");
  for (size_t i = 0; i < qmat_param_count(type); i++) {
    char takes[512], text[1024];
    qmat_param_describe(type, &type->params[i], NULL, takes, sizeof takes);
    snprintf(text, sizeof text, "%s\n%s", type->params[i].doc ? type->params[i].doc : "", takes);
    print_row(type->params[i].name, width, text);
  }
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const qmat_node *type;
  qmat_status status = qmat_registry_get(context, &invocation->registry, invocation->arguments[0], &type);
  if (status != QMAT_OK) return status;
  if (qmat_invocation_value(invocation, "json")) return qmat_print_json(context, qmat_node_json(type));
  print_page(type);
  return QMAT_OK;
}

static const qmat_option options[] = {
    {"json", 0, NULL, "Print it as JSON"},
    {0},
};

const qmat_command qmat_command_node = {
    .name = "node",
    .arguments = "NAME",
    .summary = "Explain one node: inputs, outputs, parameters",
    .doc = "Prints what a node does, its source, and the meaning of its inputs, outputs and parameters.",
    .options = options,
    .least = 1,
    .most = 1,
    .run = run,
};
