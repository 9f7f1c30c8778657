/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/surface.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "nodes/measure/medial_topology.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"

/* The spheres of the tetrahedra, without merging, halving or thinning. */
#define PLAIN "merge=0 max_envelope_error=0 thinning_tolerance=0"

static qmat_field *constant_thickness(const qmat_mesh *mesh, double value) {
  qmat_context context = {0};
  qmat_field *field = qmat_field_new();
  assert_non_null(field);
  field->count = mesh->triangle_count;
  field->domain = QMAT_PER_FACET;
  field->unit = qmat_strdup("model unit");
  field->values = qmat_alloc(field->count, sizeof *field->values);
  for (size_t i = 0; i < field->count; i++) field->values[i] = value;
  assert_int_equal(qmat_value_seal(&context, &field->base), QMAT_OK);
  qmat_context_uninit(&context);
  return field;
}

/* Samples of the mesh's vertices only, for cases by hand. Takes the mesh over. */
static void sample_vertices(pipeline *p, qmat_mesh *mesh) {
  qmat_context context = {0};
  *p = (pipeline){.mesh = mesh->base.sealed ? mesh : shape_seal(mesh)};
  p->thickness = constant_thickness(mesh, 1);
  qmat_samples *samples = p->samples = qmat_samples_new();
  assert_non_null(samples);
  samples->count = samples->vertex_count = mesh->vertex_count;
  samples->positions = qmat_alloc(3 * mesh->vertex_count, sizeof *samples->positions);
  samples->barycentrics = qmat_calloc(3 * mesh->vertex_count, sizeof *samples->barycentrics);
  samples->facets = qmat_calloc(mesh->vertex_count, sizeof *samples->facets);
  for (size_t i = 0; i < 3 * mesh->vertex_count; i++) samples->positions[i] = mesh->positions[i];
  for (size_t i = 3 * mesh->triangle_count; i-- > 0;) {
    const size_t v = mesh->triangles[i];
    samples->facets[v] = (uint32_t)(i / 3);
    for (size_t k = 0; k < 3; k++) samples->barycentrics[3 * v + k] = k == i % 3;
  }
  for (size_t v = 0; v < mesh->vertex_count; v++)
    if (samples->barycentrics[3 * v] + samples->barycentrics[3 * v + 1] + samples->barycentrics[3 * v + 2] == 0)
      samples->barycentrics[3 * v] = 1; /* on no triangle */
  assert_int_equal(qmat_value_seal(&context, &samples->base), QMAT_OK);
  qmat_context_uninit(&context);
}

static void assert_sphere(const qmat_medial *medial, size_t i, double x, double y, double z, double r) {
  const double *s = &medial->spheres[4 * i];
  assert_true(i < medial->sphere_count);
  assert_near(s[0], x, 1e-12);
  assert_near(s[1], y, 1e-12);
  assert_near(s[2], z, 1e-12);
  assert_near(s[3], r, 1e-12);
}

static void assert_region(const qmat_medial *medial, size_t sphere, const uint32_t *samples, size_t count) {
  const uint32_t first = medial->region_offsets[sphere];
  assert_int_equal(medial->region_offsets[sphere + 1] - first, count);
  assert_memory_equal(&medial->region_samples[first], samples, count * sizeof *samples);
}

/* --- by hand ------------------------------------------------------------------------------------------------------ */

static void test_regular_tetrahedron(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 1, 1, 1);
  shape_vertex(mesh, 1, -1, -1);
  shape_vertex(mesh, -1, 1, -1);
  shape_vertex(mesh, -1, -1, 1);
  shape_triangle(mesh, 0, 1, 2);
  shape_triangle(mesh, 0, 3, 1);
  shape_triangle(mesh, 0, 2, 3);
  shape_triangle(mesh, 1, 3, 2);
  pipeline p;
  sample_vertices(&p, mesh);
  pipeline_delaunay(&p, 0, "");
  medial_must_have(p.medial, 1, 0, 0);
  assert_sphere(p.medial, 0, 0, 0, 0, 1 / sqrt(3));
  assert_region(p.medial, 0, (uint32_t[]){0, 1, 2, 3}, 4);
  assert_int_equal(pipeline_count(p.report, "tetrahedra"), 1);
  assert_int_equal(pipeline_count(p.report, "circumcentres"), 1);
  assert_int_equal(pipeline_count(p.report, "incentres"), 0);
  assert_int_equal(pipeline_count(p.report, "components"), 1);
  pipeline_delaunay(&p, 0, "radius=circumradius");
  medial_must_have(p.medial, 1, 0, 0);
  assert_sphere(p.medial, 0, 0, 0, 0, sqrt(3));
  pipeline_free(&p);
}

static void test_coincident_centres_of_a_cube_become_one(void **state) {
  (void)state;
  for (int variant = 0; variant < 4; variant++) {
    qmat_mesh *mesh = shape_box(2, 2, 2);
    shape_map(mesh, 1, -1, -1, -1);
    if (variant % 2) pipeline_shuffle(mesh);
    if (variant / 2) shape_rotate(mesh);
    pipeline p;
    sample_vertices(&p, mesh);
    pipeline_delaunay(&p, 0, "merge=1e-6");
    medial_must_have(p.medial, 1, 0, 0);
    assert_sphere(p.medial, 0, 0, 0, 0, 1);
    assert_region(p.medial, 0, (uint32_t[]){0, 1, 2, 3, 4, 5, 6, 7}, 8);
    assert_true(pipeline_count(p.report, "circumcentres") >= 5);
    pipeline_delaunay(&p, 0, "radius=circumradius");
    assert_sphere(p.medial, 0, 0, 0, 0, sqrt(3));
    pipeline_free(&p);
  }
}

