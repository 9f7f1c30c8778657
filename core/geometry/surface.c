/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/surface.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/morton.h"
#include "core/geometry/sheets.h"
#include "core/geometry/triangle.h"
#include "core/geometry/triangle_blocks.h"
#include "core/geometry/vector.h"
#include "core/geometry/winding_tree.h"

/* Embree computes in single precision. In the unit frame coordinates are at most 1/2 and rays about 2 long, so its hits
 * are within a few 1e-7 of the triangle's plane. TIE is well above that. */
#define TIE 4e-6
/* The largest distance along the ray between a hit in double and the same hit in single precision. */
#define LONGEST_CORRECTION 1e-4
/* A crossing whose barycentric coordinate or cosine is below this may have hit an edge. */
#define GRAZING 1e-4f
#define RAY_COUNT 7

struct qmat_surface {
  qmat_kept kept; /* with the mesh */
  atomic_uint references;
  const qmat_mesh *mesh;
  qmat_mesh solids;   /* the mesh without its sheets; `mesh` may point to it */
  size_t solid_count; /* triangles that bound solids */
  qmat_frame frame;
  double *positions;
  double low[3], high[3]; /* of the solids */
  RTCDevice device;
  RTCScene scene;
  qmat_triangle_blocks *blocks;       /* for distances to solids; NULL: the mesh has sheets only */
  qmat_triangle_blocks *sheet_blocks; /* NULL: the mesh has no sheets */
  double half_thickness;              /* of sheets */
  qmat_winding_tree *winding;         /* of solids that are not closed and oriented; else NULL */
};

typedef enum query_kind { COUNT_CROSSINGS, NEAREST_HIT } query_kind;

/* Passed through Embree to the filter function. */
typedef struct query_context {
  struct RTCIntersectContext base;
  query_kind kind;
  int winding; /* COUNT_CROSSINGS: +1 for each triangle left through its back, -1 for each entered through its front */
  bool grazing;
  const double *origin, *direction; /* NEAREST_HIT, in double */
  double offset, start;             /* start of the single precision ray along the ray; hits must be beyond `start` */
  double distance;                  /* of the nearest hit so far */
  uint32_t triangle;
} query_context;

typedef struct device_message {
  char text[256];
} device_message;

static const double *corner_position(const qmat_surface *surface, uint32_t triangle, int corner) {
  return surface->positions + 3 * (size_t)surface->mesh->triangles[3 * (size_t)triangle + (size_t)corner];
}

/* Twice the area vector. */
static void triangle_normal(const qmat_surface *surface, uint32_t triangle, double normal[3]) {
  qmat_triangle_normal(corner_position(surface, triangle, 0), corner_position(surface, triangle, 1),
                       corner_position(surface, triangle, 2), normal);
}

/* --- rays ------------------------------------------------------------------------------------------------------- */

/* The distance at which the ray meets the triangle's plane, in double precision. Where the ray is nearly parallel to
 * the plane that distance is meaningless, and the single precision one is kept. */
static double refine_hit(const qmat_surface *surface, const query_context *query, uint32_t triangle, double found) {
  double normal[3], to_plane[3];
  triangle_normal(surface, triangle, normal);
  qmat_subtract(corner_position(surface, triangle, 0), query->origin, to_plane);
  const double slope = qmat_dot(query->direction, normal);
  const double distance = qmat_dot(to_plane, normal) / slope, correction = fabs(distance - found);
  const bool meets_plane = correction * fabs(slope) <= TIE * sqrt(qmat_dot(normal, normal));
  return meets_plane && correction <= LONGEST_CORRECTION ? distance : found;
}

/* Records every hit of an occlusion ray and rejects it, so that Embree reports all of them. The set of hits does not
 * depend on the layout of Embree's tree; only their order does. Rays are single, so N is 1. */
