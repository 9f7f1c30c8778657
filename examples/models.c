/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "examples/models.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/hash.h"

#define PI 3.14159265358979323846

const qmat_model_kind qmat_model_kinds[] = {
    {"box", "3 x 2 x 1, a plain grid of vertices", 24},
    {"capsule", "a cylinder of length 3 with round ends of radius 1", 40},
    {"curved-sheet", "a sheet of 1 % thickness, bent by 120 degrees", 48},
    {"l-bracket", "two thick plates at a right angle", 24},
    {"octopus", "a head with eight tentacles that taper to 0.4 % of the diagonal", 32},
    {"sheet", "a flat sheet of 1 % thickness", 40},
    {"sphere", "radius 1", 40},
    {"tapered-capsule", "two balls of radii 1 and 0.3, and their convex hull", 40},
    {"torus", "a ring of radius 2, thick 1.2", 24},
};
const size_t qmat_model_kind_count = sizeof qmat_model_kinds / sizeof qmat_model_kinds[0];

/* A model under construction. When memory runs out `failed` is set; from then on nothing is added and every index is 0,
 * so the makers check once, at the end. */
typedef struct builder {
  qmat_model *model;
  size_t vertex_capacity, triangle_capacity, sphere_capacity, edge_capacity, medial_triangle_capacity;
  /* Maps lattice places to vertices, by open addressing. Stores key + 1; 0 marks a free slot. */
  uint64_t *keys;
  uint32_t *key_vertices;
  size_t key_count, key_capacity;
  bool failed;
} builder;

static void *grown(builder *b, void *array, size_t *capacity, size_t needed, size_t size) {
  if (needed <= *capacity || b->failed) return array;
  size_t wanted = *capacity < 64 ? 64 : 2 * *capacity;
  if (wanted < needed) wanted = needed;
  void *larger = wanted > SIZE_MAX / size ? NULL : realloc(array, wanted * size);
  if (!larger) {
    b->failed = true;
    return array;
  }
  *capacity = wanted;
  return larger;
}

static uint32_t add_vertex(builder *b, const double p[3]) {
  qmat_model *m = b->model;
  m->positions = grown(b, m->positions, &b->vertex_capacity, m->vertex_count + 1, 3 * sizeof *m->positions);
  if (m->vertex_count >= UINT32_MAX) b->failed = true;
  if (b->failed) return 0;
  memcpy(m->positions + 3 * m->vertex_count, p, 3 * sizeof *p);
  return (uint32_t)m->vertex_count++;
}

static void add_triangle(builder *b, uint32_t i, uint32_t j, uint32_t k) {
  qmat_model *m = b->model;
  m->triangles = grown(b, m->triangles, &b->triangle_capacity, m->triangle_count + 1, 3 * sizeof *m->triangles);
  if (b->failed) return;
  memcpy(m->triangles + 3 * m->triangle_count++, (const uint32_t[3]){i, j, k}, 3 * sizeof i);
}

static uint32_t add_sphere(builder *b, double x, double y, double z, double radius) {
  qmat_model *m = b->model;
  m->spheres = grown(b, m->spheres, &b->sphere_capacity, m->sphere_count + 1, 4 * sizeof *m->spheres);
  if (b->failed) return 0;
  memcpy(m->spheres + 4 * m->sphere_count, (const double[4]){x, y, z, radius}, 4 * sizeof x);
  return (uint32_t)m->sphere_count++;
}

static void add_edge(builder *b, uint32_t i, uint32_t j) {
  qmat_model *m = b->model;
  const uint32_t low = i < j ? i : j, high = i < j ? j : i;
  for (size_t e = 0; e < m->edge_count; e++) { /* linear: known medial meshes have a few hundred edges */
    if (m->edges[2 * e] == low && m->edges[2 * e + 1] == high) return;
  }
  m->edges = grown(b, m->edges, &b->edge_capacity, m->edge_count + 1, 2 * sizeof *m->edges);
  if (b->failed) return;
  memcpy(m->edges + 2 * m->edge_count++, (const uint32_t[2]){low, high}, 2 * sizeof i);
}

static void add_medial_triangle(builder *b, uint32_t i, uint32_t j, uint32_t k) {
  qmat_model *m = b->model;
  m->medial_triangles = grown(b, m->medial_triangles, &b->medial_triangle_capacity, m->medial_triangle_count + 1,
                              3 * sizeof *m->medial_triangles);
  if (b->failed) return;
  memcpy(m->medial_triangles + 3 * m->medial_triangle_count++, (const uint32_t[3]){i, j, k}, 3 * sizeof i);
  add_edge(b, i, j);
  add_edge(b, j, k);
  add_edge(b, i, k);
}

static double distance_squared(const builder *b, uint32_t i, uint32_t j) {
  const double *p = b->model->positions + 3 * (size_t)i, *q = b->model->positions + 3 * (size_t)j;
  return (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]);
}

/* Adds two triangles, split along the shorter diagonal, on a tie along i k. */
static void add_quad(builder *b, uint32_t i, uint32_t j, uint32_t k, uint32_t l) {
  if (b->failed) return;
  if (distance_squared(b, i, k) <= distance_squared(b, j, l)) {
    add_triangle(b, i, j, k);
    add_triangle(b, i, k, l);
  } else {
    add_triangle(b, j, k, l);
    add_triangle(b, j, l, i);
  }
}

