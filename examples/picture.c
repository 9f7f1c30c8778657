/* SPDX-License-Identifier: GPL-3.0-or-later */
/* qmat_picture: draws a surface (.off) and its medial mesh (.ma) as an SVG, in parallel projection. The surface is
 * shaded. The medial mesh is drawn over it: slabs as triangles, cones as lines, spheres as circles. */
#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "usage: qmat_picture MODEL.off [MEDIAL.ma] -o PICTURE.svg [--turn DEGREES] [--tilt DEGREES] [--width PIXELS]\n"
    "                    [--surface yes|no] [--spheres yes|no]\n";

typedef struct mesh {
  size_t vertex_count, edge_count, triangle_count;
  double *vertices; /* 4 each: x y z radius; radius 0 for a surface */
  uint32_t *edges, *triangles;
} mesh;

/* One element of the drawing. Later ones cover earlier ones. */
typedef struct shape {
  double depth;
  uint32_t index;
  char kind; /* 'f' facet of the surface, 't' slab, 'e' cone, 's' sphere */
} shape;

typedef struct view {
  double right[3], up[3], towards[3];
  double scale, x, y; /* pixel = scale * coordinate + offset */
} view;

static int complain(const char *path, const char *what) {
  fprintf(stderr, "qmat_picture: %s: %s\n", path, what);
  return 1;
}

static void mesh_free(mesh *m) {
  free(m->vertices);
  free(m->edges);
  free(m->triangles);
  *m = (mesh){0};
}

/* Allocates what the header counts. An element takes at least one byte, so larger counts are refused. */
static int mesh_make(mesh *m, long bytes, const char *path) {
  const size_t most = bytes < 0 ? 0 : (size_t)bytes;
  if (m->vertex_count > most || m->edge_count > most || m->triangle_count > most) {
    return complain(path, "the header counts more than the file holds");
  }
  m->vertices = calloc(m->vertex_count + 1, 4 * sizeof *m->vertices);
  m->edges = calloc(m->edge_count + 1, 2 * sizeof *m->edges);
  m->triangles = calloc(m->triangle_count + 1, 3 * sizeof *m->triangles);
  return !m->vertices || !m->edges || !m->triangles ? complain(path, "out of memory") : 0;
}

static int check_indices(const mesh *m, const char *path) {
  bool good = true;
  for (size_t i = 0; i < 2 * m->edge_count; i++) good = good && m->edges[i] < m->vertex_count;
  for (size_t i = 0; i < 3 * m->triangle_count; i++) good = good && m->triangles[i] < m->vertex_count;
  for (size_t i = 0; i < 4 * m->vertex_count; i++) good = good && isfinite(m->vertices[i]);
  return good ? 0 : complain(path, "an index or a number is out of range");
}

static int read_file(const char *path, bool medial, mesh *m) {
  *m = (mesh){0};
  FILE *file = fopen(path, "r");
  if (!file) return complain(path, strerror(errno));
  fseek(file, 0, SEEK_END);
  const long bytes = ftell(file);
  rewind(file);
  bool good;
  if (medial) {
    good = fscanf(file, "%zu %zu %zu", &m->vertex_count, &m->edge_count, &m->triangle_count) == 3;
  } else {
    good = fscanf(file, "OFF %zu %zu %*u", &m->vertex_count, &m->triangle_count) == 2;
  }
  int failed = good ? mesh_make(m, bytes, path) : complain(path, "not the header of such a file");
  if (failed == 0) {
    for (size_t i = 0; i < m->vertex_count && good; i++) {
      double *v = m->vertices + 4 * i;
      good = medial ? fscanf(file, " v %lf %lf %lf %lf", v, v + 1, v + 2, v + 3) == 4
                    : fscanf(file, "%lf %lf %lf", v, v + 1, v + 2) == 3;
    }
    for (size_t i = 0; i < m->edge_count && good; i++) {
      good = fscanf(file, " e %u %u", m->edges + 2 * i, m->edges + 2 * i + 1) == 2;
    }
    for (size_t i = 0; i < m->triangle_count && good; i++) {
      uint32_t *t = m->triangles + 3 * i;
      good = fscanf(file, medial ? " f %u %u %u" : " 3 %u %u %u", t, t + 1, t + 2) == 3;
    }
    failed = good ? check_indices(m, path) : complain(path, "cannot be read to its end (only triangles are drawn)");
  }
  fclose(file);
  if (failed) mesh_free(m);
  return failed;
}

