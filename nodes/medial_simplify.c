/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.simplify: edge collapses by slab quadratic error and stability ratio, with the error held on both sides. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/medial_build.h"
#include "core/medial_complex.h"
#include "core/node.h"
#include "core/quadric.h"
#include "core/surface.h"
#include "core/thickness.h"
#include "nodes/control_points.h"
#include "nodes/coverage.h"
#include "nodes/edge_heap.h"
#include "nodes/libraries.h"
#include "nodes/medial_errors.h"
#include "nodes/protrusion.h"

typedef enum { ERROR_TWO_SIDED, ERROR_ONE_SIDED } error_kind;
typedef enum { EXCEED_SKIP, EXCEED_STOP } exceed_rule;
typedef enum { PROTECT_OFF, PROTECT_LATE, PROTECT_ALWAYS } protection;
typedef enum { TOPOLOGY_FREE, TOPOLOGY_GUARD, TOPOLOGY_PRESERVE } topology_policy;

typedef struct {
  double epsilon;
  int64_t vertices;
  double cost;
  int error;
  int on_exceed;
  int topology;
  int protect;
  double theta;
  double k;
} medial_simplify_params;

/* Rims and tips hold on to their place by this share of a slab's weight (section 3.1.2, boundary preservation). */
static const double boundary_weight = 0.01;
/* Of the wanted error the control points leave the rest to the surface between them. Where that is not enough the run
 * is repeated, at most this often, with control points in the places found. */
static const double control_share = 0.975;
enum { MOST_ROUNDS = 4 };
enum { MOST_CONTROL_POINTS = 600000, REPORT_EVERY = 256 };

/* Late protection starts when so few spheres are left (section 3.4, "a later stage"). */
static size_t late_stage(size_t initial) {
  return initial / 50 > 100 ? initial / 50 : 100;
}

typedef struct {
  qmat_context *context;
  const medial_simplify_params *params;
  qmat_surface *surface;
  qmat_complex complex;
  qmat_quadric *quadrics; /* per vertex */
  qmat_edge_heap heap;
  qmat_control_points control;
  qmat_coverage coverage;
  qmat_protrusion protrusion;
  qmat_collapse collapse;
  uint32_t *failed_points; /* per edge: the control point that refused it, or QMAT_NONE */
  const uint8_t *thin;     /* per sample */
  double limit;            /* what the errors are held to at the control points; INFINITY: nothing is held */
  bool protecting;
  bool has_target;               /* whether the solid's Euler characteristic is known */
  int64_t euler, target_euler;   /* of the medial mesh now, and of the solid */
  size_t collapses, refused_by_surface, refused_by_coverage, refused_by_protrusion, refused_by_protection, refused_by_topology;
} simplifier;

static double distance(const double *a, const double *b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return sqrt(x * x + y * y + z * z);
}

/* Eq. 5: 0 for a pure spike, 1 for equal radii. */
static double stability_ratio(const double *a, const double *b) {
  const double length = distance(a, b);
  const double hyperbolic = length - fabs(a[3] - b[3]);
  return length > 0 && hyperbolic > 0 ? hyperbolic / length : 0;
}

/* The candidates for the merged sphere of an edge, best first: the sphere of least error where there is one, both ends
 * and the middle. Radii must be positive unless an end's is not. */
typedef struct {
  double spheres[4][4], errors[4];
  int count;
} candidates;

static void add_candidate(candidates *c, const qmat_quadric *quadric, const double *sphere) {
  const double error = qmat_quadric_error(quadric, sphere);
  int place = c->count++;
  for (; place > 0 && error < c->errors[place - 1]; place--) {
    c->errors[place] = c->errors[place - 1];
    memcpy(c->spheres[place], c->spheres[place - 1], sizeof c->spheres[place]);
  }
  c->errors[place] = error;
  memcpy(c->spheres[place], sphere, sizeof c->spheres[place]);
}

static void merged_quadric(const simplifier *s, uint32_t edge, qmat_quadric *quadric) {
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  *quadric = s->quadrics[ends[0]];
  qmat_quadric_add(quadric, &s->quadrics[ends[1]]);
}

static void find_candidates(const simplifier *s, uint32_t edge, candidates *c) {
  qmat_quadric quadric;
  merged_quadric(s, edge, &quadric);
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const double *a = &s->complex.spheres[4 * (size_t)ends[0]], *b = &s->complex.spheres[4 * (size_t)ends[1]];
  double sphere[4];
  c->count = 0;
  /* Optima that run away along a nearly flat direction are no merge of these two spheres. */
  const double reach = 2 * distance(a, b) + fabs(a[3] - b[3]);
  if (qmat_quadric_minimise(&quadric, sphere) && sphere[3] > 0 &&
      fmin(distance(sphere, a), distance(sphere, b)) <= reach)
    add_candidate(c, &quadric, sphere);
  add_candidate(c, &quadric, a);
  add_candidate(c, &quadric, b);
  for (int k = 0; k < 4; k++) sphere[k] = 0.5 * (a[k] + b[k]);
  add_candidate(c, &quadric, sphere);
}

