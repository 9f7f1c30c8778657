/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.evaluate: proved bounds of the distances between a medial mesh and a surface, and the topology of both. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/medial_distance.h"
#include "core/json_text.h"
#include "core/node.h"
#include "nodes/descriptor/medial_summary.h"
#include "nodes/measure/area_samples.h"
#include "nodes/measure/boundary_distance.h"
#include "nodes/measure/hausdorff_bound.h"
#include "nodes/measure/sphere_errors.h"
#include "nodes/measure/storage_share.h"
#include "nodes/measure/topology_report.h"
#include "nodes/measure/unit_spheres.h"

typedef struct medial_evaluate_params {
  double epsilon;   /* 0: no bound to certify */
  double tolerance; /* as a share of epsilon */
  int64_t samples;
} medial_evaluate_params;

/* Centres this close to the surface count as inside. */
static const double beside_surface = 1e-5;

/* The most searches of the surface, each from the largest F found before, and the most of the envelope's boundary. */
enum { MOST_SEARCHES = 4 };
/* Where epsilon is between the bounds, the tolerance is its distance from the lower one, at least this share of the
 * usual tolerance. */
static const double LEAST_TOLERANCE = 1.0 / 256;

typedef struct evaluation {
  qmat_context *context;
  const medial_evaluate_params *params;
  double epsilon;   /* of the bounds: below the parameter's, never 0 */
  double deviation; /* of the mesh from the surface that it approximates, in diagonals */
  qmat_surface *surface;
  qmat_envelope *envelope;
  qmat_medial unit; /* the medial mesh in the unit frame; its spheres are in the arena */
  qmat_bounds surface_to_envelope;
  double largest_gap, mean_gap; /* max(0, F) over the samples of the surface */
  double deepest, mean_offset;  /* -F and |F| over the same samples */
  qmat_boundary_distance boundary;
  double *sphere_errors; /* per sphere: what bounds F where it answers for the surface; in the arena */
  size_t spheres_outside, degenerate_cones, degenerate_slabs, duplicate_spheres;
} evaluation;

static qmat_status prepare(evaluation *e, const qmat_mesh *mesh, const qmat_medial *medial) {
  qmat_context *context = e->context;
  qmat_status status = qmat_surface_new(context, mesh, &e->surface);
  if (status != QMAT_OK) return status;
  e->deviation = mesh->deviation / qmat_surface_frame(e->surface)->diagonal;
  e->epsilon *= 1 - QMAT_STORAGE_SHARE;
  if (e->deviation < e->epsilon) e->epsilon -= e->deviation;
  e->unit = *medial;
  status = qmat_unit_spheres(context, qmat_surface_frame(e->surface), medial, &e->unit.spheres);
  if (status != QMAT_OK) return status;
  return qmat_envelope_of_medial(context, &e->unit, &e->envelope);
}

/* ---- surface to envelope ---- */

/* Sum 0 is max(0, F) and sum 1 |F|; maximum 0 is F and maximum 1 the depth -F. */
static void add_sample(const void *data, size_t facet, double x, double y, qmat_area_sums *sums) {
  const evaluation *e = data;
  const double *positions = qmat_surface_positions(e->surface);
  const uint32_t *row = &qmat_surface_mesh(e->surface)->triangles[3 * facet];
  double point[3];
  qmat_triangle_point(&positions[3 * (size_t)row[0]], &positions[3 * (size_t)row[1]], &positions[3 * (size_t)row[2]], x,
                      y, point);
  const double f = qmat_envelope_distance(e->envelope, point, NULL);
  sums->sum[0] += fmax(f, 0);
  sums->sum[1] += fabs(f);
  sums->largest[0] = fmax(sums->largest[0], f);
  sums->largest[1] = fmax(sums->largest[1], -f);
}

static qmat_status sample_surface(evaluation *e) {
  const qmat_mesh *mesh = qmat_surface_mesh(e->surface);
  double *areas = qmat_arena_alloc(&e->context->arena, mesh->triangle_count, sizeof *areas);
  if (!areas) return qmat_fail_memory(e->context, "samples of the surface");
  qmat_running_areas(qmat_surface_positions(e->surface), mesh->triangles, mesh->triangle_count, areas);
  const qmat_area_samples samples = {.areas = areas,
                                     .element_count = mesh->triangle_count,
                                     .sample_count = (size_t)e->params->samples,
                                     .progress = "samples of the surface",
                                     .add = add_sample,
                                     .data = e};
  qmat_area_sums sums;
  const qmat_status status = qmat_area_samples_sum(e->context, &samples, &sums);
  e->largest_gap = sums.largest[0];
  e->mean_gap = sums.sum[0] / (double)e->params->samples;
  e->deepest = sums.largest[1];
  e->mean_offset = sums.sum[1] / (double)e->params->samples;
  return status;
}

