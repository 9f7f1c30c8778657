/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/placement.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/random.h"

static void check_quaternion(double axes[3][3], const double expected[4]) {
  double q[4], along = 0;
  qmat_placement_quaternion(axes, q);
  for (int k = 0; k < 4; k++) along += q[k] * expected[k];
  for (int k = 0; k < 4; k++) assert_true(fabs(q[k] - copysign(1, along) * expected[k]) <= 1e-12);
}

static void test_quaternions_by_hand(void **state) {
  (void)state;
  double none[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  check_quaternion(none, (const double[]){0, 0, 0, 1});
  for (int axis = 0; axis < 3; axis++) { /* half a turn: the trace is -1 */
    double half_turn[3][3] = {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, expected[4] = {0, 0, 0, 0};
    half_turn[axis][axis] = expected[axis] = 1;
    check_quaternion(half_turn, expected);
  }
  double quarter[3][3] = {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}; /* about z: x becomes y */
  check_quaternion(quarter, (const double[]){0, 0, sqrt(0.5), sqrt(0.5)});
  double cycle[3][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}; /* x to y to z to x */
  check_quaternion(cycle, (const double[]){0.5, 0.5, 0.5, 0.5});
}

/* The axes of a quaternion give it back. */
static void test_a_quaternion_is_that_of_its_axes(void **state) {
  (void)state;
  random_numbers random = {.seed = 5};
  for (int round = 0; round < 1000; round++) {
    double q[4], square = 0, axes[3][3];
    for (int k = 0; k < 4; k++) {
      q[k] = random_between(&random, -1, 1);
      square += q[k] * q[k];
    }
    if (square < 0.01) continue;
    for (int k = 0; k < 4; k++) q[k] /= sqrt(square);
    for (int i = 0; i < 3; i++) { /* q i q* */
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      axes[i][i] = 1 - 2 * (q[j] * q[j] + q[k] * q[k]);
      axes[i][j] = 2 * (q[i] * q[j] + q[3] * q[k]);
      axes[i][k] = 2 * (q[i] * q[k] - q[3] * q[j]);
    }
    check_quaternion(axes, q);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_quaternions_by_hand),
      cmocka_unit_test(test_a_quaternion_is_that_of_its_axes),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
