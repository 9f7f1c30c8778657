/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "core/geometry/sheets.h"
#include "core/geometry/surface.h"
#include "io/model.h"
#include "nodes/mesh/opposite_pairs.h"
#include "nodes/mesh/overlaps.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"
#include "tests/shapes.h"
#include "tests/shortage.h"

/* ---- meshes ---- */

/* Adds the triangles of `part` and releases it. */
static void add(qmat_mesh *mesh, qmat_mesh *part) {
  const uint32_t first = (uint32_t)mesh->vertex_count;
  double *positions = qmat_alloc(mesh->vertex_count + part->vertex_count, 3 * sizeof *positions);
  uint32_t *triangles = qmat_alloc(mesh->triangle_count + part->triangle_count, 3 * sizeof *triangles);
  assert_true(positions && triangles);
  if (mesh->vertex_count > 0) memcpy(positions, mesh->positions, 3 * mesh->vertex_count * sizeof *positions);
  if (mesh->triangle_count > 0) memcpy(triangles, mesh->triangles, 3 * mesh->triangle_count * sizeof *triangles);
  memcpy(positions + 3 * first, part->positions, 3 * part->vertex_count * sizeof *positions);
  for (size_t i = 0; i < 3 * part->triangle_count; i++)
    triangles[3 * mesh->triangle_count + i] = first + part->triangles[i];
  qmat_free(mesh->positions);
  qmat_free(mesh->triangles);
  mesh->positions = positions;
  mesh->triangles = triangles;
  mesh->vertex_count += part->vertex_count;
  mesh->triangle_count += part->triangle_count;
  qmat_value_release(&part->base);
}

static qmat_mesh *sphere_at(double x, double y, double z, double radius, uint32_t rings) {
  qmat_mesh *sphere = shape_sphere(radius, rings);
  shape_map(sphere, 1, x, y, z);
  return sphere;
}

/* Welds equal vertices, as reading a model does. */
static void weld(qmat_mesh *mesh) {
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    const double *p = mesh->positions + 3 * (size_t)mesh->triangles[i];
    for (uint32_t v = 0; v < mesh->triangles[i]; v++)
      if (memcmp(mesh->positions + 3 * (size_t)v, p, 3 * sizeof *p) == 0) mesh->triangles[i] = v;
  }
}

static double volume_of(const qmat_mesh *mesh) {
  double six = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *a = mesh->positions + 3 * (size_t)mesh->triangles[3 * t],
                 *b = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 1],
                 *c = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 2];
    six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return six / 6;
}

static double volume_of_sheets(qmat_mesh *mesh) {
  const size_t solid = mesh->triangle_count - mesh->sheet_triangle_count;
  qmat_mesh sheets = *mesh;
  sheets.triangles += 3 * solid;
  sheets.triangle_count -= solid;
  return volume_of(&sheets);
}

static double area_of(const qmat_mesh *mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *a = mesh->positions + 3 * (size_t)mesh->triangles[3 * t],
                 *b = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 1],
                 *c = mesh->positions + 3 * (size_t)mesh->triangles[3 * t + 2];
    double square = 0;
    for (int k = 0; k < 3; k++) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const double n = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
      square += n * n;
    }
    area += sqrt(square) / 2;
  }
  return area;
}

/* Vertices - edges + triangles, of a mesh whose edges all have two triangles. */
static long euler_of(const qmat_mesh *mesh) {
  return (long)mesh->vertex_count - (long)mesh->triangle_count / 2;
}

/* ---- the node ---- */

static bool is_refused; /* every union */
static bool may_move;   /* blocks that do not quite touch */

typedef struct result {
  qmat_mesh *from, *mesh;
  qmat_report *report;
} result;

static void release(result *r) {
  qmat_value_release(&r->from->base);
  qmat_value_release(&r->mesh->base);
  qmat_value_release(&r->report->base);
}

/* Seals the mesh and runs the node on it. Checks that every edge of the solids is balanced. */
static result unite_with(qmat_mesh *mesh, const char *params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  if (!mesh->base.sealed) shape_seal(mesh);
  pipeline_must_run(0, "mesh.solid", params, (const qmat_value *[]){&mesh->base}, outputs);
  const result r = {mesh, (qmat_mesh *)outputs[0], (qmat_report *)outputs[1]};
  qmat_mesh *copy = shape_new();
  qmat_value_retain(&r.mesh->base);
  add(copy, r.mesh);
  copy->triangle_count -= r.mesh->sheet_triangle_count;
  shape_seal(copy);
  if (strcmp(params, "solid=as_is") != 0)
    assert_true(copy->closed && copy->oriented && r.mesh->closed && r.mesh->oriented);
  if (!strstr(params, "wrap") && !is_refused && !may_move && pipeline_count(r.report, "vertices_welded") == 0)
    assert_true(r.mesh->deviation == mesh->deviation);
  qmat_value_release(&copy->base);
  return r;
}

static result unite(qmat_mesh *mesh) {
  return unite_with(mesh, "");
}

static void check_passes(qmat_mesh *mesh) {
  result r = unite(mesh);
  assert_ptr_equal(r.mesh, r.from);
  assert_int_equal(pipeline_count(r.report, "parts_united"), 0);
  assert_null(json_object_get(r.report->root, "warnings"));
  release(&r);
}

/* A union whose volume, area and Euler characteristic are known. */
static void check_union(qmat_mesh *mesh, double volume, double area, long euler) {
  result r = unite(mesh);
  assert_ptr_not_equal(r.mesh, r.from);
  assert_near(volume_of(r.mesh), volume, 1e-12 * volume);
  assert_near(area_of(r.mesh), area, 1e-12 * area);
  assert_int_equal(euler_of(r.mesh), euler);
  assert_null(json_object_get(r.report->root, "warnings"));
  release(&r);
}

/* ---- by hand ---- */

/* The second box stands out of one side of the first: its four long edges go through that, and nothing else is cut. */
static void test_a_box_through_the_side_of_another(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 4, 4);
  shape_add_box(mesh, 1, 1, 1, 5, 2, 2, false);
  result r = unite(mesh);
  assert_near(volume_of(r.mesh), 32 + 3, 1e-12);
  assert_near(area_of(r.mesh), 2 * 16 + 4 * 8 + 4 * 3, 1e-12);
  /* 8 corners of the first, 4 of the second, 4 on the cut and one where the side's diagonal enters it, or two. */
  assert_int_equal(euler_of(r.mesh), 2);
  assert_in_range(r.mesh->vertex_count, 16, 22);
  assert_int_equal(pipeline_count(r.report, "parts"), 2);
  assert_int_equal(pipeline_count(r.report, "parts_open"), 0);
  assert_int_equal(pipeline_count(r.report, "parts_united"), 2);
  assert_int_equal(pipeline_count(r.report, "triangles"), (int64_t)r.mesh->triangle_count);
  assert_int_equal(pipeline_count(r.report, "vertices"), (int64_t)r.mesh->vertex_count);
  for (size_t i = 0; i < r.mesh->vertex_count; i++) {
    const double *p = r.mesh->positions + 3 * i;
    assert_false(p[0] > 0 && p[0] < 2 && p[1] > 0 && p[1] < 4 && p[2] > 0 && p[2] < 4);
  }
  release(&r);
}

static void test_boxes_across_each_others_corner(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 2, 2);
  shape_add_box(mesh, 1, 1, 1, 3, 3, 3, false);
  check_union(mesh, 8 + 8 - 1, 24 + 24 - 6, 2);
}

static void test_boxes_that_share_a_face_become_one(void **state) {
  (void)state;
  for (int welded = 0; welded < 2; welded++) {
    qmat_mesh *mesh = shape_box(1, 1, 1);
    shape_add_box(mesh, 1, 0, 0, 2, 1, 1, false);
    if (welded) weld(mesh);
    result r = unite(mesh);
    assert_near(volume_of(r.mesh), 2, 1e-15);
    assert_near(area_of(r.mesh), 10, 1e-15);
    assert_int_equal(r.mesh->vertex_count, 12);
    assert_int_equal(r.mesh->triangle_count, 20);
    release(&r);
  }
}

/* A smaller side in the middle of a larger one, and one that hangs over its edge. */
static void test_boxes_that_share_a_part_of_a_face(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 3, 3);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, false);
  check_union(mesh, 9 + 1, 2 * 9 + 4 * 3 + 4, 2);
  mesh = shape_box(1, 3, 3);
  shape_add_box(mesh, 1, 2, 1, 2, 4, 2, false);
  check_union(mesh, 9 + 2, 2 * 9 + 4 * 3 + 2 * 1 + 4 * 2 - 2 * 1, 2);
}

/* Blocks of one welded shell. What lies between them has the inside on both sides, and bounds nothing. */
static void test_blocks_that_share_vertices_have_no_walls_between_them(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1); /* a smaller side at a larger one, with two corners in common */
  shape_add_box(mesh, 1, 0, 0, 2, 1, 0.5, false);
  weld(mesh);
  result r = unite(mesh);
  assert_near(volume_of(r.mesh), 1.5, 1e-12);
  assert_near(area_of(r.mesh), 6 + 4 - 2 * 0.5, 1e-12);
  assert_int_equal(euler_of(r.mesh), 2);
  assert_int_equal(pipeline_count(r.report, "parts"), 1);
  assert_int_equal(pipeline_count(r.report, "parts_united"), 1);
  release(&r);
  mesh = shape_box(1, 1, 1); /* the same side, with another diagonal */
  shape_add_box(mesh, 1, 0, 0, 2, 1, 1, false);
  uint32_t *side = mesh->triangles + 3 * (12 + 8); /* towards the first box */
  assert_int_equal(side[2], side[3 + 1]);
  side[2] = side[3 + 2];
  side[3] = side[1];
  weld(mesh);
  check_union(mesh, 2, 10, 2);
  mesh = shape_new(); /* four of any height around one line */
  for (int i = 0; i < 4; i++) shape_add_box(mesh, i & 1, i / 2, 0, (i & 1) + 1, i / 2 + 1, 0.5 + 0.25 * i, false);
  weld(mesh);
  check_union(mesh, 3.5, 2 * 4 + 2 * 3.5 + 2 * 0.25 + 2 * 0.5, 2);
  mesh = shape_box(1, 1, 1); /* in a model so large that the wall is short */
  shape_add_box(mesh, 1, 0, 0, 2, 1, 0.5, false);
  shape_add_box(mesh, -400, 0, 0, -399, 1, 1, false);
  weld(mesh);
  check_union(mesh, 2.5, 15, 4);
}

/* Two blocks whose touching sides are a little off, turned about an axis in space; and two level ones. Sides that are
 * less than a millionth of the diagonal apart, which is between 11 and 12, touch. */
static void test_blocks_that_rounding_moved_apart_become_one(void **state) {
  (void)state;
  static const double offs[] = {0, 1e-12, -1e-12, 5e-6, -5e-6, 5e-5};
  for (size_t i = 0; i < sizeof offs / sizeof *offs; i++) {
    const double off = fabs(offs[i]);
    qmat_mesh *mesh = shape_box(1, 1, 1);
    shape_add_box(mesh, 1 + offs[i], 0, 0.25, 2, 1, 0.75, false);
    shape_rotate(mesh);
    shape_add_box(mesh, 9, 0, 0, 10, 1, 1, false);
    shape_add_box(mesh, 10 + offs[i], 0.5, 0.25, 11, 2, 0.75, false);
    may_move = true;
    result r = unite(mesh);
    may_move = false;
    assert_near(volume_of(r.mesh), 1 + 0.5 + 1 + 0.75, 1e-9 + 2 * off);
    assert_near(area_of(r.mesh), 6 + 4 + 6 + 5.5 - (off > 2e-5 ? 0 : 2 * 0.5 + 2 * 0.25), 1e-9 + 10 * off);
    assert_int_equal(pipeline_count(r.report, "parts_united"), off > 2e-5 ? 0 : 4);
    /* What is new is as far from the sides as they are apart. */
    assert_true(r.mesh->deviation <= sqrt(3) * 1.001 * off);
    assert_true((r.mesh->deviation >= off) == (off < 1e-11 ? off == 0 : off < 2e-5));
    /* The given vertices stay where they are. */
    size_t kept = 0;
    for (size_t v = 0; v < r.mesh->vertex_count; v++)
      for (size_t k = 0; k < mesh->vertex_count; k++)
        kept += memcmp(r.mesh->positions + 3 * v, mesh->positions + 3 * k, 3 * sizeof(double)) == 0;
    assert_int_equal(kept, 32);
    release(&r);
  }
}

