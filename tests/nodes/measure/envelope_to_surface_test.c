/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/envelope_to_surface.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/vector.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"
#include "tests/random_collapse.h"

#define ROUNDING 1e-9

/* The largest h = r - depth over a dense grid of a primitive, and how far its points are from each other at most. */
static double sampled(const qmat_surface *surface, const double *const spheres[], int count, int steps, double *gap) {
  double most = -INFINITY, longest = 0;
  for (int i = 0; i < count; i++)
    for (int j = 0; j < i; j++) longest = fmax(longest, qmat_point_distance(spheres[i], spheres[j]));
  *gap = longest / steps;
  for (int i = 0; i <= (count > 1 ? steps : 0); i++)
    for (int j = 0; j <= (count > 2 ? steps - i : 0); j++) {
      double sphere[4];
      const double w[3] = {1 - (double)(i + j) / steps, (double)i / steps, (double)j / steps};
      for (int k = 0; k < 4; k++) {
        sphere[k] = 0;
        for (int c = 0; c < count; c++) sphere[k] += w[c] * spheres[c][k];
      }
      most = fmax(most, sphere[3] + qmat_surface_signed_distance(surface, sphere));
    }
  return most;
}

/* --- one primitive ------------------------------------------------------------------------------------------------ */

typedef struct {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
} solid;

static void make_solid(solid *s, qmat_mesh *mesh) {
  *s = (solid){.mesh = mesh->base.sealed ? mesh : shape_seal(mesh)};
  assert_int_equal(qmat_surface_new(&s->context, s->mesh, &s->surface), QMAT_OK);
}

static void free_solid(solid *s) {
  qmat_surface_free(s->surface);
  qmat_value_release(&s->mesh->base);
  qmat_context_uninit(&s->context);
}

static void test_spheres_in_a_cube_by_hand(void **state) {
  (void)state;
  solid s;
  make_solid(&s, shape_box(1, 1, 1));
  /* In the unit frame the cube's half side is 1 / sqrt(12). */
  const double half = 1 / sqrt(12.0);
  assert_near(qmat_envelope_to_surface_of_sphere(s.surface, (const double[4]){0, 0, 0, half}), 0, 1e-12);
  assert_near(qmat_envelope_to_surface_of_sphere(s.surface, (const double[4]){0, 0, 0, half + 0.1}), 0.1, 1e-12);
  assert_near(qmat_envelope_to_surface_of_sphere(s.surface, (const double[4]){0.1, 0, 0, half}), 0.1, 1e-12);
  assert_near(qmat_envelope_to_surface_of_sphere(s.surface, (const double[4]){half + 0.2, 0, 0, 0.1}), 0.3, 1e-12);
  const double sphere[4] = {0, 0.05, 0, half}, *const one[1] = {sphere};
  assert_near(qmat_envelope_to_surface_bound(s.surface, one, 1, -INFINITY, 1e-6), 0.05, 1e-12);
  free_solid(&s);
}

static void test_bound_between_the_corners_of_an_l_by_hand(void **state) {
  (void)state;
  /* From one arm of the L straight to the other: the middle of the way is outside, by 1 / sqrt(2) of the inner corner
   * at its farthest. */
  solid s;
  make_solid(&s, shape_l());
  const double scale = 1 / qmat_surface_frame(s.surface)->diagonal;
  double a[4] = {1.5, 0.5, 0.5, 0}, b[4] = {0.5, 1.5, 0.5, 0};
  double touching[4] = {1, 1, 0.5, 0.25};
  qmat_frame_spheres_to_unit(qmat_surface_frame(s.surface), a, 1, a);
  qmat_frame_spheres_to_unit(qmat_surface_frame(s.surface), b, 1, b);
  qmat_frame_spheres_to_unit(qmat_surface_frame(s.surface), touching, 1, touching);
  const double *const cone[2] = {a, b};
  /* The way runs through the inner corner itself: h is 0 there, negative elsewhere. */
  assert_near(qmat_envelope_to_surface_bound(s.surface, cone, 2, -INFINITY, 1e-6), 0, 1e-6);
  assert_near(qmat_envelope_to_surface_of_sphere(s.surface, touching), 0.25 * scale, 1e-12);
  for (int k = 0; k < 2; k++) a[k] += 0.25 * scale, b[k] += 0.25 * scale; /* half way out: through (1.25, 1.25) */
  assert_near(qmat_envelope_to_surface_bound(s.surface, cone, 2, -INFINITY, 1e-6), 0.25 * scale, 1e-6);
  free_solid(&s);
}

