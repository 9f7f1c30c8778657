/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/outer_hull.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/colliders/convex_hull_cgal.h"
#include "nodes/colliders/hull_vertices.h"

/* Vertices with more triangles around stay. The points farthest along some directions come first. */
enum { MOST_AROUND = 48, DIRECTIONS = 14 };

/* A round adds points that add this share of the largest volume. */
static const double worth = 0.5;

/* The first sweeps go half of the way, so that all vertices get their share. Sweeps end when one gains less than this
 * share of the volume. */
enum { HALF_SWEEPS = 8, MOST_SWEEPS = 20 };
static const double least_gain = 2e-4;

/* In half sizes of the cloud: what counts as in a plane, and the least length. Of planes: the square of the sine of the
 * least angle between two that meet in a line, and that of a line and a plane that meet. */
static const double on_plane = 1e-8, least_length = 1e-12, least_square = 1e-9, least_slope = 1e-9;

static const uint32_t none = UINT32_MAX;

/* A linear program: the least value . point with normal . point >= offset for all rows. */
typedef struct program {
  double rows[2 * MOST_AROUND][4], value[3];
  size_t count;
} program;

qmat_status qmat_outer_hull_init(qmat_context *context, size_t room, size_t most, qmat_outer_hull *h) {
  qmat_arena *arena = &context->arena;
  *h = (qmat_outer_hull){.room = room,
                         .most = most,
                         .points = qmat_arena_alloc(arena, most, 3 * sizeof *h->points),
                         .cloud = qmat_arena_alloc(arena, room, 3 * sizeof *h->cloud),
                         .tangents = qmat_arena_alloc(arena, most, 6 * 4 * sizeof *h->tangents),
                         .scores = qmat_arena_alloc(arena, most, 2 * sizeof *h->scores),
                         .triangles = qmat_arena_alloc(arena, most, 6 * sizeof *h->triangles),
                         .twins = qmat_arena_alloc(arena, most, 6 * sizeof *h->twins),
                         .scratch = qmat_arena_alloc(arena, most, 6 * sizeof *h->scratch),
                         .leaving = qmat_arena_alloc(arena, most, sizeof *h->leaving),
                         .farthest = qmat_arena_alloc(arena, most, 2 * sizeof *h->farthest),
                         .known = qmat_arena_alloc(arena, most, 6 * sizeof *h->known),
                         .chosen = qmat_arena_alloc(arena, room, sizeof *h->chosen)};
  if (h->points && h->cloud && h->tangents && h->scores && h->triangles && h->twins && h->scratch && h->leaving &&
      h->farthest && h->known && h->chosen)
    return QMAT_OK;
  return qmat_fail_memory(context, "the hulls");
}

static uint32_t next(uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}

static uint32_t previous(uint32_t h) {
  return h % 3 == 0 ? h + 2 : h - 1;
}

static const double *start_of(const qmat_outer_hull *hull, uint32_t h) {
  return &hull->points[3 * (size_t)hull->triangles[h]];
}

/* The unit normal of the triangle of a half-edge, outward. */
static bool find_normal(const qmat_outer_hull *hull, uint32_t h, double normal[3]) {
  double u[3], v[3];
  qmat_subtract(start_of(hull, next(h)), start_of(hull, h), u);
  qmat_subtract(start_of(hull, previous(h)), start_of(hull, h), v);
  qmat_cross(u, v, normal);
  if (!(qmat_dot(normal, normal) > least_length * least_length * qmat_dot(u, u))) return false;
  qmat_normalize(normal);
  return true;
}

/* The tangent plane of the cloud through a half-edge: that into which the half-edge's triangle turns when it turns
 * inward until it touches the cloud. */
