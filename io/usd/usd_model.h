/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_MODEL_H
#define QMAT_IO_USD_USD_MODEL_H

#include "io/bytes.h"
#include "io/soup.h"

/* Meshes of a USD scene, each in its own space. A zeroed one is empty and valid. */
typedef struct qmat_usd_meshes {
  size_t count;
  uint32_t *ids;    /* count: numbers of the scene's distinct meshes, ascending */
  qmat_soup *soups; /* count */
  char **names;     /* count: the path of the first prim with the mesh, UTF-8 */
  size_t *uses;     /* count: how often the scene shows it */
} qmat_usd_meshes;

/* Reads the surfaces that `choice` selects: "all"; "merged" (one mesh of all, in the space of the scene); the path of a
 * prim, or the end of one path only, after a slash; or the number of a distinct mesh. `scene` gains the meshes' numbers
 * and places and the stage's files (io/usd/usd_keep.h), except for merged ones. `segments` is for round shapes
 * (io/usd/usd_shape.h). `report` gains the keys of qmat_usd_scene_report. QMAT_ERROR_USAGE with a hint for a choice
 * that selects nothing; otherwise as qmat_usd_scene_open. Free `meshes` with qmat_usd_meshes_uninit, also after a
 * failure. */
qmat_status qmat_usd_read_meshes(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *choice,
                                 size_t segments, qmat_scene *scene, qmat_usd_meshes *meshes, json_t *report);
void qmat_usd_meshes_uninit(qmat_usd_meshes *meshes);

#endif
