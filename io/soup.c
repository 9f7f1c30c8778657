/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/soup.h"

#include <math.h>
#include <string.h>

#include "core/hash.h"
#include "io/orient.h"
#include "io/polygon.h"

#define NONE UINT32_MAX
static const size_t MOST_TRIANGLES = (size_t)1 << 30; /* three half-edges of each fit 32 bits */

/* ---- growing ---- */

qmat_status qmat_soup_reserve(qmat_context *context, qmat_soup *soup, size_t vertices, size_t facets, size_t corners) {
  if (vertices > UINT32_MAX - soup->vertex_count || facets > UINT32_MAX - soup->facet_count ||
      corners > SIZE_MAX / 8 - soup->corner_count) {
    return qmat_fail_memory(context, "the vertices and facets");
  }
  vertices += soup->vertex_count;
  facets += soup->facet_count;
  corners += soup->corner_count;
  if (qmat_grow((void **)&soup->positions, &soup->vertex_capacity, vertices, 3 * sizeof *soup->positions) != 0 ||
      qmat_grow((void **)&soup->facet_ends, &soup->facet_end_capacity, facets, sizeof *soup->facet_ends) != 0 ||
      qmat_grow((void **)&soup->facet_ordinals, &soup->facet_ordinal_capacity, facets, sizeof *soup->facet_ordinals) !=
          0 ||
      qmat_grow((void **)&soup->facet_lines, &soup->facet_line_capacity, facets, sizeof *soup->facet_lines) != 0 ||
      qmat_grow((void **)&soup->corners, &soup->corner_capacity, corners, sizeof *soup->corners) != 0) {
    return qmat_fail_memory(context, "the vertices and facets");
  }
  return QMAT_OK;
}

/* Reports progress where `more` items take the count past a multiple of REPORT_EVERY. */
static qmat_status report_progress(qmat_context *context, size_t count, size_t more, const char *unit) {
  enum { REPORT_EVERY = 1 << 15 };
  return count / REPORT_EVERY == (count + more) / REPORT_EVERY ? QMAT_OK : qmat_progress(context, count, 0, unit);
}

qmat_status qmat_soup_add_vertices(qmat_context *context, qmat_soup *soup, const double *positions, size_t count) {
  if (count > soup->vertex_capacity - soup->vertex_count) {
    qmat_status status = qmat_soup_reserve(context, soup, count, 0, 0);
    if (status != QMAT_OK) return status;
  }
  if (count > 0) memcpy(soup->positions + 3 * soup->vertex_count, positions, 3 * count * sizeof *positions);
  soup->vertex_count += count;
  return report_progress(context, soup->vertex_count - count, count, "vertices read");
}

qmat_status qmat_soup_add_facet(qmat_context *context, qmat_soup *soup, const uint32_t *corners, size_t count,
                                uint32_t ordinal, int line) {
  /* qmat_soup_reserve grows facet_lines last, so all arrays per facet have at least its capacity. */
  if (soup->facet_count >= soup->facet_line_capacity || count > soup->corner_capacity - soup->corner_count) {
    qmat_status status = qmat_soup_reserve(context, soup, 0, 1, count);
    if (status != QMAT_OK) return status;
  }
  if (count > 0) memcpy(soup->corners + soup->corner_count, corners, count * sizeof *corners);
  soup->corner_count += count;
  soup->facet_ends[soup->facet_count] = soup->corner_count;
  soup->facet_ordinals[soup->facet_count] = ordinal;
  soup->facet_lines[soup->facet_count] = line;
  soup->facet_count++;
  return report_progress(context, soup->facet_count - 1, 1, "facets read");
}

qmat_status qmat_soup_add_skin(qmat_context *context, qmat_soup *soup, const uint32_t *joints, const double *weights,
                               size_t count) {
  const size_t all = 4 * soup->vertex_count, first = 4 * (soup->vertex_count - count);
  if (qmat_grow((void **)&soup->joints, &soup->joint_capacity, all, sizeof *soup->joints) != 0 ||
      qmat_grow((void **)&soup->weights, &soup->weight_capacity, all, sizeof *soup->weights) != 0)
    return qmat_fail_memory(context, "the skin of a mesh");
  for (size_t i = 4 * soup->skinned_count; i < first; i++) {
    soup->joints[i] = 0;
    soup->weights[i] = i % 4 == 0;
  }
  memcpy(soup->joints + first, joints, 4 * count * sizeof *joints);
  memcpy(soup->weights + first, weights, 4 * count * sizeof *weights);
  soup->skinned_count = soup->vertex_count;
  return QMAT_OK;
}

