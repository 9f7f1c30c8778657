/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/lost_handles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/envelope.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/medial_complex.h"
#include "core/geometry/sheets.h"
#include "core/geometry/vector.h"

/* Loops start at so many vertices at most, and a search is given up after so many steps. */
enum { MOST_STARTS = 4096, MOST_STEPS = 1 << 17 };

/* The classes of loops are the bits of a word. */
enum { MOST_CLASSES = 64 };

typedef struct {
  uint32_t ends[2], triangles[2];
  uint64_t class; /* a loop bounds part of the surface if the classes of its edges cancel (Z/2) */
  double length;
} surface_edge;

typedef struct {
  qmat_lost_handle handle;
  uint64_t class;
  bool is_lost; /* its middle is on different sides of surface and envelope */
} candidate;

/* The edges of the surface, the edges at each vertex, and the newest search. */
typedef struct {
  const qmat_mesh *mesh;
  const double *positions;
  surface_edge *edges;
  size_t edge_count;
  uint32_t *offsets, *around; /* the edges at vertex v: around[offsets[v]] to around[offsets[v + 1] - 1] */
  double *distances;          /* per vertex, from the start; INFINITY: not reached */
  uint32_t *parents;          /* per vertex: the edge it was reached by */
  uint64_t *classes;          /* per vertex: of the path to it */
  uint32_t *reached, *queue;
  uint8_t *queued;
  size_t reached_count;
} search;

/* `*paired`: whether every edge has two triangles. */
static qmat_status find_edges(qmat_context *context, search *s, bool *paired) {
  const size_t corners = 3 * s->mesh->triangle_count;
  s->edge_count = corners / 2;
  s->edges = qmat_arena_calloc(&context->arena, s->edge_count, sizeof *s->edges);
  if (!s->edges) return qmat_fail_memory(context, "handles");
  qmat_half_edges sides;
  const qmat_status status =
      qmat_half_edges_sort(context, s->mesh->vertex_count, s->mesh->triangle_count, s->mesh->triangles, &sides);
  if (status != QMAT_OK) return status;
  *paired = true;
  for (size_t c = 0; c < corners; c += 2) {
    *paired = qmat_edge_last(&sides, c) == c + 2;
    if (!*paired) return QMAT_OK;
    const uint32_t first = sides.order[c], second = sides.order[c + 1];
    surface_edge *edge = &s->edges[c / 2];
    *edge = (surface_edge){.ends = {qmat_half_edge_low(&sides, first), qmat_half_edge_high(&sides, first)},
                           .triangles = {first / 3, second / 3}};
    edge->length =
        qmat_point_distance(&s->positions[3 * (size_t)edge->ends[0]], &s->positions[3 * (size_t)edge->ends[1]]);
  }
  return QMAT_OK;
}

/* Finds the classes: 0 on a spanning forest of the vertices, a bit of its own on each edge that neither this nor a
 * spanning forest of the triangles has, and on the edges of the latter what makes the classes of each triangle cancel.
 * `*classes`: their number, or more than MOST_CLASSES. */
static qmat_status classify(qmat_context *context, search *s, size_t *classes) {
  const size_t triangles = s->mesh->triangle_count;
  uint32_t *trees = qmat_sets_new(context, s->mesh->vertex_count), *cotrees = qmat_sets_new(context, triangles);
  uint8_t *open = qmat_arena_calloc(&context->arena, s->edge_count, sizeof *open);
  uint32_t *open_sides = qmat_arena_calloc(&context->arena, triangles, sizeof *open_sides);
  uint32_t *queue = qmat_arena_alloc(&context->arena, triangles, sizeof *queue);
  uint32_t *edges_of = qmat_arena_alloc(&context->arena, triangles, 3 * sizeof *edges_of);
  uint8_t *sides = qmat_arena_calloc(&context->arena, triangles, sizeof *sides);
  if (!trees || !cotrees || !open || !open_sides || !queue || !edges_of || !sides)
    return qmat_fail_memory(context, "handles");
  *classes = 0;
  for (uint32_t e = 0; e < s->edge_count; e++) {
    const uint32_t *of = s->edges[e].triangles;
    for (int k = 0; k < 2; k++) edges_of[3 * (size_t)of[k] + sides[of[k]]++] = e;
    if (qmat_sets_join(trees, s->edges[e].ends[0], s->edges[e].ends[1])) continue;
    if (qmat_sets_join(cotrees, of[0], of[1])) {
      open[e] = 1;
      for (int k = 0; k < 2; k++) open_sides[of[k]]++;
    } else if (++*classes <= MOST_CLASSES) {
      s->edges[e].class = (uint64_t)1 << (*classes - 1);
    }
  }
  size_t last = 0;
  for (uint32_t t = 0; t < triangles; t++)
    if (open_sides[t] == 1) queue[last++] = t;
  for (size_t i = 0; i < last; i++) { /* leaves of the forest of triangles */
    const uint32_t *edges = &edges_of[3 * (size_t)queue[i]];
    uint64_t class = 0;
    uint32_t left = QMAT_NONE;
    for (int k = 0; k < 3; k++) {
      class ^= s->edges[edges[k]].class;
      if (open[edges[k]]) left = edges[k];
    }
    if (left == QMAT_NONE) continue;
    s->edges[left].class = class;
    open[left] = 0;
    for (int k = 0; k < 2; k++) {
      const uint32_t of = s->edges[left].triangles[k];
      if (--open_sides[of] == 1) queue[last++] = of;
    }
  }
  return QMAT_OK;
}

