/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/crease_spheres.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/envelope.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/medial_complex.h"
#include "core/geometry/vector.h"
#include "nodes/initial/item_queue.h"
#include "nodes/initial/majority.h"

void qmat_crease_spheres_uninit(qmat_crease_spheres *creases) {
  qmat_free(creases->spheres);
  qmat_free(creases->segments);
  *creases = (qmat_crease_spheres){0};
}

qmat_status qmat_crease_spheres_add(qmat_context *context, const double centre[3], uint32_t vertex,
                                    qmat_crease_spheres *creases, uint32_t *id) {
  if (qmat_grow((void **)&creases->spheres, &creases->capacity, creases->count + 1, sizeof *creases->spheres))
    return qmat_fail_memory(context, "spheres on creases");
  *id = (uint32_t)creases->count++;
  creases->spheres[*id] = (qmat_crease_sphere){{centre[0], centre[1], centre[2]}, vertex};
  return QMAT_OK;
}

qmat_status qmat_crease_spheres_add_segment(qmat_context *context, uint32_t from, uint32_t to,
                                            qmat_crease_spheres *creases) {
  if (qmat_grow((void **)&creases->segments, &creases->segment_capacity, 2 * (creases->segment_count + 1),
                sizeof *creases->segments))
    return qmat_fail_memory(context, "segments of creases");
  creases->segments[2 * creases->segment_count] = from;
  creases->segments[2 * creases->segment_count++ + 1] = to;
  return QMAT_OK;
}

size_t qmat_medial_count_without_creases(const qmat_medial *medial) {
  size_t count = medial->sphere_count;
  while (count > medial->sheet_sphere_count && medial->spheres[4 * count - 1] == 0) count--;
  return count;
}

qmat_status qmat_crease_spheres_of_medial(qmat_context *context, const qmat_medial *medial,
                                          qmat_crease_spheres *creases) {
  const size_t first = qmat_medial_count_without_creases(medial);
  qmat_status status = QMAT_OK;
  for (size_t v = first; v < medial->sphere_count && status == QMAT_OK; v++) {
    const uint32_t *row = medial->region_offset_count > 0 ? &medial->region_offsets[v] : NULL;
    uint32_t id;
    status = qmat_crease_spheres_add(context, &medial->spheres[4 * v],
                                     row && row[1] > row[0] ? medial->region_samples[row[0]] : QMAT_NONE, creases, &id);
  }
  for (size_t e = 0; e < medial->edge_count && status == QMAT_OK; e++) {
    const uint32_t *ends = &medial->edges[2 * e];
    if (ends[0] < first || ends[1] < first) continue;
    status = qmat_crease_spheres_add_segment(context, ends[0] - (uint32_t)first, ends[1] - (uint32_t)first, creases);
  }
  return status;
}

/* The adjacency of the spheres, and the state of a shortest-path search along medial edges. */
typedef struct sheet_graph {
  const double *spheres; /* 4 per sphere, unit frame */
  size_t *starts;        /* per sphere, + 1 */
  uint32_t *neighbours;
  double *distances; /* per sphere: along edges from the root; valid in the search of `reached` */
  uint32_t *parents;
  uint32_t *reached, *finished, *wanted, *linked; /* per sphere: the last search that set this mark */
  uint32_t search;
  qmat_item_queue queue; /* of spheres, by their distances then */
} sheet_graph;

typedef struct linker {
  qmat_context *context;
  const qmat_frame *frame;
  const qmat_medial *bare;
  const qmat_crease_spheres *creases;
  uint32_t *anchors; /* per sphere of a crease: the sphere of the bare medial mesh that it is linked to */
  sheet_graph graph;
  uint32_t *edges, *triangles; /* of the result; heap */
  size_t edge_count, triangle_count, edge_capacity, triangle_capacity;
  qmat_crease_links *links;
} linker;

/* --- anchors ----------------------------------------------------------------------------------------------------- */

