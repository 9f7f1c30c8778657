/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/surface_to_envelope.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/envelope.h"
#include "core/geometry/medial_build.h"
#include "nodes/measure/constraint_points.h"
#include "tests/medial_distances.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"
#include "tests/random_collapse.h"

#define ROUNDING 1e-9

/* --- by hand ------------------------------------------------------------------------------------------------------ */

/* A chain of spheres of radius 1 at x = 0, 1, ... 4, and points above it. */
typedef struct {
  qmat_context context;
  qmat_complex complex;
  qmat_surface_to_envelope surface_tracker;
  qmat_collapse collapse;
} chain;

enum { LINKS = 4, POINTS = 3 };
static const double points[3 * POINTS] = {0, 0, 1.05, 2, 0, 1.05, 4, 0, 1.05};
static const uint32_t witnesses[3 * POINTS] = {0, QMAT_NONE, QMAT_NONE, 2, QMAT_NONE, QMAT_NONE, 3, 4, QMAT_NONE};
static const double weights[3 * POINTS] = {1, 0, 0, 1, 0, 0, 0.25, 0.75, 0};

static void make_chain(chain *c, double *limits) {
  *c = (chain){.context = {.threads = 1}};
  qmat_medial *medial = qmat_medial_new();
  uint32_t edges[2 * LINKS];
  medial->sphere_count = LINKS + 1;
  medial->spheres = qmat_calloc(LINKS + 1, 4 * sizeof(double));
  for (uint32_t i = 0; i <= LINKS; i++) medial->spheres[4 * i] = i, medial->spheres[4 * i + 3] = 1;
  for (uint32_t i = 0; i < LINKS; i++) edges[2 * i] = i, edges[2 * i + 1] = i + 1;
  assert_int_equal(qmat_medial_set_simplices(&c->context, medial, edges, LINKS, NULL, 0), QMAT_OK);
  assert_int_equal(qmat_complex_init(&c->context, &c->complex, medial, NULL), QMAT_OK);
  assert_int_equal(qmat_surface_to_envelope_init(&c->context, &c->surface_tracker, POINTS, points, limits, witnesses,
                                                 weights, LINKS + 1),
                   QMAT_OK);
  qmat_value_release(&medial->base);
}

static void free_chain(chain *c) {
  qmat_collapse_uninit(&c->collapse);
  qmat_surface_to_envelope_uninit(&c->surface_tracker);
  qmat_complex_uninit(&c->complex);
  qmat_context_uninit(&c->context);
}

static bool try_merge(chain *c, uint32_t a, uint32_t b, const double sphere[4]) {
  const uint32_t edge = qmat_complex_find_edge(&c->complex, a, b);
  assert_int_not_equal(edge, QMAT_NONE);
  assert_int_equal(qmat_complex_preview(&c->context, &c->complex, edge, &c->collapse), QMAT_OK);
  bool kept;
  assert_int_equal(qmat_surface_to_envelope_test(&c->context, &c->surface_tracker, &c->complex, &c->collapse, sphere,
                                                 QMAT_NONE, &kept),
                   QMAT_OK);
  return kept;
}

static void merge(chain *c, const double sphere[4]) {
  qmat_surface_to_envelope_commit(&c->surface_tracker, &c->collapse);
  assert_int_equal(qmat_complex_collapse(&c->context, &c->complex, &c->collapse, sphere), QMAT_OK);
}

static void test_witness_is_carried_along_while_it_holds(void **state) {
  (void)state;
  double limits[POINTS] = {0.1, 0.1, 0.1};
  chain c;
  make_chain(&c, limits);
  /* The last point's witness is 0.25 of sphere 3 and 0.75 of sphere 4: merged into one it stands there alone. */
  const double end[4] = {4, 0, 0, 1};
  assert_true(try_merge(&c, 3, 4, end));
  merge(&c, end);
  const uint32_t kept = c.collapse.kept;
  assert_int_equal(c.surface_tracker.witnesses[6], kept);
  assert_int_equal(c.surface_tracker.witnesses[7], QMAT_NONE);
  assert_near(c.surface_tracker.weights[6], 1, 0);
  assert_int_equal(qmat_surface_to_envelope_first(&c.surface_tracker, kept) / 3, 2);
  assert_int_equal(qmat_surface_to_envelope_first(&c.surface_tracker, c.collapse.removed), QMAT_NONE);
  free_chain(&c);
}

