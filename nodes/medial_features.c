/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.features: spheres of radius zero along the convex creases of the surface, linked to the medial sheets
 * (section 5, future work). */
#include <math.h>
#include <string.h>

#include "core/geometry/envelope.h"
#include "core/geometry/frame.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/sheets.h"
#include "core/geometry/vector.h"
#include "core/json_text.h"
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

#define NONE UINT32_MAX

/* The adjacency of the spheres, and the state of a shortest-path search along medial edges. */
typedef struct {
  const double *spheres; /* 4 per sphere, unit frame */
  size_t *starts;        /* per sphere, + 1 */
  uint32_t *neighbours;
  double *distances; /* per sphere: along edges from the root; valid in the search of `reached` */
  uint32_t *parents;
  uint32_t *reached, *finished, *wanted, *linked; /* per sphere: the last search that set this mark */
  uint32_t search;
  uint32_t *heap, *places;
  size_t heap_count;
} sheet_graph;

/* A point on a crease that becomes a sphere. */
typedef struct {
  double unit[3];
  uint32_t vertex; /* of the mesh; NONE between two vertices */
  uint32_t anchor; /* the sphere of the initial medial mesh that it is linked to */
} feature;

typedef struct {
  qmat_context *context;
  const medial_features_params *params;
  const qmat_mesh *mesh;
  const qmat_medial *initial;
  const double *positions; /* of the mesh, unit frame */
  qmat_frame frame;
  qmat_creases creases;
  feature *features; /* heap */
  size_t feature_count, feature_capacity;
  uint32_t *feature_of_vertex; /* of the mesh */
  uint32_t *segments;          /* 2 features per segment of a crease, in the crease's direction; heap */
  size_t segment_count, segment_capacity;
  sheet_graph graph;
  uint32_t *edges, *triangles; /* of the result; heap */
  size_t edge_count, triangle_count, edge_capacity, triangle_capacity;
  size_t gaps;
  double longest_link, sharp_share;
} feature_builder;

/* --- spheres along the creases ------------------------------------------------------------------------------------ */

static qmat_status add_feature(feature_builder *b, const double *place, uint32_t vertex, uint32_t *id) {
  if (qmat_grow((void **)&b->features, &b->feature_capacity, b->feature_count + 1, sizeof *b->features))
    return qmat_fail_memory(b->context, "features");
  *id = (uint32_t)b->feature_count++;
  feature *f = &b->features[*id];
  memcpy(f->unit, place, sizeof f->unit);
  f->vertex = vertex;
  f->anchor = NONE;
  return QMAT_OK;
}

static qmat_status feature_at_vertex(feature_builder *b, uint32_t vertex, uint32_t *id) {
  *id = b->feature_of_vertex[vertex];
  if (*id != NONE) return QMAT_OK;
  const qmat_status status = add_feature(b, &b->positions[3 * (size_t)vertex], vertex, id);
  b->feature_of_vertex[vertex] = *id;
  return status;
}

static qmat_status add_segment(feature_builder *b, uint32_t from, uint32_t to) {
  if (qmat_grow((void **)&b->segments, &b->segment_capacity, 2 * (b->segment_count + 1), sizeof *b->segments))
    return qmat_fail_memory(b->context, "features");
  b->segments[2 * b->segment_count] = from;
  b->segments[2 * b->segment_count++ + 1] = to;
  return QMAT_OK;
}

