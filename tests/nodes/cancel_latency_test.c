/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Nodes that work for seconds ask often whether to go on: a run that is cancelled ends within half a second of
 * processor time. A sanitizer would be what is measured, so builds with one leave these tests out. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/cpu_time.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"

static const double MOST_SECONDS = 0.5;

/* The processor time between the calls of a progress function. */
typedef struct gaps {
  double last, longest;
} gaps;

static void note_gap(gaps *between) {
  const double now = cpu_time();
  if (between->last > 0 && now - between->last > between->longest) between->longest = now - between->last;
  between->last = now;
}

static bool on_progress(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                        const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total, (void)unit;
  note_gap(user);
  return true;
}

/* Runs a node on one thread. */
static void must_ask_often(const char *name, const char *text, const qmat_value *const inputs[]) {
  gaps between = {0};
  qmat_context context = {.threads = 1, .progress = on_progress, .progress_user = &between};
  qmat_value *outputs[PIPELINE_MOST_PORTS];
  note_gap(&between);
  assert_int_equal(pipeline_run(&context, name, text, inputs, outputs), QMAT_OK);
  note_gap(&between);
  pipeline_release(name, outputs);
  qmat_context_uninit(&context);
  if (!(between.longest <= MOST_SECONDS)) fail_msg("%s cannot be cancelled for %.2f s", name, between.longest);
}

static void test_erosion_thickness(void **state) {
  (void)state;
  pipeline p;
  pipeline_make(&p, pipeline_model("octopus", 24), "spacing=0.5%", "thinning_tolerance=0");
  must_ask_often("medial.erosion_thickness", "prune=1%", (const qmat_value *[]){&p.mesh->base, &p.medial->base});
  pipeline_free(&p);
}

/* 118 thousand samples. */
static void test_poles_and_scale_axis(void **state) {
  (void)state;
  pipeline p;
  pipeline_sample(&p, pipeline_model("octopus", 48), "spacing=0.29%");
  const qmat_value *inputs[] = {&p.mesh->base, &p.samples->base};
  must_ask_often("medial.poles", "", inputs);
  must_ask_often("medial.scale_axis", "", inputs);
  pipeline_free(&p);
}

static void test_voxel_cores(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(2, 0.6, 48, 24));
  must_ask_often("medial.voxel_cores", "depth=9", (const qmat_value *[]){&mesh->base});
  qmat_value_release(&mesh->base);
}

/* One hull around some ten thousand vertices, all of them extreme. */
static void test_colliders_of_a_dense_convex_model(void **state) {
  (void)state;
  static const double ball[4] = {0, 0, 0, 1};
  qmat_mesh *mesh = shape_seal(shape_sphere(1, 71));
  qmat_medial *medial = sealed_medial_mesh(ball, 1, NULL, 0, NULL, 0);
  must_ask_often("medial.colliders", "kind=hulls", (const qmat_value *[]){&mesh->base, &medial->base});
  qmat_value_release(&mesh->base);
  qmat_value_release(&medial->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_erosion_thickness),
      cmocka_unit_test(test_poles_and_scale_axis),
      cmocka_unit_test(test_voxel_cores),
      cmocka_unit_test(test_colliders_of_a_dense_convex_model),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
