/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_RIGID_BODY_H
#define QMAT_NODES_COLLIDERS_RIGID_BODY_H

#include "core/geometry/surface.h"

/* The mass properties of the solid that a closed and oriented surface bounds, by exact integrals over its triangles
 * (Mirtich 1996): `body` gets the 10 numbers of qmat_colliders. `density` is in kg per cubic metre; a unit that is not
 * known counts as a metre. `*volume` becomes the volume in the unit frame. False, and a volume of 0, where the surface
 * is open, not oriented, or bounds nothing. Cost: linear. Where components overlap, the common parts count several
 * times. */
bool qmat_rigid_body_of_surface(const qmat_surface *surface, double density, double body[10], double *volume);

#endif