static void place_square(double u, double v, double point[3]) {
  point[0] = 3 * u, point[1] = 2 * v, point[2] = 0.5;
}

/* The largest bounds of a slab that touches all of the surface over and under it. Pieces as small as the tolerance
 * would be thousands of millions. Where it runs over many facets of a thick sheet, the tolerance may grow. */
static void test_a_slab_that_touches_flat_surface_all_over_takes_few_pieces(void **state) {
  (void)state;
  qmat_mesh *square = shape_new(), *facets = shape_new();
  shape_add_sheet(square, 1, 1, place_square);
  shape_add_sheet(facets, 40, 30, place_square);
  square->sheet_thickness = facets->sheet_thickness = 1;
  qmat_mesh *const meshes[] = {shape_box(3, 2, 1), square, facets};
  static const double slacks[] = {1e-5, 1e-5, 0.01};
  static const size_t patiences[] = {0, 0, 16384};
  for (int i = 0; i < 3; i++) {
    solid s;
    make_solid(&s, meshes[i]);
    double corners[3][4] = {{0.5, 0.5, 0.5, 0.5}, {2.5, 0.5, 0.5, 0.5}, {1.5, 1.5, 0.5, 0.5}};
    const double *const slab[3] = {corners[0], corners[1], corners[2]};
    qmat_frame_spheres_to_unit(qmat_surface_frame(s.surface), corners[0], 3, corners[0]);
    for (int raised = 0; raised < 2; raised++) {
      const double most = 0.02 * raised;
      corners[2][3] += most;
      const double bound = qmat_envelope_to_surface_bound_soon(s.surface, slab, 3, -INFINITY, 1e-5, patiences[i]);
      if (!(bound >= most - ROUNDING && bound <= most + slacks[i]))
        fail_msg("surface %d: %.9g, not %g", i, bound, most);
    }
    free_solid(&s);
  }
}

static void random_sphere(random_numbers *random, double sphere[4]) {
  for (int k = 0; k < 3; k++) sphere[k] = random_between(random, -0.5, 0.5);
  sphere[3] = random_between(random, 0, 0.3);
}

static void check_random_primitives(qmat_mesh *mesh, uint64_t seed) {
  solid s;
  make_solid(&s, mesh);
  random_numbers random = {.seed = seed};
  for (int round = 0; round < 90; round++) {
    double spheres[3][4], gap;
    const double *const corners[3] = {spheres[0], spheres[1], spheres[2]};
    const int count = 1 + round % 3;
    for (int i = 0; i < count; i++) random_sphere(&random, spheres[i]);
    if (round % 7 == 0) memcpy(spheres[count - 1], spheres[0], sizeof spheres[0]); /* degenerate */
    const double most = sampled(s.surface, corners, count, 40, &gap);
    const double tolerance = round % 2 ? 1e-3 : 1e-2;
    const double bound = qmat_envelope_to_surface_bound(s.surface, corners, count, -INFINITY, tolerance);
    assert_true(bound >= most - ROUNDING);
    /* Between the samples h may be larger by the slopes of both terms. */
    double slope = 1;
    for (int i = 0; i < count; i++)
      for (int j = 0; j < i; j++) {
        const double apart = qmat_point_distance(spheres[i], spheres[j]);
        if (apart > 0) slope = fmax(slope, 1 + fabs(spheres[i][3] - spheres[j][3]) / apart);
      }
    assert_true(bound <= most + tolerance + 2 * slope * gap + ROUNDING);
    /* Where more than that is not of interest, what is asked for comes back. */
    assert_near(qmat_envelope_to_surface_bound(s.surface, corners, count, bound + 0.1, tolerance), bound + 0.1,
                ROUNDING);
    const double half = most - 0.05;
    const double again = qmat_envelope_to_surface_bound(s.surface, corners, count, half, tolerance);
    assert_true(again >= most - ROUNDING && again <= most + tolerance + 2 * slope * gap + ROUNDING);
  }
  free_solid(&s);
}

static void test_bound_against_dense_samples_in_a_torus(void **state) {
  (void)state;
  check_random_primitives(shape_torus(2, 0.7, 30, 15), 1);
}

static void test_bound_against_dense_samples_in_an_l(void **state) {
  (void)state;
  check_random_primitives(shape_l(), 2);
}

/* --- while a medial mesh collapses -------------------------------------------------------------------------------- */

typedef struct {
  pipeline p;
  qmat_context context;
  qmat_surface *surface;
  qmat_complex complex;
  qmat_envelope_to_surface envelope_tracker;
  qmat_collapse collapse;
} model;

