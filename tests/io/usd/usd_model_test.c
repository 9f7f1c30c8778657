/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Meshes of a USD scene, each once and in its own space, and their places: as read, and as written to glTF. */
#include "io/usd/usd_model.h"

#include "core/value.h"
#include "io/gltf/gltf.h"
#include "io/gltf/gltf_write.h"
#include "io/placement.h"
#include "io/save.h"
#include "io/usd/usd_medial.h"
#include "io/usd/usd_write.h"
#include "io/usd/usdz.h"
#include "tests/io/files.h"
#include "tests/io/medial_examples.h"
#include "tests/shapes.h"

#define AT(x, y, z) \
  "double3 xformOp:translate = (" #x "," #y "," #z ")\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n"
#define CUBE(name, more) "def Cube \"" name "\" { " more " }\n"

/* A scene that was read. */
typedef struct reading {
  qmat_context context;
  qmat_scene *scene;
  qmat_usd_meshes meshes;
  json_t *report;
  qmat_status status;
} reading;

static reading read_at(const char *path, const char *text, const char *choice) {
  reading r = {.scene = qmat_scene_new(), .report = json_object()};
  assert_true(r.scene && r.report);
  qmat_bytes bytes = memory_file(text, strlen(text));
  r.scene->name = qmat_strdup("thing");
  r.scene->format = qmat_strdup("usd");
  r.status = qmat_usd_read_meshes(&r.context, &bytes, path, choice, 16, r.scene, &r.meshes, r.report);
  free(bytes.data);
  if (r.status == QMAT_OK) assert_int_equal(qmat_value_seal(&r.context, &r.scene->base), QMAT_OK);
  return r;
}

static reading read_choice(const char *text, const char *choice) {
  return read_at("file.usda", text, choice);
}

static reading read_all(const char *text) {
  reading r = read_choice(text, "all");
  if (r.status == QMAT_OK) return r;
  char line[1024];
  qmat_error_format(&r.context.error, line, sizeof line);
  fail_msg("%s", line);
  return r;
}

static void release(reading *r) {
  qmat_usd_meshes_uninit(&r->meshes);
  qmat_value_release(&r->scene->base);
  json_decref(r->report);
  qmat_context_uninit(&r->context);
}

static void assert_place(const reading *r, size_t i, uint32_t mesh, const char *path, double x, double y, double z) {
  const double *m = r->scene->placements + 16 * i;
  assert_true(i < r->scene->placement_count);
  assert_int_equal(r->scene->placed[i], mesh);
  assert_string_equal(r->scene->placement_paths[i], path);
  if (fabs(m[12] - x) > 1e-9 || fabs(m[13] - y) > 1e-9 || fabs(m[14] - z) > 1e-9)
    fail_msg("place %zu is (%g, %g, %g)", i, m[12], m[13], m[14]);
}

static const char *warning_of(const reading *r, size_t i) {
  const char *text = json_string_value(json_array_get(json_object_get(r->report, "warnings"), i));
  return text ? text : "";
}

static void test_equal_meshes_are_one_mesh_in_several_places(void **state) {
  (void)state;
  reading r = read_all("#usda 1.0\nclass \"shared\" {\n" CUBE(
      "body",
      "") "}\n"
          "def Xform \"a\" ( references = </shared> ) { " AT(
              1, 0,
              0) "}\n"
                 "def Xform \"b\" ( references = </shared>\n instanceable = true ) { " AT(
                     2, 0,
                     0) "}\n"
                        "def Sphere \"ball\" { " AT(0, 5, 0) "}\n" CUBE("plain", AT(3, 0, 0))
                            CUBE("large", "double size = 4\n" AT(4, 0, 0)));
  assert_int_equal(r.meshes.count, 3);
  assert_int_equal(r.scene->mesh_count, 3);
  assert_int_equal(r.scene->placement_count, 5);
  assert_place(&r, 0, 0, "/a/body", 1, 0, 0);
  assert_place(&r, 1, 0, "/b/body", 2, 0, 0);
  assert_place(&r, 2, 1, "/ball", 0, 5, 0);
  assert_place(&r, 3, 0, "/plain", 3, 0, 0);
  assert_place(&r, 4, 2, "/large", 4, 0, 0);
  assert_string_equal(r.meshes.names[0], "/a/body");
  assert_string_equal(r.meshes.names[2], "/large");
  assert_int_equal(r.meshes.uses[0], 3);
  assert_int_equal(r.meshes.soups[0].facet_count, 6);
  for (size_t i = 0; i < 24; i++) assert_true(fabs(r.meshes.soups[0].positions[i]) == 1); /* its own space */
  assert_int_equal(json_integer_value(json_object_get(r.report, "instances")), 1);
  release(&r);
}

/* What a scene says of the prims below an instance does not count: instances share what their arcs bring. */
static void test_the_prims_below_an_instance_are_those_of_its_arcs(void **state) {
  (void)state;
#define BELOW(instanceable) \
  "#usda 1.0\nclass \"shared\" {\n" CUBE("body", "") "}\n"                                                        \
  "def Xform \"a\" ( references = </shared>\n instanceable = " instanceable " ) { over \"body\" { " AT(0, 0, 50) \
      " }\n" CUBE("more", "double size = 4") AT(1, 0, 0) "}\n"                                                  \
  "def Xform \"b\" ( instanceable = true ) { " CUBE("own", AT(0, 0, 7)) "}\n"
  reading r = read_all(BELOW("true"));
  assert_int_equal(r.scene->placement_count, 2);
  assert_place(&r, 0, 0, "/a/body", 1, 0, 0);
  assert_place(&r, 1, 0, "/b/own", 0, 0, 7); /* without arcs it is no instance */
  release(&r);
  r = read_all(BELOW("false"));
  assert_int_equal(r.scene->placement_count, 3);
  assert_place(&r, 0, 0, "/a/body", 1, 0, 50);
  release(&r);
}

