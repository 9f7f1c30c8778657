/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.lod: extracts one level of detail from a chain of collapses. */
#include "core/json_text.h"
#include "core/node.h"
#include "nodes/simplify/collapse_chain.h"

typedef struct medial_lod_params {
  int64_t vertices;
  double epsilon;
} medial_lod_params;

static qmat_status fill_report(qmat_context *context, const medial_lod_params *params, const qmat_chain *chain,
                               size_t collapses, const qmat_medial *medial, qmat_report *report) {
  const qmat_json_count counts[] = {{"spheres", medial->sphere_count},
                                    {"edges", medial->edge_count},
                                    {"triangles", medial->triangle_count},
                                    {"collapses", collapses}};
  int bad = json_object_set_new(report->root, "epsilon", json_real(params->epsilon));
  bad |= json_object_set_new(report->root, "threshold", json_real(collapses > 0 ? chain->errors[collapses - 1] : 0));
  for (size_t i = 0; i < chain->bounded_count; i++) {
    if (chain->bounded[i] != collapses) continue;
    bad |= json_object_set_new(report->root, "surface_to_envelope", json_real(chain->bounds[2 * i]));
    bad |= json_object_set_new(report->root, "envelope_to_surface", json_real(chain->bounds[2 * i + 1]));
  }
  bad |= qmat_json_set_counts(report->root, counts, sizeof counts / sizeof *counts);
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const medial_lod_params *params = data;
  const qmat_chain *chain = (const qmat_chain *)inputs[0];
  if (chain->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the chain has no sphere");
    return qmat_fail_field(context, "chain");
  }
  qmat_medial *medial = qmat_medial_new();
  qmat_report *report = qmat_report_new();
  const size_t collapses = qmat_chain_length(chain, (size_t)params->vertices, params->epsilon);
  qmat_status status = medial && report ? QMAT_OK : qmat_fail_memory(context, "the medial mesh");
  if (status == QMAT_OK) status = qmat_chain_extract(context, chain, collapses, medial);
  if (status == QMAT_OK) status = fill_report(context, params, chain, collapses, medial, report);
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)medial, (qmat_value *)report}, 2, outputs);
}

static const qmat_param params[] = {
    QMAT_INT(medial_lod_params, vertices, "spheres", 0, 0, 4294967294.0,
             "Collapses stop at this number of medial spheres; 0: never"),
    QMAT_LENGTH(medial_lod_params, epsilon, 0.01, 0, 1,
                "The largest distance between surface and envelope; 0: no bound"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "chain", .type = QMAT_CHAIN, .doc = "From medial.chain"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh of that level"},
    {.name = "report",
     .type = QMAT_REPORT,
     .doc = "Its counts, the threshold of both errors, and their bounds where the chain has them"},
    {0},
};

const qmat_node qmat_node_medial_lod = {
    .name = "medial.lod",
    .version = 4,
    .summary = "Extracts a medial mesh of any number of spheres or any error from a chain",
    .doc =
        "Does the collapses of the chain down to the number of spheres, or while the threshold of both errors is "
        "within epsilon. With both parameters the first limit that is reached ends it.\n\n"
        "The threshold holds at constraint points for what collapses change; 2.5 % of it are a margin for the surface "
        "between them. It is no bound of the level's errors: where the initial medial mesh leaves the solid, or is "
        "too far from the surface, no collapse repairs it, and the level may be several times epsilon away. "
        "medial.evaluate says how far. medial.simplify with on_exceed=skip also fits and repairs spheres, and reaches "
        "epsilon with fewer of them: graphs/lod.yaml does so for each level.\n\n"
        "The medial mesh and its responsible regions are, byte for byte, those that medial.simplify makes with the "
        "parameters of the chain and that bound. An epsilon below the chain's finest gives the initial medial mesh. "
        "The time is milliseconds and grows with the initial medial mesh.",
    .citation = "Section 3.3",
    .params_size = sizeof(medial_lod_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .run = run,
};
