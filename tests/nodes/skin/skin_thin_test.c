/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_thin.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/disjoint_sets.h"
#include "tests/shapes.h"

static qmat_skin_triangles copy_of(const qmat_mesh *mesh) {
  qmat_skin_triangles surface = {mesh->vertex_count, mesh->triangle_count,
                                 qmat_alloc(3 * mesh->vertex_count, sizeof *surface.positions),
                                 qmat_alloc(3 * mesh->triangle_count, sizeof *surface.triangles)};
  assert_true(surface.positions && surface.triangles);
  memcpy(surface.positions, mesh->positions, 3 * mesh->vertex_count * sizeof *surface.positions);
  memcpy(surface.triangles, mesh->triangles, 3 * mesh->triangle_count * sizeof *surface.triangles);
  return surface;
}

static void drop(qmat_skin_triangles *surface) {
  qmat_free(surface->positions);
  qmat_free(surface->triangles);
}

static int compare_edges(const void *a, const void *b) {
  return memcmp(a, b, 2 * sizeof(uint32_t));
}

/* Each side of a triangle is that of one other, the other way round, and each vertex is of one fan. */
static void assert_manifold(const qmat_skin_triangles *surface) {
  const size_t count = 3 * surface->triangle_count;
  uint32_t(*sides)[2] = malloc(2 * count * sizeof *sides), (*turned)[2] = sides + count;
  assert_non_null(sides);
  for (size_t i = 0; i < count; i++) {
    const uint32_t a = surface->triangles[i], b = surface->triangles[i - i % 3 + (i + 1) % 3];
    sides[i][0] = turned[i][1] = a;
    sides[i][1] = turned[i][0] = b;
    assert_true(a != b && a < surface->vertex_count);
  }
  qsort(sides, count, sizeof *sides, compare_edges);
  qsort(turned, count, sizeof *turned, compare_edges);
  assert_memory_equal(sides, turned, count * sizeof *sides);
  for (size_t i = 1; i < count; i++) assert_true(compare_edges(sides[i - 1], sides[i]) != 0);
  free(sides);
  /* The corners around a vertex are one set where triangles share a side. */
  qmat_context context = {0};
  uint32_t *corners = qmat_sets_new(&context, count);
  assert_non_null(corners);
  size_t fans = count;
  for (uint32_t i = 0; i < count; i++) {
    const uint32_t v = surface->triangles[i], next = surface->triangles[i - i % 3 + (i + 1) % 3];
    for (uint32_t k = 0; k < count; k++)
      if (surface->triangles[k] == v && surface->triangles[k - k % 3 + (k + 2) % 3] == next)
        fans -= qmat_sets_join(corners, i, k);
  }
  assert_int_equal(fans, surface->vertex_count);
  qmat_context_uninit(&context);
}

static int64_t euler_of(const qmat_skin_triangles *surface) {
  return (int64_t)surface->vertex_count - (int64_t)(surface->triangle_count / 2);
}

/* Thins a mesh, which it takes. */
static qmat_skin_triangles thinned(qmat_mesh *mesh, double error) {
  qmat_context context = {0};
  qmat_skin_triangles surface = copy_of(mesh);
  const int64_t euler = euler_of(&surface);
  assert_int_equal(qmat_skin_thin(&context, error, 0, &surface), QMAT_OK);
  assert_manifold(&surface);
  assert_int_equal(euler_of(&surface), euler);
  qmat_context_uninit(&context);
  qmat_value_release(&mesh->base);
  return surface;
}

/* The vertex at a place: one that is there, or a new one. */
static uint32_t vertex_at(qmat_mesh *mesh, const double p[3]) {
  for (uint32_t v = 0; v < mesh->vertex_count; v++)
    if (memcmp(mesh->positions + 3 * (size_t)v, p, 3 * sizeof *p) == 0) return v;
  return shape_vertex(mesh, p[0], p[1], p[2]);
}

/* The surface of a box from (0, 0, 0) to (1, 1, 1), n squares a side. */
static qmat_mesh *gridded_box(uint32_t n) {
  qmat_mesh *mesh = shape_new();
  for (uint32_t side = 0; side < 6; side++) {
    const uint32_t axis = side / 2, a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (uint32_t i = 0; i < n * n; i++) {
      uint32_t corners[4];
      for (uint32_t c = 0; c < 4; c++) {
        double p[3];
        p[axis] = side % 2;
        p[a] = (double)(i / n + (c == 1 || c == 2)) / n;
        p[b] = (double)(i % n + (c >= 2)) / n;
        corners[c] = vertex_at(mesh, p);
      }
      if (side % 2)
        shape_quad(mesh, corners[0], corners[1], corners[2], corners[3]);
      else
        shape_quad(mesh, corners[3], corners[2], corners[1], corners[0]);
    }
  }
  return mesh;
}

