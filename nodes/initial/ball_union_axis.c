/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/ball_union_axis.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "nodes/initial/ball_union_cgal.h"
#include "nodes/initial/circumsphere.h"
#include "nodes/initial/medial_vertices.h"
#include "nodes/initial/sample_sites.h"

/* Corners are rounded to this grid, so that more than three spheres that meet in one point have one corner there. */
static const double corner_grid = 0x1p32;

/* Circumcentres whose distances to their corners differ by more are too uncertain to be spheres. */
static const double worst_circumcentre = 1e-6;

/* Centres are inside the scaled balls, not far from the unit frame. The box around the corners is farther away. */
static const double farthest_centre = 1;

typedef struct {
  double point[3];
  uint32_t corner;
} rounded_corner;

typedef struct {
  qmat_context *context;
  const double *balls;
  size_t count;
  qmat_ball_union *shape;
  qmat_ball_union_parts parts;
  double *points;      /* 3 per corner, then the box */
  size_t *ball_starts; /* the balls at corner i are ball_ids[ball_starts[i] .. ball_starts[i + 1]) */
  uint32_t *ball_ids;
  qmat_dual_complex dual;
  uint32_t *sphere_of_ball; /* per ball: its medial sphere, or QMAT_NO_ID */
  size_t sphere_count;      /* those of the Voronoi part, then those of further balls */
  uint32_t *polygon;        /* scratch: of a Voronoi face; freed at the end */
  size_t polygon_capacity;
  uint32_t *ball_of_cell; /* per tetrahedron: the ball that all of its corners are on, or QMAT_NO_ID */
} union_axis;

/* --- corners ----------------------------------------------------------------------------------------------------- */

static int by_point(const void *left, const void *right) {
  const rounded_corner *a = left, *b = right;
  for (int k = 0; k < 3; k++)
    if (a->point[k] != b->point[k]) return a->point[k] < b->point[k] ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

/* Rounds the corners. Of equal ones the first gets the balls of all. */
static qmat_status prepare_corners(union_axis *u) {
  qmat_arena *arena = &u->context->arena;
  const size_t count = u->parts.corner_count;
  rounded_corner *sorted = qmat_arena_alloc(arena, count, sizeof *sorted);
  uint32_t *first = qmat_arena_alloc(arena, count, sizeof *first);
  u->points = qmat_arena_alloc(arena, count + QMAT_BOX_CORNERS, 3 * sizeof *u->points);
  u->ball_starts = qmat_arena_calloc(arena, count + QMAT_BOX_CORNERS + 2, sizeof *u->ball_starts);
  u->ball_ids = qmat_arena_alloc(arena, count, 3 * sizeof *u->ball_ids);
  if (!sorted || !first || !u->points || !u->ball_starts || !u->ball_ids)
    return qmat_fail_memory(u->context, "the corners of balls");
  for (size_t i = 0; i < 3 * count; i++) {
    u->points[i] = round(u->parts.corners[i] * corner_grid) / corner_grid;
    sorted[i / 3].point[i % 3] = u->points[i];
    sorted[i / 3].corner = (uint32_t)(i / 3);
  }
  qmat_box_corners(u->points + 3 * count);
  qsort(sorted, count, sizeof *sorted, by_point);
  for (size_t i = 0; i < count; i++) {
    const bool same = i > 0 && memcmp(sorted[i].point, sorted[i - 1].point, sizeof sorted[i].point) == 0;
    first[sorted[i].corner] = same ? first[sorted[i - 1].corner] : sorted[i].corner;
  }
  for (size_t i = 0; i < count; i++) u->ball_starts[first[i] + 2] += 3;
  for (size_t i = 0; i < count + QMAT_BOX_CORNERS; i++) u->ball_starts[i + 2] += u->ball_starts[i + 1];
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 3; k++) u->ball_ids[u->ball_starts[first[i] + 1]++] = u->parts.corner_balls[3 * i + k];
  return QMAT_OK;
}

/* --- Voronoi vertices of the corners ----------------------------------------------------------------------------- */

static bool is_on(const union_axis *u, uint32_t corner, uint32_t ball) {
  for (size_t i = u->ball_starts[corner]; i < u->ball_starts[corner + 1]; i++)
    if (u->ball_ids[i] == ball) return true;
  return false;
}

