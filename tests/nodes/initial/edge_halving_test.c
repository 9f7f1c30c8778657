/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/edge_halving.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "tests/shapes.h"

/* Halves the edge between two spheres (model units) of a solid. Returns the number of spheres that this adds; `middle`
 * receives the first of them. */
static size_t halve(qmat_mesh *solid, const double spheres[8], double tolerance, double most, double middle[4]) {
  qmat_context context = {0};
  qmat_surface *surface;
  qmat_medial *medial = qmat_medial_new();
  size_t added;
  assert_int_equal(qmat_surface_new(&context, shape_seal(solid), &surface), QMAT_OK);
  const double diagonal = qmat_surface_frame(surface)->diagonal;
  medial->spheres = qmat_alloc(2, 4 * sizeof *medial->spheres);
  medial->sphere_count = 2;
  qmat_frame_spheres_to_unit(qmat_surface_frame(surface), spheres, 2, medial->spheres);
  assert_int_equal(qmat_medial_set_simplices(&context, medial, (const uint32_t[]){0, 1}, 1, NULL, 0), QMAT_OK);
  assert_int_equal(qmat_edges_halve(&context, surface, medial, tolerance / diagonal, most / diagonal, &added), QMAT_OK);
  assert_int_equal(medial->sphere_count, 2 + added);
  assert_int_equal(medial->edge_count, 1 + added);
  if (added > 0) qmat_frame_spheres_to_model(qmat_surface_frame(surface), &medial->spheres[8], 1, middle);
  qmat_value_release(&medial->base);
  qmat_surface_free(surface);
  qmat_value_release(&solid->base);
  qmat_context_uninit(&context);
  return added;
}

/* Two boxes with a gap of 0.5. The sphere halfway between two of radius 0.4 leaves them by 0.65: its centre is 0.25
 * outside. */
static qmat_mesh *make_boxes(void) {
  qmat_mesh *mesh = shape_box(1, 1, 1);
  shape_add_box(mesh, 1.5, 0, 0, 2.5, 1, 1, false);
  return mesh;
}

static const double across[8] = {0.5, 0.5, 0.5, 0.4, 2, 0.5, 0.5, 0.4};

/* The new sphere is a point of the surface. The halves leave the solid by at most 0.4. */
static void test_an_edge_across_the_outside_is_halved_on_the_surface(void **state) {
  (void)state;
  double middle[4];
  assert_int_equal(halve(make_boxes(), across, 0.01, 0.64, middle), 1);
  assert_true(fabs(middle[0] - 1) < 1e-9 || fabs(middle[0] - 1.5) < 1e-9);
  for (int k = 1; k < 3; k++) assert_true(fabs(middle[k] - 0.5) < 1e-9);
  assert_true(middle[3] == 0);
}

static void test_an_edge_near_enough_stays_whole(void **state) {
  (void)state;
  double middle[4];
  assert_int_equal(halve(make_boxes(), across, 0.01, 0.66, middle), 0);
}

/* Two plates of thickness 0.01 with a gap of 0.5: their spheres are smaller than the tolerance. */
static void test_an_edge_between_thin_walls_is_halved_on_the_surface(void **state) {
  (void)state;
  const double spheres[8] = {0.5, 0.5, 0.005, 0.005, 2, 0.5, 0.005, 0.005};
  double middle[4];
  for (int apart = 0; apart < 2; apart++) {
    qmat_mesh *plates = shape_box(1, 1, 0.01);
    shape_add_box(plates, apart ? 1.5 : 1, 0, 0, 2.5, 1, 0.01, false);
    assert_int_equal(halve(plates, spheres, 0.01, 0.05, middle), apart);
  }
}

/* The sphere halfway leaves the solid by less than the tolerance, and by more than edges outside may. */
static void test_edges_outside_have_a_limit_of_their_own(void **state) {
  (void)state;
  double middle[4];
  assert_int_equal(halve(make_boxes(), across, 0.75, 0.66, middle), 0);
  assert_int_equal(halve(make_boxes(), across, 0.75, 0.64, middle), 1);
}

/* In a bar of 1 by 1 the sphere halfway between two of radius 0.7, which leave it already, is that of radius 0.5. */
static void test_an_edge_inside_is_halved_by_an_inscribed_sphere(void **state) {
  (void)state;
  const double spheres[8] = {1, 0.5, 0.5, 0.7, 3, 0.5, 0.5, 0.7};
  double middle[4];
  assert_int_equal(halve(shape_box(4, 1, 1), spheres, 0.25, 0.25, middle), 0);
  assert_true(halve(shape_box(4, 1, 1), spheres, 0.1, 0.1, middle) > 0);
  const double inscribed[4] = {2, 0.5, 0.5, 0.5};
  for (int k = 0; k < 4; k++) assert_true(fabs(middle[k] - inscribed[k]) < 1e-9);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_an_edge_across_the_outside_is_halved_on_the_surface),
      cmocka_unit_test(test_an_edge_near_enough_stays_whole),
      cmocka_unit_test(test_an_edge_between_thin_walls_is_halved_on_the_surface),
      cmocka_unit_test(test_edges_outside_have_a_limit_of_their_own),
      cmocka_unit_test(test_an_edge_inside_is_halved_by_an_inscribed_sphere),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
