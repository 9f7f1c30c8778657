/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/crease_guard.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/envelope.h"
#include "core/geometry/medial_build.h"
#include "tests/nodes/pipeline.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))
#define ROUNDING 1e-9

/* ---- by hand ---- */

/* A medial mesh of these spheres and edges as a complex with its guard. */
typedef struct {
  qmat_context context;
  qmat_medial *medial;
  qmat_complex complex;
  qmat_quadric *quadrics;
  qmat_crease_guard guard;
  qmat_collapse collapse;
} guarded;

static void guarded_init(guarded *g, const double *spheres, size_t count, const uint32_t *edges, size_t edge_count) {
  *g = (guarded){.medial = qmat_medial_new()};
  g->medial->sphere_count = count;
  g->medial->spheres = qmat_alloc(count, 4 * sizeof(double));
  memcpy(g->medial->spheres, spheres, 4 * count * sizeof(double));
  assert_int_equal(qmat_medial_set_simplices(&g->context, g->medial, edges, edge_count, NULL, 0), QMAT_OK);
  assert_int_equal(qmat_complex_init(&g->context, &g->complex, g->medial, NULL), QMAT_OK);
  g->quadrics = qmat_calloc(count, sizeof *g->quadrics);
  assert_int_equal(qmat_crease_guard_init(&g->context, &g->complex, 0, &g->guard), QMAT_OK);
}

static void guarded_uninit(guarded *g) {
  qmat_collapse_uninit(&g->collapse);
  qmat_complex_uninit(&g->complex);
  qmat_value_release(&g->medial->base);
  qmat_free(g->quadrics);
  qmat_context_uninit(&g->context);
}

static qmat_candidates restrict_edge(const guarded *g, uint32_t a, uint32_t b, double held, bool *bound,
                                     double *asked) {
  qmat_candidates c = {.count = 0};
  const uint32_t edge = qmat_complex_find_edge(&g->complex, a, b);
  assert_int_not_equal(edge, QMAT_NONE);
  *bound = qmat_crease_guard_restrict(&g->guard, &g->complex, g->quadrics, edge, held, &c, asked);
  return c;
}

/* Whether the edge may become the sphere of each end, `a` first. */
static void check_edge(const guarded *g, uint32_t a, uint32_t b, double held, bool to_a, bool to_b, double wanted) {
  bool bound;
  double asked;
  const qmat_candidates c = restrict_edge(g, a, b, held, &bound, &asked);
  assert_true(bound);
  assert_int_equal(c.count, to_a + to_b);
  for (int i = 0; i < c.count; i++) {
    const bool is_a = memcmp(c.spheres[i], &g->complex.spheres[4 * (size_t)a], sizeof c.spheres[i]) == 0;
    assert_true(is_a ? to_a : to_b);
  }
  assert_near(asked, wanted, ROUNDING);
}

static void collapse_to(guarded *g, uint32_t a, uint32_t b, uint32_t end) {
  double sphere[4];
  memcpy(sphere, &g->complex.spheres[4 * (size_t)end], sizeof sphere);
  const uint32_t edge = qmat_complex_find_edge(&g->complex, a, b);
  assert_int_equal(qmat_complex_preview(&g->context, &g->complex, edge, &g->collapse), QMAT_OK);
  qmat_crease_guard_commit(&g->guard, &g->complex, &g->collapse, sphere);
  assert_int_equal(qmat_complex_collapse(&g->context, &g->complex, &g->collapse, sphere), QMAT_OK);
}

/* A crease 0 1 2 3 from corner to corner with a bump of 0.1 at 1, and inner spheres 4, 5, 6 below it. */
static const double crease_spheres[] = {0, 0, 0, 0,  1, 0.1, 0, 0,  2, 0,   0, 0,  3, 0,
                                        0, 0, 1, -1, 0, 0.5, 2, -1, 0, 0.5, 3, -1, 0, 0.5};
static const uint32_t crease_edges[] = {0, 1, 1, 2, 2, 3, 0, 4, 1, 4, 2, 5, 3, 6, 4, 5, 5, 6};