static void test_another_witness_is_searched_for_when_it_moves_away(void **state) {
  (void)state;
  double limits[POINTS] = {0.1, 0.1, 0.1};
  chain c;
  make_chain(&c, limits);
  /* Spheres 2 and 3 merge at x = 3: the point at x = 2 finds the cone from 1 to 3. */
  const double end[4] = {3, 0, 0, 1};
  assert_true(try_merge(&c, 2, 3, end));
  merge(&c, end);
  const uint32_t *w = &c.surface_tracker.witnesses[3];
  assert_true((w[0] == 1 || w[1] == 1) && (w[0] == c.collapse.kept || w[1] == c.collapse.kept));
  assert_int_equal(w[2], QMAT_NONE);
  assert_near(c.surface_tracker.weights[3], 0.5, 1e-12);
  assert_near(c.surface_tracker.weights[4], 0.5, 1e-12);
  free_chain(&c);
}

static void test_point_that_nothing_reaches_refuses_and_is_named(void **state) {
  (void)state;
  double limits[POINTS] = {0.1, 0.1, 0.1};
  chain c;
  make_chain(&c, limits);
  const double shorter[4] = {3, 0, 0, 1}, thinner[4] = {2, 0, 0, 0.9}, thin_enough[4] = {2, 0, 0, 0.95};
  assert_false(try_merge(&c, 3, 4, shorter)); /* leaves the end of the chain: 0.45 from the point there */
  assert_int_equal(c.surface_tracker.failed_point, 2);
  assert_false(try_merge(&c, 1, 2, thinner));
  assert_int_equal(c.surface_tracker.failed_point, 1);
  limits[1] = 0.151;
  assert_true(try_merge(&c, 1, 2, thinner));
  limits[1] = 0.1001;
  assert_true(try_merge(&c, 1, 2, thin_enough));
  limits[2] = 0.5;
  assert_true(try_merge(&c, 3, 4, shorter));
  free_chain(&c);
}

static void test_failed_point_is_tried_first(void **state) {
  (void)state;
  double limits[POINTS] = {0.01, 0.1, 0.1}; /* the first point fails from the start, but is not asked */
  chain c;
  make_chain(&c, limits);
  bool kept;
  const double end[4] = {4, 0, 0, 1};
  assert_true(try_merge(&c, 3, 4, end));
  assert_int_equal(
      qmat_surface_to_envelope_test(&c.context, &c.surface_tracker, &c.complex, &c.collapse, end, 0, &kept), QMAT_OK);
  assert_true(kept); /* a point whose witness the collapse does not touch does not decide about it */
  const double shorter[4] = {3, 0, 0, 1};
  assert_int_equal(
      qmat_surface_to_envelope_test(&c.context, &c.surface_tracker, &c.complex, &c.collapse, shorter, 2, &kept),
      QMAT_OK);
  assert_false(kept);
  assert_int_equal(c.surface_tracker.failed_point, 2);
  free_chain(&c);
}

/* --- on a model --------------------------------------------------------------------------------------------------- */

typedef struct {
  pipeline p;
  qmat_context context;
  qmat_surface *surface;
  qmat_complex complex;
  qmat_constraint_points constraints;
  qmat_surface_to_envelope surface_tracker;
  qmat_collapse collapse;
  double *limits;
} model;

