/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_cache.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "graphs/cache/cache_key.h"
#include "graphs/run/run_paths.h"

/* ---- files ---- */

static bool add_file(qmat_run_file_digest **files, size_t *count, size_t *capacity, const char *path,
                     const qmat_digest *digest) {
  char *copy = qmat_strdup(path);
  if (!copy || qmat_grow((void **)files, capacity, *count + 1, sizeof **files) != 0) {
    qmat_free(copy);
    return false;
  }
  qmat_run_file_digest *file = &(*files)[(*count)++];
  *file = (qmat_run_file_digest){.path = copy, .readable = digest != NULL};
  if (digest) file->digest = *digest;
  return true;
}

static const qmat_run_file_digest *find_file(const qmat_run_file_digest *files, size_t count, const char *path) {
  for (size_t i = 0; i < count; i++)
    if (strcmp(files[i].path, path) == 0) return &files[i];
  return NULL;
}

void qmat_step_note_read(void *user, const char *path, const uint8_t *bytes, size_t size) {
  qmat_step_reads *reads = user;
  qmat_digest digest;
  if (bytes && qmat_digest_of(bytes, size, &digest) != QMAT_OK) {
    reads->incomplete = true;
    return;
  }
  const qmat_run_file_digest *known = find_file(reads->files, reads->count, path);
  if (!known) {
    if (!add_file(&reads->files, &reads->count, &reads->capacity, path, bytes ? &digest : NULL))
      reads->incomplete = true;
  } else if (known->readable != (bytes != NULL) || (bytes && !qmat_digest_equal(&known->digest, &digest))) {
    reads->incomplete = true;
  }
}

void qmat_step_reads_uninit(qmat_step_reads *reads) {
  for (size_t i = 0; i < reads->count; i++) qmat_free(reads->files[i].path);
  qmat_free(reads->files);
  *reads = (qmat_step_reads){0};
}

void qmat_run_note_reads(qmat_run *run, const qmat_step_reads *reads) {
  for (size_t i = 0; i < reads->count; i++) {
    const qmat_run_file_digest *file = &reads->files[i];
    if (!find_file(run->hashed, run->hashed_count, file->path))
      add_file(&run->hashed, &run->hashed_count, &run->hashed_capacity, file->path,
               file->readable ? &file->digest : NULL);
  }
}

/* The digest of a file, which is hashed once. NULL when memory is short. */
static const qmat_run_file_digest *digest_file(qmat_run *run, const char *path) {
  const qmat_run_file_digest *known = find_file(run->hashed, run->hashed_count, path);
  if (known) return known;
  qmat_digest digest;
  bool readable = qmat_digest_of_file(path, &digest) == QMAT_OK;
  if (!add_file(&run->hashed, &run->hashed_count, &run->hashed_capacity, path, readable ? &digest : NULL)) return NULL;
  return &run->hashed[run->hashed_count - 1];
}

/* ---- keys ---- */

static const qmat_node *type_of(const qmat_run *run, const qmat_run_step *step) {
  return run->graph->nodes[step->node].type;
}

/* The key items that are known before the step runs. NULL when a file cannot be read. */
static json_t *make_items(qmat_run *run, const qmat_run_step *step) {
  const qmat_node *type = type_of(run, step);
  size_t params = qmat_param_count(type), ports = qmat_input_count(type);
  qmat_digest *digests = qmat_alloc(params, sizeof *digests);
  const qmat_digest **files = qmat_calloc(params, sizeof *files), **inputs = qmat_calloc(ports, sizeof *inputs);
  json_t *items = NULL;
  bool known = digests && files && inputs;
  for (size_t row = 0; row < params && known; row++) {
    const char *path = qmat_param_input_file(type, row, step->params);
    if (!path) continue;
    const qmat_run_file_digest *file = digest_file(run, path);
    known = file && file->readable;
    if (!known) continue;
    digests[row] = file->digest;
    files[row] = &digests[row];
  }
  for (size_t port = 0; port < ports && known; port++)
    if (step->inputs[port] != SIZE_MAX) inputs[port] = &run->slots[step->inputs[port]].digest;
  if (known) items = qmat_key_items(type, step->params, inputs, files);
  qmat_free(digests);
  qmat_free(files);
  qmat_free(inputs);
  return items;
}

/* The path of a side file in a record, which is relative to the file of that parameter. */
static char *side_path(const qmat_node *type, const qmat_run_step *step, const char *param, const char *name) {
  for (size_t row = 0; row < qmat_param_count(type); row++) {
    const char *main_file = qmat_param_input_file(type, row, step->params);
    if (!main_file || strcmp(type->params[row].name, param) != 0) continue;
    return *name == '/' ? qmat_strdup(name) : qmat_path_beside(main_file, name);
  }
  return NULL;
}