static void test_a_crease_keeps_its_corners_and_bumps(void **state) {
  (void)state;
  guarded g;
  guarded_init(&g, crease_spheres, 7, crease_edges, COUNT(crease_edges) / 2);
  assert_int_equal(g.guard.left, 4);
  assert_near(qmat_crease_guard_error(&g.guard), 0, 0);
  bool bound;
  double asked;
  restrict_edge(&g, 4, 5, 1, &bound, &asked);
  assert_false(bound);
  check_edge(&g, 1, 4, 0.01, true, false, INFINITY); /* an inner sphere goes into a feature, whatever is held */
  /* 1 lies 0.1 above the line from 0 to 2, and 2 this much below that from 1 to 3. */
  const double below = 0.05 / sqrt(1.0025);
  check_edge(&g, 0, 1, 0.09, false, false, 0.1);
  check_edge(&g, 0, 1, 0.11, true, false, INFINITY); /* the corner stays */
  check_edge(&g, 1, 2, 0.04, false, false, below);
  check_edge(&g, 1, 2, 0.06, true, false, 0.1);
  check_edge(&g, 1, 2, 0.11, true, true, INFINITY);
  check_edge(&g, 2, 3, below + ROUNDING, false, true, INFINITY);
  guarded_uninit(&g);
}

static void test_the_last_inner_sphere_stays(void **state) {
  (void)state;
  guarded g;
  guarded_init(&g, crease_spheres, 7, crease_edges, COUNT(crease_edges) / 2);
  collapse_to(&g, 1, 4, 1);
  collapse_to(&g, 2, 5, 2);
  const uint32_t corner = g.complex.vertex_alive[3] ? 3 : 6;
  assert_int_equal(g.complex.live_vertices, g.guard.left + 1);
  check_edge(&g, corner, 9 - corner, 1, false, false, INFINITY);
  guarded_uninit(&g);
}

static void test_points_that_are_gone_still_count(void **state) {
  (void)state;
  guarded g;
  guarded_init(&g, crease_spheres, 7, crease_edges, COUNT(crease_edges) / 2);
  collapse_to(&g, 1, 4, 1); /* the inner sphere's number may stay; the feature is the same */
  collapse_to(&g, 1, 2, 1);
  const uint32_t left = g.complex.vertex_alive[1] ? 1 : 2;
  assert_int_equal(g.guard.left, 3);
  assert_near(qmat_crease_guard_error(&g.guard), 0.05 / sqrt(1.0025), ROUNDING);
  check_edge(&g, 0, left, 0.09, false, false, 0.1);
  collapse_to(&g, 0, left, 0);
  assert_int_equal(g.guard.left, 2);
  assert_near(qmat_crease_guard_error(&g.guard), 0.1, ROUNDING);
  const uint32_t first = g.complex.vertex_alive[0] ? 0 : left;
  check_edge(&g, first, 3, INFINITY, false, false, INFINITY); /* two corners */
  guarded_uninit(&g);
}

static void test_neighbours_on_different_creases_stay_apart(void **state) {
  (void)state;
  /* Two creases of three, and inner spheres 6 and 7 at the middles, which go into these. */
  static const double spheres[] = {0, 0, 0, 0, 1, 0, 0, 0, 2, 0,   0, 0,   0, 1,   0, 0,
                                   1, 1, 0, 0, 2, 1, 0, 0, 1, 0.3, 0, 0.1, 1, 0.7, 0, 0.1};
  static const uint32_t edges[] = {0, 1, 1, 2, 3, 4, 4, 5, 1, 6, 6, 7, 7, 4};
  guarded g;
  guarded_init(&g, spheres, 8, edges, COUNT(edges) / 2);
  collapse_to(&g, 1, 6, 1);
  const uint32_t low = g.complex.vertex_alive[1] ? 1 : 6;
  collapse_to(&g, 7, 4, 4);
  const uint32_t high = g.complex.vertex_alive[4] ? 4 : 7;
  check_edge(&g, low, high, INFINITY, false, false, INFINITY);
  guarded_uninit(&g);
}

