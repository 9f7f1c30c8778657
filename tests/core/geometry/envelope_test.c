/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/envelope.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_distance.h"
#include "core/hash.h"
#include "tests/medial_distances.h"
#include "tests/shapes.h"

#define EXACT 1e-14
#define assert_exact(actual, expected) assert_near(actual, expected, EXACT)

enum { SPHERES = 400, EDGES = 300, TRIANGLES = 250 };

typedef struct random_medial {
  double spheres[4 * SPHERES];
  uint32_t edges[2 * EDGES], triangles[3 * TRIANGLES];
  size_t sphere_count, edge_count, triangle_count;
} random_medial;

static double number(uint64_t seed, uint64_t a, uint64_t b) {
  return qmat_hash_unit(qmat_hash3(seed, a, b));
}

static void fill_random(random_medial *m, uint64_t seed) {
  *m = (random_medial){.sphere_count = SPHERES, .edge_count = EDGES, .triangle_count = TRIANGLES};
  for (size_t i = 0; i < SPHERES; i++) {
    for (size_t k = 0; k < 3; k++) m->spheres[4 * i + k] = number(seed, i, k);
    double r = number(seed, i, 3);
    m->spheres[4 * i + 3] = i % 9 == 0 ? 0 : 0.15 * r * r * r;
  }
  /* Near ids, so that primitives stay small enough for pruning to matter; the last spheres stay isolated. */
  for (size_t i = 0; i < EDGES; i++) {
    m->edges[2 * i] = (uint32_t)(qmat_hash3(seed + 1, i, 0) % (SPHERES - 30));
    m->edges[2 * i + 1] = (uint32_t)(qmat_hash3(seed + 1, i, 1) % (SPHERES - 30));
  }
  for (size_t i = 0; i < TRIANGLES; i++) {
    for (size_t k = 0; k < 3; k++) m->triangles[3 * i + k] = (uint32_t)(qmat_hash3(seed + 2, i, k) % (SPHERES - 30));
  }
  for (size_t i = 0; i < 50; i++) memcpy(m->edges + 2 * i, m->triangles + 3 * i + i % 2, 2 * sizeof(uint32_t));
}

static double brute(const random_medial *m, const double p[3]) {
  double best = INFINITY;
  const double *s = m->spheres;
  for (size_t i = 0; i < m->sphere_count; i++) best = fmin(best, qmat_sphere_distance(s + 4 * i, p));
  for (size_t i = 0; i < m->edge_count; i++) {
    best = fmin(best, cone_distance(s + 4 * (size_t)m->edges[2 * i], s + 4 * (size_t)m->edges[2 * i + 1], p));
  }
  for (size_t i = 0; i < m->triangle_count; i++) {
    const uint32_t *t = m->triangles + 3 * i;
    best = fmin(best, slab_distance(s + 4 * (size_t)t[0], s + 4 * (size_t)t[1], s + 4 * (size_t)t[2], p));
  }
  return best;
}

static qmat_envelope *envelope_of(qmat_context *context, const random_medial *m) {
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_new(context, m->spheres, m->sphere_count, m->edges, m->edge_count, m->triangles,
                                     m->triangle_count, &envelope),
                   QMAT_OK);
  return envelope;
}

/* The weighted sphere is at the distance. Nothing is written beyond the limit. */
static void check_foot(const qmat_envelope *envelope, const random_medial *m, const double p[3], double wanted) {
  uint32_t ids[3];
  double weights[3], sphere[4] = {0}, sum = 0;
  size_t nearest, primitive;
  qmat_envelope_distance(envelope, p, &nearest);
  assert_exact(qmat_envelope_foot_within(envelope, p, wanted + 1e-9, &primitive, ids, weights), wanted);
  assert_int_equal(primitive, nearest);
  for (size_t k = 0; k < 3; k++) {
    sum += weights[k];
    if (ids[k] == UINT32_MAX) assert_true(k > 0 && weights[k] == 0);
    for (size_t j = 0; ids[k] != UINT32_MAX && j < 4; j++) sphere[j] += weights[k] * m->spheres[4 * ids[k] + j];
  }
  assert_exact(sum, 1);
  assert_exact(qmat_sphere_distance(sphere, p), wanted);
  uint32_t untouched[3] = {7, 8, 9};
  assert_true(qmat_envelope_foot_within(envelope, p, wanted - 1e-9, NULL, untouched, weights) == INFINITY);
  assert_true(untouched[0] == 7 && untouched[1] == 8 && untouched[2] == 9);
}

