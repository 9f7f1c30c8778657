/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/triangle.h"

/* What is seen of the holes from a point of the surface, as a share of all directions. At most this much is near 0. */
static const double most_seen = 0.2;
/* A solid with holes has such points on at least this share of its area. */
static const double least_filled = 0.7;
/* Points of a part from which its holes are looked at, and solid angles that are computed for it. */
enum { MOST_POINTS = 256, FEWEST_POINTS = 16, MOST_ANGLES = 1 << 20 };
/* Pieces are turned or taken out until nothing is gained, in at most this many rounds. */
enum { MOST_ROUNDS = 4 };

/* A piece is connected across edges of two triangles that agree. */
typedef struct piece {
  uint32_t leader; /* triangle */
  double area;
  size_t first_tie, tie_count;
} piece;

/* A piece at an edge where it meets others. */
typedef struct tie {
  uint32_t leader;
  int32_t rising; /* triangles of the piece there that rise, less those that fall */
  size_t edge;    /* the first half-edge of the edge in the order */
  double length;
} tie;

typedef struct border_edge {
  uint32_t part, from, to;
  uint32_t third; /* the corner opposite to it in a triangle there */
} border_edge;

typedef struct division {
  qmat_context *context;
  qmat_parts *parts;
  qmat_half_edges edges;
  uint32_t *pieces; /* disjoint sets of triangles */
  int8_t *states;   /* per piece, by its leader: 1 as given, -1 turned, 0 a part of its own */
  int32_t *balance; /* per edge, by its first half-edge in the order: rising less falling triangles of its shell */
  border_edge *border;
  size_t border_count;
  double *samples; /* scratch: 3 * MOST_POINTS */
} division;

static qmat_status fail_shortage(const division *d) {
  return qmat_fail_memory(d->context, "the parts of the mesh");
}

static const double *position(const division *d, uint32_t vertex) {
  return d->parts->positions + 3 * (size_t)vertex;
}

static double edge_length(const division *d, uint32_t h) {
  return qmat_point_distance(position(d, qmat_half_edge_start(&d->edges, h)),
                             position(d, qmat_half_edge_end(&d->edges, h)));
}

static double area_of(const division *d, size_t t) {
  const uint32_t *c = d->parts->triangles + 3 * t;
  double normal[3];
  qmat_triangle_normal(position(d, c[0]), position(d, c[1]), position(d, c[2]), normal);
  return sqrt(qmat_dot(normal, normal)) / 2;
}

/* ---- pieces ---- */

static qmat_status find_pieces(division *d) {
  const qmat_half_edges *e = &d->edges;
  const size_t count = d->parts->triangle_count;
  d->pieces = qmat_sets_new(d->context, count);
  d->states = qmat_arena_alloc(&d->context->arena, count, sizeof *d->states);
  d->balance = qmat_arena_calloc(&d->context->arena, e->count, sizeof *d->balance);
  if (!d->pieces || !d->states || !d->balance) return fail_shortage(d);
  memset(d->states, 1, count);
  for (size_t first = 0, last; first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    for (size_t i = first; i < last; i++) d->balance[first] += qmat_half_edge_rises(e, e->order[i]) ? 1 : -1;
    if (last - first == 2 && d->balance[first] == 0)
      qmat_sets_join(d->pieces, e->order[first] / 3, e->order[first + 1] / 3);
  }
  return QMAT_OK;
}

static int compare_ties(const void *left, const void *right) {
  const tie *a = left, *b = right;
  if (a->leader != b->leader) return a->leader < b->leader ? -1 : 1;
  return (a->edge > b->edge) - (a->edge < b->edge);
}

static int compare_pieces(const void *left, const void *right) {
  const piece *a = left, *b = right;
  if (a->area != b->area) return a->area < b->area ? -1 : 1;
  return (a->leader > b->leader) - (a->leader < b->leader);
}