static void test_a_loop_keeps_three_points(void **state) {
  (void)state;
  enum { AROUND = 12 };
  double spheres[4 * AROUND] = {0};
  uint32_t edges[2 * AROUND];
  for (uint32_t i = 0; i < AROUND; i++) {
    spheres[4 * i] = cos(2 * 3.14159265358979323846 * i / AROUND);
    spheres[4 * i + 1] = sin(2 * 3.14159265358979323846 * i / AROUND);
    edges[2 * i] = i;
    edges[2 * i + 1] = (i + 1) % AROUND;
  }
  guarded g;
  guarded_init(&g, spheres, AROUND, edges, AROUND);
  assert_int_equal(g.guard.creases.count, 1);
  for (bool any = true; any;) {
    any = false;
    for (uint32_t e = 0; e < g.complex.edge_count && !any; e++) {
      if (!g.complex.edge_alive[e]) continue;
      const uint32_t *ends = &g.complex.edges[2 * (size_t)e];
      bool bound;
      double asked;
      const qmat_candidates c = restrict_edge(&g, ends[0], ends[1], INFINITY, &bound, &asked);
      if (c.count == 0) continue;
      const bool first = memcmp(c.spheres[0], &g.complex.spheres[4 * (size_t)ends[0]], sizeof c.spheres[0]) == 0;
      collapse_to(&g, ends[0], ends[1], first ? ends[0] : ends[1]);
      any = true;
    }
  }
  assert_int_equal(g.guard.left, 3);
  assert_int_equal(g.complex.live_vertices, 3);
  assert_in_range((int)(1e6 * qmat_crease_guard_error(&g.guard)), 500000, 1900000);
  guarded_uninit(&g);
}

static void test_new_numbers_keep_the_features(void **state) {
  (void)state;
  guarded g;
  guarded_init(&g, crease_spheres, 7, crease_edges, COUNT(crease_edges) / 2);
  collapse_to(&g, 1, 2, 1);
  uint32_t ids[7], next = 0;
  for (uint32_t v = 0; v < 7; v++) ids[v] = g.complex.vertex_alive[v] ? next++ : QMAT_NONE;
  qmat_crease_guard other;
  assert_int_equal(qmat_crease_guard_renumber(&g.context, &g.guard, ids, next + 2, &other), QMAT_OK);
  assert_int_equal(other.left, 3);
  for (uint32_t v = 0; v < 7; v++)
    if (ids[v] != QMAT_NONE)
      assert_int_equal(qmat_crease_guard_is_feature(&other, ids[v]), qmat_crease_guard_is_feature(&g.guard, v));
  for (uint32_t v = next; v < next + 2; v++) assert_false(qmat_crease_guard_is_feature(&other, v));
  assert_near(qmat_crease_guard_error(&other), qmat_crease_guard_error(&g.guard), 0);
  guarded_uninit(&g);
}

static void test_without_spheres_of_radius_zero_nothing_is_guarded(void **state) {
  (void)state;
  static const double spheres[] = {0, 0, 0, 1, 1, 0, 0, 1e-300};
  static const uint32_t edges[] = {0, 1};
  guarded g;
  guarded_init(&g, spheres, 2, edges, 1);
  bool bound;
  double asked;
  restrict_edge(&g, 0, 1, 1, &bound, &asked);
  assert_false(bound);
  assert_int_equal(g.guard.left, 0);
  guarded_uninit(&g);
}

/* ---- medial.simplify ---- */

typedef struct {
  pipeline p;
  qmat_medial *initial, *simple;
  qmat_report *report;
} sharp;

/* Takes the mesh over. */
static sharp make_sharp(qmat_mesh *mesh, const char *features, const char *simplify, int threads) {
  sharp s;
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_make(&s.p, mesh, "spacing=25% n_f=0", "");
  pipeline_must_run(threads, "medial.features", features, (const qmat_value *[]){&s.p.mesh->base, &s.p.medial->base},
                    outputs);
  s.initial = (qmat_medial *)outputs[0];
  qmat_value_release(outputs[1]);
  pipeline_must_run(threads, "medial.simplify", simplify,
                    (const qmat_value *[]){&s.p.mesh->base, &s.p.thickness->base, &s.p.samples->base, &s.initial->base},
                    outputs);
  s.simple = (qmat_medial *)outputs[0];
  s.report = (qmat_report *)outputs[1];
  return s;
}

