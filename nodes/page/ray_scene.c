/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/ray_scene.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/measure/boundary_features.h"

struct qmat_ray_scene {
  const qmat_display_mesh *display;
  qmat_boundary_features features;
  RTCDevice device;
  RTCScene surface, medial;
  /* Geometries of `medial` in the order in which they are attached. */
  unsigned spheres, cones;
};

/* Boxes are widened by this: Embree's are in single precision. */
static const double widening = 1e-6;
/* Far below a pixel. */
static const double lift = 3e-5;

/* ---- intersection ---- */

/* Moves the ray's origin to the point nearest to `centre`, where differences of squares lose nothing. Returns how far
 * it moved. */
static double approach(const double origin[3], const double direction[3], const double *centre, double near[3]) {
  double to[3];
  qmat_subtract(centre, origin, to);
  const double t = qmat_dot(to, direction);
  for (int k = 0; k < 3; k++) near[k] = origin[k] + t * direction[k] - centre[k];
  return t;
}

static double hit_sphere(const double *sphere, const double origin[3], const double direction[3], double normal[3]) {
  double near[3];
  const double t = approach(origin, direction, sphere, near), square = sphere[3] * sphere[3] - qmat_dot(near, near);
  if (!(square > 0)) return INFINITY;
  const double half = sqrt(square);
  for (int k = 0; k < 3; k++) normal[k] = (near[k] - half * direction[k]) / sphere[3];
  return t - half;
}

/* The side of a cone is |w| = r0 + slope h between the planes of its tangent circles; h is the height above the first
 * plane, and w points from the axis to the surface. */
static double hit_cone(const qmat_cone_side *side, const double origin[3], const double direction[3],
                       double normal[3]) {
  double near[3], w[3], dw[3], foot[3];
  const double slope = -side->along / side->across, r0 = side->a[3] * side->across;
  const double height = side->length * side->across; /* between the planes */
  for (int k = 0; k < 3; k++) foot[k] = side->a[k] + side->a[3] * side->along * side->axis[k];
  double middle[3];
  for (int k = 0; k < 3; k++) middle[k] = foot[k] + 0.5 * height * side->axis[k];
  const double t = approach(origin, direction, middle, near);
  const double h = qmat_dot(near, side->axis) + 0.5 * height, dh = qmat_dot(direction, side->axis);
  for (int k = 0; k < 3; k++) {
    w[k] = near[k] - (h - 0.5 * height) * side->axis[k];
    dw[k] = direction[k] - dh * side->axis[k];
  }
  const double r = r0 + slope * h, dr = slope * dh;
  const double a = qmat_dot(dw, dw) - dr * dr, b = qmat_dot(w, dw) - r * dr, c = qmat_dot(w, w) - r * r;
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return INFINITY;
  /* the two roots without cancellation; a may be 0 */
  const double q = -(b + copysign(sqrt(discriminant), b));
  double roots[2] = {q != 0 ? c / q : INFINITY, a != 0 ? q / a : INFINITY};
  if (roots[1] < roots[0]) {
    const double later = roots[0];
    roots[0] = roots[1];
    roots[1] = later;
  }
  for (int i = 0; i < 2; i++) {
    const double s = roots[i], at = h + s * dh, radius = r0 + slope * at;
    if (!(at >= 0 && at <= height && radius > 0 && t + s > 0)) continue;
    for (int k = 0; k < 3; k++) normal[k] = side->across * (w[k] + s * dw[k]) / radius + side->along * side->axis[k];
    return t + s;
  }
  return INFINITY;
}

static void bound_sphere(const struct RTCBoundsFunctionArguments *args) {
  const qmat_ray_scene *scene = args->geometryUserPtr;
  const double *s = &scene->features.spheres[4 * (size_t)args->primID], reach = s[3] + widening;
  float *low = &args->bounds_o->lower_x, *high = &args->bounds_o->upper_x;
  for (int k = 0; k < 3; k++) low[k] = (float)(s[k] - reach), high[k] = (float)(s[k] + reach);
}

static void bound_cone(const struct RTCBoundsFunctionArguments *args) {
  const qmat_ray_scene *scene = args->geometryUserPtr;
  float *low = &args->bounds_o->lower_x, *high = &args->bounds_o->upper_x;
  for (int end = 0; end < 2; end++) {
    const double *s =
        &scene->features.spheres[4 * (size_t)scene->features.edges[2 * (size_t)args->primID + (size_t)end]];
    for (int k = 0; k < 3; k++) {
      const float from = (float)(s[k] - s[3] - widening), to = (float)(s[k] + s[3] + widening);
      low[k] = end && low[k] < from ? low[k] : from;
      high[k] = end && high[k] > to ? high[k] : to;
    }
  }
}

