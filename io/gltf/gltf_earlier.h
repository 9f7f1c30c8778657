/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_EARLIER_H
#define QMAT_IO_GLTF_GLTF_EARLIER_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Takes what an earlier run added for meshes out of an asset: the colliders of the nodes that carry them and of their
 * joints, how these nodes move, children with a skin or a medial mesh, helper nodes outside of all scenes, and nodes
 * with the medial mesh of all meshes together, with their colliders. What they alone used goes from the ends of the
 * arrays, so that the asset's own members keep their numbers: meshes, shapes, accessors, buffer views, materials, a
 * buffer, and the end of the GLB's chunk (`*chunk_size`; 0: there is none). What other programs moved away from the
 * ends stays, and nodes there are empty. `is_replaced`: per mesh of the asset; NULL: all of them, and their nodes lose
 * the members of a medial mesh, too. False when out of memory. Linear. */
bool qmat_gltf_drop_earlier(json_t *root, const bool *is_replaced, size_t *chunk_size);

#endif
