/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_check_meshes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "io/gltf/gltf_check_data.h"

/* The number in a name like "JOINTS_12"; -1 for other names. */
static int set_number(const char *name, const char *prefix) {
  size_t length = strlen(prefix);
  if (strncmp(name, prefix, length) != 0 || name[length] == '\0' || strlen(name + length) > 3) return -1;
  if (strspn(name + length, "0123456789") != strlen(name + length)) return -1;
  return atoi(name + length);
}

static qmat_status check_same_count(const qmat_gltf_checker *check, int64_t id, int64_t position, const char *what) {
  if (check->accessors[id].count == check->accessors[position].count) return QMAT_OK;
  return qmat_gltf_fail(check, "accessor", (size_t)id, "%.40s has %lld elements, POSITION has %lld", what,
                        (long long)check->accessors[id].count, (long long)check->accessors[position].count);
}

/* Checks a primitive's Draco extension and reduces it to its ids; `*draco` is NULL without one. */
static qmat_status check_draco(const qmat_gltf_checker *check, size_t mesh, size_t index, json_t *primitive,
                               json_t **draco) {
  static const char *const keys[] = {"bufferView", "attributes", NULL};
  static const char *const extension_keys[] = {"KHR_draco_mesh_compression", NULL};
  json_t *extensions, *attributes;
  *draco = NULL;
  qmat_status status = qmat_gltf_take_object(check, primitive, "extensions", "mesh", mesh, &extensions);
  if (status == QMAT_OK && extensions)
    status = qmat_gltf_take_object(check, extensions, "KHR_draco_mesh_compression", "mesh", mesh, draco);
  if (status != QMAT_OK) return status;
  if (!*draco) {
    json_object_del(primitive, "extensions");
    return QMAT_OK;
  }
  qmat_gltf_keep_keys(extensions, extension_keys);
  int64_t view_id = 0;
  status = qmat_gltf_take_id(check, *draco, "bufferView", "mesh", mesh, "bufferViews", &view_id, NULL);
  if (status == QMAT_OK) status = qmat_gltf_take_object(check, *draco, "attributes", "mesh", mesh, &attributes);
  if (status != QMAT_OK) return status;
  if (!attributes)
    return qmat_gltf_fail(check, "mesh", mesh, "primitive %zu: its Draco extension has no attributes", index);
  const json_t *plain = json_object_get(primitive, "attributes");
  const char *name;
  json_t *value;
  void *next;
  json_object_foreach_safe(attributes, next, name, value) {
    int64_t id;
    if (!qmat_gltf_whole(value, 0, INT32_MAX, &id)) {
      return qmat_gltf_fail(check, "mesh", mesh, "primitive %zu: the Draco id of %.40s must be a whole number from 0",
                            index, name);
    }
    if (!json_object_get(plain, name)) {
      return qmat_gltf_fail(check, "mesh", mesh, "primitive %zu: %.40s has a Draco id but is not an attribute", index,
                            name);
    }
    if (json_object_set_new(attributes, name, json_integer(id)) != 0) return qmat_gltf_fail_memory(check);
  }
  qmat_gltf_keep_keys(*draco, keys);
  /* The Draco data contain the faces; the indices accessor needs no data. */
  json_object_del(primitive, "indices");
  return json_object_set_new(primitive, "mode", json_integer(4)) == 0 ? QMAT_OK : qmat_gltf_fail_memory(check);
}

/* Checks the attributes that determine vertex positions and deletes all others. */
static qmat_status check_attributes(const qmat_gltf_checker *check, size_t mesh, size_t index, json_t *attributes,
                                    const json_t *compressed, int64_t position) {
  const char *name;
  json_t *value;
  void *next;
  json_object_foreach_safe(attributes, next, name, value) {
    bool joints = set_number(name, "JOINTS_") >= 0, weights = set_number(name, "WEIGHTS_") >= 0;
    bool is_position = strcmp(name, "POSITION") == 0;
    if (!joints && !weights && !is_position) {
      json_object_del(attributes, name);
      continue;
    }
    int64_t id = json_integer_value(value);
    bool draco = json_object_get(compressed, name) != NULL;
    qmat_status status;
    if (is_position) {
      status = qmat_gltf_check_use(
          check, id, "POSITION", 3,
          QMAT_GLTF_ALLOW_BYTES | QMAT_GLTF_ALLOW_SHORTS | QMAT_GLTF_ALLOW_SIGNED | QMAT_GLTF_ALLOW_FLOATS, draco);
    } else if (joints) {
      status = qmat_gltf_check_use(check, id, "JOINTS", 4, QMAT_GLTF_ALLOW_BYTES | QMAT_GLTF_ALLOW_SHORTS, draco);
    } else {
      status = qmat_gltf_check_use(check, id, "WEIGHTS", 4,
                                   QMAT_GLTF_ALLOW_BYTES | QMAT_GLTF_ALLOW_SHORTS | QMAT_GLTF_ALLOW_FLOATS, draco);
    }
    if (status == QMAT_OK) status = check_same_count(check, id, position, name);
    if (status != QMAT_OK) return status;
    char partner[16];
    snprintf(partner, sizeof partner, "%s_%s", joints ? "WEIGHTS" : "JOINTS",
             is_position ? "" : strrchr(name, '_') + 1);
    if (!is_position && !json_object_get(attributes, partner))
      return qmat_gltf_fail(check, "mesh", mesh, "primitive %zu: has %.40s without %s", index, name, partner);
  }
  return QMAT_OK;
}

