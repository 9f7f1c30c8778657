/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_rig.h"

#include <math.h>
#include <string.h>

#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_place.h"

/* json_pack fails on a NULL argument and frees the others, so one check at the end suffices. */

static qmat_status fail_shortage(qmat_context *context) {
  return qmat_fail_memory(context, "the skeletons of a glTF file");
}

/* ---- data ---- */

/* Adds a view of everything from byte `start` of the data on. */
static bool add_view(json_t *root, json_int_t buffer, size_t offset, size_t start, const qmat_writer *data,
                     json_int_t *view) {
  json_t *made = json_pack("{s:I, s:I, s:I}", "buffer", buffer, "byteOffset", (json_int_t)(offset + start),
                           "byteLength", (json_int_t)(data->size - start));
  return !data->failed && qmat_gltf_add(root, "bufferViews", made, view);
}

/* Adds an accessor of single-precision numbers. With `ends` it states its first and last, as times need. */
static bool add_accessor(json_t *root, json_int_t view, size_t start, size_t count, const char *type,
                         const double *ends, json_int_t *accessor) {
  json_t *made = json_pack("{s:I, s:I, s:i, s:I, s:s}", "bufferView", view, "byteOffset", (json_int_t)start,
                           "componentType", QMAT_GLTF_FLOAT, "count", (json_int_t)count, "type", type);
  bool done = made != NULL;
  if (ends) {
    done = done && qmat_gltf_set(made, "min", json_pack("[f]", ends[0]));
    done = done && qmat_gltf_set(made, "max", json_pack("[f]", ends[1]));
  }
  return qmat_gltf_add(root, "accessors", made, accessor) && done;
}

/* ---- nodes ---- */

/* Marks the skeletons of placed skins. */
static void mark_needed(const qmat_rig *rig, json_int_t *tops) {
  for (size_t i = 0; i < rig->skeleton_count; i++) tops[i] = -1;
  for (size_t i = 0; i < rig->placed_count; i++)
    if (rig->placed_skins[i] != UINT32_MAX) tops[rig->skin_skeletons[rig->placed_skins[i]]] = 0;
}

static bool add_skeleton(json_t *root, qmat_gltf_rig *added, size_t skeleton) {
  const char *path = added->rig->skeleton_paths[skeleton], *slash = strrchr(path, '/');
  return qmat_gltf_place(root, json_pack("{s:s}", "name", slash ? slash + 1 : path),
                         added->rig->skeleton_placements + 16 * skeleton, &added->skeletons[skeleton],
                         &added->tops[skeleton]);
}

/* Adds a joint at rest, below its parent. A rotation that is none is left out. */
static bool add_joint(json_t *root, qmat_gltf_rig *added, size_t joint) {
  const qmat_rig *rig = added->rig;
  const double *p = rig->joint_poses + QMAT_RIG_POSE * joint;
  const uint32_t parent = rig->joint_parents[joint];
  json_t *node = rig->joint_names[joint][0] ? json_pack("{s:s}", "name", rig->joint_names[joint]) : json_object();
  bool done = node != NULL;
  if (p[0] != 0 || p[1] != 0 || p[2] != 0)
    done = done && qmat_gltf_set(node, "translation", json_pack("[f, f, f]", p[0], p[1], p[2]));
  if (p[3] != 0 || p[4] != 0 || p[5] != 0)
    done = done && qmat_gltf_set(node, "rotation", json_pack("[f, f, f, f]", p[3], p[4], p[5], p[6]));
  if (p[7] != 1 || p[8] != 1 || p[9] != 1)
    done = done && qmat_gltf_set(node, "scale", json_pack("[f, f, f]", p[7], p[8], p[9]));
  if (!qmat_gltf_add(root, "nodes", node, &added->joints[joint]) || !done) return false;
  const json_int_t above = parent == UINT32_MAX ? added->skeletons[rig->joint_skeletons[joint]] : added->joints[parent];
  json_t *to = json_array_get(json_object_get(root, "nodes"), (size_t)above);
  return qmat_gltf_add(to, "children", json_integer(added->joints[joint]), NULL);
}

/* ---- motion ---- */

/* A curve of the rig. */
typedef struct curve {
  uint32_t part;
  size_t key_count, joint_count, components;
  const double *times;
  const uint32_t *joints;
  const double *values;
} curve;

