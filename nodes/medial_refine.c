/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.refine: adds samples where the initial medial mesh is too far from the surface, and makes it again. */
#include <math.h>
#include <string.h>

#include "core/geometry/medial_complex.h"
#include "core/geometry/sheets.h"
#include "core/geometry/thickness.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "core/json_text.h"
#include "nodes/descriptor/epsilon.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/descriptor/sampled_solid.h"
#include "nodes/initial/crease_spheres.h"
#include "nodes/initial/local_resampling.h"
#include "nodes/initial/voronoi_dual.h"
#include "nodes/measure/constraint_points.h"

typedef struct {
  qmat_voronoi_dual_params dual;
  int64_t vertices;
  double trigger;
  double target;
  int64_t rounds;
} medial_refine_params;

/* The error of N spheres, in diagonals, is more than this divided by N where they describe an organic shape (a third
 * for ant and bug), so the initial medial mesh need not be nearer. The more it is refined, the longer each run of the
 * search takes. */
static const double least_error_of_one_sphere = 0.25;

/* The spacing of the test points on the surface, as a share of epsilon. */
static const double spacing_share = 0.5;

/* A round brings a far place nearer if its distance falls below this share. Other places are given up: around a sheet
 * of an open surface there is no solid that a sphere could fill. */
static const double nearer_share = 0.9;

/* Samples at most this far apart, in limits, show whether they help: a spike that is narrower than their spacing stays
 * as far as it was. */
static const double fine_share = 0.25;

/* Samples are added up to this distance from a far place, as a multiple of their spacing. */
static const double reach_of_samples = 3;

enum { MOST_ROUNDS = 8 };

/* The epsilon to refine for, in diagonals, where only the number of spheres of the result is given (0: any). */
static double epsilon_of_count(int64_t vertices) {
  if (vertices == 0) return QMAT_FINEST_EPSILON;
  return fmin(fmax(least_error_of_one_sphere / (double)vertices, QMAT_FINEST_EPSILON), QMAT_DEFAULT_EPSILON);
}

/* Samples, and the initial medial mesh made of them. */
typedef struct {
  qmat_samples *samples;
  double *reaches; /* per sample, unit frame: bounds the distance to its representative; NULL: unbounded */
  qmat_medial *medial;
  size_t far_count;
  double farthest;   /* an upper bound for all test points; exact where it exceeds the limit */
  double *distances; /* per place: an upper bound, exact where it exceeds the limit */
  double excess;     /* the sum over all places of what exceeds the limit */
} refinement;

typedef struct {
  qmat_context *context;
  medial_refine_params params;
  const qmat_mesh *mesh;
  qmat_mesh solids; /* the mesh without its sheets, which need no samples */
  const qmat_field *thickness;
  qmat_frame frame;
  qmat_crease_spheres creases; /* of the medial mesh; those of every round */
  double *positions;           /* 3 per vertex, unit frame */
  double spacing;              /* of the test points */
  /* The test points of all rounds: the samples of the input, then the grid. */
  size_t known, place_count;
  double *places;    /* 3 each, unit frame */
  uint8_t *given_up; /* per place */
} refiner;

static void refinement_uninit(refinement *r) {
  if (r->samples) qmat_value_release(&r->samples->base);
  if (r->medial) qmat_value_release(&r->medial->base);
  qmat_free(r->reaches);
  qmat_free(r->distances);
  *r = (refinement){.samples = NULL};
}

/* Keeps the distances of the places of all rounds; the samples that rounds added lie between them. */
static qmat_status note_places(refiner *r, const qmat_constraint_points *measured, double limit, refinement *found) {
  const size_t grid = measured->count - measured->sample_count, added = measured->sample_count - r->known;
  if (!r->places) {
    r->place_count = r->known + grid;
    r->places = qmat_arena_alloc(&r->context->arena, r->place_count, 3 * sizeof *r->places);
    r->given_up = qmat_arena_calloc(&r->context->arena, r->place_count, sizeof *r->given_up);
    if (!r->places || !r->given_up) return qmat_fail_memory(r->context, "places");
    memcpy(r->places, measured->points, 3 * r->place_count * sizeof *r->places);
  }
  if (!found->distances) found->distances = qmat_alloc(r->place_count, sizeof *found->distances);
  if (!found->distances) return qmat_fail_memory(r->context, "places");
  found->excess = 0;
  for (size_t i = 0; i < r->place_count; i++) {
    found->distances[i] = measured->distances[i < r->known ? i : i + added];
    found->excess += fmax(found->distances[i] - limit, 0);
  }
  return QMAT_OK;
}

