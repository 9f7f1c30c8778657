/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_COLLIDERS_SHAPE_MEASURES_H
#define QMAT_NODES_COLLIDERS_SHAPE_MEASURES_H

#include "core/geometry/surface.h"
#include "nodes/colliders/shape_set.h"

/* How well colliders describe a solid, by the measures of cuRobo (SphereFitMetrics) and the intersection over union.
 * All are sampled; lengths are in the unit frame. Sheets with a thickness are parts of the solid. */
typedef struct qmat_shape_measures {
  double coverage;                        /* share of the solid that is in a shape */
  double protrusion;                      /* share of the shapes' boundary that is outside of the solid */
  double protrusion_mean, protrusion_p95; /* how far the boundary is outside; 0 where it is inside */
  double gap_mean, gap_p95;               /* the distance from the surface to the shapes; 0 where they cover it */
  double max_uncovered_gap;               /* the largest of those distances */
  double volume_ratio;                    /* volume of the union over the solid's; 0 where there is no solid */
  double iou;                             /* intersection over union of the volumes */
} qmat_shape_measures;

/* Takes `samples` points of the surface, about as many of the boundary, and ten times as many of the volume.
 * `volume` is that of the solid without sheets, or 0 where it is not known: then it is sampled, too, as it is with
 * sheets that have a thickness. `colliders` has the hulls of the shapes; `envelope` is theirs in the unit frame.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the result does not depend on their number. */
qmat_status qmat_shape_measures_take(qmat_context *context, const qmat_surface *surface, const qmat_shape_set *set,
                                     const qmat_envelope *envelope, const qmat_colliders *colliders, double volume,
                                     size_t samples, qmat_shape_measures *measures);

#endif
