/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/surface_to_envelope.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

typedef struct qmat_new_witness {
  uint32_t point, vertices[3];
  double weights[3];
} new_witness;

static void link_slot(qmat_surface_to_envelope *tracker, uint32_t slot, uint32_t vertex) {
  const uint32_t head = tracker->heads[vertex];
  tracker->next[slot] = head;
  tracker->previous[slot] = QMAT_NONE;
  if (head != QMAT_NONE) tracker->previous[head] = slot;
  tracker->heads[vertex] = slot;
  tracker->slot_counts[vertex]++;
  tracker->copy_starts[vertex] = SIZE_MAX;
}

static void unlink_slot(qmat_surface_to_envelope *tracker, uint32_t slot, uint32_t vertex) {
  const uint32_t next = tracker->next[slot], previous = tracker->previous[slot];
  if (next != QMAT_NONE) tracker->previous[next] = previous;
  if (previous != QMAT_NONE)
    tracker->next[previous] = next;
  else
    tracker->heads[vertex] = next;
  tracker->slot_counts[vertex]--;
  tracker->copy_starts[vertex] = SIZE_MAX;
}

qmat_status qmat_surface_to_envelope_init(qmat_context *context, qmat_surface_to_envelope *tracker, size_t point_count,
                                          const double *points, double *limits, const uint32_t *witnesses,
                                          const double *weights, size_t vertex_count) {
  *tracker = (qmat_surface_to_envelope){.point_count = point_count, .points = points, .limits = limits};
  if (point_count >= QMAT_NONE / 3) return qmat_fail_memory(context, "constraint points");
  tracker->witnesses = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  tracker->weights = qmat_alloc(point_count, 3 * sizeof(double));
  tracker->next = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  tracker->previous = qmat_alloc(point_count, 3 * sizeof(uint32_t));
  tracker->heads = qmat_alloc(vertex_count, sizeof(uint32_t));
  tracker->slot_counts = qmat_calloc(vertex_count, sizeof(uint32_t));
  tracker->marks = qmat_calloc(point_count, sizeof(uint32_t));
  tracker->copy_starts = qmat_alloc(vertex_count, sizeof *tracker->copy_starts);
  if (!tracker->witnesses || !tracker->weights || !tracker->next || !tracker->previous || !tracker->heads ||
      !tracker->slot_counts || !tracker->marks || !tracker->copy_starts)
    return qmat_fail_memory(context, "constraint points");
  if (point_count > 0) {
    memcpy(tracker->witnesses, witnesses, 3 * point_count * sizeof *witnesses);
    memcpy(tracker->weights, weights, 3 * point_count * sizeof *weights);
  }
  tracker->vertex_count = vertex_count;
  for (size_t v = 0; v < vertex_count; v++) {
    tracker->heads[v] = QMAT_NONE;
    tracker->copy_starts[v] = SIZE_MAX;
  }
  for (size_t slot = 0; slot < 3 * point_count; slot++)
    if (witnesses[slot] != QMAT_NONE) link_slot(tracker, (uint32_t)slot, witnesses[slot]);
  return QMAT_OK;
}

void qmat_surface_to_envelope_uninit(qmat_surface_to_envelope *tracker) {
  qmat_free(tracker->witnesses);
  qmat_free(tracker->weights);
  qmat_free(tracker->next);
  qmat_free(tracker->previous);
  qmat_free(tracker->heads);
  qmat_free(tracker->slot_counts);
  qmat_free(tracker->marks);
  qmat_free(tracker->copies);
  qmat_free(tracker->copy_starts);
  qmat_free(tracker->found);
  qmat_free(tracker->star.items);
  qmat_free(tracker->star.balls);
  qmat_free(tracker->link.items);
  qmat_free(tracker->link.balls);
  *tracker = (qmat_surface_to_envelope){0};
}

qmat_status qmat_surface_to_envelope_slots(qmat_context *context, qmat_surface_to_envelope *tracker, uint32_t vertex,
                                           const uint32_t **slots) {
  const size_t count = tracker->slot_counts[vertex], room = 6 * tracker->point_count;
  if (!tracker->copies && !(tracker->copies = qmat_alloc(room, sizeof *tracker->copies)))
    return qmat_fail_memory(context, "constraint points");
  if (tracker->copy_starts[vertex] == SIZE_MAX) {
    if (tracker->copied + count > room) { /* mostly copies of lists that have changed */
      for (size_t v = 0; v < tracker->vertex_count; v++) tracker->copy_starts[v] = SIZE_MAX;
      tracker->copied = 0;
    }
    tracker->copy_starts[vertex] = tracker->copied;
    for (uint32_t slot = tracker->heads[vertex]; slot != QMAT_NONE; slot = tracker->next[slot])
      tracker->copies[tracker->copied++] = slot;
  }
  *slots = tracker->copies + tracker->copy_starts[vertex];
  return QMAT_OK;
}

