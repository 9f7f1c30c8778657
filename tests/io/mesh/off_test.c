/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/mesh/mesh_formats.h"
#include "tests/io/files.h"

static const char sample[] =
    "OFF # a tetrahedron\n"
    "4 4 6\n"
    "0 0 0\n"
    "1.5 0 0\n"
    "0 1e0 0\n"
    "0 0 -.25\n"
    "3 0 2 1\n"
    "3 0 1 3 255 0 0\n"
    "3 0 3 2\n"
    "# the last one\n"
    "3 1 2 3\n";

static void assert_tetrahedron(const char *text) {
  static const double positions[] = {0, 0, 0, 1.5, 0, 0, 0, 1, 0, 0, 0, -0.25};
  static const uint32_t corners[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  qmat_soup soup = read_good(qmat_off_read, text, strlen(text));
  assert_int_equal(soup.vertex_count, 4);
  assert_positions(soup.positions, positions, 12);
  assert_int_equal(soup.facet_count, 4);
  assert_int_equal(soup.corner_count, 12);
  assert_memory_equal(soup.corners, corners, sizeof corners);
  for (size_t f = 0; f < 4; f++) {
    assert_int_equal(soup.facet_ends[f], 3 * f + 3);
    assert_int_equal(soup.facet_ordinals[f], f);
  }
  qmat_soup_uninit(&soup);
}

static void test_vertices_facets_and_their_lines_are_read(void **state) {
  (void)state;
  assert_tetrahedron(sample);
  qmat_soup soup = read_good(qmat_off_read, sample, strlen(sample));
  assert_int_equal(soup.facet_lines[0], 7);
  assert_int_equal(soup.facet_lines[3], 11);
  qmat_soup_uninit(&soup);
}

static void test_every_way_of_writing_the_header_gives_the_same(void **state) {
  (void)state;
  static const char body[] = "0 0 0\n1.5 0 0\n0 1 0\n0 0 -0.25\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3";
  static const char *const headers[] = {
      "OFF 4 4 6\n",   "OFF4 4 6\n",      "OFF\n4 4 0\n",     "OFF\n4 4\n",
      "4 4 6\n",       "off\n4 4 6\n",    "OFF\r\n4 4 6\r\n", "# c\n\nOFF\n# c\n4\n4\n",
      "COFF\n4 4 6\n", "STCNOFF 4 4 6\n", "OFF\r4 4 6\r",     "\xEF\xBB\xBFOFF\n4 4 6\n"};
  for (size_t i = 0; i < sizeof headers / sizeof headers[0]; i++) {
    char text[256];
    snprintf(text, sizeof text, "%s%s", headers[i], body);
    assert_tetrahedron(text);
  }
}

static void test_columns_besides_the_coordinates_are_passed_over(void **state) {
  (void)state;
  assert_tetrahedron(
      "CNOFF\n4 4 6\n0 0 0 0 0 1 255 0 0 255\n1.5 0 0 0 0 1 0.5 0.5 0.5 1\n0\n1 0 # 9 9\n0 0 -.25 red\n"
      "3 0 2 1 0.5 0.5 0.5\n3 0 1\n3 7\n3 0 3 2 9\n3 1 2 3");
}

static void test_large_polygons_are_read(void **state) {
  (void)state;
  char text[8192] = "OFF 1000 1 0\n";
  for (int i = 0; i < 1000; i++) strcat(text, "0 0 0\n");
  strcat(text, "1000\n");
  for (int i = 0; i < 1000; i++) strcat(text, i % 2 ? "7 " : "8\n");
  qmat_soup soup = read_good(qmat_off_read, text, strlen(text));
  assert_int_equal(soup.corner_count, 1000);
  assert_int_equal(soup.corners[999], 7);
  qmat_soup_uninit(&soup);
}

static void test_bad_files_are_refused_with_the_place(void **state) {
  (void)state;
  static const char *const cases[][2] = {
      {"ply\n", "file:1:1: expected 'OFF', found 'ply'"},
      {"# only\n", "file:2:1: expected 'OFF', found the end of the file"},
      {"\n  4OFF\n1 1 1", "file:2:3: 4OFF is not supported: its vertices do not have three coordinates"},
      {"nOFF\n3\n1 1 1", "file:1:1: nOFF is not supported: its vertices do not have three coordinates"},
      {"XOFF\n1 1 1", "file:1:1: expected an OFF keyword, found 'XOFF'"},
      {"OFF BINARY\n\1\2\3", "file:1:4: binary OFF is not supported"},
      {"OFF", "file:1:4: expected the number of vertices, found the end of the file"},
      {"OFF\n4000000000 1 0\n0 0 0\n", "file:2:11: the number of vertices is 4000000000, more than the file can hold"},
      {"OFF\n1 4000000000 0\n0 0 0\n", "file:2:13: the number of facets is 4000000000, more than the file can hold"},
      {"OFF\n99999999999999999999 1 0\n",
       "file:2:1: the number of vertices is '99999999999999999999', not a whole number"},
      {"OFF\n-1 1 0\n", "file:2:1: the number of vertices is '-1', outside 0 to 4294967294"},
      {"OFF\n1 1 0\n0 zero 0\n1 1 1\n", "file:3:3: vertex 0: the y coordinate of a vertex is 'zero', not a number"},
      {"OFF\n2 0 0\n0 0 0\n1 1      ",
       "file:4:10: vertex 1: expected the z coordinate of a vertex, found the end of the file"},
      {"OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "file:4:7: facet 0: a vertex index is '1', outside 0 to 0"},
      {"OFF\n1 1 0\n0 0 0\n3 0 -1 0\n", "file:4:5: facet 0: a vertex index is '-1', outside 0 to 0"},
      {"OFF\n1 1 0\n0 0 0\n4000000000 0 0 0\n",
       "file:4:11: facet 0: the number of corners of a facet is 4000000000, more than the file can hold"},
      {"OFF\n1 2 0\n0 0 0\n3 0 0 0\n",
       "file:5:1: facet 1: expected the number of corners of a facet, found the end of the file"},
      {"OFF\n0 1 0\n3 0 0 0\n", "file:3:3: facet 0: a vertex index is '0', but none exist"},
      {"OFF\n1 1 0\n0 0 0\n3 0 0 0\n3 0 0 0\n",
       "file:5:1: the file continues after the 1 vertices and 1 facets of its header"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    assert_text_refused(qmat_off_read, cases[i][0], cases[i][1]);
  }
}

static void test_damaged_files_never_crash(void **state) {
  (void)state;
  try_damaged(qmat_off_read, sample, strlen(sample));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_vertices_facets_and_their_lines_are_read),
      cmocka_unit_test(test_every_way_of_writing_the_header_gives_the_same),
      cmocka_unit_test(test_columns_besides_the_coordinates_are_passed_over),
      cmocka_unit_test(test_large_polygons_are_read),
      cmocka_unit_test(test_bad_files_are_refused_with_the_place),
      cmocka_unit_test(test_damaged_files_never_crash),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
