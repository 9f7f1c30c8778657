/* SPDX-License-Identifier: GPL-3.0-or-later */
/* mesh.subdivide: subdivision surfaces become triangles with vertices on the limit surface. */
#include <math.h>
#include <string.h>

#include "core/geometry/surface.h"
#include "core/geometry/vector.h"
#include "core/json_text.h"
#include "core/node.h"
#include "io/soup.h"
#include "nodes/descriptor/epsilon.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/mesh/lend_joints.h"
#include "nodes/mesh/subdivision_osd.h"

typedef struct mesh_subdivide_params {
  int64_t level;     /* 0: from epsilon */
  double epsilon;    /* 0: the default */
  double tolerance;  /* share of epsilon */
  int scheme;        /* a qmat_scheme; QMAT_SCHEME_NONE: as authored */
  int boundary_rule; /* a qmat_boundary + 1; 0: as authored */
} mesh_subdivide_params;

/* The most faces at the deepest level: about a gigabyte. */
static const double MOST_FACES = 1 << 22;

/* The deviation from one level to the next shrinks to a quarter on smooth surfaces, and to about half at worst. The sum
 * over all further levels is therefore at most this factor times the deviation measured at the next level. */
static const double all_levels = 2;

enum { NO_VERTEX = -1, GROUPS = QMAT_SCHEME_COUNT * QMAT_BOUNDARY_COUNT };

/* All surfaces of one scheme and one boundary rule, merged into one cage. They share no vertices, so they do not affect
 * each other. */
typedef struct group {
  qmat_cage cage;
  uint32_t scheme, boundary, face_count;
} group;

typedef struct subdivision {
  qmat_context *context;
  const mesh_subdivide_params *params;
  const qmat_mesh *given;
  qmat_cage source;      /* the mesh's cage, or its triangles as a cage; borrowed */
  uint8_t *face_groups;  /* per face of the source */
  size_t *first_corners; /* per face of the source */
  group groups[GROUPS];
  size_t surface_count;    /* subdivided ones */
  double source_deviation; /* of surfaces that are not subdivided */
  double meters_per_unit;
} subdivision;

/* The mesh of a level, and its distance from the limit surface in diagonals. */
typedef struct attempt {
  qmat_mesh *mesh;
  double seen, unresolved, deviation;
  size_t point_count, creases_without_edge;
} attempt;

/* ---- cages ---- */

static qmat_status fail_shortage(qmat_context *context) {
  return qmat_fail_memory(context, "the cages of subdivision surfaces");
}

/* Finds the cage. The triangles of a mesh without cage become a surface of the scheme none. */
static qmat_status find_source(subdivision *s, const qmat_mesh *mesh) {
  s->source = mesh->cage;
  s->source_deviation = mesh->deviation;
  if (mesh->cage.surface_count > 0) return QMAT_OK;
  static uint32_t scheme = QMAT_SCHEME_NONE, boundary = QMAT_BOUNDARY_EDGE_AND_CORNER;
  uint32_t *sizes = qmat_arena_alloc(&s->context->arena, mesh->triangle_count + 1, sizeof *sizes);
  if (!sizes) return fail_shortage(s->context);
  for (size_t i = 0; i < mesh->triangle_count; i++) sizes[i] = 3;
  sizes[mesh->triangle_count] = (uint32_t)mesh->triangle_count;
  s->source = (qmat_cage){.surface_count = 1,
                          .surface_faces = &sizes[mesh->triangle_count],
                          .schemes = &scheme,
                          .boundaries = &boundary,
                          .vertex_count = mesh->vertex_count,
                          .positions = mesh->positions,
                          .face_count = mesh->triangle_count,
                          .face_sizes = sizes,
                          .corner_count = 3 * mesh->triangle_count,
                          .corners = mesh->triangles};
  return QMAT_OK;
}

