/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/cover_fit.h"

#include <math.h>
#include <string.h>

#include "core/geometry/sheets.h"
#include "core/geometry/vector.h"
#include "core/hash.h"
#include "nodes/colliders/cover_bound.h"
#include "nodes/measure/area_samples.h"

/* Samples: as many as the spheres need to be fixed, spread over the area, and all vertices of a mesh that has few. */
enum { SAMPLES_PER_SPHERE = 120, LEAST_SAMPLES = 4000, MOST_SAMPLES = 20000, MOST_VERTICES = 40000 };
enum { STEPS = 60, MORE_STEPS = 12, ROUNDS = 4, CONJUGATE_STEPS = 30, PROOFS = 64, MOST_PARTS = 20000 };

/* Lengths in diagonals. Fitted F is below -margin; a slack of `level` counts half as much per length as none. */
static const double margin = 2e-4, level = 1e-3, most_step = 0.01, tolerance = 4e-4;
/* A step is solved until the norm of the residual is a tenth of what it was; this is the share of its square. Weights
 * change from step to step, and solving further does not make shapes tighter. */
static const double unsolved_share = 0.01;
/* The weight of a sample outside, per length, over that of one inside; it rises from step to step. */
static const double least_penalty = 4, most_penalty = 400;

/* What F at a sample depends on: sum of share * (radius + normal . centre) over up to three spheres. */
typedef struct row {
  uint32_t ids[3];
  double shares[3], normal[3];
  double f, weight;
} row;

typedef struct fit {
  qmat_context *context;
  const qmat_surface *surface;
  qmat_shape_set *set;
  double least_radius;
  size_t sample_count, even_count; /* all samples; the first are spread evenly and count as slack */
  double *samples;                 /* 4 per sample: a point, and how far the solid reaches around it */
  const qmat_joint_points *skin;   /* NULL: nothing is skinned */
  uint32_t *joints;                /* per sample: only shapes of this joint count; NULL: all do */
  qmat_prepared_shape *shapes;     /* those of the set */
  row *rows;
  double *vectors; /* 6 vectors of 4 numbers per sphere, and those below */
  double *best, *step;
} fit;

/* ---- samples ---- */

/* Those of joints. */
static qmat_status take_skinned_samples(fit *t) {
  const size_t count =
      qmat_surface_mesh(t->surface)->vertex_count <= MOST_VERTICES ? t->skin->count : t->skin->even_count;
  const size_t room = count + MOST_PARTS;
  t->samples = qmat_arena_alloc(&t->context->arena, room, 4 * sizeof *t->samples);
  t->rows = qmat_arena_alloc(&t->context->arena, room, sizeof *t->rows);
  t->joints = qmat_arena_alloc(&t->context->arena, room, sizeof *t->joints);
  if (!t->samples || !t->rows || !t->joints) return qmat_fail_memory(t->context, "samples of the surface");
  memcpy(t->samples, t->skin->points, 4 * count * sizeof *t->samples);
  memcpy(t->joints, t->skin->joints, count * sizeof *t->joints);
  t->sample_count = count;
  t->even_count = t->skin->even_count;
  return QMAT_OK;
}

static qmat_status take_samples(fit *t) {
  if (t->skin) return take_skinned_samples(t);
  qmat_context *context = t->context;
  const qmat_mesh *mesh = qmat_surface_mesh(t->surface);
  const double *positions = qmat_surface_positions(t->surface);
  const size_t vertices = mesh->vertex_count <= MOST_VERTICES ? mesh->vertex_count : 0;
  size_t even = SAMPLES_PER_SPHERE * t->set->sphere_count;
  even = even < LEAST_SAMPLES ? LEAST_SAMPLES : even < MOST_SAMPLES ? even : MOST_SAMPLES;
  const size_t room = even + vertices + MOST_PARTS;
  t->samples = qmat_arena_alloc(&context->arena, room, 4 * sizeof *t->samples);
  t->rows = qmat_arena_alloc(&context->arena, room, sizeof *t->rows);
  double *areas = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *areas);
  if (!t->samples || !t->rows || !areas) return qmat_fail_memory(context, "samples of the surface");
  qmat_running_areas(positions, mesh->triangles, mesh->triangle_count, areas);
  const size_t solid_count = qmat_solid_triangle_count(mesh);
  const double half_thickness = qmat_surface_half_thickness(t->surface);
  for (size_t i = 0; i < even; i++) {
    double *sample = &t->samples[4 * i];
    const double at = areas[mesh->triangle_count - 1] * ((double)i + 0.5) / (double)even;
    const size_t facet = qmat_area_element_at(areas, mesh->triangle_count, at);
    const uint32_t *ids = &mesh->triangles[3 * facet];
    qmat_triangle_point(&positions[3 * (size_t)ids[0]], &positions[3 * (size_t)ids[1]], &positions[3 * (size_t)ids[2]],
                        qmat_hash_unit(qmat_hash3(3, i, 0)), qmat_hash_unit(qmat_hash3(3, i, 1)), sample);
    sample[3] = facet < solid_count ? 0 : half_thickness;
  }
  t->even_count = t->sample_count = even;
  uint8_t *taken = qmat_arena_calloc(&context->arena, mesh->vertex_count, 1);
  if (!taken) return qmat_fail_memory(context, "samples of the surface");
  for (size_t i = 0; i < 3 * mesh->triangle_count && vertices > 0; i++) {
    const size_t vertex = mesh->triangles[i];
    if (taken[vertex]) continue;
    taken[vertex] = 1;
    double *sample = &t->samples[4 * t->sample_count++];
    memcpy(sample, &positions[3 * vertex], 3 * sizeof *sample);
    sample[3] = i < 3 * solid_count ? 0 : half_thickness;
  }
  return QMAT_OK;
}

