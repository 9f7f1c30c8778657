/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/orient.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/triangle.h"

#define NONE UINT32_MAX

typedef struct piece {
  double reference[3]; /* the mean of the border's vertices; its first vertex if it has no border */
  double volume;       /* six times the volume enclosed together with the reference, in the unit box */
  double magnitude;    /* the same sum of absolute values, the scale of rounding errors */
  size_t triangles, disagreeing;
  size_t border_corners;
  uint32_t first_triangle;
  bool conflicting; /* not orientable, as a Moebius strip */
  bool open;
} piece;

typedef struct work {
  const double *positions;
  const uint32_t *triangles;
  size_t vertex_count, triangle_count;
  double low[3], size; /* low corner and longest side of the bounding box, halved */
  qmat_half_edges edges;
  uint32_t *mate;     /* per half-edge: the other one of an edge with two triangles, else NONE */
  uint32_t *piece_of; /* per triangle */
  uint8_t *turned;    /* per triangle: 1 if it will be flipped */
  piece *pieces;      /* grown on the heap */
  size_t piece_count, piece_capacity;
} work;

/* Whether the half-edge leads from its lower to its higher vertex once the triangles are flipped. */
static bool runs_up(const work *w, uint32_t half_edge) {
  return qmat_half_edge_rises(&w->edges, half_edge) != (w->turned[half_edge / 3] != 0);
}

/* The position of a vertex in the unit box of the mesh. Halved numbers cannot overflow. */
static void local_point(const work *w, uint32_t vertex, double point[3]) {
  for (size_t k = 0; k < 3; k++) point[k] = (w->positions[3 * (size_t)vertex + k] * 0.5 - w->low[k]) / w->size;
}

static void measure_box(work *w) {
  double high[3];
  for (size_t k = 0; k < 3; k++) w->low[k] = high[k] = w->positions[k] * 0.5;
  for (size_t i = 0; i < 3 * w->vertex_count; i++) {
    double half = w->positions[i] * 0.5;
    if (half < w->low[i % 3]) w->low[i % 3] = half;
    if (half > high[i % 3]) high[i % 3] = half;
  }
  w->size = fmax(high[0] - w->low[0], fmax(high[1] - w->low[1], high[2] - w->low[2]));
  if (!(w->size > 0)) w->size = 1;
}

/* Grows a piece across the edges with two triangles from each triangle that has no piece yet. */
static bool find_pieces(work *w, uint32_t *queue) {
  memset(w->piece_of, 0xFF, w->triangle_count * sizeof *w->piece_of);
  for (uint32_t seed = 0; seed < w->triangle_count; seed++) {
    if (w->piece_of[seed] != NONE) continue;
    if (qmat_grow((void **)&w->pieces, &w->piece_capacity, w->piece_count + 1, sizeof *w->pieces) != 0) return false;
    uint32_t number = (uint32_t)w->piece_count++;
    piece *p = &w->pieces[number];
    *p = (piece){.first_triangle = seed};
    size_t head = 0, tail = 0;
    queue[tail++] = seed;
    w->piece_of[seed] = number;
    while (head < tail) {
      uint32_t t = queue[head++];
      p->triangles++;
      p->disagreeing += w->turned[t];
      for (uint32_t h = 3 * t; h < 3 * t + 3; h++) {
        uint32_t mate = w->mate[h];
        if (mate == NONE) continue;
        uint32_t other = mate / 3;
        /* Consistent triangles traverse their common edge in opposite directions. */
        uint8_t wanted =
            (qmat_half_edge_start(&w->edges, h) == qmat_half_edge_start(&w->edges, mate)) != (w->turned[t] != 0);
        if (w->piece_of[other] == NONE) {
          w->piece_of[other] = number;
          w->turned[other] = wanted;
          queue[tail++] = other;
        } else if (w->turned[other] != wanted) {
          p->conflicting = true;
        }
      }
    }
    if (p->conflicting) {
      for (size_t i = 0; i < tail; i++) w->turned[queue[i]] = 0;
      p->disagreeing = 0;
    }
  }
  return true;
}

