/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_VORONOI_DUAL_PARAMS_H
#define QMAT_NODES_INITIAL_VORONOI_DUAL_PARAMS_H

#include "core/node.h"

typedef enum { QMAT_INCENTRES_THIN, QMAT_INCENTRES_ALL } qmat_incentre_rule;
typedef enum { QMAT_RADIUS_DISTANCE, QMAT_RADIUS_CIRCUMRADIUS } qmat_radius_rule;

/* The parameters of medial.delaunay. Those of medial.refine start with the same struct. */
typedef struct qmat_voronoi_dual_params {
  double theta;
  int incentres; /* a qmat_incentre_rule */
  int radius;    /* a qmat_radius_rule */
  double merge;
  double max_envelope_error;
  double thinning_tolerance;
} qmat_voronoi_dual_params;

extern const char *const qmat_incentre_choices[], *const qmat_radius_choices[];

/* The rows of these parameters in both nodes. */
#define QMAT_VORONOI_DUAL_PARAMS                                                                                      \
  {.name = "theta",                                                                                                   \
   .unit = "mean thickness",                                                                                          \
   .doc = "A sample is thin if the thickness there is at most this ratio of the mean",                                \
   .type = QMAT_PARAM_FLOAT,                                                                                          \
   .default_number = 0.5,                                                                                             \
   .min = 0,                                                                                                          \
   .max = 10,                                                                                                         \
   .offset = offsetof(qmat_voronoi_dual_params, theta)},                                                              \
      {.name = "incentres",                                                                                           \
       .unit = "",                                                                                                    \
       .doc = "Tetrahedra that may use their incentre: those with four thin samples (Algorithm 1), or all inside",    \
       .type = QMAT_PARAM_ENUM,                                                                                       \
       .default_number = QMAT_INCENTRES_ALL,                                                                          \
       .choices = qmat_incentre_choices,                                                                              \
       .offset = offsetof(qmat_voronoi_dual_params, incentres)},                                                      \
      {.name = "radius",                                                                                              \
       .unit = "",                                                                                                    \
       .doc = "The radius at a circumcentre: at most the distance to the surface, or the circumradius (the paper)",   \
       .type = QMAT_PARAM_ENUM,                                                                                       \
       .default_number = QMAT_RADIUS_DISTANCE,                                                                        \
       .choices = qmat_radius_choices,                                                                                \
       .offset = offsetof(qmat_voronoi_dual_params, radius)},                                                         \
      {.name = "merge",                                                                                               \
       .unit = "diagonal",                                                                                            \
       .doc = "Adjacent medial vertices become one if they are no farther apart than this; 0: only if they coincide", \
       .type = QMAT_PARAM_FLOAT,                                                                                      \
       .default_number = 2e-4,                                                                                        \
       .min = 0,                                                                                                      \
       .max = 0.01,                                                                                                   \
       .flags = QMAT_PARAM_RELATIVE,                                                                                  \
       .offset = offsetof(qmat_voronoi_dual_params, merge)},                                                          \
      {.name = "max_envelope_error",                                                                                  \
       .unit = "diagonal",                                                                                            \
       .doc = "Medial edges whose cones leave the solid by more than this are halved; 0: never",                      \
       .type = QMAT_PARAM_FLOAT,                                                                                      \
       .default_number = 0.0025,                                                                                      \
       .min = 0,                                                                                                      \
       .max = 1,                                                                                                      \
       .flags = QMAT_PARAM_RELATIVE,                                                                                  \
       .offset = offsetof(qmat_voronoi_dual_params, max_envelope_error)},                                             \
  {                                                                                                                   \
    .name = "thinning_tolerance", .unit = "diagonal",                                                                 \
    .doc =                                                                                                            \
        "A sample is left out of the triangulation if a kept one nearby faces the same way and both lie within "      \
        "this of each other's tangent plane; 0: all are triangulated",                                                \
    .type = QMAT_PARAM_FLOAT, .default_number = 5e-4, .min = 0, .max = 0.01, .flags = QMAT_PARAM_RELATIVE,            \
    .offset = offsetof(qmat_voronoi_dual_params, thinning_tolerance)                                                  \
  }

#endif