/* The bound that both errors must keep for a certificate. */
static double decisive_bound(const evaluation *e) {
  return e->params->epsilon - e->deviation;
}

/* Bounds max(0, F) over the surface, more closely where that decides whether it is within epsilon. */
static qmat_status bound_surface_to_envelope(evaluation *e) {
  double known = e->largest_gap;
  const double decisive = decisive_bound(e);
  bool is_open = false; /* epsilon is between the bounds */
  qmat_status status = QMAT_OK;
  for (int search = 0; search < MOST_SEARCHES && status == QMAT_OK; search++) {
    const double most = qmat_bound_target(known, e->epsilon, e->params->tolerance) - known;
    const double tolerance = is_open ? fmax(fmin(most, decisive - known), LEAST_TOLERANCE * most) : most;
    qmat_hausdorff_bound bound;
    status =
        qmat_hausdorff_bound_measure(e->context, e->surface, e->envelope, known, tolerance, INFINITY, decisive, &bound);
    e->surface_to_envelope = (qmat_bounds){bound.found, fmax(bound.bound, bound.found)};
    known = bound.found;
    is_open = known <= decisive && bound.bound > decisive;
    if (!is_open && bound.bound <= qmat_bound_target(known, e->epsilon, e->params->tolerance)) break;
  }
  return status;
}

/* The gap between the bounds of a sphere's error, as a share of epsilon or of the largest error. */
static const double SPHERE_TOLERANCE = 0.1;

/* The same for the part of the surface that each sphere answers for. */
static qmat_status bound_spheres(evaluation *e) {
  const size_t count = e->unit.sphere_count;
  const double most = e->surface_to_envelope.hi, tolerance = SPHERE_TOLERANCE * fmax(e->epsilon, most);
  e->sphere_errors = qmat_arena_alloc(&e->context->arena, count, sizeof *e->sphere_errors);
  if (!e->sphere_errors) return qmat_fail_memory(e->context, "the errors of spheres");
  const qmat_status status = qmat_sphere_errors_measure(e->context, e->surface, e->envelope, e->unit.spheres, count,
                                                        most, tolerance, e->sphere_errors);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) e->sphere_errors[i] += e->deviation;
  return status;
}

/* ---- defects of the medial mesh ---- */

static qmat_status count_spheres_outside(evaluation *e) {
  const size_t count = e->unit.sphere_count;
  double *centres = qmat_arena_alloc(&e->context->arena, count, 3 * sizeof *centres);
  uint8_t *inside = qmat_arena_alloc(&e->context->arena, count, sizeof *inside);
  if (!centres || !inside) return qmat_fail_memory(e->context, "medial spheres");
  for (size_t i = 0; i < count; i++) memcpy(&centres[3 * i], &e->unit.spheres[4 * i], 3 * sizeof *centres);
  const size_t slice = 512; /* winding numbers of open surfaces are slow */
  for (size_t first = e->unit.sheet_sphere_count; first < count; first += slice) {
    const qmat_status status = qmat_progress(e->context, first, count, "spheres tested");
    if (status != QMAT_OK) return status;
    const size_t tested = count - first < slice ? count - first : slice;
    qmat_surface_inside_many(e->surface, &centres[3 * first], tested, &inside[first], qmat_threads(e->context));
    for (size_t i = first; i < first + tested; i++)
      if (!inside[i] && !isfinite(qmat_surface_distance(e->surface, &centres[3 * i], beside_surface, NULL, NULL)))
        e->spheres_outside++;
  }
  return QMAT_OK;
}

