/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_rig_parts.h"

#include <string.h>

#define FREE_ELEMENTS ((size_t)1 << 24)
#define ELEMENTS_PER_BYTE 16

qmat_status qmat_usd_rig_justify(qmat_usd_rig *rig, const qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                 size_t elements) {
  rig->elements += elements;
  if (rig->elements <= FREE_ELEMENTS + ELEMENTS_PER_BYTE * qmat_usd_stage_bytes(stage)) return QMAT_OK;
  qmat_usd_prim_fail(prim, "the scene has more copies of skeletons and their motion than its files justify");
  return prim->log->context->error.status = QMAT_ERROR_GEOMETRY;
}

static int compare_text(const char *a, const char *b, size_t length) {
  const int order = strncmp(a, b, length);
  return order != 0 ? order : a[length] != '\0';
}

size_t qmat_usd_skeleton_find(const qmat_usd_skeleton *skeleton, const char *name, size_t length) {
  size_t low = 0, high = skeleton->count;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    const int order = compare_text(skeleton->names[middle].text, name, length);
    if (order == 0) return skeleton->names[middle].joint;
    if (order < 0)
      low = middle + 1;
    else
      high = middle;
  }
  return SIZE_MAX;
}