/* Boxes in line whose sides lie in the same planes where they overlap. */
static void test_boxes_with_sides_in_the_same_planes(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 1, 1);
  shape_add_box(mesh, 1, 0, 0, 3, 1, 1, false);
  check_union(mesh, 3, 14, 2);
}

static void test_a_part_within_another_vanishes(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(4, 4, 4);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, false);
  shape_add_box(mesh, 2.5, 2.5, 2.5, 3, 3, 3, false);
  result r = unite(mesh);
  assert_int_equal(r.mesh->vertex_count, 8);
  assert_int_equal(r.mesh->triangle_count, 12);
  assert_memory_equal(r.mesh->positions, mesh->positions, 24 * sizeof(double));
  assert_memory_equal(r.mesh->triangles, mesh->triangles, 36 * sizeof(uint32_t));
  assert_int_equal(pipeline_count(r.report, "parts_united"), 2);
  assert_int_equal(pipeline_count(r.report, "triangles_cut"), 0);
  release(&r);
}

static void test_cavities_and_what_is_in_them_stay(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(9, 9, 9);
  shape_add_box(mesh, 1, 1, 1, 8, 8, 8, true);
  shape_add_box(mesh, 2, 2, 2, 7, 7, 7, false);
  shape_add_box(mesh, 3, 3, 3, 6, 6, 6, true);
  check_passes(mesh);
}

/* A bar from outside into a cavity fills a part of it. */
static void test_a_part_through_the_wall_of_a_cavity(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(9, 9, 9);
  shape_add_box(mesh, 1, 1, 1, 8, 8, 8, true);
  shape_add_box(mesh, 4, 4, 4, 12, 5, 5, false);
  check_union(mesh, 729 - 343 + 4 + 3, 6 * 81 + 6 * 49 + 4 * 3 + 4 * 4, 4);
}

/* A cavity's shell that two solids wind around is filled by either. */
static void test_a_cavity_within_another_solid_is_filled(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(9, 9, 9);
  shape_add_box(mesh, 4, 4, 4, 5, 5, 5, true);
  shape_add_box(mesh, 3, 3, 3, 6, 6, 6, false);
  result r = unite(mesh);
  assert_int_equal(r.mesh->triangle_count, 12);
  assert_near(volume_of(r.mesh), 729, 0);
  release(&r);
}

static void test_of_equal_parts_one_is_left(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 6);
  for (int i = 0; i < 3; i++) add(mesh, shape_sphere(1, 6));
  qmat_mesh *one = shape_sphere(1, 6);
  check_union(mesh, volume_of(one), area_of(one), 2);
  qmat_value_release(&one->base);
}

/* Nothing is lost where parts only touch: in a point of a side, along an edge, in a corner that both name. */
static void test_parts_that_touch_in_points_and_lines_stay(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 2, 2);
  shape_add_box(mesh, 2, 2, 0, 4, 4, 2, false); /* along an edge */
  check_passes(mesh);
  mesh = shape_box(2, 2, 2);
  shape_add_box(mesh, 2, 2, 0, 4, 4, 2, false);
  weld(mesh);
  check_passes(mesh);
  mesh = shape_box(2, 2, 2);
  shape_add_box(mesh, 2, 2, 2, 4, 4, 4, false); /* in a corner */
  weld(mesh);
  check_passes(mesh);
  mesh = shape_box(2, 2, 2); /* a tetrahedron's corner on a side */
  const uint32_t a = shape_vertex(mesh, 2, 0.5, 1.25), b = shape_vertex(mesh, 3, 0, 0), c = shape_vertex(mesh, 3, 1, 0),
                 d = shape_vertex(mesh, 3, 0, 1);
  shape_triangle(mesh, a, c, b);
  shape_triangle(mesh, a, d, c);
  shape_triangle(mesh, a, b, d);
  shape_triangle(mesh, b, c, d);
  const double volume = volume_of(mesh);
  if (volume < 8)
    for (size_t t = mesh->triangle_count - 4; t < mesh->triangle_count; t++) {
      const uint32_t corner = mesh->triangles[3 * t];
      mesh->triangles[3 * t] = mesh->triangles[3 * t + 1];
      mesh->triangles[3 * t + 1] = corner;
    }
  check_passes(mesh);
}

static void test_one_part_and_parts_apart_pass(void **state) {
  (void)state;
  check_passes(shape_box(1, 2, 3));
  check_passes(shape_torus(2, 0.5, 12, 8));
  qmat_mesh *mesh = shape_box(1, 1, 1);
  shape_add_box(mesh, 2, 0, 0, 3, 1, 1, false);
  check_passes(mesh);
  mesh = shape_torus(2, 0.5, 24, 12); /* boxes meet, parts do not */
  add(mesh, sphere_at(0, 0, 0, 1.2, 6));
  check_passes(mesh);
}

static void test_parts_are_kept_when_asked(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 2, 2);
  shape_add_box(mesh, 1, 1, 1, 3, 3, 3, false);
  result r = unite_with(mesh, "solid=as_is");
  assert_ptr_equal(r.mesh, r.from);
  release(&r);
}

/* Two cubes that overlap, and a sheet through both, which shares an edge with one. */
static void test_sheets_stay_the_last_triangles_and_cut_nothing(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 2, 2, 2, false);
  shape_add_box(mesh, 1, 1, 1, 3, 3, 3, false);
  shape_triangle(mesh, 0, 1, shape_vertex(mesh, 1, 4, 4));
  mesh->sheet_triangle_count = 1;
  mesh->sheet_thickness = 0.25;
  mesh->closed = mesh->oriented = true;
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_OK);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "mesh.solid", "", (const qmat_value *[]){&mesh->base}, outputs);
  const qmat_mesh *united = (const qmat_mesh *)outputs[0];
  assert_int_equal(pipeline_count((qmat_report *)outputs[1], "parts_united"), 2);
  assert_int_equal(pipeline_count((qmat_report *)outputs[1], "parts_open"), 0);
  assert_int_equal(united->sheet_triangle_count, 1);
  assert_near(united->sheet_thickness, 0.25, 0);
  assert_near(volume_of(united), 15, 1e-12); /* the sheet's plane contains the origin */
  const double *top = united->positions + 3 * (size_t)united->triangles[3 * united->triangle_count - 1];
  assert_true(top[0] == 1 && top[1] == 4 && top[2] == 4);
  qmat_value_release(&mesh->base);
  qmat_value_release(outputs[0]);
  qmat_value_release(outputs[1]);
  qmat_context_uninit(&context);
}

static void test_open_parts_stay_and_do_not_keep_others_from_uniting(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 2, 2);
  shape_add_box(mesh, 1, 1, 1, 3, 3, 3, false);
  const uint32_t a = shape_vertex(mesh, -1, 0.5, 0.5), b = shape_vertex(mesh, 4, 0.5, 0.5),
                 c = shape_vertex(mesh, 1, 4, 0.5);
  shape_triangle(mesh, a, b, c);
  result r = unite(mesh);
  assert_int_equal(r.mesh->sheet_triangle_count, 1);
  assert_int_equal(pipeline_count(r.report, "parts"), 3);
  assert_int_equal(pipeline_count(r.report, "parts_open"), 1);
  assert_int_equal(pipeline_count(r.report, "parts_united"), 2);
  size_t found = 0;
  for (size_t t = 0; t < r.mesh->triangle_count; t++) {
    const double *p = r.mesh->positions + 3 * (size_t)r.mesh->triangles[3 * t],
                 *q = r.mesh->positions + 3 * (size_t)r.mesh->triangles[3 * t + 1];
    found += p[0] == -1 && q[0] == 4;
  }
  assert_int_equal(found, 1);
  release(&r);
}

/* A bent bar that goes through itself: alone it passes; another part at its end frees it of that. */
static qmat_mesh *knot(void) {
  static const double path[6][2] = {{0, 0}, {4, 0}, {4, 3}, {2, 3}, {2, -3}, {2, -4}};
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < 6; i++)
    for (int k = 0; k < 4; k++) {
      const double out = k == 1 || k == 2 ? 0.25 : -0.25, up = k >= 2 ? 0.25 : -0.25;
      const double *p = path[i], *to = path[i < 5 ? i + 1 : i], *from = path[i < 5 ? i : i - 1];
      const double *last = path[i > 0 ? i - 1 : i];
      const double length = hypot(to[0] - from[0], to[1] - from[1]);
      double nx = -(to[1] - from[1]) / length, ny = (to[0] - from[0]) / length;
      if (i > 0 && i < 5) { /* mitred; the way before is at a right angle or straight on */
        const double before = hypot(p[0] - last[0], p[1] - last[1]);
        const double mx = -(p[1] - last[1]) / before, my = (p[0] - last[0]) / before;
        if (fabs(mx * nx + my * ny) < 0.5) nx += mx, ny += my;
      }
      shape_vertex(mesh, p[0] + out * nx, p[1] + out * ny, up + 0.1 * (i == 1 || i == 2));
    }
  shape_quad(mesh, 0, 1, 2, 3);
  shape_quad(mesh, 23, 22, 21, 20);
  for (uint32_t i = 0; i < 5; i++)
    for (uint32_t k = 0; k < 4; k++)
      shape_quad(mesh, 4 * i + k, 4 * i + 4 + k, 4 * i + 4 + (k + 1) % 4, 4 * i + (k + 1) % 4);
  if (volume_of(mesh) < 0)
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      const uint32_t corner = mesh->triangles[3 * t];
      mesh->triangles[3 * t] = mesh->triangles[3 * t + 1];
      mesh->triangles[3 * t + 1] = corner;
    }
  return mesh;
}

static void test_parts_that_meet_themselves(void **state) {
  (void)state;
  qmat_mesh *mesh = knot();
  const double volume = volume_of(mesh);
  result alone = unite(mesh);
  assert_in_range((unsigned long)(1e4 * (volume - volume_of(alone.mesh))), 1000, 1300);
  assert_int_equal(euler_of(alone.mesh), 0);
  release(&alone);
  mesh = knot();
  shape_add_box(mesh, -1, -0.5, -0.5, 0, 0.5, 0.5, false); /* touches the bar's whole end from without */
  result r = unite(mesh);
  const double united = volume_of(r.mesh);
  /* What the bar has in common with itself counts once: near 0.5 cubed. */
  assert_in_range((unsigned long)(1e4 * (volume + 1 - united)), 1000, 1300);
  assert_int_equal(euler_of(r.mesh), 0);
  release(&r);
}

/* Adds a sleeve of height 2 with a cuff, made by turning a profile: up the sleeve, then out and down. Its border is
 * that of the cuff, whose cap cuts through the sleeve. */
static void add_sleeve(qmat_mesh *mesh, uint32_t around) {
  static const double profile[][2] = {{1, 0}, {1, 2}, {1.4, 1.8}, {1.4, 1.5}};
  enum { RINGS = sizeof profile / sizeof *profile };
  const uint32_t first = (uint32_t)mesh->vertex_count;
  for (size_t ring = 0; ring < RINGS; ring++)
    for (uint32_t i = 0; i < around; i++) {
      const double turn = 2 * acos(-1) * i / around;
      shape_vertex(mesh, profile[ring][0] * cos(turn), profile[ring][0] * sin(turn), profile[ring][1]);
    }
  const uint32_t bottom = shape_vertex(mesh, 0, 0, 0);
  for (uint32_t i = 0; i < around; i++) {
    const uint32_t a = first + i, b = first + (i + 1) % around;
    shape_triangle(mesh, bottom, b, a);
    for (uint32_t ring = 0; ring + 1 < RINGS; ring++)
      shape_quad(mesh, ring * around + a, ring * around + b, (ring + 1) * around + b, (ring + 1) * around + a);
  }
}

