/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_SHAPES_H
#define QMAT_TESTS_SHAPES_H

/* Meshes for tests. Each starts as an unsealed mesh that grows; shape_seal finds out whether it is closed and oriented
 * and seals it. Triangles run counter-clockwise as seen from outside. Include after cmocka. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/value.h"

/* cmocka's own comparison is in single precision. */
#define assert_near(actual, expected, tolerance) shape_near(actual, expected, tolerance, #actual, __FILE__, __LINE__)

static inline void shape_near(double actual, double expected, double tolerance, const char *what, const char *file,
                              int line) {
  if (fabs(actual - expected) <= tolerance || actual == expected) return;
  print_error("%s is %.17g, not %.17g\n", what, actual, expected);
  _fail(file, line);
}

/* A copy of an array, to be freed with qmat_free. */
static inline void *shape_copy(const void *array, size_t bytes) {
  void *copy = qmat_alloc(bytes, 1);
  assert_non_null(copy);
  if (bytes > 0) memcpy(copy, array, bytes);
  return copy;
}

static inline uint32_t shape_vertex(qmat_mesh *mesh, double x, double y, double z) {
  double *grown = qmat_alloc(3 * (mesh->vertex_count + 1), sizeof *grown);
  assert_non_null(grown);
  if (mesh->vertex_count > 0) memcpy(grown, mesh->positions, 3 * mesh->vertex_count * sizeof *grown);
  qmat_free(mesh->positions);
  mesh->positions = grown;
  double *p = grown + 3 * mesh->vertex_count;
  p[0] = x, p[1] = y, p[2] = z;
  return (uint32_t)mesh->vertex_count++;
}

static inline void shape_triangle(qmat_mesh *mesh, uint32_t a, uint32_t b, uint32_t c) {
  uint32_t *grown = qmat_alloc(3 * (mesh->triangle_count + 1), sizeof *grown);
  assert_non_null(grown);
  if (mesh->triangle_count > 0) memcpy(grown, mesh->triangles, 3 * mesh->triangle_count * sizeof *grown);
  qmat_free(mesh->triangles);
  mesh->triangles = grown;
  uint32_t *t = grown + 3 * mesh->triangle_count++;
  t[0] = a, t[1] = b, t[2] = c;
}

static inline void shape_quad(qmat_mesh *mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  shape_triangle(mesh, a, b, c);
  shape_triangle(mesh, a, c, d);
}

static inline qmat_mesh *shape_new(void) {
  qmat_mesh *mesh = qmat_mesh_new();
  assert_non_null(mesh);
  return mesh;
}

/* An axis-aligned box, two triangles a side. `inward` turns it inside out. */
static inline void shape_add_box(qmat_mesh *mesh, double x0, double y0, double z0, double x1, double y1, double z1,
                                 bool inward) {
  uint32_t v[8];
  for (int i = 0; i < 8; i++) v[i] = shape_vertex(mesh, i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0);
  static const int sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (int s = 0; s < 6; s++) {
    const int *q = sides[s];
    if (inward) {
      shape_quad(mesh, v[q[3]], v[q[2]], v[q[1]], v[q[0]]);
    } else {
      shape_quad(mesh, v[q[0]], v[q[1]], v[q[2]], v[q[3]]);
    }
  }
}

static inline qmat_mesh *shape_box(double x, double y, double z) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, x, y, z, false);
  return mesh;
}

/* An axis-aligned box around the origin, from (-x, -y, -z) to (x, y, z). */
static inline qmat_mesh *shape_box_around(double x, double y, double z) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, -x, -y, -z, x, y, z, false);
  return mesh;
}

