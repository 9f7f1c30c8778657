/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/vertex_facets.h"

qmat_status qmat_vertex_facets_find(qmat_context *context, const qmat_mesh *mesh, qmat_vertex_facets *around) {
  around->offsets = qmat_arena_calloc(&context->arena, mesh->vertex_count + 2, sizeof *around->offsets);
  around->facets = qmat_arena_alloc(&context->arena, 3 * mesh->triangle_count, sizeof *around->facets);
  if (!around->offsets || !around->facets) return qmat_fail_memory(context, "the facets around vertices");
  size_t *offsets = around->offsets;
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) offsets[mesh->triangles[i] + 2]++;
  for (size_t v = 0; v < mesh->vertex_count; v++) offsets[v + 2] += offsets[v + 1];
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
    around->facets[offsets[mesh->triangles[i] + 1]++] = (uint32_t)(i / 3);
  return QMAT_OK;
}