/* Adds features at both ends of a mesh edge, and between them if the edge is longer than the spacing. */
static qmat_status divide_edge(feature_builder *b, uint32_t from, uint32_t to) {
  const double *a = &b->positions[3 * (size_t)from], *c = &b->positions[3 * (size_t)to];
  const double pieces = fmax(ceil(qmat_point_distance(a, c) / b->params->spacing), 1);
  uint32_t last, next = NONE;
  qmat_status status = feature_at_vertex(b, from, &last);
  for (double i = 1; i < pieces && status == QMAT_OK; i++) {
    double place[3];
    for (int k = 0; k < 3; k++) place[k] = a[k] + i / pieces * (c[k] - a[k]);
    status = add_feature(b, place, NONE, &next);
    if (status == QMAT_OK) status = add_segment(b, last, next);
    last = next;
  }
  if (status == QMAT_OK) status = feature_at_vertex(b, to, &next);
  return status == QMAT_OK ? add_segment(b, last, next) : status;
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

static qmat_status place_features(feature_builder *b) {
  qmat_crease_edges edges = {.sharp_share = 0};
  const qmat_mesh solids = qmat_mesh_of_solids(b->mesh);
  qmat_status status =
      qmat_crease_edges_find(b->context, &solids, b->positions, b->params->angle, b->params->shortest, &edges);
  b->sharp_share = edges.sharp_share;
  if (status == QMAT_OK)
    status = qmat_creases_chain(b->context, &edges, b->positions, 3, b->mesh->vertex_count, &b->creases);
  if (status == QMAT_OK && b->params->features == FEATURES_AUTO && !is_simple(b)) b->creases.count = 0;
  b->feature_of_vertex = qmat_arena_alloc(&b->context->arena, b->mesh->vertex_count, sizeof *b->feature_of_vertex);
  if (status == QMAT_OK && !b->feature_of_vertex) status = qmat_fail_memory(b->context, "features");
  if (status != QMAT_OK) return status;
  memset(b->feature_of_vertex, 0xff, b->mesh->vertex_count * sizeof *b->feature_of_vertex);
  for (size_t c = 0; c < b->creases.count; c++)
    for (size_t i = b->creases.starts[c]; i + 1 < b->creases.starts[c + 1] && status == QMAT_OK; i++)
      status = divide_edge(b, b->creases.points[i], b->creases.points[i + 1]);
  return status;
}

/* --- anchors ----------------------------------------------------------------------------------------------------- */

/* Of the corners of the nearest primitive, the one whose sphere is nearest. */
static uint32_t nearest_sphere(const qmat_envelope *envelope, const double *spheres, const double *point) {
  size_t primitive;
  uint32_t ids[3];
  qmat_envelope_distance(envelope, point, &primitive);
  const int count = qmat_envelope_primitive(envelope, primitive, ids);
  uint32_t best = NONE;
  double least = INFINITY;
  for (int k = 0; k < count; k++) {
    const double *s = &spheres[4 * (size_t)ids[k]];
    const double distance = qmat_point_distance(s, point) - s[3];
    if (!(distance < least || (distance == least && ids[k] < best))) continue;
    least = distance;
    best = ids[k];
  }
  return best;
}

static qmat_status find_anchors(feature_builder *b) {
  qmat_envelope *envelope;
  const qmat_medial *m = b->initial;
  qmat_status status = qmat_envelope_new(b->context, b->graph.spheres, m->sphere_count, m->edges, m->edge_count,
                                         m->triangles, m->triangle_count, &envelope);
  if (status != QMAT_OK) return status;
  const int threads = qmat_threads(b->context);
  const size_t slice = 1 << 10;
  for (size_t first = 0; first < b->feature_count; first += slice) {
    if ((status = qmat_progress(b->context, first, b->feature_count, "features")) != QMAT_OK) break;
    const size_t last = b->feature_count - first < slice ? b->feature_count : first + slice;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
    for (size_t i = first; i < last; i++)
      b->features[i].anchor = nearest_sphere(envelope, b->graph.spheres, b->features[i].unit);
  }
  qmat_envelope_free(envelope);
  return status;
}

/* --- shortest paths in the medial mesh --------------------------------------------------------------------------- */

static qmat_status make_graph(feature_builder *b) {
  qmat_arena *arena = &b->context->arena;
  const qmat_medial *m = b->initial;
  const size_t count = m->sphere_count;
  sheet_graph *g = &b->graph;
  double *spheres = qmat_arena_alloc(arena, count, 4 * sizeof *spheres);
  g->starts = qmat_arena_calloc(arena, count + 2, sizeof *g->starts);
  g->neighbours = qmat_arena_alloc(arena, m->edge_count, 2 * sizeof *g->neighbours);
  g->distances = qmat_arena_alloc(arena, count, sizeof *g->distances);
  uint32_t **const rows[] = {&g->parents, &g->reached, &g->finished, &g->wanted, &g->linked, &g->heap, &g->places};
  bool bad = !spheres || !g->starts || !g->neighbours || !g->distances;
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
    bad |= !(*rows[i] = qmat_arena_calloc(arena, count, sizeof **rows[i]));
  if (bad) return qmat_fail_memory(b->context, "the medial mesh");
  qmat_frame_spheres_to_unit(&b->frame, m->spheres, count, spheres);
  g->spheres = spheres;
  for (size_t i = 0; i < 2 * m->edge_count; i++) g->starts[m->edges[i] + 2]++;
  for (size_t v = 0; v < count; v++) g->starts[v + 2] += g->starts[v + 1];
  for (size_t i = 0; i < 2 * m->edge_count; i++) g->neighbours[g->starts[m->edges[i] + 1]++] = m->edges[i ^ 1];
  return QMAT_OK;
}

static bool is_nearer(const sheet_graph *g, uint32_t a, uint32_t b) {
  return g->distances[a] < g->distances[b] || (g->distances[a] == g->distances[b] && a < b);
}

static void put(sheet_graph *g, size_t place, uint32_t sphere) {
  g->heap[place] = sphere;
  g->places[sphere] = (uint32_t)place;
}

static void sift_up(sheet_graph *g, size_t place, uint32_t sphere) {
  for (; place > 0 && is_nearer(g, sphere, g->heap[(place - 1) / 2]); place = (place - 1) / 2)
    put(g, place, g->heap[(place - 1) / 2]);
  put(g, place, sphere);
}

static uint32_t take_nearest(sheet_graph *g) {
  const uint32_t first = g->heap[0], last = g->heap[--g->heap_count];
  size_t place = 0;
  for (size_t child; (child = 2 * place + 1) < g->heap_count; place = child) {
    if (child + 1 < g->heap_count && is_nearer(g, g->heap[child + 1], g->heap[child])) child++;
    if (!is_nearer(g, g->heap[child], last)) break;
    put(g, place, g->heap[child]);
  }
  if (g->heap_count) put(g, place, last);
  return first;
}

/* Grows the tree of shortest paths from `root` (Dijkstra 1959) until it contains all wanted spheres, `missing` of them.
 */
static void find_paths(sheet_graph *g, uint32_t root, size_t missing) {
  g->distances[root] = 0;
  g->parents[root] = NONE;
  g->reached[root] = g->search;
  g->heap_count = 1;
  put(g, 0, root);
  while (g->heap_count && missing) {
    const uint32_t v = take_nearest(g);
    g->finished[v] = g->search;
    missing -= g->wanted[v] == g->search;
    for (size_t i = g->starts[v]; i < g->starts[v + 1]; i++) {
      const uint32_t w = g->neighbours[i];
      const double distance =
          g->distances[v] + qmat_point_distance(&g->spheres[4 * (size_t)v], &g->spheres[4 * (size_t)w]);
      const bool is_new = g->reached[w] != g->search;
      if (g->finished[w] == g->search || !(is_new || distance < g->distances[w])) continue;
      g->distances[w] = distance;
      g->parents[w] = v;
      g->reached[w] = g->search;
      sift_up(g, is_new ? g->heap_count++ : g->places[w], w);
    }
  }
}

/* --- slabs between creases and medial mesh ----------------------------------------------------------------------- */

static qmat_status add_edge(feature_builder *b, uint32_t u, uint32_t v) {
  if (qmat_grow((void **)&b->edges, &b->edge_capacity, 2 * (b->edge_count + 1), sizeof *b->edges))
    return qmat_fail_memory(b->context, "medial edges");
  b->edges[2 * b->edge_count] = u;
  b->edges[2 * b->edge_count++ + 1] = v;
  return QMAT_OK;
}

static qmat_status add_triangle(feature_builder *b, uint32_t u, uint32_t v, uint32_t w) {
  if (qmat_grow((void **)&b->triangles, &b->triangle_capacity, 3 * (b->triangle_count + 1), sizeof *b->triangles))
    return qmat_fail_memory(b->context, "medial slabs");
  const uint32_t corners[3] = {u, v, w};
  memcpy(&b->triangles[3 * b->triangle_count++], corners, sizeof corners);
  return QMAT_OK;
}

/* Links one feature and the segments that start at it: a fan of slabs over the tree of paths from its anchor to the
 * anchors of the next features, and a slab on each segment. A cone over a tree keeps the homotopy type, and so does a
 * slab that adds one free edge. `following` holds the segments. */
static qmat_status link_feature(feature_builder *b, uint32_t id, const uint32_t *following, size_t count) {
  sheet_graph *g = &b->graph;
  const uint32_t sphere = (uint32_t)b->initial->sphere_count + id, root = b->features[id].anchor;
  qmat_status status = add_edge(b, sphere, root);
  size_t missing = 0;
  g->search++;
  for (size_t i = 0; i < count; i++) {
    const uint32_t anchor = b->features[b->segments[2 * (size_t)following[i] + 1]].anchor;
    missing += g->wanted[anchor] != g->search;
    g->wanted[anchor] = g->search;
  }
  find_paths(g, root, missing);
  g->linked[root] = g->search;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    const uint32_t next = b->segments[2 * (size_t)following[i] + 1], anchor = b->features[next].anchor;
    if (g->finished[anchor] != g->search) {
      b->gaps++;
      continue;
    }
    b->longest_link = fmax(b->longest_link, g->distances[anchor]);
    for (uint32_t v = anchor; g->linked[v] != g->search && status == QMAT_OK; v = g->parents[v]) {
      g->linked[v] = g->search;
      status = add_triangle(b, sphere, v, g->parents[v]);
    }
    if (status == QMAT_OK) status = add_triangle(b, sphere, (uint32_t)b->initial->sphere_count + next, anchor);
  }
  return status;
}

