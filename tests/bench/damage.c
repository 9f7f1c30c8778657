/* SPDX-License-Identifier: GPL-3.0-or-later */
/* qmat_damage SEED RESOLUTION FILE.off: makes one of the generated models, damages it in one to four ways that the seed
 * chooses, writes it, and prints what was done. Corners need not be of other vertices than before: triangles may cross,
 * repeat, or be degenerate. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/hash.h"
#include "examples/models.h"

typedef struct mesh {
  size_t vertex_count, triangle_count, vertex_room, triangle_room;
  double *positions;
  uint32_t *triangles;
  double size; /* the diagonal of the box of the undamaged model */
} mesh;

static void *must_realloc(void *memory, size_t bytes) {
  void *made = realloc(memory, bytes);
  if (made) return made;
  fputs("qmat_damage: out of memory\n", stderr);
  exit(1);
}

static uint32_t add_vertex(mesh *m, double x, double y, double z) {
  if (m->vertex_count == m->vertex_room) {
    m->vertex_room = 2 * m->vertex_room + 64;
    m->positions = must_realloc(m->positions, 3 * m->vertex_room * sizeof *m->positions);
  }
  double *p = m->positions + 3 * m->vertex_count;
  p[0] = x, p[1] = y, p[2] = z;
  return (uint32_t)m->vertex_count++;
}

static void add_triangle(mesh *m, uint32_t a, uint32_t b, uint32_t c) {
  if (m->triangle_count == m->triangle_room) {
    m->triangle_room = 2 * m->triangle_room + 64;
    m->triangles = must_realloc(m->triangles, 3 * m->triangle_room * sizeof *m->triangles);
  }
  uint32_t *t = m->triangles + 3 * m->triangle_count++;
  t[0] = a, t[1] = b, t[2] = c;
}

