/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/skin_decimate.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/hash.h"
#include "core/node.h"
#include "nodes/skin/skin_collapse_cgal.h"
#include "nodes/skin/skin_thin.h"

/* Samples of a triangle are the corners of its division into this many parts a side. */
enum { PARTS = 4 };
/* A triangle turns over if the cosine of the angle to its old normal is below this. */
static const double LEAST_COSINE = 0.3;
/* The share of the error that samples may have: the rest is for what lies between them. */
static const double SAMPLE_SHARE = 0.75;
/* The share of the error for which the surface is thinned out before edges collapse, which takes most of the time: a
 * tenth of the triangles is left. Larger ones save little more, and places need finer cells. */
static const double THIN_SHARE = 0.15;
/* A triangle with more points than this keeps about so many of those that are near it, by the share of the error. A
 * flat face would gather all that was ever beside it otherwise, and each collapse would measure them again. */
enum { MOST_FACE_POINTS = 128 };
/* The costs of edges in a plane are all 0: without this limit a few vertices would take in thousands of triangles. */
enum { MOST_STAR_FACES = 48 };
static const double NEAR_SHARE = 0.25;
/* Nothing in the unit frame is farther away. */
static const double MOST_ERROR = 1;
/* No point, no face. */
#define NONE UINT32_MAX

typedef struct decimation {
  qmat_context *context;
  const qmat_envelope *envelope;
  double error; /* allowed at samples */
  size_t point_count, face_count;
  double *points;        /* 3 each: the vertices of the original */
  uint32_t *first;       /* per face: the first point that is nearest to it, or NONE */
  uint32_t *next;        /* per point: the next one of its face, or NONE */
  uint32_t *counts;      /* per face: its points, before some are left out */
  double *worst;         /* per face: the largest |F| that triangles had here */
  double *far;           /* per point: its distance to its face, at most */
  uint32_t *gathered;    /* the points around the edge that may collapse */
  uint32_t *chosen;      /* per gathered point: the triangle of the star that it is nearest to */
  double *distances;     /* per gathered point */
  size_t gathered_count; /* they are for */
  size_t star_size;      /* triangles */
  double star_worst;
  size_t asked;
  qmat_status status;
} decimation;

/* ---- geometry ---- */

static double point_to_segment(const double p[3], const double a[3], const double b[3]) {
  double off[3];
  const double along = qmat_closest_on_segment(p, a, b);
  for (int k = 0; k < 3; k++) off[k] = p[k] - a[k] - along * (b[k] - a[k]);
  return qmat_dot(off, off);
}

/* The squared distance from a point to the triangle with these corners, 3 doubles each. */
static double point_to_triangle(const double p[3], const double corners[9]) {
  double normal[3], least = INFINITY, from[3];
  qmat_triangle_normal(corners, corners + 3, corners + 6, normal);
  bool is_over = true;
  for (int i = 0; i < 3; i++) {
    const double *a = corners + (ptrdiff_t)3 * i, *b = corners + (ptrdiff_t)3 * ((i + 1) % 3);
    double edge[3], outward[3];
    qmat_subtract(b, a, edge);
    qmat_subtract(p, a, from);
    qmat_cross(edge, normal, outward);
    if (qmat_dot(outward, from) <= 0) continue;
    is_over = false;
    least = fmin(least, point_to_segment(p, a, b));
  }
  const double height = qmat_dot(from, normal), square = qmat_dot(normal, normal);
  return is_over && square > 0 ? height / square * height : least;
}

static void sample_of(const double corners[9], int i, int j, double point[3]) {
  const double weights[3] = {(double)i / PARTS, (double)j / PARTS, (double)(PARTS - i - j) / PARTS};
  for (int k = 0; k < 3; k++)
    point[k] = weights[0] * corners[k] + weights[1] * corners[3 + k] + weights[2] * corners[6 + k];
}

