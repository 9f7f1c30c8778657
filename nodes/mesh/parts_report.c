/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/mesh/parts_report.h"

#include "core/json_text.h"
#include "nodes/mesh/turned_parts.h"

enum { MOST_LISTED = 64, MOST_CAPS_LISTED = 16 }; /* components and caps that the report lists */

static const char *const kind_names[QMAT_PART_KIND_COUNT] = {[QMAT_PART_CLOSED] = "solid",
                                                             [QMAT_PART_HOLES] = "solid with holes",
                                                             [QMAT_PART_OPEN] = "sheet",
                                                             [QMAT_PART_FLAT] = "sheet of two sides"};

static json_t *describe_part(const qmat_parts *parts, uint32_t number, const uint8_t *facing, const double *cap_areas) {
  const qmat_part *part = &parts->parts[number];
  json_t *caps = json_array(),
         *object = json_pack("{s:I,s:s,s:f}", "triangles", (json_int_t)(part->triangle_count - part->seam_triangles),
                             "taken_for", kind_names[part->kind], "area", part->area - part->seam_area);
  int bad = !caps || !object;
  if (!bad && facing[number] == QMAT_FACING_TURNED) bad |= json_object_set_new(object, "turned", json_true());
  if (!bad && facing[number] == QMAT_FACING_CAVITY) bad |= json_object_set_new(object, "cavity", json_true());
  if (!bad && part->seam_triangles > 0) {
    bad |= qmat_json_set_count(object, "seam_triangles", part->seam_triangles);
    bad |= json_object_set_new(object, "seam_area", json_real(part->seam_area));
  }
  if (!bad && part->kind == QMAT_PART_HOLES) {
    bad |= qmat_json_set_count(object, "caps", part->loop_count);
    for (size_t i = 0; i < part->loop_count && i < MOST_CAPS_LISTED; i++) {
      const qmat_loop *loop = &parts->loops[part->first_loop + i];
      bad |= json_array_append_new(caps, json_pack("{s:I,s:f,s:f}", "sides", (json_int_t)loop->count, "length",
                                                   loop->length, "area", cap_areas[part->first_loop + i]));
    }
    bad |= json_object_set(object, "largest_caps", caps);
  }
  json_decref(caps);
  if (!bad) return object;
  json_decref(object);
  return NULL;
}

int qmat_parts_report(const qmat_parts *parts, const uint8_t *facing, const double *cap_areas, json_t *root) {
  json_t *list = json_array();
  int bad = !list;
  for (uint32_t i = 0; i < parts->part_count && i < MOST_LISTED; i++)
    bad |= json_array_append_new(list, describe_part(parts, i, facing, cap_areas));
  if (parts->part_count > MOST_LISTED)
    bad |= qmat_json_set_count(root, "components_not_listed", parts->part_count - MOST_LISTED);
  return bad | json_object_set_new(root, "components", list);
}
