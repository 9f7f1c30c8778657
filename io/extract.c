/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/extract.h"

#include <stdio.h>
#include <string.h>

#include "io/base64.h"
#include "io/draco.h"
#include "io/flat_medial.h"
#include "io/gltf/gltf_asset.h"
#include "io/mesh/ma.h"
#include "io/mesh/ply_medial.h"
#include "io/model.h"
#include "io/stored_medial.h"
#include "io/usd/usd_medial.h"

static qmat_status take_facts(qmat_context *context, const json_t *extras, json_t *facts) {
  const char *key;
  json_t *value;
  if (!facts) return QMAT_OK;
  json_object_foreach((json_t *)(uintptr_t)extras, key, value) {
    if (strncmp(key, "qmat_", 5) != 0 || strcmp(key, "qmat_data") == 0 || strcmp(key, "qmat_flat") == 0) continue;
    if (json_object_set(facts, key, value) != 0) return qmat_fail_memory(context, "the facts of a file");
  }
  return QMAT_OK;
}

/* Whether `name` is the node's name, or its number where no node has this name. */
static bool is_called(const json_t *nodes, size_t index, const char *name) {
  const char *own = json_string_value(json_object_get(json_array_get(nodes, index), "name"));
  if (own && strcmp(own, name) == 0) return true;
  char number[24];
  snprintf(number, sizeof number, "%zu", index);
  if (strcmp(number, name) != 0) return false;
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const char *other = json_string_value(json_object_get(json_array_get(nodes, i), "name"));
    if (other && strcmp(other, name) == 0) return false;
  }
  return true;
}

/* The text of a node's medial mesh in one of its two forms; NULL: none. */
static const json_t *form_of(const json_t *node, const char *key) {
  const json_t *data = json_object_get(json_object_get(node, "extras"), key);
  return json_is_string(data) ? data : NULL;
}

/* A node without Draco data is read by its plain form. */
static const json_t *data_of(const json_t *node) {
  const json_t *data = form_of(node, "qmat_data");
  return data ? data : form_of(node, "qmat_flat");
}

/* The origin of a node's sphere coordinates, in the frame of the model. */
static void take_origin(const json_t *extras, double origin[3]) {
  static const char *const axes[] = {"qmat_origin_x", "qmat_origin_y", "qmat_origin_z"};
  for (int k = 0; k < 3; k++) origin[k] = json_number_value(json_object_get(extras, axes[k]));
}

static qmat_status decode_form(qmat_context *context, const json_t *data, bool is_flat, const double origin[3],
                               qmat_medial **medial) {
  uint8_t *blob = NULL;
  size_t size = 0;
  qmat_status status = qmat_base64_decode(context, json_string_value(data), json_string_length(data), &blob, &size);
  if (status == QMAT_OK) {
    status = is_flat ? qmat_flat_decode(context, blob, size, origin, medial)
                     : qmat_draco_decode_medial(context, blob, size, origin, medial);
  }
  qmat_free(blob);
  return status;
}

/* Whether the two forms say the same: the same simplices, and spheres that differ by what the file says that storage
 * moved them. */
static bool forms_agree(const qmat_medial *a, const qmat_medial *b, const json_t *extras) {
  static const char *const keys[] = {"qmat_quantisation", "qmat_flat_quantisation"};
  const bool alike =
      a->sphere_count == b->sphere_count && a->edge_count == b->edge_count && a->triangle_count == b->triangle_count;
  if (!alike || (a->edge_count > 0 && memcmp(a->edges, b->edges, 2 * a->edge_count * sizeof *a->edges) != 0) ||
      (a->triangle_count > 0 && memcmp(a->triangles, b->triangles, 3 * a->triangle_count * sizeof *a->triangles) != 0))
    return false;
  double stated = 0;
  for (size_t i = 0; i < 2; i++) {
    const json_t *number = json_object_get(extras, keys[i]);
    if (!json_is_number(number)) return true;
    stated += json_number_value(number);
  }
  /* The factor is for rounding: the stated numbers are rounded, too. */
  return qmat_medial_move(a, b) <= stated * (1 + 1e-9);
}

