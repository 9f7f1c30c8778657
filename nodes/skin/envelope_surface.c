/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/envelope_surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/hash.h"
#include "nodes/skin/envelope_cells.h"

/* A sphere of this radius, in finest cells, always has a cell corner inside; as it moves, the corners nearest to its
 * centre form a connected path. (Half a cell's diagonal is 0.866.) */
static const double RADIUS_FLOOR = 0.9;
/* Vertices keep this far from the sides of their cells, in cells: no two vertices meet. */
static const double INSET = 0.005;
/* Directions in which a sheet is flatter than this, against the most curved one, keep to the mean of the crossings. */
static const double FLAT_EIGENVALUE = 0.05;
/* Triangles below this shape (area against the square of the longest side) are avoided. */
static const double POOR_SHAPE = 0.01, DEGENERATE_SHAPE = 1e-6;
enum { CROSSING_STEPS = 24, BOX_STEPS = 16, PROJECTION_STEPS = 4, LONGEST_FACE = 4 * 64 };

/* A table from 64-bit keys to ids; open addressing. */
typedef struct id_table {
  uint64_t *keys;
  uint32_t *ids;
  uint64_t mask;
} id_table;

static const uint64_t NO_KEY = UINT64_MAX;

static int table_init(id_table *table, size_t entries) {
  size_t size = 64;
  while (size < 2 * entries) size *= 2;
  table->mask = size - 1;
  table->keys = qmat_alloc(size, sizeof *table->keys);
  table->ids = qmat_alloc(size, sizeof *table->ids);
  if (!table->keys || !table->ids) return -1;
  memset(table->keys, 0xff, size * sizeof *table->keys);
  return 0;
}

static void table_uninit(id_table *table) {
  qmat_free(table->keys);
  qmat_free(table->ids);
  *table = (id_table){0};
}

/* The place of the key, or the free place where it belongs. */
static inline size_t table_slot(const id_table *table, uint64_t key) {
  size_t slot = qmat_hash_mix(key) & table->mask;
  while (table->keys[slot] != key && table->keys[slot] != NO_KEY) slot = (slot + 1) & table->mask;
  return slot;
}

static inline uint32_t table_find(const id_table *table, uint64_t key) {
  size_t slot = table_slot(table, key);
  return table->keys[slot] == key ? table->ids[slot] : QMAT_NO_ID;
}

/* Makes room for `entries` keys in all. */
static int table_room(id_table *table, size_t entries) {
  if (2 * entries <= table->mask + 1) return 0;
  id_table larger;
  if (table_init(&larger, 2 * entries)) {
    table_uninit(&larger);
    return -1;
  }
  for (size_t i = 0; i <= table->mask; i++) {
    if (table->keys[i] == NO_KEY) continue;
    size_t slot = table_slot(&larger, table->keys[i]);
    larger.keys[slot] = table->keys[i];
    larger.ids[slot] = table->ids[i];
  }
  table_uninit(table);
  *table = larger;
  return 0;
}

/* Where F changes sign between two neighbouring corners, and what lies around that edge. Going around the edge
 * counter-clockwise as seen from its upper end, face i lies between cells i and i + 1. */
typedef struct crossing {
  uint32_t lower, upper; /* corner ids; the edge runs along the axis from lower to upper */
  uint8_t axis, count;   /* 3 or 4 cells */
  bool inside_below;     /* the lower corner is inside */
  uint32_t cells[4];
  uint32_t faces[4];    /* cell * 8 + side: the smaller cell's side, of equal cells the lower one's */
  uint32_t partners[4]; /* crossing * 4 + face: the other end of the surface's trace on the face */
  uint32_t vertices[4]; /* of the surface, in each cell */
  uint32_t between[4];  /* an extra vertex on the trace, or QMAT_NO_ID */
  bool shared[4];       /* the face holds more than one trace */
  double position[3], normal[3];
} crossing;

typedef struct contour {
  qmat_context *context;
  int threads;
  qmat_cells cells;
  id_table cell_table, corner_table;
  size_t corner_count, corner_capacity, owner_capacity;
  uint64_t *corners;      /* keys */
  uint32_t *owners;       /* a cell at each corner */
  double *values;         /* F at each corner */
  uint32_t *cell_corners; /* 8 per cell */
  uint16_t *split_edges;  /* per cell: bit e is set when a corner lies at the middle of edge e */
  uint16_t *owned_edges;  /* per cell: bit e is set when the cell answers for a crossing there */
  size_t *first_crossing; /* per cell, and the total */
  size_t crossing_count;
  crossing *crossings;
  uint32_t *crossing_at; /* 3 per corner: the crossing of the edge that starts there along each axis */
  size_t vertex_count, vertex_capacity;
  size_t sheet_count; /* vertices that are sheets; others were added to keep the surface simple */
  uint32_t *sheet_cells;
  size_t *sheet_items; /* per sheet its first entry of items, and the total */
  uint32_t *items;     /* crossings */
  double *positions;
} contour;

static void contour_uninit(contour *c) {
  qmat_cells_uninit(&c->cells);
  table_uninit(&c->cell_table);
  table_uninit(&c->corner_table);
  qmat_free(c->corners);
  qmat_free(c->owners);
  qmat_free(c->values);
  qmat_free(c->cell_corners);
  qmat_free(c->split_edges);
  qmat_free(c->owned_edges);
  qmat_free(c->first_crossing);
  qmat_free(c->crossings);
  qmat_free(c->crossing_at);
  qmat_free(c->sheet_cells);
  qmat_free(c->sheet_items);
  qmat_free(c->items);
  qmat_free(c->positions);
}