/* Eq. 6, with the error of the best candidate. */
static void set_cost(simplifier *s, uint32_t edge) {
  candidates c;
  find_candidates(s, edge, &c);
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const double gamma =
      stability_ratio(&s->complex.spheres[4 * (size_t)ends[0]], &s->complex.spheres[4 * (size_t)ends[1]]);
  s->heap.errors[edge] = c.errors[0];
  s->heap.costs[edge] = (c.errors[0] + s->params->k) * gamma * gamma;
}

/* A tangent plane of the cone of an edge that leans away from point `inner`: the rim of a sheet. */
static void add_rim(simplifier *s, uint32_t edge, const double *inner) {
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const double *a = &s->complex.spheres[4 * (size_t)ends[0]], *b = &s->complex.spheres[4 * (size_t)ends[1]];
  const double length = distance(a, b), change = b[3] - a[3];
  if (!(length > fabs(change))) return;
  double axis[3], away[3], along = 0, size = 0, n[3];
  for (int k = 0; k < 3; k++) {
    axis[k] = (b[k] - a[k]) / length;
    away[k] = a[k] - inner[k];
    along += away[k] * axis[k];
  }
  for (int k = 0; k < 3; k++) {
    away[k] -= along * axis[k];
    size += away[k] * away[k];
  }
  if (!(size > 0)) return;
  const double cosine = -change / length, sine = sqrt(1 - cosine * cosine) / sqrt(size);
  for (int k = 0; k < 3; k++) n[k] = cosine * axis[k] + sine * away[k];
  const double gamma = stability_ratio(a, b), weight = boundary_weight * gamma * gamma;
  for (int e = 0; e < 2; e++) qmat_quadric_add_plane(&s->quadrics[ends[e]], n, e ? b : a, weight);
}

/* The plane at the tip of a chain: across the end of its last cone. */
static void add_tip(simplifier *s, uint32_t vertex, uint32_t edge) {
  const double *tip = &s->complex.spheres[4 * (size_t)vertex];
  const double *base = &s->complex.spheres[4 * (size_t)qmat_complex_other_end(&s->complex, edge, vertex)];
  const double length = distance(tip, base);
  if (!(length > 0)) return;
  double n[3];
  for (int k = 0; k < 3; k++) n[k] = (tip[k] - base[k]) / length;
  const double gamma = stability_ratio(tip, base);
  qmat_quadric_add_plane(&s->quadrics[vertex], n, tip, boundary_weight * gamma * gamma);
}

/* The slabs of each vertex (eq. 2), the cones of edges without slabs, and boundaries, each entered once. */
static qmat_status set_quadrics(simplifier *s) {
  const qmat_complex *c = &s->complex;
  s->quadrics = qmat_arena_calloc(&s->context->arena, c->vertex_count, sizeof *s->quadrics);
  if (!s->quadrics) return qmat_fail_memory(s->context, "slab quadrics");
  for (size_t t = 0; t < c->triangle_count; t++) {
    const uint32_t *corners = &c->triangles[3 * t];
    const double *m[3];
    for (int k = 0; k < 3; k++) m[k] = &c->spheres[4 * (size_t)corners[k]];
    qmat_quadric slab = {.c = 0};
    if (qmat_quadric_add_slab(&slab, m[0], m[1], m[2], 1))
      for (int k = 0; k < 3; k++) qmat_quadric_add(&s->quadrics[corners[k]], &slab);
    for (int k = 0; k < 3; k++) {
      const uint32_t side = c->triangle_edges[3 * t + (size_t)k];
      if (c->edge_triangles[side] == 1) add_rim(s, side, m[k]);
    }
  }
  for (size_t e = 0; e < c->edge_count; e++) {
    if (c->edge_triangles[e]) continue;
    const uint32_t *ends = &c->edges[2 * e];
    qmat_quadric cone = {.c = 0};
    if (!qmat_quadric_add_cone(&cone, &c->spheres[4 * (size_t)ends[0]], &c->spheres[4 * (size_t)ends[1]], 2)) continue;
    for (int k = 0; k < 2; k++) qmat_quadric_add(&s->quadrics[ends[k]], &cone);
  }
  for (uint32_t v = 0; v < c->vertex_count; v++)
    if (c->vertex_edges.counts[v] == 1) add_tip(s, v, c->vertex_edges.items[c->vertex_edges.starts[v]]);
  return QMAT_OK;
}

