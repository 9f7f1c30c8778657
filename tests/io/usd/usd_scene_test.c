/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_scene.h"

#include <sys/stat.h>
#include <time.h>

#include "io/usd/usdz.h"
#include "tests/io/files.h"

#define DATA "../shared/data/usd/"

/* A right triangle in the plane z = 0, and what is needed around it. */
#define TRIANGLE                                                                         \
  "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\nint[] faceVertexCounts = [3]\n" \
  "int[] faceVertexIndices = [0, 1, 2]\nuniform token subdivisionScheme = \"none\"\n"
#define MESH(name, more) "def Mesh \"" name "\" {\n" TRIANGLE more "}\n"

static char folder[64];

static int set_up(void **state) {
  (void)state;
  make_folder(folder);
  return 0;
}

static int tear_down(void **state) {
  (void)state;
  return rmdir(folder);
}

static const char *in_folder(const char *name) {
  static char path[256];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  return path;
}

static qmat_status read_text(qmat_context *context, const char *text, qmat_soup *soup, json_t *report) {
  qmat_bytes bytes = memory_file(text, strlen(text));
  *soup = (qmat_soup){0};
  qmat_status status = qmat_usd_read(context, &bytes, in_folder("main.usda"), soup, report);
  free(bytes.data);
  return status;
}

/* Reads a scene that must be good. The report is the caller's. */
static qmat_soup good_scene(const char *text, json_t **report) {
  qmat_context context = {0};
  qmat_soup soup;
  *report = json_object();
  if (read_text(&context, text, &soup, *report) != QMAT_OK) {
    char line[1024];
    qmat_error_format(&context.error, line, sizeof line);
    fail_msg("%s", line);
  }
  qmat_context_uninit(&context);
  return soup;
}

