/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/decimation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/vector.h"
#include "nodes/simplify/collapse_candidates.h"

/* So many costs are found, or collapses tried, between two calls of the progress function: of the last collapses each
 * looks at thousands of points. */
enum { COSTS_A_REPORT = 256, ATTEMPTS_A_REPORT = 16 };

/* Late protection starts when so few spheres are left (section 3.4, "a later stage"). */
static size_t late_stage(size_t initial) {
  return initial / 50 > 100 ? initial / 50 : 100;
}

/* Whether the collapses are the same for every limit. */
static bool in_order(const qmat_decimation *s) {
  return s->rules.on_exceed != QMAT_EXCEED_SKIP;
}

static bool is_two_sided(const qmat_decimation *s) {
  return s->rules.error == QMAT_ERROR_TWO_SIDED;
}

/* Levels by which what is threshold rises: twelve to each doubling of the finest. Beyond the whole model nothing is
 * threshold. */
enum { LEVELS_TO_A_DOUBLING = 12 };

static double threshold_at(const qmat_decimation *s, int level) {
  const double part = exp2((double)(level % LEVELS_TO_A_DOUBLING) / LEVELS_TO_A_DOUBLING);
  const double error = ldexp(part, level / LEVELS_TO_A_DOUBLING) * s->rules.finest;
  return error <= 1 ? qmat_constraint_share * error : INFINITY;
}

/* Points that the initial medial mesh leaves farther away are kept from getting worse. An interior point that is deeper
 * than what is threshold has to stay inside the envelope, lest it be cavity. */
static void set_threshold(qmat_decimation *s, int level) {
  const qmat_constraint_points *constraints = s->constraints;
  s->level = level;
  s->threshold = threshold_at(s, level);
  for (size_t i = 0; i < constraints->surface_count; i++)
    s->surface_tracker.limits[i] = fmax(s->threshold, constraints->distances[i]);
  for (size_t i = constraints->surface_count; i < constraints->count; i++)
    s->surface_tracker.limits[i] = -constraints->distances[i] > s->threshold ? 0 : INFINITY;
  s->envelope_tracker.limit = is_two_sided(s) ? s->threshold : INFINITY;
}

/* False where the next level is above the limit, or there is none. */
static bool raise_threshold(qmat_decimation *s) {
  if (!(s->threshold < INFINITY) || threshold_at(s, s->level + 1) > s->rules.limit) return false;
  set_threshold(s, s->level + 1);
  return true;
}

static qmat_status find_candidates(qmat_decimation *s, uint32_t edge, qmat_candidates *c) {
  if (s->rules.cost == QMAT_COST_PMAT) {
    qmat_candidates_find_larger(&s->complex, s->quadrics, edge, c);
  } else if (s->rules.cost == QMAT_COST_HAUSDORFF) {
    const qmat_status status = qmat_complex_preview(s->context, &s->complex, edge, &s->collapse);
    if (status != QMAT_OK) return status;
    return qmat_hausdorff_candidates(s->context, &s->surface_tracker, &s->complex, &s->collapse,
                                     s->constraints->surface_count, c);
  } else if (s->rules.published) {
    qmat_candidates_find_published(&s->complex, s->quadrics, edge, c);
  } else {
    qmat_candidates_find(&s->complex, s->quadrics, edge, c);
  }
  return QMAT_OK;
}

/* What an edge at sharp features may collapse to, whatever is threshold; where there is nothing the candidates stay. */
static void prefer_features(const qmat_decimation *s, uint32_t edge, qmat_candidates *c) {
  qmat_candidates allowed;
  double needed;
  if (s->rules.cost == QMAT_COST_SLAB &&
      qmat_crease_guard_restrict(&s->creases, &s->complex, s->quadrics, edge, INFINITY, &allowed, &needed) &&
      allowed.count > 0)
    *c = allowed;
}

/* The cost of the best candidate. */
static qmat_status set_cost(qmat_decimation *s, uint32_t edge) {
  qmat_candidates c;
  const qmat_status status = find_candidates(s, edge, &c);
  if (status != QMAT_OK) return status;
  prefer_features(s, edge, &c);
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const double *a = &s->complex.spheres[4 * (size_t)ends[0]], *b = &s->complex.spheres[4 * (size_t)ends[1]];
  const bool slab = s->rules.cost == QMAT_COST_SLAB;
  s->heap.errors[edge] = slab ? c.errors[0] : qmat_point_distance(a, b);
  s->heap.costs[edge] = slab                              ? qmat_slab_cost(c.errors[0], s->rules.k, a, b)
                        : s->rules.cost == QMAT_COST_PMAT ? qmat_pmat_cost(a, b)
                                                          : c.errors[0];
  s->stale[edge] = 0;
  return QMAT_OK;
}

