/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/square_blocks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/triangle.h"

/* A facet is perpendicular to an axis if the cosine is at least this; two axes are to each other if it is at most that.
 */
static const double least_cosine = 0.999999, most_cosine = 1e-4;
/* Vertices that move by at most this, in diagonals, are rounded as new ones are. */
static const double rounding = 1e-12;
/* The share of the area of blocks that is perpendicular to their axes. */
static const double least_square = 0.9;

/* A coordinate of a vertex. */
typedef struct coordinate {
  double value;
  uint32_t vertex;
} coordinate;

typedef struct squarer {
  qmat_context *context;
  qmat_shells *shells;
  double *copies;
  coordinate *coordinates; /* scratch */
  uint8_t *is_seen;        /* per vertex */
  double diagonal, right;  /* of all shells; their largest x */
  size_t turned;           /* frames that are no coordinate axes */
  double moved;
  bool changed;
} squarer;

static const double *corner(const squarer *s, uint32_t t, size_t k) {
  return s->shells->positions + 3 * (size_t)s->shells->triangles[3 * (size_t)t + k];
}

static void normal_of(const squarer *s, uint32_t t, double normal[3]) {
  qmat_triangle_normal(corner(s, t, 0), corner(s, t, 1), corner(s, t, 2), normal);
}

/* The unit normal of the largest facet, perpendicular to an axis if there is one. False: there is none. */
static bool find_axis(const squarer *s, const uint32_t *members, size_t count, const double *perpendicular,
                      double axis[3]) {
  double largest = 0;
  for (size_t i = 0; i < count; i++) {
    double normal[3];
    normal_of(s, members[i], normal);
    const double area = sqrt(qmat_dot(normal, normal));
    if (!(area > largest)) continue;
    if (perpendicular && !(fabs(qmat_dot(normal, perpendicular)) <= most_cosine * area)) continue;
    largest = area;
    for (size_t k = 0; k < 3; k++) axis[k] = normal[k] / area;
  }
  return largest > 0;
}

/* The axes of the largest facets. False: too many facets are not perpendicular to them. */
static bool find_axes(const squarer *s, const uint32_t *members, size_t count, double axes[3][3]) {
  if (!find_axis(s, members, count, NULL, axes[0]) || !find_axis(s, members, count, axes[0], axes[1])) return false;
  const double lean = qmat_dot(axes[0], axes[1]);
  for (size_t k = 0; k < 3; k++) axes[1][k] -= lean * axes[0][k];
  const double length = sqrt(qmat_dot(axes[1], axes[1]));
  for (size_t k = 0; k < 3; k++) axes[1][k] /= length;
  qmat_cross(axes[0], axes[1], axes[2]);
  double all = 0, square = 0;
  for (size_t i = 0; i < count; i++) {
    double normal[3];
    normal_of(s, members[i], normal);
    const double area = sqrt(qmat_dot(normal, normal));
    all += area;
    for (size_t a = 0; a < 3; a++)
      if (fabs(qmat_dot(normal, axes[a])) >= least_cosine * area) square += area;
  }
  return square >= least_square * all;
}

/* Whether the axes are those of the coordinates, in any order. They become that exactly. */
static bool are_level(double axes[3][3]) {
  for (size_t a = 0; a < 3; a++)
    for (size_t k = 0; k < 3; k++)
      if (fabs(axes[a][k]) > QMAT_SAME_PLANE && fabs(axes[a][k]) < 1 - QMAT_SAME_PLANE) return false;
  for (size_t a = 0; a < 3; a++)
    for (size_t k = 0; k < 3; k++) axes[a][k] = a == k;
  return true;
}

static int compare_coordinates(const void *left, const void *right) {
  const coordinate *a = left, *b = right;
  if (a->value != b->value) return a->value < b->value ? -1 : 1;
  return (a->vertex > b->vertex) - (a->vertex < b->vertex);
}

/* Makes close coordinates of a group's vertices one. False: all are equal or far apart. */
static bool join_coordinates(squarer *s, size_t count, size_t axis) {
  bool any = false;
  for (size_t i = 0; i < count; i++) s->coordinates[i].value = s->copies[3 * (size_t)s->coordinates[i].vertex + axis];
  qsort(s->coordinates, count, sizeof *s->coordinates, compare_coordinates);
  double value = -INFINITY;
  for (size_t i = 0; i < count; i++) {
    const coordinate *c = &s->coordinates[i];
    const double step = c->value - value;
    if (!(step <= QMAT_SAME_PLANE * s->diagonal)) value = c->value;
    if (c->value == value) continue;
    s->copies[3 * (size_t)c->vertex + axis] = value;
    s->moved = fmax(s->moved, sqrt(3) * step);
    any = true;
  }
  return any;
}

