/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/partitioned_collapse.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/side_by_side.h"

static bool has_features(const qmat_decimation_rules *rules, const qmat_complex *complex, size_t first) {
  for (size_t v = first; rules->features == QMAT_FEATURES_SHARP && v < complex->vertex_count; v++)
    if (complex->spheres[4 * v + 3] == 0) return true;
  return false;
}

bool qmat_can_collapse_partitioned(const qmat_decimation_rules *rules, const qmat_complex *complex,
                                   size_t sheet_vertices) {
  return complex->vertex_count > QMAT_MOST_PIECE_VERTICES && rules->on_exceed == QMAT_EXCEED_SKIP &&
         rules->cost == QMAT_COST_SLAB && !rules->published && rules->protect == QMAT_PROTECT_OFF &&
         (double)rules->vertices <= qmat_piece_share * (double)complex->vertex_count &&
         !has_features(rules, complex, sheet_vertices);
}

/* Row numbers sorted by piece: those of piece p are items[starts[p]] to items[starts[p + 1] - 1]. Rows with vertices of
 * several pieces follow the last piece. */
typedef struct piece_rows {
  size_t *starts;
  uint32_t *items;
} piece_rows;

/* The result of a piece: its edges and triangles, with the vertex numbers of the whole, and their bounds. */
typedef struct piece_result {
  size_t edge_count, triangle_count;
  uint32_t *edges, *triangles;
  double *edge_bounds, *triangle_bounds;
  qmat_collapse_counts counts;
} piece_result;

typedef struct partition {
  qmat_context *context;
  qmat_decimation *whole;
  qmat_constraint_points *constraints; /* with the witnesses of now */
  double *depths;                      /* per vertex: of its centre */
  size_t piece_count;
  uint32_t *pieces;       /* per vertex */
  uint32_t *numbers;      /* per vertex: its number within its piece */
  uint8_t *locked, *gone; /* per vertex: whether it has an edge to another piece, and whether it was removed */
  piece_rows vertices, edges, triangles, points;
  piece_result *results;
  _Atomic size_t done; /* vertices of finished pieces */
} partition;

/* ---- the pieces ---- */

enum { BINS = 1024 };

/* Splits the vertices along the longest side of their box into halves of about equal count: the lower half comes first.
 * Returns its count; 0 if all vertices coincide. */
static size_t halve(const double *spheres, uint32_t *vertices, size_t count, uint32_t *upper) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) {
      low[k] = fmin(low[k], spheres[4 * (size_t)vertices[i] + (size_t)k]);
      high[k] = fmax(high[k], spheres[4 * (size_t)vertices[i] + (size_t)k]);
    }
  size_t axis = 0;
  for (size_t k = 1; k < 3; k++)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  const double scale = BINS / (high[axis] - low[axis]);
  if (!(high[axis] > low[axis]) || !(scale < INFINITY)) return 0;
  size_t counts[BINS + 1] = {0}, below = 0;
  for (size_t i = 0; i < count; i++) counts[(size_t)(scale * (spheres[4 * (size_t)vertices[i] + axis] - low[axis]))]++;
  size_t bins = 0;
  while (bins < BINS && (bins == 0 || 2 * (below + counts[bins]) <= count)) below += counts[bins++];
  size_t kept = 0, moved = 0;
  for (size_t i = 0; i < count; i++) {
    if ((size_t)(scale * (spheres[4 * (size_t)vertices[i] + axis] - low[axis])) < bins)
      vertices[kept++] = vertices[i];
    else
      upper[moved++] = vertices[i];
  }
  memcpy(&vertices[kept], upper, moved * sizeof *upper);
  return kept;
}

