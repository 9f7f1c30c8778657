/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.simplify: edge collapses by slab quadratic error and stability ratio, with the error held on both sides. */
#include <math.h>
#include <string.h>

#include "core/node.h"
#include "core/surface.h"
#include "core/thickness.h"
#include "nodes/libraries.h"
#include "nodes/medial_errors.h"
#include "nodes/simplification.h"

typedef struct {
  double epsilon;
  int64_t vertices;
  double cost;
  int error;
  int on_exceed;
  int topology;
  int protect;
  double theta;
  double k;
  int64_t refits;
} medial_simplify_params;

/* Of the wanted error the control points leave the rest to the surface between them. Where that is not enough the run
 * is repeated, at most this often, with control points in the places found. */
static const double control_share = 0.975;
enum { MOST_ROUNDS = 4 };
enum { MOST_CONTROL_POINTS = 600000 };

typedef struct {
  qmat_context *context;
  const medial_simplify_params *params;
  qmat_surface *surface;
  qmat_control_points control;
  qmat_simplification simplification;
} simplifier;

/* The exact depth at the centre of a medial sphere. Most are inscribed: a look no farther than their radius finds it.
 */
static double depth_of(const qmat_surface *surface, const double *sphere) {
  double depth = qmat_surface_distance(surface, sphere, sphere[3] * (1 + 1e-6) + 1e-9, NULL, NULL);
  if (!(depth < INFINITY)) depth = qmat_surface_distance(surface, sphere, INFINITY, NULL, NULL);
  return qmat_surface_inside(surface, sphere) ? depth : -depth;
}

static qmat_status measure_depths(const simplifier *s, const double *spheres, size_t count, double *depths) {
  const size_t slice = 1 << 15;
  const int threads = qmat_threads(s->context);
  for (size_t first = 0; first < count; first += slice) {
    const qmat_status status = qmat_progress(s->context, 0, 0, "depths");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t v = first; v < last; v++) depths[v] = depth_of(s->surface, &spheres[4 * v]);
  }
  return QMAT_OK;
}

/* The reported errors are at most this share of epsilon above the true ones, but never below the second share. */
static const double error_tolerance = 0.01, least_reported = 0.5;

/* What an unbounded run (epsilon 0) measures its errors against. */
static const double default_epsilon = 0.01;

/* Medial spheres that are farther from the mesh or larger, in diagonals, are not of this mesh: beyond, squares lose all
 * digits. */
static const double farthest_sphere = 1e6;

static qmat_status measure(simplifier *s, const qmat_medial *unit, qmat_medial_errors *errors) {
  const double epsilon = s->params->epsilon > 0 ? s->params->epsilon : default_epsilon;
  const double tolerance = error_tolerance * epsilon;
  return qmat_medial_errors_measure(s->context, s->surface, unit, s->control.points, s->control.surface_count,
                                    tolerance, least_reported * epsilon, epsilon - tolerance, errors);
}

/* The initial medial mesh in the unit frame, its depths, and which samples are thin: the same in every round. */
typedef struct {
  double *spheres, *depths;
  uint8_t *thin;
} initial_state;

static qmat_status prepare(simplifier *s, const qmat_mesh *mesh, const qmat_field *thickness,
                           const qmat_samples *samples, const qmat_medial *medial, initial_state *state) {
  qmat_context *context = s->context;
  qmat_status status = qmat_thickness_check(context, mesh, thickness, samples);
  if (status == QMAT_OK && medial->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "there is no medial sphere");
    status = qmat_fail_field(context, "medial");
  }
  if (status == QMAT_OK) status = qmat_surface_new(context, mesh, &s->surface);
  if (status != QMAT_OK) return status;
  double *spheres = qmat_arena_alloc(&context->arena, medial->sphere_count, 4 * sizeof *spheres);
  double *depths = qmat_arena_alloc(&context->arena, medial->sphere_count, sizeof *depths);
  double *values = qmat_arena_alloc(&context->arena, samples->count, sizeof *values);
  uint8_t *thin = qmat_arena_alloc(&context->arena, samples->count, sizeof *thin);
  if (!spheres || !depths || !values || !thin) return qmat_fail_memory(context, "the medial mesh");
  qmat_thickness_of_samples(mesh, thickness, samples, values);
  const double theta = qmat_thickness_threshold(thickness, s->params->theta);
  for (size_t i = 0; i < samples->count; i++) thin[i] = values[i] <= theta;
  qmat_frame_spheres_to_unit(qmat_surface_frame(s->surface), medial->spheres, medial->sphere_count, spheres);
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) {
    if (fabs(spheres[i]) <= farthest_sphere) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it is far away from the mesh, or far larger");
    qmat_fail_field(context, "medial");
    return qmat_fail_element(context, "sphere", (int64_t)(i / 4));
  }
  *state = (initial_state){spheres, depths, thin};
  return measure_depths(s, spheres, medial->sphere_count, depths);
}

