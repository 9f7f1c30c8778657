/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_STRETCH_H
#define QMAT_IO_STRETCH_H

#ifdef __cplusplus
extern "C" {
#endif

/* The largest length that a linear map makes of a unit: its largest singular value. `m` has the map's 3 x 3 matrix by
 * rows or by columns, at m[0..2], m[4..6] and m[8..10], as a transform of 16 numbers has it. Closed form: Smith,
 * "Eigenvalues of a symmetric 3 x 3 matrix", 1961. */
double qmat_largest_stretch(const double *m);

/* A stretch rounded to six digits, which is what transforms in single precision determine: the copies of an object,
 * each turned another way, have the same one. Zero and what is not a finite number stay, as do numbers beyond 1e100. */
double qmat_rounded_stretch(double stretch);

#ifdef __cplusplus
}
#endif

#endif
