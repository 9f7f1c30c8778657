/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_SKELETON_H
#define QMAT_IO_USD_USD_SKELETON_H

#include "io/usd/usd_rig_parts.h"

/* Finds the skeleton at a path among rig->known, or reads it with its motion. `prim` is the one that names it. */
qmat_status qmat_usd_skeleton_read(qmat_usd_rig *rig, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                   const char *path, size_t *known);

#endif