static void test_a_mesh_is_chosen_by_path_end_or_number(void **state) {
  (void)state;
  static const char scene[] = "#usda 1.0\ndef Xform \"a\" {\n" CUBE("x", "") "def Sphere \"y\" {}\n}\n"
                              "def Xform \"b\" {\n" CUBE("x", "double size = 4") CUBE("z", AT(1, 2, 3)) "}\n";
  static const struct {
    const char *choice;
    uint32_t id;
    size_t places;
  } good[] = {{"/a/x", 0, 2}, {"y", 1, 1}, {"b/x", 2, 1}, {"z", 0, 2}, {"2", 2, 1}};
  for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
    reading r = read_choice(scene, good[i].choice);
    assert_int_equal(r.status, QMAT_OK);
    assert_int_equal(r.meshes.count, 1);
    assert_int_equal(r.scene->meshes[0], good[i].id);
    assert_int_equal(r.scene->placement_count, good[i].places);
    for (size_t k = 0; k < good[i].places; k++) assert_int_equal(r.scene->placed[k], 0);
    release(&r);
  }
  static const char *const bad[][2] = {{"x", "2 different meshes have a path that ends in 'x'"},
                                       {"3", "the scene has no mesh '3'"},
                                       {"/x", "the scene has no mesh '/x'"},
                                       {"", "the scene has no mesh ''"}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    reading r = read_choice(scene, bad[i][0]);
    assert_int_equal(r.status, QMAT_ERROR_USAGE);
    assert_string_equal(r.context.error.message, bad[i][1]);
    assert_string_equal(r.context.error.field, "mesh");
    release(&r);
  }
  reading r = read_choice(scene, "merged");
  assert_int_equal(r.scene->placement_count, 0);
  assert_int_equal(r.scene->mesh_count, 0);
  assert_int_equal(r.meshes.soups[0].facet_count, 6 + 6 + 6 + 16 * 8);
  release(&r);
}

#define INSTANCER(more)                                                                                         \
  "def PointInstancer \"many\" {\n" AT(10, 0, 0) more "def Xform \"kinds\" {\ndef Xform \"one\" { " AT(0, 1, 0) \
      CUBE("body", "") "}\ndef Sphere \"two\" {}\n" CUBE("unused", "double size = 9") "}\n}\n"
#define TWO "rel prototypes = [</many/kinds/one>, </many/kinds/two>]\n"

static void test_an_instancer_places_its_prototypes(void **state) {
  (void)state;
  /* Scaled by 2, turned by 90 degrees about z, moved: the prototype's own (0, 1, 0) goes to (-2, 0, 0). */
  reading r =
      read_all("#usda 1.0\n" INSTANCER(
          TWO "int[] protoIndices = [0, 1, 0]\npoint3f[] positions = [(0, 0, 0), (0, 0, 5), (0, 0, 7)]\n"
              "float3[] scales = [(1, 1, 1), (1, 1, 1), (2, 2, 2)]\n"
              "quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 1)]\n"));
  assert_int_equal(r.meshes.count, 2);
  assert_int_equal(r.scene->placement_count, 3);
  assert_place(&r, 0, 0, "/many/kinds/one/body", 10, 1, 0);
  assert_place(&r, 1, 0, "/many/kinds/one/body", 8, 0, 7);
  assert_place(&r, 2, 1, "/many/kinds/two", 10, 0, 5);
  assert_near(r.scene->placements[16 + 1], 2, 1e-9); /* x goes to y, twice as long */
  assert_near(r.scene->placements[16 + 4], -2, 1e-9);
  assert_int_equal(json_integer_value(json_object_get(r.report, "point_instances")), 3);
  release(&r);
  r =
      read_all("#usda 1.0\n" INSTANCER(
          TWO "int[] protoIndices = [0, 1, 0, 0]\npoint3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)]\n"
              "int64[] ids = [7, 8, 9, 10]\nint64[] invisibleIds = [8, 10]\n"));
  assert_int_equal(r.meshes.count, 1);
  assert_int_equal(r.scene->placement_count, 2);
  assert_place(&r, 1, 0, "/many/kinds/one/body", 12, 1, 0);
  release(&r);
}

/* Lists of ids edit those of weaker layers; the purpose of an instancer is that of what it places. */
static void test_inactive_instances_and_those_of_proxies_are_left_out(void **state) {
  (void)state;
  char folder[64], weak[256], scene[256];
  make_folder(folder);
  snprintf(weak, sizeof weak, "%s/weak.usda", folder);
  snprintf(scene, sizeof scene, "%s/scene.usda", folder);
  static const char below[] =
      "#usda 1.0\ndef PointInstancer \"many\" ( prepend inactiveIds = [1, 2] ) {\n"
      "rel prototypes = </many/one>\nint[] protoIndices = [0, 0, 0, 0]\n"
      "point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)]\n" CUBE("one", "") "}\n";
  write_file(weak, below, strlen(below));
  reading r = read_at(scene,
                      "#usda 1.0\n( subLayers = [@./weak.usda@] )\n"
                      "over \"many\" ( delete inactiveIds = [1]\n append inactiveIds = [3] ) {}\n"
                      "def PointInstancer \"rough\" { uniform token purpose = \"proxy\"\n"
                      "rel prototypes = </rough/one>\nint[] protoIndices = [0]\n"
                      "point3f[] positions = [(9, 0, 0)]\n" CUBE("one", "") "}\n",
                      "all");
  assert_int_equal(r.status, QMAT_OK);
  assert_int_equal(r.scene->placement_count, 2);
  assert_place(&r, 0, 0, "/many/one", 0, 0, 0);
  assert_place(&r, 1, 0, "/many/one", 1, 0, 0);
  release(&r);
  unlink(weak);
  rmdir(folder);
}

static void test_prototypes_are_found_through_references_and_instancers_nest(void **state) {
  (void)state;
  reading r = read_all(
      "#usda 1.0\nclass \"forest\" {\n"
      "def PointInstancer \"trees\" {\nrel prototypes = [<kinds/tree>]\nint[] protoIndices = [0, 0]\n"
      "point3f[] positions = [(0, 0, 0), (1, 0, 0)]\ndef Scope \"kinds\" {\n"
      "def PointInstancer \"tree\" {\nrel prototypes = </forest/trees/kinds/tree/leaf>\n"
      "int[] protoIndices = [0, 0]\npoint3f[] positions = [(0, 0, 0), (0, 5, 0)]\n"
      "def Sphere \"leaf\" {}\n}\n}\n}\n}\n"
      "def Xform \"here\" ( references = </forest> ) { " AT(100, 0, 0) "}\n");
  assert_int_equal(r.meshes.count, 1);
  assert_int_equal(r.scene->placement_count, 4);
  assert_place(&r, 0, 0, "/here/trees/kinds/tree/leaf", 100, 0, 0);
  assert_place(&r, 3, 0, "/here/trees/kinds/tree/leaf", 101, 5, 0);
  release(&r);
  r = read_all(
      "#usda 1.0\nclass \"c\" {\ndef PointInstancer \"p\" {\nrel prototypes = [</else/where>, </c/none>]\n"
      "int[] protoIndices = [0]\n}\n}\ndef \"d\" ( references = </c> ) {}\ndef Sphere \"s\" {}\n");
  assert_string_equal(warning_of(&r, 0),
                      "/d/p: the target </else/where> is skipped: it is outside of what is referred to");
  assert_string_equal(warning_of(&r, 1), "/d/p: a prototype is skipped: there is no such prim");
  release(&r);
}

