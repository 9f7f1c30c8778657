/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.refine: an initial medial mesh made anew of more samples where it is far from the surface. */
#include <math.h>
#include <string.h>

#include "core/geometry/medial_complex.h"
#include "core/geometry/thickness.h"
#include "core/geometry/vector.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/descriptor/sampled_solid.h"
#include "nodes/initial/sample_spacing.h"
#include "nodes/initial/voronoi_dual.h"
#include "nodes/measure/constraint_points.h"
#include "nodes/measure/point_grid.h"

typedef struct {
  qmat_dual_params dual;
  double epsilon;
  double tolerated;
  double share;
  int64_t rounds;
} medial_refine_params;

/* The grid on which the distance is looked at, as a share of epsilon. */
static const double spacing_share = 0.5;

enum { MOST_PLACES = 600000, MOST_ADDED = 1 << 20 };

/* What stands for a sample is no farther away than this share of the spacing that is wanted around it: less than what
 * displaces the points of neighbouring rows. */
static const double reach_share = 0.5;

/* Samples, and the initial medial mesh that is made of them. */
typedef struct {
  qmat_samples *samples;
  double *reaches; /* one a sample, unit frame; NULL: the rule for all */
  qmat_medial *medial;
  size_t far_count;
  double *far_points; /* 3 each, unit frame: places of the surface that are farther from the envelope than the limit */
  double farthest;    /* no place that was looked at is farther, and one is so far where that is beyond the limit */
} refinement;

typedef struct {
  qmat_context *context;
  const medial_refine_params *params;
  const qmat_mesh *mesh;
  const qmat_field *thickness;
  qmat_frame frame;
  double *positions; /* 3 a vertex, unit frame */
  double spacing;    /* of the grid that is looked at */
  double around;     /* so far from a far place more samples are wanted */
} refiner;

static void refinement_uninit(refinement *r) {
  if (r->samples) qmat_value_release(&r->samples->base);
  if (r->medial) qmat_value_release(&r->medial->base);
  qmat_free(r->reaches);
  qmat_free(r->far_points);
  *r = (refinement){.samples = NULL};
}

static double *unit_samples_of(const refiner *r, const qmat_samples *samples) {
  double *points = qmat_arena_alloc(&r->context->arena, samples->count, 3 * sizeof *points);
  if (points) qmat_frame_to_unit(&r->frame, samples->positions, samples->count, points);
  return points;
}

/* Looks at the samples and a grid between them for what is farther from the envelope than the limit. */
static qmat_status find_far_places(const refiner *r, double limit, refinement *found) {
  qmat_context *context = r->context;
  const qmat_medial *medial = found->medial;
  const double *points = unit_samples_of(r, found->samples);
  double *spheres = qmat_arena_alloc(&context->arena, medial->sphere_count, 4 * sizeof *spheres);
  if (!points || !spheres) return qmat_fail_memory(context, "the samples");
  qmat_frame_spheres_to_unit(&r->frame, medial->spheres, medial->sphere_count, spheres);
  qmat_complex complex;
  qmat_constraint_points places;
  qmat_status status = qmat_complex_init(context, &complex, medial, spheres);
  if (status == QMAT_OK)
    status = qmat_surface_places_make(context, r->mesh, r->positions, found->samples, points, medial, &complex,
                                      r->spacing, MOST_PLACES, limit, &places);
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
  if (!found->far_points) return qmat_fail_memory(context, "places that are far");
  size_t next = 0;
  for (size_t i = 0; i < places.count; i++)
    if (places.distances[i] > limit)
      memcpy(&found->far_points[3 * next++], &places.points[3 * i], 3 * sizeof *found->far_points);
  return QMAT_OK;
}

/* New samples, as they are found. */
typedef struct {
  size_t count, facet_capacity, weight_capacity;
  uint32_t *facets;
  double *barycentrics; /* 3 each */
} added_samples;

static void added_uninit(added_samples *added) {
  qmat_free(added->facets);
  qmat_free(added->barycentrics);
}

static void place_in_facet(const refiner *r, size_t facet, const double *weights, double place[3]) {
  const uint32_t *ids = &r->mesh->triangles[3 * facet];
  for (size_t k = 0; k < 3; k++)
    place[k] = weights[0] * r->positions[3 * (size_t)ids[0] + k] + weights[1] * r->positions[3 * (size_t)ids[1] + k] +
               weights[2] * r->positions[3 * (size_t)ids[2] + k];
}