/* Divides `count` vertices into pieces by repeated halving, and numbers the pieces. */
static void divide_vertices(partition *d, uint32_t *vertices, size_t count, uint32_t *scratch) {
  const size_t lower =
      count > QMAT_MOST_PIECE_VERTICES ? halve(d->whole->complex.spheres, vertices, count, scratch) : 0;
  if (lower > 0 && lower < count) {
    divide_vertices(d, vertices, lower, scratch);
    divide_vertices(d, &vertices[lower], count - lower, scratch);
    return;
  }
  for (size_t i = 0; i < count; i++) d->pieces[vertices[i]] = (uint32_t)d->piece_count;
  d->piece_count++;
}

/* The piece that has all vertices of a row; the number of pieces if there is none. */
static size_t piece_of(const partition *d, const uint32_t *row, size_t size) {
  const uint32_t piece = d->pieces[row[0]];
  for (size_t k = 1; k < size && row[k] != QMAT_NONE; k++)
    if (d->pieces[row[k]] != piece) return d->piece_count;
  return piece;
}

/* Sorts rows of `size` vertices each by their pieces; NULL: each vertex is a row. */
static qmat_status sort_rows(partition *d, const uint32_t *rows, size_t count, size_t size, piece_rows *sorted) {
  qmat_arena *arena = &d->context->arena;
  sorted->starts = qmat_arena_calloc(arena, d->piece_count + 3, sizeof *sorted->starts);
  sorted->items = qmat_arena_alloc(arena, count, sizeof *sorted->items);
  if (!sorted->starts || !sorted->items) return qmat_fail_memory(d->context, "pieces of the medial mesh");
  for (size_t i = 0; i < count; i++) sorted->starts[(rows ? piece_of(d, &rows[size * i], size) : d->pieces[i]) + 2]++;
  for (size_t p = 0; p <= d->piece_count; p++) sorted->starts[p + 2] += sorted->starts[p + 1];
  for (size_t i = 0; i < count; i++)
    sorted->items[sorted->starts[(rows ? piece_of(d, &rows[size * i], size) : d->pieces[i]) + 1]++] = (uint32_t)i;
  return QMAT_OK;
}

static qmat_status divide(partition *d) {
  const qmat_complex *c = &d->whole->complex;
  qmat_arena *arena = &d->context->arena;
  const size_t vertices = c->vertex_count;
  d->pieces = qmat_arena_alloc(arena, vertices, sizeof *d->pieces);
  d->numbers = qmat_arena_alloc(arena, vertices, sizeof *d->numbers);
  d->locked = qmat_arena_calloc(arena, vertices, 1);
  d->gone = qmat_arena_calloc(arena, vertices, 1);
  uint32_t *order = qmat_arena_alloc(arena, vertices, sizeof *order);
  uint32_t *scratch = qmat_arena_alloc(arena, vertices, sizeof *scratch);
  if (!d->pieces || !d->numbers || !d->locked || !d->gone || !order || !scratch)
    return qmat_fail_memory(d->context, "pieces of the medial mesh");
  for (size_t v = 0; v < vertices; v++) order[v] = (uint32_t)v;
  divide_vertices(d, order, vertices, scratch);
  qmat_status status = sort_rows(d, NULL, vertices, 1, &d->vertices);
  if (status == QMAT_OK) status = sort_rows(d, c->edges, c->edge_count, 2, &d->edges);
  if (status == QMAT_OK) status = sort_rows(d, c->triangles, c->triangle_count, 3, &d->triangles);
  if (status == QMAT_OK) status = sort_rows(d, d->constraints->witnesses, d->constraints->count, 3, &d->points);
  d->results = qmat_arena_calloc(arena, d->piece_count, sizeof *d->results);
  if (status == QMAT_OK && !d->results) status = qmat_fail_memory(d->context, "pieces of the medial mesh");
  if (status != QMAT_OK) return status;
  for (size_t p = 0; p < d->piece_count; p++)
    for (size_t i = d->vertices.starts[p]; i < d->vertices.starts[p + 1]; i++)
      d->numbers[d->vertices.items[i]] = (uint32_t)(i - d->vertices.starts[p]);
  for (size_t i = d->edges.starts[d->piece_count]; i < d->edges.starts[d->piece_count + 1]; i++)
    for (size_t k = 0; k < 2; k++) d->locked[c->edges[2 * (size_t)d->edges.items[i] + k]] = 1;
  return QMAT_OK;
}

