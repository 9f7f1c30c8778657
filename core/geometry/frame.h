/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_FRAME_H
#define QMAT_CORE_GEOMETRY_FRAME_H

#include <stddef.h>

#include "core/value.h"

/* The unit frame of a model is centred on its bounding box and scales the box's diagonal to 1. Geometry is computed in
 * it: relative tolerances become plain numbers, and the single precision of Embree loses nothing to large offsets. */
typedef struct qmat_frame {
  double centre[3];
  double diagonal; /* model units; > 0 */
} qmat_frame;

/* The frame of the vertices that the triangles use. QMAT_ERROR_GEOMETRY when there is no triangle, or the diagonal is
 * zero or not finite. */
qmat_status qmat_frame_of_mesh(qmat_context *context, const qmat_mesh *mesh, qmat_frame *frame);

/* Maps `count` points (3 doubles each) from model units to the unit frame. `model` and `unit` may be the same array. */
void qmat_frame_to_unit(const qmat_frame *frame, const double *model, size_t count, double *unit);
/* The inverse. */
void qmat_frame_to_model(const qmat_frame *frame, const double *unit, size_t count, double *model);
/* The same for spheres (4 doubles each: centre, radius). */
void qmat_frame_spheres_to_unit(const qmat_frame *frame, const double *model, size_t count, double *unit);
void qmat_frame_spheres_to_model(const qmat_frame *frame, const double *unit, size_t count, double *model);

#endif
