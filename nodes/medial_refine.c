/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.refine: adds samples where the initial medial mesh is too far from the surface, and makes it again. */
#include <math.h>
#include <string.h>

#include "core/geometry/medial_complex.h"
#include "core/geometry/sheets.h"
#include "core/geometry/thickness.h"
#include "core/geometry/vector.h"
#include "core/json_text.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/descriptor/sampled_solid.h"
#include "nodes/initial/local_resampling.h"
#include "nodes/initial/voronoi_dual.h"
#include "nodes/measure/constraint_points.h"

typedef struct {
  qmat_voronoi_dual_params dual;
  double epsilon;
  double trigger;
  double target;
  int64_t rounds;
} medial_refine_params;

/* The spacing of the test points on the surface, as a share of epsilon. */
static const double spacing_share = 0.5;

enum { MOST_ROUNDS = 8 };

/* Samples, and the initial medial mesh made of them. */
typedef struct {
  qmat_samples *samples;
  double *reaches; /* per sample, unit frame: bounds the distance to its representative; NULL: unbounded */
  qmat_medial *medial;
  size_t far_count;
  double *far_points; /* 3 each, unit frame: test points farther from the envelope than the limit */
  double farthest;    /* an upper bound for all test points; exact where it exceeds the limit */
} refinement;

typedef struct {
  qmat_context *context;
  const medial_refine_params *params;
  const qmat_mesh *mesh;
  qmat_mesh solids; /* the mesh without its sheets, which need no samples */
  const qmat_field *thickness;
  qmat_frame frame;
  double *positions; /* 3 per vertex, unit frame */
  double spacing;    /* of the test points */
  double around;     /* samples are added up to this distance from a far point */
} refiner;

static void refinement_uninit(refinement *r) {
  if (r->samples) qmat_value_release(&r->samples->base);
  if (r->medial) qmat_value_release(&r->medial->base);
  qmat_free(r->reaches);
  qmat_free(r->far_points);
  *r = (refinement){.samples = NULL};
}

/* Measures the distance to the envelope at the samples and at a grid of points between them. */
static qmat_status find_far_points(const refiner *r, double limit, refinement *found) {
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
  if (status == QMAT_OK)
    status = qmat_surface_places_make(context, &r->solids, r->positions, found->samples, points, medial, &complex,
                                      r->spacing, QMAT_MOST_CONSTRAINT_POINTS, limit, &places);
  qmat_complex_uninit(&complex);
  if (status != QMAT_OK) return status;
  found->far_count = 0;
  found->farthest = 0;
  for (size_t i = 0; i < places.count; i++) {
    found->farthest = qmat_larger(found->farthest, places.distances[i]);
    found->far_count += places.distances[i] > limit;
  }
  qmat_free(found->far_points);
  found->far_points = qmat_alloc(found->far_count, 3 * sizeof *found->far_points);
  if (!found->far_points) return qmat_fail_memory(context, "far points");
  size_t next = 0;
  for (size_t i = 0; i < places.count; i++)
    if (places.distances[i] > limit)
      memcpy(&found->far_points[3 * next++], &places.points[3 * i], 3 * sizeof *found->far_points);
  return QMAT_OK;
}

/* One round: samples are added around the far points of `from`, and the medial mesh is made again. `to->medial` stays
 * NULL if nothing changes. */
static qmat_status refine(const refiner *r, const qmat_surface *surface, const refinement *from, double spacing,
                          double limit, refinement *to) {
  qmat_context *context = r->context;
  const qmat_arena kept = context->arena; /* a round's scratch memory is released before the next round */
  context->arena = (qmat_arena){NULL};
  qmat_point_grid far;
  const qmat_resampling where = {&r->solids, &r->frame, r->positions, &far, r->around, spacing};
  qmat_status status = qmat_point_grid_init(context, from->far_points, from->far_count, &far);
  if (status == QMAT_OK)
    status = qmat_samples_densify(context, &where, from->samples, from->reaches, &to->samples, &to->reaches);
  if (status == QMAT_OK && to->samples)
    status = qmat_voronoi_dual_make(context, &r->params->dual, r->mesh, surface, r->thickness, to->samples, to->reaches,
                                    &to->medial, NULL);
  if (status == QMAT_OK && to->samples) status = find_far_points(r, limit, to);
  qmat_arena_uninit(&context->arena);
  context->arena = kept;
  return status;
}

/* --- the node ---------------------------------------------------------------------------------------------------- */

static bool is_better(const refinement *a, const refinement *b) {
  return a->farthest < b->farthest || (a->farthest == b->farthest && a->far_count < b->far_count);
}

/* Repeats with half the spacing until no point is farther than the limit or a round does not improve. The first spacing
 * is the limit. `*best` is the last round that improved. */
