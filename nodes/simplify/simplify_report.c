/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/simplify_report.h"

#include <math.h>
#include <stdio.h>

#include "core/json_text.h"
#include "nodes/measure/lost_handles.h"
#include "nodes/measure/topology_report.h"

void qmat_simplify_figures_of(const qmat_decimation *run, qmat_simplify_figures *figures) {
  figures->counts = run->counts;
  figures->constraint_points = run->constraints->count;
  figures->features = run->creases.left;
  figures->crease_error = qmat_crease_guard_error(&run->creases);
  figures->moves = run->moves;
}

/* Loops around lost handles are at most this multiple of epsilon long: a square hole that epsilon closes has eight, and
 * the edges of the mesh lengthen it. */
static const double longest_loop = 12;

/* The report has so many lost handles, and the warnings so many one by one. */
enum { MOST_NAMED = 16, MOST_WARNED = 3 };

static int add_warning(json_t *root, const char *text) {
  json_t *warnings = json_object_get(root, "warnings");
  if (!warnings && json_object_set_new(root, "warnings", warnings = json_array())) return -1;
  return json_array_append_new(warnings, json_string(text));
}

static int warn_of_spheres(json_t *root, const qmat_simplify_figures *f, const qmat_medial *unit, double epsilon) {
  char text[200];
  int length =
      snprintf(text, sizeof text, "%zu spheres are left instead of %zu", unit->sphere_count, f->wanted_spheres);
  if (f->features >= f->wanted_spheres)
    snprintf(text + length, sizeof text - (size_t)length, ": %zu sharp features are kept (features=none)", f->features);
  else if (epsilon > 0)
    snprintf(text + length, sizeof text - (size_t)length, ": fewer are farther than %.3g %% from the surface",
             100 * epsilon);
  return add_warning(root, text);
}

static size_t count_at(const json_t *root, const char *key) {
  return (size_t)json_integer_value(json_object_get(root, key));
}

static int list_handle(json_t *list, const qmat_frame *frame, const qmat_lost_handle *handle) {
  double at[3];
  qmat_frame_to_model(frame, handle->place, 1, at);
  return json_array_append_new(list, json_pack("{s:s, s:[fff], s:f}", "kind", handle->is_hole ? "hole" : "handle",
                                               "place", at[0], at[1], at[2], "size", handle->size));
}

/* One warning for each of a few handles, or one for all: `lost` of `wanted`, `count` of which are located. */
static int warn_of_handles(json_t *root, const qmat_frame *frame, const qmat_lost_handle *handles, size_t count,
                           size_t lost, size_t wanted) {
  char text[200];
  int bad = 0;
  if (count == lost && count <= MOST_WARNED) {
    for (size_t i = 0; i < count; i++) {
      double at[3];
      qmat_frame_to_model(frame, handles[i].place, 1, at);
      snprintf(text, sizeof text, "a %s at (%.5g, %.5g, %.5g), %.2g %% of the diagonal across, is not in the result",
               handles[i].is_hole ? "hole" : "handle", at[0], at[1], at[2], 100 * handles[i].size);
      bad |= add_warning(root, text);
    }
    return bad;
  }
  double largest = 0;
  for (size_t i = 0; i < count; i++) largest = fmax(largest, handles[i].size);
  const int length = snprintf(text, sizeof text, "the result lacks %zu of the solid's %zu handles", lost, wanted);
  if (count > 0)
    snprintf(text + length, sizeof text - (size_t)length,
             "; the report (lost_handles) has the places of %zu, up to %.2g %% of the diagonal across", count,
             100 * largest);
  return add_warning(root, text);
}

/* Names the handles of the solid that the result has lost, where their numbers differ. */
static qmat_status name_lost_handles(qmat_context *context, const qmat_medial *unit, const qmat_surface *surface,
                                     double error, json_t *root) {
  const size_t loops = count_at(root, "loops"), wanted = count_at(root, "loops_of_solid");
  const qmat_frame *frame = qmat_surface_frame(surface);
  qmat_lost_handle *handles;
  size_t count;
  if (!json_object_get(root, "loops") || loops >= wanted || !(error < INFINITY)) return QMAT_OK;
  const size_t most = wanted - loops < MOST_NAMED ? wanted - loops : MOST_NAMED;
  const qmat_status status =
      qmat_lost_handles_find(context, surface, unit, longest_loop * error, most, &handles, &count);
  if (status != QMAT_OK) return status;
  json_t *list = json_array();
  int bad = json_object_set_new(root, "lost_handles", list);
  for (size_t i = 0; i < count && !bad; i++) bad |= list_handle(list, frame, &handles[i]);
  if (!bad) bad |= warn_of_handles(root, frame, handles, count, wanted - loops, wanted);
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

qmat_status qmat_simplify_report(qmat_context *context, const qmat_simplify_figures *f, const qmat_medial *unit,
                                 const qmat_surface *surface, double epsilon, double deviation, qmat_report *report) {
  const struct {
    const char *key;
    size_t count;
    bool shown;
  } counts[] = {{"initial_spheres", f->initial_spheres, true},
                {"spheres", unit->sphere_count, true},
                {"edges", unit->edge_count, true},
                {"triangles", unit->triangle_count, true},
                {"collapses", f->counts.collapses, true},
                {"constraint_points", f->constraint_points, true},
                {"refused_by_inside_test", f->counts.refused_by_inside_test, true},
                {"refused_by_surface_to_envelope", f->counts.refused_by_surface_to_envelope, true},
                {"refused_by_envelope_to_surface", f->counts.refused_by_envelope_to_surface, true},
                {"refused_by_protection", f->counts.refused_by_protection, true},
                {"refused_by_topology", f->counts.refused_by_topology, true},
                {"features", f->features, f->features > 0},
                {"rounds", f->rounds, !f->in_order},
                {"cavity_filling_spheres", f->filled, !f->in_order},
                {"topology_spheres", f->divided, f->divided > 0},
                {"sphere_moves", f->moves, !f->in_order}};
  /* Errors with respect to the surface that the mesh approximates. */
  const struct {
    const char *key;
    double value;
    bool shown;
  } numbers[] = {{"crease_error", f->crease_error, f->features > 0},
                 {"threshold", f->threshold, f->in_order},
                 {"epsilon", epsilon, true},
                 {"surface_to_envelope", f->surface_to_envelope + deviation, true},
                 {"envelope_to_surface", f->envelope_to_surface + deviation, true}};
  json_t *root = report->root;
  int bad = 0;
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i].shown) bad |= qmat_json_set_count(root, counts[i].key, counts[i].count);
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
    if (numbers[i].shown) bad |= json_object_set_new(root, numbers[i].key, json_real(numbers[i].value));
  if (f->wanted_spheres > 0 && unit->sphere_count > f->wanted_spheres) bad |= warn_of_spheres(root, f, unit, epsilon);
  if (bad) return qmat_fail_memory(context, "the report");
  const qmat_status status = qmat_topology_report(context, unit, surface, root);
  const double error = fmax(epsilon, fmax(f->surface_to_envelope, f->envelope_to_surface));
  return status == QMAT_OK ? name_lost_handles(context, unit, surface, error, root) : status;
}
