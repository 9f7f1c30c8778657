/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/node.h"
#include "tests/nodes/pipeline.h"
#include "tests/shapes.h"

extern const qmat_node qmat_node_mesh_sdf;

/* Runs the node with its defaults but for `cone_angle`, `rays` and `spacing` (NULL: default). Releases the mesh. */
static qmat_status try_spaced_sdf(qmat_context *context, qmat_mesh *mesh, const char *cone_angle, const char *rays,
                                  const char *spacing, qmat_field **thickness) {
  const qmat_node *node = &qmat_node_mesh_sdf;
  double params[8];
  assert_true(node->params_size <= sizeof params);
  qmat_params_default(node, params);
  if (cone_angle) {
    assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "cone_angle"), cone_angle, params), QMAT_OK);
  }
  if (rays) {
    assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "rays"), rays, params), QMAT_OK);
  }
  if (spacing) {
    assert_int_equal(qmat_param_parse(context, qmat_param_find(node, "spacing"), spacing, params), QMAT_OK);
  }
  const qmat_value *inputs[1] = {&mesh->base};
  qmat_value *outputs[1] = {NULL};
  const qmat_status status = node->run(context, params, inputs, outputs);
  if (status != QMAT_OK) assert_null(outputs[0]);
  *thickness = (qmat_field *)outputs[0];
  qmat_value_release(&mesh->base);
  return status;
}

static qmat_status try_sdf(qmat_context *context, qmat_mesh *mesh, const char *cone_angle, const char *rays,
                           qmat_field **thickness) {
  return try_spaced_sdf(context, mesh, cone_angle, rays, NULL, thickness);
}

static qmat_field *sdf(qmat_mesh *mesh, const char *cone_angle, const char *rays) {
  qmat_context context = {0};
  qmat_field *thickness = NULL;
  const size_t count = mesh->triangle_count;
  if (try_sdf(&context, mesh, cone_angle, rays, &thickness) != QMAT_OK) fail_msg("%s", context.error.message);
  assert_true(thickness->base.sealed);
  assert_int_equal(thickness->count, count);
  assert_int_equal(thickness->domain, QMAT_PER_FACET);
  assert_string_equal(thickness->unit, "model unit");
  qmat_context_uninit(&context);
  return thickness;
}

/* The weighted mean of length(u) over the cosines u from low to high, at the weight 1 / acos(u), by the midpoint rule
 * in acos(u), where the integrand is smooth. */
static double weighted_mean(double (*length)(double), double low, double high) {
  const double from = acos(high), to = acos(low);
  double sum = 0, total = 0;
  for (int i = 0; i < 20000; i++) {
    const double angle = from + (to - from) * (i + 0.5) / 20000, weight = sin(angle) / angle;
    sum += weight * length(cos(angle));
    total += weight;
  }
  return sum / total;
}

static double chord_of_unit_sphere(double u) {
  return 2 * u;
}

static double chord_of_unit_slab(double u) {
  return 1 / u;
}

/* The box's sides come in pairs of two triangles: z, z, y, y, x, x. */
static void test_single_ray_measures_the_box_exactly(void **state) {
  (void)state;
  qmat_field *thickness = sdf(shape_seal(shape_box(1, 2, 3)), NULL, "1");
  static const double expected[12] = {3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1};
  for (size_t i = 0; i < 12; i++) assert_near(thickness->values[i], expected[i], 1e-12);
  qmat_value_release(&thickness->base);
}

static void test_narrow_cone_stays_near_the_opposite_side(void **state) {
  (void)state;
  qmat_field *thickness = sdf(shape_seal(shape_box(1, 2, 3)), "10", NULL);
  static const double expected[12] = {3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1};
  const double longest = 1 / cos(5 * 3.14159265358979323846 / 180);
  for (size_t i = 0; i < 12; i++) {
    assert_true(thickness->values[i] > expected[i]);
    assert_true(thickness->values[i] < expected[i] * longest);
  }
  qmat_value_release(&thickness->base);
}

/* Rays at more than 45 degrees meet a sphere where it faces the same way as the facet and do not count. The lengths
 * 2 r u of the others are uniform, as u is in [s, 1] with s = sqrt(1/2): median u = (s + 1) / 2, deviation
 * (1 - s) / 4, and 1.5 of these to each side are kept. */
static void test_sphere_gives_the_mean_over_the_kept_cone(void **state) {
  (void)state;
  const double radius = 3, s = sqrt(0.5), median = 0.5 * (s + 1), reach = 1.5 * 0.25 * (1 - s);
  const double expected = radius * weighted_mean(chord_of_unit_sphere, median - reach, median + reach);
  qmat_field *thickness = sdf(shape_seal(shape_sphere(radius, 60)), NULL, "400");
  double mean = 0;
  for (size_t i = 0; i < thickness->count; i++) {
    assert_near(thickness->values[i], expected, 0.02 * expected);
    mean += thickness->values[i] / (double)thickness->count;
  }
  assert_near(mean, expected, 0.005 * expected);
  qmat_value_release(&thickness->base);
}

