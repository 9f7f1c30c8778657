/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_decimate.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/medial_meshes.h"
#include "tests/shapes.h"

/* Goes on until triangles are measured. */
static bool on_progress(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                        const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total;
  const bool *is_stopped = user;
  return !*is_stopped || strcmp(unit, "measured triangles") != 0;
}

/* The skin of a ball is within the error, and measuring it can be cancelled. */
static void test_a_ball_has_fewer_triangles_unless_cancelled(void **state) {
  (void)state;
  static const double ball[] = {0, 0, 0, 0.5};
  static const double error = 0.01;
  for (int stopped = 0; stopped < 2; stopped++) {
    bool is_stopped = stopped;
    qmat_context context = {.progress = on_progress, .progress_user = &is_stopped};
    qmat_mesh *sphere = shape_sphere(0.5, 48);
    qmat_skin_triangles surface = {sphere->vertex_count, sphere->triangle_count, sphere->positions, sphere->triangles};
    sphere->positions = NULL;
    sphere->triangles = NULL;
    const size_t before = surface.triangle_count;
    qmat_medial *medial = sealed_medial_mesh(ball, 1, NULL, 0, NULL, 0);
    qmat_envelope *envelope;
    assert_int_equal(qmat_envelope_of_medial(&context, medial, &envelope), QMAT_OK);
    qmat_skin_errors errors;
    const qmat_status status = qmat_skin_decimate(&context, envelope, error, 0, &surface, &errors);
    assert_int_equal(status, stopped ? QMAT_CANCELLED : QMAT_OK);
    if (!stopped) {
      assert_true(surface.triangle_count < before / 2);
      assert_true(errors.to_envelope > 0 && errors.to_envelope <= error);
    }
    qmat_envelope_free(envelope);
    qmat_free(surface.positions);
    qmat_free(surface.triangles);
    qmat_value_release(&medial->base);
    qmat_value_release(&sphere->base);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_a_ball_has_fewer_triangles_unless_cancelled)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
