/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_joints.h"

#include <math.h>
#include <string.h>

#include "core/geometry/half_edges.h"
#include "core/geometry/joint_weights.h"
#include "core/geometry/surface.h"
#include "core/geometry/vector.h"
#include "core/node.h"

/* Weights are compared about so far apart, in diagonals, at most at so many places of an edge. */
static const double SPACING = 0.01;
enum { LEAST_PARTS = 4, MOST_PARTS = 64, MOST_CORNERS = 3 * MOST_PARTS };
/* The first pass divides along the edges that are there; the next ones divide those between the new vertices. */
enum { MOST_PASSES = 4 };
/* What is allowed grows by this factor while there are too many triangles. */
static const double COARSER = 1.5;
/* So many vertices or edges are judged between two questions whether to go on. */
enum { SLICE = 2048 };

typedef struct edge {
  uint32_t ends[2]; /* by their places, so that edges in one place are divided alike */
  uint32_t parts;   /* equal ones, between which weights are compared */
  uint32_t first;   /* of the new vertices, which go from the first end to the second */
  uint64_t chosen;  /* bit i: a vertex comes after part i */
  double length;
} edge;

typedef struct influences {
  uint32_t joints[4];
  double weights[4];
} influences;

typedef struct division {
  qmat_context *context;
  const qmat_frame *frame;
  double allowed;
  qmat_surface *skinned; /* with joints */
  qmat_skin_triangles *surface;
  influences *known; /* per vertex */
  size_t known_capacity, edge_count;
  edge *edges;
  uint32_t *edge_of; /* per half-edge */
} division;

static void influences_at(const division *d, const double place[3], influences *found) {
  double point[3];
  qmat_frame_to_model(d->frame, place, 1, point);
  qmat_joints_at(d->skinned, point, found->joints, found->weights);
}

static double weight_of(const influences *of, uint32_t joint) {
  double weight = 0;
  for (int k = 0; k < 4; k++) weight += of->joints[k] == joint ? of->weights[k] : 0;
  return weight;
}

/* The largest difference of a weight from that between two others. */
static double difference_of(const influences *a, const influences *b, double at, const influences *found) {
  const influences *const all[] = {a, b, found};
  double most = 0;
  for (int i = 0; i < 12; i++) {
    const uint32_t joint = all[i / 4]->joints[i % 4];
    const double between = (1 - at) * weight_of(a, joint) + at * weight_of(b, joint);
    most = fmax(most, fabs(weight_of(found, joint) - between));
  }
  return most;
}

static void place_on(const division *d, const edge *e, uint32_t part, double place[3]) {
  const double *a = d->surface->positions + 3 * (size_t)e->ends[0], *b = d->surface->positions + 3 * (size_t)e->ends[1];
  const double at = (double)part / e->parts;
  for (int k = 0; k < 3; k++) place[k] = a[k] + at * (b[k] - a[k]);
}

/* Chooses the place between two where the weights differ most, and more on both sides of it. The error is about how far
 * a joint moves the place off the line between them: blends are as long as limbs are thick, or shorter. */
static void choose(const influences *found, double allowed, uint32_t low, uint32_t high, edge *e) {
  const double length = e->length * (high - low) / e->parts;
  double most = allowed;
  uint32_t worst = 0;
  for (uint32_t i = low + 1; i < high; i++) {
    const double at = (double)(i - low) / (high - low);
    const double error = length * difference_of(&found[low], &found[high], at, &found[i]);
    if (!(error > most)) continue;
    most = error;
    worst = i;
  }
  if (worst == 0) return;
  e->chosen |= (uint64_t)1 << (worst - 1);
  choose(found, allowed, low, worst, e);
  choose(found, allowed, worst, high, e);
}

/* Finds where an edge is to be divided. */
static void judge(const division *d, edge *e) {
  influences found[MOST_PARTS + 1];
  e->length = qmat_point_distance(d->surface->positions + 3 * (size_t)e->ends[0],
                                  d->surface->positions + 3 * (size_t)e->ends[1]);
  if (!(e->length > d->allowed)) return; /* no weight differs by more than 1 */
  e->parts = (uint32_t)fmin(fmax(ceil(e->length / SPACING), LEAST_PARTS), MOST_PARTS);
  found[0] = d->known[e->ends[0]];
  found[e->parts] = d->known[e->ends[1]];
  for (uint32_t i = 1; i < e->parts; i++) {
    double place[3];
    place_on(d, e, i, place);
    influences_at(d, place, &found[i]);
  }
  choose(found, d->allowed, 0, e->parts, e);
}

/* Finds the joints at vertices from `first` on. */
static qmat_status find_known(division *d, size_t first) {
  const size_t count = d->surface->vertex_count;
  const int threads = qmat_threads(d->context);
  if (qmat_grow((void **)&d->known, &d->known_capacity, count, sizeof *d->known))
    return qmat_fail_memory(d->context, "the joints of the skin");
  qmat_status status = QMAT_OK;
  for (size_t begin = first; begin < count && status == QMAT_OK; begin += SLICE) {
    const size_t end = count - begin < SLICE ? count : begin + SLICE;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t v = begin; v < end; v++) influences_at(d, d->surface->positions + 3 * v, &d->known[v]);
    status = qmat_progress(d->context, end, count, "vertices");
  }
  return status;
}

