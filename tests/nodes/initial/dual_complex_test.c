/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/dual_complex.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/arena.h"
#include "nodes/initial/dual_components.h"
#include "tests/shapes.h"

static void free_dual(qmat_dual_complex *dual) {
  qmat_free(dual->edges);
  qmat_free(dual->triangles);
  qmat_free(dual->edge_duals);
  qmat_free(dual->triangle_duals);
}

/* --- connectivity ------------------------------------------------------------------------------------------------ */

enum { RING = 6000 };

/* A ring of tetrahedra around the edge of the points 0 and 1, each with a medial vertex of its own. Tetrahedron number
 * i has the place (step * i) mod RING in the ring. */
static void make_ring(qmat_context *context, qmat_dual_complex *dual, size_t step) {
  static uint32_t corners[4 * RING], neighbours[4 * RING], sphere_of[RING], at[RING];
  static uint8_t kinds[RING];
  for (size_t i = 0; i < RING; i++) at[step * i % RING] = (uint32_t)i;
  for (size_t place = 0; place < RING; place++) {
    const uint32_t cell = at[place], next = (uint32_t)((place + 1) % RING);
    const uint32_t of_cell[] = {0, 1, (uint32_t)(2 + place), 2 + next};
    const uint32_t beside[] = {QMAT_NO_TETRAHEDRON, QMAT_NO_TETRAHEDRON, at[next], at[(place + RING - 1) % RING]};
    memcpy(&corners[4 * (size_t)cell], of_cell, sizeof of_cell);
    memcpy(&neighbours[4 * (size_t)cell], beside, sizeof beside);
    sphere_of[cell] = cell;
    kinds[cell] = QMAT_CELL_CIRCUMCENTRE;
  }
  *dual = (qmat_dual_complex){.context = context,
                              .cells = {.count = RING, .corners = corners, .neighbours = neighbours},
                              .kinds = kinds,
                              .sphere_of = sphere_of,
                              .sphere_count = RING,
                              .keep_duals = true};
}

static void test_a_ring_of_any_length_has_its_polygon(void **state) {
  (void)state;
  static const size_t steps[] = {1, RING - 1, 7};
  for (size_t n = 0; n < sizeof steps / sizeof *steps; n++) {
    qmat_context context = {0};
    qmat_dual_complex dual;
    make_ring(&context, &dual, steps[n]);
    assert_int_equal(qmat_dual_connect(&dual), QMAT_OK);
    assert_int_equal(dual.edge_count, RING);
    assert_int_equal(dual.triangle_count, RING - 2);
    static uint8_t met[RING];
    memset(met, 0, sizeof met);
    for (size_t i = 0; i < 3 * dual.triangle_count; i++) met[dual.triangles[i]] = 1;
    for (size_t i = 0; i < RING; i++) assert_int_equal(met[i], 1);
    for (size_t i = 0; i < 2 * dual.triangle_count; i++) assert_int_equal(dual.triangle_duals[i], i % 2);
    free_dual(&dual);
    qmat_context_uninit(&context);
  }
}

static void test_a_ring_with_a_gap_has_no_polygon(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_dual_complex dual;
  make_ring(&context, &dual, 7);
  dual.kinds[RING / 2] = QMAT_CELL_DROPPED;
  assert_int_equal(qmat_dual_connect(&dual), QMAT_OK);
  assert_int_equal(dual.edge_count, RING - 2);
  assert_int_equal(dual.triangle_count, 0);
  free_dual(&dual);
  qmat_context_uninit(&context);
}

/* --- links ------------------------------------------------------------------------------------------------------- */

enum { STARS = 3, STAR = 40, CELLS = STARS * STAR };

/* Three components of 40 spheres, all of which touch sample 0. Component k is a chain along a line of its own. */
typedef struct star {
  qmat_context context;
  qmat_mesh *mesh;
  qmat_surface *surface;
  qmat_dual_complex dual;
  uint32_t corners[4 * CELLS], sphere_of[CELLS];
  uint8_t kinds[CELLS];
  double spheres[4 * CELLS];
  size_t asked, most; /* progress: calls, and how many go on */
} star;

