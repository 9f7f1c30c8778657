/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/coverage.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

typedef struct qmat_new_witness {
  uint32_t point, vertices[3];
  double weights[3];
} new_witness;

static void link_slot(qmat_coverage *coverage, uint32_t slot, uint32_t vertex) {
  const uint32_t head = coverage->heads[vertex];
  coverage->next[slot] = head;
  coverage->previous[slot] = QMAT_NONE;
  if (head != QMAT_NONE) coverage->previous[head] = slot;
  coverage->heads[vertex] = slot;
  coverage->slot_counts[vertex]++;
}

static void unlink_slot(qmat_coverage *coverage, uint32_t slot, uint32_t vertex) {
  const uint32_t next = coverage->next[slot], previous = coverage->previous[slot];
  if (next != QMAT_NONE) coverage->previous[next] = previous;
  if (previous != QMAT_NONE)
    coverage->next[previous] = next;
  else
    coverage->heads[vertex] = next;
  coverage->slot_counts[vertex]--;
}

qmat_status qmat_coverage_init(qmat_context *context, qmat_coverage *coverage, size_t point_count, const double *points,
                               double *limits, const uint32_t *witnesses, const double *weights, size_t vertex_count) {
  *coverage = (qmat_coverage){.point_count = point_count, .points = points, .limits = limits};
  if (point_count >= QMAT_NONE / 3) return qmat_fail_memory(context, "control points");
  coverage->witnesses = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  coverage->weights = qmat_alloc(point_count, 3 * sizeof(double));
  coverage->next = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  coverage->previous = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  coverage->heads = qmat_alloc(vertex_count, sizeof(uint32_t));
  coverage->slot_counts = qmat_calloc(vertex_count, sizeof(uint32_t));
  coverage->marks = qmat_calloc(point_count, sizeof(uint32_t));
  if (!coverage->witnesses || !coverage->weights || !coverage->next || !coverage->previous || !coverage->heads ||
      !coverage->slot_counts || !coverage->marks)
    return qmat_fail_memory(context, "control points");
  if (point_count > 0) {
    memcpy(coverage->witnesses, witnesses, 3 * point_count * sizeof *witnesses);
    memcpy(coverage->weights, weights, 3 * point_count * sizeof *weights);
  }
  for (size_t v = 0; v < vertex_count; v++) coverage->heads[v] = QMAT_NONE;
  for (size_t slot = 0; slot < 3 * point_count; slot++)
    if (witnesses[slot] != QMAT_NONE) link_slot(coverage, (uint32_t)slot, witnesses[slot]);
  return QMAT_OK;
}

void qmat_coverage_uninit(qmat_coverage *coverage) {
  qmat_free(coverage->witnesses);
  qmat_free(coverage->weights);
  qmat_free(coverage->next);
  qmat_free(coverage->previous);
  qmat_free(coverage->heads);
  qmat_free(coverage->slot_counts);
  qmat_free(coverage->marks);
  qmat_free(coverage->found);
  qmat_free(coverage->star.items);
  qmat_free(coverage->star.balls);
  qmat_free(coverage->link.items);
  qmat_free(coverage->link.balls);
  *coverage = (qmat_coverage){0};
}

/* F at the witness after the collapse: an upper bound of F there. */
static double witness_distance(const qmat_coverage *coverage, const qmat_complex *complex,
                               const qmat_collapse *collapse, const double sphere[4], size_t point) {
  double s[4] = {0, 0, 0, 0};
  for (size_t k = 0; k < 3; k++) {
    const uint32_t vertex = coverage->witnesses[3 * point + k];
    if (vertex == QMAT_NONE) break;
    const double weight = coverage->weights[3 * point + k];
    const double *corner =
        vertex == collapse->kept || vertex == collapse->removed ? sphere : &complex->spheres[4 * (size_t)vertex];
    for (int i = 0; i < 4; i++) s[i] += weight * corner[i];
  }
  return qmat_sphere_distance(s, &coverage->points[3 * point]);
}

/* A slab or loose cone of a star. */
typedef struct qmat_star_part {
  qmat_primitive primitive;
  uint32_t vertices[3]; /* the third QMAT_NONE: a cone */
} star_part;

static qmat_status add_part(qmat_context *context, qmat_star_parts *parts, const double *const spheres[3],
                            const uint32_t vertices[3]) {
  if (qmat_grow((void **)&parts->items, &parts->item_capacity, parts->count + 1, sizeof *parts->items) ||
      qmat_grow((void **)&parts->balls, &parts->ball_capacity, parts->count + 1, sizeof *parts->balls))
    return qmat_fail_memory(context, "the star of a collapse");
  star_part *part = &parts->items[parts->count];
  memcpy(part->vertices, vertices, sizeof part->vertices);
  qmat_primitive_prepare(spheres, vertices[2] == QMAT_NONE ? 2 : 3, &part->primitive, &parts->balls[parts->count]);
  parts->count++;
  return QMAT_OK;
}

