/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.scale_axis: the scale axis transform, the medial axis of scaled inner balls. */
#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/sheets.h"
#include "core/geometry/surface.h"
#include "core/json_text.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/initial/ball_union_axis.h"
#include "nodes/initial/medial_vertices.h"
#include "nodes/initial/poles.h"
#include "nodes/initial/sample_sites.h"

typedef struct medial_scale_axis_params {
  double scale;
  double merge;
} medial_scale_axis_params;

/* What the report counts. */
typedef struct scale_axis_counts {
  size_t samples, tetrahedra, balls;
  qmat_ball_union_counts axis;
} scale_axis_counts;

/* Cuts the balls down to the distance to the surface; those whose centre is outside get the radius 0. */
static qmat_status inscribe(qmat_context *context, const qmat_surface *surface, double *balls, size_t count) {
  const size_t slice = 512; /* inside tests of an open surface are slow */
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count; first += slice) {
    const qmat_status status = qmat_progress(context, first, count, "balls");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 32)
    for (size_t i = first; i < last; i++) {
      double *ball = &balls[4 * i];
      const bool inside = qmat_surface_inside(surface, ball);
      const double depth = inside ? qmat_surface_distance(surface, ball, ball[3], NULL, NULL) : 0;
      ball[3] = depth > qmat_least_depth ? fmin(depth, ball[3]) : 0;
    }
  }
  return QMAT_OK;
}

/* The inner balls of the samples in the unit frame: those of the poles whose centre is inside. */
static qmat_status find_balls(qmat_context *context, const qmat_surface *surface, const qmat_sample_sites *sites,
                              double merge, double **balls, scale_axis_counts *counts) {
  double *points;
  qmat_tetrahedra cells;
  qmat_poles poles;
  qmat_status status = qmat_boxed_points(context, qmat_surface_frame(surface), sites, &points);
  if (status == QMAT_OK) status = qmat_delaunay_tetrahedra(context, points, sites->count + QMAT_BOX_CORNERS, &cells);
  if (status == QMAT_OK) status = qmat_poles_find(context, points, sites->count, &cells, 1, merge, &poles);
  if (status == QMAT_OK) status = inscribe(context, surface, poles.spheres, poles.count);
  if (status != QMAT_OK) return status;
  *balls = poles.spheres;
  for (size_t i = 0; i < poles.count; i++)
    if (poles.spheres[4 * i + 3] > 0)
      memmove(&(*balls)[4 * counts->balls++], &poles.spheres[4 * i], 4 * sizeof **balls);
  counts->samples = sites->count;
  counts->tetrahedra = cells.count;
  if (counts->balls > 0) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "no pole of the %zu samples lies inside the surface", sites->count);
  qmat_fail_field(context, "mesh");
  return qmat_fail_hint(context, "check that the surface is closed, or lower mesh.sample's spacing");
}

static qmat_status make_medial(qmat_context *context, const medial_scale_axis_params *params,
                               const qmat_surface *surface, const qmat_sample_sites *sites, qmat_medial *medial,
                               scale_axis_counts *counts) {
  double *balls;
  qmat_status status = find_balls(context, surface, sites, params->merge, &balls, counts);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < counts->balls; i++) balls[4 * i + 3] *= params->scale;
  status = qmat_ball_union_axis(context, balls, counts->balls, params->merge, medial, &counts->axis);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < medial->sphere_count; i++) medial->spheres[4 * i + 3] /= params->scale;
  qmat_frame_spheres_to_model(qmat_surface_frame(surface), medial->spheres, medial->sphere_count, medial->spheres);
  return QMAT_OK;
}

static qmat_status make_report(qmat_context *context, const scale_axis_counts *counts, const qmat_medial *medial,
                               qmat_report *report) {
  size_t components;
  const qmat_status status =
      qmat_sets_count(context, medial->sphere_count, medial->edges, medial->edge_count, &components);
  if (status != QMAT_OK) return status;
  const qmat_json_count rows[] = {
      {"samples_triangulated", counts->samples},
      {"tetrahedra", counts->tetrahedra},
      {"balls", counts->balls},
      {"corners", counts->axis.corners},
      {"singular_edges", counts->axis.singular_edges},
      {"singular_triangles", counts->axis.singular_triangles},
      {"sheet_spheres", medial->sheet_sphere_count},
      {"spheres", medial->sphere_count},
      {"edges", medial->edge_count},
      {"triangles", medial->triangle_count},
      {"components", components},
  };
  const int bad = qmat_json_set_counts(report->root, rows, sizeof rows / sizeof *rows);
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  const qmat_samples *samples = (const qmat_samples *)inputs[1];
  qmat_sample_sites sites;
  scale_axis_counts counts = {0};
  qmat_surface *solids = NULL;
  qmat_medial *medial = qmat_medial_new();
  qmat_report *report = qmat_report_new();
  qmat_status status = medial && report ? QMAT_OK : qmat_fail_memory(context, "the medial mesh");
  if (status == QMAT_OK) status = qmat_sample_sites_find(context, mesh, samples, &sites);
  if (status == QMAT_OK && qmat_has_solids(mesh)) {
    status = qmat_surface_new_of_solids(context, mesh, &solids);
    if (status == QMAT_OK) status = make_medial(context, params, solids, &sites, medial, &counts);
  }
  if (status == QMAT_OK && mesh->sheet_triangle_count > 0) status = qmat_sheet_slabs_prepend(context, mesh, medial);
  if (status == QMAT_OK) status = make_report(context, &counts, medial, report);
  qmat_surface_free(solids);
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)medial, (qmat_value *)report}, 2, outputs);
}

static const qmat_param params[] = {
    QMAT_FLOAT(medial_scale_axis_params, scale, "1", 1.1, 1, 10,
               "Balls grow by this factor, so that those of small features vanish in larger ones; 1: none does"),
    QMAT_LENGTH(medial_scale_axis_params, merge, 2e-4, 0, 0.01,
                "Neighbouring centres become one if they are no farther apart than this"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The closed surface"},
    {.name = "samples", .type = QMAT_SAMPLES, .doc = "Points on the surface, from mesh.sample"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial axis of the scaled balls, scaled back"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts of balls, corners and singular simplices"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, NULL};

const qmat_node qmat_node_medial_scale_axis = {
    .name = "medial.scale_axis",
    .version = 2,
    .summary = "Makes the scale axis transform: the medial axis of inner balls that were scaled",
    .doc =
        "The method that the paper compares with as SAT. The balls of the samples' inner poles, no larger than "
        "inscribed ones, grow by a factor, and a ball "
        "that a larger one then contains vanishes, which removes spikes. The medial axis of the grown balls is exact: "
        "the singular simplices of their weighted alpha complex, and inside its tetrahedra the Voronoi diagram of the "
        "points where three spheres meet. The radii of its spheres are scaled back.\n\n"
        "The paper samples at 1 % of the diagonal: spacing=1% of mesh.sample. Narrow gaps close when balls grow, and "
        "parts thinner than the spacing may be missing. The result is an initial medial mesh like that of "
        "medial.delaunay.",
    .citation = "Miklos, Giesen, Pauly: Discrete scale axis representations for 3D geometry, 2010 (the paper's SAT)",
    .params_size = sizeof(medial_scale_axis_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
