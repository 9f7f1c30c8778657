/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_outputs.h"

#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>

#include "core/json_text.h"
#include "graphs/run/run_paths.h"
#include "io/bytes.h"
#include "io/save.h"
#include "io/side_files.h"

/* The files of one folder, in the form that qmat_file_save takes. */
typedef struct part_group {
  qmat_file_part *parts;
  size_t count, capacity;
} part_group;

static qmat_status add_part(qmat_context *context, part_group *group, const char *name, const void *bytes,
                            size_t size) {
  if (qmat_grow((void **)&group->parts, &group->capacity, group->count + 1, sizeof *group->parts) != 0)
    return qmat_fail_memory(context, "output");
  /* qmat_file_save only reads the names and bytes. */
  group->parts[group->count++] = (qmat_file_part){.name = (char *)name, .size = size, .bytes = (uint8_t *)bytes};
  return QMAT_OK;
}

qmat_status qmat_json_to_file(qmat_context *context, const json_t *json, size_t flags, qmat_file **file) {
  char *text = json ? qmat_json_text(json, flags, NULL) : NULL;
  if (!text) return qmat_fail_memory(context, "report");
  qmat_writer writer = {0};
  qmat_put_text(&writer, text);
  qmat_put_text(&writer, "\n");
  qmat_free(text);
  return qmat_writer_to_file(context, &writer, "json", file);
}

bool qmat_run_has_read(const qmat_run *run, const char *path) {
  for (size_t i = 0; i < run->hashed_count; i++)
    if (run->hashed[i].readable && qmat_same_file(path, run->hashed[i].path)) return true;
  return false;
}

/* Refuses a file that would overwrite one that the run has read, such as a texture or a layer of the model. Only the
 * run has found these. */
static qmat_status check_not_read(qmat_context *context, const qmat_run *run, const char *what, const char *path) {
  return qmat_run_has_read(run, path) ? qmat_fail(context, QMAT_ERROR_USAGE,
                                                  "%s '%s' would overwrite a file that the model refers to", what, path)
                                      : QMAT_OK;
}

/* Refuses a side file that would overwrite an input. Its name was not known before the run. */
static qmat_status check_side_part(qmat_context *context, const qmat_run *run, const char *path, const char *name) {
  static const char what[] = "the output's side file";
  char *side = qmat_path_beside(path, name);
  if (!side) return qmat_fail_memory(context, "output path");
  qmat_status status = qmat_run_check_not_input(context, run, what, side);
  if (status == QMAT_OK) status = check_not_read(context, run, what, side);
  qmat_free(side);
  return status;
}

/* Makes the file of an output. Names its side files, and refuses those that would replace a file of something else. */
static qmat_status make_file(qmat_context *context, const qmat_run *run, qmat_run_file *file) {
  const qmat_value *value = run->slots[file->slot].value;
  qmat_status status = check_not_read(context, run, "the output", file->path);
  if (status != QMAT_OK) return status;
  if (file->written) qmat_value_release(&file->written->base);
  file->written = NULL;
  if (qmat_value_item_type(value) == QMAT_REPORT) {
    json_t *root = qmat_report_json(value);
    status = qmat_json_to_file(context, root, JSON_INDENT(2) | JSON_SORT_KEYS, &file->written);
    json_decref(root);
    return status;
  }
  if (value->type == QMAT_LIST) {
    return qmat_fail(context, QMAT_ERROR_USAGE, "output '%s' has %zu files, one per mesh, but a single path",
                     run->graph->outputs[file->output].name, qmat_value_count(value));
  }
  status = qmat_file_name_sides(context, (const qmat_file *)value, file->path, &file->written);
  for (size_t i = 1; status == QMAT_OK && i < file->written->part_count; i++)
    status = check_side_part(context, run, file->path, file->written->parts[i].name);
  return status == QMAT_OK ? qmat_file_check_sides(context, file->written, file->path) : status;
}

