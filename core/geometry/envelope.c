/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/envelope.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/medial_distance.h"
#include "core/geometry/vector.h"
#include "core/value_check.h"

/* LEAF_SIZE: the most primitives of a leaf. Median splits halve the count, so the depth stays below 64. */
enum { LEAF_SIZE = 3, STACK_SIZE = 72 };

/* A node of the hierarchy, in depth-first order: the left child follows its parent. */
typedef struct envelope_node {
  double low[3], high[3]; /* the box of the primitives */
  double largest;         /* the largest radius */
  uint32_t right;         /* the right child, or the first item of a leaf */
  uint32_t count;         /* the items of a leaf; 0: an inner node */
} envelope_node;

typedef struct envelope_item {
  uint32_t primitive; /* its number for the caller */
  uint32_t slot;      /* in the array of its kind */
} envelope_item;

struct qmat_envelope {
  size_t primitive_count, slab_count, cone_count, sphere_count, node_count;
  uint32_t *ids;    /* 3 per slab, then 2 per cone, then 1 per sphere */
  double *ends;     /* the spheres of the primitives: 4 doubles for each of `ids` */
  qmat_slab *slabs; /* slabs, cones and spheres in the order of the leaves */
  qmat_cone *cones;
  double *spheres;
  envelope_item *items;
  envelope_node *nodes;
};

static size_t ids_at(const qmat_envelope *envelope, size_t primitive, int *count) {
  size_t slabs = envelope->slab_count, cones = envelope->cone_count;
  if (primitive < slabs) {
    *count = 3;
    return 3 * primitive;
  }
  primitive -= slabs;
  if (primitive < cones) {
    *count = 2;
    return 3 * slabs + 2 * primitive;
  }
  *count = 1;
  return 3 * slabs + 2 * cones + (primitive - cones);
}

size_t qmat_envelope_primitive_count(const qmat_envelope *envelope) {
  return envelope->primitive_count;
}

int qmat_envelope_primitive(const qmat_envelope *envelope, size_t primitive, uint32_t ids[3]) {
  int count;
  size_t at = ids_at(envelope, primitive, &count);
  for (int i = 0; i < count; i++) ids[i] = envelope->ids[at + (size_t)i];
  return count;
}

void qmat_envelope_free(qmat_envelope *envelope) {
  if (!envelope) return;
  qmat_free(envelope->ids);
  qmat_free(envelope->ends);
  qmat_free(envelope->slabs);
  qmat_free(envelope->cones);
  qmat_free(envelope->spheres);
  qmat_free(envelope->items);
  qmat_free(envelope->nodes);
  qmat_free(envelope);
}

static int by_key(const void *left, const void *right) {
  uint64_t a = *(const uint64_t *)left, b = *(const uint64_t *)right;
  return (a > b) - (a < b);
}

