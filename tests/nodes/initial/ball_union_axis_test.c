/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/ball_union_axis.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"

static qmat_medial *axis_of(const double *balls, size_t count, double merge) {
  qmat_context context = {0};
  qmat_ball_union_counts counts;
  qmat_medial *medial = qmat_medial_new();
  assert_int_equal(qmat_ball_union_axis(&context, balls, count, merge, medial, &counts), QMAT_OK);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_context_uninit(&context);
  return medial;
}

static void test_one_ball_is_its_centre_and_a_ball_inside_it_adds_nothing(void **state) {
  (void)state;
  static const double balls[] = {0.1, 0, 0, 0.3, 0.15, 0, 0, 0.1};
  for (size_t count = 1; count <= 2; count++) {
    qmat_medial *medial = axis_of(balls, count, 0);
    medial_must_have(medial, 1, 0, 0);
    assert_memory_equal(medial->spheres, balls, 4 * sizeof *balls);
    qmat_value_release(&medial->base);
  }
}

static void test_two_balls_that_overlap_are_an_edge_and_two_apart_are_two_components(void **state) {
  (void)state;
  static const double together[] = {0, 0, 0, 0.3, 0.4, 0, 0, 0.2}, apart[] = {0, 0, 0, 0.1, 0.4, 0, 0, 0.2};
  qmat_medial *medial = axis_of(together, 2, 0);
  medial_must_have(medial, 2, 1, 0);
  qmat_value_release(&medial->base);
  medial = axis_of(apart, 2, 0);
  medial_must_have(medial, 2, 0, 0);
  qmat_value_release(&medial->base);
}

/* Three balls on a triangle with sides of 0.3, whose centroid is sqrt(0.03) away: with or without a hole between them.
 */
static void test_three_balls_are_a_triangle_where_they_have_a_common_point_and_else_a_ring(void **state) {
  (void)state;
  for (int filled = 0; filled < 2; filled++) {
    const double r = sqrt(0.03) + (filled ? 0.01 : -0.01);
    const double balls[] = {0, 0, 0, r, 0.3, 0, 0, r, 0.15, 0.15 * sqrt(3), 0, r};
    qmat_medial *medial = axis_of(balls, 3, 0);
    medial_must_have(medial, 3, 3, filled ? 1 : 0);
    qmat_value_release(&medial->base);
  }
}

/* Four balls at the corners of a regular tetrahedron. Each three of them meet in a corner of the boundary. The only
 * Voronoi vertex of these four corners is the centroid; the faces between them end at the sides of the tetrahedron. */
static void test_four_balls_are_a_cone_from_the_centroid_to_the_sides_of_their_tetrahedron(void **state) {
  (void)state;
  const double h = 0.1, r = 0.25;
  const double balls[] = {h, h, h, r, h, -h, -h, r, -h, h, -h, r, -h, -h, h, r};
  qmat_medial *medial = axis_of(balls, 4, 0);
  medial_must_have(medial, 5, 10, 6);
  /* The corner of the last three is at -t (1, 1, 1): (t + h)^2 + 2 (t - h)^2 = r^2. */
  const double t = (h + sqrt(h * h - 3 * (3 * h * h - r * r))) / 3;
  size_t centroid = SIZE_MAX;
  for (size_t i = 0; i < 5; i++)
    if (qmat_point_distance(&medial->spheres[4 * i], (const double[]){0, 0, 0}) < 1e-9) centroid = i;
  assert_int_not_equal(centroid, SIZE_MAX);
  assert_near(medial->spheres[4 * centroid + 3], t * sqrt(3), 1e-8);
  for (size_t i = 0; i < 6; i++) {
    const uint32_t *ids = &medial->triangles[3 * i];
    assert_true(ids[0] == centroid || ids[1] == centroid || ids[2] == centroid);
  }
  qmat_value_release(&medial->base);
}

/* The number of sets of balls that overlap. */
static size_t components_of(const double *balls, size_t count) {
  uint32_t parent[256];
  size_t components = count;
  assert_true(count <= 256);
  for (size_t i = 0; i < count; i++) parent[i] = (uint32_t)i;
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < i; k++) {
      if (qmat_point_distance(&balls[4 * i], &balls[4 * k]) > balls[4 * i + 3] + balls[4 * k + 3]) continue;
      uint32_t a = (uint32_t)i, b = (uint32_t)k;
      while (parent[a] != a) a = parent[a];
      while (parent[b] != b) b = parent[b];
      components -= a != b;
      parent[a] = b;
    }
  return components;
}

/* The radius at a point is its distance to the boundary, so it is at least the depth of the point in each ball. */
static void test_axis_of_random_balls_has_their_components_and_is_in_their_union(void **state) {
  (void)state;
  random_numbers random = {.seed = 7};
  for (int trial = 0; trial < 30; trial++) {
    double balls[4 * 60];
    for (size_t i = 0; i < 60; i++) {
      for (size_t k = 0; k < 3; k++) balls[4 * i + k] = random_between(&random, -0.5, 0.5);
      balls[4 * i + 3] = (0.02 + 0.01 * trial) * random_between(&random, 0.5, 1.5);
    }
    qmat_medial *medial = axis_of(balls, 60, 0);
    assert_int_equal(pipeline_components(medial), components_of(balls, 60));
    for (size_t i = 0; i < medial->sphere_count; i++) {
      const double *s = &medial->spheres[4 * i];
      double deepest = 0;
      for (size_t k = 0; k < 60; k++) deepest = fmax(deepest, balls[4 * k + 3] - qmat_point_distance(s, &balls[4 * k]));
      assert_true(deepest > 0);
      for (size_t k = 0; k < 60; k++)
        assert_true(s[3] >= balls[4 * k + 3] - qmat_point_distance(s, &balls[4 * k]) - 1e-9);
    }
    qmat_value_release(&medial->base);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_one_ball_is_its_centre_and_a_ball_inside_it_adds_nothing),
      cmocka_unit_test(test_two_balls_that_overlap_are_an_edge_and_two_apart_are_two_components),
      cmocka_unit_test(test_three_balls_are_a_triangle_where_they_have_a_common_point_and_else_a_ring),
      cmocka_unit_test(test_four_balls_are_a_cone_from_the_centroid_to_the_sides_of_their_tetrahedron),
      cmocka_unit_test(test_axis_of_random_balls_has_their_components_and_is_in_their_union),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
