/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

double qmat_clock_seconds(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

const char *qmat_step_state_name(qmat_step_state state) {
  static const char *const names[] = {"run", "hit", "same", "depends"};
  return names[state];
}

const char *qmat_step_state_words(qmat_step_state state, bool ran) {
  static const char *const words[] = {"ran", "from cache", "unchanged", "depends"};
  return state == QMAT_STEP_RUN && !ran ? "to run" : words[state];
}

void qmat_step_describe_missing(const qmat_graph *graph, const qmat_run_step *step, char *text, size_t size) {
  text[0] = 0;
  if (!step->missing) return;
  const char *input = qmat_graph_input_name(graph, step->node, step->missing);
  char option[2 * QMAT_GRAPH_NAME_SIZE + 16];
  qmat_graph_set_option(graph, step->node, step->missing, option, sizeof option);
  snprintf(text, size, "%s: not given (%s)", input ? input : step->missing->name, option);
}

const qmat_value *qmat_run_value(const qmat_run *run, size_t node, size_t port) {
  for (size_t i = 0; i < run->given_count; i++)
    if (run->given[i].node == node && run->given[i].port == port) return run->given[i].value;
  for (size_t i = 0; i < run->step_count; i++)
    if (run->steps[i].node == node) return run->slots[run->steps[i].first_slot + port].value;
  return NULL;
}

void qmat_run_count_readers(qmat_run *run) {
  for (size_t i = 0; i < run->slot_count; i++) run->slots[i].readers = 0;
  for (size_t i = 0; i < run->step_count; i++)
    for (size_t port = 0; port < qmat_input_count(run->graph->nodes[run->steps[i].node].type); port++)
      if (run->steps[i].inputs[port] != SIZE_MAX) run->slots[run->steps[i].inputs[port]].readers++;
}

static void release_slot(qmat_run_slot *slot) {
  qmat_value_release(slot->value);
  slot->value = NULL;
}

void qmat_run_release_unread(qmat_run *run) {
  for (size_t i = 0; i < run->slot_count; i++)
    if (run->slots[i].readers == 0 && !run->slots[i].kept) release_slot(&run->slots[i]);
}

void qmat_run_reset(qmat_run *run) {
  qmat_run_count_readers(run);
  for (size_t i = 0; i < run->slot_count; i++) {
    if (run->slots[i].step == SIZE_MAX) continue;
    release_slot(&run->slots[i]);
    run->slots[i].known = false;
  }
  for (size_t i = 0; i < run->step_count; i++) {
    json_decref(run->steps[i].report);
    run->steps[i].report = NULL;
    run->steps[i].done = false;
    run->steps[i].state = QMAT_STEP_RUN;
  }
}

qmat_status qmat_step_init(qmat_context *context, const qmat_graph *graph, size_t node, const void *params, int format,
                           qmat_run_step *step) {
  const qmat_node *type = graph->nodes[node].type;
  step->node = node;
  step->format = format;
  step->params = qmat_alloc(type->params_size, 1);
  step->inputs = qmat_calloc(qmat_input_count(type), sizeof *step->inputs);
  step->made = qmat_calloc(qmat_output_count(type), sizeof *step->made);
  if (!step->params || !step->inputs || !step->made) return qmat_fail_memory(context, "plan");
  if (type->params_size > 0) memcpy(step->params, params ? params : graph->nodes[node].params, type->params_size);
  return QMAT_OK;
}

void qmat_step_uninit(qmat_run_step *step) {
  qmat_free(step->params);
  qmat_free(step->inputs);
  qmat_free(step->made);
  json_decref(step->report);
  json_decref(step->key_items);
}

void qmat_run_uninit(qmat_run *run) {
  for (size_t i = 0; i < run->step_count; i++) qmat_step_uninit(&run->steps[i]);
  for (size_t i = 0; i < run->hashed_count; i++) qmat_free(run->hashed[i].path);
  qmat_free(run->hashed);
  for (size_t i = 0; run->slots && i < run->slot_count; i++) release_slot(&run->slots[i]);
  for (size_t i = 0; i < run->file_count; i++) {
    qmat_free(run->files[i].path);
    if (run->files[i].written) qmat_value_release(&run->files[i].written->base);
  }
  qmat_free(run->steps);
  qmat_free(run->slots);
  qmat_free(run->files);
  qmat_free(run->given);
  *run = (qmat_run){0};
}

/* Appends a report's warnings to a list, each with the report's name before it. */
static bool add_warnings(json_t *all, const char *name, const json_t *report) {
  const json_t *own = json_object_get(report, "warnings");
  for (size_t i = 0; i < json_array_size(own); i++) {
    const char *text = json_string_value(json_array_get(own, i));
    if (text && json_array_append_new(all, json_sprintf("%s: %s", name, text)) != 0) return false;
  }
  return true;
}

json_t *qmat_report_json(const qmat_value *report) {
  if (report->type != QMAT_LIST) return json_incref(((const qmat_report *)report)->root);
  const qmat_list *list = (const qmat_list *)report;
  json_t *all = json_array(), *warnings = json_array(), *root = json_object();
  bool done = all && warnings && root;
  for (size_t i = 0; i < list->count && done; i++) {
    const char *failure = qmat_value_failure(list->items[i]);
    json_t *one = failure ? NULL : ((const qmat_report *)list->items[i])->root;
    json_t *of_item = failure ? json_pack("{s:s, s:s}", "name", list->names[i], "failure", failure)
                              : json_pack("{s:s, s:O}", "name", list->names[i], "report", one);
    done = json_array_append_new(all, of_item) == 0 && add_warnings(warnings, list->names[i], one);
  }
  done = done && json_object_set(root, "meshes", all) == 0;
  if (json_array_size(warnings) > 0) done = done && json_object_set(root, "warnings", warnings) == 0;
  json_decref(all);
  json_decref(warnings);
  if (done) return root;
  json_decref(root);
  return NULL;
}
