/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/medial_distance.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_primitive.h"
#include "tests/medial_distances.h"
#include "tests/shapes.h"

#define EXACT 4e-13
#define COUNT(array) (sizeof(array) / sizeof(array)[0])

static uint64_t state;

static double uniform(double low, double high) {
  state = state * 6364136223846793005u + 1442695040888963407u;
  uint64_t x = state ^ (state >> 31);
  x *= 0x9e3779b97f4a7c15u;
  return low + (high - low) * (double)(x >> 11) * 0x1p-53;
}

static void point_in(double p[3], double half) {
  for (int k = 0; k < 3; k++) p[k] = uniform(-half, half);
}

static double value_at(const double *const s[3], double x, double y, const double p[3]) {
  double d2 = 0, w[3] = {1 - x - y, x, y}, r = w[0] * s[0][3] + w[1] * s[1][3] + w[2] * s[2][3];
  for (int k = 0; k < 3; k++) {
    double d = w[0] * (p[k] - s[0][k]) + w[1] * (p[k] - s[1][k]) + w[2] * (p[k] - s[2][k]);
    d2 += d * d;
  }
  return sqrt(d2) - r;
}

/* The minimum over y in [0, 1 - x], by golden section. */
static double inner_minimum(const double *const s[3], double x, const double p[3]) {
  const double g = 0.61803398874989485;
  double low = 0, high = 1 - x, a = high - g * high, b = g * high;
  double fa = value_at(s, x, a, p), fb = value_at(s, x, b, p);
  double best = fmin(fmin(value_at(s, x, 0, p), value_at(s, x, high, p)), fmin(fa, fb));
  for (int i = 0; i < 80; i++) {
    if (fa <= fb) {
      high = b, b = a, fb = fa, a = high - g * (high - low), fa = value_at(s, x, a, p);
      best = fmin(best, fa);
    } else {
      low = a, a = b, fa = fb, b = low + g * (high - low), fb = value_at(s, x, b, p);
      best = fmin(best, fb);
    }
  }
  return best;
}

/* The minimum over the triangle: a dense scan picks the bracket, golden section of the convex partial minimum does
 * the rest. */
static double brute(const double *const s[3], const double p[3]) {
  enum { STEPS = 24 };
  const double g = 0.61803398874989485;
  double best = INFINITY;
  int at = 0;
  for (int i = 0; i <= STEPS; i++) {
    double f = inner_minimum(s, i / (double)STEPS, p);
    if (f < best) best = f, at = i;
  }
  double low = fmax(at - 1, 0) / STEPS, high = fmin(at + 1, STEPS) / STEPS;
  double a = high - g * (high - low), b = low + g * (high - low);
  double fa = inner_minimum(s, a, p), fb = inner_minimum(s, b, p);
  for (int i = 0; i < 70; i++) {
    best = fmin(best, fmin(fa, fb));
    if (fa <= fb) {
      high = b, b = a, fb = fa, a = high - g * (high - low), fa = inner_minimum(s, a, p);
    } else {
      low = a, a = b, fa = fb, b = low + g * (high - low), fb = inner_minimum(s, b, p);
    }
  }
  return best;
}

static double brute_cone(const double a[4], const double b[4], const double p[3]) {
  const double *const s[3] = {a, a, b};
  return inner_minimum(s, 0, p);
}

static double brute_slab(const double a[4], const double b[4], const double c[4], const double p[3]) {
  const double *const s[3] = {a, b, c};
  return brute(s, p);
}