static int compare_spheres(const void *left, const void *right) {
  const double *a = left, *b = right;
  for (int k = 0; k < 4; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

static qmat_status count_degenerate(evaluation *e) {
  const qmat_medial *m = &e->unit;
  double *sorted = qmat_arena_alloc(&e->context->arena, m->sphere_count, 4 * sizeof *sorted);
  if (!sorted) return qmat_fail_memory(e->context, "medial spheres");
  memcpy(sorted, m->spheres, 4 * m->sphere_count * sizeof *sorted);
  qsort(sorted, m->sphere_count, 4 * sizeof *sorted, compare_spheres);
  for (size_t i = 1; i < m->sphere_count; i++)
    e->duplicate_spheres += compare_spheres(&sorted[4 * i - 4], &sorted[4 * i]) == 0;
  for (size_t i = 0; i < m->edge_count; i++) {
    qmat_cone cone;
    const uint32_t *ends = &m->edges[2 * i];
    qmat_cone_prepare(&cone, &m->spheres[4 * (size_t)ends[0]], &m->spheres[4 * (size_t)ends[1]]);
    e->degenerate_cones += cone.only != 0;
  }
  for (size_t i = 0; i < m->triangle_count; i++) {
    qmat_slab slab;
    const uint32_t *ids = &m->triangles[3 * i];
    qmat_slab_prepare(&slab, &m->spheres[4 * (size_t)ids[0]], &m->spheres[4 * (size_t)ids[1]],
                      &m->spheres[4 * (size_t)ids[2]]);
    e->degenerate_slabs += !slab.solid;
  }
  return QMAT_OK;
}

/* ---- envelope to surface ---- */

/* Bounds the distance over the envelope's boundary, more closely where that decides whether it is within epsilon. */
static qmat_status bound_envelope_to_surface(evaluation *e) {
  const double decisive = decisive_bound(e), usual = e->params->tolerance;
  double epsilon = e->epsilon, tolerance = usual;
  bool is_open = true; /* epsilon is between the bounds */
  qmat_status status = QMAT_OK;
  for (int search = 0; search < MOST_SEARCHES && status == QMAT_OK && is_open; search++) {
    qmat_boundary_distance_uninit(&e->boundary);
    status = qmat_boundary_distance_measure(
        e->context, e->surface, e->envelope, &e->unit,
        &(qmat_boundary_request){
            .epsilon = epsilon, .tolerance = tolerance, .sample_count = (size_t)e->params->samples, .outside = true},
        &e->boundary);
    const qmat_bounds found = e->boundary.either_side;
    is_open = found.lo < decisive && found.hi > decisive;
    epsilon = decisive;
    tolerance = fmax(fmin(usual, (decisive - found.lo) / decisive), LEAST_TOLERANCE * usual);
  }
  return status;
}

/* ---- the report ---- */

static qmat_status make_report(const evaluation *e, qmat_report *report) {
  const qmat_mesh *mesh = qmat_surface_mesh(e->surface);
  const qmat_boundary_distance *b = &e->boundary;
  const double surface_to_envelope = e->surface_to_envelope.hi + e->deviation,
               envelope_to_surface = b->either_side.hi + e->deviation;
  const struct {
    const char *key;
    double value;
  } lengths[] = {
      {"diagonal", qmat_surface_frame(e->surface)->diagonal},
      {"epsilon", e->params->epsilon},
      {"surface_to_envelope", surface_to_envelope},
      {"surface_to_envelope_at_least", fmax(e->surface_to_envelope.lo - e->deviation, 0)},
      {"surface_to_envelope_sampled", e->largest_gap},
      {"surface_to_envelope_mean", e->mean_gap},
      {"surface_depth_in_envelope_sampled", e->deepest},
      {"surface_offset_mean", e->mean_offset},
      {"envelope_to_surface", envelope_to_surface},
      {"envelope_to_surface_at_least", fmax(b->either_side.lo - e->deviation, 0)},
      {"envelope_to_surface_sampled", b->largest},
      {"envelope_to_surface_mean", b->mean},
      {"envelope_out_of_solid", b->outside.hi + e->deviation},
      {"envelope_out_of_solid_at_least", fmax(b->outside.lo - e->deviation, 0)},
  };
  const qmat_json_count counts[] = {
      {"spheres", e->unit.sphere_count},           {"edges", e->unit.edge_count},
      {"triangles", e->unit.triangle_count},       {"spheres_outside", e->spheres_outside},
      {"degenerate_cones", e->degenerate_cones},   {"degenerate_slabs", e->degenerate_slabs},
      {"duplicate_spheres", e->duplicate_spheres}, {"samples_of_surface", (size_t)e->params->samples},
      {"samples_of_envelope", b->sample_count},    {"pieces_of_envelope", b->query_count},
  };
  const bool solid = mesh->closed && mesh->oriented;
  const bool within = surface_to_envelope <= e->params->epsilon && envelope_to_surface <= e->params->epsilon;
  int bad = json_object_set_new(report->root, "certified", json_boolean(solid && within));
  bad |= json_object_set_new(report->root, "estimate", json_boolean(!solid));
  for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++)
    bad |= json_object_set_new(report->root, lengths[i].key, json_real(lengths[i].value));
  bad |= qmat_json_set_counts(report->root, counts, sizeof counts / sizeof *counts);
  const double meters = mesh->meters_per_unit * lengths[0].value; /* of the diagonal */
  if (meters > 0) {
    bad |= json_object_set_new(report->root, "meters_per_unit", json_real(mesh->meters_per_unit));
    bad |= json_object_set_new(report->root, "surface_to_envelope_meters", json_real(meters * surface_to_envelope));
    bad |= json_object_set_new(report->root, "envelope_to_surface_meters", json_real(meters * envelope_to_surface));
  }
  if (e->deviation > 0) bad |= json_object_set_new(report->root, "deviation", json_real(e->deviation));
  json_t *errors = json_array();
  for (size_t i = 0; i < e->unit.sphere_count; i++)
    bad |= json_array_append_new(errors, json_real(e->sphere_errors[i]));
  bad |= json_object_set_new(report->root, "sphere_errors", errors);
  if (bad) return qmat_fail_memory(e->context, "the report");
  return qmat_topology_report(e->context, &e->unit, e->surface, report->root);
}

/* Without an epsilon, errors from this one on are bounded to a share of the error itself. */
static const double least_resolved = 0.001;

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const medial_evaluate_params *params = data;
  evaluation e = {
      .context = context, .params = params, .epsilon = params->epsilon > 0 ? params->epsilon : least_resolved};
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = prepare(&e, (const qmat_mesh *)inputs[0], (const qmat_medial *)inputs[1]);
  if (status == QMAT_OK) status = sample_surface(&e);
  if (status == QMAT_OK) status = bound_surface_to_envelope(&e);
  if (status == QMAT_OK) status = bound_spheres(&e);
  if (status == QMAT_OK) status = bound_envelope_to_surface(&e);
  if (status == QMAT_OK) status = count_spheres_outside(&e);
  if (status == QMAT_OK) status = count_degenerate(&e);
  if (status == QMAT_OK) status = make_report(&e, report);
  qmat_boundary_distance_uninit(&e.boundary);
  qmat_envelope_free(e.envelope);
  qmat_surface_free(e.surface);
  return qmat_hand_over(context, status, (qmat_value *const[]){report ? &report->base : NULL}, 1, outputs);
}