static size_t group_of(const subdivision *s, size_t surface) {
  const uint32_t scheme =
      s->params->scheme == QMAT_SCHEME_NONE ? s->source.schemes[surface] : (uint32_t)s->params->scheme;
  const uint32_t boundary =
      s->params->boundary_rule == 0 ? s->source.boundaries[surface] : (uint32_t)s->params->boundary_rule - 1;
  return scheme * QMAT_BOUNDARY_COUNT + boundary;
}

static qmat_status fail_face(qmat_context *context, size_t face, const char *why, uint32_t number) {
  qmat_fail(context, QMAT_ERROR_GEOMETRY, why, number);
  qmat_fail_field(context, "mesh");
  return qmat_fail_element(context, "face", (int64_t)face);
}

/* Refuses faces that no scheme accepts. `last_use` (per vertex) starts as zeros. */
static qmat_status check_face(const subdivision *s, size_t face, uint32_t *last_use) {
  const uint32_t size = s->source.face_sizes[face], *corners = s->source.corners + s->first_corners[face];
  if (size < 3) return fail_face(s->context, face, "a face of a subdivision surface has %u corners", size);
  if (s->groups[s->face_groups[face]].scheme == QMAT_SCHEME_LOOP && size != 3) {
    fail_face(s->context, face, "Loop's scheme needs triangles, but the face has %u corners", size);
    return qmat_fail_hint(s->context, "qmat mat: --set surface.scheme=catmull_clark accepts any polygons");
  }
  for (uint32_t k = 0; k < size; k++) {
    if (last_use[corners[k]] == (uint32_t)face + 1)
      return fail_face(s->context, face, "the face uses vertex %u of its cage twice", corners[k]);
    last_use[corners[k]] = (uint32_t)face + 1;
  }
  return QMAT_OK;
}

/* Assigns the faces to groups. */
static qmat_status sort_faces(subdivision *s) {
  qmat_arena *arena = &s->context->arena;
  const qmat_cage *source = &s->source;
  s->face_groups = qmat_arena_alloc(arena, source->face_count, sizeof *s->face_groups);
  s->first_corners = qmat_arena_alloc(arena, source->face_count, sizeof *s->first_corners);
  uint32_t *last_use = qmat_arena_calloc(arena, source->vertex_count, sizeof *last_use);
  if (!s->face_groups || !s->first_corners || !last_use) return fail_shortage(s->context);
  for (uint32_t i = 0; i < GROUPS; i++) {
    group *g = &s->groups[i];
    g->scheme = i / QMAT_BOUNDARY_COUNT;
    g->boundary = i % QMAT_BOUNDARY_COUNT;
    g->cage = (qmat_cage){
        .surface_count = 1, .surface_faces = &g->face_count, .schemes = &g->scheme, .boundaries = &g->boundary};
  }
  size_t face = 0, corner = 0;
  for (size_t surface = 0; surface < source->surface_count; surface++) {
    const size_t index = group_of(s, surface), end = face + source->surface_faces[surface];
    group *g = &s->groups[index];
    s->surface_count += g->scheme != QMAT_SCHEME_NONE;
    for (; face < end; face++) {
      s->face_groups[face] = (uint8_t)index;
      s->first_corners[face] = corner;
      corner += source->face_sizes[face];
      g->face_count++;
      g->cage.corner_count += source->face_sizes[face];
      const qmat_status status = g->scheme == QMAT_SCHEME_NONE ? QMAT_OK : check_face(s, face, last_use);
      if (status != QMAT_OK) return status;
    }
  }
  return QMAT_OK;
}

