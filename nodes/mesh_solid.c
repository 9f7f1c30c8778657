/* SPDX-License-Identifier: GPL-3.0-or-later */
/* mesh.solid: a solid out of any triangles, and sheets of those that enclose nothing. */
#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/surface.h"
#include "core/geometry/triangle.h"
#include "core/json_text.h"
#include "core/node.h"
#include "nodes/descriptor/epsilon.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/mesh/border_weld.h"
#include "nodes/mesh/flat_folds.h"
#include "nodes/mesh/hidden_parts.h"
#include "nodes/mesh/hole_cgal.h"
#include "nodes/mesh/lend_joints.h"
#include "nodes/mesh/opposite_pairs.h"
#include "nodes/mesh/overlaps.h"
#include "nodes/mesh/parts_report.h"
#include "nodes/mesh/seams.h"
#include "nodes/mesh/triangle_cover.h"
#include "nodes/mesh/turned_parts.h"
#include "nodes/mesh/two_sides.h"
#include "nodes/mesh/wrap_cgal.h"

typedef enum solid_choice { SOLID_AUTO, SOLID_AS_IS, SOLID_CLOSE, SOLID_WRAP, SOLID_SHEET } solid_choice;

typedef struct mesh_solid_params {
  int solid;
  double thickness, epsilon;
} mesh_solid_params;

/* A wrap is this share of epsilon away from what it wraps, and enters openings of a ball of so many times that. */
static const double wrap_offset = 0.25, wrap_alpha = 4;
/* The least epsilon that a wrap is made for, in diagonals; its triangles grow with the inverse square. */
static const double least_wrap_epsilon = 0.004;
/* Border vertices this close are one, in diagonals: coordinates of single precision that were rounded again. */
static const double weld_tolerance = 1e-5;
/* Borders that run along each other at most this share of epsilon apart are a seam. */
static const double seam_width = 0.2;
/* Caps of more than this share of a component's given area, and of that of all components, are worth a warning. */
static const double most_capped = 0.1, most_capped_of_all = 0.05;
/* Above this share, such as the lid of a flat box, the component may be a container, whose inside is to stay open. */
static const double maybe_container = 0.15;
/* A triangle that the union leaves out is within it if it sticks out by at most this, in diagonals: rounding. */
static const double least_gap = 1e-9;
/* A component of sheets is a flap if it sticks out of solids by at most this share of epsilon: an envelope near the
 * solids covers it then. Folds that are not longer need no union for the same reason. */
static const double flap_reach = 0.75;
/* If the union leaves less than this share of the other solids, one may hide them by mistake. */
static const double least_left = 0.2;

typedef struct triangle_list {
  size_t count, capacity;
  uint32_t *corners; /* 3 * count; on the heap */
} triangle_list;

typedef struct solidifier {
  qmat_context *context;
  const mesh_solid_params *params;
  const qmat_mesh *mesh;
  qmat_frame frame;
  double *unit;              /* the vertices in the unit frame: areas and volumes neither overflow nor vanish */
  size_t triangle_count;     /* those that are left after welding; without the given sheets' */
  const uint32_t *triangles; /* 3 * triangle_count */
  qmat_border_weld weld;
  qmat_flat_folds flat;
  qmat_two_sides sides;
  size_t merged;                  /* triangles that are left out for an opposite one */
  size_t plain_count, pair_count; /* triangles without an opposite one; the first of each pair, and given sheets */
  uint32_t *plain, *pairs;        /* their corners */
  qmat_parts parts;
  double *cap_areas; /* per loop */
  uint8_t *facing;   /* per part: a qmat_facing */
  triangle_list solids, sheets;
  double *beside_solids; /* the vertices in the frame of the surface of the solids */
  size_t given_count;    /* of the solids' triangles; behind these are seams and caps */
  uint32_t *solid_parts; /* their parts */
  qmat_hidden_parts hidden;
  size_t first_pair, last_pair; /* of the sheets' triangles: those of no part */
  size_t paired_sheets;         /* that these make */
  size_t caps, cap_sides, folded, turned_parts, inner_triangles, unbounding_triangles, flaps;
  double cap_length, cap_area;
  qmat_united united;
  qmat_wrap wrap;
} solidifier;

static qmat_status fail_shortage(const solidifier *s) {
  return qmat_fail_memory(s->context, "the solid");
}

static const double *position(const solidifier *s, uint32_t vertex) {
  return s->unit + 3 * (size_t)vertex;
}

static qmat_status append(const solidifier *s, triangle_list *list, uint32_t a, uint32_t b, uint32_t c) {
  if (3 * list->count + 3 > list->capacity &&
      qmat_grow((void **)&list->corners, &list->capacity, 3 * list->count + 3, sizeof *list->corners) != 0)
    return fail_shortage(s);
  uint32_t *row = list->corners + 3 * list->count++;
  row[0] = a;
  row[1] = b;
  row[2] = c;
  return QMAT_OK;
}

/* ---- opposite triangles ---- */

