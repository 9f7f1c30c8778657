/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_KEEP_H
#define QMAT_IO_GLTF_GLTF_KEEP_H

#include <jansson.h>

#include "core/value.h"

/* Keeps a whole asset in `scene`: `bytes` become its first part, and each file that the JSON refers to by a relative
 * path becomes a further part, once, under the name that qmat_gltf_part_name gives it. Outside of the asset's folder
 * ("../textures/t.png") only images are read, so that an asset cannot pull other files of the machine into its copy.
 * Every file that is left out adds a text to `warnings` (an array). `path` is the asset's. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_keep(qmat_context *context, json_t *root, const uint8_t *bytes, size_t size, const char *path,
                           qmat_scene *scene, json_t *warnings);

/* The part of a scene that holds the file which a URI names; 0: none. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_find_part(qmat_context *context, const qmat_scene *scene, const char *uri, size_t length,
                                size_t *part);

/* The media type of an image by its first bytes ("image/png"): PNG, JPEG, WebP, KTX2, DDS or AVIF. NULL: it is none. */
const char *qmat_gltf_image_type(const uint8_t *bytes, size_t size);

#endif
