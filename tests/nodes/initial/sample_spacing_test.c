/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/sample_spacing.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/shapes.h"

static const double row_height = 0.86602540378443864676;

static void count_sides(const qmat_mesh *mesh, double spacing, uint32_t *counts) {
  qmat_context context = {0};
  double *spacings = qmat_alloc(mesh->triangle_count, sizeof *spacings);
  assert_non_null(spacings);
  for (size_t t = 0; t < mesh->triangle_count; t++) spacings[t] = spacing;
  assert_int_equal(qmat_side_points_count(&context, mesh, mesh->positions, spacings, counts), QMAT_OK);
  qmat_free(spacings);
  qmat_context_uninit(&context);
}

static qmat_mesh *right_triangle(void) {
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 0, 0, 0);
  shape_vertex(mesh, 4, 0, 0);
  shape_vertex(mesh, 0, 3, 0);
  shape_triangle(mesh, 0, 1, 2);
  return mesh;
}

static void test_sides_of_three_four_five(void **state) {
  (void)state;
  qmat_mesh *mesh = right_triangle();
  uint32_t counts[3];
  count_sides(mesh, 1, counts); /* k to k + 1: 4, 5, 3 long */
  assert_int_equal(counts[0], 3);
  assert_int_equal(counts[1], 4);
  assert_int_equal(counts[2], 2);
  count_sides(mesh, 4, counts);
  assert_int_equal(counts[0], 0);
  assert_int_equal(counts[1], 1);
  assert_int_equal(counts[2], 0);
  count_sides(mesh, 3.9, counts);
  assert_int_equal(counts[0], 1);
  count_sides(mesh, 100, counts);
  assert_int_equal(counts[0] + counts[1] + counts[2], 0);
  qmat_value_release(&mesh->base);
}

static void test_shared_side_belongs_to_its_first_facet(void **state) {
  (void)state;
  qmat_mesh *mesh = right_triangle();
  shape_vertex(mesh, 4, 3, 0);
  shape_triangle(mesh, 2, 1, 3);
  shape_triangle(mesh, 1, 2, 3); /* the same facet from behind: owns nothing */
  uint32_t counts[9];
  count_sides(mesh, 1, counts);
  static const uint32_t expected[9] = {3, 4, 2, 0, 2, 3, 0, 0, 0};
  assert_memory_equal(counts, expected, sizeof counts);
  qmat_value_release(&mesh->base);
}

static void test_shared_side_has_the_spacing_of_the_facet_that_needs_more(void **state) {
  (void)state;
  qmat_mesh *mesh = right_triangle();
  shape_vertex(mesh, 4, 3, 0);
  shape_triangle(mesh, 2, 1, 3);
  qmat_context context = {0};
  uint32_t counts[6];
  for (int finer = 0; finer < 2; finer++) {
    const double spacings[2] = {finer == 0 ? 1 : 2.5, finer == 1 ? 1 : 2.5};
    assert_int_equal(qmat_side_points_count(&context, mesh, mesh->positions, spacings, counts), QMAT_OK);
    assert_int_equal(counts[1], 4);
    assert_int_equal(counts[3], 0);
    assert_int_equal(counts[0], finer == 0 ? 3 : 1);
    assert_int_equal(counts[5], finer == 1 ? 3 : 1); /* as long as side 0 */
  }
  qmat_context_uninit(&context);
  qmat_value_release(&mesh->base);
}

