/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_VORONOI_DUAL_PARAMS_H
#define QMAT_NODES_INITIAL_VORONOI_DUAL_PARAMS_H

#include "core/node.h"

typedef enum { QMAT_INCENTRES_THIN, QMAT_INCENTRES_ALL } qmat_incentre_rule;
typedef enum { QMAT_RADIUS_DISTANCE, QMAT_RADIUS_CIRCUMRADIUS } qmat_radius_rule;

/* Where epsilon is 0, vertices merge and samples are left out as for this one. */
#define QMAT_FINE_EPSILON 0.005

/* The parameters of medial.delaunay. Those of medial.refine start with the same struct. */
typedef struct qmat_voronoi_dual_params {
  double epsilon; /* each node has its own row for it */
  double theta;
  int incentres; /* a qmat_incentre_rule */
  int radius;    /* a qmat_radius_rule */
  double merge;  /* a share of epsilon */
  double max_envelope_error;
  double thinning_tolerance; /* a share of epsilon */
} qmat_voronoi_dual_params;

extern const char *const qmat_incentre_choices[], *const qmat_radius_choices[];

/* The rows of these parameters in both nodes. */
#define QMAT_VORONOI_DUAL_PARAMS                                                                                       \
  QMAT_FLOAT(qmat_voronoi_dual_params, theta, "mean thickness", 0.5, 0, 10,                                            \
             "A sample is thin if the thickness there is at most this ratio of the mean"),                             \
      QMAT_ENUM(qmat_voronoi_dual_params, incentres, qmat_incentre_choices, QMAT_INCENTRES_ALL,                        \
                "Tetrahedra that may use their incentre: those with four thin samples (Algorithm 1), or all inside"),  \
      QMAT_ENUM(qmat_voronoi_dual_params, radius, qmat_radius_choices, QMAT_RADIUS_DISTANCE,                           \
                "The radius at a circumcentre: at most the distance to the surface, or the circumradius (the paper)"), \
      QMAT_FLOAT(                                                                                                      \
          qmat_voronoi_dual_params, merge, "epsilon", 0.1, 0, 1,                                                       \
          "Adjacent medial vertices become one if they are no farther apart than this; 0: only if they coincide"),     \
      QMAT_LENGTH(qmat_voronoi_dual_params, max_envelope_error, 0.0025, 0, 1,                                          \
                  "Medial edges whose cones leave the solid by more than this are halved, or by more than epsilon "    \
                  "where their middle is outside; 0: never"),                                                          \
      QMAT_FLOAT(qmat_voronoi_dual_params, thinning_tolerance, "epsilon", 0.1, 0, 1,                                   \
                 "A sample is left out of the triangulation if a kept one nearby faces the same way and both lie "     \
                 "within this of each other's tangent plane; 0: all are triangulated")

#endif
