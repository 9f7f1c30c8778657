/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/collapse_cost.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "nodes/simplify/medial_quadrics.h"
#include "tests/medial_distances.h"
#include "tests/random.h"
#include "tests/shapes.h"

#define ROUNDING 1e-12

static void test_slab_cost_is_equation_6(void **state) {
  (void)state;
  static const double a[] = {0, 0, 0, 1}, equal[] = {2, 0, 0, 1}, leaning[] = {0, 4, 0, 3},
                      inside[] = {0, 0, 0.5, 0.25};
  assert_near(qmat_slab_cost(0.25, 1e-5, a, equal), 0.25001, ROUNDING);     /* stability ratio 1 */
  assert_near(qmat_slab_cost(0.25, 1e-5, a, leaning), 0.0625025, ROUNDING); /* (4 - 2) / 4 */
  assert_near(qmat_slab_cost(0.25, 1e-5, a, inside), 0, 0);
  assert_near(qmat_slab_cost(0.25, 1e-5, a, a), 0, 0);
}

static void test_pmat_cost_is_the_length_over_the_difference_of_radii(void **state) {
  (void)state;
  static const double a[] = {0, 0, 0, 1}, b[] = {3, 0, 0, 2}, equal[] = {3, 0, 0, 1}, inside[] = {0, 0.5, 0, 3};
  assert_near(qmat_pmat_cost(a, b), 3, ROUNDING);
  assert_near(qmat_pmat_cost(b, a), 3, ROUNDING);
  assert_near(qmat_pmat_cost(a, inside), 0.25, ROUNDING);
  assert_true(isinf(qmat_pmat_cost(a, equal)));
  assert_near(qmat_pmat_cost(a, a), 0, 0);
}

/* --- candidates and quadrics -------------------------------------------------------------------------------------- */

typedef struct fixture {
  qmat_context context;
  qmat_complex complex;
  qmat_quadric *quadrics;
} fixture;

static void make(fixture *f, const double *spheres, size_t sphere_count, const uint32_t *edges, size_t edge_count,
                 const uint32_t *triangles, size_t triangle_count) {
  *f = (fixture){.context = {.threads = 1}};
  qmat_medial *medial = qmat_medial_new();
  medial->sphere_count = sphere_count;
  medial->spheres = memcpy(qmat_alloc(sphere_count, 4 * sizeof(double)), spheres, 4 * sphere_count * sizeof(double));
  assert_int_equal(qmat_medial_set_simplices(&f->context, medial, edges, edge_count, triangles, triangle_count),
                   QMAT_OK);
  assert_int_equal(qmat_complex_init(&f->context, &f->complex, medial, NULL), QMAT_OK);
  qmat_value_release(&medial->base);
  f->quadrics = qmat_calloc(sphere_count, sizeof *f->quadrics);
}

static void tear_down(fixture *f) {
  qmat_free(f->quadrics);
  qmat_complex_uninit(&f->complex);
  qmat_context_uninit(&f->context);
}

static void test_the_larger_end_is_kept_and_the_first_of_equals(void **state) {
  (void)state;
  static const double spheres[] = {0, 0, 0, 1, 3, 0, 0, 2, 3, 3, 0, 2};
  static const uint32_t edges[] = {0, 1, 1, 2};
  fixture f;
  qmat_candidates c;
  make(&f, spheres, 3, edges, 2, NULL, 0);
  qmat_candidates_find_larger(&f.complex, f.quadrics, qmat_complex_find_edge(&f.complex, 0, 1), &c);
  assert_int_equal(c.count, 1);
  assert_memory_equal(c.spheres[0], &spheres[4], 4 * sizeof(double));
  qmat_candidates_find_larger(&f.complex, f.quadrics, qmat_complex_find_edge(&f.complex, 1, 2), &c);
  assert_memory_equal(c.spheres[0], &spheres[4], 4 * sizeof(double));
  tear_down(&f);
}

/* Four tangent planes of a sphere about `centre`, one of them with the opposite sign of another. */
static void hold_sphere(qmat_quadric *q, const double sphere[4]) {
  static const double normals[4][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < 4; i++) qmat_quadric_add_plane(q, normals[i], sphere, 1);
}