/* F at the witness after the collapse: an upper bound of F there. */
static double witness_distance(const qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                               const qmat_collapse *collapse, const double sphere[4], size_t point) {
  double s[4] = {0, 0, 0, 0};
  for (size_t k = 0; k < 3; k++) {
    const uint32_t vertex = tracker->witnesses[3 * point + k];
    if (vertex == QMAT_NONE) break;
    const double weight = tracker->weights[3 * point + k];
    const double *corner =
        vertex == collapse->kept || vertex == collapse->removed ? sphere : &complex->spheres[4 * (size_t)vertex];
    for (int i = 0; i < 4; i++) s[i] += weight * corner[i];
  }
  return qmat_sphere_distance(s, &tracker->points[3 * point]);
}

/* A slab or loose cone of a star. */
typedef struct qmat_star_primitive {
  qmat_primitive primitive;
  uint32_t vertices[3]; /* the third QMAT_NONE: a cone */
} star_primitive;

static qmat_status add_primitive(qmat_context *context, qmat_star_primitives *list, const double *const spheres[3],
                                 const uint32_t vertices[3]) {
  if (qmat_grow((void **)&list->items, &list->item_capacity, list->count + 1, sizeof *list->items) ||
      qmat_grow((void **)&list->balls, &list->ball_capacity, list->count + 1, sizeof *list->balls))
    return qmat_fail_memory(context, "the star of a collapse");
  star_primitive *item = &list->items[list->count];
  memcpy(item->vertices, vertices, sizeof item->vertices);
  qmat_primitive_prepare(spheres, vertices[2] == QMAT_NONE ? 2 : 3, &item->primitive, &list->balls[list->count]);
  list->count++;
  return QMAT_OK;
}

/* The link stays in place; `sphere` replaces both ends of the edge. */
static const double *corner(const qmat_complex *complex, const qmat_collapse *collapse, const double *sphere,
                            uint32_t vertex) {
  return vertex == collapse->kept || vertex == collapse->removed ? sphere : &complex->spheres[4 * (size_t)vertex];
}

static qmat_status add_simplex(qmat_context *context, qmat_star_primitives *list, const qmat_complex *complex,
                               const qmat_collapse *collapse, const double *sphere, uint32_t a, uint32_t b,
                               uint32_t c) {
  const uint32_t vertices[3] = {a, b, c};
  const double *spheres[3] = {corner(complex, collapse, sphere, a), corner(complex, collapse, sphere, b), NULL};
  if (c != QMAT_NONE) spheres[2] = corner(complex, collapse, sphere, c);
  return add_primitive(context, list, spheres, vertices);
}

qmat_status qmat_surface_to_envelope_prepare(qmat_context *context, qmat_surface_to_envelope *tracker,
                                             const qmat_complex *complex, const qmat_collapse *collapse,
                                             const double sphere[4]) {
  qmat_status status = QMAT_OK;
  tracker->star.count = tracker->link.count = 0;
  tracker->link_known = false;
  tracker->nearest = QMAT_NONE;
  for (size_t t = 0; t < collapse->triangle_count && status == QMAT_OK; t++)
    status = add_simplex(context, &tracker->star, complex, collapse, sphere, collapse->kept,
                         collapse->triangle_pairs[2 * t], collapse->triangle_pairs[2 * t + 1]);
  for (size_t n = 0; n < collapse->neighbour_count && status == QMAT_OK; n++) {
    bool loose = true;
    for (size_t i = 0; i < 2 * collapse->triangle_count && loose; i++)
      loose = collapse->triangle_pairs[i] != collapse->neighbours[n];
    if (loose)
      status = add_simplex(context, &tracker->star, complex, collapse, sphere, collapse->kept, collapse->neighbours[n],
                           QMAT_NONE);
  }
  tracker->prepared = status == QMAT_OK;
  return status;
}

static bool is_touched(const qmat_collapse *collapse, const uint32_t *vertices, int count) {
  for (int k = 0; k < count; k++)
    if (vertices[k] == collapse->kept || vertices[k] == collapse->removed) return true;
  return false;
}

