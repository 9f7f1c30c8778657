/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/graph_run.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/json_text.h"
#include "graphs/run/parallel_items.h"
#include "graphs/run/run_cache.h"
#include "io/save.h"

static double now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

const char *qmat_step_state_name(qmat_step_state state) {
  static const char *const names[] = {"run", "hit", "same", "depends"};
  return names[state];
}

const char *const *qmat_value_count_names(qmat_value_type type) {
  static const char *const none[] = {NULL}, *const mesh[] = {"vertices", "triangles", NULL},
                           *const field[] = {"values", NULL}, *const samples[] = {"samples", NULL},
                           *const medial[] = {"spheres", "cones", "slabs", NULL}, *const file[] = {"parts", NULL},
                           *const chain[] = {"spheres", "collapses", NULL};
  switch (type) {
    case QMAT_MESH:
      return mesh;
    case QMAT_FIELD:
      return field;
    case QMAT_SAMPLES:
      return samples;
    case QMAT_MEDIAL:
      return medial;
    case QMAT_CHAIN:
      return chain;
    case QMAT_FILE:
      return file;
    default:
      return none;
  }
}

void qmat_value_counts(const qmat_value *value, size_t counts[3]) {
  counts[0] = counts[1] = counts[2] = 0;
  for (size_t i = 0; value->type == QMAT_LIST && i < qmat_value_count(value); i++) {
    size_t of_item[3];
    qmat_value_counts(qmat_value_at(value, i), of_item);
    for (int k = 0; k < 3; k++) counts[k] += of_item[k];
  }
  switch (value->type) {
    case QMAT_MESH:
      counts[0] = ((const qmat_mesh *)value)->vertex_count;
      counts[1] = ((const qmat_mesh *)value)->triangle_count;
      break;
    case QMAT_FIELD:
      counts[0] = ((const qmat_field *)value)->count;
      break;
    case QMAT_SAMPLES:
      counts[0] = ((const qmat_samples *)value)->count;
      break;
    case QMAT_MEDIAL:
      counts[0] = ((const qmat_medial *)value)->sphere_count;
      counts[1] = ((const qmat_medial *)value)->edge_count;
      counts[2] = ((const qmat_medial *)value)->triangle_count;
      break;
    case QMAT_CHAIN:
      counts[0] = ((const qmat_chain *)value)->sphere_count;
      counts[1] = ((const qmat_chain *)value)->collapse_count;
      break;
    case QMAT_FILE:
      counts[0] = ((const qmat_file *)value)->part_count;
      break;
    default:
      break;
  }
}

/* Adds a report's warnings to a list, with what each is of. */
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

/* ---- paths ---- */

size_t qmat_folder_length(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? (size_t)(slash - path) + 1 : 0;
}

/* The folder of `path` as one that can be asked about; the caller frees it with qmat_free. */
static char *folder_of(const char *path) {
  size_t length = qmat_folder_length(path);
  char *folder = qmat_calloc(length + 2, 1);
  if (!folder) return NULL;
  if (length == 0)
    folder[0] = '.';
  else
    memcpy(folder, path, length);
  return folder;
}

bool qmat_same_file(const char *a, const char *b) {
  struct stat first, second;
  bool first_is = stat(a, &first) == 0, second_is = stat(b, &second) == 0;
  if (first_is && second_is) return first.st_dev == second.st_dev && first.st_ino == second.st_ino;
  if (first_is != second_is || strcmp(a + qmat_folder_length(a), b + qmat_folder_length(b)) != 0) return false;
  char *first_folder = folder_of(a), *second_folder = folder_of(b);
  bool same = first_folder && second_folder && stat(first_folder, &first) == 0 && stat(second_folder, &second) == 0 &&
              first.st_dev == second.st_dev && first.st_ino == second.st_ino;
  qmat_free(first_folder);
  qmat_free(second_folder);
  return same;
}

/* Refuses a path that is the graph file or a file that a step reads. */
static qmat_status check_not_an_input(qmat_context *context, const qmat_run *run, const char *what, const char *path) {
  if (qmat_same_file(path, run->graph->file)) {
    return qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite the graph file", what, path);
  }
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_graph_node *node = &run->graph->nodes[run->steps[i].node];
    for (size_t row = 0; row < qmat_param_count(node->type); row++) {
      const qmat_param *param = &node->type->params[row];
      if (param->type != QMAT_PARAM_PATH || !(param->flags & QMAT_PARAM_INPUT_FILE)) continue;
      const char *input;
      memcpy(&input, (const char *)run->steps[i].params + param->offset, sizeof input);
      if (input && qmat_same_file(path, input)) {
        return qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite the file that node '%s' reads", what, path,
                         node->id);
      }
    }
  }
  return QMAT_OK;
}

