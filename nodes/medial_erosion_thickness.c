/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.erosion_thickness: how long parts of a medial mesh resist a fire from its borders, and pruning by it. */
#include <math.h>
#include <string.h>

#include "core/geometry/frame.h"
#include "core/geometry/medial_build.h"
#include "core/json_text.h"
#include "core/node.h"
#include "nodes/initial/erosion.h"
#include "nodes/initial/free_pairs.h"
#include "nodes/measure/unit_spheres.h"

typedef struct medial_erosion_thickness_params {
  double prune;
} medial_erosion_thickness_params;

/* The thickness of spheres and simplices in diagonals; INFINITY for what never burns. Arrays in the context's arena. */
typedef struct erosion {
  qmat_context *context;
  const qmat_medial *medial;
  double *spheres, *edges, *triangles;
} erosion;

static double larger(const erosion *e, double value, double time, uint32_t sphere) {
  return fmax(value, time - e->medial->spheres[4 * (size_t)sphere + 3]);
}

/* A triangle is as thick as the fire in its own sheet says, so that a thin sheet on a thick one is thin up to its foot;
 * an edge as its thickest triangle. Sheets of the model stay. */
static void measure(const erosion *e, const qmat_burn_times *times) {
  const qmat_medial *m = e->medial;
  for (size_t i = 0; i < m->sphere_count; i++) e->spheres[i] = larger(e, 0, times->spheres[i], (uint32_t)i);
  for (size_t i = 0; i < m->edge_count; i++) e->edges[i] = -1;
  for (size_t i = 0; i < m->triangle_count; i++) {
    const uint32_t *ids = &m->triangles[3 * i];
    double value = ids[0] < m->sheet_sphere_count ? INFINITY : 0;
    for (size_t k = 0; k < 3; k++) value = larger(e, value, times->corners[3 * i + k], ids[k]);
    e->triangles[i] = value;
    for (size_t k = 0; k < 3; k++) {
      double *edge = &e->edges[times->sides[3 * i + k]];
      *edge = fmax(*edge, value);
    }
  }
  for (size_t i = 0; i < m->edge_count; i++) {
    if (e->edges[i] >= 0) continue;
    const uint32_t *ids = &m->edges[2 * i];
    e->edges[i] = ids[0] < m->sheet_sphere_count ? INFINITY : 0;
    for (size_t k = 0; k < 2; k++) e->edges[i] = larger(e, e->edges[i], times->ends[2 * i + k], ids[k]);
  }
}

/* The thickness of spheres in model units, and what the report says of it. */
static qmat_status make_field(const erosion *e, double diagonal, qmat_field *field, qmat_report *report) {
  const size_t count = e->medial->sphere_count;
  field->values = qmat_alloc(count, sizeof *field->values);
  field->unit = qmat_strdup("model unit");
  if (!field->values || field->unit == NULL) return qmat_fail_memory(e->context, "the erosion thickness");
  field->count = count;
  field->domain = QMAT_PER_VERTEX;
  double largest = 0;
  size_t lasting = 0;
  for (size_t i = 0; i < count; i++) {
    if (e->spheres[i] < INFINITY)
      largest = fmax(largest, e->spheres[i]);
    else
      lasting++;
  }
  for (size_t i = 0; i < count; i++)
    field->values[i] = diagonal * (e->spheres[i] < INFINITY ? e->spheres[i] : fmax(1, largest));
  const int bad = json_object_set_new(report->root, "largest", json_real(largest)) ||
                  qmat_json_set_count(report->root, "spheres_that_never_burn", lasting);
  return bad ? qmat_fail_memory(e->context, "the report") : QMAT_OK;
}

