/* SPDX-License-Identifier: GPL-3.0-or-later */
/* qmat_planted: makes a random shape whose medial mesh is known, and writes its surface and that medial mesh.
 *
 *   qmat_planted KIND SPHERES SEED TRIANGLES NOISE SURFACE.off MEDIAL.ma
 *
 * KIND is chain, tree, ring or slab. The surface is that of the spheres, cones and slabs, with about TRIANGLES
 * triangles; each vertex is moved by up to NOISE of the diagonal. No two simplices without a common sphere come near
 * each other, and each bend is sharp enough that no sphere can be spared. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/frame.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/vector.h"
#include "core/node.h"
#include "nodes/nodes.h"
#include "tests/random.h"

enum { MOST_SPHERES = 64, MOST_TRIES = 10000, STEPS = 12 };

static const double least_radius = 0.15, most_radius = 0.4;

/* What simplices without a common sphere keep between their surfaces. */
static const double least_gap = 0.15;

typedef struct {
  size_t sphere_count, edge_count, triangle_count;
  double spheres[4 * MOST_SPHERES];
  uint32_t edges[2 * 2 * MOST_SPHERES], triangles[3 * MOST_SPHERES];
} shape;

static void random_direction(random_numbers *random, double direction[3]) {
  const double z = random_between(random, -1, 1), angle = random_between(random, 0, 2 * M_PI), s = sqrt(1 - z * z);
  direction[0] = s * cos(angle);
  direction[1] = s * sin(angle);
  direction[2] = z;
}

/* The cosine between the edge from `from` to `a` and the direction. */
static double cosine(const shape *s, size_t from, size_t a, const double direction[3]) {
  double edge[3];
  for (size_t k = 0; k < 3; k++) edge[k] = s->spheres[4 * a + k] - s->spheres[4 * from + k];
  return qmat_dot(edge, direction) / sqrt(qmat_dot(edge, edge));
}

/* Adds a sphere that is joined to `from`, in a direction between 40 and 145 degrees from the edges that are there, or
 * returns false where no try fits. */
static bool attach(shape *s, size_t from, random_numbers *random) {
  const double least_cosine = cos(145 * M_PI / 180), most_cosine = cos(40 * M_PI / 180);
  for (int i = 0; i < 50; i++) {
    double direction[3];
    random_direction(random, direction);
    bool fits = true;
    for (size_t e = 0; e < s->edge_count; e++) {
      const uint32_t *ends = &s->edges[2 * e];
      if (ends[0] != from && ends[1] != from) continue;
      const double c = cosine(s, from, ends[0] == from ? ends[1] : ends[0], direction);
      fits = fits && c > least_cosine && c < most_cosine;
    }
    if (!fits) continue;
    const size_t made = s->sphere_count++;
    double *sphere = &s->spheres[4 * made];
    const double *base = &s->spheres[4 * from];
    sphere[3] = random_between(random, least_radius, most_radius);
    const double length = (base[3] + sphere[3]) * random_between(random, 1.3, 2.2);
    for (size_t k = 0; k < 3; k++) sphere[k] = base[k] + length * direction[k];
    s->edges[2 * s->edge_count] = (uint32_t)from;
    s->edges[2 * s->edge_count++ + 1] = (uint32_t)made;
    return true;
  }
  return false;
}

/* Point `i` of the medial sphere family of a simplex of `count` corners, STEPS to a side. */
static size_t sample(const shape *s, const uint32_t *corners, size_t count, double points[][4]) {
  size_t made = 0;
  for (int i = 0; i <= STEPS; i++)
    for (int j = 0; j <= (count > 2 ? STEPS - i : 0); j++) {
      const double a = (double)i / STEPS, b = (double)j / STEPS, weights[3] = {1 - a - b, a, b};
      memset(points[made], 0, sizeof points[made]);
      for (size_t k = 0; k < count; k++)
        for (int x = 0; x < 4; x++) points[made][x] += weights[k] * s->spheres[4 * (size_t)corners[k] + (size_t)x];
      made++;
    }
  return made;
}

static bool are_apart(const shape *s, const uint32_t *a, size_t a_count, const uint32_t *b, size_t b_count) {
  double first[(STEPS + 1) * (STEPS + 2) / 2][4], second[(STEPS + 1) * (STEPS + 2) / 2][4];
  for (size_t i = 0; i < a_count; i++)
    for (size_t j = 0; j < b_count; j++)
      if (a[i] == b[j]) return true;
  const size_t m = sample(s, a, a_count, first), n = sample(s, b, b_count, second);
  for (size_t i = 0; i < m; i++)
    for (size_t j = 0; j < n; j++)
      if (qmat_point_distance(first[i], second[j]) < first[i][3] + second[j][3] + least_gap) return false;
  return true;
}

