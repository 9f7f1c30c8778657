/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_SUBDIVISION_OSD_H
#define QMAT_NODES_MESH_SUBDIVISION_OSD_H

#include "core/cage.h"
#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One level of a subdivision surface, its vertices pushed to the limit, and further points of the limit surface. Holes
 * are left out, and with the rule QMAT_BOUNDARY_NONE the faces at the border. */
typedef struct qmat_limit_level {
  size_t face_count, face_size, face_stride;
  /* face_stride ids per face: its face_size (4; by Loop's scheme 3) corners, counter-clockwise as in the cage, the
   * limits of the middles of the edges behind them, and of four-sided faces that of the centre. */
  uint32_t *faces;
  size_t position_count;
  double *positions; /* 3 * position_count: points of the limit surface */
  double unresolved; /* at most so far these may be from it, since edges are still semi-sharp at that depth; 0: none */
  size_t creases_without_edge; /* creases of the cage that join no neighbours: they have no effect */
} qmat_limit_level;

/* Subdivides a cage of one surface, whose scheme is not none, by OpenSubdiv: `level` >= 0 times for the faces, `depth`
 * > level times, 15 at most, for the limits. Every vertex of the cage belongs to a face; faces have three corners at
 * least, by Loop's scheme three, none of them twice. `limit` gets new arrays (qmat_limit_level_uninit); on failure it
 * is empty. QMAT_ERROR_MEMORY; QMAT_ERROR_GEOMETRY with OpenSubdiv's text where it takes the cage for no surface. One
 * thread, deterministic. Time and memory grow with the faces at that depth: about 1 microsecond and 300 bytes each. */
qmat_status qmat_limit_level_make(qmat_context *context, const qmat_cage *cage, int level, int depth,
                                  qmat_limit_level *limit);

/* The version of OpenSubdiv that the program was built with: "3.5.0". */
const char *qmat_opensubdiv_version(void);

/* Frees the arrays; the level is empty. */
void qmat_limit_level_uninit(qmat_limit_level *limit);

#ifdef __cplusplus
}
#endif

#endif