static void record_hit(const struct RTCFilterFunctionNArguments *args) {
  const qmat_surface *surface = args->geometryUserPtr;
  query_context *query = (query_context *)(void *)args->context;
  const struct RTCRay *ray = (const struct RTCRay *)(const void *)args->ray;
  const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
  args->valid[0] = 0;
  if (query->kind == NEAREST_HIT) {
    const uint32_t triangle = hit->primID;
    const double found = query->offset + (double)ray->tfar;
    if (found > query->distance + LONGEST_CORRECTION) return;
    const double distance = refine_hit(surface, query, triangle, found);
    if (distance > query->start &&
        (distance < query->distance || (distance == query->distance && triangle < query->triangle))) {
      query->distance = distance;
      query->triangle = triangle;
    }
    return;
  }
  const float side = hit->Ng_x * ray->dir_x + hit->Ng_y * ray->dir_y + hit->Ng_z * ray->dir_z;
  const float square = hit->Ng_x * hit->Ng_x + hit->Ng_y * hit->Ng_y + hit->Ng_z * hit->Ng_z;
  query->winding += (side > 0) - (side < 0);
  query->grazing |= fminf(fminf(hit->u, hit->v), 1 - hit->u - hit->v) < GRAZING;
  query->grazing |= side * side <= GRAZING * GRAZING * square;
}

static void set_ray(struct RTCRay *ray, const double origin[3], const double direction[3], double offset, float near,
                    float far) {
  ray->org_x = (float)(origin[0] + offset * direction[0]);
  ray->org_y = (float)(origin[1] + offset * direction[1]);
  ray->org_z = (float)(origin[2] + offset * direction[2]);
  ray->tnear = near;
  ray->dir_x = (float)direction[0];
  ray->dir_y = (float)direction[1];
  ray->dir_z = (float)direction[2];
  ray->time = 0;
  ray->tfar = far;
  ray->mask = (unsigned)-1;
  ray->id = 0;
  ray->flags = 0;
}

bool qmat_surface_cast(const qmat_surface *surface, const double origin[3], const double direction[3], double start,
                       double end, double *distance, uint32_t *triangle, double *normal) {
  query_context query;
  rtcInitIntersectContext(&query.base);
  query.kind = NEAREST_HIT;
  query.origin = origin;
  query.direction = direction;
  query.start = start;

  /* The single precision ray starts just before `start`, and never far from the unit ball around the model. */
  const double foot = -qmat_dot(origin, direction);
  query.offset = start - TIE;
  if (foot - 1 > query.offset) query.offset = foot - 1;
  if (!(foot + 1 > query.offset)) return false;
  const double length = end - query.offset + 2 * LONGEST_CORRECTION; /* beyond what rounding can hide */
  if (!(length > 0)) return false;

  /* One query that visits all hits is faster than one for the nearest hit and another for its ties. */
  struct RTCRay ray;
  query.distance = INFINITY;
  query.triangle = UINT32_MAX;
  set_ray(&ray, origin, direction, query.offset, 0, (float)length);
  rtcOccluded1(surface->scene, &query.base, &ray);
  if (query.triangle == UINT32_MAX || query.distance > end) return false;
  if (distance) *distance = query.distance;
  if (triangle) *triangle = query.triangle;
  if (normal) {
    triangle_normal(surface, query.triangle, normal);
    const double twice_area = sqrt(qmat_dot(normal, normal));
    for (int i = 0; i < 3; i++) normal[i] = twice_area > 0 ? normal[i] / twice_area : 0;
  }
  return true;
}

/* --- inside ----------------------------------------------------------------------------------------------------- */

/* In exact arithmetic, a ray that hits no edge counts how often a closed oriented surface winds around its origin. The
 * directions are in general position. Those near the axes come first: most models are axis-aligned, so these rays are
 * short. */