/* The arrays of a cage: the offsets of array and count, and the bytes per item. */
static const struct {
  size_t array, count, bytes;
} cage_arrays[QMAT_CAGE_ARRAYS] = {
    {offsetof(qmat_cage, surface_faces), offsetof(qmat_cage, surface_count), sizeof(uint32_t)},
    {offsetof(qmat_cage, schemes), offsetof(qmat_cage, surface_count), sizeof(uint32_t)},
    {offsetof(qmat_cage, boundaries), offsetof(qmat_cage, surface_count), sizeof(uint32_t)},
    {offsetof(qmat_cage, positions), offsetof(qmat_cage, vertex_count), 3 * sizeof(double)},
    {offsetof(qmat_cage, face_sizes), offsetof(qmat_cage, face_count), sizeof(uint32_t)},
    {offsetof(qmat_cage, corners), offsetof(qmat_cage, corner_count), sizeof(uint32_t)},
    {offsetof(qmat_cage, holes), offsetof(qmat_cage, hole_count), sizeof(uint32_t)},
    {offsetof(qmat_cage, creases), offsetof(qmat_cage, crease_count), 2 * sizeof(uint32_t)},
    {offsetof(qmat_cage, crease_sharpness), offsetof(qmat_cage, crease_count), sizeof(double)},
    {offsetof(qmat_cage, sharp_vertices), offsetof(qmat_cage, sharp_count), sizeof(uint32_t)},
    {offsetof(qmat_cage, vertex_sharpness), offsetof(qmat_cage, sharp_count), sizeof(double)},
};

static size_t cage_count(const qmat_cage *cage, size_t row) {
  return *(const size_t *)(const void *)((const char *)cage + cage_arrays[row].count);
}

static void **cage_array(qmat_cage *cage, size_t row) {
  return (void **)(void *)((char *)cage + cage_arrays[row].array);
}

static const void *cage_items(const qmat_cage *cage, size_t row) {
  return *(void *const *)(const void *)((const char *)cage + cage_arrays[row].array);
}

static void offset_ids(uint32_t *ids, size_t count, size_t by) {
  for (size_t i = 0; i < count; i++) ids[i] += (uint32_t)by;
}

qmat_status qmat_soup_add_cage(qmat_context *context, qmat_soup *soup, const qmat_cage *cage) {
  qmat_cage *to = &soup->cage;
  if (cage->vertex_count > UINT32_MAX - to->vertex_count || cage->face_count > UINT32_MAX - to->face_count)
    return qmat_fail_memory(context, "more than 2^32 - 1 vertices of cages");
  for (size_t row = 0; row < QMAT_CAGE_ARRAYS; row++) {
    const size_t before = cage_count(to, row), more = cage_count(cage, row), bytes = cage_arrays[row].bytes;
    if (qmat_grow(cage_array(to, row), &soup->cage_capacities[row], before + more, bytes) != 0)
      return qmat_fail_memory(context, "the cages of subdivision surfaces");
    if (more > 0) memcpy((char *)*cage_array(to, row) + before * bytes, cage_items(cage, row), more * bytes);
  }
  offset_ids(to->corners + to->corner_count, cage->corner_count, to->vertex_count);
  offset_ids(to->holes + to->hole_count, cage->hole_count, to->face_count);
  offset_ids(to->creases + 2 * to->crease_count, 2 * cage->crease_count, to->vertex_count);
  offset_ids(to->sharp_vertices + to->sharp_count, cage->sharp_count, to->vertex_count);
  to->surface_count += cage->surface_count;
  to->vertex_count += cage->vertex_count;
  to->face_count += cage->face_count;
  to->corner_count += cage->corner_count;
  to->hole_count += cage->hole_count;
  to->crease_count += cage->crease_count;
  to->sharp_count += cage->sharp_count;
  return QMAT_OK;
}

