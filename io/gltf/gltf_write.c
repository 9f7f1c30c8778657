/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_write.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/node.h"
#include "io/base64.h"
#include "io/bytes.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_bind.h"
#include "io/gltf/gltf_colliders.h"
#include "io/gltf/gltf_compress.h"
#include "io/gltf/gltf_earlier.h"
#include "io/gltf/gltf_embed.h"
#include "io/gltf/gltf_hull_names.h"
#include "io/gltf/gltf_medial_text.h"
#include "io/gltf/gltf_place.h"
#include "io/gltf/gltf_rig.h"
#include "io/gltf/gltf_skin.h"

#define DATA_URI "data:application/octet-stream;base64,"

static bool is_zero(const double *origin) {
  return origin[0] == 0 && origin[1] == 0 && origin[2] == 0;
}

/* ---- JSON ---- */

/* json_pack fails on a NULL argument and frees the others, so one check at the end suffices. */

/* The asset under construction: new, or one that was read. */
typedef struct document {
  json_t *root;
  bool binary;
  qmat_gltf_asset asset;            /* the asset that was read, or empty */
  uint8_t *embedded;                /* the chunk with embedded files, then also asset.chunk; owned; may be NULL */
  qmat_gltf_compressed compressed;  /* compressed meshes, or empty; its chunk, if any, is then also asset.chunk */
  qmat_writer data;                 /* bytes to add to the buffers */
  bool in_chunk;                    /* `data` goes into the GLB's chunk, not into a buffer with a URI */
  size_t data_start;                /* offset of `data` after the asset's own chunk; 0: in another buffer */
  json_int_t buffer;                /* number of the buffer that holds `data` */
  json_int_t material;              /* of the skins; -1: not created yet */
  const qmat_scene *places;         /* of a new asset: where the meshes are; NULL: one mesh, where it is */
  size_t nodes_given, meshes_given; /* of the asset that was read */
  json_t *converter;                /* of a new asset: the node that turns units and axes; NULL: none yet */
  qmat_gltf_rig rig;                /* of the places */
  json_int_t *skins;                /* per place: its skin in the asset, -1: none; NULL: no place has one */
} document;

/* The bytes as a data URI; NULL when out of memory. */
static json_t *data_uri(const uint8_t *bytes, size_t size) {
  char *base64 = qmat_base64_encode(bytes, size);
  json_t *uri = base64 ? json_sprintf("%s%s", DATA_URI, base64) : NULL;
  qmat_free(base64);
  return uri;
}

/* ---- additions to nodes ---- */

static bool set_extras(json_t *node, const json_t *extras) {
  json_t *own = json_object_get(node, "extras");
  if (!own) { /* json_copy silently loses keys when out of memory */
    own = json_object();
    if (!qmat_gltf_set(node, "extras", own)) return false;
  }
  return json_object_update(own, (json_t *)(uintptr_t)extras) == 0;
}

/* Translates a node to the origin of its data. */
static bool set_translation(json_t *node, const double *origin) {
  return is_zero(origin) || qmat_gltf_set(node, "translation", json_pack("[f, f, f]", origin[0], origin[1], origin[2]));
}

/* Adds a child to a node and names it after the node. */
static bool add_child(json_t *root, json_t *node, json_t *child, const double *origin, const char *what) {
  const char *name = json_string_value(json_object_get(node, "name"));
  json_int_t number;
  bool done = child && set_translation(child, origin) &&
              (!name || qmat_gltf_set(child, "name", json_sprintf("%s %s", name, what)));
  done = qmat_gltf_add(root, "nodes", child, &number) && done;
  return done && qmat_gltf_add(node, "children", json_integer(number), NULL);
}

static const double in_place[3] = {0, 0, 0}; /* where joints take the points of a mesh from */

/* Adds a medial mesh and its skin to every node that references the mesh. The skin is always on a child. The medial
 * mesh is on a child if its origin is not the node's, or if the node's extras are not an object. A skin with joints
 * moves by the skin of the node. */
