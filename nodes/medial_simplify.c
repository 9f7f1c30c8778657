/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.simplify: edge collapses by slab quadratic error and stability ratio, with both errors bounded. */
#include <math.h>

#include "core/geometry/joint_weights.h"
#include "core/node.h"
#include "nodes/descriptor/epsilon.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/descriptor/medial_summary.h"
#include "nodes/simplify/decimation_resume.h"
#include "nodes/simplify/ordered_collapse.h"
#include "nodes/simplify/simplification.h"
#include "nodes/simplify/sphere_budget.h"
#include "nodes/simplify/starts.h"

typedef qmat_simplify_params medial_simplify_params;

/* Collapses that do not depend on epsilon: a single round, without fits. `*medial` is unsealed, in the unit frame. */
static qmat_status run_in_order(qmat_context *context, const medial_simplify_params *params,
                                const qmat_value *const inputs[], qmat_ordered_collapses *o, qmat_medial *medial,
                                qmat_simplify_figures *figures) {
  qmat_status status = qmat_ordered_collapses_run(context, params, inputs, o);
  if (status == QMAT_OK) status = qmat_decimation_extract(&o->decimation, medial);
  if (status != QMAT_OK) return status;
  const double bound = o->params.epsilon > 0 ? o->params.epsilon : QMAT_DEFAULT_EPSILON;
  const double tolerance = qmat_error_tolerance * bound, enough = qmat_least_reported * bound;
  const qmat_collapse_log *log = &o->decimation.log;
  qmat_medial_errors errors = {.surface_to_envelope = 0};
  status = qmat_medial_surface_bound_measure(context, o->surface, medial, o->constraints.points,
                                             o->constraints.surface_count, tolerance, enough, INFINITY, &errors);
  if (status == QMAT_OK)
    status = qmat_medial_envelope_bound_measure(context, o->surface, medial, tolerance, enough, &errors);
  *figures = (qmat_simplify_figures){.in_order = true,
                                     .wanted_spheres = (size_t)params->vertices,
                                     .initial_spheres = o->decimation.complex.vertex_count,
                                     .threshold = log->count > 0 ? log->errors[log->count - 1] : 0,
                                     .surface_to_envelope = errors.surface_to_envelope,
                                     .envelope_to_surface = errors.envelope_to_surface};
  qmat_simplify_figures_of(&o->decimation, figures);
  qmat_medial_errors_uninit(&errors);
  return status;
}

/* Makes the outputs of a result in the unit frame; `*medial` moves into them. */
static qmat_status make_outputs(qmat_context *context, const qmat_simplify_figures *figures, const qmat_mesh *mesh,
                                qmat_surface *surface, double epsilon, double deviation, qmat_medial **medial,
                                qmat_value *outputs[]) {
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = qmat_simplify_report(context, figures, *medial, surface, epsilon, deviation, report);
  if (status == QMAT_OK) {
    double *spheres = (*medial)->spheres;
    qmat_frame_spheres_to_model(qmat_surface_frame(surface), spheres, (*medial)->sphere_count, spheres);
    status = qmat_joints_of_spheres(context, mesh, *medial);
  }
  qmat_value *const values[] = {&(*medial)->base, report ? &report->base : NULL};
  *medial = NULL;
  return qmat_hand_over(context, status, values, 2, outputs);
}

/* Whether only the number of spheres is given, for the cost that bounds both errors. The others end at the number, as
 * in their papers. */
static bool searches_epsilon(const medial_simplify_params *params) {
  return params->vertices > 0 && params->epsilon == 0 && params->cost == QMAT_COST_SLAB;
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  medial_simplify_params own = *(const medial_simplify_params *)params;
  const double epsilon = own.epsilon;
  double deviation;
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  qmat_status status = qmat_simplify_leave_deviation(context, mesh, &own, &deviation);
  if (status != QMAT_OK) return status;
  if (qmat_simplify_in_order(&own)) {
    qmat_ordered_collapses o = {.surface = NULL};
    qmat_simplify_figures figures;
    qmat_medial *medial = qmat_medial_new();
    status = medial ? run_in_order(context, &own, inputs, &o, medial, &figures)
                    : qmat_fail_memory(context, "the medial mesh");
    if (status == QMAT_OK)
      status = make_outputs(context, &figures, mesh, o.surface, o.params.epsilon > 0 ? epsilon : 0, deviation, &medial,
                            outputs);
    qmat_value_release(medial ? &medial->base : NULL);
    qmat_ordered_collapses_uninit(&o);
    return status;
  }
  qmat_simplification s = {.context = context, .params = own};
  qmat_simplified best = {.fault = INFINITY};
  double kept = own.epsilon;
  status = qmat_simplification_prepare(&s, inputs);
  if (status == QMAT_OK)
    status = searches_epsilon(&own) ? qmat_simplification_run_to_count(&s, &best, &kept)
                                    : qmat_simplification_run_starts(&s, &own, &best);
  best.figures.wanted_spheres = (size_t)own.vertices;
  if (status == QMAT_OK)
    status = make_outputs(context, &best.figures, mesh, s.surface, kept > 0 ? kept + deviation : 0, deviation,
                          &best.medial, outputs);
  qmat_simplified_uninit(&best);
  qmat_simplification_uninit(&s);
  return status;
}