void qmat_soup_clear_cage(qmat_soup *soup) {
  for (size_t row = 0; row < QMAT_CAGE_ARRAYS; row++) {
    qmat_free(*cage_array(&soup->cage, row));
    soup->cage_capacities[row] = 0;
  }
  soup->cage = (qmat_cage){0};
}

/* Copies a cage without spare capacity. */
static qmat_status copy_cage(qmat_context *context, const qmat_cage *from, qmat_cage *to) {
  if (from->surface_count == 0) return QMAT_OK;
  for (size_t row = 0; row < QMAT_CAGE_ARRAYS; row++) {
    const size_t count = cage_count(from, row), bytes = cage_arrays[row].bytes;
    void *copy = qmat_alloc(count, bytes);
    if (!copy) return qmat_fail_memory(context, "the cages of subdivision surfaces");
    if (count > 0) memcpy(copy, cage_items(from, row), count * bytes);
    *cage_array(to, row) = copy;
    *(size_t *)(void *)((char *)to + cage_arrays[row].count) = count;
  }
  return QMAT_OK;
}

void qmat_soup_uninit(qmat_soup *soup) {
  qmat_soup_clear_cage(soup);
  qmat_free(soup->positions);
  qmat_free(soup->facet_ends);
  qmat_free(soup->facet_ordinals);
  qmat_free(soup->facet_lines);
  qmat_free(soup->corners);
  qmat_free(soup->joints);
  qmat_free(soup->weights);
  *soup = (qmat_soup){0};
}

static size_t facet_start(const qmat_soup *soup, size_t facet) {
  return facet > 0 ? soup->facet_ends[facet - 1] : 0;
}

/* ---- making a mesh ---- */

typedef struct counts {
  size_t defects, polygons, welded, collapsed, repeated, opposite, unreferenced;
} counts;

typedef struct conversion {
  qmat_context *context;
  const qmat_soup *soup;
  const char *path;
  bool drops_defects;
  double unit_of_file; /* where the soup has none */
  qmat_arena arena;    /* separate, so that scratch memory is freed before the mesh is oriented */
  uint8_t *dropped;    /* per facet */
  uint32_t *welded;    /* per vertex: the first vertex at the same position */
  uint32_t *triangles; /* 3 * triangle_count, on the heap */
  size_t triangle_count;
  counts counts;
} conversion;

static qmat_status fail_shortage(conversion *c) {
  qmat_fail_memory(c->context, "making a mesh of the file");
  return qmat_fail_at(c->context, c->path, 0, 0);
}

/* Adds the facet's number and line to the newest error. */
static qmat_status at_facet(conversion *c, size_t facet) {
  qmat_fail_at(c->context, c->path, c->soup->facet_lines[facet], 0);
  return qmat_fail_element(c->context, "facet", c->soup->facet_ordinals[facet]);
}

/* The size of an open-addressing table for `count` entries: a power of two, at most half full. */
static size_t table_size(size_t count) {
  size_t size = 16;
  while (size < 2 * count) size *= 2;
  return size;
}

static uint32_t *make_table(conversion *c, size_t size) {
  uint32_t *table = qmat_arena_alloc(&c->arena, size, sizeof *table);
  if (table) memset(table, 0xFF, size * sizeof *table);
  return table;
}

static qmat_status check_counts(conversion *c) {
  const qmat_soup *soup = c->soup;
  if (soup->facet_count == 0) {
    qmat_fail(c->context, QMAT_ERROR_GEOMETRY,
              soup->vertex_count > 0 ? "the file has vertices but no facets" : "the file has no facets");
    return qmat_fail_at(c->context, c->path, 0, 0);
  }
  if (soup->corner_count > MOST_TRIANGLES || soup->facet_count > MOST_TRIANGLES) {
    qmat_fail(c->context, QMAT_ERROR_MEMORY, "the facets have %zu corners; at most %zu are supported",
              soup->corner_count, MOST_TRIANGLES);
    return qmat_fail_at(c->context, c->path, 0, 0);
  }
  for (size_t i = 0; i < 3 * soup->vertex_count; i++) {
    if (isfinite(soup->positions[i])) continue;
    qmat_fail(c->context, QMAT_ERROR_GEOMETRY, "the vertex has a coordinate that is not finite");
    qmat_fail_at(c->context, c->path, 0, 0);
    return qmat_fail_element(c->context, "vertex", (int64_t)(i / 3));
  }
  return QMAT_OK;
}