/* Of the corners of the nearest primitive, the one whose sphere is nearest. */
static uint32_t nearest_sphere(const qmat_envelope *envelope, const double *spheres, const double *point) {
  size_t primitive;
  uint32_t ids[3];
  qmat_envelope_distance(envelope, point, &primitive);
  const int count = qmat_envelope_primitive(envelope, primitive, ids);
  uint32_t best = QMAT_NONE;
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

static qmat_status find_anchors(linker *b) {
  qmat_envelope *envelope;
  const qmat_medial *m = b->bare;
  qmat_status status = qmat_envelope_new(b->context, b->graph.spheres, m->sphere_count, m->edges, m->edge_count,
                                         m->triangles, m->triangle_count, &envelope);
  if (status != QMAT_OK) return status;
  const int threads = qmat_threads(b->context);
  const size_t slice = 1 << 10;
  const size_t count = b->creases->count;
  for (size_t first = 0; first < count; first += slice) {
    if ((status = qmat_progress(b->context, first, count, "features")) != QMAT_OK) break;
    const size_t last = count - first < slice ? count : first + slice;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
    for (size_t i = first; i < last; i++) {
      double point[3];
      qmat_frame_to_unit(b->frame, b->creases->spheres[i].centre, 1, point);
      b->anchors[i] = nearest_sphere(envelope, b->graph.spheres, point);
    }
  }
  qmat_envelope_free(envelope);
  return status;
}

/* The sphere of a component that is nearest to a point. */
static uint32_t nearest_of_component(const linker *b, const uint32_t *components, uint32_t component,
                                     const double *point) {
  uint32_t best = QMAT_NONE;
  double least = INFINITY;
  for (uint32_t v = 0; v < b->bare->sphere_count; v++) {
    if (components[v] != component) continue;
    const double *s = &b->graph.spheres[4 * (size_t)v], distance = qmat_point_distance(s, point) - s[3];
    if (!(distance < least)) continue;
    least = distance;
    best = v;
  }
  return best;
}

/* Gives all spheres of joined creases anchors in one component of the medial mesh, that of most: beside a narrow gap
 * between two solids the nearest sphere may be the other one's. Few anchors change, so that they are searched one by
 * one. */
static qmat_status agree_on_components(linker *b) {
  const qmat_medial *m = b->bare;
  const qmat_crease_spheres *c = b->creases;
  uint32_t *components = qmat_sets_new(b->context, m->sphere_count), *sets = qmat_sets_new(b->context, c->count);
  qmat_vote *votes = qmat_arena_alloc(&b->context->arena, c->count, sizeof *votes);
  if (!components || !sets || !votes) return qmat_fail_memory(b->context, "features");
  for (size_t e = 0; e < m->edge_count; e++) qmat_sets_join(components, m->edges[2 * e], m->edges[2 * e + 1]);
  for (uint32_t v = 0; v < m->sphere_count; v++) components[v] = qmat_set_leader(components, v);
  for (size_t s = 0; s < c->segment_count; s++) qmat_sets_join(sets, c->segments[2 * s], c->segments[2 * s + 1]);
  for (uint32_t i = 0; i < c->count; i++) {
    sets[i] = qmat_set_leader(sets, i);
    votes[i] = (qmat_vote){sets[i], components[b->anchors[i]]};
  }
  const uint32_t *own = qmat_majorities(b->context, votes, c->count, c->count); /* per set of joined creases */
  if (!own) return qmat_fail_memory(b->context, "features");
  for (size_t i = 0; i < c->count; i++) {
    if (components[b->anchors[i]] == own[sets[i]]) continue;
    double point[3];
    const qmat_status status = qmat_progress(b->context, i, c->count, "features");
    if (status != QMAT_OK) return status;
    qmat_frame_to_unit(b->frame, c->spheres[i].centre, 1, point);
    b->anchors[i] = nearest_of_component(b, components, own[sets[i]], point);
  }
  return QMAT_OK;
}

/* --- shortest paths in the medial mesh --------------------------------------------------------------------------- */

static qmat_status make_graph(linker *b) {
  qmat_arena *arena = &b->context->arena;
  const qmat_medial *m = b->bare;
  const size_t count = m->sphere_count;
  sheet_graph *g = &b->graph;
  double *spheres = qmat_arena_alloc(arena, count, 4 * sizeof *spheres);
  g->starts = qmat_arena_calloc(arena, count + 2, sizeof *g->starts);
  g->neighbours = qmat_arena_alloc(arena, m->edge_count, 2 * sizeof *g->neighbours);
  g->distances = qmat_arena_alloc(arena, count, sizeof *g->distances);
  uint32_t **const rows[] = {&g->parents, &g->reached, &g->finished, &g->wanted, &g->linked};
  bool bad = !spheres || !g->starts || !g->neighbours || !g->distances;
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
    bad |= !(*rows[i] = qmat_arena_calloc(arena, count, sizeof **rows[i]));
  if (bad) return qmat_fail_memory(b->context, "the medial mesh");
  qmat_frame_spheres_to_unit(b->frame, m->spheres, count, spheres);
  g->spheres = spheres;
  for (size_t i = 0; i < 2 * m->edge_count; i++) g->starts[m->edges[i] + 2]++;
  for (size_t v = 0; v < count; v++) g->starts[v + 2] += g->starts[v + 1];
  for (size_t i = 0; i < 2 * m->edge_count; i++) g->neighbours[g->starts[m->edges[i] + 1]++] = m->edges[i ^ 1];
  return QMAT_OK;
}

static qmat_status reach(linker *b, uint32_t sphere, double distance, uint32_t parent) {
  sheet_graph *g = &b->graph;
  g->distances[sphere] = distance;
  g->parents[sphere] = parent;
  g->reached[sphere] = g->search;
  return qmat_queue_push(&g->queue, distance, sphere) ? qmat_fail_memory(b->context, "the medial mesh") : QMAT_OK;
}

/* Grows the tree of shortest paths from `root` (Dijkstra 1959) until it contains all wanted spheres, `missing` of them,
 * or all within `longest`. */
static qmat_status find_paths(linker *b, uint32_t root, size_t missing, double longest) {
  sheet_graph *g = &b->graph;
  g->queue.count = 0;
  qmat_status status = reach(b, root, 0, QMAT_NONE);
  while (g->queue.count && missing && status == QMAT_OK) {
    const uint32_t v = (uint32_t)qmat_queue_pop(&g->queue).item;
    if (g->finished[v] == g->search) continue; /* it came nearer after it was queued */
    if (g->distances[v] > longest) break;
    g->finished[v] = g->search;
    missing -= g->wanted[v] == g->search;
    for (size_t i = g->starts[v]; i < g->starts[v + 1] && status == QMAT_OK; i++) {
      const uint32_t w = g->neighbours[i];
      const double distance =
          g->distances[v] + qmat_point_distance(&g->spheres[4 * (size_t)v], &g->spheres[4 * (size_t)w]);
      if (g->finished[w] == g->search || (g->reached[w] == g->search && !(distance < g->distances[w]))) continue;
      status = reach(b, w, distance, v);
    }
  }
  return status;
}

/* --- slabs between creases and medial mesh ----------------------------------------------------------------------- */

static qmat_status add_edge(linker *b, uint32_t u, uint32_t v) {
  if (qmat_grow((void **)&b->edges, &b->edge_capacity, 2 * (b->edge_count + 1), sizeof *b->edges))
    return qmat_fail_memory(b->context, "medial edges");
  b->edges[2 * b->edge_count] = u;
  b->edges[2 * b->edge_count++ + 1] = v;
  return QMAT_OK;
}

static qmat_status add_triangle(linker *b, uint32_t u, uint32_t v, uint32_t w) {
  if (qmat_grow((void **)&b->triangles, &b->triangle_capacity, 3 * (b->triangle_count + 1), sizeof *b->triangles))
    return qmat_fail_memory(b->context, "medial slabs");
  const uint32_t corners[3] = {u, v, w};
  memcpy(&b->triangles[3 * b->triangle_count++], corners, sizeof corners);
  return QMAT_OK;
}

/* A path between two anchors that is longer than the way over the crease by this factor is a detour. Its slabs would
 * leave the solid. On clean models the factor is below 4; where the medial mesh is torn it is 20 to 100. */
static const double longest_detour = 8;

/* The longest path that links the segment from crease sphere `from` to `to`. */
static double longest_path(const linker *b, uint32_t from, uint32_t to) {
  double p[3], q[3];
  qmat_frame_to_unit(b->frame, b->creases->spheres[from].centre, 1, p);
  qmat_frame_to_unit(b->frame, b->creases->spheres[to].centre, 1, q);
  return longest_detour *
         (qmat_point_distance(&b->graph.spheres[4 * (size_t)b->anchors[from]], p) + qmat_point_distance(p, q) +
          qmat_point_distance(q, &b->graph.spheres[4 * (size_t)b->anchors[to]]));
}

/* Links one sphere of a crease and the segments that start at it: a fan of slabs over the tree of paths from its anchor
 * to the anchors of the next spheres, and a slab on each segment. A cone over a tree keeps the homotopy type, and so
 * does a slab that adds one free edge. `next` holds the other ends of the segments. */
static qmat_status link_sphere(linker *b, uint32_t id, const uint32_t *next, size_t count) {
  sheet_graph *g = &b->graph;
  const uint32_t first = (uint32_t)b->bare->sphere_count, sphere = first + id, root = b->anchors[id];
  qmat_status status = add_edge(b, sphere, root);
  size_t missing = 0;
  double longest = 0;
  g->search++;
  for (size_t i = 0; i < count; i++) {
    const uint32_t anchor = b->anchors[next[i]];
    longest = qmat_larger(longest, longest_path(b, id, next[i]));
    missing += g->wanted[anchor] != g->search;
    g->wanted[anchor] = g->search;
  }
  if (status == QMAT_OK) status = find_paths(b, root, missing, longest);
  g->linked[root] = g->search;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    const uint32_t anchor = b->anchors[next[i]];
    if (g->finished[anchor] != g->search || g->distances[anchor] > longest_path(b, id, next[i])) {
      b->links->gaps++;
      continue;
    }
    b->links->longest = fmax(b->links->longest, g->distances[anchor]);
    for (uint32_t v = anchor; g->linked[v] != g->search && status == QMAT_OK; v = g->parents[v]) {
      g->linked[v] = g->search;
      status = add_triangle(b, sphere, v, g->parents[v]);
    }
    if (status == QMAT_OK) status = add_triangle(b, sphere, first + next[i], anchor);
  }
  return status;
}

