/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/context.h"

#include <limits.h>
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static void assert_format(const qmat_context *context, const char *expected) {
  char text[2048];
  qmat_error_format(&context->error, text, sizeof text);
  assert_string_equal(text, expected);
}

static void test_every_status_has_a_name_of_its_own_and_an_exit_code(void **state) {
  (void)state;
  for (int i = QMAT_OK; i <= QMAT_CANCELLED; i++) {
    assert_string_not_equal(qmat_status_name((qmat_status)i), "unknown");
    for (int k = QMAT_OK; k < i; k++) {
      assert_string_not_equal(qmat_status_name((qmat_status)i), qmat_status_name((qmat_status)k));
    }
    const int expected = i == QMAT_OK ? 0 : i == QMAT_ERROR_USAGE ? 2 : i == QMAT_CANCELLED ? 3 : 1;
    assert_int_equal(qmat_status_exit_code((qmat_status)i), expected);
  }
  assert_string_equal(qmat_status_name((qmat_status)99), "unknown");
  assert_int_equal(qmat_status_exit_code((qmat_status)99), 1);
}

static void test_threads_are_those_asked_for_or_the_processors(void **state) {
  (void)state;
  qmat_context context = {0};
  assert_int_equal(qmat_threads(&context), omp_get_num_procs());
  context.threads = 7;
  assert_int_equal(qmat_threads(&context), 7);
  context.threads = -3;
  assert_int_equal(qmat_threads(&context), omp_get_num_procs());
  qmat_context_uninit(&context);
  qmat_context_uninit(NULL);
}

static void test_an_error_names_where_and_what(void **state) {
  (void)state;
  qmat_context context = {.node_id = "simple", .node_type = "medial.simplify"};
  assert_int_equal(qmat_fail(&context, QMAT_ERROR_GEOMETRY, "the %s is %d", "radius", -1), QMAT_ERROR_GEOMETRY);
  assert_format(&context, "node 'simple' (medial.simplify): the radius is -1");
  assert_int_equal(qmat_fail_field(&context, "spheres"), QMAT_ERROR_GEOMETRY);
  assert_int_equal(qmat_fail_element(&context, "sphere", 7), QMAT_ERROR_GEOMETRY);
  assert_int_equal(qmat_fail_at(&context, "in.yaml", 3, 14), QMAT_ERROR_GEOMETRY);
  assert_int_equal(qmat_fail_hint(&context, "try %s", "repair"), QMAT_ERROR_GEOMETRY);
  assert_format(&context,
                "in.yaml:3:14: node 'simple' (medial.simplify): spheres: sphere 7: the radius is -1 (try repair)");
}

static void test_parts_that_do_not_apply_are_left_out(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_fail(&context, QMAT_ERROR_IO, "cannot open");
  assert_format(&context, "cannot open");
  qmat_fail_at(&context, "a.obj", 0, 0);
  assert_format(&context, "a.obj: cannot open");
  qmat_fail_at(&context, "a.obj", 12, 0);
  assert_format(&context, "a.obj:12: cannot open");
  qmat_fail_element(&context, "facet", 0);
  assert_format(&context, "a.obj:12: facet 0: cannot open");
  context.node_type = "scene.read";
  qmat_fail(&context, QMAT_ERROR_IO, "cannot open");
  assert_format(&context, "scene.read: cannot open");
  const qmat_error zeroed = {.status = QMAT_ERROR_MEMORY};
  char text[64];
  qmat_error_format(&zeroed, text, sizeof text);
  assert_string_equal(text, "memory");
}

static void test_a_message_that_starts_with_the_field_does_not_repeat_it(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_fail(&context, QMAT_ERROR_USAGE, "epsilon must be positive");
  qmat_fail_field(&context, "epsilon");
  assert_format(&context, "epsilon must be positive");
  qmat_fail_field(&context, "eps");
  assert_format(&context, "eps: epsilon must be positive");
}

static void test_the_newest_error_clears_the_one_before(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_fail(&context, QMAT_ERROR_USAGE, "first");
  qmat_fail_field(&context, "field");
  qmat_fail_element(&context, "vertex", 3);
  qmat_fail_at(&context, "file", 1, 2);
  qmat_fail_hint(&context, "hint");
  assert_int_equal(qmat_fail_memory(&context, "samples"), QMAT_ERROR_MEMORY);
  assert_int_equal(context.error.element, -1);
  assert_format(&context, "not enough memory for samples");
}

static void test_an_error_may_quote_the_one_before(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_fail(&context, QMAT_ERROR_IO, "no such file");
  qmat_fail(&context, QMAT_ERROR_USAGE, "cannot read the graph: %s", context.error.message);
  assert_format(&context, "cannot read the graph: no such file");
  qmat_fail_hint(&context, "%s", context.error.message);
  assert_string_equal(context.error.hint, "cannot read the graph: no such file");
}

static void test_control_characters_leave_one_line(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_fail(&context, QMAT_ERROR_DEPENDENCY,
            "CGAL:\nline\t2 \x1b[31mred\x7f \xc2\x9b"
            "1m \xc2\xa0 \xc3\xa4");
  assert_format(&context, "CGAL: line 2  [31mred    1m \xc2\xa0 \xc3\xa4");
}

