/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_FRAME_H
#define QMAT_CORE_GEOMETRY_FRAME_H

#include <stddef.h>

#include "core/value.h"

/* The unit frame of a model: centred on its bounding box, whose diagonal is 1. Geometry is computed there, so that
 * every relative tolerance is a plain number and single precision (Embree) is spent on the model alone. */
typedef struct qmat_frame {
  double centre[3];
  double diagonal; /* model units; > 0 */
} qmat_frame;

/* The frame of a mesh, over the vertices that triangles use. QMAT_ERROR_GEOMETRY when there is no triangle or the
 * diagonal is zero or not finite. */
qmat_status qmat_frame_of_mesh(qmat_context *context, const qmat_mesh *mesh, qmat_frame *frame);

/* Maps `count` points (3 doubles each) from model units into the unit frame. In place is allowed. */
void qmat_frame_to_unit(const qmat_frame *frame, const double *model, size_t count, double *unit);
/* The reverse. */
void qmat_frame_to_model(const qmat_frame *frame, const double *unit, size_t count, double *model);
/* The same two for spheres (4 doubles each: centre and radius). */
void qmat_frame_spheres_to_unit(const qmat_frame *frame, const double *model, size_t count, double *unit);
void qmat_frame_spheres_to_model(const qmat_frame *frame, const double *unit, size_t count, double *model);

#endif
