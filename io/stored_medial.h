/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_STORED_MEDIAL_H
#define QMAT_IO_STORED_MEDIAL_H

#include "core/value.h"

/* What is true of a medial mesh once it is in a file whose numbers have less than double precision. */

typedef enum qmat_certificate { QMAT_CERTIFICATE_UNKNOWN, QMAT_CERTIFICATE_NO, QMAT_CERTIFICATE_YES } qmat_certificate;

/* The errors of a medial mesh, in units of the diagonal. NAN: not known. */
typedef struct qmat_stated_errors {
  double diagonal; /* in model units; 0 or NAN: not known */
  double epsilon;
  double error_out; /* surface to envelope */
  double error_in;  /* envelope to surface */
  qmat_certificate certified;
} qmat_stated_errors;

/* The errors after no point of the envelope or of the surface moved by more than `moved` (model units), rounded up. A
 * certificate holds as long as both errors are at most epsilon. Without a diagonal nothing changes. */
qmat_stated_errors qmat_errors_after_move(const qmat_stated_errors *errors, double moved);

/* The largest |dc| + |dr| over the spheres of two medial meshes of equally many spheres, in model units. Cones and
 * slabs interpolate their spheres, so no point of the solid moves farther. */
double qmat_medial_move(const qmat_medial *given, const qmat_medial *stored);

/* Chooses the point that single-precision coordinates count from: zero where rounding moves no point of the medial mesh
 * and of `skin` (NULL: none) by more than a quarter of `allowed` (model units, above zero), else near the centre of
 * their box, at multiples of a power of two, so that single precision holds the point itself as far as it can. */
void qmat_storage_origin(const qmat_medial *medial, const qmat_mesh *skin, double allowed, double origin[3]);

#endif
