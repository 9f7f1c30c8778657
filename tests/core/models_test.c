/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The generated models are what they say: everything that is built on them rests on this. */
#include "examples/models.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/shapes.h"

static const int resolutions[] = {4, 7, 16, 33, 0};
enum { RESOLUTIONS = sizeof resolutions / sizeof resolutions[0] };

/* Calls `check` with every model at every resolution. */
static void for_each_model(void (*check)(const qmat_model *model, int resolution)) {
  for (size_t i = 0; i < qmat_model_kind_count; i++) {
    for (int r = 0; r < RESOLUTIONS; r++) {
      qmat_model model;
      assert_int_equal(qmat_model_make(qmat_model_kinds[i].name, resolutions[r], &model), QMAT_OK);
      assert_string_equal(model.name, qmat_model_kinds[i].name);
      check(&model, resolutions[r] == 0 ? qmat_model_kinds[i].default_resolution : resolutions[r]);
      qmat_model_uninit(&model);
    }
  }
}

static void fail_model(const qmat_model *model, int resolution, const char *what, double actual, double expected) {
  print_error("%s at %d: %s: %.17g against %.17g\n", model->name, resolution, what, actual, expected);
  fail();
}

static const double *corner(const qmat_model *model, size_t triangle, int k) {
  return model->positions + 3 * (size_t)model->triangles[3 * triangle + (size_t)k];
}

static void cross_of(const qmat_model *model, size_t triangle, double normal[3]) {
  const double *a = corner(model, triangle, 0), *b = corner(model, triangle, 1), *c = corner(model, triangle, 2);
  double u[3], v[3];
  for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = c[k] - a[k];
  for (int k = 0; k < 3; k++) normal[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
}

static double area_of(const qmat_model *model) {
  double area = 0, n[3];
  for (size_t t = 0; t < model->triangle_count; t++) {
    cross_of(model, t, n);
    area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
  }
  return area;
}

static double volume_of(const qmat_model *model) {
  double volume = 0, n[3];
  for (size_t t = 0; t < model->triangle_count; t++) {
    const double *a = corner(model, t, 0);
    cross_of(model, t, n);
    volume += (a[0] * n[0] + a[1] * n[1] + a[2] * n[2]) / 6;
  }
  return volume;
}

static double diagonal_of(const qmat_model *model) {
  double sum = 0;
  for (int k = 0; k < 3; k++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < model->vertex_count; i++) {
      low = fmin(low, model->positions[3 * i + (size_t)k]);
      high = fmax(high, model->positions[3 * i + (size_t)k]);
    }
    sum += (high - low) * (high - low);
  }
  return sqrt(sum);
}

static int compare_ids(const void *left, const void *right) {
  const uint64_t *a = left, *b = right;
  return *a < *b ? -1 : *a > *b;
}

/* The directed edges, sorted. */
static uint64_t *directed_edges(const qmat_model *model) {
  const size_t count = 3 * model->triangle_count;
  uint64_t *edges = calloc(count, sizeof *edges);
  assert_non_null(edges);
  for (size_t i = 0; i < count; i++) {
    const uint64_t from = model->triangles[i], to = model->triangles[i % 3 == 2 ? i - 2 : i + 1];
    assert_true(from < model->vertex_count && to < model->vertex_count && from != to);
    edges[i] = from << 32 | to;
  }
  qsort(edges, count, sizeof *edges, compare_ids);
  return edges;
}

static void check_manifold(const qmat_model *model, int resolution) {
  const size_t count = 3 * model->triangle_count;
  uint64_t *edges = directed_edges(model);
  for (size_t i = 0; i < count; i++) {
    if (i > 0 && edges[i] == edges[i - 1]) fail_model(model, resolution, "an edge twice the same way", (double)i, 0);
    const uint64_t back = edges[i] << 32 | edges[i] >> 32;
    if (bsearch(&back, edges, count, sizeof back, compare_ids) == NULL) {
      fail_model(model, resolution, "an open edge", (double)(edges[i] >> 32), (double)(uint32_t)edges[i]);
    }
  }
  free(edges);
  const long euler = (long)model->vertex_count - (long)(count / 2) + (long)model->triangle_count;
  if (euler != model->euler) fail_model(model, resolution, "Euler characteristic", (double)euler, model->euler);
}

