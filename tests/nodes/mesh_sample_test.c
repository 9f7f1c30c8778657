/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/frame.h"
#include "core/node.h"
#include "tests/nodes/pipeline.h"
#include "tests/shapes.h"

extern const qmat_node qmat_node_mesh_sample;

/* What a run makes. */
typedef struct result {
  qmat_samples *samples;
  qmat_report *report;
} result;

static qmat_field *field_of(size_t count, const double *values, double otherwise) {
  qmat_context context = {0};
  qmat_field *field = qmat_field_new();
  assert_non_null(field);
  field->count = count;
  field->values = qmat_alloc(count, sizeof *field->values);
  field->unit = qmat_strdup("model unit");
  field->domain = QMAT_PER_FACET;
  for (size_t i = 0; i < count; i++) field->values[i] = values != NULL ? values[i] : otherwise;
  assert_int_equal(qmat_value_seal(&context, &field->base), QMAT_OK);
  qmat_context_uninit(&context);
  return field;
}

/* Without a spacing unless the text gives one: most tests are of eq. 7 alone. */
static qmat_status try_sample(qmat_context *context, const qmat_mesh *mesh, const qmat_field *thickness,
                              const char *text, result *made) {
  char settings[256];
  assert_true(snprintf(settings, sizeof settings, "spacing=0 %s", text) < (int)sizeof settings);
  qmat_value *outputs[PIPELINE_MOST_PORTS] = {NULL};
  const qmat_status status =
      pipeline_run(context, "mesh.sample", settings, (const qmat_value *[]){&mesh->base, &thickness->base}, outputs);
  assert_int_equal(status == QMAT_OK, outputs[0] != NULL);
  assert_int_equal(status == QMAT_OK, outputs[1] != NULL);
  *made = (result){(qmat_samples *)outputs[0], (qmat_report *)outputs[1]};
  return status;
}

static int64_t reported(const result *made, const char *name) {
  const json_t *number = json_object_get(made->report->root, name);
  assert_true(json_is_integer(number));
  return json_integer_value(number);
}

static void release(const result *made) {
  qmat_value_release(&made->samples->base);
  qmat_value_release(&made->report->base);
}

/* Every sample lies on its facet at its barycentrics; vertices come first. */
static void check_samples(const qmat_mesh *mesh, const result *made) {
  const qmat_samples *samples = made->samples;
  assert_true(samples->base.sealed && made->report->base.sealed);
  assert_int_equal(samples->vertex_count, mesh->vertex_count);
  assert_memory_equal(samples->positions, mesh->positions, 3 * mesh->vertex_count * sizeof(double));
  assert_int_equal(reported(made, "samples"), samples->count);
  assert_int_equal(reported(made, "vertices"), mesh->vertex_count);
  assert_int_equal(reported(made, "added"), samples->count - mesh->vertex_count);
  assert_int_equal(
      reported(made, "added_by_area") + reported(made, "added_by_thickness") + reported(made, "added_by_spacing"),
      reported(made, "added") + reported(made, "dropped"));
  for (size_t i = 0; i < samples->count; i++) {
    const double *weights = samples->barycentrics + 3 * i;
    const uint32_t *ids = mesh->triangles + 3 * (size_t)samples->facets[i];
    assert_true(samples->facets[i] < mesh->triangle_count);
    for (int k = 0; k < 3; k++) assert_true(weights[k] >= 0 && weights[k] <= 1);
    assert_near(weights[0] + weights[1] + weights[2], 1, 1e-15);
    for (size_t k = 0; k < 3; k++) {
      double expected = 0;
      for (size_t c = 0; c < 3; c++) expected += weights[c] * mesh->positions[3 * (size_t)ids[c] + k];
      assert_near(samples->positions[3 * i + k], expected, 0);
    }
    if (i > mesh->vertex_count) assert_true(samples->facets[i] >= samples->facets[i - 1]);
    if (i < mesh->vertex_count) {
      /* A vertex names its first facet. */
      for (size_t t = 0; t < 3 * (size_t)samples->facets[i]; t++) assert_true(mesh->triangles[t] != i);
    }
  }
}

