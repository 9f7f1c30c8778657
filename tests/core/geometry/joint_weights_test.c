/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/joint_weights.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "tests/medial_meshes.h"
#include "tests/shapes.h"

static void test_the_strongest_four_are_kept_and_sum_to_one(void **state) {
  (void)state;
  const uint32_t joints[] = {7, 3, 9, 3, 1, 70000, 5, 2};
  const double weights[] = {0.1, 0.2, 0.3, 0.2, -1, 5, (double)NAN, 0.05};
  uint32_t strongest[4];
  double strengths[4];
  qmat_strongest_joints(joints, weights, 8, strongest, strengths);
  const uint32_t expected[] = {3, 9, 7, 2};
  const double sums[] = {0.4, 0.3, 0.1, 0.05};
  for (size_t k = 0; k < 4; k++) {
    assert_int_equal(strongest[k], expected[k]);
    assert_near(strengths[k], sums[k] / 0.85, 1e-15);
  }
  qmat_strongest_joints(joints, weights, 0, strongest, strengths);
  assert_true(strongest[0] == 0 && strengths[0] == 1 && strengths[1] == 0 && strengths[3] == 0);
}

/* A tube along x from -2 to 2 of radius 1 with rounded ends: left of 0 it follows joint 4, right of it joint 6, and at
 * 0 both. */
static qmat_mesh *skinned_capsule(void) {
  qmat_mesh *mesh = shape_sphere(1, 24);
  mesh->skinned_count = mesh->vertex_count;
  mesh->joints = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->joints);
  mesh->weights = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->weights);
  assert_true(mesh->joints && mesh->weights);
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    double *p = mesh->positions + 3 * v;
    const bool is_middle = fabs(p[0]) < 1e-9;
    mesh->joints[4 * v] = p[0] > 1e-9 ? 6 : 4;
    mesh->weights[4 * v] = is_middle ? 0.5 : 1;
    if (is_middle) mesh->joints[4 * v + 1] = 6, mesh->weights[4 * v + 1] = 0.5;
    if (!is_middle) p[0] += p[0] > 0 ? 2 : -2;
  }
  return shape_seal(mesh);
}

/* Spheres at x = -2, -1, 1 and 2, joined in a row, and one inside that answers for nothing. */
static qmat_medial *row_of_spheres(void) {
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  const double spheres[] = {-2, 0, 0, 1, -1, 0, 0, 1, 1, 0, 0, 1, 2, 0, 0, 1, 1.5, 0, 0, 0.25};
  medial->sphere_count = 5;
  medial->spheres = qmat_alloc(20, sizeof(double));
  assert_non_null(medial->spheres);
  memcpy(medial->spheres, spheres, sizeof spheres);
  assert_int_equal(qmat_medial_set_simplices(&context, medial, (const uint32_t[]){0, 1, 1, 2, 2, 3}, 3, NULL, 0),
                   QMAT_OK);
  qmat_context_uninit(&context);
  return medial;
}

static void test_a_turn_of_a_joint_moves_the_spheres_of_its_side(void **state) {
  (void)state;
  qmat_mesh *mesh = skinned_capsule();
  qmat_medial *medial = row_of_spheres(), *again = row_of_spheres();
  qmat_context context = {.threads = 1}, parallel = {.threads = 8};
  assert_int_equal(qmat_joints_of_spheres(&context, mesh, medial), QMAT_OK);
  assert_int_equal(qmat_joints_of_spheres(&parallel, mesh, again), QMAT_OK);
  assert_int_equal(medial->skinned_count, 5);
  assert_memory_equal(medial->weights, again->weights, 20 * sizeof *medial->weights);
  assert_memory_equal(medial->joints, again->joints, 20 * sizeof *medial->joints);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  /* Joint 6 turns by 90 degrees about the z axis, joint 4 stays. */
  static const double expected[][2] = {{-2, 0}, {-1, 0}, {0, 1}, {0, 2}, {0, 1.5}};
  for (size_t i = 0; i < 5; i++) {
    double moved[2] = {0, 0};
    for (size_t k = 0; k < 4; k++) {
      const double weight = medial->weights[4 * i + k], x = medial->spheres[4 * i], y = medial->spheres[4 * i + 1];
      const bool turns = medial->joints[4 * i + k] == 6;
      moved[0] += weight * (turns ? -y : x);
      moved[1] += weight * (turns ? x : y);
    }
    /* Weights fall from the ends to the middle, so that those at +-1 are mixed, and the ends a little. */
    static const double allowed_of[] = {0.2, 0.45, 0.45, 0.2, 1e-12};
    const double allowed = allowed_of[i];
    assert_near(moved[0], expected[i][0], allowed);
    assert_near(moved[1], expected[i][1], allowed);
  }
  assert_int_equal(medial->joints[4], 4);
  assert_int_equal(medial->joints[8], 6);
  assert_near(medial->weights[4] - medial->weights[8], 0, 1e-6); /* the capsule is symmetric */
  qmat_value_release(&mesh->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&again->base);
  qmat_context_uninit(&context);
  qmat_context_uninit(&parallel);
}

