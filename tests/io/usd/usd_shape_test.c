/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_scene.h"

#include "tests/io/files.h"
#include "tests/shapes.h"

static const double PI = 3.14159265358979323846;

/* Reads a scene of one prim as a sealed mesh in world space. */
static qmat_mesh *read_shape(const char *prim, size_t segments) {
  char text[2048], line[1024];
  snprintf(text, sizeof text, "#usda 1.0\ndef %s\n", prim);
  qmat_context context = {0};
  qmat_soup soup = {0};
  qmat_usd_scene scene;
  qmat_mesh *mesh = NULL;
  const qmat_read_options options = {.defects = QMAT_DEFECTS_REFUSE};
  qmat_bytes bytes = memory_file(text, strlen(text));
  qmat_status status = qmat_usd_scene_open(&context, &bytes, "file.usda", segments, &scene);
  if (status == QMAT_OK) status = qmat_usd_scene_add_all(&context, &scene, "file.usda", &soup);
  if (status == QMAT_OK) status = qmat_soup_to_mesh(&context, &soup, "file.usda", &options, &mesh, NULL);
  if (status != QMAT_OK) {
    qmat_error_format(&context.error, line, sizeof line);
    fail_msg("%s: %s", prim, line);
  }
  qmat_usd_scene_close(&scene);
  qmat_soup_uninit(&soup);
  free(bytes.data);
  qmat_context_uninit(&context);
  return mesh;
}

static double volume_of(const qmat_mesh *mesh) {
  double sum = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *a = mesh->positions + 3 * (size_t)mesh->triangles[3 * t],
                 *b = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 1],
                 *c = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 2];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

static void assert_box(const qmat_mesh *mesh, const double low[3], const double high[3]) {
  for (size_t k = 0; k < 3; k++) {
    double least = INFINITY, most = -INFINITY;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
      least = fmin(least, mesh->positions[3 * i + k]);
      most = fmax(most, mesh->positions[3 * i + k]);
    }
    if (fabs(least - low[k]) > 1e-12 || fabs(most - high[k]) > 1e-12)
      fail_msg("axis %zu is from %.17g to %.17g", k, least, most);
  }
}

static void test_sizes_are_those_of_the_schemas_and_volumes_those_of_the_solids(void **state) {
  (void)state;
  const struct {
    const char *prim;
    double low[3], high[3], volume;
  } cases[] = {
      {"Sphere \"s\" {}", {-1, -1, -1}, {1, 1, 1}, 4 * PI / 3},
      {"Sphere \"s\" { double radius = 3 }", {-3, -3, -3}, {3, 3, 3}, 36 * PI},
      {"Cube \"s\" {}", {-1, -1, -1}, {1, 1, 1}, 8},
      {"Cube \"s\" { double size = 3 }", {-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}, 27},
      {"Cylinder \"s\" {}", {-1, -1, -1}, {1, 1, 1}, 2 * PI},
      {"Cylinder \"s\" { token axis = \"X\" double height = 6 }", {-3, -1, -1}, {3, 1, 1}, 6 * PI},
      {"Cone \"s\" { token axis = \"Y\" double height = 4 }", {-1, -2, -1}, {1, 2, 1}, 4 * PI / 3},
      {"Capsule \"s\" {}", {-0.5, -0.5, -1}, {0.5, 0.5, 1}, 0.25 * PI + PI / 6},
      {"Capsule \"s\" { token axis = \"Y\" double height = 0 }", {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, PI / 6},
      {"Cylinder_1 \"s\" { double radiusTop = 2 }", {-2, -2, -1}, {2, 2, 1}, 2 * PI * (1 + 2 + 4) / 3},
      {"Cylinder_1 \"s\" { double radiusTop = 0 }", {-1, -1, -1}, {1, 1, 1}, 2 * PI / 3},
      {"Capsule_1 \"s\" { double radiusBottom = 1 double radiusTop = 2 double height = 6 }",
       {-2, -2, -4},
       {2, 2, 5},
       2 * PI * (1 + 2 + 4) + 2 * PI / 3 * (1 + 8)},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    double before = INFINITY;
    for (size_t segments = 16; segments <= 256; segments *= 4) {
      qmat_mesh *mesh = read_shape(cases[i].prim, segments);
      assert_true(mesh->closed && mesh->oriented);
      assert_box(mesh, cases[i].low, cases[i].high);
      /* Polygons of n sides are smaller than their circles by a share of 2 pi^2 / (3 n^2), in three directions. */
      const double missing = 1 - volume_of(mesh) / cases[i].volume;
      if (missing < -1e-12 || missing > 30.0 / (double)(segments * segments))
        fail_msg("%s: %g of the volume is missing with %zu segments", cases[i].prim, missing, segments);
      assert_true(missing <= before);
      before = missing;
      qmat_value_release(&mesh->base);
    }
  }
}

/* No point of a sphere or of a cylinder's side is farther from the polygons than the deviation says. */
static void test_the_deviation_bounds_the_distance_to_the_circles(void **state) {
  (void)state;
  qmat_mesh *sphere = read_shape(
                "Sphere \"s\" { double radius = 2 float3 xformOp:scale = (1, 1, 3)\n"
                "uniform token[] xformOpOrder = [\"xformOp:scale\"] }",
                32),
            *cylinder = read_shape("Cylinder \"s\" { double radius = 2 }", 32), *cube = read_shape("Cube \"s\" {}", 32);
  const double sagitta = 2 * (1 - cos(PI / 32));
  assert_near(cylinder->deviation, sagitta, 1e-12);
  assert_near(sphere->deviation, 3 * 2 * sagitta, 1e-12);
  assert_true(cube->deviation == 0);
  double seen = 0;
  for (size_t t = 0; t < cylinder->triangle_count; t++) {
    const uint32_t *ids = cylinder->triangles + 3 * t;
    for (int k = 0; k < 3; k++) {
      const double *a = cylinder->positions + 3 * (size_t)ids[k],
                   *b = cylinder->positions + 3 * (size_t)ids[(k + 1) % 3];
      if (fabs(hypot(a[0], a[1]) - 2) > 1e-9 || fabs(hypot(b[0], b[1]) - 2) > 1e-9) continue;
      seen = fmax(seen, 2 - hypot(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])));
    }
  }
  assert_near(seen, sagitta, 1e-12);
  qmat_value_release(&sphere->base);
  qmat_value_release(&cylinder->base);
  qmat_value_release(&cube->base);
}

