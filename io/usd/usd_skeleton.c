/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_skeleton.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "io/placement.h"
#include "io/usd/usd_motion.h"

enum { MOST_JOINTS = 65536 }; /* glTF numbers joints with 16 bits */

typedef qmat_usd_transform transform;

/* ---- names ---- */

static int compare_names(const void *a, const void *b) {
  return strcmp(((const qmat_usd_joint_name *)a)->text, ((const qmat_usd_joint_name *)b)->text);
}

/* Sorts the names. `*twice` becomes a name that is there twice, or NULL. */
static qmat_status sort_names(qmat_usd_rig *rig, const qmat_usd_prim *prim, const qmat_usd_value *joints,
                              qmat_usd_skeleton *skeleton, const char **twice) {
  *twice = NULL;
  skeleton->count = joints->count;
  skeleton->names = qmat_arena_alloc(&rig->arena, joints->count, sizeof *skeleton->names);
  if (!skeleton->names) return qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; i < joints->count; i++)
    skeleton->names[i] = (qmat_usd_joint_name){.text = joints->texts[i], .joint = (uint32_t)i};
  qsort(skeleton->names, skeleton->count, sizeof *skeleton->names, compare_names);
  for (size_t i = 1; i < skeleton->count; i++)
    if (strcmp(skeleton->names[i - 1].text, skeleton->names[i].text) == 0) *twice = skeleton->names[i].text;
  return QMAT_OK;
}

/* The joint of the longest path above a joint's; SIZE_MAX: none. */
static size_t parent_of(const qmat_usd_skeleton *skeleton, const char *name) {
  size_t length = strlen(name);
  for (int names = 0; names < QMAT_USD_DEEPEST; names++) {
    while (length > 0 && name[length - 1] != '/') length--;
    if (length <= 1) return SIZE_MAX;
    const size_t found = qmat_usd_skeleton_find(skeleton, name, --length);
    if (found != SIZE_MAX) return found;
  }
  return SIZE_MAX;
}

/* ---- transforms ---- */

/* Whether glTF can have the numbers: it has them in single precision. */
static bool is_single(const double *numbers, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (!(fabs(numbers[i]) <= FLT_MAX)) return false;
  return true;
}

/* One matrix for each joint; NULL without them, with a warning where there is something else. */
static qmat_status read_matrices(const qmat_usd_prim *prim, const char *name, size_t count, const double **matrices) {
  const qmat_usd_value *value;
  *matrices = NULL;
  const qmat_status status = qmat_usd_prim_attribute(prim, name, &value);
  if (status != QMAT_OK || !value) return status;
  if (!value->is_array || value->components != 16 || !qmat_usd_is_number(value->type))
    return qmat_usd_prim_fail(prim, "%s has a value of the wrong type", name);
  if (value->count != count || !is_single(value->numbers, 16 * count))
    return qmat_usd_warn(prim, "its %s are left out: they are not finite, or not one for each of %zu joints", name,
                         count);
  *matrices = value->numbers;
  return QMAT_OK;
}

static transform matrix_at(const double *matrices, size_t i) {
  transform result;
  memcpy(result.m, matrices + 16 * i, sizeof result.m);
  return result;
}

/* The inverse of an affine transform; false where there is none. */
static bool invert(const transform *t, transform *inverse) {
  if (!qmat_usd_inverse(t, inverse) || !is_single(inverse->m, 16)) return false;
  for (int i = 0; i < 4; i++) inverse->m[4 * i + 3] = i == 3; /* which it is up to rounding */
  return true;
}

/* Divides a row by its length, which it returns. */
static double normalise(double row[3]) {
  const double length = sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]);
  for (int k = 0; k < 3 && length > 0; k++) row[k] /= length;
  return length;
}

/* Splits a local transform into translation, rotation and scale: the rotation is that of the first row, and of the
 * plane of the first two. A transform that flattens them has no rotation. */
static void pose_of(const transform *t, double pose[QMAT_RIG_POSE]) {
  double r[3][3], along = 0;
  for (int i = 0; i < 9; i++) r[i / 3][i % 3] = t->m[4 * (i / 3) + i % 3];
  for (int i = 0; i < 3; i++) {
    pose[i] = t->m[12 + i];
    pose[7 + i] = normalise(r[i]);
  }
  if (qmat_usd_mirrors(t)) {
    pose[7] = -pose[7];
    for (int k = 0; k < 3; k++) r[0][k] = -r[0][k];
  }
  for (int k = 0; k < 3; k++) along += r[0][k] * r[1][k];
  for (int k = 0; k < 3; k++) r[1][k] -= along * r[0][k];
  const bool is_flat = !(fabs(pose[7]) > 0) || !(normalise(r[1]) > 0);
  for (int k = 0; k < 3; k++) r[2][k] = r[0][(k + 1) % 3] * r[1][(k + 2) % 3] - r[0][(k + 2) % 3] * r[1][(k + 1) % 3];
  qmat_placement_quaternion(r, pose + 3);
  if (is_flat) memcpy(pose + 3, (const double[]){0, 0, 0, 1}, 4 * sizeof *pose);
}