/* A pseudo-random number in [-1/2, 1/2), determined by its arguments. */
static double jitter(uint64_t stream, uint64_t a, uint64_t b) {
  return qmat_hash_unit(qmat_hash3(stream, a, b)) - 0.5;
}

/* The slot that holds the key, or the free slot where it belongs. */
static size_t lattice_slot(const builder *b, uint64_t key) {
  size_t slot = (size_t)qmat_hash_mix(key) & (b->key_capacity - 1);
  while (b->keys[slot] != 0 && b->keys[slot] != key + 1) slot = (slot + 1) & (b->key_capacity - 1);
  return slot;
}

static void lattice_grow(builder *b) {
  const size_t old_capacity = b->key_capacity;
  uint64_t *old_keys = b->keys;
  uint32_t *old_vertices = b->key_vertices;
  b->key_capacity = old_capacity == 0 ? 1024 : 2 * old_capacity;
  b->keys = calloc(b->key_capacity, sizeof *b->keys);
  b->key_vertices = calloc(b->key_capacity, sizeof *b->key_vertices);
  if (!b->keys || !b->key_vertices) {
    b->failed = true;
  } else {
    for (size_t i = 0; i < old_capacity; i++) {
      if (old_keys[i] == 0) continue;
      const size_t slot = lattice_slot(b, old_keys[i] - 1);
      b->keys[slot] = old_keys[i];
      b->key_vertices[slot] = old_vertices[i];
    }
  }
  free(old_keys);
  free(old_vertices);
}

static uint64_t lattice_key(const int place[3]) {
  return (uint64_t)place[0] << 42 | (uint64_t)place[1] << 21 | (uint64_t)place[2];
}

/* The vertex at a lattice place. The first call for a place makes it, at the position that `locate` computes. */
static uint32_t lattice_vertex(builder *b, const int place[3], const void *shape,
                               void (*locate)(const void *shape, const int place[3], double p[3])) {
  if (2 * b->key_count >= b->key_capacity && !b->failed) lattice_grow(b);
  if (b->failed) return 0;
  const size_t slot = lattice_slot(b, lattice_key(place));
  if (b->keys[slot] == 0) {
    double p[3];
    locate(shape, place, p);
    b->key_vertices[slot] = add_vertex(b, p);
    b->keys[slot] = lattice_key(place) + 1;
    b->key_count++;
  }
  return b->key_vertices[slot];
}

/* Frees the builder, and after a failure the model. */
static qmat_status finish(builder *b, const char *name) {
  free(b->keys);
  free(b->key_vertices);
  b->model->name = name;
  if (!b->failed) return QMAT_OK;
  qmat_model_uninit(b->model);
  return QMAT_ERROR_MEMORY;
}

static bool bad_resolution(int resolution) {
  return resolution < QMAT_MODEL_RESOLUTION_MIN || resolution > QMAT_MODEL_RESOLUTION_MAX;
}

/* ---- Round shapes: the convex hull of two balls ---- */

/* The profile of a tapered capsule. Its parameter counts rings, from 0 at the first pole. The length of a step is
 * proportional to the radius of the local ball. */
typedef struct profile {
  double start, end, length;
  double turn; /* angle from the first pole to where the cone begins */
  double start_steps, cone_steps, end_steps;
} profile;

/* The point at parameter u (its coordinate along the axis, its distance from it) and the radius of the ball there. */
static void profile_at(const profile *f, double u, double *along, double *away, double *ball) {
  double centre = 0, radius = f->start, angle = f->turn;
  if (u < f->start_steps) {
    angle = f->turn * u / f->start_steps;
  } else if (u > f->start_steps + f->cone_steps) {
    centre = f->length;
    radius = f->end;
    angle = f->turn + (PI - f->turn) * (u - f->start_steps - f->cone_steps) / f->end_steps;
  } else if (f->cone_steps > 0) {
    const double part = (u - f->start_steps) / f->cone_steps;
    radius = f->start * pow(f->end / f->start, part); /* step / radius is constant */
    centre = f->start == f->end ? f->length * part : f->length * (radius - f->start) / (f->end - f->start);
  }
  *along = centre - radius * cos(angle);
  *away = radius * sin(angle);
  *ball = radius;
}

typedef struct ring {
  size_t count;
  uint32_t first;
} ring;

/* The angle of vertex i of a ring of `count`, in turns. */
static double ring_angle(size_t level, size_t i, size_t count) {
  const double shift = jitter(1, level, 0) + 0.5;
  return ((double)i + shift + 0.3 * jitter(2, level, i % count)) / (double)count;
}

/* Triangulates the band between two rings. Each step takes the edge, of either ring, whose midpoint has the smaller
 * angle. */
