/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Shapes inside others are left out: as by looks at all pairs, and in much less time. */
#include "nodes/colliders/shape_set.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/cpu_time.h"
#include "tests/random.h"
#include "tests/shortage.h"

/* Single spheres in the unit box. Some are equal to others, or within them. */
static qmat_shape_set random_spheres(qmat_context *context, size_t count, double radius) {
  random_numbers random = {.seed = 9};
  qmat_shape_set set = {.sphere_count = count,
                        .shape_count = count,
                        .spheres = qmat_arena_alloc(&context->arena, count, 4 * sizeof *set.spheres),
                        .shapes = qmat_arena_alloc(&context->arena, count, 3 * sizeof *set.shapes)};
  assert_true(set.spheres && set.shapes);
  for (size_t i = 0; i < count; i++) {
    double *s = &set.spheres[4 * i];
    const double *other = i % 3 && i > 0 ? &set.spheres[4 * random_index(&random, i)] : NULL;
    for (size_t k = 0; k < 3; k++) {
      s[k] = other ? other[k] + (i % 3 == 1 ? random_between(&random, -0.4, 0.4) * other[3] : 0)
                   : random_between(&random, -0.5, 0.5);
      set.shapes[3 * i + k] = (uint32_t)i;
    }
    s[3] = other ? (i % 3 == 1 ? random_between(&random, 0.2, 0.6) * other[3] : other[3])
                 : random_between(&random, 0.1, 1) * radius;
  }
  return set;
}

static void test_what_stays_is_in_no_other_shape(void **state) {
  (void)state;
  enum { COUNT = 300 };
  qmat_context context = {0};
  qmat_shape_set set = random_spheres(&context, COUNT, 0.15);
  const qmat_shape_set given = set;
  bool dropped[COUNT] = {false};
  size_t kept = 0;
  for (size_t i = COUNT; i-- > 0;)
    for (size_t j = 0; j < COUNT && !dropped[i]; j++) {
      const double *inner = &given.spheres[4 * i], *outer = &given.spheres[4 * j];
      double square = 0;
      for (int k = 0; k < 3; k++) square += (inner[k] - outer[k]) * (inner[k] - outer[k]);
      dropped[i] = j != i && !dropped[j] && sqrt(square) - outer[3] + inner[3] <= 1e-12;
    }
  assert_int_equal(qmat_shape_set_reduce(&context, &set), QMAT_OK);
  for (size_t i = 0; i < COUNT; i++) {
    if (dropped[i]) continue;
    assert_true(kept < set.shape_count);
    assert_memory_equal(&set.spheres[4 * (size_t)set.shapes[3 * kept++]], &given.spheres[4 * i], 4 * sizeof(double));
  }
  assert_int_equal(kept, set.shape_count);
  assert_in_range(kept, COUNT / 10, COUNT * 2 / 3);
  qmat_context_uninit(&context);
}

static double seconds_for(size_t count) {
  qmat_context context = {.threads = 1};
  qmat_shape_set set = random_spheres(&context, count, 0.2 / cbrt((double)count));
  const double start = cpu_time();
  assert_int_equal(qmat_shape_set_reduce(&context, &set), QMAT_OK);
  const double seconds = cpu_time() - start;
  qmat_context_uninit(&context);
  return seconds;
}

/* Looks at all pairs of eight times as many shapes would take 64 times as long. */
static void test_shapes_far_apart_are_not_compared(void **state) {
  (void)state;
  const double few = seconds_for(2000), many = seconds_for(16000);
  if (many > 24 * few + 0.1) fail_msg("%.3f s, after %.3f s", many, few);
}

/* How often memory is asked for to reduce concentric spheres, the smallest first, or equal ones that are apart. */
static size_t allocations_for(size_t count, bool are_nested) {
  qmat_context context = {.threads = 1};
  qmat_shape_set set = random_spheres(&context, count, 0.1);
  for (size_t i = 0; i < count; i++) {
    const double at = (double)i / (double)count;
    const double sphere[] = {are_nested ? 0 : at - 0.5, 0, 0, are_nested ? 0.1 + 0.1 * at : 0.1 / (double)count};
    memcpy(&set.spheres[4 * i], sphere, sizeof sphere);
  }
  shortage(SIZE_MAX, 0);
  assert_int_equal(qmat_shape_set_reduce(&context, &set), QMAT_OK);
  const size_t allocations = atomic_load(&asked);
  assert_int_equal(set.shape_count, are_nested ? 1 : count);
  qmat_context_uninit(&context);
  return allocations;
}

static void test_nested_shapes_take_no_more_memory_than_others(void **state) {
  (void)state;
  assert_int_equal(allocations_for(2000, true), allocations_for(2000, false));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_what_stays_is_in_no_other_shape),
      cmocka_unit_test(test_shapes_far_apart_are_not_compared),
      cmocka_unit_test(test_nested_shapes_take_no_more_memory_than_others),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
