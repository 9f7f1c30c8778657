/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/rising_threshold.h"

#include <math.h>

/* The threshold of a level. It is INFINITY beyond the size of the model. */
static double threshold_at(const qmat_decimation *s, int level) {
  const double part = exp2((double)(level % QMAT_LEVELS_TO_A_DOUBLING) / QMAT_LEVELS_TO_A_DOUBLING);
  const double error = ldexp(part, level / QMAT_LEVELS_TO_A_DOUBLING) * s->rules.finest;
  return error <= 1 ? qmat_constraint_share * error : INFINITY;
}

/* Sets the threshold of a level. Surface points with a larger initial distance must not get worse. Interior points
 * deeper than the threshold must stay covered. */
static void set_threshold(qmat_decimation *s, int level) {
  const qmat_constraint_points *constraints = s->constraints;
  s->level = level;
  s->threshold = threshold_at(s, level);
  for (size_t i = 0; i < constraints->surface_count; i++)
    s->surface_tracker.limits[i] = fmax(s->threshold, constraints->distances[i]);
  for (size_t i = constraints->surface_count; i < constraints->count; i++)
    s->surface_tracker.limits[i] = -constraints->distances[i] > s->threshold ? 0 : INFINITY;
  s->envelope_tracker.limit = qmat_decimation_is_two_sided(s) ? s->threshold : INFINITY;
}

bool qmat_rising_threshold_raise(qmat_decimation *s) {
  if (!(s->threshold < INFINITY) || threshold_at(s, s->level + 1) > s->rules.limit) return false;
  set_threshold(s, s->level + 1);
  return true;
}

qmat_status qmat_rising_threshold_start(qmat_decimation *s) {
  set_threshold(s, 0);
  const size_t most = s->complex.vertex_count, samples = s->constraints->sample_count;
  qmat_arena *arena = &s->context->arena;
  s->log.ends = qmat_arena_alloc(arena, most, 2 * sizeof(uint32_t));
  s->log.merged = qmat_arena_alloc(arena, most, 4 * sizeof(double));
  s->log.errors = qmat_arena_alloc(arena, most, sizeof(double));
  s->log.owners = qmat_arena_alloc(arena, samples, sizeof(uint32_t));
  if (!s->log.ends || !s->log.merged || !s->log.errors || !s->log.owners)
    return qmat_fail_memory(s->context, "the collapses");
  for (size_t i = 0; i < samples; i++)
    s->log.owners[i] = qmat_surface_to_envelope_owner(&s->surface_tracker, qmat_point_of_sample(s->constraints, i));
  return QMAT_OK;
}

void qmat_rising_threshold_queue(qmat_decimation *s) {
  for (uint32_t e = 0; e < s->complex.edge_count; e++)
    if (s->complex.edge_alive[e] && s->heap.places[e] == QMAT_NONE && s->needed[e] <= s->threshold)
      qmat_edge_heap_update(&s->heap, e);
}
