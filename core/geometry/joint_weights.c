/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/joint_weights.h"

#include <math.h>
#include <string.h>

#include "core/geometry/envelope.h"
#include "core/geometry/frame.h"
#include "core/geometry/surface.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "core/value.h"

enum { MOST_JOINTS = 65536, MOST_PARTS = 16, MOST_POINTS = 1 << 22, POINTS_A_REPORT = 1 << 14 };
/* Points are about so far apart, in diagonals. */
static const double spacing = 0.02;

/* Inserts an influence into the four strongest, which descend. */
static void keep_strongest(uint32_t joint, double weight, uint32_t strongest[4], double strengths[4]) {
  if (!(weight > strengths[3])) return;
  size_t k = 3;
  for (; k > 0 && weight > strengths[k - 1]; k--) {
    strengths[k] = strengths[k - 1];
    strongest[k] = strongest[k - 1];
  }
  strengths[k] = weight;
  strongest[k] = joint;
}

static void normalise(uint32_t strongest[4], double strengths[4]) {
  const double sum = strengths[0] + strengths[1] + strengths[2] + strengths[3];
  for (size_t k = 0; k < 4; k++) {
    strengths[k] = sum > 0 ? strengths[k] / sum : k == 0;
    if (!(strengths[k] > 0)) strongest[k] = 0;
  }
}

void qmat_strongest_joints(const uint32_t *joints, const double *weights, size_t count, uint32_t strongest[4],
                           double strengths[4]) {
  memset(strongest, 0, 4 * sizeof *strongest);
  memset(strengths, 0, 4 * sizeof *strengths);
  for (size_t i = 0; i < count; i++) {
    double weight = 0;
    bool is_first = joints[i] < MOST_JOINTS;
    for (size_t k = 0; k < count && is_first; k++) {
      if (joints[k] != joints[i]) continue;
      is_first = k >= i;
      if (weights[k] > 0 && isfinite(weights[k])) weight += weights[k];
    }
    if (is_first) keep_strongest(joints[i], weight, strongest, strengths);
  }
  normalise(strongest, strengths);
}

/* The points of the surface. Triangle t has parts[t] squared of them: the centroids of the triangles into which lines
 * parallel to its sides divide it. */
typedef struct surface_points {
  const qmat_mesh *mesh;
  size_t count;
  uint8_t *parts;      /* per triangle */
  uint32_t *triangles; /* count */
  size_t *firsts;      /* per triangle */
  uint32_t *owners;    /* count: the sphere that answers for a point */
} surface_points;

static qmat_status place_points(qmat_context *context, const qmat_mesh *mesh, surface_points *s) {
  qmat_frame frame;
  const size_t count = mesh->triangle_count;
  *s = (surface_points){.mesh = mesh};
  qmat_status status = qmat_frame_of_mesh(context, mesh, &frame);
  if (status != QMAT_OK) return status;
  const double most = fmin(fmax(floor(sqrt((double)MOST_POINTS / (double)count)), 1), MOST_PARTS);
  s->parts = qmat_arena_alloc(&context->arena, count, sizeof *s->parts);
  s->firsts = qmat_arena_alloc(&context->arena, count, sizeof *s->firsts);
  if (!s->parts || !s->firsts) return qmat_fail_memory(context, "the joints of spheres");
  for (size_t t = 0; t < count; t++) {
    double longest = 0;
    for (size_t k = 0; k < 3; k++)
      longest = fmax(longest, qmat_point_distance(mesh->positions + 3 * (size_t)mesh->triangles[3 * t + k],
                                                  mesh->positions + 3 * (size_t)mesh->triangles[3 * t + (k + 1) % 3]));
    s->parts[t] = (uint8_t)fmin(fmax(ceil(longest / (spacing * frame.diagonal)), 1), most);
    s->firsts[t] = s->count;
    s->count += (size_t)s->parts[t] * s->parts[t];
  }
  s->triangles = qmat_arena_alloc(&context->arena, s->count, sizeof *s->triangles);
  s->owners = qmat_arena_alloc(&context->arena, s->count, sizeof *s->owners);
  if (!s->triangles || !s->owners) return qmat_fail_memory(context, "the joints of spheres");
  for (size_t t = 0, i = 0; t < count; t++)
    for (const size_t end = i + (size_t)s->parts[t] * s->parts[t]; i < end; i++) s->triangles[i] = (uint32_t)t;
  return QMAT_OK;
}