static bool comes_first(const double *positions, uint32_t a, uint32_t b) {
  for (size_t k = 0; k < 3; k++) {
    const double x = positions[3 * (size_t)a + k], y = positions[3 * (size_t)b + k];
    if (x != y) return x < y;
  }
  return a < b;
}

/* Lists the edges, and those of each triangle. */
static qmat_status list_edges(division *d) {
  qmat_half_edges h;
  const qmat_skin_triangles *surface = d->surface;
  qmat_status status =
      qmat_half_edges_sort(d->context, surface->vertex_count, surface->triangle_count, surface->triangles, &h);
  if (status != QMAT_OK) return status;
  d->edge_count = 0;
  d->edges = qmat_arena_alloc(&d->context->arena, h.count, sizeof *d->edges);
  d->edge_of = h.spare;
  if (!d->edges) return qmat_fail_memory(d->context, "the edges of the skin");
  for (size_t i = 0; i < h.count;) {
    const size_t last = qmat_edge_last(&h, i);
    const uint32_t a = qmat_half_edge_low(&h, h.order[i]), b = qmat_half_edge_high(&h, h.order[i]);
    const bool rises = comes_first(surface->positions, a, b);
    d->edges[d->edge_count] = (edge){.ends = {rises ? a : b, rises ? b : a}};
    for (; i < last; i++) d->edge_of[h.order[i]] = (uint32_t)d->edge_count;
    d->edge_count++;
  }
  return QMAT_OK;
}

/* Judges the edges with an end from `first` on. Those between older vertices have been judged before. */
static qmat_status judge_edges(division *d, size_t first) {
  const int threads = qmat_threads(d->context);
  qmat_status status = QMAT_OK;
  for (size_t begin = 0; begin < d->edge_count && status == QMAT_OK; begin += SLICE) {
    const size_t end = d->edge_count - begin < SLICE ? d->edge_count : begin + SLICE;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t i = begin; i < end; i++)
      if (d->edges[i].ends[0] >= first || d->edges[i].ends[1] >= first) judge(d, &d->edges[i]);
    status = qmat_progress(d->context, end, d->edge_count, "edges");
  }
  return status;
}

static size_t count_chosen(const edge *e) {
  return (size_t)__builtin_popcountll(e->chosen);
}

/* A triangle with more vertices on its sides. */
typedef struct polygon {
  size_t count;
  uint32_t ids[MOST_CORNERS];
  uint8_t sides[MOST_CORNERS]; /* bit k: on side k */
} polygon;

static void put_corner(polygon *p, uint32_t id, size_t sides) {
  p->ids[p->count] = id;
  p->sides[p->count++] = (uint8_t)sides;
}

static void make_polygon(const division *d, size_t triangle, polygon *p) {
  p->count = 0;
  for (size_t k = 0; k < 3; k++) {
    const uint32_t start = d->surface->triangles[3 * triangle + k];
    const edge *e = &d->edges[d->edge_of[3 * triangle + k]];
    const uint32_t count = (uint32_t)count_chosen(e);
    put_corner(p, start, (size_t)1 << k | (size_t)1 << (k + 2) % 3);
    for (uint32_t i = 0; i < count; i++)
      put_corner(p, e->first + (start == e->ends[0] ? i : count - 1 - i), (size_t)1 << k);
  }
}

/* Whether a corner can be cut off: it and its neighbours are on no line, and neither are those that are left. */
static bool is_ear(const polygon *p, size_t at) {
  const size_t next = (at + 1) % p->count, last = (at + p->count - 1) % p->count;
  uint8_t rest = 7;
  for (size_t i = 0; i < p->count; i++)
    if (i != at) rest &= p->sides[i];
  return !(p->sides[last] & p->sides[at] & p->sides[next]) && (rest == 0 || p->count == 3);
}

/* Cuts off corners, those across the shortest diagonals first: rings of vertices around a limb are joined so. Returns
 * the number of triangles. */
static size_t cut(polygon *p, const double *positions, uint32_t *triangles) {
  size_t made = 0;
  while (p->count >= 3) {
    size_t best = 0, found = 0;
    double least = INFINITY;
    for (size_t i = 0; i < p->count; i++) {
      if (!is_ear(p, i)) continue;
      const double length = qmat_point_distance(positions + 3 * (size_t)p->ids[(i + 1) % p->count],
                                                positions + 3 * (size_t)p->ids[(i + p->count - 1) % p->count]);
      if (found++ > 0 && !(length < least)) continue;
      least = length;
      best = i;
    }
    uint32_t *row = triangles + 3 * made++;
    row[0] = p->ids[(best + p->count - 1) % p->count];
    row[1] = p->ids[best];
    row[2] = p->ids[(best + 1) % p->count];
    p->count--;
    memmove(p->ids + best, p->ids + best + 1, (p->count - best) * sizeof *p->ids);
    memmove(p->sides + best, p->sides + best + 1, (p->count - best) * sizeof *p->sides);
  }
  return made;
}

