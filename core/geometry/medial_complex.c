/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/geometry/medial_complex.h"

#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"

static qmat_status rows_init(qmat_context *context, qmat_rows *rows, const uint32_t *simplices, size_t count,
                             size_t corners, size_t vertex_count) {
  rows->starts = qmat_calloc(vertex_count + 1, sizeof *rows->starts);
  rows->counts = qmat_calloc(vertex_count, sizeof *rows->counts);
  rows->rooms = qmat_calloc(vertex_count, sizeof *rows->rooms);
  rows->items = qmat_alloc(corners * count, sizeof *rows->items);
  rows->used = rows->capacity = corners * count;
  if (!rows->starts || !rows->counts || !rows->rooms || !rows->items)
    return qmat_fail_memory(context, "the medial complex");
  for (size_t i = 0; i < corners * count; i++) rows->rooms[simplices[i]]++;
  for (size_t v = 0; v < vertex_count; v++) rows->starts[v + 1] = rows->starts[v] + rows->rooms[v];
  for (size_t i = 0; i < corners * count; i++) {
    const uint32_t v = simplices[i];
    rows->items[rows->starts[v] + rows->counts[v]++] = (uint32_t)(i / corners);
  }
  return QMAT_OK;
}

static void rows_uninit(qmat_rows *rows) {
  qmat_free(rows->items);
  qmat_free(rows->starts);
  qmat_free(rows->counts);
  qmat_free(rows->rooms);
  *rows = (qmat_rows){0};
}

static void rows_remove(qmat_rows *rows, uint32_t row, uint32_t item) {
  uint32_t *items = rows->items + rows->starts[row];
  const uint32_t count = rows->counts[row];
  uint32_t i = 0;
  while (i < count && items[i] != item) i++;
  if (i == count) return;
  memmove(items + i, items + i + 1, (count - i - 1) * sizeof *items);
  rows->counts[row]--;
}

/* Makes room for `needed` items in a row, moving it to the end of the pool when it does not fit in place. */
static qmat_status rows_reserve(qmat_context *context, qmat_rows *rows, uint32_t row, size_t needed) {
  if (needed <= rows->rooms[row]) return QMAT_OK;
  const size_t room = needed + needed / 2;
  if (qmat_grow((void **)&rows->items, &rows->capacity, rows->used + room, sizeof *rows->items))
    return qmat_fail_memory(context, "the medial complex");
  memcpy(rows->items + rows->used, rows->items + rows->starts[row], rows->counts[row] * sizeof *rows->items);
  rows->starts[row] = rows->used;
  rows->rooms[row] = (uint32_t)room;
  rows->used += room;
  return QMAT_OK;
}

static void rows_append(qmat_rows *rows, uint32_t row, uint32_t item) {
  rows->items[rows->starts[row] + rows->counts[row]++] = item;
}

/* Sets triangle_edges and edge_triangles. */
static qmat_status find_triangle_edges(qmat_context *context, qmat_complex *complex) {
  for (size_t t = 0; t < complex->triangle_count; t++)
    for (size_t k = 0; k < 3; k++) {
      const uint32_t a = complex->triangles[3 * t + (k + 1) % 3], b = complex->triangles[3 * t + (k + 2) % 3];
      const uint32_t edge = qmat_complex_find_edge(complex, a, b);
      if (edge == QMAT_NONE) {
        qmat_fail(context, QMAT_ERROR_INTERNAL, "the medial mesh lacks the edge %u %u", a, b);
        return qmat_fail_element(context, "triangle", (int64_t)t);
      }
      complex->triangle_edges[3 * t + k] = edge;
      complex->edge_triangles[edge]++;
    }
  return QMAT_OK;
}

