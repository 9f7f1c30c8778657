/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/orient.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/vector.h"

/* Half-edge 3 * t + k goes from corner k to corner k + 1 of triangle t. */

#define NONE UINT32_MAX

typedef struct patch {
  double reference[3]; /* mean of the border's corners, or the first vertex */
  double volume;       /* six times what is enclosed, seen from the reference, in units of the mesh's size */
  double magnitude;    /* the same sum without signs: what rounding is relative to */
  size_t triangles, disagreeing;
  size_t border_corners;
  uint32_t first_triangle;
  bool conflicting; /* one-sided, as a Moebius strip */
  bool open;
} patch;

typedef struct work {
  const double *positions;
  const uint32_t *triangles;
  size_t vertex_count, triangle_count;
  double low[3], size; /* corner and largest side of the bounding box, halved */
  uint32_t *order;     /* half-edges, those of one edge next to each other */
  uint32_t *mate;      /* per half-edge the other one at an edge of two triangles, else NONE */
  uint32_t *patch_of;  /* per triangle */
  uint8_t *turned;     /* per triangle: 1 when it is to be turned over */
  patch *patches;      /* grown on the heap */
  size_t patch_count, patch_capacity;
} work;

static uint32_t start_of(const work *w, uint32_t half_edge) {
  return w->triangles[half_edge];
}

static uint32_t end_of(const work *w, uint32_t half_edge) {
  return w->triangles[half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1];
}

static uint32_t low_end(const work *w, uint32_t half_edge) {
  uint32_t a = start_of(w, half_edge), b = end_of(w, half_edge);
  return a < b ? a : b;
}

static uint32_t high_end(const work *w, uint32_t half_edge) {
  uint32_t a = start_of(w, half_edge), b = end_of(w, half_edge);
  return a < b ? b : a;
}

static bool same_edge(const work *w, uint32_t a, uint32_t b) {
  return low_end(w, a) == low_end(w, b) && high_end(w, a) == high_end(w, b);
}

/* Runs upwards, with what is to be turned over taken into account. */
static bool runs_up(const work *w, uint32_t half_edge) {
  return (start_of(w, half_edge) < end_of(w, half_edge)) != (w->turned[half_edge / 3] != 0);
}

/* The end of the run of half-edges at one edge that starts at `first`. */
static size_t edge_end(const work *w, size_t first) {
  size_t last = first + 1;
  while (last < 3 * w->triangle_count && same_edge(w, w->order[first], w->order[last])) last++;
  return last;
}

/* Two stable counting passes leave the half-edges sorted by lower, then higher vertex, then number. */
static void sort_half_edges(work *w, uint32_t *swap, uint32_t *starts) {
  size_t count = 3 * w->triangle_count;
  for (int pass = 0; pass < 2; pass++) {
    memset(starts, 0, (w->vertex_count + 1) * sizeof *starts);
    for (uint32_t h = 0; h < count; h++) starts[(pass == 0 ? high_end(w, h) : low_end(w, h)) + 1]++;
    for (size_t i = 0; i < w->vertex_count; i++) starts[i + 1] += starts[i];
    if (pass == 0) {
      for (uint32_t h = 0; h < count; h++) swap[starts[high_end(w, h)]++] = h;
    } else {
      for (size_t i = 0; i < count; i++) w->order[starts[low_end(w, swap[i])]++] = swap[i];
    }
  }
}

/* A vertex within the unit box of the mesh; halves keep the largest doubles from overflowing. */
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

