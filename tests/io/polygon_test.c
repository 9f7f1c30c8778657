/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/polygon.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/hash.h"

/* The triangles of a polygon whose corners are all different vertices. Free with free. */
static uint32_t *triangulate_ids(const double *points, const uint32_t *ids, size_t count, bool *done) {
  double *flat = malloc(3 * count * sizeof *flat);
  uint32_t *links = malloc(8 * count * sizeof *links), *own = malloc(count * sizeof *own);
  uint32_t *triangles = malloc(3 * (count - 2) * sizeof *triangles);
  assert_true(flat && links && own && triangles);
  for (size_t i = 0; i < count; i++) own[i] = (uint32_t)i;
  *done = qmat_polygon_triangulate(points, ids ? ids : own, count, flat, links, triangles);
  free(flat);
  free(links);
  free(own);
  return triangles;
}

static double plane_area(const double *a, const double *b, const double *c) {
  return ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
}

/* For a polygon in the xy plane: the triangles are in range, none is turned over, they fill the polygon, and every side
 * of the polygon is a side of exactly one of them. */
static void assert_fills(const double *points, const uint32_t *ids, size_t count) {
  bool done = false;
  uint32_t *triangles = triangulate_ids(points, ids, count, &done);
  assert_true(done);
  double wanted = 0, sum = 0;
  for (size_t i = 1; i + 1 < count; i++) wanted += plane_area(points, points + 3 * i, points + 3 * (i + 1));
  size_t *sides = calloc(count, sizeof *sides);
  for (size_t t = 0; t < count - 2; t++) {
    const uint32_t *corners = triangles + 3 * t;
    for (int k = 0; k < 3; k++) {
      assert_true(corners[k] < count);
      if (corners[(k + 1) % 3] == (corners[k] + 1) % count) sides[corners[k]]++;
    }
    const double area = plane_area(points + 3 * corners[0], points + 3 * corners[1], points + 3 * corners[2]);
    assert_true(area > -1e-12);
    sum += area;
  }
  assert_true(fabs(sum - wanted) < 1e-9 * fabs(wanted));
  for (size_t i = 0; i < count; i++) assert_int_equal(sides[i], 1);
  free(sides);
  free(triangles);
}

static void test_a_convex_polygon_is_the_fan_of_its_first_corner(void **state) {
  (void)state;
  bool done;
  /* A square on any scale. */
  for (int power = -300; power <= 300; power += 50) {
    const double s = pow(10, power), square[] = {0, 0, 0, s, 0, 0, s, s, 0, 0, s, 0};
    uint32_t *triangles = triangulate_ids(square, NULL, 4, &done);
    const uint32_t first[] = {0, 1, 2, 0, 2, 3};
    assert_memory_equal(triangles, first, sizeof first);
    free(triangles);
  }
  /* A bent kite whose other diagonal is shorter, and a bent hexagon. */
  const double kite[] = {-3, 0, 0, 0, -1, 1, 3, 0, 0, 0, 1, 1};
  uint32_t *triangles = triangulate_ids(kite, NULL, 4, &done);
  const uint32_t halves[] = {0, 1, 2, 0, 2, 3};
  assert_memory_equal(triangles, halves, sizeof halves);
  free(triangles);
  const double hexagon[] = {2, 0, 0, 1, 2, .2, -1, 2, 0, -2, 0, .2, -1, -2, 0, 1, -2, .2};
  triangles = triangulate_ids(hexagon, NULL, 6, &done);
  const uint32_t fan[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5};
  assert_memory_equal(triangles, fan, sizeof fan);
  free(triangles);
}

static void test_a_concave_quadrilateral_is_cut_from_its_notch(void **state) {
  (void)state;
  double dart[] = {0, 0, 0, 4, 0, 0, 1, 1, 0, 0, 4, 0};
  for (int turn = 0; turn < 4; turn++) {
    assert_fills(dart, NULL, 4);
    double first[3];
    memcpy(first, dart, sizeof first);
    memmove(dart, dart + 3, 9 * sizeof *dart);
    memcpy(dart + 9, first, sizeof first);
  }
}

