/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/envelope.h"
#include "core/geometry/surface.h"
#include "core/geometry/vector.h"
#include "core/hash.h"
#include "nodes/colliders/shape_set.h"
#include "nodes/measure/area_samples.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/collider_run.h"

static const double pi = 3.14159265358979323846;

/* The volume of the hull of a shape, by its triangles, which must be convex and closed. */
static double hull_volume(const qmat_colliders *c, size_t shape) {
  const size_t first = shape > 0 ? c->hull_ends[2 * shape - 1] : 0, last = c->hull_ends[2 * shape + 1];
  const size_t low = shape > 0 ? c->hull_ends[2 * shape - 2] : 0, high = c->hull_ends[2 * shape];
  double volume = 0;
  for (size_t t = first; t < last; t++) {
    const double *p[3];
    double u[3], v[3], n[3], w[3];
    for (int k = 0; k < 3; k++) p[k] = &c->points[3 * (size_t)c->triangles[3 * t + (size_t)k]];
    for (int k = 0; k < 3; k++) u[k] = p[1][k] - p[0][k], v[k] = p[2][k] - p[0][k];
    n[0] = u[1] * v[2] - u[2] * v[1], n[1] = u[2] * v[0] - u[0] * v[2], n[2] = u[0] * v[1] - u[1] * v[0];
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    volume += (n[0] * p[0][0] + n[1] * p[0][1] + n[2] * p[0][2]) / 6;
    for (size_t i = low; i < high; i++) {
      for (int k = 0; k < 3; k++) w[k] = c->points[3 * i + (size_t)k] - p[0][k];
      assert_true((n[0] * w[0] + n[1] * w[1] + n[2] * w[2]) <= 1e-9 * length);
    }
  }
  assert_int_equal(last - first, 2 * (high - low) - 4); /* Euler */
  return volume;
}

static void test_two_joined_spheres_are_one_capsule(void **state) {
  (void)state;
  static const double spheres[] = {-1, 0, 0, 0.5, 1, 0, 0, 0.25};
  static const uint32_t edge[] = {0, 1};
  collider_run r = make_colliders(shape_box_around(2, 1, 1), sealed_medial_mesh(spheres, 2, edge, 1, NULL, 0),
                                  "hull_points=1024 hull_error=0.0002", 0);
  assert_int_equal(r.colliders->shape_count, 1);
  assert_int_equal(r.colliders->sphere_count, 2);
  assert_memory_equal(r.colliders->shapes, ((uint32_t[]){0, 1, 1}), 3 * sizeof(uint32_t));
  for (size_t i = 0; i < 8; i++) assert_near(r.colliders->spheres[i], spheres[i], 1e-12);
  assert_int_equal(pipeline_count(r.report, "capsules"), 1);
  /* A frustum of slope 1/8 and two caps, by hand. */
  const double slope = -0.125, rise2 = 1 - slope * slope, a = 0.5, b = 0.25, height = 2 + slope * (a - b);
  const double cap_a = a * (1 - slope), cap_b = b * (1 + slope);
  const double volume =
      pi / 3 *
      (height * rise2 * (a * a + a * b + b * b) + cap_a * cap_a * (3 * a - cap_a) + cap_b * cap_b * (3 * b - cap_b));
  assert_near(qmat_shape_volume(spheres, (uint32_t[]){0, 1, 1}), volume, 1e-12);
  assert_near(hull_volume(r.colliders, 0), volume, 0.02 * volume);
  assert_true(hull_volume(r.colliders, 0) < volume);
  assert_near(pipeline_number(r.report, "volume_ratio"), volume / 16, 0.01 * volume / 16);
  assert_near(pipeline_number(r.report, "iou"), volume / 16, 0.01 * volume / 16);
  assert_near(pipeline_number(r.report, "coverage"), volume / 16, 0.01 * volume / 16);
  assert_near(pipeline_number(r.report, "protrusion"), 0, 0);
  /* The farthest corner is nearest to the small end. */
  const double corner = (sqrt(3) - 0.25) / sqrt(24);
  assert_true(pipeline_number(r.report, "max_uncovered_gap") <= corner);
  assert_near(pipeline_number(r.report, "max_uncovered_gap"), corner, 0.02);
  collider_run_free(&r);
}

static void test_a_ball_that_leaves_a_cube_protrudes_by_hand(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 1.2};
  collider_run r =
      make_colliders(shape_box_around(1, 1, 1), sealed_medial_mesh(ball, 1, NULL, 0, NULL, 0), "samples=100000", 0);
  /* Six caps of height 0.2, each of area 2 pi 1.2 0.2, of which no point is farther out than 0.2. */
  assert_near(pipeline_number(r.report, "protrusion"), 6 * 0.2 / (2 * 1.2), 0.01);
  assert_near(pipeline_number(r.report, "protrusion_mean"), 0.5 * 0.1 / sqrt(12), 0.001);
  assert_true(pipeline_number(r.report, "protrusion_p95") <= 0.2 / sqrt(12));
  const double volume = 4 / 3.0 * pi * 1.2 * 1.2 * 1.2, cap = pi * 0.04 * (3.6 - 0.2) / 3;
  assert_near(pipeline_number(r.report, "volume_ratio"), volume / 8, 0.01);
  assert_near(pipeline_number(r.report, "coverage"), (volume - 6 * cap) / 8, 0.01);
  assert_near(pipeline_number(r.report, "iou"), (volume - 6 * cap) / (8 + 6 * cap), 0.01);
  collider_run_free(&r);
}