static void test_the_minimum_matches_brute_force(void **unused) {
  (void)unused;
  qmat_context context = {0};
  static random_medial m;
  int inside = 0;
  for (uint64_t seed = 1; seed < 6; seed++) {
    fill_random(&m, seed);
    qmat_envelope *envelope = envelope_of(&context, &m);
    for (size_t i = 0; i < 1500; i++) {
      double p[3], size = i % 3 ? 1 : 4;
      for (size_t k = 0; k < 3; k++) p[k] = 0.5 + size * (number(seed + 9, i, k) - 0.5);
      if (i % 5 == 0) memcpy(p, m.spheres + 4 * (i % SPHERES), sizeof p);
      double wanted = brute(&m, p), sphere[4];
      size_t primitive, same;
      double got = qmat_envelope_distance(envelope, p, &primitive);
      inside += got < 0;
      assert_exact(got, wanted);
      assert_true(primitive < qmat_envelope_primitive_count(envelope));
      assert_exact(qmat_envelope_nearest(envelope, p, &same, sphere), wanted);
      assert_int_equal(same, primitive);
      assert_exact(qmat_sphere_distance(sphere, p), wanted);
      uint32_t ids[3];
      int count = qmat_envelope_primitive(envelope, primitive, ids);
      const double *a = m.spheres + 4 * (size_t)ids[0];
      const double *b = m.spheres + 4 * (size_t)ids[count > 1 ? 1 : 0];
      const double *c = m.spheres + 4 * (size_t)ids[count > 2 ? 2 : 0];
      assert_exact(count == 3   ? slab_distance(a, b, c, p)
                   : count == 2 ? cone_distance(a, b, p)
                                : qmat_sphere_distance(a, p),
                   wanted);
      assert_exact(qmat_envelope_distance_within(envelope, p, got + 1e-9), wanted);
      assert_true(qmat_envelope_distance_within(envelope, p, got - 1e-9) == INFINITY);
      check_foot(envelope, &m, p, wanted);
    }
    qmat_envelope_free(envelope);
  }
  assert_true(inside > 1000);
  qmat_context_uninit(&context);
}

/* The corners of triangle `i` and its centre. */
static void random_triangle(size_t i, double corners[3][3], double centre[3]) {
  for (size_t k = 0; k < 3; k++) {
    centre[k] = 0;
    for (size_t c = 0; c < 3; c++) centre[k] += (corners[c][k] = number(5 * i + c, k, 0)) / 3;
  }
}

/* The bound belongs to the primitive nearest to the point, so that it holds at every point between the corners. */
static void test_the_bound_over_a_hull_is_the_largest_distance_of_a_corner_to_one_primitive(void **unused) {
  (void)unused;
  qmat_context context = {0};
  static random_medial m;
  fill_random(&m, 3);
  qmat_envelope *envelope = envelope_of(&context, &m);
  for (size_t i = 0; i < 500; i++) {
    double corners[3][3], p[3], bound;
    random_triangle(i, corners, p);
    assert_exact(qmat_envelope_bound(envelope, p, (const double(*)[3])corners, 3, -INFINITY, &bound), brute(&m, p));
    uint32_t ids[3];
    size_t primitive;
    qmat_envelope_distance(envelope, p, &primitive);
    const int count = qmat_envelope_primitive(envelope, primitive, ids);
    const double *s[3];
    for (int k = 0; k < 3; k++) s[k] = &m.spheres[4 * (size_t)ids[k < count ? k : 0]];
    double wanted = -INFINITY;
    for (int c = 0; c < 3; c++)
      wanted = fmax(wanted, count == 3   ? slab_distance(s[0], s[1], s[2], corners[c])
                            : count == 2 ? cone_distance(s[0], s[1], corners[c])
                                         : qmat_sphere_distance(s[0], corners[c]));
    assert_exact(bound, wanted);
    for (size_t w = 0; w < 10; w++) {
      double weights[3], sum = 0, between[3] = {0, 0, 0};
      for (size_t c = 0; c < 3; c++) sum += weights[c] = number(i, w, c);
      for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) between[k] += weights[c] / sum * corners[c][k];
      assert_true(brute(&m, between) <= bound + EXACT);
    }
  }
  qmat_envelope_free(envelope);
  qmat_context_uninit(&context);
}