/* Whether the key is later than the last one in single precision. */
static bool is_later(float time, float last) {
  return isfinite(time) && time > last;
}

static size_t put_times(const curve *c, qmat_writer *data, double ends[2]) {
  size_t count = 0;
  float last = -1;
  for (size_t k = 0; k < c->key_count; k++) {
    if (!is_later((float)c->times[k], last)) continue;
    last = (float)c->times[k];
    if (count++ == 0) ends[0] = last;
    ends[1] = last;
    qmat_put_f32(data, last);
  }
  return count;
}

static void put_values(const curve *c, size_t joint, qmat_writer *data) {
  float last = -1;
  for (size_t k = 0; k < c->key_count; k++) {
    if (!is_later((float)c->times[k], last)) continue;
    last = (float)c->times[k];
    const double *from = c->values + (k * c->joint_count + joint) * c->components;
    for (size_t i = 0; i < c->components; i++) qmat_put_f32(data, (float)from[i]);
  }
}

/* Adds a channel and a sampler for each joint that the asset has. */
static bool add_curve(json_t *root, const qmat_gltf_rig *added, const curve *c, json_int_t buffer, size_t offset,
                      qmat_writer *data, json_t *animation) {
  static const char *const paths[QMAT_RIG_PART_COUNT] = {"translation", "rotation", "scale"};
  const size_t start = data->size;
  const char *type = c->components == 4 ? "VEC4" : "VEC3";
  double ends[2] = {0, 0};
  size_t needed = 0;
  json_int_t view, times;
  for (size_t i = 0; i < c->joint_count; i++) needed += added->joints[c->joints[i]] >= 0;
  if (needed == 0) return true;
  const size_t keys = put_times(c, data, ends), size = 4 * keys * c->components;
  for (size_t i = 0; i < c->joint_count; i++)
    if (added->joints[c->joints[i]] >= 0) put_values(c, i, data);
  if (!add_view(root, buffer, offset, start, data, &view) || !add_accessor(root, view, 0, keys, "SCALAR", ends, &times))
    return false;
  bool done = true;
  for (size_t i = 0, n = 0; i < c->joint_count && done; i++) {
    json_int_t values, sampler;
    const json_int_t node = added->joints[c->joints[i]];
    if (node < 0) continue;
    done =
        add_accessor(root, view, 4 * keys + size * n++, keys, type, NULL, &values) &&
        qmat_gltf_add(animation, "samplers", json_pack("{s:I, s:I}", "input", times, "output", values), &sampler) &&
        qmat_gltf_add(
            animation, "channels",
            json_pack("{s:I, s:{s:I, s:s}}", "sampler", sampler, "target", "node", node, "path", paths[c->part]), NULL);
  }
  return done;
}

/* All curves are one animation: the times of a scene are those of all its skeletons. */
static bool add_motion(json_t *root, const qmat_gltf_rig *added, json_int_t buffer, size_t offset, qmat_writer *data) {
  const qmat_rig *rig = added->rig;
  json_t *animation = json_pack("{s:s}", "name", "motion");
  curve c = {.times = rig->key_times, .joints = rig->moved_joints, .values = rig->values};
  bool done = animation != NULL;
  for (size_t i = 0; i < rig->curve_count && done; i++) {
    c.part = rig->curves[3 * i];
    c.key_count = rig->curves[3 * i + 1];
    c.joint_count = rig->curves[3 * i + 2];
    c.components = c.part == QMAT_RIG_ROTATION ? 4 : 3;
    done = add_curve(root, added, &c, buffer, offset, data, animation);
    c.times += c.key_count;
    c.joints += c.joint_count;
    c.values += c.key_count * c.joint_count * c.components;
  }
  if (done && json_object_get(animation, "channels")) return qmat_gltf_add(root, "animations", animation, NULL);
  json_decref(animation);
  return done;
}

