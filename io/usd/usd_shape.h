/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_SHAPE_H
#define QMAT_IO_USD_USD_SHAPE_H

#include "io/usd/usd_mesh.h"

/* Whether prims of this type are solids that qmat_usd_shape_read makes into meshes: Sphere, Cube, Cylinder, Cylinder_1,
 * Cone, Capsule, Capsule_1; and Plane, which is a rectangle. */
bool qmat_usd_is_shape(const char *type);

/* A shape as its prim describes it. */
typedef struct qmat_usd_shape {
  size_t kind;
  double sizes[3]; /* in the order of the schema; 0 for what the shape lacks */
  char axis;       /* 'X', 'Y' or 'Z' */
  bool is_flat;    /* a size is zero or negative: the shape has no volume */
} qmat_usd_shape;

/* Reads a prim of such a type. A shape that is flat gives a warning. QMAT_ERROR_FORMAT with the prim: a size that is
 * not one finite number, or an unknown axis; QMAT_ERROR_MEMORY. Source: the schemas of UsdGeom. */
qmat_status qmat_usd_shape_read(const qmat_usd_prim *prim, const char *type, qmat_usd_shape *shape);

/* A digest of the shape: shapes of equal digests are equal, and no mesh has the same. QMAT_ERROR_DEPENDENCY,
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_shape_digest(const qmat_usd_shape *shape, qmat_digest *digest);

/* Makes a mesh without subdivision of a shape that is not flat, in its own space. `arena` gets its arrays. Cubes and
 * planes are exact. Circles become regular polygons of `segments` sides (8 or more, rounded up to a multiple of 4) with
 * corners on the surface; mesh->deviation bounds the distance to the surface. False when memory is short. */
bool qmat_usd_shape_mesh(const qmat_usd_shape *shape, size_t segments, qmat_arena *arena, qmat_usd_mesh *mesh);

#endif
