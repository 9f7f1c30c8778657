/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/surface.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/geometry/thickness.h"
#include "core/hash.h"
#include "tests/shapes.h"

static double uniform(uint64_t stream, uint64_t index, double low, double high) {
  return low + (high - low) * qmat_hash_unit(qmat_hash3(7, stream, index));
}

static qmat_surface *surface_of(qmat_mesh *mesh) {
  qmat_context context = {0};
  qmat_surface *surface = NULL;
  if (qmat_surface_new(&context, mesh, &surface) != QMAT_OK) fail_msg("%s", context.error.message);
  qmat_context_uninit(&context);
  return surface;
}

static void release(qmat_surface *surface) {
  qmat_mesh *mesh = (qmat_mesh *)qmat_surface_mesh(surface);
  qmat_surface_free(surface);
  qmat_value_release(&mesh->base);
}

/* --- brute force, by other ways than the code's ------------------------------------------------------------------- */

static double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The distance to the triangle by minimising over its barycentric coordinates (Ericson 2005, section 5.1.5). */
static double distance_to_triangle(const double a[3], const double b[3], const double c[3], const double p[3]) {
  double ab[3], ac[3], ap[3], bp[3], cp[3], q[3];
  for (int k = 0; k < 3; k++) {
    ab[k] = b[k] - a[k], ac[k] = c[k] - a[k], ap[k] = p[k] - a[k], bp[k] = p[k] - b[k], cp[k] = p[k] - c[k];
  }
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
               d6 = dot(ac, cp);
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  double v, w;
  if (d1 <= 0 && d2 <= 0) {
    v = 0, w = 0;
  } else if (d3 >= 0 && d4 <= d3) {
    v = 1, w = 0;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    v = d1 / (d1 - d3), w = 0;
  } else if (d6 >= 0 && d5 <= d6) {
    v = 0, w = 1;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    v = 0, w = d2 / (d2 - d6);
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    w = (d4 - d3) / ((d4 - d3) + (d5 - d6)), v = 1 - w;
  } else {
    v = vb / (va + vb + vc), w = vc / (va + vb + vc);
  }
  for (int k = 0; k < 3; k++) q[k] = p[k] - a[k] - v * ab[k] - w * ac[k];
  return sqrt(dot(q, q));
}

static const double *corner(const qmat_surface *surface, size_t t, int k) {
  return qmat_surface_positions(surface) + 3 * (size_t)qmat_surface_mesh(surface)->triangles[3 * t + (size_t)k];
}

static double brute_distance(const qmat_surface *surface, const double p[3]) {
  double best = INFINITY;
  for (size_t t = 0; t < qmat_surface_mesh(surface)->triangle_count; t++) {
    best = fmin(best, distance_to_triangle(corner(surface, t, 0), corner(surface, t, 1), corner(surface, t, 2), p));
  }
  return best;
}

/* The winding number by all solid angles in extended precision. */
static double brute_winding(const qmat_surface *surface, const double p[3]) {
  long double sum = 0;
  for (size_t t = 0; t < qmat_surface_mesh(surface)->triangle_count; t++) {
    long double r[3][3], l[3], d[3];
    for (int i = 0; i < 3; i++) {
      l[i] = 0;
      for (int k = 0; k < 3; k++) {
        r[i][k] = (long double)corner(surface, t, i)[k] - p[k];
        l[i] += r[i][k] * r[i][k];
      }
      l[i] = sqrtl(l[i]);
    }
    for (int i = 0; i < 3; i++) {
      const int j = (i + 1) % 3;
      d[i] = r[i][0] * r[j][0] + r[i][1] * r[j][1] + r[i][2] * r[j][2];
    }
    const long double y = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) +
                          r[0][1] * (r[1][2] * r[2][0] - r[1][0] * r[2][2]) +
                          r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
    sum += 2 * atan2l(y, l[0] * l[1] * l[2] + d[0] * l[2] + d[1] * l[0] + d[2] * l[1]);
  }
  return (double)(sum / (4 * 3.14159265358979323846264L));
}

/* The nearest hit beyond start by Cramer's rule over all triangles; INFINITY when none. */
static double brute_cast(const qmat_surface *surface, const double o[3], const double d[3], double start,
                         double *clearance) {
  double best = INFINITY;
  *clearance = INFINITY; /* how far the ray stays from every edge, in barycentrics of the triangles it may cross */
  for (size_t t = 0; t < qmat_surface_mesh(surface)->triangle_count; t++) {
    double e[3], f[3], s[3];
    for (int k = 0; k < 3; k++) {
      e[k] = corner(surface, t, 1)[k] - corner(surface, t, 0)[k];
      f[k] = corner(surface, t, 2)[k] - corner(surface, t, 0)[k];
      s[k] = o[k] - corner(surface, t, 0)[k];
    }
    const double h[3] = {d[1] * f[2] - d[2] * f[1], d[2] * f[0] - d[0] * f[2], d[0] * f[1] - d[1] * f[0]};
    const double g[3] = {s[1] * e[2] - s[2] * e[1], s[2] * e[0] - s[0] * e[2], s[0] * e[1] - s[1] * e[0]};
    const double determinant = dot(e, h);
    if (determinant == 0) continue;
    const double u = dot(s, h) / determinant, v = dot(d, g) / determinant, z = dot(f, g) / determinant;
    const double least = fmin(fmin(u, v), 1 - u - v);
    if (z > start) *clearance = fmin(*clearance, fabs(least));
    if (least >= 0 && z > start) best = fmin(best, z);
  }
  return best;
}

/* --- properties of any surface ------------------------------------------------------------------------------------ */

