/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/constraint_points.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/envelope.h"
#include "core/geometry/medial_distance.h"
#include "core/geometry/point_grid.h"
#include "core/geometry/sheets.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "nodes/measure/interior_points.h"

enum { FINEST_GRID = 256 };

/* The grid's spacing as a share of epsilon. The error between the points is bounded afterwards
 * (nodes/measure/medial_errors.h). */
static const double spacing_share = 0.6;

/* The spacing inside a facet, as a share of its height. With the share of mesh.sample the torus's spheres are farther
 * from its ring, and a damaged capsule takes 154 spheres instead of 131. */
static const double height_share = 0.25;

/* The number of equal divisions of a length. */
static uint32_t divisions_of(double length, double spacing) {
  const double divisions = ceil(length / spacing);
  return divisions < 1 ? 1 : divisions > FINEST_GRID ? FINEST_GRID : (uint32_t)divisions;
}

/* A facet's grid: points on the sides that run from the smaller to the larger vertex, so that the neighbour has the
 * others, and points inside on rows along the longest side. Those of large facets are farther apart. */
typedef struct {
  const double *corners[3]; /* the longest side first, from corner 0 to corner 1 */
  double longest;
  double spacing;        /* of the rows, and of the points on them */
  bool own[3];           /* whether this facet divides side k, which starts at corner k */
  uint32_t divisions[3]; /* of the sides */
  uint32_t rows;
} grid;

static grid grid_of(const double *positions, const uint32_t *corners, double spacing) {
  const double *at[3];
  for (size_t k = 0; k < 3; k++) at[k] = &positions[3 * (size_t)corners[k]];
  const qmat_longest_side longest = qmat_triangle_longest_side(at[0], at[1], at[2]);
  grid g = {.longest = longest.length, .spacing = qmat_triangle_spacing(longest.height, height_share, spacing)};
  for (size_t k = 0; k < 3; k++) {
    const size_t side = ((size_t)longest.base + k) % 3, next = (side + 1) % 3;
    g.corners[k] = at[side];
    g.own[k] = corners[side] < corners[next];
    g.divisions[k] = divisions_of(qmat_point_distance(at[side], at[next]), spacing);
  }
  g.rows = divisions_of(longest.height, g.spacing);
  return g;
}

static uint32_t divisions_of_row(const grid *g, uint32_t row) {
  return divisions_of(g->longest * (1 - (double)row / g->rows), g->spacing);
}

static size_t grid_points(const grid *g) {
  size_t count = 0;
  for (int k = 0; k < 3; k++) count += g->own[k] ? g->divisions[k] - 1 : 0;
  for (uint32_t row = 1; row < g->rows; row++) count += divisions_of_row(g, row) - 1;
  return count;
}

static double *put_point(const double *const corners[3], double a, double b, double c, double *points) {
  for (int k = 0; k < 3; k++) points[k] = a * corners[0][k] + b * corners[1][k] + c * corners[2][k];
  return points + 3;
}

static void fill_grid(const grid *g, double *points) {
  for (int k = 0; k < 3; k++)
    for (uint32_t i = 1; g->own[k] && i < g->divisions[k]; i++) {
      double weights[3] = {0, 0, 0};
      weights[(k + 1) % 3] = (double)i / g->divisions[k];
      weights[k] = 1 - weights[(k + 1) % 3];
      points = put_point(g->corners, weights[0], weights[1], weights[2], points);
    }
  for (uint32_t row = 1; row < g->rows; row++) {
    const double height = (double)row / g->rows;
    const uint32_t divisions = divisions_of_row(g, row);
    for (uint32_t i = 1; i < divisions; i++) {
      const double along = (1 - height) * i / divisions;
      points = put_point(g->corners, 1 - height - along, along, height, points);
    }
  }
}

/* Slabs are prepared where a point first asks for them, by whichever thread comes first, and kept for the others. Of
 * more slabs than this none is kept: 200 MB. */
static const size_t most_kept_slabs = 500000;
enum { SLAB_NEW, SLAB_BUSY, SLAB_READY };

/* The spheres that are responsible for each sample, and the places of the samples. */
typedef struct {
  const qmat_mesh *mesh;
  const qmat_complex *complex;
  qmat_slab *slabs;             /* per triangle of the complex, once ready */
  _Atomic uint8_t *slab_states; /* per triangle; NULL: none is kept */
  size_t *sphere_starts;        /* per sample, + 1 */
  uint32_t *spheres;
  const double *reaches; /* per sphere, of find_reaches */
  qmat_point_grid samples;
} regions;