/* The Euler characteristic of the solid within a closed surface: half that of the surface. */
static qmat_status find_target_euler(qmat_context *context, const qmat_mesh *mesh, int64_t *euler) {
  uint8_t *used = qmat_arena_calloc(&context->arena, mesh->vertex_count, sizeof *used);
  if (!used) return qmat_fail_memory(context, "the surface's vertices");
  int64_t vertices = 0;
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    vertices += !used[mesh->triangles[i]];
    used[mesh->triangles[i]] = 1;
  }
  /* Every triangle has three sides, every side two triangles. */
  *euler = (vertices - (int64_t)mesh->triangle_count / 2) / 2;
  return QMAT_OK;
}

static qmat_status set_rules(const simplifier *s, const uint8_t *thin, qmat_simplification_rules *rules) {
  const medial_simplify_params *p = s->params;
  const qmat_mesh *mesh = qmat_surface_mesh(s->surface);
  *rules = (qmat_simplification_rules){.limit = p->epsilon > 0 ? control_share * p->epsilon : INFINITY,
                                       .vertices = (size_t)p->vertices,
                                       .most_cost = p->cost,
                                       .k = p->k,
                                       .error = (qmat_error_kind)p->error,
                                       .on_exceed = (qmat_exceed_rule)p->on_exceed,
                                       .topology = (qmat_topology_policy)p->topology,
                                       .protect = (qmat_protection)p->protect,
                                       .refits = (int)p->refits,
                                       .thin = thin,
                                       .has_target = mesh->closed && mesh->oriented};
  return rules->has_target ? find_target_euler(s->context, mesh, &rules->target_euler) : QMAT_OK;
}

/* Sets one round up: everything that collapses change. */
static qmat_status start(simplifier *s, const initial_state *state, const qmat_samples *samples,
                         const qmat_medial *medial, const qmat_extra_points *extra) {
  qmat_simplification *simplification = &s->simplification;
  *simplification = (qmat_simplification){.context = s->context, .surface = s->surface};
  qmat_status status = qmat_complex_init(s->context, &simplification->complex, medial, state->spheres);
  if (status == QMAT_OK) status = set_rules(s, state->thin, &simplification->rules);
  const double epsilon = s->params->epsilon > 0 ? s->params->epsilon : INFINITY;
  const bool inside = s->params->error == QMAT_ERROR_TWO_SIDED && epsilon < INFINITY;
  if (status == QMAT_OK)
    status = qmat_control_points_make(s->context, s->surface, samples, medial, &simplification->complex, epsilon,
                                      MOST_CONTROL_POINTS, extra, inside, &s->control);
  if (status == QMAT_OK) status = qmat_simplification_init(simplification, &s->control, state->depths);
  return status;
}

static qmat_status make_report(const simplifier *s, const qmat_medial *unit, const qmat_medial_errors *errors,
                               int rounds, qmat_report *report) {
  const qmat_simplification *run = &s->simplification;
  const struct {
    const char *name;
    size_t value;
  } counts[] = {
      {"initial_spheres", run->complex.vertex_count},
      {"spheres", unit->sphere_count},
      {"edges", unit->edge_count},
      {"triangles", unit->triangle_count},
      {"rounds", (size_t)rounds},
      {"collapses", run->collapses},
      {"moves", run->moves},
      {"control_points", s->control.count},
      {"refused_by_surface", run->refused_by_surface},
      {"refused_by_coverage", run->refused_by_coverage},
      {"refused_by_protrusion", run->refused_by_protrusion},
      {"refused_by_protection", run->refused_by_protection},
      {"refused_by_topology", run->refused_by_topology},
      {"surface_questions", run->protrusion.lattice.questions},
  };
  int bad = 0;
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    bad |= json_object_set_new(report->root, counts[i].name, json_integer((json_int_t)counts[i].value));
  bad |= json_object_set_new(report->root, "euler_characteristic", json_integer((json_int_t)run->euler));
  if (run->rules.has_target)
    bad |= json_object_set_new(report->root, "euler_characteristic_of_solid",
                               json_integer((json_int_t)run->rules.target_euler));
  bad |= json_object_set_new(report->root, "epsilon", json_real(s->params->epsilon));
  bad |= json_object_set_new(report->root, "surface_to_envelope", json_real(errors->surface_to_envelope));
  bad |= json_object_set_new(report->root, "envelope_to_surface", json_real(errors->envelope_to_surface));
  return bad ? qmat_fail_memory(s->context, "the report") : QMAT_OK;
}

