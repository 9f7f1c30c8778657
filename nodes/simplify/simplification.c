/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/simplification.h"

#include <math.h>
#include <string.h>

#include "nodes/measure/envelope_to_surface.h"
#include "nodes/simplify/cavity_filling.h"
#include "nodes/simplify/decimation_resume.h"
#include "nodes/simplify/partitioned_collapse.h"
#include "nodes/simplify/point_repair.h"
#include "nodes/simplify/topology_mending.h"

/* ---- constraint points found on the way ---- */

/* Appends `added` points. */
static qmat_status append(qmat_context *context, const double **points, size_t *count, const double *added,
                          size_t added_count) {
  double *all = qmat_arena_alloc(&context->arena, *count + added_count, 3 * sizeof *all);
  if (!all) return qmat_fail_memory(context, "constraint points");
  if (*count) memcpy(all, *points, 3 * *count * sizeof *all);
  if (added_count) memcpy(all + 3 * *count, added, 3 * added_count * sizeof *all);
  *points = all;
  *count += added_count;
  return QMAT_OK;
}

static qmat_status append_inner(qmat_context *context, const double *added, size_t count, qmat_extra_points *to) {
  return append(context, &to->inner, &to->inner_count, added, count);
}

/* Adds the points found between the constraint points to the constraints of the next round. */
static qmat_status constrain_found_points(const qmat_simplification *s, const qmat_medial_errors *found,
                                          qmat_extra_points *extra) {
  qmat_status status = QMAT_OK;
  if (found->surface_to_envelope > s->params.epsilon)
    status = append(s->context, &extra->surface, &extra->surface_count, found->bound.points, found->bound.count);
  if (status == QMAT_OK) status = append_inner(s->context, found->uncovered, found->uncovered_count, extra);
  return status == QMAT_OK ? append_inner(s->context, found->undecided, found->undecided_count, extra) : status;
}

static qmat_extra_points no_extra_points(const qmat_simplification *s) {
  return (qmat_extra_points){.required_depth = qmat_required_depth_share * s->params.epsilon};
}

/* Whether the initial medial mesh is within epsilon at all constraint points. If not, no round can repair it. */
static bool starts_within(const qmat_simplification *s) {
  if (!(s->params.epsilon > 0)) return false;
  for (size_t i = 0; i < s->constraints.surface_count; i++)
    if (!(s->constraints.distances[i] <= s->params.epsilon)) return false;
  return true;
}

/* ---- a result, and its judgement ---- */

/* Replaces `best` by `a`, which is empty afterwards. */
static void replace(qmat_simplified *a, qmat_simplified *best) {
  qmat_simplified_uninit(best);
  *best = *a;
  a->medial = NULL;
}

/* Whether all Betti numbers of a result are the solid's, as far as they are known. */
static qmat_status judge_topology(const qmat_simplification *s, const qmat_medial *unit, bool *right) {
  qmat_topology found;
  *right = true;
  const qmat_status status = s->solid.known ? qmat_topology_of_medial(s->context, unit, &found) : QMAT_OK;
  if (status != QMAT_OK || !s->solid.known || !found.known) return status;
  *right = found.components == s->solid.components && found.loops == s->solid.loops && found.voids == s->solid.voids;
  return QMAT_OK;
}

/* Measures the boundary of `unit` again, after a change. The points of `first` stay those of its owner. */
static qmat_status measure_boundary_again(const qmat_simplification *s, const qmat_medial_errors *first,
                                          const qmat_medial *unit, bool only_places, qmat_medial_errors *left) {
  if (left->uncovered != first->uncovered) {
    qmat_free(left->uncovered);
    qmat_free(left->undecided);
  }
  left->uncovered = left->undecided = NULL;
  left->uncovered_count = left->undecided_count = 0;
  return qmat_medial_boundary_measure(s->context, s->surface, unit, s->params.epsilon, only_places, left);
}

/* Fills uncovered interior of the envelope with spheres. `left` gets the errors afterwards, `filled` the number of
 * spheres. */