/* Takes the medial mesh of `mesh` with the surface of `measured`; NULL: that of `mesh`. */
static void make_model(model *m, qmat_mesh *mesh, const qmat_mesh *measured, double limit) {
  *m = (model){.surface = NULL};
  pipeline_make(&m->p, mesh, "spacing=8% n_f=0", "");
  const qmat_medial *medial = m->p.medial;
  assert_int_equal(qmat_surface_new(&m->context, measured ? measured : m->p.mesh, &m->surface), QMAT_OK);
  double *spheres = qmat_alloc(medial->sphere_count, 4 * sizeof *spheres);
  double *depths = qmat_alloc(medial->sphere_count, sizeof *depths);
  qmat_frame_spheres_to_unit(qmat_surface_frame(m->surface), medial->spheres, medial->sphere_count, spheres);
  assert_int_equal(qmat_complex_init(&m->context, &m->complex, medial, spheres), QMAT_OK);
  for (size_t v = 0; v < medial->sphere_count; v++)
    depths[v] = -qmat_surface_signed_distance(m->surface, &spheres[4 * v]);
  assert_int_equal(
      qmat_envelope_to_surface_init(&m->context, &m->envelope_tracker, m->surface, &m->complex, depths, limit),
      QMAT_OK);
  qmat_free(spheres);
  qmat_free(depths);
}

static void free_model(model *m) {
  qmat_collapse_uninit(&m->collapse);
  qmat_envelope_to_surface_uninit(&m->envelope_tracker);
  qmat_complex_uninit(&m->complex);
  qmat_surface_free(m->surface);
  qmat_context_uninit(&m->context);
  pipeline_free(&m->p);
}

/* What is known of a vertex, an edge or a triangle holds on a dense grid of it. */
static void check_vertex(const model *m, uint32_t v) {
  const double depth = -qmat_surface_signed_distance(m->surface, &m->complex.spheres[4 * (size_t)v]);
  assert_true(m->envelope_tracker.depths[v] <= depth + ROUNDING);
}

static void check_edge(const model *m, uint32_t e, int steps) {
  const double *spheres[2];
  double gap;
  for (size_t k = 0; k < 2; k++) spheres[k] = &m->complex.spheres[4 * (size_t)m->complex.edges[2 * (size_t)e + k]];
  assert_true(m->envelope_tracker.edge_bounds[e] >= sampled(m->surface, spheres, 2, steps, &gap) - ROUNDING);
}

static void check_triangle(const model *m, uint32_t t, int steps) {
  const double *spheres[3];
  double gap;
  for (size_t k = 0; k < 3; k++) spheres[k] = &m->complex.spheres[4 * (size_t)m->complex.triangles[3 * (size_t)t + k]];
  assert_true(m->envelope_tracker.triangle_bounds[t] >= sampled(m->surface, spheres, 3, steps, &gap) - ROUNDING);
}

static void check_all(const model *m, int steps) {
  for (uint32_t v = 0; v < m->complex.vertex_count; v++)
    if (m->complex.vertex_alive[v]) check_vertex(m, v);
  for (uint32_t e = 0; e < m->complex.edge_count; e++)
    if (m->complex.edge_alive[e]) check_edge(m, e, steps);
  for (uint32_t t = 0; t < m->complex.triangle_count; t++)
    if (m->complex.triangle_alive[t]) check_triangle(m, t, steps);
}

/* The star of the merged vertex: its bounds hold, and keep the limit. */
static void check_star(const model *m, uint32_t v, int steps) {
  size_t count;
  check_vertex(m, v);
  const uint32_t *at = qmat_complex_edges_at(&m->complex, v, &count);
  for (size_t i = 0; i < count; i++) {
    assert_true(m->envelope_tracker.edge_bounds[at[i]] <= m->envelope_tracker.limit);
    check_edge(m, at[i], steps);
  }
  at = qmat_complex_triangles_at(&m->complex, v, &count);
  for (size_t i = 0; i < count; i++) {
    assert_true(m->envelope_tracker.triangle_bounds[at[i]] <= m->envelope_tracker.limit);
    check_triangle(m, at[i], steps);
  }
}

static void check_midpoints(const model *m, const double sphere[4], double exempt_radius, bool inside) {
  bool all = true, close = false;
  for (size_t n = 0; n < m->collapse.neighbour_count; n++) {
    const double *other = &m->complex.spheres[4 * (size_t)m->collapse.neighbours[n]];
    const double middle[3] = {0.5 * (sphere[0] + other[0]), 0.5 * (sphere[1] + other[1]), 0.5 * (sphere[2] + other[2])};
    if (sphere[3] <= exempt_radius && other[3] <= exempt_radius) continue;
    const double depth = -qmat_surface_signed_distance(m->surface, middle);
    all = all && depth > 0;
    close |= fabs(depth) < 1e-7;
  }
  if (!close) assert_int_equal(inside, all);
}