/* ---- one step ---- */

/* Fills the rows. `*slack` becomes the mean of -F over the even samples, `*outside` the largest F. */
static qmat_status evaluate(fit *t, double *slack, double *outside) {
  const qmat_shape_set *set = t->set;
  const int threads = qmat_threads(t->context);
  for (size_t i = 0; i < set->shape_count; i++) qmat_shape_prepare(&t->shapes[i], set->spheres, &set->shapes[3 * i]);
  qmat_envelope *envelope = NULL;
  const qmat_status status = t->joints ? QMAT_OK : qmat_shape_set_envelope(t->context, set, &envelope);
  if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
  for (size_t i = 0; i < t->sample_count; i++) {
    row *r = &t->rows[i];
    const double *point = &t->samples[4 * i];
    double medial[4];
    size_t primitive = 0;
    r->f = point[3] + (t->joints ? qmat_shape_set_nearest_of_joint(set, t->shapes, t->joints[i], point, &primitive)
                                 : qmat_envelope_nearest(envelope, point, &primitive, medial));
    memcpy(r->ids, &set->shapes[3 * primitive], sizeof r->ids);
    if (t->joints) qmat_shape_medial(&t->shapes[primitive], set->spheres, r->ids, point, medial);
    qmat_shape_distance(&t->shapes[primitive], point, r->shares);
    const double away = qmat_point_distance(point, medial);
    for (int k = 0; k < 3; k++) r->normal[k] = away > 0 ? (point[k] - medial[k]) / away : 0;
  }
  qmat_envelope_free(envelope);
  *slack = 0;
  *outside = -INFINITY;
  for (size_t i = 0; i < t->sample_count; i++) {
    if (i < t->even_count) *slack -= t->rows[i].f / (double)t->even_count;
    *outside = fmax(*outside, t->rows[i].f);
  }
  return QMAT_OK;
}

/* Sets weights, the gradient and the diagonal of the normal equations. Samples inside weigh as in an absolute value. */
static void weigh(fit *t, double penalty, double *gradient, double *diagonal) {
  memset(gradient, 0, 4 * t->set->sphere_count * sizeof *gradient);
  memset(diagonal, 0, 4 * t->set->sphere_count * sizeof *diagonal);
  for (size_t i = 0; i < t->sample_count; i++) {
    row *r = &t->rows[i];
    const double excess = r->f + margin;
    r->weight = excess > 0 ? penalty / level : i < t->even_count ? 1 / (level - excess) : 0;
    for (int s = 0; s < 3 && r->weight > 0; s++)
      for (int k = 0; k < 4 && r->shares[s] > 0; k++) {
        const double slope = r->shares[s] * (k < 3 ? r->normal[k] : 1);
        gradient[4 * (size_t)r->ids[s] + (size_t)k] += r->weight * slope * excess;
        diagonal[4 * (size_t)r->ids[s] + (size_t)k] += r->weight * slope * slope;
      }
  }
}

/* out = (J^T W J + D) in, where D damps. */
static void multiply(const fit *t, const double *damping, const double *in, double *out) {
  for (size_t i = 0; i < 4 * t->set->sphere_count; i++) out[i] = damping[i] * in[i];
  for (size_t i = 0; i < t->sample_count; i++) {
    const row *r = &t->rows[i];
    double change = 0;
    if (!(r->weight > 0)) continue;
    for (int s = 0; s < 3; s++) {
      const double *x = &in[4 * (size_t)r->ids[s]];
      change += r->shares[s] * (x[3] + qmat_dot(r->normal, x));
    }
    change *= r->weight;
    for (int s = 0; s < 3; s++) {
      double *y = &out[4 * (size_t)r->ids[s]];
      for (int k = 0; k < 4; k++) y[k] += r->shares[s] * change * (k < 3 ? r->normal[k] : 1);
    }
  }
}