/* Around each vertex the triangles form one fan: edges alone would let two parts touch in a vertex. */
static void check_fans(const qmat_model *model, int resolution) {
  uint32_t *next = calloc(3 * model->triangle_count, sizeof *next),
           *degree = calloc(model->vertex_count, sizeof *degree);
  uint32_t *start = calloc(model->vertex_count, sizeof *start);
  uint64_t *edges = calloc(3 * model->triangle_count, sizeof *edges);
  assert_true(next && degree && edges && start);
  /* per corner: vertex, and the neighbour where the triangle begins -> the one where it ends */
  const size_t count = 3 * model->triangle_count;
  for (size_t i = 0; i < count; i++) {
    const size_t t = i - i % 3;
    edges[i] = (uint64_t)model->triangles[i] << 32 | model->triangles[t + (i + 1) % 3];
    degree[model->triangles[i]]++;
  }
  uint64_t *sorted = calloc(count, sizeof *sorted);
  assert_non_null(sorted);
  memcpy(sorted, edges, count * sizeof *sorted);
  qsort(sorted, count, sizeof *sorted, compare_ids);
  for (size_t i = 0; i < count; i++) {
    const size_t t = i - i % 3;
    const uint64_t *at = bsearch(edges + i, sorted, count, sizeof *sorted, compare_ids);
    assert_non_null(at);
    next[at - sorted] = model->triangles[t + (i + 2) % 3];
    start[model->triangles[i]] = model->triangles[t + (i + 1) % 3];
  }
  for (size_t v = 0; v < model->vertex_count; v++) {
    if (degree[v] < 3) fail_model(model, resolution, "a vertex of few triangles", (double)v, degree[v]);
    uint32_t steps = 0, at = start[v];
    do {
      const uint64_t key = (uint64_t)v << 32 | at;
      const uint64_t *row = bsearch(&key, sorted, count, sizeof *sorted, compare_ids);
      assert_non_null(row);
      at = next[row - sorted];
      steps++;
    } while (at != start[v] && steps <= degree[v]);
    if (steps != degree[v]) fail_model(model, resolution, "two fans at a vertex", (double)v, steps);
  }
  free(sorted);
  free(edges);
  free(next);
  free(degree);
  free(start);
}

static int compare_facets(const void *left, const void *right) {
  return memcmp(left, right, 3 * sizeof(uint32_t));
}

static void check_facets(const qmat_model *model, int resolution) {
  const double diagonal = diagonal_of(model);
  uint32_t *sorted = calloc(3 * model->triangle_count, sizeof *sorted);
  assert_non_null(sorted);
  for (size_t t = 0; t < model->triangle_count; t++) {
    uint32_t *row = sorted + 3 * t;
    memcpy(row, model->triangles + 3 * t, 3 * sizeof *row);
    for (int pass = 0; pass < 2; pass++) {
      for (int k = 0; k < 2; k++) {
        if (row[k] <= row[k + 1]) continue;
        const uint32_t swap = row[k];
        row[k] = row[k + 1], row[k + 1] = swap;
      }
    }
    double n[3];
    cross_of(model, t, n);
    if (!(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 1e-24 * pow(diagonal, 4))) {
      fail_model(model, resolution, "a facet without area", (double)t, 0);
    }
  }
  qsort(sorted, model->triangle_count, 3 * sizeof *sorted, compare_facets);
  for (size_t t = 1; t < model->triangle_count; t++) {
    if (compare_facets(sorted + 3 * t - 3, sorted + 3 * t) == 0) fail_model(model, resolution, "a facet twice", 0, 0);
  }
  free(sorted);
}

/* A shell of thickness `deviation` on the surface holds the difference between the mesh and the solid. */
static void check_volume(const qmat_model *model, int resolution) {
  const double volume = volume_of(model);
  if (isnan(model->volume)) {
    if (!(volume > 0)) fail_model(model, resolution, "volume", volume, 0);
    return;
  }
  const double slack = area_of(model) * model->deviation + 1e-9 * model->volume;
  if (fabs(volume - model->volume) > slack) fail_model(model, resolution, "volume", volume, model->volume);
}

/* Squared distance from the origin to the segment a b. */
static double segment_distance2(const double a[3], const double b[3]) {
  double along = 0, length = 0, sum = 0;
  for (int k = 0; k < 3; k++) {
    along -= a[k] * (b[k] - a[k]);
    length += (b[k] - a[k]) * (b[k] - a[k]);
  }
  const double t = length > 0 ? fmin(1, fmax(0, along / length)) : 0;
  for (int k = 0; k < 3; k++) sum += (a[k] + t * (b[k] - a[k])) * (a[k] + t * (b[k] - a[k]));
  return sum;
}

