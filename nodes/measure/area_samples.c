/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/area_samples.h"

#include <math.h>

#include "core/geometry/triangle.h"
#include "core/hash.h"

/* Sums are taken over blocks of samples and then in the order of the blocks, so that they do not depend on threads. */
enum { BLOCK_SAMPLES = 512, SLICE_BLOCKS = 16 };

void qmat_running_areas(const double *positions, const uint32_t *triangles, size_t count, double *areas) {
  double area = 0, normal[3];
  for (size_t i = 0; i < count; i++) {
    const uint32_t *row = &triangles[3 * i];
    areas[i] = area += qmat_triangle_area(&positions[3 * (size_t)row[0]], &positions[3 * (size_t)row[1]],
                                          &positions[3 * (size_t)row[2]], normal);
  }
}

size_t qmat_area_element_at(const double *areas, size_t count, double area) {
  size_t low = 0, high = count - 1;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    if (areas[middle] > area)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

static qmat_area_sums sum_block(const qmat_area_samples *s, size_t block) {
  const double area = s->areas[s->element_count - 1];
  qmat_area_sums sums = {.count = 0};
  for (size_t i = block * BLOCK_SAMPLES; i < s->sample_count && i < (block + 1) * BLOCK_SAMPLES; i++) {
    const size_t element =
        qmat_area_element_at(s->areas, s->element_count, area * (((double)i + 0.5) / (double)s->sample_count));
    s->add(s->data, element, qmat_hash_unit(qmat_hash3(s->stream, i, 0)), qmat_hash_unit(qmat_hash3(s->stream, i, 1)),
           &sums);
  }
  return sums;
}

qmat_status qmat_area_samples_sum(qmat_context *context, const qmat_area_samples *samples, qmat_area_sums *sums) {
  *sums = (qmat_area_sums){.count = 0};
  if (samples->element_count == 0 || !(samples->areas[samples->element_count - 1] > 0)) return QMAT_OK;
  const size_t blocks = (samples->sample_count + BLOCK_SAMPLES - 1) / BLOCK_SAMPLES;
  qmat_area_sums *of_blocks = qmat_arena_alloc(&context->arena, SLICE_BLOCKS, sizeof *of_blocks);
  if (!of_blocks) return qmat_fail_memory(context, samples->progress);
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < blocks; first += SLICE_BLOCKS) {
    const qmat_status status = qmat_progress(context, first, blocks, samples->progress);
    if (status != QMAT_OK) return status;
    const size_t last = first + SLICE_BLOCKS < blocks ? first + SLICE_BLOCKS : blocks;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t block = first; block < last; block++) of_blocks[block - first] = sum_block(samples, block);
    for (size_t block = first; block < last; block++) {
      const qmat_area_sums *of_block = &of_blocks[block - first];
      for (int k = 0; k < 2; k++) {
        sums->sum[k] += of_block->sum[k];
        sums->largest[k] = qmat_larger(sums->largest[k], of_block->largest[k]);
      }
      sums->count += of_block->count;
    }
  }
  return QMAT_OK;
}

void qmat_triangle_point(const double a[3], const double b[3], const double c[3], double x, double y, double point[3]) {
  const double root = sqrt(x);
  for (int k = 0; k < 3; k++) point[k] = (1 - root) * a[k] + root * (1 - y) * b[k] + root * y * c[k];
}
