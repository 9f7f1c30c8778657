/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_hull_names.h"

#include <stdlib.h>
#include <string.h>

#include "core/arena.h"
#include "io/gltf/gltf_asset.h"

static const char godot_ending[] = "-convcolonly";

/* The bytes before the number at the end of "UCX_Box_01", and the number; false: there is none. */
static bool split(const char *name, size_t length, size_t *stem, json_int_t *number) {
  size_t at = length;
  while (at > 0 && name[at - 1] >= '0' && name[at - 1] <= '9') at--;
  if (at == length || length - at > 9 || at == 0 || name[at - 1] != '_') return false;
  *stem = at;
  *number = (json_int_t)strtol(name + at, NULL, 10);
  return true;
}

/* Whether a mesh is a hull that a collider needs: skins have a material. */
static bool is_hull(const json_t *root, size_t mesh) {
  const json_t *object = json_array_get(json_object_get(root, "meshes"), mesh);
  return qmat_gltf_is_skin(root, mesh) &&
         !json_object_get(json_array_get(json_object_get(object, "primitives"), 0), "material");
}

/* Gives a node the new number of its hull. */
static bool rename_node(json_t *node, json_int_t number) {
  const char *name = json_string_value(json_object_get(node, "name"));
  const size_t length = name ? strlen(name) : 0, ending = strlen(godot_ending);
  const bool is_godot = length > ending && strcmp(name + length - ending, godot_ending) == 0;
  size_t stem;
  json_int_t before;
  if (!name || !split(name, is_godot ? length - ending : length, &stem, &before) || before == number) return true;
  return qmat_gltf_set(node, "name",
                       json_sprintf("%.*s%02lld%s", (int)stem, name, (long long)number, is_godot ? godot_ending : ""));
}

/* Finds the number of each hull; 0: the mesh is none. */
static bool number_meshes(json_t *root, size_t meshes_given, json_int_t *numbers) {
  json_t *meshes = json_object_get(root, "meshes"), *highest = json_object(); /* number of each stem */
  bool done = highest != NULL;
  for (size_t i = 0; i < json_array_size(meshes) && done; i++) {
    json_t *mesh = json_array_get(meshes, i);
    const char *name = json_string_value(json_object_get(mesh, "name"));
    const bool is_ours = i >= meshes_given;
    size_t stem;
    json_int_t number;
    if (!name || !split(name, strlen(name), &stem, &number)) continue;
    if (is_ours ? !is_hull(root, i) : strncmp(name, "UCX_", 4) != 0) continue;
    json_t *key = json_stringn(name, stem);
    const json_int_t last = json_integer_value(json_object_get(highest, key ? json_string_value(key) : ""));
    done = key != NULL;
    if (is_ours && number <= last && done) {
      number = last + 1;
      done = qmat_gltf_set(mesh, "name", json_sprintf("%s%02lld", json_string_value(key), (long long)number));
    }
    if (is_ours) numbers[i] = number;
    if (done && number > last) done = qmat_gltf_set(highest, json_string_value(key), json_integer(number));
    json_decref(key);
  }
  json_decref(highest);
  return done;
}

bool qmat_gltf_number_hulls(json_t *root, size_t meshes_given, size_t nodes_given) {
  const json_t *nodes = json_object_get(root, "nodes");
  const size_t count = json_array_size(json_object_get(root, "meshes"));
  if (count <= meshes_given) return true;
  json_int_t *numbers = qmat_calloc(count, sizeof *numbers);
  bool done = numbers && number_meshes(root, meshes_given, numbers);
  for (size_t i = nodes_given; i < json_array_size(nodes) && done; i++) {
    json_t *node = json_array_get(nodes, i);
    const int64_t mesh = qmat_gltf_mesh_of(node);
    if (mesh >= 0 && (uint64_t)mesh < count && numbers[mesh] > 0) done = rename_node(node, numbers[mesh]);
  }
  qmat_free(numbers);
  return done;
}