/* So that a run of minutes does not end in a mistyped folder. */
static qmat_status check_can_write(qmat_context *context, const char *path) {
  struct stat info;
  qmat_status status = QMAT_OK;
  char *folder = folder_of(path);
  if (!folder) return qmat_fail_memory(context, "output path");
  if (stat(folder, &info) != 0)
    qmat_fail(context, status = QMAT_ERROR_IO, "the folder of the output cannot be used: %s", strerror(errno));
  else if (!S_ISDIR(info.st_mode))
    qmat_fail(context, status = QMAT_ERROR_IO, "what should be the folder of the output is a file");
  else if (access(folder, W_OK | X_OK) != 0)
    qmat_fail(context, status = QMAT_ERROR_IO, "the folder of the output cannot be written to: %s", strerror(errno));
  else if (stat(path, &info) == 0 && S_ISDIR(info.st_mode))
    qmat_fail(context, status = QMAT_ERROR_IO, "the output is a folder");
  qmat_free(folder);
  return status == QMAT_OK ? status : qmat_fail_at(context, path, 0, 0);
}

qmat_status qmat_run_check_path(qmat_context *context, const qmat_run *run, const char *what, const char *path) {
  qmat_status status = check_not_an_input(context, run, what, path);
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++)
    if (qmat_same_file(path, run->files[i].path))
      status = qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite output '%s'", what, path,
                         run->graph->outputs[run->files[i].output].name);
  return status == QMAT_OK ? check_can_write(context, path) : status;
}

/* ---- planning ---- */

typedef struct run_planner {
  qmat_context *context;
  const qmat_graph *graph;
  const qmat_run_options *options;
  qmat_run *run;
  int *formats;      /* per file: the format that its step runs in, or -1 */
  bool *within;      /* per node: it is --to's node or comes before it */
  bool *replaced;    /* per node: values are given for it */
  bool *needed;      /* per node: it runs with its own parameters */
  size_t *base_step; /* per node: the step that does so */
} run_planner;

static int choice_of(const qmat_node *type, const void *params) {
  const qmat_param *format = qmat_output_format_param(type);
  int choice = -1;
  if (format) memcpy(&choice, (const char *)params + format->offset, sizeof choice);
  return choice;
}

/* Marks `start` and what it depends on. */
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
    return qmat_fail(planner->context, QMAT_ERROR_USAGE, "output '%s' is made after node '%s', where the run stops",
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
  for (size_t i = 0; i < graph->output_count && !options->only_wanted; i++) {
    const qmat_graph_output *output = &graph->outputs[i];
    if (!output->path || has_save(options, i) || !planner->within[output->node]) continue;
    qmat_status status = add_file(planner, i, output->path, &planner->formats[run->file_count]);
    if (status != QMAT_OK)
      return qmat_fail_at(planner->context, graph->file, output->path_mark.line, output->path_mark.column);
  }
  return QMAT_OK;
}

/* Whether file `index` is the first of its node that asks for its format, and the node does not run in it anyway. */
static bool asks_for_step(const run_planner *planner, size_t index) {
  const qmat_graph *graph = planner->graph;
  size_t node = graph->outputs[planner->run->files[index].output].node;
  int format = planner->formats[index];
  if (planner->replaced[node]) return false;
  if (planner->needed[node] && choice_of(graph->nodes[node].type, graph->nodes[node].params) == format) return false;
  for (size_t i = 0; i < index; i++)
    if (graph->outputs[planner->run->files[i].output].node == node && planner->formats[i] == format) return false;
  return true;
}

static void plan_needs(run_planner *planner) {
  const qmat_graph *graph = planner->graph;
  const qmat_run_options *options = planner->options;
  for (size_t i = 0; i < options->want_count; i++) planner->needed[options->wants[i].node] = true;
  if (options->to_node) {
    for (size_t i = 0; i < graph->node_count; i++)
      if (strcmp(graph->nodes[i].id, options->to_node) == 0) planner->needed[i] = true;
  } else if (!options->only_wanted) {
    for (size_t i = 0; i < graph->output_count; i++) {
      bool saved = has_save(options, i) || graph->outputs[i].path;
      if (!saved) planner->needed[graph->outputs[i].node] = true;
    }
    for (size_t i = 0; i < graph->node_count; i++)
      if (qmat_output_count(graph->nodes[i].type) == 0) planner->needed[i] = true;
  }
  for (size_t k = graph->node_count; k-- > 0;) {
    size_t index = graph->order[k];
    bool runs = planner->needed[index];
    for (size_t i = 0; i < planner->run->file_count; i++)
      if (graph->outputs[planner->run->files[i].output].node == index) runs = true;
    if (!runs || planner->replaced[index]) continue;
    const qmat_graph_node *node = &graph->nodes[index];
    for (size_t port = 0; port < qmat_input_count(node->type); port++)
      if (node->links[port].node != SIZE_MAX) planner->needed[node->links[port].node] = true;
  }
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
  *step = (qmat_run_step){
      .node = index, .format = format, .first_slot = run->slot_count, .forced = is_forced(planner->options, index)};
  size_t outputs = qmat_output_count(node->type);
  run->slot_count += outputs;
  step->params = qmat_calloc(1, node->type->params_size);
  step->inputs = qmat_calloc(qmat_input_count(node->type), sizeof *step->inputs);
  step->made = qmat_calloc(outputs, sizeof *step->made);
  if (!step->params || !step->inputs || !step->made) return qmat_fail_memory(planner->context, "plan");
  if (node->type->params_size > 0) memcpy(step->params, node->params, node->type->params_size);
  const qmat_param *param = qmat_output_format_param(node->type);
  if (param) memcpy((char *)step->params + param->offset, &format, sizeof format);
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
    }
    for (size_t i = 0; i < run->file_count; i++) {
      if (graph->outputs[run->files[i].output].node != index || !asks_for_step(planner, i)) continue;
      qmat_status status = add_step(planner, index, planner->formats[i]);
      if (status != QMAT_OK) return status;
    }
  }
  return QMAT_OK;
}

