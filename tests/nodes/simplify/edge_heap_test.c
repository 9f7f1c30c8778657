/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/edge_heap.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/hash.h"

enum { EDGES = 200, VERTICES = 60, TURNS = 4000 };

/* A heap of few different costs and errors, and what is in it. */
typedef struct heap {
  qmat_context context;
  uint32_t ends[2 * EDGES];
  qmat_complex complex;
  qmat_edge_heap edges;
  uint64_t draws;
} heap;

/* The next of a series of numbers below `limit`. */
static uint32_t draw(heap *h, uint32_t limit) {
  return (uint32_t)(qmat_hash3(7, h->draws++, 0) % limit);
}

static void set_cost(heap *h, uint32_t edge) {
  h->edges.costs[edge] = draw(h, 3);
  h->edges.errors[edge] = draw(h, 2);
}

static void make_heap(heap *h) {
  *h = (heap){0};
  for (size_t i = 0; i < 2 * EDGES; i++) h->ends[i] = draw(h, VERTICES);
  h->complex = (qmat_complex){.vertex_count = VERTICES, .edge_count = EDGES, .edges = h->ends};
  assert_int_equal(qmat_edge_heap_init(&h->context, &h->edges, &h->complex), QMAT_OK);
  for (uint32_t e = 0; e < EDGES; e++) set_cost(h, e);
}

/* The first edge by cost, error and number, found by looking at each. */
static uint32_t first_of(const heap *h) {
  uint32_t first = QMAT_NONE;
  for (uint32_t e = 0; e < EDGES; e++) {
    if (h->edges.places[e] == QMAT_NONE) continue;
    const double cost = h->edges.costs[e], error = h->edges.errors[e];
    if (first == QMAT_NONE || cost < h->edges.costs[first] ||
        (cost == h->edges.costs[first] && error < h->edges.errors[first]))
      first = e;
  }
  return first;
}

static void test_edges_come_by_cost_error_and_number(void **state) {
  (void)state;
  heap h;
  make_heap(&h);
  qmat_edge_heap_fill(&h.edges, NULL);
  assert_int_equal(h.edges.count, EDGES);
  for (size_t i = 0; i < EDGES; i++) {
    const uint32_t first = qmat_edge_heap_first(&h.edges);
    assert_int_equal(first, first_of(&h));
    qmat_edge_heap_remove(&h.edges, first);
    qmat_edge_heap_remove(&h.edges, first); /* once more changes nothing */
  }
  assert_int_equal(h.edges.count, 0);
  qmat_context_uninit(&h.context);
}

/* Collapses rename the ends of edges that are in the heap. Edges are tried ahead, and put back. */
static void test_neither_new_ends_nor_what_was_put_back_changes_the_order(void **state) {
  (void)state;
  heap h;
  make_heap(&h);
  qmat_edge_heap_fill(&h.edges, NULL);
  for (size_t turn = 0; turn < TURNS; turn++) {
    h.ends[draw(&h, 2 * EDGES)] = draw(&h, VERTICES);
    const uint32_t edge = draw(&h, EDGES);
    switch (draw(&h, 3)) {
      case 0:
        qmat_edge_heap_remove(&h.edges, edge);
        break;
      case 1:
        set_cost(&h, edge);
        qmat_edge_heap_update(&h.edges, edge);
        break;
      default: /* the cost as it is */
        qmat_edge_heap_update(&h.edges, edge);
    }
    if (h.edges.count > 0) assert_int_equal(qmat_edge_heap_first(&h.edges), first_of(&h));
  }
  qmat_context_uninit(&h.context);
}

static void test_edges_at_locked_vertices_are_left_out(void **state) {
  (void)state;
  heap h;
  make_heap(&h);
  uint8_t locked[VERTICES] = {0};
  for (size_t v = 0; v < VERTICES; v += 3) locked[v] = 1;
  qmat_edge_heap_fill(&h.edges, locked);
  assert_true(h.edges.count > 0);
  for (size_t e = 0; e < EDGES; e++)
    assert_int_equal(h.edges.places[e] == QMAT_NONE, locked[h.ends[2 * e]] || locked[h.ends[2 * e + 1]]);
  qmat_context_uninit(&h.context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_edges_come_by_cost_error_and_number),
      cmocka_unit_test(test_neither_new_ends_nor_what_was_put_back_changes_the_order),
      cmocka_unit_test(test_edges_at_locked_vertices_are_left_out),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
