/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.delaunay: the initial medial mesh from the Delaunay tetrahedra of surface samples (Algorithm 1). */
#include "core/geometry/sheets.h"
#include "core/geometry/thickness.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/descriptor/sampled_solid.h"
#include "nodes/initial/voronoi_dual.h"

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  const qmat_field *thickness = (const qmat_field *)inputs[1];
  const qmat_samples *samples = (const qmat_samples *)inputs[2];
  qmat_surface *solids = NULL;
  qmat_medial *medial = NULL;
  qmat_report *report = NULL;
  qmat_status status = qmat_thickness_check(context, mesh, thickness, samples);
  if (status == QMAT_OK && qmat_has_solids(mesh)) status = qmat_surface_new_of_solids(context, mesh, &solids);
  if (status == QMAT_OK && !(report = qmat_report_new())) status = qmat_fail_memory(context, "the report");
  if (status == QMAT_OK)
    status = qmat_voronoi_dual_make(context, params, mesh, solids, thickness, samples, NULL, &medial, report);
  qmat_surface_free(solids);
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)medial, (qmat_value *)report}, 2, outputs);
}

static const qmat_param params[] = {
    QMAT_LENGTH(qmat_voronoi_dual_params, epsilon, 0, 0, 1,
                "The largest distance between surface and envelope that the final result may have: merge and "
                "thinning_tolerance are shares of it; 0: not known, they are as for 0.5%"),
    QMAT_VORONOI_DUAL_PARAMS,
    {0},
};

static const qmat_port inputs[] = {
    QMAT_SAMPLED_SOLID_INPUTS,
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The initial medial mesh: complete, dense and noisy"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Tetrahedra, medial vertices by kind, components"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, NULL};

const qmat_node qmat_node_medial_delaunay = {
    .name = "medial.delaunay",
    .version = 23,
    .summary = "Makes the initial medial mesh of a solid from the Delaunay tetrahedra of its surface samples",
    .doc =
        "Every tetrahedron inside the solid becomes a medial vertex. Its centre is the circumcentre if that is inside. "
        "Otherwise it is the incentre, with the distance to the surface as radius; this completes parts that are too "
        "thin for circumcentres. Long slivers on the surface are left out: a cylinder of hundreds of facets has "
        "thousands. "
        "Medial edges are dual to the facets between such tetrahedra, and medial slabs to the "
        "Delaunay edges that they surround.\n\n"
        "A sliver on the surface can be on the wrong side of it, and where thin walls meet, tetrahedra between the "
        "samples of both are outside. That makes loops and voids, or opens voids. Where incentres is all, the "
        "tetrahedra nearest to the surface change sides until the loops and voids are those of the solid.\n\n"
        "Across a wall thinner than a quarter of the distance between samples, or a gap narrower than half of it, each "
        "sample has a point on the other side that is triangulated too, and so on through a stack of such walls. "
        "Otherwise the tetrahedra would not fill such a wall, and would join the sides of such a gap. Where adjacent "
        "tetrahedra lie in different solids nevertheless, the smaller one is dropped, so that the solids stay "
        "apart.\n\n"
        "Samples in flat regions that a kept neighbour represents are not triangulated, which saves time but no "
        "accuracy beyond thinning_tolerance. Components that add no sample are dropped, and the others are linked "
        "where one solid contains several, unless the link leaves the solid by more than epsilon.\n\n"
        "Sheets are medial meshes already: each of their triangles becomes a slab, with spheres of half the sheet "
        "thickness at its corners.",
    .citation = "Section 3.2, Algorithm 1",
    .params_size = sizeof(qmat_voronoi_dual_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 15,
    .run = run,
};
