/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_WRITE_H
#define QMAT_IO_GLTF_GLTF_WRITE_H

#include <stdbool.h>

#include "io/stored_medial.h"

/* How to write, and what is known of the medial mesh. */
typedef struct qmat_gltf_options {
  bool binary;                /* one .glb; else one .gltf whose own data are in it as base64 */
  bool embed;                 /* of a .glb: the files that a kept scene refers to go into it */
  bool compress_skin;         /* KHR_draco_mesh_compression, required: smaller, but some engines refuse it */
  int position_bits;          /* 1 to 30; 0: chosen by `quantisation` */
  int radius_bits;            /* the same */
  double quantisation;        /* what storage may move the solid by, model units; used where bits are 0 */
  const char *name;           /* of the node and the mesh, UTF-8; NULL or "": none */
  qmat_stated_errors errors;  /* of the medial mesh as it is given */
  qmat_stated_errors *stated; /* gets the errors that the file states; NULL: not wanted */
} qmat_gltf_options;

/* Makes a glTF 2.0 file of a medial mesh: one scene with one node, which carries
 *  - the skin as an ordinary mesh (POSITION, area-weighted NORMAL, indices, one material), so that every client shows
 *    something; without a skin (NULL, or no triangles) the node carries no mesh;
 *  - the medial mesh in its extras, which clients keep better than extensions: flat strings, numbers and booleans.
 *      qmat_version      the program's version
 *      qmat_data         base64 of what qmat_draco_encode_medial makes
 *      qmat_data_format  "draco"
 *      qmat_vertices, qmat_edges, qmat_triangles     counts of the medial mesh
 *      qmat_epsilon      as in the options; missing when not known
 *      qmat_error_out    the errors of what qmat_data decodes to (qmat_errors_after_move); missing when not known
 *      qmat_error_in
 *      qmat_error_unit   "diagonal"; with the three above
 *      qmat_certified    whether both are certified to be at most qmat_epsilon; missing when not known
 *      qmat_quantisation       the largest |dc| + |dr| of a sphere of `medial` against the one that qmat_data has
 *      qmat_quantisation_unit  "model"
 *      qmat_position_bits, qmat_radius_bits
 *      qmat_frame        "node": spheres are in the node's local space, like the skin
 *      qmat_origin_x, qmat_origin_y, qmat_origin_z   where that space's origin is in the space of `medial`; missing
 *                        where the two are the same
 * Far from zero, single precision would crush the model: there the node is translated to the origin that
 * qmat_storage_origin chooses, and skin and spheres count from it.
 * Chosen bits are raised until the measured error is within options->quantisation or single precision ends; with
 * compress_skin the skin's positions get bits by the same bound.
 * `*file` is sealed, has one part, and is released by the caller; NULL on failure. QMAT_ERROR_GEOMETRY for an empty
 * medial mesh or coordinates beyond single precision, QMAT_ERROR_USAGE for bits out of range, QMAT_ERROR_MEMORY,
 * QMAT_ERROR_DEPENDENCY. One thread; the same bytes for the same input. Cost: linear. */
qmat_status qmat_gltf_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                            const qmat_gltf_options *options, qmat_file **file);

/* A medial mesh that is to be added to a scene. */
typedef struct qmat_gltf_addition {
  const qmat_medial *medial; /* NULL, in a scene: its mesh stays as it is */
  const qmat_mesh *skin;     /* to be added as a mesh; NULL: none */
  qmat_gltf_options options;
} qmat_gltf_addition;

/* Makes the glTF asset that `scene` keeps anew, with medial meshes added and all else as it was: the JSON gains keys
 * and members at the end of arrays, and no byte of a buffer changes. `additions` are one for each mesh of the scene
 * (scene->mesh_count), in the space of that mesh, or one of all of them, in world space. Every node that carries the
 * mesh gains the extras above; where it has extras that are no object, a child that has them is added to it. What an
 * earlier run left there is replaced. The one medial mesh of all is carried by a node that is added to the scene. A
 * skin becomes a child of each of these nodes (the mesh of the node that was added for it), with its data behind those
 * of the GLB's binary chunk, else in a buffer of its own. What counts from another origin than the node's is on a child
 * that is translated there. The options' `binary` and `embed` are the same for all. Files that the asset refers to and
 * that are not embedded are further parts of `*file` (qmat_gltf_side_parts). With `draco_meshes` the asset's own
 * triangles are compressed (qmat_gltf_compress), within the smallest `quantisation`, and what that moves is part of the
 * errors in the extras; `report` (an object, may be NULL) gains draco_primitives and, where something is left as it is,
 * warnings. Otherwise as qmat_gltf_write. */
qmat_status qmat_gltf_enrich(qmat_context *context, const qmat_scene *scene, const qmat_gltf_addition *additions,
                             size_t count, bool draco_meshes, json_t *report, qmat_file **file);

#endif