/* Per sphere, an upper bound of how much nearer to a point than the sphere any primitive at it may be. */
static double *find_reaches(qmat_context *context, const qmat_complex *complex) {
  double *reaches = qmat_arena_calloc(&context->arena, complex->vertex_count, sizeof *reaches);
  for (size_t e = 0; e < complex->edge_count && reaches; e++) {
    const uint32_t *ends = &complex->edges[2 * e];
    const double *a = &complex->spheres[4 * (size_t)ends[0]], *b = &complex->spheres[4 * (size_t)ends[1]];
    const double reach = qmat_point_distance(a, b) + fabs(a[3] - b[3]);
    for (int k = 0; k < 2; k++) reaches[ends[k]] = qmat_larger(reaches[ends[k]], reach);
  }
  return reaches;
}

static qmat_status find_answering(qmat_context *context, const qmat_samples *samples, const qmat_medial *medial,
                                  regions *a) {
  a->sphere_starts = qmat_arena_calloc(&context->arena, samples->count + 2, sizeof *a->sphere_starts);
  a->spheres = qmat_arena_alloc(&context->arena, medial->region_sample_count, sizeof *a->spheres);
  if (!a->sphere_starts || !a->spheres) return qmat_fail_memory(context, "responsible regions");
  for (size_t i = 0; i < medial->region_sample_count; i++) {
    if (medial->region_samples[i] >= samples->count) {
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh answers for sample %u of %zu: it belongs to others",
                medial->region_samples[i], samples->count);
      return qmat_fail_field(context, "medial");
    }
    a->sphere_starts[medial->region_samples[i] + 2]++;
  }
  for (size_t i = 0; i < samples->count; i++) a->sphere_starts[i + 2] += a->sphere_starts[i + 1];
  if (medial->region_offset_count)
    for (size_t v = 0; v < medial->sphere_count; v++)
      for (uint32_t i = medial->region_offsets[v]; i < medial->region_offsets[v + 1]; i++)
        a->spheres[a->sphere_starts[medial->region_samples[i] + 1]++] = (uint32_t)v;
  a->reaches = find_reaches(context, a->complex);
  return a->reaches ? QMAT_OK : qmat_fail_memory(context, "responsible regions");
}

typedef struct {
  double distance;
  uint32_t vertices[3];
  double weights[3];
} witness;

static void take_spheres(const regions *a, const double *point, uint32_t sample, witness *best) {
  for (size_t i = a->sphere_starts[sample]; i < a->sphere_starts[sample + 1]; i++) {
    const uint32_t v = a->spheres[i];
    const double f = qmat_sphere_distance(&a->complex->spheres[4 * (size_t)v], point);
    if (f < best->distance) *best = (witness){f, {v, QMAT_NONE, QMAT_NONE}, {1, 0, 0}};
  }
}

/* A slab of the medial mesh; `own` is where it is made if it cannot be kept. */
static const qmat_slab *prepared_slab(const regions *a, uint32_t triangle, qmat_slab *own) {
  const double *spheres = a->complex->spheres;
  const uint32_t *t = &a->complex->triangles[3 * (size_t)triangle];
  _Atomic uint8_t *state = a->slab_states ? &a->slab_states[triangle] : NULL;
  if (state && atomic_load_explicit(state, memory_order_acquire) == SLAB_READY) return &a->slabs[triangle];
  uint8_t unprepared = SLAB_NEW;
  const bool keep = state && atomic_compare_exchange_strong(state, &unprepared, SLAB_BUSY);
  qmat_slab *slab = keep ? &a->slabs[triangle] : own;
  qmat_slab_prepare(slab, &spheres[4 * (size_t)t[0]], &spheres[4 * (size_t)t[1]], &spheres[4 * (size_t)t[2]]);
  if (keep) atomic_store_explicit(state, SLAB_READY, memory_order_release);
  return slab;
}

