/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.simplify: edge collapses by slab quadratic error and stability ratio, with both errors bounded. */
#include <math.h>
#include <string.h>

#include "core/json_text.h"
#include "core/node.h"
#include "nodes/descriptor/epsilon.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/descriptor/medial_summary.h"
#include "nodes/measure/envelope_to_surface.h"
#include "nodes/measure/medial_errors.h"
#include "nodes/measure/topology.h"
#include "nodes/measure/topology_report.h"
#include "nodes/simplify/cavity_filling.h"
#include "nodes/simplify/decimation_resume.h"
#include "nodes/simplify/partitioned_collapse.h"
#include "nodes/simplify/simplify_setup.h"

typedef qmat_simplify_params medial_simplify_params;

/* Constraint points are held to 0.975 epsilon; the margin covers the surface between them. Where that is not enough,
 * the round is repeated with constraint points at the places found, in at most 8 rounds. Uncovered interior is filled
 * by extra spheres; filling one cavity can expose another: at most 6 passes. */
enum { MOST_ROUNDS = 8, MOST_JOINT_REFITS = 3, MOST_FILLINGS = 6 };

typedef struct {
  qmat_context *context;
  const medial_simplify_params *params; /* with epsilon less the mesh's deviation */
  double epsilon, deviation;            /* epsilon as given, and the deviation, in diagonals */
  qmat_surface *surface;
  qmat_topology solid;                /* of the solid; not known for every input */
  qmat_constraint_points constraints; /* of `dense` */
  qmat_decimation dense;              /* the start of each round */
  size_t initial_count;               /* spheres before the first collapse */
  /* Of the newest round, and of the round that it continues. */
  qmat_constraint_points round_constraints[2];
  qmat_decimation rounds[2];
  int newest;
} simplifier;

/* The reported surface-to-envelope error exceeds the true one by at most the first share of epsilon, but is never below
 * the second. The envelope-to-surface error is a bound, refined only where it exceeds epsilon. */
static const double error_tolerance = 0.01, least_reported = 0.5;

static qmat_status measure(const simplifier *s, const qmat_medial *unit, qmat_medial_errors *errors) {
  const double epsilon = s->params->epsilon > 0 ? s->params->epsilon : QMAT_DEFAULT_EPSILON;
  const double tolerance = error_tolerance * epsilon;
  const qmat_constraint_points *constraints = &s->round_constraints[s->newest];
  qmat_status status =
      qmat_medial_surface_bound_measure(s->context, s->surface, unit, constraints->points, constraints->surface_count,
                                        tolerance, least_reported * epsilon, epsilon - tolerance, errors);
  if (status != QMAT_OK) return status;
  const bool two_sided = s->params->epsilon > 0 && s->params->error == QMAT_ERROR_TWO_SIDED;
  const qmat_decimation *round = &s->rounds[s->newest];
  if (two_sided)
    errors->envelope_to_surface = qmat_envelope_to_surface_largest_bound(&round->envelope_tracker, &round->complex);
  if (!two_sided || errors->envelope_to_surface > epsilon)
    status =
        qmat_medial_envelope_bound_measure(s->context, s->surface, unit, tolerance, least_reported * epsilon, errors);
  return status == QMAT_OK && two_sided ? qmat_medial_boundary_measure(s->context, s->surface, unit, epsilon, errors)
                                        : status;
}

/* Fills uncovered interior of the envelope with spheres. `left` gets the errors afterwards, `filled` the number of
 * spheres. */
static qmat_status fill_cavities(const simplifier *s, const qmat_medial_errors *found, qmat_medial *unit,
                                 qmat_medial_errors *left, size_t *filled) {
  const double epsilon = s->params->epsilon;
  qmat_status status = QMAT_OK;
  *left = *found;
  *filled = 0;
  for (int i = 0; i < MOST_FILLINGS && left->uncovered_count > 0 && status == QMAT_OK; i++) {
    size_t added;
    status = qmat_cavities_fill(s->context, s->surface, left->uncovered, left->uncovered_count, epsilon, unit, &added);
    if (status != QMAT_OK || added == 0) break;
    *filled += added;
    left->envelope_to_surface = epsilon;
    if (i > 0) qmat_medial_errors_uninit(left);
    left->uncovered = left->undecided = NULL; /* `found` keeps its own */
    left->uncovered_count = left->undecided_count = 0;
    status = qmat_medial_boundary_measure(s->context, s->surface, unit, epsilon, left);
  }
  return status;
}

static void swap_lattices(qmat_decimation *a, qmat_decimation *b) {
  const qmat_depth_lattice lattice = a->envelope_tracker.lattice;
  a->envelope_tracker.lattice = b->envelope_tracker.lattice;
  b->envelope_tracker.lattice = lattice;
}