static void test_broken_instancers_are_errors_that_name_the_prim(void **state) {
  (void)state;
  static const char *const cases[][2] = {
      {"int[] protoIndices = [0, 2]\n", "/many: instance 1 has prototype 2, but there are 2"},
      {"int[] protoIndices = [-1]\n", "/many: instance 0 has prototype -1, but there are 2"},
      {"int[] protoIndices = [0, 1]\npoint3f[] positions = [(0, 0, 0)]\n",
       "/many: positions has 1 elements for 2 instances"},
      {"int[] protoIndices = [0]\nquath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0)]\n",
       "/many: orientations has 2 elements for 1 instances"},
      {"int[] protoIndices = [0]\nfloat[] scales = [1]\n", "/many: scales has a value of the wrong type"},
      {"float[] protoIndices = [0]\n", "/many: protoIndices has a value of the wrong type"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[2048];
    snprintf(text, sizeof text, "#usda 1.0\n" INSTANCER(TWO "%s"), cases[i][0]);
    reading r = read_choice(text, "all");
    assert_int_equal(r.status, QMAT_ERROR_FORMAT);
    assert_string_equal(r.context.error.message, cases[i][1]);
    release(&r);
  }
  /* An instancer that is its own prototype ends. */
  reading r =
      read_choice("#usda 1.0\ndef PointInstancer \"p\" {\nrel prototypes = </p>\nint[] protoIndices = [0]\n}\n", "all");
  assert_int_equal(r.status, QMAT_ERROR_FORMAT);
  assert_string_equal(r.context.error.message, "/p: instancers are nested more than 16 deep");
  release(&r);
}

/* Of a target that an edit repeats, the first counts where it prepends, and the last where it appends. */
static void test_targets_that_an_edit_repeats_count_once(void **state) {
  (void)state;
  static const struct {
    const char *edit;
    bool large_is_first;
    size_t kinds;
  } cases[] = {
      {"prepend rel prototypes = [</p/large>, </p/large>]", true, 1},
      {"prepend rel prototypes = [</p/large>, </p/small>, </p/large>]", true, 2},
      {"append rel prototypes = [</p/large>, </p/small>, </p/large>]", false, 2},
      {"add rel prototypes = [</p/large>, </p/small>, </p/large>]", true, 2},
      {"rel prototypes = [</p/large>, </p/small>, </p/large>]", true, 3}, /* in the order of protoIndices */
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[1024];
    for (size_t index = 0; index <= cases[i].kinds; index++) {
      snprintf(text, sizeof text,
               "#usda 1.0\ndef PointInstancer \"p\" {\n%s\nint[] protoIndices = [%zu]\n"
               "point3f[] positions = [(0, 0, 0)]\n" CUBE("small", "") CUBE("large", "double size = 4") "}\n",
               cases[i].edit, index);
      reading r = read_choice(text, "all");
      assert_int_equal(r.status, index < cases[i].kinds ? QMAT_OK : QMAT_ERROR_FORMAT);
      if (r.status == QMAT_OK)
        assert_string_equal(r.scene->placement_paths[0],
                            (index % 2 == 0) == cases[i].large_is_first ? "/p/large" : "/p/small");
      release(&r);
    }
  }
}

/* A stronger layer moves targets to the ends of the weaker list, or leaves them where they are. */
static void test_targets_are_edited_from_weak_to_strong(void **state) {
  (void)state;
  static const struct {
    const char *edit, *order;
  } cases[] = {{"prepend rel prototypes = [</p/c>, </p/d>]", "cdab"},
               {"append rel prototypes = [</p/a>, </p/d>]", "bcad"},
               {"add rel prototypes = [</p/a>, </p/d>]", "abcd"},
               {"delete rel prototypes = [</p/b>]", "ac"},
               {"rel prototypes = [</p/d>]", "d"}};
  char folder[64], weak[256], scene[256], text[512];
  make_folder(folder);
  snprintf(weak, sizeof weak, "%s/weak.usda", folder);
  snprintf(scene, sizeof scene, "%s/scene.usda", folder);
  static const char below[] = "#usda 1.0\ndef PointInstancer \"p\" {\nrel prototypes = [</p/a>, </p/b>, </p/c>]\n" CUBE(
      "a", "") CUBE("b", "double size = 3") CUBE("c", "double size = 4") CUBE("d", "double size = 5") "}\n";
  write_file(weak, below, strlen(below));
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    for (size_t index = 0; index < strlen(cases[i].order); index++) {
      snprintf(text, sizeof text,
               "#usda 1.0\n( subLayers = [@./weak.usda@] )\nover \"p\" {\n%s\nint[] protoIndices = [%zu]\n"
               "point3f[] positions = [(0, 0, 0)]\n}\n",
               cases[i].edit, index);
      reading r = read_at(scene, text, "all");
      assert_int_equal(r.status, QMAT_OK);
      assert_int_equal(r.scene->placement_paths[0][3], cases[i].order[index]);
      release(&r);
    }
  }
  unlink(weak);
  rmdir(folder);
}

/* Thousands of relative targets below a prim with a long name are refused before they fill the memory. */
static void test_targets_with_too_many_bytes_are_refused(void **state) {
  (void)state;
  enum { NAME = 60000, TARGETS = 1500 };
  char *text = malloc(NAME + 16 * TARGETS + 512);
  assert_non_null(text);
  int used = sprintf(text, "#usda 1.0\ndef PointInstancer \"");
  memset(text + used, 'n', NAME);
  used += NAME;
  used += sprintf(text + used, "\" {\nint[] protoIndices = [0]\nrel prototypes = [");
  for (int i = 0; i < TARGETS; i++) used += sprintf(text + used, "<a%d>, ", i);
  sprintf(text + used, "]\n}\n");
  reading r = read_choice(text, "all");
  assert_int_equal(r.status, QMAT_ERROR_FORMAT);
  assert_non_null(strstr(r.context.error.message, "the targets of a relationship have paths of more than"));
  release(&r);
  free(text);
}

