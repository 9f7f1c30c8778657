/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sheets through all nodes: planes, banners, curved shells, alone and beside solids. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/sheets.h"
#include "tests/nodes/pipeline.h"

static const double pi = 3.14159265358979323846;

static void plane(double u, double v, double p[3]) {
  p[0] = 2 * u, p[1] = v, p[2] = 0;
}

static void banner(double u, double v, double p[3]) {
  p[0] = 2 * u, p[1] = v, p[2] = 0.15 * sin(6 * u);
}

static void half_cylinder(double u, double v, double p[3]) {
  p[0] = -cos(pi * u), p[1] = v, p[2] = sin(pi * u);
}

static void beside_sphere(double u, double v, double p[3]) {
  p[0] = 1.5 + u, p[1] = v - 0.5, p[2] = 0.2 * sin(5 * v);
}

static void through_sphere(double u, double v, double p[3]) {
  p[0] = 4 * u - 2, p[1] = 4 * v - 2, p[2] = 0.1;
}

static void fin_of_sphere(double u, double v, double p[3]) {
  p[0] = 0.99 + 0.07 * u, p[1] = 0.1 * v, p[2] = 0;
}

static qmat_mesh *sheet_of(uint32_t across, uint32_t up, void (*place)(double u, double v, double p[3])) {
  qmat_mesh *mesh = shape_new();
  shape_add_sheet(mesh, across, up, place);
  return mesh;
}

typedef struct {
  qmat_medial *medial;
  qmat_report *report; /* of medial.evaluate */
} description;

/* Describes a mesh, which it takes over, as the shipped graph does at 2 %. */
static description describe(qmat_mesh *mesh, int threads) {
  pipeline p;
  qmat_value *refined[PIPELINE_MOST_PORTS], *simple[PIPELINE_MOST_PORTS], *errors[PIPELINE_MOST_PORTS];
  pipeline_make(&p, mesh, "", "");
  pipeline_must_run(threads, "medial.refine", "epsilon=0.02",
                    (const qmat_value *[]){&p.mesh->base, &p.thickness->base, &p.samples->base, &p.medial->base},
                    refined);
  pipeline_must_run(threads, "medial.simplify", "epsilon=0.02",
                    (const qmat_value *[]){&p.mesh->base, &p.thickness->base, refined[0], refined[1]}, simple);
  pipeline_must_run(threads, "medial.evaluate", "epsilon=0.02", (const qmat_value *[]){&p.mesh->base, simple[0]},
                    errors);
  for (int i = 0; i < 3; i++) qmat_value_release(refined[i]);
  qmat_value_release(simple[1]);
  pipeline_free(&p);
  return (description){(qmat_medial *)simple[0], (qmat_report *)errors[0]};
}

static void release(description *d) {
  qmat_value_release(&d->medial->base);
  qmat_value_release(&d->report->base);
}

static void expect_certified(const description *d) {
  assert_true(json_is_true(json_object_get(d->report->root, "certified")));
  assert_true(pipeline_number(d->report, "surface_to_envelope") <= 0.02);
  assert_true(pipeline_number(d->report, "envelope_to_surface") <= 0.02);
}

/* Components, loops and voids of the medial mesh, which are those of the solids and sheets. */
static void expect_topology(const description *d, int64_t components, int64_t loops, int64_t voids) {
  assert_int_equal(pipeline_count(d->report, "components"), components);
  assert_int_equal(pipeline_count(d->report, "loops"), loops);
  assert_int_equal(pipeline_count(d->report, "voids"), voids);
  assert_int_equal(pipeline_count(d->report, "components_of_solid"), components);
  assert_int_equal(pipeline_count(d->report, "loops_of_solid"), loops);
  assert_int_equal(pipeline_count(d->report, "voids_of_solid"), voids);
}

static void expect_radii(const qmat_medial *medial, size_t count, double radius) {
  assert_int_equal(medial->sheet_sphere_count, count);
  for (size_t i = 0; i < count; i++) assert_near(medial->spheres[4 * i + 3], radius, 1e-15 * radius);
}

