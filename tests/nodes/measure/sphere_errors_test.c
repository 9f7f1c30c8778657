/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/hash.h"
#include "nodes/measure/hausdorff_bound.h"
#include "nodes/measure/medial_errors.h"
#include "nodes/measure/sphere_errors.h"
#include "tests/nodes/pipeline.h"
#include "tests/shapes.h"

static const double TOLERANCE = 2e-3;

/* Errors of the spheres (in model units, as the tolerance) against a mesh; both are released. Returns the largest F by
 * the bound over the whole surface. */
static double measure(qmat_mesh *mesh, const double *spheres, size_t count, const uint32_t *edges, size_t edge_count,
                      int threads, double *errors) {
  qmat_context context = {.threads = threads};
  qmat_surface *surface;
  qmat_envelope *envelope;
  qmat_hausdorff_bound all;
  double *unit = qmat_alloc(count, 4 * sizeof *unit);
  assert_non_null(unit);
  shape_seal(mesh);
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  const qmat_frame *frame = qmat_surface_frame(surface);
  qmat_frame_spheres_to_unit(frame, spheres, count, unit);
  assert_int_equal(qmat_envelope_new(&context, unit, count, edges, edge_count, NULL, 0, &envelope), QMAT_OK);
  const double tolerance = TOLERANCE / frame->diagonal;
  assert_int_equal(qmat_sphere_errors_measure(&context, surface, envelope, unit, count, INFINITY, tolerance, errors),
                   QMAT_OK);
  assert_int_equal(qmat_hausdorff_bound_measure(&context, surface, envelope, 0, tolerance, INFINITY, INFINITY, &all),
                   QMAT_OK);
  for (size_t i = 0; i < count; i++) errors[i] *= frame->diagonal;
  const double largest = all.found * frame->diagonal;
  qmat_envelope_free(envelope);
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
  qmat_value_release(&mesh->base);
  qmat_free(unit);
  return largest;
}

static qmat_mesh *two_boxes(void) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, -1, -1, -1, 1, 1, 1, false);
  shape_add_box(mesh, 9, -1, -1, 11, 1, 1, false);
  return mesh;
}

static void test_each_of_two_balls_has_the_distance_to_its_own_corners(void **state) {
  (void)state;
  const double spheres[] = {0, 0, 0, 1, 10, 0, 0, 1.5};
  double errors[2];
  measure(two_boxes(), spheres, 2, NULL, 0, 1, errors);
  assert_in_range((int)((errors[0] - (sqrt(3) - 1)) * 1e7), 0, (int)(TOLERANCE * 1e7));
  assert_in_range((int)((errors[1] - (sqrt(3) - 1.5)) * 1e7), 0, (int)(TOLERANCE * 1e7));
}

static void test_what_answers_for_nothing_or_covers_all_has_no_error(void **state) {
  (void)state;
  /* The second is within the first, the third covers its box, the fourth has no volume and is far from all. */
  const double spheres[] = {0, 0, 0, 1, 0, 0, 0, 0.25, 10, 0, 0, 2, 5, 90, 0, 0};
  double errors[4];
  measure(two_boxes(), spheres, 4, NULL, 0, 1, errors);
  assert_true(errors[0] >= sqrt(3) - 1);
  assert_true(errors[1] == 0 && errors[2] == 0 && errors[3] == 0);
}

static void test_the_ends_of_a_cone_share_the_surface_at_its_middle(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, -3, -1, -1, 3, 1, 1, false);
  /* The left end fits the box's sides, the right one is half as thick. */
  const double spheres[] = {-2, 0, 0, 1, 2, 0, 0, 0.5};
  const uint32_t edge[] = {0, 1};
  double errors[2];
  const double largest = measure(mesh, spheres, 2, edge, 1, 1, errors);
  /* The corner (3, 1, 1) is the farthest from the right end; (-3, 1, 1) from the left one is sqrt(3) - 1. */
  assert_near(errors[1], sqrt(3) - 0.5, TOLERANCE);
  assert_near(largest, errors[1], TOLERANCE);
  assert_true(errors[0] >= sqrt(3) - 1 && errors[0] < errors[1]);
}

static void test_the_largest_is_that_of_the_whole_surface_for_any_threads(void **state) {
  (void)state;
  enum { COUNT = 40 };
  double spheres[4 * COUNT], errors[COUNT], again[COUNT];
  for (size_t i = 0; i < 4 * COUNT; i++)
    spheres[i] = i % 4 == 3 ? qmat_hash_unit(qmat_hash3(1, i, 0)) * 0.2 : qmat_hash_unit(qmat_hash3(1, i, 0)) * 2 - 1;
  uint32_t edges[COUNT];
  for (uint32_t i = 0; i < COUNT; i++) edges[i] = i;
  const double largest = measure(pipeline_model("torus", 40), spheres, COUNT, edges, COUNT / 2, 1, errors);
  double most = 0;
  for (size_t i = 0; i < COUNT; i++) most = fmax(most, errors[i]);
  assert_true(most >= largest - 1e-12 && most <= largest + TOLERANCE);
  for (int threads = 2; threads <= 8; threads *= 4) {
    measure(pipeline_model("torus", 40), spheres, COUNT, edges, COUNT / 2, threads, again);
    assert_memory_equal(errors, again, sizeof errors);
  }
}

/* One that is not measured is 0, also where the struct held others before. */
static void test_errors_that_are_freed_are_not_measured(void **state) {
  (void)state;
  qmat_medial_errors errors = {.surface_to_envelope = 1,
                               .envelope_to_surface = 2,
                               .boundary_to_surface = 3,
                               .uncovered_count = 1,
                               .uncovered = qmat_calloc(3, sizeof(double))};
  qmat_medial_errors_uninit(&errors);
  assert_true(errors.surface_to_envelope == 0 && errors.envelope_to_surface == 0 && errors.boundary_to_surface == 0);
  assert_true(errors.uncovered_count == 0 && !errors.uncovered);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_each_of_two_balls_has_the_distance_to_its_own_corners),
      cmocka_unit_test(test_what_answers_for_nothing_or_covers_all_has_no_error),
      cmocka_unit_test(test_the_ends_of_a_cone_share_the_surface_at_its_middle),
      cmocka_unit_test(test_the_largest_is_that_of_the_whole_surface_for_any_threads),
      cmocka_unit_test(test_errors_that_are_freed_are_not_measured),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
