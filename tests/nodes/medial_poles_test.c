/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/surface.h"
#include "core/geometry/vector.h"
#include "tests/nodes/pipeline.h"

typedef struct poles {
  qmat_medial *medial;
  qmat_report *report;
} poles;

static poles make_poles(const pipeline *p, int threads, const char *params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(threads, "medial.poles", params, (const qmat_value *[]){&p->mesh->base, &p->samples->base},
                    outputs);
  return (poles){(qmat_medial *)outputs[0], (qmat_report *)outputs[1]};
}

static void free_poles(poles *p) {
  qmat_value_release(&p->medial->base);
  qmat_value_release(&p->report->base);
}

#define VERTICES "spacing=0 max_per_facet=0"

/* Samples at 4 % of the diagonal. */
static poles make_sampled(pipeline *p, qmat_mesh *mesh) {
  pipeline_sample(p, mesh, "spacing=2%");
  return make_poles(p, 0, "");
}

static size_t index_of(const qmat_medial *medial, double z) {
  for (size_t i = 0; i < medial->sphere_count; i++)
    if (fabs(medial->spheres[4 * i + 2] - z) < 1e-9) return i;
  fail_msg("no sphere at height %g", z);
  return 0;
}

/* --- by hand ----------------------------------------------------------------------------------------------------- */

enum { AROUND = 8 };

/* The default sampling constant asks for more samples than these. */
static void test_two_balls_have_two_inner_poles_and_the_edge_between_them(void **state) {
  (void)state;
  pipeline s;
  pipeline_sample(&s, shape_two_balls(AROUND), VERTICES);
  poles p = make_poles(&s, 0, "sampling=1");
  assert_int_equal(p.medial->sphere_count, 2);
  assert_int_equal(p.medial->edge_count, 1);
  assert_int_equal(p.medial->triangle_count, 0);
  for (uint32_t side = 0; side < 2; side++) {
    const size_t i = index_of(p.medial, side ? 0.5 : -0.5);
    const double *m = &p.medial->spheres[4 * i];
    assert_near(m[0], 0, 1e-9);
    assert_near(m[1], 0, 1e-9);
    assert_near(m[3], sqrt(1.25), 1e-9);
    const uint32_t *region = &p.medial->region_samples[p.medial->region_offsets[i]];
    assert_int_equal(p.medial->region_offsets[i + 1] - p.medial->region_offsets[i], 2 * AROUND + 1);
    for (uint32_t k = 0; k <= 2 * AROUND; k++) assert_int_equal(region[k], k + side * (AROUND + 1));
  }
  assert_int_equal(pipeline_count(p.report, "samples_triangulated"), 3 * AROUND + 2);
  assert_int_equal(pipeline_count(p.report, "inner_poles"), 2);
  assert_int_equal(pipeline_count(p.report, "poles_without_a_label"), 0);
  assert_int_equal(pipeline_count(p.report, "poles_rejected"), 0);
  assert_int_equal(pipeline_count(p.report, "components"), 1);
  free_poles(&p);
  pipeline_free(&s);
}

/* A smaller constant claims denser samples, so the same Voronoi vertices imply larger features. */
static void test_sampling_constant_rejects_second_poles_that_are_too_near(void **state) {
  (void)state;
  pipeline p;
  poles all = make_sampled(&p, pipeline_model("l-bracket", 8));
  free_poles(&all);
  int64_t before = -1;
  static const char *const constants[] = {"sampling=1", "sampling=0.7", "sampling=0.6", "sampling=0.3"};
  for (int i = 0; i < 4; i++) {
    poles found = make_poles(&p, 0, constants[i]);
    const int64_t rejected = pipeline_count(found.report, "poles_rejected");
    if (i == 0) assert_int_equal(rejected, 0);
    assert_true(rejected >= before);
    before = rejected;
    free_poles(&found);
  }
  assert_true(before > 0);
  pipeline_free(&p);
}

/* --- models whose medial axis is known --------------------------------------------------------------------------- */

