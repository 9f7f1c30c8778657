/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_summary.h"

#include <math.h>
#include <string.h>

#include "core/json_text.h"

/* The count called `name` of the step's first connected input that has one. */
static size_t input_count(const qmat_run *run, const qmat_run_step *step, const char *name) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  for (size_t port = 0; port < qmat_input_count(type); port++) {
    if (step->inputs[port] == SIZE_MAX) continue;
    const size_t maker = run->slots[step->inputs[port]].step, first_given = run->slot_count - run->given_count;
    const qmat_value_count_row *rows = qmat_value_count_rows(type->inputs[port].type);
    size_t counts[QMAT_MOST_COUNTS];
    if (maker == SIZE_MAX)
      qmat_value_counts(run->given[step->inputs[port] - first_given].value, counts);
    else
      memcpy(counts, run->steps[maker].made[step->inputs[port] - run->steps[maker].first_slot].counts, sizeof counts);
    for (size_t i = 0; rows[i].name; i++)
      if (strcmp(rows[i].name, name) == 0 && counts[i] > 0) return counts[i];
  }
  return 0;
}

/* Merges one entry of a report into the summary. False when the report lacks a sum or a bound. */
static bool merge_entry(const qmat_summary_entry *entry, const json_t *report, bool first, json_t *summary) {
  const json_t *value = json_object_get(report, entry->key), *before = json_object_get(summary, entry->key);
  const double number = json_number_value(value);
  switch (entry->kind) {
    case QMAT_SUMMARY_SUM:
      if (!json_is_number(value) || !(number >= 0 && number < 0x1p53)) return false;
      json_object_set_new(summary, entry->key, json_integer(json_integer_value(before) + (json_int_t)number));
      return true;
    case QMAT_SUMMARY_BOUND:
      if (!json_is_number(value)) return false;
      json_object_set_new(summary, entry->key, json_real(first ? number : fmax(number, json_real_value(before))));
      return true;
    case QMAT_SUMMARY_SIZE:
      if (json_is_number(value) && (first || before))
        json_object_set_new(summary, entry->key, json_real(first ? number : fmax(number, json_real_value(before))));
      else
        json_object_del(summary, entry->key);
      return true;
    case QMAT_SUMMARY_ALL:
      if (json_is_boolean(value) && (first || before))
        json_object_set_new(summary, entry->key, json_boolean(json_is_true(value) && (first || json_is_true(before))));
      else
        json_object_del(summary, entry->key);
      return true;
    case QMAT_SUMMARY_ANY:
      if (json_is_true(value)) json_object_set_new(summary, entry->key, json_true());
      return true;
    case QMAT_SUMMARY_INPUT:
      return true;
  }
  return false;
}

static bool merge_report(const qmat_report_summary *type, const json_t *report, bool first, json_t *summary) {
  bool whole = true;
  for (size_t i = 0; type->entries[i].key && whole; i++) whole = merge_entry(&type->entries[i], report, first, summary);
  return whole;
}

void qmat_summary_add(const qmat_report_summary *type, const json_t *summary, json_t *total) {
  const bool first = json_object_size(total) == 0;
  for (const qmat_summary_entry *entry = type->entries; entry->key; entry++) {
    const json_int_t sum = json_integer_value(json_object_get(total, entry->key)) +
                           json_integer_value(json_object_get(summary, entry->key));
    if (entry->kind == QMAT_SUMMARY_INPUT)
      json_object_set_new(total, entry->key, json_integer(sum));
    else
      merge_entry(entry, summary, first, total);
  }
}