/* Whether a triangle would turn over or become a sliver. */
static bool is_bad(const double before[9], const double after[9]) {
  double old[3], new[3];
  const qmat_longest_side side = qmat_triangle_longest_side(after, after + 3, after + 6);
  if (!(side.height > QMAT_SKIN_SLIVER * side.length)) return true;
  qmat_triangle_normal(before, before + 3, before + 6, old);
  qmat_triangle_normal(after, after + 3, after + 6, new);
  return qmat_dot(old, new) < LEAST_COSINE * sqrt(qmat_dot(new, new) * qmat_dot(old, old));
}

/* ---- what a collapse would do ---- */

/* The largest |F| of the new triangles; INFINITY once it is above `limit`. The samples on the sides that stay are left
 * out, and those on the other sides are taken once. */
static double star_to_envelope(const decimation *d, const qmat_skin_star *star, double limit) {
  double most = fabs(qmat_envelope_distance(d->envelope, star->after, NULL)), point[3];
  if (most > limit) return INFINITY;
  for (size_t t = 0; t < star->kept_count; t++) {
    const double *corners = star->after + 9 * t;
    double reach = 0;
    for (int c = 0; c < 3; c++) {
      double side[3];
      qmat_subtract(corners + (ptrdiff_t)3 * c, corners + (ptrdiff_t)3 * ((c + 1) % 3), side);
      reach = fmax(reach, qmat_dot(side, side));
    }
    /* F is 1-Lipschitz, and no point of a triangle is farther from a corner than its longest side. */
    if (most + sqrt(reach) <= limit) continue;
    for (int i = 1; i < PARTS; i++)
      for (int j = 1; i + j <= PARTS; j++) {
        sample_of(corners, i, j, point);
        most = fmax(most, fabs(qmat_envelope_distance(d->envelope, point, NULL)));
        if (most > limit) return INFINITY;
      }
  }
  return most;
}

/* Gathers the points of the faces around, and finds the triangle nearest to each. False where one is too far. A point
 * of the envelope is as far from the original as `worst`, at most. */
static bool place_points(decimation *d, const qmat_skin_star *star, double worst) {
  const double limit = fmax(d->error - worst, d->error / 3);
  d->gathered_count = 0;
  for (size_t f = 0; f < star->removed_count + star->kept_count; f++)
    for (uint32_t p = d->first[star->faces[f]]; p != NONE; p = d->next[p]) {
      const double *point = d->points + 3 * (size_t)p;
      double least = INFINITY;
      uint32_t chosen = 0;
      for (size_t t = 0; t < star->kept_count; t++) {
        const double square = point_to_triangle(point, star->after + 9 * t);
        if (square < least) {
          least = square;
          chosen = (uint32_t)t;
        }
      }
      if (least > limit * limit) return false;
      d->gathered[d->gathered_count] = p;
      d->chosen[d->gathered_count] = chosen;
      d->distances[d->gathered_count++] = sqrt(least);
    }
  return true;
}

static bool accepts(void *user, const qmat_skin_star *star) {
  decimation *d = user;
  if (star->kept_count == 0 || star->kept_count > MOST_STAR_FACES) return false;
  for (size_t t = 0; t < star->kept_count; t++)
    if (is_bad(star->before + 9 * t, star->after + 9 * t)) return false;
  double worst = 0;
  for (size_t f = 0; f < star->removed_count + star->kept_count; f++) worst = fmax(worst, d->worst[star->faces[f]]);
  const double found = star_to_envelope(d, star, fmax(d->error, worst));
  if (found > fmax(d->error, worst) || !place_points(d, star, worst)) return false;
  for (size_t f = 0; f < star->removed_count + star->kept_count; f++) d->first[star->faces[f]] = NONE;
  d->star_worst = worst;
  d->star_size = star->kept_count;
  return true;
}

/* Whether a point stays with its face. The choice goes by the point's number alone, so that the same points stay. */
static bool stays(const decimation *d, uint32_t point, double distance, uint32_t count) {
  if (count <= MOST_FACE_POINTS || !(distance < NEAR_SHARE * d->error)) return true;
  return qmat_hash_unit(qmat_hash3(0, point, 0)) * count < MOST_FACE_POINTS;
}

