/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf.h"

#include <string.h>

#include "core/arena.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_check.h"
#include "io/gltf/gltf_tinygltf.h"

#define FREE_ELEMENTS ((size_t)1 << 24)
#define ELEMENTS_PER_BYTE 16

typedef struct target {
  qmat_context *context;
  qmat_soup *soups;
} target;

static qmat_status add_to_soup(void *user, size_t which, const double *positions, size_t vertex_count,
                               const uint32_t *corners, size_t triangle_count, const uint32_t *joints,
                               const double *weights) {
  target *to = user;
  qmat_soup *soup = &to->soups[which];
  size_t first = soup->vertex_count;
  if (vertex_count > UINT32_MAX - first) return qmat_fail_memory(to->context, "more than 2^32 - 1 vertices");
  qmat_status status = qmat_soup_reserve(to->context, soup, vertex_count, triangle_count, 3 * triangle_count);
  if (status == QMAT_OK) status = qmat_soup_add_vertices(to->context, soup, positions, vertex_count);
  if (status == QMAT_OK && joints) status = qmat_soup_add_skin(to->context, soup, joints, weights, vertex_count);
  for (size_t t = 0; t < triangle_count && status == QMAT_OK; t++) {
    uint32_t triangle[3];
    for (size_t k = 0; k < 3; k++) triangle[k] = (uint32_t)first + corners[3 * t + k];
    status = qmat_soup_add_facet(to->context, soup, triangle, 3, (uint32_t)soup->facet_count, 0);
  }
  return status;
}

static bool ignores(const qmat_gltf_document *document, const char *extension) {
  for (size_t i = 0; i < json_array_size(document->extensions_ignored); i++)
    if (strcmp(json_string_value(json_array_get(document->extensions_ignored, i)), extension) == 0) return true;
  return false;
}

/* Adds the warnings of the document to those of the report. `placed`: the meshes are where their nodes place them. */
static bool add_warnings(const qmat_gltf_counts *counts, bool placed, const qmat_gltf_document *document,
                         json_t *report) {
  json_t *warnings = document->warnings;
  bool done = true;
  if (placed && ignores(document, "EXT_mesh_gpu_instancing"))
    done = json_array_append_new(
               warnings, json_string("EXT_mesh_gpu_instancing is not read: each of its meshes is in one place")) == 0;
  if (counts->meshes_of_several_weights > 0) {
    json_t *text = json_sprintf(
        "the morph weights of nodes with the same mesh differ, in %zu cases: the shape is that of its own weights",
        counts->meshes_of_several_weights);
    done = json_array_append_new(warnings, text) == 0 && done;
  }
  if (counts->primitives_skipped > 0) {
    json_t *text = json_sprintf("%zu of %zu primitives are passed over: points, lines, or without positions",
                                counts->primitives_skipped, counts->primitives_skipped + counts->primitives_read);
    done = json_array_append_new(warnings, text) == 0 && done;
  }
  if (!done || json_array_size(warnings) == 0) return done;
  json_t *all = json_object_get(report, "warnings");
  return (all ? json_array_extend(all, warnings) : json_object_set(report, "warnings", warnings)) == 0;
}

static qmat_status add_report(qmat_context *context, const qmat_gltf_counts *counts, bool placed,
                              const qmat_gltf_document *document, json_t *report) {
  if (!report) return QMAT_OK;
  if (!add_warnings(counts, placed, document, report)) return qmat_fail_memory(context, "a report");
  if (json_object_set_new(report, "primitives_read", json_integer((json_int_t)counts->primitives_read)) != 0 ||
      json_object_set_new(report, "primitives_skipped", json_integer((json_int_t)counts->primitives_skipped)) != 0 ||
      json_object_set(report, "extensions_ignored", document->extensions_ignored) != 0) {
    return qmat_fail_memory(context, "a report");
  }
  if (placed &&
      (json_object_set_new(report, "meshes_placed", json_integer((json_int_t)counts->meshes_placed)) != 0 ||
       json_object_set_new(report, "meshes_skinned", json_integer((json_int_t)counts->meshes_skinned)) != 0)) {
    return qmat_fail_memory(context, "a report");
  }
  return QMAT_OK;
}

