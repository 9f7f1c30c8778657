/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/topology.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "nodes/simplify/topology_searches.h"
#include "tests/medial_meshes.h"
#include "tests/nodes/pipeline.h"
#include "tests/random.h"

/* ---- medial meshes ---- */

static qmat_topology topology_of(const qmat_medial *medial) {
  qmat_context context = {0};
  qmat_topology t;
  assert_int_equal(qmat_topology_of_medial(&context, medial, &t), QMAT_OK);
  qmat_context_uninit(&context);
  return t;
}

#define COUNT(array) (sizeof(array) / sizeof *(array))

static void check_complex(size_t count, const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                          size_t triangle_count, size_t components, size_t loops, size_t voids) {
  qmat_medial *medial = sealed_medial_mesh(NULL, count, edges, edge_count, triangles, triangle_count);
  const qmat_topology t = topology_of(medial);
  assert_true(t.known);
  assert_int_equal(t.components, components);
  assert_int_equal(t.loops, loops);
  assert_int_equal(t.voids, voids);
  assert_int_equal(t.euler, pipeline_euler(medial));
  qmat_value_release(&medial->base);
}

static void test_small_complexes_by_hand(void **state) {
  (void)state;
  check_complex(1, NULL, 0, NULL, 0, 1, 0, 0);
  static const uint32_t ring[] = {0, 1, 1, 2, 0, 2};
  check_complex(5, ring, 3, NULL, 0, 3, 1, 0);
  static const uint32_t slab[] = {0, 1, 2};
  check_complex(3, ring, 3, slab, 1, 1, 0, 0);
  static const uint32_t cavity[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3};
  check_complex(4, NULL, 0, cavity, 4, 1, 0, 1);
  check_complex(4, NULL, 0, cavity, 3, 1, 0, 0); /* one side open */
  static const uint32_t fan[] = {0, 1, 2, 0, 1, 3, 0, 1, 4};
  check_complex(5, NULL, 0, fan, 3, 1, 0, 0);
}

