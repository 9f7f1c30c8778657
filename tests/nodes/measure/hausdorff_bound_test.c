/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/hausdorff_bound.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/shapes.h"

/* A cube with sides of 2 around two spheres of radius 0.2 on the x-axis. The farthest points lie on edges of the cube,
 * where both are equally near, at x = 0.15. Lengths are those of the cube; the measurement is in the unit frame. */
static qmat_hausdorff_bound measure(double tolerance, double threshold, double decisive) {
  qmat_context context = {.threads = 1};
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, -1, -1, -1, 1, 1, 1, false);
  shape_seal(mesh);
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  const qmat_frame *frame = qmat_surface_frame(surface);
  double spheres[2][4] = {{-0.65, 0, 0, 0.2}, {0.95, 0, 0, 0.2}};
  qmat_frame_spheres_to_unit(frame, spheres[0], 2, spheres[0]);
  qmat_envelope *envelope;
  assert_int_equal(qmat_envelope_new(&context, spheres[0], 2, NULL, 0, NULL, 0, &envelope), QMAT_OK);
  qmat_hausdorff_bound bound;
  const double scale = frame->diagonal;
  assert_int_equal(qmat_hausdorff_bound_measure(&context, surface, envelope, 0, tolerance / scale, threshold / scale,
                                                decisive / scale, &bound),
                   QMAT_OK);
  for (size_t i = 0; i < bound.count; i++)
    assert_true(qmat_envelope_distance(envelope, &bound.points[3 * i], NULL) >= (threshold - tolerance) / scale);
  bound.bound *= scale;
  bound.found *= scale;
  qmat_envelope_free(envelope);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  return bound;
}

static double farthest(void) {
  return sqrt(0.8 * 0.8 + 2) - 0.2;
}

static void check(const qmat_hausdorff_bound *b, double tolerance) {
  assert_true(b->found <= farthest() + 1e-9 && b->bound >= farthest() - 1e-9);
  assert_true(b->bound - b->found <= tolerance + 1e-9);
}

static void test_the_largest_distance_lies_between_the_bounds(void **state) {
  (void)state;
  static const double tolerances[] = {0.5, 0.1, 0.01, 0.001};
  for (size_t i = 0; i < 4; i++) {
    const qmat_hausdorff_bound b = measure(tolerances[i], INFINITY, INFINITY);
    check(&b, tolerances[i]);
  }
}

/* A coarse bound becomes finer where that proves that the distance is below a limit, and only there. */
static void test_the_bound_is_finer_where_that_decides(void **state) {
  (void)state;
  const double tolerance = 0.1, limit = farthest() + 0.001;
  assert_true(measure(tolerance, INFINITY, INFINITY).bound > limit);
  const qmat_hausdorff_bound decided = measure(tolerance, INFINITY, limit);
  check(&decided, tolerance);
  assert_true(decided.bound <= limit);
  const qmat_hausdorff_bound beyond = measure(tolerance, INFINITY, farthest() - 0.1);
  check(&beyond, tolerance);
  assert_true(beyond.bound > farthest() - 0.1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_largest_distance_lies_between_the_bounds),
      cmocka_unit_test(test_the_bound_is_finer_where_that_decides),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