static void zip_rings(builder *b, size_t level, ring low, ring high) {
  size_t i = 0, j = 0;
  while (i < low.count || j < high.count) {
    const uint32_t a = low.first + (uint32_t)(i % low.count), c = high.first + (uint32_t)(j % high.count);
    bool advance_low = j == high.count;
    if (i < low.count && j < high.count) {
      advance_low = ring_angle(level, i, low.count) + ring_angle(level, i + 1, low.count) <=
                    ring_angle(level + 1, j, high.count) + ring_angle(level + 1, j + 1, high.count);
    }
    if (advance_low) {
      if (low.count > 1) add_triangle(b, a, low.first + (uint32_t)((i + 1) % low.count), c);
      i++;
    } else {
      if (high.count > 1) add_triangle(b, a, high.first + (uint32_t)((j + 1) % high.count), c);
      j++;
    }
  }
}

static qmat_status make_capsule(double start, double end, double length, int resolution, const char *name,
                                qmat_model *model) {
  *model = (qmat_model){0};
  const bool ball_only = length == 0 && start == end;
  if (bad_resolution(resolution) || !(start > 0 && end > 0 && (ball_only || fabs(end - start) < length))) {
    return QMAT_ERROR_USAGE;
  }
  builder build = {.model = model}, *b = &build;
  const double step = 2 * PI / resolution;
  profile f = {.start = start, .end = end, .length = length, .turn = ball_only ? PI / 2 : acos((end - start) / length)};
  f.start_steps = ceil(f.turn / step);
  f.end_steps = ceil((PI - f.turn) / step);
  if (!ball_only) {
    const double slant = sqrt(length * length - (end - start) * (end - start));
    const double mean = start == end ? start : (end - start) / log(end / start);
    f.cone_steps = ceil(slant / (step * mean));
  }
  const size_t rings = (size_t)(f.start_steps + f.cone_steps + f.end_steps);
  ring previous = {0};
  for (size_t level = 0; level <= rings; level++) {
    const bool pole = level == 0 || level == rings;
    double along, away, ball;
    profile_at(&f, (double)level, &along, &away, &ball);
    ring current = {1, (uint32_t)model->vertex_count};
    if (!pole) current.count = (size_t)fmax(3, round(resolution * away / ball));
    for (size_t i = 0; i < current.count; i++) {
      const double angle = 2 * PI * ring_angle(level, i, current.count);
      if (pole) {
        away = 0;
      } else {
        profile_at(&f, (double)level + 0.4 * jitter(3, level, i), &along, &away, &ball);
      }
      add_vertex(b, (const double[3]){along, away * cos(angle), away * sin(angle)});
    }
    if (level > 0) zip_rings(b, level - 1, previous, current);
    previous = current;
  }
  const double d = ball_only ? 0 : (end - start) / length;
  const double large = fmax(start, end);
  model->euler = 2;
  /* the two caps beyond the tangent circles and the frustum between them */
  const double low = -start * d, high = length - end * d, rise = sqrt(1 - d * d);
  const double cap_start = PI * start * start * start * (2 - 3 * d + d * d * d) / 3;
  const double cap_end = PI * end * end * end * (2 + 3 * d - d * d * d) / 3;
  const double r = start * rise, s = end * rise;
  model->volume = cap_start + cap_end + PI * (high - low) * (r * r + r * s + s * s) / 3;
  model->deviation = large * (1 - cos(fmin(PI / 2, 1.1 * step)));
  const uint32_t first = add_sphere(b, 0, 0, 0, start);
  if (!ball_only) add_edge(b, first, add_sphere(b, length, 0, 0, end));
  model->medial_complete = true;
  return finish(b, name);
}

qmat_status qmat_model_make_capsule(double start, double end, double length, int resolution, qmat_model *model) {
  return make_capsule(start, end, length, resolution,
                      length == 0    ? "sphere"
                      : start == end ? "capsule"
                                     : "tapered-capsule",
                      model);
}

/* ---- The torus ---- */

qmat_status qmat_model_make_torus(double ring_radius, double tube, int resolution, qmat_model *model) {
  *model = (qmat_model){0};
  if (bad_resolution(resolution) || !(tube > 0 && ring_radius > tube && ring_radius < 1000 * tube)) {
    return QMAT_ERROR_USAGE;
  }
  builder build = {.model = model}, *b = &build;
  const uint32_t across = (uint32_t)resolution, around = (uint32_t)ceil(resolution * ring_radius / tube);
  for (uint32_t i = 0; i < around; i++) {
    for (uint32_t j = 0; j < across; j++) {
      const double u = 2 * PI * (i + 0.4 * jitter(4, i, j)) / around;
      const double v = 2 * PI * (j + 0.4 * jitter(5, i, j)) / across;
      const double away = ring_radius + tube * cos(v);
      add_vertex(b, (const double[3]){away * cos(u), away * sin(u), tube * sin(v)});
    }
  }
  for (uint32_t i = 0; i < around; i++) {
    for (uint32_t j = 0; j < across; j++) {
      const uint32_t k = (i + 1) % around, l = (j + 1) % across;
      add_quad(b, i * across + j, k * across + j, k * across + l, i * across + l);
    }
  }
  uint32_t first = 0, last = 0;
  for (uint32_t i = 0; i < around; i++) {
    const double u = 2 * PI * i / around;
    const uint32_t sphere = add_sphere(b, ring_radius * cos(u), ring_radius * sin(u), 0, tube);
    if (i == 0) {
      first = sphere;
    } else {
      add_edge(b, last, sphere);
    }
    last = sphere;
  }
  add_edge(b, first, last);
  model->euler = 0;
  model->volume = 2 * PI * PI * ring_radius * tube * tube;
  /* edges along the ring are longest, and flattest, on its outer side */
  model->deviation = (ring_radius + tube) * (1 - cos(1.5 * PI / around)) + tube * (1 - cos(1.5 * PI / across));
  model->medial_complete = true;
  model->medial_deviation = ring_radius * (1 - cos(PI / around));
  return finish(b, "torus");
}