/* The height over the side of 5 is 2.4. */
static void test_spacing_of_a_facet_is_a_share_of_its_height(void **state) {
  (void)state;
  const double a[3] = {0, 0, 0}, b[3] = {4, 0, 0}, c[3] = {0, 3, 0};
  const double *orders[3][3] = {{a, b, c}, {b, c, a}, {c, b, a}};
  for (int i = 0; i < 3; i++) {
    const qmat_longest_side side = qmat_triangle_longest_side(orders[i][0], orders[i][1], orders[i][2]);
    assert_ptr_equal(orders[i][(side.base + 2) % 3], a);
    assert_true(side.length == 5 && fabs(side.height - 2.4) < 1e-15);
  }
  assert_true(fabs(qmat_triangle_spacing(2.4, 0.25, 0.5) - 0.6) < 1e-15);
  assert_true(qmat_triangle_spacing(2.4, 0.25, 0.7) == 0.7);
  assert_true(qmat_triangle_spacing(2.4, 0.25, 0.1) == 0.25);
  assert_true(qmat_triangle_longest_side(a, a, a).height == 0);
  assert_true(qmat_triangle_longest_side(a, b, b).height == 0);
}

static void test_degenerate_facets_count_without_harm(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 0, 0, 0);
  shape_vertex(mesh, 3, 0, 0);
  shape_vertex(mesh, 1, 0, 0);
  shape_triangle(mesh, 0, 1, 0); /* there and back */
  shape_triangle(mesh, 2, 2, 2);
  shape_triangle(mesh, 0, 2, 1); /* collinear */
  uint32_t counts[9];
  count_sides(mesh, 1, counts);
  static const uint32_t expected[9] = {2, 0, 0, 0, 0, 0, 0, 1, 0};
  assert_memory_equal(counts, expected, sizeof counts);
  double *p = mesh->positions;
  assert_int_equal(qmat_row_points_count(p, p + 3, p, 0.1), 0);
  assert_int_equal(qmat_row_points_count(p + 6, p + 6, p + 6, 0.1), 0);
  assert_int_equal(qmat_row_points_count(p, p + 6, p + 3, 0.1), 0);
  qmat_value_release(&mesh->base);
}

static void test_box_has_points_on_each_edge_once(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 2, 4);
  uint32_t counts[36];
  count_sides(mesh, 0.999, counts);
  size_t sum = 0;
  for (int i = 0; i < 36; i++) sum += counts[i];
  /* Four edges each of 1, 2 and 4; two diagonals each of sqrt(5), sqrt(17) and sqrt(20). */
  assert_int_equal(sum, 4 * (1 + 2 + 4) + 2 * (2 + 4 + 4));
  qmat_value_release(&mesh->base);
}

static void test_points_of_a_side_divide_it_evenly(void **state) {
  (void)state;
  for (int side = 0; side < 3; side++) {
    double weights[15];
    for (int i = 0; i < 15; i++) weights[i] = 77;
    qmat_side_points_fill(side, 4, weights);
    for (int i = 0; i < 4; i++) {
      assert_near(weights[3 * i + side], (4.0 - i) / 5, 1e-15);
      assert_near(weights[3 * i + (side + 1) % 3], (i + 1.0) / 5, 1e-15);
      assert_near(weights[3 * i + (side + 2) % 3], 0, 0);
    }
    for (int i = 12; i < 15; i++) assert_near(weights[i], 77, 0);
    qmat_side_points_fill(side, 0, weights + 12);
    for (int i = 12; i < 15; i++) assert_near(weights[i], 77, 0);
  }
}

static void test_rows_of_an_equilateral_triangle(void **state) {
  (void)state;
  /* Side 3.9 at spacing 1: three rows between base and top, of round(3.9 * 3/4), round(3.9 / 2), round(3.9 / 4). */
  const double a[3] = {0, 0, 0}, b[3] = {3.9, 0, 0}, c[3] = {1.95, 3.9 * row_height, 0};
  assert_int_equal(qmat_row_points_count(a, b, c, 1), 3 + 2 + 1);
  assert_int_equal(qmat_row_points_count(b, c, a, 1), 6);
  assert_int_equal(qmat_row_points_count(a, b, c, 1.9), 1 + 1);
  assert_int_equal(qmat_row_points_count(a, b, c, 3.9), 0);
  assert_int_equal(qmat_row_points_count(a, b, c, 4), 0);
}

static void test_long_flat_triangle_has_sides_only(void **state) {
  (void)state;
  const double a[3] = {0, 0, 0}, b[3] = {100, 0, 0}, c[3] = {50, 0.8, 0};
  assert_int_equal(qmat_row_points_count(a, b, c, 1), 0);
}

