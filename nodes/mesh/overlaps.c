/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/overlaps.h"

#include <math.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/vector.h"
#include "nodes/mesh/box_pairs_cgal.h"
#include "nodes/mesh/crossings_cgal.h"
#include "nodes/mesh/square_blocks.h"

typedef struct box {
  double low[3], high[3];
} box;

/* A patch, connected across edges of two triangles: its bounding box, and the box of its intersections with the boxes
 * of other patches. */
typedef struct patch {
  uint32_t leader; /* triangle */
  box bounds, reach;
} patch;

typedef struct unison {
  qmat_context *context;
  size_t vertex_count, triangle_count;
  const double *positions;
  const uint32_t *triangles;
  uint32_t *shells, *patches, *groups; /* disjoint sets of triangles; groups: shells that may meet */
} unison;

static qmat_status fail_shortage(qmat_context *context) {
  return qmat_fail_memory(context, "the parts of the mesh");
}

/* Joins triangles at their edges. */
static qmat_status find_shells(unison *u) {
  u->shells = qmat_sets_new(u->context, u->triangle_count);
  u->patches = qmat_sets_new(u->context, u->triangle_count);
  u->groups = qmat_sets_new(u->context, u->triangle_count);
  if (!u->shells || !u->patches || !u->groups) return fail_shortage(u->context);
  qmat_half_edges e;
  const qmat_status status = qmat_half_edges_sort(u->context, u->vertex_count, u->triangle_count, u->triangles, &e);
  for (size_t first = 0, last; status == QMAT_OK && first < e.count; first = last) {
    last = qmat_edge_last(&e, first);
    for (size_t i = first + 1; i < last; i++) {
      qmat_sets_join(u->shells, e.order[first] / 3, e.order[i] / 3);
      qmat_sets_join(u->groups, e.order[first] / 3, e.order[i] / 3);
    }
    if (last - first == 2) qmat_sets_join(u->patches, e.order[first] / 3, e.order[first + 1] / 3);
  }
  return status;
}

/* ---- boxes ---- */

static const box no_box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void grow_box(box *b, const double *point) {
  for (int k = 0; k < 3; k++) {
    b->low[k] = qmat_smaller(b->low[k], point[k]);
    b->high[k] = qmat_larger(b->high[k], point[k]);
  }
}

static box triangle_box(const unison *mesh, size_t triangle) {
  box b = no_box;
  for (size_t k = 0; k < 3; k++) grow_box(&b, mesh->positions + 3 * (size_t)mesh->triangles[3 * triangle + k]);
  return b;
}

/* False if the boxes are disjoint. */
static bool intersect_boxes(const box *a, const box *b, box *common) {
  bool meet = true;
  for (int k = 0; k < 3; k++) {
    common->low[k] = qmat_larger(a->low[k], b->low[k]);
    common->high[k] = qmat_smaller(a->high[k], b->high[k]);
    meet = meet && common->low[k] <= common->high[k];
  }
  return meet;
}

/* Boxes of blocks whose planes rounding has moved apart have to meet. */
static void widen_boxes(patch *patches, size_t count) {
  box all = no_box;
  for (size_t i = 0; i < count; i++) {
    grow_box(&all, patches[i].bounds.low);
    grow_box(&all, patches[i].bounds.high);
  }
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) {
      patches[i].bounds.low[k] -= QMAT_SAME_PLANE * qmat_point_distance(all.low, all.high);
      patches[i].bounds.high[k] += QMAT_SAME_PLANE * qmat_point_distance(all.low, all.high);
    }
}

/* What joins patches whose boxes meet. */
typedef struct near_search {
  unison *u;
  patch *patches;
  uint8_t *is_near;
} near_search;

static qmat_status join_patches(void *data, uint32_t i, uint32_t k) {
  const near_search *n = data;
  patch *a = &n->patches[i], *b = &n->patches[k];
  box common;
  if (!intersect_boxes(&a->bounds, &b->bounds, &common)) return QMAT_OK;
  grow_box(&a->reach, common.low);
  grow_box(&a->reach, common.high);
  grow_box(&b->reach, common.low);
  grow_box(&b->reach, common.high);
  qmat_sets_join(n->u->groups, a->leader, b->leader);
  n->is_near[qmat_set_leader(n->u->shells, a->leader)] = n->is_near[qmat_set_leader(n->u->shells, b->leader)] = 1;
  return QMAT_OK;
}

/* Finds the patches of shells whose boxes intersect, or are apart by rounding only. `reaches` (per triangle) becomes 1
 * if the triangle's box meets such an intersection, and `is_near` (zeroed, per shell by its leader) becomes 1 for their
 * shells. */
