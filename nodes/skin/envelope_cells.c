/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/envelope_cells.h"

#include <math.h>
#include <string.h>

/* The largest cell relative to the medial radius: three cells across a tube ... */
static const double CELLS_PER_RADIUS = 0.75;
/* ... plus this share of the distance to the medial surface, so that sizes change gradually. */
static const double GRADING = 0.5;
/* Distances are exact to about 1e-15 of the unit frame. */
static const double SLACK = 1e-12;
static const double HALF_DIAGONAL = 0.8660254037844387; /* of a cell of size 1 */
/* Limits of memory: cells (about 400 bytes each in contouring), and entries of their lists. */
static const size_t MOST_CELLS = (size_t)1 << 23, MOST_ENTRIES = (size_t)1 << 29;
/* Children per chunk of a thread, and list entries between two calls of the progress function. */
enum { CHUNK_CHILDREN = 64, MOST_CHUNKS = 512 };
static const size_t BLOCK_ENTRIES = (size_t)1 << 19;

void qmat_cells_uninit(qmat_cells *cells) {
  qmat_cell_primitives *p = &cells->primitives;
  qmat_free(p->slabs);
  qmat_free(p->cones);
  qmat_free(p->spheres);
  qmat_free(p->slab_radii);
  qmat_free(p->cone_radii);
  qmat_free(p->slab_centres);
  qmat_free(p->cone_centres);
  qmat_free(cells->cells);
  qmat_free(cells->lists);
  qmat_key_table_uninit(&cells->marked);
  *cells = (qmat_cells){0};
}

static qmat_status prepare_primitives(qmat_context *context, const qmat_envelope *envelope, const double *spheres,
                                      double floor, qmat_cell_primitives *p) {
  size_t count = qmat_envelope_primitive_count(envelope), kinds[4] = {0};
  uint32_t ids[3];
  for (size_t i = 0; i < count; i++) kinds[qmat_envelope_primitive(envelope, i, ids)]++;
  p->slabs = qmat_alloc(kinds[3], sizeof *p->slabs);
  p->slab_radii = qmat_alloc(3 * kinds[3], sizeof *p->slab_radii);
  p->slab_centres = qmat_alloc(9 * kinds[3], sizeof *p->slab_centres);
  p->cones = qmat_alloc(kinds[2], sizeof *p->cones);
  p->cone_radii = qmat_alloc(2 * kinds[2], sizeof *p->cone_radii);
  p->cone_centres = qmat_alloc(6 * kinds[2], sizeof *p->cone_centres);
  p->spheres = qmat_alloc(4 * kinds[1], sizeof *p->spheres);
  if (!p->slabs || !p->slab_radii || !p->slab_centres || !p->cones || !p->cone_radii || !p->cone_centres ||
      !p->spheres) {
    return qmat_fail_memory(context, "medial primitives");
  }
  for (size_t i = 0; i < count; i++) {
    double ends[3][4];
    int n = qmat_envelope_primitive(envelope, i, ids);
    for (int k = 0; k < n; k++) memcpy(ends[k], spheres + 4 * (size_t)ids[k], sizeof ends[k]);
    if (n == 1) {
      if (!(ends[0][3] > 0)) continue;
      memcpy(p->spheres + 4 * p->sphere_count, ends[0], sizeof ends[0]);
      p->spheres[4 * p->sphere_count + 3] = fmax(ends[0][3], floor);
      p->sphere_count++;
      continue;
    }
    double *centres = n == 3 ? p->slab_centres + 9 * p->slab_count : p->cone_centres + 6 * p->cone_count;
    double *radii = n == 3 ? p->slab_radii + 3 * p->slab_count : p->cone_radii + 2 * p->cone_count;
    for (int k = 0; k < n; k++) {
      ends[k][3] = fmax(ends[k][3], floor);
      memcpy(centres + 3 * k, ends[k], 3 * sizeof *centres);
      radii[k] = ends[k][3];
    }
    if (n == 3)
      qmat_slab_prepare(&p->slabs[p->slab_count++], ends[0], ends[1], ends[2]);
    else
      qmat_cone_prepare(&p->cones[p->cone_count++], ends[0], ends[1]);
  }
  return QMAT_OK;
}

