/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/constraint_points.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/medial_distance.h"
#include "nodes/measure/interior_points.h"
#include "tests/medial_distances.h"
#include "tests/nodes/pipeline.h"

#define ROUNDING 1e-12

/* A model with its initial medial mesh, in the unit frame. */
typedef struct {
  pipeline p;
  qmat_context context;
  qmat_complex complex;
  double *positions, *unit_samples;
} model;

static void make_model(model *m, qmat_mesh *mesh, const char *sample_params) {
  *m = (model){.positions = NULL};
  pipeline_make(&m->p, mesh, sample_params, "");
  qmat_frame frame;
  assert_int_equal(qmat_frame_of_mesh(&m->context, m->p.mesh, &frame), QMAT_OK);
  double *spheres = qmat_alloc(m->p.medial->sphere_count, 4 * sizeof *spheres);
  m->positions = qmat_alloc(m->p.mesh->vertex_count, 3 * sizeof(double));
  m->unit_samples = qmat_alloc(m->p.samples->count, 3 * sizeof(double));
  assert_true(spheres && m->positions && m->unit_samples);
  qmat_frame_spheres_to_unit(&frame, m->p.medial->spheres, m->p.medial->sphere_count, spheres);
  qmat_frame_to_unit(&frame, m->p.mesh->positions, m->p.mesh->vertex_count, m->positions);
  qmat_frame_to_unit(&frame, m->p.samples->positions, m->p.samples->count, m->unit_samples);
  assert_int_equal(qmat_complex_init(&m->context, &m->complex, m->p.medial, spheres), QMAT_OK);
  qmat_free(spheres);
}

static void free_model(model *m) {
  qmat_free(m->positions);
  qmat_free(m->unit_samples);
  qmat_complex_uninit(&m->complex);
  qmat_context_uninit(&m->context);
  pipeline_free(&m->p);
}

/* F, by a look at every primitive. */
static double brute_force(const qmat_complex *c, const double point[3]) {
  double best = INFINITY;
  const double *s = c->spheres;
  for (size_t v = 0; v < c->vertex_count; v++) best = fmin(best, qmat_sphere_distance(&s[4 * v], point));
  for (size_t e = 0; e < c->edge_count; e++)
    best = fmin(best, cone_distance(&s[4 * (size_t)c->edges[2 * e]], &s[4 * (size_t)c->edges[2 * e + 1]], point));
  for (size_t t = 0; t < c->triangle_count; t++) {
    const uint32_t *ids = &c->triangles[3 * t];
    best = fmin(best, slab_distance(&s[4 * (size_t)ids[0]], &s[4 * (size_t)ids[1]], &s[4 * (size_t)ids[2]], point));
  }
  return best;
}

/* The distance to the medial sphere that the witness of point i names. */
static double at_witness(const qmat_complex *c, const qmat_constraint_points *places, size_t i) {
  double sphere[4] = {0};
  for (size_t k = 0; k < 3; k++) {
    const uint32_t v = places->witnesses[3 * i + k];
    for (size_t j = 0; v != QMAT_NONE && j < 4; j++)
      sphere[j] += places->weights[3 * i + k] * c->spheres[4 * (size_t)v + j];
  }
  return qmat_sphere_distance(sphere, &places->points[3 * i]);
}

static void make_places(model *m, double spacing, double enough, qmat_constraint_points *places) {
  const qmat_place_request request = {m->p.mesh, m->positions, m->p.samples, m->unit_samples, spacing, 20000, enough};
  assert_int_equal(qmat_surface_places_make(&m->context, &request, m->p.medial, &m->complex, places), QMAT_OK);
}

/* Checks the distances of all places. Returns how many are above `enough`. */
static size_t check_places(model *m, double spacing, double enough) {
  qmat_constraint_points places;
  make_places(m, spacing, enough, &places);
  size_t far_count = 0;
  for (size_t i = 0; i < places.count; i++) {
    const double f = brute_force(&m->complex, &places.points[3 * i]), found = places.distances[i];
    far_count += found > enough;
    if (found < f - ROUNDING) fail_msg("place %zu is %g from the envelope, not %g", i, f, found);
    if (found > enough && found > f + ROUNDING) fail_msg("far place %zu is %g from the envelope, not %g", i, f, found);
    assert_true(fabs(at_witness(&m->complex, &places, i) - found) < ROUNDING);
  }
  return far_count;
}

/* Samples are too coarse for the envelope to come near everywhere. */
static void test_far_places_have_their_distance_and_others_an_upper_bound(void **state) {
  (void)state;
  model m;
  make_model(&m, pipeline_model("torus", 6), "spacing=0 n_f=0");
  const size_t many = check_places(&m, 0.05, 1e-3);
  assert_true(many > 100);
  double enough = 1e-3;
  size_t few = many;
  for (; few > 32; enough *= 1.3) few = check_places(&m, 0.05, enough); /* looks at every sphere for the last few */
  assert_true(few > 0);
  assert_int_equal(check_places(&m, 0.05, 1), 0);
  free_model(&m);
}

/* The corners of a box are far from most places on its sides. */
static void test_places_on_large_facets_are_measured(void **state) {
  (void)state;
  model m;
  make_model(&m, shape_box(1, 2, 3), "spacing=20% n_f=0");
  assert_true(check_places(&m, 0.03, 1e-3) > 0);
  free_model(&m);
}