static void test_a_plane_is_two_slabs_between_its_corners(void **state) {
  (void)state;
  static const uint32_t sizes[][2] = {{1, 1}, {10, 10}, {31, 7}};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
    description d = describe(sheet_of(sizes[i][0], sizes[i][1], plane), 0);
    const qmat_medial *m = d.medial;
    assert_int_equal(m->sphere_count, 4);
    assert_int_equal(m->edge_count, 5);
    assert_int_equal(m->triangle_count, 2);
    expect_radii(m, 4, 0);
    unsigned corners = 0;
    for (size_t v = 0; v < 4; v++) {
      const double *p = &m->spheres[4 * v];
      assert_near(p[2], 0, 1e-12);
      assert_near(p[0] * (p[0] - 2), 0, 1e-12);
      assert_near(p[1] * (p[1] - 1), 0, 1e-12);
      corners |= 1u << ((p[0] > 1) + 2 * (p[1] > 0.5));
    }
    assert_int_equal(corners, 15);
    expect_certified(&d);
    expect_topology(&d, 1, 0, 0);
    assert_near(pipeline_number(d.report, "surface_to_envelope_sampled"), 0, 1e-12);
    assert_near(pipeline_number(d.report, "envelope_to_surface_sampled"), 0, 1e-12);
    assert_near(pipeline_number(d.report, "surface_to_envelope_at_least"), 0, 1e-12);
    assert_near(pipeline_number(d.report, "envelope_to_surface_at_least"), 0, 1e-12);
    release(&d);
  }
}

static void test_a_bent_banner_takes_few_spheres_of_radius_zero(void **state) {
  (void)state;
  description d = describe(sheet_of(40, 20, banner), 0);
  expect_certified(&d);
  expect_topology(&d, 1, 0, 0);
  assert_in_range(d.medial->sphere_count, 6, 12);
  expect_radii(d.medial, d.medial->sphere_count, 0);
  assert_int_equal(pipeline_count(d.report, "spheres_outside"), 0);
  release(&d);
}

/* The rectangle between the straight borders of a half cylinder. */
static void test_the_errors_of_a_half_cylinder_are_those_of_its_axis(void **state) {
  (void)state;
  enum { ACROSS = 24 };
  qmat_mesh *mesh = shape_seal(sheet_of(ACROSS, 6, half_cylinder));
  const double diagonal = sqrt(4 + 1 + 1);
  qmat_medial *medial = qmat_medial_new();
  qmat_context context = {0};
  const double spheres[16] = {-1, 0, 0, 0, 1, 0, 0, 0, -1, 1, 0, 0, 1, 1, 0, 0};
  medial->spheres = qmat_alloc(4, 4 * sizeof(double));
  assert_true(medial->spheres != NULL);
  memcpy(medial->spheres, spheres, sizeof spheres);
  medial->sphere_count = medial->sheet_sphere_count = 4;
  assert_int_equal(qmat_medial_set_simplices(&context, medial, NULL, 0, (uint32_t[]){0, 1, 3, 0, 2, 3}, 2), QMAT_OK);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.evaluate", "epsilon=0.02", (const qmat_value *[]){&mesh->base, &medial->base}, outputs);
  const qmat_report *report = (const qmat_report *)outputs[0];
  const double top = 1 / diagonal, facet = cos(pi / (2 * ACROSS)) / diagonal;
  assert_true(pipeline_number(report, "surface_to_envelope") >= top - 1e-12);
  assert_true(pipeline_number(report, "surface_to_envelope_at_least") <= top + 1e-12);
  assert_near(pipeline_number(report, "surface_to_envelope"), top, 0.05 * top);
  assert_true(pipeline_number(report, "envelope_to_surface") >= facet - 1e-12);
  assert_true(pipeline_number(report, "envelope_to_surface_at_least") <= facet + 1e-12);
  assert_near(pipeline_number(report, "envelope_to_surface"), facet, 0.05 * facet);
  assert_true(json_is_false(json_object_get(report->root, "certified")));
  qmat_value_release(outputs[0]);
  qmat_value_release(&medial->base);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

static void test_a_curved_shell_is_certified(void **state) {
  (void)state;
  description d = describe(sheet_of(40, 20, half_cylinder), 0);
  expect_certified(&d);
  expect_topology(&d, 1, 0, 0);
  /* A chord of an arc of radius 1 is 0.02 diagonals away from it on either side: 7 to 8 stretches. */
  assert_in_range(d.medial->sphere_count, 8, 20);
  release(&d);
}

static void test_a_solid_and_a_sheet_share_a_medial_mesh(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 16);
  shape_add_sheet(mesh, 20, 20, beside_sphere);
  mesh->sheet_thickness = 0;
  description d = describe(mesh, 0);
  expect_certified(&d);
  expect_topology(&d, 2, 0, 0);
  const size_t sheets = d.medial->sheet_sphere_count;
  assert_true(sheets >= 4 && sheets < d.medial->sphere_count);
  expect_radii(d.medial, sheets, 0);
  double largest = 0;
  for (size_t i = sheets; i < d.medial->sphere_count; i++) largest = fmax(largest, d.medial->spheres[4 * i + 3]);
  assert_near(largest, 1, 0.05);
  release(&d);
}

