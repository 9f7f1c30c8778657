/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/decimation_resume.h"

#include <string.h>

#include "core/geometry/medial_build.h"
#include "nodes/simplify/decimation.h"

/* With collapses in order, a merged sphere inherits the regions of both ends (section 3.3). The regions then do not
 * depend on the limits that are tested. */
static qmat_status set_regions(const qmat_decimation *s, const uint32_t *ids, qmat_medial *medial) {
  const size_t samples = s->constraints->sample_count;
  uint32_t *owners = qmat_arena_alloc(&s->context->arena, samples, sizeof *owners);
  uint32_t *roots = qmat_arena_alloc(&s->context->arena, s->complex.vertex_count, sizeof *roots);
  if (!owners || !roots) return qmat_fail_memory(s->context, "responsible regions");
  if (qmat_decimation_in_order(s)) qmat_collapse_roots(s->log.ends, s->log.count, s->complex.vertex_count, roots);
  for (size_t i = 0; i < samples; i++) {
    uint32_t owner = qmat_decimation_in_order(s)
                         ? s->log.owners[i]
                         : qmat_surface_to_envelope_owner(&s->surface_tracker, qmat_point_of_sample(s->constraints, i));
    if (qmat_decimation_in_order(s) && owner != QMAT_NONE) owner = roots[owner];
    owners[i] = owner == QMAT_NONE ? QMAT_NONE : ids[owner];
  }
  return qmat_medial_set_regions(s->context, owners, samples, medial);
}

qmat_status qmat_decimation_extract(const qmat_decimation *s, qmat_medial *medial) {
  const qmat_complex *c = &s->complex;
  qmat_arena *arena = &s->context->arena;
  uint32_t *ids = qmat_arena_alloc(arena, c->vertex_count, sizeof *ids);
  uint32_t *edges = qmat_arena_alloc(arena, c->live_edges, 2 * sizeof *edges);
  uint32_t *triangles = qmat_arena_alloc(arena, c->live_triangles, 3 * sizeof *triangles);
  medial->sphere_count = c->live_vertices;
  medial->sheet_sphere_count = 0;
  medial->spheres = qmat_alloc(c->live_vertices, 4 * sizeof(double));
  if (!ids || !edges || !triangles || !medial->spheres) return qmat_fail_memory(s->context, "the medial mesh");
  uint32_t next = 0;
  for (size_t v = 0; v < c->vertex_count; v++) {
    ids[v] = QMAT_NONE;
    if (!c->vertex_alive[v]) continue;
    medial->sheet_sphere_count += qmat_decimation_is_of_sheet(s, (uint32_t)v);
    memcpy(&medial->spheres[4 * (size_t)next], &c->spheres[4 * v], 4 * sizeof(double));
    ids[v] = next++;
  }
  size_t edge_count = 0, triangle_count = 0;
  for (size_t e = 0; e < c->edge_count; e++)
    if (c->edge_alive[e]) {
      for (size_t k = 0; k < 2; k++) edges[2 * edge_count + k] = ids[c->edges[2 * e + k]];
      edge_count++;
    }
  for (size_t t = 0; t < c->triangle_count; t++)
    if (c->triangle_alive[t]) {
      for (size_t k = 0; k < 3; k++) triangles[3 * triangle_count + k] = ids[c->triangles[3 * t + k]];
      triangle_count++;
    }
  const qmat_status status =
      qmat_medial_set_simplices(s->context, medial, edges, edge_count, triangles, triangle_count);
  return status == QMAT_OK ? set_regions(s, ids, medial) : status;
}

qmat_status qmat_decimation_resume(const qmat_decimation *from, const qmat_medial *left, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints, qmat_decimation *to) {
  qmat_context *context = to->context;
  qmat_arena *arena = &context->arena;
  const qmat_complex *c = &from->complex;
  uint32_t *ids = qmat_arena_alloc(arena, c->vertex_count, sizeof *ids);
  double *depths = qmat_arena_alloc(arena, left->sphere_count, sizeof *depths);
  to->quadrics = qmat_arena_calloc(arena, left->sphere_count, sizeof *to->quadrics);
  to->sheet_vertices = left->sheet_sphere_count;
  qmat_constraint_points further;
  qmat_status status = ids && depths && to->quadrics ? QMAT_OK : qmat_fail_memory(context, "the medial mesh");
  if (status == QMAT_OK) status = qmat_complex_init(context, &to->complex, left, NULL);
  if (status == QMAT_OK) status = qmat_extra_points_make(context, &to->complex, extra, &further);
  if (status != QMAT_OK) return status;
  uint32_t next = 0;
  for (size_t v = 0; v < c->vertex_count; v++) {
    if (!c->vertex_alive[v]) continue;
    ids[v] = next;
    depths[next] = from->envelope_tracker.depths[v];
    to->quadrics[next++] = from->quadrics[v];
  }
  for (size_t v = next; v < left->sphere_count; v++)
    depths[v] = -qmat_surface_signed_distance(from->surface, &left->spheres[4 * v]);
  status = qmat_crease_guard_renumber(context, &from->creases, ids, left->sphere_count, &to->creases);
  if (status != QMAT_OK) return status;
  status = qmat_constraint_points_join(context, from->constraints, from->surface_tracker.witnesses,
                                       from->surface_tracker.weights, ids, &further, constraints);
  to->newest_surface_count = further.surface_count;
  to->newest_inner_count = further.count - further.surface_count;
  if (status == QMAT_OK) status = qmat_decimation_init(to, constraints, depths);
  if (status != QMAT_OK) return status;
  const qmat_envelope_to_surface *known = &from->envelope_tracker;
  qmat_envelope_to_surface_carry(&to->envelope_tracker, &to->complex, ids, 2, c->edges, c->edge_alive,
                                 known->edge_bounds, c->edge_count);
  qmat_envelope_to_surface_carry(&to->envelope_tracker, &to->complex, ids, 3, c->triangles, c->triangle_alive,
                                 known->triangle_bounds, c->triangle_count);
  if (to->rules.refits > 0 && qmat_decimation_is_two_sided(to))
    qmat_envelope_to_surface_tighten(&to->envelope_tracker, &to->complex);
  to->counts = from->counts;
  to->moves = from->moves;
  return QMAT_OK;
}