static void test_a_mesh_without_a_skin_leaves_spheres_as_they_are(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 8));
  qmat_medial *medial = row_of_spheres();
  assert_int_equal(qmat_joints_of_spheres(&context, mesh, medial), QMAT_OK);
  assert_int_equal(medial->skinned_count, 0);
  assert_null(medial->joints);
  qmat_value_release(&mesh->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_points_of_the_envelope_follow_the_spheres_beside_them(void **state) {
  (void)state;
  /* A cone, a slab and a sphere, all of radius 1. Sphere i follows joint 10 + i; sphere 1 half joint 10. */
  static const double spheres[] = {0, 0, 0, 1, 8, 0, 0, 1, 0, 20, 0, 1, 6, 20, 0, 1, 0, 26, 0, 1, 0, 0, 30, 1};
  const uint32_t edge[] = {0, 1}, triangle[] = {2, 3, 4};
  qmat_medial *medial = medial_mesh(spheres, 6, edge, 1, triangle, 1);
  medial->skinned_count = 6;
  medial->joints = qmat_calloc(4 * 6, sizeof *medial->joints);
  medial->weights = qmat_calloc(4 * 6, sizeof *medial->weights);
  assert_true(medial->joints && medial->weights);
  for (uint32_t i = 0; i < 6; i++) {
    medial->joints[4 * i] = 10 + i;
    medial->weights[4 * i] = 1;
  }
  medial->joints[5] = 10;
  medial->weights[4] = medial->weights[5] = 0.5;
  double points[] = {2, 1, 0, -1, 0, 0, 8, 0, 1.5, 2, 22, 1, 0, 0, 31};
  qmat_mesh mesh = {.vertex_count = 5, .positions = points};
  static const struct {
    uint32_t joints[3];
    double weights[3];
  } expected[] = {{{10, 11, 0}, {0.875, 0.125, 0}}, /* a quarter of the way to sphere 1 */
                  {{10, 0, 0}, {1, 0, 0}},
                  {{10, 11, 0}, {0.5, 0.5, 0}},
                  {{12, 13, 14}, {1. / 3, 1. / 3, 1. / 3}},
                  {{15, 0, 0}, {1, 0, 0}}};
  uint32_t joints[20];
  double weights[20];
  qmat_context context = {.threads = 2};
  assert_int_equal(qmat_joints_of_envelope(&context, medial, &mesh, joints, weights), QMAT_OK);
  for (size_t v = 0; v < 5; v++) {
    for (size_t e = 0; e < 3; e++) {
      double found = 0;
      for (size_t k = 4 * v; k < 4 * v + 4; k++)
        if (joints[k] == expected[v].joints[e]) found += weights[k];
      if (expected[v].weights[e] > 0) assert_near(found, expected[v].weights[e], 1e-9);
    }
  }
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_points_near_a_surface_follow_the_corners_beside_them(void **state) {
  (void)state;
  qmat_mesh *model = shape_new();
  const uint32_t corners[] = {shape_vertex(model, 0, 0, 0), shape_vertex(model, 4, 0, 0), shape_vertex(model, 0, 4, 0),
                              shape_vertex(model, 0, 0, 4)};
  shape_triangle(model, corners[0], corners[2], corners[1]);
  shape_triangle(model, corners[0], corners[1], corners[3]);
  shape_triangle(model, corners[0], corners[3], corners[2]);
  shape_triangle(model, corners[1], corners[2], corners[3]);
  model->skinned_count = 4;
  model->joints = qmat_calloc(16, sizeof *model->joints);
  model->weights = qmat_calloc(16, sizeof *model->weights);
  assert_true(model->joints && model->weights);
  for (uint32_t v = 0; v < 4; v++) model->joints[4 * v] = 10 + v, model->weights[4 * v] = 1;
  shape_seal(model);
  static const double points[] = {1, 2, -1, 9, -1, -1, 3, -0.5, 0, -3, 1, 1};
  static const double expected[4][4] = {{0.25, 0.25, 0.5, 0}, {0, 1, 0, 0}, {0.25, 0.75, 0, 0}, {0.5, 0, 0.25, 0.25}};
  qmat_mesh *mesh = shape_new();
  for (size_t v = 0; v < 4; v++) shape_vertex(mesh, points[3 * v], points[3 * v + 1], points[3 * v + 2]);
  qmat_context context = {.threads = 2};
  assert_int_equal(qmat_joints_of_surface(&context, model, mesh), QMAT_OK);
  assert_int_equal(mesh->skinned_count, 4);
  for (size_t v = 0; v < 4; v++)
    for (uint32_t joint = 0; joint < 4; joint++) {
      double found = 0;
      for (size_t k = 4 * v; k < 4 * v + 4; k++) found += mesh->joints[k] == 10 + joint ? mesh->weights[k] : 0;
      assert_near(found, expected[v][joint], 1e-12);
    }
  qmat_value_release(&model->base);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_strongest_four_are_kept_and_sum_to_one),
      cmocka_unit_test(test_a_turn_of_a_joint_moves_the_spheres_of_its_side),
      cmocka_unit_test(test_a_mesh_without_a_skin_leaves_spheres_as_they_are),
      cmocka_unit_test(test_points_of_the_envelope_follow_the_spheres_beside_them),
      cmocka_unit_test(test_points_near_a_surface_follow_the_corners_beside_them),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