static void assert_points(const char *text, const double *expected, size_t count) {
  json_t *report;
  qmat_soup soup = good_scene(text, &report);
  assert_int_equal(soup.vertex_count, count);
  for (size_t i = 0; i < 3 * count; i++) {
    if (fabs(soup.positions[i] - expected[i]) > 1e-12) {
      fail_msg("coordinate %zu is %.17g, not %.17g", i, soup.positions[i], expected[i]);
    }
  }
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static json_int_t count_of(const json_t *report, const char *key) {
  return json_integer_value(json_object_get(report, key));
}

static const char *warning_of(const json_t *report, size_t i) {
  const char *text = json_string_value(json_array_get(json_object_get(report, "warnings"), i));
  return text ? text : "";
}

/* The error of a scene that must be refused, without the path of its file. */
static void assert_scene_refused(const char *text, qmat_status expected_status, const char *expected) {
  qmat_context context = {0};
  qmat_soup soup;
  assert_int_equal(read_text(&context, text, &soup, NULL), expected_status);
  assert_string_equal(context.error.message, expected);
  assert_string_equal(context.error.file, in_folder("main.usda"));
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
}

/* What becomes of the point (1, 2, 3) under operations at one prim. */
static void assert_moves(const char *operations, const char *order, double x, double y, double z) {
  char text[2048];
  snprintf(
      text, sizeof text,
      "#usda 1.0\ndef Xform \"w\" { double3 xformOp:translate = (100, 0, 0)\n uniform token[] xformOpOrder = "
      "[\"xformOp:translate\"]\ndef Mesh \"m\" {\n point3f[] points = [(1, 2, 3), (0, 0, 0), (0, 1, 0)]\n"
      "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n%s\nuniform token[] xformOpOrder = [%s]\n"
      "uniform token subdivisionScheme = \"none\" } }",
      operations, order);
  json_t *report;
  qmat_soup soup = good_scene(text, &report);
  const double expected[3] = {x, y, z};
  for (int k = 0; k < 3; k++) {
    if (fabs(soup.positions[k] - expected[k]) > 1e-12) {
      fail_msg("%s: coordinate %d is %.17g, not %.17g", order, k, soup.positions[k], expected[k]);
    }
  }
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_every_operation_moves_a_point_as_by_hand(void **state) {
  (void)state;
  assert_moves("", "", 101, 2, 3);
  assert_moves("double3 xformOp:translate = (10, 20, 30)", "\"xformOp:translate\"", 111, 22, 33);
  assert_moves("float3 xformOp:scale = (2, 3, -1)", "\"xformOp:scale\"", 102, 6, -3);
  assert_moves("float xformOp:rotateX = 90", "\"xformOp:rotateX\"", 101, -3, 2);
  assert_moves("float xformOp:rotateY = 90", "\"xformOp:rotateY\"", 103, 2, -1);
  assert_moves("double xformOp:rotateZ:tilt = -90", "\"xformOp:rotateZ:tilt\"", 102, -1, 3);
  /* First about x: (1, -3, 2); then about y: (2, -3, -1). */
  assert_moves("float3 xformOp:rotateXYZ = (90, 90, 0)", "\"xformOp:rotateXYZ\"", 102, -3, -1);
  /* First about y: (3, 2, -1); then about x: (3, 1, 2). */
  assert_moves("half3 xformOp:rotateYXZ = (90, 90, 0)", "\"xformOp:rotateYXZ\"", 103, 1, 2);
  assert_moves("float3 xformOp:rotateZYX = (90, 90, 0)", "\"xformOp:rotateZYX\"", 103, 1, 2);
  assert_moves("float3 xformOp:rotateZXY = (90, 90, 0)", "\"xformOp:rotateZXY\"", 102, -3, -1);
  assert_moves("float3 xformOp:rotateXZY = (90, 90, 0)", "\"xformOp:rotateXZY\"", 102, -3, -1);
  assert_moves("float3 xformOp:rotateYZX = (90, 90, 0)", "\"xformOp:rotateYZX\"", 103, 1, 2);
  /* Twice the unit: a quaternion is a direction only. 90 degrees about z. */
  assert_moves("quatf xformOp:orient = (2, 0, 0, 2)", "\"xformOp:orient\"", 98, 1, 3);
  assert_moves("matrix4d xformOp:transform = ((0, 1, 0, 0), (1, 0, 0, 0), (0, 0, 2, 0), (5, 6, 7, 1))",
               "\"xformOp:transform\"", 107, 7, 13);
  /* The last one is the first that the point meets. */
  assert_moves("double3 xformOp:translate = (10, 0, 0)\nfloat3 xformOp:scale = (2, 2, 2)",
               "\"xformOp:translate\", \"xformOp:scale\"", 112, 4, 6);
  assert_moves("double3 xformOp:translate = (10, 0, 0)\nfloat3 xformOp:scale = (2, 2, 2)",
               "\"xformOp:scale\", \"xformOp:translate\"", 122, 4, 6);
  /* About a pivot. */
  assert_moves("float3 xformOp:translate:pivot = (1, 1, 0)\nfloat xformOp:rotateZ = 180",
               "\"xformOp:translate:pivot\", \"xformOp:rotateZ\", \"!invert!xformOp:translate:pivot\"", 101, 0, 3);
  assert_moves("float3 xformOp:translate = (1, 1, 1)", "\"!resetXformStack!\", \"xformOp:translate\"", 2, 3, 4);
  assert_moves("float3 xformOp:translate", "\"xformOp:translate\"", 101, 2, 3);
}

static void test_operations_that_are_none_are_errors_that_name_the_prim(void **state) {
  (void)state;
#define WITH(text) "#usda 1.0\n" MESH("m", text)
  assert_scene_refused(WITH("uniform token[] xformOpOrder = [\"xformOp:twist\"]"), QMAT_ERROR_FORMAT,
                       "/m: 'xformOp:twist' is not a transform operation");
  assert_scene_refused(WITH("float xformOp:scale = 1\nuniform token[] xformOpOrder = [\"xformOp:scale\"]"),
                       QMAT_ERROR_FORMAT, "/m: xformOp:scale has a value of the wrong type");
  assert_scene_refused(
      WITH("float3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder = [\"!invert!xformOp:scale\"]"),
      QMAT_ERROR_FORMAT, "/m: xformOp:scale has no inverse");
#undef WITH
}

static void test_mirrors_and_left_hands_turn_faces_and_cancel_out(void **state) {
  (void)state;
  static const char left[] = "uniform token orientation = \"leftHanded\"\n",
                    mirror[] =
                        "float3 xformOp:scale = (1, 1, -1)\nuniform token[] xformOpOrder = "
                        "[\"xformOp:scale\"]\n";
  for (size_t i = 0; i < 4; i++) {
    char text[2048];
    snprintf(text, sizeof text, "#usda 1.0\ndef Mesh \"m\" {\n%s%s%s}", TRIANGLE, i & 1 ? left : "",
             i & 2 ? mirror : "");
    json_t *report;
    qmat_soup soup = good_scene(text, &report);
    static const uint32_t kept[] = {0, 1, 2}, turned[] = {2, 1, 0};
    assert_memory_equal(soup.corners, i == 1 || i == 2 ? turned : kept, sizeof kept);
    qmat_soup_uninit(&soup);
    json_decref(report);
  }
}

static void test_holes_are_left_out_and_cages_are_reported(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\n(metersPerUnit = 0.5 upAxis = \"Z\")\ndef Mesh \"m\" {\npoint3f[] points = [(0, 0, 0), (1, 0, 0), "
      "(1, "
      "1, 0), (0, 1, 0), (2, 0, 0)]\nint[] faceVertexCounts = [4, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 2]\n"
      "int[] holeIndices = [0]\n}",
      &report);
  assert_int_equal(soup.facet_count, 1);
  static const uint32_t corners[] = {1, 4, 2};
  assert_memory_equal(soup.corners, corners, sizeof corners);
  assert_int_equal(count_of(report, "holes"), 1);
  assert_int_equal(count_of(report, "cages"), 1);
  assert_int_equal(json_array_size(json_object_get(report, "warnings")), 0);
  assert_true(json_real_value(json_object_get(report, "meters_per_unit")) == 0.5);
  assert_string_equal(json_string_value(json_object_get(report, "up_axis")), "Z");
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_cages_keep_schemes_creases_corners_and_holes_in_world_space(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\n" MESH("first", "") "def Mesh \"m\" {\npoint3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]\n"
      "int[] faceVertexCounts = [4, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 0, 1, 2]\nint[] holeIndices = [1]\n"
      "int[] creaseLengths = [3, 2]\nint[] creaseIndices = [0, 1, 2, 2, 3]\nfloat[] creaseSharpnesses = [2, 10]\n"
      "int[] cornerIndices = [3]\nfloat[] cornerSharpnesses = [5]\ntoken interpolateBoundary = \"edgeOnly\"\n"
      "uniform token orientation = \"leftHanded\"\nuniform token subdivisionScheme = \"loop\"\n"
      "double3 xformOp:translate = (0, 0, 4)\nuniform token[] xformOpOrder = [\"xformOp:translate\"] }",
      &report);
  const qmat_read_options options = {.defects = QMAT_DEFECTS_REFUSE};
  qmat_context context = {0};
  qmat_mesh *mesh;
  assert_int_equal(qmat_soup_to_mesh(&context, &soup, "file", &options, &mesh, NULL), QMAT_OK);
  const qmat_cage *cage = &mesh->cage;
  static const uint32_t surface_faces[] = {1, 2}, schemes[] = {QMAT_SCHEME_NONE, QMAT_SCHEME_LOOP},
                        boundaries[] = {QMAT_BOUNDARY_EDGE_AND_CORNER, QMAT_BOUNDARY_EDGE}, sizes[] = {3, 4, 3},
                        corners[] = {0, 1, 2, 6, 5, 4, 3, 5, 4, 3}, creases[] = {3, 4, 4, 5, 5, 6};
  static const double crease_sharpness[] = {2, 2, 10};
  assert_int_equal(cage->surface_count, 2);
  assert_memory_equal(cage->surface_faces, surface_faces, sizeof surface_faces);
  assert_memory_equal(cage->schemes, schemes, sizeof schemes);
  assert_memory_equal(cage->boundaries, boundaries, sizeof boundaries);
  assert_int_equal(cage->vertex_count, 7);
  assert_true(cage->positions[3 * 3 + 2] == 4);
  assert_int_equal(cage->face_count, 3);
  assert_memory_equal(cage->face_sizes, sizes, sizeof sizes);
  assert_int_equal(cage->corner_count, 10);
  assert_memory_equal(cage->corners, corners, sizeof corners);
  assert_int_equal(cage->hole_count, 1);
  assert_int_equal(cage->holes[0], 2);
  assert_int_equal(cage->crease_count, 3);
  assert_memory_equal(cage->creases, creases, sizeof creases);
  assert_memory_equal(cage->crease_sharpness, crease_sharpness, sizeof crease_sharpness);
  assert_int_equal(cage->sharp_count, 1);
  assert_int_equal(cage->sharp_vertices[0], 6);
  assert_true(cage->vertex_sharpness[0] == 5);
  qmat_value_release(&mesh->base);
  qmat_soup_uninit(&soup);
  json_decref(report);
  soup = good_scene("#usda 1.0\n" MESH("first", ""), &report);
  assert_int_equal(soup.cage.surface_count, 0);
  qmat_soup_uninit(&soup);
  json_decref(report);
  qmat_context_uninit(&context);
}

static void test_what_is_hidden_inactive_or_for_other_purposes_is_skipped(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\n" MESH("seen", "") "def \"off\" ( active = false ) {\n" MESH("a", "") "}\n"
      "def Xform \"hidden\" { token visibility = \"invisible\"\n" MESH("b", "") "}\n"
      "def Xform \"guides\" { uniform token purpose = \"guide\"\n" MESH("c", "")
      MESH("d", "uniform token purpose = \"render\"\n") "}\n"
      MESH("e", "uniform token purpose = \"proxy\"\n") "class \"k\" {\n" MESH("f", "") "}\n"
      "over \"o\" {\n" MESH("g", "") "}\n def NurbsPatch \"s\" {}\ndef PointInstancer \"p\" {\n" MESH("h", "") "}\n"
      "def Camera \"eye\" {}\n",
      &report);
  assert_int_equal(count_of(report, "meshes_placed"), 2);
  assert_int_equal(soup.facet_count, 2);
  assert_int_equal(count_of(report, "prims_skipped"), 4);
  assert_int_equal(count_of(report, "shapes_skipped"), 1);
  assert_string_equal(warning_of(report, 0), "/o: skipped with all prims below it: nothing defines this 'over'");
  assert_string_equal(warning_of(report, 1), "/s: skipped: a NurbsPatch is not a surface that bounds a solid");
  assert_string_equal(warning_of(report, 2), "");
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_what_nothing_defines_is_read_where_there_is_nothing_else(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup = good_scene("#usda 1.0\nover \"o\" {\n" MESH("g", "") "}\n", &report);
  assert_int_equal(soup.facet_count, 1);
  assert_string_equal(warning_of(report, 0),
                      "/o: read although nothing defines it: the scene has only an 'over' of it");
  assert_string_equal(warning_of(report, 1), "");
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_strength_of_arcs_is_local_inherit_variant_reference_payload_specialize(void **state) {
  (void)state;
  /* Every arc moves the mesh to another x; fewer and fewer of them have a say. */
  static const char *const arcs[] = {"inherits = </i>", "variants = { string v = \"on\" }\nprepend variantSets = \"v\"",
                                     "prepend references = </r>", "payload = </p>", "specializes = </s>"};
  static const char before[] =
      "#usda 1.0\n"
      "class \"i\" { double3 xformOp:translate = (2, 0, 0) }\nclass \"r\" { double3 xformOp:translate = (4, 0, 0) }\n"
      "class \"p\" { double3 xformOp:translate = (5, 0, 0) }\nclass \"s\" { double3 xformOp:translate = (6, 0, 0) }\n";
  for (int first = -1; first < 5; first++) {
    char text[4096];
    int used = snprintf(text, sizeof text, "%sdef Mesh \"m\" (\n", before);
    for (int k = first < 0 ? 0 : first; k < 5; k++) {
      used += snprintf(text + used, sizeof text - (size_t)used, "%s\n", arcs[k]);
    }
    snprintf(text + used, sizeof text - (size_t)used,
             ") {\n" TRIANGLE
             "%s\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n"
             "variantSet \"v\" = { \"on\" { double3 xformOp:translate = (3, 0, 0) } \"off\" {} }\n}",
             first < 0 ? "double3 xformOp:translate = (1, 0, 0)" : "");
    const double x = first + 2;
    const double expected[] = {x, 0, 0, x + 1, 0, 0, x, 1, 0};
    assert_points(text, expected, 3);
  }
}

/* Edits of a list of references in a layer and its sublayer; the first one that gives an x wins. */
static void test_lists_of_references_are_edited_from_weak_to_strong(void **state) {
  (void)state;
  static const struct {
    const char *weak, *strong;
    double x;
  } cases[] = {
      {"references = [</a>, </b>]", "", 1},
      {"references = [</a>, </b>]", "prepend references = </c>", 3},
      {"references = [</a>, </b>]", "prepend references = </b>", 2},
      {"references = [</a>, </b>]", "append references = </c>", 1},
      {"references = [</a>, </b>]", "append references = </a>", 2},
      {"references = [</a>, </b>]", "add references = </a>", 1},
      {"references = [</a>, </b>]", "delete references = </a>", 2},
      {"references = [</a>, </b>]", "references = </c>", 3},
      {"prepend references = [</a>, </b>]", "delete references = [</b>, </a>]", 0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    char text[2048];
    snprintf(text, sizeof text,
             "#usda 1.0\nclass \"a\" { double x = 1 double3 xformOp:translate = (1, 0, 0) }\n"
             "class \"b\" { double3 xformOp:translate = (2, 0, 0) }\n"
             "class \"c\" { double3 xformOp:translate = (3, 0, 0) }\n"
             "def Mesh \"m\" ( %s ) {\n" TRIANGLE "uniform token[] xformOpOrder = [\"xformOp:translate\"] }",
             cases[i].weak);
    write_file(in_folder("weak.usda"), text, strlen(text));
    snprintf(text, sizeof text, "#usda 1.0\n( subLayers = [@weak.usda@] )\nover \"m\" ( %s ) {}", cases[i].strong);
    const double x = cases[i].x, expected[] = {x, 0, 0, x + 1, 0, 0, x, 1, 0};
    assert_points(text, expected, 3);
  }
  unlink(in_folder("weak.usda"));
}

static void test_inheriting_from_a_class_defines_an_over(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup =
      good_scene("#usda 1.0\nclass Mesh \"c\" {\n" TRIANGLE "}\nover \"m\" ( inherits = </c> ) {}\n", &report);
  assert_int_equal(soup.facet_count, 1);
  assert_string_equal(warning_of(report, 0), "");
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_opinions_of_a_referring_layer_about_a_class_are_skipped_aloud(void **state) {
  (void)state;
  static const char other[] = "#usda 1.0\nclass Mesh \"c\" {\n" TRIANGLE "}\ndef \"p\" ( inherits = </c> ) {}\n";
  json_t *report;
  write_file(in_folder("other.usda"), other, strlen(other));
  qmat_soup soup = good_scene(
      "#usda 1.0\nclass \"c\" { token visibility = \"invisible\" }\ndef \"x\" ( references = @other.usda@</p> ) {}\n",
      &report);
  assert_int_equal(soup.facet_count, 1);
  assert_string_equal(warning_of(report, 0), "/x: the opinions of a referring layer about the class </c> are skipped");
  assert_string_equal(warning_of(report, 1), "");
  unlink(in_folder("other.usda"));
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_sublayers_without_end_are_refused(void **state) {
  (void)state;
  enum { FILES = 70 };
  char name[32], text[128];
  for (int i = 0; i < FILES; i++) {
    snprintf(name, sizeof name, "s%d.usda", i);
    snprintf(text, sizeof text, "#usda 1.0\n( subLayers = [@s%d.usda@] )\n", i + 1);
    write_file(in_folder(name), text, strlen(text));
  }
  assert_scene_refused("#usda 1.0\n( subLayers = [@s0.usda@] )\n", QMAT_ERROR_FORMAT,
                       "/: sublayers are nested more than 64 deep");
  for (int i = 0; i < FILES; i++) {
    snprintf(name, sizeof name, "s%d.usda", i);
    unlink(in_folder(name));
  }
}

static void test_creases_have_one_sharpness_or_one_an_edge(void **state) {
  (void)state;
  static const struct {
    const char *sharpness;
    double expected[3];
  } cases[] = {{"[2, 10]", {2, 2, 10}}, {"[3, 4, 5]", {3, 4, 5}}};
  for (size_t i = 0; i < 2; i++) {
    char text[1024];
    json_t *report;
    snprintf(text, sizeof text,
             "#usda 1.0\ndef Mesh \"m\" {\npoint3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]\n"
             "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3]\nint[] creaseLengths = [3, 2]\n"
             "int[] creaseIndices = [0, 1, 2, 2, 3]\nfloat[] creaseSharpnesses = %s }",
             cases[i].sharpness);
    qmat_soup soup = good_scene(text, &report);
    assert_int_equal(soup.cage.crease_count, 3);
    assert_memory_equal(soup.cage.crease_sharpness, cases[i].expected, sizeof cases[i].expected);
    qmat_soup_uninit(&soup);
    json_decref(report);
  }
}

static void test_members_of_a_package_that_overlap_are_refused(void **state) {
  (void)state;
  enum { COPIES = 9, END = 22 };
  static const char text[] = "#usda 1.0\n" MESH("m", "");
  qmat_writer writer = {0}, copies = {0};
  qmat_context context = {0};
  qmat_usdz package;
  qmat_usdz_put(&writer, "a.usda", text, strlen(text));
  const size_t end = writer.size - END;
  qmat_byte_reader record = {.bytes = writer.bytes, .size = writer.size, .at = end + 16};
  const size_t directory = qmat_take_u32(&record);
  qmat_put_bytes(&copies, writer.bytes, directory);
  for (int i = 0; i < COPIES; i++) qmat_put_bytes(&copies, writer.bytes + directory, end - directory);
  qmat_put_bytes(&copies, writer.bytes + end, END);
  copies.bytes[copies.size - END + 10] = COPIES;
  qmat_bytes bytes = memory_file(copies.bytes, copies.size);
  assert_int_equal(qmat_usdz_open(&context, &bytes, "a.usdz", &package), QMAT_ERROR_FORMAT);
  assert_string_equal(context.error.message, "members of the archive overlap");
  qmat_usdz_uninit(&package);
  free(bytes.data);
  qmat_writer_uninit(&writer);
  qmat_writer_uninit(&copies);
  qmat_context_uninit(&context);
}

static void test_children_come_through_variants_nested_variants_and_references(void **state) {
  (void)state;
  /* Weaker opinions have their children first. */
  static const double expected[] = {7, 0, 0, 8, 0, 0, 7, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  assert_points(
      "#usda 1.0\n"
      "def Xform \"w\" ( variants = { string lod = \"high\" } prepend variantSets = \"lod\" ) {\n"
      "  variantSet \"lod\" = {\n    \"low\" { }\n"
      "    \"high\" ( variants = { string place = \"here\" } prepend variantSets = \"place\" ) {\n" MESH("a", "")
      "      variantSet \"place\" = { \"here\" { def Xform \"t\" ( references = </asset> ) {\n"
      "        double3 xformOp:translate = (7, 0, 0)\n uniform token[] xformOpOrder = [\"xformOp:translate\"] } } }\n"
      "    }\n  }\n}\nclass Xform \"asset\" {\n" MESH("b", "") "}\n",
      expected, 6);
}

static void test_a_variant_that_is_not_selected_is_left_out_aloud(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup = good_scene("#usda 1.0\n" MESH("m", "") "def \"w\" ( prepend variantSets = \"v\" ) {\n variantSet \"v\" "
                              "= { \"x\" {\n" MESH("n", "") "} } }",
                              &report);
  assert_int_equal(soup.facet_count, 1);
  assert_string_equal(warning_of(report, 0), "/w: no variant of 'v' is selected: all are skipped");
  qmat_soup_uninit(&soup);
  json_decref(report);
}

/* The layer and its sublayer, in two folders, each refer to their own asset.usda; the prim gets both meshes. */
static void test_references_are_beside_the_layer_of_the_stack_that_has_them(void **state) {
  (void)state;
  char sub[256], sublayer[256], its_asset[256], asset[256];
  snprintf(sub, sizeof sub, "%s", in_folder("sub"));
  snprintf(sublayer, sizeof sublayer, "%s", in_folder("sub/below.usda"));
  snprintf(its_asset, sizeof its_asset, "%s", in_folder("sub/asset.usda"));
  snprintf(asset, sizeof asset, "%s", in_folder("asset.usda"));
  assert_int_equal(mkdir(sub, 0777), 0);
  static const char below[] = "#usda 1.0\ndef \"x\" ( prepend references = @./asset.usda@ ) {}\n";
  static const char one[] = "#usda 1.0\n( defaultPrim = \"A\" )\ndef \"A\" {\n" MESH("a", "") "}";
  static const char other[] = "#usda 1.0\n( defaultPrim = \"B\" )\ndef \"B\" {\n" MESH("b", "") "}";
  write_file(sublayer, below, strlen(below));
  write_file(asset, one, strlen(one));
  write_file(its_asset, other, strlen(other));
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\n( subLayers = [@sub/below.usda@] )\ndef \"x\" ( prepend references = @./asset.usda@ ) {}\n", &report);
  assert_int_equal(count_of(report, "meshes_placed"), 2);
  assert_int_equal(count_of(report, "layers_read"), 4);
  assert_string_equal(warning_of(report, 0), "");
  qmat_soup_uninit(&soup);
  json_decref(report);
  unlink(asset);
  unlink(its_asset);
  unlink(sublayer);
  rmdir(sub);
}

/* A reference to a prim below others brings what their payloads and variants say of it, weaker than its own layer. */
static void test_a_reference_brings_what_prims_above_its_target_bring(void **state) {
  (void)state;
  static const char asset[] =
      "#usda 1.0\ndef Xform \"A\" ( payload = @payload.usda@</P>\n"
      "  variants = { string v = \"one\" }\n  prepend variantSets = \"v\" ) {\n"
      "  over \"G\" { double3 xformOp:translate = (1, 0, 0) }\n"
      "  variantSet \"v\" = { \"one\" { over \"G\" { def \"in\" { " MESH("v", "") "} } } }\n}\n";
  static const char payload[] =
      "#usda 1.0\ndef \"P\" { def Xform \"G\" { double3 xformOp:translate = (5, 0, 0)\n"
      "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" MESH("p", "") "} }\n";
  write_file(in_folder("asset.usda"), asset, strlen(asset));
  write_file(in_folder("payload.usda"), payload, strlen(payload));
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\ndef \"x\" ( references = @asset.usda@</A/G> ) {}\n"
      "def \"y\" ( references = @asset.usda@</A/G/in> ) {}\n"
      "def \"z\" ( references = @asset.usda@</A/none> ) {}\n",
      &report);
  assert_int_equal(count_of(report, "meshes_placed"), 3); /* x/p, x/in/v, y/v */
  assert_string_equal(warning_of(report, 0), "/z: the reference of </A/none> is skipped: there is no such prim");
  assert_string_equal(warning_of(report, 1), "");
  assert_true(soup.positions[0] == 1); /* the layer's own opinion, not the payload's */
  qmat_soup_uninit(&soup);
  json_decref(report);
  unlink(in_folder("asset.usda"));
  unlink(in_folder("payload.usda"));
}

/* Two prims that refer to what is below each other. */
static void test_references_through_prims_above_end(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\ndef \"A\" ( references = </B/c> ) { def \"d\" {} }\n"
      "def \"B\" ( references = </A/d> ) { def \"c\" {" MESH("m", "") "} }\n",
      &report);
  assert_true(count_of(report, "meshes_placed") >= 2);
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_files_are_found_beside_the_layer_that_names_them(void **state) {
  (void)state;
  char sub[256], asset[256], sublayer[256];
  snprintf(sub, sizeof sub, "%s", in_folder("sub"));
  assert_int_equal(mkdir(sub, 0777), 0);
  snprintf(asset, sizeof asset, "%s", in_folder("sub/asset.usda"));
  snprintf(sublayer, sizeof sublayer, "%s", in_folder("below.usda"));
  static const char asset_text[] =
      "#usda 1.0\n( defaultPrim = \"A\" )\ndef Xform \"A\" ( references = @../below.usda@</B> ) {}";
  static const char below_text[] = "#usda 1.0\ndef Xform \"B\" {\n" MESH(
      "b", "") "}\ndef Xform \"w\" { def \"gone\" (active = true) {\n" MESH("c", "") "} }";
  write_file(asset, asset_text, strlen(asset_text));
  write_file(sublayer, below_text, strlen(below_text));
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\n( subLayers = [@./below.usda@] )\nover \"w\" { over \"gone\" (active = false) {} }\n"
      "def \"x\" ( references = @sub\\asset.usda@ ) {}\ndef \"y\" ( payload = [@sub/asset.usda@</A>, @no.usda@] ) {}\n"
      "def \"z\" ( references = [@http://a/b.usd@, @sub/asset.usda@</none>, </z>] ) {}",
      &report);
  assert_int_equal(count_of(report, "meshes_placed"), 3);
  assert_int_equal(count_of(report, "layers_read"), 3);
  assert_string_equal(warning_of(report, 0),
                      "/y: the payload @no.usda@ is skipped: cannot open the file: No such file or directory");
  assert_string_equal(warning_of(report, 1),
                      "/z: the reference @http://a/b.usd@ is skipped: only files beside the layer are read");
  assert_string_equal(warning_of(report, 2), "/z: the reference of </none> is skipped: there is no such prim");
  assert_string_equal(warning_of(report, 3), "/z: the reference of </z> is skipped: it leads back to itself");
  qmat_soup_uninit(&soup);
  json_decref(report);

  /* A file that is there and broken is an error in that file. */
  write_file(asset, "#usda 1.0\n?", 11);
  qmat_context context = {0};
  assert_int_equal(read_text(&context, "#usda 1.0\ndef \"x\" ( references = @sub/asset.usda@ ) {}", &soup, NULL),
                   QMAT_ERROR_FORMAT);
  assert_string_equal(context.error.file, asset);
  assert_int_equal(context.error.line, 2);
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
  unlink(asset);
  unlink(sublayer);
  rmdir(sub);
}

static void test_samples_over_time_give_the_first_with_a_warning(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup =
      good_scene("#usda 1.0\n" MESH("m",
                                    "double3 xformOp:translate.timeSamples = { 5: (9, 0, 0), 1: (4, 0, 0) }\n"
                                    "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n"),
                 &report);
  assert_true(soup.positions[0] == 4);
  assert_string_equal(warning_of(report, 0), "/m: xformOp:translate changes over time: its first sample is used");
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_broken_meshes_are_errors_that_name_the_prim(void **state) {
  (void)state;
#define BROKEN(points, counts, indices, more)                                                   \
  "#usda 1.0\ndef Mesh \"m\" { point3f[] points = " points "\nint[] faceVertexCounts = " counts \
  "\nint[] faceVertexIndices = " indices "\n" more "}"
#define POINTS "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]"
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1]", ""), QMAT_ERROR_FORMAT,
                       "/m: face 0 has more corners than there are faceVertexIndices");
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1, 2, 0]", ""), QMAT_ERROR_FORMAT,
                       "/m: the faces have 3 corners, but there are 4 faceVertexIndices");
  assert_scene_refused(BROKEN(POINTS, "[-3]", "[0, 1, 2]", ""), QMAT_ERROR_FORMAT,
                       "/m: face 0 has a negative number of corners");
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1, 3]", ""), QMAT_ERROR_FORMAT,
                       "/m: corner 2 refers to vertex 3, but there are 3 points");
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1, 2]", "int[] holeIndices = [1]"), QMAT_ERROR_FORMAT,
                       "/m: hole 0 refers to face 1, but there are 1 faces");
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1, 2]", "uniform token subdivisionScheme = \"doo\""),
                       QMAT_ERROR_FORMAT, "/m: subdivisionScheme is 'doo', which is unknown");
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1, 2]", "int[] creaseLengths = [3]\nint[] creaseIndices = [0, 1]"),
                       QMAT_ERROR_FORMAT, "/m: crease 0 has 3 vertices");
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1, 2]", "int[] creaseLengths = [2]\nint[] creaseIndices = [0, 1]"),
                       QMAT_ERROR_FORMAT, "/m: 1 creases of 2 vertices do not match 2 indices and 0 sharpnesses");
  assert_scene_refused(BROKEN(POINTS, "[3]", "[0, 1, 2]", "int[] cornerIndices = [7]\nfloat[] cornerSharpnesses = [1]"),
                       QMAT_ERROR_FORMAT, "/m: a corner refers to vertex 7, but there are 3 points");
  assert_scene_refused(
      BROKEN(POINTS, "[3]", "[0, 1, 2]", "int[] cornerIndices = [0]\nfloat[] cornerSharpnesses = [-1]"),
      QMAT_ERROR_FORMAT, "/m: the sharpness of corner 0 is negative or not finite");
  assert_scene_refused("#usda 1.0\ndef Mesh \"m\" { float[] points = [1] }", QMAT_ERROR_FORMAT,
                       "/m: points has a value of the wrong type");
  assert_scene_refused("#usda 1.0\ndef Mesh \"m\" {}", QMAT_ERROR_GEOMETRY,
                       "the scene has no mesh that can be read; /m: the mesh has no points");
  assert_scene_refused(
      "#usda 1.0\ndef \"m\" ( references = @x.usd@ ) {}", QMAT_ERROR_GEOMETRY,
      "the scene has no mesh that can be read; /m: the reference @x.usd@ is skipped: cannot open the file: No "
      "such file or directory");
