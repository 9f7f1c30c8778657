/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_PICTURE_H
#define QMAT_NODES_PAGE_PICTURE_H

#include "nodes/page/shown.h"

typedef enum qmat_picture_view {
  QMAT_VIEW_BOTH,    /* side by side: the surface coloured by its error, and the medial mesh */
  QMAT_VIEW_SURFACE, /* the surface, coloured by its error */
  QMAT_VIEW_MEDIAL,  /* the medial mesh */
  QMAT_VIEW_OVERLAY  /* the medial mesh in a surface of glass */
} qmat_picture_view;

typedef struct qmat_picture_options {
  qmat_picture_view view;
  double turn, tilt; /* degrees, as in qmat_camera_of */
  bool is_z_up;
  double background[4]; /* red, green, blue and opacity, from 0 to 1 */
} qmat_picture_options;

/* An image: rows from the top, four bytes a pixel (red, green, blue, opacity; not premultiplied). */
typedef struct qmat_picture {
  size_t width, height;
  uint8_t *pixels;
} qmat_picture;

/* Allocates an image without colour: QMAT_ERROR_MEMORY. Free it with qmat_picture_uninit, also after a failure. */
qmat_status qmat_picture_init(qmat_context *context, size_t width, size_t height, qmat_picture *picture);
void qmat_picture_uninit(qmat_picture *picture);

/* Draws into the rectangle at (x, y), which has to lie in the picture: four rays a pixel, to the surface and to the
 * exact spheres, cones and slabs. QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY, QMAT_CANCELLED. All threads; the pixels do
 * not depend on their number. */
qmat_status qmat_picture_draw(qmat_context *context, const qmat_shown *shown, const qmat_picture_options *options,
                              size_t x, size_t y, size_t width, size_t height, qmat_picture *picture);

#endif