static bool find_tangent(qmat_outer_hull *hull, uint32_t h) {
  double *tangent = &hull->tangents[4 * (size_t)h], normal[3], along[3], inward[3];
  if (hull->known[h]) return true;
  const double *p = start_of(hull, h);
  qmat_subtract(start_of(hull, next(h)), p, along);
  if (!(qmat_dot(along, along) > least_length * least_length) || !find_normal(hull, h, normal)) return false;
  qmat_normalize(along);
  qmat_cross(normal, along, inward);
  /* Depth below the triangle's plane and way from the edge into it; the least angle between the two is that whose
   * cotangent is the largest. */
  const double depth_of_p = qmat_dot(normal, p), way_of_p = qmat_dot(inward, p);
  double best_depth = 0, best_way = 0;
  bool found = false;
  for (size_t i = 0; i < hull->cloud_count; i++) {
    const double *k = &hull->cloud[3 * i];
    const double below = depth_of_p - qmat_dot(normal, k), way = qmat_dot(inward, k) - way_of_p;
    const double depth = below > on_plane ? below : 0;
    if (depth == 0 && way < 10 * on_plane) continue;
    if (found && !(way * best_depth > best_way * depth)) continue;
    found = true;
    best_way = way;
    best_depth = depth;
  }
  const double length = sqrt(best_way * best_way + best_depth * best_depth);
  if (!found || !(length > 0)) return false;
  for (int k = 0; k < 3; k++) tangent[k] = (best_way * normal[k] + best_depth * inward[k]) / length;
  tangent[3] = qmat_dot(tangent, p);
  hull->known[h] = 1;
  return true;
}

/* The half-edges around a vertex, in their order; 0 for too many. */
static size_t find_ring(const qmat_outer_hull *hull, uint32_t vertex, uint32_t ring[MOST_AROUND]) {
  const uint32_t first = hull->leaving[vertex];
  uint32_t o = first;
  size_t count = 0;
  do {
    if (count == MOST_AROUND) return 0;
    ring[count++] = next(o);
    o = hull->twins[previous(o)];
  } while (o != first);
  return count;
}

/* The part of the line at + s * way that is feasible; false: none. */
static bool clip_line(const program *p, const double at[3], const double way[3], double *low, double *high) {
  *low = -INFINITY;
  *high = INFINITY;
  for (size_t i = 0; i < p->count; i++) {
    const double slope = qmat_dot(p->rows[i], way), rest = p->rows[i][3] - qmat_dot(p->rows[i], at);
    if (fabs(slope) < least_slope) {
      if (rest > on_plane) return false;
      continue;
    }
    if (slope > 0)
      *low = qmat_larger(*low, rest / slope);
    else
      *high = qmat_smaller(*high, rest / slope);
    if (*low > *high + on_plane) return false;
  }
  return true;
}

/* The feasible point of the least value, on the lines where two planes meet. Whether one is below `*best`. */
static bool solve(const program *p, double point[3], double *best) {
  bool found = false;
  for (size_t i = 0; i < p->count; i++)
    for (size_t j = 0; j < i; j++) {
      const double *a = p->rows[i], *b = p->rows[j], between = qmat_dot(a, b), square = 1 - between * between;
      double way[3], at[3], low, high;
      if (square < least_square) continue;
      qmat_cross(a, b, way);
      qmat_normalize(way);
      const double of_a = (a[3] - between * b[3]) / square, of_b = (b[3] - between * a[3]) / square;
      for (int k = 0; k < 3; k++) at[k] = of_a * a[k] + of_b * b[k];
      if (!clip_line(p, at, way, &low, &high)) continue;
      const double s = qmat_dot(p->value, way) > 0 ? low : high,
                   value = qmat_dot(p->value, at) + s * qmat_dot(p->value, way);
      if (!isfinite(s) || !(value < *best)) continue;
      *best = value;
      for (int k = 0; k < 3; k++) point[k] = at[k] + s * way[k];
      found = true;
    }
  return found;
}

/* The program of a vertex inside of a ring: outside of the tangent planes, so that the cloud is below the triangles
 * from the ring to the vertex, and not so far out that they turn over and cut the cloud from the other side. */
static bool make_program(qmat_outer_hull *hull, const uint32_t *ring, size_t count, program *p) {
  *p = (program){.count = 0};
  for (size_t i = 0; i < count; i++) {
    const uint32_t h = ring[i], beyond = hull->twins[h];
    double cross[3];
    if (!find_tangent(hull, h) || !find_tangent(hull, beyond)) return false;
    memcpy(p->rows[p->count++], &hull->tangents[4 * (size_t)h], 4 * sizeof(double));
    for (int k = 0; k < 4; k++) p->rows[p->count][k] = -hull->tangents[4 * (size_t)beyond + (size_t)k];
    p->count++;
    qmat_cross(start_of(hull, h), start_of(hull, next(h)), cross);
    for (int k = 0; k < 3; k++) p->value[k] += cross[k] / 6;
  }
  return true;
}

/* The volume between the origin and a triangle. */
static double cone_volume(const qmat_outer_hull *hull, uint32_t h) {
  double cross[3];
  qmat_cross(start_of(hull, h), start_of(hull, next(h)), cross);
  return qmat_dot(cross, start_of(hull, previous(h))) / 6;
}