static qmat_status fill_heap(simplifier *s) {
  const size_t count = s->complex.edge_count;
  s->failed_points = qmat_arena_alloc(&s->context->arena, count, sizeof *s->failed_points);
  if (!s->failed_points) return qmat_fail_memory(s->context, "the heap of edges");
  const qmat_status status = qmat_edge_heap_init(s->context, &s->heap, &s->complex);
  if (status != QMAT_OK) return status;
  const int threads = qmat_threads(s->context);
#pragma omp parallel for num_threads(threads) schedule(static)
  for (size_t e = 0; e < count; e++) {
    set_cost(s, (uint32_t)e);
    s->failed_points[e] = QMAT_NONE;
  }
  qmat_edge_heap_fill(&s->heap);
  return QMAT_OK;
}

/* The exact depth at the centre of a medial sphere. Most are inscribed: a look no farther than their radius finds it. */
static double depth_of(const qmat_surface *surface, const double *sphere) {
  double depth = qmat_surface_distance(surface, sphere, sphere[3] * (1 + 1e-6) + 1e-9, NULL, NULL);
  if (!(depth < INFINITY)) depth = qmat_surface_distance(surface, sphere, INFINITY, NULL, NULL);
  return qmat_surface_inside(surface, sphere) ? depth : -depth;
}

static qmat_status measure_depths(const simplifier *s, const double *spheres, size_t count, double *depths) {
  const size_t slice = 1 << 15;
  const int threads = qmat_threads(s->context);
  for (size_t first = 0; first < count; first += slice) {
    const qmat_status status = qmat_progress(s->context, 0, 0, "depths");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t v = first; v < last; v++)
      depths[v] = depth_of(s->surface, &spheres[4 * v]);
  }
  return QMAT_OK;
}

/* A loose edge all of whose responsible region is thin: a tubular feature (section 3.4). */
static bool is_tubular(const simplifier *s, uint32_t edge) {
  if (s->complex.edge_triangles[edge]) return false;
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  bool any = false;
  for (int k = 0; k < 2; k++)
    for (uint32_t slot = qmat_coverage_first(&s->coverage, ends[k]); slot != QMAT_NONE; slot = s->coverage.next[slot]) {
      if (slot / 3 >= s->control.sample_count) continue;
      if (!s->thin[slot / 3]) return false;
      any = true;
    }
  return any;
}

static bool is_protected(const simplifier *s, uint32_t vertex) {
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(&s->complex, vertex, &count);
  for (size_t i = 0; i < count; i++)
    if (is_tubular(s, at[i])) return true;
  return false;
}

/* Leaves of the candidates what protection allows: a protected end keeps its sphere. */
static bool apply_protection(const simplifier *s, uint32_t edge, candidates *c) {
  if (is_tubular(s, edge)) return false;
  const uint32_t *ends = &s->complex.edges[2 * (size_t)edge];
  const bool first = is_protected(s, ends[0]), second = is_protected(s, ends[1]);
  if (!first && !second) return true;
  if (first && second) return false;
  const double *sphere = &s->complex.spheres[4 * (size_t)ends[second]];
  qmat_quadric quadric;
  merged_quadric(s, edge, &quadric);
  c->count = 0;
  add_candidate(c, &quadric, sphere);
  return true;
}

/* How the newest preview would change the Euler characteristic, and whether it satisfies the link condition (Attali et
 * al. 2011), which keeps the homotopy type: neighbours that both ends share span a slab with the edge, and the ends span
 * no slab with a common edge. */
static int64_t euler_change(const qmat_collapse *c, bool *link_condition) {
  int64_t shared_neighbours = 0, shared_edges = 0;
  for (size_t n = 0; n < c->neighbour_count; n++)
    shared_neighbours += c->kept_edges[n] != QMAT_NONE && c->removed_edges[n] != QMAT_NONE;
  for (size_t t = 0; t < c->triangle_count; t++)
    shared_edges += c->kept_triangles[t] != QMAT_NONE && c->removed_triangles[t] != QMAT_NONE;
  const int64_t vanishing = (int64_t)c->vanishing_count;
  *link_condition = shared_neighbours == vanishing && shared_edges == 0;
  return shared_neighbours - vanishing - shared_edges;
}

/* A guarded medial mesh's Euler characteristic may be off by one for every so many spheres: tears and voids of the dense
 * initial one come in pairs, which could never close one by one, and the fewer spheres are left the less is forgiven. */
enum { SPHERES_PER_FAULT = 128 };

static bool keeps_topology(const simplifier *s, int64_t *change) {
  bool link_condition;
  *change = euler_change(&s->collapse, &link_condition);
  if (s->params->topology == TOPOLOGY_PRESERVE) return link_condition;
  if (s->params->topology == TOPOLOGY_FREE || !s->has_target) return true;
  const int64_t before = llabs(s->euler - s->target_euler), after = llabs(s->euler + *change - s->target_euler);
  return after <= before || after <= (int64_t)s->complex.live_vertices / SPHERES_PER_FAULT;
}

