/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/partitioned_collapse.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/medial_distance.h"
#include "tests/random.h"
#include "tests/shapes.h"
#include "tests/shortage.h"

/* A flat box with sides of 2 by 2 by 0.1, and its sheet: a square lattice of SIDE * SIDE spheres, not quite in the
 * middle, each cell two slabs. Of every sphere the places above and below on the box are constraint points. */
enum { SIDE = 140, SPHERES = SIDE * SIDE, POINTS = 2 * SPHERES };

static const double half_height = 0.05, limit = 0.004;

typedef struct sheet {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
  qmat_medial *medial;
  double *spheres, *depths; /* unit frame */
  qmat_constraint_points constraints;
  qmat_decimation run;
} sheet;

static qmat_medial *make_medial(qmat_context *context) {
  qmat_medial *medial = qmat_medial_new();
  uint32_t *triangles = malloc(6 * SPHERES * sizeof *triangles), *t = triangles;
  assert_true(medial && triangles);
  medial->sphere_count = SPHERES;
  medial->spheres = qmat_alloc(SPHERES, 4 * sizeof(double));
  assert_non_null(medial->spheres);
  random_numbers random = {.seed = 3};
  for (uint32_t i = 0; i < SPHERES; i++) {
    double *s = &medial->spheres[4 * (size_t)i];
    const uint32_t x = i % SIDE, y = i / SIDE;
    s[0] = -0.95 + 1.9 * x / (SIDE - 1);
    s[1] = -0.95 + 1.9 * y / (SIDE - 1);
    s[2] = random_between(&random, -0.001, 0.001);
    s[3] = half_height - fabs(s[2]);
    if (x + 1 == SIDE || y + 1 == SIDE) continue;
    const uint32_t rows[6] = {i, i + 1, i + SIDE, i + 1, i + SIDE, i + SIDE + 1};
    memcpy(t, rows, sizeof rows);
    t += 6;
  }
  assert_int_equal(qmat_medial_set_simplices(context, medial, NULL, 0, triangles, (size_t)(t - triangles) / 3),
                   QMAT_OK);
  free(triangles);
  return medial;
}

static void make_sheet(sheet *s) {
  *s = (sheet){.context = {.threads = 1}};
  qmat_context *context = &s->context;
  s->mesh = shape_new();
  shape_add_box(s->mesh, -1, -1, -half_height, 1, 1, half_height, false);
  shape_seal(s->mesh);
  assert_int_equal(qmat_surface_new(context, s->mesh, &s->surface), QMAT_OK);
  s->medial = make_medial(context);
  const qmat_frame *frame = qmat_surface_frame(s->surface);
  s->spheres = malloc(4 * SPHERES * sizeof(double));
  s->depths = malloc(SPHERES * sizeof(double));
  s->constraints.points = malloc(3 * POINTS * sizeof(double));
  assert_true(s->spheres && s->depths && s->constraints.points);
  for (size_t i = 0; i < POINTS; i++) {
    memcpy(&s->constraints.points[3 * i], &s->medial->spheres[4 * (i / 2)], 2 * sizeof(double));
    s->constraints.points[3 * i + 2] = i % 2 ? half_height : -half_height;
  }
  qmat_frame_to_unit(frame, s->constraints.points, POINTS, s->constraints.points);
  qmat_frame_spheres_to_unit(frame, s->medial->spheres, SPHERES, s->spheres);
  for (size_t i = 0; i < SPHERES; i++) s->depths[i] = -qmat_surface_signed_distance(s->surface, &s->spheres[4 * i]);
}

/* The run before its first collapse. */
static void start(sheet *s) {
  qmat_constraint_points *c = &s->constraints;
  const double *points = c->points;
  *c = (qmat_constraint_points){.count = POINTS, .sample_count = POINTS, .surface_count = POINTS, .points = c->points};
  qmat_arena *arena = &s->context.arena;
  c->witnesses = qmat_arena_alloc(arena, POINTS, 3 * sizeof(uint32_t));
  c->weights = qmat_arena_calloc(arena, POINTS, 3 * sizeof(double));
  c->distances = qmat_arena_alloc(arena, POINTS, sizeof(double));
  assert_true(c->witnesses && c->weights && c->distances);
  for (uint32_t i = 0; i < POINTS; i++) {
    c->witnesses[3 * (size_t)i] = i / 2;
    c->witnesses[3 * (size_t)i + 1] = c->witnesses[3 * (size_t)i + 2] = QMAT_NONE;
    c->weights[3 * (size_t)i] = 1;
    c->distances[i] = qmat_sphere_distance(&s->spheres[4 * (size_t)(i / 2)], &points[3 * (size_t)i]);
  }
  s->run = (qmat_decimation){.context = &s->context,
                             .surface = s->surface,
                             .rules = {.limit = limit,
                                       .share = 1,
                                       .finest = limit,
                                       .k = 1e-5,
                                       .topology = QMAT_TOPOLOGY_PRESERVE,
                                       .features = QMAT_FEATURES_SHARP,
                                       .crease_share = 0.5}};
  assert_int_equal(qmat_complex_init(&s->context, &s->run.complex, s->medial, s->spheres), QMAT_OK);
}