qmat_status qmat_complex_init(qmat_context *context, qmat_complex *complex, const qmat_medial *medial,
                              const double *spheres) {
  const size_t vertices = medial->sphere_count, edges = medial->edge_count, triangles = medial->triangle_count;
  *complex = (qmat_complex){.vertex_count = vertices,
                            .edge_count = edges,
                            .triangle_count = triangles,
                            .live_vertices = vertices,
                            .live_edges = edges,
                            .live_triangles = triangles};
  complex->spheres = qmat_alloc(vertices, 4 * sizeof(double));
  complex->edges = qmat_alloc(edges, 2 * sizeof(uint32_t));
  complex->edge_triangles = qmat_calloc(edges, sizeof(uint32_t));
  complex->triangles = qmat_alloc(triangles, 3 * sizeof(uint32_t));
  complex->triangle_edges = qmat_alloc(triangles, 3 * sizeof(uint32_t));
  complex->vertex_alive = qmat_alloc(vertices, 1);
  complex->edge_alive = qmat_alloc(edges, 1);
  complex->triangle_alive = qmat_alloc(triangles, 1);
  complex->mark_of_vertex = qmat_calloc(vertices, sizeof(uint32_t));
  complex->edge_to_vertex = qmat_alloc(vertices, sizeof(uint32_t));
  complex->part_of_vertex = qmat_alloc(vertices, sizeof(uint32_t));
  complex->part_has_apex = qmat_alloc(vertices, sizeof(uint8_t));
  complex->mark_of_edge = qmat_calloc(edges, sizeof(uint32_t));
  complex->triangle_at_edge = qmat_alloc(edges, sizeof(uint32_t));
  if (!complex->spheres || !complex->edges || !complex->edge_triangles || !complex->triangles ||
      !complex->triangle_edges || !complex->vertex_alive || !complex->edge_alive || !complex->triangle_alive ||
      !complex->mark_of_vertex || !complex->edge_to_vertex || !complex->part_of_vertex || !complex->part_has_apex ||
      !complex->mark_of_edge || !complex->triangle_at_edge)
    return qmat_fail_memory(context, "the medial complex");
  memcpy(complex->spheres, spheres ? spheres : medial->spheres, 4 * vertices * sizeof(double));
  if (edges) memcpy(complex->edges, medial->edges, 2 * edges * sizeof(uint32_t));
  if (triangles) memcpy(complex->triangles, medial->triangles, 3 * triangles * sizeof(uint32_t));
  memset(complex->vertex_alive, 1, vertices);
  memset(complex->edge_alive, 1, edges);
  memset(complex->triangle_alive, 1, triangles);
  qmat_status status = rows_init(context, &complex->vertex_edges, complex->edges, edges, 2, vertices);
  if (status == QMAT_OK)
    status = rows_init(context, &complex->vertex_triangles, complex->triangles, triangles, 3, vertices);
  if (status == QMAT_OK) status = find_triangle_edges(context, complex);
  return status;
}

void qmat_complex_uninit(qmat_complex *complex) {
  qmat_free(complex->spheres);
  qmat_free(complex->edges);
  qmat_free(complex->edge_triangles);
  qmat_free(complex->triangles);
  qmat_free(complex->triangle_edges);
  qmat_free(complex->vertex_alive);
  qmat_free(complex->edge_alive);
  qmat_free(complex->triangle_alive);
  qmat_free(complex->mark_of_vertex);
  qmat_free(complex->edge_to_vertex);
  qmat_free(complex->part_of_vertex);
  qmat_free(complex->part_has_apex);
  qmat_free(complex->mark_of_edge);
  qmat_free(complex->triangle_at_edge);
  rows_uninit(&complex->vertex_edges);
  rows_uninit(&complex->vertex_triangles);
  *complex = (qmat_complex){0};
}

uint32_t qmat_complex_find_edge(const qmat_complex *complex, uint32_t a, uint32_t b) {
  if (complex->vertex_edges.counts[b] < complex->vertex_edges.counts[a]) {
    const uint32_t swap = a;
    a = b;
    b = swap;
  }
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(complex, a, &count);
  for (size_t i = 0; i < count; i++)
    if (qmat_complex_other_end(complex, at[i], a) == b) return at[i];
  return QMAT_NONE;
}

/* Grows three parallel arrays to at least `needed` elements; those of the first are `first_size` bytes each. */
static int reserve(void **first, size_t first_size, uint32_t **second, uint32_t **third, size_t *capacity,
                   size_t needed) {
  size_t one = *capacity, two = one, three = one;
  if (needed <= one) return 0;
  if (qmat_grow(first, &one, needed, first_size) || qmat_grow((void **)second, &two, needed, sizeof **second) ||
      qmat_grow((void **)third, &three, needed, sizeof **third))
    return -1;
  *capacity = three;
  return 0;
}

