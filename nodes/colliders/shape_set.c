/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/shape_set.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/morton.h"
#include "core/geometry/vector.h"

int qmat_shape_width(const uint32_t shape[3]) {
  return shape[1] == shape[0] ? 1 : shape[2] == shape[1] ? 2 : 3;
}

void qmat_shape_prepare(qmat_prepared_shape *shape, const double *spheres, const uint32_t ids[3]) {
  const double *a = &spheres[4 * (size_t)ids[0]], *b = &spheres[4 * (size_t)ids[1]], *c = &spheres[4 * (size_t)ids[2]];
  shape->count = qmat_shape_width(ids);
  memcpy(shape->sphere, a, sizeof shape->sphere);
  if (shape->count == 2) qmat_cone_prepare(&shape->cone, a, b);
  if (shape->count == 3) qmat_slab_prepare(&shape->slab, a, b, c);
}

double qmat_shape_distance(const qmat_prepared_shape *shape, const double point[3], double weights[3]) {
  if (!weights)
    return shape->count == 3   ? qmat_slab_prepared_distance(&shape->slab, point)
           : shape->count == 2 ? qmat_cone_prepared_distance(&shape->cone, point)
                               : qmat_sphere_distance(shape->sphere, point);
  weights[0] = 1;
  weights[1] = weights[2] = 0;
  return shape->count == 3   ? qmat_slab_foot(&shape->slab, point, weights)
         : shape->count == 2 ? qmat_cone_foot(&shape->cone, point, weights)
                             : qmat_sphere_distance(shape->sphere, point);
}

double qmat_shape_medial(const qmat_prepared_shape *shape, const double *spheres, const uint32_t ids[3],
                         const double point[3], double medial[4]) {
  double weights[3];
  const double distance = qmat_shape_distance(shape, point, weights);
  for (int k = 0; k < 4; k++) {
    medial[k] = 0;
    for (int s = 0; s < shape->count; s++) medial[k] += weights[s] * spheres[4 * (size_t)ids[s] + (size_t)k];
  }
  return distance;
}

double qmat_shape_volume(const double *spheres, const uint32_t ids[3]) {
  const double *s[3];
  for (int k = 0; k < 3; k++) s[k] = &spheres[4 * (size_t)ids[k]];
  const int width = qmat_shape_width(ids);
  if (width == 1) return 4 / 3.0 * QMAT_PI * s[0][3] * s[0][3] * s[0][3];
  if (width == 2) {
    const double length = qmat_point_distance(s[0], s[1]), a = s[0][3], b = s[1][3];
    const double larger = fmax(a, b);
    if (length <= fabs(a - b)) return 4 / 3.0 * QMAT_PI * larger * larger * larger;
    /* A frustum between the circles where it touches the spheres, and a cap of each sphere. */
    const double slope = (b - a) / length, rise2 = 1 - slope * slope;
    const double cap_a = a * (1 - slope), cap_b = b * (1 + slope), height = length + slope * (a - b);
    return QMAT_PI / 3 *
           (height * rise2 * (a * a + a * b + b * b) + cap_a * cap_a * (3 * a - cap_a) +
            cap_b * cap_b * (3 * b - cap_b));
  }
  double u[3], v[3], normal[3];
  qmat_subtract(s[1], s[0], u);
  qmat_subtract(s[2], s[0], v);
  qmat_cross(u, v, normal);
  const double area = 0.5 * sqrt(qmat_dot(normal, normal)), r = (s[0][3] + s[1][3] + s[2][3]) / 3;
  const double border =
      qmat_point_distance(s[0], s[1]) + qmat_point_distance(s[1], s[2]) + qmat_point_distance(s[2], s[0]);
  return 2 * area * r + 0.5 * QMAT_PI * r * r * border + 4 / 3.0 * QMAT_PI * r * r * r;
}

bool qmat_shape_set_same_joint(const qmat_shape_set *set, size_t a, size_t b) {
  return !set->joints || set->joints[set->shapes[3 * a]] == set->joints[set->shapes[3 * b]];
}

double qmat_shape_set_nearest_of_joint(const qmat_shape_set *set, const qmat_prepared_shape *shapes, uint32_t joint,
                                       const double point[3], size_t *nearest) {
  double least = INFINITY;
  for (size_t i = 0; i < set->shape_count; i++) {
    if (set->joints[set->shapes[3 * i]] != joint) continue;
    const double distance = qmat_shape_distance(&shapes[i], point, NULL);
    if (!(distance < least)) continue;
    least = distance;
    *nearest = i;
  }
  return least;
}

/* ---- a growing set ---- */

