/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_write.h"

#include "io/usd/usd_medial.h"
#include "io/usd/usd_scene.h"
#include "tests/io/files.h"
#include "tests/io/medial_examples.h"
#include "tests/shapes.h"

/* A slab, an edge beside it, and a sphere alone. */
static qmat_medial *make_small(void) {
  static const double spheres[] = {0, 0, 0, 1, 4, 0, 0, 0.5, 0, 4, 0, 0.25, 0.1, 0.2, 5, 0, 1e-3, -7.5, 9, 2};
  return sealed_medial_mesh(spheres, 5, (const uint32_t[]){1, 3}, 1, (const uint32_t[]){0, 1, 2}, 1);
}

static qmat_file *must_write(const qmat_medial *medial, const qmat_mesh *skin, const qmat_usd_options *options) {
  qmat_context context = {0};
  qmat_file *file = NULL;
  if (qmat_usd_write(&context, medial, skin, options, &file) != QMAT_OK) fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
  return file;
}

static qmat_medial *read_back(const qmat_file *file, json_t *facts) {
  qmat_context context = {0};
  qmat_medial *medial = NULL;
  qmat_bytes bytes = memory_file(file->parts[0].bytes, file->parts[0].size);
  if (qmat_usd_read_medial(&context, &bytes, "file", NULL, &medial, facts) != QMAT_OK) {
    fail_msg("%s", context.error.message);
  }
  free(bytes.data);
  qmat_context_uninit(&context);
  return medial;
}

/* Equal but for the rounding that the file itself states. */
static void assert_same(const qmat_medial *written, const qmat_medial *read, double stated) {
  assert_int_equal(read->sphere_count, written->sphere_count);
  assert_int_equal(read->edge_count, written->edge_count);
  assert_int_equal(read->triangle_count, written->triangle_count);
  if (written->edge_count > 0) {
    assert_memory_equal(read->edges, written->edges, 2 * written->edge_count * sizeof(uint32_t));
  }
  if (written->triangle_count > 0) {
    assert_memory_equal(read->triangles, written->triangles, 3 * written->triangle_count * sizeof(uint32_t));
  }
  double most = 0;
  for (size_t i = 0; i < written->sphere_count; i++) {
    const double *a = written->spheres + 4 * i, *b = read->spheres + 4 * i;
    most =
        fmax(most, sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2])) +
                       fabs(a[3] - b[3]));
  }
  assert_near(most, stated, 0);
}

static void test_a_medial_mesh_comes_back_as_it_was_within_what_the_file_states(void **state) {
  (void)state;
  qmat_medial *cases[] = {make_small(), example_medial(1), example_medial(3), example_medial(200)};
  static const char *const formats[] = {"usda", "usdc", "usdz"};
  for (size_t i = 0; i < 12; i++) {
    const qmat_medial *medial = cases[i / 3];
    const qmat_usd_options options = {.form = (qmat_usd_form)(i % 3),
                                      .errors.epsilon = (double)NAN,
                                      .errors.error_out = 0.5,
                                      .errors.error_in = 0.25};
    qmat_file *file = must_write(medial, NULL, &options);
    assert_string_equal(file->format, formats[i % 3]);
    json_t *facts = json_object();
    qmat_medial *read = read_back(file, facts);
    assert_same(medial, read, json_number_value(json_object_get(facts, "qmat_quantisation")));
    assert_int_equal(json_integer_value(json_object_get(facts, "qmat_vertices")), (json_int_t)medial->sphere_count);
    assert_null(json_object_get(facts, "qmat_epsilon"));
    assert_null(json_object_get(facts, "qmat_certified"));
    assert_near(json_real_value(json_object_get(facts, "qmat_error_in")), 0.25, 0);
    assert_string_equal(json_string_value(json_object_get(facts, "qmat_error_unit")), "diagonal");
    json_decref(facts);
    qmat_value_release(&read->base);
    qmat_value_release(&file->base);
  }
  for (size_t i = 0; i < 4; i++) qmat_value_release(&cases[i]->base);
}