/* A cavity tetrahedron with a strip of two slabs at one of its sides: the strip is none of its walls. */
static void test_walls_of_a_void_by_hand(void **state) {
  (void)state;
  static const uint32_t triangles[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3, 2, 3, 4, 3, 4, 5};
  qmat_medial *medial = sealed_medial_mesh(NULL, 6, NULL, 0, triangles, 6);
  qmat_context context = {0};
  uint32_t *walls;
  size_t count;
  assert_int_equal(qmat_topology_find_walls(&context, medial, &walls, &count), QMAT_OK);
  assert_int_equal(count, 4);
  for (size_t i = 0; i < 4; i++) assert_true(medial->triangles[3 * walls[i] + 2] <= 3);
  qmat_value_release(&medial->base);
  medial = sealed_medial_mesh(NULL, 4, NULL, 0, triangles, 3); /* open: nothing is left */
  assert_int_equal(qmat_topology_find_walls(&context, medial, &walls, &count), QMAT_OK);
  assert_int_equal(count, 0);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_empty_triangles_by_hand(void **state) {
  (void)state;
  /* Of a tetrahedron's four triangles two are there, the third sphere has a loop of its own, and a square has none. */
  static const uint32_t edges[] = {2, 3, 3, 4, 2, 4, 4, 5, 5, 6, 6, 7, 4, 7, 0, 3};
  static const uint32_t triangles[] = {0, 1, 2, 1, 2, 3};
  qmat_medial *medial = sealed_medial_mesh(NULL, 8, edges, COUNT(edges) / 2, triangles, 2);
  qmat_context context = {0};
  uint32_t *corners;
  size_t count;
  assert_int_equal(qmat_topology_find_empty_triangles(&context, medial, &corners, &count), QMAT_OK);
  assert_int_equal(count, 3);
  static const uint32_t expected[] = {0, 1, 3, 0, 2, 3, 2, 3, 4};
  assert_memory_equal(corners, expected, sizeof expected);
  qmat_value_release(&medial->base);
  static const uint32_t ring[] = {0, 1, 1, 2, 2, 3, 0, 3};
  medial = sealed_medial_mesh(NULL, 4, ring, 4, NULL, 0);
  assert_int_equal(qmat_topology_find_empty_triangles(&context, medial, &corners, &count), QMAT_OK);
  assert_int_equal(count, 0);
  qmat_value_release(&medial->base);
  medial = sealed_medial_mesh(NULL, 1, NULL, 0, NULL, 0);
  assert_int_equal(qmat_topology_find_empty_triangles(&context, medial, &corners, &count), QMAT_OK);
  assert_int_equal(count, 0);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* Against the components without each edge. The spheres are at their numbers on a line. */
static void test_loop_edges_of_random_complexes_leave_the_components(void **state) {
  (void)state;
  enum { SPHERES = 14, EDGES = 15, TRIANGLES = 3 };
  random_numbers random = {.seed = 7};
  size_t found = 0;
  for (int round = 0; round < 200; round++) {
    uint32_t edges[2 * EDGES], triangles[3 * TRIANGLES];
    for (size_t i = 0; i < COUNT(edges); i++) edges[i] = (uint32_t)random_index(&random, SPHERES);
    for (size_t i = 0; i < COUNT(triangles); i++) triangles[i] = (uint32_t)random_index(&random, SPHERES);
    qmat_medial *medial = sealed_medial_mesh(NULL, SPHERES, edges, EDGES, triangles, TRIANGLES);
    const size_t components = topology_of(medial).components;
    qmat_context context = {0};
    uint32_t *loop_edges, before = 0;
    size_t count, expected = 0;
    assert_int_equal(qmat_topology_find_loop_edges(&context, medial, &loop_edges, &count), QMAT_OK);
    for (uint32_t e = 0; e < medial->edge_count; e++) {
      const uint32_t *row = &medial->edges[2 * (size_t)e];
      bool in_triangle = false, in_list = false;
      for (size_t t = 0; t < medial->triangle_count; t++) {
        int shared = 0;
        for (size_t k = 0; k < 3; k++)
          shared += medial->triangles[3 * t + k] == row[0] || medial->triangles[3 * t + k] == row[1];
        in_triangle |= shared == 2;
      }
      uint32_t rest[2 * (EDGES + 3 * TRIANGLES)];
      memcpy(rest, medial->edges, 2 * e * sizeof *rest);
      memcpy(rest + 2 * e, row + 2, 2 * (medial->edge_count - e - 1) * sizeof *rest);
      qmat_medial *without =
          sealed_medial_mesh(NULL, SPHERES, rest, medial->edge_count - 1, medial->triangles, medial->triangle_count);
      const bool is_loop_edge = !in_triangle && topology_of(without).components == components;
      for (size_t i = 0; i < count; i++) in_list |= loop_edges[i] == e;
      assert_int_equal(in_list, is_loop_edge);
      expected += is_loop_edge;
      qmat_value_release(&without->base);
    }
    assert_int_equal(count, expected);
    for (size_t i = 0; i < count; i++) { /* the shortest first */
      const uint32_t *row = &medial->edges[2 * (size_t)loop_edges[i]];
      assert_true(row[1] - row[0] >= before);
      before = row[1] - row[0];
    }
    found += count;
    qmat_value_release(&medial->base);
    qmat_context_uninit(&context);
  }
  assert_true(found > 200);
}

static void test_cavities_that_share_a_side_are_two(void **state) {
  (void)state;
  /* Tetrahedra over and under the triangle 0 1 2: their edges in common lie on three triangles. */
  static const uint32_t two[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3, 0, 1, 4, 0, 2, 4, 1, 2, 4};
  check_complex(5, NULL, 0, two, 7, 1, 0, 2);
  check_complex(5, NULL, 0, two + 3, 6, 1, 0, 1); /* without the wall between them */
  /* With a flap on the edge from top to bottom, which closes a ring around the edge of the wall. */
  static const uint32_t flag[] = {0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3, 0, 1, 4, 0, 2, 4, 1, 2, 4, 3, 4, 5};
  check_complex(6, NULL, 0, flag, 8, 1, 1, 2);
}

static void test_surfaces_without_a_side_are_told_over_z2(void **state) {
  (void)state;
  /* Moebius' torus of seven vertices, and the projective plane of six. */
  uint32_t torus[42];
  for (uint32_t i = 0; i < 7; i++) {
    const uint32_t rows[6] = {i, (i + 1) % 7, (i + 3) % 7, i, (i + 2) % 7, (i + 3) % 7};
    memcpy(torus + 6 * i, rows, sizeof rows);
  }
  check_complex(7, NULL, 0, torus, 14, 1, 2, 1);
  static const uint32_t plane[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5, 0, 1, 5,
                                   1, 2, 4, 2, 4, 5, 2, 3, 5, 1, 3, 5, 1, 3, 4};
  check_complex(6, NULL, 0, plane, 10, 1, 1, 1);
  static const uint32_t strip[] = {0, 1, 2, 1, 2, 3, 2, 3, 4, 0, 3, 4, 0, 1, 4};
  check_complex(5, NULL, 0, strip, 5, 1, 1, 0);
}

/* The rank over Z/2 of the edges' rows over the triangles, by elimination in full. */
static size_t rank_in_full(const qmat_medial *m) {
  enum { MOST = 64 };
  uint64_t rows[1024];
  size_t rank = 0;
  assert_true(m->triangle_count <= MOST && m->edge_count <= COUNT(rows));
  for (size_t e = 0; e < m->edge_count; e++) {
    rows[e] = 0;
    for (size_t t = 0; t < m->triangle_count; t++) {
      int ends = 0;
      for (size_t k = 0; k < 3; k++)
        ends += m->triangles[3 * t + k] == m->edges[2 * e] || m->triangles[3 * t + k] == m->edges[2 * e + 1];
      if (ends == 2) rows[e] |= UINT64_C(1) << t;
    }
  }
  for (size_t bit = 0; bit < m->triangle_count; bit++) {
    size_t pivot = rank;
    while (pivot < m->edge_count && !(rows[pivot] >> bit & 1)) pivot++;
    if (pivot == m->edge_count) continue;
    const uint64_t swap = rows[pivot];
    rows[pivot] = rows[rank];
    rows[rank] = swap;
    for (size_t e = 0; e < m->edge_count; e++)
      if (e != rank && (rows[e] >> bit & 1)) rows[e] ^= rows[rank];
    rank++;
  }
  return rank;
}

static void test_random_complexes_have_the_rank_of_full_elimination(void **state) {
  (void)state;
  random_numbers random = {.seed = 1};
  size_t with_voids = 0;
  for (int round = 0; round < 300; round++) {
    const size_t points = 4 + random_index(&random, 6), rows = 1 + random_index(&random, 60);
    uint32_t triangles[180], edges[8];
    for (size_t i = 0; i < 3 * rows; i++) triangles[i] = (uint32_t)random_index(&random, points);
    for (size_t i = 0; i < COUNT(edges); i++) edges[i] = (uint32_t)random_index(&random, points);
    qmat_medial *medial = sealed_medial_mesh(NULL, points, edges, COUNT(edges) / 2, triangles, rows);
    const qmat_topology t = topology_of(medial);
    assert_true(t.known);
    assert_int_equal(t.voids, medial->triangle_count - rank_in_full(medial));
    assert_int_equal(t.components, pipeline_components(medial));
    assert_int_equal((long)t.components - (long)t.loops + (long)t.voids, pipeline_euler(medial));
    with_voids += t.voids > 1;
    qmat_value_release(&medial->base);
  }
  assert_true(with_voids > 50);
}

static void test_a_large_sheet_with_flaps_is_done_at_once(void **state) {
  (void)state;
  /* A torus of n x n squares, each edge of one direction with a flap: every such edge lies on three triangles. */
  enum { N = 150 };
  uint32_t *triangles = malloc(3 * 3 * N * N * sizeof *triangles);
  assert_non_null(triangles);
  size_t count = 0;
  for (uint32_t i = 0; i < N; i++)
    for (uint32_t j = 0; j < N; j++) {
      const uint32_t a = i * N + j, b = (i + 1) % N * N + j, c = (i + 1) % N * N + (j + 1) % N, d = i * N + (j + 1) % N;
      const uint32_t rows[9] = {a, b, c, a, c, d, a, b, N * N + a};
      memcpy(triangles + 3 * count, rows, sizeof rows);
      count += 3;
    }
  check_complex(2 * N * N, NULL, 0, triangles, count, 1, 2, 1);
  free(triangles);
}

/* ---- solids ---- */

/* Takes the mesh over. */
static qmat_topology solid_of(qmat_mesh *mesh) {
  qmat_context context = {0};
  qmat_surface *surface;
  qmat_topology t;
  shape_seal(mesh);
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  assert_int_equal(qmat_topology_of_solid(&context, surface, &t), QMAT_OK);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
  return t;
}

static void check_solid(qmat_mesh *mesh, size_t components, size_t loops, size_t voids) {
  const qmat_topology t = solid_of(mesh);
  assert_true(t.known);
  assert_int_equal(t.components, components);
  assert_int_equal(t.loops, loops);
  assert_int_equal(t.voids, voids);
  assert_int_equal(t.euler, (int64_t)components - (int64_t)loops + (int64_t)voids);
}

static void test_solids_by_hand(void **state) {
  (void)state;
  check_solid(shape_box(1, 2, 3), 1, 0, 0);
  check_solid(shape_l(), 1, 0, 0);
  check_solid(shape_torus(3, 1, 12, 8), 1, 1, 0);
  qmat_mesh *mesh = shape_box(4, 4, 4);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, true);
  shape_add_box(mesh, 9, 9, 9, 10, 10, 10, false);
  check_solid(mesh, 2, 0, 1);
  mesh = shape_torus(3, 1, 12, 8); /* a box in the hole, and one within the tube */
  shape_add_box(mesh, -0.5, -0.5, -0.5, 0.5, 0.5, 0.5, false);
  shape_add_box(mesh, 2.8, -0.1, -0.1, 3.2, 0.1, 0.1, false);
  check_solid(mesh, 2, 1, 0);
}

static void test_an_island_in_a_void_is_a_component(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(4, 4, 4);
  shape_add_box(mesh, 1, 1, 1, 3, 3, 3, true);
  shape_add_box(mesh, 1.5, 1.5, 1.5, 2.5, 2.5, 2.5, false);
  check_solid(mesh, 2, 0, 1);
}

static void test_boxes_that_meet_in_a_corner_are_apart(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, false);
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
    if (mesh->triangles[i] == 8) mesh->triangles[i] = 7; /* both are (1, 1, 1) */
  check_solid(mesh, 2, 0, 0);
}

