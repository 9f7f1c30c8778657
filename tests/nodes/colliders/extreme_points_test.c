/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "core/hash.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/extreme_points.h"
#include "nodes/colliders/hull_vertices.h"
#include "nodes/colliders/plane_tree.h"

enum { MOST = 2000 };

/* A grid of points over all sides of a cube, and inside of it, has eight extreme points. */
static void test_of_a_grid_in_a_cube_the_corners_stay(void **state) {
  (void)state;
  double points[3 * MOST];
  size_t count = 0;
  for (int i = 0; i < 11 * 11 * 11; i++) {
    const double at[3] = {i % 11 / 10.0, i / 11 % 11 / 10.0, i / 121 / 10.0};
    memcpy(&points[3 * count++], at, sizeof at);
  }
  assert_int_equal(qmat_extreme_points_keep(points, &count, 1e-9), QMAT_OK);
  assert_int_equal(count, 8);
  int found = 0;
  for (size_t i = 0; i < count; i++) {
    int corner = 0;
    for (size_t k = 0; k < 3; k++) {
      assert_true(points[3 * i + k] == 0 || points[3 * i + k] == 1);
      corner |= (points[3 * i + k] == 1) << k;
    }
    found |= 1 << corner;
  }
  assert_int_equal(found, 255);
}

/* Points on a sphere are all extreme. Those of the ball of half the radius are not. */
static void test_of_a_ball_the_points_of_its_sphere_stay(void **state) {
  (void)state;
  double points[3 * MOST];
  size_t count = MOST;
  for (size_t i = 0; i < MOST; i++) {
    qmat_spread_direction(i, MOST, &points[3 * i]);
    for (size_t k = 0; k < 3 && i % 4 != 0; k++) points[3 * i + k] *= 0.5 * qmat_hash_unit(qmat_hash3(5, i, k));
  }
  assert_int_equal(qmat_extreme_points_keep(points, &count, 1e-9), QMAT_OK);
  assert_int_equal(count, MOST / 4);
  for (size_t i = 0; i < count; i++) assert_true(fabs(qmat_dot(&points[3 * i], &points[3 * i]) - 1) < 1e-12);
}

/* All points are within the tolerance of the hull of those kept: of a coarse one, too, for which fewer stay. */
static void test_all_points_are_within_the_tolerance(void **state) {
  (void)state;
  static const double tolerances[] = {1e-9, 1e-3, 0.03};
  static double all[3 * MOST], points[3 * MOST];
  static uint32_t triangles[6 * MOST];
  size_t before = MOST + 1;
  for (size_t i = 0; i < MOST; i++) {
    qmat_spread_direction(i, MOST, &all[3 * i]);
    for (size_t k = 0; k < 3; k++) all[3 * i + k] *= (double)(k + 1) * qmat_hash_unit(qmat_hash3(6, i, 0));
  }
  for (size_t c = 0; c < sizeof tolerances / sizeof *tolerances; c++) {
    size_t count = MOST, triangle_count;
    memcpy(points, all, sizeof points);
    assert_int_equal(qmat_extreme_points_keep(points, &count, tolerances[c]), QMAT_OK);
    assert_true(count < before);
    before = count;
    assert_int_equal(qmat_convex_hull(points, count, triangles, &triangle_count), QMAT_OK);
    for (size_t t = 0; t < triangle_count; t++) {
      const double *corner = &points[3 * (size_t)triangles[3 * t]];
      double u[3], v[3], normal[3];
      qmat_subtract(&points[3 * (size_t)triangles[3 * t + 1]], corner, u);
      qmat_subtract(&points[3 * (size_t)triangles[3 * t + 2]], corner, v);
      qmat_cross(u, v, normal);
      qmat_normalize(normal);
      for (size_t i = 0; i < MOST; i++)
        assert_true(qmat_dot(normal, &all[3 * i]) <= qmat_dot(normal, corner) + tolerances[c] + 1e-12);
    }
  }
}