/* Collapses leave the vertices of the link where they are, so that `sphere` stands for both ends of the edge. */
static const double *corner(const qmat_complex *complex, const qmat_collapse *collapse, const double *sphere,
                            uint32_t vertex) {
  return vertex == collapse->kept || vertex == collapse->removed ? sphere : &complex->spheres[4 * (size_t)vertex];
}

static qmat_status add_simplex(qmat_context *context, qmat_star_parts *parts, const qmat_complex *complex,
                               const qmat_collapse *collapse, const double *sphere, uint32_t a, uint32_t b,
                               uint32_t c) {
  const uint32_t vertices[3] = {a, b, c};
  const double *spheres[3] = {corner(complex, collapse, sphere, a), corner(complex, collapse, sphere, b), NULL};
  if (c != QMAT_NONE) spheres[2] = corner(complex, collapse, sphere, c);
  return add_part(context, parts, spheres, vertices);
}

qmat_status qmat_coverage_prepare(qmat_context *context, qmat_coverage *coverage, const qmat_complex *complex,
                                  const qmat_collapse *collapse, const double sphere[4]) {
  qmat_status status = QMAT_OK;
  coverage->star.count = coverage->link.count = 0;
  coverage->link_known = false;
  for (size_t t = 0; t < collapse->triangle_count && status == QMAT_OK; t++)
    status = add_simplex(context, &coverage->star, complex, collapse, sphere, collapse->kept,
                         collapse->triangle_pairs[2 * t], collapse->triangle_pairs[2 * t + 1]);
  for (size_t n = 0; n < collapse->neighbour_count && status == QMAT_OK; n++) {
    bool loose = true;
    for (size_t i = 0; i < 2 * collapse->triangle_count && loose; i++)
      loose = collapse->triangle_pairs[i] != collapse->neighbours[n];
    if (loose)
      status = add_simplex(context, &coverage->star, complex, collapse, sphere, collapse->kept, collapse->neighbours[n],
                           QMAT_NONE);
  }
  coverage->prepared = status == QMAT_OK;
  return status;
}

static bool is_touched(const qmat_collapse *collapse, const uint32_t *vertices, int count) {
  for (int k = 0; k < count; k++)
    if (vertices[k] == collapse->kept || vertices[k] == collapse->removed) return true;
  return false;
}

/* Prepares the primitives of the link's vertices that the collapse does not touch. */
static qmat_status prepare_link(qmat_context *context, qmat_coverage *coverage, const qmat_complex *complex,
                                const qmat_collapse *collapse) {
  qmat_status status = QMAT_OK;
  for (size_t n = 0; n < collapse->neighbour_count; n++) {
    const uint32_t vertex = collapse->neighbours[n];
    size_t count;
    const uint32_t *at = qmat_complex_triangles_at(complex, vertex, &count);
    for (size_t i = 0; i < count && status == QMAT_OK; i++) {
      const uint32_t *t = &complex->triangles[3 * (size_t)at[i]];
      if (!is_touched(collapse, t, 3))
        status = add_simplex(context, &coverage->link, complex, collapse, NULL, t[0], t[1], t[2]);
    }
    at = qmat_complex_edges_at(complex, vertex, &count);
    for (size_t i = 0; i < count && status == QMAT_OK; i++) {
      const uint32_t *ends = &complex->edges[2 * (size_t)at[i]];
      if (!complex->edge_triangles[at[i]] && !is_touched(collapse, ends, 2))
        status = add_simplex(context, &coverage->link, complex, collapse, NULL, ends[0], ends[1], QMAT_NONE);
    }
  }
  coverage->link_known = status == QMAT_OK;
  return status;
}

/* The nearest primitive of the merged vertex's star. */
static double search_star(const qmat_coverage *coverage, const qmat_collapse *collapse, const double sphere[4],
                          const double *point, new_witness *witness) {
  double best = qmat_sphere_distance(sphere, point);
  *witness = (new_witness){witness->point, {collapse->kept, QMAT_NONE, QMAT_NONE}, {1, 0, 0}};
  for (size_t i = 0; i < coverage->star.count; i++) {
    double weights[3];
    if (qmat_primitive_is_farther(&coverage->star.balls[i], point, best)) continue;
    const star_part *part = &coverage->star.items[i];
    const double f = qmat_primitive_foot(&part->primitive, point, weights);
    if (!(f < best)) continue;
    best = f;
    memcpy(witness->vertices, part->vertices, sizeof witness->vertices);
    memcpy(witness->weights, weights, sizeof witness->weights);
  }
  return best;
}

