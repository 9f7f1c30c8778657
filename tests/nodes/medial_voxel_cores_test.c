/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "nodes/initial/delaunay_cgal.h"
#include "tests/nodes/pipeline.h"

typedef struct core {
  qmat_mesh *mesh;
  qmat_medial *medial;
  qmat_report *report;
} core;

/* Takes the mesh over. */
static core make_core(qmat_mesh *mesh, int threads, const char *params) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  if (!mesh->base.sealed) shape_seal(mesh);
  pipeline_must_run(threads, "medial.voxel_cores", params, (const qmat_value *[]){&mesh->base}, outputs);
  return (core){mesh, (qmat_medial *)outputs[0], (qmat_report *)outputs[1]};
}

static void free_core(core *c) {
  qmat_value_release(&c->mesh->base);
  qmat_value_release(&c->medial->base);
  qmat_value_release(&c->report->base);
}

/* --- by hand ----------------------------------------------------------------------------------------------------- */

/* At depth 2 the longest side has 3.6 voxels, here of side 1: their centres are the spheres, and the squares between
 * them are dual to the edges. */
static void test_bar_of_four_voxels_has_a_sphere_in_each(void **state) {
  (void)state;
  qmat_mesh *bar = shape_box(3.6, 0.9, 0.9);
  shape_map(bar, 1, -1.8, -0.45, -0.45);
  core c = make_core(bar, 0, "depth=2 lambda=18%");
  assert_int_equal(pipeline_count(c.report, "voxels"), 4);
  assert_int_equal(pipeline_count(c.report, "boundary_vertices"), 20);
  assert_int_equal(c.medial->sphere_count, 4);
  assert_int_equal(c.medial->edge_count, 3);
  assert_int_equal(c.medial->triangle_count, 0);
  double sum = 0;
  for (size_t i = 0; i < 4; i++) {
    const double *s = &c.medial->spheres[4 * i];
    assert_near(hypot(s[1], s[2]), 0, 1e-12);
    assert_near(fabs(fabs(s[0]) - 1), 0.5, 1e-12);
    assert_near(s[3], sqrt(0.75), 1e-12);
    sum += s[0];
  }
  assert_near(sum, 0, 1e-12);
  free_core(&c);
}

/* The lambda of an edge between two voxels is half the diagonal of their square: 0.185 of the diagonal of the bar. */
static void test_lambda_of_an_edge_is_that_of_its_square(void **state) {
  (void)state;
  core c = make_core(shape_box(3.6, 0.9, 0.9), 0, "depth=2 lambda=19%");
  assert_int_equal(pipeline_count(c.report, "core_spheres"), 4);
  assert_int_equal(c.medial->sphere_count, 1);
  assert_int_equal(c.medial->edge_count, 0);
  free_core(&c);
}

/* Four by four voxels: nine square Voronoi faces, whose lambda is half a voxel: 0.0968 of the diagonal. */
static void test_plate_of_voxels_has_the_faces_between_its_centres(void **state) {
  (void)state;
  core c = make_core(shape_box(3.6, 3.6, 0.9), 0, "depth=2 lambda=9.6%");
  assert_int_equal(c.medial->sphere_count, 16);
  assert_int_equal(c.medial->edge_count, 24 + 9); /* a square is two triangles */
  assert_int_equal(c.medial->triangle_count, 18);
  free_core(&c);
  c = make_core(shape_box(3.6, 3.6, 0.9), 0, "depth=2 lambda=9.8%");
  assert_int_equal(c.medial->triangle_count, 0);
  assert_int_equal(c.medial->sphere_count, 16); /* edges have a larger lambda */
  assert_int_equal(c.medial->edge_count, 15);
  free_core(&c);
}

/* --- models whose medial axis is known --------------------------------------------------------------------------- */

