/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COLLAPSE_TEST_H
#define QMAT_NODES_SIMPLIFY_COLLAPSE_TEST_H

#include "nodes/simplify/decimation_state.h"

/* The tests that a collapse or a move has to pass: protection of tubular features, topology, inside, and both errors.
 * Each is about the newest preview (`collapse`) of a decimation. One thread. */

typedef enum {
  QMAT_COLLAPSE_ALLOWED,
  QMAT_COLLAPSE_REFUSED,
  QMAT_COLLAPSE_EXCEEDS /* refused, but a larger threshold would allow it */
} qmat_collapse_outcome;

/* Why the newest test of a sphere failed. */
typedef enum {
  QMAT_REFUSED_BY_NOTHING,
  QMAT_REFUSED_BY_SPHERE,
  QMAT_REFUSED_BY_MIDPOINT,
  QMAT_REFUSED_BY_SURFACE_TO_ENVELOPE,
  QMAT_REFUSED_BY_ENVELOPE_TO_SURFACE
} qmat_refusal;

/* Whether the sphere of a vertex has to stay: the rules protect thin features now, and an edge at the vertex is a
 * tubular one, which is an edge without slabs whose responsible region is all thin (section 3.4). */
bool qmat_decimation_is_protected(const qmat_decimation *decimation, uint32_t vertex);

/* Restricts the candidates of an edge if one end is protected: that end keeps its sphere, and `*bound` becomes true. Of
 * candidates that are bound already it has to be one. False if the edge must not collapse. */
bool qmat_decimation_apply_protection(const qmat_decimation *decimation, uint32_t edge, qmat_candidates *candidates,
                                      bool *bound);

/* Whether the topology policy allows the newest preview. Spheres of sheets and solids never merge. With
 * QMAT_TOPOLOGY_PRESERVE it has to keep the homotopy type. */
bool qmat_decimation_keeps_topology(qmat_decimation *decimation);

/* Whether the newest preview may be done with this sphere (4 doubles): inside the model, and both errors within the
 * threshold. `first` is a constraint point to test first (QMAT_NONE: none). Where an error exceeds the threshold,
 * `*needed` is a lower bound of the threshold that would allow it. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_test_sphere(qmat_decimation *decimation, const double *sphere, uint32_t first,
                                        qmat_collapse_outcome *result, double *needed);

/* Commits the newest preview with the sphere of its newest successful test. QMAT_ERROR_MEMORY. */
qmat_status qmat_decimation_commit(qmat_decimation *decimation, const double *sphere);

#endif