/* Squares up the blocks of a group, if they are such. */
static void square_group(squarer *s, const uint32_t *members, size_t count, qmat_block_frame *frame) {
  size_t vertices = 0;
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  *frame = (qmat_block_frame){.is_turned = false};
  if (!find_axes(s, members, count, frame->axes)) return;
  for (size_t i = 0; i < 3 * count; i++) {
    const uint32_t v = s->shells->triangles[3 * (size_t)members[i / 3] + i % 3];
    const double *p = s->shells->positions + 3 * (size_t)v;
    if (s->is_seen[v]) continue;
    s->is_seen[v] = 1;
    s->coordinates[vertices++].vertex = v;
    for (size_t k = 0; k < 3; k++) {
      low[k] = fmin(low[k], p[k]);
      high[k] = fmax(high[k], p[k]);
    }
  }
  if (!are_level(frame->axes)) { /* beside all others, so that they meet nothing by that */
    frame->is_turned = s->changed = true;
    for (size_t k = 0; k < 3; k++) frame->centre[k] = (low[k] + high[k]) / 2;
    frame->shift = s->right + (2 * (double)s->turned++ + 1) * s->diagonal;
    for (size_t i = 0; i < vertices; i++) {
      const size_t v = 3 * (size_t)s->coordinates[i].vertex;
      double from[3];
      qmat_subtract(s->shells->positions + v, frame->centre, from);
      for (size_t a = 0; a < 3; a++) s->copies[v + a] = qmat_dot(from, frame->axes[a]) + (a == 0 ? frame->shift : 0);
    }
  }
  for (size_t a = 0; a < 3; a++) s->changed |= join_coordinates(s, vertices, a);
}

static int compare_members(const void *left, const void *right) {
  const uint64_t a = *(const uint64_t *)left, b = *(const uint64_t *)right;
  return (a > b) - (a < b);
}

static void find_bounds(squarer *s) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size[3];
  for (uint32_t t = 0; t < s->shells->triangle_count; t++)
    for (size_t k = 0; k < 9; k++) {
      low[k % 3] = fmin(low[k % 3], corner(s, t, k / 3)[k % 3]);
      high[k % 3] = fmax(high[k % 3], corner(s, t, k / 3)[k % 3]);
    }
  qmat_subtract(high, low, size);
  s->diagonal = sqrt(qmat_dot(size, size));
  s->right = high[0];
}

qmat_status qmat_square_blocks(qmat_context *context, const uint32_t *groups, qmat_shells *shells, double *moved) {
  qmat_arena *arena = &context->arena;
  const size_t triangle_count = shells->triangle_count, vertex_count = shells->vertex_count;
  squarer s = {.context = context, .shells = shells};
  s.copies = qmat_arena_alloc(arena, vertex_count, 3 * sizeof *s.copies);
  s.coordinates = qmat_arena_alloc(arena, vertex_count, sizeof *s.coordinates);
  s.is_seen = qmat_arena_calloc(arena, vertex_count, 1);
  uint64_t *keys = qmat_arena_alloc(arena, triangle_count, sizeof *keys);
  uint32_t *members = qmat_arena_alloc(arena, triangle_count, sizeof *members),
           *frame_of = qmat_arena_calloc(arena, triangle_count, sizeof *frame_of);
  if (!s.copies || !s.coordinates || !s.is_seen || !keys || !members || !frame_of)
    return qmat_fail_memory(context, "the blocks");
  memcpy(s.copies, shells->positions, 3 * vertex_count * sizeof *s.copies);
  find_bounds(&s);
  size_t count = 0, group_count = 0;
  for (uint32_t t = 0; t < triangle_count; t++)
    if (groups[t] != UINT32_MAX) keys[count++] = (uint64_t)groups[t] << 32 | t;
  qsort(keys, count, sizeof *keys, compare_members);
  for (size_t i = 0; i < count; i++) {
    members[i] = (uint32_t)keys[i];
    group_count += i == 0 || keys[i] >> 32 != keys[i - 1] >> 32;
    frame_of[members[i]] = (uint32_t)group_count - 1;
  }
  qmat_block_frame *frames = qmat_arena_alloc(arena, group_count + 1, sizeof *frames);
  if (!frames) return qmat_fail_memory(context, "the blocks");
  for (size_t first = 0, last; first < count; first = last) {
    for (last = first; last < count && keys[last] >> 32 == keys[first] >> 32;) last++;
    const qmat_status status = qmat_progress(context, first, count, "triangles");
    if (status != QMAT_OK) return status;
    square_group(&s, members + first, last - first, &frames[frame_of[members[first]]]);
  }
  *moved = s.moved > rounding * s.diagonal ? s.moved : 0;
  if (!s.changed) return QMAT_OK;
  shells->given = shells->positions;
  shells->positions = s.copies;
  shells->frames = frames;
  shells->frame_of = frame_of;
  return QMAT_OK;
}
