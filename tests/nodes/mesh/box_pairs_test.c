/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Pairs of boxes that meet, against all pairs. */
#include "nodes/mesh/box_pairs_cgal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "tests/random.h"

enum { MOST = 400 };

typedef struct pairs {
  uint8_t seen[MOST][MOST];
  size_t calls, last;
} pairs;

static qmat_status note(void *data, uint32_t a, uint32_t b) {
  pairs *p = data;
  assert_true(a < MOST && b < MOST);
  p->seen[a][b]++;
  return ++p->calls == p->last ? QMAT_CANCELLED : QMAT_OK;
}

static int meet(const double *a, const double *b) {
  for (int k = 0; k < 3; k++)
    if (a[k] > b[3 + k] || b[k] > a[3 + k]) return 0;
  return 1;
}

/* On a lattice, where many boxes only touch, or are points. */
static void fill(random_numbers *random, double (*boxes)[6]) {
  for (size_t i = 0; i < MOST; i++)
    for (int k = 0; k < 3; k++) {
      boxes[i][k] = (double)random_index(random, 12);
      boxes[i][3 + k] = boxes[i][k] + (double)random_index(random, 3);
    }
}

static void against_all_pairs(void **state) {
  (void)state;
  random_numbers random = {7, 0};
  static double a[MOST][6], b[MOST][6];
  static pairs found;
  qmat_context context = {0};
  fill(&random, a);
  fill(&random, b);
  memset(&found, 0, sizeof found);
  assert_int_equal(qmat_find_box_pairs(&context, a[0], MOST, b[0], MOST, note, &found), QMAT_OK);
  for (size_t i = 0; i < MOST; i++)
    for (size_t k = 0; k < MOST; k++) assert_int_equal(found.seen[i][k], meet(a[i], b[k]));
  memset(&found, 0, sizeof found);
  assert_int_equal(qmat_find_box_pairs(&context, a[0], MOST, NULL, 0, note, &found), QMAT_OK);
  for (size_t i = 0; i < MOST; i++)
    for (size_t k = 0; k < MOST; k++) assert_int_equal(found.seen[i][k], i < k && meet(a[i], a[k]));
  qmat_context_uninit(&context);
}

static void a_visit_ends_the_search(void **state) {
  (void)state;
  random_numbers random = {8, 0};
  static double a[MOST][6];
  static pairs found;
  qmat_context context = {0};
  fill(&random, a);
  found.last = 5;
  assert_int_equal(qmat_find_box_pairs(&context, a[0], MOST, NULL, 0, note, &found), QMAT_CANCELLED);
  assert_int_equal(found.calls, 5);
  assert_int_equal(qmat_find_box_pairs(&context, a[0], 0, a[0], MOST, note, &found), QMAT_OK);
  assert_int_equal(found.calls, 5);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(against_all_pairs),
      cmocka_unit_test(a_visit_ends_the_search),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
