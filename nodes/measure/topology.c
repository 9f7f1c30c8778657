/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/topology.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/sheets.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"
#include "core/value_check.h"

/* The limit of the entries that the reduction of the matrix visits. */
static const size_t most_entries = 100000000;

/* The distance from a shell of the points that test its sides, in diagonals. */
static const double beside = 1e-5;

/* ---- the medial mesh ---- */

/* The triangles at each edge, in compressed rows, and the number of those not removed. */
typedef struct sides {
  size_t triangle_count, edge_count;
  uint32_t *edges_of; /* 3 a triangle */
  size_t *offsets;
  uint32_t *triangles_at, *degrees;
  uint8_t *removed; /* per triangle */
} sides;

static int compare_edges(const void *left, const void *right) {
  const uint32_t *a = left, *b = right;
  if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
  return (a[1] > b[1]) - (a[1] < b[1]);
}

static qmat_status find_sides(qmat_context *context, const qmat_medial *medial, sides *s) {
  qmat_arena *arena = &context->arena;
  const size_t triangles = medial->triangle_count, edges = medial->edge_count;
  *s = (sides){.triangle_count = triangles, .edge_count = edges};
  s->edges_of = qmat_arena_alloc(arena, triangles, 3 * sizeof *s->edges_of);
  s->offsets = qmat_arena_calloc(arena, edges + 2, sizeof *s->offsets);
  s->triangles_at = qmat_arena_alloc(arena, triangles, 3 * sizeof *s->triangles_at);
  s->degrees = qmat_arena_calloc(arena, edges, sizeof *s->degrees);
  s->removed = qmat_arena_calloc(arena, triangles, sizeof *s->removed);
  if (!s->edges_of || !s->offsets || !s->triangles_at || !s->degrees || !s->removed)
    return qmat_fail_memory(context, "the topology");
  for (size_t i = 0; i < 3 * triangles; i++) {
    const uint32_t *row = &medial->triangles[i - i % 3], wanted[2] = {row[i % 3 == 0], row[i % 3 == 2 ? 1 : 2]};
    const uint32_t *found = bsearch(wanted, medial->edges, edges, 2 * sizeof *wanted, compare_edges);
    s->edges_of[i] = (uint32_t)((found - medial->edges) / 2);
    s->offsets[s->edges_of[i] + 2]++;
    s->degrees[s->edges_of[i]]++;
  }
  for (size_t e = 0; e < edges; e++) s->offsets[e + 2] += s->offsets[e + 1];
  for (size_t i = 0; i < 3 * triangles; i++) s->triangles_at[s->offsets[s->edges_of[i] + 1]++] = (uint32_t)(i / 3);
  return QMAT_OK;
}

/* Removes triangles at edges of one triangle until there is none: no cycle contains such a triangle. */
static qmat_status remove_free(qmat_context *context, sides *s, size_t *left) {
  uint32_t *stack = qmat_arena_alloc(&context->arena, 3 * s->triangle_count + s->edge_count, sizeof *stack);
  if (!stack) return qmat_fail_memory(context, "the topology");
  size_t height = 0;
  for (size_t e = 0; e < s->edge_count; e++)
    if (s->degrees[e] == 1) stack[height++] = (uint32_t)e;
  *left = s->triangle_count;
  while (height > 0) {
    const uint32_t edge = stack[--height];
    if (s->degrees[edge] != 1) continue;
    size_t at = s->offsets[edge];
    while (s->removed[s->triangles_at[at]]) at++;
    const uint32_t triangle = s->triangles_at[at];
    s->removed[triangle] = 1;
    --*left;
    for (size_t k = 0; k < 3; k++) {
      const uint32_t side = s->edges_of[3 * (size_t)triangle + k];
      if (--s->degrees[side] == 1) stack[height++] = side;
    }
  }
  return QMAT_OK;
}

static int compare_ids(const void *left, const void *right) {
  const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
  return (a > b) - (a < b);
}

/* Sorts ids and keeps those that occur an odd number of times. */
static size_t keep_odd(uint32_t *ids, size_t count) {
  qsort(ids, count, sizeof *ids, compare_ids);
  size_t kept = 0;
  for (size_t i = 0, end; i < count; i = end) {
    for (end = i; end < count && ids[end] == ids[i];) end++;
    if ((end - i) % 2) ids[kept++] = ids[i];
  }
  return kept;
}