static void collapsed(void *user, const uint32_t *faces) {
  decimation *d = user;
  for (size_t t = 0; t < d->star_size; t++) {
    d->first[faces[t]] = NONE;
    d->counts[faces[t]] = 0;
    d->worst[faces[t]] = d->star_worst;
  }
  for (size_t i = 0; i < d->gathered_count; i++) d->counts[faces[d->chosen[i]]]++;
  for (size_t i = 0; i < d->gathered_count; i++) {
    const uint32_t face = faces[d->chosen[i]], p = d->gathered[i];
    d->far[p] = d->distances[i];
    if (!stays(d, p, d->distances[i], d->counts[face])) continue;
    d->next[p] = d->first[face];
    d->first[face] = p;
  }
}

static bool goes_on(void *user) {
  decimation *d = user;
  if (d->asked++ % 64 == 0) d->status = qmat_progress(d->context, d->asked, d->asked + d->face_count, "edges");
  return d->status == QMAT_OK;
}

/* ---- the whole surface ---- */

/* So many triangles are measured between two questions whether to go on. */
static const size_t MEASURED_SLICE = 1 << 11;

/* The largest |F| at a triangle's corners and at a point of its middle. */
static double few_samples(const decimation *d, const double corners[9]) {
  double point[3];
  sample_of(corners, 1, 1, point);
  double most = fabs(qmat_envelope_distance(d->envelope, point, NULL));
  for (int c = 0; c < 3; c++)
    most = fmax(most, fabs(qmat_envelope_distance(d->envelope, corners + (ptrdiff_t)3 * c, NULL)));
  return most;
}

/* The largest |F| at all samples of a triangle. */
static double all_samples(const decimation *d, const double corners[9]) {
  double point[3], most = 0;
  for (int i = 0; i <= PARTS; i++)
    for (int j = 0; i + j <= PARTS; j++) {
      sample_of(corners, i, j, point);
      most = fmax(most, fabs(qmat_envelope_distance(d->envelope, point, NULL)));
    }
  return most;
}

/* Measures |F| at a few samples of each triangle, to `worst`, or with NULL at all samples; `*most` is the largest. */
static qmat_status measure(const decimation *d, const qmat_skin_triangles *surface, double *worst, double *most) {
  const int threads = qmat_threads(d->context);
  const size_t count = surface->triangle_count;
  double largest = 0;
  for (size_t begin = 0; begin < count; begin += MEASURED_SLICE) {
    const size_t end = count - begin < MEASURED_SLICE ? count : begin + MEASURED_SLICE;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256) reduction(max : largest)
    for (size_t t = begin; t < end; t++) {
      double corners[9];
      for (size_t c = 0; c < 3; c++)
        memcpy(corners + 3 * c, surface->positions + 3 * (size_t)surface->triangles[3 * t + c], 3 * sizeof *corners);
      const double found = worst ? few_samples(d, corners) : all_samples(d, corners);
      if (worst) worst[t] = found;
      largest = fmax(largest, found);
    }
    const qmat_status status = qmat_progress(d->context, end, count, "measured triangles");
    if (status != QMAT_OK) return status;
  }
  *most = largest;
  return QMAT_OK;
}

