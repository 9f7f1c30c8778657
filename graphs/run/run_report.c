/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_report.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "core/json_text.h"
#include "graphs/cache/cache_key.h"
#include "graphs/node_json.h"
#include "graphs/run/run_outputs.h"
#include "graphs/run/run_paths.h"
#include "io/bytes.h"
#include "io/save.h"

/* ---- JSON ---- */

static json_t *digest_json(const qmat_digest *digest) {
  char hex[65];
  qmat_digest_hex(digest, hex);
  return json_string(hex);
}

static json_t *output_json(const qmat_port *port, const qmat_run_made *made) {
  json_t *output = json_object();
  json_object_set_new(output, "type", json_string(qmat_value_type_name(port->type)));
  if (made->items > 1) json_object_set_new(output, "items", json_integer((json_int_t)made->items));
  json_object_set_new(output, "digest", digest_json(&made->digest));
  json_object_set_new(output, "bytes", json_integer((json_int_t)made->bytes));
  const qmat_value_count_row *rows = qmat_value_count_rows(port->type);
  for (size_t i = 0; rows[i].name; i++) qmat_json_set_count(output, rows[i].name, made->counts[i]);
  return output;
}

static json_t *step_json(const qmat_run *run, const qmat_run_step *step) {
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  const qmat_node *type = node->type;
  json_t *params = json_object(), *outputs = json_object(), *json = json_object();
  for (size_t i = 0; i < qmat_param_count(type); i++)
    json_object_set_new(params, type->params[i].name, qmat_param_json(&type->params[i], step->params));
  for (size_t i = 0; i < qmat_output_count(type); i++)
    json_object_set_new(outputs, type->outputs[i].name, output_json(&type->outputs[i], &step->made[i]));
  json_object_set_new(json, "id", json_string(node->id));
  json_object_set_new(json, "type", json_string(type->name));
  json_object_set_new(json, "version", json_integer((json_int_t)type->version));
  if (run->cache) json_object_set_new(json, "cache", json_string(qmat_step_state_name(step->state)));
  if (step->keyed) json_object_set_new(json, "key", digest_json(&step->key));
  json_object_set_new(json, "seconds", json_real(step->seconds));
  if (step->lifted > 0) {
    json_object_set_new(json, "runs",
                        json_integer((json_int_t)(step->lifted - step->lifted_hits - step->lifted_left_out)));
    json_object_set_new(json, "hits", json_integer((json_int_t)step->lifted_hits));
    if (step->lifted_left_out > 0)
      json_object_set_new(json, "left_out", json_integer((json_int_t)step->lifted_left_out));
  }
  json_object_set_new(json, "params", params);
  json_object_set_new(json, "outputs", outputs);
  if (step->report) json_object_set(json, "report", step->report);
  return json;
}

static json_t *file_json(const qmat_run *run, const qmat_run_file *file) {
  const qmat_file *made = file->written;
  json_t *json = json_object();
  json_object_set_new(json, "name", json_string(run->graph->outputs[file->output].name));
  json_object_set_new(json, "path", qmat_json_string(file->path));
  json_object_set_new(json, "format", json_string(made ? made->format : ""));
  json_object_set_new(json, "bytes", json_integer((json_int_t)file->bytes));
  json_object_set_new(json, "sha256", digest_json(&file->sha256));
  if (made && made->part_count > 1) {
    json_t *parts = json_array();
    for (size_t i = 1; i < made->part_count; i++) {
      json_t *part = json_object();
      json_object_set_new(part, "name", qmat_json_string(made->parts[i].name));
      json_object_set_new(part, "bytes", json_integer((json_int_t)made->parts[i].size));
      json_array_append_new(parts, part);
    }
    json_object_set_new(json, "parts", parts);
  }
  return json;
}

/* The first file that the run reads, or null. */
static json_t *input_json(const qmat_run *run) {
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_node *type = run->graph->nodes[run->steps[i].node].type;
    for (size_t row = 0; row < qmat_param_count(type); row++) {
      const char *path = qmat_param_input_file(type, row, run->steps[i].params);
      if (path) return qmat_json_string(path);
    }
  }
  return json_null();
}

