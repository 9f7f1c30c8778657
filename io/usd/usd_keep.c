/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_keep.h"

#include <stdio.h>
#include <string.h>

#include "io/gltf/gltf_keep.h"
#include "io/usd/usd_files.h"
#include "io/usd/usdz.h"

enum { MOST_FILES = 4096, LONGEST_NAME = 255 /* in a package */ };

/* In the path of a texture: the number of a tile. USD looks for these numbers. */
#define UDIM "<UDIM>"
enum { FIRST_UDIM_TILE = 1001, LAST_UDIM_TILE = 1100 };

/* Paths of files, each once. */
typedef struct path_list {
  size_t count, capacity;
  char **paths;
} path_list;

typedef struct keeper {
  qmat_context *context;
  const qmat_usd_stage *stage;
  path_list kept;   /* the files to keep, the root layer first */
  path_list others; /* assets that are no images or cannot be read */
  const char *why;  /* nothing can be kept; NULL: it can */
} keeper;

static qmat_status fail_shortage(const keeper *k) {
  return qmat_fail_memory(k->context, "the files of a USD scene");
}

static void list_uninit(path_list *list) {
  for (size_t i = 0; i < list->count; i++) qmat_free(list->paths[i]);
  qmat_free(list->paths);
}

static bool has_path(const path_list *list, const char *path) {
  for (size_t i = 0; i < list->count; i++)
    if (strcmp(list->paths[i], path) == 0) return true;
  return false;
}

/* Adds a path, which it takes over, to one of the keeper's lists. */
static qmat_status add_path(keeper *k, path_list *list, char *path) {
  if (list->count >= MOST_FILES) k->why = "it refers to too many files";
  if (k->why || has_path(list, path)) {
    qmat_free(path);
    return QMAT_OK;
  }
  if (qmat_grow((void **)&list->paths, &list->capacity, list->count + 1, sizeof *list->paths) != 0) {
    qmat_free(path);
    return fail_shortage(k);
  }
  list->paths[list->count++] = path;
  return QMAT_OK;
}

/* Adds a warning, which it takes over. */
static qmat_status warn(const keeper *k, json_t *text) {
  return json_array_append_new(qmat_usd_stage_warnings(k->stage), text) == 0 ? QMAT_OK : fail_shortage(k);
}

/* Adds the path of an image, which it takes over; NULL is a shortage. A file that cannot be read is passed over; one
 * that is not an image is not kept, with a warning. */
static qmat_status add_image(keeper *k, char *path) {
  if (!path) return fail_shortage(k);
  qmat_status status = qmat_progress(k->context, 0, 0, "files");
  if (status != QMAT_OK || has_path(&k->kept, path) || has_path(&k->others, path)) {
    qmat_free(path);
    return status;
  }
  qmat_bytes bytes = {0};
  const qmat_error before = k->context->error;
  status = qmat_bytes_read_file(k->context, path, &bytes);
  const bool is_read = status == QMAT_OK;
  const bool is_image = is_read && (qmat_gltf_image_type(bytes.data, bytes.size) ||
                                    (bytes.size > 4 && memcmp(bytes.data, "v/1\1", 4) == 0)); /* OpenEXR */
  qmat_bytes_uninit(&bytes);
  if (status == QMAT_ERROR_IO || status == QMAT_ERROR_FORMAT) {
    k->context->error = before;
    status = QMAT_OK;
  }
  if (is_read && !is_image)
    status = warn(k, json_sprintf("'%s' is not kept for an output as USD: it is not an image", qmat_usd_shown(path)));
  const qmat_status added = add_path(k, is_image ? &k->kept : &k->others, path);
  return status == QMAT_OK ? added : status;
}

/* Adds the images of a path with <UDIM> in it, a number for each tile. */
static qmat_status add_tiles(keeper *k, const char *path, const char *place) {
  qmat_status status = QMAT_OK;
  for (int tile = FIRST_UDIM_TILE; tile <= LAST_UDIM_TILE && status == QMAT_OK; tile++) {
    char *image = qmat_alloc(strlen(path) + 1, 1);
    if (image) snprintf(image, strlen(path) + 1, "%.*s%d%s", (int)(place - path), path, tile, place + strlen(UDIM));
    status = add_image(k, image);
  }
  return status;
}