/* Adds the side files of the step's last run with these items, with their current digests. */
static bool add_sides(qmat_run *run, const qmat_run_step *step, const json_t *sides, json_t *items) {
  for (size_t i = 0; i < json_array_size(sides); i++) {
    const json_t *side = json_array_get(sides, i);
    const char *param = json_string_value(json_array_get(side, 0)), *name = json_string_value(json_array_get(side, 1));
    char *path = param && name ? side_path(type_of(run, step), step, param, name) : NULL;
    const qmat_run_file_digest *file = path ? digest_file(run, path) : NULL;
    bool added = file && qmat_key_add_side_file(items, param, name, file->readable ? &file->digest : NULL);
    qmat_free(path);
    if (!added) return false;
  }
  return true;
}

/* ---- records ---- */

static bool read_output(const json_t *output, const qmat_port *port, qmat_run_made *made) {
  const char *name = json_string_value(json_object_get(output, "port"));
  const char *type = json_string_value(json_object_get(output, "type"));
  const char *hex = json_string_value(json_object_get(output, "digest"));
  const json_t *counts = json_object_get(output, "counts");
  json_int_t size = json_integer_value(json_object_get(output, "blob"));
  json_int_t bytes = json_integer_value(json_object_get(output, "bytes"));
  const size_t items = json_array_size(json_object_get(output, "items"));
  const char *expected = qmat_value_type_name(items > 1 ? QMAT_LIST : port->type);
  if (!name || strcmp(name, port->name) != 0 || !type || strcmp(type, expected) != 0 || !hex ||
      !qmat_digest_parse(hex, &made->digest) || size <= 0 || bytes < 0)
    return false;
  made->items = items > 1 ? items : 1;
  made->blob_size = (uint64_t)size;
  made->bytes = (size_t)bytes;
  for (size_t i = 0; i < QMAT_MOST_COUNTS; i++) made->counts[i] = (size_t)json_integer_value(json_array_get(counts, i));
  return true;
}

/* Whether a record has the outputs of this node type. */
static bool record_fits(const qmat_node *type, const json_t *record) {
  const json_t *outputs = json_object_get(record, "outputs");
  size_t count = qmat_output_count(type);
  if (json_array_size(outputs) != count) return false;
  for (size_t port = 0; port < count; port++) {
    qmat_run_made made;
    if (!read_output(json_array_get(outputs, port), &type->outputs[port], &made)) return false;
  }
  return true;
}

/* Fills in the step's results from a record, if the cache has all of them. */
static bool take_record(qmat_run *run, size_t index, const json_t *record) {
  qmat_run_step *step = &run->steps[index];
  const qmat_node *type = type_of(run, step);
  if (!record || !record_fits(type, record)) return false;
  const json_t *outputs = json_object_get(record, "outputs");
  for (size_t port = 0; port < qmat_output_count(type); port++) {
    read_output(json_array_get(outputs, port), &type->outputs[port], &step->made[port]);
    if (!qmat_cache_has_stored(run->cache, json_array_get(outputs, port))) return false;
  }
  /* Reports are loaded at once: they are small, and the run's summary needs them. */
  for (size_t port = 0; port < qmat_output_count(type) && !step->report; port++) {
    if (type->outputs[port].type != QMAT_REPORT) continue;
    qmat_value *value = qmat_run_load(run, index, port);
    if (!value) return false;
    step->report = qmat_report_json(value);
    run->slots[step->first_slot + port].value = value;
  }
  for (size_t port = 0; port < qmat_output_count(type); port++) {
    qmat_run_slot *slot = &run->slots[step->first_slot + port];
    slot->digest = step->made[port].digest;
    slot->known = true;
    qmat_cache_touch_stored(run->cache, json_array_get(outputs, port));
  }
  qmat_cache_touch_record(run->cache, &step->key);
  return true;
}

bool qmat_run_look_up(qmat_run *run, size_t index) {
  qmat_run_step *step = &run->steps[index];
  if (!run->cache) return false;
  json_decref(step->key_items);
  step->key_items = make_items(run, step);
  step->keyed = step->key_items && qmat_key_digest(step->key_items, &step->key);
  if (!step->keyed) return false;
  json_t *record = qmat_cache_record(run->cache, &step->key);
  /* Each record of side files leads to the next key. An empty one would lead to itself. */
  for (const json_t *sides; json_array_size(sides = json_object_get(record, "sides")) > 0;) {
    qmat_cache_touch_record(run->cache, &step->key);
    const bool whole = add_sides(run, step, sides, step->key_items) && qmat_key_digest(step->key_items, &step->key);
    json_decref(record);
    record = whole ? qmat_cache_record(run->cache, &step->key) : NULL;
  }
  bool hit = !step->forced && !run->bypass && take_record(run, index, record);
  json_decref(record);
  if (hit) step->state = QMAT_STEP_HIT;
  return hit;
}