/* The lengths 1 / u of a slab: median 4/3; the deviation m covers half of u where 2 m / (16/9 - m^2) = 1/4. */
static void test_wide_slab_gives_the_mean_over_the_kept_cone(void **state) {
  (void)state;
  const double reach = 1.5 * (-4 + sqrt(16 + 16.0 / 9));
  const double expected = weighted_mean(chord_of_unit_slab, 1 / (4.0 / 3 + reach), 1 / (4.0 / 3 - reach));
  qmat_field *thickness = sdf(shape_seal(shape_box(100, 100, 1)), NULL, "1024");
  for (size_t i = 0; i < 4; i++) assert_near(thickness->values[i], expected, 0.005 * expected);
  qmat_value_release(&thickness->base);
}

static void test_thin_sheets_keep_their_thickness(void **state) {
  (void)state;
  qmat_field *slab = sdf(shape_seal(shape_box(1, 1, 1e-2)), NULL, NULL);
  static const double thin[] = {1e-4, 1e-6};
  for (size_t s = 0; s < 2; s++) {
    qmat_field *sheet = sdf(shape_seal(shape_box(1, 1, thin[s])), NULL, NULL);
    for (size_t i = 0; i < 4; i++) {
      assert_true(sheet->values[i] > thin[s]);
      assert_near(sheet->values[i] / thin[s], slab->values[i] / 1e-2, 1e-9);
    }
    qmat_value_release(&sheet->base);
  }
  qmat_value_release(&slab->base);
}

static size_t count_differences(const qmat_field *a, const qmat_field *b) {
  size_t count = 0;
  for (size_t i = 0; i < a->count; i++) count += a->values[i] != b->values[i];
  return count;
}

static void test_fine_facets_share_values_that_are_nearly_theirs(void **state) {
  (void)state;
  /* A torus of diagonal about 2.6 with a tube of 0.4 in diameter. */
  qmat_field *fields[3];
  static const char *const spacings[3] = {"0", "0.001", "0.018"};
  for (int i = 0; i < 3; i++) {
    qmat_context context = {0};
    assert_int_equal(
        try_spaced_sdf(&context, shape_seal(shape_torus(0.7, 0.2, 96, 40)), NULL, NULL, spacings[i], &fields[i]),
        QMAT_OK);
    qmat_context_uninit(&context);
  }
  /* Facets are farther apart than the second spacing. */
  assert_memory_equal(fields[0]->values, fields[1]->values, fields[0]->count * sizeof(double));
  assert_true(count_differences(fields[2], fields[0]) > fields[0]->count / 3);
  for (size_t i = 0; i < fields[0]->count; i++)
    assert_near(fields[2]->values[i], fields[0]->values[i], 0.15 * fields[0]->values[i]);
  for (int i = 0; i < 3; i++) qmat_value_release(&fields[i]->base);
}

static void test_facets_of_thin_parts_are_all_measured(void **state) {
  (void)state;
  /* Thinner than ten times the spacing: the values are those of every facet. */
  qmat_field *fields[2];
  static const char *const spacings[2] = {"0", "0.05"};
  for (int i = 0; i < 2; i++) {
    qmat_context context = {0};
    qmat_mesh *mesh = shape_torus(1, 0.3, 100, 40);
    for (size_t v = 0; v < mesh->vertex_count; v++) mesh->positions[3 * v + 2] *= 0.01;
    assert_int_equal(try_spaced_sdf(&context, shape_seal(mesh), "20", NULL, spacings[i], &fields[i]), QMAT_OK);
    qmat_context_uninit(&context);
  }
  assert_true(count_differences(fields[0], fields[1]) < fields[0]->count / 100);
  for (int i = 0; i < 2; i++) qmat_value_release(&fields[i]->base);
}

static void test_rotation_scale_and_offset_change_nothing_but_the_unit(void **state) {
  (void)state;
  qmat_field *plain = sdf(shape_seal(shape_torus(1, 0.3, 30, 15)), NULL, NULL);
  for (int variant = 0; variant < 3; variant++) {
    qmat_mesh *mesh = shape_torus(1, 0.3, 30, 15);
    const double scale = variant == 1 ? 1e-9 : variant == 2 ? 1e7 : 1;
    shape_rotate(mesh);
    shape_map(mesh, scale, variant == 0 ? 1e4 : 0, 0, 0);
    qmat_field *moved = sdf(shape_seal(mesh), NULL, NULL);
    for (size_t i = 0; i < plain->count; i++) assert_near(moved->values[i] / scale, plain->values[i], 1e-6);
    qmat_value_release(&moved->base);
  }
  qmat_value_release(&plain->base);
}