static const char *const exceed_rules[] = {"skip", "stop", "raise", NULL};
static const qmat_param params[] = {
    QMAT_LENGTH(qmat_simplify_params, epsilon, 0.01, 0, 1,
                "The largest distance between the surface and the envelope, either way; 0: no bound"),
    QMAT_INT(
        qmat_simplify_params, vertices, "spheres", 0, 0, 4294967294.0,
        "Stop at this number of medial spheres; 0: no such stop. With epsilon=0 and cost=slab the least error that "
        "allows the number is searched"),
    QMAT_ERROR_PARAM,
    QMAT_ENUM(
        qmat_simplify_params, on_exceed, exceed_rules, QMAT_EXCEED_SKIP,
        "Skip collapses that would exceed epsilon, stop at the first as in the paper, or raise the threshold up to it"),
    QMAT_COLLAPSE_PARAMS,
    QMAT_INT(
        qmat_simplify_params, refits, "passes", 8, 0, 1000,
        "Passes that fit spheres to the surface when no edge can collapse, to make room for more collapses; 0: spheres "
        "are never fitted or repaired"),
    QMAT_INT(qmat_simplify_params, effort, "starts", 1, 1, 1000,
             "The number of different starts; they run side by side on all threads, and the best result is kept"),
    {0},
};

static const qmat_port inputs[] = {QMAT_SIMPLIFY_INPUTS, {0}};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The simplified medial mesh"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts of spheres and collapses, both errors, and the topology"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, NULL};

const qmat_node qmat_node_medial_simplify = {
    .name = "medial.simplify",
    .version = 53,
    .summary = "Collapses medial edges, cheapest first, while surface and envelope stay within epsilon of each other",
    .doc =
        "The cost of a collapse is the slab quadratic error of the merged sphere times the squared stability ratio of "
        "the edge. A collapse is done when its sphere lies inside the model and both errors stay within epsilon: "
        "surface to envelope at constraint points, and the envelope of spheres, cones and slabs to the surface. "
        "Interior points must stay covered. With error=one_sided or epsilon=0 the midpoints of its edges have to lie "
        "inside the model too; otherwise only in the first, dense collapse, and there not those of edges much thinner "
        "than epsilon.\n\n"
        "When no edge is left, spheres are fitted to the surface and edges tried again. Branch and bound then finds "
        "places beyond epsilon between the constraint points, and the collapses are repeated with these. Uncovered "
        "interior is filled with extra spheres. Spheres of radius zero are sharp features and stay on their creases. "
        "The deviation of a subdivision surface (mesh.subdivide) is subtracted from epsilon. Of a skinned mesh each "
        "sphere gets the mean joints and weights of the surface that it answers for.\n\n"
        "With vertices and epsilon=0 it is run at several epsilons, until the least one that leaves at most that "
        "number is known to 4 %; it is at least finest. medial.refine with epsilon=0 refines for the default of "
        "finest.\n\n"
        "With on_exceed=stop or raise the threshold of both errors starts at finest and rises to epsilon; collapses do "
        "not depend on epsilon, no sphere is fitted, and medial.chain records them. cost=hausdorff keeps the end of "
        "the edge that leaves the surface nearest to the envelope; cost=pmat keeps the larger end. compat=qmat follows "
        "the public Q-MAT code: its boundary terms, free topology, no inside test and no bound.",
    .citation = "Sections 3.1.2, 3.3 and 3.4, eq. 1-6 and 9-12",
    .params_size = sizeof(medial_simplify_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .report_summary = &qmat_medial_summary,
    .libraries = libraries,
    .effort = 45,
    .run = run,
};