/* The primitives at a sphere. */
static void take_star(const regions *a, const double *point, uint32_t vertex, witness *best) {
  const qmat_complex *complex = a->complex;
  size_t count;
  const uint32_t *at = qmat_complex_triangles_at(complex, vertex, &count);
  for (size_t i = 0; i < count; i++) {
    const uint32_t *t = &complex->triangles[3 * (size_t)at[i]];
    qmat_slab own;
    witness w = {.vertices = {t[0], t[1], t[2]}};
    w.distance = qmat_slab_foot_below(prepared_slab(a, at[i], &own), point, best->distance, w.weights);
    if (w.distance < best->distance) *best = w;
  }
  at = qmat_complex_edges_at(complex, vertex, &count);
  for (size_t i = 0; i < count; i++) {
    if (complex->edge_triangles[at[i]]) continue;
    const uint32_t *ends = &complex->edges[2 * (size_t)at[i]];
    qmat_cone cone;
    witness w = {.vertices = {ends[0], ends[1], QMAT_NONE}};
    qmat_cone_prepare(&cone, &complex->spheres[4 * (size_t)ends[0]], &complex->spheres[4 * (size_t)ends[1]]);
    w.distance = qmat_cone_foot(&cone, point, w.weights);
    if (w.distance < best->distance) *best = w;
  }
}

/* A point accepts a sphere up to the first share of epsilon. Beyond, the primitives around are searched; where these
 * are farther than the second share, all of the medial mesh is. */
static const double accepted_with_sphere = 0.5, accepted_with_star = 0.9;

static void store(qmat_constraint_points *constraints, size_t i, const witness *w) {
  memcpy(&constraints->witnesses[3 * i], w->vertices, sizeof w->vertices);
  memcpy(&constraints->weights[3 * i], w->weights, sizeof w->weights);
  constraints->distances[i] = w->distance;
}

/* The best witness in the region of a sample. The primitives around are searched only where no sphere is as near as
 * `accepted`. */
static witness search_region(const regions *a, const double *point, uint32_t sample, double accepted) {
  witness best = {INFINITY, {QMAT_NONE, QMAT_NONE, QMAT_NONE}, {0, 0, 0}};
  take_spheres(a, point, sample, &best);
  if (!(best.distance > accepted)) return best;
  for (size_t i = a->sphere_starts[sample]; i < a->sphere_starts[sample + 1]; i++) {
    const uint32_t v = a->spheres[i];
    if (qmat_sphere_distance(&a->complex->spheres[4 * (size_t)v], point) - a->reaches[v] < best.distance)
      take_star(a, point, v, &best);
  }
  return best;
}

/* The same for the nearest sample. The corners of the point's facet would be far away on a large one. */
static witness search_nearest_region(const regions *a, const double *point, double accepted) {
  return search_region(a, point, qmat_point_grid_nearest(&a->samples, point), accepted);
}

/* Without a bound too, every point needs a witness. */
static bool is_far(const qmat_constraint_points *constraints, size_t i, double enough) {
  return constraints->witnesses[3 * i] == QMAT_NONE || !(constraints->distances[i] <= enough);
}

/* Points or facets between two calls of the progress function. */
enum { SLICE = 1 << 11 };

/* The end of the slice that starts at `first`, of `count`; QMAT_CANCELLED. */
static qmat_status next_slice(qmat_context *context, size_t first, size_t count, size_t *last) {
  *last = count - first < SLICE ? count : first + SLICE;
  return qmat_progress(context, first, count, "constraint points");
}

/* The distance is INFINITY where none is as near as `limit`. */
static witness nearest_primitive(const qmat_envelope *envelope, const double *point, double limit) {
  witness w;
  w.distance = qmat_envelope_foot_within(envelope, point, limit, NULL, w.vertices, w.weights);
  return w;
}

static qmat_status envelope_of(qmat_context *context, const qmat_complex *complex, qmat_envelope **envelope) {
  return qmat_envelope_new(context, complex->spheres, complex->vertex_count, complex->edges, complex->edge_count,
                           complex->triangles, complex->triangle_count, envelope);
}

/* So few points take less time than the hierarchy of the envelope. */
enum { FEW_POINTS = 32 };

/* The nearest primitive of all, if one is nearer than `best`: looks at every sphere. */
static witness search_all_spheres(const regions *a, const double *point, witness best) {
  for (size_t v = 0; v < a->complex->vertex_count; v++) {
    const double f = qmat_sphere_distance(&a->complex->spheres[4 * v], point);
    if (f < best.distance) best = (witness){f, {(uint32_t)v, QMAT_NONE, QMAT_NONE}, {1, 0, 0}};
    if (f - a->reaches[v] < best.distance) take_star(a, point, (uint32_t)v, &best);
  }
  return best;
}

