/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.poles: the medial axis of the Power Crust, the inner poles of surface samples. */
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/frame.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/sheets.h"
#include "core/json_text.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/initial/pole_labels.h"
#include "nodes/initial/regular_cgal.h"
#include "nodes/initial/sample_sites.h"

typedef struct medial_poles_params {
  double sampling;
  double propagation;
  double merge;
} medial_poles_params;

/* The power crust of a surface while it is made, in the unit frame. Arrays live in the context's arena. */
typedef struct power_crust {
  qmat_context *context;
  const medial_poles_params *params;
  qmat_frame frame;
  qmat_sample_sites sites;
  qmat_tetrahedra cells;
  qmat_poles poles;
  qmat_regular_simplices power;
  uint8_t *labels;
  uint32_t *sphere_of; /* per pole: its medial sphere, or QMAT_NONE */
  size_t sphere_count;
} power_crust;

static qmat_status find_inner_poles(power_crust *p) {
  qmat_context *context = p->context;
  double *points;
  qmat_status status = qmat_boxed_points(context, &p->frame, &p->sites, &points);
  if (status == QMAT_OK)
    status = qmat_delaunay_tetrahedra(context, points, p->sites.count + QMAT_BOX_CORNERS, &p->cells);
  if (status == QMAT_OK)
    status =
        qmat_poles_find(context, points, p->sites.count, &p->cells, p->params->sampling, p->params->merge, &p->poles);
  if (status == QMAT_OK) status = qmat_regular_simplices_find(context, p->poles.spheres, p->poles.count, &p->power);
  if (status != QMAT_OK) return status;
  p->labels = qmat_arena_alloc(&context->arena, p->poles.count, sizeof *p->labels);
  p->sphere_of = qmat_arena_alloc(&context->arena, p->poles.count, sizeof *p->sphere_of);
  if (!p->labels || !p->sphere_of) return qmat_fail_memory(context, "the labels of poles");
  status = qmat_poles_label(context, &p->poles, p->power.edges, p->power.edge_count, p->params->propagation, p->labels);
  for (size_t i = 0; status == QMAT_OK && i < p->poles.count; i++)
    p->sphere_of[i] = p->labels[i] == QMAT_POLE_INSIDE && !p->power.hidden[i] ? (uint32_t)p->sphere_count++ : QMAT_NONE;
  if (status != QMAT_OK || p->sphere_count > 0) return status;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "no pole of the %zu samples lies inside the surface", p->sites.count);
  qmat_fail_field(context, p->poles.rejected > 0 ? "sampling" : "samples");
  return qmat_fail_hint(context, p->poles.rejected > 0
                                     ? "raise sampling; 1 keeps every second pole"
                                     : "check that the surface is closed, or lower mesh.sample's spacing");
}

/* --- the medial mesh --------------------------------------------------------------------------------------------- */

typedef struct {
  uint32_t sphere, sample;
} contact;

static int by_sphere(const void *left, const void *right) {
  const contact *a = left, *b = right;
  if (a->sphere != b->sphere) return a->sphere < b->sphere ? -1 : 1;
  return a->sample < b->sample ? -1 : a->sample > b->sample;
}

/* Eq. 11: a sphere is responsible for the samples that it touches. */
static qmat_status set_regions(const power_crust *p, qmat_medial *medial) {
  size_t count = 0;
  for (size_t i = 0; i < p->cells.count; i++) {
    const uint32_t pole = p->poles.of_cell[i];
    if (pole != QMAT_NO_POLE && p->sphere_of[pole] != QMAT_NONE) count += 4;
  }
  contact *contacts = qmat_arena_alloc(&p->context->arena, count, sizeof *contacts);
  medial->region_offset_count = medial->sphere_count + 1;
  medial->region_offsets = qmat_calloc(medial->region_offset_count, sizeof *medial->region_offsets);
  medial->region_samples = qmat_alloc(count, sizeof *medial->region_samples);
  if (!contacts || !medial->region_offsets || !medial->region_samples || count >= UINT32_MAX)
    return qmat_fail_memory(p->context, "regions");
  count = 0;
  for (size_t i = 0; i < p->cells.count; i++) {
    const uint32_t pole = p->poles.of_cell[i];
    if (pole == QMAT_NO_POLE || p->sphere_of[pole] == QMAT_NONE) continue;
    for (size_t k = 0; k < 4; k++)
      contacts[count++] = (contact){p->sphere_of[pole], p->sites.samples[p->cells.corners[4 * i + k]]};
  }
  qsort(contacts, count, sizeof *contacts, by_sphere);
  for (size_t i = 0; i < count; i++) {
    if (i > 0 && by_sphere(&contacts[i - 1], &contacts[i]) == 0) continue;
    medial->region_samples[medial->region_sample_count++] = contacts[i].sample;
    medial->region_offsets[contacts[i].sphere + 1]++;
  }
  for (size_t i = 0; i < medial->sphere_count; i++) medial->region_offsets[i + 1] += medial->region_offsets[i];
  return QMAT_OK;
}

