/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/sample_sites.h"

#include <string.h>

#include "core/geometry/sheets.h"

static qmat_status check(qmat_context *context, const qmat_mesh *mesh, const qmat_samples *samples) {
  bool fits = samples->vertex_count == mesh->vertex_count;
  for (size_t i = 0; i < samples->count; i++) fits = fits && samples->facets[i] < mesh->triangle_count;
  if (fits) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "the %zu samples are not those of a mesh of %zu vertices and %zu facets",
            samples->count, mesh->vertex_count, mesh->triangle_count);
  return qmat_fail_field(context, "samples");
}

qmat_status qmat_sample_sites_find(qmat_context *context, const qmat_mesh *mesh, const qmat_samples *samples,
                                   qmat_sample_sites *sites) {
  qmat_arena *arena = &context->arena;
  const size_t count = samples->count, solid = qmat_solid_triangle_count(mesh);
  const qmat_status status = check(context, mesh, samples);
  if (status != QMAT_OK) return status;
  *sites = (qmat_sample_sites){.points = qmat_arena_alloc(arena, count, 3 * sizeof *sites->points),
                               .samples = qmat_arena_alloc(arena, count, sizeof *sites->samples)};
  if (!sites->points || !sites->samples) return qmat_fail_memory(context, "samples");
  for (size_t i = 0; i < count; i++) {
    if (samples->facets[i] >= solid) continue;
    memcpy(&sites->points[3 * sites->count], &samples->positions[3 * i], 3 * sizeof *sites->points);
    sites->samples[sites->count++] = (uint32_t)i;
  }
  return QMAT_OK;
}

void qmat_box_corners(double corners[3 * QMAT_BOX_CORNERS]) {
  const double reach = 2.5;
  for (size_t i = 0; i < 3 * QMAT_BOX_CORNERS; i++) corners[i] = (i / 3) >> (i % 3) & 1 ? reach : -reach;
}

qmat_status qmat_boxed_points(qmat_context *context, const qmat_frame *frame, const qmat_sample_sites *sites,
                              double **points) {
  *points = qmat_arena_alloc(&context->arena, sites->count + QMAT_BOX_CORNERS, 3 * sizeof **points);
  if (!*points) return qmat_fail_memory(context, "samples");
  qmat_frame_to_unit(frame, sites->points, sites->count, *points);
  qmat_box_corners(*points + 3 * sites->count);
  return QMAT_OK;
}
