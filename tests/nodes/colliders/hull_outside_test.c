/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/surface.h"
#include "nodes/colliders/hull_outside.h"
#include "tests/shapes.h"

/* The corners of a box of 4 x 4 x 2, moved out by `away` on each axis, and its triangles. */
static void fill_box(double away, double points[24], uint32_t triangles[36]) {
  static const uint32_t sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (size_t i = 0; i < 8; i++) {
    points[3 * i] = i & 1 ? 2 + away : -2 - away;
    points[3 * i + 1] = i & 2 ? 2 + away : -2 - away;
    points[3 * i + 2] = i & 4 ? 2 + away : -away;
  }
  for (size_t side = 0; side < 6; side++)
    for (size_t k = 0; k < 3; k++) {
      triangles[6 * side + k] = sides[side][k];
      triangles[6 * side + 3 + k] = sides[side][(k + 2) % 4];
    }
}

/* The same box with a groove along y, at right angles and 1 deep, in the middle of its upper side. */
static qmat_mesh *grooved_box(void) {
  static const double outline[7][2] = {{-2, 0}, {2, 0}, {2, 2}, {1, 2}, {0, 1}, {-1, 2}, {-2, 2}};
  static const uint32_t cap[5][3] = {{0, 1, 4}, {1, 2, 3}, {1, 3, 4}, {0, 4, 5}, {0, 5, 6}};
  qmat_mesh *mesh = shape_new();
  for (int end = 0; end < 2; end++)
    for (int i = 0; i < 7; i++) shape_vertex(mesh, outline[i][0], end ? 2 : -2, outline[i][1]);
  for (int t = 0; t < 5; t++) {
    shape_triangle(mesh, cap[t][0], cap[t][1], cap[t][2]);
    shape_triangle(mesh, 7 + cap[t][0], 7 + cap[t][2], 7 + cap[t][1]);
  }
  for (uint32_t i = 0; i < 7; i++) {
    const uint32_t next = (i + 1) % 7;
    shape_triangle(mesh, i, 7 + i, 7 + next);
    shape_triangle(mesh, i, 7 + next, next);
  }
  return shape_seal(mesh);
}

/* The bound, in the model's lengths, of the box moved out by `away`. */
static double protrusion(qmat_mesh *solid, double away, int threads) {
  double points[24], bound;
  uint32_t triangles[36];
  fill_box(away, points, triangles);
  const qmat_colliders box = {.points = points, .point_count = 8, .triangles = triangles, .triangle_count = 12};
  qmat_context context = {.threads = threads};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, solid, &surface), QMAT_OK);
  assert_int_equal(qmat_hulls_protrusion(&context, surface, &box, &bound), QMAT_OK);
  const double diagonal = qmat_surface_frame(surface)->diagonal;
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
  return bound * diagonal;
}

static void assert_bound(double bound, double value) {
  const double slack = qmat_protrusion_slack * 6; /* of the diagonal */
  assert_true(bound >= value - 1e-9);
  assert_true(bound <= value + 2 * slack);
}

/* The middle of the groove's opening is farthest from both of its sides. No corner of the hull or of the solid is as
 * far outside. */
static void test_a_hull_over_a_groove_is_outside_by_hand(void **state) {
  (void)state;
  qmat_mesh *solid = grooved_box();
  assert_bound(protrusion(solid, 0, 0), sqrt(0.5));
  assert_near(protrusion(solid, 0, 1), protrusion(solid, 0, 8), 0);
  qmat_value_release(&solid->base);
}

/* Facets on those of the solid, and as far outside everywhere. */
static void test_a_hull_around_a_box_by_hand(void **state) {
  (void)state;
  qmat_mesh *solid = shape_new();
  shape_add_box(solid, -2, -2, 0, 2, 2, 2, false);
  solid = shape_seal(solid);
  assert_bound(protrusion(solid, 0, 0), 0);
  assert_bound(protrusion(solid, 0.1, 0), 0.1 * sqrt(3));
  assert_bound(protrusion(solid, -0.1, 0), 0);
  qmat_value_release(&solid->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_hull_over_a_groove_is_outside_by_hand),
      cmocka_unit_test(test_a_hull_around_a_box_by_hand),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
