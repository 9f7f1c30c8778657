/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_thin.h"

#include <math.h>
#include <string.h>

#include <meshoptimizer.h>

#include "core/disjoint_sets.h"
#include "core/node.h"

/* The first round thins out everything; each later one leaves the triangles around all faults so far as they are. A
 * component whose topology changes is thinned out for half of the error instead, and stays as it is after so many
 * halvings. */
enum { MOST_ROUNDS = 24, MOST_HALVINGS = 6 };

typedef struct thinning {
  qmat_context *context;
  const qmat_skin_triangles *surface;
  float *positions;     /* 3 per vertex */
  bool *locked;         /* per vertex: its triangles stay */
  bool *is_fault;       /* per vertex: what is around it is no closed fan of triangles */
  uint32_t *thinned;    /* 3 per triangle */
  size_t thinned_count; /* triangles */
  uint32_t *open;       /* 3 per triangle: those that may go */
  size_t *firsts;       /* per vertex, and the end: its corners in `corners` */
  uint32_t *corners;    /* corners of the thinned surface by their vertices */
  uint32_t *leaders;    /* disjoint sets of vertices: the components of the surface */
  int64_t *euler;       /* per leader: twice what thinning changes in the Euler characteristic of the component */
  uint8_t *halvings;    /* per leader: how often the error of the component was halved */
} thinning;

static qmat_status start(qmat_context *context, const qmat_skin_triangles *surface, thinning *t) {
  qmat_arena *arena = &context->arena;
  const size_t vertices = surface->vertex_count, corners = 3 * surface->triangle_count;
  *t = (thinning){.context = context,
                  .surface = surface,
                  .positions = qmat_arena_alloc(arena, 3 * vertices, sizeof *t->positions),
                  .locked = qmat_arena_calloc(arena, vertices, sizeof *t->locked),
                  .is_fault = qmat_arena_alloc(arena, vertices, sizeof *t->is_fault),
                  .thinned = qmat_arena_alloc(arena, corners, sizeof *t->thinned),
                  .open = qmat_arena_alloc(arena, corners, sizeof *t->open),
                  .firsts = qmat_arena_alloc(arena, vertices + 1, sizeof *t->firsts),
                  .corners = qmat_arena_alloc(arena, corners, sizeof *t->corners),
                  .leaders = qmat_sets_new(context, vertices),
                  .euler = qmat_arena_alloc(arena, vertices, sizeof *t->euler),
                  .halvings = qmat_arena_calloc(arena, vertices, sizeof *t->halvings)};
  if (!t->leaders || !t->euler || !t->halvings || !t->positions || !t->locked || !t->is_fault || !t->thinned ||
      !t->open || !t->firsts || !t->corners)
    return qmat_fail_memory(context, "the skin");
  for (size_t i = 0; i < 3 * vertices; i++) t->positions[i] = (float)surface->positions[i];
  for (size_t i = 0; i < corners; i++) qmat_sets_join(t->leaders, surface->triangles[i], surface->triangles[i - i % 3]);
  return QMAT_OK;
}

/* Thins out the triangles without a locked vertex, of the components with so many halvings; their border stays. Returns
 * the number of triangles of these components. */
static size_t thin_components(thinning *t, double error, size_t most, int halvings) {
  const qmat_skin_triangles *surface = t->surface;
  size_t count = 0, taken = 0;
  for (size_t i = 0; i < surface->triangle_count; i++) {
    const uint32_t *from = surface->triangles + 3 * i;
    if (t->halvings[qmat_set_leader(t->leaders, *from)] != halvings) continue;
    taken++;
    const bool stays = t->locked[from[0]] || t->locked[from[1]] || t->locked[from[2]];
    memcpy(stays ? t->thinned + 3 * t->thinned_count++ : t->open + 3 * count++, from, 3 * sizeof *from);
  }
  if (count == 0) return taken;
  const size_t stride = 3 * sizeof *t->positions;
  const float scale = meshopt_simplifyScale(t->positions, surface->vertex_count, stride);
  t->thinned_count +=
      meshopt_simplify(t->thinned + 3 * t->thinned_count, t->open, 3 * count, t->positions, surface->vertex_count,
                       stride, 3 * (most > t->thinned_count ? most - t->thinned_count : 0), (float)error / scale,
                       meshopt_SimplifyLockBorder, NULL) /
      3;
  return taken;
}

static void thin(thinning *t, double error, size_t most) {
  size_t taken = 0;
  t->thinned_count = 0;
  for (int halvings = 0; taken < t->surface->triangle_count; halvings++)
    taken += thin_components(t, ldexp(error, -halvings), most, halvings);
}

static void sort_corners(thinning *t) {
  const size_t vertices = t->surface->vertex_count, corners = 3 * t->thinned_count;
  memset(t->firsts, 0, (vertices + 1) * sizeof *t->firsts);
  for (size_t i = 0; i < corners; i++) t->firsts[t->thinned[i] + 1]++;
  for (size_t v = 0; v < vertices; v++) t->firsts[v + 1] += t->firsts[v];
  for (size_t i = corners; i-- > 0;) t->corners[--t->firsts[t->thinned[i] + 1]] = (uint32_t)i;
  /* Now firsts[v + 1] is where those of v start. */
  memmove(t->firsts, t->firsts + 1, vertices * sizeof *t->firsts);
  t->firsts[vertices] = corners;
}

