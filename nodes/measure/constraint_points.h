/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_CONSTRAINT_POINTS_H
#define QMAT_NODES_MEASURE_CONSTRAINT_POINTS_H

#include "core/geometry/medial_complex.h"
#include "core/geometry/surface.h"

/* The points at which medial.simplify enforces the surface-to-envelope error. On the surface they are the samples, and
 * a grid on every facet that is large compared with epsilon, thinned out where they are much closer than that. Inside
 * the solid they are points that the envelope has to contain: interior points (nodes/measure/interior_points.h), and a
 * shell of points almost epsilon below the surface. Every point has a first witness: the medial point that is known to
 * be near it. All arrays live in the context's arena. */
typedef struct qmat_constraint_points {
  size_t count, surface_count; /* those on the surface come first */
  size_t sample_count;         /* of the surface */
  size_t sample_point_count;   /* the points that are samples come first of all */
  uint32_t *sample_points;     /* per sample: the point that it is, or that stands for it; NULL: that of its number */
  uint32_t *point_samples;     /* per point that is a sample: which; NULL: that of its number */
  double *inner_limits;        /* per point inside the solid: the largest F allowed there */
  double *points;              /* 3 per point, unit frame */
  uint32_t *witnesses;         /* 3 per point: vertices of one simplex of the medial mesh, QMAT_NONE where fewer */
  double *weights;             /* 3 per point */
  double *distances;           /* per point: F at the witness; strict on the surface: 0 at most; given up: INFINITY */
} qmat_constraint_points;

/* The point that a sample is, or that stands for it. */
static inline size_t qmat_point_of_sample(const qmat_constraint_points *c, size_t sample) {
  return c->sample_points ? c->sample_points[sample] : sample;
}

/* The sample that a point is; `point` is below `sample_point_count`. */
static inline size_t qmat_sample_of_point(const qmat_constraint_points *c, size_t point) {
  return c->point_samples ? c->point_samples[point] : point;
}

/* The usual limit of the points that grids add. */
enum { QMAT_MOST_CONSTRAINT_POINTS = 600000 };

/* Makes the constraint points for a medial mesh `complex` (unit frame) that is not yet changed. `medial` gives the
 * responsible regions; where they are empty the envelope is searched. `epsilon` is the error to enforce (unit frame, >
 * 0; INFINITY: samples only). Grids add at most `most` points, and those of the shell at most four times as many; their
 * spacing grows until they do. With `inside`, points inside the solid are added where the medial mesh contains them.
 * QMAT_ERROR_MEMORY; QMAT_ERROR_GEOMETRY where the medial mesh belongs to other samples. Uses all threads. */
qmat_status qmat_constraint_points_make(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                        const qmat_medial *medial, const qmat_complex *complex, double epsilon,
                                        size_t most, bool inside, qmat_constraint_points *constraints);

/* What points on the surface are wanted; the arrays are the caller's, and all lengths are in the unit frame. */
typedef struct qmat_place_request {
  const qmat_mesh *mesh;
  const double *positions; /* 3 doubles a vertex of the mesh */
  const qmat_samples *samples;
  const double *unit_samples; /* their places: 3 doubles each */
  double spacing;             /* of the grids */
  size_t most;                /* points of the grids; their spacing grows until they are no more */
  double enough;              /* distances up to this may be too large */
} qmat_place_request;

/* Makes the points on the surface only: the samples, and grids. Distances are upper bounds of F, and F itself where
 * that is above `enough`. QMAT_ERROR_MEMORY, QMAT_CANCELLED; QMAT_ERROR_GEOMETRY where the medial mesh belongs to other
 * samples. All threads. */
qmat_status qmat_surface_places_make(qmat_context *context, const qmat_place_request *request,
                                     const qmat_medial *medial, const qmat_complex *complex,
                                     qmat_constraint_points *constraints);

/* Further points to enforce, found between the others. */
typedef struct qmat_extra_points {
  size_t surface_count, inner_count;
  const double *surface, *inner; /* 3 per point, unit frame */
  double required_depth;         /* the depth in the envelope that interior points need at most */
  bool is_strict;                /* for repairs: all points are kept, with limits that F may still exceed */
} qmat_extra_points;

/* Makes constraint points of `extra`, each with its nearest primitive of `complex` as the witness. Points inside the
 * solid that the envelope does not contain are dropped; the others need half of their present depth, at most
 * `required_depth`. Strict ones are all kept, and need all of it. The order is that of qmat_constraint_points, without
 * samples. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads. */
qmat_status qmat_extra_points_make(qmat_context *context, const qmat_complex *complex, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints);

/* Joins the points of `base`, with their present witnesses and weights (3 per point), and those of `extra`; points on
 * the surface come first. `ids` renumbers the vertices that `witnesses` name; NULL keeps them. QMAT_ERROR_MEMORY. */
qmat_status qmat_constraint_points_join(qmat_context *context, const qmat_constraint_points *base,
                                        const uint32_t *witnesses, const double *weights, const uint32_t *ids,
                                        const qmat_constraint_points *extra, qmat_constraint_points *joined);

#endif
