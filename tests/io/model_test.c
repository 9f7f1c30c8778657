/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/model.h"
#include "io/extract.h"

#include "io/mesh/ma.h"
#include "io/save.h"
#include "tests/io/files.h"

static const char off[] = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
static const char obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
static const char ply[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face "
    "1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
static const char stl[] =
    "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
static const char gltf[] =
    "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,"
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,"
    "1,0]}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"nodes\":[{\"mesh\":0}],\"scenes\":[{"
    "\"nodes\":[0]}],\"scene\":0}";

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

static qmat_status read_as(qmat_context *context, const char *name, const void *content, size_t size,
                           qmat_scene **scene, qmat_mesh **mesh, qmat_report **report) {
  char path[128];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  write_file(path, content, size);
  const qmat_read_options options = {.defects = QMAT_DEFECTS_REFUSE};
  qmat_status status = qmat_model_read(context, path, &options, scene, mesh, report);
  unlink(path);
  return status;
}

static void assert_reads(const char *name, const char *content, const char *format, const char *scene_name) {
  qmat_context context = {0};
  qmat_scene *scene;
  qmat_mesh *mesh;
  qmat_report *report;
  if (read_as(&context, name, content, strlen(content), &scene, &mesh, &report) != QMAT_OK) {
    fail_msg("%s: %s", name, context.error.message);
  }
  assert_string_equal(scene->format, format);
  assert_string_equal(scene->name, scene_name);
  assert_string_equal(json_string_value(json_object_get(report->root, "format")), format);
  assert_true(scene->base.sealed && mesh->base.sealed && report->base.sealed);
  static const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  static const uint32_t triangle[] = {0, 1, 2};
  assert_int_equal(mesh->vertex_count, 3);
  assert_int_equal(mesh->triangle_count, 1);
  assert_positions(mesh->positions, positions, 9);
  assert_memory_equal(mesh->triangles, triangle, sizeof triangle);
  qmat_value_release(&scene->base);
  qmat_value_release(&mesh->base);
  qmat_value_release(&report->base);
  qmat_context_uninit(&context);
}

static void test_every_format_gives_the_same_triangle(void **state) {
  (void)state;
  assert_reads("a.off", off, "off", "a");
  assert_reads("a.obj", obj, "obj", "a");
  assert_reads("a.ply", ply, "ply", "a");
  assert_reads("a.stl", stl, "stl", "a");
  assert_reads("a.gltf", gltf, "gltf", "a");
}

static void test_the_bytes_decide_where_the_ending_says_nothing(void **state) {
  (void)state;
  assert_reads("a", off, "off", "a");
  assert_reads("a.b.mesh", ply, "ply", "a.b");
  assert_reads(".hidden", stl, "stl", ".hidden");
  assert_reads("A.OFF", off, "off", "A");
}

static void test_the_ending_decides_where_the_bytes_say_nothing(void **state) {
  (void)state;
  assert_reads("a.off", off + 4, "off", "a");
  assert_reads("a.obj", "newword 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "obj", "a");
}

static void test_a_name_that_is_not_utf8_becomes_valid_utf8(void **state) {
  (void)state;
  assert_reads("k\xC3\xA4se.off", off, "off", "k\xC3\xA4se");
  assert_reads("k\xE4se \xC3.off", off, "off", "k\xEF\xBF\xBDse \xEF\xBF\xBD");
  assert_reads("\xED\xA0\x80\xF4\x90\x80\x80.off", off, "off",
               "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD");
}

static void test_a_scene_knows_its_unit_where_the_format_has_one(void **state) {
  (void)state;
  static const char usda[] =
      "#usda 1.0\n(metersPerUnit = 0.01 upAxis = \"Z\")\ndef Mesh \"m\" { point3f[] points = [(0, 0, 0), (1, 0, 0), "
      "(0, "
      "1, 0)] int[] faceVertexCounts = [3] int[] faceVertexIndices = [0, 1, 2] }";
  static const struct {
    const char *name, *content;
    double unit;
    bool z_up;
  } cases[] = {{"a.off", off, 0, false}, {"a.gltf", gltf, 1, false}, {"a.usda", usda, 0.01, true}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    qmat_context context = {0};
    qmat_scene *scene;
    qmat_mesh *mesh;
    qmat_report *report;
    assert_int_equal(
        read_as(&context, cases[i].name, cases[i].content, strlen(cases[i].content), &scene, &mesh, &report), QMAT_OK);
    assert_true(scene->meters_per_unit == cases[i].unit);
    assert_int_equal(scene->is_z_up, cases[i].z_up);
    qmat_value_release(&scene->base);
    qmat_value_release(&mesh->base);
    qmat_value_release(&report->base);
    qmat_context_uninit(&context);
  }
}

static void assert_not_read(const char *name, const void *content, size_t size, qmat_status expected,
                            const char *message, const char *hint) {
  qmat_context context = {0};
  qmat_scene *scene;
  qmat_mesh *mesh;
  qmat_report *report;
  assert_int_equal(read_as(&context, name, content, size, &scene, &mesh, &report), expected);
  assert_null(scene);
  assert_null(mesh);
  assert_null(report);
  assert_string_equal(context.error.message, message);
  assert_string_equal(context.error.hint, hint);
  char path[128];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  assert_string_equal(context.error.file, path);
  qmat_context_uninit(&context);
}

static void test_a_wrong_extension_is_an_error_that_names_the_content(void **state) {
  (void)state;
  static const char rename_it[] = "rename or convert the file";
  assert_not_read("bunny.off", ply, strlen(ply), QMAT_ERROR_FORMAT, "the extension says OFF, but the content is PLY",
                  rename_it);
  assert_not_read("bunny.ply", off, strlen(off), QMAT_ERROR_FORMAT, "the extension says PLY, but the content is OFF",
                  rename_it);
  assert_not_read("bunny.stl", obj, strlen(obj), QMAT_ERROR_FORMAT, "the extension says STL, but the content is OBJ",
                  rename_it);
  assert_not_read("bunny.glb", gltf, strlen(gltf), QMAT_ERROR_FORMAT,
                  "the extension says binary glTF, but the content is glTF", rename_it);
  assert_not_read("bunny.gltf", "glTF\2\0\0\0", 8, QMAT_ERROR_FORMAT,
                  "the extension says glTF, but the content is binary glTF", rename_it);
  assert_not_read("bunny.ma", off, strlen(off), QMAT_ERROR_FORMAT, "the extension says MA, but the content is OFF",
                  rename_it);
}

static void test_what_is_not_read_is_refused_by_name(void **state) {
  (void)state;
  static const char known[] = "use .off, .obj, .ply, .stl, .gltf, .glb, .usd, .usda, .usdc or .usdz";
  assert_not_read("a.usda", "#usda 1.0\n", 10, QMAT_ERROR_GEOMETRY, "the scene has no mesh that can be read", "");
  assert_not_read("a.usd", "PXR-USDC\0\7", 10, QMAT_ERROR_FORMAT, "a binary layer of USD must start with PXR-USDC", "");
  assert_not_read("a.usd", "?", 1, QMAT_ERROR_FORMAT, "a text layer of USD must start with '#usda 1.0'", "");
  uint8_t zip[64] = "PK\3\4";
  zip[26] = 6;
  memcpy(zip + 30, "a.usdc", 6);
  assert_not_read("a.usdz", zip, 64, QMAT_ERROR_FORMAT, "the archive has no directory: it may be incomplete", "");
  assert_not_read("a", zip, 64, QMAT_ERROR_FORMAT, "the archive has no directory: it may be incomplete", "");
  zip[30] = zip[33] = 'x';
  assert_not_read("a.zip", zip, 64, QMAT_ERROR_FORMAT, "archives are not supported", known);
  assert_not_read("a", zip, 5, QMAT_ERROR_FORMAT, "archives are not supported", known);
  assert_not_read("a.txt", "hello", 5, QMAT_ERROR_FORMAT,
                  "neither the content nor the extension is of a supported format", known);
  assert_not_read("a.ma", "1 0 0\nv 0 0 0 1\n", 16, QMAT_ERROR_FORMAT, "the file has a medial mesh, not a surface",
                  "read it with the node medial.read");
  assert_not_read("a.off", "", 0, QMAT_ERROR_FORMAT, "the file is empty", "");
}

static void test_a_model_that_cannot_be_measured_is_refused_by_its_file(void **state) {
  (void)state;
  static const char *const sizes[] = {"1e308", "3e307", "1e307"};
  for (size_t i = 0; i < 3; i++) {
    char text[256];
    const int length =
        snprintf(text, sizeof text, "OFF\n4 4 0\n0 0 0\n%s 0 0\n0 %s 0\n0 0 %s\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n",
                 sizes[i], sizes[i], sizes[i]);
    qmat_context context = {0};
    qmat_scene *scene;
    qmat_mesh *mesh;
    qmat_report *report;
    const qmat_status status = read_as(&context, "huge.off", text, (size_t)length, &scene, &mesh, &report);
    assert_int_equal(status, i < 2 ? QMAT_ERROR_GEOMETRY : QMAT_OK);
    if (i < 2) {
      assert_null(mesh);
      assert_string_equal(context.error.message, "its bounding box is too large to be measured");
      assert_non_null(strstr(context.error.file, "huge.off"));
    } else {
      qmat_value_release(&scene->base);
      qmat_value_release(&mesh->base);
      qmat_value_release(&report->base);
    }
    qmat_context_uninit(&context);
  }
}

static void test_a_failure_after_reading_leaves_no_values(void **state) {
  (void)state;
  static const char nan[] = "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n";
  assert_not_read("a.obj", nan, strlen(nan), QMAT_ERROR_GEOMETRY, "the vertex has a coordinate that is not finite", "");
  assert_not_read("a.obj", "v 0 0 0\n", 8, QMAT_ERROR_GEOMETRY, "the file has vertices but no facets", "");
}

static void test_a_medial_mesh_is_not_read_from_a_file_of_another_format(void **state) {
  (void)state;
  char path[128];
  qmat_context context = {0};
  qmat_medial *medial;
  snprintf(path, sizeof path, "%s/a.ma", folder);
  assert_int_equal(qmat_medial_extract(&context, path, NULL, &medial, NULL), QMAT_ERROR_IO);
  assert_null(medial);
  write_file(path, "1 0 0\nv 0 0 0 1\n", 16);
  assert_int_equal(qmat_medial_extract(&context, path, NULL, &medial, NULL), QMAT_OK);
  assert_int_equal(medial->sphere_count, 1);
  qmat_value_release(&medial->base);
  write_file(path, off, strlen(off));
  assert_int_equal(qmat_medial_extract(&context, path, NULL, &medial, NULL), QMAT_ERROR_FORMAT);
  assert_null(medial);
  assert_string_equal(context.error.message, "the extension says MA, but the content is OFF");
  unlink(path);
  qmat_context_uninit(&context);
}

static void test_looking_at_any_bytes_is_safe(void **state) {
  (void)state;
  for (uint64_t round = 0; round < 3000; round++) {
    static const char *const starts[] = {"PK\3\4", "PK\5\6", "glTF",         "ply", "OFF",
                                         "#",      "solid",  "\xEF\xBB\xBF", "{",   ""};
    uint8_t content[100];
    const char *start = starts[round % 10];
    const size_t size = strlen(start) + qmat_hash3(8, round, 0) % 60;
    for (uint64_t i = 0; i < sizeof content; i++) content[i] = (uint8_t)qmat_hash3(9, round, i);
    memcpy(content, start, strlen(start));
    qmat_bytes bytes = memory_file(content, size);
    assert_true(qmat_format_of_bytes(&bytes) < QMAT_FORMAT_COUNT);
    free(bytes.data);
  }
}

/* The linker sends every aligned_alloc of the program here (tests/io/CMakeLists.txt). */
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
static size_t allocations_left = SIZE_MAX;

void *__wrap_aligned_alloc(size_t alignment, size_t size) {
  if (allocations_left == 0) return NULL;
  if (allocations_left != SIZE_MAX) allocations_left--;
  return __real_aligned_alloc(alignment, size);
}

/* Every arc, a file that is not there, a cage, and a package's worth of values. */
static const char usda[] =
    "#usda 1.0\n( subLayers = [@none.usda@] )\nclass Mesh \"c\" { point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, "
    "0)]\n"
    "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\nint[] cornerIndices = [0]\n"
    "float[] cornerSharpnesses = [2] }\ndef \"w\" ( variants = { string v = \"a\" } prepend variantSets = \"v\" ) {\n"
    "  variantSet \"v\" = { \"a\" { def \"m\" ( inherits = </c> prepend references = [</c>, @none.usda@] ) {\n"
    "    float3 xformOp:translate.timeSamples = { 1: (1, 2, 3) } token[] xformOpOrder = [\"xformOp:translate\"] } } "
    "}\n}\n"
    "def Mesh \"n\" ( payload = </c> specializes = </c> ) { dictionary d = { int x = 1 } }\n";

static void test_a_shortage_of_memory_at_any_point_is_reported_and_leaks_nothing(void **state) {
  (void)state;
  static const char pentagon[] = "OFF 5 1 0\n0 0 0\n2 0 0\n2 2 0\n1 1 0\n0 2 0\n5 0 1 2 3 4\n";
  static const struct {
    const char *name, *content;
  } files[] = {{"a.off", pentagon}, {"a.obj", obj}, {"a.ply", ply}, {"a.stl", stl}, {"a.gltf", gltf}, {"a.usda", usda}};
  for (size_t i = 0; i < 6; i++) {
    qmat_status status = QMAT_ERROR_MEMORY;
    size_t granted = 0;
    for (; status != QMAT_OK; granted++) {
      qmat_context context = {0};
      qmat_scene *scene;
      qmat_mesh *mesh;
      qmat_report *report;
      allocations_left = granted;
      status = read_as(&context, files[i].name, files[i].content, strlen(files[i].content), &scene, &mesh, &report);
      allocations_left = SIZE_MAX;
      assert_int_equal(context.error.status, status);
      if (status != QMAT_OK) {
        assert_int_equal(status, QMAT_ERROR_MEMORY);
        assert_true(!scene && !mesh && !report);
      } else {
        qmat_value_release(&scene->base);
        qmat_value_release(&mesh->base);
        qmat_value_release(&report->base);
      }
      qmat_context_uninit(&context);
    }
    assert_true(granted > 10);
  }
}

static void test_a_shortage_of_memory_while_a_medial_mesh_is_read_written_or_saved_leaks_nothing(void **state) {
  (void)state;
  static const char text[] = "3 0 1\nv 0 0 0 1\nv 1 0 0 1\nv 2 0 0 1.5\nf 0 1 2\n";
  char path[128];
  snprintf(path, sizeof path, "%s/a.ma", folder);
  qmat_status status = QMAT_ERROR_MEMORY;
  for (size_t granted = 0; status != QMAT_OK; granted++) {
    write_file(path, text, strlen(text));
    qmat_context context = {0};
    qmat_medial *medial;
    qmat_file *file = NULL;
    allocations_left = granted;
    status = qmat_medial_extract(&context, path, NULL, &medial, NULL);
    if (status == QMAT_OK) status = qmat_ma_write(&context, medial, &file);
    if (status == QMAT_OK) {
      status = qmat_file_save(&context, file, path);
    } else {
      assert_null(file);
    }
    allocations_left = SIZE_MAX;
    if (status != QMAT_OK) assert_true(status == QMAT_ERROR_MEMORY || strstr(context.error.message, "memory"));
    if (medial) qmat_value_release(&medial->base);
    if (file) qmat_value_release(&file->base);
    qmat_context_uninit(&context);
  }
  assert_int_equal(unlink(path), 0); /* and nothing else: the folder is removed at the end */
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_format_gives_the_same_triangle),
      cmocka_unit_test(test_the_bytes_decide_where_the_ending_says_nothing),
      cmocka_unit_test(test_the_ending_decides_where_the_bytes_say_nothing),
      cmocka_unit_test(test_a_name_that_is_not_utf8_becomes_valid_utf8),
      cmocka_unit_test(test_a_scene_knows_its_unit_where_the_format_has_one),
      cmocka_unit_test(test_a_wrong_extension_is_an_error_that_names_the_content),
      cmocka_unit_test(test_what_is_not_read_is_refused_by_name),
      cmocka_unit_test(test_a_model_that_cannot_be_measured_is_refused_by_its_file),
      cmocka_unit_test(test_a_failure_after_reading_leaves_no_values),
      cmocka_unit_test(test_a_medial_mesh_is_not_read_from_a_file_of_another_format),
      cmocka_unit_test(test_looking_at_any_bytes_is_safe),
      cmocka_unit_test(test_a_shortage_of_memory_at_any_point_is_reported_and_leaks_nothing),
      cmocka_unit_test(test_a_shortage_of_memory_while_a_medial_mesh_is_read_written_or_saved_leaks_nothing),
  };
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