typedef enum { COLLAPSED, REFUSED, EXCEEDED } outcome;

/* The best candidate that stays inside the model and keeps both errors; then the collapse itself. */
static qmat_status try_collapse(simplifier *s, uint32_t edge, outcome *result) {
  candidates c;
  find_candidates(s, edge, &c);
  *result = REFUSED;
  if (s->protecting && !apply_protection(s, edge, &c)) {
    s->refused_by_protection++;
    return QMAT_OK;
  }
  qmat_status status = qmat_complex_preview(s->context, &s->complex, edge, &s->collapse);
  if (status != QMAT_OK) return status;
  int64_t change;
  if (!keeps_topology(s, &change)) {
    s->refused_by_topology++;
    return QMAT_OK;
  }
  const bool holding = s->limit < INFINITY, two_sided = s->params->error == ERROR_TWO_SIDED;
  for (int i = 0; i < c.count && status == QMAT_OK; i++) {
    const double *sphere = c.spheres[i];
    if (!qmat_protrusion_test_sphere(&s->protrusion, &s->complex, &s->collapse, sphere) ||
        !qmat_protrusion_test_midpoints(&s->protrusion, &s->complex, &s->collapse, sphere)) {
      s->refused_by_surface++;
      continue;
    }
    bool kept = true;
    s->coverage.found_count = 0;
    if (holding) {
      status = qmat_coverage_test(s->context, &s->coverage, &s->complex, &s->collapse, sphere, s->failed_points[edge],
                                  &kept);
      if (status != QMAT_OK) break;
      if (!kept) {
        s->failed_points[edge] = s->coverage.failed_point;
        s->refused_by_coverage++;
        *result = EXCEEDED;
        continue;
      }
    }
    if (holding && two_sided) {
      status = qmat_protrusion_test(s->context, &s->protrusion, &s->complex, &s->collapse, sphere, &kept);
      if (status != QMAT_OK) break;
      if (!kept) {
        s->refused_by_protrusion++;
        *result = EXCEEDED;
        continue;
      }
      qmat_protrusion_commit(&s->protrusion, &s->collapse);
    } else {
      s->protrusion.depths[s->collapse.kept] = s->protrusion.sphere_depth;
    }
    qmat_coverage_commit(&s->coverage, &s->collapse);
    status = qmat_complex_collapse(s->context, &s->complex, &s->collapse, sphere);
    s->euler += change;
    *result = COLLAPSED;
    break;
  }
  return status;
}

/* New costs around the merged vertex, and another chance for the refused edges of its neighbours. */
static void update_neighbourhood(simplifier *s) {
  const qmat_collapse *c = &s->collapse;
  qmat_quadric_add(&s->quadrics[c->kept], &s->quadrics[c->removed]);
  qmat_edge_heap_remove(&s->heap, c->edge);
  for (size_t n = 0; n < c->neighbour_count; n++)
    if (c->kept_edges[n] != QMAT_NONE && c->removed_edges[n] != QMAT_NONE) qmat_edge_heap_remove(&s->heap, c->removed_edges[n]);
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(&s->complex, c->kept, &count);
  for (size_t i = 0; i < count; i++) {
    set_cost(s, at[i]);
    qmat_edge_heap_update(&s->heap, at[i]);
  }
  for (size_t n = 0; n < c->neighbour_count; n++) {
    at = qmat_complex_edges_at(&s->complex, c->neighbours[n], &count);
    for (size_t i = 0; i < count; i++)
      if (s->heap.places[at[i]] == QMAT_NONE) qmat_edge_heap_update(&s->heap, at[i]);
  }
}

static qmat_status collapse_edges(simplifier *s) {
  const size_t initial = s->complex.vertex_count;
  const medial_simplify_params *p = s->params;
  for (size_t attempts = 0; s->heap.count > 0; attempts++) {
    const size_t live = s->complex.live_vertices;
    if (live <= 1 || (p->vertices > 0 && live <= (size_t)p->vertices)) break;
    if (attempts % REPORT_EVERY == 0) {
      const qmat_status status = qmat_progress(s->context, initial - live, initial, "collapses");
      if (status != QMAT_OK) return status;
    }
    s->protecting = p->protect == PROTECT_ALWAYS || (p->protect == PROTECT_LATE && live <= late_stage(initial));
    const uint32_t edge = qmat_edge_heap_first(&s->heap);
    if (p->cost > 0 && s->heap.costs[edge] > p->cost) break;
    qmat_edge_heap_remove(&s->heap, edge);
    outcome result;
    const qmat_status status = try_collapse(s, edge, &result);
    if (status != QMAT_OK) return status;
    if (result == COLLAPSED) {
      s->collapses++;
      update_neighbourhood(s);
    } else if (result == EXCEEDED && p->on_exceed == EXCEED_STOP) {
      break;
    }
  }
  return QMAT_OK;
}

