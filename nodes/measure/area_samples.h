/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MEASURE_AREA_SAMPLES_H
#define QMAT_NODES_MEASURE_AREA_SAMPLES_H

#include "core/context.h"

/* What samples add up to: two sums, two maxima (0 at least), and a count. Their meaning is the caller's. */
typedef struct qmat_area_sums {
  double sum[2], largest[2];
  size_t count;
} qmat_area_sums;

/* Samples spread evenly over the area of a row of elements. */
typedef struct qmat_area_samples {
  const double *areas; /* per element: the area of all elements up to this one, itself included */
  size_t element_count, sample_count;
  uint64_t stream; /* of random numbers (core/hash.h) */
  const char *progress;
  /* Adds a sample to `sums`: a point of `element`, chosen by two even random numbers in [0, 1). Runs in any thread. */
  void (*add)(const void *data, size_t element, double x, double y, qmat_area_sums *sums);
  const void *data;
} qmat_area_samples;

/* Makes the samples and adds them up. Sample i lies in the element where the running area passes (i + 1/2) /
 * sample_count of the whole. All is 0 where the area is 0. QMAT_ERROR_MEMORY, QMAT_CANCELLED. All threads; the sums do
 * not depend on their number. Cost: linear in the samples. */
qmat_status qmat_area_samples_sum(qmat_context *context, const qmat_area_samples *samples, qmat_area_sums *sums);

/* Fills `areas`, as above, for `count` triangles: 3 vertex ids each, 3 coordinates a vertex. */
void qmat_running_areas(const double *positions, const uint32_t *triangles, size_t count, double *areas);

/* The first of `count` (> 0) elements whose running area (`areas` as above) exceeds `area`; the last if none does. */
size_t qmat_area_element_at(const double *areas, size_t count, double area);

/* The point of the triangle abc (3 doubles each) for two even random numbers: even in its area. */
void qmat_triangle_point(const double a[3], const double b[3], const double c[3], double x, double y, double point[3]);

#endif