/* Three points on a circle of radius 1, and poles at the height h above and below its centre. */
static qmat_mesh *two_pyramids(double h) {
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, 1, 0, 0);
  shape_vertex(mesh, -0.5, sqrt(0.75), 0);
  shape_vertex(mesh, -0.5, -sqrt(0.75), 0);
  shape_vertex(mesh, 0, 0, h);
  shape_vertex(mesh, 0, 0, -h);
  for (uint32_t i = 0; i < 3; i++) {
    shape_triangle(mesh, i, (i + 1) % 3, 3);
    shape_triangle(mesh, (i + 1) % 3, i, 4);
  }
  return mesh;
}

static void test_facet_between_two_tetrahedra_gives_an_edge(void **state) {
  (void)state;
  /* Circumcentres at (4 - 1) / 4 up and down, 5/4 from the corners, 0.625 / sqrt(4.25) from the sides. */
  pipeline p;
  sample_vertices(&p, two_pyramids(2));
  pipeline_delaunay(&p, 0, "max_envelope_error=0");
  const double radius = 0.625 / sqrt(4.25);
  const int up = p.medial->spheres[2] > 0 ? 0 : 1;
  medial_must_have(p.medial, 2, 1, 0);
  assert_sphere(p.medial, (size_t)up, 0, 0, 0.75, radius);
  assert_sphere(p.medial, (size_t)!up, 0, 0, -0.75, radius);
  assert_region(p.medial, (size_t)up, (uint32_t[]){0, 1, 2, 3}, 4);
  assert_region(p.medial, (size_t)!up, (uint32_t[]){0, 1, 2, 4}, 4);
  pipeline_delaunay(&p, 0, "max_envelope_error=0 radius=circumradius");
  assert_sphere(p.medial, (size_t)up, 0, 0, 0.75, 1.25);
  assert_sphere(p.medial, (size_t)!up, 0, 0, -0.75, 1.25);
  pipeline_free(&p);
}

static void test_ring_around_an_edge_gives_a_slab(void **state) {
  (void)state;
  /* Flat: three tetrahedra around the edge between the poles, circumcentres outside, so that the incentres count. */
  pipeline p;
  sample_vertices(&p, two_pyramids(0.5));
  static const char *const settings[] = {"", "incentres=thin theta=1"};
  for (int i = 0; i < 2; i++) {
    pipeline_delaunay(&p, 0, settings[i]);
    medial_must_have(p.medial, 3, 3, 1);
    assert_int_equal(pipeline_count(p.report, "circumcentres"), 0);
    assert_int_equal(pipeline_count(p.report, "incentres"), 3);
    qmat_context context = {0};
    qmat_surface *surface;
    assert_int_equal(qmat_surface_new(&context, p.mesh, &surface), QMAT_OK);
    for (size_t s = 0; s < 3; s++) {
      double sphere[4];
      qmat_frame_spheres_to_unit(qmat_surface_frame(surface), &p.medial->spheres[4 * s], 1, sphere);
      assert_near(p.medial->spheres[4 * s + 2], 0, 1e-12);
      assert_near(sphere[3], -qmat_surface_signed_distance(surface, sphere), 1e-12);
    }
    qmat_surface_free(surface);
    qmat_context_uninit(&context);
  }
  /* No sample is thin, so every tetrahedron is dropped. */
  qmat_context context = {0};
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  const qmat_value *inputs[] = {&p.mesh->base, &p.thickness->base, &p.samples->base};
  assert_int_equal(pipeline_run(&context, "medial.delaunay", "incentres=thin theta=0.5", inputs, outputs),
                   QMAT_ERROR_GEOMETRY);
  qmat_context_uninit(&context);
  pipeline_free(&p);
}

/* --- models whose medial axis is known ---------------------------------------------------------------------------- */

static void test_sphere_gives_its_centre(void **state) {
  (void)state;
  pipeline p;
  sample_vertices(&p, pipeline_model("sphere", 16));
  pipeline_delaunay(&p, 0, PLAIN " radius=circumradius");
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    assert_near(qmat_point_distance(&p.medial->spheres[4 * i], (const double[3]){0, 0, 0}), 0, 1e-6);
    assert_near(p.medial->spheres[4 * i + 3], 1, 1e-6);
  }
  pipeline_delaunay(&p, 0, "");
  medial_must_have(p.medial, 1, 0, 0); /* all of them merge */
  assert_near(qmat_point_distance(p.medial->spheres, (const double[3]){0, 0, 0}), 0, 1e-6);
  assert_int_equal(p.medial->region_sample_count, p.mesh->vertex_count);
  pipeline_free(&p);
}

static void test_capsule_gives_its_axis(void **state) {
  (void)state;
  /* The vertices lie on the ideal surface, so empty spheres reach the axis, except those of slivers. */
  pipeline p;
  sample_vertices(&p, pipeline_model("capsule", 24));
  pipeline_delaunay(&p, 0, PLAIN " radius=circumradius incentres=thin theta=0");
  assert_true(p.medial->sphere_count > 100);
  size_t near = 0;
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    const double *s = &p.medial->spheres[4 * i];
    const double end[3] = {fmin(fmax(s[0], 0), 3), 0, 0};
    near += qmat_point_distance(s, end) < 0.05 && fabs(s[3] - 1) < 0.05;
  }
  assert_true((double)near > 0.75 * (double)p.medial->sphere_count);
  assert_int_equal(pipeline_components(p.medial), 1);
  pipeline_free(&p);
}

static void test_thin_sheet_gives_one_piece_near_its_middle(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("sheet", 24), "spacing=5%", "");
  qmat_model model;
  assert_int_equal(qmat_model_make("sheet", 24, &model), QMAT_OK);
  const double half = model.spheres[3];
  assert_true(half < 0.011 * pipeline_diagonal(p.mesh));
  qmat_model_uninit(&model);
  assert_int_equal(pipeline_components(p.medial), 1);
  assert_int_equal(pipeline_count(p.report, "components"), 1);
  assert_int_equal(pipeline_euler(p.medial), 1);
  size_t middle = 0;
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    const double *s = &p.medial->spheres[4 * i];
    assert_true(fabs(s[2]) + s[3] <= half * (1 + 1e-9));
    middle += fabs(s[2]) <= 0.5 * half;
  }
  assert_true((double)middle > 0.6 * (double)p.medial->sphere_count);
  /* Without incentres a sheet that is thinner than the sample spacing is mostly missed. */
  const size_t all = p.medial->sphere_count;
  pipeline_delaunay(&p, 0, "incentres=thin theta=0");
  assert_true(p.medial->sphere_count < all);
  assert_int_equal(pipeline_count(p.report, "incentres"), 0);
  pipeline_free(&p);
}

