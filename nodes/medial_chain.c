/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.chain: records every collapse of one run, for medial meshes of any number of spheres or any error. */
#include <string.h>

#include "core/json_text.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/simplify/chain_bounds.h"
#include "nodes/simplify/collapse_chain.h"
#include "nodes/simplify/ordered_collapse.h"

typedef struct medial_chain_params {
  qmat_simplify_params simplify; /* first: the macros of its parameters say so */
  int64_t bounds;
} medial_chain_params;

static void *copy_of(const void *array, size_t count, size_t size) {
  void *copy = qmat_alloc(count, size);
  if (copy && count) memcpy(copy, array, count * size);
  return copy;
}

static qmat_status fill_chain(qmat_context *context, const qmat_ordered_collapses *o, double deviation,
                              const qmat_medial *medial, qmat_chain *chain) {
  const qmat_collapse_log *log = &o->decimation.log;
  const qmat_frame *frame = qmat_surface_frame(o->surface);
  chain->spheres = qmat_alloc(medial->sphere_count, 4 * sizeof *chain->spheres);
  chain->edges = copy_of(medial->edges, medial->edge_count, 2 * sizeof *chain->edges);
  chain->triangles = copy_of(medial->triangles, medial->triangle_count, 3 * sizeof *chain->triangles);
  chain->owners = copy_of(log->owners, o->constraints.sample_count, sizeof *chain->owners);
  chain->ends = copy_of(log->ends, log->count, 2 * sizeof *chain->ends);
  chain->merged = qmat_alloc(log->count, 4 * sizeof *chain->merged);
  chain->errors = copy_of(log->errors, log->count, sizeof *chain->errors);
  if (!chain->spheres || !chain->edges || !chain->triangles || !chain->owners || !chain->ends || !chain->merged ||
      !chain->errors)
    return qmat_fail_memory(context, "the chain");
  chain->sphere_count = medial->sphere_count;
  chain->edge_count = medial->edge_count;
  chain->triangle_count = medial->triangle_count;
  chain->sheet_sphere_count = medial->sheet_sphere_count;
  chain->sample_count = o->constraints.sample_count;
  chain->collapse_count = log->count;
  chain->meters_per_diagonal = qmat_surface_mesh(o->surface)->meters_per_unit * frame->diagonal;
  /* medial.lod compares these errors with epsilon; medial.simplify subtracts the deviation from epsilon instead. */
  for (size_t i = 0; i < log->count; i++) chain->errors[i] += qmat_constraint_share * deviation;
  /* Mapped from the unit frame as in medial.simplify, for the same bytes. */
  qmat_frame_spheres_to_model(frame, o->initial.spheres, medial->sphere_count, chain->spheres);
  qmat_frame_spheres_to_model(frame, log->merged, log->count, chain->merged);
  return QMAT_OK;
}

/* The number of spheres at a few errors. */
static qmat_status fill_report(qmat_context *context, const qmat_chain *chain, qmat_report *report) {
  static const struct {
    const char *key;
    double epsilon;
  } levels[] = {{"spheres_at_0.25%", 0.0025},
                {"spheres_at_0.5%", 0.005},
                {"spheres_at_1%", 0.01},
                {"spheres_at_2%", 0.02},
                {"spheres_at_4%", 0.04}};
  int bad = qmat_json_set_count(report->root, "initial_spheres", chain->sphere_count);
  bad |= qmat_json_set_count(report->root, "collapses", chain->collapse_count);
  for (size_t i = 0; i < sizeof levels / sizeof *levels; i++)
    bad |= qmat_json_set_count(report->root, levels[i].key,
                               chain->sphere_count - qmat_chain_length(chain, 0, levels[i].epsilon));
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const medial_chain_params *given = data;
  qmat_simplify_params params = given->simplify;
  qmat_ordered_collapses o = {.surface = NULL};
  qmat_chain *chain = qmat_chain_new();
  qmat_report *report = qmat_report_new();
  params.on_exceed += QMAT_EXCEED_STOP; /* the choices of this node start at stop */
  qmat_status status = chain && report ? QMAT_OK : qmat_fail_memory(context, "the chain");
  double deviation = 0;
  if (status == QMAT_OK)
    status = qmat_simplify_leave_deviation(context, (const qmat_mesh *)inputs[0], &params, &deviation);
  if (status == QMAT_OK) status = qmat_ordered_collapses_run(context, &params, inputs, &o);
  if (status == QMAT_OK) status = fill_chain(context, &o, deviation, (const qmat_medial *)inputs[3], chain);
  if (status == QMAT_OK && given->bounds > 0)
    status = qmat_chain_set_bounds(context, o.surface, (size_t)given->bounds, params.finest, deviation, chain);
  if (status == QMAT_OK) status = fill_report(context, chain, report);
  qmat_ordered_collapses_uninit(&o);
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)chain, (qmat_value *)report}, 2, outputs);
}

static const char *const exceed_choices[] = {"stop", "raise", NULL};

static const qmat_param params[] = {
    QMAT_ERROR_PARAM,
    QMAT_ENUM(qmat_simplify_params, on_exceed, exceed_choices, QMAT_EXCEED_RAISE - QMAT_EXCEED_STOP,
              "When the threshold rises: for the cheapest collapse that exceeds it (as in the paper), or when no other "
              "is left"),
    QMAT_COLLAPSE_PARAMS,
    QMAT_INT(medial_chain_params, bounds, "spheres", 0, 0, 1000000,
             "Prove bounds of both errors for levels of up to this many spheres, and no finer than the first level "
             "within `finest`: every level up to 32, above four in each doubling; 0: none"),
    {0},
};

static const qmat_port inputs[] = {QMAT_SIMPLIFY_INPUTS, {0}};

static const qmat_port outputs[] = {
    {.name = "chain", .type = QMAT_CHAIN, .doc = "The initial medial mesh and its collapses, for medial.lod"},
    {.name = "report", .type = QMAT_REPORT, .doc = "The number of spheres at a few errors"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, NULL};

const qmat_node qmat_node_medial_chain = {
    .name = "medial.chain",
    .version = 17,
    .summary = "Collapses all medial edges and records the collapses, for any level of detail",
    .doc =
        "Collapses as medial.simplify does with on_exceed=raise or stop and without a bound, until no edge is left. "
        "For each collapse it records the edge, the merged sphere and the threshold of both errors, which starts at "
        "finest.\n\n"
        "medial.lod extracts medial meshes of any number of spheres or any error from the chain in milliseconds. They "
        "are the ones that medial.simplify makes with that bound.\n\n"
        "With compat=qmat no threshold applies; the recorded errors are those that would have been needed. With "
        "error=one_sided they are surface-to-envelope errors.\n\n"
        "These errors hold at constraint points. With `bounds` both errors of some levels are proved between them, "
        "too, as medial.evaluate does.",
    .citation = "Sections 3.1.2, 3.3 and 3.4, eq. 1-6 and 9-12",
    .params_size = sizeof(medial_chain_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 60,
    .run = run,
};
