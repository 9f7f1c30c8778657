/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_topology.h"

#include "core/disjoint_sets.h"

qmat_status qmat_skin_topology(qmat_context *context, const uint32_t *triangles, size_t triangle_count,
                               size_t vertex_count, size_t *components, int64_t *euler) {
  uint32_t *leaders = qmat_sets_new(context, vertex_count);
  bool *used = qmat_arena_calloc(&context->arena, vertex_count, sizeof *used);
  if (!leaders || !used) return qmat_fail_memory(context, "the skin");
  size_t joined = 0, vertices = 0;
  for (size_t i = 0; i < 3 * triangle_count; i++) {
    vertices += !used[triangles[i]];
    used[triangles[i]] = true;
    joined += qmat_sets_join(leaders, triangles[i], triangles[i - i % 3]);
  }
  *components = vertices - joined;
  *euler = (int64_t)vertices - (int64_t)(triangle_count / 2);
  return QMAT_OK;
}