static uint64_t corner_key(const uint32_t at[3]) {
  return (uint64_t)at[0] | (uint64_t)at[1] << 19 | (uint64_t)at[2] << 38;
}

static void corner_place(uint64_t key, uint32_t at[3]) {
  for (int k = 0; k < 3; k++) at[k] = (uint32_t)(key >> (19 * k)) & 0x7ffff;
}

static uint64_t cell_key(const uint32_t at[3], uint32_t size) {
  return corner_key(at) | (uint64_t)__builtin_ctz(size) << 57;
}

static void place_point(const contour *c, const uint32_t at[3], double point[3]) {
  for (int k = 0; k < 3; k++) point[k] = c->cells.origin[k] + c->cells.finest * at[k];
}

static bool inside(const contour *c, uint32_t corner) {
  return c->values[corner] < 0;
}

/* Edge e of a cell runs along axis e / 4; bits 0 and 1 of e tell on which side it lies along the two next axes. */
static void edge_ends(unsigned e, unsigned *lower, unsigned *upper) {
  unsigned a = e / 4, b = (a + 1) % 3, d = (a + 2) % 3;
  *lower = (e & 1) << b | (e >> 1 & 1) << d;
  *upper = *lower | 1u << a;
}

/* The id of the corner at `at`, new ones with no owner; QMAT_NO_ID when memory is short. */
static uint32_t add_corner(contour *c, const uint32_t at[3]) {
  uint64_t key = corner_key(at);
  size_t slot = table_slot(&c->corner_table, key);
  if (c->corner_table.keys[slot] == key) return c->corner_table.ids[slot];
  if (qmat_grow((void **)&c->corners, &c->corner_capacity, c->corner_count + 1, sizeof *c->corners) ||
      qmat_grow((void **)&c->owners, &c->owner_capacity, c->corner_count + 1, sizeof *c->owners) ||
      table_room(&c->corner_table, c->corner_count + 1)) {
    return QMAT_NO_ID;
  }
  slot = table_slot(&c->corner_table, key);
  c->corner_table.keys[slot] = key;
  c->corner_table.ids[slot] = (uint32_t)c->corner_count;
  c->corners[c->corner_count] = key;
  c->owners[c->corner_count] = QMAT_NO_ID;
  return (uint32_t)c->corner_count++;
}

/* Cells that were halved have corners too, even where no child on that side holds surface: without them a corner at a
 * quarter of a large cell's edge could stand where there is none at its middle. */
static qmat_status add_halved_cells(contour *c) {
  id_table seen = {0};
  qmat_status status = QMAT_OK;
  if (table_init(&seen, 64)) return qmat_fail_memory(c->context, "surface cells");
  uint32_t seen_count = 0;
  for (size_t i = 0; status == QMAT_OK && i < c->cells.count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    for (uint32_t size = 2 * cell->size; size < c->cells.base; size *= 2) {
      uint32_t place[3] = {cell->at[0] & ~(size - 1), cell->at[1] & ~(size - 1), cell->at[2] & ~(size - 1)};
      uint64_t key = cell_key(place, size);
      if (table_find(&seen, key) != QMAT_NO_ID) break;
      bool full = table_room(&seen, seen_count + 1) != 0;
      if (!full) {
        size_t slot = table_slot(&seen, key);
        seen.keys[slot] = key;
        seen.ids[slot] = seen_count++;
      }
      for (unsigned k = 0; k < 8 && !full; k++) {
        uint32_t at[3];
        for (unsigned j = 0; j < 3; j++) at[j] = place[j] + (k >> j & 1) * size;
        full = add_corner(c, at) == QMAT_NO_ID;
      }
      if (full) {
        status = qmat_fail_memory(c->context, "cell corners");
        break;
      }
    }
  }
  table_uninit(&seen);
  return status;
}

static qmat_status number_corners(contour *c) {
  size_t count = c->cells.count;
  c->cell_corners = qmat_alloc(8 * count, sizeof *c->cell_corners);
  c->split_edges = qmat_calloc(count, sizeof *c->split_edges);
  /* A surface in n cells has about 2 n corners. */
  if (!c->cell_corners || !c->split_edges || table_init(&c->cell_table, count) ||
      table_init(&c->corner_table, 2 * count)) {
    return qmat_fail_memory(c->context, "surface cells");
  }
  for (size_t i = 0; i < count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    for (unsigned k = 0; k < 8; k++) {
      uint32_t at[3];
      for (unsigned j = 0; j < 3; j++) at[j] = cell->at[j] + (k >> j & 1) * cell->size;
      uint32_t corner = add_corner(c, at);
      if (corner == QMAT_NO_ID) return qmat_fail_memory(c->context, "cell corners");
      c->cell_corners[8 * i + k] = corner;
      if (c->owners[corner] == QMAT_NO_ID) c->owners[corner] = (uint32_t)i;
    }
    uint64_t key = cell_key(cell->at, cell->size);
    size_t slot = table_slot(&c->cell_table, key);
    c->cell_table.keys[slot] = key;
    c->cell_table.ids[slot] = (uint32_t)i;
  }
  return c->cells.refined_count > 0 ? add_halved_cells(c) : QMAT_OK;
}