static const double ray_directions[RAY_COUNT][3] = {
    {0.98632441, 0.13298071, 0.09771263},  {-0.11407731, 0.98765432, 0.10754219}, {0.09135721, -0.12643157, 0.98776113},
    {0.57391847, 0.61173295, 0.54451219},  {-0.60357124, 0.52117943, 0.60331877}, {0.55127391, -0.58719213, 0.59270351},
    {0.62183517, 0.53172941, -0.57497823},
};

static bool inside_by_rays(const qmat_surface *surface, const double point[3]) {
  int score = 0;
  for (int i = 0; i < RAY_COUNT && abs(score) < 4; i++) {
    /* Rays point away from the centre, where they cross less of the model. */
    const double sign = qmat_dot(point, ray_directions[i]) < 0 ? -1 : 1;
    const double direction[3] = {sign * ray_directions[i][0], sign * ray_directions[i][1], sign * ray_directions[i][2]};
    query_context query;
    rtcInitIntersectContext(&query.base);
    query.kind = COUNT_CROSSINGS;
    query.winding = 0;
    query.grazing = false;
    struct RTCRay ray;
    set_ray(&ray, point, direction, 0, 0, INFINITY);
    rtcOccluded1(surface->scene, &query.base, &ray);
    const int weight = query.grazing ? 1 : 2;
    score += query.winding > 0 ? weight : -weight;
  }
  return score > 0;
}

bool qmat_surface_inside(const qmat_surface *surface, const double point[3]) {
  for (int axis = 0; axis < 3; axis++) {
    if (!(point[axis] >= surface->low[axis] && point[axis] <= surface->high[axis])) return false;
  }
  return surface->winding ? qmat_winding_tree_number(surface->winding, point) > 0.5 : inside_by_rays(surface, point);
}

void qmat_surface_inside_many(const qmat_surface *surface, const double *points, size_t count, uint8_t *inside,
                              int threads) {
#pragma omp parallel for schedule(dynamic, 256) num_threads(threads)
  for (size_t i = 0; i < count; i++) inside[i] = qmat_surface_inside(surface, points + 3 * i);
}

/* --- distance --------------------------------------------------------------------------------------------------- */

static double solid_distance(const qmat_surface *surface, const double point[3], double limit, double *closest,
                             uint32_t *triangle) {
  return surface->blocks ? qmat_triangle_blocks_distance(surface->blocks, point, limit, closest, triangle) : INFINITY;
}

double qmat_surface_distance(const qmat_surface *surface, const double point[3], double limit, double *closest,
                             uint32_t *triangle) {
  const double solid = solid_distance(surface, point, limit, closest, triangle);
  if (!surface->sheet_blocks) return solid;
  double place[3];
  uint32_t id;
  const double reach = fmin(limit, solid) + surface->half_thickness;
  const double sheet =
      fabs(qmat_triangle_blocks_distance(surface->sheet_blocks, point, reach, place, &id) - surface->half_thickness);
  if (!(sheet < solid && sheet <= limit)) return solid;
  if (closest) memcpy(closest, place, sizeof place);
  if (triangle) *triangle = (uint32_t)surface->solid_count + id;
  return sheet;
}

double qmat_surface_signed_distance_within(const qmat_surface *surface, const double point[3], double limit) {
  double distance = solid_distance(surface, point, limit, NULL, NULL);
  if (isinf(distance) && !surface->sheet_blocks) return distance; /* whatever its side */
  if (qmat_surface_inside(surface, point)) distance = -distance;
  const double reach = fmin(limit, distance) + surface->half_thickness;
  if (!surface->sheet_blocks || !(reach >= 0)) return distance;
  return fmin(distance,
              qmat_triangle_blocks_distance(surface->sheet_blocks, point, reach, NULL, NULL) - surface->half_thickness);
}

double qmat_surface_distance_to_triangle(const qmat_surface *surface, const double point[3], uint32_t triangle) {
  if (triangle < surface->solid_count) return qmat_triangle_blocks_distance_to(surface->blocks, triangle, point);
  const double distance =
      qmat_triangle_blocks_distance_to(surface->sheet_blocks, triangle - (uint32_t)surface->solid_count, point);
  return fmax(distance - surface->half_thickness, surface->half_thickness);
}