static bool on_progress(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                        const char *unit) {
  (void)node_id, (void)node_type, (void)done, (void)total, (void)unit;
  star *s = user;
  return s->asked++ < s->most;
}

static void make_star(star *s, size_t most) {
  *s = (star){.most = most};
  s->mesh = shape_seal(shape_box(1, 1, 1));
  assert_int_equal(qmat_surface_new(&s->context, s->mesh, &s->surface), QMAT_OK);
  s->context.progress = on_progress;
  s->context.progress_user = s;
  s->dual = (qmat_dual_complex){.context = &s->context,
                                .surface = s->surface,
                                .link_limit = INFINITY,
                                .point_count = 1 + 3 * CELLS,
                                .cells = {.count = CELLS, .corners = s->corners},
                                .kinds = s->kinds,
                                .spheres = s->spheres,
                                .sphere_of = s->sphere_of,
                                .sphere_count = CELLS};
  for (uint32_t i = 0; i < CELLS; i++) {
    const double along = (i % STAR) * 0.002, across = i / STAR * 0.01;
    const double sphere[] = {along + across, across, 0, 0.001};
    const uint32_t of_cell[] = {0, 3 * i + 1, 3 * i + 2, 3 * i + 3};
    memcpy(&s->spheres[4 * (size_t)i], sphere, sizeof sphere);
    memcpy(&s->corners[4 * (size_t)i], of_cell, sizeof of_cell);
    s->sphere_of[i] = i;
    s->kinds[i] = QMAT_CELL_CIRCUMCENTRE;
    if (i % STAR == 0) continue;
    const uint32_t edge[] = {i - 1, i};
    assert_int_equal(
        qmat_grow((void **)&s->dual.edges, &s->dual.edge_capacity, 2 * (s->dual.edge_count + 1), sizeof *s->dual.edges),
        0);
    memcpy(&s->dual.edges[2 * s->dual.edge_count++], edge, sizeof edge);
  }
}

static void free_star(star *s) {
  free_dual(&s->dual);
  qmat_surface_free(s->surface);
  qmat_value_release(&s->mesh->base);
  qmat_context_uninit(&s->context);
}

static void test_components_at_a_sample_are_linked_by_their_nearest_spheres(void **state) {
  (void)state;
  star s;
  make_star(&s, SIZE_MAX);
  qmat_dual_component_counts counts = {0};
  assert_int_equal(qmat_dual_components_join(&s.dual, &counts), QMAT_OK);
  assert_int_equal(counts.components, 1);
  assert_int_equal(counts.links, 2);
  assert_int_equal(s.dual.edge_count, STARS * (STAR - 1) + 2);
  for (size_t n = s.dual.edge_count - 2; n < s.dual.edge_count; n++) {
    const uint32_t a = s.dual.edges[2 * n], b = s.dual.edges[2 * n + 1];
    assert_int_equal(b / STAR - a / STAR, 1);
    assert_int_equal(a % STAR, b % STAR + 5);
  }
  assert_true(s.asked >= STARS * STAR * STAR / 64);
  free_star(&s);
}

static void test_links_between_many_spheres_can_be_cancelled(void **state) {
  (void)state;
  star s;
  make_star(&s, 3);
  qmat_dual_component_counts counts = {0};
  assert_int_equal(qmat_dual_components_join(&s.dual, &counts), QMAT_CANCELLED);
  assert_int_equal(counts.links, 0);
  free_star(&s);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_ring_of_any_length_has_its_polygon),
      cmocka_unit_test(test_a_ring_with_a_gap_has_no_polygon),
      cmocka_unit_test(test_components_at_a_sample_are_linked_by_their_nearest_spheres),
      cmocka_unit_test(test_links_between_many_spheres_can_be_cancelled),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