static uint64_t edge_key(uint32_t a, uint32_t b) {
  return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

static bool has_key(const uint64_t *keys, size_t count, uint64_t key) {
  size_t low = 0;
  while (count > 0) {
    size_t half = count / 2;
    if (keys[low + half] < key) {
      low += half + 1;
      count -= half + 1;
    } else {
      count = half;
    }
  }
  return keys[low] == key; /* the array ends with a sentinel that is larger than every key */
}

/* Numbers the primitives: sets the counts, ids and ends. */
static qmat_status number_primitives(qmat_context *context, qmat_envelope *envelope, const double *spheres,
                                     size_t sphere_count, const uint32_t *edges, size_t edge_count,
                                     const uint32_t *triangles, size_t triangle_count) {
  qmat_status status = qmat_check_ids(context, edges, 2 * edge_count, sphere_count, "edge", 2, "sphere");
  if (status == QMAT_OK)
    status = qmat_check_ids(context, triangles, 3 * triangle_count, sphere_count, "triangle", 3, "sphere");
  if (status != QMAT_OK) return status;
  /* Items have 32-bit numbers. */
  if (triangle_count + edge_count + sphere_count > UINT32_MAX / 2)
    return qmat_fail_memory(context, "medial primitives");

  uint64_t *sides = qmat_alloc(3 * triangle_count + 1, sizeof *sides);
  bool *used = qmat_calloc(sphere_count, sizeof *used);
  envelope->ids = qmat_alloc(3 * triangle_count + 2 * edge_count + sphere_count, sizeof *envelope->ids);
  if (!sides || !used || !envelope->ids) {
    status = qmat_fail_memory(context, "medial primitives");
    goto done;
  }
  for (size_t t = 0; t < triangle_count; t++) {
    for (size_t k = 0; k < 3; k++) {
      uint32_t a = triangles[3 * t + k], b = triangles[3 * t + (k + 1) % 3];
      sides[3 * t + k] = edge_key(a, b);
      used[a] = true;
      envelope->ids[3 * t + k] = a;
    }
  }
  sides[3 * triangle_count] = UINT64_MAX;
  qsort(sides, 3 * triangle_count, sizeof *sides, by_key);
  size_t filled = 3 * triangle_count;
  envelope->slab_count = triangle_count;
  for (size_t e = 0; e < edge_count; e++) {
    uint32_t a = edges[2 * e], b = edges[2 * e + 1];
    used[a] = used[b] = true;
    if (has_key(sides, 3 * triangle_count, edge_key(a, b))) continue;
    envelope->ids[filled++] = a;
    envelope->ids[filled++] = b;
    envelope->cone_count++;
  }
  for (size_t i = 0; i < sphere_count; i++) {
    if (used[i]) continue;
    envelope->ids[filled++] = (uint32_t)i;
    envelope->sphere_count++;
  }
  envelope->primitive_count = envelope->slab_count + envelope->cone_count + envelope->sphere_count;
  envelope->ends = qmat_alloc(4 * filled, sizeof *envelope->ends);
  if (!envelope->ends) {
    status = qmat_fail_memory(context, "medial primitives");
    goto done;
  }
  for (size_t i = 0; i < filled; i++)
    memcpy(envelope->ends + 4 * i, spheres + 4 * (size_t)envelope->ids[i], 4 * sizeof *spheres);
done:
  qmat_free(sides);
  qmat_free(used);
  return status;
}

typedef struct hierarchy_build {
  qmat_envelope *envelope;
  double *centres; /* 3 per primitive: of its box */
  uint32_t *order; /* primitives, permuted */
  uint32_t next_slab, next_cone, next_sphere;
} hierarchy_build;

/* Orders by centre along the axis, then by number. The order is total, so results do not depend on the algorithm. */
static bool before(const hierarchy_build *build, int axis, uint32_t a, uint32_t b) {
  double x = build->centres[3 * (size_t)a + (size_t)axis], y = build->centres[3 * (size_t)b + (size_t)axis];
  return x < y || (x == y && a < b);
}

/* Hoare's selection: puts the element of rank `middle` at that index and all smaller ones before it. */
static void select_median(const hierarchy_build *build, int axis, size_t first, size_t end, size_t middle) {
  uint32_t *order = build->order;
  ptrdiff_t low = (ptrdiff_t)first, high = (ptrdiff_t)end - 1, wanted = (ptrdiff_t)middle;
  while (low < high) {
    uint32_t pivot = order[wanted];
    ptrdiff_t i = low, j = high;
    while (i <= j) {
      while (before(build, axis, order[i], pivot)) i++;
      while (before(build, axis, pivot, order[j])) j--;
      if (i > j) break;
      uint32_t swap = order[i];
      order[i++] = order[j];
      order[j--] = swap;
    }
    if (j < wanted) low = i;
    if (wanted < i) high = j;
  }
}

static void extend_box(envelope_node *node, const double low[3], const double high[3], double largest) {
  for (int k = 0; k < 3; k++) {
    node->low[k] = qmat_smaller(low[k], node->low[k]);
    node->high[k] = qmat_larger(high[k], node->high[k]);
  }
  node->largest = qmat_larger(largest, node->largest);
}

static void build_leaf(hierarchy_build *build, envelope_node *node, size_t low, size_t high) {
  qmat_envelope *envelope = build->envelope;
  node->right = (uint32_t)low;
  node->count = (uint32_t)(high - low);
  for (size_t i = low; i < high; i++) {
    int count;
    const double *ends = envelope->ends + 4 * ids_at(envelope, build->order[i], &count);
    uint32_t slot;
    if (count == 3) {
      slot = build->next_slab++;
      qmat_slab_prepare(&envelope->slabs[slot], ends, ends + 4, ends + 8);
    } else if (count == 2) {
      slot = build->next_cone++;
      qmat_cone_prepare(&envelope->cones[slot], ends, ends + 4);
    } else {
      slot = build->next_sphere++;
      memcpy(envelope->spheres + 4 * (size_t)slot, ends, 4 * sizeof *ends);
    }
    envelope->items[i] = (envelope_item){.primitive = build->order[i], .slot = slot};
    for (const double *end = ends; end < ends + 4 * (ptrdiff_t)count; end += 4) {
      const double from[3] = {end[0] - end[3], end[1] - end[3], end[2] - end[3]};
      const double to[3] = {end[0] + end[3], end[1] + end[3], end[2] + end[3]};
      extend_box(node, from, to, end[3]);
    }
  }
}

static void build_node(hierarchy_build *build, size_t low, size_t high) {
  qmat_envelope *envelope = build->envelope;
  envelope_node *node = &envelope->nodes[envelope->node_count++];
  *node = (envelope_node){.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
  if (high - low <= LEAF_SIZE) {
    build_leaf(build, node, low, high);
    return;
  }
  double from[3] = {INFINITY, INFINITY, INFINITY}, to[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = low; i < high; i++)
    for (int k = 0; k < 3; k++) {
      const double x = build->centres[3 * (size_t)build->order[i] + (size_t)k];
      from[k] = qmat_smaller(x, from[k]);
      to[k] = qmat_larger(x, to[k]);
    }
  int axis = 0;
  for (int k = 1; k < 3; k++) {
    if (to[k] - from[k] > to[axis] - from[axis]) axis = k;
  }
  size_t middle = low + (high - low) / 2;
  select_median(build, axis, low, high, middle);
  const envelope_node *left = &envelope->nodes[envelope->node_count];
  build_node(build, low, middle);
  const envelope_node *right = &envelope->nodes[envelope->node_count];
  node->right = (uint32_t)envelope->node_count;
  build_node(build, middle, high);
  extend_box(node, left->low, left->high, left->largest);
  extend_box(node, right->low, right->high, right->largest);
}

static qmat_status build_hierarchy(qmat_context *context, qmat_envelope *envelope) {
  size_t count = envelope->primitive_count;
  if (count == 0) return QMAT_OK;
  hierarchy_build build = {.envelope = envelope,
                           .centres = qmat_alloc(3 * count, sizeof *build.centres),
                           .order = qmat_alloc(count, sizeof *build.order)};
  envelope->slabs = qmat_alloc(envelope->slab_count, sizeof *envelope->slabs);
  envelope->cones = qmat_alloc(envelope->cone_count, sizeof *envelope->cones);
  envelope->spheres = qmat_alloc(4 * envelope->sphere_count, sizeof *envelope->spheres);
  envelope->items = qmat_alloc(count, sizeof *envelope->items);
  /* After a split every leaf has at least two items, so there are fewer nodes than primitives, or exactly one. */
  envelope->nodes = qmat_alloc(count + 1, sizeof *envelope->nodes);
  qmat_status status = QMAT_OK;
  if (!build.centres || !build.order || !envelope->slabs || !envelope->cones || !envelope->spheres ||
      !envelope->items || !envelope->nodes) {
    status = qmat_fail_memory(context, "medial primitives");
  } else {
    for (size_t i = 0; i < count; i++) {
      int ends;
      const double *end = envelope->ends + 4 * ids_at(envelope, i, &ends);
      for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int j = 0; j < ends; j++) {
          low = qmat_smaller(low, end[4 * j + k] - end[4 * j + 3]);
          high = qmat_larger(high, end[4 * j + k] + end[4 * j + 3]);
        }
        build.centres[3 * i + (size_t)k] = 0.5 * (low + high);
      }
      build.order[i] = (uint32_t)i;
    }
    build_node(&build, 0, count);
  }
  qmat_free(build.centres);
  qmat_free(build.order);
  return status;
}