static void test_sphere_gives_spheres_near_its_centre(void **state) {
  (void)state;
  core c = make_core(shape_sphere(1, 24), 0, "depth=5 lambda=20%");
  assert_int_equal(pipeline_euler(c.medial), 1);
  assert_int_equal(pipeline_components(c.medial), 1);
  assert_true(c.medial->sphere_count < 100 && pipeline_count(c.report, "core_spheres") > 1000);
  const double voxel = 2 / (0.9 * 32);
  for (size_t i = 0; i < c.medial->sphere_count; i++) {
    const double *s = &c.medial->spheres[4 * i];
    assert_true(sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) < 2 * voxel);
    assert_near(s[3], 1, 3 * voxel);
  }
  free_core(&c);
}

static void test_torus_stays_a_ring_however_much_is_pruned(void **state) {
  (void)state;
  static const char *const params[] = {"depth=6 lambda=0", "depth=6 lambda=5%", "depth=6 lambda=100%"};
  size_t before = SIZE_MAX;
  for (int i = 0; i < 3; i++) {
    core c = make_core(shape_torus(2, 0.6, 48, 24), 0, params[i]);
    assert_int_equal(pipeline_euler(c.medial), 0);
    assert_int_equal(pipeline_components(c.medial), 1);
    assert_true(c.medial->sphere_count < before);
    before = c.medial->sphere_count;
    const double voxel = 5.2 / (0.9 * 64);
    for (size_t k = 0; k < c.medial->sphere_count; k++) {
      const double *s = &c.medial->spheres[4 * k];
      assert_true(hypot(hypot(s[0], s[1]) - 2, s[2]) + s[3] < 0.6 + 2 * voxel);
    }
    free_core(&c);
  }
}

/* A shell has a void, and so has its core: a closed surface. */
static void test_hollow_box_has_a_closed_core(void **state) {
  (void)state;
  qmat_mesh *shell = shape_new();
  shape_add_box(shell, 0, 0, 0, 3, 3, 3, false);
  shape_add_box(shell, 1, 1, 1, 2, 2, 2, true);
  core c = make_core(shell, 0, "depth=5");
  assert_int_equal(pipeline_components(c.medial), 1);
  assert_int_equal(pipeline_euler(c.medial), 2);
  free_core(&c);
}

static void test_envelope_of_a_box_is_within_some_voxels_of_it(void **state) {
  (void)state;
  core c = make_core(shape_box(3, 2, 1), 0, "depth=6 lambda=0");
  const double voxel = pipeline_number(c.report, "voxel");
  assert_near(voxel, 3 / (0.9 * 64) / sqrt(14), 1e-12);
  double errors[2];
  pipeline_errors(c.mesh, c.medial, 2, (const char *const[]){"surface_to_envelope", "envelope_out_of_solid"}, errors);
  if (!(errors[0] < voxel && errors[1] < 2 * voxel))
    fail_msg("%g and %g with voxels of %g", errors[0], errors[1], voxel);
  free_core(&c);
}

/* Section 4.1: VC does not keep flat features that are thin for lambda or the voxels. */
static void test_thin_sheet_is_lost_with_a_large_lambda_and_found_with_a_small_one(void **state) {
  (void)state;
  core lost = make_core(pipeline_model("sheet", 12), 0, "depth=7 lambda=3%");
  core found = make_core(pipeline_model("sheet", 12), 0, "depth=7 lambda=0.2%");
  assert_int_equal(pipeline_euler(lost.medial), pipeline_euler(found.medial));
  const double without = pipeline_error(lost.mesh, lost.medial, "surface_to_envelope_at_least");
  const double with = pipeline_error(found.mesh, found.medial, "surface_to_envelope");
  if (!(without > 0.1 && with < 0.02)) fail_msg("%g and %g", without, with);
  free_core(&lost);
  free_core(&found);
}

/* --- rules ------------------------------------------------------------------------------------------------------- */

static void test_result_is_an_initial_medial_mesh_for_simplification(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("tapered-capsule", 24), "spacing=4%");
  qmat_value *cores[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.voxel_cores", "depth=6", (const qmat_value *[]){&p.mesh->base}, cores);
  qmat_medial *simple = pipeline_simplify(&p, (const qmat_medial *)cores[0], "epsilon=4%");
  assert_in_range(simple->sphere_count, 2, 6);
  qmat_value_release(&simple->base);
  pipeline_release("medial.voxel_cores", cores);
  pipeline_free(&p);
}

