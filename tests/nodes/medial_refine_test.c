/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/envelope.h"
#include "core/geometry/vector.h"
#include "core/hash.h"
#include "tests/nodes/pipeline.h"

enum { REFINED_SAMPLES, REFINED_MEDIAL, REFINED_REPORT, REFINED_OUTPUTS };

static qmat_status refine(const pipeline *p, const char *params, qmat_context *context, qmat_value *outputs[]) {
  const qmat_value *inputs[] = {&p->mesh->base, &p->thickness->base, &p->samples->base, &p->medial->base};
  return pipeline_run(context, "medial.refine", params, inputs, outputs);
}

static void must_refine(const pipeline *p, int threads, const char *params, qmat_value *outputs[]) {
  const qmat_value *inputs[] = {&p->mesh->base, &p->thickness->base, &p->samples->base, &p->medial->base};
  pipeline_must_run(threads, "medial.refine", params, inputs, outputs);
}

static void release(qmat_value *outputs[]) {
  for (size_t i = 0; i < REFINED_OUTPUTS; i++) qmat_value_release(outputs[i]);
}

/* A medial mesh of one sphere, without responsible regions. */
static void set_sphere(pipeline *p, double x, double y, double z, double radius) {
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = 1;
  medial->spheres = qmat_alloc(1, 4 * sizeof(double));
  assert_non_null(medial->spheres);
  memcpy(medial->spheres, (double[]){x, y, z, radius}, 4 * sizeof(double));
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_context_uninit(&context);
  p->medial = medial;
}

/* The largest distance to the envelope over `count` random points of the surface and its vertices, in diagonals. */
static double largest_distance(const qmat_mesh *mesh, const qmat_medial *medial, size_t count) {
  qmat_context context = {0};
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_of_medial(&context, medial, &envelope), QMAT_OK);
  double largest = 0;
  for (size_t i = 0; i < mesh->vertex_count; i++)
    largest = fmax(largest, qmat_envelope_distance(envelope, &mesh->positions[3 * i], NULL));
  for (size_t i = 0; i < count; i++) {
    const uint32_t *ids = &mesh->triangles[3 * (i % mesh->triangle_count)];
    const double u = sqrt(qmat_hash_unit(qmat_hash3(1, i, 0))), v = qmat_hash_unit(qmat_hash3(1, i, 1));
    const double weights[3] = {1 - u, u * (1 - v), i % 3 ? u * v : 0}; /* a third of them near a side */
    double place[3];
    for (size_t k = 0; k < 3; k++)
      place[k] =
          (weights[0] * mesh->positions[3 * (size_t)ids[0] + k] + weights[1] * mesh->positions[3 * (size_t)ids[1] + k] +
           weights[2] * mesh->positions[3 * (size_t)ids[2] + k]) /
          (weights[0] + weights[1] + weights[2]);
    largest = fmax(largest, qmat_envelope_distance(envelope, place, NULL));
  }
  qmat_envelope_free(envelope);
  qmat_context_uninit(&context);
  return largest / pipeline_diagonal(mesh);
}

