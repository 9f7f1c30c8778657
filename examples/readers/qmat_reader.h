/* SPDX-FileCopyrightText: 2026 the qmat authors
 * SPDX-License-Identifier: MIT */
#ifndef QMAT_READER_H
#define QMAT_READER_H

/* Reads the medial meshes that qmat writes into glTF files (qmat_flat, see FORMAT.md) and answers questions about the
 * solid: signed distance, nearest point, support point, ray. C99 or C++, no library but libc and libm. Nothing is
 * global; const functions may run on any thread. Each question costs one pass over the simplices.
 *
 *   size_t length;
 *   qmr_medial medial;
 *   const char *text = qmr_find(file, file_size, NULL, &length);   (or the string from your JSON parser)
 *   if (text && qmr_decode_base64(text, length, &medial) == 0) {
 *     double point[3] = {0, 1, 0}, closest[3];
 *     double distance = qmr_distance(&medial, point, closest);
 *     qmr_free(&medial);
 *   } */

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct qmr_medial {
  uint32_t sphere_count, slab_count, cone_count, point_count;
  double *spheres;  /* 4 each: x, y, z, radius, in the space of the glTF node */
  uint32_t *slabs;  /* 3 each: convex hulls of three spheres */
  uint32_t *cones;  /* 2 each: convex hulls of two spheres, those that are no side of a slab */
  uint32_t *points; /* 1 each: spheres on no cone and no slab */
  double *errors;   /* 1 each sphere: bound of the distance of the surface that it answers for; NULL: not in the file */
  uint16_t *joints; /* 4 each sphere: numbers in the skin's joints; NULL: not in the file */
  double *weights;  /* 4 each sphere, of sum 1; NULL: not in the file */
} qmr_medial;

/* ---- decoding ---- */

static inline void qmr_free(qmr_medial *medial) {
  free(medial->spheres);
  free(medial->slabs);
  free(medial->cones);
  free(medial->points);
  free(medial->errors);
  free(medial->joints);
  free(medial->weights);
  memset(medial, 0, sizeof *medial);
}

static inline uint32_t qmr_u16(const uint8_t *at) {
  return (uint32_t)at[0] | (uint32_t)at[1] << 8;
}

static inline uint32_t qmr_u32(const uint8_t *at) {
  return qmr_u16(at) | qmr_u16(at + 2) << 16;
}

static inline double qmr_f32(const uint8_t *at) {
  const uint32_t bits = qmr_u32(at);
  float number;
  memcpy(&number, &bits, sizeof number);
  return (double)number;
}

/* Reads `count` ids below `limit` from `*at` and moves it to the next part. NULL: an id is out of range, or no memory.
 */
static inline uint32_t *qmr_ids(const uint8_t **at, size_t count, int wide, uint32_t limit) {
  uint32_t *ids = (uint32_t *)malloc((count + 1) * sizeof *ids);
  for (size_t i = 0; ids && i < count; i++) {
    ids[i] = wide ? qmr_u32(*at + 4 * i) : qmr_u16(*at + 2 * i);
    if (ids[i] < limit) continue;
    free(ids);
    ids = NULL;
  }
  *at += wide ? 4 * count : (2 * count + 3) / 4 * 4;
  return ids;
}

/* Decodes the bytes of qmat_flat. 0, or -1 where they are damaged, of a later version, or memory is short; the medial
 * mesh is then empty. Free it with qmr_free. */
