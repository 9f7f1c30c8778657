/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_BIND_H
#define QMAT_IO_GLTF_GLTF_BIND_H

#include "core/value.h"
#include "io/gltf/gltf_asset.h"

/* Reads the inverse bind matrices of skin `skin` of a checked asset: `*matrices` gets 16 numbers per joint, by columns,
 * identities where the skin has none; the caller frees it with qmat_free. Their data are in the asset's chunk, in a
 * data URI, or in a part of `scene`. NULL where they are compressed, sparse or not there. QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_bind_matrices(qmat_context *context, const qmat_scene *scene, const qmat_gltf_asset *asset,
                                    size_t skin, double **matrices);

#endif