static void test_a_cubes_inscribed_sphere_is_farthest_from_its_corners(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, shape_box(2, 2, 2), "");
  const double *corner = p.mesh->positions;
  double centre[3];
  for (size_t k = 0; k < 3; k++) {
    double low = corner[k], high = corner[k];
    for (size_t i = 0; i < p.mesh->vertex_count; i++) {
      low = fmin(low, p.mesh->positions[3 * i + k]);
      high = fmax(high, p.mesh->positions[3 * i + k]);
    }
    centre[k] = 0.5 * (low + high);
  }
  set_sphere(&p, centre[0], centre[1], centre[2], 1);
  /* From the corner, sqrt(3) from the centre, to the sphere of radius 1, over a diagonal of 2 sqrt(3). */
  const double expected = (sqrt(3) - 1) / (2 * sqrt(3));
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  must_refine(&p, 0, "epsilon=0.1 rounds=0 target=1", outputs);
  const qmat_report *report = (const qmat_report *)outputs[REFINED_REPORT];
  assert_near(pipeline_number(report, "farthest_place"), expected, 1e-12);
  assert_near(pipeline_number(report, "farthest_place_left"), expected, 1e-12);
  /* The far points are the samples outside the sphere enlarged by the limit; the grid has more of them. */
  int64_t far = 0;
  for (size_t i = 0; i < p.samples->count; i++) {
    const double *s = &p.samples->positions[3 * i];
    far += sqrt(pow(s[0] - centre[0], 2) + pow(s[1] - centre[1], 2) + pow(s[2] - centre[2], 2)) - 1 > 0.1 * 2 * sqrt(3);
  }
  assert_true(far >= 8);
  assert_true(pipeline_count(report, "far_places") >= far);
  assert_int_equal(pipeline_count(report, "rounds"), 0);
  assert_ptr_equal(outputs[REFINED_MEDIAL], &p.medial->base);
  release(outputs);
  /* A point beyond the trigger makes the node replace the medial mesh. */
  must_refine(&p, 0, "epsilon=0.1", outputs);
  const qmat_medial *medial = (const qmat_medial *)outputs[REFINED_MEDIAL];
  assert_true(medial->sphere_count > 100);
  assert_true(largest_distance(p.mesh, medial, 20000) < 0.06);
  release(outputs);
  pipeline_free(&p);
}

static void test_what_is_near_enough_is_handed_on_as_it_is(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("torus", 24), "", "");
  static const char *const params[] = {"epsilon=2%", "epsilon=1.5%", "epsilon=0.5% rounds=0", "epsilon=0 rounds=0"};
  for (size_t i = 0; i < sizeof params / sizeof *params; i++) {
    qmat_value *outputs[PIPELINE_MOST_PORTS];
    must_refine(&p, 0, params[i], outputs);
    assert_ptr_equal(outputs[REFINED_SAMPLES], &p.samples->base);
    assert_ptr_equal(outputs[REFINED_MEDIAL], &p.medial->base);
    assert_int_equal(pipeline_count((const qmat_report *)outputs[REFINED_REPORT], "samples_added"), 0);
    release(outputs);
  }
  pipeline_free(&p);
}

/* Both runs must give the same. */
static void must_refine_alike(pipeline *p, const char *params, const char *others) {
  qmat_value *a[PIPELINE_MOST_PORTS], *b[PIPELINE_MOST_PORTS];
  must_refine(p, 0, params, a);
  must_refine(p, 0, others, b);
  assert_true(pipeline_count((const qmat_report *)a[REFINED_REPORT], "samples_added") > 0);
  for (size_t i = 0; i <= REFINED_REPORT; i++) assert_memory_equal(&a[i]->digest, &b[i]->digest, sizeof(qmat_digest));
  release(a);
  release(b);
}

/* A number of spheres alone may lead to an epsilon down to 0.25 %, but a small one cannot be that near. */
static void test_without_epsilon_the_number_of_spheres_decides(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(3, 2, 1), "spacing=8%", "");
  must_refine_alike(&p, "epsilon=0", "epsilon=0.25%");
  must_refine_alike(&p, "epsilon=0 vertices=1000", "epsilon=0.25%");
  must_refine_alike(&p, "epsilon=0 vertices=50", "epsilon=0.5%");
  must_refine_alike(&p, "epsilon=0 vertices=5", "epsilon=1%");
  must_refine_alike(&p, "epsilon=0.5% vertices=5", "epsilon=0.5%");
  pipeline_free(&p);
}