/* The slabs have the area of the walls' middles, whatever the thickness: there are no holes, and nothing is there
 * twice. */
static void test_walls_much_thinner_than_the_spacing_are_filled(void **state) {
  (void)state;
  static const double thicknesses[] = {0.01, 0.001, 0.0001};
  for (size_t i = 0; i < sizeof thicknesses / sizeof *thicknesses; i++) {
    const double t = thicknesses[i], side = 1 - t, height = 0.6 - 0.5 * t;
    pipeline p;
    pipeline_make(&p, shape_seal(shape_tray(0.6, t)), "", "");
    double area = 0;
    for (size_t k = 0; k < p.medial->triangle_count; k++) {
      const double *corners[3];
      double normal[3];
      for (size_t c = 0; c < 3; c++) corners[c] = &p.medial->spheres[4 * (size_t)p.medial->triangles[3 * k + c]];
      area += qmat_triangle_area(corners[0], corners[1], corners[2], normal);
    }
    const double expected = side * side + 4 * side * height;
    assert_near(area, expected, 0.05 * expected);
    assert_int_equal(pipeline_components(p.medial), 1);
    assert_int_equal(pipeline_count(p.report, "links"), 0);
    assert_true(pipeline_count(p.report, "mirrored_points") > 1000);
    pipeline_free(&p);
  }
}

/* Two boxes beside a gap much narrower than the spacing have the medial mesh that each has alone. */
static void test_gaps_much_narrower_than_the_spacing_separate(void **state) {
  (void)state;
  static const double gaps[] = {0.3, 0.01, 0.001, 0.0001};
  double first = 0;
  for (size_t i = 0; i < sizeof gaps / sizeof *gaps; i++) {
    qmat_mesh *mesh = shape_box(1, 1, 0.34);
    shape_add_box(mesh, 0.1, 0.1, 0.34 + gaps[i], 0.9, 0.9, 0.43 + gaps[i], false);
    pipeline p;
    pipeline_make(&p, shape_seal(mesh), "", "");
    assert_int_equal(pipeline_components(p.medial), 2);
    assert_int_equal(pipeline_count(p.report, "links"), 0);
    if (i == 0) first = (double)p.medial->sphere_count;
    assert_true((double)p.medial->sphere_count < 1.5 * first);
    pipeline_free(&p);
  }
}

static void test_torus_keeps_its_loop(void **state) {
  (void)state;
  static const char *const samplings[] = {"spacing=0", "spacing=5%"};
  for (int i = 0; i < 4; i++) {
    pipeline p;
    pipeline_make(&p, pipeline_model("torus", 12), samplings[i / 2], i % 2 ? PLAIN : "");
    assert_int_equal(pipeline_euler(p.medial), 0);
    assert_int_equal(pipeline_components(p.medial), 1);
    assert_int_equal(pipeline_count(p.report, "components"), 1);
    pipeline_free(&p);
  }
}

static void test_two_solids_give_two_pieces(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 1, 1.1, 1.2, false);
  shape_add_box(mesh, 1.5, 0, 0, 2.5, 1.1, 1.2, false);
  pipeline p;
  pipeline_make(&p, mesh, "spacing=5%", "");
  assert_int_equal(pipeline_components(p.medial), 2);
  assert_int_equal(pipeline_count(p.report, "components"), 2);
  assert_int_equal(pipeline_count(p.report, "links"), 0);
  assert_int_equal(pipeline_euler(p.medial), 2);
  size_t left = 0, right = 0;
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    left += p.medial->spheres[4 * i] < 1;
    right += p.medial->spheres[4 * i] > 1.5;
  }
  assert_true(left > 0 && right > 0);
  assert_int_equal(left + right, p.medial->sphere_count); /* nothing between them */
  pipeline_free(&p);
}

/* Tetrahedra between two spheres are needles. Their incentres can lie below a bulging surface. */
static void test_spheres_beside_each_other_are_not_joined(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 24), *small = shape_sphere(0.05, 24);
  shape_map(small, 1, 3, 0, 0);
  const uint32_t first = (uint32_t)mesh->vertex_count;
  for (size_t i = 0; i < small->vertex_count; i++)
    shape_vertex(mesh, small->positions[3 * i], small->positions[3 * i + 1], small->positions[3 * i + 2]);
  for (size_t i = 0; i < small->triangle_count; i++)
    shape_triangle(mesh, first + small->triangles[3 * i], first + small->triangles[3 * i + 1],
                   first + small->triangles[3 * i + 2]);
  qmat_value_release(&small->base);
  pipeline p;
  pipeline_make(&p, mesh, "", "");
  assert_int_equal(pipeline_components(p.medial), 2);
  assert_int_equal(pipeline_count(p.report, "links"), 0);
  for (size_t i = 0; i < p.medial->sphere_count; i++)
    assert_true(p.medial->spheres[4 * i] < 1 || p.medial->spheres[4 * i] > 2.95);
  pipeline_free(&p);
}

/* Across a gap narrower than the distance of the samples, tetrahedra of one box have corners on the other. */
static void test_boxes_beside_a_narrow_gap_are_not_linked(void **state) {
  (void)state;
  for (int seed = 0; seed < 3; seed++) {
    char sampling[32];
    snprintf(sampling, sizeof sampling, "seed=%d", seed);
    pipeline p;
    pipeline_make(&p, pipeline_narrow_gap(), sampling, "");
    assert_int_equal(pipeline_components(p.medial), 2);
    pipeline_free(&p);
  }
}

