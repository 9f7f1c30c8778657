/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/point_repair.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "nodes/simplify/decimation.h"
#include "nodes/simplify/thresholds.h"
#include "tests/shapes.h"

/* A bar of 2 x 0.1 x 0.1 along the x-axis and a chain of three spheres in it. The middle one lies a little too low and
 * is a little too small. Constraint points are rings of four on the sides, and at the end the newest one, above the
 * middle. */
enum { SPHERES = 3, RINGS = 19, OLDER = 4 * RINGS, POINTS = OLDER + 1, MIDDLE = 1 };

static const double half_width = 0.05, limit = 0.004;

typedef struct bar {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
  qmat_medial *medial;
  qmat_constraint_points constraints;
  qmat_failed_places failed;
  qmat_decimation run;
  double points[3 * POINTS], scale;
} bar;

static void make_points(bar *b, const double newest[3]) {
  static const double sides[4][2] = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}};
  for (int i = 0; i < OLDER; i++) {
    b->points[3 * i] = -0.9 + 1.8 * (i / 4) / (RINGS - 1);
    for (int k = 0; k < 2; k++) b->points[3 * i + 1 + k] = half_width * sides[i % 4][k];
  }
  memcpy(&b->points[3 * OLDER], newest, 3 * sizeof *newest);
  qmat_constraint_points *c = &b->constraints;
  *c = (qmat_constraint_points){.count = POINTS, .sample_count = POINTS, .surface_count = POINTS, .points = b->points};
  qmat_arena *arena = &b->context.arena;
  c->witnesses = qmat_arena_alloc(arena, POINTS, 3 * sizeof(uint32_t));
  c->weights = qmat_arena_calloc(arena, POINTS, 3 * sizeof(double));
  c->distances = qmat_arena_calloc(arena, POINTS, sizeof(double));
  assert_true(c->witnesses && c->weights && c->distances);
  for (size_t i = 0; i < POINTS; i++) {
    const double x = b->points[3 * i], share = fabs(x) / 0.9;
    c->witnesses[3 * i] = MIDDLE;
    c->witnesses[3 * i + 1] = x < 0 ? 0 : 2;
    c->witnesses[3 * i + 2] = QMAT_NONE;
    c->weights[3 * i] = 1 - share;
    c->weights[3 * i + 1] = share;
  }
  qmat_frame_to_unit(qmat_surface_frame(b->surface), b->points, POINTS, b->points);
}

/* The older points may be as far as they are; the newest is strict. */
static void make_bar(bar *b, const double newest[3], const double middle[4]) {
  *b = (bar){.context = {.threads = 1}};
  b->mesh = shape_new();
  shape_add_box(b->mesh, -1, -half_width, -half_width, 1, half_width, half_width, false);
  shape_seal(b->mesh);
  assert_int_equal(qmat_surface_new(&b->context, b->mesh, &b->surface), QMAT_OK);
  const qmat_frame *frame = qmat_surface_frame(b->surface);
  b->scale = 1 / frame->diagonal;
  static const double ends[2][4] = {{-0.9, 0, 0, 0.05}, {0.9, 0, 0, 0.05}};
  static const uint32_t edges[4] = {0, 1, 1, 2};
  b->medial = qmat_medial_new();
  b->medial->sphere_count = SPHERES;
  b->medial->spheres = qmat_alloc(SPHERES, 4 * sizeof(double));
  memcpy(b->medial->spheres, ends[0], sizeof ends[0]);
  memcpy(&b->medial->spheres[4 * MIDDLE], middle, sizeof ends[0]);
  memcpy(&b->medial->spheres[8], ends[1], sizeof ends[1]);
  qmat_frame_spheres_to_unit(frame, b->medial->spheres, SPHERES, b->medial->spheres);
  assert_int_equal(qmat_medial_set_simplices(&b->context, b->medial, edges, 2, NULL, 0), QMAT_OK);
  make_points(b, newest);
  b->run = (qmat_decimation){.context = &b->context,
                             .surface = b->surface,
                             .rules = {.limit = limit * b->scale,
                                       .share = 1,
                                       .finest = limit * b->scale,
                                       .k = 1e-5,
                                       .repairs = true,
                                       .crease_share = 0.5},
                             .failed_places = &b->failed};
  assert_int_equal(qmat_complex_init(&b->context, &b->run.complex, b->medial, NULL), QMAT_OK);
  double depths[SPHERES];
  for (size_t i = 0; i < SPHERES; i++)
    depths[i] = -qmat_surface_signed_distance(b->surface, &b->medial->spheres[4 * i]);
  const double strict[1] = {limit * b->scale};
  for (size_t i = 0; i < POINTS; i++) {
    double sphere[4] = {0, 0, 0, 0};
    for (size_t k = 0; k < 2; k++)
      for (size_t j = 0; j < 4; j++)
        sphere[j] +=
            b->constraints.weights[3 * i + k] * b->medial->spheres[4 * (size_t)b->constraints.witnesses[3 * i + k] + j];
    double to_centre = 0;
    for (size_t k = 0; k < 3; k++) to_centre += pow(b->points[3 * i + k] - sphere[k], 2);
    b->constraints.distances[i] = i < OLDER ? fmax(sqrt(to_centre) - sphere[3], strict[0]) : 0;
  }
  assert_int_equal(qmat_decimation_init(&b->run, &b->constraints, depths), QMAT_OK);
  b->run.newest_surface_count = 1;
}