typedef struct builder {
  qmat_context *context;
  qmat_shape_set set;
  size_t sphere_room, shape_room;
  bool has_joints;
  uint32_t joint; /* of the spheres that are added */
  size_t most;    /* shapes */
  bool failed, too_many;
} builder;

static uint32_t add_sphere(builder *b, const double sphere[4]) {
  qmat_arena *arena = &b->context->arena;
  const size_t count = b->set.sphere_count;
  size_t of_joints = b->sphere_room;
  if (b->has_joints)
    b->failed =
        b->failed || qmat_arena_grow(arena, (void **)&b->set.joints, &of_joints, count + 1, sizeof *b->set.joints);
  b->failed = b->failed ||
              qmat_arena_grow(arena, (void **)&b->set.spheres, &b->sphere_room, count + 1, 4 * sizeof *b->set.spheres);
  if (b->failed) return 0;
  if (b->has_joints) b->set.joints[count] = b->joint;
  memcpy(&b->set.spheres[4 * count], sphere, 4 * sizeof *sphere);
  return (uint32_t)b->set.sphere_count++;
}

/* Adds a shape; ids in any order, equal ones for fewer spheres. */
static void add_shape(builder *b, uint32_t x, uint32_t y, uint32_t z) {
  b->too_many = b->too_many || b->set.shape_count == b->most;
  b->failed = b->failed || qmat_arena_grow(&b->context->arena, (void **)&b->set.shapes, &b->shape_room,
                                           b->set.shape_count + 1, 3 * sizeof *b->set.shapes);
  if (b->failed || b->too_many) return;
  uint32_t ids[3] = {x, y, z};
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++)
      if (ids[j] > ids[j + 1]) {
        const uint32_t higher = ids[j];
        ids[j] = ids[j + 1];
        ids[j + 1] = higher;
      }
  if (ids[0] == ids[1] && ids[1] != ids[2]) ids[1] = ids[2];
  memcpy(&b->set.shapes[3 * b->set.shape_count++], ids, sizeof ids);
}

static void interpolate(const double *a, const double *b, double t, double sphere[4]) {
  for (int k = 0; k < 4; k++) sphere[k] = (1 - t) * a[k] + t * b[k];
}

/* Where neighbours of a row from sphere s to t are, as shares of the way, so that the dents between them are at most
 * `dent` deep: at[0] = 0 to at[n] = 1. Where the row is thin they are closer; thinner than a dent does not count. The
 * number of steps n, or 0 where it would be above QMAT_MOST_IN_ROWS. */
static int place_along(const double s[4], const double t[4], double dent, double at[QMAT_MOST_IN_ROWS + 1]) {
  const double length = qmat_point_distance(s, t);
  int count = 0;
  at[0] = 0;
  while (at[count] < 1) {
    if (count == QMAT_MOST_IN_ROWS) return 0;
    double step = 1;
    for (int k = 0; k < 2; k++) { /* at the nearer end, then at the thinner one */
      const double next = fmin(at[count] + step, 1), here = s[3] + at[count] * (t[3] - s[3]);
      const double radius = fmax(k == 0 ? here : fmin(here, s[3] + next * (t[3] - s[3])), dent);
      step = length > 0 ? 2 * sqrt(dent * (2 * radius - dent)) / length : 1;
    }
    at[count + 1] = at[count] + step;
    count++;
  }
  for (int i = 1; i < count; i++) at[i] /= at[count];
  at[count] = 1;
  return count;
}

/* Spheres along the cone of two, without those at its ends. */
static void add_spheres_between(builder *b, const double *s, const double *t, double dent) {
  double first[4], last[4], sphere[4], at[QMAT_MOST_IN_ROWS + 1];
  memcpy(first, s, sizeof first); /* the array may move */
  memcpy(last, t, sizeof last);
  const int steps = place_along(first, last, dent, at);
  b->too_many = b->too_many || steps == 0;
  for (int i = 1; i < steps && !b->failed && !b->too_many; i++) {
    interpolate(first, last, at[i], sphere);
    const uint32_t id = add_sphere(b, sphere);
    add_shape(b, id, id, id);
  }
}

