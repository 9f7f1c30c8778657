/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/stored_medial.h"

#include <math.h>
#include <string.h>

#include "core/arena.h"
#include "core/geometry/vector.h"
#include "core/value_check.h"

static double raise_error(double error, double by) {
  return nextafter(error + nextafter(by, INFINITY), INFINITY);
}

qmat_stated_errors qmat_errors_after_move(const qmat_stated_errors *errors, double moved) {
  qmat_stated_errors after = *errors;
  if (!(errors->diagonal > 0) || !(moved > 0)) return after;
  after.error_out = raise_error(errors->error_out, moved / errors->diagonal);
  after.error_in = raise_error(errors->error_in, moved / errors->diagonal);
  const bool holds = after.error_out <= after.epsilon && after.error_in <= after.epsilon;
  if (after.certified == QMAT_CERTIFICATE_YES && !holds) after.certified = QMAT_CERTIFICATE_NO;
  return after;
}

double qmat_medial_move(const qmat_medial *given, const qmat_medial *stored) {
  double most = 0;
  for (size_t i = 0; i < given->sphere_count && i < stored->sphere_count; i++) {
    const double *a = given->spheres + 4 * i, *b = stored->spheres + 4 * i;
    most = fmax(most, qmat_point_distance(a, b) + fabs(a[3] - b[3]));
  }
  return most;
}

void qmat_storage_origin(const qmat_medial *medial, const qmat_mesh *skin, double allowed, double origin[3]) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * medial->sphere_count; i++) {
    const double *sphere = &medial->spheres[4 * (i / 3)];
    low[i % 3] = fmin(low[i % 3], sphere[i % 3] - sphere[3]);
    high[i % 3] = fmax(high[i % 3], sphere[i % 3] + sphere[3]);
  }
  for (size_t i = 0; skin && i < 3 * skin->vertex_count; i++) {
    low[i % 3] = fmin(low[i % 3], skin->positions[i]);
    high[i % 3] = fmax(high[i % 3], skin->positions[i]);
  }
  double largest = 0, side = 0;
  for (int k = 0; k < 3; k++) {
    origin[k] = 0;
    largest = fmax(largest, fmax(fabs(low[k]), fabs(high[k])));
    side = fmax(side, high[k] - low[k]);
  }
  /* Three coordinates and a radius are each rounded by half a unit in the last of 24 bits. */
  const bool is_far = (sqrt(3) + 1) * ldexp(largest, -24) > allowed / 4;
  int exponent;
  if (!(allowed > 0) || !is_far || !(side > 0) || !isfinite(side)) return;
  frexp(side, &exponent);
  const double step = ldexp(1, exponent);
  for (int k = 0; k < 3; k++) origin[k] = step * round((low[k] / 2 + high[k] / 2) / step);
}

/* ---- simplices ---- */

static void set_face(uint32_t *faces, size_t *count, uint32_t a, uint32_t b, uint32_t c) {
  faces[3 * *count] = a;
  faces[3 * *count + 1] = b;
  faces[3 * *count + 2] = c;
  (*count)++;
}

/* Fills the faces. `edge_marks` has edge_count zero bytes, `sphere_marks` sphere_count. */
static qmat_status fill_faces(qmat_context *context, const qmat_medial *medial, uint8_t *edge_marks,
                              uint8_t *sphere_marks, uint32_t *faces, size_t counts[3]) {
  size_t count = 0;
  for (size_t t = 0; t < medial->triangle_count; t++) {
    const uint32_t *id = medial->triangles + 3 * t;
    const uint32_t sides[3][2] = {{id[0], id[1]}, {id[0], id[2]}, {id[1], id[2]}};
    for (int k = 0; k < 3; k++) {
      const size_t edge = qmat_simplex_find(medial->edges, medial->edge_count, 2, sides[k]);
      if (edge == SIZE_MAX) {
        qmat_fail(context, QMAT_ERROR_GEOMETRY, "side (%u, %u) is missing from the edges", sides[k][0], sides[k][1]);
        return qmat_fail_element(context, "triangle", (int64_t)t);
      }
      edge_marks[edge] = 1;
    }
    set_face(faces, &count, id[0], id[1], id[2]);
  }
  counts[0] = count;
  for (size_t e = 0; e < medial->edge_count; e++) {
    const uint32_t *id = medial->edges + 2 * e;
    sphere_marks[id[0]] = sphere_marks[id[1]] = 1;
    if (!edge_marks[e]) set_face(faces, &count, id[0], id[1], id[1]);
  }
  counts[1] = count - counts[0];
  for (uint32_t i = 0; i < medial->sphere_count; i++) {
    if (!sphere_marks[i]) set_face(faces, &count, i, i, i);
  }
  counts[2] = count - counts[0] - counts[1];
  return QMAT_OK;
}

qmat_status qmat_medial_faces(qmat_context *context, const qmat_medial *medial, uint32_t **faces, size_t counts[3]) {
  uint8_t *sphere_marks = qmat_calloc(medial->sphere_count, 1);
  uint8_t *edge_marks = qmat_calloc(medial->edge_count, 1);
  *faces = qmat_alloc(medial->triangle_count + medial->edge_count + medial->sphere_count, 3 * sizeof **faces);
  qmat_status status = sphere_marks && edge_marks && *faces
                           ? fill_faces(context, medial, edge_marks, sphere_marks, *faces, counts)
                           : qmat_fail_memory(context, "the faces of a medial mesh");
  if (status != QMAT_OK) {
    qmat_free(*faces);
    *faces = NULL;
  }
  qmat_free(edge_marks);
  qmat_free(sphere_marks);
  return status;
}