/* Measures the distance to the envelope at the samples and at a grid of points between them. */
static qmat_status find_far_places(refiner *r, double limit, refinement *found) {
  qmat_context *context = r->context;
  const qmat_medial *medial = found->medial;
  double *points = qmat_arena_alloc(&context->arena, found->samples->count, 3 * sizeof *points);
  double *spheres = qmat_arena_alloc(&context->arena, medial->sphere_count, 4 * sizeof *spheres);
  if (!points || !spheres) return qmat_fail_memory(context, "the samples");
  qmat_frame_to_unit(&r->frame, found->samples->positions, found->samples->count, points);
  qmat_frame_spheres_to_unit(&r->frame, medial->spheres, medial->sphere_count, spheres);
  qmat_complex complex;
  qmat_constraint_points places;
  qmat_status status = qmat_complex_init(context, &complex, medial, spheres);
  const qmat_place_request request = {
      &r->solids, r->positions, found->samples, points, r->spacing, QMAT_MOST_CONSTRAINT_POINTS, limit};
  if (status == QMAT_OK) status = qmat_surface_places_make(context, &request, medial, &complex, &places);
  qmat_complex_uninit(&complex);
  if (status != QMAT_OK) return status;
  found->far_count = 0;
  found->farthest = 0;
  for (size_t i = 0; i < places.count; i++) {
    found->farthest = qmat_larger(found->farthest, places.distances[i]);
    found->far_count += places.distances[i] > limit;
  }
  return note_places(r, &places, limit, found);
}

/* The far places that are not given up; 3 doubles each in the arena. */
static qmat_status choose_targets(const refiner *r, const refinement *from, double limit, double **targets,
                                  size_t *count) {
  *count = 0;
  *targets = qmat_arena_alloc(&r->context->arena, from->far_count, 3 * sizeof **targets);
  if (!*targets) return qmat_fail_memory(r->context, "far places");
  for (size_t i = 0; i < r->place_count; i++)
    if (from->distances[i] > limit && !r->given_up[i])
      memcpy(&(*targets)[3 * (*count)++], &r->places[3 * i], 3 * sizeof **targets);
  return QMAT_OK;
}

/* The depths below a place at which it is asked for solid, in limits. */
static const double solid_depths[] = {0.02, 0.25, 1};

static bool has_solid_below(const qmat_surface *surface, const double place[3], double limit) {
  uint32_t triangle = 0;
  (void)qmat_surface_distance(surface, place, INFINITY, NULL, &triangle);
  const uint32_t *ids = &qmat_surface_mesh(surface)->triangles[3 * (size_t)triangle];
  const double *p = qmat_surface_positions(surface);
  double normal[3], below[3];
  (void)qmat_triangle_area(&p[3 * (size_t)ids[0]], &p[3 * (size_t)ids[1]], &p[3 * (size_t)ids[2]], normal);
  for (size_t i = 0; i < sizeof solid_depths / sizeof *solid_depths; i++) {
    for (size_t k = 0; k < 3; k++) below[k] = place[k] - solid_depths[i] * limit * normal[k];
    if (qmat_surface_inside(surface, below)) return true;
  }
  return false;
}

enum { PLACES_PER_REPORT = 256 };

