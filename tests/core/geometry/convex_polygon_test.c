/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/convex_polygon.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/shapes.h"

static void test_a_square_is_cut_in_two(void **state) {
  (void)state;
  double square[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, kept[6][3], heights[4];
  for (int i = 0; i < 4; i++) heights[i] = square[i][0] - 0.25;
  assert_int_equal(qmat_convex_polygon_cut(square, heights, 4, kept), 4);
  static const double expected[4][3] = {{0, 0, 0}, {0.25, 0, 0}, {0.25, 1, 0}, {0, 1, 0}};
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 3; k++) assert_near(kept[i][k], expected[i][k], 0);
}

static void test_a_polygon_above_below_or_on_the_plane(void **state) {
  (void)state;
  double triangle[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, kept[4][3];
  assert_int_equal(qmat_convex_polygon_cut(triangle, (const double[]){1, 2, 3}, 3, kept), 0);
  assert_int_equal(qmat_convex_polygon_cut(triangle, (const double[]){-1, -2, -3}, 3, kept), 3);
  assert_int_equal(qmat_convex_polygon_cut(triangle, (const double[]){0, 0, 0}, 3, kept), 3);
  assert_int_equal(qmat_convex_polygon_cut(triangle, (const double[]){0, 1, 0}, 3, kept), 2);
  assert_int_equal(qmat_convex_polygon_cut(triangle, NULL, 0, kept), 0);
}

/* Heights of any sign, also those that only rounding errors give. */
static void test_corners_are_at_most_half_as_many_again(void **state) {
  (void)state;
  enum { MOST = 12 };
  random_numbers random = {.seed = 1};
  int largest = 0;
  for (int count = 3; count <= MOST; count++) {
    for (int round = 0; round < 4000; round++) {
      double polygon[MOST][3], kept[3 * MOST / 2][3], heights[MOST];
      for (int i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) polygon[i][k] = random_between(&random, -1, 1);
        heights[i] = random_between(&random, -1, 1);
        if (round % 3 == 0) heights[i] = (i % 2 ? 1 : -1) * 1e-17;
      }
      const int corners = qmat_convex_polygon_cut(polygon, heights, count, kept);
      assert_true(corners <= 3 * count / 2);
      if (corners > largest) largest = corners;
      for (int i = 0; i < corners; i++)
        for (int k = 0; k < 3; k++) assert_true(kept[i][k] >= -1 && kept[i][k] <= 1);
    }
  }
  assert_int_equal(largest, 3 * MOST / 2);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_square_is_cut_in_two),
      cmocka_unit_test(test_a_polygon_above_below_or_on_the_plane),
      cmocka_unit_test(test_corners_are_at_most_half_as_many_again),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
