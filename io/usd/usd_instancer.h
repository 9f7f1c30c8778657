/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_INSTANCER_H
#define QMAT_IO_USD_USD_INSTANCER_H

#include "io/usd/usd_transform.h"

/* The instances of a PointInstancer. */
typedef struct qmat_usd_instancer {
  size_t prototype_count;
  const char *const *prototypes; /* prototype_count: paths in the scene */
  size_t instance_count;
  size_t *ends; /* prototype_count: where the instances of a prototype end; those of the next begin there */
  qmat_usd_transform *placements; /* instance_count: from its prototype's space into the instancer's */
} qmat_usd_instancer;

/* Reads the instances of a prim of the type PointInstancer: prototypes, protoIndices, positions, orientations or
 * orientationsf, scales, ids, and what invisibleIds and inactiveIds leave out. `arena` gets the arrays.
 * QMAT_ERROR_FORMAT with the prim for arrays of the wrong type or length, and for indices out of range;
 * QMAT_ERROR_MEMORY. Cost: linear. Source: the schema UsdGeomPointInstancer. */
qmat_status qmat_usd_instancer_read(const qmat_usd_prim *prim, qmat_arena *arena, qmat_usd_instancer *instancer);

#endif