static void check_against_brute_force(qmat_mesh *mesh, size_t count) {
  qmat_surface *surface = surface_of(mesh);
  const bool closed = mesh->closed && mesh->oriented;
  double *points = calloc(3 * count, sizeof *points);
  uint8_t *many = calloc(count, 1);
  assert_non_null(points);
  assert_non_null(many);
  for (size_t i = 0; i < 3 * count; i++) points[i] = uniform(1, i, -0.6, 0.6);
  qmat_surface_inside_many(surface, points, count, many, 2);
  size_t inside_count = 0;
  for (size_t i = 0; i < count; i++) {
    const double *p = points + 3 * i;
    double closest[3];
    uint32_t triangle;
    const double expected = brute_distance(surface, p);
    const double distance = qmat_surface_distance(surface, p, INFINITY, closest, &triangle);
    assert_near(distance, expected, 1e-13);
    double offset[3];
    for (int k = 0; k < 3; k++) offset[k] = p[k] - closest[k];
    assert_near(sqrt(dot(offset, offset)), distance, 1e-13);
    assert_true(distance_to_triangle(corner(surface, triangle, 0), corner(surface, triangle, 1),
                                     corner(surface, triangle, 2), closest) < 1e-13);
    const uint32_t other = (uint32_t)(i % mesh->triangle_count);
    assert_near(
        qmat_surface_distance_to_triangle(surface, p, other),
        distance_to_triangle(corner(surface, other, 0), corner(surface, other, 1), corner(surface, other, 2), p),
        1e-13);
    /* The limit cuts exactly. */
    assert_near(qmat_surface_distance(surface, p, distance, NULL, NULL), distance, 0);
    assert_true(isinf(qmat_surface_distance(surface, p, distance * (1 - 1e-9), NULL, NULL)));

    const double winding = brute_winding(surface, p);
    const bool inside = qmat_surface_inside(surface, p);
    assert_int_equal(many[i], inside);
    bool boxed = true;
    double low[3] = {1, 1, 1}, high[3] = {-1, -1, -1};
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      for (int c = 0; c < 3; c++) {
        for (int k = 0; k < 3; k++) {
          low[k] = fmin(low[k], corner(surface, t, c)[k]);
          high[k] = fmax(high[k], corner(surface, t, c)[k]);
        }
      }
    }
    for (int k = 0; k < 3; k++) boxed &= p[k] >= low[k] && p[k] <= high[k];
    /* The dipoles are an approximation: only what they can decide. */
    if (closed ? expected > 1e-7 : fabs(winding - 0.5) > 0.02) assert_int_equal(inside, boxed && winding > 0.5);
    assert_near(qmat_surface_signed_distance(surface, p), inside ? -distance : distance, 0);
    assert_near(qmat_surface_signed_distance_within(surface, p, distance), inside ? -distance : distance, 0);
    assert_true(isinf(qmat_surface_signed_distance_within(surface, p, distance * (1 - 1e-9))));
    inside_count += inside;
  }
  assert_true(inside_count > 0 && inside_count < count);

  size_t hits = 0, misses = 0;
  for (size_t i = 0; i < count; i++) {
    double direction[3], clearance;
    for (int k = 0; k < 3; k++) direction[k] = uniform(2, 3 * i + (size_t)k, -1, 1);
    const double length = sqrt(dot(direction, direction));
    for (int k = 0; k < 3; k++) direction[k] /= length;
    const double *p = points + 3 * i, start = i % 2 == 0 ? 0 : 0.25;
    const double expected = brute_cast(surface, p, direction, start, &clearance);
    if (clearance < 1e-4) continue;
    double distance, normal[3];
    uint32_t triangle;
    const bool hit = qmat_surface_cast(surface, p, direction, start, INFINITY, &distance, &triangle, normal);
    assert_int_equal(hit, isfinite(expected));
    hits += hit;
    misses += !hit;
    if (!hit) continue;
    assert_near(distance, expected, 1e-12);
    assert_near(dot(normal, normal), 1, 1e-12);
    double near;
    assert_true(qmat_surface_cast(surface, p, direction, start, distance, &near, NULL, NULL));
    assert_near(near, distance, 0);
    assert_false(qmat_surface_cast(surface, p, direction, start, distance * (1 - 1e-9), &near, NULL, NULL));
    double q[3];
    for (int k = 0; k < 3; k++) q[k] = p[k] + distance * direction[k];
    assert_true(distance_to_triangle(corner(surface, triangle, 0), corner(surface, triangle, 1),
                                     corner(surface, triangle, 2), q) < 1e-12);
  }
  assert_true(hits > 0 && misses > 0);
  free(points);
  free(many);
  release(surface);
}

static qmat_mesh *nested_shell(void) {
  qmat_mesh *mesh = shape_box(3, 3, 3);
  shape_add_box(mesh, 1, 1, 1, 2, 2, 2, true);
  return shape_seal(mesh);
}

static qmat_mesh *cup(void) {
  qmat_mesh *mesh = shape_sphere(1, 24);
  /* Without the triangles around the north pole. */
  size_t kept = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    double z = 0;
    for (int k = 0; k < 3; k++) z += mesh->positions[3 * mesh->triangles[3 * t + (size_t)k] + 2] / 3;
    if (z > 0.8) continue;
    memmove(mesh->triangles + 3 * kept++, mesh->triangles + 3 * t, 3 * sizeof *mesh->triangles);
  }
  mesh->triangle_count = kept;
  return shape_seal(mesh);
}

static void test_box_agrees_with_brute_force(void **state) {
  (void)state;
  check_against_brute_force(shape_seal(shape_box(1, 2, 3)), 2000);
}