/* An instancer with an error is left out of a scene that has more; its prototypes count one way or the other. */
static void test_a_broken_instancer_is_left_out_of_a_scene_with_more(void **state) {
  (void)state;
  reading r = read_all("#usda 1.0\n" CUBE("first", "") INSTANCER(TWO "int[] protoIndices = [0, 5]\n")
                           CUBE("last", "double size = 4"));
  assert_int_equal(r.scene->placement_count, 2);
  assert_place(&r, 0, 0, "/first", 0, 0, 0);
  assert_place(&r, 1, 1, "/last", 0, 0, 0);
  assert_string_equal(warning_of(&r, 0),
                      "/many: left out with all its instances: instance 1 has prototype 5, but there are 2");
  assert_string_equal(warning_of(&r, 1), "");
  assert_int_equal(r.context.error.status, QMAT_OK);
  release(&r);
}

/* Places of all kinds come back through a glTF file as they were: also mirrors, and what shears. */
static void test_places_in_gltf_are_where_the_scene_has_them(void **state) {
  (void)state;
  reading r = read_all("#usda 1.0\n( metersPerUnit = 0.01 upAxis = \"Z\" )\n" CUBE("plain", "") CUBE(
      "moved",
      AT(10, 20, 30)) "def Xform \"wide\" { float3 xformOp:scale = (1, 5, 1)\nuniform token[] xformOpOrder = "
                      "[\"xformOp:scale\"]\n" CUBE(
                          "sheared",
                          "float xformOp:rotateZ = 30\nuniform token[] xformOpOrder = "
                          "[\"xformOp:rotateZ\"]\n") "}\n" CUBE("mirrored",
                                                                "float3 xformOp:scale = (-1, 2, "
                                                                "1)\nfloat xformOp:rotateX = "
                                                                "20\nuniform token[] xformOpOrder = "
                                                                "[\"xformOp:rotateX\", "
                                                                "\"xformOp:scale\"]\n"));
  assert_int_equal(r.meshes.count, 1);
  r.scene->base.sealed = false;
  r.scene->meters_per_unit = 0.01;
  r.scene->is_z_up = true;
  qmat_medial *medial = example_medial(3);
  qmat_mesh *box = shape_new();
  shape_add_box(box, -1, -1, -1, 1, 1, 1, false);
  shape_seal(box);
  const qmat_gltf_addition addition = {
      .medial = medial,
      .skin = box,
      .options = {.binary = true, .quantisation = 1e-3, .name = "plain", .meters_per_unit = 0.01, .is_z_up = true}};
  qmat_file *file;
  assert_int_equal(qmat_gltf_write_places(&r.context, r.scene, &addition, 1, &file), QMAT_OK);
  qmat_soup soup = {0};
  assert_int_equal(qmat_gltf_parse(&r.context, file->parts[0].bytes, file->parts[0].size, "file", &soup, NULL),
                   QMAT_OK);
  assert_int_equal(soup.vertex_count, 4 * box->vertex_count);
  for (size_t i = 0; i < soup.vertex_count; i++) {
    const double *m = r.scene->placements + 16 * (i / box->vertex_count),
                 *p = box->positions + 3 * (i % box->vertex_count);
    double at[3];
    for (int k = 0; k < 3; k++) at[k] = 0.01 * (p[0] * m[k] + p[1] * m[4 + k] + p[2] * m[8 + k] + m[12 + k]);
    assert_near(soup.positions[3 * i], at[0], 1e-7);
    assert_near(soup.positions[3 * i + 1], at[2], 1e-7);
    assert_near(soup.positions[3 * i + 2], -at[1], 1e-7);
  }
  qmat_soup_uninit(&soup);
  qmat_value_release(&file->base);
  qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
  release(&r);
}

static void test_a_transform_is_split_into_a_rotation_and_a_plain_one(void **state) {
  (void)state;
  const double m[16] = {1, 2, 0.5, 0, -1, 3, 0.25, 0, 0.1, 0.2, -2, 0, 7, 8, 9, 1};
  double inner[16], outer[16];
  assert_false(qmat_placement_is_plain(m));
  qmat_placement_split(m, inner, outer);
  assert_true(qmat_placement_is_plain(outer) && qmat_placement_is_plain(inner));
  assert_near(qmat_placement_stretch(inner), 1, 1e-12);
  assert_near(qmat_placement_stretch(outer), qmat_placement_stretch(m), 1e-12);
  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < 4; j++) {
      double sum = 0;
      for (int k = 0; k < 4; k++) sum += inner[4 * i + k] * outer[4 * k + j];
      assert_near(sum, m[4 * i + j], 1e-12);
    }
  }
}

/* ---- layers over a scene ---- */

/* Adds the same medial mesh to all meshes of a scene. The caller releases the file. */
static qmat_file *write_layer(reading *r, const qmat_medial *medial, const qmat_mesh *skin, qmat_usd_form form) {
  qmat_usd_addition additions[8] = {{0}};
  for (size_t i = 0; i < r->meshes.count; i++)
    additions[i] =
        (qmat_usd_addition){.medial = i == 2 ? NULL : medial,
                            .skin = skin,
                            .options = {.form = form, .name = "thing", .prim = r->meshes.names[i], .moved = 1e-3}};
  qmat_file *file;
  if (qmat_usd_write_layer(&r->context, r->scene, additions, r->meshes.count, NULL, &file) != QMAT_OK)
    fail_msg("%s", r->context.error.message);
  return file;
}

#define LAYERED                                                                                                       \
  "#usda 1.0\n( defaultPrim = \"a\" metersPerUnit = 0.5 upAxis = \"Z\" startTimeCode = 3 )\n"                         \
  "def Xform \"a\" ( instanceable = true ) {\n" AT(1, 0, 0)                                                           \
      CUBE("x", AT(0, 2, 0)) "def Xform \"ab\" {\n" CUBE("x", "") "}\n}\n" CUBE("b", "double size = 4\n" AT(7, 0, 0)) \
          CUBE("c", "double size = 6")

