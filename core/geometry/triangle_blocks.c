/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/triangle_blocks.h"

#include <embree3/rtcore.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

enum { LANES = 8, GROUP = 8 };

/* Beyond this distance single precision cannot tell the triangles apart. */
static const double far_away = 1e4;

/* Eight triangles in single precision. Each lies in a disc around its centre, or in a ball when its normal is zero. */
typedef struct block {
  float centre[3][LANES], normal[3][LANES], radius[LANES];
  uint32_t triangles[LANES];
} block;

/* The corners of a block's triangles, or of a group's, lie between two planes: low <= normal . corner <= high. They lie
 * in a box, too. */
typedef struct layer {
  double normal[3], low, high; /* a unit normal, or zero */
  double least[3], most[3];
} layer;

struct qmat_triangle_blocks {
  const double *positions;
  const uint32_t *triangles;
  size_t count, block_count, group_count;
  block *blocks;
  layer *layers;               /* per block */
  layer *group_layers;         /* per GROUP blocks: most of a smooth surface needs no closer look */
  RTCScene scene, group_scene; /* of user geometries: the blocks, and the groups */
};

static void corners_of(const qmat_triangle_blocks *blocks, uint32_t triangle, const double *corners[3]) {
  for (size_t i = 0; i < 3; i++)
    corners[i] = blocks->positions + 3 * (size_t)blocks->triangles[3 * (size_t)triangle + i];
}

/* A triangle whose sine at the first corner is below this has no reliable plane: rounding tilts it too much. */
static const double least_sine = 1e-8;

/* Twice the area vector and its squared length; false when the triangle is too thin to define a plane. */
static bool find_normal(const double *const corners[3], double normal[3], double *square) {
  double side[3], other_side[3];
  qmat_subtract(corners[1], corners[0], side);
  qmat_subtract(corners[2], corners[0], other_side);
  qmat_cross(side, other_side, normal);
  *square = qmat_dot(normal, normal);
  return *square > least_sine * least_sine * qmat_dot(side, side) * qmat_dot(other_side, other_side);
}

/* --- one triangle ----------------------------------------------------------------------------------------------- */

static void closest_on_segment(const double a[3], const double b[3], const double point[3], double closest[3]) {
  const double t = qmat_closest_on_segment(point, a, b);
  for (int i = 0; i < 3; i++) closest[i] = t == 1 ? b[i] : a[i] + t * (b[i] - a[i]);
}

/* A squared distance that exceeds another by this factor is larger in spite of rounding. */
static const double surely_farther = 1 + 1e-9;

/* The squared distance to a triangle: to its plane when the foot is inside, else to the edges that face the point.
 * INFINITY when the plane is farther away than the squared distance `enough`. */
static double closest_on_triangle(const qmat_triangle_blocks *blocks, uint32_t triangle, const double point[3],
                                  double enough, double closest[3]) {
  const uint32_t *ids = blocks->triangles + 3 * (size_t)triangle;
  const double *corners[3];
  corners_of(blocks, triangle, corners);
  double normal[3], square, from_corner[3];
  const bool has_plane = find_normal(corners, normal, &square);
  qmat_subtract(point, corners[0], from_corner);
  const double height = qmat_dot(from_corner, normal);
  if (has_plane && height * height > surely_farther * enough * square) return INFINITY;

  double nearest = INFINITY;
  bool facing = false;
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3;
    double edge[3], to_point[3], outward[3];
    qmat_subtract(corners[j], corners[i], edge);
    qmat_subtract(point, corners[i], to_point);
    qmat_cross(edge, normal, outward);
    if (has_plane && qmat_dot(outward, to_point) <= 0) continue;
    facing = true;
    /* Both triangles of an edge use the same order of its ends, so both compute the same bits. */
    const bool rising = ids[i] < ids[j];
    double candidate[3], offset[3];
    closest_on_segment(corners[rising ? i : j], corners[rising ? j : i], point, candidate);
    qmat_subtract(point, candidate, offset);
    const double distance = qmat_dot(offset, offset);
    if (distance < nearest) {
      nearest = distance;
      memcpy(closest, candidate, sizeof candidate);
    }
  }
  if (facing) return nearest;
  for (int i = 0; i < 3; i++) closest[i] = point[i] - height / square * normal[i];
  return height / square * height;
}