static qmat_status fill_heap(qmat_decimation *s) {
  const size_t count = s->complex.edge_count;
  s->failed_points = qmat_arena_alloc(&s->context->arena, count, sizeof *s->failed_points);
  s->stale = qmat_arena_alloc(&s->context->arena, count, sizeof *s->stale);
  s->needed = qmat_arena_alloc(&s->context->arena, count, sizeof *s->needed);
  s->fitted_errors = qmat_arena_calloc(&s->context->arena, count, sizeof *s->fitted_errors);
  s->converged = qmat_arena_calloc(&s->context->arena, s->complex.vertex_count, sizeof *s->converged);
  if (!s->failed_points || !s->stale || !s->needed || !s->fitted_errors || !s->converged)
    return qmat_fail_memory(s->context, "the heap of edges");
  qmat_status status = qmat_edge_heap_init(s->context, &s->heap, &s->complex);
  if (status != QMAT_OK) return status;
  for (size_t e = 0; e < count; e++) {
    s->failed_points[e] = QMAT_NONE;
    s->needed[e] = 0;
  }
  if (s->rules.cost == QMAT_COST_HAUSDORFF) { /* looks at stars, one at a time */
    for (size_t e = 0; e < count && status == QMAT_OK; e++) {
      if (e % COSTS_A_REPORT == 0) status = qmat_progress(s->context, e, count, "costs");
      if (status == QMAT_OK) status = set_cost(s, (uint32_t)e);
    }
  } else {
    const int threads = qmat_threads(s->context);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (size_t e = 0; e < count; e++) set_cost(s, (uint32_t)e);
  }
  qmat_edge_heap_fill(&s->heap, s->locked);
  return status;
}

/* The sample's owner: the corner of its witness with the largest weight. */
static uint32_t owner_of(const qmat_surface_to_envelope *surface_tracker, size_t point) {
  uint32_t best = 0;
  for (uint32_t k = 1; k < 3; k++)
    if (surface_tracker->witnesses[3 * point + k] != QMAT_NONE &&
        surface_tracker->weights[3 * point + k] > surface_tracker->weights[3 * point + best])
      best = k;
  return surface_tracker->witnesses[3 * point + best];
}

/* Room for every collapse, and who answers for the samples before the first. */
static qmat_status start_log(qmat_decimation *s) {
  const size_t most = s->complex.vertex_count, samples = s->constraints->sample_count;
  qmat_arena *arena = &s->context->arena;
  s->log.ends = qmat_arena_alloc(arena, most, 2 * sizeof(uint32_t));
  s->log.merged = qmat_arena_alloc(arena, most, 4 * sizeof(double));
  s->log.errors = qmat_arena_alloc(arena, most, sizeof(double));
  s->log.owners = qmat_arena_alloc(arena, samples, sizeof(uint32_t));
  if (!s->log.ends || !s->log.merged || !s->log.errors || !s->log.owners)
    return qmat_fail_memory(s->context, "the collapses");
  for (size_t i = 0; i < samples; i++) s->log.owners[i] = owner_of(&s->surface_tracker, i);
  return QMAT_OK;
}

qmat_status qmat_decimation_init(qmat_decimation *s, const qmat_constraint_points *constraints, const double *depths) {
  qmat_context *context = s->context;
  const qmat_complex *c = &s->complex;
  s->constraints = constraints;
  s->euler = (int64_t)c->vertex_count - (int64_t)c->edge_count + (int64_t)c->triangle_count;
  double *limits = qmat_arena_alloc(&context->arena, constraints->count, sizeof *limits);
  if (!limits) return qmat_fail_memory(context, "the simplification");
  if (!s->quadrics) {
    s->quadrics = qmat_arena_calloc(&context->arena, c->vertex_count, sizeof *s->quadrics);
    if (!s->quadrics) return qmat_fail_memory(context, "the simplification");
    if (s->rules.published)
      qmat_medial_quadrics_add_published(c, s->quadrics);
    else
      qmat_medial_quadrics_add(c, s->quadrics);
    if (s->rules.features == QMAT_FEATURES_SHARP) {
      const qmat_status status = qmat_crease_guard_init(context, c, &s->creases);
      if (status != QMAT_OK) return status;
    }
  }
  /* A point that the initial medial mesh leaves farther away can only be kept from getting worse. */
  const double limit = s->rules.share * s->rules.limit;
  for (size_t i = 0; i < constraints->count; i++)
    limits[i] = i < constraints->surface_count ? fmax(limit, constraints->distances[i])
                                               : constraints->inner_limits[i - constraints->surface_count];
  qmat_status status =
      qmat_surface_to_envelope_init(context, &s->surface_tracker, constraints->count, constraints->points, limits,
                                    constraints->witnesses, constraints->weights, c->vertex_count);
  if (status == QMAT_OK) status = fill_heap(s);
  if (status != QMAT_OK) return status;
  s->threshold = limit;
  status = qmat_envelope_to_surface_init(context, &s->envelope_tracker, s->surface, c, depths,
                                         !is_two_sided(s) ? INFINITY
                                         : in_order(s)    ? s->rules.finest
                                                          : s->rules.limit);
  if (is_two_sided(s)) s->envelope_tracker.limit = limit;
  if (status != QMAT_OK || !in_order(s)) return status;
  set_threshold(s, 0);
  return start_log(s);
}

void qmat_decimation_uninit(qmat_decimation *s) {
  qmat_collapse_uninit(&s->collapse);
  qmat_sphere_fit_uninit(&s->fit);
  qmat_neighbourhood_fit_uninit(&s->neighbourhood);
  qmat_free(s->saved);
  qmat_surface_to_envelope_uninit(&s->surface_tracker);
  qmat_envelope_to_surface_uninit(&s->envelope_tracker);
  qmat_complex_uninit(&s->complex);
}

