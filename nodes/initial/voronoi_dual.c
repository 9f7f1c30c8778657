/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/voronoi_dual.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/thickness.h"
#include "core/geometry/vector.h"
#include "core/json_text.h"
#include "nodes/initial/delaunay_cgal.h"
#include "nodes/initial/edge_halving.h"
#include "nodes/initial/sample_thinning.h"

#define NONE UINT32_MAX

typedef enum { CELL_DROPPED, CELL_CIRCUMCENTRE, CELL_INCENTRE } cell_kind;

/* What is known while the node runs; all arrays live in the context's arena. */
typedef struct {
  qmat_context *context;
  const qmat_dual_params *params;
  const qmat_mesh *mesh;
  const qmat_samples *samples;
  const qmat_surface *surface;
  const double *points;      /* samples in the unit frame */
  const uint8_t *thin;       /* per sample */
  const uint32_t *parts;     /* per vertex of the mesh: its connected part of the surface; NULL: there is one */
  const uint32_t *stand_ins; /* per sample: the one that is triangulated in its place, itself when it is one */
  size_t site_count;         /* samples that are triangulated */
  qmat_tetrahedra cells;     /* with samples as corners */
  uint8_t *kinds;            /* per cell */
  double *spheres;           /* 4 per cell, unit frame */
  uint32_t *sphere_of;       /* per cell: its medial vertex, or NONE */
  size_t sphere_count;
  uint32_t *edges, *triangles;
  size_t edge_count, triangle_count;
} delaunay;

/* The circumcentre and circumradius of a tetrahedron; false when it is too flat to have one inside the unit frame. */
static bool circumsphere(const double *const p[4], double sphere[4]) {
  double e[3][3], square[3], normal[3][3];
  for (int k = 0; k < 3; k++) {
    qmat_subtract(p[k + 1], p[0], e[k]);
    square[k] = qmat_dot(e[k], e[k]);
  }
  for (int k = 0; k < 3; k++) qmat_cross(e[(k + 1) % 3], e[(k + 2) % 3], normal[k]);
  const double determinant = qmat_dot(e[0], normal[0]);
  if (determinant == 0) return false;
  double offset[3];
  for (int i = 0; i < 3; i++) {
    offset[i] = (square[0] * normal[0][i] + square[1] * normal[1][i] + square[2] * normal[2][i]) / (2 * determinant);
    sphere[i] = p[0][i] + offset[i];
    if (!(fabs(sphere[i]) <= 0.5)) return false; /* outside the bounding box, or not finite */
  }
  sphere[3] = sqrt(qmat_dot(offset, offset));
  return true;
}

/* The centre of the inscribed sphere: the corners weighted by the areas of the facets opposite them. */
static void incentre(const double *const p[4], double centre[3]) {
  double total = 0, sum[3] = {0, 0, 0};
  for (int k = 0; k < 4; k++) {
    const double *a = p[(k + 1) & 3], *b = p[(k + 2) & 3], *c = p[(k + 3) & 3];
    double ab[3], ac[3], n[3];
    qmat_subtract(b, a, ab);
    qmat_subtract(c, a, ac);
    qmat_cross(ab, ac, n);
    const double area = sqrt(qmat_dot(n, n));
    for (int i = 0; i < 3; i++) sum[i] += area * p[k][i];
    total += area;
  }
  for (int i = 0; i < 3; i++) centre[i] = total > 0 ? sum[i] / total : 0.25 * (p[0][i] + p[1][i] + p[2][i] + p[3][i]);
}

/* Coplanar samples are so only up to rounding, which leaves flat tetrahedra on the surface whose side is a matter of
 * chance. A point this close to the surface (unit frame) does not count as inside. */
static const double least_depth = 1e-8;

static bool deep_inside(const qmat_surface *surface, const double *point) {
  return qmat_surface_inside(surface, point) &&
         !(qmat_surface_distance(surface, point, least_depth, NULL, NULL) <= least_depth);
}

/* Finds the connected parts of the surface, each named by its smallest vertex. */
static qmat_status find_surface_parts(delaunay *d) {
  const qmat_mesh *mesh = d->mesh;
  uint32_t *part = qmat_sets_new(d->context, mesh->vertex_count);
  if (!part) return qmat_fail_memory(d->context, "parts of the surface");
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    qmat_sets_join(part, mesh->triangles[3 * t], mesh->triangles[3 * t + 1]);
    qmat_sets_join(part, mesh->triangles[3 * t], mesh->triangles[3 * t + 2]);
  }
  size_t count = 0;
  for (size_t i = 0; i < mesh->vertex_count; i++) {
    part[i] = qmat_set_leader(part, (uint32_t)i);
    count += part[i] == i;
  }
  d->parts = count > 1 ? part : NULL;
  return QMAT_OK;
}

