/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "core/node.h"
#include "nodes/colliders/tangent_hull.h"
#include "tests/random.h"
#include "tests/shapes.h"

static const double pi = 3.14159265358979323846;

/* How far the spheres and the vertices reach along a direction, as a vertex beyond a sphere. */
static double excess(const qmat_tangent_hull *h, const double *spheres, int count, const double normal[3]) {
  double shape = -INFINITY, hull = -INFINITY;
  for (int s = 0; s < count; s++) shape = fmax(shape, qmat_dot(normal, &spheres[4 * s]) + spheres[4 * s + 3]);
  for (size_t i = 0; i < h->point_count; i++) hull = fmax(hull, qmat_dot(normal, &h->points[3 * i]));
  return hull - shape;
}

static double farthest_vertex(const qmat_tangent_hull *h, const double *spheres, const uint32_t ids[3]) {
  qmat_prepared_shape shape;
  double most = 0;
  qmat_shape_prepare(&shape, spheres, ids);
  for (size_t i = 0; i < h->point_count; i++) most = fmax(most, qmat_shape_distance(&shape, &h->points[3 * i], NULL));
  return most;
}

static void test_a_sphere_begins_with_a_cube(void **state) {
  (void)state;
  static const double ball[4] = {1, 2, 3, 0.5};
  static const uint32_t ids[3] = {0, 0, 0};
  qmat_context context = {0};
  qmat_tangent_hull h;
  assert_int_equal(qmat_tangent_hull_init(&context, 64, &h), QMAT_OK);
  assert_int_equal(qmat_tangent_hull_fit(&h, ball, ids, 0.5), QMAT_OK); /* corners are out by 0.366 */
  assert_int_equal(h.point_count, 8);
  for (size_t i = 0; i < 24; i++) assert_near(fabs(h.points[i] - ball[i % 3]), 0.5, 1e-9);
  assert_int_equal(qmat_tangent_hull_fit(&h, ball, ids, 0.3), QMAT_OK); /* and are cut off */
  assert_true(h.point_count > 8 && farthest_vertex(&h, ball, ids) <= 0.3);
  qmat_context_uninit(&context);
}

static void test_a_plate_keeps_its_thickness(void **state) {
  (void)state;
  static const double plate[12] = {0, 0, 0, 0.1, 4, 0, 0, 0.1, 0, 3, 0, 0.1};
  static const double tapered[12] = {0, 0, 0, 0.1, 4, 0, 0, 0.3, 0, 3, 0, 0.1};
  static const uint32_t ids[3] = {0, 1, 2};
  qmat_context context = {0};
  qmat_tangent_hull h;
  assert_int_equal(qmat_tangent_hull_init(&context, 24, &h), QMAT_OK);
  assert_int_equal(qmat_tangent_hull_fit(&h, plate, ids, 1e-6), QMAT_OK);
  for (double z = -1; z <= 1; z += 2) assert_near(excess(&h, plate, 3, (const double[3]){0, 0, z}), 0, 1e-9);
  /* The plane that touches three spheres of radii 0.1, 0.3 and 0.1: its normal leans by -0.2 / 4 along x. */
  assert_int_equal(qmat_tangent_hull_fit(&h, tapered, ids, 1e-6), QMAT_OK);
  for (double z = -1; z <= 1; z += 2)
    assert_near(excess(&h, tapered, 3, (const double[3]){-0.05, 0, z * sqrt(1 - 0.05 * 0.05)}), 0, 1e-9);
  qmat_context_uninit(&context);
}

static void test_random_shapes_are_inside_within_the_error_and_the_limit(void **state) {
  (void)state;
  random_numbers random = {.seed = 7};
  for (size_t round = 0; round < 60; round++) {
    qmat_context context = {0};
    qmat_tangent_hull h;
    double spheres[12];
    const uint32_t ids[3] = {0, round % 3 > 0, (uint32_t)(round % 3)};
    for (size_t i = 0; i < 12; i++)
      spheres[i] = i % 4 == 3 ? random_between(&random, 0.01, 0.3) : random_between(&random, -1, 1);
    assert_int_equal(qmat_tangent_hull_init(&context, 24 + 8 * round, &h), QMAT_OK);
    assert_int_equal(qmat_tangent_hull_fit(&h, spheres, ids, 0.02), QMAT_OK);
    assert_true(h.point_count >= 8 && h.point_count <= 24 + 8 * round);
    if (round >= 20) assert_true(farthest_vertex(&h, spheres, ids) <= 0.02 + 1e-9);
    for (size_t i = 0; i < 500; i++) {
      const double z = random_between(&random, -1, 1), a = random_between(&random, 0, 2 * pi), r = sqrt(1 - z * z);
      assert_true(excess(&h, spheres, 1 + (int)(round % 3), (const double[3]){r * cos(a), r * sin(a), z}) >= -1e-12);
    }
    qmat_context_uninit(&context);
  }
}

static void test_a_point_has_no_hull(void **state) {
  (void)state;
  static const double none[4] = {1, 2, 3, 0};
  static const uint32_t ids[3] = {0, 0, 0};
  qmat_context context = {0};
  qmat_tangent_hull h;
  assert_int_equal(qmat_tangent_hull_init(&context, 24, &h), QMAT_OK);
  assert_int_equal(qmat_tangent_hull_fit(&h, none, ids, 0.1), QMAT_ERROR_GEOMETRY);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_sphere_begins_with_a_cube),
      cmocka_unit_test(test_a_plate_keeps_its_thickness),
      cmocka_unit_test(test_random_shapes_are_inside_within_the_error_and_the_limit),
      cmocka_unit_test(test_a_point_has_no_hull),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