/* A layer has what the scene has at the same places, and the medial mesh below each prim with a mesh. */
static void test_a_layer_adds_medial_meshes_and_takes_nothing(void **state) {
  (void)state;
  char folder[64], path[256];
  make_folder(folder);
  reading before = read_all(LAYERED);
  before.scene->is_z_up = true;
  qmat_medial *medial = example_medial(5);
  qmat_mesh *skin = shape_seal(shape_box(1, 1, 1));
  static const char *const formats[] = {"usda", "usdc", "usdz"};
  for (qmat_usd_form form = QMAT_USD_TEXT; form <= QMAT_USD_PACKAGE; form++) {
    qmat_file *file = write_layer(&before, medial, skin, form);
    assert_int_equal(file->part_count, form == QMAT_USD_PACKAGE ? 1 : 2);
    assert_string_equal(file->format, formats[form]);
    if (form != QMAT_USD_PACKAGE) {
      assert_string_equal(file->parts[1].name, "original.usda");
      assert_int_equal(file->parts[1].size, strlen(LAYERED));
      assert_memory_equal(file->parts[1].bytes, LAYERED, strlen(LAYERED));
      snprintf(path, sizeof path, "%s/original.usda", folder);
      FILE *original = fopen(path, "wb");
      assert_non_null(original);
      assert_int_equal(fwrite(LAYERED, 1, strlen(LAYERED), original), strlen(LAYERED));
      fclose(original);
    }
    snprintf(path, sizeof path, "%s/layer", folder);
    qmat_context context = {0};
    qmat_bytes bytes = memory_file(file->parts[0].bytes, file->parts[0].size);
    qmat_scene *scene = qmat_scene_new();
    qmat_usd_meshes meshes;
    json_t *report = json_object(), *names, *facts = json_object();
    assert_int_equal(qmat_usd_read_meshes(&context, &bytes, path, "all", 16, scene, &meshes, report), QMAT_OK);
    /* Read as a scene, it is the original: what qmat has added is no part of it. */
    const json_t *warnings = json_object_get(report, "warnings");
    assert_int_equal(json_array_size(warnings), 1);
    assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)),
                           "what an earlier run has added is left out: an output as USD is a layer over 'original"));
    assert_int_equal(scene->part_count, 1);
    assert_int_equal(scene->parts[0].size, strlen(LAYERED));
    assert_memory_equal(scene->parts[0].bytes, LAYERED, strlen(LAYERED));
    assert_true(json_real_value(json_object_get(report, "meters_per_unit")) == 0.5);
    assert_string_equal(json_string_value(json_object_get(report, "up_axis")), "Z");
    assert_int_equal(json_integer_value(json_object_get(report, "instances")), 0);
    assert_int_equal(scene->placement_count, before.scene->placement_count);
    for (size_t i = 0; i < scene->placement_count; i++) {
      assert_string_equal(scene->placement_paths[i], before.scene->placement_paths[i]);
      assert_memory_equal(scene->placements + 16 * i, before.scene->placements + 16 * i, 16 * sizeof(double));
    }
    assert_int_equal(qmat_usd_list_medials(&context, &bytes, path, &names), QMAT_OK);
    assert_int_equal(json_array_size(names), 2); /* mesh 2 got none */
    qmat_medial *read;
    assert_int_equal(qmat_usd_read_medial(&context, &bytes, path, "medial_1", &read, facts), QMAT_OK);
    assert_int_equal(read->sphere_count, medial->sphere_count);
    assert_true(qmat_medial_move(medial, read) < 1e-6);
    assert_string_equal(json_string_value(json_object_get(facts, "qmat_prim")), "/b");
    qmat_value_release(&read->base);
    json_decref(names);
    json_decref(facts);
    json_decref(report);
    qmat_usd_meshes_uninit(&meshes);
    qmat_value_release(&scene->base);
    free(bytes.data);
    qmat_value_release(&file->base);
    qmat_context_uninit(&context);
  }
  snprintf(path, sizeof path, "%s/original.usda", folder);
  unlink(path);
  assert_int_equal(rmdir(folder), 0);
  qmat_value_release(&skin->base);
  qmat_value_release(&medial->base);
  release(&before);
}