/* The ties of all pieces, by piece; one for each triangle, with the same edge twice where a piece has two there. */
static qmat_status find_ties(const division *d, tie **ties, size_t *tie_count) {
  const qmat_half_edges *e = &d->edges;
  size_t count = 0;
  *ties = NULL;
  for (int pass = 0; pass < 2; pass++) {
    count = 0;
    for (size_t first = 0, last; first < e->count; first = last) {
      last = qmat_edge_last(e, first);
      const bool is_regular = last - first == 1 || (last - first == 2 && d->balance[first] == 0);
      for (size_t i = first; i < last && !is_regular; i++, count++) {
        if (pass == 0) continue;
        const uint32_t h = e->order[i];
        (*ties)[count] =
            (tie){qmat_set_leader(d->pieces, h / 3), qmat_half_edge_rises(e, h) ? 1 : -1, first, edge_length(d, h)};
      }
    }
    if (pass == 0 && count > 0 && !(*ties = qmat_arena_alloc(&d->context->arena, count, sizeof **ties)))
      return fail_shortage(d);
  }
  if (count > 0) qsort(*ties, count, sizeof **ties, compare_ties);
  size_t merged = 0;
  for (size_t i = 0; i < count; i++) {
    tie *last = merged > 0 ? &(*ties)[merged - 1] : NULL;
    if (last && compare_ties(last, &(*ties)[i]) == 0)
      last->rising += (*ties)[i].rising;
    else
      (*ties)[merged++] = (*ties)[i];
  }
  *tie_count = merged;
  return QMAT_OK;
}

/* By how much the border grows shorter when the state of a piece changes. */
static double gain_of(const division *d, const tie *ties, size_t count, int from, int to) {
  double gain = 0;
  for (size_t i = 0; i < count; i++) {
    const int32_t before = d->balance[ties[i].edge], after = before + (to - from) * ties[i].rising;
    gain += ties[i].length * (abs(before) - abs(after));
  }
  return gain;
}

/* Turns pieces, or takes them out of their shell, where that leaves less of the shell open; small ones first. */
static qmat_status settle_pieces(division *d) {
  tie *ties = NULL;
  size_t tie_count = 0, count = 0;
  const qmat_status status = find_ties(d, &ties, &tie_count);
  if (status != QMAT_OK || tie_count == 0) return status;
  piece *pieces = qmat_arena_alloc(&d->context->arena, tie_count, sizeof *pieces);
  double *areas = qmat_arena_calloc(&d->context->arena, d->parts->triangle_count, sizeof *areas);
  if (!pieces || !areas) return fail_shortage(d);
  for (uint32_t t = 0; t < d->parts->triangle_count; t++) areas[qmat_set_leader(d->pieces, t)] += area_of(d, t);
  for (size_t first = 0, last; first < tie_count; first = last) {
    for (last = first; last < tie_count && ties[last].leader == ties[first].leader;) last++;
    pieces[count++] = (piece){ties[first].leader, areas[ties[first].leader], first, last - first};
  }
  qsort(pieces, count, sizeof *pieces, compare_pieces);
  bool any = true;
  for (int round = 0; round < MOST_ROUNDS && any; round++) {
    any = false;
    for (size_t i = 0; i < count; i++) {
      const piece *p = &pieces[i];
      int8_t *state = &d->states[p->leader];
      if (*state == 0) continue;
      const tie *own = ties + p->first_tie;
      const double turned = gain_of(d, own, p->tie_count, *state, -*state),
                   removed = gain_of(d, own, p->tie_count, *state, 0);
      if (!(fmax(turned, removed) > 0)) continue;
      const int8_t to = (int8_t)(turned >= removed ? -*state : 0);
      for (size_t k = 0; k < p->tie_count; k++) d->balance[own[k].edge] += (to - *state) * own[k].rising;
      *state = to;
      any = true;
    }
    const qmat_status stop = qmat_progress(d->context, 0, 0, "pieces");
    if (stop != QMAT_OK) return stop;
  }
  for (uint32_t t = 0; t < d->parts->triangle_count; t++) {
    if (d->states[qmat_set_leader(d->pieces, t)] >= 0) continue;
    uint32_t *c = d->parts->triangles + 3 * (size_t)t;
    const uint32_t corner = c[1];
    c[1] = c[2];
    c[2] = corner;
    d->parts->turned++;
  }
  return qmat_half_edges_sort(d->context, d->parts->vertex_count, d->parts->triangle_count, d->parts->triangles,
                              &d->edges);
}

