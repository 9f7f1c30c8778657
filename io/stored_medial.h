/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_STORED_MEDIAL_H
#define QMAT_IO_STORED_MEDIAL_H

#include "core/value.h"

/* The effect of storing a medial mesh in a file with less than double precision. */

typedef enum qmat_certificate { QMAT_CERTIFICATE_UNKNOWN, QMAT_CERTIFICATE_NO, QMAT_CERTIFICATE_YES } qmat_certificate;

/* The errors of a medial mesh, in units of the diagonal. NAN: not known. */
typedef struct qmat_stated_errors {
  double diagonal; /* in model units; 0 or NAN: not known */
  double meters_per_unit;
  double epsilon;
  double error_out; /* surface to envelope */
  double error_in;  /* envelope to surface */
  qmat_certificate certified;
} qmat_stated_errors;

/* Upper bounds of the errors after points of the envelope moved by at most `moved` (model units). A certificate stays
 * valid while both errors are at most epsilon. Without a diagonal the errors stay unchanged. */
qmat_stated_errors qmat_errors_after_move(const qmat_stated_errors *errors, double moved);

/* The largest |dc| + |dr| over the spheres of two medial meshes with the same number of spheres, in model units. Cones
 * and slabs interpolate spheres, so this bounds the motion of every envelope point. */
double qmat_medial_move(const qmat_medial *given, const qmat_medial *stored);

/* Chooses the origin of single-precision coordinates. It is zero if rounding moves no point of the medial mesh and of
 * `skin` (NULL: none) by more than a quarter of `allowed` (model units, above zero). Otherwise it is near the centre of
 * their bounding box, at multiples of a power of two, which single precision can usually represent exactly. */
void qmat_storage_origin(const qmat_medial *medial, const qmat_mesh *skin, double allowed, double origin[3]);

/* The simplices that are no side of another, as files store them, in triples: the triangles in their order, then each
 * edge (i, j) on no triangle as (i, j, j), then each sphere i on no edge as (i, i, i). `counts` gets the number of each
 * kind. The caller frees `*faces` with qmat_free; NULL on failure. QMAT_ERROR_GEOMETRY: a side of a triangle is missing
 * from the edges; QMAT_ERROR_MEMORY. Cost: linear, and a binary search per side of a triangle. */
qmat_status qmat_medial_faces(qmat_context *context, const qmat_medial *medial, uint32_t **faces, size_t counts[3]);

#endif
