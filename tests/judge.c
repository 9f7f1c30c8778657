/* SPDX-License-Identifier: GPL-3.0-or-later */
/* qmat_judge: measures how well a medial mesh (.ma) describes a surface (.off, .obj), and checks the result. It shares
 * no code with the library: it has its own readers and distances, and compares everything with everything. It measures
 * errors at samples, so they are lower bounds of the true errors. */
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "usage: qmat_judge SURFACE.(off|obj) MEDIAL.ma [CHECK ...]\n"
    "Prints its figures; exit code 1 when a check fails. Fractions are of the bounding-box diagonal.\n"
    "  --within FRACTION         both errors are at most FRACTION\n"
    "  --components N            the medial mesh has N connected parts\n"
    "  --euler N                 vertices - edges + triangles is N\n"
    "  --known KNOWN.ma          the true medial mesh; with\n"
    "  --near FRACTION           every sphere is at most FRACTION away from it, in centre and in radius\n"
    "  --samples N               samples of the surface, and of the envelope (default 20000)\n"
    "It always checks that numbers are finite, radii are not negative, indices are in range, no simplex is repeated\n"
    "or degenerate, the edges of every triangle are listed, and centres are inside the surface.\n";

typedef struct vec {
  double x, y, z;
} vec;

static vec sub(vec a, vec b) {
  return (vec){a.x - b.x, a.y - b.y, a.z - b.z};
}

