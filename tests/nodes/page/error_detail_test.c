/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The errors of a box around a ball, known at each point of the box. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/triangle.h"
#include "nodes/page/error_detail.h"
#include "tests/medial_meshes.h"
#include "tests/random.h"
#include "tests/shapes.h"

static const double radius = 0.2;

/* A cube with the diagonal 1 in the unit frame, a ball at its centre, and the errors of the one to the other. */
static qmat_display_mesh refined_cube(qmat_context *context, double tolerance) {
  const double side = 1 / sqrt(3);
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, side, side, side, false);
  shape_seal(mesh);
  qmat_frame frame;
  assert_int_equal(qmat_frame_of_mesh(context, mesh, &frame), QMAT_OK);
  const double centre[3] = {side / 2, side / 2, side / 2};
  double ball[4] = {0, 0, 0, radius};
  qmat_frame_to_unit(&frame, centre, 1, ball);
  qmat_medial *medial = sealed_medial_mesh(ball, 1, NULL, 0, NULL, 0);
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_of_medial(context, medial, &envelope), QMAT_OK);
  qmat_display_mesh display;
  assert_int_equal(qmat_display_mesh_make(context, mesh, &frame, envelope, &display), QMAT_OK);
  assert_int_equal(display.vertex_count, 24);
  if (tolerance > 0) assert_int_equal(qmat_display_mesh_refine(context, envelope, tolerance, &display), QMAT_OK);
  for (size_t i = 0; i < display.vertex_count; i++)
    assert_near(display.errors[i], qmat_point_distance(&display.positions[3 * i], ball) - radius, 1e-12);
  qmat_envelope_free(envelope);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
  return display;
}

/* The largest difference between the error that a facet shows at a point and the true one. */
static double worst_difference(const qmat_display_mesh *display) {
  double worst = 0, ball[3] = {0, 0, 0};
  for (size_t i = 0; i < display->vertex_count; i++)
    for (int k = 0; k < 3; k++) { /* the middle of the box */
      if (i == 0 || display->positions[3 * i + (size_t)k] > ball[k]) ball[k] = display->positions[3 * i + (size_t)k];
    }
  for (int k = 0; k < 3; k++) ball[k] -= 0.5 / sqrt(3);
  random_numbers random = {.seed = 5};
  for (size_t t = 0; t < display->triangle_count; t++) {
    double weights[3], at[3] = {0, 0, 0}, shown = 0, sum = 0;
    for (int k = 0; k < 3; k++) sum += weights[k] = random_between(&random, 0.01, 1);
    for (int k = 0; k < 3; k++) {
      const size_t v = display->triangles[3 * t + (size_t)k];
      shown += weights[k] / sum * display->errors[v];
      for (int i = 0; i < 3; i++) at[i] += weights[k] / sum * display->positions[3 * v + (size_t)i];
    }
    worst = fmax(worst, fabs(shown - (qmat_point_distance(at, ball) - radius)));
  }
  return worst;
}

static void test_errors_between_the_corners_of_a_box_show(void **state) {
  (void)state;
  qmat_context context = {0};
  const qmat_display_mesh coarse = refined_cube(&context, 0), fine = refined_cube(&context, 0.005);
  assert_true(worst_difference(&coarse) > 0.1);
  assert_true(worst_difference(&fine) < 0.005);
  assert_true(fine.triangle_count > 12 && fine.triangle_count < 10000);
  qmat_context_uninit(&context);
}

/* The facets fill the same box: the area is the same, normals are those of the sides, and each edge has two facets when
 * vertices at one place count as one. */
static void test_the_surface_stays_as_it_is(void **state) {
  (void)state;
  qmat_context context = {0};
  const qmat_display_mesh display = refined_cube(&context, 0.005);
  double area = 0;
  for (size_t t = 0; t < display.triangle_count; t++) {
    const uint32_t *row = &display.triangles[3 * t];
    double normal[3];
    area += qmat_triangle_area(&display.positions[3 * (size_t)row[0]], &display.positions[3 * (size_t)row[1]],
                               &display.positions[3 * (size_t)row[2]], normal);
    for (int k = 0; k < 3; k++) assert_near(qmat_dot(normal, &display.normals[3 * (size_t)row[k]]), 1, 1e-9);
  }
  assert_near(area, 6.0 / 3, 1e-9);
  /* A vertex in the middle of another facet's side would leave a gap: no vertex is inside of an edge. */
  for (size_t i = 0; i < 3 * display.triangle_count; i++) {
    const double *a = &display.positions[3 * (size_t)display.triangles[i]];
    const double *b = &display.positions[3 * (size_t)display.triangles[i % 3 == 2 ? i - 2 : i + 1]];
    double middle[3];
    for (int k = 0; k < 3; k++) middle[k] = 0.5 * (a[k] + b[k]);
    for (size_t v = 0; v < display.vertex_count; v++) {
      const double *p = &display.positions[3 * v];
      assert_false(p[0] == middle[0] && p[1] == middle[1] && p[2] == middle[2]);
    }
  }
  qmat_context_uninit(&context);
}

static void test_the_triangles_have_a_limit(void **state) {
  (void)state;
  qmat_context context = {0};
  const qmat_display_mesh display = refined_cube(&context, 1e-9);
  assert_true(display.triangle_count > 10000 && display.triangle_count <= 40000);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_errors_between_the_corners_of_a_box_show),
      cmocka_unit_test(test_the_surface_stays_as_it_is),
      cmocka_unit_test(test_the_triangles_have_a_limit),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