static void test_order_of_vertices_and_facets_does_not_matter(void **state) {
  (void)state;
  qmat_field *plain = sdf(shape_seal(shape_torus(1, 0.3, 30, 15)), NULL, NULL);
  qmat_mesh *mesh = shape_torus(1, 0.3, 30, 15);
  const size_t vertices = mesh->vertex_count, facets = mesh->triangle_count;
  for (size_t i = 0; i < vertices / 2; i++) {
    double kept[3], *a = mesh->positions + 3 * i, *b = mesh->positions + 3 * (vertices - 1 - i);
    memcpy(kept, a, sizeof kept);
    memcpy(a, b, sizeof kept);
    memcpy(b, kept, sizeof kept);
  }
  for (size_t i = 0; i < 3 * facets; i++) mesh->triangles[i] = (uint32_t)vertices - 1 - mesh->triangles[i];
  for (size_t i = 0; i < facets / 2; i++) {
    uint32_t kept[3], *a = mesh->triangles + 3 * i, *b = mesh->triangles + 3 * (facets - 1 - i);
    memcpy(kept, a, sizeof kept);
    memcpy(a, b, sizeof kept);
    memcpy(b, kept, sizeof kept);
  }
  qmat_field *mirrored = sdf(shape_seal(mesh), NULL, NULL);
  for (size_t i = 0; i < facets; i++) assert_near(mirrored->values[facets - 1 - i], plain->values[i], 1e-9);
  qmat_value_release(&mirrored->base);

  /* Another first edge turns the pattern of rays about the normal: the value moves by the sampling error only. */
  mesh = shape_torus(1, 0.3, 30, 15);
  for (size_t i = 0; i < facets; i++) {
    uint32_t *t = mesh->triangles + 3 * i, first = t[0];
    t[0] = t[1], t[1] = t[2], t[2] = first;
  }
  qmat_field *turned = sdf(shape_seal(mesh), NULL, NULL);
  double difference = 0;
  for (size_t i = 0; i < facets; i++) {
    assert_near(turned->values[i], plain->values[i], 0.15 * plain->values[i]);
    difference += fabs(turned->values[i] / plain->values[i] - 1) / (double)facets;
  }
  assert_true(difference < 0.03);
  qmat_value_release(&turned->base);
  qmat_value_release(&plain->base);
}

static void test_degenerate_facets_take_their_nearest_neighbours_value(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 2, 3);
  /* A needle along the x edge at y = z = 0, and a point at the vertex (1, 2, 3). */
  shape_triangle(mesh, 0, 1, 0);
  shape_triangle(mesh, 7, 7, 7);
  shape_seal(mesh);
  qmat_field *thickness = sdf(mesh, NULL, "1");
  /* The needle's centroid (1/3, 0, 0) is 0.75 from (2/3, 2/3, 0) on the z side and 1.05 from (2/3, 0, 1) on the
   * y side; the vertex is 0.94 from (1/3, 4/3, 3) on the z side. */
  assert_near(thickness->values[12], 3, 1e-12);
  assert_near(thickness->values[13], 3, 1e-12);
  qmat_value_release(&thickness->base);
}

static int compare_doubles(const void *left, const void *right) {
  const double a = *(const double *)left, b = *(const double *)right;
  return (a > b) - (a < b);
}

static void test_facets_without_a_valid_ray_take_their_neighbours_median(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 2, 3);
  /* A little bent, so that no two facets have the same thickness. */
  for (size_t i = 0; i < 24; i++) mesh->positions[i] += 0.03 * sin(1.7 * (double)i * (double)i);
  /* Without its bottom, the two triangles at z = 0, so that the top at z = 3 sees nothing; and without the last
   * one at x = 1, which the facet 6 at x = 0 would have seen. */
  memmove(mesh->triangles, mesh->triangles + 6, 27 * sizeof *mesh->triangles);
  mesh->triangle_count = 9;
  uint32_t ids[27];
  memcpy(ids, mesh->triangles, sizeof ids);
  qmat_field *thickness = sdf(shape_seal(mesh), NULL, "1");
  for (size_t top = 0; top < 2; top++) {
    double neighbours[8];
    size_t count = 0;
    for (size_t i = 2; i < 9; i++) {
      bool shared = false;
      for (size_t k = 0; k < 9; k++) shared |= ids[3 * top + k / 3] == ids[3 * i + k % 3];
      if (shared && i != 6) neighbours[count++] = thickness->values[i];
    }
    qsort(neighbours, count, sizeof *neighbours, compare_doubles);
    assert_near(thickness->values[top], 0.5 * (neighbours[count / 2] + neighbours[(count - 1) / 2]), 1e-12);
  }
  qmat_value_release(&thickness->base);
}