static void test_sphere_agrees_with_brute_force(void **state) {
  (void)state;
  check_against_brute_force(shape_seal(shape_sphere(1, 16)), 1000);
}

static void test_l_shape_agrees_with_brute_force(void **state) {
  (void)state;
  check_against_brute_force(shape_seal(shape_l()), 2000);
}

static void test_torus_agrees_with_brute_force(void **state) {
  (void)state;
  check_against_brute_force(shape_seal(shape_torus(1, 0.3, 40, 20)), 1000);
}

static void test_nested_shell_agrees_with_brute_force(void **state) {
  (void)state;
  check_against_brute_force(nested_shell(), 2000);
}

static void test_overlapping_boxes_agree_with_brute_force(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(2, 2, 2);
  shape_add_box(mesh, 1, 1, 1, 3, 3, 3, false);
  check_against_brute_force(shape_seal(mesh), 2000);
}

static void test_open_cup_agrees_with_the_winding_number(void **state) {
  (void)state;
  qmat_mesh *mesh = cup();
  assert_false(mesh->closed);
  check_against_brute_force(mesh, 1000);
}

static void test_sphere_without_an_octant_agrees_with_the_winding_number(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 24);
  size_t kept = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    bool octant = true;
    for (size_t k = 0; k < 9; k++) octant &= mesh->positions[3 * mesh->triangles[3 * t + k / 3] + k % 3] > -1e-9;
    if (!octant) memmove(mesh->triangles + 3 * kept++, mesh->triangles + 3 * t, 3 * sizeof *mesh->triangles);
  }
  mesh->triangle_count = kept;
  check_against_brute_force(shape_seal(mesh), 2000);
}

static void test_flipped_triangle_agrees_with_the_winding_number(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 20);
  uint32_t *t = mesh->triangles + 300;
  const uint32_t kept = t[0];
  t[0] = t[1], t[1] = kept;
  shape_seal(mesh);
  assert_false(mesh->oriented);
  check_against_brute_force(mesh, 1000);
}

static void test_degenerate_triangles_change_nothing(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 2, 3);
  shape_triangle(mesh, 0, 0, 0);
  shape_triangle(mesh, 1, 2, 1);
  const uint32_t middle = shape_vertex(mesh, 0.5, 1, 1.5), between = shape_vertex(mesh, 0.625, 1, 1.5),
                 end = shape_vertex(mesh, 0.75, 1, 1.5);
  shape_seal(mesh);
  /* A box that was found closed and oriented, with a needle in its middle that encloses nothing. */
  mesh->closed = mesh->oriented = true;
  qmat_mesh *needle = shape_box(1, 2, 3);
  for (int i = 0; i < 3; i++) shape_vertex(needle, 0.5 + 0.125 * i, 1, 1.5);
  shape_triangle(needle, middle, end, between);
  shape_seal(needle);
  qmat_surface *a = surface_of(mesh), *b = surface_of(needle);
  for (size_t i = 0; i < 1000; i++) {
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = uniform(3, 3 * i + (size_t)k, -0.5, 0.5);
    assert_near(qmat_surface_distance(a, p, INFINITY, NULL, NULL), brute_distance(a, p), 1e-13);
    assert_int_equal(qmat_surface_inside(a, p), brute_winding(a, p) > 0.5);
    assert_int_equal(qmat_surface_inside(b, p), brute_winding(a, p) > 0.5);
  }
  /* The needle is a piece of surface to measure distances to. */
  const double *tip = qmat_surface_positions(b) + 3 * (size_t)end;
  const double beyond[3] = {tip[0] + 0.01, tip[1], tip[2]};
  double closest[3];
  uint32_t triangle;
  assert_near(qmat_surface_distance(b, beyond, INFINITY, closest, &triangle), 0.01, 1e-15);
  assert_int_equal(triangle, 12);
  assert_memory_equal(closest, tip, sizeof closest);
  release(a);
  release(b);
}

/* Brute force for triangles whose planes cannot be trusted where they are thin: their sides alone then. */
static double brute_distance_to_needles(const qmat_surface *surface, const double p[3], double thin) {
  double best = INFINITY;
  for (size_t t = 0; t < qmat_surface_mesh(surface)->triangle_count; t++) {
    const double *corners[3] = {corner(surface, t, 0), corner(surface, t, 1), corner(surface, t, 2)};
    double longest = 0, least = INFINITY;
    for (int k = 0; k < 3; k++) {
      const double *a = corners[k], *b = corners[(k + 1) % 3];
      longest = fmax(longest, distance_to_triangle(a, a, a, b));
      least = fmin(least, distance_to_triangle(a, b, b, corners[(k + 2) % 3]));
      best = fmin(best, distance_to_triangle(a, b, b, p));
    }
    if (least > thin * longest) best = fmin(best, distance_to_triangle(corners[0], corners[1], corners[2], p));
  }
  return best;
}