/* The vertex after a corner's in its triangle. */
static uint32_t after(const thinning *t, uint32_t corner, uint32_t steps) {
  return t->thinned[corner - corner % 3 + (corner % 3 + steps) % 3];
}

/* Whether the triangles around a vertex are one closed fan. */
static bool is_fan(const thinning *t, size_t vertex) {
  const size_t first = t->firsts[vertex], count = t->firsts[vertex + 1] - first;
  if (count == 0) return true;
  const uint32_t start = after(t, t->corners[first], 1);
  uint32_t at = start;
  for (size_t step = 0; step < count; step++) {
    size_t found = 0, next = 0;
    for (size_t i = first; i < first + count; i++) {
      if (after(t, t->corners[i], 1) != at) continue;
      found++;
      next = i;
    }
    if (found != 1) return false;
    at = after(t, t->corners[next], 2);
    if (at == start) return step + 1 == count && count > 2;
  }
  return false;
}

/* Locks the faults, and the vertices that the original joins to them. A wider ring would lock more than it helps: on a
 * plane faults come again along its border. False where there are none. */
static bool lock_faults(thinning *t) {
  const qmat_skin_triangles *surface = t->surface;
  bool any = false;
  for (size_t v = 0; v < surface->vertex_count; v++) {
    t->is_fault[v] = !is_fan(t, v);
    any = any || t->is_fault[v];
  }
  for (size_t i = 0; i < surface->triangle_count && any; i++) {
    const uint32_t *corners = surface->triangles + 3 * i;
    if (!t->is_fault[corners[0]] && !t->is_fault[corners[1]] && !t->is_fault[corners[2]]) continue;
    for (int c = 0; c < 3; c++) t->locked[corners[c]] = true;
  }
  return any;
}

/* Locks the components that are gone, and halves the error of those whose Euler characteristic changed. False where
 * there are none. */
static bool spare_changed_components(thinning *t) {
  const qmat_skin_triangles *surface = t->surface;
  const size_t count = surface->vertex_count;
  bool any = false;
  memset(t->euler, 0, count * sizeof *t->euler);
  for (size_t v = 0; v < count; v++)
    if (t->firsts[v + 1] == t->firsts[v]) t->euler[qmat_set_leader(t->leaders, (uint32_t)v)] -= 2;
  for (size_t i = 0; i < surface->triangle_count; i++)
    t->euler[qmat_set_leader(t->leaders, surface->triangles[3 * i])]++;
  bool *is_left = t->is_fault;
  memset(is_left, 0, count * sizeof *is_left);
  for (size_t i = 0; i < t->thinned_count; i++) {
    const uint32_t leader = qmat_set_leader(t->leaders, t->thinned[3 * i]);
    t->euler[leader]--;
    is_left[leader] = true;
  }
  for (uint32_t v = 0; v < count; v++) {
    const uint32_t leader = qmat_set_leader(t->leaders, v);
    if (is_left[leader] && t->euler[leader] == 0) continue;
    any = true;
    if (!is_left[leader] || t->halvings[leader] == MOST_HALVINGS) t->locked[v] = true;
  }
  for (uint32_t v = 0; v < count; v++)
    if (is_left[v] && t->euler[v] != 0 && t->halvings[v] < MOST_HALVINGS) t->halvings[v]++;
  return any;
}

/* Makes the surface the thinned one, without vertices that are not used. */
static void take(const thinning *t, qmat_skin_triangles *surface) {
  size_t count = 0;
  uint32_t *ids = t->open; /* it has more elements than there are vertices */
  for (size_t v = 0; v < surface->vertex_count; v++) {
    if (t->firsts[v + 1] == t->firsts[v]) continue;
    memmove(surface->positions + 3 * count, surface->positions + 3 * v, 3 * sizeof *surface->positions);
    ids[v] = (uint32_t)count++;
  }
  for (size_t i = 0; i < 3 * t->thinned_count; i++) surface->triangles[i] = ids[t->thinned[i]];
  surface->vertex_count = count;
  surface->triangle_count = t->thinned_count;
}

qmat_status qmat_skin_thin(qmat_context *context, double error, size_t most, qmat_skin_triangles *surface) {
  thinning t;
  qmat_status status = start(context, surface, &t);
  for (int round = 0; round < MOST_ROUNDS && status == QMAT_OK; round++) {
    thin(&t, error, most);
    sort_corners(&t);
    status = qmat_progress(context, (uint64_t)round, MOST_ROUNDS, "rounds of thinning");
    if (status != QMAT_OK || lock_faults(&t) || spare_changed_components(&t)) continue;
    take(&t, surface);
    return status;
  }
  return status;
}
