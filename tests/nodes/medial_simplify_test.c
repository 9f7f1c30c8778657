/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/envelope.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/surface.h"
#include "core/geometry/vector.h"
#include "nodes/measure/topology.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"

#define ROUNDING 1e-9
#define COUNT(array) (sizeof(array) / sizeof(array)[0])

/* --- models, each made when it is first asked for ----------------------------------------------------------------- */

typedef enum { CAPSULE, TAPERED, SHEET, TORUS, BRACKET, BOX, OCTOPUS, SMALL, RING, MODEL_COUNT } model_name;

static const struct {
  const char *name;
  int resolution;
} models[MODEL_COUNT] = {{"capsule", 16}, {"tapered-capsule", 12}, {"sheet", 8},   {"torus", 12}, {"l-bracket", 8},
                         {"box", 4},      {"octopus", 6},          {"capsule", 8}, {"torus", 6}};
static pipeline made[MODEL_COUNT];
static const char *const sampling = "spacing=8% n_f=0";

static const pipeline *model(model_name name) {
  if (!made[name].mesh)
    pipeline_make(&made[name], pipeline_model(models[name].name, models[name].resolution), sampling, "");
  return &made[name];
}

static int tear_down(void **state) {
  (void)state;
  for (int i = 0; i < MODEL_COUNT; i++) pipeline_free(&made[i]);
  return 0;
}

/* --- runs --------------------------------------------------------------------------------------------------------- */

typedef struct {
  qmat_medial *medial;
  qmat_report *report;
} result;

static qmat_status try_simplify(qmat_context *context, const pipeline *p, const qmat_medial *medial, const char *text,
                                result *r) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  const qmat_value *inputs[] = {&p->mesh->base, &p->thickness->base, &p->samples->base, &medial->base};
  const qmat_status status = pipeline_run(context, "medial.simplify", text, inputs, outputs);
  *r = (result){(qmat_medial *)outputs[0], (qmat_report *)outputs[1]};
  return status;
}

static void release(result *r) {
  qmat_value_release(&r->medial->base);
  qmat_value_release(&r->report->base);
}

/* The report tells what came out. */
static void check_report(const pipeline *p, const qmat_medial *initial, const result *r) {
  (void)p;
  assert_int_equal(pipeline_count(r->report, "initial_spheres"), initial->sphere_count);
  assert_int_equal(pipeline_count(r->report, "spheres"), r->medial->sphere_count);
  assert_int_equal(pipeline_count(r->report, "edges"), r->medial->edge_count);
  assert_int_equal(pipeline_count(r->report, "triangles"), r->medial->triangle_count);
  const bool fills =
      json_object_get(r->report->root, "cavity_filling_spheres") != NULL; /* not where collapses come in order */
  const int64_t divided = json_integer_value(json_object_get(r->report->root, "topology_spheres"));
  const int64_t spheres =
      (int64_t)initial->sphere_count + (fills ? pipeline_count(r->report, "cavity_filling_spheres") : 0) + divided;
  assert_int_equal(pipeline_count(r->report, "collapses"), spheres - (int64_t)r->medial->sphere_count);
}

/* Every sample is in exactly one region. */
static void check_partition(const pipeline *p, const qmat_medial *medial) {
  uint8_t *times = calloc(p->samples->count, 1);
  assert_non_null(times);
  assert_int_equal(medial->region_offset_count, medial->sphere_count + 1);
  assert_int_equal(medial->region_sample_count, p->samples->count);
  for (size_t i = 0; i < medial->region_sample_count; i++) assert_int_equal(times[medial->region_samples[i]]++, 0);
  free(times);
}

static result simplify_medial(const pipeline *p, const qmat_medial *medial, const char *text) {
  qmat_context context = {0};
  result r;
  if (try_simplify(&context, p, medial, text, &r) != QMAT_OK) {
    char line[2048];
    qmat_error_format(&context.error, line, sizeof line);
    fail_msg("%s", line);
  }
  qmat_context_uninit(&context);
  check_report(p, medial, &r);
  check_partition(p, r.medial);
  return r;
}

static result simplify(const pipeline *p, const char *text) {
  return simplify_medial(p, p->medial, text);
}

/* --- both errors by brute force ----------------------------------------------------------------------------------- */

typedef struct {
  double surface_to_envelope, envelope_to_surface; /* in diagonals */
} errors;

static double unit_spheres(const qmat_surface *surface, const qmat_medial *medial, double **spheres) {
  *spheres = calloc(medial->sphere_count, 4 * sizeof **spheres);
  assert_non_null(*spheres);
  qmat_frame_spheres_to_unit(qmat_surface_frame(surface), medial->spheres, medial->sphere_count, *spheres);
  return qmat_surface_frame(surface)->diagonal;
}

/* The largest F over random points of the surface, by area, and at its vertices. */
static double sample_surface(const qmat_mesh *mesh, const double *positions, const qmat_envelope *envelope,
                             size_t wanted) {
  random_numbers random = {.seed = 7};
  double most = -INFINITY, area = 0, due = 0;
  double *areas = calloc(mesh->triangle_count, sizeof *areas);
  assert_non_null(areas);
  for (size_t v = 0; v < mesh->vertex_count; v++)
    most = fmax(most, qmat_envelope_distance(envelope, &positions[3 * v], NULL));
  for (int pass = 0; pass < 2; pass++)
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      const double *c[3];
      for (size_t k = 0; k < 3; k++) c[k] = &positions[3 * (size_t)mesh->triangles[3 * t + k]];
      if (pass == 0) {
        double n[3];
        for (int k = 0; k < 3; k++) {
          const int i = (k + 1) % 3, j = (k + 2) % 3;
          n[k] = (c[1][i] - c[0][i]) * (c[2][j] - c[0][j]) - (c[1][j] - c[0][j]) * (c[2][i] - c[0][i]);
        }
        area += areas[t] = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        continue;
      }
      for (due += areas[t] / area * (double)wanted; due >= 1; due--) {
        const double u = sqrt(random_between(&random, 0, 1)), v = random_between(&random, 0, 1);
        double point[3];
        for (int k = 0; k < 3; k++) point[k] = (1 - u) * c[0][k] + u * (1 - v) * c[1][k] + u * v * c[2][k];
        most = fmax(most, qmat_envelope_distance(envelope, point, NULL));
      }
    }
  free(areas);
  return most;
}

/* The largest r - depth over a grid of each primitive, about `wanted` spheres in all. */
static double sample_envelope(const qmat_surface *surface, const double *spheres, const qmat_envelope *envelope,
                              size_t wanted) {
  double most = -INFINITY;
  const size_t primitives = qmat_envelope_primitive_count(envelope);
  const double each = (double)wanted / (double)primitives;
  for (size_t p = 0; p < primitives; p++) {
    uint32_t ids[3];
    const int count = qmat_envelope_primitive(envelope, p, ids);
    const int steps = count == 3 ? (int)fmax(sqrt(2 * each), 2) : count == 2 ? (int)fmin(fmax(each, 2), 200) : 1;
    for (int i = 0; i <= (count > 1 ? steps : 0); i++)
      for (int j = 0; j <= (count > 2 ? steps - i : 0); j++) {
        const double w[3] = {1 - (double)(i + j) / steps, (double)i / steps, (double)j / steps};
        double s[4] = {0, 0, 0, 0};
        for (int c = 0; c < count; c++)
          for (int k = 0; k < 4; k++) s[k] += w[c] * spheres[4 * (size_t)ids[c] + (size_t)k];
        most = fmax(most, s[3] + qmat_surface_signed_distance(surface, s));
      }
  }
  return most;
}