/* The weights of the corners at a point. Row r from the first corner has 2 * r + 1 parts. */
static void corner_weights(const surface_points *s, size_t point, double weights[3]) {
  const size_t t = s->triangles[point], number = point - s->firsts[t];
  size_t row = (size_t)sqrt((double)number);
  while (row * row > number) row--;
  while ((row + 1) * (row + 1) <= number) row++;
  const size_t place = number - row * row, column = place / 2;
  const double parts = s->parts[t], shift = (double)(1 + place % 2) / 3;
  weights[2] = ((double)column + shift) / parts;
  weights[1] = ((double)(row - place % 2 - column) + shift) / parts;
  weights[0] = 1 - weights[1] - weights[2];
}

/* The sphere that answers for a point: of the primitive nearest to it the one nearest to the foot. */
static uint32_t owner_of(const qmat_envelope *envelope, const qmat_medial *medial, const surface_points *s,
                         size_t point) {
  const uint32_t *corners = s->mesh->triangles + 3 * (size_t)s->triangles[point];
  double weights[3], place[3] = {0, 0, 0}, foot[4] = {0}, least = INFINITY;
  corner_weights(s, point, weights);
  for (size_t k = 0; k < 9; k++)
    place[k % 3] += weights[k / 3] * s->mesh->positions[3 * (size_t)corners[k / 3] + k % 3];
  size_t primitive;
  qmat_envelope_nearest(envelope, place, &primitive, foot);
  uint32_t ids[3], owner = 0;
  const int count = qmat_envelope_primitive(envelope, primitive, ids);
  for (int k = 0; k < count; k++) {
    const double distance = qmat_point_distance(medial->spheres + 4 * (size_t)ids[k], foot);
    if (distance < least || (distance == least && ids[k] < owner)) {
      least = distance;
      owner = ids[k];
    }
  }
  return owner;
}

static qmat_status find_owners(qmat_context *context, const qmat_medial *medial, const surface_points *s) {
  qmat_envelope *envelope;
  qmat_status status = qmat_envelope_of_medial(context, medial, &envelope);
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < s->count && status == QMAT_OK; first += POINTS_A_REPORT) {
    const size_t end = first + POINTS_A_REPORT < s->count ? first + POINTS_A_REPORT : s->count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t i = first; i < end; i++) s->owners[i] = owner_of(envelope, medial, s, i);
    status = qmat_progress(context, end, s->count, "joints");
  }
  qmat_envelope_free(envelope);
  return status;
}

static uint32_t nearest_vertex(const qmat_mesh *mesh, const double *place) {
  uint32_t nearest = 0;
  double least = INFINITY;
  for (uint32_t v = 0; v < mesh->vertex_count; v++) {
    const double distance = qmat_point_distance(mesh->positions + 3 * (size_t)v, place);
    if (distance < least) nearest = v;
    least = fmin(least, distance);
  }
  return nearest;
}

/* Sums of the weights of joints. */
typedef struct joint_sums {
  double *sums;    /* MOST_JOINTS, zero between spheres */
  uint32_t *found; /* MOST_JOINTS: the first `count` are the joints with a sum */
  size_t count;
} joint_sums;

/* Adds the influences at a point, by the area that it stands for. */
static void add_point(const surface_points *s, size_t point, joint_sums *sums) {
  const qmat_mesh *mesh = s->mesh;
  const uint32_t *c = mesh->triangles + 3 * (size_t)s->triangles[point];
  const double parts = s->parts[s->triangles[point]];
  double weights[3], normal[3];
  corner_weights(s, point, weights);
  qmat_triangle_normal(mesh->positions + 3 * (size_t)c[0], mesh->positions + 3 * (size_t)c[1],
                       mesh->positions + 3 * (size_t)c[2], normal);
  const double area = sqrt(qmat_dot(normal, normal)) / (parts * parts);
  for (size_t k = 0; k < 12; k++) {
    const size_t at = 4 * (size_t)c[k / 4] + k % 4;
    const uint32_t joint = mesh->joints[at];
    const double weight = area * weights[k / 4] * mesh->weights[at];
    if (!(weight > 0)) continue;
    if (!(sums->sums[joint] > 0)) sums->found[sums->count++] = joint;
    sums->sums[joint] += weight;
  }
}