static qmat_status fill_cavities(const qmat_simplification *s, const qmat_medial_errors *found, qmat_medial *unit,
                                 qmat_medial_errors *left, size_t *filled) {
  const double epsilon = s->params.epsilon;
  qmat_status status = QMAT_OK;
  *left = *found;
  *filled = 0;
  for (int i = 0; i < QMAT_MOST_FILLINGS && left->uncovered_count > 0 && status == QMAT_OK; i++) {
    size_t added;
    status = qmat_cavities_fill(s->context, s->surface, left->uncovered, left->uncovered_count, epsilon, unit, &added);
    if (status != QMAT_OK || added == 0) break;
    *filled += added;
    left->envelope_to_surface = epsilon;
    status = measure_boundary_again(s, found, unit, true, left);
  }
  if (status == QMAT_OK && left->boundary_to_surface == INFINITY)
    status = measure_boundary_again(s, found, unit, false, left);
  return status;
}

/* The next of the three rounds: neither the newest nor the one that it continues. */
static qmat_decimation *take_round(qmat_simplification *s) {
  int next = 0;
  while (next == s->newest || next == s->base) next++;
  s->newest = next;
  qmat_decimation *round = &s->rounds[next];
  qmat_decimation_uninit(round);
  qmat_arena_uninit(&s->round_memory[next]);
  *round = (qmat_decimation){
      .context = s->context, .surface = s->surface, .rules = qmat_simplify_rules(&s->params, &s->state, s->seed)};
  round->rules.share = s->share;
  return round;
}

/* Runs the newest round, which continues `from`, in scratch memory that is freed with the round. */
static qmat_status run_newest(qmat_simplification *s, const qmat_decimation *from, const qmat_medial *left,
                              const qmat_extra_points *extra) {
  qmat_arena *arena = &s->context->arena;
  const qmat_arena aside = qmat_arena_set_aside(arena);
  const qmat_status status =
      qmat_decimation_run_copies(from, left, extra, &s->dense.envelope_tracker.lattice, &s->depths,
                                 &s->round_constraints[s->newest], &s->rounds[s->newest]);
  s->round_memory[s->newest] = qmat_arena_set_aside(arena);
  qmat_arena_put_back(arena, aside);
  return status;
}

/* Whether places beyond epsilon were found. */
static bool is_beyond(const qmat_simplification *s, const qmat_medial_errors *found) {
  return found->surface_to_envelope > s->params.epsilon || found->boundary_to_surface > s->params.epsilon;
}

/* Moves the spheres of the newest round, whose extract is `*medial`, where the errors exceed epsilon. The newest round
 * and `*medial` are then the repaired ones. `failed` are the places that earlier repairs could not mend. */
static qmat_status repair_round(qmat_simplification *s, const qmat_medial_errors *found, qmat_failed_places *failed,
                                qmat_medial **medial, bool *has_moved) {
  qmat_extra_points extra = no_extra_points(s);
  extra.is_strict = true;
  qmat_status status = constrain_found_points(s, found, &extra);
  const qmat_decimation *from = &s->rounds[s->newest];
  qmat_decimation *round = take_round(s);
  round->rules.repairs = true;
  round->failed_places = failed;
  if (status == QMAT_OK) status = run_newest(s, from, *medial, &extra);
  if (status != QMAT_OK) return status;
  *has_moved = round->moves > from->moves;
  status = qmat_decimation_drop_exceeded(round, &s->round_constraints[s->newest]);
  qmat_value_release(&(*medial)->base);
  *medial = qmat_medial_new();
  if (!*medial) return qmat_fail_memory(s->context, "the medial mesh");
  return status == QMAT_OK ? qmat_decimation_extract(round, *medial) : status;
}

/* Measures the newest round, whose extract is `*medial`, and repairs it where its errors exceed epsilon. */
static qmat_status measure_and_repair(qmat_simplification *s, qmat_medial **medial, qmat_medial_errors *found) {
  const int repairs = s->params.epsilon > 0 && s->params.refits > 0 ? QMAT_MOST_REPAIRS : 0;
  qmat_status status = qmat_simplification_measure(s, *medial, repairs > 0, found);
  qmat_failed_places failed = {0};
  for (int i = 1; i <= repairs && status == QMAT_OK && is_beyond(s, found); i++) {
    bool has_moved;
    status = repair_round(s, found, &failed, medial, &has_moved);
    if (status == QMAT_OK && !has_moved && found->surface_to_envelope <= s->params.epsilon)
      status = qmat_simplification_measure_envelope(s, *medial, found);
    if (status != QMAT_OK || !has_moved) break; /* the other errors are those that were found */
    qmat_medial_errors_uninit(found);
    status = qmat_simplification_measure(s, *medial, true, found);
  }
  qmat_failed_places_uninit(&failed);
  if (status == QMAT_OK && repairs > 0 && found->surface_to_envelope > s->params.epsilon) {
    qmat_medial_errors_uninit(found);
    status = qmat_simplification_measure(s, *medial, false, found);
  }
  return status;
}