/* The dense collapse uses only the first share of the error and is done once for all rounds, so that points found later
 * still fit. Points inside the solid must be as deep in the envelope as the second share of epsilon. */
static const double dense_share = 0.9, required_depth_share = 0.05;

static qmat_status collapse_dense(simplifier *s, const qmat_initial_medial *state, const qmat_samples *samples,
                                  const qmat_medial *medial, const qmat_extra_points *extra) {
  qmat_decimation *dense = &s->dense;
  *dense = (qmat_decimation){.context = s->context, .surface = s->surface};
  qmat_status status = qmat_complex_init(s->context, &dense->complex, medial, state->spheres);
  if (status == QMAT_OK)
    status = qmat_simplify_rules(s->context, s->params, qmat_surface_mesh(s->surface), state, &dense->rules);
  const double epsilon = s->params->epsilon > 0 ? s->params->epsilon : INFINITY;
  const bool inside = s->params->error == QMAT_ERROR_TWO_SIDED && epsilon < INFINITY;
  if (status == QMAT_OK)
    status = qmat_constraint_points_make(s->context, s->surface, samples, medial, &dense->complex, epsilon,
                                         QMAT_MOST_CONSTRAINT_POINTS, inside, &s->constraints);
  if (extra->surface_count + extra->inner_count > 0) {
    const qmat_constraint_points base = s->constraints;
    qmat_constraint_points further;
    if (status == QMAT_OK) status = qmat_extra_points_make(s->context, &dense->complex, extra, &further);
    if (status == QMAT_OK)
      status =
          qmat_constraint_points_join(s->context, &base, base.witnesses, base.weights, NULL, &further, &s->constraints);
  }
  dense->rules.share = dense_share;
  dense->rules.refits = 0;
  s->initial_count = dense->complex.vertex_count;
  if (status == QMAT_OK)
    status = qmat_can_collapse_partitioned(&dense->rules, &dense->complex)
                 ? qmat_collapse_partitioned(dense, &s->constraints, state->depths)
                 : qmat_decimation_init(dense, &s->constraints, state->depths);
  return status == QMAT_OK ? qmat_decimation_run(dense) : status;
}

/* Continues the collapses of `from`, whose extract is `left`; `neighbourhoods` and `final_refit` as in the rules. */
static qmat_status run_round(simplifier *s, const qmat_initial_medial *state, const qmat_decimation *from,
                             const qmat_medial *left, const qmat_extra_points *extra, bool neighbourhoods,
                             bool final_refit) {
  s->newest = 1 - s->newest;
  qmat_decimation *round = &s->rounds[s->newest];
  qmat_decimation_uninit(round);
  *round = (qmat_decimation){.context = s->context, .surface = s->surface};
  qmat_status status = qmat_simplify_rules(s->context, s->params, qmat_surface_mesh(s->surface), state, &round->rules);
  round->rules.neighbourhoods = neighbourhoods;
  round->rules.final_refit = final_refit;
  if (status == QMAT_OK) status = qmat_decimation_resume(from, left, extra, &s->round_constraints[s->newest], round);
  if (status != QMAT_OK) return status;
  /* Known depths hold in every round. */
  swap_lattices(&s->dense, round);
  status = qmat_decimation_run(round);
  swap_lattices(&s->dense, round);
  return status;
}

static int report_features(const qmat_decimation *run, json_t *root) {
  const size_t left = run->creases.left;
  if (left == 0) return 0;
  int bad = qmat_json_set_count(root, "features", left);
  bad |= json_object_set_new(root, "crease_error", json_real(qmat_crease_guard_error(&run->creases)));
  return bad;
}

/* Errors with respect to the surface that the mesh approximates. */
static int report_errors(json_t *root, double epsilon, double deviation, const qmat_medial_errors *errors) {
  int bad = json_object_set_new(root, "epsilon", json_real(epsilon));
  bad |= json_object_set_new(root, "surface_to_envelope", json_real(errors->surface_to_envelope + deviation));
  bad |= json_object_set_new(root, "envelope_to_surface", json_real(errors->envelope_to_surface + deviation));
  return bad;
}