static qmat_status drop_second_sides(solidifier *s) {
  const qmat_status status =
      qmat_drop_second_sides(s->context, s->mesh->vertex_count, s->unit, s->triangle_count, s->triangles, &s->sides);
  if (status == QMAT_OK && s->sides.solids > 0)
    s->triangles = s->sides.triangles, s->triangle_count = s->sides.triangle_count;
  return status;
}

static qmat_status split_pairs(solidifier *s) {
  const qmat_mesh *mesh = s->mesh;
  const size_t sheet_count = mesh->sheet_triangle_count;
  qmat_arena *arena = &s->context->arena;
  uint8_t *classes = qmat_arena_calloc(arena, s->triangle_count, 1);
  s->plain = qmat_arena_alloc(arena, 3 * s->triangle_count, sizeof *s->plain);
  s->pairs = qmat_arena_alloc(arena, 3 * (s->triangle_count + sheet_count), sizeof *s->pairs);
  if (!classes || !s->plain || !s->pairs) return fail_shortage(s);
  const qmat_status status =
      qmat_find_opposite_pairs(s->context, mesh->vertex_count, s->triangle_count, s->triangles, classes);
  for (size_t t = 0; status == QMAT_OK && t < s->triangle_count; t++) {
    if (classes[t] == 2) continue;
    uint32_t *to = classes[t] == 1 ? s->pairs + 3 * s->pair_count++ : s->plain + 3 * s->plain_count++;
    memcpy(to, s->triangles + 3 * t, 3 * sizeof *to);
  }
  s->merged = s->sides.dropped + s->pair_count;
  if (sheet_count > 0)
    memcpy(s->pairs + 3 * s->pair_count, mesh->triangles + 3 * (mesh->triangle_count - sheet_count),
           3 * sheet_count * sizeof *s->pairs);
  s->pair_count += sheet_count;
  return status;
}

static double epsilon_of(const solidifier *s) {
  return s->params->epsilon > 0 ? s->params->epsilon : QMAT_DEFAULT_EPSILON;
}

/* Border vertices and edges this close are at one place, in diagonals. */
static double same_place(const solidifier *s) {
  return fmin(weld_tolerance, 0.01 * epsilon_of(s));
}

/* Of sheets, in model units. */
static double sheet_thickness(const solidifier *s) {
  return s->params->thickness > 0 ? s->params->thickness * s->frame.diagonal : s->mesh->sheet_thickness;
}

/* The triangles that may bound solids, with the seams of open meshes welded. */
static qmat_status weld_seams(solidifier *s) {
  s->triangles = s->mesh->triangles;
  s->triangle_count = s->mesh->triangle_count - s->mesh->sheet_triangle_count;
  if (s->mesh->closed) return QMAT_OK;
  const qmat_status status = qmat_weld_borders(s->context, s->mesh->vertex_count, s->unit, s->triangle_count,
                                               s->triangles, same_place(s), &s->weld);
  if (status != QMAT_OK || s->weld.merged == 0) return status;
  s->triangles = s->weld.triangles;
  s->triangle_count = s->weld.triangle_count;
  return QMAT_OK;
}

static qmat_status unfold_flat_faces(solidifier *s) {
  const qmat_status status = qmat_unfold_flat_faces(s->context, s->mesh->vertex_count, s->unit, s->triangle_count,
                                                    s->triangles, same_place(s), flap_reach * epsilon_of(s), &s->flat);
  if (s->flat.triangles) s->triangles = s->flat.triangles, s->triangle_count = s->flat.triangle_count;
  return status;
}

/* ---- solids ---- */

static qmat_status turn_parts(solidifier *s) {
  s->facing = qmat_arena_calloc(&s->context->arena, s->parts.part_count, 1);
  if (!s->facing) return fail_shortage(s);
  const qmat_status status = qmat_find_turned_parts(s->context, &s->parts, s->facing);
  for (size_t i = 0; i < s->parts.part_count; i++) s->turned_parts += s->facing[i] == QMAT_FACING_TURNED;
  return status;
}

/* Triangulates a border loop; its area is kept for the report. */
static qmat_status add_cap(solidifier *s, size_t number) {
  const qmat_loop *loop = &s->parts.loops[number];
  const uint32_t *vertices = s->parts.loop_vertices + loop->first;
  const bool turn = s->facing[loop->part] == QMAT_FACING_TURNED;
  double *points = qmat_alloc(6 * loop->count, sizeof *points), normal[3];
  uint32_t *made = qmat_alloc(3 * (loop->count - 2), sizeof *made);
  qmat_status status = points && made ? QMAT_OK : fail_shortage(s);
  for (size_t i = 0; status == QMAT_OK && i < loop->count; i++) {
    memcpy(points + 3 * i, position(s, vertices[i]), 3 * sizeof *points);
    memcpy(points + 3 * (loop->count + i), position(s, s->parts.loop_thirds[loop->first + i]), 3 * sizeof *points);
  }
  if (status == QMAT_OK)
    status = qmat_triangulate_hole(s->context, points, points + 3 * loop->count, loop->count, made);
  for (size_t i = 0; status == QMAT_OK && i < 3 * (loop->count - 2); i += 3) {
    const uint32_t a = made[i], b = made[turn ? i + 2 : i + 1], c = made[turn ? i + 1 : i + 2];
    qmat_triangle_normal(points + 3 * (size_t)a, points + 3 * (size_t)b, points + 3 * (size_t)c, normal);
    s->cap_areas[number] += sqrt(qmat_dot(normal, normal)) / 2;
    status = append(s, &s->solids, vertices[a], vertices[b], vertices[c]);
  }
  qmat_free(points);
  qmat_free(made);
  s->caps++;
  s->cap_sides += loop->count;
  s->cap_length += loop->length;
  s->cap_area += s->cap_areas[number];
  s->parts.parts[loop->part].cap_area += s->cap_areas[number];
  return status;
}