static void random_corner(random_numbers *random, double p[3]) {
  for (int k = 0; k < 3; k++) p[k] = random_between(random, -1, 1);
}

static void mix(const double *weights, const double *const corners[3], double p[3]) {
  for (int k = 0; k < 3; k++)
    p[k] = weights[0] * corners[0][k] + weights[1] * corners[1][k] + weights[2] * corners[2][k];
}

/* All points of a facet: its corners, those on its sides, those in its rows. */
static size_t all_points(const double *const corners[3], double spacing, uint64_t key, double (**points)[3]) {
  qmat_mesh *mesh = shape_new();
  for (int k = 0; k < 3; k++) shape_vertex(mesh, corners[k][0], corners[k][1], corners[k][2]);
  shape_triangle(mesh, 0, 1, 2);
  uint32_t sides[3];
  count_sides(mesh, spacing, sides);
  qmat_value_release(&mesh->base);
  const size_t rows = qmat_row_points_count(corners[0], corners[1], corners[2], spacing);
  const size_t count = 3 + sides[0] + sides[1] + sides[2] + rows;
  double *weights = calloc(3 * count, sizeof *weights);
  *points = calloc(count, sizeof **points);
  assert_true(weights && *points);
  for (int k = 0; k < 3; k++) weights[4 * k] = 1;
  size_t next = 3;
  for (int k = 0; k < 3; k++) {
    qmat_side_points_fill(k, sides[k], &weights[3 * next]);
    next += sides[k];
  }
  qmat_row_points_fill(corners[0], corners[1], corners[2], spacing, key, rows, &weights[3 * next]);
  for (size_t i = 0; i < count; i++) mix(&weights[3 * i], corners, (*points)[i]);
  free(weights);
  return count;
}

static void test_every_place_of_a_facet_has_a_point_within_the_spacing(void **state) {
  (void)state;
  random_numbers random = {.seed = 1};
  for (int round = 0; round < 60; round++) {
    double a[3], b[3], c[3];
    random_corner(&random, a);
    random_corner(&random, b);
    random_corner(&random, c);
    const double *const corners[3] = {a, b, c};
    const double spacing = random_between(&random, 0.05, 0.5);
    double(*points)[3];
    const size_t count = all_points(corners, spacing, (uint64_t)round, &points);
    for (int i = 0; i <= 30; i++)
      for (int j = 0; i + j <= 30; j++) {
        const double weights[3] = {(30 - i - j) / 30.0, i / 30.0, j / 30.0};
        double p[3], least = INFINITY;
        mix(weights, corners, p);
        for (size_t k = 0; k < count; k++) least = fmin(least, qmat_point_distance(p, points[k]));
        assert_true(least <= spacing);
      }
    free(points);
  }
}

static void test_points_in_rows_lie_inside_and_apart(void **state) {
  (void)state;
  random_numbers random = {.seed = 2};
  size_t looked_at = 0;
  for (int round = 0; round < 100; round++) {
    double a[3], b[3], c[3];
    random_corner(&random, a);
    random_corner(&random, b);
    random_corner(&random, c);
    const double *const corners[3] = {a, b, c};
    const double spacing = random_between(&random, 0.03, 0.4);
    const size_t count = qmat_row_points_count(a, b, c, spacing);
    looked_at += count;
    double *weights = calloc(3 * count + 3, sizeof *weights);
    assert_non_null(weights);
    for (size_t i = 0; i < 3; i++) weights[3 * count + i] = 77;
    qmat_row_points_fill(a, b, c, spacing, (uint64_t)round, count, weights);
    for (size_t i = 0; i < 3; i++) assert_near(weights[3 * count + i], 77, 0);
    double(*points)[3] = calloc(count + 1, sizeof *points);
    assert_non_null(points);
    for (size_t i = 0; i < count; i++) {
      for (size_t k = 0; k < 3; k++) assert_true(weights[3 * i + k] > 0 && weights[3 * i + k] < 1);
      assert_near(weights[3 * i] + weights[3 * i + 1] + weights[3 * i + 2], 1, 1e-15);
      mix(&weights[3 * i], corners, points[i]);
      /* Rows may be closer than the spacing where they round up, points of one row too. */
      for (size_t j = 0; j < i; j++) assert_true(qmat_point_distance(points[i], points[j]) > 0.3 * spacing);
    }
    free(weights);
    free(points);
  }
  assert_true(looked_at > 1000);
}