/* The points in the order of their owners; those of sphere i end at ends[i]. */
static qmat_status sort_by_owner(qmat_context *context, const surface_points *s, size_t sphere_count, uint32_t **order,
                                 size_t **ends) {
  *order = qmat_arena_alloc(&context->arena, s->count, sizeof **order);
  *ends = qmat_arena_calloc(&context->arena, sphere_count, sizeof **ends);
  if (!*order || !*ends) return qmat_fail_memory(context, "the joints of spheres");
  for (size_t i = 0; i < s->count; i++) (*ends)[s->owners[i]]++;
  for (size_t i = 0, start = 0; i < sphere_count; i++) {
    const size_t count = (*ends)[i];
    (*ends)[i] = start;
    start += count;
  }
  for (size_t i = 0; i < s->count; i++) (*order)[(*ends)[s->owners[i]]++] = (uint32_t)i;
  return QMAT_OK;
}

static qmat_status sum_up(qmat_context *context, const surface_points *s, qmat_medial *medial) {
  const qmat_mesh *mesh = s->mesh;
  uint32_t *order;
  size_t *ends;
  joint_sums sums = {.sums = qmat_arena_calloc(&context->arena, MOST_JOINTS, sizeof *sums.sums),
                     .found = qmat_arena_alloc(&context->arena, MOST_JOINTS, sizeof *sums.found)};
  if (!sums.sums || !sums.found) return qmat_fail_memory(context, "the joints of spheres");
  qmat_status status = sort_by_owner(context, s, medial->sphere_count, &order, &ends);
  for (size_t i = 0, at = 0; i < medial->sphere_count && status == QMAT_OK; i++) {
    uint32_t *joints = medial->joints + 4 * i;
    double *weights = medial->weights + 4 * i;
    for (; at < ends[i]; at++) add_point(s, order[at], &sums);
    if (sums.count == 0) {
      const size_t vertex = nearest_vertex(mesh, medial->spheres + 4 * i);
      qmat_strongest_joints(mesh->joints + 4 * vertex, mesh->weights + 4 * vertex, 4, joints, weights);
      status = qmat_progress(context, i, medial->sphere_count, "spheres");
      continue;
    }
    memset(joints, 0, 4 * sizeof *joints);
    memset(weights, 0, 4 * sizeof *weights);
    for (size_t k = 0; k < sums.count; k++) {
      keep_strongest(sums.found[k], sums.sums[sums.found[k]], joints, weights);
      sums.sums[sums.found[k]] = 0;
    }
    sums.count = 0;
    normalise(joints, weights);
  }
  return status;
}

qmat_status qmat_joints_of_spheres(qmat_context *context, const qmat_mesh *mesh, qmat_medial *medial) {
  if (mesh->skinned_count == 0 || mesh->triangle_count == 0 || medial->sphere_count == 0) return QMAT_OK;
  surface_points points;
  qmat_status status = place_points(context, mesh, &points);
  if (status == QMAT_OK) status = find_owners(context, medial, &points);
  if (status != QMAT_OK) return status;
  medial->joints = qmat_alloc(4 * medial->sphere_count, sizeof *medial->joints);
  medial->weights = qmat_alloc(4 * medial->sphere_count, sizeof *medial->weights);
  if (!medial->joints || !medial->weights) return qmat_fail_memory(context, "the joints of spheres");
  medial->skinned_count = medial->sphere_count;
  return sum_up(context, &points, medial);
}

/* ---- the envelope ---- */

/* The joints of the primitive nearest to a point, blended by the weights of its spheres at the foot. */
static void blend_joints(const qmat_envelope *envelope, const qmat_medial *medial, const double *point,
                         uint32_t strongest[4], double strengths[4]) {
  uint32_t ids[3] = {UINT32_MAX, UINT32_MAX, UINT32_MAX}, joints[12];
  double feet[3], weights[12];
  size_t count = 0;
  (void)qmat_envelope_foot_within(envelope, point, INFINITY, NULL, ids, feet);
  for (size_t i = 0; i < 3 && ids[i] != UINT32_MAX; i++)
    for (size_t k = 0; k < 4; k++, count++) {
      joints[count] = medial->joints[4 * (size_t)ids[i] + k];
      weights[count] = feet[i] * medial->weights[4 * (size_t)ids[i] + k];
    }
  qmat_strongest_joints(joints, weights, count, strongest, strengths);
}

