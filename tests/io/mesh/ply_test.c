/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/mesh/mesh_formats.h"
#include "io/mesh/ply_medial.h"
#include "tests/io/files.h"

/* One header for all three kinds; types and order are unusual on purpose. */
static const char header[] =
    "ply\n"
    "format %s 1.0\n"
    "comment made by hand\n"
    "obj_info nothing\n"
    "element camera 1\n"
    "property short view\n"
    "property list uint8 float64 matrix\n"
    "element face 2\n"
    "property uchar red\n"
    "property list ushort uint vertex_indices\n"
    "property list uchar float texcoord\n"
    "element vertex 4\n"
    "property double z\n"
    "property uchar quality\n"
    "property float x\n"
    "property char y\n"
    "element nothing 4000000000\n"
    "element tristrips 1\n"
    "property list int int vertex_index\n"
    "end_header\n";

static const char ascii_body[] =
    "-7 2 0.5 0.25\n"
    "255 3 0 1 2 1 0.5\n"
    "0 4 0 1 2 3 0\n"
    "0 1 0.5 0\n"
    "1 1 1.5 0\n"
    "2e0 1 -2 -100\n"
    "3 1 3 7\n"
    "9 0 1 2 3 -1 3 3 2 1\n";

static void put(qmat_writer *writer, bool big, const void *number, size_t size) {
  for (size_t i = 0; i < size; i++) qmat_put_bytes(writer, (const uint8_t *)number + (big ? size - 1 - i : i), 1);
}

/* The same body as ascii_body. */
static void put_body(qmat_writer *w, bool big) {
#define PUT(type, ...)                                                                                           \
  do {                                                                                                           \
    const type numbers[] = {__VA_ARGS__};                                                                        \
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) put(w, big, &numbers[i], sizeof numbers[0]); \
  } while (0)
  PUT(int16_t, -7);
  PUT(uint8_t, 2);
  PUT(double, 0.5, 0.25);
  PUT(uint8_t, 255);
  PUT(uint16_t, 3);
  PUT(uint32_t, 0, 1, 2);
  PUT(uint8_t, 1);
  PUT(float, 0.5f);
  PUT(uint8_t, 0);
  PUT(uint16_t, 4);
  PUT(uint32_t, 0, 1, 2, 3);
  PUT(uint8_t, 0);
  static const double z[] = {0, 1, 2, 3};
  static const float x[] = {0.5f, 1.5f, -2, 3};
  static const int8_t y[] = {0, 0, -100, 7};
  for (int v = 0; v < 4; v++) {
    PUT(double, z[v]);
    PUT(uint8_t, 1);
    PUT(float, x[v]);
    PUT(int8_t, y[v]);
  }
  PUT(int32_t, 9, 0, 1, 2, 3, -1, 3, 3, 2, 1);
#undef PUT
}

static qmat_writer make_sample(int kind) {
  static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  char text[1024];
  qmat_writer writer = {0};
  snprintf(text, sizeof text, header, formats[kind]);
  qmat_put_text(&writer, text);
  if (kind == 0) {
    qmat_put_text(&writer, ascii_body);
  } else {
    put_body(&writer, kind == 2);
  }
  assert_false(writer.failed);
  return writer;
}

static void test_all_three_encodings_give_the_same(void **state) {
  (void)state;
  static const double positions[] = {0.5, 0, 0, 1.5, 0, 1, -2, -100, 2, 3, 7, 3};
  /* Two facets, then the strip 0 1 2 3 (its second triangle turned over) and, after the break, 3 3 2 1, whose first
   * triangle only stitches. */
  static const uint32_t corners[] = {0, 1, 2, 0, 1, 2, 3, 0, 1, 2, 2, 1, 3, 2, 3, 1};
  static const size_t ends[] = {3, 7, 10, 13, 16};
  for (int kind = 0; kind < 3; kind++) {
    qmat_writer file = make_sample(kind);
    qmat_soup soup = read_good(qmat_ply_read, file.bytes, file.size);
    assert_int_equal(soup.vertex_count, 4);
    assert_positions(soup.positions, positions, 12);
    assert_int_equal(soup.facet_count, 5);
    assert_int_equal(soup.corner_count, 16);
    assert_memory_equal(soup.corners, corners, sizeof corners);
    assert_memory_equal(soup.facet_ends, ends, sizeof ends);
    assert_int_equal(soup.facet_lines[1], kind == 0 ? 23 : 0);
    qmat_soup_uninit(&soup);
    qmat_writer_uninit(&file);
  }
}

