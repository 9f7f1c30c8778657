/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/boundary_distance.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/geometry/vector.h"
#include "nodes/measure/boundary_pieces.h"
#include "tests/shapes.h"

/* A sphere of radius 0.1 in a cube with sides of 2: all of it is 0.9 or more from the cube, most towards the cube's
 * corners. A sphere of radius 0.45 in a box of 4 by 1 by 1: only its ends along the box are farther than 0.42
 * from the box, up to 0.5. */
static const double spheres[2][4] = {{-3, 0, 0, 0.1}, {3, 0, 0, 0.45}};

static double farthest(void) {
  return 1 - 0.1 / sqrt(3);
}

typedef struct measured {
  double lo, hi;
  size_t near[2]; /* places within 0.01 of each sphere */
  size_t other;
} measured;

/* Lengths are those of the box; the measurement is in the unit frame. */
static measured measure(double epsilon, bool only_places, int threads) {
  qmat_context context = {.threads = threads};
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, -4, -1, -1, -2, 1, 1, false);
  shape_add_box(mesh, 1, -0.5, -0.5, 5, 0.5, 0.5, false);
  shape_seal(mesh);
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  const qmat_frame *frame = qmat_surface_frame(surface);
  qmat_medial *unit = qmat_medial_new();
  assert_non_null(unit);
  unit->spheres = qmat_alloc(2, 4 * sizeof *unit->spheres);
  assert_non_null(unit->spheres);
  unit->sphere_count = 2;
  qmat_frame_spheres_to_unit(frame, spheres[0], 2, unit->spheres);
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_new(&context, unit->spheres, 2, NULL, 0, NULL, 0, &envelope), QMAT_OK);
  const double scale = frame->diagonal;
  qmat_boundary_distance found;
  assert_int_equal(
      qmat_boundary_distance_measure(
          &context, surface, envelope, unit,
          &(qmat_boundary_request){.epsilon = epsilon / scale, .tolerance = 0.1, .only_places = only_places}, &found),
      QMAT_OK);
  measured result = {.lo = found.either_side.lo * scale, .hi = found.either_side.hi * scale};
  for (size_t i = 0; i < found.far_count; i++) {
    const double *place = &found.far_points[3 * i];
    int at = -1;
    for (int k = 0; k < 2; k++)
      if (fabs(qmat_point_distance(place, &unit->spheres[4 * k]) - unit->spheres[4 * k + 3]) * scale < 0.01) at = k;
    if (at < 0)
      result.other++;
    else
      result.near[at]++;
    assert_true(qmat_surface_distance(surface, place, INFINITY, NULL, NULL) * scale > epsilon);
  }
  qmat_boundary_distance_uninit(&found);
  qmat_envelope_free(envelope);
  qmat_value_release(&unit->base);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  return result;
}

static void test_the_largest_distance_lies_between_the_bounds(void **state) {
  (void)state;
  const measured m = measure(0.42, false, 1);
  assert_true(m.lo <= farthest() + 1e-6 && m.hi >= farthest() - 1e-6);
  assert_true(m.hi - m.lo <= 0.1 * farthest() + 1e-6);
}

/* A search for places goes on after the first one, and finds those of each sphere. A piece with one is not split. */
static void test_places_beyond_epsilon_are_found_everywhere(void **state) {
  (void)state;
  const measured m = measure(0.42, true, 1);
  assert_true(m.hi == INFINITY);
  assert_true(m.near[0] > 0 && m.near[0] <= QMAT_MOST_PIECES);
  assert_true(m.near[1] > 0);
  assert_int_equal(m.other, 0);
  const measured again = measure(0.42, true, 8);
  assert_int_equal(again.near[0], m.near[0]);
  assert_int_equal(again.near[1], m.near[1]);
}

/* Where there is no such place, the search proves it. */
static void test_a_search_without_places_proves_the_bound(void **state) {
  (void)state;
  const measured m = measure(0.96, true, 1);
  assert_int_equal(m.near[0] + m.near[1] + m.other, 0);
  assert_true(m.hi <= 0.96 && m.hi >= farthest() - 1e-6);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_largest_distance_lies_between_the_bounds),
      cmocka_unit_test(test_places_beyond_epsilon_are_found_everywhere),
      cmocka_unit_test(test_a_search_without_places_proves_the_bound),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
