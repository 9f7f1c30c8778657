/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/neighbourhood_fit.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "tests/medial_distances.h"

/* A chain of three spheres on the x-axis inside the capsule of radius 1 from x = 0 to 4, whose surface is sampled. The
 * edge between the first two is to collapse; the third sphere is wrong. */
enum { SPHERES = 3, RINGS = 25, POINTS = 4 * RINGS };

typedef struct {
  qmat_context context;
  qmat_complex complex;
  qmat_surface_to_envelope surface_tracker;
  qmat_collapse collapse;
  qmat_neighbourhood_fit fit;
  double points[3 * POINTS], limits[POINTS], weights[3 * POINTS];
  uint32_t witnesses[3 * POINTS];
} chain;

static const double third[4] = {3.6, 0.1, 0, 0.8}, merged[4] = {0.4, 0, 0.1, 0.9};

/* The capsule's outline from one tip to the other. */
static void outline(int i, double *x, double *radius) {
  const double t = (double)i / (RINGS - 1), quarter = acos(0), length = 2 * quarter + 4;
  const double s = t * length;
  *x = s < quarter ? -cos(s) : s < quarter + 4 ? s - quarter : 4 + sin(s - quarter - 4);
  *radius = s < quarter ? sin(s) : s < quarter + 4 ? 1 : cos(s - quarter - 4);
}

static void make_chain(chain *c, int spheres) {
  *c = (chain){.context = {.threads = 1}};
  static const double all[4 * SPHERES] = {0, 0, 0, 1, 1, 0, 0, 1, 3.6, 0.1, 0, 0.8};
  static const uint32_t edges[4] = {0, 1, 1, 2};
  qmat_medial *medial = qmat_medial_new();
  medial->sphere_count = (size_t)spheres;
  medial->spheres = qmat_alloc((size_t)spheres, 4 * sizeof(double));
  memcpy(medial->spheres, all, (size_t)spheres * 4 * sizeof(double));
  assert_int_equal(qmat_medial_set_simplices(&c->context, medial, edges, (size_t)spheres - 1, NULL, 0), QMAT_OK);
  assert_int_equal(qmat_complex_init(&c->context, &c->complex, medial, NULL), QMAT_OK);
  qmat_value_release(&medial->base);
  for (int i = 0; i < POINTS; i++) {
    double x, radius;
    outline(i / 4, &x, &radius);
    const double angle = acos(0) * (i % 4);
    c->points[3 * i] = x;
    c->points[3 * i + 1] = radius * cos(angle);
    c->points[3 * i + 2] = radius * sin(angle);
    c->limits[i] = 0.05;
    c->weights[3 * i] = 1;
    c->witnesses[3 * i] = x < 0.5 ? 0 : x < 2 || spheres < 3 ? 1 : 2;
    c->witnesses[3 * i + 1] = c->witnesses[3 * i + 2] = QMAT_NONE;
  }
  assert_int_equal(qmat_surface_to_envelope_init(&c->context, &c->surface_tracker, POINTS, c->points, c->limits,
                                                 c->witnesses, c->weights, (size_t)spheres),
                   QMAT_OK);
  const uint32_t edge = qmat_complex_find_edge(&c->complex, 0, 1);
  assert_int_equal(qmat_complex_preview(&c->context, &c->complex, edge, &c->collapse), QMAT_OK);
}

static void free_chain(chain *c) {
  qmat_neighbourhood_fit_uninit(&c->fit);
  qmat_collapse_uninit(&c->collapse);
  qmat_surface_to_envelope_uninit(&c->surface_tracker);
  qmat_complex_uninit(&c->complex);
  qmat_context_uninit(&c->context);
}

static double fit(chain *c, size_t others) {
  static const uint32_t neighbour = 2;
  double error;
  const qmat_fit_request request = {merged, &neighbour, others, POINTS, 0.05};
  assert_int_equal(
      qmat_neighbourhood_fit_start(&c->context, &c->fit, &c->surface_tracker, &c->complex, &c->collapse, &request),
      QMAT_OK);
  qmat_neighbourhood_fit_run(&c->fit, &c->complex, false, &error);
  return error;
}

