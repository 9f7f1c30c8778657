/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/point_grid.h"
#include "core/hash.h"

static uint32_t nearest_of_all(const double *points, size_t count, const double *place) {
  double best = INFINITY;
  uint32_t nearest = UINT32_MAX;
  for (size_t i = 0; i < count; i++) {
    double square = 0;
    for (size_t k = 0; k < 3; k++) square += (points[3 * i + k] - place[k]) * (points[3 * i + k] - place[k]);
    if (!(square < best)) continue;
    best = square;
    nearest = (uint32_t)i;
  }
  return nearest;
}

static void fill(double *points, size_t count, uint64_t key, const double size[3]) {
  for (size_t i = 0; i < 3 * count; i++) points[i] = size[i % 3] * (qmat_hash_unit(qmat_hash3(key, i, 0)) - 0.5);
}

static void test_the_nearest_is_that_of_all_also_from_outside(void **state) {
  (void)state;
  enum { POINTS = 3000, PLACES = 500 };
  static double points[3 * POINTS], places[3 * PLACES];
  static const double sizes[][3] = {{1, 1, 1}, {1, 0.01, 0}, {1e-9, 1, 1e-9}, {0, 0, 1}};
  for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
    qmat_context context = {0};
    qmat_point_grid grid;
    fill(points, POINTS, s, sizes[s]);
    fill(places, PLACES, 100 + s, (const double[]){1.5, 1.5, 1.5});
    assert_int_equal(qmat_point_grid_init(&context, points, POINTS, &grid), QMAT_OK);
    for (size_t i = 0; i < PLACES; i++)
      assert_int_equal(qmat_point_grid_nearest(&grid, &places[3 * i]), nearest_of_all(points, POINTS, &places[3 * i]));
    for (size_t i = 0; i < POINTS; i += 7) assert_int_equal(qmat_point_grid_nearest(&grid, &points[3 * i]), i);
    qmat_context_uninit(&context);
  }
}

static void test_of_equally_near_points_the_first_is_told(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_point_grid grid;
  const double corners[] = {1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0, 0, 0, 0, 1, 1, 1};
  assert_int_equal(qmat_point_grid_init(&context, corners, 6, &grid), QMAT_OK);
  assert_int_equal(qmat_point_grid_nearest(&grid, (const double[]){0.5, 0.5, 0.5}), 0);
  assert_int_equal(qmat_point_grid_nearest(&grid, (const double[]){9, 9, 9}), 0);
  assert_int_equal(qmat_point_grid_nearest(&grid, (const double[]){0.5, 0.4, 2}), 2);
  qmat_context_uninit(&context);
}

static void test_a_single_point_is_the_nearest_everywhere(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_point_grid grid;
  const double point[] = {3, 4, 5};
  assert_int_equal(qmat_point_grid_init(&context, point, 1, &grid), QMAT_OK);
  assert_int_equal(qmat_point_grid_nearest(&grid, point), 0);
  assert_int_equal(qmat_point_grid_nearest(&grid, (const double[]){-1e9, 0, 1e9}), 0);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_nearest_is_that_of_all_also_from_outside),
      cmocka_unit_test(test_of_equally_near_points_the_first_is_told),
      cmocka_unit_test(test_a_single_point_is_the_nearest_everywhere),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
