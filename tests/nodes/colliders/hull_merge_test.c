/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/hull_merge.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/hull_vertices.h"
#include "tests/shapes.h"
#include "tests/shortage.h"

enum { BALLS = 2, MOST_POINTS = 16, STRIDE = 23 };

/* A mesh that is divided between two balls, each with a hull of its own to be replaced. */
typedef struct bar {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
  qmat_solid_part *parts;
  qmat_colliders *colliders;
} bar;

static void make_bar_of(bar *b, qmat_mesh *mesh) {
  *b = (bar){.context = {.threads = 1}, .mesh = shape_seal(mesh)};
  assert_int_equal(qmat_surface_new(&b->context, b->mesh, &b->surface), QMAT_OK);
  const double unit = 1 / qmat_surface_frame(b->surface)->diagonal;
  double spheres[4 * BALLS] = {0};
  uint32_t shapes[3 * BALLS];
  for (uint32_t i = 0; i < BALLS; i++) {
    spheres[4 * i] = (2 * (double)i - 1) * unit;
    spheres[4 * i + 3] = 0.5 * unit;
    for (int k = 0; k < 3; k++) shapes[3 * i + (uint32_t)k] = i;
  }
  const qmat_shape_set set = {.spheres = spheres, .sphere_count = BALLS, .shapes = shapes, .shape_count = BALLS};
  assert_int_equal(qmat_solid_parts_find(&b->context, b->surface, &set, 0.001, &b->parts), QMAT_OK);
  b->colliders = qmat_colliders_new();
  assert_non_null(b->colliders);
  b->colliders->shape_count = BALLS;
  b->colliders->shapes = qmat_alloc(3 * BALLS, sizeof *b->colliders->shapes);
  b->colliders->hull_ends = qmat_calloc(2 * BALLS, sizeof *b->colliders->hull_ends);
  assert_true(b->colliders->shapes && b->colliders->hull_ends);
  memcpy(b->colliders->shapes, shapes, sizeof shapes);
}

static void make_bar(bar *b) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, -2, -0.5, -0.5, 2, 0.5, 0.5, false);
  make_bar_of(b, mesh);
}

static qmat_status merge_to(bar *b, size_t most_points) {
  const double error = 0.01 * qmat_surface_frame(b->surface)->diagonal;
  return qmat_hulls_merge(&b->context, b->surface, b->parts, 0, most_points, error, b->colliders);
}

static qmat_status merge(bar *b) {
  return merge_to(b, MOST_POINTS);
}

static void free_bar(bar *b) {
  qmat_solid_parts_free(b->parts, BALLS);
  qmat_value_release(&b->colliders->base);
  qmat_surface_free(b->surface);
  qmat_value_release(&b->mesh->base);
  qmat_context_uninit(&b->context);
}

static void test_parts_of_a_bar_become_one_hull(void **state) {
  (void)state;
  bar b;
  make_bar(&b);
  assert_int_equal(merge(&b), QMAT_OK);
  assert_int_equal(b.colliders->shape_count, 1);
  assert_int_equal(b.colliders->point_count, 8);
  assert_int_equal(b.colliders->triangle_count, 12);
  free_bar(&b);
}

/* No pair of parts stays apart because memory was short when it was tested. */
static void test_a_shortage_is_no_refusal_of_a_pair(void **state) {
  (void)state;
  bar b;
  make_bar(&b);
  shortage(SIZE_MAX, 0);
  assert_int_equal(merge(&b), QMAT_OK);
  const size_t needed = atomic_load(&asked);
  free_bar(&b);
  assert_true(needed > 0);
  for (size_t first = 0; first < needed; first += STRIDE) {
    make_bar(&b);
    shortage(first, 1);
    const qmat_status status = merge(&b);
    shortage(SIZE_MAX, 0);
    if (status == QMAT_OK) {
      assert_int_equal(b.colliders->shape_count, 1);
      assert_int_equal(b.colliders->point_count, 8);
    } else {
      assert_int_equal(status, QMAT_ERROR_MEMORY);
      assert_int_equal(b.context.error.status, QMAT_ERROR_MEMORY);
    }
    free_bar(&b);
  }
}

/* The merged hulls of a mesh have no two vertices that single precision could not tell apart. */
static void check_vertices_apart(bar *b) {
  assert_int_equal(merge_to(b, 255), QMAT_OK);
  const double least = 0.99e-5 * qmat_surface_frame(b->surface)->diagonal;
  const qmat_colliders *c = b->colliders;
  for (size_t h = 0, first = 0; h < c->shape_count; first = c->hull_ends[2 * h++])
    for (size_t i = first; i < c->hull_ends[2 * h]; i++)
      for (size_t k = first; k < i; k++) assert_true(qmat_point_distance(&c->points[3 * i], &c->points[3 * k]) > least);
}

static void test_vertices_of_hulls_are_apart_and_the_solid_stays_inside(void **state) {
  (void)state;
  bar b;
  make_bar_of(&b, shape_torus(1, 0.15, 16, 16));
  check_vertices_apart(&b);
  free_bar(&b);

  qmat_mesh *egg = shape_sphere(1, 26);
  for (size_t i = 0; i < egg->vertex_count; i++) egg->positions[3 * i] *= 2.4;
  make_bar_of(&b, egg);
  check_vertices_apart(&b);
  assert_int_equal(b.colliders->shape_count, 1);
  for (size_t t = 0; t < b.colliders->triangle_count; t++) {
    double plane[4];
    assert_true(qmat_hull_plane(b.colliders->points, &b.colliders->triangles[3 * t], plane));
    for (size_t i = 0; i < egg->vertex_count; i++) assert_true(qmat_dot(plane, &egg->positions[3 * i]) < plane[3]);
  }
  free_bar(&b);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_parts_of_a_bar_become_one_hull),
      cmocka_unit_test(test_a_shortage_is_no_refusal_of_a_pair),
      cmocka_unit_test(test_vertices_of_hulls_are_apart_and_the_solid_stays_inside),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