/* Fills the cage of a group with its faces and vertices. `ids` has room for one number per vertex of the source. */
static qmat_status fill_group(subdivision *s, size_t index, int32_t *ids) {
  qmat_arena *arena = &s->context->arena;
  const qmat_cage *source = &s->source;
  qmat_cage *cage = &s->groups[index].cage;
  cage->face_count = s->groups[index].face_count;
  cage->face_sizes = qmat_arena_alloc(arena, cage->face_count, sizeof *cage->face_sizes);
  cage->corners = qmat_arena_alloc(arena, cage->corner_count, sizeof *cage->corners);
  cage->positions = qmat_arena_alloc(arena, cage->corner_count, 3 * sizeof *cage->positions);
  cage->holes = qmat_arena_alloc(arena, source->hole_count, sizeof *cage->holes);
  cage->creases = qmat_arena_alloc(arena, source->crease_count, 2 * sizeof *cage->creases);
  cage->crease_sharpness = qmat_arena_alloc(arena, source->crease_count, sizeof *cage->crease_sharpness);
  cage->sharp_vertices = qmat_arena_alloc(arena, source->sharp_count, sizeof *cage->sharp_vertices);
  cage->vertex_sharpness = qmat_arena_alloc(arena, source->sharp_count, sizeof *cage->vertex_sharpness);
  uint32_t *faces = qmat_arena_alloc(arena, source->face_count, sizeof *faces);
  if (!cage->face_sizes || !cage->corners || !cage->positions || !cage->holes || !cage->creases ||
      !cage->crease_sharpness || !cage->sharp_vertices || !cage->vertex_sharpness || !faces)
    return fail_shortage(s->context);
  for (size_t i = 0; i < source->vertex_count; i++) ids[i] = NO_VERTEX;
  uint32_t *next = cage->corners;
  uint32_t face_count = 0;
  for (size_t face = 0; face < source->face_count; face++) {
    if (s->face_groups[face] != index) continue;
    faces[face] = face_count;
    cage->face_sizes[face_count++] = source->face_sizes[face];
    for (uint32_t k = 0; k < source->face_sizes[face]; k++) {
      const uint32_t vertex = source->corners[s->first_corners[face] + k];
      if (ids[vertex] == NO_VERTEX) {
        ids[vertex] = (int32_t)cage->vertex_count;
        memcpy(cage->positions + 3 * cage->vertex_count++, source->positions + 3 * (size_t)vertex, 3 * sizeof(double));
      }
      *next++ = (uint32_t)ids[vertex];
    }
  }
  for (size_t i = 0; i < source->hole_count; i++)
    if (s->face_groups[source->holes[i]] == index) cage->holes[cage->hole_count++] = faces[source->holes[i]];
  for (size_t i = 0; i < source->crease_count; i++) {
    const int32_t a = ids[source->creases[2 * i]], b = ids[source->creases[2 * i + 1]];
    if (a == NO_VERTEX || b == NO_VERTEX) continue;
    cage->creases[2 * cage->crease_count] = (uint32_t)a;
    cage->creases[2 * cage->crease_count + 1] = (uint32_t)b;
    cage->crease_sharpness[cage->crease_count++] = source->crease_sharpness[i];
  }
  for (size_t i = 0; i < source->sharp_count; i++) {
    const int32_t vertex = ids[source->sharp_vertices[i]];
    if (vertex == NO_VERTEX) continue;
    cage->sharp_vertices[cage->sharp_count] = (uint32_t)vertex;
    cage->vertex_sharpness[cage->sharp_count++] = source->vertex_sharpness[i];
  }
  return QMAT_OK;
}

/* ---- levels ---- */

/* The number of faces of all groups at a level. Level 1 has a face per corner, or four per triangle (Loop); each
 * further level has four times as many. */
static double faces_at(const subdivision *s, int level) {
  double first = 0;
  for (size_t i = QMAT_BOUNDARY_COUNT; i < GROUPS; i++) {
    const group *g = &s->groups[i];
    first += g->scheme == QMAT_SCHEME_LOOP ? 4.0 * g->face_count : (double)g->cage.corner_count;
  }
  return ldexp(first, 2 * (level - 1));
}

