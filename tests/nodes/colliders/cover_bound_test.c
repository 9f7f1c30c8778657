/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/surface.h"
#include "nodes/colliders/cover_bound.h"
#include "nodes/colliders/solid_cubes.h"
#include "tests/shapes.h"

/* In diagonals of the cube. */
static const double side = 0.57735026918962576 / 2, tolerance = 4e-3, fine = 1e-3;

typedef struct cube {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
} cube;

static cube cube_new(int threads) {
  cube c = {.context = {.threads = threads}, .mesh = shape_new()};
  shape_add_box(c.mesh, -1, -1, -1, 1, 1, 1, false);
  c.mesh = shape_seal(c.mesh);
  assert_int_equal(qmat_surface_new(&c.context, c.mesh, &c.surface), QMAT_OK);
  return c;
}

static void cube_free(cube *c) {
  qmat_surface_free(c->surface);
  qmat_value_release(&c->mesh->base);
  qmat_context_uninit(&c->context);
}

static const uint32_t two_balls[6] = {0, 0, 0, 1, 1, 1};

static qmat_cover_bound measure(cube *c, double *spheres, size_t count, double least, bool only_parts,
                                const qmat_cover_bound *before) {
  uint32_t shapes[6];
  memcpy(shapes, two_balls, sizeof shapes);
  const qmat_shape_set set = {.spheres = spheres, .sphere_count = count, .shapes = shapes, .shape_count = count};
  qmat_cover_bound bound;
  assert_int_equal(qmat_cover_bound_measure(&c->context, c->surface, &set, least, only_parts, before, &bound), QMAT_OK);
  return bound;
}

/* The corners of a cube are half a diagonal from its centre. */
static void test_a_ball_around_a_cube_covers_it(void **state) {
  (void)state;
  cube c = cube_new(0);
  double ball[4] = {0, 0, 0, 0.5 + 1e-6};
  const qmat_cover_bound bound = measure(&c, ball, 1, tolerance, false, NULL);
  assert_near(bound.bound, 0, 0);
  assert_int_equal(bound.count, 0);
  for (size_t i = 0; i < QMAT_CUBE_REGIONS; i++) assert_true(bound.covered[i]);
  cube_free(&c);
}

/* A smaller ball leaves out the corners, by what its radius is smaller. */
static void test_a_small_ball_leaves_the_corners_out(void **state) {
  (void)state;
  cube c = cube_new(0);
  double ball[4] = {0, 0, 0, 0.47};
  const qmat_cover_bound bound = measure(&c, ball, 1, tolerance, false, NULL);
  assert_true(bound.bound >= 0.03 && bound.bound <= 0.03 + 2 * tolerance);
  assert_true(bound.count > 8);
  size_t corners = 0, open = 0;
  for (size_t i = 0; i < bound.count; i++) {
    const qmat_uncovered *part = &bound.parts[i];
    double middle[3];
    for (int k = 0; k < 3; k++) {
      assert_true(fabs(part->point[k]) <= side + 2 * tolerance);
      middle[k] = fabs(part->point[k]);
    }
    assert_true(part->value > 0 && part->value <= bound.bound);
    assert_true(sqrt(middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2]) > 0.47);
    corners += middle[0] > side - tolerance && middle[1] > side - tolerance && middle[2] > side - tolerance;
  }
  for (size_t i = 0; i < QMAT_CUBE_REGIONS; i++) open += !bound.covered[i];
  assert_true(corners >= 8);
  assert_true(open >= 8);
  cube_free(&c);
}

/* The same parts are found where the search of a region ends with the last part, on any number of threads. */
static void test_only_parts_are_the_same_parts(void **state) {
  (void)state;
  double balls[8] = {-0.1, 0, 0, 0.38, 0.1, 0, 0, 0.38};
  cube c = cube_new(1), d = cube_new(8);
  const qmat_cover_bound all = measure(&c, balls, 2, fine, false, NULL),
                         parts = measure(&d, balls, 2, fine, true, NULL);
  assert_true(all.count > 0 && parts.bound > 0 && parts.bound <= all.bound);
  assert_int_equal(all.count, parts.count);
  for (size_t i = 0; i < all.count; i++) {
    assert_memory_equal(all.parts[i].point, parts.parts[i].point, sizeof all.parts[i].point);
    assert_near(all.parts[i].value, parts.parts[i].value, 0);
    assert_int_equal(all.parts[i].shape, parts.parts[i].shape);
  }
  assert_memory_equal(all.covered, parts.covered, QMAT_CUBE_REGIONS * sizeof *all.covered);
  cube_free(&c);
  cube_free(&d);
}

/* Where a ball grew, the answer is the same whether what was covered before is searched again or not. */
static void test_what_was_covered_is_not_searched_again(void **state) {
  (void)state;
  double balls[8] = {-0.1, 0, 0, 0.38, 0.1, 0, 0, 0.38};
  cube c = cube_new(0);
  const qmat_cover_bound before = measure(&c, balls, 2, fine, true, NULL);
  balls[3] = 0.4;
  const qmat_cover_bound again = measure(&c, balls, 2, fine, false, NULL),
                         after = measure(&c, balls, 2, fine, false, &before);
  assert_true(again.count > 0);
  assert_int_equal(again.count, after.count);
  assert_near(again.bound, after.bound, 0);
  assert_memory_equal(again.covered, after.covered, QMAT_CUBE_REGIONS * sizeof *again.covered);
  balls[7] = 1e-3; /* no growth: what the ball covered is out of sight */
  const qmat_cover_bound seen = measure(&c, balls, 2, fine, false, NULL),
                         unseen = measure(&c, balls, 2, fine, false, &before);
  assert_true(unseen.count < seen.count);
  cube_free(&c);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_ball_around_a_cube_covers_it),
      cmocka_unit_test(test_a_small_ball_leaves_the_corners_out),
      cmocka_unit_test(test_only_parts_are_the_same_parts),
      cmocka_unit_test(test_what_was_covered_is_not_searched_again),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