/* Needles have planes that rounding turns; beside them lie triangles a thousand times smaller. */
static void test_needles_and_specks_agree_with_brute_force(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 1, 1);
  for (uint64_t i = 0; i < 600; i++) {
    const double length = i % 3 == 0 ? 1e-3 : 0.5, width = i % 3 == 1 ? pow(10, uniform(41, i, -17, -2)) : 1e-3;
    uint32_t ids[3];
    double at[3], along[3], across[3];
    for (uint64_t k = 0; k < 3; k++) {
      at[k] = uniform(42, 3 * i + k, 0.2, 0.8);
      along[k] = length * uniform(43, 3 * i + k, -0.5, 0.5);
      across[k] = width * uniform(44, 3 * i + k, -0.5, 0.5);
    }
    ids[0] = shape_vertex(mesh, at[0], at[1], at[2]);
    ids[1] = shape_vertex(mesh, at[0] + along[0], at[1] + along[1], at[2] + along[2]);
    const double share = uniform(45, i, 0, 1);
    ids[2] = shape_vertex(mesh, at[0] + share * along[0] + across[0], at[1] + share * along[1] + across[1],
                          at[2] + share * along[2] + across[2]);
    shape_triangle(mesh, ids[0], ids[1], ids[2]);
  }
  qmat_surface *surface = surface_of(shape_seal(mesh));
  for (uint64_t i = 0; i < 3000; i++) {
    double p[3];
    const double *tip = corner(surface, i % mesh->triangle_count, 1);
    for (uint64_t k = 0; k < 3; k++)
      p[k] = i % 2 == 0 ? uniform(46, 3 * i + k, -0.6, 0.6) : tip[k] + uniform(46, 3 * i + k, -0.01, 0.01);
    assert_near(qmat_surface_distance(surface, p, INFINITY, NULL, NULL), brute_distance_to_needles(surface, p, 1e-7),
                1e-7);
  }
  release(surface);
}

/* --- points on the surface, ties, far away ------------------------------------------------------------------------ */

static void test_points_on_vertices_edges_and_faces_have_distance_zero(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_torus(1, 0.3, 30, 15));
  qmat_surface *surface = surface_of(mesh);
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const double *a = corner(surface, t, 0), *b = corner(surface, t, 1), *c = corner(surface, t, 2);
    double edge[3], face[3];
    for (int k = 0; k < 3; k++) edge[k] = 0.5 * (a[k] + b[k]), face[k] = 0.25 * a[k] + 0.25 * b[k] + 0.5 * c[k];
    uint32_t triangle;
    assert_near(qmat_surface_distance(surface, a, INFINITY, NULL, NULL), 0, 0);
    assert_true(qmat_surface_distance(surface, edge, INFINITY, NULL, NULL) < 1e-16);
    assert_true(qmat_surface_distance(surface, face, INFINITY, NULL, &triangle) < 1e-16);
    assert_true(distance_to_triangle(corner(surface, triangle, 0), corner(surface, triangle, 1),
                                     corner(surface, triangle, 2), face) < 1e-16);
    (void)qmat_surface_inside(surface, a);
  }
  release(surface);
}

static void test_equally_close_triangles_give_the_smallest(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_seal(shape_box(2, 2, 2));
  qmat_surface *surface = surface_of(mesh);
  for (uint32_t v = 0; v < 8; v++) {
    const double *vertex = qmat_surface_positions(surface) + 3 * (size_t)v;
    const double outer[3] = {2 * vertex[0], 2 * vertex[1], 2 * vertex[2]};
    uint32_t smallest = 0, triangle;
    double closest[3];
    while (mesh->triangles[3 * smallest] != v && mesh->triangles[3 * smallest + 1] != v &&
           mesh->triangles[3 * smallest + 2] != v) {
      smallest++;
    }
    assert_near(qmat_surface_distance(surface, outer, INFINITY, closest, &triangle), 0.5, 1e-15);
    assert_int_equal(triangle, smallest);
    assert_memory_equal(closest, vertex, sizeof closest);
  }
  /* A ray along a diagonal of a face's two triangles, and one into a vertex where six meet. */
  const double centre[3] = {0, 0, 0}, up[3] = {0, 0, 1}, s = sqrt(1.0 / 3), diagonal[3] = {s, s, s};
  uint32_t triangle;
  double distance;
  assert_true(qmat_surface_cast(surface, centre, up, 0, INFINITY, &distance, &triangle, NULL));
  assert_near(distance, s / 2, 1e-15);
  assert_int_equal(triangle, 2);
  assert_true(qmat_surface_cast(surface, centre, diagonal, 0, INFINITY, &distance, &triangle, NULL));
  assert_near(distance, 0.5, 1e-15);
  release(surface);
}

static void test_vertices_of_a_sphere_give_their_first_triangle(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_sphere(1, 30);
  /* In an order that has nothing to do with where they are. */
  for (size_t t = mesh->triangle_count; t-- > 1;) {
    uint32_t kept[3], *a = mesh->triangles + 3 * t, *b = mesh->triangles + 3 * (qmat_hash3(10, t, 0) % (t + 1));
    memcpy(kept, a, sizeof kept);
    memmove(a, b, sizeof kept);
    memcpy(b, kept, sizeof kept);
  }
  shape_rotate(mesh);
  shape_seal(mesh);
  qmat_surface *surface = surface_of(mesh);
  for (uint32_t v = 0; v < mesh->vertex_count; v++) {
    const double *vertex = qmat_surface_positions(surface) + 3 * (size_t)v;
    uint32_t first = 0, triangle;
    while (mesh->triangles[first] != v) first++;
    double outer[3], closest[3];
    for (int k = 0; k < 3; k++) outer[k] = 1.3 * vertex[k];
    qmat_surface_distance(surface, outer, INFINITY, closest, &triangle);
    assert_memory_equal(closest, vertex, sizeof closest);
    assert_int_equal(triangle, first / 3);
  }
  release(surface);
}

