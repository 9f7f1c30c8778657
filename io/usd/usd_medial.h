/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_MEDIAL_H
#define QMAT_IO_USD_USD_MEDIAL_H

#include <jansson.h>

#include "io/bytes.h"

/* Takes a medial mesh back out of a scene of USD: out of the prim whose customData has qmat_version, as
 * io/usd/usd_write.h writes it, in that prim's own space. `name` is the prim's name, or NULL where the scene has one
 * such prim only. `facts` (a JSON object, may be NULL) gains what its customData say. `*medial` is sealed, without
 * regions, and released by the caller; NULL on failure. QMAT_ERROR_GEOMETRY where no prim has one, QMAT_ERROR_USAGE
 * where several have one and none is named, QMAT_ERROR_FORMAT with the prim where it is broken, and what
 * io/usd/usd_stage.h fails with. One thread; linear. */
qmat_status qmat_usd_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *name,
                                 qmat_medial **medial, json_t *facts);

#endif
