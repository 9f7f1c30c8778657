/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/text.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/arena.h"
#include "core/hash.h"

static void test_numbers_are_read_in_full(void **state) {
  (void)state;
  const struct {
    const char *text;
    double number;
  } cases[] = {{"0", 0},
               {"-1", -1},
               {"+1.5", 1.5},
               {".5", 0.5},
               {"5.", 5},
               {"1e3", 1000},
               {"1E-3", 0.001},
               {"1%", 0.01},
               {"0.1%", 0.001},
               {"1e-1%", 0.001},
               {"-7.3%", -0.073},
               {"1e400%", 0},
               {"1e-400", 0},
               {"1e-999999%", 0},
               {"2.5e1%", 0.25},
               {"1e309%", 1e307},
               {"00012", 12},
               {"1e-99999999999999999999", 0},
               {"179769313486231570000000000000000000000%", 1797693134862315700000000000000000000.0}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    double number = -99;
    if (strcmp(cases[i].text, "1e400%") == 0) { /* beyond what a double holds, also after the percent */
      assert_false(qmat_parse_number(cases[i].text, &number));
      continue;
    }
    assert_true(qmat_parse_number(cases[i].text, &number));
    assert_true(number == cases[i].number);
  }
}

static void test_what_is_not_a_plain_finite_number_is_refused(void **state) {
  (void)state;
  const char *const texts[] = {"",     " ",      " 1",       "1 ",     "0x10", "0x1p3", "inf", "-inf",
                               "nan",  "NAN(1)", "infinity", "e5",     ".",    "-",     "+",   "--1",
                               "1e",   "1e+",    "1,5",      "1.2.3",  "%",    "1%%",   "1% ", "1e400",
                               "1e5x", "\t1",    "1\n",      "-1e400", "١",    "1_000", ".e1", "-.%"};
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    double number = -99;
    assert_false(qmat_parse_number(texts[i], &number));
    assert_true(number == -99);
  }
}

/* "p%" and p/100 as text are the same double for every p with up to six digits. */
static void test_a_percentage_is_rounded_once(void **state) {
  (void)state;
  for (int i = 0; i < 100000; i += 7) {
    char percent[32], plain[32];
    double from_percent, from_plain;
    snprintf(percent, sizeof percent, "%d.%03d%%", i / 1000, i % 1000);
    snprintf(plain, sizeof plain, "%de-5", i);
    assert_true(qmat_parse_number(percent, &from_percent));
    assert_true(qmat_parse_number(plain, &from_plain));
    assert_true(from_percent == from_plain);
  }
}

