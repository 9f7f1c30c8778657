/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_motion.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "io/collider_frames.h"
#include "io/gltf/gltf_asset.h"
#include "io/placement.h"

const char *const qmat_gltf_body_extensions[2] = {"KHR_physics_rigid_bodies", "OMI_physics_body"};

/* The linear part of a transform, and the rotation in it. Row by row. */
typedef struct {
  double linear[3][3], rotation[3][3];
} turn;

static double number_at(const json_t *numbers, size_t i) {
  return json_number_value(json_array_get(numbers, i));
}

static turn turn_of_matrix(const json_t *m) {
  turn t;
  for (size_t c = 0; c < 3; c++)
    for (size_t r = 0; r < 3; r++) t.linear[r][c] = number_at(m, 4 * c + r);
  qmat_rotation_in(t.linear, t.rotation);
  return t;
}

static turn turn_of_node(const json_t *node) {
  const json_t *m = json_object_get(node, "matrix"), *scale = json_object_get(node, "scale"),
               *q = json_object_get(node, "rotation");
  if (m) return turn_of_matrix(m);
  const double quaternion[4] = {number_at(q, 0), number_at(q, 1), number_at(q, 2), number_at(q, 3)};
  double axes[3][3];
  turn t;
  qmat_placement_turn(quaternion, axes);
  for (size_t r = 0; r < 3; r++)
    for (size_t c = 0; c < 3; c++) t.rotation[r][c] = axes[c][r];
  for (size_t r = 0; r < 3; r++)
    for (size_t c = 0; c < 3; c++) t.linear[r][c] = t.rotation[r][c] * (scale ? number_at(scale, c) : 1);
  return t;
}

/* From the node's space to the world. Checked nodes form trees. */
static turn turn_in_world(const json_t *root, size_t node) {
  const json_t *nodes = json_object_get(root, "nodes");
  turn world = {.linear = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (size_t at = node; at != SIZE_MAX; at = qmat_gltf_parent_of(root, at)) {
    turn t = turn_of_node(json_array_get(nodes, at));
    qmat_multiply(t.linear, world.linear, world.linear);
    qmat_multiply(t.rotation, world.rotation, world.rotation);
  }
  return world;
}

json_t *qmat_gltf_motion_of(const json_t *root, size_t node, const qmat_colliders *colliders, const double shift[3],
                            double meters) {
  json_t *motion = json_object();
  if (!motion || colliders->body_count == 0) return motion;
  double body[10], moments[3], q[4];
  turn world = turn_in_world(root, node);
  qmat_placed_body(colliders->body, world.linear, world.rotation, meters, body);
  if (!(body[0] > 0)) return motion; /* a node of no size, as one that is hidden by its scale */
  qmat_principal_inertia(body, moments, q);
  const bool done =
      qmat_gltf_set(motion, "mass", json_real(body[0])) &&
      qmat_gltf_set(motion, "centerOfMass",
                    json_pack("[f, f, f]", body[1] - shift[0], body[2] - shift[1], body[3] - shift[2])) &&
      qmat_gltf_set(motion, "inertiaDiagonal", json_pack("[f, f, f]", moments[0], moments[1], moments[2])) &&
      qmat_gltf_set(motion, "inertiaOrientation", json_pack("[f, f, f, f]", q[0], q[1], q[2], q[3]));
  if (done) return motion;
  json_decref(motion);
  return NULL;
}

bool qmat_gltf_is_animated(const json_t *root, size_t node) {
  const json_t *animations = json_object_get(root, "animations");
  for (size_t a = 0; a < json_array_size(animations); a++) {
    const json_t *channels = json_object_get(json_array_get(animations, a), "channels");
    for (size_t c = 0; c < json_array_size(channels); c++) {
      const json_t *target = json_object_get(json_array_get(channels, c), "target"),
                   *number = json_object_get(target, "node");
      const char *path = json_string_value(json_object_get(target, "path"));
      if (!number || !path || strcmp(path, "weights") == 0) continue;
      for (size_t at = node; at != SIZE_MAX; at = qmat_gltf_parent_of(root, at))
        if ((double)at == json_number_value(number)) return true;
    }
  }
  return false;
}

static bool is_ours(const json_t *root, const json_t *node) {
  const json_t *nodes = json_object_get(root, "nodes"), *children = json_object_get(node, "children");
  for (size_t i = 0; i < json_array_size(children); i++) {
    const json_t *child = json_array_get(nodes, (size_t)json_number_value(json_array_get(children, i)));
    if (json_object_get(json_object_get(child, "extras"), QMAT_GLTF_MOTION_MARK)) return true;
  }
  return false;
}

bool qmat_gltf_has_own_motion(const json_t *root, size_t node) {
  const json_t *nodes = json_object_get(root, "nodes");
  for (size_t at = node; at != SIZE_MAX; at = qmat_gltf_parent_of(root, at)) {
    const json_t *body = json_array_get(nodes, at), *extensions = json_object_get(body, "extensions");
    for (int form = 0; form < 2; form++) {
      const json_t *physics = json_object_get(extensions, qmat_gltf_body_extensions[form]);
      if (json_object_get(physics, "motion") && !is_ours(root, body)) return true;
      if (at == node && (json_object_get(physics, "collider") || json_object_get(physics, "trigger"))) return true;
    }
  }
  return false;
}

void qmat_gltf_drop_motion(const json_t *root, json_t *node) {
  json_t *extensions = json_object_get(node, "extensions");
  if (!is_ours(root, node)) return;
  for (int form = 0; form < 2; form++) {
    json_t *physics = json_object_get(extensions, qmat_gltf_body_extensions[form]);
    json_object_del(physics, "motion");
    if (physics && json_object_size(physics) == 0) json_object_del(extensions, qmat_gltf_body_extensions[form]);
  }
  if (extensions && json_object_size(extensions) == 0) json_object_del(node, "extensions");
}
