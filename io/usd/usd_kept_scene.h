/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_KEPT_SCENE_H
#define QMAT_IO_USD_USD_KEPT_SCENE_H

#include "core/value.h"
#include "io/usd/usd_stage.h"

/* A scene that was kept (io/usd/usd_keep.h), composed again for the layer that is written over it. A zeroed one is
 * empty and valid. */
typedef struct qmat_usd_kept_scene {
  qmat_usd_stage *stage;
  qmat_writer package;  /* what the stage reads */
  size_t depth;         /* of the prim that was asked for last */
  qmat_usd_prim *prims; /* from the root to that prim */
  qmat_arena arena;
} qmat_usd_kept_scene;

/* What the scene says of a prim. */
typedef struct qmat_usd_kept_prim {
  size_t medial_count;
  const char *const *medials;   /* medial_count: names of children that are active medial meshes of earlier runs */
  const qmat_usd_spec *variant; /* that the prim's shape comes from; NULL: from none */
  bool is_animated;             /* the transform of the prim, or of one above it, changes over time */
} qmat_usd_kept_prim;

/* Opens the scene in `part`, which must outlive it: a package, or a layer that needs no other file. Files beside it are
 * not opened. `context` records the errors of all later calls. Close it also after a failure. QMAT_ERROR_FORMAT,
 * QMAT_ERROR_MEMORY. Cost: the bytes. */
qmat_status qmat_usd_kept_scene_open(qmat_context *context, const qmat_file_part *part, qmat_usd_kept_scene *kept);
void qmat_usd_kept_scene_close(qmat_usd_kept_scene *kept);

/* Finds what the scene says of the prim at an absolute path: nothing where there is no such prim. What `*kept_prim`
 * points to lasts until `kept` is closed. QMAT_ERROR_FORMAT, QMAT_ERROR_MEMORY, QMAT_CANCELLED. Cost: composes the
 * prim's children, and the prims on the way that the call before did not have. */
qmat_status qmat_usd_kept_scene_find(qmat_usd_kept_scene *kept, const char *path, qmat_usd_kept_prim *kept_prim);

/* Whether a prim of the layers that were read so far has a name that begins with `stem`. */
bool qmat_usd_kept_scene_has_stem(const qmat_usd_kept_scene *kept, const char *stem);

#endif
