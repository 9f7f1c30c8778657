/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_colliders.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "io/collider_frames.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_motion.h"
#include "io/gltf/gltf_skin.h"

enum { ARRAY_BUFFER = 34962, ELEMENT_ARRAY_BUFFER = 34963 };

static const char *const shape_extensions[] = {"KHR_implicit_shapes", "OMI_physics_shape"};

/* object[key], an object that is created where there is none; NULL when out of memory. */
static json_t *member(json_t *object, const char *key) {
  json_t *value = json_object_get(object, key);
  if (json_is_object(value)) return value;
  return qmat_gltf_set(object, key, json_object()) ? json_object_get(object, key) : NULL;
}

static bool use_extension(json_t *root, const char *name) {
  const json_t *used = json_object_get(root, "extensionsUsed");
  for (size_t i = 0; i < json_array_size(used); i++)
    if (strcmp(json_string_value(json_array_get(used, i)), name) == 0) return true;
  return qmat_gltf_add(root, "extensionsUsed", json_string(name), NULL);
}

/* Whether OMI takes the shape as a convex mesh. */
static bool is_convex_for_omi(const qmat_colliders *c, const uint32_t *ids) {
  const int width = qmat_collider_width(ids);
  return width == 3 || (width == 2 && c->spheres[4 * (size_t)ids[0] + 3] != c->spheres[4 * (size_t)ids[1] + 3]);
}

/* ---- hulls ---- */

/* Adds the mesh of a hull, relative to the origin. */
static qmat_status add_hull(qmat_context *context, json_t *root, json_int_t buffer, size_t offset, qmat_writer *data,
                            qmat_gltf_colliders *added, size_t shape) {
  const qmat_colliders *c = added->colliders;
  const size_t first = shape > 0 ? c->hull_ends[2 * shape - 2] : 0, points = c->hull_ends[2 * shape] - first;
  const size_t row = shape > 0 ? c->hull_ends[2 * shape - 1] : 0, rows = c->hull_ends[2 * shape + 1] - row;
  float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  const size_t positions_at = offset + data->size;
  for (size_t i = 0; i < 3 * points; i++) {
    const float x = (float)(c->points[3 * first + i] - added->origin[i % 3]);
    if (!isfinite(x)) {
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "its hull does not fit into single precision");
      qmat_fail_element(context, "shape", (int64_t)shape);
      return qmat_fail_field(context, "colliders");
    }
    low[i % 3] = fminf(low[i % 3], x);
    high[i % 3] = fmaxf(high[i % 3], x);
    qmat_put_f32(data, x);
  }
  const size_t indices_at = offset + data->size;
  for (size_t i = 0; i < 3 * rows; i++) qmat_put_u16(data, (uint16_t)(c->triangles[3 * row + i] - first));
  qmat_gltf_pad(data, 0);
  json_int_t view, view_of_indices, accessor, indices;
  char name[32];
  snprintf(name, sizeof name, "_%02zu", shape + 1);
  bool done = qmat_gltf_add(root, "bufferViews",
                            json_pack("{s:I, s:I, s:I, s:i}", "buffer", buffer, "byteOffset", (json_int_t)positions_at,
                                      "byteLength", (json_int_t)(12 * points), "target", ARRAY_BUFFER),
                            &view);
  done = done && qmat_gltf_add(root, "bufferViews",
                               json_pack("{s:I, s:I, s:I, s:i}", "buffer", buffer, "byteOffset", (json_int_t)indices_at,
                                         "byteLength", (json_int_t)(6 * rows), "target", ELEMENT_ARRAY_BUFFER),
                               &view_of_indices);
  done = done && qmat_gltf_add(
                     root, "accessors",
                     json_pack("{s:I, s:i, s:I, s:s, s:[f, f, f], s:[f, f, f]}", "bufferView", view, "componentType",
                               5126, "count", (json_int_t)points, "type", "VEC3", "min", (double)low[0], (double)low[1],
                               (double)low[2], "max", (double)high[0], (double)high[1], (double)high[2]),
                     &accessor);
  done = done && qmat_gltf_add(root, "accessors",
                               json_pack("{s:I, s:i, s:I, s:s}", "bufferView", view_of_indices, "componentType", 5123,
                                         "count", (json_int_t)(3 * rows), "type", "SCALAR"),
                               &indices);
  done = done && qmat_gltf_add(root, "meshes",
                               json_pack("{s:s+++, s:[{s:{s:I}, s:I}], s:{s:b}}", "name",
                                         added->forms & QMAT_GLTF_UNREAL ? "UCX_" : "", added->name, name, "",
                                         "primitives", "attributes", "POSITION", accessor, "indices", indices, "extras",
                                         QMAT_GLTF_SKIN_MARK, 1),
                               &added->hulls[shape]);
  return done ? QMAT_OK : qmat_fail_memory(context, "a glTF file");
}

