/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_RIG_PARTS_H
#define QMAT_IO_USD_USD_RIG_PARTS_H

#include "core/rig.h"
#include "io/usd/usd_stage.h"
#include "io/usd/usd_transform.h"

/* What the readers of skeletons, skins and motion share. */

typedef struct qmat_usd_joint_name {
  const char *text; /* a path of joints: "hip/knee"; a layer owns it */
  uint32_t joint;
} qmat_usd_joint_name;

/* A skeleton that was read. The rig's arena owns its arrays. */
typedef struct qmat_usd_skeleton {
  const char *path;
  uint32_t number;                   /* in the rig; UINT32_MAX: left out */
  size_t first, count;               /* its joints in the rig */
  qmat_usd_joint_name *names;        /* count, sorted */
  qmat_usd_transform *inverse_binds; /* count */
} qmat_usd_skeleton;

/* What was read so far. A zeroed one is empty and valid; free it with qmat_usd_rig_uninit. */
typedef struct qmat_usd_rig {
  qmat_rig rig; /* its arrays are owned */
  size_t skeleton_capacity, joint_capacity, skin_capacity, bound_capacity, curve_capacity, key_capacity, moved_capacity,
      value_capacity;
  size_t known_count, known_capacity, digest_capacity;
  qmat_usd_skeleton *known; /* skeletons by their paths, also those that are left out */
  qmat_digest *digests;     /* per skin */
  size_t elements;          /* of skeletons, skins and curves: no more than the files justify */
  qmat_arena arena;
} qmat_usd_rig;

/* The number of the joint of this name in its skeleton; SIZE_MAX: none. Cost: a binary search. */
size_t qmat_usd_skeleton_find(const qmat_usd_skeleton *skeleton, const char *name, size_t length);

/* Counts elements that are to be added. QMAT_ERROR_GEOMETRY when they are more than the files justify. */
qmat_status qmat_usd_rig_justify(qmat_usd_rig *rig, const qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                 size_t elements);

#endif