static void test_mass_properties_of_a_box_by_hand(void **state) {
  (void)state;
  static const double ball[] = {10, 20, 30, 0.5}, units[] = {0, 1, 0.01}; /* a model without a unit is in metres */
  for (size_t i = 0; i < 3; i++) {
    qmat_mesh *box = shape_box_around(1, 2, 3);
    shape_map(box, 1, 10, 20, 30);
    box->meters_per_unit = units[i];
    collider_run r = make_colliders(box, sealed_medial_mesh(ball, 1, NULL, 0, NULL, 0), "density=2.5", 0);
    const double mass = 2.5 * (i < 2 ? 48 : 48e-6), *body = r.colliders->body;
    const double expected[10] = {mass, 10, 20, 30, mass / 12 * (16 + 36), mass / 12 * (4 + 36), mass / 12 * (4 + 16)};
    assert_int_equal(r.colliders->body_count, 1);
    for (int k = 0; k < 10; k++) assert_near(body[k], expected[k], 1e-9 * (k > 0 && k < 4 ? 30 : mass));
    assert_near(pipeline_number(r.report, "mass"), mass, 1e-9 * mass);
    collider_run_free(&r);
  }
}

static void test_sheets_have_no_mass(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 0.5};
  qmat_mesh *box = shape_box_around(1, 2, 3);
  shape_triangle(box, 0, 1, shape_vertex(box, 5, 6, 7));
  box->sheet_triangle_count = 1;
  box->closed = box->oriented = true;
  collider_run r = make_colliders(box, sealed_medial_mesh(ball, 1, NULL, 0, NULL, 0), "density=1", 0);
  const double expected[10] = {48, 0, 0, 0, 4 * 52, 4 * 40, 4 * 20};
  assert_int_equal(r.colliders->body_count, 1);
  for (int k = 0; k < 10; k++) assert_near(r.colliders->body[k], expected[k], 1e-6);
  collider_run_free(&r);
}

static void test_inertia_turns_with_the_solid(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 0.5};
  qmat_mesh *box = shape_box_around(1, 2, 3);
  shape_rotate(box);
  collider_run r = make_colliders(box, sealed_medial_mesh(ball, 1, NULL, 0, NULL, 0), "density=1", 0);
  const double *i = &r.colliders->body[4], m = 48 / 12.0;
  /* Invariants of the tensor: trace, sum of principal minors, determinant. */
  const double a = m * 52, b = m * 40, c = m * 20;
  assert_near(i[0] + i[1] + i[2], a + b + c, 1e-9);
  assert_near(i[0] * i[1] + i[1] * i[2] + i[0] * i[2] - i[3] * i[3] - i[4] * i[4] - i[5] * i[5], a * b + b * c + a * c,
              1e-6);
  assert_near(
      i[0] * (i[1] * i[2] - i[5] * i[5]) - i[3] * (i[3] * i[2] - i[5] * i[4]) + i[4] * (i[3] * i[5] - i[1] * i[4]),
      a * b * c, 1e-4);
  assert_true(fabs(i[3]) > 1);
  collider_run_free(&r);
}

static void test_nested_and_degenerate_shapes_are_left_out(void **state) {
  (void)state;
  /* Sphere 1 is inside sphere 0, with which it is joined; sphere 2 has no radius; sphere 3 is inside the capsule. */
  static const double nested[] = {0, 0, 0, 1, 0.3, 0, 0, 0.2, 4, 0, 0, 0, 2, 0, 0, 0.1};
  static const uint32_t edges[] = {0, 1, 0, 2};
  collider_run r = make_colliders(shape_box_around(5, 1, 1), sealed_medial_mesh(nested, 4, edges, 2, NULL, 0),
                                  "least_radius=0.001", 0);
  assert_int_equal(r.colliders->shape_count, 1);
  assert_int_equal(r.colliders->sphere_count, 2);
  assert_near(r.colliders->spheres[7], 0.001 * sqrt(108), 1e-12);
  collider_run_free(&r);
  /* A slab whose large sphere reaches beyond the line of the others is two capsules and no hull. */
  static const double steep[] = {0, 0, 0, 1, 1.2, 0.1, 0, 0.1, 1.2, -0.1, 0, 0.1};
  static const uint32_t slab[] = {0, 1, 2};
  r = make_colliders(shape_box_around(3, 3, 3), sealed_medial_mesh(steep, 3, NULL, 0, slab, 1), "", 0);
  assert_int_equal(pipeline_count(r.report, "hulls_of_three") + pipeline_count(r.report, "capsules"),
                   r.colliders->shape_count);
  collider_run_free(&r);
  /* Two equal spheres are one. */
  static const double equal[] = {0, 0, 0, 1, 0, 0, 0, 1};
  r = make_colliders(shape_box_around(1, 1, 1), sealed_medial_mesh(equal, 2, NULL, 0, NULL, 0), "", 0);
  assert_int_equal(r.colliders->shape_count, 1);
  collider_run_free(&r);
}

