/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/medial_complex.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/medial_meshes.h"
#include "tests/random.h"

static void make_complex(qmat_complex *complex, size_t spheres, const uint32_t *edges, size_t edge_count,
                         const uint32_t *triangles, size_t triangle_count) {
  qmat_context context = {0};
  qmat_medial *medial = medial_mesh(NULL, spheres, edges, edge_count, triangles, triangle_count);
  assert_int_equal(qmat_complex_init(&context, complex, medial, NULL), QMAT_OK);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* --- a naive simplicial complex: all pairs and triples ----------------------------------------------------------- */

enum { MOST = 24 };
typedef struct {
  size_t count;
  bool vertex[MOST], edge[MOST][MOST], triangle[MOST][MOST][MOST];
} naive;

static void set_edge(naive *n, size_t a, size_t b, bool value) {
  n->edge[a][b] = n->edge[b][a] = value;
}

static void set_triangle(naive *n, size_t a, size_t b, size_t c, bool value) {
  n->triangle[a][b][c] = n->triangle[a][c][b] = n->triangle[b][a][c] = value;
  n->triangle[b][c][a] = n->triangle[c][a][b] = n->triangle[c][b][a] = value;
}

static void make_naive(naive *n, const qmat_medial *medial) {
  memset(n, 0, sizeof *n);
  n->count = medial->sphere_count;
  for (size_t v = 0; v < n->count; v++) n->vertex[v] = true;
  for (size_t e = 0; e < medial->edge_count; e++) set_edge(n, medial->edges[2 * e], medial->edges[2 * e + 1], true);
  for (size_t t = 0; t < medial->triangle_count; t++) {
    const uint32_t *c = &medial->triangles[3 * t];
    set_triangle(n, c[0], c[1], c[2], true);
  }
}

/* Every simplex with `removed` replaced by `kept`; what degenerates is its own side, which is there already. */
static void naive_collapse(naive *n, size_t kept, size_t removed) {
  for (size_t a = 0; a < n->count; a++)
    for (size_t b = a + 1; b < n->count; b++) {
      if (!n->triangle[removed][a][b]) continue;
      set_triangle(n, removed, a, b, false);
      if (a != kept && b != kept) set_triangle(n, kept, a, b, true);
    }
  for (size_t a = 0; a < n->count; a++) {
    if (!n->edge[removed][a]) continue;
    set_edge(n, removed, a, false);
    if (a != kept) set_edge(n, kept, a, true);
  }
  n->vertex[removed] = false;
}

static size_t row_count_of(const uint32_t *row, size_t count, uint32_t item) {
  size_t times = 0;
  for (size_t i = 0; i < count; i++) times += row[i] == item;
  return times;
}

/* Everything that the complex keeps about itself, against the naive one. */
static void check(const qmat_complex *complex, const naive *n) {
  size_t vertices = 0, edges = 0, triangles = 0, in_rows = 0;
  for (uint32_t v = 0; v < n->count; v++) {
    assert_int_equal(complex->vertex_alive[v], n->vertex[v]);
    vertices += n->vertex[v];
    for (uint32_t w = v + 1; w < n->count; w++) {
      edges += n->edge[v][w];
      for (uint32_t x = w + 1; x < n->count; x++) triangles += n->triangle[v][w][x];
      if (!n->vertex[v] || !n->vertex[w]) continue;
      const uint32_t found = qmat_complex_find_edge(complex, v, w);
      assert_int_equal(found, qmat_complex_find_edge(complex, w, v));
      assert_int_equal(found != QMAT_NONE, n->edge[v][w]);
      if (found == QMAT_NONE) continue;
      assert_true(complex->edge_alive[found]);
      assert_int_equal(qmat_complex_other_end(complex, found, v), w);
      assert_int_equal(qmat_complex_other_end(complex, found, w), v);
    }
  }
  assert_int_equal(complex->live_vertices, vertices);
  assert_int_equal(complex->live_edges, edges);
  assert_int_equal(complex->live_triangles, triangles);
  size_t live = 0;
  for (uint32_t e = 0; e < complex->edge_count; e++) {
    if (!complex->edge_alive[e]) continue;
    live++;
    const uint32_t *ends = &complex->edges[2 * e];
    assert_true(n->edge[ends[0]][ends[1]]);
    uint32_t bounded = 0;
    for (size_t w = 0; w < n->count; w++) bounded += n->triangle[ends[0]][ends[1]][w];
    assert_int_equal(complex->edge_triangles[e], bounded);
    for (int k = 0; k < 2; k++) {
      size_t count;
      const uint32_t *row = qmat_complex_edges_at(complex, ends[k], &count);
      assert_int_equal(row_count_of(row, count, e), 1);
    }
  }
  assert_int_equal(live, edges);
  live = 0;
  for (uint32_t t = 0; t < complex->triangle_count; t++) {
    if (!complex->triangle_alive[t]) continue;
    live++;
    const uint32_t *corners = &complex->triangles[3 * t];
    assert_true(n->triangle[corners[0]][corners[1]][corners[2]]);
    for (size_t k = 0; k < 3; k++) {
      const uint32_t side = complex->triangle_edges[3 * t + k];
      assert_int_equal(side, qmat_complex_find_edge(complex, corners[(k + 1) % 3], corners[(k + 2) % 3]));
      size_t count;
      const uint32_t *row = qmat_complex_triangles_at(complex, corners[k], &count);
      assert_int_equal(row_count_of(row, count, t), 1);
    }
  }
  assert_int_equal(live, triangles);
  /* Nothing else stands in a row. */
  for (uint32_t v = 0; v < n->count; v++) {
    size_t count;
    qmat_complex_edges_at(complex, v, &count);
    in_rows += count;
    qmat_complex_triangles_at(complex, v, &count);
    in_rows += count;
  }
  assert_int_equal(in_rows, 2 * edges + 3 * triangles);
}

/* The live triangle with these corners, or QMAT_NONE. */
static uint32_t find_triangle(const qmat_complex *complex, uint32_t a, uint32_t b, uint32_t c) {
  for (uint32_t t = 0; t < complex->triangle_count; t++) {
    const uint32_t *corners = &complex->triangles[3 * t];
    int found = 0;
    for (int k = 0; k < 3; k++) found += corners[k] == a || corners[k] == b || corners[k] == c;
    if (complex->triangle_alive[t] && found == 3) return t;
  }
  return QMAT_NONE;
}

/* The preview against the naive complex before the collapse. */
static void check_preview(const qmat_complex *complex, const naive *n, uint32_t edge, const qmat_collapse *c) {
  const uint32_t kept = c->kept, removed = c->removed;
  assert_int_equal(c->edge, edge);
  assert_true(kept != removed);
  assert_int_equal(qmat_complex_other_end(complex, edge, kept), removed);
  size_t neighbours = 0, triangles = 0, vanishing = 0;
  for (uint32_t w = 0; w < n->count; w++) {
    if (w == kept || w == removed) continue;
    neighbours += n->edge[kept][w] || n->edge[removed][w];
    vanishing += n->triangle[kept][removed][w];
    for (uint32_t x = w + 1; x < n->count; x++)
      triangles += x != kept && x != removed && (n->triangle[kept][w][x] || n->triangle[removed][w][x]);
  }
  assert_int_equal(c->neighbour_count, neighbours);
  assert_int_equal(c->triangle_count, triangles);
  assert_int_equal(c->vanishing_count, vanishing);
  for (size_t i = 0; i < neighbours; i++) {
    const uint32_t w = c->neighbours[i];
    assert_true(w != kept && w != removed);
    assert_int_equal(row_count_of(c->neighbours, neighbours, w), 1);
    assert_int_equal(c->kept_edges[i], qmat_complex_find_edge(complex, kept, w));
    assert_int_equal(c->removed_edges[i], qmat_complex_find_edge(complex, removed, w));
    assert_true(c->kept_edges[i] != QMAT_NONE || c->removed_edges[i] != QMAT_NONE);
  }
  for (size_t i = 0; i < triangles; i++) {
    const uint32_t *pair = &c->triangle_pairs[2 * i];
    assert_int_equal(c->kept_triangles[i], find_triangle(complex, kept, pair[0], pair[1]));
    assert_int_equal(c->removed_triangles[i], find_triangle(complex, removed, pair[0], pair[1]));
    assert_true(c->kept_triangles[i] != QMAT_NONE || c->removed_triangles[i] != QMAT_NONE);
    for (size_t j = 0; j < i; j++) {
      const uint32_t *other = &c->triangle_pairs[2 * j];
      assert_false((pair[0] == other[0] && pair[1] == other[1]) || (pair[0] == other[1] && pair[1] == other[0]));
    }
  }
  for (size_t i = 0; i < vanishing; i++) {
    const uint32_t *corners = &complex->triangles[3 * (size_t)c->vanishing[i]];
    assert_true(complex->triangle_alive[c->vanishing[i]]);
    assert_int_equal(row_count_of(corners, 3, kept) + row_count_of(corners, 3, removed), 2);
    assert_int_equal(row_count_of(c->vanishing, vanishing, c->vanishing[i]), 1);
  }
}

static void preview_and_collapse(qmat_complex *complex, uint32_t edge, qmat_collapse *collapse) {
  qmat_context context = {0};
  assert_int_not_equal(edge, QMAT_NONE);
  assert_int_equal(qmat_complex_preview(&context, complex, edge, collapse), QMAT_OK);
  const double sphere[4] = {0.5, 0.25, 0.125, 2};
  assert_int_equal(qmat_complex_collapse(&context, complex, collapse, sphere), QMAT_OK);
  assert_memory_equal(&complex->spheres[4 * (size_t)collapse->kept], sphere, sizeof sphere);
  qmat_context_uninit(&context);
}

/* Makes a complex, collapses the edge (a, b), and compares the live counts with those found by hand. */
static void collapse_one(size_t spheres, const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                         size_t triangle_count, uint32_t a, uint32_t b, const size_t before[2], const size_t after[2]) {
  qmat_complex complex;
  qmat_collapse collapse = {0};
  naive n;
  qmat_medial *medial = medial_mesh(NULL, spheres, edges, edge_count, triangles, triangle_count);
  make_naive(&n, medial);
  qmat_value_release(&medial->base);
  make_complex(&complex, spheres, edges, edge_count, triangles, triangle_count);
  assert_int_equal(complex.live_vertices, spheres);
  assert_int_equal(complex.live_edges, before[0]);
  assert_int_equal(complex.live_triangles, before[1]);
  check(&complex, &n);
  preview_and_collapse(&complex, qmat_complex_find_edge(&complex, a, b), &collapse);
  naive_collapse(&n, collapse.kept, collapse.removed);
  check(&complex, &n);
  assert_int_equal(complex.live_vertices, spheres - 1);
  assert_int_equal(complex.live_edges, after[0]);
  assert_int_equal(complex.live_triangles, after[1]);
  qmat_collapse_uninit(&collapse);
  qmat_complex_uninit(&complex);
}

static void test_single_edge_becomes_a_vertex(void **state) {
  (void)state;
  collapse_one(2, (uint32_t[]){0, 1}, 1, NULL, 0, 0, 1, (size_t[]){1, 0}, (size_t[]){0, 0});
}

static void test_triangle_becomes_an_edge(void **state) {
  (void)state;
  collapse_one(3, NULL, 0, (uint32_t[]){0, 1, 2}, 1, 0, 1, (size_t[]){3, 1}, (size_t[]){1, 0});
}

static void test_shared_edge_of_two_triangles_leaves_a_path(void **state) {
  (void)state;
  collapse_one(4, NULL, 0, (uint32_t[]){0, 1, 2, 1, 2, 3}, 2, 1, 2, (size_t[]){5, 2}, (size_t[]){2, 0});
}

static void test_outer_edge_of_two_triangles_leaves_one(void **state) {
  (void)state;
  collapse_one(4, NULL, 0, (uint32_t[]){0, 1, 2, 1, 2, 3}, 2, 0, 1, (size_t[]){5, 2}, (size_t[]){3, 1});
}

static void test_tetrahedron_boundary_folds_into_one_triangle(void **state) {
  (void)state;
  /* Two triangles vanish; the two others come to lie on each other. */
  collapse_one(4, NULL, 0, (uint32_t[]){0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3}, 4, 0, 1, (size_t[]){6, 4},
               (size_t[]){3, 1});
}

static void test_loose_edge_beside_a_triangle_moves_along(void **state) {
  (void)state;
  collapse_one(4, (uint32_t[]){1, 3}, 1, (uint32_t[]){0, 1, 2}, 1, 0, 1, (size_t[]){4, 1}, (size_t[]){2, 0});
}

static void test_loose_edge_collapses_into_the_triangle_at_its_end(void **state) {
  (void)state;
  collapse_one(4, (uint32_t[]){2, 3}, 1, (uint32_t[]){0, 1, 2}, 1, 2, 3, (size_t[]){4, 1}, (size_t[]){3, 1});
}

static void test_loose_edge_merges_with_the_side_of_a_triangle(void **state) {
  (void)state;
  /* 0-3 is loose and 3-1 too: when 3 falls on 0, its edge to 1 falls on the triangle's side. */
  collapse_one(4, (uint32_t[]){0, 3, 1, 3}, 2, (uint32_t[]){0, 1, 2}, 1, 0, 3, (size_t[]){5, 1}, (size_t[]){3, 1});
}

static void test_triangles_that_come_to_lie_on_each_other_become_one(void **state) {
  (void)state;
  /* (0, 2, 3) and (1, 2, 3) share a side; 0-1 is a loose edge that closes no triangle. */
  collapse_one(4, (uint32_t[]){0, 1}, 1, (uint32_t[]){0, 2, 3, 1, 2, 3}, 2, 0, 1, (size_t[]){6, 2}, (size_t[]){3, 1});
}

static void test_three_triangles_at_one_edge_leave_a_star(void **state) {
  (void)state;
  collapse_one(5, NULL, 0, (uint32_t[]){0, 1, 2, 0, 1, 3, 0, 1, 4}, 3, 0, 1, (size_t[]){7, 3}, (size_t[]){3, 0});
}

static void test_ring_shrinks_to_a_triangle_that_is_not_filled(void **state) {
  (void)state;
  collapse_one(4, (uint32_t[]){0, 1, 1, 2, 2, 3, 3, 0}, 4, NULL, 0, 0, 1, (size_t[]){4, 0}, (size_t[]){3, 0});
}

static void test_edge_lives_on_at_the_kept_end(void **state) {
  (void)state;
  qmat_complex complex;
  qmat_collapse collapse = {0};
  make_complex(&complex, 3, NULL, 0, (uint32_t[]){0, 1, 2}, 1);
  const uint32_t edge = qmat_complex_find_edge(&complex, 0, 1);
  qmat_context context = {0};
  assert_int_equal(qmat_complex_preview(&context, &complex, edge, &collapse), QMAT_OK);
  const uint32_t survivor = collapse.kept_edges[0], gone = collapse.removed_edges[0];
  assert_int_equal(survivor, qmat_complex_find_edge(&complex, collapse.kept, 2));
  preview_and_collapse(&complex, edge, &collapse);
  assert_int_equal(qmat_complex_find_edge(&complex, collapse.kept, 2), survivor);
  assert_true(complex.edge_alive[survivor]);
  assert_false(complex.edge_alive[gone]);
  assert_false(complex.edge_alive[edge]);
  qmat_collapse_uninit(&collapse);
  qmat_complex_uninit(&complex);
}

static void test_spheres_come_from_the_caller_where_given(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_complex complex;
  qmat_medial *medial = medial_mesh(NULL, 2, (uint32_t[]){0, 1}, 1, NULL, 0);
  const double spheres[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  assert_int_equal(qmat_complex_init(&context, &complex, medial, spheres), QMAT_OK);
  assert_memory_equal(complex.spheres, spheres, sizeof spheres);
  qmat_complex_uninit(&complex);
  assert_int_equal(qmat_complex_init(&context, &complex, medial, NULL), QMAT_OK);
  assert_memory_equal(complex.spheres, medial->spheres, sizeof spheres);
  qmat_complex_uninit(&complex);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void test_nothing_and_isolated_spheres_are_complexes_too(void **state) {
  (void)state;
  qmat_complex complex;
  naive n = {.count = 0};
  make_complex(&complex, 0, NULL, 0, NULL, 0);
  check(&complex, &n);
  qmat_complex_uninit(&complex);
  qmat_medial *medial = medial_mesh(NULL, 5, NULL, 0, NULL, 0);
  make_naive(&n, medial);
  qmat_value_release(&medial->base);
  make_complex(&complex, 5, NULL, 0, NULL, 0);
  check(&complex, &n);
  qmat_complex_uninit(&complex);
}

static void test_medial_mesh_without_a_side_of_a_triangle_is_named(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_complex complex;
  qmat_medial *medial = medial_mesh(NULL, 4, NULL, 0, (uint32_t[]){0, 1, 2, 1, 2, 3}, 2);
  medial->edge_count--; /* 2-3, the last */
  assert_int_equal(qmat_complex_init(&context, &complex, medial, NULL), QMAT_ERROR_INTERNAL);
  assert_string_equal(context.error.element_kind, "triangle");
  assert_int_equal(context.error.element, 1);
  qmat_complex_uninit(&complex);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* --- random complexes --------------------------------------------------------------------------------------------- */

/* Random triangles and edges; every kind from sparse to dense comes up. */
static qmat_medial *random_medial(random_numbers *random) {
  uint32_t edges[2 * 60], triangles[3 * 120];
  const size_t spheres = 2 + random_index(random, MOST - 1);
  const size_t edge_count = random_index(random, 60), triangle_count = spheres < 3 ? 0 : random_index(random, 120);
  for (size_t i = 0; i < 2 * edge_count; i += 2) {
    edges[i] = (uint32_t)random_index(random, spheres);
    edges[i + 1] = (uint32_t)((edges[i] + 1 + random_index(random, spheres - 1)) % spheres);
  }
  for (size_t i = 0; i < 3 * triangle_count; i++) triangles[i] = (uint32_t)random_index(random, spheres);
  return medial_mesh(NULL, spheres, edges, edge_count, triangles, triangle_count); /* drops what degenerates */
}

/* What a preview must leave alone, as one number. */
static uint64_t fingerprint(const qmat_complex *c) {
  uint64_t h = qmat_hash3(c->live_vertices, c->live_edges, c->live_triangles);
  for (size_t i = 0; i < 2 * c->edge_count; i++) h = qmat_hash3(h, c->edges[i], c->edge_alive[i / 2]);
  for (size_t i = 0; i < c->edge_count; i++) h = qmat_hash3(h, c->edge_triangles[i], 0);
  for (size_t i = 0; i < 3 * c->triangle_count; i++)
    h = qmat_hash3(h, c->triangles[i], c->triangle_edges[i] + c->triangle_alive[i / 3]);
  for (size_t v = 0; v < c->vertex_count; v++) {
    size_t count;
    const uint32_t *row = qmat_complex_edges_at(c, (uint32_t)v, &count);
    for (size_t i = 0; i < count; i++) h = qmat_hash3(h, row[i], 1);
    row = qmat_complex_triangles_at(c, (uint32_t)v, &count);
    for (size_t i = 0; i < count; i++) h = qmat_hash3(h, row[i], 2);
  }
  return h;
}

static uint32_t random_live_edge(random_numbers *random, const qmat_complex *complex) {
  size_t chosen = random_index(random, complex->live_edges);
  for (uint32_t e = 0; e < complex->edge_count; e++)
    if (complex->edge_alive[e] && chosen-- == 0) return e;
  return QMAT_NONE;
}

static void test_random_collapses_follow_the_naive_complex(void **state) {
  (void)state;
  random_numbers random = {.seed = 1};
  qmat_collapse collapse = {0};
  size_t collapses = 0, merged_triangles = 0, vanished = 0, merged_edges = 0;
  for (int round = 0; round < 120; round++) {
    static naive n;
    qmat_context context = {0};
    qmat_complex complex;
    qmat_medial *medial = random_medial(&random);
    make_naive(&n, medial);
    assert_int_equal(qmat_complex_init(&context, &complex, medial, NULL), QMAT_OK);
    qmat_value_release(&medial->base);
    check(&complex, &n);
    while (complex.live_edges > 0) {
      /* Looks at some edges first, as the simplification does; only the newest counts. */
      uint32_t edge = 0;
      const uint64_t before = fingerprint(&complex);
      for (size_t looks = 1 + random_index(&random, 3); looks > 0; looks--) {
        edge = random_live_edge(&random, &complex);
        assert_int_equal(qmat_complex_preview(&context, &complex, edge, &collapse), QMAT_OK);
        check_preview(&complex, &n, edge, &collapse);
      }
      assert_true(fingerprint(&complex) == before);
      vanished += collapse.vanishing_count;
      for (size_t i = 0; i < collapse.triangle_count; i++)
        merged_triangles += collapse.kept_triangles[i] != QMAT_NONE && collapse.removed_triangles[i] != QMAT_NONE;
      for (size_t i = 0; i < collapse.neighbour_count; i++)
        merged_edges += collapse.kept_edges[i] != QMAT_NONE && collapse.removed_edges[i] != QMAT_NONE;
      const double sphere[4] = {1, 2, 3, 4};
      assert_int_equal(qmat_complex_collapse(&context, &complex, &collapse, sphere), QMAT_OK);
      naive_collapse(&n, collapse.kept, collapse.removed);
      check(&complex, &n);
      collapses++;
    }
    qmat_complex_uninit(&complex);
    qmat_context_uninit(&context);
  }
  qmat_collapse_uninit(&collapse);
  assert_true(collapses > 500 && vanished > 500 && merged_triangles > 500 && merged_edges > 500);
}

static void test_marks_of_old_previews_do_not_come_alive_again(void **state) {
  (void)state;
  random_numbers random = {.seed = 2};
  static naive n;
  qmat_context context = {0};
  qmat_complex complex;
  qmat_collapse collapse = {0};
  qmat_medial *medial;
  do {
    medial = random_medial(&random);
    if (medial->triangle_count > 40) break;
    qmat_value_release(&medial->base);
  } while (true);
  make_naive(&n, medial);
  assert_int_equal(qmat_complex_init(&context, &complex, medial, NULL), QMAT_OK);
  for (uint32_t edge = 0; edge < 5; edge++) /* leaves marks 1 to 5 */
    assert_int_equal(qmat_complex_preview(&context, &complex, edge, &collapse), QMAT_OK);
  complex.stamp = UINT32_MAX - 2;
  for (uint32_t edge = 0; edge < complex.edge_count; edge++) {
    assert_int_equal(qmat_complex_preview(&context, &complex, edge, &collapse), QMAT_OK);
    check_preview(&complex, &n, edge, &collapse);
  }
  qmat_collapse_uninit(&collapse);
  qmat_complex_uninit(&complex);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_single_edge_becomes_a_vertex),
      cmocka_unit_test(test_triangle_becomes_an_edge),
      cmocka_unit_test(test_shared_edge_of_two_triangles_leaves_a_path),
      cmocka_unit_test(test_outer_edge_of_two_triangles_leaves_one),
      cmocka_unit_test(test_tetrahedron_boundary_folds_into_one_triangle),
      cmocka_unit_test(test_loose_edge_beside_a_triangle_moves_along),
      cmocka_unit_test(test_loose_edge_collapses_into_the_triangle_at_its_end),
      cmocka_unit_test(test_loose_edge_merges_with_the_side_of_a_triangle),
      cmocka_unit_test(test_triangles_that_come_to_lie_on_each_other_become_one),
      cmocka_unit_test(test_three_triangles_at_one_edge_leave_a_star),
      cmocka_unit_test(test_ring_shrinks_to_a_triangle_that_is_not_filled),
      cmocka_unit_test(test_edge_lives_on_at_the_kept_end),
      cmocka_unit_test(test_spheres_come_from_the_caller_where_given),
      cmocka_unit_test(test_nothing_and_isolated_spheres_are_complexes_too),
      cmocka_unit_test(test_medial_mesh_without_a_side_of_a_triangle_is_named),
      cmocka_unit_test(test_random_collapses_follow_the_naive_complex),
      cmocka_unit_test(test_marks_of_old_previews_do_not_come_alive_again),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