static void test_hand_computed_distances(void **unused) {
  (void)unused;
  const double s[4] = {1, 2, 3, 0.5};
  assert_near(qmat_sphere_distance(s, (double[3]){1, 2, 5}), 1.5, 0);
  assert_near(qmat_sphere_distance(s, (double[3]){1, 2, 3}), -0.5, 0);
  /* A cylinder of radius 1 and length 4 with round caps. */
  const double a[4] = {0, 0, 0, 1}, b[4] = {4, 0, 0, 1};
  assert_near(cone_distance(a, b, (double[3]){2, 3, 0}), 2, 0);
  assert_near(cone_distance(a, b, (double[3]){2, 0, 0}), -1, 0);
  assert_near(cone_distance(a, b, (double[3]){7, 4, 0}), 4, 0);
  /* slope 3/5: the tangent line at a has normal (-3/5, 4/5). */
  const double c[4] = {5, 0, 0, 4};
  assert_near(cone_distance(a, c, (double[3]){-0.6 + 4 * 0.8 / 2, 0.8 + 3 * 0.8 / 2, 0}), 0, 1e-15);
  assert_near(cone_distance(a, c, (double[3]){-0.6 + 1.6 - 1.2, 2 + 1.6, 0}), 2, 1e-15);
  /* A slab of equal radii is a thick plate. */
  const double d[4] = {0, 4, 0, 1};
  assert_near(slab_distance(a, b, d, (double[3]){1, 1, 3}), 2, 1e-15);
  assert_near(slab_distance(a, b, d, (double[3]){1, 1, 0.25}), -0.75, 1e-15);
  assert_near(slab_distance(a, b, d, (double[3]){-3, -4, 0}), 4, 1e-15);
  assert_near(slab_distance(a, b, d, (double[3]){5, 5, 0}), sqrt(18) - 1, 1e-15);
  /* Radii 1, 1, 3.4 over a leg of 4: gradient 0.6, tangent normal (0, -0.6, 0.8) through a. */
  const double e[4] = {0, 4, 0, 3.4};
  assert_near(slab_distance(a, b, e, (double[3]){1, 1 - 0.6 * 2.1, 0.8 * 2.1}), 0.5, 1e-14);
}

static void random_sphere(double s[4]) {
  point_in(s, 0.5);
  double x = uniform(0, 1);
  s[3] = uniform(0, 1) < 0.15 ? 0 : 0.6 * x * x;
}

static void test_cones_match_brute_force(void **unused) {
  (void)unused;
  state = 1;
  for (int i = 0; i < 20000; i++) {
    double a[4], b[4], p[3];
    random_sphere(a), random_sphere(b), point_in(p, 1);
    assert_near(cone_distance(a, b, p), brute_cone(a, b, p), EXACT);
  }
}

static void test_slabs_match_brute_force(void **unused) {
  (void)unused;
  state = 2;
  int solid = 0, planes = 0;
  for (int i = 0; i < 3000; i++) {
    double a[4], b[4], c[4], p[3];
    random_sphere(a), random_sphere(b), random_sphere(c), point_in(p, 1);
    if (i % 3 == 0) { /* near the middle of the slab, where the tangent planes hold the minimum */
      for (int k = 0; k < 3; k++) p[k] = (a[k] + b[k] + c[k]) / 3 + uniform(-0.1, 0.1);
    }
    qmat_slab slab;
    qmat_slab_prepare(&slab, a, b, c);
    double weights[3], got = qmat_slab_foot(&slab, p, weights);
    solid += slab.solid;
    planes += weights[0] > 0 && weights[1] > 0 && weights[2] > 0;
    assert_near(got, brute_slab(a, b, c, p), EXACT);
  }
  assert_true(solid > 300 && planes > 150);
}

static void test_contained_spheres_give_the_larger_sphere(void **unused) {
  (void)unused;
  state = 3;
  for (int i = 0; i < 2000; i++) {
    double a[4], b[4], c[4], p[3];
    random_sphere(a), random_sphere(b), random_sphere(c), point_in(p, 1.5);
    double reach = 0;
    for (int k = 0; k < 3; k++) reach += fabs(a[k] - b[k]) + fabs(a[k] - c[k]);
    a[3] = fmax(b[3], c[3]) + reach;
    assert_near(cone_distance(a, b, p), qmat_sphere_distance(a, p), 0);
    assert_near(cone_distance(b, a, p), qmat_sphere_distance(a, p), 0);
    assert_near(slab_distance(b, a, c, p), qmat_sphere_distance(a, p), EXACT);
  }
  /* Internally tangent spheres. */
  const double a[4] = {0, 0, 0, 1}, b[4] = {0.5, 0, 0, 0.5}, p[3] = {2, 0, 0};
  assert_near(cone_distance(a, b, p), 1, 0);
  assert_near(cone_distance(b, a, p), 1, 0);
}

