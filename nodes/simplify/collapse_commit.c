/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/collapse_commit.h"

#include <string.h>

#include "nodes/simplify/collapse_test.h"
#include "nodes/simplify/thresholds.h"

static bool is_locked(const qmat_decimation *s, uint32_t edge) {
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  return s->locked && (s->locked[ends[0]] || s->locked[ends[1]]);
}

static void queue_again(qmat_decimation *s, uint32_t edge) {
  if (s->heap.places[edge] != QMAT_NONE || is_locked(s, edge)) return;
  if (s->collapse.removed == QMAT_NONE && s->fitted_errors[edge] > qmat_retry_ratio * s->threshold) return;
  qmat_edge_heap_update(&s->heap, edge);
}

/* Marks the costs around the merged vertex as stale, and queues the refused edges of its neighbours again. */
static void update_neighbourhood(qmat_decimation *s) {
  const qmat_collapse *c = &s->collapse;
  if (c->removed != QMAT_NONE) {
    qmat_quadric_add(&s->quadrics[c->kept], &s->quadrics[c->removed]);
    qmat_edge_heap_remove(&s->heap, c->edge);
  }
  for (size_t n = 0; n < c->neighbour_count; n++)
    if (c->kept_edges[n] != QMAT_NONE && c->removed_edges[n] != QMAT_NONE)
      qmat_edge_heap_remove(&s->heap, c->removed_edges[n]);
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(&s->complex, c->kept, &count);
  for (size_t i = 0; i < count; i++) {
    s->stale[at[i]] = 1;
    queue_again(s, at[i]);
  }
  s->converged[c->kept] = 0;
  if (!s->fitting) return; /* all edges are queued again when the fits start */
  for (size_t n = 0; n < c->neighbour_count; n++) {
    s->converged[c->neighbours[n]] = 0;
    at = qmat_complex_edges_at(&s->complex, c->neighbours[n], &count);
    for (size_t i = 0; i < count; i++) queue_again(s, at[i]);
  }
}

qmat_status qmat_decimation_accept_alone(qmat_decimation *s, const double sphere[4]) {
  const qmat_status status = qmat_decimation_commit(s, sphere);
  if (status == QMAT_OK) update_neighbourhood(s);
  return status;
}

/* Tests and commits a sphere of the neighbourhood that is already in place, to update its bounds and witnesses. */
static qmat_status commit_placed(qmat_decimation *s, uint32_t vertex) {
  double sphere[4], needed;
  qmat_collapse_outcome result;
  memcpy(sphere, &s->complex.spheres[4 * (size_t)vertex], sizeof sphere);
  qmat_status status = qmat_complex_preview_move(s->context, &s->complex, vertex, &s->collapse);
  if (status == QMAT_OK) status = qmat_decimation_test_sphere(s, sphere, QMAT_NONE, &result, &needed);
  if (status != QMAT_OK || result != QMAT_COLLAPSE_ALLOWED) return status;
  return qmat_decimation_accept_alone(s, sphere);
}

qmat_status qmat_decimation_accept(qmat_decimation *s, const double sphere[4]) {
  qmat_status status = qmat_decimation_accept_alone(s, sphere);
  for (int i = 1; i < s->neighbourhood.count && status == QMAT_OK; i++)
    status = commit_placed(s, s->neighbourhood.vertices[i]);
  return status;
}
