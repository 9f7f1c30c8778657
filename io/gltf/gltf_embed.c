/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_embed.h"

#include <stdio.h>
#include <string.h>

#include "core/arena.h"
#include "io/bytes.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_keep.h"
#include "io/gltf/gltf_meshopt.h"
#include "io/gltf/gltf_uri.h"

/* ---- embedding files in the chunk ---- */

typedef struct embedder {
  qmat_context *context;
  const qmat_scene *scene;
  json_t *root;
  qmat_writer chunk;
  size_t *offsets;    /* per part of the scene: its offset in the chunk; SIZE_MAX: not in the chunk */
  json_int_t *views;  /* per part: the buffer view of an image; -1: none */
  json_int_t *buffer; /* per buffer: its offset in the chunk; -1: not in the chunk */
  size_t buffer_count;
  bool any;
} embedder;

/* The bytes that a URI stands for; NULL: they are not there. */
typedef struct source {
  const uint8_t *bytes;
  size_t size, part; /* 0: in a data URI */
  uint8_t *decoded;  /* of a data URI; owned */
} source;

static qmat_status find_source(const embedder *e, const json_t *object, source *found) {
  const json_t *uri = json_object_get(object, "uri");
  const char *text = json_string_value(uri);
  const qmat_error before = e->context->error;
  *found = (source){0};
  if (!text) return QMAT_OK;
  qmat_status status = qmat_gltf_decode_uri(e->context, text, json_string_length(uri), &found->decoded, &found->size);
  if (status == QMAT_ERROR_FORMAT) { /* a reader of the output may refuse it; the medial mesh does not need it */
    e->context->error = before;
    return QMAT_OK;
  }
  found->bytes = found->decoded;
  if (status != QMAT_OK || found->decoded) return status;
  status = qmat_gltf_find_part(e->context, e->scene, text, json_string_length(uri), &found->part);
  if (status != QMAT_OK || found->part == 0) return status;
  found->bytes = e->scene->parts[found->part].bytes;
  found->size = e->scene->parts[found->part].size;
  return QMAT_OK;
}

/* Appends the bytes to the chunk, those of a part once. Returns their offset. */
static size_t put_source(embedder *e, const source *from) {
  if (from->part > 0 && e->offsets[from->part] != SIZE_MAX) return e->offsets[from->part];
  qmat_gltf_pad(&e->chunk, 0);
  const size_t offset = e->chunk.size;
  if (from->part > 0) e->offsets[from->part] = offset;
  qmat_put_bytes(&e->chunk, from->bytes, from->size);
  e->any = true;
  return offset;
}

static qmat_status embed_buffers(embedder *e, const uint8_t *chunk, size_t size) {
  const json_t *buffers = json_object_get(e->root, "buffers");
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < e->buffer_count && status == QMAT_OK; i++) {
    const json_t *buffer = json_array_get(buffers, i);
    source from;
    e->buffer[i] = -1;
    if (i == 0 && chunk && !json_object_get(buffer, "uri")) {
      e->buffer[i] = 0;
      qmat_put_bytes(&e->chunk, chunk, size);
      continue;
    }
    status = find_source(e, buffer, &from);
    if (from.bytes && json_number_value(json_object_get(buffer, "byteLength")) <= (double)from.size)
      e->buffer[i] = (json_int_t)put_source(e, &from);
    qmat_free(from.decoded);
  }
  return status;
}

static qmat_status embed_image(embedder *e, json_t *image) {
  source from;
  const qmat_status status = find_source(e, image, &from);
  const char *type = from.bytes ? qmat_gltf_image_type(from.bytes, from.size) : NULL;
  bool done = true;
  if (type) {
    json_int_t view = from.part > 0 ? e->views[from.part] : -1;
    if (view < 0) {
      const json_int_t offset = (json_int_t)put_source(e, &from);
      json_t *added =
          json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", offset, "byteLength", (json_int_t)from.size);
      done = qmat_gltf_add(e->root, "bufferViews", added, &view);
      e->views[from.part] = view;
    }
    done = done && qmat_gltf_set(image, "bufferView", json_integer(view));
    if (!json_object_get(image, "mimeType")) done = done && qmat_gltf_set(image, "mimeType", json_string(type));
    json_object_del(image, "uri");
  }
  qmat_free(from.decoded);
  return done ? status : qmat_fail_memory(e->context, "a glTF file");
}

