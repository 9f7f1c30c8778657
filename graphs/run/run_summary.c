/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_summary.h"

const char *const *qmat_value_count_names(qmat_value_type type) {
  static const char *const none[] = {NULL}, *const mesh[] = {"vertices", "triangles", NULL},
                           *const field[] = {"values", NULL}, *const samples[] = {"samples", NULL},
                           *const medial[] = {"spheres", "cones", "slabs", NULL}, *const file[] = {"parts", NULL},
                           *const chain[] = {"spheres", "collapses", NULL};
  switch (type) {
    case QMAT_MESH:
      return mesh;
    case QMAT_FIELD:
      return field;
    case QMAT_SAMPLES:
      return samples;
    case QMAT_MEDIAL:
      return medial;
    case QMAT_CHAIN:
      return chain;
    case QMAT_FILE:
      return file;
    default:
      return none;
  }
}

void qmat_value_counts(const qmat_value *value, size_t counts[3]) {
  counts[0] = counts[1] = counts[2] = 0;
  for (size_t i = 0; value->type == QMAT_LIST && i < qmat_value_count(value); i++) {
    size_t of_item[3];
    qmat_value_counts(qmat_value_at(value, i), of_item);
    for (int k = 0; k < 3; k++) counts[k] += of_item[k];
  }
  switch (value->type) {
    case QMAT_MESH:
      counts[0] = ((const qmat_mesh *)value)->vertex_count;
      counts[1] = ((const qmat_mesh *)value)->triangle_count;
      break;
    case QMAT_FIELD:
      counts[0] = ((const qmat_field *)value)->count;
      break;
    case QMAT_SAMPLES:
      counts[0] = ((const qmat_samples *)value)->count;
      break;
    case QMAT_MEDIAL:
      counts[0] = ((const qmat_medial *)value)->sphere_count;
      counts[1] = ((const qmat_medial *)value)->edge_count;
      counts[2] = ((const qmat_medial *)value)->triangle_count;
      break;
    case QMAT_CHAIN:
      counts[0] = ((const qmat_chain *)value)->sphere_count;
      counts[1] = ((const qmat_chain *)value)->collapse_count;
      break;
    case QMAT_FILE:
      counts[0] = ((const qmat_file *)value)->part_count;
      break;
    default:
      break;
  }
}

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
