/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_PLACEMENT_H
#define QMAT_IO_PLACEMENT_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Affine transforms of 16 numbers: p' = (p, 1) * m by rows, which in memory are the columns that glTF stores. */

/* The largest factor by which the transform stretches a length. */
double qmat_placement_stretch(const double m[16]);

/* Whether the transform is a scaling followed by a rotation and a translation, up to rounding. */
bool qmat_placement_is_plain(const double m[16]);

/* Splits a transform into a rotation `inner` and, after it, a plain transform `outer`. */
void qmat_placement_split(const double m[16], double inner[16], double outer[16]);

/* The quaternion x y z w, of length 1, of the rotation that turns the axes x, y and z of space into `axes`, which are
 * orthonormal and right-handed up to rounding. By its largest component (Shepperd's method). */
void qmat_placement_quaternion(double axes[3][3], double quaternion[4]);

/* The reverse: the axes that a quaternion x y z w of any length turns x, y and z into; themselves for one of zeros. */
void qmat_placement_turn(const double quaternion[4], double axes[3][3]);

#ifdef __cplusplus
}
#endif

#endif