/* A cap over a tooth of the border folds back on the tooth's own triangle. The two enclose nothing, and no sphere comes
 * near the tip, so the given triangle becomes one of a sheet. `given`: the solids' triangles before the caps. */
static qmat_status split_folds(solidifier *s, size_t given) {
  const size_t count = s->solids.count;
  uint8_t *classes = qmat_arena_calloc(&s->context->arena, count, 1);
  if (!classes) return fail_shortage(s);
  qmat_status status = qmat_find_opposite_pairs(s->context, s->mesh->vertex_count, count, s->solids.corners, classes);
  s->solids.count = 0;
  for (size_t t = 0; status == QMAT_OK && t < count; t++) {
    const uint32_t *c = s->solids.corners + 3 * t;
    if (t == given) s->given_count = s->solids.count;
    if (!classes[t]) {
      if (t < given) s->solid_parts[s->solids.count] = s->solid_parts[t];
      memmove(s->solids.corners + 3 * s->solids.count++, c, 3 * sizeof *c);
    } else if (t < given) {
      status = append(s, &s->sheets, c[0], c[1], c[2]);
      s->folded++;
    }
  }
  return status;
}

/* A cap may fold flat onto given triangles that lie outside of its face, as badly cut ears of a polygon do. */
static qmat_status unfold_caps(solidifier *s) {
  qmat_flat_folds flat;
  qmat_status status = qmat_unfold_flat_faces(s->context, s->mesh->vertex_count, s->unit, s->solids.count,
                                              s->solids.corners, same_place(s), flap_reach * epsilon_of(s), &flat);
  if (status != QMAT_OK || flat.faces == 0) return status;
  size_t given = 0;
  for (size_t t = 0; t < s->given_count; t++)
    if (flat.stays[t]) s->solid_parts[given++] = s->solid_parts[t];
  s->given_count = given;
  s->solids.count = 0;
  for (size_t i = 0; status == QMAT_OK && i < 3 * flat.triangle_count; i += 3)
    status = append(s, &s->solids, flat.triangles[i], flat.triangles[i + 1], flat.triangles[i + 2]);
  s->flat.faces += flat.faces;
  s->flat.distance = fmax(s->flat.distance, flat.distance);
  return status;
}

/* The triangles of solid parts, then those in seams and caps; those of sheets, then one of each pair. */
static qmat_status sort_triangles(solidifier *s) {
  const qmat_parts *parts = &s->parts;
  qmat_status status = QMAT_OK;
  size_t given = 0;
  s->cap_areas = qmat_arena_calloc(&s->context->arena, parts->loop_count, sizeof *s->cap_areas);
  s->solid_parts = qmat_arena_alloc(&s->context->arena, parts->triangle_count, sizeof *s->solid_parts);
  if (!s->cap_areas || !s->solid_parts) return fail_shortage(s);
  for (size_t t = 0; status == QMAT_OK && t < parts->triangle_count; t++) {
    const uint32_t *c = parts->triangles + 3 * t;
    const bool turn = s->facing[parts->part_of[t]] == QMAT_FACING_TURNED;
    triangle_list *list = qmat_part_is_sheet(&parts->parts[parts->part_of[t]]) ? &s->sheets : &s->solids;
    if (list == &s->solids) s->solid_parts[list->count] = parts->part_of[t];
    status = append(s, list, c[0], c[turn ? 2 : 1], c[turn ? 1 : 2]);
    if (t < parts->triangle_count - parts->seam_count) given = s->solids.count;
  }
  s->given_count = given;
  for (size_t i = 0; status == QMAT_OK && i < parts->loop_count; i++) {
    if (qmat_part_is_sheet(&parts->parts[parts->loops[i].part])) continue;
    status = add_cap(s, i);
    if (status == QMAT_OK) status = qmat_progress(s->context, i, parts->loop_count, "borders");
  }
  if (status == QMAT_OK && s->solids.count > given) status = split_folds(s, given);
  if (status == QMAT_OK && s->caps > 0) status = unfold_caps(s);
  for (size_t i = 0; i < parts->part_count; i++) s->cap_area += parts->parts[i].seam_area;
  s->first_pair = s->sheets.count;
  for (size_t t = 0; status == QMAT_OK && t < s->pair_count; t++)
    status = append(s, &s->sheets, s->pairs[3 * t], s->pairs[3 * t + 1], s->pairs[3 * t + 2]);
  s->last_pair = s->sheets.count;
  return status;
}