#undef BROKEN
#undef POINTS
}

static void test_references_that_multiply_are_stopped(void **state) {
  (void)state;
  /* Forty levels of two references each would make 2^40 meshes. */
  char *text = malloc(65536);
  assert_non_null(text);
  int used = snprintf(text, 65536, "#usda 1.0\n" MESH("l0", ""));
  for (int level = 1; level <= 40; level++) {
    used += snprintf(text + used, 65536 - (size_t)used,
                     "def \"l%d\" { def \"a\" ( references = </l%d> ) {} def \"b\" ( references = </l%d> ) {} }\n",
                     level, level - 1, level - 1);
  }
  qmat_context context = {0};
  qmat_soup soup;
  assert_int_equal(read_text(&context, text, &soup, NULL), QMAT_ERROR_FORMAT);
  assert_non_null(strstr(context.error.message, "the scene is larger than its files justify"));
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
  free(text);
}

static void test_a_package_is_read_and_its_members_refer_to_each_other(void **state) {
  (void)state;
  static const char text[] = "#usda 1.0\n" MESH("m", "");
  qmat_writer writer = {0};
  qmat_usdz_put(&writer, "a.usda", text, strlen(text));
  assert_false(writer.failed);
  qmat_context context = {0};
  qmat_soup soup = {0};
  qmat_bytes bytes = memory_file(writer.bytes, writer.size);
  assert_int_equal(qmat_usd_read(&context, &bytes, in_folder("a.usdz"), &soup, NULL), QMAT_OK);
  assert_int_equal(soup.facet_count, 1);
  qmat_soup_uninit(&soup);
  /* A package that two prims refer to is read once. */
  json_t *report;
  write_file(in_folder("b.usdz"), writer.bytes, writer.size);
  soup = good_scene(
      "#usda 1.0\ndef \"x\" ( references = @b.usdz@</m> ) {}\ndef \"y\" ( references = @none/.././b.usdz@</m> ) {}\n",
      &report);
  assert_int_equal(soup.facet_count, 2);
  assert_int_equal(count_of(report, "layers_read"), 2);
  json_decref(report);
  qmat_soup_uninit(&soup);
  unlink(in_folder("b.usdz"));
  qmat_usdz package;
  assert_int_equal(qmat_usdz_open(&context, &bytes, "a.usdz", &package), QMAT_OK);
  assert_int_equal(package.member_count, 1);
  assert_int_equal((package.members[0].bytes - bytes.data) % 64, 0);
  assert_string_equal(package.members[0].name, "a.usda");
  qmat_usdz_uninit(&package);
  /* A byte of the content that is not what its checksum says. */
  bytes.data[bytes.size / 2] ^= 1;
  assert_int_equal(qmat_usd_read(&context, &bytes, "a.usdz", &soup, NULL), QMAT_ERROR_FORMAT);
  for (size_t cut = 4; cut < bytes.size; cut++) {
    qmat_bytes part = memory_file(writer.bytes, cut);
    soup = (qmat_soup){0};
    assert_int_equal(qmat_usd_read(&context, &part, "a.usdz", &soup, NULL), QMAT_ERROR_FORMAT);
    free(part.data);
  }
  free(bytes.data);
  qmat_writer_uninit(&writer);
  qmat_context_uninit(&context);
}