static void test_sides_that_face_the_same_way_are_not_opposite(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(3, 3, 3);
  shape_add_box(mesh, 0.5, 0.5, 0.5, 2.5, 2.5, 2.5, false);
  qmat_field *thickness = sdf(shape_seal(mesh), NULL, "1");
  /* Rays of the outer box meet the inner one from outside; what is left to take is the mean of the inner facets. */
  for (size_t i = 0; i < 24; i++) assert_near(thickness->values[i], 2, 1e-12);
  qmat_value_release(&thickness->base);

  mesh = shape_box(3, 3, 3);
  shape_add_box(mesh, 0.5, 0.5, 0.5, 2.5, 2.5, 2.5, true);
  thickness = sdf(shape_seal(mesh), NULL, "1");
  for (size_t i = 0; i < 24; i++) assert_near(thickness->values[i], 0.5, 1e-12);
  qmat_value_release(&thickness->base);
}

static void test_thread_count_does_not_change_a_byte(void **state) {
  (void)state;
  static const int threads[] = {1, 2, 8};
  qmat_digest first;
  for (size_t i = 0; i < 3; i++) {
    qmat_context context = {.threads = threads[i]};
    qmat_mesh *mesh = shape_torus(1, 0.3, 50, 30);
    shape_rotate(mesh);
    qmat_field *thickness;
    assert_int_equal(try_sdf(&context, shape_seal(mesh), NULL, NULL, &thickness), QMAT_OK);
    if (i == 0) {
      first = thickness->base.digest;
    } else {
      assert_memory_equal(&first, &thickness->base.digest, sizeof first);
    }
    qmat_value_release(&thickness->base);
    qmat_context_uninit(&context);
  }
}

static void expect_geometry_error(qmat_mesh *mesh) {
  qmat_context context = {0};
  qmat_field *thickness;
  assert_int_equal(try_sdf(&context, shape_seal(mesh), NULL, NULL, &thickness), QMAT_ERROR_GEOMETRY);
  assert_int_equal(context.error.status, QMAT_ERROR_GEOMETRY);
  assert_string_not_equal(context.error.message, "");
  assert_string_equal(context.error.field, "mesh");
  qmat_context_uninit(&context);
}

static void test_meshes_that_enclose_nothing_are_refused(void **state) {
  (void)state;
  expect_geometry_error(shape_new());

  qmat_mesh *triangle = shape_new();
  for (int i = 0; i < 3; i++) shape_vertex(triangle, i == 0, i == 1, i == 2);
  shape_triangle(triangle, 0, 1, 2);
  expect_geometry_error(triangle);

  qmat_mesh *needle = shape_new();
  for (int i = 0; i < 3; i++) shape_vertex(needle, i, i, i);
  shape_triangle(needle, 0, 1, 2);
  expect_geometry_error(needle);

  qmat_mesh *inside_out = shape_new();
  shape_add_box(inside_out, 0, 0, 0, 1, 1, 1, true);
  expect_geometry_error(inside_out);
}

/* Enough facets for several slices, once for those that are measured and once for those that take a value. */
static void test_progress_function_cancels(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(1, 0.3, 120, 60));
  pipeline_must_be_cancelled("mesh.sdf", "", (const qmat_value *[]){&mesh->base});
  qmat_value_release(&mesh->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_single_ray_measures_the_box_exactly),
      cmocka_unit_test(test_narrow_cone_stays_near_the_opposite_side),
      cmocka_unit_test(test_sphere_gives_the_mean_over_the_kept_cone),
      cmocka_unit_test(test_wide_slab_gives_the_mean_over_the_kept_cone),
      cmocka_unit_test(test_thin_sheets_keep_their_thickness),
      cmocka_unit_test(test_fine_facets_share_values_that_are_nearly_theirs),
      cmocka_unit_test(test_facets_of_thin_parts_are_all_measured),
      cmocka_unit_test(test_rotation_scale_and_offset_change_nothing_but_the_unit),
      cmocka_unit_test(test_order_of_vertices_and_facets_does_not_matter),
      cmocka_unit_test(test_degenerate_facets_take_their_nearest_neighbours_value),
      cmocka_unit_test(test_facets_without_a_valid_ray_take_their_neighbours_median),
      cmocka_unit_test(test_sides_that_face_the_same_way_are_not_opposite),
      cmocka_unit_test(test_thread_count_does_not_change_a_byte),
      cmocka_unit_test(test_meshes_that_enclose_nothing_are_refused),
      cmocka_unit_test(test_progress_function_cancels),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