/* Finds the borders of the pieces: the edges where a piece has an odd number of triangles. */
static void find_borders(work *w, uint8_t *odd) {
  memset(odd, 0, w->piece_count);
  for (size_t first = 0, last; first < 3 * w->triangle_count; first = last) {
    last = qmat_edge_last(&w->edges, first);
    if (last - first == 2) continue;
    for (size_t i = first; i < last; i++) odd[w->piece_of[w->edges.order[i] / 3]] ^= 1;
    for (size_t i = first; i < last; i++) {
      uint32_t number = w->piece_of[w->edges.order[i] / 3];
      if (!odd[number]) continue;
      odd[number] = 0;
      piece *p = &w->pieces[number];
      p->open = true;
      const uint32_t ends[2] = {qmat_half_edge_low(&w->edges, w->edges.order[i]),
                                qmat_half_edge_high(&w->edges, w->edges.order[i])};
      for (size_t k = 0; k < 2; k++) {
        double point[3];
        local_point(w, ends[k], point);
        for (size_t j = 0; j < 3; j++) p->reference[j] += point[j];
      }
      p->border_corners += 2;
    }
  }
}

static double triangle_volume(const work *w, size_t t, const double from[3]) {
  double a[3], b[3], c[3];
  local_point(w, w->triangles[3 * t], a);
  local_point(w, w->triangles[3 * t + 1], b);
  local_point(w, w->triangles[3 * t + 2], c);
  double volume = qmat_triangle_six_volumes(a, b, c, from);
  return w->turned[t] ? -volume : volume;
}

static void measure_pieces(work *w) {
  for (size_t i = 0; i < w->piece_count; i++) {
    piece *p = &w->pieces[i];
    if (!p->open) {
      local_point(w, w->triangles[3 * (size_t)p->first_triangle], p->reference);
    } else {
      for (int k = 0; k < 3; k++) p->reference[k] /= (double)p->border_corners;
    }
  }
  for (size_t t = 0; t < w->triangle_count; t++) {
    piece *p = &w->pieces[w->piece_of[t]];
    double volume = triangle_volume(w, t, p->reference);
    p->volume += volume;
    p->magnitude += fabs(volume);
  }
}

static void choose_sides(work *w, uint8_t *turn_piece) {
  const double tolerance = 1e-12;
  double kept_volume = 0, kept_magnitude = 0;
  for (size_t i = 0; i < w->piece_count; i++) {
    const piece *p = &w->pieces[i];
    turn_piece[i] = 0;
    if (p->conflicting) continue;
    if (p->disagreeing > 0) {
      bool flat = !(fabs(p->volume) > tolerance * p->magnitude);
      turn_piece[i] = flat ? p->disagreeing > p->triangles - p->disagreeing : p->volume < 0;
    } else if (!p->open) {
      kept_volume += p->volume;
      kept_magnitude += p->magnitude;
    }
  }
  bool inside_out = kept_volume < -tolerance * kept_magnitude;
  for (size_t i = 0; i < w->piece_count; i++) {
    const piece *p = &w->pieces[i];
    if (inside_out && !p->conflicting && p->disagreeing == 0 && !p->open) turn_piece[i] = 1;
  }
  for (size_t t = 0; t < w->triangle_count; t++) w->turned[t] ^= turn_piece[w->piece_of[t]];
}

