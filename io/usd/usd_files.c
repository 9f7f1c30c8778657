/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_files.h"

#include <stdio.h>
#include <string.h>

#include "io/usd/usda.h"
#include "io/usd/usdc.h"
#include "io/usd/usdz.h"

enum { MOST_FILES = 4096, PADDING = 16 };

/* An archive, opened once. */
typedef struct qmat_usd_package {
  char *path;
  qmat_bytes file; /* empty for the one that the caller owns */
  qmat_usdz archive;
} package;

typedef struct qmat_usd_file {
  qmat_usd_layer layer; /* first: stacks point to it */
  char *path;           /* of the file, or of the member in its package */
  int package;          /* -1: not in a package */
  bool is_missing;
  struct qmat_usd_file *first; /* of a package: its first member, which is the layer; else NULL */
} file;

static qmat_status fail_memory(const qmat_usd_prim *prim) {
  return qmat_fail_memory(prim->log->context, "a USD stage");
}

/* ---- paths ---- */

/* The path of `asset` relative to the folder of the file `from`, with "." and ".." resolved as far as possible. Free
 * with qmat_free; NULL when memory is short. */
static char *resolve(const char *from, const char *asset) {
  const char *slash = strrchr(from, '/');
  const size_t folder = slash ? (size_t)(slash - from) + 1 : 0, length = strlen(asset);
  char *path = qmat_alloc(folder + length + 1, 1);
  if (!path) return NULL;
  memcpy(path, from, folder);
  size_t used = folder;
  for (const char *part = asset; *part;) {
    size_t size = strcspn(part, "/\\");
    const char *next = part + size + (part[size] != '\0');
    bool last = *next == '\0';
    if (size == 0 || (size == 1 && part[0] == '.')) {
      part = next;
      continue;
    }
    if (size == 2 && part[0] == '.' && part[1] == '.' && used > 0) {
      size_t start = used - 1; /* before the slash */
      while (start > 0 && path[start - 1] != '/') start--;
      bool is_dots = used - start == 3 && path[start] == '.' && path[start + 1] == '.';
      bool is_dot = used - start == 2 && path[start] == '.';
      if (!is_dots && !is_dot && used - start > 1) {
        used = start;
        part = next;
        continue;
      }
    }
    memcpy(path + used, part, size);
    used += size;
    if (!last) path[used++] = '/';
    part = next;
  }
  path[used] = '\0';
  return path;
}

/* Whether the asset cannot be beside the layer: an absolute path, an address, or a member of a package. */
static bool is_elsewhere(const char *asset) {
  return asset[0] == '/' || strstr(asset, "://") || (asset[0] && asset[1] == ':') || strchr(asset, '[');
}

static file *find_file(const qmat_usd_files *files, const char *path, int package) {
  for (size_t i = 0; i < files->file_count; i++) {
    if (files->files[i]->package == package && strcmp(files->files[i]->path, path) == 0) return files->files[i];
  }
  return NULL;
}

/* ---- reading ---- */

/* Adds a file at `path`, which it takes over; NULL when memory is short. */
static file *add_file(qmat_usd_files *files, char *path, int package) {
  file *added = path ? qmat_calloc(1, sizeof *added) : NULL;
  if (!added ||
      qmat_grow((void **)&files->files, &files->file_capacity, files->file_count + 1, sizeof *files->files) != 0) {
    qmat_free(added);
    qmat_free(path);
    return NULL;
  }
  added->path = path;
  added->package = package;
  files->files[files->file_count++] = added;
  return added;
}

static qmat_status read_layer(qmat_usd_files *files, const qmat_usd_prim *prim, const qmat_bytes *bytes,
                              const char *path, file *into) {
  qmat_status status = qmat_usdc_is_crate(bytes) ? qmat_usdc_read(prim->log->context, bytes, path, &into->layer)
                                                 : qmat_usda_read(prim->log->context, bytes, path, &into->layer);
  files->layers_read++;
  files->specs_read += into->layer.specs.count;
  return status;
}