/* Even points of one facet, where they are near far places; `scratch` has room for them. */
static qmat_status add_in_facet(const refiner *r, const qmat_point_grid *far, double spacing, size_t facet,
                                const uint32_t *on_sides, uint64_t in_rows, double *scratch, added_samples *added) {
  const uint32_t *ids = &r->mesh->triangles[3 * facet];
  const double *a = &r->positions[3 * (size_t)ids[0]], *b = &r->positions[3 * (size_t)ids[1]],
               *c = &r->positions[3 * (size_t)ids[2]];
  size_t count = 0;
  for (int side = 0; side < 3; side++) {
    qmat_side_points_fill(side, on_sides[side], &scratch[3 * count]);
    count += on_sides[side];
  }
  if (in_rows) qmat_row_points_fill(a, b, c, spacing, qmat_hash3(0, facet, 0), in_rows, &scratch[3 * count]);
  count += in_rows;
  if (qmat_grow((void **)&added->facets, &added->facet_capacity, added->count + count, sizeof *added->facets) ||
      qmat_grow((void **)&added->barycentrics, &added->weight_capacity, 3 * (added->count + count),
                sizeof *added->barycentrics))
    return qmat_fail_memory(r->context, "further samples");
  for (size_t i = 0; i < count; i++) {
    double place[3];
    place_in_facet(r, facet, &scratch[3 * i], place);
    if (!qmat_point_grid_has_within(far, place, r->around)) continue;
    added->facets[added->count] = (uint32_t)facet;
    memcpy(&added->barycentrics[3 * added->count++], &scratch[3 * i], 3 * sizeof *scratch);
  }
  return QMAT_OK;
}

/* Whether more samples may be wanted anywhere on a facet. */
static bool is_facet_near(const refiner *r, const qmat_point_grid *far, size_t facet) {
  static const double middle[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
  double centre[3], reach = 0;
  place_in_facet(r, facet, middle, centre);
  for (size_t k = 0; k < 3; k++)
    reach =
        qmat_larger(reach, qmat_point_distance(&r->positions[3 * (size_t)r->mesh->triangles[3 * facet + k]], centre));
  return qmat_point_grid_has_within(far, centre, reach + r->around);
}

/* Finds even points around the far places; `*fit` becomes false where they would be too many. */
static qmat_status find_further_samples(const refiner *r, const qmat_point_grid *far, double spacing,
                                        added_samples *added, bool *fit) {
  qmat_context *context = r->context;
  const qmat_mesh *mesh = r->mesh;
  uint32_t *on_sides = qmat_arena_alloc(&context->arena, 3 * mesh->triangle_count, sizeof *on_sides);
  uint64_t *in_rows = qmat_arena_calloc(&context->arena, mesh->triangle_count, sizeof *in_rows);
  uint8_t *is_near = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *is_near);
  if (!on_sides || !in_rows || !is_near) return qmat_fail_memory(context, "further samples");
  qmat_status status = qmat_side_points_count(context, mesh, r->positions, spacing, on_sides);
  const int threads = qmat_threads(context);
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *ids = &mesh->triangles[3 * t];
    is_near[t] = is_facet_near(r, far, t);
    if (is_near[t])
      in_rows[t] = qmat_row_points_count(&r->positions[3 * (size_t)ids[0]], &r->positions[3 * (size_t)ids[1]],
                                         &r->positions[3 * (size_t)ids[2]], spacing);
  }
  uint64_t most = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    if (!is_near[t]) continue;
    const uint64_t count = in_rows[t] + on_sides[3 * t] + on_sides[3 * t + 1] + on_sides[3 * t + 2];
    most = count > most ? count : most;
  }
  *fit = most <= MOST_ADDED;
  if (!*fit) return status;
  double *scratch = qmat_arena_alloc(&context->arena, most, 3 * sizeof *scratch);
  if (!scratch) return qmat_fail_memory(context, "further samples");
  for (size_t t = 0; t < mesh->triangle_count && status == QMAT_OK && *fit; t++) {
    if (t % 1024 == 0) status = qmat_progress(context, t, mesh->triangle_count, "facets");
    if (status == QMAT_OK && is_near[t])
      status = add_in_facet(r, far, spacing, t, &on_sides[3 * t], in_rows[t], scratch, added);
    *fit = added->count <= MOST_ADDED;
  }
  return status;
}

