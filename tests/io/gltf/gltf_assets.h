/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_IO_GLTF_GLTF_ASSETS_H
#define QMAT_TESTS_IO_GLTF_GLTF_ASSETS_H

/* Tiny glTF assets, put together by tests. Include after cmocka. */

#include <stdlib.h>
#include <string.h>

#include "io/bytes.h"
#include "io/gltf/gltf.h"

/* JSON with apostrophes for quotation marks, made into JSON; the caller frees it. */
static inline char *asset_json(const char *text) {
  char *json = strdup(text);
  assert_non_null(json);
  for (char *c = json; *c; c++) {
    if (*c == '\'') *c = '"';
  }
  return json;
}

/* A GLB of that JSON (with apostrophes) and binary chunk (none when size is 0); free it with qmat_writer_uninit. */
static inline qmat_writer asset_glb(const char *text, const void *chunk, size_t size) {
  char *json = asset_json(text);
  qmat_writer glb = {0};
  size_t json_size = (strlen(json) + 3) / 4 * 4, chunk_size = (size + 3) / 4 * 4;
  qmat_put_text(&glb, "glTF");
  qmat_put_u32(&glb, 2);
  qmat_put_u32(&glb, (uint32_t)(20 + json_size + (size > 0 ? 8 + chunk_size : 0)));
  qmat_put_u32(&glb, (uint32_t)json_size);
  qmat_put_text(&glb, "JSON");
  qmat_put_text(&glb, json);
  while (glb.size % 4 != 0) qmat_put_u8(&glb, ' ');
  if (size > 0) {
    qmat_put_u32(&glb, (uint32_t)chunk_size);
    qmat_put_bytes(&glb, "BIN", 4);
    qmat_put_bytes(&glb, chunk, size);
    while (glb.size % 4 != 0) qmat_put_u8(&glb, 0);
  }
  free(json);
  assert_false(glb.failed);
  return glb;
}

/* `text` with the first `from` in it replaced; the caller frees it. */
static inline char *asset_replace(const char *text, const char *from, const char *to) {
  const char *at = strstr(text, from);
  if (!at) fail_msg("\"%s\" is not in the asset", from);
  size_t before = (size_t)(at - text), after = strlen(at + strlen(from));
  char *out = malloc(before + strlen(to) + after + 1);
  assert_non_null(out);
  memcpy(out, text, before);
  strcpy(out + before, to);
  strcat(out, at + strlen(from));
  return out;
}

/* 96 bytes: the corners of a box of `side` by 1 by 1. */
static inline void put_box_corners(qmat_writer *data, float side) {
  for (int i = 0; i < 8; i++) {
    qmat_put_f32(data, (float)(i >> 2) * side);
    qmat_put_f32(data, (float)(i >> 1 & 1));
    qmat_put_f32(data, (float)(i & 1));
  }
}

/* 72 bytes: its triangles. */
static inline void put_box_triangles(qmat_writer *data) {
  static const uint16_t corners[36] = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                                       2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
  for (int i = 0; i < 36; i++) qmat_put_u16(data, corners[i]);
}

#endif
