/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_WRITE_H
#define QMAT_IO_USD_USD_WRITE_H

#include "io/stored_medial.h"

/* How to write, and what is known of the medial mesh. */
typedef struct qmat_usd_options {
  bool package;               /* one .usdz that holds the layer; else a .usda */
  const char *name;           /* of the model, UTF-8; NULL or "": none */
  double meters_per_unit;     /* 0: not known, written as 1 */
  bool is_z_up;               /* else y is up */
  double moved;               /* how far single precision may move the solid, model units; above zero */
  qmat_stated_errors errors;  /* of the medial mesh as it is given */
  qmat_stated_errors *stated; /* gets the errors that the file states; NULL: not wanted */
} qmat_usd_options;

/* Makes a USD layer in text of a medial mesh: one Xform, the default prim, with
 *  - "skin", a Mesh without subdivision, where there is one (NULL or no triangles: none);
 *  - "spheres", Points with widths (diameters) and primvars:radius;
 *  - "cones", BasisCurves: a line of two points for each edge, with widths, primvars:radius and the spheres that they
 *    are, primvars:qmat:sphere; where there are edges;
 *  - "slabs", a Mesh of the triangles over all spheres with primvars:radius; where there are triangles;
 * the last three of purpose "guide", so that renderers show the skin. The customData of the Xform are those that
 * io/gltf/gltf_write.h puts into extras, without the blob; qmat_quantisation is the largest |dc| + |dr| that writing
 * single precision moved a sphere by.
 * Where single precision would move the solid by more than a quarter of options->moved, all points count from the
 * origin that qmat_storage_origin chooses: the Xform has an xformOp:translate in double precision, and customData has
 * qmat_origin_x, _y and _z.
 * `*file` is sealed, has one part, and is released by the caller; NULL on failure. QMAT_ERROR_GEOMETRY for an empty
 * medial mesh or coordinates beyond single precision, QMAT_ERROR_MEMORY. One thread; the same bytes for the same input.
 * Cost: linear. */
qmat_status qmat_usd_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                           const qmat_usd_options *options, qmat_file **file);

#endif