/* The symmetric difference of two rising lists. */
static size_t add_rows(const uint32_t *a, size_t a_count, const uint32_t *b, size_t b_count, uint32_t *sum) {
  size_t count = 0, i = 0, j = 0;
  while (i < a_count || j < b_count) {
    if (j == b_count || (i < a_count && a[i] < b[j]))
      sum[count++] = a[i++];
    else if (i == a_count || b[j] < a[i])
      sum[count++] = b[j++];
    else
      i++, j++;
  }
  return count;
}

typedef struct sparse_row {
  uint32_t *ids;
  size_t count;
} sparse_row;

/* The rank of the matrix whose rows are the edges of three or more triangles, and whose columns are sheets: triangles
 * joined by edges of two. `*known` becomes false when it takes too long. */
static qmat_status rank_of_branches(qmat_context *context, const sides *s, uint32_t *sheets, size_t *rank,
                                    bool *known) {
  qmat_arena *arena = &context->arena;
  sparse_row *pivots = qmat_arena_calloc(arena, s->triangle_count, sizeof *pivots);
  uint32_t *buffers[2] = {NULL, NULL};
  size_t capacities[2] = {0, 0}, entries = 0;
  qmat_status status = pivots ? QMAT_OK : qmat_fail_memory(context, "the topology");
  *rank = 0;
  for (size_t e = 0; e < s->edge_count && status == QMAT_OK && *known; e++) {
    if (s->degrees[e] < 3) continue;
    size_t count = 0;
    int in = 0;
    if (qmat_grow((void **)&buffers[0], &capacities[0], s->degrees[e], sizeof **buffers)) {
      status = qmat_fail_memory(context, "the topology");
      break;
    }
    for (size_t at = s->offsets[e]; at < s->offsets[e + 1]; at++)
      if (!s->removed[s->triangles_at[at]]) buffers[0][count++] = qmat_set_leader(sheets, s->triangles_at[at]);
    count = keep_odd(buffers[0], count);
    while (count > 0) {
      sparse_row *pivot = &pivots[buffers[in][count - 1]];
      entries += count + pivot->count;
      if (entries > most_entries) {
        *known = false;
        break;
      }
      if (pivot->count == 0) {
        pivot->ids = qmat_arena_alloc(arena, count, sizeof *pivot->ids);
        if (!pivot->ids) {
          status = qmat_fail_memory(context, "the topology");
          break;
        }
        memcpy(pivot->ids, buffers[in], count * sizeof *pivot->ids);
        pivot->count = count;
        ++*rank;
        break;
      }
      if (qmat_grow((void **)&buffers[1 - in], &capacities[1 - in], count + pivot->count, sizeof **buffers)) {
        status = qmat_fail_memory(context, "the topology");
        break;
      }
      count = add_rows(buffers[in], count, pivot->ids, pivot->count, buffers[1 - in]);
      in = 1 - in;
    }
  }
  qmat_free(buffers[0]);
  qmat_free(buffers[1]);
  return status;
}

/* The dimension of the cycles of triangles. */
static qmat_status count_voids(qmat_context *context, const qmat_medial *medial, size_t *voids, bool *known) {
  sides s;
  size_t left = 0, rank = 0;
  qmat_status status = find_sides(context, medial, &s);
  if (status == QMAT_OK) status = remove_free(context, &s, &left);
  if (status != QMAT_OK) return status;
  uint32_t *sheets = qmat_sets_new(context, s.triangle_count);
  if (!sheets) return qmat_fail_memory(context, "the topology");
  size_t sheet_count = left;
  for (size_t e = 0; e < s.edge_count; e++) {
    if (s.degrees[e] != 2) continue;
    uint32_t pair[2];
    size_t found = 0;
    for (size_t at = s.offsets[e]; found < 2; at++)
      if (!s.removed[s.triangles_at[at]]) pair[found++] = s.triangles_at[at];
    sheet_count -= qmat_sets_join(sheets, pair[0], pair[1]);
  }
  status = rank_of_branches(context, &s, sheets, &rank, known);
  *voids = sheet_count - rank;
  return status;
}