double qmat_triangle_blocks_distance_to(const qmat_triangle_blocks *blocks, uint32_t triangle, const double point[3]) {
  double closest[3];
  return sqrt(closest_on_triangle(blocks, triangle, point, INFINITY, closest));
}

/* --- the nearest ------------------------------------------------------------------------------------------------ */

typedef struct nearest_query {
  const qmat_triangle_blocks *blocks;
  const double *point;
  double slack;         /* rounding error of the point and the triangles in single precision */
  double square, reach; /* squared distance and distance of the nearest triangle so far */
  float square_limit;   /* a disc with a larger squared bound is farther away */
  double closest[3];
  uint32_t triangle;
} nearest_query;

/* A triangle whose squared bound in single precision is at most this needs an exact test. */
static float square_limit(const nearest_query *query) {
  const double limit = (query->reach + 2 * query->slack) * (1 + 1e-6);
  return (float)(limit * limit);
}

/* Tests one triangle exactly; true when it is the nearest so far. */
static bool try_triangle(nearest_query *query, uint32_t triangle) {
  double closest[3];
  const double square = closest_on_triangle(query->blocks, triangle, query->point, query->square, closest);
  if (!(square < query->square || (square == query->square && triangle < query->triangle))) return false;
  query->square = square;
  query->reach = sqrt(square);
  query->square_limit = square_limit(query);
  query->triangle = triangle;
  memcpy(query->closest, closest, sizeof closest);
  return true;
}

static float search_radius(const nearest_query *query, double distance) {
  return nextafterf((float)(distance * (1 + 1e-6) + query->slack), INFINITY);
}

/* The relative rounding error of a squared distance to a disc's centre: a few dozen roundings of 6e-8. */
static const float rounding_share = 2e-6f;

/* A lower bound of the squared distance to each triangle of a block. */
static void bound_block(const block *b, float x, float y, float z, float bounds[LANES]) {
  for (int k = 0; k < LANES; k++) {
    const float dx = x - b->centre[0][k], dy = y - b->centre[1][k], dz = z - b->centre[2][k];
    const float square = dx * dx + dy * dy + dz * dz, error = rounding_share * square;
    const float height = dx * b->normal[0][k] + dy * b->normal[1][k] + dz * b->normal[2][k];
    const float across_square = square - height * height - error;
    const float across = sqrtf(across_square > 0 ? across_square : 0) - b->radius[k];
    const float beside = across > 0 ? across : 0;
    bounds[k] = beside * beside + height * height - error;
  }
}

static bool visit_block(struct RTCPointQueryFunctionArguments *args) {
  nearest_query *query = args->userPtr;
  const block *b = &query->blocks->blocks[args->primID];
  const size_t left = query->blocks->count - LANES * (size_t)args->primID, count = left < LANES ? left : LANES;
  float bounds[LANES];
  bound_block(b, args->query->x, args->query->y, args->query->z, bounds);
  size_t first = 0; /* likely the nearest; trying it first rules out most of the others */
  for (size_t k = 1; k < count; k++)
    if (bounds[k] < bounds[first]) first = k;
  if (bounds[first] > query->square_limit) return false;
  bool nearer = try_triangle(query, b->triangles[first]);
  for (size_t k = 0; k < count; k++)
    if (k != first && !(bounds[k] > query->square_limit)) nearer |= try_triangle(query, b->triangles[k]);
  if (!nearer) return false;
  const float radius = search_radius(query, query->reach);
  if (!(radius < args->query->radius)) return false;
  args->query->radius = radius;
  return true;
}