/* The nearest primitive of the link, or the first that comes as close as `enough`. */
static double search_link(const qmat_coverage *coverage, const double *point, double enough, new_witness *witness) {
  double best = INFINITY;
  for (size_t i = 0; i < coverage->link.count; i++) {
    double weights[3];
    if (qmat_primitive_is_farther(&coverage->link.balls[i], point, best)) continue;
    const star_part *part = &coverage->link.items[i];
    const double f = qmat_primitive_foot(&part->primitive, point, weights);
    if (!(f < best)) continue;
    best = f;
    memcpy(witness->vertices, part->vertices, sizeof witness->vertices);
    memcpy(witness->weights, weights, sizeof witness->weights);
    if (best <= enough) break;
  }
  return best;
}

static qmat_status test_point(qmat_context *context, qmat_coverage *coverage, const qmat_complex *complex,
                              const qmat_collapse *collapse, const double sphere[4], uint32_t point, bool *kept) {
  if (coverage->marks[point] == coverage->stamp) return QMAT_OK;
  coverage->marks[point] = coverage->stamp;
  const double limit = coverage->limits[point];
  if (witness_distance(coverage, complex, collapse, sphere, point) <= limit) return QMAT_OK;
  if (!coverage->prepared) {
    const qmat_status status = qmat_coverage_prepare(context, coverage, complex, collapse, sphere);
    if (status != QMAT_OK) return status;
  }
  if (qmat_grow((void **)&coverage->found, &coverage->found_capacity, coverage->found_count + 1,
                sizeof *coverage->found))
    return qmat_fail_memory(context, "witnesses");
  new_witness *witness = &coverage->found[coverage->found_count];
  witness->point = point;
  const double *p = &coverage->points[3 * (size_t)point];
  const double star = search_star(coverage, collapse, sphere, p, witness);
  if (star <= limit) {
    coverage->found_count++;
    return QMAT_OK;
  }
  if (!coverage->link_known) {
    const qmat_status status = prepare_link(context, coverage, complex, collapse);
    if (status != QMAT_OK) return status;
  }
  const double link = search_link(coverage, p, limit, witness);
  if (link <= limit) {
    coverage->found_count++;
    return QMAT_OK;
  }
  coverage->failed_distance = fmin(star, link);
  coverage->failed_point = point;
  *kept = false;
  return QMAT_OK;
}

double qmat_coverage_star_foot(const qmat_coverage *coverage, const qmat_complex *complex,
                               const qmat_collapse *collapse, const double sphere[4], const double point[3],
                               double foot[4], double *share) {
  new_witness witness = {.point = QMAT_NONE};
  const double distance = search_star(coverage, collapse, sphere, point, &witness);
  *share = witness.weights[0];
  for (int i = 0; i < 4; i++) foot[i] = witness.weights[0] * sphere[i];
  for (size_t k = 1; k < 3 && witness.vertices[k] != QMAT_NONE; k++)
    for (size_t i = 0; i < 4; i++)
      foot[i] += witness.weights[k] * complex->spheres[4 * (size_t)witness.vertices[k] + i];
  return distance;
}

/* Every point is looked at once in a walk over several lists: a new stamp marks those that were. */
static void start_marks(qmat_coverage *coverage) {
  if (++coverage->stamp > 0) return;
  memset(coverage->marks, 0, coverage->point_count * sizeof *coverage->marks);
  coverage->stamp = 1;
}

qmat_status qmat_coverage_error(qmat_context *context, qmat_coverage *coverage, const qmat_complex *complex,
                                const qmat_collapse *collapse, const double sphere[4], size_t point_count,
                                double *error) {
  qmat_status status = qmat_coverage_prepare(context, coverage, complex, collapse, sphere);
  if (status == QMAT_OK) status = prepare_link(context, coverage, complex, collapse);
  if (status != QMAT_OK) return status;
  *error = -INFINITY;
  start_marks(coverage);
  const uint32_t ends[2] = {collapse->kept, collapse->removed};
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++)
    for (uint32_t slot = coverage->heads[ends[e]]; slot != QMAT_NONE; slot = coverage->next[slot]) {
      const uint32_t point = slot / 3;
      if (point >= point_count || coverage->marks[point] == coverage->stamp) continue;
      coverage->marks[point] = coverage->stamp;
      const double *p = &coverage->points[3 * (size_t)point];
      new_witness witness = {.point = point};
      double f = witness_distance(coverage, complex, collapse, sphere, point);
      if (f > *error) f = fmin(f, search_star(coverage, collapse, sphere, p, &witness));
      if (f > *error) f = fmin(f, search_link(coverage, p, *error, &witness));
      *error = fmax(*error, f);
    }
  return QMAT_OK;
}