/* On an open surface, gives up the far places without solid below: no sphere can come nearer. */
static qmat_status give_up_without_solid(refiner *r, const qmat_surface *surface, const refinement *from,
                                         double limit) {
  if (r->solids.closed) return QMAT_OK;
  const int threads = qmat_threads(r->context);
  for (size_t first = 0, last; first < r->place_count; first = last) {
    const qmat_status status = qmat_progress(r->context, first, r->place_count, "places");
    if (status != QMAT_OK) return status;
    size_t asked = 0;
    for (last = first; last < r->place_count && asked < PLACES_PER_REPORT; last++)
      asked += from->distances[last] > limit;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
    for (size_t i = first; i < last; i++)
      if (from->distances[i] > limit) r->given_up[i] = !has_solid_below(surface, &r->places[3 * i], limit);
  }
  return QMAT_OK;
}

/* Gives up the far places that a round did not bring nearer. */
static void give_up(refiner *r, const refinement *from, const refinement *to, double limit) {
  for (size_t i = 0; i < r->place_count; i++)
    r->given_up[i] |= from->distances[i] > limit && to->distances[i] > nearer_share * from->distances[i];
}

/* Makes the medial mesh of the samples of `to`, with the spheres of creases. */
static qmat_status make_medial(const refiner *r, const qmat_surface *surface, refinement *to) {
  qmat_context *context = r->context;
  qmat_medial *bare;
  qmat_crease_links links;
  qmat_status status = qmat_voronoi_dual_make(context, &r->params.dual, r->mesh, surface, r->thickness, to->samples,
                                              to->reaches, &bare, NULL);
  if (status != QMAT_OK || r->creases.count == 0) {
    to->medial = bare;
    return status;
  }
  status = qmat_crease_spheres_link(context, &r->frame, bare, &r->creases, &to->medial, &links);
  qmat_value_release(&bare->base);
  return status;
}

/* One round: samples are added around the far places of `from`, and the medial mesh is made again. `to->medial` stays
 * NULL if there is none, or nothing changes. */
static qmat_status refine(refiner *r, const qmat_surface *surface, const refinement *from, double spacing, double limit,
                          refinement *to) {
  qmat_context *context = r->context;
  const qmat_arena aside = qmat_arena_set_aside(&context->arena); /* each round frees its scratch memory */
  qmat_point_grid far;
  const qmat_resampling where = {&r->solids, &r->frame, r->positions, &far, reach_of_samples * spacing, spacing};
  double *targets;
  size_t count;
  qmat_status status = choose_targets(r, from, limit, &targets, &count);
  if (status == QMAT_OK && count > 0) {
    status = qmat_point_grid_init(context, targets, count, &far);
    if (status == QMAT_OK)
      status = qmat_samples_densify(context, &where, from->samples, from->reaches, &to->samples, &to->reaches);
    if (status == QMAT_OK && to->samples) status = make_medial(r, surface, to);
    if (status == QMAT_OK && to->samples) status = find_far_places(r, limit, to);
  }
  qmat_arena_put_back(&context->arena, aside);
  return status;
}

/* The largest distance from a far place to the samples. */
static qmat_status find_widest_gap(const refiner *r, const refinement *from, double limit, double *gap) {
  qmat_context *context = r->context;
  double *samples = qmat_arena_alloc(&context->arena, from->samples->count, 3 * sizeof *samples);
  if (!samples) return qmat_fail_memory(context, "the samples");
  qmat_frame_to_unit(&r->frame, from->samples->positions, from->samples->count, samples);
  qmat_point_grid grid;
  qmat_status status = qmat_point_grid_init(context, samples, from->samples->count, &grid);
  *gap = 0;
  for (size_t i = 0; i < r->place_count && status == QMAT_OK; i++) {
    if (i % 4096 == 0) status = qmat_progress(context, i, r->place_count, "places");
    if (!(from->distances[i] > limit) || r->given_up[i]) continue;
    const double *place = &r->places[3 * i];
    *gap = qmat_larger(*gap, qmat_point_distance(place, &samples[3 * (size_t)qmat_point_grid_nearest(&grid, place)]));
  }
  return status;
}

/* --- the node ---------------------------------------------------------------------------------------------------- */

/* A round within epsilon is better than one that is not, then the one with less excess. */
static bool is_better(const refinement *a, const refinement *b, double epsilon) {
  const bool within = a->farthest <= epsilon;
  return within == (b->farthest <= epsilon) ? a->excess < b->excess : within;
}

