/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_MESH_MA_H
#define QMAT_IO_MESH_MA_H

#include "io/bytes.h"

/* The text format of medial meshes: "spheres edges triangles", then lines v x y z radius, e i j and f i j k, with
 * numbers from 0. */

/* Reads a whole .ma file; `path` is for errors. The lines may come in any order and '#' starts a comment; counts,
 * finite numbers, radii of at least 0 and numbers in range are checked; edges of triangles are added where they are
 * missing. `*medial` is sealed, the caller releases it; NULL on failure. QMAT_ERROR_FORMAT with line and column, or
 * QMAT_ERROR_MEMORY. Cost: linear. */
qmat_status qmat_ma_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_medial **medial);

/* Writes a .ma file whose numbers read back as the same. `*file` is sealed; the caller releases it; NULL on failure.
 * QMAT_ERROR_MEMORY. */
qmat_status qmat_ma_write(qmat_context *context, const qmat_medial *medial, qmat_file **file);

#endif
