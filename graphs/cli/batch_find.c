/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <dirent.h>
#include <errno.h>
#include <fnmatch.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "graphs/cli/batch.h"
#include "graphs/graph_names.h"
#include "graphs/run/run_paths.h"
#include "io/bytes.h"
#include "io/model.h"
#include "io/scanner.h"

enum { MOST_FOLDERS = 64 }; /* in each other; a link may lead back */

typedef struct finder {
  qmat_context *context;
  qmat_batch *batch;
  const char *results; /* the folder of the results, in which no model is looked for */
  char root[4096];     /* the deepest folder that all arguments share: "" or ends in '/' */
  bool rooted;
  size_t found; /* models, those that are found again too */
} finder;

static const char *without_dots(const char *path) {
  while (path[0] == '.' && path[1] == '/')
    for (path += 2; *path == '/';) path++;
  return path;
}

/* Makes the root the deepest folder that it shares with the first `length` bytes of `path`. */
static void share_root(finder *f, const char *path, size_t length) {
  const char *folder = without_dots(path);
  length -= (size_t)(folder - path) < length ? (size_t)(folder - path) : length;
  size_t same = 0;
  if (!f->rooted) snprintf(f->root, sizeof f->root, "%.*s", (int)length, folder);
  while (same < length && f->root[same] == folder[same]) same++;
  if (f->rooted)
    while (same > 0 && f->root[same - 1] != '/') same--;
  f->root[same] = 0;
  f->rooted = true;
}

static qmat_status add_model(finder *f, const char *path) {
  qmat_batch *batch = f->batch;
  f->found++;
  char *input = qmat_strdup(path);
  if (!input || qmat_grow((void **)&batch->assets, &batch->capacity, batch->count + 1, sizeof *batch->assets) != 0) {
    qmat_free(input);
    return qmat_fail_memory(f->context, "assets");
  }
  batch->assets[batch->count++] = (qmat_asset){.input = input};
  return QMAT_OK;
}

/* Adds a folder below an argument that cannot be read: it fails like a model, and the others run. */
static qmat_status add_unreadable(finder *f, const char *folder, const char *reason) {
  const qmat_status status = add_model(f, folder);
  if (status != QMAT_OK) return status;
  qmat_asset *asset = &f->batch->assets[f->batch->count - 1];
  asset->state = QMAT_ASSET_FAILED;
  asset->exit_code = -1;
  asset->result = json_pack("{s:{s:o}}", "error", "text", json_sprintf("cannot read the folder: %s", reason));
  return QMAT_OK;
}

static int by_name(const struct dirent **a, const struct dirent **b) {
  return strcmp((*a)->d_name, (*b)->d_name);
}

static bool is_model(const char *path) {
  const qmat_format format = qmat_format_of_name(path);
  return format != QMAT_FORMAT_UNKNOWN && format != QMAT_FORMAT_MA && format != QMAT_FORMAT_ZIP;
}

/* Adds the files that match the rest of a pattern below a folder, in the order of their names. `folder` is "" or ends
 * in '/'. "**" stands for any folders; NULL: all models in the folder and below. Hidden files match only patterns that
 * start with a dot. */
static qmat_status add_matches(finder *f, const char *folder, const char *rest, int depth) {
  struct dirent **entries;
  char part[256];
  const size_t length = rest ? strcspn(rest, "/") : 0;
  const char *next = rest && rest[length] ? rest + length + strspn(rest + length, "/") : NULL;
  snprintf(part, sizeof part, "%.*s", (int)length, rest ? rest : "");
  const bool any = !rest || strcmp(part, "**") == 0;
  if (rest && any && !next) return add_matches(f, folder, NULL, depth);
  if (depth == MOST_FOLDERS || (f->results && *folder && qmat_same_file(folder, f->results))) return QMAT_OK;
  const int count = scandir(*folder ? folder : ".", &entries, NULL, by_name);
  if (count < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return QMAT_OK;
    if (depth > 0) return add_unreadable(f, folder, strerror(errno));
    qmat_fail(f->context, QMAT_ERROR_IO, "cannot read the folder: %s", strerror(errno));
    return qmat_fail_at(f->context, folder, 0, 0);
  }
  qmat_status status = QMAT_OK;
  /* "**" also stands for no folder. */
  if (rest && any) status = add_matches(f, folder, next, depth + 1);
  for (int i = 0; i < count; i++) {
    const char *name = entries[i]->d_name;
    char path[4096];
    struct stat about, link;
    const int size = snprintf(path, sizeof path - 1, "%s%s", folder, name);
    const bool fits = status == QMAT_OK && size < (int)sizeof path - 1 && strcmp(name, ".") != 0 &&
                      strcmp(name, "..") != 0 && (any ? *name != '.' : fnmatch(part, name, FNM_PERIOD) == 0);
    if (fits && stat(path, &about) == 0) {
      const bool below = S_ISDIR(about.st_mode);
      /* A link that leads back would be followed for ever. */
      const bool followed = !any || (lstat(path, &link) == 0 && !S_ISLNK(link.st_mode));
      if (below) memcpy(path + size, "/", 2);
      if (below && followed && (any || next))
        status = add_matches(f, path, any ? rest : next, depth + 1);
      else if (!below && (rest ? !any && !next : is_model(path)))
        status = add_model(f, path);
    }
    free(entries[i]);
  }
  free(entries);
  return status;
}

