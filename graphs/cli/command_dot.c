/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "graphs/cli/command.h"
#include "graphs/run/graph_run.h"

/* Colours that people with colour blindness can distinguish, by the number of the value type. Each edge also carries
 * the name of its type as a tooltip. */
static const char *type_colour(qmat_value_type type) {
  static const char *const colours[] = {"#7f7f7f", "#0072b2", "#56b4e9", "#009e73", "#d55e00",
                                        "#e69f00", "#cc79a7", "#000000", "#b2df8a", "#882255"};
  return colours[type % (sizeof colours / sizeof *colours)];
}

/* Paths and texts of parameters may hold any character. */
static void print_escaped(const char *text) {
  static const char special[] = "&<>\"\\", *const escaped[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&#92;"};
  for (; *text; text++) {
    const char *found = strchr(special, *text);
    if (found)
      fputs(escaped[found - special], stdout);
    else
      putchar((unsigned char)*text < 0x20 ? ' ' : *text);
  }
}

static void print_ports(const qmat_port *ports, size_t count, const char *prefix) {
  if (count == 0) return;
  printf("<tr>");
  for (size_t i = 0; i < count; i++)
    printf("<td port=\"%s%zu\" bgcolor=\"white\"><font point-size=\"9\" color=\"%s\">%s</font></td>", prefix, i,
           type_colour(ports[i].type), ports[i].name);
  printf("</tr>");
}

/* What a run would do with a node. Of several steps in several formats: one that is not a hit, if any. */
static const qmat_run_step *step_of(const qmat_run *run, size_t node) {
  const qmat_run_step *found = NULL;
  for (size_t i = 0; i < run->step_count; i++)
    if (run->steps[i].node == node && (!found || found->state == QMAT_STEP_HIT)) found = &run->steps[i];
  return found;
}

/* Colour is not the only sign: the state is also a word, and a node that runs has a double frame. */
static const char *state_style(const qmat_run_step *step) {
  if (!step) return "";
  if (step->state == QMAT_STEP_HIT) return ", fillcolor=\"#d5eedd\"";
  return step->state == QMAT_STEP_RUN ? ", fillcolor=\"#fbdcc4\", peripheries=2" : ", fillcolor=\"#fdf3c8\"";
}

static void print_node(const qmat_graph *graph, const qmat_run *run, size_t index) {
  const qmat_graph_node *node = &graph->nodes[index];
  const qmat_run_step *step = run ? step_of(run, index) : NULL;
  size_t inputs = qmat_input_count(node->type), outputs = qmat_output_count(node->type);
  printf("  n%zu [label=<<table border=\"0\" cellborder=\"0\" cellspacing=\"0\" cellpadding=\"3\">", index);
  if (inputs > 0) {
    printf("<tr><td><table border=\"0\" cellborder=\"0\" cellspacing=\"4\" cellpadding=\"2\">");
    print_ports(node->type->inputs, inputs, "i");
    printf("</table></td></tr>");
  }
  printf("<tr><td><b>%s</b><br/><font point-size=\"10\" color=\"#555555\">%s%s%s</font></td></tr>", node->id,
         node->type->name, step ? ": " : "", step ? qmat_step_state_words(step->state, false) : "");
  for (size_t row = 0; row < qmat_param_count(node->type); row++) {
    if (!node->texts[row]) continue;
    printf("<tr><td><font point-size=\"9\">%s = ", node->type->params[row].name);
    print_escaped(node->texts[row]);
    printf("</font></td></tr>");
  }
  char missing[256] = "";
  if (step) qmat_step_describe_missing(graph, step, missing, sizeof missing);
  if (*missing) printf("<tr><td><font point-size=\"9\">%s</font></td></tr>", missing);
  if (outputs > 0) {
    printf("<tr><td><table border=\"0\" cellborder=\"0\" cellspacing=\"4\" cellpadding=\"2\">");
    print_ports(node->type->outputs, outputs, "o");
    printf("</table></td></tr>");
  }
  printf("</table>>%s];\n", state_style(step));
}

static void print_graph(const qmat_graph *graph, const qmat_run *run) {
  printf("digraph qmat {\n  rankdir=TB;\n  fontname=\"sans-serif\";\n");
  printf(
      "  node [shape=box, style=\"rounded,filled\", color=\"#999999\", fillcolor=\"#f2f2f2\", "
      "fontname=\"sans-serif\", fontsize=12];\n");
  printf("  edge [fontname=\"sans-serif\", fontsize=9, arrowsize=0.7, penwidth=1.4];\n");
  for (size_t i = 0; i < graph->node_count; i++) print_node(graph, run, i);
  for (size_t i = 0; i < graph->node_count; i++) {
    const qmat_graph_node *node = &graph->nodes[i];
    for (size_t port = 0; port < qmat_input_count(node->type); port++) {
      const qmat_graph_link *link = &node->links[port];
      if (link->node == SIZE_MAX) continue;
      qmat_value_type type = node->type->inputs[port].type;
      printf("  n%zu:o%zu:s -> n%zu:i%zu:n [color=\"%s\", fontcolor=\"%s\", label=\"%s\"];\n", link->node, link->port,
             i, port, type_colour(type), type_colour(type), qmat_value_type_name(type));
    }
  }
  for (size_t i = 0; i < graph->output_count; i++) {
    const qmat_graph_output *output = &graph->outputs[i];
    qmat_value_type type = graph->nodes[output->node].type->outputs[output->port].type;
    printf("  out%zu [shape=note, style=filled, fillcolor=white, label=\"%s\"];\n", i, output->name);
    printf("  n%zu:o%zu:s -> out%zu [color=\"%s\", fontcolor=\"%s\", label=\"%s\"];\n", output->node, output->port, i,
           type_colour(type), type_colour(type), qmat_value_type_name(type));
  }
  printf("}\n");
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  if (!qmat_invocation_value(invocation, "status")) {
    qmat_status status = qmat_read_graph_argument(context, invocation);
    if (status == QMAT_OK) print_graph(&invocation->graph, NULL);
    return status;
  }
  qmat_planned_run planned;
  qmat_status status = qmat_plan_invocation(context, invocation, qmat_read_graph_argument, true, &planned);
  if (status == QMAT_OK) {
    qmat_run_foresee(&planned.run);
    print_graph(&invocation->graph, &planned.run);
  }
  qmat_planned_run_uninit(&planned);
  return status;
}

static const qmat_option options[] = {
    {"status", 0, NULL, "Show the state of each node: hit (cached), run, or depends (on earlier nodes)"},
    {"set", 0, "NAME=VALUE", "With --status: set a parameter as 'qmat run' would; may be repeated"},
    {"output", 'o', "[NAME=]PATH", "With --status: save an output as 'qmat run' would; may be repeated"},
    {0},
};

const qmat_command qmat_command_dot = {
    .name = "dot",
    .arguments = "GRAPH",
    .summary = "Draw a graph file (Graphviz)",
    .doc =
        "Prints a graph file in the language of Graphviz: qmat dot GRAPH | dot -Tsvg -o graph.svg. Inputs are above "
        "the "
        "name of a node, outputs below it. Colours are the types of values.",
    .options = options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = 1,
    .run = run,
};