static void test_a_quadrilateral_with_a_straight_corner_gives_no_empty_triangle(void **state) {
  (void)state;
  const double points[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 1, 0};
  bool done;
  uint32_t *triangles = triangulate_ids(points, NULL, 4, &done);
  for (int t = 0; t < 2; t++) {
    assert_true(plane_area(points + 3 * triangles[3 * t], points + 3 * triangles[3 * t + 1],
                           points + 3 * triangles[3 * t + 2]) == 0.5);
  }
  free(triangles);
}

static void test_convex_and_concave_polygons_are_filled(void **state) {
  (void)state;
  const double ell[] = {0, 0, 0, 2, 0, 0, 2, 1, 0, 1, 1, 0, 1, 2, 0, 0, 2, 0};
  assert_fills(ell, NULL, 6);
  for (size_t count = 3; count < 400; count += count < 20 ? 1 : 57) {
    double *convex = calloc(3 * count, sizeof *convex), *star = calloc(3 * count, sizeof *star);
    for (size_t i = 0; i < count; i++) {
      const double angle = 2 * 3.141592653589793 * (double)i / (double)count;
      const double radius = 0.2 + qmat_hash_unit(qmat_hash3(3, count, i));
      convex[3 * i] = cos(angle);
      convex[3 * i + 1] = sin(angle);
      star[3 * i] = radius * cos(angle);
      star[3 * i + 1] = radius * sin(angle);
    }
    assert_fills(convex, NULL, count);
    if (count > 4) assert_fills(star, NULL, count);
    free(convex);
    free(star);
  }
}

static void test_a_comb_and_a_spiral_are_filled(void **state) {
  (void)state;
  enum { TEETH = 300 };
  double *comb = calloc(3 * (2 * TEETH + 2), sizeof *comb);
  size_t count = 0;
  for (int i = 2 * TEETH; i >= 0; i--) {
    comb[3 * count] = i;
    comb[3 * count++ + 1] = i % 2 ? 10 : 1;
  }
  comb[3 * count++] = 0;
  comb[3 * (count - 1) + 1] = 0;
  double *closed = calloc(3 * (count + 1), sizeof *closed);
  memcpy(closed, comb, 3 * count * sizeof *comb);
  closed[3 * count] = 2 * TEETH;
  assert_fills(closed, NULL, count + 1);
  free(closed);
  free(comb);

  enum { STEPS = 120 };
  double spiral[3 * 2 * STEPS] = {0};
  for (int i = 0; i < STEPS; i++) {
    const double angle = 0.3 * i, outer = 1 + 0.1 * i, inner = outer - 0.5;
    spiral[3 * i] = outer * cos(angle);
    spiral[3 * i + 1] = outer * sin(angle);
    spiral[3 * (2 * STEPS - 1 - i)] = inner * cos(angle);
    spiral[3 * (2 * STEPS - 1 - i) + 1] = inner * sin(angle);
  }
  assert_fills(spiral, NULL, (size_t)2 * STEPS);
}

static void test_a_hole_that_is_joined_by_a_bridge_stays_open(void **state) {
  (void)state;
  /* A square ring: outside counter-clockwise, bridge, hole clockwise, bridge back. */
  const double points[] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 0, 0, 0, 1, 1, 0, 1, 3, 0, 3, 3, 0, 3, 1, 0, 1, 1, 0};
  const uint32_t ids[] = {0, 1, 2, 3, 0, 4, 5, 6, 7, 4};
  assert_fills(points, ids, 10);
}

