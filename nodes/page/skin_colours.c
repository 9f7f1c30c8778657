/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/skin_colours.h"

#include <math.h>
#include <string.h>

#include "core/geometry/envelope.h"
#include "core/geometry/medial_distance.h"
#include "core/node.h"
#include "nodes/page/look.h"

/* The least weight of a corner that counts: a point nearer to another corner, edge or slab belongs to that. */
static const double LEAST_WEIGHT = 1e-6;

/* The kind of what is nearest to a point: a slab's rim is a cone, and its corner a sphere. */
static qmat_look_kind kind_at(const qmat_medial *medial, const qmat_envelope *envelope, const double point[3]) {
  size_t primitive;
  uint32_t ids[3];
  double weights[3] = {1, 0, 0};
  qmat_envelope_distance(envelope, point, &primitive);
  const int corners = qmat_envelope_primitive(envelope, primitive, ids);
  const double *a = medial->spheres + 4 * (size_t)ids[0];
  if (corners == 2) {
    qmat_cone cone;
    qmat_cone_prepare(&cone, a, medial->spheres + 4 * (size_t)ids[1]);
    qmat_cone_foot(&cone, point, weights);
  } else if (corners == 3) {
    qmat_slab slab;
    qmat_slab_prepare(&slab, a, medial->spheres + 4 * (size_t)ids[1], medial->spheres + 4 * (size_t)ids[2]);
    qmat_slab_foot(&slab, point, weights);
  }
  int count = 0;
  for (int k = 0; k < corners; k++) count += weights[k] > LEAST_WEIGHT;
  return count == 3 ? QMAT_LOOK_SLAB : count == 2 ? QMAT_LOOK_CONE : QMAT_LOOK_SPHERE;
}

/* The colours of the kinds as glTF has them: linear, not sRGB. */
static void linear_colours(uint8_t bytes[QMAT_LOOK_KINDS][4]) {
  for (int kind = 0; kind < QMAT_LOOK_KINDS; kind++) {
    double colour[3];
    qmat_look_of_kind((qmat_look_kind)kind, colour);
    for (int k = 0; k < 3; k++) {
      const double linear = colour[k] <= 0.04045 ? colour[k] / 12.92 : pow((colour[k] + 0.055) / 1.055, 2.4);
      bytes[kind][k] = (uint8_t)lround(255 * linear);
    }
    bytes[kind][3] = 255;
  }
}

enum { SLICE = 4096 }; /* vertices between two calls of the progress function */

qmat_status qmat_skin_colours(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                              const uint8_t **colours) {
  uint8_t kinds[QMAT_LOOK_KINDS][4], *made = qmat_arena_alloc(&context->arena, skin->vertex_count, 4);
  *colours = made;
  if (!made) return qmat_fail_memory(context, "colours");
  qmat_envelope *envelope;
  qmat_status status = qmat_envelope_of_medial(context, medial, &envelope);
  linear_colours(kinds);
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < skin->vertex_count && status == QMAT_OK; first += SLICE) {
    const size_t end = first + SLICE < skin->vertex_count ? first + SLICE : skin->vertex_count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t v = first; v < end; v++)
      memcpy(made + 4 * v, kinds[kind_at(medial, envelope, skin->positions + 3 * v)], 4);
    status = qmat_progress(context, end, skin->vertex_count, "colours");
  }
  qmat_envelope_free(envelope);
  return status;
}