static void test_nothing_is_said_of_open_and_branching_surfaces(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  mesh->triangle_count--;
  qmat_topology t = solid_of(mesh);
  assert_false(t.known);
  assert_string_equal(t.why_not, "the surface is open");
  mesh = shape_box(1, 1, 1); /* two boxes with an edge in common: four triangles at it */
  shape_add_box(mesh, 1, 1, 0, 2, 2, 1, false);
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    if (mesh->triangles[i] == 8) mesh->triangles[i] = 3;
    if (mesh->triangles[i] == 12) mesh->triangles[i] = 7;
  }
  t = solid_of(mesh);
  assert_false(t.known);
  assert_non_null(strstr(t.why_not, "more than two triangles"));
}

/* A thin box and a thin ring, taken for sheets, have no void; a box with volume has one. */
static void test_flat_shells_of_sheets_enclose_no_void(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1e-6);
  mesh->sheet_triangle_count = mesh->triangle_count;
  mesh->sheet_thickness = 1e-3;
  check_solid(mesh, 1, 0, 0);
  mesh = shape_torus(3, 1, 12, 8);
  for (size_t v = 0; v < mesh->vertex_count; v++) mesh->positions[3 * v + 2] *= 1e-7;
  mesh->sheet_triangle_count = mesh->triangle_count;
  mesh->sheet_thickness = 1e-3;
  check_solid(mesh, 1, 1, 0);
  mesh = shape_box(1, 1, 1);
  mesh->sheet_triangle_count = mesh->triangle_count;
  mesh->sheet_thickness = 1e-3;
  check_solid(mesh, 1, 0, 1);
}