/* The part of the report that every run has. */
static int report_run(json_t *root, const qmat_decimation *run, size_t initial_spheres, const qmat_medial *unit) {
  int bad = qmat_json_set_count(root, "initial_spheres", initial_spheres);
  bad |= qmat_json_set_count(root, "spheres", unit->sphere_count);
  bad |= qmat_json_set_count(root, "edges", unit->edge_count);
  bad |= qmat_json_set_count(root, "triangles", unit->triangle_count);
  bad |= qmat_json_set_count(root, "collapses", run->counts.collapses);
  bad |= qmat_json_set_count(root, "constraint_points", run->constraints->count);
  bad |= qmat_json_set_count(root, "refused_by_inside_test", run->counts.refused_by_inside_test);
  bad |= qmat_json_set_count(root, "refused_by_surface_to_envelope", run->counts.refused_by_surface_to_envelope);
  bad |= qmat_json_set_count(root, "refused_by_envelope_to_surface", run->counts.refused_by_envelope_to_surface);
  bad |= qmat_json_set_count(root, "refused_by_protection", run->counts.refused_by_protection);
  bad |= qmat_json_set_count(root, "refused_by_topology", run->counts.refused_by_topology);
  return bad | report_features(run, root);
}

static qmat_status make_report(const simplifier *s, const qmat_medial *unit, const qmat_medial_errors *errors,
                               int rounds, size_t filled, qmat_report *report) {
  const qmat_decimation *run = &s->rounds[s->newest];
  json_t *root = report->root;
  int bad = report_run(root, run, s->initial_count, unit);
  bad |= qmat_json_set_count(root, "rounds", (size_t)rounds);
  bad |= qmat_json_set_count(root, "cavity_filling_spheres", filled);
  bad |= qmat_json_set_count(root, "sphere_moves", run->moves);
  bad |= qmat_json_set_count(root, "surface_distance_queries", s->dense.envelope_tracker.lattice.queries);
  bad |= report_errors(root, s->epsilon, s->deviation, errors);
  return bad ? qmat_fail_memory(s->context, "the report") : QMAT_OK;
}

/* Appends `added` points. */
static qmat_status append(simplifier *s, const double **points, size_t *count, const double *added,
                          size_t added_count) {
  double *all = qmat_arena_alloc(&s->context->arena, *count + added_count, 3 * sizeof *all);
  if (!all) return qmat_fail_memory(s->context, "constraint points");
  if (*count) memcpy(all, *points, 3 * *count * sizeof *all);
  if (added_count) memcpy(all + 3 * *count, added, 3 * added_count * sizeof *all);
  *points = all;
  *count += added_count;
  return QMAT_OK;
}

/* Whether the initial medial mesh is within epsilon at all constraint points. If not, no round can repair it. */
static bool starts_within(const simplifier *s, double epsilon) {
  for (size_t i = 0; i < s->constraints.surface_count; i++)
    if (!(s->constraints.distances[i] <= epsilon)) return false;
  return true;
}

/* Whether the dense collapse satisfies the constraints of a round as well as the result has to. */
static bool dense_satisfies(const simplifier *s, const qmat_extra_points *extra) {
  const qmat_constraint_points *base = &s->constraints, *all = &s->round_constraints[s->newest];
  for (size_t i = base->surface_count; i < all->surface_count; i++)
    if (!(all->distances[i] <= s->dense.rules.limit)) return false;
  return all->count - all->surface_count == base->count - base->surface_count + extra->inner_count;
}

/* A result so far. `fault` is its largest error, at least epsilon, plus a share of epsilon where its Betti numbers are
 * not the solid's. */
typedef struct {
  qmat_medial *medial;
  qmat_report *report;
  double fault;
  size_t topology_faults; /* components, loops and voids too many or too few */
  bool within_epsilon;    /* whether both errors are within epsilon, as far as measured */
  size_t filled;          /* spheres added to fill uncovered interior */
} attempt;

static const double topology_fault = 0.05;

static size_t difference(size_t a, size_t b) {
  return a > b ? a - b : b - a;
}

/* Sets `a->topology_faults`, to 0 where a Betti number is not known. */
static qmat_status judge_topology(const simplifier *s, attempt *a) {
  qmat_topology found;
  a->topology_faults = 0;
  const qmat_status status = s->solid.known ? qmat_topology_of_medial(s->context, a->medial, &found) : QMAT_OK;
  if (status != QMAT_OK || !s->solid.known || !found.known) return status;
  a->topology_faults = difference(found.components, s->solid.components) + difference(found.loops, s->solid.loops) +
                       difference(found.voids, s->solid.voids);
  return QMAT_OK;
}

static void release(attempt *a) {
  qmat_value_release(a->medial ? &a->medial->base : NULL);
  qmat_value_release(a->report ? &a->report->base : NULL);
  *a = (attempt){.fault = INFINITY};
}

static bool is_better(const attempt *a, const attempt *best) {
  return a->fault < best->fault || (a->fault == best->fault && a->medial->sphere_count < best->medial->sphere_count);
}

