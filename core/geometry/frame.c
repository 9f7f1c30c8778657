/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/frame.h"

#include <math.h>

#include "core/geometry/vector.h"

qmat_status qmat_frame_of_mesh(qmat_context *context, const qmat_mesh *mesh, qmat_frame *frame) {
  if (mesh->triangle_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it has no triangles");
    return qmat_fail_field(context, "mesh");
  }
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t corner = 0; corner < 3 * mesh->triangle_count; corner++) {
    const double *p = mesh->positions + 3 * (size_t)mesh->triangles[corner];
    for (int axis = 0; axis < 3; axis++) {
      low[axis] = qmat_smaller(low[axis], p[axis]);
      high[axis] = qmat_larger(high[axis], p[axis]);
    }
  }
  double largest = 0;
  for (int axis = 0; axis < 3; axis++) {
    /* Halved before adding: the sum of two large coordinates could overflow. */
    frame->centre[axis] = 0.5 * low[axis] + 0.5 * high[axis];
    largest = qmat_larger(largest, high[axis] - low[axis]);
  }
  /* Scaled by the largest extent, so that the squares of a tiny model do not underflow. */
  double sum = 0;
  for (int axis = 0; axis < 3 && largest > 0; axis++) {
    const double ratio = (high[axis] - low[axis]) / largest;
    sum += ratio * ratio;
  }
  frame->diagonal = largest * sqrt(sum);
  if (!isfinite(frame->diagonal)) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its bounding box is too large to be measured");
    return qmat_fail_field(context, "mesh");
  }
  if (!(frame->diagonal > 0)) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "all its triangles lie in one point");
    return qmat_fail_field(context, "mesh");
  }
  return QMAT_OK;
}

/* Divides by the diagonal, because the reciprocal of a tiny diagonal could overflow. */
void qmat_frame_to_unit(const qmat_frame *frame, const double *model, size_t count, double *unit) {
  for (size_t i = 0; i < 3 * count; i++) unit[i] = (model[i] - frame->centre[i % 3]) / frame->diagonal;
}

void qmat_frame_to_model(const qmat_frame *frame, const double *unit, size_t count, double *model) {
  for (size_t i = 0; i < 3 * count; i++) model[i] = unit[i] * frame->diagonal + frame->centre[i % 3];
}

void qmat_frame_spheres_to_unit(const qmat_frame *frame, const double *model, size_t count, double *unit) {
  for (size_t i = 0; i < count; i++) {
    qmat_frame_to_unit(frame, model + 4 * i, 1, unit + 4 * i);
    unit[4 * i + 3] = model[4 * i + 3] / frame->diagonal;
  }
}

void qmat_frame_spheres_to_model(const qmat_frame *frame, const double *unit, size_t count, double *model) {
  for (size_t i = 0; i < count; i++) {
    qmat_frame_to_model(frame, unit + 4 * i, 1, model + 4 * i);
    model[4 * i + 3] = unit[4 * i + 3] * frame->diagonal;
  }
}