/* Points of all given triangles have to be inside or near the result, for each `steps` along a side. */
static void assert_nothing_is_lost(const result *r, int steps, double distance) {
  qmat_context context = {0};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, r->mesh, &surface), QMAT_OK);
  for (size_t t = 0; t < r->from->triangle_count; t++)
    for (int i = 0; i <= steps; i++)
      for (int j = 0; j <= steps - i; j++) {
        const double weights[3] = {(double)i / steps, (double)j / steps, (double)(steps - i - j) / steps};
        double point[3] = {0, 0, 0}, unit[3];
        for (size_t k = 0; k < 9; k++)
          point[k % 3] += weights[k / 3] * r->from->positions[3 * (size_t)r->from->triangles[3 * t + k / 3] + k % 3];
        qmat_frame_to_unit(qmat_surface_frame(surface), point, 1, unit);
        assert_true(qmat_surface_inside(surface, unit) ||
                    qmat_surface_distance(surface, unit, INFINITY, NULL, NULL) <= distance);
      }
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
}

/* The sleeve above the cap of its cuff, and the cuff, have the outside on both sides: they bound nothing, but were
 * given. */
static void test_what_bounds_nothing_of_a_union_is_a_sheet(void **state) {
  (void)state;
  enum { AROUND = 24 };
  qmat_mesh *mesh = shape_new();
  add_sleeve(mesh, AROUND);
  result r = unite_with(mesh, "solid=close");
  assert_int_equal(pipeline_count(r.report, "unbounding_triangles"), 6 * AROUND); /* all but the bottom */
  assert_int_equal(r.mesh->sheet_triangle_count, 6 * AROUND);
  assert_nothing_is_lost(&r, 20, 1e-6);
  /* What is left as a solid is the sleeve below the cap. */
  const qmat_mesh solids = qmat_mesh_of_solids(r.mesh);
  assert_near(volume_of(&solids), 1.5 * AROUND / 2 * sin(2 * acos(-1) / AROUND), 1e-6);
  release(&r);
}

/* Two tetrahedra on one triangle, one of them inside out: they cross only in triangles that share a corner. The tip is
 * sqrt(3) from where it comes out, and half of the longest hidden side is sqrt(4.5); with the distant box the diagonal
 * is 63.14. */
static void test_a_fold_longer_than_three_quarters_of_epsilon_is_united(void **state) {
  (void)state;
  static const struct {
    const char *params;
    bool stays;
  } cases[] = {{"epsilon=4.5%", true}, {"epsilon=4.45%", false}, {"epsilon=1%", false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_mesh *mesh = shape_new();
    const uint32_t a = shape_vertex(mesh, 0, 0, 0), b = shape_vertex(mesh, 3, 0, 0), c = shape_vertex(mesh, 0, 3, 0),
                   top = shape_vertex(mesh, 0, 0, 3), tip = shape_vertex(mesh, 2, 2, 2);
    shape_triangle(mesh, a, b, top);
    shape_triangle(mesh, b, c, top);
    shape_triangle(mesh, c, a, top);
    shape_triangle(mesh, b, a, tip);
    shape_triangle(mesh, c, b, tip);
    shape_triangle(mesh, a, c, tip);
    shape_add_box(mesh, 0, 0, -60, 1, 1, -59, false);
    result r = unite_with(mesh, cases[i].params);
    const qmat_mesh solids = qmat_mesh_of_solids(r.mesh);
    assert_int_equal(pipeline_count(r.report, "parts_united"), !cases[i].stays);
    assert_int_equal(pipeline_count(r.report, "unbounding_triangles"),
                     cases[i].stays ? 0 : 4); /* the tip, and what it covers */
    /* The first has a volume of 4.5, the second of 3, and both have 1.5 in common. */
    assert_near(volume_of(&solids), 1 + (cases[i].stays ? 4.5 - 3 : 4.5 - 1.5), 1e-9);
    release(&r);
  }
}

/* The sleeve sticks out of its solid by 0.5 of a diagonal of 4.43, which is 11.3 %. */
static void test_what_bounds_nothing_within_three_quarters_of_epsilon_is_a_flap(void **state) {
  (void)state;
  enum { AROUND = 24 };
  static const struct {
    const char *params;
    bool is_flap;
  } cases[] = {{"solid=close epsilon=0.15", false},
               {"solid=close epsilon=0.155", true},
               {"solid=close epsilon=0.155 thickness=0.02", false},
               {"solid=close epsilon=0.17 thickness=0.02", true}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_mesh *mesh = shape_new();
    add_sleeve(mesh, AROUND);
    result r = unite_with(mesh, cases[i].params);
    assert_int_equal(pipeline_count(r.report, "unbounding_triangles"), 6 * AROUND);
    assert_int_equal(pipeline_count(r.report, "flap_triangles"), cases[i].is_flap ? 6 * AROUND : 0);
    assert_int_equal(r.mesh->flap_triangle_count, cases[i].is_flap ? 6 * AROUND : 0);
    assert_int_equal(r.mesh->sheet_triangle_count, 6 * AROUND);
    if (r.mesh->sheet_thickness == 0) assert_nothing_is_lost(&r, 20, 1e-6);
    release(&r);
  }
}

/* A decal above a box is a flap; a strip that starts as near and then leaves the box stays whole. */
static void test_a_flap_is_a_whole_component_near_a_solid(void **state) {
  (void)state;
  static const double heights[] = {1.004, 1.004, 1.2};
  qmat_mesh *mesh = shape_box(1, 1, 1);
  uint32_t v[10];
  for (uint32_t i = 0; i < 4; i++) v[i] = shape_vertex(mesh, 0.1 + 0.2 * (i / 2), 0.1 + 0.2 * (i % 2), 1.004);
  for (uint32_t i = 0; i < 6; i++)
    v[4 + i] = shape_vertex(mesh, 0.5 + 0.2 * (i % 2), 0.2 + 0.2 * (i / 2), heights[i / 2]);
  shape_quad(mesh, v[0], v[1], v[3], v[2]);
  shape_quad(mesh, v[4], v[5], v[7], v[6]);
  shape_quad(mesh, v[6], v[7], v[9], v[8]);
  result r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "flap_triangles"), 2);
  assert_int_equal(r.mesh->sheet_triangle_count, 6);
  assert_int_equal(r.mesh->flap_triangle_count, 2);
  for (size_t i = 3 * (r.mesh->triangle_count - 2); i < 3 * r.mesh->triangle_count; i++)
    assert_true(r.mesh->positions[3 * (size_t)r.mesh->triangles[i]] < 0.4);
  result again = unite(r.mesh);
  assert_int_equal(again.mesh->flap_triangle_count, 2);
  qmat_value_release(&again.mesh->base);
  qmat_value_release(&again.report->base);
  release(&r);
}

/* A plate around the top: corners, middles of sides and centroids of the sleeve's triangles are all inside now, but a
 * band between the cap and the plate bounds nothing. */
static void test_what_bounds_nothing_is_found_between_plates(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  add_sleeve(mesh, 24);
  shape_add_box(mesh, -2, -2, 1.7, 2, 2, 2.1, false);
  result r = unite_with(mesh, "solid=close");
  assert_nothing_is_lost(&r, 50, 0.01);
  release(&r);
}

/* A sheet through plates around its corners, the middles of its sides and its centroids leaves them in between. */
static void test_a_sheet_through_solids_stays_where_it_leaves_them(void **state) {
  (void)state;
  static const double plates[][2] = {{-0.1, 0.1}, {0.3, 0.35}, {0.45, 0.55}, {0.65, 0.7}, {0.9, 1.1}};
  qmat_mesh *mesh = shape_new();
  for (size_t i = 0; i < sizeof plates / sizeof *plates; i++)
    shape_add_box(mesh, -1, -1, plates[i][0], 2, 2, plates[i][1], false);
  const uint32_t a = shape_vertex(mesh, 0, 0, 0), b = shape_vertex(mesh, 1, 0, 0), c = shape_vertex(mesh, 1, 0, 1),
                 d = shape_vertex(mesh, 0, 0, 1);
  shape_quad(mesh, a, b, c, d);
  result r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "inner_triangles"), 0);
  assert_int_equal(r.mesh->sheet_triangle_count, 2);
  release(&r);
}

/* A triangle without area in a part, where an edge of one neighbour is two edges of others. */
static void test_triangles_without_area_in_parts_that_meet(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 2, 2);
  /* The side x = 2 (5, 7, 1, 3) gets a vertex in the middle of its edge from 1 to 5: one neighbour only knows of it. */
  const uint32_t middle = shape_vertex(mesh, 2, 0, 1);
  size_t found = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    uint32_t *c = mesh->triangles + 3 * t;
    const double *p[3] = {mesh->positions + 3 * (size_t)c[0], mesh->positions + 3 * (size_t)c[1],
                          mesh->positions + 3 * (size_t)c[2]};
    if (p[0][0] < 2 || p[1][0] < 2 || p[2][0] < 2) continue;
    for (int k = 0; k < 3; k++) {
      const double *a = p[k], *b = p[(k + 1) % 3];
      if (a[1] > 0 || b[1] > 0 || found > 0) continue;
      const uint32_t from = c[k], to = c[(k + 1) % 3], top = c[(k + 2) % 3];
      c[0] = from, c[1] = middle, c[2] = top;
      shape_triangle(mesh, middle, to, top);
      shape_triangle(mesh, from, to, middle);
      found++;
    }
  }
  assert_int_equal(found, 1);
  shape_add_box(mesh, 1, -1, 0.5, 3, 1, 1.5, false);
  check_union(mesh, 8 + 4 - 1, 24 + 2 * 2 + 2 * 2 + 2 * 4 - 2 * 3, 2);
}

/* ---- properties ---- */

/* Boxes with integer corners touch in every way, and their union is counted in cells. */
static void test_random_boxes_against_counted_cells(void **state) {
  (void)state;
  enum { SIZE = 6 };
  for (uint64_t seed = 0; seed < 60; seed++) {
    random_numbers random = {seed, 0};
    bool filled[SIZE][SIZE][SIZE] = {0};
    qmat_mesh *mesh = shape_new();
    const int count = 2 + (int)random_index(&random, 7);
    for (int i = 0; i < count; i++) {
      int low[3], high[3];
      for (int k = 0; k < 3; k++) {
        low[k] = (int)random_index(&random, SIZE - 1);
        high[k] = low[k] + 1 + (int)random_index(&random, SIZE - 1);
        if (high[k] > SIZE) high[k] = SIZE;
      }
      shape_add_box(mesh, low[0], low[1], low[2], high[0], high[1], high[2], false);
      for (int x = low[0]; x < high[0]; x++)
        for (int y = low[1]; y < high[1]; y++)
          for (int z = low[2]; z < high[2]; z++) filled[x][y][z] = true;
    }
    if (seed % 2) weld(mesh);
    double cells = 0, faces = 0;
    for (int x = 0; x < SIZE; x++)
      for (int y = 0; y < SIZE; y++)
        for (int z = 0; z < SIZE; z++) {
          if (!filled[x][y][z]) continue;
          cells++;
          faces += x == 0 || !filled[x - 1][y][z];
          faces += x == SIZE - 1 || !filled[x + 1][y][z];
          faces += y == 0 || !filled[x][y - 1][z];
          faces += y == SIZE - 1 || !filled[x][y + 1][z];
          faces += z == 0 || !filled[x][y][z - 1];
          faces += z == SIZE - 1 || !filled[x][y][z + 1];
        }
    if (seed % 3 == 0) shape_rotate(mesh); /* by rounded numbers: near misses instead of touching */
    result r = unite(mesh);
    assert_null(json_object_get(r.report->root, "warnings"));
    assert_near(volume_of(r.mesh), cells, 1e-9);
    assert_near(area_of(r.mesh), faces, 1e-9);
    release(&r);
  }
}

/* Both spheres and what they have in common, a lens whose volume has a closed form. */
static void test_the_volume_of_two_spheres(void **state) {
  (void)state;
  const double pi = 3.14159265358979323846, radius = 1, apart = 1.2, cap = radius - apart / 2;
  const double lens = 2 * pi * cap * cap * (3 * radius - cap) / 3;
  const double exact = 2 * 4 * pi / 3 - lens;
  double before = INFINITY;
  for (uint32_t rings = 8; rings <= 64; rings *= 2) {
    qmat_mesh *mesh = sphere_at(0, 0, 0, radius, rings);
    add(mesh, sphere_at(apart * 0.48, apart * 0.6, apart * 0.64, radius, rings));
    result r = unite(mesh);
    assert_int_equal(euler_of(r.mesh), 2);
    const double error = fabs(volume_of(r.mesh) - exact) / exact;
    assert_true(error < 5.0 / (rings * rings) && error < 0.5 * before);
    before = error;
    release(&r);
  }
}

