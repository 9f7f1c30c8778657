/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/scanner.h"

#include "tests/io/files.h"
#include "tests/locale.h"
#include "tests/random.h"

static void assert_scans(const char *text, double expected, size_t length) {
  double number = 12345;
  const char *after = qmat_scan_double(text, text + strlen(text), &number);
  if (!after) fail_msg("'%s' is no number", text);
  if (memcmp(&number, &expected, sizeof number) != 0) fail_msg("'%s' is %.17g, not %.17g", text, number, expected);
  if ((size_t)(after - text) != length) fail_msg("'%s' ends after %zu, not %zu", text, (size_t)(after - text), length);
}

static void test_numbers_are_read_exactly(void **state) {
  (void)state;
  static const char *const texts[] = {"0",
                                      "-0",
                                      "+1",
                                      "1.5",
                                      "-.5",
                                      "5.",
                                      "1e22",
                                      "1e23",
                                      "1e-22",
                                      "1e-23",
                                      "9007199254740992",
                                      "9007199254740993",
                                      "9007199254740992e1",
                                      "123456789012345678901234567890",
                                      "18446744073709551617", /* 2^64 + 1 */
                                      "1.8446744073709551617",
                                      "0.1",
                                      "0.30000000000000004",
                                      "2.2250738585072011e-308",
                                      "4.9e-324",
                                      "2.4703282292062327208e-324",
                                      "1.7976931348623157e308",
                                      "1e400",
                                      "-1e-400",
                                      "1e99999999999999999999",
                                      "1e-99999999999999999999",
                                      "0.00000000000000000000000000000000000000000000000001",
                                      "100000000000000000000000000000000000000000000000000",
                                      "1.00000000000000011102230246251565404236316680908203125",
                                      "1.00000000000000011102230246251565404236316680908203124",
                                      "0e0",
                                      "3E+05"};
  for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
    assert_scans(texts[i], strtod(texts[i], NULL), strlen(texts[i]));
  char zeros[1100]; /* 0.00...01e1000, with more zeros than are counted */
  snprintf(zeros, sizeof zeros, "0.%01010d1e1000", 0);
  assert_scans(zeros, strtod(zeros, NULL), strlen(zeros));
  assert_scans("INF", INFINITY, 3);
  assert_scans("-infinity", -INFINITY, 9);
  assert_scans("1e", 1, 1);
  assert_scans("1e+x", 1, 1);
  assert_scans("1.2.3", 1.2, 3);
  assert_scans("0x10", 0, 1); /* no hexadecimal */
  double number;
  for (size_t i = 0; i < 6; i++) {
    const char *bad = ((const char *[]){"", "-", ".", "e5", "+-1", "x"})[i];
    assert_null(qmat_scan_double(bad, bad + strlen(bad), &number));
  }
  static const char not_a_number[] = "nan";
  assert_ptr_equal(qmat_scan_double(not_a_number, not_a_number + 3, &number), not_a_number + 3);
  assert_true(isnan(number));
}

static void test_any_double_written_in_any_length_reads_as_strtod_reads_it(void **state) {
  (void)state;
  for (uint64_t i = 0; i < 30000; i++) {
    double number =
        i % 2 ? random_double(i) : (qmat_hash_unit(qmat_hash3(9, i, 0)) - 0.5) * pow(10, (double)(i % 40) - 20);
    char text[512];
    snprintf(text, sizeof text,
             i % 3 == 0   ? "%.*g"
             : i % 3 == 1 ? "%.*e"
                          : "%.*f",
             (int)(i % 21), i % 3 == 2 ? fmod(number, 1e10) : number);
    assert_scans(text, strtod(text, NULL), strlen(text));
  }
}

static void test_the_locale_changes_no_number(void **state) {
  (void)state;
  locale_with_comma();
  assert_scans("0.123456789012345678", 0.123456789012345678, 20);
  assert_scans("0,5", 0, 1);
  setlocale(LC_ALL, "C");
}

static void test_a_very_long_number_is_read(void **state) {
  (void)state;
  char *text = malloc(100002);
  memset(text, '7', 100001);
  text[1] = '.';
  text[100001] = '\0';
  assert_scans(text, 7.0 + 7.0 / 9, 100001);
  free(text);
}

static qmat_scanner scan(qmat_context *context, const char *text) {
  qmat_scanner scanner;
  qmat_scanner_init(&scanner, context, "file", text, strlen(text), '#');
  return scanner;
}

