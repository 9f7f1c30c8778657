/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/sample_thinning.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "core/hash.h"

/* The cell width halves from level to level. Radii below the finest level search that level. */
enum { LEVELS = 8, REPORT_EVERY = 65536 };
/* Normals agree if their cosine is at least this. */
static const double least_cosine = 0.7;
/* The least cell width (unit frame), so that cell coordinates fit their integers. */
static const double narrowest = 1e-9;

#define NONE UINT32_MAX

/* A hash grid of the kept samples. On every level a sample is in the list of its cell's bucket. */
typedef struct sample_grid {
  double widths[LEVELS];
  size_t bucket_mask; /* buckets: a power of two, less one */
  uint32_t *heads;    /* per bucket: its newest entry, or NONE */
  uint32_t *next;     /* per entry, LEVELS * sample + level */
} sample_grid;

static size_t bucket_of(const sample_grid *grid, int level, const int64_t cell[3]) {
  uint64_t h = (uint64_t)cell[0] * UINT64_C(0x9e3779b97f4a7c15) + (uint64_t)level;
  h = (h ^ (uint64_t)cell[1]) * UINT64_C(0xbf58476d1ce4e5b9);
  return (size_t)qmat_hash_mix(h ^ (h >> 31) ^ (uint64_t)cell[2]) & grid->bucket_mask;
}

static qmat_status grid_init(qmat_context *context, sample_grid *grid, size_t count, double largest) {
  size_t buckets = 1024;
  while (buckets < 2 * count) buckets *= 2;
  for (int level = 0; level < LEVELS; level++) grid->widths[level] = fmax(ldexp(2 * largest, -level), narrowest);
  grid->bucket_mask = buckets - 1;
  grid->heads = qmat_arena_alloc(&context->arena, buckets, sizeof *grid->heads);
  grid->next = qmat_arena_alloc(&context->arena, count, LEVELS * sizeof *grid->next);
  if (!grid->heads || !grid->next) return qmat_fail_memory(context, "the samples");
  for (size_t i = 0; i < buckets; i++) grid->heads[i] = NONE;
  return QMAT_OK;
}

static void grid_add(sample_grid *grid, const double *point, uint32_t sample) {
  for (int level = 0; level < LEVELS; level++) {
    int64_t cell[3];
    for (int k = 0; k < 3; k++) cell[k] = (int64_t)floor(point[k] / grid->widths[level]);
    uint32_t *head = &grid->heads[bucket_of(grid, level, cell)];
    grid->next[LEVELS * (size_t)sample + (size_t)level] = *head;
    *head = LEVELS * sample + (uint32_t)level;
  }
}

typedef struct thinning {
  const double *points, *normals, *radii;
  double tolerance;
  sample_grid grid;
} thinning;

bool qmat_samples_are_level(const double *point, const double *normal, const double *other, const double *other_normal,
                            double tolerance) {
  double offset[3];
  qmat_subtract(point, other, offset);
  return qmat_dot(normal, other_normal) >= least_cosine && fabs(qmat_dot(offset, normal)) <= tolerance &&
         fabs(qmat_dot(offset, other_normal)) <= tolerance;
}

static bool represents(const thinning *t, uint32_t kept, uint32_t sample) {
  const double *mine = &t->points[3 * (size_t)sample], *theirs = &t->points[3 * (size_t)kept];
  return qmat_point_distance(mine, theirs) < t->radii[sample] &&
         qmat_samples_are_level(mine, &t->normals[3 * (size_t)sample], theirs, &t->normals[3 * (size_t)kept],
                                t->tolerance);
}

/* The kept sample that represents this one, or the sample itself. The cells of its level are at least twice as wide as
 * its radius, so 2 x 2 x 2 cells contain every candidate. */
