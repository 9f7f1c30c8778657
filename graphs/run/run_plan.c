/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_plan.h"

#include <stdio.h>
#include <string.h>

#include "graphs/graph_names.h"
#include "graphs/graph_params.h"
#include "graphs/run/run_paths.h"
#include "graphs/run/run_unread.h"

typedef struct run_planner {
  qmat_context *context;
  const qmat_graph *graph;
  const qmat_run_options *options;
  qmat_run *run;
  int *formats;      /* per file: the format that its step runs in, or -1 */
  bool *within;      /* per node: options->to_node needs it, or is it */
  bool *replaced;    /* per node: values are given for it */
  bool *needed;      /* per node: it runs with its own parameters ... */
  bool *wanted;      /* ... and not only because others read what it makes */
  size_t *base_step; /* per node: the step of that run */
} run_planner;

static int choice_of(const qmat_node *type, const void *params) {
  const qmat_param *format = qmat_output_format_param(type);
  int choice = -1;
  if (format) memcpy(&choice, (const char *)params + format->offset, sizeof choice);
  return choice;
}

/* Marks `start` and the nodes that it needs. */
static void mark_within(const qmat_graph *graph, size_t start, bool *within) {
  within[start] = true;
  for (size_t k = graph->node_count; k-- > 0;) {
    const qmat_graph_node *node = &graph->nodes[graph->order[k]];
    for (size_t port = 0; within[graph->order[k]] && port < qmat_input_count(node->type); port++)
      if (node->links[port].node != SIZE_MAX) within[node->links[port].node] = true;
  }
}

static qmat_status add_file(run_planner *planner, size_t output, const char *path, int *format) {
  qmat_run *run = planner->run;
  const qmat_graph_output *made = &planner->graph->outputs[output];
  if (!*path) return qmat_fail(planner->context, QMAT_ERROR_USAGE, "the path of output '%s' is empty", made->name);
  qmat_status status = qmat_graph_output_format(planner->context, planner->graph, output, path, format);
  if (status != QMAT_OK) return status;
  const qmat_graph_node *maker = &planner->graph->nodes[made->node];
  if (*format < 0) *format = choice_of(maker->type, maker->params);
  if (!planner->within[made->node]) {
    return qmat_fail(planner->context, QMAT_ERROR_USAGE, "output '%s' needs nodes after '%s', where the run stops",
                     made->name, planner->options->to_node);
  }
  for (size_t i = 0; i < run->file_count; i++)
    if (qmat_same_file(path, run->files[i].path))
      return qmat_fail(planner->context, QMAT_ERROR_USAGE, "two outputs have the path '%s'", path);
  char *copy = qmat_strdup(path);
  if (!copy) return qmat_fail_memory(planner->context, "output path");
  run->files[run->file_count++] = (qmat_run_file){.output = output, .path = copy};
  return QMAT_OK;
}

static bool has_save(const qmat_run_options *options, size_t output) {
  for (size_t i = 0; i < options->save_count; i++)
    if (options->saves[i].output == output) return true;
  return false;
}

static qmat_status plan_files(run_planner *planner) {
  const qmat_graph *graph = planner->graph;
  const qmat_run_options *options = planner->options;
  qmat_run *run = planner->run;
  size_t most = options->save_count + graph->output_count;
  run->files = qmat_calloc(most, sizeof *run->files);
  planner->formats = qmat_calloc(most, sizeof *planner->formats);
  if (!run->files || !planner->formats) return qmat_fail_memory(planner->context, "outputs");
  for (size_t i = 0; i < options->save_count; i++) {
    qmat_status status =
        add_file(planner, options->saves[i].output, options->saves[i].path, &planner->formats[run->file_count]);
    if (status != QMAT_OK) return status;
  }
  for (size_t i = 0; i < graph->output_count && !options->only_wanted && !options->no_paths; i++) {
    const qmat_graph_output *output = &graph->outputs[i];
    if (!output->path || has_save(options, i) || !planner->within[output->node]) continue;
    qmat_status status = add_file(planner, i, output->path, &planner->formats[run->file_count]);
    if (status == QMAT_OK) run->files[run->file_count - 1].by_graph = true;
    if (status != QMAT_OK)
      return qmat_fail_at(planner->context, graph->file, output->path_mark.line, output->path_mark.column);
  }
  return QMAT_OK;
}

