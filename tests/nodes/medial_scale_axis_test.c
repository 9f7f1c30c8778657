/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/nodes/pipeline.h"

typedef struct axis {
  qmat_medial *medial;
  qmat_report *report;
} axis;

static axis make_axis(const pipeline *p, int threads, const char *params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(threads, "medial.scale_axis", params, (const qmat_value *[]){&p->mesh->base, &p->samples->base},
                    outputs);
  return (axis){(qmat_medial *)outputs[0], (qmat_report *)outputs[1]};
}

static void free_axis(axis *a) {
  qmat_value_release(&a->medial->base);
  qmat_value_release(&a->report->base);
}

/* Samples at 4 % of the diagonal. */
static axis make_sampled(pipeline *p, qmat_mesh *mesh, const char *params) {
  pipeline_sample(p, mesh, "spacing=4%");
  return make_axis(p, 0, params);
}

/* --- by hand and models whose medial axis is known --------------------------------------------------------------- */

/* Two inscribed balls, which touch the sides between the rings. Scaled and scaled back they are the same balls. */
static void test_two_balls_and_the_edge_between_them_come_out_at_any_scale(void **state) {
  (void)state;
  static const char *const scales[] = {"scale=1", "scale=1.1", "scale=2"};
  pipeline p;
  pipeline_sample(&p, shape_two_balls(8), "spacing=0 n_f=0 max_per_facet=0");
  for (int i = 0; i < 3; i++) {
    axis a = make_axis(&p, 0, scales[i]);
    assert_int_equal(a.medial->sphere_count, 2);
    assert_int_equal(a.medial->edge_count, 1);
    for (size_t k = 0; k < 2; k++) {
      const double *s = &a.medial->spheres[4 * k];
      assert_near(hypot(s[0], s[1]), 0, 1e-9);
      assert_near(fabs(s[2]), 0.5, 1e-9);
      assert_near(s[3], cos(acos(-1) / 8), 1e-9);
    }
    assert_near(a.medial->spheres[2] + a.medial->spheres[6], 0, 1e-9);
    assert_int_equal(pipeline_count(a.report, "balls"), 2);
    assert_int_equal(pipeline_count(a.report, "singular_edges"), 1);
    free_axis(&a);
  }
  pipeline_free(&p);
}

static void test_sphere_gives_its_centre(void **state) {
  (void)state;
  pipeline p;
  axis a = make_sampled(&p, pipeline_model("sphere", 16), "merge=0.1%");
  assert_int_equal(pipeline_components(a.medial), 1);
  double largest = 0;
  for (size_t i = 0; i < a.medial->sphere_count; i++) largest = fmax(largest, a.medial->spheres[4 * i + 3]);
  assert_near(largest, 1, 0.06); /* facets are nearer than their corners */
  free_axis(&a);
  pipeline_free(&p);
}

static void test_torus_gives_a_ring_around_its_hole(void **state) {
  (void)state;
  pipeline p;
  axis a = make_sampled(&p, pipeline_model("torus", 24), "scale=1.3");
  assert_int_equal(pipeline_components(a.medial), 1);
  for (size_t i = 0; i < a.medial->sphere_count; i++) {
    const double *s = &a.medial->spheres[4 * i];
    const double from_core = hypot(hypot(s[0], s[1]) - 2, s[2]);
    assert_true(from_core + s[3] < 0.65); /* the radii are 2 and 0.6 */
  }
  free_axis(&a);
  pipeline_free(&p);
}

static void test_envelope_of_a_box_is_near_its_surface(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, shape_box(3, 2, 1), "spacing=2.5%");
  axis a = make_axis(&p, 0, "");
  assert_int_equal(pipeline_components(a.medial), 1);
  double errors[2];
  pipeline_errors(p.mesh, a.medial, 2, (const char *const[]){"surface_to_envelope", "envelope_out_of_solid"}, errors);
  if (!(errors[0] < 0.06 && errors[1] < 0.04)) fail_msg("%g and %g", errors[0], errors[1]);
  free_axis(&a);
  pipeline_free(&p);
}