static void choose_kinds(solidifier *s) {
  for (size_t i = 0; i < s->parts.part_count; i++) {
    qmat_part *part = &s->parts.parts[i];
    if (s->params->solid == SOLID_SHEET && !qmat_part_is_sheet(part))
      part->kind = part->kind == QMAT_PART_CLOSED ? QMAT_PART_FLAT : QMAT_PART_OPEN;
    if (s->params->solid == SOLID_CLOSE && part->kind == QMAT_PART_OPEN) part->kind = QMAT_PART_HOLES;
  }
}

/* How far a wrap is from what it wraps, in model units. */
static double wrap_distance(const solidifier *s) {
  return wrap_offset * fmax(epsilon_of(s), least_wrap_epsilon) * s->frame.diagonal;
}

/* A wrap of triangles of the given vertices. */
static qmat_status wrap_triangles(solidifier *s, const uint32_t *triangles, size_t count) {
  const double offset = wrap_distance(s);
  return qmat_wrap_triangles(s->context, s->mesh->positions, s->mesh->vertex_count, triangles, count,
                             wrap_alpha * offset, offset, &s->wrap);
}

/* ---- the mesh ---- */

static bool is_unchanged(const solidifier *s) {
  return s->solids.count == s->mesh->triangle_count && s->weld.merged == 0 && s->flat.faces == 0 && s->caps == 0 &&
         s->turned_parts == 0 && s->parts.turned == 0 && !s->united.changed && !s->wrap.triangles && s->mesh->closed &&
         s->mesh->oriented;
}

/* Numbers the used vertices in their order. The sheets' vertices are the given mesh's; the solids' are too unless they
 * come from a union or a wrap. */
static qmat_status fill_mesh(const solidifier *s, const double *positions, size_t vertex_count,
                             const uint32_t *triangles, size_t triangle_count, qmat_mesh *mesh) {
  const bool shares = positions == s->mesh->positions;
  const size_t most = vertex_count + (shares ? 0 : s->mesh->vertex_count), shift = shares ? 0 : vertex_count;
  uint32_t *numbers = qmat_arena_calloc(&s->context->arena, most, sizeof *numbers);
  mesh->triangle_count = triangle_count + s->sheets.count;
  mesh->sheet_triangle_count = s->sheets.count;
  mesh->triangles = qmat_alloc(3 * mesh->triangle_count, sizeof *mesh->triangles);
  if (!numbers || !mesh->triangles) return fail_shortage(s);
  for (size_t i = 0; i < 3 * triangle_count; i++) numbers[triangles[i]] = 1;
  for (size_t i = 0; i < 3 * s->sheets.count; i++) numbers[shift + s->sheets.corners[i]] = 1;
  for (size_t v = 0; v < most; v++) numbers[v] = numbers[v] ? (uint32_t)mesh->vertex_count++ : UINT32_MAX;
  mesh->positions = qmat_alloc(3 * mesh->vertex_count, sizeof *mesh->positions);
  if (!mesh->positions) return fail_shortage(s);
  for (size_t v = 0; v < most; v++) {
    if (numbers[v] == UINT32_MAX) continue;
    const double *from = v < vertex_count ? positions + 3 * v : s->mesh->positions + 3 * (v - vertex_count);
    memcpy(mesh->positions + 3 * (size_t)numbers[v], from, 3 * sizeof *from);
  }
  for (size_t i = 0; i < 3 * triangle_count; i++) mesh->triangles[i] = numbers[triangles[i]];
  for (size_t i = 0; i < 3 * s->sheets.count; i++)
    mesh->triangles[3 * triangle_count + i] = numbers[shift + s->sheets.corners[i]];
  mesh->closed = mesh->oriented = true;
  mesh->deviation =
      s->mesh->deviation +
      (s->weld.moved + s->flat.distance + s->sides.distance + s->parts.split_distance) * s->frame.diagonal +
      s->united.moved;
  mesh->meters_per_unit = s->mesh->meters_per_unit;
  mesh->flap_triangle_count = s->flaps;
  if (s->sheets.count > 0) mesh->sheet_thickness = sheet_thickness(s);
  return QMAT_OK;
}

/* The result, without joints and weights, and unsealed. */
static qmat_status place_triangles(const solidifier *s, qmat_mesh *mesh) {
  if (s->wrap.triangles)
    return fill_mesh(s, s->wrap.positions, s->wrap.vertex_count, s->wrap.triangles, s->wrap.triangle_count, mesh);
  if (s->united.changed)
    return fill_mesh(s, s->united.positions, s->united.vertex_count, s->united.triangles, s->united.triangle_count,
                     mesh);
  return fill_mesh(s, s->mesh->positions, s->mesh->vertex_count, s->solids.corners, s->solids.count, mesh);
}