/* What a look at the slot will read: the lists run through memory at random, and waiting for it takes longer than the
 * look.
 */
static inline void fetch_ahead(const qmat_coverage *coverage, uint32_t slot) {
  if (slot == QMAT_NONE) return;
  const size_t point = slot / 3;
  __builtin_prefetch(&coverage->next[slot]);
  __builtin_prefetch(&coverage->marks[point]);
  __builtin_prefetch(&coverage->limits[point]);
  __builtin_prefetch(&coverage->witnesses[3 * point]);
  __builtin_prefetch(&coverage->weights[3 * point]);
  __builtin_prefetch(&coverage->points[3 * point]);
}

static bool touches(const qmat_coverage *coverage, const qmat_collapse *collapse, uint32_t point) {
  for (size_t k = 0; k < 3; k++) {
    const uint32_t vertex = coverage->witnesses[3 * (size_t)point + k];
    if (vertex != QMAT_NONE && (vertex == collapse->kept || vertex == collapse->removed)) return true;
  }
  return false;
}

qmat_status qmat_coverage_test(qmat_context *context, qmat_coverage *coverage, const qmat_complex *complex,
                               const qmat_collapse *collapse, const double sphere[4], uint32_t first, bool *kept) {
  *kept = true;
  coverage->found_count = 0;
  coverage->prepared = false;
  start_marks(coverage);
  qmat_status status = QMAT_OK;
  if (first != QMAT_NONE && touches(coverage, collapse, first))
    status = test_point(context, coverage, complex, collapse, sphere, first, kept);
  const uint32_t ends[2] = {collapse->kept, collapse->removed};
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++)
    for (uint32_t slot = coverage->heads[ends[e]], next; slot != QMAT_NONE && status == QMAT_OK && *kept; slot = next) {
      next = coverage->next[slot];
      fetch_ahead(coverage, next);
      status = test_point(context, coverage, complex, collapse, sphere, slot / 3, kept);
    }
  return status;
}

/* Drops a witness slot, which is linked at `vertex`; the last used slot of the point takes its place. */
static void drop_corner(qmat_coverage *coverage, uint32_t slot, uint32_t vertex) {
  unlink_slot(coverage, slot, vertex);
  uint32_t last = slot;
  while (last % 3 < 2 && coverage->witnesses[last + 1] != QMAT_NONE) last++;
  if (last != slot) {
    const uint32_t moved = coverage->witnesses[last];
    unlink_slot(coverage, last, moved);
    coverage->witnesses[slot] = moved;
    coverage->weights[slot] = coverage->weights[last];
    link_slot(coverage, slot, moved);
  }
  coverage->witnesses[last] = QMAT_NONE;
  coverage->weights[last] = 0;
}

/* The witnesses of `removed` become those of `kept`. */
static void merge_lists(qmat_coverage *coverage, uint32_t kept, uint32_t removed) {
  uint32_t tail = QMAT_NONE;
  for (uint32_t slot = coverage->heads[removed]; slot != QMAT_NONE;) {
    const uint32_t next = coverage->next[slot], first = slot - slot % 3;
    uint32_t twin = first;
    while (twin < first + 3 && coverage->witnesses[twin] != kept) twin++;
    if (twin < first + 3) {
      coverage->weights[twin] += coverage->weights[slot];
      drop_corner(coverage, slot, removed);
    } else {
      coverage->witnesses[slot] = kept;
      tail = slot;
    }
    slot = next;
  }
  if (tail != QMAT_NONE) {
    coverage->next[tail] = coverage->heads[kept];
    if (coverage->heads[kept] != QMAT_NONE) coverage->previous[coverage->heads[kept]] = tail;
    coverage->heads[kept] = coverage->heads[removed];
  }
  coverage->slot_counts[kept] += coverage->slot_counts[removed];
  coverage->heads[removed] = QMAT_NONE;
  coverage->slot_counts[removed] = 0;
}

void qmat_coverage_commit(qmat_coverage *coverage, const qmat_collapse *collapse) {
  if (collapse->removed != QMAT_NONE) merge_lists(coverage, collapse->kept, collapse->removed);
  for (size_t i = 0; i < coverage->found_count; i++) {
    const new_witness *w = &coverage->found[i];
    for (size_t k = 0; k < 3; k++) {
      const uint32_t slot = 3 * w->point + (uint32_t)k;
      if (coverage->witnesses[slot] != QMAT_NONE) unlink_slot(coverage, slot, coverage->witnesses[slot]);
      coverage->witnesses[slot] = w->vertices[k];
      coverage->weights[slot] = w->weights[k];
      if (w->vertices[k] != QMAT_NONE) link_slot(coverage, slot, w->vertices[k]);
    }
  }
  coverage->found_count = 0;
}