/* Extracts the newest round, fills its cavities, and measures the fault. `found` are the errors before the filling;
 * `a->figures.filled` starts with the spheres that were added before the round. */
static qmat_status judge_round(qmat_simplification *s, qmat_simplified *a, qmat_medial_errors *found) {
  const double epsilon = s->params.epsilon;
  qmat_status status = qmat_decimation_extract(&s->rounds[s->newest], a->medial);
  if (status == QMAT_OK) status = measure_and_repair(s, &a->medial, found);
  qmat_medial_errors after = *found;
  size_t filled = 0;
  if (status == QMAT_OK) status = fill_cavities(s, found, a->medial, &after, &filled);
  if (status != QMAT_OK) {
    if (after.uncovered != found->uncovered) qmat_medial_errors_uninit(&after);
    return status;
  }
  qmat_simplify_figures_of(&s->rounds[s->newest], &a->figures);
  a->figures.filled += filled;
  a->figures.surface_to_envelope = after.surface_to_envelope;
  a->figures.envelope_to_surface = after.envelope_to_surface;
  a->fault = fmax(fmax(after.surface_to_envelope, after.boundary_to_surface), epsilon);
  a->within_epsilon = a->fault == epsilon;
  if (after.uncovered != found->uncovered) { /* the points that are undecided now become constraints too */
    double *const undecided = found->undecided;
    found->undecided = after.undecided;
    found->undecided_count = after.undecided_count;
    after.undecided = undecided;
    qmat_medial_errors_uninit(&after);
  }
  return judge_topology(s, a->medial, &a->has_right_topology);
}

/* ---- the passes ---- */

/* Makes the dense initial medial mesh. */
static qmat_status make_dense(qmat_simplification *s) {
  qmat_decimation *dense = &s->dense;
  qmat_decimation_uninit(dense);
  *dense = (qmat_decimation){
      .context = s->context, .surface = s->surface, .rules = qmat_simplify_rules(&s->params, &s->state, s->seed)};
  dense->sheet_vertices = s->initial->sheet_sphere_count;
  return qmat_complex_init(s->context, &dense->complex, s->initial, s->state.spheres);
}

/* Makes the constraint points of the dense initial medial mesh. */
static qmat_status make_constraints(qmat_simplification *s) {
  const double epsilon = s->params.epsilon > 0 ? s->params.epsilon : INFINITY;
  const bool inside = s->params.error == QMAT_ERROR_TWO_SIDED && epsilon < INFINITY;
  return qmat_constraint_points_make(s->context, s->surface, s->samples, s->initial, &s->dense.complex, epsilon,
                                     QMAT_MOST_CONSTRAINT_POINTS, inside, &s->constraints);
}

/* Collapses the dense initial medial mesh as far as `qmat_dense_share` of the error allows: in pieces on all threads,
 * where it is large, then as a whole. Edges stay inside the model as in section 3.4, unless they are thin. */
static qmat_status collapse_dense(qmat_simplification *s) {
  qmat_decimation *dense = &s->dense;
  dense->rules.share = qmat_dense_share * s->share;
  dense->rules.thin_radius = qmat_thin_share * dense->rules.share * dense->rules.limit;
  dense->rules.refits = 0;
  const qmat_status status = qmat_can_collapse_partitioned(&dense->rules, &dense->complex, dense->sheet_vertices)
                                 ? qmat_collapse_partitioned(dense, &s->constraints, s->state.depths)
                                 : qmat_decimation_init(dense, &s->constraints, s->state.depths);
  return status == QMAT_OK ? qmat_decimation_run(dense) : status;
}

/* Starts over with the points that rounds have found: the dense collapse may itself exceed epsilon between its points,
 * which no round after it can undo. That is so where sheets cross: the nearest one changes between two points. */
