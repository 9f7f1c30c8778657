/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.features: spheres of radius zero along the convex creases of the surface, linked to the medial sheets
 * (section 5, future work). */
#include <math.h>
#include <string.h>

#include "core/geometry/frame.h"
#include "core/geometry/medial_complex.h"
#include "core/geometry/sheets.h"
#include "core/geometry/vector.h"
#include "core/json_text.h"
#include "nodes/initial/crease_spheres.h"
#include "nodes/initial/creases.h"

typedef enum { FEATURES_NONE, FEATURES_SHARP, FEATURES_AUTO } feature_kind;

typedef struct {
  int features;
  double angle;
  double shortest;
  double spacing;
} medial_features_params;

/* The share of the bending on sharp edges above which a surface is made of flat faces, and the corners of a simple one:
 * each corner stays a sphere. */
static const double FLAT_FACED = 0.9;
enum { MOST_SIMPLE_CORNERS = 64 };

typedef struct {
  qmat_context *context;
  const medial_features_params *params;
  const qmat_mesh *mesh;
  const qmat_medial *initial;
  const double *positions; /* of the mesh, unit frame */
  qmat_frame frame;
  qmat_creases creases;
  qmat_crease_spheres spheres;
  uint32_t *sphere_of_vertex; /* of the mesh */
  double sharp_share;
  qmat_crease_links links;
} feature_builder;

/* --- spheres along the creases ------------------------------------------------------------------------------------ */

static qmat_status sphere_at_vertex(feature_builder *b, uint32_t vertex, uint32_t *id) {
  *id = b->sphere_of_vertex[vertex];
  if (*id != QMAT_NONE) return QMAT_OK;
  const qmat_status status =
      qmat_crease_spheres_add(b->context, &b->mesh->positions[3 * (size_t)vertex], vertex, &b->spheres, id);
  b->sphere_of_vertex[vertex] = *id;
  return status;
}

/* Adds spheres at both ends of a mesh edge, and between them if the edge is longer than the spacing. */
static qmat_status divide_edge(feature_builder *b, uint32_t from, uint32_t to) {
  const double *a = &b->positions[3 * (size_t)from], *c = &b->positions[3 * (size_t)to];
  const double pieces = fmax(ceil(qmat_point_distance(a, c) / b->params->spacing), 1);
  uint32_t last, next = QMAT_NONE;
  qmat_status status = sphere_at_vertex(b, from, &last);
  for (double i = 1; i < pieces && status == QMAT_OK; i++) {
    double place[3], centre[3];
    for (int k = 0; k < 3; k++) place[k] = a[k] + i / pieces * (c[k] - a[k]);
    qmat_frame_to_model(&b->frame, place, 1, centre);
    status = qmat_crease_spheres_add(b->context, centre, QMAT_NONE, &b->spheres, &next);
    if (status == QMAT_OK) status = qmat_crease_spheres_add_segment(b->context, last, next, &b->spheres);
    last = next;
  }
  if (status == QMAT_OK) status = sphere_at_vertex(b, to, &next);
  return status == QMAT_OK ? qmat_crease_spheres_add_segment(b->context, last, next, &b->spheres) : status;
}

static size_t count_corners(const feature_builder *b) {
  size_t corners = 0;
  for (size_t v = 0; b->creases.count && v < b->mesh->vertex_count; v++) corners += b->creases.is_corner[v];
  return corners;
}

/* Whether kept creases may take fewer spheres than fitted ones. */
static bool is_simple(const feature_builder *b) {
  return b->sharp_share >= FLAT_FACED && count_corners(b) <= MOST_SIMPLE_CORNERS;
}

static qmat_status place_spheres(feature_builder *b) {
  qmat_crease_edges edges = {.sharp_share = 0};
  const qmat_mesh solids = qmat_mesh_of_solids(b->mesh);
  qmat_status status =
      qmat_crease_edges_find(b->context, &solids, b->positions, b->params->angle, b->params->shortest, &edges);
  b->sharp_share = edges.sharp_share;
  if (status == QMAT_OK)
    status = qmat_creases_chain(b->context, &edges, b->positions, 3, b->mesh->vertex_count, &b->creases);
  if (status == QMAT_OK && b->params->features == FEATURES_AUTO && !is_simple(b)) b->creases.count = 0;
  b->sphere_of_vertex = qmat_arena_alloc(&b->context->arena, b->mesh->vertex_count, sizeof *b->sphere_of_vertex);
  if (status == QMAT_OK && !b->sphere_of_vertex) status = qmat_fail_memory(b->context, "features");
  if (status != QMAT_OK) return status;
  memset(b->sphere_of_vertex, 0xff, b->mesh->vertex_count * sizeof *b->sphere_of_vertex);
  for (size_t c = 0; c < b->creases.count; c++)
    for (size_t i = b->creases.starts[c]; i + 1 < b->creases.starts[c + 1] && status == QMAT_OK; i++)
      status = divide_edge(b, b->creases.points[i], b->creases.points[i + 1]);
  return status;
}