/* Adds the faces of the scheme none unchanged, except holes. */
static qmat_status add_unsubdivided(const subdivision *s, qmat_soup *soup) {
  const qmat_cage *source = &s->source;
  bool any = false;
  for (size_t i = 0; i < QMAT_BOUNDARY_COUNT; i++) any = any || s->groups[i].face_count > 0;
  if (!any) return QMAT_OK;
  bool *is_hole = qmat_arena_calloc(&s->context->arena, source->face_count, sizeof *is_hole);
  if (!is_hole) return fail_shortage(s->context);
  for (size_t i = 0; i < source->hole_count; i++) is_hole[source->holes[i]] = true;
  qmat_status status = qmat_soup_add_vertices(s->context, soup, source->positions, source->vertex_count);
  for (size_t face = 0; face < source->face_count && status == QMAT_OK; face++) {
    if (s->groups[s->face_groups[face]].scheme != QMAT_SCHEME_NONE || is_hole[face]) continue;
    status = qmat_soup_add_facet(s->context, soup, source->corners + s->first_corners[face], source->face_sizes[face],
                                 (uint32_t)soup->facet_count, 0);
  }
  return status;
}

/* Whether the midpoint of p and r is nearer to `centre` than the midpoint of q and t. */
static bool is_first_nearer(const double *p, const double *q, const double *r, const double *t, const double *centre) {
  double first[3], second[3];
  for (int k = 0; k < 3; k++) {
    first[k] = 0.5 * p[k] + 0.5 * r[k];
    second[k] = 0.5 * q[k] + 0.5 * t[k];
  }
  return qmat_point_distance(first, centre) <= qmat_point_distance(second, centre);
}

/* Adds a level as triangles. A quad is split along the diagonal that is nearer to the surface. */
static qmat_status add_level(qmat_context *context, const qmat_limit_level *limit, qmat_soup *soup) {
  const size_t size = limit->face_size, first = soup->vertex_count;
  const double *positions = limit->positions;
  qmat_status status = qmat_soup_reserve(context, soup, limit->position_count, (size - 2) * limit->face_count,
                                         3 * (size - 2) * limit->face_count);
  if (status == QMAT_OK) status = qmat_soup_add_vertices(context, soup, positions, limit->position_count);
  for (size_t i = 0; i < limit->face_count && status == QMAT_OK; i++) {
    const uint32_t *ids = limit->faces + i * limit->face_stride;
    uint32_t turn = 0;
    if (size == 4 && ids[2] != ids[3] &&
        !is_first_nearer(positions + 3 * (size_t)ids[0], positions + 3 * (size_t)ids[1], positions + 3 * (size_t)ids[2],
                         positions + 3 * (size_t)ids[3], positions + 3 * (size_t)ids[8]))
      turn = 1;
    const uint32_t count = size == 4 && ids[2] == ids[3] ? 1 : (uint32_t)size - 2;
    for (uint32_t t = 0; t < count && status == QMAT_OK; t++) {
      const uint32_t corners[] = {(uint32_t)first + ids[turn], (uint32_t)first + ids[turn + t + 1],
                                  (uint32_t)first + ids[(turn + t + 2) % size]};
      status = qmat_soup_add_facet(context, soup, corners, 3, (uint32_t)soup->facet_count, 0);
    }
  }
  return status;
}

/* Measures the largest distance to the mesh from the limit points that are not its vertices, in diagonals. */
static qmat_status measure_level(qmat_context *context, const qmat_surface *surface, const qmat_limit_level *limit,
                                 attempt *a) {
  const size_t count = limit->position_count, size = limit->face_size, slice = 1 << 15;
  double *points = qmat_alloc(count, 3 * sizeof *points);
  uint8_t *tested = qmat_calloc(count, 1);
  qmat_status status = points && tested ? QMAT_OK : qmat_fail_memory(context, "points of the limit surface");
  for (size_t i = 0; i < limit->face_count && status == QMAT_OK; i++)
    for (size_t k = size; k < limit->face_stride; k++) tested[limit->faces[i * limit->face_stride + k]] = 1;
  if (status == QMAT_OK) qmat_frame_to_unit(qmat_surface_frame(surface), limit->positions, count, points);
  double farthest = 0;
  size_t tested_count = 0;
  const int threads = qmat_threads(context);
  for (size_t begin = 0; begin < count && status == QMAT_OK; begin += slice) {
    const size_t end = count - begin < slice ? count : begin + slice;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256) reduction(max : farthest) reduction(+ : tested_count)
    for (size_t i = begin; i < end; i++) {
      if (!tested[i]) continue;
      tested_count++;
      farthest = fmax(farthest, qmat_surface_distance(surface, points + 3 * i, INFINITY, NULL, NULL));
    }
    status = qmat_progress(context, end, count, "points of the limit surface");
  }
  a->seen = fmax(a->seen, farthest);
  a->point_count += tested_count;
  qmat_free(points);
  qmat_free(tested);
  return status;
}