double qmat_surface_signed_distance(const qmat_surface *surface, const double point[3]) {
  return qmat_surface_signed_distance_within(surface, point, INFINITY);
}

bool qmat_surface_is_closed(const qmat_surface *surface) {
  return !surface->winding;
}

double qmat_surface_signed_distance_near(const qmat_surface *surface, const double point[3], double near, double gap) {
  const double limit = fabs(near) + gap;
  double distance;
  if (!qmat_surface_is_closed(surface))
    distance = qmat_surface_signed_distance_within(surface, point, limit);
  else if (near > gap)
    distance = qmat_surface_distance(surface, point, limit, NULL, NULL);
  else if (near < -gap && (!surface->sheet_blocks || surface->half_thickness == 0))
    distance = -solid_distance(surface, point, limit, NULL, NULL);
  else
    distance = qmat_surface_signed_distance_within(surface, point, limit);
  return isfinite(distance) ? distance : qmat_surface_signed_distance(surface, point);
}

double qmat_surface_depth_up_to(const qmat_surface *surface, const double point[3], double limit) {
  if (!surface->sheet_blocks || surface->half_thickness == 0) return solid_distance(surface, point, limit, NULL, NULL);
  const double depth = -qmat_surface_signed_distance(surface, point);
  return depth <= limit ? depth : INFINITY;
}

bool qmat_surface_is_watertight(const qmat_surface *surface) {
  return surface->blocks && qmat_surface_is_closed(surface) && qmat_surface_half_thickness(surface) == 0;
}

/* The excess over the triangle of a sheet that is nearest to the centre: convex, so largest at a corner. */
static double excess_of_sheet(const qmat_surface *surface, const double *const spheres[], int count,
                              const double centre[3]) {
  double place[3], excess = -INFINITY;
  uint32_t id;
  if (isinf(qmat_triangle_blocks_distance(surface->sheet_blocks, centre, surface->half_thickness, place, &id)))
    return INFINITY;
  for (int i = 0; i < count; i++)
    excess = fmax(excess, spheres[i][3] + qmat_triangle_blocks_distance_to(surface->sheet_blocks, id, spheres[i]) -
                              surface->half_thickness);
  return excess;
}

/* Bounds of the excess are at most this share of a radius, and at least so large: far more than rounding. */
static const double below_radius = 0.99, least_excess = 1e-6;

double qmat_surface_excess_bound(const qmat_surface *surface, const double *const spheres[], int count, double lowest,
                                 double limit, uint32_t *failed) {
  if (qmat_surface_half_thickness(surface) > 0) {
    double centre[3] = {0, 0, 0};
    for (int i = 0; i < count; i++)
      for (int k = 0; k < 3; k++) centre[k] += spheres[i][k] / count;
    const double excess = excess_of_sheet(surface, spheres, count, centre);
    if (excess <= limit) return fmax(excess, lowest);
    if (!qmat_surface_inside(surface, centre)) return INFINITY;
  }
  if (!surface->blocks || surface->winding) return INFINITY;
  /* A bound below every radius keeps the distance positive, so that no point of the simplex is outside. */
  for (int i = 0; i < count; i++) limit = fmin(limit, below_radius * spheres[i][3]);
  if (!(limit > least_excess)) return INFINITY;
  const double least = fmin(lowest, limit / 2);
  return fmax(lowest, qmat_triangle_blocks_excess(surface->blocks, spheres, count, least, limit, failed));
}

/* --- building --------------------------------------------------------------------------------------------------- */

static void keep_message(void *user, enum RTCError code, const char *text) {
  (void)code;
  device_message *message = user;
  if (message->text[0] == '\0') snprintf(message->text, sizeof message->text, "%s", text != NULL ? text : "");
}