/* Extracts the newest round, fills its cavities, and measures the fault. `found` are the errors before the filling;
 * `a->filled` starts with the spheres that were added before the round. */
static qmat_status finish_attempt(simplifier *s, int round, attempt *a, qmat_medial_errors *found) {
  const qmat_decimation *done = &s->rounds[s->newest];
  qmat_status status = qmat_decimation_extract(done, a->medial);
  if (status == QMAT_OK) status = measure(s, a->medial, found);
  qmat_medial_errors after = *found;
  size_t filled = 0;
  if (status == QMAT_OK) status = fill_cavities(s, found, a->medial, &after, &filled);
  a->filled += filled;
  if (status == QMAT_OK) status = make_report(s, a->medial, &after, round, a->filled, a->report);
  const double epsilon = s->params->epsilon;
  a->fault = fmax(fmax(after.surface_to_envelope, after.boundary_to_surface), epsilon);
  a->within_epsilon = status == QMAT_OK && a->fault == epsilon;
  if (filled > 0) { /* the points that are undecided now become constraints too */
    double *const undecided = found->undecided;
    found->undecided = after.undecided;
    found->undecided_count = after.undecided_count;
    after.undecided = undecided;
    qmat_medial_errors_uninit(&after);
  }
  if (status == QMAT_OK) status = judge_topology(s, a);
  if (a->topology_faults > 0) a->fault += topology_fault * epsilon;
  return status;
}

static qmat_status start_attempt(const simplifier *s, size_t filled, attempt *a, qmat_medial_errors *found) {
  *a = (attempt){.medial = qmat_medial_new(), .report = qmat_report_new(), .fault = INFINITY, .filled = filled};
  *found = (qmat_medial_errors){.surface_to_envelope = 0};
  return a->medial && a->report ? QMAT_OK : qmat_fail_memory(s->context, "the medial mesh");
}

/* Runs a round from the end of the dense collapse. `found` are the errors before cavities are filled. */
static qmat_status run_attempt(simplifier *s, const qmat_initial_medial *state, const qmat_extra_points *extra,
                               int round, bool is_last, attempt *a, qmat_medial_errors *found) {
  qmat_medial *left = qmat_medial_new();
  qmat_status status = start_attempt(s, 0, a, found);
  if (status == QMAT_OK && !left) status = qmat_fail_memory(s->context, "the medial mesh");
  if (status == QMAT_OK) status = qmat_decimation_extract(&s->dense, left);
  if (status == QMAT_OK) status = run_round(s, state, &s->dense, left, extra, false, is_last);
  qmat_value_release(left ? &left->base : NULL);
  return status == QMAT_OK ? finish_attempt(s, round, a, found) : status;
}

/* Adds the points found between the constraint points to the constraints of the next round. */
static qmat_status constrain_found_points(simplifier *s, const qmat_medial_errors *found, qmat_extra_points *extra) {
  qmat_status status = QMAT_OK;
  if (found->surface_to_envelope > s->params->epsilon)
    status = append(s, &extra->surface, &extra->surface_count, found->bound.points, found->bound.count);
  if (status == QMAT_OK)
    status = append(s, &extra->inner, &extra->inner_count, found->uncovered, found->uncovered_count);
  return status == QMAT_OK ? append(s, &extra->inner, &extra->inner_count, found->undecided, found->undecided_count)
                           : status;
}

/* Continues from the result of the newest round with joint refits: each edge is tried with the spheres around it fitted
 * at the same time. Filled cavities of `found` become constraints, since a collapse may take away what fills them. A
 * result beyond epsilon is tried again with the points found. The result changes only where that makes it no worse. */
static qmat_status refit_jointly(simplifier *s, const qmat_initial_medial *state, int round,
                                 const qmat_medial_errors *found, attempt *best) {
  if (s->params->refits == 0 || best->medial->sphere_count <= (size_t)s->params->vertices) return QMAT_OK;
  qmat_extra_points extra = {.required_depth = required_depth_share * s->params->epsilon};
  const int base = s->newest;
  qmat_status status = QMAT_OK;
  if (best->filled > 0) status = append(s, &extra.inner, &extra.inner_count, found->uncovered, found->uncovered_count);
  bool ended = false;
  for (int i = 0; i < MOST_JOINT_REFITS && status == QMAT_OK && !ended; i++) {
    attempt a;
    qmat_medial_errors errors;
    s->newest = base;
    status = start_attempt(s, best->filled, &a, &errors);
    if (status == QMAT_OK) status = run_round(s, state, &s->rounds[base], best->medial, &extra, true, true);
    if (status == QMAT_OK) status = finish_attempt(s, round, &a, &errors);
    ended = a.within_epsilon;
    if (status == QMAT_OK && !ended) status = constrain_found_points(s, &errors, &extra);
    qmat_medial_errors_uninit(&errors);
    if (status == QMAT_OK && !is_better(best, &a)) {
      release(best);
      *best = a;
      return QMAT_OK;
    }
    release(&a);
  }
  s->newest = base;
  return status;
}

