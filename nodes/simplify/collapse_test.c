/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/collapse_test.h"

#include <math.h>
#include <string.h>

/* Whether the edge is a tubular feature: it has no slab, and all of its responsible region is thin (section 3.4). */
static bool is_tubular(const qmat_decimation *s, uint32_t edge) {
  if (s->complex.edge_triangles[edge]) return false;
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  bool any = false;
  for (int k = 0; k < 2; k++)
    for (uint32_t slot = qmat_surface_to_envelope_first(&s->surface_tracker, ends[k]); slot != QMAT_NONE;
         slot = s->surface_tracker.next[slot]) {
      const uint32_t point = slot / 3;
      if (point >= s->constraints->sample_point_count) continue;
      if (!s->rules.thin[qmat_sample_of_point(s->constraints, point)]) return false;
      any = true;
    }
  return any;
}

static bool is_protecting(const qmat_decimation *s) {
  return s->rules.protect == QMAT_PROTECT_ALWAYS ||
         (s->rules.protect == QMAT_PROTECT_LATE && s->complex.live_vertices <= s->rules.late_spheres);
}

bool qmat_decimation_is_protected(const qmat_decimation *s, uint32_t vertex) {
  if (!is_protecting(s)) return false;
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(&s->complex, vertex, &count);
  for (size_t i = 0; i < count; i++)
    if (is_tubular(s, at[i])) return true;
  return false;
}

static bool is_candidate(const qmat_candidates *c, const double *sphere) {
  for (int i = 0; i < c->count; i++)
    if (memcmp(c->spheres[i], sphere, sizeof c->spheres[i]) == 0) return true;
  return false;
}

bool qmat_decimation_apply_protection(const qmat_decimation *s, uint32_t edge, qmat_candidates *c, bool *bound) {
  if (!is_protecting(s)) return true;
  if (is_tubular(s, edge)) return false;
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const bool first = qmat_decimation_is_protected(s, ends[0]), second = qmat_decimation_is_protected(s, ends[1]);
  if (first && second) return false;
  if (!first && !second) return true;
  const double *kept = &s->complex.spheres[4 * (size_t)ends[second]];
  if (*bound && !is_candidate(c, kept)) return false;
  const qmat_quadric quadric = qmat_merged_quadric(&s->complex, s->quadrics, edge);
  c->count = 0;
  qmat_candidates_add(c, &quadric, kept);
  *bound = true;
  return true;
}

bool qmat_decimation_keeps_topology(qmat_decimation *s) {
  const qmat_collapse *c = &s->collapse;
  if (qmat_decimation_is_of_sheet(s, c->kept) != qmat_decimation_is_of_sheet(s, c->removed)) return false;
  return s->rules.topology != QMAT_TOPOLOGY_PRESERVE || qmat_collapse_keeps_homotopy(&s->complex, c);
}

static bool bounds_envelope(const qmat_decimation *s) {
  return s->threshold < INFINITY && qmat_decimation_is_two_sided(s);
}

/* Whether the newest preview merges into a sharp feature. */
static bool merges_feature(const qmat_decimation *s) {
  return qmat_crease_guard_is_feature(&s->creases, s->collapse.kept) ||
         qmat_crease_guard_is_feature(&s->creases, s->collapse.removed);
}

/* Whether the merged sphere and its edges lie inside the model, and whether the sphere is within the threshold. A sharp
 * feature lies on the surface, and edges between thin spheres only have to be within the threshold. */