/* Repeats the fit, which comes nearer each time. */
static double fit_closely(chain *c) {
  double error = fit(c, 1);
  for (int i = 0; i < 3; i++) qmat_neighbourhood_fit_run(&c->fit, &c->complex, false, &error);
  return error;
}

static void test_two_spheres_fit_a_capsule_which_one_does_not(void **state) {
  (void)state;
  chain c;
  make_chain(&c, SPHERES);
  assert_true(fit(&c, 0) > 0.05); /* the wrong sphere stays */
  assert_true(fit_closely(&c) < 1e-3);
  static const double expected[2][4] = {{0, 0, 0, 1}, {4, 0, 0, 1}};
  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 4; k++) assert_true(fabs(c.fit.spheres[i][k] - expected[i][k]) < 1e-2);
  /* The complex has not changed. */
  for (int k = 0; k < 4; k++) assert_true(c.complex.spheres[8 + k] == third[k]);
  free_chain(&c);
}

static void test_places_get_what_is_asked_of_them(void **state) {
  (void)state;
  chain c;
  make_chain(&c, SPHERES);
  fit_closely(&c);
  /* F is 0.02 here, beside the capsule; it has to be 0. */
  static const double beside[3] = {2, 1.02, 0};
  double error, before;
  assert_int_equal(qmat_neighbourhood_fit_add(&c.context, &c.fit, beside, QMAT_TARGET_INSIDE, 0), QMAT_OK);
  qmat_neighbourhood_fit_run(&c.fit, &c.complex, false, &error);
  assert_true(error <= c.fit.threshold);
  assert_true(cone_distance(c.fit.spheres[0], c.fit.spheres[1], beside) <= 0);
  free_chain(&c);

  make_chain(&c, SPHERES);
  fit_closely(&c);
  /* F is -0.06 here, inside the capsule; it has to be -0.05 at least. */
  static const double border[3] = {2, 0, 0.94};
  before = cone_distance(c.fit.spheres[0], c.fit.spheres[1], border);
  assert_true(before < -0.055);
  assert_int_equal(qmat_neighbourhood_fit_add(&c.context, &c.fit, border, QMAT_TARGET_BORDER, 0.05), QMAT_OK);
  qmat_neighbourhood_fit_run(&c.fit, &c.complex, false, &error);
  assert_true(error <= c.fit.threshold);
  assert_true(cone_distance(c.fit.spheres[0], c.fit.spheres[1], border) >= -0.05);
  free_chain(&c);
}

static void test_again_is_no_worse(void **state) {
  (void)state;
  chain c;
  make_chain(&c, SPHERES);
  const double first = fit(&c, 1);
  double second;
  qmat_neighbourhood_fit_run(&c.fit, &c.complex, true, &second);
  assert_true(second <= first);
  free_chain(&c);
}

static void test_a_collapse_to_a_lone_sphere_is_left(void **state) {
  (void)state;
  chain c;
  make_chain(&c, 2);
  assert_true(fit(&c, 0) == INFINITY);
  assert_memory_equal(c.fit.spheres[0], merged, sizeof merged);
  free_chain(&c);
}

static void test_a_fit_starts_anew_each_time(void **state) {
  (void)state;
  chain c;
  make_chain(&c, SPHERES);
  const double first = fit(&c, 1);
  assert_true(fit(&c, 1) == first);
  assert_int_equal(c.fit.count, 2);
  free_chain(&c);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_two_spheres_fit_a_capsule_which_one_does_not),
      cmocka_unit_test(test_places_get_what_is_asked_of_them),
      cmocka_unit_test(test_again_is_no_worse),
      cmocka_unit_test(test_a_collapse_to_a_lone_sphere_is_left),
      cmocka_unit_test(test_a_fit_starts_anew_each_time),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
