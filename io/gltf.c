/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf.h"

#include "core/arena.h"
#include "io/gltf_check.h"
#include "io/gltf_tinygltf.h"

#define FREE_ELEMENTS ((size_t)1 << 24)
#define ELEMENTS_PER_BYTE 16

typedef struct target {
  qmat_context *context;
  qmat_soup *soup;
  uint32_t ordinal;
} target;

static qmat_status add_to_soup(void *user, const double *positions, size_t vertex_count, const uint32_t *corners,
                               size_t triangle_count) {
  target *to = user;
  size_t first = to->soup->vertex_count;
  if (vertex_count > UINT32_MAX - first) return qmat_fail_memory(to->context, "more than 2^32 - 1 vertices");
  qmat_status status = qmat_soup_reserve(to->context, to->soup, vertex_count, triangle_count, 3 * triangle_count);
  if (status == QMAT_OK) status = qmat_soup_add_vertices(to->context, to->soup, positions, vertex_count);
  for (size_t t = 0; t < triangle_count && status == QMAT_OK; t++) {
    uint32_t triangle[3];
    for (size_t k = 0; k < 3; k++) triangle[k] = (uint32_t)first + corners[3 * t + k];
    status = qmat_soup_add_facet(to->context, to->soup, triangle, 3, to->ordinal++, 0);
  }
  return status;
}

static qmat_status add_report(qmat_context *context, const qmat_gltf_counts *counts, json_t *extensions_ignored,
                              json_t *report) {
  if (!report) return QMAT_OK;
  if (json_object_set_new(report, "primitives_read", json_integer((json_int_t)counts->primitives_read)) != 0 ||
      json_object_set_new(report, "primitives_skipped", json_integer((json_int_t)counts->primitives_skipped)) != 0 ||
      json_object_set_new(report, "meshes_placed", json_integer((json_int_t)counts->meshes_placed)) != 0 ||
      json_object_set_new(report, "meshes_skinned", json_integer((json_int_t)counts->meshes_skinned)) != 0 ||
      json_object_set(report, "extensions_ignored", extensions_ignored) != 0) {
    return qmat_fail_memory(context, "a report");
  }
  return QMAT_OK;
}

qmat_status qmat_gltf_parse(qmat_context *context, const uint8_t *bytes, size_t size, const char *path, qmat_soup *soup,
                            json_t *report) {
  qmat_gltf_document document;
  qmat_gltf_bytes *buffers = NULL;
  qmat_gltf_counts counts;
  qmat_status status = qmat_gltf_document_read(context, bytes, size, path, &document);
  if (status != QMAT_OK) goto done;
  buffers = qmat_alloc(document.buffer_count, sizeof *buffers);
  if (!buffers) {
    status = qmat_fail_memory(context, "a glTF asset");
    goto done;
  }
  for (size_t i = 0; i < document.buffer_count; i++) {
    buffers[i] = (qmat_gltf_bytes){.bytes = document.buffers[i].bytes, .size = document.buffers[i].size};
  }
  target to = {.context = context, .soup = soup};
  size_t most = FREE_ELEMENTS + ELEMENTS_PER_BYTE * document.data_size;
  status = qmat_gltf_triangles(context, document.text, document.text_length, buffers, most, add_to_soup, &to, &counts);
  if (status == QMAT_OK) status = add_report(context, &counts, document.extensions_ignored, report);
  if (status != QMAT_OK) qmat_fail_at(context, path, 0, 0);

done:
  qmat_free(buffers);
  qmat_gltf_document_uninit(&document);
  return status;
}

qmat_status qmat_gltf_read(qmat_context *context, const char *path, qmat_soup *soup, json_t *report) {
  qmat_bytes file = {0};
  qmat_status status = qmat_bytes_read_file(context, path, &file);
  if (status == QMAT_OK) status = qmat_gltf_parse(context, file.data, file.size, path, soup, report);
  qmat_bytes_uninit(&file);
  return status;
}