static void test_a_plane_is_a_rectangle_across_its_axis(void **state) {
  (void)state;
  static const struct {
    const char *prim;
    double low[3], high[3];
  } cases[] = {
      {"Plane \"s\" { double width = 4 double length = 6 }", {-2, -3, 0}, {2, 3, 0}},
      {"Plane \"s\" { double width = 4 double length = 6 token axis = \"X\" }", {0, -3, -2}, {0, 3, 2}},
      {"Plane \"s\" { double width = 4 double length = 6 token axis = \"Y\" }", {-2, 0, -3}, {2, 0, 3}},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_mesh *mesh = read_shape(cases[i].prim, 64);
    assert_int_equal(mesh->triangle_count, 2);
    assert_false(mesh->closed);
    assert_box(mesh, cases[i].low, cases[i].high);
    qmat_value_release(&mesh->base);
  }
}

static void test_shapes_that_are_none_are_left_out_or_refused(void **state) {
  (void)state;
  static const struct {
    const char *prim, *message;
    qmat_status status;
  } cases[] = {
      {"Sphere \"s\" { double radius = 0 }",
       "the scene has no mesh that can be read; /s: left out: the radius of this Sphere is not above zero",
       QMAT_ERROR_GEOMETRY},
      {"Capsule \"s\" { double height = -1 }",
       "the scene has no mesh that can be read; /s: left out: the height of this Capsule is not above zero",
       QMAT_ERROR_GEOMETRY},
      {"Cylinder_1 \"s\" { double radiusTop = 0 double radiusBottom = 0 }",
       "the scene has no mesh that can be read; /s: left out: the radiusBottom of this Cylinder_1 is not above zero",
       QMAT_ERROR_GEOMETRY},
      {"Sphere \"s\" { double radius = nan }", "/s: radius must be one finite number", QMAT_ERROR_FORMAT},
      {"Cube \"s\" { double[] size = [1, 2] }", "/s: size must be one finite number", QMAT_ERROR_FORMAT},
      {"Cone \"s\" { token axis = \"W\" }", "/s: axis is 'W', which is unknown", QMAT_ERROR_FORMAT},
      {"Sphere \"s\" { float3 xformOp:scale = (1, 0, 1) uniform token[] xformOpOrder = [\"xformOp:scale\"] }",
       "the scene has no mesh that can be read; /s: left out: its transform flattens it or is not finite",
       QMAT_ERROR_GEOMETRY},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[512];
    snprintf(text, sizeof text, "#usda 1.0\ndef %s\n", cases[i].prim);
    qmat_context context = {0};
    qmat_soup soup = {0};
    qmat_bytes bytes = memory_file(text, strlen(text));
    assert_int_equal(qmat_usd_read(&context, &bytes, "file.usda", &soup, NULL), cases[i].status);
    assert_string_equal(context.error.message, cases[i].message);
    qmat_soup_uninit(&soup);
    free(bytes.data);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_sizes_are_those_of_the_schemas_and_volumes_those_of_the_solids),
      cmocka_unit_test(test_the_deviation_bounds_the_distance_to_the_circles),
      cmocka_unit_test(test_a_plane_is_a_rectangle_across_its_axis),
      cmocka_unit_test(test_shapes_that_are_none_are_left_out_or_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
