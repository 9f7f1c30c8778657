/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_SHEETS_H
#define QMAT_CORE_GEOMETRY_SHEETS_H

#include "core/value.h"

/* The triangles of a mesh that bound solids come first; those of sheets follow, and of these, the flaps are last. */
static inline size_t qmat_solid_triangle_count(const qmat_mesh *mesh) {
  return mesh->triangle_count - mesh->sheet_triangle_count;
}

/* Whether the mesh is more than sheets. True without triangles, which is an error elsewhere. */
static inline bool qmat_has_solids(const qmat_mesh *mesh) {
  return mesh->sheet_triangle_count == 0 || qmat_solid_triangle_count(mesh) > 0;
}

/* The mesh without its sheets, unsealed. It borrows the arrays; vertices keep their numbers, so some may be unused. */
static inline qmat_mesh qmat_mesh_of_solids(const qmat_mesh *mesh) {
  qmat_mesh solids = *mesh;
  solids.base.sealed = false;
  solids.base.kept[0] = solids.base.kept[1] = NULL;
  solids.triangle_count = qmat_solid_triangle_count(mesh);
  solids.sheet_triangle_count = solids.flap_triangle_count = 0;
  return solids;
}

/* Puts the sheets of the mesh, without flaps, in front of an unsealed medial mesh, in model units: a slab for each
 * triangle, and a sphere of half the sheet thickness at each of their vertices, in the order of the vertices. A sphere
 * is responsible for its vertex; the first samples are the vertices. QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_sheet_slabs_prepend(qmat_context *context, const qmat_mesh *mesh, qmat_medial *medial);

#endif