/* ---- shapes ---- */

/* Appends to root.extensions[extension].shapes. */
static bool add_shape(json_t *root, const char *extension, json_t *shape, json_int_t *number) {
  json_t *extensions = member(root, "extensions"), *owner = extensions ? member(extensions, extension) : NULL;
  if (owner) return qmat_gltf_add(owner, "shapes", shape, number);
  json_decref(shape);
  return false;
}

static bool add_shapes(json_t *root, qmat_gltf_colliders *added, size_t shape) {
  const qmat_colliders *c = added->colliders;
  const uint32_t *ids = &c->shapes[3 * shape];
  const double *a = &c->spheres[4 * (size_t)ids[0]], *b = &c->spheres[4 * (size_t)ids[1]];
  const int width = qmat_collider_width(ids);
  bool done = true;
  for (int form = 0; form < 2 && done; form++) {
    if (!(added->forms & (form == 0 ? QMAT_GLTF_KHR : QMAT_GLTF_OMI))) continue;
    json_t *made = NULL;
    if (form == 1 && is_convex_for_omi(c, ids)) {
      made = json_pack("{s:s, s:{s:I}}", "type", "convex", "convex", "mesh", added->hulls[shape]);
    } else if (width == 1) {
      made = json_pack("{s:s, s:{s:f}}", "type", "sphere", "sphere", "radius", a[3]);
    } else if (width == 2) {
      made = json_pack("{s:s, s:{s:f, s:f, s:f}}", "type", "capsule", "capsule", "height", qmat_point_distance(a, b),
                       "radiusBottom", a[3], "radiusTop", b[3]);
    } else { /* KHR: the hull of a node's mesh */
      done = qmat_gltf_add(
          root, "nodes", json_pack("{s:I, s:{s:b}}", "mesh", added->hulls[shape], "extras", QMAT_GLTF_COLLIDER_MARK, 1),
          &added->nodes[shape]);
      continue;
    }
    done = add_shape(root, shape_extensions[form], made, &added->shapes[2 * shape + (size_t)form]);
  }
  return done;
}

qmat_status qmat_gltf_colliders_init(qmat_context *context, json_t *root, json_int_t buffer, size_t offset,
                                     qmat_writer *data, qmat_gltf_colliders *added) {
  const qmat_colliders *c = added->colliders;
  const size_t count = c->shape_count;
  added->shapes = qmat_alloc(2 * count, sizeof *added->shapes);
  added->hulls = qmat_alloc(count, sizeof *added->hulls);
  added->nodes = qmat_alloc(count, sizeof *added->nodes);
  if (!added->shapes || !added->hulls || !added->nodes) return qmat_fail_memory(context, "a glTF file");
  bool done = true;
  for (size_t i = 0; i < count && done; i++) {
    const uint32_t *ids = &c->shapes[3 * i];
    added->shapes[2 * i] = added->shapes[2 * i + 1] = added->hulls[i] = added->nodes[i] = -1;
    const bool needs_hull = added->forms & (QMAT_GLTF_UNREAL | QMAT_GLTF_GODOT) ||
                            (added->forms & QMAT_GLTF_KHR && qmat_collider_width(ids) == 3) ||
                            (added->forms & QMAT_GLTF_OMI && is_convex_for_omi(c, ids));
    if (needs_hull) {
      const qmat_status status = add_hull(context, root, buffer, offset, data, added, i);
      if (status != QMAT_OK) return status;
    }
    done = add_shapes(root, added, i);
  }
  for (int form = 0; form < 2 && done; form++) {
    if (!(added->forms & (form == 0 ? QMAT_GLTF_KHR : QMAT_GLTF_OMI))) continue;
    const json_t *shapes = json_object_get(json_object_get(root, "extensions"), shape_extensions[form]);
    done = use_extension(root, qmat_gltf_body_extensions[form]) &&
           (!shapes || use_extension(root, shape_extensions[form]));
  }
  return done ? QMAT_OK : qmat_fail_memory(context, "a glTF file");
}

void qmat_gltf_colliders_uninit(qmat_gltf_colliders *added) {
  qmat_free(added->shapes);
  qmat_free(added->hulls);
  qmat_free(added->nodes);
}

/* ---- nodes ---- */

/* Adds a child of a body that moves by our motion, or does not. */
static bool add_child(json_t *root, json_t *body, json_t *child, bool moves) {
  json_int_t number;
  json_t *extras = json_pack("{s:b}", QMAT_GLTF_COLLIDER_MARK, 1);
  if (extras && moves && !qmat_gltf_set(extras, QMAT_GLTF_MOTION_MARK, json_true())) {
    json_decref(extras);
    return false;
  }
  return child && qmat_gltf_set(child, "extras", extras) && qmat_gltf_add(root, "nodes", json_incref(child), &number) &&
         qmat_gltf_add(body, "children", json_integer(number), NULL);
}