static void end(sheet *s) {
  qmat_decimation_uninit(&s->run);
  qmat_context_uninit(&s->context);
  s->context = (qmat_context){.threads = 1};
}

static void free_sheet(sheet *s) {
  qmat_context_uninit(&s->context);
  qmat_value_release(&s->medial->base);
  qmat_surface_free(s->surface);
  qmat_value_release(&s->mesh->base);
  free(s->spheres);
  free(s->depths);
  free(s->constraints.points);
}

static int set_up(void **state) {
  static sheet s;
  make_sheet(&s);
  *state = &s;
  return 0;
}

static int tear_down(void **state) {
  free_sheet(*state);
  return 0;
}

static void collapse(sheet *s, int threads) {
  start(s);
  s->context.threads = threads;
  assert_true(qmat_can_collapse_partitioned(&s->run.rules, &s->run.complex, 0));
  assert_int_equal(qmat_collapse_partitioned(&s->run, &s->constraints, s->depths), QMAT_OK);
}

static void test_a_share_is_left_with_what_was_held(void **state) {
  sheet *s = *state;
  collapse(s, 2);
  const qmat_complex *c = &s->run.complex;
  assert_int_equal(c->live_vertices, c->vertex_count);
  assert_int_equal(s->run.counts.collapses, SPHERES - c->vertex_count);
  const double share = qmat_piece_share * SPHERES;
  assert_true((double)c->vertex_count >= share && (double)c->vertex_count <= share + 8);
  /* A sheet it was, and a sheet it is. */
  assert_int_equal((int64_t)c->vertex_count - (int64_t)c->edge_count + (int64_t)c->triangle_count, 1);
  for (size_t i = 0; i < POINTS; i++) {
    double sphere[4] = {0, 0, 0, 0}, sum = 0;
    const uint32_t *w = &s->run.constraints->witnesses[3 * i];
    const double *weights = &s->run.constraints->weights[3 * i];
    for (size_t k = 0; k < 3 && w[k] != QMAT_NONE; k++) {
      assert_true(w[k] < c->vertex_count);
      sum += weights[k];
      for (size_t j = 0; j < 4; j++) sphere[j] += weights[k] * c->spheres[4 * (size_t)w[k] + j];
    }
    assert_near(sum, 1, 1e-9);
    assert_true(qmat_sphere_distance(sphere, &s->constraints.points[3 * i]) <= limit * (1 + 1e-9));
    if (w[1] != QMAT_NONE) assert_int_not_equal(qmat_complex_find_edge(c, w[0], w[1]), QMAT_NONE);
    if (w[2] != QMAT_NONE) assert_int_not_equal(qmat_complex_find_triangle(c, w[0], w[1], w[2]), QMAT_NONE);
  }
  for (size_t v = 0; v < c->vertex_count; v++) {
    const double depth = -qmat_surface_signed_distance(s->surface, &c->spheres[4 * v]);
    assert_true(s->run.envelope_tracker.depths[v] <= depth + 1e-9);
    assert_true(c->spheres[4 * v + 3] - depth <= limit);
  }
  /* The bound of an edge holds all along it. */
  for (size_t e = 0; e < c->edge_count; e++)
    for (int i = 1; i < 4; i++) {
      double sphere[4];
      for (size_t k = 0; k < 4; k++)
        sphere[k] = (1 - 0.25 * i) * c->spheres[4 * (size_t)c->edges[2 * e] + k] +
                    0.25 * i * c->spheres[4 * (size_t)c->edges[2 * e + 1] + k];
      const double envelope_tracker = sphere[3] + qmat_surface_signed_distance(s->surface, sphere);
      assert_true(envelope_tracker <= s->run.envelope_tracker.edge_bounds[e] + 1e-9);
      assert_true(envelope_tracker <= limit);
    }
  /* It goes on from there. */
  assert_int_equal(qmat_decimation_run(&s->run), QMAT_OK);
  assert_true(s->run.complex.live_vertices < 40);
  end(s);
}

/* A later round starts over with the same points. */
static void test_the_points_keep_their_witnesses_in_the_dense_medial_mesh(void **state) {
  sheet *s = *state;
  collapse(s, 2);
  for (uint32_t i = 0; i < POINTS; i++) {
    assert_int_equal(s->constraints.witnesses[3 * (size_t)i], i / 2);
    assert_true(s->constraints.weights[3 * (size_t)i] == 1);
  }
  end(s);
}

