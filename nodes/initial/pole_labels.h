/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_POLE_LABELS_H
#define QMAT_NODES_INITIAL_POLE_LABELS_H

#include "nodes/initial/poles.h"

/* Labels the poles: `labels` (one per pole) gets a qmat_pole_label. Poles at the box are outside. From them the labels
 * spread in the order of how certain they are: to opposite poles the other label, by the cosine between them, and to
 * neighbours in the power diagram the same label if their spheres intersect deeply, that is at an angle with a cosine
 * above `propagation`. `edges` (2 * edge_count ids) are the dual of the power diagram. QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. One thread. Cost: O(n log n). */
qmat_status qmat_poles_label(qmat_context *context, const qmat_poles *poles, const uint32_t *edges, size_t edge_count,
                             double propagation, uint8_t *labels);

#endif
