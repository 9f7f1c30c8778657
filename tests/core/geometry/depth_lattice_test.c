/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/depth_lattice.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/shapes.h"

/* A torus, which has an inside, an outside and a hole. */
typedef struct {
  qmat_mesh *mesh;
  qmat_surface *surface;
} solid;

static int set_up(void **state) {
  static solid s;
  qmat_context context = {0};
  s.mesh = shape_seal(shape_torus(2, 0.7, 40, 20));
  assert_int_equal(qmat_surface_new(&context, s.mesh, &s.surface), QMAT_OK);
  qmat_context_uninit(&context);
  *state = &s;
  return 0;
}

static int tear_down(void **state) {
  solid *s = *state;
  qmat_surface_free(s->surface);
  qmat_value_release(&s->mesh->base);
  return 0;
}

static void make_lattice(qmat_depth_lattice *lattice, void **state, double spacing) {
  qmat_context context = {0};
  const solid *s = *state;
  assert_int_equal(qmat_depth_lattice_init(&context, lattice, s->surface, spacing), QMAT_OK);
  qmat_context_uninit(&context);
}

static void random_point(random_numbers *random, double half, double point[3]) {
  for (int k = 0; k < 3; k++) point[k] = random_between(random, -half, half);
}

static void test_exact_depth_is_positive_inside(void **state) {
  const solid *s = *state;
  qmat_depth_lattice lattice;
  make_lattice(&lattice, state, 0.01);
  const double middle = 2 / qmat_surface_frame(s->surface)->diagonal;
  const double inside[3] = {middle, 0, 0}, hole[3] = {0, 0, 0}, outside[3] = {0.9, 0.9, 0.9};
  /* Facets of a torus of 40 by 20 sink 2 % in. */
  assert_near(qmat_depth_lattice_exact(&lattice, inside), 0.35 * middle, 0.02 * middle);
  assert_near(qmat_depth_lattice_exact(&lattice, hole), -0.65 * middle, 0.02 * middle);
  assert_true(qmat_depth_lattice_exact(&lattice, outside) < -0.8);
  assert_true(lattice.queries == 3);
  qmat_depth_lattice_uninit(&lattice);
}

static void test_near_depth_differs_by_at_most_the_distance_to_the_node(void **state) {
  static const double spacings[] = {0.1, 0.02, 0.003};
  random_numbers random = {.seed = 1};
  for (size_t i = 0; i < 3; i++) {
    qmat_depth_lattice lattice;
    make_lattice(&lattice, state, spacings[i]);
    for (int round = 0; round < 3000; round++) {
      double point[3], distance = -1;
      random_point(&random, round % 10 ? 0.6 : 1.9, point);
      const double near = qmat_depth_lattice_near(&lattice, point, &distance);
      assert_true(distance >= 0 && distance <= sqrt(3) / 2 * spacings[i] * (1 + 1e-9));
      assert_near(near, qmat_depth_lattice_exact(&lattice, point), distance + 1e-12);
    }
    qmat_depth_lattice_uninit(&lattice);
  }
}

static void test_nodes_are_exact(void **state) {
  qmat_depth_lattice lattice;
  make_lattice(&lattice, state, 0.125);
  for (int i = -4; i <= 4; i++)
    for (int j = -4; j <= 4; j++) {
      const double point[3] = {0.125 * i, 0.125 * j, 0};
      double distance;
      const double near = qmat_depth_lattice_near(&lattice, point, &distance);
      assert_near(distance, 0, 0);
      assert_near(near, qmat_depth_lattice_exact(&lattice, point), 0);
    }
  assert_int_equal(lattice.nodes.count, 81);
  qmat_depth_lattice_uninit(&lattice);
}

