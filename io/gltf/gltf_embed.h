/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_EMBED_H
#define QMAT_IO_GLTF_GLTF_EMBED_H

#include <jansson.h>

#include "core/value.h"

/* Moves the files of `scene` that the asset's buffers and images name into the binary chunk of a GLB, so that the file
 * needs no other. `root` is the asset's JSON: moved buffers become one, the first; moved images get buffer views at the
 * end of the list. The `size` bytes of `chunk` (NULL: none) stay at the front, unless no buffer is in them. Data URIs,
 * other addresses, files that the scene has no part of and images of unknown type stay as they are.
 * `*made` is the chunk anew, `*made_size` bytes, freed by the caller with qmat_free; NULL where nothing moved.
 * QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_gltf_embed(qmat_context *context, const qmat_scene *scene, json_t *root, const uint8_t *chunk,
                            size_t size, uint8_t **made, size_t *made_size);

/* The parts of a file that are not its main part: the files that the asset still names and that the scene has parts of,
 * once each, in the order of their URIs. A file keeps its name below the asset's folder. A file from outside of it gets
 * its base name, which no other part has, and its URIs in `root` change. `*parts` (NULL: none) and what they own are
 * freed by the caller. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_side_parts(qmat_context *context, const qmat_scene *scene, json_t *root, qmat_file_part **parts,
                                 size_t *count);

#endif