/* The smallest ball that all corners of a tetrahedron are on. Its centre is their circumcentre, exactly, where the
 * corners themselves would not determine it well. */
static uint32_t common_ball(const union_axis *u, const uint32_t *corners) {
  uint32_t found = QMAT_NO_ID;
  for (size_t i = u->ball_starts[corners[0]]; i < u->ball_starts[corners[0] + 1]; i++) {
    const uint32_t ball = u->ball_ids[i];
    if (ball < found && is_on(u, corners[1], ball) && is_on(u, corners[2], ball) && is_on(u, corners[3], ball))
      found = ball;
  }
  return found;
}

/* Whether the tetrahedron has a Voronoi vertex; sets its sphere. */
static bool find_vertex(union_axis *u, size_t cell) {
  const uint32_t *corners = &u->dual.cells.corners[4 * cell];
  double *sphere = &u->dual.spheres[4 * cell];
  memset(sphere, 0, 4 * sizeof *sphere);
  const double *p[4];
  for (int k = 0; k < 4; k++) {
    if (corners[k] >= u->parts.corner_count) return false;
    p[k] = &u->points[3 * (size_t)corners[k]];
  }
  u->ball_of_cell[cell] = common_ball(u, corners);
  if (u->ball_of_cell[cell] != QMAT_NO_ID) {
    memcpy(sphere, &u->balls[4 * (size_t)u->ball_of_cell[cell]], 4 * sizeof *sphere);
    return true;
  }
  bool good = qmat_circumsphere(p, farthest_centre, sphere);
  for (int k = 1; k < 4 && good; k++)
    good = fabs(qmat_point_distance(p[k], sphere) - sphere[3]) <= worst_circumcentre && sphere[3] > 0;
  if (!good) memset(sphere, 0, 4 * sizeof *sphere);
  return good;
}

/* The part of the Voronoi diagram that lies in the tetrahedra of the dual shape. */
static qmat_status find_voronoi_part(union_axis *u) {
  qmat_context *context = u->context;
  qmat_dual_complex *d = &u->dual;
  qmat_status status = prepare_corners(u);
  if (status == QMAT_OK)
    status = qmat_delaunay_tetrahedra(context, u->points, u->parts.corner_count + QMAT_BOX_CORNERS, &d->cells);
  if (status != QMAT_OK) return status;
  const size_t count = d->cells.count;
  d->kinds = qmat_arena_alloc(&context->arena, count, sizeof *d->kinds);
  d->spheres = qmat_arena_alloc(&context->arena, count, 4 * sizeof *d->spheres);
  u->ball_of_cell = qmat_arena_alloc(&context->arena, count, sizeof *u->ball_of_cell);
  uint8_t *has_vertex = qmat_arena_alloc(&context->arena, count, sizeof *has_vertex);
  if (!d->kinds || !d->spheres || !u->ball_of_cell || !has_vertex)
    return qmat_fail_memory(context, "the Voronoi vertices");
  memset(u->ball_of_cell, 0xff, count * sizeof *u->ball_of_cell);
  for (size_t i = 0; i < count; i++) has_vertex[i] = find_vertex(u, i);
  status = qmat_ball_union_contains(context, u->shape, d->spheres, 4, count, d->kinds);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < count; i++)
    d->kinds[i] = has_vertex[i] && d->kinds[i] ? QMAT_CELL_CIRCUMCENTRE : QMAT_CELL_DROPPED;
  status = qmat_medial_vertices_number(d);
  return status == QMAT_OK ? qmat_dual_connect(d) : status;
}

/* --- where the Voronoi part ends --------------------------------------------------------------------------------- */

/* The medial sphere of a ball; a new one where no kept tetrahedron has it. */
static uint32_t sphere_of(union_axis *u, uint32_t ball) {
  if (u->sphere_of_ball[ball] == QMAT_NO_ID) u->sphere_of_ball[ball] = (uint32_t)u->sphere_count++;
  return u->sphere_of_ball[ball];
}

static qmat_status add_edge(union_axis *u, uint32_t a, uint32_t b) {
  qmat_dual_complex *d = &u->dual;
  if (qmat_grow((void **)&d->edges, &d->edge_capacity, 2 * d->edge_count + 2, sizeof *d->edges))
    return qmat_fail_memory(u->context, "medial edges");
  d->edges[2 * d->edge_count] = a;
  d->edges[2 * d->edge_count++ + 1] = b;
  return QMAT_OK;
}