static void test_doubled_triangles_give_the_first_of_each_pair(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_torus(1, 0.3, 20, 10);
  const size_t count = mesh->triangle_count;
  for (size_t t = count; t-- > 0;) {
    const uint32_t *ids = mesh->triangles + 3 * t;
    shape_triangle(mesh, ids[0], ids[1], ids[2]);
  }
  shape_seal(mesh);
  qmat_surface *surface = surface_of(mesh);
  const double down[3] = {0, 0, -1};
  for (size_t i = 0; i < 500; i++) {
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = uniform(8, 3 * i + (size_t)k, -0.4, 0.4);
    uint32_t triangle;
    qmat_surface_distance(surface, p, INFINITY, NULL, &triangle);
    assert_true(triangle < count);
    if (qmat_surface_cast(surface, p, down, 0, INFINITY, NULL, &triangle, NULL)) assert_true(triangle < count);
  }
  release(surface);
}

static void test_both_triangles_of_an_edge_are_equally_far(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 2, 3);
  shape_rotate(mesh);
  shape_seal(mesh);
  qmat_surface *surface = surface_of(mesh);
  for (uint32_t t = 0; t < 12; t++) {
    for (int c = 0; c < 3; c++) {
      const uint32_t a = mesh->triangles[3 * t + (uint32_t)c], b = mesh->triangles[3 * t + (uint32_t)(c + 1) % 3];
      uint32_t first = 0;
      for (;; first++) {
        const uint32_t *ids = mesh->triangles + 3 * (size_t)first;
        if ((ids[0] == a || ids[1] == a || ids[2] == a) && (ids[0] == b || ids[1] == b || ids[2] == b)) break;
      }
      for (uint64_t i = 0; i < 20; i++) {
        /* Away from the centre, but less so along the edge than across it. */
        const double share = uniform(9, 20 * t + i, 0.4, 0.6);
        double p[3];
        for (int k = 0; k < 3; k++) {
          const double *positions = qmat_surface_positions(surface);
          p[k] = 1.05 *
                 ((1 - share) * positions[3 * (size_t)a + (size_t)k] + share * positions[3 * (size_t)b + (size_t)k]);
        }
        uint32_t triangle;
        qmat_surface_distance(surface, p, INFINITY, NULL, &triangle);
        /* Not the diagonals of the sides, above which the planes are what is near. */
        const uint32_t differing = a ^ b;
        if (differing == 1 || differing == 2 || differing == 4) assert_int_equal(triangle, first);
      }
    }
  }
  release(surface);
}

static void test_centre_of_a_box_is_inside_though_rays_meet_edges(void **state) {
  (void)state;
  qmat_surface *surface = surface_of(shape_seal(shape_box(1, 1, 1)));
  for (int i = 0; i < 1000; i++) {
    const double p[3] = {0.0005 * (i - 500), 0, 0};
    assert_true(qmat_surface_inside(surface, p));
  }
  release(surface);
}

static void test_far_points_are_outside_at_the_right_distance(void **state) {
  (void)state;
  qmat_surface *surface = surface_of(shape_seal(shape_l()));
  static const double lengths[] = {1, 10, 1e3, 9.9e3, 1.1e4, 1e8, 1e15, 1e100};
  for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
    for (uint64_t j = 0; j < 20; j++) {
      double p[3];
      for (uint64_t k = 0; k < 3; k++) p[k] = lengths[i] * uniform(4, 3 * j + k, 0.6, 1) * (j & (1u << k) ? 1 : -1);
      const double expected = brute_distance(surface, p);
      assert_true(fabs(qmat_surface_distance(surface, p, INFINITY, NULL, NULL) - expected) <= 1e-13 * expected);
      assert_true(isinf(qmat_surface_distance(surface, p, 0.5 * expected, NULL, NULL)));
      assert_false(qmat_surface_inside(surface, p));
    }
  }
  /* A ray from far away still hits what it aims at, and nothing behind it. */
  const double aim[3] = {-0.2, -0.2, 0};
  static const double far[] = {3, 1e3, 1e6};
  for (size_t i = 0; i < 3; i++) {
    const double origin[3] = {aim[0], aim[1], far[i]}, down[3] = {0, 0, -1}, up[3] = {0, 0, 1};
    double distance;
    assert_true(qmat_surface_cast(surface, origin, down, 0, INFINITY, &distance, NULL, NULL));
    assert_near(distance, far[i] - 1.0 / 6, 1e-15 * far[i]);
    assert_false(qmat_surface_cast(surface, origin, up, 0, INFINITY, &distance, NULL, NULL));
  }
  release(surface);
}

static void test_rays_from_the_surface_leave_their_own_triangle(void **state) {
  (void)state;
  /* A sheet a millionth of the diagonal thick. */
  const double thickness = 1e-6 * sqrt(2.0);
  qmat_mesh *mesh = shape_seal(shape_box(1, 1, thickness));
  qmat_surface *surface = surface_of(mesh);
  for (size_t t = 0; t < 4; t++) {
    double p[3], direction[3] = {0, 0, t < 2 ? 1 : -1}, distance, normal[3];
    for (int k = 0; k < 3; k++)
      p[k] = (corner(surface, t, 0)[k] + corner(surface, t, 1)[k] + corner(surface, t, 2)[k]) / 3;
    assert_true(qmat_surface_cast(surface, p, direction, 1e-9, INFINITY, &distance, NULL, normal));
    assert_near(distance, 1e-6, 1e-15);
    assert_near(normal[2], direction[2], 1e-15);
  }
  release(surface);
}