static uint32_t part_of_sample(const delaunay *d, uint32_t sample) {
  return d->parts ? d->parts[d->mesh->triangles[3 * (size_t)d->samples->facets[sample]]] : 0;
}

/* Whether a tetrahedron reaches from one part of the surface to another through the outside, as a needle between two
 * solids does: its incentre may all the same lie inside, between the samples and the surface that bulges past them. */
static bool spans_gap(const delaunay *d, const uint32_t *corners) {
  for (int a = 0; a < 3 && d->parts; a++)
    for (int b = a + 1; b < 4; b++) {
      if (part_of_sample(d, corners[a]) == part_of_sample(d, corners[b])) continue;
      double middle[3];
      for (size_t k = 0; k < 3; k++)
        middle[k] = 0.5 * (d->points[3 * (size_t)corners[a] + k] + d->points[3 * (size_t)corners[b] + k]);
      if (!qmat_surface_inside(d->surface, middle) &&
          qmat_surface_distance(d->surface, middle, d->params->detail, NULL, NULL) > d->params->detail)
        return true;
    }
  return false;
}

/* Algorithm 1 for one tetrahedron. With completion "all" a tetrahedron belongs to the solid when its incentre does;
 * its medial vertex is the circumcentre where that is inside too. */
static cell_kind select_medial_vertex(const delaunay *d, size_t cell, double sphere[4]) {
  const uint32_t *corner = &d->cells.corners[4 * cell];
  const double *p[4];
  bool thin = true;
  for (int k = 0; k < 4; k++) {
    p[k] = &d->points[3 * (size_t)corner[k]];
    thin = thin && d->thin[corner[k]];
  }
  double centre[3];
  incentre(p, centre);
  const bool all = d->params->completion == QMAT_COMPLETION_ALL;
  const bool in_solid = (all || thin) && deep_inside(d->surface, centre);
  if (all && (!in_solid || spans_gap(d, corner))) return CELL_DROPPED;
  if (circumsphere(p, sphere) && qmat_surface_inside(d->surface, sphere)) {
    const double nearest = fmin(qmat_surface_distance(d->surface, sphere, sphere[3], NULL, NULL), sphere[3]);
    if (nearest > least_depth) {
      if (d->params->radius == QMAT_RADIUS_DISTANCE) sphere[3] = nearest;
      return CELL_CIRCUMCENTRE;
    }
  }
  if (!in_solid) return CELL_DROPPED;
  memcpy(sphere, centre, sizeof centre);
  sphere[3] = qmat_surface_distance(d->surface, centre, INFINITY, NULL, NULL);
  return CELL_INCENTRE;
}

static qmat_status select_medial_vertices(delaunay *d) {
  qmat_context *context = d->context;
  const size_t count = d->cells.count, slice = 1 << 11;
  d->kinds = qmat_arena_alloc(&context->arena, count, sizeof *d->kinds);
  d->spheres = qmat_arena_alloc(&context->arena, count, 4 * sizeof *d->spheres);
  if (!d->kinds || !d->spheres) return qmat_fail_memory(context, "medial vertices");
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count; first += slice) {
    const qmat_status status = qmat_progress(context, first, count, "tetrahedra");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t cell = first; cell < last; cell++)
      d->kinds[cell] = (uint8_t)select_medial_vertex(d, cell, &d->spheres[4 * cell]);
  }
  return QMAT_OK;
}

/* Numbers the medial vertices: one for each set of adjacent kept tetrahedra whose centres lie close together. It is the
 * sets' leading centres that are compared, so that a row of close centres does not become one. */
static qmat_status number_medial_vertices(delaunay *d) {
  const size_t count = d->cells.count;
  uint32_t *parent = qmat_sets_new(d->context, count);
  d->sphere_of = qmat_arena_alloc(&d->context->arena, count, sizeof *d->sphere_of);
  if (!parent || !d->sphere_of) return qmat_fail_memory(d->context, "medial vertices");
  for (size_t i = 0; i < count; i++) {
    if (!d->kinds[i]) continue;
    for (size_t k = 0; k < 4; k++) {
      const uint32_t j = d->cells.neighbours[4 * i + k];
      if (j == QMAT_NO_TETRAHEDRON || j < i || !d->kinds[j]) continue;
      const uint32_t a = qmat_set_leader(parent, (uint32_t)i), b = qmat_set_leader(parent, j);
      if (qmat_point_distance(&d->spheres[4 * (size_t)a], &d->spheres[4 * (size_t)b]) <= d->params->merge)
        qmat_sets_join(parent, a, b);
    }
  }
  uint32_t next = 0;
  for (size_t i = 0; i < count; i++) {
    d->sphere_of[i] = NONE;
    if (!d->kinds[i]) continue;
    const uint32_t root = qmat_set_leader(parent, (uint32_t)i);
    d->sphere_of[i] = root == i ? next++ : d->sphere_of[root];
  }
  d->sphere_count = next;
  return QMAT_OK;
}

