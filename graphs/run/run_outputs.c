/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_outputs.h"

#include <string.h>

#include "core/json_text.h"
#include "graphs/run/run_paths.h"
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

static qmat_status digest_bytes(qmat_context *context, const void *bytes, size_t size, qmat_digest *digest) {
  qmat_status status = qmat_digest_of(bytes, size, digest);
  return status == QMAT_OK ? status : qmat_fail(context, status, "cannot compute the digest of an output");
}

/* Refuses a side file that would overwrite an input. Its name was not known before the run. */
static qmat_status check_side_part(qmat_context *context, const qmat_run *run, const char *path, const char *name) {
  char *side = qmat_path_beside(path, name);
  if (!side) return qmat_fail_memory(context, "output path");
  qmat_status status = qmat_run_check_not_input(context, run, "the output's side file", side);
  qmat_free(side);
  return status;
}

/* Names an output's side files, and refuses those that would replace a file of something else. */
static qmat_status name_side_files(qmat_context *context, const qmat_run *run, qmat_run_file *file) {
  const qmat_value *value = run->slots[file->slot].value;
  if (qmat_value_item_type(value) == QMAT_REPORT) return QMAT_OK;
  if (value->type == QMAT_LIST) {
    return qmat_fail(context, QMAT_ERROR_USAGE, "output '%s' has %zu files, one per mesh, but a single path",
                     run->graph->outputs[file->output].name, qmat_value_count(value));
  }
  if (file->written) qmat_value_release(&file->written->base);
  qmat_status status = qmat_file_name_sides(context, (const qmat_file *)value, file->path, &file->written);
  for (size_t i = 1; status == QMAT_OK && i < file->written->part_count; i++)
    status = check_side_part(context, run, file->path, file->written->parts[i].name);
  return status == QMAT_OK ? qmat_file_check_sides(context, file->written, file->path) : status;
}

static qmat_status add_file_parts(qmat_context *context, qmat_run *run, qmat_run_file *file, part_group *group,
                                  char **text) {
  /* qmat_file_save gives its path to the part without a name: the first of the group. */
  const char *main_name = group->count == 0 ? "" : file->path + qmat_folder_length(file->path);
  const qmat_file *made = file->written;
  if (!made) {
    json_t *root = qmat_report_json(run->slots[file->slot].value);
    *text = root ? qmat_json_text(root, JSON_INDENT(2) | JSON_SORT_KEYS, NULL) : NULL;
    json_decref(root);
    if (!*text) return qmat_fail_memory(context, "report");
    size_t size = strlen(*text);
    (*text)[size] = '\n'; /* replaces the terminating zero */
    file->bytes = size + 1;
    qmat_status status = digest_bytes(context, *text, file->bytes, &file->sha256);
    return status == QMAT_OK ? add_part(context, group, main_name, *text, file->bytes) : status;
  }
  file->bytes = made->parts[0].size;
  qmat_status status = digest_bytes(context, made->parts[0].bytes, file->bytes, &file->sha256);
  for (size_t i = 0; i < made->part_count && status == QMAT_OK; i++)
    status = add_part(context, group, i ? made->parts[i].name : main_name, made->parts[i].bytes, made->parts[i].size);
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
  for (size_t i = 0; i < run->file_count && status == QMAT_OK; i++)
    status = name_side_files(context, run, &run->files[i]);
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