static errors measure(const pipeline *p, const qmat_medial *medial) {
  qmat_context context = {0};
  qmat_surface *surface;
  qmat_envelope *envelope;
  double *spheres;
  assert_int_equal(qmat_surface_new(&context, p->mesh, &surface), QMAT_OK);
  unit_spheres(surface, medial, &spheres);
  assert_int_equal(qmat_envelope_new(&context, spheres, medial->sphere_count, medial->edges, medial->edge_count,
                                     medial->triangles, medial->triangle_count, &envelope),
                   QMAT_OK);
  const errors e = {sample_surface(p->mesh, qmat_surface_positions(surface), envelope, 10000),
                    sample_envelope(surface, spheres, envelope, 10000)};
  free(spheres);
  qmat_envelope_free(envelope);
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
  return e;
}

/* Both errors are within epsilon, and the report bounds them from above. */
static errors check_errors(const pipeline *p, const result *r, double epsilon, bool two_sided) {
  const errors e = measure(p, r->medial);
  assert_true(e.surface_to_envelope <= epsilon + ROUNDING);
  assert_true(e.surface_to_envelope <= pipeline_number(r->report, "surface_to_envelope") + ROUNDING);
  assert_true(pipeline_number(r->report, "surface_to_envelope") <= epsilon * (1 + ROUNDING));
  assert_true(e.envelope_to_surface <= pipeline_number(r->report, "envelope_to_surface") + ROUNDING);
  if (!two_sided) return e;
  assert_true(e.envelope_to_surface <= epsilon + ROUNDING);
  assert_true(pipeline_number(r->report, "envelope_to_surface") <= epsilon * (1 + ROUNDING));
  return e;
}

static void test_both_errors_stay_within_epsilon(void **state) {
  (void)state;
  static const struct {
    model_name model;
    const char *params;
    double epsilon;
  } cases[] = {{CAPSULE, "epsilon=2%", 0.02}, {TAPERED, "epsilon=2%", 0.02}, {SHEET, "epsilon=5%", 0.05},
               {TORUS, "epsilon=2%", 0.02},   {BRACKET, "epsilon=6%", 0.06}, {BOX, "epsilon=5%", 0.05},
               {OCTOPUS, "epsilon=2%", 0.02}};
  for (size_t i = 0; i < COUNT(cases); i++) {
    const pipeline *p = model(cases[i].model);
    result r = simplify(p, cases[i].params);
    check_errors(p, &r, cases[i].epsilon, true);
    assert_int_equal(pipeline_components(r.medial), 1);
    assert_true(r.medial->sphere_count < p->medial->sphere_count / 20);
    release(&r);
  }
}

/* Most samples have no constraint point of their own here, but all have an owner (check_partition). */
static void test_facets_much_narrower_than_epsilon(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_prism(400, 2), "n_f=0", "");
  result r = simplify(&p, "epsilon=5% vertices=0");
  check_errors(&p, &r, 0.05, true);
  assert_true(r.medial->sphere_count <= 14);
  release(&r);
  pipeline_free(&p);
}

/* --- what is known of the models ---------------------------------------------------------------------------------- */

static void test_capsule_becomes_its_axis(void **state) {
  (void)state;
  /* Balls of radius 1 at x = 0 and 3. At resolution 32 the mesh is within 0.5 % of it. */
  pipeline p;
  pipeline_make(&p, pipeline_model("capsule", 32), "spacing=0 n_f=0", "");
  result r = simplify(&p, "epsilon=1%");
  const double one_percent = 0.01 * pipeline_diagonal(p.mesh);
  double low = INFINITY, high = -INFINITY;
  for (size_t i = 0; i < r.medial->sphere_count; i++) {
    const double *s = &r.medial->spheres[4 * i];
    assert_true(sqrt(s[1] * s[1] + s[2] * s[2]) < one_percent);
    assert_near(s[3], 1, one_percent);
    low = fmin(low, s[0]);
    high = fmax(high, s[0]);
  }
  assert_near(low, 0, one_percent);
  assert_near(high, 3, one_percent);
  assert_true(r.medial->sphere_count <= 4);
  assert_int_equal(r.medial->triangle_count, 0);
  assert_int_equal(r.medial->edge_count, r.medial->sphere_count - 1);
  release(&r);
  pipeline_free(&p);
}

static void test_tapered_capsule_keeps_both_radii(void **state) {
  (void)state;
  const pipeline *p = model(TAPERED);
  result r = simplify(p, "epsilon=2%");
  const double tolerance = 0.02 * pipeline_diagonal(p->mesh);
  double least = INFINITY, most = 0;
  for (size_t i = 0; i < r.medial->sphere_count; i++) {
    least = fmin(least, r.medial->spheres[4 * i + 3]);
    most = fmax(most, r.medial->spheres[4 * i + 3]);
  }
  assert_near(most, 1, tolerance);
  assert_near(least, 0.3, tolerance);
  release(&r);
}

static void test_torus_keeps_its_loop(void **state) {
  (void)state;
  static const char *const settings[] = {"epsilon=2%", "epsilon=4%"};
  const pipeline *p = model(TORUS);
  for (size_t e = 0; e < 2; e++) {
    result r = simplify(p, settings[e]);
    const double epsilon = 0.02 * (double)(1 << e) * pipeline_diagonal(p->mesh);
    assert_int_equal(pipeline_euler(r.medial), 0);
    assert_int_equal(pipeline_components(r.medial), 1);
    assert_true(r.medial->edge_count >= 3);
    /* Around the ring of radius 2 in a tube of radius 0.6. */
    for (size_t i = 0; i < r.medial->sphere_count; i++) {
      const double *s = &r.medial->spheres[4 * i];
      assert_near(sqrt(s[0] * s[0] + s[1] * s[1]), 2, 1.5 * epsilon + 0.05);
      assert_near(s[2], 0, 1.5 * epsilon + 0.05);
    }
    release(&r);
  }
}

static void test_thin_sheet_stays_on_its_mid_plane(void **state) {
  (void)state;
  const pipeline *p = model(SHEET);
  qmat_model sheet;
  assert_int_equal(qmat_model_make("sheet", 8, &sheet), QMAT_OK);
  const double half = sheet.spheres[3];
  qmat_model_uninit(&sheet);
  result r = simplify(p, "epsilon=4%");
  double area = 0;
  for (size_t i = 0; i < r.medial->sphere_count; i++) {
    assert_near(r.medial->spheres[4 * i + 2], 0, 0.5 * half);
    assert_near(r.medial->spheres[4 * i + 3], half, half);
  }
  for (size_t t = 0; t < r.medial->triangle_count; t++) {
    const double *c[3];
    for (size_t k = 0; k < 3; k++) c[k] = &r.medial->spheres[4 * (size_t)r.medial->triangles[3 * t + k]];
    area += fabs((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0])) / 2;
  }
  assert_near(area, 1.6, 0.4); /* slabs all over it, not cones along it */
  assert_true(r.medial->sphere_count <= 12);
  assert_int_equal(pipeline_components(r.medial), 1);
  release(&r);
}