static bool place(json_t *node, const double at[3], const double *rotation) {
  bool done = at[0] == 0 && at[1] == 0 && at[2] == 0;
  done = done || qmat_gltf_set(node, "translation", json_pack("[f, f, f]", at[0], at[1], at[2]));
  if (!rotation || rotation[3] == 1) return done;
  return done &&
         qmat_gltf_set(node, "rotation", json_pack("[f, f, f, f]", rotation[0], rotation[1], rotation[2], rotation[3]));
}

static bool set_extension(json_t *node, const char *name, json_t *value) {
  json_t *extensions = member(node, "extensions");
  if (extensions) return qmat_gltf_set(extensions, name, value);
  json_decref(value);
  return false;
}

/* The collider of one form. Shapes of several forms share a node where they have the same frame. */
static bool add_colliders(json_t *root, json_t *body, const qmat_gltf_colliders *added, size_t shape,
                          const double shift[3], bool moves) {
  const qmat_colliders *c = added->colliders;
  const uint32_t *ids = &c->shapes[3 * shape];
  double middle[3], rotation[4], length, at_origin[3];
  qmat_capsule_frame(&c->spheres[4 * (size_t)ids[0]], &c->spheres[4 * (size_t)ids[1]], middle, &length, rotation);
  for (int k = 0; k < 3; k++) {
    middle[k] -= shift[k];
    at_origin[k] = added->origin[k] - shift[k];
  }
  json_t *own = NULL, *of_hull = NULL; /* in the shape's own frame, and in that of hulls */
  bool done = true;
  for (int form = 0; form < 2 && done; form++) {
    const json_int_t number = added->shapes[2 * shape + (size_t)form];
    json_t *collider = NULL;
    const bool takes_hull = form == 1 ? is_convex_for_omi(c, ids) : added->nodes[shape] >= 0;
    if (form == 0 && added->nodes[shape] >= 0)
      collider = json_pack("{s:{s:{s:I, s:b}}}", "collider", "geometry", "node", added->nodes[shape], "convexHull", 1);
    else if (number < 0)
      continue;
    else if (form == 0)
      collider = json_pack("{s:{s:{s:I}}}", "collider", "geometry", "shape", number);
    else
      collider = json_pack("{s:{s:I}}", "collider", "shape", number);
    json_t **node = takes_hull ? &of_hull : &own;
    if (!*node) {
      *node = json_object();
      done = *node && place(*node, takes_hull ? at_origin : middle, takes_hull ? NULL : rotation) &&
             add_child(root, body, *node, moves);
    }
    if (done) {
      done = set_extension(*node, qmat_gltf_body_extensions[form], collider);
    } else {
      json_decref(collider);
    }
  }
  json_decref(own);
  json_decref(of_hull);
  for (int form = 0; form < 2 && done; form++) {
    if (!(added->forms & (form == 0 ? QMAT_GLTF_UNREAL : QMAT_GLTF_GODOT))) continue;
    json_t *node = json_pack("{s:I}", "mesh", added->hulls[shape]);
    done = node && place(node, at_origin, NULL) &&
           qmat_gltf_set(node, "name",
                         form == 0 ? json_sprintf("UCX_%s_%02zu", added->name, shape + 1)
                                   : json_sprintf("%s_%02zu-convcolonly", added->name, shape + 1)) &&
           add_child(root, body, node, moves);
    json_decref(node);
  }
  return done;
}

static bool is_earlier_collider(const json_t *root, const json_t *child) {
  (void)root;
  return json_object_get(json_object_get(child, "extras"), QMAT_GLTF_COLLIDER_MARK) != NULL;
}

/* Removes the colliders of an earlier run and how it lets the body move. */
static void remove_earlier(json_t *root, json_t *body, size_t given) {
  qmat_gltf_drop_motion(root, body);
  qmat_gltf_drop_children(root, body, given, is_earlier_collider);
}

bool qmat_gltf_colliders_attach(json_t *root, json_int_t node, const qmat_gltf_colliders *added,
                                const double shift[3]) {
  json_t *body = json_array_get(json_object_get(root, "nodes"), (size_t)node);
  bool done = body != NULL;
  if (done) remove_earlier(root, body, added->nodes_given);
  const bool moves = done && added->dynamic && !qmat_gltf_has_own_motion(root, (size_t)node);
  const bool is_animated = moves && qmat_gltf_is_animated(root, (size_t)node);
  for (int form = 0; form < 2 && done && moves; form++) {
    if (!(added->forms & (form == 0 ? QMAT_GLTF_KHR : QMAT_GLTF_OMI))) continue;
    json_t *motion = qmat_gltf_motion_of(root, (size_t)node, added->colliders, shift, added->meters);
    done = motion != NULL;
    if (form == 1)
      done = done && qmat_gltf_set(motion, "type", json_string(is_animated ? "kinematic" : "dynamic"));
    else if (is_animated)
      done = done && qmat_gltf_set(motion, "isKinematic", json_true());
    json_t *extensions = done ? member(body, "extensions") : NULL;
    json_t *physics = extensions ? member(extensions, qmat_gltf_body_extensions[form]) : NULL;
    if (physics) {
      done = qmat_gltf_set(physics, "motion", motion); /* what else the asset says of the body stays */
    } else {
      json_decref(motion);
      done = false;
    }
  }
  for (size_t i = 0; i < added->colliders->shape_count && done; i++)
    done = add_colliders(root, body, added, i, shift, moves);
  return done;
}

