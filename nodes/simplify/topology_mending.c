/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/topology_mending.h"

#include <math.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "nodes/measure/envelope_to_surface.h"
#include "nodes/simplify/topology_searches.h"

/* Parts of an edge or a triangle that are removed, in the order in which they are tried. 0: all of it. Smaller parts
 * need a new sphere, and the smallest one changes the envelope by next to nothing. */
static const double shares[] = {0, 0.5, 0.25, 0.125, 0.03125};
enum { SHARES = sizeof shares / sizeof *shares };

/* A small change of a medial mesh: rows of ids that it takes away or adds. The edges of a triangle that is taken away
 * stay. */
typedef struct edit {
  const uint32_t *edge, *wall; /* taken away: an edge of no triangle, a triangle; NULL: none */
  uint32_t new_edge[2], new_triangles[2][3];
  size_t new_edge_count, new_triangle_count;
  const double *sphere; /* added, as the last one; NULL: none */
} edit;

static void copy_rows_without(const uint32_t *rows, size_t count, size_t length, const uint32_t *row, uint32_t *copy,
                              size_t *copied) {
  *copied = 0;
  for (size_t i = 0; i < count; i++) {
    if (row && memcmp(&rows[length * i], row, length * sizeof *row) == 0) continue;
    memcpy(&copy[length * (*copied)++], &rows[length * i], length * sizeof *copy);
  }
}

/* `*changed` is new, also after a failure, and has no regions. */
static qmat_status apply(qmat_context *context, const qmat_medial *from, const edit *e, qmat_medial **changed) {
  const size_t spheres = from->sphere_count + (e->sphere != NULL);
  uint32_t *edges = qmat_arena_alloc(&context->arena, from->edge_count + 1, 2 * sizeof *edges);
  uint32_t *triangles = qmat_arena_alloc(&context->arena, from->triangle_count + 2, 3 * sizeof *triangles);
  qmat_medial *to = *changed = qmat_medial_new();
  if (to) to->spheres = qmat_alloc(spheres, 4 * sizeof *to->spheres);
  if (!to || !to->spheres || !edges || !triangles) return qmat_fail_memory(context, "the medial mesh");
  memcpy(to->spheres, from->spheres, 4 * from->sphere_count * sizeof *to->spheres);
  if (e->sphere) memcpy(&to->spheres[4 * from->sphere_count], e->sphere, 4 * sizeof *e->sphere);
  to->sphere_count = spheres;
  size_t edge_count, triangle_count;
  copy_rows_without(from->edges, from->edge_count, 2, e->edge, edges, &edge_count);
  copy_rows_without(from->triangles, from->triangle_count, 3, e->wall, triangles, &triangle_count);
  memcpy(&edges[2 * edge_count], e->new_edge, 2 * e->new_edge_count * sizeof *edges);
  memcpy(&triangles[3 * triangle_count], e->new_triangles, 3 * e->new_triangle_count * sizeof *triangles);
  return qmat_medial_set_simplices(context, to, edges, edge_count + e->new_edge_count, triangles,
                                   triangle_count + e->new_triangle_count);
}

/* Moves everything but regions; a new sphere gets an empty region. */
static qmat_status take(qmat_context *context, qmat_medial *changed, qmat_medial *unit) {
  size_t capacity = unit->region_offset_count;
  if (unit->region_offsets && changed->sphere_count > unit->sphere_count) {
    if (qmat_grow((void **)&unit->region_offsets, &capacity, capacity + 1, sizeof *unit->region_offsets))
      return qmat_fail_memory(context, "the medial mesh");
    unit->region_offsets[unit->region_offset_count] = unit->region_offsets[unit->region_offset_count - 1];
    unit->region_offset_count++;
  }
  const qmat_medial old = *unit;
  unit->spheres = changed->spheres, unit->sphere_count = changed->sphere_count;
  unit->edges = changed->edges, unit->edge_count = changed->edge_count;
  unit->triangles = changed->triangles, unit->triangle_count = changed->triangle_count;
  changed->spheres = old.spheres, changed->sphere_count = old.sphere_count;
  changed->edges = old.edges, changed->edge_count = old.edge_count;
  changed->triangles = old.triangles, changed->triangle_count = old.triangle_count;
  return QMAT_OK;
}