static qmat_status refuse_or_drop(conversion *c, size_t facet) {
  if (!c->drops_defects) {
    qmat_fail_hint(c->context, "set 'defects: drop' to drop such facets; qmat mat: --set model.defects=drop");
    return at_facet(c, facet);
  }
  c->dropped[facet] = 1;
  c->counts.defects++;
  return QMAT_OK;
}

/* Checks the corners of the facets, and finds defects: fewer than three different vertices, or the same vertices as an
 * earlier facet. A polygon may repeat a vertex: a bridge from its border to that of a hole does. */
static qmat_status check_facets(conversion *c) {
  const qmat_soup *soup = c->soup;
  size_t size = table_size(soup->facet_count);
  uint32_t *table = make_table(c, size);
  uint32_t *last_use = qmat_arena_calloc(&c->arena, soup->vertex_count, sizeof *last_use); /* facet + 1 */
  c->dropped = qmat_arena_calloc(&c->arena, soup->facet_count, 1);
  if (!table || !last_use || !c->dropped) return fail_shortage(c);

  for (size_t f = 0; f < soup->facet_count; f++) {
    size_t start = facet_start(soup, f), count = soup->facet_ends[f] - start;
    const uint32_t *corners = soup->corners + start;
    uint32_t stamp = (uint32_t)f + 1;
    uint64_t hash = count;
    size_t different = 0;
    uint32_t twice = NONE;
    for (size_t k = 0; k < count; k++) {
      if (corners[k] >= soup->vertex_count) {
        qmat_fail(c->context, QMAT_ERROR_FORMAT, "the facet uses vertex %u, but there are only %zu (counted from 0)",
                  corners[k], soup->vertex_count);
        return at_facet(c, f);
      }
      if (last_use[corners[k]] == stamp && twice == NONE) twice = corners[k];
      different += last_use[corners[k]] != stamp;
      last_use[corners[k]] = stamp;
      hash += qmat_hash_mix(corners[k] + UINT64_C(0x9e3779b97f4a7c15)); /* a sum does not depend on the order */
    }
    if (different < 3) {
      if (!c->drops_defects && count < 3)
        qmat_fail(c->context, QMAT_ERROR_GEOMETRY, "the facet has %zu corner%s; at least 3 are needed", count,
                  count == 1 ? "" : "s");
      else if (!c->drops_defects)
        qmat_fail(c->context, QMAT_ERROR_GEOMETRY, "the facet uses vertex %u twice (counted from 0)", twice);
      qmat_status status = refuse_or_drop(c, f);
      if (status != QMAT_OK) return status;
      continue;
    }
    size_t slot = qmat_hash_mix(hash) & (size - 1);
    for (; table[slot] != NONE; slot = (slot + 1) & (size - 1)) {
      size_t other = table[slot], k = facet_start(soup, other);
      if (soup->facet_ends[other] - k != count) continue;
      while (k < soup->facet_ends[other] && last_use[soup->corners[k]] == stamp) k++;
      if (k == soup->facet_ends[other]) break;
    }
    if (table[slot] == NONE) {
      table[slot] = (uint32_t)f;
      continue;
    }
    if (!c->drops_defects) {
      qmat_fail(c->context, QMAT_ERROR_GEOMETRY, "the facet repeats facet %u", soup->facet_ordinals[table[slot]]);
    }
    qmat_status status = refuse_or_drop(c, f);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status weld(conversion *c) {
  const qmat_soup *soup = c->soup;
  size_t size = table_size(soup->vertex_count);
  uint32_t *table = make_table(c, size);
  c->welded = qmat_arena_alloc(&c->arena, soup->vertex_count, sizeof *c->welded);
  if (!table || !c->welded) return fail_shortage(c);

  for (uint32_t v = 0; v < soup->vertex_count; v++) {
    const double *point = soup->positions + 3 * (size_t)v;
    uint64_t hash = 0;
    for (int k = 0; k < 3; k++) {
      double number = point[k] + 0.0; /* -0 becomes 0 */
      uint64_t bits;
      memcpy(&bits, &number, sizeof bits);
      hash = qmat_hash_mix(hash ^ bits) + UINT64_C(0x9e3779b97f4a7c15);
    }
    size_t slot = hash & (size - 1);
    for (; table[slot] != NONE; slot = (slot + 1) & (size - 1)) {
      const double *other = soup->positions + 3 * (size_t)table[slot];
      if (point[0] == other[0] && point[1] == other[1] && point[2] == other[2]) break;
    }
    if (table[slot] == NONE) {
      table[slot] = v;
    } else {
      c->counts.welded++;
    }
    c->welded[v] = table[slot];
  }
  return QMAT_OK;
}

static void keep_triangle(conversion *c, uint32_t i, uint32_t j, uint32_t k) {
  uint32_t *triangle = c->triangles + 3 * c->triangle_count++;
  triangle[0] = i;
  triangle[1] = j;
  triangle[2] = k;
}

static qmat_status triangulate(conversion *c) {
  const qmat_soup *soup = c->soup;
  size_t most = 3, total = 0;
  for (size_t f = 0; f < soup->facet_count; f++) {
    size_t count = soup->facet_ends[f] - facet_start(soup, f);
    if (count > most) most = count;
    if (!c->dropped[f]) total += count - 2;
  }
  uint32_t *ids = qmat_arena_alloc(&c->arena, most, sizeof *ids);
  uint32_t *links = qmat_arena_alloc(&c->arena, most, 8 * sizeof *links);
  uint32_t *cuts = qmat_arena_alloc(&c->arena, most, 3 * sizeof *cuts);
  double *points = qmat_arena_alloc(&c->arena, most, 3 * sizeof *points);
  double *flat = qmat_arena_alloc(&c->arena, most, 3 * sizeof *flat);
  c->triangles = qmat_alloc(total, 3 * sizeof *c->triangles);
  if (!ids || !links || !cuts || !points || !flat || !c->triangles) return fail_shortage(c);

  for (size_t f = 0; f < soup->facet_count; f++) {
    if (c->dropped[f]) continue;
    size_t start = facet_start(soup, f), read = soup->facet_ends[f] - start, count = 0;
    for (size_t k = 0; k < read; k++) {
      uint32_t id = c->welded[soup->corners[start + k]];
      if (count > 0 && ids[count - 1] == id) continue;
      ids[count++] = id;
    }
    while (count > 1 && ids[count - 1] == ids[0]) count--;
    if (count < 3) {
      c->counts.collapsed++;
      continue;
    }
    if (read > 3) c->counts.polygons++;
    if (count == 3) {
      keep_triangle(c, ids[0], ids[1], ids[2]);
      continue;
    }
    if (count > 256) {
      qmat_status status = qmat_progress(c->context, f, soup->facet_count, "facets");
      if (status != QMAT_OK) return status;
    }
    for (size_t k = 0; k < count; k++) memcpy(points + 3 * k, soup->positions + 3 * (size_t)ids[k], 3 * sizeof *points);
    if (!qmat_polygon_triangulate(points, ids, count, flat, links, cuts)) {
      qmat_fail(c->context, QMAT_ERROR_GEOMETRY,
                "the facet is a concave polygon of %zu corners; at most %d are supported", count,
                QMAT_LARGEST_CONCAVE_POLYGON);
      return at_facet(c, f);
    }
    size_t before = c->triangle_count;
    for (size_t t = 0; t < count - 2; t++) {
      uint32_t i = ids[cuts[3 * t]], j = ids[cuts[3 * t + 1]], k = ids[cuts[3 * t + 2]];
      if (i != j && j != k && k != i) keep_triangle(c, i, j, k);
    }
    if (c->triangle_count == before) c->counts.collapsed++;
  }
  return QMAT_OK;
}

/* Rotates the lowest corner to the front: triangles of equal corners and orientation become identical. */
static void canonical(const uint32_t *triangle, uint32_t out[3]) {
  int first = triangle[0] < triangle[1] ? 0 : 1;
  if (triangle[2] < triangle[first]) first = 2;
  for (int k = 0; k < 3; k++) out[k] = triangle[(first + k) % 3];
}

/* Drops triangles that equal an earlier one, and counts those that are an earlier one with opposite orientation. Facets
 * with equal vertices in the file are defects already, so these come mostly from welding. */
static qmat_status drop_repeats(conversion *c) {
  size_t size = table_size(c->triangle_count), kept = 0;
  uint32_t *table = make_table(c, size);
  if (!table) return fail_shortage(c);
  for (size_t t = 0; t < c->triangle_count; t++) {
    uint32_t now[3], other[3];
    canonical(c->triangles + 3 * t, now);
    uint64_t low = now[1] < now[2] ? now[1] : now[2], high = now[1] < now[2] ? now[2] : now[1];
    uint64_t hash = qmat_hash3(now[0], low, high);
    bool repeated = false, opposite = false;
    size_t slot = hash & (size - 1);
    for (; table[slot] != NONE && !repeated; slot = (slot + 1) & (size - 1)) {
      canonical(c->triangles + 3 * (size_t)table[slot], other);
      if (other[0] != now[0]) continue;
      repeated = other[1] == now[1] && other[2] == now[2];
      opposite = opposite || (other[1] == now[2] && other[2] == now[1]);
    }
    if (repeated) {
      c->counts.repeated++;
      continue;
    }
    if (opposite) c->counts.opposite++;
    table[slot] = (uint32_t)kept;
    memmove(c->triangles + 3 * kept, c->triangles + 3 * t, 3 * sizeof *c->triangles);
    kept++;
  }
  c->triangle_count = kept;
  return QMAT_OK;
}

/* Of vertices that were welded the first lends its joints: seams repeat them. */
static qmat_status fill_skin(conversion *c, const uint32_t *numbers, qmat_mesh *mesh) {
  const qmat_soup *soup = c->soup;
  if (soup->skinned_count == 0) return QMAT_OK;
  mesh->joints = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->joints);
  mesh->weights = qmat_calloc(4 * mesh->vertex_count, sizeof *mesh->weights);
  if (!mesh->joints || !mesh->weights) return fail_shortage(c);
  mesh->skinned_count = mesh->vertex_count;
  for (size_t v = 0; v < soup->vertex_count; v++) {
    if (numbers[v] == NONE) continue;
    const size_t to = 4 * (size_t)numbers[v];
    if (v < soup->skinned_count) {
      memcpy(mesh->joints + to, soup->joints + 4 * v, 4 * sizeof *mesh->joints);
      memcpy(mesh->weights + to, soup->weights + 4 * v, 4 * sizeof *mesh->weights);
    } else {
      mesh->weights[to] = 1;
    }
  }
  return QMAT_OK;
}

/* Renumbers the used vertices in file order, and passes the arrays to the mesh. */
static qmat_status fill_mesh(conversion *c, qmat_mesh *mesh) {
  const qmat_soup *soup = c->soup;
  if (c->triangle_count == 0) {
    qmat_fail(
        c->context, QMAT_ERROR_GEOMETRY,
        "no facet remains: %zu collapsed when vertices of equal position were welded, %zu were dropped as defects",
        c->counts.collapsed, c->counts.defects);
    return qmat_fail_at(c->context, c->path, 0, 0);
  }
  uint32_t *numbers = qmat_arena_alloc(&c->arena, soup->vertex_count, sizeof *numbers);
  if (!numbers) return fail_shortage(c);
  memset(numbers, 0xFF, soup->vertex_count * sizeof *numbers);
  for (size_t i = 0; i < 3 * c->triangle_count; i++) numbers[c->triangles[i]] = 0;
  uint32_t used = 0;
  for (size_t v = 0; v < soup->vertex_count; v++) {
    if (numbers[v] != NONE) numbers[v] = used++;
  }
  c->counts.unreferenced = soup->vertex_count - c->counts.welded - used;
  mesh->positions = qmat_alloc(used, 3 * sizeof *mesh->positions);
  if (!mesh->positions) return fail_shortage(c);
  for (size_t v = 0; v < soup->vertex_count; v++) {
    if (numbers[v] == NONE) continue;
    for (size_t k = 0; k < 3; k++) mesh->positions[3 * (size_t)numbers[v] + k] = soup->positions[3 * v + k] + 0.0;
  }
  for (size_t i = 0; i < 3 * c->triangle_count; i++) c->triangles[i] = numbers[c->triangles[i]];
  mesh->meters_per_unit = soup->meters_per_unit > 0 ? soup->meters_per_unit : c->unit_of_file;
  mesh->vertex_count = used;
  mesh->triangles = c->triangles;
  mesh->triangle_count = c->triangle_count;
  c->triangles = NULL;
  return fill_skin(c, numbers, mesh);
}

static qmat_status fill_report(conversion *c, const qmat_mesh *mesh, const qmat_connectivity *facts, json_t *report) {
  const struct {
    const char *key;
    int64_t count;
  } rows[] = {
      {"vertices_read", (int64_t)c->soup->vertex_count},
      {"facets_read", (int64_t)c->soup->facet_count},
      {"facets_dropped_as_defects", (int64_t)c->counts.defects},
      {"polygons_triangulated", (int64_t)c->counts.polygons},
      {"vertices_welded", (int64_t)c->counts.welded},
      {"facets_collapsed_by_welding", (int64_t)c->counts.collapsed},
      {"triangles_repeated_by_welding", (int64_t)c->counts.repeated},
      {"opposite_facets", (int64_t)c->counts.opposite},
      {"vertices_unreferenced", (int64_t)c->counts.unreferenced},
      {"vertices", (int64_t)mesh->vertex_count},
      {"triangles", (int64_t)mesh->triangle_count},
      {"border_edges", (int64_t)facts->border_edges},
      {"nonmanifold_edges", (int64_t)facts->nonmanifold_edges},
      {"components", (int64_t)facts->components},
      {"inward_components", (int64_t)facts->inward_components},
      {"euler_characteristic", facts->euler_characteristic},
      {"flipped", (int64_t)facts->flipped},
  };
  for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
    if (json_object_set_new(report, rows[i].key, json_integer(rows[i].count)) != 0) return fail_shortage(c);
  }
  if (json_object_set_new(report, "closed", json_boolean(facts->closed)) != 0 ||
      json_object_set_new(report, "oriented", json_boolean(facts->oriented)) != 0) {
    return fail_shortage(c);
  }
  return QMAT_OK;
}

