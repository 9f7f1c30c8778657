/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/erosion.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/vector.h"
#include "nodes/initial/item_queue.h"

static const size_t steps_per_report = 65536;

#define NONE UINT32_MAX

/* A sector is what a small ball around a sphere's centre cuts out of one sheet or curve: triangles joined by edges with
 * exactly two triangles, or one edge without triangles. A place is where a sector is met: corner k of triangle t is
 * place 3 t + k, end k of edge e is place 3 * triangle_count + 2 e + k. Places of a sector are a set, and its leader
 * stands for it. */
typedef struct burning {
  qmat_context *context;
  const qmat_medial *medial;
  uint32_t *sides;          /* 3 per triangle: the edge opposite corner k */
  uint32_t *edge_triangles; /* per edge: how many triangles */
  uint32_t *sectors;        /* per place: its leader, or for ends of edges with triangles itself, unused */
  uint32_t *place_offsets;  /* per sphere: its places are places[place_offsets[i] .. place_offsets[i + 1]) */
  uint32_t *places;
  uint32_t *open_places;  /* per edge end: places of triangles there whose sector does not burn yet */
  uint32_t *open_sectors; /* per sphere */
  double *times;          /* per leader; INFINITY until it burns */
  double *arrivals;       /* per leader: of the first fire so far */
  double *courses;        /* 3 per leader: the unit vector along which that fire came; 0 where it started */
  double *sphere_times;
  qmat_item_queue queue;
  bool is_short;
} burning;

static size_t first_end(const burning *b) {
  return 3 * b->medial->triangle_count;
}

static uint32_t sphere_at(const burning *b, size_t place) {
  return place < first_end(b) ? b->medial->triangles[place] : b->medial->edges[place - first_end(b)];
}

/* Which end of an edge a sphere is. */
static size_t end_of(const burning *b, uint32_t edge, uint32_t sphere) {
  return b->medial->edges[2 * (size_t)edge + 1] == sphere;
}

/* --- sectors ----------------------------------------------------------------------------------------------------- */

/* Joins the places of two triangles at both ends of an edge that only they have. */
static qmat_status join_places(burning *b) {
  const qmat_medial *m = b->medial;
  uint32_t *met = qmat_arena_alloc(&b->context->arena, m->edge_count, 2 * sizeof *met); /* per edge end: a place */
  if (!met) return qmat_fail_memory(b->context, "the sectors of the medial mesh");
  memset(met, 0xff, 2 * m->edge_count * sizeof *met);
  for (size_t i = 0; i < m->triangle_count; i++) {
    for (size_t k = 0; k < 3; k++) {
      const uint32_t edge = b->sides[3 * i + k];
      for (size_t corner = 0; corner < 3; corner++) {
        if (corner == k) continue;
        const size_t end = 2 * (size_t)edge + end_of(b, edge, m->triangles[3 * i + corner]);
        b->open_places[end]++;
        if (b->edge_triangles[edge] == 2 && met[end] != NONE)
          qmat_sets_join(b->sectors, met[end], (uint32_t)(3 * i + corner));
        met[end] = (uint32_t)(3 * i + corner);
      }
    }
  }
  return QMAT_OK;
}

static bool is_place(const burning *b, size_t place) {
  return place < first_end(b) || b->edge_triangles[(place - first_end(b)) / 2] == 0;
}

static qmat_status find_sectors(burning *b) {
  const qmat_medial *m = b->medial;
  qmat_arena *arena = &b->context->arena;
  const size_t count = first_end(b) + 2 * m->edge_count;
  if (count >= NONE) return qmat_fail(b->context, QMAT_ERROR_MEMORY, "the medial mesh is too large to burn");
  b->sides = qmat_arena_alloc(arena, m->triangle_count, 3 * sizeof *b->sides);
  b->edge_triangles = qmat_arena_calloc(arena, m->edge_count, sizeof *b->edge_triangles);
  b->open_places = qmat_arena_calloc(arena, m->edge_count, 2 * sizeof *b->open_places);
  b->open_sectors = qmat_arena_calloc(arena, m->sphere_count, sizeof *b->open_sectors);
  b->place_offsets = qmat_arena_calloc(arena, m->sphere_count + 2, sizeof *b->place_offsets);
  b->places = qmat_arena_alloc(arena, count, sizeof *b->places);
  b->times = qmat_arena_alloc(arena, count, sizeof *b->times);
  b->arrivals = qmat_arena_alloc(arena, count, sizeof *b->arrivals);
  b->courses = qmat_arena_alloc(arena, count, 3 * sizeof *b->courses);
  b->sphere_times = qmat_arena_alloc(arena, m->sphere_count, sizeof *b->sphere_times);
  b->sectors = qmat_sets_new(b->context, count);
  if (!b->sides || !b->edge_triangles || !b->open_places || !b->open_sectors || !b->place_offsets || !b->places ||
      !b->times || !b->arrivals || !b->courses || !b->sphere_times || !b->sectors)
    return qmat_fail_memory(b->context, "the sectors of the medial mesh");
  qmat_status status = qmat_medial_sides(b->context, m, b->sides);
  for (size_t i = 0; status == QMAT_OK && i < 3 * m->triangle_count; i++) b->edge_triangles[b->sides[i]]++;
  if (status == QMAT_OK) status = join_places(b);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < count; i++) {
    b->times[i] = b->arrivals[i] = INFINITY;
    if (!is_place(b, i)) continue;
    b->sectors[i] = qmat_set_leader(b->sectors, (uint32_t)i);
    b->place_offsets[sphere_at(b, i) + 2]++;
    b->open_sectors[sphere_at(b, i)] += b->sectors[i] == i;
  }
  for (size_t i = 0; i < m->sphere_count; i++) b->place_offsets[i + 2] += b->place_offsets[i + 1];
  for (size_t i = 0; i < count; i++)
    if (is_place(b, i)) b->places[b->place_offsets[sphere_at(b, i) + 1]++] = (uint32_t)i;
  return QMAT_OK;
}