static void test_real_assets_are_read_whole_or_refused_by_name(void **state) {
  (void)state;
  static const struct {
    const char *name;
    json_int_t meshes, cages;
    size_t facets;
  } assets[] = {
      {"cube.usdz", 1, 0, 6},
      {"hair.usda", 1, 0, 1},
      {"hair.usdc", 1, 0, 1},
      {"texturedcube.usda", 1, 0, 6},
      {"texturedcube.usdc", 1, 0, 6},
      {"translated-cube.usda", 1, 0, 6},
      {"translated-cube.usdc", 1, 0, 6},
      {"skintest.usda", 1, 0, 100},
      {"shader_ball_subdiv.usda", 1, 1, 5838},
      {"primvar_interpolation.usda", 7, 2, 14},
      {"pyramid_creases.usda", 1, 1, 12},
  };
  if (access(DATA "hair.usda", R_OK) != 0) {
    print_message("skipped: %s is not there\n", DATA);
    skip();
  }
  for (size_t i = 0; i < sizeof assets / sizeof assets[0]; i++) {
    char path[256];
    snprintf(path, sizeof path, "%s%s", DATA, assets[i].name);
    qmat_context context = {0};
    qmat_bytes bytes = {0};
    qmat_soup soup = {0};
    json_t *report = json_object();
    qmat_status status = qmat_bytes_read_file(&context, path, &bytes);
    if (status == QMAT_OK) status = qmat_usd_read(&context, &bytes, path, &soup, report);
    if (status != QMAT_OK) fail_msg("%s: %s", path, context.error.message);
    for (size_t k = 0; k < json_array_size(json_object_get(report, "warnings")); k++) {
      print_message("%s: %s\n", assets[i].name, warning_of(report, k));
    }
    assert_int_equal(count_of(report, "meshes_placed"), assets[i].meshes);
    assert_int_equal(count_of(report, "cages"), assets[i].cages);
    assert_int_equal(soup.facet_count, assets[i].facets);
    qmat_soup_uninit(&soup);
    qmat_bytes_uninit(&bytes);
    json_decref(report);
    qmat_context_uninit(&context);
  }
  qmat_context context = {0};
  qmat_bytes bytes = {0};
  qmat_soup soup = {0};
  assert_int_equal(qmat_bytes_read_file(&context, DATA "reference.usda", &bytes), QMAT_OK);
  assert_int_equal(qmat_usd_read(&context, &bytes, DATA "reference.usda", &soup, NULL), QMAT_ERROR_GEOMETRY);
  assert_string_equal(
      context.error.message,
      "the scene has no mesh that can be read; /bora: the reference @./suzanne.usdc@ is skipped: cannot open the "
      "file: No such file or directory");
  qmat_bytes_uninit(&bytes);
  qmat_context_uninit(&context);
}

