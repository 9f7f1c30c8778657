/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "core/value.h"
#include "io/near_copies.h"
#include "tests/shapes.h"

typedef struct fixture {
  qmat_context context;
  qmat_list *list;
  json_t *reports;
} fixture;

/* A box of 2 x 3 x 6, whose diagonal is 7, with one vertex moved along x. */
static qmat_mesh *box(size_t vertex, double move) {
  qmat_mesh *mesh = shape_box(2, 3, 6);
  mesh->positions[3 * vertex] += move;
  mesh->meters_per_unit = 1;
  return mesh;
}

static void start(fixture *f, size_t count) {
  *f = (fixture){.list = qmat_list_new(count), .reports = json_array()};
  for (size_t i = 0; i < count; i++) {
    const char name[] = {(char)('a' + i), 0};
    f->list->names[i] = qmat_strdup(name);
    json_array_append_new(f->reports, json_object());
  }
}

static void set(fixture *f, size_t item, qmat_mesh *mesh) {
  f->list->items[item] = &shape_seal(mesh)->base;
}

static const qmat_mesh *at(const fixture *f, size_t item) {
  return (const qmat_mesh *)f->list->items[item];
}

static const char *original_of(const fixture *f, size_t item) {
  return json_string_value(json_object_get(json_array_get(f->reports, item), "near_copy_of"));
}

static void merge(fixture *f) {
  assert_int_equal(qmat_near_copies_merge(&f->context, f->list, f->reports), QMAT_OK);
  assert_int_equal(qmat_value_seal(&f->context, &f->list->base), QMAT_OK);
}

static void end(fixture *f) {
  qmat_value_release(&f->list->base);
  json_decref(f->reports);
  qmat_context_uninit(&f->context);
}

static void test_copies_become_one_with_a_deviation_that_covers_them(void **state) {
  (void)state;
  fixture f;
  start(&f, 5);
  set(&f, 0, box(0, 0));
  set(&f, 1, box(7, 1e-6));
  set(&f, 2, box(0, 0)); /* equal in all bits */
  set(&f, 3, box(3, -5e-6));
  set(&f, 4, box(0, 0.5));
  merge(&f);
  for (size_t i = 1; i < 4; i++) assert_ptr_equal(f.list->items[i], f.list->items[0]);
  assert_ptr_not_equal(f.list->items[4], f.list->items[0]);
  qmat_mesh *first = shape_seal(box(0, 0));
  assert_memory_equal(at(&f, 0)->positions, first->positions, 24 * sizeof(double));
  qmat_value_release(&first->base);
  assert_true(fabs(at(&f, 0)->deviation - 5e-6) < 1e-15);
  assert_true(at(&f, 4)->deviation == 0);
  assert_null(original_of(&f, 0));
  assert_string_equal(original_of(&f, 1), "a");
  assert_null(original_of(&f, 2));
  assert_string_equal(original_of(&f, 3), "a");
  assert_null(original_of(&f, 4));
  end(&f);
}

/* 2e-6 of the diagonal of 7 is 1.4e-5. */
static void test_what_is_farther_than_rounding_stays(void **state) {
  (void)state;
  fixture f;
  start(&f, 2);
  set(&f, 0, box(0, 0));
  set(&f, 1, box(0, -1.5e-5));
  const qmat_value *before[] = {f.list->items[0], f.list->items[1]};
  merge(&f);
  for (size_t i = 0; i < 2; i++) assert_ptr_equal(f.list->items[i], before[i]);
  end(&f);
  start(&f, 2);
  set(&f, 0, box(0, 0));
  set(&f, 1, box(0, -1.3e-5));
  merge(&f);
  assert_ptr_equal(f.list->items[0], f.list->items[1]);
  end(&f);
}

static void test_the_most_common_one_stands_for_all(void **state) {
  (void)state;
  fixture f;
  start(&f, 4);
  set(&f, 0, box(0, 1.3e-5));
  set(&f, 1, box(0, 0));
  set(&f, 2, box(0, 2e-5));
  set(&f, 3, box(0, 0));
  merge(&f);
  for (size_t i = 1; i < 4; i++) assert_ptr_equal(f.list->items[i], f.list->items[0]);
  qmat_mesh *common = shape_seal(box(0, 0));
  assert_memory_equal(at(&f, 0)->positions, common->positions, 24 * sizeof(double));
  qmat_value_release(&common->base);
  assert_true(fabs(at(&f, 0)->deviation - 2e-5) < 1e-15);
  assert_string_equal(original_of(&f, 0), "b");
  assert_null(original_of(&f, 1));
  assert_string_equal(original_of(&f, 2), "b");
  assert_null(original_of(&f, 3));
  end(&f);
}

/* Copies of each other that are not copies of the same original do not form a chain. */
static void test_copies_are_near_the_first_not_near_each_other(void **state) {
  (void)state;
  fixture f;
  start(&f, 3);
  set(&f, 0, box(0, 0));
  set(&f, 1, box(0, -1e-5));
  set(&f, 2, box(0, -2e-5));
  merge(&f);
  assert_ptr_equal(f.list->items[0], f.list->items[1]);
  assert_ptr_not_equal(f.list->items[0], f.list->items[2]);
  assert_true(fabs(at(&f, 0)->deviation - 1e-5) < 1e-15);
  end(&f);
}

static void test_equal_meshes_and_failures_stay_as_they_are(void **state) {
  (void)state;
  fixture f;
  start(&f, 4);
  set(&f, 0, box(0, 0));
  set(&f, 1, box(0, 0));
  qmat_fail(&f.context, QMAT_ERROR_GEOMETRY, "no facet remains");
  f.list->items[2] = qmat_failure_of_error(&f.context);
  qmat_mesh *inch = box(0, 1e-6);
  inch->meters_per_unit = 0.0254;
  set(&f, 3, inch);
  const qmat_value *before[4];
  for (size_t i = 0; i < 4; i++) before[i] = f.list->items[i];
  merge(&f);
  for (size_t i = 0; i < 4; i++) assert_ptr_equal(f.list->items[i], before[i]);
  assert_true(at(&f, 0)->deviation == 0);
  end(&f);
}

/* Other triangles between the same vertices are another surface. */
static void test_other_triangles_are_no_copy(void **state) {
  (void)state;
  fixture f;
  start(&f, 2);
  set(&f, 0, box(0, 0));
  qmat_mesh *turned = box(0, 1e-6);
  const uint32_t first = turned->triangles[0];
  memmove(turned->triangles, turned->triangles + 1, 2 * sizeof *turned->triangles);
  turned->triangles[2] = first;
  set(&f, 1, turned);
  merge(&f);
  assert_ptr_not_equal(f.list->items[0], f.list->items[1]);
  end(&f);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_copies_become_one_with_a_deviation_that_covers_them),
      cmocka_unit_test(test_the_most_common_one_stands_for_all),
      cmocka_unit_test(test_what_is_farther_than_rounding_stays),
      cmocka_unit_test(test_copies_are_near_the_first_not_near_each_other),
      cmocka_unit_test(test_equal_meshes_and_failures_stay_as_they_are),
      cmocka_unit_test(test_other_triangles_are_no_copy),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