/* ---- the collapses of one piece ---- */

/* The rows of a piece with vertex numbers within the piece. NULL if memory is short. */
static uint32_t *renumber(qmat_arena *arena, const partition *d, const piece_rows *sorted, size_t piece,
                          const uint32_t *rows, size_t size) {
  const size_t first = sorted->starts[piece], count = sorted->starts[piece + 1] - first;
  uint32_t *own = qmat_arena_alloc(arena, count, size * sizeof *own);
  for (size_t i = 0; own && i < count; i++)
    for (size_t k = 0; k < size; k++) {
      const uint32_t vertex = rows[size * sorted->items[first + i] + k];
      own[size * i + k] = vertex == QMAT_NONE ? QMAT_NONE : d->numbers[vertex];
    }
  return own;
}

/* Copies the constraint points whose witnesses all lie in the piece. */
static qmat_status take_points(qmat_context *context, const partition *d, size_t piece, qmat_constraint_points *own) {
  const qmat_constraint_points *all = d->constraints;
  const size_t first = d->points.starts[piece];
  qmat_arena *arena = &context->arena;
  *own = (qmat_constraint_points){.count = d->points.starts[piece + 1] - first};
  const uint32_t *items = &d->points.items[first];
  own->points = qmat_arena_alloc(arena, own->count, 3 * sizeof(double));
  own->weights = qmat_arena_alloc(arena, own->count, 3 * sizeof(double));
  own->distances = qmat_arena_alloc(arena, own->count, sizeof(double));
  own->inner_limits = qmat_arena_alloc(arena, own->count, sizeof(double));
  own->witnesses = renumber(arena, d, &d->points, piece, all->witnesses, 3);
  if (!own->points || !own->weights || !own->distances || !own->inner_limits || !own->witnesses)
    return qmat_fail_memory(context, "constraint points");
  for (size_t i = 0; i < own->count; i++) {
    const size_t j = items[i];
    memcpy(&own->points[3 * i], &all->points[3 * j], 3 * sizeof(double));
    memcpy(&own->weights[3 * i], &all->weights[3 * j], 3 * sizeof(double));
    own->distances[i] = all->distances[j];
    own->surface_count += j < all->surface_count;
    if (j >= all->surface_count) own->inner_limits[i - own->surface_count] = all->inner_limits[j - all->surface_count];
  }
  return QMAT_OK;
}

/* Sets the piece up as a medial mesh of its own. */
static qmat_status start_piece(qmat_context *context, const partition *d, size_t piece,
                               qmat_constraint_points *constraints, qmat_decimation *own) {
  const qmat_decimation *whole = d->whole;
  const qmat_complex *c = &whole->complex;
  qmat_arena *arena = &context->arena;
  const size_t first = d->vertices.starts[piece], count = d->vertices.starts[piece + 1] - first;
  const uint32_t *vertices = &d->vertices.items[first];
  *own = (qmat_decimation){.context = context, .surface = whole->surface, .rules = whole->rules};
  double *spheres = qmat_arena_alloc(arena, count, 4 * sizeof *spheres);
  double *depths = qmat_arena_alloc(arena, count, sizeof *depths);
  uint8_t *locked = qmat_arena_alloc(arena, count, 1);
  own->quadrics = qmat_arena_alloc(arena, count, sizeof *own->quadrics);
  qmat_medial medial = {.sphere_count = count,
                        .edge_count = d->edges.starts[piece + 1] - d->edges.starts[piece],
                        .triangle_count = d->triangles.starts[piece + 1] - d->triangles.starts[piece],
                        .edges = renumber(arena, d, &d->edges, piece, c->edges, 2),
                        .triangles = renumber(arena, d, &d->triangles, piece, c->triangles, 3)};
  if (!spheres || !depths || !locked || !own->quadrics || !medial.edges || !medial.triangles)
    return qmat_fail_memory(context, "a piece of the medial mesh");
  for (size_t i = 0; i < count; i++) {
    memcpy(&spheres[4 * i], &c->spheres[4 * (size_t)vertices[i]], 4 * sizeof *spheres);
    depths[i] = d->depths[vertices[i]];
    locked[i] = d->locked[vertices[i]];
    own->quadrics[i] = whole->quadrics[vertices[i]];
    own->sheet_vertices += qmat_decimation_is_of_sheet(whole, vertices[i]); /* in rising order */
  }
  own->locked = locked;
  own->rules.refits = 0;
  own->rules.vertices = (size_t)ceil(qmat_piece_share * (double)count);
  qmat_status status = qmat_complex_init(context, &own->complex, &medial, spheres);
  if (status == QMAT_OK) status = take_points(context, d, piece, constraints);
  return status == QMAT_OK ? qmat_decimation_init(own, constraints, depths) : status;
}