/* Finds the nearest primitive of all for the points that are farther than `enough` from their regions. */
static qmat_status search_everywhere(qmat_context *context, const regions *a, double enough,
                                     qmat_constraint_points *constraints) {
  size_t far_count = 0;
  for (size_t i = 0; i < constraints->count; i++) far_count += is_far(constraints, i, enough);
  if (far_count == 0) return QMAT_OK;
  qmat_envelope *envelope = NULL;
  qmat_status status = far_count > FEW_POINTS ? envelope_of(context, a->complex, &envelope) : QMAT_OK;
  if (status != QMAT_OK) return status;
  const int threads = qmat_threads(context);
  for (size_t first = 0, last; first < constraints->count; first = last) {
    status = next_slice(context, first, constraints->count, &last);
    if (status != QMAT_OK) break;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
    for (size_t i = first; i < last; i++) {
      if (!is_far(constraints, i, enough)) continue;
      const double *p = &constraints->points[3 * i], distance = constraints->distances[i];
      const witness w = envelope ? nearest_primitive(envelope, p, distance)
                                 : search_all_spheres(a, p, (witness){.distance = distance});
      if (w.distance < distance) store(constraints, i, &w);
    }
  }
  qmat_envelope_free(envelope);
  return status;
}

static qmat_status allocate(qmat_context *context, qmat_constraint_points *constraints) {
  qmat_arena *arena = &context->arena;
  constraints->points = qmat_arena_alloc(arena, constraints->count, 3 * sizeof(double));
  constraints->witnesses = qmat_arena_alloc(arena, constraints->count, 3 * sizeof(uint32_t));
  constraints->weights = qmat_arena_alloc(arena, constraints->count, 3 * sizeof(double));
  constraints->distances = qmat_arena_alloc(arena, constraints->count, sizeof(double));
  constraints->inner_limits =
      qmat_arena_calloc(arena, constraints->count - constraints->surface_count, sizeof *constraints->inner_limits);
  if (!constraints->points || !constraints->witnesses || !constraints->weights || !constraints->distances ||
      !constraints->inner_limits)
    return qmat_fail_memory(context, "constraint points");
  return QMAT_OK;
}

/* A point and the cube of a lattice that it lies in. */
typedef struct {
  uint64_t cube;
  uint32_t id;
} cube_point;

static int by_cube_and_id(const void *left, const void *right) {
  const cube_point *a = left, *b = right;
  if (a->cube != b->cube) return a->cube < b->cube ? -1 : 1;
  return a->id < b->id ? -1 : a->id > b->id;
}

/* Sorts points by their cubes; NULL when memory is short. */
static cube_point *sort_into_cubes(qmat_arena *arena, const double *points, size_t count, double side) {
  cube_point *sorted = qmat_arena_alloc(arena, count, sizeof *sorted);
  const double width = fmax(side, 4.0 / (1 << 20));
  for (size_t i = 0; i < count && sorted; i++) {
    sorted[i] = (cube_point){.id = (uint32_t)i};
    for (size_t k = 0; k < 3; k++)
      sorted[i].cube =
          sorted[i].cube << 21 | ((uint64_t)(int64_t)floor(points[3 * i + k] / width + (1 << 20)) & 0x1fffff);
  }
  if (count && sorted) qsort(sorted, count, sizeof *sorted, by_cube_and_id);
  return sorted;
}

/* Whether a point is the first one in its cube. */
static bool is_first(const cube_point *sorted, size_t i) {
  return i == 0 || sorted[i].cube != sorted[i - 1].cube;
}

/* Points almost epsilon below the surface. */
typedef struct {
  size_t count;
  double *points; /* 3 per point */
  witness *witnesses;
} shell_points;

/* One point of the shell is kept in each cube whose side is this share of the spacing. */
static const double shell_share = 0.6;

/* The grids of the shell may have this many times the points of those on the surface, before cubes thin them out. */
enum { SHELL_FACTOR = 4 };

/* The depth of the shell as a share of epsilon; the margin covers the envelope between its points. */
static const double shell_depth = 0.98;

/* Places a point `depth` below each point of the facets' grids, and below the facets' centres; 3 doubles each, in
 * `scratch`. `*spacing` grows until the grids have at most `most` points: the depth stays, so a point asks for no less
 * than before, and what is between is measured afterwards as ever. */
