/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Parts that face inwards, and what it takes to find out whether they are cavities. */
#include "nodes/mesh/turned_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/shapes.h"

/* Solid angles of triangles are summed by their calls of atan2 (--wrap). */
double __real_atan2(double y, double x);
double __wrap_atan2(double y, double x);
static atomic_size_t angles;

double __wrap_atan2(double y, double x) {
  angles++;
  return __real_atan2(y, x);
}

/* A sphere around across^3 boxes that face inwards, and as many beside it. */
static qmat_mesh *foam(uint32_t rings, int across) {
  qmat_mesh *mesh = shape_sphere(0.3, rings);
  for (int side = 0; side < 2; side++)
    for (int i = 0; i < across * across * across; i++) {
      double low[3];
      for (int k = 0, rest = i; k < 3; k++, rest /= across)
        low[k] = 0.3 * ((rest % across + 0.5) / across - 0.5) + 0.7 * side;
      const double edge = 0.1 / across;
      shape_add_box(mesh, low[0], low[1], low[2], low[0] + edge, low[1] + edge, low[2] + edge, true);
    }
  return shape_seal(mesh);
}

/* The solid angles that it takes to find the cavities of a foam. */
static size_t angles_of(uint32_t rings, int across) {
  qmat_context context = {.threads = 2};
  qmat_mesh *mesh = foam(rings, across);
  qmat_parts parts;
  assert_int_equal(
      qmat_parts_find(&context, mesh->vertex_count, mesh->positions, mesh->triangle_count, mesh->triangles, &parts),
      QMAT_OK);
  const size_t boxes = (size_t)(across * across * across);
  assert_int_equal(parts.part_count, 1 + 2 * boxes);
  uint8_t *facing = qmat_arena_calloc(&context.arena, parts.part_count, 1);
  assert_non_null(facing);
  angles = 0;
  assert_int_equal(qmat_find_turned_parts(&context, &parts, facing), QMAT_OK);
  const size_t count = angles;
  for (size_t i = 0; i < parts.part_count; i++) {
    const double x =
        mesh->positions[3 * (size_t)mesh->triangles[3 * (size_t)parts.members[parts.parts[i].first_member]]];
    const qmat_facing expected = parts.parts[i].triangle_count > 12 ? QMAT_FACING_OUT
                                 : x > 0.35                         ? QMAT_FACING_TURNED
                                                                    : QMAT_FACING_CAVITY;
    assert_int_equal(facing[i], expected);
  }
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  return count;
}

/* Four times the triangles around eight times the boxes would be 32 times the angles of a sum over all triangles. */
static void test_cavities_of_large_parts_cost_about_a_step_of_a_tree_each(void **state) {
  (void)state;
  const size_t few = angles_of(24, 3), many = angles_of(48, 6);
  assert_true(few > 0);
  if (many > 12 * few) fail_msg("%zu solid angles for 8 times as many boxes, after %zu", many, few);
}

/* A tree alone errs near one half: a box in the plane of a rim. */
static void test_where_a_tree_leaves_doubt_triangles_decide(void **state) {
  (void)state;
  for (int step = -20; step <= 20; step++) {
    qmat_context context = {.threads = 1};
    qmat_mesh *mesh = shape_sphere(0.3, 24), *bowl = shape_new();
    for (size_t i = 0; i < mesh->vertex_count; i++)
      shape_vertex(bowl, mesh->positions[3 * i], mesh->positions[3 * i + 1], mesh->positions[3 * i + 2]);
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      const uint32_t *row = &mesh->triangles[3 * t];
      double most = -1;
      for (int k = 0; k < 3; k++) most = fmax(most, mesh->positions[3 * (size_t)row[k] + 2]);
      if (most < 0.01) shape_triangle(bowl, row[0], row[1], row[2]);
    }
    const size_t of_bowl = bowl->triangle_count;
    const double at = -0.005 + 0.01 * step;
    shape_add_box(bowl, -0.005, -0.005, at, 0.005, 0.005, at + 0.01, true);
    qmat_part parts_of[2] = {
        {.kind = QMAT_PART_HOLES, .triangle_count = of_bowl, .volume = 0.05},
        {.kind = QMAT_PART_CLOSED, .first_member = of_bowl, .triangle_count = 12, .volume = -1e-6}};
    uint32_t *members = qmat_arena_alloc(&context.arena, bowl->triangle_count, sizeof *members);
    for (uint32_t i = 0; i < bowl->triangle_count; i++) members[i] = i;
    const qmat_parts parts = {.vertex_count = bowl->vertex_count,
                              .triangle_count = bowl->triangle_count,
                              .positions = bowl->positions,
                              .triangles = bowl->triangles,
                              .part_count = 2,
                              .parts = parts_of,
                              .members = members};
    double winding = 0;
    const double centre[3] = {0, 0, at + 0.005};
    for (size_t t = 0; t < of_bowl; t++) {
      const double *corners[3];
      for (int k = 0; k < 3; k++) corners[k] = &bowl->positions[3 * (size_t)bowl->triangles[3 * t + (size_t)k]];
      winding += qmat_seen_share(centre, corners[0], corners[1], corners[2]);
    }
    uint8_t facing[2] = {0};
    assert_int_equal(qmat_find_turned_parts(&context, &parts, facing), QMAT_OK);
    if (fabs(winding - 0.5) > 0.02)
      assert_int_equal(facing[1], winding > 0.5 ? QMAT_FACING_CAVITY : QMAT_FACING_TURNED);
    qmat_value_release(&mesh->base);
    qmat_value_release(&bowl->base);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_cavities_of_large_parts_cost_about_a_step_of_a_tree_each),
      cmocka_unit_test(test_where_a_tree_leaves_doubt_triangles_decide),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
