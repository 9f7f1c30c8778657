/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/polygon.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

enum { MOST_PASSES = 64 };
/* Limits the time for self-intersecting polygons. After this many tests, ears are clipped without a test. */
static const uint64_t MOST_POINT_TESTS = (uint64_t)1 << 28;

/* Twice the signed area of the corners a b c in the plane. */
static double area(const double *flat, uint32_t a, uint32_t b, uint32_t c) {
  const double *p = flat + 2 * (size_t)a, *q = flat + 2 * (size_t)b, *r = flat + 2 * (size_t)c;
  return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}

static double square_distance(const double *flat, uint32_t a, uint32_t b) {
  double x = flat[2 * (size_t)b] - flat[2 * (size_t)a], y = flat[2 * (size_t)b + 1] - flat[2 * (size_t)a + 1];
  return x * x + y * y;
}

/* Twice the signed area over the sum of squared sides: largest for equilateral triangles, negative for flipped ones. */
static double shape(const double *flat, uint32_t a, uint32_t b, uint32_t c) {
  double sides = square_distance(flat, a, b) + square_distance(flat, b, c) + square_distance(flat, c, a);
  return sides > 0 ? area(flat, a, b, c) / sides : 0;
}

/* Scales the corners to [-0.5, 0.5] without overflow, and projects them to the plane of Newell's area vector. False if
 * that vector is zero: the polygon has no plane. `flat` has 3 * count numbers; the result uses the first 2 * count. */
static bool flatten(const double *points, size_t count, double *flat) {
  double low[3], high[3], size = 0;
  for (int k = 0; k < 3; k++) low[k] = high[k] = points[k] * 0.5;
  for (size_t i = 0; i < count; i++) {
    for (int k = 0; k < 3; k++) {
      low[k] = fmin(low[k], points[3 * i + (size_t)k] * 0.5);
      high[k] = fmax(high[k], points[3 * i + (size_t)k] * 0.5);
    }
  }
  for (int k = 0; k < 3; k++) size = fmax(size, high[k] * 0.5 - low[k] * 0.5);
  if (!(size > 0)) size = 1;
  for (size_t i = 0; i < count; i++) {
    for (int k = 0; k < 3; k++) {
      size_t at = 3 * i + (size_t)k;
      flat[at] = (points[at] * 0.25 - low[k] * 0.5) / size - 0.5;
    }
  }

  double normal[3] = {0, 0, 0};
  for (size_t i = 0; i < count; i++) {
    const double *p = flat + 3 * i, *q = flat + 3 * (i + 1 < count ? i + 1 : 0);
    normal[0] += (p[1] - q[1]) * (p[2] + q[2]);
    normal[1] += (p[2] - q[2]) * (p[0] + q[0]);
    normal[2] += (p[0] - q[0]) * (p[1] + q[1]);
  }
  const double length = sqrt(qmat_dot(normal, normal));
  if (!(length > 1e-300)) return false;
  for (int k = 0; k < 3; k++) normal[k] /= length;

  /* u is perpendicular to the normal, v = normal x u. */
  int least = fabs(normal[0]) <= fabs(normal[1]) ? 0 : 1;
  if (fabs(normal[2]) < fabs(normal[least])) least = 2;
  double u[3] = {-normal[least] * normal[0], -normal[least] * normal[1], -normal[least] * normal[2]};
  u[least] += 1;
  qmat_normalize(u);
  double v[3];
  qmat_cross(normal, u, v);
  for (size_t i = 0; i < count; i++) {
    double p[3];
    memcpy(p, flat + 3 * i, sizeof p);
    flat[2 * i] = qmat_dot(p, u);
    flat[2 * i + 1] = qmat_dot(p, v);
  }
  return true;
}

static void set_triangle(uint32_t *triangle, uint32_t a, uint32_t b, uint32_t c) {
  triangle[0] = a;
  triangle[1] = b;
  triangle[2] = c;
}

/* The fan of corner 0. */
static void fan(size_t count, uint32_t *triangles) {
  for (uint32_t i = 1; i + 1 < count; i++) set_triangle(triangles + 3 * (size_t)(i - 1), 0, i, i + 1);
}

/* Whether all turns are left and the polygon winds around once: it changes between up and down at most twice. */
static bool is_convex(const double *flat, size_t count) {
  int turns = 0;
  double before = 0;
  for (size_t i = 0; i < count; i++) {
    uint32_t a = (uint32_t)i, b = (uint32_t)((i + 1) % count), c = (uint32_t)((i + 2) % count);
    if (area(flat, a, b, c) < -1e-12) return false;
    double rise = flat[2 * (size_t)b + 1] - flat[2 * (size_t)a + 1];
    if (fabs(rise) < 1e-12) continue;
    if (before != 0 && rise * before < 0) turns++;
    before = rise;
  }
  return turns <= 2;
}

/* Whether the fan of corner 0 has no empty triangle, as a straight corner 1 makes. */
static bool is_fan_full(const double *flat, size_t count) {
  for (uint32_t i = 1; i + 1 < count; i++)
    if (!(shape(flat, 0, i, i + 1) > 1e-7)) return false;
  return true;
}

/* The remaining corners as a ring, and the state of each as the tip of an ear. */
typedef struct ears {
  const double *flat;
  const uint32_t *ids;
  size_t count;
  uint32_t *next, *previous, *reflex; /* reflex: the corners that may block an ear */
  uint32_t *state;
  double *worth;  /* per corner: its shape in 24 bits, so that equal shapes tie; plus 1 for an ear */
  uint32_t *best; /* a tournament tree: best[1] is the winner, best[i] the better of best[2 i] and best[2 i + 1] */
  size_t leaves;  /* of the tree: a power of two; leaf i is corner i */
  size_t reflex_count;
  uint64_t tests_left;
} ears;