double qmat_triangle_blocks_distance(const qmat_triangle_blocks *blocks, const double point[3], double limit,
                                     double *closest, uint32_t *triangle) {
  const double size = fmax(fmax(fabs(point[0]), fabs(point[1])), fabs(point[2]));
  nearest_query query = {.blocks = blocks,
                         .point = point,
                         .slack = 4 * (double)FLT_EPSILON * (1 + size),
                         .square = surely_farther * limit * limit,
                         .reach = surely_farther * limit,
                         .triangle = UINT32_MAX};
  query.square_limit = square_limit(&query);
  if (size < far_away) {
    struct RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    struct RTCPointQuery ball = {.x = (float)point[0],
                                 .y = (float)point[1],
                                 .z = (float)point[2],
                                 .time = 0,
                                 .radius = limit < 4 * far_away ? search_radius(&query, limit) : INFINITY};
    rtcPointQuery(blocks->scene, &ball, &context, visit_block, &query);
  } else {
    for (size_t i = 0; i < blocks->count; i++) try_triangle(&query, (uint32_t)i);
  }
  const double distance = sqrt(query.square);
  if (query.triangle == UINT32_MAX || !(distance <= limit)) return INFINITY;
  if (closest) memcpy(closest, query.closest, sizeof query.closest);
  if (triangle) *triangle = query.triangle;
  return distance;
}

/* --- radius less distance over a simplex -------------------------------------------------------------------------- */

/* More blocks around a piece than this are not worth a bound. */
enum { MOST_BLOCKS = 2048 };

typedef struct excess_query {
  const qmat_triangle_blocks *blocks;
  const double *const *spheres;
  int count;
  double centre[3], reach; /* triangles beyond `reach` cannot exceed the lowest bound */
  double bound, limit;
  size_t visited;
  uint32_t failed; /* the place in the blocks of the triangle that exceeded the limit, or UINT32_MAX */
} excess_query;

/* The largest r - s over the piece, where s is the signed distance to the plane through `on` with a unit normal. */
static double bound_by_plane(const excess_query *query, const double on[3], const double normal[3]) {
  double bound = -INFINITY;
  for (int i = 0; i < query->count; i++) {
    double offset[3];
    qmat_subtract(query->spheres[i], on, offset);
    bound = qmat_larger(bound, query->spheres[i][3] - qmat_dot(offset, normal));
  }
  return bound;
}

/* The same for the planes that bound a layer, on the side of the piece. */
static double bound_by_layer(const excess_query *query, const layer *layer) {
  double above = -INFINITY, below = -INFINITY;
  for (int i = 0; i < query->count; i++) {
    const double height = qmat_dot(query->spheres[i], layer->normal), r = query->spheres[i][3];
    above = qmat_larger(above, r - (height - layer->high));
    below = qmat_larger(below, r - (layer->low - height));
  }
  return qmat_smaller(above, below);
}

/* A triangle is convex: it lies beyond the plane through its point closest to the centre, across their line, and on
 * its own plane. The better of both counts. */
static double bound_by_triangle(const excess_query *query, uint32_t triangle) {
  const double *corners[3];
  double closest[3], normal[3], square;
  const double distance = sqrt(closest_on_triangle(query->blocks, triangle, query->centre, INFINITY, closest));
  if (distance > query->reach) return -INFINITY;
  if (!(distance > 0)) return INFINITY;
  double across[3];
  qmat_subtract(query->centre, closest, across);
  for (int k = 0; k < 3; k++) across[k] /= distance;
  const double bound = bound_by_plane(query, closest, across);
  corners_of(query->blocks, triangle, corners);
  if (!find_normal(corners, normal, &square)) return bound;
  const double scale = (qmat_dot(normal, across) < 0 ? -1 : 1) / sqrt(square);
  for (int k = 0; k < 3; k++) normal[k] *= scale;
  return qmat_smaller(bound, bound_by_plane(query, corners[0], normal));
}

static bool is_within_reach(const excess_query *query, const layer *layer) {
  double square = 0;
  for (int k = 0; k < 3; k++) {
    const double beside = qmat_larger(layer->least[k] - query->centre[k], query->centre[k] - layer->most[k]);
    if (beside > 0) square += beside * beside;
  }
  return square <= query->reach * query->reach;
}

