/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_HULL_MERGE_H
#define QMAT_NODES_COLLIDERS_HULL_MERGE_H

#include "core/geometry/surface.h"
#include "core/value.h"
#include "nodes/colliders/solid_parts.h"

/* Makes hulls around the parts of a solid, and joins them: two become the convex hull of both, where the facets
 * between both leave the solid by at most `error`, and the pair that gains the least volume comes first. While more
 * than `most` (0: any number) are left, the limit rises. Then the volume of the union is lowered (hull_exchange.h),
 * where such facets may leave the solid by twice as much. A hull has at most `most_points` vertices, and is within a
 * fifth of `error` of the points of its parts where that allows it; the mesh's deviation is added. Of the hulls of
 * outer_hull.h and tangent_hull.h it is the one with the smaller volume. A joint hull keeps the three spheres of the
 * larger of the two. A part without a volume joins the nearest one. Only parts of one joint are joined; a joint all of
 * whose parts are without a volume gets a box.
 *
 * `colliders` has the hulls of qmat_shape_hulls, outside, in units of the model. They are replaced, unless no part has
 * a volume. `parts`: those of qmat_solid_parts_find for its shapes, with the same demands on `solid`; their points may
 * change. `error` is a length of the model, above 0. How far facets leave the solid is measured to half of the limit
 * (hull_outside.h). A hull leaves it by more where its part is not convex. QMAT_ERROR_GEOMETRY where rounding spoils
 * the hull of a part, QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. Cost:
 * a convex hull for each pair whose boxes meet, and after each step for each such neighbour of the joint hull; then
 * that of the exchange. */
qmat_status qmat_hulls_merge(qmat_context *context, const qmat_surface *solid, qmat_solid_part *parts, size_t most,
                             size_t most_points, double error, qmat_colliders *colliders);

#endif