/* A search that ends early has a primitive below `enough` or the nearest one; its bound holds in both cases. */
static void test_a_bound_that_is_enough_ends_the_search(void **unused) {
  (void)unused;
  qmat_context context = {0};
  static random_medial m;
  fill_random(&m, 3);
  qmat_envelope *envelope = envelope_of(&context, &m);
  size_t early = 0;
  for (size_t i = 0; i < 500; i++) {
    double corners[3][3], p[3], bound;
    random_triangle(i, corners, p);
    const double nearest = brute(&m, p), enough = nearest + 0.02 * (double)(i % 5);
    const double found = qmat_envelope_bound(envelope, p, (const double(*)[3])corners, 3, enough, &bound);
    assert_true(found >= nearest - 1e-12 && (found <= nearest + 1e-12 || found < enough));
    early += found > nearest + 1e-12;
    for (size_t c = 0; c < 3; c++) assert_true(brute(&m, corners[c]) <= bound + 1e-12);
  }
  assert_true(early > 0);
  qmat_envelope_free(envelope);
  qmat_context_uninit(&context);
}

static void test_few_spheres_match_brute_force(void **unused) {
  (void)unused;
  qmat_context context = {0};
  static random_medial m;
  for (size_t count = 1; count < 40; count++) {
    fill_random(&m, 100 + count);
    m.sphere_count = count;
    m.edge_count = m.triangle_count = 0;
    qmat_envelope *envelope = envelope_of(&context, &m);
    assert_int_equal(qmat_envelope_primitive_count(envelope), count);
    for (size_t i = 0; i < 50; i++) {
      double p[3];
      for (size_t k = 0; k < 3; k++) p[k] = 2 * number(7, i, k) - 0.5;
      assert_exact(qmat_envelope_distance(envelope, p, NULL), brute(&m, p));
    }
    qmat_envelope_free(envelope);
  }
  qmat_context_uninit(&context);
}

static void test_primitives_are_numbered_slabs_cones_spheres(void **unused) {
  (void)unused;
  qmat_context context = {0};
  double spheres[7 * 4] = {0};
  for (size_t i = 0; i < 7; i++) {
    spheres[4 * i] = (double)i;
    spheres[4 * i + 3] = 0.25;
  }
  const uint32_t edges[] = {0, 1, 4, 3, 1, 2, 0, 2, 2, 3}, triangles[] = {2, 0, 1};
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_new(&context, spheres, 7, edges, 5, triangles, 1, &envelope), QMAT_OK);
  assert_int_equal(qmat_envelope_primitive_count(envelope), 5);
  static const uint32_t wanted[5][3] = {{2, 0, 1}, {4, 3}, {2, 3}, {5}, {6}};
  static const int counts[5] = {3, 2, 2, 1, 1};
  for (size_t i = 0; i < 5; i++) {
    uint32_t ids[3];
    assert_int_equal(qmat_envelope_primitive(envelope, i, ids), counts[i]);
    assert_memory_equal(ids, wanted[i], (size_t)counts[i] * sizeof *ids);
  }
  size_t primitive;
  assert_exact(qmat_envelope_distance(envelope, (double[3]){6, 0, 0.5}, &primitive), 0.25);
  assert_int_equal(primitive, 4);
  assert_exact(qmat_envelope_distance(envelope, (double[3]){3.5, 0, 1}, &primitive), 0.75);
  assert_int_equal(primitive, 1);
  qmat_envelope_free(envelope);
  qmat_context_uninit(&context);
}