/* The ball is as deep as without the sheet. */
static void test_a_sheet_through_a_solid_leaves_its_spheres_alone(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 16);
  shape_add_sheet(mesh, 12, 12, through_sphere);
  description d = describe(mesh, 0);
  expect_certified(&d);
  assert_int_equal(d.medial->sheet_sphere_count, 4);
  assert_true(d.medial->sphere_count <= 6);
  double largest = 0;
  for (size_t i = 4; i < d.medial->sphere_count; i++) largest = fmax(largest, d.medial->spheres[4 * i + 3]);
  assert_true(largest > 0.9);
  release(&d);
}

/* A fin of 1.7 % stays a part of the surface, but has no spheres; the sheet that precedes it has. */
static void test_a_flap_is_covered_without_spheres(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 16);
  shape_add_sheet(mesh, 20, 20, beside_sphere);
  const size_t sheet_triangles = mesh->sheet_triangle_count;
  shape_add_sheet(mesh, 3, 2, fin_of_sphere);
  mesh->flap_triangle_count = mesh->sheet_triangle_count - sheet_triangles;
  const qmat_mesh solids = qmat_mesh_of_solids(mesh);
  assert_int_equal(solids.sheet_triangle_count + solids.flap_triangle_count, 0);
  description d = describe(mesh, 0);
  expect_certified(&d);
  expect_topology(&d, 2, 0, 0);
  assert_true(pipeline_number(d.report, "surface_to_envelope_at_least") > 0.005);
  for (size_t i = 0; i < d.medial->sheet_sphere_count; i++) assert_true(d.medial->spheres[4 * i] >= 1.5 - 1e-9);
  release(&d);
}

static void test_a_thickness_is_twice_the_radius_of_the_spheres(void **state) {
  (void)state;
  qmat_mesh *mesh = sheet_of(40, 20, banner);
  mesh->sheet_thickness = 0.05;
  description d = describe(mesh, 0);
  expect_certified(&d);
  expect_radii(d.medial, d.medial->sphere_count, 0.025);
  assert_in_range(d.medial->sphere_count, 4, 14);
  release(&d);
}

static void test_turned_and_shuffled_sheets_come_out_alike(void **state) {
  (void)state;
  description d = describe(sheet_of(30, 15, banner), 0);
  for (int variant = 0; variant < 3; variant++) {
    qmat_mesh *mesh = sheet_of(30, 15, banner);
    if (variant == 0) shape_map(mesh, 1e3, 5, -7, 2);
    if (variant == 1) shape_rotate(mesh);
    if (variant == 2) pipeline_shuffle(mesh);
    description other = describe(mesh, 0);
    expect_certified(&other);
    assert_in_range(other.medial->sphere_count, d.medial->sphere_count - 2, d.medial->sphere_count + 2);
    release(&other);
  }
  release(&d);
  for (int variant = 0; variant < 2; variant++) {
    qmat_mesh *mesh = sheet_of(9, 12, plane);
    if (variant == 0) shape_rotate(mesh);
    if (variant == 1) pipeline_shuffle(mesh);
    d = describe(mesh, 0);
    assert_int_equal(d.medial->sphere_count, 4);
    release(&d);
  }
}

static void test_sheets_do_not_depend_on_threads(void **state) {
  (void)state;
  char digests[3][2][65];
  static const int threads[3] = {1, 2, 8};
  for (int i = 0; i < 3; i++) {
    qmat_mesh *mesh = shape_sphere(1, 12);
    shape_add_sheet(mesh, 20, 20, beside_sphere);
    description d = describe(mesh, threads[i]);
    qmat_digest_hex(&d.medial->base.digest, digests[i][0]);
    qmat_digest_hex(&d.report->base.digest, digests[i][1]);
    release(&d);
    for (int k = 0; k < 2; k++) assert_string_equal(digests[i][k], digests[0][k]);
  }
}