static qmat_status link_spheres(linker *b) {
  qmat_arena *arena = &b->context->arena;
  const qmat_crease_spheres *c = b->creases;
  size_t *starts = qmat_arena_calloc(arena, c->count + 2, sizeof *starts);
  uint32_t *next = qmat_arena_alloc(arena, c->segment_count, sizeof *next);
  if (!starts || !next) return qmat_fail_memory(b->context, "features");
  for (size_t s = 0; s < c->segment_count; s++) starts[c->segments[2 * s] + 2]++;
  for (size_t i = 0; i < c->count; i++) starts[i + 2] += starts[i + 1];
  for (size_t s = 0; s < c->segment_count; s++) next[starts[c->segments[2 * s] + 1]++] = c->segments[2 * s + 1];
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < c->count && status == QMAT_OK; i++) {
    if (i % 256 == 0) status = qmat_progress(b->context, i, c->count, "features");
    if (status == QMAT_OK) status = link_sphere(b, (uint32_t)i, &next[starts[i]], starts[i + 1] - starts[i]);
  }
  return status;
}

/* --- the result -------------------------------------------------------------------------------------------------- */

static qmat_status set_regions(const linker *b, qmat_medial *medial) {
  const qmat_medial *m = b->bare;
  const qmat_crease_spheres *c = b->creases;
  if (m->region_offset_count == 0) return QMAT_OK;
  medial->region_offset_count = medial->sphere_count + 1;
  medial->region_offsets = qmat_alloc(medial->region_offset_count, sizeof *medial->region_offsets);
  medial->region_samples = qmat_alloc(m->region_sample_count + c->count, sizeof *medial->region_samples);
  if (!medial->region_offsets || !medial->region_samples) return qmat_fail_memory(b->context, "regions");
  memcpy(medial->region_offsets, m->region_offsets, m->region_offset_count * sizeof *m->region_offsets);
  if (m->region_sample_count)
    memcpy(medial->region_samples, m->region_samples, m->region_sample_count * sizeof *m->region_samples);
  medial->region_sample_count = m->region_sample_count;
  for (size_t i = 0; i < c->count; i++) {
    if (c->spheres[i].vertex != QMAT_NONE) medial->region_samples[medial->region_sample_count++] = c->spheres[i].vertex;
    medial->region_offsets[m->sphere_count + i + 1] = (uint32_t)medial->region_sample_count;
  }
  return QMAT_OK;
}

