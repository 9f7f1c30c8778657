/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_VORONOI_DUAL_H
#define QMAT_NODES_INITIAL_VORONOI_DUAL_H

#include "core/geometry/surface.h"
#include "nodes/initial/voronoi_dual_params.h"

/* Makes the initial medial mesh, sealed: the sheets of the mesh, then the dual of the Delaunay tetrahedra inside its
 * solids (Algorithm 1). Samples that others nearby represent are not triangulated (nodes/initial/sample_thinning.h).
 * `solids` is made of the mesh by qmat_surface_new_of_solids; NULL: it has sheets only. `thickness` and `samples` must
 * fit the mesh (qmat_thickness_check). `reaches` (one per sample, unit frame) bounds the distance between a sample and
 * its representative; NULL: no further bound. `report` gets counts and is not sealed; NULL: none. The caller releases
 * `*medial`; it is NULL on failure. QMAT_ERROR_GEOMETRY if no medial vertex is inside, QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. All threads; the result does not depend on their number. Cost: about 10 microseconds per sample. */
qmat_status qmat_voronoi_dual_make(qmat_context *context, const qmat_voronoi_dual_params *params, const qmat_mesh *mesh,
                                   const qmat_surface *solids, const qmat_field *thickness, const qmat_samples *samples,
                                   const double *reaches, qmat_medial **medial, qmat_report *report);

#endif