/* Random collapses, each accepted one checked around the merged vertex, and all of them at the end. */
static void collapse_at_random(model *m, uint64_t seed, double exempt_radius, size_t least) {
  random_numbers random = {.seed = seed};
  size_t collapses = 0, by_sphere = 0, by_midpoints = 0, by_limit = 0, idle = 0;
  check_all(m, 3);
  while (m->complex.live_edges > 0 && idle < 1000) {
    double sphere[4];
    const uint32_t edge = random_collapse(&random, &m->complex, 0.02, sphere);
    bool kept = true;
    assert_int_equal(qmat_complex_preview(&m->context, &m->complex, edge, &m->collapse), QMAT_OK);
    const bool good = qmat_envelope_to_surface_test_sphere(&m->envelope_tracker, &m->complex, &m->collapse, sphere);
    const double depth = -qmat_surface_signed_distance(m->surface, sphere);
    assert_true(m->envelope_tracker.sphere_depth <= depth + ROUNDING);
    if (fabs(depth) > 1e-7 && fabs(sphere[3] - depth - m->envelope_tracker.limit) > 1e-7)
      assert_int_equal(good, depth > 0 && sphere[3] - depth <= m->envelope_tracker.limit);
    idle++;
    by_sphere += !good;
    if (!good) continue;
    const bool inside =
        qmat_envelope_to_surface_test_midpoints(&m->envelope_tracker, &m->complex, &m->collapse, sphere, exempt_radius);
    check_midpoints(m, sphere, exempt_radius, inside);
    by_midpoints += !inside;
    if (!inside) continue;
    assert_int_equal(
        qmat_envelope_to_surface_test(&m->context, &m->envelope_tracker, &m->complex, &m->collapse, sphere, &kept),
        QMAT_OK);
    by_limit += !kept;
    if (!kept) continue;
    qmat_envelope_to_surface_commit(&m->envelope_tracker, &m->collapse);
    assert_int_equal(qmat_complex_collapse(&m->context, &m->complex, &m->collapse, sphere), QMAT_OK);
    if (collapses++ % 8 == 0) check_star(m, m->collapse.kept, 6);
    idle = 0;
  }
  check_all(m, 24);
  assert_true(collapses >= least && by_sphere > 0 && by_limit > 10);
  assert_int_equal(by_midpoints > 0, exempt_radius < INFINITY);
}

static void test_bounds_hold_after_random_collapses_of_a_torus(void **state) {
  (void)state;
  model m;
  make_model(&m, pipeline_model("torus", 8), NULL, 0.02);
  collapse_at_random(&m, 1, 0, 500);
  free_model(&m);
}

static void test_bounds_hold_after_random_collapses_of_an_l(void **state) {
  (void)state;
  model m;
  make_model(&m, shape_l(), NULL, 0.05);
  collapse_at_random(&m, 2, 0, 300);
  free_model(&m);
}

static void test_bounds_hold_where_edges_leave_the_model(void **state) {
  (void)state;
  static const double radii[] = {0.02, INFINITY};
  for (size_t i = 0; i < sizeof radii / sizeof *radii; i++) {
    model m;
    make_model(&m, shape_l(), NULL, 0.05);
    collapse_at_random(&m, 2, radii[i], 300);
    free_model(&m);
  }
}

/* Inside the bounding box of the L, partly within the solid. */
static void through_l(double u, double v, double p[3]) {
  p[0] = 2 * u, p[1] = 2 * v, p[2] = 0.4;
}

static void test_bounds_hold_after_random_collapses_of_an_l_with_a_sheet(void **state) {
  (void)state;
  for (int thick = 0; thick < 2; thick++) {
    model m;
    qmat_mesh *both = shape_l();
    shape_add_sheet(both, 1, 1, through_l);
    both->sheet_thickness = 0.3 * thick;
    both = shape_seal(both);
    make_model(&m, shape_l(), both, 0.05);
    assert_int_equal(qmat_surface_is_watertight(m.surface), !thick);
    collapse_at_random(&m, 2, 0, 300);
    free_model(&m);
    qmat_value_release(&both->base);
  }
}