/* The places where the surface between the control points is too far from the envelope, added to those known. */
static qmat_status add_extra_points(simplifier *s, const qmat_cover *cover, qmat_extra_points *extra) {
  const size_t count = extra->count + cover->count;
  double *points = qmat_arena_alloc(&s->context->arena, count, 3 * sizeof *points);
  uint32_t *facets = qmat_arena_alloc(&s->context->arena, count, sizeof *facets);
  if (!points || !facets) return qmat_fail_memory(s->context, "control points");
  if (extra->count) {
    memcpy(points, extra->points, 3 * extra->count * sizeof *points);
    memcpy(facets, extra->facets, extra->count * sizeof *facets);
  }
  memcpy(points + 3 * extra->count, cover->points, 3 * cover->count * sizeof *points);
  memcpy(facets + extra->count, cover->facets, cover->count * sizeof *facets);
  *extra = (qmat_extra_points){count, points, facets};
  return QMAT_OK;
}

static double farthest_at_first(const qmat_control_points *control) {
  double farthest = -INFINITY;
  for (size_t i = 0; i < control->count; i++) farthest = fmax(farthest, control->distances[i]);
  return farthest;
}

/* Rounds of collapses until the surface between the control points keeps within epsilon as they do. */
static qmat_status simplify(simplifier *s, const initial_state *state, const qmat_samples *samples,
                            const qmat_medial *initial, qmat_medial **medial, qmat_report *report) {
  qmat_extra_points extra = {0};
  const double epsilon = s->params->epsilon;
  for (int round = 1;; round++) {
    qmat_medial_errors errors = {.surface_to_envelope = 0};
    qmat_medial *unit = *medial = qmat_medial_new();
    qmat_status status =
        unit ? start(s, state, samples, initial, &extra) : qmat_fail_memory(s->context, "the medial mesh");
    if (status == QMAT_OK) status = qmat_simplification_run(&s->simplification);
    if (status == QMAT_OK) status = qmat_simplification_extract(&s->simplification, unit);
    if (status == QMAT_OK) status = measure(s, unit, &errors);
    if (status != QMAT_OK) return status;
    /* What the initial medial mesh itself leaves too far away, no round brings closer. */
    const bool repeat = epsilon > 0 && errors.surface_to_envelope > epsilon && errors.cover.count > 0 &&
                        farthest_at_first(&s->control) <= epsilon && round < MOST_ROUNDS;
    if (!repeat) return make_report(s, unit, &errors, round, report);
    if ((status = add_extra_points(s, &errors.cover, &extra)) != QMAT_OK) return status;
    qmat_value_release(&unit->base);
    qmat_simplification_uninit(&s->simplification);
  }
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  const qmat_field *thickness = (const qmat_field *)inputs[1];
  const qmat_samples *samples = (const qmat_samples *)inputs[2];
  const qmat_medial *initial = (const qmat_medial *)inputs[3];
  simplifier s = {.context = context, .params = params};
  initial_state state = {NULL, NULL, NULL};
  qmat_medial *medial = NULL;
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = prepare(&s, mesh, thickness, samples, initial, &state);
  if (status == QMAT_OK) status = simplify(&s, &state, samples, initial, &medial, report);
  if (status == QMAT_OK) {
    qmat_frame_spheres_to_model(qmat_surface_frame(s.surface), medial->spheres, medial->sphere_count, medial->spheres);
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
  qmat_simplification_uninit(&s.simplification);
  qmat_surface_free(s.surface);
  return status;
}

static const char *const error_kinds[] = {"two_sided", "one_sided", NULL};
static const char *const exceed_rules[] = {"skip", "stop", NULL};
static const char *const topology_policies[] = {"free", "guard", "preserve", NULL};
static const char *const protections[] = {"off", "late", "always", NULL};

#define AT(field) offsetof(medial_simplify_params, field)

static const qmat_param params[] = {
    {.name = "epsilon",
     .unit = "diagonal",
     .doc = "The largest distance between surface and envelope; 0: no bound",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0.01,
     .min = 0,
     .max = 1,
     .flags = QMAT_PARAM_RELATIVE,
     .offset = AT(epsilon)},
    {.name = "vertices",
     .unit = "spheres",
     .doc = "Stop when this many medial spheres are left; 0: no such stop",
     .type = QMAT_PARAM_INT,
     .default_number = 0,
     .min = 0,
     .max = 4294967294.0,
     .offset = AT(vertices)},
    {.name = "cost",
     .unit = "1",
     .doc = "Stop when the cheapest collapse costs more than this (eq. 6); 0: no such stop",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0,
     .min = 0,
     .max = 1e9,
     .offset = AT(cost)},
    {.name = "error",
     .unit = "",
     .doc = "What epsilon bounds: surface to envelope and envelope to surface, or the first alone as in the paper",
     .type = QMAT_PARAM_ENUM,
     .default_number = QMAT_ERROR_TWO_SIDED,
     .choices = error_kinds,
     .offset = AT(error)},
    {.name = "on_exceed",
     .unit = "",
     .doc = "At a collapse that would exceed epsilon: skip it and go on, or stop as in the paper",
     .type = QMAT_PARAM_ENUM,
     .default_number = QMAT_EXCEED_SKIP,
     .choices = exceed_rules,
     .offset = AT(on_exceed)},
    {.name = "topology",
     .unit = "",
     .doc = "Free as in the paper, guarded so that loops and voids become the solid's, or preserved (link condition)",
     .type = QMAT_PARAM_ENUM,
     .default_number = QMAT_TOPOLOGY_GUARD,
     .choices = topology_policies,
     .offset = AT(topology)},
    {.name = "protect",
     .unit = "",
     .doc = "Keep thin tubular features whatever their cost: never, at the late stage, or from the start",
     .type = QMAT_PARAM_ENUM,
     .default_number = QMAT_PROTECT_OFF,
     .choices = protections,
     .offset = AT(protect)},
    {.name = "theta",
     .unit = "mean thickness",
     .doc = "A feature is thin when the thickness of its whole responsible region is at most this ratio of the mean",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0.5,
     .min = 0,
     .max = 10,
     .offset = AT(theta)},
    {.name = "k",
     .unit = "1",
     .doc = "The constant of the collapse cost (eq. 6)",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 1e-5,
     .min = 0,
     .max = 1,
     .offset = AT(k)},
    {.name = "refits",
     .unit = "passes",
     .doc = "How often, when no edge is left to collapse, spheres are fitted to the surface to make room for more",
     .type = QMAT_PARAM_INT,
     .default_number = 8,
     .min = 0,
     .max = 1000,
     .offset = AT(refits)},
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The closed surface"},
    {.name = "thickness", .type = QMAT_FIELD, .doc = "Thickness per facet, from mesh.sdf"},
    {.name = "samples", .type = QMAT_SAMPLES, .doc = "Points on the surface, from mesh.sample"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The initial medial mesh"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The simplified medial mesh"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Spheres, errors, collapses done and refused"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, NULL};

const qmat_node qmat_node_medial_simplify = {
    .name = "medial.simplify",
    .version = 1,
    .summary = "Collapses medial edges, cheapest first, while surface and envelope stay within epsilon of each other",
    .doc =
        "The cost of a collapse is the slab quadratic error of the merged sphere times the squared stability ratio of "
        "the edge. A collapse is done when its sphere and the midpoints of its edges lie inside the model and both "
        "errors stay below epsilon: from the surface to the envelope at the samples and a grid of control points, and "
        "from the envelope of spheres, cones and slabs to the surface. Spheres of the initial medial mesh, shrunk by "
        "epsilon, have to stay inside too, so that the envelope has no hollow. The largest distance from the surface "
        "between the control points is bounded afterwards, and the collapses are repeated with points in the places "
        "found where it is above epsilon.",
    .citation = "Sections 3.1.2, 3.3 and 3.4, eq. 1-6 and 9-12",
    .params_size = sizeof(medial_simplify_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