static qmat_status add_assets(keeper *k, const char *from, const qmat_usd_value *value) {
  qmat_status status = QMAT_OK;
  if (!value || value->type != QMAT_USD_ASSET) return QMAT_OK;
  for (size_t i = 0; i < value->count && status == QMAT_OK; i++) {
    char *path = value->texts[i][0] ? qmat_usd_beside(from, value->texts[i]) : NULL;
    const char *place = path ? strstr(path, UDIM) : NULL;
    if (place) {
      status = add_tiles(k, path, place);
      qmat_free(path);
    } else if (path) {
      status = add_image(k, path);
    }
  }
  return status;
}

/* Adds the images that the attributes below a spec name. */
static qmat_status add_images(keeper *k, const char *from, const qmat_usd_spec *spec) {
  qmat_status status = QMAT_OK;
  if (spec->kind == QMAT_USD_ATTRIBUTE) status = add_assets(k, from, qmat_usd_field_value(spec, "default"));
  for (const qmat_usd_spec *child = spec->first_child; child && status == QMAT_OK; child = child->next)
    status = add_images(k, from, child);
  return status;
}

/* The length of the folder that all paths are in. */
static size_t common_folder(const keeper *k) {
  const char *first = k->kept.paths[0];
  size_t length = 0;
  for (size_t end = 1; first[end - 1]; end++) {
    if (first[end - 1] != '/') continue;
    for (size_t i = 1; i < k->kept.count; i++)
      if (strncmp(k->kept.paths[i], first, end) != 0) return length;
    length = end;
  }
  return length;
}

static qmat_status pack(keeper *k, size_t folder, const qmat_bytes *root, qmat_writer *out) {
  qmat_usdz_writer archive = {.out = out};
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < k->kept.count && status == QMAT_OK && !k->why; i++) {
    qmat_bytes bytes = {0};
    if (i > 0) status = qmat_bytes_read_file(k->context, k->kept.paths[i], &bytes);
    const qmat_bytes *from = i > 0 ? &bytes : root;
    if (from->size > UINT32_MAX - out->size) k->why = "its files have more than 4 GiB";
    if (status == QMAT_OK && !k->why) qmat_usdz_add(&archive, k->kept.paths[i] + folder, from->data, from->size);
    qmat_bytes_uninit(&bytes);
  }
  qmat_usdz_finish(&archive);
  if (status == QMAT_OK && !k->why && out->failed) status = fail_shortage(k);
  return status;
}

/* Lists the files to keep, without the root layer where that is one of qmat's. */
static qmat_status list_files(keeper *k, bool without_root) {
  const qmat_usd_files *files = qmat_usd_stage_files(k->stage);
  const qmat_usd_layer *root = qmat_usd_stage_root_layer(k->stage);
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < files->file_count && status == QMAT_OK && !k->why; i++) {
    const char *path;
    const qmat_usd_layer *layer;
    bool is_member;
    qmat_usd_files_at(files, i, &path, &layer, &is_member);
    if (is_member) k->why = "it refers to packages";
    if (is_member || !path || (without_root && layer == root)) continue;
    char *copy = qmat_strdup(path);
    status = copy ? add_path(k, &k->kept, copy) : fail_shortage(k);
    if (status == QMAT_OK) status = add_images(k, path, layer->root);
  }
  return status;
}

/* Appends what is kept of a scene with the root layer in `bytes`. */
static qmat_status put_layers(keeper *k, const qmat_bytes *bytes, bool without_root, qmat_writer *out) {
  qmat_status status = list_files(k, without_root);
  if (status != QMAT_OK || k->why) return status;
  const size_t folder = k->kept.count > 1 ? common_folder(k) : 0;
  for (size_t i = 0; i < k->kept.count && k->kept.count > 1; i++)
    if (!qmat_is_part_name(k->kept.paths[i] + folder) || !qmat_is_utf8(k->kept.paths[i] + folder))
      k->why = "a file is in a folder above that of the first one";
    else if (strlen(k->kept.paths[i] + folder) > LONGEST_NAME)
      k->why = "the name of a file is too long";
  if (k->why) return QMAT_OK;
  if (k->kept.count > 1) return pack(k, folder, bytes, out);
  qmat_put_bytes(out, bytes->data, bytes->size);
  return QMAT_OK;
}

