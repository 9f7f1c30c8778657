/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_SIMPLIFY_SETUP_H
#define QMAT_NODES_SIMPLIFY_SIMPLIFY_SETUP_H

#include "core/node.h"
#include "nodes/descriptor/epsilon.h"
#include "nodes/descriptor/sampled_solid.h"
#include "nodes/simplify/decimation.h"

typedef enum { QMAT_COMPAT_OFF, QMAT_COMPAT_QMAT } qmat_compatibility;

/* The parameters of medial.simplify. medial.chain has those that affect which collapses are done or their order; the
 * others are 0 there. */
typedef struct qmat_simplify_params {
  double epsilon;   /* in diagonals; 0: no bound */
  int64_t vertices; /* 0: no such stop */
  double most_cost; /* 0: no limit */
  int cost;         /* a qmat_cost_kind */
  int compat;       /* a qmat_compatibility */
  int error;        /* a qmat_error_kind */
  int on_exceed;    /* a qmat_exceed_rule */
  int topology;     /* a qmat_topology_policy */
  int protect;      /* a qmat_protection */
  int features;     /* a qmat_feature_rule */
  double finest;    /* in diagonals, as epsilon */
  double crease;    /* a share of the threshold */
  double theta;     /* in mean thicknesses */
  double k;         /* of eq. 6 */
  int64_t refits;   /* passes; 0: spheres are never fitted or repaired */
  int64_t effort;   /* starts */
} qmat_simplify_params;

extern const char *const qmat_error_choices[], *const qmat_cost_choices[], *const qmat_compat_choices[],
                                                                               *const qmat_topology_choices[],
                                                                                   *const qmat_protect_choices[],
                                                                                       *const qmat_feature_choices[];

/* The rows of the parameters that both nodes have. */
#define QMAT_ERROR_PARAM                                                           \
  QMAT_ENUM(qmat_simplify_params, error, qmat_error_choices, QMAT_ERROR_TWO_SIDED, \
            "The errors that are bounded: both, or surface to envelope only as in the paper")
#define QMAT_COLLAPSE_PARAMS                                                                                          \
  QMAT_ENUM(qmat_simplify_params, cost, qmat_cost_choices, QMAT_COST_SLAB,                                            \
            "The order of collapses: least slab error (eq. 6), least distance to the surface (HEM), or least ratio "  \
            "of length to difference of radii (PMAT)"),                                                               \
      QMAT_LENGTH(                                                                                                    \
          qmat_simplify_params, finest, QMAT_FINEST_EPSILON, 1e-5, 1,                                                 \
          "The first threshold of both errors where it rises (on_exceed=stop, raise); a finer one takes longer"),     \
      QMAT_FLOAT(qmat_simplify_params, most_cost, "1", 0, 0, 1e9,                                                     \
                 "Stop when the cheapest collapse costs more than this; 0: no limit"),                                \
      QMAT_ENUM(qmat_simplify_params, compat, qmat_compat_choices, QMAT_COMPAT_OFF,                                   \
                "Collapse as the public Q-MAT code does: sets cost, k, topology, protect, features and on_exceed, "   \
                "and in medial.simplify epsilon; there `vertices` stops it"),                                         \
      QMAT_ENUM(qmat_simplify_params, topology, qmat_topology_choices, QMAT_TOPOLOGY_GUARD,                           \
                "free: any collapse is allowed, as in the paper. guard: collapses are free, then the components, "    \
                "loops and voids of the result are corrected to those of the solid; the same as free where the "      \
                "threshold rises. preserve: every collapse keeps the homotopy type of the initial medial mesh"),      \
      QMAT_ENUM(                                                                                                      \
          qmat_simplify_params, protect, qmat_protect_choices, QMAT_PROTECT_OFF,                                      \
          "Keep thin tubular features at any cost: never, at the late stage, or from the start. While it is off, "    \
          "theta and the thickness have no effect"),                                                                  \
      QMAT_ENUM(                                                                                                      \
          qmat_simplify_params, features, qmat_feature_choices, QMAT_FEATURES_SHARP,                                  \
          "Spheres of radius zero, as medial.features makes them, collapse like others, or stay on their creases. "   \
          "auto: both are tried, and the better result counts; the same as sharp where the threshold rises"),         \
      QMAT_FLOAT(qmat_simplify_params, crease, "epsilon", 0.25, 0.01, 1,                                              \
                 "The largest distance of a crease from its remaining points, as a share of the threshold"),          \
      QMAT_FLOAT(qmat_simplify_params, theta, "mean thickness", 0.5, 0, 10,                                           \
                 "A feature is thin when all of its responsible region is at most this thick, relative to the mean"), \
      QMAT_FLOAT(qmat_simplify_params, k, "1", 1e-5, 0, 1, "The constant of the collapse cost (eq. 6)")

/* The inputs of both nodes. */
#define QMAT_SIMPLIFY_INPUTS                                                \
  QMAT_SAMPLED_SOLID_INPUTS, {                                              \
    .name = "medial", .type = QMAT_MEDIAL, .doc = "The initial medial mesh" \
  }

/* The initial medial mesh in the unit frame, in the context's arena. */
typedef struct qmat_initial_medial {
  size_t count;    /* of spheres */
  double *spheres; /* 4 per sphere */
  double *depths;  /* per sphere: of its centre, negative outside */
  uint8_t *thin;   /* per sample: whether it lies on a thin feature; NULL without protection */
} qmat_initial_medial;

/* Subtracts the mesh's deviation, `*deviation` in diagonals, from `params->epsilon`. QMAT_ERROR_GEOMETRY if
 * epsilon is not larger. */
qmat_status qmat_simplify_leave_deviation(qmat_context *context, const qmat_mesh *mesh, qmat_simplify_params *params,
                                          double *deviation);

/* Reads the inputs of both nodes (QMAT_SIMPLIFY_INPUTS, in that order). `*surface` is new, also after some
 * failures; the caller frees it. QMAT_ERROR_GEOMETRY names inputs that do not belong together;
 * QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads. */
qmat_status qmat_simplify_prepare(qmat_context *context, const qmat_simplify_params *params,
                                  const qmat_value *const inputs[], qmat_surface **surface,
                                  qmat_initial_medial *initial);

/* The rules for the parameters, and for a start with `seed` (0: costs as they are). */
qmat_decimation_rules qmat_simplify_rules(const qmat_simplify_params *params, const qmat_initial_medial *initial,
                                          uint64_t seed);

/* With compat=qmat, sets the other parameters as the public Q-MAT code has them. */
void qmat_simplify_apply_compatibility(qmat_simplify_params *params);

/* Whether the parameters select collapses that do not depend on epsilon. */
bool qmat_simplify_in_order(const qmat_simplify_params *params);

#endif
