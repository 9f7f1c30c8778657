/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_step.h"

#include "graphs/run/run_cache.h"
#include "graphs/run/run_lists.h"

/* Takes the outputs of a step that has run. False when the cache has other bytes for them: a step that ran before may
 * have read those. */
static bool take_outputs(qmat_run *run, qmat_run_step *step, qmat_value *const *outputs) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  bool steady = true;
  for (size_t port = 0; port < qmat_output_count(type); port++) {
    qmat_run_slot *slot = &run->slots[step->first_slot + port];
    qmat_run_made *made = &step->made[port];
    bool same = slot->known && qmat_digest_equal(&slot->digest, &outputs[port]->digest);
    if (slot->known && !same) steady = false;
    /* A waiting step may already hold the value from the cache, so that value stays. */
    if (slot->value && same) {
      qmat_value_release(outputs[port]);
    } else {
      qmat_value_release(slot->value);
      slot->value = outputs[port];
    }
    slot->digest = made->digest = slot->value->digest;
    slot->known = true;
    made->bytes = qmat_value_bytes(slot->value);
    made->items = qmat_value_count(slot->value);
    qmat_value_counts(slot->value, made->counts);
    if (type->outputs[port].type == QMAT_REPORT && !step->report) step->report = qmat_report_json(slot->value);
  }
  step->done = true;
  step->state = QMAT_STEP_RUN;
  return steady;
}

static void lock_cache(const qmat_executor *executor) {
  if (executor->lock) pthread_mutex_lock(executor->lock);
}

static void unlock_cache(const qmat_executor *executor) {
  if (executor->lock) pthread_mutex_unlock(executor->lock);
}

qmat_status qmat_need_value(qmat_executor *executor, size_t index) {
  qmat_run_slot *slot = &executor->run->slots[index];
  if (slot->value) return QMAT_OK;
  lock_cache(executor);
  slot->value = qmat_run_load(executor->run, slot->step, index - executor->run->steps[slot->step].first_slot);
  unlock_cache(executor);
  return slot->value ? QMAT_OK : qmat_run_step_now(executor, slot->step);
}

void qmat_executor_started(const qmat_executor *executor, size_t index) {
  const qmat_run_observer *observer = executor->observer;
  if (observer && observer->started) observer->started(observer->user, executor->run, index);
}

void qmat_executor_done(const qmat_executor *executor, size_t index) {
  const qmat_run_observer *observer = executor->observer;
  if (observer && observer->done) observer->done(observer->user, executor->run, index);
}

/* The qmat_make_item_fn of an executor: the step of `one` from the cache, else by running it. */
static qmat_status make_item(void *user, qmat_context *context, qmat_run *one, pthread_mutex_t *lock, bool *hit) {
  qmat_executor *outer = user, executor = {.context = context, .run = one, .lock = lock};
  lock_cache(&executor);
  *hit = qmat_run_look_up(one, 0);
  unlock_cache(&executor);
  qmat_status status = *hit ? QMAT_OK : qmat_run_step_now(&executor, 0);
  const size_t output_count = qmat_output_count(one->graph->nodes[one->steps[0].node].type);
  for (size_t port = 0; port < output_count && status == QMAT_OK; port++) status = qmat_need_value(&executor, port);
  pthread_mutex_lock(lock);
  if (executor.unsteady) outer->unsteady = true;
  pthread_mutex_unlock(lock);
  return status;
}

qmat_status qmat_run_step_now(qmat_executor *executor, size_t index) {
  qmat_context *context = executor->context;
  qmat_run *run = executor->run;
  qmat_run_step *step = &run->steps[index];
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  size_t input_count = qmat_input_count(node->type), output_count = qmat_output_count(node->type);
  const qmat_value **inputs = qmat_calloc(input_count, sizeof *inputs);
  qmat_value **outputs = qmat_calloc(output_count, sizeof *outputs);
  qmat_step_reads reads = {0};
  qmat_status status = inputs && outputs ? QMAT_OK : qmat_fail_memory(context, "values");
  for (size_t port = 0; port < input_count && status == QMAT_OK; port++) {
    if (step->inputs[port] == SIZE_MAX) continue;
    status = qmat_need_value(executor, step->inputs[port]);
    inputs[port] = run->slots[step->inputs[port]].value;
  }
  if (status != QMAT_OK) goto cleanup;
  context->node_id = node->id;
  context->node_type = node->type->name;
  size_t lifted;
  const qmat_list *first_list;
  status = qmat_count_lifted(context, node->type, inputs, &lifted, &first_list);
  if (status != QMAT_OK) goto cleanup;
  qmat_executor_started(executor, index);
  double start = qmat_clock_seconds();
  if (lifted > 0) {
    status = qmat_run_lifted(context, run, index, inputs, first_list, make_item, executor, outputs);
  } else {
    context->file_read = qmat_step_note_read;
    context->file_read_user = &reads;
    status = qmat_node_run(context, node->type, step->params, inputs, outputs);
    context->file_read = NULL;
  }
  step->seconds = qmat_clock_seconds() - start;
  if (status != QMAT_OK) goto cleanup;
  if (!take_outputs(run, step, outputs)) {
    executor->unsteady = true;
    status = qmat_fail(context, QMAT_ERROR_INTERNAL,
                       "the node's new result differs from its cached one: it does not depend on its inputs alone");
    goto cleanup;
  }
  lock_cache(executor);
  qmat_run_store(run, index, &reads);
  unlock_cache(executor);
  qmat_executor_done(executor, index);
cleanup:
  qmat_run_note_reads(run, &reads);
  qmat_step_reads_uninit(&reads);
  qmat_free(inputs);
  qmat_free(outputs);
  return status;
}