/* The thin box encloses no void, whatever lies beside it; the box with volume keeps its own. */
static void test_flat_shells_beside_open_sheets_enclose_no_void(void **state) {
  (void)state;
  for (int flaps = 0; flaps < 2; flaps++) {
    qmat_mesh *mesh = shape_box(1, 1, 1e-6);
    shape_add_box(mesh, 2, 0, 0, 3, 1, 1, false);
    const uint32_t a = shape_vertex(mesh, 4, 0, 0), b = shape_vertex(mesh, 5, 0, 0), c = shape_vertex(mesh, 5, 1, 0);
    shape_triangle(mesh, a, b, c);
    mesh->sheet_triangle_count = mesh->triangle_count;
    mesh->flap_triangle_count = (size_t)flaps;
    mesh->sheet_thickness = 1e-3;
    check_solid(mesh, flaps ? 2 : 3, 0, 1);
  }
}

/* A thin ring without one of its triangles is open: it has the two loops of its surface, and bounds no solid. */
static void test_open_sheets_are_no_thin_solids(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_torus(3, 1, 12, 8);
  for (size_t v = 0; v < mesh->vertex_count; v++) mesh->positions[3 * v + 2] *= 1e-7;
  mesh->triangle_count--;
  shape_add_box(mesh, 5, 0, -0.5, 6, 1, 0.5, false);
  mesh->sheet_triangle_count = mesh->triangle_count;
  mesh->sheet_thickness = 1e-3;
  check_solid(mesh, 2, 2, 1);
}

/* ---- cancels ---- */

/* Cancels at the first report in one unit. */
typedef struct canceller {
  qmat_context context;
  const char *unit;
  size_t reports;
} canceller;