/* A slab as capsules or spheres: rows along its longest side up to the corner across. */
static void add_rows(builder *b, const uint32_t ids[3], qmat_shape_kind kind, double dent) {
  double s[3][4];
  int longest = 0;
  for (int k = 0; k < 3; k++) memcpy(s[k], &b->set.spheres[4 * (size_t)ids[k]], sizeof s[k]);
  for (int k = 1; k < 3; k++)
    if (qmat_point_distance(s[k], s[(k + 1) % 3]) > qmat_point_distance(s[longest], s[(longest + 1) % 3])) longest = k;
  const double *p = s[longest], *q = s[(longest + 1) % 3], *apex = s[(longest + 2) % 3];
  double u[3], v[3], normal[3];
  qmat_subtract(q, p, u);
  qmat_subtract(apex, p, v);
  qmat_cross(u, v, normal);
  const double side = sqrt(qmat_dot(u, u)), height = side > 0 ? sqrt(qmat_dot(normal, normal)) / side : 0;
  const double base[4] = {0, 0, 0, fmin(p[3], q[3])}, top[4] = {height, 0, 0, apex[3]};
  double at[QMAT_MOST_IN_ROWS + 1];
  const int rows = place_along(base, top, dent, at);
  b->too_many = b->too_many || rows == 0;
  for (int i = 0; i <= rows && !b->failed && !b->too_many; i++) {
    const bool first = i == 0;
    double left[4], right[4];
    interpolate(p, apex, at[i], left);
    interpolate(q, apex, at[i], right);
    const uint32_t l = first ? ids[longest] : i == rows ? ids[(longest + 2) % 3] : add_sphere(b, left);
    const uint32_t r = first ? ids[(longest + 1) % 3] : i == rows ? l : add_sphere(b, right);
    if (kind == QMAT_SHAPES_CAPSULES) {
      add_shape(b, l, r, r);
    } else {
      add_shape(b, l, l, l);
      add_shape(b, r, r, r);
      add_spheres_between(b, left, right, dent);
    }
  }
}

/* ---- what is redundant ---- */

