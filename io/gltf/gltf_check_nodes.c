/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_check_nodes.h"

#include <math.h>

#include "core/arena.h"
#include "io/gltf/gltf_check_data.h"

/* Checks an array of node ids and stores each as an integer. */
static qmat_status check_node_ids(const qmat_gltf_checker *check, json_t *object, const char *key, const char *kind,
                                  size_t element, json_t **ids) {
  size_t count = json_array_size(json_object_get(check->root, "nodes"));
  qmat_status status = qmat_gltf_take_array(check, object, key, kind, element, ids);
  for (size_t i = 0; i < json_array_size(*ids) && status == QMAT_OK; i++) {
    int64_t id;
    if (!qmat_gltf_whole(json_array_get(*ids, i), 0, INT64_MAX, &id))
      return qmat_gltf_fail(check, kind, element, "%s must hold whole numbers from 0", key);
    if ((uint64_t)id >= count)
      return qmat_gltf_fail(check, kind, element, "%s names node %lld, but there are %zu", key, (long long)id, count);
    if (json_array_set_new(*ids, i, json_integer(id)) != 0) return qmat_gltf_fail_memory(check);
  }
  return status;
}

qmat_status qmat_gltf_check_skins(const qmat_gltf_checker *check) {
  static const char *const keys[] = {"joints", "inverseBindMatrices", NULL};
  json_t *array = json_object_get(check->root, "skins");
  for (size_t i = 0; i < json_array_size(array); i++) {
    json_t *skin = json_array_get(array, i), *joints;
    int64_t matrices = 0;
    bool present;
    qmat_status status = check_node_ids(check, skin, "joints", "skin", i, &joints);
    if (status == QMAT_OK)
      status = qmat_gltf_take_id(check, skin, "inverseBindMatrices", "skin", i, "accessors", &matrices, &present);
    if (status != QMAT_OK) return status;
    if (json_array_size(joints) == 0) return qmat_gltf_fail(check, "skin", i, "has no joints");
    if (present) {
      status = qmat_gltf_check_use(check, matrices, "inverse bind matrices", 16, QMAT_GLTF_ALLOW_FLOATS, false);
      if (status != QMAT_OK) return status;
      if ((size_t)check->accessors[matrices].count < json_array_size(joints)) {
        return qmat_gltf_fail(check, "skin", i, "has %zu joints but %lld inverse bind matrices",
                              json_array_size(joints), (long long)check->accessors[matrices].count);
      }
    }
    qmat_gltf_keep_keys(skin, keys);
  }
  return QMAT_OK;
}

static qmat_status check_node(const qmat_gltf_checker *check, size_t index, json_t *node) {
  static const char *const keys[] = {"children", "matrix", "translation", "rotation", "scale",
                                     "mesh",     "skin",   "weights",     NULL};
  json_t *children;
  int64_t id = 0;
  double numbers[16];
  bool present;
  qmat_status status = check_node_ids(check, node, "children", "node", index, &children);
  if (status == QMAT_OK) status = qmat_gltf_take_id(check, node, "mesh", "node", index, "meshes", &id, &present);
  if (status == QMAT_OK) status = qmat_gltf_take_id(check, node, "skin", "node", index, "skins", &id, &present);
  if (status == QMAT_OK) status = qmat_gltf_take_numbers(check, node, "matrix", "node", index, 16, numbers, &present);
  if (status == QMAT_OK)
    status = qmat_gltf_take_numbers(check, node, "translation", "node", index, 3, numbers, &present);
  if (status == QMAT_OK) status = qmat_gltf_take_numbers(check, node, "scale", "node", index, 3, numbers, &present);
  if (status == QMAT_OK)
    status = qmat_gltf_take_numbers(check, node, "weights", "node", index, SIZE_MAX, NULL, &present);
  if (status == QMAT_OK) status = qmat_gltf_take_numbers(check, node, "rotation", "node", index, 4, numbers, &present);
  if (status != QMAT_OK) return status;
  if (present) {
    double length = hypot(hypot(numbers[0], numbers[1]), hypot(numbers[2], numbers[3]));
    if (!(length > 0) || !isfinite(length)) return qmat_gltf_fail(check, "node", index, "rotation is not a quaternion");
  }
  qmat_gltf_keep_keys(node, keys);
  return QMAT_OK;
}

/* Checks that the nodes form trees: each has at most one parent and is reachable from a root. `has_parent` (zeroed) and
 * `stack` hold one element per node. */
