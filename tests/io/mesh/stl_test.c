/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/mesh/mesh_formats.h"
#include "tests/io/files.h"

static const char sample[] =
    "solid a name\n"
    "  facet normal 0 0 1\n"
    "    outer loop\n"
    "      vertex 0 0 0\n"
    "      vertex 1.5 0 0\n"
    "      vertex 0 1 -.25\n"
    "    endloop\n"
    "  endfacet\n"
    "endsolid a name\n"
    "SOLID\nFacet Normal nan nan nan Outer Loop Vertex 1 2 3 Vertex 4 5 6 Vertex 7 8 9 EndLoop EndFacet\n"
    "EndSolid";

static const double expected[] = {0, 0, 0, 1.5, 0, 0, 0, 1, -0.25, 1, 2, 3, 4, 5, 6, 7, 8, 9};

/* The same two facets as a binary file that starts with `title`. */
static size_t make_binary(const char *title, uint8_t bytes[256]) {
  memset(bytes, ' ', 256);
  memcpy(bytes, title, strlen(title));
  memcpy(bytes + 80, "\2\0\0\0", 4);
  size_t at = 84;
  for (int k = 0; k < 18; k++) {
    if (k % 9 == 0) {
      memset(bytes + at, 0, 12);
      at += 12;
    }
    const float number = (float)expected[k];
    memcpy(bytes + at, &number, 4);
    at += 4;
    if (k % 9 == 8) {
      memcpy(bytes + at, "\xFF\xFF", 2);
      at += 2;
    }
  }
  return at;
}

static void assert_two_facets(const void *content, size_t size, int line) {
  static const uint32_t corners[] = {0, 1, 2, 3, 4, 5};
  qmat_soup soup = read_good(qmat_stl_read, content, size);
  assert_int_equal(soup.vertex_count, 6);
  assert_positions(soup.positions, expected, 18);
  assert_int_equal(soup.facet_count, 2);
  assert_memory_equal(soup.corners, corners, sizeof corners);
  assert_int_equal(soup.facet_lines[1], line);
  qmat_soup_uninit(&soup);
}

static void test_ascii_and_binary_files_give_the_same(void **state) {
  (void)state;
  uint8_t bytes[256];
  assert_two_facets(sample, strlen(sample), 11);
  assert_two_facets(bytes, make_binary("a header", bytes), 0);
}

static void test_a_binary_file_that_starts_with_solid_is_binary(void **state) {
  (void)state;
  uint8_t bytes[256];
  assert_two_facets(bytes, make_binary("solid as a rock\nfacet normal", bytes), 0);
}

static void test_an_empty_solid_is_read_as_no_facets(void **state) {
  (void)state;
  qmat_soup soup = read_good(qmat_stl_read, "solid\nendsolid\n", 15);
  assert_int_equal(soup.facet_count, 0);
  qmat_soup_uninit(&soup);
}

static void test_bad_files_are_refused_with_the_place(void **state) {
  (void)state;
  uint8_t bytes[256];
  size_t size = make_binary("solid", bytes);
  assert_refused(qmat_stl_read, bytes, size - 1,
                 "file: the binary STL header counts 2 facets, which take 184 bytes, but the file has 183");
  assert_refused(qmat_stl_read, bytes, size + 1,
                 "file: the binary STL header counts 2 facets, which take 184 bytes, but the file has 185");
  memcpy(bytes + 80, "\0\x28\x6B\xEE", 4); /* 4000000000 */
  assert_refused(
      qmat_stl_read, bytes, size,
      "file: the binary STL header counts 4000000000 facets, which take 200000000084 bytes, but the file has 184");
  static const char *const cases[][2] = {
      {"hello", "file: not an STL file: text starts with 'solid', and binary STL has at least 84 bytes, not 5"},
      {"solid x\nfacet normal 0 0\n outer", "file:3:2: facet 0: a coordinate of a normal is 'outer', not a number"},
      {"solid x\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 0 0 0 endloop",
       "file:2:57: facet 0: expected 'vertex', found 'endloop'"},
      {"solid x\nfacet normal 0 0 1 outer loop", "file:2:30: facet 0: expected 'vertex', found the end of the file"},
      {"solid x\n", "file:2:1: expected 'endsolid', found the end of the file"},
      {"solid x\nendsolid\nmore", "file:3:1: expected 'solid', found 'more'"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    assert_text_refused(qmat_stl_read, cases[i][0], cases[i][1]);
  }
}

static void test_damaged_files_never_crash(void **state) {
  (void)state;
  uint8_t bytes[256];
  try_damaged(qmat_stl_read, sample, strlen(sample));
  try_damaged(qmat_stl_read, bytes, make_binary("", bytes));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_ascii_and_binary_files_give_the_same),
      cmocka_unit_test(test_a_binary_file_that_starts_with_solid_is_binary),
      cmocka_unit_test(test_an_empty_solid_is_read_as_no_facets),
      cmocka_unit_test(test_bad_files_are_refused_with_the_place),
      cmocka_unit_test(test_damaged_files_never_crash),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
