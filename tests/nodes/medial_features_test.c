/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "nodes/measure/medial_topology.h"
#include "tests/nodes/pipeline.h"

static const char *const sampling = "spacing=12% n_f=0", *const no_division = "spacing=100%";

typedef struct {
  qmat_medial *medial;
  qmat_report *report;
} result;

static result find_features(const pipeline *p, int threads, const char *text) {
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline_must_run(threads, "medial.features", text, (const qmat_value *[]){&p->mesh->base, &p->medial->base},
                    outputs);
  return (result){(qmat_medial *)outputs[0], (qmat_report *)outputs[1]};
}

static void release(result *r) {
  qmat_value_release(&r->medial->base);
  qmat_value_release(&r->report->base);
}

static qmat_topology topology_of(const qmat_medial *medial) {
  qmat_context context = {0};
  qmat_topology t;
  assert_int_equal(qmat_topology_of_medial(&context, medial, &t), QMAT_OK);
  assert_true(t.known);
  qmat_context_uninit(&context);
  return t;
}

static void check_same_topology(const qmat_medial *before, const qmat_medial *after) {
  const qmat_topology old = topology_of(before), new = topology_of(after);
  assert_int_equal(new.components, old.components);
  assert_int_equal(new.loops, old.loops);
  assert_int_equal(new.voids, old.voids);
}

/* The input is unchanged; new spheres have radius 0 and keep the topology. */
static void check_extension(const qmat_medial *before, const result *r) {
  const qmat_medial *after = r->medial;
  assert_int_equal(after->sphere_count, before->sphere_count + (size_t)pipeline_count(r->report, "spheres"));
  assert_memory_equal(after->spheres, before->spheres, 4 * before->sphere_count * sizeof(double));
  for (size_t i = before->sphere_count; i < after->sphere_count; i++) assert_near(after->spheres[4 * i + 3], 0, 0);
  assert_int_equal(pipeline_count(r->report, "gaps"), 0);
  check_same_topology(before, after);
}

static size_t count_crease_edges(const qmat_medial *medial) {
  size_t count = 0;
  for (size_t e = 0; e < medial->edge_count; e++)
    count += medial->spheres[4 * (size_t)medial->edges[2 * e] + 3] == 0 &&
             medial->spheres[4 * (size_t)medial->edges[2 * e + 1] + 3] == 0;
  return count;
}

/* Creases, corners and spheres of a mesh, which is taken over. Each crease is whole: between its spheres runs one edge
 * more than there are within it. */
static void check_mesh(qmat_mesh *mesh, const char *text, size_t creases, size_t corners, size_t spheres,
                       size_t crease_edges) {
  pipeline p;
  pipeline_make(&p, mesh, sampling, "");
  result r = find_features(&p, 0, text);
  assert_int_equal(pipeline_count(r.report, "creases"), creases);
  assert_int_equal(pipeline_count(r.report, "corners"), corners);
  assert_int_equal(pipeline_count(r.report, "spheres"), spheres);
  check_extension(p.medial, &r);
  assert_int_equal(count_crease_edges(r.medial), crease_edges);
  release(&r);
  pipeline_free(&p);
}

/* The nearest sphere to a crease may be one of the other box. */
static void test_creases_beside_a_narrow_gap_are_linked_to_their_own_box(void **state) {
  (void)state;
  for (int seed = 0; seed < 3; seed++) {
    char text[32];
    snprintf(text, sizeof text, "seed=%d", seed);
    pipeline p;
    pipeline_make(&p, pipeline_narrow_gap(), text, "");
    result r = find_features(&p, 0, "");
    check_extension(p.medial, &r);
    release(&r);
    pipeline_free(&p);
  }
}

/* A square frame: a ring with creases on the outside, and at the rims of the hole. */
static qmat_mesh *frame(void) {
  qmat_mesh *mesh = shape_new();
  static const double square[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (int ring = 0; ring < 4; ring++)
    for (int i = 0; i < 4; i++)
      shape_vertex(mesh, (ring < 2 ? 3 : 1.5) * square[i][0], (ring < 2 ? 3 : 1.5) * square[i][1], ring & 1);
  for (uint32_t i = 0; i < 4; i++) {
    const uint32_t k = (i + 1) % 4;
    shape_quad(mesh, i, k, k + 4, i + 4);           /* outside */
    shape_quad(mesh, k + 8, i + 8, i + 12, k + 12); /* the hole */
    shape_quad(mesh, i + 4, k + 4, k + 12, i + 12); /* above */
    shape_quad(mesh, k, i, i + 8, k + 8);           /* below */
  }
  return mesh;
}

/* Whether a simplex of the medial mesh of the frame crosses the plane between the halves of one side. */
static bool crosses_cut(const qmat_medial *medial, const uint32_t *corners, size_t count) {
  bool is_left = false, is_right = false, is_beyond = false;
  for (size_t k = 0; k < count; k++) {
    const double *centre = &medial->spheres[4 * (size_t)corners[k]];
    is_left |= centre[0] < 0;
    is_right |= centre[0] >= 0;
    is_beyond |= centre[1] > 0;
  }
  return is_left && is_right && is_beyond;
}

static size_t cut(const qmat_medial *medial, uint32_t *simplices, size_t count, size_t corners) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    if (crosses_cut(medial, &simplices[corners * i], corners)) continue;
    memmove(&simplices[corners * kept++], &simplices[corners * i], corners * sizeof *simplices);
  }
  return kept;
}