static bool add_to_carriers(document *document, json_int_t mesh, const json_t *extras, const double *origin,
                            json_int_t skin, bool has_joints) {
  json_t *nodes = json_object_get(document->root, "nodes");
  const size_t count = json_array_size(nodes);
  bool done = true;
  for (size_t i = 0; i < count && done; i++) {
    json_t *node = json_array_get(nodes, i), *own = json_object_get(node, "extras");
    if (qmat_gltf_mesh_of(node) != mesh) continue;
    qmat_gltf_drop_keys(own);
    qmat_gltf_drop_children(document->root, node, document->nodes_given, qmat_gltf_is_addition);
    if (!is_zero(origin) || (own && !json_is_object(own))) {
      done = add_child(document->root, node, json_pack("{s:O}", "extras", extras), origin, "medial mesh");
    } else {
      done = set_extras(node, extras);
    }
    if (!done || skin < 0) continue;
    json_t *child = json_pack("{s:I}", "mesh", skin), *moved_by = json_object_get(node, "skin");
    if (child && has_joints && moved_by) done = qmat_gltf_set(child, "skin", json_incref(moved_by));
    done = add_child(document->root, node, child, has_joints ? in_place : origin, "skin") && done;
  }
  return done;
}

/* Adds a node to the scene that is shown. */
static bool add_root(json_t *root, json_int_t number) {
  const json_t *scenes = json_object_get(root, "scenes"), *chosen = json_object_get(root, "scene");
  json_t *scene = json_array_get(scenes, json_is_number(chosen) ? (size_t)json_number_value(chosen) : 0);
  return !scene || qmat_gltf_add(scene, "nodes", json_integer(number), NULL); /* without scenes every root is shown */
}

/* Adds a node to a new asset: to its scene, or to the child of it that turns the model's space into metres with y up,
 * where they differ. */
static bool add_converted(document *document, const qmat_gltf_options *options, json_int_t number) {
  const double unit = options->meters_per_unit > 0 ? options->meters_per_unit : 1, half = sqrt(0.5);
  if (unit == 1 && !options->is_z_up) return add_root(document->root, number);
  if (!document->converter) {
    json_t *node = json_object();
    json_int_t converter;
    bool done = node != NULL;
    const char *name = document->places ? document->places->name : options->name;
    if (name && name[0] && qmat_is_utf8(name))
      done = done && qmat_gltf_set(node, "name", json_sprintf("%s in metres, y up", name));
    if (options->is_z_up) /* by -90 degrees about x */
      done = done && qmat_gltf_set(node, "rotation", json_pack("[f, f, f, f]", -half, 0.0, 0.0, half));
    if (unit != 1) done = done && qmat_gltf_set(node, "scale", json_pack("[f, f, f]", unit, unit, unit));
    if (!qmat_gltf_add(document->root, "nodes", node, &converter) || !done || !add_root(document->root, converter))
      return false;
    document->converter = node;
  }
  return qmat_gltf_add(document->converter, "children", json_integer(number), NULL);
}

/* Adds a node for the medial mesh of all meshes together. */
static bool add_node(document *document, const json_t *extras, const double *origin, json_int_t skin, const char *name,
                     const qmat_gltf_options *options, bool is_new) {
  json_t *node = json_object();
  bool done = node && set_translation(node, origin);
  if (name) done = done && qmat_gltf_set(node, "name", json_string(name));
  if (skin >= 0) done = done && qmat_gltf_set(node, "mesh", json_integer(skin));
  done = done && set_extras(node, extras);
  if (!is_new) done = done && qmat_gltf_set(json_object_get(node, "extras"), QMAT_GLTF_MERGED_MARK, json_true());
  json_int_t number;
  if (!qmat_gltf_add(document->root, "nodes", node, &number) || !done) return false;
  return is_new ? add_converted(document, options, number) : add_root(document->root, number);
}

/* Turns a transform into a new asset's space into one into metres with y up. */
static void convert(const qmat_gltf_options *options, double m[16]) {
  const double unit = options->meters_per_unit > 0 ? options->meters_per_unit : 1;
  for (int i = 0; i < 16; i += 4) {
    const double y = unit * m[i + 1], z = unit * m[i + 2];
    m[i] *= unit;
    m[i + 1] = options->is_z_up ? z : y;
    m[i + 2] = options->is_z_up ? 0 - y : z; /* no -0 */
  }
}