static result sample(const qmat_mesh *mesh, const qmat_field *thickness, const char *text) {
  qmat_context context = {0};
  result made;
  if (try_sample(&context, mesh, thickness, text, &made) != QMAT_OK) fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
  check_samples(mesh, &made);
  return made;
}

static size_t count_on(const qmat_samples *samples, uint32_t facet) {
  size_t count = 0;
  for (size_t i = samples->vertex_count; i < samples->count; i++) count += samples->facets[i] == facet;
  return count;
}

/* Two right triangles at the origin, of areas 1 and 4. */
static qmat_mesh *one_and_four(void) {
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 0, 0, 0);
  shape_vertex(mesh, 2, 0, 0);
  shape_vertex(mesh, 0, 1, 0);
  shape_vertex(mesh, -4, 0, 0);
  shape_vertex(mesh, 0, -2, 0);
  shape_triangle(mesh, 0, 1, 2);
  shape_triangle(mesh, 0, 3, 4);
  return shape_seal(mesh);
}

static void test_areas_one_and_four_add_three(void **state) {
  (void)state;
  qmat_mesh *mesh = one_and_four();
  static const double thick[2] = {1, 1};
  qmat_field *thickness = field_of(2, thick, 0);
  result made = sample(mesh, thickness, "theta=0.5");
  assert_int_equal(count_on(made.samples, 0), 0);
  assert_int_equal(count_on(made.samples, 1), 3);
  assert_int_equal(reported(&made, "added_by_area"), 3);
  assert_int_equal(reported(&made, "added_by_thickness"), 0);
  assert_int_equal(reported(&made, "thin_facets"), 0);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_thin_facets_add_n_f(void **state) {
  (void)state;
  qmat_mesh *mesh = one_and_four();
  /* Mean 2: at theta = 0.5 the first is thin, exactly at the threshold. */
  static const double uneven[2] = {1, 3};
  qmat_field *thickness = field_of(2, uneven, 0);
  result made = sample(mesh, thickness, "theta=0.5 n_f=2");
  assert_int_equal(count_on(made.samples, 0), 2);
  assert_int_equal(count_on(made.samples, 1), 3);
  assert_int_equal(reported(&made, "added_by_thickness"), 2);
  assert_int_equal(reported(&made, "thin_facets"), 1);
  assert_near(json_real_value(json_object_get(made.report->root, "thickness_threshold")), 1, 0);
  release(&made);
  made = sample(mesh, thickness, "theta=0.49 n_f=2");
  assert_int_equal(made.samples->count, 5 + 3);
  release(&made);
  made = sample(mesh, thickness, "theta=10 n_f=16");
  assert_int_equal(made.samples->count, 5 + 16 + 19);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_facet_is_not_its_own_neighbour(void **state) {
  (void)state;
  /* A single facet has no neighbour to compare with. */
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 0, 0, 0);
  shape_vertex(mesh, 3, 0, 0);
  shape_vertex(mesh, 0, 3, 3);
  shape_triangle(mesh, 0, 1, 2);
  shape_seal(mesh);
  qmat_field *thickness = field_of(1, NULL, 1);
  result made = sample(mesh, thickness, "theta=0.5");
  assert_int_equal(made.samples->count, 3);
  release(&made);
  /* One sample lies at the centroid. */
  made = sample(mesh, thickness, "theta=1");
  assert_int_equal(made.samples->count, 4);
  for (size_t k = 0; k < 3; k++) assert_near(made.samples->positions[9 + k], 1, 1e-15);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_equal_areas_add_nothing_whatever_their_rounding(void **state) {
  (void)state;
  for (int variant = 0; variant < 2; variant++) {
    qmat_mesh *mesh = shape_box(1, 1, 1);
    if (variant == 1) shape_rotate(mesh);
    shape_map(mesh, 0.1, 1.0 / 3, 0, 0);
    shape_seal(mesh);
    qmat_field *thickness = field_of(12, NULL, 1);
    result made = sample(mesh, thickness, "");
    assert_int_equal(made.samples->count, 8);
    release(&made);
    qmat_value_release(&thickness->base);
    qmat_value_release(&mesh->base);
  }
}

/* Right triangles at the origin, of the given areas, each with its own two other corners. */
static qmat_mesh *fan(const double *areas, size_t count) {
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 0, 0, 0);
  for (size_t i = 0; i < count; i++) {
    const double side = sqrt(2 * areas[i]), height = (double)i;
    /* In planes that turn around the x axis. */
    const uint32_t a = shape_vertex(mesh, side, 0, 0);
    shape_triangle(mesh, 0, a, shape_vertex(mesh, 0, side * cos(height), side * sin(height)));
  }
  return shape_seal(mesh);
}

/* A sliver is as small a neighbour as a square of 0.15 of the spacing: here 1/64 in the model's unit. */
static void test_slivers_count_as_a_square_of_a_share_of_the_spacing(void **state) {
  (void)state;
  static const double areas[5] = {0.11, 0.13, 0.125, 1e-6, 0.01};
  qmat_mesh *mesh = fan(areas, 5);
  qmat_frame frame;
  qmat_context context = {0};
  assert_int_equal(qmat_frame_of_mesh(&context, mesh, &frame), QMAT_OK);
  qmat_context_uninit(&context);
  qmat_field *thickness = field_of(5, NULL, 1);
  char text[64];
  snprintf(text, sizeof text, "spacing=%.17g", 0.125 / 0.15 / frame.diagonal);
  result made = sample(mesh, thickness, text);
  assert_int_equal(count_on(made.samples, 0), 7); /* ceil(7.04) - 1 */
  assert_int_equal(count_on(made.samples, 1), 8); /* ceil(8.32) - 1 */
  assert_int_equal(count_on(made.samples, 2), 7);
  assert_int_equal(count_on(made.samples, 3), 0);
  assert_int_equal(count_on(made.samples, 4), 0);
  assert_int_equal(reported(&made, "capped"), 0);
  release(&made);
  made = sample(mesh, thickness, "max_per_facet=20");
  for (uint32_t i = 0; i < 5; i++) assert_int_equal(count_on(made.samples, i), i == 3 ? 0 : 20);
  assert_int_equal(reported(&made, "capped"), 4);
  release(&made);
  made = sample(mesh, thickness, "max_per_facet=0 theta=1");
  assert_int_equal(made.samples->count, 11);
  assert_int_equal(reported(&made, "capped"), 5);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_degenerate_facets_get_none_and_are_no_neighbours(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  const uint32_t middle = shape_vertex(mesh, 0.5, 0, 0);
  shape_triangle(mesh, 0, 1, middle);
  shape_triangle(mesh, 3, 3, 5);
  shape_seal(mesh);
  qmat_field *thickness = field_of(14, NULL, 1);
  result made = sample(mesh, thickness, "theta=1 n_f=3");
  for (uint32_t i = 0; i < 12; i++) assert_int_equal(count_on(made.samples, i), 3);
  assert_int_equal(made.samples->count, 9 + 36);
  assert_int_equal(reported(&made, "degenerate_facets"), 2);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_limit_on_samples_thins_all_facets_evenly(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(1, 0.3, 20, 10));
  qmat_field *thickness = field_of(400, NULL, 1);
  result all = sample(mesh, thickness, "theta=0.5");
  const size_t by_area = all.samples->count - 200;
  release(&all);
  result made = sample(mesh, thickness, "theta=1 n_f=2");
  assert_int_equal(made.samples->count, 200 + by_area + 800);
  assert_int_equal(reported(&made, "dropped"), 0);
  release(&made);

  made = sample(mesh, thickness, "theta=1 n_f=2 max_samples=600");
  assert_int_equal(made.samples->count, 600);
  assert_int_equal(reported(&made, "dropped"), by_area + 400);
  /* Any stretch of facets keeps its share. */
  for (uint32_t begin = 0; begin < 400; begin += 40) {
    size_t here = 0;
    for (uint32_t i = begin; i < begin + 40; i++) here += count_on(made.samples, i);
    assert_true(here >= 25 && here <= 55);
  }
  release(&made);
  made = sample(mesh, thickness, "theta=1 n_f=2 max_samples=100");
  assert_int_equal(made.samples->count, 200);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_random_points_are_uniform_on_a_facet(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(1, 0.3, 40, 20));
  qmat_field *thickness = field_of(1600, NULL, 1);
  result made = sample(mesh, thickness, "theta=1 n_f=16 lloyd_rounds=0");
  const size_t first = made.samples->vertex_count, count = made.samples->count - first;
  assert_true(count > 20000);
  /* Uniform points have barycentrics of mean 1/3 and mean square 1/6; each lies in a corner's half with chance 1/4. */
  double mean[3] = {0}, square[3] = {0}, corner[3] = {0};
  for (size_t i = first; i < made.samples->count; i++) {
    for (size_t k = 0; k < 3; k++) {
      const double weight = made.samples->barycentrics[3 * i + k];
      mean[k] += weight / (double)count;
      square[k] += weight * weight / (double)count;
      corner[k] += (weight > 0.5) / (double)count;
    }
  }
  for (int k = 0; k < 3; k++) {
    assert_near(mean[k], 1.0 / 3, 0.01);
    assert_near(square[k], 1.0 / 6, 0.01);
    assert_near(corner[k], 0.25, 0.015);
  }
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

/* The least distance between two samples of a facet, its corners included. */
static double least_distance(const qmat_mesh *mesh, const qmat_samples *samples, uint32_t facet) {
  double points[80][3], least = INFINITY;
  size_t count = 0;
  for (size_t c = 0; c < 3; c++) {
    memcpy(points[count++], mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)facet + c], sizeof points[0]);
  }
  for (size_t i = samples->vertex_count; i < samples->count; i++) {
    if (samples->facets[i] == facet) memcpy(points[count++], samples->positions + 3 * i, sizeof points[0]);
  }
  for (size_t i = 0; i < count; i++) {
    for (size_t j = 0; j < i; j++) {
      double square = 0;
      for (int k = 0; k < 3; k++) square += (points[i][k] - points[j][k]) * (points[i][k] - points[j][k]);
      least = fmin(least, sqrt(square));
    }
  }
  return least;
}

/* The mean squared distance from a facet's points to the nearest sample or corner, which Lloyd's relaxation lowers. */
static double quantisation_error(const qmat_mesh *mesh, const qmat_samples *samples, uint32_t facet) {
  enum { STEPS = 60 };
  double sum = 0;
  size_t count = 0;
  const uint32_t *ids = mesh->triangles + 3 * (size_t)facet;
  for (int a = 0; a < STEPS; a++) {
    for (int b = 0; a + b < STEPS; b++) {
      const double u = (a + 1.0 / 3) / STEPS, v = (b + 1.0 / 3) / STEPS;
      double point[3], least = INFINITY;
      for (size_t k = 0; k < 3; k++) {
        point[k] = (1 - u - v) * mesh->positions[3 * (size_t)ids[0] + k] + u * mesh->positions[3 * (size_t)ids[1] + k] +
                   v * mesh->positions[3 * (size_t)ids[2] + k];
      }
      for (size_t i = 0; i < samples->count; i++) {
        const bool corner = i == ids[0] || i == ids[1] || i == ids[2];
        if (!corner && (i < samples->vertex_count || samples->facets[i] != facet)) continue;
        double square = 0;
        for (size_t k = 0; k < 3; k++) {
          square += (point[k] - samples->positions[3 * i + k]) * (point[k] - samples->positions[3 * i + k]);
        }
        least = fmin(least, square);
      }
      sum += least;
      count++;
    }
  }
  return sum / (double)count;
}

static void test_lloyd_spreads_samples(void **state) {
  (void)state;
  /* Facets of many shapes: an equilateral one, needles, obtuse ones. */
  enum { FACETS = 12 };
  qmat_mesh *mesh = shape_new();
  for (uint32_t i = 0; i < FACETS; i++) {
    const double apex = 0.5 + 0.2 * i, height = 0.9 / (1 + 0.5 * i);
    const uint32_t a = shape_vertex(mesh, 0, 0, i), b = shape_vertex(mesh, 1, 0, i);
    shape_triangle(mesh, a, b, shape_vertex(mesh, apex, height, i));
  }
  shape_seal(mesh);
  qmat_field *thickness = field_of(FACETS, NULL, 1);
  static const char *rounds[] = {"theta=1 n_f=16 lloyd_rounds=0", "theta=1 n_f=16 lloyd_rounds=1",
                                 "theta=1 n_f=16 lloyd_rounds=5", "theta=1 n_f=16 lloyd_rounds=50"};
  result made[4];
  for (int r = 0; r < 4; r++) made[r] = sample(mesh, thickness, rounds[r]);
  for (uint32_t i = 0; i < FACETS; i++) {
    assert_int_equal(count_on(made[0].samples, i), 16);
    double error[4];
    for (int r = 0; r < 4; r++) error[r] = quantisation_error(mesh, made[r].samples, i);
    for (int r = 1; r < 4; r++) assert_true(error[r] < error[r - 1]);
    assert_true(least_distance(mesh, made[2].samples, i) > 1.5 * least_distance(mesh, made[0].samples, i));
  }
  for (int r = 0; r < 4; r++) release(made + r);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

/* Two samples in an isosceles triangle at rest: their cells are mirror images, and each is at its cell's centroid. With
 * the corners fixed the rest position is symmetric about the axis or on it. */
static void test_lloyd_comes_to_rest_at_centroids(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, -2, 0, 0);
  shape_vertex(mesh, 2, 0, 0);
  shape_vertex(mesh, 0, 1, 0);
  shape_triangle(mesh, 0, 1, 2);
  shape_seal(mesh);
  qmat_field *thickness = field_of(1, NULL, 1);
  result made = sample(mesh, thickness, "theta=1 n_f=2 lloyd_rounds=100");
  const double *p = made.samples->positions + 9;
  assert_near(p[0], -p[3], 1e-6);
  assert_near(p[1], p[4], 1e-6);
  /* The cell of the sample at x > 0 against a fine grid. */
  const double site[2] = {fabs(p[0]), p[1]};
  const double others[4][2] = {{-site[0], site[1]}, {-2, 0}, {2, 0}, {0, 1}};
  double sum[2] = {0, 0}, count = 0;
  for (int i = 0; i < 4000; i++) {
    for (int j = 0; j < 1000; j++) {
      const double x = -2 + (i + 0.5) / 1000, y = (j + 0.5) / 1000;
      if (y > 1 - fabs(x) / 2) continue;
      const double own = (x - site[0]) * (x - site[0]) + (y - site[1]) * (y - site[1]);
      bool nearest = true;
      for (int o = 0; o < 4; o++) {
        nearest &= own <= (x - others[o][0]) * (x - others[o][0]) + (y - others[o][1]) * (y - others[o][1]);
      }
      if (!nearest) continue;
      sum[0] += x, sum[1] += y, count++;
    }
  }
  assert_near(sum[0] / count, site[0], 1e-3);
  assert_near(sum[1] / count, site[1], 1e-3);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_rotation_scale_and_vertex_order_keep_the_counts(void **state) {
  (void)state;
  qmat_mesh *plain = shape_seal(shape_torus(1, 0.3, 20, 10));
  qmat_field *thickness = field_of(400, NULL, 1);
  result first = sample(plain, thickness, "theta=0.5");
  assert_true(first.samples->count > 300);
  for (int variant = 0; variant < 4; variant++) {
    qmat_mesh *mesh = shape_torus(1, 0.3, 20, 10);
    if (variant == 0) shape_rotate(mesh);
    if (variant == 1) shape_map(mesh, 1e-200, 0, 0, 0);
    if (variant == 2) shape_map(mesh, 1e200, 0, 0, 0);
    for (size_t i = 0; variant == 3 && i < 400; i++) {
      uint32_t *t = mesh->triangles + 3 * i, kept = t[0];
      t[0] = t[1], t[1] = t[2], t[2] = kept;
    }
    shape_seal(mesh);
    result other = sample(mesh, thickness, "theta=0.5");
    for (uint32_t i = 0; i < 400; i++) assert_int_equal(count_on(other.samples, i), count_on(first.samples, i));
    release(&other);
    qmat_value_release(&mesh->base);
  }
  release(&first);
  qmat_value_release(&thickness->base);
  qmat_value_release(&plain->base);
}

static void test_threads_do_not_change_a_byte_and_the_seed_does(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(1, 0.3, 60, 30));
  qmat_field *thickness = field_of(3600, NULL, 1);
  static const int threads[] = {1, 2, 8};
  qmat_digest first;
  for (size_t i = 0; i < 3; i++) {
    qmat_context context = {.threads = threads[i]};
    result made;
    assert_int_equal(try_sample(&context, mesh, thickness, "theta=1 n_f=5", &made), QMAT_OK);
    if (i == 0) {
      first = made.samples->base.digest;
    } else {
      assert_memory_equal(&first, &made.samples->base.digest, sizeof first);
    }
    release(&made);
    qmat_context_uninit(&context);
  }
  result other = sample(mesh, thickness, "theta=1 n_f=5 seed=1");
  assert_memory_not_equal(&first, &other.samples->base.digest, sizeof first);
  release(&other);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

/* The distance from a point to the nearest sample. */
static double nearest_sample(const qmat_samples *samples, const double point[3]) {
  double least = INFINITY;
  for (size_t i = 0; i < samples->count; i++) {
    double square = 0;
    for (size_t k = 0; k < 3; k++)
      square += (point[k] - samples->positions[3 * i + k]) * (point[k] - samples->positions[3 * i + k]);
    least = fmin(least, square);
  }
  return sqrt(least);
}

static void test_spacing_fills_a_coarse_box_evenly(void **state) {
  (void)state;
  /* A cube with the diagonal 1: sides of 1 / sqrt(3), diagonals of sqrt(2 / 3). */
  const double side = 1 / sqrt(3.0), spacing = 0.35 * side / sqrt(2); /* by a facet's height */
  qmat_mesh *mesh = shape_seal(shape_box(side, side, side));
  qmat_field *thickness = field_of(12, NULL, 1);
  result made = sample(mesh, thickness, "spacing=0.1 theta=0.5");
  const qmat_samples *samples = made.samples;
  assert_int_equal(reported(&made, "added_by_spacing"), reported(&made, "added"));
  /* 12 sides of ceil(4.04) - 1 = 4 points and 6 diagonals of ceil(5.71) - 1 = 5, each once. */
  size_t on_sides = 0;
  for (size_t i = 8; i < samples->count; i++) {
    bool zero = false;
    for (size_t k = 0; k < 3; k++) zero |= samples->barycentrics[3 * i + k] == 0;
    on_sides += zero;
  }
  assert_int_equal(on_sides, 12 * 4 + 6 * 5);
  /* No two samples in one place, and none farther than the spacing from any point of the surface. */
  for (size_t i = 0; i < samples->count; i++)
    for (size_t j = 0; j < i; j++) {
      double square = 0;
      for (size_t k = 0; k < 3; k++) square += pow(samples->positions[3 * i + k] - samples->positions[3 * j + k], 2);
      assert_true(sqrt(square) > 0.2 * spacing);
    }
  for (int i = 0; i <= 40; i++)
    for (int j = 0; j <= 40; j++)
      for (int s = 0; s < 6; s++) {
        double point[3];
        point[s / 2] = s % 2 ? side : 0;
        point[(s / 2 + 1) % 3] = side * i / 40;
        point[(s / 2 + 2) % 3] = side * j / 40;
        assert_true(nearest_sample(samples, point) < 0.75 * spacing);
      }
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_spacing_adds_nothing_to_a_fine_mesh(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(1, 0.3, 60, 30)); /* sides up to 0.16 of a diagonal of 3.7 */
  qmat_field *thickness = field_of(3600, NULL, 1);
  result without = sample(mesh, thickness, "theta=0.5"), with = sample(mesh, thickness, "theta=0.5 spacing=0.05");
  assert_int_equal(reported(&with, "added_by_spacing"), 0);
  assert_memory_equal(&without.samples->base.digest, &with.samples->base.digest, sizeof(qmat_digest));
  release(&without);
  release(&with);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_spacing_never_takes_samples_of_equation_seven_away(void **state) {
  (void)state;
  /* A large facet beside small ones gets 64 by its area; the spacing asks for fewer. */
  static const double areas[3] = {1, 1, 0.02};
  qmat_mesh *mesh = fan(areas, 3);
  qmat_field *thickness = field_of(3, NULL, 1);
  result without = sample(mesh, thickness, "theta=0.5"), with = sample(mesh, thickness, "theta=0.5 spacing=0.2");
  assert_int_equal(reported(&with, "added_by_area"), reported(&without, "added_by_area"));
  for (uint32_t i = 0; i < 3; i++) assert_true(count_on(with.samples, i) >= count_on(without.samples, i));
  release(&without);
  release(&with);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_spacing_is_a_share_of_the_diagonal(void **state) {
  (void)state;
  qmat_field *thickness = field_of(12, NULL, 1);
  size_t counts[3];
  for (int variant = 0; variant < 3; variant++) {
    qmat_mesh *mesh = shape_box(1, 2, 3);
    if (variant == 1) shape_map(mesh, 1e-6, 1, 2, 3);
    if (variant == 2) shape_map(mesh, 1e6, 0, 0, 0);
    shape_seal(mesh);
    result made = sample(mesh, thickness, "spacing=3% theta=0.5");
    counts[variant] = made.samples->count;
    assert_true(counts[variant] > 300);
    assert_int_equal(counts[variant], counts[0]);
    release(&made);
    qmat_value_release(&mesh->base);
  }
  qmat_value_release(&thickness->base);
}

static void test_limit_on_samples_holds_for_spaced_ones_too(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_box(1, 1, 1));
  qmat_field *thickness = field_of(12, NULL, 1);
  result all = sample(mesh, thickness, "spacing=0.02 theta=0.5");
  result made = sample(mesh, thickness, "spacing=0.02 theta=0.5 max_samples=500");
  assert_int_equal(made.samples->count, 500);
  assert_int_equal(reported(&made, "dropped"), all.samples->count - 500);
  for (uint32_t i = 0; i < 12; i++) assert_true(count_on(made.samples, i) >= 25);
  release(&all);
  release(&made);
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

static void test_spacing_below_a_ten_thousandth_is_refused(void **state) {
  (void)state;
  qmat_context context = {0};
  const qmat_node *node = &qmat_node_mesh_sample;
  double params[16];
  assert_true(node->params_size <= sizeof params);
  qmat_params_default(node, params);
  static const char *const spacings[] = {"0.00009", "0.0001", "0"};
  for (int i = 0; i < 3; i++) {
    assert_int_equal(qmat_param_parse(&context, qmat_param_find(node, "spacing"), spacings[i], params), QMAT_OK);
    assert_int_equal(qmat_params_check(&context, node, params), i == 0 ? QMAT_ERROR_USAGE : QMAT_OK);
    assert_string_equal(context.error.field, "spacing");
  }
  qmat_context_uninit(&context);
}

static void expect_error(const qmat_mesh *mesh, const qmat_field *thickness, const char *field, int64_t element) {
  qmat_context context = {0};
  result made;
  assert_int_equal(try_sample(&context, mesh, thickness, "", &made), QMAT_ERROR_GEOMETRY);
  assert_int_equal(context.error.status, QMAT_ERROR_GEOMETRY);
  assert_string_not_equal(context.error.message, "");
  assert_string_equal(context.error.field, field);
  assert_int_equal(context.error.element, element);
  qmat_context_uninit(&context);
}

static void test_bad_inputs_are_named(void **state) {
  (void)state;
  qmat_mesh *box = shape_seal(shape_box(1, 1, 1)), *empty = shape_seal(shape_new());
  qmat_field *twelve = field_of(12, NULL, 1), *eleven = field_of(11, NULL, 1), *none = field_of(0, NULL, 1);
  expect_error(box, eleven, "thickness", -1);
  expect_error(empty, none, "mesh", -1);

  qmat_field *per_vertex = qmat_field_new();
  qmat_context context = {0};
  per_vertex->count = 12;
  per_vertex->values = qmat_calloc(12, sizeof *per_vertex->values);
  per_vertex->unit = qmat_strdup("model unit");
  per_vertex->domain = QMAT_PER_VERTEX;
  assert_int_equal(qmat_value_seal(&context, &per_vertex->base), QMAT_OK);
  expect_error(box, per_vertex, "thickness", -1);

  qmat_mesh *loose = shape_box(1, 1, 1);
  shape_vertex(loose, 2, 2, 2);
  shape_seal(loose);
  expect_error(loose, twelve, "mesh", 8);

  qmat_value_release(&box->base);
  qmat_value_release(&empty->base);
  qmat_value_release(&loose->base);
  qmat_value_release(&twelve->base);
  qmat_value_release(&eleven->base);
  qmat_value_release(&none->base);
  qmat_value_release(&per_vertex->base);
  qmat_context_uninit(&context);
}

static void test_progress_function_cancels(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(1, 0.3, 120, 120));
  qmat_field *thickness = field_of(mesh->triangle_count, NULL, 1);
  pipeline_must_be_cancelled("mesh.sample", "", (const qmat_value *[]){&mesh->base, &thickness->base});
  qmat_value_release(&thickness->base);
  qmat_value_release(&mesh->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_areas_one_and_four_add_three),
      cmocka_unit_test(test_thin_facets_add_n_f),
      cmocka_unit_test(test_facet_is_not_its_own_neighbour),
      cmocka_unit_test(test_equal_areas_add_nothing_whatever_their_rounding),
      cmocka_unit_test(test_slivers_count_as_a_square_of_a_share_of_the_spacing),
      cmocka_unit_test(test_degenerate_facets_get_none_and_are_no_neighbours),
      cmocka_unit_test(test_limit_on_samples_thins_all_facets_evenly),
      cmocka_unit_test(test_random_points_are_uniform_on_a_facet),
      cmocka_unit_test(test_lloyd_spreads_samples),
      cmocka_unit_test(test_lloyd_comes_to_rest_at_centroids),
      cmocka_unit_test(test_rotation_scale_and_vertex_order_keep_the_counts),
      cmocka_unit_test(test_threads_do_not_change_a_byte_and_the_seed_does),
      cmocka_unit_test(test_spacing_fills_a_coarse_box_evenly),
      cmocka_unit_test(test_spacing_adds_nothing_to_a_fine_mesh),
      cmocka_unit_test(test_spacing_never_takes_samples_of_equation_seven_away),
      cmocka_unit_test(test_spacing_is_a_share_of_the_diagonal),
      cmocka_unit_test(test_limit_on_samples_holds_for_spaced_ones_too),
      cmocka_unit_test(test_spacing_below_a_ten_thousandth_is_refused),
      cmocka_unit_test(test_bad_inputs_are_named),
      cmocka_unit_test(test_progress_function_cancels),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