static double along(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The view of a model turned about z by `turn` degrees and seen from `tilt` degrees above the horizon; z points up. */
static view make_view(double turn, double tilt) {
  const double a = turn * acos(-1) / 180, b = tilt * acos(-1) / 180;
  return (view){.right = {cos(a), sin(a), 0},
                .up = {-sin(a) * sin(b), cos(a) * sin(b), cos(b)},
                .towards = {sin(a) * cos(b), -cos(a) * cos(b), sin(b)},
                .scale = 1};
}

static void fit(view *v, const mesh *surface, const mesh *medial, double width, double *height) {
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
  const mesh *both[2] = {surface, medial};
  for (int m = 0; m < 2; m++) {
    for (size_t i = 0; i < both[m]->vertex_count; i++) {
      const double *p = both[m]->vertices + 4 * i, at[2] = {along(p, v->right), along(p, v->up)};
      for (int k = 0; k < 2; k++) {
        low[k] = fmin(low[k], at[k] - p[3]);
        high[k] = fmax(high[k], at[k] + p[3]);
      }
    }
  }
  const double margin = 0.03 * width, wide = fmax(high[0] - low[0], 1e-300), tall = fmax(high[1] - low[1], 1e-300);
  v->scale = fmin((width - 2 * margin) / wide, (0.75 * width - 2 * margin) / tall);
  *height = tall * v->scale + 2 * margin;
  v->x = (width - v->scale * (low[0] + high[0])) / 2;
  v->y = margin + v->scale * high[1];
}

static void project(const view *v, const double *p, double *x, double *y) {
  *x = v->scale * along(p, v->right) + v->x;
  *y = v->y - v->scale * along(p, v->up);
}

static double depth_of(const view *v, const mesh *m, const uint32_t *ids, int count) {
  double sum = 0;
  for (int k = 0; k < count; k++) sum += along(m->vertices + 4 * (size_t)ids[k], v->towards) / count;
  return sum;
}

/* The unit normal of a triangle; false when it has no area. */
static bool normal_of(const mesh *m, const uint32_t *t, double n[3]) {
  const double *a = m->vertices + 4 * (size_t)t[0], *b = m->vertices + 4 * (size_t)t[1];
  const double *c = m->vertices + 4 * (size_t)t[2];
  double u[3], w[3];
  for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], w[k] = c[k] - a[k];
  for (int k = 0; k < 3; k++) n[k] = u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3];
  const double length = sqrt(along(n, n));
  for (int k = 0; k < 3; k++) n[k] /= length;
  return length > 0;
}

static int compare_shapes(const void *left, const void *right) {
  const shape *a = left, *b = right;
  if ((a->kind == 'f') != (b->kind == 'f')) return a->kind == 'f' ? -1 : 1; /* the surface first */
  if (a->depth != b->depth) return a->depth < b->depth ? -1 : 1;
  if (a->kind != b->kind) return a->kind - b->kind;
  return a->index < b->index ? -1 : a->index > b->index;
}

/* Interpolates two colours by the brightness of a facet with the normal n. One lamp is at the upper left. */
static void shade(const view *v, const double n[3], const int dark[3], const int bright[3], int colour[3]) {
  double lamp[3];
  for (int k = 0; k < 3; k++) lamp[k] = (0.75 * v->towards[k] + 0.5 * v->up[k] - 0.43 * v->right[k]) / 0.9987;
  const double light = fmax(0, along(n, lamp)), part = 0.15 + 0.85 * light;
  for (int k = 0; k < 3; k++) colour[k] = (int)lround(dark[k] + (bright[k] - dark[k]) * part);
}

