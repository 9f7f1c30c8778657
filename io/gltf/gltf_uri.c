/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_uri.h"

#include <string.h>

#include "core/arena.h"
#include "io/base64.h"
#include "io/bytes.h"

static int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/* Decodes a relative URI into `path` (length + 1 bytes); false for any other URI. */
static bool decode(const char *uri, size_t length, char *path) {
  size_t used = 0;
  for (size_t i = 0; i < length; i++) {
    char c = uri[i];
    if (c == '?' || c == '#' || (c == ':' && memchr(uri, '/', i) == NULL)) return false; /* a query, or a scheme */
    if (c == '%') {
      const int high = i + 1 < length ? hex_digit(uri[i + 1]) : -1, low = i + 2 < length ? hex_digit(uri[i + 2]) : -1;
      if (high < 0 || low < 0) return false;
      c = (char)(high * 16 + low);
      i += 2;
    }
    if (c == '\0' || c == '\\') return false;
    path[used++] = c;
  }
  path[used] = '\0';
  return used > 0 && path[0] != '/' && path[used - 1] != '/';
}

/* Removes empty steps and "." from a relative path, and each ".." together with the step before it. */
static void normalise(char *path) {
  char *to = path;
  for (const char *from = path; *from;) {
    const size_t length = strcspn(from, "/");
    const bool is_up = length == 2 && from[0] == '.' && from[1] == '.';
    if (is_up && to > path &&
        !(to - path >= 2 && to[-1] == '.' && to[-2] == '.' && (to - path == 2 || to[-3] == '/'))) {
      while (to > path && *--to != '/') continue;
    } else if (length > 0 && !(length == 1 && from[0] == '.')) {
      if (to > path) *to++ = '/';
      memmove(to, from, length);
      to += length;
    }
    from += length;
    if (*from == '/') from++;
  }
  *to = '\0';
}

qmat_status qmat_gltf_file_name(qmat_context *context, const char *uri, size_t length, char **name) {
  char *path = *name = qmat_alloc(length + 1, 1);
  if (!path) return qmat_fail_memory(context, "the name of a file");
  bool is_file = decode(uri, length, path);
  if (is_file) normalise(path);
  const char *last = is_file ? strrchr(path, '/') : NULL;
  last = last ? last + 1 : path;
  is_file = is_file && *last && strcmp(last, "..") != 0;
  if (is_file) return QMAT_OK;
  qmat_free(path);
  *name = NULL;
  return QMAT_OK;
}

bool qmat_gltf_is_outside(const char *name) {
  return strncmp(name, "../", 3) == 0;
}

static char *take_text(qmat_writer *writer) {
  qmat_put_u8(writer, 0);
  if (!writer->failed) return (char *)writer->bytes;
  qmat_writer_uninit(writer);
  return NULL;
}

char *qmat_gltf_part_name(const char *name) {
  qmat_writer writer = {0};
  for (; qmat_gltf_is_outside(name); name += 3) qmat_put_text(&writer, "%2E%2E/");
  for (; *name; name++) {
    if (*name == '%') {
      qmat_put_text(&writer, "%25");
    } else {
      qmat_put_bytes(&writer, name, 1);
    }
  }
  return take_text(&writer);
}

char *qmat_gltf_uri_of(const char *name) {
  static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  static const char digits[] = "0123456789ABCDEF";
  qmat_writer writer = {0};
  for (; *name; name++) {
    const unsigned char c = (unsigned char)*name;
    if (strchr(plain, *name)) {
      qmat_put_bytes(&writer, name, 1);
    } else {
      const char encoded[3] = {'%', digits[c / 16], digits[c % 16]};
      qmat_put_bytes(&writer, encoded, sizeof encoded);
    }
  }
  return take_text(&writer);
}

char *qmat_gltf_beside(const char *asset, const char *name) {
  const char *slash = strrchr(asset, '/');
  qmat_writer writer = {0};
  if (slash) qmat_put_bytes(&writer, asset, (size_t)(slash - asset) + 1);
  qmat_put_text(&writer, name);
  return take_text(&writer);
}

qmat_status qmat_gltf_decode_uri(qmat_context *context, const char *uri, size_t length, uint8_t **bytes, size_t *size) {
  static const char mark[] = ";base64";
  const size_t mark_length = sizeof mark - 1;
  const char *comma = memchr(uri, ',', length);
  *bytes = NULL;
  *size = 0;
  if (strncmp(uri, "data:", 5) != 0 || !comma || (size_t)(comma - uri) < 5 + mark_length ||
      memcmp(comma - mark_length, mark, mark_length) != 0)
    return QMAT_OK;
  return qmat_base64_decode(context, comma + 1, length - (size_t)(comma + 1 - uri), bytes, size);
}

static bool is_uri(const char *key) {
  const size_t length = strlen(key);
  return strcmp(key, "uri") == 0 || (length > 3 && strcmp(key + length - 3, "Uri") == 0);
}

/* jansson parses 2048 levels at most, which bounds the recursion. */
static qmat_status visit_all(json_t *json, qmat_gltf_uri_kind kind, qmat_gltf_uri_visit *visit, void *user) {
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < json_array_size(json) && status == QMAT_OK; i++)
    status = visit_all(json_array_get(json, i), kind, visit, user);
  const char *key;
  json_t *value;
  json_object_foreach(json, key, value) {
    if (status != QMAT_OK) break;
    if (json_is_string(value) && is_uri(key)) {
      status = visit(user, json, key, strcmp(key, "uri") == 0 ? kind : QMAT_GLTF_OTHER_URI);
    } else if (strcmp(key, "extras") != 0) { /* extras belong to the application */
      status = visit_all(value, QMAT_GLTF_OTHER_URI, visit, user);
    }
  }
  return status;
}

qmat_status qmat_gltf_visit_uris(json_t *root, qmat_gltf_uri_visit *visit, void *user) {
  static const struct {
    const char *array;
    qmat_gltf_uri_kind kind;
  } arrays[] = {{"buffers", QMAT_GLTF_BUFFER_URI}, {"images", QMAT_GLTF_IMAGE_URI}};
  qmat_status status = QMAT_OK;
  const char *key;
  json_t *value;
  json_object_foreach(root, key, value) {
    qmat_gltf_uri_kind kind = QMAT_GLTF_OTHER_URI;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
      if (strcmp(key, arrays[i].array) == 0) kind = arrays[i].kind;
    if (strcmp(key, "extras") != 0 && status == QMAT_OK) status = visit_all(value, kind, visit, user);
  }
  return status;
}