/* Removes a triangle, not its edges; the order of the others stays. */
static void remove_triangle(qmat_medial *medial, size_t triangle) {
  uint32_t *row = &medial->triangles[3 * triangle];
  memmove(row, row + 3, 3 * (--medial->triangle_count - triangle) * sizeof *row);
}

static void restore_triangle(qmat_medial *medial, size_t triangle, const uint32_t corners[3]) {
  uint32_t *row = &medial->triangles[3 * triangle];
  memmove(row + 3, row, 3 * (medial->triangle_count++ - triangle) * sizeof *row);
  memcpy(row, corners, 3 * sizeof *row);
}

/* The limit of walls tried per void. */
enum { MOST_WALLS = 12 };

/* Opens a void that the solid does not have: removes the first wall without which both errors stay within epsilon.
 * `*opened`: whether there was one; `*errors` are then those without it. */
static qmat_status open_void(simplifier *s, qmat_medial *unit, bool *opened, qmat_medial_errors *errors) {
  const double epsilon = s->params->epsilon;
  uint32_t *walls;
  size_t count;
  *opened = false;
  qmat_status status = qmat_topology_find_walls(s->context, unit, &walls, &count);
  for (size_t i = 0; i < count && i < MOST_WALLS && status == QMAT_OK && !*opened; i++) {
    uint32_t corners[3];
    memcpy(corners, &unit->triangles[3 * (size_t)walls[i]], sizeof corners);
    *errors = (qmat_medial_errors){.surface_to_envelope = 0};
    remove_triangle(unit, walls[i]);
    status = measure(s, unit, errors);
    *opened = status == QMAT_OK && errors->surface_to_envelope <= epsilon && errors->boundary_to_surface <= epsilon;
    qmat_medial_errors_uninit(errors);
    if (!*opened) restore_triangle(unit, walls[i], corners);
  }
  return status;
}

/* Opens voids of a result within epsilon until it has no more than the solid. Without a slab the envelope leaves the
 * solid by no more, but the surface may be farther from it. */
static qmat_status open_voids(simplifier *s, attempt *a) {
  if (!a->within_epsilon || !s->solid.known) return QMAT_OK;
  json_t *root = a->report->root;
  for (bool opened = true; opened;) {
    qmat_topology topology;
    qmat_medial_errors errors;
    qmat_status status = qmat_topology_of_medial(s->context, a->medial, &topology);
    if (status != QMAT_OK || !topology.known || topology.voids <= s->solid.voids) return status;
    status = open_void(s, a->medial, &opened, &errors);
    if (status != QMAT_OK) return status;
    if (!opened) break;
    int bad = qmat_json_set_count(root, "triangles", a->medial->triangle_count);
    bad |= json_object_set_new(root, "surface_to_envelope", json_real(errors.surface_to_envelope + s->deviation));
    if (bad) return qmat_fail_memory(s->context, "the report");
  }
  return QMAT_OK;
}

/* Inserts a triangle in its sorted place. */
static qmat_status insert_triangle(qmat_context *context, qmat_medial *medial, const uint32_t corners[3],
                                   size_t *place) {
  size_t capacity = 3 * medial->triangle_count;
  if (qmat_grow((void **)&medial->triangles, &capacity, 3 * (medial->triangle_count + 1), sizeof *corners))
    return qmat_fail_memory(context, "medial slabs");
  for (*place = 0; *place < medial->triangle_count; ++*place) {
    const uint32_t *row = &medial->triangles[3 * *place];
    if (row[0] != corners[0] ? row[0] > corners[0] : row[1] != corners[1] ? row[1] > corners[1] : row[2] > corners[2])
      break;
  }
  restore_triangle(medial, *place, corners);
  return QMAT_OK;
}

/* Closes a loop that the solid does not have: fills the first three edges without a slab that form such a loop, where
 * the slab leaves the solid by at most epsilon. `*closed`: whether there were any; `*slab_error` is then how far the
 * slab leaves the solid. A slab that closes no loop would make a void. */