static qmat_status link_features(feature_builder *b) {
  qmat_arena *arena = &b->context->arena;
  size_t *starts = qmat_arena_calloc(arena, b->feature_count + 2, sizeof *starts);
  uint32_t *following = qmat_arena_alloc(arena, b->segment_count, sizeof *following);
  if (!starts || !following) return qmat_fail_memory(b->context, "features");
  for (size_t s = 0; s < b->segment_count; s++) starts[b->segments[2 * s] + 2]++;
  for (size_t i = 0; i < b->feature_count; i++) starts[i + 2] += starts[i + 1];
  for (size_t s = 0; s < b->segment_count; s++) following[starts[b->segments[2 * s] + 1]++] = (uint32_t)s;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < b->feature_count && status == QMAT_OK; i++) {
    if (i % 256 == 0) status = qmat_progress(b->context, i, b->feature_count, "features");
    if (status == QMAT_OK) status = link_feature(b, (uint32_t)i, &following[starts[i]], starts[i + 1] - starts[i]);
  }
  return status;
}

/* --- the result -------------------------------------------------------------------------------------------------- */

/* A feature at a vertex is responsible for it: the first samples are the vertices. */
static qmat_status set_regions(const feature_builder *b, qmat_medial *medial) {
  const qmat_medial *m = b->initial;
  if (m->region_offset_count == 0) return QMAT_OK;
  medial->region_offset_count = medial->sphere_count + 1;
  medial->region_offsets = qmat_alloc(medial->region_offset_count, sizeof *medial->region_offsets);
  medial->region_samples = qmat_alloc(m->region_sample_count + b->feature_count, sizeof *medial->region_samples);
  if (!medial->region_offsets || !medial->region_samples) return qmat_fail_memory(b->context, "regions");
  memcpy(medial->region_offsets, m->region_offsets, m->region_offset_count * sizeof *m->region_offsets);
  if (m->region_sample_count)
    memcpy(medial->region_samples, m->region_samples, m->region_sample_count * sizeof *m->region_samples);
  medial->region_sample_count = m->region_sample_count;
  for (size_t i = 0; i < b->feature_count; i++) {
    if (b->features[i].vertex != NONE) medial->region_samples[medial->region_sample_count++] = b->features[i].vertex;
    medial->region_offsets[m->sphere_count + i + 1] = (uint32_t)medial->region_sample_count;
  }
  return QMAT_OK;
}

