/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/descriptor/medial_summary.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void assert_sentence(json_t *summary, const char *expected) {
  char text[512];
  assert_non_null(summary);
  qmat_medial_summary.sentence("x", summary, text, sizeof text);
  assert_string_equal(text, expected);
  json_decref(summary);
}

static void test_the_sentence_states_what_is_certified(void **state) {
  (void)state;
  static const struct {
    int certified, estimate;
    double epsilon;
    const char *end;
  } cases[] = {{1, 0, 0.01, "(certified)."},
               {0, 0, 0.01, "(not certified)."},
               {0, 1, 0.01, "(an estimate: the surface is not closed)."},
               {0, 0, 0, "from the surface."}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char expected[512];
    snprintf(expected, sizeof expected,
             "x: 2 spheres describe 1,234 triangles; no surface point is farther than 0.4 %% of the diagonal from the "
             "envelope, and no point of its boundary is farther than 0.5 %% from the surface%s%s",
             i == 3 ? "" : " ", i == 3 ? "." : cases[i].end);
    assert_sentence(json_pack("{s:i, s:i, s:f, s:f, s:f, s:b, s:b}", "spheres", 2, "triangles", 1234, "epsilon",
                              cases[i].epsilon, "surface_to_envelope", 0.004, "envelope_to_surface", 0.005, "certified",
                              cases[i].certified, "estimate", cases[i].estimate),
                    expected);
  }
}

static void test_without_a_certificate_only_the_outside_of_the_solid_is_bounded(void **state) {
  (void)state;
  assert_sentence(json_pack("{s:i, s:f, s:f, s:f}", "spheres", 1, "epsilon", 0.01, "surface_to_envelope", 0.00977,
                            "envelope_to_surface", 0.0),
                  "x: 1 sphere describes the model; no surface point is farther than 0.98 % of the diagonal from the "
                  "envelope, and the envelope leaves the solid by at most 0 %.");
}

static void test_several_meshes_are_counted(void **state) {
  (void)state;
  static const char *const ends =
      "; no surface point is farther than 1 % of the mesh's diagonal from the envelope, and "
      "the envelope leaves the solid by at most 2 %.";
  char expected[512];
  snprintf(expected, sizeof expected, "x: 7 spheres describe 90 triangles of 3 meshes%s", ends);
  json_t *summary = json_pack("{s:i, s:i, s:i, s:f, s:f}", "spheres", 7, "triangles", 90, "meshes", 3,
                              "surface_to_envelope", 0.01, "envelope_to_surface", 0.02);
  assert_sentence(json_incref(summary), expected);
  json_object_set_new(summary, "failures", json_integer(1));
  snprintf(expected, sizeof expected, "x: 7 spheres describe 3 of the 4 meshes of 90 triangles%s", ends);
  assert_sentence(summary, expected);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_the_sentence_states_what_is_certified),
      cmocka_unit_test(test_without_a_certificate_only_the_outside_of_the_solid_is_bounded),
      cmocka_unit_test(test_several_meshes_are_counted),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