/* `count` spheres in a row, from the one of that number on. */
static qmat_mesh *row_of_spheres(uint32_t count, uint32_t first) {
  qmat_mesh *mesh = shape_new();
  for (uint32_t i = 0; i < count; i++) {
    const double k = (i + first) % count;
    add(mesh, sphere_at(0.9 * k, 0.3 * sin(k), 0.2 * cos(3 * k), 0.7 + 0.05 * sin(5 * k), 7));
  }
  return mesh;
}

static void test_the_order_of_parts_and_runs_make_no_difference(void **state) {
  (void)state;
  result one = unite(row_of_spheres(5, 0));
  assert_int_equal(euler_of(one.mesh), 2);
  for (uint32_t first = 0; first < 5; first++) {
    result other = unite(row_of_spheres(5, first));
    assert_near(volume_of(other.mesh), volume_of(one.mesh), 1e-12);
    assert_int_equal(other.mesh->vertex_count, one.mesh->vertex_count);
    assert_int_equal(other.mesh->triangle_count, one.mesh->triangle_count);
    if (first == 0) assert_memory_equal(&other.mesh->base.digest, &one.mesh->base.digest, sizeof(qmat_digest));
    release(&other);
  }
  release(&one);
}

/* Each pair is a union of its own; the others stay as they are. */
static void test_hundreds_of_parts(void **state) {
  (void)state;
  enum { PAIRS = 120 };
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < PAIRS; i++) {
    const double x = 4 * (i % 10), y = 4 * (i / 10);
    shape_add_box(mesh, x, y, 0, x + 1, y + 1, 1, false);
    if (i % 3 > 0) shape_add_box(mesh, x + 0.5, y + 0.25, 0.25, x + 2, y + 0.75, 0.75, false);
  }
  result r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "parts"), PAIRS * 5 / 3);
  assert_int_equal(pipeline_count(r.report, "parts_united"), PAIRS * 4 / 3);
  assert_near(volume_of(r.mesh), PAIRS + PAIRS * 2 / 3 * 0.25, 1e-9);
  assert_int_equal(euler_of(r.mesh), 2 * PAIRS);
  release(&r);
}

/* The node does not change its own result. */
static void test_a_union_passes(void **state) {
  (void)state;
  result r = unite(row_of_spheres(4, 0));
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "mesh.solid", "", (const qmat_value *[]){&r.mesh->base}, outputs);
  assert_ptr_equal(outputs[0], r.mesh);
  qmat_value_release(outputs[0]);
  qmat_value_release(outputs[1]);
  release(&r);
}

/* Coordinates whose squares overflow or vanish. */
static void test_units_of_any_size(void **state) {
  (void)state;
  static const double units[] = {0x1p-200, 0x1p-100, 0x1p100, 0x1p200};
  for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
    qmat_mesh *mesh = shape_box(2, 2, 2);
    shape_add_box(mesh, 1, 1, 1, 3, 3, 3, false);
    shape_map(mesh, units[i], 0, 0, 0);
    result r = unite(mesh);
    assert_int_equal(euler_of(r.mesh), 2);
    assert_near(volume_of(r.mesh) / units[i] / units[i] / units[i], 15, 1e-12);
    release(&r);
  }
}

/* ---- being stopped, and running out of memory ---- */

static bool stop_at(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                    const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total, (void)unit;
  size_t *left = user;
  return (*left)-- > 0;
}

static void test_a_union_can_be_stopped(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(row_of_spheres(6, 0));
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  size_t stopped = 0;
  for (size_t calls = 0; calls < 100; calls++) {
    size_t left = calls;
    qmat_context context = {.progress = stop_at, .progress_user = &left};
    const qmat_status status = pipeline_run(&context, "mesh.solid", "", (const qmat_value *[]){&mesh->base}, outputs);
    qmat_context_uninit(&context);
    if (status == QMAT_OK) {
      qmat_value_release(outputs[0]);
      qmat_value_release(outputs[1]);
      break;
    }
    assert_int_equal(status, QMAT_CANCELLED);
    assert_null(outputs[0]);
    assert_null(outputs[1]);
    stopped++;
  }
  assert_in_range(stopped, 4, 99);
  qmat_value_release(&mesh->base);
}

/* Spheres that meet, boxes with sides in the same planes, and a sphere that vanishes. */
static void test_a_shortage_of_memory_anywhere_is_an_error_or_makes_no_difference(void **state) {
  (void)state;
  enum { TRIES = 60 };
  qmat_mesh *mesh = row_of_spheres(2, 0);
  shape_add_box(mesh, 0, 0, 0, 1, 1, 1, false);
  shape_add_box(mesh, 0.5, 0, 0, 2, 1, 0.5, false);
  shape_add_box(mesh, 10, 0, 0, 13, 3, 3, false);
  add(mesh, sphere_at(11.5, 1.5, 1.5, 1, 4));
  shape_seal(mesh);
  const qmat_value *inputs[] = {&mesh->base};
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  qmat_context context = {0};
  shortage(SIZE_MAX, 0);
  assert_int_equal(pipeline_run(&context, "mesh.solid", "", inputs, outputs), QMAT_OK);
  const size_t needed = atomic_load(&asked);
  const qmat_digest digest = outputs[0]->digest;
  qmat_value_release(outputs[0]);
  qmat_value_release(outputs[1]);
  size_t failures = 0;
  for (size_t k = 0; k < TRIES; k++) {
    shortage(k / 2 * needed / (TRIES / 2), k % 2 ? 1 : SIZE_MAX); /* one allocation, or all from there on */
    const qmat_status status = pipeline_run(&context, "mesh.solid", "", inputs, outputs);
    shortage(SIZE_MAX, 0);
    if (status == QMAT_OK) {
      assert_memory_equal(&outputs[0]->digest, &digest, sizeof digest);
      qmat_value_release(outputs[0]);
      qmat_value_release(outputs[1]);
    } else {
      assert_int_equal(status, QMAT_ERROR_MEMORY);
      assert_null(outputs[0]);
      assert_null(outputs[1]);
      failures++;
    }
  }
  assert_true(needed > 1000 && failures >= TRIES / 2);
  qmat_context_uninit(&context);
  qmat_value_release(&mesh->base);
}

/* ---- what components are taken for ---- */

static const char *taken_for(const result *r, size_t component) {
  const json_t *list = json_object_get(r->report->root, "components");
  return json_string_value(json_object_get(json_array_get(list, component), "taken_for"));
}

/* Leaves out the triangles with a corner above a height. */
static void cut_above(qmat_mesh *mesh, double height) {
  size_t count = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    bool is_above = false;
    for (int k = 0; k < 3; k++)
      is_above = is_above || mesh->positions[3 * (size_t)mesh->triangles[3 * t + (size_t)k] + 2] > height;
    if (!is_above) memmove(mesh->triangles + 3 * count++, mesh->triangles + 3 * t, 3 * sizeof *mesh->triangles);
  }
  mesh->triangle_count = count;
}

/* A sphere without its top is a solid again, whose one cap is flat. */
static void test_a_cut_neck_is_one_cap_of_known_size(void **state) {
  (void)state;
  const double height = cos(3.14159265358979323846 / 4); /* a ring of vertices: 1 of 16 rings, seen from the top 4 */
  qmat_mesh *sphere = shape_sphere(1, 16);
  cut_above(sphere, height + 1e-9);
  result r = unite(sphere);
  assert_string_equal(taken_for(&r, 0), "solid with holes");
  assert_int_equal(pipeline_count(r.report, "caps"), 1);
  assert_int_equal(pipeline_count(r.report, "cap_sides"), 32);
  assert_int_equal(r.mesh->sheet_triangle_count, 0);
  assert_int_equal(euler_of(r.mesh), 2);
  assert_int_equal(r.mesh->vertex_count, r.from->triangle_count / 2 + 17); /* V - E + F = 2 with 30 more triangles */
  double top = -INFINITY;
  for (size_t i = 0; i < r.mesh->vertex_count; i++) top = fmax(top, r.mesh->positions[3 * i + 2]);
  assert_near(top, height, 1e-12);
  /* The polygon of 32 sides in a circle of radius sin(45 degrees), in squares of the diagonal. */
  const double radius = sin(3.14159265358979323846 / 4), side = 2 * radius * sin(3.14159265358979323846 / 32);
  const double diagonal = sqrt(4 + 4 + (1 + height) * (1 + height));
  assert_near(pipeline_number(r.report, "cap_length"), 32 * side / diagonal, 1e-9);
  assert_near(pipeline_number(r.report, "cap_area"),
              16 * radius * radius * sin(3.14159265358979323846 / 16) / diagonal / diagonal, 1e-9);
  release(&r);
}

/* One triangle leans outwards from the rim of a cut. Its cap folds back on it, so it is a sheet, and the solid is the
 * one below.
 */
static void test_a_tooth_on_a_rim_is_a_sheet(void **state) {
  (void)state;
  const double height = cos(3.14159265358979323846 / 4);
  qmat_mesh *sphere = shape_sphere(1, 16);
  size_t tooth = 0;
  for (size_t t = 0, on_rim = 0; on_rim != 2; tooth = t++) {
    double top = 0;
    on_rim = 0;
    for (size_t k = 0; k < 3; k++) {
      const double z = sphere->positions[3 * (size_t)sphere->triangles[3 * t + k] + 2];
      on_rim += fabs(z - height) < 1e-9;
      top = fmax(top, z);
    }
    if (top < height + 1e-9) on_rim = 0;
  }
  const uint32_t *c = sphere->triangles + 3 * tooth, corners[3] = {c[0], c[1], c[2]};
  for (size_t k = 0; k < 3; k++) { /* it leans outwards */
    double *p = sphere->positions + 3 * (size_t)corners[k];
    if (p[2] > height + 1e-9) p[0] *= 3, p[1] *= 3;
  }
  cut_above(sphere, height + 1e-9);
  memcpy(sphere->triangles + 3 * sphere->triangle_count++, corners, sizeof corners); /* in the place of one cut off */
  result r = unite(sphere);
  assert_string_equal(taken_for(&r, 0), "solid with holes");
  assert_int_equal(pipeline_count(r.report, "caps"), 1);
  assert_int_equal(pipeline_count(r.report, "cap_sides"), 33);
  assert_int_equal(pipeline_count(r.report, "triangles_folded"), 1);
  assert_int_equal(r.mesh->sheet_triangle_count, 1);
  double highest[2] = {-1, -1};
  for (size_t i = 0; i < 3 * r.mesh->triangle_count; i++) {
    double *top = highest + (i >= 3 * (r.mesh->triangle_count - 1));
    *top = fmax(*top, r.mesh->positions[3 * (size_t)r.mesh->triangles[i] + 2]);
  }
  assert_near(highest[0], height, 1e-12);
  assert_true(highest[1] > height + 0.1);
  assert_int_equal(r.mesh->triangle_count - 1, sphere->triangle_count - 1 + 30);
  release(&r);
}

/* Facets that are missed here and there come back exactly. */
static void test_ten_holes_are_ten_caps_and_the_same_solid(void **state) {
  (void)state;
  qmat_mesh *sphere = shape_sphere(2, 12);
  const double volume = volume_of(sphere), area = area_of(sphere);
  for (size_t hole = 0; hole < 10; hole++) {
    const size_t t = 40 + 47 * hole;
    memmove(sphere->triangles + 3 * t, sphere->triangles + 3 * (t + 1),
            3 * (sphere->triangle_count - t - 1) * sizeof *sphere->triangles);
    sphere->triangle_count--;
  }
  result r = unite(sphere);
  assert_string_equal(taken_for(&r, 0), "solid with holes");
  assert_int_equal(pipeline_count(r.report, "caps"), 10);
  assert_int_equal(pipeline_count(r.report, "cap_sides"), 30);
  assert_near(volume_of(r.mesh), volume, 1e-12 * volume);
  assert_near(area_of(r.mesh), area, 1e-12 * area);
  release(&r);
}

