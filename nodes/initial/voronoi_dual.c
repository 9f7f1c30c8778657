/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The initial medial mesh: triangulate, select (Algorithm 1), connect, join components, assign responsible regions. */
#include "nodes/initial/voronoi_dual.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/geometry/sheets.h"
#include "core/geometry/thickness.h"
#include "core/json_text.h"
#include "nodes/initial/delaunay_cgal.h"
#include "nodes/initial/dual_components.h"
#include "nodes/initial/edge_halving.h"
#include "nodes/initial/medial_vertices.h"
#include "nodes/initial/mirrored_points.h"
#include "nodes/initial/sample_thinning.h"
#include "nodes/initial/solid_labels.h"
#include "nodes/initial/tetrahedra_topology.h"

/* --- connectivity ------------------------------------------------------------------------------------------------ */

/* The corner pairs of a tetrahedron's edges. */
static const uint8_t edge_corners[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

/* The tetrahedra around an edge, then their medial vertices. */
typedef struct {
  uint32_t *ids;
  size_t count, capacity;
} id_ring;

/* Walks around the Delaunay edge (a, b) from the tetrahedron `start`. The ring is empty unless it is closed, all its
 * tetrahedra are kept and `start` is the smallest, so that each ring is found once. Nonzero when memory is short. */
static int walk_ring(const qmat_dual_complex *d, uint32_t start, uint32_t a, uint32_t b, id_ring *ring) {
  const uint32_t *corners = &d->cells.corners[4 * (size_t)start];
  size_t across = 0, behind = 3;
  while (corners[across] == a || corners[across] == b) across++;
  while (corners[behind] == a || corners[behind] == b) behind--;
  ring->count = 0;
  /* The last one of the ring tells soonest that another is the smallest. */
  const uint32_t last = d->cells.neighbours[4 * (size_t)start + behind];
  if (last == QMAT_NO_TETRAHEDRON || last < start) return 0;
  uint32_t cell = start;
  uint32_t leaving = corners[across]; /* the next tetrahedron is across the facet opposite this corner */
  size_t count = 0;
  do {
    if (cell < start) return 0;
    if (qmat_grow((void **)&ring->ids, &ring->capacity, count + 1, sizeof *ring->ids)) return -1;
    ring->ids[count++] = cell;
    cell = qmat_dual_step_around(d, cell, a, b, &leaving);
    if (cell == QMAT_NO_TETRAHEDRON || !d->kinds[cell]) return 0;
  } while (cell != start);
  ring->count = count;
  return 0;
}

/* Makes of a ring its dual polygon: the medial vertices, each once. */
static void find_polygon(const qmat_dual_complex *d, id_ring *ring) {
  size_t count = 0;
  for (size_t k = 0; k < ring->count; k++) {
    const uint32_t sphere = d->sphere_of[ring->ids[k]];
    if (count == 0 || ring->ids[count - 1] != sphere) ring->ids[count++] = sphere;
  }
  while (count > 1 && ring->ids[count - 1] == ring->ids[0]) count--;
  ring->count = count;
}

/* Triangulates the dual polygon of a ring as a fan from its smallest medial vertex. */
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

/* Room for `edges` and `triangles` more. */
static int reserve(qmat_dual_complex *d, size_t edges, size_t triangles) {
  const size_t e = d->edge_count + edges, t = d->triangle_count + triangles;
  int bad = qmat_grow((void **)&d->edges, &d->edge_capacity, 2 * e, sizeof *d->edges) ||
            qmat_grow((void **)&d->triangles, &d->triangle_capacity, 3 * t, sizeof *d->triangles);
  if (!bad && d->keep_duals)
    bad = qmat_grow((void **)&d->edge_duals, &d->edge_dual_capacity, 3 * e, sizeof *d->edge_duals) ||
          qmat_grow((void **)&d->triangle_duals, &d->triangle_dual_capacity, 2 * t, sizeof *d->triangle_duals);
  return bad;
}

static void add_edges(qmat_dual_complex *d, size_t i) {
  const uint32_t *corners = &d->cells.corners[4 * i];
  for (size_t k = 0; k < 4; k++) {
    const uint32_t j = d->cells.neighbours[4 * i + k];
    if (j == QMAT_NO_TETRAHEDRON || j < i || !d->kinds[j] || d->sphere_of[j] == d->sphere_of[i]) continue;
    for (size_t c = 0, n = 0; d->keep_duals && c < 4; c++)
      if (c != k) d->edge_duals[3 * d->edge_count + n++] = corners[c];
    d->edges[2 * d->edge_count] = d->sphere_of[i];
    d->edges[2 * d->edge_count + 1] = d->sphere_of[j];
    d->edge_count++;
  }
}

/* Adds the triangles of the polygons whose smallest tetrahedron is the i-th. */
static qmat_status add_triangles(qmat_dual_complex *d, size_t i, id_ring *ring) {
  const uint32_t *corners = &d->cells.corners[4 * i];
  for (int e = 0; e < 6; e++) {
    const uint32_t a = corners[edge_corners[e][0]], b = corners[edge_corners[e][1]];
    if (walk_ring(d, (uint32_t)i, a, b, ring)) return qmat_fail_memory(d->context, "medial slabs");
    find_polygon(d, ring);
    if (ring->count < 3) continue;
    if (reserve(d, 0, ring->count)) return qmat_fail_memory(d->context, "medial slabs");
    const size_t made = fan(ring->ids, ring->count, &d->triangles[3 * d->triangle_count]);
    for (size_t k = d->triangle_count; d->keep_duals && k < d->triangle_count + made; k++) {
      d->triangle_duals[2 * k] = a;
      d->triangle_duals[2 * k + 1] = b;
    }
    d->triangle_count += made;
  }
  return QMAT_OK;
}

qmat_status qmat_dual_connect(qmat_dual_complex *d) {
  const size_t count = d->cells.count;
  id_ring ring = {0};
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    if (i % 65536 == 0) status = qmat_progress(d->context, i, count, "dual cells");
    if (status != QMAT_OK || !d->kinds[i]) continue;
    if (reserve(d, 4, 0)) {
      status = qmat_fail_memory(d->context, "medial edges");
    } else {
      add_edges(d, i);
      status = add_triangles(d, i, &ring);
    }
  }
  qmat_free(ring.ids);
  return status;
}