static qmat_status place_shell(qmat_context *context, const qmat_mesh *mesh, const double *positions, double depth,
                               size_t most, qmat_arena *scratch, double *spacing, double **below, size_t *count) {
  const size_t facets = qmat_solid_triangle_count(mesh);
  size_t on_grids;
  *count = 0;
  for (;; *spacing *= 1.25) {
    const qmat_status status = qmat_progress(context, 0, 0, "constraint points");
    if (status != QMAT_OK) return status;
    on_grids = 0;
    for (size_t t = 0; t < facets; t++) {
      const grid g = grid_of(positions, &mesh->triangles[3 * t], *spacing);
      on_grids += grid_points(&g);
    }
    if (on_grids <= most) break;
  }
  const size_t capacity = on_grids + facets;
  *below = capacity < QMAT_NONE ? qmat_arena_alloc(scratch, capacity, 3 * sizeof **below) : NULL;
  if (!*below) return qmat_fail_memory(context, "constraint points");
  for (size_t t = 0; t < facets; t++) {
    if (t % SLICE == 0) {
      const qmat_status status = qmat_progress(context, t, facets, "constraint points");
      if (status != QMAT_OK) return status;
    }
    const grid g = grid_of(positions, &mesh->triangles[3 * t], *spacing);
    double normal[3];
    if (!(qmat_triangle_area(g.corners[0], g.corners[1], g.corners[2], normal) > 0)) continue;
    const size_t on_grid = grid_points(&g);
    double *points = &(*below)[3 * *count];
    fill_grid(&g, points);
    for (int k = 0; k < 3; k++)
      points[3 * on_grid + (size_t)k] = (g.corners[0][k] + g.corners[1][k] + g.corners[2][k]) / 3;
    for (size_t i = 0; i < 3 * (on_grid + 1); i++) points[i] -= depth * normal[i % 3];
    *count += on_grid + 1;
  }
  return QMAT_OK;
}

/* Spreads points at a depth below the surface: one in each cube. How many there are. */
static qmat_status spread_shell(qmat_context *context, const qmat_surface *surface, double epsilon, size_t most,
                                double **points, size_t *kept) {
  qmat_arena scratch = {0};
  double *below, spacing = epsilon;
  size_t count;
  const size_t most_on_grids = most < SIZE_MAX / SHELL_FACTOR ? SHELL_FACTOR * most : SIZE_MAX;
  qmat_status status = place_shell(context, qmat_surface_mesh(surface), qmat_surface_positions(surface),
                                   shell_depth * epsilon, most_on_grids, &scratch, &spacing, &below, &count);
  if (status == QMAT_OK) {
    const cube_point *sorted = sort_into_cubes(&scratch, below, count, shell_share * spacing);
    *kept = 0;
    for (size_t i = 0; sorted && i < count; i++) *kept += is_first(sorted, i);
    *points = qmat_arena_alloc(&context->arena, *kept, 3 * sizeof **points);
    if (!sorted || !*points) status = qmat_fail_memory(context, "constraint points");
    double *next = *points;
    for (size_t i = 0; i < count && status == QMAT_OK; i++) {
      if (!is_first(sorted, i)) continue;
      memcpy(next, &below[3 * (size_t)sorted[i].id], 3 * sizeof *below);
      next += 3;
    }
  }
  qmat_arena_uninit(&scratch);
  return status;
}

/* Spreads points almost epsilon below the surface, wherever the solid is thick enough and the initial medial mesh
 * contains them. An envelope that contains all of them leaves no cavity deeper than epsilon, where their spacing is
 * epsilon; grids have at most some times `most` points. No solid is as thick as an infinite epsilon. */
static qmat_status find_shell(qmat_context *context, const qmat_surface *surface, const regions *a, double epsilon,
                              size_t most, shell_points *shell) {
  qmat_arena *arena = &context->arena;
  const double depth = shell_depth * epsilon;
  size_t kept;
  if (isinf(epsilon)) return QMAT_OK;
  const qmat_status placed = spread_shell(context, surface, epsilon, most, &shell->points, &kept);
  if (placed != QMAT_OK) return placed;
  shell->witnesses = qmat_arena_alloc(arena, kept, sizeof *shell->witnesses);
  if (!shell->witnesses) return qmat_fail_memory(context, "constraint points");
  const int threads = qmat_threads(context);
  for (size_t first = 0, last; first < kept; first = last) {
    const qmat_status status = next_slice(context, first, kept, &last);
    if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t i = first; i < last; i++) {
      const double *point = &shell->points[3 * i];
      shell->witnesses[i].distance = INFINITY;
      if (!qmat_surface_inside(surface, point) ||
          qmat_surface_distance(surface, point, (1 - 1e-6) * depth, NULL, NULL) < INFINITY)
        continue;
      shell->witnesses[i] = search_nearest_region(a, point, 0);
    }
  }
  for (size_t i = 0; i < kept; i++) {
    if (!(shell->witnesses[i].distance <= 0)) continue;
    memmove(&shell->points[3 * shell->count], &shell->points[3 * i], 3 * sizeof *shell->points);
    shell->witnesses[shell->count++] = shell->witnesses[i];
  }
  return QMAT_OK;
}