/* A loose edge all of whose responsible region is thin: a tubular feature (section 3.4). */
static bool is_tubular(const qmat_decimation *s, uint32_t edge) {
  if (s->complex.edge_triangles[edge]) return false;
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  bool any = false;
  for (int k = 0; k < 2; k++)
    for (uint32_t slot = qmat_surface_to_envelope_first(&s->surface_tracker, ends[k]); slot != QMAT_NONE;
         slot = s->surface_tracker.next[slot]) {
      if (slot / 3 >= s->constraints->sample_count) continue;
      if (!s->rules.thin[slot / 3]) return false;
      any = true;
    }
  return any;
}

static bool is_protected(const qmat_decimation *s, uint32_t vertex) {
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(&s->complex, vertex, &count);
  for (size_t i = 0; i < count; i++)
    if (is_tubular(s, at[i])) return true;
  return false;
}

/* Leaves of the candidates what protection allows: a protected end keeps its sphere. */
static bool apply_protection(const qmat_decimation *s, uint32_t edge, qmat_candidates *c, bool *bound) {
  if (is_tubular(s, edge)) return false;
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const bool first = is_protected(s, ends[0]), second = is_protected(s, ends[1]);
  if (first && second) return false;
  *bound = first || second;
  if (!*bound) return true;
  const qmat_quadric quadric = qmat_merged_quadric(&s->complex, s->quadrics, edge);
  c->count = 0;
  qmat_candidates_add(c, &quadric, &s->complex.spheres[4 * (size_t)ends[second]]);
  return true;
}

/* How the newest preview would change the Euler characteristic, and whether it satisfies the link condition (Attali et
 * al. 2011), which keeps the homotopy type: neighbours that both ends share span a slab with the edge, and the ends
 * span no slab with a common edge. */
static int64_t euler_change(const qmat_collapse *c, bool *link_condition) {
  int64_t shared_neighbours = 0, shared_edges = 0;
  for (size_t n = 0; n < c->neighbour_count; n++)
    shared_neighbours += c->kept_edges[n] != QMAT_NONE && c->removed_edges[n] != QMAT_NONE;
  for (size_t t = 0; t < c->triangle_count; t++)
    shared_edges += c->kept_triangles[t] != QMAT_NONE && c->removed_triangles[t] != QMAT_NONE;
  const int64_t vanishing = (int64_t)c->vanishing_count;
  *link_condition = shared_neighbours == vanishing && shared_edges == 0;
  return shared_neighbours - vanishing - shared_edges;
}

/* A guarded medial mesh's Euler characteristic may be off by one for every so many spheres: tears and voids of the
 * dense initial one come in pairs, which could never close one by one, and the fewer spheres are left the less is
 * forgiven. Sharp features are left however few the others are. */
enum { SPHERES_PER_FAULT = 128 };

static bool keeps_topology(const qmat_decimation *s, int64_t *change) {
  bool link_condition;
  *change = euler_change(&s->collapse, &link_condition);
  if (s->rules.topology == QMAT_TOPOLOGY_PRESERVE) return link_condition;
  if (s->rules.topology == QMAT_TOPOLOGY_FREE || !s->rules.has_target) return true;
  const int64_t before = llabs(s->euler - s->rules.target_euler);
  const int64_t after = llabs(s->euler + *change - s->rules.target_euler);
  return after <= before || after <= (int64_t)(s->complex.live_vertices - s->creases.left) / SPHERES_PER_FAULT;
}

typedef enum { DONE, REFUSED, EXCEEDED } outcome;

/* Why the newest test of a sphere failed. */
typedef enum { BY_NOTHING, BY_SPHERE, BY_MIDPOINT, BY_SURFACE_TO_ENVELOPE, BY_ENVELOPE_TO_SURFACE } refusal;

static bool bounds_envelope(const qmat_decimation *s) {
  return s->threshold < INFINITY && is_two_sided(s);
}

static bool is_inner(const qmat_decimation *s, size_t point) {
  return point >= s->constraints->surface_count;
}

/* Whether the newest preview merges into a sharp feature. */
static bool merges_feature(const qmat_decimation *s) {
  return qmat_crease_guard_is_feature(&s->creases, s->collapse.kept) ||
         qmat_crease_guard_is_feature(&s->creases, s->collapse.removed);
}

/* Whether the merged sphere and its edges lie inside the model; and whether the sphere protrudes no more than it may. A
 * sharp feature lies on the surface.
 */
static outcome test_inside(qmat_decimation *s, const double *sphere) {
  const bool on_surface = merges_feature(s);
  const bool kept =
      qmat_envelope_to_surface_test_sphere(&s->envelope_tracker, &s->complex, &s->collapse, sphere) || on_surface;
  s->refusal = BY_SPHERE;
  const bool inside = s->rules.published || on_surface || s->envelope_tracker.sphere_depth > 0;
  if (!inside || (!kept && s->rules.on_exceed == QMAT_EXCEED_SKIP)) return REFUSED;
  s->refusal = BY_MIDPOINT;
  if (!s->rules.published &&
      !qmat_envelope_to_surface_test_midpoints(&s->envelope_tracker, &s->complex, &s->collapse, sphere))
    return REFUSED;
  return kept || !(sphere[3] - s->envelope_tracker.sphere_depth > s->envelope_tracker.limit) ? DONE : EXCEEDED;
}

/* Whether the newest preview may be done with this sphere: inside the model, and both errors within their limit. Where
 * they exceed it, `*needed` is no more than what would have to be threshold. */
