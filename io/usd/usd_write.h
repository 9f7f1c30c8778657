/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_WRITE_H
#define QMAT_IO_USD_USD_WRITE_H

#include <jansson.h>

#include "io/bytes.h"
#include "io/stored_medial.h"

/* The file: a layer as text (.usda) or as a binary crate (.usdc), or a package with a text layer (.usdz). */
typedef enum qmat_usd_form { QMAT_USD_TEXT, QMAT_USD_CRATE, QMAT_USD_PACKAGE } qmat_usd_form;

/* The form of the file, and facts about the medial mesh. */
typedef struct qmat_usd_options {
  qmat_usd_form form;
  const char *name;                /* of the model, UTF-8; NULL or "": none */
  const char *prim;                /* the path of the prim that is described, for qmat_usd_put_class; else NULL */
  double meters_per_unit;          /* 0: unknown, written as 1 */
  bool is_z_up;                    /* else y is up */
  double moved;                    /* how far single precision may move the solid, model units; above zero */
  qmat_stated_errors errors;       /* of the medial mesh before it is stored */
  const qmat_colliders *colliders; /* NULL: none (io/usd/usd_colliders.h) */
  bool dynamic;                    /* the prim with colliders is a rigid body that moves */
  qmat_stated_errors *stated;      /* becomes the errors that the file states; may be NULL */
} qmat_usd_options;

/* Makes a USD layer of a medial mesh: one Xform, the default prim, with
 *  - "skin", a Mesh without subdivision (if `skin` is not NULL and has triangles);
 *  - "spheres", Points with widths (diameters) and primvars:radius, and with primvars:skel:jointIndices and
 * jointWeights (4 each) and the schema SkelBindingAPI where the medial mesh has a skin: numbered as by the model's
 * mesh;
 *  - "cones", BasisCurves (if there are edges): a line of two points for each edge, with widths, primvars:radius and
 * the sphere indices primvars:qmat:sphere;
 *  - "slabs", a Mesh over all spheres with primvars:radius (if there are triangles);
 * the last three have the purpose "guide", so that renderers show the skin. The Xform has the customData that
 * io/gltf/gltf_write.h writes as extras, without the blob; qmat_quantisation is how far single precision moves the
 * solid. If that were more than a quarter of options->moved, all points are relative to the origin that
 * qmat_storage_origin chooses: the Xform has an xformOp:translate in double precision, and customData has
 * qmat_origin_x, _y and _z. The caller releases `*file`, which is sealed and has one part; NULL on failure.
 * QMAT_ERROR_GEOMETRY for an empty medial mesh, or spheres or vertices beyond single precision; QMAT_ERROR_MEMORY. One
 * thread; the same bytes for the same input. Cost: linear. */
qmat_status qmat_usd_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                           const qmat_usd_options *options, qmat_file **file);

/* Appends the same prim as a class named `prim`, with options->prim in its customData as qmat_prim; it is no rigid
 * body. The locale's decimal point must be that of C. Otherwise as above. */
qmat_status qmat_usd_put_class(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                               const qmat_usd_options *options, const char *prim, qmat_writer *writer);

/* A medial mesh of a scene. */
typedef struct qmat_usd_addition {
  const qmat_medial *medial; /* NULL: nothing is added for this mesh */
  const qmat_mesh *skin;     /* NULL: none */
  qmat_usd_options options;
} qmat_usd_addition;

/* Makes a layer over a USD scene that was kept (io/usd/usd_keep.h): its sublayer is the scene's own file, and prims
 * with an "over" add a child to each prim that has a mesh. Prims whose names text cannot have get none. The child
 * references the class of the mesh's medial mesh, which is described once, in the mesh's space: "medial_0" for mesh 0;
 * other names where the scene, or a layer that it refers to, has such prims. A medial mesh that a prim has already
 * becomes inactive. `report` (a JSON object, may be NULL) gains a warning for each of the first prims whose shape is
 * that of a variant: the medial mesh stays when another one is selected. `additions` has one element per mesh of the
 * scene. With instances in the scene, the prims on the way are no longer instanceable, which would hide the additions.
 * Layer metadata that only a root layer may have are copied: the default prim, units, axis and times.
 *
 * With colliders, the prims become rigid bodies, each with the mass and the inertia of its place, in the units of mass
 * and length of the scene; not where a prim, or one above it, is a body already or is a collider (placement_bodies).
 * Bodies whose transform, or that of a prim above them, changes over time are kinematic.
 *
 * A layer that is no package has one side part, the scene's file: "original.usda", ".usdc" or ".usdz". A package
 * contains everything: the layer first, and the scene's files in the folder "original". options->form and name are
 * those of the first addition. QMAT_ERROR_GEOMETRY, QMAT_ERROR_MEMORY, QMAT_CANCELLED, and the errors of
 * io/usd/usd_stage.h. `*file` as above. Cost: linear; the prims with a mesh and their children are composed again. */
qmat_status qmat_usd_write_layer(qmat_context *context, const qmat_scene *scene, const qmat_usd_addition *additions,
                                 size_t count, json_t *report, qmat_file **file);

#endif
