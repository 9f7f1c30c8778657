/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "io/stored_medial.h"
#include "tests/io/medial_examples.h"

static void test_a_move_is_added_to_both_errors_rounded_up(void **state) {
  (void)state;
  const qmat_stated_errors errors = {
      .diagonal = 4, .epsilon = 0.01, .error_out = 0.007, .error_in = 0.009, .certified = QMAT_CERTIFICATE_YES};
  qmat_stated_errors after = qmat_errors_after_move(&errors, 0.002);
  assert_true(after.error_out > 0.0075 && after.error_out < 0.0075 + 1e-15);
  assert_true(after.error_in > 0.0095 && after.error_in < 0.0095 + 1e-15);
  assert_int_equal(after.certified, QMAT_CERTIFICATE_YES);
  after = qmat_errors_after_move(&errors, 0.004); /* 0.009 + 0.001 is rounded to more than 0.01 */
  assert_true(after.error_in > 0.01);
  assert_int_equal(after.certified, QMAT_CERTIFICATE_NO);
  after = qmat_errors_after_move(&errors, 0);
  assert_true(after.error_in == 0.009 && after.error_out == 0.007);
}

static void test_the_origin_is_zero_where_single_precision_suffices(void **state) {
  (void)state;
  const double near_zero[] = {0.5, 0, -1, 1, 1, 0, -1, 0.5}, far[] = {4e5, 0, 5e6, 1, 4e5 + 1, 0.25, 5e6, 0.5};
  double origin[3];
  qmat_medial *medial = sealed_medial_mesh(near_zero, 2, NULL, 0, NULL, 0);
  qmat_storage_origin(medial, NULL, 1e-5, origin);
  assert_true(origin[0] == 0 && origin[1] == 0 && origin[2] == 0);
  qmat_value_release(&medial->base);

  medial = sealed_medial_mesh(far, 2, NULL, 0, NULL, 0);
  qmat_storage_origin(medial, NULL, 1e-5, origin);
  for (int k = 0; k < 3; k++) {
    assert_true(fabs(origin[k] - far[k]) <= 4); /* the box is 2.5 wide: multiples of 4 */
    assert_true((double)(float)origin[k] == origin[k]);
  }
  qmat_storage_origin(medial, NULL, 10, origin); /* nobody needs that much precision */
  assert_true(origin[0] == 0 && origin[1] == 0 && origin[2] == 0);
  qmat_value_release(&medial->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_move_is_added_to_both_errors_rounded_up),
      cmocka_unit_test(test_the_origin_is_zero_where_single_precision_suffices),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