static qmat_status check_targets(const qmat_gltf_checker *check, size_t mesh, size_t index, json_t *primitive,
                                 int64_t position) {
  static const char *const keys[] = {"POSITION", NULL};
  json_t *targets;
  qmat_status status = qmat_gltf_take_array(check, primitive, "targets", "mesh", mesh, &targets);
  for (size_t t = 0; t < json_array_size(targets) && status == QMAT_OK; t++) {
    json_t *target = json_array_get(targets, t);
    if (!json_is_object(target))
      return qmat_gltf_fail(check, "mesh", mesh, "primitive %zu: morph target %zu must be an object", index, t);
    int64_t id = 0;
    bool present;
    status = qmat_gltf_take_id(check, target, "POSITION", "mesh", mesh, "accessors", &id, &present);
    if (status == QMAT_OK && present) {
      status = qmat_gltf_check_use(
          check, id, "POSITION of a morph target", 3,
          QMAT_GLTF_ALLOW_BYTES | QMAT_GLTF_ALLOW_SHORTS | QMAT_GLTF_ALLOW_SIGNED | QMAT_GLTF_ALLOW_FLOATS, false);
    }
    if (status == QMAT_OK && present) status = check_same_count(check, id, position, "a morph target");
    qmat_gltf_keep_keys(target, keys);
  }
  return status;
}

static qmat_status check_primitive(const qmat_gltf_checker *check, size_t mesh, size_t index, json_t *primitive) {
  static const char *const keys[] = {"attributes", "indices", "mode", "targets", "extensions", NULL};
  if (!json_is_object(primitive)) return qmat_gltf_fail(check, "mesh", mesh, "primitive %zu must be an object", index);
  qmat_gltf_keep_keys(primitive, keys);
  json_t *attributes, *draco;
  int64_t mode = 4, indices = 0, position = -1;
  bool present;
  qmat_status status = qmat_gltf_take_object(check, primitive, "attributes", "mesh", mesh, &attributes);
  if (status == QMAT_OK) status = qmat_gltf_take_whole(check, primitive, "mode", "mesh", mesh, 0, 6, &mode, &present);
  if (status != QMAT_OK) return status;
  if (!attributes) return qmat_gltf_fail(check, "mesh", mesh, "primitive %zu has no attributes", index);
  const char *name;
  json_t *value;
  void *next;
  json_object_foreach_safe(attributes, next, name, value) {
    int64_t id = 0;
    status = qmat_gltf_take_id(check, attributes, name, "mesh", mesh, "accessors", &id, NULL);
    if (status != QMAT_OK) return status;
    if (strcmp(name, "POSITION") == 0) position = id;
  }
  bool has_indices;
  status = qmat_gltf_take_id(check, primitive, "indices", "mesh", mesh, "accessors", &indices, &has_indices);
  if (status != QMAT_OK) return status;
  if (mode < 4 || position < 0) { /* without triangles: stays, so that the reader counts it as skipped */
    json_object_clear(primitive);
    return json_object_set_new(primitive, "attributes", json_object()) == 0 ? QMAT_OK : qmat_gltf_fail_memory(check);
  }
  status = check_draco(check, mesh, index, primitive, &draco);
  if (status != QMAT_OK) return status;
  if (has_indices && !draco) {
    status = qmat_gltf_check_use(check, indices, "indices", 1,
                                 QMAT_GLTF_ALLOW_BYTES | QMAT_GLTF_ALLOW_SHORTS | QMAT_GLTF_ALLOW_UINTS, false);
    if (status != QMAT_OK) return status;
    if (!check->accessors[indices].has_view)
      return qmat_gltf_fail(check, "accessor", (size_t)indices, "holds indices but has no bufferView");
  }
  status = check_attributes(check, mesh, index, attributes, json_object_get(draco, "attributes"), position);
  if (status == QMAT_OK) status = check_targets(check, mesh, index, primitive, position);
  return status;
}

qmat_status qmat_gltf_check_meshes(const qmat_gltf_checker *check) {
  static const char *const keys[] = {"primitives", "weights", NULL};
  json_t *array = json_object_get(check->root, "meshes");
  for (size_t i = 0; i < json_array_size(array); i++) {
    json_t *mesh = json_array_get(array, i), *primitives;
    bool present;
    qmat_status status = qmat_gltf_take_array(check, mesh, "primitives", "mesh", i, &primitives);
    if (status == QMAT_OK) status = qmat_gltf_take_numbers(check, mesh, "weights", "mesh", i, SIZE_MAX, NULL, &present);
    if (status != QMAT_OK) return status;
    if (!primitives) return qmat_gltf_fail(check, "mesh", i, "has no primitives");
    for (size_t p = 0; p < json_array_size(primitives); p++) {
      status = check_primitive(check, i, p, json_array_get(primitives, p));
      if (status != QMAT_OK) return status;
    }
    qmat_gltf_keep_keys(mesh, keys);
  }
  return QMAT_OK;
}
