/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.colliders of skinned meshes: each joint has shapes of its own, which contain what moves with it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/joint_division.h"
#include "nodes/colliders/joint_points.h"
#include "nodes/colliders/shape_set.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/collider_run.h"

static const double pi = 3.14159265358979323846;
enum { RINGS = 31, AROUND = 16 };
static const double half = 1.5, radius = 0.4;

/* The joints and weights of a vertex, by its place along the tube. */
typedef void skin_fn(double x, uint32_t joints[4], double weights[4]);

static void of_arm(double x, uint32_t joints[4], double weights[4]) {
  weights[0] = 1;
  joints[0] = x > 0;
}

/* Arms 1 and 2 on both sides of a torso 0. */
static void of_biped(double x, uint32_t joints[4], double weights[4]) {
  weights[0] = 1;
  joints[0] = x < -0.55 ? 1 : x > 0.55 ? 2 : 0;
}

static void all_equal(double x, uint32_t joints[4], double weights[4]) {
  static const uint32_t given[] = {3, 1, 2, 7};
  (void)x;
  for (int k = 0; k < 4; k++) joints[k] = given[k], weights[k] = 0.25;
}

static void one_joint(double x, uint32_t joints[4], double weights[4]) {
  (void)x;
  joints[0] = 5, weights[0] = 1;
}

/* As the arm, but joint 2 has near the elbow as much as never the most. */
static void with_a_helper(double x, uint32_t joints[4], double weights[4]) {
  of_arm(x, joints, weights);
  if (fabs(x) > 0.3) return;
  joints[1] = 2;
  weights[0] = 0.55, weights[1] = 0.45;
}

/* A tube along x with flat ends; `skin` NULL: none. */
static qmat_mesh *tube(skin_fn *skin) {
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < RINGS; i++)
    for (int k = 0; k < AROUND; k++)
      shape_vertex(mesh, half * (2.0 * i / (RINGS - 1) - 1), radius * cos(2 * pi * k / AROUND),
                   radius * sin(2 * pi * k / AROUND));
  const uint32_t ends[2] = {shape_vertex(mesh, -half, 0, 0), shape_vertex(mesh, half, 0, 0)};
  for (uint32_t i = 0; i + 1 < RINGS; i++)
    for (uint32_t k = 0; k < AROUND; k++) {
      const uint32_t a = i * AROUND + k, b = i * AROUND + (k + 1) % AROUND;
      shape_quad(mesh, a, a + AROUND, b + AROUND, b);
    }
  for (uint32_t k = 0; k < AROUND; k++) {
    const uint32_t next = (k + 1) % AROUND, last = (RINGS - 1) * AROUND;
    shape_triangle(mesh, ends[0], k, next);
    shape_triangle(mesh, ends[1], last + next, last + k);
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) { /* the first ones point inward */
    uint32_t *row = mesh->triangles + 3 * t, first = row[0];
    row[0] = row[1], row[1] = first;
  }
  if (!skin) return mesh;
  mesh->skinned_count = mesh->vertex_count;
  mesh->joints = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->joints);
  mesh->weights = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->weights);
  assert_true(mesh->joints && mesh->weights);
  for (size_t v = 0; v < mesh->vertex_count; v++)
    skin(mesh->positions[3 * v], mesh->joints + 4 * v, mesh->weights + 4 * v);
  return mesh;
}

/* Two cones that meet away from the middle. */
static qmat_medial *cones(void) {
  const double spheres[] = {-1.2, 0, 0, 0.4, 0.7, 0, 0, 0.4, 1.2, 0, 0, 0.4};
  const uint32_t edges[] = {0, 1, 1, 2};
  return sealed_medial_mesh(spheres, 3, edges, 2, NULL, 0);
}

static size_t count_of(const qmat_colliders *c, uint32_t joint) {
  size_t count = 0;
  assert_int_equal(c->joint_count, c->shape_count);
  for (size_t i = 0; i < c->joint_count; i++) count += c->joints[i] == joint;
  return count;
}