/* The reported errors are at most this share of epsilon above the true ones, but never below the second share. */
static const double error_tolerance = 0.01, least_reported = 0.5;

/* What an unbounded run (epsilon 0) measures its errors against. */
static const double default_epsilon = 0.01;

/* Medial spheres that are farther from the mesh or larger, in diagonals, are not of this mesh: beyond, squares lose all
 * digits. */
static const double farthest_sphere = 1e6;

static qmat_status measure(simplifier *s, const qmat_medial *unit, qmat_medial_errors *errors) {
  const double epsilon = s->params->epsilon > 0 ? s->params->epsilon : default_epsilon;
  const double tolerance = error_tolerance * epsilon;
  return qmat_medial_errors_measure(s->context, s->surface, unit, s->control.points, s->control.surface_count, tolerance,
                                    least_reported * epsilon, epsilon - tolerance, errors);
}

/* The sample's owner: the corner of its witness with the largest weight. */
static uint32_t owner_of(const qmat_coverage *coverage, size_t point) {
  uint32_t best = 0;
  for (uint32_t k = 1; k < 3; k++)
    if (coverage->witnesses[3 * point + k] != QMAT_NONE &&
        coverage->weights[3 * point + k] > coverage->weights[3 * point + best])
      best = k;
  return coverage->witnesses[3 * point + best];
}

static qmat_status set_regions(simplifier *s, const uint32_t *ids, qmat_medial *medial) {
  const size_t count = medial->sphere_count, samples = s->control.sample_count;
  medial->region_offsets = qmat_calloc(count + 2, sizeof(uint32_t));
  medial->region_samples = qmat_alloc(samples, sizeof(uint32_t));
  if (!medial->region_offsets || !medial->region_samples)
    return qmat_fail_memory(s->context, "responsible regions");
  uint32_t *offsets = medial->region_offsets;
  for (size_t i = 0; i < samples; i++) {
    const uint32_t owner = owner_of(&s->coverage, i);
    if (owner != QMAT_NONE) offsets[ids[owner] + 2]++;
  }
  for (size_t v = 0; v < count; v++) offsets[v + 2] += offsets[v + 1];
  for (size_t i = 0; i < samples; i++) {
    const uint32_t owner = owner_of(&s->coverage, i);
    if (owner != QMAT_NONE) medial->region_samples[offsets[ids[owner] + 1]++] = (uint32_t)i;
  }
  medial->region_offset_count = count + 1;
  medial->region_sample_count = offsets[count];
  return QMAT_OK;
}

/* What is left, renumbered in the order of the initial medial mesh; still in the unit frame. */
static qmat_status extract(simplifier *s, qmat_medial *medial) {
  const qmat_complex *c = &s->complex;
  qmat_arena *arena = &s->context->arena;
  uint32_t *ids = qmat_arena_alloc(arena, c->vertex_count, sizeof *ids);
  uint32_t *edges = qmat_arena_alloc(arena, c->live_edges, 2 * sizeof *edges);
  uint32_t *triangles = qmat_arena_alloc(arena, c->live_triangles, 3 * sizeof *triangles);
  medial->sphere_count = c->live_vertices;
  medial->spheres = qmat_alloc(c->live_vertices, 4 * sizeof(double));
  if (!ids || !edges || !triangles || !medial->spheres) return qmat_fail_memory(s->context, "the medial mesh");
  uint32_t next = 0;
  for (size_t v = 0; v < c->vertex_count; v++) {
    ids[v] = QMAT_NONE;
    if (!c->vertex_alive[v]) continue;
    memcpy(&medial->spheres[4 * (size_t)next], &c->spheres[4 * v], 4 * sizeof(double));
    ids[v] = next++;
  }
  size_t edge_count = 0, triangle_count = 0;
  for (size_t e = 0; e < c->edge_count; e++)
    if (c->edge_alive[e]) {
      for (size_t k = 0; k < 2; k++) edges[2 * edge_count + k] = ids[c->edges[2 * e + k]];
      edge_count++;
    }
  for (size_t t = 0; t < c->triangle_count; t++)
    if (c->triangle_alive[t]) {
      for (size_t k = 0; k < 3; k++) triangles[3 * triangle_count + k] = ids[c->triangles[3 * t + k]];
      triangle_count++;
    }
  const qmat_status status =
      qmat_medial_set_simplices(s->context, medial, edges, edge_count, triangles, triangle_count);
  return status == QMAT_OK ? set_regions(s, ids, medial) : status;
}

/* The initial medial mesh in the unit frame, its depths, and which samples are thin: the same in every round. */
typedef struct {
  double *spheres, *depths;
  uint8_t *thin;
} initial_state;

