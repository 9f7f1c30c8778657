/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_rig.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "io/usd/usd_skeleton.h"

/* A start before this, in seconds, is no time. */
#define FARTHEST_START 1e30

typedef qmat_usd_transform transform;

/* The names by which the mesh numbers its joints; NULL: as its skeleton does. */
static qmat_status read_names(const qmat_usd_prim *prim, const qmat_usd_value **names) {
  *names = NULL;
  const qmat_usd_prim *owner = qmat_usd_prim_above(prim, QMAT_USD_ATTRIBUTE, "skel:joints");
  if (!owner) return QMAT_OK;
  const qmat_status status = qmat_usd_prim_attribute(owner, "skel:joints", names);
  if (status == QMAT_OK && *names && (!(*names)->is_array || !qmat_usd_is_text((*names)->type)))
    return qmat_usd_prim_fail(owner, "skel:joints has a value of the wrong type");
  return status;
}

static qmat_status read_geometry_bind(const qmat_usd_prim *prim, transform *bind) {
  static const char name[] = "primvars:skel:geomBindTransform";
  const qmat_usd_value *value = NULL;
  *bind = qmat_usd_identity();
  const qmat_usd_prim *owner = qmat_usd_prim_above(prim, QMAT_USD_ATTRIBUTE, name);
  const qmat_status status = owner ? qmat_usd_prim_attribute(owner, name, &value) : QMAT_OK;
  if (status != QMAT_OK || !value) return status;
  if (value->is_array || value->components != 16 || !qmat_usd_is_number(value->type))
    return qmat_usd_prim_fail(owner, "%s has a value of the wrong type", name);
  memcpy(bind->m, value->numbers, sizeof bind->m);
  for (int i = 0; i < 4; i++) bind->m[4 * i + 3] = i == 3; /* glTF has no other ones */
  return QMAT_OK;
}

/* The first joint number that counts and that is none of `count`; -1: there is none. */
static int64_t unknown_joint(const qmat_usd_mesh *mesh, size_t count, bool *found) {
  *found = false;
  for (size_t i = 0; i < mesh->joints->count; i++) {
    const int64_t joint = mesh->joints->integers[i];
    if (!(mesh->weights->numbers[i] > 0) || (joint >= 0 && (uint64_t)joint < count)) continue;
    *found = true;
    return joint;
  }
  return -1;
}

/* Lists the joints of a skin at the end of the rig, and their matrices. */
static qmat_status add_bound(qmat_usd_rig *rig, const qmat_usd_prim *prim, const qmat_usd_skeleton *skeleton,
                             const qmat_usd_value *names, size_t count, const transform *bind) {
  qmat_rig *made = &rig->rig;
  size_t unknown = 0, first_unknown = 0, capacity = rig->bound_capacity;
  if (qmat_grow((void **)&made->bound_joints, &capacity, made->bound_count + count, sizeof *made->bound_joints) != 0 ||
      qmat_grow((void **)&made->bound_matrices, &rig->bound_capacity, made->bound_count + count,
                16 * sizeof *made->bound_matrices) != 0)
    return qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; i < count; i++) {
    const size_t at = made->bound_count + i;
    const size_t joint = names ? qmat_usd_skeleton_find(skeleton, names->texts[i], strlen(names->texts[i])) : i;
    transform matrix = *bind;
    if (joint == SIZE_MAX) {
      if (unknown++ == 0) first_unknown = i;
    } else {
      matrix = qmat_usd_product(bind, &skeleton->inverse_binds[joint]);
    }
    made->bound_joints[at] = joint == SIZE_MAX ? UINT32_MAX : (uint32_t)(skeleton->first + joint);
    memcpy(made->bound_matrices + 16 * at, matrix.m, sizeof matrix.m);
  }
  if (unknown == 0) return QMAT_OK;
  return qmat_usd_warn(prim, "its joint '%s'%s is none of its skeleton's, and stays where it is bound",
                       qmat_usd_shown(names->texts[first_unknown]), unknown > 1 ? " (and others)" : "");
}

static qmat_status digest_of(const qmat_rig *rig, uint32_t skeleton, size_t count, qmat_digest *digest) {
  qmat_hasher hasher;
  const qmat_status status = qmat_hasher_init(&hasher);
  qmat_hasher_add(&hasher, &skeleton, sizeof skeleton);
  qmat_hasher_add(&hasher, rig->bound_joints + rig->bound_count, count * sizeof *rig->bound_joints);
  qmat_hasher_add(&hasher, rig->bound_matrices + 16 * rig->bound_count, 16 * count * sizeof *rig->bound_matrices);
  const qmat_status finished = qmat_hasher_finish(&hasher, digest);
  return status == QMAT_OK ? finished : status;
}

