/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "tests/random.h"

enum { SIDE = 4, GRID_POINTS = SIDE * SIDE * SIDE };

static void fill_grid(double points[3 * GRID_POINTS]) {
  for (size_t i = 0; i < GRID_POINTS; i++) {
    points[3 * i] = (double)(i % SIDE);
    points[3 * i + 1] = (double)(i / SIDE % SIDE);
    points[3 * i + 2] = (double)(i / SIDE / SIDE);
  }
}

/* On which side of a triangle's plane a point is: positive outside. */
static double side_of(const double *points, const uint32_t *row, const double *point) {
  const double *a = &points[3 * (size_t)row[0]];
  double ab[3], ac[3], ap[3], normal[3];
  qmat_subtract(&points[3 * (size_t)row[1]], a, ab);
  qmat_subtract(&points[3 * (size_t)row[2]], a, ac);
  qmat_subtract(point, a, ap);
  qmat_cross(ab, ac, normal);
  return qmat_dot(normal, ap);
}

static void assert_convex_and_closed(const double *points, size_t count, const uint32_t *triangles,
                                     size_t triangle_count, double tolerance) {
  for (size_t t = 0; t < triangle_count; t++) {
    const uint32_t *row = &triangles[3 * t];
    for (size_t i = 0; i < count; i++) assert_true(side_of(points, row, &points[3 * i]) <= tolerance);
    for (size_t k = 0; k < 3; k++) {
      size_t twins = 0;
      for (size_t u = 0; u < triangle_count; u++)
        for (size_t l = 0; l < 3; l++)
          twins += triangles[3 * u + l] == row[(k + 1) % 3] && triangles[3 * u + (l + 1) % 3] == row[k];
      assert_int_equal(twins, 1);
    }
  }
}

static void test_a_tetrahedron_is_its_own_hull(void **state) {
  (void)state;
  static const double points[15] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4, 1, 1, 1};
  static const uint32_t faces[12] = {0, 1, 3, 0, 2, 1, 0, 3, 2, 1, 2, 3};
  uint32_t triangles[30];
  size_t count = 0;
  assert_int_equal(qmat_convex_hull(points, 5, triangles, &count), QMAT_OK);
  assert_int_equal(count, 4);
  assert_memory_equal(triangles, faces, sizeof faces);
}

static void test_points_in_a_plane_have_none(void **state) {
  (void)state;
  double points[3 * GRID_POINTS];
  uint32_t triangles[6 * GRID_POINTS];
  size_t count = 0;
  fill_grid(points);
  assert_int_equal(qmat_convex_hull(points, SIDE * SIDE, triangles, &count), QMAT_ERROR_GEOMETRY);
  assert_int_equal(qmat_convex_hull(points, SIDE, triangles, &count), QMAT_ERROR_GEOMETRY);
}

static void test_random_points_are_within_a_closed_hull(void **state) {
  (void)state;
  enum { COUNT = 60 };
  for (uint64_t seed = 0; seed < 10; seed++) {
    random_numbers random = {.seed = seed};
    double points[3 * COUNT];
    uint32_t triangles[6 * COUNT];
    size_t count = 0;
    for (size_t i = 0; i < 3 * COUNT; i++) points[i] = random_between(&random, -1, 1);
    assert_int_equal(qmat_convex_hull(points, COUNT, triangles, &count), QMAT_OK);
    assert_convex_and_closed(points, COUNT, triangles, count, 1e-12);
  }
}

/* Sixteen points lie in each plane of the grid's border. Blocks of memory of changing sizes in between give CGAL's
 * vertices other addresses, in another order. */
