/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_EXAMPLES_MODELS_H
#define QMAT_EXAMPLES_MODELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/status.h"

/* Generated models for the demo, the tests and first trials: closed triangle meshes at any resolution. Their solids,
 * and for most of them their medial axes, are known exactly. Of the library they use only the status codes and the
 * hash. The same call gives the same bytes on every machine with the same libm.
 *
 * Vertices lie on the ideal surface. A pseudo-random fraction of the spacing moves each along the surface, so that no
 * four vertices are cocircular unless the shape demands it. The box alone is a plain grid, with many cospherical
 * vertices. */
typedef struct qmat_model {
  const char *name; /* static text */

  /* The surface: closed, triangles counter-clockwise from outside, no unused vertex, no duplicate. */
  size_t vertex_count, triangle_count;
  double *positions;   /* 3 * vertex_count: x y z */
  uint32_t *triangles; /* 3 * triangle_count */
  int euler;           /* vertices - edges + triangles of the surface: 2, or 0 for the torus */
  double volume;       /* of the ideal solid; NAN where there is no closed form */
  double deviation;    /* bounds the distance of the mesh from the ideal surface; model units; 0: flat sides */

  /* The known part of the medial mesh; sphere_count is 0 where none is known. Each sphere lies in the ideal solid to
   * within medial_deviation and touches the surface. */
  size_t sphere_count, edge_count, medial_triangle_count;
  double *spheres;            /* 4 * sphere_count: x y z radius */
  uint32_t *edges;            /* 2 * edge_count, including the edges of triangles */
  uint32_t *medial_triangles; /* 3 * medial_triangle_count */
  bool medial_complete;       /* the whole medial axis is known, not a part */
  double medial_deviation;    /* model units */
} qmat_model;

/* The names that qmat_model_make accepts, in alphabetical order. */
typedef struct qmat_model_kind {
  const char *name;
  const char *summary;    /* one line */
  int default_resolution; /* of resolution 0 */
} qmat_model_kind;
extern const qmat_model_kind qmat_model_kinds[];
extern const size_t qmat_model_kind_count;

/* The bounds of `resolution`. */
enum { QMAT_MODEL_RESOLUTION_MIN = 4, QMAT_MODEL_RESOLUTION_MAX = 2000 };

/* Makes a model by name. `resolution` is about the number of edges around the thickest round part, or along the longest
 * flat side; 0 takes the model's default. The number of triangles grows with its square. Returns QMAT_ERROR_USAGE for
 * an unknown name or a resolution out of range, QMAT_ERROR_MEMORY; `model` is then empty. The caller calls
 * qmat_model_uninit. */
qmat_status qmat_model_make(const char *name, int resolution, qmat_model *model);

/* Frees the arrays and empties the model. Works on a zeroed and on a failed model. */
void qmat_model_uninit(qmat_model *model);

/* The same models with measures of the caller's. Statuses as above; measures that give no solid are QMAT_ERROR_USAGE.
 *
 * The convex hull of a ball of radius `start` at the origin and one of radius `end` at (length, 0, 0). Equal radii give
 * a capsule, length 0 with equal radii a sphere; otherwise |end - start| < length. */
qmat_status qmat_model_make_capsule(double start, double end, double length, int resolution, qmat_model *model);

/* A box of sides a >= b >= c around the origin, along x, y and z. */
qmat_status qmat_model_make_box(double a, double b, double c, int resolution, qmat_model *model);

/* A sheet of sides a >= b >= thickness, its long side bent around the y axis by `angle` radians, 0 (flat) to pi. The
 * middle surface keeps its length a. */
qmat_status qmat_model_make_sheet(double a, double b, double thickness, double angle, int resolution,
                                  qmat_model *model);

/* A torus around the z axis: the tube has radius `tube`, its centre line radius `ring` > tube. */
qmat_status qmat_model_make_torus(double ring, double tube, int resolution, qmat_model *model);

#endif
