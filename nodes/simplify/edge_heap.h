/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_EDGE_HEAP_H
#define QMAT_NODES_SIMPLIFY_EDGE_HEAP_H

#include "core/geometry/medial_complex.h"

/* A heap of the edges of a medial complex, cheapest first. Edges of equal cost are ordered by error (eq. 6 gives every
 * spike the cost 0), then by their numbers, so that the first one depends on nothing but the edges in the heap. The
 * arrays live in the arena of the context that qmat_edge_heap_init gets. */
typedef struct qmat_edge_heap {
  const qmat_complex *complex;
  double *costs, *errors;          /* per edge: set before the edge is inserted; update the edge after a change */
  struct qmat_heap_entry *entries; /* the heap: each entry has at most four children */
  uint32_t *places;                /* per edge: its place in the heap; QMAT_NONE: not in the heap */
  size_t count;
} qmat_edge_heap;

/* An edge in the heap, with a copy of its cost: it decides most comparisons without another memory access. */
typedef struct qmat_heap_entry {
  double cost;
  uint32_t edge;
} qmat_heap_entry;

/* Allocates an empty heap for the edges of the complex. QMAT_ERROR_MEMORY. */
qmat_status qmat_edge_heap_init(qmat_context *context, qmat_edge_heap *heap, const qmat_complex *complex);

/* Fills the heap with all edges, except those with a locked end (`locked`: per vertex; NULL: none). All costs and
 * errors are set. Cost: linear. */
void qmat_edge_heap_fill(qmat_edge_heap *heap, const uint8_t *locked);

/* The cheapest edge; the heap is not empty. */
static inline uint32_t qmat_edge_heap_first(const qmat_edge_heap *heap) {
  return heap->entries[0].edge;
}

/* Removes an edge if it is in the heap. Cost: logarithmic. */
void qmat_edge_heap_remove(qmat_edge_heap *heap, uint32_t edge);

/* Inserts an edge, or moves it to its new place. Cost: logarithmic. */
void qmat_edge_heap_update(qmat_edge_heap *heap, uint32_t edge);

#endif