qmat_status qmat_joints_of_envelope(qmat_context *context, const qmat_medial *medial, const qmat_mesh *mesh,
                                    uint32_t *joints, double *weights) {
  enum { SLICE = 16384 }; /* vertices between two calls of the progress function */
  qmat_envelope *envelope;
  qmat_status status = qmat_envelope_of_medial(context, medial, &envelope);
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < mesh->vertex_count && status == QMAT_OK; first += SLICE) {
    const size_t end = first + SLICE < mesh->vertex_count ? first + SLICE : mesh->vertex_count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t v = first; v < end; v++)
      blend_joints(envelope, medial, mesh->positions + 3 * v, joints + 4 * v, weights + 4 * v);
    status = qmat_progress(context, end, mesh->vertex_count, "vertices");
  }
  qmat_envelope_free(envelope);
  return status;
}

/* ---- the surface ---- */

/* The weights of a triangle's corners at a point on it. */
static void weights_on_triangle(const double *const corners[3], const double point[3], double weights[3]) {
  double normal[3], sum = 0, least = INFINITY;
  int nearest = 0;
  qmat_triangle_normal(corners[0], corners[1], corners[2], normal);
  for (int k = 0; k < 3; k++) {
    double side[3], from[3], product[3];
    qmat_subtract(corners[(k + 2) % 3], corners[(k + 1) % 3], side);
    qmat_subtract(point, corners[(k + 1) % 3], from);
    qmat_cross(side, from, product);
    weights[k] = fmax(qmat_dot(product, normal), 0);
    sum += weights[k];
    const double distance = qmat_point_distance(corners[k], point);
    if (!(distance < least)) continue;
    least = distance;
    nearest = k;
  }
  for (int k = 0; k < 3; k++) weights[k] = sum > 0 ? weights[k] / sum : k == nearest;
}

void qmat_joints_at(const qmat_surface *surface, const double point[3], uint32_t joints[4], double weights[4]) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface), *corners[3];
  double place[3], closest[3], shares[3], given[12];
  uint32_t triangle = 0, named[12];
  qmat_frame_to_unit(qmat_surface_frame(surface), point, 1, place);
  memcpy(closest, place, sizeof closest);
  (void)qmat_surface_distance(surface, place, INFINITY, closest, &triangle);
  const uint32_t *ids = mesh->triangles + 3 * (size_t)triangle;
  for (size_t k = 0; k < 3; k++) corners[k] = positions + 3 * (size_t)ids[k];
  weights_on_triangle(corners, closest, shares);
  for (size_t i = 0; i < 12; i++) {
    named[i] = mesh->joints[4 * (size_t)ids[i / 4] + i % 4];
    given[i] = shares[i / 4] * mesh->weights[4 * (size_t)ids[i / 4] + i % 4];
  }
  qmat_strongest_joints(named, given, 12, joints, weights);
}

qmat_status qmat_joints_of_surface(qmat_context *context, const qmat_mesh *given, qmat_mesh *mesh) {
  enum { SLICE = 16384 }; /* vertices between two calls of the progress function */
  qmat_surface *surface;
  if (given->skinned_count == 0 || given->triangle_count == 0) return QMAT_OK;
  mesh->joints = qmat_alloc(4 * mesh->vertex_count, sizeof *mesh->joints);
  mesh->weights = qmat_alloc(4 * mesh->vertex_count, sizeof *mesh->weights);
  if (!mesh->joints || !mesh->weights) return qmat_fail_memory(context, "the joints of vertices");
  mesh->skinned_count = mesh->vertex_count;
  qmat_status status = qmat_surface_new(context, given, &surface);
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < mesh->vertex_count && status == QMAT_OK; first += SLICE) {
    const size_t end = first + SLICE < mesh->vertex_count ? first + SLICE : mesh->vertex_count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t v = first; v < end; v++)
      qmat_joints_at(surface, mesh->positions + 3 * v, mesh->joints + 4 * v, mesh->weights + 4 * v);
    status = qmat_progress(context, end, mesh->vertex_count, "vertices");
  }
  qmat_surface_free(surface);
  return status;
}
