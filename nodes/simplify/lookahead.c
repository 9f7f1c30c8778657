/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/lookahead.h"

#include <string.h>

#include "nodes/simplify/fitted_collapse.h"

/* Attempts take different times: with several for each copy, none waits long. Their number doubles with each turn that
 * allows none. */
enum { ATTEMPTS_A_COPY = 4 };

static void clear(qmat_attempts *turn) {
  atomic_store(&turn->next, 0);
  atomic_store(&turn->first_allowed, QMAT_MOST_AHEAD);
  atomic_store(&turn->failed, false);
}

void qmat_lookahead_init(qmat_lookahead *lookahead, int copies) {
  lookahead->copies = copies;
  for (int i = 0; i < 3; i++) clear(&lookahead->turns[i]);
}

static qmat_attempts *turn_of(const qmat_copy *copy) {
  return &copy->shared->turns[copy->meeting % 3];
}

qmat_status qmat_copy_meet(qmat_copy *copy, qmat_status own) {
  qmat_attempts *turn = turn_of(copy);
  if (own != QMAT_OK) atomic_store(&turn->failed, true);
  copy->meeting++;
  if (copy->number == 0) clear(turn_of(copy)); /* nobody has used it since two meetings ago */
#pragma omp barrier
  const qmat_status status = own != QMAT_OK ? own : atomic_load(&turn->failed) ? QMAT_CANCELLED : QMAT_OK;
  copy->has_left = status != QMAT_OK;
  return status;
}

void qmat_copy_note(qmat_copy *copy, bool allowed) {
  const int first = ATTEMPTS_A_COPY * copy->shared->copies;
  const int next = allowed ? 0 : copy->ahead == 0 ? first : 2 * copy->ahead;
  copy->ahead = next < QMAT_MOST_AHEAD ? next : QMAT_MOST_AHEAD;
}

/* The edges to try, and the costs that were brought up to date to find them. */
typedef struct next_edges {
  uint32_t edges[QMAT_MOST_AHEAD], stale[QMAT_MOST_AHEAD];
  double costs[QMAT_MOST_AHEAD], errors[QMAT_MOST_AHEAD]; /* of the stale edges, before */
  int before[QMAT_MOST_AHEAD];                            /* the edges that come before each stale one */
  int count, stale_count;
} next_edges;

/* Removes the next edges from the heap as long as each would be the next to try after a refusal. */
static qmat_status take_edges(qmat_decimation *s, next_edges *n) {
  while (n->count < s->copy->ahead && s->heap.count > 0) {
    const uint32_t edge = qmat_edge_heap_first(&s->heap);
    if (s->stale[edge]) {
      if (n->stale_count == QMAT_MOST_AHEAD) return QMAT_OK;
      const int i = n->stale_count++;
      n->stale[i] = edge;
      n->costs[i] = s->heap.costs[edge];
      n->errors[i] = s->heap.errors[edge];
      n->before[i] = n->count;
      const qmat_status status = qmat_decimation_set_cost(s, edge);
      if (status != QMAT_OK) return status;
      qmat_edge_heap_update(&s->heap, edge);
      continue;
    }
    if (s->rules.most_cost > 0 && s->heap.costs[edge] > s->rules.most_cost) return QMAT_OK;
    qmat_edge_heap_remove(&s->heap, edge);
    n->edges[n->count++] = edge;
  }
  return QMAT_OK;
}

/* Puts back what comes after an edge that is allowed, the newest change first. */
static void put_back(qmat_decimation *s, const next_edges *n, int allowed) {
  for (int i = allowed + 1; i < n->count; i++) qmat_edge_heap_update(&s->heap, n->edges[i]);
  for (int i = n->stale_count - 1; i >= 0 && n->before[i] > allowed; i--) {
    const uint32_t edge = n->stale[i];
    s->heap.costs[edge] = n->costs[i];
    s->heap.errors[edge] = n->errors[i];
    s->stale[edge] = 1;
    qmat_edge_heap_update(&s->heap, edge);
  }
}

