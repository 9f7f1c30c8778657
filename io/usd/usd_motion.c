/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_motion.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Seconds beyond this are no times. */
#define FARTHEST_TIME 1e30

typedef struct request {
  qmat_usd_rig *rig;
  qmat_usd_stage *stage;
  const qmat_usd_skeleton *skeleton;
  size_t count;     /* joints of the animation */
  uint32_t *joints; /* count: the skeleton's joint; UINT32_MAX: none */
  size_t moved;     /* joints that the skeleton has */
} request;

/* Where a part is in a pose. */
static const struct {
  const char *name;
  uint8_t components, place;
} parts[QMAT_RIG_PART_COUNT] = {
    [QMAT_RIG_TRANSLATION] = {"translations", 3, 0},
    [QMAT_RIG_ROTATION] = {"rotations", 4, 3},
    [QMAT_RIG_SCALE] = {"scales", 3, 7},
};

/* Whether the value has this part of each joint, in numbers of single precision. */
static bool is_good(const request *r, qmat_rig_part part, const qmat_usd_value *value) {
  if (!value->is_array || value->components != parts[part].components || !qmat_usd_is_number(value->type) ||
      value->count != r->count)
    return false;
  for (size_t i = 0; i < value->count * value->components; i++)
    if (!(fabs(value->numbers[i]) <= FLT_MAX)) return false;
  return true;
}

/* Copies one joint's part as a rig has it: quaternions have length 1 and end with their real part. */
static void copy_part(qmat_rig_part part, const double *from, double *to) {
  if (part != QMAT_RIG_ROTATION) {
    memcpy(to, from, 3 * sizeof *to);
    return;
  }
  const double largest = fmax(fmax(fabs(from[0]), fabs(from[1])), fmax(fabs(from[2]), fabs(from[3])));
  double length = 0;
  for (int k = 0; k < 4; k++) {
    to[k] = largest > 0 ? from[(k + 1) % 4] / largest : k == 3;
    length += to[k] * to[k];
  }
  for (int k = 0; k < 4; k++) to[k] /= sqrt(length);
}

static void set_poses(const request *r, qmat_rig_part part, const qmat_usd_value *value) {
  for (size_t i = 0; i < r->count; i++) {
    if (r->joints[i] == UINT32_MAX) continue;
    double *pose = r->rig->rig.joint_poses + QMAT_RIG_POSE * (r->skeleton->first + r->joints[i]);
    copy_part(part, value->numbers + i * value->components, pose + parts[part].place);
  }
}

/* ---- samples ---- */

typedef struct sample {
  double seconds;
  size_t number; /* in the file */
} sample;

static int compare_samples(const void *a, const void *b) {
  const sample *x = a, *y = b;
  if (x->seconds != y->seconds) return x->seconds < y->seconds ? -1 : 1;
  return x->number < y->number ? -1 : 1;
}

/* Lists the samples that hold a value by their times in seconds; of equal times the last. */
static size_t order_samples(const qmat_usd_samples *samples, const qmat_usd_time *time, double codes_per_second,
                            sample *ordered) {
  size_t count = 0, kept = 0;
  for (size_t i = 0; i < samples->count; i++) {
    const double seconds = (time->offset + time->scale * samples->times[i]) / codes_per_second;
    if (samples->values[i]->type == QMAT_USD_BLOCK || !(fabs(seconds) < FARTHEST_TIME)) continue;
    ordered[count++] = (sample){.seconds = seconds, .number = i};
  }
  qsort(ordered, count, sizeof *ordered, compare_samples);
  for (size_t i = 0; i < count; i++) {
    if (kept > 0 && ordered[kept - 1].seconds == ordered[i].seconds) kept--;
    ordered[kept++] = ordered[i];
  }
  return kept;
}

static bool make_room(qmat_usd_rig *rig, size_t keys, size_t joints, size_t values) {
  qmat_rig *made = &rig->rig;
  return qmat_grow((void **)&made->curves, &rig->curve_capacity, made->curve_count + 1, 3 * sizeof(uint32_t)) == 0 &&
         qmat_grow((void **)&made->key_times, &rig->key_capacity, made->key_count + keys, sizeof(double)) == 0 &&
         qmat_grow((void **)&made->moved_joints, &rig->moved_capacity, made->moved_count + joints, sizeof(uint32_t)) ==
             0 &&
         qmat_grow((void **)&made->values, &rig->value_capacity, made->value_count + values, sizeof(double)) == 0;
}