/* Solves for the step by conjugate gradients, preconditioned by the diagonal. */
static void solve(const fit *t, const double *gradient, const double *diagonal, double *step) {
  const size_t n = 4 * t->set->sphere_count;
  double *damping = t->vectors + 2 * n, *rest = t->vectors + 3 * n, *way = t->vectors + 4 * n,
         *image = t->vectors + 5 * n, product = 0, largest = 0;
  for (size_t i = 0; i < n; i++) largest = fmax(largest, diagonal[i]);
  for (size_t i = 0; i < n; i++) {
    damping[i] = 0.02 * diagonal[i] + 1e-4 * largest + 1e-300;
    step[i] = 0;
    rest[i] = gradient[i];
    way[i] = rest[i] / (diagonal[i] + damping[i]);
    product += rest[i] * way[i];
  }
  const double enough = unsolved_share * product;
  for (int round = 0; round < CONJUGATE_STEPS && product > enough; round++) {
    double along = 0, next = 0;
    multiply(t, damping, way, image);
    for (size_t i = 0; i < n; i++) along += way[i] * image[i];
    if (!(along > 0)) break;
    for (size_t i = 0; i < n; i++) {
      step[i] += product / along * way[i];
      rest[i] -= product / along * image[i];
      next += rest[i] * rest[i] / (diagonal[i] + damping[i]);
    }
    for (size_t i = 0; i < n; i++) way[i] = rest[i] / (diagonal[i] + damping[i]) + next / product * way[i];
    product = next;
  }
}

/* Adds the step to the spheres, at most `most_step` each. f falls where a radius or a centre moves along the normal. */
static void move(fit *t, const double *step) {
  for (size_t i = 0; i < t->set->sphere_count; i++) {
    double *sphere = &t->set->spheres[4 * i];
    const double length = sqrt(qmat_dot(&step[4 * i], &step[4 * i]) + step[4 * i + 3] * step[4 * i + 3]);
    const double share = length > most_step ? most_step / length : 1;
    for (int k = 0; k < 4; k++) sphere[k] += share * step[4 * i + (size_t)k];
    sphere[3] = fmax(sphere[3], t->least_radius);
  }
}

/* Fits the spheres to the samples by `steps` steps whose penalty rises from `penalty`. The best spheres are those that
 * need the least slack once all have grown until no sample is outside. */
static qmat_status fit_samples(fit *t, int steps, double penalty) {
  const size_t n = 4 * t->set->sphere_count;
  double least = INFINITY, *gradient = t->vectors, *diagonal = t->vectors + n;
  for (int i = 0; i <= steps; i++) {
    double slack, outside;
    qmat_status status = qmat_progress(t->context, (uint64_t)i, (uint64_t)steps, "fitting steps");
    if (status == QMAT_OK) status = evaluate(t, &slack, &outside);
    if (status != QMAT_OK) return status;
    if (slack + outside < least) {
      least = slack + outside;
      memcpy(t->best, t->set->spheres, n * sizeof *t->best);
    }
    if (i == steps) break;
    weigh(t, penalty * pow(most_penalty / penalty, (double)i / steps), gradient, diagonal);
    solve(t, gradient, diagonal, t->step);
    move(t, t->step);
  }
  memcpy(t->set->spheres, t->best, n * sizeof *t->best);
  return QMAT_OK;
}

/* ---- the proof ---- */

/* Grows the spheres of a shape until it has grown by `value` at the point. */
static void grow_at(qmat_shape_set *set, uint32_t shape, const double point[3], double value) {
  const uint32_t *ids = &set->shapes[3 * (size_t)shape];
  qmat_prepared_shape prepared;
  double shares[3], squares = 0;
  qmat_shape_prepare(&prepared, set->spheres, ids);
  qmat_shape_distance(&prepared, point, shares);
  for (int k = 0; k < 3; k++) squares += shares[k] * shares[k];
  for (int k = 0; k < prepared.count; k++) set->spheres[4 * (size_t)ids[k] + 3] += value * shares[k] / squares;
}

/* Grows shapes where the search found parts that they leave uncovered. */
static void grow_parts(fit *t, const qmat_cover_bound *bound) {
  for (size_t k = 0; k < bound->count; k++) {
    const qmat_uncovered *part = &bound->parts[k];
    qmat_prepared_shape shape;
    qmat_shape_prepare(&shape, t->set->spheres, &t->set->shapes[3 * (size_t)part->shape]);
    /* Earlier growth may have covered it. */
    const double left = qmat_shape_distance(&shape, part->point, NULL) + part->reach + 1e-6;
    if (left > 0) grow_at(t->set, part->shape, part->point, left);
  }
}