static void test_fewer_points_are_picked_evenly(void **state) {
  (void)state;
  const double a[3] = {0, 0, 0}, b[3] = {1, 0, 0}, c[3] = {0.3, 1, 0};
  const uint64_t all = qmat_row_points_count(a, b, c, 0.02);
  assert_true(all > 1000);
  double *full = calloc(3 * all, sizeof *full), *few = calloc(3 * all + 3, sizeof *few);
  assert_true(full && few);
  qmat_row_points_fill(a, b, c, 0.02, 5, all, full);
  static const uint64_t wanted[] = {0, 1, 2, 7, 100, 500};
  for (size_t w = 0; w < 6; w++) {
    for (size_t i = 0; i < 3 * all; i++) few[i] = 77;
    qmat_row_points_fill(a, b, c, 0.02, 5, wanted[w], few);
    uint64_t at = 0;
    for (uint64_t i = 0; i < wanted[w]; i++) {
      /* Each is one of all the points, in their order, about all / wanted on from the last. */
      const uint64_t from = at;
      while (at < all && memcmp(&full[3 * at], &few[3 * i], 3 * sizeof *few) != 0) at++;
      assert_true(at < all);
      at++;
      assert_true(at - from <= all / wanted[w] + 1 && at - from >= all / wanted[w]);
    }
    assert_near(few[3 * wanted[w]], 77, 0);
  }
  free(full);
  free(few);
}

static void test_keys_move_the_points_a_little(void **state) {
  (void)state;
  const double a[3] = {0, 0, 0}, b[3] = {1, 0, 0}, c[3] = {0.5, 0.9, 0};
  const uint64_t count = qmat_row_points_count(a, b, c, 0.1);
  double one[300], same[300], other[300];
  assert_true(count > 20 && count <= 100);
  qmat_row_points_fill(a, b, c, 0.1, 1, count, one);
  qmat_row_points_fill(a, b, c, 0.1, 1, count, same);
  qmat_row_points_fill(a, b, c, 0.1, 2, count, other);
  assert_memory_equal(one, same, 3 * count * sizeof *one);
  const double *const corners[3] = {a, b, c};
  for (uint64_t i = 0; i < count; i++) {
    double p[3], q[3];
    mix(&one[3 * i], corners, p);
    mix(&other[3 * i], corners, q);
    assert_true(qmat_point_distance(p, q) > 0 && qmat_point_distance(p, q) < 0.5 * 0.1);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_sides_of_three_four_five),
      cmocka_unit_test(test_shared_side_belongs_to_its_first_facet),
      cmocka_unit_test(test_shared_side_has_the_spacing_of_the_facet_that_needs_more),
      cmocka_unit_test(test_spacing_of_a_facet_is_a_share_of_its_height),
      cmocka_unit_test(test_degenerate_facets_count_without_harm),
      cmocka_unit_test(test_box_has_points_on_each_edge_once),
      cmocka_unit_test(test_points_of_a_side_divide_it_evenly),
      cmocka_unit_test(test_rows_of_an_equilateral_triangle),
      cmocka_unit_test(test_long_flat_triangle_has_sides_only),
      cmocka_unit_test(test_every_place_of_a_facet_has_a_point_within_the_spacing),
      cmocka_unit_test(test_points_in_rows_lie_inside_and_apart),
      cmocka_unit_test(test_fewer_points_are_picked_evenly),
      cmocka_unit_test(test_keys_move_the_points_a_little),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