/* The shell's spheres have a tenth of epsilon as radius: between two of them only a short edge runs inside. */
static void test_a_wavy_shell_much_thinner_than_epsilon_takes_few_spheres(void **state) {
  (void)state;
  qmat_mesh *mesh = pipeline_model("sheet", 24);
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    double *p = &mesh->positions[3 * v];
    p[2] = 0.3 * p[2] + 0.1 * sin(6 * p[0]) * cos(5 * p[1]);
  }
  pipeline p;
  pipeline_make(&p, mesh, "n_f=0", "");
  result r = simplify(&p, "epsilon=2%");
  assert_true(r.medial->sphere_count <= 40);
  check_errors(&p, &r, 0.02, true);
  release(&r);
  pipeline_free(&p);
}

/* A box without a lid takes the same few spheres however thin its walls are. */
static void test_thinner_walls_take_no_more_spheres(void **state) {
  (void)state;
  static const double thicknesses[] = {0.01, 0.001, 0.0001};
  for (size_t i = 0; i < COUNT(thicknesses); i++) {
    pipeline p;
    pipeline_make(&p, shape_seal(shape_tray(0.6, thicknesses[i])), "", "");
    result r = simplify(&p, "epsilon=3%");
    assert_true(r.medial->sphere_count <= 24);
    check_errors(&p, &r, 0.03, true);
    release(&r);
    pipeline_free(&p);
  }
}

/* --- parameters --------------------------------------------------------------------------------------------------- */

/* Greedy collapses are not monotone in epsilon, but twice the epsilon leaves no more. */
static void test_twice_the_epsilon_leaves_no_more_spheres(void **state) {
  (void)state;
  static const model_name names[] = {CAPSULE, TORUS, OCTOPUS};
  static const char *const params[] = {"epsilon=2%", "epsilon=4%", "epsilon=8%"};
  for (size_t m = 0; m < COUNT(names); m++) {
    size_t before = SIZE_MAX;
    for (size_t e = 0; e < COUNT(params); e++) {
      result r = simplify(model(names[m]), params[e]);
      assert_true(r.medial->sphere_count <= before);
      before = r.medial->sphere_count;
      release(&r);
    }
  }
}

static void test_number_of_vertices_within_epsilon_is_met_exactly(void **state) {
  (void)state;
  result r = simplify(model(OCTOPUS), "epsilon=5% vertices=500");
  assert_int_equal(r.medial->sphere_count, 500);
  release(&r);
}

/* The epsilon that was found leaves at most the number; half of it leaves more, and so does a tenth less. */
static void test_number_of_vertices_alone_finds_the_least_error(void **state) {
  (void)state;
  static const double smaller[] = {2, 1.1};
  static const struct {
    model_name model;
    size_t count;
  } cases[] = {{TORUS, 8}};
  for (size_t i = 0; i < COUNT(cases); i++) {
    const pipeline *p = model(cases[i].model);
    char text[64];
    snprintf(text, sizeof text, "epsilon=0 vertices=%zu", cases[i].count);
    result r = simplify(p, text);
    assert_true(r.medial->sphere_count <= cases[i].count);
    const double epsilon = json_number_value(json_object_get(r.report->root, "epsilon"));
    check_errors(p, &r, epsilon, true);
    assert_null(json_object_get(r.report->root, "warnings"));
    release(&r);
    assert_true(epsilon >= 2 * 0.0025); /* twice the least that is tried */
    for (size_t k = 0; k < COUNT(smaller); k++) {
      const double less = epsilon / smaller[k];
      snprintf(text, sizeof text, "epsilon=%.17g", less);
      r = simplify(p, text);
      assert_true(r.medial->sphere_count > cases[i].count ||
                  json_number_value(json_object_get(r.report->root, "surface_to_envelope")) > less);
      release(&r);
    }
  }
}

static void test_more_vertices_than_there_are_change_nothing(void **state) {
  (void)state;
  const pipeline *p = model(SMALL);
  result r = simplify(p, "epsilon=8% vertices=1000000");
  assert_int_equal(r.medial->sphere_count, p->medial->sphere_count);
  assert_int_equal(r.medial->edge_count, p->medial->edge_count);
  assert_memory_equal(r.medial->edges, p->medial->edges, 2 * r.medial->edge_count * sizeof(uint32_t));
  assert_memory_equal(r.medial->triangles, p->medial->triangles, 3 * r.medial->triangle_count * sizeof(uint32_t));
  for (size_t i = 0; i < 4 * r.medial->sphere_count; i++)
    assert_near(r.medial->spheres[i], p->medial->spheres[i], 1e-12);
  release(&r);
}

static void test_cost_stops_before_dear_collapses(void **state) {
  (void)state;
  static const char *const settings[] = {"epsilon=0 most_cost=1e-12", "epsilon=0 most_cost=1e-7",
                                         "epsilon=0 most_cost=1e-4", "epsilon=0 most_cost=1e-2"};
  const pipeline *p = model(RING);
  size_t before = p->medial->sphere_count + 1;
  for (size_t i = 0; i < COUNT(settings); i++) {
    result r = simplify(p, settings[i]);
    assert_true(r.medial->sphere_count < before);
    before = r.medial->sphere_count;
    release(&r);
  }
}

static void test_one_sided_holds_the_surface_alone(void **state) {
  (void)state;
  static const model_name names[] = {TORUS, BRACKET};
  for (size_t m = 0; m < COUNT(names); m++) {
    const pipeline *p = model(names[m]);
    result one = simplify(p, "epsilon=6% error=one_sided"), two = simplify(p, "epsilon=6% error=two_sided");
    check_errors(p, &one, 0.06, false);
    check_errors(p, &two, 0.06, true);
    assert_int_equal(pipeline_count(one.report, "refused_by_envelope_to_surface"), 0);
    release(&one);
    release(&two);
  }
}

static void test_stopping_at_epsilon_keeps_it_and_leaves_spheres_that_skipping_does_not(void **state) {
  (void)state;
  static const model_name names[] = {CAPSULE, TORUS, BRACKET, OCTOPUS};
  bool more = false;
  for (size_t m = 0; m < COUNT(names); m++) {
    const pipeline *p = model(names[m]);
    result stop = simplify(p, "epsilon=6% finest=3% on_exceed=stop"), skip = simplify(p, "epsilon=6% on_exceed=skip");
    check_errors(p, &stop, 0.06, true);
    more |= stop.medial->sphere_count > skip.medial->sphere_count;
    release(&stop);
    release(&skip);
  }
  assert_true(more);
}