/* Decodes the medial mesh of a node. Where the node has both forms, they must agree. */
static qmat_status decode_node(qmat_context *context, const json_t *node, qmat_medial **medial) {
  const json_t *extras = json_object_get(node, "extras"), *draco = form_of(node, "qmat_data"),
               *flat = form_of(node, "qmat_flat");
  double origin[3];
  take_origin(extras, origin);
  qmat_status status = decode_form(context, data_of(node), !draco, origin, medial);
  if (status != QMAT_OK || !draco || !flat) return status;
  qmat_medial *second = NULL;
  status = decode_form(context, flat, true, origin, &second);
  if (status == QMAT_OK && !forms_agree(*medial, second, extras))
    status = qmat_fail(context, QMAT_ERROR_FORMAT, "qmat_data and qmat_flat are different medial meshes");
  if (second) qmat_value_release(&second->base);
  return status;
}

/* The number of nodes with each name, by name; NULL if memory is short. */
static json_t *count_names(const json_t *nodes) {
  json_t *counts = json_object();
  bool done = counts != NULL;
  for (size_t i = 0; i < json_array_size(nodes) && done; i++) {
    const char *name = json_string_value(json_object_get(json_array_get(nodes, i), "name"));
    if (!name) continue;
    const json_int_t before = json_integer_value(json_object_get(counts, name));
    done = json_object_set_new(counts, name, json_integer(before + 1)) == 0;
  }
  if (done) return counts;
  json_decref(counts);
  return NULL;
}

/* What qmat_medial_extract finds a node by: its name, or its number where it has none of its own. NULL if memory is
 * short. */
static json_t *call_node(const json_t *nodes, size_t index, const json_t *name_counts) {
  const char *name = json_string_value(json_object_get(json_array_get(nodes, index), "name"));
  const bool alone = name && json_integer_value(json_object_get(name_counts, name)) == 1;
  return alone ? json_string(name) : json_sprintf("%zu", index);
}

/* The nodes with a medial mesh that have a name or number, or, where none has, those whose parent has it: far from zero
 * the medial mesh is on a child of the mesh's node. */
typedef struct carriers {
  size_t count, different; /* all that have one; different ones of the name */
  size_t index;            /* of the first of the name; SIZE_MAX: none */
} carriers;

static carriers find_carriers(const json_t *root, const char *name, bool by_parent) {
  const json_t *nodes = json_object_get(root, "nodes");
  carriers found = {.index = SIZE_MAX};
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const json_t *data = data_of(json_array_get(nodes, i));
    if (!data) continue;
    found.count++;
    const size_t called = by_parent ? qmat_gltf_parent_of(root, i) : i;
    if (called == SIZE_MAX || (name && !is_called(nodes, called, name))) continue;
    if (by_parent && qmat_gltf_mesh_of(json_array_get(nodes, called)) < 0) continue;
    /* Nodes that share a mesh carry the same medial mesh. */
    found.different +=
        found.index == SIZE_MAX ||
        !json_equal((json_t *)(uintptr_t)data_of(json_array_get(nodes, found.index)), (json_t *)(uintptr_t)data);
    if (found.index == SIZE_MAX) found.index = i;
  }
  return found;
}

/* No node with a medial mesh has the name: the hint lists those that have one. */
static qmat_status fail_name(qmat_context *context, const json_t *root, const char *path, const char *name) {
  const json_t *nodes = json_object_get(root, "nodes");
  const bool is_number = name[0] && name[strspn(name, "0123456789")] == 0;
  char list[160] = "";
  size_t used = 0;
  json_t *counts = count_names(nodes);
  if (!counts) return qmat_fail_memory(context, "the names of nodes");
  for (size_t i = 0; i < json_array_size(nodes) && used < sizeof list; i++) {
    if (!data_of(json_array_get(nodes, i))) continue;
    json_t *called = call_node(nodes, i, counts);
    const char *text = called ? json_string_value(called) : "";
    const size_t left = sizeof list - used, length = strlen(text) + (used > 0 ? 2 : 0);
    if (length + sizeof ", ..." > left)
      used += (size_t)snprintf(list + used, left, "%s...", used > 0 ? ", " : "") + sizeof list;
    else
      used += (size_t)snprintf(list + used, left, "%s%s", used > 0 ? ", " : "", text);
    json_decref(called);
  }
  json_decref(counts);
  qmat_fail(context, QMAT_ERROR_GEOMETRY,
            is_number ? "node %s has no medial mesh" : "no node of this name has a medial mesh", name);
  qmat_fail_hint(context, "these have one: %s", list);
  return qmat_fail_at(context, path, 0, 0);
}