/* The cache of the run, or null. */
static json_t *cache_json(const qmat_run *run) {
  if (!run->cache) return json_null();
  size_t hits = 0;
  for (size_t i = 0; i < run->step_count; i++)
    if (run->steps[i].state == QMAT_STEP_HIT) hits++;
  json_t *json = json_object();
  json_object_set_new(json, "folder", qmat_json_string(run->cache->folder));
  json_object_set_new(json, "read_only", json_boolean(run->cache->read_only));
  json_object_set_new(json, "hits", json_integer((json_int_t)hits));
  json_object_set_new(json, "warning",
                      *qmat_cache_warning(run->cache) ? qmat_json_string(qmat_cache_warning(run->cache)) : json_null());
  return json;
}

/* Whether an earlier step reported the same failure of the same mesh. Later nodes repeat it. */
static bool was_told(const qmat_run *run, size_t step, size_t mesh, const char *failure) {
  for (size_t i = 0; i < step; i++) {
    const json_t *of_mesh = json_array_get(json_object_get(run->steps[i].report, "meshes"), mesh);
    const char *before = json_string_value(json_object_get(of_mesh, "failure"));
    if (before && strcmp(before, failure) == 0) return true;
  }
  return false;
}

/* A warning of a node. What it advises to set is its own, by the node's name in the built-in graph: it gets that of the
 * graph. */
static json_t *warning_json(const char *id, const char *text) {
  const char *option = strstr(text, "--set "), *name = option ? option + strlen("--set ") : "";
  const char *dot = name + strspn(name, "abcdefghijklmnopqrstuvwxyz_");
  if (*dot != '.') return json_sprintf("node '%s': %s", id, text);
  return json_sprintf("node '%s': %.*s%s%s", id, (int)(name - text), text, id, dot);
}

json_t *qmat_run_warnings(const qmat_run *run, bool only_failures) {
  json_t *all = json_array();
  bool done = all != NULL;
  for (size_t i = 0; i < run->step_count; i++) {
    const char *id = run->graph->nodes[run->steps[i].node].id;
    const json_t *own = json_object_get(run->steps[i].report, "warnings");
    for (size_t k = 0; k < json_array_size(own) && !only_failures; k++) {
      const char *text = json_string_value(json_array_get(own, k));
      if (text) done = json_array_append_new(all, warning_json(id, text)) == 0 && done;
    }
    const json_t *meshes = json_object_get(run->steps[i].report, "meshes");
    for (size_t k = 0; k < json_array_size(meshes); k++) {
      const char *name = json_string_value(json_object_get(json_array_get(meshes, k), "name"));
      const char *failure = json_string_value(json_object_get(json_array_get(meshes, k), "failure"));
      if (!name || !failure || was_told(run, i, k, failure)) continue;
      json_t *text = json_sprintf("mesh '%s' cannot be described: %s", qmat_show(name).text, failure);
      done = json_array_append_new(all, text) == 0 && done;
    }
  }
  if (done) return all;
  json_decref(all);
  return NULL;
}

json_t *qmat_run_report(const qmat_context *context, const qmat_run *run) {
  json_t *nodes = json_array(), *outputs = json_array();
  for (size_t i = 0; i < run->step_count; i++) json_array_append_new(nodes, step_json(run, &run->steps[i]));
  for (size_t i = 0; i < run->file_count; i++) json_array_append_new(outputs, file_json(run, &run->files[i]));
  char text[512], line[520];
  json_t *summary = qmat_run_summarise(run, 0, text, sizeof text);
  const char *second = summary ? strchr(text, '\n') : NULL;
  if (second) snprintf(line, sizeof line, "%.*s; %s", (int)(second - text), text, second + 1);
  if (summary) json_object_set_new(summary, "text", qmat_json_string(second ? line : text));
  const bool whole = json_array_size(nodes) == run->step_count && json_array_size(outputs) == run->file_count;
  json_t *report =
      json_pack("{s:s, s:o, s:o, s:f, s:i, s:o, s:o, s:o, s:o, s:o}", "qmat", QMAT_VERSION, "graph",
                qmat_json_string(run->graph->file), "input", input_json(run), "seconds", run->seconds, "threads",
                qmat_threads(context), "cache", cache_json(run), "nodes", nodes, "outputs", outputs, "summary",
                summary ? summary : json_null(), "warnings", qmat_run_warnings(run, false));
  if (whole) return report;
  json_decref(report);
  return NULL;
}