static qmat_status make_medial(feature_builder *b, qmat_medial *medial) {
  const qmat_medial *m = b->initial;
  medial->sphere_count = m->sphere_count + b->feature_count;
  medial->sheet_sphere_count = m->sheet_sphere_count;
  medial->spheres = qmat_alloc(medial->sphere_count, 4 * sizeof *medial->spheres);
  if (!medial->spheres) return qmat_fail_memory(b->context, "medial spheres");
  memcpy(medial->spheres, m->spheres, 4 * m->sphere_count * sizeof *medial->spheres);
  for (size_t i = 0; i < b->feature_count; i++) {
    const feature *f = &b->features[i];
    double *sphere = &medial->spheres[4 * (m->sphere_count + i)];
    sphere[3] = 0;
    if (f->vertex != NONE)
      memcpy(sphere, &b->mesh->positions[3 * (size_t)f->vertex], 3 * sizeof *sphere);
    else
      qmat_frame_to_model(&b->frame, f->unit, 1, sphere);
  }
  qmat_status status = QMAT_OK;
  for (size_t e = 0; e < m->edge_count && status == QMAT_OK; e++)
    status = add_edge(b, m->edges[2 * e], m->edges[2 * e + 1]);
  for (size_t t = 0; t < m->triangle_count && status == QMAT_OK; t++)
    status = add_triangle(b, m->triangles[3 * t], m->triangles[3 * t + 1], m->triangles[3 * t + 2]);
  if (status == QMAT_OK)
    status = qmat_medial_set_simplices(b->context, medial, b->edges, b->edge_count, b->triangles, b->triangle_count);
  if (status == QMAT_OK) status = set_regions(b, medial);
  return status;
}