/* --- responsible regions ----------------------------------------------------------------------------------------- */

static int by_number(const void *left, const void *right) {
  const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
  return a < b ? -1 : a > b;
}

enum { SHORT_ROW = 32 };

/* Sorts a row of ids. Most rows have a handful, for which qsort's calls cost more than an insertion sort. */
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

/* The samples that a triangulated point represents, in rising order: itself and others, or none if it is a
 * mirrored point. Those of point i are items[starts[i] .. starts[i + 1]). */
typedef struct {
  size_t *starts;
  uint32_t *items;
} represented_samples;

static qmat_status find_represented(const qmat_dual_complex *d, represented_samples *s) {
  const size_t count = d->samples->count, points = d->point_count;
  s->starts = qmat_arena_calloc(&d->context->arena, points + 2, sizeof *s->starts);
  s->items = qmat_arena_alloc(&d->context->arena, count, sizeof *s->items);
  if (!s->starts || !s->items) return qmat_fail_memory(d->context, "regions");
  for (size_t i = 0; i < count; i++) s->starts[d->representatives[i] + 2]++;
  for (size_t i = 0; i < points; i++) s->starts[i + 2] += s->starts[i + 1];
  for (size_t i = 0; i < count; i++) s->items[s->starts[d->representatives[i] + 1]++] = (uint32_t)i;
  return QMAT_OK;
}

/* Eq. 11: a medial vertex is responsible for the corners of its tetrahedra, and for the samples they represent. */
static qmat_status set_regions(qmat_dual_complex *d, qmat_medial *medial) {
  const size_t count = medial->sphere_count; /* the regions of vertices that halve an edge stay empty */
  uint32_t *offsets = qmat_calloc(count + 1, sizeof *offsets);
  medial->region_offsets = offsets;
  medial->region_offset_count = count + 1;
  size_t kept = 0;
  for (size_t cell = 0; cell < d->cells.count; cell++) kept += d->kinds[cell] != QMAT_CELL_DROPPED;
  uint32_t *all = qmat_arena_alloc(&d->context->arena, 4 * kept, sizeof *all);
  size_t *starts = qmat_arena_calloc(&d->context->arena, count + 2, sizeof *starts);
  represented_samples represented;
  if (!offsets || !all || !starts) return qmat_fail_memory(d->context, "regions");
  qmat_status status = find_represented(d, &represented);
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
      if (k == 0 || row[k] != row[k - 1]) room += represented.starts[row[k] + 1] - represented.starts[row[k]];
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
      for (size_t m = represented.starts[row[k]]; m < represented.starts[row[k] + 1]; m++)
        medial->region_samples[next++] = represented.items[m];
    }
    offsets[i + 1] = next;
  }
  medial->region_sample_count = next;
  return QMAT_OK;
}

/* --- the medial mesh --------------------------------------------------------------------------------------------- */

