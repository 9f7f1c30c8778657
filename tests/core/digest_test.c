/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/digest.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void assert_digest(const qmat_digest *digest, const char *expected) {
  char hex[65];
  memset(hex, 'x', sizeof hex);
  qmat_digest_hex(digest, hex);
  assert_string_equal(hex, expected);
}

/* FIPS 180-2, appendix B, and the empty message. */
static void test_published_messages_give_their_digests(void **state) {
  (void)state;
  const char *const cases[][2] = {
      {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
      {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
      {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
       "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
  };
  for (size_t i = 0; i < 3; ++i) {
    qmat_hasher hasher;
    qmat_digest digest;
    assert_int_equal(qmat_hasher_init(&hasher), QMAT_OK);
    qmat_hasher_add(&hasher, cases[i][0], strlen(cases[i][0]));
    assert_int_equal(qmat_hasher_finish(&hasher, &digest), QMAT_OK);
    assert_digest(&digest, cases[i][1]);
  }
}

static void test_a_million_letters_in_uneven_pieces_give_the_published_digest(void **state) {
  (void)state;
  char letters[997];
  memset(letters, 'a', sizeof letters);
  qmat_hasher hasher;
  qmat_digest digest;
  assert_int_equal(qmat_hasher_init(&hasher), QMAT_OK);
  size_t left = 1000000;
  for (size_t piece = 0; left > 0; ++piece) {
    size_t size = piece % sizeof letters;
    if (size > left) size = left;
    qmat_hasher_add(&hasher, letters, size);
    left -= size;
  }
  assert_int_equal(qmat_hasher_finish(&hasher, &digest), QMAT_OK);
  assert_digest(&digest, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

static void test_no_bytes_may_come_from_null(void **state) {
  (void)state;
  qmat_hasher hasher;
  qmat_digest digest;
  assert_int_equal(qmat_hasher_init(&hasher), QMAT_OK);
  qmat_hasher_add(&hasher, NULL, 0);
  assert_int_equal(qmat_hasher_finish(&hasher, &digest), QMAT_OK);
  assert_digest(&digest, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

static void test_finishing_without_a_digest_only_frees(void **state) {
  (void)state;
  qmat_hasher hasher;
  assert_int_equal(qmat_hasher_init(&hasher), QMAT_OK);
  qmat_hasher_add(&hasher, "abc", 3);
  assert_int_equal(qmat_hasher_finish(&hasher, NULL), QMAT_OK);
  assert_null(hasher.state);
}

static void test_a_hasher_that_never_started_fails_with_zeros(void **state) {
  (void)state;
  qmat_hasher hasher = {0};
  qmat_digest digest;
  memset(&digest, 1, sizeof digest);
  qmat_hasher_add(&hasher, "abc", 3);
  assert_int_equal(qmat_hasher_finish(&hasher, &digest), QMAT_ERROR_DEPENDENCY);
  assert_digest(&digest, "0000000000000000000000000000000000000000000000000000000000000000");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_published_messages_give_their_digests),
      cmocka_unit_test(test_a_million_letters_in_uneven_pieces_give_the_published_digest),
      cmocka_unit_test(test_no_bytes_may_come_from_null),
      cmocka_unit_test(test_finishing_without_a_digest_only_frees),
      cmocka_unit_test(test_a_hasher_that_never_started_fails_with_zeros),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