void qmat_collapse_uninit(qmat_collapse *collapse) {
  qmat_free(collapse->neighbours);
  qmat_free(collapse->kept_edges);
  qmat_free(collapse->removed_edges);
  qmat_free(collapse->triangle_pairs);
  qmat_free(collapse->kept_triangles);
  qmat_free(collapse->removed_triangles);
  qmat_free(collapse->vanishing);
  *collapse = (qmat_collapse){0};
}

/* The corner of a triangle that is `vertex`; 3 when there is none. */
static size_t corner_of(const uint32_t *triangle, uint32_t vertex) {
  size_t k = 0;
  while (k < 3 && triangle[k] != vertex) k++;
  return k;
}

/* Prefetches a vertex's star: successive collapses touch distant memory. */
static void fetch_star(const qmat_complex *complex, uint32_t vertex) {
  size_t count;
  const uint32_t *at = qmat_complex_edges_at(complex, vertex, &count);
  for (size_t i = 0; i < count; i++) __builtin_prefetch(&complex->edges[2 * (size_t)at[i]]);
  at = qmat_complex_triangles_at(complex, vertex, &count);
  for (size_t i = 0; i < count; i++) {
    __builtin_prefetch(&complex->triangles[3 * (size_t)at[i]]);
    __builtin_prefetch(&complex->triangle_edges[3 * (size_t)at[i]]);
  }
}

/* Computes the union of the stars of `kept` and `removed`; with `removed` QMAT_NONE, the star of `kept`. */
static qmat_status preview_stars(qmat_context *context, qmat_complex *complex, uint32_t kept, uint32_t removed,
                                 qmat_collapse *c) {
  fetch_star(complex, kept);
  if (removed != QMAT_NONE) fetch_star(complex, removed);
  c->kept = kept;
  c->removed = removed;
  c->neighbour_count = c->triangle_count = c->vanishing_count = 0;
  if (++complex->stamp == 0) { /* after overflow, marks of 2^32 previews ago would be valid again */
    memset(complex->mark_of_vertex, 0, complex->vertex_count * sizeof(uint32_t));
    memset(complex->mark_of_edge, 0, complex->edge_count * sizeof(uint32_t));
    complex->stamp = 1;
  }
  size_t kept_count, removed_count = 0;
  const uint32_t *at_kept = qmat_complex_edges_at(complex, kept, &kept_count);
  const uint32_t *at_removed = removed == QMAT_NONE ? NULL : qmat_complex_edges_at(complex, removed, &removed_count);
  if (reserve((void **)&c->neighbours, sizeof *c->neighbours, &c->kept_edges, &c->removed_edges, &c->neighbour_capacity,
              kept_count + removed_count))
    return qmat_fail_memory(context, "a collapse");
  for (size_t i = 0; i < kept_count; i++) {
    const uint32_t w = qmat_complex_other_end(complex, at_kept[i], kept);
    if (w == removed) continue;
    complex->mark_of_vertex[w] = complex->stamp;
    complex->edge_to_vertex[w] = (uint32_t)c->neighbour_count;
    c->neighbours[c->neighbour_count] = w;
    c->kept_edges[c->neighbour_count] = at_kept[i];
    c->removed_edges[c->neighbour_count++] = QMAT_NONE;
  }
  for (size_t i = 0; i < removed_count; i++) {
    const uint32_t w = qmat_complex_other_end(complex, at_removed[i], removed);
    if (w == kept) continue;
    if (complex->mark_of_vertex[w] == complex->stamp) {
      c->removed_edges[complex->edge_to_vertex[w]] = at_removed[i];
      continue;
    }
    c->neighbours[c->neighbour_count] = w;
    c->kept_edges[c->neighbour_count] = QMAT_NONE;
    c->removed_edges[c->neighbour_count++] = at_removed[i];
  }
  at_kept = qmat_complex_triangles_at(complex, kept, &kept_count);
  if (removed != QMAT_NONE) at_removed = qmat_complex_triangles_at(complex, removed, &removed_count);
  if (reserve((void **)&c->triangle_pairs, 2 * sizeof *c->triangle_pairs, &c->kept_triangles, &c->removed_triangles,
              &c->triangle_capacity, kept_count + removed_count) ||
      qmat_grow((void **)&c->vanishing, &c->vanishing_capacity, kept_count, sizeof(uint32_t)))
    return qmat_fail_memory(context, "a collapse");
  for (size_t i = 0; i < kept_count; i++) {
    const uint32_t t = at_kept[i], *corners = &complex->triangles[3 * (size_t)t];
    if (corner_of(corners, removed) < 3) {
      c->vanishing[c->vanishing_count++] = t;
      continue;
    }
    const size_t k = corner_of(corners, kept);
    const uint32_t opposite = complex->triangle_edges[3 * (size_t)t + k];
    complex->mark_of_edge[opposite] = complex->stamp;
    complex->triangle_at_edge[opposite] = (uint32_t)c->triangle_count;
    c->triangle_pairs[2 * c->triangle_count] = corners[(k + 1) % 3];
    c->triangle_pairs[2 * c->triangle_count + 1] = corners[(k + 2) % 3];
    c->kept_triangles[c->triangle_count] = t;
    c->removed_triangles[c->triangle_count++] = QMAT_NONE;
  }
  for (size_t i = 0; i < removed_count; i++) {
    const uint32_t t = at_removed[i], *corners = &complex->triangles[3 * (size_t)t];
    if (corner_of(corners, kept) < 3) continue;
    const size_t k = corner_of(corners, removed);
    const uint32_t opposite = complex->triangle_edges[3 * (size_t)t + k];
    if (complex->mark_of_edge[opposite] == complex->stamp) {
      c->removed_triangles[complex->triangle_at_edge[opposite]] = t;
      continue;
    }
    c->triangle_pairs[2 * c->triangle_count] = corners[(k + 1) % 3];
    c->triangle_pairs[2 * c->triangle_count + 1] = corners[(k + 2) % 3];
    c->kept_triangles[c->triangle_count] = QMAT_NONE;
    c->removed_triangles[c->triangle_count++] = t;
  }
  return QMAT_OK;
}