static bool cancel_at_unit(void *user, const char *id, const char *type, uint64_t done, uint64_t total,
                           const char *unit) {
  canceller *c = user;
  (void)id, (void)type, (void)done, (void)total;
  c->context.progress_time = 0; /* each report comes here */
  c->reports += strcmp(unit, c->unit) == 0;
  return c->reports == 0;
}

static void must_stop(const qmat_medial *medial, const qmat_surface *surface, const char *unit) {
  canceller c = {.unit = unit};
  c.context.progress = cancel_at_unit;
  c.context.progress_user = &c;
  qmat_topology t;
  assert_int_equal(
      medial ? qmat_topology_of_medial(&c.context, medial, &t) : qmat_topology_of_solid(&c.context, surface, &t),
      QMAT_CANCELLED);
  assert_int_equal(c.reports, 1);
  qmat_context_uninit(&c.context);
}

static void test_long_loops_over_a_solid_obey_a_cancel(void **state) {
  (void)state;
  enum { BOXES = 6000 }; /* 72,000 triangles */
  qmat_context context = {0};
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < BOXES; i++)
    shape_add_box(mesh, 2 * (i % 20), 2 * (i / 20 % 20), 2 * (i / 400), 2 * (i % 20) + 1, 2 * (i / 20 % 20) + 1,
                  2 * (i / 400) + 1, false);
  mesh = shape_seal(mesh);
  qmat_surface *surface;
  assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
  must_stop(NULL, surface, "edges");
  must_stop(NULL, surface, "triangles");
  must_stop(NULL, surface, "triangles of shells");
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
  qmat_context_uninit(&context);
}

static void test_long_loops_over_a_medial_mesh_obey_a_cancel(void **state) {
  (void)state;
  enum { STRIP = 1 << 16, CELLS = 12, ROW = CELLS + 1, POINTS = ROW * ROW * ROW };
  uint32_t *rows = test_malloc(3 * STRIP * sizeof *rows);
  for (uint32_t t = 0; t < STRIP; t++)
    for (uint32_t k = 0; k < 3; k++) rows[3 * t + k] = t + k;
  qmat_medial *medial = sealed_medial_mesh(NULL, STRIP + 2, NULL, 0, rows, STRIP);
  must_stop(medial, NULL, "triangles at free edges");
  qmat_value_release(&medial->base);
  /* The sides of the cells of a grid. */
  static const uint32_t steps[] = {1, ROW, ROW * ROW};
  size_t count = 0;
  for (uint32_t p = 0; p < POINTS; p++)
    for (int k = 0; k < 3; k++) {
      const uint32_t u = steps[k], v = steps[(k + 1) % 3];
      if (p / u % ROW == CELLS || p / v % ROW == CELLS) continue;
      const uint32_t square[] = {p, p + u, p + u + v, p, p + v, p + u + v};
      memcpy(&rows[3 * count], square, sizeof square);
      count += 2;
    }
  medial = sealed_medial_mesh(NULL, POINTS, NULL, 0, rows, count);
  assert_int_equal(topology_of(medial).voids, CELLS * CELLS * CELLS);
  must_stop(medial, NULL, "entries of voids");
  qmat_value_release(&medial->base);
  test_free(rows);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_small_complexes_by_hand),
      cmocka_unit_test(test_walls_of_a_void_by_hand),
      cmocka_unit_test(test_empty_triangles_by_hand),
      cmocka_unit_test(test_loop_edges_of_random_complexes_leave_the_components),
      cmocka_unit_test(test_cavities_that_share_a_side_are_two),
      cmocka_unit_test(test_surfaces_without_a_side_are_told_over_z2),
      cmocka_unit_test(test_random_complexes_have_the_rank_of_full_elimination),
      cmocka_unit_test(test_a_large_sheet_with_flaps_is_done_at_once),
      cmocka_unit_test(test_solids_by_hand),
      cmocka_unit_test(test_an_island_in_a_void_is_a_component),
      cmocka_unit_test(test_boxes_that_meet_in_a_corner_are_apart),
      cmocka_unit_test(test_nothing_is_said_of_open_and_branching_surfaces),
      cmocka_unit_test(test_flat_shells_of_sheets_enclose_no_void),
      cmocka_unit_test(test_flat_shells_beside_open_sheets_enclose_no_void),
      cmocka_unit_test(test_open_sheets_are_no_thin_solids),
      cmocka_unit_test(test_long_loops_over_a_solid_obey_a_cancel),
      cmocka_unit_test(test_long_loops_over_a_medial_mesh_obey_a_cancel),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