/* The live rows of a piece with the vertex numbers of the whole, and their bounds. The caller frees both. */
static int take_rows(const uint32_t *vertices, const uint8_t *alive, const uint32_t *rows, const double *bounds,
                     size_t count, size_t size, size_t *left, uint32_t **rows_left, double **bounds_left) {
  *left = 0;
  for (size_t i = 0; i < count; i++) *left += alive[i];
  *rows_left = qmat_alloc(*left, size * sizeof **rows_left);
  *bounds_left = qmat_alloc(*left, sizeof **bounds_left);
  if (!*rows_left || !*bounds_left) return -1;
  size_t next = 0;
  for (size_t i = 0; i < count; i++) {
    if (!alive[i]) continue;
    for (size_t k = 0; k < size; k++) (*rows_left)[size * next + k] = vertices[rows[size * i + k]];
    (*bounds_left)[next++] = bounds[i];
  }
  return 0;
}

/* Writes the result of a piece back to the whole. Pieces write disjoint entries. */
static qmat_status end_piece(partition *d, size_t piece, const qmat_decimation *own) {
  qmat_complex *all = &d->whole->complex;
  const qmat_complex *c = &own->complex;
  const uint32_t *vertices = &d->vertices.items[d->vertices.starts[piece]];
  const uint32_t *points = &d->points.items[d->points.starts[piece]];
  piece_result *result = &d->results[piece];
  for (size_t i = 0; i < c->vertex_count; i++) {
    const uint32_t v = vertices[i];
    d->gone[v] = !c->vertex_alive[i];
    memcpy(&all->spheres[4 * (size_t)v], &c->spheres[4 * i], 4 * sizeof(double));
    d->depths[v] = own->envelope_tracker.depths[i];
    d->whole->quadrics[v] = own->quadrics[i];
  }
  for (size_t i = 0; i < own->constraints->count; i++)
    for (size_t k = 0; k < 3; k++) {
      const uint32_t vertex = own->surface_tracker.witnesses[3 * i + k];
      d->constraints->witnesses[3 * (size_t)points[i] + k] = vertex == QMAT_NONE ? QMAT_NONE : vertices[vertex];
      d->constraints->weights[3 * (size_t)points[i] + k] = own->surface_tracker.weights[3 * i + k];
    }
  result->counts = own->counts;
  if (take_rows(vertices, c->edge_alive, c->edges, own->envelope_tracker.edge_bounds, c->edge_count, 2,
                &result->edge_count, &result->edges, &result->edge_bounds) ||
      take_rows(vertices, c->triangle_alive, c->triangles, own->envelope_tracker.triangle_bounds, c->triangle_count, 3,
                &result->triangle_count, &result->triangles, &result->triangle_bounds))
    return qmat_fail_memory(own->context, "a piece of the medial mesh");
  atomic_fetch_add(&d->done, c->vertex_count);
  return QMAT_OK;
}