/* A Voronoi edge leaves the dual shape at the centre of the ball that the three corners of its facet are on: the
 * smallest such ball, or QMAT_NO_ID. The facet is that opposite the corner `apart`. */
static uint32_t exit_ball(const union_axis *u, uint32_t cell, uint32_t apart) {
  const uint32_t *all = &u->dual.cells.corners[4 * (size_t)cell];
  uint32_t corners[4] = {QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID}, found = QMAT_NO_ID;
  for (size_t k = 0, n = 0; k < 4; k++)
    if (all[k] != apart) corners[n++] = all[k];
  for (size_t i = u->ball_starts[corners[0]]; i < u->ball_starts[corners[0] + 1]; i++) {
    const uint32_t ball = u->ball_ids[i];
    if (ball < found && is_on(u, corners[1], ball) && is_on(u, corners[2], ball)) found = ball;
  }
  return found;
}

static bool is_kept(const qmat_dual_complex *d, uint32_t cell) {
  return cell != QMAT_NO_TETRAHEDRON && d->kinds[cell];
}

/* The Voronoi face of the corners (a, b), from the side of the tetrahedron `cell` opposite its corner `x`, across which
 * the next one is not kept. Adds the triangles of the part in the dual shape. Each part is met from both of its ends;
 * one of them adds it. */
static qmat_status add_clipped_face(union_axis *u, uint32_t cell, uint32_t a, uint32_t b, uint32_t x, uint32_t y) {
  qmat_dual_complex *d = &u->dual;
  uint32_t last = cell, leaving = y, next;
  size_t count = 0;
  const uint32_t entry = exit_ball(u, cell, x);
  for (;;) {
    /* Room for this one, and for the two where the face enters and leaves. */
    if (qmat_grow((void **)&u->polygon, &u->polygon_capacity, count + 3, sizeof *u->polygon))
      return qmat_fail_memory(u->context, "medial slabs");
    if (count == 0 && entry != QMAT_NO_ID) u->polygon[count++] = sphere_of(u, entry);
    u->polygon[count++] = d->sphere_of[last];
    const uint32_t across = leaving;
    next = qmat_dual_step_around(d, last, a, b, &leaving);
    if (is_kept(d, next)) {
      last = next;
      continue;
    }
    if (last < cell || (last == cell && y < x)) return QMAT_OK; /* added from the other end */
    const uint32_t leave = exit_ball(u, last, across);
    if (leave != QMAT_NO_ID) u->polygon[count++] = sphere_of(u, leave);
    break;
  }
  if (qmat_grow((void **)&d->triangles, &d->triangle_capacity, 3 * (d->triangle_count + count), sizeof *d->triangles))
    return qmat_fail_memory(u->context, "medial slabs");
  for (size_t i = 1; i + 1 < count; i++) {
    const uint32_t t[3] = {u->polygon[0], u->polygon[i], u->polygon[i + 1]};
    if (t[0] != t[1] && t[1] != t[2] && t[0] != t[2]) memcpy(&d->triangles[3 * d->triangle_count++], t, sizeof t);
  }
  return QMAT_OK;
}