static double bound_by_block(excess_query *query, size_t number) {
  const qmat_triangle_blocks *blocks = query->blocks;
  const size_t left = blocks->count - LANES * number;
  double bound = bound_by_layer(query, &blocks->layers[number]);
  if (!(bound > query->limit)) return bound;
  bound = -INFINITY;
  for (size_t k = 0; k < left && k < LANES; k++) {
    bound = qmat_larger(bound, bound_by_triangle(query, blocks->blocks[number].triangles[k]));
    if (!(bound > query->limit)) continue;
    query->failed = (uint32_t)(LANES * number + k);
    break;
  }
  return bound;
}

static bool bound_group_excess(struct RTCPointQueryFunctionArguments *args) {
  excess_query *query = args->userPtr;
  const qmat_triangle_blocks *blocks = query->blocks;
  const size_t first = GROUP * (size_t)args->primID;
  double bound = bound_by_layer(query, &blocks->group_layers[args->primID]);
  query->visited++;
  if (bound > query->limit) {
    bound = -INFINITY;
    for (size_t b = first; b < first + GROUP && b < blocks->block_count && bound <= query->limit; b++) {
      if (!is_within_reach(query, &blocks->layers[b])) continue;
      query->visited++;
      bound = qmat_larger(bound, bound_by_block(query, b));
    }
  }
  query->bound = qmat_larger(query->bound, query->visited > MOST_BLOCKS ? INFINITY : bound);
  if (query->bound <= query->limit) return false;
  args->query->radius = 0; /* no bound: ends the search */
  return true;
}

double qmat_triangle_blocks_excess(const qmat_triangle_blocks *blocks, const double *const spheres[], int count,
                                   double lowest, double limit, uint32_t *failed) {
  excess_query query = {
      .blocks = blocks, .spheres = spheres, .count = count, .bound = lowest, .limit = limit, .failed = UINT32_MAX};
  for (int i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) query.centre[k] += spheres[i][k] / count;
  for (int i = 0; i < count; i++)
    query.reach = fmax(query.reach, qmat_point_distance(spheres[i], query.centre) + spheres[i][3] - lowest);
  if (!(query.reach > 0)) return lowest;
  if (*failed != UINT32_MAX && bound_by_layer(&query, &blocks->group_layers[*failed / (LANES * GROUP)]) > limit &&
      bound_by_layer(&query, &blocks->layers[*failed / LANES]) > limit &&
      bound_by_triangle(&query, blocks->blocks[*failed / LANES].triangles[*failed % LANES]) > limit)
    return INFINITY;
  struct RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  struct RTCPointQuery ball = {
      .x = (float)query.centre[0],
      .y = (float)query.centre[1],
      .z = (float)query.centre[2],
      .radius = nextafterf((float)(query.reach * (1 + 1e-6) + 8 * (double)FLT_EPSILON), INFINITY)};
  rtcPointQuery(blocks->group_scene, &ball, &context, bound_group_excess, &query);
  if (query.failed != UINT32_MAX) *failed = query.failed;
  return query.bound <= limit ? query.bound : INFINITY;
}

/* --- building --------------------------------------------------------------------------------------------------- */

static double farthest_corner(const double *const corners[3], const double centre[3]) {
  double square = 0;
  for (int i = 0; i < 3; i++) {
    double offset[3];
    qmat_subtract(corners[i], centre, offset);
    square = qmat_larger(square, qmat_dot(offset, offset));
  }
  return sqrt(square);
}

