/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_LOOK_H
#define QMAT_NODES_PAGE_LOOK_H

#include <stdbool.h>
#include <stddef.h>

#include <jansson.h>

/* How models look: camera, colours and light. Pictures and pages have the same look: io/page/page.js gets the colours
 * as JSON and computes camera and light with the same formulas. Lengths are in the unit frame. */

/* What a point of a picture belongs to. */
typedef enum qmat_look_kind { QMAT_LOOK_SPHERE, QMAT_LOOK_CONE, QMAT_LOOK_SLAB, QMAT_LOOK_KINDS } qmat_look_kind;

/* A camera that is directed at the origin, with a vertical field of view of 30 degrees. */
typedef struct qmat_camera {
  double right[3], up[3], towards[3]; /* orthonormal; `towards` points to the camera */
  double distance;                    /* from the origin */
} qmat_camera;

/* A camera at distance 0: the model is turned by `turn` degrees and seen from `tilt` degrees above the horizon. */
qmat_camera qmat_camera_of(double turn, double tilt, bool is_z_up);

/* Moves the camera back until `count` spheres, `stride` doubles apart (x y z, and the radius where the stride is 4),
 * are in a view of `aspect` = width / height with some margin. */
void qmat_camera_fit(qmat_camera *camera, const double *spheres, size_t count, size_t stride, double aspect);

/* The unit vector of a ray through (x, y) of the view: from -1 at the left and bottom to 1. */
void qmat_camera_ray(const qmat_camera *camera, double aspect, double x, double y, double direction[3]);

/* The colour (3 numbers from 0 to 1) of a primitive, of surface without errors, and of the surface at a signed error;
 * `range` (> 0) is where the colours end. */
void qmat_look_of_kind(qmat_look_kind kind, double colour[3]);
void qmat_look_of_surface(double colour[3]);
void qmat_look_of_error(double error, double range, double colour[3]);

/* Lights a colour. `normal` is a unit vector in the camera's axes (right, up, towards) that faces the camera. */
void qmat_look_shade(const double normal[3], double colour[3]);

/* The opacity of the surface where it covers a medial mesh: more where it turns away. `facing` = normal . towards. */
double qmat_look_glass(double facing);

/* The colours as JSON for pages; NULL when memory is short. The caller calls json_decref. */
json_t *qmat_look_json(void);

#endif