/* Reads a member of a package as a layer. */
static qmat_status read_member(qmat_usd_files *files, const qmat_usd_prim *prim, const package *from,
                               const qmat_usdz_member *member, file *into) {
  const size_t size = strlen(from->path) + strlen(member->name) + 3;
  char *name = qmat_alloc(size, 1);
  /* Readers need zero bytes behind the text, which a member does not have. */
  qmat_bytes copy = {.size = member->size, .data = qmat_calloc(member->size + PADDING, 1)};
  qmat_status status = QMAT_OK;
  if (!name || !copy.data) {
    status = fail_memory(prim);
  } else {
    memcpy(copy.data, member->bytes, member->size);
    snprintf(name, size, "%s[%s]", from->path, member->name);
    status = read_layer(files, prim, &copy, name, into);
  }
  qmat_bytes_uninit(&copy);
  qmat_free(name);
  return status;
}

/* Opens the archive in `bytes`, and reads its first member. `owned` is taken over. */
static qmat_status open_package(qmat_usd_files *files, const qmat_usd_prim *prim, const qmat_bytes *bytes,
                                qmat_bytes owned, const char *path, file **opened) {
  if (qmat_grow((void **)&files->packages, &files->package_capacity, files->package_count + 1,
                sizeof *files->packages) != 0) {
    qmat_bytes_uninit(&owned);
    return fail_memory(prim);
  }
  const int number = (int)files->package_count++;
  package *made = &files->packages[number];
  *made = (package){.path = qmat_strdup(path), .file = owned};
  if (!made->path) return fail_memory(prim);
  qmat_status status = qmat_usdz_open(prim->log->context, bytes, path, &made->archive);
  if (status != QMAT_OK) return status;
  if (made->archive.member_count == 0)
    return qmat_fail_file(prim->log->context, QMAT_ERROR_FORMAT, path, "the archive is empty");
  const qmat_usdz_member *first = &made->archive.members[0];
  *opened = add_file(files, qmat_strdup(first->name), number);
  return *opened ? read_member(files, prim, made, first, *opened) : fail_memory(prim);
}

/* Opens a new file in the package of `beside`; NULL with a warning when it is missing. `path` is taken over. */
static qmat_status open_member(qmat_usd_files *files, const qmat_usd_prim *prim, const file *beside, char *path,
                               const char *asset, const char *what, file **opened) {
  const package *from = &files->packages[beside->package];
  const qmat_usdz_member *member = qmat_usdz_find(&from->archive, path);
  file *added = add_file(files, path, beside->package);
  if (!added) return fail_memory(prim);
  added->is_missing = !member || qmat_usdz_is_package(member->bytes, member->size);
  if (added->is_missing)
    return qmat_usd_warn(prim, "the %s @%s@ is skipped: %s", what, qmat_usd_shown(asset),
                         member ? "packages in packages are not read" : "it is not in the package");
  *opened = added;
  return read_member(files, prim, from, member, added);
}

/* Opens a new file; NULL with a warning when it cannot be opened. `path` is taken over. */
static qmat_status open_file(qmat_usd_files *files, const qmat_usd_prim *prim, char *path, const char *asset,
                             const char *what, file **opened) {
  qmat_context *context = prim->log->context;
  qmat_bytes bytes = {0};
  qmat_status status = qmat_bytes_read_file(context, path, &bytes);
  if (status != QMAT_OK && status != QMAT_ERROR_IO) {
    qmat_free(path);
    return status;
  }
  file *added = add_file(files, path, -1);
  if (!added) {
    qmat_bytes_uninit(&bytes);
    return fail_memory(prim);
  }
  if (status == QMAT_ERROR_IO) { /* the scene is read without it */
    char reason[sizeof context->error.message];
    memcpy(reason, context->error.message, sizeof reason);
    context->error = (qmat_error){.element = -1};
    added->is_missing = true;
    return qmat_usd_warn(prim, "the %s @%s@ is skipped: %s", what, qmat_usd_shown(asset), reason);
  }
  *opened = added;
  files->bytes_read += bytes.size;
  if (qmat_usdz_is_package(bytes.data, bytes.size)) {
    status = open_package(files, prim, &bytes, bytes, path, &added->first);
    *opened = added->first;
    return status;
  }
  status = read_layer(files, prim, &bytes, path, added);
  qmat_bytes_uninit(&bytes);
  return status;
}