static void intersect(const struct RTCIntersectFunctionNArguments *args) {
  const qmat_ray_scene *scene = args->geometryUserPtr;
  struct RTCRayHit *ray = (struct RTCRayHit *)args->rayhit; /* N is 1 */
  if (!args->valid[0]) return;
  const double origin[3] = {ray->ray.org_x, ray->ray.org_y, ray->ray.org_z};
  const double direction[3] = {ray->ray.dir_x, ray->ray.dir_y, ray->ray.dir_z};
  double normal[3];
  qmat_cone_side side;
  double t = INFINITY;
  if (args->geomID == scene->spheres)
    t = hit_sphere(&scene->features.spheres[4 * (size_t)args->primID], origin, direction, normal);
  else if (qmat_cone_side_of_edge(&scene->features, args->primID, &side))
    t = hit_cone(&side, origin, direction, normal);
  if (!(t > ray->ray.tnear && t < ray->ray.tfar)) return;
  ray->ray.tfar = (float)t;
  ray->hit.geomID = args->geomID;
  ray->hit.primID = args->primID;
  ray->hit.Ng_x = (float)normal[0];
  ray->hit.Ng_y = (float)normal[1];
  ray->hit.Ng_z = (float)normal[2];
}

/* ---- building ---- */

static void add_triangles(const qmat_ray_scene *scene, RTCScene to, const double *positions, size_t vertex_count,
                          const uint32_t *triangles, size_t triangle_count) {
  RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  float *vertices =
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertex_count);
  uint32_t *ids =
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof *ids, triangle_count);
  if (vertices && ids) {
    for (size_t i = 0; i < 3 * vertex_count; i++) vertices[i] = (float)positions[i];
    for (size_t i = 0; i < 3 * triangle_count; i++) ids[i] = triangles ? triangles[i] : (uint32_t)i;
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(to, geometry);
  }
  rtcReleaseGeometry(geometry);
}

static unsigned add_primitives(qmat_ray_scene *scene, size_t count, RTCBoundsFunction bounds) {
  if (count == 0) return RTC_INVALID_GEOMETRY_ID;
  RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, (unsigned)count);
  rtcSetGeometryUserData(geometry, scene);
  rtcSetGeometryBoundsFunction(geometry, bounds, NULL);
  rtcSetGeometryIntersectFunction(geometry, intersect);
  rtcCommitGeometry(geometry);
  const unsigned id = rtcAttachGeometry(scene->medial, geometry);
  rtcReleaseGeometry(geometry);
  return id;
}

/* Moves a face out by `lift`, so that it covers the cones that touch it along its sides. */
static void lift_face(const qmat_boundary_features *f, size_t row, double corners[9]) {
  for (size_t i = 0; i < 3; i++) {
    const double *s = &f->spheres[4 * (size_t)f->triangles[3 * (row / 2) + i]];
    for (size_t k = 0; k < 3 && s[3] > 0; k++) corners[3 * i + k] += lift * (corners[3 * i + k] - s[k]) / s[3];
  }
}

static qmat_status add_slabs(qmat_context *context, qmat_ray_scene *scene) {
  const size_t most = 2 * scene->features.triangle_count;
  double *corners = qmat_arena_alloc(&context->arena, most, 9 * sizeof *corners);
  if (!corners) return qmat_fail_memory(context, "the slabs to draw");
  size_t count = 0;
  for (size_t row = 0; row < most; row++) {
    if (!qmat_slab_face(&scene->features, row, &corners[9 * count])) continue;
    lift_face(&scene->features, row, &corners[9 * count]);
    count++;
  }
  if (count > 0) add_triangles(scene, scene->medial, corners, 3 * count, NULL, count);
  return QMAT_OK;
}

