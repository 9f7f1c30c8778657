/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_FIGURE_H
#define QMAT_NODES_PAGE_FIGURE_H

#include "io/bytes.h"
#include "nodes/page/picture.h"

/* What stands under a picture. */
typedef struct qmat_caption {
  const char *name;             /* UTF-8; NULL: none */
  size_t spheres, cones, slabs; /* of all medial meshes */
  double range;                 /* where the colours of the error end, as a share of the diagonal; NAN: not the same
                                 * for all meshes */
  double error_out, error_in;   /* the errors, as shares of the diagonal; NAN: not known */
  bool has_errors, has_medial;  /* the colour bar, and the colours of the primitives, are explained */
} qmat_caption;

/* The picture as PNG and then as base64; the caller frees it with qmat_free. NULL with QMAT_ERROR_MEMORY recorded. */
char *qmat_figure_base64(qmat_context *context, const qmat_picture *picture);

/* Appends an SVG file: the picture's pixels, and under them the caption and the colour bar as text and shapes. An SVG
 * of the solids themselves would have a shape for every facet and could not intersect them: it would be larger than the
 * pixels and wrong where primitives cross. QMAT_ERROR_MEMORY. */
qmat_status qmat_figure_put(qmat_context *context, const qmat_picture *picture, const qmat_caption *caption,
                            qmat_writer *writer);

#endif