static qmat_status start(decimation *d, const qmat_skin_triangles *surface) {
  qmat_arena *arena = &d->context->arena;
  d->point_count = surface->vertex_count;
  d->face_count = surface->triangle_count;
  d->points = qmat_arena_alloc(arena, d->point_count, 3 * sizeof *d->points);
  d->next = qmat_arena_alloc(arena, d->point_count, sizeof *d->next);
  d->far = qmat_arena_calloc(arena, d->point_count, sizeof *d->far);
  d->gathered = qmat_arena_alloc(arena, d->point_count, sizeof *d->gathered);
  d->chosen = qmat_arena_alloc(arena, d->point_count, sizeof *d->chosen);
  d->distances = qmat_arena_alloc(arena, d->point_count, sizeof *d->distances);
  d->first = qmat_arena_alloc(arena, d->face_count, sizeof *d->first);
  d->counts = qmat_arena_alloc(arena, d->face_count, sizeof *d->counts);
  d->worst = qmat_arena_alloc(arena, d->face_count, sizeof *d->worst);
  if (!d->points || !d->next || !d->far || !d->gathered || !d->chosen || !d->distances || !d->first || !d->counts ||
      !d->worst)
    return qmat_fail_memory(d->context, "the skin");
  memcpy(d->points, surface->positions, 3 * d->point_count * sizeof *d->points);
  double most;
  const qmat_status status = measure(d, surface, d->worst, &most);
  if (status != QMAT_OK) return status;
  for (size_t p = 0; p < d->point_count; p++) d->next[p] = NONE;
  for (size_t f = 0; f < d->face_count; f++) d->first[f] = NONE;
  /* Each vertex belongs to the last of its triangles. */
  for (size_t i = 3 * d->face_count; i-- > 0;) {
    const uint32_t p = surface->triangles[i];
    if (d->far[p] < 0) continue;
    d->far[p] = -1;
    d->next[p] = d->first[i / 3];
    d->first[i / 3] = p;
  }
  for (size_t p = 0; p < d->point_count; p++) d->far[p] = 0;
  return QMAT_OK;
}

static qmat_status fail(qmat_context *context, qmat_status status) {
  if (status == QMAT_ERROR_MEMORY) return qmat_fail_memory(context, "the skin");
  return status == QMAT_OK ? QMAT_OK : qmat_fail(context, QMAT_ERROR_INTERNAL, "the skin is no 2-manifold");
}

static qmat_status collapse(decimation *d, size_t most, qmat_skin_triangles *surface) {
  const qmat_skin_judge judge = {.user = d, .accepts = accepts, .collapsed = collapsed, .goes_on = goes_on};
  const qmat_status status = qmat_skin_collapse(surface, most, &judge);
  return status == QMAT_CANCELLED ? d->status : fail(d->context, status);
}

/* Collapses edges down to `most` triangles, or as far as `error` allows. */
static qmat_status decimate(decimation *d, size_t most, qmat_skin_triangles *surface, qmat_skin_errors *errors) {
  double farthest = 0;
  qmat_status status = start(d, surface);
  if (status == QMAT_OK) status = collapse(d, most, surface);
  for (size_t p = 0; p < d->point_count && status == QMAT_OK; p++) farthest = fmax(farthest, d->far[p]);
  errors->from_original += farthest;
  return status;
}

/* Removes what the estimate of meshoptimizer allows, down to `most` triangles. */
static qmat_status thin(qmat_context *context, double error, size_t most, qmat_skin_triangles *surface) {
  const qmat_status status = qmat_skin_thin(context, THIN_SHARE * error, most, surface);
  /* Thinning leaves slivers along straight edges, which no collapse may touch. */
  return status == QMAT_OK ? fail(context, qmat_skin_flip_slivers(surface)) : status;
}

qmat_status qmat_skin_decimate(qmat_context *context, const qmat_envelope *envelope, double error, size_t most,
                               qmat_skin_triangles *surface, qmat_skin_errors *errors) {
  decimation d = {.context = context, .envelope = envelope, .error = SAMPLE_SHARE * error};
  *errors = (qmat_skin_errors){0};
  qmat_status status = thin(context, error, 0, surface);
  if (status == QMAT_OK) status = decimate(&d, 0, surface, errors);
  while (status == QMAT_OK && most > 0 && surface->triangle_count > most && 2 * error < MOST_ERROR) {
    error *= 2;
    d = (decimation){.context = context, .envelope = envelope, .error = SAMPLE_SHARE * error};
    status = decimate(&d, most, surface, errors);
    if (status == QMAT_OK && surface->triangle_count > most) status = thin(context, error, most, surface);
  }
  if (status == QMAT_OK) status = measure(&d, surface, NULL, &errors->to_envelope);
  return status;
}