/* Converts Embree's newest error to a status. */
static qmat_status embree_status(qmat_context *context, RTCDevice device, const device_message *message) {
  const enum RTCError code = rtcGetDeviceError(device);
  if (code == RTC_ERROR_NONE) return QMAT_OK;
  if (code == RTC_ERROR_OUT_OF_MEMORY) return qmat_fail_memory(context, "Embree's search tree");
  return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "Embree failed (error %d): %s", (int)code, message->text);
}

static qmat_status build_scene(qmat_context *context, qmat_surface *surface) {
  const qmat_mesh *mesh = surface->mesh;
  device_message message = {""};
  RTCGeometry geometry = NULL;
  /* The user's Embree configuration files must not change results. */
  char config[64];
  snprintf(config, sizeof config, "ignore_config_files=1,threads=%d", qmat_threads(context));
  surface->device = rtcNewDevice(config);
  if (!surface->device)
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "Embree cannot start (error %d)", (int)rtcGetDeviceError(NULL));
  rtcSetDeviceErrorFunction(surface->device, keep_message, &message);
  qmat_status status = QMAT_OK;
  if (!rtcGetDeviceProperty(surface->device, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED)) {
    status = qmat_fail(context, QMAT_ERROR_DEPENDENCY, "this Embree was built without filter functions");
    goto done;
  }
  surface->scene = rtcNewScene(surface->device);
  geometry = rtcNewGeometry(surface->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (!surface->scene || !geometry) goto check;
  rtcSetSceneFlags(surface->scene, RTC_SCENE_FLAG_ROBUST);
  /* High build quality may split triangles, and a ray could then hit one twice. */
  rtcSetSceneBuildQuality(surface->scene, RTC_BUILD_QUALITY_MEDIUM);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
  float *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                            mesh->vertex_count);
  if (!vertices) goto check;
  for (size_t i = 0; i < 3 * mesh->vertex_count; i++) vertices[i] = (float)surface->positions[i];
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh->triangles, 0,
                             3 * sizeof(uint32_t), surface->solid_count);
  rtcSetGeometryUserData(geometry, surface);
  rtcSetGeometryOccludedFilterFunction(geometry, record_hit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(surface->scene, geometry);
  rtcCommitScene(surface->scene);
  if (surface->solid_count > 0)
    status = qmat_triangle_blocks_new(context, surface->device, surface->positions, mesh->triangles,
                                      surface->solid_count, &surface->blocks);
  if (status == QMAT_OK && mesh->sheet_triangle_count > 0)
    status = qmat_triangle_blocks_new(context, surface->device, surface->positions,
                                      mesh->triangles + 3 * surface->solid_count, mesh->sheet_triangle_count,
                                      &surface->sheet_blocks);
check:
  if (status == QMAT_OK) status = embree_status(context, surface->device, &message);
  if (status == QMAT_OK && (!surface->scene || !geometry))
    status = qmat_fail(context, QMAT_ERROR_DEPENDENCY, "Embree created no scene");
done:
  if (geometry) rtcReleaseGeometry(geometry);
  rtcSetDeviceErrorFunction(surface->device, NULL, NULL);
  return status;
}

static void free_kept(qmat_kept *kept) {
  qmat_surface_free((qmat_surface *)kept);
}