/* Converts owner.buffer and owner.byteOffset from the old buffers to the new ones. */
static bool renumber(const embedder *e, json_t *owner, const json_int_t *numbers) {
  const json_t *value = json_object_get(owner, "buffer");
  const double buffer = json_is_number(value) ? json_number_value(value) : -1;
  if (!(buffer >= 0 && buffer < (double)e->buffer_count)) return true;
  const size_t old = (size_t)buffer;
  if (!qmat_gltf_set(owner, "buffer", json_integer(numbers[old]))) return false;
  if (e->buffer[old] <= 0) return true;
  const json_int_t offset = (json_int_t)json_number_value(json_object_get(owner, "byteOffset"));
  return qmat_gltf_set(owner, "byteOffset", json_integer(e->buffer[old] + offset));
}

/* Merges the buffers in the chunk into one and puts it first. Views of images already refer to it. */
static bool place_buffers(const embedder *e, size_t view_count, json_int_t *numbers) {
  const json_t *old = json_object_get(e->root, "buffers"), *views = json_object_get(e->root, "bufferViews");
  json_t *buffers = json_array(), *first = NULL;
  for (size_t i = 0; i < e->buffer_count && !first; i++)
    if (e->buffer[i] >= 0) first = json_incref(json_array_get(old, i));
  if (!first) first = json_object();
  json_object_del(first, "uri");
  json_object_del(json_object_get(first, "extensions"), QMAT_GLTF_MESHOPT); /* it is no placeholder any more */
  if (json_object_size(json_object_get(first, "extensions")) == 0) json_object_del(first, "extensions");
  bool done = qmat_gltf_set(first, "byteLength", json_integer((json_int_t)e->chunk.size));
  done = json_array_append_new(buffers, first) == 0 && done;
  for (size_t i = 0; i < e->buffer_count; i++) {
    numbers[i] = e->buffer[i] >= 0 ? 0 : (json_int_t)json_array_size(buffers);
    if (e->buffer[i] < 0) done = json_array_append(buffers, json_array_get(old, i)) == 0 && done;
  }
  for (size_t i = 0; i < view_count && done; i++) {
    json_t *view = json_array_get(views, i), *extension;
    const char *name;
    done = renumber(e, view, numbers);
    json_object_foreach(json_object_get(view, "extensions"), name, extension) done =
        renumber(e, extension, numbers) && done;
  }
  return qmat_gltf_set(e->root, "buffers", buffers) && done;
}

qmat_status qmat_gltf_embed(qmat_context *context, const qmat_scene *scene, json_t *root, const uint8_t *chunk,
                            size_t size, uint8_t **made, size_t *made_size) {
  embedder e = {.context = context, .scene = scene, .root = root};
  const size_t view_count = json_array_size(json_object_get(root, "bufferViews"));
  e.buffer_count = json_array_size(json_object_get(root, "buffers"));
  *made = NULL;
  *made_size = 0;
  e.offsets = qmat_alloc(scene->part_count, sizeof *e.offsets);
  e.views = qmat_alloc(scene->part_count, sizeof *e.views);
  e.buffer = qmat_alloc(e.buffer_count, sizeof *e.buffer);
  json_int_t *numbers = qmat_alloc(e.buffer_count, sizeof *numbers);
  qmat_status status = QMAT_OK;
  if (!e.offsets || !e.views || !e.buffer || !numbers) status = qmat_fail_memory(context, "a glTF file");
  for (size_t i = 0; i < scene->part_count && status == QMAT_OK; i++) {
    e.offsets[i] = SIZE_MAX;
    e.views[i] = -1;
  }
  if (status == QMAT_OK) status = embed_buffers(&e, chunk, size);
  size_t i;
  json_t *image;
  json_array_foreach(json_object_get(root, "images"), i, image) if (status == QMAT_OK) status = embed_image(&e, image);
  qmat_gltf_pad(&e.chunk, 0);
  if (status == QMAT_OK && e.any && !place_buffers(&e, view_count, numbers))
    status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK && e.any && e.chunk.failed) status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK && e.any) {
    *made = e.chunk.bytes;
    *made_size = e.chunk.size;
    e.chunk = (qmat_writer){0};
  }
  qmat_writer_uninit(&e.chunk);
  qmat_free(numbers);
  qmat_free(e.buffer);
  qmat_free(e.views);
  qmat_free(e.offsets);
  return status;
}