/* Whether file `index` is the first file of its node in a format that the node does not run in anyway. */
static bool needs_own_step(const run_planner *planner, size_t index) {
  const qmat_graph *graph = planner->graph;
  size_t node = graph->outputs[planner->run->files[index].output].node;
  int format = planner->formats[index];
  if (planner->replaced[node]) return false;
  if (planner->needed[node] && choice_of(graph->nodes[node].type, graph->nodes[node].params) == format) return false;
  for (size_t i = 0; i < index; i++)
    if (graph->outputs[planner->run->files[i].output].node == node && planner->formats[i] == format) return false;
  return true;
}

/* Marks the nodes that a node needs when it runs in a format. `params` is room for its parameters. */
static void mark_inputs(run_planner *planner, size_t index, int format, void *params) {
  const qmat_graph_node *node = &planner->graph->nodes[index];
  const qmat_param *param = qmat_output_format_param(node->type);
  if (node->type->params_size > 0) memcpy(params, node->params, node->type->params_size);
  if (param) memcpy((char *)params + param->offset, &format, sizeof format);
  for (size_t port = 0; port < qmat_input_count(node->type); port++)
    if (node->links[port].node != SIZE_MAX && (!node->type->reads || node->type->reads(params, NULL, port)))
      planner->needed[node->links[port].node] = true;
}

static qmat_status plan_needs(run_planner *planner) {
  const qmat_graph *graph = planner->graph;
  const qmat_run_options *options = planner->options;
  for (size_t i = 0; i < options->want_count; i++) planner->needed[options->wants[i].node] = true;
  if (options->to_node) {
    for (size_t i = 0; i < graph->node_count; i++)
      if (strcmp(graph->nodes[i].id, options->to_node) == 0) planner->needed[i] = true;
  } else if (!options->only_wanted) {
    for (size_t i = 0; i < graph->output_count; i++) {
      const bool saved = has_save(options, i) || (graph->outputs[i].path && !options->no_paths);
      /* Where files are saved, these are all that is wanted of the graph's files. */
      const bool unwanted =
          qmat_graph_on_request(graph, i) || (options->save_count > 0 && qmat_graph_output_type(graph, i) == QMAT_FILE);
      if (!saved && !unwanted) planner->needed[graph->outputs[i].node] = true;
    }
    for (size_t i = 0; i < graph->node_count; i++)
      if (qmat_output_count(graph->nodes[i].type) == 0) planner->needed[i] = true;
  }
  memcpy(planner->wanted, planner->needed, graph->node_count * sizeof *planner->wanted);
  size_t largest = 1;
  for (size_t i = 0; i < graph->node_count; i++)
    if (graph->nodes[i].type->params_size > largest) largest = graph->nodes[i].type->params_size;
  void *params = qmat_alloc(largest, 1);
  if (!params) return qmat_fail_memory(planner->context, "plan");
  for (size_t k = graph->node_count; k-- > 0;) {
    size_t index = graph->order[k];
    if (planner->replaced[index]) continue;
    const qmat_graph_node *node = &graph->nodes[index];
    if (planner->needed[index]) mark_inputs(planner, index, choice_of(node->type, node->params), params);
    for (size_t i = 0; i < planner->run->file_count; i++)
      if (graph->outputs[planner->run->files[i].output].node == index)
        mark_inputs(planner, index, planner->formats[i], params);
  }
  qmat_free(params);
  return QMAT_OK;
}

static bool is_forced(const qmat_run_options *options, size_t node) {
  for (size_t i = 0; i < options->forced_count; i++)
    if (options->forced[i] == node) return true;
  return options->force_all;
}

