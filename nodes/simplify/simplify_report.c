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

static int warn_of_spheres(json_t *root, const qmat_simplify_figures *f, const qmat_medial *unit, double epsilon) {
  char text[200];
  int length =
      snprintf(text, sizeof text, "%zu spheres are left instead of %zu", unit->sphere_count, f->wanted_spheres);
  if (f->features >= f->wanted_spheres)
    snprintf(text + length, sizeof text - (size_t)length, ": %zu sharp features are kept (features=none)", f->features);
  else if (epsilon > 0)
    snprintf(text + length, sizeof text - (size_t)length, ": fewer are farther than %.3g %% from the surface",
             100 * epsilon);
  return qmat_json_add_warning(root, "%s", text);
}

static size_t count_at(const json_t *root, const char *key) {
  return (size_t)json_integer_value(json_object_get(root, key));
}

/* Lists a handle, with a warning of its own if `warns`. */
static int add_handle(json_t *root, json_t *list, const qmat_frame *frame, const qmat_lost_handle *handle, bool warns) {
  const char *kind = handle->is_hole ? "hole" : "handle";
  double at[3];
  qmat_frame_to_model(frame, handle->place, 1, at);
  int bad = json_array_append_new(
      list, json_pack("{s:s, s:[fff], s:f}", "kind", kind, "place", at[0], at[1], at[2], "size", handle->size));
  if (warns)
    bad |=
        qmat_json_add_warning(root, "a %s at (%.5g, %.5g, %.5g), %.2g %% of the diagonal across, is not in the result",
                              kind, at[0], at[1], at[2], 100 * handle->size);
  return bad;
}

/* One warning for all lost handles. The first `count` are located; without them `largest` is 0. */
static int warn_of_handles(json_t *root, size_t lost, size_t wanted, size_t count, double largest) {
  if (count == 0) return qmat_json_add_warning(root, "the result lacks %zu of the solid's %zu handles", lost, wanted);
  return qmat_json_add_warning(root,
                               "the result lacks %zu of the solid's %zu handles; the report (lost_handles) has the "
                               "places of %zu, up to %.2g %% of the diagonal across",
                               lost, wanted, count, 100 * largest);
}

/* Names the handles of the solid that the result has lost, where their numbers differ. */
static qmat_status name_lost_handles(qmat_context *context, const qmat_medial *unit, const qmat_surface *surface,
                                     double error, json_t *root) {
  const size_t loops = count_at(root, "loops"), wanted = count_at(root, "loops_of_solid");
  qmat_lost_handle *handles;
  size_t count;
  if (!json_object_get(root, "loops") || loops >= wanted || !(error < INFINITY)) return QMAT_OK;
  const size_t lost = wanted - loops, most = lost < MOST_NAMED ? lost : MOST_NAMED;
  const qmat_status status =
      qmat_lost_handles_find(context, surface, unit, longest_loop * error, most, &handles, &count);
  if (status != QMAT_OK) return status;
  json_t *list = json_array();
  int bad = json_object_set_new(root, "lost_handles", list);
  const bool are_few = count == lost && count <= MOST_WARNED;
  double largest = 0;
  for (size_t i = 0; i < count && !bad; i++) {
    bad |= add_handle(root, list, qmat_surface_frame(surface), &handles[i], are_few);
    largest = fmax(largest, handles[i].size);
  }
  if (!bad && !are_few) bad |= warn_of_handles(root, lost, wanted, count, largest);
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

/* Warns of what the result has more than the solid: no lost handle makes up for it. */
static int warn_of_more(json_t *root, const char *key, const char *key_of_solid, const char *what) {
  const size_t count = count_at(root, key), wanted = count_at(root, key_of_solid);
  if (!json_object_get(root, key) || !json_object_get(root, key_of_solid) || count <= wanted) return 0;
  return qmat_json_add_warning(root, "the result has more %s than the solid: %zu instead of %zu", what, count, wanted);
}

/* Warns where solids share spheres: those that touch at a point, or nearly touch. */
static int warn_of_joined(json_t *root) {
  const size_t count = count_at(root, "components"), wanted = count_at(root, "components_of_solid");
  if (!json_object_get(root, "components_of_solid") || count >= wanted) return 0;
  return qmat_json_add_warning(root, "the result joins components of the solid: it has %zu instead of %zu", count,
                               wanted);
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
  if (status == QMAT_OK)
    bad = warn_of_joined(root) | warn_of_more(root, "loops", "loops_of_solid", "handles") |
          warn_of_more(root, "voids", "voids_of_solid", "voids");
  if (bad) return qmat_fail_memory(context, "the report");
  const double error = fmax(epsilon, fmax(f->surface_to_envelope, f->envelope_to_surface));
  return status == QMAT_OK ? name_lost_handles(context, unit, surface, error, root) : status;
}