/* Gives the corners inside an edge of a cell an owner whose list of primitives holds there. */
static void own_inner_corners(contour *c, size_t cell, const uint32_t from[3], uint32_t length, unsigned axis) {
  if (length < 2) return;
  uint32_t middle[3] = {from[0], from[1], from[2]};
  middle[axis] += length / 2;
  uint32_t corner = table_find(&c->corner_table, corner_key(middle));
  if (corner == QMAT_NO_ID) return;
  if (c->owners[corner] == QMAT_NO_ID) c->owners[corner] = (uint32_t)cell;
  own_inner_corners(c, cell, from, length / 2, axis);
  own_inner_corners(c, cell, middle, length / 2, axis);
}

/* The place of edge e's lower end. */
static void edge_place(const qmat_cell *cell, unsigned e, uint32_t at[3]) {
  unsigned lower, upper;
  edge_ends(e, &lower, &upper);
  for (unsigned j = 0; j < 3; j++) at[j] = cell->at[j] + (lower >> j & 1) * cell->size;
}

static qmat_status find_split_edges(contour *c) {
  if (c->cells.refined_count == 0) return QMAT_OK;
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 512)
  for (size_t i = 0; i < c->cells.count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    for (unsigned e = 0; cell->size > 1 && e < 12; e++) {
      uint32_t at[3];
      edge_place(cell, e, at);
      at[e / 4] += cell->size / 2;
      if (table_find(&c->corner_table, corner_key(at)) == QMAT_NO_ID) continue;
      c->split_edges[i] = (uint16_t)(c->split_edges[i] | 1u << e);
    }
  }
  for (size_t i = 0; i < c->cells.count; i++) {
    for (unsigned e = 0; c->split_edges[i] && e < 12; e++) {
      uint32_t at[3];
      if (!(c->split_edges[i] >> e & 1)) continue;
      edge_place(&c->cells.cells[i], e, at);
      own_inner_corners(c, i, at, c->cells.cells[i].size, e / 4);
    }
  }
  return QMAT_OK;
}

static qmat_status evaluate_corners(contour *c) {
  c->values = qmat_alloc(c->corner_count, sizeof *c->values);
  if (!c->values) return qmat_fail_memory(c->context, "cell corners");
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 512)
  for (size_t i = 0; i < c->corner_count; i++) {
    uint32_t at[3];
    double point[3];
    c->values[i] = INFINITY;
    if (c->owners[i] == QMAT_NO_ID) continue; /* touches no cell of the surface */
    corner_place(c->corners[i], at);
    place_point(c, at, point);
    c->values[i] = qmat_cell_distance(&c->cells, &c->cells.cells[c->owners[i]], point);
  }
  return QMAT_OK;
}

/* The cell that covers the block of `size` finest cells at `at`, itself at least that large, or QMAT_NO_ID. */
static uint32_t find_cell(const contour *c, const uint32_t at[3], uint32_t size) {
  for (; size <= c->cells.base; size *= 2) {
    uint32_t place[3] = {at[0] & ~(size - 1), at[1] & ~(size - 1), at[2] & ~(size - 1)};
    uint32_t cell = table_find(&c->cell_table, cell_key(place, size));
    if (cell != QMAT_NO_ID) return cell;
  }
  return QMAT_NO_ID;
}

/* The four quarters around an edge, counter-clockwise about its axis; a large cell may fill two of them. */
static void quarters_around(const contour *c, const uint32_t at[3], unsigned axis, uint32_t size,
                            uint32_t quarters[4]) {
  static const unsigned below[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int q = 0; q < 4; q++) {
    uint32_t place[3] = {at[0], at[1], at[2]};
    place[(axis + 1) % 3] -= below[q][0] * size;
    place[(axis + 2) % 3] -= below[q][1] * size;
    quarters[q] = find_cell(c, place, size);
  }
}

/* Which crossings each cell answers for: those on its undivided edges, unless an earlier cell of its size has them. The
 * smallest cell around an edge has it undivided. */
static qmat_status assign_crossings(contour *c) {
  size_t count = c->cells.count;
  c->owned_edges = qmat_calloc(count, sizeof *c->owned_edges);
  c->first_crossing = qmat_alloc(count + 1, sizeof *c->first_crossing);
  if (!c->owned_edges || !c->first_crossing) return qmat_fail_memory(c->context, "surface cells");
  bool broken = false;
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 256) reduction(|| : broken)
  for (size_t i = 0; i < count; i++) {
    const qmat_cell *cell = &c->cells.cells[i];
    unsigned owned = 0;
    for (unsigned e = 0; e < 12; e++) {
      unsigned lower, upper;
      edge_ends(e, &lower, &upper);
      if (c->split_edges[i] >> e & 1) continue;
      if (inside(c, c->cell_corners[8 * i + lower]) == inside(c, c->cell_corners[8 * i + upper])) continue;
      uint32_t at[3], quarters[4];
      edge_place(cell, e, at);
      quarters_around(c, at, e / 4, cell->size, quarters);
      bool first = true;
      for (int q = 0; q < 4; q++) {
        if (quarters[q] == QMAT_NO_ID)
          broken = true;
        else if (quarters[q] < i && c->cells.cells[quarters[q]].size == cell->size)
          first = false;
      }
      if (first) owned |= 1u << e;
    }
    c->owned_edges[i] = (uint16_t)owned;
  }
  if (broken) return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "A crossing of the envelope's surface lies in no cell");
  size_t total = 0;
  for (size_t i = 0; i < count; i++) {
    c->first_crossing[i] = total;
    total += (size_t)__builtin_popcount(c->owned_edges[i]);
  }
  c->first_crossing[count] = c->crossing_count = total;
  if (total > UINT32_MAX / 8) return qmat_fail_memory(c->context, "surface vertices");
  return QMAT_OK;
}