static void release(sharp *s) {
  qmat_value_release(&s->initial->base);
  qmat_value_release(&s->simple->base);
  qmat_value_release(&s->report->base);
  pipeline_free(&s->p);
}

static double to_segment(const double *p, const double *a, const double *b) {
  double along = 0, square = 0, rest = 0;
  for (int k = 0; k < 3; k++) along += (p[k] - a[k]) * (b[k] - a[k]), square += (b[k] - a[k]) * (b[k] - a[k]);
  const double t = fmin(fmax(along / square, 0), 1);
  for (int k = 0; k < 3; k++) rest += pow(p[k] - a[k] - t * (b[k] - a[k]), 2);
  return sqrt(rest);
}

/* In diagonals. */
typedef struct {
  double to_cones;        /* from the creases to the cones between features that are left */
  double outside, buried; /* of the envelope */
} crease_errors;

/* At the features of the initial medial mesh. */
static crease_errors measure(const sharp *s, const qmat_medial *features) {
  qmat_context context = {0};
  qmat_envelope *envelope;
  const qmat_medial *m = s->simple;
  const double diagonal = pipeline_diagonal(s->p.mesh);
  crease_errors errors = {0, 0, 0};
  assert_int_equal(qmat_envelope_of_medial(&context, m, &envelope), QMAT_OK);
  for (size_t i = 0; i < features->sphere_count; i++) {
    const double *p = &features->spheres[4 * i];
    if (p[3] > 0) continue;
    double least = INFINITY;
    for (size_t e = 0; e < m->edge_count; e++) {
      const double *a = &m->spheres[4 * (size_t)m->edges[2 * e]], *b = &m->spheres[4 * (size_t)m->edges[2 * e + 1]];
      if (a[3] == 0 && b[3] == 0) least = fmin(least, to_segment(p, a, b));
    }
    const double distance = qmat_envelope_distance(envelope, p, NULL) / diagonal;
    errors.to_cones = fmax(errors.to_cones, least / diagonal);
    errors.outside = fmax(errors.outside, distance);
    errors.buried = fmax(errors.buried, -distance);
  }
  qmat_envelope_free(envelope);
  qmat_context_uninit(&context);
  return errors;
}

static void check_exact(const sharp *s) {
  const crease_errors e = measure(s, s->initial);
  assert_near(e.to_cones, 0, ROUNDING);
  assert_near(e.outside, 0, ROUNDING);
  assert_near(e.buried, 0, ROUNDING);
}

static void test_a_box_becomes_its_corners_and_its_middle_exactly(void **state) {
  (void)state;
  sharp s = make_sharp(shape_box(3, 2, 1), "spacing=5%", "epsilon=4%", 0);
  assert_int_equal(pipeline_features(s.simple), 8);
  for (size_t i = 0; i < s.simple->sphere_count; i++) {
    const double *c = &s.simple->spheres[4 * i];
    if (c[3] > 0) continue;
    const double extents[3] = {3, 2, 1};
    for (int k = 0; k < 3; k++) assert_near(fmin(c[k], extents[k] - c[k]), 0, ROUNDING);
  }
  check_exact(&s);
  assert_in_range(s.simple->sphere_count, 10, 14);
  assert_int_equal(pipeline_euler(s.simple), 1);
  assert_int_equal(pipeline_count(s.report, "features"), 8);
  release(&s);
}

static void test_a_turned_bracket_keeps_its_convex_edges_alone(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_l();
  shape_rotate(mesh);
  pipeline_shuffle(mesh);
  sharp s = make_sharp(mesh, "spacing=5%", "epsilon=4%", 0);
  check_exact(&s);
  assert_int_equal(pipeline_features(s.simple), 12);
  assert_int_equal(pipeline_euler(s.simple), 1);
  release(&s);
}

