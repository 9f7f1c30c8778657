/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_merge.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/shapes.h"
#include "tests/shortage.h"

enum { BALLS = 2, MOST_POINTS = 16, STRIDE = 23 };

/* A bar that is divided between two balls, each with a hull of its own to be replaced. */
typedef struct bar {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
  qmat_solid_part *parts;
  qmat_colliders *colliders;
} bar;

static void make_bar(bar *b) {
  *b = (bar){.context = {.threads = 1}};
  b->mesh = shape_new();
  shape_add_box(b->mesh, -2, -0.5, -0.5, 2, 0.5, 0.5, false);
  b->mesh = shape_seal(b->mesh);
  assert_int_equal(qmat_surface_new(&b->context, b->mesh, &b->surface), QMAT_OK);
  const double unit = 1 / qmat_surface_frame(b->surface)->diagonal;
  double spheres[4 * BALLS] = {0};
  uint32_t shapes[3 * BALLS];
  for (uint32_t i = 0; i < BALLS; i++) {
    spheres[4 * i] = (2 * (double)i - 1) * unit;
    spheres[4 * i + 3] = 0.5 * unit;
    for (int k = 0; k < 3; k++) shapes[3 * i + (uint32_t)k] = i;
  }
  const qmat_shape_set set = {.spheres = spheres, .sphere_count = BALLS, .shapes = shapes, .shape_count = BALLS};
  assert_int_equal(qmat_solid_parts_find(&b->context, b->surface, &set, 0.001, &b->parts), QMAT_OK);
  b->colliders = qmat_colliders_new();
  assert_non_null(b->colliders);
  b->colliders->shape_count = BALLS;
  b->colliders->shapes = qmat_alloc(3 * BALLS, sizeof *b->colliders->shapes);
  b->colliders->hull_ends = qmat_calloc(2 * BALLS, sizeof *b->colliders->hull_ends);
  assert_true(b->colliders->shapes && b->colliders->hull_ends);
  memcpy(b->colliders->shapes, shapes, sizeof shapes);
}

static qmat_status merge(bar *b) {
  const double error = 0.01 * qmat_surface_frame(b->surface)->diagonal;
  return qmat_hulls_merge(&b->context, b->surface, b->parts, 0, MOST_POINTS, error, b->colliders);
}

static void free_bar(bar *b) {
  qmat_solid_parts_free(b->parts, BALLS);
  qmat_value_release(&b->colliders->base);
  qmat_surface_free(b->surface);
  qmat_value_release(&b->mesh->base);
  qmat_context_uninit(&b->context);
}

static void test_parts_of_a_bar_become_one_hull(void **state) {
  (void)state;
  bar b;
  make_bar(&b);
  assert_int_equal(merge(&b), QMAT_OK);
  assert_int_equal(b.colliders->shape_count, 1);
  assert_int_equal(b.colliders->point_count, 8);
  assert_int_equal(b.colliders->triangle_count, 12);
  free_bar(&b);
}

/* No pair of parts stays apart because memory was short when it was tested. */
static void test_a_shortage_is_no_refusal_of_a_pair(void **state) {
  (void)state;
  bar b;
  make_bar(&b);
  shortage(SIZE_MAX, 0);
  assert_int_equal(merge(&b), QMAT_OK);
  const size_t needed = atomic_load(&asked);
  free_bar(&b);
  assert_true(needed > 0);
  for (size_t first = 0; first < needed; first += STRIDE) {
    make_bar(&b);
    shortage(first, 1);
    const qmat_status status = merge(&b);
    shortage(SIZE_MAX, 0);
    if (status == QMAT_OK) {
      assert_int_equal(b.colliders->shape_count, 1);
      assert_int_equal(b.colliders->point_count, 8);
    } else {
      assert_int_equal(status, QMAT_ERROR_MEMORY);
      assert_int_equal(b.context.error.status, QMAT_ERROR_MEMORY);
    }
    free_bar(&b);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_parts_of_a_bar_become_one_hull),
      cmocka_unit_test(test_a_shortage_is_no_refusal_of_a_pair),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
