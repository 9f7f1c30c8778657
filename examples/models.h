/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_EXAMPLES_MODELS_H
#define QMAT_EXAMPLES_MODELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/status.h"

/* Models that are made, not stored: closed triangle meshes at any resolution whose solids, and mostly whose medial
 * axes, are known exactly. For the demo, for tests of every floor, and for trying things out. They need nothing of the
 * library but its status codes. The same call gives the same bytes on every machine with the same libm.
 *
 * Vertices lie on the ideal surface, moved along it by a fixed pseudo-random part of the spacing, so that no four of
 * them are on a circle unless the shape makes them; only the box is a plain grid, full of cospherical vertices. */
typedef struct qmat_model {
  const char *name; /* static text */

  /* The surface: closed, every triangle counter-clockwise from outside, no vertex unused, none twice. */
  size_t vertex_count, triangle_count;
  double *positions;   /* 3 * vertex_count: x y z */
  uint32_t *triangles; /* 3 * triangle_count */
  int euler;           /* vertices - edges + triangles of the surface: 2, or 0 for the torus */
  double volume;       /* of the ideal solid; NAN where there is no closed form */
  double deviation;    /* no point of the mesh is farther from the ideal surface; model units; 0: flat sides */

  /* What is known of the medial mesh; sphere_count is 0 where nothing is. Each sphere lies in the ideal solid, to
   * within medial_deviation, and touches its surface. */
  size_t sphere_count, edge_count, medial_triangle_count;
  double *spheres;            /* 4 * sphere_count: x y z radius */
  uint32_t *edges;            /* 2 * edge_count, every edge of every triangle too */
  uint32_t *medial_triangles; /* 3 * medial_triangle_count */
  bool medial_complete;       /* these are the whole medial axis; else a part of it */
  double medial_deviation;    /* model units */
} qmat_model;

/* The names that qmat_model_make knows, in alphabetical order, and what each is. */
typedef struct qmat_model_kind {
  const char *name;
  const char *summary;    /* one line */
  int default_resolution; /* what 0 stands for */
} qmat_model_kind;
extern const qmat_model_kind qmat_model_kinds[];
extern const size_t qmat_model_kind_count;

/* The bounds of `resolution`. */
enum { QMAT_MODEL_RESOLUTION_MIN = 4, QMAT_MODEL_RESOLUTION_MAX = 2000 };

/* Makes the model of that name. `resolution` is about the number of triangle edges around the thickest round part, or
 * along the longest side of a shape with flat sides; 0 is the model's default. The triangle count grows with its
 * square. QMAT_ERROR_USAGE for an unknown name or a resolution out of range, QMAT_ERROR_MEMORY; `model` is then
 * empty. Free with qmat_model_uninit. */
qmat_status qmat_model_make(const char *name, int resolution, qmat_model *model);

/* Frees the arrays and empties the model. Works on a zeroed and on a failed model. */
void qmat_model_uninit(qmat_model *model);

/* The same models with their measures open; statuses as above, QMAT_ERROR_USAGE also for measures that give no solid.
 *
 * A ball of radius `start` at the origin and one of radius `end` at (length, 0, 0), and what they sweep in between:
 * length 0 is a sphere (the radii must then be equal), equal radii a capsule. |end - start| < length. */
qmat_status qmat_model_make_capsule(double start, double end, double length, int resolution, qmat_model *model);

/* A box of sides a >= b >= c around the origin, along x, y and z. */
qmat_status qmat_model_make_box(double a, double b, double c, int resolution, qmat_model *model);

/* A sheet of sides a >= b >= thickness whose long side is bent around the y axis by `angle` radians in all, so that
 * the middle of the sheet keeps its length a; 0 is flat. 0 <= angle <= pi. */
qmat_status qmat_model_make_sheet(double a, double b, double thickness, double angle, int resolution,
                                  qmat_model *model);

/* A ring around the z axis: a tube of radius `tube` whose middle line has the radius `ring` > tube. */
qmat_status qmat_model_make_torus(double ring, double tube, int resolution, qmat_model *model);

#endif
