/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/voxel_shape.h"

#include <math.h>

#include "core/geometry/sheets.h"

/* A cube of 2^level voxels along each side. */
typedef struct {
  int32_t at[3]; /* its first voxel */
} octree_cell;

typedef enum { CELL_OUTSIDE, CELL_INSIDE, CELL_MIXED } cell_state;

typedef struct {
  qmat_context *context;
  const qmat_surface *surface;
  qmat_voxel_shape *shape;
  octree_cell *cells, *next; /* of one level, and of the one below */
  size_t count, next_count, capacity, next_capacity;
  uint8_t *states; /* per cell */
  size_t state_capacity;
} octree;

/* The voxels along each side of the box of the solid, and where they start. */
static void set_lattice(const qmat_surface *surface, int depth, qmat_voxel_shape *shape) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, longest = 0;
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    for (size_t k = 0; k < 3; k++) {
      const double x = positions[3 * (size_t)mesh->triangles[i] + k];
      low[k] = fmin(low[k], x);
      high[k] = fmax(high[k], x);
    }
  }
  for (int k = 0; k < 3; k++) longest = fmax(longest, high[k] - low[k]);
  shape->voxel = longest / (0.9 * (double)(1 << depth));
  for (int k = 0; k < 3; k++) {
    shape->size[k] = 1 + (int32_t)((high[k] - low[k]) / shape->voxel);
    shape->origin[k] = 0.5 * (low[k] + high[k] - shape->size[k] * shape->voxel);
  }
}

/* Whether the voxels of a cell are inside, outside, or to be looked at one by one. */
static cell_state look_at(const octree *o, const octree_cell *cell, int32_t side) {
  const double voxel = o->shape->voxel, reach = 0.5 * sqrt(3) * (side - 1) * voxel;
  double centre[3];
  for (int k = 0; k < 3; k++) centre[k] = o->shape->origin[k] + (cell->at[k] + 0.5 * side) * voxel;
  if (side > 1 && qmat_surface_distance(o->surface, centre, 1.001 * reach, NULL, NULL) < INFINITY) return CELL_MIXED;
  return qmat_surface_inside(o->surface, centre) ? CELL_INSIDE : CELL_OUTSIDE;
}

static void fill(qmat_voxel_shape *shape, const octree_cell *cell, int32_t side) {
  for (int32_t z = cell->at[2]; z < cell->at[2] + side && z < shape->size[2]; z++) {
    for (int32_t y = cell->at[1]; y < cell->at[1] + side && y < shape->size[1]; y++) {
      uint64_t *row =
          &shape->bits[((size_t)(z + 1) * (size_t)(shape->size[1] + 2) + (size_t)(y + 1)) * shape->row_words];
      for (int32_t x = cell->at[0]; x < cell->at[0] + side && x < shape->size[0]; x++) {
        row[(size_t)(x + 1) / 64] |= (uint64_t)1 << ((x + 1) % 64);
        shape->count++;
      }
    }
  }
}

/* The children of a cell that reach into the lattice. */
static void split(octree *o, const octree_cell *cell, int32_t side) {
  for (int child = 0; child < 8; child++) {
    octree_cell part;
    bool used = true;
    for (int k = 0; k < 3; k++) {
      part.at[k] = cell->at[k] + (child >> k & 1) * side;
      used = used && part.at[k] < o->shape->size[k];
    }
    if (used) o->next[o->next_count++] = part;
  }
}