static void test_more_samples_bring_a_coarse_solid_nearer(void **state) {
  (void)state;
  qmat_mesh *const solids[] = {shape_box(3, 2, 1), shape_prism(5, 0.4), shape_l()};
  for (size_t i = 0; i < sizeof solids / sizeof *solids; i++) {
    pipeline p;
    pipeline_make(&p, solids[i], "spacing=8%", "");
    qmat_value *outputs[PIPELINE_MOST_PORTS];
    must_refine(&p, 0, "epsilon=2% target=0.5", outputs);
    const qmat_samples *samples = (const qmat_samples *)outputs[REFINED_SAMPLES];
    const qmat_medial *medial = (const qmat_medial *)outputs[REFINED_MEDIAL];
    const qmat_report *report = (const qmat_report *)outputs[REFINED_REPORT];
    const double before = pipeline_number(report, "farthest_place"),
                 after = pipeline_number(report, "farthest_place_left");
    assert_true(before > 0.02);
    assert_true(after < 0.6 * before);
    assert_true(pipeline_count(report, "rounds") >= 1);
    assert_true(pipeline_count(report, "far_places_left") < pipeline_count(report, "far_places"));
    assert_int_equal(pipeline_count(report, "spheres"), medial->sphere_count);
    /* Between its test points the distance is not much larger. */
    assert_true(largest_distance(p.mesh, medial, 20000) < after + 0.002);
    assert_true(largest_distance(p.mesh, p.medial, 20000) > 0.02);
    /* The samples of equations 7 and 8 are still there, and the others lie on their facets. */
    const size_t known = p.samples->count;
    assert_true(samples->count > known);
    assert_int_equal(samples->count - known, pipeline_count(report, "samples_added"));
    assert_int_equal(samples->vertex_count, p.samples->vertex_count);
    assert_memory_equal(samples->positions, p.samples->positions, 3 * known * sizeof(double));
    assert_memory_equal(samples->facets, p.samples->facets, known * sizeof(uint32_t));
    assert_memory_equal(samples->barycentrics, p.samples->barycentrics, 3 * known * sizeof(double));
    for (size_t s = known; s < samples->count; s++) {
      const uint32_t *ids = &p.mesh->triangles[3 * (size_t)samples->facets[s]];
      const double *weights = &samples->barycentrics[3 * s];
      assert_near(weights[0] + weights[1] + weights[2], 1, 1e-12);
      for (size_t k = 0; k < 3; k++) {
        assert_true(weights[k] >= 0);
        double place = 0;
        for (size_t corner = 0; corner < 3; corner++)
          place += weights[corner] * p.mesh->positions[3 * (size_t)ids[corner] + k];
        assert_near(samples->positions[3 * s + k], place, 1e-12);
      }
    }
    /* Every sample is in a responsible region, as medial.simplify requires. */
    uint8_t *answered = qmat_calloc(samples->count, 1);
    assert_non_null(answered);
    for (size_t s = 0; s < medial->region_sample_count; s++) answered[medial->region_samples[s]] = 1;
    for (size_t s = 0; s < samples->count; s++) assert_true(answered[s]);
    qmat_free(answered);
    release(outputs);
    pipeline_free(&p);
  }
}

static void test_places_that_are_near_stay_as_they_were(void **state) {
  (void)state;
  /* Two boxes far apart in size: the small one's edges are sampled well. */
  pipeline p;
  qmat_mesh *mesh = shape_box(4, 3, 3);
  const size_t large = mesh->triangle_count;
  shape_add_box(mesh, 10, 0, 0, 10.1, 0.1, 0.1, false);
  pipeline_make(&p, mesh, "spacing=8%", "");
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  must_refine(&p, 0, "epsilon=1.5%", outputs);
  const qmat_samples *samples = (const qmat_samples *)outputs[REFINED_SAMPLES];
  assert_true(samples->count > p.samples->count);
  for (size_t s = p.samples->count; s < samples->count; s++) assert_true(samples->facets[s] < large);
  release(outputs);
  pipeline_free(&p);
}

static void test_a_coarse_solid_is_certified(void **state) {
  (void)state;
  /* At 2 % the initial medial mesh of so few samples is not within epsilon itself. */
  pipeline p;
  pipeline_make(&p, shape_box(2, 1.3, 0.4), "spacing=8%", "");
  assert_true(largest_distance(p.mesh, p.medial, 20000) > 0.02);
  qmat_value *refined[PIPELINE_MOST_PORTS], *simple[PIPELINE_MOST_PORTS], *errors[PIPELINE_MOST_PORTS];
  must_refine(&p, 0, "epsilon=2%", refined);
  const qmat_value *inputs[] = {&p.mesh->base, &p.thickness->base, refined[REFINED_SAMPLES], refined[REFINED_MEDIAL]};
  pipeline_must_run(0, "medial.simplify", "epsilon=2%", inputs, simple);
  pipeline_must_run(0, "medial.evaluate", "epsilon=2%", (const qmat_value *[]){&p.mesh->base, simple[0]}, errors);
  assert_true(json_is_true(json_object_get(((const qmat_report *)errors[0])->root, "certified")));
  assert_true(((const qmat_medial *)simple[0])->sphere_count < 20);
  for (size_t i = 0; i < 2; i++) qmat_value_release(simple[i]);
  for (size_t i = 0; i < qmat_output_count(qmat_node_find("medial.evaluate")); i++) qmat_value_release(errors[i]);
  release(refined);
  pipeline_free(&p);
}