/* The report has the Betti numbers of the result and of the solid. */
static void check_topology(const pipeline *p, const result *r) {
  qmat_context context = {0};
  qmat_surface *surface;
  qmat_topology of_medial, of_solid;
  assert_int_equal(qmat_surface_new(&context, p->mesh, &surface), QMAT_OK);
  assert_int_equal(qmat_topology_of_medial(&context, r->medial, &of_medial), QMAT_OK);
  assert_int_equal(qmat_topology_of_solid(&context, surface, &of_solid), QMAT_OK);
  assert_true(of_medial.known && of_solid.known);
  assert_int_equal(pipeline_count(r->report, "euler_characteristic"), pipeline_euler(r->medial));
  assert_int_equal(pipeline_count(r->report, "components"), of_medial.components);
  assert_int_equal(pipeline_count(r->report, "loops"), of_medial.loops);
  assert_int_equal(pipeline_count(r->report, "voids"), of_medial.voids);
  assert_int_equal(pipeline_count(r->report, "components_of_solid"), of_solid.components);
  assert_int_equal(pipeline_count(r->report, "loops_of_solid"), of_solid.loops);
  assert_int_equal(pipeline_count(r->report, "voids_of_solid"), of_solid.voids);
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
}

static void test_topology_is_free_guarded_or_preserved(void **state) {
  (void)state;
  static const model_name names[] = {TORUS, BOX, OCTOPUS};
  for (size_t m = 0; m < COUNT(names); m++) {
    const pipeline *p = model(names[m]);
    const long solid = names[m] == TORUS ? 0 : 1;
    result any = simplify(p, "epsilon=6% topology=free"), guarded = simplify(p, "epsilon=6%");
    result kept = simplify(p, "epsilon=6% topology=preserve");
    assert_int_equal(pipeline_count(any.report, "refused_by_topology"), 0);
    assert_int_equal(pipeline_euler(guarded.medial), solid);
    assert_int_equal(pipeline_count(guarded.report, "euler_characteristic_of_solid"), solid);
    assert_int_equal(pipeline_euler(kept.medial), pipeline_euler(p->medial));
    if (names[m] == OCTOPUS) assert_true(pipeline_count(kept.report, "refused_by_topology") > 0);
    assert_true(kept.medial->sphere_count < 2 * guarded.medial->sphere_count); /* it strands nothing */
    result *const all[] = {&any, &guarded, &kept};
    for (int i = 0; i < 3; i++) {
      assert_int_equal(pipeline_components(all[i]->medial), 1); /* no collapse can tear it */
      check_topology(p, all[i]);
      check_errors(p, all[i], 0.06, true);
      release(all[i]);
    }
  }
}

/* --- planted shapes: the boundary of known spheres, cones and slabs ----------------------------------------------- */

typedef struct {
  const char *name;
  size_t sphere_count, edge_count, triangle_count;
  double spheres[4 * 8];
  uint32_t edges[2 * 8], triangles[3 * 2];
} planted;

static const planted planted_shapes[] = {
    {.name = "chain",
     .sphere_count = 5,
     .edge_count = 4,
     .spheres = {0, 0, 0, 0.3, 1, 0.2, 0, 0.2, 1.8, 0.9, 0.3, 0.35, 2.6, 0.8, 1, 0.15, 3.3, 0.2, 1.2, 0.25},
     .edges = {0, 1, 1, 2, 2, 3, 3, 4}},
    {.name = "ring",
     .sphere_count = 6,
     .edge_count = 6,
     .spheres = {2, 0, 0, 0.3, 1, 1.8, 0.2, 0.4, -1, 1.7, 0, 0.3, -2, 0, 0.2, 0.4, -1, -1.8, 0, 0.3, 1, -1.7, 0.2, 0.4},
     .edges = {0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 0}},
    {.name = "slab with fingers",
     .sphere_count = 6,
     .edge_count = 3,
     .triangle_count = 1,
     .spheres = {0,   0,    0,   0.2,  2,  0,    0,   0.2, 1, 1.6, 0,   0.25,
                 3.2, -0.6, 0.3, 0.12, -1, -0.9, 0.2, 0.1, 1, 3,   0.4, 0.14},
     .edges = {1, 3, 0, 4, 2, 5},
     .triangles = {0, 1, 2}},
};

static qmat_mesh *plant(const planted *shape) {
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = shape->sphere_count;
  medial->spheres = qmat_alloc(shape->sphere_count, 4 * sizeof(double));
  assert_non_null(medial->spheres);
  memcpy(medial->spheres, shape->spheres, 4 * shape->sphere_count * sizeof(double));
  assert_int_equal(qmat_medial_set_simplices(&context, medial, shape->edges, shape->edge_count, shape->triangles,
                                             shape->triangle_count),
                   QMAT_OK);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.skin", "resolution=64", (const qmat_value *[]){&medial->base, NULL}, outputs);
  qmat_value_release(outputs[1]);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
  return (qmat_mesh *)outputs[0];
}

static void test_a_planted_medial_mesh_is_found_again(void **state) {
  (void)state;
  for (size_t i = 0; i < COUNT(planted_shapes); i++) {
    const planted *shape = &planted_shapes[i];
    pipeline p;
    pipeline_make(&p, plant(shape), "", "");
    result r = simplify(&p, "epsilon=1%");
    if (r.medial->sphere_count > shape->sphere_count)
      fail_msg("%s: %zu spheres were planted, %zu found", shape->name, shape->sphere_count, r.medial->sphere_count);
    assert_true(pipeline_number(r.report, "surface_to_envelope") <= 0.01);
    assert_true(pipeline_number(r.report, "envelope_to_surface") <= 0.01);
    assert_int_equal(pipeline_count(r.report, "components"), 1);
    assert_int_equal(pipeline_count(r.report, "loops"), pipeline_count(r.report, "loops_of_solid"));
    assert_int_equal(pipeline_count(r.report, "voids"), 0);
    release(&r);
    pipeline_free(&p);
  }
}

/* Six spheres span the mid-planes of the bracket's two arms. Single spheres alone are fitted to eleven, and collapses
 * alone to more. */
static void test_joint_fits_find_what_single_fits_do_not(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("l-bracket", 8), sampling, "merge=0.04");
  result jointly = simplify(&p, "epsilon=3%"), unfitted = simplify(&p, "epsilon=3% refits=0");
  assert_true(jointly.medial->sphere_count <= 8);
  assert_true(unfitted.medial->sphere_count > 11);
  check_errors(&p, &jointly, 0.03, true);
  check_errors(&p, &unfitted, 0.03, true);
  release(&jointly);
  release(&unfitted);
  pipeline_free(&p);
}

/* How far spheres reach from the octopus's head. */
static double reach(const qmat_medial *medial) {
  double most = 0;
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double *s = &medial->spheres[4 * i];
    most = fmax(most, sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]));
  }
  return most;
}

/* Cones of no slab whose both radii are small: of tentacles. */
static size_t thin_cones(const qmat_medial *medial, double radius) {
  size_t count = 0;
  for (size_t e = 0; e < medial->edge_count; e++) {
    const double *a = &medial->spheres[4 * (size_t)medial->edges[2 * e]];
    const double *b = &medial->spheres[4 * (size_t)medial->edges[2 * e + 1]];
    count += a[3] < radius && b[3] < radius;
  }
  return count;
}

