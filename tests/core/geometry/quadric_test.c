/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/quadric.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/random.h"
#include "tests/shapes.h"

static const double pi = 3.14159265358979323846;

static double dot(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void unit_vector(random_numbers *random, double n[3]) {
  double square;
  do {
    for (int k = 0; k < 3; k++) n[k] = random_between(random, -1, 1);
    square = dot(n, n);
  } while (square > 1 || square < 0.01);
  for (int k = 0; k < 3; k++) n[k] /= sqrt(square);
}

static void random_sphere(random_numbers *random, double half, double least, double most, double sphere[4]) {
  for (int k = 0; k < 3; k++) sphere[k] = random_between(random, -half, half);
  sphere[3] = random_between(random, least, most);
}

static void assert_error(const qmat_quadric *quadric, double x, double y, double z, double r, double expected) {
  assert_near(qmat_quadric_error(quadric, (const double[4]){x, y, z, r}), expected, 1e-12 * (1 + expected));
}

static void test_zeroed_quadric_is_zero_everywhere(void **state) {
  (void)state;
  const qmat_quadric quadric = {.c = 0};
  assert_error(&quadric, 1, -2, 3, 4, 0);
}

static void test_plane_measures_how_far_a_sphere_is_from_touching_it_from_inside(void **state) {
  (void)state;
  /* The plane z = 1 above the sphere of radius 1 at the origin, n away from the sphere. */
  qmat_quadric quadric = {.c = 0};
  const double n[3] = {0, 0, 1}, m[4] = {0, 0, 0, 1};
  qmat_quadric_add_plane(&quadric, n, m, 1);
  assert_error(&quadric, 0, 0, 0, 1, 0);
  assert_error(&quadric, 7, -3, 0, 1, 0);         /* along the plane */
  assert_error(&quadric, 0, 0, -0.5, 1.5, 0);     /* a larger sphere inside that touches z = 1 */
  assert_error(&quadric, 0, 0, -0.25, 1, 0.0625); /* moved by d: d^2, to either side */
  assert_error(&quadric, 0, 0, 0.25, 1, 0.0625);
  assert_error(&quadric, 0, 0, 0, 0.75, 0.0625); /* the radius counts like a move */
  assert_error(&quadric, 0, 0, 2, 1, 4);         /* touching from outside is 2 r away */
}

static void test_weights_and_sums_are_linear(void **state) {
  (void)state;
  random_numbers random = {.seed = 1};
  for (int round = 0; round < 100; round++) {
    qmat_quadric one = {.c = 0}, other = {.c = 0}, both = {.c = 0};
    double n[3], m[4], x[4];
    unit_vector(&random, n);
    random_sphere(&random, 1, 0.1, 1, m);
    random_sphere(&random, 1, 0.1, 1, x);
    qmat_quadric_add_plane(&one, n, m, 1);
    qmat_quadric_add_plane(&both, n, m, 2.5);
    assert_near(qmat_quadric_error(&both, x), 2.5 * qmat_quadric_error(&one, x), 1e-12);
    unit_vector(&random, n);
    qmat_quadric_add_plane(&other, n, m, 0.5);
    qmat_quadric_add(&both, &other);
    assert_near(qmat_quadric_error(&both, x), 2.5 * qmat_quadric_error(&one, x) + qmat_quadric_error(&other, x), 1e-12);
  }
}

static void test_slab_of_three_equal_spheres(void **state) {
  (void)state;
  qmat_quadric quadric = {.c = 0};
  const double a[4] = {0, 0, 0, 1}, b[4] = {2, 0, 0, 1}, c[4] = {0, 3, 0, 1};
  assert_true(qmat_quadric_add_slab(&quadric, a, b, c, 1));
  assert_error(&quadric, 0, 0, 0, 1, 0);
  assert_error(&quadric, 2, 0, 0, 1, 0);
  assert_error(&quadric, 0, 3, 0, 1, 0);
  assert_error(&quadric, 5, -7, 0, 1, 0);
  /* Both planes, z = 1 and z = -1, see a sphere that is moved by d along the normal as d off. */
  assert_error(&quadric, 0.5, 0.5, 0.25, 1, 2 * 0.0625);
  assert_error(&quadric, 0.5, 0.5, -0.25, 1, 2 * 0.0625);
  assert_error(&quadric, 0.5, 0.5, 0, 0.5, 2 * 0.25);
  assert_error(&quadric, 0.5, 0.5, 0.25, 0.75, 0.25); /* touches the upper plane alone */
}

static void test_slab_of_unequal_spheres_has_leaning_planes(void **state) {
  (void)state;
  /* Radii grow by 1/4 along x: the common tangent planes have the normals (-1/4, 0, +-sqrt(15)/4). */
  qmat_quadric quadric = {.c = 0};
  const double a[4] = {0, 0, 0, 1}, b[4] = {4, 0, 0, 2}, c[4] = {0, 4, 0, 1};
  assert_true(qmat_quadric_add_slab(&quadric, a, b, c, 2));
  assert_error(&quadric, 0, 0, 0, 1, 0);
  assert_error(&quadric, 4, 0, 0, 2, 0);
  assert_error(&quadric, 0, 4, 0, 1, 0);
  random_numbers random = {.seed = 2};
  for (int round = 0; round < 100; round++) {
    double x[4], expected = 0;
    random_sphere(&random, 3, 0, 3, x);
    for (int sign = -1; sign <= 1; sign += 2) {
      const double off = -0.25 * x[0] + sign * sqrt(15) / 4 * x[2] + x[3] - 1;
      expected += 2 * off * off;
    }
    assert_near(qmat_quadric_error(&quadric, x), expected, 1e-12);
  }
}

static void test_slab_touches_its_spheres_and_all_between_them(void **state) {
  (void)state;
  random_numbers random = {.seed = 3};
  int made = 0;
  for (int round = 0; round < 1000; round++) {
    double s[3][4], x[4];
    for (int i = 0; i < 3; i++) random_sphere(&random, 1, 0.05, 0.6, s[i]);
    qmat_quadric quadric = {.c = 0}, turned = {.c = 0};
    if (!qmat_quadric_add_slab(&quadric, s[0], s[1], s[2], 1)) continue;
    made++;
    const double u = random_between(&random, -1, 2), v = random_between(&random, -1, 2);
    for (int k = 0; k < 4; k++) x[k] = (1 - u - v) * s[0][k] + u * s[1][k] + v * s[2][k];
    for (int i = 0; i < 3; i++) assert_near(qmat_quadric_error(&quadric, s[i]), 0, 1e-10);
    assert_near(qmat_quadric_error(&quadric, x), 0, 1e-9);
    /* Any order of the corners gives the same slab. */
    assert_true(qmat_quadric_add_slab(&turned, s[2], s[0], s[1], 1));
    random_sphere(&random, 1, 0, 1, x);
    assert_near(qmat_quadric_error(&turned, x), qmat_quadric_error(&quadric, x), 1e-9);
  }
  assert_true(made > 500);
}

static void assert_no_slab(const double a[4], const double b[4], const double c[4]) {
  qmat_quadric quadric = {.a = {1, 2, 3}, .b = {4}, .c = 5}, before = quadric;
  assert_false(qmat_quadric_add_slab(&quadric, a, b, c, 1));
  assert_memory_equal(&quadric, &before, sizeof before);
}

static void test_degenerate_slab_is_refused_and_adds_nothing(void **state) {
  (void)state;
  const double a[4] = {0, 0, 0, 1}, b[4] = {1, 1, 1, 1}, c[4] = {3, 3, 3, 1}, wide[4] = {0, 4, 0, 1};
  assert_no_slab(a, b, c); /* collinear */
  assert_no_slab(a, a, b);
  assert_no_slab(a, b, a);
  assert_no_slab(a, a, a);
  assert_no_slab((const double[4]){0, 0, 0, 9}, b, wide);                             /* one holds the others */
  assert_no_slab((const double[4]){0, 0, 0, 5}, (const double[4]){4, 0, 0, 1}, wide); /* touching inside: slope 1 */
  assert_no_slab((const double[4]){0, 0, 0, 1}, (const double[4]){4, 0, 0, 1}, (const double[4]){2, 0.5, 0, 0.1});
}

static void assert_no_cone(const double a[4], const double b[4]) {
  qmat_quadric quadric = {.a = {1, 2, 3}, .b = {4}, .c = 5}, before = quadric;
  assert_false(qmat_quadric_add_cone(&quadric, a, b, 1));
  assert_memory_equal(&quadric, &before, sizeof before);
}

static void test_cone_of_a_sphere_inside_another_is_refused(void **state) {
  (void)state;
  const double a[4] = {0, 0, 0, 3}, inside[4] = {1, 0, 0, 1}, touching[4] = {2, 0, 0, 1};
  assert_no_cone(a, inside);
  assert_no_cone(inside, a);
  assert_no_cone(a, touching);
  assert_no_cone(a, a);
  qmat_quadric quadric = {.c = 0};
  assert_true(qmat_quadric_add_cone(&quadric, a, (const double[4]){2.001, 0, 0, 1}, 1));
}

static void test_cone_is_the_mean_over_its_tangent_planes(void **state) {
  (void)state;
  enum { PLANES = 10000 };
  random_numbers random = {.seed = 4};
  for (int round = 0; round < 8; round++) {
    double axis[3], side[3], other[3], a[4], b[4], length = random_between(&random, 0.5, 2);
    unit_vector(&random, axis);
    random_sphere(&random, 1, 0.1, 1, a);
    for (int k = 0; k < 3; k++) b[k] = a[k] + length * axis[k];
    b[3] = round == 0 ? a[3] : a[3] * random_between(&random, 0.4, 1.4);
    if (fabs(b[3] - a[3]) >= length) b[3] = a[3];
    double along;
    do {
      unit_vector(&random, side);
      along = dot(side, axis);
    } while (fabs(along) > 0.9);
    for (int k = 0; k < 3; k++) side[k] = (side[k] - along * axis[k]) / sqrt(1 - along * along);
    for (int k = 0; k < 3; k++)
      other[k] = axis[(k + 1) % 3] * side[(k + 2) % 3] - axis[(k + 2) % 3] * side[(k + 1) % 3];
    /* A plane that touches both: n . (b - a) = a.r - b.r. */
    const double cosine = (a[3] - b[3]) / length, sine = sqrt(1 - cosine * cosine), weight = 2;
    qmat_quadric mean = {.c = 0}, cone = {.c = 0};
    for (int i = 0; i < PLANES; i++) {
      const double angle = 2 * pi * i / PLANES;
      double n[3];
      for (int k = 0; k < 3; k++) n[k] = cosine * axis[k] + sine * (cos(angle) * side[k] + sin(angle) * other[k]);
      qmat_quadric_add_plane(&mean, n, i % 2 ? a : b, weight / PLANES);
    }
    assert_true(qmat_quadric_add_cone(&cone, a, b, weight));
    for (int i = 0; i < 10; i++) assert_near(cone.a[i], mean.a[i], 1e-11);
    for (int i = 0; i < 4; i++) assert_near(cone.b[i], mean.b[i], 1e-11);
    assert_near(cone.c, mean.c, 1e-11);
    assert_near(qmat_quadric_error(&cone, a), 0, 1e-12);
    assert_near(qmat_quadric_error(&cone, b), 0, 1e-12);
  }
}

static void test_cone_of_equal_spheres_by_hand(void **state) {
  (void)state;
  /* A cylinder of radius 1 along x: a sphere moved by d across it is d^2 cos^2 off, 1/2 in the mean. */
  qmat_quadric quadric = {.c = 0};
  assert_true(qmat_quadric_add_cone(&quadric, (const double[4]){0, 0, 0, 1}, (const double[4]){2, 0, 0, 1}, 1));
  assert_error(&quadric, 9, 0, 0, 1, 0);
  assert_error(&quadric, 1, 0.5, 0, 1, 0.125);
  assert_error(&quadric, 1, 0.3, 0.4, 1, 0.125);
  assert_error(&quadric, 1, 0, 0, 1.5, 0.25);
}

static void test_minimum_is_the_sphere_that_made_the_planes(void **state) {
  (void)state;
  random_numbers random = {.seed = 5};
  for (int round = 0; round < 200; round++) {
    double m[4], x[4] = {9, 9, 9, 9};
    random_sphere(&random, 0.5, 0.01, 0.5, m);
    qmat_quadric quadric = {.c = 0};
    for (int i = 0; i < 12; i++) {
      double n[3];
      unit_vector(&random, n);
      qmat_quadric_add_plane(&quadric, n, m, random_between(&random, 0.1, 1));
    }
    assert_true(qmat_quadric_minimise(&quadric, x));
    for (int k = 0; k < 4; k++) assert_near(x[k], m[k], 1e-10);
    assert_near(qmat_quadric_error(&quadric, x), 0, 1e-12);
  }
}

static void test_minimum_of_slabs_around_a_sphere_is_that_sphere(void **state) {
  (void)state;
  random_numbers random = {.seed = 6};
  int made = 0;
  for (int round = 0; round < 200; round++) {
    double m[4], x[4];
    random_sphere(&random, 0.5, 0.2, 0.3, m);
    qmat_quadric quadric = {.c = 0};
    int slabs = 0;
    for (int i = 0; i < 4; i++) {
      double a[4], b[4];
      random_sphere(&random, 0.5, 0.2, 0.3, a);
      random_sphere(&random, 0.5, 0.2, 0.3, b);
      slabs += qmat_quadric_add_slab(&quadric, m, a, b, 1);
    }
    if (slabs < 3 || !qmat_quadric_minimise(&quadric, x)) continue;
    made++;
    for (int k = 0; k < 4; k++) assert_near(x[k], m[k], 1e-6);
  }
  assert_true(made > 100);
}

static void test_minimum_is_below_all_around_it(void **state) {
  (void)state;
  random_numbers random = {.seed = 7};
  for (int round = 0; round < 100; round++) {
    qmat_quadric quadric = {.c = 0};
    double x[4];
    for (int i = 0; i < 8; i++) { /* planes of different spheres: the least error is above 0 */
      double n[3], m[4];
      unit_vector(&random, n);
      random_sphere(&random, 0.2, 0.4, 0.5, m);
      qmat_quadric_add_plane(&quadric, n, m, 1);
    }
    if (!qmat_quadric_minimise(&quadric, x)) continue;
    const double least = qmat_quadric_error(&quadric, x);
    for (int i = 0; i < 20; i++) {
      double y[4];
      for (int k = 0; k < 4; k++) y[k] = x[k] + random_between(&random, -0.1, 0.1);
      assert_true(qmat_quadric_error(&quadric, y) >= least - 1e-13);
    }
  }
}

static void test_minimum_of_few_planes_is_refused(void **state) {
  (void)state;
  random_numbers random = {.seed = 8};
  double x[4];
  const qmat_quadric zero = {.c = 0};
  assert_false(qmat_quadric_minimise(&zero, x));
  for (int round = 0; round < 100; round++) {
    double m[4], a[4], b[4];
    random_sphere(&random, 0.5, 0.1, 0.2, m);
    qmat_quadric planes = {.c = 0};
    for (int i = 0; i < 3; i++) { /* up to three planes: four unknowns */
      double n[3];
      unit_vector(&random, n);
      qmat_quadric_add_plane(&planes, n, m, 1);
      assert_false(qmat_quadric_minimise(&planes, x));
    }
    random_sphere(&random, 0.5, 0.1, 0.2, a);
    random_sphere(&random, 0.5, 0.1, 0.2, b);
    qmat_quadric slab = {.c = 0}, cone = {.c = 0};
    if (qmat_quadric_add_slab(&slab, m, a, b, 1)) assert_false(qmat_quadric_minimise(&slab, x));
    if (qmat_quadric_add_cone(&cone, m, a, 1)) assert_false(qmat_quadric_minimise(&cone, x));
  }
}

/* Turned by 0.7 around (1, 2, 3) and moved. */
static void move_sphere(const double *from, double *to) {
  qmat_mesh point = {.vertex_count = 1, .positions = to};
  memcpy(to, from, 4 * sizeof *to);
  shape_rotate(&point);
  to[0] += 0.3, to[1] -= 0.2, to[2] += 0.1;
}

static void test_error_does_not_change_when_everything_moves(void **state) {
  (void)state;
  random_numbers random = {.seed = 9};
  for (int round = 0; round < 200; round++) {
    qmat_quadric here = {.c = 0}, there = {.c = 0};
    double s[4][4], moved[4][4];
    for (int i = 0; i < 4; i++) {
      random_sphere(&random, 0.5, 0.1, 0.3, s[i]);
      move_sphere(s[i], moved[i]);
    }
    const bool slab = qmat_quadric_add_slab(&here, s[0], s[1], s[2], 1);
    assert_int_equal(qmat_quadric_add_slab(&there, moved[0], moved[1], moved[2], 1), slab);
    const bool cone = qmat_quadric_add_cone(&here, s[0], s[1], 0.5);
    assert_int_equal(qmat_quadric_add_cone(&there, moved[0], moved[1], 0.5), cone);
    assert_near(qmat_quadric_error(&there, moved[3]), qmat_quadric_error(&here, s[3]), 1e-10);
  }
}

static void test_error_is_never_negative(void **state) {
  (void)state;
  random_numbers random = {.seed = 10};
  bool rounded = false;
  for (int round = 0; round < 2000; round++) {
    qmat_quadric quadric = {.c = 0};
    double m[4], n[3], x[4];
    random_sphere(&random, 1000, 0.001, 1, m); /* far out, where the terms cancel badly */
    for (int i = 0; i < 6; i++) {
      unit_vector(&random, n);
      qmat_quadric_add_plane(&quadric, n, m, random_between(&random, 0, 1));
    }
    const double at_minimum = qmat_quadric_error(&quadric, m);
    assert_true(at_minimum >= 0);
    rounded |= at_minimum == 0;
    random_sphere(&random, 1000, 0, 1, x);
    assert_true(qmat_quadric_error(&quadric, x) >= 0);
  }
  assert_true(rounded);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_zeroed_quadric_is_zero_everywhere),
      cmocka_unit_test(test_plane_measures_how_far_a_sphere_is_from_touching_it_from_inside),
      cmocka_unit_test(test_weights_and_sums_are_linear),
      cmocka_unit_test(test_slab_of_three_equal_spheres),
      cmocka_unit_test(test_slab_of_unequal_spheres_has_leaning_planes),
      cmocka_unit_test(test_slab_touches_its_spheres_and_all_between_them),
      cmocka_unit_test(test_degenerate_slab_is_refused_and_adds_nothing),
      cmocka_unit_test(test_cone_of_a_sphere_inside_another_is_refused),
      cmocka_unit_test(test_cone_is_the_mean_over_its_tangent_planes),
      cmocka_unit_test(test_cone_of_equal_spheres_by_hand),
      cmocka_unit_test(test_minimum_is_the_sphere_that_made_the_planes),
      cmocka_unit_test(test_minimum_of_slabs_around_a_sphere_is_that_sphere),
      cmocka_unit_test(test_minimum_is_below_all_around_it),
      cmocka_unit_test(test_minimum_of_few_planes_is_refused),
      cmocka_unit_test(test_error_does_not_change_when_everything_moves),
      cmocka_unit_test(test_error_is_never_negative),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