/* A box with a square sheet beside it: the winding number of the sheet is too small for a solid anywhere. */
static void test_places_without_solid_get_no_samples(void **state) {
  (void)state;
  pipeline p;
  qmat_mesh *mesh = shape_box(4, 3, 3);
  const uint32_t first = (uint32_t)mesh->vertex_count;
  const size_t closed = mesh->triangle_count;
  const double corners[] = {10, 0, 0, 12, 0, 0, 12, 2, 0, 10, 2, 0};
  const uint32_t sides[] = {first, first + 1, first + 2, first, first + 2, first + 3};
  size_t room = 3 * first, corner_room = 3 * closed;
  assert_false(qmat_grow((void **)&mesh->positions, &room, 3 * (first + 4), sizeof *mesh->positions));
  assert_false(qmat_grow((void **)&mesh->triangles, &corner_room, 3 * (closed + 2), sizeof *mesh->triangles));
  memcpy(&mesh->positions[3 * first], corners, sizeof corners);
  memcpy(&mesh->triangles[3 * closed], sides, sizeof sides);
  mesh->vertex_count += 4;
  mesh->triangle_count += 2;
  pipeline_make(&p, mesh, "spacing=8%", "");
  assert_false(p.mesh->closed);
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  must_refine(&p, 0, "epsilon=1.5%", outputs);
  const qmat_samples *samples = (const qmat_samples *)outputs[REFINED_SAMPLES];
  const qmat_report *report = (const qmat_report *)outputs[REFINED_REPORT];
  assert_true(samples->count > p.samples->count); /* on the box, whose far places come nearer */
  for (size_t s = p.samples->count; s < samples->count; s++) assert_true(samples->facets[s] < closed);
  assert_true(pipeline_count(report, "far_places_left") < pipeline_count(report, "far_places"));
  assert_true(pipeline_number(report, "farthest_place_left") > 0.3);
  release(outputs);
  pipeline_free(&p);
}

static void test_a_cancelled_run_leaves_nothing(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(2, 1.3, 0.4), "spacing=8%", "");
  const qmat_value *inputs[] = {&p.mesh->base, &p.thickness->base, &p.samples->base, &p.medial->base};
  pipeline_must_be_cancelled("medial.refine", "epsilon=2%", inputs);
  for (size_t stop_at = 0; stop_at < 3; stop_at++) { /* with all threads */
    qmat_value *outputs[PIPELINE_MOST_PORTS];
    size_t calls;
    assert_int_equal(pipeline_run_until(0, stop_at, "medial.refine", "epsilon=2%", inputs, outputs, &calls),
                     QMAT_CANCELLED);
  }
  pipeline_free(&p);
}

static void test_threads_do_not_change_a_byte(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(3, 2, 1), "spacing=8%", "");
  qmat_value *one[PIPELINE_MOST_PORTS], *three[PIPELINE_MOST_PORTS];
  must_refine(&p, 1, "epsilon=2%", one);
  must_refine(&p, 3, "epsilon=2%", three);
  for (size_t i = 0; i < REFINED_OUTPUTS; i++)
    assert_memory_equal(&one[i]->digest, &three[i]->digest, sizeof one[i]->digest);
  assert_memory_not_equal(&one[REFINED_MEDIAL]->digest, &p.medial->base.digest, sizeof(qmat_digest));
  release(one);
  release(three);
  pipeline_free(&p);
}

