/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_MOTION_H
#define QMAT_IO_GLTF_GLTF_MOTION_H

#include <jansson.h>

#include "core/value.h"

/* What a moving body has in KHR_physics_rigid_bodies and OMI_physics_body: the mass in kg, its centre in the space of
 * node number `node`, and the moments in kg m^2 with their axes, which turn with the node and do not scale. `meters`
 * are the metres per unit that the colliders' mass takes (0: that of the node). The node's transform and those above it
 * scale volume and inertia in each direction. `shift` is the origin of the node's space in the colliders'. The object
 * is empty where the mass is not known or zero. NULL when out of memory; the caller owns it. */
json_t *qmat_gltf_motion_of(const json_t *root, size_t node, const qmat_colliders *colliders, const double shift[3],
                            double meters);

/* Whether an animation of the asset moves a node, or one above it. */
bool qmat_gltf_is_animated(const json_t *root, size_t node);

/* Whether the asset itself says how the body of a node moves: by a motion of the node or of one above it that is not
 * ours, or by a collider or a trigger on the node. A motion is ours where a collider below its node is marked with
 * QMAT_GLTF_MOTION_MARK: the schemas of the extensions allow no mark in it. */
bool qmat_gltf_has_own_motion(const json_t *root, size_t node);

/* Removes our motion from a node. */
void qmat_gltf_drop_motion(const json_t *root, json_t *node);

/* The extension that holds bodies: of KHR (0) or OMI (1). */
extern const char *const qmat_gltf_body_extensions[2];

#endif
