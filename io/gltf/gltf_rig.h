/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_RIG_H
#define QMAT_IO_GLTF_GLTF_RIG_H

#include <jansson.h>

#include "core/context.h"
#include "core/rig.h"
#include "io/bytes.h"

/* Skeletons in a new glTF asset: nodes, skins and an animation. */

/* What has been added. A zeroed one is empty. */
typedef struct qmat_gltf_rig {
  const qmat_rig *rig;
  json_int_t *tops;      /* per skeleton: the node to add to a scene; -1: no place needs the skeleton */
  json_int_t *skeletons; /* per skeleton: its node */
  json_int_t *joints;    /* per joint: its node */
  json_int_t *numbers;   /* per skin: its number in the asset; -1: not added yet */
  size_t skin_count, skin_capacity;
  uint32_t *skins; /* per skin of the asset: that of the rig */
} qmat_gltf_rig;

/* Adds the skeletons of all placed skins, in the pose of rest, and their motion. Data are appended to `data`, which
 * starts at `offset` in buffer `buffer`. `rig` must outlive `*added`, which is zeroed before. QMAT_ERROR_MEMORY. Free
 * with qmat_gltf_rig_uninit, also after a failure. Linear. */
qmat_status qmat_gltf_rig_init(qmat_context *context, json_t *root, const qmat_rig *rig, json_int_t buffer,
                               size_t offset, qmat_writer *data, qmat_gltf_rig *added);
void qmat_gltf_rig_uninit(qmat_gltf_rig *added);

/* The number of a skin in the asset. Adds it if it is not there yet. QMAT_ERROR_GEOMETRY for a matrix beyond single
 * precision; QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_rig_skin(qmat_context *context, json_t *root, qmat_gltf_rig *added, uint32_t skin,
                               json_int_t buffer, size_t offset, qmat_writer *data, json_int_t *number);

/* The matrices of a skin of the asset, 16 numbers per joint by columns; NULL: it is none of the rig. */
const double *qmat_gltf_rig_matrices(const qmat_gltf_rig *added, size_t number);

#endif
