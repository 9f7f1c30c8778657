/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/digest.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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
  for (size_t i = 0; i < 3; i++) {
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
  for (size_t piece = 0; left > 0; piece++) {
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

static void test_bytes_and_a_file_of_them_have_one_digest(void **state) {
  (void)state;
  char path[] = "/tmp/qmat-digest-XXXXXX";
  const int file = mkstemp(path);
  assert_true(file >= 0);
  static char bytes[200003]; /* more than one piece */
  for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (char)(i * i % 251);
  assert_int_equal(write(file, bytes, sizeof bytes), sizeof bytes);
  close(file);
  qmat_digest of_bytes, of_file;
  assert_int_equal(qmat_digest_of(bytes, sizeof bytes, &of_bytes), QMAT_OK);
  assert_int_equal(qmat_digest_of_file(path, &of_file), QMAT_OK);
  assert_true(qmat_digest_equal(&of_bytes, &of_file));
  unlink(path);
  assert_int_equal(qmat_digest_of_file(path, &of_file), QMAT_ERROR_IO);
  assert_int_equal(qmat_digest_of_file("/tmp", &of_file), QMAT_ERROR_IO);
}

static void test_only_64_lower_case_digits_are_a_digest(void **state) {
  (void)state;
  qmat_digest digest, parsed;
  char hex[65];
  assert_int_equal(qmat_digest_of("abc", 3, &digest), QMAT_OK);
  qmat_digest_hex(&digest, hex);
  assert_true(qmat_digest_parse(hex, &parsed));
  assert_true(qmat_digest_equal(&digest, &parsed));
  parsed.bytes[31] ^= 1;
  assert_false(qmat_digest_equal(&digest, &parsed));
  hex[0] = 'B';
  assert_false(qmat_digest_parse(hex, &parsed));
  hex[0] = 'g';
  assert_false(qmat_digest_parse(hex, &parsed));
  assert_false(qmat_digest_parse(hex + 1, &parsed));
  assert_false(qmat_digest_parse("", &parsed));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_published_messages_give_their_digests),
      cmocka_unit_test(test_a_million_letters_in_uneven_pieces_give_the_published_digest),
      cmocka_unit_test(test_no_bytes_may_come_from_null),
      cmocka_unit_test(test_finishing_without_a_digest_only_frees),
      cmocka_unit_test(test_a_hasher_that_never_started_fails_with_zeros),
      cmocka_unit_test(test_bytes_and_a_file_of_them_have_one_digest),
      cmocka_unit_test(test_only_64_lower_case_digits_are_a_digest),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
