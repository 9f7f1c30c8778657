/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_VORONOI_DUAL_H
#define QMAT_NODES_INITIAL_VORONOI_DUAL_H

#include "core/geometry/surface.h"
#include "core/node.h"

typedef enum { QMAT_COMPLETION_THIN, QMAT_COMPLETION_ALL } qmat_completion;
typedef enum { QMAT_RADIUS_DISTANCE, QMAT_RADIUS_CIRCUMRADIUS } qmat_radius_rule;

/* The parameters of medial.delaunay, which those of medial.refine start with. */
typedef struct qmat_dual_params {
  double theta;
  int completion; /* a qmat_completion */
  int radius;     /* a qmat_radius_rule */
  double merge;
  double protrusion;
  double detail;
} qmat_dual_params;

extern const char *const qmat_completion_choices[], *const qmat_radius_choices[];

/* The rows of the parameters that both nodes have. */
#define QMAT_DUAL_PARAMS                                                                                              \
  {.name = "theta",                                                                                                   \
   .unit = "mean thickness",                                                                                          \
   .doc = "A sample is thin when the thickness there is at most this ratio of the mean",                              \
   .type = QMAT_PARAM_FLOAT,                                                                                          \
   .default_number = 0.5,                                                                                             \
   .min = 0,                                                                                                          \
   .max = 10,                                                                                                         \
   .offset = offsetof(qmat_dual_params, theta)},                                                                      \
      {.name = "completion",                                                                                          \
       .unit = "",                                                                                                    \
       .doc = "Which tetrahedra may give their incentre: thin ones (Algorithm 1 as printed) or all inside the solid", \
       .type = QMAT_PARAM_ENUM,                                                                                       \
       .default_number = QMAT_COMPLETION_ALL,                                                                         \
       .choices = qmat_completion_choices,                                                                            \
       .offset = offsetof(qmat_dual_params, completion)},                                                             \
      {.name = "radius",                                                                                              \
       .unit = "",                                                                                                    \
       .doc =                                                                                                         \
           "The radius at a circumcentre: at most the distance to the surface, or the circumradius as in the paper",  \
       .type = QMAT_PARAM_ENUM,                                                                                       \
       .default_number = QMAT_RADIUS_DISTANCE,                                                                        \
       .choices = qmat_radius_choices,                                                                                \
       .offset = offsetof(qmat_dual_params, radius)},                                                                 \
      {.name = "merge",                                                                                               \
       .unit = "diagonal",                                                                                            \
       .doc = "Adjacent medial vertices no farther apart than this become one; 0: only those that coincide",          \
       .type = QMAT_PARAM_FLOAT,                                                                                      \
       .default_number = 2e-4,                                                                                        \
       .min = 0,                                                                                                      \
       .max = 0.01,                                                                                                   \
       .flags = QMAT_PARAM_RELATIVE,                                                                                  \
       .offset = offsetof(qmat_dual_params, merge)},                                                                  \
      {.name = "protrusion",                                                                                          \
       .unit = "diagonal",                                                                                            \
       .doc = "Medial edges whose cones leave the solid by more than this are halved; 0: never",                      \
       .type = QMAT_PARAM_FLOAT,                                                                                      \
       .default_number = 0.0025,                                                                                      \
       .min = 0,                                                                                                      \
       .max = 1,                                                                                                      \
       .flags = QMAT_PARAM_RELATIVE,                                                                                  \
       .offset = offsetof(qmat_dual_params, protrusion)},                                                             \
  {                                                                                                                   \
    .name = "detail", .unit = "diagonal",                                                                             \
    .doc =                                                                                                            \
        "A sample is not triangulated where one nearby stands for it: on the same side of the solid, and neither "    \
        "farther than this from the other's tangent plane; 0: all are triangulated",                                  \
    .type = QMAT_PARAM_FLOAT, .default_number = 5e-4, .min = 0, .max = 0.01, .flags = QMAT_PARAM_RELATIVE,            \
    .offset = offsetof(qmat_dual_params, detail)                                                                      \
  }

/* Makes the initial medial mesh, sealed: the dual of the Delaunay tetrahedra of the samples inside the solid (Algorithm
 * 1), without those that others nearby stand for (nodes/initial/sample_thinning.h). Thickness and samples fit the mesh
 * (qmat_thickness_check). `reaches` (one a sample, unit frame): no farther from a sample than this may be what stands
 * for it; NULL: the rule for all. `report` gets counts and is not sealed; NULL: none. On failure `*medial` is NULL,
 * else the caller releases it. QMAT_ERROR_GEOMETRY where no medial vertex lies inside, QMAT_ERROR_MEMORY,
 * QMAT_CANCELLED. All threads; the answer does not depend on their number. Cost: about 10 microseconds a sample. */
qmat_status qmat_medial_dual_make(qmat_context *context, const qmat_dual_params *params, const qmat_surface *surface,
                                  const qmat_field *thickness, const qmat_samples *samples, const double *reaches,
                                  qmat_medial **medial, qmat_report *report);

#endif