/* Whether another output of the folder has this side file: layers of one stem are over one original. */
static bool is_shared(const part_group *group, const qmat_file_part *side) {
  for (size_t i = 0; i < group->count; i++) {
    const qmat_file_part *other = &group->parts[i];
    if (strcmp(other->name, side->name) == 0 && other->size == side->size &&
        memcmp(other->bytes, side->bytes, side->size) == 0)
      return true;
  }
  return false;
}

static qmat_status add_file_parts(qmat_context *context, qmat_run_file *file, part_group *group) {
  /* qmat_file_save gives its path to the part without a name: the first of the group. */
  const char *main_name = group->count == 0 ? "" : file->path + qmat_folder_length(file->path);
  const qmat_file *made = file->written;
  file->bytes = made->parts[0].size;
  qmat_status status = qmat_digest_of(made->parts[0].bytes, file->bytes, &file->sha256);
  if (status != QMAT_OK) return qmat_fail(context, status, "cannot compute the digest of an output");
  for (size_t i = 0; i < made->part_count && status == QMAT_OK; i++)
    if (i == 0 || !is_shared(group, &made->parts[i]))
      status = add_part(context, group, i ? made->parts[i].name : main_name, made->parts[i].bytes, made->parts[i].size);
  return status;
}

static bool same_folder(const char *a, const char *b) {
  size_t length = qmat_folder_length(a);
  return length == qmat_folder_length(b) && memcmp(a, b, length) == 0;
}

/* Dates an output and its side files, also those with the same bytes as before, from the start of the run. Build tools
 * go by these times: what is edited during the run is newer than its output. */
static qmat_status touch_file(qmat_context *context, const qmat_run_file *file) {
  const struct timespec times[2] = {{.tv_nsec = UTIME_NOW}, file->planned};
  (void)utimensat(AT_FDCWD, file->path, times, 0);
  for (size_t part = 1; part < file->written->part_count; part++) {
    char *side = qmat_path_beside(file->path, file->written->parts[part].name);
    if (!side) return qmat_fail_memory(context, "output path");
    (void)utimensat(AT_FDCWD, side, times, 0);
    qmat_free(side);
  }
  return QMAT_OK;
}

static qmat_status write_group(qmat_context *context, qmat_run *run, size_t first) {
  part_group group = {0};
  qmat_status status = QMAT_OK;
  const char *path = run->files[first].path;
  for (size_t i = first; i < run->file_count && status == QMAT_OK; i++)
    if (same_folder(path, run->files[i].path)) status = add_file_parts(context, &run->files[i], &group);
  if (status == QMAT_OK) {
    const qmat_file together = {.base = {.type = QMAT_FILE}, .part_count = group.count, .parts = group.parts};
    status = qmat_file_save(context, &together, path);
  }
  for (size_t i = first; i < run->file_count && status == QMAT_OK; i++)
    if (same_folder(path, run->files[i].path)) status = touch_file(context, &run->files[i]);
  qmat_free(group.parts);
  return status;
}

qmat_status qmat_run_make_files(qmat_context *context, qmat_run *run) {
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++) status = make_file(context, run, &run->files[i]);
  return status;
}

qmat_status qmat_run_check_later_file(qmat_context *context, const qmat_run *run, const char *what, const char *path) {
  qmat_status status = check_not_read(context, run, what, path);
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++) {
    const qmat_file *made = run->files[i].written;
    for (size_t part = 1; part < made->part_count && status == QMAT_OK; part++) {
      char *side = qmat_path_beside(run->files[i].path, made->parts[part].name);
      if (!side) return qmat_fail_memory(context, "output path");
      if (qmat_same_file(path, side))
        status = qmat_fail(context, QMAT_ERROR_USAGE, "%s '%s' would overwrite a side file of output '%s'", what, path,
                           run->graph->outputs[run->files[i].output].name);
      qmat_free(side);
    }
  }
  return status;
}

qmat_status qmat_run_write(qmat_context *context, qmat_run *run) {
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++) {
    bool written = false;
    for (size_t before = 0; before < i; before++)
      if (same_folder(run->files[before].path, run->files[i].path)) written = true;
    if (!written) status = write_group(context, run, i);
  }
  return status;
}
