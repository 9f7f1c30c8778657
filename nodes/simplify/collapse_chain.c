/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/collapse_chain.h"

#include <string.h>

#include "core/geometry/medial_build.h"

const double qmat_constraint_share = 0.975;

void qmat_collapse_roots(const uint32_t *ends, size_t count, size_t sphere_count, uint32_t *roots) {
  for (size_t v = 0; v < sphere_count; v++) roots[v] = (uint32_t)v;
  /* Backwards: when a collapse is reached, the root of its kept sphere is known. */
  for (size_t i = count; i-- > 0;) roots[ends[2 * i + 1]] = roots[ends[2 * i]];
}

qmat_status qmat_medial_set_regions(qmat_context *context, const uint32_t *owners, size_t sample_count,
                                    qmat_medial *medial) {
  const size_t count = medial->sphere_count;
  medial->region_offsets = qmat_calloc(count + 2, sizeof(uint32_t));
  medial->region_samples = qmat_alloc(sample_count, sizeof(uint32_t));
  if (!medial->region_offsets || !medial->region_samples) return qmat_fail_memory(context, "responsible regions");
  uint32_t *offsets = medial->region_offsets;
  for (size_t i = 0; i < sample_count; i++)
    if (owners[i] != QMAT_NONE) offsets[owners[i] + 2]++;
  for (size_t v = 0; v < count; v++) offsets[v + 2] += offsets[v + 1];
  for (size_t i = 0; i < sample_count; i++)
    if (owners[i] != QMAT_NONE) medial->region_samples[offsets[owners[i] + 1]++] = (uint32_t)i;
  medial->region_offset_count = count + 1;
  medial->region_sample_count = offsets[count];
  return QMAT_OK;
}

size_t qmat_chain_length(const qmat_chain *chain, size_t vertices, double epsilon) {
  size_t low = 0, high = chain->collapse_count;
  if (vertices > 0) {
    const size_t most = chain->sphere_count > vertices ? chain->sphere_count - vertices : 0;
    if (most < high) high = most;
  }
  if (!(epsilon > 0)) return high;
  while (low < high) { /* errors never decrease */
    const size_t middle = low + (high - low) / 2;
    if (chain->errors[middle] > qmat_constraint_share * epsilon)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

qmat_status qmat_chain_extract(qmat_context *context, const qmat_chain *chain, size_t count, qmat_medial *medial) {
  qmat_arena *arena = &context->arena;
  const size_t spheres = chain->sphere_count;
  uint32_t *ids = qmat_arena_alloc(arena, spheres, sizeof *ids), next = 0;
  uint32_t *roots = qmat_arena_alloc(arena, spheres, sizeof *roots);
  uint32_t *edges = qmat_arena_alloc(arena, chain->edge_count, 2 * sizeof *edges);
  uint32_t *triangles = qmat_arena_alloc(arena, chain->triangle_count, 3 * sizeof *triangles);
  uint32_t *owners = qmat_arena_alloc(arena, chain->sample_count, sizeof *owners);
  medial->sphere_count = spheres - count;
  medial->spheres = qmat_alloc(spheres - count, 4 * sizeof(double));
  if (!ids || !roots || !edges || !triangles || !owners || !medial->spheres)
    return qmat_fail_memory(context, "the medial mesh");
  qmat_collapse_roots(chain->ends, count, spheres, roots);
  for (size_t v = 0; v < spheres; v++) {
    if (roots[v] != v) continue;
    memcpy(&medial->spheres[4 * (size_t)next], &chain->spheres[4 * v], 4 * sizeof(double));
    ids[v] = next++;
    medial->sheet_sphere_count += v < chain->sheet_sphere_count;
  }
  for (size_t v = 0; v < spheres; v++)
    if (roots[v] != v) ids[v] = ids[roots[v]];
  for (size_t i = 0; i < count; i++) {
    const uint32_t kept = chain->ends[2 * i];
    if (roots[kept] == kept) memcpy(&medial->spheres[4 * (size_t)ids[kept]], &chain->merged[4 * i], 4 * sizeof(double));
  }
  const size_t edge_count = qmat_medial_renumber(chain->edges, chain->edge_count, 2, ids, edges);
  const size_t triangle_count = qmat_medial_renumber(chain->triangles, chain->triangle_count, 3, ids, triangles);
  for (size_t i = 0; i < chain->sample_count; i++)
    owners[i] = chain->owners[i] == QMAT_NONE ? QMAT_NONE : ids[chain->owners[i]];
  const qmat_status status = qmat_medial_set_simplices(context, medial, edges, edge_count, triangles, triangle_count);
  return status == QMAT_OK ? qmat_medial_set_regions(context, owners, chain->sample_count, medial) : status;
}