static void paint_triangle(FILE *out, const view *v, const mesh *m, const uint32_t *t, const int colour[3],
                           double opacity) {
  double x[3], y[3];
  for (int k = 0; k < 3; k++) project(v, m->vertices + 4 * (size_t)t[k], x + k, y + k);
  fprintf(out, "<path d='M%.1f %.1fL%.1f %.1f %.1f %.1fz' ", x[0], y[0], x[1], y[1], x[2], y[2]);
  /* without a stroke the seams between opaque triangles show */
  if (opacity >= 1) {
    fprintf(out, "fill='#%02x%02x%02x' stroke='#%02x%02x%02x'/>\n", (unsigned)colour[0], (unsigned)colour[1],
            (unsigned)colour[2], (unsigned)colour[0], (unsigned)colour[1], (unsigned)colour[2]);
  } else {
    fprintf(out, "fill='#%02x%02x%02x' fill-opacity='%.2f'/>\n", (unsigned)colour[0], (unsigned)colour[1],
            (unsigned)colour[2], opacity);
  }
}

static void paint(FILE *out, const view *v, const mesh *surface, const mesh *medial, const shape *s) {
  static const int stone_dark[2][3] = {{96, 110, 128}, {150, 164, 182}};
  static const int stone_bright[2][3] = {{240, 244, 250}, {250, 252, 255}};
  static const int slab_dark[3] = {190, 84, 20}, slab_bright[3] = {255, 190, 96};
  double n[3] = {0, 0, 1};
  int colour[3];
  if (s->kind == 'f') {
    const uint32_t *t = surface->triangles + 3 * (size_t)s->index;
    const int pale = medial->vertex_count > 0;
    if (!normal_of(surface, t, n)) return;
    shade(v, n, stone_dark[pale], stone_bright[pale], colour);
    paint_triangle(out, v, surface, t, colour, 1);
  } else if (s->kind == 't') {
    const uint32_t *t = medial->triangles + 3 * (size_t)s->index;
    if (!normal_of(medial, t, n)) return;
    if (along(n, v->towards) < 0) {
      for (int k = 0; k < 3; k++) n[k] = -n[k];
    }
    shade(v, n, slab_dark, slab_bright, colour);
    paint_triangle(out, v, medial, t, colour, 0.6);
  } else if (s->kind == 'e') {
    const uint32_t *e = medial->edges + 2 * (size_t)s->index;
    double x[2], y[2];
    for (int k = 0; k < 2; k++) project(v, medial->vertices + 4 * (size_t)e[k], x + k, y + k);
    fprintf(out, "<path d='M%.1f %.1fL%.1f %.1f' class='e'/>\n", x[0], y[0], x[1], y[1]);
  } else {
    const double *p = medial->vertices + 4 * (size_t)s->index;
    double x, y;
    project(v, p, &x, &y);
    fprintf(out, "<circle cx='%.1f' cy='%.1f' r='%.1f' class='s'/><circle cx='%.1f' cy='%.1f' r='2.2' class='c'/>\n", x,
            y, fmax(v->scale * p[3], 0.5), x, y);
  }
}

