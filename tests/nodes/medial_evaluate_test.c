/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"

#define ROUNDING 1e-8
#define COUNT(array) (sizeof(array) / sizeof *(array))

/* ---- a medial mesh, a surface, and the report on both ---- */

static void seal(qmat_medial *medial) {
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_context_uninit(&context);
}

typedef struct subject {
  qmat_mesh *mesh;
  qmat_medial *medial;
  double diagonal;
} subject;

/* Takes both over, and seals them. */
static subject subject_of(qmat_mesh *mesh, qmat_medial *medial) {
  subject s = {.mesh = shape_seal(mesh), .medial = medial};
  seal(medial);
  s.diagonal = pipeline_diagonal(mesh);
  return s;
}

static void subject_free(subject *s) {
  qmat_value_release(&s->mesh->base);
  qmat_value_release(&s->medial->base);
}

static qmat_report *evaluate(const subject *s, const char *params, int threads) {
  qmat_value *output = NULL;
  pipeline_must_run(threads, "medial.evaluate", params, (const qmat_value *[]){&s->mesh->base, &s->medial->base},
                    &output);
  return (qmat_report *)output;
}

static bool is_true(const qmat_report *report, const char *key) {
  const json_t *value = json_object_get(report->root, key);
  assert_true(json_is_boolean(value));
  return json_is_true(value);
}

/* Whether the bounds of that name hold the length `expected` (model units), as narrow as promised. */
static void check_bounds(const subject *s, const qmat_report *report, const char *name, double expected,
                         double tolerance) {
  char at_least[64];
  snprintf(at_least, sizeof at_least, "%s_at_least", name);
  const double lo = pipeline_number(report, at_least), hi = pipeline_number(report, name);
  const double share = tolerance * fmax(pipeline_number(report, "epsilon"), lo);
  expected /= s->diagonal;
  if (!(lo <= expected + ROUNDING && expected <= hi + ROUNDING) || !(hi - lo <= share + ROUNDING))
    fail_msg("%s: %.9f is not within [%.9f, %.9f]", name, expected, lo, hi);
}

/* ---- by hand ---- */