/* ---- parts ---- */

static qmat_status find_parts(division *d) {
  qmat_parts *parts = d->parts;
  const qmat_half_edges *e = &d->edges;
  uint32_t *sets = qmat_sets_new(d->context, parts->triangle_count);
  parts->part_of = qmat_arena_alloc(&d->context->arena, parts->triangle_count, sizeof *parts->part_of);
  if (!sets || !parts->part_of) return fail_shortage(d);
  for (size_t first = 0, last; first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    uint32_t before = UINT32_MAX;
    for (size_t i = first; i < last; i++) {
      const uint32_t t = e->order[i] / 3, leader = qmat_set_leader(d->pieces, t);
      if (d->states[leader] == 0) {
        qmat_sets_join(sets, t, leader);
        continue;
      }
      if (before != UINT32_MAX) qmat_sets_join(sets, before, t);
      before = t;
    }
  }
  for (uint32_t t = 0; t < parts->triangle_count; t++) parts->part_count += qmat_set_leader(sets, t) == t;
  parts->parts = qmat_arena_calloc(&d->context->arena, parts->part_count, sizeof *parts->parts);
  if (!parts->parts) return fail_shortage(d);
  size_t count = 0;
  for (uint32_t t = 0; t < parts->triangle_count; t++) { /* the smallest triangle leads */
    const uint32_t leader = qmat_set_leader(sets, t);
    parts->part_of[t] = leader == t ? (uint32_t)count++ : parts->part_of[leader];
    parts->parts[parts->part_of[t]].triangle_count++;
  }
  return QMAT_OK;
}

/* ---- borders ---- */

/* A triangle at an edge, and its part. */
typedef struct edge_part {
  uint32_t part, half_edge;
} edge_part;

static int compare_edge_parts(const void *left, const void *right) {
  const edge_part *a = left, *b = right;
  if (a->part != b->part) return a->part < b->part ? -1 : 1;
  return (a->half_edge > b->half_edge) - (a->half_edge < b->half_edge);
}

static int compare_border_edges(const void *left, const void *right) {
  const border_edge *a = left, *b = right;
  if (a->part != b->part) return a->part < b->part ? -1 : 1;
  if (a->from != b->from) return a->from < b->from ? -1 : 1;
  return (a->to > b->to) - (a->to < b->to);
}

/* Adds the sides that caps need to have at one edge, where `here` are its triangles by part: what rises more often than
 * it falls has to fall. The first pass only counts them. */
static void find_border_at(division *d, const edge_part *here, size_t count, bool counts_only) {
  const qmat_half_edges *e = &d->edges;
  const uint32_t low = qmat_half_edge_low(e, here[0].half_edge), high = qmat_half_edge_high(e, here[0].half_edge);
  for (size_t first = 0, last; first < count; first = last) {
    const uint32_t part = here[first].part;
    int64_t rising = 0;
    uint32_t third = 0;
    for (last = first; last < count && here[last].part == part; last++) {
      const uint32_t h = here[last].half_edge;
      rising += qmat_half_edge_rises(e, h) ? 1 : -1;
      third = qmat_half_edge_across(e, h);
    }
    for (; rising != 0; rising += rising > 0 ? -1 : 1, d->border_count++)
      if (!counts_only)
        d->border[d->border_count] = (border_edge){part, rising > 0 ? high : low, rising > 0 ? low : high, third};
  }
}

