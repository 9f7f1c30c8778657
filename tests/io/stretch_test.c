/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "io/stretch.h"

static void assert_stretch(const double *rows, double expected) {
  double m[16] = {0}, turned[16] = {0};
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) m[4 * i + j] = turned[4 * j + i] = rows[3 * i + j];
  }
  const double found = qmat_largest_stretch(m);
  if (!(fabs(found - expected) <= 1e-8 * expected)) fail_msg("%.17g is not %.17g", found, expected);
  assert_true(fabs(qmat_largest_stretch(turned) - expected) <= 1e-8 * expected);
}

static void test_the_largest_stretch_is_the_largest_singular_value(void **state) {
  (void)state;
  assert_stretch((const double[]){1, 0, 0, 0, 1, 0, 0, 0, 1}, 1);
  assert_stretch((const double[]){0, -7, 0, 7, 0, 0, 0, 0, 7}, 7);
  assert_stretch((const double[]){1, 0, 0, 0, -5, 0, 0, 0, 2}, 5);
  assert_stretch((const double[]){3, 0, 0, 0, 3, 0, 0, 0, 1e-6}, 3);
  assert_stretch((const double[]){1, 1, 0, 0, 1, 0, 0, 0, 1}, (1 + sqrt(5)) / 2); /* a shear */
  assert_stretch((const double[]){1, 1, 1, 1, 1, 1, 1, 1, 1}, 3);                 /* flat */
  assert_stretch((const double[]){0, 0, 0, 0, 0, 0, 0, 0, 0}, 0);
}

/* No direction is stretched by more, and some direction is by almost as much. */
static void test_no_direction_is_stretched_by_more(void **state) {
  (void)state;
  uint64_t random = 1;
  for (int round = 0; round < 50; round++) {
    double m[16] = {0}, largest = 0;
    for (int i = 0; i < 12; i++) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      if (i % 4 != 3) m[i] = (double)(random >> 40) / 0x1p23 - 1;
    }
    const double bound = qmat_largest_stretch(m);
    for (int a = 0; a < 200; a++) {
      for (int b = 0; b < 100; b++) {
        const double u = a * 0.01 * 3.14159265, v = b * 0.01 * 3.14159265;
        const double p[3] = {cos(u) * sin(v), sin(u) * sin(v), cos(v)};
        double image[3];
        for (int k = 0; k < 3; k++) image[k] = m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2];
        largest = fmax(largest, hypot(hypot(image[0], image[1]), image[2]));
      }
    }
    assert_true(largest <= bound * (1 + 1e-9) && largest >= 0.999 * bound);
  }
}

static void test_a_stretch_has_six_digits(void **state) {
  (void)state;
  const struct {
    double stretch, rounded;
  } cases[] = {
      {1, 1},
      {1.0000000000000002, 1},
      {0.99999975, 1},
      {0.0253999981790781, 0.0254}, /* an inch, by the matrices of six copies of a box */
      {0.0254000057488679, 0.0254},
      {0.3048, 0.3048},
      {0.00117809845673732, 0.0011781},
      {1.2345649, 1.23456},
      {1.2345651, 1.23457},
      {999999.6, 1000000},
      {123456789, 123457000},
      {1e22, 1e22},
      {0, 0},
      {1e-310, 1e-310},
      {1e200, 1e200},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    const double found = qmat_rounded_stretch(cases[i].stretch);
    if (found != cases[i].rounded) fail_msg("%.17g became %.17g", cases[i].stretch, found);
  }
  assert_true(qmat_rounded_stretch((double)INFINITY) == (double)INFINITY);
  assert_true(isnan(qmat_rounded_stretch((double)NAN)));
}

/* What is rounded is near and stays when it is rounded again, over the range of what is rounded. */
static void test_rounding_is_near_and_final(void **state) {
  (void)state;
  for (double stretch = 1.1e-100; stretch < 1e100; stretch *= 1.37) {
    const double found = qmat_rounded_stretch(stretch);
    assert_true(fabs(found - stretch) <= 5.001e-6 * stretch);
    assert_true(fabs(qmat_rounded_stretch(found) - found) <= 1e-15 * found);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_largest_stretch_is_the_largest_singular_value),
      cmocka_unit_test(test_no_direction_is_stretched_by_more),
      cmocka_unit_test(test_a_stretch_has_six_digits),
      cmocka_unit_test(test_rounding_is_near_and_final),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