static qmat_status make_mesh(const solidifier *s, qmat_mesh **made) {
  qmat_mesh *mesh = qmat_mesh_new();
  qmat_status status = mesh ? place_triangles(s, mesh) : fail_shortage(s);
  if (status == QMAT_OK && s->wrap.triangles) mesh->deviation += wrap_distance(s);
  if (status == QMAT_OK) status = qmat_lend_joints(s->context, s->mesh, mesh);
  if (status == QMAT_OK)
    *made = mesh;
  else
    qmat_value_release(mesh ? &mesh->base : NULL);
  return status;
}

/* ---- sheets inside solids, and solids' triangles that bound nothing ---- */

/* Sets `covered` to 1 for the triangles of the given mesh's vertices that are inside solids, or stick out by at most
 * `reach` diagonals. Those that are 1 already are passed over. */
static qmat_status find_covered(const solidifier *s, const qmat_surface *solids, const uint32_t *triangles,
                                size_t count, double reach, uint8_t *covered) {
  /* The frame of the solids may be smaller than the given mesh's. */
  const double scale = s->frame.diagonal / qmat_surface_frame(solids)->diagonal;
  return qmat_triangles_find_covered(s->context, solids, s->beside_solids, triangles, count, scale * reach,
                                     scale * epsilon_of(s), covered);
}

/* Leaves out the sheets' triangles that lie inside a solid, such as walls between solids that touch: they bound
 * nothing. */
static qmat_status drop_inner_sheets(solidifier *s, const qmat_surface *solids) {
  const size_t count = s->sheets.count;
  uint8_t *covered = qmat_arena_calloc(&s->context->arena, count, 1);
  if (!covered) return fail_shortage(s);
  const qmat_status status = find_covered(s, solids, s->sheets.corners, count, 0, covered);
  const size_t first = s->first_pair, last = s->last_pair;
  s->sheets.count = 0;
  for (size_t t = 0; t < count; t++) {
    if (covered[t] && t < first) s->first_pair--;
    if (covered[t] && t < last) s->last_pair--;
    if (!covered[t])
      memmove(s->sheets.corners + 3 * s->sheets.count++, s->sheets.corners + 3 * t, 3 * sizeof(uint32_t));
  }
  s->inner_triangles = count - s->sheets.count;
  return status;
}

/* Where a part crosses itself, some of its triangles may have the outside on both sides. The union leaves them out, but
 * they were given: they become sheets. */
static qmat_status keep_unbounding_triangles(solidifier *s, const qmat_surface *solids) {
  uint8_t *covered = qmat_arena_alloc(&s->context->arena, s->given_count, 1);
  if (!covered) return fail_shortage(s);
  for (size_t t = 0; t < s->given_count; t++) covered[t] = !s->united.is_cut[t];
  qmat_status status = find_covered(s, solids, s->solids.corners, s->given_count,
                                    least_gap + 2 * s->united.moved / s->frame.diagonal, covered);
  for (size_t t = 0; t < s->given_count && status == QMAT_OK; t++) {
    const uint32_t *c = s->solids.corners + 3 * t;
    if (covered[t]) continue;
    status = append(s, &s->sheets, c[0], c[1], c[2]);
    s->unbounding_triangles++;
  }
  return status;
}

/* The sheets that are of no part: triangles with an opposite one, and given sheets. */
static qmat_status count_paired_sheets(solidifier *s) {
  return qmat_count_connected(s->context, s->mesh->vertex_count, s->last_pair - s->first_pair,
                              s->sheets.corners ? s->sheets.corners + 3 * s->first_pair : NULL, &s->paired_sheets);
}

/* Moves the flaps behind the other sheets: the components whose triangles are all near solids. */
static qmat_status set_flaps_apart(solidifier *s, const qmat_surface *solids) {
  qmat_arena *arena = &s->context->arena;
  const size_t count = s->sheets.count;
  const double reach = flap_reach * epsilon_of(s) - 0.5 * sheet_thickness(s) / s->frame.diagonal;
  if (count == 0 || !(reach > 0)) return QMAT_OK;
  uint8_t *covered = qmat_arena_calloc(arena, count, 1),
          *sticks_out = qmat_arena_calloc(arena, s->mesh->vertex_count, 1);
  uint32_t *sets = qmat_sets_new(s->context, s->mesh->vertex_count);
  uint32_t *flaps = qmat_arena_alloc(arena, 3 * count, sizeof *flaps), *c = s->sheets.corners;
  if (!covered || !sticks_out || !sets || !flaps) return fail_shortage(s);
  const qmat_status status = find_covered(s, solids, c, count, reach, covered);
  for (size_t i = 0; i < 3 * count; i++) qmat_sets_join(sets, c[i], c[i - i % 3]);
  for (size_t t = 0; t < count; t++)
    if (!covered[t]) sticks_out[qmat_set_leader(sets, c[3 * t])] = 1;
  size_t kept = 0;
  for (size_t t = 0; t < count; t++) {
    const bool stays = sticks_out[qmat_set_leader(sets, c[3 * t])];
    memmove(stays ? c + 3 * kept++ : flaps + 3 * s->flaps++, c + 3 * t, 3 * sizeof *c);
  }
  memcpy(c + 3 * kept, flaps, 3 * s->flaps * sizeof *c);
  return status;
}

