/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_earlier.h"

#include <math.h>
#include <string.h>

#include "core/arena.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_motion.h"

/* In the order in which they go: what a member uses comes after it. */
enum { NODES, KHR_SHAPES, OMI_SHAPES, MESHES, ACCESSORS, VIEWS, MATERIALS, BUFFERS, ARRAYS, SHAPES = ARRAYS };

/* The keys whose numbers refer to a member of each array; SHAPES: to a shape of the extension that they are in. Too
 * many only keep a member. */
static const char *const keys[ARRAYS + 1][7] = {
    [NODES] = {"node", "nodes", "children", "joints", "skeleton", "ids"},
    [MESHES] = {"mesh"},
    [KHR_SHAPES] = {"KHR_physics_rigid_bodies"},
    [OMI_SHAPES] = {"OMI_physics_body"},
    [ACCESSORS] = {"attributes", "indices", "targets", "inverseBindMatrices", "input", "output"},
    [VIEWS] = {"bufferView"},
    [MATERIALS] = {"material"},
    [BUFFERS] = {"buffer"},
    [SHAPES] = {"shape"},
};
static const char *const names[ARRAYS] = {
    [NODES] = "nodes",         [KHR_SHAPES] = "shapes", [OMI_SHAPES] = "shapes",   [MESHES] = "meshes",
    [ACCESSORS] = "accessors", [VIEWS] = "bufferViews", [MATERIALS] = "materials", [BUFFERS] = "buffers",
};
static const char *const shape_extensions[] = {"KHR_implicit_shapes", "OMI_physics_shape"};

typedef struct earlier {
  json_t *root;
  bool *ours[ARRAYS]; /* per member: what was taken out used it, or it was taken out */
  size_t counts[ARRAYS];
} earlier;

static json_t *owner_of(const earlier *e, int array) {
  if (array != KHR_SHAPES && array != OMI_SHAPES) return e->root;
  return json_object_get(json_object_get(e->root, "extensions"), shape_extensions[array - KHR_SHAPES]);
}

static json_t *members(const earlier *e, int array) {
  return json_object_get(owner_of(e, array), names[array]);
}

/* ---- references ---- */

static void mark_numbers(const json_t *value, bool *marks, size_t count) {
  const char *key;
  json_t *member;
  size_t i;
  const double number = json_is_number(value) ? json_number_value(value) : -1;
  if (number >= 0 && number < (double)count) marks[(size_t)number] = true;
  json_array_foreach(value, i, member) mark_numbers(member, marks, count);
  json_object_foreach((json_t *)(uintptr_t)value, key, member) mark_numbers(member, marks, count);
}

static bool refers(const char *key, int array) {
  for (size_t k = 0; keys[array][k]; k++)
    if (strcmp(key, keys[array][k]) == 0) return true;
  return false;
}

/* Marks the members of an array that a value refers to. */
static void mark_references(const json_t *value, int array, bool *marks, size_t count) {
  const char *key;
  json_t *member;
  size_t i;
  json_array_foreach(value, i, member) mark_references(member, array, marks, count);
  json_object_foreach((json_t *)(uintptr_t)value, key, member) {
    if (refers(key, array) && (array == KHR_SHAPES || array == OMI_SHAPES))
      mark_references(member, SHAPES, marks, count);
    else if (refers(key, array))
      mark_numbers(member, marks, count);
    else if (strcmp(key, "extras") != 0)
      mark_references(member, array, marks, count);
  }
}

/* The members of an array that anything refers to, but for nodes that were taken out; NULL when out of memory. */
static bool *used_members(const earlier *e, int array) {
  const char *key;
  json_t *value, *member;
  size_t i;
  bool *used = qmat_calloc(e->counts[array] + 1, sizeof *used);
  if (!used) return NULL;
  json_object_foreach(e->root, key, value) { /* the arrays of the root are no references */
    if (!json_is_array(value)) mark_references(value, array, used, e->counts[array]);
    json_array_foreach(value, i, member) {
      if (strcmp(key, "nodes") != 0 || i >= e->counts[NODES] || !e->ours[NODES][i])
        mark_references(member, array, used, e->counts[array]);
    }
  }
  return used;
}

/* Marks as ours what a member that is taken out refers to. */
static void mark_ours(earlier *e, const json_t *member) {
  for (int array = 0; array < ARRAYS; array++)
    if (array != NODES) mark_references(member, array, e->ours[array], e->counts[array]);
}

/* ---- nodes ---- */

static json_t *node_at(const earlier *e, double number) {
  return number >= 0 ? json_array_get(json_object_get(e->root, "nodes"), (size_t)number) : NULL;
}