/* Finds the regions. */
static qmat_status answering_init(qmat_context *context, const qmat_place_request *request, const qmat_medial *medial,
                                  const qmat_complex *complex, regions *a) {
  *a = (regions){.mesh = request->mesh, .complex = complex};
  if (complex->triangle_count <= most_kept_slabs) {
    a->slabs = qmat_arena_alloc(&context->arena, complex->triangle_count, sizeof *a->slabs);
    a->slab_states = qmat_arena_calloc(&context->arena, complex->triangle_count, sizeof *a->slab_states);
    if (!a->slabs || !a->slab_states) return qmat_fail_memory(context, "medial slabs");
  }
  const qmat_status status = find_answering(context, request->samples, medial, a);
  if (status != QMAT_OK) return status;
  return qmat_point_grid_init(context, request->unit_samples, request->samples->count, &a->samples);
}

/* The points on the surface: the samples, then the points of each facet's grid. */
typedef struct {
  size_t count;
  double *points; /* 3 per point */
} surface_places;

static qmat_status place_points(qmat_context *context, const qmat_place_request *request, surface_places *places) {
  const qmat_mesh *mesh = request->mesh;
  const size_t samples = request->samples->count;
  double spacing = request->spacing;
  size_t added;
  for (;; spacing *= 1.25) {
    const qmat_status status = qmat_progress(context, 0, 0, "constraint points");
    if (status != QMAT_OK) return status;
    added = 0;
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      const grid g = grid_of(request->positions, &mesh->triangles[3 * t], spacing);
      added += grid_points(&g);
    }
    if (added <= request->most) break;
  }
  places->count = samples + added;
  places->points = qmat_arena_alloc(&context->arena, places->count, 3 * sizeof *places->points);
  if (!places->points || places->count >= QMAT_NONE) return qmat_fail_memory(context, "constraint points");
  memcpy(places->points, request->unit_samples, 3 * samples * sizeof *places->points);
  double *next = places->points + 3 * samples;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const grid g = grid_of(request->positions, &mesh->triangles[3 * t], spacing);
    fill_grid(&g, next);
    next += 3 * grid_points(&g);
  }
  return QMAT_OK;
}

/* Makes the points on the surface, with witnesses from the regions around them. */
static qmat_status make_surface_points(qmat_context *context, const regions *a, const surface_places *places,
                                       double accepted, qmat_constraint_points *constraints) {
  const int threads = qmat_threads(context);
  memcpy(constraints->points, places->points, 3 * places->count * sizeof *places->points);
  for (size_t first = 0, last; first < places->count; first = last) {
    const qmat_status status = next_slice(context, first, places->count, &last);
    if (status != QMAT_OK) return status;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t i = first; i < last; i++) {
      const double *point = &places->points[3 * i];
      const witness w = i < constraints->sample_point_count
                            ? search_region(a, point, (uint32_t)qmat_sample_of_point(constraints, i), accepted)
                            : search_nearest_region(a, point, accepted);
      store(constraints, i, &w);
    }
  }
  return QMAT_OK;
}

qmat_status qmat_surface_places_make(qmat_context *context, const qmat_place_request *request,
                                     const qmat_medial *medial, const qmat_complex *complex,
                                     qmat_constraint_points *constraints) {
  const size_t samples = request->samples->count;
  *constraints = (qmat_constraint_points){.sample_count = samples, .sample_point_count = samples};
  regions a;
  surface_places places;
  qmat_status status = answering_init(context, request, medial, complex, &a);
  if (status == QMAT_OK) status = place_points(context, request, &places);
  if (status != QMAT_OK) return status;
  constraints->count = constraints->surface_count = places.count;
  status = allocate(context, constraints);
  if (status == QMAT_OK) status = make_surface_points(context, &a, &places, request->enough, constraints);
  return status == QMAT_OK ? search_everywhere(context, &a, request->enough, constraints) : status;
}

