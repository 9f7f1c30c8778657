/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/graph_run.h"

#include <stdio.h>
#include <string.h>

#include "graphs/run/run_cache.h"
#include "graphs/run/run_step.h"
#include "graphs/run/run_unread.h"

/* Names the run after its first scene. */
static qmat_status take_name(qmat_executor *executor, const qmat_run_step *step, bool *named) {
  qmat_run *run = executor->run;
  const qmat_node *type = run->graph->nodes[step->node].type;
  for (size_t port = 0; port < qmat_output_count(type) && !*named; port++) {
    if (type->outputs[port].type != QMAT_SCENE) continue;
    qmat_status status = qmat_need_value(executor, step->first_slot + port);
    if (status != QMAT_OK) return status;
    const qmat_scene *scene = (const qmat_scene *)run->slots[step->first_slot + port].value;
    if (!scene->name[0]) continue;
    snprintf(run->name, sizeof run->name, "%s", scene->name);
    *named = true;
  }
  return QMAT_OK;
}

/* Whether a node made a list from single values. */
static bool made_list(const qmat_node *type, const qmat_run_step *step) {
  for (size_t port = 0; port < qmat_output_count(type); port++)
    if (type->outputs[port].list && step->made[port].items > 1) return true;
  return false;
}

/* Checks the list lengths that later steps will be given, so that a mismatch is found before the steps in between. */
static qmat_status check_list_lengths(qmat_executor *executor, size_t next) {
  const qmat_run *run = executor->run;
  qmat_context *context = executor->context;
  size_t most_inputs = 0;
  for (size_t i = 0; i < run->step_count; i++) {
    const size_t count = qmat_input_count(run->graph->nodes[run->steps[i].node].type);
    if (count > most_inputs) most_inputs = count;
  }
  size_t *of_slots = qmat_calloc(run->slot_count, sizeof *of_slots); /* 0: not known yet */
  size_t *counts = qmat_calloc(most_inputs, sizeof *counts);
  qmat_status status = of_slots && counts ? QMAT_OK : qmat_fail_memory(context, "the counts of values");
  for (size_t i = 0; i < run->slot_count && status == QMAT_OK; i++)
    if (run->slots[i].step == SIZE_MAX) of_slots[i] = qmat_value_count(run->slots[i].value);
  for (size_t i = 0; i < run->step_count && status == QMAT_OK; i++) {
    const qmat_run_step *step = &run->steps[i];
    const qmat_graph_node *node = &run->graph->nodes[step->node];
    size_t lifted = 1;
    bool known = true;
    for (size_t port = 0; port < qmat_input_count(node->type); port++) {
      counts[port] = step->inputs[port] == SIZE_MAX ? 0 : of_slots[step->inputs[port]];
      if (step->inputs[port] != SIZE_MAX && counts[port] == 0) known = false;
      if (!node->type->inputs[port].list && counts[port] > lifted) lifted = counts[port];
    }
    for (size_t port = 0; port < qmat_output_count(node->type); port++) {
      const bool open = !known || (node->type->outputs[port].list && lifted == 1);
      of_slots[step->first_slot + port] = step->done ? step->made[port].items : open ? 0 : lifted;
    }
    if (i < next || !known || !node->type->check_counts) continue;
    context->node_id = node->id;
    context->node_type = node->type->name;
    status = node->type->check_counts(context, step->params, counts);
  }
  qmat_free(of_slots);
  qmat_free(counts);
  return status;
}

static qmat_status execute_step(qmat_executor *executor, size_t index, bool *named) {
  qmat_run *run = executor->run;
  qmat_run_step *step = &run->steps[index];
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  executor->context->node_id = node->id;
  executor->context->node_type = node->type->name;
  double start = qmat_clock_seconds();
  qmat_status status = QMAT_OK;
  if (qmat_run_look_up(run, index)) {
    qmat_executor_started(executor, index);
    step->seconds = qmat_clock_seconds() - start;
    step->done = true;
    qmat_executor_done(executor, index);
  } else {
    status = qmat_run_step_now(executor, index);
  }
  if (status == QMAT_OK) status = take_name(executor, step, named);
  if (status == QMAT_OK && made_list(node->type, step)) status = check_list_lengths(executor, index + 1);
  for (size_t port = 0; port < qmat_input_count(node->type); port++)
    if (step->inputs[port] != SIZE_MAX) run->slots[step->inputs[port]].readers--;
  if (status == QMAT_OK) qmat_run_drop_unread(run, index + 1);
  qmat_run_release_unread(run);
  return status;
}

static qmat_status execute_steps(qmat_executor *executor) {
  qmat_run *run = executor->run;
  qmat_status status = QMAT_OK;
  bool named = false;
  for (size_t i = 0; i < run->given_count; i++)
    if (run->given[i].value->type == QMAT_SCENE) named = true;
  for (size_t i = 0; i < run->step_count && status == QMAT_OK; i++) status = execute_step(executor, i, &named);
  for (size_t i = 0; i < run->slot_count && status == QMAT_OK; i++)
    if (run->slots[i].kept) status = qmat_need_value(executor, i);
  qmat_run_release_unread(run);
  return status;
}

/* The advice to state the unit of the model's file names the node that reads it, and goes where none does. */
static void fit_unit_advice(const qmat_run *run, qmat_error *error) {
  char *advice = strstr(error->hint, QMAT_UNIT_ADVICE);
  if (!advice) return;
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_graph_node *node = &run->graph->nodes[run->steps[i].node];
    if (strcmp(node->type->name, "scene.read") != 0) continue;
    if (strcmp(node->id, "model") != 0)
      snprintf(advice, sizeof error->hint - (size_t)(advice - error->hint),
               ", or state the file's unit: --set %s.unit=mm", node->id);
    return;
  }
  *advice = 0;
}

qmat_status qmat_run_execute(qmat_context *context, qmat_run *run, const qmat_run_observer *observer) {
  const char *outer_id = context->node_id, *outer_type = context->node_type;
  qmat_executor executor = {.context = context, .run = run, .observer = observer};
  double start = qmat_clock_seconds();
  qmat_status status = execute_steps(&executor);
  if (executor.unsteady) {
    /* Steps that ran before may have read the wrong bytes. */
    qmat_run_reset(run);
    run->bypass = true;
    status = execute_steps(&executor);
  }
  if (status != QMAT_OK) fit_unit_advice(run, &context->error);
  context->node_id = outer_id;
  context->node_type = outer_type;
  run->seconds = qmat_clock_seconds() - start;
  return status;
}

void qmat_run_foresee(qmat_run *run) {
  for (size_t i = 0; i < run->step_count; i++) {
    qmat_run_step *step = &run->steps[i];
    bool known = true;
    for (size_t port = 0; port < qmat_input_count(run->graph->nodes[step->node].type); port++)
      if (step->inputs[port] != SIZE_MAX && !run->slots[step->inputs[port]].known) known = false;
    if (!known || step->missing)
      step->state = QMAT_STEP_DEPENDS;
    else if (!qmat_run_look_up(run, i))
      step->state = QMAT_STEP_RUN;
    else
      qmat_run_drop_unread(run, i + 1);
  }
}