static qmat_status test_sphere(qmat_decimation *s, const double *sphere, uint32_t first, outcome *result,
                               double *needed) {
  bool kept;
  s->surface_tracker.found_count = 0;
  *result = test_inside(s, sphere);
  *needed = sphere[3] - s->envelope_tracker.sphere_depth;
  if (*result != DONE) {
    s->counts.refused_by_inside_test++;
    return QMAT_OK;
  }
  *result = EXCEEDED;
  if (s->threshold < INFINITY) {
    const qmat_status status =
        qmat_surface_to_envelope_test(s->context, &s->surface_tracker, &s->complex, &s->collapse, sphere, first, &kept);
    if (status != QMAT_OK) return status;
    if (!kept) {
      s->counts.refused_by_surface_to_envelope++;
      s->refusal = BY_SURFACE_TO_ENVELOPE;
      *needed = fmax(s->threshold, is_inner(s, s->surface_tracker.failed_point)
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
      s->refusal = BY_ENVELOPE_TO_SURFACE;
      *needed = s->envelope_tracker.failed;
      return QMAT_OK;
    }
  }
  *result = DONE;
  return QMAT_OK;
}

/* The largest error that is recorded: more than the whole model. */
static const double most_error = 2;

static void record(qmat_decimation *s, const double *sphere) {
  const size_t i = s->log.count++;
  s->log.ends[2 * i] = s->collapse.kept;
  s->log.ends[2 * i + 1] = s->collapse.removed;
  memcpy(&s->log.merged[4 * i], sphere, 4 * sizeof *sphere);
  s->log.errors[i] = fmin(s->threshold, most_error);
}

/* Does what the newest preview and the newest test allow. */
static qmat_status commit(qmat_decimation *s, const double *sphere) {
  if (in_order(s)) record(s, sphere);
  if (bounds_envelope(s))
    qmat_envelope_to_surface_commit(&s->envelope_tracker, &s->collapse);
  else
    s->envelope_tracker.depths[s->collapse.kept] = s->envelope_tracker.sphere_depth;
  qmat_surface_to_envelope_commit(&s->surface_tracker, &s->collapse);
  qmat_crease_guard_commit(&s->creases, &s->complex, &s->collapse, sphere);
  return qmat_complex_collapse(s->context, &s->complex, &s->collapse, sphere);
}

/* A fit looks at so many constraint points at most, and at so many when it polishes what is left. */
enum { FITTED_POINTS = 256, FINAL_REFIT_POINTS = 1024 };

/* A sphere whose sampled error is this many times what is threshold is not worth a test. */
static const double test_ratio = 1.1;

/* Where the spheres were fitted before, a fit that starts badly is left sooner, at this share of what is threshold. */
static const double early_exit_share = 0.6;

/* The sphere of least error at the surface among the candidates, fitted to it; where that cannot be, one of those that
 * look good as they are. */
static qmat_status try_fitted(qmat_decimation *s, uint32_t edge, const qmat_candidates *c, double sphere[4],
                              outcome *result) {
  double errors[QMAT_MOST_CANDIDATES], error = INFINITY, needed;
  int least = 0;
  qmat_status status = qmat_sphere_fit_gather(s->context, &s->fit, &s->surface_tracker, &s->collapse,
                                              s->constraints->surface_count, FITTED_POINTS);
  for (int i = 0; i < c->count && status == QMAT_OK; i++) {
    status = qmat_sphere_fit_error(s->context, &s->fit, &s->surface_tracker, &s->complex, &s->collapse, c->spheres[i],
                                   &errors[i]);
    if (errors[i] < errors[least]) least = i;
  }
  memcpy(sphere, c->spheres[least], sizeof c->spheres[least]);
  s->refusal = BY_NOTHING;
  if (status == QMAT_OK)
    status =
        qmat_sphere_fit_run(s->context, &s->fit, &s->surface_tracker, &s->complex, &s->collapse,
                            s->rules.neighbourhoods ? early_exit_share * s->threshold : s->threshold, sphere, &error);
  s->fitted_errors[edge] = error;
  memcpy(s->fitted, sphere, sizeof s->fitted);
  if (status == QMAT_OK && error <= test_ratio * s->threshold)
    status = test_sphere(s, sphere, QMAT_NONE, result, &needed);
  for (int i = 0; i < c->count && status == QMAT_OK && *result != DONE; i++) {
    if (!(errors[i] <= test_ratio * s->threshold)) continue;
    memcpy(sphere, c->spheres[i], sizeof c->spheres[i]);
    status = test_sphere(s, sphere, QMAT_NONE, result, &needed);
  }
  return status;
}

typedef struct qmat_neighbourhood_state {
  double *at, value;
} neighbourhood_state;

static qmat_status save(qmat_decimation *s, double *values, size_t count) {
  if (qmat_grow((void **)&s->saved, &s->saved_capacity, s->saved_count + count, sizeof *s->saved))
    return qmat_fail_memory(s->context, "a patch");
  for (size_t i = 0; i < count; i++) s->saved[s->saved_count++] = (neighbourhood_state){&values[i], values[i]};
  return QMAT_OK;
}

/* Remembers a sphere and the bounds of what hangs on it. */
static qmat_status save_star(qmat_decimation *s, uint32_t vertex) {
  qmat_status status = save(s, &s->complex.spheres[4 * (size_t)vertex], 4);
  if (status == QMAT_OK) status = save(s, &s->envelope_tracker.depths[vertex], 1);
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(&s->complex, vertex, &count);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) status = save(s, &s->envelope_tracker.edge_bounds[at[i]], 1);
  at = qmat_complex_triangles_at(&s->complex, vertex, &count);
  for (size_t i = 0; i < count && status == QMAT_OK; i++)
    status = save(s, &s->envelope_tracker.triangle_bounds[at[i]], 1);
  return status;
}