static void test_coincident_centres_give_the_larger_radius(void **unused) {
  (void)unused;
  state = 4;
  for (int i = 0; i < 500; i++) {
    double a[4], b[4], c[4], p[3];
    random_sphere(a), random_sphere(c), point_in(p, 1);
    memcpy(b, a, sizeof a);
    b[3] = uniform(0, 0.5);
    const double *larger = a[3] > b[3] ? a : b;
    assert_near(cone_distance(a, b, p), qmat_sphere_distance(larger, p), 0);
    assert_near(slab_distance(a, b, c, p), cone_distance(larger, c, p), EXACT);
    assert_near(slab_distance(a, c, b, p), cone_distance(larger, c, p), EXACT);
    assert_near(slab_distance(a, b, c, p), brute_slab(a, b, c, p), EXACT);
    memcpy(c, a, sizeof a);
    assert_near(slab_distance(a, b, c, p), qmat_sphere_distance(larger, p), EXACT);
  }
}

static void test_collinear_spheres_give_the_larger_cone(void **unused) {
  (void)unused;
  state = 5;
  for (int i = 0; i < 500; i++) {
    double a[4], b[4], c[4], p[3], t = uniform(-0.5, 1.5);
    random_sphere(a), random_sphere(b), point_in(p, 1);
    for (int k = 0; k < 3; k++) c[k] = a[k] + t * (b[k] - a[k]);
    c[3] = uniform(0, 0.4);
    double cones = fmin(cone_distance(a, b, p), fmin(cone_distance(b, c, p), cone_distance(a, c, p)));
    assert_near(slab_distance(a, b, c, p), cones, EXACT);
    assert_near(slab_distance(a, b, c, p), brute_slab(a, b, c, p), EXACT);
  }
}

static void test_slivers_match_brute_force(void **unused) {
  (void)unused;
  state = 6;
  static const double heights[] = {1e-3, 1e-6, 1e-9, 1e-11, 1e-12, 1e-13, 1e-14, 1e-16};
  for (int i = 0; i < 1600; i++) {
    double a[4], b[4], c[4], p[3], t = uniform(0, 1), h = heights[(size_t)i % COUNT(heights)], q[3];
    random_sphere(a), random_sphere(b), point_in(p, 1), point_in(q, 1);
    for (int k = 0; k < 3; k++) c[k] = a[k] + t * (b[k] - a[k]) + h * q[k];
    c[3] = fmax(a[3] + t * (b[3] - a[3]) + uniform(-1, 1) * h, 0);
    if (i % 2)
      for (int k = 0; k < 3; k++) p[k] = a[k] + t * (b[k] - a[k]) + uniform(-2, 2) * h;
    assert_near(slab_distance(a, b, c, p), brute_slab(a, b, c, p), EXACT);
  }
}

static void test_steep_radii_match_brute_force(void **unused) {
  (void)unused;
  state = 7;
  /* Gradients just below, at and above 1. */
  static const double gradients[] = {0.9, 1 - 1e-6, 1 - 1e-10, 1 - 1e-14, 1, 1 + 1e-14, 1 + 1e-8, 1.5, 4};
  for (int i = 0; i < 1800; i++) {
    double angle = uniform(0, 6.3), g = gradients[(size_t)i % COUNT(gradients)], s[3][4], p[3];
    for (int j = 0; j < 3; j++) {
      s[j][0] = uniform(-0.5, 0.5), s[j][1] = uniform(-0.5, 0.5), s[j][2] = 0;
      s[j][3] = 5 + g * (s[j][0] * cos(angle) + s[j][1] * sin(angle));
    }
    point_in(p, 1);
    if (i % 2) p[2] *= 1e-3;
    assert_near(slab_distance(s[0], s[1], s[2], p), brute_slab(s[0], s[1], s[2], p), 2e-12);
  }
}

static void test_points_on_the_medial_simplex_match_brute_force(void **unused) {
  (void)unused;
  state = 8;
  for (int i = 0; i < 1000; i++) {
    double a[4], b[4], c[4], p[3], x = uniform(0, 1), y = uniform(0, 1 - x);
    random_sphere(a), random_sphere(b), random_sphere(c);
    if (i % 4 == 0) y = 0;
    if (i % 8 == 0) x = 0;
    for (int k = 0; k < 3; k++) p[k] = (1 - x - y) * a[k] + x * b[k] + y * c[k];
    assert_near(slab_distance(a, b, c, p), brute_slab(a, b, c, p), EXACT);
    for (int k = 0; k < 3; k++) p[k] = (1 - x) * a[k] + x * b[k];
    assert_near(cone_distance(a, b, p), brute_cone(a, b, p), EXACT);
  }
}