static const qmat_param params[] = {
    QMAT_LENGTH(medial_evaluate_params, epsilon, 0.01, 0, 1,
                "Both errors must be at most this for the result to be certified; 0: nothing is certified"),
    QMAT_FLOAT(medial_evaluate_params, tolerance, "epsilon", 0.05, 0.001, 1,
               "The largest gap between the bounds of an error, relative to epsilon (0.1 % without one) or to the "
               "error, the larger"),
    QMAT_INT(medial_evaluate_params, samples, "points", 5000, 1, 1e9,
             "Points on the surface, and as many on the primitives, for sampled figures and means"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The surface"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh that approximates it"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "report",
     .type = QMAT_REPORT,
     .doc = "Both errors with bounds, whether they are certified, and the topology"},
    {0},
};

const qmat_node qmat_node_medial_evaluate = {
    .name = "medial.evaluate",
    .version = 19,
    .summary = "Proves bounds of the distance between a medial mesh and a surface",
    .doc =
        "surface_to_envelope bounds the distance from any point of the surface to the solid that the spheres, cones "
        "and slabs sweep (eq. 9 over all of the surface). envelope_to_surface bounds the distance from any point of "
        "that solid's boundary to the surface, on either side. envelope_out_of_solid does so for the points outside of "
        "the model. All lengths are fractions of the diagonal.\n\n"
        "Bounds come from branch and bound and hold between samples. Keys with _at_least are lower bounds, attained at "
        "a point. Keys with _sampled or _mean come from samples and bound nothing. The upper bounds of the envelope's "
        "errors may reach five tolerances where the truth is less, and more for ten thousand simplices.\n\n"
        "certified means: the surface is closed and oriented, sheets aside, and both errors are at most epsilon. For "
        "an open surface, the errors are estimates. Surface deep inside the envelope, in a gap that the envelope "
        "fills, is not bounded; surface_depth_in_envelope_sampled shows it. sphere_errors bounds surface_to_envelope "
        "for each sphere, over the part of the surface that it answers for.\n\n"
        "The deviation of a subdivision surface (mesh.subdivide) is part of all bounds. Components, loops and voids "
        "are Betti numbers over Z/2; those of the solid and its sheets (_of_solid) are missing where the surface is "
        "open or has an edge of more than two triangles; topology_of_solid_not_known says so.",
    .citation = "Section 3.1.1 and eq. 9",
    .params_size = sizeof(medial_evaluate_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .report_summary = &qmat_medial_summary,
    .effort = 8,
    .run = run,
};