/* Half a ring of square cross-section, thick at both ends and as thin as a hair between. */
static qmat_mesh *half_ring_with_hair(void) {
  enum { RINGS = 13 };
  const double pi = acos(-1);
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < RINGS; i++) {
    const double angle = pi * i / (RINGS - 1), half = i < 4 || i >= RINGS - 4 ? 0.2 : 1e-12;
    for (int k = 0; k < 4; k++) {
      const double radius = 1 + (k == 0 || k == 3 ? half : -half);
      shape_vertex(mesh, radius * cos(angle), radius * sin(angle), k < 2 ? half : -half);
    }
  }
  for (uint32_t i = 0; i + 1 < RINGS; i++)
    for (uint32_t k = 0; k < 4; k++) {
      const uint32_t a = 4 * i + k, b = 4 * i + (k + 1) % 4;
      shape_triangle(mesh, a, b + 4, b);
      shape_triangle(mesh, a, a + 4, b + 4);
    }
  shape_triangle(mesh, 0, 1, 2);
  shape_triangle(mesh, 0, 2, 3);
  const uint32_t last = 4 * (RINGS - 1);
  shape_triangle(mesh, last, last + 2, last + 1);
  shape_triangle(mesh, last, last + 3, last + 2);
  return mesh;
}

/* The medial mesh tears at the hair. The chord between its parts is far outside of the solid. */
static void test_links_stay_near_the_solid(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, half_ring_with_hair(), "spacing=5%", "epsilon=0");
  assert_int_equal(pipeline_components(p.medial), 1);
  assert_true(pipeline_count(p.report, "links") > 0);
  pipeline_delaunay(&p, 0, "epsilon=1%");
  assert_int_equal(pipeline_count(p.report, "links"), 0);
  assert_int_equal(pipeline_components(p.medial), 2);
  assert_int_equal(pipeline_count(p.report, "components"), 2);
  pipeline_free(&p);
}

static void test_cavity_is_left_out(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 3, 3.1, 3.2, false);
  shape_add_box(mesh, 1, 1, 1, 2, 2.1, 2.2, true);
  pipeline p;
  pipeline_make(&p, mesh, "spacing=5%", "");
  assert_int_equal(pipeline_components(p.medial), 1);
  assert_int_equal(pipeline_euler(p.medial), 2); /* a sphere around the cavity */
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    const double *s = &p.medial->spheres[4 * i];
    assert_false(s[0] > 1 && s[0] < 2 && s[1] > 1 && s[1] < 2.1 && s[2] > 1 && s[2] < 2.2);
  }
  pipeline_free(&p);
}

/* --- rules -------------------------------------------------------------------------------------------------------- */

/* Takes the mesh; returns the number of spheres. */
static size_t check_circumspheres(qmat_mesh *mesh, const char *sampling) {
  pipeline p;
  pipeline_make(&p, mesh, sampling, PLAIN " radius=circumradius incentres=thin theta=0");
  const double tolerance = 1e-6 * pipeline_diagonal(p.mesh);
  const size_t count = p.medial->sphere_count;
  for (size_t i = 0; i < count; i++) {
    const double *s = &p.medial->spheres[4 * i];
    assert_true(p.medial->region_offsets[i + 1] >= p.medial->region_offsets[i] + 4);
    for (uint32_t r = p.medial->region_offsets[i]; r < p.medial->region_offsets[i + 1]; r++)
      assert_near(qmat_point_distance(s, &p.samples->positions[3 * (size_t)p.medial->region_samples[r]]), s[3],
                  tolerance);
    for (size_t k = 0; k < p.samples->count; k++)
      assert_true(qmat_point_distance(s, &p.samples->positions[3 * k]) >= s[3] - tolerance);
  }
  pipeline_free(&p);
  return count;
}

static void test_circumradius_touches_its_samples_and_holds_none(void **state) {
  (void)state;
  assert_true(check_circumspheres(pipeline_model("l-bracket", 8), "spacing=8%") > 500);
}

/* A box of the height 1 whose top and bottom are divided at these 6 x and 5 y. */
static qmat_mesh *divided_box(const double x[6], const double y[5]) {
  qmat_mesh *mesh = shape_new();
  for (int level = 0; level < 2; level++)
    for (int i = 0; i < 30; i++) shape_vertex(mesh, x[i % 6], y[i / 6], level);
  for (uint32_t j = 0; j < 4; j++)
    for (uint32_t i = 0; i < 5; i++) {
      const uint32_t v = 6 * j + i;
      shape_quad(mesh, v, v + 6, v + 7, v + 1);
      shape_quad(mesh, v + 30, v + 31, v + 37, v + 36);
    }
  for (uint32_t i = 0; i < 5; i++) {
    shape_quad(mesh, i, i + 1, i + 31, i + 30);
    shape_quad(mesh, i + 25, i + 24, i + 54, i + 55);
  }
  for (uint32_t j = 0; j < 4; j++) {
    shape_quad(mesh, 6 * j + 6, 6 * j, 6 * j + 30, 6 * j + 36);
    shape_quad(mesh, 6 * j + 5, 6 * j + 11, 6 * j + 41, 6 * j + 35);
  }
  return mesh;
}

/* Samples of flat sides lie on circles up to rounding, which may put the centre of a flat tetrahedron far away. */
static void test_flat_tetrahedra_have_no_sphere_far_away(void **state) {
  (void)state;
  static const double x[][6] = {{0, 0.25, 0.5, 1.5, 2.5, 2.75}, {0, 0.25, 0.75, 1.75, 2.75, 3.25}};
  static const double y[][5] = {{0, 1, 2, 3, 4}, {0, 1, 2, 2.25, 3.25}};
  for (size_t i = 0; i < sizeof x / sizeof *x; i++) check_circumspheres(divided_box(x[i], y[i]), "");
}

