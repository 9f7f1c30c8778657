/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_EDGE_HEAP_H
#define QMAT_NODES_SIMPLIFY_EDGE_HEAP_H

#include "core/geometry/medial_complex.h"

/* The edges of a medial complex in a heap, cheapest first: by cost, then by error (eq. 6 gives every spike cost 0),
 * then by the ids of their ends, so that the order is one and the same in every run. The arrays live in the context's
 * arena that made them. */
typedef struct qmat_edge_heap {
  const qmat_complex *complex;
  double *costs, *errors;          /* per edge; set them before an edge is put in, and update it when they change */
  struct qmat_heap_entry *entries; /* the heap: each has at most four below it */
  uint32_t *places;                /* per edge: its place in the heap, QMAT_NONE when it is not in it */
  size_t count;
} qmat_edge_heap;

/* An edge in the heap, with its cost beside it, which decides nearly always. */
typedef struct qmat_heap_entry {
  double cost;
  uint32_t edge;
} qmat_heap_entry;

/* Makes room for the complex's edges; the heap is empty. QMAT_ERROR_MEMORY. */
qmat_status qmat_edge_heap_init(qmat_context *context, qmat_edge_heap *heap, const qmat_complex *complex);

/* Puts all edges in whose costs and errors are set; `locked` (per vertex; NULL: none) leaves out those that have a
 * locked end. Cost: linear. */
void qmat_edge_heap_fill(qmat_edge_heap *heap, const uint8_t *locked);

/* The cheapest edge; the heap is not empty. */
static inline uint32_t qmat_edge_heap_first(const qmat_edge_heap *heap) {
  return heap->entries[0].edge;
}

/* Takes an edge out; one that is not in it is left alone. Cost: logarithmic, as that of an update. */
void qmat_edge_heap_remove(qmat_edge_heap *heap, uint32_t edge);

/* Puts an edge in, or in its new place. */
void qmat_edge_heap_update(qmat_edge_heap *heap, uint32_t edge);

#endif