/* The first output of a node; the others are released. */
static qmat_value *first_output(const char *name, const char *text, const qmat_value *const inputs[]) {
  qmat_value *outputs[PIPELINE_MOST_PORTS] = {NULL};
  pipeline_must_run(0, name, text, inputs, outputs);
  for (int i = 1; i < PIPELINE_MOST_PORTS; i++) qmat_value_release(outputs[i]);
  return outputs[0];
}

/* A model and its medial mesh; `epsilon` is the parameter of medial.simplify, "epsilon=3%". */
static void describe(const char *name, const char *epsilon, qmat_mesh **mesh, qmat_medial **medial) {
  *mesh = shape_seal(pipeline_model(name, 12));
  const qmat_value *solid = &(*mesh)->base;
  qmat_value *field = first_output("mesh.sdf", "", (const qmat_value *[]){solid});
  qmat_value *samples = first_output("mesh.sample", "", (const qmat_value *[]){solid, field});
  qmat_value *initial = first_output("medial.delaunay", "", (const qmat_value *[]){solid, field, samples});
  *medial =
      (qmat_medial *)first_output("medial.simplify", epsilon, (const qmat_value *[]){solid, field, samples, initial});
  qmat_value_release(field);
  qmat_value_release(samples);
  qmat_value_release(initial);
}

static collider_run make_of_model(const char *name, const char *params) {
  qmat_mesh *mesh;
  qmat_medial *medial;
  describe(name, "epsilon=3%", &mesh, &medial);
  return make_colliders(mesh, medial, params, 0);
}

static qmat_envelope *envelope_of(const qmat_colliders *c) {
  qmat_context context = {0};
  const qmat_shape_set set = {c->sphere_count, c->shape_count, c->spheres, c->shapes, NULL};
  qmat_envelope *envelope;
  assert_int_equal(qmat_shape_set_envelope(&context, &set, &envelope), QMAT_OK);
  qmat_context_uninit(&context);
  return envelope;
}

static void test_contain_leaves_none_of_a_million_points_outside(void **state) {
  (void)state;
  collider_run r = make_of_model("l-bracket", "fit=contain");
  qmat_context context = {0};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, r.mesh, &surface), QMAT_OK);
  qmat_envelope *envelope = envelope_of(r.colliders);
  size_t inside = 0, outside = 0;
  const double *positions = qmat_surface_positions(surface);
  double low[3] = {1, 1, 1}, high[3] = {-1, -1, -1};
  for (size_t i = 0; i < 3 * r.mesh->vertex_count; i++) {
    low[i % 3] = fmin(low[i % 3], positions[i]);
    high[i % 3] = fmax(high[i % 3], positions[i]);
  }
  for (uint64_t i = 0; inside < 1000000; i++) {
    double point[3];
    for (uint64_t k = 0; k < 3; k++) point[k] = low[k] + (high[k] - low[k]) * qmat_hash_unit(qmat_hash3(99, i, k));
    if (!qmat_surface_inside(surface, point)) continue;
    inside++;
    qmat_frame_to_model(qmat_surface_frame(surface), point, 1, point);
    outside += !qmat_envelope_holds(envelope, point, -1e-9);
  }
  assert_int_equal(outside, 0);
  assert_true(json_is_true(json_object_get(r.report->root, "proved")));
  assert_near(pipeline_number(r.report, "coverage"), 1, 0);
  assert_true(pipeline_number(r.report, "volume_ratio") < 1.5);
  /* Hulls contain their shapes: every sphere's farthest points are behind all planes. */
  for (size_t s = 0; s < r.colliders->shape_count; s++)
    assert_true(hull_volume(r.colliders, s) >=
                0.999 * (qmat_shape_width(&r.colliders->shapes[3 * s]) < 3
                             ? qmat_shape_volume(r.colliders->spheres, &r.colliders->shapes[3 * s])
                             : 0));
  qmat_envelope_free(envelope);
  qmat_surface_free(surface);
  collider_run_free(&r);
  qmat_context_uninit(&context);
}

/* Where the proof does not end within its rounds, all shapes grow by what is left. Epsilon is less than the sheet is
 * thick: shapes that may be farther away contain it only with more than twice its volume. */
static void test_contain_grows_shapes_only_where_the_solid_is_outside(void **state) {
  (void)state;
  qmat_mesh *mesh;
  qmat_medial *medial;
  describe("curved-sheet", "epsilon=1%", &mesh, &medial);
  collider_run r = make_colliders(mesh, medial, "fit=contain", 0);
  assert_true(json_is_true(json_object_get(r.report->root, "proved")));
  assert_true(pipeline_number(r.report, "volume_ratio") < 1.8);
  collider_run_free(&r);
}