/* Repeats with half the spacing until no place is farther than `enough`, or all that are have been given up. The first
 * samples are as far apart as the gaps between those around: much finer ones would leave the places between both too
 * far. Where the spacing is fine, a round that does not improve is the last one, and places are given up. `*best`
 * becomes the best round. */
static qmat_status refine_in_rounds(refiner *r, double epsilon, double limit, double enough, refinement *rounds,
                                    size_t *best) {
  qmat_surface *surface;
  qmat_status status = qmat_surface_new_of_solids(r->context, r->mesh, &surface);
  if (status == QMAT_OK) status = give_up_without_solid(r, surface, &rounds[0], limit);
  size_t newest = 0;
  double gap = 0;
  if (status == QMAT_OK) status = find_widest_gap(r, &rounds[0], limit, &gap);
  double spacing = qmat_larger(gap, limit);
  for (int64_t i = 0; i < r->params.rounds && rounds[newest].farthest > enough && status == QMAT_OK; i++) {
    refinement *next = &rounds[newest + 1];
    const bool is_fine = spacing <= fine_share * limit;
    status = refine(r, surface, &rounds[newest], spacing, limit, next);
    spacing *= 0.5;
    if (status != QMAT_OK) break;
    if (!next->medial) {
      refinement_uninit(next);
      continue;
    }
    newest++;
    if (is_better(next, &rounds[*best], epsilon))
      *best = newest;
    else if (is_fine)
      break;
    if (is_fine) give_up(r, &rounds[newest - 1], next, limit);
  }
  qmat_surface_free(surface);
  return status;
}

/* rounds[0] is the input; `*best` becomes the round to return. */
static qmat_status refine_where_far(refiner *r, refinement *rounds, size_t *best) {
  const medial_refine_params *params = &r->params;
  const double epsilon = params->dual.epsilon - r->mesh->deviation / r->frame.diagonal;
  *best = 0;
  if (!(epsilon > 0) || !qmat_has_solids(r->mesh)) return QMAT_OK;
  r->positions = qmat_arena_alloc(&r->context->arena, r->mesh->vertex_count, 3 * sizeof *r->positions);
  if (!r->positions) return qmat_fail_memory(r->context, "the vertices");
  qmat_frame_to_unit(&r->frame, r->mesh->positions, r->mesh->vertex_count, r->positions);
  r->spacing = spacing_share * epsilon;
  r->known = rounds[0].samples->count;
  const double enough = params->trigger * epsilon, limit = fmin(params->target, params->trigger) * epsilon;
  qmat_status status = find_far_places(r, enough, &rounds[0]);
  if (status != QMAT_OK || rounds[0].far_count == 0) return status;
  status = qmat_crease_spheres_of_medial(r->context, rounds[0].medial, &r->creases);
  if (status == QMAT_OK) status = find_far_places(r, limit, &rounds[0]);
  return status == QMAT_OK ? refine_in_rounds(r, epsilon, limit, enough, rounds, best) : status;
}