/* The corner pairs of a tetrahedron's edges. */
static const uint8_t edge_corners[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

static int corner_index(const uint32_t *corners, uint32_t id) {
  for (int k = 0; k < 3; k++)
    if (corners[k] == id) return k;
  return 3;
}

/* Walks the tetrahedra around the Delaunay edge (a, b) from `start`. Returns their number when the ring is closed,
 * every member is kept, and `start` is the smallest, so that each ring is found once; else 0. */
static size_t walk_ring(const delaunay *d, uint32_t start, uint32_t a, uint32_t b, uint32_t *ring, size_t capacity) {
  const uint32_t *corners = &d->cells.corners[4 * (size_t)start];
  int across = 0;
  while (corners[across] == a || corners[across] == b) across++;
  uint32_t cell = start;
  uint32_t leaving = corners[across]; /* the next tetrahedron is across the facet opposite this corner */
  size_t count = 0;
  do {
    if (cell < start || count == capacity) return 0;
    ring[count++] = cell;
    corners = &d->cells.corners[4 * (size_t)cell];
    uint32_t entering = NONE;
    for (int k = 0; k < 4; k++)
      if (corners[k] != a && corners[k] != b && corners[k] != leaving) entering = corners[k];
    const uint32_t next = d->cells.neighbours[4 * (size_t)cell + (size_t)corner_index(corners, leaving)];
    if (next == QMAT_NO_TETRAHEDRON || !d->kinds[next]) return 0;
    cell = next;
    leaving = entering;
  } while (cell != start);
  return count;
}

enum { RING_CAPACITY = 4096 };

/* The dual polygon of a ring as a fan from its smallest medial vertex; coincident neighbours fall together. */
static size_t fan(const uint32_t *polygon, size_t count, uint32_t *triangles) {
  size_t first = 0, made = 0;
  for (size_t i = 1; i < count; i++)
    if (polygon[i] < polygon[first]) first = i;
  for (size_t i = 1; i + 1 < count; i++) {
    const uint32_t t[3] = {polygon[first], polygon[(first + i) % count], polygon[(first + i + 1) % count]};
    if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) continue;
    memcpy(&triangles[3 * made++], t, sizeof t);
  }
  return made;
}

/* Connectivity from the triangulation: an edge across each facet between two kept tetrahedra, and for each Delaunay
 * edge whose whole ring is kept the dual polygon in triangles. */
static qmat_status connect(delaunay *d) {
  qmat_context *context = d->context;
  const size_t count = d->cells.count;
  size_t edge_capacity = 0, triangle_capacity = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count; i++) {
    if (i % 65536 == 0 && (status = qmat_progress(context, i, count, "dual cells")) != QMAT_OK) return status;
    if (!d->kinds[i]) continue;
    if (qmat_grow((void **)&d->edges, &edge_capacity, 2 * d->edge_count + 8, sizeof *d->edges))
      return qmat_fail_memory(context, "medial edges");
    for (int k = 0; k < 4; k++) {
      const uint32_t j = d->cells.neighbours[4 * i + (size_t)k];
      if (j == QMAT_NO_TETRAHEDRON || j < i || !d->kinds[j] || d->sphere_of[j] == d->sphere_of[i]) continue;
      d->edges[2 * d->edge_count] = d->sphere_of[i];
      d->edges[2 * d->edge_count + 1] = d->sphere_of[j];
      d->edge_count++;
    }
    for (int e = 0; e < 6; e++) {
      uint32_t ring[RING_CAPACITY];
      const uint32_t *corners = &d->cells.corners[4 * i];
      const size_t n =
          walk_ring(d, (uint32_t)i, corners[edge_corners[e][0]], corners[edge_corners[e][1]], ring, RING_CAPACITY);
      size_t polygon = 0;
      for (size_t k = 0; k < n; k++) {
        const uint32_t sphere = d->sphere_of[ring[k]];
        if (polygon == 0 || ring[polygon - 1] != sphere) ring[polygon++] = sphere;
      }
      while (polygon > 1 && ring[polygon - 1] == ring[0]) polygon--;
      if (polygon < 3) continue;
      if (qmat_grow((void **)&d->triangles, &triangle_capacity, 3 * (d->triangle_count + polygon),
                    sizeof *d->triangles))
        return qmat_fail_memory(context, "medial slabs");
      d->triangle_count += fan(ring, polygon, &d->triangles[3 * d->triangle_count]);
    }
  }
  return QMAT_OK;
}

/* A component of the medial mesh, and its place in the order of size, largest first. */
typedef struct {
  uint32_t root, size;
} component;

static int larger_component(const void *left, const void *right) {
  const component *a = left, *b = right;
  if (a->size != b->size) return a->size < b->size ? 1 : -1;
  return a->root < b->root ? -1 : 1;
}

