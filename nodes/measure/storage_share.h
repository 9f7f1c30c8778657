/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_STORAGE_SHARE_H
#define QMAT_NODES_MEASURE_STORAGE_SHARE_H

/* medial.evaluate aims at bounds that are below epsilon by this share of it, so that a medial mesh which is certified
 * in memory stays certified in a file. Quantisation takes at most half of it; single precision has the other half. */
#define QMAT_STORAGE_SHARE 0.005

#endif