static void restore(qmat_decimation *s) {
  for (size_t i = 0; i < s->saved_count; i++) *s->saved[i].at = s->saved[i].value;
}

/* Moves a sphere whatever is threshold; what is known of its protrusion stays true. */
static qmat_status place(qmat_decimation *s, uint32_t vertex, const double *sphere, bool *inside) {
  qmat_envelope_to_surface *envelope_tracker = &s->envelope_tracker;
  const double limit = envelope_tracker->limit;
  bool kept;
  qmat_status status = qmat_complex_preview_move(s->context, &s->complex, vertex, &s->collapse);
  if (status != QMAT_OK) return status;
  envelope_tracker->limit = INFINITY;
  *inside = qmat_envelope_to_surface_test_sphere(envelope_tracker, &s->complex, &s->collapse, sphere);
  if (*inside) {
    status = qmat_envelope_to_surface_test(s->context, envelope_tracker, &s->complex, &s->collapse, sphere, &kept);
    if (status == QMAT_OK) qmat_envelope_to_surface_commit(envelope_tracker, &s->collapse);
  }
  envelope_tracker->limit = limit;
  if (status == QMAT_OK && *inside) status = qmat_complex_collapse(s->context, &s->complex, &s->collapse, sphere);
  return status;
}

/* What has been refused is needed for with this share of what is threshold to spare. */
static const double margin = 0.02;

/* Asks for what the newest test has refused. */
static qmat_status add_refused_target(qmat_decimation *s, const double *sphere, bool *needed) {
  const double *centre = s->refusal == BY_SPHERE ? sphere : s->envelope_tracker.failed_place;
  *needed = true;
  if (s->refusal == BY_SURFACE_TO_ENVELOPE) {
    const size_t point = s->surface_tracker.failed_point;
    return qmat_neighbourhood_fit_add(s->context, &s->neighbourhood, &s->surface_tracker.points[3 * point],
                                      is_inner(s, point) ? QMAT_TARGET_INSIDE : QMAT_TARGET_SURFACE,
                                      s->surface_tracker.limits[point] - margin * s->threshold);
  }
  double closest[3];
  uint32_t triangle;
  *needed = s->refusal != BY_MIDPOINT && qmat_surface_inside(s->surface, centre);
  if (!*needed) return QMAT_OK;
  qmat_surface_distance(s->surface, centre, INFINITY, closest, &triangle);
  return qmat_neighbourhood_fit_add(s->context, &s->neighbourhood, closest, QMAT_TARGET_BORDER,
                                    (1 - margin) * s->threshold);
}

/* Tests a sphere of the patch, which is placed; number 0 is the collapse's. */
static qmat_status test_in_neighbourhood(qmat_decimation *s, uint32_t edge, int number, outcome *result) {
  double needed;
  const qmat_status status =
      number == 0 ? qmat_complex_preview(s->context, &s->complex, edge, &s->collapse)
                  : qmat_complex_preview_move(s->context, &s->complex, s->neighbourhood.vertices[number], &s->collapse);
  return status == QMAT_OK ? test_sphere(s, s->neighbourhood.spheres[number], QMAT_NONE, result, &needed) : status;
}

/* Tests the spheres of the patch: `*last_refused` first, which becomes the one that is refused, and the collapse last,
 * which is then the newest preview. */
static qmat_status test_neighbourhood(qmat_decimation *s, uint32_t edge, uint32_t removed, int *last_refused,
                                      outcome *result, bool *again) {
  qmat_neighbourhood_fit *neighbourhood = &s->neighbourhood;
  bool inside = true;
  qmat_status status = QMAT_OK;
  *result = REFUSED;
  *again = false;
  for (int i = -1; i < neighbourhood->count && status == QMAT_OK; i++) {
    status = place(s, i < 0 ? removed : neighbourhood->vertices[i], neighbourhood->spheres[i < 0 ? 0 : i], &inside);
    if (!inside) return status;
  }
  const int first = *last_refused;
  for (int i = 0; i <= neighbourhood->count && status == QMAT_OK; i++) {
    const int number = i == 0 ? first : i % neighbourhood->count;
    if (i > 0 && number == first && (number > 0 || neighbourhood->count == 1)) continue;
    status = test_in_neighbourhood(s, edge, number, result);
    if (status != QMAT_OK || *result == DONE) continue;
    *last_refused = number;
    return add_refused_target(s, neighbourhood->spheres[number], again);
  }
  return status;
}

/* At most so often what a test refuses is needed for and the patch fitted again. */
enum { MOST_FITS = 6 };

/* Up to this error (of its own fit) a sphere is worth a fit of the patch, and up to that error a fit of the patch is
 * worth a test, as shares of what is threshold. */
static const double neighbourhood_ratio = 1.3, placement_ratio = 1.02;

/* The collapse of the newest preview with the sphere around which its own fit ended, and with its neighbours fitted too
 * unless it is left `alone`. Where it can be done they are placed, and it is the newest preview and test; else nothing
 * has changed. */