static void test_the_order_of_the_spheres_does_not_matter(void **unused) {
  (void)unused;
  state = 9;
  static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int i = 0; i < 5000; i++) {
    double s[3][4], p[3];
    for (int j = 0; j < 3; j++) random_sphere(s[j]);
    if (i % 5 == 0) memcpy(s[1], s[0], sizeof s[0]);
    point_in(p, 1);
    double cone = cone_distance(s[0], s[1], p), slab = slab_distance(s[0], s[1], s[2], p);
    assert_near(cone_distance(s[1], s[0], p), cone, EXACT);
    for (int k = 0; k < 6; k++) {
      const int *o = orders[k];
      assert_near(slab_distance(s[o[0]], s[o[1]], s[o[2]], p), slab, EXACT);
    }
  }
}

static void turn(const double m[3][3], const double in[3], double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = m[k][0] * in[0] + m[k][1] * in[1] + m[k][2] * in[2];
}

static void test_rotation_does_not_matter(void **unused) {
  (void)unused;
  state = 10;
  for (int i = 0; i < 5000; i++) {
    double q[4], n = 0, s[3][4], t[3][4], p[3], r[3];
    for (int k = 0; k < 4; k++) q[k] = uniform(-1, 1), n += q[k] * q[k];
    for (int k = 0; k < 4; k++) q[k] /= sqrt(n);
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double m[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    for (int j = 0; j < 3; j++) random_sphere(s[j]), turn(m, s[j], t[j]), t[j][3] = s[j][3];
    point_in(p, 1), turn(m, p, r);
    assert_near(cone_distance(t[0], t[1], r), cone_distance(s[0], s[1], p), EXACT);
    assert_near(slab_distance(t[0], t[1], t[2], r), slab_distance(s[0], s[1], s[2], p), EXACT);
  }
}

static void test_distances_are_1_lipschitz_and_convex(void **unused) {
  (void)unused;
  state = 11;
  for (int i = 0; i < 50000; i++) {
    double a[4], b[4], c[4], p[3], q[3], m[3], step = 0, size = i % 2 ? 1 : 1e-3;
    random_sphere(a), random_sphere(b), random_sphere(c), point_in(p, 1), point_in(q, 1);
    for (int k = 0; k < 3; k++) {
      q[k] = p[k] + size * (q[k] - p[k]);
      m[k] = 0.5 * (p[k] + q[k]);
      step += (p[k] - q[k]) * (p[k] - q[k]);
    }
    step = sqrt(step);
    double fp = slab_distance(a, b, c, p), fq = slab_distance(a, b, c, q);
    assert_true(fabs(fp - fq) <= step + EXACT);
    assert_true(slab_distance(a, b, c, m) <= 0.5 * (fp + fq) + EXACT);
    fp = cone_distance(a, b, p), fq = cone_distance(a, b, q);
    assert_true(fabs(fp - fq) <= step + EXACT);
    assert_true(cone_distance(a, b, m) <= 0.5 * (fp + fq) + EXACT);
  }
}

static void test_the_foot_attains_the_distance(void **unused) {
  (void)unused;
  state = 12;
  for (int i = 0; i < 20000; i++) {
    double s[3][4], p[3], w[3];
    for (int j = 0; j < 3; j++) random_sphere(s[j]);
    if (i % 5 == 0) memcpy(s[1], s[0], sizeof s[0]), s[1][3] = uniform(0, 0.5);
    if (i % 7 == 0) s[2][3] += 1;
    point_in(p, 1);
    const double *const corners[3] = {s[0], s[1], s[2]};
    qmat_slab slab;
    qmat_slab_prepare(&slab, s[0], s[1], s[2]);
    double f = qmat_slab_foot(&slab, p, w);
    assert_true(w[0] >= 0 && w[1] >= 0 && w[2] >= 0);
    assert_near(w[0] + w[1] + w[2], 1, 1e-14);
    assert_near(value_at(corners, w[1], w[2], p), f, EXACT);
    assert_near(qmat_slab_prepared_distance(&slab, p), f, 0);
    qmat_cone cone;
    qmat_cone_prepare(&cone, s[0], s[1]);
    f = qmat_cone_foot(&cone, p, w);
    assert_true(w[0] >= 0 && w[1] >= 0);
    assert_near(w[0] + w[1], 1, 1e-14);
    assert_near(value_at(corners, w[1], 0, p), f, EXACT);
    assert_near(qmat_cone_prepared_distance(&cone, p), f, 0);
  }
}

static void test_what_the_ball_of_a_primitive_passes_over_is_farther(void **unused) {
  (void)unused;
  state = 15;
  size_t passed = 0;
  for (int i = 0; i < 20000; i++) {
    double s[3][4], p[3], weights[3];
    qmat_primitive primitive;
    qmat_primitive_ball ball;
    for (int j = 0; j < 3; j++) random_sphere(s[j]);
    point_in(p, 2);
    qmat_primitive_prepare((const double *const[]){s[0], s[1], s[2]}, 2 + i % 2, &primitive, &ball);
    const double f = qmat_primitive_foot(&primitive, p, weights);
    assert_false(qmat_primitive_is_farther(&ball, p, f + 1e-12));
    passed += qmat_primitive_is_farther(&ball, p, 0.5 * f);
  }
  assert_true(passed > 1000);
}

static void test_small_models_keep_relative_precision(void **unused) {
  (void)unused;
  state = 13;
  for (int i = 0; i < 500; i++) {
    double s[3][4], small[3][4], p[3], q[3];
    for (int j = 0; j < 3; j++) {
      random_sphere(s[j]);
      for (int k = 0; k < 4; k++) small[j][k] = s[j][k] * 0x1p-60;
    }
    point_in(p, 1);
    for (int k = 0; k < 3; k++) q[k] = p[k] * 0x1p-60;
    /* Scaling by a power of two changes no digit. */
    assert_near(slab_distance(small[0], small[1], small[2], q) * 0x1p60, slab_distance(s[0], s[1], s[2], p), 0);
    assert_near(cone_distance(small[0], small[1], q) * 0x1p60, cone_distance(s[0], s[1], p), 0);
  }
}

static void test_a_foot_below_a_limit_is_the_foot(void **unused) {
  (void)unused;
  state = 14;
  int below = 0, above = 0;
  for (int i = 0; i < 3000; i++) {
    double a[4], b[4], c[4], p[3], weights[3], w[3];
    random_sphere(a), random_sphere(b), random_sphere(c), point_in(p, 1);
    const double *const spheres[3] = {a, b, c};
    qmat_primitive primitive;
    qmat_primitive_ball ball;
    qmat_primitive_prepare(spheres, 2 + i % 2, &primitive, &ball);
    const double f = qmat_primitive_foot(&primitive, p, weights), best = f + uniform(-0.2, 0.2);
    const double got = qmat_primitive_foot_below(&primitive, p, best, w);
    if (f < best) {
      assert_near(got, f, 0);
      assert_memory_equal(w, weights, sizeof w);
    } else {
      assert_true(got >= best - EXACT && got <= f + EXACT);
    }
    below += f < best;
    above += f >= best && got < f - 1e-6;
  }
  assert_true(below > 1000 && above > 100);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_hand_computed_distances),
      cmocka_unit_test(test_cones_match_brute_force),
      cmocka_unit_test(test_slabs_match_brute_force),
      cmocka_unit_test(test_contained_spheres_give_the_larger_sphere),
      cmocka_unit_test(test_coincident_centres_give_the_larger_radius),
      cmocka_unit_test(test_collinear_spheres_give_the_larger_cone),
      cmocka_unit_test(test_slivers_match_brute_force),
      cmocka_unit_test(test_steep_radii_match_brute_force),
      cmocka_unit_test(test_points_on_the_medial_simplex_match_brute_force),
      cmocka_unit_test(test_the_order_of_the_spheres_does_not_matter),
      cmocka_unit_test(test_rotation_does_not_matter),
      cmocka_unit_test(test_distances_are_1_lipschitz_and_convex),
      cmocka_unit_test(test_the_foot_attains_the_distance),
      cmocka_unit_test(test_what_the_ball_of_a_primitive_passes_over_is_farther),
      cmocka_unit_test(test_small_models_keep_relative_precision),
      cmocka_unit_test(test_a_foot_below_a_limit_is_the_foot),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