/* A file of a sphere's triangles in any order, every other one turned, without common vertices; some are missing. */
static void test_a_soup_of_triangles_that_face_anywhere_is_the_solid(void **state) {
  (void)state;
  qmat_mesh *sphere = shape_sphere(2, 12);
  const double volume = volume_of(sphere);
  char path[] = "soup_XXXXXX.stl";
  const int handle = mkstemps(path, 4);
  assert_true(handle >= 0);
  FILE *file = fdopen(handle, "w");
  assert_non_null(file);
  fprintf(file, "solid soup\n");
  for (size_t i = 0; i < sphere->triangle_count; i++) {
    const size_t t = i * 101 % sphere->triangle_count; /* 101 and the number of triangles, 528, have no common factor */
    if (t == 100 || t == 300) continue;
    fprintf(file, "facet normal 0 0 0\nouter loop\n");
    for (size_t k = 0; k < 3; k++) {
      const double *p = sphere->positions + 3 * (size_t)sphere->triangles[3 * t + (i % 2 ? 2 - k : k)];
      fprintf(file, "vertex %.17g %.17g %.17g\n", p[0], p[1], p[2]);
    }
    fprintf(file, "endloop\nendfacet\n");
  }
  fprintf(file, "endsolid soup\n");
  assert_int_equal(fclose(file), 0);
  qmat_value_release(&sphere->base);
  qmat_context context = {0};
  qmat_scene *scene;
  qmat_mesh *mesh;
  qmat_report *report;
  assert_int_equal(qmat_model_read(&context, path, &(qmat_read_options){0}, &scene, &mesh, &report), QMAT_OK);
  remove(path);
  result r = unite(mesh);
  assert_string_equal(taken_for(&r, 0), "solid with holes");
  assert_int_equal(pipeline_count(r.report, "caps"), 2);
  assert_int_equal(r.mesh->triangle_count, 528);
  assert_near(fabs(volume_of(r.mesh)), volume, 1e-6 * volume); /* coordinates of STL are in single precision */
  assert_true(volume_of(r.mesh) > 0);
  release(&r);
  qmat_value_release(&scene->base);
  qmat_value_release(&report->base);
  qmat_context_uninit(&context);
}

/* A sphere whose triangles each have vertices of their own, a millionth of the diagonal off. */
static void test_seams_that_rounding_opened_are_welded_and_their_width_is_part_of_the_deviation(void **state) {
  (void)state;
  qmat_mesh *sphere = shape_sphere(1, 10), *seams = shape_new();
  const double volume = volume_of(sphere), diagonal = sqrt(12), off = 1e-6 * diagonal;
  for (size_t t = 0; t < sphere->triangle_count; t++) {
    uint32_t corners[3];
    for (size_t k = 0; k < 3; k++) {
      const double *p = sphere->positions + 3 * (size_t)sphere->triangles[3 * t + k];
      corners[k] = shape_vertex(seams, p[0], p[1], p[2] + (t % 3 == 1 ? off : 0));
    }
    shape_triangle(seams, corners[0], corners[1], corners[2]);
  }
  const size_t count = sphere->vertex_count;
  qmat_value_release(&sphere->base);
  result r = unite(seams);
  assert_int_equal(r.mesh->vertex_count, count);
  assert_int_equal(r.mesh->triangle_count, 360);
  assert_string_equal(taken_for(&r, 0), "solid");
  assert_near(volume_of(r.mesh), volume, 1e-4);
  assert_near(r.mesh->deviation, off, 1e-9);
  release(&r);
}

/* A part of a cylinder's side, `turn` around. */
static qmat_mesh *curved_shell(double turn) {
  qmat_mesh *mesh = shape_new();
  for (uint32_t i = 0; i <= 16; i++)
    for (uint32_t k = 0; k <= 16; k++) shape_vertex(mesh, cos(turn * i / 16), sin(turn * i / 16), 2.0 * k / 16);
  for (uint32_t i = 0; i < 16; i++)
    for (uint32_t k = 0; k < 16; k++) shape_quad(mesh, 17 * i + k, 17 * i + k + 17, 17 * i + k + 18, 17 * i + k + 1);
  return mesh;
}

static void test_surfaces_without_volume_are_sheets_as_they_are(void **state) {
  (void)state;
  qmat_mesh *plane = shape_new();
  for (int i = 0; i < 4; i++) shape_vertex(plane, i & 1, i & 2, 0);
  shape_quad(plane, 0, 1, 3, 2);
  qmat_mesh *meshes[] = {plane, curved_shell(1.5), curved_shell(3)};
  for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
    result r = unite_with(meshes[i], "thickness=1%");
    assert_string_equal(taken_for(&r, 0), "sheet");
    assert_int_equal(r.mesh->triangle_count, meshes[i]->triangle_count);
    assert_int_equal(r.mesh->sheet_triangle_count, meshes[i]->triangle_count);
    assert_memory_equal(r.mesh->positions, meshes[i]->positions, 3 * r.mesh->vertex_count * sizeof(double));
    assert_memory_equal(r.mesh->triangles, meshes[i]->triangles, 3 * r.mesh->triangle_count * sizeof(uint32_t));
    const double diagonals[] = {sqrt(5), 0, 0};
    if (i == 0) assert_near(r.mesh->sheet_thickness, 0.01 * diagonals[0], 1e-12);
    assert_int_equal(pipeline_count(r.report, "caps"), 0);
    release(&r);
  }
}

/* Two triangles a side, on the same corners or with the other diagonal; beside it a cube, which stays. */
static void test_a_card_of_two_sides_is_a_sheet_of_one(void **state) {
  (void)state;
  for (int other_diagonal = 0; other_diagonal < 2; other_diagonal++) {
    qmat_mesh *mesh = shape_new();
    for (int i = 0; i < 4; i++) shape_vertex(mesh, i & 1, i & 2, 5);
    shape_quad(mesh, 0, 1, 3, 2);
    if (other_diagonal)
      shape_quad(mesh, 2, 3, 1, 0), shape_add_box(mesh, 0, 0, 0, 1, 1, 1, false);
    else
      shape_triangle(mesh, 0, 3, 1), shape_triangle(mesh, 0, 2, 3), shape_add_box(mesh, 0, 0, 0, 1, 1, 1, false);
    result r = unite(mesh);
    const bool is_paired = pipeline_count(r.report, "opposite_triangles_merged") == 2;
    assert_int_equal(r.mesh->sheet_triangle_count, is_paired ? 2 : 4);
    assert_true(is_paired || other_diagonal);
    assert_int_equal(r.mesh->triangle_count - r.mesh->sheet_triangle_count, 12);
    release(&r);
  }
}

/* Gives the triangles of quads a second time, turned and with the other diagonal. */
static void give_both_sides_of_quads(qmat_mesh *mesh) {
  const size_t count = mesh->triangle_count;
  for (size_t t = 0; t < count; t += 2) {
    uint32_t c[6];
    memcpy(c, mesh->triangles + 3 * t, sizeof c);
    shape_quad(mesh, c[5], c[2], c[1], c[0]);
  }
}

/* Gives every triangle a second time, turned. Where `alternates`, every other turned one comes first. */
static void give_both_sides(qmat_mesh *mesh, bool alternates) {
  const size_t count = mesh->triangle_count;
  for (size_t t = 0; t < count; t++) {
    uint32_t c[3];
    memcpy(c, mesh->triangles + 3 * t, sizeof c);
    shape_triangle(mesh, c[0], c[2], c[1]);
    if (!alternates || t % 2 == 0) continue;
    memcpy(mesh->triangles + 3 * t, mesh->triangles + 3 * (count + t), sizeof c);
    memcpy(mesh->triangles + 3 * (count + t), c, sizeof c);
  }
}

static void check_two_sided(qmat_mesh *mesh, double volume, size_t triangles, int64_t merged, int64_t solids) {
  result r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "opposite_triangles_merged"), merged);
  assert_int_equal(pipeline_count(r.report, "two_sided_solids"), solids);
  const qmat_mesh made = qmat_mesh_of_solids(r.mesh);
  assert_int_equal(made.triangle_count, triangles);
  assert_near(volume_of(&made), volume, 1e-12);
  release(&r);
}

static void test_closed_surfaces_of_two_sides_are_solids(void **state) {
  (void)state;
  for (int alternates = 0; alternates < 2; alternates++) {
    qmat_mesh *mesh = shape_box(1, 2, 3); /* two boxes, and a card of two sides */
    shape_add_box(mesh, 2, 0, 0, 3, 1, 1, false);
    for (int i = 0; i < 4; i++) shape_vertex(mesh, 5, i & 1, i & 2);
    shape_quad(mesh, 16, 17, 19, 18);
    give_both_sides(mesh, alternates);
    check_two_sided(mesh, 6 + 1, 24, 26, 2);
  }
  qmat_mesh *mesh = shape_box(3, 3, 3); /* a cavity */
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, true);
  give_both_sides(mesh, false);
  check_two_sided(mesh, 27 - 1, 24, 24, 2);
  mesh = shape_box(1, 2, 3); /* of quads, beside a box that is given once, and a card */
  for (int i = 0; i < 4; i++) shape_vertex(mesh, 5, i & 1, i & 2);
  shape_quad(mesh, 8, 9, 11, 10);
  give_both_sides_of_quads(mesh);
  shape_add_box(mesh, 2, 0, 0, 3, 1, 1, false);
  check_two_sided(mesh, 6 + 1, 24, 12, 1);
  mesh = shape_box(3, 3, 3); /* what fills the cavity makes its sides walls inside */
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, true);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, false);
  for (size_t t = 24; t < 36; t++) {
    const uint32_t *c = mesh->triangles + 3 * (t - 12);
    memcpy(mesh->triangles + 3 * t, (const uint32_t[]){c[0], c[2], c[1]}, 3 * sizeof *c);
  }
  check_two_sided(mesh, 27, 12, 12, 0);
  mesh = shape_new(); /* a box above a ground, and a box without a lid */
  for (int i = 0; i < 4; i++) shape_vertex(mesh, 20 * (i & 1) - 10, 10 * (i & 2) - 10, -1);
  shape_quad(mesh, 0, 1, 3, 2);
  qmat_mesh *boxes = shape_box(1, 1, 1);
  shape_add_box(boxes, 3, 0, 0, 4, 1, 1, false);
  boxes->triangle_count -= 2;
  give_both_sides(boxes, false);
  add(mesh, boxes);
  check_two_sided(mesh, 1, 12, 22, 1);
}

/* Triangles at one edge, those that fall in another order; the time is linear in them. */
static void test_pairs_among_many_triangles_at_one_edge(void **state) {
  (void)state;
  enum { COUNT = 300000 };
  qmat_context context = {0};
  uint32_t *triangles = qmat_alloc(6 * COUNT, sizeof *triangles);
  uint8_t *classes = qmat_calloc(2 * COUNT, 1);
  assert_true(triangles && classes);
  for (uint32_t i = 0; i < COUNT; i++) {
    memcpy(triangles + 3 * i, (const uint32_t[]){0, 1, 2 + i}, 3 * sizeof *triangles);
    memcpy(triangles + 3 * (COUNT + i), (const uint32_t[]){1, 0, 2 + i * 7 % COUNT}, 3 * sizeof *triangles);
  }
  memcpy(triangles + 3, triangles, 3 * sizeof *triangles); /* the first twice, the second not at all */
  const clock_t start = clock();
  assert_int_equal(qmat_find_opposite_pairs(&context, COUNT + 2, 2 * COUNT, triangles, classes), QMAT_OK);
  assert_true((double)(clock() - start) / CLOCKS_PER_SEC < 10);
  size_t counts[3] = {0};
  for (size_t t = 0; t < 2 * COUNT; t++) counts[classes[t]]++;
  assert_int_equal(counts[1], COUNT - 1);
  assert_int_equal(counts[2], COUNT - 1);
  assert_int_equal(classes[0], 1);
  assert_int_equal(classes[1], 0);
  for (size_t t = 0; t < COUNT; t++) assert_int_equal(classes[t], t == 1 ? 0 : 1);
  qmat_free(triangles);
  qmat_free(classes);
  qmat_context_uninit(&context);
}

static void test_given_sheets_are_no_merged_pairs(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  for (int i = 0; i < 4; i++) shape_vertex(mesh, i & 1, i & 2, 5);
  shape_quad(mesh, 8, 9, 11, 10);
  result r = unite(mesh);
  assert_int_equal(r.mesh->sheet_triangle_count, 2);
  static const char *const choices[] = {"solid=as_is", "solid=wrap", "solid=auto"};
  for (size_t i = 0; i < sizeof choices / sizeof *choices; i++) {
    result again = unite_with(r.mesh, choices[i]);
    assert_int_equal(pipeline_count(again.report, "opposite_triangles_merged"), 0);
    qmat_value_release(&again.mesh->base);
    qmat_value_release(&again.report->base);
  }
  release(&r);
}

