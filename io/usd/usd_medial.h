/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_MEDIAL_H
#define QMAT_IO_USD_USD_MEDIAL_H

#include <jansson.h>

#include "io/bytes.h"

/* Reads the medial mesh in a scene of USD: from the prim whose customData has qmat_version, as io/usd/usd_write.h
 * writes it, in that prim's own space. `name` is the prim's name, or NULL if the scene has only one such prim. Prims of
 * one name have the same medial mesh, as in io/usd/usd_write.h. `facts` (a JSON object, may be NULL) gains the entries
 * of its customData. The caller releases `*medial`, which is sealed and has no regions; NULL on failure.
 * QMAT_ERROR_GEOMETRY if no prim has one, QMAT_ERROR_USAGE if several have one and none is named, QMAT_ERROR_FORMAT
 * with the prim if it is broken, and the errors of io/usd/usd_stage.h. One thread. Cost: linear. */
qmat_status qmat_usd_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *name,
                                 qmat_medial **medial, json_t *facts);

/* Lists the names of the prims with a medial mesh, each once, as an array of texts that the caller releases. Errors as
 * above. */
qmat_status qmat_usd_list_medials(qmat_context *context, const qmat_bytes *bytes, const char *path, json_t **names);

#endif