/* ---- side files ---- */

typedef struct collector {
  qmat_context *context;
  const qmat_scene *scene;
  qmat_file_part *parts;
  size_t count, capacity;
  size_t *place; /* per part of the scene: 1 + its index in `parts`; 0: not there yet */
} collector;

static bool is_taken(const collector *c, const char *name) {
  for (size_t i = 1; i < c->scene->part_count; i++)
    if (strcmp(c->scene->parts[i].name, name) == 0) return true;
  for (size_t i = 0; i < c->count; i++)
    if (strcmp(c->parts[i].name, name) == 0) return true;
  return false;
}

/* The base name of a file outside the asset's folder; if it is taken, a number is added before the ending. */
static char *free_name(const collector *c, const char *name) {
  const char *base = strrchr(name, '/') + 1, *dot = strrchr(base, '.');
  if (!dot || dot == base) dot = base + strlen(base);
  char *chosen = qmat_strdup(base);
  for (size_t i = 2; chosen && is_taken(c, chosen); i++) {
    qmat_free(chosen);
    const size_t size = strlen(base) + 24;
    chosen = qmat_alloc(size, 1);
    if (chosen) snprintf(chosen, size, "%.*s-%zu%s", (int)(dot - base), base, i, dot);
  }
  return chosen;
}

/* Copies a part of the scene and takes ownership of `name`. */
static bool add_part(collector *c, size_t part, char *name) {
  const qmat_file_part *from = &c->scene->parts[part];
  if (!name || qmat_grow((void **)&c->parts, &c->capacity, c->count + 1, sizeof *c->parts) != 0) {
    qmat_free(name);
    return false;
  }
  qmat_file_part *to = &c->parts[c->count];
  *to = (qmat_file_part){.name = name, .size = from->size, .bytes = qmat_alloc(from->size, 1)};
  c->place[part] = ++c->count;
  if (!to->bytes) return false;
  memcpy(to->bytes, from->bytes, from->size);
  return true;
}

static qmat_status collect(void *user, json_t *owner, const char *key, qmat_gltf_uri_kind kind) {
  (void)kind;
  collector *c = user;
  const json_t *uri = json_object_get(owner, key);
  size_t part;
  char *name = NULL;
  qmat_status status =
      qmat_gltf_find_part(c->context, c->scene, json_string_value(uri), json_string_length(uri), &part);
  if (status == QMAT_OK && part > 0)
    status = qmat_gltf_file_name(c->context, json_string_value(uri), json_string_length(uri), &name);
  if (status != QMAT_OK || !name) return status;
  const bool is_outside = qmat_gltf_is_outside(name);
  bool done = c->place[part] > 0 || add_part(c, part, is_outside ? free_name(c, name) : qmat_strdup(name));
  if (done && is_outside) {
    char *text = qmat_gltf_uri_of(c->parts[c->place[part] - 1].name);
    done = text && qmat_gltf_set(owner, key, json_string(text));
    qmat_free(text);
  }
  qmat_free(name);
  return done ? QMAT_OK : qmat_fail_memory(c->context, "a glTF file");
}

qmat_status qmat_gltf_side_parts(qmat_context *context, const qmat_scene *scene, json_t *root, qmat_file_part **parts,
                                 size_t *count) {
  collector c = {.context = context, .scene = scene, .place = qmat_calloc(scene->part_count, sizeof *c.place)};
  const qmat_status status =
      c.place ? qmat_gltf_visit_uris(root, collect, &c) : qmat_fail_memory(context, "a glTF file");
  qmat_free(c.place);
  *parts = c.parts;
  *count = c.count;
  return status;
}
