/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/turned_parts.h"

#include <math.h>
#include <stdlib.h>

#include "core/geometry/triangle.h"
#include "core/geometry/winding_tree.h"
#include "nodes/mesh/box_pairs_cgal.h"

/* Points are so far outside of a part, in diagonals: more than planes that should be one are apart by rounding. */
static const double outside = 2e-6;
/* Points of a part; odd, so that most of them decide. */
enum { POINTS = 15 };

/* A solid part that faces inwards, and another one that may be around it. */
typedef struct neighbours {
  uint32_t part, other;
} neighbours;

/* A triangle of a part, sorted by its place. */
typedef struct placed_triangle {
  double centre[3], area;
  uint32_t triangle;
} placed_triangle;

typedef struct turner {
  qmat_context *context;
  const qmat_parts *parts;
  double *boxes; /* of the solid parts: 6 * solid_count */
  uint32_t *solids;
  double *inward_boxes;
  uint32_t *inward; /* solid parts that face inwards */
  size_t solid_count, inward_count;
  uint32_t *slots;   /* per part: its box */
  neighbours *pairs; /* on the heap */
  size_t pair_count, pair_capacity;
  qmat_winding_tree **trees; /* per part; NULL: few triangles, or nothing is near it */
} turner;

static qmat_status fail_shortage(const turner *t) {
  return qmat_fail_memory(t->context, "the parts that face inwards");
}

static const double *corner(const turner *t, uint32_t triangle, size_t k) {
  return t->parts->positions + 3 * (size_t)t->parts->triangles[3 * (size_t)triangle + k];
}

/* ---- parts near each other ---- */

static qmat_status list_parts(turner *t) {
  qmat_arena *arena = &t->context->arena;
  const size_t count = t->parts->part_count;
  t->boxes = qmat_arena_alloc(arena, count, 6 * sizeof *t->boxes);
  t->solids = qmat_arena_alloc(arena, count, sizeof *t->solids);
  t->inward_boxes = qmat_arena_alloc(arena, count, 6 * sizeof *t->inward_boxes);
  t->inward = qmat_arena_alloc(arena, count, sizeof *t->inward);
  t->slots = qmat_arena_alloc(arena, count, sizeof *t->slots);
  if (!t->boxes || !t->solids || !t->inward_boxes || !t->inward || !t->slots) return fail_shortage(t);
  for (uint32_t i = 0; i < count; i++) {
    const qmat_part *part = &t->parts->parts[i];
    if (qmat_part_is_sheet(part)) continue;
    double *box = t->boxes + 6 * t->solid_count;
    for (size_t k = 0; k < 3; k++) box[k] = INFINITY, box[3 + k] = -INFINITY;
    qmat_part_grow_box(t->parts, i, box);
    t->slots[i] = (uint32_t)t->solid_count;
    t->solids[t->solid_count++] = i;
    if (part->volume >= 0) continue;
    for (size_t k = 0; k < 6; k++) t->inward_boxes[6 * t->inward_count + k] = box[k] + (k < 3 ? -outside : outside);
    t->inward[t->inward_count++] = i;
  }
  return QMAT_OK;
}

static qmat_status add_pair(void *data, uint32_t inward, uint32_t solid) {
  turner *t = data;
  if (t->inward[inward] == t->solids[solid]) return QMAT_OK;
  if (t->pair_count == t->pair_capacity &&
      qmat_grow((void **)&t->pairs, &t->pair_capacity, t->pair_count + 1, sizeof *t->pairs) != 0)
    return fail_shortage(t);
  t->pairs[t->pair_count++] = (neighbours){t->inward[inward], t->solids[solid]};
  return QMAT_OK;
}

static int compare_pairs(const void *left, const void *right) {
  const neighbours *a = left, *b = right;
  if (a->part != b->part) return a->part < b->part ? -1 : 1;
  return (a->other > b->other) - (a->other < b->other);
}

/* ---- points of a part ---- */