/* All elements, from back to front. NULL when memory runs out; the caller frees the array. */
static shape *collect(const view *v, const mesh *surface, const mesh *medial, bool with_spheres, size_t *count) {
  shape *all = calloc(surface->triangle_count + medial->vertex_count + medial->edge_count + medial->triangle_count + 1,
                      sizeof *all);
  if (!all) return NULL;
  size_t n = 0;
  for (uint32_t i = 0; i < surface->triangle_count; i++) {
    const uint32_t *t = surface->triangles + 3 * (size_t)i;
    double normal[3];
    if (!normal_of(surface, t, normal) || along(normal, v->towards) <= 0) continue;
    all[n++] = (shape){depth_of(v, surface, t, 3), i, 'f'};
  }
  for (uint32_t i = 0; i < medial->triangle_count; i++) {
    all[n++] = (shape){depth_of(v, medial, medial->triangles + 3 * (size_t)i, 3), i, 't'};
  }
  for (uint32_t i = 0; i < medial->edge_count; i++) {
    all[n++] = (shape){depth_of(v, medial, medial->edges + 2 * (size_t)i, 2), i, 'e'};
  }
  for (uint32_t i = 0; i < medial->vertex_count && with_spheres; i++) {
    all[n++] = (shape){depth_of(v, medial, &i, 1), i, 's'};
  }
  qsort(all, n, sizeof *all, compare_shapes);
  *count = n;
  return all;
}

static int write_picture(const char *path, view *v, double width, const mesh *surface, const mesh *medial,
                         bool with_spheres) {
  double height;
  size_t count = 0;
  fit(v, surface, medial, width, &height);
  shape *all = collect(v, surface, medial, with_spheres, &count);
  if (!all) return complain(path, "out of memory");
  FILE *out = fopen(path, "w");
  int failed = 0;
  if (!out) {
    failed = complain(path, strerror(errno));
  } else {
    fprintf(out,
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 %.0f %.0f' stroke-linejoin='round' "
            "stroke-width='.6'>\n<style>.e{stroke:#8a3a06;stroke-width:1.6;stroke-linecap:round;fill:none}"
            ".s{fill:#ffb454;fill-opacity:.16;stroke:#b4540a;stroke-opacity:.45}.c{fill:#8a3a06}</style>\n",
            width, height);
    for (size_t i = 0; i < count; i++) paint(out, v, surface, medial, all + i);
    fputs("</svg>\n", out);
    failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed) failed = complain(path, strerror(errno));
  }
  free(all);
  return failed;
}

static bool number(const char *text, double low, double high, double *value) {
  char *end;
  *value = strtod(text, &end);
  return *text != 0 && *end == 0 && *value >= low && *value <= high;
}

int main(int argc, char **argv) {
  const char *names[2] = {NULL, NULL}, *output = NULL;
  double turn = 30, tilt = 25, width = 640;
  bool with_spheres = true, with_surface = true;
  int name_count = 0;
  for (int i = 1; i < argc; i++) {
    const char *word = argv[i], *value = i + 1 < argc ? argv[i + 1] : "";
    bool good = false;
    if (word[0] != '-') {
      good = name_count < 2;
      if (good) names[name_count++] = word;
      if (good) continue;
    } else if (strcmp(word, "-o") == 0) {
      good = *value != 0;
      output = value;
    } else if (strcmp(word, "--turn") == 0) {
      good = number(value, -360, 360, &turn);
    } else if (strcmp(word, "--tilt") == 0) {
      good = number(value, -90, 90, &tilt);
    } else if (strcmp(word, "--width") == 0) {
      good = number(value, 16, 8192, &width);
    } else if (strcmp(word, "--spheres") == 0 || strcmp(word, "--surface") == 0) {
      const bool yes = strcmp(value, "yes") == 0;
      good = yes || strcmp(value, "no") == 0;
      *(word[3] == 'p' ? &with_spheres : &with_surface) = yes;
    }
    if (!good) {
      fprintf(stderr, "qmat_picture: invalid option or value '%s %s'\n%s", word, value, usage);
      return 2;
    }
    i++;
  }
  if (!names[0] || !output) {
    fputs(usage, stderr);
    return 2;
  }
  mesh surface = {0}, medial = {0};
  int failed = read_file(names[0], false, &surface);
  if (failed == 0 && names[1]) failed = read_file(names[1], true, &medial);
  if (failed == 0) {
    if (!with_surface) surface.triangle_count = 0;
    view v = make_view(turn, tilt);
    failed = write_picture(output, &v, width, &surface, &medial, with_spheres);
  }
  mesh_free(&surface);
  mesh_free(&medial);
  return failed;
}
