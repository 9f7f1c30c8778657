/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_EXTRACT_H
#define QMAT_IO_EXTRACT_H

#include <jansson.h>

#include "core/value.h"

/* Extracts the medial mesh from a file: glTF (qmat_data in the extras of a node, else
 * qmat_flat; where a node has both, they are compared), USD (as io/usd/usd_write.h writes
 * it), PLY (as io/mesh/ply_medial.h writes it), or .ma. Its frame is that of the original model or mesh: the local
 * frame of the node or prim, translated by the origin stated in the file. `name` is the name or number of the node
 * (or of its parent with the mesh, where that one has none) or the name of the prim, NULL if there is only one; PLY and
 * .ma ignore it. `facts` (a JSON object, may be NULL) gains the extras or customData
 * whose keys start with qmat_, except the data. Stated counts are checked against the actual ones. `*medial` is sealed;
 * the caller releases it; NULL on failure. QMAT_ERROR_FORMAT; QMAT_ERROR_GEOMETRY: there is no medial mesh;
 * QMAT_ERROR_USAGE: there are several and `name` is NULL; QMAT_ERROR_IO; QMAT_ERROR_MEMORY. One thread. Cost: linear.
 */
qmat_status qmat_medial_extract(qmat_context *context, const char *path, const char *name, qmat_medial **medial,
                                json_t *facts);

/* Lists the nodes of a glTF asset with different medial meshes. The result is an array of objects with "node", the
 * `name` for qmat_medial_extract (the node's number if its name is missing or not unique), and "mesh", the number of
 * its mesh, if it has one that is not a skin. For USD "node" is the name of a prim. Empty for other formats. NULL on
 * failure, with the error recorded. The caller calls json_decref. Cost: linear. */
json_t *qmat_medial_carriers(qmat_context *context, const char *path);

#endif