static void test_the_text_of_a_small_one_is_as_by_hand(void **state) {
  (void)state;
  static const double spheres[] = {0, 0, 0, 1, 4, 0, 0.1, 0.5};
  static const char expected[] =
      "#usda 1.0\n(\n    defaultPrim = \"_2_caf__s\"\n    doc = \"qmat " QMAT_VERSION
      "\"\n    metersPerUnit = 0.01\n"
      "    upAxis = \"Z\"\n)\n\ndef Xform \"_2_caf__s\" (\n    customData = {\n        string qmat_version = "
      "\"" QMAT_VERSION
      "\"\n        string qmat_name = \"2 caf\xC3\xA9\\\"s\"\n        int qmat_vertices = 2\n        int qmat_edges = "
      "1\n"
      "        int qmat_triangles = 0\n        double qmat_epsilon = 0.01\n        string qmat_error_unit = "
      "\"diagonal\"\n"
      "        bool qmat_certified = true\n        double qmat_quantisation = 1.4901161138336505e-09\n"
      "        string qmat_quantisation_unit = \"model\"\n        string qmat_frame = \"prim\"\n    }\n"
      "    kind = \"component\"\n)\n{\n    def Points \"spheres\"\n    {\n"
      "        float3[] extent = [(-1, -1, -1), (4.5, 1, 1)]\n"
      "        point3f[] points = [(0, 0, 0), (4, 0, 0.1)]\n        float[] primvars:radius = [1, 0.5] (\n"
      "            interpolation = \"vertex\"\n        )\n        float[] widths = [2, 1] (\n"
      "            interpolation = \"vertex\"\n        )\n        uniform token purpose = \"guide\"\n    }\n\n"
      "    def BasisCurves \"cones\"\n    {\n        int[] curveVertexCounts = [2]\n"
      "        float3[] extent = [(-1, -1, -1), (4.5, 1, 1)]\n"
      "        point3f[] points = [(0, 0, 0), (4, 0, 0.1)]\n        int[] primvars:qmat:sphere = [0, 1] (\n"
      "            interpolation = \"vertex\"\n        )\n        float[] primvars:radius = [1, 0.5] (\n"
      "            interpolation = \"vertex\"\n        )\n        float[] widths = [2, 1] (\n"
      "            interpolation = \"vertex\"\n        )\n        uniform token type = \"linear\"\n"
      "        uniform token purpose = \"guide\"\n    }\n}\n";
  qmat_medial *medial = sealed_medial_mesh(spheres, 2, (const uint32_t[]){0, 1}, 1, NULL, 0);
  const qmat_usd_options options = {.name = "2 caf\xC3\xA9\"s",
                                    .meters_per_unit = 0.01,
                                    .is_z_up = true,
                                    .errors.epsilon = 0.01,
                                    .errors.error_out = (double)NAN,
                                    .errors.error_in = (double)NAN,
                                    .errors.certified = QMAT_CERTIFICATE_YES};
  qmat_file *file = must_write(medial, NULL, &options);
  char *text = calloc(file->parts[0].size + 1, 1);
  assert_non_null(text);
  memcpy(text, file->parts[0].bytes, file->parts[0].size);
  assert_string_equal(text, expected);
  free(text);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
}

