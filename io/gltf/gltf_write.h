/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_WRITE_H
#define QMAT_IO_GLTF_GLTF_WRITE_H

#include <stdbool.h>

#include "io/gltf/gltf_medial_text.h"
#include "io/gltf/gltf_skin.h"

/* Makes a glTF 2.0 file of a medial mesh: one scene with one node. glTF measures in metres and y is up; a medial mesh
 * in other units or with z up keeps its coordinates, and its node gets a parent that scales and turns it. The node has
 *  - the skin as an ordinary mesh (POSITION, area-weighted NORMAL, indices, one material), so that every client shows
 *    something, with its distance from the envelope in its extras (qmat_gltf_skin_add); without a skin (NULL, or no
 *    triangles) the node has no mesh;
 *  - the medial mesh in its extras, which clients preserve better than extensions: flat strings, numbers and booleans.
 *      qmat_version      the program's version
 *      qmat_data         base64 of the output of qmat_draco_encode_medial
 *      qmat_data_format  "draco"
 *      qmat_vertices, qmat_edges, qmat_triangles     counts of the medial mesh
 *      qmat_epsilon      as in the options; missing when not known
 *      qmat_error_out    the errors of what qmat_data and qmat_flat decode to (qmat_errors_after_move), the larger of
 *                        the two; missing when not known
 *      qmat_error_in
 *      qmat_error_unit   "diagonal"; with the three above
 *      qmat_certified    whether both are certified to be at most qmat_epsilon; missing when not known
 *      qmat_quantisation       the largest |dc| + |dr| between a sphere of `medial` and the same sphere in qmat_data
 *      qmat_quantisation_unit  "model"
 *      qmat_position_bits, qmat_radius_bits
 *      qmat_flat         the same medial mesh as plain numbers: base64 of the output of qmat_flat_encode
 *      qmat_flat_format  "u16" or "f32"
 *      qmat_flat_quantisation  the same for qmat_flat
 *      qmat_frame        "node": spheres are in the node's local space, like the skin
 *      qmat_origin_x, qmat_origin_y, qmat_origin_z   the origin of that space in the space of `medial`; missing if zero
 * Single precision is too coarse far from zero. There the node is translated to the origin of qmat_storage_origin, and
 * skin and spheres are relative to it.
 * Chosen bits increase up to three times until the measured error is at most options->quantisation. With compress_skin
 * the skin's positions get bits by the same bound.
 * `*file` is sealed, has one part, and is released by the caller; NULL on failure. QMAT_ERROR_GEOMETRY for an empty
 * medial mesh or coordinates beyond single precision, QMAT_ERROR_USAGE for bits out of range, QMAT_ERROR_MEMORY,
 * QMAT_ERROR_DEPENDENCY. One thread; the same bytes for the same input. Cost: linear. */
qmat_status qmat_gltf_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                            const qmat_gltf_options *options, qmat_file **file);

/* A medial mesh to add to a scene, or to a new asset. */
typedef struct qmat_gltf_addition {
  const qmat_medial *medial;      /* NULL, in a scene: nothing is added for this mesh */
  const qmat_mesh *skin;          /* added as a mesh; NULL: none */
  qmat_gltf_vertex_data vertices; /* of the skin; not compressed */
  qmat_gltf_options options;
  const qmat_colliders *colliders; /* added to the nodes that get the medial mesh; NULL: none */
  unsigned collider_forms;         /* of io/gltf/gltf_colliders.h */
  bool dynamic;                    /* those nodes are bodies that move */
} qmat_gltf_addition;

/* Makes a glTF 2.0 file of the medial meshes of a USD scene, with the places that `scene` lists. `additions` has one
 * element per mesh of the scene, in that mesh's space. Each place is a node with the mesh's skin and extras, and with
 * the path of the prim as qmat_prim; a place that shears has a node above it. A place with a skin has it, on a node
 * with a mesh whose vertices have joints, which Draco does not compress. Skeletons are nodes named after
 * their prims with their joints below, and one animation, "motion", has all curves. Otherwise as qmat_gltf_write. */
qmat_status qmat_gltf_write_places(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                                   size_t count, qmat_file **file);

/* Writes the glTF asset of `scene` with medial meshes added. Apart from `embed` and `draco_meshes`, existing content is
 * preserved: the JSON gains keys and members at the end of arrays, and no byte of a buffer changes. `additions` has one
 * element per mesh of the scene (scene->mesh_count), in that mesh's space. If mesh_count is 0, it has one element for
 * the whole scene, in world space. Every node that references the mesh gets the extras above; they replace those of an
 * earlier run, all of whose additions to these nodes are taken out first (qmat_gltf_drop_earlier). If the node's extras
 * are not an object, a new child gets them. The skin becomes a new child of the node, with the node's own skin where
 * its vertices have joints. Hulls of colliders have the name of the asset's mesh. Children are translated if the data
 * have another origin. A medial mesh of the whole scene gets a new node with its extras and skin. Skin data follow the
 * GLB's binary chunk, or are in a new buffer. `binary` and `embed` must be the same in all options. Files that the
 * asset refers to and that are not embedded become further parts of `*file` (qmat_gltf_side_parts). With
 * `draco_meshes`, qmat_gltf_compress compresses the asset's own triangles within the smallest `quantisation`; the
 * errors in the extras include that movement. `report` (an object, may be NULL) then gains draco_primitives and, if
 * something is unchanged, warnings. Otherwise as qmat_gltf_write. */
qmat_status qmat_gltf_enrich(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                             size_t count, bool draco_meshes, json_t *report, qmat_file **file);

/* qmat_gltf_write with colliders. */
qmat_status qmat_gltf_write_addition(qmat_context *context, const qmat_gltf_addition *addition, qmat_file **file);

#endif