/* Learns the outcome of an attempt that any copy has made. */
static void learn(qmat_decimation *s, uint32_t edge, const qmat_attempt *a) {
  const qmat_collapse_counts *refusals = &a->refusals;
  qmat_collapse_counts *counts = &s->counts;
  s->failed_points[edge] = a->failed_point;
  s->needed[edge] = a->needed;
  s->fitted_errors[edge] = a->fitted_error;
  counts->refused_by_inside_test += refusals->refused_by_inside_test;
  counts->refused_by_surface_to_envelope += refusals->refused_by_surface_to_envelope;
  counts->refused_by_envelope_to_surface += refusals->refused_by_envelope_to_surface;
  counts->refused_by_protection += refusals->refused_by_protection;
  counts->refused_by_topology += refusals->refused_by_topology;
}

/* Attempts a collapse and leaves everything as it was. */
static qmat_status try_ahead(qmat_decimation *s, uint32_t edge, qmat_attempt *attempt, bool *allowed) {
  const qmat_collapse_counts counts = s->counts;
  const qmat_attempt before = {
      .failed_point = s->failed_points[edge], .needed = s->needed[edge], .fitted_error = s->fitted_errors[edge]};
  qmat_collapse_outcome result;
  s->counts = (qmat_collapse_counts){0};
  const qmat_status status = qmat_decimation_attempt(s, edge, attempt->sphere, &result);
  *allowed = status == QMAT_OK && result == QMAT_COLLAPSE_ALLOWED;
  attempt->is_alone = s->neighbourhood.count == 0;
  if (*allowed && !attempt->is_alone) qmat_decimation_restore_neighbourhood(s);
  attempt->failed_point = s->failed_points[edge];
  attempt->tested_first = s->tested_first;
  attempt->needed = s->needed[edge];
  attempt->fitted_error = s->fitted_errors[edge];
  attempt->refusals = s->counts;
  s->counts = counts;
  s->failed_points[edge] = before.failed_point;
  s->needed[edge] = before.needed;
  s->fitted_errors[edge] = before.fitted_error;
  return status;
}

/* Makes attempts of this turn until none is left that matters. */
static qmat_status try_edges(qmat_decimation *s, const uint32_t *edges, int count, qmat_attempts *turn) {
  qmat_status status = QMAT_OK;
  for (int i; status == QMAT_OK && (i = atomic_fetch_add(&turn->next, 1)) < count;) {
    int first = atomic_load(&turn->first_allowed);
    if (i > first) break;
    bool allowed;
    status = try_ahead(s, edges[i], &turn->attempts[i], &allowed);
    while (allowed && i < first && !atomic_compare_exchange_weak(&turn->first_allowed, &first, i)) {
    }
  }
  return status;
}

/* Does again what made an attempt allowed. A fit need not be repeated, unless it moved other spheres too. The point
 * that is tested first counts: new witnesses are listed in the order of the tests. */
static qmat_status repeat(qmat_decimation *s, uint32_t edge, const qmat_attempt *a, double sphere[4],
                          qmat_collapse_outcome *result) {
  if (!a->is_alone) return qmat_decimation_attempt(s, edge, sphere, result);
  double needed;
  learn(s, edge, a);
  memcpy(sphere, a->sphere, sizeof a->sphere);
  s->neighbourhood.count = 0;
  const qmat_status status = qmat_complex_preview(s->context, &s->complex, edge, &s->collapse);
  return status == QMAT_OK ? qmat_decimation_test_sphere(s, sphere, a->tested_first, result, &needed) : status;
}

qmat_status qmat_lookahead_next(qmat_decimation *s, uint32_t *edge, double sphere[4], qmat_collapse_outcome *result) {
  next_edges n = {.edges = {*edge}, .count = 1};
  qmat_attempts *turn = turn_of(s->copy);
  qmat_status status = take_edges(s, &n);
  if (status == QMAT_OK) status = try_edges(s, n.edges, n.count, turn);
  status = qmat_copy_meet(s->copy, status);
  if (status != QMAT_OK) return status;
  const int first = atomic_load(&turn->first_allowed);
  for (int i = 0; i < n.count && i < first; i++) learn(s, n.edges[i], &turn->attempts[i]);
  put_back(s, &n, first);
  *result = QMAT_COLLAPSE_REFUSED;
  *edge = first < n.count ? n.edges[first] : QMAT_NONE;
  return first < n.count ? repeat(s, *edge, &turn->attempts[first], sphere, result) : QMAT_OK;
}
