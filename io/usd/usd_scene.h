/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_SCENE_H
#define QMAT_IO_USD_USD_SCENE_H

#include "io/bytes.h"
#include "io/soup.h"

/* Reads a scene of USD (.usda, .usdc, .usdz) and adds its surface to `soup` in world space, in the scene's own units:
 * the faces of every mesh that is defined, active, visible, of purpose "default" or "render" and no class; where that
 * leaves none, also of those below an "over" that nothing defines. Transforms are applied in double precision, in the
 * order of xformOpOrder, with every operation, !invert! and !resetXformStack!; left-handed meshes and transforms that
 * mirror turn their faces round; faces that are holes are left out. The control cages of subdivision surfaces are taken
 * as they are; where there are some, soup->cage holds every mesh with its scheme, boundary rule, holes, creases and
 * corners. What the scene is composed of, and what of that is left out, says io/usd/usd_stage.h.
 *
 * `report` (a JSON object, may be NULL) gains
 *   layers_read, prims_read, meshes_placed, cages (of subdivision surfaces among them), holes (faces left out),
 *   instances (prims marked as instanceable), prims_skipped (inactive, invisible, or of another purpose),
 * shapes_skipped (geometry that is no mesh): whole numbers; meters_per_unit (a number); up_axis ("Y" or "Z"); warnings:
 * an array of texts "PATH: ...", at most 101, that say what was left out or taken otherwise than written.
 * QMAT_ERROR_FORMAT with file, line and column for what is not USD, and with the prim for a mesh that is broken: face
 * counts that are negative or add up to another number than there are indices, indices out of range, values of another
 * type than they have to be. QMAT_ERROR_GEOMETRY where no mesh is left, or for more copies than the files justify: 2^24
 * vertices and corners, and 16 for each byte. QMAT_ERROR_IO, QMAT_ERROR_MEMORY. On failure the soup holds part of the
 * model. One thread. Cost: linear in the files and in the vertices placed. */
qmat_status qmat_usd_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup,
                          json_t *report);

#endif