static qmat_status review_sheets(solidifier *s) {
  if (s->solids.count == 0 || (s->sheets.count == 0 && !s->united.changed)) return count_paired_sheets(s);
  qmat_mesh *mesh = qmat_mesh_new();
  qmat_surface *solids = NULL;
  qmat_status status = mesh ? place_triangles(s, mesh) : fail_shortage(s);
  if (status == QMAT_OK) status = qmat_surface_new_of_solids(s->context, mesh, &solids);
  s->beside_solids = qmat_arena_alloc(&s->context->arena, s->mesh->vertex_count, 3 * sizeof *s->beside_solids);
  if (status == QMAT_OK && !s->beside_solids) status = fail_shortage(s);
  if (status == QMAT_OK)
    qmat_frame_to_unit(qmat_surface_frame(solids), s->mesh->positions, s->mesh->vertex_count, s->beside_solids);
  if (status == QMAT_OK) status = drop_inner_sheets(s, solids);
  if (status == QMAT_OK && s->united.changed) status = keep_unbounding_triangles(s, solids);
  if (status == QMAT_OK) status = count_paired_sheets(s);
  if (status == QMAT_OK) status = set_flaps_apart(s, solids);
  qmat_surface_free(solids);
  qmat_value_release(mesh ? &mesh->base : NULL);
  return status;
}

/* ---- the report ---- */

/* Warns where the union leaves few solids, or none within a room that is seen from inside. */
static int warn_of_hidden_solids(const solidifier *s, json_t *root) {
  const size_t hidden = s->hidden.parts, in_room = s->hidden.in_room;
  size_t solids = 0;
  for (size_t i = 0; i < s->parts.part_count; i++) solids += !qmat_part_is_sheet(&s->parts.parts[i]);
  if (in_room > 0)
    return qmat_json_add_warning(
        root,
        "a part that faces inwards, such as a room seen from inside, is taken for a full solid, and %zu solid%s inside "
        "it %s left out; --set solid.solid=sheet keeps the walls",
        in_room, in_room == 1 ? "" : "s", in_room == 1 ? "is" : "are");
  if ((double)hidden <= (1 - least_left) * (double)(solids - 1) || hidden == 0) return 0;
  return qmat_json_add_warning(root,
                               "%zu of %zu solids (%zu of %zu triangles) lie in or on other solids, and are left out; "
                               "if that is not wanted, remove the part around them, such as a sky or a room",
                               hidden, solids, s->hidden.triangles, s->solids.count);
}

/* Warns where caps are a large share of components, and of the model: they may be containers. */
static int warn_of_large_caps(const solidifier *s, json_t *root) {
  size_t components = 0, worst = 0;
  double largest = 0, capped = 0, all = 0;
  for (size_t i = 0; i < s->parts.part_count && s->params->solid == SOLID_AUTO; i++) {
    const qmat_part *part = &s->parts.parts[i];
    const double given = part->area - part->seam_area;
    all += given;
    if (!(part->cap_area > most_capped * given)) continue;
    components++;
    capped += part->cap_area;
    if (part->cap_area / given > largest) largest = part->cap_area / given, worst = i;
  }
  if (!(capped > most_capped_of_all * all)) return 0;
  const double *at =
      s->mesh->positions + 3 * (size_t)s->parts.loop_vertices[s->parts.loops[s->parts.parts[worst].first_loop].first];
  return qmat_json_add_warning(
      root,
      "the openings of %zu component%s are closed by caps of up to %.0f %% of a component's area (component %zu, at "
      "(%.5g, %.5g, %.5g))%s",
      components, components == 1 ? "" : "s", 100 * largest, worst + 1, at[0], at[1], at[2],
      largest > maybe_container ? "; "
                                  "--set solid.solid=sheet keeps all surfaces open"
                                : "");
}

static int warn_of_flat_folds(const solidifier *s, json_t *root) {
  const double *at = s->mesh->positions + 3 * (size_t)s->flat.place;
  return qmat_json_add_warning(root,
                               "%zu flat face%s with triangles that overlap, the first at (%.5g, %.5g, %.5g), cannot "
                               "be triangulated again; solid=wrap makes one closed surface around everything",
                               s->flat.failed, s->flat.failed == 1 ? "" : "s", at[0], at[1], at[2]);
}

