/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_joints.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/joint_weights.h"
#include "core/geometry/triangle.h"
#include "tests/shapes.h"

enum { RINGS = 41 };
static const double length = 4;

/* The share of joint 5 at a place: 0 before the middle, 1 behind it. Joint 2 has the rest. */
static double share_at(double x) {
  return fmin(fmax((x - 1.8) / 0.4, 0), 1);
}

/* A square bar along x from 0 to 4 with a ring of four vertices at each tenth of a unit. */
static qmat_mesh *skinned_bar(void) {
  static const double corners[4][2] = {{0, 0}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};
  qmat_mesh *mesh = qmat_mesh_new();
  assert_non_null(mesh);
  mesh->vertex_count = mesh->skinned_count = 4 * RINGS;
  mesh->positions = qmat_alloc(3 * mesh->vertex_count, sizeof *mesh->positions);
  mesh->joints = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->joints);
  mesh->weights = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->weights);
  mesh->triangles = qmat_alloc(3 * (8 * (RINGS - 1) + 4), sizeof *mesh->triangles);
  assert_true(mesh->positions && mesh->joints && mesh->weights && mesh->triangles);
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const double x = length * (double)(v / 4) / (RINGS - 1), share = share_at(x);
    memcpy(mesh->positions + 3 * v, (const double[]){x, corners[v % 4][0], corners[v % 4][1]}, 3 * sizeof(double));
    mesh->joints[4 * v] = share > 0.5 ? 5 : 2;
    mesh->joints[4 * v + 1] = share > 0.5 ? 2 : 5;
    mesh->weights[4 * v] = fmax(share, 1 - share);
    mesh->weights[4 * v + 1] = fmin(share, 1 - share);
  }
  uint32_t *row = mesh->triangles;
  for (uint32_t i = 0; i + 1 < RINGS; i++)
    for (uint32_t k = 0; k < 4; k++) {
      const uint32_t a = 4 * i + k, b = 4 * i + (k + 1) % 4;
      memcpy(row, (const uint32_t[]){a, b, b + 4, a, b + 4, a + 4}, 6 * sizeof *row);
      row += 6;
    }
  const uint32_t e = 4 * (RINGS - 1), ends[] = {0, 2, 1, 0, 3, 2, e, e + 1, e + 2, e, e + 2, e + 3};
  memcpy(row, ends, sizeof ends);
  mesh->triangle_count = 8 * (RINGS - 1) + 4;
  return shape_seal(mesh);
}

/* The same bar of 12 triangles in the unit frame of its box, as decimation leaves it. */
static qmat_skin_triangles plain_bar(const qmat_frame *frame) {
  qmat_mesh *box = shape_box(length, 0.5, 0.5);
  qmat_skin_triangles bar = {box->vertex_count, box->triangle_count, box->positions, box->triangles};
  qmat_frame_to_unit(frame, bar.positions, bar.vertex_count, bar.positions);
  box->positions = NULL;
  box->triangles = NULL;
  box->vertex_count = box->triangle_count = 0;
  qmat_value_release(&box->base);
  return bar;
}

static void drop(qmat_skin_triangles *surface) {
  qmat_free(surface->positions);
  qmat_free(surface->triangles);
}

static double area_of(const qmat_skin_triangles *s) {
  double area = 0, normal[3];
  for (size_t t = 0; t < s->triangle_count; t++) {
    const uint32_t *row = s->triangles + 3 * t;
    area += qmat_triangle_area(s->positions + 3 * (size_t)row[0], s->positions + 3 * (size_t)row[1],
                               s->positions + 3 * (size_t)row[2], normal);
  }
  return area;
}

/* Whether each edge is between two triangles, once in each direction. */
static bool is_closed(const qmat_skin_triangles *s) {
  for (size_t i = 0; i < 3 * s->triangle_count; i++) {
    const uint32_t a = s->triangles[i], b = s->triangles[i % 3 == 2 ? i - 2 : i + 1];
    size_t same = 0, opposite = 0;
    for (size_t k = 0; k < 3 * s->triangle_count; k++) {
      const uint32_t from = s->triangles[k], to = s->triangles[k % 3 == 2 ? k - 2 : k + 1];
      same += from == a && to == b;
      opposite += from == b && to == a;
    }
    if (same != 1 || opposite != 1) return false;
  }
  return true;
}

