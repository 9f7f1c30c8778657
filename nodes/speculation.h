/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SPECULATION_H
#define QMAT_NODES_SPECULATION_H

#include "nodes/collapse_trial.h"

/* Trials made ahead of their turn, many at once on all threads. A trial reads nothing farther than two edges from the
 * ends of its edge, so it is what it would be in its turn unless something has changed there since; then it is thrown
 * away. The collapses are the same, bit for bit, with any number of threads and without speculation.
 *
 * It pays where spheres are fitted: trials take long there, and most are refused and change nothing. Before that,
 * cheap collapses follow one another in the same place, and most of what is made ahead would be thrown away. */
typedef struct qmat_speculation qmat_speculation;

/* Sets simplification->speculation, or leaves it NULL where it is of no use: on one thread, where what is held rises,
 * and where features are protected. QMAT_ERROR_MEMORY. End with qmat_speculation_end, also after a failure. */
qmat_status qmat_speculation_start(qmat_simplification *simplification);
void qmat_speculation_end(qmat_simplification *simplification);

/* The trial of `edge`, which is next and already out of the heap: one made before, or one of a batch that is made now
 * with others from the top of the heap. Its preview and what it found are then those of the simplification's own tools.
 * False where there is no speculation. All threads. */
bool qmat_speculation_take(qmat_simplification *simplification, uint32_t edge, qmat_trial *trial);

/* Throws away what was made ahead around a vertex that has changed. Cost: linear in the stars of its neighbours. */
void qmat_speculation_forget(qmat_simplification *simplification, uint32_t vertex);

#endif