/* The last `count` spheres, those of creases, and the edges between them are the same. */
static void check_same_creases(const qmat_medial *before, const qmat_medial *after, size_t count) {
  assert_true(after->sphere_count > before->sphere_count);
  assert_memory_equal(&after->spheres[4 * (after->sphere_count - count)],
                      &before->spheres[4 * (before->sphere_count - count)], 4 * count * sizeof(double));
  size_t edges[2] = {0, 0};
  const qmat_medial *const both[2] = {before, after};
  for (size_t i = 0; i < 2; i++)
    for (size_t e = 0; e < both[i]->edge_count; e++)
      edges[i] += both[i]->edges[2 * e] >= both[i]->sphere_count - count &&
                  both[i]->edges[2 * e + 1] >= both[i]->sphere_count - count;
  assert_int_equal(edges[0], edges[1]);
  assert_int_equal(pipeline_euler(after), pipeline_euler(before));
  for (size_t v = before->sphere_count - count; v < before->sphere_count; v++) {
    const uint32_t *a = &before->region_offsets[v],
                   *b = &after->region_offsets[v + after->sphere_count - before->sphere_count];
    assert_int_equal(a[1] - a[0], b[1] - b[0]);
    if (a[1] > a[0]) assert_int_equal(before->region_samples[a[0]], after->region_samples[b[0]]);
  }
}

/* A coarse box needs further samples only at its corners. */
static void test_spheres_on_creases_stay_and_are_linked_again(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(3, 2, 1), "spacing=3%", "");
  qmat_value *features[PIPELINE_MOST_PORTS], *refined[PIPELINE_MOST_PORTS];
  pipeline_must_run(0, "medial.features", "", (const qmat_value *[]){&p.mesh->base, &p.medial->base}, features);
  const qmat_value *inputs[] = {&p.mesh->base, &p.thickness->base, &p.samples->base, features[0]};
  pipeline_must_run(0, "medial.refine", "epsilon=1%", inputs, refined);
  const qmat_medial *creased = (const qmat_medial *)features[0], *medial = (const qmat_medial *)refined[REFINED_MEDIAL];
  check_same_creases(creased, medial, creased->sphere_count - p.medial->sphere_count);
  assert_true(largest_distance(p.mesh, medial, 20000) < 0.008);
  release(refined);
  for (size_t i = 0; i < 2; i++) qmat_value_release(features[i]);
  pipeline_free(&p);
}

/* Samples much finer than those around would be many, and leave the places between both too far away. */
static void test_the_first_samples_are_not_much_finer_than_those_around(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, shape_box(3, 2, 1), "spacing=3%", "");
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  must_refine(&p, 0, "epsilon=2%", outputs);
  const qmat_report *report = (const qmat_report *)outputs[REFINED_REPORT];
  assert_true(pipeline_count(report, "far_places") > 100);
  assert_true(pipeline_number(report, "farthest_place_left") <= 0.75 * 0.02);
  assert_true(pipeline_count(report, "samples_added") < 2000);
  assert_true(pipeline_count(report, "rounds") <= 2);
  release(outputs);
  pipeline_free(&p);
}