/* Slabs first; then by ids. */
static int compare_shapes(const void *left, const void *right) {
  const uint32_t *a = left, *b = right;
  const int wide = qmat_shape_width(b) - qmat_shape_width(a);
  if (wide != 0) return wide;
  for (int k = 0; k < 3; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

/* Replaces a shape whose spheres contain each other by those that count. */
static void add_reduced(builder *b, const uint32_t ids[3]) {
  const int width = qmat_shape_width(ids);
  qmat_prepared_shape shape;
  qmat_shape_prepare(&shape, b->set.spheres, ids);
  if (width == 3 && !shape.slab.solid) {
    for (int k = 0; k < 3; k++) {
      const uint32_t side[3] = {ids[k], ids[(k + 1) % 3], ids[(k + 1) % 3]};
      add_reduced(b, side);
    }
  } else if (width == 2 && shape.cone.only) {
    const uint32_t id = ids[shape.cone.only - 1];
    add_shape(b, id, id, id);
  } else {
    add_shape(b, ids[0], ids[1], ids[2]);
  }
}

/* Whether every sphere of shape `inner` is inside `outer`. */
static bool holds(const qmat_prepared_shape *outer, const double *spheres, const uint32_t inner[3]) {
  const int width = qmat_shape_width(inner);
  for (int k = 0; k < width; k++) {
    const double *s = &spheres[4 * (size_t)inner[k]];
    if (!(qmat_shape_distance(outer, s, NULL) + s[3] <= 1e-12)) return false;
  }
  return true;
}

/* A box around a shape is larger by this, so that it holds the centres of all spheres that the shape holds. */
static const double around_shape = 1e-9;

/* Shapes, and those found to be inside others. */
typedef struct nesting {
  const qmat_shape_set *set;
  qmat_prepared_shape *prepared;
  uint8_t *dropped;
  qmat_curve_item *order;
  double (*boxes)[6];
  size_t leaf_count;
} nesting;

/* The box of a shape: the least x, y, z, then the largest. */
static void box_of(const qmat_shape_set *set, size_t shape, double box[6]) {
  for (int k = 0; k < 3; k++) {
    double low = INFINITY, high = -INFINITY;
    for (int c = 0; c < 3; c++) {
      const double *s = &set->spheres[4 * (size_t)set->shapes[3 * shape + (size_t)c]];
      low = fmin(low, s[k] - s[3]);
      high = fmax(high, s[k] + s[3]);
    }
    box[k] = low - around_shape;
    box[3 + k] = high + around_shape;
  }
}

static const double *centre_of(const qmat_shape_set *set, size_t shape) {
  return &set->spheres[4 * (size_t)set->shapes[3 * shape]];
}

/* Leaves of the tree have so many shapes at most. */
enum { LEAF_SIZE = 8 };

/* Makes the tree (qmat_curve_node_items): the boxes of the first centres of shapes. */
static bool make_tree(qmat_arena *arena, nesting *n) {
  const size_t count = n->set->shape_count;
  n->leaf_count = 1;
  while (n->leaf_count * LEAF_SIZE < count) n->leaf_count *= 2;
  n->order = qmat_arena_alloc(arena, count, sizeof *n->order);
  n->boxes = qmat_arena_alloc(arena, 2 * n->leaf_count, sizeof *n->boxes);
  if (!n->order || !n->boxes) return false;
  for (size_t i = 0; i < count; i++)
    n->order[i] = (qmat_curve_item){qmat_curve_code(centre_of(n->set, i)), (uint32_t)i};
  qmat_curve_sort(n->order, count);
  for (size_t node = 2 * n->leaf_count; node-- > 1;)
    for (size_t k = 0; k < 3; k++) {
      double low = INFINITY, high = -INFINITY;
      for (size_t c = 0; c < 2 && node < n->leaf_count; c++) {
        low = fmin(low, n->boxes[2 * node + c][k]);
        high = fmax(high, n->boxes[2 * node + c][3 + k]);
      }
      size_t i = 0, end = 0;
      if (node >= n->leaf_count) qmat_curve_node_items(count, n->leaf_count, node, &i, &end);
      for (; i < end; i++) {
        low = fmin(low, centre_of(n->set, n->order[i].id)[k]);
        high = fmax(high, centre_of(n->set, n->order[i].id)[k]);
      }
      n->boxes[node][k] = low;
      n->boxes[node][3 + k] = high;
    }
  return true;
}

/* Drops the shapes below a node that shape `outer` holds. Their centres are in its box. */
static void drop_below(nesting *n, size_t node, const double box[6], size_t outer) {
  const double *own = n->boxes[node];
  for (int k = 0; k < 3; k++)
    if (own[k] > box[3 + k] || own[3 + k] < box[k]) return;
  if (node < n->leaf_count) {
    drop_below(n, 2 * node, box, outer);
    drop_below(n, 2 * node + 1, box, outer);
    return;
  }
  size_t i, end;
  for (qmat_curve_node_items(n->set->shape_count, n->leaf_count, node, &i, &end); i < end; i++) {
    const size_t inner = n->order[i].id;
    n->dropped[inner] = n->dropped[inner] || (inner != outer && qmat_shape_set_same_joint(n->set, inner, outer) &&
                                              holds(&n->prepared[outer], n->set->spheres, &n->set->shapes[3 * inner]));
  }
}

/* Marks the shapes that are inside another one; of equal ones the first stays. One that is dropped drops no other: what
 * it holds is also inside the shape that holds it. */
static qmat_status mark_nested(qmat_context *context, const qmat_shape_set *set, uint8_t *dropped) {
  const size_t count = set->shape_count;
  nesting n = {.set = set, .dropped = dropped};
  if (count < 2) return QMAT_OK;
  n.prepared = qmat_arena_alloc(&context->arena, count, sizeof *n.prepared);
  if (!n.prepared || !make_tree(&context->arena, &n)) return qmat_fail_memory(context, "the colliders");
  for (size_t i = 0; i < count; i++) qmat_shape_prepare(&n.prepared[i], set->spheres, &set->shapes[3 * i]);
  for (size_t i = 0; i < count; i++) {
    const qmat_status status = qmat_progress(context, i, count, "shapes compared");
    double box[6];
    if (status != QMAT_OK) return status;
    box_of(set, i, box);
    if (!dropped[i]) drop_below(&n, 1, box, i);
  }
  return QMAT_OK;
}

qmat_status qmat_shape_set_reduce(qmat_context *context, qmat_shape_set *set) {
  builder b = {.context = context,
               .most = SIZE_MAX,
               .set = {.sphere_count = set->sphere_count, .spheres = set->spheres, .joints = set->joints}};
  for (size_t i = 0; i < set->shape_count; i++) add_reduced(&b, &set->shapes[3 * i]);
  const size_t count = b.set.shape_count;
  uint8_t *dropped = qmat_arena_calloc(&context->arena, count, 1);
  uint32_t *names = qmat_arena_alloc(&context->arena, set->sphere_count, sizeof *names);
  double *spheres = qmat_arena_alloc(&context->arena, set->sphere_count, 4 * sizeof *spheres);
  uint32_t *joints = set->joints ? qmat_arena_alloc(&context->arena, set->sphere_count, sizeof *joints) : NULL;
  if (b.failed || !dropped || !names || !spheres || (set->joints && !joints))
    return qmat_fail_memory(context, "the colliders");
  if (count > 0) qsort(b.set.shapes, count, 3 * sizeof *b.set.shapes, compare_shapes);
  const qmat_status status = mark_nested(context, &b.set, dropped);
  if (status != QMAT_OK) return status;
  memset(names, 0xff, set->sphere_count * sizeof *names);
  size_t kept = 0, used = 0;
  for (size_t i = 0; i < count; i++) {
    if (dropped[i]) continue;
    memmove(&b.set.shapes[3 * kept++], &b.set.shapes[3 * i], 3 * sizeof *b.set.shapes);
  }
  for (size_t i = 0; i < 3 * kept; i++) names[b.set.shapes[i]] = 0;
  for (size_t i = 0; i < set->sphere_count; i++) {
    if (names[i] != 0) continue;
    memcpy(&spheres[4 * used], &set->spheres[4 * i], 4 * sizeof *spheres);
    if (joints) joints[used] = set->joints[i];
    names[i] = (uint32_t)used++;
  }
  for (size_t i = 0; i < 3 * kept; i++) b.set.shapes[i] = names[b.set.shapes[i]];
  *set = (qmat_shape_set){
      .sphere_count = used, .shape_count = kept, .spheres = spheres, .shapes = b.set.shapes, .joints = joints};
  return QMAT_OK;
}

/* ---- from a medial mesh ---- */

static void add_simplex(builder *b, uint32_t x, uint32_t y, uint32_t z, qmat_shape_kind kind, double dent) {
  const uint32_t ids[3] = {x, y, z};
  if (b->has_joints) b->joint = b->set.joints[x];
  const int width = qmat_shape_width(ids);
  if (kind == QMAT_SHAPES_ANY || width == 1 || (kind == QMAT_SHAPES_CAPSULES && width == 2)) {
    add_shape(b, x, y, z);
  } else if (width == 3) {
    add_rows(b, ids, kind, kind == QMAT_SHAPES_SPHERES ? dent / 2 : dent);
  } else {
    add_shape(b, x, x, x);
    add_shape(b, y, y, y);
    add_spheres_between(b, &b->set.spheres[4 * (size_t)x], &b->set.spheres[4 * (size_t)y], dent);
  }
}

qmat_status qmat_shape_set_make(qmat_context *context, const qmat_medial *unit, const uint32_t *joints,
                                double least_radius, qmat_shape_kind kind, double dent, size_t most,
                                qmat_shape_set *set) {
  builder b = {.context = context, .most = most, .has_joints = joints};
  uint8_t *used = qmat_arena_calloc(&context->arena, unit->sphere_count, 1);
  b.failed = !used;
  for (size_t i = 0; i < unit->sphere_count && !b.failed; i++) {
    double sphere[4];
    memcpy(sphere, &unit->spheres[4 * i], sizeof sphere);
    sphere[3] = fmax(sphere[3], least_radius);
    if (joints) b.joint = joints[i];
    add_sphere(&b, sphere);
  }
  for (size_t i = 0; i < unit->triangle_count && !b.failed && !b.too_many; i++) {
    const uint32_t *row = &unit->triangles[3 * i];
    for (int k = 0; k < 3; k++) used[row[k]] = 1;
    add_simplex(&b, row[0], row[1], row[2], kind, dent);
  }
  for (size_t i = 0; i < unit->edge_count && !b.failed && !b.too_many; i++) {
    const uint32_t *row = &unit->edges[2 * i];
    used[row[0]] = used[row[1]] = 1;
    add_simplex(&b, row[0], row[1], row[1], kind, dent);
  }
  for (size_t i = 0; i < unit->sphere_count && !b.failed; i++)
    if (!used[i]) add_shape(&b, (uint32_t)i, (uint32_t)i, (uint32_t)i);
  if (b.failed) return qmat_fail_memory(context, "the colliders");
  *set = b.too_many ? (qmat_shape_set){.shape_count = SIZE_MAX} : b.set;
  return b.too_many ? QMAT_OK : qmat_shape_set_reduce(context, set);
}

qmat_status qmat_shape_set_envelope(qmat_context *context, const qmat_shape_set *set, qmat_envelope **envelope) {
  size_t slabs = 0, cones = 0;
  for (size_t i = 0; i < set->shape_count; i++) {
    const int width = qmat_shape_width(&set->shapes[3 * i]);
    slabs += width == 3;
    cones += width == 2;
  }
  uint32_t *edges = qmat_arena_alloc(&context->arena, cones, 2 * sizeof *edges);
  *envelope = NULL;
  if (!edges) return qmat_fail_memory(context, "the colliders");
  for (size_t i = 0; i < cones; i++) memcpy(&edges[2 * i], &set->shapes[3 * (slabs + i)], 2 * sizeof *edges);
  return qmat_envelope_new(context, set->spheres, set->sphere_count, edges, cones, set->shapes, slabs, envelope);
}