static void test_threads_do_not_change_a_byte(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(pipeline_model("octopus", 8));
  pipeline_must_ignore_threads("medial.voxel_cores", "depth=6 lambda=1%", (const qmat_value *[]){&mesh->base});
  qmat_value_release(&mesh->base);
}

/* Integers and real numbers give one triangulation. */
static void test_lattice_points_are_triangulated_as_other_points_are(void **state) {
  (void)state;
  enum { SIDE = 5, COUNT = SIDE * SIDE * SIDE };
  int32_t lattice[3 * COUNT];
  double points[3 * COUNT];
  for (int i = 0; i < COUNT; i++) {
    lattice[3 * i] = 128 * (i % SIDE);
    lattice[3 * i + 1] = 128 * (i / SIDE % SIDE);
    lattice[3 * i + 2] = 128 * (i / SIDE / SIDE) - (i % 3 == 0 && i > 30 ? 1 : 0);
    for (int k = 0; k < 3; k++) points[3 * i + k] = lattice[3 * i + k];
  }
  qmat_context context = {0};
  qmat_tetrahedra a, b;
  assert_int_equal(qmat_delaunay_tetrahedra(&context, points, COUNT, &a), QMAT_OK);
  assert_int_equal(qmat_delaunay_lattice(&context, lattice, COUNT, &b), QMAT_OK);
  assert_int_equal(a.count, b.count);
  assert_memory_equal(a.corners, b.corners, 4 * a.count * sizeof *a.corners);
  assert_memory_equal(a.neighbours, b.neighbours, 4 * a.count * sizeof *a.neighbours);
  qmat_context_uninit(&context);
}

/* --- errors ------------------------------------------------------------------------------------------------------ */

/* Takes the mesh over. */
static void expect_error(qmat_mesh *mesh, const char *params, const char *field) {
  shape_seal(mesh);
  assert_true(pipeline_must_fail("medial.voxel_cores", params, (const qmat_value *[]){&mesh->base}, field));
  qmat_value_release(&mesh->base);
}

/* The one layer of voxels has its centres in the middle of the height, above the plate and beside the pin. */
static void test_solid_between_the_voxel_centres_names_the_depth(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 3.6, 3.6, 0.2, false);
  shape_add_box(mesh, 4, 0, 0, 4.1, 0.1, 0.9, false);
  expect_error(mesh, "depth=2", "depth");
}

static void test_mesh_without_an_inside_is_named(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 1, 0.1, 0.1, true); /* inside out */
  expect_error(mesh, "depth=9", "mesh");
}

static void test_progress_function_cancels(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_box(1, 1, 1));
  pipeline_must_be_cancelled("medial.voxel_cores", "depth=4", (const qmat_value *[]){&mesh->base});
  qmat_value_release(&mesh->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_bar_of_four_voxels_has_a_sphere_in_each),
      cmocka_unit_test(test_lambda_of_an_edge_is_that_of_its_square),
      cmocka_unit_test(test_plate_of_voxels_has_the_faces_between_its_centres),
      cmocka_unit_test(test_sphere_gives_spheres_near_its_centre),
      cmocka_unit_test(test_torus_stays_a_ring_however_much_is_pruned),
      cmocka_unit_test(test_hollow_box_has_a_closed_core),
      cmocka_unit_test(test_envelope_of_a_box_is_within_some_voxels_of_it),
      cmocka_unit_test(test_thin_sheet_is_lost_with_a_large_lambda_and_found_with_a_small_one),
      cmocka_unit_test(test_result_is_an_initial_medial_mesh_for_simplification),
      cmocka_unit_test(test_threads_do_not_change_a_byte),
      cmocka_unit_test(test_lattice_points_are_triangulated_as_other_points_are),
      cmocka_unit_test(test_solid_between_the_voxel_centres_names_the_depth),
      cmocka_unit_test(test_mesh_without_an_inside_is_named),
      cmocka_unit_test(test_progress_function_cancels),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