/* The components, sorted; `index` (per sphere) gets each sphere's component. NULL when memory is short. */
static component *find_components(delaunay *d, uint32_t *index, size_t *count) {
  qmat_arena *arena = &d->context->arena;
  uint32_t *parent = qmat_sets_new(d->context, d->sphere_count);
  component *parts = qmat_arena_calloc(arena, d->sphere_count, sizeof *parts);
  uint32_t *order = qmat_arena_alloc(arena, d->sphere_count, sizeof *order);
  if (!parent || !parts || !order) return NULL;
  for (size_t e = 0; e < d->edge_count; e++) qmat_sets_join(parent, d->edges[2 * e], d->edges[2 * e + 1]);
  *count = 0;
  for (size_t i = 0; i < d->sphere_count; i++) {
    const uint32_t root = qmat_set_leader(parent, (uint32_t)i);
    if (root == i) {
      index[i] = (uint32_t)*count;
      parts[(*count)++].root = root;
    }
    parts[index[root]].size++;
  }
  qsort(parts, *count, sizeof *parts, larger_component);
  for (size_t i = 0; i < *count; i++) order[parts[i].root] = (uint32_t)i;
  for (size_t i = 0; i < d->sphere_count; i++) index[i] = order[qmat_set_leader(parent, (uint32_t)i)];
  return parts;
}

/* Marks the components that answer for a sample which no larger component answers for. The others are specks: slivers
 * on the surface, which add no coverage. */
static qmat_status mark_needed(delaunay *d, const uint32_t *index, size_t count, uint8_t *needed) {
  qmat_arena *arena = &d->context->arena;
  size_t *starts = qmat_arena_calloc(arena, count + 2, sizeof *starts);
  uint32_t *members = qmat_arena_alloc(arena, d->cells.count, sizeof *members);
  uint8_t *answered = qmat_arena_calloc(arena, d->samples->count, sizeof *answered);
  if (!starts || !members || !answered) return qmat_fail_memory(d->context, "components");
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell]) starts[index[d->sphere_of[cell]] + 2]++;
  for (size_t i = 0; i < count; i++) starts[i + 2] += starts[i + 1];
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell]) members[starts[index[d->sphere_of[cell]] + 1]++] = (uint32_t)cell;
  for (size_t i = 0; i < count; i++) {
    const size_t first = 4 * starts[i], last = 4 * starts[i + 1];
    needed[i] = 0;
    for (size_t m = first; m < last && !needed[i]; m++)
      needed[i] = !answered[d->cells.corners[4 * (size_t)members[m / 4] + m % 4]];
    for (size_t m = first; m < last && needed[i]; m++)
      answered[d->cells.corners[4 * (size_t)members[m / 4] + m % 4]] = 1;
  }
  return QMAT_OK;
}

static qmat_status drop_specks(delaunay *d, size_t *components, size_t *specks, size_t *speck_spheres) {
  qmat_arena *arena = &d->context->arena;
  uint32_t *index = qmat_arena_alloc(arena, d->sphere_count, sizeof *index);
  uint32_t *renumbered = qmat_arena_alloc(arena, d->sphere_count, sizeof *renumbered);
  size_t count = 0;
  component *parts = index ? find_components(d, index, &count) : NULL;
  uint8_t *needed = qmat_arena_alloc(arena, count, sizeof *needed);
  if (!renumbered || !parts || !needed) return qmat_fail_memory(d->context, "components");
  const qmat_status status = mark_needed(d, index, count, needed);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < count; i++) {
    *components += needed[i];
    *specks += !needed[i];
    *speck_spheres += needed[i] ? 0 : parts[i].size;
  }
  uint32_t next = 0;
  for (size_t i = 0; i < d->sphere_count; i++) renumbered[i] = needed[index[i]] ? next++ : NONE;
  for (size_t cell = 0; cell < d->cells.count; cell++) {
    if (!d->kinds[cell]) continue;
    d->sphere_of[cell] = renumbered[d->sphere_of[cell]];
    if (d->sphere_of[cell] == NONE) d->kinds[cell] = CELL_DROPPED;
  }
  size_t kept = 0;
  for (size_t e = 0; e < d->edge_count; e++) {
    if (renumbered[d->edges[2 * e]] == NONE) continue;
    for (size_t k = 0; k < 2; k++) d->edges[2 * kept + k] = renumbered[d->edges[2 * e + k]];
    kept++;
  }
  d->edge_count = kept;
  kept = 0;
  for (size_t t = 0; t < d->triangle_count; t++) {
    if (renumbered[d->triangles[3 * t]] == NONE) continue;
    for (size_t k = 0; k < 3; k++) d->triangles[3 * kept + k] = renumbered[d->triangles[3 * t + k]];
    kept++;
  }
  d->triangle_count = kept;
  d->sphere_count = next;
  return QMAT_OK;
}