static qmat_status add_curve(const request *r, const qmat_usd_prim *prim, qmat_rig_part part,
                             const qmat_usd_samples *samples, const sample *ordered, size_t keys) {
  qmat_rig *made = &r->rig->rig;
  const size_t components = parts[part].components, numbers = keys * r->moved * components;
  const qmat_status status = qmat_usd_rig_justify(r->rig, r->stage, prim, keys + r->moved + numbers);
  if (status != QMAT_OK) return status;
  if (keys > UINT32_MAX || !make_room(r->rig, keys, r->moved, numbers)) return qmat_usd_fail_prim_memory(prim);
  uint32_t *curve = made->curves + 3 * made->curve_count++;
  curve[0] = (uint32_t)part;
  curve[1] = (uint32_t)keys;
  curve[2] = (uint32_t)r->moved;
  for (size_t i = 0; i < r->count; i++)
    if (r->joints[i] != UINT32_MAX)
      made->moved_joints[made->moved_count++] = (uint32_t)r->skeleton->first + r->joints[i];
  for (size_t k = 0; k < keys; k++) {
    const double *from = samples->values[ordered[k].number]->numbers;
    made->key_times[made->key_count++] = ordered[k].seconds;
    for (size_t i = 0; i < r->count; i++) {
      if (r->joints[i] == UINT32_MAX) continue;
      copy_part(part, from + i * components, made->values + made->value_count);
      made->value_count += components;
    }
  }
  return QMAT_OK;
}

static qmat_status read_samples(const request *r, const qmat_usd_prim *prim, qmat_rig_part part,
                                const qmat_usd_samples *samples, const qmat_usd_time *time) {
  const double codes = qmat_usd_codes_per_second(qmat_usd_stage_root_layer(r->stage));
  sample *ordered = qmat_alloc(samples->count, sizeof *ordered);
  if (!ordered) return qmat_usd_fail_prim_memory(prim);
  const size_t keys = order_samples(samples, time, codes, ordered);
  bool good = true;
  for (size_t k = 0; k < keys && good; k++) good = is_good(r, part, samples->values[ordered[k].number]);
  qmat_status status = QMAT_OK;
  if (!good)
    status =
        qmat_usd_warn(prim, "its %s are left out: a sample does not match its %zu joints", parts[part].name, r->count);
  else if (keys == 1)
    set_poses(r, part, samples->values[ordered[0].number]);
  else if (keys > 1)
    status = add_curve(r, prim, part, samples, ordered, keys);
  qmat_free(ordered);
  return status;
}

/* ---- the animation ---- */

static qmat_status read_part(const request *r, const qmat_usd_prim *prim, qmat_rig_part part) {
  const qmat_usd_samples *samples;
  const qmat_usd_value *fixed;
  qmat_usd_time time;
  qmat_usd_prim_samples(prim, parts[part].name, &samples, &time, &fixed);
  if (samples) return read_samples(r, prim, part, samples, &time);
  if (!fixed) return QMAT_OK;
  if (!is_good(r, part, fixed))
    return qmat_usd_warn(prim, "its %s are left out: they do not match its %zu joints", parts[part].name, r->count);
  set_poses(r, part, fixed);
  return QMAT_OK;
}

static qmat_status read_animation(void *user, qmat_usd_prim *prim) {
  request *r = user;
  const char *type = qmat_usd_text(qmat_usd_prim_field(prim, "typeName"));
  const qmat_usd_value *joints;
  if (!type || strcmp(type, "SkelAnimation") != 0)
    return qmat_usd_warn(prim, "no animation is read from it: the prim is no SkelAnimation");
  qmat_status status = qmat_usd_prim_attribute(prim, "joints", &joints);
  if (status != QMAT_OK || !joints) return status;
  if (!joints->is_array || !qmat_usd_is_text(joints->type))
    return qmat_usd_prim_fail(prim, "joints has a value of the wrong type");
  r->count = joints->count;
  r->joints = qmat_arena_alloc(&prim->arena, r->count, sizeof *r->joints);
  bool *taken = qmat_arena_calloc(&prim->arena, r->skeleton->count, sizeof *taken);
  if (!r->joints || !taken) return qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; i < r->count; i++) {
    const size_t found = qmat_usd_skeleton_find(r->skeleton, joints->texts[i], strlen(joints->texts[i]));
    r->joints[i] = found == SIZE_MAX || taken[found] ? UINT32_MAX : (uint32_t)found;
    if (r->joints[i] == UINT32_MAX) continue;
    taken[found] = true;
    r->moved++;
  }
  if (r->moved == 0 && r->count > 0) return qmat_usd_warn(prim, "it moves no joint of the skeleton");
  for (int part = 0; part < QMAT_RIG_PART_COUNT && status == QMAT_OK; part++)
    status = read_part(r, prim, (qmat_rig_part)part);
  return status;
}

qmat_status qmat_usd_motion_read(qmat_usd_rig *rig, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                 const qmat_usd_skeleton *skeleton) {
  static const char name[] = "skel:animationSource";
  const qmat_usd_prim *owner = qmat_usd_prim_above(prim, QMAT_USD_RELATIONSHIP, name);
  if (!owner) return QMAT_OK;
  const char *const *targets;
  size_t count;
  qmat_arena arena = {0};
  request r = {.rig = rig, .stage = stage, .skeleton = skeleton};
  bool found = true;
  qmat_status status = qmat_usd_prim_targets(owner, name, &arena, &targets, &count);
  if (status == QMAT_OK && count > 0) status = qmat_usd_stage_visit(stage, targets[0], read_animation, &r, &found);
  if (status == QMAT_OK && !found)
    status = qmat_usd_warn(prim, "it does not move: there is no prim <%s>", qmat_usd_shown(targets[0]));
  qmat_arena_uninit(&arena);
  return status;
}