static void test_spheres_out_of_the_solid_are_refused_without_a_limit_too(void **state) {
  (void)state;
  model m;
  make_model(&m, shape_box(1, 1, 1), NULL, INFINITY);
  assert_int_equal(qmat_complex_preview(&m.context, &m.complex, 0, &m.collapse), QMAT_OK);
  assert_true(qmat_envelope_to_surface_test_sphere(&m.envelope_tracker, &m.complex, &m.collapse,
                                                   (const double[4]){0, 0, 0, 9}));
  assert_false(qmat_envelope_to_surface_test_sphere(&m.envelope_tracker, &m.complex, &m.collapse,
                                                    (const double[4]){0.3, 0, 0, 0}));
  assert_false(qmat_envelope_to_surface_test_sphere(&m.envelope_tracker, &m.complex, &m.collapse,
                                                    (const double[4]){5, 0, 0, 9}));
  free_model(&m);
}

static void beside_slab(double u, double v, double p[3]) {
  p[0] = 2 * u, p[1] = 2 * v, p[2] = 0.3;
}

static void check_queries_of_slab(qmat_mesh *box) {
  solid s;
  make_solid(&s, box);
  const double half = 0.5 / sqrt(33), limit = 0.005;
  const double spheres[12] = {-0.2, -0.2, 0, half, 0.2, -0.2, 0, half, 0, 0.2, 0, half}, depths[3] = {half, half, half};
  const uint32_t corners[3] = {0, 1, 2};
  qmat_medial *medial = qmat_medial_new();
  medial->sphere_count = 3;
  medial->spheres = qmat_alloc(3, 4 * sizeof *spheres);
  memcpy(medial->spheres, spheres, sizeof spheres);
  assert_int_equal(qmat_medial_set_simplices(&s.context, medial, NULL, 0, corners, 1), QMAT_OK);
  qmat_complex complex;
  qmat_envelope_to_surface tracker;
  qmat_collapse collapse = {.kept = 0};
  assert_int_equal(qmat_complex_init(&s.context, &complex, medial, NULL), QMAT_OK);
  assert_int_equal(qmat_envelope_to_surface_init(&s.context, &tracker, s.surface, &complex, depths, limit), QMAT_OK);
  assert_int_equal(qmat_complex_preview_move(&s.context, &complex, 2, &collapse), QMAT_OK);
  const double moved[4] = {0.05, 0.2, 0, half};
  bool kept;
  assert_true(qmat_envelope_to_surface_test_sphere(&tracker, &complex, &collapse, moved));
  assert_int_equal(qmat_envelope_to_surface_test(&s.context, &tracker, &complex, &collapse, moved, &kept), QMAT_OK);
  /* Nine nodes bound the depth at each corner; piece by piece it would take more than a thousand. */
  assert_true(kept && tracker.lattice.queries < 40);
  assert_true(tracker.new_triangle_bounds[0] <= 0.5 * limit); /* 0 up to what is not resolved */
  qmat_collapse_uninit(&collapse);
  qmat_envelope_to_surface_uninit(&tracker);
  qmat_complex_uninit(&complex);
  qmat_value_release(&medial->base);
  free_solid(&s);
}

static void test_a_slab_between_flat_faces_takes_few_queries(void **unused) {
  (void)unused;
  check_queries_of_slab(shape_box(4, 4, 1));
}

static void test_a_sheet_without_thickness_adds_no_queries(void **unused) {
  (void)unused;
  qmat_mesh *box = shape_box(4, 4, 1);
  shape_add_sheet(box, 1, 1, beside_slab);
  check_queries_of_slab(box);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_spheres_in_a_cube_by_hand),
      cmocka_unit_test(test_bound_between_the_corners_of_an_l_by_hand),
      cmocka_unit_test(test_a_slab_that_touches_flat_surface_all_over_takes_few_pieces),
      cmocka_unit_test(test_bound_against_dense_samples_in_a_torus),
      cmocka_unit_test(test_bound_against_dense_samples_in_an_l),
      cmocka_unit_test(test_bounds_hold_after_random_collapses_of_a_torus),
      cmocka_unit_test(test_bounds_hold_after_random_collapses_of_an_l),
      cmocka_unit_test(test_bounds_hold_where_edges_leave_the_model),
      cmocka_unit_test(test_bounds_hold_after_random_collapses_of_an_l_with_a_sheet),
      cmocka_unit_test(test_a_slab_between_flat_faces_takes_few_queries),
      cmocka_unit_test(test_a_sheet_without_thickness_adds_no_queries),
      cmocka_unit_test(test_spheres_out_of_the_solid_are_refused_without_a_limit_too),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
