/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_SHOWN_H
#define QMAT_NODES_PAGE_SHOWN_H

#include "core/node.h"
#include "nodes/page/display_mesh.h"

/* The first inputs of nodes that show models, and the choices of their parameter `up`. */
enum { QMAT_SHOWN_SCENE, QMAT_SHOWN_MESH, QMAT_SHOWN_MEDIAL, QMAT_SHOWN_REPORT, QMAT_SHOWN_CHAIN };
extern const char *const qmat_up_axes[];
#define QMAT_SHOWN_PARAMS(params)                                                                        \
  QMAT_ENUM(params, up, qmat_up_axes, 0, "The axis that points up; auto: as the scene says, z for STL"), \
      QMAT_FLOAT(params, turn, "degrees", 30, -360, 360, "How far the camera goes around the model"),    \
      QMAT_FLOAT(params, tilt, "degrees", 20, -90, 90, "How far the camera is above the horizon")
#define QMAT_SHOWN_INPUTS                                                                                  \
  {.name = "scene",                                                                                        \
   .type = QMAT_SCENE,                                                                                     \
   .optional = true,                                                                                       \
   .doc = "The scene that the model was read from: its name and up axis"},                                 \
      {.name = "mesh", .type = QMAT_MESH, .doc = "The surface, or each surface of a scene", .list = true}, \
      {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh of each", .list = true}, {           \
    .name = "report", .type = QMAT_REPORT, .optional = true,                                               \
    .doc = "Epsilon, the errors and the topology, from medial.evaluate", .list = true                      \
  }

/* A surface and its medial mesh, ready to be drawn, in the unit frame of the surface. */
typedef struct qmat_shown {
  const qmat_mesh *mesh;
  const qmat_medial *medial;
  qmat_frame frame;
  qmat_medial unit; /* the medial mesh in the unit frame; its spheres are in the context's arena */
  qmat_envelope *envelope;
  qmat_display_mesh display;
  double range; /* > 0: the error at which colours end; epsilon of the report, else the largest error of a vertex */
} qmat_shown;

/* Prepares `shown`, whose arguments have to live as long; `report` (medial.evaluate's or medial.simplify's) may be
 * NULL. QMAT_ERROR_GEOMETRY names the input: a mesh without extent, a medial mesh without spheres or far from the mesh.
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. Free it with qmat_shown_uninit, also after a failure. All threads; the result does
 * not depend on their number. */
qmat_status qmat_shown_init(qmat_context *context, const qmat_mesh *mesh, const qmat_medial *medial,
                            const qmat_report *report, qmat_shown *shown);
void qmat_shown_uninit(qmat_shown *shown);

/* A number of a report; NAN where there is none. `report` may be NULL. */
double qmat_shown_number(const qmat_report *report, const char *key);

/* Whether z is up: by the choice `up`, else where the scene (may be NULL) says so, and for STL. */
bool qmat_shown_is_z_up(int up, const qmat_scene *scene);

/* An input's value for one mesh; NULL where there is none or it is a failure. `value` may be NULL. */
const qmat_value *qmat_shown_given(const qmat_value *value, size_t index);

/* For qmat_node.check_counts: all lists of the inputs above are as long as that of medial meshes. */
qmat_status qmat_shown_check_counts(qmat_context *context, const qmat_port *inputs, const size_t counts[]);

#endif
