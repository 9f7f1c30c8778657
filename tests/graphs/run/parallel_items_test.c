/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/parallel_items.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <unistd.h>

enum { MOST_ITEMS = 40 };

/* What became of the items. */
typedef struct journal {
  atomic_int runs[MOST_ITEMS], threads[MOST_ITEMS];
  atomic_int in_use, most_in_use; /* threads of the items that run */
  bool fails[MOST_ITEMS];
  bool waits[MOST_ITEMS]; /* until it is asked to stop */
  atomic_bool stopped[MOST_ITEMS];
} journal;

static qmat_status run(void *user, qmat_context *context, size_t item) {
  journal *j = user;
  j->runs[item]++;
  j->threads[item] = qmat_threads(context);
  const int in_use = atomic_fetch_add(&j->in_use, context->threads) + context->threads;
  int most = j->most_in_use;
  while (in_use > most && !atomic_compare_exchange_weak(&j->most_in_use, &most, in_use)) continue;
  void *scratch = qmat_arena_alloc(&context->arena, 100, 1); /* each item has an arena of its own */
  memset(scratch, (int)item, 100);
  usleep((useconds_t)(100 * (item % 3))); /* they do not end in their order */
  qmat_status status = QMAT_OK;
  for (uint64_t i = 1; j->waits[item] && status == QMAT_OK; i++) {
    status = qmat_progress(context, i, 0, "rounds");
    if (status == QMAT_OK) usleep(1000);
  }
  if (status == QMAT_CANCELLED) j->stopped[item] = true;
  if (j->fails[item]) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it is item %zu", item);
    status = qmat_fail_element(context, "facet", (int64_t)item);
  }
  j->in_use -= context->threads;
  return status;
}

static void test_every_item_runs_once_within_the_threads(void **state) {
  (void)state;
  for (int threads = 1; threads <= 8; threads++)
    for (size_t count = 0; count <= MOST_ITEMS; count += 8) {
      journal j = {0};
      qmat_context context = {.threads = threads};
      size_t sizes[MOST_ITEMS], failed = 7;
      for (size_t i = 0; i < count; i++) sizes[i] = (i * 31) % 17;
      assert_int_equal(qmat_run_items(&context, count, sizes, "items", run, &j, &failed), QMAT_OK);
      assert_true(failed == SIZE_MAX);
      for (size_t i = 0; i < count; i++) {
        assert_int_equal(j.runs[i], 1);
        assert_in_range(j.threads[i], 1, threads);
      }
      assert_in_range(j.most_in_use, 0, threads);
      qmat_context_uninit(&context);
    }
}

static void expect_shares(int threads, size_t count, const size_t *sizes, const int *shares) {
  journal j = {0};
  qmat_context context = {.threads = threads};
  size_t failed;
  /* They wait for each other, so that all threads are taken while they run. */
  assert_int_equal(qmat_run_items(&context, count, sizes, "items", run, &j, &failed), QMAT_OK);
  for (size_t i = 0; i < count; i++)
    if (shares[i] > 0) assert_int_equal(j.threads[i], shares[i]);
}

static void test_the_largest_item_starts_first_with_the_threads_that_its_size_asks_for(void **state) {
  (void)state;
  expect_shares(4, 1, (size_t[]){5}, (int[]){4});
  expect_shares(4, 3, (size_t[]){1, 1, 1000}, (int[]){0, 0, 4});
  expect_shares(8, 2, (size_t[]){600, 400}, (int[]){5, 0});
  expect_shares(2, 2, (size_t[]){60, 40}, (int[]){1, 0});
  expect_shares(3, 5, (size_t[]){0, 0, 0, 0, 0}, (int[]){1, 0, 0, 0, 0}); /* sizes that tell nothing */
}

static void test_the_first_item_in_their_order_that_fails_is_told_for_any_number_of_threads(void **state) {
  (void)state;
  for (int threads = 1; threads <= 8; threads++) {
    journal j = {0};
    qmat_context context = {.threads = threads, .node_id = "simple"};
    size_t sizes[20], failed;
    /* The larger, the sooner: item 17 fails long before item 5, which has to be found all the same. */
    for (size_t i = 0; i < 20; i++) sizes[i] = i;
    j.fails[17] = j.fails[9] = j.fails[5] = true;
    j.waits[19] = threads > 1; /* it starts first and only ends when one before it has failed */
    assert_int_equal(qmat_run_items(&context, 20, sizes, "items", run, &j, &failed), QMAT_ERROR_GEOMETRY);
    assert_int_equal(failed, 5);
    assert_string_equal(context.error.message, "it is item 5");
    assert_string_equal(context.error.node_id, "simple");
    assert_int_equal(context.error.element, 5);
    for (size_t i = 0; i <= 5; i++) assert_int_equal(j.runs[i], 1);
    assert_int_equal(j.stopped[19], threads > 1);
    qmat_context_uninit(&context);
  }
}

/* What the outer progress function hears. */
typedef struct listener {
  pthread_t thread;
  uint64_t done, most; /* the last; it asks to stop from `most` on */
  int wrong;
} listener;

static bool hear(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                 const char *unit) {
  listener *l = user;
  (void)node_type;
  if (!pthread_equal(pthread_self(), l->thread) || strcmp(node_id, "simple") != 0) l->wrong++;
  if (total > 0 && (total != 12 || strcmp(unit, "items") != 0 || done < l->done)) l->wrong++;
  if (total > 0) l->done = done;
  return l->done < l->most;
}

static void test_progress_is_told_in_items_from_the_calling_thread(void **state) {
  (void)state;
  for (int threads = 1; threads <= 4; threads++) {
    journal j = {0};
    listener l = {.thread = pthread_self(), .most = 100};
    qmat_context context = {.threads = threads, .node_id = "simple", .progress = hear, .progress_user = &l};
    size_t sizes[12] = {0}, failed;
    assert_int_equal(qmat_run_items(&context, 12, sizes, "items", run, &j, &failed), QMAT_OK);
    assert_int_equal(l.wrong, 0);
    assert_int_equal(l.done, 12);
  }
}

static void test_cancelling_stops_the_items_that_run_and_starts_no_other(void **state) {
  (void)state;
  for (int threads = 1; threads <= 4; threads++) {
    journal j = {0};
    listener l = {.thread = pthread_self(), .most = 0};
    qmat_context context = {.threads = threads, .progress = hear, .node_id = "simple", .progress_user = &l};
    size_t sizes[12] = {0}, failed;
    for (size_t i = 0; i < 12; i++) j.waits[i] = true;
    assert_int_equal(qmat_run_items(&context, 12, sizes, "items", run, &j, &failed), QMAT_CANCELLED);
    assert_true(failed == SIZE_MAX);
    assert_int_equal(context.error.status, QMAT_CANCELLED);
    for (size_t i = 0; i < 12; i++) assert_true(j.runs[i] == j.stopped[i] && j.runs[i] <= 1);
    assert_int_equal(j.runs[11], 0);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_item_runs_once_within_the_threads),
      cmocka_unit_test(test_the_largest_item_starts_first_with_the_threads_that_its_size_asks_for),
      cmocka_unit_test(test_the_first_item_in_their_order_that_fails_is_told_for_any_number_of_threads),
      cmocka_unit_test(test_progress_is_told_in_items_from_the_calling_thread),
      cmocka_unit_test(test_cancelling_stops_the_items_that_run_and_starts_no_other),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
