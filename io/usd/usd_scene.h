/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_SCENE_H
#define QMAT_IO_USD_USD_SCENE_H

#include "io/bytes.h"
#include "io/usd/usd_mesh.h"
#include "io/usd/usd_rig.h"
#include "io/usd/usd_stage.h"

/* One place of a mesh in the scene. */
typedef struct qmat_usd_placement {
  uint32_t mesh;
  qmat_usd_transform world; /* from the mesh's own space into that of the scene */
  uint32_t skin;            /* of the rig; UINT32_MAX: none */
  bool states_body;         /* the prim or one above it is a rigid body, or the prim is a collider */
  const char *path;         /* of the prim with the mesh; for a point instance, of its prototype's prim */
} qmat_usd_placement;

/* The surfaces of a scene. A zeroed one is empty; free it with qmat_usd_scene_close. */
typedef struct qmat_usd_scene {
  qmat_usd_stage *stage; /* owns the arrays of the meshes */
  size_t mesh_count, mesh_capacity, digest_capacity;
  qmat_usd_mesh *meshes; /* distinct ones, in the order of their first places */
  qmat_digest *digests;  /* per mesh */
  size_t placement_count, placement_capacity;
  qmat_usd_placement *placements; /* in the order of the scene */
  qmat_usd_rig rig;
  qmat_arena arena;      /* of the shapes' arrays, and of paths */
  size_t shape_elements; /* vertices and corners of the shapes' meshes */
  size_t prims, cages, holes, instances, point_instances, shapes, prims_skipped, shapes_skipped;
} qmat_usd_scene;

/* Reads a scene of USD (.usda, .usdc, .usdz): every mesh and solid shape (io/usd/usd_shape.h, circles with `segments`
 * sides; 0: 64) that is defined, active, visible, of purpose "default" or "render" and not a class. If there is none,
 * prims that only have an "over" are read too. Equal meshes are one mesh with several places; a PointInstancer places
 * the meshes of its prototypes. Transforms are in double precision, in the order of xformOpOrder, with every operation,
 * !invert! and !resetXformStack!. Left-handed meshes reverse their faces, and faces that are holes are skipped.
 * Subdivision surfaces are read as their control cages. What a transform flattens is left out. Skinned meshes keep
 * their modelled pose and are bound to the skeletons of the rig, except at the places of a point instancer.
 * io/usd/usd_stage.h describes what is composed and what is skipped. `bytes` must outlive the scene.
 *
 * QMAT_ERROR_FORMAT with file, line and column for what is not USD, and with the prim for a broken mesh: negative face
 * counts, face counts whose sum differs from the number of indices, indices out of range, values of the wrong type.
 * QMAT_ERROR_GEOMETRY when there is no mesh, more places than the files justify (2^20, and one for each 8 bytes), or
 * different shapes of more than 2^24 vertices and corners. A broken PointInstancer is left out with a warning; it is an
 * error where nothing else can be read.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. Close the scene also after a failure. One thread. Cost: linear in the files and
 * the places. */
qmat_status qmat_usd_scene_open(qmat_context *context, const qmat_bytes *bytes, const char *path, size_t segments,
                                qmat_usd_scene *scene);
void qmat_usd_scene_close(qmat_usd_scene *scene);

/* `report` gains the whole numbers layers_read, prims_read, meshes_placed, cages (subdivision surfaces among the
 * distinct meshes), holes (faces that are skipped), instances (prims marked as instanceable), point_instances,
 * shapes_read, prims_skipped (inactive, invisible, or of another purpose) and shapes_skipped (geometry of other types);
 * meters_per_unit (a number); up_axis ("Y" or "Z"); and warnings, an array of at most 101 texts "PATH: ..." about what
 * was skipped or read differently. QMAT_ERROR_MEMORY. */
qmat_status qmat_usd_scene_report(qmat_context *context, const qmat_usd_scene *scene, json_t *report);

/* Adds one mesh in its own space to `soup`. QMAT_ERROR_MEMORY, QMAT_CANCELLED. */
qmat_status qmat_usd_scene_add_mesh(qmat_context *context, const qmat_usd_scene *scene, size_t mesh, qmat_soup *soup);

/* Reads a scene with 64 segments, and adds all of it to `soup` in world space, in the scene's own units. If there
 * are subdivision surfaces, soup->cage has every mesh with its scheme, boundary rule, holes, creases and corners.
 * `report` (a JSON object, may be NULL) gets the keys above. QMAT_ERROR_GEOMETRY also for more copies than the files
 * justify: 2^24 vertices and corners, and 16 for each byte. Otherwise as above. On failure the soup holds part of the
 * model. */
qmat_status qmat_usd_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup,
                          json_t *report);

/* The same for a scene that is open. */
qmat_status qmat_usd_scene_add_all(qmat_context *context, const qmat_usd_scene *scene, const char *path,
                                   qmat_soup *soup);

#endif
