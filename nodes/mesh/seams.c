/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/seams.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/half_edges.h"
#include "core/geometry/triangle.h"
#include "nodes/mesh/border_split.h"
#include "nodes/mesh/border_weld.h"

/* The mean thickness of a solid is at least so many times the width of its seams. */
static const double least_thickness = 4;
/* A direction like qmat_border_direction. */
static const double across_strips[3] = {0.3119, -0.7331, 0.6043};
/* Divisions with ever fewer seams. */
enum { MOST_ROUNDS = 3 };

/* A border edge, as its triangle runs along it. */
typedef struct border_edge {
  double strip, along; /* of its middle: a strip as wide as the tolerance, and the place along it */
  uint32_t from, to, triangle;
} border_edge;

/* A triangle in a seam. */
typedef struct seam_triangle {
  uint32_t corners[3];
  double width;  /* the larger distance between the ends of the two edges */
  double length; /* of the border that it closes */
} seam_triangle;

/* What a part with seams is made of. */
typedef struct joined_part {
  bool has_sheets;
  double width, length; /* of its seams: the largest width, and the border that they close */
} joined_part;

typedef struct seam_finder {
  qmat_context *context;
  size_t vertex_count, triangle_count;
  const double *positions;
  const uint32_t *triangles;
  double tolerance; /* the largest width of seams */
  border_edge *border;
  size_t border_count;
  size_t *nearest; /* per border edge; SIZE_MAX: none */
  seam_triangle *seams;
  size_t seam_count;
} seam_finder;

static qmat_status fail_shortage(const seam_finder *s) {
  return qmat_fail_memory(s->context, "the seams");
}

static const double *position(const seam_finder *s, uint32_t vertex) {
  return s->positions + 3 * (size_t)vertex;
}

static double distance(const seam_finder *s, uint32_t a, uint32_t b) {
  return qmat_point_distance(position(s, a), position(s, b));
}

/* ---- edges that run along each other ---- */