/* Edits the result where that leaves a loop or void less than `before`, and both errors within epsilon. */
static qmat_status try_edit(const qmat_simplification *s, const qmat_topology *before, const edit *e,
                            qmat_simplified *result, bool *done) {
  const double epsilon = s->params.epsilon;
  qmat_medial *changed;
  qmat_topology after;
  qmat_medial_errors errors = {.surface_to_envelope = 0};
  *done = false;
  qmat_status status = qmat_progress(s->context, 0, 0, "edits");
  if (status != QMAT_OK) return status;
  const qmat_arena aside = qmat_arena_set_aside(&s->context->arena); /* each try frees its scratch memory */
  status = apply(s->context, result->medial, e, &changed);
  if (status == QMAT_OK) status = qmat_topology_of_medial(s->context, changed, &after);
  if (status == QMAT_OK && after.known && after.components == before->components &&
      after.voids + after.loops < before->voids + before->loops) {
    status = qmat_simplification_measure(s, changed, true, &errors);
    *done = status == QMAT_OK && errors.surface_to_envelope <= epsilon && errors.boundary_to_surface <= epsilon;
  }
  if (*done) {
    status = take(s->context, changed, result->medial);
    result->figures.surface_to_envelope = errors.surface_to_envelope;
    result->figures.divided += e->sphere != NULL;
  }
  qmat_medial_errors_uninit(&errors);
  qmat_value_release(changed ? &changed->base : NULL);
  qmat_arena_put_back(&s->context->arena, aside);
  return status;
}

/* Whether a new sphere may divide a simplex, whose row of ids rises. It would come last, and spheres of sheets come
 * first: those of sheets are not divided. */
static bool may_divide(const qmat_medial *unit, const uint32_t *row) {
  return row[0] >= unit->sheet_sphere_count;
}

/* Whether the number of spheres that is wanted allows the edit. */
static bool allows(const qmat_simplification *s, const qmat_simplified *result, double share) {
  return share == 0 || s->params.vertices == 0 || result->medial->sphere_count < (size_t)s->params.vertices;
}

/* Whether another start has a result with fewer spheres and the right topology. Edits remove no spheres. */
static bool is_beaten(const qmat_simplification *s, const qmat_simplified *result) {
  const size_t rival = s->rival_count ? atomic_load(s->rival_count) : 0;
  return rival > 0 && rival < result->medial->sphere_count;
}

/* ---- voids ---- */

/* Removes a wall, or with `share` > 0 a part of it: a sphere on the wall divides it into three triangles, and that with
 * this share of the area and the side across from corner `k` goes. The envelope of the others is as before. */
static qmat_status try_wall(const qmat_simplification *s, const qmat_topology *before, const uint32_t *wall,
                            double share, int k, qmat_simplified *result, bool *done) {
  const qmat_medial *unit = result->medial;
  const uint32_t a = wall[k], b = wall[(k + 1) % 3], c = wall[(k + 2) % 3], last = (uint32_t)unit->sphere_count;
  double sphere[4];
  const double *at_a = &unit->spheres[4 * (size_t)a], *at_b = &unit->spheres[4 * (size_t)b],
               *at_c = &unit->spheres[4 * (size_t)c];
  for (int i = 0; i < 4; i++) sphere[i] = share * at_a[i] + 0.5 * (1 - share) * (at_b[i] + at_c[i]);
  const edit part = {
      .wall = wall, .new_triangles = {{a, b, last}, {a, c, last}}, .new_triangle_count = 2, .sphere = sphere};
  const edit whole = {.wall = wall};
  return try_edit(s, before, share > 0 ? &part : &whole, result, done);
}

static qmat_status open_void(const qmat_simplification *s, const qmat_topology *before, qmat_simplified *result,
                             bool *opened) {
  uint32_t *walls;
  size_t count;
  *opened = false;
  qmat_status status = qmat_topology_find_walls(s->context, result->medial, &walls, &count);
  for (size_t t = 0; t < SHARES && allows(s, result, shares[t]); t++) {
    const int sides = shares[t] > 0 ? 3 : 1;
    int tries = 0;
    for (size_t i = 0; i < count && tries < QMAT_MOST_WALLS && status == QMAT_OK && !*opened; i++) {
      uint32_t wall[3];
      memcpy(wall, &result->medial->triangles[3 * (size_t)walls[i]], sizeof wall);
      if (shares[t] > 0 && !may_divide(result->medial, wall)) continue;
      tries += sides;
      for (int k = 0; k < sides && status == QMAT_OK && !*opened; k++)
        status = try_wall(s, before, wall, shares[t], k, result, opened);
    }
  }
  return status;
}

qmat_status qmat_simplification_open_voids(const qmat_simplification *s, qmat_simplified *result) {
  for (;;) {
    qmat_topology topology;
    bool opened;
    qmat_status status = qmat_topology_of_medial(s->context, result->medial, &topology);
    if (status != QMAT_OK || !topology.known || topology.voids <= s->solid.voids || is_beaten(s, result)) return status;
    status = open_void(s, &topology, result, &opened);
    if (status != QMAT_OK || !opened) return status;
  }
}

/* ---- loops ---- */