static json_t *text_or_null(const char *text) {
  return *text ? qmat_json_string(text) : json_null();
}

json_t *qmat_error_report(const qmat_error *error) {
  char line[2048];
  qmat_error_format(error, line, sizeof line);
  return json_pack("{s:{s:s, s:i, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}}", "error", "status",
                   qmat_status_name(error->status), "exit_code", qmat_status_exit_code(error->status), "node",
                   text_or_null(error->node_id), "type", text_or_null(error->node_type), "field",
                   text_or_null(error->field), "element_kind", text_or_null(error->element_kind), "element",
                   error->element >= 0 ? json_integer(error->element) : json_null(), "file", text_or_null(error->file),
                   "line", error->line > 0 ? json_integer(error->line) : json_null(), "column",
                   error->column > 0 ? json_integer(error->column) : json_null(), "message",
                   qmat_json_string(error->message), "hint", text_or_null(error->hint), "text", qmat_json_string(line));
}

qmat_status qmat_save_json(qmat_context *context, const json_t *json, const char *path) {
  qmat_file *file = NULL;
  qmat_status status = qmat_json_to_file(context, json, JSON_INDENT(2) | JSON_REAL_PRECISION(15), &file);
  if (status == QMAT_OK) status = qmat_file_save(context, file, path);
  if (file) qmat_value_release(&file->base);
  return status;
}

/* ---- depfile ---- */

/* Puts a path, escaped as Make and Ninja read it in a depfile: both take a backslash as it is, except before a blank.
 */
static void put_escaped(qmat_writer *writer, const char *path) {
  for (; *path; path++) {
    const bool is_before_blank = *path == '\\' && path[1 + strspn(path + 1, "\\")] == ' ';
    if (*path == ' ' || *path == '#' || *path == ':' || is_before_blank) qmat_put_text(writer, "\\");
    if (*path == '$') qmat_put_text(writer, "$");
    qmat_put_bytes(writer, path, 1);
  }
}

/* Adds a dependency, and an empty rule for it: without one, Make stops where the file is missing. */
static void put_dependency(qmat_writer *dependencies, qmat_writer *rules, const char *path) {
  qmat_put_text(dependencies, " \\\n  ");
  put_escaped(dependencies, path);
  put_escaped(rules, path);
  qmat_put_text(rules, ":\n");
}

/* Whether two paths differ by one number of the file's name alone. */
static bool differ_by_number(const char *a, const char *b) {
  size_t same = 0;
  while (a[same] && a[same] == b[same]) same++;
  while (same > 0 && a[same - 1] >= '0' && a[same - 1] <= '9') same--;
  const size_t first = strspn(a + same, "0123456789"), second = strspn(b + same, "0123456789");
  a += same + first;
  b += same + second;
  return first > 0 && second > 0 && strcmp(a, b) == 0 && !strchr(a, '/');
}

/* Whether the saved files are made anew when this file changes, and when a missing one appears. Not those that may stay
 * missing: the tiles of a texture with a number in its name, and materials that a renderer has in a folder of its own.
 */
static bool is_dependency(const qmat_run *run, size_t index) {
  const char *path = run->hashed[index].path, *ending = strrchr(path, '.');
  if (run->hashed[index].readable) return true;
  if (ending && strcasecmp(ending, ".mdl") == 0) return false;
  for (size_t i = 0; i < run->hashed_count; i++)
    if (i != index && differ_by_number(path, run->hashed[i].path)) return false;
  return true;
}

static bool is_temporary(const char *path, const char *temporary) {
  const size_t length = temporary ? strlen(temporary) : 0;
  return length > 0 && strncmp(path, temporary, length) == 0 && path[length] == '/';
}

/* Whether a saved file stands for the standard output. */
static bool is_stream(const qmat_run_file *file, const char *temporary) {
  return strcmp(file->path, "-") == 0 || is_temporary(file->path, temporary);
}

/* Whether a saved file is a target of the rule. Those that the graph saves by itself are none beside files that the
 * caller names: a build's rule declares only these, and Ninja refuses a target that its rule does not declare. */
static bool is_target(const qmat_run *run, const char *temporary, size_t index) {
  if (is_stream(&run->files[index], temporary)) return false;
  for (size_t i = 0; i < run->file_count && run->files[index].by_graph; i++)
    if (!run->files[i].by_graph && !is_stream(&run->files[i], temporary)) return false;
  return true;
}