static qmat_status make_medial(qmat_dual_complex *d, qmat_medial *medial, size_t *refined) {
  medial->sphere_count = d->sphere_count;
  medial->spheres = qmat_alloc(d->sphere_count, 4 * sizeof *medial->spheres);
  if (!medial->spheres) return qmat_fail_memory(d->context, "medial spheres");
  uint32_t next = 0; /* merged centres take the sphere of their first tetrahedron */
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell] && d->sphere_of[cell] == next)
      memcpy(&medial->spheres[4 * (size_t)next++], &d->spheres[4 * cell], 4 * sizeof *medial->spheres);
  qmat_status status =
      qmat_medial_set_simplices(d->context, medial, d->edges, d->edge_count, d->triangles, d->triangle_count);
  if (status == QMAT_OK && d->params->max_envelope_error > 0)
    status = qmat_edges_halve(d->context, d->surface, medial, d->params->max_envelope_error, d->epsilon, refined);
  if (status == QMAT_OK) status = set_regions(d, medial);
  if (status != QMAT_OK) return status;
  qmat_frame_spheres_to_model(qmat_surface_frame(d->surface), medial->spheres, medial->sphere_count, medial->spheres);
  return QMAT_OK;
}

/* Triangulates the points that represent themselves, but not those of sheets. */
static qmat_status triangulate(qmat_dual_complex *d) {
  qmat_arena *arena = &d->context->arena;
  uint32_t *sites = qmat_arena_alloc(arena, d->point_count, sizeof *sites);
  double *points = qmat_arena_alloc(arena, d->point_count, 3 * sizeof *points);
  if (!sites || !points) return qmat_fail_memory(d->context, "samples");
  for (size_t i = 0; i < d->point_count; i++) {
    if (d->representatives[i] != i || d->facets[i] >= d->mesh->triangle_count) continue;
    memcpy(&points[3 * d->site_count], &d->points[3 * i], 3 * sizeof *points);
    sites[d->site_count++] = (uint32_t)i;
  }
  const qmat_status status = qmat_delaunay_tetrahedra(d->context, points, d->site_count, &d->cells);
  for (size_t i = 0; status == QMAT_OK && i < 4 * d->cells.count; i++) d->cells.corners[i] = sites[d->cells.corners[i]];
  return status;
}

typedef struct {
  size_t by_kind[3];     /* tetrahedra */
  size_t refined;        /* spheres that halve an edge */
  size_t between_solids; /* tetrahedra that are dropped there */
  qmat_mended_tetrahedra mended;
  qmat_dual_component_counts joined;
} dual_counts;

static qmat_status make_report(const qmat_dual_complex *d, const qmat_medial *medial, const dual_counts *made,
                               qmat_report *report) {
  const qmat_json_count counts[] = {
      {"samples", d->samples->count},
      {"sheet_spheres", medial->sheet_sphere_count},
      {"samples_triangulated", d->site_count - (d->point_count - d->samples->count)},
      {"mirrored_points", d->point_count - d->samples->count},
      {"tetrahedra", d->cells.count},
      {"circumcentres", made->by_kind[QMAT_CELL_CIRCUMCENTRE]},
      {"incentres", made->by_kind[QMAT_CELL_INCENTRE]},
      {"dropped_between_solids", made->between_solids},
      {"kept_for_topology", made->mended.kept},
      {"dropped_for_topology", made->mended.dropped},
      {"spheres", medial->sphere_count},
      {"edges", medial->edge_count},
      {"triangles", medial->triangle_count},
      {"components", made->joined.components},
      {"links", made->joined.links},
      {"spheres_by_refinement", made->refined},
      {"specks_dropped", made->joined.specks},
      {"speck_spheres_dropped", made->joined.speck_spheres},
  };
  const int bad = qmat_json_set_counts(report->root, counts, sizeof counts / sizeof *counts);
  return bad ? qmat_fail_memory(d->context, "the report") : QMAT_OK;
}

