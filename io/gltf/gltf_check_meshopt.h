/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECK_MESHOPT_H
#define QMAT_IO_GLTF_GLTF_CHECK_MESHOPT_H

#include "io/gltf/gltf_checker.h"

/* Whether a buffer is marked as a fallback, which is not to be loaded. QMAT_ERROR_FORMAT: its extension is
 * malformed.
 */
qmat_status qmat_gltf_check_placeholder(const qmat_gltf_checker *check, size_t index, json_t *buffer,
                                        bool *is_fallback);

/* Decompresses buffer view `index` if it has EXT_meshopt_compression. The decoded bytes become a new buffer of the
 * document, for which there is room, and `view` refers to it; `*size` is their number. A view of a placeholder has to
 * be compressed. QMAT_ERROR_FORMAT with the view, QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_check_meshopt(const qmat_gltf_checker *check, size_t index, json_t *view, int64_t *size);

#endif
