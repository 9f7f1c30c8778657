/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_SCENE_H
#define QMAT_IO_USD_USD_SCENE_H

#include "io/bytes.h"
#include "io/soup.h"

/* Reads a scene of USD (.usda, .usdc, .usdz) and adds its surface to `soup` in world space, in the scene's own units:
 * the faces of every mesh that is defined, active, visible, of purpose "default" or "render" and not a class. If there
 * is none, prims that only have an "over" are read too. Transforms are applied in double precision, in the order of
 * xformOpOrder, with every operation, !invert! and !resetXformStack!. Left-handed meshes and mirroring transforms
 * reverse the faces. Faces that are holes are skipped. Subdivision surfaces are read as their control cages; if there
 * are any, soup->cage has every mesh with its scheme, boundary rule, holes, creases and corners. io/usd/usd_stage.h
 * describes what is composed and what is skipped.
 *
 * `report` (a JSON object, may be NULL) gains the whole numbers layers_read, prims_read, meshes_placed, cages
 * (subdivision surfaces among these), holes (skipped faces), instances (prims marked as instanceable), prims_skipped
 * (inactive, invisible, or of another purpose) and shapes_skipped (geometry other than meshes); meters_per_unit (a
 * number); up_axis
 * ("Y" or "Z"); and warnings, an array of at most 101 texts "PATH: ..." about what was skipped or read differently.
 * QMAT_ERROR_FORMAT with file, line and column for what is not USD, and with the prim for a broken mesh: negative face
 * counts, face counts whose sum differs from the number of indices, indices out of range, values of the wrong type.
 * QMAT_ERROR_GEOMETRY when there is no mesh, or more copies than the files justify: 2^24 vertices and corners, and 16
 * for each byte. QMAT_ERROR_MEMORY. On failure the soup holds part of the model. One thread. Cost: linear in the files
 * and in the vertices placed. */
qmat_status qmat_usd_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup,
                          json_t *report);

#endif