/* ---- seams and openings ---- */

/* Adds half a box of 0.5 x 1 x 1, open where it meets the other half in a gap of `width` around x = 0. */
static void add_half_box(qmat_mesh *mesh, double width, bool is_mirrored) {
  const size_t first = mesh->vertex_count;
  shape_add_box(mesh, width / 2, 0, 0, 0.25, 1, 1, is_mirrored);
  memmove(mesh->triangles + 3 * (mesh->triangle_count - 4), mesh->triangles + 3 * (mesh->triangle_count - 2),
          6 * sizeof *mesh->triangles); /* the side before the last is the open one */
  mesh->triangle_count -= 2;
  for (size_t v = first; v < mesh->vertex_count && is_mirrored; v++) mesh->positions[3 * v] *= -1;
}

/* The diagonal is 1.5: seams are closed up to a fifth of epsilon, which is 0.003 at 1 %. */
static void test_halves_with_a_gap_between_them_are_one_solid(void **state) {
  (void)state;
  static const struct {
    const char *params;
    double width;
    bool is_joined;
  } cases[] = {{"", 0.0015, true},
               {"", 0.0029, true},
               {"", 0.0031, false},
               {"epsilon=0.55%", 0.0015, true},
               {"epsilon=0.45%", 0.0015, false},
               {"solid=sheet", 0.0015, false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_mesh *mesh = shape_new();
    add_half_box(mesh, cases[i].width, false);
    add_half_box(mesh, cases[i].width, true);
    result r = unite_with(mesh, cases[i].params);
    assert_int_equal(pipeline_count(r.report, "seam_triangles"), cases[i].is_joined ? 8 : 0);
    assert_int_equal(pipeline_count(r.report, "parts"), cases[i].is_joined ? 1 : 2);
    assert_int_equal(pipeline_count(r.report, "caps"), 0);
    assert_int_equal(r.mesh->sheet_triangle_count, cases[i].is_joined ? 0 : 20);
    if (cases[i].is_joined) {
      assert_string_equal(taken_for(&r, 0), "solid");
      assert_int_equal(euler_of(r.mesh), 2);
      assert_near(volume_of(r.mesh), 0.5, 1e-12);
      assert_near(area_of(r.mesh), 4, 1e-12);
      assert_near(pipeline_number(r.report, "cap_area"), 4 * cases[i].width / 2.25, 1e-9);
      const json_t *part = json_array_get(json_object_get(r.report->root, "components"), 0);
      assert_int_equal(json_integer_value(json_object_get(part, "triangles")), 20);
      assert_near(json_real_value(json_object_get(part, "area")), (4 - 4 * cases[i].width) / 2.25, 1e-9);
    }
    release(&r);
  }
}

/* What a seam leaves open is closed by a cap; where it would leave more open than it closes, there is no seam. */
static void test_a_seam_beside_other_holes(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  for (int half = 0; half < 2; half++) {
    add_half_box(mesh, 0.0015, half);
    mesh->triangle_count--; /* half of the side at the other end */
  }
  result r = unite(mesh);
  assert_string_equal(taken_for(&r, 0), "solid with holes");
  assert_int_equal(pipeline_count(r.report, "seam_triangles"), 8);
  assert_int_equal(pipeline_count(r.report, "caps"), 2);
  assert_near(volume_of(r.mesh), 0.5, 1e-12);
  assert_near(pipeline_number(r.report, "cap_area"), (4 * 0.0015 + 2 * 0.5) / 2.25, 1e-9);
  release(&r);
  mesh = shape_box(1, 1, 1); /* a square stands above the front of a cube without a lid */
  memmove(mesh->triangles + 6, mesh->triangles + 12, 30 * sizeof *mesh->triangles);
  mesh->triangle_count -= 2;
  for (int i = 0; i < 4; i++) shape_vertex(mesh, i & 1, 0, i & 2 ? 2 : 1.001);
  shape_quad(mesh, 8, 9, 11, 10);
  r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "seam_triangles"), 0);
  assert_int_equal(pipeline_count(r.report, "caps"), 1);
  assert_int_equal(r.mesh->sheet_triangle_count, 2);
  release(&r);
}

/* Two squares that face apart, also with a third near them; a sheet with a slit; a bowl without a rim. */
static void test_near_sheets_and_thin_shells_are_not_joined(void **state) {
  (void)state;
  for (int count = 2; count < 4; count++) {
    qmat_mesh *curtain = shape_new();
    for (int k = 0; k < count; k++) {
      for (int i = 0; i < 4; i++) shape_vertex(curtain, i & 1, (i & 2) / 2, 0.001 * k);
      const uint32_t v = 4 * (uint32_t)k;
      if (k % 2)
        shape_quad(curtain, v, v + 1, v + 3, v + 2);
      else
        shape_quad(curtain, v, v + 2, v + 3, v + 1);
    }
    result r = unite(curtain);
    assert_int_equal(pipeline_count(r.report, "seam_triangles"), 0);
    assert_int_equal(r.mesh->sheet_triangle_count, 2 * count);
    assert_int_equal(r.mesh->triangle_count, 2 * count);
    release(&r);
  }
  qmat_mesh *slit = shape_new();
  for (int i = 0; i < 8; i++) shape_vertex(slit, i / 2 - (i / 2 == 2 ? 0.999 : 0) - (i / 2 == 3), i & 1, 0);
  shape_quad(slit, 0, 2, 3, 1);
  shape_quad(slit, 4, 6, 7, 5);
  result r = unite(slit);
  assert_int_equal(pipeline_count(r.report, "seam_triangles"), 0);
  assert_int_equal(r.mesh->sheet_triangle_count, 4);
  release(&r);
  qmat_mesh *bowl = shape_tray(0.2, 0.001);
  bowl->triangle_count -= 8;
  r = unite(bowl);
  assert_int_equal(pipeline_count(r.report, "seam_triangles"), 0);
  assert_int_equal(r.mesh->sheet_triangle_count, 20);
  release(&r);
}

/* ---- T-junctions ---- */

/* A flat side from a corner along two edges, divided into a grid. Corners are moved by up to `noise`. */
static void add_grid(qmat_mesh *mesh, const double corner[3], const double u[3], const double v[3], int columns,
                     int rows, double noise, random_numbers *random) {
  const uint32_t first = (uint32_t)mesh->vertex_count, across = (uint32_t)columns + 1;
  for (int j = 0; j <= rows; j++)
    for (int i = 0; i <= columns; i++) {
      double p[3];
      for (int k = 0; k < 3; k++)
        p[k] = corner[k] + u[k] * i / columns + v[k] * j / rows + random_between(random, -noise, noise);
      shape_vertex(mesh, p[0], p[1], p[2]);
    }
  for (uint32_t j = 0; j < (uint32_t)rows; j++)
    for (uint32_t i = 0; i < (uint32_t)columns; i++) {
      const uint32_t a = first + j * across + i;
      shape_quad(mesh, a, a + 1, a + across + 1, a + across);
    }
}

/* A box of 3 x 2 x 1 whose sides have different grids, without its last sides. */
static qmat_mesh *box_of_grids(int sides, double noise, random_numbers *random) {
  static const double corners[6][3] = {{0, 0, 0}, {0, 0, 1}, {0, 0, 0}, {0, 2, 0}, {0, 0, 0}, {3, 0, 0}},
                      us[6][3] = {{0, 2, 0}, {3, 0, 0}, {3, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 2, 0}},
                      vs[6][3] = {{3, 0, 0}, {0, 2, 0}, {0, 0, 1}, {3, 0, 0}, {0, 2, 0}, {0, 0, 1}};
  static const int grids[6][2] = {{3, 5}, {7, 2}, {4, 1}, {3, 6}, {1, 1}, {5, 2}};
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < sides; i++) add_grid(mesh, corners[i], us[i], vs[i], grids[i][0], grids[i][1], noise, random);
  return mesh;
}

/* Puts triangles, their first corners and vertices into another order. */
static void shuffle(qmat_mesh *mesh, random_numbers *random) {
  for (size_t i = mesh->vertex_count; i-- > 1;) {
    const uint32_t from = (uint32_t)i, to = (uint32_t)random_index(random, i + 1);
    double p[3];
    memcpy(p, mesh->positions + 3 * i, sizeof p);
    memmove(mesh->positions + 3 * i, mesh->positions + 3 * (size_t)to, sizeof p);
    memcpy(mesh->positions + 3 * (size_t)to, p, sizeof p);
    for (size_t k = 0; k < 3 * mesh->triangle_count; k++) {
      uint32_t *c = &mesh->triangles[k];
      *c = *c == from ? to : *c == to ? from : *c;
    }
  }
  for (size_t i = mesh->triangle_count; i-- > 0;) {
    uint32_t row[3], *a = mesh->triangles + 3 * i, *b = mesh->triangles + 3 * random_index(random, i + 1);
    const size_t turn = random_index(random, 3);
    memcpy(row, a, sizeof row);
    memmove(a, b, sizeof row);
    for (size_t k = 0; k < 3; k++) b[k] = row[(k + turn) % 3];
  }
}

/* In any order and direction, also where rounding has moved vertices off the edges. */
static void test_a_box_with_t_junctions_is_one_solid(void **state) {
  (void)state;
  random_numbers random = {11, 0};
  for (int i = 0; i < 12; i++) {
    const double noise = i % 3 == 2 ? 2e-6 : 0;
    qmat_mesh *mesh = box_of_grids(6, noise, &random);
    if (i % 2) shape_rotate(mesh);
    if (i > 3) shuffle(mesh, &random);
    result r = unite(mesh);
    assert_int_equal(pipeline_count(r.report, "parts"), 1);
    assert_string_equal(taken_for(&r, 0), "solid");
    assert_int_equal(r.mesh->sheet_triangle_count, 0);
    assert_int_equal(pipeline_count(r.report, "caps"), 0);
    assert_int_equal(pipeline_count(r.report, "seam_triangles"), 0);
    assert_true(pipeline_count(r.report, "edges_split") > 30);
    assert_int_equal(euler_of(r.mesh), 2);
    assert_near(volume_of(r.mesh), 6, noise > 0 ? 1e-4 : 1e-9);
    assert_near(area_of(r.mesh), 22, noise > 0 ? 1e-4 : 1e-9);
    assert_true(r.mesh->deviation < 1e-4 && (noise == 0 || r.mesh->deviation > 1e-7));
    assert_null(json_object_get(r.report->root, "warnings"));
    release(&r);
  }
}

/* An open box is one part, whose hole is capped; with wider gaps, or where all is to be a sheet, nothing is split. */
static void test_what_t_junctions_leave_open(void **state) {
  (void)state;
  random_numbers random = {12, 0};
  result r = unite(box_of_grids(5, 0, &random));
  assert_string_equal(taken_for(&r, 0), "solid with holes");
  assert_int_equal(pipeline_count(r.report, "parts"), 1);
  assert_int_equal(pipeline_count(r.report, "caps"), 1);
  assert_near(volume_of(r.mesh), 6, 1e-9);
  release(&r);
  qmat_mesh *mesh = box_of_grids(6, 0, &random);
  const size_t given = mesh->triangle_count;
  r = unite_with(mesh, "solid=sheet");
  assert_int_equal(pipeline_count(r.report, "edges_split"), 0);
  assert_int_equal(r.mesh->sheet_triangle_count, given);
  release(&r);
  r = unite(box_of_grids(6, 1e-3, &random));
  assert_int_equal(pipeline_count(r.report, "edges_split"), 0);
  assert_int_equal(pipeline_count(r.report, "sheets"), 6);
  release(&r);
}

/* A plane in two parts; a triangle with vertices on all its sides; a post that stands on the border of a sheet. */
static void test_sheets_with_t_junctions_stay_as_they_are(void **state) {
  (void)state;
  random_numbers random = {13, 0};
  qmat_mesh *mesh = shape_new();
  add_grid(mesh, (const double[]){0, 0, 0}, (const double[]){1, 0, 0}, (const double[]){0, 1, 0}, 1, 1, 0, &random);
  add_grid(mesh, (const double[]){1, 0, 0}, (const double[]){1, 0, 0}, (const double[]){0, 1, 0}, 1, 2, 0, &random);
  add_grid(mesh, (const double[]){0.5, 0, 0}, (const double[]){0, 0.1, 0}, (const double[]){0, 0, 1}, 1, 1, 0, &random);
  result r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "edges_split"), 0);
  assert_int_equal(r.mesh->sheet_triangle_count, 8);
  assert_int_equal(r.mesh->triangle_count, 8);
  release(&r);
}