/* The skin of the joints at the end of the rig: one that is there already, or a new one. */
static qmat_status find_skin(qmat_usd_rig *rig, const qmat_usd_prim *prim, uint32_t skeleton, size_t count,
                             uint32_t *skin) {
  qmat_rig *made = &rig->rig;
  const size_t at = made->skin_count;
  qmat_digest digest;
  size_t capacity = rig->skin_capacity;
  if (digest_of(made, skeleton, count, &digest) != QMAT_OK) return qmat_usd_fail_prim_memory(prim);
  for (size_t i = at; i-- > 0;) {
    if (!qmat_digest_equal(&rig->digests[i], &digest)) continue;
    *skin = (uint32_t)i;
    return QMAT_OK;
  }
  if (qmat_grow((void **)&rig->digests, &rig->digest_capacity, at + 1, sizeof *rig->digests) != 0 ||
      qmat_grow((void **)&made->skin_skeletons, &capacity, at + 1, sizeof *made->skin_skeletons) != 0 ||
      qmat_grow((void **)&made->skin_ends, &rig->skin_capacity, at + 1, sizeof *made->skin_ends) != 0)
    return qmat_usd_fail_prim_memory(prim);
  rig->digests[at] = digest;
  made->bound_count += count;
  made->skin_skeletons[at] = skeleton;
  made->skin_ends[at] = (uint32_t)made->bound_count;
  made->skin_count++;
  *skin = (uint32_t)at;
  return QMAT_OK;
}

static qmat_status bind_to(qmat_usd_rig *rig, const qmat_usd_stage *stage, const qmat_usd_prim *prim,
                           const qmat_usd_mesh *mesh, const qmat_usd_skeleton *skeleton, uint32_t *skin) {
  const qmat_usd_value *names;
  transform bind;
  bool has_unknown;
  qmat_status status = read_names(prim, &names);
  if (status == QMAT_OK) status = read_geometry_bind(prim, &bind);
  if (status != QMAT_OK) return status;
  const size_t count = names ? names->count : skeleton->count;
  const int64_t unknown = unknown_joint(mesh, count, &has_unknown);
  if (has_unknown)
    return qmat_usd_warn(prim, "not bound to its skeleton: it names joint %lld of %zu", (long long)unknown, count);
  status = qmat_usd_rig_justify(rig, stage, prim, 17 * count);
  if (status == QMAT_OK) status = add_bound(rig, prim, skeleton, names, count, &bind);
  if (status != QMAT_OK) return status;
  const double *matrices = rig->rig.bound_matrices + 16 * rig->rig.bound_count;
  for (size_t i = 0; i < 16 * count; i++)
    if (!(fabs(matrices[i]) <= FLT_MAX)) /* glTF has single precision */
      return qmat_usd_warn(prim, "not bound to its skeleton: its bind transform is not finite");
  return find_skin(rig, prim, skeleton->number, count, skin);
}

qmat_status qmat_usd_rig_bind(qmat_usd_rig *rig, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                              const qmat_usd_mesh *mesh, uint32_t *skin) {
  static const char name[] = "skel:skeleton";
  const qmat_usd_prim *owner = qmat_usd_prim_above(prim, QMAT_USD_RELATIONSHIP, name);
  *skin = UINT32_MAX;
  if (!owner || !mesh->joints) return QMAT_OK;
  const char *const *targets;
  size_t count, known = 0;
  qmat_arena arena = {0};
  qmat_status status = qmat_usd_prim_targets(owner, name, &arena, &targets, &count);
  if (status == QMAT_OK && count > 0) status = qmat_usd_skeleton_read(rig, stage, prim, targets[0], &known);
  if (status == QMAT_OK && count > 0 && rig->known[known].number != UINT32_MAX)
    status = bind_to(rig, stage, prim, mesh, &rig->known[known], skin);
  qmat_arena_uninit(&arena);
  return status;
}

void qmat_usd_rig_finish(qmat_usd_rig *rig, const qmat_usd_stage *stage) {
  qmat_rig *made = &rig->rig;
  const qmat_usd_layer *root = qmat_usd_stage_root_layer(stage);
  double start =
      qmat_usd_number(qmat_usd_field_value(root->root, "startTimeCode"), INFINITY) / qmat_usd_codes_per_second(root);
  if (!(start > -FARTHEST_START)) start = INFINITY;
  for (size_t i = 0; i < made->key_count; i++) start = fmin(start, made->key_times[i]);
  for (size_t i = 0, key = 0; i < made->curve_count; i++) {
    const size_t first = key, end = key + made->curves[3 * i + 1];
    for (; key < end; key++) {
      double *time = &made->key_times[key];
      *time -= start;
      if (key > first) *time = fmax(*time, nextafter(time[-1], INFINITY)); /* rounding may join two */
    }
  }
}

void qmat_usd_rig_uninit(qmat_usd_rig *rig) {
  qmat_rig *made = &rig->rig;
  for (size_t i = 0; i < made->skeleton_count; i++) qmat_free(made->skeleton_paths[i]);
  for (size_t i = 0; i < made->joint_count; i++) qmat_free(made->joint_names[i]);
  void *const arrays[] = {made->skeleton_paths, made->skeleton_placements, made->joint_skeletons, made->joint_parents,
                          made->joint_names,    made->joint_poses,         made->skin_skeletons,  made->skin_ends,
                          made->bound_joints,   made->bound_matrices,      made->placed_skins,    made->curves,
                          made->key_times,      made->moved_joints,        made->values,          rig->known,
                          rig->digests};
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) qmat_free(arrays[i]);
  qmat_arena_uninit(&rig->arena);
  *rig = (qmat_usd_rig){0};
}