static void centroid(const double *const corners[3], double centre[3]) {
  for (int k = 0; k < 3; k++) centre[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
}

/* Sets the disc around a triangle. Its radius is measured from the rounded centre. Rounding the normal moves the
 * corners by less than the slack of a query. */
static void fill_lane(const qmat_triangle_blocks *blocks, block *b, size_t lane, uint32_t triangle) {
  const double *corners[3];
  double centre[3], normal[3], square;
  corners_of(blocks, triangle, corners);
  centroid(corners, centre);
  const bool has_plane = find_normal(corners, normal, &square);
  for (int k = 0; k < 3; k++) {
    b->centre[k][lane] = (float)centre[k];
    b->normal[k][lane] = has_plane ? (float)(normal[k] / sqrt(square)) : 0;
    centre[k] = (double)b->centre[k][lane];
  }
  b->radius[lane] = nextafterf((float)farthest_corner(corners, centre), INFINITY);
  b->triangles[lane] = triangle;
}

/* Sets the planes around `count` triangles of blocks, from the one at `first`, across their mean normal, and their box.
 */
static void fill_layer(const qmat_triangle_blocks *blocks, size_t first, size_t count, layer *layer) {
  *layer = (struct layer){.low = INFINITY,
                          .high = -INFINITY,
                          .least = {INFINITY, INFINITY, INFINITY},
                          .most = {-INFINITY, -INFINITY, -INFINITY}};
  if (count > blocks->count - first) count = blocks->count - first;
  const double *corners[3];
  for (size_t t = first; t < first + count; t++) {
    double normal[3], square;
    corners_of(blocks, blocks->blocks[t / LANES].triangles[t % LANES], corners);
    find_normal(corners, normal, &square);
    for (int k = 0; k < 3; k++) layer->normal[k] += normal[k];
  }
  const double length = sqrt(qmat_dot(layer->normal, layer->normal));
  for (int k = 0; k < 3; k++) layer->normal[k] = length > 0 ? layer->normal[k] / length : 0;
  for (size_t t = first; t < first + count; t++) {
    corners_of(blocks, blocks->blocks[t / LANES].triangles[t % LANES], corners);
    for (int i = 0; i < 3; i++) {
      const double height = qmat_dot(corners[i], layer->normal);
      layer->low = qmat_smaller(layer->low, height);
      layer->high = qmat_larger(layer->high, height);
      for (int k = 0; k < 3; k++) {
        layer->least[k] = qmat_smaller(layer->least[k], corners[i][k]);
        layer->most[k] = qmat_larger(layer->most[k], corners[i][k]);
      }
    }
  }
}

/* A box, rounded outwards. */
static void bound_for_embree(const struct RTCBoundsFunctionArguments *args) {
  const layer *layers = args->geometryUserPtr, *own = &layers[args->primID];
  args->bounds_o->lower_x = nextafterf((float)own->least[0], -INFINITY);
  args->bounds_o->lower_y = nextafterf((float)own->least[1], -INFINITY);
  args->bounds_o->lower_z = nextafterf((float)own->least[2], -INFINITY);
  args->bounds_o->upper_x = nextafterf((float)own->most[0], INFINITY);
  args->bounds_o->upper_y = nextafterf((float)own->most[1], INFINITY);
  args->bounds_o->upper_z = nextafterf((float)own->most[2], INFINITY);
}

/* The boxes of `count` layers. Reports no failure: it is in the device's error state. */
static RTCScene build_scene(RTCDevice device, layer *layers, size_t count) {
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  if (scene && geometry) {
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    rtcSetGeometryUserPrimitiveCount(geometry, (unsigned)count);
    rtcSetGeometryUserData(geometry, layers);
    rtcSetGeometryBoundsFunction(geometry, bound_for_embree, NULL);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);
  }
  if (geometry) rtcReleaseGeometry(geometry);
  return scene;
}

/* A triangle that is to be assigned to a block. */
typedef struct item {
  double centre[3];
  uint32_t triangle;
} item;

static bool comes_first(const item *a, const item *b, int axis) {
  return a->centre[axis] != b->centre[axis] ? a->centre[axis] < b->centre[axis] : a->triangle < b->triangle;
}

static void swap_items(item *a, item *b) {
  const item swap = *a;
  *a = *b;
  *b = swap;
}

/* Moves the `few` smallest items along the axis to the front (Hoare's selection). */
static void select_first(item *items, size_t count, size_t few, int axis) {
  size_t low = 0, high = count; /* the boundary is in between */
  while (high - low > 1) {
    const item *a = &items[low], *b = &items[low + (high - low) / 2], *c = &items[high - 1];
    const bool a_b = comes_first(a, b, axis), b_c = comes_first(b, c, axis), a_c = comes_first(a, c, axis);
    const item pivot = a_b == b_c ? *b : a_b == a_c ? *c : *a;
    size_t i = low, j = high - 1;
    for (;;) {
      while (comes_first(&items[i], &pivot, axis)) i++;
      while (comes_first(&pivot, &items[j], axis)) j--;
      if (i >= j) break;
      swap_items(&items[i++], &items[j--]);
    }
    if (few <= i)
      high = i;
    else
      low = i;
    if (few == low || few == high) return;
  }
}

