/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_NEAR_COPIES_H
#define QMAT_IO_NEAR_COPIES_H

#include <jansson.h>

#include "core/value.h"

/* Makes one mesh of those of a list that differ only by rounding: the copies of an object that an exporter transforms
 * in single precision. Their triangles, skins and units are equal, and each vertex is at most 2e-6 diagonals from that
 * of the first of them. The mesh that most of them equal stands for all. Its deviation grows by the largest distance
 * of a vertex, so that bounds hold for all. The others have its name, "near_copy_of", in their entry of the array
 * `reports`. Meshes that are all equal stay. The items are sealed or failures; the list is not sealed yet. Cost: O(n^2)
 * comparisons of counts. */
qmat_status qmat_near_copies_merge(qmat_context *context, qmat_list *list, const json_t *reports);

#endif