static void test_inside_leaves_no_point_of_a_shape_outside(void **state) {
  (void)state;
  collider_run r = make_of_model("l-bracket", "fit=inside");
  qmat_context context = {0};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, r.mesh, &surface), QMAT_OK);
  size_t outside = 0;
  for (uint64_t i = 0; i < 200000; i++) { /* points of the boundaries of the shapes' spheres */
    const uint32_t *ids = &r.colliders->shapes[3 * (i % r.colliders->shape_count)];
    double shares[3], point[3] = {0, 0, 0}, radius = 0, sum = 0;
    for (uint64_t k = 0; k < 3; k++) sum += shares[k] = qmat_hash_unit(qmat_hash3(7, i, k)) + 1e-9;
    for (int s = 0; s < 3; s++) {
      const double *sphere = &r.colliders->spheres[4 * (size_t)ids[s]];
      for (int k = 0; k < 3; k++) point[k] += shares[s] / sum * sphere[k];
      radius += shares[s] / sum * sphere[3];
    }
    const double z = 2 * qmat_hash_unit(qmat_hash3(8, i, 0)) - 1, turn = 2 * pi * qmat_hash_unit(qmat_hash3(8, i, 1));
    point[0] += radius * sqrt(1 - z * z) * cos(turn);
    point[1] += radius * sqrt(1 - z * z) * sin(turn);
    point[2] += radius * z;
    qmat_frame_to_unit(qmat_surface_frame(surface), point, 1, point);
    outside += qmat_surface_signed_distance(surface, point) > 1e-8;
  }
  assert_int_equal(outside, 0);
  assert_true(json_is_true(json_object_get(r.report->root, "proved")));
  assert_near(pipeline_number(r.report, "protrusion"), 0, 0);
  assert_true(pipeline_number(r.report, "coverage") > 0.6);
  qmat_surface_free(surface);
  collider_run_free(&r);
  qmat_context_uninit(&context);
}

static void place_square(double u, double v, double point[3]) {
  point[0] = 2 * u - 1, point[1] = 2 * v - 1, point[2] = 0;
}

/* Slabs touch the sides of a box, and those of a thick sheet, all over. */
static void test_inside_fills_a_box_and_a_thick_sheet(void **state) {
  (void)state;
  qmat_mesh *of_box;
  qmat_medial *medial;
  describe("box", "epsilon=2%", &of_box, &medial);
  collider_run r = make_colliders(of_box, medial, "fit=inside", 0);
  assert_true(json_is_true(json_object_get(r.report->root, "proved")));
  assert_true(pipeline_number(r.report, "coverage") > 0.9);
  collider_run_free(&r);
  const double half = 0.1, spheres[16] = {-1, -1, 0, half, 1, -1, 0, half, 1, 1, 0, half, -1, 1, 0, half};
  const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3}, edges[10] = {0, 1, 0, 2, 0, 3, 1, 2, 2, 3};
  qmat_mesh *mesh = shape_new();
  shape_add_sheet(mesh, 1, 1, place_square);
  mesh->closed = mesh->oriented = true;
  mesh->sheet_thickness = 2 * half;
  r = make_colliders(mesh, sealed_medial_mesh(spheres, 4, edges, 5, triangles, 2), "fit=inside", 0);
  assert_true(json_is_true(json_object_get(r.report->root, "proved")));
  assert_true(pipeline_number(r.report, "coverage") > 0.99);
  collider_run_free(&r);
}

/* Whether a point is in the hull of a shape, or nearer than `slack` to one of its planes. */
static bool is_in_hull(const qmat_colliders *c, size_t shape, const double point[3], double slack) {
  for (size_t i = shape > 0 ? c->hull_ends[2 * shape - 1] : 0; i < c->hull_ends[2 * shape + 1]; i++) {
    const double *p[3];
    double u[3], v[3], to[3], normal[3];
    for (int k = 0; k < 3; k++) p[k] = &c->points[3 * (size_t)c->triangles[3 * i + (size_t)k]];
    qmat_subtract(p[1], p[0], u);
    qmat_subtract(p[2], p[0], v);
    qmat_subtract(point, p[0], to);
    qmat_cross(u, v, normal);
    if (qmat_dot(normal, to) > slack * sqrt(qmat_dot(normal, normal))) return false;
  }
  return true;
}

/* A ball around a box leaves only the box in its hull, as exactly as the planes of facets can. */
static void test_the_hull_of_a_ball_around_a_box_is_the_box(void **state) {
  (void)state;
  collider_run r =
      make_colliders(shape_box_around(1, 2, 3), sealed_medial_mesh((double[]){0, 0, 0, 4}, 1, NULL, 0, NULL, 0),
                     "fit=contain kind=hulls", 0);
  assert_true(json_is_true(json_object_get(r.report->root, "proved")));
  assert_int_equal(r.colliders->shape_count, 1);
  assert_int_equal(qmat_shape_width(r.colliders->shapes), 3);
  assert_int_equal(r.colliders->point_count, 8);
  assert_near(hull_volume(r.colliders, 0), 48, 1e-3);
  assert_true(hull_volume(r.colliders, 0) > 48);
  assert_near(pipeline_number(r.report, "hull_protrusion"), 1e-4, 2e-6);
  collider_run_free(&r);
}