static qmat_status close_loop(simplifier *s, qmat_medial *unit, size_t loops, bool *closed, double *slab_error) {
  const double epsilon = s->params->epsilon;
  uint32_t *triangles;
  size_t count;
  *closed = false;
  qmat_status status = qmat_topology_find_empty_triangles(s->context, unit, &triangles, &count);
  for (size_t i = 0; i < count && status == QMAT_OK && !*closed; i++) {
    const uint32_t *corners = &triangles[3 * i];
    const double *spheres[3];
    for (size_t k = 0; k < 3; k++) spheres[k] = &unit->spheres[4 * (size_t)corners[k]];
    *slab_error =
        qmat_envelope_to_surface_bound(s->surface, spheres, 3, least_reported * epsilon, error_tolerance * epsilon);
    if (*slab_error > epsilon) continue;
    size_t place = 0;
    qmat_topology topology;
    qmat_medial_errors errors = {.surface_to_envelope = 0};
    status = insert_triangle(s->context, unit, corners, &place);
    if (status != QMAT_OK) break;
    status = qmat_topology_of_medial(s->context, unit, &topology);
    if (status == QMAT_OK && topology.known && topology.loops < loops) {
      status = qmat_medial_boundary_measure(s->context, s->surface, unit, epsilon, &errors);
      *closed = status == QMAT_OK && errors.boundary_to_surface <= epsilon;
      qmat_medial_errors_uninit(&errors);
    }
    if (!*closed) remove_triangle(unit, place);
  }
  return status;
}

/* Closes loops of a result within epsilon while it has more than the solid. A further slab brings the surface no
 * farther from the envelope, but may leave the solid. */
static qmat_status close_loops(simplifier *s, attempt *a) {
  if (!a->within_epsilon || !s->solid.known) return QMAT_OK;
  json_t *root = a->report->root;
  for (;;) {
    qmat_topology topology;
    bool closed;
    double slab_error;
    qmat_status status = qmat_topology_of_medial(s->context, a->medial, &topology);
    if (status != QMAT_OK || !topology.known || topology.loops <= s->solid.loops) return status;
    status = close_loop(s, a->medial, topology.loops, &closed, &slab_error);
    if (status != QMAT_OK || !closed) return status;
    const double before = json_real_value(json_object_get(root, "envelope_to_surface"));
    int bad = qmat_json_set_count(root, "triangles", a->medial->triangle_count);
    bad |= json_object_set_new(root, "envelope_to_surface", json_real(fmax(before, slab_error + s->deviation)));
    if (bad) return qmat_fail_memory(s->context, "the report");
  }
}

/* Runs rounds of collapses until both errors are within epsilon between the constraint points too. Places where the
 * surface is too far from the envelope, or the interior is uncovered, become constraint points. Where the dense
 * collapse violates these, it is done again with them. The best round counts. */
static qmat_status simplify(simplifier *s, const qmat_initial_medial *state, const qmat_samples *samples,
                            const qmat_medial *initial, attempt *best) {
  const double epsilon = s->params->epsilon;
  qmat_extra_points in_dense = {.required_depth = required_depth_share * epsilon}, extra = in_dense;
  qmat_status status = collapse_dense(s, state, samples, initial, &in_dense);
  for (int round = 1; status == QMAT_OK; round++) {
    qmat_medial_errors errors;
    attempt a;
    const bool is_within = epsilon > 0 && starts_within(s, epsilon), is_last = round == MOST_ROUNDS || !is_within;
    status = run_attempt(s, state, &extra, round, is_last, &a, &errors);
    const bool is_done =
        is_last || a.within_epsilon || (errors.surface_to_envelope <= epsilon && errors.uncovered_count == 0);
    const bool again = status == QMAT_OK && !is_done && !dense_satisfies(s, &extra);
    if (status == QMAT_OK && is_done && (a.within_epsilon || a.filled > 0 || is_within))
      status = refit_jointly(s, state, round, &errors, &a);
    if (status == QMAT_OK && is_better(&a, best)) {
      release(best);
      *best = a;
    } else {
      release(&a);
    }
    if (status == QMAT_OK && !is_done) status = constrain_found_points(s, &errors, &extra);
    qmat_medial_errors_uninit(&errors);
    if (status != QMAT_OK || is_done) return status;
    if (!again) continue;
    status = append(s, &in_dense.surface, &in_dense.surface_count, extra.surface, extra.surface_count);
    if (status == QMAT_OK) status = append(s, &in_dense.inner, &in_dense.inner_count, extra.inner, extra.inner_count);
    extra = (qmat_extra_points){.required_depth = extra.required_depth};
    qmat_decimation_uninit(&s->dense);
    if (status == QMAT_OK) status = collapse_dense(s, state, samples, initial, &in_dense);
  }
  return status;
}

/* A guarded result replaces a free one only where it takes at most this many times its spheres. */
static const double most_spheres_for_topology = 1.25;