/* Both sides of each slab, which cancel. */
static void test_the_skin_of_a_sheet_has_two_sides(void **state) {
  (void)state;
  description d = describe(sheet_of(10, 10, plane), 0);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.skin", "", (const qmat_value *[]){&d.medial->base, NULL}, outputs);
  const qmat_mesh *skin = (const qmat_mesh *)outputs[0];
  assert_int_equal(skin->triangle_count, 4);
  assert_false(skin->closed);
  double up = 0, down = 0;
  for (size_t t = 0; t < 4; t++) {
    const double *p[3];
    for (size_t k = 0; k < 3; k++) p[k] = &skin->positions[3 * (size_t)skin->triangles[3 * t + k]];
    const double area = 0.5 * ((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]));
    *(area > 0 ? &up : &down) += area;
  }
  assert_near(up, 2, 1e-12);
  assert_near(down, -2, 1e-12);
  qmat_value_release(outputs[0]);
  qmat_value_release(outputs[1]);
  release(&d);
}

/* A sheet and a chain of levels: medial.lod knows which spheres are those of sheets. */
static void test_levels_of_detail_of_a_sheet(void **state) {
  (void)state;
  pipeline p;
  qmat_value *chain[PIPELINE_MOST_PORTS], *level[PIPELINE_MOST_PORTS];
  qmat_mesh *mesh = shape_sphere(1, 6);
  shape_add_sheet(mesh, 6, 6, beside_sphere);
  pipeline_make(&p, mesh, "spacing=0", "");
  pipeline_must_run(0, "medial.chain", "finest=0.005",
                    (const qmat_value *[]){&p.mesh->base, &p.thickness->base, &p.samples->base, &p.medial->base},
                    chain);
  pipeline_must_run(0, "medial.lod", "epsilon=0.02", (const qmat_value *[]){chain[0]}, level);
  const qmat_medial *medial = (const qmat_medial *)level[0];
  assert_true(medial->sheet_sphere_count >= 4 && medial->sheet_sphere_count < medial->sphere_count);
  expect_radii(medial, medial->sheet_sphere_count, 0);
  for (size_t i = medial->sheet_sphere_count; i < medial->sphere_count; i++)
    assert_true(medial->spheres[4 * i + 3] > 0);
  for (int i = 0; i < 2; i++) {
    qmat_value_release(chain[i]);
    qmat_value_release(level[i]);
  }
  pipeline_free(&p);
}

/* Only the solid has creases. */
static void test_sharp_features_are_those_of_solids(void **state) {
  (void)state;
  pipeline p;
  qmat_value *outputs[PIPELINE_MOST_PORTS], *simple[PIPELINE_MOST_PORTS];
  qmat_mesh *mesh = shape_box(1, 1, 1);
  shape_add_sheet(mesh, 6, 6, beside_sphere);
  pipeline_make(&p, mesh, "", "");
  pipeline_must_run(0, "medial.features", "features=sharp", (const qmat_value *[]){&p.mesh->base, &p.medial->base},
                    outputs);
  const qmat_medial *medial = (const qmat_medial *)outputs[0];
  assert_int_equal(medial->sheet_sphere_count, 49);
  pipeline_must_run(0, "medial.simplify", "epsilon=0.02 features=sharp",
                    (const qmat_value *[]){&p.mesh->base, &p.thickness->base, &p.samples->base, outputs[0]}, simple);
  medial = (const qmat_medial *)simple[0];
  assert_int_equal(pipeline_features(medial) - medial->sheet_sphere_count, 8);
  assert_true(medial->sheet_sphere_count < 20);
  for (int i = 0; i < 2; i++) {
    qmat_value_release(outputs[i]);
    qmat_value_release(simple[i]);
  }
  pipeline_free(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_plane_is_two_slabs_between_its_corners),
      cmocka_unit_test(test_a_bent_banner_takes_few_spheres_of_radius_zero),
      cmocka_unit_test(test_the_errors_of_a_half_cylinder_are_those_of_its_axis),
      cmocka_unit_test(test_a_curved_shell_is_certified),
      cmocka_unit_test(test_a_solid_and_a_sheet_share_a_medial_mesh),
      cmocka_unit_test(test_a_sheet_through_a_solid_leaves_its_spheres_alone),
      cmocka_unit_test(test_a_flap_is_covered_without_spheres),
      cmocka_unit_test(test_a_thickness_is_twice_the_radius_of_the_spheres),
      cmocka_unit_test(test_turned_and_shuffled_sheets_come_out_alike),
      cmocka_unit_test(test_sheets_do_not_depend_on_threads),
      cmocka_unit_test(test_the_skin_of_a_sheet_has_two_sides),
      cmocka_unit_test(test_levels_of_detail_of_a_sheet),
      cmocka_unit_test(test_sharp_features_are_those_of_solids),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
