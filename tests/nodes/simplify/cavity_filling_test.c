/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/cavity_filling.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_build.h"
#include "nodes/measure/envelope_to_surface.h"
#include "nodes/measure/medial_errors.h"
#include "nodes/simplify/collapse_chain.h"
#include "tests/nodes/pipeline.h"

/* A bar of 3 x 1 x 1 with a medial sphere near each end, and its unit frame's scale. */
typedef struct {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
  qmat_medial *medial;
  double scale;
} bar;

static const double epsilon = 0.01;

static void make_bar(bar *b, bool joined) {
  *b = (bar){.mesh = shape_seal(shape_box(3, 1, 1)), .medial = qmat_medial_new(), .scale = 1 / sqrt(11.0)};
  assert_int_equal(qmat_surface_new(&b->context, b->mesh, &b->surface), QMAT_OK);
  qmat_medial *m = b->medial;
  m->sphere_count = 2;
  m->spheres = qmat_calloc(2, 4 * sizeof *m->spheres);
  m->spheres[0] = -b->scale;
  m->spheres[4] = b->scale;
  m->spheres[3] = m->spheres[7] = 0.5 * b->scale;
  static const uint32_t edge[2] = {0, 1}, owners[3] = {0, 1, 1};
  assert_int_equal(qmat_medial_set_simplices(&b->context, m, joined ? edge : NULL, joined, NULL, 0), QMAT_OK);
  assert_int_equal(qmat_medial_set_regions(&b->context, owners, 3, m), QMAT_OK);
}

static void free_bar(bar *b) {
  qmat_value_release(&b->medial->base);
  qmat_surface_free(b->surface);
  qmat_value_release(&b->mesh->base);
  qmat_context_uninit(&b->context);
}

static size_t fill(bar *b, const double *places, size_t count) {
  size_t added = 99;
  assert_int_equal(qmat_cavities_fill(&b->context, b->surface, places, count, epsilon, b->medial, &added), QMAT_OK);
  return added;
}

static void test_the_middle_of_a_bar_by_hand(void **state) {
  (void)state;
  bar b;
  make_bar(&b, false);
  /* A second place within the first one's sphere needs none of its own. */
  const double places[6] = {0.01, 0, 0, 0.005, 0, 0};
  assert_int_equal(fill(&b, places, 2), 1);
  const qmat_medial *m = b.medial;
  assert_int_equal(m->sphere_count, 3);
  assert_near(m->spheres[8], 0.01, 1e-15);
  assert_near(m->spheres[11], 0.5 * b.scale + 0.9 * epsilon, 1e-12);
  /* The cone to the nearer end leaves the bar most at the new sphere. */
  const double *const ends[2] = {&m->spheres[4], &m->spheres[8]};
  assert_near(qmat_envelope_to_surface_bound(b.surface, ends, 2, 0, 1e-6), 0.9 * epsilon, 1e-6);
  assert_int_equal(m->edge_count, 1);
  assert_int_equal(m->edges[0], 1);
  assert_int_equal(m->edges[1], 2);
  assert_int_equal(m->region_offset_count, 4);
  assert_int_equal(m->region_offsets[2], 3);
  assert_int_equal(m->region_offsets[3], 3);
  free_bar(&b);
}

static void test_places_that_nothing_fits_are_left(void **state) {
  (void)state;
  bar b;
  make_bar(&b, true);
  const double outside[3] = {0, 0.3, 0};
  assert_int_equal(fill(&b, outside, 1), 0);
  assert_int_equal(fill(&b, NULL, 0), 0);
  assert_int_equal(b.medial->sphere_count, 2);
  assert_int_equal(b.medial->edge_count, 1);
  free_bar(&b);
  /* From one arm of an L around its corner no straight cone keeps inside. */
  qmat_context context = {0};
  qmat_mesh *mesh = shape_seal(shape_l());
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  qmat_medial *medial = qmat_medial_new();
  medial->sphere_count = 1;
  medial->spheres = qmat_calloc(1, 4 * sizeof *medial->spheres);
  double place[4] = {0.3, 1.9, 0.5, 0.1};
  memcpy(medial->spheres, (const double[4]){1.9, 0.3, 0.5, 0.1}, 4 * sizeof(double));
  qmat_frame_spheres_to_unit(qmat_surface_frame(surface), medial->spheres, 1, medial->spheres);
  qmat_frame_spheres_to_unit(qmat_surface_frame(surface), place, 1, place);
  assert_int_equal(qmat_medial_set_simplices(&context, medial, NULL, 0, NULL, 0), QMAT_OK);
  size_t added;
  assert_true(-qmat_surface_signed_distance(surface, place) > 0);
  assert_int_equal(qmat_cavities_fill(&context, surface, place, 1, epsilon, medial, &added), QMAT_OK);
  assert_int_equal(added, 0);
  assert_int_equal(medial->sphere_count, 1);
  qmat_value_release(&medial->base);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

/* The uncovered corners of a bar are filled in a few steps, within epsilon. */
static void test_cavities_are_found_and_filled(void **state) {
  (void)state;
  bar b;
  make_bar(&b, false);
  qmat_medial_errors errors = {.surface_to_envelope = 0};
  const double wide = 0.1; /* what the corners of the bar need */
  assert_int_equal(qmat_medial_boundary_measure(&b.context, b.surface, b.medial, wide, false, &errors), QMAT_OK);
  assert_true(errors.uncovered_count > 0);
  assert_true(errors.boundary_to_surface > wide);
  for (int i = 0; i < 8 && errors.uncovered_count > 0; i++) {
    size_t added;
    assert_int_equal(
        qmat_cavities_fill(&b.context, b.surface, errors.uncovered, errors.uncovered_count, wide, b.medial, &added),
        QMAT_OK);
    assert_true(added > 0);
    qmat_medial_errors_uninit(&errors);
    assert_int_equal(qmat_medial_boundary_measure(&b.context, b.surface, b.medial, wide, false, &errors), QMAT_OK);
  }
  assert_int_equal(errors.uncovered_count, 0);
  assert_true(errors.boundary_to_surface <= wide);
  for (size_t e = 0; e < b.medial->edge_count; e++) {
    const double *const ends[2] = {&b.medial->spheres[4 * (size_t)b.medial->edges[2 * e]],
                                   &b.medial->spheres[4 * (size_t)b.medial->edges[2 * e + 1]]};
    assert_true(qmat_envelope_to_surface_bound(b.surface, ends, 2, 0, 1e-5) <= wide + 1e-5);
  }
  qmat_medial_errors_uninit(&errors);
  free_bar(&b);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_middle_of_a_bar_by_hand),
      cmocka_unit_test(test_places_that_nothing_fits_are_left),
      cmocka_unit_test(test_cavities_are_found_and_filled),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