/* The distance of a point to the nearest shape of a joint, or to the nearest hull. */
static double away(const qmat_colliders *c, uint32_t joint, const double *point, bool of_hulls) {
  double least = INFINITY;
  for (size_t i = 0; i < c->shape_count; i++) {
    if (c->joints[i] != joint) continue;
    qmat_prepared_shape shape;
    qmat_shape_prepare(&shape, c->spheres, &c->shapes[3 * i]);
    double far = of_hulls ? -INFINITY : qmat_shape_distance(&shape, point, NULL);
    for (size_t t = i > 0 ? c->hull_ends[2 * i - 1] : 0; of_hulls && t < c->hull_ends[2 * i + 1]; t++) {
      const double *p[3];
      double u[3], v[3], n[3];
      for (int k = 0; k < 3; k++) p[k] = &c->points[3 * (size_t)c->triangles[3 * t + (size_t)k]];
      qmat_subtract(p[1], p[0], u);
      qmat_subtract(p[2], p[0], v);
      qmat_cross(u, v, n);
      qmat_normalize(n);
      far = fmax(far, qmat_dot(n, point) - qmat_dot(n, p[0]));
    }
    least = fmin(least, far);
  }
  return least;
}

/* Turns what joint 1 moves by 90 degrees about z, in place. */
static void bend(double *places, size_t stride, size_t i, uint32_t joint) {
  double *p = places + stride * i, x = p[0];
  if (joint == 1) p[0] = -p[1], p[1] = x;
}

static void test_a_bent_arm_stays_inside_the_shapes_of_its_joints(void **state) {
  (void)state;
  static const char *const kinds[] = {"any", "capsules", "spheres", "hulls"};
  for (int kind = 0; kind < 4; kind++) {
    char params[64];
    snprintf(params, sizeof params, "fit=contain kind=%s", kinds[kind]);
    collider_run r = make_colliders(tube(of_arm), cones(), params, 2);
    qmat_colliders *c = r.colliders;
    assert_true(count_of(c, 0) > 0 && count_of(c, 1) > 0);
    assert_int_equal(count_of(c, 0) + count_of(c, 1), c->shape_count);
    /* No sphere or point of a hull has two joints. */
    uint8_t *done = calloc(c->sphere_count + c->point_count, 1);
    assert_non_null(done);
    for (size_t i = 0; i < c->shape_count; i++) {
      for (int k = 0; k < 3; k++) {
        const size_t id = c->shapes[3 * i + (size_t)k];
        if (!done[id]) bend(c->spheres, 4, id, c->joints[i]);
        done[id] = 1;
      }
      for (size_t p = i > 0 ? c->hull_ends[2 * i - 2] : 0; p < c->hull_ends[2 * i]; p++)
        bend(c->points, 3, p, c->joints[i]);
    }
    free(done);
    for (size_t v = 0; v < r.mesh->vertex_count; v++) {
      double posed[3];
      memcpy(posed, r.mesh->positions + 3 * v, sizeof posed);
      bend(posed, 3, 0, r.mesh->joints[4 * v]);
      assert_true(away(c, r.mesh->joints[4 * v], posed, false) < 1e-9 || kind == 3);
      assert_true(away(c, r.mesh->joints[4 * v], posed, true) < 1e-9);
    }
    collider_run_free(&r);
  }
}

static void test_a_cone_is_divided_where_the_joint_changes(void **state) {
  (void)state;
  collider_run r = make_colliders(tube(of_arm), cones(), "", 2);
  const qmat_colliders *c = r.colliders;
  assert_int_equal(c->shape_count, 3);
  assert_int_equal(count_of(c, 0), 1);
  for (size_t i = 0; i < c->shape_count; i++)
    for (int k = 0; k < 2; k++) {
      const double *s = &c->spheres[4 * (size_t)c->shapes[3 * i + (size_t)k]];
      assert_near(s[3], 0.4, 1e-12);
      if (c->joints[i] == 0)
        assert_near(s[0], k ? 0.05 : -1.2, k ? 0.06 : 1e-12); /* rings are at -0.1, 0 and 0.1 */
      else
        assert_true(s[0] > -0.01);
    }
  const json_t *joints = json_object_get(r.report->root, "joints");
  assert_int_equal(json_array_size(joints), 2);
  for (size_t i = 0; i < 2; i++) {
    const json_t *row = json_array_get(joints, i);
    assert_int_equal(json_integer_value(json_object_get(row, "joint")), i);
    assert_int_equal(json_integer_value(json_object_get(row, "shapes")), count_of(c, (uint32_t)i));
  }
  assert_string_equal(json_string_value(json_object_get(r.report->root, "pose")), "bind");
  collider_run_free(&r);
}

