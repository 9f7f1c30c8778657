/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_MOTION_H
#define QMAT_IO_USD_USD_MOTION_H

#include "io/usd/usd_rig_parts.h"

/* Reads the SkelAnimation that the skeleton's prim, or the nearest prim above it, names by skel:animationSource.
 * Samples over time become curves of the rig; values without samples become poses of its joints. Joints that the
 * skeleton does not have are left out. Arrays that do not match the joints are left out with a warning. */
qmat_status qmat_usd_motion_read(qmat_usd_rig *rig, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                 const qmat_usd_skeleton *skeleton);

#endif