/* Hulls of parts of a box become the box. Those of two boxes stay two, unless only one is allowed, which is 1 away from
 * both boxes in the middle of its facets. */
static void test_hulls_are_joined_where_the_solid_is_convex(void **state) {
  (void)state;
  const double spheres[8] = {0, 0, 1.5, 3, 0, 0, -1.5, 3};
  collider_run r = make_colliders(shape_box_around(1, 2, 3), sealed_medial_mesh(spheres, 2, NULL, 0, NULL, 0),
                                  "fit=contain kind=hulls", 0);
  assert_int_equal(pipeline_count(r.report, "single_spheres"), 2);
  assert_int_equal(pipeline_count(r.report, "shapes"), 1);
  assert_int_equal(r.colliders->point_count, 8);
  assert_near(hull_volume(r.colliders, 0), 48, 1e-3);
  assert_true(hull_volume(r.colliders, 0) > 48);
  collider_run_free(&r);
  for (size_t most = 0; most < 3; most++) {
    qmat_mesh *mesh = shape_box_around(1, 1, 1);
    shape_add_box(mesh, 3, -1, -1, 5, 1, 1, false);
    char params[64];
    snprintf(params, sizeof params, "fit=contain kind=hulls shapes=%zu", most);
    r = make_colliders(mesh, sealed_medial_mesh((double[]){0, 0, 0, 2, 4, 0, 0, 2}, 2, NULL, 0, NULL, 0), params, 0);
    assert_int_equal(r.colliders->shape_count, most == 1 ? 1 : 2);
    assert_near(hull_volume(r.colliders, 0), most == 1 ? 24 : 8, 1e-3);
    const double outside = most == 1 ? 1 / sqrt(44) : 0, bound = pipeline_number(r.report, "hull_protrusion");
    assert_true(bound >= outside && bound <= outside + 1.02e-4);
    collider_run_free(&r);
  }
}

static void assert_in_bounds(double value, double low, double high) {
  assert_true(value >= low && value <= high);
}

static void place_wall(double u, double v, double point[3]) {
  point[0] = 3, point[1] = 2 * u - 1, point[2] = 2 * v - 1;
}

/* A sheet beside a box has a hull of its own, as thin as least_radius lets it be: by hand, the plate, prisms along its
 * four sides, and a quarter of an octahedron at each corner. The hull of the box stays the box. A thick sheet keeps the
 * hulls of its shapes. */
static void test_a_sheet_beside_a_box_has_a_hull_of_its_own(void **state) {
  (void)state;
  const double spheres[20] = {0, 0, 0, 2, 3, -1, -1, 0, 3, 1, -1, 0, 3, -1, 1, 0, 3, 1, 1, 0};
  const uint32_t triangles[6] = {1, 2, 4, 1, 3, 4}, edges[10] = {1, 2, 1, 3, 1, 4, 2, 4, 3, 4};
  for (int thick = 0; thick < 2; thick++) {
    qmat_mesh *mesh = shape_box_around(1, 1, 1);
    shape_add_sheet(mesh, 2, 3, place_wall);
    mesh->closed = mesh->oriented = true;
    mesh->sheet_thickness = thick ? 0.2 : 0;
    collider_run r = make_colliders(mesh, sealed_medial_mesh(spheres, 5, edges, 5, triangles, 2),
                                    "fit=contain kind=hulls hull_error=0.001", 0);
    assert_true(json_is_true(json_object_get(r.report->root, "proved")));
    assert_int_equal(r.colliders->shape_count, 2 + thick);
    assert_int_equal(json_object_get(r.report->root, "hull_protrusion") != NULL, !thick);
    const size_t wall = hull_volume(r.colliders, 0) > 6 ? 1 : 0;
    const double reach = 0.0005 * sqrt(24), volume = 8 * reach + 8 * reach * reach + 4 * reach * reach * reach / 3;
    if (!thick) {
      assert_near(hull_volume(r.colliders, 1 - wall), 8, 1e-3);
      assert_in_bounds(hull_volume(r.colliders, wall), volume, 1.05 * volume);
      assert_in_bounds(pipeline_number(r.report, "hull_protrusion"), 0.0005, 0.0005 + 2e-4);
      for (uint64_t i = 0; i < 10000; i++) {
        double point[3];
        place_wall(qmat_hash_unit(qmat_hash3(5, i, 0)), qmat_hash_unit(qmat_hash3(5, i, 1)), point);
        assert_true(is_in_hull(r.colliders, wall, point, 0));
      }
    }
    collider_run_free(&r);
  }
}

static void place_sail(double u, double v, double point[3]) {
  point[0] = 3 + u * v, point[1] = 2 * u - 1, point[2] = 2 * v - 1;
}

/* Random points of a curved sheet with a thickness beside a box are in shapes, and in hulls, of each kind. The medial
 * mesh has two slabs of it, which leave some of it out. */
