/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_MEDIAL_H
#define QMAT_IO_USD_USD_MEDIAL_H

#include <jansson.h>

#include "io/bytes.h"

/* Reads the medial mesh in a scene of USD: from the prim whose customData has qmat_version, as io/usd/usd_write.h
 * writes it, in that prim's own space. Prims of one name that state the same have one medial mesh. `name` is NULL if
 * the scene has only one, or what qmat_usd_list_medials calls it, or the path of its prim or of the prim above that
 * one; of paths the last names suffice ("R/Q", "Q"). `facts` (a JSON object, may be NULL) gains the entries of its
 * customData, and composed_prim: the path of the prim above it, where the scene does not have the prim that qmat_prim
 * names, since it refers to the one that does. The caller releases `*medial`, which is sealed and has no regions; NULL
 * on failure. QMAT_ERROR_GEOMETRY if no prim has one, QMAT_ERROR_USAGE if several have one and none is named, with a
 * hint that names some; QMAT_ERROR_FORMAT with the prim if it is broken, and the errors of io/usd/usd_stage.h. One
 * thread. Cost: linear.
 */
qmat_status qmat_usd_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *name,
                                 qmat_medial **medial, json_t *facts);

/* Lists the medial meshes of a scene, each once, as an array of texts that the caller releases: the name of the first
 * prim with it, or its path where another medial mesh has that name. Errors as above. */
qmat_status qmat_usd_list_medials(qmat_context *context, const qmat_bytes *bytes, const char *path, json_t **names);

#endif
