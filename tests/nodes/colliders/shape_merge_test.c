/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A budget of shapes that cannot be joined: the largest stay, and one of each joint. */
#include "nodes/colliders/shape_merge.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { MOST = 8 };

/* Keeps `most` of spheres that are apart, whose radii and joints (NULL: none) are given. Those that must stay are
 * `expected`, in their order. */
static void must_keep(const double *radii, const uint32_t *joints, size_t count, size_t most, const uint32_t *expected,
                      size_t expected_count) {
  qmat_context context = {0};
  double spheres[4 * MOST] = {0};
  uint32_t shapes[3 * MOST], of_spheres[MOST];
  for (size_t i = 0; i < count; i++) {
    spheres[4 * i] = 0.1 * (double)i;
    spheres[4 * i + 3] = radii[i];
    of_spheres[i] = joints ? joints[i] : 0;
    for (size_t k = 0; k < 3; k++) shapes[3 * i + k] = (uint32_t)i;
  }
  qmat_shape_set set = {.sphere_count = count,
                        .shape_count = count,
                        .spheres = spheres,
                        .shapes = shapes,
                        .joints = joints ? of_spheres : NULL};
  assert_int_equal(qmat_shape_set_keep_largest(&context, &set, most), QMAT_OK);
  assert_int_equal(set.shape_count, expected_count);
  assert_int_equal(set.sphere_count, expected_count);
  for (size_t i = 0; i < expected_count; i++) {
    const uint32_t id = set.shapes[3 * i];
    assert_true(set.spheres[4 * (size_t)id] == 0.1 * expected[i]);
    assert_true(set.spheres[4 * (size_t)id + 3] == radii[expected[i]]);
    if (joints) assert_int_equal(set.joints[id], joints[expected[i]]);
  }
  qmat_context_uninit(&context);
}

static void test_the_largest_stay_in_their_order(void **state) {
  (void)state;
  static const double radii[] = {0.02, 0.04, 0.01, 0.03};
  must_keep(radii, NULL, 4, 2, (const uint32_t[]){1, 3}, 2);
  must_keep(radii, NULL, 4, 3, (const uint32_t[]){0, 1, 3}, 3);
  must_keep(radii, NULL, 4, 4, (const uint32_t[]){0, 1, 2, 3}, 4);
}

static void test_of_equal_shapes_the_first_stay_beside_larger_ones(void **state) {
  (void)state;
  static const double radii[] = {0.01, 0.01, 0.05};
  must_keep(radii, NULL, 3, 2, (const uint32_t[]){0, 2}, 2);
  must_keep(radii, NULL, 3, 1, (const uint32_t[]){2}, 1);
}

static void test_each_joint_keeps_its_largest_shape(void **state) {
  (void)state;
  static const double radii[] = {0.04, 0.01, 0.02, 0.045, 0.03};
  static const uint32_t joints[] = {7, 2, 2, 7, 7};
  must_keep(radii, joints, 5, 1, (const uint32_t[]){2, 3}, 2);
  must_keep(radii, joints, 5, 2, (const uint32_t[]){2, 3}, 2);
  must_keep(radii, joints, 5, 3, (const uint32_t[]){0, 2, 3}, 3);
  must_keep(radii, joints, 5, 4, (const uint32_t[]){0, 2, 3, 4}, 4);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_largest_stay_in_their_order),
      cmocka_unit_test(test_of_equal_shapes_the_first_stay_beside_larger_ones),
      cmocka_unit_test(test_each_joint_keeps_its_largest_shape),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
