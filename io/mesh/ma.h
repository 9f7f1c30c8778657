/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_MESH_MA_H
#define QMAT_IO_MESH_MA_H

#include "io/bytes.h"

/* The text format of medial meshes: the counts "spheres edges triangles", then lines "v x y z radius", "e i j" and
 * "f i j k" with sphere indices from 0. */

/* Reads a whole .ma file; `path` is for errors. The lines may come in any order and '#' starts a comment. Coordinates
 * must be finite, radii at least 0, indices in range and the counts right. Missing edges of triangles are added. The
 * caller releases `*medial`, which is sealed; NULL on failure. QMAT_ERROR_FORMAT with line and column, or
 * QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_ma_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_medial **medial);

/* Writes a .ma file whose numbers read back unchanged. The caller releases `*file`, which is sealed; NULL on failure.
 * QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_ma_write(qmat_context *context, const qmat_medial *medial, qmat_file **file);

#endif