static inline double primitive_distance(const qmat_cell_primitives *p, uint32_t i, const double point[3]) {
  if (i < p->slab_count) return qmat_slab_prepared_distance(&p->slabs[i], point);
  size_t j = i - p->slab_count;
  if (j < p->cone_count) return qmat_cone_prepared_distance(&p->cones[j], point);
  return qmat_sphere_distance(p->spheres + 4 * (j - p->cone_count), point);
}

/* The medial sphere that is nearest to the point. */
static void primitive_sphere(const qmat_cell_primitives *p, uint32_t i, const double point[3], double sphere[4]) {
  double weights[3];
  const double *centres, *radii;
  int n;
  if (i < p->slab_count) {
    qmat_slab_foot(&p->slabs[i], point, weights);
    centres = p->slab_centres + 9 * (size_t)i;
    radii = p->slab_radii + 3 * (size_t)i;
    n = 3;
  } else {
    size_t j = i - p->slab_count;
    if (j >= p->cone_count) {
      memcpy(sphere, p->spheres + 4 * (j - p->cone_count), 4 * sizeof *sphere);
      return;
    }
    qmat_cone_foot(&p->cones[j], point, weights);
    centres = p->cone_centres + 6 * j;
    radii = p->cone_radii + 2 * j;
    n = 2;
  }
  for (int k = 0; k < 4; k++) sphere[k] = 0;
  for (int e = 0; e < n; e++) {
    for (int k = 0; k < 3; k++) sphere[k] += weights[e] * centres[3 * e + k];
    sphere[3] += weights[e] * radii[e];
  }
}

double qmat_cell_distance(const qmat_cells *cells, const qmat_cell *cell, const double point[3]) {
  const uint32_t *list = cells->lists + cell->list;
  double best = INFINITY;
  for (uint32_t i = 0; i < cell->list_count; i++) {
    double d = primitive_distance(&cells->primitives, list[i], point);
    best = d < best ? d : best;
  }
  return best;
}

double qmat_cell_gradient(const qmat_cells *cells, const qmat_cell *cell, const double point[3], double gradient[3]) {
  const uint32_t *list = cells->lists + cell->list;
  double best = INFINITY;
  uint32_t nearest = 0;
  for (uint32_t i = 0; i < cell->list_count; i++) {
    double d = primitive_distance(&cells->primitives, list[i], point);
    if (d < best) {
      best = d;
      nearest = list[i];
    }
  }
  double sphere[4], length2 = 0;
  primitive_sphere(&cells->primitives, nearest, point, sphere);
  for (int k = 0; k < 3; k++) {
    gradient[k] = point[k] - sphere[k];
    length2 += gradient[k] * gradient[k];
  }
  double length = sqrt(length2);
  if (length > 0) {
    for (int k = 0; k < 3; k++) gradient[k] /= length;
  } else {
    gradient[0] = 1, gradient[1] = gradient[2] = 0;
  }
  return best;
}

/* A primitive at the centre of a cell: its distance there, and the gradient. */
typedef struct candidate {
  double distance, gradient[3], centre_distance; /* the last: to the nearest medial point */
  double radius;                                 /* there */
  uint32_t primitive;
} candidate;

/* Cells with their lists, while they are being made. */
typedef struct cell_batch {
  qmat_cell *cells;
  uint8_t *whole; /* per cell: finished, not to be halved */
  uint32_t *lists;
  struct candidate *scratch;
  size_t count, cell_capacity, whole_capacity, list_count, list_capacity, scratch_capacity;
} cell_batch;

static void batch_uninit(cell_batch *batch) {
  qmat_free(batch->cells);
  qmat_free(batch->whole);
  qmat_free(batch->lists);
  qmat_free(batch->scratch);
  *batch = (cell_batch){0};
}

static int batch_reserve(cell_batch *batch, size_t cells, size_t entries) {
  return qmat_grow((void **)&batch->cells, &batch->cell_capacity, batch->count + cells, sizeof *batch->cells) ||
         qmat_grow((void **)&batch->whole, &batch->whole_capacity, batch->count + cells, sizeof *batch->whole) ||
         qmat_grow((void **)&batch->lists, &batch->list_capacity, batch->list_count + entries, sizeof *batch->lists);
}

/* Whether the cell is small enough for every primitive that may reach into it. */
static bool fine_enough(const candidate *list, size_t count, double size) {
  for (size_t i = 0; i < count; i++) {
    double away = list[i].distance - HALF_DIAGONAL * size;
    if (CELLS_PER_RADIUS * list[i].radius + GRADING * (away > 0 ? away : 0) < size) return false;
  }
  return true;
}

