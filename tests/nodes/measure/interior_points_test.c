/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "nodes/measure/interior_points.h"
#include "tests/medial_meshes.h"
#include "tests/random.h"

enum { SPHERES = 600 };

static qmat_interior_points find(qmat_context *context, const double *spheres, size_t count, double depth) {
  qmat_medial *medial = medial_mesh(spheres, count, NULL, 0, NULL, 0);
  qmat_complex complex;
  qmat_interior_points inner;
  assert_int_equal(qmat_complex_init(context, &complex, medial, NULL), QMAT_OK);
  assert_int_equal(qmat_interior_points_find(context, &complex, depth, &inner), QMAT_OK);
  qmat_complex_uninit(&complex);
  qmat_value_release(&medial->base);
  return inner;
}

/* The largest depth of a point in a sphere. */
static double deepest_of_all(const double *spheres, size_t count, const double *point) {
  double best = -INFINITY;
  for (size_t i = 0; i < count; i++)
    best = fmax(best, spheres[4 * i + 3] - qmat_point_distance(point, &spheres[4 * i]));
  return best;
}

/* Spheres all over, and spheres of a ball: their centres are near its own, and all touch it from within. */
static void make_spheres(int of_a_ball, double *spheres) {
  random_numbers random = {.seed = 11};
  for (size_t i = 0; i < SPHERES; i++) {
    double *s = &spheres[4 * i];
    for (int k = 0; k < 3; k++)
      s[k] = of_a_ball ? random_between(&random, -0.03, 0.03) : random_between(&random, -1, 1);
    s[3] = of_a_ball ? 0.5 - sqrt(qmat_dot(s, s)) : random_between(&random, 0.01, 0.4);
  }
}

/* Each node of the lattice that a sphere contains to the depth is there, with the sphere that contains it deepest. */
static void test_nodes_have_the_sphere_that_contains_them_deepest(void **state) {
  (void)state;
  static double spheres[4 * SPHERES];
  for (int of_a_ball = 0; of_a_ball < 2; of_a_ball++) {
    const double depth = 0.02;
    make_spheres(of_a_ball, spheres);
    qmat_context context = {0};
    const qmat_interior_points inner = find(&context, spheres, SPHERES, depth);
    size_t centres = 0;
    double deepest = 0;
    for (size_t i = 0; i < inner.count; i++) {
      const double *s = &spheres[4 * (size_t)inner.spheres[i]], *point = &inner.points[3 * i];
      const double own = s[3] - qmat_point_distance(point, s);
      assert_true(fabs(own + inner.distances[i]) < 1e-12 && own >= depth - 1e-7);
      if (inner.limits[i] < 0) {
        centres++;
        assert_true(s[3] - own < 1e-12);
        continue;
      }
      deepest = fmax(deepest, deepest_of_all(spheres, SPHERES, point) - own);
    }
    assert_true(deepest < 2 * depth); /* of the spheres of a cube only the largest counts */
    assert_true(centres > (of_a_ball ? 5 : 300) && inner.count > centres + 1000);
    qmat_context_uninit(&context);
  }
}

/* The nodes are exactly those of the lattice that are deep enough in a kept sphere. */
static void test_no_node_is_left_out(void **state) {
  (void)state;
  const double spheres[8] = {0, 0, 0, 1, 3, 0, 0, 0.53}, depth = 0.1, spacing = 0.2;
  qmat_context context = {0};
  const qmat_interior_points inner = find(&context, spheres, 2, depth);
  size_t expected = 2; /* the centres */
  for (int x = 0; x <= 22; x++)
    for (int y = 0; y <= 22; y++)
      for (int z = 0; z <= 22; z++) {
        const double node[3] = {-1 + x * spacing, -1 + y * spacing, -1 + z * spacing};
        expected += deepest_of_all(spheres, 2, node) >= depth;
      }
  assert_int_equal(inner.count, expected);
  qmat_context_uninit(&context);
}

static void test_spheres_that_are_too_small_have_no_points(void **state) {
  (void)state;
  const double spheres[4] = {0, 0, 0, 0.05};
  qmat_context context = {0};
  assert_int_equal(find(&context, spheres, 1, 0.1).count, 0);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_nodes_have_the_sphere_that_contains_them_deepest),
      cmocka_unit_test(test_no_node_is_left_out),
      cmocka_unit_test(test_spheres_that_are_too_small_have_no_points),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
