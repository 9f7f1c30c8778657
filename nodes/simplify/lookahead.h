/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_LOOKAHEAD_H
#define QMAT_NODES_SIMPLIFY_LOOKAHEAD_H

#include <stdatomic.h>

#include "nodes/simplify/collapse_attempt.h"

/* Equal copies of a decimation, one a thread, do the same collapses at the same time. Between two collapses most edges
 * are refused, each after an expensive fit, and a refusal changes nothing: the copies share these attempts. They try
 * the next edges of the heap, one each at a time, tell each other the outcomes, and all do the first collapse that is
 * allowed. The result is that of one decimation alone. */

enum { QMAT_MOST_COPIES = 8, QMAT_MOST_AHEAD = 64 };

/* What an attempt finds out. */
typedef struct qmat_attempt {
  double sphere[4]; /* where it is allowed */
  bool is_alone;    /* no other sphere moves */
  uint32_t failed_point, tested_first;
  double needed, fitted_error;
  qmat_collapse_counts refusals;
} qmat_attempt;

/* The attempts between two meetings of the copies. */
typedef struct qmat_attempts {
  qmat_attempt attempts[QMAT_MOST_AHEAD];
  _Atomic int next, first_allowed; /* the next attempt to make; the first that was allowed, QMAT_MOST_AHEAD for none */
  _Atomic bool failed;             /* a copy has failed or was cancelled */
} qmat_attempts;

/* Shared by all copies. A copy may still read the attempts before a meeting while another one makes those after it, so
 * that three are needed. */
typedef struct qmat_lookahead {
  int copies;
  qmat_attempts turns[3];
} qmat_lookahead;

/* One copy's view. */
typedef struct qmat_copy {
  qmat_lookahead *shared;
  int number;       /* 0 to copies - 1 */
  unsigned meeting; /* the number of meetings so far */
  bool has_left;    /* a meeting has ended with an error */
  int ahead;        /* the number of edges to try next; 0: one, by each copy itself, as after a collapse */
} qmat_copy;

/* Prepares `lookahead` for that number of copies. */
void qmat_lookahead_init(qmat_lookahead *lookahead, int copies);

/* Waits until all copies are here, each with its own status. QMAT_CANCELLED when another copy has failed. A copy that
 * gets an error has left: it must not meet again. To be called in a parallel region by all of its threads. */
qmat_status qmat_copy_meet(qmat_copy *copy, qmat_status own);

/* Notes whether the newest attempt, or turn of attempts, allowed a collapse: only refusals are worth looking ahead. */
void qmat_copy_note(qmat_copy *copy, bool allowed);

/* Tries edges from the top of the heap, of which `edge` has been removed, together with the other copies. `edge`
 * becomes the first that is allowed, or QMAT_NONE; then `sphere` and `*result` are as after qmat_decimation_attempt.
 * All edges before it are refused: they have left the heap, and their outcomes are known as after an attempt. Statuses
 * as qmat_copy_meet, and QMAT_ERROR_MEMORY. */
qmat_status qmat_lookahead_next(qmat_decimation *decimation, uint32_t *edge, double sphere[4],
                                qmat_collapse_outcome *result);

#endif