static bool is_collider(const json_t *node) {
  return json_object_get(json_object_get(node, "extras"), QMAT_GLTF_COLLIDER_MARK) != NULL;
}

/* Takes the children of an earlier run off a node: colliders, with their own, and of a carrier also additions. */
static void take_children(earlier *e, json_t *node, bool is_carrier) {
  json_t *children = json_object_get(node, "children");
  qmat_gltf_drop_motion(e->root, node);
  for (size_t i = json_array_size(children); i-- > 0;) {
    const double id = json_number_value(json_array_get(children, i));
    json_t *child = node_at(e, id);
    if (!child || !(is_collider(child) || (is_carrier && qmat_gltf_is_addition(e->root, child)))) continue;
    const json_t *below = json_object_get(child, "children");
    for (size_t k = 0; k < json_array_size(below); k++) {
      const double other = json_number_value(json_array_get(below, k));
      if (is_collider(node_at(e, other))) e->ours[NODES][(size_t)other] = true;
    }
    e->ours[NODES][(size_t)id] = true;
    json_array_remove(children, i);
  }
  if (children && json_array_size(children) == 0) json_object_del(node, "children");
}

/* Removes a number from the array `key` of each member of a list. */
static void remove_number(json_t *list, const char *key, size_t number) {
  for (size_t i = 0; i < json_array_size(list); i++) {
    json_t *member = json_array_get(list, i), *numbers = json_object_get(member, key);
    for (size_t k = json_array_size(numbers); k-- > 0;)
      if (json_number_value(json_array_get(numbers, k)) == (double)number) json_array_remove(numbers, k);
  }
}

/* Takes a node with the medial mesh of all meshes out of the scenes. It stays without it where it has other members. */
static void take_merged(earlier *e, size_t id) {
  json_t *node = json_array_get(json_object_get(e->root, "nodes"), id), *extras = json_object_get(node, "extras");
  const int64_t mesh = qmat_gltf_mesh_of(node);
  take_children(e, node, true);
  qmat_gltf_drop_keys(extras);
  if (json_object_get(node, "children") || json_object_size(extras) > 0) {
    if (mesh >= 0 && qmat_gltf_is_skin(e->root, (size_t)mesh)) json_object_del(node, "mesh");
    return;
  }
  e->ours[NODES][id] = true;
  remove_number(json_object_get(e->root, "scenes"), "nodes", id);
  remove_number(json_object_get(e->root, "nodes"), "children", id);
}

/* Removes the members of a medial mesh from a node. */
static void drop_members(json_t *node) {
  json_t *extras = json_object_get(node, "extras");
  const bool had = json_object_size(extras) > 0;
  qmat_gltf_drop_keys(extras);
  if (had && json_object_size(extras) == 0) json_object_del(node, "extras");
}

/* Finds the nodes to take out, and empties them. */
static bool take_nodes(earlier *e, const bool *is_replaced) {
  const json_t *nodes = json_object_get(e->root, "nodes");
  for (size_t i = 0; i < e->counts[NODES]; i++) {
    json_t *node = json_array_get(nodes, i);
    const int64_t mesh = qmat_gltf_mesh_of(node);
    if (json_object_get(json_object_get(node, "extras"), QMAT_GLTF_MERGED_MARK)) {
      take_merged(e, i);
      continue;
    }
    if (mesh < 0 || (uint64_t)mesh >= e->counts[MESHES] || (is_replaced && !is_replaced[mesh])) continue;
    take_children(e, node, true);
    if (!is_replaced) drop_members(node);
    const json_t *number = json_object_get(node, "skin");
    const json_t *skin = json_array_get(json_object_get(e->root, "skins"), (size_t)json_number_value(number));
    const json_t *joints = number ? json_object_get(skin, "joints") : NULL;
    for (size_t k = 0; k < json_array_size(joints); k++) {
      json_t *joint = node_at(e, json_number_value(json_array_get(joints, k)));
      if (joint) take_children(e, joint, false);
    }
  }
  bool *used = used_members(e, NODES);
  for (size_t i = 0; used && i < e->counts[NODES]; i++) {
    json_t *node = json_array_get(nodes, i);
    const bool is_helper = is_collider(node) && qmat_gltf_mesh_of(node) >= 0;
    if (is_helper && !used[i]) e->ours[NODES][i] = true;
    if (!e->ours[NODES][i]) continue;
    mark_ours(e, node);
    json_object_clear(node);
  }
  qmat_free(used);
  return used != NULL;
}

/* ---- what they used ---- */