/* Facets much smaller or narrower than epsilon have far more points than its bounds need. Where one point in each cube
 * whose side is the first share of epsilon is at most the second share of all points, only these are kept. */
static const double surface_share = 0.3, few_share = 0.5;

/* Thins out the places where that leaves few, and tells the constraints what points and samples then have to do with
 * each other. */
static qmat_status thin_out(qmat_context *context, double epsilon, surface_places *places,
                            qmat_constraint_points *constraints) {
  qmat_arena *arena = &context->arena;
  const size_t all = places->count;
  const cube_point *sorted = sort_into_cubes(arena, places->points, all, surface_share * epsilon);
  uint32_t *first = qmat_arena_alloc(arena, all, sizeof *first); /* per place: the first one in its cube */
  uint32_t *kept = qmat_arena_alloc(arena, all, sizeof *kept), count = 0, of_samples = 0;
  uint32_t *numbers = qmat_arena_alloc(arena, all, sizeof *numbers); /* per place: that of `first` among the kept */
  if (!sorted || !first || !kept || !numbers) return qmat_fail_memory(context, "constraint points");
  for (size_t i = 0; i < all; i++) first[sorted[i].id] = is_first(sorted, i) ? sorted[i].id : first[sorted[i - 1].id];
  for (uint32_t i = 0; i < all; i++) {
    if (first[i] == i) kept[count++] = i;
    numbers[i] = first[i] == i ? count - 1 : numbers[first[i]];
    if (i < constraints->sample_count) of_samples = count;
  }
  if (!(count <= few_share * (double)all)) return QMAT_OK;
  for (size_t i = 0; i < count; i++)
    memmove(&places->points[3 * i], &places->points[3 * (size_t)kept[i]], 3 * sizeof *places->points);
  places->count = count;
  constraints->sample_point_count = of_samples;
  constraints->sample_points = numbers;
  constraints->point_samples = kept;
  return QMAT_OK;
}

qmat_status qmat_constraint_points_make(qmat_context *context, const qmat_surface *surface, const qmat_samples *samples,
                                        const qmat_medial *medial, const qmat_complex *complex, double epsilon,
                                        size_t most, bool inside, qmat_constraint_points *constraints) {
  qmat_arena *arena = &context->arena;
  *constraints = (qmat_constraint_points){.sample_count = samples->count, .sample_point_count = samples->count};
  regions a;
  surface_places places;
  qmat_interior_points inner = {.count = 0};
  double *unit_samples = qmat_arena_alloc(arena, samples->count, 3 * sizeof *unit_samples);
  if (!unit_samples) return qmat_fail_memory(context, "constraint points");
  qmat_frame_to_unit(qmat_surface_frame(surface), samples->positions, samples->count, unit_samples);
  const qmat_place_request request = {.mesh = qmat_surface_mesh(surface),
                                      .positions = qmat_surface_positions(surface),
                                      .samples = samples,
                                      .unit_samples = unit_samples,
                                      .spacing = spacing_share * epsilon,
                                      .most = most};
  qmat_status status = answering_init(context, &request, medial, complex, &a);
  if (status == QMAT_OK && inside) status = qmat_interior_points_find(context, complex, epsilon, &inner);
  shell_points shell = {.count = 0};
  if (status == QMAT_OK && inside) status = find_shell(context, surface, &a, epsilon, most, &shell);
  if (status == QMAT_OK) status = place_points(context, &request, &places);
  if (status != QMAT_OK) return status;
  if (epsilon < INFINITY) status = thin_out(context, epsilon, &places, constraints);
  constraints->surface_count = places.count;
  constraints->count = places.count + inner.count + shell.count;
  if (status == QMAT_OK) status = allocate(context, constraints);
  if (status == QMAT_OK)
    status = make_surface_points(context, &a, &places, accepted_with_sphere * epsilon, constraints);
  if (status != QMAT_OK) return status;
  size_t next = constraints->surface_count;
  for (size_t i = 0; i < inner.count; i++, next++) {
    const witness own = {inner.distances[i], {inner.spheres[i], QMAT_NONE, QMAT_NONE}, {1, 0, 0}};
    memcpy(&constraints->points[3 * next], &inner.points[3 * i], 3 * sizeof(double));
    constraints->inner_limits[i] = inner.limits[i];
    store(constraints, next, &own);
  }
  for (size_t i = 0; i < shell.count; i++, next++) {
    memcpy(&constraints->points[3 * next], &shell.points[3 * i], 3 * sizeof(double));
    store(constraints, next, &shell.witnesses[i]);
  }
  return search_everywhere(context, &a, accepted_with_star * epsilon, constraints);
}

