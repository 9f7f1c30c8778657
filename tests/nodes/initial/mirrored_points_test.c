/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "core/hash.h"
#include "nodes/initial/mirrored_points.h"
#include "tests/nodes/pipeline.h"

typedef struct setting {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_samples *samples;
  qmat_surface *surface;
  double *points;
  uint32_t *representatives;
  qmat_mirrored_points found;
} setting;

/* The mesh's vertices, and `added` further samples on each facet at random places. Facets get no rows of samples. */
static void prepare(setting *s, qmat_mesh *mesh, size_t added) {
  const size_t count = mesh->vertex_count + added * mesh->triangle_count;
  *s = (setting){.mesh = mesh, .samples = qmat_samples_new()};
  assert_non_null(s->samples);
  assert_int_equal(qmat_surface_new(&s->context, mesh, &s->surface), QMAT_OK);
  s->samples->vertex_count = mesh->vertex_count;
  s->samples->count = count;
  s->samples->facets = qmat_alloc(count, sizeof *s->samples->facets);
  s->samples->barycentrics = qmat_alloc(count, 3 * sizeof *s->samples->barycentrics);
  s->points = qmat_alloc(count, 3 * sizeof *s->points);
  s->representatives = qmat_alloc(count, sizeof *s->representatives);
  assert_true(s->samples->facets && s->samples->barycentrics && s->points && s->representatives);
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) s->samples->facets[mesh->triangles[i]] = (uint32_t)(i / 3);
  const double *positions = qmat_surface_positions(s->surface);
  memcpy(s->points, positions, 3 * mesh->vertex_count * sizeof *s->points);
  for (size_t i = 0; i < count; i++) {
    double *weights = &s->samples->barycentrics[3 * i];
    s->representatives[i] = (uint32_t)i;
    if (i < mesh->vertex_count) continue;
    const size_t facet = (i - mesh->vertex_count) / added;
    const double a = 0.1 + 0.8 * qmat_hash_unit(qmat_hash3(1, i, 0)), b = qmat_hash_unit(qmat_hash3(1, i, 1));
    s->samples->facets[i] = (uint32_t)facet;
    weights[0] = a;
    weights[1] = b * (1 - a);
    weights[2] = 1 - weights[0] - weights[1];
    for (size_t k = 0; k < 3; k++) {
      s->points[3 * i + k] = 0;
      for (size_t c = 0; c < 3; c++)
        s->points[3 * i + k] += weights[c] * positions[3 * (size_t)mesh->triangles[3 * facet + c] + k];
    }
  }
}

static void find(setting *s, double closest) {
  assert_int_equal(
      qmat_mirrored_points_find(&s->context, s->surface, s->samples, s->points, s->representatives, closest, &s->found),
      QMAT_OK);
}

static void finish(setting *s) {
  qmat_surface_free(s->surface);
  qmat_value_release(&s->samples->base);
  qmat_value_release(&s->mesh->base);
  qmat_free(s->points);
  qmat_free(s->representatives);
  qmat_context_uninit(&s->context);
}

static double distance_to_others(const double *points, size_t count, const double *point) {
  double least = INFINITY;
  for (size_t i = 0; i < count; i++) least = fmin(least, qmat_point_distance(&points[3 * i], point));
  return least;
}

/* The vertices of a plate lie opposite each other: nothing is added straight across. The mean of the three normals at a
 * vertex leads along the diagonal of a cube to the other large side. */
static void test_corners_of_a_plate_have_points_along_the_mean_of_their_normals(void **state) {
  (void)state;
  setting s;
  prepare(&s, shape_seal(shape_box(1, 1, 0.001)), 0);
  find(&s, 0);
  const double thickness = 0.001 / qmat_surface_frame(s.surface)->diagonal;
  assert_int_equal(s.found.count, 8);
  for (size_t i = 0; i < 8; i++)
    assert_near(distance_to_others(s.points, 8, &s.found.points[3 * i]), sqrt(2) * thickness, 1e-9);
  finish(&s);
}

