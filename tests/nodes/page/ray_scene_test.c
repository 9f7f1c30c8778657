/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rays against the exact distance to the same spheres, cones and slabs. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "nodes/page/ray_scene.h"
#include "tests/medial_meshes.h"
#include "tests/random.h"
#include "tests/shapes.h"

static qmat_ray_scene *scene_of(qmat_context *context, const qmat_medial *medial) {
  qmat_ray_scene *scene;
  if (qmat_ray_scene_new(context, NULL, medial, &scene) != QMAT_OK) fail_msg("%s", context->error.message);
  return scene;
}

static void test_a_sphere_a_cone_and_a_slab_by_hand(void **state) {
  (void)state;
  qmat_context context = {0};
  static const double spheres[] = {0, 0, 0, 0.1, 1, 0, 0, 0.1, 0, 1, 0, 0.1, 3, 0, 0, 0.2};
  qmat_medial *medial = sealed_medial_mesh(spheres, 4, NULL, 0, (const uint32_t[]){0, 1, 2}, 1);
  qmat_ray_scene *scene = scene_of(&context, medial);
  static const struct {
    double x, y, depth;
    qmat_look_kind kind;
  } rays[] = {
      {3, 0, 0.2, QMAT_LOOK_SPHERE},               /* the middle of the lone sphere */
      {-0.06, -0.03, 0.0741620, QMAT_LOOK_SPHERE}, /* beyond the ends of both cones: sqrt(0.1^2 - 0.06^2 - 0.03^2) */
      {0.5, -0.06, 0.08, QMAT_LOOK_CONE},          /* beside the slab: the side of the cone along x */
      {0.25, 0.25, 0.1, QMAT_LOOK_SLAB}};          /* the flat face */
  for (size_t i = 0; i < sizeof rays / sizeof *rays; i++) {
    const qmat_ray_hit hit =
        qmat_ray_scene_medial(scene, (const double[]){rays[i].x, rays[i].y, 2}, (const double[]){0, 0, -1});
    assert_near(hit.distance, 2 - rays[i].depth, 1e-4);
    assert_int_equal(hit.kind, rays[i].kind);
    assert_near(hit.normal[2], rays[i].kind == QMAT_LOOK_SPHERE && i == 0 ? 1 : hit.normal[2], 1e-4);
  }
  const qmat_ray_hit face = qmat_ray_scene_medial(scene, (const double[]){0.25, 0.25, 2}, (const double[]){0, 0, -1});
  assert_near(face.normal[2], 1, 1e-6);
  const qmat_ray_hit cone = qmat_ray_scene_medial(scene, (const double[]){0.5, -0.06, 2}, (const double[]){0, 0, -1});
  assert_near(cone.normal[1], -0.6, 1e-4);
  assert_near(cone.normal[2], 0.8, 1e-4);
  assert_true(qmat_ray_scene_medial(scene, (const double[]){2, 0, 2}, (const double[]){0, 0, -1}).distance == INFINITY);
  qmat_ray_scene_free(scene);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* A ray ends where the signed distance is zero, and the distance is positive on all of the way. */
static void test_rays_end_on_the_envelope_and_miss_nothing(void **state) {
  (void)state;
  size_t hits = 0;
  for (uint64_t round = 0; round < 40; round++) {
    qmat_context context = {0};
    random_numbers random = {.seed = round};
    double spheres[6 * 4];
    for (size_t i = 0; i < 24; i++)
      spheres[i] = i % 4 == 3 ? 0.02 + 0.2 * random_between(&random, 0, 1) : random_between(&random, 0, 1) - 0.5;
    static const uint32_t edges[] = {3, 4, 4, 5}, slabs[] = {0, 1, 2, 1, 2, 3};
    qmat_medial *medial = sealed_medial_mesh(spheres, 6, edges, 2, slabs, 2);
    qmat_envelope *envelope;
    assert_int_equal(qmat_envelope_of_medial(&context, medial, &envelope), QMAT_OK);
    qmat_ray_scene *scene = scene_of(&context, medial);
    for (int i = 0; i < 200; i++) {
      double origin[3] = {4 * random_between(&random, 0, 1) - 2, 4 * random_between(&random, 0, 1) - 2, 3},
             direction[3], length = 0;
      for (int k = 0; k < 3; k++) {
        direction[k] = random_between(&random, 0, 1) - 0.5 - origin[k];
        length += direction[k] * direction[k];
      }
      for (int k = 0; k < 3; k++) direction[k] /= sqrt(length);
      const qmat_ray_hit hit = qmat_ray_scene_medial(scene, origin, direction);
      const double end = hit.distance < INFINITY ? hit.distance : 6;
      for (int step = 0; step <= 100; step++) {
        double at[3];
        for (int k = 0; k < 3; k++) at[k] = origin[k] + end * step / 100 * direction[k];
        const double f = qmat_envelope_distance(envelope, at, NULL);
        if (step < 100 || end == 6) assert_true(f > -1e-4);
        if (step == 100 && end != 6) assert_near(f, 0, 1e-4);
      }
      hits += hit.distance < INFINITY;
    }
    qmat_ray_scene_free(scene);
    qmat_envelope_free(envelope);
    qmat_value_release(&medial->base);
    qmat_context_uninit(&context);
  }
  assert_true(hits > 2000);
}

static void test_spheres_of_no_radius_and_cones_inside_of_a_sphere_are_no_obstacle(void **state) {
  (void)state;
  qmat_context context = {0};
  static const double spheres[] = {0, 0, 0, 0, 1, 0, 0, 0, 0, 5, 0, 1, 0.1, 5, 0, 0.1, 0, 5, 0, 1};
  static const uint32_t edges[] = {0, 1, 2, 3, 2, 4};
  qmat_medial *medial = sealed_medial_mesh(spheres, 5, edges, 3, NULL, 0);
  qmat_ray_scene *scene = scene_of(&context, medial);
  const double down[3] = {0, 0, -1};
  assert_true(qmat_ray_scene_medial(scene, (const double[]){0.5, 0, 2}, down).distance == INFINITY);
  const qmat_ray_hit hit = qmat_ray_scene_medial(scene, (const double[]){0, 5, 3}, down);
  assert_near(hit.distance, 2, 1e-6);
  assert_int_equal(hit.kind, QMAT_LOOK_SPHERE);
  qmat_ray_scene_free(scene);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_sphere_a_cone_and_a_slab_by_hand),
      cmocka_unit_test(test_rays_end_on_the_envelope_and_miss_nothing),
      cmocka_unit_test(test_spheres_of_no_radius_and_cones_inside_of_a_sphere_are_no_obstacle),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