static inline int qmr_decode(const uint8_t *bytes, size_t size, qmr_medial *medial) {
  memset(medial, 0, sizeof *medial);
  if (size < 64 || memcmp(bytes, "QMAT", 4) != 0 || qmr_u16(bytes + 4) != 1) return -1;
  const uint32_t flags = qmr_u16(bytes + 6), n = qmr_u32(bytes + 8);
  const uint32_t s = qmr_u32(bytes + 12), c = qmr_u32(bytes + 16), p = qmr_u32(bytes + 20);
  const int wide = (flags & 2) != 0;
  const uint64_t real = flags & 1 ? 4 : 2, width = wide ? 4 : 2, errors = flags & 4 ? (real * n + 3) / 4 * 4 : 0;
  const uint64_t needed = 64 + 4 * real * n + errors + (3 * width * s + 3) / 4 * 4 + (2 * width * c + 3) / 4 * 4 +
                          (width * p + 3) / 4 * 4 + (flags & 8 ? (uint64_t)16 * n : 0);
  if (flags > 15 || n == 0 || needed != size) return -1;
  int sound = (medial->spheres = (double *)malloc((size_t)n * 4 * sizeof(double))) != NULL;
  const uint8_t *at = bytes + 64;
  for (size_t i = 0; sound && i < (size_t)4 * n; i++, at += real) {
    const double stored = flags & 1 ? qmr_f32(at) : (double)qmr_u16(at);
    medial->spheres[i] = qmr_f32(bytes + 24 + 4 * (i % 4)) + qmr_f32(bytes + 40 + 4 * (i % 4)) * stored;
    sound = isfinite(medial->spheres[i]) && (i % 4 < 3 || medial->spheres[i] >= 0);
  }
  if (sound && (flags & 4)) {
    sound = (medial->errors = (double *)malloc(n * sizeof(double))) != NULL;
    for (size_t i = 0; sound && i < n; i++)
      medial->errors[i] = flags & 1 ? qmr_f32(at + 4 * i) : qmr_f32(bytes + 56) * (double)qmr_u16(at + 2 * i);
    at += errors;
  }
  sound = sound && (medial->slabs = qmr_ids(&at, (size_t)3 * s, wide, n)) != NULL;
  sound = sound && (medial->cones = qmr_ids(&at, (size_t)2 * c, wide, n)) != NULL;
  sound = sound && (medial->points = qmr_ids(&at, p, wide, n)) != NULL;
  if (sound && (flags & 8)) {
    sound = (medial->joints = (uint16_t *)malloc((size_t)n * 4 * sizeof(uint16_t))) != NULL;
    sound = (medial->weights = (double *)malloc((size_t)n * 4 * sizeof(double))) != NULL && sound;
    for (size_t i = 0; sound && i < (size_t)4 * n; i++) {
      medial->joints[i] = (uint16_t)qmr_u16(at + 2 * i);
      medial->weights[i] = (double)qmr_u16(at + (size_t)8 * n + 2 * i) / 65535;
    }
  }
  if (!sound) {
    qmr_free(medial);
    return -1;
  }
  medial->sphere_count = n;
  medial->slab_count = s;
  medial->cone_count = c;
  medial->point_count = p;
  return 0;
}

/* The same from the string, base64 of `length` characters. Backslashes, with which some writers of JSON escape '/', are
 * passed over. */
static inline int qmr_decode_base64(const char *text, size_t length, qmr_medial *medial) {
  uint8_t *bytes = (uint8_t *)malloc(length / 4 * 3 + 4);
  size_t size = 0, digits = 0;
  uint32_t word = 0;
  int sound = bytes != NULL;
  for (size_t i = 0; sound && i < length && text[i] != '='; i++) {
    static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    if (text[i] == '\\') continue;
    const char *found = text[i] ? strchr(alphabet, text[i]) : NULL;
    if (!found) sound = 0;
    word = (word << 6 | (uint32_t)(found ? found - alphabet : 0)) & 0xffffff;
    if (++digits % 4 != 1) bytes[size++] = (uint8_t)(word >> (4 - digits % 4) * 2 % 8 & 255);
  }
  const int result = sound ? qmr_decode(bytes, size, medial) : -1;
  if (!sound) memset(medial, 0, sizeof *medial);
  free(bytes);
  return result;
}

/* The next string of a member "qmat_flat" in a .glb or .gltf file, after `after` (NULL: the first); NULL: none. It
 * spares a parser of JSON where it does not matter which node a medial mesh belongs to. */