/* The slot of an output port of a node that runs with its own parameters, or whose value is given. */
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

static void count_readers(qmat_run *run) {
  for (size_t i = 0; i < run->slot_count; i++) run->slots[i].readers = 0;
  for (size_t i = 0; i < run->step_count; i++)
    for (size_t port = 0; port < qmat_input_count(run->graph->nodes[run->steps[i].node].type); port++)
      if (run->steps[i].inputs[port] != SIZE_MAX) run->slots[run->steps[i].inputs[port]].readers++;
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
      if (link->node == SIZE_MAX) continue;
      status = find_slot(planner, link->node, link->port, &step->inputs[port]);
      if (status != QMAT_OK) return status;
    }
  }
  count_readers(run);
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
  *run = (qmat_run){.graph = graph, .cache = options->cache};
  run_planner planner = {.context = context, .graph = graph, .options = options, .run = run};
  planner.within = qmat_calloc(graph->node_count, sizeof *planner.within);
  planner.replaced = qmat_calloc(graph->node_count, sizeof *planner.replaced);
  planner.needed = qmat_calloc(graph->node_count, sizeof *planner.needed);
  planner.base_step = qmat_calloc(graph->node_count, sizeof *planner.base_step);
  qmat_status status = QMAT_OK;
  if (!planner.within || !planner.replaced || !planner.needed || !planner.base_step) {
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
  plan_needs(&planner);
  status = plan_steps(&planner);
  if (status == QMAT_OK) status = plan_slots(&planner);
  if (status != QMAT_OK) goto cleanup;
  name_run(run);
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++) {
    char what[QMAT_GRAPH_NAME_SIZE + 16];
    snprintf(what, sizeof what, "output '%s':", graph->outputs[run->files[i].output].name);
    status = check_not_an_input(context, run, what, run->files[i].path);
    if (status == QMAT_OK) status = check_can_write(context, run->files[i].path);
  }
cleanup:
  qmat_free(planner.formats);
  qmat_free(planner.within);
  qmat_free(planner.replaced);
  qmat_free(planner.needed);
  qmat_free(planner.base_step);
  return status;
}

/* ---- running ---- */

static void release_slot(qmat_run_slot *slot) {
  qmat_value_release(slot->value);
  slot->value = NULL;
}

/* Lets go of what nobody reads any more. */
static void release_unread(qmat_run *run) {
  for (size_t i = 0; i < run->slot_count; i++)
    if (run->slots[i].readers == 0 && !run->slots[i].kept) release_slot(&run->slots[i]);
}

/* Takes the outputs of a step that has run. False when a node before it was told to read something else: the cache had
 */