static void test_long_texts_are_cut_between_characters(void **state) {
  (void)state;
  char name[4001];
  for (size_t i = 0; i < sizeof name - 1; i += 2) memcpy(name + i, "\xc3\xa4", 2);
  name[sizeof name - 1] = '\0';
  qmat_context context = {.node_id = name, .node_type = name};
  qmat_fail(&context, QMAT_ERROR_IO, "%s", name);
  qmat_fail_field(&context, name);
  qmat_fail_element(&context, name, INT64_MAX);
  qmat_fail_at(&context, name, INT_MAX, INT_MAX);
  qmat_fail_hint(&context, "%s", name);
  assert_int_equal(strlen(context.error.message), 510); /* 511 would split the last character */
  assert_int_equal(strlen(context.error.field), 62);
  assert_int_equal(strlen(context.error.element_kind), 30);
  assert_int_equal(strlen(context.error.file), 510);
  assert_int_equal(strlen(context.error.hint), 254);

  char text[4096], end[512];
  qmat_error_format(&context.error, text, sizeof text);
  snprintf(end, sizeof end, " (%s)", context.error.hint);
  assert_string_equal(text + strlen(text) - strlen(end), end); /* nothing was lost on the way to the last part */
  for (size_t size = 1; size < 100; size++) {
    memset(text, '#', sizeof text);
    qmat_error_format(&context.error, text, size);
    assert_true(strlen(text) < size);
    assert_int_equal(strlen(text) % 2, 0);
  }
  text[0] = '#';
  qmat_error_format(&context.error, text, 0);
  assert_int_equal(text[0], '#');
}

typedef struct counted_calls {
  size_t calls;
  uint64_t last_done;
  bool answer;
  char node_id[16], node_type[16], unit[16];
} counted_calls;

static bool count_call(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                       const char *unit) {
  counted_calls *counted = user;
  (void)total;
  counted->calls++;
  counted->last_done = done;
  snprintf(counted->node_id, sizeof counted->node_id, "%s", node_id);
  snprintf(counted->node_type, sizeof counted->node_type, "%s", node_type);
  snprintf(counted->unit, sizeof counted->unit, "%s", unit);
  return counted->answer;
}

static void test_progress_without_a_function_goes_on(void **state) {
  (void)state;
  qmat_context context = {0};
  assert_int_equal(qmat_progress(&context, 0, 10, "rays"), QMAT_OK);
  assert_int_equal(qmat_progress(&context, 10, 10, "rays"), QMAT_OK);
}

static void test_progress_is_reported_at_both_ends_and_rarely_between(void **state) {
  (void)state;
  counted_calls counted = {.answer = true};
  qmat_context context = {.progress = count_call, .progress_user = &counted, .node_id = "a", .node_type = "b.c"};
  const uint64_t total = 2000000;
  struct timespec start, end;
  clock_gettime(CLOCK_MONOTONIC, &start);
  assert_int_equal(qmat_progress(&context, 0, total, "rays"), QMAT_OK);
  assert_int_equal(counted.calls, 1);
  assert_string_equal(counted.node_id, "a");
  assert_string_equal(counted.node_type, "b.c");
  assert_string_equal(counted.unit, "rays");
  for (uint64_t done = 1; done < total; done++) {
    if (qmat_progress(&context, done, total, "rays") != QMAT_OK) fail();
  }
  const size_t before_the_end = counted.calls;
  assert_int_equal(qmat_progress(&context, total, total, "rays"), QMAT_OK);
  assert_int_equal(counted.calls, before_the_end + 1);
  assert_true(counted.last_done == total);
  clock_gettime(CLOCK_MONOTONIC, &end);
  const double seconds = (double)(end.tv_sec - start.tv_sec) + 1e-9 * (double)(end.tv_nsec - start.tv_nsec);
  assert_true((double)counted.calls <= seconds / 0.05 + 3);
}

static void test_progress_comes_again_after_the_interval(void **state) {
  (void)state;
  counted_calls counted = {.answer = true};
  qmat_context context = {.progress = count_call, .progress_user = &counted};
  qmat_progress(&context, 0, 10, NULL);
  const struct timespec interval = {.tv_nsec = 60000000};
  nanosleep(&interval, NULL);
  qmat_progress(&context, 5, 10, NULL);
  assert_int_equal(counted.calls, 2);
  assert_true(counted.last_done == 5);
}

static void test_asking_to_stop_is_recorded_as_cancelled(void **state) {
  (void)state;
  counted_calls counted = {.answer = false};
  qmat_context context = {.progress = count_call, .progress_user = &counted, .node_id = "n", .node_type = "t.u"};
  assert_int_equal(qmat_progress(&context, 0, 10, "rays"), QMAT_CANCELLED);
  assert_int_equal(context.error.status, QMAT_CANCELLED);
  assert_format(&context, "node 'n' (t.u): cancelled");
}

static void test_uninit_empties_the_arena(void **state) {
  (void)state;
  qmat_context context = {0};
  assert_non_null(qmat_arena_alloc(&context.arena, 100, 8));
  qmat_fail(&context, QMAT_ERROR_IO, "failed");
  qmat_context_uninit(&context);
  assert_null(context.arena.newest);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_status_has_a_name_of_its_own_and_an_exit_code),
      cmocka_unit_test(test_threads_are_those_asked_for_or_the_processors),
      cmocka_unit_test(test_an_error_names_where_and_what),
      cmocka_unit_test(test_parts_that_do_not_apply_are_left_out),
      cmocka_unit_test(test_a_message_that_starts_with_the_field_does_not_repeat_it),
      cmocka_unit_test(test_the_newest_error_clears_the_one_before),
      cmocka_unit_test(test_an_error_may_quote_the_one_before),
      cmocka_unit_test(test_control_characters_leave_one_line),
      cmocka_unit_test(test_long_texts_are_cut_between_characters),
      cmocka_unit_test(test_progress_without_a_function_goes_on),
      cmocka_unit_test(test_progress_is_reported_at_both_ends_and_rarely_between),
      cmocka_unit_test(test_progress_comes_again_after_the_interval),
      cmocka_unit_test(test_asking_to_stop_is_recorded_as_cancelled),
      cmocka_unit_test(test_uninit_empties_the_arena),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