static inline const char *qmr_find(const void *file, size_t size, const char *after, size_t *length) {
  static const char key[] = "\"qmat_flat\"";
  const char *start = (const char *)file, *end = start + size;
  for (const char *at = after ? after : start; (size_t)(end - at) > sizeof key; at++) {
    if (memcmp(at, key, sizeof key - 1) != 0) continue;
    const char *value = at + sizeof key - 1;
    while (value < end && (*value == ' ' || *value == '\t' || *value == '\n' || *value == '\r' || *value == ':'))
      value++;
    if (value == end || *value != '"') continue;
    const char *last = ++value;
    while (last < end && *last != '"') last++;
    if (last == end) return NULL;
    *length = (size_t)(last - value);
    return value;
  }
  return NULL;
}

/* ---- geometry ---- */

static inline double qmr_dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The signed distance |p - c| - r to a sphere, which becomes `nearest` if it is the nearest so far. */
static inline double qmr_sphere(const double sphere[4], const double p[3], double best, double nearest[4]) {
  const double d[3] = {p[0] - sphere[0], p[1] - sphere[1], p[2] - sphere[2]};
  const double distance = sqrt(qmr_dot(d, d)) - sphere[3];
  if (!(distance < best)) return best;
  memcpy(nearest, sphere, 4 * sizeof *nearest);
  return distance;
}

