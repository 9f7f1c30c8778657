/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/joint_division.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/convex_polygon.h"
#include "core/geometry/envelope.h"
#include "core/geometry/vector.h"
#include "core/node.h"

/* Slabs are cut along lines of so many directions: of equal weights of one sphere, and of equal differences of two. A
 * triangle with so many cuts on both sides has at most 15 corners; there is room for as many on the lines. */
enum { DIRECTIONS = 6, MOST_CORNERS = 32, POINTS_A_REPORT = 1 << 14 };

/* In weights of spheres: what a cut takes away at least, and a part so small becomes a sphere. */
static const double least_cut = 0.1, small_part = 0.1;

/* Where the feet of a joint's points are on a primitive, along each direction. */
typedef struct range {
  uint32_t primitive, joint;
  double low[DIRECTIONS], high[DIRECTIONS];
} range;

typedef struct division {
  qmat_context *context;
  const qmat_joint_points *points;
  const qmat_medial *unit;
  qmat_envelope *envelope;
  range *ranges; /* by primitives, then by joints */
  size_t range_count;
  qmat_medial made;
  size_t sphere_room, edge_room, triangle_room;
  uint32_t *joints; /* of the spheres made */
  uint32_t *copies; /* per given sphere: the last one made of it, UINT32_MAX: none */
  uint32_t *before; /* per sphere made: the one made of the same given sphere before it */
  bool failed;
} division;

/* Where a point with these weights of spheres is along a direction. */
static double along(const double weights[3], int direction) {
  return direction < 3 ? weights[direction] : weights[direction - 3] - weights[(direction - 2) % 3];
}

/* ---- feet ---- */

static void find_foot(const division *d, size_t point) {
  const double *place = &d->points->points[4 * point];
  range *foot = &d->ranges[point];
  size_t primitive = 0;
  uint32_t ids[3];
  double weights[3] = {0};
  (void)qmat_envelope_foot_within(d->envelope, place, INFINITY, &primitive, ids, weights);
  foot->primitive = (uint32_t)primitive;
  foot->joint = d->points->joints[point];
  for (int k = 0; k < DIRECTIONS; k++) foot->low[k] = foot->high[k] = along(weights, k);
}

static int compare_ranges(const void *left, const void *right) {
  const range *a = left, *b = right;
  if (a->primitive != b->primitive) return a->primitive < b->primitive ? -1 : 1;
  return (a->joint > b->joint) - (a->joint < b->joint);
}

/* Finds the foot of each point, then the range of each primitive and joint. */
static qmat_status find_ranges(division *d) {
  const size_t count = d->points->count;
  const int threads = qmat_threads(d->context);
  d->ranges = qmat_arena_alloc(&d->context->arena, count, sizeof *d->ranges);
  if (!d->ranges) return qmat_fail_memory(d->context, "the parts of joints");
  for (size_t first = 0; first < count; first += POINTS_A_REPORT) {
    const qmat_status status = qmat_progress(d->context, first, count, "points");
    if (status != QMAT_OK) return status;
    const size_t end = first + POINTS_A_REPORT < count ? first + POINTS_A_REPORT : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t i = first; i < end; i++) find_foot(d, i);
  }
  qsort(d->ranges, count, sizeof *d->ranges, compare_ranges); /* equal ones are joined in any order */
  for (size_t i = 0; i < count; i++) {
    range *last = &d->ranges[d->range_count > 0 ? d->range_count - 1 : 0];
    const range *next = &d->ranges[i];
    if (d->range_count == 0 || compare_ranges(last, next) != 0) {
      d->ranges[d->range_count++] = *next;
      continue;
    }
    for (int k = 0; k < DIRECTIONS; k++) {
      last->low[k] = fmin(last->low[k], next->low[k]);
      last->high[k] = fmax(last->high[k], next->high[k]);
    }
  }
  return QMAT_OK;
}

/* ---- what is made ---- */

static uint32_t add_sphere(division *d, const double sphere[4], uint32_t joint) {
  qmat_arena *arena = &d->context->arena;
  const size_t count = d->made.sphere_count;
  size_t of_joints = d->sphere_room, of_before = d->sphere_room;
  d->failed = d->failed || qmat_arena_grow(arena, (void **)&d->joints, &of_joints, count + 1, sizeof *d->joints) ||
              qmat_arena_grow(arena, (void **)&d->before, &of_before, count + 1, sizeof *d->before) ||
              qmat_arena_grow(arena, (void **)&d->made.spheres, &d->sphere_room, count + 1, 4 * sizeof(double));
  if (d->failed) return 0;
  memcpy(&d->made.spheres[4 * count], sphere, 4 * sizeof *sphere);
  d->joints[count] = joint;
  d->before[count] = UINT32_MAX;
  return (uint32_t)d->made.sphere_count++;
}