static qmat_collapse_outcome test_inside(qmat_decimation *s, const double *sphere) {
  const bool on_surface = merges_feature(s);
  const bool kept =
      qmat_envelope_to_surface_test_sphere(&s->envelope_tracker, &s->complex, &s->collapse, sphere) || on_surface;
  s->refusal = QMAT_REFUSED_BY_SPHERE;
  const bool inside = s->rules.published || on_surface || s->envelope_tracker.sphere_depth > 0 ||
                      qmat_decimation_is_of_sheet(s, s->collapse.kept);
  if (!inside || (!kept && s->rules.on_exceed == QMAT_EXCEED_SKIP)) return QMAT_COLLAPSE_REFUSED;
  s->refusal = QMAT_REFUSED_BY_MIDPOINT;
  if (!s->rules.published &&
      !qmat_envelope_to_surface_test_midpoints(&s->envelope_tracker, &s->complex, &s->collapse, sphere,
                                               bounds_envelope(s) ? s->rules.thin_radius : 0))
    return QMAT_COLLAPSE_REFUSED;
  return kept || !(sphere[3] - s->envelope_tracker.sphere_depth > s->envelope_tracker.limit) ? QMAT_COLLAPSE_ALLOWED
                                                                                             : QMAT_COLLAPSE_EXCEEDS;
}

qmat_status qmat_decimation_test_sphere(qmat_decimation *s, const double *sphere, uint32_t first,
                                        qmat_collapse_outcome *result, double *needed) {
  bool kept;
  s->tested_first = first;
  s->surface_tracker.found_count = 0;
  *result = test_inside(s, sphere);
  *needed = sphere[3] - s->envelope_tracker.sphere_depth;
  if (*result != QMAT_COLLAPSE_ALLOWED) {
    s->counts.refused_by_inside_test++;
    return QMAT_OK;
  }
  *result = QMAT_COLLAPSE_EXCEEDS;
  if (s->threshold < INFINITY) {
    const qmat_status status =
        qmat_surface_to_envelope_test(s->context, &s->surface_tracker, &s->complex, &s->collapse, sphere, first, &kept);
    if (status != QMAT_OK) return status;
    if (!kept) {
      s->counts.refused_by_surface_to_envelope++;
      s->refusal = QMAT_REFUSED_BY_SURFACE_TO_ENVELOPE;
      *needed = fmax(s->threshold, qmat_decimation_is_inner(s, s->surface_tracker.failed_point)
                                       ? -s->constraints->distances[s->surface_tracker.failed_point]
                                       : s->surface_tracker.failed_distance);
      return QMAT_OK;
    }
  }
  if (bounds_envelope(s)) {
    const qmat_status status =
        qmat_envelope_to_surface_test(s->context, &s->envelope_tracker, &s->complex, &s->collapse, sphere, &kept);
    if (status != QMAT_OK) return status;
    if (!kept) {
      s->counts.refused_by_envelope_to_surface++;
      s->refusal = QMAT_REFUSED_BY_ENVELOPE_TO_SURFACE;
      *needed = s->envelope_tracker.failed;
      return QMAT_OK;
    }
  }
  *result = QMAT_COLLAPSE_ALLOWED;
  return QMAT_OK;
}

/* The largest error recorded; it exceeds the size of the model. */
static const double most_error = 2;

static void record(qmat_decimation *s, const double *sphere) {
  const size_t i = s->log.count++;
  s->log.ends[2 * i] = s->collapse.kept;
  s->log.ends[2 * i + 1] = s->collapse.removed;
  memcpy(&s->log.merged[4 * i], sphere, 4 * sizeof *sphere);
  s->log.errors[i] = fmin(s->threshold, most_error);
}

qmat_status qmat_decimation_commit(qmat_decimation *s, const double *sphere) {
  if (qmat_decimation_in_order(s)) record(s, sphere);
  if (bounds_envelope(s))
    qmat_envelope_to_surface_commit(&s->envelope_tracker, &s->collapse);
  else
    s->envelope_tracker.depths[s->collapse.kept] = s->envelope_tracker.sphere_depth;
  qmat_surface_to_envelope_commit(&s->surface_tracker, &s->collapse);
  qmat_crease_guard_commit(&s->creases, &s->complex, &s->collapse, sphere);
  return qmat_complex_collapse(s->context, &s->complex, &s->collapse, sphere);
}