static void test_protection_keeps_tubular_edges(void **state) {
  (void)state;
  const pipeline *p = model(OCTOPUS);
  const double thin = 0.02 * pipeline_diagonal(p->mesh);
  result off = simplify(p, "epsilon=0 vertices=12"), always = simplify(p, "epsilon=0 vertices=12 protect=always");
  result late = simplify(p, "epsilon=0 vertices=12 protect=late");
  assert_int_equal(off.medial->sphere_count, 12);
  assert_int_equal(pipeline_count(off.report, "refused_by_protection"), 0);
  assert_true(pipeline_count(always.report, "refused_by_protection") > 0);
  assert_true(pipeline_count(late.report, "refused_by_protection") > 0);
  assert_true(thin_cones(always.medial, thin) > thin_cones(off.medial, thin));
  assert_true(thin_cones(late.medial, thin) > thin_cones(off.medial, thin));
  assert_true(reach(always.medial) >= reach(off.medial));
  release(&off);
  release(&always);
  release(&late);
}

static void test_protection_of_nothing_thin_changes_nothing(void **state) {
  (void)state;
  const pipeline *p = model(OCTOPUS);
  result off = simplify(p, "epsilon=4% theta=0"), always = simplify(p, "epsilon=4% theta=0 protect=always");
  assert_memory_equal(&off.medial->base.digest, &always.medial->base.digest, sizeof(qmat_digest));
  release(&off);
  release(&always);
}

/* --- inputs of all kinds ------------------------------------------------------------------------------------------ */

static qmat_medial *copy_of(const qmat_medial *from, bool with_simplices, bool with_regions) {
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = from->sphere_count;
  medial->spheres = qmat_alloc(from->sphere_count, 4 * sizeof(double));
  memcpy(medial->spheres, from->spheres, 4 * from->sphere_count * sizeof(double));
  assert_int_equal(qmat_medial_set_simplices(&context, medial, from->edges, with_simplices ? from->edge_count : 0,
                                             from->triangles, with_simplices ? from->triangle_count : 0),
                   QMAT_OK);
  if (with_regions) {
    medial->region_offset_count = from->region_offset_count;
    medial->region_sample_count = from->region_sample_count;
    medial->region_offsets = qmat_alloc(from->region_offset_count, sizeof(uint32_t));
    medial->region_samples = qmat_alloc(from->region_sample_count, sizeof(uint32_t));
    memcpy(medial->region_offsets, from->region_offsets, from->region_offset_count * sizeof(uint32_t));
    memcpy(medial->region_samples, from->region_samples, from->region_sample_count * sizeof(uint32_t));
  }
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_context_uninit(&context);
  return medial;
}

static void test_medial_mesh_without_regions_works(void **state) {
  (void)state;
  static const struct {
    model_name model;
    const char *params;
    long euler;
  } cases[] = {{SMALL, "epsilon=8%", 1}, {RING, "epsilon=8% vertices=40", 0}};
  for (size_t i = 0; i < COUNT(cases); i++) {
    const pipeline *p = model(cases[i].model);
    qmat_medial *bare = copy_of(p->medial, true, false);
    result r = simplify_medial(p, bare, cases[i].params);
    if (i == 0) check_errors(p, &r, 0.08, true);
    assert_int_equal(pipeline_euler(r.medial), cases[i].euler);
    release(&r);
    qmat_value_release(&bare->base);
  }
}

/* An epsilon that comes first is a warning too, with all rules. */
static void test_a_number_of_vertices_that_epsilon_prevents_is_a_warning(void **state) {
  (void)state;
  static const char *const settings[] = {"epsilon=4% vertices=2", "epsilon=4% vertices=2 on_exceed=raise finest=2%"};
  for (size_t i = 0; i < COUNT(settings); i++) {
    result r = simplify(model(RING), settings[i]);
    assert_true(r.medial->sphere_count > 2);
    assert_int_equal(json_array_size(json_object_get(r.report->root, "warnings")), 1);
    release(&r);
  }
}

/* A hole of 2 % of the diagonal is closed at 8 %. */
static void test_a_lost_handle_is_named_with_its_size(void **state) {
  (void)state;
  const double hole = 0.3;
  pipeline p;
  pipeline_make(&p, shape_frame(hole), sampling, "");
  result r = simplify(&p, "epsilon=8%");
  assert_int_equal(pipeline_count(r.report, "loops"), 0);
  assert_int_equal(pipeline_count(r.report, "loops_of_solid"), 1);
  const json_t *handles = json_object_get(r.report->root, "lost_handles");
  assert_int_equal(json_array_size(handles), 1);
  assert_int_equal(json_array_size(json_object_get(r.report->root, "warnings")), 1);
  const json_t *handle = json_array_get(handles, 0);
  assert_string_equal(json_string_value(json_object_get(handle, "kind")), "hole");
  const double size = json_real_value(json_object_get(handle, "size")) * pipeline_diagonal(p.mesh);
  assert_near(size, 4 * hole / acos(-1), 1e-9);
  release(&r);
  pipeline_free(&p);
  r = simplify(model(RING), "epsilon=4%");
  assert_null(json_object_get(r.report->root, "lost_handles"));
  release(&r);
}

static void test_many_lost_handles_are_one_warning(void **state) {
  (void)state;
  enum { COUNT = 4 };
  qmat_mesh *one = shape_frame(0.3), *row = shape_new();
  for (int i = 0; i < COUNT; i++) shape_add_copy(row, one, 0, 0, 3 * i);
  pipeline p;
  pipeline_make(&p, row, sampling, "");
  result r = simplify(&p, "epsilon=8%");
  assert_int_equal(pipeline_count(r.report, "loops_of_solid"), COUNT);
  assert_int_equal(pipeline_count(r.report, "loops"), 0);
  assert_int_equal(json_array_size(json_object_get(r.report->root, "lost_handles")), COUNT);
  const json_t *warnings = json_object_get(r.report->root, "warnings");
  assert_int_equal(json_array_size(warnings), 1);
  assert_non_null(
      strstr(json_string_value(json_array_get(warnings, 0)), "the result lacks 4 of the solid's 4 handles"));
  release(&r);
  pipeline_free(&p);
  qmat_value_release(&one->base);
}

static void test_a_number_of_vertices_that_is_not_reached_is_a_warning(void **state) {
  (void)state;
  const pipeline *p = model(SMALL);
  qmat_medial *loose = copy_of(p->medial, false, false);
  result r = simplify_medial(p, loose, "epsilon=0 vertices=3 finest=8%");
  assert_int_equal(r.medial->sphere_count, loose->sphere_count);
  assert_int_equal(json_array_size(json_object_get(r.report->root, "warnings")), 1);
  release(&r);
  qmat_value_release(&loose->base);
}

static void test_spheres_without_edges_stay_as_they_are(void **state) {
  (void)state;
  const pipeline *p = model(SMALL);
  static const char *const settings[] = {"epsilon=8%", "epsilon=0", "epsilon=0 vertices=3 finest=8%"};
  for (size_t i = 0; i < COUNT(settings); i++) {
    qmat_medial *loose = copy_of(p->medial, false, i == 0);
    result r = simplify_medial(p, loose, settings[i]);
    assert_int_equal(r.medial->sphere_count, loose->sphere_count);
    assert_int_equal(r.medial->edge_count, 0);
    assert_int_equal(pipeline_count(r.report, "collapses"), 0);
    release(&r);
    qmat_value_release(&loose->base);
  }
}