/* other bytes for this step than it makes. */
static bool take_outputs(qmat_run *run, qmat_run_step *step, qmat_value *const *outputs) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  bool steady = true;
  for (size_t port = 0; port < qmat_output_count(type); port++) {
    qmat_run_slot *slot = &run->slots[step->first_slot + port];
    qmat_run_made *made = &step->made[port];
    bool same = slot->known && qmat_digest_equal(&slot->digest, &outputs[port]->digest);
    if (slot->known && !same) steady = false;
    /* A step that waits for another output of this one may already have taken the value that is there. */
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

/* One execution of a plan. */
typedef struct executor {
  qmat_context *context;
  qmat_run *run;
  const qmat_run_observer *observer;
  bool unsteady;         /* a node made other bytes than the cache had of it */
  pthread_mutex_t *lock; /* held while the cache is used; NULL: no other executor uses it */
} executor;

static qmat_status run_step(executor *executor, size_t index);

static void lock_cache(const executor *executor) {
  if (executor->lock) pthread_mutex_lock(executor->lock);
}

static void unlock_cache(const executor *executor) {
  if (executor->lock) pthread_mutex_unlock(executor->lock);
}

/* Sees to it that a value is there: from the cache, or else by running the step that makes it. */
static qmat_status need_value(executor *executor, size_t index) {
  qmat_run_slot *slot = &executor->run->slots[index];
  if (slot->value) return QMAT_OK;
  lock_cache(executor);
  slot->value = qmat_run_load(executor->run, slot->step, index - executor->run->steps[slot->step].first_slot);
  unlock_cache(executor);
  return slot->value ? QMAT_OK : run_step(executor, slot->step);
}

static void tell_started(const executor *executor, size_t index) {
  const qmat_run_observer *observer = executor->observer;
  if (observer && observer->started) observer->started(observer->user, executor->run, index);
}

static void tell_done(const executor *executor, size_t index) {
  const qmat_run_observer *observer = executor->observer;
  if (observer && observer->done) observer->done(observer->user, executor->run, index);
}

/* Finds how many values the lists have that a node cannot take whole; 0: none is given. */
static qmat_status count_lifted(qmat_context *context, const qmat_node *type, const qmat_value *const *inputs,
                                size_t *count, const qmat_list **first) {
  *count = 0;
  *first = NULL;
  for (size_t port = 0; port < qmat_input_count(type); port++) {
    if (!inputs[port] || inputs[port]->type != QMAT_LIST || type->inputs[port].list) continue;
    const size_t here = qmat_value_count(inputs[port]);
    if (*count > 0 && here != *count) {
      qmat_fail(context, QMAT_ERROR_USAGE, "a list of %zu is given beside one of %zu", here, *count);
      return qmat_fail_field(context, type->inputs[port].name);
    }
    if (*count == 0) *first = (const qmat_list *)inputs[port];
    *count = here;
  }
  return QMAT_OK;
}

/* A run of one step: `step` with value `item` of each list that it is given. Its outputs' slots come first. */
static qmat_status plan_item(qmat_context *context, const qmat_run *run, const qmat_run_step *step,
                             const qmat_value *const *inputs, size_t item, qmat_run *one) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  const size_t output_count = qmat_output_count(type), input_count = qmat_input_count(type);
  *one = (qmat_run){.graph = run->graph, .cache = run->cache, .bypass = run->bypass};
  one->steps = qmat_calloc(1, sizeof *one->steps);
  one->slots = qmat_calloc(output_count + input_count, sizeof *one->slots);
  if (!one->steps || !one->slots) return qmat_fail_memory(context, "plan");
  qmat_run_step *own = &one->steps[0];
  *own = (qmat_run_step){.node = step->node, .format = step->format, .forced = step->forced};
  one->step_count = 1;
  one->slot_count = output_count + input_count;
  own->inputs = qmat_calloc(input_count, sizeof *own->inputs);
  own->made = qmat_calloc(output_count, sizeof *own->made);
  own->params = qmat_alloc(type->params_size, 1);
  if (!own->inputs || !own->made || !own->params) return qmat_fail_memory(context, "plan");
  if (type->params_size > 0) memcpy(own->params, step->params, type->params_size);
  for (size_t port = 0; port < output_count; port++) one->slots[port].kept = true;
  for (size_t port = 0; port < input_count; port++) {
    own->inputs[port] = SIZE_MAX;
    if (!inputs[port]) continue;
    const qmat_value *value = type->inputs[port].list ? inputs[port] : qmat_value_at(inputs[port], item);
    own->inputs[port] = output_count + port;
    one->slots[output_count + port] = (qmat_run_slot){
        .value = qmat_value_retain(value), .digest = value->digest, .known = true, .step = SIZE_MAX, .kept = true};
  }
  return QMAT_OK;
}

/* A step that runs once for each value of the lists that it is given. */
typedef struct lifted_step {
  executor *outer;
  size_t step;
  const qmat_value *const *inputs;
  qmat_list **outputs;
  pthread_mutex_t lock;   /* of the cache, of what the items count in the outer run, and of the next two */
  size_t first_unusable;  /* the first item that the node cannot work on; SIZE_MAX: none */
  qmat_error first_error; /* why */
} lifted_step;

/* What cannot be made of one item stands as a failure in the lists; the others go on. */
static qmat_status leave_out(lifted_step *lifted, qmat_context *context, size_t item, const qmat_value *failure) {
  const qmat_run *run = lifted->outer->run;
  qmat_run_step *step = &lifted->outer->run->steps[lifted->step];
  qmat_value *made = failure ? qmat_value_retain(failure) : qmat_failure_of_error(context);
  if (!made) return context->error.status;
  for (size_t port = 0; port < qmat_output_count(run->graph->nodes[step->node].type); port++)
    lifted->outputs[port]->items[item] = qmat_value_retain(made);
  qmat_value_release(made);
  pthread_mutex_lock(&lifted->lock);
  if (failure) step->lifted_left_out++;
  if (!failure && item < lifted->first_unusable) {
    lifted->first_unusable = item;
    lifted->first_error = context->error;
  }
  pthread_mutex_unlock(&lifted->lock);
  return QMAT_OK;
}

