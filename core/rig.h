/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_RIG_H
#define QMAT_CORE_RIG_H

#include <stddef.h>
#include <stdint.h>

/* What a curve of a rig moves. */
typedef enum qmat_rig_part {
  QMAT_RIG_TRANSLATION,
  QMAT_RIG_ROTATION,
  QMAT_RIG_SCALE,
  QMAT_RIG_PART_COUNT
} qmat_rig_part;

enum { QMAT_RIG_POSE = 10 }; /* numbers of a joint's pose */

/* The skeletons of a scene, what is bound to them, and how they move: what a glTF form of a USD scene needs. A zeroed
 * rig is empty. Matrices are p' = (p, 1) * m by rows. */
typedef struct qmat_rig {
  size_t skeleton_count;
  char **skeleton_paths;       /* skeleton_count: of the prims, UTF-8 */
  double *skeleton_placements; /* 16 * skeleton_count: from the skeleton's space into the scene's */
  size_t joint_count;
  uint32_t *joint_skeletons; /* joint_count: rising */
  uint32_t *joint_parents;   /* joint_count: a joint of smaller number; UINT32_MAX: the skeleton itself */
  char **joint_names;        /* joint_count: UTF-8 */
  double *joint_poses;       /* 10 * joint_count: at rest, towards the parent: translation, rotation x y z w, scale */
  /* A skin lists joints in the order in which a mesh numbers them, each with the matrix that takes the mesh's points to
   * the joint's space. */
  size_t skin_count;
  uint32_t *skin_skeletons; /* skin_count */
  uint32_t *skin_ends;      /* skin_count: where its joints end */
  size_t bound_count;
  uint32_t *bound_joints; /* bound_count: a joint; UINT32_MAX: the skeleton itself */
  double *bound_matrices; /* 16 * bound_count */
  size_t placed_count;    /* the scene's placements; 0: none has a skin */
  uint32_t *placed_skins; /* placed_count: the skin; UINT32_MAX: none */
  /* A curve moves one part of some joints, at its own times. Values between two keys are linear, of rotations on the
   * sphere. Values are key by key, and joint by joint in each: 3 numbers, of rotations 4 (x y z w). */
  size_t curve_count;
  uint32_t *curves; /* 3 * curve_count: a qmat_rig_part, the numbers of its keys and of its joints */
  size_t key_count;
  double *key_times; /* key_count: seconds, not negative; rising in a curve */
  size_t moved_count;
  uint32_t *moved_joints; /* moved_count */
  size_t value_count;
  double *values; /* value_count */
} qmat_rig;

#endif