/* By brute force: the foot on the plane of each triangle where it is inside, else the sides. */
static double distance_to_surface(const qmat_model *model, const double p[3]) {
  double best = INFINITY;
  for (size_t t = 0; t < model->triangle_count; t++) {
    double v[3][3], n[3], area2 = 0, height = 0;
    for (int c = 0; c < 3; c++) {
      for (int k = 0; k < 3; k++) v[c][k] = corner(model, t, c)[k] - p[k];
    }
    cross_of(model, t, n);
    for (int k = 0; k < 3; k++) area2 += n[k] * n[k], height += n[k] * v[0][k];
    bool over = true;
    for (int c = 0; c < 3; c++) {
      const double *a = v[c], *b = v[(c + 1) % 3];
      double side = 0;
      for (int k = 0; k < 3; k++) side += n[k] * (a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
      over = over && side >= 0;
      best = fmin(best, segment_distance2(a, b));
    }
    if (over) best = fmin(best, height * height / area2);
  }
  return sqrt(best);
}

/* Each known medial sphere touches the surface and does not come out of it. */
static void check_medial(const qmat_model *model, int resolution) {
  if (resolution > 100) return;
  const double slack = model->deviation + model->medial_deviation + 1e-9;
  const size_t step = model->sphere_count > 200 ? model->sphere_count / 100 : 1;
  for (size_t i = 0; i < model->sphere_count; i += step) {
    const double *s = model->spheres + 4 * i, distance = distance_to_surface(model, s);
    if (fabs(distance - s[3]) > slack) fail_model(model, resolution, "a medial sphere's radius", s[3], distance);
  }
  for (size_t e = 0; e < model->edge_count; e++) {
    const uint32_t *ids = model->edges + 2 * e;
    assert_true(ids[0] < ids[1] && ids[1] < model->sphere_count);
  }
  for (size_t t = 0; t < model->medial_triangle_count; t++) {
    const uint32_t *ids = model->medial_triangles + 3 * t;
    assert_true(ids[0] < model->sphere_count && ids[1] < model->sphere_count && ids[2] < model->sphere_count);
    assert_true(ids[0] != ids[1] && ids[1] != ids[2] && ids[0] != ids[2]);
  }
}

static void test_every_model_is_closed_and_oriented_and_has_its_euler_characteristic(void **state) {
  (void)state;
  for_each_model(check_manifold);
}

static void test_the_triangles_around_every_vertex_form_one_fan(void **state) {
  (void)state;
  for_each_model(check_fans);
}

static void test_no_facet_is_degenerate_or_there_twice(void **state) {
  (void)state;
  for_each_model(check_facets);
}

static void test_the_volume_is_the_closed_form_within_the_deviation(void **state) {
  (void)state;
  for_each_model(check_volume);
}

static void test_known_medial_spheres_touch_the_surface(void **state) {
  (void)state;
  for_each_model(check_medial);
}

static void test_the_volume_converges_with_the_square_of_the_resolution(void **state) {
  (void)state;
  static const char *const round_models[] = {"sphere", "capsule", "tapered-capsule", "torus"};
  for (size_t i = 0; i < sizeof round_models / sizeof round_models[0]; i++) {
    double error[2];
    for (int pass = 0; pass < 2; pass++) {
      qmat_model model;
      assert_int_equal(qmat_model_make(round_models[i], pass == 0 ? 30 : 120, &model), QMAT_OK);
      error[pass] = fabs(volume_of(&model) / model.volume - 1);
      qmat_model_uninit(&model);
    }
    assert_true(error[0] < 0.03);
    assert_near(error[0] / error[1], 16, 2);
  }
}

/* The distance of a point from the ideal surface of the round models, by their formulas. */
static double ideal_distance(const char *name, const double p[3]) {
  if (strcmp(name, "torus") == 0) return fabs(hypot(hypot(p[0], p[1]) - 2, p[2]) - 0.6);
  const double away = hypot(p[1], p[2]);
  if (strcmp(name, "sphere") == 0) return fabs(hypot(p[0], away) - 1);
  const double end = strcmp(name, "capsule") == 0 ? 1 : 0.3, slope = (end - 1) / 3,
               lean = slope / sqrt(1 - slope * slope);
  const double foot = fmin(3, fmax(0, p[0] + away * lean));
  return fabs(hypot(p[0] - foot, away) - (1 + slope * foot));
}

static void test_vertices_lie_on_the_ideal_surface_and_facets_within_the_deviation(void **state) {
  (void)state;
  static const char *const names[] = {"sphere", "capsule", "tapered-capsule", "torus"};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
    for (int resolution = 5; resolution < 100; resolution += 13) {
      qmat_model model;
      assert_int_equal(qmat_model_make(names[i], resolution, &model), QMAT_OK);
      for (size_t v = 0; v < model.vertex_count; v++) {
        assert_near(ideal_distance(names[i], model.positions + 3 * v), 0, 1e-12);
      }
      double worst = 0;
      for (size_t t = 0; t < model.triangle_count; t++) {
        for (int a = 0; a <= 8; a++) {
          for (int b = 0; a + b <= 8; b++) {
            double p[3];
            for (int k = 0; k < 3; k++) {
              p[k] =
                  (a * corner(&model, t, 0)[k] + b * corner(&model, t, 1)[k] + (8 - a - b) * corner(&model, t, 2)[k]) /
                  8;
            }
            worst = fmax(worst, ideal_distance(names[i], p));
          }
        }
      }
      if (worst > model.deviation) fail_model(&model, resolution, "deviation", worst, model.deviation);
      qmat_model_uninit(&model);
    }
  }
}