qmat_status qmat_envelope_new(qmat_context *context, const double *spheres, size_t sphere_count, const uint32_t *edges,
                              size_t edge_count, const uint32_t *triangles, size_t triangle_count,
                              qmat_envelope **result) {
  *result = NULL;
  qmat_envelope *envelope = qmat_calloc(1, sizeof *envelope);
  if (!envelope) return qmat_fail_memory(context, "medial primitives");
  qmat_status status =
      number_primitives(context, envelope, spheres, sphere_count, edges, edge_count, triangles, triangle_count);
  if (status == QMAT_OK) status = build_hierarchy(context, envelope);
  if (status != QMAT_OK) {
    qmat_envelope_free(envelope);
    return status;
  }
  *result = envelope;
  return QMAT_OK;
}

qmat_status qmat_envelope_of_medial(qmat_context *context, const qmat_medial *medial, qmat_envelope **envelope) {
  return qmat_envelope_new(context, medial->spheres, medial->sphere_count, medial->edges, medial->edge_count,
                           medial->triangles, medial->triangle_count, envelope);
}

/* A lower bound of F over the node's primitives. Outside the box it is the distance to the box. Inside, a sphere's
 * radius is at most the distance of its centre to the box's sides, so a point at depth d in the box is at most d deep
 * in it. */
