/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/json_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/arena.h"

void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
static size_t refused = SIZE_MAX, asked;

void *__wrap_aligned_alloc(size_t alignment, size_t size) {
  return asked++ == refused ? NULL : __real_aligned_alloc(alignment, size);
}

/* Long enough for several steps of growth. */
static json_t *example(void) {
  json_t *list = json_array(), *root = json_object();
  for (int i = 0; i < 200; i++)
    json_array_append_new(list, json_pack("{s:i, s:s, s:f}", "index", i, "name", "a \"quoted\" name", "half", i / 2.0));
  json_object_set_new(root, "list", list);
  return root;
}

static void test_it_is_the_text_that_jansson_makes(void **state) {
  (void)state;
  static const size_t flags[] = {JSON_COMPACT, JSON_INDENT(2) | JSON_SORT_KEYS};
  json_t *json = example();
  for (size_t i = 0; i < 2; i++) {
    size_t size;
    char *text = qmat_json_text(json, flags[i], &size), *expected = json_dumps(json, flags[i]);
    assert_non_null(text);
    assert_string_equal(text, expected);
    assert_int_equal(size, strlen(expected));
    qmat_free(text);
    free(expected);
  }
  json_decref(json);
}

static void test_a_shortage_of_memory_gives_nothing_and_never_a_part(void **state) {
  (void)state;
  json_t *json = example();
  char *whole = qmat_json_text(json, JSON_COMPACT, NULL);
  size_t shortages = 0;
  for (refused = 0;; refused++) {
    asked = 0;
    char *text = qmat_json_text(json, JSON_COMPACT, NULL);
    if (text) {
      assert_string_equal(text, whole);
      qmat_free(text);
      break;
    }
    shortages++;
  }
  assert_true(shortages > 3);
  refused = SIZE_MAX;
  qmat_free(whole);
  json_decref(json);
}

static void test_what_json_cannot_say_gives_nothing(void **state) {
  (void)state;
  assert_null(qmat_json_text(NULL, JSON_COMPACT, NULL));
  json_t *number = json_integer(7);
  assert_null(qmat_json_text(number, JSON_COMPACT, NULL)); /* a document is an object or an array */
  json_decref(number);
}

static void test_a_count_is_a_whole_number_and_no_object_takes_none(void **state) {
  (void)state;
  json_t *object = json_object();
  assert_int_equal(qmat_json_set_count(object, "spheres", (size_t)1 << 40), 0);
  assert_int_equal(json_integer_value(json_object_get(object, "spheres")), (json_int_t)1 << 40);
  assert_int_equal(qmat_json_set_count(NULL, "spheres", 1), -1); /* of an object for which memory was short */
  const qmat_json_count rows[] = {{"edges", 3}, {"cones", 0}};
  assert_int_equal(qmat_json_set_counts(object, rows, 2), 0);
  char *text = json_dumps(object, JSON_COMPACT);
  assert_string_equal(text, "{\"spheres\":1099511627776,\"edges\":3,\"cones\":0}");
  free(text);
  json_decref(object);
  assert_int_not_equal(qmat_json_set_counts(NULL, rows, 2), 0);
}

static void test_warnings_are_a_list_in_their_order(void **state) {
  (void)state;
  json_t *report = json_object();
  assert_int_equal(qmat_json_add_warning(report, "%zu of %d", (size_t)2, 3), 0);
  assert_int_equal(qmat_json_add_warning(report, "%s", "50 %"), 0);
  char *text = json_dumps(report, JSON_COMPACT);
  assert_string_equal(text, "{\"warnings\":[\"2 of 3\",\"50 %\"]}");
  free(text);
  json_decref(report);
  assert_int_equal(qmat_json_add_warning(NULL, "nothing"), -1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_it_is_the_text_that_jansson_makes),
      cmocka_unit_test(test_a_shortage_of_memory_gives_nothing_and_never_a_part),
      cmocka_unit_test(test_what_json_cannot_say_gives_nothing),
      cmocka_unit_test(test_a_count_is_a_whole_number_and_no_object_takes_none),
      cmocka_unit_test(test_warnings_are_a_list_in_their_order),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