static void test_a_polygon_is_cut_in_its_own_plane(void **state) {
  (void)state;
  /* An L in the plane x + y + z = const, seen from either side. */
  const double ell[] = {0, 0, 2, 0, 2, 1, 1, 1, 1, 2, 0, 2};
  for (int side = 0; side < 2; side++) {
    double points[18], total[3] = {0, 0, 0};
    for (int i = 0; i < 6; i++) {
      const double *p = ell + 2 * (side ? 5 - i : i);
      points[3 * i] = p[0];
      points[3 * i + 1] = p[1];
      points[3 * i + 2] = 7 - p[0] - p[1];
    }
    bool done;
    uint32_t *triangles = triangulate_ids(points, NULL, 6, &done);
    for (int t = 0; t < 4; t++) {
      const double *a = points + 3 * triangles[3 * t], *b = points + 3 * triangles[3 * t + 1],
                   *c = points + 3 * triangles[3 * t + 2];
      const double area = plane_area(a, b, c);
      assert_true(side ? area < 0 : area > 0);
      total[0] += area;
    }
    assert_true(fabs(total[0]) == 3);
    free(triangles);
  }
}

static void test_polygons_that_bend_cross_themselves_or_have_no_area_are_cut_all_the_same(void **state) {
  (void)state;
  for (uint64_t round = 0; round < 500; round++) {
    enum { MOST = 30 };
    double points[3 * MOST];
    const size_t count = 3 + round % (MOST - 3);
    for (size_t i = 0; i < 3 * count; i++) {
      points[i] = round % 5 == 0 ? (double)(i / 3 % 4) : floor(6 * qmat_hash_unit(qmat_hash3(5, round, i))) * 1e200;
    }
    bool done = false;
    uint32_t *triangles = triangulate_ids(points, NULL, count, &done);
    assert_true(done);
    /* However it is cut, each side belongs to one triangle more in its direction than against it. */
    int sides[MOST][MOST] = {{0}};
    for (size_t t = 0; t < count - 2; t++) {
      for (int k = 0; k < 3; k++) {
        const uint32_t a = triangles[3 * t + (size_t)k], b = triangles[3 * t + (size_t)(k + 1) % 3];
        assert_true(a < count && b < count && a != b);
        sides[a][b]++;
        sides[b][a]--;
      }
    }
    for (size_t i = 0; i < count; i++) {
      for (size_t j = 0; j < count; j++) {
        assert_int_equal(sides[i][j], j == (i + 1) % count ? 1 : i == (j + 1) % count ? -1 : 0);
      }
    }
    free(triangles);
  }
}

static void test_only_concave_polygons_have_a_largest_size(void **state) {
  (void)state;
  const size_t count = QMAT_LARGEST_CONCAVE_POLYGON + 2;
  double *points = calloc(3 * count, sizeof *points);
  for (size_t i = 0; i < count; i++) {
    const double angle = 2 * 3.141592653589793 * (double)i / (double)count;
    points[3 * i] = cos(angle);
    points[3 * i + 1] = sin(angle);
  }
  assert_fills(points, NULL, count);
  points[0] = 0.5;
  bool done = true;
  free(triangulate_ids(points, NULL, count, &done));
  assert_false(done);
  assert_fills(points, NULL, 2000); /* a piece of it: an open fan from (0.5, 0) */
  free(points);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_convex_polygon_is_the_fan_of_its_first_corner),
      cmocka_unit_test(test_a_concave_quadrilateral_is_cut_from_its_notch),
      cmocka_unit_test(test_a_quadrilateral_with_a_straight_corner_gives_no_empty_triangle),
      cmocka_unit_test(test_convex_and_concave_polygons_are_filled),
      cmocka_unit_test(test_a_comb_and_a_spiral_are_filled),
      cmocka_unit_test(test_a_hole_that_is_joined_by_a_bridge_stays_open),
      cmocka_unit_test(test_a_polygon_is_cut_in_its_own_plane),
      cmocka_unit_test(test_polygons_that_bend_cross_themselves_or_have_no_area_are_cut_all_the_same),
      cmocka_unit_test(test_only_concave_polygons_have_a_largest_size),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