static qmat_status try_neighbourhood(qmat_decimation *s, uint32_t edge, bool alone, outcome *result) {
  const qmat_collapse *c = &s->collapse;
  uint32_t others[QMAT_NEIGHBOURHOOD_SPHERES];
  const uint32_t removed = c->removed;
  size_t count = 0;
  for (size_t n = 0; !alone && n < c->neighbour_count && count < QMAT_NEIGHBOURHOOD_SPHERES; n++)
    if (!qmat_crease_guard_is_feature(&s->creases, c->neighbours[n]) &&
        !(s->protecting && is_protected(s, c->neighbours[n])))
      others[count++] = c->neighbours[n];
  qmat_status status =
      qmat_neighbourhood_fit_start(s->context, &s->neighbourhood, &s->surface_tracker, &s->complex, c, s->fitted,
                                   others, count, s->constraints->surface_count, s->threshold);
  bool again = true;
  int last_refused = 0;
  for (int i = 0; i < MOST_FITS && again && status == QMAT_OK && *result != DONE; i++) {
    double error;
    qmat_neighbourhood_fit_run(&s->neighbourhood, &s->complex, i % 2 == 1, &error);
    if (!(error <= placement_ratio * s->threshold)) return status;
    s->saved_count = 0;
    status = save_star(s, removed);
    for (int k = 0; k < s->neighbourhood.count && status == QMAT_OK; k++)
      status = save_star(s, s->neighbourhood.vertices[k]);
    if (status == QMAT_OK) status = test_neighbourhood(s, edge, removed, &last_refused, result, &again);
    if (status == QMAT_OK && *result == DONE) return status;
    restore(s);
    if (status == QMAT_OK) status = qmat_complex_preview(s->context, &s->complex, edge, &s->collapse);
  }
  return status;
}

/* A cone that leaves the solid in its middle does so wherever the spheres move that little. */
static qmat_status try_neighbourhoods(qmat_decimation *s, uint32_t edge, outcome *result) {
  qmat_status status = QMAT_OK;
  if (s->refusal == BY_MIDPOINT) return status;
  if (s->fitted_errors[edge] <= test_ratio * s->threshold) status = try_neighbourhood(s, edge, true, result);
  if (status == QMAT_OK && *result != DONE && s->fitted_errors[edge] <= neighbourhood_ratio * s->threshold)
    status = try_neighbourhood(s, edge, false, result);
  return status;
}

/* The best candidate that stays inside the model and keeps both errors; then the collapse itself. */
static qmat_status try_collapse(qmat_decimation *s, uint32_t edge, outcome *result) {
  qmat_candidates c;
  *result = REFUSED;
  s->neighbourhood.count = 0; /* that of an edge tried before is none of this one's */
  qmat_status status = find_candidates(s, edge, &c);
  if (status != QMAT_OK) return status;
  double needed;
  const double share = s->rules.crease_share;
  bool bound =
      qmat_crease_guard_restrict(&s->creases, &s->complex, s->quadrics, edge, share * s->threshold, &c, &needed);
  needed /= share;
  if (bound && c.count == 0) {
    s->counts.refused_by_protection++;
    s->needed[edge] = needed;
    if (needed < INFINITY) *result = EXCEEDED;
    return QMAT_OK;
  }
  if (!bound && s->protecting && !apply_protection(s, edge, &c, &bound)) {
    s->counts.refused_by_protection++;
    return QMAT_OK;
  }
  status = qmat_complex_preview(s->context, &s->complex, edge, &s->collapse);
  if (status != QMAT_OK) return status;
  int64_t change;
  if (!keeps_topology(s, &change)) {
    s->counts.refused_by_topology++;
    return QMAT_OK;
  }
  bool exceeded = false;
  s->needed[edge] = bound ? needed : INFINITY;
  const double *sphere = NULL;
  const bool fits = s->fitting && !bound;
  for (int i = 0; !fits && i < c.count && status == QMAT_OK && *result != DONE; i++) {
    sphere = c.spheres[i];
    const size_t refused = s->counts.refused_by_surface_to_envelope;
    status = test_sphere(s, sphere, s->failed_points[edge], result, &needed);
    if (s->counts.refused_by_surface_to_envelope > refused) s->failed_points[edge] = s->surface_tracker.failed_point;
    if (*result == EXCEEDED) s->needed[edge] = fmin(s->needed[edge], needed);
    exceeded |= *result == EXCEEDED;
  }
  double fitted[4];
  if (status == QMAT_OK && fits) {
    status = try_fitted(s, edge, &c, fitted, result);
    sphere = fitted;
    if (s->rules.neighbourhoods && status == QMAT_OK && *result != DONE) {
      status = try_neighbourhoods(s, edge, result);
      sphere = s->neighbourhood.spheres[0];
    }
  }
  if (status == QMAT_OK && *result == DONE) {
    s->euler += change;
    return commit(s, sphere);
  }
  if (exceeded) *result = EXCEEDED;
  return status;
}

/* An edge whose fitted sphere had this many times the error that is threshold is not tried again for a sphere nearby
 * that moves, only for one that goes. */
static const double retry_ratio = 2;

static bool is_locked(const qmat_decimation *s, uint32_t edge) {
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  return s->locked && (s->locked[ends[0]] || s->locked[ends[1]]);
}

