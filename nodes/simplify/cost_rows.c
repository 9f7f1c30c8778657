/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/cost_rows.h"

static qmat_status find_slab(qmat_decimation *s, uint32_t edge, qmat_candidates *c) {
  if (qmat_decimation_is_of_sheet(s, s->complex.edges[2 * (size_t)edge]))
    qmat_candidates_find_on_sheet(&s->complex, s->quadrics, edge, c);
  else
    qmat_candidates_find(&s->complex, s->quadrics, edge, c);
  return QMAT_OK;
}

static qmat_status find_published(qmat_decimation *s, uint32_t edge, qmat_candidates *c) {
  qmat_candidates_find_published(&s->complex, s->quadrics, edge, c);
  return QMAT_OK;
}

static qmat_status find_pmat(qmat_decimation *s, uint32_t edge, qmat_candidates *c) {
  qmat_candidates_find_larger(&s->complex, s->quadrics, edge, c);
  return QMAT_OK;
}

static qmat_status find_hem(qmat_decimation *s, uint32_t edge, qmat_candidates *c) {
  const qmat_status status = qmat_complex_preview(s->context, &s->complex, edge, &s->collapse);
  if (status != QMAT_OK) return status;
  return qmat_hausdorff_candidates(s->context, &s->surface_tracker, &s->complex, &s->collapse,
                                   s->constraints->surface_count, c);
}

static double slab_cost(const qmat_decimation *s, const qmat_candidates *c, const double *a, const double *b) {
  return qmat_slab_cost(c->errors[0], s->rules.k, a, b);
}

static double pmat_cost(const qmat_decimation *s, const qmat_candidates *c, const double *a, const double *b) {
  (void)s, (void)c;
  return qmat_pmat_cost(a, b);
}

static double hem_cost(const qmat_decimation *s, const qmat_candidates *c, const double *a, const double *b) {
  (void)s, (void)a, (void)b;
  return c->errors[0];
}

const qmat_cost_row *qmat_cost_row_of(const qmat_decimation_rules *rules) {
  static const qmat_cost_row slab = {find_slab, slab_cost, true, false};
  static const qmat_cost_row published = {find_published, slab_cost, true, false};
  static const qmat_cost_row pmat = {find_pmat, pmat_cost, false, false};
  static const qmat_cost_row hem = {find_hem, hem_cost, false, true};
  switch (rules->cost) {
    case QMAT_COST_HAUSDORFF:
      return &hem;
    case QMAT_COST_PMAT:
      return &pmat;
    default:
      return rules->published ? &published : &slab;
  }
}