/* Continues the Voronoi part from its outermost vertices to the boundary of the dual shape's tetrahedra. */
static qmat_status add_clipped_parts(union_axis *u) {
  const qmat_dual_complex *d = &u->dual;
  for (uint32_t i = 0; i < d->cells.count; i++) {
    qmat_status status = i % 16384 == 0 ? qmat_progress(u->context, i, d->cells.count, "dual cells") : QMAT_OK;
    const uint32_t *corners = &d->cells.corners[4 * (size_t)i];
    for (uint32_t x = 0; x < 4 && status == QMAT_OK && d->kinds[i]; x++) {
      if (is_kept(d, d->cells.neighbours[4 * (size_t)i + x])) continue;
      const uint32_t ball = exit_ball(u, i, corners[x]);
      if (ball != QMAT_NO_ID) status = add_edge(u, d->sphere_of[i], sphere_of(u, ball));
      for (uint32_t y = 0; y < 4 && status == QMAT_OK; y++) {
        if (y == x) continue;
        uint32_t ends[2], n = 0;
        for (uint32_t k = 0; k < 4; k++)
          if (k != x && k != y) ends[n++] = corners[k];
        status = add_clipped_face(u, i, ends[0], ends[1], corners[x], corners[y]);
      }
    }
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* --- both parts -------------------------------------------------------------------------------------------------- */

static qmat_status set_spheres(const union_axis *u, qmat_medial *medial) {
  const qmat_dual_complex *d = &u->dual;
  const size_t count = u->sphere_count;
  medial->sphere_count = count;
  medial->spheres = qmat_alloc(count, 4 * sizeof *medial->spheres);
  medial->region_offset_count = count + 1;
  medial->region_offsets = qmat_calloc(count + 1, sizeof *medial->region_offsets);
  if (!medial->spheres || !medial->region_offsets) return qmat_fail_memory(u->context, "medial spheres");
  uint32_t next = 0; /* merged centres take the sphere of their first tetrahedron */
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell] && d->sphere_of[cell] == next)
      memcpy(&medial->spheres[4 * (size_t)next++], &d->spheres[4 * cell], 4 * sizeof *medial->spheres);
  for (size_t i = 0; i < u->count; i++)
    if (u->sphere_of_ball[i] != QMAT_NO_ID && u->sphere_of_ball[i] >= next)
      memcpy(&medial->spheres[4 * (size_t)u->sphere_of_ball[i]], &u->balls[4 * i], 4 * sizeof *medial->spheres);
  return QMAT_OK;
}

/* The singular simplices join the Voronoi part at the centres of balls. */
static qmat_status join_parts(union_axis *u, qmat_medial *medial) {
  qmat_dual_complex *d = &u->dual;
  const qmat_ball_union_parts *parts = &u->parts;
  u->sphere_of_ball = qmat_arena_alloc(&u->context->arena, u->count, sizeof *u->sphere_of_ball);
  if (!u->sphere_of_ball) return qmat_fail_memory(u->context, "medial spheres");
  memset(u->sphere_of_ball, 0xff, u->count * sizeof *u->sphere_of_ball);
  for (size_t i = 0; i < d->cells.count; i++)
    if (d->kinds[i] && u->ball_of_cell[i] != QMAT_NO_ID && u->sphere_of_ball[u->ball_of_cell[i]] == QMAT_NO_ID)
      u->sphere_of_ball[u->ball_of_cell[i]] = d->sphere_of[i];
  u->sphere_count = d->sphere_count;
  qmat_status status = add_clipped_parts(u);
  for (size_t i = 0; i < u->count; i++)
    if (parts->isolated[i]) sphere_of(u, (uint32_t)i);
  for (size_t i = 0; i < parts->edge_count && status == QMAT_OK; i++) {
    const uint32_t a = sphere_of(u, parts->edges[2 * i]);
    status = add_edge(u, a, sphere_of(u, parts->edges[2 * i + 1]));
  }
  if (status == QMAT_OK && qmat_grow((void **)&d->triangles, &d->triangle_capacity,
                                     3 * (d->triangle_count + parts->triangle_count), sizeof *d->triangles))
    status = qmat_fail_memory(u->context, "medial slabs");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < 3 * parts->triangle_count; i++)
    d->triangles[3 * d->triangle_count + i] = sphere_of(u, parts->triangles[i]);
  d->triangle_count += parts->triangle_count;
  if ((status = set_spheres(u, medial)) != QMAT_OK) return status;
  return qmat_medial_set_simplices(u->context, medial, d->edges, d->edge_count, d->triangles, d->triangle_count);
}

qmat_status qmat_ball_union_axis(qmat_context *context, const double *balls, size_t count, double merge,
                                 qmat_medial *medial, qmat_ball_union_counts *counts) {
  union_axis u = {.context = context, .balls = balls, .count = count, .dual = {.context = context, .merge = merge}};
  qmat_status status = qmat_ball_union_new(context, balls, count, &u.shape, &u.parts);
  if (status == QMAT_OK) status = find_voronoi_part(&u);
  if (status == QMAT_OK) status = join_parts(&u, medial);
  *counts = (qmat_ball_union_counts){u.parts.corner_count, u.parts.edge_count, u.parts.triangle_count};
  qmat_ball_union_free(u.shape);
  qmat_free(u.dual.edges);
  qmat_free(u.dual.triangles);
  qmat_free(u.polygon);
  return status;
}
