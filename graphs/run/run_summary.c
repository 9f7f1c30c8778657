/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_summary.h"

static bool take_number(const json_t *report, const char *key, double *number) {
  const json_t *value = json_object_get(report, key);
  if (!json_is_number(value)) return false;
  *number = json_number_value(value);
  return true;
}

/* Takes one report into the summary; false when it lacks a number. */
static bool summarise_report(const json_t *report, qmat_run_summary *summary) {
  double spheres, epsilon, out, in;
  if (!take_number(report, "spheres", &spheres) || !(spheres >= 0 && spheres < 0x1p53) ||
      !take_number(report, "epsilon", &epsilon) || !take_number(report, "surface_to_envelope", &out) ||
      !take_number(report, "envelope_to_surface", &in))
    return false;
  const json_t *certified = json_object_get(report, "certified");
  const bool first = summary->meshes++ == 0;
  summary->spheres += (uint64_t)spheres;
  summary->epsilon = epsilon;
  if (first || out > summary->surface_to_envelope) summary->surface_to_envelope = out;
  if (first || in > summary->envelope_to_surface) summary->envelope_to_surface = in;
  summary->evaluated = (first || summary->evaluated) && json_is_boolean(certified);
  summary->certified = (first || summary->certified) && json_is_true(certified);
  summary->estimate = summary->estimate || json_is_true(json_object_get(report, "estimate"));
  return true;
}

bool qmat_run_summarise(const qmat_run *run, qmat_run_summary *summary) {
  for (size_t i = run->step_count; i-- > 0;) {
    const qmat_run_step *step = &run->steps[i];
    const qmat_node *type = run->graph->nodes[step->node].type;
    bool medial = false;
    for (size_t port = 0; port < qmat_output_count(type); port++)
      if (type->outputs[port].type == QMAT_MEDIAL) medial = true;
    for (size_t port = 0; port < qmat_input_count(type); port++)
      if (type->inputs[port].type == QMAT_MEDIAL) medial = true;
    if (!step->done || !medial || !step->report) continue;
    *summary = (qmat_run_summary){.step = i, .triangles = step->mesh_triangles};
    const json_t *meshes = json_object_get(step->report, "meshes");
    bool whole = meshes || summarise_report(step->report, summary);
    for (size_t k = 0; k < json_array_size(meshes) && whole; k++) {
      const json_t *of_mesh = json_array_get(meshes, k);
      if (json_object_get(of_mesh, "failure"))
        summary->failures++;
      else
        whole = summarise_report(json_object_get(of_mesh, "report"), summary);
    }
    if (whole) return true;
  }
  return false;
}