/* Forgets the tangent planes through a vertex. */
static void forget(qmat_outer_hull *hull, uint32_t vertex) {
  uint32_t o = hull->leaving[vertex];
  do {
    hull->known[o] = hull->known[hull->twins[o]] = 0;
    o = hull->twins[previous(o)];
  } while (o != hull->leaving[vertex]);
}

/* Moves each vertex by a share of the way to where the volume is least. How much that gains. */
static double sweep(qmat_outer_hull *hull, double step, qmat_status *status) {
  double gain = 0;
  for (uint32_t v = 0; v < hull->point_count; v++) {
    uint32_t ring[MOST_AROUND];
    program p;
    *status = qmat_hull_go_on(hull->context);
    if (*status != QMAT_OK) break;
    if (hull->leaving[v] == none) continue;
    const size_t count = find_ring(hull, v, ring);
    if (count == 0 || !make_program(hull, ring, count, &p)) continue;
    double *point = &hull->points[3 * (size_t)v], place[3] = {0}, best = qmat_dot(p.value, point);
    const double before = best;
    if (!solve(&p, place, &best)) continue;
    for (int k = 0; k < 3; k++) point[k] += step * (place[k] - point[k]);
    forget(hull, v);
    gain += step * (before - best);
  }
  return gain;
}

/* Sets twins and half-edges of vertices. The triangles are closed and oriented. */
static bool connect(qmat_outer_hull *hull, size_t half_edges) {
  memset(hull->leaving, 0xff, hull->point_count * sizeof *hull->leaving);
  memset(hull->known, 0, half_edges * sizeof *hull->known);
  /* Half-edges of a vertex are a list while twins are looked for: each has the next one in `twins`. */
  for (uint32_t h = 0; h < half_edges; h++) {
    hull->twins[h] = hull->leaving[hull->triangles[h]];
    hull->leaving[hull->triangles[h]] = h;
  }
  for (uint32_t h = 0; h < half_edges; h++) {
    uint32_t o = hull->leaving[hull->triangles[next(h)]];
    while (o != none && hull->triangles[next(o)] != hull->triangles[h]) o = hull->twins[o];
    if (o == none) return false;
    hull->scratch[h] = o;
  }
  memcpy(hull->twins, hull->scratch, half_edges * sizeof *hull->twins);
  return true;
}

/* The largest factor by which a facet must move away from the origin so that the cloud is inside of all by `margin`. */
static double find_factor(const qmat_outer_hull *hull, size_t triangles, double margin) {
  double factor = 0;
  for (uint32_t t = 0; t < triangles; t++) {
    double normal[3], reach = 0;
    if (!find_normal(hull, 3 * t, normal)) continue;
    for (size_t i = 0; i < hull->cloud_count; i++) reach = qmat_larger(reach, qmat_dot(normal, &hull->cloud[3 * i]));
    factor = fmax(factor, (reach + margin) / fmax(qmat_dot(normal, start_of(hull, 3 * t)), 0));
  }
  return factor;
}

/* Adds points of the cloud that are far outside of the hull so far. How many. */
static size_t add_points(qmat_outer_hull *hull, size_t triangles, double error) {
  double top = 0;
  for (uint32_t t = 0; t < triangles; t++) {
    double normal[3], u[3], v[3], away = error;
    hull->scores[t] = 0;
    if (!find_normal(hull, 3 * t, normal)) continue;
    const double *corner = start_of(hull, 3 * t), at = qmat_dot(normal, corner);
    for (uint32_t i = 0; i < hull->cloud_count; i++) {
      const double height = qmat_dot(normal, &hull->cloud[3 * (size_t)i]) - at;
      if (!(height > away)) continue;
      away = height;
      hull->farthest[t] = i;
      hull->scores[t] = height;
    }
    qmat_subtract(start_of(hull, 3 * t + 1), corner, u);
    qmat_subtract(start_of(hull, 3 * t + 2), corner, v);
    qmat_cross(u, v, normal);
    hull->scores[t] *= sqrt(qmat_dot(normal, normal));
    top = fmax(top, hull->scores[t]);
  }
  size_t added = 0;
  for (uint32_t t = 0; t < triangles && hull->point_count < hull->most; t++) {
    if (!(hull->scores[t] > 0) || hull->scores[t] < worth * top || hull->chosen[hull->farthest[t]]) continue;
    hull->chosen[hull->farthest[t]] = 1;
    memcpy(&hull->points[3 * hull->point_count++], &hull->cloud[3 * (size_t)hull->farthest[t]],
           3 * sizeof *hull->points);
    added++;
  }
  return added;
}

