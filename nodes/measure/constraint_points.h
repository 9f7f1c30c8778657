/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_CONSTRAINT_POINTS_H
#define QMAT_NODES_MEASURE_CONSTRAINT_POINTS_H

#include "core/geometry/medial_complex.h"
#include "core/geometry/surface.h"

/* The places at which the distance to the envelope is held: on the surface the samples, and a grid on each facet that
 * is large against the wanted error; inside the solid places that the envelope has to contain: interior points
 * (nodes/measure/interior_points.h), and a shell of points that lie just as deep as the wanted error. Each place comes
 * with its first witness. All arrays live in the context's arena. */
typedef struct qmat_constraint_points {
  size_t count, sample_count;
  size_t surface_count; /* those on the surface, which come first */
  double *inner_limits; /* per interior point: what F may be at most */
  double *points;       /* 3 per point, unit frame */
  uint32_t *witnesses;  /* 3 per point: vertices of one simplex of the medial mesh, QMAT_NONE where fewer */
  double *weights;      /* 3 per point */
  double *distances;    /* per point: F at the witness */
  double spacing;       /* of the grid, unit frame */
} qmat_constraint_points;

/* At most so many points are added in grids by default. */
enum { QMAT_MOST_CONSTRAINT_POINTS = 600000 };

/* Makes the constraint points of a model whose medial mesh `complex` (unit frame) is not yet changed. `medial` gives
 * the responsible regions; without any the envelope is searched. `epsilon` is the error that is to be held (unit frame,
 * > 0, may be INFINITY: samples only). At most `most` points are added in grids; their spacing grows until they are few
 * enough. Places inside the solid come with `inside`, as far as the medial mesh holds them. QMAT_ERROR_MEMORY,
 * QMAT_ERROR_GEOMETRY (the medial mesh belongs to other samples). Uses all threads. */
qmat_status qmat_constraint_points_make(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                        const qmat_medial *medial, const qmat_complex *complex, double epsilon,
                                        size_t most, bool inside, qmat_constraint_points *constraints);

/* The places on the surface alone: the samples and a grid that far apart on each facet, of `most` points at most as
 * above. Their distances are no less than F, and F itself where that is more than `enough`. `positions` (3 doubles a
 * vertex of the mesh) and `unit_samples` (3 a sample) are in the unit frame as are the lengths. QMAT_ERROR_MEMORY,
 * QMAT_ERROR_GEOMETRY (the medial mesh belongs to other samples), QMAT_CANCELLED. All threads. */
qmat_status qmat_surface_places_make(qmat_context *context, const qmat_mesh *mesh, const double *positions,
                                     const qmat_samples *samples, const double *unit_samples, const qmat_medial *medial,
                                     const qmat_complex *complex, double spacing, size_t most, double enough,
                                     qmat_constraint_points *constraints);

/* Further places: on the surface, and inside the solid. */
typedef struct qmat_extra_points {
  size_t surface_count, inner_count;
  const double *surface, *inner; /* 3 per point, unit frame */
  double required_depth;         /* how deep in the envelope interior points have to be */
} qmat_extra_points;

/* Further places at which a medial mesh `complex` is to be held from now on, with their nearest primitives as
 * witnesses. Of interior points those that it does not contain are left out, and no more than half of the depth to
 * which it does is held. Fills the places in the order of qmat_constraint_points; there is no sample among them.
 * QMAT_ERROR_MEMORY. All threads. */
qmat_status qmat_extra_points_make(qmat_context *context, const qmat_complex *complex, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints);

/* The places of `base` with the witnesses and weights (3 per place) that they have by now, and those of `extra`; what
 * is on the surface comes first. `ids` gives new numbers to the vertices that `witnesses` name; NULL: they keep theirs.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_constraint_points_join(qmat_context *context, const qmat_constraint_points *base,
                                        const uint32_t *witnesses, const double *weights, const uint32_t *ids,
                                        const qmat_constraint_points *extra, qmat_constraint_points *joined);

#endif