static inline double lower_bound(const envelope_node *node, const double p[3]) {
  double outside2 = 0, depth = -INFINITY;
  for (int k = 0; k < 3; k++) {
    double below = node->low[k] - p[k], above = p[k] - node->high[k], d = below > above ? below : above;
    depth = d > depth ? d : depth;
    outside2 += d > 0 ? d * d : 0;
  }
  if (depth > 0) return sqrt(outside2);
  return depth > -node->largest ? depth : -node->largest;
}

static inline double item_distance(const qmat_envelope *envelope, envelope_item item, const double p[3]) {
  if (item.primitive < envelope->slab_count) return qmat_slab_prepared_distance(&envelope->slabs[item.slot], p);
  if (item.primitive < envelope->slab_count + envelope->cone_count)
    return qmat_cone_prepared_distance(&envelope->cones[item.slot], p);
  return qmat_sphere_distance(envelope->spheres + 4 * (size_t)item.slot, p);
}

/* The smallest signed distance that is at most `limit` and the item that attains it; INFINITY when there is none. The
 * search ends early with the first distance below `enough`. */
static double search(const qmat_envelope *envelope, const double p[3], double limit, double enough,
                     envelope_item *nearest) {
  if (envelope->node_count == 0) return INFINITY;
  struct {
    double bound;
    uint32_t node;
  } stack[STACK_SIZE];
  int top = 0;
  bool found = false;
  double best = limit, bound = lower_bound(envelope->nodes, p);
  uint32_t at = 0;
  for (;;) {
    if (bound <= best) {
      const envelope_node *node = &envelope->nodes[at];
      if (node->count == 0) {
        uint32_t near = at + 1, far = node->right;
        double near_bound = lower_bound(&envelope->nodes[near], p), far_bound = lower_bound(&envelope->nodes[far], p);
        if (far_bound < near_bound) {
          double b = near_bound;
          near_bound = far_bound, far_bound = b;
          uint32_t n = near;
          near = far, far = n;
        }
        if (far_bound <= best) {
          stack[top].bound = far_bound;
          stack[top++].node = far;
        }
        at = near, bound = near_bound;
        continue;
      }
      for (uint32_t i = node->right; i < node->right + node->count; i++) {
        double d = item_distance(envelope, envelope->items[i], p);
        if (d < best || (d == best && !found)) {
          best = d;
          *nearest = envelope->items[i];
          found = true;
        }
      }
      if (found && best < enough) break;
    }
    if (top == 0) break;
    bound = stack[--top].bound;
    at = stack[top].node;
  }
  return found ? best : INFINITY;
}