/* Adds the node of a skinned mesh, which no transform moves but those of its joints, and makes `top` its child: the
 * place of the medial mesh where nothing is skinned. */
static bool add_skinned(document *document, const char *name, json_int_t mesh, json_int_t skin, json_int_t top) {
  json_int_t number;
  json_t *node = json_pack("{s:I, s:I, s:[I]}", "mesh", mesh, "skin", skin, "children", top);
  bool done = node && qmat_gltf_set(node, "name", json_sprintf("%s skin", name));
  done = qmat_gltf_add(document->root, "nodes", node, &number) && done;
  return done && add_root(document->root, number);
}

/* Adds a node at each place of a mesh. */
static bool add_places(document *document, size_t mesh, const json_t *extras, const double *origin, json_int_t skin,
                       const qmat_gltf_options *options) {
  const qmat_scene *scene = document->places;
  bool done = true;
  for (size_t i = 0; i < scene->placement_count && done; i++) {
    if (scene->placed[i] != mesh) continue;
    const bool is_skinned = skin >= 0 && document->skins && document->skins[i] >= 0;
    const char *path = scene->placement_paths[i], *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    double m[16];
    json_int_t number, top;
    memcpy(m, scene->placements + 16 * i, sizeof m);
    for (int k = 0; k < 3; k++) m[12 + k] += origin[0] * m[k] + origin[1] * m[4 + k] + origin[2] * m[8 + k];
    if (is_skinned) convert(options, m);
    json_t *node = json_pack("{s:s}", "name", name);
    if (!qmat_gltf_place(document->root, node, m, &number, &top)) return false;
    if (skin >= 0 && !is_skinned) done = qmat_gltf_set(node, "mesh", json_integer(skin));
    done = done && set_extras(node, extras);
    done = done && qmat_gltf_set(json_object_get(node, "extras"), "qmat_prim", json_string(path));
    done = done && (is_skinned ? add_skinned(document, name, skin, document->skins[i], top)
                               : add_converted(document, options, top));
  }
  return done;
}

/* ---- skeletons ---- */

/* Adds the skeletons of the places, and their motion. */
static qmat_status add_rig(qmat_context *context, document *document, const qmat_gltf_options *options) {
  const qmat_rig *rig = &document->places->rig;
  if (rig->placed_count == 0) return QMAT_OK;
  document->skins = qmat_alloc(rig->placed_count, sizeof *document->skins);
  if (!document->skins) return qmat_fail_memory(context, "a glTF file");
  for (size_t i = 0; i < rig->placed_count; i++) document->skins[i] = -1;
  const qmat_status status = qmat_gltf_rig_init(context, document->root, rig, document->buffer, document->data_start,
                                                &document->data, &document->rig);
  for (size_t i = 0; i < rig->skeleton_count && status == QMAT_OK; i++)
    if (document->rig.tops[i] >= 0 && !add_converted(document, options, document->rig.tops[i]))
      return qmat_fail_memory(context, "a glTF file");
  return status;
}

/* Adds the skins of a mesh and notes them for its places. */
static qmat_status add_skins(qmat_context *context, document *document, size_t mesh) {
  const qmat_scene *places = document->places;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < places->rig.placed_count && status == QMAT_OK; i++) {
    const uint32_t skin = places->rig.placed_skins[i];
    if (places->placed[i] == mesh && skin != UINT32_MAX)
      status = qmat_gltf_rig_skin(context, document->root, &document->rig, skin, document->buffer, document->data_start,
                                  &document->data, &document->skins[i]);
  }
  return status;
}

/* ---- the document ---- */

/* Takes what an earlier run added for the meshes that get medial meshes out of the asset: for all of them where they
 * share one. */
