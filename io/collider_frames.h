/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_COLLIDER_FRAMES_H
#define QMAT_IO_COLLIDER_FRAMES_H

#include "core/value.h"

/* What formats say of colliders. Quaternions are x y z w, of length 1. */

/* The number of spheres of a shape (3 ids): 1, 2 or 3. */
int qmat_collider_width(const uint32_t shape[3]);

/* The frame of a capsule: the middle of its two centres, their distance, and the rotation that turns the y axis from
 * the first centre to the second. */
void qmat_capsule_frame(const double first[4], const double second[4], double middle[3], double *length,
                        double rotation[4]);

/* The principal moments of a body (the 10 numbers of qmat_colliders), and the rotation from their axes to those of the
 * body; by Jacobi rotations. */
void qmat_principal_inertia(const double body[10], double moments[3], double rotation[4]);

/* The rotation in a linear map, both row by row: its columns made orthonormal in turn, the first one turned round where
 * the map mirrors. The identity's where they are zero. */
void qmat_rotation_in(double linear[3][3], double rotation[3][3]);

/* A body (the 10 numbers of qmat_colliders) that a place maps by `linear`, row by row. body[0] is the mass where a
 * unit of the colliders is as long as `scale` units of the place; 0: at every place. `made` has the mass at this place,
 * the centre as it is, and the inertia along the axes that the rotation matrix `rotation` turns to, in the place's
 * lengths. The map may stretch and mirror: the second moments of the mass follow. */
void qmat_placed_body(const double body[10], double linear[3][3], double rotation[3][3], double scale, double made[10]);

#endif