static int compare_places(const void *left, const void *right) {
  const placed_triangle *a = left, *b = right;
  for (size_t k = 0; k < 3; k++)
    if (a->centre[k] != b->centre[k]) return a->centre[k] < b->centre[k] ? -1 : 1;
  if (a->area != b->area) return a->area < b->area ? -1 : 1;
  return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

/* Points behind the centroids of triangles at even steps of the area: outside of a part that faces inwards. 0 where no
 * triangle has an area. */
static size_t choose_points(const turner *t, const qmat_part *part, placed_triangle *places, double (*points)[3]) {
  double all = 0, area = 0;
  size_t count = 0;
  for (size_t i = 0; i < part->triangle_count; i++) {
    const uint32_t triangle = t->parts->members[part->first_member + i];
    const double *a = corner(t, triangle, 0), *b = corner(t, triangle, 1), *c = corner(t, triangle, 2);
    double normal[3];
    qmat_triangle_normal(a, b, c, normal);
    places[i] = (placed_triangle){.area = sqrt(qmat_dot(normal, normal)) / 2, .triangle = triangle};
    for (size_t k = 0; k < 3; k++) places[i].centre[k] = (a[k] + b[k] + c[k]) / 3;
  }
  qsort(places, part->triangle_count, sizeof *places, compare_places);
  for (size_t i = 0; i < part->triangle_count; i++) all += places[i].area;
  for (size_t i = 0; i < part->triangle_count; i++) {
    const placed_triangle *p = &places[i];
    double normal[3];
    qmat_triangle_normal(corner(t, p->triangle, 0), corner(t, p->triangle, 1), corner(t, p->triangle, 2), normal);
    for (area += p->area; count < POINTS && area > ((double)count + 0.5) / POINTS * all; count++)
      for (size_t k = 0; k < 3; k++) points[count][k] = p->centre[k] - outside * normal[k] / (2 * p->area);
  }
  return count;
}

/* ---- winding numbers ---- */

/* Parts with more triangles than this are asked through a tree. */
enum { MOST_SUMMED = 256 };
/* So near to one half a tree decides nothing, and triangles are summed. */
static const double near_half = 0.1;
/* Parts, and undecided points, between two calls of the progress function. */
enum { SLICE = 64, SUMMED_SLICE = 8 };

/* Parts that are tested together, and their points, one after the other. */
typedef struct batch {
  size_t first_pair[SLICE + 1]; /* pairs by part */
  size_t first_point[SLICE + 1];
  size_t part_count, undecided_count;
  double points[SLICE * POINTS][3];
  uint8_t wound[SLICE * POINTS];
  uint16_t part_of[SLICE * POINTS], undecided[SLICE * POINTS];
} batch;

static qmat_status make_trees(turner *t) {
  t->trees = qmat_arena_calloc(&t->context->arena, t->parts->part_count, sizeof *t->trees);
  if (!t->trees) return fail_shortage(t);
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < t->pair_count && status == QMAT_OK; i++) {
    const uint32_t other = t->pairs[i].other;
    const qmat_part *part = &t->parts->parts[other];
    if (part->triangle_count <= MOST_SUMMED || t->trees[other]) continue;
    status = qmat_winding_tree_new(t->context, t->parts->positions, t->parts->triangles,
                                   t->parts->members + part->first_member, part->triangle_count, &t->trees[other]);
  }
  return status;
}

static double summed_winding(const turner *t, const qmat_part *part, const double *point) {
  double winding = 0;
  for (size_t m = part->first_member; m < part->first_member + part->triangle_count; m++) {
    const uint32_t triangle = t->parts->members[m];
    winding += qmat_seen_share(point, corner(t, triangle, 0), corner(t, triangle, 1), corner(t, triangle, 2));
  }
  return winding;
}

/* How often the others are wound around a point. */
static double winding_of(const turner *t, const neighbours *others, size_t count, const double *point, bool summed) {
  double winding = 0;
  for (size_t i = 0; i < count; i++) {
    const uint32_t other = others[i].other;
    const double *box = t->boxes + 6 * (size_t)t->slots[other];
    if (point[0] < box[0] || point[1] < box[1] || point[2] < box[2] || point[0] > box[3] || point[1] > box[4] ||
        point[2] > box[5])
      continue;
    winding += summed || !t->trees[other] ? summed_winding(t, &t->parts->parts[other], point)
                                          : qmat_winding_tree_number(t->trees[other], point);
  }
  return fabs(winding);
}

static double winding_at(const turner *t, const batch *b, size_t point, bool summed) {
  const size_t *pairs = b->first_pair + b->part_of[point];
  return winding_of(t, t->pairs + pairs[0], pairs[1] - pairs[0], b->points[point], summed);
}

