/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_SUBDIVISION_OSD_H
#define QMAT_NODES_MESH_SUBDIVISION_OSD_H

#include "core/cage.h"
#include "core/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One level of a subdivision surface with its vertices on the limit surface, and further points of the limit surface.
 * Holes are left out; the rule QMAT_BOUNDARY_NONE also leaves out the faces at the border. */
typedef struct qmat_limit_level {
  size_t face_count, face_size, face_stride;
  /* face_stride ids per face: face_size corners (4, or 3 by Loop's scheme), counter-clockwise as in the cage, the
   * limits of the midpoints of the edges that start there, and for quads the limit of the centre. At level 0 a polygon
   * of another size than 4 is a fan of triangles about the limit of its centre, which is the third and fourth corner.
   */
  uint32_t *faces;
  size_t position_count;
  double *positions; /* 3 * position_count: points of the limit surface */
  double unresolved; /* a bound of the points' error from edges that are still semi-sharp at that depth; 0: none */
  size_t creases_without_edge; /* creases that are not edges of the cage; they have no effect */
} qmat_limit_level;

/* Subdivides a cage of one surface, whose scheme is not none, by OpenSubdiv: `level` >= 0 times for the faces, and
 * `depth` times (level < depth <= 15) for the limits. Every vertex of the cage belongs to a face. Faces have at least
 * three distinct corners, exactly three by Loop's scheme. `limit` gets new arrays (qmat_limit_level_uninit); on failure
 * it is empty. QMAT_ERROR_MEMORY; QMAT_ERROR_GEOMETRY with OpenSubdiv's message if it rejects the cage. One thread,
 * deterministic. Cost: about 1 microsecond and 300 bytes per face at that depth. */
qmat_status qmat_limit_level_make(qmat_context *context, const qmat_cage *cage, int level, int depth,
                                  qmat_limit_level *limit);

/* The version of OpenSubdiv that the program was built with: "3.5.0". */
const char *qmat_opensubdiv_version(void);

/* Frees the arrays and empties the level. */
void qmat_limit_level_uninit(qmat_limit_level *limit);

#ifdef __cplusplus
}
#endif

#endif