static void test_threads_change_no_byte(void **state) {
  sheet *s = *state;
  double *spheres = NULL;
  uint32_t *edges = NULL;
  size_t vertices = 0, edge_count = 0;
  static const int threads[] = {1, 2, 8};
  for (int i = 0; i < 3; i++) {
    collapse(s, threads[i]);
    qmat_complex *c = &s->run.complex;
    if (i == 0) {
      vertices = c->vertex_count;
      edge_count = c->edge_count;
      spheres = malloc(4 * vertices * sizeof *spheres);
      edges = malloc(2 * edge_count * sizeof *edges);
      assert_true(spheres && edges);
      memcpy(spheres, c->spheres, 4 * vertices * sizeof *spheres);
      memcpy(edges, c->edges, 2 * edge_count * sizeof *edges);
    }
    assert_int_equal(c->vertex_count, vertices);
    assert_int_equal(c->edge_count, edge_count);
    assert_memory_equal(c->spheres, spheres, 4 * vertices * sizeof *spheres);
    assert_memory_equal(c->edges, edges, 2 * edge_count * sizeof *edges);
    end(s);
  }
  free(spheres);
  free(edges);
}

/* Where all spheres lie in one place there is one part, which collapses like any other. */
static void test_spheres_in_one_place_are_one_part(void **state) {
  sheet *s = *state;
  start(s);
  for (size_t v = 0; v < SPHERES; v++)
    memcpy(&s->run.complex.spheres[4 * v], (const double[4]){0, 0, 0, 0.01}, 4 * sizeof(double));
  double *depths = malloc(SPHERES * sizeof *depths);
  assert_non_null(depths);
  const double depth = half_height / qmat_surface_frame(s->surface)->diagonal;
  for (size_t v = 0; v < SPHERES; v++) {
    depths[v] = depth;
    for (size_t k = 0; k < 2; k++) s->constraints.distances[2 * v + k] = 10;
  }
  assert_int_equal(qmat_collapse_partitioned(&s->run, &s->constraints, depths), QMAT_OK);
  assert_true(s->run.complex.vertex_count < SPHERES / 2);
  free(depths);
  end(s);
}

static void test_what_depends_on_the_order_is_not_done_in_parts(void **state) {
  sheet *s = *state;
  start(s);
  qmat_decimation_rules *rules = &s->run.rules;
  const qmat_decimation_rules good = *rules;
  qmat_complex *c = &s->run.complex;
  assert_true(qmat_can_collapse_partitioned(rules, c, 0));
  rules->on_exceed = QMAT_EXCEED_RAISE;
  assert_false(qmat_can_collapse_partitioned(rules, c, 0));
  *rules = good;
  rules->cost = QMAT_COST_PMAT;
  assert_false(qmat_can_collapse_partitioned(rules, c, 0));
  *rules = good;
  rules->protect = QMAT_PROTECT_LATE;
  assert_false(qmat_can_collapse_partitioned(rules, c, 0));
  *rules = good;
  rules->published = true;
  assert_false(qmat_can_collapse_partitioned(rules, c, 0));
  *rules = good;
  rules->vertices = SPHERES / 2;
  assert_false(qmat_can_collapse_partitioned(rules, c, 0));
  *rules = good;
  c->spheres[3] = 0; /* a sharp feature */
  assert_false(qmat_can_collapse_partitioned(rules, c, 0));
  rules->features = QMAT_FEATURES_NONE;
  assert_true(qmat_can_collapse_partitioned(rules, c, 0));
  end(s);
}

static bool ask_once(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                     const char *unit) {
  (void)node_id;
  (void)node_type;
  (void)unit;
  assert_true(done <= total);
  return (*(int *)user)-- > 0;
}

static void test_it_ends_when_it_is_cancelled(void **state) {
  sheet *s = *state;
  for (int times = 0; times < 2; times++) {
    start(s);
    int left = times;
    s->context.threads = 2;
    s->context.progress = ask_once;
    s->context.progress_user = &left;
    const qmat_status status = qmat_collapse_partitioned(&s->run, &s->constraints, s->depths);
    assert_true(status == QMAT_CANCELLED || (times == 1 && left == 0 && status == QMAT_OK));
    if (times == 0) assert_int_equal(status, QMAT_CANCELLED);
    end(s);
  }
}

static void test_a_shortage_of_memory_anywhere_is_an_error(void **state) {
  sheet *s = *state;
  start(s);
  shortage(SIZE_MAX, 0);
  s->context.threads = 2;
  assert_int_equal(qmat_collapse_partitioned(&s->run, &s->constraints, s->depths), QMAT_OK);
  const size_t needed = asked;
  end(s);
  assert_true(needed > 40);
  for (size_t k = 0; k < 24; k++) {
    start(s);
    s->context.threads = 2;
    shortage(k * needed / 24, SIZE_MAX);
    const qmat_status status = qmat_collapse_partitioned(&s->run, &s->constraints, s->depths);
    shortage(SIZE_MAX, 0);
    assert_int_equal(status, QMAT_ERROR_MEMORY);
    assert_string_not_equal(s->context.error.message, "");
    end(s);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_share_is_left_with_what_was_held),
      cmocka_unit_test(test_the_points_keep_their_witnesses_in_the_dense_medial_mesh),
      cmocka_unit_test(test_threads_change_no_byte),
      cmocka_unit_test(test_spheres_in_one_place_are_one_part),
      cmocka_unit_test(test_what_depends_on_the_order_is_not_done_in_parts),
      cmocka_unit_test(test_it_ends_when_it_is_cancelled),
      cmocka_unit_test(test_a_shortage_of_memory_anywhere_is_an_error),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