static void test_a_scene_reader_sees_the_skin_only(void **state) {
  (void)state;
  qmat_medial *medial = make_small();
  qmat_mesh *box = shape_seal(shape_box(1, 2, 3));
  for (int package = 0; package < 2; package++) {
    const qmat_usd_options options = {.form = package ? QMAT_USD_PACKAGE : QMAT_USD_TEXT};
    qmat_file *file = must_write(medial, box, &options);
    qmat_context context = {0};
    qmat_soup soup = {0};
    json_t *report = json_object();
    qmat_bytes bytes = memory_file(file->parts[0].bytes, file->parts[0].size);
    assert_int_equal(qmat_usd_read(&context, &bytes, "file", &soup, report), QMAT_OK);
    assert_int_equal(soup.vertex_count, 8);
    assert_int_equal(soup.facet_count, 12);
    assert_positions(soup.positions, box->positions, 24);
    assert_int_equal(json_array_size(json_object_get(report, "warnings")), 0);
    assert_true(json_real_value(json_object_get(report, "meters_per_unit")) == 1);
    json_decref(report);
    free(bytes.data);
    qmat_soup_uninit(&soup);
    qmat_value_release(&file->base);
    qmat_context_uninit(&context);
  }
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

static void test_what_single_precision_cannot_hold_is_refused_by_its_element(void **state) {
  (void)state;
  static const double spheres[] = {0, 0, 0, 1, 0, 1e39, 0, 1};
  qmat_medial *medial = sealed_medial_mesh(spheres, 2, NULL, 0, NULL, 0);
  qmat_context context = {0};
  qmat_file *file;
  const qmat_usd_options options = {0};
  assert_int_equal(qmat_usd_write(&context, medial, NULL, &options, &file), QMAT_ERROR_GEOMETRY);
  assert_null(file);
  assert_string_equal(context.error.message, "1e+39 does not fit into single precision");
  assert_int_equal(context.error.element, 1);
  /* The diameter and the box do not fit either. */
  medial->spheres[5] = 0;
  medial->spheres[7] = 2e38;
  assert_int_equal(qmat_usd_write(&context, medial, NULL, &options, &file), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.message, "2e+38 does not fit into single precision");
  medial->spheres[4] = -3e38;
  medial->spheres[7] = 1e38;
  assert_int_equal(qmat_usd_write(&context, medial, NULL, &options, &file), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.message, "-3e+38 does not fit into single precision");
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_broken_medial_meshes_are_errors_that_name_the_prim(void **state) {
  (void)state;
#define CARRIER(content) \
  "#usda 1.0\ndef \"a\" { def Xform \"m\" ( customData = { string qmat_version = \"1\" } ) {" content "} }"
#define SPHERES "def Points \"spheres\" { point3f[] points = [(0, 0, 0)] float[] primvars:radius = [1] }\n"
  static const char *const cases[][2] = {
      {"#usda 1.0\ndef \"a\" {}", "no prim has a medial mesh"},
      {CARRIER(""), "/a/m: the prim has qmat_version in its customData, but no child 'spheres'"},
      {CARRIER("def Points \"spheres\" { point3f[] points = [(0, 0, 0)] float[] primvars:radius = [1, 2] }"),
       "/a/m/spheres: points and primvars:radius do not match"},
      {CARRIER(SPHERES "def BasisCurves \"cones\" { int[] primvars:qmat:sphere = [0, 1] }"),
       "/a/m/cones: primvars:qmat:sphere refers to sphere 1, but there are 1"},
      {CARRIER(SPHERES "def BasisCurves \"cones\" { int[] primvars:qmat:sphere = [0] }"),
       "/a/m/cones: primvars:qmat:sphere must be an array of integers, 2 for each simplex"},
      {CARRIER(SPHERES "def BasisCurves \"cones\" { int2[] primvars:qmat:sphere = [(0, 0), (0, 0)] }"),
       "/a/m/cones: primvars:qmat:sphere must be an array of integers, 2 for each simplex"},
      {CARRIER(SPHERES) "def \"b\" ( references = </a/m> ) {}", "2 prims have a medial mesh: name one of them"},
      {CARRIER(SPHERES "def Mesh \"slabs\" {}"),
       "/a/m/slabs: faceVertexIndices must be an array of integers, 3 for each simplex"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    qmat_context context = {0};
    qmat_medial *medial;
    qmat_bytes bytes = memory_file(cases[i][0], strlen(cases[i][0]));
    assert_int_not_equal(qmat_usd_read_medial(&context, &bytes, "file", NULL, &medial, NULL), QMAT_OK);
    assert_null(medial);
    assert_string_equal(context.error.message, cases[i][1]);
    assert_string_equal(context.error.file, "file");
    free(bytes.data);
    qmat_context_uninit(&context);
  }
}

/* The number of spheres of the medial mesh that is called so; with 0 the error's message and hint are as expected. */
static size_t spheres_of(const char *text, const char *name, json_t *facts, const char *message, const char *hint) {
  qmat_context context = {0};
  qmat_medial *medial;
  qmat_bytes bytes = memory_file(text, strlen(text));
  size_t count = 0;
  if (qmat_usd_read_medial(&context, &bytes, "file", name, &medial, facts) == QMAT_OK) {
    count = medial->sphere_count;
    qmat_value_release(&medial->base);
  } else {
    assert_string_equal(context.error.message, message ? message : "");
    assert_string_equal(context.error.hint, hint ? hint : "");
  }
  free(bytes.data);
  qmat_context_uninit(&context);
  return count;
}

/* Two layers were written over two scenes, and each calls its medial mesh medial_0. */
#define MEDIAL(name, prim, points, radii)                                                            \
  "class Xform \"" name "\" ( customData = { string qmat_version = \"1\" string qmat_prim = \"" prim \
  "\" } ) { def Points \"spheres\" { point3f[] points = [" points "] float[] primvars:radius = [" radii "] } }\n"
static const char two_assets[] =
    "#usda 1.0\nclass \"lib\" ( active = false ) {\n" MEDIAL("one", "/old/Q", "(0, 0, 0)", "1")
        MEDIAL("two", "/old/P", "(0, 0, 0), (1, 0, 0)", "1, 1") "}\n"
    "def \"R\" {\ndef \"render\" {\ndef \"Q\" { def \"medial_0\" ( references = </lib/one> ) {} }\n"
    "def \"again\" { def \"medial_0\" ( references = </lib/one> ) {} }\n}\n"
    "def \"P\" { def \"medial_0\" ( references = </lib/two> ) {} }\n"
    "def \"off\" { def \"medial_0\" ( references = </lib/two>\nactive = false ) {} }\n}\n";

static void test_a_medial_mesh_is_named_by_the_path_of_a_prim(void **state) {
  (void)state;
  static const struct {
    const char *name;
    size_t spheres;
  } cases[] = {{"medial_0", 1}, {"/R/P/medial_0", 2}, {"/R/render/Q", 1}, {"render/Q", 1},   {"Q", 1},
               {"again", 1},    {"/R/P", 2},          {"P", 2},           {"P/medial_0", 2}, {"Q/medial_0", 1}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_int_equal(spheres_of(two_assets, cases[i].name, NULL, NULL, NULL), cases[i].spheres);
  static const char hint[] = "--node with a name or the path of a prim: medial_0 of /R/render/Q, /R/P/medial_0 of /R/P";
  assert_int_equal(spheres_of(two_assets, NULL, NULL, "2 prims have a medial mesh: name one of them", hint), 0);
  static const char *const none[] = {"off", "R", "nder/Q", "/R", ""};
  for (size_t i = 0; i < sizeof none / sizeof *none; i++)
    assert_int_equal(spheres_of(two_assets, none[i], NULL, "no prim of this name has a medial mesh", hint), 0);
}

/* A stage that refers to another one does not have the prim that the medial mesh was made for, but its own. */
static void test_facts_name_the_prim_of_this_stage(void **state) {
  (void)state;
  json_t *facts = json_object();
  assert_int_equal(spheres_of(two_assets, "P", facts, NULL, NULL), 2);
  assert_string_equal(json_string_value(json_object_get(facts, "qmat_prim")), "/old/P");
  assert_string_equal(json_string_value(json_object_get(facts, "composed_prim")), "/R/P");
  json_object_clear(facts);
  assert_int_equal(spheres_of(two_assets, "again", facts, NULL, NULL), 1);
  assert_string_equal(json_string_value(json_object_get(facts, "composed_prim")), "/R/render/again");
  json_object_clear(facts);
  assert_int_equal(spheres_of("#usda 1.0\n" MEDIAL("m", "/a", "(0, 0, 0)", "1") "def \"a\" { def \"m\" ( references = "
                                                                                "</m> ) {} }\n",
                              NULL, facts, NULL, NULL),
                   1);
  assert_null(json_object_get(facts, "composed_prim"));
  json_decref(facts);
}

static void test_facts_keep_whole_numbers_and_skip_what_json_has_not(void **state) {
  (void)state;
  static const char text[] =
      "#usda 1.0\ndef Xform \"m\" ( customData = { string qmat_version = \"1\" int64 large = 9223372036854775807 "
      "double none = nan int[] array = [1] int2 pair = (1, 2) bool yes = true string \"\\xff\" = \"x\" "
      "string bad = \"\\xff\" } ) {" SPHERES "}";
  qmat_context context = {0};
  qmat_medial *medial;
  json_t *facts = json_object();
  qmat_bytes bytes = memory_file(text, strlen(text));
  assert_int_equal(qmat_usd_read_medial(&context, &bytes, "file", NULL, &medial, facts), QMAT_OK);
  assert_int_equal(json_object_size(facts), 3);
  assert_string_equal(json_string_value(json_object_get(facts, "qmat_version")), "1");
  assert_int_equal(json_integer_value(json_object_get(facts, "large")), INT64_MAX);
  assert_true(json_is_true(json_object_get(facts, "yes")));
  json_decref(facts);
  qmat_value_release(&medial->base);
  free(bytes.data);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_medial_mesh_comes_back_as_it_was_within_what_the_file_states),
      cmocka_unit_test(test_the_text_of_a_small_one_is_as_by_hand),
      cmocka_unit_test(test_a_scene_reader_sees_the_skin_only),
      cmocka_unit_test(test_what_single_precision_cannot_hold_is_refused_by_its_element),
      cmocka_unit_test(test_broken_medial_meshes_are_errors_that_name_the_prim),
      cmocka_unit_test(test_a_medial_mesh_is_named_by_the_path_of_a_prim),
      cmocka_unit_test(test_facts_name_the_prim_of_this_stage),
      cmocka_unit_test(test_facts_keep_whole_numbers_and_skip_what_json_has_not),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
