/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_COLLAPSE_COMMIT_H
#define QMAT_NODES_SIMPLIFY_COLLAPSE_COMMIT_H

#include "nodes/simplify/decimation_state.h"

/* Does the newest preview, which the newest test has allowed for `sphere` (4 doubles, unit frame), and updates costs
 * and the queue around it. QMAT_ERROR_MEMORY. One thread. */
qmat_status qmat_decimation_accept_alone(qmat_decimation *decimation, const double sphere[4]);

/* The same. The other spheres of its neighbourhood, already in place, are tested and get their witnesses. */
qmat_status qmat_decimation_accept(qmat_decimation *decimation, const double sphere[4]);

#endif