/* ---- Shapes with flat sides: blocks of a lattice ---- */

enum { MAX_BLOCKS = 4 };

/* Planes along each axis divide space into blocks, some of them solid. The interval between two planes has `cells`
 * lattice cells. */
typedef struct blocks {
  int count[3];
  double planes[3][MAX_BLOCKS + 1];
  int cells[3][MAX_BLOCKS];
  bool solid[MAX_BLOCKS][MAX_BLOCKS][MAX_BLOCKS];
  double shake; /* how far vertices move within their side, in cells */
} blocks;

static int lattice_start(const blocks *shape, int axis, int block) {
  int start = 0;
  for (int i = 0; i < block; i++) start += shape->cells[axis][i];
  return start;
}

static void locate_in_blocks(const void *shape_, const int place[3], double p[3]) {
  const blocks *shape = shape_;
  for (int axis = 0; axis < 3; axis++) {
    int block = 0, cell = place[axis];
    while (block + 1 < shape->count[axis] && cell >= shape->cells[axis][block]) cell -= shape->cells[axis][block++];
    const int cells = shape->cells[axis][block];
    double part = cell;
    /* only along the axes in which the vertex is on no plane, so that it stays in its side or on its edge */
    if (cell != 0 && cell != cells) part += shape->shake * jitter(6 + (uint64_t)axis, lattice_key(place), 0);
    const double *planes = shape->planes[axis] + block;
    p[axis] = planes[0] + (planes[1] - planes[0]) * part / cells;
  }
}

static void add_side(builder *b, const blocks *shape, const int block[3], int axis, bool upper) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const int u0 = lattice_start(shape, u, block[u]), v0 = lattice_start(shape, v, block[v]);
  int place[3];
  place[axis] = lattice_start(shape, axis, block[axis] + upper);
  for (int i = 0; i < shape->cells[u][block[u]]; i++) {
    for (int j = 0; j < shape->cells[v][block[v]]; j++) {
      uint32_t corner[4];
      for (int k = 0; k < 4; k++) {
        place[u] = u0 + i + (k == 1 || k == 2);
        place[v] = v0 + j + (k >= 2);
        corner[k] = lattice_vertex(b, place, shape, locate_in_blocks);
      }
      if (upper) {
        add_quad(b, corner[0], corner[1], corner[2], corner[3]);
      } else {
        add_quad(b, corner[3], corner[2], corner[1], corner[0]);
      }
    }
  }
}

static void add_blocks(builder *b, const blocks *shape) {
  int block[3];
  for (block[0] = 0; block[0] < shape->count[0]; block[0]++) {
    for (block[1] = 0; block[1] < shape->count[1]; block[1]++) {
      for (block[2] = 0; block[2] < shape->count[2]; block[2]++) {
        if (!shape->solid[block[0]][block[1]][block[2]]) continue;
        for (int axis = 0; axis < 3; axis++) {
          for (int upper = 0; upper < 2; upper++) {
            int next[3] = {block[0], block[1], block[2]};
            next[axis] += upper ? 1 : -1;
            const bool outside = next[axis] < 0 || next[axis] >= shape->count[axis];
            if (outside || !shape->solid[next[0]][next[1]][next[2]]) add_side(b, shape, block, axis, upper);
          }
        }
      }
    }
  }
}

static int cells_for(double length, double cell) {
  return (int)fmax(1, round(length / cell));
}

/* A box around the origin as one block. */
static blocks one_block(double a, double b, double c, int resolution, double shake) {
  blocks shape = {.count = {1, 1, 1}, .shake = shake};
  const double sides[3] = {a, b, c};
  for (int axis = 0; axis < 3; axis++) {
    shape.planes[axis][0] = -sides[axis] / 2;
    shape.planes[axis][1] = sides[axis] / 2;
    shape.cells[axis][0] = cells_for(sides[axis], a / resolution);
  }
  shape.solid[0][0][0] = true;
  return shape;
}

/* The medial axis of a box: a rectangle in the middle plane, and from its border a planar face to each edge of the box.
 * On these faces the radius decreases linearly to 0. */