static vec mix(vec a, double s, vec b) {
  return (vec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static double dot(vec a, vec b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

static vec cross(vec a, vec b) {
  return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static double length(vec a) {
  return sqrt(dot(a, a));
}

typedef struct sphere {
  vec c;
  double r;
} sphere;

/* A sphere, a cone or a slab, by the rising ids of its one to three spheres. */
typedef struct simplex {
  uint32_t ids[3];
  int count;
} simplex;

typedef struct medial {
  size_t sphere_count, simplex_count, listed_edges, triangle_count;
  sphere *spheres;
  simplex *simplices; /* as in the file: edges, then triangles; then spheres on no edge */
} medial;

typedef struct surface {
  size_t vertex_count, triangle_count;
  vec *vertices;
  uint32_t *triangles;
} surface;

static void stop(const char *path, const char *what) {
  fprintf(stderr, "qmat_judge: %s: %s\n", path, what);
  exit(2);
}

static void *need(void *memory) {
  if (!memory) stop("memory", "too little");
  return memory;
}

/* ---- Reading ---- */

static FILE *open_file(const char *path) {
  FILE *file = fopen(path, "r");
  if (!file) stop(path, strerror(errno));
  return file;
}

static void add_polygon(surface *s, size_t *capacity, const uint32_t *corners, int count) {
  for (int k = 2; k < count; k++) {
    if (s->triangle_count == *capacity) {
      *capacity = 2 * *capacity + 1024;
      s->triangles = need(realloc(s->triangles, 3 * *capacity * sizeof *s->triangles));
    }
    uint32_t *t = s->triangles + 3 * s->triangle_count++;
    t[0] = corners[0], t[1] = corners[k - 1], t[2] = corners[k];
  }
}

static surface read_surface(const char *path) {
  surface s = {0};
  FILE *file = open_file(path);
  size_t capacity = 0, room = 0;
  uint32_t corners[64];
  const size_t end = strlen(path);
  if (end > 4 && strcmp(path + end - 4, ".obj") == 0) {
    char line[4096];
    while (fgets(line, sizeof line, file) != NULL) {
      vec p;
      if (sscanf(line, "v %lf %lf %lf", &p.x, &p.y, &p.z) == 3) {
        if (s.vertex_count == room) {
          room = 2 * room + 1024;
          s.vertices = need(realloc(s.vertices, room * sizeof *s.vertices));
        }
        s.vertices[s.vertex_count++] = p;
      } else if (line[0] == 'f' && isspace((unsigned char)line[1])) {
        int count = 0;
        for (char *word = strtok(line + 1, " \t\r\n"); word != NULL && count < 64; word = strtok(NULL, " \t\r\n")) {
          const long id = strtol(word, NULL, 10);
          corners[count++] = (uint32_t)(id > 0 ? id - 1 : (long)s.vertex_count + id);
        }
        add_polygon(&s, &capacity, corners, count);
      }
    }
  } else {
    size_t facets;
    if (fscanf(file, "OFF %zu %zu %*u", &s.vertex_count, &facets) != 2) stop(path, "no OFF header");
    s.vertices = need(calloc(s.vertex_count + 1, sizeof *s.vertices));
    for (size_t i = 0; i < s.vertex_count; i++) {
      vec *p = s.vertices + i;
      if (fscanf(file, "%lf %lf %lf", &p->x, &p->y, &p->z) != 3) stop(path, "a vertex is missing");
    }
    for (size_t i = 0; i < facets; i++) {
      int count;
      if (fscanf(file, "%d", &count) != 1 || count < 3 || count > 64) stop(path, "a facet cannot be read");
      for (int k = 0; k < count; k++) {
        if (fscanf(file, "%u", corners + k) != 1) stop(path, "a facet is cut off");
      }
      add_polygon(&s, &capacity, corners, count);
      for (int c = fgetc(file); c != '\n' && c != EOF; c = fgetc(file)) continue; /* colours */
    }
  }
  fclose(file);
  for (size_t i = 0; i < 3 * s.triangle_count; i++) {
    if (s.triangles[i] >= s.vertex_count) stop(path, "an index is out of range");
  }
  if (s.triangle_count == 0) stop(path, "no triangles");
  return s;
}

static int compare_simplices(const void *left, const void *right) {
  const simplex *a = left, *b = right;
  if (a->count != b->count) return a->count - b->count;
  for (int k = 0; k < a->count; k++) {
    if (a->ids[k] != b->ids[k]) return a->ids[k] < b->ids[k] ? -1 : 1;
  }
  return 0;
}

static simplex sorted_simplex(const uint32_t *ids, int count) {
  simplex s = {.count = count};
  memcpy(s.ids, ids, (size_t)count * sizeof *ids);
  for (int pass = 0; pass < 2; pass++) {
    for (int k = 0; k + 1 < count; k++) {
      if (s.ids[k] <= s.ids[k + 1]) continue;
      const uint32_t swap = s.ids[k];
      s.ids[k] = s.ids[k + 1], s.ids[k + 1] = swap;
    }
  }
  return s;
}

static medial read_medial(const char *path) {
  medial m = {0};
  FILE *file = open_file(path);
  if (fscanf(file, "%zu %zu %zu", &m.sphere_count, &m.listed_edges, &m.triangle_count) != 3) stop(path, "no header");
  m.spheres = need(calloc(m.sphere_count + 1, sizeof *m.spheres));
  m.simplices = need(calloc(m.sphere_count + m.listed_edges + m.triangle_count + 1, sizeof *m.simplices));
  for (size_t i = 0; i < m.sphere_count; i++) {
    sphere *s = m.spheres + i;
    if (fscanf(file, " v %lf %lf %lf %lf", &s->c.x, &s->c.y, &s->c.z, &s->r) != 4) stop(path, "a sphere is missing");
  }
  for (size_t i = 0; i < m.listed_edges + m.triangle_count; i++) {
    uint32_t ids[3];
    const int count = i < m.listed_edges ? 2 : 3;
    const bool good = count == 2 ? fscanf(file, " e %u %u", ids, ids + 1) == 2
                                 : fscanf(file, " f %u %u %u", ids, ids + 1, ids + 2) == 3;
    if (!good) stop(path, "an edge or a triangle is missing");
    m.simplices[m.simplex_count++] = sorted_simplex(ids, count);
  }
  char rest;
  if (fscanf(file, " %c", &rest) == 1) stop(path, "there is something after the last triangle");
  fclose(file);
  return m;
}

/* ---- Distances ---- */

static double sphere_value(const sphere *s, vec p) {
  return length(sub(p, s->c)) - s->r;
}

/* The minimum of |p - c| - r over the spheres (c, r) of a segment. At a minimum inside the segment, the distance along
 * the segment from the foot of p to c is the slope of the radius times |p - c|. */
static double cone_value(const sphere *a, const sphere *b, vec p) {
  const double best = fmin(sphere_value(a, p), sphere_value(b, p));
  const vec d = sub(b->c, a->c), q = sub(p, a->c);
  const double l = length(d), growth = (b->r - a->r) / l;
  if (!(l > 0) || !(fabs(growth) < 1)) return best;
  const double foot = dot(q, d) / l, away = sqrt(fmax(0, dot(q, q) - foot * foot));
  const double distance = away / sqrt(1 - growth * growth), at = foot + growth * distance;
  return at > 0 && at < l ? fmin(best, distance - a->r - growth * at) : best;
}

/* The gradient of the radius over a slab: the vector in its plane that gives the radii's differences along two sides.
 */
static vec radius_gradient(const sphere *a, const sphere *b, const sphere *c, vec normal) {
  const vec u = sub(b->c, a->c), v = sub(c->c, a->c);
  const double area = dot(normal, normal);
  return mix(mix((vec){0, 0, 0}, (b->r - a->r) / area, cross(v, normal)), (c->r - a->r) / area, cross(normal, u));
}

static double slab_value(const sphere *a, const sphere *b, const sphere *c, vec p) {
  const double best = fmin(cone_value(a, b, p), fmin(cone_value(b, c, p), cone_value(a, c, p)));
  const vec u = sub(b->c, a->c), v = sub(c->c, a->c), normal = cross(u, v), q = sub(p, a->c);
  const double area = dot(normal, normal);
  if (!(area > 1e-24 * dot(u, u) * dot(v, v))) return best;
  const vec g = radius_gradient(a, b, c, normal);
  const double steep = dot(g, g);
  if (!(steep < 1)) return best;
  const double height = fabs(dot(q, normal)) / sqrt(area), distance = height / sqrt(1 - steep);
  const vec foot = mix(q, -dot(q, normal) / area, normal), at = mix(foot, distance, g);
  const double s = dot(cross(at, v), normal) / area, t = dot(cross(u, at), normal) / area;
  if (s < 0 || t < 0 || s + t > 1) return best;
  return fmin(best, distance - a->r - dot(g, at));
}

static double simplex_value(const medial *m, const simplex *x, vec p) {
  const sphere *s = m->spheres;
  if (x->count == 1) return sphere_value(s + x->ids[0], p);
  if (x->count == 2) return cone_value(s + x->ids[0], s + x->ids[1], p);
  return slab_value(s + x->ids[0], s + x->ids[1], s + x->ids[2], p);
}

/* The signed distance to the nearest simplex. Simplices with a farther bounding box are skipped. */
static double envelope_value(const medial *m, vec p) {
  double best = INFINITY;
  for (size_t i = 0; i < m->simplex_count; i++) {
    const simplex *x = m->simplices + i;
    const sphere *first = m->spheres + x->ids[0];
    double reach = 0;
    for (int k = 0; k < x->count; k++) {
      const sphere *s = m->spheres + x->ids[k];
      reach = fmax(reach, length(sub(s->c, first->c)) + s->r);
    }
    if (length(sub(p, first->c)) - reach < best) best = fmin(best, simplex_value(m, x, p));
  }
  return best;
}

/* The weights of the point nearest to p in a triangle or segment of `count` corners. */
static double nearest_weights(const vec *corners, int count, vec p, double *weights) {
  double best = INFINITY, w[3];
  for (int side = 0; side < (count == 3 ? 3 : 1); side++) { /* the sides, or the one segment, or the one point */
    const int i = side, j = count == 1 ? side : (side + 1) % count;
    const vec d = sub(corners[j], corners[i]);
    const double l2 = dot(d, d), t = l2 > 0 ? fmin(1, fmax(0, dot(sub(p, corners[i]), d) / l2)) : 0;
    const double distance = length(sub(p, mix(corners[i], t, d)));
    if (distance >= best) continue;
    best = distance;
    weights[0] = weights[1] = weights[2] = 0;
    weights[i] += 1 - t;
    weights[j] += t;
  }
  if (count < 3) return best;
  const vec u = sub(corners[1], corners[0]), v = sub(corners[2], corners[0]), n = cross(u, v), q = sub(p, corners[0]);
  const double area = dot(n, n);
  if (!(area > 0)) return best;
  w[1] = dot(cross(q, v), n) / area;
  w[2] = dot(cross(u, q), n) / area;
  w[0] = 1 - w[1] - w[2];
  const double height = fabs(dot(q, n)) / sqrt(area);
  if (w[0] < 0 || w[1] < 0 || w[2] < 0 || height > best) return best;
  memcpy(weights, w, sizeof w);
  return height;
}

static void triangle_corners(const surface *s, size_t t, vec corners[3]) {
  for (size_t k = 0; k < 3; k++) corners[k] = s->vertices[s->triangles[3 * t + k]];
}

/* The distance to the surface; the search ends early at a distance of at most `enough`. */
static double surface_distance(const surface *s, vec p, double enough) {
  double best = INFINITY, weights[3];
  for (size_t t = 0; t < s->triangle_count && best > enough; t++) {
    vec c[3];
    triangle_corners(s, t, c);
    const double reach = fmax(length(sub(c[1], c[0])), length(sub(c[2], c[0])));
    if (length(sub(p, c[0])) - reach < best) best = fmin(best, nearest_weights(c, 3, p, weights));
  }
  return best;
}

/* The winding number of the surface around p: 1 inside, 0 outside (Van Oosterom and Strackee 1983). */
static double winding_number(const surface *s, vec p) {
  double sum = 0;
  for (size_t t = 0; t < s->triangle_count; t++) {
    vec c[3];
    triangle_corners(s, t, c);
    for (int k = 0; k < 3; k++) c[k] = sub(c[k], p);
    const double a = length(c[0]), b = length(c[1]), d = length(c[2]);
    sum += 2 * atan2(dot(c[0], cross(c[1], c[2])),
                     a * b * d + dot(c[0], c[1]) * d + dot(c[1], c[2]) * a + dot(c[2], c[0]) * b);
  }
  return sum / (4 * acos(-1));
}

/* ---- Samples ---- */

static uint64_t random_state = 88172645463325252U;

static double random_unit(void) {
  random_state ^= random_state << 13;
  random_state ^= random_state >> 7;
  random_state ^= random_state << 17;
  return (double)(random_state >> 11) * 0x1p-53;
}

static void random_weights(int count, double *w) {
  const double a = count == 1   ? 0
                   : count == 2 ? random_unit()
                                : sqrt(random_unit()),
               b = count == 3 ? random_unit() : 0;
  w[0] = 1 - a, w[1] = a * (1 - b), w[2] = a * b;
}

static double surface_to_envelope(const surface *s, const medial *m, size_t samples) {
  double worst = 0, area = 0;
  double *sums = need(calloc(s->triangle_count, sizeof *sums));
  for (size_t t = 0; t < s->triangle_count; t++) {
    vec c[3];
    triangle_corners(s, t, c);
    area += length(cross(sub(c[1], c[0]), sub(c[2], c[0])));
    sums[t] = area;
    worst = fmax(worst, envelope_value(m, c[0])); /* nearly every vertex is some triangle's first corner */
  }
  for (size_t i = 0; i < samples; i++) {
    size_t low = 0, high = s->triangle_count - 1;
    for (const double at = random_unit() * area; low < high;) {
      const size_t middle = (low + high) / 2;
      if (sums[middle] < at) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    vec c[3];
    double w[3];
    triangle_corners(s, low, c);
    random_weights(3, w);
    const vec p = mix(mix(mix((vec){0, 0, 0}, w[0], c[0]), w[1], c[1]), w[2], c[2]);
    worst = fmax(worst, envelope_value(m, p));
  }
  free(sums);
  return worst;
}

static vec random_direction(void) {
  const double z = 2 * random_unit() - 1, turn = 2 * acos(-1) * random_unit(), flat = sqrt(1 - z * z);
  return (vec){flat * cos(turn), flat * sin(turn), z};
}

/* A random point of the boundary of one simplex: of a tangent plane of a slab, a tangent line of a cone, or a sphere.
 * False where the slab has no tangent plane or the cone no tangent line. */
static bool random_boundary_point(const medial *m, const simplex *x, vec *p) {
  const sphere *s[3];
  double w[3], r = 0;
  vec c = {0, 0, 0}, direction = random_direction();
  for (int k = 0; k < 3; k++) s[k] = m->spheres + x->ids[k < x->count ? k : 0];
  random_weights(x->count, w);
  for (int k = 0; k < x->count; k++) {
    c = mix(c, w[k], s[k]->c);
    r += w[k] * s[k]->r;
  }
  vec lean = {0, 0, 0}; /* along the simplex: minus the gradient of the radius */
  if (x->count == 2) {
    const vec d = sub(s[1]->c, s[0]->c);
    const double l2 = dot(d, d);
    if (!(l2 > 0)) return false;
    lean = mix(lean, (s[0]->r - s[1]->r) / l2, d);
    direction = mix(direction, -dot(direction, d) / l2, d);
  } else if (x->count == 3) {
    const vec normal = cross(sub(s[1]->c, s[0]->c), sub(s[2]->c, s[0]->c));
    if (!(dot(normal, normal) > 0)) return false;
    lean = mix(lean, -1, radius_gradient(s[0], s[1], s[2], normal));
    direction = mix((vec){0, 0, 0}, direction.x < 0 ? -1 : 1, normal);
  }
  const double across = 1 - dot(lean, lean), size = length(direction);
  if (!(across >= 0) || !(size > 0)) return false;
  *p = mix(mix(c, r, lean), r * sqrt(across) / size, direction);
  return true;
}

/* A boundary point of a simplex is on the envelope's boundary where no other simplex contains it. */
static double envelope_to_surface(const surface *s, const medial *m, double diagonal, size_t samples) {
  double worst = 0;
  simplex *all = need(calloc(m->simplex_count + m->sphere_count + 1, sizeof *all));
  size_t count = 0;
  for (size_t i = 0; i < m->simplex_count; i++) {
    if (m->simplices[i].count > 1) all[count++] = m->simplices[i];
  }
  for (size_t i = 0; i < m->sphere_count; i++) all[count++] = (simplex){.ids = {(uint32_t)i}, .count = 1};
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < samples / count + 1; k++) {
      vec p;
      if (!random_boundary_point(m, all + i, &p) || envelope_value(m, p) < -1e-6 * diagonal) continue;
      worst = fmax(worst, surface_distance(s, p, worst));
    }
  }
  free(all);
  return worst;
}

/* ---- Checks ---- */

static int failures = 0;

static void fail(const char *what, double actual, double wanted) {
  fprintf(stderr, "qmat_judge: %s: %g, wanted %g\n", what, actual, wanted);
  failures++;
}

static size_t find_root(uint32_t *parents, size_t i) {
  while (parents[i] != i) i = parents[i] = parents[parents[i]];
  return i;
}

/* Checks the lists, prints their numbers, and adds the isolated spheres as simplices. */
static void judge_complex(medial *m, const double *components_wanted, const double *euler_wanted) {
  size_t bad = 0, degenerate = 0, twice = 0, missing = 0, components = 0;
  for (size_t i = 0; i < m->sphere_count; i++) {
    const sphere *s = m->spheres + i;
    if (!isfinite(s->c.x + s->c.y + s->c.z + s->r) || s->r < 0) bad++;
  }
  uint32_t *parents = need(calloc(m->sphere_count + 1, sizeof *parents));
  bool *used = need(calloc(m->sphere_count + 1, sizeof *used));
  for (size_t i = 0; i < m->sphere_count; i++) parents[i] = (uint32_t)i;
  for (size_t i = 0; i < m->simplex_count; i++) {
    const simplex *x = m->simplices + i;
    if (x->ids[x->count - 1] >= m->sphere_count) stop("medial mesh", "an index is out of range");
    for (int k = 0; k + 1 < x->count; k++) {
      if (x->ids[k] == x->ids[k + 1]) degenerate++;
      parents[find_root(parents, x->ids[k])] = (uint32_t)find_root(parents, x->ids[k + 1]);
    }
    for (int k = 0; k < x->count; k++) used[x->ids[k]] = true;
  }
  qsort(m->simplices, m->simplex_count, sizeof *m->simplices, compare_simplices);
  for (size_t i = 1; i < m->simplex_count; i++) twice += compare_simplices(m->simplices + i - 1, m->simplices + i) == 0;
  for (size_t i = 0; i < m->simplex_count; i++) {
    const simplex *x = m->simplices + i;
    for (int k = 0; k < 3 && x->count == 3; k++) {
      const uint32_t side[2] = {x->ids[k == 2 ? 0 : k], x->ids[k == 2 ? 2 : k + 1]};
      const simplex key = sorted_simplex(side, 2);
      if (bsearch(&key, m->simplices, m->listed_edges, sizeof key, compare_simplices) == NULL) missing++;
    }
  }
  for (size_t i = 0; i < m->sphere_count; i++) {
    components += find_root(parents, i) == i;
    if (!used[i]) m->simplices[m->simplex_count++] = (simplex){.ids = {(uint32_t)i}, .count = 1};
  }
  free(parents);
  free(used);
  const double euler = (double)m->sphere_count - (double)m->listed_edges + (double)m->triangle_count;
  printf("spheres %zu\nedges %zu\ntriangles %zu\ncomponents %zu\neuler %.0f\n", m->sphere_count, m->listed_edges,
         m->triangle_count, components, euler);
  if (m->sphere_count == 0) fail("spheres", 0, 1);
  if (bad > 0) fail("spheres that are not finite or have a negative radius", (double)bad, 0);
  if (degenerate > 0) fail("degenerate edges or triangles", (double)degenerate, 0);
  if (twice > 0) fail("edges or triangles that are there twice", (double)twice, 0);
  if (missing > 0) fail("sides of triangles that are not listed as edges", (double)missing, 0);
  if (components_wanted && (double)components != *components_wanted) {
    fail("components", (double)components, *components_wanted);
  }
  if (euler_wanted && euler != *euler_wanted) fail("Euler characteristic", euler, *euler_wanted);
}

static void judge_centres(const surface *s, const medial *m, double diagonal) {
  size_t outside = 0;
  for (size_t i = 0; i < m->sphere_count; i++) {
    const vec c = m->spheres[i].c;
    outside += !(winding_number(s, c) > 0.5) && surface_distance(s, c, 0) > 1e-6 * diagonal;
  }
  printf("centres_outside %zu\n", outside);
  if (outside > 0) fail("centres outside the surface", (double)outside, 0);
}

/* The largest distance of a sphere from the true medial mesh: of its centre or of its radius, whichever is larger. */
static void judge_known(const medial *m, const medial *known, double diagonal, double near) {
  double worst = 0;
  for (size_t i = 0; i < m->sphere_count; i++) {
    double best = INFINITY;
    for (size_t k = 0; k < known->simplex_count; k++) {
      const simplex *x = known->simplices + k;
      vec corners[3];
      double weights[3] = {1, 0, 0}, radius = 0;
      for (int j = 0; j < x->count; j++) corners[j] = known->spheres[x->ids[j]].c;
      const double distance = nearest_weights(corners, x->count, m->spheres[i].c, weights);
      for (int j = 0; j < x->count; j++) radius += weights[j] * known->spheres[x->ids[j]].r;
      best = fmin(best, fmax(distance, fabs(radius - m->spheres[i].r)));
    }
    worst = fmax(worst, best / diagonal);
  }
  printf("from_known %.6f\n", worst);
  if (!(worst <= near)) fail("distance of a sphere from the true medial mesh", worst, near);
}

/* "0.01" or "1%". */
static double fraction(const char *text) {
  char *end;
  const double value = strtod(text, &end);
  const bool percent = *end == '%';
  if (end == text || end[percent] != 0 || !isfinite(value)) stop(text, "not a number");
  return percent ? value / 100 : value;
}

int main(int argc, char **argv) {
  if (argc < 3) {
    fputs(usage, stderr);
    return 2;
  }
  double within = INFINITY, near = 0, components = 0, euler = 0, samples = 20000;
  const char *known_path = NULL;
  bool check_components = false, check_euler = false;
  for (int i = 3; i < argc; i += 2) {
    const char *value = i + 1 < argc ? argv[i + 1] : "";
    if (strcmp(argv[i], "--within") == 0) {
      within = fraction(value);
    } else if (strcmp(argv[i], "--near") == 0) {
      near = fraction(value);
    } else if (strcmp(argv[i], "--known") == 0) {
      known_path = value;
    } else if (strcmp(argv[i], "--samples") == 0) {
      samples = fraction(value);
    } else if (strcmp(argv[i], "--components") == 0) {
      components = fraction(value);
      check_components = true;
    } else if (strcmp(argv[i], "--euler") == 0) {
      euler = fraction(value);
      check_euler = true;
    } else {
      stop(argv[i], "no such check");
    }
  }
  surface s = read_surface(argv[1]);
  medial m = read_medial(argv[2]);
  vec low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * s.triangle_count; i++) {
    const vec p = s.vertices[s.triangles[i]];
    low = (vec){fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z)};
    high = (vec){fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z)};
  }
  const double diagonal = length(sub(high, low));
  judge_complex(&m, check_components ? &components : NULL, check_euler ? &euler : NULL);
  judge_centres(&s, &m, diagonal);
  if (known_path) {
    medial known = read_medial(known_path);
    if (known.simplex_count == 0) known.simplices[known.simplex_count++] = (simplex){.ids = {0}, .count = 1};
    judge_known(&m, &known, diagonal, near);
    free(known.spheres);
    free(known.simplices);
  }
  const double out = surface_to_envelope(&s, &m, (size_t)samples) / diagonal;
  const double in = envelope_to_surface(&s, &m, diagonal, (size_t)samples) / diagonal;
  printf("surface_to_envelope %.6f\nenvelope_to_surface %.6f\n", out, in);
  if (!(out <= within)) fail("surface to envelope", out, within);
  if (!(in <= within)) fail("envelope to surface", in, within);
  free(s.vertices);
  free(s.triangles);
  free(m.spheres);
  free(m.simplices);
  return failures > 0;
}
