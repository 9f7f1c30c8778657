/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_KEEP_H
#define QMAT_IO_GLTF_GLTF_KEEP_H

#include <jansson.h>

#include "core/value.h"

/* Stores a whole asset in `scene`. `bytes` become the first part. Each file that the JSON refers to by a relative path
 * becomes one further part, named by qmat_gltf_part_name. Outside the asset's folder ("../textures/t.png") only images
 * are read, so that an asset cannot copy other files of the machine. Every omitted file adds a text to `warnings` (an
 * array). `path` is the asset's path. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_keep(qmat_context *context, json_t *root, const uint8_t *bytes, size_t size, const char *path,
                           qmat_scene *scene, json_t *warnings);

/* Finds the part of a scene for the file that a URI names; 0: none. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_find_part(qmat_context *context, const qmat_scene *scene, const char *uri, size_t length,
                                size_t *part);

/* The media type of an image ("image/png") from its first bytes: PNG, JPEG, WebP, KTX2, DDS or AVIF. NULL: no image. */
const char *qmat_gltf_image_type(const uint8_t *bytes, size_t size);

#endif