static void test_contain_leaves_no_point_of_a_thick_sheet_outside(void **state) {
  (void)state;
  static const char *const kinds[] = {"any", "capsules", "hulls"};
  const double half = 0.1, spheres[20] = {0, 0, 0, 1, 3, -1, -1, half, 3, 1, -1, half, 3, -1, 1, half, 4, 1, 1, half};
  const uint32_t triangles[6] = {1, 2, 4, 1, 3, 4}, edges[10] = {1, 2, 1, 3, 1, 4, 2, 4, 3, 4};
  for (int kind = 0; kind < 3; kind++) {
    char params[64];
    qmat_mesh *mesh = shape_box_around(1, 1, 1);
    shape_add_sheet(mesh, 8, 8, place_sail);
    mesh->closed = mesh->oriented = true;
    mesh->sheet_thickness = 2 * half;
    snprintf(params, sizeof params, "fit=contain kind=%s", kinds[kind]);
    collider_run r = make_colliders(mesh, sealed_medial_mesh(spheres, 5, edges, 5, triangles, 2), params, 0);
    assert_true(json_is_true(json_object_get(r.report->root, "proved")));
    assert_near(pipeline_number(r.report, "coverage"), 1, 0);
    assert_near(pipeline_number(r.report, "max_uncovered_gap"), 0, 0);
    assert_in_bounds(pipeline_number(r.report, "volume_ratio"), 1, 4);
    qmat_envelope *envelope = envelope_of(r.colliders);
    size_t outside_shapes = 0, outside_hulls = 0;
    for (uint64_t i = 0; i < 100000; i++) {
      /* A point of a facet, and a point on the sphere of half the thickness around it. */
      const size_t facet = 12 + i % mesh->sheet_triangle_count;
      double point[3], direction[3];
      const double *corners[3];
      for (size_t k = 0; k < 3; k++) corners[k] = &r.mesh->positions[3 * (size_t)r.mesh->triangles[3 * facet + k]];
      qmat_triangle_point(corners[0], corners[1], corners[2], qmat_hash_unit(qmat_hash3(6, i, 0)),
                          qmat_hash_unit(qmat_hash3(6, i, 1)), point);
      qmat_spread_direction((size_t)(qmat_hash3(6, i, 2) % 1000), 1000, direction);
      for (int k = 0; k < 3; k++) point[k] += half * direction[k];
      outside_shapes += !qmat_envelope_holds(envelope, point, 0);
      bool found = false;
      for (size_t s = 0; s < r.colliders->shape_count && !found; s++) found = is_in_hull(r.colliders, s, point, 1e-9);
      outside_hulls += !found;
    }
    assert_int_equal(outside_shapes, 0);
    assert_int_equal(outside_hulls, 0);
    qmat_envelope_free(envelope);
    collider_run_free(&r);
  }
}

/* Slabs of radius 0.04 in a square of thickness 0.2: both sides of it are 0.06 away. */
static void test_the_gap_of_a_thick_sheet_is_that_of_its_sides(void **state) {
  (void)state;
  const double r = 0.04, spheres[16] = {-1, -1, 0, r, 1, -1, 0, r, 1, 1, 0, r, -1, 1, 0, r};
  const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3}, edges[10] = {0, 1, 0, 2, 0, 3, 1, 2, 2, 3};
  qmat_mesh *mesh = shape_new();
  shape_add_sheet(mesh, 4, 4, place_square);
  mesh->closed = mesh->oriented = true;
  mesh->sheet_thickness = 0.2;
  collider_run made = make_colliders(mesh, sealed_medial_mesh(spheres, 4, edges, 5, triangles, 2), "fit=both", 0);
  const double gap = 0.06 / sqrt(8);
  assert_near(pipeline_number(made.report, "gap_mean"), gap, 1e-9);
  assert_near(pipeline_number(made.report, "max_uncovered_gap"), gap, 1e-9);
  collider_run_free(&made);
}

/* A needle of a sheet, without area, has a hull, too. */
static void test_a_sheet_without_area_has_a_hull(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box_around(1, 1, 1);
  const uint32_t ends[2] = {shape_vertex(mesh, 2, 0, 0), shape_vertex(mesh, 3, 0, 0)};
  shape_triangle(mesh, ends[0], ends[1], shape_vertex(mesh, 2.5, 0, 0));
  mesh->sheet_triangle_count = 1;
  mesh->closed = mesh->oriented = true;
  const double spheres[12] = {0, 0, 0, 2, 2, 0, 0, 0, 3, 0, 0, 0};
  collider_run r =
      make_colliders(mesh, sealed_medial_mesh(spheres, 3, (uint32_t[]){1, 2}, 1, NULL, 0), "fit=contain kind=hulls", 0);
  assert_int_equal(r.colliders->shape_count, 2);
  for (int k = 0; k < 2; k++) {
    bool found = false;
    for (size_t s = 0; s < 2; s++) found = found || is_in_hull(r.colliders, s, (double[]){2 + k, 0, 0}, 0);
    assert_true(found);
  }
  collider_run_free(&r);
}

