/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_COLLIDERS_H
#define QMAT_IO_GLTF_GLTF_COLLIDERS_H

#include <jansson.h>

#include "core/value.h"
#include "io/bytes.h"

/* Forms of colliders in glTF; several may be written together. */
enum {
  QMAT_GLTF_KHR = 1,    /* KHR_implicit_shapes and KHR_physics_rigid_bodies */
  QMAT_GLTF_OMI = 2,    /* OMI_physics_shape and OMI_physics_body; convex where Godot would lose a second radius */
  QMAT_GLTF_UNREAL = 4, /* hull meshes of nodes named UCX_name_01 */
  QMAT_GLTF_GODOT = 8   /* hull meshes of nodes named name_01-convcolonly */
};

/* Colliders that have been added to an asset, for the nodes that carry them. */
typedef struct qmat_gltf_colliders {
  const qmat_colliders *colliders;
  unsigned forms;
  const char *name;   /* UTF-8, of the model; not empty */
  bool dynamic;       /* carriers are bodies that move: they get mass properties, unless the asset says how they move */
  double meters;      /* per unit of the colliders' space, which their mass takes; 0: that of the carrier */
  size_t nodes_given; /* the asset's nodes before anything was added: colliders among them are an earlier run's */
  double origin[3];   /* what hulls are relative to */
  json_int_t *shapes; /* 2 per shape, KHR and OMI: its number among the asset's; -1: none. Owned */
  json_int_t *hulls;  /* per shape: the mesh of its hull; -1: none. Owned */
  json_int_t *nodes;  /* per shape: a node outside of all scenes with that mesh, for KHR; -1: none. Owned */
} qmat_gltf_colliders;

/* Adds the shapes and the hull meshes that the forms need. Set the first six members, and `origin`, before. Hull data
 * are appended to `data`, which starts at `offset` in buffer `buffer`, padded to 4 bytes. QMAT_ERROR_MEMORY;
 * QMAT_ERROR_GEOMETRY names a shape beyond single precision. Free with qmat_gltf_colliders_uninit, also after a
 * failure. */
qmat_status qmat_gltf_colliders_init(qmat_context *context, json_t *root, json_int_t buffer, size_t offset,
                                     qmat_writer *data, qmat_gltf_colliders *added);
void qmat_gltf_colliders_uninit(qmat_gltf_colliders *added);

/* Makes a node the body of the colliders, a kinematic one where an animation moves it: they become children of it, and
 * replace those of an earlier run. `shift` is the origin of the node's space relative to that of the colliders, in the
 * colliders' space. False when out of memory. */
bool qmat_gltf_colliders_attach(json_t *root, json_int_t node, const qmat_gltf_colliders *added, const double shift[3]);

/* Makes the colliders of a skinned mesh follow its joints: each becomes a child of a node below its joint. Colliders
 * without joints take the one that moves most of them, by the joints and weights of the spheres of `medial` (which has
 * them, in the colliders' space) that are nearest to their own. That node has the joint's inverse bind matrix
 * (`matrices`, 16 numbers per joint by columns) and is a kinematic body where `dynamic` is set. `node` carries the
 * mesh; colliders of an earlier run leave it and the joints. Joints that the skin does not have count as its first.
 * False when out of memory. */
bool qmat_gltf_colliders_attach_to_joints(json_t *root, json_int_t node, const qmat_gltf_colliders *added,
                                          const qmat_medial *medial, const double *matrices);

#endif