qmat_status qmat_extra_points_make(qmat_context *context, const qmat_complex *complex, const qmat_extra_points *extra,
                                   qmat_constraint_points *constraints) {
  *constraints = (qmat_constraint_points){.count = extra->surface_count + extra->inner_count,
                                          .surface_count = extra->surface_count};
  qmat_status status = allocate(context, constraints);
  qmat_envelope *envelope;
  if (status == QMAT_OK) status = envelope_of(context, complex, &envelope);
  if (status != QMAT_OK) return status;
  if (extra->surface_count)
    memcpy(constraints->points, extra->surface, 3 * extra->surface_count * sizeof *constraints->points);
  if (extra->inner_count)
    memcpy(&constraints->points[3 * extra->surface_count], extra->inner,
           3 * extra->inner_count * sizeof *constraints->points);
  const int threads = qmat_threads(context);
  for (size_t first = 0, last; first < constraints->count; first = last) {
    status = next_slice(context, first, constraints->count, &last);
    if (status != QMAT_OK) break;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 16)
    for (size_t i = first; i < last; i++) {
      const witness w = nearest_primitive(envelope, &constraints->points[3 * i], INFINITY);
      store(constraints, i, &w);
    }
  }
  qmat_envelope_free(envelope);
  if (status != QMAT_OK) return status;
  size_t kept = extra->surface_count;
  for (size_t i = 0; i < kept && extra->is_strict; i++) constraints->distances[i] = fmin(constraints->distances[i], 0);
  for (size_t i = kept; i < constraints->count; i++) {
    if (!(constraints->distances[i] < 0 || extra->is_strict)) continue;
    memmove(&constraints->points[3 * kept], &constraints->points[3 * i], 3 * sizeof *constraints->points);
    memmove(&constraints->witnesses[3 * kept], &constraints->witnesses[3 * i], 3 * sizeof *constraints->witnesses);
    memmove(&constraints->weights[3 * kept], &constraints->weights[3 * i], 3 * sizeof *constraints->weights);
    constraints->distances[kept] = constraints->distances[i];
    constraints->inner_limits[kept - extra->surface_count] =
        extra->is_strict ? -extra->required_depth : fmax(0.5 * constraints->distances[i], -extra->required_depth);
    kept++;
  }
  constraints->count = kept;
  return QMAT_OK;
}

qmat_status qmat_constraint_points_join(qmat_context *context, const qmat_constraint_points *base,
                                        const uint32_t *witnesses, const double *weights, const uint32_t *ids,
                                        const qmat_constraint_points *extra, qmat_constraint_points *joined) {
  *joined = (qmat_constraint_points){.count = base->count + extra->count,
                                     .sample_count = base->sample_count,
                                     .sample_point_count = base->sample_point_count,
                                     .sample_points = base->sample_points,
                                     .point_samples = base->point_samples,
                                     .surface_count = base->surface_count + extra->surface_count};
  const qmat_status status = allocate(context, joined);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < joined->count; i++) {
    const bool inside = i >= joined->surface_count;
    const size_t place = inside ? i - joined->surface_count : i;
    const size_t own = inside ? base->count - base->surface_count : base->surface_count;
    const bool is_base = place < own;
    const qmat_constraint_points *source = is_base ? base : extra;
    const size_t j = (inside ? source->surface_count : 0) + (is_base ? place : place - own);
    memcpy(&joined->points[3 * i], &source->points[3 * j], 3 * sizeof *joined->points);
    memcpy(&joined->weights[3 * i], &(is_base ? weights : extra->weights)[3 * j], 3 * sizeof *joined->weights);
    for (size_t k = 0; k < 3; k++) {
      const uint32_t vertex = (is_base ? witnesses : extra->witnesses)[3 * j + k];
      joined->witnesses[3 * i + k] = is_base && ids && vertex != QMAT_NONE ? ids[vertex] : vertex;
    }
    joined->distances[i] = source->distances[j];
    if (inside) joined->inner_limits[place] = source->inner_limits[j - source->surface_count];
  }
  return QMAT_OK;
}