/* A medial edge that would join two components. */
typedef struct {
  double protrusion; /* how far its cone leaves the solid, as seen at a few places */
  double length;
  uint32_t a, b;
} medial_link;

static int better_link(const void *left, const void *right) {
  const medial_link *p = left, *q = right;
  if (p->protrusion != q->protrusion) return p->protrusion < q->protrusion ? -1 : 1;
  if (p->length != q->length) return p->length < q->length ? -1 : 1;
  if (p->a != q->a) return p->a < q->a ? -1 : 1;
  return p->b < q->b ? -1 : p->b > q->b;
}

enum { LINK_LOOKS = 7 };

/* `spheres` holds 4 doubles a medial vertex. */
static medial_link make_link(const delaunay *d, const double *spheres, uint32_t a, uint32_t b) {
  const double *p = &spheres[4 * (size_t)a], *q = &spheres[4 * (size_t)b];
  medial_link link = {0, qmat_point_distance(p, q), a < b ? a : b, a < b ? b : a};
  for (int i = 1; i <= LINK_LOOKS; i++) {
    const double t = (double)i / (LINK_LOOKS + 1);
    double s[4];
    for (int k = 0; k < 4; k++) s[k] = (1 - t) * p[k] + t * q[k];
    link.protrusion = fmax(link.protrusion, s[3] + qmat_surface_signed_distance(d->surface, s));
  }
  return link;
}

typedef struct {
  uint32_t sample, sphere;
} contact;

static int by_sample(const void *left, const void *right) {
  const contact *p = left, *q = right;
  if (p->sample != q->sample) return p->sample < q->sample ? -1 : 1;
  return p->sphere < q->sphere ? -1 : p->sphere > q->sphere;
}

/* The spheres of the samples for which more than one component answers, as (sample, sphere) pairs, sorted; or, with
 * `by_part`, of each surface part's samples, with the part in place of the sample. */
static contact *find_contacts(delaunay *d, const uint32_t *index, bool by_part, size_t *count) {
  qmat_arena *arena = &d->context->arena;
  const size_t samples = d->samples->count;
  uint32_t *component_of = qmat_arena_alloc(arena, samples, sizeof *component_of);
  uint8_t *shared = qmat_arena_calloc(arena, samples, sizeof *shared);
  if (!component_of || !shared) return NULL;
  for (size_t i = 0; i < samples; i++) component_of[i] = NONE;
  for (size_t i = 0; i < 4 * d->cells.count; i++) {
    if (!d->kinds[i / 4]) continue;
    const uint32_t sample = d->cells.corners[i], component = index[d->sphere_of[i / 4]];
    if (component_of[sample] != NONE && component_of[sample] != component) shared[sample] = 1;
    component_of[sample] = component;
  }
  size_t room = 0;
  for (size_t i = 0; i < 4 * d->cells.count; i++) room += d->kinds[i / 4] && (by_part || shared[d->cells.corners[i]]);
  contact *contacts = qmat_arena_alloc(arena, room, sizeof *contacts);
  if (!contacts) return NULL;
  *count = 0;
  for (size_t i = 0; i < 4 * d->cells.count; i++) {
    const uint32_t sample = d->cells.corners[i];
    if (!d->kinds[i / 4] || !(by_part || shared[sample])) continue;
    contacts[(*count)++] = (contact){by_part ? part_of_sample(d, sample) : sample, d->sphere_of[i / 4]};
  }
  qsort(contacts, *count, sizeof *contacts, by_sample);
  size_t kept = 0;
  for (size_t i = 0; i < *count; i++)
    if (kept == 0 || by_sample(&contacts[kept - 1], &contacts[i]) != 0) contacts[kept++] = contacts[i];
  *count = kept;
  return contacts;
}

static qmat_status add_link(delaunay *d, uint32_t a, uint32_t b) {
  size_t capacity = 2 * d->edge_count;
  if (qmat_grow((void **)&d->edges, &capacity, 2 * (d->edge_count + 1), sizeof *d->edges))
    return qmat_fail_memory(d->context, "medial edges");
  d->edges[2 * d->edge_count] = a;
  d->edges[2 * d->edge_count + 1] = b;
  d->edge_count++;
  return QMAT_OK;
}

/* For each surface part whose samples still see several components: the nearest two spheres, until it is one. Rare and
 * small, since components that share a sample are joined before. */