static void add_box_medial(builder *build, double a, double b, double c) {
  uint32_t corner[2][2][2], inner[2][2];
  const bool square = a == c, prism = b == c; /* the rectangle degenerates to a point, or to a segment along x */
  for (int x = 0; x < 2; x++) {
    for (int y = 0; y < 2; y++) {
      const double sx = x ? 0.5 : -0.5, sy = y ? 0.5 : -0.5;
      if (square && (x || y)) {
        inner[x][y] = inner[0][0];
      } else if (prism && y) {
        inner[x][y] = inner[x][0];
      } else {
        inner[x][y] = add_sphere(build, sx * (a - c), sy * (b - c), 0, c / 2);
      }
      for (int z = 0; z < 2; z++) corner[x][y][z] = add_sphere(build, sx * a, sy * b, z ? c / 2 : -c / 2, 0);
    }
  }
  if (!prism) {
    add_medial_triangle(build, inner[0][0], inner[1][0], inner[1][1]);
    add_medial_triangle(build, inner[0][0], inner[1][1], inner[0][1]);
  }
  for (int s = 0; s < 2; s++) {
    for (int t = 0; t < 2; t++) {
      /* edges along x, y and z */
      add_medial_triangle(build, corner[0][s][t], corner[1][s][t], inner[1][s]);
      if (!square) add_medial_triangle(build, corner[0][s][t], inner[1][s], inner[0][s]);
      add_medial_triangle(build, corner[s][0][t], corner[s][1][t], inner[s][1]);
      if (!prism) add_medial_triangle(build, corner[s][0][t], inner[s][1], inner[s][0]);
      add_medial_triangle(build, corner[s][t][0], corner[s][t][1], inner[s][t]);
    }
  }
}

static qmat_status make_flat_box(double a, double b, double c, int resolution, double shake, const char *name,
                                 qmat_model *model) {
  *model = (qmat_model){0};
  if (bad_resolution(resolution) || !(a >= b && b >= c && c > 0)) return QMAT_ERROR_USAGE;
  builder build = {.model = model};
  const blocks shape = one_block(a, b, c, resolution, shake);
  add_blocks(&build, &shape);
  add_box_medial(&build, a, b, c);
  model->euler = 2;
  model->volume = a * b * c;
  model->medial_complete = true;
  return finish(&build, name);
}

qmat_status qmat_model_make_box(double a, double b, double c, int resolution, qmat_model *model) {
  return make_flat_box(a, b, c, resolution, 0, "box", model);
}

qmat_status qmat_model_make_sheet(double a, double b, double thickness, double angle, int resolution,
                                  qmat_model *model) {
  if (angle == 0) return make_flat_box(a, b, thickness, resolution, 0.5, "sheet", model);
  *model = (qmat_model){0};
  const double bend = a / angle; /* radius of the middle surface */
  if (bad_resolution(resolution) || !(a >= b && b >= thickness && thickness > 0) ||
      !(angle > 0 && angle <= PI && thickness < bend)) {
    return QMAT_ERROR_USAGE;
  }
  builder build = {.model = model};
  const blocks shape = one_block(a, b, thickness, resolution, 0.5);
  add_blocks(&build, &shape);
  for (size_t i = 0; i < model->vertex_count; i++) {
    double *p = model->positions + 3 * i;
    const double turn = p[0] / bend, radius = bend + p[2];
    p[0] = radius * sin(turn);
    p[2] = radius * cos(turn) - bend;
  }
  /* the middle surface, except near the rim, where its spheres would reach beyond the sheet */
  const int strips = shape.cells[0][0];
  uint32_t low = 0, high = 0;
  for (int i = 0; i <= strips; i++) {
    const double turn = (i - strips / 2.0) * (a - thickness * 1.01) / strips / bend;
    const double x = bend * sin(turn), z = bend * cos(turn) - bend, y = (b - thickness) / 2;
    const uint32_t next_low = add_sphere(&build, x, -y, z, thickness / 2);
    const uint32_t next_high = add_sphere(&build, x, y, z, thickness / 2);
    if (i > 0) {
      add_medial_triangle(&build, low, next_low, next_high);
      add_medial_triangle(&build, low, next_high, high);
    }
    low = next_low;
    high = next_high;
  }
  model->euler = 2;
  model->volume = a * b * thickness; /* Pappus; the middle surface keeps its length */
  model->deviation = (bend + thickness / 2) * (1 - cos(fmin(PI / 2, 1.6 * angle / strips / 2)));
  model->medial_deviation = bend * (1 - cos(angle / strips / 2));
  return finish(&build, "curved-sheet");
}

static qmat_status make_l_bracket(int resolution, qmat_model *model) {
  *model = (qmat_model){0};
  if (bad_resolution(resolution)) return QMAT_ERROR_USAGE;
  builder build = {.model = model};
  const double cell = 2.0 / resolution;
  blocks shape = {.count = {2, 1, 2}, .shake = 0.5};
  const double planes[3][3] = {{0, 0.4, 2}, {0, 1, 0}, {0, 0.4, 1.5}};
  for (int axis = 0; axis < 3; axis++) {
    memcpy(shape.planes[axis], planes[axis], sizeof planes[axis]);
    for (int i = 0; i < shape.count[axis]; i++) {
      shape.cells[axis][i] = cells_for(planes[axis][i + 1] - planes[axis][i], cell);
    }
  }
  shape.solid[0][0][0] = shape.solid[1][0][0] = shape.solid[0][0][1] = true;
  add_blocks(&build, &shape);
  model->euler = 2;
  model->volume = 0.4 * 1 * 1.5 + 1.6 * 1 * 0.4;
  return finish(&build, "l-bracket");
}

/* ---- The octopus: a cube mapped to a ball, with tubes extruded from its sides ---- */

typedef struct vec {
  double x, y, z;
} vec;

static vec add(vec a, vec b) {
  return (vec){a.x + b.x, a.y + b.y, a.z + b.z};
}

