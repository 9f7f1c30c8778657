/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECK_MESHES_H
#define QMAT_IO_GLTF_GLTF_CHECK_MESHES_H

#include "io/gltf/gltf_checker.h"

/* Checks the primitives of all meshes and reduces them as gltf_check.h describes. Call it after qmat_gltf_check_data.
 * QMAT_ERROR_FORMAT with the mesh or accessor, QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_check_meshes(const qmat_gltf_checker *check);

#endif