static void test_what_is_between_the_parts_of_a_cone_is_halved(void **state) {
  (void)state;
  qmat_context context = {0};
  double spheres[] = {-2, 0, 0, 0.5, 2, 0, 0, 0.5}, places[] = {-1, 0.5, 0, 0, 1, 0.5, 0, 0, 1.4, 0.5, 0, 0};
  uint32_t edges[] = {0, 1}, of_points[] = {4, 9, 9}, *joints;
  const qmat_medial unit = {.sphere_count = 2, .edge_count = 1, .spheres = spheres, .edges = edges};
  const qmat_joint_points points = {.count = 3, .points = places, .joints = of_points, .joint_count = 2};
  qmat_medial divided;
  assert_int_equal(qmat_joint_points_divide(&context, &points, &unit, &divided, &joints), QMAT_OK);
  assert_int_equal(divided.sphere_count, 4);
  assert_int_equal(divided.edge_count, 2);
  static const double expected[] = {-2, 0, 0, 2};
  for (size_t i = 0; i < 4; i++) {
    assert_int_equal(divided.edges[i], i);
    assert_int_equal(joints[i], i < 2 ? 4 : 9);
    assert_near(divided.spheres[4 * i], expected[i], 1e-12);
    assert_near(divided.spheres[4 * i + 3], 0.5, 1e-12);
  }
  qmat_context_uninit(&context);
}

static void test_a_slab_is_divided_where_the_joint_changes(void **state) {
  (void)state;
  const double spheres[] = {-1.2, -0.1, 0, 0.3, 1.2, -0.1, 0, 0.3, 0, 0.1, 0, 0.3};
  const uint32_t edges[] = {0, 1, 0, 2, 1, 2}, triangle[] = {0, 1, 2};
  collider_run r = make_colliders(tube(of_arm), sealed_medial_mesh(spheres, 3, edges, 3, triangle, 1), "", 2);
  const qmat_colliders *c = r.colliders;
  bool left = false, right = false;
  assert_true(count_of(c, 0) > 0 && count_of(c, 1) > 0);
  for (size_t i = 0; i < c->shape_count; i++)
    for (int k = 0; k < 3; k++) {
      const double *s = &c->spheres[4 * (size_t)c->shapes[3 * i + (size_t)k]];
      assert_near(s[3], 0.3, 1e-12);
      assert_true(fabs(s[1]) <= 0.1 + 1e-12);
      assert_true(c->joints[i] == 0 ? s[0] < 0.2 : s[0] > -0.2);
      left = left || s[0] < -1.19, right = right || s[0] > 1.19;
    }
  assert_true(left && right);
  collider_run_free(&r);
}

static void test_both_arms_of_a_biped_have_shapes(void **state) {
  (void)state;
  static const char *const params[] = {"fit=contain kind=capsules", "fit=contain kind=hulls", "fit=both", "fit=inside"};
  for (int i = 0; i < 4; i++) {
    collider_run r = make_colliders(tube(of_biped), cones(), params[i], 2);
    for (uint32_t joint = 0; joint < 3; joint++) assert_true(count_of(r.colliders, joint) > 0);
    if (i == 1) assert_int_equal(r.colliders->shape_count, 3);
    collider_run_free(&r);
  }
}