/* Section 4.1: thin features are lost unless samples are dense. */
static void test_thin_sheet_is_lost_where_samples_are_sparse_and_found_where_they_are_dense(void **state) {
  (void)state;
  double errors[2];
  static const char *const samplings[] = {"spacing=6% n_f=0 max_per_facet=0", "spacing=1.5%"};
  for (int i = 0; i < 2; i++) {
    pipeline p;
    pipeline_sample(&p, pipeline_model("sheet", i ? 24 : 6), samplings[i]);
    axis a = make_axis(&p, 0, "");
    errors[i] = pipeline_error(p.mesh, a.medial, "surface_to_envelope_at_least");
    free_axis(&a);
    pipeline_free(&p);
  }
  assert_true(errors[1] < 0.5 * errors[0]);
}

/* --- rules ------------------------------------------------------------------------------------------------------- */

/* Small balls vanish in larger ones as these grow. */
static void test_larger_scales_leave_less(void **state) {
  (void)state;
  static const char *const scales[] = {"scale=1", "scale=1.1", "scale=1.5"};
  pipeline p;
  pipeline_sample(&p, pipeline_model("octopus", 8), "spacing=4%");
  size_t before = SIZE_MAX;
  for (int i = 0; i < 3; i++) {
    axis a = make_axis(&p, 0, scales[i]);
    assert_true(a.medial->sphere_count < before);
    before = a.medial->sphere_count;
    free_axis(&a);
  }
  pipeline_free(&p);
}

static void test_result_is_an_initial_medial_mesh_for_simplification(void **state) {
  (void)state;
  pipeline p;
  axis a = make_sampled(&p, pipeline_model("tapered-capsule", 24), "");
  qmat_medial *simple = pipeline_simplify(&p, a.medial, "epsilon=3%");
  assert_in_range(simple->sphere_count, 2, 6);
  assert_true(pipeline_error(p.mesh, simple, "surface_to_envelope") <= 0.03);
  qmat_value_release(&simple->base);
  free_axis(&a);
  pipeline_free(&p);
}

static void test_threads_do_not_change_a_byte(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("octopus", 8), "spacing=4%");
  pipeline_must_ignore_threads("medial.scale_axis", "", (const qmat_value *[]){&p.mesh->base, &p.samples->base});
  pipeline_free(&p);
}

/* --- errors ------------------------------------------------------------------------------------------------------ */

static void test_samples_of_another_mesh_are_named(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("torus", 8), "spacing=0");
  qmat_mesh *box = shape_seal(shape_box(1, 1, 1));
  pipeline_must_fail("medial.scale_axis", "", (const qmat_value *[]){&box->base, &p.samples->base}, "samples");
  qmat_value_release(&box->base);
  pipeline_free(&p);
}

static void test_mesh_without_an_inside_is_named(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, shape_box(1, 2, 3), "spacing=0");
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 1, 2, 3, true); /* inside out */
  shape_seal(mesh);
  pipeline_must_fail("medial.scale_axis", "", (const qmat_value *[]){&mesh->base, &p.samples->base}, "mesh");
  qmat_value_release(&mesh->base);
  pipeline_free(&p);
}

static void test_progress_function_cancels(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("torus", 8), "spacing=0");
  pipeline_must_be_cancelled("medial.scale_axis", "", (const qmat_value *[]){&p.mesh->base, &p.samples->base});
  pipeline_free(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_two_balls_and_the_edge_between_them_come_out_at_any_scale),
      cmocka_unit_test(test_sphere_gives_its_centre),
      cmocka_unit_test(test_torus_gives_a_ring_around_its_hole),
      cmocka_unit_test(test_envelope_of_a_box_is_near_its_surface),
      cmocka_unit_test(test_thin_sheet_is_lost_where_samples_are_sparse_and_found_where_they_are_dense),
      cmocka_unit_test(test_larger_scales_leave_less),
      cmocka_unit_test(test_result_is_an_initial_medial_mesh_for_simplification),
      cmocka_unit_test(test_threads_do_not_change_a_byte),
      cmocka_unit_test(test_samples_of_another_mesh_are_named),
      cmocka_unit_test(test_mesh_without_an_inside_is_named),
      cmocka_unit_test(test_progress_function_cancels),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
