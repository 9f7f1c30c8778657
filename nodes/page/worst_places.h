/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_WORST_PLACES_H
#define QMAT_NODES_PAGE_WORST_PLACES_H

#include "nodes/page/shown.h"

/* Where an error is largest, in the unit frame. */
typedef struct qmat_worst_place {
  double at[3];
  double error; /* attained at `at`; 0: no place is known */
} qmat_worst_place;

/* Finds the place of the surface that is farthest outside of the envelope, and the place of the envelope's boundary
 * that is farthest from the surface, by the searches that medial.evaluate bounds the errors with. Each is the largest
 * up to a twentieth of `shown->range`. `out` and `in` are the errors that are known to be attained, as shares of the
 * diagonal, which makes the search short; 0 or NAN: none is known. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the
 * result does not depend on their number. */
qmat_status qmat_worst_places_find(qmat_context *context, const qmat_shown *shown, double out, double in,
                                   qmat_worst_place *of_surface, qmat_worst_place *of_envelope);

#endif