static void test_isolated_spheres_stay_beside_what_collapses(void **state) {
  (void)state;
  /* One sphere more, in the middle of the capsule. */
  const pipeline *p = model(SMALL);
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new();
  const size_t count = p->medial->sphere_count;
  medial->sphere_count = count + 1;
  medial->spheres = qmat_alloc(count + 1, 4 * sizeof(double));
  memcpy(medial->spheres, p->medial->spheres, 4 * count * sizeof(double));
  memcpy(&medial->spheres[4 * count], (const double[4]){1.5, 0, 0, 0.25}, 4 * sizeof(double));
  assert_int_equal(qmat_medial_set_simplices(&context, medial, p->medial->edges, p->medial->edge_count,
                                             p->medial->triangles, p->medial->triangle_count),
                   QMAT_OK);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  result r = simplify_medial(p, medial, "epsilon=8%");
  check_errors(p, &r, 0.08, true);
  assert_int_equal(pipeline_components(r.medial), 2);
  assert_true(r.medial->sphere_count < 20);
  const double *last = &r.medial->spheres[4 * (r.medial->sphere_count - 1)];
  assert_near(last[0], 1.5, 1e-12);
  assert_near(last[3], 0.25, 1e-12);
  release(&r);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* Four overlapping spheres in the capsule, whose ends are at 0 and 3; of `count` the first. */
static qmat_medial *spheres_in_capsule(size_t count, const uint32_t *edges, size_t edge_count,
                                       const uint32_t *triangles, size_t triangle_count) {
  static const double spheres[] = {0, 0, 0, 0.95, 3, 0, 0, 0.95, 1.5, 0.1, 0, 0.9, 1.5, -0.1, 0.1, 0.9};
  return sealed_medial_mesh(spheres, count, edges, edge_count, triangles, triangle_count);
}

/* The only warning, NULL for none. */
static void must_warn(const result *r, const char *expected) {
  const json_t *warnings = json_object_get(r->report->root, "warnings");
  assert_int_equal(json_array_size(warnings), expected ? 1 : 0);
  if (expected) assert_string_equal(json_string_value(json_array_get(warnings, 0)), expected);
}

static void test_a_void_that_the_solid_does_not_have_is_opened(void **state) {
  (void)state;
  const pipeline *p = model(SMALL);
  static const uint32_t edges[] = {0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3}, walls[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3};
  qmat_medial *closed = spheres_in_capsule(4, edges, 6, walls, 4);
  result guarded = simplify_medial(p, closed, "epsilon=8% vertices=4");
  result any = simplify_medial(p, closed, "epsilon=8% vertices=4 topology=free");
  assert_int_equal(pipeline_count(any.report, "voids"), 1);
  must_warn(&any, "the result has more voids than the solid: 1 instead of 0");
  must_warn(&guarded, NULL);
  assert_int_equal(guarded.medial->sphere_count, 4);
  assert_int_equal(guarded.medial->triangle_count, 3);
  check_topology(p, &guarded);
  assert_int_equal(pipeline_count(guarded.report, "voids"), 0);
  check_errors(p, &guarded, 0.08, true);
  release(&any);
  release(&guarded);
  qmat_value_release(&closed->base);
}

/* Two cubes that touch at a corner have a sphere of radius zero there in common. */
static void test_solids_that_share_a_sphere_are_a_warning(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, false);
  pipeline p;
  pipeline_make(&p, mesh, sampling, "");
  static const double spheres[] = {0.5, 0.5, 0.5, 0.5, 1, 1, 1, 0, 1.5, 1.5, 1.5, 0.5};
  static const uint32_t edges[] = {0, 1, 1, 2};
  qmat_medial *joined = sealed_medial_mesh(spheres, 3, edges, 2, NULL, 0);
  result r = simplify_medial(&p, joined, "epsilon=0 vertices=3");
  must_warn(&r, "the result joins components of the solid: it has 1 instead of 2");
  release(&r);
  qmat_value_release(&joined->base);
  pipeline_free(&p);
}

static void test_a_loop_that_the_solid_does_not_have_is_closed(void **state) {
  (void)state;
  const pipeline *p = model(SMALL);
  static const uint32_t edges[] = {0, 1, 0, 2, 1, 2};
  qmat_medial *ring = spheres_in_capsule(3, edges, 3, NULL, 0);
  result guarded = simplify_medial(p, ring, "epsilon=8% vertices=3");
  result any = simplify_medial(p, ring, "epsilon=8% vertices=3 topology=free");
  assert_int_equal(pipeline_count(any.report, "loops"), 1);
  must_warn(&any, "the result has more handles than the solid: 1 instead of 0");
  must_warn(&guarded, NULL);
  assert_int_equal(guarded.medial->sphere_count, 3);
  assert_int_equal(guarded.medial->triangle_count, 1);
  check_topology(p, &guarded);
  assert_int_equal(pipeline_count(guarded.report, "loops"), 0);
  check_errors(p, &guarded, 0.08, true);
  release(&any);
  release(&guarded);
  qmat_value_release(&ring->base);
}

/* The corners of a regular tetrahedron with edges of 4, and spheres there whose slabs meet in its middle. */
static const double tetrahedron[] = {1.4142135623730951,  1.4142135623730951,  1.4142135623730951,  0.85,
                                     1.4142135623730951,  -1.4142135623730951, -1.4142135623730951, 0.85,
                                     -1.4142135623730951, 1.4142135623730951,  -1.4142135623730951, 0.85,
                                     -1.4142135623730951, -1.4142135623730951, 1.4142135623730951,  0.85};

/* The convex hull of these spheres: the vertices of a ball, moved to the corner that is farthest their way. */
static qmat_mesh *round_tetrahedron(void) {
  qmat_mesh *mesh = shape_sphere(0.85, 24);
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    double *p = &mesh->positions[3 * v];
    const double *farthest = tetrahedron;
    for (const double *c = tetrahedron; c < tetrahedron + COUNT(tetrahedron); c += 4)
      if (qmat_dot(p, c) > qmat_dot(p, farthest)) farthest = c;
    for (int k = 0; k < 3; k++) p[k] += farthest[k];
  }
  return shape_seal(mesh);
}

/* No wall of the tetrahedron can be spared. */
static void test_part_of_a_wall_opens_a_void_that_needs_all_walls(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, round_tetrahedron(), sampling, "");
  static const uint32_t edges[] = {0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3}, walls[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3};
  qmat_medial *closed = sealed_medial_mesh(tetrahedron, 4, edges, 6, walls, 4);
  result any = simplify_medial(&p, closed, "epsilon=4% topology=free");
  result guarded = simplify_medial(&p, closed, "epsilon=4%");
  assert_int_equal(any.medial->sphere_count, 4);
  assert_int_equal(pipeline_count(any.report, "voids"), 1);
  assert_int_equal(guarded.medial->sphere_count, 5);
  assert_int_equal(guarded.medial->triangle_count, 5);
  assert_int_equal(pipeline_count(guarded.report, "topology_spheres"), 1);
  check_topology(&p, &guarded);
  assert_int_equal(pipeline_count(guarded.report, "voids"), 0);
  check_errors(&p, &guarded, 0.04, true);
  release(&guarded);
  guarded = simplify_medial(&p, closed, "epsilon=4% vertices=4"); /* no fifth one */
  assert_int_equal(guarded.medial->sphere_count, 4);
  assert_int_equal(guarded.medial->triangle_count, 4);
  release(&any);
  release(&guarded);
  qmat_value_release(&closed->base);
  pipeline_free(&p);
}

