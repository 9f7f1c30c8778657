/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECK_NODES_H
#define QMAT_IO_GLTF_GLTF_CHECK_NODES_H

#include "io/gltf/gltf_checker.h"

/* Checks the joints and inverse bind matrices of all skins. Call it after qmat_gltf_check_data. QMAT_ERROR_FORMAT with
 * the skin, QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_check_skins(const qmat_gltf_checker *check);

/* Checks that the nodes have valid transforms and form trees, and removes every scene except the one to read.
 * QMAT_ERROR_FORMAT with the node or scene, QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_check_nodes(const qmat_gltf_checker *check);

#endif