/* Finds or opens the file that the layer `from` calls `asset`; NULL with a warning when it is missing. */
static qmat_status find_asset(qmat_usd_files *files, const qmat_usd_prim *prim, const qmat_usd_layer *from,
                              const char *asset, const char *what, file **found) {
  const file *beside = (const file *)from;
  *found = NULL;
  if (asset[0] == '`')
    return qmat_usd_warn(prim, "the %s @%s@ is skipped: variable expressions are not read", what,
                         qmat_usd_shown(asset));
  if (is_elsewhere(asset)) {
    return qmat_usd_warn(prim, "the %s @%s@ is skipped: only files beside the layer are read", what,
                         qmat_usd_shown(asset));
  }
  char *path = resolve(beside->path, asset);
  if (!path) return fail_memory(prim);
  file *known = find_file(files, path, beside->package);
  if (!known && files->file_count < MOST_FILES) {
    return beside->package >= 0 ? open_member(files, prim, beside, path, asset, what, found)
                                : open_file(files, prim, path, asset, what, found);
  }
  qmat_free(path);
  if (!known) return qmat_usd_prim_fail(prim, "the scene has more than %d files", MOST_FILES);
  if (known->is_missing)
    return qmat_usd_warn(prim, "the %s @%s@ is skipped: there is no such file", what, qmat_usd_shown(asset));
  *found = known->first ? known->first : known;
  return QMAT_OK;
}

/* ---- stacks ---- */

/* Adds a layer and its sublayers. A layer that is already in the stack is not added again. */
static qmat_status add_to_stack(qmat_usd_files *files, const qmat_usd_prim *prim, qmat_usd_stack *stack,
                                const qmat_usd_layer *layer, qmat_usd_time time, int depth) {
  for (size_t i = 0; i < stack->count; i++) {
    if (stack->layers[i] == layer) return QMAT_OK;
  }
  if (depth > QMAT_USD_DEEPEST_ARCS)
    return qmat_usd_prim_fail(prim, "sublayers are nested more than %d deep", QMAT_USD_DEEPEST_ARCS);
  if (qmat_grow((void **)&stack->layers, &stack->capacity, stack->count + 1, sizeof *stack->layers) != 0 ||
      qmat_grow((void **)&stack->times, &stack->time_capacity, stack->count + 1, sizeof *stack->times) != 0)
    return fail_memory(prim);
  stack->times[stack->count] = time;
  stack->layers[stack->count++] = layer;
  qmat_status status = QMAT_OK;
  if (qmat_usd_field_value(layer->root, "layerRelocates") || qmat_usd_field_value(layer->root, "relocates"))
    status = qmat_usd_warn(prim, "the relocates of a layer are skipped");
  const qmat_usd_value *names = qmat_usd_field_value(layer->root, "subLayers");
  const qmat_usd_value *times = qmat_usd_field_value(layer->root, "subLayerOffsets");
  if (!names || !names->is_array || !qmat_usd_is_text(names->type)) return status;
  if (times && (!times->is_array || times->components != 2 || !qmat_usd_is_number(times->type))) times = NULL;
  for (size_t i = 0; i < names->count && status == QMAT_OK; i++) {
    file *sublayer;
    status = find_asset(files, prim, layer, names->texts[i], "sublayer", &sublayer);
    if (status != QMAT_OK || !sublayer) continue;
    qmat_usd_time own = {.scale = 1};
    if (times && i < times->count)
      own = (qmat_usd_time){.offset = times->numbers[2 * i], .scale = times->numbers[2 * i + 1]};
    own.scale *= qmat_usd_codes_per_second(layer) / qmat_usd_codes_per_second(&sublayer->layer);
    status = add_to_stack(files, prim, stack, &sublayer->layer, qmat_usd_time_through(time, own), depth + 1);
  }
  return status;
}

