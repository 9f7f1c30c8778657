/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_check.h"

#include <string.h>

#include "core/arena.h"
#include "io/gltf/gltf_check_data.h"
#include "io/gltf/gltf_check_meshes.h"
#include "io/gltf/gltf_check_nodes.h"

/* ---- the asset and its extensions ---- */

static bool geometry_is_safe_with(const char *extension) {
  /* Extensions that this reader supports, or that leave the geometry unchanged. */
  static const char *const known[] = {
      "KHR_draco_mesh_compression",
      "KHR_mesh_quantization",
      "EXT_meshopt_compression",
      "KHR_texture_transform",
      "KHR_texture_basisu",
      "EXT_texture_webp",
      "EXT_texture_avif",
      "MSFT_texture_dds",
      "KHR_lights_punctual",
      "EXT_lights_image_based",
      "KHR_xmp",
      "KHR_xmp_json_ld",
      "KHR_animation_pointer",
      "KHR_techniques_webgl",
      "KHR_audio_emitter",
      "EXT_mesh_features",
      "EXT_structural_metadata",
      "EXT_instance_features",
      NULL,
  };
  if (strncmp(extension, "KHR_materials_", 14) == 0 || strncmp(extension, "EXT_materials_", 14) == 0) return true;
  for (size_t i = 0; known[i]; i++) {
    if (strcmp(known[i], extension) == 0) return true;
  }
  return false;
}

static qmat_status check_extensions(const qmat_gltf_checker *check) {
  json_t *required, *used;
  qmat_status status = qmat_gltf_take_array(check, check->root, "extensionsRequired", NULL, 0, &required);
  if (status == QMAT_OK) status = qmat_gltf_take_array(check, check->root, "extensionsUsed", NULL, 0, &used);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < json_array_size(required); i++) {
    const char *name = json_string_value(json_array_get(required, i));
    if (!name) return qmat_gltf_fail(check, NULL, 0, "extensionsRequired must hold strings only");
    if (!geometry_is_safe_with(name)) {
      qmat_gltf_fail(check, NULL, 0, "the required extension %.100s is not supported", name);
      return qmat_fail_hint(check->context,
                            "supported: KHR_draco_mesh_compression, EXT_meshopt_compression, KHR_mesh_quantization, "
                            "and extensions of materials, textures, lights and metadata");
    }
  }
  for (size_t i = 0; i < json_array_size(used); i++) {
    const char *name = json_string_value(json_array_get(used, i));
    if (!name) return qmat_gltf_fail(check, NULL, 0, "extensionsUsed must hold strings only");
    if (geometry_is_safe_with(name)) continue;
    if (json_array_append_new(check->document->extensions_ignored, json_string(name)) != 0)
      return qmat_gltf_fail_memory(check);
  }
  return QMAT_OK;
}

static qmat_status check_asset(const qmat_gltf_checker *check) {
  json_t *asset;
  qmat_status status = qmat_gltf_take_object(check, check->root, "asset", NULL, 0, &asset);
  if (status != QMAT_OK) return status;
  const char *version = json_string_value(json_object_get(asset, "version"));
  const char *least = json_string_value(json_object_get(asset, "minVersion"));
  if (!version) return qmat_gltf_fail(check, NULL, 0, "not a glTF asset: asset.version is missing");
  if (strncmp(version, "2.", 2) != 0)
    return qmat_gltf_fail(check, NULL, 0, "glTF version %.20s is not supported (only 2.0 is)", version);
  if (least && strcmp(least, "2.0") != 0)
    return qmat_gltf_fail(check, NULL, 0, "the asset requires glTF %.20s, but only 2.0 is supported", least);
  return check_extensions(check);
}

/* ---- the document ---- */

/* The root's member `name` must be missing or an array of objects. `kind` names one object in errors. */
static qmat_status check_root_array(const qmat_gltf_checker *check, const char *name, const char *kind) {
  json_t *array;
  qmat_status status = qmat_gltf_take_array(check, check->root, name, NULL, 0, &array);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < json_array_size(array); i++) {
    if (!json_is_object(json_array_get(array, i))) return qmat_gltf_fail(check, kind, i, "must be an object");
  }
  return QMAT_OK;
}

