/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/starts.h"

#include <math.h>

#include "core/geometry/medial_build.h"
#include "core/side_by_side.h"
#include "nodes/initial/crease_spheres.h"

typedef struct all_starts {
  const qmat_simplification *prepared;
  const qmat_simplify_params *params;
  size_t rule_count;  /* 2 where creases are not kept and kept */
  qmat_medial *bare;  /* the initial medial mesh without features, where creases are not kept */
  size_t fewest_kept; /* spheres of a result that keeps creases, had they no ends */
  qmat_simplified *results;
  _Atomic size_t
      *free_counts; /* per seed: the spheres without kept creases, SIZE_MAX beyond epsilon; 0: not known yet */
  size_t *left_out; /* the starts that run last */
  _Atomic size_t done;
} all_starts;

/* Whether a choice is left to make: the spheres of sheets have radius 0 too, and are no features. */
static bool chooses_features(const qmat_simplification *s, const qmat_simplify_params *params) {
  if (params->features != QMAT_FEATURES_AUTO) return false;
  for (size_t v = s->initial->sheet_sphere_count; v < s->initial->sphere_count; v++)
    if (s->state.spheres[4 * v + 3] == 0) return true;
  return false;
}

/* Makes a copy of a medial mesh without the spheres that medial.features has added. A medial mesh of nothing else stays
 * whole. */
static qmat_status leave_features(qmat_context *context, const qmat_medial *medial, qmat_medial **bare) {
  qmat_medial *copy = *bare = qmat_medial_copy(medial);
  uint32_t *ids = qmat_arena_alloc(&context->arena, medial->sphere_count, sizeof *ids);
  if (!copy || !ids) return qmat_fail_memory(context, "the initial medial mesh");
  const size_t count = qmat_medial_count_without_creases(copy);
  if (count > 0) copy->sphere_count = count;
  if (copy->region_offset_count > 0) {
    copy->region_offset_count = copy->sphere_count + 1;
    copy->region_sample_count = copy->region_offsets[copy->sphere_count];
  }
  for (uint32_t v = 0; v < medial->sphere_count; v++) ids[v] = v < copy->sphere_count ? v : QMAT_NONE;
  copy->edge_count = qmat_medial_renumber(copy->edges, copy->edge_count, 2, ids, copy->edges);
  copy->triangle_count = qmat_medial_renumber(copy->triangles, copy->triangle_count, 3, ids, copy->triangles);
  return QMAT_OK;
}

/* Corners, where several creases meet, stay where creases are kept, and another sphere fills the interior. The ends of
 * a crease stay too, but beside narrow gaps and thin walls creases are in pieces, whose ends say nothing about what the
 * solid needs. */
static qmat_status count_fewest_kept(qmat_context *context, const qmat_simplification *s, size_t *fewest) {
  const qmat_medial *initial = s->initial;
  const double *spheres = s->state.spheres;
  uint32_t *segments = qmat_arena_calloc(&context->arena, initial->sphere_count, sizeof *segments);
  if (!segments) return qmat_fail_memory(context, "starts");
  for (size_t e = 0; e < initial->edge_count; e++) {
    const size_t a = initial->edges[2 * e], b = initial->edges[2 * e + 1];
    if (spheres[4 * a + 3] > 0 || spheres[4 * b + 3] > 0) continue;
    segments[a]++;
    segments[b]++;
  }
  *fewest = 1;
  for (size_t v = initial->sheet_sphere_count; v < initial->sphere_count; v++)
    *fewest += spheres[4 * v + 3] == 0 && segments[v] > 2;
  return QMAT_OK;
}

static bool keeps_creases(const all_starts *all, size_t start) {
  return all->rule_count == 2 && start % 2 == 1;
}

static bool leaves_creases(const all_starts *all, size_t start) {
  return all->rule_count == 2 && start % 2 == 0;
}

/* Whether a start that keeps creases can hardly have fewer spheres than the one with the same seed that does not. */
static bool is_beaten(const all_starts *all, size_t start) {
  if (!keeps_creases(all, start)) return false;
  const size_t count = atomic_load(&all->free_counts[start / 2]);
  return count > 0 && (double)count <= qmat_least_kept * (double)all->fewest_kept;
}

