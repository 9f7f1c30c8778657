/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/side_files.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "io/bytes.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_uri.h"
#include "io/save.h"
#include "io/usd/usdc_original.h"

static const char *base_of(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

/* The extension of a base name with its dot, or the end of the name. */
static const char *ending_of(const char *base) {
  const char *dot = strrchr(base, '.');
  return dot && dot != base ? dot : base + strlen(base);
}

/* ---- names ---- */

/* The longest file name that file systems support. */
enum { LONGEST_NAME = 255 };

typedef struct namer {
  qmat_context *context;
  const qmat_file *file;
  const char *stem; /* of the main part's name */
  size_t stem_length, buffers;
  char **names; /* per part; NULL: not named yet */
} namer;

static bool is_taken(const namer *n, const char *name) {
  for (size_t i = 1; i < n->file->part_count; i++)
    if (n->names[i] && strcmp(n->names[i], name) == 0) return true;
  return false;
}

/* Makes "out_t.png" or "out_t-2.png". A long base name loses its first characters. NULL if memory is short. */
static char *make_name(const namer *n, const char *base) {
  char name[LONGEST_NAME + 1];
  const char *ending = ending_of(base);
  for (size_t i = 1;; i++) {
    char number[24] = "";
    if (i > 1) snprintf(number, sizeof number, "-%zu", i);
    const size_t used = n->stem_length + 1 + strlen(base) + strlen(number);
    size_t surplus = used > LONGEST_NAME ? used - LONGEST_NAME : 0;
    const char *from = base + (surplus < (size_t)(ending - base) ? surplus : (size_t)(ending - base));
    while (((unsigned char)*from & 0xC0) == 0x80) from++; /* not inside a UTF-8 character */
    snprintf(name, sizeof name, "%.*s_%.*s%s%s", (int)n->stem_length, n->stem, (int)(ending - from), from, number,
             ending);
    if (!is_taken(n, name)) return qmat_strdup(name);
  }
}

/* Finds the part that a URI refers to; 0: none. */
static qmat_status find_part(const namer *n, const json_t *uri, size_t *part) {
  char *name;
  *part = 0;
  const qmat_status status = qmat_gltf_file_name(n->context, json_string_value(uri), json_string_length(uri), &name);
  for (size_t i = 1; status == QMAT_OK && name && i < n->file->part_count && *part == 0; i++)
    if (strcmp(n->file->parts[i].name, name) == 0) *part = i;
  qmat_free(name);
  return status;
}

static qmat_status count_buffer(void *user, json_t *owner, const char *key, qmat_gltf_uri_kind kind) {
  namer *n = user;
  size_t part = 0;
  const qmat_status status = kind == QMAT_GLTF_BUFFER_URI ? find_part(n, json_object_get(owner, key), &part) : QMAT_OK;
  n->buffers += part > 0;
  return status;
}

static qmat_status rename_part(void *user, json_t *owner, const char *key, qmat_gltf_uri_kind kind) {
  namer *n = user;
  size_t part = 0;
  const qmat_status status = find_part(n, json_object_get(owner, key), &part);
  if (status != QMAT_OK || part == 0) return status;
  char **name = &n->names[part];
  if (!*name && kind == QMAT_GLTF_BUFFER_URI && n->buffers == 1 && n->stem_length + 4 <= LONGEST_NAME) {
    *name = qmat_alloc(n->stem_length + 5, 1);
    if (*name) snprintf(*name, n->stem_length + 5, "%.*s.bin", (int)n->stem_length, n->stem);
  } else if (!*name) {
    *name = make_name(n, base_of(n->file->parts[part].name));
  }
  char *uri = *name ? qmat_gltf_uri_of(*name) : NULL;
  const bool done = uri && qmat_gltf_set(owner, key, json_string(uri));
  qmat_free(uri);
  return done ? QMAT_OK : qmat_fail_memory(n->context, "the names of output files");
}

/* Names the parts, and writes the main part with the new URIs. */
static qmat_status rename_parts(namer *n, qmat_writer *out) {
  const qmat_file_part *main_part = &n->file->parts[0];
  qmat_gltf_asset asset;
  qmat_status status = qmat_gltf_asset_init(n->context, main_part->bytes, main_part->size, "the output", &asset);
  if (status == QMAT_OK) status = qmat_gltf_visit_uris(asset.root, count_buffer, n);
  if (status == QMAT_OK) status = qmat_gltf_visit_uris(asset.root, rename_part, n);
  if (status == QMAT_OK) status = qmat_gltf_asset_put(n->context, &asset, NULL, 0, out);
  qmat_gltf_asset_uninit(&asset);
  return status;
}

/* Appends `text`, with `name` for the side part's own name, which stands between quotes or at signs. */
static void put_renamed(qmat_writer *out, const qmat_file_part *text, const char *own, const char *name) {
  const size_t length = strlen(own);
  const char *at = (const char *)text->bytes, *end = at + text->size, *kept = at;
  const bool plain = !strpbrk(name, "@\"\\");
  for (; (size_t)(end - at) > length + 1; at++) {
    if ((at[0] != '@' && at[0] != '"') || at[length + 1] != at[0] || memcmp(at + 1, own, length) != 0) continue;
    qmat_put_bytes(out, kept, (size_t)(at - kept));
    const char *quote = at[0] == '@' ? plain ? "@" : "@@@" : "\"";
    qmat_put_text(out, quote);
    qmat_put_text(out, at[0] == '@' || plain ? name : own);
    qmat_put_text(out, quote);
    kept = at + length + 2;
    if (at[0] == '@') break; /* the sublayer, which comes last */
    at = kept - 1;
  }
  qmat_put_bytes(out, kept, (size_t)(end - kept));
}

/* Names the file that a layer of USD is over: for "x/out.usda" and "original.usdc", "out_original.usdc". */
static qmat_status name_original(qmat_context *context, const qmat_file *file, const char *path, qmat_file **named) {
  const char *base = base_of(path), *own = file->parts[1].name;
  char **names = qmat_calloc(2, sizeof *names);
  const namer n = {
      .file = file, .stem = base, .stem_length = (size_t)(ending_of(base) - base), .names = names, .context = context};
  char *name = names ? make_name(&n, own) : NULL;
  qmat_writer out = {0};
  qmat_file *made = qmat_file_new();
  if (made) {
    made->format = qmat_strdup(file->format);
    made->parts = qmat_calloc(2, sizeof *made->parts);
    if (made->parts) made->part_count = 2;
  }
  qmat_status status = QMAT_OK;
  if (!name || !made || !made->format || !made->parts) status = qmat_fail_memory(context, "the output file");
  if (status == QMAT_OK && strcmp(file->format, "usdc") == 0)
    status = qmat_usdc_rename_original(context, &file->parts[0], name, &out);
  else if (status == QMAT_OK)
    put_renamed(&out, &file->parts[0], own, name);
  if (status == QMAT_OK) status = qmat_writer_to_part(context, &out, made, 0, "");
  if (status == QMAT_OK) {
    made->parts[1] =
        (qmat_file_part){.name = name, .size = file->parts[1].size, .bytes = qmat_alloc(file->parts[1].size, 1)};
    name = NULL;
    if (made->parts[1].bytes)
      memcpy(made->parts[1].bytes, file->parts[1].bytes, file->parts[1].size);
    else
      status = qmat_fail_memory(context, "the output file");
  }
  qmat_free(name);
  qmat_free(names);
  qmat_writer_uninit(&out);
  if (status == QMAT_OK)
    *named = made;
  else if (made)
    qmat_value_release(&made->base);
  return status;
}

qmat_status qmat_file_name_sides(qmat_context *context, const qmat_file *file, const char *path, qmat_file **named) {
  *named = NULL;
  const bool is_layer = strcmp(file->format, "usda") == 0 || strcmp(file->format, "usdc") == 0;
  if (is_layer && file->part_count == 2) return name_original(context, file, path, named);
  const bool is_gltf = strcmp(file->format, "gltf") == 0 || strcmp(file->format, "glb") == 0;
  if (!is_gltf || file->part_count < 2) {
    *named = (qmat_file *)qmat_value_retain(&file->base);
    return QMAT_OK;
  }
  const char *base = base_of(path);
  namer n = {.context = context, .file = file, .stem = base, .stem_length = (size_t)(ending_of(base) - base)};
  qmat_writer out = {0};
  qmat_file *made = qmat_file_new();
  n.names = qmat_calloc(file->part_count, sizeof *n.names);
  if (made) {
    made->format = qmat_strdup(file->format);
    made->parts = qmat_calloc(file->part_count, sizeof *made->parts);
    if (made->parts) made->part_count = file->part_count;
  }
  qmat_status status = QMAT_OK;
  if (!n.names || !made || !made->format || !made->parts) status = qmat_fail_memory(context, "the output file");
  if (status == QMAT_OK) status = rename_parts(&n, &out);
  if (status == QMAT_OK) status = qmat_writer_to_part(context, &out, made, 0, "");
  for (size_t i = 1; i < file->part_count && n.names; i++) {
    if (status == QMAT_OK && n.names[i]) {
      made->parts[i] = (qmat_file_part){
          .name = n.names[i], .size = file->parts[i].size, .bytes = qmat_alloc(file->parts[i].size, 1)};
      n.names[i] = NULL;
      if (made->parts[i].bytes) {
        memcpy(made->parts[i].bytes, file->parts[i].bytes, file->parts[i].size);
      } else {
        status = qmat_fail_memory(context, "the output file");
      }
    } else if (status == QMAT_OK) {
      status = qmat_fail(context, QMAT_ERROR_INTERNAL, "no URI refers to the part '%s'", file->parts[i].name);
    }
    qmat_free(n.names[i]);
  }
  qmat_free(n.names);
  qmat_writer_uninit(&out);
  if (status == QMAT_OK) {
    *named = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  return status;
}

/* ---- replacing files ---- */

/* Whether the file `path` exists and contains the quoted text. */
static bool mentions(const char *path, const char *text) {
  FILE *file = fopen(path, "rbe");
  if (!file) return false;
  const size_t length = strlen(text) + 2;
  char *wanted = qmat_alloc(length + 1, 1), *chunk = qmat_alloc(length + 65536, 1);
  size_t kept = 0, read;
  bool found = false;
  if (wanted && chunk) snprintf(wanted, length + 1, "\"%s\"", text);
  while (wanted && chunk && !found && (read = fread(chunk + kept, 1, 65536, file)) > 0) {
    kept += read;
    for (size_t i = 0; i + length <= kept && !found; i++) found = memcmp(chunk + i, wanted, length) == 0;
    const size_t rest = kept < length - 1 ? kept : length - 1;
    memmove(chunk, chunk + kept - rest, rest);
    kept = rest;
  }
  qmat_free(chunk);
  qmat_free(wanted);
  fclose(file);
  return found;
}

static qmat_status check_side(qmat_context *context, const qmat_file_part *part, const char *path) {
  struct stat about;
  char *side = qmat_gltf_beside(path, part->name), *uri = qmat_gltf_uri_of(part->name);
  qmat_status status = side && uri ? QMAT_OK : qmat_fail_memory(context, "the names of output files");
  if (status == QMAT_OK && stat(side, &about) == 0 && !qmat_file_holds(side, part) && !mentions(path, uri) &&
      !mentions(path, part->name) && !qmat_usdc_has_original(path, part->name)) {
    qmat_fail(context, status = QMAT_ERROR_IO, "the side file exists with other content and does not belong to '%s'",
              path);
    qmat_fail_at(context, side, 0, 0);
    qmat_fail_hint(context, "choose another output name or folder, or remove that file");
  }
  qmat_free(uri);
  qmat_free(side);
  return status;
}

qmat_status qmat_file_check_sides(qmat_context *context, const qmat_file *named, const char *path) {
  qmat_status status = QMAT_OK;
  for (size_t i = 1; i < named->part_count && status == QMAT_OK; i++)
    status = check_side(context, &named->parts[i], path);
  return status;
}