/* Runs a step for one value of each list, or takes what the cache has of that. One of the threads of qmat_run_items. */
static qmat_status run_item(void *user, qmat_context *context, size_t item) {
  lifted_step *lifted = user;
  const qmat_run *run = lifted->outer->run;
  qmat_run_step *step = &lifted->outer->run->steps[lifted->step];
  const qmat_node *type = run->graph->nodes[step->node].type;
  for (size_t port = 0; port < qmat_input_count(type); port++) {
    if (!lifted->inputs[port] || type->inputs[port].list) continue;
    const qmat_value *given = qmat_value_at(lifted->inputs[port], item);
    if (qmat_value_failure(given)) return leave_out(lifted, context, item, given);
  }
  qmat_run one;
  executor executor = {.context = context, .run = &one, .lock = &lifted->lock};
  bool hit = false;
  qmat_status status = plan_item(context, run, step, lifted->inputs, item, &one);
  if (status == QMAT_OK) {
    lock_cache(&executor);
    hit = qmat_run_look_up(&one, 0);
    unlock_cache(&executor);
    if (!hit) status = run_step(&executor, 0);
  }
  for (size_t port = 0; port < qmat_output_count(type) && status == QMAT_OK; port++) {
    status = need_value(&executor, port);
    lifted->outputs[port]->items[item] = qmat_value_retain(one.slots[port].value);
  }
  pthread_mutex_lock(&lifted->lock);
  if (hit) step->lifted_hits++;
  if (executor.unsteady) lifted->outer->unsteady = true;
  pthread_mutex_unlock(&lifted->lock);
  qmat_run_uninit(&one);
  return status == QMAT_ERROR_GEOMETRY ? leave_out(lifted, context, item, NULL) : status;
}

/* The bytes of the values that a step is given for one item. */
static size_t item_size(const qmat_node *type, const qmat_value *const *inputs, size_t item) {
  size_t size = 0;
  for (size_t port = 0; port < qmat_input_count(type); port++)
    if (inputs[port] && inputs[port]->type == QMAT_LIST && !type->inputs[port].list)
      size += qmat_value_bytes(qmat_value_at(inputs[port], item));
  return size;
}

/* Fails when nothing could be made of any item, with the error of the first. */
static qmat_status check_any_made(const lifted_step *lifted, qmat_context *context, const qmat_list *first) {
  const qmat_list *made = lifted->outputs[0];
  for (size_t i = 0; i < made->count; i++)
    if (!qmat_value_failure(made->items[i])) return QMAT_OK;
  if (lifted->first_unusable == SIZE_MAX) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s", qmat_value_failure(made->items[0]));
    return qmat_fail_within(context, first->names[0]);
  }
  context->error = lifted->first_error;
  return qmat_fail_within(context, first->names[lifted->first_unusable]);
}

static qmat_status run_items(executor *executor, size_t index, const qmat_value *const *inputs, const qmat_list *first,
                             qmat_list **outputs) {
  qmat_context *context = executor->context;
  const qmat_node *type = executor->run->graph->nodes[executor->run->steps[index].node].type;
  size_t *sizes = qmat_alloc(first->count, sizeof *sizes), failed;
  if (!sizes) return qmat_fail_memory(context, "values");
  for (size_t i = 0; i < first->count; i++) sizes[i] = item_size(type, inputs, i);
  lifted_step lifted = {
      .outer = executor, .step = index, .inputs = inputs, .outputs = outputs, .first_unusable = SIZE_MAX};
  pthread_mutex_init(&lifted.lock, NULL);
  qmat_status status = qmat_run_items(context, first->count, sizes, "meshes", run_item, &lifted, &failed);
  pthread_mutex_destroy(&lifted.lock);
  qmat_free(sizes);
  if (failed != SIZE_MAX) qmat_fail_within(context, first->names[failed]);
  if (status == QMAT_OK && qmat_output_count(type) > 0) status = check_any_made(&lifted, context, first);
  return status;
}

/* Runs a step once for each value of the lists that it is given; what it makes are lists of the same names. */
static qmat_status run_lifted(executor *executor, size_t index, const qmat_value *const *inputs, const qmat_list *first,
                              qmat_value **outputs) {
  qmat_context *context = executor->context;
  qmat_run_step *step = &executor->run->steps[index];
  const size_t output_count = qmat_output_count(executor->run->graph->nodes[step->node].type);
  qmat_list **lists = qmat_calloc(output_count, sizeof *lists);
  qmat_status status = lists ? QMAT_OK : qmat_fail_memory(context, "values");
  step->lifted = first->count;
  step->lifted_hits = step->lifted_left_out = 0;
  for (size_t port = 0; port < output_count && status == QMAT_OK; port++) {
    lists[port] = qmat_list_new(first->count);
    for (size_t i = 0; lists[port] && i < first->count; i++) {
      lists[port]->names[i] = qmat_strdup(first->names[i]);
      if (!lists[port]->names[i]) status = qmat_fail_memory(context, "values");
    }
    if (!lists[port]) status = qmat_fail_memory(context, "values");
  }
  if (status == QMAT_OK) status = run_items(executor, index, inputs, first, lists);
  for (size_t port = 0; port < output_count && status == QMAT_OK; port++)
    status = qmat_value_seal(context, &lists[port]->base);
  for (size_t port = 0; lists && port < output_count; port++) {
    if (status == QMAT_OK)
      outputs[port] = &lists[port]->base;
    else if (lists[port])
      qmat_value_release(&lists[port]->base);
  }
  qmat_free(lists);
  return status;
}

