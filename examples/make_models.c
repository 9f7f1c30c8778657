/* SPDX-License-Identifier: GPL-3.0-or-later */
/* qmat_models: writes the generated models as OFF files, and their known medial meshes as .ma files. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "examples/models.h"

static const char usage[] =
    "usage: qmat_models NAME [--resolution N] [-o FILE.off] [--medial FILE.ma]\n"
    "       qmat_models all FOLDER [--resolution N]\n"
    "       qmat_models --list\n";

/* Closes a file. Buffered output may fail only here. */
static int close_file(FILE *file, const char *path) {
  const int failed = ferror(file);
  if (fclose(file) == 0 && !failed) return 0;
  fprintf(stderr, "qmat_models: %s: %s\n", path, strerror(errno));
  return 1;
}

static int write_surface(const qmat_model *model, const char *path) {
  FILE *file = strcmp(path, "-") == 0 ? stdout : fopen(path, "w");
  if (!file) {
    fprintf(stderr, "qmat_models: %s: %s\n", path, strerror(errno));
    return 1;
  }
  fprintf(file, "OFF\n%zu %zu 0\n", model->vertex_count, model->triangle_count);
  for (size_t i = 0; i < model->vertex_count; i++) {
    const double *p = model->positions + 3 * i;
    fprintf(file, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
  }
  for (size_t i = 0; i < model->triangle_count; i++) {
    const uint32_t *t = model->triangles + 3 * i;
    fprintf(file, "3 %u %u %u\n", t[0], t[1], t[2]);
  }
  return close_file(file, path);
}

static int write_medial(const qmat_model *model, const char *path) {
  if (model->sphere_count == 0) {
    fprintf(stderr, "qmat_models: the medial axis of %s is not known\n", model->name);
    return 1;
  }
  FILE *file = fopen(path, "w");
  if (!file) {
    fprintf(stderr, "qmat_models: %s: %s\n", path, strerror(errno));
    return 1;
  }
  fprintf(file, "%zu %zu %zu\n", model->sphere_count, model->edge_count, model->medial_triangle_count);
  for (size_t i = 0; i < model->sphere_count; i++) {
    const double *s = model->spheres + 4 * i;
    fprintf(file, "v %.17g %.17g %.17g %.17g\n", s[0], s[1], s[2], s[3]);
  }
  for (size_t i = 0; i < model->edge_count; i++)
    fprintf(file, "e %u %u\n", model->edges[2 * i], model->edges[2 * i + 1]);
  for (size_t i = 0; i < model->medial_triangle_count; i++) {
    const uint32_t *t = model->medial_triangles + 3 * i;
    fprintf(file, "f %u %u %u\n", t[0], t[1], t[2]);
  }
  return close_file(file, path);
}

static int make(const char *name, int resolution, qmat_model *model) {
  const qmat_status status = qmat_model_make(name, resolution, model);
  if (status == QMAT_OK) return 0;
  if (status == QMAT_ERROR_MEMORY) {
    fprintf(stderr, "qmat_models: %s: out of memory\n", name);
    return 1;
  }
  fprintf(stderr, "qmat_models: there is no model '%s' (see --list)\n", name);
  return 2;
}

static int make_all(const char *folder, int resolution) {
  if (mkdir(folder, 0777) != 0 && errno != EEXIST) {
    fprintf(stderr, "qmat_models: %s: %s\n", folder, strerror(errno));
    return 1;
  }
  int failed = 0;
  for (size_t i = 0; i < qmat_model_kind_count && failed == 0; i++) {
    char path[4096];
    qmat_model model;
    failed = make(qmat_model_kinds[i].name, resolution, &model);
    if (failed != 0) break;
    const int length = snprintf(path, sizeof path, "%s/%s.off", folder, model.name);
    if (length < 0 || (size_t)length >= sizeof path) {
      fprintf(stderr, "qmat_models: the name of the folder is too long\n");
      failed = 1;
    } else {
      failed = write_surface(&model, path);
    }
    qmat_model_uninit(&model);
  }
  return failed;
}

int main(int argc, char **argv) {
  const char *name = NULL, *folder = NULL, *output = NULL, *medial = NULL;
  int resolution = 0;
  for (int i = 1; i < argc; i++) {
    const char *word = argv[i];
    const char *value = i + 1 < argc ? argv[i + 1] : NULL;
    if (strcmp(word, "--list") == 0) {
      for (size_t k = 0; k < qmat_model_kind_count; k++) {
        printf("%-16s %s\n", qmat_model_kinds[k].name, qmat_model_kinds[k].summary);
      }
      return 0;
    } else if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
      fputs(usage, stdout);
      return 0;
    } else if (strcmp(word, "--resolution") == 0 && value) {
      char *end;
      const long number = strtol(value, &end, 10);
      if (*end != 0 || number < QMAT_MODEL_RESOLUTION_MIN || number > QMAT_MODEL_RESOLUTION_MAX) {
        fprintf(stderr, "qmat_models: --resolution is a number from %d to %d, not '%s'\n", QMAT_MODEL_RESOLUTION_MIN,
                QMAT_MODEL_RESOLUTION_MAX, value);
        return 2;
      }
      resolution = (int)number;
      i++;
    } else if (strcmp(word, "-o") == 0 && value) {
      output = value;
      i++;
    } else if (strcmp(word, "--medial") == 0 && value) {
      medial = value;
      i++;
    } else if (word[0] != '-' && !name) {
      name = word;
    } else if (word[0] != '-' && !folder && strcmp(name, "all") == 0) {
      folder = word;
    } else {
      fprintf(stderr, "qmat_models: unexpected argument '%s'\n%s", word, usage);
      return 2;
    }
  }
  const bool all = name && strcmp(name, "all") == 0;
  if (!name || all != (folder != NULL) || (all && (output || medial))) {
    fputs(usage, stderr);
    return 2;
  }
  if (all) return make_all(folder, resolution);
  qmat_model model;
  int failed = make(name, resolution, &model);
  if (failed != 0) return failed;
  if (output || !medial) failed = write_surface(&model, output == NULL ? "-" : output);
  if (failed == 0 && medial) failed = write_medial(&model, medial);
  qmat_model_uninit(&model);
  return failed;
}