static qmat_status build(qmat_context *context, qmat_ray_scene *scene, const qmat_medial *unit) {
  /* One thread makes the same tree each time: where a ray hits an edge, the tree decides which triangle counts. */
  scene->device = rtcNewDevice("ignore_config_files=1,threads=1");
  if (!scene->device)
    return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "Embree cannot start (error %d)", (int)rtcGetDeviceError(NULL));
  scene->surface = rtcNewScene(scene->device);
  scene->medial = rtcNewScene(scene->device);
  rtcSetSceneFlags(scene->surface, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneFlags(scene->medial, RTC_SCENE_FLAG_ROBUST);
  qmat_status status = QMAT_OK;
  if (scene->display)
    add_triangles(scene, scene->surface, scene->display->positions, scene->display->vertex_count,
                  scene->display->triangles, scene->display->triangle_count);
  if (unit) {
    status = qmat_boundary_features_init(context, unit, &scene->features);
    if (status != QMAT_OK) return status;
    scene->spheres = add_primitives(scene, unit->sphere_count, bound_sphere);
    scene->cones = add_primitives(scene, unit->edge_count, bound_cone);
    status = add_slabs(context, scene);
  }
  rtcCommitScene(scene->surface);
  rtcCommitScene(scene->medial);
  const enum RTCError code = rtcGetDeviceError(scene->device);
  if (status != QMAT_OK || code == RTC_ERROR_NONE) return status;
  if (code == RTC_ERROR_OUT_OF_MEMORY) return qmat_fail_memory(context, "Embree's search tree");
  return qmat_fail(context, QMAT_ERROR_DEPENDENCY, "Embree failed (error %d)", (int)code);
}

qmat_status qmat_ray_scene_new(qmat_context *context, const qmat_display_mesh *display, const qmat_medial *unit,
                               qmat_ray_scene **scene) {
  *scene = NULL;
  qmat_ray_scene *made = qmat_calloc(1, sizeof *made);
  if (!made) return qmat_fail_memory(context, "the scene to draw");
  made->display = display;
  const qmat_status status = build(context, made, unit);
  if (status == QMAT_OK)
    *scene = made;
  else
    qmat_ray_scene_free(made);
  return status;
}

void qmat_ray_scene_free(qmat_ray_scene *scene) {
  if (!scene) return;
  if (scene->surface) rtcReleaseScene(scene->surface);
  if (scene->medial) rtcReleaseScene(scene->medial);
  if (scene->device) rtcReleaseDevice(scene->device);
  qmat_free(scene);
}

/* ---- rays ---- */

static struct RTCRayHit cast(RTCScene scene, const double origin[3], const double direction[3]) {
  struct RTCIntersectContext query;
  rtcInitIntersectContext(&query);
  struct RTCRayHit ray = {.ray = {.org_x = (float)origin[0],
                                  .org_y = (float)origin[1],
                                  .org_z = (float)origin[2],
                                  .dir_x = (float)direction[0],
                                  .dir_y = (float)direction[1],
                                  .dir_z = (float)direction[2],
                                  .tfar = INFINITY,
                                  .mask = UINT32_MAX},
                          .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
  rtcIntersect1(scene, &query, &ray);
  return ray;
}

/* Sets a unit normal that faces the ray. */
static void set_normal(const double normal[3], const double direction[3], qmat_ray_hit *hit) {
  const double length = sqrt(qmat_dot(normal, normal)), sign = qmat_dot(normal, direction) > 0 ? -1 : 1;
  for (int k = 0; k < 3; k++) hit->normal[k] = length > 0 ? sign * normal[k] / length : -direction[k];
}

qmat_ray_hit qmat_ray_scene_surface(const qmat_ray_scene *scene, const double origin[3], const double direction[3]) {
  qmat_ray_hit hit = {.distance = INFINITY};
  const struct RTCRayHit ray = cast(scene->surface, origin, direction);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  const qmat_display_mesh *display = scene->display;
  const uint32_t *row = &display->triangles[3 * (size_t)ray.hit.primID];
  const double weights[3] = {1 - (double)ray.hit.u - (double)ray.hit.v, ray.hit.u, ray.hit.v};
  double normal[3] = {0, 0, 0};
  hit.distance = ray.ray.tfar;
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) normal[k] += weights[i] * display->normals[3 * (size_t)row[i] + (size_t)k];
    if (display->errors) hit.error += weights[i] * display->errors[row[i]];
  }
  set_normal(normal, direction, &hit);
  return hit;
}

qmat_ray_hit qmat_ray_scene_medial(const qmat_ray_scene *scene, const double origin[3], const double direction[3]) {
  qmat_ray_hit hit = {.distance = INFINITY};
  const struct RTCRayHit ray = cast(scene->medial, origin, direction);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.distance = ray.ray.tfar;
  hit.kind = ray.hit.geomID == scene->spheres ? QMAT_LOOK_SPHERE
             : ray.hit.geomID == scene->cones ? QMAT_LOOK_CONE
                                              : QMAT_LOOK_SLAB;
  set_normal((const double[3]){ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z}, direction, &hit);
  return hit;
}