static void test_flat_regions_are_thinned_and_every_sample_has_a_sphere(void **state) {
  (void)state;
  size_t triangulated[2];
  for (int resolution = 0; resolution < 2; resolution++) {
    pipeline p;
    pipeline_make(&p, pipeline_model("l-bracket", 20 << resolution), "spacing=0", "epsilon=2% merge=0");
    triangulated[resolution] = (size_t)pipeline_count(p.report, "samples_triangulated");
    assert_int_equal(pipeline_count(p.report, "samples"), p.samples->count);
    assert_int_equal(pipeline_components(p.medial), 1);
    uint8_t *answered = qmat_calloc(p.samples->count, 1);
    assert_non_null(answered);
    for (size_t i = 0; i < p.medial->sphere_count; i++)
      for (uint32_t r = p.medial->region_offsets[i]; r < p.medial->region_offsets[i + 1]; r++) {
        const uint32_t sample = p.medial->region_samples[r];
        assert_true(sample < p.samples->count);
        answered[sample] = 1;
      }
    for (size_t i = 0; i < p.samples->count; i++) assert_int_equal(answered[i], 1);
    qmat_free(answered);
    if (resolution == 1) assert_true(3 * triangulated[1] < 2 * p.samples->count);
    if (resolution == 0) {
      pipeline_delaunay(&p, 0, "merge=0 thinning_tolerance=0");
      assert_int_equal(pipeline_count(p.report, "samples_triangulated"), p.samples->count);
    }
    pipeline_free(&p);
  }
  /* Four times the vertices, but fewer than four times the triangulated samples. */
  assert_true(2 * triangulated[1] < 5 * triangulated[0]);
}

static void test_merging_and_thinning_follow_epsilon(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("octopus", 24), "spacing=1%", "");
  const qmat_digest without = p.medial->base.digest;
  const size_t triangulated = (size_t)pipeline_count(p.report, "samples_triangulated");
  const size_t spheres = p.medial->sphere_count;
  pipeline_delaunay(&p, 0, "epsilon=0.5%");
  assert_memory_equal(&p.medial->base.digest, &without, sizeof without);
  pipeline_delaunay(&p, 0, "epsilon=4%");
  assert_true((size_t)pipeline_count(p.report, "samples_triangulated") < triangulated);
  assert_true(2 * p.medial->sphere_count < spheres);
  pipeline_delaunay(&p, 0, "epsilon=4% merge=0.0125 thinning_tolerance=0.0125");
  assert_memory_equal(&p.medial->base.digest, &without, sizeof without);
  pipeline_free(&p);
}

static void test_radius_by_distance_stays_inside_and_circumradius_is_no_smaller(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("torus", 10), "spacing=0", PLAIN);
  qmat_context context = {0};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, p.mesh, &surface), QMAT_OK);
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    double s[4];
    qmat_frame_spheres_to_unit(qmat_surface_frame(surface), &p.medial->spheres[4 * i], 1, s);
    const double depth = -qmat_surface_signed_distance(surface, s);
    assert_true(s[3] > 0 && s[3] <= depth + 1e-9);
  }
  qmat_medial *by_distance = p.medial;
  qmat_value_retain(&by_distance->base);
  pipeline_delaunay(&p, 0, PLAIN " radius=circumradius");
  assert_int_equal(p.medial->sphere_count, by_distance->sphere_count);
  assert_int_equal(p.medial->edge_count, by_distance->edge_count);
  assert_int_equal(p.medial->triangle_count, by_distance->triangle_count);
  size_t larger = 0;
  for (size_t i = 0; i < p.medial->sphere_count; i++) {
    assert_near(qmat_point_distance(&p.medial->spheres[4 * i], &by_distance->spheres[4 * i]), 0, 0);
    assert_true(p.medial->spheres[4 * i + 3] >= by_distance->spheres[4 * i + 3] - 1e-9);
    larger += p.medial->spheres[4 * i + 3] > by_distance->spheres[4 * i + 3] * (1 + 1e-6);
  }
  assert_true(larger > 0);
  qmat_value_release(&by_distance->base);
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
  pipeline_free(&p);
}

/* A cylinder of facets narrower than the distance between samples: long slivers on its surface are left out. */
static void test_narrow_facets_have_few_incentres(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_seal(shape_prism(256, 2)), "", "epsilon=0.01 incentres=all");
  assert_true(3 * pipeline_count(p.report, "incentres") < 2 * pipeline_count(p.report, "samples_triangulated"));
  assert_int_equal(pipeline_count(p.report, "components"), 1);
  pipeline_free(&p);
}

static void test_all_incentres_add_spheres_and_keep_the_others(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("octopus", 6), "spacing=0", "incentres=all");
  const int64_t circumcentres = pipeline_count(p.report, "circumcentres");
  const int64_t incentres = pipeline_count(p.report, "incentres");
  assert_true(incentres > 0);
  int64_t before = -1;
  static const char *const thetas[] = {"incentres=thin theta=0", "incentres=thin theta=0.5", "incentres=thin theta=1",
                                       "incentres=thin theta=10"};
  for (int i = 0; i < 4; i++) {
    pipeline_delaunay(&p, 0, thetas[i]);
    assert_true(pipeline_count(p.report, "circumcentres") >= circumcentres); /* also of tetrahedra outside */
    assert_true(pipeline_count(p.report, "incentres") >= before);
    assert_true(pipeline_count(p.report, "incentres") <= incentres);
    before = pipeline_count(p.report, "incentres");
    if (i == 0) assert_int_equal(before, 0);
  }
  assert_true(before > incentres / 2);
  pipeline_free(&p);
}