/* All tiles of a texture are kept with the scene; a file that is not an image is named once. */
static void test_tiles_are_kept_and_other_files_are_named(void **state) {
  (void)state;
  static const char *const names[] = {"t.1001.png", "t.1100.png", "t.1101.png", "look.mdl"};
  static const uint8_t png[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  char folder[64], path[4][256], scene[256], warning[512];
  make_folder(folder);
  for (int i = 0; i < 4; i++) {
    snprintf(path[i], sizeof path[i], "%s/%s", folder, names[i]);
    write_file(path[i], i < 3 ? (const char *)png : "mdl 1.0;", sizeof png);
  }
  snprintf(scene, sizeof scene, "%s/scene.usda", folder);
  reading r = read_at(scene,
                      "#usda 1.0\n" CUBE("a", "") "def Shader \"s\" { asset inputs:file = @./t.<UDIM>.png@\n"
                                                 "asset info:mdl:sourceAsset = @./look.mdl@\n"
                                                 "asset other = @look.mdl@\nasset gone = @none.png@ }\n",
                      "all");
  assert_int_equal(r.status, QMAT_OK);
  snprintf(warning, sizeof warning, "'%s' is not kept for an output as USD: it is not an image", path[3]);
  assert_string_equal(warning_of(&r, 0), warning);
  assert_string_equal(warning_of(&r, 1), "");
  assert_int_equal(r.scene->part_count, 1);
  const qmat_bytes bytes = {.data = r.scene->parts[0].bytes, .size = r.scene->parts[0].size};
  qmat_usdz archive;
  assert_int_equal(qmat_usdz_open(&r.context, &bytes, "kept", &archive), QMAT_OK);
  assert_int_equal(archive.member_count, 3);
  assert_string_equal(archive.members[0].name, "scene.usda");
  assert_string_equal(archive.members[1].name, names[0]);
  assert_string_equal(archive.members[2].name, names[1]);
  qmat_usdz_uninit(&archive);
  release(&r);
  for (int i = 0; i < 4; i++) unlink(path[i]);
  assert_int_equal(rmdir(folder), 0);
}

/* A copy of a file's bytes as text; free with qmat_free. */
static char *text_of(const qmat_file *file) {
  char *text = qmat_alloc(file->parts[0].size + 1, 1);
  memcpy(text, file->parts[0].bytes, file->parts[0].size);
  text[file->parts[0].size] = '\0';
  return text;
}

/* The overs of a path that begins with another path are below its prim, and each prim is opened once. */
static void test_the_prims_of_a_layer_are_opened_once(void **state) {
  (void)state;
  reading r =
      read_all("#usda 1.0\n" CUBE("a", CUBE("x", "")) CUBE("a1", "") "def \"b\" { def \"a\" {" CUBE("x", "") "} }\n");
  qmat_medial *medial = example_medial(1);
  qmat_file *file = write_layer(&r, medial, NULL, QMAT_USD_TEXT);
  char *text = text_of(file);
  const char *overs = strstr(text, "\n}\n\nover ");
  assert_non_null(overs);
#define CHILD(indent)                                                                                                  \
  indent "def Xform \"medial_0\" (\n" indent "    prepend references = </medial_0>\n" indent ")\n" indent "{\n" indent \
         "}\n"
  assert_string_equal(overs + 4, "over \"a\"\n{\n" CHILD("    ") "    over \"x\"\n    {\n" CHILD("        ") "    }\n}\n"
                                 "over \"a1\"\n{\n" CHILD("    ") "}\n"
                                 "over \"b\"\n{\n    over \"a\"\n    {\n        over \"x\"\n        {\n"
                                 CHILD("            ") "        }\n    }\n}\n");
  qmat_free(text);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  release(&r);
}

/* A scene that was flattened after an earlier run has its medial mesh below the prim of the mesh. */
static void test_names_of_added_prims_are_new_and_earlier_medial_meshes_are_hidden(void **state) {
  (void)state;
  reading r = read_all(
      "#usda 1.0\n"
      "def Cube \"a\"\n{\n    double size = 1\n"
      "    def Xform \"medial_0\" (\n        customData = {\n            string qmat_version = \"0.1.0\"\n        }\n  "
      "  )\n"
      "    {\n        def Points \"spheres\"\n        {\n            point3f[] points = [(0, 0, 0), (1, 0, 0)]\n"
      "            float[] widths = [1, 1]\n        }\n    }\n}\n"
      "def Xform \"medial2_1\"\n{\n}\n");
  qmat_medial *medial = example_medial(1);
  qmat_file *file = write_layer(&r, medial, NULL, QMAT_USD_TEXT);
  char *text = text_of(file);
  const char *overs = strstr(text, "\n}\n\nover ");
  assert_non_null(overs);
  assert_string_equal(overs + 4,
                      "over \"a\"\n{\n    over \"medial_0\" (\n        active = false\n    )\n    {\n    }\n"
                      "    def Xform \"medial3_0\" (\n        prepend references = </medial3_0>\n    )\n"
                      "    {\n    }\n}\n");
  char folder[] = "/tmp/qmat_test_XXXXXX", path[64];
  assert_non_null(mkdtemp(folder));
  snprintf(path, sizeof path, "%s/over.usda", folder);
  qmat_context context = {0};
  assert_int_equal(qmat_file_save(&context, file, path), QMAT_OK);
  qmat_bytes bytes;
  assert_int_equal(qmat_bytes_read_file(&context, path, &bytes), QMAT_OK);
  qmat_medial *found;
  json_t *facts = json_object();
  assert_int_equal(qmat_usd_read_medial(&context, &bytes, path, NULL, &found, facts), QMAT_OK);
  assert_int_equal(found->sphere_count, medial->sphere_count);
  qmat_value_release(&found->base);
  json_decref(facts);
  qmat_bytes_uninit(&bytes);
  unlink(path);
  snprintf(path, sizeof path, "%s/%s", folder, file->parts[1].name);
  unlink(path);
  assert_int_equal(rmdir(folder), 0);
  qmat_context_uninit(&context);
  qmat_free(text);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  release(&r);
}

/* Saves a file and reads its only medial mesh. The files are removed again. */
static size_t spheres_of_saved(const qmat_file *file, const char *folder) {
  char path[256], side[300];
  snprintf(path, sizeof path, "%s/over.usda", folder);
  snprintf(side, sizeof side, "%s/%s", folder, file->parts[1].name);
  qmat_context context = {0};
  qmat_bytes bytes;
  qmat_medial *found;
  assert_int_equal(qmat_file_save(&context, file, path), QMAT_OK);
  assert_int_equal(qmat_bytes_read_file(&context, path, &bytes), QMAT_OK);
  if (qmat_usd_read_medial(&context, &bytes, path, NULL, &found, NULL) != QMAT_OK)
    fail_msg("%s", context.error.message);
  const size_t count = found->sphere_count;
  qmat_value_release(&found->base);
  qmat_bytes_uninit(&bytes);
  qmat_context_uninit(&context);
  unlink(path);
  unlink(side);
  return count;
}

/* A layer of an earlier run over one cube, with cones, a skin and colliders. */
static const char earlier[] =
    "#usda 1.0\n( defaultPrim = \"a\" )\n"
    "class Xform \"medial_0\" ( customData = { string qmat_version = \"0.3.0\" string qmat_prim = \"/a/c\" } ) {\n"
    "def Mesh \"skin\" { point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\nint[] faceVertexCounts = [3]\n"
    "int[] faceVertexIndices = [0, 1, 2] }\n"
    "def Points \"spheres\" { point3f[] points = [(0, 0, 0), (1, 0, 0)]\nfloat[] primvars:radius = [1, 1] }\n"
    "def BasisCurves \"cones\" { int[] primvars:qmat:sphere = [0, 1] }\n"
    "def Scope \"colliders\" { def Sphere \"shape_01\" { uniform token purpose = \"guide\" } }\n}\n"
    "def Xform \"a\" {\n" CUBE("c", "def Xform \"medial_0\" ( references = </medial_0> ) {}") "}\n";

/* A layer over a scene that refers to layers of earlier runs hides what these have added: cones, skins and colliders of
 * it would be parts of the new medial mesh, too. */
static void test_additions_of_layers_that_a_scene_refers_to_are_hidden(void **state) {
  (void)state;
  char folder[64], asset[256], scene[256];
  make_folder(folder);
  snprintf(asset, sizeof asset, "%s/asset.usda", folder);
  snprintf(scene, sizeof scene, "%s/scene.usda", folder);
  write_file(asset, earlier, strlen(earlier));
  reading r =
      read_at(scene,
              "#usda 1.0\ndef Xform \"w\" {\ndef \"x\" ( references = @asset.usda@ ) {}\n"
              "def \"y\" ( references = @asset.usda@ ) { over \"c\" { over \"medial_0\" ( active = false ) {} } }\n"
              "}\n",
              "all");
  assert_int_equal(r.status, QMAT_OK);
  assert_int_equal(r.scene->placement_count, 2); /* not the skins */
  qmat_medial *medial = example_medial(1);
  qmat_file *file = write_layer(&r, medial, NULL, QMAT_USD_TEXT);
  char *text = text_of(file);
#define OVER(name, hidden)                                                                                    \
  "    over \"" name "\"\n    {\n        over \"c\"\n        {\n" hidden                                      \
  "            def Xform \"medial2_0\" (\n                prepend references = </medial2_0>\n            )\n" \
  "            {\n            }\n        }\n    }\n"
  assert_non_null(
      strstr(text, "over \"w\"\n{\n" OVER("x",
                                          "            over \"medial_0\" (\n                active = false\n"
                                          "            )\n            {\n            }\n") OVER("y", "") "}\n"));
#undef OVER
  assert_int_equal(spheres_of_saved(file, folder), 1);
  qmat_free(text);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  release(&r);
  unlink(asset);
  assert_int_equal(rmdir(folder), 0);
}

/* The medial mesh of a variant stays when another one is selected: a warning names the prim and the variant. */
static void test_a_shape_of_a_variant_is_named_when_a_layer_is_written(void **state) {
  (void)state;
  reading r = read_all(
      "#usda 1.0\nclass \"bits\" {\n" CUBE("far", "double size = 3") "}\n"
      "def Xform \"m\" ( variants = { string look = \"red\" string size = \"big\" }\n"
      "prepend variantSets = [\"look\", \"size\"] ) {\n" CUBE("always", "")
      "variantSet \"look\" = { \"red\" {" CUBE("inner", "") "over \"always\" { color3f[] primvars:displayColor = [(1, 0, 0)] }\n"
      "def \"deep\" ( references = </bits> ) {} } \"blue\" { } }\n"
      "variantSet \"size\" = { \"big\" { def \"from\" ( references = </bits> ) {} } }\n}\n" CUBE("plain", ""));
  assert_int_equal(r.scene->placement_count, 5);
  qmat_medial *medial = example_medial(1);
  qmat_usd_addition additions[2];
  for (int i = 0; i < 2; i++)
    additions[i] = (qmat_usd_addition){.medial = medial, .options = {.prim = r.meshes.names[i], .moved = 1e-3}};
  json_t *report = json_object();
  qmat_file *file;
  assert_int_equal(r.meshes.count, 2);
  assert_int_equal(qmat_usd_write_layer(&r.context, r.scene, additions, 2, report, &file), QMAT_OK);
  const json_t *warnings = json_object_get(report, "warnings");
  assert_int_equal(json_array_size(warnings), 3);
  static const char *const expected[] = {"/m/deep/far: its shape is that of the variant 'red' of 'look', but",
                                         "/m/from/far: its shape is that of the variant 'big' of 'size', but",
                                         "/m/inner: its shape is that of the variant 'red' of 'look', but"};
  for (size_t i = 0; i < 3; i++)
    assert_memory_equal(json_string_value(json_array_get(warnings, i)), expected[i], strlen(expected[i]));
  json_decref(report);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  release(&r);
}

/* The numbers after `key` in what the layer says of the prim that `over` opens; NAN where it says nothing there. */
static void numbers_of(const char *text, const char *over, const char *key, double numbers[3]) {
  const char *prim = strstr(text, over), *at = prim ? strstr(prim, key) : NULL;
  assert_non_null(prim);
  const char *child = strstr(prim, "def Xform");
  for (int k = 0; k < 3; k++) numbers[k] = NAN;
  if (!at || at > child) return;
  at += strlen(key);
  for (int k = 0; k < 3 && *at != '\n'; k++) {
    char *end;
    numbers[k] = strtod(at + strspn(at, "(, "), &end);
    at = end;
  }
}

/* Each place has the mass and the inertia of its own transform, in the scene's units; the scene's own bodies, what is
 * below them, and colliders that do not move stay as they are. */
static void test_prims_with_colliders_are_bodies_with_the_mass_of_their_place(void **state) {
  (void)state;
  reading r = read_all(
      "#usda 1.0\n( kilogramsPerUnit = 0.001 metersPerUnit = 0.01 )\n" CUBE("plain", CUBE("part", "")) CUBE(
          "turned",
          "float xformOp:rotateZ = 90\nfloat3 xformOp:scale = (2, -1, 1)\n"
          "uniform token[] xformOpOrder = [\"xformOp:rotateZ\", \"xformOp:scale\"]\n")
      "def Xform \"body\" ( prepend apiSchemas = [\"PhysicsRigidBodyAPI\"] ) {" CUBE("own", "") "}\n"
      "def Cube \"wall\" ( apiSchemas = [\"PhysicsCollisionAPI\"] ) {}\n"
      "class \"giver\" ( apiSchemas = [\"PhysicsRigidBodyAPI\"] ) {}\n"
      "def Cube \"freed\" ( delete apiSchemas = [\"PhysicsRigidBodyAPI\"] inherits = </giver> ) {}\n"
      "def Cube \"heir\" ( inherits = </giver> ) {}\n");
  static const uint32_t stated[] = {0, 0, 0, 1, 1, 0, 1};
  assert_int_equal(r.scene->placement_count, 7);
  assert_memory_equal(r.scene->placement_bodies, stated, sizeof stated);
  r.scene->meters_per_unit = 0.01;
  qmat_medial *medial = example_medial(1);
  double body[10] = {2, 1, 2, 3, 5, 4, 3, 0, 0, 0}; /* the second moments are 1, 2, 3 */
  const qmat_colliders colliders = {.body_count = 1, .body = body};
  for (int dynamic = 0; dynamic < 2; dynamic++) {
    const qmat_usd_addition addition = {.medial = medial,
                                        .options = {.form = QMAT_USD_TEXT,
                                                    .name = "thing",
                                                    .prim = "/plain",
                                                    .moved = 1e-3,
                                                    .errors = {.meters_per_unit = 0.02},
                                                    .dynamic = dynamic,
                                                    .colliders = &colliders}};
    qmat_file *file;
    assert_int_equal(qmat_usd_write_layer(&r.context, r.scene, &addition, 1, NULL, &file), QMAT_OK);
    char *text = text_of(file);
    const char *class_end = strstr(text, "\n}\n");
    assert_non_null(strstr(text, "def Scope \"colliders\""));
    assert_true(!strstr(text, "PhysicsRigidBodyAPI") || strstr(text, "PhysicsRigidBodyAPI") > class_end);
    const struct {
      const char *over;
      double mass, inertia[3];
    } expected[] = {{"over \"plain\"", 250, {625, 500, 375}}, /* an eighth: the mass is that of the double size */
                    {"over \"turned\"", 500, {1250, 1750, 1500}}, {"over \"freed\"", 250, {625, 500, 375}},
                    {"over \"part\"", NAN, {NAN, NAN, NAN}}, /* a part of the body above it */
                    {"over \"own\"", NAN, {NAN, NAN, NAN}},       {"over \"wall\"", NAN, {NAN, NAN, NAN}}};
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
      double mass[3], inertia[3], centre[3];
      numbers_of(text, expected[i].over, "float physics:mass = ", mass);
      numbers_of(text, expected[i].over, "physics:diagonalInertia = ", inertia);
      numbers_of(text, expected[i].over, "physics:centerOfMass = ", centre);
      const bool is_body = dynamic && !isnan(expected[i].mass);
      for (int k = 0; k < 3; k++) {
        assert_true(isnan(inertia[k]) == !is_body && isnan(centre[k]) == !is_body);
        if (is_body) assert_near(inertia[k], expected[i].inertia[k], 1e-9);
        if (is_body) assert_near(centre[k], k + 1, 0);
      }
      if (is_body) assert_near(mass[0], expected[i].mass, 1e-9);
    }
    qmat_free(text);
    qmat_value_release(&file->base);
  }
  qmat_value_release(&medial->base);
  release(&r);
}