static void make_model(model *m, qmat_mesh *mesh, double epsilon, bool with_regions) {
  *m = (model){.limits = NULL};
  pipeline_make(&m->p, mesh, "spacing=8% n_f=0", "");
  qmat_medial *medial = m->p.medial, bare = *medial;
  if (!with_regions) {
    bare.region_offset_count = bare.region_sample_count = 0;
    bare.region_offsets = bare.region_samples = NULL;
    medial = &bare;
  }
  assert_int_equal(qmat_surface_new(&m->context, m->p.mesh, &m->surface), QMAT_OK);
  double *spheres = qmat_alloc(medial->sphere_count, 4 * sizeof *spheres);
  qmat_frame_spheres_to_unit(qmat_surface_frame(m->surface), medial->spheres, medial->sphere_count, spheres);
  assert_int_equal(qmat_complex_init(&m->context, &m->complex, medial, spheres), QMAT_OK);
  qmat_free(spheres);
  assert_int_equal(qmat_constraint_points_make(&m->context, m->surface, m->p.samples, medial, &m->complex, epsilon,
                                               3000, true, &m->constraints),
                   QMAT_OK);
  m->limits = qmat_alloc(m->constraints.count, sizeof *m->limits);
  for (size_t i = 0; i < m->constraints.count; i++)
    m->limits[i] = i < m->constraints.surface_count ? fmax(epsilon, m->constraints.distances[i])
                                                    : m->constraints.inner_limits[i - m->constraints.surface_count];
  assert_int_equal(qmat_surface_to_envelope_init(&m->context, &m->surface_tracker, m->constraints.count,
                                                 m->constraints.points, m->limits, m->constraints.witnesses,
                                                 m->constraints.weights, m->complex.vertex_count),
                   QMAT_OK);
}

static void free_model(model *m) {
  qmat_free(m->limits);
  qmat_collapse_uninit(&m->collapse);
  qmat_surface_to_envelope_uninit(&m->surface_tracker);
  qmat_complex_uninit(&m->complex);
  qmat_surface_free(m->surface);
  qmat_context_uninit(&m->context);
  pipeline_free(&m->p);
}

/* Every used slot is in exactly the list of its vertex; nothing else is in a list. */
static void check_lists(const model *m) {
  const qmat_surface_to_envelope *c = &m->surface_tracker;
  size_t used = 0, listed = 0;
  for (size_t slot = 0; slot < 3 * c->point_count; slot++) used += c->witnesses[slot] != QMAT_NONE;
  for (uint32_t v = 0; v < m->complex.vertex_count; v++) {
    uint32_t previous = QMAT_NONE;
    for (uint32_t slot = qmat_surface_to_envelope_first(c, v); slot != QMAT_NONE; slot = c->next[slot]) {
      assert_true(slot < 3 * c->point_count);
      assert_int_equal(c->witnesses[slot], v);
      assert_int_equal(c->previous[slot], previous);
      assert_true(++listed <= used); /* no ring, and no slot in two lists */
      previous = slot;
    }
    if (!m->complex.vertex_alive[v]) assert_int_equal(c->heads[v], QMAT_NONE);
  }
  assert_int_equal(listed, used);
}

static bool is_live_triangle(const qmat_complex *complex, const uint32_t *corners) {
  size_t count;
  const uint32_t *at = qmat_complex_triangles_at(complex, corners[0], &count);
  for (size_t i = 0; i < count; i++) {
    const uint32_t *t = &complex->triangles[3 * (size_t)at[i]];
    int found = 0;
    for (int k = 0; k < 3; k++) found += t[k] == corners[0] || t[k] == corners[1] || t[k] == corners[2];
    if (found == 3 && complex->triangle_alive[at[i]]) return true;
  }
  return false;
}