/* Divides the edges by `vertices` new vertices, into `triangles` more triangles. */
static qmat_status divide(division *d, size_t vertices, size_t triangles) {
  qmat_skin_triangles *surface = d->surface;
  if (vertices >= UINT32_MAX - surface->vertex_count)
    return qmat_fail(d->context, QMAT_ERROR_GEOMETRY, "the skin needs more than 2^32 - 1 vertices");
  qmat_skin_triangles made = {
      .positions = qmat_alloc(3 * (surface->vertex_count + vertices), sizeof *made.positions),
      .triangles = qmat_alloc(3 * (surface->triangle_count + triangles), sizeof *made.triangles),
  };
  if (!made.positions || !made.triangles) {
    qmat_free(made.positions);
    qmat_free(made.triangles);
    return qmat_fail_memory(d->context, "the skin");
  }
  memcpy(made.positions, surface->positions, 3 * surface->vertex_count * sizeof *made.positions);
  made.vertex_count = surface->vertex_count;
  for (size_t i = 0; i < d->edge_count; i++) {
    edge *e = &d->edges[i];
    e->first = (uint32_t)made.vertex_count;
    for (uint32_t part = 1; part < e->parts; part++)
      if (e->chosen >> (part - 1) & 1) place_on(d, e, part, made.positions + 3 * made.vertex_count++);
  }
  for (size_t t = 0; t < surface->triangle_count; t++) {
    polygon p;
    make_polygon(d, t, &p);
    made.triangle_count += cut(&p, made.positions, made.triangles + 3 * made.triangle_count);
  }
  qmat_free(surface->positions);
  qmat_free(surface->triangles);
  *surface = made;
  return QMAT_OK;
}

/* One pass over the surface, whose vertices from `first` on are new. `*is_divided`: there are more now. */
static qmat_status run_pass(division *d, size_t first, bool *is_divided) {
  const size_t count = d->surface->triangle_count;
  *is_divided = false;
  qmat_status status = find_known(d, first);
  if (status == QMAT_OK) status = list_edges(d);
  if (status == QMAT_OK) status = judge_edges(d, first);
  if (status != QMAT_OK) return status;
  uint32_t *uses = qmat_arena_calloc(&d->context->arena, d->edge_count, sizeof *uses);
  if (!uses) return qmat_fail_memory(d->context, "the edges of the skin");
  for (size_t h = 0; h < 3 * count; h++) uses[d->edge_of[h]]++;
  size_t vertices = 0, triangles = 0;
  for (size_t i = 0; i < d->edge_count; i++) {
    vertices += count_chosen(&d->edges[i]);
    triangles += count_chosen(&d->edges[i]) * uses[i];
  }
  *is_divided = vertices > 0;
  return *is_divided ? divide(d, vertices, triangles) : QMAT_OK;
}

static qmat_status run_passes(division *d) {
  qmat_status status = QMAT_OK;
  bool is_divided = true;
  size_t first = 0;
  for (int pass = 0; pass < MOST_PASSES && is_divided && status == QMAT_OK; pass++) {
    const size_t before = d->surface->vertex_count;
    status = run_pass(d, first, &is_divided);
    first = before;
  }
  return status;
}

qmat_status qmat_skin_divide_at_joints(qmat_context *context, const qmat_mesh *mesh, const qmat_frame *frame,
                                       double allowed, size_t most, qmat_skin_triangles *surface) {
  if (mesh->skinned_count == 0 || surface->triangle_count == 0) return QMAT_OK;
  division d = {.context = context, .frame = frame, .allowed = allowed, .surface = surface};
  const qmat_skin_triangles given = *surface;
  bool fits = false;
  qmat_status status = qmat_surface_new(context, mesh, &d.skinned);
  while (status == QMAT_OK && !fits) {
    surface->positions = qmat_alloc(3 * given.vertex_count, sizeof *surface->positions);
    surface->triangles = qmat_alloc(3 * given.triangle_count, sizeof *surface->triangles);
    surface->vertex_count = given.vertex_count;
    surface->triangle_count = given.triangle_count;
    if (!surface->positions || !surface->triangles) {
      status = qmat_fail_memory(context, "the skin");
    } else {
      memcpy(surface->positions, given.positions, 3 * given.vertex_count * sizeof *given.positions);
      memcpy(surface->triangles, given.triangles, 3 * given.triangle_count * sizeof *given.triangles);
      status = run_passes(&d);
    }
    fits = status == QMAT_OK &&
           (most == 0 || surface->triangle_count <= most || surface->vertex_count == given.vertex_count);
    if (!fits) {
      qmat_free(surface->positions);
      qmat_free(surface->triangles);
      *surface = given;
    }
    d.allowed *= COARSER;
  }
  if (fits) {
    qmat_free(given.positions);
    qmat_free(given.triangles);
  }
  qmat_free(d.known);
  qmat_surface_free(d.skinned);
  return status;
}