static qmat_status test_points(const turner *t, batch *b) {
  const int threads = qmat_threads(t->context);
  const size_t count = b->first_point[b->part_count];
  double winding[SLICE * POINTS];
#pragma omp parallel for num_threads(threads) schedule(dynamic)
  for (size_t i = 0; i < count; i++) winding[i] = winding_at(t, b, i, false);
  b->undecided_count = 0;
  for (size_t i = 0; i < count; i++) {
    b->wound[i] = winding[i] > 0.5;
    if (fabs(winding[i] - 0.5) < near_half) b->undecided[b->undecided_count++] = (uint16_t)i;
  }
  qmat_status status = QMAT_OK;
  for (size_t first = 0; first < b->undecided_count && status == QMAT_OK; first += SUMMED_SLICE) {
    const size_t end = first + SUMMED_SLICE < b->undecided_count ? first + SUMMED_SLICE : b->undecided_count;
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (size_t i = first; i < end; i++) b->wound[b->undecided[i]] = winding_at(t, b, b->undecided[i], true) > 0.5;
    status = qmat_progress(t->context, b->first_pair[0], t->pair_count, "parts");
  }
  return status;
}

/* The next parts and their points. */
static void fill_batch(const turner *t, size_t first, placed_triangle *places, batch *b) {
  size_t pair = first, points = 0, i = 0;
  for (; i < SLICE && pair < t->pair_count; i++) {
    const uint32_t part = t->pairs[pair].part;
    b->first_pair[i] = pair;
    b->first_point[i] = points;
    const size_t count = choose_points(t, &t->parts->parts[part], places, b->points + points);
    for (const size_t end = points + count; points < end; points++) b->part_of[points] = (uint16_t)i;
    while (pair < t->pair_count && t->pairs[pair].part == part) pair++;
  }
  b->part_count = i;
  b->first_pair[i] = pair;
  b->first_point[i] = points;
}

/* Whether the others are wound around most points of a part. */
static bool is_within(const batch *b, size_t part) {
  size_t within = 0;
  const size_t first = b->first_point[part], end = b->first_point[part + 1];
  for (size_t i = first; i < end; i++) within += b->wound[i];
  return 2 * within > end - first;
}

static qmat_status test_parts(turner *t, uint8_t *facing) {
  size_t most = 0;
  for (size_t i = 0; i < t->inward_count; i++) {
    const qmat_part *part = &t->parts->parts[t->inward[i]];
    facing[t->inward[i]] = QMAT_FACING_TURNED;
    if (part->triangle_count > most) most = part->triangle_count;
  }
  if (t->pair_count == 0) return QMAT_OK;
  placed_triangle *places = qmat_arena_alloc(&t->context->arena, most, sizeof *places);
  batch *b = qmat_arena_alloc(&t->context->arena, 1, sizeof *b);
  if (!places || !b) return fail_shortage(t);
  qsort(t->pairs, t->pair_count, sizeof *t->pairs, compare_pairs);
  qmat_status status = make_trees(t);
  for (size_t first = 0; first < t->pair_count && status == QMAT_OK; first = b->first_pair[b->part_count]) {
    status = qmat_progress(t->context, first, t->pair_count, "parts");
    if (status != QMAT_OK) break;
    fill_batch(t, first, places, b);
    status = test_points(t, b);
    if (status != QMAT_OK) break;
    for (size_t i = 0; i < b->part_count; i++)
      if (is_within(b, i)) facing[t->pairs[b->first_pair[i]].part] = QMAT_FACING_CAVITY;
  }
  for (size_t i = 0; t->trees && i < t->parts->part_count; i++) qmat_winding_tree_free(t->trees[i]);
  return status;
}

qmat_status qmat_find_turned_parts(qmat_context *context, const qmat_parts *parts, uint8_t *facing) {
  turner t = {.context = context, .parts = parts};
  qmat_status status = list_parts(&t);
  if (status == QMAT_OK && t.inward_count > 0)
    status = qmat_find_box_pairs(context, t.inward_boxes, t.inward_count, t.boxes, t.solid_count, add_pair, &t);
  if (status == QMAT_OK) status = test_parts(&t, facing);
  qmat_free(t.pairs);
  return status;
}