static qmat_status collapse_dense_again(qmat_simplification *s, qmat_extra_points *extra) {
  qmat_constraint_points further, joined;
  qmat_status status = make_dense(s);
  if (status == QMAT_OK) status = qmat_extra_points_make(s->context, &s->dense.complex, extra, &further);
  if (status == QMAT_OK)
    status = qmat_constraint_points_join(s->context, &s->constraints, s->constraints.witnesses, s->constraints.weights,
                                         NULL, &further, &joined);
  if (status != QMAT_OK) return status;
  s->constraints = joined;
  *extra = no_extra_points(s);
  return collapse_dense(s);
}

/* Continues the collapses of `from`, whose extract is `left`, and judges the result. `neighbourhoods` and `final_refit`
 * are as in the rules; `a` and `found` are new, and `a->figures.filled` is 0 or as in `left`. */
static qmat_status run_round(qmat_simplification *s, const qmat_decimation *from, const qmat_medial *left,
                             const qmat_extra_points *extra, bool neighbourhoods, bool final_refit, qmat_simplified *a,
                             qmat_medial_errors *found) {
  s->base = s->newest;
  qmat_decimation *round = take_round(s);
  a->medial = qmat_medial_new();
  if (!a->medial) return qmat_fail_memory(s->context, "the medial mesh");
  round->rules.neighbourhoods = neighbourhoods;
  round->rules.final_refit = final_refit;
  const qmat_status status = run_newest(s, from, left, extra);
  return status == QMAT_OK ? judge_round(s, a, found) : status;
}

/* Collapses and fits spheres from the end of the dense collapse, with the points found by earlier rounds. */
static qmat_status collapse_and_fit(qmat_simplification *s, const qmat_extra_points *extra, bool is_last,
                                    qmat_simplified *a, qmat_medial_errors *found) {
  qmat_medial *left = qmat_medial_new();
  qmat_status status = left ? QMAT_OK : qmat_fail_memory(s->context, "the medial mesh");
  if (status == QMAT_OK) status = qmat_decimation_extract(&s->dense, left);
  if (status == QMAT_OK) status = run_round(s, &s->dense, left, extra, false, is_last, a, found);
  qmat_value_release(left ? &left->base : NULL);
  return status;
}

/* Mends the Betti numbers of a free result. Small loops and voids of the dense initial mesh are noise at the scale of
 * epsilon: a guard that counts them while it collapses strands simple solids at hundreds of spheres. No edit joins or
 * parts components, so that a result with other ones stays as it is. */
static qmat_status mend_topology(const qmat_simplification *s, qmat_simplified *best) {
  if (s->params.topology != QMAT_TOPOLOGY_GUARD || !best->within_epsilon || !s->solid.known) return QMAT_OK;
  qmat_topology found;
  bool right = false;
  qmat_status status = qmat_topology_of_medial(s->context, best->medial, &found);
  if (status != QMAT_OK || !found.known || found.components != s->solid.components) return status;
  status = qmat_simplification_open_voids(s, best);
  if (status == QMAT_OK) status = qmat_simplification_close_loops(s, best);
  if (status == QMAT_OK) status = judge_topology(s, best->medial, &right);
  if (right) best->has_right_topology = true;
  return status;
}

/* Continues from the result of the newest round: each edge is tried again, also with the spheres around it fitted
 * jointly (qmat_decimation_try_neighbourhoods). Filled cavities of `found` become constraints, since a collapse may
 * take away what fills them. A result beyond epsilon is tried again with the points found, and with less of the error
 * where there are none. The result changes only where that makes it no worse. */
