/* SPDX-License-Identifier: GPL-3.0-or-later */
/* qmat_scale: the time and memory of `qmat mat` for models of some ten thousand and of a million triangles, as one JSON
 * object.
 *
 *   qmat_scale QMAT FOLDER [MODEL...]
 *
 * QMAT is the program to measure; FOLDER is for temporary files. Every model is measured. The first one is measured
 * again with its triangles divided into four until there are about a million. The default model is a generated octopus.
 */
#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/geometry/thickness.h"
#include "examples/models.h"
#include "io/model.h"
#include "nodes/initial/sample_thinning.h"
#include "nodes/initial/voronoi_dual_params.h"
#include "nodes/nodes.h"
#include "tests/bench/plain_delaunay_cgal.h"

enum { MILLION = 1000000, GENERATED_RESOLUTION = 40 };

static void complain(const char *what, const char *why) {
  fprintf(stderr, "qmat_scale: %s: %s\n", what, why);
}

static void complain_of(const qmat_context *context) {
  char message[2048];
  qmat_error_format(&context->error, message, sizeof message);
  fprintf(stderr, "qmat_scale: %s\n", message);
}

/* --- models ------------------------------------------------------------------------------------------------------- */

static int write_surface(const char *path, const double *positions, size_t vertex_count, const uint32_t *triangles,
                         size_t triangle_count) {
  FILE *file = fopen(path, "w");
  if (!file) {
    complain(path, strerror(errno));
    return 1;
  }
  fprintf(file, "OFF\n%zu %zu 0\n", vertex_count, triangle_count);
  for (size_t i = 0; i < vertex_count; i++)
    fprintf(file, "%.17g %.17g %.17g\n", positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
  for (size_t i = 0; i < triangle_count; i++)
    fprintf(file, "3 %u %u %u\n", triangles[3 * i], triangles[3 * i + 1], triangles[3 * i + 2]);
  const int failed = ferror(file);
  if (fclose(file) == 0 && !failed) return 0;
  complain(path, strerror(errno));
  return 1;
}

typedef struct side {
  uint32_t low, high;
  size_t corner; /* 3 * triangle + k, for the side from corner k to the next */
} side;

static int compare_sides(const void *left, const void *right) {
  const side *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  if (a->high != b->high) return a->high < b->high ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

typedef struct surface {
  size_t vertex_count, triangle_count;
  double *positions;
  uint32_t *triangles;
} surface;

/* Divides each triangle into four at the middles of its sides. Replaces the arrays of `s`. */
static int subdivide(surface *s) {
  const size_t corners = 3 * s->triangle_count;
  side *sides = malloc(corners * sizeof *sides);
  uint32_t *middles = malloc(corners * sizeof *middles);
  double *positions = malloc(3 * (s->vertex_count + corners) * sizeof *positions);
  uint32_t *triangles = malloc(4 * corners * sizeof *triangles);
  if (!sides || !middles || !positions || !triangles) {
    complain("subdivision", "out of memory");
    free(sides), free(middles), free(positions), free(triangles);
    return 1;
  }
  for (size_t i = 0; i < corners; i++) {
    const uint32_t a = s->triangles[i], b = s->triangles[i % 3 == 2 ? i - 2 : i + 1];
    sides[i] = (side){a < b ? a : b, a < b ? b : a, i};
  }
  qsort(sides, corners, sizeof *sides, compare_sides);
  memcpy(positions, s->positions, 3 * s->vertex_count * sizeof *positions);
  size_t count = s->vertex_count;
  for (size_t i = 0; i < corners; i++) {
    if (i == 0 || sides[i].low != sides[i - 1].low || sides[i].high != sides[i - 1].high) {
      for (size_t k = 0; k < 3; k++)
        positions[3 * count + k] =
            0.5 * (s->positions[3 * (size_t)sides[i].low + k] + s->positions[3 * (size_t)sides[i].high + k]);
      count++;
    }
    middles[sides[i].corner] = (uint32_t)(count - 1);
  }
  for (size_t t = 0; t < s->triangle_count; t++) {
    const uint32_t *c = &s->triangles[3 * t], *m = &middles[3 * t];
    const uint32_t parts[12] = {c[0], m[0], m[2], m[0], c[1], m[1], m[2], m[1], c[2], m[0], m[1], m[2]};
    memcpy(&triangles[12 * t], parts, sizeof parts);
  }
  free(sides), free(middles), free(s->positions), free(s->triangles);
  *s = (surface){count, 4 * s->triangle_count, positions, triangles};
  return 0;
}

/* Writes the model `from` to `to`, with its triangles divided into about a million. */
static int write_million(const char *from, const char *to) {
  qmat_context context = {0};
  qmat_scene *scene;
  qmat_mesh *mesh;
  qmat_report *report;
  const qmat_read_options options = {0};
  if (qmat_model_read(&context, from, &options, &scene, &mesh, &report) != QMAT_OK) {
    complain_of(&context);
    qmat_context_uninit(&context);
    return 1;
  }
  surface s = {mesh->vertex_count, mesh->triangle_count, malloc(3 * mesh->vertex_count * sizeof(double)),
               malloc(3 * mesh->triangle_count * sizeof(uint32_t))};
  int failed = s.positions == NULL || !s.triangles;
  if (!failed) {
    memcpy(s.positions, mesh->positions, 3 * s.vertex_count * sizeof(double));
    memcpy(s.triangles, mesh->triangles, 3 * s.triangle_count * sizeof(uint32_t));
  }
  qmat_value_release(&scene->base);
  qmat_value_release(&mesh->base);
  qmat_value_release(&report->base);
  qmat_context_uninit(&context);
  while (!failed && 2 * s.triangle_count < MILLION) failed = subdivide(&s);
  if (!failed) failed = write_surface(to, s.positions, s.vertex_count, s.triangles, s.triangle_count);
  free(s.positions);
  free(s.triangles);
  return failed;
}

static int write_generated(const char *path) {
  qmat_model model;
  if (qmat_model_make("octopus", GENERATED_RESOLUTION, &model) != QMAT_OK) {
    complain("octopus", "cannot be made");
    return 1;
  }
  const int failed = write_surface(path, model.positions, model.vertex_count, model.triangles, model.triangle_count);
  qmat_model_uninit(&model);
  return failed;
}

/* --- measuring ---------------------------------------------------------------------------------------------------- */

static double seconds_of(struct timeval time) {
  return (double)time.tv_sec + 1e-6 * (double)time.tv_usec;
}

/* Runs `qmat mat` and stores its resource usage in `usage`. */
static int run_qmat(const char *qmat, const char *model, const char *asset, const char *report, struct rusage *usage) {
  const pid_t child = fork();
  if (child == 0) {
    execl(qmat, qmat, "mat", model, "-o", asset, "--report", report, "--no-cache", "--quiet", "--progress", "off",
          (char *)NULL);
    complain(qmat, strerror(errno));
    _exit(127);
  }
  int status;
  if (child < 0 || wait4(child, &status, 0, usage) != child) {
    complain(qmat, strerror(errno));
    return 1;
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return 0;
  complain(model, "qmat mat failed");
  return 1;
}

/* Runs a node with its default parameters; `outputs` is that of qmat_node_run. */
static qmat_status run_node(qmat_context *context, const char *name, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  double params[32]; /* for its alignment */
  const qmat_node *node = qmat_node_find(name);
  if (!node || node->params_size > sizeof params)
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "there is no node %s", name);
  qmat_params_default(node, params);
  return qmat_node_run(context, node, params, inputs, outputs);
}

static double detail_of_delaunay(void) {
  return QMAT_FINE_EPSILON * qmat_param_find(qmat_node_find("medial.delaunay"), "thinning_tolerance")->default_number;
}

/* The seconds of CGAL's triangulation of the samples that medial.delaunay triangulates, and of all samples. */
static qmat_status time_cgal(qmat_context *context, const qmat_mesh *mesh, const qmat_field *thickness,
                             const qmat_samples *samples, double seconds[2]) {
  qmat_surface *surface;
  qmat_status status = qmat_surface_new(context, mesh, &surface);
  if (status != QMAT_OK) return status;
  double *points = qmat_arena_alloc(&context->arena, samples->count, 3 * sizeof *points);
  double *values = qmat_arena_alloc(&context->arena, samples->count, sizeof *values);
  uint32_t *representatives = qmat_arena_alloc(&context->arena, samples->count, sizeof *representatives);
  if (!points || !values || !representatives) {
    status = qmat_fail_memory(context, "samples");
  } else {
    qmat_frame_to_unit(qmat_surface_frame(surface), samples->positions, samples->count, points);
    qmat_thickness_of_samples(mesh, thickness, samples, values);
    status = qmat_representatives_find(context, surface, samples, points, values, detail_of_delaunay(), NULL,
                                       representatives);
  }
  if (status == QMAT_OK) {
    seconds[1] = qmat_plain_delaunay_seconds(points, samples->count);
    size_t kept = 0;
    for (size_t i = 0; i < samples->count; i++)
      if (representatives[i] == i) memmove(&points[3 * kept++], &points[3 * i], 3 * sizeof *points);
    seconds[0] = qmat_plain_delaunay_seconds(points, kept);
    if (!(seconds[0] > 0 && seconds[1] > 0)) status = qmat_fail(context, QMAT_ERROR_DEPENDENCY, "CGAL failed");
  }
  qmat_surface_free(surface);
  return status;
}

static int time_delaunay(const char *model, double seconds[2]) {
  qmat_context context = {0};
  const qmat_read_options options = {0};
  qmat_scene *scene = NULL;
  qmat_mesh *mesh = NULL;
  qmat_report *report = NULL;
  qmat_value *thickness[8] = {NULL}, *samples[8] = {NULL};
  qmat_status status = qmat_model_read(&context, model, &options, &scene, &mesh, &report);
  if (status == QMAT_OK) status = run_node(&context, "mesh.sdf", (const qmat_value *[]){&mesh->base}, thickness);
  if (status == QMAT_OK)
    status = run_node(&context, "mesh.sample", (const qmat_value *[]){&mesh->base, thickness[0]}, samples);
  if (status == QMAT_OK)
    status = time_cgal(&context, mesh, (const qmat_field *)thickness[0], (const qmat_samples *)samples[0], seconds);
  if (status != QMAT_OK) complain_of(&context);
  for (int i = 0; i < 8; i++) qmat_value_release(thickness[i]), qmat_value_release(samples[i]);
  qmat_value_release(scene ? &scene->base : NULL);
  qmat_value_release(mesh ? &mesh->base : NULL);
  qmat_value_release(report ? &report->base : NULL);
  qmat_context_uninit(&context);
  return status != QMAT_OK;
}

static json_t *rounded(double number) {
  char text[32];
  snprintf(text, sizeof text, "%.4g", number);
  return json_real(strtod(text, NULL));
}

/* The row of one model, from the report of its run; NULL when the report cannot be read. */
static json_t *make_row(const char *model, const json_t *report, const struct rusage *usage, const double cgal[2]) {
  json_t *row = json_object(), *stages = json_object();
  const json_t *node, *made;
  double initialisation = 0, decimation = 0, vertices = 0;
  size_t i;
  const char *base = strrchr(model, '/');
  json_object_set_new(row, "model", json_string(base != NULL ? base + 1 : model));
  json_array_foreach(json_object_get(report, "nodes"), i, node) {
    const char *type = json_string_value(json_object_get(node, "type"));
    const double seconds = json_number_value(json_object_get(node, "seconds"));
    if (!type) continue;
    json_object_set_new(stages, type, rounded(seconds));
    made = json_object_get(node, "report");
    if (strcmp(type, "scene.read") == 0) {
      json_object_set(row, "triangles", json_object_get(made, "triangles"));
      json_object_set(row, "vertices", json_object_get(made, "vertices"));
      vertices = json_number_value(json_object_get(made, "vertices"));
    }
    if (strcmp(type, "mesh.sdf") == 0 || strcmp(type, "mesh.sample") == 0 || strcmp(type, "medial.delaunay") == 0)
      initialisation += seconds;
    if (strcmp(type, "medial.delaunay") == 0) {
      json_object_set(row, "samples", json_object_get(made, "samples"));
      json_object_set(row, "samples_triangulated", json_object_get(made, "samples_triangulated"));
      json_object_set(row, "initial_spheres", json_object_get(made, "spheres"));
    }
    if (strcmp(type, "medial.simplify") == 0) {
      decimation = seconds;
      json_object_set(row, "spheres", json_object_get(made, "spheres"));
      json_object_set(row, "collapses", json_object_get(made, "collapses"));
      json_object_set(row, "surface_to_envelope", json_object_get(made, "surface_to_envelope"));
      json_object_set(row, "envelope_to_surface", json_object_get(made, "envelope_to_surface"));
    }
  }
  const double seconds = json_number_value(json_object_get(report, "seconds"));
  const double collapses = json_number_value(json_object_get(row, "collapses"));
  json_object_set_new(row, "seconds", rounded(seconds));
  json_object_set_new(row, "cpu_seconds", rounded(seconds_of(usage->ru_utime) + seconds_of(usage->ru_stime)));
  json_object_set_new(row, "peak_megabytes", rounded((double)usage->ru_maxrss / 1024));
  json_object_set_new(row, "microseconds_per_vertex", rounded(vertices > 0 ? 1e6 * seconds / vertices : 0));
  json_object_set_new(row, "collapses_per_second", rounded(decimation > 0 ? collapses / decimation : 0));
  json_object_set_new(row, "microseconds_per_collapse", rounded(collapses > 0 ? 1e6 * decimation / collapses : 0));
  json_object_set_new(row, "initialisation_seconds", rounded(initialisation));
  json_object_set_new(row, "cgal_delaunay_seconds", rounded(cgal[0]));
  json_object_set_new(row, "cgal_delaunay_of_all_samples_seconds", rounded(cgal[1]));
  json_object_set_new(row, "initialisation_over_cgal", rounded(initialisation / cgal[0]));
  json_object_set_new(row, "initialisation_over_cgal_of_all_samples", rounded(initialisation / cgal[1]));
  json_object_set_new(row, "stage_seconds", stages);
  return row;
}

/* Measures one model and appends its row. */
static int measure(const char *qmat, const char *folder, const char *model, json_t *rows) {
  char asset[4096], report_path[4096];
  if ((size_t)snprintf(asset, sizeof asset, "%s/scale.glb", folder) >= sizeof asset ||
      (size_t)snprintf(report_path, sizeof report_path, "%s/scale.json", folder) >= sizeof report_path) {
    complain(folder, "the name is too long");
    return 1;
  }
  struct rusage usage;
  double cgal[2] = {0, 0};
  if (run_qmat(qmat, model, asset, report_path, &usage) != 0) return 1;
  if (time_delaunay(model, cgal) != 0) return 1;
  json_error_t error;
  json_t *report = json_load_file(report_path, 0, &error);
  if (!report) {
    complain(report_path, error.text);
    return 1;
  }
  json_array_append_new(rows, make_row(model, report, &usage, cgal));
  json_decref(report);
  return 0;
}

static double microseconds_per_vertex(const json_t *rows, size_t row) {
  return json_number_value(json_object_get(json_array_get(rows, row), "microseconds_per_vertex"));
}

int main(int argc, char **argv) {
  if (argc < 3) {
    fputs("usage: qmat_scale QMAT FOLDER [MODEL...]\n", stderr);
    return 2;
  }
  const char *qmat = argv[1], *folder = argv[2];
  char generated[4096], million[4096];
  if ((size_t)snprintf(generated, sizeof generated, "%s/octopus.off", folder) >= sizeof generated ||
      (size_t)snprintf(million, sizeof million, "%s/million.off", folder) >= sizeof million) {
    complain(folder, "the name is too long");
    return 1;
  }
  if (argc == 3 && write_generated(generated) != 0) return 1;
  const char *first = argc == 3 ? generated : argv[3];
  if (write_million(first, million) != 0) return 1;
  json_t *rows = json_array();
  int failed = measure(qmat, folder, first, rows);
  for (int i = 4; i < argc && !failed; i++) failed = measure(qmat, folder, argv[i], rows);
  if (!failed) failed = measure(qmat, folder, million, rows);
  if (!failed) {
    const size_t last = json_array_size(rows) - 1;
    json_t *root = json_object();
    json_object_set_new(root, "processors", json_integer(sysconf(_SC_NPROCESSORS_ONLN)));
    json_object_set(root, "models", rows);
    json_object_set_new(root, "growth_of_time_per_vertex",
                        rounded(microseconds_per_vertex(rows, last) / microseconds_per_vertex(rows, 0)));
    failed = json_dumpf(root, stdout, JSON_INDENT(2)) != 0 || putchar('\n') == EOF;
    json_decref(root);
  }
  json_decref(rows);
  return failed;
}