static qmat_status prepare(simplifier *s, const qmat_mesh *mesh, const qmat_field *thickness,
                           const qmat_samples *samples, const qmat_medial *medial, initial_state *state) {
  qmat_context *context = s->context;
  qmat_status status = qmat_thickness_check(context, mesh, thickness, samples);
  if (status == QMAT_OK && medial->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "there is no medial sphere");
    status = qmat_fail_field(context, "medial");
  }
  if (status == QMAT_OK) status = qmat_surface_new(context, mesh, &s->surface);
  if (status != QMAT_OK) return status;
  double *spheres = qmat_arena_alloc(&context->arena, medial->sphere_count, 4 * sizeof *spheres);
  double *depths = qmat_arena_alloc(&context->arena, medial->sphere_count, sizeof *depths);
  double *values = qmat_arena_alloc(&context->arena, samples->count, sizeof *values);
  uint8_t *thin = qmat_arena_alloc(&context->arena, samples->count, sizeof *thin);
  if (!spheres || !depths || !values || !thin) return qmat_fail_memory(context, "the medial mesh");
  qmat_thickness_of_samples(mesh, thickness, samples, values);
  const double theta = qmat_thickness_threshold(thickness, s->params->theta);
  for (size_t i = 0; i < samples->count; i++) thin[i] = values[i] <= theta;
  qmat_frame_spheres_to_unit(qmat_surface_frame(s->surface), medial->spheres, medial->sphere_count, spheres);
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) {
    if (fabs(spheres[i]) <= farthest_sphere) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it is far away from the mesh, or far larger");
    qmat_fail_field(context, "medial");
    return qmat_fail_element(context, "sphere", (int64_t)(i / 4));
  }
  *state = (initial_state){spheres, depths, thin};
  return measure_depths(s, spheres, medial->sphere_count, depths);
}

/* The Euler characteristic of the solid within a closed surface: half that of the surface. */
static qmat_status find_target_euler(simplifier *s, const qmat_mesh *mesh) {
  s->has_target = mesh->closed && mesh->oriented;
  if (!s->has_target) return QMAT_OK;
  uint8_t *used = qmat_arena_calloc(&s->context->arena, mesh->vertex_count, sizeof *used);
  if (!used) return qmat_fail_memory(s->context, "the surface's vertices");
  int64_t vertices = 0;
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    vertices += !used[mesh->triangles[i]];
    used[mesh->triangles[i]] = 1;
  }
  /* Every triangle has three sides, every side two triangles. */
  const int64_t triangles = (int64_t)mesh->triangle_count;
  s->target_euler = (vertices - triangles / 2) / 2;
  return QMAT_OK;
}

/* Sets one round up: everything that collapses change. */
static qmat_status start(simplifier *s, const initial_state *state, const qmat_samples *samples,
                         const qmat_medial *medial, const qmat_extra_points *extra) {
  qmat_context *context = s->context;
  s->thin = state->thin;
  qmat_status status = qmat_complex_init(context, &s->complex, medial, state->spheres);
  if (status == QMAT_OK) status = find_target_euler(s, qmat_surface_mesh(s->surface));
  if (status == QMAT_OK) status = set_quadrics(s);
  if (status == QMAT_OK) status = fill_heap(s);
  if (status != QMAT_OK) return status;
  s->euler = (int64_t)s->complex.vertex_count - (int64_t)s->complex.edge_count + (int64_t)s->complex.triangle_count;
  const double epsilon = s->params->epsilon > 0 ? s->params->epsilon : INFINITY;
  s->limit = control_share * epsilon;
  const bool two_sided = s->params->error == ERROR_TWO_SIDED;
  status = qmat_control_points_make(context, s->surface, samples, medial, &s->complex, epsilon, MOST_CONTROL_POINTS,
                                    extra, two_sided && epsilon < INFINITY, &s->control);
  if (status != QMAT_OK) return status;
  /* A point that the initial medial mesh leaves farther away can only be kept from getting worse. */
  double *limits = qmat_arena_alloc(&context->arena, s->control.count, sizeof *limits);
  if (!limits) return qmat_fail_memory(context, "control points");
  for (size_t i = 0; i < s->control.count; i++) limits[i] = fmax(s->limit - s->control.radii[i], s->control.distances[i]);
  status = qmat_coverage_init(context, &s->coverage, s->control.count, s->control.points, limits,
                              s->control.witnesses, s->control.weights, s->complex.vertex_count);
  if (status != QMAT_OK) return status;
  return qmat_protrusion_init(context, &s->protrusion, s->surface, &s->complex, state->depths,
                              two_sided ? s->limit : INFINITY);
}