/* The name of a class with as many variant sets as a prim may have, and prims that inherit it. */
static char *many_variant_sets(int heirs) {
  enum { SETS = 4096, ROOM = 32 };
  char *text = malloc((size_t)(SETS + heirs + 8) * ROOM);
  assert_non_null(text);
  int used = sprintf(text, "#usda 1.0\n( subLayers = [@./sets.usda@] )\nover \"c\" ( prepend variantSets = [");
  for (int i = 0; i < SETS / 2; i++) used += sprintf(text + used, "\"s%d\", ", i);
  used += sprintf(text + used, "] ) {}\n");
  for (int i = 0; i < heirs; i++) used += sprintf(text + used, "def \"h%d\" ( inherits = </c> ) {}\n", i);
  sprintf(text + used, "def Mesh \"m\" {\n" TRIANGLE "}\n");
  FILE *file = fopen(in_folder("sets.usda"), "wb");
  assert_non_null(file);
  fprintf(file, "#usda 1.0\nclass \"c\" ( append variantSets = [");
  for (int i = 0; i < SETS / 2; i++) fprintf(file, "\"t%d\", ", i);
  fprintf(file, "] ) {}\n");
  fclose(file);
  return text;
}

static bool stop_after(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                       const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total, (void)unit;
  int *left = user;
  return --*left > 0;
}