static void test_depths_do_not_depend_on_earlier_queries(void **state) {
  enum { POINTS = 20000 };
  double(*points)[3] = calloc(POINTS, sizeof *points), *depths = calloc(POINTS, sizeof *depths);
  double *distances = calloc(POINTS, sizeof *distances);
  assert_true(points && depths && distances);
  random_numbers random = {.seed = 2};
  for (size_t i = 0; i < POINTS; i++) random_point(&random, 0.6, points[i]);
  qmat_depth_lattice forward, backward;
  make_lattice(&forward, state, 0.004);
  make_lattice(&backward, state, 0.004);
  const size_t before = forward.nodes.mask;
  for (size_t i = 0; i < POINTS; i++) depths[i] = qmat_depth_lattice_near(&forward, points[i], &distances[i]);
  for (size_t i = POINTS; i-- > 0;) {
    double distance;
    const double near = qmat_depth_lattice_near(&backward, points[i], &distance);
    assert_memory_equal(&near, &depths[i], sizeof near);
    assert_memory_equal(&distance, &distances[i], sizeof distance);
  }
  /* The table has grown and still has every node once. */
  assert_true(forward.nodes.mask > before && 2 * forward.nodes.count <= forward.nodes.mask + 1);
  assert_int_equal(forward.nodes.count, backward.nodes.count);
  assert_int_equal(forward.queries, forward.nodes.count);
  for (size_t i = 0; i < POINTS; i++) {
    double distance;
    const double near = qmat_depth_lattice_near(&forward, points[i], &distance);
    assert_memory_equal(&near, &depths[i], sizeof near);
  }
  assert_int_equal(forward.queries, forward.nodes.count); /* from the cache: no new queries */
  qmat_depth_lattice_uninit(&forward);
  qmat_depth_lattice_uninit(&backward);
  free(points);
  free(depths);
  free(distances);
}

/* A torus of which a piece is missing: sides change at its ends, where no triangle is near. */
static void test_depths_of_an_open_surface_do_not_depend_on_earlier_queries(void **state) {
  (void)state;
  enum { POINTS = 4000, FACETS = 120 };
  qmat_context context = {0};
  qmat_mesh *mesh = shape_torus(2, 0.7, 40, 20);
  mesh->triangle_count -= FACETS;
  shape_seal(mesh);
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  assert_false(qmat_surface_is_closed(surface));
  qmat_depth_lattice forward, backward;
  assert_int_equal(qmat_depth_lattice_init(&context, &forward, surface, 0.01), QMAT_OK);
  assert_int_equal(qmat_depth_lattice_init(&context, &backward, surface, 0.01), QMAT_OK);
  double(*points)[3] = calloc(POINTS, sizeof *points), *depths = calloc(POINTS, sizeof *depths);
  assert_true(points && depths);
  /* Along the middle of the tube, out of one end and into the other. */
  const double middle = 2 / qmat_surface_frame(surface)->diagonal;
  for (size_t i = 0; i < POINTS; i++) {
    const double angle = 0.005 * (double)i;
    points[i][0] = middle * cos(angle);
    points[i][1] = middle * sin(angle);
    points[i][2] = 0.02 * sin(7 * angle);
  }
  for (size_t i = 0; i < POINTS; i++) {
    double gap;
    const double near = qmat_depth_lattice_near(&forward, points[i], &gap);
    depths[i] = qmat_depth_lattice_exact_up_to(&forward, points[i], near, gap, 0.02);
  }
  for (size_t i = POINTS; i-- > 0;) {
    double gap;
    const double near = qmat_depth_lattice_near(&backward, points[i], &gap);
    const double depth = qmat_depth_lattice_exact_up_to(&backward, points[i], near, gap, 0.02);
    assert_memory_equal(&depth, &depths[i], sizeof depth);
    const double exact = qmat_depth_lattice_exact(&backward, points[i]);
    if (depth < INFINITY)
      assert_near(depth, exact, 1e-12);
    else
      assert_true(exact > 0.02);
  }
  qmat_depth_lattice_uninit(&forward);
  qmat_depth_lattice_uninit(&backward);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  free(points);
  free(depths);
}

static void test_points_beyond_the_lattice_get_the_exact_depth(void **state) {
  qmat_depth_lattice lattice;
  make_lattice(&lattice, state, 0.01);
  static const double points[][3] = {{2.5, 0, 0}, {0, -100, 0}, {0, 0, 1e9}, {2.0000001, 2, 2}};
  for (size_t i = 0; i < 4; i++) {
    double distance = -1;
    const double near = qmat_depth_lattice_near(&lattice, points[i], &distance);
    assert_near(distance, 0, 0);
    assert_near(near, qmat_depth_lattice_exact(&lattice, points[i]), 0);
  }
  assert_int_equal(lattice.nodes.count, 0);
  qmat_depth_lattice_uninit(&lattice);
}