/* Of an l-bracket, all points are in hulls, and these have less volume beyond it than the shapes. */
static void test_hulls_of_the_solid_contain_it(void **state) {
  (void)state;
  qmat_mesh *mesh;
  qmat_medial *medial;
  describe("l-bracket", "epsilon=3%", &mesh, &medial);
  qmat_value_retain(&mesh->base);
  qmat_value_retain(&medial->base);
  collider_run r = make_colliders(mesh, medial, "fit=contain kind=hulls", 0),
               shapes = make_colliders(mesh, medial, "fit=contain", 0);
  assert_in_range(r.colliders->shape_count, 1, shapes.colliders->shape_count);
  qmat_context context = {0};
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, r.mesh, &surface), QMAT_OK);
  size_t inside = 0, outside = 0, held = 0, of_shapes = 0;
  for (uint64_t i = 0; inside < 100000; i++) {
    double point[3];
    for (uint64_t k = 0; k < 3; k++) point[k] = 1.2 * qmat_hash_unit(qmat_hash3(7, i, k)) - 0.6;
    const bool is_inside = qmat_surface_inside(surface, point);
    qmat_frame_to_model(qmat_surface_frame(surface), point, 1, point);
    bool found = false, in_shape = false;
    for (size_t s = 0; s < r.colliders->shape_count && !found; s++) found = is_in_hull(r.colliders, s, point, 0);
    for (size_t s = 0; s < shapes.colliders->shape_count && !in_shape; s++)
      in_shape = is_in_hull(shapes.colliders, s, point, 0);
    inside += is_inside;
    outside += is_inside && !found;
    held += found;
    of_shapes += in_shape;
  }
  assert_int_equal(outside, 0);
  assert_true((double)held < 1.1 * (double)inside);
  assert_true(held < of_shapes);
  qmat_surface_free(surface);
  qmat_context_uninit(&context);
  collider_run_free(&r);
  collider_run_free(&shapes);
}

static void test_budget_kind_and_hull_points_are_kept(void **state) {
  (void)state;
  static const char *const cases[][2] = {{"fit=both shapes=5", "both"},
                                         {"fit=contain shapes=4 kind=capsules hull_points=24", "contain"},
                                         {"fit=contain shapes=12 kind=spheres", "contain"},
                                         {"fit=inside kind=spheres", "inside"},
                                         {"fit=contain shapes=3", "contain"},
                                         {"fit=contain kind=hulls hull_points=24", "contain"},
                                         {"fit=inside kind=hulls", "inside"},
                                         {"fit=inside shapes=2", "inside"},
                                         {"fit=both kind=spheres dent=0.0005", "both"}};
  static const size_t most[] = {5, 4, 12, 256, 3, 256, 256, 2, 256};
  qmat_mesh *mesh;
  qmat_medial *medial;
  describe("l-bracket", "epsilon=3%", &mesh, &medial);
  for (size_t i = 0; i < sizeof most / sizeof *most; i++) {
    qmat_value_retain(&mesh->base);
    qmat_value_retain(&medial->base);
    collider_run r = make_colliders(mesh, medial, cases[i][0], 0);
    assert_in_range(r.colliders->shape_count, 1, most[i]);
    if (strstr(cases[i][0], "capsules")) assert_int_equal(pipeline_count(r.report, "hulls_of_three"), 0);
    if (strstr(cases[i][0], "spheres"))
      assert_int_equal(pipeline_count(r.report, "single_spheres"), r.colliders->shape_count);
    for (size_t s = 0; s < r.colliders->shape_count; s++)
      assert_true(r.colliders->hull_ends[2 * s] - (s ? r.colliders->hull_ends[2 * s - 2] : 0) <=
                  (strstr(cases[i][0], "=24") ? 24 : 128));
    for (size_t s = 0; s < r.colliders->shape_count && strstr(cases[i][0], "kind=hulls"); s++)
      assert_int_equal(qmat_shape_width(&r.colliders->shapes[3 * s]), 3);
    if (!strstr(cases[i][0], "both")) assert_true(json_is_true(json_object_get(r.report->root, "proved")));
    if (strstr(cases[i][0], "contain")) assert_near(pipeline_number(r.report, "coverage"), 1, 0);
    collider_run_free(&r);
  }
  qmat_value_release(&mesh->base);
  qmat_value_release(&medial->base);
}

/* Two boxes with a sphere each: the shape for both is outside of both. */
static void test_a_budget_inside_the_solid_leaves_a_shape(void **state) {
  (void)state;
  static const char *const kinds[] = {"any", "capsules", "spheres", "hulls"};
  static const double spheres[] = {0, 0, 0, 0.4, 5, 0, 0, 0.9};
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
    char params[64];
    snprintf(params, sizeof params, "fit=inside shapes=1 kind=%s", kinds[i]);
    qmat_mesh *mesh = shape_box_around(0.5, 0.5, 0.5);
    shape_add_box(mesh, 4, -1, -1, 6, 1, 1, false);
    collider_run r = make_colliders(mesh, sealed_medial_mesh(spheres, 2, NULL, 0, NULL, 0), params, 2);
    assert_int_equal(r.colliders->shape_count, 1);
    const double *s = &r.colliders->spheres[4 * (size_t)r.colliders->shapes[0]]; /* the larger one */
    assert_near(s[0], 5, 1e-9);
    assert_true(s[3] > 0.9 && s[3] < 1 + 1e-6);
    assert_true(json_is_true(json_object_get(r.report->root, "proved")));
    collider_run_free(&r);
  }
}

