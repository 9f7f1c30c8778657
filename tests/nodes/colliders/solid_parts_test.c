/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/surface.h"
#include "core/node.h"
#include "nodes/colliders/solid_parts.h"
#include "tests/shapes.h"

static const double finest = 1.0 / 256; /* the edge of the smallest cubes */

/* Two balls in a bar of 4 x 1 x 1 own one half each: its far face exactly, and the middle to a cube. The points of a
 * cell are in it. */
static void test_two_balls_halve_a_bar(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *bar = shape_new();
  shape_add_box(bar, -2, -0.5, -0.5, 2, 0.5, 0.5, false);
  bar = shape_seal(bar);
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, bar, &surface), QMAT_OK);
  const double unit = 1 / qmat_surface_frame(surface)->diagonal, reach = 2 * unit, side = 0.5 * unit;
  double spheres[8] = {-unit, 0, 0, side, unit, 0, 0, side};
  uint32_t shapes[6] = {0, 0, 0, 1, 1, 1};
  const qmat_shape_set set = {.spheres = spheres, .sphere_count = 2, .shapes = shapes, .shape_count = 2};
  qmat_solid_part *parts;
  assert_int_equal(qmat_solid_parts_find(&context, surface, &set, 0.001, &parts), QMAT_OK);
  for (int p = 0; p < 2; p++) {
    const double sign = p == 0 ? -1 : 1;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    assert_true(parts[p].count >= 8);
    for (size_t i = 0; i < parts[p].count; i++)
      for (size_t k = 0; k < 3; k++) {
        const double x = (k == 0 ? sign : 1) * parts[p].points[3 * i + k];
        low[k] = fmin(low[k], x);
        high[k] = fmax(high[k], x);
      }
    const double *at = parts[p].cell_points;
    for (size_t c = 0; c < parts[p].cell_count; c++) {
      const qmat_solid_cell *cell = &parts[p].cells[c];
      assert_true(cell->count >= 8 && cell->first >= 8 && cell->first <= cell->count);
      for (size_t i = 0; i < 3 * (size_t)cell->count; i++) {
        const double from = (double)cell->at[i % 3] / QMAT_SOLID_CELLS - 0.5;
        assert_true(at[i] >= from - 1e-6 && at[i] <= from + 1.0 / QMAT_SOLID_CELLS + 1e-6);
      }
      at += 3 * (size_t)cell->count;
    }
    assert_true(parts[p].cell_count > 0);
    assert_near(high[0], reach, 1e-6);
    assert_true(low[0] <= 1e-6 && low[0] >= -2 * finest);
    for (size_t k = 1; k < 3; k++) {
      assert_near(low[k], -side, 1e-6);
      assert_near(high[k], side, 1e-6);
    }
  }
  qmat_solid_parts_free(parts, 2);
  qmat_surface_free(surface);
  qmat_value_release(&bar->base);
  qmat_context_uninit(&context);
}

/* A shape that is nearest to no point of the solid has no part. */
static void test_a_far_shape_has_no_part(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *box = shape_new();
  shape_add_box(box, -1, -1, -1, 1, 1, 1, false);
  box = shape_seal(box);
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, box, &surface), QMAT_OK);
  double spheres[8] = {0, 0, 0, 0.2, 3, 0, 0, 0.1};
  uint32_t shapes[6] = {0, 0, 0, 1, 1, 1};
  const qmat_shape_set set = {.spheres = spheres, .sphere_count = 2, .shapes = shapes, .shape_count = 2};
  qmat_solid_part *parts;
  assert_int_equal(qmat_solid_parts_find(&context, surface, &set, 0.001, &parts), QMAT_OK);
  assert_true(parts[0].count >= 8);
  assert_int_equal(parts[1].count, 0);
  qmat_solid_parts_free(parts, 2);
  qmat_surface_free(surface);
  qmat_value_release(&box->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_two_balls_halve_a_bar),
      cmocka_unit_test(test_a_far_shape_has_no_part),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