/* The samples of `from` and the further ones behind them, with how far away what stands for them may be: around far
 * places no farther than a share of the spacing. `*changed`: whether that is anything new. */
static qmat_status join_samples(const refiner *r, const refinement *from, const qmat_point_grid *far, double spacing,
                                const added_samples *added, refinement *to, bool *changed) {
  qmat_context *context = r->context;
  const qmat_samples *before = from->samples;
  const size_t known = before->count, count = known + added->count;
  const double *points = unit_samples_of(r, before);
  to->samples = qmat_samples_new();
  to->reaches = qmat_alloc(count, sizeof *to->reaches);
  if (!points || !to->samples || !to->reaches) return qmat_fail_memory(context, "further samples");
  qmat_samples *samples = to->samples;
  samples->vertex_count = before->vertex_count;
  samples->count = count;
  samples->positions = qmat_alloc(count, 3 * sizeof *samples->positions);
  samples->facets = qmat_alloc(count, sizeof *samples->facets);
  samples->barycentrics = qmat_alloc(count, 3 * sizeof *samples->barycentrics);
  if (!samples->positions || !samples->facets || !samples->barycentrics)
    return qmat_fail_memory(context, "further samples");
  memcpy(samples->positions, before->positions, 3 * known * sizeof *samples->positions);
  memcpy(samples->facets, before->facets, known * sizeof *samples->facets);
  memcpy(samples->barycentrics, before->barycentrics, 3 * known * sizeof *samples->barycentrics);
  const double reach = reach_share * spacing;
  *changed = added->count > 0;
  for (size_t i = 0; i < known; i++) {
    to->reaches[i] = from->reaches ? from->reaches[i] : INFINITY;
    if (to->reaches[i] <= reach || !qmat_point_grid_has_within(far, &points[3 * i], r->around)) continue;
    to->reaches[i] = reach;
    *changed = true;
  }
  for (size_t i = 0; i < added->count; i++) {
    const uint32_t *ids = &r->mesh->triangles[3 * (size_t)added->facets[i]];
    const double *weights = &added->barycentrics[3 * i];
    to->reaches[known + i] = reach;
    samples->facets[known + i] = added->facets[i];
    memcpy(&samples->barycentrics[3 * (known + i)], weights, 3 * sizeof *weights);
    for (size_t k = 0; k < 3; k++)
      samples->positions[3 * (known + i) + k] = weights[0] * r->mesh->positions[3 * (size_t)ids[0] + k] +
                                                weights[1] * r->mesh->positions[3 * (size_t)ids[1] + k] +
                                                weights[2] * r->mesh->positions[3 * (size_t)ids[2] + k];
  }
  return QMAT_OK;
}

/* One round: more samples around the far places of `from`, and what is then farther than the limit. Where there is
 * nothing to change `to->medial` is NULL. */
static qmat_status refine(const refiner *r, const qmat_surface *surface, const refinement *from, double spacing,
                          double limit, refinement *to) {
  qmat_context *context = r->context;
  const qmat_arena kept = context->arena; /* what a round needs is not kept for the next */
  context->arena = (qmat_arena){NULL};
  added_samples added = {.count = 0};
  qmat_point_grid far;
  bool fit = false, changed = false;
  qmat_status status = qmat_point_grid_init(context, from->far_points, from->far_count, &far);
  if (status == QMAT_OK) status = find_further_samples(r, &far, spacing, &added, &fit);
  if (status == QMAT_OK && fit) status = join_samples(r, from, &far, spacing, &added, to, &changed);
  if (status == QMAT_OK && changed)
    status = qmat_medial_dual_make(context, &r->params->dual, surface, r->thickness, to->samples, to->reaches,
                                   &to->medial, NULL);
  if (status == QMAT_OK && changed) status = find_far_places(r, limit, to);
  added_uninit(&added);
  qmat_arena_uninit(&context->arena);
  context->arena = kept;
  return status;
}

/* --- the node -------------------------------------------------------------------------------------------------------
 */

enum { MOST_ROUNDS = 8 };

static bool is_better(const refinement *a, const refinement *b) {
  return a->farthest < b->farthest || (a->farthest == b->farthest && a->far_count < b->far_count);
}