static qmat_status write_reduced(const qmat_gltf_checker *check) {
  static const char *const keys[] = {"asset", "bufferViews", "accessors", "meshes", "nodes", "skins", "scenes", NULL};
  qmat_gltf_keep_keys(check->root, keys);
  json_t *asset = json_pack("{s:s}", "version", "2.0");
  if (!asset || json_object_set_new(check->root, "asset", asset) != 0) return qmat_gltf_fail_memory(check);
  size_t size = json_dumpb(check->root, NULL, 0, JSON_COMPACT);
  check->document->text = size > 0 ? qmat_alloc(size + 1, 1) : NULL;
  if (!check->document->text) return qmat_gltf_fail_memory(check);
  check->document->text_length = json_dumpb(check->root, check->document->text, size, JSON_COMPACT);
  if (check->document->text_length != size) return qmat_gltf_fail_memory(check);
  check->document->text[size] = '\0';
  return QMAT_OK;
}

/* Takes the meshes that qmat has added off their nodes, unless there are no others. */
static void leave_skins(json_t *root) {
  json_t *nodes = json_object_get(root, "nodes");
  bool has_others = false;
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const int64_t mesh = qmat_gltf_mesh_of(json_array_get(nodes, i));
    has_others = has_others || (mesh >= 0 && !qmat_gltf_is_skin(root, (size_t)mesh));
  }
  for (size_t i = 0; has_others && i < json_array_size(nodes); i++) {
    json_t *node = json_array_get(nodes, i);
    const int64_t mesh = qmat_gltf_mesh_of(node);
    if (mesh < 0 || !qmat_gltf_is_skin(root, (size_t)mesh)) continue;
    json_object_del(node, "mesh");
    json_object_del(node, "skin");
  }
}

qmat_status qmat_gltf_document_read(qmat_context *context, const uint8_t *bytes, size_t size, const char *path,
                                    bool leaves_skins, qmat_gltf_document *document) {
  static const char *const arrays[][2] = {{"buffers", "buffer"},     {"bufferViews", "bufferView"},
                                          {"accessors", "accessor"}, {"meshes", "mesh"},
                                          {"nodes", "node"},         {"skins", "skin"},
                                          {"scenes", "scene"}};
  *document = (qmat_gltf_document){0};
  qmat_gltf_checker check = {.context = context, .path = path, .document = document};
  document->extensions_ignored = json_array();
  document->warnings = json_array();
  qmat_status status = document->extensions_ignored && document->warnings ? QMAT_OK : qmat_gltf_fail_memory(&check);
  if (status == QMAT_OK) status = qmat_gltf_asset_init(context, bytes, size, path, &check.asset);
  check.root = check.asset.root;
  if (status == QMAT_OK) status = check_asset(&check);
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays && status == QMAT_OK; i++)
    status = check_root_array(&check, arrays[i][0], arrays[i][1]);
  if (status == QMAT_OK && leaves_skins) leave_skins(check.root);
  if (status == QMAT_OK) status = qmat_gltf_check_data(&check);
  if (status == QMAT_OK) status = qmat_gltf_check_meshes(&check);
  if (status == QMAT_OK) status = qmat_gltf_check_skins(&check);
  if (status == QMAT_OK) status = qmat_gltf_check_nodes(&check);
  if (status == QMAT_OK) status = write_reduced(&check);
  qmat_free(check.views);
  qmat_free(check.accessors);
  qmat_gltf_asset_uninit(&check.asset);
  return status;
}

void qmat_gltf_document_uninit(qmat_gltf_document *document) {
  for (size_t i = 0; i < document->buffer_count; i++) {
    qmat_free(document->buffers[i].owned);
    qmat_bytes_uninit(&document->buffers[i].file);
  }
  qmat_free(document->buffers);
  qmat_free(document->text);
  json_decref(document->extensions_ignored);
  json_decref(document->warnings);
  *document = (qmat_gltf_document){0};
}
