/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/medial_complex.h"
#include "nodes/measure/medial_topology.h"
#include "tests/medial_meshes.h"
#include "tests/random.h"

static qmat_topology topology_of(qmat_medial *medial) {
  qmat_context context = {0};
  qmat_topology topology;
  assert_int_equal(qmat_topology_of_medial(&context, medial, &topology), QMAT_OK);
  assert_true(topology.known);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
  return topology;
}

/* The topology of the live simplices. */
static qmat_topology topology_left(const qmat_complex *c) {
  enum { MOST = 256 };
  uint32_t ids[MOST], edges[2 * MOST], triangles[3 * MOST];
  size_t vertex_count = 0, edge_count = 0, triangle_count = 0;
  assert_true(c->vertex_count <= MOST && c->edge_count <= MOST && c->triangle_count <= MOST);
  for (size_t v = 0; v < c->vertex_count; v++) ids[v] = c->vertex_alive[v] ? (uint32_t)vertex_count++ : QMAT_NONE;
  for (size_t e = 0; e < c->edge_count; e++)
    for (size_t k = 0; k < 2 && c->edge_alive[e]; k++) edges[edge_count++] = ids[c->edges[2 * e + k]];
  for (size_t t = 0; t < c->triangle_count; t++)
    for (size_t k = 0; k < 3 && c->triangle_alive[t]; k++) triangles[triangle_count++] = ids[c->triangles[3 * t + k]];
  return topology_of(sealed_medial_mesh(NULL, vertex_count, edges, edge_count / 2, triangles, triangle_count / 3));
}

static bool are_equal(qmat_topology a, qmat_topology b) {
  return a.components == b.components && a.loops == b.loops && a.voids == b.voids;
}

/* Whether the collapse of the edge (0, 1) keeps the homotopy type. */
static bool keeps(size_t spheres, const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                  size_t triangle_count) {
  qmat_context context = {0};
  qmat_complex complex;
  qmat_collapse collapse = {0};
  qmat_medial *medial = sealed_medial_mesh(NULL, spheres, edges, edge_count, triangles, triangle_count);
  assert_int_equal(qmat_complex_init(&context, &complex, medial, NULL), QMAT_OK);
  qmat_value_release(&medial->base);
  assert_int_equal(qmat_complex_preview(&context, &complex, qmat_complex_find_edge(&complex, 0, 1), &collapse),
                   QMAT_OK);
  const bool result = qmat_collapse_keeps_homotopy(&complex, &collapse);
  qmat_collapse_uninit(&collapse);
  qmat_complex_uninit(&complex);
  qmat_context_uninit(&context);
  return result;
}

static void test_cases_by_hand(void **state) {
  (void)state;
  static const uint32_t ring[] = {0, 1, 1, 2, 0, 2}, triangle[] = {0, 1, 2};
  assert_true(keeps(2, ring, 1, NULL, 0));
  assert_false(keeps(3, ring, 3, NULL, 0)); /* an empty triangle is a loop */
  assert_true(keeps(3, NULL, 0, triangle, 1));
  static const uint32_t tetrahedron[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3};
  assert_false(keeps(4, NULL, 0, tetrahedron, 4)); /* four triangles around a void */
  /* Without one of them the others fill its sides: no loop, though the link condition fails for 3. */
  static const uint32_t bowl[] = {0, 1, 2, 0, 2, 3, 1, 2, 3};
  assert_true(keeps(4, NULL, 0, bowl, 3));
  static const uint32_t open_bowl[] = {0, 2, 3, 1, 2, 3};
  assert_false(keeps(4, ring, 1, open_bowl, 2)); /* the edge (0, 1) closes a loop around 2 and 3 */
}

static void test_collapses_that_are_allowed_keep_all_betti_numbers(void **state) {
  (void)state;
  size_t allowed = 0, refused_rightly = 0;
  for (uint64_t seed = 0; seed < 300; seed++) {
    random_numbers random = {.seed = seed};
    enum { SPHERES = 9 };
    uint32_t edges[2 * 12], triangles[3 * 24];
    const size_t edge_count = random_index(&random, 12), triangle_count = 4 + random_index(&random, 20);
    for (size_t i = 0; i < edge_count; i++) {
      edges[2 * i] = (uint32_t)random_index(&random, SPHERES);
      edges[2 * i + 1] = (edges[2 * i] + 1 + (uint32_t)random_index(&random, SPHERES - 1)) % SPHERES;
    }
    for (size_t i = 0; i < triangle_count; i++) {
      uint32_t *t = &triangles[3 * i];
      t[0] = (uint32_t)random_index(&random, SPHERES);
      t[1] = (t[0] + 1 + (uint32_t)random_index(&random, SPHERES - 1)) % SPHERES;
      do t[2] = (uint32_t)random_index(&random, SPHERES);
      while (t[2] == t[0] || t[2] == t[1]);
    }
    qmat_context context = {0};
    qmat_complex complex;
    qmat_collapse collapse = {0};
    qmat_medial *medial = sealed_medial_mesh(NULL, SPHERES, edges, edge_count, triangles, triangle_count);
    assert_int_equal(qmat_complex_init(&context, &complex, medial, NULL), QMAT_OK);
    qmat_topology before = topology_of(medial);
    for (uint32_t e = 0; e < complex.edge_count; e++) {
      if (!complex.edge_alive[e]) continue;
      static const double sphere[4] = {0, 0, 0, 1};
      assert_int_equal(qmat_complex_preview(&context, &complex, e, &collapse), QMAT_OK);
      const bool is_allowed = qmat_collapse_keeps_homotopy(&complex, &collapse);
      if (!is_allowed && random_index(&random, 4) > 0) continue;
      assert_int_equal(qmat_complex_collapse(&context, &complex, &collapse, sphere), QMAT_OK);
      const qmat_topology after = topology_left(&complex);
      if (is_allowed) assert_true(are_equal(before, after));
      allowed += is_allowed;
      refused_rightly += !is_allowed && !are_equal(before, after);
      before = after;
    }
    qmat_collapse_uninit(&collapse);
    qmat_complex_uninit(&complex);
    qmat_context_uninit(&context);
  }
  assert_true(allowed > 500 && refused_rightly > 100);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_cases_by_hand),
      cmocka_unit_test(test_collapses_that_are_allowed_keep_all_betti_numbers),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