/* Drops candidates that are above another one in all of the cell, whose points are within `reach` of the centre. Every
 * f is convex and so stays above its tangent: f_i(c + v) >= f_i(c) + g_i . v. It also stays below the distance to the
 * medial point x nearest to the centre: f_j(c + v) <= f_j(c) + g_j . v + |v|^2 / (2 |c - x|). */
static size_t drop_hidden(candidate *list, size_t count, double reach) {
  enum { ROUNDS = 8 };
  for (size_t round = 0; round < ROUNDS && round + 1 < count; round++) {
    size_t nearest = round;
    for (size_t i = round + 1; i < count; i++) {
      if (list[i].distance < list[nearest].distance) nearest = i;
    }
    candidate best = list[nearest];
    list[nearest] = list[round];
    list[round] = best;
    double bend = 0.5 * reach * reach / best.centre_distance + SLACK;
    size_t kept = round + 1;
    for (size_t i = round + 1; i < count; i++) {
      double above = list[i].distance - best.distance - bend, turn2 = 0;
      for (int k = 0; k < 3; k++) {
        double d = list[i].gradient[k] - best.gradient[k];
        turn2 += d * d;
      }
      if (above > 0 && above * above > turn2 * reach * reach) continue;
      list[kept++] = list[i];
    }
    count = kept;
  }
  return count;
}

static bool is_marked(const qmat_cells *cells, const uint32_t at[3], uint32_t size) {
  return cells->marked.slots && qmat_key_table_id(&cells->marked, qmat_cell_key(at, size)) != QMAT_NO_ID;
}

/* Marks the cells of each size that are to be halved: those that contain the point of a mark, and their neighbours. */
static qmat_status mark(qmat_context *context, qmat_cells *cells, uint32_t extent, const qmat_cell_mark *marks,
                        size_t count) {
  if (count == 0) return QMAT_OK;
  if (qmat_key_table_init(&cells->marked, 64)) return qmat_fail_memory(context, "surface cells");
  for (size_t i = 0; i < count; i++) {
    if (i % 4096 == 0) {
      const qmat_status status = qmat_progress(context, i, count, "places far from the skin");
      if (status != QMAT_OK) return status;
    }
    for (int level = 0; level < marks[i].level && cells->base >> level > 1; level++) {
      const uint32_t size = cells->base >> level;
      for (int n = 0; n < 27; n++) {
        const int steps[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        uint32_t at[3];
        bool is_in = true;
        for (int k = 0; k < 3; k++) {
          const double place = floor((marks[i].point[k] - cells->origin[k]) / (cells->finest * size)) + steps[k];
          is_in = is_in && place >= 0 && place < extent / size;
          at[k] = is_in ? (uint32_t)place * size : 0;
        }
        const uint64_t key = qmat_cell_key(at, size);
        if (!is_in || qmat_key_table_id(&cells->marked, key) != QMAT_NO_ID) continue;
        qmat_key_slot *slot = qmat_key_table_add(&cells->marked, key);
        if (!slot) return qmat_fail_memory(context, "surface cells");
        slot->id = 1;
      }
    }
  }
  return QMAT_OK;
}

/* Adds a cell to the batch unless the surface misses it. `list` contains the primitive that attains F wherever F is
 * negative in the cell. */
static int add_cell(const qmat_cells *cells, cell_batch *batch, const uint32_t at[3], uint32_t size,
                    const uint32_t *list, size_t list_count) {
  if (qmat_grow((void **)&batch->scratch, &batch->scratch_capacity, list_count, sizeof *batch->scratch)) return -1;
  double centre[3], length = cells->finest * size, reach = HALF_DIAGONAL * length + SLACK, nearest = INFINITY;
  for (int k = 0; k < 3; k++) centre[k] = cells->origin[k] + cells->finest * (at[k] + 0.5 * size);
  candidate *found = batch->scratch;
  for (size_t i = 0; i < list_count; i++) {
    double d = primitive_distance(&cells->primitives, list[i], centre);
    found[i].distance = d;
    found[i].primitive = list[i];
    nearest = d < nearest ? d : nearest;
  }
  /* F is 1-Lipschitz. */
  if (!(fabs(nearest) <= reach)) return 0;
  size_t count = 0;
  for (size_t i = 0; i < list_count; i++) {
    candidate c = found[i];
    /* Nowhere the minimum in this cell, or nowhere negative: without influence on the surface. */
    if (c.distance > nearest + 2 * reach || c.distance > reach) continue;
    double sphere[4], length2 = 0;
    primitive_sphere(&cells->primitives, c.primitive, centre, sphere);
    for (int k = 0; k < 3; k++) {
      c.gradient[k] = centre[k] - sphere[k];
      length2 += c.gradient[k] * c.gradient[k];
    }
    c.radius = sphere[3];
    c.centre_distance = sqrt(length2);
    for (int k = 0; k < 3 && length2 > 0; k++) c.gradient[k] /= c.centre_distance;
    found[count++] = c;
  }
  count = drop_hidden(found, count, reach);
  if (batch_reserve(batch, 1, count)) return -1;
  for (size_t i = 0; i < count; i++) batch->lists[batch->list_count + i] = found[i].primitive;
  batch->cells[batch->count] =
      (qmat_cell){.at = {at[0], at[1], at[2]}, .size = size, .list = batch->list_count, .list_count = (uint32_t)count};
  batch->whole[batch->count++] =
      size == 1 || (size <= cells->base && !is_marked(cells, at, size) && fine_enough(found, count, length));
  batch->list_count += count;
  return 0;
}

static int add_children(const qmat_cells *cells, const cell_batch *parents, size_t first, size_t end,
                        cell_batch *children) {
  for (size_t i = first; i < end; i++) {
    const qmat_cell *parent = &parents->cells[i / 8];
    uint32_t size = parent->size / 2, at[3];
    for (unsigned k = 0; k < 3; k++) at[k] = parent->at[k] + ((uint32_t)i >> k & 1) * size;
    if (add_cell(cells, children, at, size, parents->lists + parent->list, parent->list_count)) return -1;
  }
  return 0;
}

static qmat_status too_many(qmat_context *context) {
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "the surface crosses too many cells for the memory limit");
  qmat_fail_hint(context, "lower resolution or detail");
  return qmat_fail_field(context, "resolution");
}