qmat_usd_time qmat_usd_stack_time(const qmat_usd_stack *stack, const qmat_usd_layer *layer) {
  for (size_t i = 0; i < stack->count; i++)
    if (stack->layers[i] == layer) return stack->times[i];
  return (qmat_usd_time){.scale = 1};
}

/* Finds the stack whose strongest layer is `layer`, or makes it. */
static qmat_status find_stack(qmat_usd_files *files, const qmat_usd_prim *prim, const qmat_usd_layer *layer,
                              size_t *found) {
  for (*found = 0; *found < files->stack_count; ++*found) {
    if (files->stacks[*found].layers[0] == layer) return QMAT_OK;
  }
  if (qmat_grow((void **)&files->stacks, &files->stack_capacity, files->stack_count + 1, sizeof *files->stacks) != 0)
    return fail_memory(prim);
  qmat_usd_stack *stack = &files->stacks[files->stack_count++];
  *stack = (qmat_usd_stack){0};
  return add_to_stack(files, prim, stack, layer, (qmat_usd_time){.scale = 1}, 0);
}

/* ---- opening and closing ---- */

qmat_status qmat_usd_files_open(qmat_usd_files *files, const qmat_usd_prim *root, const qmat_bytes *bytes,
                                const char *path) {
  file *opened = NULL;
  size_t stack;
  qmat_status status;
  files->bytes_read = bytes->size;
  if (qmat_usdz_is_package(bytes->data, bytes->size)) {
    status = open_package(files, root, bytes, (qmat_bytes){0}, path, &opened);
  } else {
    opened = add_file(files, qmat_strdup(path), -1);
    status = opened ? read_layer(files, root, bytes, path, opened) : fail_memory(root);
  }
  return status == QMAT_OK ? find_stack(files, root, &opened->layer, &stack) : status;
}

qmat_status qmat_usd_files_find(qmat_usd_files *files, const qmat_usd_prim *prim, const qmat_usd_layer *from,
                                const char *asset, const char *what, size_t *found) {
  file *layer;
  *found = SIZE_MAX;
  qmat_status status = find_asset(files, prim, from, asset, what, &layer);
  return status == QMAT_OK && layer ? find_stack(files, prim, &layer->layer, found) : status;
}

void qmat_usd_files_at(const qmat_usd_files *files, size_t number, const char **path, const qmat_usd_layer **layer,
                       bool *is_member) {
  const file *at = files->files[number];
  const bool is_layer = !at->is_missing && !at->first;
  *path = is_layer ? at->path : NULL;
  *layer = is_layer ? &at->layer : NULL;
  *is_member = at->package >= 0;
}

char *qmat_usd_beside(const char *from, const char *asset) {
  return is_elsewhere(asset) ? NULL : resolve(from, asset);
}

void qmat_usd_files_uninit(qmat_usd_files *files) {
  for (size_t i = 0; i < files->file_count; i++) {
    qmat_usd_layer_uninit(&files->files[i]->layer);
    qmat_free(files->files[i]->path);
    qmat_free(files->files[i]);
  }
  for (size_t i = 0; i < files->package_count; i++) {
    qmat_usdz_uninit(&files->packages[i].archive);
    qmat_bytes_uninit(&files->packages[i].file);
    qmat_free(files->packages[i].path);
  }
  for (size_t i = 0; i < files->stack_count; i++) {
    qmat_free(files->stacks[i].layers);
    qmat_free(files->stacks[i].times);
  }
  qmat_free(files->files);
  qmat_free(files->packages);
  qmat_free(files->stacks);
  *files = (qmat_usd_files){0};
}