/* The joint's sphere of a primitive's at these weights. One of the given spheres is made once for each joint. */
static uint32_t sphere_at(division *d, const uint32_t ids[3], int width, const double weights[3], uint32_t joint) {
  double sphere[4] = {0};
  for (int k = 0; k < width; k++) {
    const double *given = &d->unit->spheres[4 * (size_t)ids[k]];
    if (weights[k] >= 1) {
      uint32_t id = d->copies[ids[k]];
      while (id != UINT32_MAX && d->joints[id] != joint) id = d->before[id];
      if (id != UINT32_MAX) return id;
      id = add_sphere(d, given, joint);
      if (d->failed) return 0;
      d->before[id] = d->copies[ids[k]];
      return d->copies[ids[k]] = id;
    }
    for (int i = 0; i < 4; i++) sphere[i] += weights[k] * given[i];
  }
  return add_sphere(d, sphere, joint);
}

static void add_edge(division *d, uint32_t a, uint32_t b) {
  const size_t count = d->made.edge_count;
  d->failed = d->failed || qmat_arena_grow(&d->context->arena, (void **)&d->made.edges, &d->edge_room, count + 1,
                                           2 * sizeof(uint32_t));
  if (d->failed || a == b) return;
  memcpy(&d->made.edges[2 * d->made.edge_count++], (const uint32_t[]){a, b}, 2 * sizeof a);
}

static void add_triangle(division *d, uint32_t a, uint32_t b, uint32_t c) {
  const size_t count = d->made.triangle_count;
  d->failed = d->failed || qmat_arena_grow(&d->context->arena, (void **)&d->made.triangles, &d->triangle_room,
                                           count + 1, 3 * sizeof(uint32_t));
  if (d->failed || a == b || b == c || a == c) return;
  memcpy(&d->made.triangles[3 * d->made.triangle_count++], (const uint32_t[]){a, b, c}, 3 * sizeof a);
}

/* ---- parts ---- */

static int compare_by_low(const void *left, const void *right) {
  const range *a = left, *b = right;
  if (a->low[1] != b->low[1]) return a->low[1] < b->low[1] ? -1 : 1;
  return (a->joint > b->joint) - (a->joint < b->joint);
}

/* Divides a cone at the weights of its second sphere. What is between two parts is halved. */
static void divide_cone(division *d, const uint32_t ids[3], range *of, size_t count) {
  qsort(of, count, sizeof *of, compare_by_low);
  size_t farthest = 0;
  of[0].low[1] = 0;
  for (size_t i = 1; i < count; i++) {
    if (of[i].low[1] > of[farthest].high[1])
      of[i].low[1] = of[farthest].high[1] = 0.5 * (of[i].low[1] + of[farthest].high[1]);
    if (of[i].high[1] > of[farthest].high[1]) farthest = i;
  }
  of[farthest].high[1] = 1;
  for (size_t i = 0; i < count && !d->failed; i++) {
    const double low[3] = {1 - of[i].low[1], of[i].low[1], 0}, high[3] = {1 - of[i].high[1], of[i].high[1], 0};
    const uint32_t a = sphere_at(d, ids, 2, low, of[i].joint);
    if (of[i].high[1] > of[i].low[1]) add_edge(d, a, sphere_at(d, ids, 2, high, of[i].joint));
  }
}

/* Cuts off what of a polygon is beyond the range along a direction, on the side of `sign`. Returns the corners left. */
static int cut_polygon(double polygon[MOST_CORNERS][3], int count, int direction, double sign, double limit) {
  double kept[MOST_CORNERS][3], heights[MOST_CORNERS], most = 0;
  for (int i = 0; i < count; i++) {
    heights[i] = sign * (along(polygon[i], direction) - limit);
    most = fmax(most, heights[i]);
  }
  if (most < least_cut) return count;
  count = qmat_convex_polygon_cut(polygon, heights, count, kept);
  memcpy(polygon, kept, sizeof kept);
  return count;
}

/* Adds what of a slab is in a range: a convex polygon, as slabs around its first corner. A joint that reaches farthest
 * of `all` reaches the border of the slab. */