static void queue_again(qmat_decimation *s, uint32_t edge) {
  if (s->heap.places[edge] != QMAT_NONE || is_locked(s, edge)) return;
  if (s->collapse.removed == QMAT_NONE && s->fitted_errors[edge] > retry_ratio * s->threshold) return;
  qmat_edge_heap_update(&s->heap, edge);
}

/* New costs around the merged vertex, and another chance for the refused edges of its neighbours. */
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
  if (!s->fitting) return; /* all get another chance then */
  for (size_t n = 0; n < c->neighbour_count; n++) {
    s->converged[c->neighbours[n]] = 0;
    at = qmat_complex_edges_at(&s->complex, c->neighbours[n], &count);
    for (size_t i = 0; i < count; i++) queue_again(s, at[i]);
  }
}

static bool may_continue(const qmat_decimation *s) {
  const size_t live = s->complex.live_vertices;
  return live > 1 && !(s->rules.vertices > 0 && live <= s->rules.vertices);
}

static qmat_status report_progress(const qmat_decimation *s) {
  const size_t initial = s->complex.vertex_count;
  return qmat_progress(s->context, initial - s->complex.live_vertices, initial, "collapses");
}

/* Takes over what a test finds of a sphere of the patch that has been placed. */
static qmat_status commit_placed(qmat_decimation *s, uint32_t vertex) {
  double sphere[4], needed;
  outcome result;
  memcpy(sphere, &s->complex.spheres[4 * (size_t)vertex], sizeof sphere);
  qmat_status status = qmat_complex_preview_move(s->context, &s->complex, vertex, &s->collapse);
  if (status == QMAT_OK) status = test_sphere(s, sphere, QMAT_NONE, &result, &needed);
  if (status != QMAT_OK || result != DONE) return status;
  status = commit(s, sphere);
  update_neighbourhood(s);
  return status;
}

/* Collapses until the heap is empty; `*ended` when the rules want no more. */
static qmat_status collapse_edges(qmat_decimation *s, bool *ended) {
  const size_t initial = s->complex.vertex_count;
  for (size_t attempts = 0; s->heap.count > 0 && !*ended; attempts++) {
    qmat_status status = s->rules.neighbourhoods || attempts % ATTEMPTS_A_REPORT == 0 ? report_progress(s) : QMAT_OK;
    if (status != QMAT_OK) return status;
    const uint32_t edge = qmat_edge_heap_first(&s->heap);
    if (s->stale[edge]) {
      if ((status = set_cost(s, edge)) != QMAT_OK) return status;
      qmat_edge_heap_update(&s->heap, edge);
      continue;
    }
    *ended = !may_continue(s) || (s->rules.most_cost > 0 && s->heap.costs[edge] > s->rules.most_cost);
    if (*ended) return QMAT_OK;
    s->protecting = s->rules.protect == QMAT_PROTECT_ALWAYS ||
                    (s->rules.protect == QMAT_PROTECT_LATE && s->complex.live_vertices <= late_stage(initial));
    qmat_edge_heap_remove(&s->heap, edge);
    outcome result;
    status = try_collapse(s, edge, &result);
    if (status != QMAT_OK) return status;
    if (result == DONE) {
      s->counts.collapses++;
      update_neighbourhood(s);
      for (int i = 1; i < s->neighbourhood.count && status == QMAT_OK; i++)
        status = commit_placed(s, s->neighbourhood.vertices[i]);
      if (status != QMAT_OK) return status;
    } else if (result == EXCEEDED && s->rules.on_exceed == QMAT_EXCEED_STOP) {
      *ended = !raise_threshold(s);
      qmat_edge_heap_update(&s->heap, edge);
    }
  }
  return QMAT_OK;
}

/* A move has to gain at least this share of the error. */
static const double least_gain = 0.02;

/* Fits every sphere to the surface where that lowers its largest error; not those that did not move and whose
 * neighbours have not moved since. Each looks at `most` constraint points. */
static qmat_status refit(qmat_decimation *s, size_t most, size_t *moved) {
  *moved = 0;
  for (uint32_t v = 0; v < s->complex.vertex_count; v++) {
    if (!s->complex.vertex_alive[v] || s->converged[v] || (s->protecting && is_protected(s, v)) ||
        qmat_crease_guard_is_feature(&s->creases, v))
      continue;
    s->converged[v] = 1;
    qmat_status status = report_progress(s);
    if (status == QMAT_OK) status = qmat_complex_preview_move(s->context, &s->complex, v, &s->collapse);
    if (status == QMAT_OK)
      status = qmat_sphere_fit_gather(s->context, &s->fit, &s->surface_tracker, &s->collapse,
                                      s->constraints->surface_count, most);
    double sphere[4], before, after;
    memcpy(sphere, &s->complex.spheres[4 * (size_t)v], sizeof sphere);
    if (status == QMAT_OK)
      status =
          qmat_sphere_fit_error(s->context, &s->fit, &s->surface_tracker, &s->complex, &s->collapse, sphere, &before);
    if (status == QMAT_OK)
      status = qmat_sphere_fit_run(s->context, &s->fit, &s->surface_tracker, &s->complex, &s->collapse, INFINITY,
                                   sphere, &after);
    if (status != QMAT_OK) return status;
    if (!(after <= (1 - least_gain) * before)) continue;
    outcome result;
    double needed;
    status = test_sphere(s, sphere, QMAT_NONE, &result, &needed);
    if (status == QMAT_OK && result == DONE) {
      status = commit(s, sphere);
      update_neighbourhood(s);
      ++*moved;
    }
    if (status != QMAT_OK) return status;
  }
  s->moves += *moved;
  return QMAT_OK;
}