static qmat_status make_report(simplifier *s, const qmat_medial *unit, const qmat_medial_errors *errors, int rounds,
                               qmat_report *report) {
  const struct {
    const char *name;
    size_t value;
  } counts[] = {
      {"initial_spheres", s->complex.vertex_count},
      {"spheres", unit->sphere_count},
      {"edges", unit->edge_count},
      {"triangles", unit->triangle_count},
      {"rounds", (size_t)rounds},
      {"collapses", s->collapses},
      {"control_points", s->control.count},
      {"refused_by_surface", s->refused_by_surface},
      {"refused_by_coverage", s->refused_by_coverage},
      {"refused_by_protrusion", s->refused_by_protrusion},
      {"refused_by_protection", s->refused_by_protection},
      {"refused_by_topology", s->refused_by_topology},
      {"surface_questions", s->protrusion.lattice.questions},
  };
  int bad = 0;
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    bad |= json_object_set_new(report->root, counts[i].name, json_integer((json_int_t)counts[i].value));
  bad |= json_object_set_new(report->root, "euler_characteristic", json_integer((json_int_t)s->euler));
  if (s->has_target)
    bad |= json_object_set_new(report->root, "euler_characteristic_of_solid", json_integer((json_int_t)s->target_euler));
  bad |= json_object_set_new(report->root, "epsilon", json_real(s->params->epsilon));
  bad |= json_object_set_new(report->root, "surface_to_envelope", json_real(errors->surface_to_envelope));
  bad |= json_object_set_new(report->root, "envelope_to_surface", json_real(errors->envelope_to_surface));
  return bad ? qmat_fail_memory(s->context, "the report") : QMAT_OK;
}

/* Frees what one round made. */
static void finish(simplifier *s) {
  qmat_collapse_uninit(&s->collapse);
  qmat_coverage_uninit(&s->coverage);
  qmat_protrusion_uninit(&s->protrusion);
  qmat_complex_uninit(&s->complex);
}

/* The places where the surface between the control points is too far from the envelope, added to those known. */
static qmat_status add_extra_points(simplifier *s, const qmat_cover *cover, qmat_extra_points *extra) {
  const size_t count = extra->count + cover->count;
  double *points = qmat_arena_alloc(&s->context->arena, count, 3 * sizeof *points);
  uint32_t *facets = qmat_arena_alloc(&s->context->arena, count, sizeof *facets);
  if (!points || !facets) return qmat_fail_memory(s->context, "control points");
  if (extra->count) {
    memcpy(points, extra->points, 3 * extra->count * sizeof *points);
    memcpy(facets, extra->facets, extra->count * sizeof *facets);
  }
  memcpy(points + 3 * extra->count, cover->points, 3 * cover->count * sizeof *points);
  memcpy(facets + extra->count, cover->facets, cover->count * sizeof *facets);
  *extra = (qmat_extra_points){count, points, facets};
  return QMAT_OK;
}

static double farthest_at_first(const qmat_control_points *control) {
  double farthest = -INFINITY;
  for (size_t i = 0; i < control->count; i++) farthest = fmax(farthest, control->distances[i]);
  return farthest;
}

/* Rounds of collapses until the surface between the control points keeps within epsilon as they do. */
static qmat_status simplify(simplifier *s, const initial_state *state, const qmat_samples *samples,
                            const qmat_medial *initial, qmat_medial **medial, qmat_report *report) {
  qmat_extra_points extra = {0};
  const double epsilon = s->params->epsilon;
  for (int round = 1;; round++) {
    qmat_medial_errors errors = {.surface_to_envelope = 0};
    qmat_medial *unit = *medial = qmat_medial_new();
    qmat_status status = unit ? start(s, state, samples, initial, &extra)
                              : qmat_fail_memory(s->context, "the medial mesh");
    if (status == QMAT_OK) status = collapse_edges(s);
    if (status == QMAT_OK) status = extract(s, unit);
    if (status == QMAT_OK) status = measure(s, unit, &errors);
    if (status != QMAT_OK) return status;
    /* What the initial medial mesh itself leaves too far away, no round brings closer. */
    const bool repeat = epsilon > 0 && errors.surface_to_envelope > epsilon && errors.cover.count > 0 &&
                        farthest_at_first(&s->control) <= epsilon && round < MOST_ROUNDS;
    if (!repeat) return make_report(s, unit, &errors, round, report);
    if ((status = add_extra_points(s, &errors.cover, &extra)) != QMAT_OK) return status;
    qmat_value_release(&unit->base);
    finish(s);
    *s = (simplifier){.context = s->context, .params = s->params, .surface = s->surface};
  }
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  const qmat_field *thickness = (const qmat_field *)inputs[1];
  const qmat_samples *samples = (const qmat_samples *)inputs[2];
  const qmat_medial *initial = (const qmat_medial *)inputs[3];
  simplifier s = {.context = context, .params = params};
  initial_state state = {NULL, NULL, NULL};
  qmat_medial *medial = NULL;
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = prepare(&s, mesh, thickness, samples, initial, &state);
  if (status == QMAT_OK) status = simplify(&s, &state, samples, initial, &medial, report);
  if (status == QMAT_OK) {
    qmat_frame_spheres_to_model(qmat_surface_frame(s.surface), medial->spheres, medial->sphere_count,
                                medial->spheres);
    status = qmat_value_seal(context, &medial->base);
  }
  if (status == QMAT_OK) status = qmat_value_seal(context, &report->base);
  if (status == QMAT_OK) {
    outputs[0] = &medial->base;
    outputs[1] = &report->base;
  } else {
    qmat_value_release(medial ? &medial->base : NULL);
    qmat_value_release(report ? &report->base : NULL);
  }
  finish(&s);
  qmat_surface_free(s.surface);
  return status;
}

