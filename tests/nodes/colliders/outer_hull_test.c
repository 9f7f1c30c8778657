/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "core/node.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/outer_hull.h"
#include "tests/random.h"
#include "tests/shapes.h"

enum { ROOM = 600 };
static const double pi = 3.14159265358979323846;

/* How far the points are outside of the hull, at most, and its volume. */
static double outside_of(const qmat_outer_hull *h, const double *points, size_t count, double *volume) {
  uint32_t triangles[6 * ROOM];
  size_t triangle_count;
  double most = -INFINITY;
  assert_int_equal(qmat_convex_hull(h->points, h->point_count, triangles, &triangle_count), QMAT_OK);
  *volume = 0;
  for (size_t t = 0; t < triangle_count; t++) {
    const double *a = &h->points[3 * (size_t)triangles[3 * t]];
    double u[3], v[3], normal[3];
    qmat_subtract(&h->points[3 * (size_t)triangles[3 * t + 1]], a, u);
    qmat_subtract(&h->points[3 * (size_t)triangles[3 * t + 2]], a, v);
    qmat_cross(u, v, normal);
    *volume += qmat_dot(normal, a) / 6;
    qmat_normalize(normal);
    for (size_t i = 0; i < count; i++) most = fmax(most, qmat_dot(normal, &points[3 * i]) - qmat_dot(normal, a));
  }
  return most;
}

static void test_the_corners_of_a_box_are_its_hull(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_outer_hull h;
  double points[81], volume;
  /* With the middles of edges and sides. */
  for (size_t i = 0; i < 27; i++) {
    points[3 * i] = 5 + 2 * (double)(i % 3);
    points[3 * i + 1] = (double)(i / 3 % 3);
    points[3 * i + 2] = 0.01 * (double)(i / 9);
  }
  assert_int_equal(qmat_outer_hull_init(&context, ROOM, 24, &h), QMAT_OK);
  assert_int_equal(qmat_outer_hull_fit(&h, points, 27, 0, 1e-4), QMAT_OK);
  assert_int_equal(h.point_count, 8);
  assert_true(outside_of(&h, points, 27, &volume) <= 1e-12);
  assert_near(volume, 4 * 2 * 0.02, 1e-6);
  /* The sides of 4 x 2 are 0.01 from the middle: a margin of 0.0001 makes all a hundredth larger. */
  assert_int_equal(qmat_outer_hull_fit(&h, points, 27, 1e-4, 1e-4), QMAT_OK);
  assert_true(outside_of(&h, points, 27, &volume) <= -1e-4);
  assert_near(volume, 4 * 2 * 0.02 * 1.01 * 1.01 * 1.01, 1e-5);
  qmat_context_uninit(&context);
}

/* Of a ball, where half-spaces that touch it meet in 128 points, 66 facets leave 4.6 % beyond it; triangles 1.5 %. */
static void test_a_ball_is_met_by_triangles(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_outer_hull h;
  double points[3 * ROOM], volume;
  for (size_t i = 0; i < ROOM; i++) qmat_spread_direction(i, ROOM, &points[3 * i]);
  assert_int_equal(qmat_outer_hull_init(&context, ROOM, 128, &h), QMAT_OK);
  assert_int_equal(qmat_outer_hull_fit(&h, points, ROOM, 0, 1e-4), QMAT_OK);
  assert_true(h.point_count <= 128);
  assert_true(outside_of(&h, points, ROOM, &volume) <= 1e-12);
  assert_true(volume < 1.02 * 4 / 3 * pi);
  qmat_context_uninit(&context);
}

static void test_random_points_are_inside(void **state) {
  (void)state;
  random_numbers random = {.seed = 11};
  for (size_t round = 0; round < 60; round++) {
    qmat_context context = {0};
    qmat_outer_hull h;
    double points[3 * ROOM], volume;
    const size_t count = 4 + random_index(&random, ROOM - 4), most = 24 + 2 * round;
    const double flat = round % 3 == 0 ? 1e-3 : 1; /* some are plates */
    for (size_t i = 0; i < 3 * count; i++) points[i] = random_between(&random, -1, 1) * (i % 3 == 2 ? flat : 1);
    assert_int_equal(qmat_outer_hull_init(&context, ROOM, most, &h), QMAT_OK);
    assert_int_equal(qmat_outer_hull_fit(&h, points, count, 0, 1e-4), QMAT_OK);
    assert_true(h.point_count >= 4 && h.point_count <= most);
    assert_true(outside_of(&h, points, count, &volume) <= 1e-12);
    assert_true(volume < 12 * flat);
    qmat_context_uninit(&context);
  }
}

static void test_points_in_a_plane_have_no_hull(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_outer_hull h;
  double points[3 * 25], same[12] = {0};
  for (size_t i = 0; i < 25; i++) {
    points[3 * i] = (double)(i % 5);
    points[3 * i + 1] = (double)(i / 5);
    points[3 * i + 2] = 1;
  }
  assert_int_equal(qmat_outer_hull_init(&context, ROOM, 24, &h), QMAT_OK);
  assert_int_equal(qmat_outer_hull_fit(&h, points, 25, 0, 1e-4), QMAT_ERROR_GEOMETRY);
  assert_int_equal(qmat_outer_hull_fit(&h, points, 3, 0, 1e-4), QMAT_ERROR_GEOMETRY);
  assert_int_equal(qmat_outer_hull_fit(&h, same, 4, 0, 1e-4), QMAT_ERROR_GEOMETRY);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_corners_of_a_box_are_its_hull),
      cmocka_unit_test(test_a_ball_is_met_by_triangles),
      cmocka_unit_test(test_random_points_are_inside),
      cmocka_unit_test(test_points_in_a_plane_have_no_hull),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
