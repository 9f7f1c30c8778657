/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_HULL_NAMES_H
#define QMAT_IO_GLTF_GLTF_HULL_NAMES_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* Numbers the hulls on where meshes share a name: a second Box whose hulls would be UCX_Box_01 too gets the numbers
 * after those of the first, and after those that the asset has. Unreal takes every mesh UCX_Box_NN for a hull of Box.
 * Only meshes from number `meshes_given` on and nodes from `nodes_given` on are changed. False when out of memory.
 * Linear. */
bool qmat_gltf_number_hulls(json_t *root, size_t meshes_given, size_t nodes_given);

#endif