/* The deepest dent between neighbours of equal spheres along x, which may come in any order. */
static double deepest_dent(const qmat_colliders *c) {
  double most = 0;
  for (size_t i = 0; i < c->shape_count; i++) {
    const double *s = &c->spheres[4 * (size_t)c->shapes[3 * i]];
    double next = INFINITY;
    for (size_t j = 0; j < c->shape_count; j++) {
      const double *t = &c->spheres[4 * (size_t)c->shapes[3 * j]];
      if (t[0] > s[0]) next = fmin(next, t[0] - s[0]);
    }
    if (isfinite(next)) most = fmax(most, s[3] - sqrt(fmax(s[3] * s[3] - next * next / 4, 0)));
  }
  return most;
}

static void test_dents_are_as_deep_as_the_report_says(void **state) {
  (void)state;
  static const struct { double half, asked; } cases[] = {{0.005, 1e-4}, {0.005, 1e-3}, {0.02, 1e-4}, {0.002, 1e-4}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const double r = cases[i].half, spheres[] = {-0.5, 0, 0, r, 0.5, 0, 0, r};
    char params[64];
    snprintf(params, sizeof params, "kind=spheres dent=%g", cases[i].asked);
    collider_run run = make_colliders(shape_box_around(0.5 + r, r, r),
                                      sealed_medial_mesh(spheres, 2, (const uint32_t[]){0, 1}, 1, NULL, 0), params, 2);
    const double told = pipeline_number(run.report, "dent"), diagonal = pipeline_number(run.report, "diagonal");
    assert_in_range(run.colliders->shape_count, 3, 256);
    assert_true(told >= cases[i].asked);
    assert_true(deepest_dent(run.colliders) <= told * diagonal * (1 + 1e-9));
    /* Deeper dents than asked only where those asked take more than 256 spheres. */
    const double step = 2 * sqrt(cases[i].asked * diagonal * (2 * r - cases[i].asked * diagonal));
    assert_true((told > cases[i].asked) == (1 / step > 255));
    collider_run_free(&run);
  }
}

static void test_one_two_and_eight_threads_make_the_same_bytes(void **state) {
  (void)state;
  qmat_mesh *mesh;
  qmat_medial *medial;
  describe("octopus", "epsilon=5%", &mesh, &medial);
  static const char *const params[] = {"fit=contain samples=1000", "fit=inside samples=1000",
                                       "fit=contain kind=hulls samples=1000"};
  for (size_t p = 0; p < 3; p++) {
    qmat_digest first;
    for (int threads = 1; threads <= 8; threads *= threads == 2 ? 4 : 2) {
      qmat_value_retain(&mesh->base);
      qmat_value_retain(&medial->base);
      collider_run r = make_colliders(mesh, medial, params[p], threads);
      if (threads == 1) first = r.colliders->base.digest;
      assert_true(qmat_digest_equal(&first, &r.colliders->base.digest));
      collider_run_free(&r);
    }
  }
  qmat_value_release(&mesh->base);
  qmat_value_release(&medial->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_two_joined_spheres_are_one_capsule),
      cmocka_unit_test(test_a_ball_that_leaves_a_cube_protrudes_by_hand),
      cmocka_unit_test(test_mass_properties_of_a_box_by_hand),
      cmocka_unit_test(test_sheets_have_no_mass),
      cmocka_unit_test(test_inertia_turns_with_the_solid),
      cmocka_unit_test(test_nested_and_degenerate_shapes_are_left_out),
      cmocka_unit_test(test_contain_leaves_none_of_a_million_points_outside),
      cmocka_unit_test(test_contain_grows_shapes_only_where_the_solid_is_outside),
      cmocka_unit_test(test_inside_leaves_no_point_of_a_shape_outside),
      cmocka_unit_test(test_inside_fills_a_box_and_a_thick_sheet),
      cmocka_unit_test(test_the_hull_of_a_ball_around_a_box_is_the_box),
      cmocka_unit_test(test_hulls_are_joined_where_the_solid_is_convex),
      cmocka_unit_test(test_a_sheet_beside_a_box_has_a_hull_of_its_own),
      cmocka_unit_test(test_contain_leaves_no_point_of_a_thick_sheet_outside),
      cmocka_unit_test(test_the_gap_of_a_thick_sheet_is_that_of_its_sides),
      cmocka_unit_test(test_a_sheet_without_area_has_a_hull),
      cmocka_unit_test(test_hulls_of_the_solid_contain_it),
      cmocka_unit_test(test_budget_kind_and_hull_points_are_kept),
      cmocka_unit_test(test_a_budget_inside_the_solid_leaves_a_shape),
      cmocka_unit_test(test_dents_are_as_deep_as_the_report_says),
      cmocka_unit_test(test_one_two_and_eight_threads_make_the_same_bytes),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