static qmat_status drop_earlier(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                                document *document) {
  const size_t count = json_array_size(json_object_get(document->root, "meshes"));
  bool *is_replaced = qmat_calloc(count + 1, sizeof *is_replaced);
  for (size_t i = 0; is_replaced && i < scene->mesh_count; i++)
    if (scene->meshes[i] < count) is_replaced[scene->meshes[i]] = additions[i].medial != NULL;
  const bool *replaced = scene->mesh_count > 0 ? is_replaced : NULL;
  const bool done = is_replaced && qmat_gltf_drop_earlier(document->root, replaced, &document->asset.chunk_size);
  qmat_free(is_replaced);
  return done ? QMAT_OK : qmat_fail_memory(context, "a glTF file");
}

static qmat_status open_document(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                                 document *document) {
  const qmat_gltf_options *options = &additions[0].options;
  document->binary = document->in_chunk = options->binary;
  document->material = -1;
  if (!scene) {
    document->root = json_pack("{s:{s:s, s:s}, s:i, s:[{}]}", "asset", "version", "2.0", "generator",
                               "qmat " QMAT_VERSION, "scene", 0, "scenes");
    return document->root ? QMAT_OK : qmat_fail_memory(context, "a glTF file");
  }
  const qmat_file_part *main_part = &scene->parts[0];
  qmat_status status = qmat_gltf_asset_init(context, main_part->bytes, main_part->size, scene->name, &document->asset);
  if (status != QMAT_OK) return status;
  document->root = json_incref(document->asset.root);
  qmat_gltf_asset *asset = &document->asset;
  size_t size = 0;
  if (options->binary && options->embed)
    status =
        qmat_gltf_embed(context, scene, document->root, asset->chunk, asset->chunk_size, &document->embedded, &size);
  if (document->embedded) {
    asset->chunk = document->embedded;
    asset->chunk_size = size;
  }
  if (status == QMAT_OK) status = drop_earlier(context, scene, additions, document);
  document->nodes_given = json_array_size(json_object_get(document->root, "nodes"));
  document->meshes_given = json_array_size(json_object_get(document->root, "meshes"));
  const json_t *buffers = json_object_get(document->root, "buffers");
  const bool has_chunk =
      asset->chunk && json_array_size(buffers) > 0 && !json_object_get(json_array_get(buffers, 0), "uri");
  if (has_chunk) {
    document->data_start = (asset->chunk_size + 3) / 4 * 4;
  } else {
    document->buffer = (json_int_t)json_array_size(buffers);
    document->in_chunk = options->binary && document->buffer == 0 && !asset->chunk;
  }
  return status;
}

static void close_document(document *document) {
  qmat_writer_uninit(&document->data);
  json_decref(document->root);
  qmat_gltf_asset_uninit(&document->asset);
  qmat_gltf_compressed_uninit(&document->compressed);
  qmat_gltf_rig_uninit(&document->rig);
  qmat_free(document->skins);
  qmat_free(document->embedded);
}

/* Compresses the asset's own meshes and adds the result to `report`. */
static qmat_status compress_meshes(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                                   size_t count, document *document, json_t *report) {
  json_t *notes = json_array();
  if (!notes) return qmat_fail_memory(context, "the report");
  qmat_status status = QMAT_OK;
  if (scene->mesh_count == 0 || document->data_start == 0) {
    const char *why = scene->mesh_count == 0 ? "they share one medial mesh" : "their data are not in a GLB chunk";
    if (json_array_append_new(notes, json_sprintf("the meshes are unchanged: %s", why)) != 0)
      status = qmat_fail_memory(context, "the report");
  } else {
    double error = 1;
    for (size_t i = 0; i < count; i++) {
      const qmat_gltf_options *options = &additions[i].options;
      const double diagonal = options->errors.diagonal;
      if (additions[i].medial && diagonal > 0) error = fmin(error, options->quantisation / diagonal);
    }
    status = qmat_gltf_compress(context, document->root, document->asset.chunk, document->asset.chunk_size, error,
                                notes, &document->compressed);
  }
  if (status == QMAT_OK && document->compressed.chunk) {
    document->asset.chunk = document->compressed.chunk;
    document->asset.chunk_size = document->data_start = document->compressed.chunk_size;
  }
  if (status == QMAT_OK && report) {
    bool done = qmat_gltf_set(report, "draco_primitives", json_integer((json_int_t)document->compressed.primitives));
    if (json_array_size(notes) > 0) done = json_object_set(report, "warnings", notes) == 0 && done;
    if (!done) status = qmat_fail_memory(context, "the report");
  }
  json_decref(notes);
  return status;
}

