/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/hash.h"
#include "nodes/initial/sample_thinning.h"
#include "tests/nodes/pipeline.h"

enum { MOST = 4000 };

typedef struct cloud {
  size_t count;
  double points[3 * MOST], normals[3 * MOST], radii[MOST];
  uint32_t representatives[MOST];
} cloud;

static void add(cloud *c, double x, double y, double z, double nx, double ny, double nz, double radius) {
  const size_t i = c->count++;
  assert_true(i < MOST);
  c->points[3 * i] = x, c->points[3 * i + 1] = y, c->points[3 * i + 2] = z;
  c->normals[3 * i] = nx, c->normals[3 * i + 1] = ny, c->normals[3 * i + 2] = nz;
  c->radii[i] = radius;
}

static void thin(cloud *c, double largest, double tolerance) {
  qmat_context context = {0};
  assert_int_equal(
      qmat_samples_thin(&context, c->points, c->normals, c->radii, c->count, largest, tolerance, c->representatives),
      QMAT_OK);
  qmat_context_uninit(&context);
}

static void test_earlier_samples_stand_for_later_ones_within_their_radius(void **state) {
  (void)state;
  cloud c = {0};
  add(&c, 0, 0, 0, 0, 0, 1, 0.1);
  add(&c, 0.05, 0, 0, 0, 0, 1, 0.1);  /* near the first */
  add(&c, 0.11, 0, 0, 0, 0, 1, 0.1);  /* near the second only, which is left out */
  add(&c, 0.05, 0, 0, 0, 0, 1, 0.04); /* its own radius counts: nothing kept is so near */
  add(&c, -0.1, 0, 0, 0, 0, 1, 0.1);  /* not nearer than the radius */
  thin(&c, 0.1, 0.01);
  const uint32_t expected[] = {0, 0, 2, 3, 4};
  for (size_t i = 0; i < c.count; i++) assert_int_equal(c.representatives[i], expected[i]);
}

static void test_other_sides_and_other_planes_are_kept(void **state) {
  (void)state;
  cloud c = {0};
  add(&c, 0, 0, 0, 0, 0, 1, 0.1);
  add(&c, 0, 0, -0.001, 0, 0, -1, 0.1);   /* the other side of a sheet */
  add(&c, 0.01, 0, 0, 1, 0, 0, 0.1);      /* around a crease */
  add(&c, 0.02, 0, 0.012, 0, 0, 1, 0.1);  /* a step */
  add(&c, 0.02, 0, -0.008, 0, 0, 1, 0.1); /* within the tolerance */
  add(&c, 0.03, 0, 0, 0, 0, 0, 0.1);      /* without a normal */
  add(&c, 0.03, 0, 0, 0, 0, 0, 0.1);
  thin(&c, 0.1, 0.01);
  const uint32_t expected[] = {0, 1, 2, 3, 0, 5, 6};
  for (size_t i = 0; i < c.count; i++) assert_int_equal(c.representatives[i], expected[i]);
}

static double component(const cloud *c, size_t a, size_t b, const double *along) {
  double sum = 0;
  for (size_t k = 0; k < 3; k++) sum += (c->points[3 * a + k] - c->points[3 * b + k]) * along[k];
  return sum;
}

/* The rule of the header. */
static bool may_represent(const cloud *c, size_t kept, size_t i, double tolerance) {
  double square = 0, cosine = 0;
  for (size_t k = 0; k < 3; k++) {
    square += pow(c->points[3 * i + k] - c->points[3 * kept + k], 2);
    cosine += c->normals[3 * i + k] * c->normals[3 * kept + k];
  }
  return sqrt(square) < c->radii[i] && cosine >= 0.7 && fabs(component(c, i, kept, &c->normals[3 * i])) <= tolerance &&
         fabs(component(c, i, kept, &c->normals[3 * kept])) <= tolerance;
}

static void test_random_samples_agree_with_brute_force(void **state) {
  (void)state;
  /* On two spheres that meet, on either side of the origin and at all levels of the grid. */
  static cloud c;
  c.count = 0;
  for (uint64_t i = 0; i < MOST; i++) {
    double n[3], length = 0;
    for (uint64_t k = 0; k < 3; k++) {
      n[k] = qmat_hash_unit(qmat_hash3(1, i, k)) - 0.5;
      length += n[k] * n[k];
    }
    length = sqrt(length);
    const double x = i % 2 ? 0.1 : -0.1, r = 0.3;
    const double radius = 0.1 * pow(2, -12 * qmat_hash_unit(qmat_hash3(1, i, 3)));
    add(&c, x + r * n[0] / length, r * n[1] / length, r * n[2] / length, n[0] / length, n[1] / length, n[2] / length,
        radius);
  }
  thin(&c, 0.1, 0.004);
  size_t kept = 0;
  for (size_t i = 0; i < c.count; i++) {
    const uint32_t other = c.representatives[i];
    bool told = false;
    for (size_t j = 0; j < i && !told; j++) told = c.representatives[j] == j && may_represent(&c, j, i, 0.004);
    assert_int_equal(told, other != i);
    kept += other == i;
    if (other == i) continue;
    assert_true(other < i && c.representatives[other] == other);
    assert_true(may_represent(&c, other, i, 0.004));
  }
  assert_true(kept > MOST / 10 && kept < 9 * MOST / 10);
}

static void test_nothing_takes_no_sample(void **state) {
  (void)state;
  cloud c = {0};
  thin(&c, 0.1, 0.01);
}

/* Samples of a line, for three calls of the progress function; it is obeyed at each. */
static void test_a_run_is_cancelled_at_any_call(void **state) {
  (void)state;
  enum { COUNT = 150000 };
  double *points = calloc(COUNT, 3 * sizeof *points), *normals = calloc(COUNT, 3 * sizeof *normals);
  double *radii = malloc(COUNT * sizeof *radii);
  uint32_t *representatives = malloc(COUNT * sizeof *representatives);
  assert_true(points && normals && radii && representatives);
  for (size_t i = 0; i < COUNT; i++) points[3 * i] = (double)i / COUNT, normals[3 * i + 2] = 1, radii[i] = 0.5 / COUNT;
  for (size_t stop_at = 0; stop_at <= 3; stop_at++) {
    qmat_context context = {.progress = pipeline_may_go_on};
    pipeline_stopper stopper = {.context = &context, .stop_at = stop_at};
    context.progress_user = &stopper;
    assert_int_equal(
        qmat_samples_thin(&context, points, normals, radii, COUNT, 0.5 / COUNT, 0.5 / COUNT, representatives),
        stop_at < 3 ? QMAT_CANCELLED : QMAT_OK);
    assert_int_equal(stopper.calls, stop_at < 3 ? stop_at + 1 : 3);
    qmat_context_uninit(&context);
  }
  free(points);
  free(normals);
  free(radii);
  free(representatives);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_earlier_samples_stand_for_later_ones_within_their_radius),
      cmocka_unit_test(test_other_sides_and_other_planes_are_kept),
      cmocka_unit_test(test_random_samples_agree_with_brute_force),
      cmocka_unit_test(test_nothing_takes_no_sample),
      cmocka_unit_test(test_a_run_is_cancelled_at_any_call),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