static void test_thread_count_does_not_change_an_answer(void **state) {
  (void)state;
  enum { COUNT = 2000 };
  static const int threads[] = {1, 2, 8};
  double *answers[3];
  qmat_mesh *mesh = shape_torus(1, 0.3, 120, 50);
  shape_rotate(mesh);
  shape_seal(mesh);
  for (size_t t = 0; t < 3; t++) {
    qmat_context context = {.threads = threads[t]};
    qmat_surface *surface = NULL;
    assert_int_equal(qmat_surface_new(&context, mesh, &surface), QMAT_OK);
    answers[t] = calloc(8 * COUNT, sizeof **answers);
    uint8_t *inside = calloc(COUNT, 1);
    double *points = calloc(3 * COUNT, sizeof *points);
    assert_true(answers[t] && inside && points);
    for (size_t i = 0; i < 3 * COUNT; i++) points[i] = uniform(6, i, -0.5, 0.5);
    qmat_surface_inside_many(surface, points, COUNT, inside, threads[t]);
    for (size_t i = 0; i < COUNT; i++) {
      double *answer = answers[t] + 8 * i, direction[3];
      uint32_t near, hit = 0;
      for (uint64_t k = 0; k < 3; k++) direction[k] = uniform(7, 3 * i + k, -1, 1);
      const double length = sqrt(dot(direction, direction));
      for (int k = 0; k < 3; k++) direction[k] /= length;
      answer[0] = qmat_surface_distance(surface, points + 3 * i, INFINITY, answer + 1, &near);
      answer[4] = near;
      qmat_surface_cast(surface, points + 3 * i, direction, 0, INFINITY, answer + 5, &hit, NULL);
      answer[6] = hit;
      answer[7] = inside[i];
    }
    free(inside);
    free(points);
    qmat_surface_free(surface);
    qmat_context_uninit(&context);
    if (t > 0) assert_memory_equal(answers[0], answers[t], 8 * COUNT * sizeof **answers);
  }
  for (size_t t = 0; t < 3; t++) free(answers[t]);
  qmat_value_release(&mesh->base);
}

/* --- frames ------------------------------------------------------------------------------------------------------- */

static void check_moved(double scale, double shift, double tolerance) {
  qmat_mesh *plain = shape_seal(shape_torus(0.5, 0.2, 24, 12)), *moved = shape_torus(0.5, 0.2, 24, 12);
  shape_map(moved, scale, shift, -shift, shift);
  shape_seal(moved);
  qmat_surface *a = surface_of(plain), *b = surface_of(moved);
  assert_near(qmat_surface_frame(b)->diagonal / scale, qmat_surface_frame(a)->diagonal, tolerance);
  for (size_t i = 0; i < 1000; i++) {
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = uniform(5, 3 * i + (size_t)k, -0.5, 0.5);
    const double distance = qmat_surface_signed_distance(a, p);
    assert_near(qmat_surface_distance(b, p, INFINITY, NULL, NULL), fabs(distance), tolerance);
    if (fabs(distance) > 1e-6) assert_int_equal(qmat_surface_inside(b, p), distance < 0);
    double model[3], back[3];
    qmat_frame_to_model(qmat_surface_frame(b), p, 1, model);
    qmat_frame_to_unit(qmat_surface_frame(b), model, 1, back);
    for (int k = 0; k < 3; k++) assert_near(back[k], p[k], tolerance);
  }
  release(a);
  release(b);
}

static void test_huge_offsets_keep_precision(void **state) {
  (void)state;
  check_moved(1, 1e6, 1e-9);
}

static void test_tiny_models_keep_precision(void **state) {
  (void)state;
  check_moved(1e-9, 0, 1e-12);
  check_moved(1e-200, 0, 1e-12);
}

static void test_huge_models_keep_precision(void **state) {
  (void)state;
  check_moved(1e200, 0, 1e-12);
}

static void test_spheres_map_with_their_radius(void **state) {
  (void)state;
  const qmat_frame frame = {{1, 2, 3}, 4};
  const double sphere[8] = {5, 2, -1, 2, 1, 2, 3, 0};
  double unit[8], model[8];
  qmat_frame_spheres_to_unit(&frame, sphere, 2, unit);
  const double expected[8] = {1, 0, -1, 0.5, 0, 0, 0, 0};
  assert_memory_equal(unit, expected, sizeof expected);
  qmat_frame_spheres_to_model(&frame, unit, 2, model);
  assert_memory_equal(model, sphere, sizeof sphere);
}

static void test_meshes_without_extent_are_refused(void **state) {
  (void)state;
  qmat_mesh *meshes[2] = {shape_new(), shape_new()};
  for (int i = 0; i < 3; i++) shape_vertex(meshes[1], 5, 5, 5);
  shape_triangle(meshes[1], 0, 1, 2);
  for (int i = 0; i < 2; i++) {
    qmat_context context = {0};
    qmat_surface *surface = (qmat_surface *)&context;
    assert_int_equal(qmat_surface_new(&context, meshes[i], &surface), QMAT_ERROR_GEOMETRY);
    assert_null(surface);
    assert_string_not_equal(context.error.message, "");
    qmat_context_uninit(&context);
    qmat_value_release(&meshes[i]->base);
  }
  qmat_surface_free(NULL);
}

static void test_overflowing_bounding_box_is_refused(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  shape_vertex(mesh, -1.7e308, 0, 0);
  shape_vertex(mesh, 1.7e308, 0, 0);
  shape_vertex(mesh, 0, 1, 0);
  shape_triangle(mesh, 0, 1, 2);
  qmat_context context = {0};
  qmat_frame frame;
  assert_int_equal(qmat_frame_of_mesh(&context, mesh, &frame), QMAT_ERROR_GEOMETRY);
  qmat_context_uninit(&context);
  qmat_value_release(&mesh->base);
}

static void test_unused_vertices_do_not_widen_the_frame(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_box(1, 2, 2);
  shape_vertex(mesh, 1e30, 0, 0);
  qmat_surface *surface = surface_of(shape_seal(mesh));
  assert_near(qmat_surface_frame(surface)->diagonal, 3, 1e-15);
  const double centre[3] = {0, 0, 0};
  assert_near(qmat_surface_signed_distance(surface, centre), -0.5 / 3, 1e-15);
  release(surface);
}

