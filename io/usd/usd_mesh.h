/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_MESH_H
#define QMAT_IO_USD_USD_MESH_H

#include "io/soup.h"
#include "io/usd/usd_transform.h"

/* The arrays of a mesh; NULL for those that it lacks. The layer that they come from owns them. */
typedef struct qmat_usd_mesh {
  const qmat_usd_value *points, *counts, *indices, *holes;
  const qmat_usd_value *crease_lengths, *crease_indices, *crease_sharpness, *sharp_vertices, *vertex_sharpness;
  const qmat_usd_value *joints, *weights; /* of UsdSkel, both or none; `influences` for each point, or for all points */
  size_t influences;
  bool is_left_handed;
  qmat_scheme scheme;
  qmat_boundary boundary;
  double deviation; /* of the faces from the surface that they stand for, in its own units; 0: exact */
} qmat_usd_mesh;

/* Reads and checks the arrays of a prim of the type Mesh. Without points, face counts, face indices or faces the mesh
 * is empty. QMAT_ERROR_FORMAT with the prim; QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_usd_mesh_read(const qmat_usd_prim *prim, qmat_usd_mesh *mesh);

/* What an empty mesh lacks ("points"); NULL when it has faces. */
const char *qmat_usd_mesh_lacks(const qmat_usd_mesh *mesh);

/* A digest of all that describes the surface: meshes of equal digests are equal. QMAT_ERROR_MEMORY,
 * QMAT_ERROR_DEPENDENCY. Cost: linear. */
qmat_status qmat_usd_mesh_digest(const qmat_usd_mesh *mesh, qmat_digest *digest);

/* The number of holes: faces that are left out. A face that is named twice counts twice. */
size_t qmat_usd_mesh_holes(const qmat_usd_mesh *mesh);

/* Gives the newest vertices of `soup`, which are the mesh's, its joints and weights: the four strongest of each. Joints
 * are numbered as the mesh numbers them: by its skel:joints, else by those of its skeleton. QMAT_ERROR_MEMORY. Cost:
 * linear. */
qmat_status qmat_usd_mesh_add_skin(qmat_context *context, const qmat_usd_mesh *mesh, qmat_soup *soup);

/* Adds a mesh that is not empty to `soup`, moved by `world`: its faces but holes, its polygons as a cage, and its
 * deviation. A mirroring transform and left-handed meshes turn the faces. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost:
 * linear. */
qmat_status qmat_usd_mesh_add(qmat_context *context, const qmat_usd_mesh *mesh, const qmat_usd_transform *world,
                              qmat_soup *soup);

#endif