static qmat_status run_step(executor *executor, size_t index) {
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
    status = need_value(executor, step->inputs[port]);
    inputs[port] = run->slots[step->inputs[port]].value;
  }
  if (status != QMAT_OK) goto cleanup;
  context->node_id = node->id;
  context->node_type = node->type->name;
  size_t lifted;
  const qmat_list *first_list;
  status = count_lifted(context, node->type, inputs, &lifted, &first_list);
  if (status != QMAT_OK) goto cleanup;
  tell_started(executor, index);
  double start = now();
  if (lifted > 0) {
    status = run_lifted(executor, index, inputs, first_list, outputs);
  } else {
    context->file_read = qmat_step_note_read;
    context->file_read_user = &reads;
    status = qmat_node_run(context, node->type, step->params, inputs, outputs);
    context->file_read = NULL;
  }
  step->seconds = now() - start;
  if (status != QMAT_OK) goto cleanup;
  if (!take_outputs(run, step, outputs)) {
    executor->unsteady = true;
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "the node makes other bytes than the cache has of it");
    goto cleanup;
  }
  lock_cache(executor);
  qmat_run_store(run, index, &reads);
  unlock_cache(executor);
  qmat_run_note_reads(run, &reads);
  tell_done(executor, index);
cleanup:
  qmat_step_reads_uninit(&reads);
  qmat_free(inputs);
  qmat_free(outputs);
  return status;
}

static void note_mesh(const qmat_run *run, qmat_run_step *step) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  for (size_t port = 0; port < qmat_input_count(type) && step->mesh_triangles == 0; port++) {
    if (type->inputs[port].type != QMAT_MESH || step->inputs[port] == SIZE_MAX) continue;
    const qmat_run_slot *slot = &run->slots[step->inputs[port]];
    const qmat_run_step *maker = slot->step == SIZE_MAX ? NULL : &run->steps[slot->step];
    step->mesh_triangles = maker ? maker->made[step->inputs[port] - maker->first_slot].counts[1]
                                 : ((const qmat_mesh *)slot->value)->triangle_count;
  }
}

/* Takes the run's name from the first scene. */
static qmat_status take_name(executor *executor, const qmat_run_step *step, bool *named) {
  qmat_run *run = executor->run;
  const qmat_node *type = run->graph->nodes[step->node].type;
  for (size_t port = 0; port < qmat_output_count(type) && !*named; port++) {
    if (type->outputs[port].type != QMAT_SCENE) continue;
    qmat_status status = need_value(executor, step->first_slot + port);
    if (status != QMAT_OK) return status;
    const qmat_scene *scene = (const qmat_scene *)run->slots[step->first_slot + port].value;
    if (!scene->name[0]) continue;
    snprintf(run->name, sizeof run->name, "%s", scene->name);
    *named = true;
  }
  return QMAT_OK;
}

/* Whether a step has made a list of its own accord, and not because it was given one. */
static bool made_list(const qmat_node *type, const qmat_run_step *step) {
  for (size_t port = 0; port < qmat_output_count(type); port++)
    if (type->outputs[port].list && step->made[port].items > 1) return true;
  return false;
}