static qmat_status find_border(division *d) {
  const qmat_half_edges *e = &d->edges;
  size_t most = 1;
  for (size_t first = 0, last; first < e->count; first = last) {
    last = qmat_edge_last(e, first);
    if (last - first > most) most = last - first;
  }
  edge_part *here = qmat_arena_alloc(&d->context->arena, most, sizeof *here);
  if (!here) return fail_shortage(d);
  for (int pass = 0; pass < 2; pass++) {
    d->border_count = 0;
    for (size_t first = 0, last; first < e->count; first = last) {
      last = qmat_edge_last(e, first);
      if (last - first == 2 && d->parts->part_of[e->order[first] / 3] == d->parts->part_of[e->order[first + 1] / 3] &&
          qmat_half_edge_rises(e, e->order[first]) != qmat_half_edge_rises(e, e->order[first + 1]))
        continue;
      for (size_t i = first; i < last; i++)
        here[i - first] = (edge_part){d->parts->part_of[e->order[i] / 3], e->order[i]};
      if (last - first > 1) qsort(here, last - first, sizeof *here, compare_edge_parts);
      find_border_at(d, here, last - first, pass == 0);
    }
    if (pass == 0) {
      d->border = qmat_arena_alloc(&d->context->arena, d->border_count + 1, sizeof *d->border);
      if (!d->border) return fail_shortage(d);
    }
  }
  qsort(d->border, d->border_count, sizeof *d->border, compare_border_edges);
  return QMAT_OK;
}