/* Moves the finished cells of `from` to the result and the others to `next`. */
static qmat_status sort_out(qmat_context *context, qmat_cells *cells, size_t *cell_capacity, size_t *list_capacity,
                            const cell_batch *from, cell_batch *next) {
  /* Each cell that will be halved becomes at least two. */
  const size_t least = cells->count + 2 * (next->count + from->count);
  cells->is_incomplete = cells->is_incomplete || least > cells->most;
  if (cells->is_incomplete) return QMAT_OK;
  if (least > MOST_CELLS || cells->list_count + next->list_count + from->list_count > MOST_ENTRIES) {
    return too_many(context);
  }
  if (batch_reserve(next, from->count, from->list_count) ||
      qmat_grow((void **)&cells->cells, cell_capacity, cells->count + from->count, sizeof *cells->cells) ||
      qmat_grow((void **)&cells->lists, list_capacity, cells->list_count + from->list_count, sizeof *cells->lists)) {
    return qmat_fail_memory(context, "surface cells");
  }
  for (size_t i = 0; i < from->count; i++) {
    qmat_cell cell = from->cells[i];
    const uint32_t *list = from->lists + cell.list;
    if (from->whole[i]) {
      cell.list = cells->list_count;
      memcpy(cells->lists + cell.list, list, cell.list_count * sizeof *list);
      cells->list_count += cell.list_count;
      cells->refined_count += cell.size < cells->base;
      cells->cells[cells->count++] = cell;
    } else {
      cell.list = next->list_count;
      memcpy(next->lists + cell.list, list, cell.list_count * sizeof *list);
      next->list_count += cell.list_count;
      next->cells[next->count++] = cell;
    }
  }
  return QMAT_OK;
}