static qmat_status read_gltf(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *name,
                             qmat_medial **medial, json_t *facts) {
  qmat_gltf_asset asset;
  qmat_status status = qmat_gltf_asset_init(context, bytes->data, bytes->size, path, &asset);
  carriers chosen = find_carriers(asset.root, name, false);
  if (name && chosen.index == SIZE_MAX) chosen = find_carriers(asset.root, name, true);
  const json_t *found = json_array_get(json_object_get(asset.root, "nodes"), chosen.index);
  if (status == QMAT_OK && name && !found && chosen.count > 0) {
    status = fail_name(context, asset.root, path, name);
  } else if (status == QMAT_OK && !found) {
    status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "no node has a medial mesh");
    qmat_fail_at(context, path, 0, 0);
  } else if (status == QMAT_OK && chosen.different > 1) {
    status = qmat_fail(context, QMAT_ERROR_USAGE, "%zu nodes have a medial mesh; choose one", chosen.count);
    qmat_fail_at(context, path, 0, 0);
    qmat_fail_hint(context, "give the name or number of the node; qmat info lists them");
  } else if (status == QMAT_OK) {
    status = decode_node(context, found, medial);
    if (status != QMAT_OK) qmat_fail_element(context, "node", (int64_t)chosen.index);
    if (status == QMAT_OK) status = take_facts(context, json_object_get(found, "extras"), facts);
    if (status != QMAT_OK) qmat_fail_at(context, path, 0, 0);
  }
  qmat_gltf_asset_uninit(&asset);
  return status;
}

/* Compares the counts stated in the file with the actual ones. */
static qmat_status check_counts(qmat_context *context, const qmat_medial *medial, const json_t *facts,
                                const char *path) {
  const struct {
    const char *key;
    size_t count;
  } rows[] = {{"qmat_vertices", medial->sphere_count},
              {"qmat_edges", medial->edge_count},
              {"qmat_triangles", medial->triangle_count}};
  for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
    const json_t *stated = json_object_get(facts, rows[i].key);
    if (!stated || (json_is_integer(stated) && json_integer_value(stated) == (json_int_t)rows[i].count)) continue;
    qmat_fail(context, QMAT_ERROR_FORMAT, "%s differs from the actual count, %zu", rows[i].key, rows[i].count);
    return qmat_fail_at(context, path, 0, 0);
  }
  return QMAT_OK;
}

qmat_status qmat_medial_extract(qmat_context *context, const char *path, const char *name, qmat_medial **medial,
                                json_t *facts) {
  *medial = NULL;
  qmat_bytes bytes = {0};
  qmat_format format = QMAT_FORMAT_UNKNOWN;
  json_t *stated = json_object();
  qmat_status status = stated ? qmat_bytes_read_file(context, path, &bytes) : qmat_fail_memory(context, "facts");
  if (status == QMAT_OK) status = qmat_format_choose(context, path, &bytes, &format);
  if (status == QMAT_OK && (format == QMAT_FORMAT_GLB || format == QMAT_FORMAT_GLTF)) {
    status = read_gltf(context, &bytes, path, name, medial, stated);
  } else if (status == QMAT_OK && format == QMAT_FORMAT_USD) {
    status = qmat_usd_read_medial(context, &bytes, path, name, medial, stated);
  } else if (status == QMAT_OK && format == QMAT_FORMAT_MA) {
    status = qmat_ma_read(context, &bytes, path, medial);
  } else if (status == QMAT_OK && format == QMAT_FORMAT_PLY) {
    status = qmat_ply_read_medial(context, &bytes, path, medial, stated);
  } else if (status == QMAT_OK) {
    qmat_fail(context, status = QMAT_ERROR_GEOMETRY, "%s does not carry medial meshes", qmat_format_title(format));
    qmat_fail_at(context, path, 0, 0);
  }
  if (status == QMAT_OK) status = check_counts(context, *medial, stated, path);
  if (status == QMAT_OK && facts && json_object_update(facts, stated) != 0) status = qmat_fail_memory(context, "facts");
  if (status != QMAT_OK && *medial) {
    qmat_value_release(&(*medial)->base);
    *medial = NULL;
  }
  json_decref(stated);
  qmat_bytes_uninit(&bytes);
  return status;
}