static void test_coincident_primitives_are_searched_through(void **unused) {
  (void)unused;
  qmat_context context = {0};
  enum { COUNT = 5000 };
  double *spheres = qmat_calloc(4 * COUNT, sizeof *spheres);
  for (size_t i = 0; i < COUNT; i++) spheres[4 * i + 3] = 1;
  spheres[4 * 4321 + 3] = 1.5;
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_new(&context, spheres, COUNT, NULL, 0, NULL, 0, &envelope), QMAT_OK);
  size_t primitive;
  assert_exact(qmat_envelope_distance(envelope, (double[3]){0, 0, 0}, &primitive), -1.5);
  assert_int_equal(primitive, 4321);
  assert_exact(qmat_envelope_distance(envelope, (double[3]){0, 3, 0}, NULL), 1.5);
  qmat_envelope_free(envelope);
  qmat_free(spheres);
  qmat_context_uninit(&context);
}

static void test_no_primitive_is_infinitely_far(void **unused) {
  (void)unused;
  qmat_context context = {0};
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_new(&context, NULL, 0, NULL, 0, NULL, 0, &envelope), QMAT_OK);
  double sphere[4];
  assert_int_equal(qmat_envelope_primitive_count(envelope), 0);
  assert_true(qmat_envelope_distance(envelope, (double[3]){0, 0, 0}, NULL) == INFINITY);
  assert_true(qmat_envelope_nearest(envelope, (double[3]){0, 0, 0}, NULL, sphere) == INFINITY);
  assert_true(qmat_envelope_distance_within(envelope, (double[3]){0, 0, 0}, 5) == INFINITY);
  const double corners[1][3] = {{0, 0, 0}};
  double bound;
  assert_true(qmat_envelope_bound(envelope, corners[0], corners, 1, -INFINITY, &bound) == INFINITY &&
              bound == INFINITY);
  qmat_envelope_free(envelope);
  qmat_envelope_free(NULL);
  qmat_context_uninit(&context);
}

static void test_an_id_out_of_range_is_named(void **unused) {
  (void)unused;
  qmat_context context = {0};
  const double spheres[8] = {0, 0, 0, 1, 1, 0, 0, 1};
  const uint32_t edges[] = {0, 1, 1, 2}, triangles[] = {0, 1, 9};
  qmat_envelope *envelope = (qmat_envelope *)&context;
  assert_int_equal(qmat_envelope_new(&context, spheres, 2, edges, 2, NULL, 0, &envelope), QMAT_ERROR_GEOMETRY);
  assert_null(envelope);
  assert_string_equal(context.error.element_kind, "edge");
  assert_int_equal(context.error.element, 1);
  assert_int_equal(qmat_envelope_new(&context, spheres, 2, NULL, 0, triangles, 1, &envelope), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.element_kind, "triangle");
  assert_int_equal(context.error.element, 0);
  qmat_context_uninit(&context);
}

static void test_answers_do_not_depend_on_threads(void **unused) {
  (void)unused;
  qmat_context context = {0};
  static random_medial m;
  fill_random(&m, 77);
  qmat_envelope *envelope = envelope_of(&context, &m);
  enum { POINTS = 4000 };
  static double serial[POINTS], parallel[POINTS];
  for (int pass = 0; pass < 2; pass++) {
    double *out = pass ? parallel : serial;
#pragma omp parallel for num_threads(pass ? 8 : 1) schedule(dynamic, 7)
    for (size_t i = 0; i < POINTS; i++) {
      double p[3];
      for (size_t k = 0; k < 3; k++) p[k] = number(5, i, k);
      out[i] = qmat_envelope_distance(envelope, p, NULL);
    }
  }
  assert_memory_equal(serial, parallel, sizeof serial);
  qmat_envelope_free(envelope);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_minimum_matches_brute_force),
      cmocka_unit_test(test_the_bound_over_a_hull_is_the_largest_distance_of_a_corner_to_one_primitive),
      cmocka_unit_test(test_a_bound_that_is_enough_ends_the_search),
      cmocka_unit_test(test_few_spheres_match_brute_force),
      cmocka_unit_test(test_primitives_are_numbered_slabs_cones_spheres),
      cmocka_unit_test(test_coincident_primitives_are_searched_through),
      cmocka_unit_test(test_no_primitive_is_infinitely_far),
      cmocka_unit_test(test_an_id_out_of_range_is_named),
      cmocka_unit_test(test_answers_do_not_depend_on_threads),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