/* Points in a plane, and points that are one, stay: they have no hull. So do few. */
static void test_points_without_a_hull_stay(void **state) {
  (void)state;
  double points[300], given[300];
  for (size_t i = 0; i < 100; i++) {
    given[3 * i] = (double)(i % 10);
    given[3 * i + 1] = (double)(i / 10);
    given[3 * i + 2] = 2;
  }
  size_t count = 100;
  memcpy(points, given, sizeof points);
  assert_int_equal(qmat_extreme_points_keep(points, &count, 1e-9), QMAT_OK);
  assert_int_equal(count, 100);
  double sum[3] = {0};
  for (size_t i = 0; i < 300; i++) sum[i % 3] += points[i];
  assert_true(sum[0] == 450 && sum[1] == 450 && sum[2] == 200);
  for (size_t i = 0; i < 300; i++) points[i] = 1;
  assert_int_equal(qmat_extreme_points_keep(points, &count, 1e-9), QMAT_OK);
  assert_int_equal(count, 100);
  count = 0;
  assert_int_equal(qmat_extreme_points_keep(points, &count, 1e-9), QMAT_OK);
  assert_int_equal(count, 0);
  count = 5;
  memcpy(points, given, sizeof points);
  assert_int_equal(qmat_extreme_points_keep(points, &count, 1e-9), QMAT_OK);
  assert_int_equal(count, 5);
  assert_memory_equal(points, given, 15 * sizeof *points);
}

/* Planes of a sphere of `count` points; twice each, so that of each two equal ones the first is found. Returns how many
 * planes are looked at for a point near the sphere. */
static double planes_visited(size_t count) {
  enum { QUERIES = 500 };
  double *points = qmat_alloc(count, 3 * sizeof *points), *planes = qmat_alloc(count, 16 * sizeof *planes);
  double(*places)[3] = qmat_alloc(count, 4 * sizeof *places);
  uint32_t *triangles = qmat_alloc(count, 6 * sizeof *triangles);
  size_t triangle_count, plane_count, visited = 0;
  assert_true(points && planes && places && triangles);
  for (size_t i = 0; i < count; i++) qmat_spread_direction(i, count, &points[3 * i]);
  assert_int_equal(qmat_convex_hull(points, count, triangles, &triangle_count), QMAT_OK);
  for (plane_count = 0; plane_count < 2 * triangle_count; plane_count++) {
    const uint32_t *corners = &triangles[3 * (plane_count % triangle_count)];
    assert_true(qmat_hull_plane(points, corners, &planes[4 * plane_count]));
    memcpy(places[plane_count], &points[3 * (size_t)corners[0]], sizeof places[0]);
  }
  qmat_plane_tree tree = {0};
  assert_true(qmat_plane_tree_make(&tree, planes, (const double(*)[3])places, plane_count));
  for (size_t i = 0; i < QUERIES; i++) {
    double point[3], height = 1e-9, most = 1e-9;
    qmat_spread_direction(i, QUERIES, point);
    for (size_t k = 0; k < 3; k++) point[k] *= 0.999 + 0.002 * qmat_hash_unit(qmat_hash3(7, i, 0));
    size_t best = SIZE_MAX;
    for (size_t t = 0; t < plane_count; t++) {
      const double of_plane = qmat_dot(&planes[4 * t], point) - planes[4 * t + 3];
      if (!(of_plane > most)) continue;
      most = of_plane;
      best = t;
    }
    assert_int_equal(qmat_plane_tree_farthest(&tree, point, &height, &visited), best);
    assert_true(height == most);
  }
  qmat_plane_tree_uninit(&tree);
  qmat_free(points);
  qmat_free(planes);
  qmat_free(places);
  qmat_free(triangles);
  return (double)visited / QUERIES;
}

/* The same plane as among all, after looks at about as many planes for any number of them. */
static void test_the_farthest_plane_is_found_among_few(void **state) {
  (void)state;
  const double of_few = planes_visited(500), of_many = planes_visited(8000);
  if (!(of_many < 2 * of_few + 32 && of_many < 400)) fail_msg("%.1f planes, after %.1f", of_many, of_few);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_of_a_grid_in_a_cube_the_corners_stay),
      cmocka_unit_test(test_of_a_ball_the_points_of_its_sphere_stay),
      cmocka_unit_test(test_all_points_are_within_the_tolerance),
      cmocka_unit_test(test_points_without_a_hull_stay),
      cmocka_unit_test(test_the_farthest_plane_is_found_among_few),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