/* Whether a member may go, besides that only nodes of ours used it. */
static bool may_go(const earlier *e, int array, size_t i) {
  if (array == MESHES) return qmat_gltf_is_skin(e->root, i);
  const char *uri = json_string_value(json_object_get(json_array_get(members(e, array), i), "uri"));
  return array != BUFFERS || (uri && strncmp(uri, "data:", 5) == 0);
}

/* Removes members of ours that nothing uses any more from the end of an array. */
static bool drop_last(earlier *e, int array, double *chunk_kept) {
  json_t *list = members(e, array);
  bool *used = used_members(e, array);
  for (size_t i = json_array_size(list); used && i-- > 0;) {
    const json_t *member = json_array_get(list, i);
    if (!e->ours[array][i] || used[i] || !may_go(e, array, i)) break;
    if (array != NODES) mark_ours(e, member);
    if (array == VIEWS && json_number_value(json_object_get(member, "buffer")) == 0)
      *chunk_kept = fmin(*chunk_kept, json_number_value(json_object_get(member, "byteOffset")));
    json_array_remove(list, i);
  }
  qmat_free(used);
  if (list && json_array_size(list) == 0) json_object_del(owner_of(e, array), names[array]);
  return used != NULL;
}

/* Shortens the chunk to what the views that stay need, where those that went were its end. */
static bool shorten_chunk(earlier *e, double kept, size_t *chunk_size) {
  const json_t *views = json_object_get(e->root, "bufferViews");
  json_t *buffer = json_array_get(json_object_get(e->root, "buffers"), 0);
  if (!(kept > 0 && kept < (double)*chunk_size) || json_object_get(buffer, "uri")) return true;
  for (size_t i = 0; i < json_array_size(views); i++) {
    const json_t *view = json_array_get(views, i);
    const double end =
        json_number_value(json_object_get(view, "byteOffset")) + json_number_value(json_object_get(view, "byteLength"));
    if (json_number_value(json_object_get(view, "buffer")) == 0 && end > kept) return true;
  }
  *chunk_size = (size_t)kept;
  return qmat_gltf_set(buffer, "byteLength", json_integer((json_int_t)kept));
}

/* Whether a node or the root has an extension. */
static bool has_extension(const earlier *e, const char *name) {
  const json_t *nodes = json_object_get(e->root, "nodes");
  bool found = json_object_get(json_object_get(e->root, "extensions"), name) != NULL;
  for (size_t i = 0; i < json_array_size(nodes) && !found; i++)
    found = json_object_get(json_object_get(json_array_get(nodes, i), "extensions"), name) != NULL;
  return found;
}

static void drop_extension_names(earlier *e, const char *const *list, const bool *before) {
  json_t *used = json_object_get(e->root, "extensionsUsed"), *extensions = json_object_get(e->root, "extensions");
  for (size_t n = 0; n < 2; n++) {
    json_t *own = json_object_get(extensions, list[n]);
    if (before[n] && own && json_object_size(own) == 0) json_object_del(extensions, list[n]);
    for (size_t i = json_array_size(used); before[n] && !has_extension(e, list[n]) && i-- > 0;) {
      const char *name = json_string_value(json_array_get(used, i));
      if (name && strcmp(name, list[n]) == 0) json_array_remove(used, i);
    }
  }
  if (extensions && json_object_size(extensions) == 0) json_object_del(e->root, "extensions");
  if (used && json_array_size(used) == 0) json_object_del(e->root, "extensionsUsed");
}

bool qmat_gltf_drop_earlier(json_t *root, const bool *is_replaced, size_t *chunk_size) {
  earlier e = {.root = root};
  bool done = true, bodies[2], shapes[2];
  double chunk_kept = INFINITY;
  for (int array = 0; array < ARRAYS; array++) {
    e.counts[array] = json_array_size(members(&e, array));
    e.ours[array] = qmat_calloc(e.counts[array] + 1, sizeof(bool));
    done = done && e.ours[array];
  }
  for (size_t n = 0; n < 2; n++) {
    bodies[n] = has_extension(&e, qmat_gltf_body_extensions[n]);
    shapes[n] = has_extension(&e, shape_extensions[n]);
  }
  done = done && take_nodes(&e, is_replaced);
  for (int array = 0; array < ARRAYS; array++) done = done && drop_last(&e, array, &chunk_kept);
  if (done) {
    drop_extension_names(&e, qmat_gltf_body_extensions, bodies);
    drop_extension_names(&e, shape_extensions, shapes);
    done = shorten_chunk(&e, chunk_kept, chunk_size);
  }
  for (int array = 0; array < ARRAYS; array++) qmat_free(e.ours[array]);
  return done;
}
