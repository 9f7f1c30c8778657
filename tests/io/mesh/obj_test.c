/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/mesh/mesh_formats.h"
#include "tests/io/files.h"

static const char sample[] =
    "# exported\n"
    "mtllib some file.mtl\n"
    "o Thing\n"
    "v 0 0 0\n"
    "v 1 0 0 1.0\n"
    "v 1 1 0 0.5 0.5 0.5\n"
    "vt 0 0\n"
    "vn 0 0 1\n"
    "g a b # c\n"
    "v 0 1 -2e-1\n"
    "s off\n"
    "f 1/1/1 2//1 3/1 4\n"
    "fo -4 -3 \\\n"
    "  -2\n"
    "l 1 2\n"
    "p 1\n"
    "usemtl x\n"
    "v 5 5 5\n"
    "f 5 -2 1";

static void test_vertices_and_facets_are_read_and_the_rest_passed_over(void **state) {
  (void)state;
  static const double positions[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, -0.2, 5, 5, 5};
  static const uint32_t corners[] = {0, 1, 2, 3, 0, 1, 2, 4, 3, 0};
  static const size_t ends[] = {4, 7, 10};
  static const int lines[] = {12, 13, 19};
  qmat_soup soup = read_good(qmat_obj_read, sample, strlen(sample));
  assert_int_equal(soup.vertex_count, 5);
  assert_positions(soup.positions, positions, 15);
  assert_int_equal(soup.facet_count, 3);
  assert_int_equal(soup.corner_count, 10);
  assert_memory_equal(soup.corners, corners, sizeof corners);
  assert_memory_equal(soup.facet_ends, ends, sizeof ends);
  assert_memory_equal(soup.facet_lines, lines, sizeof lines);
  qmat_soup_uninit(&soup);
}

static void test_line_ends_of_every_system_are_read(void **state) {
  (void)state;
  static const char *const texts[] = {"v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n",
                                      "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",
                                      "v 0 0\\\r\n 0\r\nv 1 0 0\r\nv 0 1 0\r\nf\\\r\n1 2 3"};
  for (size_t i = 0; i < 3; i++) {
    qmat_soup soup = read_good(qmat_obj_read, texts[i], strlen(texts[i]));
    assert_int_equal(soup.vertex_count, 3);
    assert_int_equal(soup.corner_count, 3);
    qmat_soup_uninit(&soup);
  }
}

static void test_bad_files_are_refused_with_the_place(void **state) {
  (void)state;
  static const char *const cases[][2] = {
      {"v 0 0\nv 1 1 1\n", "file:1:6: vertex 0: expected the z coordinate of a vertex, found the end of the line"},
      {"v 0 0,5 0\n", "file:1:5: vertex 0: the y coordinate of a vertex is '0,5', not a number"},
      {"v 0 0 0\nf 1 2 3\n", "file:2:5: facet 0: a vertex index is 2, but 1 vertices precede it"},
      {"v 0 0 0\nf 1 1 -2\n", "file:2:7: facet 0: a vertex index is -2, but 1 vertices precede it"},
      {"v 0 0 0\nf 0 1 1\n", "file:2:3: facet 0: a vertex index is 0, but OBJ counts vertices from 1"},
      {"v 0 0 0\nf 1 1x 1\n", "file:2:5: facet 0: expected a corner v, v/vt, v//vn or v/vt/vn, found '1x'"},
      {"v 0 0 0\nf 1 /1 1\n", "file:2:5: facet 0: expected a corner v, v/vt, v//vn or v/vt/vn, found '/1'"},
      {"v 0 0 0\nf 1/1/1/1\n", "file:2:3: facet 0: expected a corner v, v/vt, v//vn or v/vt/vn, found '1/1/1/1'"},
      {"v 0 0 0\nf 99999999999999999999 1 1\n",
       "file:2:3: facet 0: expected a corner v, v/vt, v//vn or v/vt/vn, found '99999999999999999999'"},
      {"surf 0 1 0 1 1\n", "file:1:1: free-form surfaces are not supported (export the model as polygons)"},
      {"bzp 1 2 3 4\n", "file:1:1: free-form surfaces are not supported (export the model as polygons)"},
      {"call other.obj\n", "file:1:1: calls of other files are not supported"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    assert_text_refused(qmat_obj_read, cases[i][0], cases[i][1]);
  }
}

static void test_damaged_files_never_crash(void **state) {
  (void)state;
  try_damaged(qmat_obj_read, sample, strlen(sample));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_vertices_and_facets_are_read_and_the_rest_passed_over),
      cmocka_unit_test(test_line_ends_of_every_system_are_read),
      cmocka_unit_test(test_bad_files_are_refused_with_the_place),
      cmocka_unit_test(test_damaged_files_never_crash),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