qmat_status qmat_complex_preview(qmat_context *context, qmat_complex *complex, uint32_t edge, qmat_collapse *collapse) {
  collapse->edge = edge;
  return preview_stars(context, complex, complex->edges[2 * (size_t)edge], complex->edges[2 * (size_t)edge + 1],
                       collapse);
}

qmat_status qmat_complex_preview_move(qmat_context *context, qmat_complex *complex, uint32_t vertex,
                                      qmat_collapse *collapse) {
  collapse->edge = QMAT_NONE;
  return preview_stars(context, complex, vertex, QMAT_NONE, collapse);
}

bool qmat_collapse_keeps_homotopy(qmat_complex *complex, const qmat_collapse *c) {
  uint32_t *parts = complex->part_of_vertex;
  uint8_t *has_apex = complex->part_has_apex;
  for (size_t n = 0; n < c->neighbour_count; n++) {
    parts[c->neighbours[n]] = c->neighbours[n];
    has_apex[c->neighbours[n]] = 0;
  }
  for (size_t t = 0; t < c->triangle_count; t++) {
    const bool is_shared = c->kept_triangles[t] != QMAT_NONE && c->removed_triangles[t] != QMAT_NONE;
    if (is_shared && !qmat_sets_join(parts, c->triangle_pairs[2 * t], c->triangle_pairs[2 * t + 1])) return false;
  }
  for (size_t i = 0; i < c->vanishing_count; i++) {
    const uint32_t *corners = &complex->triangles[3 * (size_t)c->vanishing[i]];
    size_t k = 0;
    while (corners[k] == c->kept || corners[k] == c->removed) k++;
    const uint32_t part = qmat_set_leader(parts, corners[k]);
    if (has_apex[part]) return false;
    has_apex[part] = 1;
  }
  for (size_t n = 0; n < c->neighbour_count; n++) {
    const bool is_shared = c->kept_edges[n] != QMAT_NONE && c->removed_edges[n] != QMAT_NONE;
    if (is_shared && !has_apex[qmat_set_leader(parts, c->neighbours[n])]) return false;
  }
  return true;
}

/* Removes a triangle everywhere but in the rows of `kept` and `removed`, which are rebuilt anyway. */
static void kill_triangle(qmat_complex *complex, uint32_t t, uint32_t kept, uint32_t removed) {
  for (size_t k = 0; k < 3; k++) {
    const uint32_t v = complex->triangles[3 * (size_t)t + k];
    complex->edge_triangles[complex->triangle_edges[3 * (size_t)t + k]]--;
    if (v != kept && v != removed) rows_remove(&complex->vertex_triangles, v, t);
  }
  complex->triangle_alive[t] = 0;
  complex->live_triangles--;
}

