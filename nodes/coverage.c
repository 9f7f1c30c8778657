/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/coverage.h"

#include <math.h>
#include <string.h>

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
}

static void unlink_slot(qmat_coverage *coverage, uint32_t slot, uint32_t vertex) {
  const uint32_t next = coverage->next[slot], previous = coverage->previous[slot];
  if (next != QMAT_NONE) coverage->previous[next] = previous;
  if (previous != QMAT_NONE)
    coverage->next[previous] = next;
  else
    coverage->heads[vertex] = next;
}

qmat_status qmat_coverage_init(qmat_context *context, qmat_coverage *coverage, size_t point_count,
                               const double *points, double *limits, const uint32_t *witnesses, const double *weights,
                               size_t vertex_count) {
  *coverage = (qmat_coverage){.point_count = point_count, .points = points, .limits = limits};
  if (point_count >= QMAT_NONE / 3) return qmat_fail_memory(context, "control points");
  coverage->witnesses = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  coverage->weights = qmat_alloc(point_count, 3 * sizeof(double));
  coverage->next = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  coverage->previous = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  coverage->heads = qmat_alloc(vertex_count, sizeof(uint32_t));
  coverage->marks = qmat_calloc(point_count, sizeof(uint32_t));
  if (!coverage->witnesses || !coverage->weights || !coverage->next || !coverage->previous || !coverage->heads ||
      !coverage->marks)
    return qmat_fail_memory(context, "control points");
  memcpy(coverage->witnesses, witnesses, 3 * point_count * sizeof *witnesses);
  memcpy(coverage->weights, weights, 3 * point_count * sizeof *weights);
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
  qmat_free(coverage->marks);
  qmat_free(coverage->found);
  qmat_free(coverage->slabs);
  qmat_free(coverage->cones);
  qmat_free(coverage->cone_ends);
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

qmat_status qmat_coverage_prepare(qmat_context *context, qmat_coverage *coverage, const qmat_complex *complex,
                                  const qmat_collapse *collapse, const double sphere[4]) {
  if (qmat_grow((void **)&coverage->slabs, &coverage->slab_capacity, collapse->triangle_count,
                sizeof *coverage->slabs) ||
      qmat_grow((void **)&coverage->cones, &coverage->cone_capacity, collapse->neighbour_count,
                sizeof *coverage->cones) ||
      qmat_grow((void **)&coverage->cone_ends, &coverage->cone_end_capacity, collapse->neighbour_count,
                sizeof *coverage->cone_ends))
    return qmat_fail_memory(context, "the star of a collapse");
  for (size_t t = 0; t < collapse->triangle_count; t++)
    qmat_slab_prepare(&coverage->slabs[t], sphere, &complex->spheres[4 * (size_t)collapse->triangle_pairs[2 * t]],
                      &complex->spheres[4 * (size_t)collapse->triangle_pairs[2 * t + 1]]);
  coverage->cone_count = 0;
  for (size_t n = 0; n < collapse->neighbour_count; n++) {
    bool loose = true;
    for (size_t i = 0; i < 2 * collapse->triangle_count && loose; i++)
      loose = collapse->triangle_pairs[i] != collapse->neighbours[n];
    if (!loose) continue;
    qmat_cone_prepare(&coverage->cones[coverage->cone_count], sphere,
                      &complex->spheres[4 * (size_t)collapse->neighbours[n]]);
    coverage->cone_ends[coverage->cone_count++] = collapse->neighbours[n];
  }
  coverage->prepared = true;
  return QMAT_OK;
}

static void set_witness(new_witness *witness, uint32_t a, uint32_t b, uint32_t c, const double *weights, int count) {
  witness->vertices[0] = a;
  witness->vertices[1] = b;
  witness->vertices[2] = c;
  for (int k = 0; k < 3; k++) witness->weights[k] = k < count ? weights[k] : 0;
}

/* The nearest primitive of the merged vertex's star. */
static double search_star(const qmat_coverage *coverage, const qmat_collapse *collapse, const double sphere[4],
                          const double *point, new_witness *witness) {
  static const double whole[1] = {1};
  double best = qmat_sphere_distance(sphere, point);
  set_witness(witness, collapse->kept, QMAT_NONE, QMAT_NONE, whole, 1);
  for (size_t t = 0; t < collapse->triangle_count; t++) {
    double weights[3];
    const double f = qmat_slab_prepared_distance(&coverage->slabs[t], point);
    if (!(f < best)) continue;
    best = qmat_slab_foot(&coverage->slabs[t], point, weights);
    set_witness(witness, collapse->kept, collapse->triangle_pairs[2 * t], collapse->triangle_pairs[2 * t + 1], weights,
                3);
  }
  for (size_t n = 0; n < coverage->cone_count; n++) {
    double weights[2];
    const double f = qmat_cone_foot(&coverage->cones[n], point, weights);
    if (!(f < best)) continue;
    best = f;
    set_witness(witness, collapse->kept, coverage->cone_ends[n], QMAT_NONE, weights, 2);
  }
  return best;
}

/* The primitives of the link's vertices that the collapse does not touch, until one is within the limit. */
static bool search_link(const qmat_complex *complex, const qmat_collapse *collapse, const double *point, double limit,
                        new_witness *witness) {
  for (size_t n = 0; n < collapse->neighbour_count; n++) {
    const uint32_t vertex = collapse->neighbours[n];
    size_t count;
    const uint32_t *at = qmat_complex_triangles_at(complex, vertex, &count);
    for (size_t i = 0; i < count; i++) {
      const uint32_t *t = &complex->triangles[3 * (size_t)at[i]];
      bool touched = false;
      for (int k = 0; k < 3; k++) touched = touched || t[k] == collapse->kept || t[k] == collapse->removed;
      if (touched) continue;
      qmat_slab slab;
      double weights[3];
      qmat_slab_prepare(&slab, &complex->spheres[4 * (size_t)t[0]], &complex->spheres[4 * (size_t)t[1]],
                        &complex->spheres[4 * (size_t)t[2]]);
      if (qmat_slab_foot(&slab, point, weights) > limit) continue;
      set_witness(witness, t[0], t[1], t[2], weights, 3);
      return true;
    }
    at = qmat_complex_edges_at(complex, vertex, &count);
    for (size_t i = 0; i < count; i++) {
      if (complex->edge_triangles[at[i]]) continue;
      const uint32_t *ends = &complex->edges[2 * (size_t)at[i]];
      const uint32_t other = qmat_complex_other_end(complex, at[i], vertex);
      if (other == collapse->kept || other == collapse->removed) continue;
      qmat_cone cone;
      double weights[2];
      qmat_cone_prepare(&cone, &complex->spheres[4 * (size_t)ends[0]], &complex->spheres[4 * (size_t)ends[1]]);
      if (qmat_cone_foot(&cone, point, weights) > limit) continue;
      set_witness(witness, ends[0], ends[1], QMAT_NONE, weights, 2);
      return true;
    }
  }
  return false;
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
  if (search_star(coverage, collapse, sphere, p, witness) <= limit ||
      search_link(complex, collapse, p, limit, witness)) {
    coverage->found_count++;
    return QMAT_OK;
  }
  coverage->failed_point = point;
  *kept = false;
  return QMAT_OK;
}

double qmat_coverage_star_foot(const qmat_coverage *coverage, const qmat_complex *complex,
                               const qmat_collapse *collapse, const double sphere[4], const double point[3],
                               double foot[4], double *share) {
  new_witness witness;
  const double distance = search_star(coverage, collapse, sphere, point, &witness);
  *share = witness.weights[0];
  for (int i = 0; i < 4; i++) foot[i] = witness.weights[0] * sphere[i];
  for (size_t k = 1; k < 3 && witness.vertices[k] != QMAT_NONE; k++)
    for (size_t i = 0; i < 4; i++)
      foot[i] += witness.weights[k] * complex->spheres[4 * (size_t)witness.vertices[k] + i];
  return distance;
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
  if (++coverage->stamp == 0) {
    memset(coverage->marks, 0, coverage->point_count * sizeof *coverage->marks);
    coverage->stamp = 1;
  }
  qmat_status status = QMAT_OK;
  if (first != QMAT_NONE && touches(coverage, collapse, first))
    status = test_point(context, coverage, complex, collapse, sphere, first, kept);
  const uint32_t ends[2] = {collapse->kept, collapse->removed};
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++)
    for (uint32_t slot = coverage->heads[ends[e]]; slot != QMAT_NONE && status == QMAT_OK && *kept;
         slot = coverage->next[slot])
      status = test_point(context, coverage, complex, collapse, sphere, slot / 3, kept);
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
  coverage->heads[removed] = QMAT_NONE;
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