/* A square ring of size 4 and profile 1 around the origin, with a slit through its side at y = -1.5. */
static qmat_mesh *slit_ring(double slit) {
  qmat_mesh *mesh = shape_new();
  const double x[6] = {slit / 2, 2, 2, -2, -2, -slit / 2}, y[6] = {-2, -2, 2, 2, -2, -2};
  uint32_t v[6][4]; /* outer and inner below, outer and inner above */
  for (int k = 0; k < 6; k++)
    for (int i = 0; i < 4; i++)
      v[k][i] = shape_vertex(mesh, i % 2 == 0 ? x[k] : fmax(-1, fmin(1, x[k])), i % 2 == 0 ? y[k] : y[k] / 2,
                             i < 2 ? -0.5 : 0.5);
  for (int k = 0; k < 5; k++) {
    shape_quad(mesh, v[k][2], v[k + 1][2], v[k + 1][3], v[k][3]);
    shape_quad(mesh, v[k][1], v[k + 1][1], v[k + 1][0], v[k][0]);
    shape_quad(mesh, v[k][0], v[k + 1][0], v[k + 1][2], v[k][2]);
    shape_quad(mesh, v[k][3], v[k + 1][3], v[k + 1][1], v[k][1]);
  }
  shape_quad(mesh, v[0][1], v[0][0], v[0][2], v[0][3]);
  shape_quad(mesh, v[5][3], v[5][2], v[5][0], v[5][1]);
  return shape_seal(mesh);
}

/* No edge of the ring can be spared, and no three edges can be filled. */
static void test_part_of_an_edge_opens_a_loop_that_needs_all_edges(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, slit_ring(0.02), sampling, "");
  static const double corners[] = {-1.5, -1.5, 0, 0.5, 1.5, -1.5, 0, 0.5, 1.5, 1.5, 0, 0.5, -1.5, 1.5, 0, 0.5};
  static const uint32_t edges[] = {0, 1, 0, 3, 1, 2, 2, 3};
  qmat_medial *ring = sealed_medial_mesh(corners, 4, edges, 4, NULL, 0);
  result guarded = simplify_medial(&p, ring, "epsilon=9.5%");
  result any = simplify_medial(&p, ring, "epsilon=9.5% topology=free");
  assert_int_equal(any.medial->sphere_count, 4);
  assert_int_equal(pipeline_count(any.report, "loops"), 1);
  assert_int_equal(guarded.medial->sphere_count, 5);
  assert_int_equal(guarded.medial->edge_count, 4);
  check_topology(&p, &guarded);
  assert_int_equal(pipeline_count(guarded.report, "loops"), 0);
  check_errors(&p, &guarded, 0.095, true);
  release(&any);
  release(&guarded);
  qmat_value_release(&ring->base);
  pipeline_free(&p);
}

/* Two edges join the same spheres the long way round: one can be spared. */
static void test_an_edge_that_is_not_needed_opens_a_loop(void **state) {
  (void)state;
  const pipeline *p = model(SMALL);
  static const uint32_t edges[] = {0, 2, 0, 3, 1, 2, 1, 3};
  qmat_medial *ring = spheres_in_capsule(4, edges, 4, NULL, 0);
  result guarded = simplify_medial(p, ring, "epsilon=8% vertices=4");
  result any = simplify_medial(p, ring, "epsilon=8% vertices=4 topology=free");
  assert_int_equal(pipeline_count(any.report, "loops"), 1);
  assert_int_equal(guarded.medial->sphere_count, 4);
  assert_int_equal(guarded.medial->edge_count, 3);
  assert_int_equal(pipeline_count(guarded.report, "loops"), 0);
  check_errors(p, &guarded, 0.08, true);
  /* Not where all of them are tubular features that have to stay. */
  result kept = simplify_medial(p, ring, "epsilon=8% vertices=4 protect=always theta=10");
  assert_int_equal(kept.medial->edge_count, 4);
  assert_int_equal(pipeline_count(kept.report, "loops"), 1);
  release(&kept);
  release(&any);
  release(&guarded);
  qmat_value_release(&ring->base);
}

static void expect_error(const pipeline *p, const qmat_medial *medial, const char *field) {
  qmat_context context = {0};
  result r;
  assert_int_equal(try_simplify(&context, p, medial, "", &r), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, field);
  qmat_context_uninit(&context);
}

static void test_inputs_of_another_mesh_are_named(void **state) {
  (void)state;
  const pipeline *capsule = model(CAPSULE), *torus = model(TORUS);
  pipeline mixed = *capsule;
  mixed.samples = torus->samples;
  expect_error(&mixed, capsule->medial, "samples");
  mixed = *capsule;
  mixed.thickness = torus->thickness;
  expect_error(&mixed, capsule->medial, "thickness");
  expect_error(capsule, torus->medial, "medial"); /* answers for more samples than there are */
  /* The same mesh, moved: the counts fit, the places do not. */
  qmat_mesh *moved = pipeline_model(models[CAPSULE].name, models[CAPSULE].resolution);
  shape_map(moved, 1, 1, 0, 0);
  mixed = *capsule;
  mixed.mesh = shape_seal(moved);
  expect_error(&mixed, capsule->medial, "samples");
  qmat_value_release(&moved->base);
  /* No sphere at all. */
  qmat_context context = {0};
  qmat_medial *none = qmat_medial_new();
  assert_int_equal(qmat_medial_set_simplices(&context, none, NULL, 0, NULL, 0), QMAT_OK);
  assert_int_equal(qmat_value_seal(&context, &none->base), QMAT_OK);
  expect_error(capsule, none, "medial");
  qmat_value_release(&none->base);
  qmat_context_uninit(&context);
}

static void test_progress_function_cancels(void **state) {
  (void)state;
  const pipeline *p = model(TORUS);
  const qmat_value *inputs[] = {&p->mesh->base, &p->thickness->base, &p->samples->base, &p->medial->base};
  pipeline_must_be_cancelled("medial.simplify", "epsilon=4%", inputs);
  for (size_t stop_at = 0; stop_at < 3; stop_at++) { /* with all threads */
    qmat_value *outputs[PIPELINE_MOST_PORTS];
    size_t calls;
    assert_int_equal(pipeline_run_until(0, stop_at, "medial.simplify", "epsilon=4%", inputs, outputs, &calls),
                     QMAT_CANCELLED);
  }
}

/* Refuses to go on where the points of the first repair are made. */
typedef struct {
  qmat_context *context;
  bool has_measured, has_refused;
} refusal;

static bool refuse_at_repair(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                             const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total;
  refusal *r = user;
  r->context->progress_time = 0;
  r->has_measured |= strcmp(unit, "facets measured") == 0;
  r->has_refused = r->has_measured && strcmp(unit, "constraint points") == 0;
  return !r->has_refused;
}

static void test_a_cancel_where_a_repair_starts_is_one(void **state) {
  (void)state;
  qmat_context context = {.progress = refuse_at_repair};
  refusal user = {.context = &context};
  context.progress_user = &user;
  result r;
  const pipeline *p = model(BOX);
  assert_int_equal(try_simplify(&context, p, p->medial, "epsilon=1%", &r), QMAT_CANCELLED);
  assert_true(user.has_refused);
  qmat_context_uninit(&context);
}