/* The largest difference, in the middle of edges, of the share of joint 5 between the ends from that there. */
static double bend_error(const qmat_skin_triangles *s, const qmat_frame *frame) {
  double worst = 0;
  for (size_t i = 0; i < 3 * s->triangle_count; i++) {
    double ends[2][3];
    const uint32_t ids[] = {s->triangles[i], s->triangles[i % 3 == 2 ? i - 2 : i + 1]};
    for (int k = 0; k < 2; k++) qmat_frame_to_model(frame, s->positions + 3 * (size_t)ids[k], 1, ends[k]);
    for (int k = 1; k < 20; k++) {
      const double at = k / 20., x = ends[0][0] + at * (ends[1][0] - ends[0][0]);
      const double between = (1 - at) * share_at(ends[0][0]) + at * share_at(ends[1][0]);
      worst = fmax(worst, fabs(between - share_at(x)));
    }
  }
  return worst;
}

static void test_edges_are_divided_where_joints_change(void **state) {
  (void)state;
  qmat_mesh *model = skinned_bar();
  qmat_context context = {.threads = 1}, parallel = {.threads = 8};
  qmat_frame frame;
  assert_int_equal(qmat_frame_of_mesh(&context, model, &frame), QMAT_OK);
  qmat_skin_triangles bar = plain_bar(&frame), again = plain_bar(&frame);
  const double area = area_of(&bar);
  assert_true(bend_error(&bar, &frame) > 0.4);
  assert_int_equal(qmat_skin_divide_at_joints(&context, model, &frame, 0.005, 0, &bar), QMAT_OK);
  assert_int_equal(qmat_skin_divide_at_joints(&parallel, model, &frame, 0.005, 0, &again), QMAT_OK);
  assert_true(bend_error(&bar, &frame) < 0.1);
  assert_true(bar.vertex_count > 8 && bar.vertex_count < 60);
  assert_true(is_closed(&bar));
  assert_near(area_of(&bar), area, 1e-12);
  assert_int_equal(bar.vertex_count, again.vertex_count);
  assert_int_equal(bar.triangle_count, again.triangle_count);
  assert_memory_equal(bar.positions, again.positions, 3 * bar.vertex_count * sizeof *bar.positions);
  assert_memory_equal(bar.triangles, again.triangles, 3 * bar.triangle_count * sizeof *bar.triangles);
  drop(&bar);
  drop(&again);
  qmat_value_release(&model->base);
  qmat_context_uninit(&context);
  qmat_context_uninit(&parallel);
}

static void test_no_more_triangles_are_made_than_allowed(void **state) {
  (void)state;
  qmat_mesh *model = skinned_bar();
  qmat_context context = {.threads = 1};
  qmat_frame frame;
  assert_int_equal(qmat_frame_of_mesh(&context, model, &frame), QMAT_OK);
  for (size_t most = 10; most < 60; most += 12) {
    qmat_skin_triangles bar = plain_bar(&frame);
    assert_int_equal(qmat_skin_divide_at_joints(&context, model, &frame, 0.005, most, &bar), QMAT_OK);
    assert_true(bar.triangle_count <= (most > 12 ? most : 12) && (most < 46 || bar.triangle_count > 12));
    assert_true(is_closed(&bar));
    drop(&bar);
  }
  qmat_value_release(&model->base);
  qmat_context_uninit(&context);
}

/* Sheets have vertices of their own for each slab and side. */
static void test_edges_in_one_place_are_divided_alike(void **state) {
  (void)state;
  qmat_mesh *model = skinned_bar();
  qmat_context context = {.threads = 1};
  qmat_frame frame;
  assert_int_equal(qmat_frame_of_mesh(&context, model, &frame), QMAT_OK);
  const double corners[3][3] = {{0.3, 0, 0}, {3.9, 0.5, 0}, {0.3, 0.5, 0}};
  qmat_skin_triangles sheet = {6, 2, qmat_alloc(18, sizeof(double)), qmat_alloc(6, sizeof(uint32_t))};
  assert_true(sheet.positions && sheet.triangles);
  for (uint32_t i = 0; i < 6; i++) {
    qmat_frame_to_unit(&frame, corners[i < 3 ? i : 5 - i], 1, sheet.positions + 3 * (size_t)i);
    sheet.triangles[i] = i;
  }
  assert_int_equal(qmat_skin_divide_at_joints(&context, model, &frame, 0.005, 0, &sheet), QMAT_OK);
  assert_true(sheet.vertex_count > 10 && sheet.vertex_count % 2 == 0);
  for (size_t v = 0; v < sheet.vertex_count; v++) {
    size_t same = 0;
    for (size_t i = 0; i < sheet.vertex_count; i++)
      same += memcmp(sheet.positions + 3 * i, sheet.positions + 3 * v, 3 * sizeof(double)) == 0;
    assert_int_equal(same, 2);
  }
  drop(&sheet);
  qmat_value_release(&model->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_edges_are_divided_where_joints_change),
      cmocka_unit_test(test_no_more_triangles_are_made_than_allowed),
      cmocka_unit_test(test_edges_in_one_place_are_divided_alike),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