static void test_headers_with_other_line_ends_and_trailing_blanks_are_read(void **state) {
  (void)state;
  static const char body[] = "\x0A\0\0\0\0\0\0\0\0\0\0\0\3\0\0\0"; /* data that starts with a line feed */
  static const char *const ends[] = {"\n", "\r\n", "\r"};
  for (int i = 0; i < 6; i++) {
    const bool blanks = i >= 3;
    qmat_writer writer = {0};
    static const char *const lines[] = {"ply",
                                        "format binary_little_endian 1.0",
                                        "element vertex 1",
                                        "property int x",
                                        "property int y",
                                        "property int z",
                                        "element face 1",
                                        "property list uchar uchar vertex_index",
                                        "end_header"};
    for (int k = 0; k < 9; k++) {
      qmat_put_text(&writer, lines[k]);
      if (blanks) qmat_put_text(&writer, " \t");
      qmat_put_text(&writer, ends[i % 3]);
    }
    qmat_put_bytes(&writer, body, 16);
    qmat_soup soup = read_good(qmat_ply_read, writer.bytes, writer.size);
    assert_true(soup.positions[0] == 10);
    assert_int_equal(soup.corner_count, 3);
    qmat_soup_uninit(&soup);
    qmat_writer_uninit(&writer);
  }
}

#define VERTICES "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
#define FACES "element face 1\nproperty list uchar int vertex_indices\n"
#define ASCII "ply\nformat ascii 1.0\n"
#define BINARY "ply\nformat binary_little_endian 1.0\n"