/* Fills the uniform cells of one level and lists the parts of the others. */
static qmat_status descend(octree *o, int32_t side) {
  const size_t slice = 512; /* inside tests of an open surface are slow */
  const int threads = qmat_threads(o->context);
  if (qmat_grow((void **)&o->states, &o->state_capacity, o->count, sizeof *o->states))
    return qmat_fail_memory(o->context, "the voxels");
  for (size_t first = 0; first < o->count; first += slice) {
    const qmat_status status = qmat_progress(o->context, first, o->count, "voxels");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < o->count ? first + slice : o->count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 32)
    for (size_t i = first; i < last; i++) o->states[i] = (uint8_t)look_at(o, &o->cells[i], side);
  }
  size_t mixed = 0;
  for (size_t i = 0; i < o->count; i++) mixed += o->states[i] == CELL_MIXED;
  if (qmat_grow((void **)&o->next, &o->next_capacity, 8 * mixed, sizeof *o->next))
    return qmat_fail_memory(o->context, "the voxels");
  o->next_count = 0;
  for (size_t i = 0; i < o->count; i++) {
    if (o->states[i] == CELL_INSIDE) fill(o->shape, &o->cells[i], side);
    if (o->states[i] == CELL_MIXED) split(o, &o->cells[i], side / 2);
  }
  return QMAT_OK;
}

qmat_status qmat_voxel_shape_make(qmat_context *context, const qmat_surface *surface, int depth,
                                  qmat_voxel_shape *shape) {
  *shape = (qmat_voxel_shape){.count = 0};
  set_lattice(surface, depth, shape);
  const size_t rows = (size_t)(shape->size[1] + 2) * (size_t)(shape->size[2] + 2);
  shape->row_words = (size_t)(shape->size[0] + 2) / 64 + 1;
  shape->bits = qmat_arena_calloc(&context->arena, rows * shape->row_words, sizeof *shape->bits);
  octree o = {.context = context, .surface = surface, .shape = shape};
  qmat_status status = QMAT_OK;
  if (!shape->bits || qmat_grow((void **)&o.cells, &o.capacity, 1, sizeof *o.cells)) {
    status = qmat_fail_memory(context, "the voxels");
  } else {
    o.cells[o.count++] = (octree_cell){{0, 0, 0}};
  }
  for (int32_t side = 1 << depth; status == QMAT_OK && side >= 1; side /= 2) {
    status = descend(&o, side);
    const octree level = o;
    o.cells = level.next, o.count = level.next_count, o.capacity = level.next_capacity;
    o.next = level.cells, o.next_count = 0, o.next_capacity = level.capacity;
  }
  qmat_free(o.cells);
  qmat_free(o.next);
  qmat_free(o.states);
  return status;
}

/* The lattice points 64 * word .. 64 * word + 63 of a row at the boundary: the eight voxels around them differ. */
static uint64_t boundary_word(const qmat_voxel_shape *shape, size_t y, size_t z, size_t word) {
  uint64_t all = UINT64_MAX, any = 0;
  for (size_t k = 0; k < 4; k++) {
    const size_t row = (z + k / 2) * (size_t)(shape->size[1] + 2) + y + k % 2;
    const uint64_t *bits = &shape->bits[row * shape->row_words];
    const uint64_t next = word + 1 < shape->row_words ? bits[word + 1] << 63 : 0;
    const uint64_t left = bits[word], right = bits[word] >> 1 | next;
    all &= left & right;
    any |= left | right;
  }
  return any & ~all;
}

qmat_status qmat_voxel_boundary(qmat_context *context, const qmat_voxel_shape *shape, int32_t **points, size_t *count) {
  for (int listing = 0; listing < 2; listing++) {
    *count = 0;
    for (size_t z = 0; z <= (size_t)shape->size[2]; z++) {
      const qmat_status status = qmat_progress(context, z, (size_t)shape->size[2] + 1, "layers");
      if (status != QMAT_OK) return status;
      for (size_t y = 0; y <= (size_t)shape->size[1]; y++) {
        for (size_t word = 0; word < shape->row_words; word++) {
          for (uint64_t left = boundary_word(shape, y, z, word); left; left &= left - 1) {
            const size_t x = 64 * word + (size_t)__builtin_ctzll(left);
            if (listing) {
              int32_t *point = &(*points)[3 * *count];
              point[0] = (int32_t)x, point[1] = (int32_t)y, point[2] = (int32_t)z;
            }
            (*count)++;
          }
        }
      }
    }
    if (!listing && !(*points = qmat_arena_alloc(&context->arena, *count, 3 * sizeof **points)))
      return qmat_fail_memory(context, "the boundary of the voxels");
  }
  return QMAT_OK;
}
