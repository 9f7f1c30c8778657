/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_STAGE_H
#define QMAT_IO_USD_USD_STAGE_H

#include "io/bytes.h"
#include "io/usd/usd_prim.h"

/* A scene of USD, composed from its layers: sublayers, inherits, variants, references, payloads and specializes, in
 * that order of strength (LIVRPS). io/usd/usd_files.h finds the files. What cannot be composed is skipped with a
 * warning that names the prim: missing files, absolute paths and addresses, relocates, value clips, prims that refer to
 * themselves. A broken file is an error. Prims are composed one at a time: memory holds the layers and the prims from
 * the root to one prim. Source: OpenUSD's documentation of composition ("LIVERPS strength ordering"). */
typedef struct qmat_usd_stage qmat_usd_stage;

/* Opens the stage whose root layer is the file in `bytes` (.usda, .usdc or .usdz). `bytes` and `context`, which records
 * the errors of all calls below, must outlive it. Other files are searched relative to `path`. Free with
 * qmat_usd_stage_close; NULL on failure. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_stage_open(qmat_context *context, const qmat_bytes *bytes, const char *path,
                                qmat_usd_stage **stage);
/* NULL is allowed. */
void qmat_usd_stage_close(qmat_usd_stage *stage);

/* The root layer, which has the units. */
const qmat_usd_layer *qmat_usd_stage_root_layer(const qmat_usd_stage *stage);
/* The number of layers that were read so far. */
size_t qmat_usd_stage_layer_count(const qmat_usd_stage *stage);
/* The bytes of all files that were read so far. */
size_t qmat_usd_stage_bytes(const qmat_usd_stage *stage);
/* The files that were read so far. */
const struct qmat_usd_files *qmat_usd_stage_files(const qmat_usd_stage *stage);
/* The warnings so far, an array of texts "PATH: ..." that the stage owns. */
json_t *qmat_usd_stage_warnings(const qmat_usd_stage *stage);
/* Removes all warnings. */
void qmat_usd_stage_forget_warnings(qmat_usd_stage *stage);

/* The root of the scene. Free prims with qmat_usd_prim_uninit, also after a failure, children before parents. */
qmat_status qmat_usd_stage_root(qmat_usd_stage *stage, qmat_usd_prim *prim);

/* Composes one child, which keeps a pointer to its parent. QMAT_ERROR_FORMAT also when the scene becomes larger than
 * its files justify, as nested references can make it. QMAT_CANCELLED. */
qmat_status qmat_usd_prim_child(qmat_usd_stage *stage, const qmat_usd_prim *parent, const char *name,
                                qmat_usd_prim *child);

/* Composes the prim at an absolute path of the scene and calls `visit` with it, while the prims above it last. Without
 * such a prim nothing is called, and `*found` is false. The status is that of the visit. */
typedef qmat_status (*qmat_usd_visit)(void *user, qmat_usd_prim *prim);
qmat_status qmat_usd_stage_visit(qmat_usd_stage *stage, const char *path, qmat_usd_visit visit, void *user,
                                 bool *found);

#endif