/* Where the medial mesh is torn, the path between anchors on both sides leads around the frame. */
static void test_a_crease_is_not_linked_by_a_detour(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, frame(), "spacing=5%", "");
  result r = find_features(&p, 0, "");
  check_extension(p.medial, &r);
  release(&r);
  qmat_medial *torn = qmat_medial_copy(p.medial);
  torn->edge_count = cut(torn, torn->edges, torn->edge_count, 2);
  torn->triangle_count = cut(torn, torn->triangles, torn->triangle_count, 3);
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &torn->base), QMAT_OK);
  qmat_context_uninit(&context);
  qmat_value_release(&p.medial->base);
  p.medial = torn;
  assert_int_equal(pipeline_components(torn), 1);
  r = find_features(&p, 0, "");
  assert_int_equal(pipeline_count(r.report, "gaps"), 4); /* of the creases outside and around the hole */
  assert_true(json_real_value(json_object_get(r.report->root, "longest_link")) < 0.2);
  check_same_topology(torn, r.medial);
  release(&r);
  pipeline_free(&p);
}

static void test_a_box_has_twelve_creases_and_eight_corners(void **state) {
  (void)state;
  check_mesh(shape_box(3, 2, 1), no_division, 12, 8, 8, 12);
  /* Of the diagonal sqrt(14) a tenth is 0.374: edges of 9, 6 and 3 parts, four of each. */
  check_mesh(shape_box(3, 2, 1), "spacing=10%", 12, 8, 8 + 4 * (8 + 5 + 2), 4 * (9 + 6 + 3));
  check_mesh(pipeline_model("box", 4), no_division, 12, 8, 8 + 4 * (3 + 2 + 0), 4 * (4 + 3 + 1));
}

static void test_spheres_lie_on_the_creases_at_even_distances(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(3, 2, 1), sampling, "");
  result r = find_features(&p, 0, "spacing=10%");
  const double extents[3] = {3, 2, 1}, parts[3] = {9, 6, 3};
  for (size_t i = p.medial->sphere_count; i < r.medial->sphere_count; i++) {
    const double *s = &r.medial->spheres[4 * i];
    int within = 0;
    for (int k = 0; k < 3; k++) {
      const double place = s[k] * parts[k] / extents[k];
      assert_near(place, round(place), 1e-12);
      within += place > 0.5 && place < parts[k] - 0.5;
    }
    assert_in_range(within, 0, 1);
  }
  release(&r);
  pipeline_free(&p);
}

static void test_the_concave_crease_of_a_bracket_is_none(void **state) {
  (void)state;
  check_mesh(shape_l(), no_division, 17, 12, 12, 17);
}

static void test_a_cavity_has_no_crease(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(3, 3, 3);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, true);
  check_mesh(mesh, no_division, 12, 8, 8, 12);
}

static void test_rims_of_a_hole_and_of_a_prism_of_many_sides_are_loops(void **state) {
  (void)state;
  check_mesh(shape_prism(12, 2), no_division, 2, 0, 24, 24);  /* sides at 30 degrees, rims that bend by 30 */
  check_mesh(shape_prism(5, 2), no_division, 15, 10, 10, 15); /* by 72 */
  check_mesh(shape_prism(12, 2), "angle=25 spacing=100%", 36, 24, 24,
             36);                                   /* where rims and sides meet there are corners */
  check_mesh(frame(), no_division, 20, 16, 16, 20); /* four of the hole's edges are concave */
}

static void test_creases_do_not_join_parts(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  shape_add_box(mesh, 3, 0, 0, 4, 1, 2, false);
  check_mesh(mesh, no_division, 24, 16, 16, 24);
}

static void test_a_smooth_model_keeps_its_medial_mesh(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("sphere", 12), sampling, "");
  result r = find_features(&p, 0, "");
  assert_int_equal(pipeline_count(r.report, "creases"), 0);
  assert_ptr_equal(r.medial, p.medial);
  release(&r);
  pipeline_free(&p);
}

/* The bending of a prism of 24 sides, in degrees times length: 90 x 2 x its circumference on the edges, and 360 x its
 * height on the sides. */