/* Runs a start. `is_needed`: it has a result even where its initial medial mesh is not within epsilon. */
static qmat_status run_start(all_starts *all, qmat_context *own, size_t start, bool is_needed) {
  qmat_simplification s = *all->prepared;
  qmat_simplified *result = &all->results[start];
  s.context = own;
  s.params = *all->params;
  s.seed = start / all->rule_count;
  if (keeps_creases(all, start)) {
    s.params.features = QMAT_FEATURES_SHARP;
    s.rival_count = &all->free_counts[start / 2];
  }
  if (leaves_creases(all, start)) {
    s.params.features = QMAT_FEATURES_NONE;
    s.initial = all->bare;
  }
  s.may_end_without_result = !is_needed;
  const qmat_status status = qmat_simplification_run(&s, result);
  s.surface = NULL; /* the caller's */
  qmat_simplification_uninit(&s);
  return status;
}

/* Starts with the same seed follow each other, creases kept last. */
static qmat_status run_first(void *user, qmat_context *own, size_t start) {
  all_starts *all = user;
  qmat_status status = QMAT_OK;
  if (!is_beaten(all, start)) {
    const bool is_free = leaves_creases(all, start);
    const qmat_simplified *result = &all->results[start];
    status = run_start(all, own, start, !is_free);
    if (status == QMAT_OK && is_free)
      atomic_store(&all->free_counts[start / 2],
                   result->within_epsilon && result->has_right_topology ? result->medial->sphere_count : SIZE_MAX);
  }
  atomic_fetch_add(&all->done, 1);
  return status;
}

/* The starts without kept creases that ended without a result, although those that keep creases have many spheres. */
static size_t find_left_out(const all_starts *all, size_t count, size_t *left_out) {
  size_t found = 0;
  for (size_t i = 0; i + 1 < count && all->rule_count == 2; i += 2) {
    const qmat_simplified *kept = &all->results[i + 1];
    const bool is_good = kept->within_epsilon && kept->has_right_topology &&
                         (double)kept->medial->sphere_count <= qmat_few_kept * (double)all->fewest_kept;
    if (!all->results[i].medial && !is_good) left_out[found++] = i;
  }
  return found;
}

static qmat_status run_left_out(void *user, qmat_context *own, size_t i) {
  all_starts *all = user;
  const qmat_status status = run_start(all, own, all->left_out[i], true);
  atomic_fetch_add(&all->done, 1);
  return status;
}

/* A single start uses all threads by itself. */
static qmat_status run_alone(qmat_context *context, all_starts *all) {
  const qmat_arena aside = qmat_arena_set_aside(&context->arena);
  const qmat_status status = run_first(all, context, 0);
  qmat_arena_put_back(&context->arena, aside);
  return status;
}

qmat_status qmat_simplification_run_starts(const qmat_simplification *prepared, const qmat_simplify_params *params,
                                           qmat_simplified *best) {
  qmat_context *context = prepared->context;
  all_starts all = {.prepared = prepared, .params = params, .rule_count = chooses_features(prepared, params) ? 2 : 1};
  const size_t count = (size_t)params->effort * all.rule_count;
  const size_t total = all.rule_count == 2 ? count + count / 2 : count; /* with those that may be left out at first */
  *best = (qmat_simplified){.fault = INFINITY};
  all.results = qmat_arena_alloc(&context->arena, count, sizeof *all.results);
  all.free_counts = qmat_arena_calloc(&context->arena, count, sizeof *all.free_counts);
  all.left_out = qmat_arena_alloc(&context->arena, count, sizeof *all.left_out);
  if (!all.results || !all.free_counts || !all.left_out) return qmat_fail_memory(context, "starts");
  for (size_t i = 0; i < count; i++) all.results[i] = *best;
  qmat_status status = QMAT_OK;
  if (all.rule_count == 2) {
    status = count_fewest_kept(context, prepared, &all.fewest_kept);
    if (status == QMAT_OK) status = leave_features(context, prepared->initial, &all.bare);
  }
  if (status == QMAT_OK)
    status = count == 1 ? run_alone(context, &all)
                        : qmat_run_side_by_side(context, count, run_first, &all, &all.done, total, "starts");
  const size_t left = status == QMAT_OK ? find_left_out(&all, count, all.left_out) : 0;
  if (left > 0) status = qmat_run_side_by_side(context, left, run_left_out, &all, &all.done, total, "starts");
  for (size_t i = 0; i < count; i++) {
    if (status == QMAT_OK && all.results[i].medial && !is_beaten(&all, i) &&
        (!best->medial || qmat_simplified_is_better(&all.results[i], best))) {
      qmat_simplified_uninit(best);
      *best = all.results[i];
    } else {
      qmat_simplified_uninit(&all.results[i]);
    }
  }
  qmat_value_release(all.bare ? &all.bare->base : NULL);
  return status;
}
