/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Loads the colliders that the build made, and prints their size. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <qmat.h>

/* The spheres of a .ma file (see README.md for the format); NULL when it cannot be read. */
static double *load_spheres(const char *path, size_t *count) {
  FILE *file = fopen(path, "r");
  size_t cones, slabs;
  double *spheres = NULL;
  *count = 0;
  if (!file) return NULL;
  if (fscanf(file, "%zu %zu %zu", count, &cones, &slabs) == 3 && *count < 1000000) {
    spheres = malloc((*count + 1) * 4 * sizeof *spheres);
    for (size_t i = 0; spheres && i < *count; i++) {
      double *sphere = spheres + 4 * i;
      if (fscanf(file, " v %lf %lf %lf %lf", &sphere[0], &sphere[1], &sphere[2], &sphere[3]) == 4) continue;
      free(spheres);
      spheres = NULL;
    }
  }
  fclose(file);
  return spheres;
}

int main(void) {
  static const char *const names[] = {"crate", "roof"};
  printf("qmat %s\n", qmat_version());
  for (int i = 0; i < 2; i++) {
    char path[1024];
    size_t count;
    snprintf(path, sizeof path, ASSETS "/%s.ma", names[i]);
    double *spheres = load_spheres(path, &count);
    if (!spheres) {
      fprintf(stderr, "%s cannot be read\n", path);
      return 1;
    }
    double largest = 0;
    for (size_t k = 0; k < count; k++) largest = fmax(largest, spheres[4 * k + 3]);
    printf("%s: %zu spheres, the largest of radius %.3f\n", names[i], count, largest);
    free(spheres);
  }
  return 0;
}
