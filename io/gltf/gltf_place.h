/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_PLACE_H
#define QMAT_IO_GLTF_GLTF_PLACE_H

#include <stdbool.h>

#include <jansson.h>

/* Adds a node, which it takes ownership of, with a matrix of 16 numbers (by columns, as glTF has them). `*number` gets
 * the node. `*top` gets the node to add to a scene: the same, or, where the matrix shears, which glTF has no node for,
 * a node above it. False when out of memory, also where `node` is NULL. */
bool qmat_gltf_place(json_t *root, json_t *node, const double m[16], json_int_t *number, json_int_t *top);

#endif