/* How often a run asks whether it may go on when no time is too short, by what it is at. */
typedef struct {
  qmat_context *context;
  size_t constraint_points, collapses;
} questions;

static bool count_question(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                           const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total;
  questions *asked = user;
  asked->context->progress_time = 0;
  asked->constraint_points += strcmp(unit, "constraint points") == 0;
  asked->collapses += strcmp(unit, "collapses") == 0;
  return true;
}

static void test_it_asks_whether_to_go_on_at_every_few_points_and_collapses(void **state) {
  (void)state;
  const pipeline *p = model(TORUS);
  qmat_context context = {0};
  questions asked = {.context = &context};
  context.progress = count_question;
  context.progress_user = &asked;
  result r;
  assert_int_equal(try_simplify(&context, p, p->medial, "epsilon=4%", &r), QMAT_OK);
  assert_true(asked.constraint_points >= (p->samples->count + p->mesh->triangle_count) / 2048);
  assert_true(asked.collapses >= (p->medial->sphere_count - r.medial->sphere_count) / 16);
  release(&r);
  qmat_context_uninit(&context);
}

/* --- invariance --------------------------------------------------------------------------------------------------- */

static void test_moving_scaling_and_shuffling_change_little(void **state) {
  (void)state;
  static const model_name names[] = {TORUS, OCTOPUS};
  for (size_t m = 0; m < COUNT(names); m++) {
    result plain = simplify(model(names[m]), "epsilon=3%");
    for (int variant = m == 0 ? 0 : 2; variant < 4; variant++) {
      qmat_mesh *mesh = pipeline_model(models[names[m]].name, models[names[m]].resolution);
      if (variant == 0) shape_map(mesh, 0x1p-20, 0, 0, 0); /* nothing is rounded: the result is the same, scaled */
      if (variant == 1) shape_map(mesh, 0x1p20, 0, 0, 0);
      if (variant == 2) shape_rotate(mesh);
      if (variant == 3) pipeline_shuffle(mesh);
      pipeline p;
      pipeline_make(&p, mesh, sampling, "");
      result r = simplify(&p, "epsilon=3%");
      check_errors(&p, &r, 0.03, true);
      assert_int_equal(pipeline_components(r.medial), 1);
      if (names[m] == TORUS) assert_int_equal(pipeline_euler(r.medial), 0);
      const double count = (double)plain.medial->sphere_count;
      const double slack = variant < 2 ? 0 : 1 + 0.35 * count; /* a turned bounding box has another diagonal */
      assert_near((double)r.medial->sphere_count, count, slack);
      if (variant < 2) {
        static const char *const sides[] = {"surface_to_envelope", "envelope_to_surface"};
        for (int s = 0; s < 2; s++)
          assert_near(pipeline_number(r.report, sides[s]), pipeline_number(plain.report, sides[s]), ROUNDING);
      }
      release(&r);
      pipeline_free(&p);
    }
    release(&plain);
  }
}

static void test_threads_do_not_change_a_byte(void **state) {
  (void)state;
  static const model_name names[] = {OCTOPUS, BRACKET};
  static const char *const params[] = {"epsilon=6%", "epsilon=2%"};
  static const int threads[] = {1, 2, 8};
  for (size_t m = 0; m < COUNT(names); m++) {
    const pipeline *p = model(names[m]);
    qmat_digest medial = {{0}}, report = {{0}};
    for (size_t i = 0; i < COUNT(threads); i++) {
      qmat_context context = {.threads = threads[i]};
      result r;
      assert_int_equal(try_simplify(&context, p, p->medial, params[m], &r), QMAT_OK);
      if (i == 0) {
        medial = r.medial->base.digest;
        report = r.report->base.digest;
      }
      assert_memory_equal(&r.medial->base.digest, &medial, sizeof medial);
      assert_memory_equal(&r.report->base.digest, &report, sizeof report);
      release(&r);
      qmat_context_uninit(&context);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_both_errors_stay_within_epsilon),
      cmocka_unit_test(test_facets_much_narrower_than_epsilon),
      cmocka_unit_test(test_capsule_becomes_its_axis),
      cmocka_unit_test(test_tapered_capsule_keeps_both_radii),
      cmocka_unit_test(test_torus_keeps_its_loop),
      cmocka_unit_test(test_thin_sheet_stays_on_its_mid_plane),
      cmocka_unit_test(test_a_wavy_shell_much_thinner_than_epsilon_takes_few_spheres),
      cmocka_unit_test(test_thinner_walls_take_no_more_spheres),
      cmocka_unit_test(test_twice_the_epsilon_leaves_no_more_spheres),
      cmocka_unit_test(test_number_of_vertices_within_epsilon_is_met_exactly),
      cmocka_unit_test(test_number_of_vertices_alone_finds_the_least_error),
      cmocka_unit_test(test_a_number_of_vertices_that_is_not_reached_is_a_warning),
      cmocka_unit_test(test_a_number_of_vertices_that_epsilon_prevents_is_a_warning),
      cmocka_unit_test(test_a_lost_handle_is_named_with_its_size),
      cmocka_unit_test(test_many_lost_handles_are_one_warning),
      cmocka_unit_test(test_more_vertices_than_there_are_change_nothing),
      cmocka_unit_test(test_cost_stops_before_dear_collapses),
      cmocka_unit_test(test_one_sided_holds_the_surface_alone),
      cmocka_unit_test(test_stopping_at_epsilon_keeps_it_and_leaves_spheres_that_skipping_does_not),
      cmocka_unit_test(test_topology_is_free_guarded_or_preserved),
      cmocka_unit_test(test_a_planted_medial_mesh_is_found_again),
      cmocka_unit_test(test_joint_fits_find_what_single_fits_do_not),
      cmocka_unit_test(test_protection_keeps_tubular_edges),
      cmocka_unit_test(test_protection_of_nothing_thin_changes_nothing),
      cmocka_unit_test(test_medial_mesh_without_regions_works),
      cmocka_unit_test(test_spheres_without_edges_stay_as_they_are),
      cmocka_unit_test(test_isolated_spheres_stay_beside_what_collapses),
      cmocka_unit_test(test_a_void_that_the_solid_does_not_have_is_opened),
      cmocka_unit_test(test_a_loop_that_the_solid_does_not_have_is_closed),
      cmocka_unit_test(test_solids_that_share_a_sphere_are_a_warning),
      cmocka_unit_test(test_part_of_a_wall_opens_a_void_that_needs_all_walls),
      cmocka_unit_test(test_part_of_an_edge_opens_a_loop_that_needs_all_edges),
      cmocka_unit_test(test_an_edge_that_is_not_needed_opens_a_loop),
      cmocka_unit_test(test_inputs_of_another_mesh_are_named),
      cmocka_unit_test(test_progress_function_cancels),
      cmocka_unit_test(test_a_cancel_where_a_repair_starts_is_one),
      cmocka_unit_test(test_it_asks_whether_to_go_on_at_every_few_points_and_collapses),
      cmocka_unit_test(test_moving_scaling_and_shuffling_change_little),
      cmocka_unit_test(test_threads_do_not_change_a_byte),
  };
  return cmocka_run_group_tests(tests, NULL, tear_down);
}
