/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_COVER_FIT_H
#define QMAT_NODES_COLLIDERS_COVER_FIT_H

#include "core/geometry/surface.h"
#include "nodes/colliders/joint_points.h"
#include "nodes/colliders/shape_set.h"

/* Moves and grows spheres until no point of the solid is outside of the shapes, and keeps the union's volume small.
 *
 * First the spheres are fitted to samples of the surface: F at a sample is to be below 0, and as little below as
 * possible, because the sum of -F over samples spread evenly is nearly the volume that the shapes add to the solid.
 * Gauss-Newton steps with asymmetric weights (an iteratively reweighted quantile regression) minimise it. Then
 * qmat_cover_bound_measure searches the whole solid; spheres of shapes that leave a part uncovered grow by what it
 * needs, and the search is repeated. If some of it stays, all spheres grow by the bound.
 *
 * Where the set has joints, a sample of `skin` (else it may be NULL) is to be inside of a shape of its joint, and last
 * shapes grow until each of its points is. What the search finds counts for the joint of the shape that grows.
 *
 * `least_radius` limits the radii from below. `*proved` becomes whether the surface is closed and oriented. Fails with
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. The spheres do not depend on the number of threads. */
qmat_status qmat_cover_fit(qmat_context *context, const qmat_surface *surface, const qmat_joint_points *skin,
                           qmat_shape_set *set, double least_radius, bool *proved);

#endif