static void test_round_creases_are_thinned_to_what_is_asked(void **state) {
  (void)state;
  static const double shares[] = {1, 0.25};
  size_t before = 0;
  for (size_t i = 0; i < COUNT(shares); i++) {
    char params[64];
    snprintf(params, sizeof params, "epsilon=4%% crease=%g", shares[i]);
    sharp s = make_sharp(shape_prism(12, 0.5), "", params, 0);
    const double to_cones = measure(&s, s.initial).to_cones;
    assert_true(to_cones <= shares[i] * 0.04);
    assert_near(pipeline_number(s.report, "crease_error"), to_cones, ROUNDING);
    const size_t left = pipeline_features(s.simple);
    assert_int_equal(pipeline_count(s.report, "features"), left);
    assert_true(left >= 6 && left > before && left < pipeline_features(s.initial));
    before = left;
    release(&s);
  }
}

static void test_a_thin_plate_keeps_a_sphere_that_has_a_skin(void **state) {
  (void)state;
  sharp s = make_sharp(shape_box(1, 1, 1e-4), "spacing=100%", "epsilon=4%", 0);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  assert_int_equal(pipeline_features(s.simple), 8);
  assert_true(s.simple->sphere_count > 8);
  pipeline_must_run(0, "medial.skin", "", (const qmat_value *[]){&s.simple->base, NULL}, outputs);
  for (size_t i = 0; i < qmat_output_count(qmat_node_find("medial.skin")); i++) qmat_value_release(outputs[i]);
  release(&s);
}

static void test_edges_are_rounded_off_without_features(void **state) {
  (void)state;
  sharp with = make_sharp(shape_prism(12, 0.5), "", "epsilon=4%", 0);
  sharp without = make_sharp(shape_prism(12, 0.5), "features=none", "epsilon=4%", 0);
  const double kept = measure(&with, with.initial).outside, lost = measure(&without, with.initial).outside;
  assert_true(kept <= 0.25 * 0.04 + ROUNDING);
  assert_true(lost > 2 * kept);
  assert_int_equal(pipeline_features(without.simple), 0);
  release(&with);
  release(&without);
}

static void test_features_stay_at_any_level_and_number(void **state) {
  (void)state;
  static const char *const params[] = {"epsilon=4% finest=4% on_exceed=raise", "epsilon=4% finest=4% on_exceed=stop",
                                       "epsilon=0 vertices=10", "epsilon=4% protect=always",
                                       "epsilon=4% error=one_sided"};
  for (size_t i = 0; i < COUNT(params); i++) {
    sharp s = make_sharp(shape_box(3, 2, 1), "spacing=10%", params[i], 0);
    assert_true(pipeline_features(s.simple) >= 8);
    assert_near(measure(&s, s.initial).to_cones, 0, ROUNDING);
    release(&s);
  }
}

static void test_the_number_of_threads_does_not_matter(void **state) {
  (void)state;
  static const int threads[] = {2, 8};
  sharp s = make_sharp(shape_prism(12, 0.5), "", "epsilon=4%", 1);
  for (size_t i = 0; i < COUNT(threads); i++) {
    sharp other = make_sharp(shape_prism(12, 0.5), "", "epsilon=4%", threads[i]);
    assert_memory_equal(&other.simple->base.digest, &s.simple->base.digest, sizeof s.simple->base.digest);
    assert_memory_equal(&other.report->base.digest, &s.report->base.digest, sizeof s.report->base.digest);
    release(&other);
  }
  release(&s);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_crease_keeps_its_corners_and_bumps),
      cmocka_unit_test(test_the_last_inner_sphere_stays),
      cmocka_unit_test(test_points_that_are_gone_still_count),
      cmocka_unit_test(test_neighbours_on_different_creases_stay_apart),
      cmocka_unit_test(test_a_loop_keeps_three_points),
      cmocka_unit_test(test_new_numbers_keep_the_features),
      cmocka_unit_test(test_without_spheres_of_radius_zero_nothing_is_guarded),
      cmocka_unit_test(test_a_box_becomes_its_corners_and_its_middle_exactly),
      cmocka_unit_test(test_a_turned_bracket_keeps_its_convex_edges_alone),
      cmocka_unit_test(test_round_creases_are_thinned_to_what_is_asked),
      cmocka_unit_test(test_a_thin_plate_keeps_a_sphere_that_has_a_skin),
      cmocka_unit_test(test_edges_are_rounded_off_without_features),
      cmocka_unit_test(test_features_stay_at_any_level_and_number),
      cmocka_unit_test(test_the_number_of_threads_does_not_matter),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