/* Each sample inside the two large sides of a plate has a point straight across. Those of the narrow sides have none:
 * the plate is wide there. */
static void test_samples_on_a_plate_have_points_across_it(void **state) {
  (void)state;
  setting s;
  prepare(&s, shape_seal(shape_box(1, 1, 0.001)), 1);
  for (size_t i = 0; i < s.mesh->vertex_count; i++) s.representatives[i] = 8; /* no rays from the corners */
  find(&s, 0);
  const double thickness = 0.001 / qmat_surface_frame(s.surface)->diagonal;
  assert_int_equal(s.found.count, 4);
  for (size_t i = 0; i < s.found.count; i++) {
    const double *point = &s.found.points[3 * i];
    assert_near(distance_to_others(s.points, s.samples->count, point), thickness, 1e-9);
    assert_near(qmat_surface_distance_to_triangle(s.surface, point, s.found.facets[i]), 0, 1e-9);
  }
  /* Represented samples have none. */
  for (size_t i = s.mesh->vertex_count; i < s.samples->count; i++) s.representatives[i] = 0;
  find(&s, 0);
  assert_int_equal(s.found.count, 0);
  finish(&s);
}

static void test_thick_solids_have_none_unless_samples_are_far_apart(void **state) {
  (void)state;
  setting s;
  prepare(&s, shape_seal(shape_box(1, 1, 0.5)), 1);
  find(&s, 0);
  assert_int_equal(s.found.count, 0);
  find(&s, 5);
  assert_true(s.found.count > 0);
  finish(&s);
}

/* An edge of the outside lies across the edge of the inside, not across a wall. */
static void test_edges_of_a_tray_lie_across_each_other(void **state) {
  (void)state;
  setting s;
  const double thickness = 0.001;
  prepare(&s, shape_seal(shape_tray(0.6, thickness)), 1);
  /* The first added sample moves to the middle of an upright edge outside. */
  const size_t moved = s.mesh->vertex_count;
  for (size_t t = 0; t < s.mesh->triangle_count; t++) {
    const uint32_t *ids = &s.mesh->triangles[3 * t];
    for (size_t k = 0; k < 3; k++) {
      if (ids[k] != 0 || ids[(k + 1) % 3] != 4) continue;
      s.samples->facets[moved] = (uint32_t)t;
      double *weights = &s.samples->barycentrics[3 * moved];
      weights[k] = weights[(k + 1) % 3] = 0.5;
      weights[(k + 2) % 3] = 0;
      for (size_t c = 0; c < 3; c++) s.points[3 * moved + c] = 0.5 * (s.points[c] + s.points[3 * 4 + c]);
    }
  }
  find(&s, 0);
  const double diagonal = qmat_surface_frame(s.surface)->diagonal;
  double across[3];
  for (size_t k = 0; k < 3; k++) across[k] = s.points[3 * moved + k] + (k < 2 ? thickness / diagonal : 0);
  assert_true(distance_to_others(s.found.points, s.found.count, across) < 1e-6);
  finish(&s);
}

/* Samples inside the sides of a gap between two thick boxes have a point straight across it: also those of the larger
 * side, as far as the smaller one reaches. */
static void test_samples_on_a_gap_have_points_across_it(void **state) {
  (void)state;
  setting s;
  const double gap = 0.001;
  qmat_mesh *mesh = shape_box(1, 1, 0.5);
  shape_add_box(mesh, 0.2, 0.2, 0.5 + gap, 0.8, 0.8, 1, false);
  prepare(&s, shape_seal(mesh), 5);
  find(&s, 0);
  const double width = gap / qmat_surface_frame(s.surface)->diagonal;
  size_t on_the_larger = 0, on_the_smaller = 0;
  for (size_t i = 0; i < s.found.count; i++) {
    const double *point = &s.found.points[3 * i], nearest = distance_to_others(s.points, s.samples->count, point);
    assert_true(nearest > 0.25 * width && nearest < 1.8 * width);
    assert_near(qmat_surface_distance_to_triangle(s.surface, point, s.found.facets[i]), 0, 1e-9);
    /* Each box has twelve facets. */
    on_the_larger += s.found.facets[i] < 12;
    on_the_smaller += s.found.facets[i] >= 12;
  }
  assert_true(on_the_larger >= 10); /* from two facets of five samples each, and from corners */
  assert_true(on_the_smaller > 0);
  finish(&s);
}