/* The options after compression moved the mesh. A smaller quantisation preserves the certificate if possible. */
static qmat_gltf_options options_after(const qmat_gltf_options *options, double moved) {
  qmat_gltf_options after = *options;
  after.errors = qmat_errors_after_move(&options->errors, moved);
  const qmat_stated_errors *errors = &after.errors;
  const double left = (errors->epsilon - fmax(errors->error_out, errors->error_in)) * errors->diagonal;
  if (errors->certified == QMAT_CERTIFICATE_YES && left > 0) after.quantisation = fmin(left, options->quantisation);
  return after;
}

/* The node with the skin of a node: itself, or its parent where a skinned mesh is above. SIZE_MAX: there is none. */
static size_t skinned_node(const json_t *root, size_t id) {
  const json_t *nodes = json_object_get(root, "nodes");
  if (json_object_get(json_array_get(nodes, id), "skin")) return id;
  const size_t parent = qmat_gltf_parent_of(root, id);
  return json_object_get(json_array_get(nodes, parent), "skin") ? parent : SIZE_MAX;
}

/* Adds colliders to a node with the mesh, or to the joints of its skin. */
static qmat_status attach_colliders(qmat_context *context, const qmat_scene *scene, const qmat_medial *medial,
                                    document *document, const qmat_gltf_colliders *added, size_t id,
                                    const double shift[3]) {
  const json_t *nodes = json_object_get(document->root, "nodes");
  const size_t carrier = medial->skinned_count > 0 ? skinned_node(document->root, id) : SIZE_MAX;
  const double *bound = NULL;
  double *matrices = NULL;
  bool done = true;
  if (carrier != SIZE_MAX) {
    const json_t *node = json_array_get(nodes, carrier), *skin = json_object_get(node, "skin");
    for (size_t i = 0; i < carrier; i++) { /* nodes that share mesh and skin are in one place */
      const json_t *other = json_array_get(nodes, i);
      if (qmat_gltf_mesh_of(other) == qmat_gltf_mesh_of(node) && json_equal(json_object_get(other, "skin"), skin))
        return QMAT_OK;
    }
    const size_t number = (size_t)json_number_value(skin);
    const qmat_status status =
        scene ? qmat_gltf_bind_matrices(context, scene, &document->asset, number, &matrices) : QMAT_OK;
    if (status != QMAT_OK) return status;
    bound = scene ? matrices : qmat_gltf_rig_matrices(&document->rig, number);
  }
  done = bound ? qmat_gltf_colliders_attach_to_joints(document->root, (json_int_t)id, added, medial, bound)
               : qmat_gltf_colliders_attach(document->root, (json_int_t)id, added, shift);
  qmat_free(matrices);
  return done ? QMAT_OK : qmat_fail_memory(context, "a glTF file");
}

/* Adds colliders to every node that references the mesh; without one (-1), to the new nodes with a medial mesh. */
static qmat_status add_colliders(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *addition,
                                 document *document, const double origin[3], const char *name, json_int_t mesh,
                                 size_t nodes_before) {
  static const double none[3] = {0, 0, 0};
  const json_t *nodes = json_object_get(document->root, "nodes");
  const size_t count = json_array_size(nodes);
  /* Unreal finds the hulls of a mesh by its name. */
  const json_t *meshes = json_object_get(document->root, "meshes");
  const char *own = json_string_value(json_object_get(json_array_get(meshes, (size_t)mesh), "name"));
  if (mesh >= 0 && own && *own) name = own;
  qmat_gltf_colliders added = {.colliders = addition->colliders,
                               .forms = addition->collider_forms,
                               .name = name ? name : "model",
                               .dynamic = addition->dynamic,
                               .meters = addition->options.errors.meters_per_unit,
                               .nodes_given = document->nodes_given,
                               .origin = {origin[0], origin[1], origin[2]}};
  qmat_status status = qmat_gltf_colliders_init(context, document->root, document->buffer, document->data_start,
                                                &document->data, &added);
  for (size_t i = mesh < 0 ? nodes_before : 0; i < count && status == QMAT_OK; i++) {
    const json_t *node = json_array_get(nodes, i);
    const bool is_new = json_object_get(json_object_get(node, "extras"), "qmat_version") != NULL;
    if (mesh < 0 ? is_new : qmat_gltf_mesh_of(node) == mesh)
      status = attach_colliders(context, scene, addition->medial, document, &added, i, mesh < 0 ? origin : none);
  }
  qmat_gltf_colliders_uninit(&added);
  return status;
}