/* A cube without a lid, whose cap is a fifth of the five sides that are given. */
static void test_a_large_opening_that_is_closed_is_a_warning(void **state) {
  (void)state;
  static const struct {
    const char *params;
    double height, other; /* the side of a cube beside it: with 5 + 6 * 1.58^2 the cap is a twentieth */
    bool warns;
  } cases[] = {{"", 1, 1, true},  {"", 1, 1.5, true},           {"", 1, 1.6, false},
               {"", 3, 1, false}, {"solid=close", 1, 1, false}, {"solid=sheet", 1, 1, false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_mesh *mesh = shape_box(1, 1, cases[i].height);
    memmove(mesh->triangles + 6, mesh->triangles + 12, 30 * sizeof *mesh->triangles); /* the second side is the lid */
    mesh->triangle_count -= 2;
    shape_add_box(mesh, 5, 0, 0, 5 + cases[i].other, cases[i].other, cases[i].other, false);
    result r = unite_with(mesh, cases[i].params);
    const json_t *warnings = json_object_get(r.report->root, "warnings");
    assert_int_equal(json_array_size(warnings), cases[i].warns);
    if (cases[i].warns) {
      const char *text = json_string_value(json_array_get(warnings, 0));
      assert_non_null(strstr(text, "of 1 component are"));
      assert_non_null(strstr(text, " 20 % "));
      assert_non_null(strstr(text, "--set solid.solid=sheet "));
    }
    release(&r);
  }
}

/* A box around a hundred small ones: as a sky around a scene. */
static void test_a_part_that_hides_all_others_is_a_warning(void **state) {
  (void)state;
  for (int is_around = 0; is_around < 2; is_around++) {
    qmat_mesh *mesh = shape_box(100, 1, 1);
    if (is_around) shape_add_box(mesh, -1, -1, -1, 101, 9, 9, false);
    for (int i = 0; i < 100; i++) shape_add_box(mesh, i + 0.2, 3, 3, i + 0.8, 4, 4, false);
    result r = unite(mesh);
    const json_t *warnings = json_object_get(r.report->root, "warnings");
    assert_int_equal(json_array_size(warnings), is_around);
    if (is_around) {
      assert_int_equal(r.mesh->triangle_count, 12);
      assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), "1212 of 1224 triangles"));
    }
    release(&r);
  }
}

/* A room that is seen from inside, with two boxes on its floor and one above it. `sunk`: the two stick out of the
 * floor, and one of a wall. `inward`: as it is given; else all is turned, as reading turns a model of a negative
 * volume. A larger box is beside it. */
static qmat_mesh *room(bool inward, double sunk) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 5, 4, 2.7, inward);
  shape_add_box(mesh, sunk > 0 ? -sunk : 1, 1, -sunk, 2, 2, 0.8, !inward);
  shape_add_box(mesh, 3, 0.2, -sunk, 4.8, 1, 1, !inward);
  shape_add_box(mesh, 2.5, 2.5, 0.3, 3.5, 3.5, 1, !inward);
  shape_add_box(mesh, 10, 0, 0, 15, 5, 5, false);
  return mesh;
}

static void test_what_stands_on_the_floor_of_a_room(void **state) {
  (void)state;
  random_numbers random = {14, 0};
  for (int i = 0; i < 24; i++) {
    const bool inward = i % 2;
    const double sunk = i % 3 == 2 ? 0.01 : 0;
    qmat_mesh *mesh = room(inward, sunk);
    if (i > 5) shuffle(mesh, &random);
    may_move = i > 11;
    if (i > 11) shape_rotate(mesh);
    result r = unite(mesh);
    const json_t *warnings = json_object_get(r.report->root, "warnings");
    assert_int_equal(pipeline_count(r.report, "solids"), 5);
    assert_int_equal(pipeline_count(r.report, "parts_turned"), inward);
    assert_int_equal(json_array_size(warnings), inward);
    if (inward) {
      const char *text = sunk > 0 ? ", and 1 solid inside it is left out" : ", and 3 solids inside it are left out";
      assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), text));
      assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), "--set solid.solid=sheet "));
    }
    if (sunk == 0) {
      assert_int_equal(r.mesh->sheet_triangle_count > 0, !inward); /* the floor below the boxes */
      const double inside = inward ? 0 : 0.8 + 1.8 * 0.8 + 0.7;
      assert_near(volume_of(r.mesh) - volume_of_sheets(r.mesh), 125 + 54 - inside, 1e-4);
    }
    release(&r);
  }
  may_move = false;
}

/* Of a box around another one, and of a cavity as wide as its solid. */
static void test_few_solids_that_lie_in_others(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(4, 4, 4);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, false);
  result r = unite(mesh);
  const json_t *warnings = json_object_get(r.report->root, "warnings");
  assert_int_equal(json_array_size(warnings), 1);
  assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), "1 of 2 solids (12 of 24 triangles)"));
  release(&r);
  mesh = shape_box(4, 4, 4);
  shape_add_box(mesh, 1, 1, 0, 2, 2, 2, true);
  r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "parts_turned"), 0);
  assert_null(json_object_get(r.report->root, "warnings"));
  release(&r);
}

/* A cube with a fin on an edge, a wall across its middle, or one of its sides twice. */
static void test_fins_are_sheets_and_walls_inside_are_left_out(void **state) {
  (void)state;
  qmat_mesh *fin = shape_box(1, 1, 1);
  shape_triangle(fin, 0, 1, shape_vertex(fin, 0.5, -3, -3));
  result r = unite(fin);
  assert_int_equal(r.mesh->sheet_triangle_count, 1);
  assert_int_equal(r.mesh->triangle_count, 13);
  assert_near(volume_of(r.mesh), 1, 1); /* with the fin's share */
  assert_string_equal(taken_for(&r, 0), "solid");
  assert_string_equal(taken_for(&r, 1), "sheet");
  assert_int_equal(pipeline_count(r.report, "caps"), 0);
  release(&r);

  qmat_mesh *rooms = shape_new(); /* two rooms of one house, with one wall between them */
  uint32_t v[12];
  for (int i = 0; i < 12; i++) v[i] = shape_vertex(rooms, i / 4, i & 1, (i & 2) / 2);
  for (uint32_t room = 0; room < 2; room++) {
    const uint32_t *a = v + 4 * room;
    shape_quad(rooms, a[0], a[4], a[5], a[1]);
    shape_quad(rooms, a[2], a[3], a[7], a[6]);
    shape_quad(rooms, a[0], a[2], a[6], a[4]);
    shape_quad(rooms, a[1], a[5], a[7], a[3]);
  }
  shape_quad(rooms, v[0], v[1], v[3], v[2]);
  shape_quad(rooms, v[8], v[10], v[11], v[9]);
  shape_quad(rooms, v[4], v[5], v[7], v[6]);
  if (volume_of(rooms) < 0)
    for (size_t t = 0; t < rooms->triangle_count; t++) {
      const uint32_t corner = rooms->triangles[3 * t];
      rooms->triangles[3 * t] = rooms->triangles[3 * t + 1];
      rooms->triangles[3 * t + 1] = corner;
    }
  r = unite(rooms);
  assert_int_equal(r.mesh->sheet_triangle_count, 0);
  assert_int_equal(r.mesh->triangle_count, 20);
  assert_int_equal(pipeline_count(r.report, "inner_triangles"), 2);
  assert_near(volume_of(r.mesh), 2, 1e-12);
  release(&r);
}

static void test_what_faces_inwards_is_turned_unless_it_is_a_cavity(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(4, 4, 4);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, true);
  shape_add_box(mesh, 6, 0, 0, 7, 1, 1, true);
  result r = unite(mesh);
  assert_near(volume_of(r.mesh), 64 - 1 + 1, 1e-12);
  assert_int_equal(pipeline_count(r.report, "parts_turned"), 1);
  release(&r);
}

static void test_each_choice_does_what_it_says(void **state) {
  (void)state;
  result r = unite_with(curved_shell(3), "solid=as_is");
  assert_ptr_equal(r.mesh, r.from);
  release(&r);
  r = unite_with(curved_shell(3), "solid=close");
  assert_int_equal(r.mesh->sheet_triangle_count, 0);
  assert_int_equal(pipeline_count(r.report, "caps"), 1);
  assert_true(volume_of(r.mesh) > 2.5 && volume_of(r.mesh) < 3.2); /* half a cylinder, turned outwards if need be */
  release(&r);
  r = unite_with(shape_box(1, 1, 1), "solid=sheet");
  assert_int_equal(r.mesh->sheet_triangle_count, 12);
  release(&r);
  r = unite_with(shape_box(1, 1, 1), "solid=wrap epsilon=8%");
  const double offset = 0.02 * sqrt(3);
  assert_int_equal(r.mesh->sheet_triangle_count, 0);
  assert_near(r.mesh->deviation, offset, 1e-12);
  assert_true(volume_of(r.mesh) > 1 && volume_of(r.mesh) < pow(1 + 2 * 1.01 * offset, 3));
  for (size_t i = 0; i < r.mesh->vertex_count; i++) { /* outside of the cube, no farther than the wrap is kept away */
    double square = 0;
    for (size_t k = 0; k < 3; k++)
      square += pow(fmax(fmax(-r.mesh->positions[3 * i + k], r.mesh->positions[3 * i + k] - 1), 0), 2);
    assert_true(square > 0 && sqrt(square) < 1.05 * offset);
  }
  release(&r);
}

/* ---- the report ---- */

/* Two sides of a square cancel: they are no part, and yet a sheet. Of two cubes that touch, a wall is none. */
static void test_a_card_whose_sides_coincide_counts_as_a_sheet(void **state) {
  (void)state;
  qmat_mesh *card = shape_new();
  const double corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (uint32_t i = 0; i < 4; i++) shape_vertex(card, corners[i][0], corners[i][1], 0);
  shape_triangle(card, 0, 1, 2);
  shape_triangle(card, 0, 2, 3);
  shape_triangle(card, 2, 1, 0);
  shape_triangle(card, 3, 2, 0);
  result r = unite(card);
  assert_int_equal(pipeline_count(r.report, "parts"), 0);
  assert_int_equal(pipeline_count(r.report, "sheets"), 1);
  release(&r);
  qmat_mesh *cubes = shape_box(1, 1, 1);
  shape_add_box(cubes, 1, 0, 0, 2, 1, 1, false);
  weld(cubes);
  r = unite(cubes);
  assert_int_equal(pipeline_count(r.report, "sheets"), 0);
  release(&r);
}

/* A channel of a square section: its two ends are a seventh of what is given; a box without a lid has a fifth. */
static void test_a_warning_of_caps_names_the_place_and_a_way_out_where_caps_are_large(void **state) {
  (void)state;
  for (int large = 0; large < 2; large++) {
    qmat_mesh *mesh = large ? shape_box(1, 1, 0.8) : shape_box(1, 1, 3.6);
    for (size_t t = 0; t < mesh->triangle_count; t++) { /* without what faces up, and down */
      bool up = true, down = true;
      for (int k = 0; k < 3; k++) {
        const double z = mesh->positions[3 * (size_t)mesh->triangles[3 * t + (size_t)k] + 2];
        up = up && z > 0.5;
        down = down && z == 0;
      }
      if (up || (down && !large)) {
        mesh->triangle_count--;
        memmove(mesh->triangles + 3 * t, mesh->triangles + 3 * (t + 1),
                3 * (mesh->triangle_count - t) * sizeof *mesh->triangles);
        t--;
      }
    }
    result r = unite(mesh);
    const char *warning = json_string_value(json_array_get(json_object_get(r.report->root, "warnings"), 0));
    assert_non_null(warning);
    assert_non_null(strstr(warning, "(component 1, at ("));
    assert_int_equal(strstr(warning, "solid.solid=sheet") != NULL, large);
    release(&r);
  }
}

/* ---- flat faces that are folded ---- */

/* A prism over a polygon, turned about the x axis, in single precision. Its ends are the fans of their first corners.
 */