static bool is_free_of_contact(const shape *s) {
  for (size_t i = 0; i < s->edge_count; i++) {
    for (size_t j = 0; j < i; j++)
      if (!are_apart(s, &s->edges[2 * i], 2, &s->edges[2 * j], 2)) return false;
    for (size_t t = 0; t < s->triangle_count; t++)
      if (!are_apart(s, &s->edges[2 * i], 2, &s->triangles[3 * t], 3)) return false;
  }
  return true;
}

static void start(shape *s, random_numbers *random) {
  *s = (shape){.sphere_count = 1};
  s->spheres[3] = random_between(random, least_radius, most_radius);
}

static bool make_chain(shape *s, size_t count, random_numbers *random) {
  start(s, random);
  while (s->sphere_count < count)
    if (!attach(s, s->sphere_count - 1, random)) return false;
  return true;
}

static bool make_tree(shape *s, size_t count, random_numbers *random) {
  start(s, random);
  while (s->sphere_count < count)
    if (!attach(s, random_index(random, s->sphere_count), random)) return false;
  return true;
}

static bool make_ring(shape *s, size_t count, random_numbers *random) {
  *s = (shape){.sphere_count = count, .edge_count = count};
  const double step = random_between(random, 1, 1.5), radius = step / (2 * sin(M_PI / (double)count));
  for (size_t i = 0; i < count; i++) {
    const double angle = 2 * M_PI * (double)i / (double)count, r = radius * random_between(random, 0.9, 1.1);
    double *sphere = &s->spheres[4 * i];
    sphere[0] = r * cos(angle);
    sphere[1] = r * sin(angle);
    sphere[2] = step * random_between(random, -0.3, 0.3);
    sphere[3] = random_between(random, least_radius, most_radius);
    s->edges[2 * i] = (uint32_t)i;
    s->edges[2 * i + 1] = (uint32_t)((i + 1) % count);
  }
  return true;
}

/* A triangle whose other spheres are fingers at its corners or at those of other fingers. */
static bool make_slab(shape *s, size_t count, random_numbers *random) {
  *s = (shape){
      .sphere_count = 3, .edge_count = 3, .triangle_count = 1, .edges = {0, 1, 1, 2, 0, 2}, .triangles = {0, 1, 2}};
  for (size_t i = 0; i < 3; i++) {
    const double angle = 2 * M_PI * (double)i / 3;
    double *sphere = &s->spheres[4 * i];
    sphere[0] = random_between(random, 1, 1.5) * cos(angle);
    sphere[1] = random_between(random, 1, 1.5) * sin(angle);
    sphere[3] = random_between(random, least_radius, 0.3);
  }
  while (s->sphere_count < count)
    if (!attach(s, random_index(random, s->sphere_count), random)) return false;
  return true;
}

static const struct {
  const char *name;
  size_t least;
  bool (*make)(shape *s, size_t count, random_numbers *random);
} kinds[] = {{"chain", 2, make_chain}, {"tree", 4, make_tree}, {"ring", 5, make_ring}, {"slab", 3, make_slab}};

static qmat_medial *medial_of(qmat_context *context, const shape *s) {
  qmat_medial *medial = qmat_medial_new();
  if (!medial) return NULL;
  medial->sphere_count = s->sphere_count;
  medial->spheres = qmat_alloc(s->sphere_count, 4 * sizeof(double));
  if (medial->spheres) {
    memcpy(medial->spheres, s->spheres, 4 * s->sphere_count * sizeof(double));
    if (qmat_medial_set_simplices(context, medial, s->edges, s->edge_count, s->triangles, s->triangle_count) ==
            QMAT_OK &&
        qmat_value_seal(context, &medial->base) == QMAT_OK)
      return medial;
  }
  qmat_value_release(&medial->base);
  return NULL;
}

/* The surface that medial.skin gives it with cells of that size, all of them: decimation would leave few triangles.
 * NULL with the context's error. */