/* Each of the twelve facets has sides of 0.577 and 0.816 and a height of 0.408. With a spacing of 0.03 the rows are
 * 0.075 apart, with 0.2 they are not. */
static void test_places_inside_large_facets_are_farther_apart_than_on_sides(void **state) {
  (void)state;
  const struct {
    double spacing;
    size_t on_sides, on_diagonals, in_rows;
  } cases[] = {{0.03, 19, 27, 9 + 7 + 5 + 3 + 1}, {0.2, 2, 4, 2 + 1}};
  model m;
  make_model(&m, shape_box(2, 2, 2), "spacing=20% n_f=0");
  for (size_t i = 0; i < 2; i++) {
    qmat_constraint_points places;
    make_places(&m, cases[i].spacing, 1, &places);
    assert_int_equal(places.count - places.sample_count,
                     12 * cases[i].on_sides + 6 * cases[i].on_diagonals + 12 * cases[i].in_rows);
  }
  free_model(&m);
}

static void make_constraints(model *m, double epsilon, qmat_constraint_points *constraints) {
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&m->context, m->p.mesh, &surface), QMAT_OK);
  assert_int_equal(qmat_constraint_points_make(&m->context, surface, m->p.samples, m->p.medial, &m->complex, epsilon,
                                               QMAT_MOST_CONSTRAINT_POINTS, false, constraints),
                   QMAT_OK);
  qmat_surface_free(surface);
}

/* The sides of a cylinder of 400 sides are much narrower than the error. */
static void test_points_on_narrow_facets_are_thinned_out(void **state) {
  (void)state;
  model m;
  make_model(&m, shape_prism(400, 2), "spacing=20% n_f=0");
  const double epsilon = 0.05;
  qmat_constraint_points c;
  make_constraints(&m, epsilon, &c);
  const size_t samples = m.p.samples->count;
  assert_int_equal(c.sample_count, samples);
  assert_true(c.sample_point_count < samples / 3);
  assert_true(c.surface_count < 4 * samples);
  for (size_t i = 0; i < samples; i++) {
    const size_t point = qmat_point_of_sample(&c, i);
    assert_true(point < c.sample_point_count);
    /* It lies in the same cube. */
    const double *own = &m.unit_samples[3 * i], *other = &c.points[3 * point];
    assert_true(sqrt(pow(own[0] - other[0], 2) + pow(own[1] - other[1], 2) + pow(own[2] - other[2], 2)) <=
                0.3 * sqrt(3) * epsilon + ROUNDING);
  }
  for (size_t i = 0; i < c.sample_point_count; i++) {
    const uint32_t sample = c.point_samples[i];
    assert_int_equal(qmat_point_of_sample(&c, sample), i);
    assert_memory_equal(&c.points[3 * i], &m.unit_samples[3 * (size_t)sample], 3 * sizeof(double));
  }
  for (size_t i = 0; i < c.surface_count; i++)
    assert_true(fabs(at_witness(&m.complex, &c, i) - c.distances[i]) < ROUNDING);
  free_model(&m);
}

static void test_other_points_stay(void **state) {
  (void)state;
  model m;
  make_model(&m, shape_box(1, 2, 3), "spacing=20% n_f=0");
  qmat_constraint_points c;
  make_constraints(&m, 0.05, &c);
  assert_null(c.sample_points);
  assert_int_equal(c.sample_point_count, m.p.samples->count);
  assert_int_equal(qmat_point_of_sample(&c, 5), 5);
  free_model(&m);
}

/* A small error would ask for a shell of millions of points. */
static void test_a_shell_has_at_most_some_times_the_points_allowed(void **state) {
  (void)state;
  model m;
  make_model(&m, shape_box(1, 2, 3), "spacing=5% n_f=0");
  const double epsilon = 0.01;
  size_t last = 0;
  for (size_t most = 100; most <= 1000; most *= 10) {
    qmat_surface *surface;
    qmat_constraint_points c;
    qmat_interior_points inner;
    assert_int_equal(qmat_surface_new(&m.context, m.p.mesh, &surface), QMAT_OK);
    assert_int_equal(
        qmat_constraint_points_make(&m.context, surface, m.p.samples, m.p.medial, &m.complex, epsilon, most, true, &c),
        QMAT_OK);
    assert_int_equal(qmat_interior_points_find(&m.context, &m.complex, epsilon, &inner), QMAT_OK);
    const size_t shell = c.count - c.surface_count - inner.count;
    if (!(shell > last && shell <= 4 * most + m.p.mesh->triangle_count))
      fail_msg("%zu points in the shell, of at most %zu", shell, 4 * most);
    last = shell;
    qmat_surface_free(surface);
  }
  free_model(&m);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_far_places_have_their_distance_and_others_an_upper_bound),
      cmocka_unit_test(test_places_on_large_facets_are_measured),
      cmocka_unit_test(test_places_inside_large_facets_are_farther_apart_than_on_sides),
      cmocka_unit_test(test_points_on_narrow_facets_are_thinned_out),
      cmocka_unit_test(test_other_points_stay),
      cmocka_unit_test(test_a_shell_has_at_most_some_times_the_points_allowed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