/* --- the node --------------------------------------------------------------------------------------------------- */

static qmat_status make_report(const feature_builder *b, qmat_report *report) {
  const qmat_json_count counts[] = {{"creases", b->creases.count},
                                    {"corners", count_corners(b)},
                                    {"spheres", b->spheres.count},
                                    {"gaps", b->links.gaps}};
  int bad = qmat_json_set_counts(report->root, counts, sizeof counts / sizeof *counts);
  bad |= json_object_set_new(report->root, "longest_link", json_real(b->links.longest));
  bad |= json_object_set_new(report->root, "sharp_share", json_real(b->sharp_share));
  return bad ? qmat_fail_memory(b->context, "the report") : QMAT_OK;
}

/* `*medial` stays NULL if there is no crease. */
static qmat_status build(feature_builder *b, qmat_medial **medial) {
  double *positions = qmat_arena_alloc(&b->context->arena, b->mesh->vertex_count, 3 * sizeof *positions);
  if (!positions) return qmat_fail_memory(b->context, "features");
  qmat_status status = qmat_frame_of_mesh(b->context, b->mesh, &b->frame);
  if (status != QMAT_OK) return status;
  qmat_frame_to_unit(&b->frame, b->mesh->positions, b->mesh->vertex_count, positions);
  b->positions = positions;
  status = place_spheres(b);
  if (status != QMAT_OK || b->spheres.count == 0) return status;
  return qmat_crease_spheres_link(b->context, &b->frame, b->initial, &b->spheres, medial, &b->links);
}

static qmat_status check_inputs(const feature_builder *b) {
  qmat_status status = QMAT_OK;
  if (!b->mesh->oriented) {
    qmat_fail(b->context, QMAT_ERROR_GEOMETRY,
              "the triangles are not consistently oriented, so convex and concave creases cannot be told apart");
    status = qmat_fail_field(b->context, "mesh");
  } else if (b->initial->sphere_count == 0) {
    qmat_fail(b->context, QMAT_ERROR_GEOMETRY, "the medial mesh has no sphere");
    status = qmat_fail_field(b->context, "medial");
  }
  return status;
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  feature_builder b = {.context = context,
                       .params = params,
                       .mesh = (const qmat_mesh *)inputs[0],
                       .initial = (const qmat_medial *)inputs[1]};
  qmat_medial *medial = NULL;
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK && b.params->features != FEATURES_NONE && (status = check_inputs(&b)) == QMAT_OK)
    status = build(&b, &medial);
  if (status == QMAT_OK) status = make_report(&b, report);
  qmat_crease_spheres_uninit(&b.spheres);
  return qmat_hand_over(
      context, status,
      (qmat_value *const[]){medial ? &medial->base : qmat_value_retain(inputs[1]), report ? &report->base : NULL}, 2,
      outputs);
}

static const char *const feature_kinds[] = {"none", "sharp", "auto", NULL};

static const qmat_param params[] = {
    QMAT_ENUM(
        medial_features_params, features, feature_kinds, FEATURES_SHARP,
        "Leave the medial mesh as it is, or add spheres of radius zero on sharp convex edges and corners. auto: "
        "as sharp where the surface is made of few flat faces, none elsewhere; medial.simplify with features=auto then "
        "keeps them where that takes fewer spheres"),
    QMAT_FLOAT(medial_features_params, angle, "degrees", 40, 1, 179,
               "An edge is sharp if the normals of its facets differ by more than this"),
    QMAT_LENGTH(medial_features_params, shortest, 0.02, 0, 1,
                "Connected sharp edges with a total length below this are ignored as noise"),
    QMAT_LENGTH(medial_features_params, spacing, 0.01, 1e-4, 1,
                "The largest distance between neighbouring spheres on a sharp edge"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The oriented surface"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The initial medial mesh, from medial.delaunay"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The input, with the spheres of radius zero at the end"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts of creases, corners and their spheres"},
    {0},
};

const qmat_node qmat_node_medial_features = {
    .name = "medial.features",
    .version = 7,
    .summary = "Extends an initial medial mesh to the sharp convex edges and corners of the surface",
    .doc =
        "The medial axis of a solid touches its convex creases with radius zero, but spheres through samples never do. "
        "This node adds spheres of radius zero along the creases, joins them by medial cones, and links them by slabs "
        "to the nearest spheres of the medial mesh. The homotopy type does not change. medial.simplify keeps these "
        "spheres on their creases.\n\n"
        "A crease runs from corner to corner: where creases meet, end or bend by more than 45 degrees. Concave creases "
        "are ignored, since the medial axis does not reach them.\n\n"
        "A surface is made of few flat faces when it has at most 64 corners, and nine tenths of its bending are on "
        "sharp edges: the sum of the angle times the length of edges (sharp_share in the report). On other surfaces "
        "fitted spheres do better.",
    .citation = "Section 5, future work",
    .params_size = sizeof(medial_features_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .run = run,
};