/* The first border edge of a part that starts at a vertex. */
static size_t first_from(const division *d, uint32_t part, uint32_t from) {
  size_t low = 0, high = d->border_count;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    const border_edge *b = &d->border[middle];
    if (b->part < part || (b->part == part && b->from < from))
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

static void add_loop(division *d, uint32_t part, const uint32_t *vertices, const uint32_t *thirds, size_t count,
                     size_t *vertex_count) {
  qmat_parts *parts = d->parts;
  if (count < 3) return; /* two sides one way and back */
  qmat_part *p = &parts->parts[part];
  if (p->loop_count++ == 0) p->first_loop = parts->loop_count;
  qmat_loop *loop = &parts->loops[parts->loop_count++];
  *loop = (qmat_loop){part, *vertex_count, count, 0};
  for (size_t i = 0; i < count; i++) {
    parts->loop_thirds[*vertex_count] = thirds[i];
    parts->loop_vertices[(*vertex_count)++] = vertices[i];
    loop->length += qmat_point_distance(position(d, vertices[i]), position(d, vertices[(i + 1) % count]));
  }
}

/* Borders arrive at each vertex as often as they leave it, so they fall apart into loops: a walk that comes back to one
 * of its vertices has gone around one. */
static qmat_status find_loops(division *d) {
  qmat_parts *parts = d->parts;
  qmat_arena *arena = &d->context->arena;
  uint32_t *path = qmat_arena_alloc(arena, d->border_count + 1, sizeof *path),
           *thirds = qmat_arena_alloc(arena, d->border_count + 1, sizeof *thirds),
           *used = qmat_arena_calloc(arena, d->border_count + 1, sizeof *used); /* by the first edge from a vertex */
  size_t *place = qmat_arena_calloc(arena, parts->vertex_count, sizeof *place), vertex_count = 0;
  parts->loops = qmat_arena_alloc(arena, d->border_count / 3 + 1, sizeof *parts->loops);
  parts->loop_vertices = qmat_arena_alloc(arena, d->border_count + 1, sizeof *parts->loop_vertices);
  parts->loop_thirds = qmat_arena_alloc(arena, d->border_count + 1, sizeof *parts->loop_thirds);
  if (!path || !thirds || !used || !place || !parts->loops || !parts->loop_vertices || !parts->loop_thirds)
    return fail_shortage(d);
  for (size_t i = 0; i < d->border_count;) {
    const uint32_t part = d->border[i].part;
    size_t first = first_from(d, part, d->border[i].from), length = 0;
    if (first + used[first] > i) {
      i++;
      continue;
    }
    path[length++] = d->border[first].from;
    place[path[0]] = 1;
    while (length > 0) {
      const uint32_t here = path[length - 1];
      first = first_from(d, part, here);
      const size_t edge = first + used[first];
      if (edge >= d->border_count || d->border[edge].part != part || d->border[edge].from != here) {
        place[here] = 0; /* the walk is back at its start, where nothing leaves any more */
        length--;
        continue;
      }
      used[first]++;
      thirds[length - 1] = d->border[edge].third;
      const uint32_t next = d->border[edge].to;
      if (place[next] == 0) {
        path[length++] = next;
        place[next] = length;
        continue;
      }
      const size_t start = place[next] - 1;
      add_loop(d, part, path + start, thirds + start, length - start, &vertex_count);
      for (; length > start + 1; length--) place[path[length - 1]] = 0;
    }
  }
  return QMAT_OK;
}

/* ---- what a part is ---- */

void qmat_part_grow_box(const qmat_parts *parts, size_t part, double box[6]) {
  const qmat_part *of = &parts->parts[part];
  for (size_t i = 0; i < 3 * of->triangle_count; i++) {
    const uint32_t t = parts->members[of->first_member + i / 3];
    const double *p = parts->positions + 3 * (size_t)parts->triangles[3 * (size_t)t + i % 3];
    for (size_t k = 0; k < 3; k++) {
      box[k] = fmin(box[k], p[k]);
      box[3 + k] = fmax(box[3 + k], p[k]);
    }
  }
}

double qmat_seen_share(const double *from, const double *a, const double *b, const double *c) {
  double y, x;
  qmat_triangle_half_angle(a, b, c, from, &y, &x);
  return atan2(y, x) / (2 * QMAT_PI);
}

static void loop_centre(const division *d, const qmat_loop *loop, double centre[3]) {
  for (int k = 0; k < 3; k++) centre[k] = 0;
  for (size_t i = 0; i < loop->count; i++) {
    const double *p = position(d, d->parts->loop_vertices[loop->first + i]);
    for (int k = 0; k < 3; k++) centre[k] += p[k] / (double)loop->count;
  }
}

/* Adds the cone over each loop to the volume, and to the winding numbers of `count` samples. */
static void add_cones(const division *d, qmat_part *part, const double *reference, size_t count, double *winding) {
  for (size_t l = part->first_loop; l < part->first_loop + part->loop_count; l++) {
    const qmat_loop *loop = &d->parts->loops[l];
    const uint32_t *vertices = d->parts->loop_vertices + loop->first;
    double centre[3];
    loop_centre(d, loop, centre);
    for (size_t i = 0; i < loop->count; i++) {
      const double *a = position(d, vertices[i]), *b = position(d, vertices[(i + 1) % loop->count]);
      part->volume += qmat_triangle_six_volumes(centre, a, b, reference) / 6;
      for (size_t s = 0; s < count; s++) winding[s] += qmat_seen_share(d->samples + 3 * s, centre, a, b);
    }
  }
}

/* Centroids of triangles at even steps of the area. */
static size_t choose_samples(const division *d, const qmat_part *part, const uint32_t *triangles) {
  size_t border = 0, count = 0;
  for (size_t l = part->first_loop; l < part->first_loop + part->loop_count; l++) border += d->parts->loops[l].count;
  size_t most = MOST_ANGLES / border;
  most = most < FEWEST_POINTS ? FEWEST_POINTS : most > MOST_POINTS ? MOST_POINTS : most;
  double area = 0;
  for (size_t i = 0; i < part->triangle_count; i++) {
    area += area_of(d, triangles[i]);
    const uint32_t *c = d->parts->triangles + 3 * (size_t)triangles[i];
    for (; count < most && area > ((double)count + 0.5) / (double)most * part->area; count++)
      for (size_t k = 0; k < 3; k++)
        d->samples[3 * count + k] = (position(d, c[0])[k] + position(d, c[1])[k] + position(d, c[2])[k]) / 3;
  }
  return count;
}

static void judge_part(const division *d, qmat_part *part, const uint32_t *triangles) {
  double winding[MOST_POINTS] = {0};
  const double *reference = position(d, d->parts->triangles[3 * (size_t)triangles[0]]);
  for (size_t i = 0; i < part->triangle_count; i++) {
    const uint32_t *c = d->parts->triangles + 3 * (size_t)triangles[i];
    part->volume += qmat_triangle_six_volumes(position(d, c[0]), position(d, c[1]), position(d, c[2]), reference) / 6;
    part->area += area_of(d, triangles[i]);
  }
  part->filled = 1;
  if (part->loop_count > 0) {
    const size_t count = choose_samples(d, part, triangles);
    add_cones(d, part, reference, count, winding);
    size_t near = 0;
    for (size_t s = 0; s < count; s++) near += fabs(winding[s]) <= most_seen;
    part->filled = count > 0 ? (double)near / (double)count : 0;
  }
  const bool is_flat = !qmat_encloses(part->volume, part->area);
  if (part->loop_count == 0)
    part->kind = is_flat ? QMAT_PART_FLAT : QMAT_PART_CLOSED;
  else
    part->kind = is_flat || part->filled < least_filled ? QMAT_PART_OPEN : QMAT_PART_HOLES;
}

static qmat_status list_members(const division *d) {
  qmat_parts *parts = d->parts;
  size_t *next = qmat_arena_alloc(&d->context->arena, parts->part_count, sizeof *next), first = 0;
  parts->members = qmat_arena_alloc(&d->context->arena, parts->triangle_count, sizeof *parts->members);
  if (!next || !parts->members) return fail_shortage(d);
  for (size_t i = 0; i < parts->part_count; first += parts->parts[i++].triangle_count)
    next[i] = parts->parts[i].first_member = first;
  for (uint32_t t = 0; t < parts->triangle_count; t++) parts->members[next[parts->part_of[t]]++] = t;
  return QMAT_OK;
}

static qmat_status judge_parts(division *d) {
  const qmat_parts *parts = d->parts;
  d->samples = qmat_arena_alloc(&d->context->arena, MOST_POINTS, 3 * sizeof *d->samples);
  if (!d->samples) return fail_shortage(d);
  for (size_t i = 0; i < parts->part_count; i++) {
    const qmat_status status = qmat_progress(d->context, i, parts->part_count, "parts");
    if (status != QMAT_OK) return status;
    judge_part(d, &parts->parts[i], parts->members + parts->parts[i].first_member);
  }
  return QMAT_OK;
}

qmat_status qmat_parts_find(qmat_context *context, size_t vertex_count, const double *positions, size_t triangle_count,
                            const uint32_t *triangles, qmat_parts *parts) {
  *parts = (qmat_parts){.vertex_count = vertex_count, .triangle_count = triangle_count, .positions = positions};
  if (triangle_count == 0) return QMAT_OK;
  division d = {.context = context, .parts = parts};
  parts->triangles = qmat_arena_alloc(&context->arena, 3 * triangle_count, sizeof *parts->triangles);
  if (!parts->triangles) return fail_shortage(&d);
  memcpy(parts->triangles, triangles, 3 * triangle_count * sizeof *triangles);
  qmat_status status = qmat_half_edges_sort(context, vertex_count, triangle_count, parts->triangles, &d.edges);
  if (status == QMAT_OK) status = find_pieces(&d);
  if (status == QMAT_OK) status = settle_pieces(&d);
  if (status == QMAT_OK) status = find_parts(&d);
  if (status == QMAT_OK) status = list_members(&d);
  if (status == QMAT_OK) status = find_border(&d);
  if (status == QMAT_OK) status = find_loops(&d);
  return status == QMAT_OK ? judge_parts(&d) : status;
}