static void test_auto_adds_features_to_flat_faces_alone(void **state) {
  (void)state;
  const double round = 2 * 24 * sin(3.14159265358979323846 / 24), height = 2;
  const struct {
    qmat_mesh *mesh;
    double sharp_share;
    bool adds;
  } cases[] = {{pipeline_model("box", 4), 1, true},
               {pipeline_model("l-bracket", 4), 1, true},
               {shape_prism(24, height), 180 * round / (180 * round + 360 * height), false},
               {pipeline_model("sphere", 12), 0, false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    pipeline p;
    pipeline_make(&p, cases[i].mesh, sampling, "");
    result r = find_features(&p, 0, "features=auto");
    assert_near(json_number_value(json_object_get(r.report->root, "sharp_share")), cases[i].sharp_share, 1e-9);
    if (cases[i].adds)
      assert_true(r.medial->sphere_count > p.medial->sphere_count);
    else
      assert_ptr_equal(r.medial, p.medial);
    release(&r);
    pipeline_free(&p);
  }
}

static void test_none_keeps_the_medial_mesh_whatever_the_surface(void **state) {
  (void)state;
  pipeline p;
  qmat_mesh *mesh = pipeline_model("box", 4);
  mesh->triangle_count--;
  pipeline_make(&p, mesh, sampling, "");
  result r = find_features(&p, 0, "features=none");
  assert_ptr_equal(r.medial, p.medial);
  release(&r);
  pipeline_free(&p);
}

static void test_short_creases_are_noise(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(10, 10, 10);
  shape_add_box(mesh, 12, 0, 0, 12.1, 0.1, 0.1, false); /* creases of 1.2 in all, 0.06 diagonals */
  check_mesh(mesh, "spacing=100% shortest=10%", 12, 8, 8, 12);
}

static void test_features_answer_for_their_vertices(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(3, 2, 1), sampling, "");
  result r = find_features(&p, 0, "spacing=10%");
  assert_int_equal(r.medial->region_offset_count, r.medial->sphere_count + 1);
  assert_int_equal(r.medial->region_sample_count, p.medial->region_sample_count + 8);
  for (size_t i = p.medial->sphere_count; i < r.medial->sphere_count; i++)
    for (uint32_t k = r.medial->region_offsets[i]; k < r.medial->region_offsets[i + 1]; k++)
      for (size_t c = 0; c < 3; c++)
        assert_near(p.samples->positions[3 * (size_t)r.medial->region_samples[k] + c], r.medial->spheres[4 * i + c], 0);
  release(&r);
  pipeline_free(&p);
}

static void test_neither_turns_nor_the_order_of_vertices_matter(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_l();
  shape_rotate(mesh);
  check_mesh(mesh, no_division, 17, 12, 12, 17);
  mesh = shape_l();
  pipeline_shuffle(mesh);
  check_mesh(mesh, no_division, 17, 12, 12, 17);
  mesh = shape_prism(12, 2);
  shape_rotate(mesh);
  pipeline_shuffle(mesh);
  check_mesh(mesh, no_division, 2, 0, 24, 24);
  mesh = pipeline_model("box", 4);
  shape_map(mesh, 1e6, 1e7, 0, -1e7);
  pipeline_shuffle(mesh);
  check_mesh(mesh, no_division, 12, 8, 8 + 4 * (3 + 2 + 0), 4 * (4 + 3 + 1));
}

static void test_the_number_of_threads_does_not_matter(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_l(), sampling, "");
  result r = find_features(&p, 1, "");
  static const int threads[] = {2, 8};
  for (int i = 0; i < 2; i++) {
    result other = find_features(&p, threads[i], "");
    assert_memory_equal(&other.medial->base.digest, &r.medial->base.digest, sizeof r.medial->base.digest);
    release(&other);
  }
  release(&r);
  pipeline_free(&p);
}

static void test_a_surface_without_sides_is_an_error(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(1, 1, 1), sampling, "");
  qmat_mesh *mesh = shape_box(1, 1, 1);
  const uint32_t corner = mesh->triangles[0];
  mesh->triangles[0] = mesh->triangles[1];
  mesh->triangles[1] = corner;
  mesh = shape_seal(mesh);
  assert_false(mesh->oriented);
  qmat_context context = {0};
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  assert_int_equal(
      pipeline_run(&context, "medial.features", "", (const qmat_value *[]){&mesh->base, &p.medial->base}, outputs),
      QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, "mesh");
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  pipeline_free(&p);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_crease_is_not_linked_by_a_detour),
      cmocka_unit_test(test_a_box_has_twelve_creases_and_eight_corners),
      cmocka_unit_test(test_spheres_lie_on_the_creases_at_even_distances),
      cmocka_unit_test(test_the_concave_crease_of_a_bracket_is_none),
      cmocka_unit_test(test_a_cavity_has_no_crease),
      cmocka_unit_test(test_rims_of_a_hole_and_of_a_prism_of_many_sides_are_loops),
      cmocka_unit_test(test_creases_do_not_join_parts),
      cmocka_unit_test(test_creases_beside_a_narrow_gap_are_linked_to_their_own_box),
      cmocka_unit_test(test_a_smooth_model_keeps_its_medial_mesh),
      cmocka_unit_test(test_auto_adds_features_to_flat_faces_alone),
      cmocka_unit_test(test_none_keeps_the_medial_mesh_whatever_the_surface),
      cmocka_unit_test(test_short_creases_are_noise),
      cmocka_unit_test(test_features_answer_for_their_vertices),
      cmocka_unit_test(test_neither_turns_nor_the_order_of_vertices_matter),
      cmocka_unit_test(test_the_number_of_threads_does_not_matter),
      cmocka_unit_test(test_a_surface_without_sides_is_an_error),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
