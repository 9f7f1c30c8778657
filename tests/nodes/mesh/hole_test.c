/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The triangulation of polygons with many equally good ones: it does not depend on where memory is. */
#include "nodes/mesh/hole_cgal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

#include "core/geometry/vector.h"
#include "tests/random.h"

enum { MOST_SIDES = 240, BLOCKS = 200, RUNS = 25 };

/* A border of the glTF sample DamagedHelmet: the end of a prism, out of its plane by rounding only. Some of its
 * triangulations are exactly as good as each other. */
static const double border[16][3] = {
    {-0.1328935, -0.1346956, 0.052184305443058389}, {-0.1434574, -0.1368426, 0.052184305443058389},
    {-0.1524455, -0.1427942, 0.052184305443058389}, {-0.1583971, -0.1517823, 0.05218430997335028},
    {-0.1605441, -0.1623462, 0.05218430997335028},  {-0.1583971, -0.1729101, 0.052184309973350294},
    {-0.1524455, -0.1818979, 0.052184309973350294}, {-0.1434574, -0.1878494, 0.052184309973350294},
    {-0.1328935, -0.1899967, 0.052184309973350294}, {-0.1223299, -0.1878497, 0.052184309973350294},
    {-0.1133418, -0.1818982, 0.052184305443058403}, {-0.1073903, -0.1729104, 0.052184305443058403},
    {-0.1052433, -0.1623465, 0.052184305443058389}, {-0.1073903, -0.1517826, 0.052184305443058389},
    {-0.1133418, -0.1427942, 0.052184305443058389}, {-0.1223297, -0.1368426, 0.052184305443058389}};

/* The border, with its sides divided into a polygon of `sides` sides. */
static void divide_border(int sides, double points[], double thirds[]) {
  for (int i = 0; i < sides; i++) {
    const int side = 16 * i / sides, along = 16 * i % sides;
    double corner[3];
    for (int k = 0; k < 3; k++)
      corner[k] = ((sides - along) * border[side][k] + along * border[(side + 1) % 16][k]) / sides;
    if (along == 0) memcpy(corner, border[side], sizeof corner);
    memcpy(points + (ptrdiff_t)3 * i, corner, sizeof corner);
  }
  for (int i = 0; i < sides; i++) {
    const ptrdiff_t next = (i + 1) % sides;
    const double third[3] = {points[3 * next], points[3 * next + 1], points[3 * next + 2] - 0.05};
    memcpy(thirds + (ptrdiff_t)3 * i, third, sizeof third);
  }
}

/* Blocks of memory of random sizes, half of them free again. */
static void scatter_memory(random_numbers *random, void *blocks[BLOCKS]) {
  for (int i = 0; i < BLOCKS; i++) blocks[i] = malloc(16 + random_index(random, 3000));
  for (int i = 0; i < BLOCKS; i++)
    if (random_index(random, 2) == 0) {
      free(blocks[i]);
      blocks[i] = NULL;
    }
}

static void triangles_do_not_depend_on_addresses(void **state) {
  (void)state;
  static double points[3 * MOST_SIDES], thirds[3 * MOST_SIDES];
  static uint32_t first[3 * MOST_SIDES], again[3 * MOST_SIDES];
  random_numbers random = {.seed = 3};
  for (int s = 0; s < 2; s++) {
    const int sides = s == 0 ? 16 : MOST_SIDES;
    const size_t count = (size_t)sides;
    qmat_context context = {0};
    divide_border(sides, points, thirds);
    assert_int_equal(qmat_triangulate_hole(&context, points, thirds, count, first), QMAT_OK);
    for (int i = 0; i < RUNS; i++) {
      void *blocks[BLOCKS];
      scatter_memory(&random, blocks);
      assert_int_equal(qmat_triangulate_hole(&context, points, thirds, count, again), QMAT_OK);
      assert_memory_equal(first, again, 3 * (count - 2) * sizeof *first);
      for (int k = 0; k < BLOCKS; k++) free(blocks[k]);
    }
    qmat_context_uninit(&context);
  }
}

/* Each side belongs to one triangle, in its direction, and each other edge to two, in both directions. */
static void every_side_is_a_side_of_one_triangle(void **state) {
  (void)state;
  static double points[3 * MOST_SIDES], thirds[3 * MOST_SIDES];
  static uint32_t triangles[3 * MOST_SIDES];
  static int balance[MOST_SIDES][MOST_SIDES];
  for (int sides = 3; sides <= MOST_SIDES; sides = sides < 20 ? sides + 1 : 3 * sides) {
    const size_t count = (size_t)sides;
    qmat_context context = {0};
    divide_border(sides, points, thirds);
    assert_int_equal(qmat_triangulate_hole(&context, points, thirds, count, triangles), QMAT_OK);
    memset(balance, 0, sizeof balance);
    for (size_t t = 0; t < count - 2; t++)
      for (size_t k = 0; k < 3; k++) {
        const uint32_t from = triangles[3 * t + k], to = triangles[3 * t + (k + 1) % 3];
        balance[from][to]++;
        balance[to][from]--;
      }
    for (int i = 0; i < sides; i++)
      for (int j = 0; j < sides; j++) assert_int_equal(balance[i][j], (j == (i + 1) % sides) - (i == (j + 1) % sides));
    qmat_context_uninit(&context);
  }
}

/* No corner is in the circle of a triangle, whichever plane an ellipse is nearly in. */
static void nearly_flat_polygons_have_delaunay_triangles(void **state) {
  (void)state;
  enum { SIDES = 64 };
  for (int axis = 0; axis < 3; axis++) {
    double points[3 * SIDES], thirds[3 * SIDES], flat[SIDES][2];
    uint32_t triangles[3 * (SIDES - 2)];
    qmat_context context = {0};
    for (int i = 0; i < SIDES; i++) {
      flat[i][0] = 0.05 * cos(2 * QMAT_PI * i / SIDES) - 0.13;
      flat[i][1] = 0.03 * sin(2 * QMAT_PI * i / SIDES) - 0.16;
      for (int k = 0; k < 2; k++) points[3 * i + (axis + 1 + k) % 3] = thirds[3 * i + (axis + 1 + k) % 3] = flat[i][k];
      points[3 * i + axis] = border[i % 16][2];
      thirds[3 * i + axis] = 0;
    }
    assert_int_equal(qmat_triangulate_hole(&context, points, thirds, SIDES, triangles), QMAT_OK);
    for (size_t t = 0; t < SIDES - 2; t++)
      for (size_t i = 0; i < SIDES; i++) {
        double lifted[3][3];
        for (size_t k = 0; k < 3; k++) {
          const double *corner = flat[triangles[3 * t + k]];
          const double x = corner[0] - flat[i][0], y = corner[1] - flat[i][1];
          memcpy(lifted[k], (double[]){x, y, x * x + y * y}, sizeof lifted[k]);
        }
        assert_true(qmat_determinant(lifted) < 1e-15);
      }
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(triangles_do_not_depend_on_addresses),
      cmocka_unit_test(nearly_flat_polygons_have_delaunay_triangles),
      cmocka_unit_test(every_side_is_a_side_of_one_triangle),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