/* ---- reading ---- */

typedef struct request {
  qmat_usd_rig *rig;
  qmat_usd_stage *stage;
  qmat_usd_skeleton *skeleton;
} request;

static qmat_status leave_out(const qmat_usd_prim *prim, const char *why) {
  return qmat_usd_warn(prim, "the skeleton is left out: %s", why);
}

/* The prim's transform into the scene. */
static qmat_status read_world(const qmat_usd_prim *prim, transform *world) {
  if (!prim->parent) {
    *world = qmat_usd_identity();
    return QMAT_OK;
  }
  const qmat_status status = read_world(prim->parent, world);
  const char *type = qmat_usd_text(qmat_usd_prim_field(prim, "typeName"));
  return status == QMAT_OK ? qmat_usd_read_transform(prim, type ? type : "", world) : status;
}

/* Makes room for a skeleton and its joints at the end of the rig. */
static bool make_room(qmat_usd_rig *rig, size_t joints) {
  qmat_rig *made = &rig->rig;
  size_t same[4] = {rig->skeleton_capacity, rig->joint_capacity, rig->joint_capacity, rig->joint_capacity};
  const size_t count = made->joint_count + joints;
  return qmat_grow((void **)&made->skeleton_paths, &same[0], made->skeleton_count + 1, sizeof(char *)) == 0 &&
         qmat_grow((void **)&made->skeleton_placements, &rig->skeleton_capacity, made->skeleton_count + 1,
                   16 * sizeof(double)) == 0 &&
         qmat_grow((void **)&made->joint_skeletons, &same[1], count, sizeof(uint32_t)) == 0 &&
         qmat_grow((void **)&made->joint_parents, &same[2], count, sizeof(uint32_t)) == 0 &&
         qmat_grow((void **)&made->joint_names, &same[3], count, sizeof(char *)) == 0 &&
         qmat_grow((void **)&made->joint_poses, &rig->joint_capacity, count, QMAT_RIG_POSE * sizeof(double)) == 0;
}

/* Adds the skeleton with its joints, at rest, to the rig. */
static qmat_status add_skeleton(const request *r, const qmat_usd_prim *prim, const qmat_usd_value *joints,
                                const transform *world, const transform *locals, const size_t *parents) {
  qmat_rig *made = &r->rig->rig;
  qmat_usd_skeleton *skeleton = r->skeleton;
  qmat_status status = qmat_usd_rig_justify(r->rig, r->stage, prim, 16 + 16 * joints->count);
  if (status != QMAT_OK) return status;
  if (!make_room(r->rig, joints->count)) return qmat_usd_fail_prim_memory(prim);
  skeleton->first = made->joint_count;
  bool shears = false;
  for (size_t i = 0; i < joints->count; i++) {
    const char *slash = strrchr(joints->texts[i], '/'), *name = slash ? slash + 1 : joints->texts[i];
    const size_t at = made->joint_count;
    made->joint_names[at] = qmat_strdup(qmat_usd_shown(name));
    if (!made->joint_names[at]) return qmat_usd_fail_prim_memory(prim);
    made->joint_count++;
    made->joint_skeletons[at] = (uint32_t)made->skeleton_count;
    made->joint_parents[at] = parents[i] == SIZE_MAX ? UINT32_MAX : (uint32_t)(skeleton->first + parents[i]);
    pose_of(&locals[i], made->joint_poses + QMAT_RIG_POSE * at);
    shears = shears || !qmat_placement_is_plain(locals[i].m);
  }
  made->skeleton_paths[made->skeleton_count] = qmat_strdup(qmat_usd_shown(skeleton->path));
  if (!made->skeleton_paths[made->skeleton_count]) return qmat_usd_fail_prim_memory(prim);
  memcpy(made->skeleton_placements + 16 * made->skeleton_count, world->m, sizeof world->m);
  skeleton->number = (uint32_t)made->skeleton_count++;
  return shears ? qmat_usd_warn(prim, "a rest transform shears: it is read as a rotation and a scale") : QMAT_OK;
}

/* Finds bind transforms and local rest transforms, each from the other where it is missing. `*why` says what is wrong.
 */