static double signed_volume(const double *a, const double *b, const double *c, const double *d) {
  double u[3], v[3], w[3];
  for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = c[k] - a[k], w[k] = d[k] - a[k];
  return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
}

static bool segment_meets(const double *p, const double *q, const double *a, const double *b, const double *c) {
  const double up = signed_volume(a, b, c, p), down = signed_volume(a, b, c, q);
  if (!((up > 0 && down < 0) || (up < 0 && down > 0))) return false;
  const double x = signed_volume(p, q, a, b), y = signed_volume(p, q, b, c), z = signed_volume(p, q, c, a);
  return (x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0);
}

/* Tentacles that ran into each other would leave every count as it is. */
static void check_octopus_cuts(int resolution) {
  qmat_model model;
  assert_int_equal(qmat_model_make("octopus", resolution, &model), QMAT_OK);
  double(*boxes)[6] = calloc(model.triangle_count, sizeof *boxes);
  assert_non_null(boxes);
  for (size_t t = 0; t < model.triangle_count; t++) {
    for (int k = 0; k < 3; k++) {
      const double a = corner(&model, t, 0)[k], b = corner(&model, t, 1)[k], c = corner(&model, t, 2)[k];
      boxes[t][k] = fmin(a, fmin(b, c));
      boxes[t][3 + k] = fmax(a, fmax(b, c));
    }
  }
  for (size_t s = 0; s < model.triangle_count; s++) {
    for (size_t t = 0; t < model.triangle_count; t++) {
      const double *f = boxes[s], *g = boxes[t];
      if (f[0] > g[3] || g[0] > f[3] || f[1] > g[4] || g[1] > f[4] || f[2] > g[5] || g[2] > f[5]) continue;
      for (int k = 0; k < 3; k++) {
        const uint32_t p = model.triangles[3 * s + (size_t)k], q = model.triangles[3 * s + (size_t)(k + 1) % 3];
        bool shared = false; /* rounding may put a common corner on either side */
        for (size_t c = 0; c < 3; c++)
          shared = shared || model.triangles[3 * t + c] == p || model.triangles[3 * t + c] == q;
        if (shared || !segment_meets(corner(&model, s, k), corner(&model, s, (k + 1) % 3), corner(&model, t, 0),
                                     corner(&model, t, 1), corner(&model, t, 2))) {
          continue;
        }
        fail_model(&model, resolution, "an edge through a facet", (double)s, (double)t);
      }
    }
  }
  free(boxes);
  qmat_model_uninit(&model);
}

static void test_the_octopus_does_not_cut_itself(void **state) {
  (void)state;
  check_octopus_cuts(4);
  check_octopus_cuts(32);
}

static void test_the_octopus_has_tips_of_four_thousandths_of_the_diagonal(void **state) {
  (void)state;
  qmat_model model;
  assert_int_equal(qmat_model_make("octopus", 0, &model), QMAT_OK);
  double thinnest = INFINITY;
  for (size_t i = 0; i < model.sphere_count; i++) thinnest = fmin(thinnest, model.spheres[4 * i + 3]);
  assert_near(thinnest / diagonal_of(&model), 0.004, 0.0005);
  qmat_model_uninit(&model);
}