/* The entry of a node in qmat_medial_carriers; NULL if memory is short. */
static json_t *describe_carrier(const json_t *root, size_t index, const json_t *name_counts) {
  const json_t *node = json_array_get(json_object_get(root, "nodes"), index);
  json_t *carrier = json_object(), *text = call_node(json_object_get(root, "nodes"), index, name_counts);
  int64_t mesh = qmat_gltf_mesh_of(node);
  if (mesh < 0) { /* far from zero the medial mesh is on a child of the node */
    const size_t parent = qmat_gltf_parent_of(root, index);
    if (parent != SIZE_MAX) mesh = qmat_gltf_mesh_of(json_array_get(json_object_get(root, "nodes"), parent));
  }
  bool done = json_object_set_new(carrier, "node", text) == 0;
  if (mesh >= 0 && !qmat_gltf_is_skin(root, (size_t)mesh))
    done = json_object_set_new(carrier, "mesh", json_integer(mesh)) == 0 && done;
  if (done) return carrier;
  json_decref(carrier);
  return NULL;
}

/* Adds the prims with a medial mesh. */
static qmat_status list_prims(qmat_context *context, const qmat_bytes *bytes, const char *path, json_t *carriers) {
  json_t *names;
  qmat_status status = qmat_usd_list_medials(context, bytes, path, &names);
  for (size_t i = 0; status == QMAT_OK && i < json_array_size(names); i++)
    if (json_array_append_new(carriers, json_pack("{s:O}", "node", json_array_get(names, i))) != 0)
      status = qmat_fail_memory(context, "facts");
  if (names) json_decref(names);
  return status;
}

json_t *qmat_medial_carriers(qmat_context *context, const char *path) {
  qmat_bytes bytes = {0};
  qmat_gltf_asset asset = {0};
  qmat_format format = QMAT_FORMAT_UNKNOWN;
  json_t *carriers = json_array(), *seen = json_object(), *name_counts = NULL; /* the keys of `seen` are data */
  qmat_status status =
      carriers && seen ? qmat_bytes_read_file(context, path, &bytes) : qmat_fail_memory(context, "facts");
  if (status == QMAT_OK) status = qmat_format_choose(context, path, &bytes, &format);
  if (status == QMAT_OK && (format == QMAT_FORMAT_GLB || format == QMAT_FORMAT_GLTF))
    status = qmat_gltf_asset_init(context, bytes.data, bytes.size, path, &asset);
  if (status == QMAT_OK && format == QMAT_FORMAT_USD) status = list_prims(context, &bytes, path, carriers);
  const json_t *nodes = json_object_get(asset.root, "nodes");
  if (status == QMAT_OK && !(name_counts = count_names(nodes))) status = qmat_fail_memory(context, "facts");
  for (size_t i = 0; i < json_array_size(nodes) && status == QMAT_OK; i++) {
    const char *data = json_string_value(data_of(json_array_get(nodes, i)));
    if (!data || json_object_get(seen, data)) continue;
    if (json_object_set_new(seen, data, json_true()) != 0 ||
        json_array_append_new(carriers, describe_carrier(asset.root, i, name_counts)) != 0)
      status = qmat_fail_memory(context, "facts");
  }
  json_decref(name_counts);
  json_decref(seen);
  qmat_gltf_asset_uninit(&asset);
  qmat_bytes_uninit(&bytes);
  if (status == QMAT_OK) return carriers;
  json_decref(carriers);
  return NULL;
}