static void test_long_lists_take_little_time_and_can_be_cancelled(void **state) {
  (void)state;
  char *text = many_variant_sets(400);
  const clock_t start = clock();
  json_t *report;
  qmat_soup soup = good_scene(text, &report);
  /* Without an order of the items this takes four million comparisons a prim, which is ten times as long. */
  assert_true((double)(clock() - start) / CLOCKS_PER_SEC < 4);
  assert_int_equal(count_of(report, "meshes_placed"), 1);
  qmat_soup_uninit(&soup);
  json_decref(report);
  /* The first prims are not a thousand: only the lists' own steps ask whether to go on. */
  int left = 1;
  qmat_context context = {.progress = stop_after, .progress_user = &left};
  assert_int_equal(read_text(&context, text, &soup, NULL), QMAT_CANCELLED);
  qmat_soup_uninit(&soup);
  qmat_context_uninit(&context);
  free(text);
  unlink(in_folder("sets.usda"));
}

/* Prototypes without instances are not even composed. */
static void test_only_prototypes_with_instances_are_read(void **state) {
  (void)state;
  enum { PROTOTYPES = 2000 };
  char *text = malloc(PROTOTYPES * 16 + 1024);
  assert_non_null(text);
  int used = sprintf(text, "#usda 1.0\ndef PointInstancer \"p\" {\nrel prototypes = [");
  for (int i = 0; i < PROTOTYPES; i++) used += sprintf(text + used, "</p/m>, ");
  sprintf(text + used,
          "]\nint[] protoIndices = [1999, 7, 1999]\npoint3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]\n"
          "def Mesh \"m\" {\n" TRIANGLE "}\n}\n");
  json_t *report;
  qmat_soup soup = good_scene(text, &report);
  assert_int_equal(soup.vertex_count, 9);
  assert_true(soup.positions[0] == 2 && soup.positions[9] == 1 && soup.positions[18] == 3);
  assert_int_equal(count_of(report, "prims_read"), 3);
  qmat_soup_uninit(&soup);
  json_decref(report);
  free(text);
}

