/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "graphs/run/run_lists.h"
#include "tests/graphs/test_nodes.h"

static const char sum_graph[] =
    "qmat: 1\n"
    "nodes:\n"
    "  one:   { type: test.number, params: { value: 1 } }\n"
    "  total: { type: test.add, in: { first: one.number, second: one.number } }\n"
    "outputs: { sum: total.sum }\n";

static qmat_list *make_list(const double *numbers, size_t count) {
  qmat_context context = {0};
  qmat_list *list = qmat_list_new(count);
  for (size_t i = 0; i < count; i++) {
    list->names[i] = qmat_strdup("name");
    test_ok(&context, test_report(&context, numbers[i], &list->items[i]));
  }
  test_ok(&context, qmat_value_seal(&context, &list->base));
  return list;
}

/* Adds the two numbers; a sum of 13 is refused, one of 20 comes from the cache. `user` counts the calls. */
static qmat_status add(void *user, qmat_context *context, qmat_run *one, pthread_mutex_t *lock, bool *hit) {
  const double sum = test_value(one->slots[1].value) + test_value(one->slots[2].value);
  pthread_mutex_lock(lock);
  ++*(size_t *)user;
  pthread_mutex_unlock(lock);
  if (sum == 13) return qmat_fail(context, QMAT_ERROR_GEOMETRY, "13 is refused");
  *hit = sum == 20;
  return test_report(context, sum, &one->slots[0].value);
}

/* A run of the graph, up to the step that adds. */
typedef struct fixture {
  qmat_context context;
  qmat_graph graph;
  qmat_run run;
  size_t step;
} fixture;

static void fixture_init(fixture *f) {
  *f = (fixture){.context = {.threads = 2}};
  test_ok(&f->context, test_read(&f->context, sum_graph, &f->graph));
  test_ok(&f->context, qmat_run_plan(&f->context, &f->graph, &(qmat_run_options){0}, &f->run));
  while (f->run.graph->nodes[f->run.steps[f->step].node].type != &test_add) f->step++;
}

static void fixture_uninit(fixture *f) {
  qmat_run_uninit(&f->run);
  qmat_graph_uninit(&f->graph);
  qmat_context_uninit(&f->context);
}

static void test_equal_items_are_run_once_and_have_the_same_result(void **state) {
  (void)state;
  enum { COUNT = 8 };
  /* The third and the fifth pair equal the first, the sixth the second; 6 + 7 is refused twice. */
  const double firsts[COUNT] = {1, 10, 1, 2, 1, 10, 6, 6}, seconds[COUNT] = {5, 10, 5, 5, 5, 10, 7, 7};
  size_t calls = 0;
  fixture f;
  fixture_init(&f);
  qmat_list *first = make_list(firsts, COUNT), *second = make_list(seconds, COUNT);
  const qmat_value *inputs[] = {&first->base, &second->base};
  qmat_value *output = NULL;
  test_ok(&f.context, qmat_run_lifted(&f.context, &f.run, f.step, inputs, first, add, &calls, &output));
  assert_int_equal(calls, 4);
  assert_int_equal(qmat_value_count(output), COUNT);
  for (size_t i = 0; i < COUNT; i++) {
    const qmat_value *item = qmat_value_at(output, i);
    if (i < 6)
      assert_true(test_value(item) == firsts[i] + seconds[i]);
    else
      assert_non_null(strstr(qmat_value_failure(item), "13 is refused"));
  }
  assert_ptr_equal(qmat_value_at(output, 4), qmat_value_at(output, 0));
  assert_ptr_not_equal(qmat_value_at(output, 3), qmat_value_at(output, 0));
  assert_int_equal(f.run.steps[f.step].lifted, COUNT);
  assert_int_equal(f.run.steps[f.step].lifted_hits, 2); /* both pairs whose sum is 20 */

  /* Items that are failures already are left out, each of them. */
  const qmat_value *again[] = {output, &second->base};
  qmat_value *sums = NULL;
  calls = 0;
  test_ok(&f.context,
          qmat_run_lifted(&f.context, &f.run, f.step, again, (const qmat_list *)output, add, &calls, &sums));
  assert_int_equal(f.run.steps[f.step].lifted_left_out, 2);
  assert_int_equal(calls, 3);
  assert_non_null(qmat_value_failure(qmat_value_at(sums, 7)));
  qmat_value_release(sums);
  qmat_value_release(output);
  qmat_value_release(&first->base);
  qmat_value_release(&second->base);
  fixture_uninit(&f);
}

static void test_items_whose_digests_begin_alike_are_told_apart(void **state) {
  (void)state;
  enum { COUNT = 40 };
  double firsts[COUNT], seconds[COUNT];
  for (int i = 0; i < COUNT; i++) {
    firsts[i] = i % 30;
    seconds[i] = 100;
  }
  size_t calls = 0;
  fixture f;
  fixture_init(&f);
  qmat_list *first = make_list(firsts, COUNT), *second = make_list(seconds, COUNT);
  for (size_t i = 0; i < COUNT; i++) memset(first->items[i]->digest.bytes, 0xff, 8);
  const qmat_value *inputs[] = {&first->base, &second->base};
  qmat_value *output = NULL;
  test_ok(&f.context, qmat_run_lifted(&f.context, &f.run, f.step, inputs, first, add, &calls, &output));
  assert_int_equal(calls, 30);
  for (size_t i = 0; i < COUNT; i++) assert_true(test_value(qmat_value_at(output, i)) == firsts[i] + 100);
  qmat_value_release(output);
  qmat_value_release(&first->base);
  qmat_value_release(&second->base);
  fixture_uninit(&f);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_equal_items_are_run_once_and_have_the_same_result),
                                     cmocka_unit_test(test_items_whose_digests_begin_alike_are_told_apart)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