/* Counts edges and components with the flips applied. `parents`, `open` and `volumes` (per vertex) are scratch. */
static void count_all(const work *w, uint32_t *parents, uint8_t *open, double *volumes, qmat_connectivity *result) {
  size_t edges = 0;
  result->closed = result->oriented = true;
  for (uint32_t v = 0; v < w->vertex_count; v++) parents[v] = v;
  memset(open, 0, w->vertex_count);
  memset(volumes, 0, w->vertex_count * sizeof *volumes);
  for (size_t t = 0; t < w->triangle_count; t++) {
    const uint32_t *corners = w->triangles + 3 * t;
    qmat_sets_join(parents, corners[0], corners[1]);
    qmat_sets_join(parents, corners[0], corners[2]);
    result->flipped += w->turned[t];
  }
  for (size_t first = 0, last; first < 3 * w->triangle_count; first = last) {
    last = qmat_edge_last(&w->edges, first);
    size_t count = last - first, up = 0;
    for (size_t i = first; i < last; i++) up += runs_up(w, w->edges.order[i]);
    size_t apart = 2 * up > count ? 2 * up - count : count - 2 * up;
    edges++;
    if (count == 1) result->border_edges++;
    if (count > 2) result->nonmanifold_edges++;
    if (count % 2 != 0) result->closed = false;
    bool agrees = apart == count % 2;
    if (!agrees) result->oriented = false;
    if (count % 2 != 0 || !agrees)
      open[qmat_set_leader(parents, qmat_half_edge_low(&w->edges, w->edges.order[first]))] = 1;
  }
  for (size_t t = 0; t < w->triangle_count; t++) {
    uint32_t root = qmat_set_leader(parents, w->triangles[3 * t]);
    double from[3];
    local_point(w, root, from);
    volumes[root] += triangle_volume(w, t, from);
  }
  for (uint32_t v = 0; v < w->vertex_count; v++) {
    if (parents[v] != v) continue;
    result->components++;
    if (!open[v] && volumes[v] < -1e-12) result->inward_components++;
  }
  result->euler_characteristic = (int64_t)w->vertex_count - (int64_t)edges + (int64_t)w->triangle_count;
}

qmat_status qmat_orient_triangles(qmat_context *context, const double *positions, size_t vertex_count,
                                  uint32_t *triangles, size_t triangle_count, qmat_connectivity *connectivity) {
  *connectivity = (qmat_connectivity){0};
  const qmat_arena aside = qmat_arena_set_aside(&context->arena); /* scratch memory is freed on return */
  qmat_arena *arena = &context->arena;
  size_t half_edges = 3 * triangle_count;
  size_t rows = vertex_count + 2 > triangle_count ? vertex_count + 2 : triangle_count;
  work w = {.positions = positions,
            .triangles = triangles,
            .vertex_count = vertex_count,
            .triangle_count = triangle_count,
            .piece_of = qmat_arena_alloc(arena, triangle_count, sizeof(uint32_t)),
            .turned = qmat_arena_calloc(arena, triangle_count, 1)};
  uint32_t *scratch = qmat_arena_alloc(arena, rows, sizeof *scratch);
  uint8_t *flags = qmat_arena_alloc(arena, rows, 1);
  double *volumes = qmat_arena_alloc(arena, vertex_count, sizeof *volumes);
  qmat_status status = qmat_half_edges_sort(context, vertex_count, triangle_count, triangles, &w.edges);
  if (status != QMAT_OK || !w.piece_of || !w.turned || !scratch || !flags || !volumes) goto shortage;

  measure_box(&w);
  w.mate = w.edges.spare;
  memset(w.mate, 0xFF, half_edges * sizeof *w.mate);
  for (size_t first = 0, last; first < half_edges; first = last) {
    last = qmat_edge_last(&w.edges, first);
    if (last - first != 2) continue;
    w.mate[w.edges.order[first]] = w.edges.order[first + 1];
    w.mate[w.edges.order[first + 1]] = w.edges.order[first];
  }
  if (!find_pieces(&w, scratch)) goto shortage;
  find_borders(&w, flags);
  measure_pieces(&w);
  choose_sides(&w, flags);
  count_all(&w, scratch, flags, volumes, connectivity);

  for (size_t t = 0; t < triangle_count; t++) {
    if (!w.turned[t]) continue;
    uint32_t corner = triangles[3 * t + 1];
    triangles[3 * t + 1] = triangles[3 * t + 2];
    triangles[3 * t + 2] = corner;
  }
  goto done;

shortage:
  status = qmat_fail_memory(context, "the edges of the mesh");
done:
  qmat_free(w.pieces);
  qmat_arena_put_back(&context->arena, aside);
  return status;
}
