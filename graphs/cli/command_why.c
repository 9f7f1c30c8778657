/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>

#include "graphs/cli/command.h"
#include "graphs/graph_names.h"
#include "graphs/run/graph_run.h"
#include "graphs/run/why.h"

static void print_why(const json_t *why) {
  const json_t *causes = json_object_get(why, "causes");
  printf("%s (%s): %s\n", json_string_value(json_object_get(why, "node")),
         json_string_value(json_object_get(why, "type")), json_string_value(json_object_get(why, "text")));
  for (size_t i = 0; i < json_array_size(causes); i++)
    printf("  %s\n", json_string_value(json_object_get(json_array_get(causes, i), "text")));
}

/* Marks the nodes that cause a marked node to run. */
static void mark_causes(const qmat_run *run, const json_t *whys, bool *marked) {
  for (size_t i = json_array_size(whys); i-- > 0;) {
    const json_t *causes = json_object_get(json_array_get(whys, i), "causes");
    if (!marked[i]) continue;
    for (size_t k = 0; k < json_array_size(causes); k++) {
      const char *from = json_string_value(json_object_get(json_array_get(causes, k), "from"));
      for (size_t step = 0; from && step < i; step++)
        if (strcmp(run->graph->nodes[run->steps[step].node].id, from) == 0) marked[step] = true;
    }
  }
}

static qmat_status explain(qmat_context *context, const qmat_invocation *invocation, qmat_planned_run *planned) {
  qmat_run *run = &planned->run;
  bool *marked = qmat_calloc(run->step_count, sizeof *marked);
  json_t *records = qmat_cache_records(&planned->cache), *whys = json_array(), *shown = json_array();
  qmat_status status = QMAT_OK;
  size_t node = SIZE_MAX;
  if (invocation->argument_count > 1)
    status = qmat_graph_find_node(context, &invocation->graph, invocation->arguments[1], &node);
  if (status == QMAT_OK && (!marked || !records || !whys || !shown)) status = qmat_fail_memory(context, "listing");
  if (status == QMAT_OK) qmat_run_foresee(run);
  for (size_t i = 0; i < run->step_count && status == QMAT_OK; i++) {
    marked[i] = node == SIZE_MAX || run->steps[i].node == node;
    if (json_array_append_new(whys, qmat_why(run, records, i)) != 0) status = qmat_fail_memory(context, "listing");
  }
  if (status == QMAT_OK) mark_causes(run, whys, marked);
  for (size_t i = 0; i < run->step_count && status == QMAT_OK; i++) {
    if (!marked[i]) continue;
    json_array_append(shown, json_array_get(whys, i));
    if (!qmat_invocation_value(invocation, "json")) print_why(json_array_get(whys, i));
  }
  if (status == QMAT_OK && qmat_invocation_value(invocation, "json"))
    status = qmat_print_json(context, json_incref(shown));
  qmat_free(marked);
  json_decref(records);
  json_decref(whys);
  json_decref(shown);
  return status;
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  qmat_planned_run planned;
  qmat_status status = qmat_plan_invocation(context, invocation, qmat_read_graph_argument, true, &planned);
  if (status == QMAT_OK && !planned.cached) {
    qmat_fail(context, QMAT_ERROR_USAGE, "there is no cache to compare with");
    status = qmat_fail_hint(context, "--cache DIR");
  }
  if (status == QMAT_OK) status = explain(context, invocation, &planned);
  qmat_planned_run_uninit(&planned);
  return status;
}

static const qmat_option options[] = {
    {"set", 0, "NAME=VALUE", "Set a parameter as 'qmat run' would; may be repeated"},
    {"output", 'o', "[NAME=]PATH", "Save an output as 'qmat run' would: it sets the format; may be repeated"},
    {"to", 0, "NODE", "Only this node and the nodes that it needs"},
    {"json", 0, NULL, "Print JSON"},
    {0},
};

const qmat_command qmat_command_why = {
    .name = "why",
    .arguments = "GRAPH [NODE]",
    .summary = "Explain why nodes would run, or why they ran",
    .doc =
        "Compares everything that a result depends on (parameters, bytes of files and inputs, versions of the node and "
        "its libraries) with the most similar cached result, and prints the differences. For a result in the cache it "
        "prints what was different when the result was made. With NODE, only that node and the nodes that cause it to "
        "run. Nothing runs.",
    .options = options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = 2,
    .run = run,
};
