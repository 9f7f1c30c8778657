/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/topology.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/sheets.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

/* The distance from a shell of the points that test its sides, in diagonals. */
static const double beside = 1e-5;

/* Loops over triangles and edges report progress each time after so many. */
enum { ITEMS_A_REPORT = 1 << 16 };

/* Joins the triangles at every edge that has two into shells, and their corners into fans. `is_open`, per triangle: set
 * where an edge has another number. */
static qmat_status join_at_edges(qmat_context *context, const qmat_mesh *mesh, uint32_t *shells, uint32_t *fans,
                                 uint8_t *is_open) {
  qmat_half_edges e;
  qmat_status status = qmat_half_edges_sort(context, mesh->vertex_count, mesh->triangle_count, mesh->triangles, &e);
  for (size_t i = 0, last; status == QMAT_OK && i < e.count; i = last) {
    last = qmat_edge_last(&e, i);
    if (i / ITEMS_A_REPORT != last / ITEMS_A_REPORT) status = qmat_progress(context, i, e.count, "edges");
    const uint32_t a = e.order[i], b = e.order[last - 1];
    for (size_t k = i; last - i != 2 && k < last; k++) is_open[e.order[k] / 3] = 1;
    if (last - i != 2) continue;
    const bool same_way = qmat_half_edge_start(&e, a) == qmat_half_edge_start(&e, b);
    qmat_sets_join(shells, a / 3, b / 3);
    qmat_sets_join(fans, a, same_way ? b : qmat_half_edge_next(b));
    qmat_sets_join(fans, qmat_half_edge_next(a), same_way ? qmat_half_edge_next(b) : b);
  }
  return status;
}

/* The sums over a shell, at its root. */
typedef struct shell {
  size_t fan_count, triangle_count;
  double volume, area, largest_area; /* six times the volume, twice the areas */
  uint32_t largest;                  /* triangle */
  bool is_open;
} shell;

static void triangle_vectors(const qmat_surface *surface, size_t triangle, double normal[3], double centre[3]) {
  const uint32_t *row = &qmat_surface_mesh(surface)->triangles[3 * triangle];
  const double *p = qmat_surface_positions(surface);
  const double *a = &p[3 * (size_t)row[0]], *b = &p[3 * (size_t)row[1]], *c = &p[3 * (size_t)row[2]];
  qmat_triangle_normal(a, b, c, normal);
  for (int k = 0; k < 3; k++) centre[k] = (a[k] + b[k] + c[k]) / 3;
}

/* `triangle`: its number in `fans`. */
static void add_to_shell(shell *sum, uint32_t *fans, size_t triangle, const double normal[3], const double centre[3]) {
  const double area = sqrt(qmat_dot(normal, normal));
  sum->triangle_count++;
  sum->volume += qmat_dot(normal, centre);
  sum->area += area;
  if (area > sum->largest_area) {
    sum->largest_area = area;
    sum->largest = (uint32_t)triangle;
  }
  for (size_t c = 3 * triangle; c < 3 * triangle + 3; c++) sum->fan_count += qmat_set_leader(fans, (uint32_t)c) == c;
}

/* Whether the inside is behind the shell and the outside in front of it; false where both sides are alike. */
static bool separates(const qmat_surface *surface, const shell *s) {
  if (!(s->largest_area > 0)) return false;
  double normal[3], centre[3], behind[3], before[3];
  triangle_vectors(surface, s->largest, normal, centre);
  for (int k = 0; k < 3; k++) {
    behind[k] = centre[k] - beside * normal[k] / s->largest_area;
    before[k] = centre[k] + beside * normal[k] / s->largest_area;
  }
  return qmat_surface_inside(surface, behind) && !qmat_surface_inside(surface, before);
}

/* A closed shell of sheets is flat if it encloses at most this share of area^1.5, as in mesh.solid. */
static const double least_volume = 1e-5;

/* Closed flat shells of sheets enclose no void: each counts as the thin solid that it bounds. `sheets`: the topology of
 * the mesh's sheets as a complex, where a shell of genus g has 2 g loops and a void. */