static qmat_status make_medial(linker *b, qmat_medial *medial) {
  const qmat_medial *m = b->bare;
  medial->sphere_count = m->sphere_count + b->creases->count;
  medial->sheet_sphere_count = m->sheet_sphere_count;
  medial->spheres = qmat_alloc(medial->sphere_count, 4 * sizeof *medial->spheres);
  if (!medial->spheres) return qmat_fail_memory(b->context, "medial spheres");
  memcpy(medial->spheres, m->spheres, 4 * m->sphere_count * sizeof *medial->spheres);
  for (size_t i = 0; i < b->creases->count; i++) {
    double *sphere = &medial->spheres[4 * (m->sphere_count + i)];
    memcpy(sphere, b->creases->spheres[i].centre, 3 * sizeof *sphere);
    sphere[3] = 0;
  }
  qmat_status status = QMAT_OK;
  for (size_t e = 0; e < m->edge_count && status == QMAT_OK; e++)
    status = add_edge(b, m->edges[2 * e], m->edges[2 * e + 1]);
  for (size_t t = 0; t < m->triangle_count && status == QMAT_OK; t++)
    status = add_triangle(b, m->triangles[3 * t], m->triangles[3 * t + 1], m->triangles[3 * t + 2]);
  if (status == QMAT_OK)
    status = qmat_medial_set_simplices(b->context, medial, b->edges, b->edge_count, b->triangles, b->triangle_count);
  if (status == QMAT_OK) status = set_regions(b, medial);
  return status == QMAT_OK ? qmat_value_seal(b->context, &medial->base) : status;
}

qmat_status qmat_crease_spheres_link(qmat_context *context, const qmat_frame *frame, const qmat_medial *bare,
                                     const qmat_crease_spheres *creases, qmat_medial **linked,
                                     qmat_crease_links *links) {
  *links = (qmat_crease_links){.gaps = 0};
  linker b = {.context = context,
              .frame = frame,
              .bare = bare,
              .creases = creases,
              .anchors = qmat_arena_alloc(&context->arena, creases->count, sizeof *b.anchors),
              .links = links};
  *linked = qmat_medial_new();
  qmat_status status = b.anchors && *linked ? QMAT_OK : qmat_fail_memory(context, "features");
  if (status == QMAT_OK) status = make_graph(&b);
  if (status == QMAT_OK) status = find_anchors(&b);
  if (status == QMAT_OK) status = agree_on_components(&b);
  if (status == QMAT_OK) status = link_spheres(&b);
  if (status == QMAT_OK) status = make_medial(&b, *linked);
  qmat_free(b.graph.queue.items);
  qmat_free(b.edges);
  qmat_free(b.triangles);
  if (status == QMAT_OK) return status;
  qmat_value_release(*linked ? &(*linked)->base : NULL);
  *linked = NULL;
  return status;
}