/* --- thickness ---------------------------------------------------------------------------------------------------- */

static void test_thickness_takes_minimum_at_vertices_and_facet_value_at_samples(void **state) {
  (void)state;
  qmat_mesh *mesh = shape_new();
  for (int i = 0; i < 5; i++) shape_vertex(mesh, i, i * i, 0);
  shape_triangle(mesh, 0, 1, 2);
  shape_triangle(mesh, 1, 2, 3);
  shape_triangle(mesh, 2, 3, 0);
  double values[3] = {4, 2, 3}, out[6];
  uint32_t facets[6] = {0, 0, 0, 1, 0, 0};
  const qmat_field field = {.count = 3, .values = values};
  const qmat_samples samples = {.count = 6, .vertex_count = 5, .facets = facets};
  qmat_thickness_of_samples(mesh, &field, &samples, out);
  assert_near(out[0], 3, 0);
  assert_near(out[1], 2, 0);
  assert_near(out[2], 2, 0);
  assert_near(out[3], 2, 0);
  assert_true(isinf(out[4]));
  assert_near(out[5], 4, 0);
  assert_near(qmat_thickness_threshold(mesh, &field, 0.5), 1.5, 0);
  mesh->sheet_triangle_count = 1;
  assert_near(qmat_thickness_threshold(mesh, &field, 0.5), 1.5, 0);
  mesh->sheet_triangle_count = 3;
  assert_near(qmat_thickness_threshold(mesh, &field, 0.5), 0, 0);
  qmat_value_release(&mesh->base);
}

/* --- radius less depth over simplices ----------------------------------------------------------------------------- */

/* Bounds random simplices inside the solid and compares with the depth at points of them. Returns the share of finite
 * bounds. */
static double check_excess(qmat_mesh *mesh, size_t count) {
  qmat_surface *surface = surface_of(mesh);
  const double lowest = 0.005, limit = 0.02;
  size_t tried = 0, bounded = 0;
  uint32_t failed = UINT32_MAX;
  for (size_t i = 0; i < count; i++) {
    double spheres[3][4];
    const double *corners[3] = {spheres[0], spheres[1], spheres[2]};
    const int corner_count = 1 + (int)(i % 3);
    bool inside = true;
    for (size_t c = 0; c < 3; c++) {
      for (size_t k = 0; k < 3; k++)
        spheres[c][k] =
            c == 0 ? uniform(60, 3 * i + k, -0.5, 0.5) : spheres[0][k] + uniform(61, 9 * i + 3 * c + k, -0.15, 0.15);
      const double depth = -qmat_surface_signed_distance(surface, spheres[c]);
      spheres[c][3] = depth + uniform(62, 3 * i + c, -0.02, 0.01);
      inside &= depth > 0 || c >= (size_t)corner_count;
    }
    double centre[3] = {0, 0, 0};
    for (int c = 0; c < corner_count; c++)
      for (int k = 0; k < 3; k++) centre[k] += spheres[c][k] / corner_count;
    if (!inside || qmat_surface_signed_distance(surface, centre) >= 0) continue;
    tried++;
    uint32_t own = UINT32_MAX;
    const double bound = qmat_surface_excess_bound(surface, corners, corner_count, lowest, limit, &own);
    assert_true(bound == qmat_surface_excess_bound(surface, corners, corner_count, lowest, limit, &failed));
    assert_true(bound == qmat_surface_excess_bound(surface, corners, corner_count, lowest, limit, &own));
    if (!isfinite(bound)) continue;
    bounded++;
    assert_true(bound >= lowest && bound <= limit);
    for (size_t sample = 0; sample < 20; sample++) {
      double p[4] = {0, 0, 0, 0}, left = 1;
      for (int c = 0; c < corner_count; c++) {
        const double weight = c + 1 < corner_count ? left * uniform(63, 60 * i + 3 * sample + (size_t)c, 0, 1) : left;
        for (int k = 0; k < 4; k++) p[k] += weight * spheres[c][k];
        left -= weight;
      }
      assert_true(p[3] + qmat_surface_signed_distance(surface, p) <= bound + 1e-12);
    }
  }
  assert_true(tried > count / 200);
  release(surface);
  return (double)bounded / (double)tried;
}

static void place_roof(double u, double v, double point[3]) {
  point[0] = 3 * u - 0.5, point[1] = 3 * v - 0.5, point[2] = 2 + fabs(u - 0.5);
}

/* A box under a thick roof, which has no side in common with it. */
static qmat_mesh *box_and_thick_roof(void) {
  qmat_mesh *mesh = shape_new();
  shape_add_box(mesh, 0, 0, 0, 2, 2, 1, false);
  shape_add_sheet(mesh, 2, 1, place_roof);
  mesh->sheet_thickness = 0.8;
  return shape_seal(mesh);
}

static void test_excess_bounds_hold_between_the_spheres(void **state) {
  (void)state;
  assert_true(check_excess(shape_seal(shape_box(1, 2, 3)), 9000) > 0.5);
  assert_true(check_excess(shape_seal(shape_l()), 9000) > 0.2);
  assert_true(check_excess(shape_seal(shape_torus(1, 0.3, 40, 20)), 6000) > 0.05);
  assert_true(check_excess(nested_shell(), 9000) > 0.1);
  assert_true(check_excess(box_and_thick_roof(), 9000) > 0.2);
}