static qmat_status prepare_search(qmat_context *context, search *s) {
  const size_t vertices = s->mesh->vertex_count;
  qmat_arena *arena = &context->arena;
  s->offsets = qmat_arena_calloc(arena, vertices + 2, sizeof *s->offsets);
  s->around = qmat_arena_alloc(arena, 2 * s->edge_count, sizeof *s->around);
  s->distances = qmat_arena_alloc(arena, vertices, sizeof *s->distances);
  s->parents = qmat_arena_alloc(arena, vertices, sizeof *s->parents);
  s->classes = qmat_arena_alloc(arena, vertices, sizeof *s->classes);
  s->reached = qmat_arena_alloc(arena, vertices, sizeof *s->reached);
  s->queue = qmat_arena_alloc(arena, vertices, sizeof *s->queue);
  s->queued = qmat_arena_calloc(arena, vertices, sizeof *s->queued);
  if (!s->offsets || !s->around || !s->distances || !s->parents || !s->classes || !s->reached || !s->queue ||
      !s->queued)
    return qmat_fail_memory(context, "handles");
  for (size_t v = 0; v < vertices; v++) s->distances[v] = INFINITY;
  for (size_t e = 0; e < s->edge_count; e++)
    for (int k = 0; k < 2; k++) s->offsets[s->edges[e].ends[k] + 2]++;
  for (size_t v = 0; v < vertices; v++) s->offsets[v + 2] += s->offsets[v + 1];
  for (uint32_t e = 0; e < s->edge_count; e++)
    for (int k = 0; k < 2; k++) s->around[s->offsets[s->edges[e].ends[k] + 1]++] = e;
  return QMAT_OK;
}

static uint32_t other_end(const search *s, uint32_t edge, uint32_t vertex) {
  const uint32_t *ends = s->edges[edge].ends;
  return ends[0] == vertex ? ends[1] : ends[0];
}

/* Shortest paths from `start` to all vertices within `radius`, by repeated relaxation in a ring of vertices. False if
 * given up. */
static bool reach(search *s, uint32_t start, double radius) {
  const size_t vertices = s->mesh->vertex_count;
  for (size_t i = 0; i < s->reached_count; i++) s->distances[s->reached[i]] = INFINITY;
  size_t first = 0, waiting = 1;
  s->reached_count = 1;
  s->reached[0] = s->queue[0] = start;
  s->distances[start] = 0;
  s->classes[start] = 0;
  s->parents[start] = QMAT_NONE;
  int step = 0;
  for (; waiting > 0; step++, waiting--) {
    const uint32_t v = s->queue[first];
    first = (first + 1) % vertices;
    s->queued[v] = 0;
    for (uint32_t i = s->offsets[v]; step < MOST_STEPS && i < s->offsets[v + 1]; i++) {
      const surface_edge *edge = &s->edges[s->around[i]];
      const uint32_t w = other_end(s, s->around[i], v);
      const double distance = s->distances[v] + edge->length;
      if (!(distance <= radius) || !(distance < s->distances[w])) continue;
      if (s->distances[w] == INFINITY) s->reached[s->reached_count++] = w;
      s->distances[w] = distance;
      s->parents[w] = s->around[i];
      s->classes[w] = s->classes[v] ^ edge->class;
      if (s->queued[w]) continue;
      s->queued[w] = 1;
      s->queue[(first + waiting - 1) % vertices] = w;
      waiting++;
    }
  }
  return step <= MOST_STEPS;
}

/* The step from a vertex towards the start; its edge is added to the middle. */
static uint32_t step_back(const search *s, uint32_t vertex, double middle[3]) {
  const surface_edge *edge = &s->edges[s->parents[vertex]];
  for (size_t k = 0; k < 3; k++)
    middle[k] += 0.5 * edge->length *
                 (s->positions[3 * (size_t)edge->ends[0] + k] + s->positions[3 * (size_t)edge->ends[1] + k]);
  return other_end(s, s->parents[vertex], vertex);
}

/* The loop of an edge and the paths from its ends to where they meet. Parents are nearer to the start than children, so
 * the farther end goes back first. */
