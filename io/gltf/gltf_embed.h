/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_EMBED_H
#define QMAT_IO_GLTF_GLTF_EMBED_H

#include <jansson.h>

#include "core/value.h"

/* Copies the files of `scene` and the data URIs that buffers and images refer to into the binary chunk of a GLB. In
 * `root`, the asset's JSON, all embedded buffers merge into the first buffer; embedded images get buffer views at the
 * end of the list. The `size` bytes of `chunk` (NULL: none) stay at the front if a buffer uses them. Other addresses,
 * files that are not in the scene, invalid base64 and images of unknown type are unchanged. `*made` is the new chunk of
 * `*made_size` bytes, freed by the caller with qmat_free; NULL if nothing was embedded. QMAT_ERROR_MEMORY. Linear. */
qmat_status qmat_gltf_embed(qmat_context *context, const qmat_scene *scene, json_t *root, const uint8_t *chunk,
                            size_t size, uint8_t **made, size_t *made_size);

/* Copies the files of the scene that the asset still refers to, once each, in the order of their URIs. They become the
 * side files of an output. A file inside the asset's folder keeps its relative path. A file outside gets a unique base
 * name, and its URIs in `root` change. The caller frees `*parts` (NULL: none) and their contents. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_side_parts(qmat_context *context, const qmat_scene *scene, json_t *root, qmat_file_part **parts,
                                 size_t *count);

#endif
