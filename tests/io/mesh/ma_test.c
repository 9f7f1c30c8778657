/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/mesh/ma.h"

#include <locale.h>

#include "tests/io/files.h"

static const char sample[] =
    "4 2 1 # spheres edges triangles\n"
    "v 0 0 0 1\n"
    "v 1 0 0 0.5\r\n"
    "v 0 1e0 -0.1 0\n"
    "v 5 5 5 2\n"
    "e 3 0\n"
    "e 0 1\n"
    "f 2 0 1\n";

static qmat_status read_text(qmat_context *context, const void *text, size_t size, qmat_medial **medial) {
  qmat_bytes bytes = memory_file(text, size);
  qmat_status status = qmat_ma_read(context, &bytes, "file", medial);
  assert_true((status == QMAT_OK) == (*medial != NULL));
  free(bytes.data);
  return status;
}

static void test_spheres_edges_and_triangles_are_read_and_sorted(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial;
  assert_int_equal(read_text(&context, sample, strlen(sample), &medial), QMAT_OK);
  static const double spheres[] = {0, 0, 0, 1, 1, 0, 0, 0.5, 0, 1, -0.1, 0, 5, 5, 5, 2};
  static const uint32_t edges[] = {0, 1, 0, 2, 0, 3, 1, 2}, triangle[] = {0, 1, 2};
  assert_true(medial->base.sealed);
  assert_int_equal(medial->sphere_count, 4);
  assert_positions(medial->spheres, spheres, 16);
  assert_int_equal(medial->edge_count, 4);
  assert_memory_equal(medial->edges, edges, sizeof edges);
  assert_int_equal(medial->triangle_count, 1);
  assert_memory_equal(medial->triangles, triangle, sizeof triangle);
  qmat_value_release(&medial->base);
}