/* Makes the mesh of a level and measures it. `report` gets the results of welding. */
static qmat_status make_attempt(const subdivision *s, int level, int depth, attempt *a, json_t *report) {
  qmat_context *context = s->context;
  qmat_limit_level limits[GROUPS] = {0};
  qmat_soup soup = {.meters_per_unit = s->meters_per_unit};
  qmat_surface *surface = NULL;
  const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP}; /* scene.read has refused them where it should */
  *a = (attempt){.mesh = NULL};
  qmat_status status = add_unsubdivided(s, &soup);
  for (size_t i = 0; i < GROUPS && status == QMAT_OK; i++) {
    const group *g = &s->groups[i];
    if (g->scheme == QMAT_SCHEME_NONE || g->face_count == 0) continue;
    status = qmat_progress(context, i, GROUPS, "schemes");
    if (status == QMAT_OK) status = qmat_limit_level_make(context, &g->cage, level, depth, &limits[i]);
    if (status == QMAT_OK) status = add_level(context, &limits[i], &soup);
    a->unresolved = fmax(a->unresolved, limits[i].unresolved);
    a->creases_without_edge += limits[i].creases_without_edge;
  }
  if (status == QMAT_OK && soup.facet_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY,
              "no face is left: all are holes, or at a border that the boundary rule drops");
    status = qmat_fail_field(context, "mesh");
  }
  if (status == QMAT_OK) status = qmat_soup_to_mesh(context, &soup, "", &options, &a->mesh, report);
  qmat_soup_uninit(&soup);
  if (status == QMAT_OK) status = qmat_surface_new(context, a->mesh, &surface);
  for (size_t i = 0; i < GROUPS; i++) {
    if (status == QMAT_OK && limits[i].face_count > 0) status = measure_level(context, surface, &limits[i], a);
    qmat_limit_level_uninit(&limits[i]);
  }
  if (status == QMAT_OK) {
    const double diagonal = qmat_surface_frame(surface)->diagonal;
    a->unresolved /= diagonal;
    a->deviation = all_levels * a->seen + a->unresolved;
    /* Nobody else has the mesh yet, so it may be sealed again. */
    a->mesh->deviation = fmax(a->deviation * diagonal, s->source_deviation);
    a->mesh->base.sealed = false;
    status = qmat_lend_joints(context, s->given, a->mesh);
    if (status == QMAT_OK) status = qmat_value_seal(context, &a->mesh->base);
  }
  qmat_surface_free(surface);
  if (status != QMAT_OK && a->mesh) qmat_value_release(&a->mesh->base);
  if (status != QMAT_OK) a->mesh = NULL;
  return status;
}

static qmat_status fail_too_fine(const subdivision *s, int level, int depth, const attempt *coarser) {
  if (!coarser->mesh) {
    qmat_fail(s->context, QMAT_ERROR_GEOMETRY, "measuring level %d takes %.0f faces, and at most %.0f are made", level,
              faces_at(s, depth), MOST_FACES);
    qmat_fail_field(s->context, "level");
    int finest = level - 1;
    while (finest > 0 && faces_at(s, finest + 1) > MOST_FACES) finest--;
    if (finest > 0) qmat_fail_hint(s->context, "qmat mat: --set surface.level=%d", finest);
    return QMAT_ERROR_GEOMETRY;
  }
  qmat_fail(s->context, QMAT_ERROR_GEOMETRY,
            "a deviation below %.2g of the diagonal takes %.0f faces, and at most %.0f are made", coarser->deviation,
            faces_at(s, depth), MOST_FACES);
  qmat_fail_field(s->context, "epsilon");
  if (level == 1) return qmat_fail_hint(s->context, "a larger epsilon");
  return qmat_fail_hint(s->context, "a larger epsilon, or qmat mat: --set surface.level=%d", level - 1);
}