static void test_lines_and_columns_are_counted_for_every_kind_of_line_end(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context,
                              "\xEF\xBB\xBF"
                              "a # b\n\r\n c\r\rd#e\n");
  size_t length;
  const char *token = qmat_scan_token(&scanner, &length);
  assert_memory_equal(token, "a", length);
  assert_int_equal(scanner.line, 1);
  token = qmat_scan_token(&scanner, &length);
  assert_memory_equal(token, "c", length);
  assert_int_equal(scanner.line, 3);
  assert_int_equal(token - scanner.line_start + 1, 2);
  assert_false(qmat_scan_find_on_line(&scanner));
  token = qmat_scan_token(&scanner, &length);
  assert_int_equal(length, 1);
  assert_memory_equal(token, "d", 1);
  assert_int_equal(scanner.line, 5);
  token = qmat_scan_token(&scanner, &length);
  assert_int_equal(length, 0);
  assert_non_null(token);
}

static void test_a_backslash_joins_lines_only_where_asked(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context, "1 2\\\r\n3\n4");
  scanner.joins_lines = true;
  int64_t number = 0;
  for (int64_t i = 1; i <= 3; i++) {
    assert_true(qmat_scan_find_on_line(&scanner));
    assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 9, &number), QMAT_OK);
    assert_int_equal(number, i);
  }
  assert_false(qmat_scan_find_on_line(&scanner));
  assert_int_equal(scanner.line, 2);
  scanner = scan(&context, "2\\\n3");
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 9, &number), QMAT_ERROR_FORMAT);
}

static void assert_integer_refused(const char *text, const char *expected) {
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context, text);
  int64_t number = 77;
  char line[512];
  assert_int_equal(qmat_scan_integer(&scanner, "the count", 0, 10, &number), QMAT_ERROR_FORMAT);
  assert_int_equal(number, 77);
  qmat_error_format(&context.error, line, sizeof line);
  assert_string_equal(line, expected);
}

static void test_whole_numbers_are_checked_and_the_place_is_named(void **state) {
  (void)state;
  assert_integer_refused("", "file:1:1: expected the count, found the end of the file");
  assert_integer_refused("\n\n  x", "file:3:3: the count is 'x', not a whole number");
  assert_integer_refused("11", "file:1:1: the count is '11', outside 0 to 10");
  assert_integer_refused("-1", "file:1:1: the count is '-1', outside 0 to 10");
  assert_integer_refused("1.5", "file:1:1: the count is '1.5', not a whole number");
  assert_integer_refused("99999999999999999999999",
                         "file:1:1: the count is '99999999999999999999999', not a whole number");
  assert_integer_refused("3x", "file:1:1: the count is '3x', not a whole number");
  assert_integer_refused("nan", "file:1:1: the count is 'nan', not a whole number");
  assert_integer_refused("\001\377abcdefghijklmnopqrstuvwxyz0123456789",
                         "file:1:1: the count is '"
                         "??abcdefghijklmnopqrstuvw...', not a whole number");
  qmat_context context = {0};
  qmat_scanner scanner = scan(&context, "3.0 1e1 +7");
  int64_t number;
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 10, &number), QMAT_OK);
  assert_int_equal(number, 3);
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 10, &number), QMAT_OK);
  assert_int_equal(number, 10);
  assert_int_equal(qmat_scan_integer(&scanner, "it", 0, 10, &number), QMAT_OK);
  assert_int_equal(number, 7);
}

static void test_a_count_is_bounded_by_the_rest_of_the_file(void **state) {
  (void)state;
  qmat_context context = {0};
  size_t count = 77;
  char line[512];
  qmat_scanner scanner =
      scan(&context, "3 ab\nab\nab"); /* three lines of three bytes and a blank, without the last end */
  assert_int_equal(qmat_scan_count(&scanner, "the count", 3, &count), QMAT_OK);
  assert_int_equal(count, 3);
  scanner = scan(&context, "4 ab\nab\nab");
  assert_int_equal(qmat_scan_count(&scanner, "the count", 3, &count), QMAT_ERROR_FORMAT);
  qmat_error_format(&context.error, line, sizeof line);
  assert_string_equal(line, "file:1:2: the count is 4, more than the file can hold");
  scanner = scan(&context, "-1");
  assert_int_equal(qmat_scan_count(&scanner, "the count", 3, &count), QMAT_ERROR_FORMAT);
  assert_int_equal(count, 3);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_numbers_are_read_exactly),
      cmocka_unit_test(test_any_double_written_in_any_length_reads_as_strtod_reads_it),
      cmocka_unit_test(test_the_locale_changes_no_number),
      cmocka_unit_test(test_a_very_long_number_is_read),
      cmocka_unit_test(test_lines_and_columns_are_counted_for_every_kind_of_line_end),
      cmocka_unit_test(test_a_backslash_joins_lines_only_where_asked),
      cmocka_unit_test(test_whole_numbers_are_checked_and_the_place_is_named),
      cmocka_unit_test(test_a_count_is_bounded_by_the_rest_of_the_file),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