/* Halves every cell of `parents`: finished children go to the result, the others to `next`. */
static qmat_status halve(qmat_context *context, qmat_cells *cells, size_t *cell_capacity, size_t *list_capacity,
                         const cell_batch *parents, cell_batch *chunks, cell_batch *next) {
  int threads = qmat_threads(context);
  for (size_t first = 0; first < parents->count && !cells->is_incomplete;) {
    size_t end = first, entries = 0;
    /* Chunks are filled in parallel and emptied in order, so that the result does not depend on their number. */
    while (end < parents->count && entries < BLOCK_ENTRIES && end - first < MOST_CHUNKS * CHUNK_CHILDREN / 8)
      entries += parents->cells[end++].list_count;
    size_t children = 8 * (end - first), per_chunk = children / 64 + 1;
    per_chunk = per_chunk < CHUNK_CHILDREN ? per_chunk : CHUNK_CHILDREN;
    size_t chunk_count = (children + per_chunk - 1) / per_chunk;
    bool failed = false;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) reduction(|| : failed)
    for (size_t c = 0; c < chunk_count; c++) {
      chunks[c].count = chunks[c].list_count = 0;
      size_t low = 8 * first + c * per_chunk, high = low + per_chunk;
      if (high > 8 * end) high = 8 * end;
      failed = failed || add_children(cells, parents, low, high, &chunks[c]) != 0;
    }
    if (failed) return qmat_fail_memory(context, "surface cells");
    for (size_t c = 0; c < chunk_count; c++) {
      qmat_status status = sort_out(context, cells, cell_capacity, list_capacity, &chunks[c], next);
      if (status != QMAT_OK) return status;
    }
    first = end;
    qmat_status status = qmat_progress(context, cells->count, 0, "surface cells");
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

qmat_status qmat_cells_find(qmat_context *context, const qmat_envelope *envelope, const qmat_cell_request *request,
                            double floor, qmat_cells *cells) {
  const double base = request->base;
  *cells = (qmat_cells){
      .finest = ldexp(base, -request->detail), .base = (uint32_t)1 << request->detail, .most = request->most};
  qmat_status status = prepare_primitives(context, envelope, request->spheres, floor, &cells->primitives);
  if (status != QMAT_OK) return status;
  const qmat_cell_primitives *p = &cells->primitives;
  size_t count = p->slab_count + p->cone_count + p->sphere_count;

  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * p->slab_count + 2 * p->cone_count + p->sphere_count; i++) {
    size_t j = i, s = 3 * p->slab_count, c = 2 * p->cone_count;
    const double *centre;
    double radius;
    if (j < s)
      centre = p->slab_centres + 3 * j, radius = p->slab_radii[j];
    else if ((j -= s) < c)
      centre = p->cone_centres + 3 * j, radius = p->cone_radii[j];
    else
      centre = p->spheres + 4 * (j - c), radius = centre[3];
    for (int k = 0; k < 3; k++) {
      low[k] = fmin(low[k], centre[k] - radius);
      high[k] = fmax(high[k], centre[k] + radius);
    }
  }
  cell_batch level = {0}, next = {0}, *chunks = NULL;
  size_t cell_capacity = 0, list_capacity = 0;
  if (count == 0) return QMAT_OK;
  /* The root is a cube with a spare base cell on each side. The odd shift keeps flat regions of a model off the planes
   * of the grid. */
  double extent = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
  uint32_t size = cells->base;
  while (size * cells->finest < extent + 3 * base && size < (uint32_t)1 << 18) size *= 2;
  static const double shift[3] = {0.137, 0.271, 0.389};
  for (int k = 0; k < 3; k++) cells->origin[k] = 0.5 * (low[k] + high[k]) - (0.5 * size + shift[k]) * cells->finest;
  if (size * cells->finest < extent + 3 * base) return too_many(context);

  status = mark(context, cells, size, request->marks, request->mark_count);
  if (status != QMAT_OK) return status;
  uint32_t *all = qmat_alloc(count, sizeof *all);
  chunks = qmat_calloc(MOST_CHUNKS, sizeof *chunks);
  if (!all || !chunks) {
    status = qmat_fail_memory(context, "surface cells");
    goto done;
  }
  for (size_t i = 0; i < count; i++) all[i] = (uint32_t)i;
  if (add_cell(cells, &chunks[0], (uint32_t[3]){0, 0, 0}, size, all, count)) {
    status = qmat_fail_memory(context, "surface cells");
    goto done;
  }
  status = sort_out(context, cells, &cell_capacity, &list_capacity, &chunks[0], &level);
  while (status == QMAT_OK && level.count > 0 && !cells->is_incomplete) {
    next.count = next.list_count = 0;
    status = halve(context, cells, &cell_capacity, &list_capacity, &level, chunks, &next);
    cell_batch swap = level;
    level = next;
    next = swap;
  }
done:
  for (size_t c = 0; chunks && c < MOST_CHUNKS; c++) batch_uninit(&chunks[c]);
  qmat_free(chunks);
  qmat_free(all);
  batch_uninit(&level);
  batch_uninit(&next);
  return status;
}