/* An open box of 1 x 1 x `height` with walls of one thickness. */
static inline qmat_mesh *shape_tray(double height, double thickness) {
  qmat_mesh *mesh = shape_new();
  uint32_t v[16];
  for (int i = 0; i < 16; i++) {
    const double inset = i < 8 ? 0 : thickness, bottom = inset;
    v[i] = shape_vertex(mesh, i & 1 ? 1 - inset : inset, i & 2 ? 1 - inset : inset, i & 4 ? height : bottom);
  }
  static const int sides[5][4] = {{0, 2, 3, 1}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (int s = 0; s < 5; s++) {
    const int *q = sides[s];
    shape_quad(mesh, v[q[0]], v[q[1]], v[q[2]], v[q[3]]);
    shape_quad(mesh, v[8 + q[3]], v[8 + q[2]], v[8 + q[1]], v[8 + q[0]]);
  }
  static const int rim[4] = {4, 5, 7, 6};
  for (int i = 0; i < 4; i++) {
    const int a = rim[i], b = rim[(i + 1) % 4];
    shape_quad(mesh, v[a], v[b], v[8 + b], v[8 + a]);
  }
  return mesh;
}

/* A sphere of `rings` x 2 `rings` facets around the origin. */
static inline qmat_mesh *shape_sphere(double radius, uint32_t rings) {
  qmat_mesh *mesh = shape_new();
  const uint32_t around = 2 * rings;
  const double pi = 3.14159265358979323846;
  const uint32_t south = shape_vertex(mesh, 0, 0, -radius), north = shape_vertex(mesh, 0, 0, radius);
  for (uint32_t i = 1; i < rings; i++) {
    for (uint32_t j = 0; j < around; j++) {
      const double a = pi * i / rings, b = 2 * pi * j / around;
      shape_vertex(mesh, radius * sin(a) * cos(b), radius * sin(a) * sin(b), -radius * cos(a));
    }
  }
  for (uint32_t j = 0; j < around; j++) {
    const uint32_t k = (j + 1) % around, last = 2 + (rings - 2) * around;
    shape_triangle(mesh, south, 2 + k, 2 + j);
    shape_triangle(mesh, north, last + j, last + k);
    for (uint32_t i = 0; i + 2 < rings; i++) {
      const uint32_t low = 2 + i * around, high = low + around;
      shape_quad(mesh, low + j, low + k, high + k, high + j);
    }
  }
  return mesh;
}

/* Adds a sheet of `across` x `up` quads: place(u, v, point) with u and v from 0 to 1. Nothing may be added but
 * sheets afterwards. */
static inline void shape_add_sheet(qmat_mesh *mesh, uint32_t across, uint32_t up,
                                   void (*place)(double u, double v, double point[3])) {
  const uint32_t first = (uint32_t)mesh->vertex_count;
  for (uint32_t j = 0; j <= up; j++)
    for (uint32_t i = 0; i <= across; i++) {
      double p[3];
      place((double)i / across, (double)j / up, p);
      shape_vertex(mesh, p[0], p[1], p[2]);
    }
  for (uint32_t j = 0; j < up; j++)
    for (uint32_t i = 0; i < across; i++) {
      const uint32_t a = first + j * (across + 1) + i;
      shape_quad(mesh, a, a + 1, a + across + 2, a + across + 1);
    }
  mesh->sheet_triangle_count += 2 * (size_t)across * up;
}

/* A torus around the z axis. */
static inline qmat_mesh *shape_torus(double big, double small, uint32_t around, uint32_t across) {
  qmat_mesh *mesh = shape_new();
  const double pi = 3.14159265358979323846;
  for (uint32_t i = 0; i < around; i++) {
    for (uint32_t j = 0; j < across; j++) {
      const double a = 2 * pi * i / around, b = 2 * pi * j / across;
      shape_vertex(mesh, (big + small * cos(b)) * cos(a), (big + small * cos(b)) * sin(a), small * sin(b));
    }
  }
  for (uint32_t i = 0; i < around; i++) {
    for (uint32_t j = 0; j < across; j++) {
      const uint32_t k = (i + 1) % around, l = (j + 1) % across;
      shape_quad(mesh, i * across + j, k * across + j, k * across + l, i * across + l);
    }
  }
  return mesh;
}

/* Rings of points at the heights -1, 0 and 1, and two apexes: a capsule whose upper half of vertices lies on a sphere
 * around (0, 0, 1/2), as does the lower half around (0, 0, -1/2). */
static inline qmat_mesh *shape_two_balls(uint32_t around) {
  qmat_mesh *mesh = shape_new();
  const double pi = 3.14159265358979323846;
  shape_vertex(mesh, 0, 0, -0.5 - sqrt(1.25));
  for (int level = -1; level <= 1; level++)
    for (uint32_t i = 0; i < around; i++) shape_vertex(mesh, cos(2 * pi * i / around), sin(2 * pi * i / around), level);
  shape_vertex(mesh, 0, 0, 0.5 + sqrt(1.25));
  for (uint32_t i = 0; i < around; i++) {
    const uint32_t a = 1 + i, b = 1 + (i + 1) % around;
    shape_triangle(mesh, b, a, 0);
    shape_quad(mesh, a, b, b + around, a + around);
    shape_quad(mesh, a + around, b + around, b + 2 * around, a + 2 * around);
    shape_triangle(mesh, a + 2 * around, b + 2 * around, 1 + 3 * around);
  }
  return mesh;
}

/* The L of [0,2]x[0,2] without (1,2]x(1,2], one high. */
static inline qmat_mesh *shape_l(void) {
  static const double outline[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  qmat_mesh *mesh = shape_new();
  for (int level = 0; level < 2; level++) {
    for (int i = 0; i < 6; i++) shape_vertex(mesh, outline[i][0], outline[i][1], level);
  }
  for (uint32_t i = 0; i < 6; i++) {
    const uint32_t k = (i + 1) % 6;
    shape_quad(mesh, i, k, k + 6, i + 6);
  }
  static const uint32_t cap[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}};
  for (int i = 0; i < 4; i++) {
    shape_triangle(mesh, cap[i][2], cap[i][1], cap[i][0]);
    shape_triangle(mesh, cap[i][0] + 6, cap[i][1] + 6, cap[i][2] + 6);
  }
  return mesh;
}

/* A prism of a regular polygon in the unit circle, from z = 0 up. */
static inline qmat_mesh *shape_prism(uint32_t sides, double height) {
  qmat_mesh *mesh = shape_new();
  for (int level = 0; level < 2; level++)
    for (uint32_t i = 0; i < sides; i++) {
      const double a = 2 * 3.14159265358979323846 * i / sides;
      shape_vertex(mesh, cos(a), sin(a), level * height);
    }
  for (uint32_t i = 0; i < sides; i++) {
    const uint32_t k = (i + 1) % sides;
    shape_quad(mesh, i, k, k + sides, i + sides);
  }
  for (uint32_t i = 1; i + 1 < sides; i++) {
    shape_triangle(mesh, 0, i + 1, i);
    shape_triangle(mesh, sides, sides + i, sides + i + 1);
  }
  return mesh;
}

/* p -> scale * p + shift, in place. */
static inline void shape_map(qmat_mesh *mesh, double scale, double x, double y, double z) {
  for (size_t i = 0; i < mesh->vertex_count; i++) {
    double *p = mesh->positions + 3 * i;
    p[0] = scale * p[0] + x, p[1] = scale * p[1] + y, p[2] = scale * p[2] + z;
  }
}

/* Turned by 0.7 around the axis (1, 2, 3) / sqrt(14), in place. */
static inline void shape_rotate(qmat_mesh *mesh) {
  const double n = 1 / sqrt(14.0), axis[3] = {n, 2 * n, 3 * n}, c = cos(0.7), s = sin(0.7);
  for (size_t i = 0; i < mesh->vertex_count; i++) {
    double *p = mesh->positions + 3 * i;
    const double along = (axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2]) * (1 - c);
    const double turned[3] = {c * p[0] + s * (axis[1] * p[2] - axis[2] * p[1]) + along * axis[0],
                              c * p[1] + s * (axis[2] * p[0] - axis[0] * p[2]) + along * axis[1],
                              c * p[2] + s * (axis[0] * p[1] - axis[1] * p[0]) + along * axis[2]};
    memcpy(p, turned, sizeof turned);
  }
}