static void test_numbers_are_written_short_and_exact(void **state) {
  (void)state;
  const struct {
    double number;
    const char *text;
  } cases[] = {{0.01, "0.01"},
               {1, "1"},
               {-2.5, "-2.5"},
               {0.1 + 0.2, "0.30000000000000004"},
               {1e-5, "1e-05"},
               {DBL_MAX, "1.7976931348623157e+308"},
               {5e-324, "5e-324"},
               {1000, "1000"},
               {-123456789012340, "-123456789012340"},
               {1e15, "1e+15"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[32];
    qmat_format_number(cases[i].number, text, sizeof text);
    assert_string_equal(text, cases[i].text);
  }
  for (uint64_t i = 0; i < 5000; i++) {
    const uint64_t bits = qmat_hash3(9, i, 0);
    double number, again;
    memcpy(&number, &bits, sizeof number);
    if (!isfinite(number)) continue;
    char text[32];
    qmat_format_number(number, text, sizeof text);
    assert_true(qmat_parse_number(text, &again));
    assert_memory_equal(&again, &number, sizeof number);
  }
}

static void test_the_nearest_name_is_found_within_the_limit(void **state) {
  (void)state;
  const char *const names[] = {"medial.simplify", "medial.skin", "mesh.sample", "mesh.sdf", "x"};
  const struct {
    const char *text, *nearest;
  } cases[] = {{"medial.simplfy", "medial.simplify"}, /* a letter missing */
               {"medial.ksin", "medial.skin"},        /* two swapped: one step */
               {"mesh.sfd", "mesh.sdf"},
               {"mesh.sampel", "mesh.sample"},
               {"mesh.sdf", "mesh.sdf"},
               {"mash.sof", "mesh.sdf"}, /* two of 8 letters: 1 + 8 / 3 = 3 allow it */
               {"scene.write", NULL},
               {"y", NULL},
               {"", NULL}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const char *nearest = qmat_nearest_name(cases[i].text, names, 5);
    if (!cases[i].nearest) {
      assert_null(nearest);
    } else {
      assert_non_null(nearest);
      assert_string_equal(nearest, cases[i].nearest);
    }
  }
  assert_null(qmat_nearest_name("mesh.sdf", NULL, 0));
}

static void test_the_first_of_equally_near_names_wins(void **state) {
  (void)state;
  const char *const names[] = {"cat", "bat", "rat"};
  assert_string_equal(qmat_nearest_name("hat", names, 3), "cat");
}

static void test_names_of_any_length_are_compared_safely(void **state) {
  (void)state;
  char lengthy[5000], fits[64];
  memset(lengthy, 'a', sizeof lengthy);
  lengthy[sizeof lengthy - 1] = '\0';
  memset(fits, 'a', sizeof fits);
  fits[63] = '\0';
  const char *const names[] = {lengthy, fits};
  assert_null(qmat_nearest_name(lengthy, names, 2));
  assert_ptr_equal(qmat_nearest_name(fits, names, 2), fits);
  assert_ptr_equal(qmat_nearest_name(fits + 1, names, 2), fits);
}

static void test_counts_sizes_and_bounds_are_written_for_people(void **state) {
  (void)state;
  static const struct {
    uint64_t number;
    const char *count, *bytes;
  } numbers[] = {{0, "0", "0 bytes"},
                 {1, "1", "1 byte"},
                 {999, "999", "999 bytes"},
                 {1000, "1,000", "1 kB"},
                 {26021, "26,021", "26 kB"},
                 {999499, "999,499", "999 kB"},
                 {999500, "999,500", "1 MB"},
                 {1234567, "1,234,567", "1.2 MB"},
                 {123456789012, "123,456,789,012", "123 GB"}};
  static const struct {
    double fraction;
    const char *text;
  } bounds[] = {{0, "0 %"},       {-1, "0 %"},         {0.0098, "0.98 %"}, {0.00977, "0.98 %"}, {0.00981, "0.99 %"},
                {0.01, "1 %"},    {0.123, "13 %"},     {1, "100 %"},       {1.234, "124 %"},    {0.0000123, "0.0013 %"},
                {0.00999, "1 %"}, {1.4e-15, "0.001 %"}};
  char text[48];
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    qmat_format_count(numbers[i].number, text);
    assert_string_equal(text, numbers[i].count);
    qmat_format_bytes(numbers[i].number, text);
    assert_string_equal(text, numbers[i].bytes);
  }
  for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++) {
    qmat_format_bound(bounds[i].fraction, text);
    assert_string_equal(text, bounds[i].text);
  }
}

static void test_lengths_are_rounded_up_in_a_fitting_unit(void **state) {
  (void)state;
  static const struct {
    double meters;
    const char *text;
  } lengths[] = {{0, "0 mm"},       {2e-12, "0.001 mm"}, {1.2345e-6, "0.0013 mm"}, {0.0049, "4.9 mm"},
                 {0.00491, "5 mm"}, {0.0999, "10 cm"},   {0.0991, "10 cm"},        {0.098, "98 mm"},
                 {0.999, "1 m"},    {0.123, "13 cm"},    {0.98, "98 cm"},          {1, "1 m"},
                 {3.14, "3.2 m"},   {1234, "1234 m"}};
  char text[48];
  for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
    qmat_format_length(lengths[i].meters, (double)INFINITY, text);
    assert_string_equal(text, lengths[i].text);
  }
  /* Of a model of 37 nm nothing is as long as 0.001 mm. */
  qmat_format_length(1.6e-10, 3.7e-8, text);
  assert_string_equal(text, "1.6e-07 mm");
  qmat_format_length(1e-20, 3.7e-8, text);
  assert_string_equal(text, "3.7e-10 mm");
  qmat_format_length(1e-312, 1e-310, text);
  assert_true(atof(text) > 0);
}