/* Where F is zero between two points of opposite sign, by regula falsi with the Illinois weights. */
static void find_zero(const contour *c, const qmat_cell *cell, const double from[3], double f_from, const double to[3],
                      double f_to, double position[3], double normal[3]) {
  double low = 0, high = 1, f_low = f_from, f_high = f_to, tolerance = 1e-6 * c->cells.finest * cell->size;
  int last = 0;
  for (int step = 0; step < CROSSING_STEPS; step++) {
    double t = low + (high - low) * (f_low / (f_low - f_high));
    if (!(t > low && t < high)) t = 0.5 * (low + high);
    for (int k = 0; k < 3; k++) position[k] = from[k] + t * (to[k] - from[k]);
    double f = qmat_cell_gradient(&c->cells, cell, position, normal);
    if (fabs(f) <= tolerance) return;
    if ((f < 0) == (f_low < 0)) {
      low = t, f_low = f;
      if (last == -1) f_high *= 0.5;
      last = -1;
    } else {
      high = t, f_high = f;
      if (last == 1) f_low *= 0.5;
      last = 1;
    }
  }
}

static uint32_t face_name(const contour *c, uint32_t a, uint32_t b, unsigned axis) {
  const qmat_cell *first = &c->cells.cells[a], *second = &c->cells.cells[b];
  bool a_below = first->at[axis] < second->at[axis];
  if (first->size < second->size || (first->size == second->size && a_below)) return a * 8 + axis * 2 + a_below;
  return b * 8 + axis * 2 + !a_below;
}

static void fill_crossing(contour *c, size_t cell_id, unsigned e, crossing *x) {
  const qmat_cell *cell = &c->cells.cells[cell_id];
  unsigned lower, upper, axis = e / 4;
  edge_ends(e, &lower, &upper);
  *x = (crossing){.lower = c->cell_corners[8 * cell_id + lower],
                  .upper = c->cell_corners[8 * cell_id + upper],
                  .axis = (uint8_t)axis,
                  .between = {QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID},
                  .vertices = {QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID, QMAT_NO_ID}};
  x->inside_below = inside(c, x->lower);
  uint32_t at[3], to[3], quarters[4];
  edge_place(cell, e, at);
  quarters_around(c, at, axis, cell->size, quarters);
  for (unsigned q = 0; q < 4; q++) {
    uint32_t a = quarters[q], b = quarters[(q + 1) % 4];
    if (a == b) continue;
    /* Quarters 0 and 1, and 2 and 3, differ along the next axis; the others along the one after. */
    x->cells[x->count] = a;
    x->faces[x->count++] = face_name(c, a, b, (axis + 1 + (q & 1)) % 3);
  }
  double from_point[3], to_point[3];
  memcpy(to, at, sizeof to);
  to[axis] += cell->size;
  place_point(c, at, from_point);
  place_point(c, to, to_point);
  find_zero(c, cell, from_point, c->values[x->lower], to_point, c->values[x->upper], x->position, x->normal);
}

static qmat_status find_crossings(contour *c) {
  qmat_status status = assign_crossings(c);
  if (status != QMAT_OK) return status;
  c->crossings = qmat_alloc(c->crossing_count, sizeof *c->crossings);
  c->crossing_at = qmat_alloc(3 * c->corner_count, sizeof *c->crossing_at);
  if (!c->crossings || !c->crossing_at) return qmat_fail_memory(c->context, "surface vertices");
  memset(c->crossing_at, 0xff, 3 * c->corner_count * sizeof *c->crossing_at);
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 128)
  for (size_t i = 0; i < c->cells.count; i++) {
    size_t next = c->first_crossing[i];
    for (unsigned e = 0; e < 12; e++) {
      if (!(c->owned_edges[i] >> e & 1)) continue;
      crossing *x = &c->crossings[next];
      fill_crossing(c, i, e, x);
      c->crossing_at[3 * (size_t)x->lower + x->axis] = (uint32_t)next++;
    }
  }
  return QMAT_OK;
}

/* The corners around a face in order, with the axis and direction of the step to the next one. */
typedef struct face_walk {
  int count;
  uint32_t corners[LONGEST_FACE];
  uint8_t axes[LONGEST_FACE];
  bool up[LONGEST_FACE];
} face_walk;

/* Appends the corners from `from` to `to` without `to`. */
static void walk_side(const contour *c, face_walk *walk, const uint32_t from[3], const uint32_t to[3], unsigned axis) {
  bool up = from[axis] < to[axis];
  uint32_t length = up ? to[axis] - from[axis] : from[axis] - to[axis];
  if (length > 1) {
    uint32_t middle[3] = {from[0], from[1], from[2]};
    middle[axis] = up ? from[axis] + length / 2 : from[axis] - length / 2;
    if (table_find(&c->corner_table, corner_key(middle)) != QMAT_NO_ID) {
      walk_side(c, walk, from, middle, axis);
      walk_side(c, walk, middle, to, axis);
      return;
    }
  }
  walk->corners[walk->count] = table_find(&c->corner_table, corner_key(from));
  walk->axes[walk->count] = (uint8_t)axis;
  walk->up[walk->count++] = up;
}

