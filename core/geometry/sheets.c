/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/sheets.h"

#include <string.h>

#include "core/geometry/medial_build.h"

/* Numbers the vertices of `triangles` in their order: `ids` per vertex, UINT32_MAX for others. Returns their count. */
static size_t number_vertices(const qmat_mesh *mesh, const uint32_t *triangles, size_t triangle_count, uint32_t *ids) {
  size_t count = 0;
  memset(ids, 0xff, mesh->vertex_count * sizeof *ids);
  for (size_t i = 0; i < 3 * triangle_count; i++) ids[triangles[i]] = 0;
  for (size_t v = 0; v < mesh->vertex_count; v++)
    if (ids[v] == 0) ids[v] = (uint32_t)count++;
  return count;
}

/* The spheres, and their regions; those of the medial mesh follow. */
static qmat_status prepend_spheres(qmat_context *context, const qmat_mesh *mesh, const uint32_t *ids, size_t added,
                                   qmat_medial *medial) {
  const size_t before = medial->sphere_count, count = added + before, samples = medial->region_sample_count;
  double *spheres = qmat_alloc(count, 4 * sizeof *spheres);
  uint32_t *offsets = qmat_alloc(count + 1, sizeof *offsets);
  uint32_t *regions = qmat_alloc(added + samples, sizeof *regions);
  if (!spheres || !offsets || !regions || added + samples >= UINT32_MAX) {
    qmat_free(spheres);
    qmat_free(offsets);
    qmat_free(regions);
    return qmat_fail_memory(context, "the slabs of sheets");
  }
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    if (ids[v] == UINT32_MAX) continue;
    double *sphere = &spheres[4 * (size_t)ids[v]];
    memcpy(sphere, &mesh->positions[3 * v], 3 * sizeof *sphere);
    sphere[3] = 0.5 * mesh->sheet_thickness;
    regions[ids[v]] = (uint32_t)v;
  }
  for (size_t i = 0; i <= added; i++) offsets[i] = (uint32_t)i;
  for (size_t i = 0; i < before; i++) offsets[added + i + 1] = (uint32_t)added + medial->region_offsets[i + 1];
  if (before) memcpy(&spheres[4 * added], medial->spheres, 4 * before * sizeof *spheres);
  if (samples) memcpy(&regions[added], medial->region_samples, samples * sizeof *regions);
  qmat_free(medial->spheres);
  qmat_free(medial->region_offsets);
  qmat_free(medial->region_samples);
  medial->spheres = spheres;
  medial->sphere_count = count;
  medial->sheet_sphere_count = added;
  medial->region_offsets = offsets;
  medial->region_samples = regions;
  medial->region_offset_count = count + 1;
  medial->region_sample_count = added + samples;
  return QMAT_OK;
}

qmat_status qmat_sheet_slabs_prepend(qmat_context *context, const qmat_mesh *mesh, qmat_medial *medial) {
  const size_t sheets = mesh->sheet_triangle_count - mesh->flap_triangle_count, slabs = medial->triangle_count,
               cones = medial->edge_count;
  uint32_t *ids = qmat_arena_alloc(&context->arena, mesh->vertex_count, sizeof *ids);
  uint32_t *triangles = qmat_arena_alloc(&context->arena, sheets + slabs, 3 * sizeof *triangles);
  if (!ids || !triangles) return qmat_fail_memory(context, "the slabs of sheets");
  const uint32_t *first = &mesh->triangles[3 * qmat_solid_triangle_count(mesh)];
  const size_t added = number_vertices(mesh, first, sheets, ids);
  for (size_t i = 0; i < 3 * sheets; i++) triangles[i] = ids[first[i]];
  for (size_t i = 0; i < 3 * slabs; i++) triangles[3 * sheets + i] = (uint32_t)added + medial->triangles[i];
  for (size_t i = 0; i < 2 * cones; i++) medial->edges[i] += (uint32_t)added;
  const qmat_status status = prepend_spheres(context, mesh, ids, added, medial);
  if (status != QMAT_OK) return status;
  return qmat_medial_set_simplices(context, medial, medial->edges, cones, triangles, sheets + slabs);
}