qmat_value *qmat_run_load(qmat_run *run, size_t index, size_t port) {
  const qmat_run_step *step = &run->steps[index];
  const qmat_run_made *made = &step->made[port];
  qmat_value_type type = made->items > 1 ? QMAT_LIST : type_of(run, step)->outputs[port].type;
  return run->cache ? qmat_cache_value(run->cache, &made->digest, made->blob_size, type) : NULL;
}

/* ---- storing ---- */

/* A file that a step read and no parameter names: the parameter that it belongs to, and its path relative to that
 * parameter's file. */
typedef struct side_file {
  const char *param, *path;
  const qmat_run_file_digest *file;
  bool linked, next; /* its digest leads to the key so far; it is named by the record of that key */
} side_file;

static int by_name(const void *a, const void *b) {
  const side_file *first = a, *second = b;
  int order = strcmp(first->param, second->param);
  return order ? order : strcmp(first->path, second->path);
}

/* Collects the side files among the files that a step read. False when another file changed since the key was made, or
 * a side file cannot be named in a record. */
static bool find_sides(const qmat_run *run, const qmat_run_step *step, const qmat_step_reads *reads, side_file *sides,
                       size_t *count) {
  const qmat_node *type = type_of(run, step);
  *count = 0;
  for (size_t i = 0; i < reads->count; i++) {
    const qmat_run_file_digest *file = &reads->files[i];
    side_file side = {.file = file};
    bool is_main = false;
    for (size_t row = 0; row < qmat_param_count(type) && !is_main; row++) {
      const char *path = qmat_param_input_file(type, row, step->params);
      if (!path) continue;
      is_main = strcmp(path, file->path) == 0;
      /* Any other path would depend on the working folder. */
      size_t folder = qmat_folder_length(path);
      bool below = strncmp(file->path, path, folder) == 0 && file->path[folder] != '/';
      if (below ? !side.param || *side.path == '/' : !side.param && *file->path == '/') {
        side.param = type->params[row].name;
        side.path = file->path + (below ? folder : 0);
      }
    }
    if (is_main) {
      const qmat_run_file_digest *known = find_file(run->hashed, run->hashed_count, file->path);
      if (!file->readable || !known || !qmat_digest_equal(&known->digest, &file->digest)) return false;
    } else if (!side.param || !qmat_is_utf8(side.path)) {
      return false;
    } else {
      sides[(*count)++] = side;
    }
  }
  if (*count > 1) qsort(sides, *count, sizeof *sides, by_name);
  return true;
}

static json_t *start_record(const json_t *items, double seconds) {
  struct timespec time;
  clock_gettime(CLOCK_REALTIME, &time);
  return json_pack("{s:s, s:I, s:f, s:O}", "qmat", QMAT_VERSION, "made",
                   (json_int_t)time.tv_sec * 1000 + time.tv_nsec / 1000000, "seconds", seconds, "key", items);
}

/* Stores the step's values and returns the record's list of them. */
static json_t *put_outputs(qmat_run *run, qmat_run_step *step, bool *any_added) {
  const qmat_node *type = type_of(run, step);
  json_t *outputs = json_array();
  bool done = outputs != NULL;
  for (size_t port = 0; port < qmat_output_count(type) && done; port++) {
    qmat_run_made *made = &step->made[port];
    const qmat_value *value = run->slots[step->first_slot + port].value;
    bool added;
    json_t *stored = qmat_cache_put_value(run->cache, value, &added);
    *any_added = *any_added || added;
    made->blob_size = (uint64_t)json_integer_value(json_object_get(stored, "blob"));
    json_t *counts = json_array();
    done = counts != NULL;
    for (size_t i = 0; i < QMAT_MOST_COUNTS && done; i++)
      done = json_array_append_new(counts, json_integer((json_int_t)made->counts[i])) == 0;
    json_t *output = json_pack("{s:s, s:s, s:I, s:o}", "port", type->outputs[port].name, "type",
                               qmat_value_type_name(value->type), "bytes", (json_int_t)made->bytes, "counts", counts);
    done = done && stored && output && json_object_update(output, stored) == 0;
    json_decref(stored);
    done = json_array_append_new(outputs, output) == 0 && done;
  }
  if (done) return outputs;
  json_decref(outputs);
  return NULL;
}