static qmat_status fail_results(const finder *f, const char *argument) {
  qmat_fail(f->context, QMAT_ERROR_USAGE, "'%s' is the folder of the results, where models are not looked for",
            qmat_show(argument).text);
  return qmat_fail_hint(f->context, "choose another folder for the results");
}

/* Adds what an argument names: the matches of a pattern, the models in a folder, or a file. */
static qmat_status add_argument(finder *f, const char *argument) {
  struct stat about;
  const size_t before = f->found;
  char folder[4096];
  if (stat(argument, &about) != 0 && strpbrk(argument, "*?[")) {
    size_t length = strcspn(argument, "*?[");
    while (length > 0 && argument[length - 1] != '/') length--;
    if (length >= sizeof folder) return qmat_fail(f->context, QMAT_ERROR_USAGE, "the pattern is too long");
    snprintf(folder, sizeof folder, "%.*s", (int)length, argument);
    share_root(f, folder, length);
    const qmat_status status = add_matches(f, folder, argument + length, 0);
    if (status != QMAT_OK || f->found > before) return status;
    if (f->results && qmat_same_file(*folder ? folder : ".", f->results)) return fail_results(f, argument);
    return qmat_fail(f->context, QMAT_ERROR_USAGE, "no file matches '%s'", argument);
  }
  if (stat(argument, &about) != 0 || !S_ISDIR(about.st_mode)) {
    share_root(f, argument, qmat_folder_length(argument));
    return add_model(f, argument);
  }
  const size_t length = strlen(argument);
  if (length + 2 > sizeof folder) return qmat_fail(f->context, QMAT_ERROR_USAGE, "the path is too long");
  snprintf(folder, sizeof folder, "%s%s", argument, length > 0 && argument[length - 1] == '/' ? "" : "/");
  if (strcmp(without_dots(folder), "") == 0) folder[0] = 0;
  share_root(f, folder, strlen(folder));
  const qmat_status status = add_matches(f, folder, NULL, 0);
  if (status != QMAT_OK || f->found > before) return status;
  if (f->results && qmat_same_file(*folder ? folder : ".", f->results)) return fail_results(f, argument);
  qmat_fail(f->context, QMAT_ERROR_USAGE, "there are no models in this folder");
  return qmat_fail_at(f->context, argument, 0, 0);
}

/* Adds the files of a list, whose paths are relative to its folder. Lines that start with # are comments. */
static qmat_status read_list(finder *f, const char *path) {
  qmat_bytes bytes = {0};
  qmat_status status = qmat_bytes_read_file(f->context, path, &bytes);
  const char *line = (const char *)bytes.data, *const end = line + bytes.size;
  const size_t before = f->batch->count;
  line += qmat_byte_order_mark(line, bytes.size);
  while (status == QMAT_OK && line < end) {
    const size_t length = strcspn(line, "\r\n");
    char model[4096];
    if (memchr(line, 0, length + 1) && line + length < end) {
      qmat_fail(f->context, QMAT_ERROR_FORMAT, "this is not a list of paths: it has a zero byte");
      status = qmat_fail_at(f->context, path, 0, 0);
    } else if (length > 0 && *line != '#') {
      snprintf(model, sizeof model, "%.*s%.*s", *line == '/' ? 0 : (int)qmat_folder_length(path), path, (int)length,
               line);
      share_root(f, model, qmat_folder_length(model));
      status = add_model(f, model);
    }
    line += length + 1;
  }
  qmat_bytes_uninit(&bytes);
  if (status == QMAT_OK && f->batch->count == before) {
    qmat_fail(f->context, QMAT_ERROR_USAGE, "the list has no paths");
    status = qmat_fail_at(f->context, path, 0, 0);
  }
  return status;
}