/* Reads the triangles of `meshes` of a checked document; NULL: of its scene. */
static qmat_status read_triangles(qmat_context *context, const qmat_gltf_document *document, const uint32_t *meshes,
                                  size_t mesh_count, qmat_soup *soups, json_t *report) {
  qmat_gltf_counts counts;
  qmat_gltf_bytes *buffers = qmat_alloc(document->buffer_count, sizeof *buffers);
  if (!buffers) return qmat_fail_memory(context, "a glTF asset");
  for (size_t i = 0; i < document->buffer_count; i++)
    buffers[i] = (qmat_gltf_bytes){.bytes = document->buffers[i].bytes, .size = document->buffers[i].size};
  target to = {.context = context, .soups = soups};
  size_t most = FREE_ELEMENTS + ELEMENTS_PER_BYTE * (document->data_size + document->decoded_size);
  double *scales = qmat_alloc(mesh_count, sizeof *scales);
  qmat_status status = scales ? qmat_gltf_triangles(context, document->text, document->text_length, buffers, most,
                                                    meshes, mesh_count, scales, add_to_soup, &to, &counts)
                              : qmat_fail_memory(context, "a glTF asset");
  soups[0].meters_per_unit = 1; /* glTF is in metres, and nodes scale meshes */
  for (size_t i = 0; meshes && i < mesh_count && status == QMAT_OK; i++) soups[i].meters_per_unit = scales[i];
  qmat_free(scales);
  if (status == QMAT_OK) status = add_report(context, &counts, meshes == NULL, document, report);
  qmat_free(buffers);
  return status;
}

qmat_status qmat_gltf_parse(qmat_context *context, const uint8_t *bytes, size_t size, const char *path, qmat_soup *soup,
                            json_t *report) {
  qmat_gltf_document document;
  qmat_status status = qmat_gltf_document_read(context, bytes, size, path, true, &document);
  if (status == QMAT_OK) {
    status = read_triangles(context, &document, NULL, 0, soup, report);
    if (status != QMAT_OK) qmat_fail_at(context, path, 0, 0);
  }
  qmat_gltf_document_uninit(&document);
  return status;
}

/* Removes meshes without triangles. If all are empty, the last one stays. */
static void drop_empty(qmat_gltf_meshes *meshes) {
  size_t kept = 0;
  for (size_t i = 0; i < meshes->count; i++) {
    const bool only_one = i + 1 == meshes->count && kept == 0;
    if (meshes->soups[i].facet_count == 0 && !only_one) {
      qmat_soup_uninit(&meshes->soups[i]);
      continue;
    }
    const qmat_soup soup = meshes->soups[i];
    meshes->soups[i] = (qmat_soup){0};
    meshes->soups[kept] = soup;
    meshes->ids[kept++] = meshes->ids[i];
  }
  meshes->count = kept;
}

qmat_status qmat_gltf_parse_meshes(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                   const json_t *root, const char *choice, qmat_gltf_meshes *meshes, json_t *report) {
  qmat_gltf_document document;
  *meshes = (qmat_gltf_meshes){0};
  qmat_status status = qmat_gltf_document_read(context, bytes, size, path, false, &document);
  if (status == QMAT_OK) status = qmat_gltf_choose_meshes(context, root, path, choice, &meshes->ids, &meshes->count);
  if (status == QMAT_OK) {
    meshes->soups = qmat_calloc(meshes->count, sizeof *meshes->soups);
    status = meshes->soups ? read_triangles(context, &document, meshes->ids, meshes->count, meshes->soups, report)
                           : qmat_fail_memory(context, "the meshes of a scene");
    if (status != QMAT_OK) qmat_fail_at(context, path, 0, 0);
  }
  if (status == QMAT_OK) drop_empty(meshes);
  qmat_gltf_document_uninit(&document);
  return status;
}

void qmat_gltf_meshes_uninit(qmat_gltf_meshes *meshes) {
  for (size_t i = 0; meshes->soups && i < meshes->count; i++) qmat_soup_uninit(&meshes->soups[i]);
  qmat_free(meshes->soups);
  qmat_free(meshes->ids);
  *meshes = (qmat_gltf_meshes){0};
}

qmat_status qmat_gltf_read(qmat_context *context, const char *path, qmat_soup *soup, json_t *report) {
  qmat_bytes file = {0};
  qmat_status status = qmat_bytes_read_file(context, path, &file);
  if (status == QMAT_OK) status = qmat_gltf_parse(context, file.data, file.size, path, soup, report);
  qmat_bytes_uninit(&file);
  return status;
}