static void test_a_ball_in_a_cube_by_hand(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 1};
  subject s = subject_of(shape_box_around(1, 1, 1), medial_mesh(ball, 1, NULL, 0, NULL, 0));
  qmat_report *report = evaluate(&s, "samples=20000", 0);
  check_bounds(&s, report, "surface_to_envelope", sqrt(3) - 1, 0.05);
  /* Under a corner of the cube the ball is the farthest from all sides. */
  check_bounds(&s, report, "envelope_to_surface", 1 - 1 / sqrt(3), 0.05);
  assert_true(pipeline_number(report, "envelope_out_of_solid_at_least") <= ROUNDING);
  assert_true(pipeline_number(report, "envelope_out_of_solid") <= 0.25 * 0.01 + ROUNDING);
  /* The mean over a side of its distance from the ball, and over the ball of its from the cube, by quadrature. */
  double side = 0, shell = 0;
  const int n = 400;
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      const double x = (i + 0.5) / n, y = (j + 0.5) / n, square = 1 + x * x + y * y;
      side += (sqrt(square) - 1) / (n * n);
      shell += 6 * 4 / (4 * 3.14159265358979) * (1 - 1 / sqrt(square)) / (square * sqrt(square)) / (n * n);
    }
  assert_near(pipeline_number(report, "surface_to_envelope_mean") * s.diagonal, side, 0.01 * side);
  assert_near(pipeline_number(report, "surface_offset_mean") * s.diagonal, side, 0.01 * side);
  assert_near(pipeline_number(report, "envelope_to_surface_mean") * s.diagonal, shell, 0.01 * shell);
  assert_int_equal(pipeline_count(report, "spheres"), 1);
  assert_int_equal(pipeline_count(report, "components"), 1);
  assert_int_equal(pipeline_count(report, "components_of_solid"), 1);
  assert_int_equal(pipeline_count(report, "spheres_outside"), 0);
  assert_int_equal(pipeline_count(report, "samples_of_envelope"), 20000);
  assert_false(is_true(report, "certified") || is_true(report, "estimate"));
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_a_ball_that_leaves_a_cube_by_hand(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 1.2};
  subject s = subject_of(shape_box_around(1, 1, 1), medial_mesh(ball, 1, NULL, 0, NULL, 0));
  qmat_report *report = evaluate(&s, "tolerance=0.01 epsilon=5%", 0);
  check_bounds(&s, report, "surface_to_envelope", sqrt(3) - 1.2, 0.01);
  check_bounds(&s, report, "envelope_to_surface", 1 - 1.2 / sqrt(3), 0.01);
  check_bounds(&s, report, "envelope_out_of_solid", 0.2, 0.01);
  assert_near(pipeline_number(report, "surface_depth_in_envelope_sampled") * s.diagonal, 0.2, 0.01);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_cones_and_slabs_by_hand(void **state) {
  (void)state;
  static const double spheres[] = {-1, 0, 0, 0.5, 1, 0, 0, 0.5, 0, 1.5, 0, 0.5};
  static const uint32_t edge[] = {0, 1}, slab[] = {0, 1, 2};
  /* A capsule as long as the box and half as wide: farthest from the surface on the middle lines of its mantle... */
  subject s = subject_of(shape_box_around(1.5, 1, 1), medial_mesh(spheres, 2, edge, 1, NULL, 0));
  qmat_report *report = evaluate(&s, "", 0);
  check_bounds(&s, report, "surface_to_envelope", sqrt(0.25 + 2) - 0.5, 0.05);
  check_bounds(&s, report, "envelope_to_surface", 1 - 0.5 / sqrt(2), 0.05);
  qmat_value_release(&report->base);
  subject_free(&s);
  /* ... and a slab in a wide plate, whose sheets are 0.5 from its sides and whose mantles are 1 where they are level.
   */
  s = subject_of(shape_box_around(9, 9, 1), medial_mesh(spheres, 3, NULL, 0, slab, 1));
  report = evaluate(&s, "", 0);
  check_bounds(&s, report, "surface_to_envelope", sqrt(64 + 81 + 1) - 0.5, 0.05);
  check_bounds(&s, report, "envelope_to_surface", 1, 0.05);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_a_sheet_alone_makes_the_boundary_where_it_is_wide(void **state) {
  (void)state;
  /* A slab of three balls that swells out of a thin plate: its sheets are parallel to the plate, out by 0.3. */
  static const double spheres[] = {-3, -2, 0, 0.8, 3, -2, 0, 0.8, 0, 3, 0, 0.8};
  static const uint32_t slab[] = {0, 1, 2};
  subject s = subject_of(shape_box_around(9, 9, 0.5), medial_mesh(spheres, 3, NULL, 0, slab, 1));
  qmat_report *report = evaluate(&s, "", 0);
  check_bounds(&s, report, "envelope_out_of_solid", 0.3, 0.05);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_the_groove_between_two_balls_is_the_farthest(void **state) {
  (void)state;
  /* Their common circle has the radius 0.6; it is farthest where y = z. The rest of both balls is no part of it. */
  static const double balls[] = {-0.8, 0, 0, 1, 0.8, 0, 0, 1};
  subject s = subject_of(shape_box_around(1.8, 1, 1), medial_mesh(balls, 2, NULL, 0, NULL, 0));
  qmat_report *report = evaluate(&s, "", 0);
  check_bounds(&s, report, "envelope_to_surface", 1 - 0.6 / sqrt(2), 0.05);
  assert_int_equal(pipeline_count(report, "components"), 2);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_a_cavity_in_the_envelope_counts(void **state) {
  (void)state;
  /* Six balls at the sides of a cube leave room around its centre: the boundary there is 1.3 - 0.8 = 0.5 from it. */
  double balls[24];
  for (int i = 0; i < 6; i++)
    for (int k = 0; k < 4; k++) balls[4 * i + k] = k == 3 ? 0.8 : k == i / 2 ? (i % 2 ? -1.3 : 1.3) : 0;
  subject s = subject_of(shape_box_around(2.1, 2.1, 2.1), medial_mesh(balls, 6, NULL, 0, NULL, 0));
  qmat_report *report = evaluate(&s, "", 0);
  check_bounds(&s, report, "envelope_to_surface", 2.1 - 0.5, 0.05);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_certified_exactly_where_epsilon_holds(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 1};
  subject s = subject_of(shape_box_around(1, 1, 1), medial_mesh(ball, 1, NULL, 0, NULL, 0));
  const double truth = (sqrt(3) - 1) / s.diagonal;
  char params[64];
  for (int i = 0; i < 2; i++) { /* within the tolerance of 5 %: what is undecided is searched on */
    snprintf(params, sizeof params, "epsilon=%.9f", truth * (i == 0 ? 0.995 : 1.005));
    qmat_report *report = evaluate(&s, params, 0);
    assert_int_equal(is_true(report, "certified"), i == 1);
    qmat_value_release(&report->base);
  }
  qmat_report *report = evaluate(&s, "epsilon=0", 0);
  assert_false(is_true(report, "certified"));
  check_bounds(&s, report, "surface_to_envelope", sqrt(3) - 1, 0.05);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_the_deviation_of_the_mesh_is_part_of_both_errors(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 1};
  qmat_mesh *cube = shape_box_around(1, 1, 1);
  cube->deviation = 0.01;
  subject s = subject_of(cube, medial_mesh(ball, 1, NULL, 0, NULL, 0));
  qmat_report *report = evaluate(&s, "tolerance=0.01", 0);
  const struct {
    const char *key, *at_least;
    double length;
  } errors[] = {{"surface_to_envelope", "surface_to_envelope_at_least", sqrt(3) - 1},
                {"envelope_to_surface", "envelope_to_surface_at_least", 1 - 1 / sqrt(3)}};
  for (size_t i = 0; i < sizeof errors / sizeof errors[0]; i++) {
    const double lo = pipeline_number(report, errors[i].at_least) * s.diagonal;
    const double hi = pipeline_number(report, errors[i].key) * s.diagonal;
    assert_true(lo <= errors[i].length - cube->deviation + ROUNDING);
    assert_true(hi >= errors[i].length + cube->deviation - ROUNDING);
    assert_true(hi <= errors[i].length + cube->deviation + 0.02);
  }
  qmat_value_release(&report->base);
  subject_free(&s);
}

/* The figure `key` is told from every epsilon that is 1, 1 + `step`, ... up to `most` thousandths above it, for balls
 * at random. */
static void check_epsilon_is_told_from(const char *key, uint64_t seed, int step, int most) {
  random_numbers random = {.seed = seed};
  for (int i = 0; i < 40; i++) {
    double balls[4 * 12];
    for (int k = 0; k < 48; k++) balls[k] = random_between(&random, k % 4 == 3 ? 0.02 : -0.6, k % 4 == 3 ? 0.4 : 0.6);
    subject s = subject_of(shape_box_around(0.7, 0.8, 0.9), medial_mesh(balls, 12, NULL, 0, NULL, 0));
    qmat_report *close = evaluate(&s, "epsilon=0 tolerance=0.001", 1);
    const double truth = pipeline_number(close, key);
    qmat_value_release(&close->base);
    for (int share = 1; share <= most; share += step) {
      char params[64];
      const double epsilon = truth * (1 + 0.001 * share);
      snprintf(params, sizeof params, "epsilon=%.12f samples=16", epsilon);
      qmat_report *report = evaluate(&s, params, 1);
      if (!(pipeline_number(report, key) <= epsilon))
        fail_msg("%.9f is not told from %.9f", pipeline_number(report, key), epsilon);
      qmat_value_release(&report->base);
    }
    subject_free(&s);
  }
}

/* Looks at middles of pieces only come closer and closer to the farthest place, where several primitives are as near:
 * an epsilon that is a thousandth above it is told from it. */
static void test_epsilon_is_told_from_what_looks_creep_up_to(void **state) {
  (void)state;
  check_epsilon_is_told_from("surface_to_envelope", 11, 4, 41);
}

/* The same for the envelope's boundary. */
static void test_epsilon_is_told_from_the_distance_of_the_boundary(void **state) {
  (void)state;
  check_epsilon_is_told_from("envelope_to_surface", 12, 1, 4);
}

/* The farthest place, as far from both balls, is on a long edge. Pieces as small as the tolerance allows do not tell an
 * epsilon slightly above it from it. */
static void test_an_epsilon_just_above_the_error_is_certified(void **state) {
  (void)state;
  const double x = 0.137, left = sqrt((x + 0.9) * (x + 0.9) + 2), right = sqrt((x - 0.9) * (x - 0.9) + 2);
  const double balls[] = {-0.9, 0, 0, 0.7, 0.9, 0, 0, 0.7 + right - left};
  subject s = subject_of(shape_box_around(1.5, 1, 1), medial_mesh(balls, 2, NULL, 0, NULL, 0));
  const double truth = (left - 0.7) / s.diagonal;
  for (double above = 1e-4; above > 4e-6; above /= 2) {
    char params[64];
    snprintf(params, sizeof params, "epsilon=%.12f", truth * (1 + above));
    qmat_report *report = evaluate(&s, params, 0);
    assert_true(pipeline_number(report, "surface_to_envelope") >= truth - ROUNDING);
    if (above > 1e-5) assert_true(pipeline_number(report, "surface_to_envelope") <= truth * (1 + above));
    qmat_value_release(&report->base);
  }
  qmat_report *report = evaluate(&s, "epsilon=0.2", 0);
  check_bounds(&s, report, "surface_to_envelope", truth * s.diagonal, 0.05);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_an_open_surface_is_never_certified(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 1};
  qmat_mesh *mesh = shape_box_around(1, 1, 1);
  mesh->triangle_count--;
  subject s = subject_of(mesh, medial_mesh(ball, 1, NULL, 0, NULL, 0));
  qmat_report *report = evaluate(&s, "epsilon=50%", 0);
  assert_true(pipeline_number(report, "surface_to_envelope") < 0.5);
  assert_true(pipeline_number(report, "envelope_to_surface") < 0.5);
  assert_false(is_true(report, "certified"));
  assert_true(is_true(report, "estimate"));
  assert_null(json_object_get(report->root, "loops_of_solid"));
  assert_int_equal(pipeline_count(report, "loops"), 0);
  qmat_value_release(&report->base);
  subject_free(&s);
}

static void test_odd_spheres_cones_and_slabs_are_counted(void **state) {
  (void)state;
  static const double spheres[] = {0,    0, 0, 1,   0, 0, 0, 1, /* twice */
                                   0.1,  0, 0, 0.2,             /* within the first */
                                   1.5,  0, 0, 0.1,             /* outside */
                                   -1,   0, 0, 0,               /* on the surface */
                                   -0.5, 0, 0, 0.3};
  static const uint32_t edges[] = {0, 1, 0, 2, 0, 5}, slabs[] = {0, 3, 5}; /* collinear, and holds its third corner */
  subject s = subject_of(shape_box_around(1, 1, 1), medial_mesh(spheres, 6, edges, 3, slabs, 1));
  qmat_report *report = evaluate(&s, "", 0);
  assert_int_equal(pipeline_count(report, "duplicate_spheres"), 1);
  assert_int_equal(pipeline_count(report, "spheres_outside"), 1);
  assert_int_equal(pipeline_count(report, "degenerate_cones"), 3);
  assert_int_equal(pipeline_count(report, "degenerate_slabs"), 1);
  assert_int_equal(pipeline_count(report, "edges"), 5);
  assert_int_equal(pipeline_count(report, "components"), 2);
  check_bounds(&s, report, "envelope_out_of_solid", 0.6, 0.05);
  qmat_value_release(&report->base);
  subject_free(&s);
}

/* ---- against brute force ---- */

static void random_direction(random_numbers *random, double d[3]) {
  double square;
  do {
    square = 0;
    for (int k = 0; k < 3; k++) {
      d[k] = random_between(random, -1, 1);
      square += d[k] * d[k];
    }
  } while (square > 1 || square < 0.01);
  for (int k = 0; k < 3; k++) d[k] /= sqrt(square);
}

/* The largest distances over many points: of the surface to the envelope, of the envelope's boundary to the surface. A
 * point of the boundary is found by walking out of a random medial sphere until F is 0. Unit frame. */
static void sample_densely(const subject *s, int count_of_each, double *out, double *back) {
  qmat_context context = {0};
  qmat_surface *surface;
  qmat_envelope *envelope;
  random_numbers random = {.seed = 3};
  assert_int_equal(qmat_surface_new(&context, s->mesh, &surface), QMAT_OK);
  qmat_medial unit = *s->medial;
  unit.spheres = qmat_alloc(4 * unit.sphere_count, sizeof *unit.spheres);
  qmat_frame_spheres_to_unit(qmat_surface_frame(surface), s->medial->spheres, unit.sphere_count, unit.spheres);
  assert_int_equal(qmat_envelope_of_medial(&context, &unit, &envelope), QMAT_OK);
  const double *positions = qmat_surface_positions(surface);
  *out = *back = 0;
  for (int i = 0; i < count_of_each; i++) {
    const uint32_t *row = &s->mesh->triangles[3 * random_index(&random, s->mesh->triangle_count)];
    double x = random_between(&random, 0, 1), y = random_between(&random, 0, 1), point[3], d[3], sphere[4] = {0};
    if (x + y > 1) x = 1 - x, y = 1 - y;
    for (size_t k = 0; k < 3; k++)
      point[k] =
          (1 - x - y) * positions[3 * row[0] + k] + x * positions[3 * row[1] + k] + y * positions[3 * row[2] + k];
    *out = fmax(*out, qmat_envelope_distance(envelope, point, NULL));
    uint32_t ids[3];
    const int count =
        qmat_envelope_primitive(envelope, random_index(&random, qmat_envelope_primitive_count(envelope)), ids);
    const double weights[3] = {count == 1 ? 1 : count == 2 ? 1 - x : 1 - x - y, x, y};
    for (int j = 0; j < count; j++)
      for (size_t k = 0; k < 4; k++) sphere[k] += weights[j] * unit.spheres[4 * (size_t)ids[j] + k];
    random_direction(&random, d);
    memcpy(point, sphere, sizeof point);
    for (int step = 0; step < 200; step++) { /* F is 1-Lipschitz: such a step stays within */
      const double f = qmat_envelope_distance(envelope, point, NULL);
      for (int k = 0; k < 3; k++) point[k] -= f * d[k];
      if (f > -1e-10) break;
    }
    if (fabs(qmat_envelope_distance(envelope, point, NULL)) < 1e-6)
      *back = fmax(*back, qmat_surface_distance(surface, point, INFINITY, NULL, NULL));
  }
  qmat_free(unit.spheres);
  qmat_envelope_free(envelope);
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
}

/* No sampled point is beyond the bounds, and the samples come as close to them as `gap` (diagonals); `narrow`: the
 * bounds are as narrow as promised. */
static void check_against_samples(const subject *s, int samples, double gap, bool narrow) {
  double out, back;
  qmat_report *report = evaluate(s, "epsilon=1% tolerance=0.05", 0);
  sample_densely(s, samples, &out, &back);
  static const char *const names[] = {"surface_to_envelope", "envelope_to_surface"};
  const double found[] = {fmax(out, 0), back};
  for (int i = 0; i < 2; i++) {
    char at_least[64];
    snprintf(at_least, sizeof at_least, "%s_at_least", names[i]);
    const double lo = pipeline_number(report, at_least), hi = pipeline_number(report, names[i]);
    if (!(found[i] <= hi + 1e-6) || !(lo <= hi) || !(found[i] >= lo - gap) ||
        (narrow && !(hi - lo <= 0.05 * fmax(0.01, lo) + ROUNDING)))
      fail_msg("%s: samples reach %.6f, the bounds are [%.6f, %.6f]", names[i], found[i], lo, hi);
  }
  qmat_value_release(&report->base);
}

static void test_random_medial_meshes_against_dense_samples(void **state) {
  (void)state;
  random_numbers random = {.seed = 7};
  for (int round = 0; round < 12; round++) {
    double spheres[4 * 7];
    uint32_t edges[6], triangles[9];
    for (size_t i = 0; i < COUNT(spheres); i++)
      spheres[i] = i % 4 == 3 ? random_between(&random, 0, 0.5) : random_between(&random, 0, i % 4 == 2 ? 1 : 2);
    for (size_t i = 0; i < COUNT(edges); i++) edges[i] = (uint32_t)random_index(&random, 7);
    for (size_t i = 0; i < COUNT(triangles); i++) triangles[i] = (uint32_t)random_index(&random, 7);
    subject s = subject_of(shape_l(), medial_mesh(spheres, 7, edges, 3, triangles, 3));
    check_against_samples(&s, 10000, 0.02, true);
    subject_free(&s);
  }
}

static void test_a_simplified_torus_against_dense_samples(void **state) {
  (void)state;
  pipeline p;
  qmat_value *simplified[2];
  pipeline_make(&p, pipeline_model("torus", 12), "", "");
  pipeline_must_run(0, "medial.simplify", "epsilon=2%",
                    (const qmat_value *[]){&p.mesh->base, &p.thickness->base, &p.samples->base, &p.medial->base},
                    simplified);
  subject s = {.mesh = p.mesh, .medial = (qmat_medial *)simplified[0], .diagonal = pipeline_diagonal(p.mesh)};
  qmat_report *report = evaluate(&s, "epsilon=2%", 0);
  assert_int_equal(pipeline_count(report, "loops_of_solid"), 1);
  assert_int_equal(pipeline_count(report, "euler_characteristic"), pipeline_euler(s.medial));
  assert_true(pipeline_number(report, "surface_to_envelope") <= 0.02);
  qmat_value_release(&report->base);
  check_against_samples(&s, 10000, 0.01, true);
  qmat_value_release(simplified[0]);
  qmat_value_release(simplified[1]);
  pipeline_free(&p);
}

static void test_a_crowd_of_balls_against_dense_samples(void **state) {
  (void)state;
  /* Of so many primitives space is searched, not their surfaces. */
  enum { BALLS = 70000 };
  random_numbers random = {.seed = 11};
  double *spheres = malloc(4 * BALLS * sizeof *spheres);
  assert_non_null(spheres);
  for (size_t i = 0; i < 4 * BALLS; i++)
    spheres[i] = random_between(&random, 0, i % 4 == 3 ? 0.05 : i % 4 == 2 ? 1 : 2);
  subject s = subject_of(shape_l(), medial_mesh(spheres, BALLS, NULL, 0, NULL, 0));
  check_against_samples(&s, 10000, 0.02, false);
  qmat_report *report = evaluate(&s, "epsilon=10%", 0);
  assert_true(pipeline_number(report, "envelope_to_surface") - pipeline_number(report, "envelope_to_surface_at_least") <
              0.1);
  qmat_value_release(&report->base);
  subject_free(&s);
  free(spheres);
}

/* ---- properties ---- */

static qmat_medial *some_medial(void) {
  static const double spheres[] = {0.4, 0.5, 0.5, 0.4, 1.5, 0.5, 0.5, 0.45, 0.5, 1.6, 0.5, 0.3, 0.6, 0.6, 0.7, 0.2};
  static const uint32_t edges[] = {0, 1, 0, 2}, slab[] = {0, 2, 3};
  return medial_mesh(spheres, 4, edges, 2, slab, 1);
}

static void test_scale_and_place_change_nothing_but_rounding(void **state) {
  (void)state;
  subject s = subject_of(shape_l(), some_medial());
  qmat_mesh *mesh = shape_l();
  qmat_medial *medial = some_medial();
  shape_map(mesh, 1000, -40, 7, 11);
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double shift[] = {-40, 7, 11, 0};
    for (size_t k = 0; k < 4; k++) medial->spheres[4 * i + k] = 1000 * medial->spheres[4 * i + k] + shift[k];
  }
  subject moved = subject_of(mesh, medial);
  qmat_report *a = evaluate(&s, "", 0), *b = evaluate(&moved, "", 0);
  const char *key;
  json_t *value;
  json_object_foreach(a->root, key, value) {
    const json_t *other = json_object_get(b->root, key);
    if (strcmp(key, "diagonal") == 0) {
      assert_near(json_real_value(other), 1000 * json_real_value(value), 1e-9);
      continue;
    }
    /* Rounding may turn a look at a piece into one at its parts: the bounds stay as close as they promise. */
    if (json_is_real(value)) assert_near(json_real_value(other), json_real_value(value), 1e-4);
    if (json_is_boolean(value)) assert_int_equal(json_is_true(other), json_is_true(value));
    if (json_is_integer(value) && strncmp(key, "pieces", 6) != 0 && strncmp(key, "samples", 7) != 0)
      assert_int_equal(json_integer_value(other), json_integer_value(value));
  }
  qmat_value_release(&a->base);
  qmat_value_release(&b->base);
  subject_free(&s);
  subject_free(&moved);
}

static void test_a_turn_moves_the_bounds_no_farther_than_they_are_apart(void **state) {
  (void)state;
  subject s = subject_of(shape_l(), some_medial());
  qmat_mesh *mesh = shape_l();
  qmat_medial *medial = some_medial();
  qmat_mesh *centres = shape_new(); /* turned as the mesh is */
  for (size_t i = 0; i < medial->sphere_count; i++)
    shape_vertex(centres, medial->spheres[4 * i], medial->spheres[4 * i + 1], medial->spheres[4 * i + 2]);
  shape_rotate(mesh);
  shape_rotate(centres);
  for (size_t i = 0; i < medial->sphere_count; i++)
    memcpy(&medial->spheres[4 * i], &centres->positions[3 * i], 3 * sizeof(double));
  qmat_value_release(&centres->base);
  subject turned = subject_of(mesh, medial);
  qmat_report *a = evaluate(&s, "", 0), *b = evaluate(&turned, "", 0);
  static const char *const names[] = {"surface_to_envelope", "envelope_to_surface", "envelope_out_of_solid"};
  for (size_t i = 0; i < COUNT(names); i++) {
    char at_least[64];
    snprintf(at_least, sizeof at_least, "%s_at_least", names[i]);
    assert_true(pipeline_number(a, at_least) * s.diagonal <= pipeline_number(b, names[i]) * turned.diagonal + ROUNDING);
    assert_true(pipeline_number(b, at_least) * turned.diagonal <= pipeline_number(a, names[i]) * s.diagonal + ROUNDING);
  }
  qmat_value_release(&a->base);
  qmat_value_release(&b->base);
  subject_free(&s);
  subject_free(&turned);
}

static void test_threads_change_no_byte(void **state) {
  (void)state;
  subject s = subject_of(shape_l(), some_medial());
  qmat_report *one = evaluate(&s, "epsilon=2%", 1);
  static const int threads[] = {2, 8, 1};
  for (size_t i = 0; i < COUNT(threads); i++) {
    qmat_report *report = evaluate(&s, "epsilon=2%", threads[i]);
    assert_memory_equal(&report->base.digest, &one->base.digest, sizeof one->base.digest);
    qmat_value_release(&report->base);
  }
  qmat_value_release(&one->base);
  subject_free(&s);
}

/* ---- errors ---- */

static void check_refused(qmat_medial *medial, const char *message, int64_t element) {
  subject s = subject_of(shape_box_around(1, 1, 1), medial);
  qmat_context context = {0};
  qmat_value *output = NULL;
  const qmat_value *inputs[] = {&s.mesh->base, &s.medial->base};
  assert_int_equal(pipeline_run(&context, "medial.evaluate", "", inputs, &output), QMAT_ERROR_GEOMETRY);
  assert_non_null(strstr(context.error.message, message));
  assert_string_equal(context.error.field, "medial");
  assert_int_equal(context.error.element, element);
  assert_null(output);
  qmat_context_uninit(&context);
  subject_free(&s);
}

static void test_no_sphere_and_far_spheres_are_refused(void **state) {
  (void)state;
  static const double far_away[] = {0, 0, 0, 1, 1e9, 0, 0, 1};
  check_refused(medial_mesh(NULL, 0, NULL, 0, NULL, 0), "no sphere", -1);
  check_refused(medial_mesh(far_away, 2, NULL, 0, NULL, 0), "far away", 1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_ball_in_a_cube_by_hand),
      cmocka_unit_test(test_a_ball_that_leaves_a_cube_by_hand),
      cmocka_unit_test(test_cones_and_slabs_by_hand),
      cmocka_unit_test(test_a_sheet_alone_makes_the_boundary_where_it_is_wide),
      cmocka_unit_test(test_the_groove_between_two_balls_is_the_farthest),
      cmocka_unit_test(test_a_cavity_in_the_envelope_counts),
      cmocka_unit_test(test_certified_exactly_where_epsilon_holds),
      cmocka_unit_test(test_the_deviation_of_the_mesh_is_part_of_both_errors),
      cmocka_unit_test(test_epsilon_is_told_from_what_looks_creep_up_to),
      cmocka_unit_test(test_epsilon_is_told_from_the_distance_of_the_boundary),
      cmocka_unit_test(test_an_epsilon_just_above_the_error_is_certified),
      cmocka_unit_test(test_an_open_surface_is_never_certified),
      cmocka_unit_test(test_odd_spheres_cones_and_slabs_are_counted),
      cmocka_unit_test(test_random_medial_meshes_against_dense_samples),
      cmocka_unit_test(test_a_simplified_torus_against_dense_samples),
      cmocka_unit_test(test_a_crowd_of_balls_against_dense_samples),
      cmocka_unit_test(test_scale_and_place_change_nothing_but_rounding),
      cmocka_unit_test(test_a_turn_moves_the_bounds_no_farther_than_they_are_apart),
      cmocka_unit_test(test_threads_change_no_byte),
      cmocka_unit_test(test_no_sphere_and_far_spheres_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