/* --- fire -------------------------------------------------------------------------------------------------------- */

static const double no_course[3] = {0, 0, 0};

/* A fire reaches a place along `course`, which may be of any length. */
static void reach(burning *b, size_t place, double time, const double *course) {
  const uint32_t sector = b->sectors[place];
  if (!(time < b->arrivals[sector])) return;
  const double length = sqrt(qmat_dot(course, course));
  b->arrivals[sector] = time;
  for (size_t k = 0; k < 3; k++) b->courses[3 * (size_t)sector + k] = length > 0 ? course[k] / length : 0;
  b->is_short = qmat_queue_push(&b->queue, time, sector) || b->is_short;
}

/* When a straight front that passes `a` and `b` reaches c through their edge, and along which course; INFINITY if it
 * does not come through. */
static double front_time(const double *a, const double *b, const double *c, double time_a, double time_b,
                         double *course) {
  double ab[3], ac[3];
  qmat_subtract(b, a, ab);
  qmat_subtract(c, a, ac);
  const double length = sqrt(qmat_dot(ab, ab));
  if (!(length > 0)) return INFINITY;
  const double along = qmat_dot(ab, ac) / length, slope = (time_b - time_a) / length;
  const double across = sqrt(fmax(qmat_dot(ac, ac) - along * along, 0)), rise = sqrt(fmax(1 - slope * slope, 0));
  if (!(rise > 1e-6)) return INFINITY; /* it runs along the edge, as the fire from its end does */
  const double from = along - across * slope / rise;
  if (!(from >= 0 && from <= length)) return INFINITY;
  for (size_t k = 0; k < 3; k++) course[k] = ac[k] - from / length * ab[k];
  return time_a + slope * along + rise * across;
}

/* Whether one front passes both ends of the edge opposite a corner: their fires come along similar courses. Where they
 * do not, fires meet on the edge, and between its ends it burns later than they do. */
static bool is_front(const burning *b, size_t place, const double *course, const double *other) {
  const bool a_started = qmat_dot(course, course) == 0, b_started = qmat_dot(other, other) == 0;
  if (a_started && b_started) return b->edge_triangles[b->sides[place]] == 1;
  return a_started || b_started || qmat_dot(course, other) > 0.5;
}

/* The fire at corner k of a triangle spreads to its other corners. */
static void spread_in_triangle(burning *b, size_t triangle, size_t k, double time) {
  const qmat_medial *m = b->medial;
  const double *at[3];
  size_t sectors[3];
  for (size_t i = 0; i < 3; i++) {
    at[i] = &m->spheres[4 * (size_t)m->triangles[3 * triangle + i]];
    sectors[i] = b->sectors[3 * triangle + i];
  }
  for (size_t step = 1; step < 3; step++) {
    const size_t to = (k + step) % 3, other = 3 - k - to;
    double course[3];
    qmat_subtract(at[to], at[k], course);
    reach(b, 3 * triangle + to, time + sqrt(qmat_dot(course, course)), course);
    const double before = b->times[sectors[other]];
    if (!(before < INFINITY) ||
        !is_front(b, 3 * triangle + to, &b->courses[3 * sectors[k]], &b->courses[3 * sectors[other]]))
      continue;
    const double arrival = front_time(at[k], at[other], at[to], time, before, course);
    reach(b, 3 * triangle + to, fmax(arrival, time), course);
  }
}