static void walk_face(const contour *c, uint32_t face, face_walk *walk) {
  uint32_t id = face / 8;
  const qmat_cell *cell = &c->cells.cells[id];
  unsigned axis = face % 8 / 2, high = face & 1, b = (axis + 1) % 3, d = (axis + 2) % 3;
  static const unsigned corners[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  walk->count = 0;
  for (int s = 0; s < 4; s++) {
    unsigned from = high << axis | corners[s][0] << b | corners[s][1] << d;
    unsigned to = high << axis | corners[s + 1][0] << b | corners[s + 1][1] << d;
    unsigned along = s & 1 ? d : b, lower = from & to;
    unsigned e = along * 4 + (lower >> ((along + 1) % 3) & 1) + 2 * (lower >> ((along + 2) % 3) & 1);
    if (c->split_edges[id] >> e & 1) {
      uint32_t start[3], end[3];
      for (unsigned j = 0; j < 3; j++) {
        start[j] = cell->at[j] + (from >> j & 1) * cell->size;
        end[j] = cell->at[j] + (to >> j & 1) * cell->size;
      }
      walk_side(c, walk, start, end, along);
    } else {
      walk->corners[walk->count] = c->cell_corners[8 * (size_t)id + from];
      walk->axes[walk->count] = (uint8_t)along;
      walk->up[walk->count++] = from < to;
    }
  }
}

/* The surface's trace on a face cuts off each run of inside corners from the rest: follows the run from the crossing to
 * where it ends, and finds the crossing there. Both cells at the face see the same trace. */
static bool find_partner(contour *c, size_t id, int slot) {
  crossing *x = &c->crossings[id];
  face_walk walk;
  walk_face(c, x->faces[slot], &walk);
  int start = -1, changes = 0;
  for (int i = 0; i < walk.count; i++) {
    int next = i + 1 < walk.count ? i + 1 : 0;
    changes += inside(c, walk.corners[i]) != inside(c, walk.corners[next]);
    uint32_t lower = walk.corners[walk.up[i] ? i : next];
    if (lower == x->lower && walk.axes[i] == x->axis) start = i;
  }
  if (start < 0) return false;
  x->shared[slot] = changes > 2;
  /* Step i goes from corner i to the next; walk away from the outside end. */
  int i = start, step = inside(c, walk.corners[start]) ? walk.count - 1 : 1, other = -1;
  for (int moves = 0; moves < walk.count; moves++) {
    i = (i + step) % walk.count;
    int next = (i + 1) % walk.count;
    if (inside(c, walk.corners[i]) != inside(c, walk.corners[next])) {
      other = i;
      break;
    }
  }
  if (other < 0 || other == start) return false;
  uint32_t lower = walk.corners[walk.up[other] ? other : (other + 1) % walk.count];
  uint32_t partner = c->crossing_at[3 * (size_t)lower + walk.axes[other]];
  if (partner == QMAT_NO_ID) return false;
  const crossing *y = &c->crossings[partner];
  for (int j = 0; j < y->count; j++) {
    if (y->faces[j] != x->faces[slot]) continue;
    x->partners[slot] = partner * 4 + (uint32_t)j;
    return true;
  }
  return false;
}

static qmat_status find_partners(contour *c) {
  bool broken = false;
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 256) reduction(|| : broken)
  for (size_t i = 0; i < c->crossing_count; i++) {
    for (int j = 0; j < c->crossings[i].count; j++) broken = !find_partner(c, i, j) || broken;
  }
  if (broken) return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "A trace of the envelope's surface has no end");
  return QMAT_OK;
}

/* Each closed chain of traces on the faces of one cell bounds a sheet. */
static qmat_status find_sheets(contour *c) {
  size_t slots = 0, cell_capacity = 0, first_capacity = 0, filled = 0;
  for (size_t i = 0; i < c->crossing_count; i++) slots += c->crossings[i].count;
  c->items = qmat_alloc(slots, sizeof *c->items);
  if (!c->items) return qmat_fail_memory(c->context, "surface vertices");
  for (size_t i = 0; i < c->crossing_count; i++) {
    for (int j = 0; j < c->crossings[i].count; j++) {
      if (c->crossings[i].vertices[j] != QMAT_NO_ID) continue;
      uint32_t cell = c->crossings[i].cells[j];
      if (qmat_grow((void **)&c->sheet_cells, &cell_capacity, c->sheet_count + 1, sizeof *c->sheet_cells) ||
          qmat_grow((void **)&c->sheet_items, &first_capacity, c->sheet_count + 2, sizeof *c->sheet_items)) {
        return qmat_fail_memory(c->context, "surface vertices");
      }
      c->sheet_cells[c->sheet_count] = cell;
      c->sheet_items[c->sheet_count] = filled;
      crossing *x = &c->crossings[i];
      int slot = j, leave = j; /* cell j lies between faces j - 1 and j */
      while (x->vertices[slot] == QMAT_NO_ID) {
        if (filled == slots) return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "A sheet of the surface does not close");
        x->vertices[slot] = (uint32_t)c->sheet_count;
        c->items[filled++] = (uint32_t)(x - c->crossings);
        uint32_t partner = x->partners[leave];
        x = &c->crossings[partner / 4];
        int face = (int)(partner % 4);
        if (x->cells[face] == cell) {
          slot = face;
          leave = face == 0 ? x->count - 1 : face - 1;
        } else {
          slot = leave = face + 1 == x->count ? 0 : face + 1;
          if (x->cells[slot] != cell) {
            return qmat_fail(c->context, QMAT_ERROR_INTERNAL, "A sheet of the surface leaves its cell");
          }
        }
      }
      c->sheet_items[++c->sheet_count] = filled;
    }
  }
  c->vertex_count = c->sheet_count;
  return QMAT_OK;
}