static void follow(const search *s, const surface_edge *edge, double middle[3], double *length) {
  uint32_t a = edge->ends[0], b = edge->ends[1];
  *length = edge->length + s->distances[a] + s->distances[b];
  for (size_t k = 0; k < 3; k++)
    middle[k] = 0.5 * edge->length * (s->positions[3 * (size_t)a + k] + s->positions[3 * (size_t)b + k]);
  while (a != b) {
    const bool from_a = s->distances[a] > s->distances[b] || (s->distances[a] == s->distances[b] && a > b);
    uint32_t *end = from_a ? &a : &b;
    if (s->parents[*end] == QMAT_NONE) end = from_a ? &b : &a; /* edges without length */
    *end = step_back(s, *end, middle);
  }
  *length -= 2 * s->distances[a];
  for (int k = 0; k < 3 && *length > 0; k++) middle[k] /= *length;
}

/* The shortest loop among those of the newest search that bound no part of the surface. */
static bool find_loop(const search *s, double longest, candidate *best) {
  best->handle.size = longest;
  bool found = false;
  for (size_t i = 0; i < s->reached_count; i++) {
    const uint32_t v = s->reached[i];
    for (uint32_t j = s->offsets[v]; j < s->offsets[v + 1]; j++) {
      const surface_edge *edge = &s->edges[s->around[j]];
      const uint32_t a = edge->ends[0], b = edge->ends[1];
      if (v != a || s->distances[b] == INFINITY) continue; /* from its first end only */
      const uint64_t class = s->classes[a] ^ s->classes[b] ^ edge->class;
      double middle[3], length;
      if (class == 0) continue;
      follow(s, edge, middle, &length);
      if (!(length < best->handle.size)) continue;
      best->handle.size = length;
      memcpy(best->handle.place, middle, sizeof middle);
      best->class = class;
      found = true;
    }
  }
  best->handle.size /= QMAT_PI;
  return found;
}

static int compare_candidates(const void *left, const void *right) {
  const candidate *a = left, *b = right;
  if (a->is_lost != b->is_lost) return a->is_lost ? -1 : 1;
  if (a->handle.size != b->handle.size) return a->handle.size < b->handle.size ? -1 : 1;
  return memcmp(a->handle.place, b->handle.place, sizeof a->handle.place);
}

/* Keeps the first candidates that those before them do not make up, by elimination. */
static size_t keep_independent(const candidate *candidates, size_t count, size_t most, qmat_lost_handle *handles) {
  uint64_t rows[MOST_CLASSES] = {0}; /* by highest bit */
  size_t kept = 0;
  for (size_t i = 0; i < count && kept < most; i++) {
    uint64_t class = candidates[i].class;
    for (int bit = MOST_CLASSES - 1; bit >= 0 && class; bit--) {
      if (!(class >> bit & 1)) continue;
      if (rows[bit] == 0) {
        rows[bit] = class;
        handles[kept++] = candidates[i].handle;
        break;
      }
      class ^= rows[bit];
    }
  }
  return kept;
}

qmat_status qmat_lost_handles_find(qmat_context *context, const qmat_surface *surface, const qmat_medial *unit,
                                   double longest, size_t most, qmat_lost_handle **handles, size_t *count) {
  const qmat_mesh solids = qmat_mesh_of_solids(qmat_surface_mesh(surface));
  search s = {.mesh = &solids, .positions = qmat_surface_positions(surface)};
  bool paired = false;
  size_t classes = 0, found = 0;
  *count = 0;
  qmat_status status = find_edges(context, &s, &paired);
  if (status == QMAT_OK && paired) status = classify(context, &s, &classes);
  if (status != QMAT_OK || classes == 0 || classes > MOST_CLASSES) return status;
  const size_t stride = (solids.vertex_count + MOST_STARTS - 1) / MOST_STARTS;
  candidate *candidates = qmat_arena_alloc(&context->arena, MOST_STARTS, sizeof *candidates);
  *handles = qmat_arena_alloc(&context->arena, MOST_CLASSES, sizeof **handles);
  if (!candidates || !*handles) return qmat_fail_memory(context, "handles");
  status = prepare_search(context, &s);
  qmat_envelope *envelope = NULL;
  if (status == QMAT_OK) status = qmat_envelope_of_medial(context, unit, &envelope);
  for (size_t v = 0; v < solids.vertex_count && status == QMAT_OK; v += stride) {
    candidate *next = &candidates[found];
    status = qmat_progress(context, 1, 1, "handles");
    if (status != QMAT_OK || !reach(&s, (uint32_t)v, 0.5 * longest) || !find_loop(&s, longest, next)) continue;
    next->handle.is_hole = !qmat_surface_inside(surface, next->handle.place);
    next->is_lost = next->handle.is_hole == (qmat_envelope_distance(envelope, next->handle.place, NULL) <= 0);
    found++;
  }
  qmat_envelope_free(envelope);
  if (status != QMAT_OK) return status;
  if (found) qsort(candidates, found, sizeof *candidates, compare_candidates);
  *count = keep_independent(candidates, found, most, *handles);
  return QMAT_OK;
}