static qmat_status make_report(qmat_context *context, const refinement *rounds, size_t best, qmat_report *report) {
  const refinement *before = &rounds[0], *after = &rounds[best];
  json_t *root = report->root;
  int bad = qmat_json_set_count(root, "rounds", best);
  bad |= qmat_json_set_count(root, "samples_added", after->samples->count - before->samples->count);
  bad |= qmat_json_set_count(root, "spheres", after->medial->sphere_count);
  bad |= qmat_json_set_count(root, "far_places", before->far_count);
  bad |= qmat_json_set_count(root, "far_places_left", after->far_count);
  bad |= json_object_set_new(root, "farthest_place", json_real(before->farthest));
  bad |= json_object_set_new(root, "farthest_place_left", json_real(after->farthest));
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *raw_params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  refiner r = {.context = context,
               .params = *(const medial_refine_params *)raw_params,
               .mesh = (const qmat_mesh *)inputs[0],
               .solids = qmat_mesh_of_solids((const qmat_mesh *)inputs[0]),
               .thickness = (const qmat_field *)inputs[1]};
  if (r.params.dual.epsilon == 0) r.params.dual.epsilon = epsilon_of_count(r.params.vertices);
  refinement rounds[MOST_ROUNDS + 1] = {
      {.samples = (qmat_samples *)qmat_value_retain(inputs[2]), .medial = (qmat_medial *)qmat_value_retain(inputs[3])}};
  size_t best = 0;
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = qmat_thickness_check(context, r.mesh, r.thickness, rounds[0].samples);
  if (status == QMAT_OK && rounds[0].medial->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh has no sphere");
    status = qmat_fail_field(context, "medial");
  }
  if (status == QMAT_OK) status = qmat_frame_of_mesh(context, r.mesh, &r.frame);
  if (status == QMAT_OK) status = refine_where_far(&r, rounds, &best);
  if (status == QMAT_OK) status = make_report(context, rounds, best, report);
  status = qmat_hand_over(
      context, status,
      (qmat_value *const[]){qmat_value_retain(&rounds[best].samples->base),
                            qmat_value_retain(&rounds[best].medial->base), report ? &report->base : NULL},
      3, outputs);
  for (size_t i = 0; i <= MOST_ROUNDS; i++) refinement_uninit(&rounds[i]);
  qmat_crease_spheres_uninit(&r.creases);
  return status;
}

static const qmat_param params[] = {
    QMAT_LENGTH(qmat_voronoi_dual_params, epsilon, 0.01, 0, 1,
                "The largest distance between surface and envelope that the final result may have; 0: it follows from "
                "vertices"),
    QMAT_INT(
        medial_refine_params, vertices, "spheres", 0, 0, 4294967294.0,
        "With epsilon=0: the number of spheres of the final result. The initial medial mesh is refined for an epsilon "
        "of 25% divided by this number, but at least 0.25% and at most 1%; 0: for 0.25%, the least that "
        "medial.simplify tries"),
    QMAT_FLOAT(medial_refine_params, trigger, "epsilon", 0.95, 0.1, 1,
               "Refinement goes on only while some point of the surface is farther from the envelope than this"),
    QMAT_FLOAT(medial_refine_params, target, "epsilon", 0.5, 0.1, 1,
               "Refinement then adds samples around all points that are farther than this"),
    QMAT_INT(medial_refine_params, rounds, "rounds", 6, 0, MOST_ROUNDS,
             "The most rounds; each halves the spacing of the added samples; 0: nothing is refined"),
    QMAT_VORONOI_DUAL_PARAMS,
    {0},
};

static const qmat_port inputs[] = {
    QMAT_SAMPLED_SOLID_INPUTS,
    {.name = "medial",
     .type = QMAT_MEDIAL,
     .doc = "The initial medial mesh of these samples, from medial.delaunay or medial.features"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "samples", .type = QMAT_SAMPLES, .doc = "The same points, with the added ones at the end"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh of these samples; the input if nothing is added"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Distances before and after, rounds, and added samples"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, NULL};

const qmat_node qmat_node_medial_refine = {
    .name = "medial.refine",
    .version = 25,
    .summary = "Adds samples where the initial medial mesh is too far from the surface, and makes it again",
    .doc =
        "Simplification cannot repair an initial medial mesh that is too far from the surface. This node measures the "
        "distance at all samples and at a grid between them. If a point is farther than the trigger, evenly spaced "
        "samples are added around all points farther than the target, and the medial mesh is made again. The first "
        "ones are as far apart as the gaps between the samples there. Each further round halves that, until no point "
        "is farther than the trigger. Places that fine samples bring no nearer are given up, as are those of an "
        "open surface without solid below. The result is the round that leaves the least excess over the target, of "
        "those within epsilon if there are any.\n\n"
        "The spheres that medial.features has added stay as they are and are linked again in each round. No samples "
        "are needed next to them.\n\n"
        "If no point is that far, samples and medial mesh pass through unchanged, so a new epsilon recomputes nothing "
        "before medial.simplify.\n\n"
        "The parameters after rounds are those of medial.delaunay. Set both nodes to the same values.",
    .citation = "Sections 3.2 and 3.4",
    .params_size = sizeof(medial_refine_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 15,
    .run = run,
};