static qmat_status refit_once(qmat_simplification *s, const qmat_medial_errors *found, qmat_simplified *best,
                              bool *fewer) {
  *fewer = false;
  if (s->params.refits == 0 || best->medial->sphere_count <= (size_t)s->params.vertices) return QMAT_OK;
  qmat_extra_points extra = no_extra_points(s);
  const int base = s->newest;
  const double share = s->share;
  qmat_status status = QMAT_OK;
  if (best->figures.filled > 0) status = append_inner(s->context, found->uncovered, found->uncovered_count, &extra);
  bool ended = false, is_taken = false;
  for (int i = 0; i < QMAT_MOST_REFIT_TRIES && status == QMAT_OK && !ended && !is_taken; i++) {
    qmat_simplified a = {.figures = best->figures, .fault = INFINITY};
    qmat_medial_errors errors = {.surface_to_envelope = 0};
    s->newest = base;
    status = run_round(s, &s->rounds[base], best->medial, &extra, true, true, &a, &errors);
    ended = a.within_epsilon;
    const size_t points = extra.surface_count + extra.inner_count;
    if (status == QMAT_OK && !ended) {
      status = constrain_found_points(s, &errors, &extra);
      if (extra.surface_count + extra.inner_count == points) s->share *= qmat_hovering_share;
    }
    qmat_medial_errors_uninit(&errors);
    is_taken = status == QMAT_OK && !qmat_simplified_is_better(best, &a);
    if (is_taken) {
      *fewer = a.medial->sphere_count < best->medial->sphere_count;
      replace(&a, best);
    }
    qmat_simplified_uninit(&a);
  }
  s->share = share;
  if (!is_taken) s->newest = base;
  return status;
}

/* Repeats joint refits while they remove spheres: refitted spheres make room for others to disappear. */
static qmat_status refit_jointly(qmat_simplification *s, const qmat_medial_errors *found, qmat_simplified *best) {
  qmat_status status = QMAT_OK;
  bool fewer = true;
  for (int i = 0; i < QMAT_MOST_REFITS && fewer && status == QMAT_OK; i++) status = refit_once(s, found, best, &fewer);
  return status;
}

/* Runs rounds of collapses until both errors are within epsilon between the constraint points too. Places where the
 * surface is too far from the envelope, or the interior is uncovered, become constraint points. The best round
 * counts. There may be no result where the initial medial mesh itself is not within epsilon. */
static qmat_status run_rounds(qmat_simplification *s, qmat_simplified *best) {
  const double epsilon = s->params.epsilon;
  qmat_extra_points extra = no_extra_points(s);
  qmat_status status = make_dense(s);
  if (status == QMAT_OK) status = make_constraints(s);
  const bool is_within = status == QMAT_OK && starts_within(s);
  if (status == QMAT_OK && s->may_end_without_result && epsilon > 0 && !is_within) return QMAT_OK;
  s->share = 1;
  if (status == QMAT_OK) status = collapse_dense(s);
  for (size_t round = 1; status == QMAT_OK; round++) {
    qmat_medial_errors errors = {.surface_to_envelope = 0};
    qmat_simplified a = {.figures = {.rounds = round, .initial_spheres = s->initial->sphere_count}, .fault = INFINITY};
    const bool is_last = round == QMAT_MOST_ROUNDS || !is_within;
    if (round > QMAT_DENSE_AGAIN_ROUND) s->share *= qmat_late_round_share;
    if (round >= QMAT_DENSE_AGAIN_ROUND) status = collapse_dense_again(s, &extra);
    if (status == QMAT_OK) status = collapse_and_fit(s, &extra, is_last, &a, &errors);
    const bool is_done =
        is_last || a.within_epsilon || (errors.surface_to_envelope <= epsilon && errors.uncovered_count == 0);
    if (status == QMAT_OK && is_done && (a.within_epsilon || a.figures.filled > 0 || is_within))
      status = refit_jointly(s, &errors, &a);
    if (status == QMAT_OK && qmat_simplified_is_better(&a, best)) replace(&a, best);
    qmat_simplified_uninit(&a);
    if (status == QMAT_OK && !is_done) status = constrain_found_points(s, &errors, &extra);
    qmat_medial_errors_uninit(&errors);
    if (status != QMAT_OK || is_done) return status;
  }
  return status;
}

qmat_status qmat_simplification_prepare(qmat_simplification *s, const qmat_value *const inputs[]) {
  s->samples = (const qmat_samples *)inputs[2];
  s->initial = (const qmat_medial *)inputs[3];
  const qmat_status status = qmat_simplify_prepare(s->context, &s->params, inputs, &s->surface, &s->state);
  return status == QMAT_OK ? qmat_topology_of_solid(s->context, s->surface, &s->solid) : status;
}

qmat_status qmat_simplification_run(qmat_simplification *s, qmat_simplified *best) {
  *best = (qmat_simplified){.fault = INFINITY};
  const qmat_status status = run_rounds(s, best);
  return status == QMAT_OK ? mend_topology(s, best) : status;
}
