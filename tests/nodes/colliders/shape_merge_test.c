/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Budgets of shapes: pairs are joined, the cheapest first; of shapes that cannot be joined the largest stay, and one of
 * each joint. */
#include "nodes/colliders/shape_merge.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/cpu_time.h"
#include "tests/random.h"

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

/* Single spheres of the unit box; some touch others. */
static qmat_shape_set random_spheres(qmat_context *context, size_t count, double radius) {
  random_numbers random = {.seed = 5};
  qmat_shape_set set = {.sphere_count = count,
                        .shape_count = count,
                        .spheres = qmat_arena_alloc(&context->arena, count, 4 * sizeof *set.spheres),
                        .shapes = qmat_arena_alloc(&context->arena, count, 3 * sizeof *set.shapes)};
  assert_true(set.spheres && set.shapes);
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < 3; k++) {
      set.spheres[4 * i + k] = random_between(&random, -0.5, 0.5);
      set.shapes[3 * i + k] = (uint32_t)i;
    }
    set.spheres[4 * i + 3] = random_between(&random, 0.2, 1) * radius;
  }
  return set;
}

static int compare_spheres(const void *left, const void *right) {
  const double *a = left, *b = right;
  return (a[0] > b[0]) - (a[0] < b[0]);
}

/* One call that joins many pairs finds the same as calls that join one each, which know nothing of those before. */
static void test_the_cheapest_pair_is_joined_each_time(void **state) {
  (void)state;
  enum { COUNT = 60 };
  for (size_t most = 3; most < COUNT; most += 8) {
    qmat_context context = {0};
    qmat_shape_set at_once = random_spheres(&context, COUNT, 0.12), singly = random_spheres(&context, COUNT, 0.12);
    assert_int_equal(qmat_shape_set_merge(&context, &at_once, QMAT_SHAPES_SPHERES, 1, most), QMAT_OK);
    for (size_t left = COUNT; left-- > most;)
      assert_int_equal(qmat_shape_set_merge(&context, &singly, QMAT_SHAPES_SPHERES, 1, left), QMAT_OK);
    assert_int_equal(at_once.shape_count, singly.shape_count);
    assert_int_equal(at_once.sphere_count, singly.sphere_count);
    qsort(at_once.spheres, at_once.sphere_count, 4 * sizeof(double), compare_spheres);
    qsort(singly.spheres, singly.sphere_count, 4 * sizeof(double), compare_spheres);
    for (size_t i = 0; i < 4 * at_once.sphere_count; i++)
      assert_true(fabs(at_once.spheres[i] - singly.spheres[i]) < 1e-9);
    qmat_context_uninit(&context);
  }
}

static double seconds_for(size_t count) {
  qmat_context context = {.threads = 1};
  qmat_shape_set set = random_spheres(&context, count, 0.5 / cbrt((double)count));
  const double start = cpu_time();
  assert_int_equal(qmat_shape_set_merge(&context, &set, QMAT_SHAPES_SPHERES, 1, count / 2), QMAT_OK);
  const double seconds = cpu_time() - start;
  qmat_context_uninit(&context);
  return seconds;
}

/* Looks at all pairs for each pair that is joined would take 64 times as long for four times as many shapes. */
static void test_a_joined_pair_leaves_the_other_pairs_known(void **state) {
  (void)state;
  const double few = seconds_for(300), many = seconds_for(1200);
  if (many > 32 * few + 0.1) fail_msg("%.3f s, after %.3f s", many, few);
}

/* Joint 2 has no shape left, and gets those given back. */
static void test_the_shapes_of_a_lost_joint_come_back(void **state) {
  (void)state;
  qmat_context context = {0};
  double spheres[] = {0, 0, 0, 0.1, 1, 0, 0, 0.1, 2, 0, 0, 0.1, 3, 0, 0, 0.1}, left[] = {5, 0, 0, 0.2};
  uint32_t shapes[] = {2, 3, 3, 0, 0, 0, 1, 1, 1}, joints[] = {9, 9, 2, 2}, id[] = {0, 0, 0}, joint[] = {9};
  const qmat_shape_set given = {4, 3, spheres, shapes, joints};
  qmat_shape_set set = {1, 1, left, id, joint}, lost;
  assert_int_equal(qmat_shape_set_find_lost(&context, &given, &set, &lost), QMAT_OK);
  assert_int_equal(lost.shape_count, 1);
  assert_memory_equal(lost.shapes, shapes, 3 * sizeof *shapes);
  assert_int_equal(qmat_shape_set_append(&context, &set, &lost), QMAT_OK);
  assert_int_equal(set.shape_count, 2);
  assert_int_equal(set.sphere_count, 3);
  assert_int_equal(qmat_shape_width(set.shapes), 2); /* wide ones come first */
  for (size_t k = 0; k < 2; k++) {
    assert_int_equal(set.joints[set.shapes[k]], 2);
    assert_true(set.spheres[4 * (size_t)set.shapes[k]] == 2 + (double)k);
  }
  assert_int_equal(set.joints[set.shapes[3]], 9);
  assert_true(set.spheres[4 * (size_t)set.shapes[3]] == 5);
  assert_int_equal(qmat_shape_set_find_lost(&context, &given, &set, &lost), QMAT_OK);
  assert_int_equal(lost.shape_count, 0);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_largest_stay_in_their_order),
      cmocka_unit_test(test_of_equal_shapes_the_first_stay_beside_larger_ones),
      cmocka_unit_test(test_each_joint_keeps_its_largest_shape),
      cmocka_unit_test(test_the_shapes_of_a_lost_joint_come_back),
      cmocka_unit_test(test_the_cheapest_pair_is_joined_each_time),
      cmocka_unit_test(test_a_joined_pair_leaves_the_other_pairs_known),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