/* Chooses points of the cloud whose hull is nearly that of all. */
static qmat_status choose(qmat_outer_hull *hull, double error, size_t *triangles) {
  memset(hull->chosen, 0, hull->cloud_count);
  hull->point_count = 0;
  for (size_t d = 0; d < DIRECTIONS; d++) {
    double direction[3], reach = -INFINITY;
    size_t best = 0;
    qmat_spread_direction(d, DIRECTIONS, direction);
    for (size_t i = 0; i < hull->cloud_count; i++) {
      const double height = qmat_dot(direction, &hull->cloud[3 * i]);
      if (!(height > reach)) continue;
      reach = height;
      best = i;
    }
    if (hull->chosen[best]) continue;
    hull->chosen[best] = 1;
    memcpy(&hull->points[3 * hull->point_count++], &hull->cloud[3 * best], 3 * sizeof *hull->points);
  }
  if (hull->point_count < 4) return QMAT_ERROR_GEOMETRY;
  qmat_growing_hull grown = {0};
  qmat_status status;
  do {
    status = qmat_hull_go_on(hull->context);
    if (status == QMAT_OK)
      status = qmat_growing_hull_of(&grown, hull->points, hull->point_count, hull->triangles, triangles);
  } while (status == QMAT_OK && add_points(hull, *triangles, error) > 0);
  qmat_growing_hull_uninit(&grown);
  return status;
}

/* Moves the cloud to the origin and scales it to half a size of 1. */
static bool take_cloud(qmat_outer_hull *hull, const double *points, double centre[3], double *scale) {
  const size_t numbers = 3 * hull->cloud_count;
  *scale = 0;
  for (size_t i = 0; i < numbers; i++) centre[i % 3] += points[i] / (double)hull->cloud_count;
  for (size_t i = 0; i < numbers; i++) *scale = fmax(*scale, fabs(points[i] - centre[i % 3]));
  if (!(*scale > 0)) return false;
  for (size_t i = 0; i < numbers; i++) hull->cloud[i] = (points[i] - centre[i % 3]) / *scale;
  return true;
}

/* Moves the vertices inward, sweep by sweep. */
static qmat_status shrink(qmat_outer_hull *hull, size_t triangles) {
  qmat_status status = QMAT_OK;
  double volume = 0;
  for (uint32_t t = 0; t < triangles; t++) volume += cone_volume(hull, 3 * t);
  for (int i = 0; i < MOST_SWEEPS && status == QMAT_OK; i++)
    if (sweep(hull, i < HALF_SWEEPS ? 0.5 : 1, &status) < least_gain * volume && i >= HALF_SWEEPS) break;
  return status;
}

qmat_status qmat_outer_hull_fit(qmat_outer_hull *hull, const double *points, size_t count, double margin,
                                double error) {
  double centre[3] = {0}, scale;
  size_t triangles;
  hull->cloud_count = count;
  if (count < 4 || count > hull->room || !take_cloud(hull, points, centre, &scale)) return QMAT_ERROR_GEOMETRY;
  qmat_status status = choose(hull, error / scale, &triangles);
  if (status != QMAT_OK) return status;
  if (!connect(hull, 3 * triangles)) return QMAT_ERROR_GEOMETRY;
  const double growth = find_factor(hull, triangles, 0) * (1 + on_plane);
  if (!isfinite(growth)) return QMAT_ERROR_GEOMETRY;
  for (size_t i = 0; i < 3 * hull->point_count; i++) hull->points[i] *= growth;
  status = shrink(hull, triangles);
  if (status == QMAT_OK) status = qmat_convex_hull(hull->points, hull->point_count, hull->triangles, &triangles);
  if (status != QMAT_OK) return status;
  if (!(find_factor(hull, triangles, 0) < 1.001)) return QMAT_ERROR_GEOMETRY;
  const double factor = fmax(find_factor(hull, triangles, margin / scale), 1);
  if (!isfinite(factor)) return QMAT_ERROR_GEOMETRY;
  hull->point_count =
      qmat_hull_vertices_keep(hull->points, hull->point_count, hull->triangles, triangles, hull->chosen);
  for (size_t i = 0; i < 3 * hull->point_count; i++)
    hull->points[i] = centre[i % 3] + factor * (1 + 1e-12) * scale * hull->points[i];
  return QMAT_OK;
}