qmat_status qmat_complex_collapse(qmat_context *context, qmat_complex *complex, const qmat_collapse *c,
                                  const double sphere[4]) {
  const uint32_t kept = c->kept, removed = c->removed;
  if (removed == QMAT_NONE) {
    memcpy(&complex->spheres[4 * (size_t)kept], sphere, 4 * sizeof *sphere);
    return QMAT_OK;
  }
  qmat_status status = rows_reserve(context, &complex->vertex_edges, kept, c->neighbour_count);
  if (status == QMAT_OK) status = rows_reserve(context, &complex->vertex_triangles, kept, c->triangle_count);
  if (status != QMAT_OK) return status;
  memcpy(&complex->spheres[4 * (size_t)kept], sphere, 4 * sizeof *sphere);
  for (size_t i = 0; i < c->vanishing_count; i++) kill_triangle(complex, c->vanishing[i], kept, removed);
  for (size_t i = 0; i < c->triangle_count; i++)
    if (c->kept_triangles[i] != QMAT_NONE && c->removed_triangles[i] != QMAT_NONE)
      kill_triangle(complex, c->removed_triangles[i], kept, removed);
  for (size_t i = 0; i < c->neighbour_count; i++) {
    const uint32_t mine = c->kept_edges[i], theirs = c->removed_edges[i];
    if (theirs == QMAT_NONE) continue;
    if (mine == QMAT_NONE) {
      uint32_t *ends = &complex->edges[2 * (size_t)theirs];
      ends[ends[0] == removed ? 0 : 1] = kept;
      continue;
    }
    complex->edge_triangles[mine] += complex->edge_triangles[theirs];
    complex->edge_alive[theirs] = 0;
    complex->live_edges--;
    rows_remove(&complex->vertex_edges, c->neighbours[i], theirs);
    complex->edge_to_vertex[c->neighbours[i]] = mine; /* used below to replace the sides of triangles */
  }
  for (size_t i = 0; i < c->triangle_count; i++) {
    if (c->kept_triangles[i] != QMAT_NONE) continue;
    const size_t t = c->removed_triangles[i];
    const size_t k = corner_of(&complex->triangles[3 * t], removed);
    complex->triangles[3 * t + k] = kept;
    for (size_t s = 1; s < 3; s++) { /* the sides at `removed`: opposite the other two corners */
      const uint32_t side = complex->triangle_edges[3 * t + (k + s) % 3];
      if (!complex->edge_alive[side])
        complex->triangle_edges[3 * t + (k + s) % 3] =
            complex->edge_to_vertex[complex->triangles[3 * t + (k + 3 - s) % 3]];
    }
  }
  complex->vertex_edges.counts[kept] = complex->vertex_triangles.counts[kept] = 0;
  for (size_t i = 0; i < c->neighbour_count; i++)
    rows_append(&complex->vertex_edges, kept, c->kept_edges[i] != QMAT_NONE ? c->kept_edges[i] : c->removed_edges[i]);
  for (size_t i = 0; i < c->triangle_count; i++)
    rows_append(&complex->vertex_triangles, kept,
                c->kept_triangles[i] != QMAT_NONE ? c->kept_triangles[i] : c->removed_triangles[i]);
  complex->vertex_edges.counts[removed] = complex->vertex_triangles.counts[removed] = 0;
  complex->edge_alive[c->edge] = 0;
  complex->live_edges--;
  complex->vertex_alive[removed] = 0;
  complex->live_vertices--;
  return QMAT_OK;
}

uint32_t qmat_complex_find_triangle(const qmat_complex *complex, uint32_t a, uint32_t b, uint32_t c) {
  size_t count;
  const uint32_t *at = qmat_complex_triangles_at(complex, a, &count);
  for (size_t i = 0; i < count; i++) {
    const uint32_t *corners = &complex->triangles[3 * (size_t)at[i]];
    if (corner_of(corners, b) < 3 && corner_of(corners, c) < 3) return at[i];
  }
  return QMAT_NONE;
}