/* Warns when the cache has other bytes under the same key: the node's version should have been raised. */
static void compare_with_record(qmat_run *run, const qmat_run_step *step) {
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  json_t *record = qmat_cache_record(run->cache, &step->key);
  if (record && record_fits(node->type, record)) {
    for (size_t port = 0; port < qmat_output_count(node->type); port++) {
      qmat_run_made made;
      read_output(json_array_get(json_object_get(record, "outputs"), port), &node->type->outputs[port], &made);
      if (!qmat_digest_equal(&made.digest, &step->made[port].digest) && !*run->cache->warning)
        snprintf(run->cache->warning, sizeof run->cache->warning,
                 "node '%s' (%s) made another '%s' than the cache has for the same inputs", node->id, node->type->name,
                 node->type->outputs[port].name);
    }
  }
  json_decref(record);
}

/* Stores the names of side files under the key of the items so far. */
static bool put_sides(qmat_run *run, const qmat_run_step *step, json_t *items, const qmat_digest *key, json_t *names) {
  json_t *record = start_record(items, step->seconds);
  const bool done =
      record && json_object_set(record, "sides", names) == 0 && qmat_cache_put_record(run->cache, key, record);
  json_decref(record);
  return done;
}

/* Chooses the side files that the record of the key so far names: those that it named before and this run has read too.
 * Returns the names, NULL when memory is short. */
static json_t *choose_next(side_file *sides, size_t count, const json_t *before) {
  json_t *names = json_array();
  bool done = names != NULL, any = false;
  for (size_t i = 0; i < count; i++) {
    json_t *name = json_pack("[s, s]", sides[i].param, sides[i].path);
    sides[i].next = false;
    for (size_t k = 0; k < json_array_size(before) && !sides[i].linked; k++)
      if (json_equal(json_array_get(before, k), name)) sides[i].next = any = true;
    json_decref(name);
  }
  for (size_t i = 0; i < count && done; i++) {
    sides[i].next = any ? sides[i].next : !sides[i].linked;
    if (sides[i].next) done = json_array_append_new(names, json_pack("[s, s]", sides[i].param, sides[i].path)) == 0;
  }
  if (done) return names;
  json_decref(names);
  return NULL;
}

/* Adds the side files to the items of a key. The record of each key on the way names the files whose digests lead to
 * the next one. It names what every run that came to this key has read, so that files with the same bytes that
 * refer to different files, such as the root layers of two assets, each keep their way. What a node reads first depends
 * on the bytes before it alone, so that there always is such a file. */
static bool link_sides(qmat_run *run, const qmat_run_step *step, side_file *sides, size_t count, json_t *items) {
  bool done = true;
  for (size_t linked = 0; linked < count && done;) {
    qmat_digest key;
    if (!qmat_key_digest(items, &key)) return false;
    json_t *record = qmat_cache_record(run->cache, &key), *before = json_object_get(record, "sides");
    json_t *names = choose_next(sides, count, before);
    done = names && (json_equal(names, before) || put_sides(run, step, items, &key, names));
    for (size_t i = 0; i < count && done; i++) {
      if (!sides[i].next) continue;
      const qmat_run_file_digest *file = sides[i].file;
      done = qmat_key_add_side_file(items, sides[i].param, sides[i].path, file->readable ? &file->digest : NULL);
      sides[i].linked = true;
      linked++;
    }
    json_decref(names);
    json_decref(record);
  }
  return done;
}

void qmat_run_store(qmat_run *run, size_t index, const qmat_step_reads *reads) {
  qmat_run_step *step = &run->steps[index];
  if (!run->cache || !step->keyed || !qmat_cache_is_writable(run->cache) || reads->incomplete) return;
  side_file *sides = qmat_alloc(reads->count, sizeof *sides);
  size_t side_count;
  json_t *items = make_items(run, step);
  bool done = sides && items && find_sides(run, step, reads, sides, &side_count), any_added = false;
  done = done && link_sides(run, step, sides, side_count, items) && qmat_key_digest(items, &step->key);
  if (done) {
    json_decref(step->key_items);
    step->key_items = json_incref(items);
    compare_with_record(run, step);
    json_t *outputs = put_outputs(run, step, &any_added), *record = start_record(items, step->seconds);
    if (outputs && record && json_object_set(record, "outputs", outputs) == 0 &&
        qmat_cache_put_record(run->cache, &step->key, record) && !any_added)
      step->state = QMAT_STEP_SAME;
    json_decref(outputs);
    json_decref(record);
  }
  json_decref(items);
  qmat_free(sides);
}
