/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/topology_mending.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/hash.h"
#include "tests/medial_meshes.h"
#include "tests/shapes.h"

/* A medial mesh of small spheres in a cube, far from its surface, so that every edit is refused. */
typedef struct scene {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_simplification simplification;
  qmat_simplified result;
  size_t edits; /* tried */
} scene;

static bool on_progress(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                        const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total;
  scene *s = user;
  s->edits += strcmp(unit, "edits") == 0;
  return true;
}

/* Takes the medial mesh over. */
static void make_scene(scene *s, qmat_medial *medial) {
  *s = (scene){.context = {.progress = on_progress, .progress_user = s, .threads = 1},
               .mesh = shape_seal(shape_box(1, 1, 1))};
  s->simplification = (qmat_simplification){.context = &s->context,
                                            .params = {.epsilon = 0.01, .error = QMAT_ERROR_ONE_SIDED},
                                            .solid = {.known = true, .components = 1, .euler = 1}};
  assert_int_equal(qmat_surface_new(&s->context, s->mesh, &s->simplification.surface), QMAT_OK);
  s->result = (qmat_simplified){.medial = medial};
}

static void free_scene(scene *s) {
  qmat_simplified_uninit(&s->result);
  qmat_simplification_uninit(&s->simplification);
  qmat_value_release(&s->mesh->base);
  qmat_context_uninit(&s->context);
}

/* Each two of 12 spheres have an edge: any three of them form a loop. */
static void test_a_limited_number_of_edits_is_tried_for_a_loop(void **state) {
  (void)state;
  enum { SPHERES = 12, EDGES = SPHERES * (SPHERES - 1) / 2 };
  double spheres[4 * SPHERES];
  uint32_t edges[2 * EDGES], count = 0;
  for (uint32_t i = 0; i < SPHERES; i++) {
    for (uint32_t k = 0; k < 3; k++) spheres[4 * i + k] = 0.2 * (qmat_hash_unit(qmat_hash3(1, i, k)) - 0.5);
    spheres[4 * i + 3] = 0.01;
    for (uint32_t j = i + 1; j < SPHERES; j++, count++) {
      edges[2 * count] = i;
      edges[2 * count + 1] = j;
    }
  }
  scene s;
  make_scene(&s, medial_mesh(spheres, SPHERES, edges, EDGES, NULL, 0));
  assert_int_equal(qmat_simplification_close_loops(&s.simplification, &s.result), QMAT_OK);
  assert_int_equal(s.result.medial->sphere_count, SPHERES);
  assert_int_equal(s.result.medial->edge_count, EDGES);
  assert_int_equal(s.result.medial->triangle_count, 0);
  /* Slabs, whole edges, and parts of edges of four sizes at both ends. */
  assert_int_equal(s.edits, QMAT_MOST_WALLS * (1 + 1 + 4 * 2));
  free_scene(&s);
}

/* The spheres of sheets are the first ones, so that no new sphere divides a slab of a sheet. Makes four spheres with
 * these simplices, as a solid's and as a sheet's, and counts the edits. */
static void check_sheet(const uint32_t *edges, size_t edge_count, const uint32_t *walls, size_t wall_count,
                        const double *spheres, size_t of_solid) {
  for (size_t sheet = 0; sheet < 2; sheet++) {
    scene s;
    make_scene(&s, medial_mesh(spheres, 4, edges, edge_count, walls, wall_count));
    s.result.medial->sheet_sphere_count = 4 * sheet;
    assert_int_equal(
        (walls ? qmat_simplification_open_voids : qmat_simplification_close_loops)(&s.simplification, &s.result),
        QMAT_OK);
    assert_int_equal(walls ? s.result.medial->triangle_count : s.result.medial->edge_count, 4);
    assert_int_equal(s.edits, sheet ? 4 : of_solid);
    free_scene(&s);
  }
}

static void test_walls_of_sheets_are_not_divided(void **state) {
  (void)state;
  static const double spheres[] = {0.1, 0, 0, 0.01, 0, 0.1, 0, 0.01, 0, 0, 0.1, 0.01, 0, 0, 0, 0.01};
  static const uint32_t walls[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3};
  check_sheet(NULL, 0, walls, 4, spheres, 4 + 4 * QMAT_MOST_WALLS);
}

static void test_edges_of_sheets_are_not_divided(void **state) {
  (void)state;
  static const double spheres[] = {0.1, 0, 0, 0.01, 0, 0.1, 0, 0.01, -0.1, 0, 0, 0.01, 0, -0.1, 0, 0.01};
  static const uint32_t edges[] = {0, 1, 1, 2, 2, 3, 0, 3};
  check_sheet(edges, 4, NULL, 0, spheres, 4 + 4 * 4 * 2);
}

/* Edits remove no spheres: where another start has fewer, none is tried. */
static void test_a_beaten_result_is_not_mended(void **state) {
  (void)state;
  static const double spheres[] = {0.1, 0, 0, 0.01, 0, 0.1, 0, 0.01, 0, 0, 0.1, 0.01, 0, 0, 0, 0.01};
  static const uint32_t walls[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3}, loop[] = {0, 1, 1, 2, 2, 3, 0, 3};
  static const size_t rivals[] = {0, 3, 4, SIZE_MAX}; /* 0: not known yet; SIZE_MAX: none */
  for (size_t i = 0; i < sizeof rivals / sizeof *rivals; i++)
    for (int has_walls = 0; has_walls < 2; has_walls++) {
      scene s;
      const _Atomic size_t rival = rivals[i];
      make_scene(&s, medial_mesh(spheres, 4, loop, has_walls ? 0 : 4, walls, has_walls ? 4 : 0));
      s.simplification.rival_count = &rival;
      assert_int_equal(qmat_simplification_open_voids(&s.simplification, &s.result), QMAT_OK);
      assert_int_equal(qmat_simplification_close_loops(&s.simplification, &s.result), QMAT_OK);
      assert_true(rivals[i] == 3 ? s.edits == 0 : s.edits > 0);
      free_scene(&s);
    }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_limited_number_of_edits_is_tried_for_a_loop),
      cmocka_unit_test(test_walls_of_sheets_are_not_divided),
      cmocka_unit_test(test_edges_of_sheets_are_not_divided),
      cmocka_unit_test(test_a_beaten_result_is_not_mended),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