static qmat_status add_step(run_planner *planner, size_t index, int format) {
  const qmat_graph_node *node = &planner->graph->nodes[index];
  qmat_run *run = planner->run;
  qmat_run_step *step = &run->steps[run->step_count++];
  *step = (qmat_run_step){.first_slot = run->slot_count, .forced = is_forced(planner->options, index)};
  run->slot_count += qmat_output_count(node->type);
  const qmat_status status = qmat_step_init(planner->context, planner->graph, index, NULL, format, step);
  if (status != QMAT_OK) return status;
  const qmat_param *param = qmat_output_format_param(node->type);
  if (param) memcpy((char *)step->params + param->offset, &format, sizeof format);
  step->missing = planner->options->foresee ? qmat_graph_missing_param(node) : NULL;
  if (step->missing) return QMAT_OK;
  return qmat_graph_check_node(planner->context, planner->graph, index, step->params);
}

static qmat_status plan_steps(run_planner *planner) {
  const qmat_graph *graph = planner->graph;
  qmat_run *run = planner->run;
  run->steps = qmat_calloc(graph->node_count + run->file_count, sizeof *run->steps);
  if (!run->steps) return qmat_fail_memory(planner->context, "plan");
  for (size_t k = 0; k < graph->node_count; k++) {
    size_t index = graph->order[k];
    planner->base_step[index] = SIZE_MAX;
    if (planner->replaced[index]) continue;
    if (planner->needed[index]) {
      planner->base_step[index] = run->step_count;
      qmat_status status = add_step(planner, index, choice_of(graph->nodes[index].type, graph->nodes[index].params));
      if (status != QMAT_OK) return status;
      run->steps[planner->base_step[index]].wanted = planner->wanted[index];
    }
    for (size_t i = 0; i < run->file_count; i++) {
      if (graph->outputs[run->files[i].output].node != index || !needs_own_step(planner, i)) continue;
      qmat_status status = add_step(planner, index, planner->formats[i]);
      if (status != QMAT_OK) return status;
    }
  }
  return QMAT_OK;
}

/* The slot of an output port of a node that runs with its own parameters or whose values are given. */
static qmat_status find_slot(run_planner *planner, size_t node, size_t port, size_t *slot) {
  const qmat_run *run = planner->run;
  if (!planner->replaced[node]) {
    *slot = run->steps[planner->base_step[node]].first_slot + port;
    return QMAT_OK;
  }
  for (size_t i = 0; i < run->given_count; i++)
    if (run->given[i].node == node && run->given[i].port == port) {
      *slot = run->slot_count - run->given_count + i;
      return QMAT_OK;
    }
  const qmat_graph_node *owner = &planner->graph->nodes[node];
  return qmat_fail(planner->context, QMAT_ERROR_USAGE, "values are given for node '%s', but not for its output '%s'",
                   owner->id, owner->type->outputs[port].name);
}

static qmat_status plan_slots(run_planner *planner) {
  const qmat_graph *graph = planner->graph;
  const qmat_run_options *options = planner->options;
  qmat_run *run = planner->run;
  run->given = qmat_calloc(options->given_count, sizeof *run->given);
  run->slots = qmat_calloc(run->slot_count + options->given_count, sizeof *run->slots);
  if (!run->given || !run->slots) return qmat_fail_memory(planner->context, "plan");
  for (size_t i = 0; i < options->given_count; i++) {
    run->given[i] = options->given[i];
    run->slots[run->slot_count + i] = (qmat_run_slot){.value = qmat_value_retain(options->given[i].value),
                                                      .digest = options->given[i].value->digest,
                                                      .known = true,
                                                      .step = SIZE_MAX,
                                                      .kept = true};
  }
  run->given_count = options->given_count;
  run->slot_count += options->given_count;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < run->step_count; i++) {
    qmat_run_step *step = &run->steps[i];
    const qmat_graph_node *node = &graph->nodes[step->node];
    for (size_t port = 0; port < qmat_output_count(node->type); port++) run->slots[step->first_slot + port].step = i;
    for (size_t port = 0; port < qmat_input_count(node->type); port++) {
      const qmat_graph_link *link = &node->links[port];
      step->inputs[port] = SIZE_MAX;
      if (link->node == SIZE_MAX || (node->type->reads && !node->type->reads(step->params, NULL, port))) continue;
      status = find_slot(planner, link->node, link->port, &step->inputs[port]);
      if (status != QMAT_OK) return status;
    }
  }
  qmat_run_count_readers(run);
  for (size_t i = 0; i < options->want_count; i++) {
    size_t slot;
    status = find_slot(planner, options->wants[i].node, options->wants[i].port, &slot);
    if (status != QMAT_OK) return status;
    run->slots[slot].kept = true;
  }
  for (size_t i = 0; i < run->file_count; i++) {
    qmat_run_file *file = &run->files[i];
    const qmat_graph_output *output = &graph->outputs[file->output];
    if (planner->replaced[output->node]) {
      status = find_slot(planner, output->node, output->port, &file->slot);
      if (status != QMAT_OK) return status;
      continue;
    }
    for (size_t k = 0; k < run->step_count; k++)
      if (run->steps[k].node == output->node && run->steps[k].format == planner->formats[i])
        file->slot = run->steps[k].first_slot + output->port;
    run->slots[file->slot].kept = true;
  }
  return QMAT_OK;
}