static void queue_all(qmat_decimation *s) {
  for (uint32_t e = 0; e < s->complex.edge_count; e++)
    if (s->complex.edge_alive[e] && s->heap.places[e] == QMAT_NONE) qmat_edge_heap_update(&s->heap, e);
}

/* The edges that may collapse with what is threshold now. */
static void queue_raised(qmat_decimation *s) {
  for (uint32_t e = 0; e < s->complex.edge_count; e++)
    if (s->complex.edge_alive[e] && s->heap.places[e] == QMAT_NONE && s->needed[e] <= s->threshold)
      qmat_edge_heap_update(&s->heap, e);
}

qmat_status qmat_decimation_run(qmat_decimation *s) {
  bool ended = s->threshold > s->rules.limit; /* where even the lowest level is above it */
  qmat_status status = s->rules.neighbourhoods ? QMAT_OK : collapse_edges(s, &ended);
  while (s->rules.on_exceed == QMAT_EXCEED_RAISE && status == QMAT_OK && !ended && s->complex.live_edges > 0 &&
         raise_threshold(s)) {
    queue_raised(s);
    status = collapse_edges(s, &ended);
  }
  if (status != QMAT_OK || ended || in_order(s) || !(s->rules.limit < INFINITY)) return status;
  for (int i = 0; i < s->rules.refits && !ended; i++) {
    const size_t collapses = s->counts.collapses;
    size_t moved;
    s->fitting = true;
    if (i == 0) queue_all(s);
    status = collapse_edges(s, &ended);
    if (status != QMAT_OK || ended) return status;
    if ((i > 0 || s->rules.neighbourhoods) && s->counts.collapses == collapses) break;
    if ((status = refit(s, FITTED_POINTS, &moved)) != QMAT_OK) return status;
  }
  /* What is left of the error is made small for its own sake. */
  size_t moved = s->rules.final_refit;
  for (int i = 0; i < s->rules.refits && moved > 0 && status == QMAT_OK; i++)
    status = refit(s, FINAL_REFIT_POINTS, &moved);
  return status;
}

/* Where collapses come in order the merged sphere inherits the regions of both ends (section 3.3): who answers does not
 * depend on the limits that were tested. */
static qmat_status set_regions(const qmat_decimation *s, const uint32_t *ids, qmat_medial *medial) {
  const size_t samples = s->constraints->sample_count;
  uint32_t *owners = qmat_arena_alloc(&s->context->arena, samples, sizeof *owners);
  uint32_t *roots = qmat_arena_alloc(&s->context->arena, s->complex.vertex_count, sizeof *roots);
  if (!owners || !roots) return qmat_fail_memory(s->context, "responsible regions");
  if (in_order(s)) qmat_collapse_roots(s->log.ends, s->log.count, s->complex.vertex_count, roots);
  for (size_t i = 0; i < samples; i++) {
    uint32_t owner = in_order(s) ? s->log.owners[i] : owner_of(&s->surface_tracker, i);
    if (in_order(s) && owner != QMAT_NONE) owner = roots[owner];
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
  medial->spheres = qmat_alloc(c->live_vertices, 4 * sizeof(double));
  if (!ids || !edges || !triangles || !medial->spheres) return qmat_fail_memory(s->context, "the medial mesh");
  uint32_t next = 0;
  for (size_t v = 0; v < c->vertex_count; v++) {
    ids[v] = QMAT_NONE;
    if (!c->vertex_alive[v]) continue;
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

/* The bounds of the protrusion of edges and triangles, where they say more than their corners do. */
static void carry_bounds(const qmat_decimation *from, const uint32_t *ids, qmat_decimation *to) {
  for (size_t e = 0; e < from->complex.edge_count; e++) {
    if (!from->complex.edge_alive[e]) continue;
    const uint32_t *ends = &from->complex.edges[2 * e];
    qmat_envelope_to_surface_bound_edge(&to->envelope_tracker, &to->complex, ids[ends[0]], ids[ends[1]],
                                        from->envelope_tracker.edge_bounds[e]);
  }
  for (size_t t = 0; t < from->complex.triangle_count; t++) {
    if (!from->complex.triangle_alive[t]) continue;
    const uint32_t *corners = &from->complex.triangles[3 * t];
    qmat_envelope_to_surface_bound_triangle(&to->envelope_tracker, &to->complex, ids[corners[0]], ids[corners[1]],
                                            ids[corners[2]], from->envelope_tracker.triangle_bounds[t]);
  }
}

qmat_status qmat_decimation_resume(const qmat_decimation *from, const qmat_medial *left, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints, qmat_decimation *to) {
  qmat_context *context = from->context;
  qmat_arena *arena = &context->arena;
  const qmat_complex *c = &from->complex;
  uint32_t *ids = qmat_arena_alloc(arena, c->vertex_count, sizeof *ids);
  double *depths = qmat_arena_alloc(arena, left->sphere_count, sizeof *depths);
  to->quadrics = qmat_arena_calloc(arena, left->sphere_count, sizeof *to->quadrics);
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
  if (status == QMAT_OK) status = qmat_decimation_init(to, constraints, depths);
  if (status != QMAT_OK) return status;
  carry_bounds(from, ids, to);
  to->counts = from->counts;
  return QMAT_OK;
}