static void free_bar(bar *b) {
  qmat_decimation_uninit(&b->run);
  qmat_failed_places_uninit(&b->failed);
  qmat_value_release(&b->medial->base);
  qmat_surface_free(b->surface);
  qmat_value_release(&b->mesh->base);
  qmat_context_uninit(&b->context);
}

/* The distance of a point to the sphere of the envelope that it is nearest to, tried along both cones. */
static double distance(const bar *b, size_t point) {
  double least = INFINITY;
  for (int i = 0; i <= 2000; i++) {
    const uint32_t first = i < 1000 ? 0 : 1;
    const double share = (i - 1000.0 * first) / 1000;
    const double *p = &b->run.complex.spheres[4 * (size_t)first], *q = p + 4;
    double square = 0;
    for (size_t k = 0; k < 3; k++) square += pow(b->points[3 * point + k] - (1 - share) * p[k] - share * q[k], 2);
    least = fmin(least, sqrt(square) - (1 - share) * p[3] - share * q[3]);
  }
  return least;
}

static const double low[4] = {0, 0, -0.003, 0.047}, above[3] = {0, 0, half_width};

static void test_a_sphere_moves_until_the_place_is_within_epsilon(void **state) {
  (void)state;
  bar b;
  make_bar(&b, above, low);
  double before[POINTS];
  for (size_t i = 0; i < POINTS; i++) before[i] = distance(&b, i);
  double ends[2][4];
  memcpy(ends[0], b.run.complex.spheres, sizeof ends[0]);
  memcpy(ends[1], &b.run.complex.spheres[8], sizeof ends[1]);
  assert_int_equal(qmat_decimation_repair(&b.run), QMAT_OK);
  assert_true(b.run.moves > 0);
  const double epsilon = limit * b.scale;
  assert_near(before[OLDER], 1.5 * epsilon, 1e-6); /* 0.053 - 0.047; the cones are hardly nearer */
  for (size_t i = 0; i < POINTS; i++) assert_true(distance(&b, i) <= fmax(before[i], epsilon) * (1 + 1e-6));
  assert_true(distance(&b, OLDER) <= epsilon * (1 + 1e-6));
  /* No sphere leaves the bar by more than epsilon. */
  for (size_t v = 0; v < SPHERES; v++) {
    const double *sphere = &b.run.complex.spheres[4 * v];
    assert_true(sphere[3] + qmat_surface_signed_distance(b.surface, sphere) <= epsilon * (1 + 1e-9));
  }
  /* The sphere of the witness moves alone where that is enough. */
  assert_memory_equal(b.run.complex.spheres, ends[0], sizeof ends[0]);
  assert_memory_equal(&b.run.complex.spheres[8], ends[1], sizeof ends[1]);
  assert_int_equal(b.run.complex.live_vertices, SPHERES);
  assert_int_equal(qmat_decimation_drop_exceeded(&b.run, &b.constraints), QMAT_OK);
  assert_true(b.run.surface_tracker.limits[OLDER] <= epsilon * (1 + 1e-12));
  free_bar(&b);
}