static void name_run(qmat_run *run) {
  const char *file = run->graph->file + qmat_folder_length(run->graph->file);
  snprintf(run->name, sizeof run->name, "%s", file);
  char *dot = strrchr(run->name, '.');
  if (dot && dot != run->name) *dot = 0;
  for (size_t i = 0; i < run->given_count; i++)
    if (run->given[i].value->type == QMAT_SCENE) {
      snprintf(run->name, sizeof run->name, "%s", ((const qmat_scene *)run->given[i].value)->name);
      return;
    }
}

qmat_status qmat_run_plan(qmat_context *context, const qmat_graph *graph, const qmat_run_options *options,
                          qmat_run *run) {
  *run = (qmat_run){.graph = graph, .cache = options->cache, .foreseen = options->foresee};
  run_planner planner = {.context = context, .graph = graph, .options = options, .run = run};
  planner.within = qmat_calloc(graph->node_count, sizeof *planner.within);
  planner.replaced = qmat_calloc(graph->node_count, sizeof *planner.replaced);
  planner.needed = qmat_calloc(graph->node_count, sizeof *planner.needed);
  planner.wanted = qmat_calloc(graph->node_count, sizeof *planner.wanted);
  planner.base_step = qmat_calloc(graph->node_count, sizeof *planner.base_step);
  qmat_status status = QMAT_OK;
  if (!planner.within || !planner.replaced || !planner.needed || !planner.wanted || !planner.base_step) {
    status = qmat_fail_memory(context, "plan");
    goto cleanup;
  }
  if (options->to_node) {
    size_t node;
    status = qmat_graph_find_node(context, graph, options->to_node, &node);
    if (status != QMAT_OK) goto cleanup;
    mark_within(graph, node, planner.within);
  } else {
    memset(planner.within, true, graph->node_count * sizeof *planner.within);
  }
  for (size_t i = 0; i < options->given_count; i++) planner.replaced[options->given[i].node] = true;
  status = plan_files(&planner);
  if (status != QMAT_OK) goto cleanup;
  status = plan_needs(&planner);
  if (status == QMAT_OK) status = plan_steps(&planner);
  if (status == QMAT_OK) status = plan_slots(&planner);
  if (status != QMAT_OK) goto cleanup;
  qmat_run_drop_unread(run, 0); /* given values may decide */
  name_run(run);
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++) {
    char what[QMAT_GRAPH_NAME_SIZE + 16];
    snprintf(what, sizeof what, "output '%s':", graph->outputs[run->files[i].output].name);
    status = qmat_run_check_not_input(context, run, what, run->files[i].path);
    if (status == QMAT_OK && graph->outputs[run->files[i].output].path && !run->foreseen)
      status = qmat_make_folders(context, run->files[i].path);
    if (status == QMAT_OK) status = qmat_run_check_can_write(context, run, run->files[i].path, &run->files[i].planned);
  }
cleanup:
  qmat_free(planner.formats);
  qmat_free(planner.within);
  qmat_free(planner.replaced);
  qmat_free(planner.needed);
  qmat_free(planner.wanted);
  qmat_free(planner.base_step);
  return status;
}