static void test_bad_files_are_refused_with_the_place(void **state) {
  (void)state;
  static const char *const cases[][2] = {
      {"plyx", "file:1:1: expected 'ply', found 'plyx'"},
      {"ply\n", "file:2:1: expected 'end_header', found the end of the file"},
      {"ply\nformat text 1.0\n", "file:2:8: expected ascii, binary_little_endian or binary_big_endian, found 'text'"},
      {"ply\nformat ascii 2.0\n", "file:2:14: expected version 1.0, found '2.0'"},
      {"ply\nend_header\n", "file:2:11: the header has no line 'format'"},
      {ASCII "element x\001\377 1\n"
             "element vertex 1 \nend_header",
       "file:4: element 'vertex' lacks one of the properties x, y and z"},
      {ASCII "end_header x\n", "file:3:12: expected the end of the line, found 'x'"},
      {ASCII "end_header\n", "file: the file has no element 'vertex'"},
      {ASCII VERTICES "end_header\n0 0 0\n", "file: the file has no element 'face'"},
      {ASCII "element vertex 1\nproperty float x\nproperty float y\n" FACES "end_header\n0 0 0\n3 0 0 0",
       "file:3: element 'vertex' lacks one of the properties x, y and z"},
      {ASCII VERTICES "element face 1\nproperty list uchar int corners\nend_header\n0 0 0\n3 0 0 0",
       "file:7: element 'face' lacks the list property vertex_indices"},
      {ASCII "property float x\n", "file:3:9: a property must follow an element"},
      {ASCII "property", "file:3:9: a property must follow an element"},
      {ASCII "element vertex\n", "file:3:15: expected the count of an element, found the end of the line"},
      {ASCII "element\n", "file:3:8: expected the name of an element, found the end of the line"},
      {ASCII "element vertex -1\n", "file:3:16: the count of an element is '-1', outside 0 to 4294967295"},
      {ASCII VERTICES VERTICES, "file:7:15: duplicate element 'vertex'"},
      {ASCII VERTICES "property float x\n", "file:7:17: duplicate property 'x'"},
      {ASCII VERTICES "property long w\n", "file:7:10: expected a type, found 'long'"},
      {ASCII VERTICES "property list float int w\n", "file:7:15: expected an integer type, found 'float'"},
      {ASCII "vertices 3\n", "file:3:1: expected a keyword of a PLY header, found 'vertices'"},
      {BINARY "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n" FACES "end_header\n",
       "file:3: element 'vertex' has a count that the file cannot hold"},
      {ASCII VERTICES "element face 4000000000\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n",
       "file:7: element 'face' has a count that the file cannot hold"},
      /* Each count alone would fit. */
      {BINARY VERTICES "element face 13\nproperty list uchar uchar vertex_indices\nend_header\n1234567890123",
       "file:7: element 'face' has a count that the file cannot hold"},
      {ASCII VERTICES FACES "end_header\n0 x 0\n3 0 0 0",
       "file:10:3: vertex 0: a coordinate of a vertex is 'x', not a number"},
      {ASCII VERTICES FACES "end_header\n0 0 0\n4000000000 0 0",
       "file:11:11: face 0: a list is longer than the rest of the file"},
      {ASCII VERTICES FACES "end_header\n0 0 0\n-1 0 0", "file:11:3: face 0: the length of a list is not a count"},
      {ASCII VERTICES FACES "end_header\n0 0 0\n3 0 0 -1", "file:11:9: face 0: a vertex index is -1"},
      {ASCII VERTICES FACES "end_header\n0 0 0\n3 0 0 0.5", "file:11:10: face 0: a vertex index is 0.5"},
      {ASCII VERTICES FACES "end_header\n0 0 0\n3 0 0 0\n3 0 0 0",
       "file:12:1: expected the end of the file, found '3'"},
      {BINARY VERTICES FACES "end_header\n123456789abc\xFF",
       "file: face 0: a list is longer than the rest of the file"},
      {BINARY VERTICES FACES "end_header\n123456789abc\1"
                             "1111x",
       "file: the file continues after its last element"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    assert_text_refused(qmat_ply_read, cases[i][0], cases[i][1]);
  }
}

static void test_damaged_files_never_crash(void **state) {
  (void)state;
  for (int kind = 0; kind < 3; kind++) {
    qmat_writer file = make_sample(kind);
    try_damaged(qmat_ply_read, file.bytes, file.size);
    qmat_writer_uninit(&file);
  }
}

static void test_a_medial_mesh_is_written_with_radii_and_edges(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new();
  medial->sphere_count = 3;
  medial->edge_count = 3;
  medial->triangle_count = 1;
  medial->spheres = qmat_calloc(12, sizeof(double));
  medial->edges = qmat_calloc(6, sizeof(uint32_t));
  medial->triangles = qmat_calloc(3, sizeof(uint32_t));
  for (int i = 0; i < 12; i++) medial->spheres[i] = i;
  memcpy(medial->edges, (const uint32_t[]){0, 1, 0, 2, 1, 2}, 24);
  memcpy(medial->triangles, (const uint32_t[]){0, 1, 2}, 12);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_file *file;
  assert_int_equal(qmat_ply_write_medial(&context, medial, NULL, &file), QMAT_OK);
  assert_true(file->base.sealed);
  assert_string_equal(file->format, "ply");
  assert_int_equal(file->part_count, 1);
  static const char start[] =
      "ply\nformat binary_little_endian 1.0\ncomment medial mesh\nelement vertex 3\nproperty double x\nproperty double "
      "y\nproperty double z\nproperty double radius\nelement edge 3\nproperty int vertex1\nproperty int "
      "vertex2\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const uint8_t *bytes = file->parts[0].bytes;
  assert_int_equal(file->parts[0].size, sizeof start - 1 + 96 + 24 + 13);
  assert_memory_equal(bytes, start, sizeof start - 1);
  assert_memory_equal(bytes + sizeof start - 1, medial->spheres, 96);
  assert_memory_equal(bytes + sizeof start - 1 + 96, medial->edges, 24);
  qmat_soup soup = read_good(qmat_ply_read, bytes, file->parts[0].size);
  assert_int_equal(soup.vertex_count, 3);
  assert_int_equal(soup.facet_count, 1);
  assert_true(soup.positions[8] == 10);
  qmat_soup_uninit(&soup);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_all_three_encodings_give_the_same),
      cmocka_unit_test(test_headers_with_other_line_ends_and_trailing_blanks_are_read),
      cmocka_unit_test(test_bad_files_are_refused_with_the_place),
      cmocka_unit_test(test_damaged_files_never_crash),
      cmocka_unit_test(test_a_medial_mesh_is_written_with_radii_and_edges),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
