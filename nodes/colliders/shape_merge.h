/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SHAPE_MERGE_H
#define QMAT_NODES_COLLIDERS_SHAPE_MERGE_H

#include "nodes/colliders/shape_set.h"

/* Joins pairs of shapes, the least growth of volume first, until at most `most` are left, or none has another one
 * of its joint. The shape for both is the hull of some of their spheres; `growth` times what the others leave it by is
 * added to its radii, so that 1 makes it contain both. Pairs that touch come before others. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. One thread. Cost: the shapes times the pairs that each joint shape touches, and quadratic distances.
 */
qmat_status qmat_shape_set_merge(qmat_context *context, qmat_shape_set *set, qmat_shape_kind kind, double growth,
                                 size_t most);

/* Finds the shapes of `given` whose joints have no shape in `set`, which was made of it; all of them where nothing is
 * skinned and `set` is empty. `lost` receives them with all spheres of `given`, in new arrays, and its joints.
 * QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_shape_set_find_lost(qmat_context *context, const qmat_shape_set *given, const qmat_shape_set *set,
                                     qmat_shape_set *lost);

/* Adds the shapes of another set, which has joints where this one has. The arrays become new ones. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. Cost: that of qmat_shape_set_reduce. */
qmat_status qmat_shape_set_append(qmat_context *context, qmat_shape_set *set, const qmat_shape_set *other);

/* Keeps the `most` largest shapes, by qmat_shape_volume, the first of equal ones. The largest shape of each joint stays
 * always; where the set has more joints than `most`, only those do. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: a sort of
 * the shapes, and that of qmat_shape_set_reduce. */
qmat_status qmat_shape_set_keep_largest(qmat_context *context, qmat_shape_set *set, size_t most);

#endif