/* The same for the convex hull of two spheres: the least distance to a sphere that interpolates them. */
static inline double qmr_cone(const double a[4], const double b[4], const double p[3], double best, double nearest[4]) {
  const double axis[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, d[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
  const double square = qmr_dot(axis, axis), slope = b[3] - a[3];
  if (!(square > slope * slope)) return qmr_sphere(b, p, qmr_sphere(a, p, best, nearest), nearest);
  const double t = qmr_dot(d, axis) / square;
  const double w[3] = {d[0] - t * axis[0], d[1] - t * axis[1], d[2] - t * axis[2]};
  double x = t + sqrt(qmr_dot(w, w)) * slope / sqrt(square * (square - slope * slope));
  x = x > 0 ? x < 1 ? x : 1 : 0;
  double sphere[4];
  for (int k = 0; k < 4; k++) sphere[k] = a[k] + x * (b[k] - a[k]);
  return qmr_sphere(sphere, p, best, nearest);
}

/* The same for the convex hull of three spheres. */
static inline double qmr_slab(const double a[4], const double b[4], const double c[4], const double p[3], double best,
                              double nearest[4]) {
  double u[4], v[4], d[3];
  for (int k = 0; k < 4; k++) u[k] = b[k] - a[k];
  for (int k = 0; k < 4; k++) v[k] = c[k] - a[k];
  for (int k = 0; k < 3; k++) d[k] = p[k] - a[k];
  const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double uu = qmr_dot(u, u), uv = qmr_dot(u, v), vv = qmr_dot(v, v), area = qmr_dot(n, n);
  if (area > 1e-20 * uu * vv) {
    /* The gradient of the radius over the plane is i u + j v. Where it is below 1 there are two tangent planes. */
    const double i = (vv * u[3] - uv * v[3]) / area, j = (uu * v[3] - uv * u[3]) / area;
    const double steep = 1 - (i * u[3] + j * v[3]);
    if (steep > 0) {
      const double lean = fabs(qmr_dot(d, n)) / sqrt(area * steep), du = qmr_dot(d, u), dv = qmr_dot(d, v);
      const double x = (vv * du - uv * dv) / area + i * lean, y = (uu * dv - uv * du) / area + j * lean;
      if (x >= 0 && y >= 0 && x + y <= 1) {
        double sphere[4];
        for (int k = 0; k < 4; k++) sphere[k] = a[k] + x * u[k] + y * v[k];
        return qmr_sphere(sphere, p, best, nearest);
      }
    }
  }
  best = qmr_cone(a, b, p, best, nearest);
  best = qmr_cone(b, c, p, best, nearest);
  return qmr_cone(a, c, p, best, nearest);
}

/* One simplex: the slabs come first, then the cones, then the points. */
static inline double qmr_simplex(const qmr_medial *m, size_t index, const double p[3], double best, double nearest[4]) {
  if (index < m->slab_count) {
    const uint32_t *id = m->slabs + 3 * index;
    return qmr_slab(m->spheres + (size_t)4 * id[0], m->spheres + (size_t)4 * id[1], m->spheres + (size_t)4 * id[2], p,
                    best, nearest);
  }
  index -= m->slab_count;
  if (index < m->cone_count) {
    const uint32_t *id = m->cones + 2 * index;
    return qmr_cone(m->spheres + (size_t)4 * id[0], m->spheres + (size_t)4 * id[1], p, best, nearest);
  }
  return qmr_sphere(m->spheres + (size_t)4 * m->points[index - m->cone_count], p, best, nearest);
}

static inline size_t qmr_simplex_count(const qmr_medial *m) {
  return (size_t)m->slab_count + m->cone_count + m->point_count;
}

/* The unit vector from the sphere's centre to p, the gradient of the distance. */
static inline void qmr_normal(const double sphere[4], const double p[3], double normal[3]) {
  double length = 0;
  for (int k = 0; k < 3; k++) normal[k] = p[k] - sphere[k];
  length = sqrt(qmr_dot(normal, normal));
  for (int k = 0; k < 3; k++) normal[k] = length > 0 ? normal[k] / length : k == 2;
}

/* The signed distance: outside exact; inside below 0, and the solid is at least as deep. INFINITY: no simplex.
 * `closest` (may be NULL) gets the point of the envelope nearest to an outside point; of an inside point, one at that
 * depth. */
static inline double qmr_distance(const qmr_medial *medial, const double p[3], double closest[3]) {
  double best = (double)INFINITY, nearest[4] = {0, 0, 0, 0}, normal[3];
  for (size_t i = 0; i < qmr_simplex_count(medial); i++) best = qmr_simplex(medial, i, p, best, nearest);
  if (closest) {
    qmr_normal(nearest, p, normal);
    for (int k = 0; k < 3; k++) closest[k] = nearest[k] + nearest[3] * normal[k];
  }
  return best;
}

/* The support function of the solid's convex hull: the largest product of a point of it and `direction`. `point` (may
 * be NULL) gets that point. For one simplex alone make a medial mesh of one simplex. */
static inline double qmr_support(const qmr_medial *medial, const double direction[3], double point[3]) {
  const double length = sqrt(qmr_dot(direction, direction));
  double best = -(double)INFINITY;
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double *sphere = medial->spheres + 4 * i, reach = qmr_dot(sphere, direction) + sphere[3] * length;
    if (!(reach > best)) continue;
    best = reach;
    for (int k = 0; point && k < 3; k++) point[k] = sphere[k] + (length > 0 ? sphere[3] * direction[k] / length : 0);
  }
  return best;
}

/* How far along the unit vector `direction` a ray meets the solid, 0 from within; -1: not within `most`. `normal` (may
 * be NULL) gets the outward normal there. Newton's steps on the convex distance to a simplex never step over its
 * surface. */
static inline double qmr_ray(const qmr_medial *medial, const double origin[3], const double direction[3], double most,
                             double normal[3]) {
  double hit = -1;
  const double size = sqrt(qmr_dot(origin, origin)) + 1e-300;
  for (size_t i = 0; i < qmr_simplex_count(medial); i++) {
    double t = 0, slope = -1, before[3] = {0, 0, 0};
    for (int step = 0; step < 100 && slope < 0 && t <= most; step++) {
      const double p[3] = {origin[0] + t * direction[0], origin[1] + t * direction[1], origin[2] + t * direction[2]};
      double nearest[4] = {0, 0, 0, 0}, gradient[3];
      const double distance = qmr_simplex(medial, i, p, (double)INFINITY, nearest);
      qmr_normal(nearest, p, gradient);
      if (distance <= 1e-14 * (size + t)) {
        most = hit = t;
        /* On a sphere of no radius rounding decides the gradient: that of the step before is taken. */
        const int is_thin = step > 0 && nearest[3] <= 1e-9 * (size + t);
        if (normal) memcpy(normal, is_thin ? before : gradient, sizeof before);
        break;
      }
      memcpy(before, gradient, sizeof before);
      slope = qmr_dot(gradient, direction);
      t -= distance / slope;
    }
  }
  return hit;
}

#endif