/* F at the point's witness, after a look at whether that is one. */
static double checked_witness(const model *m, size_t point) {
  const uint32_t *w = &m->surface_tracker.witnesses[3 * point];
  const double *share = &m->surface_tracker.weights[3 * point];
  double sum = 0, sphere[4] = {0, 0, 0, 0};
  int corners = 0;
  while (corners < 3 && w[corners] != QMAT_NONE) corners++;
  assert_true(corners > 0);
  for (int k = 0; k < 3; k++) {
    if (k >= corners) {
      assert_int_equal(w[k], QMAT_NONE);
      assert_near(share[k], 0, 0);
      continue;
    }
    assert_true(m->complex.vertex_alive[w[k]]);
    for (int j = 0; j < k; j++) assert_int_not_equal(w[j], w[k]);
    assert_true(share[k] >= -ROUNDING);
    sum += share[k];
    for (int i = 0; i < 4; i++) sphere[i] += share[k] * m->complex.spheres[4 * (size_t)w[k] + (size_t)i];
  }
  assert_near(sum, 1, ROUNDING);
  if (corners == 2) assert_int_not_equal(qmat_complex_find_edge(&m->complex, w[0], w[1]), QMAT_NONE);
  if (corners == 3) assert_true(is_live_triangle(&m->complex, w));
  return qmat_sphere_distance(sphere, &m->surface_tracker.points[3 * point]);
}

/* The envelope of what is alive. */
static qmat_envelope *live_envelope(model *m) {
  const qmat_complex *c = &m->complex;
  uint32_t *edges = qmat_alloc(2 * c->live_edges + 1, sizeof *edges), *triangles;
  triangles = qmat_alloc(3 * c->live_triangles + 1, sizeof *triangles);
  double *spheres = qmat_alloc(4 * c->live_vertices, sizeof *spheres);
  uint32_t *ids = qmat_alloc(c->vertex_count, sizeof *ids), next = 0;
  size_t edge_count = 0, triangle_count = 0;
  assert_true(edges && triangles && spheres && ids);
  for (size_t v = 0; v < c->vertex_count; v++) {
    if (!c->vertex_alive[v]) continue;
    memcpy(&spheres[4 * (size_t)next], &c->spheres[4 * v], 4 * sizeof *spheres);
    ids[v] = next++;
  }
  for (size_t i = 0; i < 2 * c->edge_count; i++)
    if (c->edge_alive[i / 2]) edges[edge_count++] = ids[c->edges[i]];
  for (size_t i = 0; i < 3 * c->triangle_count; i++)
    if (c->triangle_alive[i / 3]) triangles[triangle_count++] = ids[c->triangles[i]];
  qmat_envelope *envelope;
  assert_int_equal(
      qmat_envelope_new(&m->context, spheres, next, edges, edge_count / 2, triangles, triangle_count / 3, &envelope),
      QMAT_OK);
  qmat_free(edges);
  qmat_free(triangles);
  qmat_free(spheres);
  qmat_free(ids);
  return envelope;
}

static void check(model *m) {
  check_lists(m);
  qmat_envelope *envelope = live_envelope(m);
  for (size_t i = 0; i < m->constraints.count; i++) {
    const double at_witness = checked_witness(m, i);
    assert_true(at_witness >= qmat_envelope_distance(envelope, &m->constraints.points[3 * i], NULL) - ROUNDING);
    assert_true(at_witness <= m->limits[i] + ROUNDING);
  }
  qmat_envelope_free(envelope);
}

/* Whether every point of the collapse's two regions is within its limit of the new complex, by asking all of it. */
static void check_refusal(model *m, const double sphere[4]) {
  const uint32_t kept = m->collapse.kept, removed = m->collapse.removed;
  const double *point = &m->constraints.points[3 * (size_t)m->surface_tracker.failed_point];
  const double limit = m->limits[m->surface_tracker.failed_point];
  /* The failed point is out of reach of the merged sphere and of the link's untouched edges at least. */
  assert_true(qmat_sphere_distance(sphere, point) > limit);
  for (size_t n = 0; n < m->collapse.neighbour_count; n++) {
    const double *other = &m->complex.spheres[4 * (size_t)m->collapse.neighbours[n]];
    assert_true(cone_distance(sphere, other, point) > limit);
  }
  for (size_t t = 0; t < m->collapse.triangle_count; t++) {
    const uint32_t *pair = &m->collapse.triangle_pairs[2 * t];
    assert_true(slab_distance(sphere, &m->complex.spheres[4 * (size_t)pair[0]],
                              &m->complex.spheres[4 * (size_t)pair[1]], point) > limit);
  }
  bool served = false;
  for (size_t k = 0; k < 3; k++) {
    const uint32_t v = m->surface_tracker.witnesses[3 * (size_t)m->surface_tracker.failed_point + k];
    served |= v == kept || v == removed;
  }
  assert_true(served);
}