qmat_status qmat_soup_to_mesh(qmat_context *context, const qmat_soup *soup, const char *path,
                              const qmat_read_options *options, qmat_mesh **mesh, json_t *report) {
  conversion c = {.context = context,
                  .soup = soup,
                  .path = path,
                  .drops_defects = options->defects == QMAT_DEFECTS_DROP,
                  .unit_of_file = options->meters_per_unit};
  qmat_connectivity facts;
  *mesh = NULL;
  qmat_mesh *made = qmat_mesh_new();
  qmat_status status = made ? check_counts(&c) : fail_shortage(&c);
  if (status == QMAT_OK) status = check_facets(&c);
  if (status == QMAT_OK) status = weld(&c);
  if (status == QMAT_OK) status = qmat_progress(context, 0, soup->facet_count, "facets");
  if (status == QMAT_OK) status = triangulate(&c);
  if (status == QMAT_OK) status = drop_repeats(&c);
  if (status == QMAT_OK) status = fill_mesh(&c, made);
  if (status == QMAT_OK) status = qmat_progress(context, soup->facet_count, soup->facet_count, "facets");
  qmat_arena_uninit(&c.arena);
  qmat_free(c.triangles);
  if (status == QMAT_OK) {
    status = qmat_orient_triangles(context, made->positions, made->vertex_count, made->triangles, made->triangle_count,
                                   &facts);
  }
  if (status == QMAT_OK) {
    made->closed = facts.closed;
    made->oriented = facts.oriented;
    made->deviation = soup->deviation;
    if (report) status = fill_report(&c, made, &facts, report);
  }
  if (status == QMAT_OK) status = copy_cage(context, &soup->cage, &made->cage);
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) {
    *mesh = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  return status;
}