static void test_a_depth_is_exact_up_to_a_limit(void **state) {
  qmat_depth_lattice lattice;
  make_lattice(&lattice, state, 0.02);
  random_numbers random = {.seed = 3};
  size_t above = 0, exact = 0;
  for (int round = 0; round < 6000; round++) {
    double point[3], gap;
    random_point(&random, 0.3, point);
    const double near = qmat_depth_lattice_near(&lattice, point, &gap), most = random_between(&random, 0, 0.1);
    const double asked = qmat_depth_lattice_exact_up_to(&lattice, point, near, gap, most);
    const double depth = qmat_depth_lattice_exact(&lattice, point);
    if (asked < INFINITY)
      assert_near(asked, depth, 1e-12);
    else
      assert_true(depth > most);
    above += asked == INFINITY;
    exact += asked < INFINITY && asked > 0;
  }
  assert_true(above > 100 && exact > 100);
  qmat_depth_lattice_uninit(&lattice);
}

static void test_least_depth_is_below_the_depth_by_at_most_the_second_order(void **state) {
  const double spacing = 0.02;
  qmat_depth_lattice lattice;
  make_lattice(&lattice, state, spacing);
  random_numbers random = {.seed = 4};
  size_t known = 0;
  for (int round = 0; round < 6000; round++) {
    double point[3], gap;
    random_point(&random, 0.4, point);
    if (!(qmat_depth_lattice_near(&lattice, point, &gap) > gap)) continue;
    const double depth = qmat_depth_lattice_exact(&lattice, point), least = qmat_depth_lattice_least(&lattice, point);
    assert_true(least <= depth + 1e-12);
    known += least > 0;
    /* Away from the medial axis of a tube the depth is smooth: it differs from the mean of the nodes by their spread.
     */
    if (depth > 2 * spacing) assert_true(least > depth - 0.4 * spacing);
  }
  assert_true(known > 100);
  const double outside[3] = {0, 0, 0}, beyond[3] = {2.5, 0, 0};
  assert_true(qmat_depth_lattice_least(&lattice, outside) == -INFINITY);
  assert_true(qmat_depth_lattice_least(&lattice, beyond) == -INFINITY);
  qmat_depth_lattice_uninit(&lattice);
}

static void test_corners_of_the_lattice_have_different_keys(void **state) {
  /* The finest spacing that the keys can number, and the farthest nodes. */
  static const double spacings[] = {0, 1e-6, 0.01};
  for (size_t i = 0; i < 3; i++) {
    qmat_depth_lattice lattice;
    make_lattice(&lattice, state, spacings[i]);
    assert_true(lattice.spacing >= 1e-6);
    for (int corner = 0; corner < 27; corner++) {
      const double point[3] = {2 * (corner % 3 - 1), 2 * (corner / 3 % 3 - 1), 2 * (corner / 9 - 1)};
      double distance;
      const double near = qmat_depth_lattice_near(&lattice, point, &distance);
      assert_near(near, qmat_depth_lattice_exact(&lattice, point), distance + 1e-12);
    }
    assert_int_equal(lattice.nodes.count, 27);
    qmat_depth_lattice_uninit(&lattice);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_exact_depth_is_positive_inside),
      cmocka_unit_test(test_near_depth_differs_by_at_most_the_distance_to_the_node),
      cmocka_unit_test(test_nodes_are_exact),
      cmocka_unit_test(test_depths_do_not_depend_on_earlier_queries),
      cmocka_unit_test(test_depths_of_an_open_surface_do_not_depend_on_earlier_queries),
      cmocka_unit_test(test_points_beyond_the_lattice_get_the_exact_depth),
      cmocka_unit_test(test_a_depth_is_exact_up_to_a_limit),
      cmocka_unit_test(test_least_depth_is_below_the_depth_by_at_most_the_second_order),
      cmocka_unit_test(test_corners_of_the_lattice_have_different_keys),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
