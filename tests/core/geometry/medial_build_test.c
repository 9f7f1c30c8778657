/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/medial_build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/hash.h"
#include "core/value_check.h"

static qmat_medial *spheres(size_t count) {
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = count;
  medial->spheres = qmat_calloc(count, 4 * sizeof *medial->spheres);
  assert_non_null(medial->spheres);
  return medial;
}

static void test_rows_come_out_sorted_once_and_with_the_edges_of_triangles(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = spheres(6);
  const uint32_t edges[] = {5, 4, 1, 0, 3, 3, 4, 5, 0, 1};
  const uint32_t triangles[] = {3, 1, 2, 2, 2, 0, 0, 2, 1, 1, 2, 0};
  assert_int_equal(qmat_medial_set_simplices(&context, medial, edges, 5, triangles, 4), QMAT_OK);
  const uint32_t expected_edges[] = {0, 1, 0, 2, 1, 2, 1, 3, 2, 3, 4, 5}, expected_triangles[] = {0, 1, 2, 1, 2, 3};
  assert_int_equal(medial->edge_count, 6);
  assert_memory_equal(medial->edges, expected_edges, sizeof expected_edges);
  assert_int_equal(medial->triangle_count, 2);
  assert_memory_equal(medial->triangles, expected_triangles, sizeof expected_triangles);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_value_release(&medial->base);
}

static void test_nothing_gives_empty_arrays_that_can_be_sealed(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = spheres(1);
  assert_int_equal(qmat_medial_set_simplices(&context, medial, NULL, 0, NULL, 0), QMAT_OK);
  assert_int_equal(medial->edge_count, 0);
  assert_int_equal(medial->triangle_count, 0);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_value_release(&medial->base);
}

static void test_ids_out_of_range_are_named_and_change_nothing(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = spheres(3);
  const uint32_t good[] = {0, 1}, edges[] = {0, 1, 2, 3}, triangles[] = {0, 1, 2, 0, UINT32_MAX, 1};
  assert_int_equal(qmat_medial_set_simplices(&context, medial, good, 1, NULL, 0), QMAT_OK);
  assert_int_equal(qmat_medial_set_simplices(&context, medial, edges, 2, NULL, 0), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.element_kind, "edge");
  assert_int_equal(context.error.element, 1);
  assert_string_equal(context.error.message, "it names sphere 3 of 3");
  assert_int_equal(qmat_medial_set_simplices(&context, medial, good, 1, triangles, 2), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.element_kind, "triangle");
  assert_int_equal(context.error.element, 1);
  assert_int_equal(medial->edge_count, 1);
  assert_int_equal(medial->triangle_count, 0);
  qmat_value_release(&medial->base);
}

/* Against a table of which edges and triangles there are. */
static void test_random_rows_agree_with_a_table_and_setting_them_again_changes_nothing(void **state) {
  (void)state;
  enum { SPHERES = 9, EDGES = 20, TRIANGLES = 25 };
  for (uint64_t round = 0; round < 200; round++) {
    qmat_context context = {0};
    qmat_medial *medial = spheres(SPHERES);
    uint32_t edges[2 * EDGES], triangles[3 * TRIANGLES];
    bool edge_is[SPHERES][SPHERES] = {{false}}, triangle_is[SPHERES][SPHERES][SPHERES] = {{{false}}};
    for (uint64_t i = 0; i < 2 * EDGES; i++) edges[i] = (uint32_t)(qmat_hash3(1, round, i) % SPHERES);
    for (uint64_t i = 0; i < 3 * TRIANGLES; i++) triangles[i] = (uint32_t)(qmat_hash3(2, round, i) % SPHERES);
    for (int i = 0; i < EDGES; i++) edge_is[edges[2 * i]][edges[2 * i + 1]] = true;
    for (int i = 0; i < TRIANGLES; i++) {
      const uint32_t a = triangles[3 * i], b = triangles[3 * i + 1], c = triangles[3 * i + 2];
      triangle_is[a][b][c] = true;
      if (a != b && b != c && c != a) edge_is[a][b] = edge_is[b][c] = edge_is[c][a] = true;
    }
    assert_int_equal(qmat_medial_set_simplices(&context, medial, edges, EDGES, triangles, TRIANGLES), QMAT_OK);
    size_t edge = 0, triangle = 0;
    for (uint32_t a = 0; a < SPHERES; a++) {
      for (uint32_t b = a + 1; b < SPHERES; b++) {
        if (edge_is[a][b] || edge_is[b][a]) {
          assert_true(edge < medial->edge_count);
          assert_int_equal(medial->edges[2 * edge], a);
          assert_int_equal(medial->edges[2 * edge++ + 1], b);
        }
        for (uint32_t c = b + 1; c < SPHERES; c++) {
          if (!(triangle_is[a][b][c] || triangle_is[b][c][a] || triangle_is[c][a][b] || triangle_is[a][c][b] ||
                triangle_is[c][b][a] || triangle_is[b][a][c])) {
            continue;
          }
          assert_true(triangle < medial->triangle_count);
          assert_int_equal(medial->triangles[3 * triangle], a);
          assert_int_equal(medial->triangles[3 * triangle + 1], b);
          assert_int_equal(medial->triangles[3 * triangle++ + 2], c);
        }
      }
    }
    assert_int_equal(edge, medial->edge_count);
    assert_int_equal(triangle, medial->triangle_count);
    /* The medial mesh's own arrays may be given. */
    assert_int_equal(qmat_medial_set_simplices(&context, medial, medial->edges, edge, medial->triangles, triangle),
                     QMAT_OK);
    assert_int_equal(edge, medial->edge_count);
    assert_int_equal(triangle, medial->triangle_count);
    assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
    qmat_value_release(&medial->base);
  }
}