static mesh make_mesh(uint64_t seed, int resolution, const char **name) {
  qmat_model model;
  const qmat_model_kind *kind = &qmat_model_kinds[seed % qmat_model_kind_count];
  if (qmat_model_make(kind->name, resolution, &model) != QMAT_OK) {
    fprintf(stderr, "qmat_damage: no %s of resolution %d\n", kind->name, resolution);
    exit(2);
  }
  mesh m = {0};
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t v = 0; v < model.vertex_count; v++) {
    const double *p = model.positions + 3 * v;
    add_vertex(&m, p[0], p[1], p[2]);
    for (int k = 0; k < 3; k++) low[k] = fmin(low[k], p[k]), high[k] = fmax(high[k], p[k]);
  }
  for (size_t t = 0; t < model.triangle_count; t++)
    add_triangle(&m, model.triangles[3 * t], model.triangles[3 * t + 1], model.triangles[3 * t + 2]);
  m.size = hypot(hypot(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
  qmat_model_uninit(&model);
  *name = kind->name;
  return m;
}

/* A number from 0 to 1. */
static double chance(uint64_t seed, uint64_t a, uint64_t b) {
  return qmat_hash_unit(qmat_hash3(seed, a, b));
}

/* ---- the damages ---- */

enum { REMOVE, REMOVE_PATCH, FLIP, DUPLICATE, SPLIT, MOVE, DOUBLE_PART, TRANSLATE, SOUP, COLLAPSE, DAMAGES };
static const char *const names[DAMAGES] = {[REMOVE] = "facets removed", [REMOVE_PATCH] = "a patch removed",
                                           [FLIP] = "facets flipped",   [DUPLICATE] = "facets repeated",
                                           [SPLIT] = "facets split",    [MOVE] = "vertices moved",
                                           [DOUBLE_PART] = "doubled",   [TRANSLATE] = "far from the origin",
                                           [SOUP] = "corners apart",    [COLLAPSE] = "facets collapsed"};

static void remove_facets(mesh *m, uint64_t seed, double share, bool patch) {
  const double *centre = m->positions + 3 * (size_t)(chance(seed, 0, 0) * (double)(m->vertex_count - 1));
  const double c[3] = {centre[0], centre[1], centre[2]}, reach = 0.2 * chance(seed, 0, 1) * m->size;
  size_t kept = 0;
  for (size_t t = 0; t < m->triangle_count; t++) {
    const uint32_t *corners = m->triangles + 3 * t;
    const double *p = m->positions + 3 * (size_t)corners[0];
    const bool gone = patch ? hypot(hypot(p[0] - c[0], p[1] - c[1]), p[2] - c[2]) < reach : chance(seed, 1, t) < share;
    if (!gone || (kept == 0 && t + 1 == m->triangle_count)) memmove(m->triangles + 3 * kept++, corners, 12);
  }
  m->triangle_count = kept;
}

static void change_facets(mesh *m, uint64_t seed, double share, int damage) {
  const size_t count = m->triangle_count;
  for (size_t t = 0; t < count; t++) {
    if (chance(seed, 2, t) >= share) continue;
    uint32_t c[3];
    memcpy(c, m->triangles + 3 * t, sizeof c);
    if (damage == FLIP) {
      m->triangles[3 * t] = c[1], m->triangles[3 * t + 1] = c[0];
    } else if (damage == DUPLICATE) {
      const bool turned = chance(seed, 3, t) < 0.5;
      add_triangle(m, c[0], c[turned ? 2 : 1], c[turned ? 1 : 2]);
    } else if (damage == COLLAPSE) {
      m->triangles[3 * t + 2] = c[chance(seed, 3, t) < 0.5];
    } else { /* SPLIT at a point of its first side: the neighbour is not split */
      double p[3];
      const double at = 0.1 + 0.8 * chance(seed, 3, t);
      for (size_t k = 0; k < 3; k++)
        p[k] = (1 - at) * m->positions[3 * (size_t)c[0] + k] + at * m->positions[3 * (size_t)c[1] + k];
      const uint32_t middle = add_vertex(m, p[0], p[1], p[2]);
      m->triangles[3 * t + 1] = middle;
      add_triangle(m, middle, c[1], c[2]);
    }
  }
}

static void move_vertices(mesh *m, uint64_t seed, double share) {
  const double reach = pow(10, -5 + 4 * chance(seed, 0, 2)) * m->size;
  for (size_t v = 0; v < m->vertex_count; v++) {
    if (chance(seed, 4, v) >= share) continue;
    for (size_t k = 0; k < 3; k++) m->positions[3 * v + k] += reach * (2 * chance(seed, 5 + k, v) - 1);
  }
}

static void double_part(mesh *m, uint64_t seed) {
  const size_t vertices = m->vertex_count, triangles = m->triangle_count;
  /* Exactly, a little beside, or half a model away. */
  const double steps[] = {0, 1e-6, 0.01, 0.25}, step = steps[(int)(4 * chance(seed, 0, 3)) % 4] * m->size;
  for (size_t v = 0; v < vertices; v++)
    add_vertex(m, m->positions[3 * v] + step, m->positions[3 * v + 1] + step / 3, m->positions[3 * v + 2]);
  for (size_t t = 0; t < triangles; t++) {
    const uint32_t *c = m->triangles + 3 * t, n = (uint32_t)vertices;
    add_triangle(m, c[0] + n, c[1] + n, c[2] + n);
  }
}

/* Each facet gets vertices of its own, which are rounded as single precision is. */
static void make_soup(mesh *m, uint64_t seed) {
  const bool rounds = chance(seed, 0, 4) < 0.5;
  for (size_t i = 0; i < 3 * m->triangle_count; i++) {
    const double *p = m->positions + 3 * (size_t)m->triangles[i];
    const double x = p[0], y = p[1], z = p[2];
    m->triangles[i] =
        rounds ? add_vertex(m, (double)(float)x, (double)(float)y, (double)(float)z) : add_vertex(m, x, y, z);
  }
}

static void damage_mesh(mesh *m, uint64_t seed, int damage) {
  const double share = pow(10, -3 + 2.5 * chance(seed, 0, 5)); /* 0.1 to 30 % */
  switch (damage) {
    case REMOVE:
    case REMOVE_PATCH:
      remove_facets(m, seed, share, damage == REMOVE_PATCH);
      break;
    case MOVE:
      move_vertices(m, seed, share);
      break;
    case DOUBLE_PART:
      double_part(m, seed);
      break;
    case TRANSLATE:
      for (size_t i = 0; i < 3 * m->vertex_count; i++) m->positions[i] += 1e6;
      break;
    case SOUP:
      make_soup(m, seed);
      break;
    default:
      change_facets(m, seed, share, damage);
  }
}

int main(int count, char **arguments) {
  if (count != 4) {
    fputs("usage: qmat_damage SEED RESOLUTION FILE.off\n", stderr);
    return 2;
  }
  const uint64_t seed = strtoull(arguments[1], NULL, 10);
  const char *name;
  mesh m = make_mesh(seed, atoi(arguments[2]), &name);
  const size_t ways = 1 + qmat_hash3(seed, 9, 9) % 4;
  printf("%s", name);
  for (size_t i = 0; i < ways; i++) {
    /* The first way takes turns, so that each is tried as often. */
    const int damage = (int)(i == 0 ? seed / qmat_model_kind_count % DAMAGES : qmat_hash3(seed, 8, i) % DAMAGES);
    damage_mesh(&m, qmat_hash3(seed, 7, i), damage);
    printf(", %s", names[damage]);
  }
  printf("\n");
  FILE *file = fopen(arguments[3], "w");
  if (!file) {
    perror(arguments[3]);
    return 1;
  }
  fprintf(file, "OFF\n%zu %zu 0\n", m.vertex_count, m.triangle_count);
  for (size_t v = 0; v < m.vertex_count; v++)
    fprintf(file, "%.17g %.17g %.17g\n", m.positions[3 * v], m.positions[3 * v + 1], m.positions[3 * v + 2]);
  for (size_t t = 0; t < m.triangle_count; t++)
    fprintf(file, "3 %u %u %u\n", m.triangles[3 * t], m.triangles[3 * t + 1], m.triangles[3 * t + 2]);
  free(m.positions);
  free(m.triangles);
  if (fclose(file) == 0) return 0;
  perror(arguments[3]);
  return 1;
}