static qmat_status read_transforms(const request *r, const qmat_usd_prim *prim, const size_t *parents,
                                   transform *locals, const char **why) {
  const size_t count = r->skeleton->count;
  const double *binds, *rests;
  qmat_status status = read_matrices(prim, "bindTransforms", count, &binds);
  if (status == QMAT_OK) status = read_matrices(prim, "restTransforms", count, &rests);
  if (status != QMAT_OK) return status;
  if (!binds && !rests) *why = "it has neither bindTransforms nor restTransforms";
  transform *bound = *why ? NULL : qmat_arena_alloc(&r->rig->arena, count, sizeof *bound);
  transform *inverses = *why ? NULL : qmat_arena_alloc(&r->rig->arena, count, sizeof *inverses);
  if (!*why && (!bound || !inverses)) return qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; i < count && !*why; i++) {
    const bool is_root = parents[i] == SIZE_MAX;
    if (rests) locals[i] = matrix_at(rests, i);
    if (binds)
      bound[i] = matrix_at(binds, i);
    else
      bound[i] = is_root ? locals[i] : qmat_usd_product(&locals[i], &bound[parents[i]]);
    if (!invert(&bound[i], &inverses[i])) *why = "a bind transform has no inverse";
    if (!rests && !*why) locals[i] = is_root ? bound[i] : qmat_usd_product(&bound[i], &inverses[parents[i]]);
    if (!*why && !is_single(locals[i].m, 16)) *why = "a transform is not finite";
  }
  r->skeleton->inverse_binds = inverses;
  if (*why || (binds && rests)) return QMAT_OK;
  return qmat_usd_warn(prim, binds ? "no restTransforms: the joints rest where they are bound"
                                   : "no bindTransforms: the joints are bound where they rest");
}

static qmat_status read_skeleton(void *user, qmat_usd_prim *prim) {
  const request *r = user;
  const char *type = qmat_usd_text(qmat_usd_prim_field(prim, "typeName")), *twice, *why = NULL;
  const qmat_usd_value *joints;
  transform world;
  if (!type || strcmp(type, "Skeleton") != 0) return leave_out(prim, "the prim is no Skeleton");
  qmat_status status = qmat_usd_prim_attribute(prim, "joints", &joints);
  if (status != QMAT_OK) return status;
  if (joints && (!joints->is_array || !qmat_usd_is_text(joints->type)))
    return qmat_usd_prim_fail(prim, "joints has a value of the wrong type");
  if (!joints || joints->count == 0) return leave_out(prim, "it has no joints");
  if (joints->count > MOST_JOINTS) return leave_out(prim, "it has more than 65536 joints");
  status = sort_names(r->rig, prim, joints, r->skeleton, &twice);
  if (status != QMAT_OK) return status;
  if (twice) return leave_out(prim, "two joints have the same path");
  size_t *parents = qmat_arena_alloc(&r->rig->arena, joints->count, sizeof *parents);
  transform *locals = qmat_arena_alloc(&r->rig->arena, joints->count, sizeof *locals);
  if (!parents || !locals) return qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; i < joints->count && !why; i++) {
    parents[i] = parent_of(r->skeleton, joints->texts[i]);
    if (parents[i] != SIZE_MAX && parents[i] > i) why = "a joint comes before its parent";
  }
  if (!why) status = read_transforms(r, prim, parents, locals, &why);
  if (status == QMAT_OK && !why) status = read_world(prim, &world);
  if (status == QMAT_OK && !why && !is_single(world.m, 16)) why = "its transform is not finite";
  if (status != QMAT_OK || why) return status == QMAT_OK ? leave_out(prim, why) : status;
  status = add_skeleton(r, prim, joints, &world, locals, parents);
  return status == QMAT_OK ? qmat_usd_motion_read(r->rig, r->stage, prim, r->skeleton) : status;
}

qmat_status qmat_usd_skeleton_read(qmat_usd_rig *rig, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                   const char *path, size_t *known) {
  for (size_t i = rig->known_count; i-- > 0;) {
    *known = i;
    if (strcmp(rig->known[i].path, path) == 0) return QMAT_OK;
  }
  if (qmat_grow((void **)&rig->known, &rig->known_capacity, rig->known_count + 1, sizeof *rig->known) != 0)
    return qmat_usd_fail_prim_memory(prim);
  char *kept = qmat_arena_alloc(&rig->arena, strlen(path) + 1, 1);
  if (!kept) return qmat_usd_fail_prim_memory(prim);
  memcpy(kept, path, strlen(path) + 1);
  *known = rig->known_count++;
  rig->known[*known] = (qmat_usd_skeleton){.path = kept, .number = UINT32_MAX};
  request r = {.rig = rig, .stage = stage, .skeleton = &rig->known[*known]};
  bool found;
  const qmat_status status = qmat_usd_stage_visit(stage, path, read_skeleton, &r, &found);
  if (status != QMAT_OK || found) return status;
  return qmat_usd_warn(prim, "not bound to its skeleton: there is no prim <%s>", qmat_usd_shown(path));
}