static void test_a_gridded_box_keeps_its_corners_alone(void **state) {
  (void)state;
  qmat_skin_triangles surface = thinned(shape_seal(gridded_box(6)), 1e-3);
  assert_int_equal(surface.triangle_count, 12);
  for (size_t i = 0; i < 3 * surface.vertex_count; i++)
    assert_true(surface.positions[i] == 0 || surface.positions[i] == 1);
  drop(&surface);
}

static void test_any_error_leaves_a_manifold_of_the_same_topology(void **state) {
  (void)state;
  for (double error = 1e-3; error < 2; error *= 2) {
    qmat_skin_triangles surfaces[] = {thinned(shape_seal(shape_sphere(1, 16)), error),
                                      thinned(shape_seal(shape_torus(1, 0.2, 48, 16)), error),
                                      thinned(shape_seal(shape_torus(1, 0.02, 96, 12)), error)};
    if (error > 0.03 && error < 0.3) assert_true(2 * surfaces[0].triangle_count < 960);
    assert_true(surfaces[1].triangle_count >= 14); /* no torus has fewer */
    for (size_t i = 0; i < 3; i++) drop(&surfaces[i]);
  }
}

static void test_a_component_stays_where_it_is_smaller_than_the_error(void **state) {
  (void)state;
  qmat_mesh *mesh = gridded_box(6);
  shape_add_box(mesh, 5, 0, 0, 5.001, 0.001, 0.001, false);
  qmat_skin_triangles surface = thinned(shape_seal(mesh), 0.02);
  assert_true(surface.triangle_count <= 40); /* the large one has 12 */
  bool is_there = false;
  for (size_t v = 0; v < surface.vertex_count; v++) is_there = is_there || surface.positions[3 * v] > 4.5;
  assert_true(is_there);
  drop(&surface);
}

/* A tube thinner than the error folds in places. These alone keep their triangles: the rest is thinned out. */
static void test_faults_keep_few_triangles(void **state) {
  (void)state;
  qmat_skin_triangles surface = thinned(shape_seal(shape_torus(1, 0.05, 256, 24)), 0.064);
  assert_in_range(surface.triangle_count, 14, 256 * 24 * 2 / 4);
  drop(&surface);
}

/* A ring thinner than the error closes its hole: it is thinned out for less. The box beside it loses nothing by that.
 */
static void test_a_component_that_would_change_its_topology_is_thinned_out_for_less(void **state) {
  (void)state;
  qmat_mesh *mesh = gridded_box(16), *ring = shape_torus(0.5, 0.05, 48, 12);
  shape_add_copy(mesh, ring, 5, 0, 0);
  const size_t of_ring = ring->triangle_count;
  qmat_skin_triangles surface = thinned(shape_seal(mesh), 0.1);
  assert_in_range(surface.triangle_count, 12 + 14, 12 + of_ring / 3);
  drop(&surface);
  qmat_value_release(&ring->base);
}

static bool cancel(void *user, const char *id, const char *type, uint64_t done, uint64_t total, const char *unit) {
  (void)user, (void)id, (void)type, (void)done, (void)total, (void)unit;
  return false;
}

/* A collapse takes two triangles, so the number is met to one of them. */
static void test_a_number_of_triangles_ends_it(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 16));
  qmat_skin_triangles surface = copy_of(mesh);
  const size_t most = mesh->triangle_count / 2;
  assert_int_equal(qmat_skin_thin(&context, 0.5, most, &surface), QMAT_OK);
  assert_manifold(&surface);
  assert_true(surface.triangle_count <= most && surface.triangle_count + 2 > most);
  drop(&surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

static void test_a_cancel_is_obeyed(void **state) {
  (void)state;
  qmat_context context = {.progress = cancel};
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 16));
  qmat_skin_triangles surface = copy_of(mesh);
  assert_int_equal(qmat_skin_thin(&context, 0.01, 0, &surface), QMAT_CANCELLED);
  assert_int_equal(surface.triangle_count, mesh->triangle_count);
  drop(&surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_gridded_box_keeps_its_corners_alone),
      cmocka_unit_test(test_any_error_leaves_a_manifold_of_the_same_topology),
      cmocka_unit_test(test_a_component_stays_where_it_is_smaller_than_the_error),
      cmocka_unit_test(test_faults_keep_few_triangles),
      cmocka_unit_test(test_a_component_that_would_change_its_topology_is_thinned_out_for_less),
      cmocka_unit_test(test_a_number_of_triangles_ends_it),
      cmocka_unit_test(test_a_cancel_is_obeyed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