static void test_a_simplex_is_found_where_it_is_and_nowhere_else(void **state) {
  (void)state;
  const uint32_t rows[] = {0, 1, 2, 0, 1, 5, 0, 3, 4, 2, 3, 4};
  assert_int_equal(qmat_simplex_find(rows, 0, 3, rows), SIZE_MAX);
  for (uint32_t a = 0; a < 6; a++) {
    for (uint32_t b = a + 1; b < 6; b++) {
      for (uint32_t c = b + 1; c < 6; c++) {
        const uint32_t row[] = {a, b, c};
        size_t expected = SIZE_MAX;
        for (size_t i = 0; i < 4; i++)
          if (memcmp(&rows[3 * i], row, sizeof row) == 0) expected = i;
        assert_int_equal(qmat_simplex_find(rows, 4, 3, row), expected);
      }
    }
  }
}

static void test_a_copy_has_the_same_digest_and_arrays_of_its_own(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_medial *medial = spheres(4);
  const uint32_t edges[] = {2, 3}, triangles[] = {0, 1, 2};
  for (size_t i = 0; i < 16; i++) medial->spheres[i] = 1 + (double)i;
  assert_int_equal(qmat_medial_set_simplices(&context, medial, edges, 1, triangles, 1), QMAT_OK);
  const uint32_t offsets[] = {0, 1, 1, 2, 2};
  medial->region_offset_count = 5;
  medial->region_sample_count = 2;
  medial->region_offsets = qmat_alloc(5, sizeof *offsets);
  medial->region_samples = qmat_calloc(2, sizeof *medial->region_samples);
  memcpy(medial->region_offsets, offsets, sizeof offsets);
  qmat_medial *copy = qmat_medial_copy(medial);
  assert_non_null(copy);
  assert_int_equal(qmat_value_seal(&context, &medial->base), QMAT_OK);
  qmat_medial *late = qmat_medial_copy(medial);
  assert_false(late->base.sealed);
  assert_int_equal(qmat_value_seal(&context, &copy->base), QMAT_OK);
  assert_int_equal(qmat_value_seal(&context, &late->base), QMAT_OK);
  assert_memory_equal(&copy->base.digest, &medial->base.digest, sizeof medial->base.digest);
  assert_memory_equal(&late->base.digest, &medial->base.digest, sizeof medial->base.digest);
  assert_ptr_not_equal(copy->spheres, medial->spheres);
  qmat_value_release(&medial->base);
  qmat_value_release(&copy->base);
  qmat_value_release(&late->base);
}

static void test_side_k_lies_opposite_to_corner_k_and_a_missing_one_is_named(void **state) {
  (void)state;
  qmat_context context = {0};
  uint32_t edges[] = {0, 1, 0, 2, 1, 2, 1, 3, 2, 3}, triangles[] = {0, 1, 2, 1, 2, 3}, sides[6];
  qmat_medial medial = {.edge_count = 5, .triangle_count = 2, .edges = edges, .triangles = triangles};
  assert_int_equal(qmat_medial_sides(&context, &medial, sides), QMAT_OK);
  const uint32_t expected[] = {2, 1, 0, 4, 3, 2};
  assert_memory_equal(sides, expected, sizeof expected);
  medial.edge_count = 4;
  assert_int_equal(qmat_medial_sides(&context, &medial, sides), QMAT_ERROR_INTERNAL);
  assert_string_equal(context.error.message, "the medial mesh lacks the edge 2 3");
  assert_string_equal(context.error.element_kind, "triangle");
  assert_int_equal(context.error.element, 1);
}

static void test_rows_of_an_id_that_goes_are_left_out_and_the_others_renumbered(void **state) {
  (void)state;
  const uint32_t ids[] = {0, QMAT_NONE, 1, 1, 7};
  uint32_t rows[] = {0, 2, 1, 2, 4, 1, 2, 3, 4, 0}, kept[10];
  const uint32_t expected[] = {0, 1, 1, 1, 7, 0};
  assert_int_equal(qmat_medial_renumber(rows, 5, 2, ids, kept), 3);
  assert_memory_equal(kept, expected, sizeof expected);
  assert_int_equal(qmat_medial_renumber(rows, 5, 2, ids, rows), 3);
  assert_memory_equal(rows, expected, sizeof expected);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_rows_come_out_sorted_once_and_with_the_edges_of_triangles),
      cmocka_unit_test(test_nothing_gives_empty_arrays_that_can_be_sealed),
      cmocka_unit_test(test_ids_out_of_range_are_named_and_change_nothing),
      cmocka_unit_test(test_random_rows_agree_with_a_table_and_setting_them_again_changes_nothing),
      cmocka_unit_test(test_a_simplex_is_found_where_it_is_and_nowhere_else),
      cmocka_unit_test(test_a_copy_has_the_same_digest_and_arrays_of_its_own),
      cmocka_unit_test(test_side_k_lies_opposite_to_corner_k_and_a_missing_one_is_named),
      cmocka_unit_test(test_rows_of_an_id_that_goes_are_left_out_and_the_others_renumbered),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