/* Refuses what later steps would refuse for the lengths of their lists, before the steps in between are run. */
static qmat_status check_list_lengths(executor *executor, size_t next) {
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

static qmat_status execute_step(executor *executor, size_t index, bool *named) {
  qmat_run *run = executor->run;
  qmat_run_step *step = &run->steps[index];
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  executor->context->node_id = node->id;
  executor->context->node_type = node->type->name;
  note_mesh(run, step);
  double start = now();
  qmat_status status = QMAT_OK;
  if (qmat_run_look_up(run, index)) {
    tell_started(executor, index);
    step->seconds = now() - start;
    step->done = true;
    tell_done(executor, index);
  } else {
    status = run_step(executor, index);
  }
  if (status == QMAT_OK) status = take_name(executor, step, named);
  if (status == QMAT_OK && made_list(node->type, step)) status = check_list_lengths(executor, index + 1);
  for (size_t port = 0; port < qmat_input_count(node->type); port++)
    if (step->inputs[port] != SIZE_MAX) run->slots[step->inputs[port]].readers--;
  release_unread(run);
  return status;
}

static qmat_status execute_steps(executor *executor) {
  qmat_run *run = executor->run;
  qmat_status status = QMAT_OK;
  bool named = false;
  for (size_t i = 0; i < run->given_count; i++)
    if (run->given[i].value->type == QMAT_SCENE) named = true;
  for (size_t i = 0; i < run->step_count && status == QMAT_OK; i++) status = execute_step(executor, i, &named);
  for (size_t i = 0; i < run->slot_count && status == QMAT_OK; i++)
    if (run->slots[i].kept) status = need_value(executor, i);
  release_unread(run);
  return status;
}

/* Forgets what has been made, to start again. */
static void reset(qmat_run *run) {
  count_readers(run);
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

qmat_status qmat_run_execute(qmat_context *context, qmat_run *run, const qmat_run_observer *observer) {
  const char *outer_id = context->node_id, *outer_type = context->node_type;
  executor executor = {.context = context, .run = run, .observer = observer};
  double start = now();
  qmat_status status = execute_steps(&executor);
  if (executor.unsteady) {
    /* What ran before this was noticed may rest on the wrong bytes. */
    reset(run);
    run->bypass = true;
    status = execute_steps(&executor);
  }
  context->node_id = outer_id;
  context->node_type = outer_type;
  run->seconds = now() - start;
  return status;
}

void qmat_run_foresee(qmat_run *run) {
  for (size_t i = 0; i < run->step_count; i++) {
    qmat_run_step *step = &run->steps[i];
    bool known = true;
    for (size_t port = 0; port < qmat_input_count(run->graph->nodes[step->node].type); port++)
      if (step->inputs[port] != SIZE_MAX && !run->slots[step->inputs[port]].known) known = false;
    if (!known)
      step->state = QMAT_STEP_DEPENDS;
    else if (!qmat_run_look_up(run, i))
      step->state = QMAT_STEP_RUN;
  }
}

/* ---- writing ---- */

/* The parts that will be files, side by side in one folder: the shape that qmat_file_save takes. */
typedef struct part_group {
  qmat_file_part *parts;
  size_t count, capacity;
} part_group;

static qmat_status add_part(qmat_context *context, part_group *group, const char *name, const void *bytes,
                            size_t size) {
  if (qmat_grow((void **)&group->parts, &group->capacity, group->count + 1, sizeof *group->parts) != 0)
    return qmat_fail_memory(context, "output");
  /* The saver reads the bytes and the names only. */
  group->parts[group->count++] = (qmat_file_part){.name = (char *)name, .size = size, .bytes = (uint8_t *)bytes};
  return QMAT_OK;
}

static qmat_status digest_bytes(qmat_context *context, const void *bytes, size_t size, qmat_digest *digest) {
  qmat_status status = qmat_digest_of(bytes, size, digest);
  return status == QMAT_OK ? status : qmat_fail(context, status, "the digest of an output cannot be computed");
}

/* Refuses side files that would overwrite an input: their names were not known before the run. */
static qmat_status check_side_part(qmat_context *context, const qmat_run *run, const char *path, const char *name) {
  size_t folder = qmat_folder_length(path), length = strlen(name);
  char *side = qmat_alloc(folder + length + 1, 1);
  if (!side) return qmat_fail_memory(context, "output path");
  memcpy(side, path, folder);
  memcpy(side + folder, name, length + 1);
  qmat_status status = check_not_an_input(context, run, "the output's side file", side);
  qmat_free(side);
  return status;
}

static qmat_status add_file_parts(qmat_context *context, qmat_run *run, qmat_run_file *file, part_group *group,
                                  char **text) {
  const qmat_value *value = run->slots[file->slot].value;
  /* Inside a group the first main part has no name, which stands for the path given to the saver. */
  const char *main_name = group->count == 0 ? "" : file->path + qmat_folder_length(file->path);
  if (qmat_value_item_type(value) == QMAT_REPORT) {
    json_t *root = qmat_report_json(value);
    *text = root ? qmat_json_text(root, JSON_INDENT(2) | JSON_SORT_KEYS, NULL) : NULL;
    json_decref(root);
    if (!*text) return qmat_fail_memory(context, "report");
    size_t size = strlen(*text);
    (*text)[size] = '\n'; /* takes the place of the terminating zero */
    file->bytes = size + 1;
    qmat_status status = digest_bytes(context, *text, file->bytes, &file->sha256);
    return status == QMAT_OK ? add_part(context, group, main_name, *text, file->bytes) : status;
  }
  if (value->type == QMAT_LIST) {
    return qmat_fail(context, QMAT_ERROR_USAGE, "output '%s' is %zu files, one for each mesh, and has one path",
                     run->graph->outputs[file->output].name, qmat_value_count(value));
  }
  const qmat_file *made = (const qmat_file *)value;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < made->part_count && status == QMAT_OK; i++) {
    if (i == 0) {
      file->bytes = made->parts[0].size;
      status = digest_bytes(context, made->parts[0].bytes, file->bytes, &file->sha256);
    } else {
      status = check_side_part(context, run, file->path, made->parts[i].name);
    }
    if (status == QMAT_OK)
      status = add_part(context, group, i ? made->parts[i].name : main_name, made->parts[i].bytes, made->parts[i].size);
  }
  return status;
}

static bool same_folder(const char *a, const char *b) {
  size_t length = qmat_folder_length(a);
  return length == qmat_folder_length(b) && memcmp(a, b, length) == 0;
}

static qmat_status write_group(qmat_context *context, qmat_run *run, size_t first, char **texts) {
  part_group group = {0};
  qmat_status status = QMAT_OK;
  const char *path = run->files[first].path;
  for (size_t i = first; i < run->file_count && status == QMAT_OK; i++)
    if (same_folder(path, run->files[i].path)) status = add_file_parts(context, run, &run->files[i], &group, &texts[i]);
  if (status == QMAT_OK) {
    const qmat_file together = {.base = {.type = QMAT_FILE}, .part_count = group.count, .parts = group.parts};
    status = qmat_file_save(context, &together, path);
  }
  qmat_free(group.parts);
  return status;
}

qmat_status qmat_run_write(qmat_context *context, qmat_run *run) {
  if (run->file_count == 0) return QMAT_OK;
  char **texts = qmat_calloc(run->file_count, sizeof *texts);
  if (!texts) return qmat_fail_memory(context, "outputs");
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++) {
    bool written = false;
    for (size_t before = 0; before < i; before++)
      if (same_folder(run->files[before].path, run->files[i].path)) written = true;
    if (!written) status = write_group(context, run, i, texts);
  }
  for (size_t i = 0; i < run->file_count; i++) qmat_free(texts[i]);
  qmat_free(texts);
  return status;
}

