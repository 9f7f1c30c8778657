/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/disjoint_sets.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/random.h"

static void test_smallest_item_leads_whatever_the_order(void **state) {
  (void)state;
  qmat_context context = {0};
  uint32_t *leaders = qmat_sets_new(&context, 6);
  assert_non_null(leaders);
  for (uint32_t i = 0; i < 6; i++) assert_int_equal(qmat_set_leader(leaders, i), i);
  assert_true(qmat_sets_join(leaders, 5, 4));
  assert_true(qmat_sets_join(leaders, 2, 3));
  assert_true(qmat_sets_join(leaders, 4, 3));
  assert_false(qmat_sets_join(leaders, 2, 5));
  assert_false(qmat_sets_join(leaders, 1, 1));
  static const uint32_t expected[6] = {0, 1, 2, 2, 2, 2};
  for (uint32_t i = 0; i < 6; i++) assert_int_equal(qmat_set_leader(leaders, i), expected[i]);
  qmat_context_uninit(&context);
}

/* Against marks that are painted over. */
static void test_random_joins_follow_a_naive_partition(void **state) {
  (void)state;
  enum { ITEMS = 60 };
  random_numbers random = {.seed = 1};
  for (int round = 0; round < 50; round++) {
    qmat_context context = {0};
    uint32_t *leaders = qmat_sets_new(&context, ITEMS), painted[ITEMS];
    assert_non_null(leaders);
    for (uint32_t i = 0; i < ITEMS; i++) painted[i] = i;
    for (int k = 0; k < 80; k++) {
      const uint32_t a = (uint32_t)random_index(&random, ITEMS), b = (uint32_t)random_index(&random, ITEMS);
      const uint32_t low = painted[a] < painted[b] ? painted[a] : painted[b], from = painted[a], to = painted[b];
      assert_int_equal(qmat_sets_join(leaders, a, b), from != to);
      for (uint32_t i = 0; i < ITEMS; i++)
        if (painted[i] == from || painted[i] == to) painted[i] = low;
      const uint32_t asked = (uint32_t)random_index(&random, ITEMS);
      assert_int_equal(qmat_set_leader(leaders, asked), painted[asked]);
    }
    for (uint32_t i = 0; i < ITEMS; i++) assert_int_equal(qmat_set_leader(leaders, i), painted[i]);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_smallest_item_leads_whatever_the_order),
      cmocka_unit_test(test_random_joins_follow_a_naive_partition),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