static void test_samples_all_have_a_sphere(void **state) {
  (void)state;
  static const char *const names[] = {"capsule", "sheet", "torus", "octopus", "box"};
  for (int i = 0; i < 5; i++) {
    pipeline p;
    pipeline_make(&p, pipeline_model(names[i], 8), "spacing=6%", "");
    uint8_t *answered = calloc(p.samples->count, 1);
    assert_non_null(answered);
    assert_int_equal(p.medial->region_offset_count, p.medial->sphere_count + 1);
    for (size_t k = 0; k < p.medial->region_sample_count; k++) answered[p.medial->region_samples[k]] = 1;
    size_t missing = 0;
    for (size_t k = 0; k < p.samples->count; k++) missing += !answered[k];
    assert_true(missing * 100 <= p.samples->count); /* some samples only belong to slivers on the surface */
    free(answered);
    pipeline_free(&p);
  }
}

/* --- invariance --------------------------------------------------------------------------------------------------- */

static void assert_share(int64_t actual, int64_t expected, double share) {
  assert_near((double)actual, (double)expected, share * (double)expected);
}

static void test_moving_scaling_and_shuffling_change_little(void **state) {
  (void)state;
  static const char *const names[] = {"torus", "octopus"};
  static const char *const counts[] = {"tetrahedra", "circumcentres", "incentres", "spheres", "edges", "triangles"};
  for (int n = 0; n < 2; n++) {
    pipeline plain;
    pipeline_make(&plain, pipeline_model(names[n], 8), "spacing=0 n_f=0", "");
    for (int variant = 0; variant < 5; variant++) {
      qmat_mesh *mesh = pipeline_model(names[n], 8);
      if (variant == 0) shape_rotate(mesh);
      if (variant == 1) shape_map(mesh, 1e-6, 0, 0, 0);
      if (variant == 2) shape_map(mesh, 1e6, 0, 0, 0);
      if (variant == 3) shape_map(mesh, 1, 100, -200, 300);
      if (variant == 4) pipeline_shuffle(mesh);
      pipeline p;
      pipeline_make(&p, mesh, "spacing=0 n_f=0", "");
      /* Added samples start at random per facet; a rotation of the model moves its bounding box and tolerances. */
      const double share = variant == 1 || variant == 2 ? 0.001 : 0.05;
      for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
        assert_share(pipeline_count(p.report, counts[c]), pipeline_count(plain.report, counts[c]),
                     c == 2 ? 4 * share : share);
      assert_int_equal(pipeline_components(p.medial), pipeline_components(plain.medial));
      pipeline_free(&p);
    }
    pipeline_free(&plain);
  }
}

static int by_coordinates(const void *left, const void *right) {
  const double *a = left, *b = right;
  for (int k = 0; k < 4; k++)
    if (fabs(a[k] - b[k]) > 1e-7) return a[k] < b[k] ? -1 : 1;
  return 0;
}

static void test_order_of_samples_does_not_move_the_spheres(void **state) {
  (void)state;
  /* Vertices only, without ties: the same spheres in another order. */
  pipeline p, q;
  qmat_mesh *mesh = pipeline_model("tapered-capsule", 10);
  pipeline_shuffle(mesh);
  sample_vertices(&p, pipeline_model("tapered-capsule", 10));
  sample_vertices(&q, mesh);
  pipeline_delaunay(&p, 0, PLAIN);
  pipeline_delaunay(&q, 0, PLAIN);
  medial_must_have(q.medial, p.medial->sphere_count, p.medial->edge_count, p.medial->triangle_count);
  const size_t count = p.medial->sphere_count;
  double *a = calloc(count, 4 * sizeof *a), *b = calloc(count, 4 * sizeof *b);
  assert_true(a && b);
  memcpy(a, p.medial->spheres, 4 * count * sizeof *a);
  memcpy(b, q.medial->spheres, 4 * count * sizeof *b);
  qsort(a, count, 4 * sizeof *a, by_coordinates);
  qsort(b, count, 4 * sizeof *b, by_coordinates);
  for (size_t i = 0; i < 4 * count; i++) assert_near(b[i], a[i], 1e-6);
  free(a);
  free(b);
  pipeline_free(&p);
  pipeline_free(&q);
}

static void test_threads_do_not_change_a_byte(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("octopus", 8), "spacing=0");
  static const int threads[] = {1, 2, 8};
  qmat_digest medial = {{0}}, report = {{0}};
  for (int i = 0; i < 3; i++) {
    pipeline_delaunay(&p, threads[i], "");
    if (i == 0) {
      medial = p.medial->base.digest;
      report = p.report->base.digest;
    }
    assert_memory_equal(&p.medial->base.digest, &medial, sizeof medial);
    assert_memory_equal(&p.report->base.digest, &report, sizeof report);
  }
  pipeline_free(&p);
}

/* --- errors ------------------------------------------------------------------------------------------------------- */

static void expect_error(const pipeline *p, qmat_status status, const char *field) {
  qmat_context context = {0};
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  const qmat_value *inputs[] = {&p->mesh->base, &p->thickness->base, &p->samples->base};
  assert_int_equal(pipeline_run(&context, "medial.delaunay", "", inputs, outputs), status);
  if (field) assert_string_equal(context.error.field, field);
  qmat_context_uninit(&context);
}

static void test_flat_samples_are_refused(void **state) {
  (void)state;
  pipeline p;
  qmat_mesh *mesh = shape_new(); /* a square seen from both sides */
  for (int i = 0; i < 4; i++) shape_vertex(mesh, i % 2, i / 2, 0);
  shape_quad(mesh, 0, 1, 3, 2);
  shape_quad(mesh, 0, 2, 3, 1);
  sample_vertices(&p, mesh);
  expect_error(&p, QMAT_ERROR_GEOMETRY, NULL);
  pipeline_free(&p);
  mesh = shape_new();
  shape_vertex(mesh, 0, 0, 0);
  shape_vertex(mesh, 1, 0, 0);
  shape_vertex(mesh, 0, 1, 0);
  shape_triangle(mesh, 0, 1, 2);
  sample_vertices(&p, mesh); /* a single triangle */
  expect_error(&p, QMAT_ERROR_GEOMETRY, NULL);
  pipeline_free(&p);
}

