/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/lost_handles.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "tests/nodes/pipeline.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

typedef struct {
  qmat_lost_handle handles[8];
  size_t count;
  double diagonal;
} answer;

/* Handles that a medial mesh in the model's frame has lost; places and sizes in the model's frame too. */
static answer find(qmat_mesh *mesh, const double *spheres, size_t sphere_count, const uint32_t *edges,
                   size_t edge_count, const uint32_t *triangles, size_t triangle_count, double longest, size_t most) {
  qmat_context context = {0};
  qmat_surface *surface;
  qmat_lost_handle *handles;
  answer a;
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  const qmat_frame *frame = qmat_surface_frame(surface);
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = sphere_count;
  medial->spheres = qmat_alloc(4 * sphere_count, sizeof(double));
  qmat_frame_spheres_to_unit(frame, spheres, sphere_count, medial->spheres);
  assert_int_equal(qmat_medial_set_simplices(&context, medial, edges, edge_count, triangles, triangle_count), QMAT_OK);
  assert_int_equal(
      qmat_lost_handles_find(&context, surface, medial, longest / frame->diagonal, most, &handles, &a.count), QMAT_OK);
  assert_true(a.count <= COUNT(a.handles) && a.count <= most);
  for (size_t i = 0; i < a.count; i++) {
    a.handles[i] = handles[i];
    qmat_frame_to_model(frame, handles[i].place, 1, a.handles[i].place);
    a.handles[i].size *= frame->diagonal;
  }
  qmat_value_release(&medial->base);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  return a;
}

static void assert_handle(const qmat_lost_handle *handle, double x, double y, double z, double length, bool is_hole) {
  assert_near(handle->place[0], x, 1e-9);
  assert_near(handle->place[1], y, 1e-9);
  assert_near(handle->place[2], z, 1e-9);
  assert_near(handle->size, length / acos(-1), 1e-9);
  assert_int_equal(handle->is_hole, is_hole);
}

static const double corners[] = {-4, -4, 0, 0.5, 4, -4, 0, 0.5, 4, 4, 0, 0.5, -4, 4, 0, 0.5};

static void test_a_closed_hole_is_found_where_it_was(void **state) {
  (void)state;
  static const uint32_t plate[] = {0, 1, 2, 0, 2, 3};
  const answer a = find(shape_frame(0.6), corners, 4, NULL, 0, plate, 2, 4, 1);
  assert_int_equal(a.count, 1);
  assert_near(a.handles[0].place[0], 0, 1e-9);
  assert_near(a.handles[0].place[1], 0, 1e-9);
  assert_near(a.handles[0].size, 4 * 0.6 / acos(-1), 1e-9);
  assert_true(a.handles[0].is_hole);
}

/* All four loops around the corners of a thin frame are as long; one of them is outside of the envelope. */
static void test_a_cut_handle_is_found_where_it_is_cut(void **state) {
  (void)state;
  static const double ring[] = {-4.75, -4.75, 0, 0.4, 4.75, -4.75, 0, 0.4, 4.75, 4.75, 0, 0.4, -4.75, 4.75, 0, 0.4};
  for (uint32_t cut = 0; cut < 4; cut++) {
    double spheres[16];
    memcpy(spheres, ring, sizeof ring);
    const uint32_t others[] = {(cut + 1) % 4, (cut + 2) % 4, (cut + 2) % 4, (cut + 3) % 4};
    memcpy(&spheres[4 * cut], &ring[4 * ((cut + 1) % 4)], 4 * sizeof *spheres); /* away from its corner */
    const answer a = find(shape_frame(9), spheres, 4, others, 2, NULL, 0, 5, 1);
    assert_int_equal(a.count, 1);
    assert_handle(&a.handles[0], ring[4 * cut], ring[4 * cut + 1], 0, 2 + sqrt(2), false);
  }
}

/* The loop around the hole and that around the arm are two handles' worth of classes, and no third one is left. */
static void test_no_two_are_the_same_handle(void **state) {
  (void)state;
  static const uint32_t plate[] = {0, 1, 2, 0, 2, 3};
  const answer a = find(shape_frame(2), corners, 4, NULL, 0, plate, 2, 30, 8);
  assert_int_equal(a.count, 2);
  assert_true(a.handles[0].is_hole != a.handles[1].is_hole);
}

static void test_longer_loops_and_surfaces_without_handles_have_none(void **state) {
  (void)state;
  static const uint32_t plate[] = {0, 1, 2, 0, 2, 3};
  answer a = find(shape_frame(0.6), corners, 4, NULL, 0, plate, 2, 2.3, 8);
  assert_int_equal(a.count, 0);
  qmat_mesh *box = shape_new();
  shape_add_box(box, -5, -5, -0.5, 5, 5, 0.5, false);
  shape_seal(box);
  a = find(box, corners, 4, NULL, 0, plate, 2, 100, 8);
  assert_int_equal(a.count, 0);
  qmat_mesh *open = shape_new();
  shape_triangle(open, shape_vertex(open, 0, 0, 0), shape_vertex(open, 1, 0, 0), shape_vertex(open, 0, 1, 0));
  shape_seal(open);
  a = find(open, corners, 4, NULL, 0, plate, 2, 100, 8);
  assert_int_equal(a.count, 0);
}

/* Around the tube of a torus of radii 2 and 0.6, cut anywhere. */
static void test_a_loop_around_a_fine_mesh_is_about_as_long_as_the_circle(void **state) {
  (void)state;
  static const double ball[] = {2, 0, 0, 0.6};
  const answer a = find(pipeline_model("torus", 16), ball, 1, NULL, 0, NULL, 0, 5, 1);
  assert_int_equal(a.count, 1);
  assert_near(a.handles[0].size, 1.2, 0.05);
  assert_near(hypot(a.handles[0].place[0], a.handles[0].place[1]), 2, 0.1);
  assert_false(a.handles[0].is_hole);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_closed_hole_is_found_where_it_was),
      cmocka_unit_test(test_a_cut_handle_is_found_where_it_is_cut),
      cmocka_unit_test(test_no_two_are_the_same_handle),
      cmocka_unit_test(test_longer_loops_and_surfaces_without_handles_have_none),
      cmocka_unit_test(test_a_loop_around_a_fine_mesh_is_about_as_long_as_the_circle),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