static qmat_status collapse_piece(void *user, qmat_context *context, size_t piece) {
  partition *d = user;
  qmat_decimation own;
  qmat_constraint_points constraints;
  qmat_status status = start_piece(context, d, piece, &constraints, &own);
  if (status == QMAT_OK) status = qmat_decimation_run(&own);
  if (status == QMAT_OK) status = end_piece(d, piece, &own);
  qmat_decimation_uninit(&own);
  return status;
}

/* ---- the joined result ---- */

static size_t put_rows(const uint32_t *rows, size_t count, size_t size, const uint32_t *ids, uint32_t *out) {
  for (size_t i = 0; i < size * count; i++) out[i] = ids[rows[i]];
  return count;
}

static size_t put_rows_between(const partition *d, const piece_rows *sorted, const uint32_t *rows, size_t size,
                               const uint32_t *ids, uint32_t *out) {
  const size_t first = sorted->starts[d->piece_count], count = sorted->starts[d->piece_count + 1] - first;
  for (size_t i = 0; i < count; i++) put_rows(&rows[size * sorted->items[first + i]], 1, size, ids, &out[size * i]);
  return count;
}

/* Builds the medial mesh of all pieces; `ids` maps its vertices to their new numbers. */
static qmat_status join(const partition *d, const uint32_t *ids, qmat_medial *medial) {
  const qmat_complex *c = &d->whole->complex;
  uint32_t *edges = qmat_arena_alloc(&d->context->arena, c->edge_count, 2 * sizeof *edges);
  uint32_t *triangles = qmat_arena_alloc(&d->context->arena, c->triangle_count, 3 * sizeof *triangles);
  if (!edges || !triangles) return qmat_fail_memory(d->context, "the medial mesh");
  size_t edge_count = put_rows_between(d, &d->edges, c->edges, 2, ids, edges);
  size_t triangle_count = put_rows_between(d, &d->triangles, c->triangles, 3, ids, triangles);
  for (size_t p = 0; p < d->piece_count; p++) {
    const piece_result *result = &d->results[p];
    edge_count += put_rows(result->edges, result->edge_count, 2, ids, &edges[2 * edge_count]);
    triangle_count += put_rows(result->triangles, result->triangle_count, 3, ids, &triangles[3 * triangle_count]);
  }
  return qmat_medial_set_simplices(d->context, medial, edges, edge_count, triangles, triangle_count);
}

/* Carries over the counts of the pieces and the bounds of their edges and triangles. */
static void carry_results(const partition *d, const uint32_t *ids) {
  qmat_decimation *whole = d->whole;
  for (size_t p = 0; p < d->piece_count; p++) {
    const piece_result *result = &d->results[p];
    whole->counts.collapses += result->counts.collapses;
    whole->counts.refused_by_inside_test += result->counts.refused_by_inside_test;
    whole->counts.refused_by_surface_to_envelope += result->counts.refused_by_surface_to_envelope;
    whole->counts.refused_by_envelope_to_surface += result->counts.refused_by_envelope_to_surface;
    whole->counts.refused_by_topology += result->counts.refused_by_topology;
    qmat_envelope_to_surface_carry(&whole->envelope_tracker, &whole->complex, ids, 2, result->edges, NULL,
                                   result->edge_bounds, result->edge_count);
    qmat_envelope_to_surface_carry(&whole->envelope_tracker, &whole->complex, ids, 3, result->triangles, NULL,
                                   result->triangle_bounds, result->triangle_count);
  }
}