static void add_part(division *d, const uint32_t ids[3], const range *of, const range *all) {
  double polygon[MOST_CORNERS][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  int count = 3;
  for (int k = 0; k < DIRECTIONS && count > 0; k++) {
    if (of->low[k] > all->low[k]) count = cut_polygon(polygon, count, k, -1, of->low[k]);
    if (of->high[k] < all->high[k]) count = cut_polygon(polygon, count, k, 1, of->high[k]);
  }
  uint32_t corners[MOST_CORNERS];
  if (count < 3) {
    const double middle[3] = {1 / 3.0, 1 / 3.0, 1 / 3.0};
    sphere_at(d, ids, 3, count > 0 ? polygon[0] : middle, of->joint);
    return;
  }
  for (int i = 0; i < count && !d->failed; i++) corners[i] = sphere_at(d, ids, 3, polygon[i], of->joint);
  for (int i = 2; i < count && !d->failed; i++) add_triangle(d, corners[0], corners[i - 1], corners[i]);
}

static void divide_slab(division *d, const uint32_t ids[3], const range *of, size_t count) {
  range all = of[0];
  for (size_t i = 1; i < count; i++)
    for (int k = 0; k < DIRECTIONS; k++) {
      all.low[k] = fmin(all.low[k], of[i].low[k]);
      all.high[k] = fmax(all.high[k], of[i].high[k]);
    }
  for (size_t i = 0; i < count && !d->failed; i++) {
    bool is_small = count > 1;
    double middle[3], sum = 0;
    for (int k = 0; k < 3; k++) {
      is_small = is_small && of[i].high[k] - of[i].low[k] < small_part;
      sum += middle[k] = 0.5 * (of[i].low[k] + of[i].high[k]);
    }
    for (int k = 0; k < 3; k++) middle[k] /= sum;
    if (is_small)
      sphere_at(d, ids, 3, middle, of[i].joint);
    else
      add_part(d, ids, &of[i], &all);
  }
}

/* The joint of the point nearest to the middle of a primitive. */
static uint32_t nearest_joint(const division *d, const uint32_t ids[3], int width) {
  double middle[3] = {0}, least = INFINITY;
  uint32_t joint = d->points->first_joint;
  for (int k = 0; k < 3 * width; k++)
    middle[k % 3] += d->unit->spheres[4 * (size_t)ids[k / 3] + (size_t)(k % 3)] / width;
  for (size_t i = 0; i < d->points->count; i++) {
    const double distance = qmat_point_distance(middle, &d->points->points[4 * i]);
    if (!(distance < least)) continue;
    least = distance;
    joint = d->points->joints[i];
  }
  return joint;
}

static qmat_status divide_all(division *d) {
  const size_t count = qmat_envelope_primitive_count(d->envelope);
  static const double corner[3] = {1, 0, 0};
  d->copies = qmat_arena_alloc(&d->context->arena, d->unit->sphere_count, sizeof *d->copies);
  if (!d->copies) return qmat_fail_memory(d->context, "the parts of joints");
  memset(d->copies, 0xff, d->unit->sphere_count * sizeof *d->copies);
  for (size_t p = 0, at = 0; p < count && !d->failed; p++) {
    uint32_t ids[3];
    const int width = qmat_envelope_primitive(d->envelope, p, ids);
    size_t end = at;
    while (end < d->range_count && d->ranges[end].primitive == p) end++;
    range whole = {.joint = end > at ? d->ranges[at].joint : nearest_joint(d, ids, width), .high = {0, 1}};
    range *of = end > at + 1 ? &d->ranges[at] : &whole;
    const size_t of_count = end > at + 1 ? end - at : 1;
    if (width == 2) divide_cone(d, ids, of, of_count);
    if (width == 3) divide_slab(d, ids, of, of_count);
    for (size_t i = 0; i < of_count && width == 1; i++) sphere_at(d, ids, 1, corner, of[i].joint);
    const qmat_status status = qmat_progress(d->context, p, count, "shapes divided");
    if (status != QMAT_OK) return status;
    at = end;
  }
  return d->failed ? qmat_fail_memory(d->context, "the parts of joints") : QMAT_OK;
}

qmat_status qmat_joint_points_divide(qmat_context *context, const qmat_joint_points *points, const qmat_medial *unit,
                                     qmat_medial *divided, uint32_t **joints) {
  division d = {.context = context, .points = points, .unit = unit};
  qmat_status status = qmat_envelope_of_medial(context, unit, &d.envelope);
  if (status == QMAT_OK) status = find_ranges(&d);
  if (status == QMAT_OK) status = divide_all(&d);
  qmat_envelope_free(d.envelope);
  *divided = d.made;
  *joints = d.joints;
  return status;
}