typedef struct shape_edge {
  uint32_t low, high;
  int side;
} shape_edge;

static inline int shape_compare_edges(const void *left, const void *right) {
  const shape_edge *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  return a->high < b->high ? -1 : a->high > b->high;
}

/* Sets closed and oriented by looking at every edge of the solids, and seals. */
static inline qmat_mesh *shape_seal(qmat_mesh *mesh) {
  const size_t count = 3 * (mesh->triangle_count - mesh->sheet_triangle_count);
  shape_edge *edges = calloc(count + 1, sizeof *edges);
  assert_non_null(edges);
  for (size_t i = 0; i < count; i++) {
    const uint32_t a = mesh->triangles[i], b = mesh->triangles[i % 3 == 2 ? i - 2 : i + 1];
    edges[i] = a < b ? (shape_edge){a, b, 1} : (shape_edge){b, a, -1};
  }
  qsort(edges, count, sizeof *edges, shape_compare_edges);
  mesh->closed = mesh->oriented = true;
  for (size_t i = 0; i < count;) {
    size_t end = i;
    int balance = 0;
    for (; end < count && shape_compare_edges(edges + i, edges + end) == 0; end++) balance += edges[end].side;
    if ((end - i) % 2 != 0) mesh->closed = false;
    if (end - i > 1 && balance != 0) mesh->oriented = false;
    i = end;
  }
  free(edges);
  qmat_context context = {0};
  assert_int_equal(qmat_value_seal(&context, &mesh->base), QMAT_OK);
  qmat_context_uninit(&context);
  return mesh;
}

/* Adds a copy of another mesh, moved. */
static inline void shape_add_copy(qmat_mesh *mesh, const qmat_mesh *other, double x, double y, double z) {
  const uint32_t first = (uint32_t)mesh->vertex_count;
  for (size_t v = 0; v < other->vertex_count; v++) {
    const double *p = other->positions + 3 * v;
    shape_vertex(mesh, p[0] + x, p[1] + y, p[2] + z);
  }
  for (size_t t = 0; t < other->triangle_count; t++) {
    const uint32_t *ids = other->triangles + 3 * t;
    shape_triangle(mesh, first + ids[0], first + ids[1], first + ids[2]);
  }
}

/* A sealed square plate of size 10 and thickness 1 around the origin with a square hole through its middle. Corner k of
 * ring i (outer below, inner below, outer above, inner above) is vertex 4 i + k, counted around the hole. */
static inline qmat_mesh *shape_frame(double hole) {
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < 4; i++) {
    const double size = i % 2 ? hole / 2 : 5, z = i < 2 ? -0.5 : 0.5;
    for (int k = 0; k < 4; k++) shape_vertex(mesh, k == 0 || k == 3 ? -size : size, k < 2 ? -size : size, z);
  }
  for (uint32_t k = 0; k < 4; k++) {
    const uint32_t n = (k + 1) % 4;
    shape_quad(mesh, k, 4 + k, 4 + n, n);
    shape_quad(mesh, 8 + k, 8 + n, 12 + n, 12 + k);
    shape_quad(mesh, k, n, 8 + n, 8 + k);
    shape_quad(mesh, 4 + k, 12 + k, 12 + n, 4 + n);
  }
  shape_seal(mesh);
  return mesh;
}

#endif