double qmat_envelope_distance(const qmat_envelope *envelope, const double point[3], size_t *primitive) {
  envelope_item nearest = {0, 0};
  double distance = search(envelope, point, INFINITY, -INFINITY, &nearest);
  if (primitive) *primitive = nearest.primitive;
  return distance;
}

qmat_status qmat_envelope_distances(qmat_context *context, const qmat_envelope *envelope, const double *points,
                                    size_t count, double *distances) {
  enum { BATCH = 16384 }; /* points between two calls of the progress function */
  qmat_status status = QMAT_OK;
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count && status == QMAT_OK; first += BATCH) {
    const size_t end = count - first < BATCH ? count : first + BATCH;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t i = first; i < end; i++) distances[i] = qmat_envelope_distance(envelope, &points[3 * i], NULL);
    status = qmat_progress(context, end, count, "points");
  }
  return status;
}

double qmat_envelope_bound(const qmat_envelope *envelope, const double point[3], const double corners[][3], int count,
                           double enough, double *bound) {
  envelope_item nearest = {0, 0};
  const double distance = search(envelope, point, INFINITY, enough, &nearest);
  *bound = distance < INFINITY ? -INFINITY : INFINITY;
  if (!(distance < INFINITY)) return distance;
  for (int i = 0; i < count; i++) *bound = qmat_larger(*bound, item_distance(envelope, nearest, corners[i]));
  return distance;
}

double qmat_envelope_distance_within(const qmat_envelope *envelope, const double point[3], double limit) {
  envelope_item nearest;
  return search(envelope, point, limit, -INFINITY, &nearest);
}

bool qmat_envelope_holds(const qmat_envelope *envelope, const double point[3], double depth) {
  envelope_item nearest;
  return search(envelope, point, -depth, -depth, &nearest) < -depth;
}

/* The weights of the medial sphere of an item that attains its distance to the point. Returns the number of spheres. */
static int foot_on_item(const qmat_envelope *envelope, envelope_item item, const double point[3], double weights[3]) {
  int count;
  (void)ids_at(envelope, item.primitive, &count);
  weights[0] = 1;
  weights[1] = weights[2] = 0;
  if (count == 3) qmat_slab_foot(&envelope->slabs[item.slot], point, weights);
  if (count == 2) qmat_cone_foot(&envelope->cones[item.slot], point, weights);
  return count;
}

double qmat_envelope_foot_within(const qmat_envelope *envelope, const double point[3], double limit, size_t *primitive,
                                 uint32_t ids[3], double weights[3]) {
  envelope_item nearest;
  const double distance = search(envelope, point, limit, -INFINITY, &nearest);
  if (!(distance < INFINITY)) return distance;
  for (int i = foot_on_item(envelope, nearest, point, weights); i < 3; i++) ids[i] = UINT32_MAX;
  (void)qmat_envelope_primitive(envelope, nearest.primitive, ids);
  if (primitive) *primitive = nearest.primitive;
  return distance;
}

double qmat_envelope_nearest(const qmat_envelope *envelope, const double point[3], size_t *primitive,
                             double sphere[4]) {
  envelope_item nearest = {0, 0};
  double distance = search(envelope, point, INFINITY, -INFINITY, &nearest);
  if (primitive) *primitive = nearest.primitive;
  if (envelope->primitive_count == 0) return distance;
  int count;
  double weights[3];
  const double *ends = envelope->ends + 4 * ids_at(envelope, nearest.primitive, &count);
  (void)foot_on_item(envelope, nearest, point, weights);
  for (int k = 0; k < 4; k++) {
    sphere[k] = 0;
    for (int i = 0; i < count; i++) sphere[k] += weights[i] * ends[4 * i + k];
  }
  return distance;
}