static int widest_axis(const item *items, size_t count) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) {
      low[k] = qmat_smaller(low[k], items[i].centre[k]);
      high[k] = qmat_larger(high[k], items[i].centre[k]);
    }
  int axis = 0;
  for (int k = 1; k < 3; k++)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  return axis;
}

/* Larger halves are divided in a task of their own. */
enum { WORTH_A_THREAD = 1 << 13 };

/* Splits the items in half along their widest axis, at a multiple of the size of a group or block, until each block has
 * its items. */
static void divide(item *items, size_t count) {
  if (count <= LANES) return;
  const size_t unit = count > LANES * GROUP ? LANES * GROUP : LANES, few = unit * (((count + unit - 1) / unit) / 2);
  select_first(items, count, few, widest_axis(items, count));
#pragma omp task if (few > WORTH_A_THREAD)
  divide(items, few);
  divide(items + few, count - few);
}

static qmat_status fill_blocks(qmat_context *context, qmat_triangle_blocks *blocks) {
  const size_t count = blocks->count;
  item *items = qmat_alloc(count, sizeof *items);
  blocks->blocks = qmat_calloc(blocks->block_count, sizeof *blocks->blocks);
  blocks->layers = qmat_calloc(blocks->block_count, sizeof *blocks->layers);
  blocks->group_layers = qmat_calloc(blocks->group_count, sizeof *blocks->group_layers);
  const bool made = items && blocks->blocks && blocks->layers && blocks->group_layers;
  if (made) {
    const int threads = qmat_threads(context);
#pragma omp parallel num_threads(threads)
    {
#pragma omp for schedule(static)
      for (size_t t = 0; t < count; t++) {
        const double *corners[3];
        corners_of(blocks, (uint32_t)t, corners);
        centroid(corners, items[t].centre);
        items[t].triangle = (uint32_t)t;
      }
#pragma omp single
      divide(items, count);
#pragma omp for schedule(static)
      for (size_t t = 0; t < count; t++) fill_lane(blocks, &blocks->blocks[t / LANES], t % LANES, items[t].triangle);
#pragma omp for schedule(static)
      for (size_t b = 0; b < blocks->block_count; b++) fill_layer(blocks, LANES * b, LANES, &blocks->layers[b]);
#pragma omp for schedule(static)
      for (size_t g = 0; g < blocks->group_count; g++)
        fill_layer(blocks, LANES * GROUP * g, LANES * GROUP, &blocks->group_layers[g]);
    }
  }
  qmat_free(items);
  return made ? QMAT_OK : qmat_fail_memory(context, "the triangles");
}

qmat_status qmat_triangle_blocks_new(qmat_context *context, struct RTCDeviceTy *device, const double *positions,
                                     const uint32_t *triangles, size_t count, qmat_triangle_blocks **blocks) {
  qmat_triangle_blocks *made = qmat_calloc(1, sizeof *made);
  *blocks = made;
  if (!made) return qmat_fail_memory(context, "the triangles");
  *made = (qmat_triangle_blocks){.positions = positions,
                                 .triangles = triangles,
                                 .count = count,
                                 .block_count = (count + LANES - 1) / LANES,
                                 .group_count = (count + LANES * GROUP - 1) / (LANES * GROUP)};
  const qmat_status status = fill_blocks(context, made);
  if (status == QMAT_OK) {
    made->scene = build_scene(device, made->layers, made->block_count);
    made->group_scene = build_scene(device, made->group_layers, made->group_count);
  }
  return status;
}

void qmat_triangle_blocks_free(qmat_triangle_blocks *blocks) {
  if (!blocks) return;
  if (blocks->scene) rtcReleaseScene(blocks->scene);
  if (blocks->group_scene) rtcReleaseScene(blocks->group_scene);
  qmat_free(blocks->blocks);
  qmat_free(blocks->layers);
  qmat_free(blocks->group_layers);
  qmat_free(blocks);
}