/* Adds `count` tetrahedra in the unit cube, much longer than wide. */
static void add_spikes(qmat_mesh *mesh, size_t count, uint64_t seed) {
  static const int facets[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  for (size_t i = 0; i < count; i++) {
    double u[18], p[4][3], edges[3][3], normal[3];
    for (size_t k = 0; k < 18; k++) u[k] = qmat_hash_unit(qmat_hash3(seed, i, k));
    const double width = 0.003 + 0.017 * u[0], length = 0.05 + 0.25 * u[1];
    double direction[3];
    for (size_t k = 0; k < 3; k++) direction[k] = 2 * u[2 + k] - 1;
    const double scale = length / sqrt(qmat_dot(direction, direction));
    for (size_t c = 0; c < 4; c++)
      for (size_t k = 0; k < 3; k++)
        p[c][k] = u[5 + k] + (c < 3 ? 4 * width * (u[8 + 3 * c + k] - 0.5) : scale * direction[k]);
    for (size_t c = 0; c < 3; c++) qmat_subtract(p[c + 1], p[0], edges[c]);
    qmat_cross(edges[0], edges[1], normal);
    const bool turned = qmat_dot(normal, edges[2]) < 0;
    uint32_t ids[4];
    for (size_t c = 0; c < 4; c++) ids[c] = shape_vertex(mesh, p[c][0], p[c][1], p[c][2]);
    for (size_t f = 0; f < 4; f++)
      shape_triangle(mesh, ids[facets[f][0]], ids[facets[f][turned ? 2 : 1]], ids[facets[f][turned ? 1 : 2]]);
  }
}

/* Near their tips the samples of two edges represent those of the third, and the first samples of a round are farther
 * apart than spikes are wide. */
static void test_narrow_spikes_are_filled_to_their_tips(void **state) {
  (void)state;
  double farthest = 0, left = 0;
  for (uint64_t seed = 3; seed < 6; seed++) {
    qmat_mesh *mesh = qmat_mesh_new();
    add_spikes(mesh, 100, seed);
    pipeline p;
    pipeline_make(&p, mesh, "", "");
    qmat_value *outputs[PIPELINE_MOST_PORTS];
    must_refine(&p, 0, "epsilon=2%", outputs);
    const qmat_report *report = (const qmat_report *)outputs[REFINED_REPORT];
    farthest = fmax(farthest, pipeline_number(report, "farthest_place"));
    left = fmax(left, pipeline_number(report, "farthest_place_left"));
    release(outputs);
    pipeline_free(&p);
  }
  assert_true(farthest > 0.02);
  assert_true(left <= 0.02);
}

static void test_nothing_is_refined_where_the_mesh_itself_is_farther_than_epsilon(void **state) {
  (void)state;
  pipeline p;
  qmat_mesh *mesh = shape_box(3, 2, 1);
  mesh->deviation = 0.1;
  pipeline_make(&p, mesh, "", "");
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  must_refine(&p, 0, "epsilon=1%", outputs);
  assert_ptr_equal(outputs[REFINED_MEDIAL], &p.medial->base);
  release(outputs);
  pipeline_free(&p);
}

static void test_what_does_not_belong_together_is_named(void **state) {
  (void)state;
  pipeline p, other;
  pipeline_make(&p, shape_box(3, 2, 1), "", "");
  pipeline_make(&other, shape_sphere(1, 6), "", "");
  qmat_context context = {0};
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  pipeline mixed = p;
  mixed.thickness = other.thickness;
  assert_int_equal(refine(&mixed, "", &context, outputs), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, "thickness");
  mixed = p;
  mixed.samples = other.samples;
  assert_int_equal(refine(&mixed, "", &context, outputs), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, "samples");
  qmat_medial *none = qmat_medial_new();
  assert_int_equal(qmat_value_seal(&context, &none->base), QMAT_OK);
  mixed = p;
  mixed.medial = none;
  assert_int_equal(refine(&mixed, "", &context, outputs), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.field, "medial");
  qmat_value_release(&none->base);
  qmat_context_uninit(&context);
  pipeline_free(&p);
  pipeline_free(&other);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_cubes_inscribed_sphere_is_farthest_from_its_corners),
      cmocka_unit_test(test_what_is_near_enough_is_handed_on_as_it_is),
      cmocka_unit_test(test_without_epsilon_the_number_of_spheres_decides),
      cmocka_unit_test(test_more_samples_bring_a_coarse_solid_nearer),
      cmocka_unit_test(test_places_that_are_near_stay_as_they_were),
      cmocka_unit_test(test_a_coarse_solid_is_certified),
      cmocka_unit_test(test_places_without_solid_get_no_samples),
      cmocka_unit_test(test_a_cancelled_run_leaves_nothing),
      cmocka_unit_test(test_threads_do_not_change_a_byte),
      cmocka_unit_test(test_spheres_on_creases_stay_and_are_linked_again),
      cmocka_unit_test(test_the_first_samples_are_not_much_finer_than_those_around),
      cmocka_unit_test(test_narrow_spikes_are_filled_to_their_tips),
      cmocka_unit_test(test_nothing_is_refined_where_the_mesh_itself_is_farther_than_epsilon),
      cmocka_unit_test(test_what_does_not_belong_together_is_named),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