/* Random collapses, with all checked now and then. */
static void collapse_at_random(model *m, uint64_t seed, size_t least, size_t checks) {
  random_numbers random = {.seed = seed};
  size_t collapses = 0, refused = 0, checked = 0, idle = 0;
  const size_t every = least / checks;
  check(m);
  while (m->complex.live_edges > 0 && idle < 2000) {
    double sphere[4];
    const uint32_t edge = random_collapse(&random, &m->complex, 0.01, sphere);
    bool kept;
    assert_int_equal(qmat_complex_preview(&m->context, &m->complex, edge, &m->collapse), QMAT_OK);
    assert_int_equal(qmat_surface_to_envelope_test(&m->context, &m->surface_tracker, &m->complex, &m->collapse, sphere,
                                                   QMAT_NONE, &kept),
                     QMAT_OK);
    if (!kept) {
      if (refused++ % 10 == 0) check_refusal(m, sphere);
      idle++;
      continue;
    }
    idle = 0;
    qmat_surface_to_envelope_commit(&m->surface_tracker, &m->collapse);
    assert_int_equal(qmat_complex_collapse(&m->context, &m->complex, &m->collapse, sphere), QMAT_OK);
    if (++collapses % every == 0 && checked < 2 * checks) {
      check(m);
      checked++;
    }
  }
  check(m);
  assert_true(collapses >= least && refused > 100);
}

static void test_witnesses_survive_random_collapses_of_a_torus(void **state) {
  (void)state;
  model m;
  make_model(&m, pipeline_model("torus", 8), 0.03, true);
  collapse_at_random(&m, 1, 1000, 8);
  free_model(&m);
}

static void test_witnesses_survive_random_collapses_of_a_box(void **state) {
  (void)state;
  model m;
  make_model(&m, pipeline_model("box", 4), 0.05, true);
  collapse_at_random(&m, 2, 300, 8);
  free_model(&m);
}

static void test_witnesses_without_regions(void **state) {
  (void)state;
  model m;
  make_model(&m, pipeline_model("capsule", 8), 0.03, false);
  collapse_at_random(&m, 3, 300, 5);
  free_model(&m);
}

static void test_without_limits_everything_may_collapse(void **state) {
  (void)state;
  model m;
  make_model(&m, pipeline_model("capsule", 8), INFINITY, true);
  random_numbers random = {.seed = 4};
  while (m.complex.live_edges > 0) {
    const uint32_t edge = random_live_edge(&random, &m.complex);
    const double *a = &m.complex.spheres[4 * (size_t)m.complex.edges[2 * (size_t)edge]];
    const double sphere[4] = {a[0], a[1], a[2], a[3]};
    assert_int_equal(qmat_complex_preview(&m.context, &m.complex, edge, &m.collapse), QMAT_OK);
    qmat_surface_to_envelope_commit(&m.surface_tracker, &m.collapse); /* of no test at all */
    assert_int_equal(qmat_complex_collapse(&m.context, &m.complex, &m.collapse, sphere), QMAT_OK);
  }
  check_lists(&m);
  for (size_t i = 0; i < m.constraints.count; i++) checked_witness(&m, i);
  assert_int_equal(m.complex.live_vertices, pipeline_components(m.p.medial));
  free_model(&m);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_witness_is_carried_along_while_it_holds),
      cmocka_unit_test(test_another_witness_is_searched_for_when_it_moves_away),
      cmocka_unit_test(test_point_that_nothing_reaches_refuses_and_is_named),
      cmocka_unit_test(test_failed_point_is_tried_first),
      cmocka_unit_test(test_witnesses_survive_random_collapses_of_a_torus),
      cmocka_unit_test(test_witnesses_survive_random_collapses_of_a_box),
      cmocka_unit_test(test_witnesses_without_regions),
      cmocka_unit_test(test_without_limits_everything_may_collapse),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
