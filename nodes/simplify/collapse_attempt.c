/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/collapse_attempt.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "core/hash.h"
#include "nodes/simplify/cost_rows.h"
#include "nodes/simplify/fitted_collapse.h"
#include "nodes/simplify/thresholds.h"

/* Restricts the candidates of an edge at sharp features, for any threshold. Unchanged if none would remain. */
static void prefer_features(const qmat_decimation *s, uint32_t edge, qmat_candidates *c) {
  qmat_candidates allowed;
  double needed;
  if (qmat_crease_guard_restrict(&s->creases, &s->complex, s->quadrics, edge, INFINITY, &allowed, &needed) &&
      allowed.count > 0)
    *c = allowed;
}

qmat_status qmat_decimation_set_cost(qmat_decimation *s, uint32_t edge) {
  const qmat_cost_row *row = qmat_cost_row_of(&s->rules);
  qmat_candidates c;
  const qmat_status status = row->find(s, edge, &c);
  if (status != QMAT_OK) return status;
  if (row->by_quadrics) prefer_features(s, edge, &c);
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const double *a = &s->complex.spheres[4 * (size_t)ends[0]], *b = &s->complex.spheres[4 * (size_t)ends[1]];
  s->heap.errors[edge] = row->by_quadrics ? c.errors[0] : qmat_point_distance(a, b);
  s->heap.costs[edge] = row->cost(s, &c, a, b);
  if (s->rules.seed > 0)
    s->heap.costs[edge] *= pow(qmat_most_cost_factor, qmat_hash_unit(qmat_hash3(s->rules.seed, edge, 0)));
  s->stale[edge] = 0;
  return QMAT_OK;
}

qmat_status qmat_decimation_attempt(qmat_decimation *s, uint32_t edge, double sphere[4],
                                    qmat_collapse_outcome *result) {
  qmat_candidates c;
  *result = QMAT_COLLAPSE_REFUSED;
  s->neighbourhood.count = 0; /* drops the neighbourhood of the edge tried before */
  qmat_status status = qmat_cost_row_of(&s->rules)->find(s, edge, &c);
  if (status != QMAT_OK) return status;
  double needed;
  const double share = s->rules.crease_share;
  bool bound =
      qmat_crease_guard_restrict(&s->creases, &s->complex, s->quadrics, edge, share * s->threshold, &c, &needed);
  needed /= share;
  if (bound && c.count == 0) {
    s->counts.refused_by_protection++;
    s->needed[edge] = needed;
    if (needed < INFINITY) *result = QMAT_COLLAPSE_EXCEEDS;
    return QMAT_OK;
  }
  if (!qmat_decimation_apply_protection(s, edge, &c, &bound)) {
    s->counts.refused_by_protection++;
    return QMAT_OK;
  }
  status = qmat_complex_preview(s->context, &s->complex, edge, &s->collapse);
  if (status != QMAT_OK) return status;
  if (!qmat_decimation_keeps_topology(s)) {
    s->counts.refused_by_topology++;
    return QMAT_OK;
  }
  bool exceeded = false;
  s->needed[edge] = bound ? needed : INFINITY;
  const bool fits = s->fitting && !bound;
  for (int i = 0; !fits && i < c.count && status == QMAT_OK && *result != QMAT_COLLAPSE_ALLOWED; i++) {
    memcpy(sphere, c.spheres[i], sizeof c.spheres[i]);
    const size_t refused = s->counts.refused_by_surface_to_envelope;
    status = qmat_decimation_test_sphere(s, sphere, s->failed_points[edge], result, &needed);
    if (s->counts.refused_by_surface_to_envelope > refused) s->failed_points[edge] = s->surface_tracker.failed_point;
    if (*result == QMAT_COLLAPSE_EXCEEDS) s->needed[edge] = fmin(s->needed[edge], needed);
    exceeded |= *result == QMAT_COLLAPSE_EXCEEDS;
  }
  if (status == QMAT_OK && fits) {
    status = qmat_decimation_try_fitted(s, edge, &c, sphere, result);
    if (s->rules.neighbourhoods && status == QMAT_OK && *result != QMAT_COLLAPSE_ALLOWED) {
      status = qmat_decimation_try_neighbourhoods(s, edge, result);
      memcpy(sphere, s->neighbourhood.spheres[0], sizeof s->neighbourhood.spheres[0]);
    }
  }
  if (exceeded && *result != QMAT_COLLAPSE_ALLOWED) *result = QMAT_COLLAPSE_EXCEEDS;
  return status;
}