static qmat_status fill_report(const solidifier *s, const qmat_mesh *made, qmat_report *report) {
  json_t *root = report->root;
  size_t kinds[QMAT_PART_KIND_COUNT] = {0}, open = 0;
  for (size_t i = 0; i < s->parts.part_count; i++) {
    kinds[s->parts.parts[i].kind]++;
    open += s->parts.parts[i].loop_count > 0;
  }
  const qmat_json_count counts[] = {{"vertices_welded", s->weld.merged},
                                    {"parts", s->parts.part_count},
                                    {"parts_open", open},
                                    {"solids", kinds[QMAT_PART_CLOSED] + kinds[QMAT_PART_HOLES]},
                                    {"solids_with_holes", kinds[QMAT_PART_HOLES]},
                                    {"sheets", kinds[QMAT_PART_OPEN] + kinds[QMAT_PART_FLAT] + s->paired_sheets},
                                    {"sheet_triangles", s->sheets.count},
                                    {"opposite_triangles_merged", s->merged},
                                    {"two_sided_solids", s->sides.solids},
                                    {"inner_triangles", s->inner_triangles},
                                    {"unbounding_triangles", s->unbounding_triangles},
                                    {"flap_triangles", s->flaps},
                                    {"parts_turned", s->turned_parts},
                                    {"triangles_turned", s->parts.turned},
                                    {"edges_split", s->parts.edges_split},
                                    {"seam_triangles", s->parts.seam_count},
                                    {"caps", s->caps},
                                    {"cap_sides", s->cap_sides},
                                    {"triangles_folded", s->folded},
                                    {"faces_triangulated_again", s->flat.faces},
                                    {"parts_united", s->united.shells_united},
                                    {"triangles_cut", s->united.cut_triangles}};
  int bad = qmat_json_set_counts(root, counts, sizeof counts / sizeof *counts);
  if (s->caps > 0) bad |= json_object_set_new(root, "cap_length", json_real(s->cap_length));
  if (s->caps + s->parts.seam_count > 0) bad |= json_object_set_new(root, "cap_area", json_real(s->cap_area));
  if (s->wrap.triangles) bad |= qmat_json_set_count(root, "wrap_triangles", s->wrap.triangle_count);
  if (made) {
    bad |= qmat_json_set_count(root, "vertices", made->vertex_count);
    bad |= qmat_json_set_count(root, "triangles", made->triangle_count);
  }
  if (s->params->solid != SOLID_AS_IS && s->params->solid != SOLID_WRAP)
    bad |= qmat_parts_report(&s->parts, s->facing, s->cap_areas, root);
  bad |= warn_of_hidden_solids(s, root);
  bad |= warn_of_large_caps(s, root);
  if (s->flat.failed > 0) bad |= warn_of_flat_folds(s, root);
  if (s->united.why_not)
    bad |= qmat_json_add_warning(root, "the solids are wrapped: those that intersect cannot be united: %s",
                                 s->united.why_not);
  return bad ? qmat_fail_memory(s->context, "the report") : QMAT_OK;
}

/* ---- the node ---- */

static qmat_status make_solid(solidifier *s) {
  const bool joins = s->params->solid != SOLID_SHEET;
  s->unit = qmat_arena_alloc(&s->context->arena, s->mesh->vertex_count, 3 * sizeof *s->unit);
  if (!s->unit) return fail_shortage(s);
  qmat_frame_to_unit(&s->frame, s->mesh->positions, s->mesh->vertex_count, s->unit);
  qmat_status status = weld_seams(s);
  if (status == QMAT_OK) status = unfold_flat_faces(s);
  if (status == QMAT_OK) status = drop_second_sides(s);
  if (status == QMAT_OK) status = split_pairs(s);
  if (status == QMAT_OK)
    status = qmat_parts_find_with_seams(s->context, s->mesh->vertex_count, s->unit, s->plain_count, s->plain,
                                        joins ? seam_width * epsilon_of(s) : 0, joins ? same_place(s) : 0, &s->parts);
  if (status != QMAT_OK) return status;
  choose_kinds(s);
  status = turn_parts(s);
  if (status == QMAT_OK) status = sort_triangles(s);
  if (status == QMAT_OK)
    status = qmat_unite_overlaps(s->context, s->mesh->vertex_count, s->mesh->positions, s->solids.count,
                                 s->solids.corners, flap_reach * epsilon_of(s) * s->frame.diagonal, &s->united);
  /* The last resort: without their union, the inside of what intersects is not defined. */
  if (status == QMAT_OK && s->united.why_not) status = wrap_triangles(s, s->solids.corners, s->solids.count);
  if (status == QMAT_OK && s->united.changed)
    status = qmat_count_hidden_parts(s->context, &s->parts, s->facing, s->given_count, s->solid_parts, s->united.fates,
                                     &s->hidden);
  return status == QMAT_OK ? review_sheets(s) : status;
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  solidifier s = {.context = context, .params = data, .mesh = (const qmat_mesh *)inputs[0]};
  const bool keep = s.params->solid == SOLID_AS_IS;
  qmat_mesh *made = NULL;
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = qmat_frame_of_mesh(context, s.mesh, &s.frame);
  if (status == QMAT_OK && s.mesh->triangle_count >= UINT32_MAX / 6)
    status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu triangles; at most %u are made a solid",
                       s.mesh->triangle_count, UINT32_MAX / 6);
  if (status == QMAT_OK && !keep)
    status =
        s.params->solid == SOLID_WRAP ? wrap_triangles(&s, s.mesh->triangles, s.mesh->triangle_count) : make_solid(&s);
  if (status == QMAT_OK && !keep && !is_unchanged(&s)) status = make_mesh(&s, &made);
  if (status == QMAT_OK) status = fill_report(&s, made, report);
  qmat_free(s.united.positions);
  qmat_free(s.united.triangles);
  qmat_free(s.united.is_cut);
  qmat_free(s.united.fates);
  qmat_free(s.wrap.positions);
  qmat_free(s.wrap.triangles);
  qmat_free(s.solids.corners);
  qmat_free(s.sheets.corners);
  return qmat_hand_over(
      context, status,
      (qmat_value *const[]){made ? &made->base : qmat_value_retain(&s.mesh->base), report ? &report->base : NULL}, 2,
      outputs);
}