static qmat_status make_surface(qmat_context *context, const qmat_mesh *mesh, bool with_sheets,
                                qmat_surface **surface) {
  *surface = NULL;
  qmat_surface *made = qmat_calloc(1, sizeof *made);
  if (!made) return qmat_fail_memory(context, "a surface");
  made->kept.free = free_kept;
  atomic_init(&made->references, 1);
  made->solids = qmat_mesh_of_solids(mesh);
  made->mesh = with_sheets ? mesh : &made->solids;
  made->solid_count = made->solids.triangle_count;
  qmat_status status = qmat_frame_of_mesh(context, mesh, &made->frame);
  made->half_thickness = status == QMAT_OK ? 0.5 * mesh->sheet_thickness / made->frame.diagonal : 0;
  if (status != QMAT_OK) goto failed;
  made->positions = qmat_alloc(3 * mesh->vertex_count, sizeof *made->positions);
  if (!made->positions) {
    status = qmat_fail_memory(context, "the vertices");
    goto failed;
  }
  qmat_frame_to_unit(&made->frame, mesh->positions, mesh->vertex_count, made->positions);
  for (int axis = 0; axis < 3; axis++) {
    made->low[axis] = INFINITY;
    made->high[axis] = -INFINITY;
  }
  for (size_t corner = 0; corner < 3 * made->solid_count; corner++) {
    const double *p = made->positions + 3 * (size_t)mesh->triangles[corner];
    for (int axis = 0; axis < 3; axis++) {
      made->low[axis] = qmat_smaller(made->low[axis], p[axis]);
      made->high[axis] = qmat_larger(made->high[axis], p[axis]);
    }
  }
  status = build_scene(context, made);
  if (status == QMAT_OK) status = qmat_progress(context, 0, 0, "surface");
  if (status != QMAT_OK) goto failed;
  if (!(mesh->closed && mesh->oriented) && made->solid_count > 0) {
    status = qmat_winding_tree_new(context, made->positions, mesh->triangles, NULL, made->solid_count, &made->winding);
    if (status != QMAT_OK) goto failed;
  }
  *surface = made;
  return QMAT_OK;
failed:
  qmat_surface_free(made);
  return status;
}

/* The surface that is kept with a sealed mesh, made by the first call. The nodes of a run need the same one. */
static qmat_status share_surface(qmat_context *context, const qmat_mesh *mesh, bool with_sheets,
                                 qmat_surface **surface) {
  if (!mesh->base.sealed) return make_surface(context, mesh, with_sheets, surface);
  with_sheets = with_sheets || mesh->sheet_triangle_count == 0;
  _Atomic(qmat_kept *) *place = &((qmat_mesh *)mesh)->base.kept[with_sheets ? 0 : 1];
  qmat_kept *kept = atomic_load(place);
  if (!kept) {
    const qmat_status status = make_surface(context, mesh, with_sheets, surface);
    if (status != QMAT_OK || !atomic_compare_exchange_strong(place, &kept, &(*surface)->kept)) return status;
  } else {
    *surface = NULL;
    const qmat_status status = qmat_progress(context, 0, 0, "surface");
    if (status != QMAT_OK) return status;
    *surface = (qmat_surface *)kept;
  }
  atomic_fetch_add(&(*surface)->references, 1);
  return QMAT_OK;
}

qmat_status qmat_surface_new(qmat_context *context, const qmat_mesh *mesh, qmat_surface **surface) {
  return share_surface(context, mesh, true, surface);
}

qmat_status qmat_surface_new_of_solids(qmat_context *context, const qmat_mesh *mesh, qmat_surface **surface) {
  return share_surface(context, mesh, false, surface);
}

void qmat_surface_free(qmat_surface *surface) {
  if (!surface || atomic_fetch_sub(&surface->references, 1) != 1) return;
  qmat_triangle_blocks_free(surface->blocks);
  qmat_triangle_blocks_free(surface->sheet_blocks);
  if (surface->scene) rtcReleaseScene(surface->scene);
  if (surface->device) rtcReleaseDevice(surface->device);
  qmat_free(surface->positions);
  qmat_winding_tree_free(surface->winding);
  qmat_free(surface);
}

const qmat_frame *qmat_surface_frame(const qmat_surface *surface) {
  return &surface->frame;
}

const double *qmat_surface_positions(const qmat_surface *surface) {
  return surface->positions;
}

const qmat_mesh *qmat_surface_mesh(const qmat_surface *surface) {
  return surface->mesh;
}

double qmat_surface_half_thickness(const qmat_surface *surface) {
  return surface->sheet_blocks ? surface->half_thickness : 0;
}