static const char *const error_kinds[] = {"two_sided", "one_sided", NULL};
static const char *const exceed_rules[] = {"skip", "stop", NULL};
static const char *const topology_policies[] = {"free", "guard", "preserve", NULL};
static const char *const protections[] = {"off", "late", "always", NULL};

#define AT(field) offsetof(medial_simplify_params, field)

static const qmat_param params[] = {
    {.name = "epsilon",
     .unit = "diagonal",
     .doc = "The largest distance between surface and envelope; 0: no bound",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0.01,
     .min = 0,
     .max = 1,
     .flags = QMAT_PARAM_RELATIVE,
     .offset = AT(epsilon)},
    {.name = "vertices",
     .unit = "spheres",
     .doc = "Stop when this many medial spheres are left; 0: no such stop",
     .type = QMAT_PARAM_INT,
     .default_number = 0,
     .min = 0,
     .max = 4294967294.0,
     .offset = AT(vertices)},
    {.name = "cost",
     .unit = "1",
     .doc = "Stop when the cheapest collapse costs more than this (eq. 6); 0: no such stop",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0,
     .min = 0,
     .max = 1e9,
     .offset = AT(cost)},
    {.name = "error",
     .unit = "",
     .doc = "What epsilon bounds: surface to envelope and envelope to surface, or the first alone as in the paper",
     .type = QMAT_PARAM_ENUM,
     .default_number = ERROR_TWO_SIDED,
     .choices = error_kinds,
     .offset = AT(error)},
    {.name = "on_exceed",
     .unit = "",
     .doc = "At a collapse that would exceed epsilon: skip it and go on, or stop as in the paper",
     .type = QMAT_PARAM_ENUM,
     .default_number = EXCEED_SKIP,
     .choices = exceed_rules,
     .offset = AT(on_exceed)},
    {.name = "topology",
     .unit = "",
     .doc = "Free as in the paper, guarded so that loops and voids become the solid's, or preserved (link condition)",
     .type = QMAT_PARAM_ENUM,
     .default_number = TOPOLOGY_GUARD,
     .choices = topology_policies,
     .offset = AT(topology)},
    {.name = "protect",
     .unit = "",
     .doc = "Keep thin tubular features whatever their cost: never, at the late stage, or from the start",
     .type = QMAT_PARAM_ENUM,
     .default_number = PROTECT_OFF,
     .choices = protections,
     .offset = AT(protect)},
    {.name = "theta",
     .unit = "mean thickness",
     .doc = "A feature is thin when the thickness of its whole responsible region is at most this ratio of the mean",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 0.5,
     .min = 0,
     .max = 10,
     .offset = AT(theta)},
    {.name = "k",
     .unit = "1",
     .doc = "The constant of the collapse cost (eq. 6)",
     .type = QMAT_PARAM_FLOAT,
     .default_number = 1e-5,
     .min = 0,
     .max = 1,
     .offset = AT(k)},
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The closed surface"},
    {.name = "thickness", .type = QMAT_FIELD, .doc = "Thickness per facet, from mesh.sdf"},
    {.name = "samples", .type = QMAT_SAMPLES, .doc = "Points on the surface, from mesh.sample"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The initial medial mesh"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The simplified medial mesh"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Spheres, errors, collapses done and refused"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, NULL};

const qmat_node qmat_node_medial_simplify = {
    .name = "medial.simplify",
    .version = 1,
    .summary = "Collapses medial edges, cheapest first, while surface and envelope stay within epsilon of each other",
    .doc = "The cost of a collapse is the slab quadratic error of the merged sphere times the squared stability ratio of "
           "the edge. A collapse is done when its sphere and the midpoints of its edges lie inside the model and both "
           "errors stay below epsilon: from the surface to the envelope at the samples and a grid of control points, and "
           "from the envelope of spheres, cones and slabs to the surface. Spheres of the initial medial mesh, shrunk by "
           "epsilon, have to stay inside too, so that the envelope has no hollow. The largest distance from the surface "
           "between the control points is bounded afterwards, and the collapses are repeated with points in the places "
           "found where it is above epsilon.",
    .citation = "Sections 3.1.2, 3.3 and 3.4, eq. 1-6 and 9-12",
    .params_size = sizeof(medial_simplify_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