static void check_nothing_moves(bar *b) {
  double before[4 * SPHERES];
  memcpy(before, b->run.complex.spheres, sizeof before);
  assert_int_equal(qmat_decimation_repair(&b->run), QMAT_OK);
  assert_int_equal(b->run.moves, 0);
  assert_memory_equal(b->run.complex.spheres, before, sizeof before);
}

/* No sphere may leave the solid by what this point asks for: its limit is lifted, so that it hinders nothing later. */
static void test_a_place_out_of_reach_moves_nothing_and_is_given_up(void **state) {
  (void)state;
  bar b;
  make_bar(&b, (const double[3]){0, 0, 0.3}, low);
  check_nothing_moves(&b);
  assert_int_equal(qmat_decimation_drop_exceeded(&b.run, &b.constraints), QMAT_OK);
  assert_true(b.run.surface_tracker.limits[OLDER] == INFINITY);
  assert_true(b.constraints.distances[OLDER] == INFINITY);
  assert_true(b.run.surface_tracker.limits[0] < INFINITY);
  assert_int_equal(b.failed.count, 1);
  assert_memory_equal(b.failed.points, &b.points[3 * OLDER], 3 * sizeof(double));
  free_bar(&b);
}

/* The place could be repaired, but several places within epsilon of it could not. */
static void test_a_place_near_failed_ones_is_passed_over(void **state) {
  (void)state;
  bar b;
  make_bar(&b, above, low);
  b.failed = (qmat_failed_places){.points = qmat_alloc(3 * QMAT_MOST_FAILED_REPAIRS, sizeof *b.failed.points),
                                  .count = QMAT_MOST_FAILED_REPAIRS,
                                  .capacity = QMAT_MOST_FAILED_REPAIRS};
  assert_non_null(b.failed.points);
  for (size_t i = 0; i < QMAT_MOST_FAILED_REPAIRS; i++) {
    memcpy(&b.failed.points[3 * i], &b.points[3 * OLDER], 3 * sizeof *b.failed.points);
    b.failed.points[3 * i] += 0.5 * limit * b.scale;
  }
  check_nothing_moves(&b);
  b.failed.count--;
  assert_int_equal(qmat_decimation_repair(&b.run), QMAT_OK);
  assert_true(b.run.moves > 0);
  free_bar(&b);
}

static void test_places_within_epsilon_move_nothing(void **state) {
  (void)state;
  bar b;
  make_bar(&b, above, (const double[4]){0, 0, 0, half_width});
  check_nothing_moves(&b);
  assert_int_equal(qmat_decimation_drop_exceeded(&b.run, &b.constraints), QMAT_OK);
  assert_true(b.run.surface_tracker.limits[OLDER] < INFINITY);
  free_bar(&b);
  /* Nor where there are no newest points. */
  make_bar(&b, above, low);
  b.run.newest_surface_count = 0;
  check_nothing_moves(&b);
  free_bar(&b);
}

/* Both cones are tubular features: their spheres stay, from the start or from the later stage on. */
static void test_protected_spheres_stay(void **state) {
  (void)state;
  static const struct {
    qmat_protection protect;
    size_t late_spheres;
    bool stays;
  } cases[] = {{QMAT_PROTECT_ALWAYS, 0, true},
               {QMAT_PROTECT_LATE, SPHERES, true},
               {QMAT_PROTECT_LATE, SPHERES - 1, false},
               {QMAT_PROTECT_OFF, SPHERES, false}};
  uint8_t thin[POINTS];
  memset(thin, 1, sizeof thin);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    bar b;
    make_bar(&b, above, low);
    b.constraints.sample_point_count = POINTS;
    b.run.rules.thin = thin;
    b.run.rules.protect = cases[i].protect;
    b.run.rules.late_spheres = cases[i].late_spheres;
    if (cases[i].stays) {
      check_nothing_moves(&b);
    } else {
      assert_int_equal(qmat_decimation_repair(&b.run), QMAT_OK);
      assert_true(b.run.moves > 0);
    }
    free_bar(&b);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_sphere_moves_until_the_place_is_within_epsilon),
      cmocka_unit_test(test_a_place_out_of_reach_moves_nothing_and_is_given_up),
      cmocka_unit_test(test_a_place_near_failed_ones_is_passed_over),
      cmocka_unit_test(test_places_within_epsilon_move_nothing),
      cmocka_unit_test(test_protected_spheres_stay),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