static qmat_status link_across_parts(delaunay *d, const uint32_t *index, uint32_t *joined, const double *spheres,
                                     size_t *links) {
  size_t count = 0;
  contact *contacts = find_contacts(d, index, true, &count);
  if (!contacts) return qmat_fail_memory(d->context, "components");
  for (size_t first = 0, last; first < count; first = last) {
    for (last = first; last < count && contacts[last].sample == contacts[first].sample;) last++;
    for (;;) {
      const uint32_t home = qmat_set_leader(joined, index[contacts[first].sphere]);
      medial_link best = {0, INFINITY, NONE, NONE};
      for (size_t i = first; i < last; i++) {
        if (qmat_set_leader(joined, index[contacts[i].sphere]) == home) continue;
        for (size_t j = first; j < last; j++) {
          if (qmat_set_leader(joined, index[contacts[j].sphere]) != home) continue;
          const uint32_t a = contacts[i].sphere, b = contacts[j].sphere;
          const double length = qmat_point_distance(&spheres[4 * (size_t)a], &spheres[4 * (size_t)b]);
          const medial_link link = {0, length, a < b ? a : b, a < b ? b : a};
          if (better_link(&link, &best) < 0) best = link;
        }
      }
      if (best.a == NONE) break;
      const qmat_status status = add_link(d, best.a, best.b);
      if (status != QMAT_OK) return status;
      qmat_sets_join(joined, index[best.a], index[best.b]);
      ++*links;
    }
  }
  return QMAT_OK;
}

/* Joins the components of one solid, which tear apart where it is thinner than its samples are apart: by medial edges
 * between spheres that answer for a common sample, those first that stay inside. Such spheres touch the surface in the
 * same place. */
static qmat_status link_components(delaunay *d, size_t *components, size_t *links) {
  if (*components < 2) return QMAT_OK;
  qmat_arena *arena = &d->context->arena;
  uint32_t *index = qmat_arena_alloc(arena, d->sphere_count, sizeof *index);
  double *spheres = qmat_arena_alloc(arena, d->sphere_count, 4 * sizeof *spheres);
  size_t count = 0, contact_count = 0;
  const component *parts = index && spheres ? find_components(d, index, &count) : NULL;
  uint32_t *joined = qmat_sets_new(d->context, count);
  const contact *contacts = parts ? find_contacts(d, index, false, &contact_count) : NULL;
  if (!parts || !joined || !contacts) return qmat_fail_memory(d->context, "components");
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell]) memcpy(&spheres[4 * (size_t)d->sphere_of[cell]], &d->spheres[4 * cell], 4 * sizeof *spheres);
  medial_link *candidates = NULL;
  size_t candidate_count = 0, capacity = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < contact_count && status == QMAT_OK; i++)
    for (size_t j = i + 1; j < contact_count && contacts[j].sample == contacts[i].sample; j++) {
      const uint32_t a = contacts[i].sphere, b = contacts[j].sphere;
      if (index[a] == index[b]) continue;
      if (qmat_grow((void **)&candidates, &capacity, candidate_count + 1, sizeof *candidates)) {
        status = qmat_fail_memory(d->context, "components");
        break;
      }
      candidates[candidate_count++] = make_link(d, spheres, a, b);
    }
  if (candidate_count) qsort(candidates, candidate_count, sizeof *candidates, better_link);
  for (size_t i = 0; i < candidate_count && status == QMAT_OK; i++) {
    const uint32_t a = index[candidates[i].a], b = index[candidates[i].b];
    if (!qmat_sets_join(joined, a, b)) continue;
    ++*links;
    status = add_link(d, candidates[i].a, candidates[i].b);
  }
  qmat_free(candidates);
  if (status == QMAT_OK) status = link_across_parts(d, index, joined, spheres, links);
  *components -= *links;
  return status;
}

static int by_number(const void *left, const void *right) {
  const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
  return a < b ? -1 : a > b;
}

enum { SHORT_ROW = 32 };

/* Sorts a row of ids. Most are of a handful: by insertion, without qsort's calls. */
static void sort_numbers(uint32_t *row, size_t length) {
  if (length > SHORT_ROW) {
    qsort(row, length, sizeof *row, by_number);
    return;
  }
  for (size_t i = 1; i < length; i++) {
    const uint32_t moved = row[i];
    size_t j = i;
    for (; j > 0 && row[j - 1] > moved; j--) row[j] = row[j - 1];
    row[j] = moved;
  }
}

/* The samples that each triangulated one stands for, itself among them, in rising order: those of sample i are
 * items[starts[i] .. starts[i + 1]). */
typedef struct {
  size_t *starts;
  uint32_t *items;
} stood_for;

static qmat_status find_stood_for(const delaunay *d, stood_for *s) {
  const size_t count = d->samples->count;
  s->starts = qmat_arena_calloc(&d->context->arena, count + 2, sizeof *s->starts);
  s->items = qmat_arena_alloc(&d->context->arena, count, sizeof *s->items);
  if (!s->starts || !s->items) return qmat_fail_memory(d->context, "regions");
  for (size_t i = 0; i < count; i++) s->starts[d->stand_ins[i] + 2]++;
  for (size_t i = 0; i < count; i++) s->starts[i + 2] += s->starts[i + 1];
  for (size_t i = 0; i < count; i++) s->items[s->starts[d->stand_ins[i] + 1]++] = (uint32_t)i;
  return QMAT_OK;
}