static const char *const choices[] = {[SOLID_AUTO] = "auto", [SOLID_AS_IS] = "as_is", [SOLID_CLOSE] = "close",
                                      [SOLID_WRAP] = "wrap", [SOLID_SHEET] = "sheet", NULL};

static const qmat_param params[] = {
    QMAT_ENUM(
        mesh_solid_params, solid, choices, SOLID_AUTO,
        "auto: each component by its winding number; as_is: nothing is done; close: all borders are closed; wrap: "
        "one closed surface around everything; sheet: everything is a sheet"),
    QMAT_LENGTH(mesh_solid_params, thickness, 0, 0, 1, "The thickness of sheets"),
    QMAT_LENGTH(
        mesh_solid_params, epsilon, 0.01, 0, 1,
        "The epsilon of the run. A wrap lies a quarter of it outside the surface. Folds up to three quarters of it "
        "stay, and a sheet that sticks out by no more is a flap. 0: 1%"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "Any triangles"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "Closed solids, then sheets; the input if it is such a mesh"},
    {.name = "report", .type = QMAT_REPORT, .doc = "What each component was taken for, and what was done"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, NULL};

const qmat_node qmat_node_mesh_solid = {
    .name = "mesh.solid",
    .version = 11,
    .summary = "Makes a solid, and sheets, of any triangles",
    .doc =
        "A component is a set of triangles connected across edges. Fins, and walls inside, are components of their "
        "own. Border vertices 1e-5 diagonals apart are one. A closed component is a solid. The borders of an open one "
        "are closed by caps if the generalised winding number is near 0 or 1 along most of it; else it is a sheet, a "
        "surface without volume. A warning says where caps are more than a tenth of a component's area, such as the "
        "lid of a box. A tooth of a border that its cap folds back on is a sheet, too. Border edges are split at "
        "border vertices on them, up to 1e-5 diagonals away (T-junctions), and borders that run along each other "
        "within a fifth of epsilon, such as those of mirrored halves, are joined by triangles, where that makes a "
        "solid much thicker than the seam is wide. Of triangles that coincide with opposite sides one is kept. A "
        "closed surface that is given with both sides is a solid. What faces inwards and is no cavity is turned. A "
        "flat "
        "face whose triangles overlap, such as a concave polygon that is given as a fan, is triangulated again within "
        "its border (faces_triangulated_again).\n\n"
        "Solids that overlap or cross themselves are then replaced by the boundary of their union (a winding number "
        "above 0). Their triangles are cut in exact arithmetic; only new vertices are rounded. Blocks whose sides "
        "touch, or are at most 1e-6 diagonals apart, become one. Cavities stay. Sheets inside a solid are left out. "
        "Disjoint solids stay as they are. Where a part crosses itself, some of its triangles, such as those of a "
        "folded cuff, may have the outside on both sides: they become sheets. A part that crosses only itself, in "
        "folds of at most three quarters of epsilon, stays as it is.\n\n"
        "A connected sheet that sticks out of solids by at most three quarters of epsilon is a flap. Examples are "
        "what noise turns over in a scan, debris at the borders of holes, and decals. The envelope has to cover it, "
        "but no spheres are made for it.\n\n"
        "The sheets are the last triangles. A wrap is CGAL's alpha wrap, which closes gaps up to twice epsilon; what "
        "it keeps away is added to the mesh's deviation.\n\n"
        "If solids that overlap cannot be united, all solids are wrapped, with a warning. Another warning says where "
        "a solid hides most others, such as a sky around a scene, or a room that is seen from inside hides any. A part "
        "that faces inwards is a cavity where other solids are around most of it, whatever touches it from inside.",
    .citation = "Jacobson et al. 2013; Zhou et al. 2016, Mesh arrangements for solid geometry",
    .params_size = sizeof(mesh_solid_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 3,
    .run = run,
};