/* Eigenvalues and orthonormal eigenvectors (columns of v) of a symmetric matrix, by Jacobi rotations. */
static void symmetric_eigen(double m[3][3], double v[3][3]) {
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) v[i][j] = i == j;
  }
  for (int sweep = 0; sweep < 12; sweep++) {
    double off = fabs(m[0][1]) + fabs(m[0][2]) + fabs(m[1][2]);
    if (off <= 1e-15 * (fabs(m[0][0]) + fabs(m[1][1]) + fabs(m[2][2]))) break;
    for (int p = 0; p < 2; p++) {
      for (int q = p + 1; q < 3; q++) {
        if (m[p][q] == 0) continue;
        double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), cs = 1 / sqrt(t * t + 1),
               sn = t * cs;
        for (int k = 0; k < 3; k++) {
          double a = m[k][p], b = m[k][q];
          m[k][p] = cs * a - sn * b;
          m[k][q] = sn * a + cs * b;
        }
        for (int k = 0; k < 3; k++) {
          double a = m[p][k], b = m[q][k];
          m[p][k] = cs * a - sn * b;
          m[q][k] = sn * a + cs * b;
          a = v[k][p], b = v[k][q];
          v[k][p] = cs * a - sn * b;
          v[k][q] = sn * a + cs * b;
        }
      }
    }
  }
}

/* The part of a cell that its vertices may use. */
static void inner_box(const contour *c, const qmat_cell *cell, double low[3], double high[3]) {
  for (int k = 0; k < 3; k++) {
    low[k] = c->cells.origin[k] + c->cells.finest * (cell->at[k] + INSET * cell->size);
    high[k] = c->cells.origin[k] + c->cells.finest * (cell->at[k] + (1 - INSET) * cell->size);
  }
}

static bool into_box(const double low[3], const double high[3], double point[3]) {
  bool moved = false;
  for (int k = 0; k < 3; k++) {
    double x = fmin(fmax(point[k], low[k]), high[k]);
    moved = moved || x != point[k];
    point[k] = x;
  }
  return moved;
}

/* The point of the sheet's cell that is nearest to the tangent planes at its crossings; then down the gradient onto the
 * surface. */
static void place_sheet(contour *c, size_t sheet) {
  const qmat_cell *cell = &c->cells.cells[c->sheet_cells[sheet]];
  size_t first = c->sheet_items[sheet], end = c->sheet_items[sheet + 1];
  double mean[3] = {0}, m[3][3] = {{0}}, diagonal[3][3], v[3][3], b[3] = {0}, *point = c->positions + 3 * sheet;
  double low[3], high[3];
  inner_box(c, cell, low, high);
  for (size_t i = first; i < end; i++) {
    for (int k = 0; k < 3; k++) mean[k] += c->crossings[c->items[i]].position[k];
  }
  for (int k = 0; k < 3; k++) mean[k] /= (double)(end - first);
  for (size_t i = first; i < end; i++) {
    const crossing *x = &c->crossings[c->items[i]];
    double offset = 0;
    for (int k = 0; k < 3; k++) offset += x->normal[k] * (x->position[k] - mean[k]);
    for (int k = 0; k < 3; k++) {
      b[k] += offset * x->normal[k];
      for (int l = 0; l < 3; l++) m[k][l] += x->normal[k] * x->normal[l];
    }
  }
  memcpy(diagonal, m, sizeof m);
  symmetric_eigen(diagonal, v);
  double largest = fmax(diagonal[0][0], fmax(diagonal[1][1], diagonal[2][2]));
  memcpy(point, mean, sizeof mean);
  for (int e = 0; e < 3; e++) {
    if (!(diagonal[e][e] > FLAT_EIGENVALUE * largest)) continue;
    double along = (v[0][e] * b[0] + v[1][e] * b[1] + v[2][e] * b[2]) / diagonal[e][e];
    for (int k = 0; k < 3; k++) point[k] += along * v[k][e];
  }
  if (into_box(low, high, point)) {
    /* The same least squares within the box, by projected Gauss-Seidel; flat directions are held by a weak pull to the
     * mean. */
    double pull = 0.5 * FLAT_EIGENVALUE * largest;
    for (int step = 0; step < BOX_STEPS; step++) {
      for (int k = 0; k < 3; k++) {
        double rest = b[k];
        for (int l = 0; l < 3; l++) rest -= l == k ? 0 : m[k][l] * (point[l] - mean[l]);
        point[k] = fmin(fmax(mean[k] + rest / (m[k][k] + pull), low[k]), high[k]);
      }
    }
  }
  double tolerance = 1e-6 * c->cells.finest * cell->size;
  for (int step = 0; step < PROJECTION_STEPS; step++) {
    double gradient[3], f = qmat_cell_gradient(&c->cells, cell, point, gradient);
    if (fabs(f) <= tolerance) break;
    for (int k = 0; k < 3; k++) point[k] -= f * gradient[k];
    into_box(low, high, point);
  }
}

typedef struct trace {
  uint32_t low, high; /* sheets at its two sides */
  uint32_t slot;      /* crossing * 4 + face */
} trace;