/* What is no unit and no axis has a warning each, and the defaults of USD take its place. */
static void test_units_and_axes_that_are_none_are_named(void **state) {
  (void)state;
  static const char *const units[] = {"0", "-1", "inf", "nan"};
  for (size_t i = 0; i < 4; i++) {
    char text[512];
    snprintf(text, sizeof text, "#usda 1.0\n( metersPerUnit = %s upAxis = \"X\" )\n" MESH("m", ""), units[i]);
    json_t *report;
    qmat_soup soup = good_scene(text, &report);
    assert_string_equal(warning_of(report, 0), "/: metersPerUnit is no length: 0.01 is used");
    assert_string_equal(warning_of(report, 1), "/: upAxis is 'X', not Y or Z: Y is used");
    assert_string_equal(warning_of(report, 2), "");
    assert_true(json_real_value(json_object_get(report, "meters_per_unit")) == 0.01);
    assert_string_equal(json_string_value(json_object_get(report, "up_axis")), "Y");
    qmat_soup_uninit(&soup);
    json_decref(report);
  }
  json_t *report;
  qmat_soup soup = good_scene("#usda 1.0\n( metersPerUnit = 2 upAxis = \"Z\" )\n" MESH("m", ""), &report);
  assert_string_equal(warning_of(report, 0), "");
  assert_true(json_real_value(json_object_get(report, "meters_per_unit")) == 2);
  qmat_soup_uninit(&soup);
  json_decref(report);
}