static void test_shapes_of_two_joints_are_not_joined(void **state) {
  (void)state;
  static const char *const params[] = {"fit=contain kind=capsules shapes=1", "fit=contain kind=hulls shapes=1",
                                       "kind=spheres shapes=1", "fit=inside shapes=1"};
  for (int i = 0; i < 4; i++) {
    collider_run r = make_colliders(tube(of_biped), cones(), params[i], 2);
    assert_int_equal(r.colliders->shape_count, 3);
    for (uint32_t joint = 0; joint < 3; joint++) assert_int_equal(count_of(r.colliders, joint), 1);
    collider_run_free(&r);
  }
}

/* What one joint moves is the same as without a skin, and has that joint. */
static void must_be_as_unskinned(skin_fn *skin, uint32_t joint) {
  static const char *const params[] = {"fit=contain", "fit=contain kind=hulls", "kind=spheres shapes=4", "fit=inside"};
  for (int i = 0; i < 4; i++) {
    collider_run a = make_colliders(tube(NULL), cones(), params[i], 2),
                 b = make_colliders(tube(skin), cones(), params[i], 2);
    qmat_colliders *c = a.colliders, *d = b.colliders;
    assert_int_equal(c->joint_count, 0);
    assert_null(json_object_get(a.report->root, "joints"));
    assert_int_equal(count_of(d, joint), d->shape_count);
    assert_int_equal(c->shape_count, d->shape_count);
    assert_int_equal(c->sphere_count, d->sphere_count);
    assert_int_equal(c->point_count, d->point_count);
    assert_memory_equal(c->spheres, d->spheres, 4 * c->sphere_count * sizeof *c->spheres);
    assert_memory_equal(c->shapes, d->shapes, 3 * c->shape_count * sizeof *c->shapes);
    assert_memory_equal(c->points, d->points, 3 * c->point_count * sizeof *c->points);
    collider_run_free(&a);
    collider_run_free(&b);
  }
}

static void test_one_joint_changes_no_shape(void **state) {
  (void)state;
  must_be_as_unskinned(one_joint, 5);
}

static void test_of_equal_weights_the_lowest_joint_wins(void **state) {
  (void)state;
  must_be_as_unskinned(all_equal, 1);
}

static void test_a_joint_that_is_nowhere_the_strongest_has_no_shape(void **state) {
  (void)state;
  collider_run r = make_colliders(tube(with_a_helper), cones(), "fit=contain", 2);
  assert_int_equal(count_of(r.colliders, 2), 0);
  assert_true(count_of(r.colliders, 0) > 0 && count_of(r.colliders, 1) > 0);
  collider_run_free(&r);
}

static void test_threads_change_nothing_and_a_cancel_is_obeyed(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(tube(of_biped));
  qmat_medial *medial = cones();
  const qmat_value *inputs[] = {&mesh->base, &medial->base};
  pipeline_must_ignore_threads("medial.colliders", "fit=contain kind=capsules", inputs);
  pipeline_must_ignore_threads("medial.colliders", "fit=contain kind=hulls", inputs);
  pipeline_must_be_cancelled("medial.colliders", "fit=contain kind=hulls", inputs);
  qmat_value_release(&mesh->base);
  qmat_value_release(&medial->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_bent_arm_stays_inside_the_shapes_of_its_joints),
      cmocka_unit_test(test_a_cone_is_divided_where_the_joint_changes),
      cmocka_unit_test(test_what_is_between_the_parts_of_a_cone_is_halved),
      cmocka_unit_test(test_a_slab_is_divided_where_the_joint_changes),
      cmocka_unit_test(test_both_arms_of_a_biped_have_shapes),
      cmocka_unit_test(test_shapes_of_two_joints_are_not_joined),
      cmocka_unit_test(test_one_joint_changes_no_shape),
      cmocka_unit_test(test_of_equal_weights_the_lowest_joint_wins),
      cmocka_unit_test(test_a_joint_that_is_nowhere_the_strongest_has_no_shape),
      cmocka_unit_test(test_threads_change_nothing_and_a_cancel_is_obeyed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