qmat_status qmat_gltf_rig_init(qmat_context *context, json_t *root, const qmat_rig *rig, json_int_t buffer,
                               size_t offset, qmat_writer *data, qmat_gltf_rig *added) {
  added->rig = rig;
  added->tops = qmat_alloc(rig->skeleton_count, sizeof *added->tops);
  added->skeletons = qmat_alloc(rig->skeleton_count, sizeof *added->skeletons);
  added->joints = qmat_alloc(rig->joint_count, sizeof *added->joints);
  added->numbers = qmat_alloc(rig->skin_count, sizeof *added->numbers);
  if (!added->tops || !added->skeletons || !added->joints || !added->numbers) return fail_shortage(context);
  mark_needed(rig, added->tops);
  bool done = true;
  for (size_t i = 0; i < rig->skin_count; i++) added->numbers[i] = -1;
  for (size_t i = 0; i < rig->skeleton_count && done; i++)
    if (added->tops[i] >= 0) done = add_skeleton(root, added, i);
  for (size_t i = 0; i < rig->joint_count && done; i++) {
    added->joints[i] = -1;
    if (added->tops[rig->joint_skeletons[i]] >= 0) done = add_joint(root, added, i);
  }
  done = done && add_motion(root, added, buffer, offset, data);
  return done ? QMAT_OK : fail_shortage(context);
}

void qmat_gltf_rig_uninit(qmat_gltf_rig *added) {
  qmat_free(added->tops);
  qmat_free(added->skeletons);
  qmat_free(added->joints);
  qmat_free(added->numbers);
  qmat_free(added->skins);
  *added = (qmat_gltf_rig){0};
}

/* ---- skins ---- */

static size_t first_of(const qmat_rig *rig, uint32_t skin) {
  return skin > 0 ? rig->skin_ends[skin - 1] : 0;
}

static qmat_status put_matrix(qmat_context *context, const double *matrix, qmat_writer *data) {
  for (int i = 0; i < 16; i++) {
    if (!isfinite((float)matrix[i]))
      return qmat_fail(context, QMAT_ERROR_GEOMETRY, "a bind transform does not fit into single precision");
    qmat_put_f32(data, (float)matrix[i]);
  }
  return QMAT_OK;
}

/* Adds a child that moves with a node, for a skin that lists the node twice: the joints of a glTF skin are different
 * nodes. */
static bool add_stand_in(json_t *root, json_int_t *node) {
  json_t *parent = json_array_get(json_object_get(root, "nodes"), (size_t)*node);
  return qmat_gltf_add(root, "nodes", json_object(), node) &&
         qmat_gltf_add(parent, "children", json_integer(*node), NULL);
}

qmat_status qmat_gltf_rig_skin(qmat_context *context, json_t *root, qmat_gltf_rig *added, uint32_t skin,
                               json_int_t buffer, size_t offset, qmat_writer *data, json_int_t *number) {
  const qmat_rig *rig = added->rig;
  *number = added->numbers[skin];
  if (*number >= 0) return QMAT_OK;
  const size_t first = first_of(rig, skin), end = rig->skin_ends[skin], start = data->size;
  json_int_t view, accessor;
  json_t *joints = json_array();
  qmat_status status = joints ? QMAT_OK : fail_shortage(context);
  for (size_t i = first; i < end && status == QMAT_OK; i++) {
    const uint32_t joint = rig->bound_joints[i];
    json_int_t node = joint == UINT32_MAX ? added->skeletons[rig->skin_skeletons[skin]] : added->joints[joint];
    bool is_repeated = false;
    for (size_t k = first; k < i && !is_repeated; k++) is_repeated = rig->bound_joints[k] == joint;
    if (is_repeated && !add_stand_in(root, &node)) status = fail_shortage(context);
    if (status == QMAT_OK) status = put_matrix(context, rig->bound_matrices + 16 * i, data);
    if (status == QMAT_OK && json_array_append_new(joints, json_integer(node)) != 0) status = fail_shortage(context);
  }
  if (status == QMAT_OK &&
      (qmat_grow((void **)&added->skins, &added->skin_capacity, added->skin_count + 1, sizeof *added->skins) != 0 ||
       !add_view(root, buffer, offset, start, data, &view) ||
       !add_accessor(root, view, 0, end - first, "MAT4", NULL, &accessor) ||
       !qmat_gltf_add(root, "skins", json_pack("{s:I, s:O}", "inverseBindMatrices", accessor, "joints", joints),
                      number)))
    status = fail_shortage(context);
  json_decref(joints);
  if (status != QMAT_OK) return status;
  added->skins[added->skin_count++] = skin;
  added->numbers[skin] = *number;
  return QMAT_OK;
}

const double *qmat_gltf_rig_matrices(const qmat_gltf_rig *added, size_t number) {
  if (number >= added->skin_count) return NULL;
  return added->rig->bound_matrices + 16 * first_of(added->rig, added->skins[number]);
}