static qmat_status make_medial(power_crust *p, qmat_medial *medial) {
  medial->sphere_count = p->sphere_count;
  medial->spheres = qmat_alloc(p->sphere_count, 4 * sizeof *medial->spheres);
  if (!medial->spheres) return qmat_fail_memory(p->context, "medial spheres");
  for (size_t i = 0; i < p->poles.count; i++)
    if (p->sphere_of[i] != QMAT_NONE)
      memcpy(&medial->spheres[4 * (size_t)p->sphere_of[i]], &p->poles.spheres[4 * i], 4 * sizeof *medial->spheres);
  qmat_frame_spheres_to_model(&p->frame, medial->spheres, medial->sphere_count, medial->spheres);
  qmat_status status = qmat_progress(p->context, 0, 0, "simplices");
  if (status != QMAT_OK) return status;
  qmat_regular_simplices *s = &p->power;
  s->edge_count = qmat_medial_renumber(s->edges, s->edge_count, 2, p->sphere_of, s->edges);
  s->triangle_count = qmat_medial_renumber(s->triangles, s->triangle_count, 3, p->sphere_of, s->triangles);
  status = qmat_medial_set_simplices(p->context, medial, s->edges, s->edge_count, s->triangles, s->triangle_count);
  if (status == QMAT_OK) status = qmat_progress(p->context, 0, 0, "regions");
  if (status == QMAT_OK) status = set_regions(p, medial);
  return status == QMAT_OK ? qmat_progress(p->context, 0, 0, "regions") : status;
}

/* --- the report -------------------------------------------------------------------------------------------------- */

static qmat_status make_report(const power_crust *p, const qmat_medial *medial, qmat_report *report) {
  size_t by_label[3] = {0, 0, 0}, hidden = 0, components;
  for (size_t i = 0; i < p->poles.count; i++) {
    by_label[p->labels[i]]++;
    hidden += p->labels[i] == QMAT_POLE_INSIDE && p->power.hidden[i];
  }
  const qmat_status status =
      qmat_sets_count(p->context, medial->sphere_count, medial->edges, medial->edge_count, &components);
  if (status != QMAT_OK) return status;
  const qmat_json_count counts[] = {
      {"samples_triangulated", p->sites.count},
      {"tetrahedra", p->cells.count},
      {"poles", p->poles.count},
      {"poles_rejected", p->poles.rejected},
      {"inner_poles", by_label[QMAT_POLE_INSIDE]},
      {"outer_poles", by_label[QMAT_POLE_OUTSIDE]},
      {"poles_without_a_label", by_label[QMAT_POLE_UNLABELLED]},
      {"inner_poles_hidden", hidden},
      {"sheet_spheres", medial->sheet_sphere_count},
      {"spheres", medial->sphere_count},
      {"edges", medial->edge_count},
      {"triangles", medial->triangle_count},
      {"components", components},
  };
  const int bad = qmat_json_set_counts(report->root, counts, sizeof counts / sizeof *counts);
  return bad ? qmat_fail_memory(p->context, "the report") : QMAT_OK;
}

/* --- the node ---------------------------------------------------------------------------------------------------- */

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  power_crust p = {.context = context, .params = params};
  qmat_medial *medial = qmat_medial_new();
  qmat_report *report = qmat_report_new();
  qmat_status status = medial && report ? QMAT_OK : qmat_fail_memory(context, "the medial mesh");
  if (status == QMAT_OK) status = qmat_frame_of_mesh(context, mesh, &p.frame);
  if (status == QMAT_OK) status = qmat_sample_sites_find(context, mesh, (const qmat_samples *)inputs[1], &p.sites);
  if (status == QMAT_OK && qmat_has_solids(mesh)) {
    status = find_inner_poles(&p);
    if (status == QMAT_OK) status = make_medial(&p, medial);
  }
  if (status == QMAT_OK && mesh->sheet_triangle_count > 0) status = qmat_sheet_slabs_prepend(context, mesh, medial);
  if (status == QMAT_OK) status = make_report(&p, medial, report);
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)medial, (qmat_value *)report}, 2, outputs);
}

static const qmat_param params[] = {
    QMAT_FLOAT(medial_poles_params, sampling, "1", 0.6, 0.01, 1,
               "Sampling constant: the distance between samples as a share of the local feature size. A second pole "
               "that is nearer than the feature size it implies is left out; 1: none is"),
    QMAT_FLOAT(medial_poles_params, propagation, "1", 0.4, 0, 1,
               "A pole gets the label of a neighbour if their spheres intersect at an angle with a larger cosine"),
    QMAT_LENGTH(medial_poles_params, merge, 1e-6, 0, 0.01,
                "Neighbouring Voronoi vertices become one if they are no farther apart than this"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh",
     .type = QMAT_MESH,
     .doc = "The surface that the samples are on; only its size and its sheets are used"},
    {.name = "samples",
     .type = QMAT_SAMPLES,
     .doc =
         "Points on the surface, from mesh.sample; with max_per_facet=0 and spacing=0 only the vertices of the mesh"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "Inner poles and the dual of their power diagram"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts of poles by label, and of the medial mesh"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, NULL};

const qmat_node qmat_node_medial_poles = {
    .name = "medial.poles",
    .version = 1,
    .summary = "Makes the medial axis of the Power Crust: the inner poles of surface samples",
    .doc =
        "The method that the paper compares with as PC, by its authors' rules. The poles of a sample are the farthest "
        "Voronoi vertices of its cell on either side of the surface. Labels spread from the poles at a large box: the "
        "other label to opposite poles, the same to neighbours in the power diagram that intersect deeply. Inner "
        "poles are the spheres; edges and triangles are those of the regular triangulation between them.\n\n"
        "Only points count: the surface is never asked what is inside. Where samples are sparse for the thickness of "
        "the solid, parts are missing and some spheres reach out of it. The result is an initial medial mesh like that "
        "of medial.delaunay.",
    .citation = "Amenta, Choi, Kolluri: The power crust, 2001 (the paper's PC)",
    .params_size = sizeof(medial_poles_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