/* Makes the given level, or the first whose deviation is allowed. Semi-sharp edges are subdivided deeper as long as
 * they dominate the deviation. */
static qmat_status find_level(const subdivision *s, double allowed, int *level, int *depth, attempt *best,
                              json_t *report) {
  const bool is_chosen = s->params->level == 0;
  *level = is_chosen ? 0 : (int)s->params->level;
  *depth = *level + 1;
  *best = (attempt){.mesh = NULL};
  for (;;) {
    if (faces_at(s, *depth) > MOST_FACES) return fail_too_fine(s, *level, *depth, best);
    if (best->mesh) qmat_value_release(&best->mesh->base);
    const qmat_status status = make_attempt(s, *level, *depth, best, report);
    if (status != QMAT_OK || best->deviation <= allowed) return status;
    const bool goes_deeper = best->unresolved > 0.5 * allowed && faces_at(s, *depth + 1) <= MOST_FACES;
    if (is_chosen && (all_levels * best->seen > 0.5 * allowed || !goes_deeper)) {
      *level += 1;
      if (*depth == *level) *depth += 1;
    } else if (goes_deeper) {
      *depth += 1;
    } else {
      return QMAT_OK;
    }
  }
}

/* ---- the node ---- */

static qmat_status fill_report(qmat_context *context, const subdivision *s, int level, int depth, const attempt *a,
                               const json_t *facts, qmat_report *report) {
  static const char *const kept[] = {"vertices",          "triangles",  "vertices_welded",      "border_edges",
                                     "nonmanifold_edges", "components", "euler_characteristic", "closed",
                                     "oriented"};
  json_t *root = report->root;
  int bad = qmat_json_set_count(root, "surfaces", s->surface_count);
  bad |= json_object_set_new(root, "level", json_integer(level));
  bad |= json_object_set_new(root, "deviation", json_real(a->deviation));
  if (a->mesh) {
    bad |= json_object_set_new(root, "depth", json_integer(depth));
    bad |= json_object_set_new(root, "deviation_seen", json_real(a->seen));
    bad |= json_object_set_new(root, "deviation_of_sharpness", json_real(a->unresolved));
    bad |= qmat_json_set_count(root, "points_measured", a->point_count);
    bad |= qmat_json_set_count(root, "creases_without_edge", a->creases_without_edge);
    for (size_t i = 0; i < sizeof kept / sizeof *kept; i++)
      bad |= json_object_set(root, kept[i], json_object_get(facts, kept[i]));
    if (a->creases_without_edge > 0)
      bad |= qmat_json_add_warning(root,
                                   "%zu creases of subdivision surfaces are not edges of their cages and are ignored",
                                   a->creases_without_edge);
  }
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

static qmat_status subdivide(subdivision *s, const qmat_mesh *mesh, attempt *best, qmat_report *report) {
  qmat_frame frame;
  qmat_status status = qmat_frame_of_mesh(s->context, mesh, &frame);
  if (status == QMAT_OK) status = find_source(s, mesh);
  if (status == QMAT_OK) status = sort_faces(s);
  int level = 0, depth = 0;
  json_t *facts = NULL;
  if (status == QMAT_OK && s->surface_count > 0) {
    const double epsilon = s->params->epsilon > 0 ? s->params->epsilon : QMAT_DEFAULT_EPSILON;
    int32_t *ids = qmat_arena_alloc(&s->context->arena, s->source.vertex_count, sizeof *ids);
    facts = json_object();
    if (!ids || !facts) status = fail_shortage(s->context);
    if (status == QMAT_OK && faces_at(s, 1) > MOST_FACES) status = fail_too_fine(s, 0, 1, best);
    for (size_t i = QMAT_BOUNDARY_COUNT; i < GROUPS && status == QMAT_OK; i++)
      if (s->groups[i].face_count > 0) status = fill_group(s, i, ids);
    if (status == QMAT_OK) status = find_level(s, s->params->tolerance * epsilon, &level, &depth, best, facts);
  }
  if (status == QMAT_OK) status = fill_report(s->context, s, level, depth, best, facts, report);
  json_decref(facts);
  return status;
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  subdivision s = {.context = context, .params = params, .given = mesh, .meters_per_unit = mesh->meters_per_unit};
  attempt best = {.mesh = NULL};
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = subdivide(&s, mesh, &best, report);
  return qmat_hand_over(context, status,
                        (qmat_value *const[]){best.mesh ? &best.mesh->base : qmat_value_retain(&mesh->base),
                                              report ? &report->base : NULL},
                        2, outputs);
}

static const char *const schemes[] = {
    [QMAT_SCHEME_NONE] = "as_authored", [QMAT_SCHEME_CATMULL_CLARK] = "catmull_clark",
    [QMAT_SCHEME_LOOP] = "loop",        [QMAT_SCHEME_BILINEAR] = "bilinear",
    [QMAT_SCHEME_COUNT] = NULL,
};

static const char *const boundary_rules[] = {
    "as_authored",
    [QMAT_BOUNDARY_NONE + 1] = "none",
    [QMAT_BOUNDARY_EDGE + 1] = "edge_only",
    [QMAT_BOUNDARY_EDGE_AND_CORNER + 1] = "edge_and_corner",
    [QMAT_BOUNDARY_COUNT + 1] = NULL,
};

static const qmat_param params[] = {
    QMAT_INT(mesh_subdivide_params, level, "subdivisions", 0, 0, 8,
             "The number of subdivisions; 0: as many as epsilon needs, none where the cage is fine enough"),
    QMAT_LENGTH(mesh_subdivide_params, epsilon, 0.01, 0, 1, "The error bound of the final result; 0: 0.01"),
    QMAT_FLOAT(mesh_subdivide_params, tolerance, "epsilon", 0.1, 0.001, 1,
               "The largest distance between mesh and limit surface"),
    QMAT_ENUM(mesh_subdivide_params, scheme, schemes, QMAT_SCHEME_NONE,
              "The subdivision scheme: the model's own, or one for all its surfaces"),
    {.name = "boundary",
     .unit = "",
     .doc = "At a border: drop its faces, make it a smooth curve, or a smooth curve with sharp corners at single faces",
     .type = QMAT_PARAM_ENUM,
     .default_number = 0,
     .choices = boundary_rules,
     .offset = offsetof(mesh_subdivide_params, boundary_rule)},
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "A surface, optionally with the cages of its subdivision surfaces"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The limit surface as triangles; the input if nothing is subdivided"},
    {.name = "report",
     .type = QMAT_REPORT,
     .doc = "The level, and the distance between the triangles and the limit surface"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, &qmat_library_opensubdiv, NULL};

const qmat_node qmat_node_mesh_subdivide = {
    .name = "mesh.subdivide",
    .version = 4,
    .summary = "Replaces subdivision surfaces by triangles on their limit surface",
    .doc =
        "Subdivides the Catmull-Clark, Loop and bilinear surfaces of a USD file, with their creases, corners, boundary "
        "rules and holes, and moves the vertices to the limit surface. Other surfaces pass through, unless a scheme is "
        "given: then their polygons, or their triangles in other formats, are the cage.\n\n"
        "The deviation of a level is twice the largest distance between the mesh and the limits of edge midpoints and "
        "face centres; semi-sharp edges add the distance to their neighbours. It is an estimate, not a bound. The mesh "
        "carries it along: medial.simplify keeps its errors below epsilon minus the deviation, and medial.evaluate "
        "adds it to the errors that it states.",
    .citation = "Catmull and Clark 1978; Loop 1987; DeRose et al. 1998, Subdivision surfaces in character animation",
    .params_size = sizeof(mesh_subdivide_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