static void test_sphere_gives_its_centre(void **state) {
  (void)state;
  pipeline s;
  pipeline_sample(&s, pipeline_model("sphere", 16), VERTICES);
  poles p = make_poles(&s, 0, "");
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    assert_near(qmat_point_distance(&p.medial->spheres[4 * i], (const double[3]){0, 0, 0}), 0, 1e-5);
    assert_near(p.medial->spheres[4 * i + 3], 1, 1e-5);
  }
  free_poles(&p);
  p = make_poles(&s, 0, "merge=0.1%");
  assert_int_equal(p.medial->sphere_count, 1);
  assert_int_equal(p.medial->region_sample_count, s.mesh->vertex_count);
  free_poles(&p);
  pipeline_free(&s);
}

static void test_torus_gives_its_core_circle(void **state) {
  (void)state;
  pipeline s;
  pipeline_sample(&s, pipeline_model("torus", 32), VERTICES); /* radii 2 and 0.6 */
  poles p = make_poles(&s, 0, "");
  assert_int_equal(pipeline_components(p.medial), 1);
  assert_true(p.medial->sphere_count >= 60);
  bool seen[12] = {false};
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    const double *m = &p.medial->spheres[4 * i];
    assert_near(hypot(m[0], m[1]), 2, 0.05);
    assert_near(m[2], 0, 0.05);
    assert_near(m[3], 0.6, 0.05);
    seen[(int)floor(6 * (1 + atan2(m[1], m[0]) / acos(-1))) % 12] = true;
  }
  for (int k = 0; k < 12; k++) assert_true(seen[k]);
  free_poles(&p);
  pipeline_free(&s);
}

static void test_box_reaches_into_its_corners_and_stays_inside(void **state) {
  (void)state;
  pipeline p;
  poles found = make_sampled(&p, shape_box(3, 2, 1));
  const qmat_medial *medial = found.medial;
  assert_int_equal(pipeline_components(medial), 1);
  double deepest = 0;
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double *s = &medial->spheres[4 * i];
    assert_true(s[0] > 0 && s[0] < 3 && s[1] > 0 && s[1] < 2 && s[2] > 0 && s[2] < 1);
    deepest = fmax(deepest, s[3]);
  }
  assert_near(deepest, 0.5, 0.05);
  free_poles(&found);
  pipeline_free(&p);
}

/* Figure 3: samples that are sparse for the thickness leave holes in the poles, and none in medial.delaunay. */
static void test_thin_sheet_is_torn_where_samples_are_sparse_and_whole_where_they_are_dense(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("sheet", 24), "spacing=5%", "");
  const double ours = pipeline_error(p.mesh, p.medial, "surface_to_envelope_at_least");
  pipeline_free(&p);
  pipeline_sample(&p, pipeline_model("sheet", 24), VERTICES);
  poles sparse = make_poles(&p, 0, "");
  const double torn = pipeline_error(p.mesh, sparse.medial, "surface_to_envelope_at_least");
  assert_true(torn > 2 * ours);
  free_poles(&sparse);
  pipeline_free(&p);
  pipeline_sample(&p, pipeline_model("sheet", 24), "spacing=1.5%");
  poles dense = make_poles(&p, 0, "");
  const double whole = pipeline_error(p.mesh, dense.medial, "surface_to_envelope_at_least");
  if (!(whole < 0.7 * torn))
    fail_msg("%g with dense samples, %g with sparse ones, %g by medial.delaunay", whole, torn, ours);
  free_poles(&dense);
  pipeline_free(&p);
}

static void test_two_solids_give_two_components(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 1, 1.1, 1.2, false);
  shape_add_box(mesh, 2.5, 0, 0, 3.5, 1.1, 1.2, false);
  pipeline p;
  poles found = make_sampled(&p, mesh);
  assert_int_equal(pipeline_components(found.medial), 2);
  assert_int_equal(pipeline_count(found.report, "components"), 2);
  free_poles(&found);
  pipeline_free(&p);
}

/* --- rules ------------------------------------------------------------------------------------------------------- */