static qmat_status find_near(unison *u, uint8_t *reaches, uint8_t *is_near) {
  qmat_arena *arena = &u->context->arena;
  uint32_t *numbers = qmat_arena_alloc(arena, u->triangle_count, sizeof *numbers);
  size_t count = 0;
  for (uint32_t t = 0; numbers && t < u->triangle_count; t++)
    if (qmat_set_leader(u->patches, t) == t) numbers[t] = (uint32_t)count++;
  patch *patches = qmat_arena_alloc(arena, count, sizeof *patches);
  double *bounds = qmat_arena_alloc(arena, count, 6 * sizeof *bounds);
  if (!numbers || !patches || !bounds) return fail_shortage(u->context);
  for (uint32_t t = 0; t < u->triangle_count; t++) {
    const uint32_t leader = qmat_set_leader(u->patches, t);
    patch *s = &patches[numbers[leader]];
    if (leader == t) *s = (patch){t, no_box, no_box};
    for (size_t k = 0; k < 3; k++) grow_box(&s->bounds, u->positions + 3 * (size_t)u->triangles[3 * (size_t)t + k]);
  }
  widen_boxes(patches, count);
  for (size_t i = 0; i < 6 * count; i++)
    bounds[i] = i % 6 < 3 ? patches[i / 6].bounds.low[i % 6] : patches[i / 6].bounds.high[i % 6 - 3];
  near_search search = {u, patches, is_near};
  const qmat_status status = qmat_find_box_pairs(u->context, bounds, count, NULL, 0, join_patches, &search);
  for (uint32_t t = 0; status == QMAT_OK && t < u->triangle_count; t++) {
    const box of_triangle = triangle_box(u, t);
    box common;
    reaches[t] = intersect_boxes(&of_triangle, &patches[numbers[qmat_set_leader(u->patches, t)]].reach, &common);
  }
  return status;
}

qmat_status qmat_unite_overlaps(qmat_context *context, size_t vertex_count, const double *positions,
                                size_t triangle_count, const uint32_t *triangles, double longest_fold,
                                qmat_united *united) {
  *united = (qmat_united){.changed = false};
  if (triangle_count == 0) return QMAT_OK;
  unison u = {context, vertex_count, triangle_count, positions, triangles, NULL, NULL, NULL};
  qmat_arena *arena = &context->arena;
  uint8_t *reaches = qmat_arena_alloc(arena, triangle_count, 1), *is_near = qmat_arena_calloc(arena, triangle_count, 1),
          *crosses = qmat_arena_calloc(arena, triangle_count, 1);
  uint32_t *shells = qmat_arena_alloc(arena, triangle_count, sizeof *shells);
  if (!reaches || !is_near || !crosses || !shells) return fail_shortage(context);
  qmat_status status = find_shells(&u);
  if (status == QMAT_OK) status = find_near(&u, reaches, is_near);
  if (status != QMAT_OK) return status;
  for (uint32_t t = 0; t < triangle_count; t++) {
    shells[t] = qmat_set_leader(u.shells, t);
    u.patches[t] = qmat_set_leader(u.patches, t);
  }
  qmat_shells input = {.vertex_count = vertex_count,
                       .triangle_count = triangle_count,
                       .positions = positions,
                       .triangles = triangles,
                       .shells = shells,
                       .patches = u.patches,
                       .reaches = reaches,
                       .crosses = crosses,
                       .longest_fold = longest_fold};
  status = qmat_find_crossings(context, &input, crosses);
  if (status != QMAT_OK) return status;
  bool any = false;
  for (size_t t = 0; t < triangle_count; t++) {
    if (crosses[t]) is_near[shells[t]] = 1;
    any = any || is_near[shells[t]];
  }
  if (!any) return QMAT_OK;
  for (uint32_t t = 0; t < triangle_count; t++) u.groups[t] = qmat_set_leader(u.groups, t);
  for (uint32_t t = 0; t < triangle_count; t++)
    if (!is_near[shells[t]]) shells[t] = u.groups[t] = QMAT_NO_SHELL;
  qmat_shells squared = input;
  double moved;
  status = qmat_square_blocks(context, u.groups, &squared, &moved);
  if (status == QMAT_OK) status = qmat_unite_shells(context, &squared, united);
  if (status == QMAT_OK && united->changed) united->moved = moved;
  if (status == QMAT_OK && united->why_not && squared.given) status = qmat_unite_shells(context, &input, united);
  return status;
}
