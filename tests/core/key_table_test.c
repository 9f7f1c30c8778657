/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/key_table.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static uint64_t nth_key(uint64_t i) {
  return qmat_hash3(7, i, 0) >> (i % 40);
}

static void test_keys_are_found_while_the_table_grows(void **state) {
  (void)state;
  qmat_key_table table;
  assert_int_equal(qmat_key_table_init(&table, 3), 0);
  for (uint32_t i = 0; i < 20000; i++) {
    const uint64_t key = nth_key(i);
    if (qmat_key_table_id(&table, key) != QMAT_NO_ID) continue; /* short keys repeat */
    const size_t count = table.count;
    qmat_key_slot *slot = qmat_key_table_add(&table, key);
    assert_non_null(slot);
    slot->id = i;
    assert_int_equal(table.count, count + 1);
    assert_true(2 * table.count <= table.mask + 1);
  }
  for (uint32_t i = 0; i < 20000; i++) {
    const uint32_t id = qmat_key_table_id(&table, nth_key(i));
    assert_true(id <= i && nth_key(id) == nth_key(i));
  }
  for (uint64_t i = 20000; i < 40000; i += 40) assert_int_equal(qmat_key_table_id(&table, nth_key(i)), QMAT_NO_ID);
  qmat_key_table_uninit(&table);
}

static void test_key_zero_and_numbers(void **state) {
  (void)state;
  qmat_key_table table;
  assert_int_equal(qmat_key_table_init(&table, 0), 0);
  assert_int_equal(qmat_key_table_id(&table, 0), QMAT_NO_ID);
  qmat_key_table_add(&table, 0)->number = 0.25;
  assert_true(qmat_key_table_find(&table, 0)->key == 0 && qmat_key_table_find(&table, 0)->number == 0.25);
  qmat_key_table_uninit(&table);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_keys_are_found_while_the_table_grows),
      cmocka_unit_test(test_key_zero_and_numbers),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