/* The summary of one step, or NULL. */
static json_t *summarise_step(const qmat_run *run, const qmat_run_step *step) {
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  const qmat_report_summary *type = node->type->report_summary;
  const json_t *meshes = json_object_get(step->report, "meshes");
  json_t *summary = json_object();
  json_object_set_new(summary, "name", qmat_json_string(run->name));
  json_object_set_new(summary, "node", json_string(node->id));
  for (size_t i = 0; type->entries[i].key; i++) {
    const char *key = type->entries[i].key;
    if (type->entries[i].kind == QMAT_SUMMARY_INPUT) qmat_json_set_count(summary, key, input_count(run, step, key));
  }
  size_t merged = 0, failures = 0;
  bool whole = meshes || merge_report(type, step->report, true, summary);
  for (size_t k = 0; k < json_array_size(meshes) && whole; k++) {
    const json_t *of_mesh = json_array_get(meshes, k);
    if (json_object_get(of_mesh, "failure"))
      failures++;
    else
      whole = merge_report(type, json_object_get(of_mesh, "report"), merged++ == 0, summary);
  }
  if (merged + failures > 1) qmat_json_set_count(summary, "meshes", merged);
  if (failures > 0) qmat_json_set_count(summary, "failures", failures);
  if (whole && summary) return summary;
  json_decref(summary);
  return NULL;
}

static bool makes_files(const qmat_run *run, const qmat_run_step *step) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  for (size_t port = 0; port < qmat_output_count(type); port++)
    if (type->outputs[port].type == QMAT_FILE) return true;
  return false;
}

/* Marks a step and the steps that it needs. `marks` has one element per step. */
static void mark_needed(const qmat_run *run, size_t last, bool *marks) {
  memset(marks, 0, run->step_count * sizeof *marks);
  marks[last] = true;
  for (size_t i = last + 1; i-- > 0;) {
    const qmat_run_step *step = &run->steps[i];
    for (size_t port = 0; marks[i] && port < qmat_input_count(run->graph->nodes[step->node].type); port++) {
      const size_t maker = step->inputs[port] == SIZE_MAX ? SIZE_MAX : run->slots[step->inputs[port]].step;
      if (maker != SIZE_MAX) marks[maker] = true;
    }
  }
}

/* Replaces bounds and flags by those that the files made of `summarised` state: storage changes what is stored. */
static void merge_written(const qmat_run *run, size_t summarised, bool *marks, json_t *summary) {
  const qmat_report_summary *type = run->graph->nodes[run->steps[summarised].node].type->report_summary;
  bool first = true;
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_run_step *step = &run->steps[i];
    if (!step->done || !step->report || run->graph->nodes[step->node].type->report_summary != type) continue;
    if (!makes_files(run, step)) continue;
    mark_needed(run, i, marks);
    json_t *written = marks[summarised] ? summarise_step(run, step) : NULL;
    for (const qmat_summary_entry *entry = type->entries; written && entry->key; entry++) {
      const bool is_bound = entry->kind == QMAT_SUMMARY_BOUND || entry->kind == QMAT_SUMMARY_SIZE;
      if (is_bound || (entry->kind == QMAT_SUMMARY_ALL && json_object_get(summary, entry->key)))
        merge_entry(entry, written, first && is_bound, summary);
    }
    first = first && !written;
    json_decref(written);
  }
}

json_t *qmat_run_summarise(const qmat_run *run, size_t file, char *text, size_t size) {
  const size_t maker = file < run->file_count ? run->slots[run->files[file].slot].step : SIZE_MAX;
  bool *marks = qmat_alloc(run->step_count, sizeof *marks);
  json_t *summary = NULL;
  if (marks && maker != SIZE_MAX) mark_needed(run, maker, marks);
  for (size_t i = run->step_count; marks && !summary && i-- > 0;) {
    const qmat_run_step *step = &run->steps[i];
    const qmat_report_summary *type = run->graph->nodes[step->node].type->report_summary;
    if (!step->done || !step->report || !type || makes_files(run, step)) continue;
    if (maker == SIZE_MAX || marks[i]) summary = summarise_step(run, step);
    if (!summary) continue;
    merge_written(run, i, marks, summary);
    type->sentence(run->name, summary, text, size);
  }
  qmat_free(marks);
  return summary;
}