/* Walks over the edges of two triangles from each triangle that has no patch yet. */
static bool find_patches(work *w, uint32_t *queue) {
  memset(w->patch_of, 0xFF, w->triangle_count * sizeof *w->patch_of);
  for (uint32_t seed = 0; seed < w->triangle_count; seed++) {
    if (w->patch_of[seed] != NONE) continue;
    if (qmat_grow((void **)&w->patches, &w->patch_capacity, w->patch_count + 1, sizeof *w->patches) != 0) return false;
    uint32_t number = (uint32_t)w->patch_count++;
    patch *p = &w->patches[number];
    *p = (patch){.first_triangle = seed};
    size_t head = 0, tail = 0;
    queue[tail++] = seed;
    w->patch_of[seed] = number;
    while (head < tail) {
      uint32_t t = queue[head++];
      p->triangles++;
      p->disagreeing += w->turned[t];
      for (uint32_t h = 3 * t; h < 3 * t + 3; h++) {
        uint32_t mate = w->mate[h];
        if (mate == NONE) continue;
        uint32_t other = mate / 3;
        /* The two must run against each other. */
        uint8_t wanted = (start_of(w, h) == start_of(w, mate)) != (w->turned[t] != 0);
        if (w->patch_of[other] == NONE) {
          w->patch_of[other] = number;
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

/* Borders of the patches, also at edges where an odd number of the triangles belongs to one patch. */
static void find_borders(work *w, uint8_t *odd) {
  memset(odd, 0, w->patch_count);
  for (size_t first = 0, last; first < 3 * w->triangle_count; first = last) {
    last = edge_end(w, first);
    if (last - first == 2) continue;
    for (size_t i = first; i < last; i++) odd[w->patch_of[w->order[i] / 3]] ^= 1;
    for (size_t i = first; i < last; i++) {
      uint32_t number = w->patch_of[w->order[i] / 3];
      if (!odd[number]) continue;
      odd[number] = 0;
      patch *p = &w->patches[number];
      p->open = true;
      const uint32_t ends[2] = {low_end(w, w->order[i]), high_end(w, w->order[i])};
      for (size_t k = 0; k < 2; k++) {
        double point[3];
        local_point(w, ends[k], point);
        for (size_t j = 0; j < 3; j++) p->reference[j] += point[j];
      }
      p->border_corners += 2;
    }
  }
}

static double six_volumes(const double a[3], const double b[3], const double c[3], const double from[3]) {
  double p[3], q[3], r[3], product[3];
  qmat_subtract(a, from, p);
  qmat_subtract(b, from, q);
  qmat_subtract(c, from, r);
  qmat_cross(q, r, product);
  return qmat_dot(p, product);
}

static double triangle_volume(const work *w, size_t t, const double from[3]) {
  double a[3], b[3], c[3];
  local_point(w, w->triangles[3 * t], a);
  local_point(w, w->triangles[3 * t + 1], b);
  local_point(w, w->triangles[3 * t + 2], c);
  double volume = six_volumes(a, b, c, from);
  return w->turned[t] ? -volume : volume;
}

static void measure_patches(work *w) {
  for (size_t i = 0; i < w->patch_count; i++) {
    patch *p = &w->patches[i];
    if (!p->open) {
      local_point(w, w->triangles[3 * (size_t)p->first_triangle], p->reference);
    } else {
      for (int k = 0; k < 3; k++) p->reference[k] /= (double)p->border_corners;
    }
  }
  for (size_t t = 0; t < w->triangle_count; t++) {
    patch *p = &w->patches[w->patch_of[t]];
    double volume = triangle_volume(w, t, p->reference);
    p->volume += volume;
    p->magnitude += fabs(volume);
  }
}

static void choose_sides(work *w, uint8_t *turn_patch) {
  const double tolerance = 1e-12;
  double kept_volume = 0, kept_magnitude = 0;
  for (size_t i = 0; i < w->patch_count; i++) {
    const patch *p = &w->patches[i];
    turn_patch[i] = 0;
    if (p->conflicting) continue;
    if (p->disagreeing > 0) {
      bool flat = !(fabs(p->volume) > tolerance * p->magnitude);
      turn_patch[i] = flat ? p->disagreeing > p->triangles - p->disagreeing : p->volume < 0;
    } else if (!p->open) {
      kept_volume += p->volume;
      kept_magnitude += p->magnitude;
    }
  }
  bool inside_out = kept_volume < -tolerance * kept_magnitude;
  for (size_t i = 0; i < w->patch_count; i++) {
    const patch *p = &w->patches[i];
    if (inside_out && !p->conflicting && p->disagreeing == 0 && !p->open) turn_patch[i] = 1;
  }
  for (size_t t = 0; t < w->triangle_count; t++) w->turned[t] ^= turn_patch[w->patch_of[t]];
}

/* Counts edges and components of the triangles as they will be. `parents` and `open` (per vertex) and `volumes` (per
 * vertex) are scratch. */
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
    last = edge_end(w, first);
    size_t count = last - first, up = 0;
    for (size_t i = first; i < last; i++) up += runs_up(w, w->order[i]);
    size_t apart = 2 * up > count ? 2 * up - count : count - 2 * up;
    edges++;
    if (count == 1) result->border_edges++;
    if (count > 2) result->nonmanifold_edges++;
    if (count % 2 != 0) result->closed = false;
    bool agrees = apart == count % 2;
    if (!agrees) result->oriented = false;
    if (count % 2 != 0 || !agrees) open[qmat_set_leader(parents, low_end(w, w->order[first]))] = 1;
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
  qmat_status status = QMAT_OK;
  *connectivity = (qmat_connectivity){0};
  qmat_arena arena = {0}; /* freed here, before the mesh goes on */
  size_t half_edges = 3 * triangle_count;
  size_t rows = vertex_count + 2 > triangle_count ? vertex_count + 2 : triangle_count;
  work w = {.positions = positions,
            .triangles = triangles,
            .vertex_count = vertex_count,
            .triangle_count = triangle_count,
            .order = qmat_arena_alloc(&arena, half_edges, sizeof(uint32_t)),
            .mate = qmat_arena_alloc(&arena, half_edges, sizeof(uint32_t)),
            .patch_of = qmat_arena_alloc(&arena, triangle_count, sizeof(uint32_t)),
            .turned = qmat_arena_calloc(&arena, triangle_count, 1)};
  uint32_t *scratch = qmat_arena_alloc(&arena, rows, sizeof *scratch);
  uint8_t *flags = qmat_arena_alloc(&arena, rows, 1);
  double *volumes = qmat_arena_alloc(&arena, vertex_count, sizeof *volumes);
  if (!w.order || !w.mate || !w.patch_of || !w.turned || !scratch || !flags || !volumes) goto shortage;

  measure_box(&w);
  sort_half_edges(&w, w.mate, scratch);
  memset(w.mate, 0xFF, half_edges * sizeof *w.mate);
  for (size_t first = 0, last; first < half_edges; first = last) {
    last = edge_end(&w, first);
    if (last - first != 2) continue;
    w.mate[w.order[first]] = w.order[first + 1];
    w.mate[w.order[first + 1]] = w.order[first];
  }
  if (!find_patches(&w, scratch)) goto shortage;
  find_borders(&w, flags);
  measure_patches(&w);
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
  qmat_free(w.patches);
  qmat_arena_uninit(&arena);
  return status;
}