/* The responsible regions: a medial vertex answers for the corners of its tetrahedra, and for the samples that these
 * stand for, each behind its corner. */
static qmat_status set_regions(delaunay *d, qmat_medial *medial) {
  const size_t count = medial->sphere_count; /* those added by refinement answer for none */
  uint32_t *offsets = qmat_calloc(count + 1, sizeof *offsets);
  medial->region_offsets = offsets;
  medial->region_offset_count = count + 1;
  size_t kept = 0;
  for (size_t cell = 0; cell < d->cells.count; cell++) kept += d->kinds[cell] != CELL_DROPPED;
  uint32_t *all = qmat_arena_alloc(&d->context->arena, 4 * kept, sizeof *all);
  size_t *starts = qmat_arena_calloc(&d->context->arena, count + 2, sizeof *starts);
  stood_for stood_for;
  if (!offsets || !all || !starts) return qmat_fail_memory(d->context, "regions");
  qmat_status status = find_stood_for(d, &stood_for);
  if (status != QMAT_OK) return status;
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell]) starts[d->sphere_of[cell] + 2] += 4;
  for (size_t i = 0; i < count; i++) starts[i + 2] += starts[i + 1];
  for (size_t cell = 0; cell < d->cells.count; cell++) {
    if (!d->kinds[cell]) continue;
    size_t *end = &starts[d->sphere_of[cell] + 1];
    memcpy(&all[*end], &d->cells.corners[4 * cell], 4 * sizeof *all);
    *end += 4;
  }
  size_t room = 0;
  for (size_t i = 0; i < count; i++) {
    uint32_t *row = &all[starts[i]];
    const size_t length = starts[i + 1] - starts[i];
    sort_numbers(row, length);
    for (size_t k = 0; k < length; k++)
      if (k == 0 || row[k] != row[k - 1]) room += stood_for.starts[row[k] + 1] - stood_for.starts[row[k]];
  }
  if (room >= UINT32_MAX) return qmat_fail(d->context, QMAT_ERROR_MEMORY, "%zu samples in regions are too many", room);
  medial->region_samples = qmat_alloc(room, sizeof *medial->region_samples);
  if (!medial->region_samples) return qmat_fail_memory(d->context, "regions");
  uint32_t next = 0;
  for (size_t i = 0; i < count; i++) {
    const uint32_t *row = &all[starts[i]];
    const size_t length = starts[i + 1] - starts[i];
    for (size_t k = 0; k < length; k++) {
      if (k > 0 && row[k] == row[k - 1]) continue;
      for (size_t m = stood_for.starts[row[k]]; m < stood_for.starts[row[k] + 1]; m++)
        medial->region_samples[next++] = stood_for.items[m];
    }
    offsets[i + 1] = next;
  }
  medial->region_sample_count = next;
  return QMAT_OK;
}

static qmat_status make_medial(delaunay *d, qmat_medial *medial, size_t *refined) {
  medial->sphere_count = d->sphere_count;
  medial->spheres = qmat_alloc(d->sphere_count, 4 * sizeof *medial->spheres);
  if (!medial->spheres) return qmat_fail_memory(d->context, "medial spheres");
  uint32_t next = 0; /* of centres that merged, the first tetrahedron's stands for all */
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell] && d->sphere_of[cell] == next)
      memcpy(&medial->spheres[4 * (size_t)next++], &d->spheres[4 * cell], 4 * sizeof *medial->spheres);
  qmat_status status =
      qmat_medial_set_simplices(d->context, medial, d->edges, d->edge_count, d->triangles, d->triangle_count);
  if (status == QMAT_OK && d->params->protrusion > 0)
    status = qmat_halve_protruding_edges(d->context, d->surface, medial, d->params->protrusion, refined);
  if (status == QMAT_OK) status = set_regions(d, medial);
  if (status != QMAT_OK) return status;
  qmat_frame_spheres_to_model(qmat_surface_frame(d->surface), medial->spheres, medial->sphere_count, medial->spheres);
  return qmat_value_seal(d->context, &medial->base);
}

static void mark_thin_samples(delaunay *d, const qmat_field *thickness, const double *values, uint8_t *thin) {
  const double theta = qmat_thickness_threshold(thickness, d->params->theta);
  for (size_t i = 0; i < d->samples->count; i++) thin[i] = values[i] <= theta;
  d->thin = thin;
}

/* The Delaunay tetrahedra of the samples that stand for themselves. */
static qmat_status triangulate(delaunay *d) {
  qmat_arena *arena = &d->context->arena;
  const size_t count = d->samples->count;
  uint32_t *sites = qmat_arena_alloc(arena, count, sizeof *sites);
  double *points = qmat_arena_alloc(arena, count, 3 * sizeof *points);
  if (!sites || !points) return qmat_fail_memory(d->context, "samples");
  for (size_t i = 0; i < count; i++) {
    if (d->stand_ins[i] != i) continue;
    memcpy(&points[3 * d->site_count], &d->points[3 * i], 3 * sizeof *points);
    sites[d->site_count++] = (uint32_t)i;
  }
  const qmat_status status = qmat_delaunay_tetrahedra(d->context, points, d->site_count, &d->cells);
  for (size_t i = 0; status == QMAT_OK && i < 4 * d->cells.count; i++) d->cells.corners[i] = sites[d->cells.corners[i]];
  return status;
}