/* A simulator would let a dynamic body fall off its animation. */
static void test_bodies_that_an_animation_moves_are_kinematic(void **state) {
  (void)state;
#define MOVES(operation, other)                                        \
  "double3 " operation ".timeSamples = { 0: (0, 0, 0), 24: (0, " other \
  ", 0) }\nuniform token[] xformOpOrder = [\"" operation "\"]\n"
  reading r = read_all(
      "#usda 1.0\n()\n" CUBE("still", AT(1, 0, 0))
          CUBE("own", MOVES("xformOp:translate", "3")) "def Xform \"carrier\" { " MOVES("xformOp:translate:way", "1")
              CUBE("carried", "") CUBE("freed", "uniform token[] xformOpOrder = [\"!resetXformStack!\"]\n") "}\n" CUBE(
                  "sampled", MOVES("xformOp:translate", "0")) /* a sample per frame of what stays */
      CUBE("back",
           "double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 24: (0, 1, 0) }\n"
           "uniform token[] xformOpOrder = [\"!invert!xformOp:translate\"]\n")
          CUBE("unused", "double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 24: (0, 1, 0) }\n"));
#undef MOVES
  static const struct {
    const char *over;
    bool is_kinematic;
  } expected[] = {{"over \"still\"", false}, {"over \"own\"", true},      {"over \"carried\"", true},
                  {"over \"freed\"", false}, {"over \"sampled\"", false}, {"over \"back\"", true},
                  {"over \"unused\"", false}};
  qmat_medial *medial = example_medial(1);
  double body[10] = {2, 1, 2, 3, 5, 4, 3, 0, 0, 0};
  const qmat_colliders colliders = {.body_count = 1, .body = body};
  for (int form = QMAT_USD_TEXT; form <= QMAT_USD_CRATE; form++) {
    const qmat_usd_addition addition = {.medial = medial,
                                        .options = {.form = (qmat_usd_form)form,
                                                    .moved = 1e-3,
                                                    .errors = {.meters_per_unit = 1},
                                                    .dynamic = true,
                                                    .colliders = &colliders}};
    qmat_file *file;
    assert_int_equal(r.scene->mesh_count, 1);
    assert_int_equal(qmat_usd_write_layer(&r.context, r.scene, &addition, 1, NULL, &file), QMAT_OK);
    char *text = form == QMAT_USD_TEXT ? text_of(file) : NULL;
    for (size_t i = 0; text && i < sizeof expected / sizeof *expected; i++) {
      const char *over = strstr(text, expected[i].over), *mass = strstr(over, "physics:mass"),
                 *kinematic = strstr(over, "bool physics:kinematicEnabled = true\n");
      assert_true(over && mass);
      assert_int_equal(kinematic != NULL && kinematic < strstr(mass, "}"), expected[i].is_kinematic);
    }
    qmat_free(text);
    qmat_value_release(&file->base);
  }
  qmat_value_release(&medial->base);
  release(&r);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_names_of_added_prims_are_new_and_earlier_medial_meshes_are_hidden),
      cmocka_unit_test(test_equal_meshes_are_one_mesh_in_several_places),
      cmocka_unit_test(test_the_prims_below_an_instance_are_those_of_its_arcs),
      cmocka_unit_test(test_a_mesh_is_chosen_by_path_end_or_number),
      cmocka_unit_test(test_an_instancer_places_its_prototypes),
      cmocka_unit_test(test_inactive_instances_and_those_of_proxies_are_left_out),
      cmocka_unit_test(test_prototypes_are_found_through_references_and_instancers_nest),
      cmocka_unit_test(test_broken_instancers_are_errors_that_name_the_prim),
      cmocka_unit_test(test_targets_that_an_edit_repeats_count_once),
      cmocka_unit_test(test_targets_are_edited_from_weak_to_strong),
      cmocka_unit_test(test_targets_with_too_many_bytes_are_refused),
      cmocka_unit_test(test_a_broken_instancer_is_left_out_of_a_scene_with_more),
      cmocka_unit_test(test_places_in_gltf_are_where_the_scene_has_them),
      cmocka_unit_test(test_a_layer_adds_medial_meshes_and_takes_nothing),
      cmocka_unit_test(test_tiles_are_kept_and_other_files_are_named),
      cmocka_unit_test(test_the_prims_of_a_layer_are_opened_once),
      cmocka_unit_test(test_additions_of_layers_that_a_scene_refers_to_are_hidden),
      cmocka_unit_test(test_a_shape_of_a_variant_is_named_when_a_layer_is_written),
      cmocka_unit_test(test_prims_with_colliders_are_bodies_with_the_mass_of_their_place),
      cmocka_unit_test(test_bodies_that_an_animation_moves_are_kinematic),
      cmocka_unit_test(test_a_transform_is_split_into_a_rotation_and_a_plain_one),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