qmat_status qmat_topology_find_walls(qmat_context *context, const qmat_medial *medial, uint32_t **walls,
                                     size_t *count) {
  sides s;
  size_t left;
  *count = 0;
  qmat_status status = find_sides(context, medial, &s);
  if (status == QMAT_OK) status = remove_free(context, &s, &left);
  if (status != QMAT_OK) return status;
  *walls = qmat_arena_alloc(&context->arena, left, sizeof **walls);
  if (!*walls) return qmat_fail_memory(context, "the topology");
  for (size_t t = 0; t < medial->triangle_count; t++)
    if (!s.removed[t]) (*walls)[(*count)++] = (uint32_t)t;
  return QMAT_OK;
}

static int compare_rows(const uint32_t *a, const uint32_t *b, size_t length) {
  for (size_t k = 0; k < length; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

/* The first of `count` sorted rows of `length` ids that is not less than `row`. */
static size_t first_row(const uint32_t *rows, size_t count, size_t length, const uint32_t *row) {
  size_t first = 0, last = count;
  while (first < last) {
    const size_t middle = first + (last - first) / 2;
    if (compare_rows(&rows[length * middle], row, length) < 0)
      first = middle + 1;
    else
      last = middle;
  }
  return first;
}

qmat_status qmat_topology_find_empty_triangles(qmat_context *context, const qmat_medial *medial, uint32_t **corners,
                                               size_t *count) {
  const uint32_t *edges = medial->edges;
  for (int pass = 0;; pass++) {
    *count = 0;
    for (size_t e = 0; e < medial->edge_count; e++) {
      const uint32_t lowest[2] = {edges[2 * e + 1], 0};
      for (size_t next = first_row(edges, medial->edge_count, 2, lowest);
           next < medial->edge_count && edges[2 * next] == lowest[0]; next++) {
        const uint32_t triangle[3] = {edges[2 * e], lowest[0], edges[2 * next + 1]};
        const uint32_t third[2] = {triangle[0], triangle[2]};
        if (qmat_simplex_find(edges, medial->edge_count, 2, third) == SIZE_MAX ||
            qmat_simplex_find(medial->triangles, medial->triangle_count, 3, triangle) != SIZE_MAX)
          continue;
        if (pass == 1) memcpy(&(*corners)[3 * *count], triangle, sizeof triangle);
        ++*count;
      }
    }
    if (pass == 1) return QMAT_OK;
    *corners = qmat_arena_alloc(&context->arena, *count, 3 * sizeof **corners);
    if (!*corners) return qmat_fail_memory(context, "the topology");
  }
}

/* What a depth-first search knows of each sphere. */
typedef struct search {
  size_t *next, *ends;   /* its rest of `links`: of the edges at it */
  uint32_t *order, *low; /* when it was reached, from 1; the earliest that is reached from it without `via` */
  uint32_t *via, *stack; /* the edge by which it was reached; the way to the current sphere */
  uint32_t *links;
} search;

static qmat_status search_init(qmat_context *context, const qmat_medial *medial, search *s) {
  qmat_arena *arena = &context->arena;
  const size_t spheres = medial->sphere_count, ends = 2 * medial->edge_count;
  *s = (search){.next = qmat_arena_calloc(arena, spheres + 1, sizeof *s->next),
                .ends = qmat_arena_alloc(arena, spheres + 1, sizeof *s->ends),
                .order = qmat_arena_calloc(arena, spheres, sizeof *s->order),
                .low = qmat_arena_alloc(arena, spheres, sizeof *s->low),
                .via = qmat_arena_alloc(arena, spheres, sizeof *s->via),
                .stack = qmat_arena_alloc(arena, spheres, sizeof *s->stack),
                .links = qmat_arena_alloc(arena, ends, sizeof *s->links)};
  if (!s->next || !s->ends || !s->order || !s->low || !s->via || !s->stack || !s->links)
    return qmat_fail_memory(context, "the topology");
  for (size_t i = 0; i < ends; i++) s->next[medial->edges[i] + 1]++;
  for (size_t v = 0; v < spheres; v++) s->next[v + 1] += s->next[v];
  memcpy(s->ends, s->next, (spheres + 1) * sizeof *s->ends);
  for (size_t i = 0; i < ends; i++) s->links[s->ends[medial->edges[i]]++] = (uint32_t)(i / 2);
  return QMAT_OK;
}

/* Unmarks the edges without which their ends are not connected (bridges; Tarjan 1974) among those reached from `root`.
 */
static void unmark_bridges(const qmat_medial *medial, search *s, uint32_t root, uint32_t *time, bool *marks) {
  size_t depth = 1;
  s->stack[0] = root;
  s->order[root] = s->low[root] = ++*time;
  s->via[root] = UINT32_MAX;
  while (depth > 0) {
    const uint32_t v = s->stack[depth - 1];
    if (s->next[v] < s->ends[v]) {
      const uint32_t edge = s->links[s->next[v]++], *ends = &medial->edges[2 * (size_t)edge];
      const uint32_t other = ends[0] == v ? ends[1] : ends[0];
      if (edge == s->via[v]) continue;
      if (s->order[other] > 0) {
        if (s->order[other] < s->low[v]) s->low[v] = s->order[other];
        continue;
      }
      s->order[other] = s->low[other] = ++*time;
      s->via[other] = edge;
      s->stack[depth++] = other;
    } else if (--depth > 0) {
      const uint32_t before = s->stack[depth - 1];
      if (s->low[v] < s->low[before]) s->low[before] = s->low[v];
      if (s->low[v] > s->order[before]) marks[s->via[v]] = false;
    }
  }
}

typedef struct edge_length {
  double length;
  uint32_t edge;
} edge_length;

static int by_length(const void *left, const void *right) {
  const edge_length *a = left, *b = right;
  if (a->length != b->length) return a->length < b->length ? -1 : 1;
  return (a->edge > b->edge) - (a->edge < b->edge);
}

qmat_status qmat_topology_find_loop_edges(qmat_context *context, const qmat_medial *medial, uint32_t **edges,
                                          size_t *count) {
  qmat_arena *arena = &context->arena;
  search s;
  bool *marks = qmat_arena_alloc(arena, medial->edge_count, sizeof *marks);
  edge_length *found = qmat_arena_alloc(arena, medial->edge_count, sizeof *found);
  *edges = qmat_arena_alloc(arena, medial->edge_count, sizeof **edges);
  *count = 0;
  if (!marks || !found || !*edges) return qmat_fail_memory(context, "the topology");
  const qmat_status status = search_init(context, medial, &s);
  if (status != QMAT_OK) return status;
  memset(marks, true, medial->edge_count * sizeof *marks);
  uint32_t time = 0;
  for (uint32_t v = 0; v < medial->sphere_count; v++)
    if (s.order[v] == 0) unmark_bridges(medial, &s, v, &time, marks);
  for (size_t i = 0; i < 3 * medial->triangle_count; i++) {
    const uint32_t *corners = &medial->triangles[i - i % 3];
    const uint32_t side[2] = {corners[i % 3 == 2], corners[i % 3 == 0 ? 1 : 2]};
    marks[qmat_simplex_find(medial->edges, medial->edge_count, 2, side)] = false;
  }
  for (uint32_t e = 0; e < medial->edge_count; e++) {
    const uint32_t *ends = &medial->edges[2 * (size_t)e];
    const double length =
        qmat_point_distance(&medial->spheres[4 * (size_t)ends[0]], &medial->spheres[4 * (size_t)ends[1]]);
    if (marks[e]) found[(*count)++] = (edge_length){length, e};
  }
  qsort(found, *count, sizeof *found, by_length);
  for (size_t i = 0; i < *count; i++) (*edges)[i] = found[i].edge;
  return QMAT_OK;
}

qmat_status qmat_topology_of_medial(qmat_context *context, const qmat_medial *medial, qmat_topology *topology) {
  *topology = (qmat_topology){.known = true};
  topology->euler = (int64_t)medial->sphere_count - (int64_t)medial->edge_count + (int64_t)medial->triangle_count;
  qmat_status status =
      qmat_sets_count(context, medial->sphere_count, medial->edges, medial->edge_count, &topology->components);
  if (status == QMAT_OK) status = count_voids(context, medial, &topology->voids, &topology->known);
  topology->loops = (size_t)((int64_t)(topology->components + topology->voids) - topology->euler);
  return status;
}

/* ---- the solid ---- */

static uint32_t corner_at(const qmat_mesh *mesh, size_t corner) {
  return mesh->triangles[corner];
}

static size_t next_corner(size_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

static int compare_keys(const void *left, const void *right) {
  const uint64_t a = *(const uint64_t *)left, b = *(const uint64_t *)right;
  return (a > b) - (a < b);
}

/* Joins the triangles at every edge into shells, and their corners into fans. `*paired` becomes false at an edge that
 * does not have two triangles. */
static qmat_status join_at_edges(qmat_context *context, const qmat_mesh *mesh, uint32_t *shells, uint32_t *fans,
                                 bool *paired) {
  const size_t corners = 3 * mesh->triangle_count;
  size_t *offsets = qmat_arena_calloc(&context->arena, mesh->vertex_count + 2, sizeof *offsets);
  uint64_t *keys = qmat_arena_alloc(&context->arena, corners, sizeof *keys);
  if (!offsets || !keys) return qmat_fail_memory(context, "the topology");
  for (int pass = 0; pass < 2; pass++) {
    for (size_t c = 0; c < corners; c++) { /* the edge from corner c to the next */
      const uint32_t a = corner_at(mesh, c), b = corner_at(mesh, next_corner(c)), low = a < b ? a : b;
      if (pass == 0)
        offsets[low + 2]++;
      else
        keys[offsets[low + 1]++] = (uint64_t)(a < b ? b : a) << 32 | c;
    }
    if (pass == 0)
      for (size_t v = 0; v < mesh->vertex_count; v++) offsets[v + 2] += offsets[v + 1];
  }
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const size_t first = offsets[v], last = offsets[v + 1];
    qsort(keys + first, last - first, sizeof *keys, compare_keys);
    for (size_t i = first; i < last; i += 2) {
      const bool two = i + 1 < last && keys[i] >> 32 == keys[i + 1] >> 32;
      if (!two || (i + 2 < last && keys[i] >> 32 == keys[i + 2] >> 32)) {
        *paired = false;
        return QMAT_OK;
      }
      const size_t a = (uint32_t)keys[i], b = (uint32_t)keys[i + 1];
      const bool same_way = corner_at(mesh, a) == corner_at(mesh, b);
      qmat_sets_join(shells, (uint32_t)(a / 3), (uint32_t)(b / 3));
      qmat_sets_join(fans, (uint32_t)a, (uint32_t)(same_way ? b : next_corner(b)));
      qmat_sets_join(fans, (uint32_t)next_corner(a), (uint32_t)(same_way ? next_corner(b) : b));
    }
  }
  return QMAT_OK;
}

/* The sums over a shell, at its root. */
typedef struct shell {
  size_t fan_count, triangle_count;
  double volume, area, largest_area; /* six times the volume, twice the areas */
  uint32_t largest;                  /* triangle */
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
 * the mesh's sheets as a complex, where a shell of genus g has 2 g loops and a void. Left as it is where any edge of
 * the sheets does not have two triangles. */
static qmat_status flatten_shells(qmat_context *context, const qmat_surface *surface, qmat_topology *sheets) {
  qmat_mesh mesh = *qmat_surface_mesh(surface);
  const size_t solids = mesh.triangle_count - mesh.sheet_triangle_count;
  mesh.triangles += 3 * solids;
  mesh.triangle_count = mesh.sheet_triangle_count;
  uint32_t *shells = qmat_sets_new(context, mesh.triangle_count),
           *fans = qmat_sets_new(context, 3 * mesh.triangle_count);
  shell *sums = qmat_arena_calloc(&context->arena, mesh.triangle_count, sizeof *sums);
  bool paired = true;
  if (!shells || !fans || !sums) return qmat_fail_memory(context, "the topology");
  const qmat_status status = join_at_edges(context, &mesh, shells, fans, &paired);
  if (status != QMAT_OK || !paired) return status;
  for (size_t t = 0; t < mesh.triangle_count; t++) {
    double normal[3], centre[3];
    triangle_vectors(surface, solids + t, normal, centre);
    add_to_shell(&sums[qmat_set_leader(shells, (uint32_t)t)], fans, t, normal, centre);
  }
  for (size_t t = 0; t < mesh.triangle_count; t++) {
    const shell *sum = &sums[t];
    if (sum->triangle_count == 0 || sheets->voids == 0) continue;
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
  if (!shells || !fans || !sums) return qmat_fail_memory(context, "the topology");
  const qmat_status status = join_at_edges(context, mesh, shells, fans, &topology->known);
  if (!topology->known) topology->why_not = "an edge has more than two triangles: solids touch along it";
  if (status != QMAT_OK || !topology->known) return status;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    double normal[3], centre[3];
    triangle_vectors(surface, t, normal, centre);
    add_to_shell(&sums[qmat_set_leader(shells, (uint32_t)t)], fans, t, normal, centre);
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const shell *sum = &sums[t];
    if (sum->triangle_count == 0 || !separates(surface, sum)) continue;
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