static qmat_status make(qmat_context *context, double threshold, const qmat_mesh *mesh, const qmat_medial *given,
                        qmat_medial *pruned, qmat_field *field, qmat_report *report) {
  qmat_frame frame;
  qmat_burn_times times;
  qmat_status status = qmat_frame_of_mesh(context, mesh, &frame);
  if (status != QMAT_OK) return qmat_fail_field(context, "mesh");
  qmat_medial unit = *given;
  erosion e = {context, &unit, NULL, NULL, NULL};
  status = qmat_unit_spheres(context, &frame, given, &unit.spheres);
  if (status != QMAT_OK) return status;
  e.spheres = qmat_arena_alloc(&context->arena, given->sphere_count, sizeof *e.spheres);
  e.edges = qmat_arena_alloc(&context->arena, given->edge_count, sizeof *e.edges);
  e.triangles = qmat_arena_alloc(&context->arena, given->triangle_count, sizeof *e.triangles);
  if (!e.spheres || !e.edges || !e.triangles) return qmat_fail_memory(context, "the erosion thickness");
  status = qmat_burn(context, &unit, &times);
  if (status != QMAT_OK) return status;
  measure(&e, &times);
  status = make_field(&e, frame.diagonal, field, report);
  if (status == QMAT_OK && threshold > 0)
    status = qmat_free_pairs_remove(context, pruned, e.edges, e.triangles, threshold);
  const int bad = status == QMAT_OK && (qmat_json_set_count(report->root, "spheres", pruned->sphere_count) ||
                                        qmat_json_set_count(report->root, "edges", pruned->edge_count) ||
                                        qmat_json_set_count(report->root, "triangles", pruned->triangle_count));
  return bad ? qmat_fail_memory(context, "the report") : status;
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const medial_erosion_thickness_params *params = data;
  const qmat_medial *given = (const qmat_medial *)inputs[1];
  qmat_medial *pruned = qmat_medial_copy(given);
  qmat_field *field = qmat_field_new();
  qmat_report *report = qmat_report_new();
  qmat_status status = pruned && field && report ? QMAT_OK : qmat_fail_memory(context, "the erosion thickness");
  if (status == QMAT_OK)
    status = make(context, params->prune, (const qmat_mesh *)inputs[0], given, pruned, field, report);
  return qmat_hand_over(context, status,
                        (qmat_value *[]){(qmat_value *)pruned, (qmat_value *)field, (qmat_value *)report}, 3, outputs);
}

static const qmat_param params[] = {
    QMAT_LENGTH(medial_erosion_thickness_params, prune, 0, 0, 1,
                "Parts that are thinner than this are pruned where the topology stays; 0: none is"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The surface; only its size is used"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "A medial mesh of it, initial or simplified"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh without its thin parts"},
    {.name = "thickness",
     .type = QMAT_FIELD,
     .doc = "The erosion thickness of each sphere of the input, in model units"},
    {.name = "report", .type = QMAT_REPORT, .doc = "The largest thickness in diagonals, and counts"},
    {0},
};

const qmat_node qmat_node_medial_erosion_thickness = {
    .name = "medial.erosion_thickness",
    .version = 1,
    .summary = "Measures how significant parts of a medial mesh are by burning it, and prunes",
    .doc =
        "Fires start at the borders of the medial sheets and at the ends of its curves, each at the time of the radius "
        "there, and burn with unit speed. Where sheets meet, a fire goes on only into the last one that is left. The "
        "erosion thickness is the time at which a point is burnt less its radius: a spike has little of it, however "
        "long it is seen from its tip, and a sheet of the shape as much as it is wider than thick.\n\n"
        "What encloses a void or a loop never burns; it has the diagonal, or the largest thickness if that is larger. "
        "Pruning removes the thinnest parts first and keeps components, loops and voids. Sheets of the model stay. "
        "Samples of removed spheres then belong to no sphere.",
    .citation = "Yan, Sykes, Chambers, Letscher, Ju: Erosion thickness on medial axes of 3D shapes, 2016 (section 2)",
    .params_size = sizeof(medial_erosion_thickness_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .run = run,
};