static uint32_t find_representative(const thinning *t, uint32_t sample) {
  const sample_grid *grid = &t->grid;
  const double radius = t->radii[sample], *point = &t->points[3 * (size_t)sample];
  int level = 0;
  while (level + 1 < LEVELS && grid->widths[level + 1] >= 2 * radius) level++;
  int64_t low[3], high[3], cell[3];
  for (int k = 0; k < 3; k++) {
    low[k] = (int64_t)floor((point[k] - radius) / grid->widths[level]);
    high[k] = (int64_t)floor((point[k] + radius) / grid->widths[level]);
  }
  for (cell[0] = low[0]; cell[0] <= high[0]; cell[0]++)
    for (cell[1] = low[1]; cell[1] <= high[1]; cell[1]++)
      for (cell[2] = low[2]; cell[2] <= high[2]; cell[2]++)
        for (uint32_t entry = grid->heads[bucket_of(grid, level, cell)]; entry != NONE; entry = grid->next[entry])
          if (represents(t, entry / LEVELS, sample)) return entry / LEVELS;
  return sample;
}

qmat_status qmat_samples_thin(qmat_context *context, const double *points, const double *normals, const double *radii,
                              size_t count, double largest, double tolerance, uint32_t *representatives) {
  thinning t = {.points = points, .normals = normals, .radii = radii, .tolerance = tolerance};
  if (count >= NONE / LEVELS)
    return qmat_fail(context, QMAT_ERROR_MEMORY, "%zu samples are too many to thin out", count);
  qmat_status status = grid_init(context, &t.grid, count, largest);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    if (i % REPORT_EVERY == 0) status = qmat_progress(context, i, count, "samples");
    representatives[i] = find_representative(&t, (uint32_t)i);
    if (representatives[i] == i) grid_add(&t.grid, &points[3 * i], (uint32_t)i);
  }
  return status;
}

/* The unit normals of samples (3 doubles each), zero where undefined. */
static void find_normals(const qmat_surface *surface, const qmat_samples *samples, double *normals) {
  const double *positions = qmat_surface_positions(surface);
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  memset(normals, 0, 3 * samples->count * sizeof *normals);
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *ids = &mesh->triangles[3 * t];
    double normal[3];
    const double area = qmat_triangle_area(&positions[3 * (size_t)ids[0]], &positions[3 * (size_t)ids[1]],
                                           &positions[3 * (size_t)ids[2]], normal);
    for (size_t corner = 0; corner < 3; corner++)
      for (size_t k = 0; k < 3; k++) normals[3 * (size_t)ids[corner] + k] += area * normal[k];
  }
  for (size_t i = 0; i < samples->vertex_count; i++) {
    double *normal = &normals[3 * i];
    const double length = sqrt(qmat_dot(normal, normal));
    for (size_t k = 0; k < 3; k++) normal[k] = length > 0 ? normal[k] / length : 0;
  }
  for (size_t i = samples->vertex_count; i < samples->count; i++) {
    const uint32_t *ids = &mesh->triangles[3 * (size_t)samples->facets[i]];
    (void)qmat_triangle_area(&positions[3 * (size_t)ids[0]], &positions[3 * (size_t)ids[1]],
                             &positions[3 * (size_t)ids[2]], &normals[3 * i]);
  }
}

/* The radius of a sample, as a share of the thickness. */
static const double thickness_share = 0.25;

qmat_status qmat_representatives_find(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                      const double *points, const double *thickness, double tolerance,
                                      const double *reaches, uint32_t *representatives) {
  const size_t count = samples->count;
  if (tolerance == 0) {
    for (size_t i = 0; i < count; i++) representatives[i] = (uint32_t)i;
    return QMAT_OK;
  }
  double *normals = qmat_arena_alloc(&context->arena, count, 3 * sizeof *normals);
  double *radii = qmat_arena_alloc(&context->arena, count, sizeof *radii);
  if (!normals || !radii) return qmat_fail_memory(context, "samples");
  find_normals(surface, samples, normals);
  const double diagonal = qmat_surface_frame(surface)->diagonal;
  for (size_t i = 0; i < count; i++) {
    radii[i] = fmin(fmax(thickness_share * (thickness[i] / diagonal), tolerance), qmat_longest_reach);
    if (reaches) radii[i] = fmin(radii[i], reaches[i]);
  }
  return qmat_samples_thin(context, points, normals, radii, count, qmat_longest_reach, tolerance, representatives);
}
