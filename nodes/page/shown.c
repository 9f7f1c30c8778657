/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/shown.h"

#include <math.h>
#include <string.h>

#include "nodes/measure/unit_spheres.h"
#include "nodes/page/error_detail.h"

/* The least range of colours: below it errors are rounding. */
static const double least_range = 1e-6;
/* Colours between vertices may be this share of the range off. */
static const double colour_tolerance = 0.1;

double qmat_shown_number(const qmat_report *report, const char *key) {
  const json_t *value = report ? json_object_get(report->root, key) : NULL;
  return json_is_number(value) ? json_number_value(value) : NAN;
}

enum { UP_AUTO, UP_Y, UP_Z };
const char *const qmat_up_axes[] = {[UP_AUTO] = "auto", [UP_Y] = "y", [UP_Z] = "z", NULL};

bool qmat_shown_is_z_up(int up, const qmat_scene *scene) {
  if (up != UP_AUTO) return up == UP_Z;
  return scene && (scene->is_z_up || strcmp(scene->format, "stl") == 0);
}

const qmat_value *qmat_shown_given(const qmat_value *value, size_t index) {
  const qmat_value *item = value ? qmat_value_at(value, index) : NULL;
  return item && !qmat_value_failure(item) ? item : NULL;
}

qmat_status qmat_shown_check_counts(qmat_context *context, const qmat_port *inputs, const size_t counts[]) {
  const size_t count = counts[QMAT_SHOWN_MEDIAL];
  for (size_t i = QMAT_SHOWN_MESH; inputs[i].name; i++) {
    if (counts[i] == 0 || counts[i] == count) continue;
    qmat_fail(context, QMAT_ERROR_USAGE, "%zu values for %zu medial meshes", counts[i], count);
    return qmat_fail_field(context, inputs[i].name);
  }
  return QMAT_OK;
}

qmat_status qmat_shown_init(qmat_context *context, const qmat_mesh *mesh, const qmat_medial *medial,
                            const qmat_report *report, qmat_shown *shown) {
  *shown = (qmat_shown){.mesh = mesh, .medial = medial, .unit = *medial};
  qmat_status status = qmat_frame_of_mesh(context, mesh, &shown->frame);
  if (status != QMAT_OK) return qmat_fail_field(context, "mesh");
  status = qmat_unit_spheres(context, &shown->frame, medial, &shown->unit.spheres);
  if (status == QMAT_OK) status = qmat_envelope_of_medial(context, &shown->unit, &shown->envelope);
  if (status == QMAT_OK)
    status = qmat_display_mesh_make(context, mesh, &shown->frame, shown->envelope, &shown->display);
  if (status != QMAT_OK) return status;
  const double epsilon = qmat_shown_number(report, "epsilon");
  shown->range = epsilon > 0 ? epsilon : least_range;
  for (size_t i = 0; i < shown->display.vertex_count && !(epsilon > 0); i++)
    shown->range = fmax(shown->range, fabs(shown->display.errors[i]));
  return qmat_display_mesh_refine(context, shown->envelope, colour_tolerance * shown->range, &shown->display);
}

void qmat_shown_uninit(qmat_shown *shown) {
  qmat_envelope_free(shown->envelope);
  shown->envelope = NULL;
}