enum { CLIPPED, NO_EAR, EAR };

static bool is_reflex(const ears *e, uint32_t corner) {
  return !(area(e->flat, e->previous[corner], corner, e->next[corner]) > 0);
}

static double least(double a, double b, double c) {
  return fmin(a, fmin(b, c));
}

static double most(double a, double b, double c) {
  return fmax(a, fmax(b, c));
}

static bool is_blocked(ears *e, uint32_t a, uint32_t b, uint32_t c) {
  const double *p = e->flat + 2 * (size_t)a, *q = e->flat + 2 * (size_t)b, *r = e->flat + 2 * (size_t)c;
  const double left = least(p[0], q[0], r[0]), right = most(p[0], q[0], r[0]);
  const double bottom = least(p[1], q[1], r[1]), top = most(p[1], q[1], r[1]);
  for (size_t i = 0; i < e->reflex_count && e->tests_left > 0; e->tests_left--) {
    const uint32_t corner = e->reflex[i];
    const double *at = e->flat + 2 * (size_t)corner;
    if (e->state[corner] == CLIPPED) {
      e->reflex[i] = e->reflex[--e->reflex_count];
      continue;
    }
    if (at[0] < left || at[0] > right || at[1] < bottom || at[1] > top) {
      i++;
      continue;
    }
    if (!is_reflex(e, corner)) { /* it became convex and stays convex */
      e->reflex[i] = e->reflex[--e->reflex_count];
      continue;
    }
    const uint32_t id = e->ids[corner];
    if (id != e->ids[a] && id != e->ids[b] && id != e->ids[c] && area(e->flat, a, b, corner) >= 0 &&
        area(e->flat, b, c, corner) >= 0 && area(e->flat, c, a, corner) >= 0) {
      return true;
    }
    i++;
  }
  return false;
}

/* The corner of greater worth; the first of equals. */
static uint32_t winner(const ears *e, uint32_t a, uint32_t b) {
  return b < e->count && e->worth[b] > e->worth[a] ? b : a;
}

static void replay(ears *e, uint32_t corner) {
  for (size_t i = (e->leaves + corner) / 2; i > 0; i /= 2) e->best[i] = winner(e, e->best[2 * i], e->best[2 * i + 1]);
}

static void set_state(ears *e, uint32_t corner, uint32_t state, double worth) {
  e->state[corner] = state;
  e->worth[corner] = worth;
}

static void evaluate(ears *e, uint32_t corner) {
  uint32_t a = e->previous[corner], c = e->next[corner];
  double worth = (double)(float)shape(e->flat, a, corner, c); /* within [-0.3, 0.3] */
  bool ear = worth > 0 && !is_blocked(e, a, corner, c);
  set_state(e, corner, ear ? EAR : NO_EAR, ear ? worth + 1 : worth);
}

static void evaluate_all(ears *e) {
  for (uint32_t i = 0; i < e->count; i++) {
    if (e->state[i] != CLIPPED) evaluate(e, i);
  }
  for (size_t i = 0; i < e->leaves; i++) e->best[e->leaves + i] = (uint32_t)i;
  for (size_t i = e->leaves; i-- > 1;) e->best[i] = winner(e, e->best[2 * i], e->best[2 * i + 1]);
}

static void clip_ears(ears *e, uint32_t *triangles) {
  uint32_t count = (uint32_t)e->count;
  for (uint32_t i = 0; i < count; i++) {
    e->next[i] = i + 1 < count ? i + 1 : 0;
    e->previous[i] = i > 0 ? i - 1 : count - 1;
    e->state[i] = NO_EAR;
  }
  for (uint32_t i = 0; i < count; i++) {
    if (is_reflex(e, i)) e->reflex[e->reflex_count++] = i;
  }
  evaluate_all(e);

  int passes_left = MOST_PASSES;
  for (size_t left = e->count; left > 3; left--) {
    /* Corners that blocked an ear may be clipped by now. If no ear is found, the polygon intersects itself. */
    if (e->state[e->best[1]] != EAR && passes_left-- > 0) evaluate_all(e);
    uint32_t tip = e->best[1], a = e->previous[tip], c = e->next[tip];
    set_triangle(triangles, a, tip, c);
    triangles += 3;
    set_state(e, tip, CLIPPED, -INFINITY);
    e->next[a] = c;
    e->previous[c] = a;
    evaluate(e, a);
    evaluate(e, c);
    replay(e, tip);
    replay(e, a);
    replay(e, c);
  }
  uint32_t last = e->best[1];
  set_triangle(triangles, e->previous[last], last, e->next[last]);
}

bool qmat_polygon_triangulate(const double *points, const uint32_t *ids, size_t count, double *flat, uint32_t *links,
                              uint32_t *triangles) {
  if (count == 3 || !flatten(points, count, flat)) {
    fan(count, triangles);
    return true;
  }
  const bool convex = is_convex(flat, count);
  if (count > QMAT_LARGEST_CONCAVE_POLYGON && !convex) return false;
  if (convex && (count > QMAT_LARGEST_CONCAVE_POLYGON || is_fan_full(flat, count))) {
    fan(count, triangles);
    return true;
  }
  size_t leaves = 4;
  while (leaves < count) leaves *= 2;
  ears e = {.flat = flat,
            .ids = ids,
            .count = count,
            .next = links,
            .previous = links + count,
            .reflex = links + 2 * count,
            .state = links + 3 * count,
            .worth = flat + 2 * count,
            .best = links + 4 * count,
            .leaves = leaves,
            .tests_left = MOST_POINT_TESTS};
  clip_ears(&e, triangles);
  return true;
}