/* What was made of what. */
typedef struct {
  size_t by_kind[3]; /* tetrahedra */
  size_t components, links, refined, specks, speck_spheres;
} dual_counts;

static qmat_status make_report(const delaunay *d, const qmat_medial *medial, const dual_counts *made,
                               qmat_report *report) {
  const struct {
    const char *name;
    size_t value;
  } counts[] = {
      {"samples", d->samples->count},
      {"samples_triangulated", d->site_count},
      {"tetrahedra", d->cells.count},
      {"circumcentres", made->by_kind[CELL_CIRCUMCENTRE]},
      {"incentres", made->by_kind[CELL_INCENTRE]},
      {"spheres", medial->sphere_count},
      {"edges", medial->edge_count},
      {"triangles", medial->triangle_count},
      {"components", made->components},
      {"links", made->links},
      {"spheres_by_refinement", made->refined},
      {"specks_dropped", made->specks},
      {"speck_spheres_dropped", made->speck_spheres},
  };
  int bad = 0;
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    bad |= qmat_json_set_count(report->root, counts[i].name, counts[i].value);
  return bad ? qmat_fail_memory(d->context, "the report") : QMAT_OK;
}

/* Everything before the value. */
static qmat_status find_dual(delaunay *d, const qmat_field *thickness, const double *reaches, dual_counts *made) {
  qmat_context *context = d->context;
  const size_t count = d->samples->count;
  double *points = qmat_arena_alloc(&context->arena, count, 3 * sizeof *points);
  double *values = qmat_arena_alloc(&context->arena, count, sizeof *values);
  uint8_t *thin = qmat_arena_alloc(&context->arena, count, sizeof *thin);
  uint32_t *stand_ins = qmat_arena_alloc(&context->arena, count, sizeof *stand_ins);
  if (!points || !values || !thin || !stand_ins) return qmat_fail_memory(context, "samples");
  qmat_frame_to_unit(qmat_surface_frame(d->surface), d->samples->positions, count, points);
  d->points = points;
  qmat_thickness_of_samples(d->mesh, thickness, d->samples, values);
  mark_thin_samples(d, thickness, values, thin);
  d->stand_ins = stand_ins;
  qmat_status status =
      qmat_stand_ins_find(context, d->surface, d->samples, points, values, d->params->detail, reaches, stand_ins);
  if (status != QMAT_OK) return status;
  if ((status = find_surface_parts(d)) != QMAT_OK) return status;
  if ((status = triangulate(d)) != QMAT_OK) return status;
  if ((status = select_medial_vertices(d)) != QMAT_OK) return status;
  for (size_t i = 0; i < d->cells.count; i++) made->by_kind[d->kinds[i]]++;
  if ((status = number_medial_vertices(d)) != QMAT_OK) return status;
  if (d->sphere_count == 0)
    return qmat_fail(context, QMAT_ERROR_GEOMETRY, "no medial vertex lies inside the model: is its surface closed?");
  if ((status = connect(d)) != QMAT_OK) return status;
  if ((status = drop_specks(d, &made->components, &made->specks, &made->speck_spheres)) != QMAT_OK) return status;
  return link_components(d, &made->components, &made->links);
}

qmat_status qmat_medial_dual_make(qmat_context *context, const qmat_dual_params *params, const qmat_surface *surface,
                                  const qmat_field *thickness, const qmat_samples *samples, const double *reaches,
                                  qmat_medial **medial, qmat_report *report) {
  delaunay d = {
      .context = context, .params = params, .mesh = qmat_surface_mesh(surface), .samples = samples, .surface = surface};
  dual_counts made = {.components = 0};
  *medial = NULL;
  qmat_status status = find_dual(&d, thickness, reaches, &made);
  if (status == QMAT_OK) {
    *medial = qmat_medial_new();
    status = *medial ? make_medial(&d, *medial, &made.refined) : qmat_fail_memory(context, "the medial mesh");
  }
  if (status == QMAT_OK && report) status = make_report(&d, *medial, &made, report);
  if (status != QMAT_OK && *medial) {
    qmat_value_release(&(*medial)->base);
    *medial = NULL;
  }
  qmat_free(d.edges);
  qmat_free(d.triangles);
  return status;
}

const char *const qmat_completion_choices[] = {"thin", "all", NULL};
const char *const qmat_radius_choices[] = {"distance", "circumradius", NULL};