/* Grows shapes of joints that do not contain all points of theirs. */
static void grow_joints(fit *t) {
  for (size_t i = 0; i < t->set->shape_count; i++)
    qmat_shape_prepare(&t->shapes[i], t->set->spheres, &t->set->shapes[3 * i]);
  for (size_t i = 0; t->skin && i < t->skin->count; i++) {
    const double *point = &t->skin->points[4 * i];
    size_t nearest = 0;
    const double left =
        qmat_shape_set_nearest_of_joint(t->set, t->shapes, t->skin->joints[i], point, &nearest) + point[3] + 1e-6;
    if (!(left > 0) || !isfinite(left)) continue;
    grow_at(t->set, (uint32_t)nearest, point, left);
    qmat_shape_prepare(&t->shapes[nearest], t->set->spheres, &t->set->shapes[3 * nearest]);
  }
}

/* Fits the spheres, searches the solid, fits again with what was found among the samples, and at last grows shapes
 * until the whole solid is covered. */
static qmat_status cover_solid(fit *t) {
  const size_t n = 4 * t->set->sphere_count;
  qmat_cover_bound bound, before;
  t->vectors = qmat_arena_alloc(&t->context->arena, 8 * n, sizeof *t->vectors);
  t->shapes = qmat_arena_alloc(&t->context->arena, t->set->shape_count, sizeof *t->shapes);
  if (!t->vectors || !t->shapes) return qmat_fail_memory(t->context, "the fitted colliders");
  t->best = t->vectors + 6 * n;
  t->step = t->vectors + 7 * n;
  const size_t room = t->sample_count + MOST_PARTS;
  qmat_status status = fit_samples(t, STEPS, least_penalty);
  for (int i = 0; i < ROUNDS + PROOFS && status == QMAT_OK; i++) {
    status =
        qmat_cover_bound_measure(t->context, t->surface, t->set, tolerance, true, i > ROUNDS ? &before : NULL, &bound);
    before = bound;
    if (status != QMAT_OK || bound.bound <= 0) return status;
    if (i >= ROUNDS) {
      grow_parts(t, &bound);
      continue;
    }
    const size_t stride = 1 + ROUNDS * bound.count / MOST_PARTS; /* each round has its share of the room */
    for (size_t k = 0; k < bound.count && t->sample_count < room; k += stride) {
      if (t->joints) t->joints[t->sample_count] = t->set->joints[t->set->shapes[3 * (size_t)bound.parts[k].shape]];
      double *sample = &t->samples[4 * t->sample_count++];
      memcpy(sample, bound.parts[k].point, sizeof bound.parts[k].point);
      sample[3] = bound.parts[k].reach;
    }
    status = fit_samples(t, MORE_STEPS, most_penalty / 4);
  }
  if (status == QMAT_OK)
    status = qmat_cover_bound_measure(t->context, t->surface, t->set, tolerance, false, &before, &bound);
  for (size_t i = 0; i < t->set->sphere_count && status == QMAT_OK; i++) t->set->spheres[4 * i + 3] += bound.bound;
  return status;
}

/* Gives each shape spheres of its own, which can move apart. */
static qmat_status unshare(qmat_context *context, qmat_shape_set *set) {
  double *spheres = qmat_arena_alloc(&context->arena, 3 * set->shape_count, 4 * sizeof *spheres);
  uint32_t *joints = set->joints ? qmat_arena_alloc(&context->arena, 3 * set->shape_count, sizeof *joints) : NULL;
  if (!spheres || (set->joints && !joints)) return qmat_fail_memory(context, "the fitted colliders");
  size_t count = 0;
  for (size_t i = 0; i < set->shape_count; i++) {
    uint32_t *ids = &set->shapes[3 * i];
    const int width = qmat_shape_width(ids);
    for (int k = 0; k < width; k++) {
      memcpy(&spheres[4 * count], &set->spheres[4 * (size_t)ids[k]], 4 * sizeof *spheres);
      if (joints) joints[count] = set->joints[ids[k]];
      ids[k] = (uint32_t)count++;
    }
    for (int k = width; k < 3; k++) ids[k] = ids[width - 1];
  }
  set->spheres = spheres;
  set->sphere_count = count;
  set->joints = joints;
  return QMAT_OK;
}

qmat_status qmat_cover_fit(qmat_context *context, const qmat_surface *surface, const qmat_joint_points *skin,
                           qmat_shape_set *set, double least_radius, bool *proved) {
  fit t = {.context = context,
           .surface = surface,
           .set = set,
           .skin = set->joints ? skin : NULL,
           .least_radius = least_radius};
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  *proved = mesh->closed && mesh->oriented;
  qmat_status status = unshare(context, set);
  if (status == QMAT_OK) status = take_samples(&t);
  if (status == QMAT_OK) status = cover_solid(&t);
  if (status == QMAT_OK) grow_joints(&t);
  return status == QMAT_OK ? qmat_shape_set_reduce(context, set) : status;
}