static int by_sheets(const void *left, const void *right) {
  const trace *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  if (a->high != b->high) return a->high < b->high ? -1 : 1;
  return (a->slot > b->slot) - (a->slot < b->slot);
}

/* Two sheets that meet along more than one trace would share more than one edge. All but the first get a vertex of
 * their own. That happens only on faces that hold several traces. */
static qmat_status part_doubled_edges(contour *c) {
  trace *traces = NULL;
  size_t count = 0, capacity = 0, extra = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < c->crossing_count; i++) {
    const crossing *x = &c->crossings[i];
    for (uint32_t j = 0; j < x->count; j++) {
      uint32_t slot = (uint32_t)i * 4 + j;
      if (!x->shared[j] || x->partners[j] < slot) continue;
      if (qmat_grow((void **)&traces, &capacity, count + 1, sizeof *traces)) {
        status = qmat_fail_memory(c->context, "surface vertices");
        goto done;
      }
      uint32_t a = x->vertices[j], b = x->vertices[j + 1 == x->count ? 0 : j + 1];
      traces[count++] = (trace){.low = a < b ? a : b, .high = a < b ? b : a, .slot = slot};
    }
  }
  if (count == 0) goto done;
  qsort(traces, count, sizeof *traces, by_sheets);
  for (size_t i = 1; i < count; i++)
    extra += traces[i].low == traces[i - 1].low && traces[i].high == traces[i - 1].high;
  if (extra == 0) goto done;
  if (qmat_grow((void **)&c->positions, &c->vertex_capacity, 3 * (c->vertex_count + extra), sizeof *c->positions)) {
    status = qmat_fail_memory(c->context, "surface vertices");
    goto done;
  }
  for (size_t i = 1; i < count; i++) {
    if (traces[i].low != traces[i - 1].low || traces[i].high != traces[i - 1].high) continue;
    crossing *x = &c->crossings[traces[i].slot / 4];
    uint32_t partner = x->partners[traces[i].slot % 4];
    crossing *y = &c->crossings[partner / 4];
    for (int k = 0; k < 3; k++) c->positions[3 * c->vertex_count + (size_t)k] = 0.5 * (x->position[k] + y->position[k]);
    x->between[traces[i].slot % 4] = y->between[partner % 4] = (uint32_t)c->vertex_count++;
  }
done:
  qmat_free(traces);
  return status;
}

static qmat_status place_sheets(contour *c) {
  if (qmat_grow((void **)&c->positions, &c->vertex_capacity, 3 * c->sheet_count, sizeof *c->positions)) {
    return qmat_fail_memory(c->context, "surface vertices");
  }
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 128)
  for (size_t i = 0; i < c->sheet_count; i++) place_sheet(c, i);
  return QMAT_OK;
}

/* Area against the square of the longest side; an equilateral triangle has 0.433. */
static double triangle_shape(const double *a, const double *b, const double *d) {
  double u[3], v[3], longest = 0, w2 = 0, u2 = 0, v2 = 0;
  for (int k = 0; k < 3; k++) {
    u[k] = b[k] - a[k];
    v[k] = d[k] - a[k];
    u2 += u[k] * u[k];
    v2 += v[k] * v[k];
    w2 += (v[k] - u[k]) * (v[k] - u[k]);
  }
  longest = fmax(u2, fmax(v2, w2));
  double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  return longest > 0 ? 0.5 * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / longest : 0;
}

enum cut { CUT_NONE, CUT_FIRST, CUT_SECOND, CUT_FAN };

static unsigned polygon_of(const crossing *x, uint32_t polygon[8]) {
  unsigned n = 0;
  for (unsigned j = 0; j < x->count; j++) {
    polygon[n++] = x->vertices[j];
    if (x->between[j] != QMAT_NO_ID) polygon[n++] = x->between[j];
  }
  return n;
}

/* How to cut the polygon of a crossing: a triangle as it is; a quadrangle along the diagonal that keeps closer to the
 * surface; others, and those that would give a degenerate triangle, from the crossing itself. */
static enum cut choose_cut(const contour *c, const crossing *x) {
  uint32_t polygon[8];
  unsigned n = polygon_of(x, polygon);
  const double *p[4];
  for (unsigned i = 0; i < n && i < 4; i++) p[i] = c->positions + 3 * (size_t)polygon[i];
  if (n == 3) return triangle_shape(p[0], p[1], p[2]) > DEGENERATE_SHAPE ? CUT_NONE : CUT_FAN;
  if (n > 4 || x->count != 4) return CUT_FAN;
  uint32_t at[3], to[3];
  corner_place(c->corners[x->lower], at);
  corner_place(c->corners[x->upper], to);
  uint32_t length = to[x->axis] - at[x->axis];
  double shapes[2], errors[2];
  for (int d = 0; d < 2; d++) {
    const qmat_cell *a = &c->cells.cells[x->cells[d]], *b = &c->cells.cells[x->cells[d + 2]];
    shapes[d] = fmin(triangle_shape(p[d], p[d + 1], p[d + 2]), triangle_shape(p[d], p[d + 2], p[(d + 3) % 4]));
    /* Two cells that are both longer than the edge may face each other across the next edge too: their diagonal could
     * come twice. */
    if (a->size != length && b->size != length) shapes[d] = -1;
    double middle[3];
    for (int k = 0; k < 3; k++) middle[k] = 0.5 * (p[d][k] + p[d + 2][k]);
    const qmat_cell *smaller = a->size <= b->size ? a : b;
    errors[d] = fabs(qmat_cell_distance(&c->cells, smaller, middle));
  }
  double better = fmax(shapes[0], shapes[1]), worse = fmin(shapes[0], shapes[1]);
  if (!(better > DEGENERATE_SHAPE)) return CUT_FAN;
  if (worse < POOR_SHAPE) return shapes[0] >= shapes[1] ? CUT_FIRST : CUT_SECOND;
  /* Where both are as good, the rounder triangles. */
  double margin = 0.01 * c->cells.finest * length;
  if (fabs(errors[0] - errors[1]) > margin) return errors[0] < errors[1] ? CUT_FIRST : CUT_SECOND;
  return shapes[0] >= shapes[1] ? CUT_FIRST : CUT_SECOND;
}

