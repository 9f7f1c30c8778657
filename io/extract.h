/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_EXTRACT_H
#define QMAT_IO_EXTRACT_H

#include <jansson.h>

#include "core/value.h"

/* Takes the medial mesh back out of a file that carries one: glTF (qmat_data in the extras of a node), USD (as
 * io/usd/usd_write.h writes it), PLY (as io/mesh/ply_medial.h writes it), or .ma. It is in the space of the model or
 * mesh that was described: the node's or prim's own, moved by the origin that the file states. `name` is that node's or
 * prim's name, or NULL where there is one only; it does not apply to PLY and .ma. `facts` (a JSON object, may be NULL)
 * gains what the file says of it: the extras or customData that start with qmat_, without the data. Stated counts are
 * checked against what is there. `*medial` is sealed and released by the caller; NULL on failure. QMAT_ERROR_FORMAT,
 * QMAT_ERROR_GEOMETRY where there is none, QMAT_ERROR_USAGE where there are several and none is named, QMAT_ERROR_IO,
 * QMAT_ERROR_MEMORY. One thread; linear. */
qmat_status qmat_medial_extract(qmat_context *context, const char *path, const char *name, qmat_medial **medial,
                                json_t *facts);

/* The nodes of a glTF asset whose medial meshes differ, each by what qmat_medial_extract takes as `name`: its name, or
 * its number where it has none or shares it. An array of objects with "node" and, where it carries one, the number of
 * its "mesh"; of other formats empty. NULL on failure, with the error recorded. The caller calls json_decref. Linear.
 */
json_t *qmat_medial_carriers(qmat_context *context, const char *path);

#endif