static qmat_status refine_in_rounds(const refiner *r, double limit, refinement *rounds, size_t *best) {
  qmat_surface *surface;
  qmat_status status = qmat_surface_new_of_solids(r->context, r->mesh, &surface);
  size_t newest = 0;
  double spacing = limit;
  for (int64_t i = 0; i < r->params->rounds && rounds[newest].far_count > 0 && status == QMAT_OK; i++) {
    refinement *next = &rounds[newest + 1];
    status = refine(r, surface, &rounds[newest], spacing, limit, next);
    spacing *= 0.5;
    if (status != QMAT_OK) break;
    if (!next->medial) {
      refinement_uninit(next);
      continue;
    }
    newest++;
    if (!is_better(next, &rounds[newest - 1])) break;
    *best = newest;
  }
  qmat_surface_free(surface);
  return status;
}

/* rounds[0] is the input; `*best` becomes the round to return. */
static qmat_status refine_where_far(refiner *r, refinement *rounds, size_t *best) {
  const medial_refine_params *params = r->params;
  const double epsilon = params->epsilon - r->mesh->deviation / r->frame.diagonal;
  *best = 0;
  if (!(params->epsilon > 0) || !(epsilon > 0) || !qmat_has_solids(r->mesh)) return QMAT_OK;
  r->positions = qmat_arena_alloc(&r->context->arena, r->mesh->vertex_count, 3 * sizeof *r->positions);
  if (!r->positions) return qmat_fail_memory(r->context, "the vertices");
  qmat_frame_to_unit(&r->frame, r->mesh->positions, r->mesh->vertex_count, r->positions);
  r->spacing = spacing_share * epsilon;
  qmat_status status = find_far_points(r, params->trigger * epsilon, &rounds[0]);
  if (status != QMAT_OK || rounds[0].far_count == 0) return status;
  const double limit = fmin(params->target, params->trigger) * epsilon;
  r->around = limit;
  status = find_far_points(r, limit, &rounds[0]);
  return status == QMAT_OK ? refine_in_rounds(r, limit, rounds, best) : status;
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
  return bad ? qmat_fail_memory(context, "the report") : qmat_value_seal(context, &report->base);
}

static qmat_status run(qmat_context *context, const void *raw_params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  refiner r = {.context = context,
               .params = raw_params,
               .mesh = (const qmat_mesh *)inputs[0],
               .solids = qmat_mesh_of_solids((const qmat_mesh *)inputs[0]),
               .thickness = (const qmat_field *)inputs[1]};
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
  if (status == QMAT_OK && best > 0) status = qmat_value_seal(context, &rounds[best].samples->base);
  if (status == QMAT_OK) {
    outputs[0] = qmat_value_retain(&rounds[best].samples->base);
    outputs[1] = qmat_value_retain(&rounds[best].medial->base);
    outputs[2] = &report->base;
  } else {
    qmat_value_release(report ? &report->base : NULL);
  }
  for (size_t i = 0; i <= MOST_ROUNDS; i++) refinement_uninit(&rounds[i]);
  return status;
}

static const qmat_param params[] = {
    QMAT_LENGTH(
        medial_refine_params, epsilon, 0.01, 0, 1,
        "The largest distance between surface and envelope that the final result may have; 0: nothing is refined"),
    QMAT_FLOAT(medial_refine_params, trigger, "epsilon", 1, 0.1, 1,
               "Refinement starts only if some point of the surface is farther from the envelope than this"),
    QMAT_FLOAT(medial_refine_params, target, "epsilon", 0.5, 0.1, 1,
               "Refinement then adds samples around all points that are farther than this"),
    QMAT_INT(medial_refine_params, rounds, "rounds", 4, 0, MOST_ROUNDS,
             "The most rounds; each halves the spacing of the added samples; 0: nothing is refined"),
    QMAT_VORONOI_DUAL_PARAMS,
    {0},
};

static const qmat_port inputs[] = {
    QMAT_SAMPLED_SOLID_INPUTS,
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The initial medial mesh of these samples, from medial.delaunay"},
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
    .version = 3,
    .summary = "Adds samples where the initial medial mesh is too far from the surface, and makes it again",
    .doc =
        "Simplification cannot repair an initial medial mesh that is too far from the surface. This node measures the "
        "distance at all samples and at a grid between them. If a point is farther than the trigger, evenly spaced "
        "samples are added around all points farther than the target, and the medial mesh is made again. Each further "
        "round halves the spacing. The result is the round that comes closest.\n\n"
        "If no point is that far, samples and medial mesh pass through unchanged, so a new epsilon recomputes nothing "
        "before medial.simplify.\n\n"
        "The parameters after rounds are those of medial.delaunay. Set both nodes to the same values.",
    .citation = "Sections 3.2 and 3.4",
    .params_size = sizeof(medial_refine_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