static qmat_mesh *skin(qmat_context *context, const qmat_medial *medial, double resolution) {
  const qmat_node *node = qmat_node_find("medial.skin");
  double params[16] = {0};
  char text[32];
  qmat_value *outputs[4] = {NULL};
  snprintf(text, sizeof text, "%.0f", fmin(fmax(resolution, 16), 1024));
  qmat_params_default(node, params);
  if (qmat_param_parse(context, qmat_param_find(node, "resolution"), text, params) != QMAT_OK ||
      qmat_param_parse(context, qmat_param_find(node, "error"), "0", params) != QMAT_OK ||
      qmat_node_run(context, node, params, (const qmat_value *[]){&medial->base, NULL}, outputs) != QMAT_OK)
    return NULL;
  qmat_value_release(outputs[1]);
  return (qmat_mesh *)outputs[0];
}

static bool write_surface(qmat_context *context, const qmat_mesh *mesh, double noise, random_numbers *random,
                          const char *path) {
  qmat_frame frame;
  FILE *file = fopen(path, "w");
  if (!file || qmat_frame_of_mesh(context, mesh, &frame) != QMAT_OK) return false;
  fprintf(file, "OFF\n%zu %zu 0\n", mesh->vertex_count, mesh->triangle_count);
  for (size_t i = 0; i < mesh->vertex_count; i++) {
    double direction[3];
    random_direction(random, direction);
    const double length = noise * frame.diagonal * random_between(random, 0, 1);
    for (size_t k = 0; k < 3; k++)
      fprintf(file, "%.17g%c", mesh->positions[3 * i + k] + length * direction[k], k < 2 ? ' ' : '\n');
  }
  for (size_t t = 0; t < mesh->triangle_count; t++)
    fprintf(file, "3 %u %u %u\n", mesh->triangles[3 * t], mesh->triangles[3 * t + 1], mesh->triangles[3 * t + 2]);
  return fclose(file) == 0;
}

static bool write_medial(const qmat_medial *medial, const char *path) {
  FILE *file = fopen(path, "w");
  if (!file) return false;
  fprintf(file, "%zu %zu %zu\n", medial->sphere_count, medial->edge_count, medial->triangle_count);
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double *s = &medial->spheres[4 * i];
    fprintf(file, "v %.17g %.17g %.17g %.17g\n", s[0], s[1], s[2], s[3]);
  }
  for (size_t e = 0; e < medial->edge_count; e++)
    fprintf(file, "e %u %u\n", medial->edges[2 * e], medial->edges[2 * e + 1]);
  for (size_t t = 0; t < medial->triangle_count; t++)
    fprintf(file, "f %u %u %u\n", medial->triangles[3 * t], medial->triangles[3 * t + 1], medial->triangles[3 * t + 2]);
  return fclose(file) == 0;
}

int main(int argc, char **argv) {
  if (argc != 8) {
    fprintf(stderr, "usage: qmat_planted KIND SPHERES SEED TRIANGLES NOISE SURFACE.off MEDIAL.ma\n");
    return 2;
  }
  const size_t count = strtoul(argv[2], NULL, 10);
  const double triangles = strtod(argv[4], NULL), noise = strtod(argv[5], NULL);
  random_numbers random = {.seed = strtoul(argv[3], NULL, 10)};
  size_t kind = 0;
  while (kind < sizeof kinds / sizeof kinds[0] && strcmp(kinds[kind].name, argv[1]) != 0) kind++;
  if (kind == sizeof kinds / sizeof kinds[0] || count < kinds[kind].least || count > MOST_SPHERES) {
    fprintf(stderr, "qmat_planted: no shape %s of %s spheres\n", argv[1], argv[2]);
    return 2;
  }
  shape s;
  int tries = 0;
  while (!(kinds[kind].make(&s, count, &random) && is_free_of_contact(&s)))
    if (++tries == MOST_TRIES) {
      fprintf(stderr, "qmat_planted: no %s of %zu spheres is free of contact\n", argv[1], count);
      return 1;
    }
  qmat_context context = {0};
  double resolution = 64;
  qmat_medial *medial = medial_of(&context, &s);
  qmat_mesh *mesh = medial ? skin(&context, medial, resolution) : NULL;
  if (mesh) { /* triangles grow with the square of the resolution */
    resolution *= sqrt(triangles / (double)mesh->triangle_count);
    qmat_value_release(&mesh->base);
    mesh = skin(&context, medial, resolution);
  }
  const bool done = mesh && write_surface(&context, mesh, noise, &random, argv[6]) && write_medial(medial, argv[7]);
  if (!done) fprintf(stderr, "qmat_planted: %s\n", context.error.message);
  qmat_value_release(mesh ? &mesh->base : NULL);
  qmat_value_release(medial ? &medial->base : NULL);
  qmat_context_uninit(&context);
  return done ? 0 : 1;
}