static vec scale(double s, vec a) {
  return (vec){s * a.x, s * a.y, s * a.z};
}

static double dot(vec a, vec b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

static vec cross(vec a, vec b) {
  return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static vec unit(vec a) {
  return scale(1 / sqrt(dot(a, a)), a);
}

static const double HEAD_HEIGHT = 1.5;  /* the vertical scale of the upper half of the head */
static const double ROOT_RADIUS = 0.19; /* of a tentacle, where it leaves the head */
static const double TIP_RADIUS = 0.042;
static const double BLEND = 0.12; /* the fraction of a tentacle over which its section becomes round */

/* The head: a cube of `cells` lattice cells a side, mapped to the ball with equal angles between lattice lines. */
typedef struct head {
  int cells;
} head;

static vec on_head(const head *shape, const double place[3]) {
  vec p;
  double *out[3] = {&p.x, &p.y, &p.z};
  for (int axis = 0; axis < 3; axis++) *out[axis] = tan((2 * place[axis] / shape->cells - 1) * PI / 4);
  p = unit(p);
  if (p.z > 0) p.z *= HEAD_HEIGHT;
  return p;
}

static void locate_on_head(const void *shape_, const int place[3], double p[3]) {
  const head *shape = shape_;
  double moved[3];
  for (int axis = 0; axis < 3; axis++) {
    const bool free_to_move = place[axis] != 0 && place[axis] != shape->cells;
    moved[axis] = place[axis] + (free_to_move ? 0.3 * jitter(9 + (uint64_t)axis, lattice_key(place), 0) : 0);
  }
  const vec q = on_head(shape, moved);
  p[0] = q.x, p[1] = q.y, p[2] = q.z;
}

/* A tentacle: the square of `size` x `size` cells at (u, v) on one side of the cube, extruded along a curve. u runs
 * around the z axis. */
typedef struct tentacle {
  int index, axis, upper, u, v, size;
  vec root, out, side, up; /* a frame: `out` leads away from the head, `side` around the z axis */
} tentacle;

/* The centre line of a tentacle at t in [0, 1]. It leaves the head, descends, sways, and rises at the tip. */
static vec tentacle_at(const tentacle *arm, double t) {
  const uint64_t i = (uint64_t)arm->index;
  const double reach = 1 + 0.25 * jitter(12, i, 0), lift = 0.9 + 0.8 * jitter(13, i, 0);
  const double sway = 0.5 + 0.3 * jitter(14, i, 0), phase = 2 * PI * jitter(15, i, 0);
  const vec flat = unit((vec){arm->root.x, arm->root.y, 0}), level = {-flat.y, flat.x, 0}, high = {0, 0, 1};
  const vec points[4] = {
      arm->root,
      add(arm->root, scale(0.8, arm->out)),
      add(scale(3.1 * reach, flat), scale(-1.9, high)),
      add(scale(3.9 * reach, flat), scale(-1.6 + lift, high)),
  };
  const double s = 1 - t;
  const double weights[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
  vec p = {0, 0, 0};
  for (int k = 0; k < 4; k++) p = add(p, scale(weights[k], points[k]));
  return add(p, scale(sway * t * t * sin(5 * t + phase), level));
}

static double tentacle_radius(double t) {
  return TIP_RADIUS + (ROOT_RADIUS - TIP_RADIUS) * pow(1 - t, 1.1);
}

static vec tentacle_tangent(const tentacle *arm, double t) {
  const double h = 1e-5;
  return add(tentacle_at(arm, t + h), scale(-1, tentacle_at(arm, t - h)));
}

/* Maps the square [-1, 1]^2 to polar coordinates of the disc (Shirley and Chiu 1997). */
static void square_to_disc(double x, double y, double *level, double *angle) {
  *level = fmax(fabs(x), fabs(y));
  if (*level == 0) {
    *angle = 0;
  } else if (fabs(x) >= fabs(y)) {
    *angle = PI / 4 * y / x + (x < 0 ? PI : 0);
  } else {
    *angle = PI / 2 - PI / 4 * x / y + (y < 0 ? PI : 0);
  }
}

/* The lattice place of the square's corner (i, j), 0 <= i, j <= size, on the head. */
static void square_place(const tentacle *arm, const head *shape, int i, int j, int place[3]) {
  const int around = arm->axis == 0 ? 1 : 0;
  const bool forward = (arm->axis == 0) == (arm->upper == 1); /* u turns counter-clockwise about z */
  place[arm->axis] = arm->upper ? shape->cells : 0;
  place[around] = forward ? arm->u + i : shape->cells - arm->u - i;
  place[2] = arm->v + j;
}

/* Corner k of the square's border, counter-clockwise from outside. */
static void border_corner(int size, int k, int *i, int *j) {
  const int side = k / size, step = k % size;
  *i = side == 0 ? step : side == 1 ? size : side == 2 ? size - step : 0;
  *j = side == 0 ? 0 : side == 1 ? step : side == 2 ? size : size - step;
}

/* The curve parameters of the rings. The distance of two rings is a fixed multiple of the edge length within a ring.
 * NULL when memory runs out; the caller frees the array. */
static double *tentacle_steps(const tentacle *arm, int corners, size_t *count) {
  enum { FINE = 4096 };
  const double stretch = 2.2;
  double total = 0;
  double *sums = malloc((FINE + 1) * sizeof *sums);
  if (!sums) return NULL;
  sums[0] = 0;
  for (int i = 0; i < FINE; i++) {
    const double t = (i + 0.5) / FINE;
    const vec d = add(tentacle_at(arm, (i + 1.0) / FINE), scale(-1, tentacle_at(arm, (double)i / FINE)));
    total += sqrt(dot(d, d)) / (stretch * 2 * PI * tentacle_radius(t) / corners);
    sums[i + 1] = total;
  }
  *count = (size_t)ceil(total);
  double *steps = malloc((*count + 1) * sizeof *steps);
  if (steps) {
    int fine = 0;
    for (size_t k = 0; k <= *count; k++) {
      const double wanted = total * (double)k / (double)*count;
      while (fine + 1 < FINE && sums[fine + 1] < wanted) fine++;
      steps[k] = fmin(1, (fine + (wanted - sums[fine]) / (sums[fine + 1] - sums[fine])) / FINE);
    }
    steps[*count] = 1;
  }
  free(sums);
  return steps;
}

static void add_tentacle(builder *b, const head *shape, const tentacle *arm) {
  const int corners = 4 * arm->size, size = arm->size;
  size_t count = 0;
  double *steps = tentacle_steps(arm, corners, &count);
  uint32_t *rings = calloc(2 * (size_t)corners, sizeof *rings), *previous = rings;
  uint32_t *grid = calloc((size_t)(size + 1) * (size_t)(size + 1), sizeof *grid);
  vec *border = calloc((size_t)corners, sizeof *border); /* the square's border in the frame of the root */
  if (!steps || !rings || !grid || !border) {
    b->failed = true;
  }
  for (int k = 0; k < corners && !b->failed; k++) {
    int i, j, place[3];
    border_corner(size, k, &i, &j);
    square_place(arm, shape, i, j, place);
    previous[k] = lattice_vertex(b, place, shape, locate_on_head);
    if (b->failed) break;
    const double *p = b->model->positions + 3 * (size_t)previous[k];
    const vec d = add((vec){p[0], p[1], p[2]}, scale(-1, arm->root));
    border[k] = (vec){dot(d, arm->side), dot(d, arm->up), dot(d, arm->out)};
  }
  vec tangent = arm->out, side = arm->side, up = arm->up, centre = arm->root;
  uint32_t last_sphere = UINT32_MAX;
  for (size_t step = 1; step <= count && !b->failed; step++) {
    const double t = steps[step], radius = tentacle_radius(t);
    uint32_t *current = rings + (step % 2 == 0 ? 0 : corners);
    centre = tentacle_at(arm, t);
    tangent = unit(tentacle_tangent(arm, t));
    side = unit(add(side, scale(-dot(side, tangent), tangent))); /* the frame with the least rotation */
    up = cross(tangent, side);
    const double x = fmin(1, t / BLEND), round_part = x * x * (3 - 2 * x);
    const double spacing = sqrt(dot(tentacle_tangent(arm, t), tentacle_tangent(arm, t))) / 2e-5 * (t - steps[step - 1]);
    for (int k = 0; k < corners; k++) {
      int i, j;
      double level, angle;
      border_corner(size, k, &i, &j);
      square_to_disc(2.0 * i / size - 1, 2.0 * j / size - 1, &level, &angle);
      const uint64_t id = (uint64_t)arm->index << 32 | (uint64_t)k;
      angle += 0.3 * jitter(16, id, step) * 2 * PI / corners;
      const double slip = 0.3 * jitter(17, id, step) * spacing * round_part;
      const vec square = border[k];
      const double s = (1 - round_part) * square.x + round_part * radius * cos(angle);
      const double u = (1 - round_part) * square.y + round_part * radius * sin(angle);
      const double o = (1 - round_part) * square.z + slip;
      const vec p = add(centre, add(scale(s, side), add(scale(u, up), scale(o, tangent))));
      current[k] = add_vertex(b, (const double[3]){p.x, p.y, p.z});
    }
    for (int k = 0; k < corners; k++) {
      const int next = (k + 1) % corners;
      add_quad(b, previous[k], previous[next], current[next], current[k]);
    }
    previous = current;
    if (t >= BLEND) {
      const uint32_t sphere = add_sphere(b, centre.x, centre.y, centre.z, radius);
      if (last_sphere != UINT32_MAX) add_edge(b, last_sphere, sphere);
      last_sphere = sphere;
    }
  }
  /* the round end: the square again, its centre extruded to the pole */
  for (int k = 0; k < corners && !b->failed; k++) {
    int i, j;
    border_corner(size, k, &i, &j);
    grid[j * (size + 1) + i] = previous[k];
  }
  for (int j = 1; j < size && !b->failed; j++) {
    for (int i = 1; i < size; i++) {
      double level, angle;
      square_to_disc(2.0 * i / size - 1, 2.0 * j / size - 1, &level, &angle);
      const double away = TIP_RADIUS * sin(level * PI / 2), along = TIP_RADIUS * cos(level * PI / 2);
      const vec p =
          add(centre, add(scale(along, tangent), add(scale(away * cos(angle), side), scale(away * sin(angle), up))));
      grid[j * (size + 1) + i] = add_vertex(b, (const double[3]){p.x, p.y, p.z});
    }
  }
  for (int j = 0; j < size && !b->failed; j++) {
    for (int i = 0; i < size; i++) {
      const uint32_t *g = grid + j * (size + 1) + i;
      add_quad(b, g[0], g[1], g[size + 2], g[size + 1]);
    }
  }
  free(steps);
  free(rings);
  free(grid);
  free(border);
}

static qmat_status make_octopus(int resolution, qmat_model *model) {
  *model = (qmat_model){0};
  if (bad_resolution(resolution)) return QMAT_ERROR_USAGE;
  builder build = {.model = model}, *b = &build;
  const int unit_cells = resolution < 16 ? 1 : resolution / 16;
  const head shape = {8 * unit_cells};
  for (int axis = 0; axis < 3; axis++) {
    for (int upper = 0; upper < 2; upper++) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int i = 0; i < shape.cells; i++) {
        for (int j = 0; j < shape.cells; j++) {
          int place[3];
          place[axis] = upper ? shape.cells : 0;
          uint32_t corner[4];
          /* each of the four upright sides leaves out two squares, below its middle */
          const int turn = axis == 0 ? i : j, rise = axis == 0 ? j : i;
          const bool drawn_out =
              axis != 2 && rise >= unit_cells && rise < 3 * unit_cells &&
              (turn / unit_cells == 1 || turn / unit_cells == 2 || turn / unit_cells == 5 || turn / unit_cells == 6);
          for (int k = 0; k < 4 && !drawn_out; k++) {
            place[u] = i + (k == 1 || k == 2);
            place[v] = j + (k >= 2);
            corner[k] = lattice_vertex(b, place, &shape, locate_on_head);
          }
          if (drawn_out) continue;
          if (upper) {
            add_quad(b, corner[0], corner[1], corner[2], corner[3]);
          } else {
            add_quad(b, corner[3], corner[2], corner[1], corner[0]);
          }
        }
      }
    }
  }
  add_sphere(b, 0, 0, 0, 1);
  for (int index = 0; index < 8; index++) {
    tentacle arm = {.index = index, .axis = index / 2 % 2, .upper = index / 4, .size = 2 * unit_cells};
    arm.u = index % 2 == 0 ? unit_cells : 5 * unit_cells;
    arm.v = unit_cells;
    double middle[3];
    int low[3], high[3];
    square_place(&arm, &shape, 0, 0, low);
    square_place(&arm, &shape, arm.size, arm.size, high);
    for (int axis = 0; axis < 3; axis++) middle[axis] = (low[axis] + high[axis]) / 2.0;
    arm.root = on_head(&shape, middle);
    arm.out = unit(arm.root);
    arm.side = unit((vec){-arm.root.y, arm.root.x, 0});
    arm.up = cross(arm.out, arm.side);
    add_tentacle(b, &shape, &arm);
  }
  model->euler = 2;
  model->volume = NAN;
  const double edge = PI / 2 / shape.cells;
  model->deviation = HEAD_HEIGHT * HEAD_HEIGHT * (1 - cos(fmin(PI / 2, 1.2 * edge)));
  model->medial_deviation = ROOT_RADIUS * 0.05;
  return finish(b, "octopus");
}

/* ---- By name ---- */

qmat_status qmat_model_make(const char *name, int resolution, qmat_model *model) {
  *model = (qmat_model){0};
  const qmat_model_kind *kind = NULL;
  for (size_t i = 0; i < qmat_model_kind_count; i++) {
    if (strcmp(name, qmat_model_kinds[i].name) == 0) kind = qmat_model_kinds + i;
  }
  if (!kind) return QMAT_ERROR_USAGE;
  const int n = resolution == 0 ? kind->default_resolution : resolution;
  const double long_side = 1.6, sheet_side = 1, thickness = 0.01 * 1.8868;
  if (strcmp(name, "box") == 0) return qmat_model_make_box(3, 2, 1, n, model);
  if (strcmp(name, "capsule") == 0) return qmat_model_make_capsule(1, 1, 3, n, model);
  if (strcmp(name, "curved-sheet") == 0) {
    return qmat_model_make_sheet(long_side, sheet_side, thickness, 2 * PI / 3, n, model);
  }
  if (strcmp(name, "l-bracket") == 0) return make_l_bracket(n, model);
  if (strcmp(name, "octopus") == 0) return make_octopus(n, model);
  if (strcmp(name, "sheet") == 0) return qmat_model_make_sheet(long_side, sheet_side, thickness, 0, n, model);
  if (strcmp(name, "sphere") == 0) return qmat_model_make_capsule(1, 1, 0, n, model);
  if (strcmp(name, "tapered-capsule") == 0) return qmat_model_make_capsule(1, 0.3, 3, n, model);
  return qmat_model_make_torus(2, 0.6, n, model);
}

void qmat_model_uninit(qmat_model *model) {
  free(model->positions);
  free(model->triangles);
  free(model->spheres);
  free(model->edges);
  free(model->medial_triangles);
  *model = (qmat_model){0};
}