static qmat_status make_report(const feature_builder *b, qmat_report *report) {
  const qmat_json_count counts[] = {
      {"creases", b->creases.count}, {"corners", count_corners(b)}, {"spheres", b->feature_count}, {"gaps", b->gaps}};
  int bad = qmat_json_set_counts(report->root, counts, sizeof counts / sizeof *counts);
  bad |= json_object_set_new(report->root, "longest_link", json_real(b->longest_link));
  bad |= json_object_set_new(report->root, "sharp_share", json_real(b->sharp_share));
  return bad ? qmat_fail_memory(b->context, "the report") : QMAT_OK;
}

static qmat_status build(feature_builder *b) {
  double *positions = qmat_arena_alloc(&b->context->arena, b->mesh->vertex_count, 3 * sizeof *positions);
  if (!positions) return qmat_fail_memory(b->context, "features");
  qmat_status status = qmat_frame_of_mesh(b->context, b->mesh, &b->frame);
  if (status != QMAT_OK) return status;
  qmat_frame_to_unit(&b->frame, b->mesh->positions, b->mesh->vertex_count, positions);
  b->positions = positions;
  status = place_features(b);
  if (status != QMAT_OK || b->feature_count == 0) return status;
  if ((status = make_graph(b)) == QMAT_OK && (status = find_anchors(b)) == QMAT_OK) status = link_features(b);
  return status;
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
    status = build(&b);
  if (status == QMAT_OK && b.feature_count > 0) {
    medial = qmat_medial_new();
    status = medial ? make_medial(&b, medial) : qmat_fail_memory(context, "the medial mesh");
  }
  if (status == QMAT_OK) status = make_report(&b, report);
  qmat_free(b.features);
  qmat_free(b.segments);
  qmat_free(b.edges);
  qmat_free(b.triangles);
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
    .version = 4,
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