/* ---- joints ---- */

/* The joint of a shape; where it has none, the one that has most of the weight at the spheres nearest to its own. */
static uint32_t joint_of(const qmat_gltf_colliders *added, size_t shape, const qmat_medial *medial) {
  const qmat_colliders *c = added->colliders;
  uint32_t joints[12], best = 0;
  double weights[12], most = -1;
  if (c->joint_count > 0) return c->joints[shape];
  for (size_t s = 0; s < 3; s++) {
    const double *sphere = &c->spheres[4 * (size_t)c->shapes[3 * shape + s]];
    double nearest = INFINITY;
    for (size_t i = 0; i < medial->sphere_count; i++) {
      const double away = qmat_point_distance(sphere, &medial->spheres[4 * i]);
      if (!(away < nearest)) continue;
      nearest = away;
      memcpy(&joints[4 * s], &medial->joints[4 * i], 4 * sizeof *joints);
      memcpy(&weights[4 * s], &medial->weights[4 * i], 4 * sizeof *weights);
    }
  }
  for (size_t i = 0; i < 12; i++) {
    double sum = 0;
    for (size_t k = 0; k < 12; k++) sum += joints[k] == joints[i] ? weights[k] : 0;
    if (sum > most + 1e-9) {
      most = sum;
      best = joints[i];
    }
  }
  return best;
}

/* A node below a joint in whose space the mesh is as it was bound. NULL when out of memory. */
static json_t *add_bound_node(json_t *root, json_t *joint, const qmat_gltf_colliders *added, const double *matrix) {
  json_t *node = json_object();
  bool done = node != NULL, moves = false;
  for (size_t i = 0; i < 16; i++) moves = moves || matrix[i] != (i % 5 == 0);
  json_t *numbers = moves ? json_array() : NULL;
  for (size_t i = 0; i < 16 && numbers; i++) done = json_array_append_new(numbers, json_real(matrix[i])) == 0 && done;
  if (moves) done = done && qmat_gltf_set(node, "matrix", numbers);
  for (int form = 0; form < 2 && done && added->dynamic; form++) {
    if (!(added->forms & (form == 0 ? QMAT_GLTF_KHR : QMAT_GLTF_OMI))) continue;
    done = set_extension(node, qmat_gltf_body_extensions[form],
                         form == 0 ? json_pack("{s:{s:b}}", "motion", "isKinematic", 1)
                                   : json_pack("{s:{s:s}}", "motion", "type", "kinematic"));
  }
  done = done && add_child(root, joint, node, false);
  json_decref(node); /* the root's array holds it */
  return done ? node : NULL;
}

bool qmat_gltf_colliders_attach_to_joints(json_t *root, json_int_t node, const qmat_gltf_colliders *added,
                                          const qmat_medial *medial, const double *matrices) {
  static const double none[3] = {0, 0, 0};
  json_t *nodes = json_object_get(root, "nodes"), *body = json_array_get(nodes, (size_t)node);
  const json_t *skin =
      json_array_get(json_object_get(root, "skins"), (size_t)json_number_value(json_object_get(body, "skin")));
  const json_t *ids = json_object_get(skin, "joints");
  const size_t count = json_array_size(ids);
  json_t **bound = qmat_calloc(count, sizeof(json_t *));
  bool done = bound && count > 0;
  if (done) remove_earlier(root, body, added->nodes_given);
  for (size_t i = 0; i < count && done; i++)
    remove_earlier(root, json_array_get(nodes, (size_t)json_number_value(json_array_get(ids, i))), added->nodes_given);
  for (size_t i = 0; i < added->colliders->shape_count && done; i++) {
    const uint32_t named = joint_of(added, i, medial), joint = named < count ? named : 0;
    json_t *owner = json_array_get(nodes, (size_t)json_number_value(json_array_get(ids, joint)));
    if (!bound[joint]) bound[joint] = add_bound_node(root, owner, added, &matrices[16 * (size_t)joint]);
    done = bound[joint] && add_colliders(root, bound[joint], added, i, none, false);
  }
  qmat_free(bound);
  return done;
}
