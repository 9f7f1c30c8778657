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
  } cases[] = {{1, 0, 0.01, " (certified)"},
               {0, 0, 0.01, " (not certified)"},
               {0, 1, 0.01, " (an estimate: the surface is not closed)"},
               {0, 0, 0, ""}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char expected[512];
    snprintf(expected, sizeof expected,
             "x: 2 spheres describe 1,234 triangles%s\n"
             "surface to envelope 0.4 %%, envelope to surface 0.5 %% of the diagonal",
             cases[i].end);
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
                  "x: 1 sphere describes the model\n"
                  "surface to envelope 0.98 %, envelope outside of the solid 0 % of the diagonal");
}

static void test_lengths_stand_beside_percentages(void **state) {
  (void)state;
  assert_sentence(json_pack("{s:i, s:f, s:f, s:f, s:f, s:f, s:b}", "spheres", 3, "epsilon", 0.01, "surface_to_envelope",
                            0.005, "envelope_to_surface", 0.006, "surface_to_envelope_meters", 0.0048,
                            "envelope_to_surface_meters", 0.012, "certified", 1),
                  "x: 3 spheres describe the model (certified)\n"
                  "surface to envelope 0.5 % (4.8 mm), envelope to surface 0.6 % (12 mm)");
}

static void test_several_meshes_are_counted(void **state) {
  (void)state;
  static const char *const ends = "\nsurface to envelope 1 %, envelope outside of the solid 2 % of the mesh's diagonal";
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
      cmocka_unit_test(test_lengths_stand_beside_percentages),
      cmocka_unit_test(test_several_meshes_are_counted),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