static void test_meshes_without_an_inside_are_refused(void **state) {
  (void)state;
  pipeline p;
  sample_vertices(&p, shape_new()); /* nothing at all */
  expect_error(&p, QMAT_ERROR_GEOMETRY, NULL);
  pipeline_free(&p);
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 1, 2, 3, true); /* inside out */
  sample_vertices(&p, mesh);
  expect_error(&p, QMAT_ERROR_GEOMETRY, NULL);
  pipeline_free(&p);
  mesh = shape_new(); /* vertices in one place: no size */
  for (int i = 0; i < 3; i++) shape_vertex(mesh, 1, 1, 1);
  shape_triangle(mesh, 0, 1, 2);
  sample_vertices(&p, mesh);
  expect_error(&p, QMAT_ERROR_GEOMETRY, NULL);
  pipeline_free(&p);
}

static void test_inputs_that_do_not_fit_are_named(void **state) {
  (void)state;
  pipeline box, other;
  sample_vertices(&box, shape_box(1, 1, 1));
  sample_vertices(&other, two_pyramids(1)); /* 5 vertices, 6 facets */
  pipeline mixed = box;
  mixed.samples = other.samples;
  expect_error(&mixed, QMAT_ERROR_GEOMETRY, "samples");
  mixed = box;
  mixed.thickness = other.thickness;
  expect_error(&mixed, QMAT_ERROR_GEOMETRY, "thickness");
  pipeline_free(&box);
  pipeline_free(&other);
}

static void test_progress_function_cancels(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("torus", 8), "spacing=0");
  pipeline_must_be_cancelled("medial.delaunay", "",
                             (const qmat_value *[]){&p.mesh->base, &p.thickness->base, &p.samples->base});
  pipeline_free(&p);
}

static qmat_topology topology_of(const pipeline *p) {
  qmat_context context = {0};
  qmat_topology topology;
  assert_int_equal(qmat_topology_of_medial(&context, p->medial, &topology), QMAT_OK);
  qmat_context_uninit(&context);
  return topology;
}

/* Slivers on the wrong side of the surface make seven loops in the octopus, at this resolution. */
static void test_loops_are_those_of_the_solid(void **state) {
  (void)state;
  static const struct {
    const char *name;
    size_t loops;
    bool is_changed;
  } models[] = {{"octopus", 0, true}, {"torus", 1, false}, {"l-bracket", 0, false}};
  for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
    pipeline p;
    pipeline_make(&p, pipeline_model(models[i].name, 0), "", "");
    const int64_t changed =
        pipeline_count(p.report, "kept_for_topology") + pipeline_count(p.report, "dropped_for_topology");
    assert_int_equal(changed > 0, models[i].is_changed);
    assert_int_equal(topology_of(&p).loops, models[i].loops);
    pipeline_free(&p);
  }
}

/* How far the middle of a medial edge leaves the solid, in diagonals. */
static double farthest_middle(const pipeline *p) {
  qmat_context context = {0};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, p->mesh, &surface), QMAT_OK);
  const qmat_frame *frame = qmat_surface_frame(surface);
  double farthest = 0;
  for (size_t e = 0; e < p->medial->edge_count; e++) {
    double middle[3];
    for (size_t k = 0; k < 3; k++)
      middle[k] = 0.5 * (p->medial->spheres[4 * (size_t)p->medial->edges[2 * e] + k] +
                         p->medial->spheres[4 * (size_t)p->medial->edges[2 * e + 1] + k]);
    qmat_frame_to_unit(frame, middle, 1, middle);
    farthest = fmax(farthest, qmat_surface_signed_distance(surface, middle));
  }
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
  return farthest;
}

/* Adds a copy of `part`, with its facets turned around where it is a void, and releases `part`. */
static void add_part(qmat_mesh *mesh, qmat_mesh *part, bool is_void) {
  const uint32_t first = (uint32_t)mesh->vertex_count, *corners = part->triangles;
  for (const double *p = part->positions; p < part->positions + 3 * part->vertex_count; p += 3)
    shape_vertex(mesh, p[0], p[1], p[2]);
  for (size_t t = 0; t < part->triangle_count; t++, corners += 3)
    shape_triangle(mesh, first + corners[0], first + corners[is_void ? 2 : 1], first + corners[is_void ? 1 : 2]);
  qmat_value_release(&part->base);
}

/* L-brackets and tori that reach into each other have more loops than the solid of their surfaces, which starts a
 * search for tetrahedra outside that close them. Needles between distant parts have their incentres beside the surface
 * too. */
static void test_no_needle_closes_a_loop(void **state) {
  (void)state;
  static const uint64_t seeds[] = {20, 38, 60};
  for (size_t s = 0; s < sizeof seeds / sizeof *seeds; s++) {
    qmat_mesh *mesh = shape_new();
    random_numbers random = {.seed = seeds[s]};
    for (int i = 0; i < 8; i++) {
      qmat_mesh *part = pipeline_model(i % 2 ? "torus" : "l-bracket", 6);
      shape_map(part, random_between(&random, 0.1, 0.3), 0, 0, 0);
      const double x = random_between(&random, -1, 1), y = random_between(&random, -1, 1);
      const double z = random_between(&random, -1, 1), flatness = random_between(&random, 0.02, 1);
      for (double *p = part->positions; p < part->positions + 3 * part->vertex_count; p += 3) {
        p[0] += x;
        p[1] = y + flatness * p[1];
        p[2] += z;
      }
      add_part(mesh, part, false);
    }
    pipeline p;
    pipeline_make(&p, mesh, "spacing=0", "");
    assert_true(pipeline_count(p.report, "kept_for_topology") > 0);
    assert_true(farthest_middle(&p) < 0.005);
    pipeline_free(&p);
  }
}