static qmat_mesh *fanned_prism(const double (*corners)[2], uint32_t count, double turn) {
  qmat_mesh *mesh = shape_new();
  for (uint32_t i = 0; i < 2 * count; i++) {
    const double x = corners[i % count][0], y = corners[i % count][1], z = i < count ? 0 : 0.6;
    shape_vertex(mesh, x, (float)(cos(turn) * y - sin(turn) * z), (float)(sin(turn) * y + cos(turn) * z));
  }
  for (uint32_t i = 0; i < count; i++) shape_quad(mesh, i, (i + 1) % count, count + (i + 1) % count, count + i);
  for (uint32_t i = 1; i + 1 < count; i++) {
    shape_triangle(mesh, 0, i + 1, i);
    shape_triangle(mesh, count, count + i, count + i + 1);
  }
  return mesh;
}

/* Counterclockwise; the first corner does not see the last but one. */
static const double letter_l[6][2] = {{3, 1}, {1, 1}, {1, 3}, {0, 3}, {0, 0}, {3, 0}};

/* Some triangles of the fans are turned over and lie outside of the L, others cover them. */
static void test_a_fanned_concave_face_is_triangulated_again(void **state) {
  (void)state;
  for (int turned = 0; turned < 2; turned++) {
    may_move = turned;
    result r = unite(fanned_prism(letter_l, 6, turned));
    assert_int_equal(pipeline_count(r.report, "faces_triangulated_again"), 2);
    assert_int_equal(r.mesh->vertex_count, 12);
    assert_int_equal(r.mesh->triangle_count, 20);
    assert_int_equal(r.mesh->sheet_triangle_count, 0);
    assert_near(volume_of(r.mesh), 5 * 0.6, 1e-6);
    assert_near(area_of(r.mesh), 2 * 5 + 12 * 0.6, 1e-6);
    assert_true(r.mesh->deviation <= 1e-5);
    assert_null(json_object_get(r.report->root, "warnings"));
    release(&r);
  }
  may_move = false;
}

/* The bottom is a sheet that is open on all sides. */
static void test_a_fanned_concave_sheet_is_triangulated_again(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  for (uint32_t i = 0; i < 6; i++) shape_vertex(mesh, letter_l[i][0], letter_l[i][1], 0);
  for (uint32_t i = 1; i < 5; i++) shape_triangle(mesh, 0, i, i + 1);
  result r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "faces_triangulated_again"), 1);
  assert_int_equal(r.mesh->sheet_triangle_count, 4);
  assert_near(area_of(r.mesh), 5, 1e-12);
  release(&r);
}

/* An ear that is cut off outside of the L is a given triangle; the cap of what is left folds onto it. */
static void test_a_cap_that_folds_onto_a_badly_cut_ear_is_triangulated_again(void **state) {
  (void)state;
  qmat_mesh *mesh = fanned_prism(letter_l, 6, 0);
  mesh->triangle_count -= 8;
  shape_triangle(mesh, 0, 2, 1);
  shape_triangle(mesh, 6, 7, 8);
  result r = unite_with(mesh, "solid=close");
  assert_int_equal(pipeline_count(r.report, "faces_triangulated_again"), 2);
  assert_int_equal(r.mesh->sheet_triangle_count, 0);
  assert_near(volume_of(r.mesh), 5 * 0.6, 1e-6);
  assert_near(area_of(r.mesh), 2 * 5 + 12 * 0.6, 1e-6);
  release(&r);
}

/* A pentagram is wound twice around its middle: no triangles between its corners have that border. */
static void test_a_face_that_no_triangles_can_fill_has_a_warning_with_its_place(void **state) {
  (void)state;
  double star[5][2];
  for (int i = 0; i < 5; i++) {
    star[i][0] = 10 + cos(4 * 3.14159265358979323846 * i / 5);
    star[i][1] = sin(4 * 3.14159265358979323846 * i / 5);
  }
  may_move = true;
  result r = unite(fanned_prism((const double(*)[2])star, 5, 0));
  may_move = false;
  assert_int_equal(pipeline_count(r.report, "faces_triangulated_again"), 0);
  const char *warning = json_string_value(json_array_get(json_object_get(r.report->root, "warnings"), 0));
  assert_non_null(warning);
  assert_non_null(strstr(warning, "2 flat faces with triangles that overlap, the first at ("));
  assert_non_null(strstr(warning, "solid=wrap"));
  release(&r);
}

/* Two sides of a leaf on a box cancel: the border of the side does not enclose the tip, which stays. */
static void test_a_leaf_of_two_sides_on_a_box_stays(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  shape_triangle(mesh, 0, 1, shape_vertex(mesh, 0.5, -1, 0));
  shape_triangle(mesh, 1, 0, 8);
  result r = unite(mesh);
  assert_int_equal(pipeline_count(r.report, "faces_triangulated_again"), 0);
  assert_int_equal(r.mesh->vertex_count, 9);
  assert_null(json_object_get(r.report->root, "warnings"));
  release(&r);
}

/* ---- without a union ---- */

qmat_status __real_qmat_unite_overlaps(qmat_context *context, size_t vertex_count, const double *positions,
                                       size_t triangle_count, const uint32_t *triangles, double longest_fold,
                                       qmat_united *united);
qmat_status __wrap_qmat_unite_overlaps(qmat_context *context, size_t vertex_count, const double *positions,
                                       size_t triangle_count, const uint32_t *triangles, double longest_fold,
                                       qmat_united *united);
qmat_status __wrap_qmat_unite_overlaps(qmat_context *context, size_t vertex_count, const double *positions,
                                       size_t triangle_count, const uint32_t *triangles, double longest_fold,
                                       qmat_united *united) {
  if (!is_refused)
    return __real_qmat_unite_overlaps(context, vertex_count, positions, triangle_count, triangles, longest_fold,
                                      united);
  *united = (qmat_united){.why_not = "the test says so"};
  return QMAT_OK;
}

/* Two boxes in each other and a square beside them: one wrap, a little larger than the union, and the square. */
static void test_solids_that_cannot_be_united_are_wrapped(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 1, 1), *other = shape_box(2, 1, 1);
  shape_map(other, 1, 1.25, 0.25, 0.25);
  add(mesh, other);
  const uint32_t a = shape_vertex(mesh, 6, 0, 0), b = shape_vertex(mesh, 7, 0, 0), c = shape_vertex(mesh, 7, 1, 0),
                 d = shape_vertex(mesh, 6, 1, 0);
  shape_quad(mesh, a, b, c, d);
  is_refused = true;
  result r = unite_with(mesh, "epsilon=0.02 solid=auto");
  is_refused = false;
  assert_int_equal(r.mesh->sheet_triangle_count, 2);
  assert_true(pipeline_count(r.report, "wrap_triangles") > 0);
  assert_int_equal(json_array_size(json_object_get(r.report->root, "warnings")), 1);
  assert_int_equal(r.mesh->triangle_count, pipeline_count(r.report, "wrap_triangles") + 2);
  const double volume = volume_of(r.mesh), offset = r.mesh->deviation, common = 0.75 * 0.75 * 0.75;
  assert_true(offset > 0 && volume > 4 - common && volume < 4 - common + 2 * offset * 18);
  release(&r);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_solids_that_cannot_be_united_are_wrapped),
      cmocka_unit_test(test_a_box_through_the_side_of_another),
      cmocka_unit_test(test_boxes_across_each_others_corner),
      cmocka_unit_test(test_boxes_that_share_a_face_become_one),
      cmocka_unit_test(test_boxes_that_share_a_part_of_a_face),
      cmocka_unit_test(test_blocks_that_share_vertices_have_no_walls_between_them),
      cmocka_unit_test(test_blocks_that_rounding_moved_apart_become_one),
      cmocka_unit_test(test_boxes_with_sides_in_the_same_planes),
      cmocka_unit_test(test_a_part_within_another_vanishes),
      cmocka_unit_test(test_cavities_and_what_is_in_them_stay),
      cmocka_unit_test(test_a_part_through_the_wall_of_a_cavity),
      cmocka_unit_test(test_a_cavity_within_another_solid_is_filled),
      cmocka_unit_test(test_of_equal_parts_one_is_left),
      cmocka_unit_test(test_parts_that_touch_in_points_and_lines_stay),
      cmocka_unit_test(test_one_part_and_parts_apart_pass),
      cmocka_unit_test(test_parts_are_kept_when_asked),
      cmocka_unit_test(test_sheets_stay_the_last_triangles_and_cut_nothing),
      cmocka_unit_test(test_open_parts_stay_and_do_not_keep_others_from_uniting),
      cmocka_unit_test(test_parts_that_meet_themselves),
      cmocka_unit_test(test_what_bounds_nothing_of_a_union_is_a_sheet),
      cmocka_unit_test(test_a_fold_longer_than_three_quarters_of_epsilon_is_united),
      cmocka_unit_test(test_what_bounds_nothing_within_three_quarters_of_epsilon_is_a_flap),
      cmocka_unit_test(test_a_flap_is_a_whole_component_near_a_solid),
      cmocka_unit_test(test_what_bounds_nothing_is_found_between_plates),
      cmocka_unit_test(test_a_sheet_through_solids_stays_where_it_leaves_them),
      cmocka_unit_test(test_triangles_without_area_in_parts_that_meet),
      cmocka_unit_test(test_random_boxes_against_counted_cells),
      cmocka_unit_test(test_the_volume_of_two_spheres),
      cmocka_unit_test(test_the_order_of_parts_and_runs_make_no_difference),
      cmocka_unit_test(test_hundreds_of_parts),
      cmocka_unit_test(test_a_union_passes),
      cmocka_unit_test(test_a_cut_neck_is_one_cap_of_known_size),
      cmocka_unit_test(test_a_tooth_on_a_rim_is_a_sheet),
      cmocka_unit_test(test_ten_holes_are_ten_caps_and_the_same_solid),
      cmocka_unit_test(test_a_soup_of_triangles_that_face_anywhere_is_the_solid),
      cmocka_unit_test(test_seams_that_rounding_opened_are_welded_and_their_width_is_part_of_the_deviation),
      cmocka_unit_test(test_surfaces_without_volume_are_sheets_as_they_are),
      cmocka_unit_test(test_a_card_of_two_sides_is_a_sheet_of_one),
      cmocka_unit_test(test_closed_surfaces_of_two_sides_are_solids),
      cmocka_unit_test(test_pairs_among_many_triangles_at_one_edge),
      cmocka_unit_test(test_given_sheets_are_no_merged_pairs),
      cmocka_unit_test(test_halves_with_a_gap_between_them_are_one_solid),
      cmocka_unit_test(test_a_seam_beside_other_holes),
      cmocka_unit_test(test_near_sheets_and_thin_shells_are_not_joined),
      cmocka_unit_test(test_a_large_opening_that_is_closed_is_a_warning),
      cmocka_unit_test(test_a_part_that_hides_all_others_is_a_warning),
      cmocka_unit_test(test_a_box_with_t_junctions_is_one_solid),
      cmocka_unit_test(test_what_t_junctions_leave_open),
      cmocka_unit_test(test_sheets_with_t_junctions_stay_as_they_are),
      cmocka_unit_test(test_what_stands_on_the_floor_of_a_room),
      cmocka_unit_test(test_few_solids_that_lie_in_others),
      cmocka_unit_test(test_fins_are_sheets_and_walls_inside_are_left_out),
      cmocka_unit_test(test_what_faces_inwards_is_turned_unless_it_is_a_cavity),
      cmocka_unit_test(test_each_choice_does_what_it_says),
      cmocka_unit_test(test_units_of_any_size),
      cmocka_unit_test(test_a_union_can_be_stopped),
      cmocka_unit_test(test_a_shortage_of_memory_anywhere_is_an_error_or_makes_no_difference),
      cmocka_unit_test(test_a_fanned_concave_face_is_triangulated_again),
      cmocka_unit_test(test_a_fanned_concave_sheet_is_triangulated_again),
      cmocka_unit_test(test_a_cap_that_folds_onto_a_badly_cut_ear_is_triangulated_again),
      cmocka_unit_test(test_a_face_that_no_triangles_can_fill_has_a_warning_with_its_place),
      cmocka_unit_test(test_a_leaf_of_two_sides_on_a_box_stays),
      cmocka_unit_test(test_a_card_whose_sides_coincide_counts_as_a_sheet),
      cmocka_unit_test(test_a_warning_of_caps_names_the_place_and_a_way_out_where_caps_are_large),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