/* Collapses freely, judges the Betti numbers of the result, and mends those that differ from the solid's. Small loops
 * and voids of the dense initial mesh are noise at the scale of epsilon: a guard that counts them while it collapses
 * strands simple solids at hundreds of spheres. Only where mending fails are collapses guarded from the start. */
static qmat_status simplify_and_mend(simplifier *s, medial_simplify_params *params, const qmat_initial_medial *state,
                                     const qmat_samples *samples, const qmat_medial *initial, attempt *best) {
  if (params->topology != QMAT_TOPOLOGY_GUARD) return simplify(s, state, samples, initial, best);
  for (int guarded = 0; guarded < 2; guarded++) {
    attempt a = {.fault = INFINITY};
    params->topology = guarded ? QMAT_TOPOLOGY_GUARD : QMAT_TOPOLOGY_FREE;
    qmat_decimation_uninit(&s->dense);
    qmat_status status = simplify(s, state, samples, initial, &a);
    if (status == QMAT_OK) status = open_voids(s, &a);
    if (status == QMAT_OK) status = close_loops(s, &a);
    if (status == QMAT_OK && a.topology_faults > 0) status = judge_topology(s, &a);
    if (status != QMAT_OK) {
      release(&a);
      return status;
    }
    const double most_spheres = most_spheres_for_topology * (double)(best->medial ? best->medial->sphere_count : 0);
    if (!guarded || (a.topology_faults == 0 && (a.within_epsilon || !best->within_epsilon) &&
                     (double)a.medial->sphere_count <= most_spheres)) {
      release(best);
      *best = a;
    } else {
      release(&a);
    }
    if (best->topology_faults == 0) break;
  }
  return QMAT_OK;
}