/* The files of a rule in their order: `index` counts the saved ones first, then the graph file, then those that were
 * read. False at the end. `*path` is NULL for one that is left out. */
static bool depfile_path(const qmat_run *run, const char *temporary, size_t index, const char **path, bool *saved) {
  *saved = index < run->file_count;
  *path = NULL;
  if (*saved) {
    if (is_target(run, temporary, index)) *path = run->files[index].path;
  } else if (index == run->file_count) {
    if (run->graph->is_file) *path = run->graph->file;
  } else {
    index -= run->file_count + 1;
    if (index >= run->hashed_count) return false;
    if (is_dependency(run, index)) *path = run->hashed[index].path;
  }
  if (*path && is_temporary(*path, temporary)) *path = NULL;
  return true;
}

size_t qmat_run_count_saved(const qmat_run *run, const char *temporary) {
  size_t count = 0;
  for (size_t i = 0; i < run->file_count; i++) count += !is_stream(&run->files[i], temporary);
  return count;
}

/* Checks one name of a rule. The first name with a problem for one of the two programs makes the warning. */
static qmat_status check_name(qmat_context *context, const char *path, bool is_target, char *warning, size_t size) {
  if (strpbrk(path, ";|\t\n\r")) {
    qmat_fail(context, QMAT_ERROR_USAGE, "neither Make nor Ninja can read the name '%s' in a depfile",
              qmat_show(path).text);
    return qmat_fail_hint(context, "give the file a name without ; | and control characters");
  }
  if (*warning) return QMAT_OK;
  /* Ninja takes [ and ] as they are, and a backslash before them as part of the name. Make does too where no other file
   * fits the pattern. The same backslash would hide a % from Make, and from Ninja the target. */
  const char *problem = strpbrk(path, "=*?&<>\"'`^"), *words = NULL;
  if (problem && *problem == '=')
    words = "Make does not see when the file changes, because of the =";
  else if (problem)
    words = "Ninja makes the output at every build, because of the special character";
  else if (is_target && strchr(path, '%'))
    words = "Make takes it for a pattern, because of the %, and does not see when a file changes";
  if (words) snprintf(warning, size, "the depfile has the name '%s': %s", qmat_show(path).text, words);
  return QMAT_OK;
}

qmat_status qmat_run_check_depfile(qmat_context *context, const qmat_run *run, const char *temporary, char *warning,
                                   size_t size) {
  const char *path;
  bool saved;
  qmat_status status = QMAT_OK;
  *warning = 0;
  for (size_t i = 0; status == QMAT_OK && depfile_path(run, temporary, i, &path, &saved); i++)
    if (path) status = check_name(context, path, saved, warning, size);
  /* What a planned run is going to read. */
  for (size_t i = 0; i < run->step_count; i++) {
    const qmat_node *type = run->graph->nodes[run->steps[i].node].type;
    for (size_t row = 0; row < qmat_param_count(type) && status == QMAT_OK; row++) {
      path = qmat_param_input_file(type, row, run->steps[i].params);
      if (path && !is_temporary(path, temporary)) status = check_name(context, path, false, warning, size);
    }
  }
  return status;
}

qmat_status qmat_run_write_depfile(qmat_context *context, const qmat_run *run, const char *path,
                                   const char *temporary) {
  qmat_writer writer = {0}, rules = {0};
  qmat_file *file = NULL;
  const char *name;
  bool saved, in_targets = true;
  for (size_t i = 0; depfile_path(run, temporary, i, &name, &saved); i++) {
    if (!saved && in_targets) qmat_put_text(&writer, ":");
    in_targets = saved;
    if (!name) continue;
    if (saved) {
      if (writer.size > 0) qmat_put_text(&writer, " ");
      put_escaped(&writer, name);
    } else {
      put_dependency(&writer, &rules, name);
    }
  }
  qmat_put_text(&writer, "\n");
  qmat_put_bytes(&writer, rules.bytes, rules.size);
  writer.failed |= rules.failed;
  qmat_writer_uninit(&rules);
  qmat_status status = qmat_writer_to_file(context, &writer, "d", &file);
  if (status == QMAT_OK) status = qmat_file_save(context, file, path);
  if (file) qmat_value_release(&file->base);
  return status;
}