static void test_the_triangles_of_a_plane_do_not_depend_on_memory(void **state) {
  (void)state;
  double points[3 * GRID_POINTS];
  uint32_t expected[6 * GRID_POINTS], triangles[6 * GRID_POINTS];
  size_t expected_count = 0, count = 0;
  void *blocks[400] = {NULL};
  random_numbers random = {.seed = 5};
  fill_grid(points);
  assert_int_equal(qmat_convex_hull(points, GRID_POINTS, expected, &expected_count), QMAT_OK);
  assert_int_equal(expected_count, 6 * 2 * (SIDE - 1) * (SIDE - 1));
  assert_convex_and_closed(points, GRID_POINTS, expected, expected_count, 0);
  for (int i = 0; i < 50; i++) {
    for (size_t b = 0; b < 400; b++) blocks[b] = malloc(16 + random_index(&random, 200));
    for (size_t b = 0; b < 400; b++)
      if (random_index(&random, 2)) {
        free(blocks[b]);
        blocks[b] = NULL;
      }
    assert_int_equal(qmat_convex_hull(points, GRID_POINTS, triangles, &count), QMAT_OK);
    for (size_t b = 0; b < 400; b++) free(blocks[b]);
    assert_int_equal(count, expected_count);
    assert_memory_equal(triangles, expected, 3 * count * sizeof *triangles);
  }
}

/* Points in a plane but for rounding, some of them twice: a closed hull of theirs, or none. */
static void test_points_in_a_plane_up_to_rounding_have_a_hull_of_theirs_or_none(void **state) {
  (void)state;
  enum { COUNT = 30, SEEDS = 200 };
  size_t accepted = 0;
  for (uint64_t seed = 0; seed < SEEDS; seed++) {
    random_numbers random = {.seed = seed};
    double points[3 * COUNT], sides[6];
    uint32_t triangles[6 * COUNT];
    size_t count = 0;
    for (size_t i = 0; i < 6; i++) sides[i] = random_between(&random, -1, 1);
    for (size_t i = 0; i < COUNT; i++) {
      const double u = random_between(&random, -1, 1), v = random_between(&random, -1, 1);
      for (size_t k = 0; k < 3; k++)
        points[3 * i + k] = i % 5 == 4 ? points[3 * (i - 2) + k] : u * sides[k] + v * sides[3 + k];
    }
    const qmat_status status = qmat_convex_hull(points, COUNT, triangles, &count);
    if (status != QMAT_OK) {
      assert_int_equal(status, QMAT_ERROR_GEOMETRY);
      continue;
    }
    accepted++;
    assert_in_range(count, 4, 2 * COUNT);
    for (size_t i = 0; i < 3 * count; i++) assert_in_range(triangles[i], 0, COUNT - 1);
    assert_convex_and_closed(points, COUNT, triangles, count, 1e-12);
  }
  assert_true(accepted >= SEEDS - SEEDS / 10);
}

/* The first points of the grid are in a line, then in a plane. */
static void test_a_growing_hull_is_that_of_all_points_so_far(void **state) {
  (void)state;
  double points[3 * GRID_POINTS];
  uint32_t expected[6 * GRID_POINTS], triangles[6 * GRID_POINTS];
  fill_grid(points);
  qmat_growing_hull hull = {0};
  for (size_t count = 2; count <= GRID_POINTS; count += count % 7 + 1) {
    size_t expected_count = 0, triangle_count = 0;
    const qmat_status status = qmat_convex_hull(points, count, expected, &expected_count);
    assert_int_equal(status, count <= SIDE * SIDE ? QMAT_ERROR_GEOMETRY : QMAT_OK);
    assert_int_equal(qmat_growing_hull_of(&hull, points, count, triangles, &triangle_count), status);
    assert_int_equal(triangle_count, expected_count);
    assert_memory_equal(triangles, expected, 3 * expected_count * sizeof *triangles);
  }
  qmat_growing_hull_uninit(&hull);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_tetrahedron_is_its_own_hull),
      cmocka_unit_test(test_points_in_a_plane_have_none),
      cmocka_unit_test(test_points_in_a_plane_up_to_rounding_have_a_hull_of_theirs_or_none),
      cmocka_unit_test(test_a_growing_hull_is_that_of_all_points_so_far),
      cmocka_unit_test(test_random_points_are_within_a_closed_hull),
      cmocka_unit_test(test_the_triangles_of_a_plane_do_not_depend_on_memory),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