/* Adds one medial mesh and its skin. */
static qmat_status add_medial(qmat_context *context, const qmat_scene *scene, size_t index,
                              const qmat_gltf_addition *addition, document *document) {
  const bool of_mesh = scene && scene->mesh_count > 0, is_moved = of_mesh && document->compressed.moved;
  const qmat_gltf_options options =
      options_after(&addition->options, is_moved ? document->compressed.moved[scene->meshes[index]] : 0);
  /* JSON must be UTF-8, but a file's name may be anything. */
  const char *name = options.name && options.name[0] && qmat_is_utf8(options.name) ? options.name : NULL;
  const qmat_mesh *mesh = addition->skin && addition->skin->triangle_count > 0 ? addition->skin : NULL;
  qmat_gltf_medial_text text = {0};
  qmat_gltf_skin data = {0};
  json_int_t skin = -1;
  const size_t nodes_before = json_array_size(json_object_get(document->root, "nodes"));
  double origin[3];
  qmat_status status = QMAT_OK;
  qmat_storage_origin(addition->medial, mesh, options.quantisation, origin);
  const bool has_rig = mesh && (document->skins || of_mesh) && addition->vertices.joints;
  if (has_rig && document->skins) status = add_skins(context, document, index);
  if (status == QMAT_OK)
    status = qmat_gltf_medial_text_init(context, addition->medial, origin, of_mesh || has_rig, &options, &text);
  const qmat_stated_errors stated = qmat_errors_after_move(&options.errors, fmax(text.loss, text.flat_loss));
  const double skin_moved = options.compress_skin && !has_rig ? fmax(options.quantisation, DBL_MIN) : 0;
  const size_t offset = document->data_start + document->data.size;
  if (status == QMAT_OK && mesh)
    status = qmat_gltf_skin_put(context, mesh, has_rig ? in_place : origin, &addition->vertices, skin_moved, &data,
                                &document->data);
  json_t *extras = status == QMAT_OK ? qmat_gltf_medial_extras(addition->medial, &text, &stated) : NULL;
  bool done = extras && (!mesh || qmat_gltf_skin_add(document->root, &data, document->buffer, offset,
                                                     &document->material, name, scene != NULL, &skin));
  if (done && of_mesh) {
    done = add_to_carriers(document, scene->meshes[index], extras, origin, skin, has_rig);
  } else if (done) {
    done = document->places ? add_places(document, index, extras, origin, skin, &options)
                            : add_node(document, extras, origin, skin, name, &options, !scene);
  }
  if (done && addition->colliders)
    status = add_colliders(context, scene, addition, document, origin, name,
                           of_mesh ? (json_int_t)scene->meshes[index] : -1, nodes_before);
  if (status == QMAT_OK && !done) status = qmat_fail_memory(context, "a glTF file");
  if (options.stated) *options.stated = stated;
  json_decref(extras);
  qmat_gltf_medial_text_uninit(&text);
  return status;
}

/* Records the location of the added data in the JSON. A .gltf gets the asset's own chunk as a data URI too. */
static bool place_data(const document *document) {
  const size_t size = document->data.size;
  json_t *buffers = json_object_get(document->root, "buffers"), *first = json_array_get(buffers, 0);
  if (document->data_start > 0) { /* after the asset's own chunk */
    if (size > 0 && !qmat_gltf_set(first, "byteLength", json_integer((json_int_t)(document->data_start + size))))
      return false;
    if (document->binary) return true;
    qmat_writer all = {0};
    qmat_put_bytes(&all, document->asset.chunk, document->asset.chunk_size);
    qmat_gltf_pad(&all, 0);
    qmat_put_bytes(&all, document->data.bytes, size);
    const bool done = !all.failed && qmat_gltf_set(first, "uri", data_uri(all.bytes, all.size));
    qmat_writer_uninit(&all);
    return done;
  }
  if (size == 0) return true;
  json_t *buffer = json_pack("{s:I}", "byteLength", (json_int_t)size);
  bool done = buffer != NULL;
  if (done && !document->in_chunk) done = qmat_gltf_set(buffer, "uri", data_uri(document->data.bytes, size));
  return qmat_gltf_add(document->root, "buffers", buffer, NULL) && done;
}