/* Names the results of an asset: its path below the root, without the ending. */
static qmat_status name_results(finder *f, qmat_asset *asset) {
  const char *path = without_dots(asset->input);
  if (strncmp(path, f->root, strlen(f->root)) == 0) path += strlen(f->root);
  char *name =
      asset->state == QMAT_ASSET_FAILED ? qmat_strdup("") : qmat_model_name(path); /* a folder keeps its path */
  const size_t folder = qmat_folder_length(path), length = name ? strlen(name) : 0;
  asset->stem = name ? qmat_alloc(folder + length + 1, 1) : NULL;
  if (asset->stem) {
    memcpy(asset->stem, path, folder);
    memcpy(asset->stem + folder, name, length + 1);
    qmat_fold_dots(asset->stem);
    qmat_repair_utf8(asset->stem);
  }
  qmat_free(name);
  return asset->stem ? QMAT_OK : qmat_fail_memory(f->context, "assets");
}

static int by_input(const void *a, const void *b) {
  const qmat_asset *first = *(const qmat_asset *const *)a, *second = *(const qmat_asset *const *)b;
  const int order = strcmp(first->input, second->input);
  return order != 0 ? order : (first > second) - (first < second);
}

/* Takes out models that were found before. */
static qmat_status drop_repeated(qmat_context *context, qmat_batch *batch) {
  qmat_asset **sorted = qmat_alloc(batch->count, sizeof *sorted);
  if (!sorted) return qmat_fail_memory(context, "assets");
  for (size_t i = 0; i < batch->count; i++) sorted[i] = &batch->assets[i];
  if (batch->count > 0) qsort(sorted, batch->count, sizeof *sorted, by_input);
  for (size_t i = batch->count; i-- > 1;) {
    if (strcmp(sorted[i - 1]->input, sorted[i]->input) != 0) continue;
    qmat_free(sorted[i]->input);
    json_decref(sorted[i]->result);
    sorted[i]->input = NULL;
  }
  size_t kept = 0;
  for (size_t i = 0; i < batch->count; i++)
    if (batch->assets[i].input) batch->assets[kept++] = batch->assets[i];
  batch->count = kept;
  qmat_free(sorted);
  return QMAT_OK;
}

static int by_stem(const void *a, const void *b) {
  return strcmp((*(const qmat_asset *const *)a)->stem, (*(const qmat_asset *const *)b)->stem);
}

static qmat_status check_stems(qmat_context *context, const qmat_batch *batch) {
  const qmat_asset **sorted = qmat_alloc(batch->count, sizeof *sorted);
  if (!sorted) return qmat_fail_memory(context, "assets");
  for (size_t i = 0; i < batch->count; i++) sorted[i] = &batch->assets[i];
  qsort(sorted, batch->count, sizeof *sorted, by_stem);
  qmat_status status = QMAT_OK;
  for (size_t i = 1; i < batch->count && status == QMAT_OK; i++)
    if (strcmp(sorted[i - 1]->stem, sorted[i]->stem) == 0)
      status = qmat_fail(context, QMAT_ERROR_USAGE, "the results of '%s' and '%s' would have the same name",
                         sorted[i - 1]->input, sorted[i]->input);
  qmat_free(sorted);
  return status;
}

static qmat_status add_list(finder *f, const char *list) {
  struct stat about;
  const bool is_list = !strpbrk(list, "*?[") && !(stat(list, &about) == 0 && S_ISDIR(about.st_mode));
  return is_list ? read_list(f, list) : add_argument(f, list);
}

qmat_status qmat_batch_find(qmat_context *context, const char *const *arguments, size_t count, const char *const *lists,
                            size_t list_count, const char *results, qmat_batch *batch) {
  *batch = (qmat_batch){0};
  finder f = {.context = context, .batch = batch, .results = results};
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < list_count && status == QMAT_OK; i++) status = add_list(&f, lists[i]);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) status = add_argument(&f, arguments[i]);
  if (status == QMAT_OK) status = drop_repeated(context, batch);
  for (size_t i = 0; i < batch->count && status == QMAT_OK; i++) status = name_results(&f, &batch->assets[i]);
  return status == QMAT_OK ? check_stems(context, batch) : status;
}
