/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_PAGE_DATA_H
#define QMAT_NODES_PAGE_PAGE_DATA_H

#include "nodes/page/shown.h"

/* What a page shows of one mesh, as JSON for io/page/page.js. Arrays are texts of io/page/page_array.h, medial meshes
 * are qmat_flat (examples/readers/FORMAT.md) as such arrays; all is in the unit frame.
 *
 *   surface  {vertices, triangles, positions: int16 x3 (32767 is 1), normals: int8 x3 (127 is 1), errors: int16
 *            (32767 is 4 ranges), corners: uint32 x3 a triangle}
 *   medial   qmat_flat in single precision, with counts beside it
 *   worst    {surface: [x, y, z, error] or null, envelope: the same}
 *   report   the report of the errors, or null
 *   chain    {medial, spheres, ends: uint32 x2, merged: float32 x4, errors: float32, bounds: rows of spheres,
 *            surface to envelope, envelope to surface} or null
 *
 * `report` and `chain` may be NULL. The chain starts at the level with at most `levels` spheres. NULL with the error
 * recorded: QMAT_ERROR_GEOMETRY names the input, QMAT_ERROR_MEMORY, QMAT_CANCELLED. The caller calls json_decref. All
 * threads; the result does not depend on their number. */
json_t *qmat_page_data(qmat_context *context, const qmat_shown *shown, const qmat_report *report,
                       const qmat_chain *chain, size_t levels);

#endif