static qmat_status make_triangles(contour *c, qmat_skin_triangles *surface) {
  uint8_t *cuts = qmat_alloc(c->crossing_count, sizeof *cuts);
  size_t *first = qmat_alloc(c->crossing_count + 1, sizeof *first);
  qmat_status status = QMAT_OK;
  if (!cuts || !first) {
    status = qmat_fail_memory(c->context, "surface triangles");
    goto done;
  }
#pragma omp parallel for num_threads(c->threads) schedule(dynamic, 256)
  for (size_t i = 0; i < c->crossing_count; i++) cuts[i] = (uint8_t)choose_cut(c, &c->crossings[i]);
  size_t triangles = 0, fans = 0;
  for (size_t i = 0; i < c->crossing_count; i++) {
    uint32_t polygon[8];
    unsigned n = polygon_of(&c->crossings[i], polygon);
    first[i] = triangles;
    triangles += cuts[i] == CUT_FAN ? n : n - 2;
    fans += cuts[i] == CUT_FAN;
  }
  if (c->vertex_count + fans >= QMAT_NO_ID ||
      qmat_grow((void **)&c->positions, &c->vertex_capacity, 3 * (c->vertex_count + fans), sizeof *c->positions)) {
    status = qmat_fail_memory(c->context, "surface vertices");
    goto done;
  }
  surface->triangles = qmat_alloc(3 * triangles, sizeof *surface->triangles);
  if (!surface->triangles) {
    status = qmat_fail_memory(c->context, "surface triangles");
    goto done;
  }
  for (size_t i = 0; i < c->crossing_count; i++) {
    const crossing *x = &c->crossings[i];
    uint32_t polygon[8], *out = surface->triangles + 3 * first[i];
    unsigned n = polygon_of(x, polygon);
    /* The polygon turns about the edge's axis: outward where the inside lies below. */
    if (!x->inside_below) {
      for (unsigned j = 0; j < n / 2; j++) {
        uint32_t swap = polygon[j];
        polygon[j] = polygon[n - 1 - j];
        polygon[n - 1 - j] = swap;
      }
    }
    if (cuts[i] == CUT_FAN) {
      uint32_t centre = (uint32_t)c->vertex_count++;
      memcpy(c->positions + 3 * (size_t)centre, x->position, sizeof x->position);
      for (unsigned j = 0; j < n; j++) {
        *out++ = centre;
        *out++ = polygon[j];
        *out++ = polygon[(j + 1) % n];
      }
      continue;
    }
    /* The first diagonal joins polygon corners 0 and 2; turned around, these are 3 and 1. */
    unsigned start = n == 4 && (cuts[i] == CUT_FIRST) != x->inside_below ? 1 : 0;
    for (unsigned j = 1; j + 1 < n; j++) {
      *out++ = polygon[start];
      *out++ = polygon[(start + j) % n];
      *out++ = polygon[(start + j + 1) % n];
    }
  }
  surface->triangle_count = triangles;
  surface->vertex_count = c->vertex_count;
  surface->positions = c->positions;
  c->positions = NULL;
done:
  qmat_free(cuts);
  qmat_free(first);
  return status;
}

qmat_status qmat_envelope_surface(qmat_context *context, const qmat_envelope *envelope, const double *spheres,
                                  size_t sphere_count, double base, int detail, qmat_skin_triangles *surface,
                                  qmat_envelope_grid *grid) {
  *surface = (qmat_skin_triangles){0};
  contour c = {.context = context, .threads = qmat_threads(context)};
  *grid = (qmat_envelope_grid){.base = base, .finest = ldexp(base, -detail)};
  grid->smallest_radius = RADIUS_FLOOR * grid->finest;
  for (size_t i = 0; i < sphere_count; i++) {
    grid->raised_sphere_count += spheres[4 * i + 3] < grid->smallest_radius;
  }
  qmat_status status = qmat_cells_find(context, envelope, spheres, base, detail, grid->smallest_radius, &c.cells);
  if (status == QMAT_OK && c.cells.count == 0) {
    status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh encloses no volume");
  }
  grid->cell_count = c.cells.count;
  grid->refined_cell_count = c.cells.refined_count;
  qmat_status (*const steps[])(contour *) = {number_corners, find_split_edges, evaluate_corners, find_crossings,
                                             find_partners,  find_sheets,      place_sheets,     part_doubled_edges};
  size_t count = sizeof steps / sizeof *steps;
  for (size_t i = 0; status == QMAT_OK && i < count; i++) {
    status = steps[i](&c);
    if (status == QMAT_OK) status = qmat_progress(context, i + 1, count + 1, "contouring steps");
  }
  if (status == QMAT_OK) status = make_triangles(&c, surface);
  contour_uninit(&c);
  return status;
}