/* A ray goes on through all plates of a stack: each sample of a large side has a point on each of the other five. */
static void test_samples_on_a_stack_of_plates_have_points_on_all(void **state) {
  (void)state;
  setting s;
  const double thickness = 0.002, gap = 0.001;
  qmat_mesh *mesh = shape_box(1, 1, thickness);
  for (int i = 1; i < 3; i++) {
    const double bottom = i * (thickness + gap);
    shape_add_box(mesh, 0, 0, bottom, 1, 1, bottom + thickness, false);
  }
  prepare(&s, shape_seal(mesh), 1);
  for (size_t i = 0; i < s.mesh->vertex_count; i++) s.representatives[i] = (uint32_t)s.mesh->vertex_count;
  find(&s, 0);
  assert_int_equal(s.found.count, 3 * 2 * 2 * 5); /* a large side has two facets of one sample each */
  size_t in_facet[36] = {0};
  for (size_t i = 0; i < s.found.count; i++) {
    assert_near(qmat_surface_distance_to_triangle(s.surface, &s.found.points[3 * i], s.found.facets[i]), 0, 1e-9);
    in_facet[s.found.facets[i]]++;
  }
  for (size_t i = 0; i < 36; i += 2) {
    const size_t in_side = in_facet[i] + in_facet[i + 1];
    assert_true(in_side == 10 || in_side == 0); /* on large sides and on narrow ones */
  }
  finish(&s);
}

static void test_threads_and_position_do_not_matter(void **state) {
  (void)state;
  setting s, turned;
  prepare(&s, shape_seal(shape_tray(0.6, 0.002)), 40);
  s.context.threads = 1;
  find(&s, 0.01);
  assert_true(s.found.count > 400);
  const qmat_mirrored_points first = s.found;
  for (int threads = 2; threads <= 8; threads *= 4) {
    s.context.threads = threads;
    find(&s, 0.01);
    assert_int_equal(s.found.count, first.count);
    assert_memory_equal(s.found.points, first.points, 3 * first.count * sizeof *first.points);
    assert_memory_equal(s.found.facets, first.facets, first.count * sizeof *first.facets);
  }
  /* Brute force: no two are nearer than a quarter of the thickness, nor one and a sample. */
  const double near = 0.25 * 0.002 / qmat_surface_frame(s.surface)->diagonal;
  for (size_t i = 0; i < first.count; i++) {
    assert_true(distance_to_others(s.points, s.samples->count, &first.points[3 * i]) > near);
    assert_true(distance_to_others(s.points, s.samples->count, &first.points[3 * i]) < 1.5 * 4 * near);
    assert_near(qmat_surface_distance_to_triangle(s.surface, &first.points[3 * i], first.facets[i]), 0, 1e-6);
  }
  qmat_mesh *mesh = shape_tray(0.6, 0.002);
  shape_rotate(mesh);
  shape_map(mesh, 30, 5, -7, 11);
  prepare(&turned, shape_seal(mesh), 40);
  find(&turned, 0.01);
  assert_int_equal(turned.found.count, first.count);
  finish(&turned);
  finish(&s);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_corners_of_a_plate_have_points_along_the_mean_of_their_normals),
      cmocka_unit_test(test_samples_on_a_plate_have_points_across_it),
      cmocka_unit_test(test_thick_solids_have_none_unless_samples_are_far_apart),
      cmocka_unit_test(test_edges_of_a_tray_lie_across_each_other),
      cmocka_unit_test(test_samples_on_a_gap_have_points_across_it),
      cmocka_unit_test(test_samples_on_a_stack_of_plates_have_points_on_all),
      cmocka_unit_test(test_threads_and_position_do_not_matter),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