/* Prepares the primitives at the link's vertices that the collapse does not touch. */
static qmat_status prepare_link(qmat_context *context, qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                                const qmat_collapse *collapse) {
  qmat_status status = QMAT_OK;
  for (size_t n = 0; n < collapse->neighbour_count; n++) {
    const uint32_t vertex = collapse->neighbours[n];
    size_t count;
    const uint32_t *at = qmat_complex_triangles_at(complex, vertex, &count);
    for (size_t i = 0; i < count && status == QMAT_OK; i++) {
      const uint32_t *t = &complex->triangles[3 * (size_t)at[i]];
      if (!is_touched(collapse, t, 3))
        status = add_simplex(context, &tracker->link, complex, collapse, NULL, t[0], t[1], t[2]);
    }
    at = qmat_complex_edges_at(complex, vertex, &count);
    for (size_t i = 0; i < count && status == QMAT_OK; i++) {
      const uint32_t *ends = &complex->edges[2 * (size_t)at[i]];
      if (!complex->edge_triangles[at[i]] && !is_touched(collapse, ends, 2))
        status = add_simplex(context, &tracker->link, complex, collapse, NULL, ends[0], ends[1], QMAT_NONE);
    }
  }
  tracker->link_known = status == QMAT_OK;
  return status;
}

/* A primitive whose ball is farther than the nearest by this is farther in spite of rounding. */
static const double surely = 1e-12;

/* The nearest primitive of the merged vertex's star, the first of equally near ones. `*first` is the one to try first,
 * QMAT_NONE for none, and becomes the nearest; it does not change the answer. */
static double search_star(const qmat_surface_to_envelope *tracker, const qmat_collapse *collapse,
                          const double sphere[4], const double *point, uint32_t *first, new_witness *witness) {
  const uint32_t start = *first;
  double best = qmat_sphere_distance(sphere, point);
  *witness = (new_witness){witness->point, {collapse->kept, QMAT_NONE, QMAT_NONE}, {1, 0, 0}};
  *first = QMAT_NONE;
  for (uint32_t n = start == QMAT_NONE; n <= tracker->star.count; n++) {
    const uint32_t i = n == 0 ? start : n - 1;
    double weights[3];
    if ((n > 0 && i == start) || qmat_primitive_is_farther(&tracker->star.balls[i], point, best + surely)) continue;
    const star_primitive *item = &tracker->star.items[i];
    const double f = qmat_primitive_foot_below(&item->primitive, point, best, weights);
    if (!(f < best || (f == best && *first != QMAT_NONE && i < *first))) continue;
    best = f;
    *first = i;
    memcpy(witness->vertices, item->vertices, sizeof witness->vertices);
    memcpy(witness->weights, weights, sizeof witness->weights);
  }
  return best;
}

/* The nearest primitive of the link, or the first within `enough`. */
static double search_link(const qmat_surface_to_envelope *tracker, const double *point, double enough,
                          new_witness *witness) {
  double best = INFINITY;
  for (size_t i = 0; i < tracker->link.count; i++) {
    double weights[3];
    if (qmat_primitive_is_farther(&tracker->link.balls[i], point, best)) continue;
    const star_primitive *item = &tracker->link.items[i];
    const double f = qmat_primitive_foot_below(&item->primitive, point, best, weights);
    if (!(f < best)) continue;
    best = f;
    memcpy(witness->vertices, item->vertices, sizeof witness->vertices);
    memcpy(witness->weights, weights, sizeof witness->weights);
    if (best <= enough) break;
  }
  return best;
}

static qmat_status test_point(qmat_context *context, qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                              const qmat_collapse *collapse, const double sphere[4], uint32_t point, bool *kept) {
  if (tracker->marks[point] == tracker->stamp) return QMAT_OK;
  tracker->marks[point] = tracker->stamp;
  const double limit = tracker->limits[point];
  if (witness_distance(tracker, complex, collapse, sphere, point) <= limit) return QMAT_OK;
  if (!tracker->prepared) {
    const qmat_status status = qmat_surface_to_envelope_prepare(context, tracker, complex, collapse, sphere);
    if (status != QMAT_OK) return status;
  }
  if (qmat_grow((void **)&tracker->found, &tracker->found_capacity, tracker->found_count + 1, sizeof *tracker->found))
    return qmat_fail_memory(context, "witnesses");
  new_witness *witness = &tracker->found[tracker->found_count];
  witness->point = point;
  const double *p = &tracker->points[3 * (size_t)point];
  const double star = search_star(tracker, collapse, sphere, p, &tracker->nearest, witness);
  if (star <= limit) {
    tracker->found_count++;
    return QMAT_OK;
  }
  if (!tracker->link_known) {
    const qmat_status status = prepare_link(context, tracker, complex, collapse);
    if (status != QMAT_OK) return status;
  }
  const double link = search_link(tracker, p, limit, witness);
  if (link <= limit) {
    tracker->found_count++;
    return QMAT_OK;
  }
  tracker->failed_distance = fmin(star, link);
  tracker->failed_point = point;
  *kept = false;
  return QMAT_OK;
}