static void test_expressions_in_asset_paths_are_named(void **state) {
  (void)state;
  json_t *report;
  qmat_soup soup = good_scene(
      "#usda 1.0\n( expressionVariables = { string V = \"a\" } )\n"
      "def \"x\" ( references = @`\"./${V}.usda\"`@ ) {}\n" MESH("m", ""),
      &report);
  assert_string_equal(warning_of(report, 0),
                      "/x: the reference @`\"./${V}.usda\"`@ is skipped: variable expressions are not read");
  qmat_soup_uninit(&soup);
  json_decref(report);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_operation_moves_a_point_as_by_hand),
      cmocka_unit_test(test_operations_that_are_none_are_errors_that_name_the_prim),
      cmocka_unit_test(test_mirrors_and_left_hands_turn_faces_and_cancel_out),
      cmocka_unit_test(test_holes_are_left_out_and_cages_are_reported),
      cmocka_unit_test(test_cages_keep_schemes_creases_corners_and_holes_in_world_space),
      cmocka_unit_test(test_what_is_hidden_inactive_or_for_other_purposes_is_skipped),
      cmocka_unit_test(test_what_nothing_defines_is_read_where_there_is_nothing_else),
      cmocka_unit_test(test_strength_of_arcs_is_local_inherit_variant_reference_payload_specialize),
      cmocka_unit_test(test_lists_of_references_are_edited_from_weak_to_strong),
      cmocka_unit_test(test_inheriting_from_a_class_defines_an_over),
      cmocka_unit_test(test_opinions_of_a_referring_layer_about_a_class_are_skipped_aloud),
      cmocka_unit_test(test_sublayers_without_end_are_refused),
      cmocka_unit_test(test_creases_have_one_sharpness_or_one_an_edge),
      cmocka_unit_test(test_members_of_a_package_that_overlap_are_refused),
      cmocka_unit_test(test_children_come_through_variants_nested_variants_and_references),
      cmocka_unit_test(test_a_variant_that_is_not_selected_is_left_out_aloud),
      cmocka_unit_test(test_references_are_beside_the_layer_of_the_stack_that_has_them),
      cmocka_unit_test(test_a_reference_brings_what_prims_above_its_target_bring),
      cmocka_unit_test(test_references_through_prims_above_end),
      cmocka_unit_test(test_files_are_found_beside_the_layer_that_names_them),
      cmocka_unit_test(test_samples_over_time_give_the_first_with_a_warning),
      cmocka_unit_test(test_broken_meshes_are_errors_that_name_the_prim),
      cmocka_unit_test(test_references_that_multiply_are_stopped),
      cmocka_unit_test(test_long_lists_take_little_time_and_can_be_cancelled),
      cmocka_unit_test(test_only_prototypes_with_instances_are_read),
      cmocka_unit_test(test_units_and_axes_that_are_none_are_named),
      cmocka_unit_test(test_expressions_in_asset_paths_are_named),
      cmocka_unit_test(test_a_package_is_read_and_its_members_refer_to_each_other),
      cmocka_unit_test(test_real_assets_are_read_whole_or_refused_by_name),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