static void test_published_candidates_are_the_optimum_or_the_middle(void **state) {
  (void)state;
  static const double spheres[] = {0, 0, 0, 0.1, 0.2, 0, 0, 0.3, 0.2, 0.2, 0, 0.1};
  static const uint32_t edges[] = {0, 1}, slab[] = {0, 1, 2};
  static const double optimum[] = {0.1, 0.25, -0.5, 0.05}, cavity[] = {0.1, 0.25, -0.5, -0.05};
  static const double far_away[] = {0.1, 5, 0, 0.05}, middle[] = {0.1, 0, 0, 0.2};
  fixture f;
  qmat_candidates c;
  make(&f, spheres, 3, edges, 1, NULL, 0);
  const uint32_t edge = qmat_complex_find_edge(&f.complex, 0, 1);
  const struct { const double *held, *expected; } cases[] = {{optimum, optimum}, {cavity, middle}, {far_away, middle}};
  for (size_t i = 0; i < 3; i++) {
    memset(f.quadrics, 0, 3 * sizeof *f.quadrics);
    hold_sphere(&f.quadrics[1], cases[i].held);
    qmat_candidates_find_published(&f.complex, f.quadrics, edge, &c);
    assert_int_equal(c.count, 1);
    for (int k = 0; k < 4; k++) assert_near(c.spheres[0][k], cases[i].expected[k], 1e-9);
  }
  /* Planes across x alone leave it open where the sphere is: an edge without slabs takes the middle all the same. */
  memset(f.quadrics, 0, 3 * sizeof *f.quadrics);
  qmat_quadric_add_plane(&f.quadrics[0], (double[]){1, 0, 0}, &spheres[4], 1);
  qmat_candidates_find_published(&f.complex, f.quadrics, edge, &c);
  for (int k = 0; k < 4; k++) assert_near(c.spheres[0][k], middle[k], ROUNDING);
  tear_down(&f);
  make(&f, spheres, 3, NULL, 0, slab, 1);
  qmat_quadric_add_plane(&f.quadrics[0], (double[]){1, 0, 0}, &spheres[4], 1);
  qmat_candidates_find_published(&f.complex, f.quadrics, qmat_complex_find_edge(&f.complex, 0, 1), &c);
  assert_int_equal(c.count, 1);
  assert_memory_equal(c.spheres[0], &spheres[4], 4 * sizeof(double)); /* error 0 */
  tear_down(&f);
}

static void test_published_quadrics_by_hand(void **state) {
  (void)state;
  /* An edge of length 2 in its own direction, off the origin so that its virtual sphere is not on it. */
  static const double spheres[] = {1, 1, 0, 0.5, 3, 1, 0, 0.5};
  static const uint32_t edges[] = {0, 1};
  fixture f;
  make(&f, spheres, 2, edges, 1, NULL, 0);
  qmat_medial_quadrics_add_published(&f.complex, f.quadrics);
  for (int e = 0; e < 2; e++) assert_near(qmat_quadric_error(&f.quadrics[e], &spheres[4 * e]), 0, ROUNDING);
  /* Along the axis only the tip's plane counts, 0.1 * 0.1 times the square of 2 d. */
  assert_near(qmat_quadric_error(&f.quadrics[1], (double[]){3.25, 1, 0, 0.5}), 0.01 * 0.25, ROUNDING);
  /* The third sphere lies in the plane z = 0, so the tangent normals are +-z; those across are 2 long, along +-y. */
  assert_near(qmat_quadric_error(&f.quadrics[0], (double[]){1, 1, 0.125, 0.5}), 2 * 0.125 * 0.125, ROUNDING);
  assert_near(qmat_quadric_error(&f.quadrics[0], (double[]){1, 1.125, 0, 0.5}), 2 * 0.25 * 0.25, ROUNDING);
  assert_near(qmat_quadric_error(&f.quadrics[0], (double[]){1, 1, 0, 0.75}), (4 + 0.01) * 0.25 * 0.25, ROUNDING);
  tear_down(&f);
  /* A slab: two planes at each corner, and at its three rims planes that stand on it, as long as the rims. */
  static const double corners[] = {0, 0, 0, 0.5, 4, 0, 0, 0.5, 0, 3, 0, 0.5};
  static const uint32_t slab[] = {0, 1, 2};
  make(&f, corners, 3, NULL, 0, slab, 1);
  qmat_medial_quadrics_add_published(&f.complex, f.quadrics);
  for (int e = 0; e < 3; e++) assert_near(qmat_quadric_error(&f.quadrics[e], &corners[4 * e]), 0, ROUNDING);
  assert_near(qmat_quadric_error(&f.quadrics[0], (double[]){0, 0, 0.5, 0.5}), 2 * 0.25, ROUNDING);
  assert_near(qmat_quadric_error(&f.quadrics[0], (double[]){-1, 0, 0, 0.5}), 0.01 * 9, ROUNDING);
  assert_near(qmat_quadric_error(&f.quadrics[0], (double[]){0, -1, 0, 0.5}), 0.01 * 16, ROUNDING);
  tear_down(&f);
}

/* --- the Hausdorff cost ------------------------------------------------------------------------------------------- */

enum { SPHERES = 6, POINTS = 40 };

/* F to all that is left when `removed` becomes `kept`, with `sphere` there. */
static double distance_after(const fixture *f, uint32_t kept, uint32_t removed, const double *sphere,
                             const double *point) {
  double least = INFINITY;
  const double *at[3];
  for (size_t t = 0; t < f->complex.triangle_count; t++) {
    for (size_t k = 0; k < 3; k++) {
      const uint32_t v = f->complex.triangles[3 * t + k];
      at[k] = v == kept || v == removed ? sphere : &f->complex.spheres[4 * (size_t)v];
    }
    least = fmin(least, slab_distance(at[0], at[1], at[2], point));
  }
  for (size_t e = 0; e < f->complex.edge_count; e++) {
    for (size_t k = 0; k < 2; k++) {
      const uint32_t v = f->complex.edges[2 * e + k];
      at[k] = v == kept || v == removed ? sphere : &f->complex.spheres[4 * (size_t)v];
    }
    least = fmin(least, cone_distance(at[0], at[1], point));
  }
  return least;
}

