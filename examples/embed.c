/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A program that uses the library: a mesh in memory goes in, medial spheres come out, without any file. It shares the
 * cache of the command line, so a second call computes nothing. Ctrl-C cancels.
 *
 *     cc embed.c $(pkg-config --cflags --libs qmat) && ./a.out 5%
 */
#include <signal.h>
#include <stdio.h>

#include <qmat.h>

/* A step: a block of 3 x 1 x 1 with a block of 1 x 1 x 1 on its left end. Counter-clockwise from outside. */
static const double positions[] = {
    0, 0, 0, 3, 0, 0, 3, 0, 1, 1, 0, 1, 1, 0, 2, 0, 0, 2, /* the outline at y = 0 */
    0, 1, 0, 3, 1, 0, 3, 1, 1, 1, 1, 1, 1, 1, 2, 0, 1, 2, /* the outline at y = 1 */
};
static const uint32_t triangles[] = {
    0, 1, 3, 1, 2, 3, 0, 3,  5, 3, 4,  5,  /* front */
    6, 9, 7, 7, 9, 8, 6, 11, 9, 9, 11, 10, /* back */
    0, 6, 7, 0, 7, 1, 1, 7,  8, 1, 8,  2,  2, 8, 9, 2, 9, 3, 3, 9, 10, 3, 10, 4, 4, 10, 11, 4, 11, 5, 5, 11, 6, 5, 6, 0,
};

static volatile sig_atomic_t interrupted;

static void on_interrupt(int number) {
  (void)number;
  interrupted = 1;
}

static bool show_progress(void *user, const char *node, const char *type, uint64_t done, uint64_t total,
                          const char *unit) {
  (void)user;
  (void)type;
  if (total > 0)
    fprintf(stderr, "%s: %llu of %llu %s\n", node, (unsigned long long)done, (unsigned long long)total, unit);
  return !interrupted; /* false cancels */
}

int main(int argc, char **argv) {
  char epsilon[64];
  snprintf(epsilon, sizeof epsilon, "epsilon=%s", argc > 1 ? argv[1] : "5%");

  signal(SIGINT, on_interrupt);
  qmat_job *job;
  qmat_medial_view medial;
  size_t hits, nodes;
  char *folder = qmat_cache_folder();
  qmat_result result = qmat_job_new(&job);
  if (result == QMAT_RESULT_OK) result = qmat_job_cache(job, folder); /* NULL: none */
  if (result == QMAT_RESULT_OK) result = qmat_job_set(job, epsilon);
  if (result == QMAT_RESULT_OK)
    result = qmat_job_give_mesh(job, "model.mesh", "step", positions, sizeof positions / sizeof *positions / 3,
                                triangles, sizeof triangles / sizeof *triangles / 3);
  if (result == QMAT_RESULT_OK) result = qmat_job_want(job, "simple.medial");
  if (result == QMAT_RESULT_OK) result = qmat_job_run(job, 0, show_progress, NULL);
  if (result == QMAT_RESULT_OK) result = qmat_job_medial(job, "simple.medial", &medial);
  if (result == QMAT_RESULT_OK) result = qmat_job_hits(job, &hits, &nodes);
  if (result != QMAT_RESULT_OK) {
    fprintf(stderr, "%s\n", qmat_job_error(job)->text);
  } else {
    printf("%zu spheres, %zu cones, %zu slabs\n", medial.sphere_count, medial.edge_count, medial.triangle_count);
    fprintf(stderr, "%zu of %zu nodes came from the cache\n", hits, nodes);
    for (size_t i = 0; i < medial.sphere_count; i++) {
      const double *sphere = medial.spheres + 4 * i;
      printf("centre %7.4f %7.4f %7.4f  radius %.4f\n", sphere[0], sphere[1], sphere[2], sphere[3]);
    }
  }
  qmat_text_free(folder);
  qmat_job_free(job);
  return (int)result;
}