static void test_sheets_are_one_hundredth_of_the_diagonal_thick(void **state) {
  (void)state;
  static const char *const names[] = {"sheet", "curved-sheet"};
  for (int i = 0; i < 2; i++) {
    qmat_model model;
    assert_int_equal(qmat_model_make(names[i], 0, &model), QMAT_OK);
    double widest = 0;
    for (size_t k = 0; k < model.sphere_count; k++) widest = fmax(widest, model.spheres[4 * k + 3]);
    assert_near(2 * widest / diagonal_of(&model), 0.01, 0.0015);
    qmat_model_uninit(&model);
  }
}

static void test_the_medial_mesh_of_a_cube_meets_in_one_sphere(void **state) {
  (void)state;
  qmat_model cube, prism;
  assert_int_equal(qmat_model_make_box(2, 2, 2, 6, &cube), QMAT_OK);
  assert_int_equal(cube.sphere_count, 9);
  assert_int_equal(cube.medial_triangle_count, 12);
  check_medial(&cube, 6);
  qmat_model_uninit(&cube);
  assert_int_equal(qmat_model_make_box(4, 2, 2, 6, &prism), QMAT_OK);
  assert_int_equal(prism.sphere_count, 10);
  check_medial(&prism, 6);
  qmat_model_uninit(&prism);
}

static void test_the_same_call_gives_the_same_bytes(void **state) {
  (void)state;
  qmat_model a, b;
  assert_int_equal(qmat_model_make("octopus", 16, &a), QMAT_OK);
  assert_int_equal(qmat_model_make("octopus", 16, &b), QMAT_OK);
  assert_int_equal(a.vertex_count, b.vertex_count);
  assert_memory_equal(a.positions, b.positions, 3 * a.vertex_count * sizeof *a.positions);
  assert_memory_equal(a.triangles, b.triangles, 3 * a.triangle_count * sizeof *a.triangles);
  qmat_model_uninit(&a);
  qmat_model_uninit(&b);
}

static void test_bad_names_resolutions_and_measures_are_usage_errors_and_leave_nothing(void **state) {
  (void)state;
  qmat_model model;
  assert_int_equal(qmat_model_make("teapot", 0, &model), QMAT_ERROR_USAGE);
  assert_null(model.positions);
  assert_int_equal(qmat_model_make("sphere", 3, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make("sphere", -1, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make("octopus", QMAT_MODEL_RESOLUTION_MAX + 1, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make_capsule(2, 1, 1, 16, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make_capsule(1, 1, NAN, 16, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make_capsule(-1, 1, 5, 16, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make_box(1, 2, 3, 16, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make_box(1, 1, 0, 16, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make_torus(1, 1, 16, &model), QMAT_ERROR_USAGE);
  assert_int_equal(qmat_model_make_sheet(1, 1, 0.01, 4, 16, &model), QMAT_ERROR_USAGE);
  assert_null(model.triangles);
  qmat_model_uninit(&model);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_model_is_closed_and_oriented_and_has_its_euler_characteristic),
      cmocka_unit_test(test_the_triangles_around_every_vertex_form_one_fan),
      cmocka_unit_test(test_no_facet_is_degenerate_or_there_twice),
      cmocka_unit_test(test_the_volume_is_the_closed_form_within_the_deviation),
      cmocka_unit_test(test_known_medial_spheres_touch_the_surface),
      cmocka_unit_test(test_the_volume_converges_with_the_square_of_the_resolution),
      cmocka_unit_test(test_vertices_lie_on_the_ideal_surface_and_facets_within_the_deviation),
      cmocka_unit_test(test_the_octopus_does_not_cut_itself),
      cmocka_unit_test(test_the_octopus_has_tips_of_four_thousandths_of_the_diagonal),
      cmocka_unit_test(test_sheets_are_one_hundredth_of_the_diagonal_thick),
      cmocka_unit_test(test_the_medial_mesh_of_a_cube_meets_in_one_sphere),
      cmocka_unit_test(test_the_same_call_gives_the_same_bytes),
      cmocka_unit_test(test_bad_names_resolutions_and_measures_are_usage_errors_and_leave_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