static qmat_status report_in_order(qmat_context *context, const qmat_ordered_collapses *o, double epsilon,
                                   double deviation, const qmat_medial *unit, const qmat_medial_errors *errors,
                                   qmat_report *report) {
  const qmat_decimation *run = &o->decimation;
  json_t *root = report->root;
  int bad = report_run(root, run, run->complex.vertex_count, unit);
  bad |=
      json_object_set_new(root, "threshold", json_real(run->log.count > 0 ? run->log.errors[run->log.count - 1] : 0));
  bad |= report_errors(root, epsilon, deviation, errors);
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

/* Collapses that do not depend on epsilon: a single round, without fits. */
static qmat_status run_in_order(qmat_context *context, const medial_simplify_params *params, double epsilon,
                                double deviation, const qmat_value *const inputs[], qmat_value *outputs[]) {
  qmat_ordered_collapses o = {.surface = NULL};
  qmat_medial *medial = qmat_medial_new();
  qmat_report *report = qmat_report_new();
  qmat_status status = medial && report ? QMAT_OK : qmat_fail_memory(context, "the medial mesh");
  if (status == QMAT_OK) status = qmat_ordered_collapses_run(context, params, inputs, &o);
  if (status == QMAT_OK) status = qmat_decimation_extract(&o.decimation, medial);
  qmat_medial_errors errors = {.surface_to_envelope = 0};
  const double bound = o.params.epsilon > 0 ? o.params.epsilon : QMAT_DEFAULT_EPSILON;
  if (status == QMAT_OK)
    status =
        qmat_medial_surface_bound_measure(context, o.surface, medial, o.constraints.points, o.constraints.surface_count,
                                          error_tolerance * bound, least_reported * bound, INFINITY, &errors);
  if (status == QMAT_OK)
    status = qmat_medial_envelope_bound_measure(context, o.surface, medial, error_tolerance * bound,
                                                least_reported * bound, &errors);
  if (status == QMAT_OK)
    status = report_in_order(context, &o, o.params.epsilon > 0 ? epsilon : 0, deviation, medial, &errors, report);
  if (status == QMAT_OK) status = qmat_topology_report(context, medial, o.surface, report->root);
  if (status == QMAT_OK) {
    qmat_frame_spheres_to_model(qmat_surface_frame(o.surface), medial->spheres, medial->sphere_count, medial->spheres);
    status = qmat_value_seal(context, &medial->base);
  }
  if (status == QMAT_OK) status = qmat_value_seal(context, &report->base);
  if (status == QMAT_OK) {
    outputs[0] = &medial->base;
    outputs[1] = &report->base;
  } else {
    qmat_value_release(medial ? &medial->base : NULL);
    qmat_value_release(report ? &report->base : NULL);
  }
  qmat_ordered_collapses_uninit(&o);
  return status;
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  medial_simplify_params own = *(const medial_simplify_params *)params;
  const double epsilon = own.epsilon;
  double deviation;
  qmat_status status = qmat_simplify_leave_deviation(context, (const qmat_mesh *)inputs[0], &own, &deviation);
  if (status != QMAT_OK) return status;
  if (qmat_simplify_in_order(&own)) return run_in_order(context, &own, epsilon, deviation, inputs, outputs);
  const qmat_samples *samples = (const qmat_samples *)inputs[2];
  const qmat_medial *initial = (const qmat_medial *)inputs[3];
  simplifier s = {.context = context, .params = &own, .epsilon = epsilon, .deviation = deviation};
  qmat_initial_medial state = {NULL, NULL, NULL};
  attempt best = {.fault = INFINITY};
  status = qmat_simplify_prepare(context, &own, inputs, &s.surface, &state);
  if (status == QMAT_OK) status = qmat_topology_of_solid(context, s.surface, &s.solid);
  if (status == QMAT_OK) status = simplify_and_mend(&s, &own, &state, samples, initial, &best);
  if (status == QMAT_OK) status = qmat_topology_report(context, best.medial, s.surface, best.report->root);
  if (status == QMAT_OK) {
    double *spheres = best.medial->spheres;
    qmat_frame_spheres_to_model(qmat_surface_frame(s.surface), spheres, best.medial->sphere_count, spheres);
    status = qmat_value_seal(context, &best.medial->base);
  }
  if (status == QMAT_OK) status = qmat_value_seal(context, &best.report->base);
  if (status == QMAT_OK) {
    outputs[0] = &best.medial->base;
    outputs[1] = &best.report->base;
  } else {
    release(&best);
  }
  for (int i = 0; i < 2; i++) qmat_decimation_uninit(&s.rounds[i]);
  qmat_decimation_uninit(&s.dense);
  qmat_surface_free(s.surface);
  return status;
}

static const char *const exceed_rules[] = {"skip", "stop", "raise", NULL};
static const qmat_param params[] = {
    QMAT_LENGTH(qmat_simplify_params, epsilon, 0.01, 0, 1,
                "The largest distance between the surface and the envelope, either way; 0: no bound"),
    QMAT_INT(qmat_simplify_params, vertices, "spheres", 0, 0, 4294967294.0,
             "Stop at this number of medial spheres; 0: no such stop"),
    QMAT_ERROR_PARAM,
    QMAT_ENUM(
        qmat_simplify_params, on_exceed, exceed_rules, QMAT_EXCEED_SKIP,
        "Skip collapses that would exceed epsilon, stop at the first as in the paper, or raise the threshold up to it"),
    QMAT_COLLAPSE_PARAMS,
    QMAT_INT(qmat_simplify_params, refits, "passes", 8, 0, 1000,
             "Passes that fit spheres to the surface when no edge can collapse, to make room for more collapses"),
    {0},
};

static const qmat_port inputs[] = {QMAT_SIMPLIFY_INPUTS, {0}};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The simplified medial mesh"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts of spheres and collapses, both errors, and the topology"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, NULL};

const qmat_node qmat_node_medial_simplify = {
    .name = "medial.simplify",
    .version = 12,
    .summary = "Collapses medial edges, cheapest first, while surface and envelope stay within epsilon of each other",
    .doc =
        "The cost of a collapse is the slab quadratic error of the merged sphere times the squared stability ratio of "
        "the edge. A collapse is done when its sphere and the midpoints of its edges lie inside the model and both "
        "errors stay within epsilon: surface to envelope at constraint points, and the envelope of spheres, cones and "
        "slabs to the surface. Interior points must stay covered.\n\n"
        "When no edge is left, spheres are fitted to the surface and edges tried again. Branch and bound then finds "
        "places beyond epsilon between the constraint points, and the collapses are repeated with these. Uncovered "
        "interior is filled with extra spheres. Spheres of radius zero are sharp features and stay on their creases. "
        "The deviation of a subdivision surface (mesh.subdivide) is subtracted from epsilon.\n\n"
        "With on_exceed=stop or raise the threshold of both errors starts at finest and rises to epsilon; collapses do "
        "not depend on epsilon, no sphere is fitted, and medial.chain records them. cost=hausdorff keeps the end of "
        "the edge that leaves the surface nearest to the envelope; cost=pmat keeps the larger end. compat=qmat follows "
        "the public Q-MAT code: its boundary terms, free topology, no inside test and no bound.",
    .citation = "Sections 3.1.2, 3.3 and 3.4, eq. 1-6 and 9-12",
    .params_size = sizeof(medial_simplify_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .report_summary = &qmat_medial_summary,
    .libraries = libraries,
    .run = run,
};