static void test_bad_files_are_refused_with_the_place(void **state) {
  (void)state;
  static const char *const cases[][2] = {
      {"x", "file:1:1: the number of spheres is 'x', not a whole number"},
      {"0 0 0\n", "file:1:6: the medial mesh has no spheres"},
      {"4000000000 0 0\nv 0 0 0 1\n", "file:1:11: the number of spheres is 4000000000, more than the file can hold"},
      {"1 4000000000 0\nv 0 0 0 1\n", "file:1:13: the number of edges is 4000000000, more than the file can hold"},
      {"1 0 4000000000\nv 0 0 0 1\n", "file:1:15: the number of triangles is 4000000000, more than the file can hold"},
      {"1 0 0\nv 0 0 0 -1\n", "file:2:9: sphere 0: the radius of a sphere is negative"},
      {"1 0 0\nv 0 nan 0 1\n", "file:2:5: sphere 0: the y coordinate of a sphere is not finite"},
      {"1 0 0\nv 0 0 1e999 1\n", "file:2:7: sphere 0: the z coordinate of a sphere is not finite"},
      {"1 0 0\nv 0 0 0\n", "file:3:1: sphere 0: expected the radius of a sphere, found the end of the file"},
      {"2 1 0\nv 0 0 0 1\nv 1 0 0 1\ne 0 2\n", "file:4:5: edge 0: a sphere index is '2', outside 0 to 1"},
      {"2 1 0\nv 0 0 0 1\nv 1 0 0 1\ne 1 1\n", "file:4:6: edge 0: the edge has sphere 1 twice"},
      {"2 0 1\nv 0 0 0 1\nv 1 0 0 1\nf 1 0 1\n", "file:4:8: triangle 0: the triangle has sphere 1 twice"},
      {"1 0 0\nw 0 0 0 1\n", "file:2:1: expected v, e or f, found 'w'"},
      {"2 0 0\nv 0 0 0 1          \n",
       "file:3:1: the file ends after 1 of 2 spheres, 0 of 0 edges and 0 of 0 triangles"},
      {"2 0 0\nv 0 0 0 1\ne 0 1\nv 0 0 0 1\n", "file:3:2: there are more than the 0 edges of the header"},
      {"1 0 0\nv 0 0 0 1\nv 0 0 0 1\n", "file:3:1: expected the end of the file, found 'v'"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    qmat_context context = {0};
    qmat_medial *medial;
    char text[512];
    assert_int_equal(read_text(&context, cases[i][0], strlen(cases[i][0]), &medial), QMAT_ERROR_FORMAT);
    qmat_error_format(&context.error, text, sizeof text);
    assert_string_equal(text, cases[i][1]);
  }
}

static void test_damaged_files_never_crash(void **state) {
  (void)state;
  char copy[sizeof sample];
  qmat_context context = {0};
  qmat_medial *medial;
  for (uint64_t round = 0; round < 5000; round++) {
    memcpy(copy, sample, sizeof sample);
    size_t size = sizeof sample - 1;
    if (round <= size) {
      size = (size_t)round;
    } else {
      for (uint64_t k = 0; k <= round % 3; k++) {
        const uint64_t random = qmat_hash3(4, round, k);
        copy[random % size] = "0123456789-+.e \nvefn\x80"[(random >> 32) % 21];
      }
    }
    if (read_text(&context, copy, size, &medial) == QMAT_OK) {
      qmat_value_release(&medial->base);
    } else {
      assert_string_equal(context.error.file, "file");
    }
  }
  qmat_context_uninit(&context);
}

static void check_round_trip(void) {
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new(), *back;
  enum { SPHERES = 200 };
  medial->sphere_count = SPHERES;
  medial->spheres = qmat_alloc(SPHERES, 4 * sizeof(double));
  medial->edges = qmat_alloc(1, 2 * sizeof(uint32_t));
  medial->triangles = qmat_alloc(0, 3 * sizeof(uint32_t));
  medial->edge_count = 1;
  medial->edges[0] = 3;
  medial->edges[1] = 199;
  for (uint64_t i = 0; i < 4 * SPHERES; i++) {
    const double number = (qmat_hash_unit(qmat_hash3(6, i, 0)) - 0.5) * pow(10, (double)(i % 30) - 15);
    medial->spheres[i] = i % 4 == 3 ? fabs(number) : number;
  }
  medial->spheres[0] = -0.0;
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_file *file;
  assert_int_equal(qmat_ma_write(&context, medial, &file), QMAT_OK);
  assert_string_equal(file->format, "ma");
  assert_int_equal(read_text(&context, file->parts[0].bytes, file->parts[0].size, &back), QMAT_OK);
  assert_memory_equal(&back->base.digest, &medial->base.digest, sizeof back->base.digest);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&back->base);
}

static void test_what_is_written_reads_back_as_the_same_in_any_locale(void **state) {
  (void)state;
  check_round_trip();
  if (setlocale(LC_ALL, "de_DE.UTF-8")) check_round_trip();
  setlocale(LC_ALL, "C");
}

static void test_a_small_mesh_is_written_line_by_line(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial;
  assert_int_equal(read_text(&context, sample, strlen(sample), &medial), QMAT_OK);
  qmat_file *file;
  assert_int_equal(qmat_ma_write(&context, medial, &file), QMAT_OK);
  static const char expected[] =
      "4 4 1\nv 0 0 0 1\nv 1 0 0 0.5\nv 0 1 -0.1 0\nv 5 5 5 2\ne 0 1\ne 0 2\ne 0 3\ne 1 2\nf 0 1 2\n";
  assert_int_equal(file->parts[0].size, strlen(expected));
  assert_memory_equal(file->parts[0].bytes, expected, strlen(expected));
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_spheres_edges_and_triangles_are_read_and_sorted),
      cmocka_unit_test(test_bad_files_are_refused_with_the_place),
      cmocka_unit_test(test_damaged_files_never_crash),
      cmocka_unit_test(test_what_is_written_reads_back_as_the_same_in_any_locale),
      cmocka_unit_test(test_a_small_mesh_is_written_line_by_line),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