/* Two slabs on the edge 0 1, one beside, and a cone: every simplex touches the edge or its link. */
static void test_hausdorff_cost_is_the_largest_distance_of_all_points_that_the_ends_answer_for(void **state) {
  (void)state;
  static const uint32_t triangles[] = {0, 1, 2, 0, 1, 3, 1, 3, 4}, edges[] = {4, 5};
  random_numbers random = {.seed = 1};
  for (int round = 0; round < 200; round++) {
    double spheres[4 * SPHERES], points[3 * POINTS], limits[POINTS], weights[3 * POINTS] = {0};
    uint32_t witnesses[3 * POINTS];
    for (int i = 0; i < 4 * SPHERES; i++)
      spheres[i] = i % 4 == 3 ? random_between(&random, 0.05, 0.4) : random_between(&random, -1, 1);
    fixture f;
    make(&f, spheres, SPHERES, edges, 1, triangles, 3);
    for (size_t i = 0; i < POINTS; i++) {
      for (size_t k = 0; k < 3; k++) points[3 * i + k] = random_between(&random, -1.5, 1.5);
      limits[i] = 0;
      witnesses[3 * i] = (uint32_t)(i % SPHERES);
      witnesses[3 * i + 1] = witnesses[3 * i + 2] = QMAT_NONE;
      weights[3 * i] = 1;
    }
    qmat_surface_to_envelope surface_tracker;
    qmat_collapse collapse = {0};
    qmat_candidates c;
    assert_int_equal(qmat_surface_to_envelope_init(&f.context, &surface_tracker, POINTS, points, limits, witnesses,
                                                   weights, SPHERES),
                     QMAT_OK);
    const uint32_t edge = qmat_complex_find_edge(&f.complex, 0, 1);
    assert_int_equal(qmat_complex_preview(&f.context, &f.complex, edge, &collapse), QMAT_OK);
    const size_t counted = POINTS - 10;
    assert_int_equal(qmat_hausdorff_candidates(&f.context, &surface_tracker, &f.complex, &collapse, counted, &c),
                     QMAT_OK);
    assert_int_equal(c.count, 1);
    double best = INFINITY, of_candidate = -INFINITY;
    for (size_t e = 0; e < 2; e++) {
      double largest = -INFINITY;
      for (size_t i = 0; i < counted; i++)
        if (witnesses[3 * i] <= 1) largest = fmax(largest, distance_after(&f, 0, 1, &spheres[4 * e], &points[3 * i]));
      best = fmin(best, largest);
      if (memcmp(c.spheres[0], &spheres[4 * e], sizeof c.spheres[0]) == 0) of_candidate = largest;
    }
    assert_near(c.errors[0], best, 1e-9);
    assert_near(of_candidate, best, 1e-9);
    qmat_collapse_uninit(&collapse);
    qmat_surface_to_envelope_uninit(&surface_tracker);
    tear_down(&f);
  }
}

static void test_an_edge_without_points_keeps_its_larger_end_and_costs_least(void **state) {
  (void)state;
  static const double spheres[] = {0, 0, 0, 1, 3, 0, 0, 2};
  static const uint32_t edges[] = {0, 1};
  fixture f;
  qmat_surface_to_envelope surface_tracker;
  qmat_collapse collapse = {0};
  qmat_candidates c;
  make(&f, spheres, 2, edges, 1, NULL, 0);
  assert_int_equal(qmat_surface_to_envelope_init(&f.context, &surface_tracker, 0, NULL, NULL, NULL, NULL, 2), QMAT_OK);
  assert_int_equal(qmat_complex_preview(&f.context, &f.complex, 0, &collapse), QMAT_OK);
  assert_int_equal(qmat_hausdorff_candidates(&f.context, &surface_tracker, &f.complex, &collapse, 0, &c), QMAT_OK);
  assert_memory_equal(c.spheres[0], &spheres[4], 4 * sizeof(double));
  assert_true(c.errors[0] == -INFINITY);
  qmat_collapse_uninit(&collapse);
  qmat_surface_to_envelope_uninit(&surface_tracker);
  tear_down(&f);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_slab_cost_is_equation_6),
      cmocka_unit_test(test_pmat_cost_is_the_length_over_the_difference_of_radii),
      cmocka_unit_test(test_the_larger_end_is_kept_and_the_first_of_equals),
      cmocka_unit_test(test_published_candidates_are_the_optimum_or_the_middle),
      cmocka_unit_test(test_published_quadrics_by_hand),
      cmocka_unit_test(test_hausdorff_cost_is_the_largest_distance_of_all_points_that_the_ends_answer_for),
      cmocka_unit_test(test_an_edge_without_points_keeps_its_larger_end_and_costs_least),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
