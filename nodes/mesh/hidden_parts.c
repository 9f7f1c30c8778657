/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/hidden_parts.h"

#include <math.h>
#include <string.h>

#include "nodes/mesh/turned_parts.h"
#include "nodes/mesh/union_cgal.h"

qmat_status qmat_count_hidden_parts(qmat_context *context, const qmat_parts *parts, const uint8_t *facing, size_t count,
                                    const uint32_t *part_of, const uint8_t *fates, qmat_hidden_parts *hidden) {
  *hidden = (qmat_hidden_parts){.parts = 0};
  uint8_t *seen = qmat_arena_calloc(&context->arena, parts->part_count, 1); /* the largest fate of its triangles */
  if (!seen) return qmat_fail_memory(context, "the hidden parts");
  for (size_t t = 0; t < count; t++)
    if (fates[t] > seen[part_of[t]]) seen[part_of[t]] = fates[t];
  double room[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY}, least = 0;
  uint32_t turned = UINT32_MAX;
  for (uint32_t i = 0; i < parts->part_count; i++)
    if (seen[i] == QMAT_FATE_SHOWN && facing[i] == QMAT_FACING_TURNED && parts->parts[i].volume < least)
      least = parts->parts[i].volume, turned = i;
  if (turned != UINT32_MAX) qmat_part_grow_box(parts, turned, room);
  for (uint32_t i = 0; i < parts->part_count; i++) {
    if (seen[i] != QMAT_FATE_HIDDEN || qmat_part_is_sheet(&parts->parts[i])) continue;
    double both[6];
    memcpy(both, room, sizeof both);
    qmat_part_grow_box(parts, i, both);
    hidden->parts++;
    hidden->triangles += parts->parts[i].triangle_count - parts->parts[i].seam_triangles;
    hidden->in_room += turned != UINT32_MAX && memcmp(both, room, sizeof both) == 0;
  }
  return QMAT_OK;
}