/* Replaces the whole by the joined results of the pieces. */
static qmat_status join_pieces(partition *d) {
  qmat_decimation *whole = d->whole;
  qmat_arena *arena = &d->context->arena;
  const size_t before = whole->complex.vertex_count;
  uint32_t *ids = qmat_arena_alloc(arena, before, sizeof *ids);
  qmat_medial *medial = qmat_medial_new();
  if (!ids || !medial) {
    qmat_value_release(medial ? &medial->base : NULL);
    return qmat_fail_memory(d->context, "the medial mesh");
  }
  double *spheres = whole->complex.spheres;
  size_t count = 0, sheet_vertices = 0;
  for (size_t v = 0; v < before; v++) {
    sheet_vertices += !d->gone[v] && qmat_decimation_is_of_sheet(whole, (uint32_t)v);
    ids[v] = d->gone[v] ? QMAT_NONE : (uint32_t)count;
    if (d->gone[v]) continue;
    memmove(&spheres[4 * count], &spheres[4 * v], 4 * sizeof *spheres);
    d->depths[count] = d->depths[v];
    whole->quadrics[count++] = whole->quadrics[v];
  }
  medial->sphere_count = count;
  whole->sheet_vertices = sheet_vertices;
  for (size_t i = 0; i < 3 * d->constraints->count; i++)
    if (d->constraints->witnesses[i] != QMAT_NONE) d->constraints->witnesses[i] = ids[d->constraints->witnesses[i]];
  qmat_status status = join(d, ids, medial);
  qmat_complex left = {.vertex_count = 0};
  if (status == QMAT_OK) status = qmat_complex_init(d->context, &left, medial, spheres);
  qmat_complex_uninit(&whole->complex);
  whole->complex = left;
  qmat_value_release(&medial->base);
  if (status == QMAT_OK) status = qmat_decimation_init(whole, d->constraints, d->depths);
  if (status != QMAT_OK) return status;
  carry_results(d, ids);
  return QMAT_OK;
}

static void free_results(const partition *d) {
  for (size_t p = 0; d->results && p < d->piece_count; p++) {
    qmat_free(d->results[p].edges);
    qmat_free(d->results[p].triangles);
    qmat_free(d->results[p].edge_bounds);
    qmat_free(d->results[p].triangle_bounds);
  }
}

/* A copy with witnesses and weights of its own; NULL when memory is short. */
static qmat_constraint_points *copy_constraints(qmat_context *context, const qmat_constraint_points *from) {
  qmat_constraint_points *copy = qmat_arena_alloc(&context->arena, 1, sizeof *copy);
  uint32_t *witnesses = qmat_arena_alloc(&context->arena, from->count, 3 * sizeof *witnesses);
  double *weights = qmat_arena_alloc(&context->arena, from->count, 3 * sizeof *weights);
  if (!copy || !witnesses || !weights) return NULL;
  if (from->count > 0) {
    memcpy(witnesses, from->witnesses, 3 * from->count * sizeof *witnesses);
    memcpy(weights, from->weights, 3 * from->count * sizeof *weights);
  }
  *copy = *from;
  copy->witnesses = witnesses;
  copy->weights = weights;
  return copy;
}

qmat_status qmat_collapse_partitioned(qmat_decimation *decimation, const qmat_constraint_points *constraints,
                                      const double *depths) {
  qmat_context *context = decimation->context;
  const qmat_complex *c = &decimation->complex;
  partition d = {.context = context, .whole = decimation, .constraints = copy_constraints(context, constraints)};
  d.depths = qmat_arena_alloc(&context->arena, c->vertex_count, sizeof *d.depths);
  decimation->quadrics = qmat_arena_calloc(&context->arena, c->vertex_count, sizeof *decimation->quadrics);
  if (!d.constraints || !d.depths || !decimation->quadrics)
    return qmat_fail_memory(context, "pieces of the medial mesh");
  memcpy(d.depths, depths, c->vertex_count * sizeof *depths);
  qmat_medial_quadrics_add(c, decimation->quadrics);
  qmat_status status = divide(&d);
  if (status == QMAT_OK)
    status = qmat_run_side_by_side(context, d.piece_count, collapse_piece, &d, &d.done, c->vertex_count, "collapses");
  if (status == QMAT_OK) status = join_pieces(&d);
  free_results(&d);
  return status;
}