/* Around the rim of the column samples of the table lie nearer to it than its own. */
static void test_solids_with_a_narrow_gap_stay_apart(void **state) {
  (void)state;
  static const double gaps[] = {1e-3, 1e-4, 1e-5, 1e-6};
  for (size_t i = 0; i < sizeof gaps / sizeof *gaps; i++) {
    qmat_mesh *mesh = shape_prism(40, 3);
    shape_add_box(mesh, -2, -2, 3 + gaps[i], 2, 2, 3.2, false);
    pipeline p;
    pipeline_make(&p, mesh, "", "");
    assert_int_equal(topology_of(&p).components, 2);
    if (gaps[i] < 1e-4) assert_true(pipeline_count(p.report, "dropped_between_solids") > 0);
    pipeline_free(&p);
  }
}

/* The surface of a void bounds the same solid as the outer surface, and not that of what floats in the void. */
static void test_void_is_no_gap_between_solids(void **state) {
  (void)state;
  for (size_t floating = 0; floating < 2; floating++) {
    qmat_mesh *mesh = shape_new();
    add_part(mesh, shape_sphere(1, 12), false);
    add_part(mesh, shape_sphere(0.98, 12), true);
    if (floating > 0) add_part(mesh, shape_sphere(0.97, 12), false);
    pipeline p;
    pipeline_make(&p, mesh, "", "");
    assert_int_equal(topology_of(&p).components, 1 + floating);
    if (floating == 0) assert_int_equal(pipeline_count(p.report, "dropped_between_solids"), 0);
    pipeline_free(&p);
  }
}

/* Where thin walls meet, tetrahedra between samples of both are outside, which leaves holes: they are kept, also the
 * one that closes the last hole around a void. No hole is widened to a slit. */
static void test_thin_walls_around_a_void_are_closed(void **state) {
  (void)state;
  static const double walls[] = {0.01, 0.012};
  for (size_t i = 0; i < sizeof walls / sizeof *walls; i++) {
    qmat_mesh *mesh = shape_new(), *inner = shape_box(1, 1, 1);
    shape_map(inner, 1 - 2 * walls[i], walls[i], walls[i], walls[i]);
    add_part(mesh, shape_box(1, 1, 1), false);
    add_part(mesh, inner, true);
    pipeline p;
    pipeline_make(&p, mesh, "", "epsilon=0.02");
    const qmat_topology topology = topology_of(&p);
    assert_int_equal(topology.components, 1);
    assert_int_equal(topology.loops, 0);
    assert_int_equal(topology.voids, 1);
    pipeline_free(&p);
  }
}

/* Tetrahedra between two books make loops with the board below them. They are dropped, rather than the gap filled. */
static void test_narrow_gaps_of_one_solid_stay_open(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_books(6), "", "epsilon=0.01");
  const qmat_topology topology = topology_of(&p);
  assert_int_equal(topology.components, 1);
  assert_int_equal(topology.loops, 0);
  assert_int_equal(topology.voids, 0);
  assert_true(pipeline_count(p.report, "dropped_for_topology") > 0);
  assert_true(pipeline_count(p.report, "kept_for_topology") < 20);
  pipeline_free(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_regular_tetrahedron),
      cmocka_unit_test(test_coincident_centres_of_a_cube_become_one),
      cmocka_unit_test(test_facet_between_two_tetrahedra_gives_an_edge),
      cmocka_unit_test(test_ring_around_an_edge_gives_a_slab),
      cmocka_unit_test(test_sphere_gives_its_centre),
      cmocka_unit_test(test_capsule_gives_its_axis),
      cmocka_unit_test(test_thin_sheet_gives_one_piece_near_its_middle),
      cmocka_unit_test(test_walls_much_thinner_than_the_spacing_are_filled),
      cmocka_unit_test(test_gaps_much_narrower_than_the_spacing_separate),
      cmocka_unit_test(test_torus_keeps_its_loop),
      cmocka_unit_test(test_two_solids_give_two_pieces),
      cmocka_unit_test(test_spheres_beside_each_other_are_not_joined),
      cmocka_unit_test(test_boxes_beside_a_narrow_gap_are_not_linked),
      cmocka_unit_test(test_links_stay_near_the_solid),
      cmocka_unit_test(test_cavity_is_left_out),
      cmocka_unit_test(test_circumradius_touches_its_samples_and_holds_none),
      cmocka_unit_test(test_flat_tetrahedra_have_no_sphere_far_away),
      cmocka_unit_test(test_flat_regions_are_thinned_and_every_sample_has_a_sphere),
      cmocka_unit_test(test_merging_and_thinning_follow_epsilon),
      cmocka_unit_test(test_radius_by_distance_stays_inside_and_circumradius_is_no_smaller),
      cmocka_unit_test(test_narrow_facets_have_few_incentres),
      cmocka_unit_test(test_all_incentres_add_spheres_and_keep_the_others),
      cmocka_unit_test(test_samples_all_have_a_sphere),
      cmocka_unit_test(test_moving_scaling_and_shuffling_change_little),
      cmocka_unit_test(test_order_of_samples_does_not_move_the_spheres),
      cmocka_unit_test(test_threads_do_not_change_a_byte),
      cmocka_unit_test(test_flat_samples_are_refused),
      cmocka_unit_test(test_meshes_without_an_inside_are_refused),
      cmocka_unit_test(test_inputs_that_do_not_fit_are_named),
      cmocka_unit_test(test_progress_function_cancels),
      cmocka_unit_test(test_loops_are_those_of_the_solid),
      cmocka_unit_test(test_no_needle_closes_a_loop),
      cmocka_unit_test(test_solids_with_a_narrow_gap_stay_apart),
      cmocka_unit_test(test_void_is_no_gap_between_solids),
      cmocka_unit_test(test_thin_walls_around_a_void_are_closed),
      cmocka_unit_test(test_narrow_gaps_of_one_solid_stay_open),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
