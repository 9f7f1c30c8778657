/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/topology_report.h"

#include "core/json_text.h"
#include "nodes/measure/topology.h"

/* `keys`: Euler characteristic, components, loops, voids. */
static int set_numbers(json_t *root, const qmat_topology *t, bool has_components, const char *const keys[4]) {
  int bad = 0;
  if (t->known || has_components) {
    bad |= json_object_set_new(root, keys[0], json_integer((json_int_t)t->euler));
    bad |= qmat_json_set_count(root, keys[1], t->components);
  }
  if (t->known) {
    bad |= qmat_json_set_count(root, keys[2], t->loops);
    bad |= qmat_json_set_count(root, keys[3], t->voids);
  }
  return bad;
}

qmat_status qmat_topology_report(qmat_context *context, const qmat_medial *medial, const qmat_surface *surface,
                                 json_t *root) {
  static const char *const of_medial[] = {"euler_characteristic", "components", "loops", "voids"};
  static const char *const of_solid[] = {"euler_characteristic_of_solid", "components_of_solid", "loops_of_solid",
                                         "voids_of_solid"};
  qmat_topology topology;
  qmat_status status = qmat_topology_of_medial(context, medial, &topology);
  int bad = status == QMAT_OK ? set_numbers(root, &topology, true, of_medial) : 0;
  if (status == QMAT_OK) status = qmat_topology_of_solid(context, surface, &topology);
  if (status == QMAT_OK) bad |= set_numbers(root, &topology, false, of_solid);
  if (status == QMAT_OK && topology.why_not)
    bad |= json_object_set_new(root, "topology_of_solid_not_known", json_string(topology.why_not));
  if (status != QMAT_OK) return status;
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}