/* Fills three edges without a slab that form a loop. The first ones whose slab stays near the solid are tried. */
static qmat_status fill_loop(const qmat_simplification *s, const qmat_topology *before, qmat_simplified *result,
                             bool *closed) {
  const double epsilon = s->params.epsilon;
  const qmat_medial *unit = result->medial;
  uint32_t *triangles;
  size_t count;
  int tries = 0;
  *closed = false;
  qmat_status status = qmat_topology_find_empty_triangles(s->context, unit, &triangles, &count);
  for (size_t i = 0; i < count && tries < QMAT_MOST_WALLS && status == QMAT_OK && !*closed; i++) {
    if ((status = qmat_progress(s->context, 0, 0, "loops")) != QMAT_OK) return status;
    edit e = {.new_triangle_count = 1};
    const double *spheres[3];
    memcpy(e.new_triangles[0], &triangles[3 * i], sizeof e.new_triangles[0]);
    for (size_t k = 0; k < 3; k++) spheres[k] = &unit->spheres[4 * (size_t)e.new_triangles[0][k]];
    const double error = qmat_envelope_to_surface_bound(s->surface, spheres, 3, qmat_least_reported * epsilon,
                                                        qmat_error_tolerance * epsilon);
    if (!(error <= epsilon)) continue;
    tries++;
    status = try_edit(s, before, &e, result, closed);
    if (*closed) result->figures.envelope_to_surface = fmax(result->figures.envelope_to_surface, error);
  }
  return status;
}

/* Whether the responsible regions of both ends are all thin. */
static bool has_thin_regions(const qmat_simplification *s, const qmat_medial *unit, const uint32_t *edge) {
  bool any = false;
  for (int k = 0; k < 2; k++)
    for (uint32_t i = unit->region_offsets[edge[k]]; i < unit->region_offsets[edge[k] + 1]; i++) {
      if (!s->state.thin[unit->region_samples[i]]) return false;
      any = true;
    }
  return any;
}

/* Whether the parameters keep an edge: it is a cone along a crease, or with protection a tubular feature. */
static bool is_kept(const qmat_simplification *s, const qmat_medial *unit, const uint32_t *edge) {
  const double *const radii = unit->spheres + 3;
  const bool on_crease = s->params.features == QMAT_FEATURES_SHARP && edge[0] >= unit->sheet_sphere_count &&
                         radii[4 * (size_t)edge[0]] == 0 && radii[4 * (size_t)edge[1]] == 0;
  return on_crease || (s->params.protect != QMAT_PROTECT_OFF && has_thin_regions(s, unit, edge));
}

/* Removes an edge without a slab that is part of a loop, or a part of it at either end: then a new sphere is the end of
 * the other part. The shortest edges that need not stay are tried. */
static qmat_status cut_loop(const qmat_simplification *s, const qmat_topology *before, qmat_simplified *result,
                            bool *closed) {
  const qmat_medial *unit = result->medial;
  uint32_t *edges;
  size_t found, count = 0;
  qmat_status status = qmat_topology_find_loop_edges(s->context, unit, &edges, &found);
  for (size_t i = 0; i < found && count < QMAT_MOST_WALLS && status == QMAT_OK; i++)
    if (!is_kept(s, unit, &unit->edges[2 * (size_t)edges[i]])) edges[count++] = edges[i];
  for (size_t n = 0; n < SHARES && allows(s, result, shares[n]); n++) {
    const size_t ends = shares[n] > 0 ? 2 : 1;
    for (size_t i = 0; i < ends * count && status == QMAT_OK && !*closed; i++) {
      const uint32_t *row = &unit->edges[2 * (size_t)edges[i / ends]], edge[2] = {row[0], row[1]};
      const uint32_t kept = row[i % ends], cut = row[1 - i % ends];
      if (shares[n] > 0 && !may_divide(unit, edge)) continue;
      double sphere[4];
      for (size_t k = 0; k < 4; k++)
        sphere[k] =
            shares[n] * unit->spheres[4 * (size_t)kept + k] + (1 - shares[n]) * unit->spheres[4 * (size_t)cut + k];
      const edit part = {
          .edge = edge, .new_edge = {kept, (uint32_t)unit->sphere_count}, .new_edge_count = 1, .sphere = sphere};
      status = try_edit(s, before, shares[n] > 0 ? &part : &(edit){.edge = edge}, result, closed);
    }
  }
  return status;
}

qmat_status qmat_simplification_close_loops(const qmat_simplification *s, qmat_simplified *result) {
  for (;;) {
    qmat_topology topology;
    bool closed;
    qmat_status status = qmat_topology_of_medial(s->context, result->medial, &topology);
    if (status != QMAT_OK || !topology.known || topology.loops <= s->solid.loops || is_beaten(s, result)) return status;
    status = fill_loop(s, &topology, result, &closed);
    if (status == QMAT_OK && !closed) status = cut_loop(s, &topology, result, &closed);
    if (status != QMAT_OK || !closed) return status;
  }
}