/* ---- results ---- */

const qmat_value *qmat_run_value(const qmat_run *run, size_t node, size_t port) {
  for (size_t i = 0; i < run->given_count; i++)
    if (run->given[i].node == node && run->given[i].port == port) return run->given[i].value;
  for (size_t i = 0; i < run->step_count; i++)
    if (run->steps[i].node == node) return run->slots[run->steps[i].first_slot + port].value;
  return NULL;
}

static bool take_number(const json_t *report, const char *key, double *number) {
  const json_t *value = json_object_get(report, key);
  if (!json_is_number(value)) return false;
  *number = json_number_value(value);
  return true;
}

/* Takes one report into the summary; false when it lacks a number. */
static bool summarise_report(const json_t *report, qmat_run_summary *summary) {
  double spheres, epsilon, out, in;
  if (!take_number(report, "spheres", &spheres) || !(spheres >= 0 && spheres < 0x1p53) ||
      !take_number(report, "epsilon", &epsilon) || !take_number(report, "surface_to_envelope", &out) ||
      !take_number(report, "envelope_to_surface", &in))
    return false;
  const json_t *certified = json_object_get(report, "certified");
  const bool first = summary->meshes++ == 0;
  summary->spheres += (uint64_t)spheres;
  summary->epsilon = epsilon;
  if (first || out > summary->surface_to_envelope) summary->surface_to_envelope = out;
  if (first || in > summary->envelope_to_surface) summary->envelope_to_surface = in;
  summary->evaluated = (first || summary->evaluated) && json_is_boolean(certified);
  summary->certified = (first || summary->certified) && json_is_true(certified);
  summary->estimate = summary->estimate || json_is_true(json_object_get(report, "estimate"));
  return true;
}

bool qmat_run_summarise(const qmat_run *run, qmat_run_summary *summary) {
  for (size_t i = run->step_count; i-- > 0;) {
    const qmat_run_step *step = &run->steps[i];
    const qmat_node *type = run->graph->nodes[step->node].type;
    bool medial = false;
    for (size_t port = 0; port < qmat_output_count(type); port++)
      if (type->outputs[port].type == QMAT_MEDIAL) medial = true;
    for (size_t port = 0; port < qmat_input_count(type); port++)
      if (type->inputs[port].type == QMAT_MEDIAL) medial = true;
    if (!step->done || !medial || !step->report) continue;
    *summary = (qmat_run_summary){.step = i, .triangles = step->mesh_triangles};
    const json_t *meshes = json_object_get(step->report, "meshes");
    bool whole = meshes || summarise_report(step->report, summary);
    for (size_t k = 0; k < json_array_size(meshes) && whole; k++) {
      const json_t *of_mesh = json_array_get(meshes, k);
      if (json_object_get(of_mesh, "failure"))
        summary->failures++;
      else
        whole = summarise_report(json_object_get(of_mesh, "report"), summary);
    }
    if (whole) return true;
  }
  return false;
}

void qmat_run_uninit(qmat_run *run) {
  for (size_t i = 0; i < run->step_count; i++) {
    qmat_free(run->steps[i].params);
    qmat_free(run->steps[i].inputs);
    qmat_free(run->steps[i].made);
    json_decref(run->steps[i].report);
    json_decref(run->steps[i].key_items);
  }
  for (size_t i = 0; i < run->hashed_count; i++) qmat_free(run->hashed[i].path);
  qmat_free(run->hashed);
  for (size_t i = 0; run->slots && i < run->slot_count; i++) release_slot(&run->slots[i]);
  for (size_t i = 0; i < run->file_count; i++) qmat_free(run->files[i].path);
  qmat_free(run->steps);
  qmat_free(run->slots);
  qmat_free(run->files);
  qmat_free(run->given);
  *run = (qmat_run){0};
}