/* Appends a package, without the layer of qmat that it may start with: then what is below the folder of the original.
 */
static qmat_status put_package(const keeper *k, const qmat_bytes *bytes, const char *original, qmat_writer *out) {
  qmat_usdz package;
  const qmat_status status = qmat_usdz_open(k->context, bytes, "the scene", &package);
  const qmat_usdz_member *first = status == QMAT_OK && original ? qmat_usdz_find(&package, original) : NULL;
  const char *slash = first ? strchr(original, '/') : NULL;
  const size_t folder = slash ? (size_t)(slash - original) + 1 : 0;
  bool is_ours = folder > 0;
  for (size_t i = 1; i < package.member_count && is_ours; i++)
    is_ours = strncmp(package.members[i].name, original, folder) == 0;
  if (status == QMAT_OK && is_ours && package.member_count == 2) {
    qmat_put_bytes(out, first->bytes, first->size);
  } else if (status == QMAT_OK && is_ours) {
    qmat_usdz_writer archive = {.out = out};
    qmat_usdz_add(&archive, first->name + folder, first->bytes, first->size);
    for (size_t i = 1; i < package.member_count; i++)
      if (&package.members[i] != first)
        qmat_usdz_add(&archive, package.members[i].name + folder, package.members[i].bytes, package.members[i].size);
    qmat_usdz_finish(&archive);
  } else if (status == QMAT_OK) {
    qmat_put_bytes(out, bytes->data, bytes->size);
  }
  qmat_usdz_uninit(&package);
  return status;
}

/* Makes what was kept the only part of a scene. */
static qmat_status store(const keeper *k, const qmat_writer *out, qmat_scene *scene) {
  scene->parts = qmat_calloc(1, sizeof *scene->parts);
  if (!scene->parts || out->failed) return fail_shortage(k);
  scene->part_count = 1;
  scene->parts[0].name = qmat_strdup("");
  scene->parts[0].bytes = qmat_alloc(out->size, 1);
  if (!scene->parts[0].name || !scene->parts[0].bytes) return fail_shortage(k);
  memcpy(scene->parts[0].bytes, out->bytes, out->size);
  scene->parts[0].size = out->size;
  return QMAT_OK;
}

qmat_status qmat_usd_keep(qmat_context *context, const qmat_usd_stage *stage, const qmat_bytes *bytes,
                          qmat_scene *scene) {
  keeper k = {.context = context, .stage = stage};
  const char *original = qmat_usd_original_of(qmat_usd_stage_root_layer(stage)), *path;
  const qmat_usd_layer *layer;
  bool is_member;
  qmat_bytes below = {0};
  qmat_writer out = {0};
  qmat_status status = QMAT_OK;
  qmat_usd_files_at(qmat_usd_stage_files(stage), 0, &path, &layer, &is_member);
  char *beside =
      original && path && !qmat_usdz_is_package(bytes->data, bytes->size) ? qmat_usd_beside(path, original) : NULL;
  if (beside) status = qmat_bytes_read_file(context, beside, &below);
  if (status == QMAT_OK && original)
    status = warn(&k, json_sprintf("what an earlier run has added is left out: an output as USD is a layer over '%s'",
                                   qmat_usd_shown(original)));
  const qmat_bytes *root = beside ? &below : bytes;
  if (status == QMAT_OK)
    status = qmat_usdz_is_package(root->data, root->size) ? put_package(&k, root, beside ? NULL : original, &out)
                                                          : put_layers(&k, root, beside != NULL, &out);
  if (status == QMAT_OK)
    status = k.why ? warn(&k, json_sprintf("the scene is not kept for an output as USD: %s", k.why))
                   : store(&k, &out, scene);
  qmat_writer_uninit(&out);
  qmat_bytes_uninit(&below);
  qmat_free(beside);
  list_uninit(&k.kept);
  list_uninit(&k.others);
  return status;
}