static qmat_status check_trees(const qmat_gltf_checker *check, uint8_t *has_parent, size_t *stack) {
  json_t *nodes = json_object_get(check->root, "nodes");
  size_t count = json_array_size(nodes), waiting = 0, reached = 0;
  for (size_t i = 0; i < count; i++) {
    json_t *children = json_object_get(json_array_get(nodes, i), "children");
    for (size_t k = 0; k < json_array_size(children); k++) {
      size_t child = (size_t)json_integer_value(json_array_get(children, k));
      if (has_parent[child]) return qmat_gltf_fail(check, "node", child, "is a child more than once");
      has_parent[child] = 1;
    }
  }
  for (size_t i = 0; i < count; i++) {
    if (!has_parent[i]) stack[waiting++] = i;
  }
  uint8_t *marks = qmat_calloc(count, 1);
  if (!marks) return qmat_gltf_fail_memory(check);
  while (waiting > 0) {
    size_t node = stack[--waiting];
    marks[node] = 1;
    reached++;
    json_t *children = json_object_get(json_array_get(nodes, node), "children");
    for (size_t k = 0; k < json_array_size(children); k++)
      stack[waiting++] = (size_t)json_integer_value(json_array_get(children, k));
  }
  size_t missed = 0;
  while (missed < count && marks[missed]) missed++;
  qmat_free(marks);
  if (reached < count) return qmat_gltf_fail(check, "node", missed, "is its own ancestor");
  return QMAT_OK;
}

/* Takes a root of the scene away from the node whose child it is, as engines do: it is in the scene once, placed by its
 * own transform. */
static qmat_status take_from_parent(const qmat_gltf_checker *check, size_t child) {
  json_t *nodes = json_object_get(check->root, "nodes");
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    json_t *children = json_object_get(json_array_get(nodes, i), "children");
    for (size_t k = 0; k < json_array_size(children); k++) {
      if ((size_t)json_integer_value(json_array_get(children, k)) != child) continue;
      json_array_remove(children, k);
      json_t *text =
          json_sprintf("node %zu is a root of the scene and a child of node %zu: it is read as a root", child, i);
      return json_array_append_new(check->document->warnings, text) == 0 ? QMAT_OK : qmat_gltf_fail_memory(check);
    }
  }
  return QMAT_OK;
}

/* Removes every scene except the one to read. `has_parent` comes from check_trees. */
static qmat_status choose_scene(const qmat_gltf_checker *check, uint8_t *has_parent) {
  enum { LISTED = 2 };
  json_t *scenes = json_object_get(check->root, "scenes"), *nodes = json_object_get(check->root, "nodes");
  json_t *ids = NULL;
  int64_t scene = 0;
  bool present;
  qmat_status status = qmat_gltf_take_id(check, check->root, "scene", NULL, 0, "scenes", &scene, &present);
  if (status != QMAT_OK) return status;
  json_t *roots = json_array();
  if (!roots) return qmat_gltf_fail_memory(check);
  if (json_array_size(scenes) > 0) {
    status = check_node_ids(check, json_array_get(scenes, (size_t)scene), "nodes", "scene", (size_t)scene, &ids);
    for (size_t i = 0; i < json_array_size(ids) && status == QMAT_OK; i++) {
      json_t *value = json_array_get(ids, i);
      size_t id = (size_t)json_integer_value(value);
      if (has_parent[id] == LISTED) {
        status = qmat_gltf_fail(check, "scene", (size_t)scene, "node %zu is listed twice", id);
      } else if (has_parent[id]) {
        status = take_from_parent(check, id);
      }
      if (status == QMAT_OK && json_array_append(roots, value) != 0) status = qmat_gltf_fail_memory(check);
      has_parent[id] = LISTED;
    }
  } else {
    for (size_t i = 0; i < json_array_size(nodes) && status == QMAT_OK; i++) {
      if (!has_parent[i] && json_array_append_new(roots, json_integer((json_int_t)i)) != 0)
        status = qmat_gltf_fail_memory(check);
    }
  }
  if (status != QMAT_OK) {
    json_decref(roots);
    return status;
  }
  json_t *only = json_pack("[{s:o}]", "nodes", roots);
  if (!only || json_object_set_new(check->root, "scenes", only) != 0) return qmat_gltf_fail_memory(check);
  return QMAT_OK;
}

qmat_status qmat_gltf_check_nodes(const qmat_gltf_checker *check) {
  json_t *array = json_object_get(check->root, "nodes");
  size_t count = json_array_size(array);
  for (size_t i = 0; i < count; i++) {
    qmat_status status = check_node(check, i, json_array_get(array, i));
    if (status != QMAT_OK) return status;
  }
  uint8_t *has_parent = qmat_calloc(count, 1);
  size_t *stack = qmat_alloc(count, sizeof *stack);
  qmat_status status = has_parent && stack ? check_trees(check, has_parent, stack) : qmat_gltf_fail_memory(check);
  if (status == QMAT_OK) status = choose_scene(check, has_parent);
  qmat_free(stack);
  qmat_free(has_parent);
  return status;
}