double qmat_surface_to_envelope_star_foot(const qmat_surface_to_envelope *tracker, const qmat_complex *complex,
                                          const qmat_collapse *collapse, const double sphere[4], const double point[3],
                                          uint32_t *nearest, double foot[4], double *share) {
  new_witness witness = {.point = QMAT_NONE};
  const double distance = search_star(tracker, collapse, sphere, point, nearest, &witness);
  *share = witness.weights[0];
  for (int i = 0; i < 4; i++) foot[i] = witness.weights[0] * sphere[i];
  for (size_t k = 1; k < 3 && witness.vertices[k] != QMAT_NONE; k++)
    for (size_t i = 0; i < 4; i++)
      foot[i] += witness.weights[k] * complex->spheres[4 * (size_t)witness.vertices[k] + i];
  return distance;
}

/* A point that is in several lists is tested once: a new stamp marks the points that were. */
static void start_marks(qmat_surface_to_envelope *tracker) {
  if (++tracker->stamp > 0) return;
  memset(tracker->marks, 0, tracker->point_count * sizeof *tracker->marks);
  tracker->stamp = 1;
}

qmat_status qmat_surface_to_envelope_of_collapse(qmat_context *context, qmat_surface_to_envelope *tracker,
                                                 const qmat_complex *complex, const qmat_collapse *collapse,
                                                 const double sphere[4], size_t point_count, double *error) {
  qmat_status status = qmat_surface_to_envelope_prepare(context, tracker, complex, collapse, sphere);
  if (status == QMAT_OK) status = prepare_link(context, tracker, complex, collapse);
  if (status != QMAT_OK) return status;
  *error = -INFINITY;
  start_marks(tracker);
  const uint32_t ends[2] = {collapse->kept, collapse->removed};
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++)
    for (uint32_t slot = tracker->heads[ends[e]]; slot != QMAT_NONE; slot = tracker->next[slot]) {
      const uint32_t point = slot / 3;
      if (point >= point_count || tracker->marks[point] == tracker->stamp) continue;
      tracker->marks[point] = tracker->stamp;
      const double *p = &tracker->points[3 * (size_t)point];
      new_witness witness = {.point = point};
      double f = witness_distance(tracker, complex, collapse, sphere, point);
      uint32_t nearest = QMAT_NONE;
      if (f > *error) f = fmin(f, search_star(tracker, collapse, sphere, p, &nearest, &witness));
      if (f > *error) f = fmin(f, search_link(tracker, p, *error, &witness));
      *error = fmax(*error, f);
    }
  return QMAT_OK;
}

/* Prefetches what the test of a slot reads. The lists run through memory at random, and waiting takes longer than the
 * test. */
static inline void fetch_ahead(const qmat_surface_to_envelope *tracker, uint32_t slot) {
  if (slot == QMAT_NONE) return;
  const size_t point = slot / 3;
  __builtin_prefetch(&tracker->next[slot]);
  __builtin_prefetch(&tracker->marks[point]);
  __builtin_prefetch(&tracker->limits[point]);
  __builtin_prefetch(&tracker->witnesses[3 * point]);
  __builtin_prefetch(&tracker->weights[3 * point]);
  __builtin_prefetch(&tracker->points[3 * point]);
}

/* The slots of a copied list that are fetched early. */
enum { AHEAD = 4 };

static bool touches(const qmat_surface_to_envelope *tracker, const qmat_collapse *collapse, uint32_t point) {
  for (size_t k = 0; k < 3; k++) {
    const uint32_t vertex = tracker->witnesses[3 * (size_t)point + k];
    if (vertex != QMAT_NONE && (vertex == collapse->kept || vertex == collapse->removed)) return true;
  }
  return false;
}

