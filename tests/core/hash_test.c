/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/hash.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* The first output of SplitMix64 with seed 0, as published with its reference code. */
static void test_the_mix_is_that_of_splitmix64(void **state) {
  (void)state;
  assert_true(qmat_hash_mix(UINT64_C(0x9e3779b97f4a7c15)) == UINT64_C(0xe220a8397b1dcdaf));
}

/* Cached results and golden digests rest on these numbers; they were computed apart, in Python. */
static void test_the_numbers_never_change(void **state) {
  (void)state;
  assert_true(qmat_hash3(0, 0, 0) == UINT64_C(0x238275bc38fcbe91));
  assert_true(qmat_hash3(1, 2, 3) == UINT64_C(0xd0734750fde362b3));
  assert_true(qmat_hash3(42, 0, 1) == UINT64_C(0xb682ee25ce24109e));
  assert_true(qmat_hash3(UINT64_MAX, UINT64_MAX, UINT64_MAX) == UINT64_C(0x595b17f487c0e71b));
  assert_true(qmat_hash_unit(qmat_hash3(0, 0, 0)) == 0.13870941014555427);
}

static void test_the_order_of_the_counters_matters(void **state) {
  (void)state;
  assert_true(qmat_hash3(7, 1, 2) != qmat_hash3(7, 2, 1));
  assert_true(qmat_hash3(1, 7, 2) != qmat_hash3(7, 1, 2));
}

static void test_unit_numbers_lie_in_zero_to_below_one(void **state) {
  (void)state;
  assert_true(qmat_hash_unit(0) == 0);
  assert_true(qmat_hash_unit(UINT64_MAX) < 1);
  assert_true(qmat_hash_unit(UINT64_MAX) == 1 - 0x1p-53);
}

/* Counters that count up, as callers use them, fill [0, 1) evenly and without a trend between neighbours. */
static void test_counting_up_gives_uniform_independent_numbers(void **state) {
  (void)state;
  enum { COUNT = 100000, BINS = 20 };
  size_t bins[BINS] = {0};
  double sum = 0, products = 0, last = 0.5;
  for (uint64_t i = 0; i < COUNT; i++) {
    const double number = qmat_hash_unit(qmat_hash3(1, i / 10, i % 10));
    ++bins[(size_t)(number * BINS)];
    sum += number;
    products += (number - 0.5) * (last - 0.5);
    last = number;
  }
  assert_true(fabs(sum / COUNT - 0.5) < 5 * sqrt(1.0 / 12 / COUNT)); /* five standard deviations */
  assert_true(fabs(products / COUNT) < 5 * (1.0 / 12) / sqrt(COUNT));
  double chi_squared = 0;
  for (size_t i = 0; i < BINS; i++) {
    const double expected = (double)COUNT / BINS, excess = (double)bins[i] - expected;
    chi_squared += excess * excess / expected;
  }
  assert_true(chi_squared < 60); /* 19 degrees of freedom: beyond 60 once in 10^5 */
}

/* A change of one input bit changes about half of the output bits. */
static void test_one_bit_of_a_counter_moves_half_of_the_bits(void **state) {
  (void)state;
  int changed = 0;
  for (int bit = 0; bit < 64; bit++) {
    changed += __builtin_popcountll(qmat_hash3(3, 5, 9) ^ qmat_hash3(3, 5 ^ (UINT64_C(1) << bit), 9));
    changed += __builtin_popcountll(qmat_hash3(3, 5, 9) ^ qmat_hash3(3, 5, 9 ^ (UINT64_C(1) << bit)));
  }
  assert_in_range(changed / 128, 28, 36);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_mix_is_that_of_splitmix64),
      cmocka_unit_test(test_the_numbers_never_change),
      cmocka_unit_test(test_the_order_of_the_counters_matters),
      cmocka_unit_test(test_unit_numbers_lie_in_zero_to_below_one),
      cmocka_unit_test(test_counting_up_gives_uniform_independent_numbers),
      cmocka_unit_test(test_one_bit_of_a_counter_moves_half_of_the_bits),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