static qmat_status flatten_shells(qmat_context *context, const qmat_surface *surface, qmat_topology *sheets) {
  qmat_mesh mesh = *qmat_surface_mesh(surface);
  const size_t solids = qmat_solid_triangle_count(&mesh);
  mesh.triangles += 3 * solids;
  mesh.triangle_count = mesh.sheet_triangle_count - mesh.flap_triangle_count;
  uint32_t *shells = qmat_sets_new(context, mesh.triangle_count),
           *fans = qmat_sets_new(context, 3 * mesh.triangle_count);
  shell *sums = qmat_arena_calloc(&context->arena, mesh.triangle_count, sizeof *sums);
  uint8_t *is_open = qmat_arena_calloc(&context->arena, mesh.triangle_count, sizeof *is_open);
  if (!shells || !fans || !sums || !is_open) return qmat_fail_memory(context, "the topology");
  const qmat_status status = join_at_edges(context, &mesh, shells, fans, is_open);
  if (status != QMAT_OK) return status;
  for (size_t t = 0; t < mesh.triangle_count; t++) {
    double normal[3], centre[3];
    shell *sum = &sums[qmat_set_leader(shells, (uint32_t)t)];
    triangle_vectors(surface, solids + t, normal, centre);
    add_to_shell(sum, fans, t, normal, centre);
    sum->is_open |= is_open[t];
  }
  for (size_t t = 0; t < mesh.triangle_count; t++) {
    const shell *sum = &sums[t];
    if (sum->triangle_count == 0 || sum->is_open || sheets->voids == 0) continue;
    const double area = sum->area / 2, volume = sum->volume / 6;
    const size_t genus = (2 + sum->triangle_count / 2 - sum->fan_count) / 2;
    if (fabs(volume) > least_volume * area * sqrt(area) || genus > sheets->loops) continue;
    sheets->voids--;
    sheets->loops -= genus;
    sheets->euler += (int64_t)genus - 1;
  }
  return QMAT_OK;
}

/* Adds the topology of the sheets of the mesh. */
static qmat_status add_sheets(qmat_context *context, const qmat_surface *surface, qmat_topology *topology) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  if (mesh->sheet_triangle_count == 0 || !topology->known) return QMAT_OK;
  qmat_medial *medial = qmat_medial_new();
  qmat_topology sheets;
  qmat_status status =
      medial ? qmat_sheet_slabs_prepend(context, mesh, medial) : qmat_fail_memory(context, "the topology");
  if (status == QMAT_OK) status = qmat_topology_of_medial(context, medial, &sheets);
  if (status == QMAT_OK && sheets.known && sheets.voids > 0) status = flatten_shells(context, surface, &sheets);
  qmat_value_release(medial ? &medial->base : NULL);
  if (status != QMAT_OK) return status;
  topology->known = sheets.known;
  if (!sheets.known) topology->why_not = "counting the voids of its sheets takes too long";
  topology->components += sheets.components;
  topology->loops += sheets.loops;
  topology->voids += sheets.voids;
  topology->euler += sheets.euler;
  return QMAT_OK;
}

qmat_status qmat_topology_of_solid(qmat_context *context, const qmat_surface *surface, qmat_topology *topology) {
  const qmat_mesh *whole = qmat_surface_mesh(surface);
  const qmat_mesh solids = qmat_mesh_of_solids(whole), *mesh = &solids;
  *topology = (qmat_topology){.known = mesh->closed && mesh->oriented && mesh->triangle_count < UINT32_MAX / 3};
  if (!topology->known) topology->why_not = "the surface is open";
  if (!topology->known) return QMAT_OK;
  uint32_t *shells = qmat_sets_new(context, mesh->triangle_count),
           *fans = qmat_sets_new(context, 3 * mesh->triangle_count);
  shell *sums = qmat_arena_calloc(&context->arena, mesh->triangle_count, sizeof *sums);
  uint8_t *is_open = qmat_arena_calloc(&context->arena, mesh->triangle_count, sizeof *is_open);
  if (!shells || !fans || !sums || !is_open) return qmat_fail_memory(context, "the topology");
  qmat_status status = join_at_edges(context, mesh, shells, fans, is_open);
  topology->known = !memchr(is_open, 1, mesh->triangle_count);
  if (!topology->known) topology->why_not = "an edge has more than two triangles: solids touch along it";
  if (status != QMAT_OK || !topology->known) return status;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    double normal[3], centre[3];
    if (t % ITEMS_A_REPORT == ITEMS_A_REPORT - 1) status = qmat_progress(context, t, mesh->triangle_count, "triangles");
    if (status != QMAT_OK) return status;
    triangle_vectors(surface, t, normal, centre);
    add_to_shell(&sums[qmat_set_leader(shells, (uint32_t)t)], fans, t, normal, centre);
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const shell *sum = &sums[t];
    if (sum->triangle_count == 0) continue;
    status = qmat_progress(context, t + 1, mesh->triangle_count, "triangles of shells");
    if (status != QMAT_OK) return status;
    if (!separates(surface, sum)) continue;
    /* Vertices - edges + triangles = 2 - 2 genus, and a triangle has three halves of an edge. */
    topology->loops += (2 + sum->triangle_count / 2 - sum->fan_count) / 2;
    if (sum->volume > 0)
      topology->components++;
    else
      topology->voids++;
  }
  topology->euler = (int64_t)(topology->components + topology->voids) - (int64_t)topology->loops;
  return add_sheets(context, surface, topology);
}