qmat_status qmat_surface_to_envelope_test(qmat_context *context, qmat_surface_to_envelope *tracker,
                                          const qmat_complex *complex, const qmat_collapse *collapse,
                                          const double sphere[4], uint32_t first, bool *kept) {
  *kept = true;
  tracker->found_count = 0;
  tracker->prepared = false;
  start_marks(tracker);
  qmat_status status = QMAT_OK;
  if (first != QMAT_NONE && touches(tracker, collapse, first))
    status = test_point(context, tracker, complex, collapse, sphere, first, kept);
  const uint32_t ends[2] = {collapse->kept, collapse->removed};
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++) {
    if (tracker->copy_starts[ends[e]] != SIZE_MAX) {
      const uint32_t *list = tracker->copies + tracker->copy_starts[ends[e]];
      const size_t count = tracker->slot_counts[ends[e]];
      for (size_t i = 0; i < count && status == QMAT_OK && *kept; i++) {
        if (i + AHEAD < count) fetch_ahead(tracker, list[i + AHEAD]);
        status = test_point(context, tracker, complex, collapse, sphere, list[i] / 3, kept);
      }
      continue;
    }
    for (uint32_t slot = tracker->heads[ends[e]], next; slot != QMAT_NONE && status == QMAT_OK && *kept; slot = next) {
      next = tracker->next[slot];
      fetch_ahead(tracker, next);
      status = test_point(context, tracker, complex, collapse, sphere, slot / 3, kept);
    }
  }
  return status;
}

/* Drops a witness slot of `vertex`; the last used slot of the point takes its place. */
static void drop_corner(qmat_surface_to_envelope *tracker, uint32_t slot, uint32_t vertex) {
  unlink_slot(tracker, slot, vertex);
  uint32_t last = slot;
  while (last % 3 < 2 && tracker->witnesses[last + 1] != QMAT_NONE) last++;
  if (last != slot) {
    const uint32_t moved = tracker->witnesses[last];
    unlink_slot(tracker, last, moved);
    tracker->witnesses[slot] = moved;
    tracker->weights[slot] = tracker->weights[last];
    link_slot(tracker, slot, moved);
  }
  tracker->witnesses[last] = QMAT_NONE;
  tracker->weights[last] = 0;
}

/* Moves the witnesses of `removed` to `kept`. */
static void merge_lists(qmat_surface_to_envelope *tracker, uint32_t kept, uint32_t removed) {
  uint32_t tail = QMAT_NONE;
  for (uint32_t slot = tracker->heads[removed]; slot != QMAT_NONE;) {
    const uint32_t next = tracker->next[slot], first = slot - slot % 3;
    uint32_t twin = first;
    while (twin < first + 3 && tracker->witnesses[twin] != kept) twin++;
    if (twin < first + 3) {
      tracker->weights[twin] += tracker->weights[slot];
      drop_corner(tracker, slot, removed);
    } else {
      tracker->witnesses[slot] = kept;
      tail = slot;
    }
    slot = next;
  }
  if (tail != QMAT_NONE) {
    tracker->next[tail] = tracker->heads[kept];
    if (tracker->heads[kept] != QMAT_NONE) tracker->previous[tracker->heads[kept]] = tail;
    tracker->heads[kept] = tracker->heads[removed];
  }
  tracker->slot_counts[kept] += tracker->slot_counts[removed];
  tracker->heads[removed] = QMAT_NONE;
  tracker->slot_counts[removed] = 0;
  tracker->copy_starts[kept] = tracker->copy_starts[removed] = SIZE_MAX;
}

void qmat_surface_to_envelope_commit(qmat_surface_to_envelope *tracker, const qmat_collapse *collapse) {
  if (collapse->removed != QMAT_NONE) merge_lists(tracker, collapse->kept, collapse->removed);
  for (size_t i = 0; i < tracker->found_count; i++) {
    const new_witness *w = &tracker->found[i];
    for (size_t k = 0; k < 3; k++) {
      const uint32_t slot = 3 * w->point + (uint32_t)k;
      if (tracker->witnesses[slot] != QMAT_NONE) unlink_slot(tracker, slot, tracker->witnesses[slot]);
      tracker->witnesses[slot] = w->vertices[k];
      tracker->weights[slot] = w->weights[k];
      if (w->vertices[k] != QMAT_NONE) link_slot(tracker, slot, w->vertices[k]);
    }
  }
  tracker->found_count = 0;
}

uint32_t qmat_surface_to_envelope_owner(const qmat_surface_to_envelope *tracker, size_t point) {
  uint32_t best = 0;
  for (uint32_t k = 1; k < 3; k++)
    if (tracker->witnesses[3 * point + k] != QMAT_NONE &&
        tracker->weights[3 * point + k] > tracker->weights[3 * point + best])
      best = k;
  return tracker->witnesses[3 * point + best];
}