static void test_inner_poles_are_inside_touch_their_samples_and_hold_none(void **state) {
  (void)state;
  pipeline p;
  poles found = make_sampled(&p, pipeline_model("octopus", 10));
  const qmat_medial *medial = found.medial;
  const double tolerance = 1e-5 * pipeline_diagonal(p.mesh);
  qmat_context context = {0};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, p.mesh, &surface), QMAT_OK);
  size_t outside = 0;
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double *s = &medial->spheres[4 * i];
    double centre[3];
    qmat_frame_to_unit(qmat_surface_frame(surface), s, 1, centre);
    outside += !qmat_surface_inside(surface, centre);
    assert_true(medial->region_offsets[i + 1] >= medial->region_offsets[i] + 4);
    for (uint32_t r = medial->region_offsets[i]; r < medial->region_offsets[i + 1]; r++)
      assert_near(qmat_point_distance(s, &p.samples->positions[3 * (size_t)medial->region_samples[r]]), s[3],
                  tolerance);
    for (size_t k = 0; k < p.samples->count; k++)
      assert_true(qmat_point_distance(s, &p.samples->positions[3 * k]) >= s[3] - tolerance);
  }
  assert_true(medial->sphere_count > 500);
  assert_true(outside * 50 < medial->sphere_count);
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
  free_poles(&found);
  pipeline_free(&p);
}

static void test_result_is_an_initial_medial_mesh_for_simplification(void **state) {
  (void)state;
  pipeline p;
  poles found = make_sampled(&p, pipeline_model("tapered-capsule", 24));
  qmat_medial *simple = pipeline_simplify(&p, found.medial, "epsilon=3%");
  assert_in_range(simple->sphere_count, 2, 6);
  assert_true(pipeline_error(p.mesh, simple, "surface_to_envelope") <= 0.03);
  qmat_value_release(&simple->base);
  free_poles(&found);
  pipeline_free(&p);
}

static void test_threads_do_not_change_a_byte(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("octopus", 10), VERTICES);
  pipeline_must_ignore_threads("medial.poles", "", (const qmat_value *[]){&p.mesh->base, &p.samples->base});
  pipeline_free(&p);
}

/* --- errors ------------------------------------------------------------------------------------------------------ */

static void test_eight_corners_are_too_few_samples(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, shape_box(1, 1, 1), VERTICES);
  pipeline_must_fail("medial.poles", "sampling=1", (const qmat_value *[]){&p.mesh->base, &p.samples->base}, "samples");
  pipeline_free(&p);
}

static void test_constant_that_rejects_every_inner_pole_is_named(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, shape_two_balls(AROUND), VERTICES);
  pipeline_must_fail("medial.poles", "sampling=0.01", (const qmat_value *[]){&p.mesh->base, &p.samples->base},
                     "sampling");
  pipeline_free(&p);
}

static void test_samples_of_another_mesh_are_named(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("torus", 8), "spacing=0");
  qmat_mesh *box = shape_seal(shape_box(1, 1, 1));
  pipeline_must_fail("medial.poles", "", (const qmat_value *[]){&box->base, &p.samples->base}, "samples");
  qmat_value_release(&box->base);
  pipeline_free(&p);
}

static void test_progress_function_cancels(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("torus", 8), VERTICES);
  pipeline_must_be_cancelled("medial.poles", "", (const qmat_value *[]){&p.mesh->base, &p.samples->base});
  pipeline_free(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_two_balls_have_two_inner_poles_and_the_edge_between_them),
      cmocka_unit_test(test_sampling_constant_rejects_second_poles_that_are_too_near),
      cmocka_unit_test(test_sphere_gives_its_centre),
      cmocka_unit_test(test_torus_gives_its_core_circle),
      cmocka_unit_test(test_box_reaches_into_its_corners_and_stays_inside),
      cmocka_unit_test(test_thin_sheet_is_torn_where_samples_are_sparse_and_whole_where_they_are_dense),
      cmocka_unit_test(test_two_solids_give_two_components),
      cmocka_unit_test(test_inner_poles_are_inside_touch_their_samples_and_hold_none),
      cmocka_unit_test(test_result_is_an_initial_medial_mesh_for_simplification),
      cmocka_unit_test(test_threads_do_not_change_a_byte),
      cmocka_unit_test(test_eight_corners_are_too_few_samples),
      cmocka_unit_test(test_constant_that_rejects_every_inner_pole_is_named),
      cmocka_unit_test(test_samples_of_another_mesh_are_named),
      cmocka_unit_test(test_progress_function_cancels),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
