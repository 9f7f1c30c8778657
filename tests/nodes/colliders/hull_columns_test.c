/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/hash.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_columns.h"
#include "tests/shapes.h"

enum { MOST = 40 };

static qmat_hull_columns columns_of(const double *points, size_t count) {
  uint32_t triangles[6 * MOST];
  size_t triangle_count;
  qmat_hull_columns columns;
  assert_int_equal(qmat_convex_hull(points, count, triangles, &triangle_count), QMAT_OK);
  assert_int_equal(qmat_hull_columns_make(points, triangles, triangle_count, &columns), QMAT_OK);
  return columns;
}

static qmat_hull_columns columns_of_box(const double low[3], const double high[3]) {
  double points[24];
  for (int i = 0; i < 24; i++) points[i] = i / 3 >> i % 3 & 1 ? high[i % 3] : low[i % 3];
  return columns_of(points, 8);
}

/* Boxes of 1/4 x 1/4 x 1/2 and 1/4 x 1/2 x 1/4 share 1/8 x 1/4 x 1/8. */
static void test_boxes_by_hand(void **state) {
  (void)state;
  const qmat_hull_columns a = columns_of_box((double[]){0, 0, -0.25}, (double[]){0.25, 0.25, 0.25});
  const qmat_hull_columns b = columns_of_box((double[]){0.125, -0.125, 0.125}, (double[]){0.375, 0.375, 0.375});
  const qmat_hull_columns far = columns_of_box((double[]){-0.5, -0.5, -0.5}, (double[]){-0.25, -0.25, 0.5});
  const qmat_hull_columns *others[] = {&far, &b, &b};
  assert_near(qmat_hull_columns_beyond(&a, NULL, 0), 1.0 / 32, 1e-12);
  assert_near(qmat_hull_columns_beyond(&a, others, 1), 1.0 / 32, 1e-12);
  assert_near(qmat_hull_columns_beyond(&a, others, 3), 1.0 / 32 - 1.0 / 256, 1e-12);
  assert_near(qmat_hull_columns_beyond(&a, (const qmat_hull_columns *[]){&a}, 1), 0, 0);
  assert_true(qmat_hull_columns_meet(&a, &b) && qmat_hull_columns_meet(&b, &a));
  assert_false(qmat_hull_columns_meet(&a, &far));
  qmat_hull_columns all[] = {a, b, far};
  for (int i = 0; i < 3; i++) qmat_hull_columns_free(&all[i]);
}

/* A hull between the lines has no volume, and takes none from others. */
static void test_a_hull_between_lines_has_no_volume(void **state) {
  (void)state;
  qmat_hull_columns small = columns_of_box((double[]){0, 0, 0}, (double[]){0.001, 0.001, 0.4});
  qmat_hull_columns box = columns_of_box((double[]){-0.25, -0.25, 0}, (double[]){0.25, 0.25, 0.25});
  assert_near(qmat_hull_columns_beyond(&small, NULL, 0), 0, 0);
  assert_near(qmat_hull_columns_beyond(&box, (const qmat_hull_columns *[]){&small}, 1), 1.0 / 16, 1e-12);
  qmat_hull_columns_free(&small);
  qmat_hull_columns_free(&box);
}

/* The union of two hulls has one volume, whichever is first. */
static void test_a_union_has_one_volume(void **state) {
  (void)state;
  for (uint64_t round = 0; round < 20; round++) {
    qmat_hull_columns hulls[2];
    for (uint64_t h = 0; h < 2; h++) {
      double points[3 * MOST];
      for (uint64_t i = 0; i < 3 * MOST; i++)
        points[i] = 0.3 * (qmat_hash_unit(qmat_hash3(round, h, i)) - 0.5) + 0.1 * (double)h;
      hulls[h] = columns_of(points, MOST);
    }
    double sums[2];
    for (int h = 0; h < 2; h++)
      sums[h] = qmat_hull_columns_beyond(&hulls[h], NULL, 0) +
                qmat_hull_columns_beyond(&hulls[1 - h], (const qmat_hull_columns *[]){&hulls[h]}, 1);
    assert_near(sums[0], sums[1], 1e-12);
    assert_true(sums[0] > 0.001);
    for (int h = 0; h < 2; h++) qmat_hull_columns_free(&hulls[h]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_boxes_by_hand),
      cmocka_unit_test(test_a_hull_between_lines_has_no_volume),
      cmocka_unit_test(test_a_union_has_one_volume),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