static void test_lengths_are_read_with_their_unit(void **state) {
  (void)state;
  static const char *const bad[] = {"5", "mm", "", "5 mm", "5%mm", "5MM", "5km", "1e400m", "0x5mm", "5mmm", "nanm"};
  double meters = 7;
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_false(qmat_parse_length(bad[i], &meters));
  assert_true(meters == 7);
  assert_true(qmat_parse_length("5mm", &meters) && meters == 0.005);
  assert_true(qmat_parse_length("-2.5cm", &meters) && meters == -0.025);
  assert_true(qmat_parse_length("1e2m", &meters) && meters == 100);
  assert_true(qmat_parse_length("1in", &meters) && meters == 0.0254);
  assert_true(qmat_parse_length("1ft", &meters) && meters == 0.3048);
}

static void test_copied_texts_are_equal_and_apart(void **state) {
  (void)state;
  const char *text = "caf\xc3\xa9";
  char *copy = qmat_strdup(text);
  assert_non_null(copy);
  assert_ptr_not_equal(copy, text);
  assert_string_equal(copy, text);
  qmat_free(copy);
}

static void test_utf8_is_told_from_other_bytes(void **state) {
  (void)state;
  static const struct {
    const char *text;
    size_t length; /* of its first character; 0: not valid */
  } cases[] = {{"", 1},
               {"a", 1},
               {"\xc3\xa9", 2},
               {"\xe2\x82\xac", 3},
               {"\xf0\x9f\x98\x80", 4},
               {"\x80", 0},
               {"\xc3", 0},
               {"\xc0\xaf", 0},         /* overlong */
               {"\xe0\x80\x80", 0},     /* overlong */
               {"\xed\xa0\x80", 0},     /* a surrogate */
               {"\xf4\x90\x80\x80", 0}, /* above U+10FFFF */
               {"\xff", 0}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    assert_int_equal(qmat_utf8_length(cases[i].text), cases[i].length);
    assert_int_equal(qmat_is_utf8(cases[i].text), cases[i].length > 0);
  }
}

static void test_repaired_text_is_utf8_and_keeps_its_valid_end(void **state) {
  (void)state;
  char text[] = "a\xff\xc3\xa9", broken[] = "\xc3\xa9\xff", valid[] = "caf\xc3\xa9";
  qmat_repair_utf8(text);
  assert_string_equal(text, "a?\xc3\xa9");
  qmat_repair_utf8(broken);
  assert_string_equal(broken, "???");
  qmat_repair_utf8(valid);
  assert_string_equal(valid, "caf\xc3\xa9");
}

static void test_part_names_lead_below_their_folder(void **state) {
  (void)state;
  static const char *const good[] = {"a", "a/b.bin", "..a", "a..", "...", ".a"};
  static const char *const bad[] = {"", ".", "..", "/a", "a/", "a//b", "a/./b", "a/../b", "a\\b"};
  for (size_t i = 0; i < sizeof good / sizeof *good; i++) assert_true(qmat_is_part_name(good[i]));
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_false(qmat_is_part_name(bad[i]));
  char name[257];
  memset(name, 'a', 256);
  name[256] = '\0';
  assert_false(qmat_is_part_name(name));
  name[255] = '\0';
  assert_true(qmat_is_part_name(name));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_numbers_are_read_in_full),
      cmocka_unit_test(test_what_is_not_a_plain_finite_number_is_refused),
      cmocka_unit_test(test_a_percentage_is_rounded_once),
      cmocka_unit_test(test_numbers_are_written_short_and_exact),
      cmocka_unit_test(test_the_nearest_name_is_found_within_the_limit),
      cmocka_unit_test(test_the_first_of_equally_near_names_wins),
      cmocka_unit_test(test_names_of_any_length_are_compared_safely),
      cmocka_unit_test(test_counts_sizes_and_bounds_are_written_for_people),
      cmocka_unit_test(test_copied_texts_are_equal_and_apart),
      cmocka_unit_test(test_utf8_is_told_from_other_bytes),
      cmocka_unit_test(test_repaired_text_is_utf8_and_keeps_its_valid_end),
      cmocka_unit_test(test_lengths_are_rounded_up_in_a_fitting_unit),
      cmocka_unit_test(test_lengths_are_read_with_their_unit),
      cmocka_unit_test(test_part_names_lead_below_their_folder),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
