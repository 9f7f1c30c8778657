/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

#include <cmocka.h>

#include "core/side_by_side.h"

typedef struct {
  _Atomic size_t done;
  size_t first_failure, last_failure;
  uint8_t ran[64];
} items;

static qmat_status run_item(void *user, qmat_context *own, size_t item) {
  items *all = user;
  assert_int_equal(qmat_threads(own), 1);
  all->ran[item]++;
  if (item == all->first_failure || item == all->last_failure)
    return qmat_fail(own, QMAT_ERROR_GEOMETRY, "item %zu", item);
  atomic_fetch_add(&all->done, 1);
  return qmat_progress(own, 0, 0, "ignored");
}

static void test_every_item_runs_once(void **state) {
  (void)state;
  for (int threads = 1; threads <= 8; threads *= 2) {
    qmat_context context = {.threads = threads};
    items all = {.first_failure = 64, .last_failure = 64};
    assert_int_equal(qmat_run_side_by_side(&context, 64, run_item, &all, &all.done, 64, "items"), QMAT_OK);
    for (size_t i = 0; i < 64; i++) assert_int_equal(all.ran[i], 1);
    assert_int_equal(atomic_load(&all.done), 64);
    qmat_context_uninit(&context);
  }
}

static void test_a_failure_ends_it_with_its_error(void **state) {
  (void)state;
  qmat_context context = {.threads = 1};
  items all = {.first_failure = 5, .last_failure = 9};
  assert_int_equal(qmat_run_side_by_side(&context, 64, run_item, &all, &all.done, 64, "items"), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.message, "item 5");
  assert_int_equal(all.ran[6], 0);
  qmat_context_uninit(&context);
}

/* Item 9 fails at once, item 5 late. */
static qmat_status fail_late(void *user, qmat_context *own, size_t item) {
  items *all = user;
  all->ran[item]++;
  if (item == 5)
    for (int i = 0; i < 5000 && atomic_load(&all->done) == 0; i++)
      nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
  if (item == 9) atomic_store(&all->done, 1);
  return item == 5 || item == 9 ? qmat_fail(own, QMAT_ERROR_GEOMETRY, "item %zu", item) : QMAT_OK;
}

static void test_the_first_failing_item_gives_the_error(void **state) {
  (void)state;
  qmat_context context = {.threads = 2};
  items all = {.first_failure = 64, .last_failure = 64};
  assert_int_equal(qmat_run_side_by_side(&context, 64, fail_late, &all, &all.done, 64, "items"), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.message, "item 5");
  assert_int_equal(all.ran[63], 0);
  qmat_context_uninit(&context);
}

/* Runs until it is cancelled, in any thread. */
static qmat_status run_on(void *user, qmat_context *own, size_t item) {
  (void)user, (void)item;
  while (qmat_progress(own, 0, 0, "") == QMAT_OK) nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
  return QMAT_CANCELLED;
}

/* Refuses to go on at call `stop_at`. It is asked at every opportunity. */
typedef struct {
  qmat_context *context;
  size_t stop_at, calls;
} stopper;

static bool may_go_on(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                      const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total, (void)unit;
  stopper *stop = user;
  stop->context->progress_time = 0;
  return stop->calls++ < stop->stop_at;
}

/* `calls` gets how often the progress function was asked. */
static qmat_status run_until(int threads, size_t stop_at, items *all, size_t *calls) {
  qmat_context context = {.threads = threads, .progress = may_go_on};
  stopper stop = {.context = &context, .stop_at = stop_at};
  context.progress_user = &stop;
  *all = (items){.first_failure = 64, .last_failure = 64};
  const qmat_status status = qmat_run_side_by_side(&context, 64, run_item, all, &all->done, 64, "items");
  if (status != QMAT_OK) assert_int_equal(context.error.status, status);
  *calls = stop.calls;
  qmat_context_uninit(&context);
  return status;
}

static void test_it_can_be_cancelled(void **state) {
  (void)state;
  items all;
  size_t whole, calls;
  assert_int_equal(run_until(1, SIZE_MAX, &all, &whole), QMAT_OK);
  assert_int_equal(whole, 1 + 64); /* before the first item, then in each */
  for (size_t stop_at = 0; stop_at < whole; stop_at++) {
    assert_int_equal(run_until(1, stop_at, &all, &calls), QMAT_CANCELLED);
    assert_int_equal(calls, stop_at + 1);
    for (size_t i = 0; i < 64; i++) assert_int_equal(all.ran[i], i < stop_at);
  }
  assert_int_equal(run_until(2, 0, &all, &calls), QMAT_CANCELLED);
  assert_int_equal(calls, 1);
  assert_int_equal(atomic_load(&all.done), 0);
}

/* Polls in the middle of its work. */
static qmat_status poll_five_times(void *user, qmat_context *own, size_t item) {
  (void)user, (void)item;
  qmat_status status = QMAT_OK;
  for (int i = 0; i < 5 && status == QMAT_OK; i++) status = qmat_progress(own, 1, 2, "");
  return status;
}

/* Only the outer context limits how often the run is asked: on one thread the number of calls depends on no clock. */
static void test_each_poll_of_an_item_reaches_the_outer_context(void **state) {
  (void)state;
  qmat_context context = {.threads = 1, .progress = may_go_on};
  stopper stop = {.context = &context, .stop_at = SIZE_MAX};
  const _Atomic size_t done = 1;
  context.progress_user = &stop;
  assert_int_equal(qmat_run_side_by_side(&context, 3, poll_five_times, NULL, &done, 3, "items"), QMAT_OK);
  assert_int_equal(stop.calls, 1 + 3 * 5);
  qmat_context_uninit(&context);
}

/* One item for eight threads: the main thread hears of a cancel while another has the item. */
static void test_it_can_be_cancelled_while_the_main_thread_waits(void **state) {
  (void)state;
  for (int round = 0; round < 20; round++) {
    qmat_context context = {.threads = 8, .progress = may_go_on};
    stopper stop = {.context = &context, .stop_at = 9};
    context.progress_user = &stop;
    items all = {.first_failure = 64, .last_failure = 64};
    assert_int_equal(qmat_run_side_by_side(&context, 1, run_on, &all, &all.done, 1, "items"), QMAT_CANCELLED);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_item_runs_once),
      cmocka_unit_test(test_a_failure_ends_it_with_its_error),
      cmocka_unit_test(test_the_first_failing_item_gives_the_error),
      cmocka_unit_test(test_it_can_be_cancelled),
      cmocka_unit_test(test_each_poll_of_an_item_reaches_the_outer_context),
      cmocka_unit_test(test_it_can_be_cancelled_while_the_main_thread_waits),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