static void test_excess_in_a_box_is_exact(void **state) {
  (void)state;
  qmat_surface *surface = surface_of(shape_seal(shape_box(2, 2, 1)));
  const double half = 1.0 / 6; /* the diagonal is 3 long */
  const double a[4] = {-0.1, -0.1, 0, half + 0.01}, b[4] = {0.1, -0.1, 0, half}, c[4] = {0, 0.1, 0.004, half};
  const double *const slab[3] = {a, b, c};
  uint32_t failed = UINT32_MAX;
  assert_near(qmat_surface_excess_bound(surface, slab, 3, 0.001, 0.02, &failed), 0.01, 1e-12);
  assert_near(qmat_surface_excess_bound(surface, &slab[1], 2, 0.001, 0.02, &failed), 0.004, 1e-12);
  assert_near(qmat_surface_excess_bound(surface, slab, 3, 0.015, 0.02, &failed), 0.015, 0);
  assert_true(isinf(qmat_surface_excess_bound(surface, slab, 3, 0.001, 0.009, &failed)));
  release(surface);
}

/* A slab may be thinner than the limit, as in a thin wall: no bound reaches its least radius, so that it cannot leave
 * the solid. */
static void test_excess_bounds_stay_below_the_radius(void **state) {
  (void)state;
  qmat_surface *surface = surface_of(shape_seal(shape_box(2, 2, 1)));
  const double top = 1.0 / 6; /* the diagonal is 3 long */
  const double a[4] = {-0.1, -0.1, top - 0.03, 0.031}, b[4] = {0.1, -0.1, top - 0.04, 0.03},
               c[4] = {0, 0.1, top - 0.03, 0.03}, edge[4] = {0, 0.1, top - 0.0001, 0.03},
               outside[4] = {0, 0.1, top + 0.01, 0.03}, point[4] = {0, 0.1, top, 0};
  const double *const slab[3] = {a, b, c}, *const high[3] = {a, b, edge}, *const crossing[3] = {a, b, outside},
                      *const sharp[3] = {a, b, point};
  uint32_t failed = UINT32_MAX;
  assert_near(qmat_surface_excess_bound(surface, slab, 3, 0.0001, 0.05, &failed), 0.001, 1e-12);
  assert_near(qmat_surface_excess_bound(surface, slab, 3, 0.02, 0.05, &failed), 0.02, 0);
  assert_true(isinf(qmat_surface_excess_bound(surface, high, 3, 0.0001, 0.05, &failed)));
  assert_true(isinf(qmat_surface_excess_bound(surface, crossing, 3, 0.0001, 0.05, &failed)));
  assert_true(isinf(qmat_surface_excess_bound(surface, sharp, 3, 0.0001, 0.05, &failed)));
  release(surface);
}

static void test_surfaces_that_are_not_closed_have_no_excess_bound(void **state) {
  (void)state;
  qmat_surface *surface = surface_of(cup());
  const double a[4] = {0, 0, 0, 0.1}, b[4] = {0.01, 0, 0, 0.1};
  const double *const cone[2] = {a, b};
  uint32_t failed = UINT32_MAX;
  assert_true(isinf(qmat_surface_excess_bound(surface, cone, 2, 0.001, 0.02, &failed)));
  release(surface);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_box_agrees_with_brute_force),
      cmocka_unit_test(test_sphere_agrees_with_brute_force),
      cmocka_unit_test(test_l_shape_agrees_with_brute_force),
      cmocka_unit_test(test_torus_agrees_with_brute_force),
      cmocka_unit_test(test_nested_shell_agrees_with_brute_force),
      cmocka_unit_test(test_overlapping_boxes_agree_with_brute_force),
      cmocka_unit_test(test_open_cup_agrees_with_the_winding_number),
      cmocka_unit_test(test_sphere_without_an_octant_agrees_with_the_winding_number),
      cmocka_unit_test(test_flipped_triangle_agrees_with_the_winding_number),
      cmocka_unit_test(test_degenerate_triangles_change_nothing),
      cmocka_unit_test(test_needles_and_specks_agree_with_brute_force),
      cmocka_unit_test(test_points_on_vertices_edges_and_faces_have_distance_zero),
      cmocka_unit_test(test_equally_close_triangles_give_the_smallest),
      cmocka_unit_test(test_both_triangles_of_an_edge_are_equally_far),
      cmocka_unit_test(test_vertices_of_a_sphere_give_their_first_triangle),
      cmocka_unit_test(test_doubled_triangles_give_the_first_of_each_pair),
      cmocka_unit_test(test_centre_of_a_box_is_inside_though_rays_meet_edges),
      cmocka_unit_test(test_far_points_are_outside_at_the_right_distance),
      cmocka_unit_test(test_rays_from_the_surface_leave_their_own_triangle),
      cmocka_unit_test(test_thread_count_does_not_change_an_answer),
      cmocka_unit_test(test_huge_offsets_keep_precision),
      cmocka_unit_test(test_tiny_models_keep_precision),
      cmocka_unit_test(test_huge_models_keep_precision),
      cmocka_unit_test(test_spheres_map_with_their_radius),
      cmocka_unit_test(test_meshes_without_extent_are_refused),
      cmocka_unit_test(test_overflowing_bounding_box_is_refused),
      cmocka_unit_test(test_unused_vertices_do_not_widen_the_frame),
      cmocka_unit_test(test_excess_bounds_hold_between_the_spheres),
      cmocka_unit_test(test_excess_in_a_box_is_exact),
      cmocka_unit_test(test_excess_bounds_stay_below_the_radius),
      cmocka_unit_test(test_surfaces_that_are_not_closed_have_no_excess_bound),
      cmocka_unit_test(test_thickness_takes_minimum_at_vertices_and_facet_value_at_samples),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