/* The last place at the end of an edge is a border now: its sheet burns from there. */
static void expose(burning *b, uint32_t sphere, uint32_t edge, double time) {
  for (uint32_t i = b->place_offsets[sphere]; i < b->place_offsets[sphere + 1]; i++) {
    const uint32_t place = b->places[i];
    if (place >= first_end(b) || b->times[b->sectors[place]] < INFINITY) continue;
    const uint32_t *sides = &b->sides[place - place % 3];
    for (size_t k = 0; k < 3; k++)
      if (sides[k] == edge) reach(b, place, time, no_course);
  }
}

/* Burns a sector, and spreads the fire. */
static void burn_sector(burning *b, uint32_t sector, double time) {
  const uint32_t sphere = sphere_at(b, sector);
  b->times[sector] = time;
  b->sphere_times[sphere] = time; /* the last one stays */
  b->open_sectors[sphere]--;
  for (uint32_t i = b->place_offsets[sphere]; i < b->place_offsets[sphere + 1]; i++) {
    const uint32_t place = b->places[i];
    if (b->sectors[place] != sector) continue;
    if (place >= first_end(b)) {
      const size_t edge = (place - first_end(b)) / 2;
      const uint32_t *ends = &b->medial->edges[2 * edge];
      double course[3];
      qmat_subtract(&b->medial->spheres[4 * (size_t)ends[ends[0] == sphere]], &b->medial->spheres[4 * (size_t)sphere],
                    course);
      reach(b, first_end(b) + 2 * edge + (ends[0] == sphere), time + sqrt(qmat_dot(course, course)), course);
      continue;
    }
    spread_in_triangle(b, place / 3, place % 3, time);
    for (size_t k = 0; k < 3; k++) {
      const uint32_t edge = b->sides[place - place % 3 + k];
      if (k != place % 3) b->open_places[2 * (size_t)edge + end_of(b, edge, sphere)]--;
    }
  }
  for (uint32_t i = b->place_offsets[sphere]; i < b->place_offsets[sphere + 1] && b->open_sectors[sphere] > 0; i++) {
    const uint32_t place = b->places[i];
    if (place >= first_end(b)) {
      if (b->open_sectors[sphere] == 1) reach(b, place, time, no_course); /* a curve alone burns from its end */
      continue;
    }
    for (size_t k = 0; k < 3 && b->sectors[place] == sector; k++) {
      const uint32_t edge = b->sides[place - place % 3 + k];
      if (k != place % 3 && b->open_places[2 * (size_t)edge + end_of(b, edge, sphere)] == 1)
        expose(b, sphere, edge, time);
    }
  }
}

/* Fires at borders and at the ends of curves. */
static void light(burning *b) {
  const qmat_medial *m = b->medial;
  for (size_t i = 0; i < m->sphere_count; i++) {
    const bool alone = b->place_offsets[i] == b->place_offsets[i + 1];
    b->sphere_times[i] = alone ? m->spheres[4 * i + 3] : INFINITY;
    for (uint32_t p = b->place_offsets[i]; p < b->place_offsets[i + 1]; p++) {
      const uint32_t place = b->places[p];
      bool open = place >= first_end(b) && b->open_sectors[i] == 1;
      for (size_t k = 0; k < 3 && place < first_end(b); k++)
        open = open || (k != place % 3 && b->edge_triangles[b->sides[place - place % 3 + k]] == 1);
      if (open) reach(b, place, m->spheres[4 * i + 3], no_course);
    }
  }
}

qmat_status qmat_burn(qmat_context *context, const qmat_medial *medial, qmat_burn_times *times) {
  burning b = {.context = context, .medial = medial};
  qmat_status status = find_sectors(&b);
  if (status != QMAT_OK) return status;
  light(&b);
  for (size_t steps = 0; status == QMAT_OK && b.queue.count > 0; steps++) {
    if (steps % steps_per_report == 0) status = qmat_progress(context, 0, 0, "fires");
    const qmat_queued next = qmat_queue_pop(&b.queue);
    if (!(b.times[next.item] < INFINITY)) burn_sector(&b, (uint32_t)next.item, next.key);
  }
  qmat_free(b.queue.items);
  if (status == QMAT_OK && b.is_short) status = qmat_fail_memory(context, "the fires on the medial mesh");
  if (status != QMAT_OK) return status;
  const size_t places = first_end(&b) + 2 * medial->edge_count;
  double *all = qmat_arena_alloc(&context->arena, places, sizeof *all);
  if (!all) return qmat_fail_memory(context, "the times of fires");
  for (size_t i = 0; i < places; i++) all[i] = b.times[b.sectors[i]];
  for (size_t i = 0; i < medial->sphere_count; i++)
    if (b.open_sectors[i] > 0) b.sphere_times[i] = INFINITY;
  *times = (qmat_burn_times){b.sphere_times, all, b.sides, all + first_end(&b)};
  return QMAT_OK;
}
