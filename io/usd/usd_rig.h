/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_RIG_H
#define QMAT_IO_USD_USD_RIG_H

#include "io/usd/usd_mesh.h"
#include "io/usd/usd_rig_parts.h"

/* Skeletons of UsdSkel, what is bound to them, and their animation. Source: OpenUSD's documentation of UsdSkel
 * ("Schemas in Depth", "Skinning a Point" and "The API"). */

/* Binds a mesh with joints to the skeleton that its prim, or the nearest prim above it, names by skel:skeleton. `*skin`
 * becomes the number of its skin; UINT32_MAX without a skeleton. Equal skins are one. A skeleton is read when the first
 * mesh is bound to it, with the animation that skel:animationSource names. Without bind transforms its rest transforms
 * are taken for them, and the other way round. What cannot be used is left out with a warning that names the prim: a
 * skeleton without joints or with neither transforms, joints out of order or named twice, a bind transform without
 * inverse, joint indices that the skin does not have, an animation whose arrays do not match its joints. A joint of
 * skel:joints that the skeleton does not have stays at the skeleton, with a warning. QMAT_ERROR_FORMAT for a broken
 * file; QMAT_ERROR_GEOMETRY for more copies than the files justify; QMAT_ERROR_MEMORY. Cost: n log n in the joints,
 * linear in the animation. */
qmat_status qmat_usd_rig_bind(qmat_usd_rig *rig, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                              const qmat_usd_mesh *mesh, uint32_t *skin);

/* Makes times start at the scene's first time code, or at the first key where that is earlier. Call it once, when all
 * meshes are bound. */
void qmat_usd_rig_finish(qmat_usd_rig *rig, const qmat_usd_stage *stage);

void qmat_usd_rig_uninit(qmat_usd_rig *rig);

#endif