static int compare_border_edges(const void *left, const void *right) {
  const border_edge *a = left, *b = right;
  if (a->strip != b->strip) return a->strip < b->strip ? -1 : 1;
  if (a->along != b->along) return a->along < b->along ? -1 : 1;
  return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

static border_edge make_border_edge(const seam_finder *s, uint32_t from, uint32_t to, uint32_t triangle) {
  double middle[3];
  for (size_t k = 0; k < 3; k++) middle[k] = (position(s, from)[k] + position(s, to)[k]) / 2;
  return (border_edge){floor(qmat_dot(across_strips, middle) / s->tolerance), qmat_dot(qmat_border_direction, middle),
                       from, to, triangle};
}

static qmat_status find_border(seam_finder *s) {
  qmat_half_edges e;
  const qmat_status status = qmat_half_edges_sort(s->context, s->vertex_count, s->triangle_count, s->triangles, &e);
  if (status != QMAT_OK) return status;
  for (int pass = 0; pass < 2; pass++) {
    s->border_count = 0;
    for (size_t first = 0, last; first < e.count; first = last) {
      last = qmat_edge_last(&e, first);
      if (last - first > 1) continue;
      const uint32_t h = e.order[first], from = qmat_half_edge_start(&e, h), to = qmat_half_edge_end(&e, h);
      if (pass == 1) s->border[s->border_count] = make_border_edge(s, from, to, h / 3);
      s->border_count++;
    }
    if (pass == 0 && !(s->border = qmat_arena_alloc(&s->context->arena, s->border_count, sizeof *s->border)))
      return fail_shortage(s);
  }
  qsort(s->border, s->border_count, sizeof *s->border, compare_border_edges);
  return QMAT_OK;
}

/* How far apart two edges are that run in opposite directions; infinite for those of one triangle. */
static double width_between(const seam_finder *s, const border_edge *a, const border_edge *b) {
  if (a->triangle == b->triangle || a->from == b->from || a->to == b->to) return INFINITY;
  return fmax(distance(s, a->from, b->to), distance(s, a->to, b->from));
}

static void compare_edges(seam_finder *s, size_t i, size_t k, double *widths) {
  const double width = width_between(s, &s->border[i], &s->border[k]);
  if (!(width <= s->tolerance)) return;
  if (width < widths[i]) widths[i] = width, s->nearest[i] = k;
  if (width < widths[k]) widths[k] = width, s->nearest[k] = i;
}

/* The middles of two near edges are no farther apart than their ends: in one strip, or in two beside each other, as
 * `across_strips` is shorter than 1. */
static qmat_status find_nearest(seam_finder *s) {
  double *widths = qmat_arena_alloc(&s->context->arena, s->border_count, sizeof *widths);
  s->nearest = qmat_arena_alloc(&s->context->arena, s->border_count, sizeof *s->nearest);
  if (!widths || !s->nearest) return fail_shortage(s);
  for (size_t i = 0; i < s->border_count; i++) {
    widths[i] = INFINITY;
    s->nearest[i] = SIZE_MAX;
  }
  size_t next = 0; /* the first edge of the next strip that may be near */
  for (size_t i = 0; i < s->border_count; i++) {
    const border_edge *edge = &s->border[i];
    for (size_t k = i + 1; k < s->border_count && s->border[k].strip == edge->strip; k++) {
      if (s->border[k].along - edge->along > s->tolerance) break;
      compare_edges(s, i, k, widths);
    }
    const border_edge first = {.strip = edge->strip + 1, .along = edge->along - s->tolerance};
    while (next < s->border_count && compare_border_edges(&s->border[next], &first) < 0) next++;
    for (size_t k = next; k < s->border_count && s->border[k].strip == first.strip; k++) {
      if (s->border[k].along - edge->along > s->tolerance) break;
      compare_edges(s, i, k, widths);
    }
    const qmat_status status = qmat_progress(s->context, i, s->border_count, "border edges");
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static void add_seam_triangle(seam_finder *s, uint32_t a, uint32_t b, uint32_t c, double width, double length) {
  if (a == b || b == c || c == a) return; /* the edges have an end in common */
  s->seams[s->seam_count++] = (seam_triangle){{a, b, c}, width, length};
}

/* Two triangles between each two edges that are nearest to each other. */
static qmat_status find_seams(seam_finder *s) {
  qmat_status status = find_border(s);
  if (status == QMAT_OK) status = find_nearest(s);
  if (status != QMAT_OK) return status;
  s->seams = qmat_arena_alloc(&s->context->arena, s->border_count, sizeof *s->seams);
  if (!s->seams) return fail_shortage(s);
  for (size_t i = 0; i < s->border_count; i++) {
    const size_t k = s->nearest[i];
    if (k == SIZE_MAX || k < i || s->nearest[k] != i) continue;
    const border_edge *a = &s->border[i], *b = &s->border[k];
    const double width = width_between(s, a, b);
    add_seam_triangle(s, a->to, a->from, b->to, width, distance(s, a->from, a->to));
    add_seam_triangle(s, a->to, b->to, b->from, width, distance(s, b->from, b->to));
  }
  return QMAT_OK;
}

/* ---- which of them stay ---- */

static double area_of(const seam_finder *s, const uint32_t *corners) {
  double normal[3];
  qmat_triangle_normal(position(s, corners[0]), position(s, corners[1]), position(s, corners[2]), normal);
  return sqrt(qmat_dot(normal, normal)) / 2;
}

static qmat_status divide_with_seams(const seam_finder *s, qmat_parts *parts) {
  const size_t count = s->triangle_count + s->seam_count;
  uint32_t *triangles = qmat_arena_alloc(&s->context->arena, 3 * count, sizeof *triangles);
  if (!triangles) return fail_shortage(s);
  memcpy(triangles, s->triangles, 3 * s->triangle_count * sizeof *triangles);
  for (size_t i = 0; i < s->seam_count; i++)
    memcpy(triangles + 3 * (s->triangle_count + i), s->seams[i].corners, 3 * sizeof *triangles);
  const qmat_status status = qmat_parts_find(s->context, s->vertex_count, s->positions, count, triangles, parts);
  for (size_t i = 0; status == QMAT_OK && i < s->seam_count; i++) {
    qmat_part *part = &parts->parts[parts->part_of[s->triangle_count + i]];
    part->seam_triangles++;
    part->seam_area += area_of(s, s->seams[i].corners);
  }
  return status;
}

static double open_length(const qmat_parts *parts, const qmat_part *part) {
  double length = 0;
  for (size_t l = part->first_loop; l < part->first_loop + part->loop_count; l++) length += parts->loops[l].length;
  return length;
}

static bool stays(const qmat_parts *parts, const qmat_part *part, const joined_part *joined) {
  const double open = open_length(parts, part);
  return !qmat_part_is_sheet(part) && (joined->has_sheets || part->loop_count == 0) && open <= joined->length &&
         2 * fabs(part->volume) >= least_thickness * joined->width * part->area;
}

/* Takes out the seams of parts that they do not improve. `apart`: the parts without seams. */
static qmat_status drop_seams(seam_finder *s, const qmat_parts *apart, const qmat_parts *parts, size_t *dropped) {
  joined_part *joined = qmat_arena_calloc(&s->context->arena, parts->part_count, sizeof *joined);
  if (!joined) return fail_shortage(s);
  for (size_t t = 0; t < s->triangle_count; t++)
    if (apart->parts[apart->part_of[t]].kind == QMAT_PART_OPEN) joined[parts->part_of[t]].has_sheets = true;
  for (size_t i = 0; i < s->seam_count; i++) {
    joined_part *j = &joined[parts->part_of[s->triangle_count + i]];
    j->width = fmax(j->width, s->seams[i].width);
    j->length += s->seams[i].length;
  }
  size_t kept = 0;
  for (size_t i = 0; i < s->seam_count; i++) {
    const uint32_t part = parts->part_of[s->triangle_count + i];
    if (stays(parts, &parts->parts[part], &joined[part])) s->seams[kept++] = s->seams[i];
  }
  *dropped = s->seam_count - kept;
  s->seam_count = kept;
  return QMAT_OK;
}

/* ---- edges split at vertices on them ---- */

/* Takes out the splits of parts that they do not improve. `apart`: the parts without splits. */
static qmat_status drop_splits(const seam_finder *s, const qmat_split_triangles *made, const qmat_parts *apart,
                               const qmat_parts *parts, qmat_edge_split *splits, size_t *count) {
  joined_part *joined = qmat_arena_calloc(&s->context->arena, parts->part_count, sizeof *joined);
  if (!joined) return fail_shortage(s);
  for (size_t i = 0; i < apart->part_count; i++) {
    const qmat_part *before = &apart->parts[i];
    joined_part *j = &joined[parts->part_of[made->first[apart->members[before->first_member]]]];
    j->has_sheets = j->has_sheets || before->kind == QMAT_PART_OPEN;
    j->length += open_length(apart, before);
  }
  for (size_t i = 0; i < parts->part_count; i++) joined[i].length -= open_length(parts, &parts->parts[i]);
  size_t kept = 0;
  for (int pass = 0; pass < 2; pass++)
    for (size_t i = 0; i < *count; i++) {
      const uint32_t part = parts->part_of[made->first[splits[i].half_edge / 3]];
      if (pass == 0)
        joined[part].width = fmax(joined[part].width, splits[i].distance);
      else if (stays(parts, &parts->parts[part], &joined[part]))
        splits[kept++] = splits[i];
    }
  *count = kept;
  return QMAT_OK;
}

/* Splits border edges at border vertices that lie on them. */
static qmat_status split_borders(seam_finder *s, double tolerance, qmat_parts *parts) {
  const qmat_parts apart = *parts;
  qmat_edge_split *splits;
  size_t count, before;
  qmat_status status = qmat_find_edge_splits(s->context, s->vertex_count, s->positions, s->triangle_count, s->triangles,
                                             tolerance, &splits, &count);
  for (int round = 0; status == QMAT_OK && round < MOST_ROUNDS && count > 0; round++) {
    qmat_split_triangles made;
    before = count;
    status = qmat_split_edges(s->context, s->triangle_count, s->triangles, splits, count, &made);
    if (status == QMAT_OK)
      status = qmat_parts_find(s->context, s->vertex_count, s->positions, made.count, made.triangles, parts);
    if (status == QMAT_OK) status = drop_splits(s, &made, &apart, parts, splits, &count);
    if (status != QMAT_OK || count < before) continue;
    s->triangle_count = made.count;
    s->triangles = made.triangles;
    for (size_t i = 0; i < count; i++) {
      parts->edges_split += i == 0 || splits[i].half_edge != splits[i - 1].half_edge;
      parts->split_distance = fmax(parts->split_distance, splits[i].distance);
    }
    return QMAT_OK;
  }
  *parts = apart;
  return status;
}

/* Joins border edges that run along each other. */
static qmat_status join_seams(seam_finder *s, qmat_parts *parts) {
  const qmat_parts apart = *parts;
  qmat_status status = find_seams(s);
  for (int round = 0; status == QMAT_OK && round < MOST_ROUNDS && s->seam_count > 0; round++) {
    size_t dropped = 0;
    status = divide_with_seams(s, parts);
    if (status == QMAT_OK) status = drop_seams(s, &apart, parts, &dropped);
    if (status != QMAT_OK || dropped > 0) continue;
    parts->seam_count = s->seam_count;
    parts->edges_split = apart.edges_split;
    parts->split_distance = apart.split_distance;
    return QMAT_OK;
  }
  *parts = apart;
  return status;
}

qmat_status qmat_parts_find_with_seams(qmat_context *context, size_t vertex_count, const double *positions,
                                       size_t triangle_count, const uint32_t *triangles, double width, double tolerance,
                                       qmat_parts *parts) {
  seam_finder s = {.context = context,
                   .vertex_count = vertex_count,
                   .triangle_count = triangle_count,
                   .positions = positions,
                   .triangles = triangles,
                   .tolerance = width};
  qmat_status status = qmat_parts_find(context, vertex_count, positions, triangle_count, triangles, parts);
  if (status == QMAT_OK && parts->loop_count > 0 && tolerance > 0) status = split_borders(&s, tolerance, parts);
  if (status == QMAT_OK && parts->loop_count > 0 && width > 0) status = join_seams(&s, parts);
  return status;
}