/* Finds the points to triangulate: the samples with their representatives, then the mirrored points. */
static qmat_status find_points(qmat_dual_complex *d, const qmat_field *thickness, const double *reaches) {
  qmat_context *context = d->context;
  qmat_arena *arena = &context->arena;
  const size_t count = d->samples->count;
  double *samples = qmat_arena_alloc(arena, count, 3 * sizeof *samples);
  double *values = qmat_arena_alloc(arena, count, sizeof *values);
  uint32_t *represented_by = qmat_arena_alloc(arena, count, sizeof *represented_by);
  if (!samples || !values || !represented_by) return qmat_fail_memory(context, "samples");
  qmat_frame_to_unit(qmat_surface_frame(d->surface), d->samples->positions, count, samples);
  qmat_thickness_of_samples(d->mesh, thickness, d->samples, values);
  qmat_mirrored_points mirrored;
  qmat_status status = qmat_representatives_find(context, d->surface, d->samples, samples, values,
                                                 d->thinning_tolerance, reaches, represented_by);
  if (status == QMAT_OK)
    status = qmat_mirrored_points_find(context, d->surface, d->samples, samples, represented_by, d->thinning_tolerance,
                                       &mirrored);
  if (status != QMAT_OK) return status;
  const double theta = qmat_thickness_threshold(d->mesh, thickness, d->params->theta);
  d->point_count = count + mirrored.count;
  double *points = qmat_arena_alloc(arena, d->point_count, 3 * sizeof *points);
  uint8_t *thin = qmat_arena_alloc(arena, d->point_count, sizeof *thin);
  uint32_t *facets = qmat_arena_alloc(arena, d->point_count, sizeof *facets);
  uint32_t *representatives = qmat_arena_alloc(arena, d->point_count, sizeof *representatives);
  if (!points || !thin || !facets || !representatives) return qmat_fail_memory(context, "samples");
  for (size_t i = 0; i < d->point_count; i++) {
    const bool is_sample = i < count;
    memcpy(&points[3 * i], is_sample ? &samples[3 * i] : &mirrored.points[3 * (i - count)], 3 * sizeof *points);
    thin[i] = !is_sample || values[i] <= theta;
    facets[i] = is_sample ? d->samples->facets[i] : mirrored.facets[i - count];
    representatives[i] = is_sample ? represented_by[i] : (uint32_t)i;
  }
  d->points = points;
  d->thin = thin;
  d->facets = facets;
  d->representatives = representatives;
  return QMAT_OK;
}

/* Everything before the value. */
static qmat_status find_dual(qmat_dual_complex *d, const qmat_field *thickness, const double *reaches,
                             dual_counts *made) {
  qmat_context *context = d->context;
  qmat_status status = find_points(d, thickness, reaches);
  if (status == QMAT_OK) status = triangulate(d);
  if (status == QMAT_OK) status = qmat_solids_find(d);
  if (status == QMAT_OK) status = qmat_medial_vertices_select(d);
  if (status == QMAT_OK) status = qmat_solids_part(d, &made->between_solids);
  if (status == QMAT_OK && d->params->incentres == QMAT_INCENTRES_ALL) status = qmat_tetrahedra_mend(d, &made->mended);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < d->cells.count; i++) made->by_kind[d->kinds[i]]++;
  if ((status = qmat_medial_vertices_number(d)) != QMAT_OK) return status;
  if (d->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "no medial vertex lies inside the surface");
    qmat_fail_field(context, "mesh");
    return qmat_fail_hint(context, "check that the surface is closed and its normals point outwards");
  }
  if ((status = qmat_dual_connect(d)) != QMAT_OK) return status;
  return qmat_dual_components_join(d, &made->joined);
}

qmat_status qmat_voronoi_dual_make(qmat_context *context, const qmat_voronoi_dual_params *params, const qmat_mesh *mesh,
                                   const qmat_surface *solids, const qmat_field *thickness, const qmat_samples *samples,
                                   const double *reaches, qmat_medial **medial, qmat_report *report) {
  const double epsilon = params->epsilon > 0 ? params->epsilon : QMAT_FINE_EPSILON;
  qmat_dual_complex d = {.context = context,
                         .params = params,
                         .epsilon = epsilon,
                         .merge = params->merge * epsilon,
                         .thinning_tolerance = params->thinning_tolerance * epsilon,
                         .link_limit = params->epsilon > 0 ? params->epsilon : INFINITY,
                         .samples = samples,
                         .surface = solids};
  dual_counts made = {.refined = 0};
  *medial = qmat_medial_new();
  qmat_status status = *medial ? QMAT_OK : qmat_fail_memory(context, "the medial mesh");
  if (status == QMAT_OK && solids) {
    d.mesh = qmat_surface_mesh(solids);
    status = find_dual(&d, thickness, reaches, &made);
    if (status == QMAT_OK) status = make_medial(&d, *medial, &made.refined);
  }
  if (status == QMAT_OK && mesh->sheet_triangle_count > 0) status = qmat_sheet_slabs_prepend(context, mesh, *medial);
  if (status == QMAT_OK && report) status = make_report(&d, *medial, &made, report);
  if (status == QMAT_OK) status = qmat_value_seal(context, &(*medial)->base);
  if (status != QMAT_OK && *medial) {
    qmat_value_release(&(*medial)->base);
    *medial = NULL;
  }
  qmat_free(d.edges);
  qmat_free(d.triangles);
  return status;
}

const char *const qmat_incentre_choices[] = {"thin", "all", NULL};
const char *const qmat_radius_choices[] = {"distance", "circumradius", NULL};