/* Rounds with ever closer samples until no place is farther than the limit, which is the spacing of the first, or a
 * round gains nothing. `*best` is the last one that did. */
static qmat_status refine_in_rounds(const refiner *r, double limit, refinement *rounds, size_t *best) {
  qmat_surface *surface;
  qmat_status status = qmat_surface_new(r->context, r->mesh, &surface);
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

/* rounds[0] is what is there; `*best` gets what is to be handed on. */
static qmat_status refine_where_far(refiner *r, refinement *rounds, size_t *best) {
  const medial_refine_params *params = r->params;
  const double held = params->epsilon - r->mesh->deviation / r->frame.diagonal;
  *best = 0;
  if (!(params->epsilon > 0) || !(held > 0)) return QMAT_OK;
  r->positions = qmat_arena_alloc(&r->context->arena, r->mesh->vertex_count, 3 * sizeof *r->positions);
  if (!r->positions) return qmat_fail_memory(r->context, "the vertices");
  qmat_frame_to_unit(&r->frame, r->mesh->positions, r->mesh->vertex_count, r->positions);
  r->spacing = spacing_share * held;
  qmat_status status = find_far_places(r, params->tolerated * held, &rounds[0]);
  if (status != QMAT_OK || rounds[0].far_count == 0) return status;
  const double limit = fmin(params->share, params->tolerated) * held;
  r->around = limit;
  status = find_far_places(r, limit, &rounds[0]);
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
               .thickness = (const qmat_field *)inputs[1]};
  refinement rounds[MOST_ROUNDS + 1] = {
      {.samples = (qmat_samples *)qmat_value_retain(inputs[2]), .medial = (qmat_medial *)qmat_value_retain(inputs[3])}};
  size_t best = 0;
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = qmat_thickness_check(context, r.mesh, r.thickness, rounds[0].samples);
  if (status == QMAT_OK && rounds[0].medial->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "there is no medial sphere");
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

#define AT(field) offsetof(medial_refine_params, field)

static const qmat_param params[] = {
    {.name = "epsilon",
     .unit = "diagonal",
     .doc = "The largest distance between surface and envelope that is wanted in the end; 0: nothing is refined",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0.01,
     .min = 0,
     .max = 1,
     .flags = QMAT_PARAM_RELATIVE,
     .offset = AT(epsilon)},
    {.name = "tolerated",
     .unit = "epsilon",
     .doc = "Nothing is refined where no place of the surface is farther from the medial mesh than this",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 1,
     .min = 0.1,
     .max = 1,
     .offset = AT(tolerated)},
    {.name = "share",
     .unit = "epsilon",
     .doc = "Else all places that are farther than this get more samples",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0.5,
     .min = 0.1,
     .max = 1,
     .offset = AT(share)},
    {.name = "rounds",
     .unit = "rounds",
     .doc = "How often samples are added at most, each time half as far apart; 0: never",
     .type = QMAT_PARAM_INT,
     .default_number = 4,
     .min = 0,
     .max = MOST_ROUNDS,
     .offset = AT(rounds)},
    QMAT_DUAL_PARAMS,
    {0},
};

static const qmat_port inputs[] = {
    QMAT_SAMPLED_SOLID_INPUTS,
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The initial medial mesh of these samples, from medial.delaunay"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "samples", .type = QMAT_SAMPLES, .doc = "The same points, and further ones behind them where it was far"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The same medial mesh, or the one of these samples"},
    {.name = "report", .type = QMAT_REPORT, .doc = "How far the surface was, and what that took"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, NULL};

const qmat_node qmat_node_medial_refine = {
    .name = "medial.refine",
    .version = 1,
    .summary = "Samples a surface more closely where the initial medial mesh is far from it, and makes that anew",
    .doc =
        "No simplification comes closer to the surface than its initial medial mesh does. The distance is looked at in "
        "all samples and on a grid between them. Where a place is farther than is tolerated, facets get even samples "
        "around all places farther than a share of epsilon, for which no others stand in the triangulation, and the "
        "medial mesh is made anew; so up to a few times, with samples half as far apart. What comes closest to the "
        "surface is the result. Where no place is so far, samples and medial mesh are handed on as they are: a changed "
        "epsilon then changes nothing before medial.simplify. The parameters after rounds are those of "
        "medial.delaunay, and mean the same.",
    .citation = "Sections 3.2 and 3.4",
    .params_size = sizeof(medial_refine_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