/* ---- the file ---- */

static qmat_status make_file(qmat_context *context, const qmat_scene *scene, const document *document,
                             qmat_file **file) {
  qmat_file_part *sides = NULL;
  size_t side_count = 0;
  qmat_writer out = {0};
  qmat_file *made = qmat_file_new();
  qmat_status status = made ? QMAT_OK : qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK && scene) status = qmat_gltf_side_parts(context, scene, document->root, &sides, &side_count);
  if (made) {
    made->format = qmat_strdup(document->binary ? "glb" : "gltf");
    made->parts = qmat_calloc(1 + side_count, sizeof *made->parts);
    if (made->parts) made->part_count = 1 + side_count;
  }
  for (size_t i = 0; i < side_count; i++) {
    if (made->parts) {
      made->parts[1 + i] = sides[i];
    } else {
      qmat_free(sides[i].name);
      qmat_free(sides[i].bytes);
    }
  }
  qmat_free(sides);
  if (status == QMAT_OK && (!made->format || !made->parts)) status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK) {
    const qmat_gltf_asset asset = {.binary = document->binary,
                                   .root = document->root,
                                   .chunk = document->asset.chunk,
                                   .chunk_size = document->asset.chunk_size,
                                   .more = document->asset.more,
                                   .more_size = document->asset.more_size};
    status =
        qmat_gltf_asset_put(context, &asset, document->data.bytes, document->in_chunk ? document->data.size : 0, &out);
  }
  if (status == QMAT_OK) status = qmat_writer_to_part(context, &out, made, 0, "");
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) {
    *file = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  qmat_writer_uninit(&out);
  return status;
}

/* `scene` is NULL for a new asset, whose meshes then are at `places` (NULL: there is one). */
static qmat_status write_document(qmat_context *context, const qmat_scene *scene, const qmat_scene *places,
                                  const qmat_gltf_addition *additions, size_t count, bool draco_meshes, json_t *report,
                                  qmat_file **file) {
  document document = {.places = places};
  *file = NULL;
  qmat_status status = open_document(context, scene, additions, &document);
  if (status == QMAT_OK && draco_meshes) status = compress_meshes(context, scene, additions, count, &document, report);
  if (status == QMAT_OK && places) status = add_rig(context, &document, &additions[0].options);
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    if (additions[i].medial) status = add_medial(context, scene, i, &additions[i], &document);
  if (status == QMAT_OK && !qmat_gltf_number_hulls(document.root, document.meshes_given, document.nodes_given))
    status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK && !place_data(&document)) status = qmat_fail_memory(context, "a glTF file");
  if (status == QMAT_OK) status = make_file(context, scene, &document, file);
  close_document(&document);
  return status;
}

qmat_status qmat_gltf_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                            const qmat_gltf_options *options, qmat_file **file) {
  const qmat_gltf_addition addition = {.medial = medial, .skin = skin, .options = *options};
  return write_document(context, NULL, NULL, &addition, 1, false, NULL, file);
}

qmat_status qmat_gltf_write_places(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                                   size_t count, qmat_file **file) {
  return write_document(context, NULL, scene, additions, count, false, NULL, file);
}

qmat_status qmat_gltf_write_addition(qmat_context *context, const qmat_gltf_addition *addition, qmat_file **file) {
  return write_document(context, NULL, NULL, addition, 1, false, NULL, file);
}

qmat_status qmat_gltf_enrich(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                             size_t count, bool draco_meshes, json_t *report, qmat_file **file) {
  return write_document(context, scene, NULL, additions, count, draco_meshes, report, file);
}
